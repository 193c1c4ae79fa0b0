"""Friction methods on small random problems: against an enumeration of states in 2D, against each
other in 3D."""

from __future__ import annotations

from functools import cache
from itertools import product
from typing import Any

import numpy as np
import pytest
from small_steps import small

from vi_contact.core.algebra import Array, Mask, SerialComm
from vi_contact.core.errors import InputError, StepFailure
from vi_contact.kernels.compiler import load_loops
from vi_contact.solvers.friction import linear as friction_linear
from vi_contact.solvers.friction import newton as friction_newton
from vi_contact.solvers.friction.extrapolation import Anderson, Plain
from vi_contact.solvers.friction.fixed_point import FixedPoint
from vi_contact.solvers.friction.given_forces import GivenForces
from vi_contact.solvers.friction.newton import FrictionNewton
from vi_contact.solvers.friction.nsgs import NSGS
from vi_contact.solvers.friction.problem import FrictionResult
from vi_contact.solvers.normal.active_set import ActiveSet

pytestmark = pytest.mark.serial
METHODS = [
    FrictionNewton(),
    NSGS(),
    FixedPoint(),
    FixedPoint(tresca=NSGS()),
    FixedPoint(extrapolation=Anderson()),
    GivenForces(),
    GivenForces(extrapolation=Anderson()),
]
NAMES = ["newton", "nsgs", "fixed", "fixed nsgs", "anderson", "given", "given anderson"]


def enumerated(G: Array, q: Array, bilateral: Mask, cohesion: Array, slope: Array) -> list[Array]:
    """All solutions in 2D: every set of states (open, pressed or pulled; stick, slip either way)
    with right signs."""
    m, found = len(q), []
    kinds = [(1, 2) if held else (0, 1) for held in bilateral]  # 0 open, 1 pressed, 2 pulled
    states = [list(product(of_node, (0, 1, -1))) for of_node in kinds]
    for state in product(*states):
        # unknowns r; row of node i: r_n = 0 (open) or w_n = 0; w_t = 0 or r_t = side (cohesion +
        # slope r_n)
        matrix, right = G.copy(), -q.ravel()
        for i, (kind, side) in enumerate(state):
            if kind == 0:
                matrix[2 * i], right[2 * i] = np.eye(2 * m)[2 * i], 0.0
            if side:
                matrix[2 * i + 1], right[2 * i + 1] = np.eye(2 * m)[2 * i + 1], side * cohesion[i]
                matrix[2 * i + 1, 2 * i] = -side * slope[i] if kind == 1 else 0.0
        r = np.linalg.solve(matrix, right)
        w = q.ravel() + G @ r
        r, w = r.reshape(m, 2), w.reshape(m, 2)
        if _admissible(r, w, state, G, cohesion, slope):
            found.append(r)
    return found


def _admissible(r: Array, w: Array, state: Any, G: Array, cohesion: Array, slope: Array) -> bool:
    size = G.diagonal().reshape(-1, 2) ** 0.5
    tiny = 1e-10 * np.abs(r * size).max()
    for i, (kind, side) in enumerate(state):
        limit = cohesion[i] + slope[i] * max(r[i, 0], 0.0)
        gap, way, r_n, r_t = (
            w[i, 0] / size[i, 0],
            w[i, 1] / size[i, 1],
            r[i, 0] * size[i, 0],
            r[i, 1] * size[i, 1],
        )
        good = gap >= -tiny if kind == 0 else (r_n >= -tiny if kind == 1 else r_n <= tiny)
        good &= abs(r_t) <= limit * size[i, 1] + tiny if side == 0 else side * way <= tiny
        if not good:
            return False
    return True


def energy_norm(r: Array, G: Array) -> float:
    """√(rᵀG r): every reaction counts alike."""
    return float(np.sqrt(r.ravel() @ G @ r.ravel()))


