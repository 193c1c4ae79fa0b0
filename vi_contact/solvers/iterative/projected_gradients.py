"""Solve a step by projected conjugate gradients on all unknowns (MPRGP).

It serves after a search that went in circles.

min ½ rᵀG r + qᵀr over r >= lower (Z. Dostál, Optimal Quadratic Programming Algorithms, Springer
2009, algorithm 5.8). With g = q + G r, the free gradient is phi = g where r is off its bound, and
the chopped gradient beta = min(g, 0) where it is on it. As long as beta is small beside phi, go on
with conjugate gradients on the present face; a step that would leave the bounds is cut there and
followed by a projected gradient step of fixed length (expansion); otherwise release rows along
-beta (proportioning). The energy falls in every step, so that it cannot cycle.

Here r = -D^½ x with D the diagonal of A and of the closed springs, so that x <= bound is a lower
bound and lengths and forces compare; on a face the preconditioner of the route is used. The springs
that are closed are given while the bounds are searched; then they are taken from the answer, and a
search along the line to it, which makes the energy as small as can be, keeps this Newton iteration
from cycling.
"""

import numpy as np

from ...core.algebra import Array, Mask, largest, total
from .conjugate_gradients import INDEFINITE, NOT_A_NUMBER, SOLVED, STAGNATED
from .search import FALL, Search

ROUNDS = 50  # of springs that open and close
PROPORTION = 1.0  # of beta to phi; any positive number works, 1 is Dostál's choice
# of the expansion, in units of 1/‖G‖: less than 2 converges; the rest is for the error of the
# estimate
STEP = 1.5


class Projected:
    """Minimise ½ xᵀA x - bᵀx with x <= bound. ``norm``: of D^-½ A D^-½."""

    def __init__(self, of: Search, diagonal: Array, norm: float) -> None:
        contact = of.contact
        rows, stiffness = contact.sprung
        self.of, self._step = of, STEP / norm
        diagonal = diagonal.copy()
        diagonal[rows] += stiffness
        self._root = np.sqrt(diagonal)
        self._one_sided = contact.reach & ~contact.soft & ~contact.bilateral
        self._rows, self._bound = contact.rows[self._one_sided], contact.bound[self._one_sided]
        contact.closed = contact.closed & ~self._one_sided
        # 0 where held on both sides, and where there is no unknown
        self._weights = contact.weights()
        self._fixed: Mask = self._weights == 0.0
        self.lower = np.full(len(diagonal), -np.inf)
        self.lower[self._rows] = -self._root[self._rows] * self._bound
        self.q = np.where(self._fixed, 0.0, of.load / self._root)

    def apply(self, r: Array) -> Array:
        """Return D^-½ A D^-½ r, zero in rows that cannot move."""
        return np.where(self._fixed, 0.0, (self.of.operator @ (r / self._root)) / self._root)

    def dot(self, x: Array, y: Array) -> float:
        """Return the inner product over all ranks."""
        return total(self.of.comm, x @ y)

    def precondition(self, phi: Array, free: Mask) -> Array:
        """Return D^½ w M⁻¹ w D^½ phi."""
        masked = self.of.masked
        masked.weights = np.where(free, self._weights, 0.0)
        return self._root * masked(self._root * phi)

    def solve(self, x: Array) -> tuple[Array, int]:
        """Return (x, reason) of the search from x.

        The closed set of ``contact`` is then that of x.
        """
        of = self.of
        x = of.contact.feasible(x)
        start = np.maximum(-self._root * x, self.lower)
        face = Face(self, start, self.apply(start) + self.q, self._step)
        reason = self._descend(face)
        x = -face.r / self._root
        closed = ~face.free[self._rows]
        x[self._rows[closed]] = self._bound[closed]
        of.contact.closed[self._one_sided] = closed
        return x, reason

    def _descend(self, face: "Face") -> int:
        """Advance until the projected gradient is as small as the measures of the step ask for."""
        of, mark, since, count = self.of, np.inf, 0, 0
        while True:
            norm = largest(
                of.comm, np.max(np.abs(self._root * (face.phi + face.beta)), initial=0.0)
            )
            if not np.isfinite(norm):
                return NOT_A_NUMBER
            if norm <= mark:
                mark, since = FALL * norm, count
                x = -face.r / self._root
                of.look(norm, x, np.where(self._fixed, 0.0, self._root * face.gradient))
            if norm <= of.goal:
                return SOLVED
            if count - since >= of.patience:
                return STAGNATED
            face.advance()
            count += 1
            of.operator.work.linear_iterations += 1


