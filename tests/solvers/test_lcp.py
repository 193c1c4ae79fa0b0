"""The residual of a complementarity problem: what it measures, and that units do not matter."""

from __future__ import annotations

import numpy as np
import pytest
from reference_lcp import LCP, spd
from scipy.sparse import csr_matrix

from vi_contact.core.errors import InputError
from vi_contact.solvers.friction.problem import ScaledDelassus
from vi_contact.solvers.normal.lcp import compute_scale, scale_dense

pytestmark = pytest.mark.serial

UNILATERAL = np.zeros(2, dtype=bool)
ONE_BILATERAL = np.array([False, True])


def test_w_is_the_gap_left_by_the_reactions():
    problem = LCP(np.array([[2.0, 1.0], [1.0, 3.0]]), np.array([-1.0, np.inf]), UNILATERAL)
    assert problem.w(np.array([0.5, 0.0])).tolist() == [0.0, np.inf]


def test_residual_of_zero_reaction_is_one():
    """By definition of the unit: the violation of r = 0."""
    G = np.array([[4.0, 1.0], [1.0, 9.0]])
    assert LCP(G, np.array([-1e-5, 3e-5]), UNILATERAL).residual(np.zeros(2)) == pytest.approx(
        1.0, rel=1e-15
    )
    assert LCP(G, np.array([1.0, 3e-5]), ONE_BILATERAL).residual(np.zeros(2)) == pytest.approx(
        1.0, rel=1e-15
    )


def test_residual_counts_penetration_tension_and_pressure_across_a_gap():
    """G = 1, q = (-1, 1): solution (1, 0). One row off at a time, by 0.25."""
    problem = LCP(np.eye(2), np.array([-1.0, 1.0]), UNILATERAL)
    assert problem.residual(np.array([1.0, 0.0])) == 0.0
    assert problem.residual(np.array([0.75, 0.0])) == 0.25  # penetration w = -0.25
    assert problem.residual(np.array([1.25, 0.0])) == 0.25  # pressure across a gap of 0.25
    assert problem.residual(np.array([1.0, -0.25])) == 0.25  # tension
    assert problem.residual(np.array([1.0, 0.25])) == 0.25  # pressure across a gap of 1.25


def test_residual_of_a_bilateral_row_is_its_gap_of_either_sign():
    problem = LCP(np.eye(2), np.array([-1.0, 1.0]), ONE_BILATERAL)
    assert problem.residual(np.array([1.0, -1.0])) == 0.0
    assert problem.residual(np.array([1.0, -0.5])) == 0.5
    assert problem.residual(np.array([1.0, -1.5])) == 0.5


def test_residual_is_the_same_in_all_units():
    rng = np.random.default_rng(1)
    G, q, r = spd(rng, 6), rng.normal(size=6), rng.random(6)
    bilateral, units = rng.random(6) < 0.3, 10.0 ** rng.uniform(-6.0, 6.0, size=6)
    base = LCP(G, q, bilateral).residual(r)
    assert LCP(G * 3e-9, q * 1e3, bilateral).residual(r * (1e3 / 3e-9)) == pytest.approx(
        base, rel=1e-13
    )
    other = LCP(units[:, None] * G * units, q * units, bilateral)
    assert other.residual(r / units) == pytest.approx(base, rel=1e-12)


def test_residual_without_violation_is_still_finite():
    """q >= 0: r = 0 is exact; anything else is measured by q, and by r itself when q = 0."""
    for q in (np.array([2.0, 4.0]), np.array([0.0, np.inf]), np.zeros(2)):
        assert LCP(np.eye(2), q, UNILATERAL).residual(np.zeros(2)) == 0.0
    assert LCP(np.eye(2), np.array([2.0, 4.0]), UNILATERAL).residual(np.array([1.0, 0.0])) == 0.25
    assert LCP(np.eye(2), np.zeros(2), UNILATERAL).residual(np.array([1e-9, 0.0])) == 1.0


def test_a_problem_checks_its_numbers_when_it_is_made():
    with pytest.raises(InputError, match="square"):
        LCP(np.ones((2, 3)), np.ones(2), UNILATERAL)
    with pytest.raises(InputError, match="'bilateral' is no mask: give booleans"):
        LCP(np.eye(2), np.ones(2), np.array([0, 1]))  # type: ignore[arg-type]
    with pytest.raises(InputError, match="NaN"):
        LCP(np.eye(2), np.array([np.nan, 0.0]), UNILATERAL)


def test_dense_scaling_has_unit_diagonal_and_refuses_unsymmetric_matrices():
    G = np.array([[4.0, 1.0], [1.0, 9.0]])
    scaled = scale_dense(G, UNILATERAL)
    assert scaled.matrix == pytest.approx(np.array([[1.0, 1.0 / 6.0], [1.0 / 6.0, 1.0]]), rel=1e-15)
    assert compute_scale(G) == pytest.approx(np.array([0.5, 1.0 / 3.0]), rel=1e-15)
    with pytest.raises(InputError, match="not symmetric"):
        scale_dense(np.array([[4.0, 1.0], [1.1, 9.0]]), UNILATERAL)
    with pytest.raises(InputError, match="NaN"):
        scale_dense(np.array([[4.0, np.nan], [np.nan, 9.0]]), UNILATERAL)
    with pytest.raises(InputError, match="as an array"):
        scale_dense(csr_matrix(G), UNILATERAL)  # type: ignore[arg-type]


def test_scales_do_not_depend_on_where_numbers_lie_in_memory():
    """numpy may take another way for numbers with gaps, with another last digit, where the answer
    lies next to them: before it was mended, 2 % of these answers differed."""
    G = np.diag(10.0 ** np.random.default_rng(0).uniform(-2.0, 2.0, 9))
    bilateral = np.zeros(3, dtype=bool)
    expected = compute_scale(G)
    # pairs of places, a matrix and its scales, one after the other in memory; every third is freed
    pairs = [(G.copy(), np.empty(9)) for _ in range(3000)]
    del pairs[::3]
    for _ in range(900):
        copy = G.copy()
        scales = compute_scale(copy)
        assert np.array_equal(scales, expected)
        pairs.append((copy, scales))
    bilateral = np.zeros(3, dtype=bool)
    both = {ScaledDelassus(G.copy(), bilateral).scale.tobytes() for _ in range(200)}
    assert len(both) == 1
