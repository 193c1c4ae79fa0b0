"""Solve large contact sets by projected conjugate gradients (MPRGP): the Delassus operator is only applied.

min ½ rᵀG r + qᵀr over r >= 0 (bilateral rows unbounded), by Dostál's "modified proportioning with
reduced gradient projections" (Z. Dostál, Optimal Quadratic Programming Algorithms, Springer 2009, algorithm 5.8).
With g = q + G r, the free gradient is phi = g where r is off its bound, and the chopped gradient beta = min(g, 0) where
it is on it. As long as beta is small beside phi (constant Gamma), go on with conjugate gradients on the present face;
a step that would leave the quadrant is cut at the boundary and followed by a projected gradient step of fixed length
(expansion); otherwise release rows along -beta (proportioning). The rate depends on cond(G) only.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from ...core.algebra import Array, Mask
from ...core.checks import attributes
from ...core.errors import InputError
from .lcp import Found, Operator, PreparedLCP, ScaledLCP, failure, largest_eigenvalue, scaled_dense, scaled_operator

PROPORTION = 1.0  # Gamma; any positive number works, 1 is Dostál's choice
STEP = 1.5  # of the expansion, in units of 1/‖G‖: less than 2 converges; the rest is for the error of the estimate


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
        face = _Face(scaled, gap, STEP / norm)
        tolerance = self.tolerance * face.projected_norm()  # at r = 0, whatever the guess
        face.move_to(scaled.reaction(guess, gap))
        history: list[float] = []
        while len(history) <= self.max_iterations:
            norm = face.projected_norm()
            if norm <= tolerance or norm <= face.rounding():
                face.move_to(face.r)  # the gradient afresh: its updates accumulate rounding errors
                norm = face.projected_norm()
                if norm <= max(tolerance, face.rounding()):
                    return face.r, face.complementarity() / unit, len(history), history
            history.append(norm)
            face.advance()
        raise failure(
            self,
            iterations=self.max_iterations,
            residual=face.complementarity() / unit,
            advice="G is ill-conditioned; raise max_iterations, or form G and use ActiveSet",
        )


class _Face:
    """The iterate: r, its gradient split into phi and beta, and the conjugate direction on the present face."""

    def __init__(self, scaled: ScaledLCP, gap: Array, step: float) -> None:
        self._scaled, self._step = scaled, step
        self._reach = np.isfinite(gap)
        self._gap = np.where(self._reach, gap, 0.0)
        self._lower = np.where(scaled.bilateral, -np.inf, 0.0)
        self._place(np.zeros(gap.size), self._gap)
        self._direction = self._phi

    def _apply(self, x: Array) -> Array:
        """G x, and zero in rows out of reach: there r and its gradient stay zero."""
        image: Array = np.where(self._reach, self._scaled.matrix @ x, 0.0)
        return image

    def _place(self, r: Array, gradient: Array) -> None:
        self.r, self._gradient = r, gradient
        free = r > self._lower
        self._phi = np.where(free, gradient, 0.0)
        self._beta = np.where(free, 0.0, np.minimum(gradient, 0.0))

    def move_to(self, r: Array) -> None:
        """Go to r with an exact gradient and start the conjugate directions anew."""
        self._place(r, self._apply(r) + self._gap)
        self._direction = self._phi

    def projected_norm(self) -> float:
        """‖phi + beta‖: zero at the solution."""
        return float(np.linalg.norm(self._phi + self._beta))

    def rounding(self) -> float:
        """What projected_norm can be trusted to."""
        return self._scaled.rounding(self.r) * self.r.size**0.5

    def complementarity(self) -> float:
        return self._scaled.complementarity(self.r, np.where(self._reach, self._gradient, np.inf))

    def advance(self) -> None:
        """One step: conjugate gradient or expansion on the face, or proportioning off it."""
        reduced = np.minimum((self.r - self._lower) / self._step, self._phi)  # what a fixed step could really use
        if self._beta @ self._beta <= PROPORTION**2 * (reduced @ self._phi):
            self._explore()
        else:
            self._release()

    def _explore(self) -> None:
        p = self._direction
        image, curvature = self._curvature(p)
        length = float(self._gradient @ p) / curvature
        blocking = p > 0.0
        feasible = float(np.min((self.r - self._lower)[blocking] / p[blocking], initial=np.inf))
        if length <= feasible:
            self._place(np.maximum(self.r - length * p, self._lower), self._gradient - length * image)
            self._direction = self._phi - (float(self._phi @ image) / curvature) * p
        else:
            self._place(np.maximum(self.r - feasible * p, self._lower), self._gradient - feasible * image)
            self.move_to(np.maximum(self.r - self._step * self._phi, self._lower))

    def _release(self) -> None:
        image, curvature = self._curvature(self._beta)
        length = float(self._gradient @ self._beta) / curvature
        self._place(self.r - length * self._beta, self._gradient - length * image)
        self._direction = self._phi

    def _curvature(self, p: Array) -> tuple[Array, float]:
        image = self._apply(p)
        curvature = float(p @ image)
        if not curvature > 0.0:
            raise InputError("The Delassus operator is not positive definite: check the matrices it came from.")
        return image, curvature
