"""benchmarks/walk.py counts files and returns; the mesh goes forward through ``fem.assemble``, and
the unknown of a step through ``march`` (benchmarks/walk_step.py)."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from pictures import is_drawn
from site_pages import ROOT, loaded

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.serial
walk = loaded(ROOT / "benchmarks/walk.py")
walk_step = loaded(ROOT / "benchmarks/walk_step.py")


def test_a_file_that_is_left_and_seen_again_is_a_return():
    calls = [("a.py", "f"), ("a.py", "g"), ("b.py", "f"), ("a.py", "h"), ("c.py", "f")]
    assert walk.stays(calls)[0] == ("a.py", ["f", "g"])
    assert walk.counts(calls) == {"visits": 4, "files": 3, "returns": 1}


def test_the_mesh_goes_forward_through_assemble():
    """It visited 77 times in 15 files when unknowns asked for nodes, and checks for groups. Two
    visits are the question which kind of body it is: linear, one that yields, or one that turns."""
    calls = walk.calls_of_example(ROOT)
    numbers = walk.counts([call for call, handed in calls if handed])
    assert numbers["files"] >= 12 and numbers["visits"] <= 27


def test_the_unknown_returns_to_few_files_in_a_step(tmp_path: Path):
    """It came back to files that it had left 11 times in 0.2.0, and visited 18 times."""
    before = json.loads((ROOT / "benchmarks/walk_step_0.2.0.json").read_text())
    calls = walk_step.trace_step(ROOT)
    old = walk_step.count_walks(before)
    new = walk_step.count_walks(calls)
    assert old["x"] == {"calls": 23, "visits": 18, "files": 7, "returns": 11}
    assert new["x"]["files"] >= 4 and new["x"]["visits"] <= 12 and new["x"]["returns"] <= 4
    assert new["dt"]["returns"] <= 4 and new["every call"]["visits"] <= old["every call"]["visits"]

    walk_step.draw({"before": before, "now": calls}, tmp_path / "walk.png")
    assert is_drawn(tmp_path / "walk.png")
