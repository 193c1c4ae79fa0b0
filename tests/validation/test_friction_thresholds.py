"""V2.7 (i), (ii): a block under the pressure p sheared with 0.99 mu p sticks, with 1.01 mu p it has
no equilibrium.

Tractions on all free sides make the stress uniform (sigma_xy = q, sigma_yy = -p) in a material
without lateral contraction; the block does not rotate and u_x = q y / G, u_y = -p y / E exactly, at
every node of its base r_n = p weight, r_t = q weight: a patch test of friction. Nothing but contact
holds the block.
"""

from __future__ import annotations

import numpy as np
import pytest
from fem_problems import block, field, turned
from mpi4py import MPI

from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import FrictionLaw
from vi_contact.core.step import State
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import Traction
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.laws.friction import Coulomb, Tresca
from vi_contact.laws.materials import LinearElastic
from vi_contact.run.static import quasi_static, static_equilibrium
from vi_contact.solvers.condensed import Condensed

pytestmark = pytest.mark.slow

COMM = MPI.COMM_WORLD
E, P, MU = 2.0e10, 4.0e6, 0.3
TAU = MU * P
LAWS = [Coulomb(MU), Tresca(TAU)]
BODIES = {
    "quadrilaterals": {"lengths": (1.2, 0.7), "divisions": (6, 4)},
    "turned triangles": {
        "lengths": (1.2, 0.7),
        "divisions": (6, 4),
        "simplices": True,
        "angle": 0.4,
    },
    "tetrahedra": {"lengths": (1.2, 0.7, 0.8), "divisions": (3, 3, 2), "simplices": True},
    "P2 triangles": {"lengths": (1.2, 0.7), "divisions": (3, 2), "simplices": True, "degree": 2},
    "Q2 hexahedra": {"lengths": (1.2, 0.7, 0.8), "divisions": (2, 1, 2), "degree": 2},
}
bodies = pytest.mark.parametrize("body", list(BODIES))
laws = pytest.mark.parametrize("law", LAWS, ids=["Coulomb", "Tresca"])


def sheared(law: FrictionLaw, body: str, share: float, *, nu: float = 0.0) -> ContactProblem:
    """``share`` of the threshold as shear at t = 1, in proportion to t; the pressure is there from
    the start."""
    spec = dict(BODIES[body])
    degree = spec.pop("degree", 1)
    angle, d = float(spec.get("angle", 0.0)), len(spec["lengths"])
    mesh, tags = block(COMM, **spec)

    def along(x: float, y: float) -> tuple[float, ...]:
        return (*turned((x, y), angle), *np.zeros(d - 2))

    q = share * TAU
    shear = [
        (tags["top"], along(q, 0.0)),
        (tags["right"], along(0.0, q)),
        (tags["left"], along(0.0, -q)),
    ]
    loads = [Traction(tags["top"], along(0.0, -P))]
    loads += [Traction(facets, value, history=lambda t: t) for facets, value in shear]
    system = assemble(mesh, LinearElastic(E=E, nu=nu, rho=2000.0), loads=loads, degree=degree)
    assert system.floating
    ground = HalfSpace(point=(0.0,) * d, normal=along(0.0, 1.0))
    return ContactProblem(
        system, contact_surface(system, tags["bottom"], obstacle=ground), friction=law
    )


def thrust(problem: ContactProblem, state: State) -> Array:
    """Sum of the forces of the body on its base (d,) [N/m or N]."""
    system = problem.static_load
    load = problem.surface.reaction_load(state.r_n, system.rows, state.r_t)
    return np.array([system.algebra.dot(column, load) for column in system.influence.T])


@laws
@bodies
def test_v2_7_below_the_threshold_sticks(body, law):
    """0.99: no node slips, u is the uniform strain and r_t / r_n = 0.99 mu at every node, to
    1e-8."""
    problem = sheared(law, body, 0.99)
    state = static_equilibrium(problem, solver=Condensed(), t=1.0)
    weights = problem.surface.weights
    assert not problem.surface.tangential_values(state.u).any()
    assert state.r_n == pytest.approx(P * weights, rel=1e-8)
    assert state.r_t is not None
    assert np.linalg.norm(state.r_t, axis=1) == pytest.approx(0.99 * TAU * weights, rel=1e-8)
    points, u = field(problem.system, problem.cartesian(state.u))
    angle = float(BODIES[body].get("angle", 0.0))
    y, back = turned(points[:, :2], -angle)[:, 1], turned(u[:, :2], -angle)
    exact = np.column_stack([0.99 * TAU * 2.0 / E * y, -P / E * y])
    assert np.abs(back - exact).max() < 1e-8 * np.abs(exact).max()


@pytest.mark.serial
@laws
@bodies
def test_v2_7_above_the_threshold_has_no_equilibrium(body, law):
    """1.01: refused in one sentence that names the direction in which the block goes off."""
    with pytest.raises(
        InputError, match="no static equilibrium: its loads carry it off along "
    ) as refusal:
        static_equilibrium(sheared(law, body, 1.01), solver=Condensed(), t=1.0)
    words = str(refusal.value).split("(")[1].split(")")[0]
    way = np.array([float(word) for word in words.split(",")])
    angle = float(BODIES[body].get("angle", 0.0))
    assert way[:2] / np.linalg.norm(way) == pytest.approx([np.cos(angle), np.sin(angle)], abs=0.01)


@pytest.mark.serial
@laws
def test_v2_7_load_steps_end_where_the_threshold_is(law):
    """Ten steps from 0.91 to 1.0 less 1e-6 of the threshold are equilibria, one with 1e-6 too much
    is not."""
    below = [*np.linspace(0.91, 0.99, 9), 1.0 - 1e-6]
    stages = quasi_static(
        sheared(law, "quadrilaterals", 1.0), [*below, 1.0 + 1e-6], solver=Condensed()
    )
    for share in below:
        state = next(stages)
        assert state.r_t is not None and state.t == share
        assert COMM.allreduce(np.abs(state.r_t).sum()) == pytest.approx(share * TAU * 1.2, rel=1e-9)
    with pytest.raises(InputError, match=r"carry it off along \(1, 0\)"):
        next(stages)


@pytest.mark.serial
@laws
@pytest.mark.parametrize("share", [0.99, 1.01])
def test_v2_7_with_lateral_contraction(law, share):
    """nu = 0.3: stresses are not uniform, part of the base slips on a small way of the order of the
    elastic strain under 0.99, and the threshold of the whole is the same."""
    problem = sheared(law, "quadrilaterals", share, nu=0.3)
    if share > 1.0:
        with pytest.raises(InputError, match=r"carry it off along \(1, "):
            static_equilibrium(problem, solver=Condensed(), t=1.0)
        return
    state = static_equilibrium(problem, solver=Condensed(), t=1.0)
    assert state.r_t is not None
    limit = law.limit(state.r_n, problem.surface.weights, 1.0)
    slip = np.abs(problem.surface.everywhere(problem.surface.tangential_values(state.u))).ravel()
    assert np.all(np.abs(state.r_t).ravel() <= limit * (1.0 + 1e-12))
    assert 0 < np.sum(slip > 0.0) < problem.surface.total and slip.max() < 2.0 * P / E * 1.2
    assert thrust(problem, state) == pytest.approx(np.array([share * TAU, -P]) * 1.2, rel=1e-9)
