"""Random records of every format are read back, and mutated ones give the right numbers or the
right refusal.

The record is made from a grid of cells (``record_layouts``). A mutation changes the grid, the
header or the end of the text, so that the right answer is known: the samples of the new grid where
the file cannot tell, and else a refusal with a word of its fault."""

from __future__ import annotations

import re
from pathlib import Path
from random import Random

import numpy as np
import pytest
from record_layouts import LAYOUTS, STEP, Grid, Layout

from vi_contact.core.errors import InputError
from vi_contact.practice.ground_motion import read_record

pytestmark = pytest.mark.serial
SAMPLES = 43  # of a mutated record: the last row of ten, eight, five and four is short
PLACES = 12  # that each mutation is tried at
LOST = (
    r"announced|follow|the row has|values instead of|columns instead of|header values|complete file"
)
TIMES = r"step to time|does not come after|announced|count up by|complete file"


def values_of(layout: Layout, random: Random, count: int = SAMPLES) -> list[float]:
    """Smooth numbers with some noise, which fit the cells: two before the point."""
    return [
        round(40.0 * np.sin(0.7 * k) * random.random() + random.uniform(-9.0, 9.0), layout.decimals)
        + 0.0
        for k in range(count)
    ]


def outcome(path: Path, layout: Layout, text: str) -> np.ndarray | str:
    """The samples that are read, or the sentence of the refusal."""
    path.write_bytes(text.encode("latin-1"))
    try:
        record = read_record(path, **layout.options, largest=1e4)
    except InputError as error:
        sentence = str(error)
        assert str(path) in sentence and "\n" not in sentence and len(sentence) < 700
        return sentence
    assert np.isclose(record.dt, STEP, rtol=1e-9)
    return record.acceleration


def expect(found: np.ndarray | str, right: np.ndarray | None, words: str | None, what: str) -> None:
    """Right numbers where `right` is given, a refusal with one of the words where `words` is;
    either where both are."""
    if isinstance(found, str):
        assert words is not None, f"{what}: refused: {found}"
        assert re.search(words, found), f"{what}: {found}"
        return
    assert right is not None, f"{what}: {found.size} samples were read, and a refusal is right"
    assert found.shape == right.shape and np.allclose(found, right, rtol=1e-12, atol=1e-15), what


@pytest.mark.parametrize("name", LAYOUTS)
def test_random_records_are_read_back(name: str, tmp_path: Path) -> None:
    """Any numbers that fit the cells, in records of any length."""
    hypothesis = pytest.importorskip("hypothesis")
    from hypothesis import strategies

    layout = LAYOUTS[name]
    numbers = strategies.integers(-99_000, 99_000).map(lambda whole: whole / 1000.0)

    @hypothesis.settings(
        derandomize=True,
        max_examples=10,
        deadline=None,
        database=None,
        suppress_health_check=list(hypothesis.HealthCheck),
    )
    @hypothesis.given(strategies.lists(numbers, min_size=12, max_size=60))
    def check(values: list[float]) -> None:
        grid = layout.grid(values)
        found = outcome(tmp_path / "record.txt", layout, layout.text(grid, len(values)))
        expect(found, layout.samples(grid), None, name)

    check()


