"""V2.6: the plate of Raous and of the GRECO working group, pressed and pushed over a rough plane
(Coulomb, mu = 1).

Half of a plate, [0, 0.04]² m in plane strain: symmetry on the right, 150 MPa on the left side, 50
MPa on the top. Left to right the base opens, slips and sticks. Points of the base: A 0, B 1.25, C
5, D 7.5, E 11.25 mm.

The reference fixes the corner (0.04, 0); here its contact condition does that, under pressure and
on the symmetry line. Its reaction is left out of the sums, as there.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from fem_problems import block
from mpi4py import MPI

from vi_contact.core.algebra import Array
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import FrictionLaw, Frictionless
from vi_contact.core.step import Solver, State
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import Prescribed, Traction
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.laws.friction import Coulomb
from vi_contact.laws.materials import LinearElastic
from vi_contact.run.static import quasi_static, static_equilibrium
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.friction.fixed_point import FixedPoint
from vi_contact.solvers.friction.newton import FrictionNewton

pytestmark = pytest.mark.serial  # ranks change none of these numbers: cheaper tests show it

COMM = MPI.COMM_WORLD
CONDENSED = Condensed()
SIDE = 0.04
POINTS = (0.0, 1.25e-3, 5.0e-3, 7.5e-3, 11.25e-3)
PUBLISHED = (2.86e-5, 2.72e-5, 2.28e-5, 1.98e-5, 1.50e-5)  # u_x [m], to 5 %
# u_x on 32 x 10 Q1
REFERENCE = (2.8459438e-5, 2.7079236e-5, 2.2740255e-5, 1.9727067e-5, 1.5364159e-5)


def plate(
    comm: Any = COMM, *, divisions: tuple[int, int] = (32, 10), simplices: bool = False
) -> ContactProblem:
    """The loads grow with t and are complete at t = 1."""
    mesh, tags = block(comm, lengths=(SIDE, SIDE), divisions=divisions, simplices=simplices)
    system = assemble(
        mesh,
        LinearElastic(E=1.3e11, nu=0.2, rho=7800.0),
        prescribed=Prescribed(tags["right"], components=(0,)),
        loads=[
            Traction(tags["left"], (15.0e7, 0.0), history=lambda t: t),
            Traction(tags["top"], (0.0, -5.0e7), history=lambda t: t),
        ],
    )
    return ContactProblem(system, contact_surface(system, tags["bottom"]), friction=Coulomb(1.0))


@dataclass(frozen=True)
class Base:
    """Along the base, left to right: x [m], u_x, u_y [m], reactions on the ground along -y and +x
    [N/m]."""

    x: Array
    u_x: Array
    u_y: Array
    r_n: Array
    r_t: Array

    @classmethod
    def of(cls, problem: ContactProblem, state: State) -> Base:
        surface = problem.surface
        order = np.argsort(surface.points[:, 0])
        assert state.r_t is not None
        columns = (
            surface.points[:, 0],
            surface.tangential_values(state.u)[:, 0],
            -surface.normal_values(state.u),
            state.r_n,
            state.r_t[:, 0],
        )
        return cls(*(column[order] for column in columns))

    def at_points(self) -> Array:
        """u_x at A ... E."""
        return np.interp(POINTS, self.x, self.u_x)


def computed(*, solver: Solver = CONDENSED, **spec: Any) -> Base:
    problem = plate(**spec)
    return Base.of(problem, static_equilibrium(problem, solver=solver, t=1.0))


@pytest.mark.parametrize(
    "method", [FrictionNewton(), FixedPoint()], ids=["FrictionNewton", "FixedPoint"]
)
def test_v2_6_digits(method):
    """All printed digits of u_x at A ... E, u_y(A), the sums of the reactions and that of the last
    free point.

    (NSGS is no method for a body that contact alone holds vertically: 5000 sweeps do not move it
    enough.)"""
    base = computed(solver=Condensed(friction_method=method))
    assert base.at_points() == pytest.approx(REFERENCE, rel=3e-8)
    assert base.u_x[0] == pytest.approx(2.84594384e-5, rel=2e-9)
    assert base.u_y[0] == pytest.approx(7.298657e-7, rel=1e-7)
    assert base.r_n[:-1].sum() == pytest.approx(1.947553e6, rel=3e-7)
    assert base.r_t[:-1].sum() == pytest.approx(1.412694e6, rel=3e-7)
    assert base.r_n[-2] == pytest.approx(1.04863768e5, rel=5e-9)
    assert base.at_points() == pytest.approx(PUBLISHED, rel=0.05)


def test_v2_6_zones():
    """Open on [0, 3.75), slip towards the symmetry line on [3.75, 31.25), stick on [31.25, 40] mm;
    all is balanced."""
    base = computed()
    mm = 1e3 * base.x
    opened, slipping, sticking = mm < 3.7, (mm > 3.7) & (mm < 31.2), mm > 31.2
    assert (
        np.all(base.u_y[opened] > 0.0) and not base.r_n[opened].any() and not base.r_t[opened].any()
    )
    assert np.all(base.u_x[slipping] > 0.0) and base.r_t[slipping] == pytest.approx(
        base.r_n[slipping], rel=1e-14
    )
    assert not base.u_x[sticking].any() and np.all(
        np.abs(base.r_t[sticking]) < 0.6 * base.r_n[sticking]
    )
    assert not base.u_y[~opened].any() and np.all(base.r_n[~opened] > 0.0)
    assert base.r_n.sum() == pytest.approx(5.0e7 * SIDE, rel=1e-10)


def test_v2_6_ten_load_steps():
    """Proportional loading in ten steps ends like one step, to 1e-8; u grows with the load
    (homogeneity)."""
    problem = plate()
    once = static_equilibrium(problem, solver=Condensed(), t=1.0)
    for state in quasi_static(problem, np.linspace(0.1, 1.0, 10), solver=Condensed()):
        base, whole = Base.of(problem, state), Base.of(problem, once)
        for name in ("u_x", "u_y", "r_n", "r_t"):
            part, end = getattr(base, name), getattr(whole, name)
            assert np.abs(part - state.t * end).max() <= 1e-8 * np.abs(end).max(), (name, state.t)
    assert state.k == 10 and state.t == 1.0


def released(friction: FrictionLaw) -> ContactProblem:
    """The plate whose loads go back to zero from t = 1 to 2."""
    problem = plate()
    load = problem.system.load
    there_and_back = tuple((vector, lambda t: min(t, 2.0 - t)) for vector, _ in load.separable)
    system = replace(problem.system, load=replace(load, separable=there_and_back))
    return replace(problem, system=system, friction=friction)


def test_v2_6_unloading_is_another_path():
    """At half the load on the way back friction still holds 93 % of u_x(A), found to 1e-3 with half
    as many steps; without friction it is half. At zero load nothing presses and nothing is left."""
    found = {}
    for steps in (5, 10):
        times = [1.0, *np.linspace(1.0, 2.0, 2 * steps + 1)[1:]]
        problem = released(Coulomb(1.0))
        states = list(quasi_static(problem, times, solver=Condensed()))
        there, half, free = (Base.of(problem, states[i]) for i in (0, steps, -1))
        found[steps] = half.u_x[0] / there.u_x[0]
        assert not free.r_n.any() and np.abs(free.u_x).max() < 1e-9 * there.u_x[0]
        assert there.u_x[0] == pytest.approx(REFERENCE[0], rel=3e-8)
    assert found[10] == pytest.approx(0.93, abs=0.005) and found[5] == pytest.approx(
        found[10], rel=1e-3
    )
    smooth = released(Frictionless())
    there, half = (
        smooth.surface.tangential_values(state.u)[:, 0].max()
        for state in quasi_static(smooth, [1.0, 1.5], solver=Condensed())
    )
    assert half == pytest.approx(0.5 * there, rel=1e-9)


@pytest.mark.parametrize(
    ("divisions", "simplices"),
    [((32, 32), False), ((64, 20), False), ((64, 64), True), ((48, 40), False)],
    ids=["32x32", "64x20", "64x64 triangles", "48x40"],
)
def test_v2_6_other_meshes(divisions, simplices):
    """1 % of u_x at A ... E on other meshes; A and B between nodes where the mesh has none
    there."""
    assert computed(divisions=divisions, simplices=simplices).at_points() == pytest.approx(
        REFERENCE, rel=0.01
    )


def test_v2_6_ranks_agree():
    """All ranks together and each alone: 1e-10."""
    together, alone = computed(), computed(comm=MPI.COMM_SELF)
    for name in ("u_x", "u_y", "r_n", "r_t"):
        one, other = getattr(together, name), getattr(alone, name)
        assert np.abs(one - other).max() <= 1e-10 * np.abs(other).max()
