"""A block that rocks on its edges and corners in space, solved without a factor: the books stay
closed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.meshes.block import BlockMesh

COMM = MPI.COMM_WORLD
DT = 4e-3
WEIGHT = 9.81 * 2000.0


@pytest.fixture(scope="module")
def rocking() -> tuple[vc.ContactProblem, vc.State]:
    """A block of 1 m x 2.4 m x 0.8 m under its weight on a rough plane, pushed over two axes at
    once."""

    def pushed(x: np.ndarray) -> np.ndarray:
        return np.cross((0.1, 0.0, 0.2), x - (1.0, 0.0, 0.8))

    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 2.4, 0.8), divisions=(3, 6, 3)), COMM)
    material = vc.LinearElastic(E=2e8, nu=0.2, rho=2000.0)
    system = fem.assemble(
        mesh, material, loads=fem.BodyForce((0.0, -WEIGHT, 0.0)), initial_velocity=pushed
    )
    plane = vc.HalfSpace(point=(0.0, 0.0, 0.0), normal=(0.0, 1.0, 0.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=plane)
    problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(0.7))
    rest = vc.static_equilibrium(problem, solver=vc.Iterative())
    r_n = surface.comm.sum(rest.r_n.sum(keepdims=True))[0]
    assert r_n == pytest.approx(WEIGHT * 1.0 * 2.4 * 0.8, rel=1e-8)
    return problem, replace(rest, v=surface.in_frames(system.v0))


@pytest.mark.slow
@pytest.mark.serial  # ranks change none of it: the steps below show that
def test_two_hundred_steps_without_drift(rocking: tuple[vc.ContactProblem, vc.State]) -> None:
    """Every step certified; on one corner, on an edge and on more; what the ledger cannot explain
    stays below 1e-7 of the energy: two hundred steps of residuals of 3e-10, a thousand of which are
    found to add up to 5e-9."""
    problem, state = rocking
    solution = vc.simulate(
        problem, solver=vc.Iterative(), dt=DT, steps=200, state=state, progress=False
    )
    history = solution.history
    energy = float(np.max(history["energy_kinetic"] + history["energy_strain"]))
    assert np.max(history["certificate"]) <= 1e-9
    assert {1, 2, 3} <= set(history["contact_active"].astype(int).tolist())
    assert 0.1 * energy < history["loss_friction"][-1] < energy
    assert np.abs(history["energy_defect"]).max() < 1e-7 * energy


def test_steps_are_those_of_the_condensed_route(
    rocking: tuple[vc.ContactProblem, vc.State],
) -> None:
    """Sixty steps, each asked of both from the same state: displacements and reactions to 1e-9."""
    problem, state = rocking
    strict = vc.Iterative(tolerance=1e-12)
    routes = vc.CrossChecked(vc.Condensed(), [strict])
    vc.simulate(
        problem, solver=routes, cross_check=routes, dt=DT, steps=60, state=state, progress=False
    )
    ((_, found),) = routes.report().items()
    assert 0.0 < max(found["u"], found["r_n"], found["r_t"]) < 1e-9
