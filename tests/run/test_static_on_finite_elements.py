"""Static equilibrium on contact: gravity stages, bilateral points, deformable supports."""

from __future__ import annotations

from math import cos

import numpy as np
import pytest
from fem_problems import CONCRETE, block, field, held_by, max_over_ranks, turned
from mpi4py import MPI

from vi_contact.core.algebra import Array
from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.core.step import State
from vi_contact.core.surfaces import ContactSurface
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import BodyForce, Prescribed, Traction
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.laws.materials import LinearElastic, PlaneStress
from vi_contact.run.march import march
from vi_contact.run.static import static_equilibrium
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed

COMM = MPI.COMM_WORLD
GROUND = HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))


@pytest.mark.parametrize("angle", [0.0, 0.5])
@pytest.mark.parametrize("simplices", [False, True])
def test_gravity_stage_balances_forces_and_stays_still(angle, simplices):
    """A block on a level or inclined plane, clamped on its left side: K u - f is the contact force,
    along the plane's normal. The dynamic stage that continues from it stays still to 1e-12."""
    mesh, tags = block(COMM, lengths=(2.0, 1.0), divisions=(6, 4), simplices=simplices, angle=angle)
    weight = 2.0 * CONCRETE.rho * 9.80665 * 0.4
    load = BodyForce((0.0, -CONCRETE.rho * 9.80665))
    system = assemble(mesh, CONCRETE, section=PlaneStress(0.4), clamped=tags["left"], loads=load)
    plane = HalfSpace(point=(0.0, 0.0), normal=tuple(turned((0.0, 1.0), angle)))
    problem = ContactProblem(system, contact_surface(system, tags["bottom"], obstacle=plane))
    start = static_equilibrium(problem, solver=Condensed())
    contact = system.load(0.0) - system.K @ problem.cartesian(start.u)
    push = COMM.allreduce(problem.surface.normals.T @ start.r_n)
    assert COMM.allreduce(contact.reshape(-1, 2).sum(axis=0)) == pytest.approx(
        push, abs=1e-9 * weight
    )
    assert 0.5 * weight * cos(angle) < COMM.allreduce(start.r_n.sum()) < weight * cos(angle)
    stays_still(problem, start)


def test_gravity_stage_shares_the_weight():
    """A column without lateral contraction between a held top and the ground: each carries half of
    the weight."""
    mesh, tags = block(COMM, lengths=(1.0, 3.0), divisions=(2, 5))
    column = LinearElastic(E=2.0e10, nu=0.0, rho=2400.0)
    hold = [Prescribed(tags["top"], components=(1,)), Prescribed(tags["left"], components=(0,))]
    system = assemble(mesh, column, prescribed=hold, loads=BodyForce((0.0, -2400.0 * 9.80665)))
    problem = ContactProblem(system, contact_surface(system, tags["bottom"], obstacle=GROUND))
    start = static_equilibrium(problem, solver=Condensed())
    r_n = problem.surface.everywhere(start.r_n)
    assert start.active.all()
    assert r_n.sum() == pytest.approx(0.5 * 3.0 * 2400.0 * 9.80665, rel=1e-12)
    assert r_n / problem.surface.whole().weights == pytest.approx(
        np.full(3, 1.5 * 2400.0 * 9.80665), rel=1e-12
    )
    stays_still(problem, start)


def stays_still(problem: ContactProblem, start: State) -> None:
    """Ten steps from a static state without excitation change nothing: neither displacements nor
    reactions."""
    sag = max_over_ranks(COMM, start.u)
    for state, report in march(
        problem, scheme=ZienkiewiczWoodTaylor(), solver=Condensed(), dt=1e-3, steps=10, state=start
    ):
        assert max_over_ranks(COMM, state.u - start.u) < 1e-12 * sag
        assert np.array_equal(state.active, start.active) and report.certificate.worst < 1e-12
        assert max_over_ranks(COMM, state.r_n - start.r_n) < 1e-10 * max_over_ranks(COMM, start.r_n)


