"""Columns with times, components and headings: what is read, what is refused, and that every remedy
leads on."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vi_contact.core.errors import InputError
from vi_contact.practice.cli.entry import main
from vi_contact.practice.ground_motion import (
    Record,
    read_record,
    record_info,
    write_at2,
    write_columns,
)

pytestmark = pytest.mark.serial
G = 9.80665
V = np.array([0.0, 0.01, -0.03, 0.02, 0.0, 0.015, -0.005, 0.025, 0.0, -0.01])


def write(folder: Path, text: str) -> Path:
    path = folder / "record.txt"
    path.write_bytes(text.encode())
    return path


def table(*columns: Any, head: str = "", separator: str = " ", step: float = 0.01) -> str:
    """Rows of a time and these columns."""
    cells = (
        [f"{step * k:.2f}", *(f"{column[k]:.5f}" for column in columns)] for k in range(len(V))
    )
    return head + "\n".join(separator.join(row) for row in cells) + "\n"


def refusal(path: Path, **options: Any) -> str:
    with pytest.raises(InputError) as refused:
        read_record(path, **options)
    sentence = str(refused.value)
    assert sentence.startswith(str(path)) and "\n" not in sentence
    return sentence


# --- times beside several components
# ---------------------------------------------------------------------------------

THREE = table(V, 2.0 * V, head="# time [s], north [g], east [g]\n")


@pytest.mark.parametrize("options", [{}, {"units": "g"}, {"units": "g", "dt": 0.01}, {"dt": 0.5}])
def test_components_beside_a_time_are_never_read_as_one_series(
    options: dict[str, Any], tmp_path: Path
) -> None:
    assert "2 channels (1: north, 2: east); pass channel=" in refusal(
        write(tmp_path, THREE), **options
    )
    bare = write(tmp_path, table(V, 2.0 * V))
    assert "2 channels (1: column 2, 2: column 3); pass channel=" in refusal(bare, **options)


@pytest.mark.parametrize(
    "channel, factor", [(1, 1.0), (2, 2.0), ("north", 1.0), ("EAST", 2.0), ("2", 2.0)]
)
def test_a_component_is_chosen_by_number_or_name(
    channel: int | str, factor: float, tmp_path: Path
) -> None:
    for options in ({}, {"dt": 0.01}):
        record = read_record(write(tmp_path, THREE), "g", channel=channel, **options)
        assert np.array_equal(record.acceleration, G * factor * V) and np.isclose(
            record.dt, 0.01, rtol=1e-12
        )
    assert record.component == ("north" if factor == 1.0 else "east")
    assert "there is no channel 'up'" in refusal(write(tmp_path, THREE), channel="up")
    assert "there is no channel 3" in refusal(write(tmp_path, THREE), channel=3)


def test_the_command_takes_a_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = write(tmp_path, THREE)
    assert main(["motion", "info", str(path), "--channel", "east"]) == 0
    said = capsys.readouterr().out.splitlines()
    for row in (
        "component           east",
        "units from          header, line 1",
        "dt from             times in the file",
        "samples from        counted",
        "samples             10",
    ):
        assert row in said
    assert main(["motion", "info", str(path)]) != 0
    assert "pass --channel" in capsys.readouterr().err


@pytest.mark.long
def test_a_doubt_is_printed_as_one(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text = "".join(f"{20 * k} {value:.4f}\n" for k, value in enumerate(V))
    record = read_record(write(tmp_path, text), "g", dt=0.02)
    assert record.dt == 0.02 and np.array_equal(record.acceleration, G * V)
    assert (
        "doubt               the times are taken to be milliseconds, as the time step says"
        in record_info(record)
    )
    assert (
        main(["motion", "info", str(tmp_path / "record.txt"), "--units", "g", "--dt", "0.02"]) == 0
    )
    said = capsys.readouterr().out
    assert (
        "\ndoubt               the times are taken" in said
        and "\ndt from             times in the file" in said
    )


def test_first_columns_of_numbers_and_of_times(tmp_path: Path) -> None:
    numbered = "".join(f"{k + 1} {value:.4f}\n" for k, value in enumerate(V))
    assert "numbers of samples; pass the time step" in refusal(write(tmp_path, numbered), units="g")
    record = read_record(write(tmp_path, numbered), "g", dt=0.01)
    assert record.dt == 0.01 and np.array_equal(record.acceleration, G * V)
    both = "".join(f"{k + 1} {0.01 * k:.2f} {value:.4f}\n" for k, value in enumerate(V))
    record = read_record(write(tmp_path, both), "g")
    assert np.isclose(record.dt, 0.01, rtol=1e-12) and np.array_equal(record.acceleration, G * V)


def test_three_components_without_a_time_are_asked_for(tmp_path: Path) -> None:
    path = write(tmp_path, "".join(f"{v:.4f} {2.0 * v:.4f} {0.3 - v:.4f}\n" for v in V))
    assert "pass dt= in seconds, and channel= for one of the columns" in refusal(path, units="g")
    assert "pass channel= for one of them" in refusal(path, units="g", dt=0.01)
    assert np.array_equal(
        read_record(path, "g", dt=0.01, channel=2).acceleration, G * np.round(2.0 * V, 4)
    )


# --- headings
# --------------------------------------------------------------------------------------------------

HEADED = {
    "two": (table(V, head="Time [s],Acceleration [g]\n", separator=","), {}, G),
    "four": (
        table(
            V,
            0 * V + 1.0,
            0 * V + 2.0,
            head="Time [s],Acceleration [g],Velocity [m/s],Displacement [m]\n",
            separator=",",
        ),
        {},
        G,
    ),
    "velocity first": (table(0 * V + 1.0, V, head="t v a\n"), {"units": "g"}, G),
    "two lines": (table(V, head="Time  Acc\n(s)  (cm/s^2)\n"), {}, 0.01),
    "title and names": (
        table(
            V,
            head="The earthquake of 1994.\nSource: a database\nTime[s] Accel[g]\n",
            separator="\t",
        ),
        {},
        G,
    ),
    "milliseconds": (
        "Time (ms),Acc (g)\n" + "".join(f"{10 * k},{v:.5f}\n" for k, v in enumerate(V)),
        {},
        G,
    ),
    "key and value": (
        "Event Date & Time             : 2000-01-01 00:00:00\nTime Increment (s)            : "
        "0.01\n"
        "Number of Data                : 10\nPGA (m/s/s)                   : 3.0000000E-02\n"
        "Accelaration time series in m/s/s\n" + " ".join(f"{v:.7E}" for v in V) + "\n",
        {},
        1.0,
    ),
    "two lines of eqsig": ("m1\n10 0.0100\n" + "".join(f"{v:.6f}\n" for v in V), {"units": "g"}, G),
    "count and step on lines": (
        "10\n0.0100\n" + "".join(f"{v:.6f}\n" for v in V),
        {"units": "g"},
        G,
    ),
    "comments": ("# units: cm/s2\n# dt: 0.01\n" + "".join(f"{v}\n" for v in V), {}, 0.01),
    "rate": (
        "SAMPLING RATE=  100Hz\nUNIT  = gal(cm/s/s)\nNS,EW,UD\n"
        + "".join(f"{-v},{v},1\n" for v in V),
        {"channel": "EW"},
        0.01,
    ),
    "decimal commas": (
        table(V, head="Zeit [s];Beschleunigung [m/s²]\n", separator=";").replace(".", ","),
        {},
        1.0,
    ),
    "a mark and times": (
        "text\n*** Begin data ***\n" + table(V) + "*** End Data ***\n",
        {"units": "g"},
        G,
    ),
    "windows": (
        "\ufeff"
        + table(V, head="Time [s],Acceleration [g]\n", separator=",").replace("\n", "\r\n"),
        {},
        G,
    ),
    "trailing commas": (table(V, separator=",").replace("\n", ",\n"), {"units": "g"}, G),
}


@pytest.mark.parametrize("name", HEADED)
def test_headings_are_read(name: str, tmp_path: Path) -> None:
    text, options, unit = HEADED[name]
    record = read_record(write(tmp_path, text), **options)
    assert np.allclose(record.acceleration, unit * V, rtol=1e-14, atol=0.0)
    assert np.isclose(record.dt, 0.01, rtol=1e-12)


@pytest.mark.parametrize(
    "text, options, words",
    [
        (
            HEADED["two"][0],
            {"units": "gal"},
            "line 1: the file states its units as g but units='gal' was passed",
        ),
        (HEADED["two"][0], {"dt": 0.02}, "states a time step of 0.01 s but dt=0.02 was passed"),
        (
            "dt = 0.02\n" + HEADED["two"][0],
            {},
            "line 1: the header states a time step of 0.02 s but the times",
        ),
        ("NPTS = 11\n" + HEADED["two"][0], {}, "line 1: 11 samples are announced but 10 follow"),
        (
            HEADED["two lines of eqsig"][0].rstrip().rpartition("\n")[0],
            {"units": "g"},
            "line 2: 10 samples are announced",
        ),
        (
            HEADED["key and value"][0].replace(": 10\n", ": 11\n"),
            {},
            "line 3: 11 samples are announced but 10 follow",
        ),
        (
            table(V, head="Time [s],Velocity [m/s]\n", separator=","),
            {"units": "g"},
            "line 1: the heading names no accel",
        ),
        (
            table(V, head="t,v\n", separator=","),
            {"units": "g"},
            "line 1: the heading names no acceleration",
        ),
        (table(V, head="Velocity record\n"), {"units": "gal"}, "line 1: the header says velocity"),
        (
            "Displacement history, 100 Hz\n" + "1\n" * 20,
            {"units": "gal"},
            "line 1: the header says displacement",
        ),
        (
            table(V, head="Time (s),Acc (mg)\n", separator=","),
            {"units": "g"},
            "line 1: 'mg' is not a unit of acceleration",
        ),
        (table(V, head="Time (h),Acc (g)\n", separator=","), {}, "line 1: 'h' is no unit of time"),
        (
            table(V, separator="\t").replace(".", ","),
            {"units": "g"},
            "may be a decimal comma or a separator",
        ),
        (
            table(V).replace(" 0.02500", " -999"),
            {"units": "g"},
            "line 8: the sample -999 stands for a missing value",
        ),
        (
            table(V).replace("0.02500", "9999.999"),
            {"units": "g"},
            "line 8: the sample 9999.999 stands for",
        ),
        (
            table(V).replace("0.02500", "-9.99E+02"),
            {"units": "g"},
            "line 8: the sample -999 stands for",
        ),
        (table(V).replace("0.02500", "1.234E"), {"units": "g"}, "line 8: '1.234E' is not a number"),
        (table(V).replace("0.02500", "1.23E-"), {"units": "g"}, "line 8: '1.23E-' is not a number"),
        (
            table(V).replace("0.02500", "0.123-105"),
            {"units": "g"},
            "line 8: '0.123-105' is not a number",
        ),
        (
            table(V, separator=",").replace("0.02500", ""),
            {"units": "g"},
            "line 8: the row has 1 values",
        ),
        (
            table(V, V, separator=",").replace(",0.02500,", ",,"),
            {"units": "g"},
            "line 8: a cell is empty",
        ),
        (
            "0.1\n0.2\n\n0.3\n0.5\n",
            {"units": "gal", "dt": 0.01},
            "line 3: the line is empty among values",
        ),
        (
            "".join(f"{v:.3E}\n" for v in V) + "1.0E-0\n",
            {"units": "g", "dt": 0.01},
            "line 11: the exponent of '1.0E-0'",
        ),
        (
            "".join(f"{v:.5f}\n" for v in V) + "0.01",
            {"units": "g", "dt": 0.01},
            "line 11: the last number '0.01' is cut",
        ),
    ],
    ids=lambda value: value if isinstance(value, str) and "\n" not in value else "",
)
def test_what_contradicts_or_lacks_is_refused_at_its_place(
    text: str, options: dict[str, Any], words: str, tmp_path: Path
) -> None:
    assert words in refusal(write(tmp_path, text), **options)


@pytest.mark.parametrize("kind", ["VELOCITY", "DISPLACEMENT"])
def test_a_header_of_at2_is_believed_before_an_option(kind: str, tmp_path: Path) -> None:
    text = "PEER\nT\n{} TIME HISTORY\nNPTS= 10, DT= .02\n" + " ".join(f"{v:.5f}" for v in V) + "\n"
    assert f"line 3: the header says {kind.lower()}" in refusal(
        write(tmp_path, text.format(kind)), units="cm/s2"
    )
    record = read_record(write(tmp_path, text.format("ACCELERATION")), "cm/s2")
    assert np.allclose(record.acceleration, 0.01 * V) and record.units_from == "option"


def test_at2_with_a_mark_and_npts_says_both_once_or_twice_alike(tmp_path: Path) -> None:
    text = (
        "Made motion, north south\n10 points at equal spacing of 0.02 sec\nPoints are listed in "
        "the format of "
        "8F10.5, i.e., 8 points across in\na row with 5 decimal places\nThe units are (g)\n*** "
        "Begin data ***\n"
        "NPTS=    10, DT= .02000 SEC\n"
        + "".join(f"{v:10.5f}" + "\n" * (k == 7) for k, v in enumerate(V))
        + "\n*** End Data ***\n"
    )
    record = read_record(write(tmp_path, text))
    assert (
        record.dt == 0.02
        and np.array_equal(record.acceleration, G * V)
        and record.format == "PEER AT2"
    )
    assert (record.units_from, record.dt_from) == ("header, line 5", "header, line 7")
    for old, new, words in (
        ("10 points", "11 points", "line 2: the header states the number of samples as 11"),
        ("0.02 sec", "0.01 sec", "line 2: the header states the time step as 0.01"),
        ("NPTS=    10", "NPTS=    11", "as 10, but line 7 states it as 11"),
    ):
        assert words in refusal(write(tmp_path, text.replace(old, new)))


# --- times that are rounded
# ------------------------------------------------------------------------------------------


def single(count: int, start: float = -113.17, step: float = 0.01) -> np.ndarray:
    return (np.float32(start) + np.float32(step) * np.arange(count).astype(np.float32)).astype(
        float
    )


@pytest.mark.parametrize("options", [{}, {"resample_dt": 0.01}, {"dt": 0.01}])
def test_times_in_single_precision(options: dict[str, Any], tmp_path: Path) -> None:
    values = np.tile(V, 4)
    text = "".join(f"{t:.6f} {v:.10e}\n" for t, v in zip(single(40), values, strict=True))
    record = read_record(write(tmp_path, text), "g", **options)
    assert record.dt == 0.01 and np.array_equal(record.acceleration, G * values)


@pytest.mark.parametrize("step", [1.0 / 128.0, 1.0 / 300.0, 0.0125])
def test_times_with_few_decimals(step: float, tmp_path: Path) -> None:
    count, decimals = 400, 4
    text = "".join(f"{step * k:.{decimals}f} {np.sin(k):.5f}\n" for k in range(count))
    assert read_record(write(tmp_path, text), "g").dt == pytest.approx(step, rel=1e-12)


def test_a_row_that_is_lost_from_rounded_times_is_seen(tmp_path: Path) -> None:
    lines = [f"{t:.6f} {v:.5f}" for t, v in zip(single(40), np.tile(V, 4), strict=True)]
    for lost in range(1, 39):
        assert "pass resample_dt=" in refusal(
            write(tmp_path, "\n".join(lines[:lost] + lines[lost + 1 :])), units="g"
        )


def test_interpolation_keeps_the_last_sample(tmp_path: Path) -> None:
    times = [0.0, 0.01, 0.02, 0.035, 0.04, 0.05]
    text = "".join(f"{t + 100.0:.6f} {10.0 * t:.5f}\n" for t in np.float32(times).astype(float))
    record = read_record(write(tmp_path, text), "m/s2", resample_dt=0.01)
    assert record.acceleration.size == 6 and record.acceleration[-1] == 0.5


# --- rows
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("row", range(10))
def test_a_row_of_a_series_that_lost_a_value_is_refused(row: int, tmp_path: Path) -> None:
    values = np.random.default_rng(3).uniform(-1.0, 1.0, (10, 8))
    rows = [[f"{v:.4f}" for v in line] for line in values]
    whole = write(tmp_path, "\n".join(map(" ".join, rows)))
    assert read_record(whole, "gal", dt=0.01).acceleration.size == 80
    del rows[row][3]
    path = write(tmp_path, "\n".join(map(" ".join, rows)))
    if row < 9:
        assert f"line {row + 1}: the row has 7 values and other rows have 8" in refusal(
            path, units="gal", dt=0.01
        )
    else:  # a short last row is usual, and nothing says how many there were
        assert read_record(path, "gal", dt=0.01).acceleration.size == 79


def test_what_is_written_is_believed_when_it_is_read_again(tmp_path: Path) -> None:
    """Notes and titles speak of the file that a record came from: its units and its step are not
    those of this one."""
    record = Record(
        acceleration=V,
        dt=0.005,
        title="16 points at equal spacing of 0.02 sec, VELOCITY record",
        notes=(
            "ACCELERATION TIME SERIES IN UNITS OF G",
            "NPTS= 11, DT= .02",
            "resampled from 0.02 s to 0.005 s",
        ),
    )
    write_columns(record, tmp_path / "a.txt", "gal")
    write_at2(record, tmp_path / "a.at2", "gal")
    for name in ("a.txt", "a.at2"):
        found = read_record(tmp_path / name)
        assert np.allclose(found.acceleration, V, rtol=6e-9) and np.isclose(
            found.dt, 0.005, rtol=1e-12
        )
    assert "states its units as gal" in refusal(tmp_path / "a.txt", units="g")


# --- every remedy that a sentence offers
# -----------------------------------------------------------------------------

PLAIN = "".join(f"{v:.5f}\n" for v in V)
COMPONENTS = "".join(f"{v:.5f} {2.0 * v:.5f} {0.3 - v:.5f}\n" for v in V)


def rows_one_a_line(text: str) -> str:
    return text.replace(" ", "\n")


REMEDIES: dict[
    str, tuple[str, dict[str, Any], str, Callable[[str], str] | None, dict[str, Any], Any]
] = {
    # what is refused, with which options; the remedy's words; the file and the options after it;
    # the right samples
    "units": (PLAIN, {"dt": 0.01}, "pass units=", None, {"units": "g", "dt": 0.01}, G * V),
    "dt": (PLAIN, {"units": "g"}, "pass dt= in seconds", None, {"units": "g", "dt": 0.01}, G * V),
    "channel": (THREE, {}, "pass channel=", None, {"channel": 2}, G * 2.0 * V),
    "channel, and dt said": (
        THREE,
        {"dt": 0.01},
        "pass channel=",
        None,
        {"channel": 2, "dt": 0.01},
        G * 2.0 * V,
    ),
    "dt and channel": (
        COMPONENTS,
        {"units": "g"},
        "pass dt= in seconds, and channel=",
        None,
        {"units": "g", "dt": 0.01, "channel": 2},
        G * 2.0 * V,
    ),
    "channel without a time": (
        COMPONENTS,
        {"units": "g", "dt": 0.01},
        "pass channel=",
        None,
        {"units": "g", "dt": 0.01, "channel": 1},
        G * V,
    ),
    "one value a line": (
        COMPONENTS,
        {"units": "g", "dt": 0.01},
        "write one value a line",
        rows_one_a_line,
        {"units": "g", "dt": 0.01},
        G * np.column_stack([V, 2.0 * V, 0.3 - V]).ravel(),
    ),
    "leave units out": (HEADED["two"][0], {"units": "gal"}, "leave units out", None, {}, G * V),
    "leave dt out": (HEADED["two"][0], {"dt": 0.5}, "leave dt out", None, {}, G * V),
    "dt of milliseconds": (
        table(V, step=20.0),
        {"units": "g"},
        "as dt= in seconds",
        None,
        {"units": "g", "dt": 0.02},
        G * V,
    ),
    "dt of seconds": (
        table(V, step=2.0),
        {"units": "g"},
        "as dt= in seconds",
        None,
        {"units": "g", "dt": 2.0},
        G * V,
    ),
    "another dt": (
        table(V, step=20.0),
        {"units": "g", "dt": 0.5},
        "as dt= in seconds",
        None,
        {"units": "g", "dt": 0.02},
        G * V,
    ),
    "decimal points": (
        table(V, separator="\t").replace(".", ","),
        {"units": "g"},
        "write decimal points",
        lambda text: text.replace(",", "."),
        {"units": "g"},
        G * V,
    ),
    "resample_dt": (
        "0.00 0.0\n0.01 0.1\n0.03 0.3\n0.04 0.4\n",
        {"units": "m/s2"},
        "pass resample_dt=",
        None,
        {"units": "m/s2", "resample_dt": 0.01},
        np.array([0.0, 0.1, 0.2, 0.3, 0.4]),
    ),
    "largest": (
        "0\n300\n",
        {"units": "g", "dt": 0.01},
        "give the right units=",
        None,
        {"units": "gal", "dt": 0.01},
        np.array([0.0, 3.0]),
    ),
    "take the empty line out": (
        PLAIN.replace("\n", "\n\n", 1),
        {"units": "g", "dt": 0.01},
        "take the line out",
        lambda text: text.replace("\n\n", "\n"),
        {"units": "g", "dt": 0.01},
        G * V,
    ),
    "leave channel out": (
        "PEER\nACCELERATION IN UNITS OF G\nNPTS= 10, DT= .01\n" + PLAIN,
        {"channel": 1},
        "leave channel out",
        None,
        {},
        G * V,
    ),
}


@pytest.mark.parametrize("name", REMEDIES)
def test_the_remedy_that_is_offered_gives_the_right_samples(name: str, tmp_path: Path) -> None:
    text, options, remedy, change, better, right = REMEDIES[name]
    assert remedy in refusal(write(tmp_path, text), **options)
    record = read_record(write(tmp_path, text if change is None else change(text)), **better)
    assert record.acceleration.shape == right.shape and np.allclose(
        record.acceleration, right, rtol=1e-12, atol=1e-15
    )


def test_a_record_of_five_samples_is_told_without_a_mean_period(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Its frequencies are 40 Hz apart, so that none lies between 0.25 and 20 Hz; all else is
    told."""
    heading = "Time Increment (s) : 0.005\nNumber of Data : 5\nAcceleration time series in m/s/s\n"
    text = f"{heading}0.0\n0.1\n-0.3\n0.2\n0.0\n"
    path = write(tmp_path, text)
    assert main(["motion", "info", str(path)]) == 0
    printed = capsys.readouterr().out
    assert "mean period         (the record has no motion from 0.25 to 20 Hz)" in printed
    assert "samples             5" in printed
