"""Meshes of case files: Gmsh scripts, and paths that belong to the folder of the file."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

from vi_contact.core.errors import InputError
from vi_contact.practice.studies import read_case

pytestmark = pytest.mark.serial
ROOT = Path(__file__).resolve().parents[2]


def test_all_paths_are_those_of_the_case_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Meshes, scripts, sources of cut and refined meshes, records, run folders: beside the case,
    from anywhere."""
    monkeypatch.chdir("/")
    folder = tmp_path.resolve()
    path = folder / "case.toml"
    cases: list[tuple[str, Any]] = [
        (
            '[mesh]\ntype = "read_mesh"\npath = "a/b.msh"',
            lambda case: case.nodes["mesh"].arguments["path"],
        ),
        (
            '[mesh]\ntype = "GeoFile"\npath = "a/b.msh"',
            lambda case: case.nodes["mesh"].arguments["path"],
        ),
        (
            '[mesh]\ntype = "CutOpen"\ngroup = "g"\nsource = "a/b.msh"',
            lambda case: case.nodes["mesh"].arguments["source"],
        ),
        (
            '[mesh]\ntype = "CutOpen"\ngroup = "g"\nsource = {type = "GeoFile", path = "a/b.msh"}',
            lambda case: case.nodes["mesh"].arguments["source"].arguments["path"],
        ),
        (
            '[mesh]\ntype = "WallMesh"\n[[excitation]]\ntype = "GroundMotion"\nrecord = "a/b.msh"',
            lambda case: case.nodes["excitation"][0].arguments["record"].arguments["path"],
        ),
        ('[mesh]\ntype = "WallMesh"\n[run]\ndt = 1\nout = "a/b.msh"', lambda case: case.out),
    ]
    for table, found in cases:
        path.write_text(
            f"{table}\n"
            + ("" if "[run]" in table else "[run]\ndt = 1\n")
            + "[material.c]\nE = 1\nnu = 0\nrho = 1\n",
            encoding="utf-8",
        )
        assert found(read_case(path)) == folder / "a" / "b.msh", table


@pytest.mark.long
def test_the_dam_of_the_guide_stands_on_its_joint(tmp_path: Path) -> None:
    """C1.1, the case and script of docs/guide/studies.md: V = gamma H²/2, N = weight less uplift,
    to 1e-9."""
    text = (ROOT / "docs" / "guide" / "studies.md").read_text(encoding="utf-8")
    case, script = (
        re.findall(rf"^```{kind}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)[-1]
        for kind in ("toml", r"c\+\+")
    )
    (tmp_path / "dam.geo").write_text(script, encoding="utf-8")
    (tmp_path / "dam.toml").write_text(case, encoding="utf-8")
    history = (
        read_case(tmp_path / "dam.toml", ["run.t_end=", "run.steps=2"])
        .run(MPI.COMM_SELF, progress=False)
        .history
    )
    gamma, level, base, crest = 9810.0, 35.0, 26.0, 5.0
    down = 2400.0 * 9.80665 * 0.5 * (base + crest) * level - 0.25 * gamma * level * base
    assert history["T_joint"][0] == pytest.approx(-0.5 * gamma * level**2, rel=1e-9)
    assert history["N_joint"][0] == pytest.approx(down, rel=1e-9)


@pytest.mark.long
def test_scripts_in_cases_are_refined(tmp_path: Path) -> None:
    """``refine`` of a GeoFile: the same groups on four times the cells; a wrong number is told with
    its table."""
    (tmp_path / "square.geo").write_text(
        "Point(1) = {0, 0, 0, 1}; Point(2) = {3, 0, 0, 1}; Point(3) = {3, 1, 0, 1}; Point(4) = {0, "
        "1, 0, 1};\n"
        "For i In {1:4}\nLine(i) = {i, i < 4 ? i + 1 : 1};\nEndFor\nCurve Loop(1) = {1:4}; Plane "
        "Surface(1) = {1};\n"
        'Physical Curve("base") = {1}; Physical Surface("body") = {1};\n',
        encoding="utf-8",
    )
    path = tmp_path / "case.toml"
    path.write_text(
        '[mesh]\ntype = "GeoFile"\npath = "square.geo"\ntime_limit = "1000 s"\n[material.c]\nE = '
        "1\nnu = 0\nrho = 1\n"
        "[system]\nfixed = 'base'\n[run]\ndt = 1\n",
        encoding="utf-8",
    )
    systems = [read_case(path, [f"mesh.refine={n}"]).parts(MPI.COMM_SELF).system for n in (0, 1)]
    cells = [one.space.mesh.topology.index_map(2).size_local for one in systems]
    assert cells[1] == 4 * cells[0] > 0
    with pytest.raises(InputError, match=r"\[mesh\] GeoFile: refine is -1; give a whole number"):
        read_case(path, ["mesh.refine=-1"]).parts(MPI.COMM_SELF)
