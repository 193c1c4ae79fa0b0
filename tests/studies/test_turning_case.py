"""Case files of bodies that turn: the runs of Python, and one sentence for each wrong word."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.meshes.block import BlockMesh
from vi_contact.practice.studies import read_case
from vi_contact.practice.studies.cases.schema import write_schema

CASE = """
[mesh]
type = "BlockMesh"
lengths = [0.5, 1.0]
divisions = [1, 2]

[material.stone]
type = "LAW"
E = 1e7
nu = 0.2
rho = 2000.0

[system]
initial_velocity = [0.3, -0.1]

[[system.loads]]
type = "BodyForce"
value = [0.0, -19620.0]

[[contact]]
obstacle = {type = "HalfSpace", point = [0.0, 0.0], normal = [0.0, 1.0]}

[friction]
type = "Coulomb"
mu = 0.3

[run]
dt = 0.005
steps = 4
"""


def write(folder: Path, text: str) -> Path:
    file = folder / "block.toml"
    file.write_text(text, encoding="utf-8")
    return file


@pytest.mark.serial
@pytest.mark.parametrize("law", [vc.SaintVenantKirchhoff, vc.NeoHookean])
def test_a_case_turns_as_in_python(tmp_path: Path, law: type) -> None:
    """All of the boundary may land where [[contact]] names no facets; scheme and mass are those
    that Python takes."""
    from mpi4py import MPI

    comm = MPI.COMM_SELF
    case = read_case(write(tmp_path, CASE.replace("LAW", law.__name__)))
    found = case.run(comm, out=tmp_path / "run", progress=False)

    mesh, _ = fem.build_mesh(BlockMesh(lengths=(0.5, 1.0), divisions=(1, 2)), comm)
    system = fem.assemble(
        mesh,
        law(E=1e7, nu=0.2, rho=2000.0),
        loads=fem.BodyForce((0.0, -19620.0)),
        initial_velocity=(0.3, -0.1),
    )
    floor = vc.HalfSpace((0.0, 0.0), (0.0, 1.0))
    surface = fem.contact_surface(system, obstacle=floor)
    problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(0.3))
    *_, (state, _) = vc.march(problem, dt=0.005, steps=4)
    assert np.array_equal(found.state.u, state.u)
    assert np.array_equal(found.state.v, state.v)


@pytest.mark.serial
@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ("E = 1e7", "E = -1e7", r"stone\].*E at small strain \[Pa\] is -1"),
        ("nu = 0.2", "nu = 0.5", r"stone\].*nu at small strain is 0.5"),
        ("nu = 0.2", "nu = 0.2\nxi = 0.05", r"stone\] has the unknown key 'xi'"),
        ('"SaintVenantKirchhoff"', '"LinearElastic"', "facets are not given"),
        ('"SaintVenantKirchhoff"', '"Hyperelastic"', "unknown type 'Hyperelastic'"),
        ("[system]", '[system]\nsection = {type = "PlaneStress"}', "PlaneStress does not go"),
        (
            "[system]",
            '[system]\ndamping = {type = "Rayleigh", alpha = 0.1, beta = 0.0}',
            "resists the rotation",
        ),
        ("[run]", '[scheme]\ntype = "Trapezoidal"\n\n[run]', "give .*EnergyMomentum"),
    ],
)
def test_what_does_not_turn_is_refused(tmp_path: Path, old: str, new: str, sentence: str) -> None:
    from mpi4py import MPI

    text = CASE.replace("LAW", "SaintVenantKirchhoff").replace(old, new)
    file = write(tmp_path, text)
    with pytest.raises(InputError, match=sentence):
        read_case(file).run(MPI.COMM_SELF, out=tmp_path / "run", progress=False)


def test_the_schema_has_the_materials() -> None:
    text = write_schema()
    assert "SaintVenantKirchhoff" in text
    assert "NeoHookean" in text
