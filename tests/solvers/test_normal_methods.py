"""All methods for small complementarity problems against brute force and against each other."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pytest
from reference_lcp import (
    KINDS,
    LCP,
    enumerate_lcp,
    from_solution,
    generic,
    mixed,
    problems,
    solve,
    spd,
)

from vi_contact.core.errors import InputError
from vi_contact.solvers.normal.active_set import ActiveSet
from vi_contact.solvers.normal.hildreth import Hildreth

pytestmark = pytest.mark.serial

METHODS = (ActiveSet(), Hildreth(), Hildreth(primal=False))
each_method = pytest.mark.parametrize(
    "method", METHODS, ids=("ActiveSet", "primal Hildreth", "dual Hildreth")
)


@lru_cache
def truths(kind: int) -> list[tuple[LCP, np.ndarray]]:
    return [
        (problem, enumerate_lcp(problem.G, problem.q, problem.bilateral))
        for problem in problems(kind)
    ]


@each_method
@pytest.mark.parametrize("kind", range(len(KINDS)), ids=[kind.__name__ for kind in KINDS])
def test_200_random_problems_match_enumeration(method, kind):
    for problem, exact in truths(kind):
        result = solve(method, problem, guess=None)
        d = np.diag(problem.G) ** -0.5
        unit = np.abs(exact / d).max()
        assert np.abs((result.r - exact) / d).max() <= 1e-9 * unit
        assert (result.r[~problem.bilateral] >= 0.0).all()
        assert result.active[(exact / d > 1e-6 * unit) | problem.bilateral].all()
        assert not result.active[~problem.bilateral & (problem.w(exact) * d > 1e-6 * unit)].any()
        assert result.residual <= 1e-10
        assert problem.residual(result.r) == pytest.approx(result.residual, abs=1e-11)


def test_enumeration_finds_a_constructed_solution():
    """The reference itself: q = w - G r gives back r, grazing rows and rows out of reach
    included."""
    rng = np.random.default_rng(3)
    G, r = spd(rng, 5), np.array([2.0, 0.0, 0.0, 1.0, -3.0])
    q = np.array([0.0, 0.0, 0.7, 0.0, 0.0]) - G @ r
    q_far = np.where(np.arange(5) == 2, np.inf, q)
    bilateral = np.arange(5) == 4
    assert enumerate_lcp(G, q, bilateral) == pytest.approx(r, abs=1e-13)
    assert enumerate_lcp(G, q_far, bilateral) == pytest.approx(r, abs=1e-13)


@each_method
def test_one_contact_is_solved_by_hand(method):
    """G = 2 m/N, q = -6 m: r = 3 N closes the gap."""
    result = solve(method, LCP(np.array([[2.0]]), np.array([-6.0]), np.array([False])), guess=None)
    assert result.r[0] == pytest.approx(3.0, rel=1e-13)
    assert result.active.tolist() == [True] and result.active.dtype == bool
    assert result.method is method


@each_method
def test_units_do_not_change_the_answer(method):
    """G s and q t: r t / s, the same set and residual level, for any units of force and length."""
    rng = np.random.default_rng(11)
    for _ in range(5):
        problem = mixed(rng, 10)
        base = solve(method, problem, guess=None)
        for s, t in ((3e-11, 7e9), (7e10, 3e-8), (1.3, 1e-12)):
            other = solve(method, LCP(problem.G * s, problem.q * t, problem.bilateral), guess=None)
            assert np.abs(other.r * (s / t) - base.r).max() <= 1e-12 * np.abs(base.r).max()
            assert (other.active == base.active)[base.r > 1e-9 * base.r.max()].all()


@each_method
def test_a_row_in_another_unit_does_not_change_the_answer(method):
    """Translations [m] and rotations [rad] together: row i of (1) times c_i > 0 gives r_i / c_i."""
    rng = np.random.default_rng(12)
    problem, units = generic(rng, 9), 10.0 ** rng.uniform(-5.0, 5.0, size=9)
    base = solve(method, problem, guess=None)
    other = solve(
        method,
        LCP(units[:, None] * problem.G * units, problem.q * units, problem.bilateral),
        guess=None,
    )
    assert np.abs(other.r * units - base.r).max() <= 1e-11 * base.r.max()


@each_method
def test_a_wide_gap_elsewhere_does_not_spoil_a_narrow_contact(method):
    """Penetration 1e-6 m in one row, 1 km of air at another: twelve digits of r all the same."""
    G = np.array([[2.0, 1.0], [1.0, 3.0]]) * 1e-9
    result = solve(method, LCP(G, np.array([-1e-6, 1e3]), np.zeros(2, dtype=bool)), guess=None)
    assert result.r[0] == pytest.approx(500.0, rel=1e-12) and result.r[1] == 0.0


@each_method
def test_nothing_to_do_gives_zero_without_work(method):
    for q in (np.zeros(3), np.array([1.0, 0.0, np.inf]), np.full(3, np.inf)):
        result = solve(method, LCP(np.eye(3), q, np.zeros(3, dtype=bool)), guess=None)
        assert not result.r.any() and not result.active.any()
        assert result.iterations == 0 and result.residual == 0.0


@each_method
def test_an_empty_contact_surface_is_allowed(method):
    result = solve(method, LCP(np.zeros((0, 0)), np.zeros(0), np.zeros(0, dtype=bool)), guess=None)
    assert result.r.shape == (0,) and result.residual == 0.0


@each_method
def test_all_rows_bilateral_is_a_linear_system(method):
    rng = np.random.default_rng(5)
    G, q = spd(rng, 8), rng.normal(size=8)
    result = solve(method, LCP(G, q, np.ones(8, dtype=bool)), guess=None)
    assert np.abs(result.r + np.linalg.solve(G, q)).max() <= 1e-11 * np.abs(result.r).max()
    assert result.active.all()


@each_method
@pytest.mark.parametrize("kind", ["set", "reactions"])
def test_a_guess_changes_the_work_and_not_the_answer(method, kind):
    rng = np.random.default_rng(6)
    for _ in range(10):
        problem = mixed(rng, 12)
        cold = solve(method, problem, guess=None)
        warm = solve(method, problem, guess=cold.active if kind == "set" else cold.r)
        bad = solve(method, problem, guess=~cold.active if kind == "set" else rng.normal(size=12))
        assert np.abs(warm.r - cold.r).max() <= 1e-11 * np.abs(cold.r).max()
        assert np.abs(bad.r - cold.r).max() <= 1e-11 * np.abs(cold.r).max()
        if kind == "reactions":
            assert warm.iterations <= min(cold.iterations, 3)


@each_method
def test_prepared_once_solves_many_right_hand_sides(method):
    rng = np.random.default_rng(8)
    first = from_solution(rng, 10, contact=0.5, grazing=0.0)
    prepared, guess = method.prepare(first.G, first.bilateral), None
    for _ in range(20):
        q = rng.normal(size=10)
        result = prepared.solve(q, guess)
        exact = enumerate_lcp(first.G, q, first.bilateral)
        assert np.abs(result.r - exact).max() <= 1e-10 * np.abs(exact).max(initial=1e-300)
        guess = result.r


@each_method
def test_a_prepared_method_keeps_its_own_copy(method):
    """The caller may reuse the memory of G for the next time step size."""
    G, bilateral = np.array([[2.0, 1.0], [1.0, 2.0]]), np.zeros(2, dtype=bool)
    prepared = method.prepare(G, bilateral)
    G[:], bilateral[:] = np.nan, True
    assert prepared.solve(np.array([-1.0, 0.8])).r.tolist() == pytest.approx([0.5, 0.0], rel=1e-12)


@each_method
def test_wrong_input_is_refused_with_a_reason(method):
    G, q, unilateral = np.eye(2), -np.ones(2), np.zeros(2, dtype=bool)
    for matrix, gap, words in (
        (np.ones((2, 3)), q, "square"),
        (np.eye(3), q, "booleans for the 3 rows"),
        (np.diag([1.0, 0.0]), q, "row 1 cannot move"),
        (G, np.ones(3), "q has shape"),
        (G, np.array([np.nan, 1.0]), "q contains NaN"),
        (G, np.array([-np.inf, 1.0]), "q contains NaN"),
        (np.array([[2.0, 1.0], [1.1, 2.0]]), q, "not symmetric"),
        (np.full((2, 2), np.nan), q, "NaN or infinity"),
    ):
        with pytest.raises(InputError, match=words):
            method.prepare(matrix, unilateral).solve(gap)
    with pytest.raises(InputError, match="not positive definite"):
        saddle = np.array([[1.0, 2.0], [2.0, 1.0]])
        method.prepare(saddle, ~unilateral).solve(np.array([-1.0, 1.0]))
    with pytest.raises(InputError, match="bilateral row"):
        method.prepare(G, ~unilateral).solve(np.array([np.inf, 1.0]))
    with pytest.raises(InputError, match="guess has shape"):
        method.prepare(G, unilateral).solve(q, np.ones(3))