def mutations(
    layout: Layout, grid: Grid, random: Random
) -> list[tuple[str, Grid, int, np.ndarray | None, str | None]]:
    """What was done, the new grid, the count in the header, the right samples, and words of the
    right refusal."""
    found: list[tuple[str, Grid, int, np.ndarray | None, str | None]] = []

    def add(what: str, new: Grid, right: bool, words: str | None, count: int = SAMPLES) -> None:
        try:
            samples = layout.samples(new) if right else None
        except ValueError:
            samples, words = None, words or "is not a number"
        found.append((what, new, count, samples, words))

    last = len(grid) - 1
    for k in {0, 1, last - 1, last, *(random.randrange(len(grid)) for _ in range(PLACES))}:
        free = not layout.counted and not layout.timed  # nothing can tell rows from one another
        ends = not layout.counted and k in (0, last)
        add(
            f"row {k} deleted",
            grid[:k] + grid[k + 1 :],
            free or ends,
            None if free or ends else f"{LOST}|{TIMES}",
        )
        add(
            f"row {k} doubled",
            grid[: k + 1] + grid[k:],
            free and (k < last or layout.per_row == 1),
            None if free and (k < last or layout.per_row == 1) else f"{LOST}|{TIMES}",
        )
        j = random.randrange(len(grid[k]))
        row = grid[k][:j] + grid[k][j + 1 :]
        single = len(grid[k]) == 1
        lost = grid[:k] + ([] if single else [row]) + grid[k + 1 :]
        hidden = free and (single or k == last)
        add(
            f"value {j} of row {k} deleted",
            lost,
            hidden,
            None if hidden else f"{LOST}|{TIMES}|not a number|no row",
        )
        other = random.randrange(last)  # not the last one, which may be short
        if other != k < last and grid[k] != grid[other]:
            swapped = list(grid)
            swapped[k], swapped[other] = grid[other], grid[k]
            add(
                f"rows {k} and {other} swapped",
                swapped,
                not layout.timed,
                TIMES if layout.timed else None,
            )
        cell = grid[k][-1]
        digits = [place for place, letter in enumerate(cell) if letter.isdigit()]
        place = random.choice(digits)
        shorter = [*grid[k][:-1], cell[:place] + cell[place + 1 :]]
        add(
            f"digit {place} of row {k} deleted",
            grid[:k] + [shorter] + grid[k + 1 :],
            not layout.fixed,
            "is not a number|does not end where|digit was lost|is cut off|complete file",
        )
    for count in (SAMPLES - 1, SAMPLES + 1, 2 * SAMPLES) if layout.counted else ():
        add(f"{count} samples announced", grid, False, LOST, count)
    return found


@pytest.mark.parametrize("name", LAYOUTS)
def test_mutated_records_are_right_or_refused_for_their_fault(name: str, tmp_path: Path) -> None:
    layout, random = LAYOUTS[name], Random(name)
    grid = layout.grid(values_of(layout, random))
    expect(
        outcome(tmp_path / "r.txt", layout, layout.text(grid, SAMPLES)),
        layout.samples(grid),
        None,
        "as written",
    )
    tried = mutations(layout, grid, random)
    assert len(tried) > 20
    for what, new, count, right, words in tried:
        expect(
            outcome(tmp_path / "r.txt", layout, layout.text(new, count)),
            right,
            words,
            f"{name}: {what}",
        )


@pytest.mark.parametrize("name", LAYOUTS)
def test_a_record_that_is_cut_anywhere_is_right_or_refused(name: str, tmp_path: Path) -> None:
    """The right answer is all samples where only the end mark is lost, and where nothing tells
    their number those that are whole; a number that is cut is refused."""
    layout, random = LAYOUTS[name], Random(name)
    grid = layout.grid(values_of(layout, random))
    head, text = layout.head(SAMPLES), layout.text(grid, SAMPLES)
    whole = len(text[: len(text) - len(layout.tail)].rstrip())
    words = (
        rf"{LOST}|{TIMES}|not a number|is cut off|does not end|digit was lost|two or more|"
        "does not state|not a unit|holds a"
    )
    for end in sorted(
        {
            random.randrange(len(head) if layout.counted else len(text) // 2, len(text))
            for _ in range(8 * PLACES)
        }
        | {whole, whole - 1}
    ):
        found = outcome(tmp_path / "r.txt", layout, text[:end])
        if end >= whole:
            expect(
                found,
                layout.samples(grid),
                words if layout.tail else None,
                f"{name}: cut at {end}, all data left",
            )
            continue
        right = None
        if not layout.counted and end > len(head):
            rows = [row for row in text[len(head) : end].split("\n") if row.strip()]
            cut = [cells(layout, row) for row in rows]
            complete = cut == grid[: len(cut) - 1] + [grid[len(cut) - 1][: len(cut[-1])]]
            full = complete and (len(cut[-1]) == len(grid[len(cut) - 1]) or not layout.components)
            right = layout.samples(cut) if full else None
        expect(
            found,
            right,
            None if right is not None and right.size > 4 else words,
            f"{name}: cut at {end}",
        )


def cells(layout: Layout, row: str) -> list[str]:
    """The cells of an uncounted layout's row, with the blanks and commas before them."""
    return re.findall(r"[ ,]*[^ ,]+", row)
