"""Static stages of stones that contact alone holds: walls near their limit load, rows in space."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from all_ranks import seen
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem, meshes
from vi_contact.run.static import Equilibria
from vi_contact.run.weakening import Weakening

COMM = MPI.COMM_WORLD
STONE = vc.LinearElastic(E=5e9, nu=0.2, rho=2000.0)
GRAVITY = 9.80665
MU = 0.65


def wall(stones: int, courses: int) -> tuple[vc.ContactProblem, vc.RigidLimit]:
    """A wall of stones of 0.4 x 0.175 m on clamped ground, and the bound of its push."""
    mesh = meshes.MasonryMesh(
        stones=stones, courses=courses, half_first=True, ground=0.2, divisions=(2, 1)
    )
    built, tags = fem.build_mesh(mesh, COMM)
    system = vc.with_weight(fem.assemble(built, STONE, clamped=tags["ground_bottom"]))
    surface = fem.contact_pairs(system, tags=tags)
    blocks = vc.rigid_blocks(fem.find_joints(built, tags=tags), fixed=["ground"])
    problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(MU))
    return problem, vc.rigid_limit_load(blocks, mu=MU)


@pytest.mark.long
@pytest.mark.serial
def test_a_wall_of_five_by_six_stones_has_a_limit_load() -> None:
    """V2.24: each step up to the limit is certified, none lies above 0.642859, the bound of
    associated flow, and above the limit a mechanism proves that there is no equilibrium."""
    problem, bound = wall(5, 6)
    found = vc.limit_load(problem, force=(GRAVITY, 0.0), bound=bound, rtol=0.02)
    assert bound.multiplier == pytest.approx(0.642859, abs=5e-7)
    assert 0.62 < found.multiplier <= bound.multiplier
    assert found.proven and "of 34 bodies move" in found.reason
    assert max(state.certificate for state in found.states) <= 1e-11


@pytest.mark.serial
def test_mirrored_pushes_have_one_limit() -> None:
    """Three courses over half stones, pushed to the right and to the left."""
    problem, bound = wall(2, 3)
    limits = [
        vc.limit_load(problem, force=(way * GRAVITY, 0.0), bound=bound, rtol=0.1)
        for way in (1.0, -1.0)
    ]
    assert limits[0].proven and limits[1].proven
    assert limits[0].multipliers == pytest.approx(limits[1].multipliers, rel=1e-12)
    assert limits[0].multiplier <= bound.multiplier


@pytest.mark.two_ranks
def test_rows_of_unlike_blocks_rest_on_each_other_in_space() -> None:
    """Eleven blocks on twelve whose meshes do not match, each on two: their weight arrives."""
    blocks = {}
    for i in range(12):
        blocks[f"a{i}"] = _block(float(i), 0.0, 4)
    for i in range(11):
        blocks[f"b{i}"] = _block(i + 0.37, 0.5, 3)
    built, tags = fem.build_mesh(meshes.Blocks(blocks), COMM)
    bottoms = [tags[f"a{i}_bottom"] for i in range(12)]
    system = vc.with_weight(fem.assemble(built, STONE, clamped=bottoms), direction=(0.0, -1.0, 0.0))
    surface = fem.contact_pairs(system, tags=tags)
    problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(0.5))
    assert isinstance(Equilibria(problem).solver, Weakening)
    state = vc.static_equilibrium(problem)
    assert state.certificate <= 1e-11

    # Joints at half height carry the upper row.
    every = seen(surface)
    between = np.abs(every.points[:, 1] - 0.5) < 1e-9
    between &= np.abs(every.normals[:, 1]) > 0.5
    weight = 11 * 0.5 * 0.6 * STONE.rho * GRAVITY
    assert every.all(state.r_n)[between].sum() == pytest.approx(weight, rel=1e-9)


def _block(x: float, y: float, cells: int) -> Any:
    """A block of 1 x 0.5 x 0.6 m with its corner at (x, y, 0)."""
    return meshes.BlockMesh(lengths=(1.0, 0.5, 0.6), divisions=(cells, 2, 3), corner=(x, y, 0.0))
