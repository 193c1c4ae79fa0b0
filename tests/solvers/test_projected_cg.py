"""Projected conjugate gradients: matrix-free problems too large for brute force, against the active-set method."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from reference_lcp import LCP, generic, solve, spd

from vi_contact.core.errors import InputError, StepFailure
from vi_contact.solvers.normal.active_set import ActiveSet
from vi_contact.solvers.normal.projected_cg import ProjectedCG

pytestmark = pytest.mark.serial


class Counted:
    """A matrix one can only apply; counts how often."""

    def __init__(self, G: np.ndarray) -> None:
        self._G, self.shape, self.count = G, G.shape, 0

    def __matmul__(self, x: np.ndarray) -> np.ndarray:
        self.count += 1
        return self._G @ x


def surface(m: int) -> np.ndarray:
    """Compliance of m points on the edge of a half-plane: -log|x - y| and a constant, shifted to be SPD; [m/N]."""
    x = np.linspace(0.0, 1.0, m)
    G = 2.0 - np.log(np.abs(x[:, None] - x) + 0.5 / m)
    low, high = np.linalg.eigvalsh(G)[[0, -1]]
    return (G + max(0.0, 1e-3 * high - low) * np.eye(m)) * 1e-9


@pytest.mark.parametrize("wrap", [np.asarray, sp.csr_matrix, Counted], ids=["array", "sparse", "applied only"])
def test_large_set_agrees_with_the_active_set_method(wrap):
    """A parabolic stamp, m = 200, some rows bilateral and some out of reach; condition 1e3."""
    G, x = surface(200), np.linspace(0.0, 1.0, 200)
    q = np.where(x > 0.9, np.inf, 1e-3 * (4.0 * (x - 0.5) ** 2 - 0.25))
    bilateral = x < 0.02
    exact = solve(ActiveSet(), LCP(G, q, bilateral))
    result = solve(ProjectedCG(), LCP(wrap(G), q, bilateral))
    assert np.abs(result.r - exact.r).max() <= 1e-8 * np.abs(exact.r).max()
    assert (result.active == exact.active).all()
    assert not result.r[x > 0.9].any()
    assert result.residual <= 1e-10 and result.iterations <= 200


def test_only_applications_of_G_are_needed():
    """One application an iteration, one more where an expansion or the final check takes the gradient afresh."""
    operator = Counted(surface(100))
    prepared = ProjectedCG().prepare(operator, np.zeros(100, dtype=bool))
    operator.count = 0
    result = prepared.solve(np.linspace(-1e-3, 2e-3, 100))
    assert result.iterations < operator.count <= 2 * result.iterations + 4


def test_the_residual_is_the_true_one():
    """After hundreds of recursive updates (condition 1e8) it is that of q + G r, evaluated anew."""
    Q = np.linalg.qr(np.random.default_rng(3).normal(size=(60, 60)))[0]
    G = (Q * np.logspace(0.0, -8.0, 60)) @ Q.T
    problem = LCP(0.5 * (G + G.T), np.random.default_rng(4).normal(size=60), np.zeros(60, dtype=bool))
    result = solve(ProjectedCG(), problem)
    assert result.iterations >= 200
    assert problem.residual(result.r) == pytest.approx(result.residual, rel=0.2)
    assert result.residual <= 1e-10


def test_history_falls_to_the_tolerance_relative_to_zero_reaction():
    problem = generic(np.random.default_rng(1), 12)
    result = solve(ProjectedCG(), problem)
    d = np.diag(problem.G) ** -0.5
    start = np.linalg.norm(np.minimum(problem.q * d, 0.0))
    assert result.history[0] == pytest.approx(start, rel=1e-14)
    assert len(result.history) == result.iterations
    loose = solve(ProjectedCG(tolerance=1e-3), problem)
    assert loose.iterations < result.iterations
    assert loose.residual <= 1e-3 * start / (-problem.q * d).max()


def test_the_same_input_gives_the_same_bits():
    problem = LCP(Counted(surface(60)), np.linspace(-1e-3, 1e-3, 60), np.zeros(60, dtype=bool))
    assert (solve(ProjectedCG(), problem).r == solve(ProjectedCG(), problem).r).all()


def test_free_rows_alone_are_plain_conjugate_gradients():
    """All rows bilateral: at most m iterations but for rounding."""
    rng = np.random.default_rng(2)
    result = solve(ProjectedCG(tolerance=1e-10), LCP(spd(rng, 10), rng.normal(size=10), np.ones(10, dtype=bool)))
    assert result.iterations <= 12


def test_failure_tells_what_happened_and_what_to_do():
    problem = LCP(surface(50), np.linspace(-1e-3, 1e-3, 50), np.zeros(50, dtype=bool))
    with pytest.raises(StepFailure, match=r"ProjectedCG.*after 3 iterations with residual .*use ActiveSet"):
        solve(ProjectedCG(max_iterations=3), problem)
    with pytest.raises(InputError, match="finite numbers"):
        solve(ProjectedCG(), problem, guess=np.full(50, np.nan))
    with pytest.raises(InputError, match="not positive definite"):
        solve(ProjectedCG(), LCP(Counted(-np.eye(3)), -np.ones(3), np.zeros(3, dtype=bool)))
