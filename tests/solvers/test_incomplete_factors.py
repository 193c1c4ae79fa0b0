"""Incomplete factors that are not positive definite: made again with a larger diagonal, once, and
said in the log."""

import logging

import numpy as np
import pytest

from meshes.raft import RaftMesh
from vi_contact import (
    Condensed,
    ContactProblem,
    Coulomb,
    Iterative,
    LinearElastic,
    StepFailure,
    fem,
    march,
)
from vi_contact.laws.weight import with_weight

pytest.importorskip("gmsh")


@pytest.fixture(name="problem")
def thrown_building(comm):
    """A stiff building thrown sideways on soft soil, coupled to it by faces that do not match."""
    mesh, tags = fem.build_mesh(RaftMesh(size=2.4, soil_size=1.6, far=8.0), comm)
    cells = [
        (tags["soil"], LinearElastic(2.0e8, 0.3, 1900.0)),
        (tags["building"], LinearElastic(2.5e10, 0.2, 2500.0)),
    ]
    thrown = [(tags["soil"], (0.0, 0.0, 0.0)), (tags["building"], (0.3, 0.2, -0.1))]
    system = with_weight(
        fem.assemble(mesh, cells, clamped=tags["soil_bottom"], initial_velocity=thrown)
    )
    pair = fem.contact_pair(
        system, tags["raft_bottom"], tags["soil_foot"], matching=fem.DualMortar()
    )
    return ContactProblem(system, pair, friction=Coulomb(0.3))


@pytest.mark.long
def test_factors_are_made_again_and_the_answer_is_the_condensed_one(problem, caplog):
    with caplog.at_level(logging.INFO):
        runs = [
            [state for state, _ in march(problem, dt=5e-3, steps=2, solver=solver)]
            for solver in (Iterative("icc"), Condensed())
        ]
    again = [line for line in caplog.messages if "incomplete factors of a larger diagonal" in line]
    assert len(again) == (problem.surface.comm.rank == 0)
    for one, other in zip(*runs, strict=True):
        size = problem.surface.comm.max(np.array([np.abs(other.u).max()]))[0]
        assert np.abs(one.u - other.u).max() < 1e-7 * size
        assert np.array_equal(one.active, other.active)


@pytest.mark.long
@pytest.mark.two_ranks
def test_factors_that_fail_again_are_told(problem, monkeypatch):
    monkeypatch.setattr("vi_contact.solvers.iterative.route.RAISED", 1e-3)
    with pytest.raises(StepFailure, match=r"Iterative\(icc\) stopped"):
        list(march(problem, dt=5e-3, steps=1, solver=Iterative("icc")))