def test_gravity_stage_of_a_clamped_wall_leaves_its_side_touching():
    """A wall beside the ground, Poisson's ratio 0.2: its weight widens it against the ground, Σ r_n
    > 0. The clamped base balances these reactions and carries the whole weight."""
    mesh, tags = block(COMM, lengths=(2.0, 3.0), divisions=(4, 6))
    system = assemble(
        mesh, CONCRETE, clamped=tags["bottom"], loads=BodyForce((0.0, -CONCRETE.rho * 9.80665))
    )
    ground = HalfSpace(point=(2.0, 0.0), normal=(-1.0, 0.0))
    problem = ContactProblem(system, contact_surface(system, tags["right"], obstacle=ground))
    start = static_equilibrium(problem, solver=Condensed())
    pushing = COMM.allreduce(start.r_n.sum())
    assert problem.surface.some(start.active) and pushing > 0.0
    free = assemble(mesh, CONCRETE, loads=BodyForce((0.0, -CONCRETE.rho * 9.80665)))
    points, u = field(system, start.u)
    forces = field(free, free.K @ free.space.restrict(u[free.space.nodes]))[1]
    # K u of the unclamped body: supports minus the base's own share of the weight
    base = forces[points[:, 1] == 0.0]
    weight = 6.0 * CONCRETE.rho * 9.80665
    own = CONCRETE.rho * 9.80665 * 0.5 * 2.0 * 0.5  # half of the lowest row of elements
    assert base[:, 0].sum() == pytest.approx(pushing, rel=1e-9)
    assert base[:, 1].sum() + own == pytest.approx(weight, rel=1e-12)


def test_bilateral_points_pull_as_well():
    """Lifted by a traction, held points carry the tension that unilateral ones refuse."""
    mesh, tags = block(COMM, lengths=(2.0, 1.0), divisions=(4, 2))
    system = assemble(
        mesh, CONCRETE, clamped=tags["left"], loads=Traction(tags["top"], (0.0, 1.0e6))
    )
    one = contact_surface(system, tags["bottom"], obstacle=GROUND)
    assert not one.bilateral.any() and one.bilateral_everywhere().bilateral.all()
    held = static_equilibrium(
        ContactProblem(system, one.bilateral_everywhere()), solver=Condensed()
    )
    loose = static_equilibrium(ContactProblem(system, one), solver=Condensed())
    assert held.active.all() and one.some(held.r_n < 0.0)
    assert max_over_ranks(COMM, one.normal_values(held.u)) <= 1e-15 * max_over_ranks(COMM, held.u)
    assert not loose.active.any() and not loose.r_n.any()


def spring_support(stiffness: float | None) -> tuple[ContactSurface, Array, Array]:
    """(surface, u_n, r_n) of a block pressed down by 1 mm at its top; nu = 0, so that it is a
    spring of 2e10 Pa/m."""
    mesh, tags = block(COMM, lengths=(2.0, 1.0), divisions=(4, 2))
    press = [
        held_by(tags, "top", lambda x: 0.0 * x - 1e-3, 1),
        Prescribed(tags["left"], components=(0,)),
    ]
    material = LinearElastic(E=2.0e10, nu=0.0, rho=2400.0)
    system = assemble(mesh, material, section=PlaneStress(0.4), prescribed=press)
    surface = contact_surface(system, tags["bottom"], obstacle=GROUND)
    surface = surface if stiffness is None else surface.on_springs(stiffness)
    state = static_equilibrium(ContactProblem(system, surface), solver=Condensed())
    return (
        surface.whole(),
        surface.everywhere(surface.normal_values(state.u)),
        surface.everywhere(state.r_n),
    )


@pytest.mark.parametrize("stiffness", [1.0e9, 1.0e12])
def test_springs_in_series_with_the_body(stiffness):
    """Foundation modulus k [Pa/m] under a body of modulus E/H: pressure 1 mm / (H/E + 1/k),
    settlement p/k, at every node (the remark after eq. 6)."""
    surface, u_n, r_n = spring_support(stiffness)
    pressure = 1e-3 / (1.0 / 2.0e10 + 1.0 / stiffness)
    assert r_n / surface.weights == pytest.approx(np.full(surface.count, pressure), rel=1e-11)
    assert u_n == pytest.approx(np.full(surface.count, pressure / stiffness), rel=1e-9)


def test_stiff_springs_tend_to_the_rigid_support():
    """The settlement falls as 1/k, the reactions tend to those of the rigid support."""
    _, _, rigid = spring_support(None)
    settled, missing = [], []
    for stiffness in (1.0e13, 1.0e14, 1.0e15):
        _, u_n, r_n = spring_support(stiffness)
        settled.append(np.abs(u_n).max())
        missing.append(np.abs(r_n / rigid - 1.0).max())
    assert settled[0] / settled[1] == pytest.approx(10.0, rel=2e-2)
    assert settled[1] / settled[2] == pytest.approx(10.0, rel=2e-2)
    assert missing[2] < 3e-5 and missing[0] / missing[2] == pytest.approx(100.0, rel=2e-2)
