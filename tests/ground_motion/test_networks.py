"""Files of GeoNet, BHRC, RENADIC, USC, UNAM and CWA: components, what the header says twice, and
formats not read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from record_layouts import LAYOUTS, geonet, unam_head, volume1_head

from vi_contact.core.errors import InputError
from vi_contact.practice.ground_motion import read_record

pytestmark = pytest.mark.serial
G = 9.80665
V = np.array(
    [
        0.0,
        0.1,
        -0.3,
        1.2,
        -2.5,
        5.0,
        -12.4,
        20.1,
        -41.6,
        33.0,
        -15.2,
        8.8,
        -4.4,
        2.2,
        -1.1,
        0.6,
        -0.3,
        0.1,
        0.0,
        0.0,
        3.5,
    ]
)


def write(folder: Path, text: str) -> Path:
    path = folder / "record.txt"
    path.write_text(text)
    return path


def refusal(path: Path, **options: Any) -> str:
    with pytest.raises(InputError) as refused:
        read_record(path, **options)
    sentence = str(refused.value)
    assert (
        sentence.startswith(str(path))
        and "\n" not in sentence
        and "get the corrected accelerations" not in sentence
    )
    return sentence


def whole(name: str, values: Any = V) -> str:
    layout = LAYOUTS[name]
    return layout.text(layout.grid(list(values)), len(values))


# --- GeoNet
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("first", ["Corrected accelerogram", "Uncorrected accelerogram"])
def test_geonet_components(first: str, tmp_path: Path) -> None:
    after = first.startswith("C")  # velocities and displacements follow
    parts = [
        geonet(factor * V, name=name, first=first, after=after)
        for name, factor in (("S16W", 1.0), ("S74E", -1.0), ("Up", 2.0))
    ]
    path = write(tmp_path, "".join(parts))
    assert "3 channels (1: S16W, 2: S74E, 3: Up); pass channel=" in refusal(path)
    for channel, factor in ((1, 1.0), ("s74e", -1.0), (3, 2.0)):
        record = read_record(path, channel=channel)
        assert (
            np.allclose(record.acceleration, 0.001 * factor * V, rtol=1e-14) and record.dt == 0.02
        )
    assert (record.format, record.station, record.units) == ("GeoNet", "TEST", "mm/s2")
    assert "states its units as mm/s2" in refusal(path, channel=1, units="g")
    alone = read_record(write(tmp_path, parts[0]))
    assert np.allclose(alone.acceleration, 0.001 * V, rtol=1e-14) and alone.component == "S16W"


@pytest.mark.parametrize(
    "old, new, words",
    [
        ("Corrected", "Corected", None),
        ("Accelerogram 2", "Accelerogramm 2", None),
        (
            "points    21",
            "points    20",
            "20 points are announced but the integers of the header say 21",
        ),
        (
            "0.020 sec",
            "0.010 sec",
            "line 23: the header states the time step as 0.02, but line 11 states it as 0.01",
        ),
        ("0.020 sec", "0.000 sec", "line 11: the interval of the samples is 0 s"),
        ("  0.40 sec", "  0.60 sec", "0.6 s are announced but 21 points at 0.02 s follow"),
        ("   -41.6", "  -41.6", "does not end where its columns do"),
        ("   -41.6", "", "has 9 values instead of 10"),
        ("     0.0     0.1    -0.3", "0.0 0.1 -0.3", "is not a number"),
    ],
)
def test_geonet_is_known_by_all_signs_and_checked(
    old: str, new: str, words: str | None, tmp_path: Path
) -> None:
    text = geonet(V)
    assert old in text
    path = write(tmp_path, text.replace(old, new, 1))
    if words is None:
        assert np.allclose(read_record(path).acceleration, 0.001 * V, rtol=1e-14)
    else:
        assert words in refusal(path)


def test_a_peak_that_the_samples_do_not_have_is_doubted(tmp_path: Path) -> None:
    path = write(tmp_path, geonet(V).replace("peak      0.0 mm/s/s", "peak    -41.6 mm/s/s"))
    assert not any("peak is 41.6" in doubt for doubt in read_record(path).doubts)
    path = write(tmp_path, geonet(V).replace("peak      0.0 mm/s/s", "peak    -99.9 mm/s/s"))
    assert any(
        "the header says that the peak is 99.9 mm/s2" in doubt for doubt in read_record(path).doubts
    )


# --- Volume I: BHRC, RENADIC, USC, CSMIP
# -----------------------------------------------------------------------------


def test_renadic_components_follow_one_another(tmp_path: Path) -> None:
    text = whole("renadic", V / 10.0) + whole("renadic", -V / 10.0).replace(
        "CHAN  1: EW", "CHAN  2: NS"
    )
    path = write(tmp_path, text)
    assert "2 channels (1: EW, 2: NS)" in refusal(path)
    record = read_record(path, channel="NS")
    assert np.allclose(record.acceleration, -0.1 * G * V / 10.0, rtol=1e-12) and record.dt == 0.02
    assert (record.format, record.units) == ("RENADIC volume 1", "g/10")


def test_bhrc_and_times_above_a_hundred_that_touch(tmp_path: Path) -> None:
    record = read_record(write(tmp_path, whole("bhrc")))
    assert (
        np.allclose(record.acceleration, 0.1 * G * V, rtol=1e-12)
        and record.format == "BHRC volume 1"
    )
    values = np.resize(V / 100.0, 5200)
    text = whole("renadic", values)
    assert " 100.000" not in text and "100.000" in text
    assert np.allclose(
        read_record(write(tmp_path, text)).acceleration, 0.1 * G * np.round(values, 3), rtol=1e-12
    )


@pytest.mark.parametrize("carriage", ["", " "])
def test_usc_pairs_at_uneven_times(carriage: str, tmp_path: Path) -> None:
    """The acceleration is a straight line, which interpolation reproduces; some printers began
    lines with a blank."""
    steps = np.tile([0.004, 0.005, 0.004, 0.004, 0.006], 8)
    times = np.concatenate([[0.0], np.cumsum(steps)])
    head = volume1_head(
        times.size,
        first="FILE     0 OF UNCORRECTED ACCELEROGRAM DATA OF VOLUME I:",
        component="COMP N00W",
        source="STATION USC# 0057",
        length="DURATION",
        units="UNITS ARE SEC AND G/10",
    ).replace(f"{times.size * 0.02:.3f}", f"{times[-1]:.3f}")
    cells = [f"{t:7.3f}{10.0 * t:7.3f}" for t in times]
    path = write(
        tmp_path,
        head
        + "".join(carriage + "".join(cells[k : k + 5]) + "\n" for k in range(0, len(cells), 5)),
    )
    assert "pass resample_dt=" in refusal(path)
    record = read_record(path, resample_dt=0.002)
    assert np.allclose(record.acceleration, 0.1 * G * 10.0 * record.times, rtol=1e-9, atol=1e-12)
    assert (
        record.format == "USC volume 1" and record.component == "N00W" and record.station == "0057"
    )


@pytest.mark.parametrize(
    "old, new, words",
    [
        ("POINTS =     21", "POINTS =     22", "22 samples are announced but 21 follow"),
        ("0.420 SEC", "0.920 SEC", "0.92 s are announced but the times end at 0.4 s"),
        ("UNITS OF UNCOR", "UNCOR", "the header has no line 'UNITS ARE SEC AND'"),
    ],
)
def test_volume_1_is_checked(old: str, new: str, words: str, tmp_path: Path) -> None:
    text = whole("renadic", V / 10.0)
    assert old in text
    assert words in refusal(write(tmp_path, text.replace(old, new)), units="g/10")


# --- UNAM and CWA
# --------------------------------------------------------------------------------------------------


def test_unam_channels_by_direction(tmp_path: Path) -> None:
    path = write(
        tmp_path, unam_head(21) + "".join(f"{v:10.3f}{-v:10.3f}{2.0 * v:10.3f}\n" for v in V)
    )
    assert "3 channels (1: V, 2: N00E, 3: N90E)" in refusal(path)
    for channel, factor in ((1, 1.0), ("n00e", -1.0), (3, 2.0)):
        record = read_record(path, channel=channel)
        assert np.allclose(record.acceleration, 0.01 * factor * V, rtol=1e-12) and record.dt == 0.02
    assert (record.format, record.station, record.component) == ("UNAM", "MADE", "N90E")


@pytest.mark.parametrize(
    "old, new, words",
    [
        (
            "/50/50/50",
            "/50/100/50",
            "line 9: the header states the time step as 0.01, but line 10 states it as 0.02",
        ),
        ("/21/21/21", "/21/22/21", "22 samples are announced but 21 follow"),
        (
            "/0.42/0.42/0.42",
            "/0.42/0.62/0.42",
            "0.62 s are announced but 21 samples at 0.02 s follow",
        ),
        ("3F10.3", "2F10.3", "the data have 2 columns and the header names 3 directions"),
        ("Gal (cm/s/s)", "counts", "'counts' is not a unit"),
        ("ARCHIVO ESTANDAR DE ACELERACION:", "", None),
    ],
)
def test_unam_is_checked(old: str, new: str, words: str | None, tmp_path: Path) -> None:
    path = write(tmp_path, whole("unam").replace(old, new))
    if words is None:
        assert read_record(path, channel=2).format == "UNAM"
    else:
        assert words in refusal(path, channel=2)


def test_cwa_components_are_not_the_time(tmp_path: Path) -> None:
    head = LAYOUTS["cwa"].head(21)
    path = write(
        tmp_path,
        head
        + "".join(f"{0.02 * k:10.3f}{v:10.3f}{-v:10.3f}{3.0 * v:10.3f}\n" for k, v in enumerate(V)),
    )
    assert "3 channels (1: U, 2: N, 3: E)" in refusal(path, dt=0.02, units="gal")
    for channel, factor in ((1, 1.0), ("N", -1.0), ("e", 3.0)):
        record = read_record(path, channel=channel)
        assert np.allclose(record.acceleration, 0.01 * factor * V, rtol=1e-12) and record.dt == 0.02
    assert (record.format, record.units, record.component) == ("CWA", "gal", "E")


@pytest.mark.parametrize(
    "old, new, words",
    [
        ("Rate(Hz): 50", "Rate(Hz): 100", "0.42 s at 100 Hz are announced but 21 samples follow"),
        (
            "Length(sec): 0.42",
            "Length(sec): 0.44",
            "0.44 s at 50 Hz are announced but 21 samples follow",
        ),
        ("4F10.3", "3F10.3", "the format '3F10.3' is not one of 4 columns"),
        ("4F10.3", "4F0.3", "the format '4F0.3' is not one of 4 columns"),
        ("Unit:  gal", "Unit:  count", "'count' is not a unit"),
        ("     0.020", "     0.030", "the step to time"),
    ],
)
def test_cwa_is_checked(old: str, new: str, words: str, tmp_path: Path) -> None:
    text = whole("cwa")
    assert old in text
    assert words in refusal(write(tmp_path, text.replace(old, new, 1)), channel=1)


# --- formats that are not read
# ---------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "text, words",
    [
        ("Response and Fourier amplitude spectra (86 periods\n1 2 3\n", "holds spectra (volume 3)"),
        ("<?xml version='1.0'?>\n<a/>\n", "XML or HTML"),
        ("<!DOCTYPE html>\n", "XML or HTML"),
        ('{"timeSeries": [1, 2]}\n', "JSON"),
        ("WID2 2000/01/01 00:00:00.000 ABC\n1 2\n", "GSE"),
        ("TIMESERIES XX_ABC__HHZ_D, 3 samples, 100 sps, 2000\n1\n2\n3\n", "TSPAIR"),
        (
            "       0.01000000      -2.000000       2.000000      -12345.00      -12345.00\n" * 40,
            "SAC",
        ),
    ],
)
@pytest.mark.parametrize("options", [{}, {"units": "g"}, {"units": "g", "dt": 0.01}])
def test_a_format_that_is_not_read_has_its_own_sentence(
    text: str, words: str, options: dict[str, Any], tmp_path: Path
) -> None:
    assert words in refusal(write(tmp_path, text), **options)
