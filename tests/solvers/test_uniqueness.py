"""Which matrices are P-matrices: all minors by determinants, and what is told where they are too
many."""

from __future__ import annotations

import numpy as np
import pytest
from reference_lcp import minors

from vi_contact.core.errors import InputError
from vi_contact.solvers.normal import p_matrix

pytestmark = pytest.mark.serial


def test_p_matrices_by_their_minors():
    """200 random matrices of up to 6 rows against all minors by determinants; large ones by the
    symmetric part or not at all."""
    rng, seen = np.random.default_rng(2), set()
    for k in range(200):
        m = 1 + k % 6
        G = rng.normal(size=(m, m)) + rng.uniform(0.0, 2.5) * np.eye(m)
        found = p_matrix(G)
        assert found.holds == (minors(G) > 0.0), G
        seen.add(found.sentence)
    assert len(seen) == 3
    big = np.eye(30) + 3.0 * np.triu(np.ones((30, 30)), 1)
    assert p_matrix(big).holds is None and "30 rows are too many" in p_matrix(big).sentence
    assert (
        p_matrix(big[:12, :12]).holds
        and "all its principal minors" in p_matrix(big[:12, :12]).sentence
    )
    assert p_matrix(big + 90.0 * np.eye(30)).holds


def test_a_minor_that_rounding_hides_decides_nothing():
    """All minors of triangular matrices with ones are 1, however large the rest is; one that is
    zero to rounding is neither positive nor not, unless another is negative."""
    huge = np.eye(3) + 1e16 * np.triu(np.ones((3, 3)), 1)
    assert p_matrix(huge).holds and p_matrix(huge.T).holds and p_matrix(huge[:2, :2]).holds
    for zero in (
        np.ones((2, 2)),
        np.array([[1.0, 3.0], [1.0 / 3.0, 1.0]]),
        np.array([[0.3, 3.0], [0.07, 0.7]]),
    ):
        assert p_matrix(zero).holds is None and "zero to rounding" in p_matrix(zero).sentence
        worse = np.block(
            [[zero, np.zeros((2, 2))], [np.zeros((2, 2)), np.array([[1.0, 2.0], [2.0, 1.0]])]]
        )
        assert p_matrix(worse).holds is False


def test_units_and_wrong_numbers():
    """Rows in units of their own change nothing; NaN is refused; no rows have one solution."""
    for seed in range(20):
        rng = np.random.default_rng(seed)
        G, units = rng.normal(size=(4, 4)) + np.eye(4), 10.0 ** rng.uniform(-6.0, 6.0, size=4)
        assert p_matrix(units[:, None] * G * units) == p_matrix(G)
    assert p_matrix(np.zeros((0, 0))).holds
    assert p_matrix([[1.0, 5.0], [0.0, 1.0]]).holds  # type: ignore[arg-type]
    for wrong, words in (
        (np.full((2, 2), np.nan), "finite numbers"),
        (np.ones(3), "has shape"),
        (np.ones((2, 3)), "give a square"),
        ([[1.0], [1.0, 2.0]], "real numbers"),
        ("G", "is 'G'"),
    ):
        with pytest.raises(InputError, match=words):
            p_matrix(wrong)  # type: ignore[arg-type]
