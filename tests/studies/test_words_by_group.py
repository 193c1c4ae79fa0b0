"""Every material may belong to a cell group, with damping of its own, and every recorder of the
package has a word."""

from __future__ import annotations

from importlib import import_module
from inspect import isclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.step import Recorder
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import Blocks
from vi_contact.practice.studies import read_case
from vi_contact.practice.studies.cases.vocabulary import list_names

COMM = MPI.COMM_WORLD
CASE = """
[mesh]
type = "Blocks"

[mesh.blocks]
soft = {lengths = [2.0, 1.0], divisions = [4, 2]}
fibre = {lengths = [2.0, 1.0], divisions = [4, 2], corner = [3.0, 0.0]}
layered = {lengths = [2.0, 1.0], divisions = [4, 2], corner = [6.0, 0.0]}
damped = {lengths = [2.0, 1.0], divisions = [4, 2], corner = [9.0, 0.0]}

[material.soft]
type = "LinearElastic.from_wave_speeds"
c_p = 400.0
c_s = 200.0
rho = 2000.0

[material.fibre]
type = "Orthotropic"
E1 = 1e10
E2 = 5e8
E3 = 5e8
nu12 = 0.3
nu13 = 0.3
nu23 = 0.4
G12 = 5e8
G13 = 5e8
G23 = 1e8
rho = 600.0
axes = [[0.8, 0.6, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.0, 1.0]]

[material.layered]
type = "Heterogeneous"
E = "1e8 + 2e8 * y"
nu = 0.3
rho = 1800.0

[material.damped]
type = "Heterogeneous"
E = 1e9
nu = 0.25
rho = 1900.0
RATIO

[run]
dt = 1.0
steps = 0
"""
DAMPINGS = {
    'DampingRatio", frequency = 4.0}': vc.DampingRatio(4.0),
    'KelvinVoigt", shear = 1e5, bulk = 2e5}': vc.KelvinVoigt(1e5, 2e5),
    'Rayleigh", alpha = 0.1, beta = 1e-3}': vc.Rayleigh(0.1, 1e-3),
}


def build(damping: Any, xi: float) -> Any:
    """The system of the case in Python."""
    names = ("soft", "fibre", "layered", "damped")
    blocks = {
        name: BlockMesh(lengths=(2.0, 1.0), divisions=(4, 2), corner=(3.0 * k, 0.0))
        for k, name in enumerate(names)
    }
    mesh, tags = fem.build_mesh(Blocks(blocks), COMM)
    axes = ((0.8, 0.6, 0.0), (-0.6, 0.8, 0.0), (0.0, 0.0, 1.0))
    materials = (
        vc.LinearElastic.from_wave_speeds(400.0, 200.0, 2000.0),
        vc.Orthotropic(
            E1=1e10,
            E2=5e8,
            E3=5e8,
            nu12=0.3,
            nu13=0.3,
            nu23=0.4,
            G12=5e8,
            G13=5e8,
            G23=1e8,
            rho=600.0,
            axes=axes,
        ),
        fem.Heterogeneous(lambda x: 1e8 + 2e8 * x[1], 0.3, 1800.0),
        fem.Heterogeneous(1e9, 0.25, 1900.0, xi),
    )
    cells = [(tags[name], one) for name, one in zip(names, materials, strict=True)]
    return fem.assemble(mesh, cells, damping=damping)


@pytest.mark.parametrize("words", DAMPINGS)
def test_materials_and_damping_by_cell_group(shared_tmp: Path, words: str) -> None:
    """M, C and K of a case are those of the same pairs of cells and materials in Python, whatever
    the damping; a ratio belongs to the material of its group, and the others have none."""
    file = shared_tmp / "groups.toml"
    if COMM.rank == 0:
        # other laws do not read it
        case = CASE.replace("RATIO", "xi = 0.05" if "Ratio" in words else "")
        file.write_text(case + f'[system]\ndamping = {{type = "{words}\n', encoding="utf-8")
    COMM.Barrier()
    found, expected = (
        read_case(file).problem(COMM).system,
        build(DAMPINGS[words], 0.05 if "Ratio" in words else 0.0),
    )
    w = np.cos(found.space.coordinates @ [7.0, 3.0]) + 0.1 * (np.asarray(found.space.ids) % 2)
    for name in ("M", "C", "K"):
        one, other = (getattr(system, name) @ w for system in (found, expected))
        size = COMM.allreduce(float(np.abs(other).max(initial=0.0)), MPI.MAX)
        assert (
            COMM.allreduce(float(np.abs(one - other).max(initial=0.0)), MPI.MAX) < 1e-12 * size
        ), name
    if "Ratio" in words:
        body = found.space.bodies
        share = np.abs(found.C @ w)
        damped = [
            COMM.allreduce(float(share[body == k].max(initial=0.0)), MPI.MAX) for k in range(4)
        ]
        assert damped[3] > 0.0 and max(damped[:3]) == 0.0


@pytest.mark.serial
def test_every_public_recorder_has_a_word() -> None:
    """What the rooms list and ``simulate`` takes as a recorder is a type of [[record]]."""
    recorders = set()
    for room in (
        "core",
        "fem",
        "laws",
        "run",
        "engineering",
        "soil",
        "ground_motion",
        "solvers",
        "schemes",
        "studies",
    ):
        listed = import_module(f"vi_contact.{room}")
        for name in listed.__all__:
            one = getattr(listed, name)
            if (
                isclass(one)
                and one is not Recorder
                and all(hasattr(one, part) for part in ("columns", "start", "row"))
            ):
                recorders.add(name)
    assert recorders >= {
        "Energy",
        "Contact",
        "Probe",
        "Resultants",
        "Racking",
        "Reactions",
        "SectionForces",
    }
    assert recorders == set(list_names(Recorder))
