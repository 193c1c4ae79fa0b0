"""Minimise a quadratic over lower bounds: one step of modified proportioning with reduced gradient projections.

min ½ rᵀG r + qᵀr over r >= lower (Z. Dostál, Optimal Quadratic Programming Algorithms, Springer 2009, algorithm 5.8).
With g = q + G r, the free gradient is phi = g where r is off its bound, and the chopped gradient beta = min(g, 0) where
it is on it. As long as beta is small beside phi (constant Gamma), go on with conjugate gradients on the present face;
a step that would leave the bounds is cut there and followed by a projected gradient step of fixed length
(expansion); otherwise release rows along -beta (proportioning). The energy falls in every step. The rate depends on
cond(G) only; a preconditioner of the face shortens the conjugate gradients.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from ...core.algebra import Array, Mask

PROPORTION = 1.0  # Gamma; any positive number works, 1 is Dostál's choice
STEP = 1.5  # of the expansion, in units of 1/‖G‖: less than 2 converges; the rest is for the error of the estimate


class Bounded(Protocol):
    """Pose the problem: G as ``apply``, q, the lower bounds (-inf for none), and what is asked of all ranks."""

    q: Array
    lower: Array

    def apply(self, r: Array) -> Array: ...
    def dot(self, x: Array, y: Array) -> float: ...
    def least(self, values: Array) -> float:
        """Return the smallest of the values on all ranks, infinity for none."""
        ...

    def precondition(self, phi: Array, free: Mask) -> Array:
        """Return an approximation of the inverse on the free rows, zero in the others; phi itself for none."""
        ...

    def not_definite(self) -> Exception:
        """Return what to raise when G is not positive definite."""
        ...


class Face:
    """Hold the iterate: r, its gradient split into phi and beta, and the conjugate direction on the present face."""

    def __init__(self, problem: Bounded, start: Array, gradient: Array, step: float) -> None:
        self._problem, self._step = problem, step
        self._place(start, gradient)
        self._turn()

    def _place(self, r: Array, gradient: Array) -> None:
        self.r, self.gradient = r, gradient
        self.free = r > self._problem.lower
        self.phi = np.where(self.free, gradient, 0.0)
        self.beta = np.where(self.free, 0.0, np.minimum(gradient, 0.0))

    def _turn(self) -> None:
        """Start the conjugate directions anew."""
        self._direction = self._problem.precondition(self.phi, self.free)

    def move_to(self, r: Array) -> None:
        """Go to r with an exact gradient and start the conjugate directions anew."""
        self._place(r, self._problem.apply(r) + self._problem.q)
        self._turn()

    def advance(self) -> None:
        """Take one step: conjugate gradient or expansion on the face, or proportioning off it."""
        dot = self._problem.dot
        room = (self.r - self._problem.lower) / self._step
        reduced = np.minimum(room, self.phi)  # what a fixed step could really use
        if dot(self.beta, self.beta) <= PROPORTION**2 * dot(reduced, self.phi):
            self._explore()
        else:
            self._release()

    def _explore(self) -> None:
        p, lower = self._direction, self._problem.lower
        image, curvature = self._curvature(p)
        length = self._problem.dot(self.gradient, p) / curvature
        blocking = p > 0.0
        feasible = self._problem.least((self.r - lower)[blocking] / p[blocking])
        if length <= feasible:
            self._place(np.maximum(self.r - length * p, lower), self.gradient - length * image)
            z = self._problem.precondition(self.phi, self.free)
            self._direction = z - (self._problem.dot(z, image) / curvature) * p
        else:
            self._place(np.maximum(self.r - feasible * p, lower), self.gradient - feasible * image)
            self.move_to(np.maximum(self.r - self._step * self.phi, lower))

    def _release(self) -> None:
        image, curvature = self._curvature(self.beta)
        length = self._problem.dot(self.gradient, self.beta) / curvature
        self._place(self.r - length * self.beta, self.gradient - length * image)
        self._turn()

    def _curvature(self, p: Array) -> tuple[Array, float]:
        image = self._problem.apply(p)
        curvature = self._problem.dot(p, image)
        if not curvature > 0.0:
            raise self._problem.not_definite()
        return image, curvature
