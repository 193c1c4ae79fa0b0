"""The seeds of the fuzz tests: the same in every run, others by fuzz.sh; inputs that fail are kept
and tried again."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest
from fuzz import Fuzz, read_input, write_input

pytestmark = pytest.mark.serial
TESTS = Path(__file__).resolve().parents[1]
FAULTY = """
import sys
sys.path.insert(0, {support!r})
import pytest
from fuzz import Fuzz
from hypothesis import strategies as st

NUMBERS, SUMS = Fuzz("numbers", __file__), Fuzz("sums", __file__)

@pytest.mark.fuzz
def test_numbers():
    NUMBERS.each(50, lambda dice: dice.randrange(100), lambda n: check(n < 90))

@SUMS.property(value=st.integers(0, 1000))
def test_sums(value):
    check(value < 90)

def check(right):
    assert right {mended}
"""


def ran(file: Path, seed: int | None) -> tuple[int, str]:
    """(status, what pytest said) of the faulty tests."""
    clean = {
        name: value
        for name, value in os.environ.items()
        if not name.startswith(("VI_CONTACT_", "PYTEST"))
    }
    if seed is not None:
        clean |= {"VI_CONTACT_FUZZ_SEED": str(seed), "VI_CONTACT_FUZZ_KEEP": "1"}
    command = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-p",
        "no:cacheprovider",
        "-W",
        "ignore",
        str(file),
    ]
    done = subprocess.run(
        command, capture_output=True, text=True, check=False, env=clean, cwd=file.parent
    )
    return done.returncode, done.stdout + done.stderr


def test_what_fails_is_kept_and_tried_first(tmp_path: Path) -> None:
    """By fuzz.sh alone; the smallest one of a property test; until the fault is mended."""
    pytest.importorskip("hypothesis")
    file = tmp_path / "test_faulty.py"
    file.write_text(FAULTY.format(support=str(TESTS / "support"), mended=""))
    status, said = ran(file, None)
    assert status == 1 and "2 failed" in said and not (tmp_path / "fixed").exists()
    status, said = ran(file, 3)
    assert status == 1 and "the input of numbers that fails: seed-3-number-" in said
    (number,) = (tmp_path / "fixed" / "numbers").iterdir()
    assert read_input(number) >= 90
    assert read_input(tmp_path / "fixed" / "sums" / "seed-3.json") == {"value": 90}
    status, said = ran(file, None)
    assert (
        status == 1 and f"fixed/numbers/{number.name}" in said and "fixed/sums/seed-3.json" in said
    )
    file.write_text(FAULTY.format(support=str(TESTS / "support"), mended="or True"))
    assert ran(file, None)[0] == 0


def test_dice_are_of_test_seed_and_number(monkeypatch: pytest.MonkeyPatch) -> None:
    one, other = Fuzz("one", __file__), Fuzz("other", __file__)
    first = one.dice(0).random()
    assert first == one.dice(0).random()
    assert len({first, one.dice(1).random(), other.dice(0).random()}) == 3
    monkeypatch.setattr("fuzz.SEED", 5)
    assert first != one.dice(0).random()


def test_an_input_is_read_as_it_was_written(tmp_path: Path) -> None:
    value = {"name": "history.csv", "data": b"\0\xff", "more": [1, 0.1, None, "é\udc80", {"x": []}]}
    write_input(tmp_path / "x.json", value)
    assert read_input(tmp_path / "x.json") == value


@pytest.mark.parametrize(
    "words", [[], ["--seed"], ["--seed", "x"], ["--seed", "1", "--count", "-2"]]
)
def test_the_script_asks_for_a_seed(words: list[str]) -> None:
    done = subprocess.run(
        ["bash", str(TESTS / "fuzz.sh"), *words], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2 and "usage: bash tests/fuzz.sh --seed N" in done.stderr
