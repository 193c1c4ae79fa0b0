"""Equilibrium of bodies that contact alone holds (semi-coercive problems), and what has none."""

from __future__ import annotations

import numpy as np
import pytest
from bar import bar
from chain import chain_problem
from fem_problems import CONCRETE, block, field, held_by, linear, max_over_ranks
from gathered import gathered
from standing import COLUMN, COMM, G, standing

from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.core.step import State
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import BodyForce, Prescribed, Traction
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.laws.friction import Coulomb
from vi_contact.run.march import march
from vi_contact.run.static import static_equilibrium
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.volume.route import ReducedNewton, Volume

solvers = pytest.mark.parametrize(
    "solver", [Condensed(), Volume(method=ReducedNewton())], ids=["condensed", "volume"]
)


def weight_of(problem: ContactProblem) -> float:
    """Of the block [N], from its own load vector: the vertical resultant."""
    load = problem.system.load(0.0)
    return float(np.abs(COMM.allreduce(load @ problem.system.influence[:, 1])))


def unbalanced(problem: ContactProblem, state: State) -> float:
    """The largest nodal K u + B_nᵀ r_n - f over the largest nodal load."""
    system = problem.static_load
    residual = (
        system.K @ state.u
        + problem.surface.reaction_load(state.r_n, system.rows)
        - system.load(state.t)
    )
    return max_over_ranks(COMM, residual) / max_over_ranks(COMM, system.load(state.t))


@pytest.mark.serial
@pytest.mark.parametrize("gap", [0.0, 0.1])
def test_bar_stands_on_its_foot(gap):
    """Linear elements are exact at the nodes: u = -gap - rho g (L x - x²/2) / E, r = rho g L."""
    problem = bar(10, gravity=10.0, gap=gap)
    state = static_equilibrium(problem, solver=Condensed())
    x = np.linspace(0.0, 10.0, 11)
    assert state.r_n[0] == pytest.approx(100.0, rel=1e-12)
    exact = -gap - 10.0 * (10.0 * x - x**2 / 2.0) / 900.0
    np.testing.assert_allclose(
        problem.cartesian(state.u), exact, rtol=0.0, atol=1e-11 * np.abs(exact).max()
    )
    assert not state.v.any() and state.active.all()


@pytest.mark.serial
def test_chain_floats_onto_one_of_two_walls():
    """Pushed by 3 N, the loose chain crosses a gap of 50 mm and rests on the right wall without
    strain."""
    problem = chain_problem(5, floating=True, constant=3.0, gap=0.05, left_gap=0.01)
    state = static_equilibrium(problem, solver=Condensed())
    np.testing.assert_allclose(state.r_n, [3.0, 0.0], rtol=1e-10)
    np.testing.assert_allclose(problem.cartesian(state.u), 0.05, rtol=1e-11)
    with pytest.raises(InputError, match="no static equilibrium: its loads carry it off along"):
        static_equilibrium(chain_problem(5, floating=True, constant=-3.0), solver=Condensed())


@solvers
@pytest.mark.parametrize("gap", [0.0, 1.0e-3])
def test_v2_1_standing_column_presses_uniformly(gap, solver):
    """No lateral contraction: sigma_yy = -rho g (H - y) in every fibre, p = rho g H at every node,
    to 1e-10; the settlement of the top is rho g H² / 2E (nodally exact). Free to slide, the column
    keeps its place. A fall of a hundred settlements costs a digit."""
    problem = standing(material=COLUMN, gap=gap, start=(2.0e-4, 0.0))
    state = static_equilibrium(problem, solver=solver)
    pressure = 2400.0 * G * 3.0
    r_n = problem.surface.everywhere(state.r_n)
    assert r_n / problem.surface.whole().weights == pytest.approx(np.full(5, pressure), rel=1e-9)
    assert r_n.sum() == pytest.approx(pressure, rel=1e-9 if gap else 1e-10)
    points, u = field(problem.system, problem.cartesian(state.u))
    y = points[:, 1]
    sag = 2400.0 * G * (3.0 * y - y**2 / 2.0) / 2.0e10
    assert np.abs(u[:, 1] + gap + sag).max() < 1e-9 * (sag.max() + gap)
    assert np.abs(u[:, 0] - 2.0e-4).max() < 1e-9 * (2.0e-4 + gap)