class Face:
    """Hold the iterate.

    This is r, its gradient split into phi and beta, and the conjugate direction on the present
    face.
    """

    def __init__(self, problem: Projected, start: Array, gradient: Array, step: float) -> None:
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
        steps = (self.r - lower)[blocking] / p[blocking]
        feasible = -largest(self._problem.of.comm, -np.min(steps, initial=np.inf))
        if length <= feasible:
            self._place(np.maximum(self.r - length * p, lower), self.gradient - length * image)
            z = self._problem.precondition(self.phi, self.free)
            self._direction = z - (self._problem.dot(z, image) / curvature) * p
        else:
            self._place(np.maximum(self.r - feasible * p, lower), self.gradient - feasible * image)
            r = np.maximum(self.r - self._step * self.phi, lower)
            self._place(r, self._problem.apply(r) + self._problem.q)  # an exact gradient
            self._turn()

    def _release(self) -> None:
        image, curvature = self._curvature(self.beta)
        length = self._problem.dot(self.gradient, self.beta) / curvature
        self._place(self.r - length * self.beta, self.gradient - length * image)
        self._turn()

    def _curvature(self, p: Array) -> tuple[Array, float]:
        image = self._problem.apply(p)
        curvature = self._problem.dot(p, image)
        if not curvature > 0.0:
            raise Indefinite
        return image, curvature


class Indefinite(Exception):
    """Say that A is not positive definite."""


def largest_eigenvalue(of: Search, diagonal: Array, rounds: int = 15) -> float:
    """Return the largest eigenvalue of D⁻¹A, from above by 5 % (power iteration). Collective."""
    v = 1.0 + np.modf(0.6180339887498949 * np.arange(len(diagonal)))[0]
    value = 1.0
    of.operator.set_springs(np.zeros(0, dtype=np.int64), np.zeros(0))
    for _ in range(rounds):
        image = (of.operator @ v) / diagonal
        before, after = of.comm.sum(np.array([v @ v, image @ image]))
        value, v = float(np.sqrt(after / before)), image / np.sqrt(after)
    of.operator.set_springs(*of.contact.sprung)
    return 1.05 * max(value, 1.0)


def projected_gradients(
    of: Search, diagonal: Array, norm: float, x: Array
) -> tuple[Array, Array, int]:
    """Return (x, residual formed afresh, reason) of the step from x.

    The reason is SOLVED, or why there is no answer. Collective.
    """
    contact, residual = of.contact, of.load
    for _ in range(ROUNDS):
        try:
            found, reason = Projected(of, diagonal, norm).solve(x)
        except Indefinite:
            return x, residual, INDEFINITE
        of.take_set()
        residual, size = of.afresh(found)
        if reason != SOLVED or not of.certain(size):
            return found, residual, reason if reason != SOLVED else STAGNATED
        if not largest(of.comm, np.any(of.wrong(found, residual, 0.0) & contact.soft)):
            return found, residual, SOLVED
        x = contact.feasible(x)
        x = x + _length(of, x, found - x) * (found - x)
        contact.close_springs(x)
        of.take_set()
    return x, residual, STAGNATED


def _length(of: Search, x: Array, d: Array) -> float:
    """Return the t in (0, 1] at which the energy is smallest along d.

    The energy is ½ xᵀA x - bᵀx + sum ½ k max(x - bound, 0)², and t a zero of its slope.
    """
    contact = of.contact
    contact.close_springs(None)
    of.take_set()
    here = of.load - (of.operator @ x)
    there = of.load - (of.operator @ (x + d))
    slope, curvature = of.comm.sum(np.array([-(d @ here), d @ (here - there)]))
    low, high = 0.0, 1.0
    for _ in range(50):
        t = 0.5 * (low + high)
        rising = slope + t * curvature + total(of.comm, contact.spring_slope(x, d, t)) > 0.0
        low, high = (low, t) if rising else (t, high)
    return high
