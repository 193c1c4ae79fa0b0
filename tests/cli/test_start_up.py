"""What a command imports before its first step: a run starts in little more than the time of its
libraries."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.serial
WITHOUT = (  # what the wall has no use for
    "gmsh",
    "matplotlib",
    "scipy.optimize",
    "scipy.integrate",
    "scipy.spatial",
    "scipy.interpolate",
    "vi_contact.bem",
    "vi_contact.practice.plots",
    "vi_contact.practice.studies.ida",
    "vi_contact.practice.ground_motion.formats",
    "vi_contact.run.files.reading",
)
CODE = """
import sys
from vi_contact.practice.cli.entry import main
status = main(["run", "wall", "--steps", "1", "--quiet", "--out", sys.argv[1]])
print(*sorted(sys.modules), sep="\\n")
raise SystemExit(status)
"""


@pytest.mark.long
def test_the_wall_starts_without_what_it_has_no_use_for(tmp_path: Path) -> None:
    pytest.importorskip("dolfinx")
    ended = subprocess.run(
        [sys.executable, "-c", CODE, str(tmp_path)], capture_output=True, text=True, check=True
    )
    loaded = ended.stdout.split()
    assert {"dolfinx", "scipy.sparse", "vi_contact.meshes.wall"} <= set(loaded)
    assert [
        one
        for one in loaded
        if one in WITHOUT or one.startswith(tuple(f"{name}." for name in WITHOUT))
    ] == []
