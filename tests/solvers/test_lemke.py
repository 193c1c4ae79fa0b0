"""Lemke's method against enumeration of all sets, classical examples, ties, units; friction without
symmetry."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
from reference_lcp import KINDS, LCP, enumerate_lcp, minors, problems, solutions, solve

from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError, StepFailure
from vi_contact.core.matrix_checks import probe
from vi_contact.solvers.friction import FrictionNewton
from vi_contact.solvers.normal import ActiveSet, Lemke, p_matrix

pytestmark = pytest.mark.serial


def lemke(G: Array, q: Array, **more: int) -> Array:
    result = solve(Lemke(**more), LCP(G, q, np.zeros(len(q), dtype=bool)))
    assert result.residual <= 1e-13 and len(result.history) == result.iterations
    return result.r


def random_p_matrices(count: int, m: int) -> list[Array]:
    """P-matrices, most of them without positive definite symmetric part, with rows in units of
    their own."""
    rng, found = np.random.default_rng(7), []
    while len(found) < count:
        G = rng.normal(size=(m, m)) + 1.2 * np.eye(m)
        if minors(G) > 0.02 and np.linalg.eigvalsh(G + G.T)[0] < 0.0:
            found.append(G)
    return found


@pytest.mark.long
def test_p_matrices_have_the_solution_that_enumeration_finds():
    """30 P-matrices of 5 rows that are far from symmetric, 5 loads each: one solution, and this
    one."""
    rng = np.random.default_rng(8)
    for G in random_p_matrices(30, 5):
        assert p_matrix(G).holds
        for q in rng.normal(size=(5, 5)):
            exact = solutions(G, q)
            assert len(exact) == 1
            assert lemke(G, q) == pytest.approx(
                exact[0], abs=1e-11 * (1.0 + np.abs(exact[0]).max())
            )


@pytest.mark.parametrize("index", range(len(KINDS)), ids=[kind.__name__ for kind in KINDS])
def test_symmetric_problems_have_the_answer_of_the_active_set(index):
    """SPD, bilateral rows, rows out of reach, grazing rows, rows in units from 1e-6 to 1e6; and by
    enumeration."""
    for problem in problems(index):
        found, other = solve(Lemke(), problem), solve(ActiveSet(), problem)
        d = np.diag(problem.G) ** -0.5
        size = np.abs(other.r / d).max() or 1.0
        assert np.abs((found.r - other.r) / d).max() <= 1e-12 * size * np.linalg.cond(
            problem.G * np.outer(d, d)
        )
        assert problem.residual(found.r) <= 1e-13
        if problem.q.size <= 6:
            assert found.r / d == pytest.approx(
                enumerate_lcp(problem.G, problem.q, problem.bilateral) / d,
                rel=1e-9,
                abs=1e-11 * size,
            )


def test_a_guess_costs_no_pivot_and_a_wrong_one_no_digit():
    """The set and the reactions of the answer as guesses; the opposite set."""
    problem = problems(0)[11]
    cold = solve(Lemke(), problem)
    assert (
        cold.iterations > 0
        and all(0.0 <= z <= 1.0 + 1e-12 for z in cold.history)
        and cold.history[-1] == 0.0
    )
    for guess in (cold.active, cold.r):
        assert solve(Lemke(), problem, guess=guess).iterations == 0
    other = solve(Lemke(), problem, guess=~cold.active)
    assert other.iterations == cold.iterations and (other.r == cold.r).all()


def test_lists_are_told_of_or_read():
    """A matrix or a mask that is a list is refused with the remedy; q and a guess may be lists."""
    G, nothing = np.array([[2.0, 1.0], [0.0, 2.0]]), np.zeros(2, dtype=bool)
    with pytest.raises(InputError, match="needs the Delassus operator as an array"):
        Lemke().prepare(G.tolist(), nothing)
    with pytest.raises(InputError, match="'bilateral' is no mask: give booleans"):
        Lemke().prepare(G, nothing.tolist())
    prepared = Lemke().prepare(G, nothing)
    result = prepared.solve([-2.0, -1.0])
    assert (G @ result.r == [2.0, 1.0]).all() and prepared.solve(
        [-2.0, -1.0], [True, True]
    ).iterations == 0


@pytest.mark.parametrize(
    ("G", "q", "count"),
    [
        # several: Cottle, Pang and Stone, positive but not a P-matrix
        ([[1.0, 2.0], [2.0, 1.0]], [-1.0, -1.0], 3),
        ([[0.0, 1.0], [1.0, 0.0]], [-1.0, -1.0], 1),  # no diagonal: a game
        # skew: copositive-plus, and without a solution
        ([[0.0, -1.0], [1.0, 0.0]], [-1.0, -1.0], 0),
        ([[-1.0]], [-1.0], 0),  # a ray at once
        ([[0.0, -10.0], [20.0, 0.0]], [1.0, -1.0], 1),
    ],
    ids=["three solutions", "no diagonal", "no solution", "negative", "skew"],
)
def test_other_matrices_have_a_solution_several_or_none(G, q, count):
    """Where there is none the method says so; it says what p_matrix says too."""
    G, q = np.array(G), np.array(q)
    exact = solutions(G, q)
    assert len(exact) == count and p_matrix(G).holds is False
    if exact:
        assert any(lemke(G, q) == pytest.approx(one, abs=1e-12) for one in exact)
    else:
        with pytest.raises(
            StepFailure, match=r"on a ray after \d pivots: there is no solution, or G is not"
        ):
            lemke(G, q)


def test_a_ray_need_not_mean_that_there_is_no_solution():
    """Not copositive-plus: r = (1, 0) solves it (Cottle, Pang and Stone, section 4.4, in kind); the
    guess finds it."""
    rng, missed = np.random.default_rng(3), 0
    for _ in range(300):
        G, q = rng.normal(size=(3, 3)), rng.normal(size=3)
        exact = solutions(G, q)
        try:
            found = lemke(G, q)
        except StepFailure as failure:
            assert "ray" in str(failure)
            missed += bool(exact)
            continue
        assert (
            any(np.allclose(found, one, atol=1e-9) for one in exact)
            or (q + G @ found).min() > -1e-12
        )
    assert 0 < missed < 40


def test_murty_needs_all_pivots():
    """Murty (1978): ones on, twos below the diagonal, q = -d parallel to the covering vector, both
    in its units: r = d (1, 0, ..., 0) after 2^m pivots; fewer allowed are too few in words. For q =
    -1 two are enough."""
    for m in (3, 6, 9):
        G, d, none = (
            np.eye(m) + 2.0 * np.tril(np.ones((m, m)), -1),
            1.5 + probe(np.arange(m), 0),
            np.zeros(m, bool),
        )
        found = solve(Lemke(), LCP(G * d[:, None] / d, -d, none), guess=none)
        assert found.iterations == 2**m and found.r == pytest.approx(d * np.eye(m)[0], abs=1e-12)
        found = solve(Lemke(), LCP(G, -np.ones(m), none), guess=none)
        assert found.iterations == 2 and found.r == pytest.approx(np.eye(m)[0], abs=1e-12)
    with pytest.raises(StepFailure, match="stopped after 100 iterations .* raise max_iterations"):
        lemke(G * d[:, None] / d, -d, max_iterations=100)


def test_equal_gaps_cost_no_more_pivots_than_others():
    """A kernel that depends on the distance alone, by 30 % not symmetric, under equal loads: with
    the covering vector 1 all rows are tied, which took 872 pivots on 40 rows and more than 10 000
    on 150."""
    for m in (40, 80):
        x = np.linspace(0.0, 1.0, m)
        G = np.exp(-np.abs(x[:, None] - x)) * (1.0 + 0.3 * np.sign(x[:, None] - x))
        found = solve(Lemke(), LCP(G, -np.ones(m), np.zeros(m, bool)), guess=np.zeros(m, bool))
        assert found.iterations < m and found.residual < 1e-13


def test_a_guess_that_leads_to_huge_reactions_is_not_taken():
    """Three springs in the plane push in three directions: G has rank 2, and all three at once have
    no answer. Rounding of r = 1e16 forgives any residual; the tolerance does not."""
    angles = 0.1 + np.array([0.0, 2.0, 4.0]) * np.pi / 3.0
    G, q = np.cos(angles[:, None] - angles), np.array([-1.0, 0.4, 0.7])
    B = np.column_stack([np.cos(angles), np.sin(angles)])
    for singular in (G, B @ B.T):
        found = solve(Lemke(), LCP(singular, q, np.zeros(3, bool)), guess=np.ones(3, bool))
        assert found.residual < 1e-13 and found.r == pytest.approx(
            [16.0 / 15.0, 2.0 / 15.0, 0.0], rel=1e-12
        )


def test_ties_end():
    """All rows tied at all pivots: the least rule could go round, the lexicographic one ends
    (Kostreva 1979)."""
    G = np.array([[1.0, 2.0, 0.0], [0.0, 1.0, 2.0], [2.0, 0.0, 1.0]])
    q = -np.ones(3)
    assert lemke(G, q) == pytest.approx(np.full(3, 1.0 / 3.0), abs=1e-14)
    rng = np.random.default_rng(5)
    for _ in range(100):
        G = rng.integers(-2, 3, size=(6, 6)) * 1.0
        G = G - G.T + np.eye(6) * rng.integers(1, 3)
        q = rng.integers(-2, 2, size=6) * 1.0
        assert any(lemke(G, q) == pytest.approx(one, abs=1e-10) for one in solutions(G, q))


def test_units_do_not_matter():
    """Every row in a unit of its own: the same pivots and the same answer; twice the same
    digits."""
    G, q = np.eye(8) + 2.0 * np.triu(np.random.default_rng(4).normal(size=(8, 8)), 1), -np.ones(8)
    units = 10.0 ** np.random.default_rng(1).uniform(-5.0, 5.0, size=8)
    method, other = (
        Lemke().prepare(one, np.zeros(8, dtype=bool)) for one in (G, units[:, None] * G * units)
    )
    found, scaled = method.solve(q), other.solve(q * units)
    assert found.iterations == scaled.iterations
    assert scaled.r * units == pytest.approx(found.r, rel=1e-11, abs=1e-13)
    assert (method.solve(q).r == found.r).all()


def test_refused():
    """Bilateral rows that depend on each other; NaN; what the others say of matrices that are not
    symmetric."""
    both = np.ones(2, dtype=bool)
    with pytest.raises(InputError, match="bilateral rows of the Delassus operator depend"):
        Lemke().prepare(np.ones((2, 2)), both)
    with pytest.raises(InputError, match="NaN"):
        Lemke().prepare(np.full((2, 2), np.nan), both)
    with pytest.raises(InputError, match=r"not symmetric: .* the methods Lemke\(\)"):
        ActiveSet().prepare(np.array([[2.0, 1.0], [0.0, 2.0]]), ~both)


def friction_states(G: Array, q: Array, cohesion: float, slope: float) -> list[Array]:
    """All solutions r (m, 2) of the small problem with friction in the plane, by enumeration of the
    4^m states."""
    m, found = len(q), []
    for states in product(("open", "stick", 1.0, -1.0), repeat=m):
        A, b = np.zeros((2 * m, 2 * m)), np.zeros(2 * m)
        for i, state in enumerate(states):
            n, t = 2 * i, 2 * i + 1
            # open, r = 0; under cohesion open points are not tried here
            A[n, n], A[t, t] = (1.0, 1.0)
            if state != "open":
                A[n], b[n] = G[n], -q[i, 0]
            if state == "stick":
                A[t], b[t] = G[t], -q[i, 1]
            elif state != "open":
                A[t, n], b[t] = -state * slope, state * cohesion
        if abs(np.linalg.det(A)) < 1e-10:
            continue
        r = np.linalg.solve(A, b).reshape(m, 2)
        w = q + (G @ r.ravel()).reshape(m, 2)
        fits = all(
            w[i, 0] >= -1e-11
            if state == "open"
            else r[i, 0] >= -1e-11
            and (
                abs(r[i, 1]) <= cohesion + slope * r[i, 0] + 1e-11
                if state == "stick"
                else state * w[i, 1] <= 1e-11
            )
            for i, state in enumerate(states)
        )
        if fits and not any(np.allclose(r, one, atol=1e-9) for one in found):
            found.append(r)
    return found


def test_friction_without_symmetry_by_enumeration():
    """40 problems of 3 points in the plane, G with positive definite symmetric part and up to 40 %
    skew, Coulomb's law: the answer of FrictionNewton is among all solutions, and the only one;
    exactly symmetric G goes the way it went."""
    rng, none, slope = np.random.default_rng(11), np.zeros(3), np.full(3, 0.3)
    for _ in range(40):
        skew, A = np.triu(rng.uniform(-0.4, 0.4, size=(6, 6)), 1), rng.normal(size=(6, 8))
        G = A @ A.T / 8.0 + 0.3 * np.eye(6)
        G += (skew - skew.T) * np.sqrt(np.outer(np.diag(G), np.diag(G)))
        q = rng.normal(size=(3, 2))
        exact = friction_states(G, q, 0.0, 0.3)
        found = FrictionNewton().prepare(G, np.zeros(3, dtype=bool)).solve(q, none, slope)
        assert (
            len(exact) == 1
            and found.r == pytest.approx(exact[0], abs=1e-10)
            and found.residual <= 1e-12
        )


@pytest.mark.long
def test_friction_that_is_not_solved_ends_in_its_sentence():
    """Skew parts far larger than the rest, and nodes whose own blocks are not positive definite: an
    answer, or a sentence; no warning of overflows, no other error. A guess may do no work, or
    negative one."""
    ended = 0
    for seed in (1, 6, 14, 25, 276):
        rng = np.random.default_rng(seed)
        m = int(rng.integers(4, 12))
        A, S = rng.normal(size=(2 * m, 2 * m)), rng.normal(size=(2 * m, 2 * m))
        G = A @ A.T / (2 * m) + 0.05 * np.eye(2 * m) + 1.5 * (S - S.T)
        prepared, q = FrictionNewton().prepare(G, np.zeros(m, bool)), rng.normal(size=(m, 2))
        try:
            with np.errstate(over="raise", divide="raise", invalid="raise"):
                assert prepared.solve(q, np.zeros(m), np.full(m, 0.4)).residual <= 1e-11
        except StepFailure as failure:
            assert "FrictionNewton" in str(failure) and "smaller step of time or load" in str(
                failure
            )
            ended += 1
    assert ended > 0
    # rᵀG r < 0 and = 0
    for G in (np.array([[1.0, -3.0], [-3.0, 1.0]]), np.array([[1.0, -1.0], [-1.0, 1.0]])):
        step = FrictionNewton().prepare(
            np.kron(G, np.eye(2)) + np.eye(4, k=1) * 1e-3, np.zeros(2, bool)
        )
        start = step.delassus.problem(-np.ones((2, 2)), np.zeros(2), np.zeros(2)).start(
            np.ones(2, bool)
        )
        assert not start.any()


def test_friction_in_space_without_symmetry():
    """8 points, skew parts of 30 %, Coulomb and Tresca, some bilateral: the laws by hand."""
    rng = np.random.default_rng(12)
    for k in range(12):
        A, skew = rng.normal(size=(24, 30)), np.triu(rng.uniform(-0.3, 0.3, size=(24, 24)), 1)
        G, held = A @ A.T / 30.0 + 0.2 * np.eye(24) + skew - skew.T, rng.random(8) < 0.2
        q, cohesion, slope = (
            rng.normal(size=(8, 3)),
            np.full(8, 0.2 * (k % 2)),
            np.full(8, 0.3 * ((k + 1) % 2)),
        )
        found = FrictionNewton().prepare(G, held).solve(q, cohesion, slope)
        w, (r_n, r_t) = q + (G @ found.r.ravel()).reshape(8, 3), (found.r[:, 0], found.r[:, 1:])
        limit, size = cohesion + slope * np.maximum(r_n, 0.0), np.linalg.norm(r_t, axis=1)
        assert np.abs(np.where(held, w[:, 0], np.minimum(r_n, w[:, 0]))).max() < 1e-10
        assert (size <= limit + 1e-12).all()
        assert limit * np.linalg.norm(w[:, 1:], axis=1) == pytest.approx(
            -np.sum(r_t * w[:, 1:], axis=1), abs=1e-10
        )