@pytest.mark.parametrize(
    "shape",
    [
        {"angle": 0.5},
        {"simplices": True},
        {"lengths": (0.3, 6.0), "divisions": (4, 60)},
        {"lengths": (1.0, 1.5, 0.7), "divisions": (3, 4, 2)},
        {"lengths": (1.0, 1.5, 0.7), "divisions": (3, 4, 2), "simplices": True, "angle": 0.3},
    ],
    ids=["turned", "triangles", "slender", "hexahedra", "tetrahedra"],
)
def test_reactions_carry_the_weight(shape):
    """Σ r_n = weight to 1e-10, every node balanced; the dynamic stage that continues from there
    stays still."""
    problem = standing(**shape)
    state = static_equilibrium(problem, solver=Condensed())
    push = COMM.allreduce(problem.surface.normals.T @ state.r_n)
    load = problem.system.load(0.0).reshape(-1, problem.system.space.dimension)
    assert push == pytest.approx(
        COMM.allreduce(load.sum(axis=0)), abs=1e-10 * COMM.allreduce(state.r_n.sum())
    )
    assert unbalanced(problem, state) < 1e-9 and problem.surface.some(state.active)
    sag = max_over_ranks(COMM, state.u)
    for new, _ in march(
        problem, scheme=ZienkiewiczWoodTaylor(), solver=Condensed(), dt=1e-3, steps=5, state=state
    ):
        assert max_over_ranks(COMM, new.u - state.u) < 1e-9 * sag


@pytest.mark.two_ranks
def test_free_motions_keep_their_place():
    """On level ground nothing drives a block sideways: the M-weighted mean of u_x and, in 3D, of
    the spin stay zero but for rounding, which a mode without stiffness sees magnified by that of
    the springs, 1e-4 of K."""
    for shape in ({}, {"lengths": (1.0, 1.5, 0.7), "divisions": (3, 4, 2)}):
        problem = standing(**shape)
        state = static_equilibrium(problem, solver=Condensed())
        system, points = problem.system, problem.system.space.points
        motions = [system.influence[:, i] for i in range(points.shape[1]) if i != 1]
        if points.shape[1] == 3:
            motions.append(
                system.space.restrict(
                    np.column_stack([points[:, 2], 0.0 * points[:, 0], -points[:, 0]])
                )
            )
        size = system.algebra.dot(motions[0], system.M @ np.abs(state.u))
        for motion in motions:
            assert abs(system.algebra.dot(motion, system.M @ state.u)) < 1e-9 * size


@pytest.mark.two_ranks
@pytest.mark.parametrize("push", [0.0, 5.0e3, -9.0e3])
def test_two_corners_share_the_weight_like_a_beam(push):
    """Only the base corners touch (u_x held at the base): r = W/2 ± T H / L, T = push · L on the
    top at height H."""
    problem = standing(points=[(0.0, 0.0), (1.0, 0.0)], held=True, push=push)
    state = gathered(problem.surface, static_equilibrium(problem, solver=Condensed()))
    weight, moment = 2400.0 * G * 3.0, push * 3.0
    assert state.active.all()
    assert state.r_n == pytest.approx([weight / 2.0 - moment, weight / 2.0 + moment], rel=1e-9)


def test_partly_lifted_base_balances_moments():
    """Pushed beyond the kern the base opens: Σ r_n = W, Σ r_n x = W L/2 + T H, no tension
    anywhere."""
    problem = standing(held=True, push=8.0e3, divisions=(12, 20))
    state = gathered(problem.surface, static_equilibrium(problem, solver=Condensed()))
    weight, moment = 2400.0 * G * 3.0, 8.0e3 * 3.0
    assert 0 < state.active.sum() < 13 and state.r_n.min() == 0.0
    assert state.r_n.sum() == pytest.approx(weight, rel=1e-10)
    assert state.r_n @ problem.surface.whole().points[:, 0] == pytest.approx(
        weight / 2.0 + moment, rel=1e-9
    )


@pytest.mark.two_ranks
def test_springs_settle_by_the_weight():
    """On springs of modulus k [Pa/m] a column without contraction settles by p / k, soft or
    stiff."""
    for modulus in (1.0e6, 1.0e9, 1.0e12):
        problem = standing(material=COLUMN)
        problem = ContactProblem(problem.system, problem.surface.on_springs(modulus))
        state = static_equilibrium(problem, solver=Condensed())
        pressure = 2400.0 * G * 3.0
        u_n = problem.surface.everywhere(problem.surface.normal_values(state.u))
        assert u_n == pytest.approx(np.full(5, pressure / modulus), rel=1e-7)
        assert COMM.allreduce(state.r_n.sum()) == pytest.approx(pressure, rel=1e-7)


@pytest.mark.two_ranks
def test_balanced_loads_need_no_support():
    """Pulled at both ends with p, without any contact: u = p x / E about the middle."""
    mesh, tags = block(COMM, lengths=(2.0, 1.0), divisions=(4, 2))
    pull = [Traction(tags["right"], (1.0e6, 0.0)), Traction(tags["left"], (-1.0e6, 0.0))]
    problem = linear(assemble(mesh, COLUMN, loads=pull))
    state = static_equilibrium(problem, solver=Condensed())
    points, u = field(problem.system, state.u)
    assert np.abs(u[:, 0] - 1.0e6 / 2.0e10 * (points[:, 0] - 1.0)).max() < 1e-9 * 5e-5
    assert np.abs(u[:, 1]).max() < 1e-9 * 5e-5