@cache
def enumeration(seed: int, law: str) -> tuple[tuple[Array, Array, Mask], Array, Array, list[Array]]:
    """One to three nodes, some held, with a law, for every method: the problem, cohesion, slope and
    all solutions."""
    m = 1 + seed % 3
    G, q, bilateral = small(seed, m, 2)
    slope = np.full(m, 0.3 if law != "tresca" else 0.0)
    cohesion = G[1::2, 1::2].diagonal() ** -0.5 * (0.2 if law != "coulomb" else 0.0)
    for array in (G, q, bilateral, slope, cohesion):
        array.setflags(write=False)
    return (G, q, bilateral), cohesion, slope, enumerated(G, q, bilateral, cohesion, slope)


@pytest.mark.slow
@pytest.mark.parametrize("law", ["coulomb", "tresca", "both"])
@pytest.mark.parametrize("method", METHODS, ids=NAMES)
def test_two_dimensions_against_enumeration(method: Any, law: str) -> None:
    """The method finds the solution, and there is one only."""
    contacts = 0
    for seed in range(12):
        (G, q, bilateral), cohesion, slope, solutions = enumeration(seed, law)
        result = method.prepare(G, bilateral).solve(q, cohesion, slope)
        scale = max(energy_norm(result.r, G), 1e-300)
        assert solutions and all(
            energy_norm(result.r - one, G) <= 1e-9 * scale for one in solutions
        )
        contacts += int(result.active.sum())
    assert contacts > 12


@pytest.mark.slow
@pytest.mark.parametrize("d, mu", [(2, 0.3), (2, 0.8), (3, 0.5), (3, 0.8)])
@pytest.mark.promise("guide/solvers.md", "The methods agree to 1e-9, on random problems")
def test_methods_agree(d: int, mu: float) -> None:
    """Up to eight nodes, every second number with each coefficient, 1e-9; slip and stick both
    occur; no reaction leaves its cone by more than the last digit."""
    sticking = slipping = 0
    for seed in range(mu == 0.8, 8, 2):
        m = 1 + seed
        G, q, bilateral = small(100 + seed, m, d)
        results = [
            method.prepare(G, bilateral).solve(q, np.zeros(m), np.full(m, mu)) for method in METHODS
        ]
        scale = max(energy_norm(results[0].r, G), 1e-300)
        for other in results[1:]:
            assert energy_norm(other.r - results[0].r, G) <= 1e-9 * scale
            assert np.array_equal(other.active, results[0].active)
            assert np.array_equal(other.stick, results[0].stick)
        r = results[0].r
        assert np.all(
            np.linalg.norm(r[:, 1:], axis=1) <= mu * np.maximum(r[:, 0], 0.0) * (1.0 + 4e-16)
        )
        assert np.all(r[~bilateral, 0] >= 0.0)
        sticking += int(results[0].stick.sum())
        slipping += int((results[0].active & ~results[0].stick & (r[:, 0] > 0.0)).sum())
    assert sticking > 0 and slipping > 0


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("method", METHODS, ids=NAMES)
def test_no_friction_is_the_frictionless_problem(method: Any, d: int) -> None:
    """mu = 0 and threshold 0 alike: the answer of ActiveSet on the normal rows to round-off, no
    tangential reaction."""
    G, q, bilateral = small(7, 8, d)
    result = method.prepare(G, bilateral).solve(q, np.zeros(8), np.zeros(8))
    normal = ActiveSet().prepare(G[::d, ::d], bilateral).solve(q[:, 0])
    size = G[::d, ::d].diagonal() ** 0.5
    assert np.abs((result.r[:, 0] - normal.r) * size).max() <= 1e-11 * np.abs(normal.r * size).max()
    assert not result.r[:, 1:].any() and not result.stick.any()
    assert np.array_equal(result.active, normal.active) and normal.active.any()


