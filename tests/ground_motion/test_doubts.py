"""Record files that could be read in two ways, or that no earthquake wrote, and sizes that no
memory holds."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from vi_contact.core.errors import InputError
from vi_contact.practice.ground_motion import (
    KanaiTajimi,
    Record,
    filtered,
    padded,
    read_record,
    resampled,
    response_spectrum,
    synthetic,
)

pytestmark = pytest.mark.serial
G = 9.80665
RECORD = Record(np.sin(np.arange(50.0)), 0.02)


def write(folder: Path, text: str) -> Path:
    path = folder / "record.txt"
    path.write_text(text)
    return path


@pytest.mark.parametrize(
    "text",
    [
        "0,00;0,12\n0,01;-1,15\n0,02;,5\n".replace(";,5", ";0,5"),
        "0.00,0.12\n0.01,-1.15\n0.02,0.5\n",
        "0,0.12\n0.01,-1.15\n0.02,0.5\n",
        "0.00, 0.12\n0.01, -1.15\n0.02, 0.5\n",
        "0.00;0.12\n0.01;-1.15\n0.02;0.5\n",
        "0,00 ; 0,12 ;\n0,01 ; -1,15E0 ;\n0,02 ; 5,0D-1 ;\n",
    ],
)
def test_commas_whose_meaning_is_certain(text: str, tmp_path: Path) -> None:
    record = read_record(write(tmp_path, text), "m/s2")
    assert record.acceleration.tolist() == [0.12, -1.15, 0.5] and record.dt == pytest.approx(
        0.01, rel=1e-12
    )


@pytest.mark.parametrize(
    "text",
    [
        "0,12 1,15\n0,13 2,15\n",
        "0,12\n1,15\n2,20\n",
        "0,0\n1,1\n2,0\n",
        "0.00;1.234,5\n0.01;1.235,5\n",
        "NPTS= 4, DT= .01, UNITS OF G\n0,1 0,2 0,3 0,4\n",
    ],
)
def test_commas_that_nobody_can_tell_are_refused(text: str, tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match="may be a decimal comma or a separator; write decimal points"
    ):
        read_record(write(tmp_path, text), "g", dt=None if ";" in text or " " in text else 0.01)


def test_whole_numbers_between_commas_are_many_in_a_word(tmp_path: Path) -> None:
    record = read_record(write(tmp_path, "1,2,3\n4,5,6\n"), "gal", dt=0.01)
    assert np.allclose(record.acceleration, 0.01 * np.arange(1.0, 7.0))


def test_a_peak_that_no_earthquake_has_is_refused_unless_named(tmp_path: Path) -> None:
    """300 cm/s² called g; ten g is the limit, more is said by name."""
    path = write(tmp_path, "0 0\n1\n300\n".replace("0 0\n", "0\n"))
    with pytest.raises(
        InputError, match="is 300 g = 2942 m/s2 if the unit is g; give the right units="
    ):
        read_record(path, "g", dt=0.01)
    assert read_record(path, "gal", dt=0.01).acceleration[-1] == 3.0
    assert read_record(path, "g", dt=0.01, largest=3000.0).acceleration[-1] == 300.0 * G
    for wrong in (0.0, math.nan, "10"):
        with pytest.raises(InputError, match="largest"):
            read_record(path, "g", dt=0.01, largest=wrong)  # type: ignore[arg-type]
    for number in ("1e305", "1" * 400, "1e999"):
        with pytest.raises(InputError, match="peak acceleration is|is not a number"):
            read_record(write(tmp_path, f"0\n1\n{number}\n"), "m/s2", dt=0.01)


@pytest.mark.parametrize("dt", [1e-300, 1e-9, 1e3])
def test_a_time_step_that_no_instrument_has_is_refused(dt: float, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is not usual for ground motions"):
        read_record(write(tmp_path, "1\n2\n3\n"), "gal", dt=dt)


@pytest.mark.parametrize(
    "make",
    [
        lambda: padded(RECORD, 1e12),
        lambda: padded(RECORD, 0.0, 1e300),
        lambda: resampled(RECORD, 1e-12),
        lambda: resampled(RECORD, 5e-324),
        lambda: filtered(RECORD, low=1e-12),
        lambda: synthetic(KanaiTajimi(s0=0.01), 1e12, 1e-3, seed=1),
        lambda: response_spectrum(Record(np.ones(100_000), 0.01), np.ones(200_000)),
    ],
    ids=[
        "padded before",
        "padded behind",
        "resampled",
        "resampled to the least",
        "filtered",
        "synthetic",
        "spectrum",
    ],
)
def test_sizes_are_bounded_before_memory_is_taken(make: object) -> None:
    with pytest.raises(InputError, match="are the most; ask for fewer|have no ratio"):
        make()  # type: ignore[operator]


def test_uneven_times_brought_to_a_tiny_step(tmp_path: Path) -> None:
    path = write(tmp_path, "0 0\n0.01 1\n0.03 2\n")
    with pytest.raises(
        InputError, match=r"resample_dt = 1e-12 s asks for 3e\+10 samples, and 5e\+07 are the most"
    ):
        read_record(path, "gal", resample_dt=1e-12)


def test_periods_far_below_the_step_are_refused() -> None:
    with pytest.raises(InputError, match="below a 1000th of the step"):
        response_spectrum(RECORD, np.array([1e-6, 1.0]))


@pytest.mark.parametrize(
    "text",
    [
        "Origin Time 1\n" * 3 + "Scale Factor " + "1" * 5000 + "(gal)/1\n",
        "NPTS= " + "9" * 5000 + ", DT= .01\n1 2\n",
        "NPTS= 2, DT= " + "1" * 5000 + "\n1 2\n",
        "NPTS= 2, DT= 1E999, UNITS OF G\n1 2\n",
        '{"timeSeries": ' + "[" * 100000,
        '{"timeSeries": [{"data": [' + "1" * 5000 + "]}]}",
        '{"timeSeries": [{"data": [1, 1e999], "dT": 0.01}]}',
        '{"timeSeries": [{"name": "\\ud800", "data": [1, 2], "dT": [], "factor": {}}], "pattern": '
        "3}",
        '{"timeSeries": 1}',
        "Corrected accelerogram\n"
        + "9" * 30
        + " points of accel data equally spaced at .01 sec, in g. (8f10.6)\n1\n",
        "Corrected accelerogram\n2 points of accel data equally spaced at .01 sec, in g. ("
        + "9" * 30
        + "f10.6)\n1\n",
    ],
    ids=range(11),
)
def test_absurd_numbers_and_nests_are_one_sentence(text: str, tmp_path: Path) -> None:
    with pytest.raises(InputError) as refused:
        read_record(write(tmp_path, text), "g")
    assert "\n" not in str(refused.value) and len(str(refused.value)) < 400
