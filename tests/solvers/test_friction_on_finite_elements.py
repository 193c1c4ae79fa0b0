"""Blocks thrown obliquely onto a plane with friction, in 2D and 3D: certified on any number of
ranks, alike on all."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from fem_problems import BOX_DT, block, run, thrown_box, turned

from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import FrictionLaw
from vi_contact.core.step import Report
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import BodyForce, Prescribed
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.laws.friction import Coulomb, Tresca
from vi_contact.laws.mass import ConsistentMass, Redistributed
from vi_contact.laws.materials import LinearElastic
from vi_contact.run.march import march
from vi_contact.schemes.trapezoidal import Trapezoidal
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.friction.nsgs import NSGS

SCHEMES = [(ZienkiewiczWoodTaylor(), ConsistentMass()), (Trapezoidal(), Redistributed())]
NAMES = ["midpoint", "trapezoidal"]
STEPS = 40


def thrown_block(comm: Any, *, angle: float = 0.3) -> ContactProblem:
    """A soft rectangle thrown obliquely, and turning, onto an inclined plane."""
    material = LinearElastic(E=1.0e6, nu=0.3, rho=1000.0)
    mesh, tags = block(comm, lengths=(1.5, 1.0), divisions=(8, 5), angle=angle)
    down, along = turned((0.0, -1.0), angle), turned((1.0, 0.0), angle)

    def throw(x: Any) -> Any:
        return np.outer(2.0 + 0.2 * (x @ along), down) + np.outer(np.full(len(x), 1.5), along)

    system = assemble(mesh, material, loads=BodyForce(tuple(9.81e3 * down)), initial_velocity=throw)
    plane = HalfSpace(point=tuple(1e-3 * down), normal=tuple(-down))
    return ContactProblem(system, contact_surface(system, tags["bottom"], obstacle=plane))


def thrown(comm: Any, d: int, friction: FrictionLaw, mass: Any) -> ContactProblem:
    """The block or the box."""
    problem = (
        thrown_block(comm)
        if d == 2
        else thrown_box(comm, angle=0.3, simplices=True, divisions=(4, 5, 3))
    )
    return replace(problem, friction=friction, mass=mass)


def reports(
    problem: ContactProblem, scheme: Any, steps: int = STEPS, **solver: Any
) -> list[Report]:
    return [
        report
        for _, report in march(
            problem, scheme=scheme, solver=Condensed(**solver), dt=BOX_DT, steps=steps
        )
    ]


@pytest.mark.parametrize("friction", [Coulomb(0.3), Tresca(2e3)], ids=repr)
@pytest.mark.parametrize(("scheme", "mass"), SCHEMES, ids=NAMES)
@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.promise("guide/solvers.md", "Points that stick keep their place to the last bit")
def test_every_step_is_certified(comm: Any, d: int, scheme: Any, mass: Any, friction: Any) -> None:
    """Certificate 1e-9 (V9); reactions in their cones, no slip where the cone has room; slip and
    stick both occur."""
    problem = thrown(comm, d, friction, mass)
    slipping = sticking = 0
    for report in reports(problem, scheme):
        assert report.certificate.worst <= 1e-9
        step, result = report.step, report.result
        limit = friction.limit(result.r_n, problem.surface.weights, step.scale)
        size = np.linalg.norm(result.r_t, axis=1)
        slip = np.linalg.norm(problem.surface.tangential_values(result.x) - step.slip0, axis=1)
        assert np.all(size <= limit * (1.0 + 1e-15 * 4))
        room = size < (1.0 - 1e-9) * limit
        assert np.all(slip[room] == 0.0)
        sticking += int(room.sum())
        slipping += int(((slip > 0.0) & (limit > 0.0)).sum())
    slipping, sticking = comm.allreduce(slipping), comm.allreduce(sticking)
    assert slipping > 10 and (sticking > 10 or isinstance(friction, Tresca))


@pytest.mark.parametrize("d", [2, 3])
def test_ranks_agree(comm: Any, d: int) -> None:
    """All ranks together and each alone: displacements and reactions to 1e-10, the same contact
    sets and iterations."""
    scheme, mass = SCHEMES[0]
    together = run(thrown(comm, d, Coulomb(0.3), mass), dt=BOX_DT, steps=STEPS, scheme=scheme)
    alone = run(thrown(_self(), d, Coulomb(0.3), mass), dt=BOX_DT, steps=STEPS, scheme=scheme)
    assert np.abs(together.u - alone.u).max() <= 1e-10 * np.abs(alone.u).max()
    assert np.abs(together.r_n - alone.r_n).max() <= 1e-10 * np.abs(alone.r_n).max()
    assert np.array_equal(together.active, alone.active)
    assert np.abs(together.iterations - alone.iterations).max() <= 1


def _self() -> Any:
    from mpi4py import MPI

    return MPI.COMM_SELF


@pytest.mark.serial
@pytest.mark.slow
@pytest.mark.parametrize("d", [2, 3])
def test_gauss_seidel_agrees(comm: Any, d: int) -> None:
    """An independent method for the small problem: the same run to 1e-8 of the largest
    displacement."""
    scheme, mass = SCHEMES[1]
    one = reports(thrown(comm, d, Coulomb(0.3), mass), scheme, 16)
    other = reports(thrown(comm, d, Coulomb(0.3), mass), scheme, 16, friction_method=NSGS())
    largest = max(np.abs(report.new.u).max(initial=0.0) for report in one)
    assert sum(report.new.active.sum() for report in one) > 50
    for a, b in zip(one, other, strict=True):
        assert np.abs(a.new.u - b.new.u).max(initial=0.0) <= 1e-8 * largest
        assert np.array_equal(a.new.active, b.new.active)


def test_prescribed_tangents_carry_no_friction(comm: Any) -> None:
    """A box on rollers along z: its nodes there have one free tangent, and rub along that one
    only."""
    material = LinearElastic(E=1.0e6, nu=0.3, rho=1000.0)
    mesh, tags = block(comm, lengths=(1.5, 1.0, 1.2), divisions=(3, 2, 2))
    rollers = Prescribed(tags["front"], components=(2,))
    system = assemble(
        mesh,
        material,
        prescribed=[rollers],
        loads=BodyForce((0.0, -9.81e3, 0.0)),
        initial_velocity=lambda x: np.outer(x[:, 1] + 1.0, [0.5, -1.0, 0.0]),
    )
    plane = HalfSpace(point=(0.0, -1e-3, 0.0), normal=(0.0, 1.0, 0.0))
    surface = contact_surface(system, tags["bottom"], obstacle=plane)
    problem = ContactProblem(system, surface, friction=Coulomb(0.3), mass=ConsistentMass())
    ends = reports(problem, ZienkiewiczWoodTaylor())
    assert max(report.certificate.worst for report in ends) <= 1e-9
    held = surface.everywhere(np.any(surface.tangents < 0, axis=1))
    r_t = np.abs(np.array([surface.everywhere(report.result.r_t) for report in ends]))
    assert held.any() and not held.all()
    assert np.all(r_t[:, held].min(axis=2) == 0.0) and r_t[:, held].max() > 0.0
    assert r_t[:, ~held].min(axis=2).max() > 0.0