@pytest.mark.parametrize("d", [2, 3])
def test_huge_friction_is_stick(d: int) -> None:
    """mu = 1e6: every pressed node keeps its place, and the reactions are those of the linear
    problem held there."""
    G, q, _ = small(3, 6, d)
    free = np.zeros(6, dtype=bool)
    result = FrictionNewton().prepare(G, free).solve(q, np.zeros(6), np.full(6, 1e6))
    assert result.stick.any() and np.array_equal(result.stick, result.active)
    held = np.repeat(result.active, d)
    expected = np.zeros(6 * d)
    expected[held] = np.linalg.solve(G[np.ix_(held, held)], -q.ravel()[held])
    assert energy_norm(result.r.ravel() - expected, G) <= 1e-12 * energy_norm(expected, G)
    assert np.all((q.ravel() + G @ expected)[::d][~result.active] >= 0.0)


@pytest.mark.parametrize("method", METHODS, ids=NAMES)
def test_out_of_reach_and_at_rest(method: Any) -> None:
    """q_n = +inf carries nothing under Coulomb's law and rubs under Tresca's; an open problem takes
    no iteration."""
    G, q, _ = small(11, 4, 2)
    free = np.zeros(4, dtype=bool)
    q[:, 0] = [np.inf, -np.abs(q[1, 0]), np.inf, np.abs(q[3, 0])]
    prepared = method.prepare(G, free)
    result = prepared.solve(q, np.zeros(4), np.full(4, 0.3), np.array([True, False, True, True]))
    assert not result.r[[0, 2]].any() and result.r[1, 0] > 0.0
    cohesion = np.full(4, 1e-3 * result.r[1, 0])
    rubbing = prepared.solve(q, cohesion, np.zeros(4)).r
    assert np.all(rubbing[[0, 2], 0] == 0.0) and np.all(np.abs(rubbing[[0, 2], 1]) > 0.0)
    q[:, 0] = np.abs(np.where(np.isinf(q[:, 0]), 1.0, q[:, 0]))
    still = prepared.solve(q, np.zeros(4), np.full(4, 0.3))
    assert not still.r.any() and still.residual == 0.0 and not still.active.any()


@pytest.mark.parametrize("d", [2, 3])
def test_newton_remembers_factors_not_answers(d: int) -> None:
    """Restarts repeat to the last bit: an answer does not depend on the problems solved before."""
    G, q, bilateral = small(5, 9, d)
    mu, none, guess = np.full(9, 0.4), np.zeros(9), np.ones(9, dtype=bool)
    used = FrictionNewton().prepare(G, bilateral)
    for factor in (1.0, 1.3, -0.5):
        used.solve(factor * q, none, mu, guess)
    again = used.solve(q, none, mu, guess)
    fresh = FrictionNewton().prepare(G, bilateral).solve(q, none, mu, guess)
    assert np.array_equal(again.r, fresh.r) and again.iterations == fresh.iterations


@pytest.mark.parametrize("d", [2, 3])
def test_newton_without_a_compiler_is_the_same(d: int, monkeypatch: Any) -> None:
    """Compiled sweeps before Newton save linear solves, and change no more than round-off."""
    spent, none, some = [], np.zeros(12), np.full(12, 0.1)
    for seed in range(10):
        (G, q, bilateral), results = small(500 + seed, 12, d), []
        for found in (friction_newton.load_loops, lambda comm: None):
            with monkeypatch.context() as patch:
                patch.setattr(friction_newton, "load_loops", found)
                prepared = FrictionNewton().prepare(G, bilateral)
            results.append(prepared.solve(q, some if seed % 2 else none, np.full(12, 0.4)))
        assert energy_norm(results[1].r - results[0].r, G) <= 1e-12 * energy_norm(results[0].r, G)
        assert np.array_equal(results[0].stick, results[1].stick) and results[0].residual <= 1e-13
        spent.append([result.iterations for result in results])
    assert load_loops(SerialComm()) is None or np.sum(spent, axis=0)[0] < np.sum(spent, axis=0)[1]


