"""The demo of a building on a raft, and its case file: gravity, three components, uplift, sliding;
every file."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from demo_runs import ROOT, demo
from pictures import is_drawn

from meshes.raft import RaftMesh
from vi_contact import read_run, simulate
from vi_contact.core.files import on_root
from vi_contact.meshes.gmsh_session import write
from vi_contact.practice.studies.cases.case import read_case

FIGURES = ("motions", "moments", "energy", "certificate")


@pytest.mark.slow
@pytest.mark.serial
@pytest.mark.promise("guide/raft.md", "The worst certificate is 3e-11", bound="1e-9 and 1e-10")
def test_the_raft_demo(shared_tmp, capsys):
    """It stands closed, lifts off and slides, certified, with a closed ledger; friction bounds the
    base shear."""
    module = demo("raft")
    numbers = module.main(quick=True, out=shared_tmp, progress=False)
    assert 0.0 < numbers["worst certificate"] <= 1e-9 and numbers["energy defect"] <= 1e-10
    (wide, deep, thick), (*_, length, width) = module.RAFT, module.CORE
    # of 0.8 m between slabs of 0.6 m
    walls = (length * width - (length - 1.6) * (width - 1.6)) * 3 * (4.0 - 0.6)
    weight = 2500.0 * 9.80665 * (wide * deep * (thick + 3 * 0.6) + walls)
    assert numbers["weight [MN]"] == pytest.approx(1e-6 * weight, rel=1e-9)
    assert (
        numbers["open share of the raft at rest"] < 0.05
        and numbers["largest open share of the raft"] > 0.5
    )
    assert (
        1.0 < numbers["largest slip [mm]"] < 20.0 and 2.0 < numbers["largest opening [mm]"] < 20.0
    )
    assert numbers["rotation about x [mrad]"] > 0.3 and numbers["friction work [kJ]"] > 5.0
    history = read_run(shared_tmp).history
    shear = np.hypot(history["force_x_raft"], history["force_y_raft"])
    assert np.all(shear <= module.MU * history["N_raft"] * (1.0 + 1e-9))
    moved = np.hypot(history["a_x_roof"], history["a_y_roof"]).max()
    assert moved > 1.5 * np.hypot(history["a_x_field"], history["a_y_field"]).max()
    assert "run finished: 150 steps" in capsys.readouterr().out
    for name in FIGURES:
        assert is_drawn(shared_tmp / f"{name}.png")
    files_of_paraview(shared_tmp, 16)


def files_of_paraview(folder: Path, frames: int) -> None:
    """The index names every frame, and all that it names is there, of the shape that it says."""
    import h5py

    index = (folder / "fields.xdmf").read_text(encoding="utf-8")
    assert index.count("<Time ") == frames and 'TopologyType="Tetrahedron"' in index
    named = set(re.findall(r'Dimensions="([\d ]+)"[^>]*>([^:<]+):([^<]+)<', index))
    assert len(named) > 6 * frames
    files = {name: h5py.File(folder / name) for _, name, _ in named}
    for shape, name, place in named:
        assert files[name][place].shape == tuple(map(int, shape.split())), (name, place)
    for file in files.values():
        file.close()


@pytest.mark.serial
@pytest.mark.promise("guide/raft.md", "the numbers of the demo to round-off", bound="1e-7")
def test_the_case_of_the_raft(comm, shared_tmp, monkeypatch):
    """Twenty steps of the case file, gravity, release and compliant base, are the demo's under the
    case's motions."""
    file = shared_tmp / "raft.msh"
    raft = demo("raft")
    size, soil_size, far = (float(one) for one in 3.0 * raft.CELLS)
    on_root(comm, lambda: write(RaftMesh(size=size, soil_size=soil_size, far=far), file))
    case = read_case(ROOT / "demos" / "cases" / "raft.toml", ["run.steps=20", f"mesh.path={file}"])
    solution = case.run(comm, out=shared_tmp / "run", progress=False)
    assert solution.facts["worst_certificate"] <= 1e-9 and solution.facts["energy_defect"] <= 1e-10
    history = solution.history
    layer = 42.0 * 36.0 * 12.0 * 1900.0 * 9.80665
    before = read_run(shared_tmp / "run" / "stages" / "1_gravity").history
    assert before["reaction_z_rock"][0] == pytest.approx(before["N_raft"][0] + layer, rel=1e-9)
    assert (
        np.abs([history[f"force_{axis}_raft"][0] for axis in "xy"]).max()
        < 1e-9 * history["N_raft"][0]
    )
    monkeypatch.setattr(raft, "earthquake", case.excitations)
    problem, start = raft.stages(3.0, comm)
    expected = simulate(
        problem, dt=0.01, steps=20, state=start, record=raft.recorders(), progress=False
    ).history
    for name in ("N_raft", "force_x_raft", "force_y_raft", "u_x_roof", "u_y_roof", "a_z_field"):
        size = np.abs(expected["N_raft" if name.startswith("force") else name]).max()
        assert size > 0.0 and np.abs(history[name] - expected[name]).max() < 1e-7 * size, name
    assert np.ptp(history["u_x_roof"]) > 1e-6
