"""The primal-dual active set: warm starts, memory of the last factor, and problems on which the
plain method cycles."""

from __future__ import annotations

import numpy as np
import pytest
from reference_lcp import KINDS, LCP, degenerate, enumerate_lcp, generic, problems, solve, spd

from vi_contact.core.errors import InputError, StepFailure
from vi_contact.solvers.normal import active_set
from vi_contact.solvers.normal.active_set import ActiveSet

pytestmark = pytest.mark.serial


@pytest.fixture(params=["compiled", "numpy"], autouse=True)
def route(request, monkeypatch):
    """Solve by compiled exchanges, where there is a compiler, and without."""
    if request.param == "numpy":
        monkeypatch.setattr(active_set, "load_loops", lambda comm: None)
    return request.param


def full_exchange(
    G: np.ndarray, q: np.ndarray, active: np.ndarray, steps: int
) -> list[tuple[bool, ...]]:
    """The plain method, as in the papers: the sets it visits until it stops."""
    sets = [tuple(active.tolist())]
    for _ in range(steps):
        r = np.zeros(q.size)
        r[active] = -np.linalg.solve(G[np.ix_(active, active)], q[active])
        active = np.where(active, r > 0.0, q + G @ r < 0.0)
        if tuple(active.tolist()) == sets[-1]:
            break
        sets.append(tuple(active.tolist()))
    return sets


CYCLING = np.array([[4.0, 5.0, -5.0], [5.0, 9.0, -5.0], [-5.0, -5.0, 7.0]])


@pytest.mark.parametrize("q", [(2.0, 1.0, -3.0), (-2.0, -1.0, 3.0), (2.0, 0.0, -3.0)])
def test_a_cycle_of_the_plain_method_is_broken(q):
    """SPD, m = 3 (the least order with cycles; Ben Gharbia and Gilbert 2012 have unsymmetric
    P-matrices)."""
    q = np.array(q)
    assert np.linalg.eigvalsh(CYCLING)[0] > 0.03
    visited = full_exchange(CYCLING, q, q < 0.0, 30)
    assert len(visited) == 31 and len(set(visited)) <= 3  # it goes round for ever
    unilateral = np.zeros(3, dtype=bool)
    exact = enumerate_lcp(CYCLING, q, unilateral)
    for bits in range(8):
        guess = np.array([bool(bits & 1), bool(bits & 2), bool(bits & 4)])
        result = solve(ActiveSet(), LCP(CYCLING, q, unilateral), guess=guess)
        assert result.r == pytest.approx(exact, abs=1e-12)
        assert result.iterations <= 4 + 3  # once round the cycle, then about a row at a time


def test_many_cycling_blocks_at_once():
    """Ten cycling problems side by side, weakly coupled; the fallback needs fewer changes than
    there are rows."""
    rng = np.random.default_rng(4)
    G = np.kron(np.eye(10), CYCLING) + 1e-4 * spd(rng, 30)
    q = np.tile([2.0, 1.0, -3.0], 10)
    assert len(set(full_exchange(G, q, q < 0.0, 200))) < 20
    result = solve(ActiveSet(), LCP(G, q, np.zeros(30, dtype=bool)))
    assert result.residual <= 1e-13
    assert 3 <= result.iterations <= 30


def test_a_worst_case_of_pivoting_is_harmless():
    """Fathi (Math. Program. 17, 1979): G = L Lᵀ with ones on and twos below the diagonal, q = -1:
    2^m pivots for Lemke and Murty; r = (1, 0, …, 0)."""
    for m in (8, 16, 24):
        L = np.eye(m) + 2.0 * np.tril(np.ones((m, m)), -1)
        result = solve(ActiveSet(), LCP(L @ L.T, -np.ones(m), np.zeros(m, dtype=bool)))
        exact = np.eye(m)[0]
        assert np.abs(result.r - exact).max() <= 1e-12
        assert result.iterations <= m


def test_an_ill_conditioned_problem_does_not_wander():
    """Condition 1e10, m = 60: full exchange by itself goes through hundreds of sets without a cycle
    (761 in one of these); with patience, at most twice as many changes as rows."""
    for seed in range(6):
        rng = np.random.default_rng(seed)
        Q = np.linalg.qr(rng.normal(size=(60, 60)))[0]
        G = (Q * np.logspace(0.0, -10.0, 60)) @ Q.T
        for bilateral in (np.zeros(60, dtype=bool), np.arange(60) < 6):
            problem = LCP(0.5 * (G + G.T), rng.normal(size=60), bilateral)
            result = solve(ActiveSet(), problem)
            assert result.iterations <= 120
            assert problem.residual(result.r) <= 1e-9


@pytest.mark.parametrize("kind", range(len(KINDS)), ids=[kind.__name__ for kind in KINDS])
def test_a_warm_start_at_the_solution_costs_no_iteration(kind):
    for problem in problems(kind):
        cold = solve(ActiveSet(), problem)
        for guess in (cold.active, cold.r):
            warm = solve(ActiveSet(), problem, guess=guess)
            assert warm.iterations == 0 and warm.history == ()
            assert np.abs(warm.r - cold.r).max() <= 1e-13 * np.abs(cold.r).max()


