"""Pose the linear complementarity problem of one contact step, with the scaling of all methods.

    w = q + G r
    unilateral rows: 0 <= r  perpendicular to  w >= 0;    bilateral rows: w = 0, r free         (1)

G (m, m) [m/N] symmetric positive definite: the Delassus operator; q = bound - x_free [m]: the gap
that the step without reactions would leave, +inf where no obstacle is in reach; r [N] reaction, >=
0 in compression; w [m] gap. Impulses and velocities may stand for forces and displacements. (1) is
the optimality condition of the boundary method, eq. (42), min ½ rᵀGr + qᵀr over r >= 0, and, with D
= G⁻¹ and v = x_free - G r, of its primal form eqs. (46) and (49).

Scaling. With d_i = G_ii^(-1/2) the numbers r_i/d_i and w_i d_i are both in sqrt(J), and (1) keeps
its form with d G d in the place of G. There forces and gaps, translations and rotations compare, so
that every tolerance is a pure number. The unit is the violation of r = 0: the largest -q_i d_i
(|q_i| d_i in bilateral rows), the contact there is to resolve. Gaps that are far from closing do
not enter it: a wide gap does not blunt the certificate of a narrow one.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import isfinite
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import lapack

from ...core.algebra import Array, Mask, lowest, max_abs
from ...core.errors import InputError, StepFailure

EPS = float(np.finfo(float).eps)
SYMMETRIC = 1e-8  # entries of the scaled G that differ by less are equal


class ScaledAnswer(NamedTuple):
    """Hold the answer of a method, in scaled numbers."""

    r: Array  # (m,)
    residual: float  # over the unit
    iterations: int
    history: Sequence[float]


@dataclass(frozen=True)
class LCPResult:
    """Answer problem (1), within the tolerance of the method or the limit that rounding sets.

    Attributes:
        r: (m,) with r >= 0 exactly in unilateral rows.
        active: (m,) r > 0, or bilateral; a grazing row (r = w = 0 but for rounding) may be either.
        iterations: each method tells what it counts.
        residual: max |min(r_i/d_i, w_i d_i)| over unilateral and max |w_i d_i| over bilateral rows,
            over the unit: 1 is what r = 0 scores, 0 is exact, in all units of G and q.
        method: the settings that made it.
        history: each method tells what it holds.
    """

    r: Array
    active: Mask
    iterations: int
    residual: float
    method: object
    history: tuple[float, ...] = ()


@dataclass(frozen=True)
class ScaledLCP:
    """Hold d G d with its scale d: what the methods work on.

    Everything here is in sqrt(J) or dimensionless.

    Attributes:
        scale: (m,) d.
        matrix: (m, m) d G d.
        norm: of the matrix: bounds the growth of rounding errors.
        bilateral: (m,) which rows are.
    """

    scale: Array
    matrix: Array
    norm: float
    bilateral: Mask

    def reaction(self, guess: Array | Mask | None, q: Array) -> Array:
        """Return a start (m,) for iterative methods, scaled.

        Args:
            guess: (m,) reactions [N]; or the contact set, on which one step of Jacobi's method is
                made; None for zero.
            q: (m,) scaled gaps without reactions.

        Raises:
            InputError: guessed reactions are not finite.
        """
        if guess is None:
            return np.zeros(q.size)
        in_reach = np.isfinite(q)
        is_set = guess.dtype == bool
        start = np.where(guess & in_reach, -q, 0.0) if is_set else guess / self.scale
        if not np.isfinite(start).all():
            raise InputError(
                "the guessed reactions contain NaN or infinity: give finite numbers or None"
            )
        one_sided = np.where(in_reach, np.maximum(start, 0.0), 0.0)
        return np.where(self.bilateral, start, one_sided)

    def rounding(self, r: Array) -> float:
        """Return the gap below which there are rounding errors of q + G r only."""
        return 4.0 * EPS * self.norm * max_abs(r)

    @cached_property
    def unilateral(self) -> bool:
        """Say whether no row is bilateral."""
        return not self.bilateral.any()

    def violation(self, gap: Array) -> float:
        """Return the complementarity of r = 0."""
        return lowest(gap) if self.unilateral else self.complementarity(np.zeros(gap.size), gap)

    def complementarity(self, r: Array, w: Array) -> float:
        """Return max |min(r, w)| over unilateral rows, or |w| of bilateral ones if that is more."""
        wrong = np.minimum(r, w)
        if not self.unilateral:
            wrong = np.where(self.bilateral, w, wrong)
        return max_abs(wrong)


@dataclass(frozen=True)
class PreparedLCP:
    """Solve problem (1) for one G and many q.

    Attributes:
        method: the settings.
        scaled: G.
        search: (scaled gap, guess, unit of the residual) -> the answer.
    """

    method: object
    scaled: ScaledLCP
    search: Callable[[Array, Array | Mask | None, float], ScaledAnswer]

    def solve(self, q: ArrayLike, guess: ArrayLike | None = None) -> LCPResult:
        """Solve the problem of q.

        Args:
            q: (m,) gaps without reactions [m].
            guess: (m,) reactions of a similar problem [N], or their active set.

        Raises:
            StepFailure: the method does not reach its tolerance.
            InputError: q is NaN, -inf, or +inf in a bilateral row, or the guess has not one entry a
                row.
        """
        return self._solve(np.asarray(q, float), guess if guess is None else np.asarray(guess))

    def _solve(self, q: Array, guess: Array | Mask | None) -> LCPResult:
        """Check, scale, search, and return what was found in newtons."""
        scaled = self.scaled
        check_gap(q, scaled.bilateral)
        if guess is not None and guess.shape != q.shape:
            raise InputError(
                f"the guess has shape {guess.shape} for {q.size} rows: give a mask or all reactions"
            )
        gap = q * scaled.scale
        unit = scaled.violation(gap)
        nothing = ScaledAnswer(np.zeros(q.size), 0.0, 0, ())
        answer = self.search(gap, guess, unit) if unit else nothing
        return LCPResult(
            r=answer.r * scaled.scale,
            active=(answer.r > 0.0) | scaled.bilateral,
            iterations=answer.iterations,
            residual=answer.residual,
            method=self.method,
            history=tuple(answer.history),
        )


def scale_dense(G: Array, bilateral: Mask, *, unsymmetric: bool = False) -> ScaledLCP:
    """Check and scale a dense G.

    Args:
        G: the Delassus operator (m, m) [m/N].
        bilateral: (m,) which rows are bilateral.
        unsymmetric: whether G need not be symmetric, and its diagonal not positive.

    Raises:
        InputError: G is not finite or, unless it need not be, not symmetric (to 1e-8) of positive
            diagonal.
    """
    if not isinstance(G, np.ndarray):
        raise InputError("this method needs the Delassus operator as an array: form it")
    check_operator(G, bilateral)
    d = compute_scale(G, signed=unsymmetric)
    return ScaledLCP(d, *scale_matrix(G, d, unsymmetric=unsymmetric), bilateral.copy())


def scale_matrix(G: Array, d: Array, *, unsymmetric: bool = False) -> tuple[Array, float]:
    """Return d G d, exactly symmetric where it is so to 1e-8, and its norm.

    Args:
        G: (m, m).
        d: (m,).
        unsymmetric: whether G need not be symmetric.

    Raises:
        InputError: G should be symmetric and is not.
    """
    matrix = np.ascontiguousarray(d[:, None] * G * d)
    if max_abs(matrix - matrix.T) <= SYMMETRIC:
        matrix = 0.5 * (matrix + matrix.T)
    elif not unsymmetric:
        raise InputError(
            "the Delassus operator is not symmetric: use a symmetric effective matrix A, or the "
            "methods Lemke() and, with friction, FrictionNewton()"
        )
    return matrix, float(np.abs(matrix).sum(axis=1).max(initial=0.0))


def compute_scale(G: Array, *, signed: bool = False) -> Array:
    """Return d = |G_ii|^(-1/2) (m,).

    Args:
        G: (m, m).
        signed: whether G_ii may be zero or negative; for 0 the largest entry is taken.

    Raises:
        InputError: G is not finite, or G_ii not positive and not signed.
    """
    if not np.isfinite(G).all():
        raise InputError(
            "the Delassus operator contains NaN or infinity: check the factorisation it came from"
        )
    # A copy without gaps: numpy raises numbers with gaps to a power in another way, which may
    # differ in the last digit, where its answer happens to lie next to them in memory.
    diagonal = np.ascontiguousarray(G.diagonal(), dtype=float)
    if signed:
        diagonal = np.where(diagonal == 0.0, max_abs(G) or 1.0, np.abs(diagonal))
    wrong = np.flatnonzero(~(diagonal > 0.0))
    if wrong.size:
        raise InputError(
            f"contact row {wrong[0]} cannot move, as G_ii is not positive: leave it out of the "
            "contact"
        )
    return diagonal**-0.5


def factorise(G: Array) -> Array:
    """Return the lower Cholesky factor (LAPACK dpotrf).

    Raises:
        InputError: G is not positive definite; the error tells the row.
    """
    if not G.size:  # LAPACK takes no empty matrix
        return G
    factor, info = lapack.dpotrf(G, lower=1, clean=0)
    if info > 0:
        raise InputError(
            f"the Delassus operator is not positive definite at contact row {info - 1}: remove "
            "constraints that act on the same motion twice"
        )
    return factor


def check_operator(G: Array, bilateral: Mask) -> None:
    """Raise InputError unless G is square and ``bilateral`` a boolean mask of its rows."""
    if len(G.shape) != 2 or G.shape[0] != G.shape[1]:
        raise InputError(f"the Delassus operator has shape {tuple(G.shape)}: give a square matrix")
    if getattr(bilateral, "shape", None) != (G.shape[0],) or bilateral.dtype != bool:
        raise InputError(
            f"'bilateral' is no mask: give booleans for the {G.shape[0]} rows of the Delassus "
            "operator"
        )


def check_gap(q: Array, bilateral: Mask) -> None:
    """Raise InputError unless q has one entry a row, finite or (in unilateral rows) +inf."""
    if q.shape != bilateral.shape:
        raise InputError(
            f"q has shape {q.shape} but the Delassus operator has {bilateral.size} rows: give as "
            "many"
        )
    if not isfinite(max_abs(q)) and not np.where(bilateral, np.isfinite(q), q > -np.inf).all():
        raise InputError(
            "q contains NaN, -inf, or +inf in a bilateral row: give numbers, or +inf in other rows"
        )


def make_failure(method: object, *, iterations: int, residual: float, advice: str) -> StepFailure:
    """Return the error of a method that did not reach its tolerance.

    Args:
        method: its settings.
        iterations: so far.
        residual: over the unit.
        advice: what helps.
    """
    return StepFailure(
        f"{method} stopped after {iterations} iterations with residual {residual:.1e}: {advice}"
    )
