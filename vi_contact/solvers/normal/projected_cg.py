"""Solve large contact sets by projected conjugate gradients (MPRGP): the Delassus operator is only applied.

min ½ rᵀG r + qᵀr over r >= 0 (bilateral rows unbounded), by the steps of ``proportioning``. The rate depends on cond(G)
only.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from ...core.algebra import Array, Mask
from ...core.checks import attributes
from ...core.errors import InputError
from .lcp import Found, Operator, PreparedLCP, ScaledLCP, failure, largest_eigenvalue, scaled_dense, scaled_operator
from .proportioning import STEP, Face


@dataclass(frozen=True)
class ProjectedCG:
    """Hold the settings. ``tolerance``: norm of the projected gradient phi + beta relative to the one at r = 0.

    In the result ``iterations`` counts applications of G after the start, and ``history`` that norm before each.
    """

    tolerance: float = 1e-12
    max_iterations: int = 10_000

    def __post_init__(self) -> None:
        attributes(self, positive=("tolerance",), counts=("max_iterations",))

    def prepare(self, G: Array | Operator, bilateral: Mask) -> PreparedLCP:
        """Estimate ‖G‖ by power iteration. G (m, m): an array, or anything with ``shape`` and ``@``.

        Works on d G d: with a diagonal that is Jacobi preconditioning, which keeps the bounds. Solving raises
        InputError when G proves not to be positive definite.
        """
        if isinstance(G, np.ndarray):
            scaled = scaled_dense(G, bilateral)
            norm = largest_eigenvalue(scaled.matrix, bilateral.size)
        else:
            scaled = scaled_operator(G, bilateral)
            norm = scaled.norm
        return PreparedLCP(self, scaled, partial(self._search, scaled, norm))

    def _search(self, scaled: ScaledLCP, norm: float, gap: Array, guess: Array | Mask | None, unit: float) -> Found:
        """Go from the guess; without one, from zero."""
        problem = _Scaled(scaled, gap)
        face = Face(problem, np.zeros(gap.size), problem.q, STEP / norm)
        tolerance = self.tolerance * _norm(face)  # at r = 0, whatever the guess
        face.move_to(scaled.reaction(guess, gap))
        history: list[float] = []
        while len(history) <= self.max_iterations:
            norm = _norm(face)
            if norm <= tolerance or norm <= problem.rounding(face):
                face.move_to(face.r)  # the gradient afresh: its updates accumulate rounding errors
                norm = _norm(face)
                if norm <= max(tolerance, problem.rounding(face)):
                    return face.r, problem.complementarity(face) / unit, len(history), history
            history.append(norm)
            face.advance()
        raise failure(
            self,
            iterations=self.max_iterations,
            residual=problem.complementarity(face) / unit,
            advice="G is ill-conditioned; raise max_iterations, or form G and use ActiveSet",
        )


class _Scaled:
    """min ½ rᵀG r + qᵀr over r >= 0, in the scaled rows of an LCP: the problem of ``proportioning``."""

    def __init__(self, scaled: ScaledLCP, gap: Array) -> None:
        self._scaled = scaled
        self._reach = np.isfinite(gap)
        self.q = np.where(self._reach, gap, 0.0)
        self.lower = np.where(scaled.bilateral, -np.inf, 0.0)

    def apply(self, x: Array) -> Array:
        """G x, and zero in rows out of reach: there r and its gradient stay zero."""
        image: Array = np.where(self._reach, self._scaled.matrix @ x, 0.0)
        return image

    def dot(self, x: Array, y: Array) -> float:
        return float(x @ y)

    def least(self, values: Array) -> float:
        return float(np.min(values, initial=np.inf))

    def precondition(self, phi: Array, free: Mask) -> Array:
        return phi

    def not_definite(self) -> Exception:
        return InputError("The Delassus operator is not positive definite: check the matrices it came from.")

    def complementarity(self, face: Face) -> float:
        return self._scaled.complementarity(face.r, np.where(self._reach, face.gradient, np.inf))

    def rounding(self, face: Face) -> float:
        """What the norm of phi + beta can be trusted to."""
        return self._scaled.rounding(face.r) * face.r.size**0.5


def _norm(face: Face) -> float:
    """‖phi + beta‖: zero at the solution."""
    return float(np.linalg.norm(face.phi + face.beta))
