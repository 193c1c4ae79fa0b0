"""Pose the linear complementarity problem of one contact step: its residual, and the scaling all its methods share.

    w = q + G r;    unilateral rows: 0 <= r  perpendicular to  w >= 0;    bilateral rows: w = 0, r free        (1)

G (m, m) [m/N] symmetric positive definite: the Delassus operator; q = bound - x_free [m]: the gap that the step without
reactions would leave, +inf where no obstacle is in reach; r [N] reaction, >= 0 in compression; w [m] gap. Impulses and
velocities may stand for forces and displacements. (1) is the optimality condition of the boundary method, eq. (42),
min ½ rᵀGr + qᵀr over r >= 0, and, with D = G⁻¹ and v = x_free - G r, of its primal form eqs. (46) and (49).

Scaling. With d_i = G_ii^(-1/2) the numbers r_i/d_i and w_i d_i are both in sqrt(J), and (1) keeps its form with
d G d in the place of G. There forces and gaps, translations and rotations compare, so that every tolerance is a pure
number. The unit is the violation of r = 0: the largest -q_i d_i (|q_i| d_i in bilateral rows), the contact there is to
resolve. Gaps that are far from closing do not enter it: a wide gap does not blunt the certificate of a narrow one.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from scipy.linalg import lapack

from ...core.algebra import Array, Mask, max_abs
from ...core.errors import InputError, StepFailure

EPS = float(np.finfo(float).eps)


class Operator(Protocol):
    """Apply a symmetric positive definite matrix that is only applied; ``diagonal()`` is used when there is one."""

    @property
    def shape(self) -> Any: ...
    def __matmul__(self, x: Any, /) -> Any: ...


@dataclass(frozen=True)
class LCPResult:
    """Answer problem (1), within the tolerance of the method or the limit that rounding sets (else StepFailure).

    ``r`` (m,) with r >= 0 exactly in unilateral rows; ``active`` (m,) boolean: r > 0, or bilateral, where a grazing row
    (r = w = 0 but for rounding) may be either; ``residual``: max |min(r_i/d_i, w_i d_i)| over unilateral and
    max |w_i d_i| over bilateral rows, over the unit: 1 is what r = 0 scores, 0 is exact, in all units of G and q;
    ``method`` the settings that made it. Each method tells what ``iterations`` and ``history`` count.
    """

    r: Array
    active: Mask
    iterations: int
    residual: float
    method: object
    history: tuple[float, ...] = ()


@dataclass(frozen=True)
class ScaledLCP:
    """Hold d G d with its scale d: what the methods work on. Everything here is in sqrt(J) or dimensionless."""

    matrix: Any
    scale: Array
    bilateral: Mask
    norm: float  # of the matrix: bounds the growth of rounding errors
    any_bilateral: bool = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "any_bilateral", bool(self.bilateral.any()))

    def gap(self, q: Array) -> Array:
        """Return the scaled gap; InputError for NaN, -inf, or +inf in a bilateral row."""
        check_gap(q, self.bilateral)
        return q * self.scale

    def reaction(self, guess: Array | Mask | None, q: Array) -> Array:
        """Return a start for iterative methods: the guess itself, one Jacobi step on a guessed set, or zero."""
        if guess is None:
            return np.zeros(q.size)
        guess = check_guess(guess, q.size)
        start = np.where(guess, np.where(np.isfinite(q), -q, 0.0), 0.0) if guess.dtype == bool else guess / self.scale
        if not np.isfinite(start).all():
            raise InputError("The guessed reactions contain NaN or infinity: pass finite numbers or None.")
        return np.where(self.bilateral, start, np.where(np.isfinite(q), np.maximum(start, 0.0), 0.0))

    def rounding(self, r: Array) -> float:
        """Return the gap below which there are rounding errors of q + G r only."""
        return 4.0 * EPS * self.norm * max_abs(r)

    def complementarity(self, r: Array, w: Array) -> float:
        """Return what the function of the same name does, for the rows of this problem."""
        return complementarity(r, w, self.bilateral) if self.any_bilateral else max_abs(np.minimum(r, w))

    def violation(self, q: Array) -> float:
        """Return what the function of the same name does, for the rows of this problem."""
        return violation(q, self.bilateral) if self.any_bilateral else max(0.0, -float(q.min(initial=0.0)))

    def result(
        self, r: Array, residual: float, *, iterations: int, method: object, history: tuple[float, ...] = ()
    ) -> LCPResult:
        """Return the result in newtons."""
        active = (r > 0.0) | self.bilateral
        return LCPResult(r * self.scale, active, iterations, residual, method, history)

    def no_contact(self, method: object) -> LCPResult:
        """Return r = 0, the solution when nothing is violated."""
        return self.result(np.zeros(self.scale.size), 0.0, iterations=0, method=method)


def complementarity(r: Array, w: Array, bilateral: Mask) -> float:
    """Return max |min(r, w)| over unilateral rows, max |w| over bilateral ones."""
    return max_abs(np.where(bilateral, w, np.minimum(r, w)))


def violation(q: Array, bilateral: Mask) -> float:
    """Return what complementarity() gives for r = 0."""
    return max(0.0, float(np.where(bilateral, np.abs(q), -q).max(initial=0.0)))


def scaled_dense(G: Array, bilateral: Mask) -> ScaledLCP:
    """Check and scale a dense G. InputError when it is not finite, symmetric (to 1e-8), of positive diagonal."""
    check_operator(G, bilateral)
    if not isinstance(G, np.ndarray):
        raise InputError("This method needs the Delassus operator as an array: form it, or use ProjectedCG.")
    if not np.isfinite(G).all():
        raise InputError("The Delassus operator contains NaN or infinity: check the factorisation it came from.")
    d = energy_scale(G)
    matrix = np.ascontiguousarray(d[:, None] * G * d)
    if max_abs(matrix - matrix.T) > 1e-8:
        raise InputError("The Delassus operator is not symmetric: use a symmetric effective matrix A.")
    matrix = 0.5 * (matrix + matrix.T)
    return ScaledLCP(matrix, d, bilateral.copy(), float(np.abs(matrix).sum(axis=1).max(initial=0.0)))


def scaled_operator(G: Operator, bilateral: Mask) -> ScaledLCP:
    """Scale a G that is only applied: symmetry and definiteness are taken on trust."""
    check_operator(G, bilateral)
    d = energy_scale(G)
    matrix = _Applied(G, d)
    norm = largest_eigenvalue(matrix, d.size) if hasattr(G, "diagonal") else 1.0  # by the choice of d
    return ScaledLCP(matrix, d, bilateral.copy(), norm)


class _Applied:
    """d G d, one application at a time."""

    def __init__(self, G: Operator, scale: Array) -> None:
        self._G, self._scale = G, scale

    def __matmul__(self, x: Array) -> Array:
        return self._scale * np.asarray(self._G @ (self._scale * x))


def energy_scale(G: Array | Operator) -> Array:
    """Return d = G_ii^(-1/2) (m,); for an operator without ``diagonal()``, ‖G‖^(-1/2) in every row."""
    if not hasattr(G, "diagonal"):
        size = int(G.shape[0])
        return np.full(size, largest_eigenvalue(G, size) ** -0.5)
    diagonal = np.asarray(G.diagonal(), dtype=float)
    wrong = np.flatnonzero(~(diagonal > 0.0))
    if wrong.size:
        raise InputError(f"Row {wrong[0]} cannot move (G_ii is not positive): fixed unknowns cannot be contacts.")
    return diagonal**-0.5


def largest_eigenvalue(G: Any, size: int) -> float:
    """Return the largest eigenvalue [as G] by power iteration from a fixed vector, its residual added: it errs upwards.
    """
    if not size:
        return 0.0
    v = 1.0 + np.modf(0.6180339887498949 * np.arange(size))[0]  # no symmetry of a structure is orthogonal to it
    value = error = 0.0
    for _ in range(50):
        v /= np.linalg.norm(v)
        image = np.asarray(G @ v)
        previous, value = value, float(v @ image)
        error = float(np.linalg.norm(image - value * v))
        if not value > 0.0:
            raise InputError("The Delassus operator is not positive definite: check the matrices it came from.")
        if value - previous <= 0.01 * value:
            break
        v = image
    return value + error


def cholesky(G: Array) -> Array:
    """Return the lower Cholesky factor (LAPACK dpotrf); InputError with the row at which G stops being positive
    definite."""
    if not G.size:  # LAPACK takes no empty matrix
        return G
    factor, info = lapack.dpotrf(G, lower=1, clean=0)
    if info > 0:
        raise InputError(
            f"The Delassus operator is not positive definite at contact row {info - 1}: "
            "remove constraints that act on the same motion twice."
        )
    return factor


def check_operator(G: Array | Operator, bilateral: Mask) -> None:
    """Raise InputError unless G is square and ``bilateral`` a boolean mask of its rows."""
    if len(G.shape) != 2 or G.shape[0] != G.shape[1]:
        raise InputError(f"The Delassus operator has shape {tuple(G.shape)}: it must be square.")
    if bilateral.shape != (G.shape[0],) or bilateral.dtype != bool:
        raise InputError(f"'bilateral' must be a boolean mask of the {G.shape[0]} rows of the Delassus operator.")


def check_gap(q: Array, bilateral: Mask) -> None:
    """Raise InputError unless q has one entry a row, finite or (in unilateral rows) +inf."""
    if q.shape != bilateral.shape:
        raise InputError(f"q has shape {q.shape} but the Delassus operator has {bilateral.size} rows: they must match.")
    if not np.isfinite(q).all() and not np.where(bilateral, np.isfinite(q), q > -np.inf).all():
        raise InputError("q contains NaN, -inf, or +inf in a bilateral row: only +inf in unilateral rows is allowed.")


def check_guess(guess: Array | Mask, size: int) -> Array | Mask:
    """Raise InputError unless the guess, a boolean mask or reactions in newtons, has one entry a row."""
    if guess.shape != (size,):
        raise InputError(f"The guess has shape {guess.shape} but there are {size} rows: pass a mask or all reactions.")
    return guess


def failure(method: object, *, iterations: int, residual: float, advice: str) -> StepFailure:
    """Return the error of a method that did not reach its tolerance."""
    return StepFailure(f"{method} stopped after {iterations} iterations with residual {residual:.1e}: {advice}.")