@pytest.mark.parametrize(
    ("case", "way"),
    [
        ({"up": True}, r"\(0, 1\)"),
        # 1 Pa on the top of a block that is free to slide: its weight is 70 kPa
        ({"push": 1.0}, r"\(1, .*\)"),
        ({"push": 1.3e4, "held": True}, r"\(1, "),  # T H > W L / 2: it tips over
        # supported on the left quarter only
        ({"points": [(0.0, 0.0), (0.25, 0.0)], "held": True}, r"\(1, -0.17\)"),
        ({"push": -20.0, "lengths": (1.0, 1.5, 0.7), "divisions": (3, 4, 2)}, r"\(-1, .*\)"),
    ],
    ids=["lifted", "pushed", "tipped", "ledge", "pushed in 3D"],
)
@pytest.mark.parametrize("gap", [0.0, 1.0e-3])
def test_no_equilibrium_is_refused(case, way, gap):
    problem = standing(gap=gap, **case)
    with pytest.raises(
        InputError, match="no static equilibrium: its loads carry it off along " + way
    ):
        static_equilibrium(problem, solver=Condensed())


@pytest.mark.two_ranks
@pytest.mark.parametrize("gap", [0.0, 1.0e-4])
def test_friction_holds_a_block_up_to_its_coefficient(gap):
    """Coulomb, mu = 0.3, on a plane inclined by theta: at tan theta = 0.99 mu it stands, Σ r_t = W
    sin theta and Σ r_n = W cos theta to 1e-9 with part of its base slipping; at 1.01 mu there is no
    equilibrium."""
    mesh, tags = block(COMM, lengths=(2.0, 1.0), divisions=(8, 4))
    ground = HalfSpace(point=(0.0, -gap), normal=(0.0, 1.0))

    def on_slope(theta: float) -> ContactProblem:
        pull = 2400.0 * G * np.array([np.sin(theta), -np.cos(theta)])
        system = assemble(mesh, CONCRETE, loads=BodyForce(tuple(pull)))
        return ContactProblem(
            system,
            contact_surface(system, tags["bottom"], obstacle=ground),
            friction=Coulomb(mu=0.3),
        )

    theta = float(np.arctan(0.99 * 0.3))
    slope = on_slope(theta)
    state = gathered(slope.surface, static_equilibrium(slope, solver=Condensed()))
    assert state.r_n.sum() == pytest.approx(4800.0 * G * np.cos(theta), rel=1e-9)
    assert state.r_t is not None and state.r_t.sum() == pytest.approx(
        4800.0 * G * np.sin(theta), rel=1e-9
    )
    used = np.abs(state.r_t[:, 0]) / np.where(state.r_n > 0.0, 0.3 * state.r_n, 1.0)
    assert used.max() < 1.0 + 1e-9 and used.min() < 0.999 and np.sum(used > 1.0 - 1e-9) > 0
    with pytest.raises(
        InputError, match=r"no static equilibrium: its loads carry it off along \(1, 0\)"
    ):
        static_equilibrium(on_slope(float(np.arctan(1.01 * 0.3))), solver=Condensed())


def test_floating_without_contact_is_refused():
    mesh, tags = block(COMM, lengths=(2.0, 1.0), divisions=(2, 3))
    weight = BodyForce((0.0, -CONCRETE.rho * G))
    problem = linear(
        assemble(mesh, CONCRETE, loads=weight, prescribed=Prescribed(tags["left"], components=(0,)))
    )
    with pytest.raises(
        InputError, match=r"along \(0, -1\) and neither contact nor a prescribed displacement stops"
    ):
        static_equilibrium(problem, solver=Condensed())


@pytest.mark.two_ranks
def test_pressed_by_a_moving_side_and_its_weight():
    """Rollers move the left side by 1 mm to the right; the block follows as a whole and rests on
    its base."""
    mesh, tags = block(COMM, lengths=(2.0, 1.0), divisions=(4, 2))

    def shift(x: Array) -> Array:
        return 0.0 * x + 1e-3

    system = assemble(
        mesh,
        COLUMN,
        prescribed=held_by(tags, "left", shift, 0),
        loads=BodyForce((0.0, -COLUMN.rho * G)),
    )
    ground = HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    problem = ContactProblem(system, contact_surface(system, tags["bottom"], obstacle=ground))
    state = static_equilibrium(problem, solver=Condensed())
    _, u = field(system, state.u)
    assert np.abs(u[:, 0] - 1e-3).max() < 1e-12
    assert COMM.allreduce(state.r_n.sum()) == pytest.approx(2.0 * COLUMN.rho * G, rel=1e-9)
