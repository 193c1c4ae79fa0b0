"""The table of docs/theory/beam.md on both statements of Ahn (2012), section 8: it is what the runs
give."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from demo_runs import ROOT, demo
from kept_figures import keep_figures

from demos.parts.pictures import beam_statements as pictures
from demos.parts.problems.beam_statements import FACTORS, HEAD, Row, row, turning_points

pytestmark = pytest.mark.serial
# with all forces, as in the table; the others with the whole force alone
WHOLE = (("A", 0.001), ("C", 2.0))


@pytest.fixture(scope="module")
def printed() -> dict[tuple[str, float], list[str]]:
    """The cells of the page's rows by reading and a2."""
    page = (ROOT / "docs" / "theory" / "beam.md").read_text(encoding="utf-8")
    lines = page.split(HEAD + "\n")[1].split("\n\n")[0].splitlines()
    cells = [line.strip("| ").split(" | ") for line in lines]
    return {(one[0], float(one[1])): one for one in cells}


def counts(cell: str) -> tuple[int, ...]:
    return tuple(map(int, cell.split(", ")))


@pytest.mark.long
def test_the_table_is_what_the_runs_give(printed: dict[tuple[str, float], list[str]]) -> None:
    """1000 elements and steps: counts, largest force, losses and their ratio, each as printed."""
    assert set(printed) == {(reading, a2) for reading in "ABC" for a2 in (0.001, 2.0)}
    for (reading, a2), cells in printed.items():
        whole = (reading, a2) in WHOLE
        found = row(reading, a2, factors=FACTORS if whole else (1.0,))
        if whole:
            assert found.line() == f"| {' | '.join(cells)} |"
            continue
        told = found.line().strip("| ").split(" | ")
        assert told[4:8] == cells[4:8] and told[9] == cells[9]
        assert (
            found.turning_points == counts(cells[2])[2:3] and found.swings == counts(cells[3])[2:3]
        )


def test_no_reading_has_both(printed: dict[tuple[str, float], list[str]]) -> None:
    """The verdicts follow from the printed counts and losses; friction is not negligible where
    statement 1 holds."""
    for (reading, a2), cells in printed.items():
        found = Row(reading, a2, counts(cells[2]), counts(cells[3]), *map(float, cells[4:7]))
        assert [str(found.statement_1).lower(), str(found.statement_2).lower()] == cells[8:]
        assert not (found.statement_1 and found.statement_2)
        assert found.ratio > 1.0 if found.statement_1 else found.ratio < 2.0


def test_turning_points() -> None:
    """Of a wave, of one with a small one on top, with and without a least swing."""
    t = np.linspace(0.0, 10.0 * np.pi, 5001)
    # 1 to the first, 1 after the last
    assert turning_points(np.sin(t)) == 10 and turning_points(np.sin(t), 1.9) == 8
    assert turning_points(np.sin(t), 2.1) == turning_points(t) == turning_points(np.zeros(9)) == 0
    rough = np.sin(t) + 0.01 * np.sin(200.0 * t)
    assert turning_points(rough) > 500 and turning_points(rough, 0.05) == 10
    assert turning_points(-rough, 0.05) == 10


@pytest.mark.long
def test_the_demo(capsys: pytest.CaptureFixture[str]) -> None:
    """JSON has all that the table has; a coarse run has neither numbers of the page nor both
    statements."""
    rows = demo("beam_statements").main(quick=True, as_json=True)
    told = json.loads(capsys.readouterr().out)
    assert [(one["reading"], one["a2"]) for one in told] == [(one.reading, one.a2) for one in rows]
    names = (
        "turning_points",
        "swings",
        "peak_contact_force",
        "friction_loss",
        "viscous_loss",
        "ratio",
        "statement_1",
        "statement_2",
        "factors",
    )
    assert all(name in one for one in told for name in names) and len(told) == 6
    assert not any(one["statement_1"] and one["statement_2"] for one in told)


def test_the_picture(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both panels have labels; a line and a bar for each row."""
    seen = keep_figures(monkeypatch, pictures)
    rows = [
        Row(name, a2, (1, 1, 2, 3), (1, 2, 2, 2), 1e5, 1.0, 10.0 * a2)
        for a2 in (0.001, 2.0)
        for name in "ABC"
    ]
    pictures.plot_statements(rows, tmp_path / "statements.png")
    swings, losses = seen[0].axes
    assert all("[" in axis.get_xlabel() and "[" in axis.get_ylabel() for axis in (swings, losses))
    assert len(swings.lines) == len(losses.patches) == 6 and (tmp_path / "statements.png").is_file()