@pytest.mark.parametrize(("d", "held"), [(2, 0.0), (2, 0.2), (2, 1e9), (3, 1e9)])
def test_places_that_are_left_solve_the_problem_too(d: int, held: float, monkeypatch: Any) -> None:
    """Where most places hold, the small matrix of the others gives the answer of the large one, to
    rounding."""
    rests = []
    rest = friction_linear.Factored._form_rest

    def counted(*arguments: Any) -> Any:
        rests.append(rest(*arguments))
        return rests[-1]

    monkeypatch.setattr(friction_linear.Factored, "_form_rest", counted)
    monkeypatch.setattr(friction_newton, "load_loops", lambda comm: None)
    for seed in range(8):
        (G, q, bilateral), results = small(700 + seed, 12, d), []
        q[:, 0] = -np.abs(np.where(np.isinf(q[:, 0]), 1.0, q[:, 0]))
        for large in (10**6, 1):
            monkeypatch.setattr(friction_linear, "LARGE", large)
            results.append(
                FrictionNewton().prepare(G, bilateral).solve(q, np.full(12, held), np.full(12, 0.6))
            )
        assert energy_norm(results[1].r - results[0].r, G) <= 1e-12 * energy_norm(results[0].r, G)
        assert np.array_equal(results[0].stick, results[1].stick) and results[1].residual <= 1e-13
    assert any(len(matrix) for matrix in rests)


def test_newton_is_exact_in_few_steps_from_any_guess() -> None:
    """2D: finite, residual at rounding, whatever set is guessed."""
    for seed in range(8):
        G, q, bilateral = small(seed, 10, 2)
        rng = np.random.default_rng(seed)
        prepared = FrictionNewton().prepare(G, bilateral)
        for guess in (
            None,
            np.zeros(10, dtype=bool),
            np.ones(10, dtype=bool),
            rng.random(10) < 0.5,
        ):
            result = prepared.solve(q, np.zeros(10), np.full(10, 0.3), guess)
            assert result.residual <= 1e-13 and result.iterations <= 8


def test_points_that_stick_stick_to_rounding() -> None:
    """Their slip is taken as zero by the solver, which moves the body: what is left of it is an
    error of the step."""
    sticking = 0
    for seed in range(20):
        G, q, bilateral = small(seed, 10, 2)
        size = G.diagonal().reshape(q.shape) ** 0.5
        result = FixedPoint().prepare(G, bilateral).solve(q, np.zeros(10), np.full(10, 0.3))
        w = (q + (G @ result.r.ravel()).reshape(q.shape)) / size
        assert np.abs(w[result.stick, 1]).max(initial=0.0) <= 1e-13 * np.abs(q / size).max()
        sticking += int(result.stick.sum())
    assert sticking > 10


@pytest.mark.parametrize("method", METHODS, ids=NAMES)
def test_a_point_that_slips_a_little_does_not_stick(method: Any) -> None:
    """r_n = 1, r_t = mu, and a slip of 1e-9 of the penetration that the reactions remove."""
    result = method.prepare(np.eye(2), np.zeros(1, dtype=bool)).solve(
        np.array([[-1.0, -0.3 - 1e-9]]), np.zeros(1), np.full(1, 0.3)
    )
    assert result.r == pytest.approx(np.array([[1.0, 0.3]]), rel=1e-12) and not result.stick.any()


def contraction(result: FrictionResult) -> float:
    """Return the mean factor between changes of the thresholds above rounding (1e-10 of the first);
    NaN below two."""
    changes = [change for change in result.history if change > 1e-10 * result.history[0]]
    return (
        float((changes[-1] / changes[0]) ** (1.0 / (len(changes) - 1)))
        if len(changes) > 1
        else float("nan")
    )


def test_fixed_point_contracts_faster_for_less_friction() -> None:
    G, q, bilateral = small(20, 8, 2)
    factors = []
    for mu in (0.05, 0.2, 0.5):
        result = FixedPoint().prepare(G, bilateral).solve(q, np.zeros(8), np.full(8, mu))
        assert result.iterations == len(result.history) + 1
        factors.append(contraction(result))
    assert 0.0 < factors[0] < factors[1] < factors[2] < 1.0


