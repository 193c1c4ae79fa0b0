"""Hildreth–d'Esopo: monotone descent, duality, and seed 000's (42), (46) and (49) against each
other (V4.0)."""

from __future__ import annotations

import numpy as np
import pytest
from reference_lcp import LCP, generic, mixed, solve

from vi_contact.core.errors import InputError, StepFailure
from vi_contact.solvers.normal.active_set import ActiveSet
from vi_contact.solvers.normal.hildreth import Hildreth

pytestmark = pytest.mark.serial


def membrane_schur() -> tuple[np.ndarray, np.ndarray]:
    """D~ and z~ of (49) by seed 000's recipe on a stand-in structure: a 12 x 8 grid of unit
    springs, base fixed, loaded at random; the contact nodes are the eleven of its right edge above
    the base (case b of the seed's wall)."""
    rows, columns = 12, 8
    chain = np.diag(np.full(rows, 2.0)) - np.eye(rows, k=1) - np.eye(rows, k=-1)
    chain[-1, -1] = 1.0
    across = (
        np.diag(np.r_[1.0, np.full(columns - 2, 2.0), 1.0])
        - np.eye(columns, k=1)
        - np.eye(columns, k=-1)
    )
    K = (
        np.kron(chain, np.eye(columns))
        + np.kron(np.eye(rows), across)
        + 0.05 * np.eye(rows * columns)
    )
    F = np.random.default_rng(0).normal(size=rows * columns)
    contact = np.zeros(rows * columns, dtype=bool)
    contact[columns - 1 :: columns] = True
    contact[columns - 1] = False
    K_ci, K_ii = K[np.ix_(contact, ~contact)], K[np.ix_(~contact, ~contact)]
    D = K[np.ix_(contact, contact)] - K_ci @ np.linalg.solve(K_ii, K_ci.T)
    return D, F[contact] - K_ci @ np.linalg.solve(K_ii, F[~contact])


def literal_49(D: np.ndarray, z: np.ndarray, bound: np.ndarray) -> np.ndarray:
    """v of min ½ vᵀDv - zᵀv, v <= bound, by the sweep as verification.md 4.1 prints it."""
    v = np.minimum(0.0, bound)
    for _ in range(5000):
        for i in range(v.size):
            v[i] = min(bound[i], v[i] + (z[i] - D[i] @ v) / D[i, i])
    return v


@pytest.mark.parametrize("gap", [0.0, 0.3])
def test_V40_primal_and_dual_give_the_same_displacements_and_reactions(gap):
    """V4.0: (46)/(49) swept literally, Hildreth in both forms, and the dual (42): (v, r) equal to
    1e-10; D~ symmetric to 1e-12 and positive definite."""
    D, z = membrane_schur()
    assert np.abs(D - D.T).max() <= 1e-12 * np.abs(D).max() and np.linalg.eigvalsh(D)[0] > 0.0
    bound = np.full(z.size, gap)
    v = literal_49(D, z, bound)
    r = z - D @ v  # reaction -S_N
    assert 2 <= np.count_nonzero(r > 1e-6) <= z.size - 2  # some in contact, some not
    G, x_free = np.linalg.inv(D), np.linalg.solve(D, z)
    problem = LCP(G, bound - x_free, np.zeros(z.size, dtype=bool))
    for method in (Hildreth(), Hildreth(primal=False), ActiveSet()):
        result = solve(method, problem)
        assert np.abs(result.r - r).max() <= 1e-10 * np.abs(r).max()
        assert np.abs(x_free - G @ result.r - v).max() <= 1e-10 * np.abs(v).max()


def test_few_sweeps_on_a_wall():
    """The seed: "the convergence is very rapid"; 30 sweeps on its own wall (verification document,
    4.1 (8)). This stand-in takes 31 from a cold start, 47 in the dual form, and next to none from
    its own answer."""
    D, z = membrane_schur()
    G = np.linalg.inv(D)
    problem = LCP(G, -G @ z, np.zeros(z.size, dtype=bool))
    for method, most in ((Hildreth(), 35), (Hildreth(primal=False), 50)):
        result = solve(method, problem)
        assert result.iterations <= most
        assert solve(method, problem, guess=result.r).iterations <= 3


@pytest.mark.parametrize("primal", [True, False])
def test_every_sweep_lowers_the_objective(primal):
    """V4.0: monotone, up to the rounding of the objective itself, from cold and warm starts."""
    rng = np.random.default_rng(1)
    for _ in range(20):
        problem = mixed(rng, 12)
        for guess in (None, rng.random(12)):
            result = solve(Hildreth(primal=primal, record=True), problem, guess=guess)
            values = np.array(result.history)
            assert values.size == result.iterations >= 2
            assert (np.diff(values) <= 1e-14 * np.abs(values).max()).all()
            assert values[0] > values[-1]


def test_strong_duality():
    """min ½ sᵀD s = -min (½ rᵀG r + qᵀr): no gap between (46) and (42)."""
    rng = np.random.default_rng(2)
    for _ in range(20):
        problem = mixed(rng, 10)
        primal, dual = (
            solve(Hildreth(primal=form, record=True), problem) for form in (True, False)
        )
        assert primal.history[-1] == pytest.approx(-dual.history[-1], rel=1e-11)
        assert primal.history[-1] > 0.0


def test_objective_is_only_recorded_when_asked():
    assert solve(Hildreth(), generic(np.random.default_rng(3), 5)).history == ()


def test_diagonal_problem_ends_after_the_first_sweep():
    """Uncoupled contacts: one sweep solves, the second sees no change."""
    problem = LCP(np.diag([1.0, 2.0, 4.0]), np.array([-1.0, -2.0, 1.0]), np.zeros(3, dtype=bool))
    for primal in (True, False):
        result = solve(Hildreth(primal=primal), problem)
        assert (
            result.r.tolist() == pytest.approx([1.0, 1.0, 0.0], rel=1e-15)
            and result.iterations <= 2
        )


@pytest.mark.parametrize("primal", [True, False])
def test_failure_tells_what_happened_and_what_to_do(primal):
    problem = generic(np.random.default_rng(4), 12)
    with pytest.raises(
        StepFailure, match=r"Hildreth.*after 3 iterations with residual .*use ActiveSet"
    ):
        solve(Hildreth(primal=primal, max_sweeps=3), problem)
    with pytest.raises(InputError, match="finite numbers"):
        solve(Hildreth(primal=primal), problem, guess=np.full(12, np.nan))
