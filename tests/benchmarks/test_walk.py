"""benchmarks/walk.py counts files and returns; the mesh goes forward through ``fem.assemble``."""

from __future__ import annotations

import pytest
from site_pages import ROOT, loaded

pytest.importorskip("dolfinx")
pytestmark = pytest.mark.serial
walk = loaded(ROOT / "benchmarks/walk.py")


def test_a_file_that_is_left_and_seen_again_is_a_return():
    calls = [("a.py", "f"), ("a.py", "g"), ("b.py", "f"), ("a.py", "h"), ("c.py", "f")]
    assert walk.stays(calls)[0] == ("a.py", ["f", "g"])
    assert walk.counts(calls) == {"visits": 4, "files": 3, "returns": 1}


def test_the_mesh_goes_forward_through_assemble():
    """It visited 77 times in 15 files when unknowns asked for nodes, and checks for groups."""
    calls = walk.calls_of_example(ROOT)
    numbers = walk.counts([call for call, handed in calls if handed])
    assert numbers["files"] >= 12 and numbers["visits"] <= 25