@pytest.mark.long
def test_extrapolation_shortens_fixed_points() -> None:
    """2D and 3D, mu = 0.5: Anderson's method needs fewer problems than plain iterations;
    also where the plain map expands before it contracts (mu = 0.8, one strongly coupled node)."""
    for kind in (FixedPoint, GivenForces):
        counts = []
        for way in (Plain(), Anderson()):
            spent = 0
            for seed in range(16):
                m, d = 1 + seed % 8, 2 + seed % 2
                G, q, bilateral = small(100 + seed, m, d)
                spent += (
                    kind(extrapolation=way)
                    .prepare(G, bilateral)
                    .solve(q, np.zeros(m), np.full(m, 0.5))
                    .iterations
                )
            counts.append(spent)
            G, q, bilateral = small(112, 1, 2)
            assert (
                kind(extrapolation=way)
                .prepare(G, bilateral)
                .solve(q, np.zeros(1), np.full(1, 0.8))
                .iterations
                < 150
            )
        assert counts[1] < 0.7 * counts[0]


def test_given_forces_are_the_right_hand_side_of_the_normal_problem() -> None:
    """Seed 000 eqs. 6, 40, 42: with the tangential reactions of the answer as C_T, its normal ones
    are the solution."""
    for d in (2, 3):
        G, q, bilateral = small(7, 8, d)
        r = GivenForces().prepare(G, bilateral).solve(q, np.zeros(8), np.full(8, 0.4)).r
        given = np.column_stack([np.zeros(8), r[:, 1:]]).ravel()
        normal = ActiveSet().prepare(G[::d, ::d], bilateral).solve((q.ravel() + G @ given)[::d])
        size = G[::d, ::d].diagonal() ** 0.5
        assert np.abs((normal.r - r[:, 0]) * size).max() <= 1e-9 * np.abs(r[:, 0] * size).max()


def test_mirror_image() -> None:
    """Turning every tangent around turns every tangential reaction around."""
    G, q, bilateral = small(31, 7, 2)
    turn = np.tile([1.0, -1.0], 7)
    mu = np.full(7, 0.4)
    one = FrictionNewton().prepare(G, bilateral).solve(q, np.zeros(7), mu)
    other = (
        FrictionNewton()
        .prepare(turn[:, None] * G * turn, bilateral)
        .solve(q * [1.0, -1.0], np.zeros(7), mu)
    )
    assert np.allclose(other.r, one.r * [1.0, -1.0], rtol=0.0, atol=1e-13 * np.abs(one.r).max())


def test_units_do_not_matter() -> None:
    """Metres or millimetres, newtons or meganewtons: the same iterations, the same answer to
    round-off."""
    G, q, bilateral = small(40, 6, 3)
    mu, none = np.full(6, 0.3), np.zeros(6)
    for method in METHODS:
        one = method.prepare(G, bilateral).solve(q, none, mu)
        other = method.prepare(1e9 * G, bilateral).solve(1e3 * q, none, mu)
        assert abs(other.iterations - one.iterations) <= 1
        np.testing.assert_allclose(1e6 * other.r, one.r, rtol=0.0, atol=1e-9 * np.abs(one.r).max())


def test_failures_are_told() -> None:
    G, q, bilateral = small(2, 8, 2)
    with pytest.raises(StepFailure, match="NSGS.*stopped after 1 iterations with residual"):
        NSGS(max_iterations=1).prepare(G, bilateral).solve(q, np.zeros(8), np.full(8, 0.3))
    with pytest.raises(InputError, match="node by node"):
        NSGS().prepare(G[:-1, :-1], bilateral)
    with pytest.raises(InputError, match="not symmetric"):
        NSGS().prepare(G + np.triu(G), bilateral)
    q[3, 1] = np.nan
    with pytest.raises(InputError, match="slip without reactions contains NaN"):
        NSGS().prepare(G, bilateral).solve(q, np.zeros(8), np.full(8, 0.3))