def test_iterations_count_changes_of_the_set_and_history_the_rows():
    """G = I: the rows with q < 0 are active, so that a guess off by two rows is mended in one
    change."""
    problem = LCP(np.eye(4), np.array([-1.0, -2.0, 3.0, 4.0]), np.zeros(4, dtype=bool))
    result = solve(ActiveSet(), problem, guess=np.array([True, False, True, False]))
    assert result.iterations == 1 and result.history == (2.0,)
    assert result.r.tolist() == [1.0, 2.0, 0.0, 0.0]


def test_the_same_set_is_not_factored_twice(monkeypatch):
    """Prepared once, marching with an unchanged set: triangular solves only."""
    monkeypatch.setattr(active_set, "load_loops", lambda comm: None)
    calls, original = [], active_set.factorise
    monkeypatch.setattr(active_set, "factorise", lambda G: calls.append(G.shape[0]) or original(G))
    rng = np.random.default_rng(9)
    problem = generic(rng, 12)
    prepared = ActiveSet().prepare(problem.G, problem.bilateral)
    first = prepared.solve(problem.q)
    count = len(calls)
    for factor in (1.0, 1.5, 3.0):
        again = prepared.solve(factor * problem.q, first.active)
        assert np.abs(again.r - factor * first.r).max() <= 1e-13 * np.abs(again.r).max()
    assert len(calls) == count
    prepared.solve(-problem.q)
    assert len(calls) > count


def test_grazing_rows_do_not_flip_for_ever():
    """r = w = 0 to rounding in two rows of five: still solved by full exchange, in few changes."""
    rng = np.random.default_rng(10)
    for _ in range(50):
        assert solve(ActiveSet(), degenerate(rng, 12)).iterations <= 6


def test_an_ill_conditioned_answer_is_certified():
    """Hilbert matrix, condition 1.5e10: the residual stays at rounding level although r itself has
    six digits."""
    G = 1.0 / (1.0 + np.add.outer(np.arange(8.0), np.arange(8.0)))
    r = np.ones(8)
    result = solve(ActiveSet(), LCP(G, -G @ r, np.zeros(8, dtype=bool)))
    assert result.residual <= 1e-14
    assert np.abs(result.r - r).max() <= 1e-5


def test_failure_tells_what_happened_and_what_to_do():
    problem = LCP(CYCLING, np.array([2.0, 1.0, -3.0]), np.zeros(3, dtype=bool))
    with pytest.raises(
        StepFailure, match=r"ActiveSet.*after 2 iterations with residual .*raise max_iterations"
    ):
        solve(ActiveSet(max_iterations=2), problem)
    with pytest.raises(StepFailure, match="after 3 iterations"):  # in the fallback
        solve(ActiveSet(max_iterations=3), problem)
    G = 1.0 / (1.0 + np.add.outer(np.arange(8.0), np.arange(8.0)))
    with pytest.raises(StepFailure, match="ill-conditioned"):
        solve(
            ActiveSet(tolerance=1e-18), LCP(G, -np.linspace(1.0, 2.0, 8), np.zeros(8, dtype=bool))
        )


@pytest.mark.parametrize("kind", KINDS)
def test_several_problems_at_once_have_the_answers_of_each(kind, route):
    """From right and wrong guesses, after other problems, and with one among them that is
    refused."""
    rng = np.random.default_rng(12)
    made = kind(rng, 9)
    prepared, alone = (ActiveSet().prepare(made.G, made.bilateral) for _ in range(2))
    for _ in range(3):
        q = made.q + np.where(np.isfinite(made.q), rng.normal(size=(6, len(made.q))), 0.0)
        guess = rng.random(q.shape) < 0.5
        q[4, 0] = np.nan
        r, active, counts, failed = prepared.solve_many(q, guess)
        assert list(failed) == [4] and isinstance(failed[4], InputError)
        for row in (0, 1, 2, 3, 5):
            one = alone.solve(q[row], guess[row])
            assert (counts[row], active[row].tolist()) == (one.iterations, one.active.tolist())
            assert np.abs(r[row] - one.r).max() <= 1e-12 * np.abs(one.r).max()


def test_both_routes_make_the_same_exchanges(monkeypatch):
    """The history, the answer to round-off, and reactions that are not negative."""
    rng = np.random.default_rng(13)
    easy, hard = [generic(rng, m) for m in (1, 3, 8, 30)], degenerate(rng, 12)
    for problem in [*easy, hard]:
        monkeypatch.undo()
        compiled = ActiveSet().prepare(problem.G, problem.bilateral).solve(problem.q)
        monkeypatch.setattr(active_set, "load_loops", lambda comm: None)
        other = ActiveSet().prepare(problem.G, problem.bilateral).solve(problem.q)
        assert compiled.history == other.history and compiled.iterations == other.iterations
        assert np.abs(compiled.r - other.r).max() <= 1e-13 * np.abs(other.r).max()
        gap = problem.G @ compiled.r + problem.q
        # not where both are round-off
        sure = np.maximum(compiled.r, gap) > 1e-12 * np.abs(compiled.r).max()
        assert compiled.r.min() >= 0.0 and np.array_equal(compiled.active[sure], other.active[sure])
        assert sure.all() or problem is hard
