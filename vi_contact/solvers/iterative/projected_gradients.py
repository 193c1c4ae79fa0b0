"""Solve a step by projected conjugate gradients on all unknowns (MPRGP).

It serves after a search that went in circles, and minimises

    ½ rᵀG r + qᵀr  over  r >= lower

(Z. Dostál, Optimal Quadratic Programming Algorithms, Springer 2009, algorithm 5.8). With the
gradient g = q + G r, the free gradient phi is g where r is off its bound, and the chopped gradient
beta is min(g, 0) where it is on it; elsewhere they are zero. One of three steps is taken:

- as long as beta is small beside phi, a conjugate gradient step on the present face of the bounds;
- where that would leave the bounds it is cut there, and followed by a projected gradient step of
  fixed length, which brings others onto theirs (*expansion*);
- where beta is large, rows are released along -beta (*proportioning*).

The energy falls in every step, so that it cannot cycle.

Here r = -D^½ x with D the diagonal of A and of the closed springs, so that x <= bound is a lower
bound and lengths and forces compare; on a face the preconditioner of the route is used. The springs
that are closed are given while the bounds are searched; then they are taken from the answer, and a
search along the line to it, which makes the energy as small as can be, keeps this Newton iteration
from cycling.
"""

import numpy as np

from ...core.algebra import Array, Mask, largest, total
from ...core.matrix_checks import GOLDEN
from .conjugate_gradients import INDEFINITE, NOT_A_NUMBER, SOLVED, STAGNATED
from .search import FALL, Search

ROUNDS = 50  # of springs that open and close
PROPORTION = 1.0  # of beta to phi; any positive number works, 1 is Dostál's choice
# length of the expansion, in units of 1/‖G‖: less than 2 converges; the rest is for the error of
# the estimate of ‖G‖
STEP = 1.5
HALVINGS = 50  # of the interval in which the search along a line finds its minimum


class BoundedMinimum:
    """Minimise ½ xᵀA x - bᵀx with x <= bound, with the closed springs that there are.

    Attributes:
        search: the step, with its contact set.
        lower: lower bounds of r, padded.
        q: the linear part, padded.
    """

    def __init__(self, search: Search, diagonal: Array, norm: float) -> None:
        """Scale the problem of a step, and leave its one-sided rigid conditions to the bounds.

        Args:
            search: the step; the contact set loses what is now a bound.
            diagonal: D of A, padded.
            norm: largest eigenvalue of D^-½ A D^-½.
        """
        contact = search.contact
        rows, stiffness = contact.sprung
        self.search = search
        self._step = STEP / norm
        diagonal = diagonal.copy()
        diagonal[rows] += stiffness
        self._root = np.sqrt(diagonal)
        self._one_sided = contact.reach & ~contact.soft & ~contact.bilateral
        self._rows = contact.rows[self._one_sided]
        self._bound = contact.bound[self._one_sided]
        contact.closed = contact.closed & ~self._one_sided
        # 0 where held on both sides, and where there is no unknown
        self._weights = contact.weights()
        self._fixed: Mask = self._weights == 0.0
        self.lower = np.full(len(diagonal), -np.inf)
        self.lower[self._rows] = -self._root[self._rows] * self._bound
        self.q = np.where(self._fixed, 0.0, search.load / self._root)

    def apply(self, r: Array) -> Array:
        """Return D^-½ A D^-½ r, zero in rows that cannot move."""
        image = (self.search.operator @ (r / self._root)) / self._root
        return np.where(self._fixed, 0.0, image)

    def dot(self, x: Array, y: Array) -> float:
        """Return the inner product over all ranks."""
        return total(self.search.comm, x @ y)

    def precondition(self, phi: Array, free: Mask) -> Array:
        """Return D^½ w M⁻¹ w D^½ phi, with w zero where r is on its bound."""
        masked = self.search.masked
        masked.weights = np.where(free, self._weights, 0.0)
        return self._root * masked(self._root * phi)

    def solve(self, x: Array) -> tuple[Array, int]:
        """Descend from x, until the goal of the step is reached.

        Args:
            x: padded; what penetrates is put onto its bound before.

        Returns:
            The minimum x, padded, and SOLVED, or why there is none. The closed set of ``contact``
            is then that of x: points that are on their bound.
        """
        # Scale, r = -D^½ x, and begin on the face that x is on.
        contact = self.search.contact
        x = contact.project(x)
        start = np.maximum(-self._root * x, self.lower)
        face = Face(self, start, self.apply(start) + self.q, self._step)
        reason = self._descend(face)

        # Scale back; bounds are then met exactly.
        x = -face.r / self._root
        closed = ~face.free[self._rows]
        x[self._rows[closed]] = self._bound[closed]
        contact.closed[self._one_sided] = closed
        return x, reason

    def _descend(self, face: "Face") -> int:
        """Advance until the projected gradient is as small as the measures of the step ask for.

        Args:
            face: where it begins; it holds the iterate.

        Returns:
            SOLVED; STAGNATED when the gradient has not fallen tenfold for too long; NOT_A_NUMBER.
        """
        search = self.search
        mark = np.inf  # the goal is taken anew whenever the gradient has fallen below,
        since = 0  # which it did last at this count
        count = 0
        while True:
            # The projected gradient phi + beta, in the unit of forces.
            gradient = np.abs(self._root * (face.phi + face.beta))
            norm = largest(search.comm, np.max(gradient, initial=0.0))
            if not np.isfinite(norm):
                return NOT_A_NUMBER
            if norm <= mark:
                mark = FALL * norm
                since = count
                x = -face.r / self._root
                search.look(norm, x, np.where(self._fixed, 0.0, self._root * face.gradient))
            if norm <= search.goal:
                return SOLVED
            if count - since >= search.patience:
                return STAGNATED
            face.advance()
            count += 1
            search.operator.work.linear_iterations += 1


class Face:
    """Hold the iterate, and the conjugate direction on the face of the bounds that it is on.

    Attributes:
        r: the iterate, padded.
        gradient: g = q + G r.
        free: which entries of r are off their bound.
        phi: the free gradient.
        beta: the chopped gradient.
    """

    def __init__(self, problem: BoundedMinimum, start: Array, gradient: Array, step: float) -> None:
        """Begin on the face of a start.

        Args:
            problem: what is minimised.
            start: r, within its bounds.
            gradient: g there.
            step: length of an expansion.
        """
        self._problem = problem
        self._step = step
        self._place(start, gradient)
        self._restart()

    def _place(self, r: Array, gradient: Array) -> None:
        """Go to r, and split the gradient there."""
        self.r = r
        self.gradient = gradient
        self.free = r > self._problem.lower
        self.phi = np.where(self.free, gradient, 0.0)
        self.beta = np.where(self.free, 0.0, np.minimum(gradient, 0.0))

    def _restart(self) -> None:
        """Start the conjugate directions anew, from the free gradient."""
        self._direction = self._problem.precondition(self.phi, self.free)

    def advance(self) -> None:
        """Take one step: conjugate gradient or expansion on the face, or proportioning off it."""
        # The iterate is "proportional" where beta is small beside phi, of which only that part
        # counts which a step of fixed length could use before it meets the bounds: then there is
        # still something to gain on the face.
        dot = self._problem.dot
        room = (self.r - self._problem.lower) / self._step
        reduced = np.minimum(room, self.phi)
        if dot(self.beta, self.beta) <= PROPORTION**2 * dot(reduced, self.phi):
            self._explore()
        else:
            self._release()

    def _explore(self) -> None:
        """Take a conjugate gradient step on the face, or as far as bounds allow, and expand."""
        problem = self._problem
        p = self._direction
        lower = problem.lower

        # The length of the conjugate gradient step r - length p, and the largest one that stays
        # within the bounds, of all ranks.
        image, curvature = self._measure_curvature(p)
        length = problem.dot(self.gradient, p) / curvature
        blocking = p > 0.0
        steps = (self.r - lower)[blocking] / p[blocking]
        feasible = -largest(problem.search.comm, -np.min(steps, initial=np.inf))
        if length <= feasible:
            # The next direction: z = M⁻¹ phi, less its part that is not conjugate to p.
            self._place(np.maximum(self.r - length * p, lower), self.gradient - length * image)
            z = problem.precondition(self.phi, self.free)
            self._direction = z - (problem.dot(z, image) / curvature) * p
            return

        # Expansion: as far as the first bound, and from there a projected gradient step of fixed
        # length, which brings others onto theirs. The gradient is then formed afresh.
        self._place(np.maximum(self.r - feasible * p, lower), self.gradient - feasible * image)
        r = np.maximum(self.r - self._step * self.phi, lower)
        self._place(r, problem.apply(r) + problem.q)
        self._restart()

    def _release(self) -> None:
        """Proportioning: go down along -beta, which takes entries off their bound."""
        image, curvature = self._measure_curvature(self.beta)
        length = self._problem.dot(self.gradient, self.beta) / curvature
        self._place(self.r - length * self.beta, self.gradient - length * image)
        self._restart()

    def _measure_curvature(self, p: Array) -> tuple[Array, float]:
        """Return G p and pᵀG p."""
        image = self._problem.apply(p)
        curvature = self._problem.dot(p, image)
        if not curvature > 0.0:
            raise Indefinite
        return image, curvature


class Indefinite(Exception):
    """Say that A is not positive definite."""


def estimate_largest_eigenvalue(search: Search, diagonal: Array, rounds: int = 15) -> float:
    """Return the largest eigenvalue of D⁻¹A, too large by 5 %. Collective.

    It is found by power iteration, from below; without the springs.

    Args:
        search: the step, whose operator is used.
        diagonal: D of A, padded.
        rounds: products with A.
    """
    v = 1.0 + np.modf(GOLDEN * np.arange(len(diagonal)))[0]
    value = 1.0
    search.operator.set_springs(np.zeros(0, dtype=np.int64), np.zeros(0))
    for _ in range(rounds):
        image = (search.operator @ v) / diagonal
        before, after = search.comm.sum(np.array([v @ v, image @ image]))
        value = float(np.sqrt(after / before))
        v = image / np.sqrt(after)
    search.operator.set_springs(*search.contact.sprung)
    return 1.05 * max(value, 1.0)


def descend(search: Search, diagonal: Array, norm: float, x: Array) -> tuple[Array, Array, int]:
    """Solve a step from x. Collective.

    Args:
        search: the step, with its contact set.
        diagonal: D of A, padded.
        norm: largest eigenvalue of D⁻¹A.
        x: padded, where to begin.

    Returns:
        The answer x, its residual formed afresh, and SOLVED, or why there is no answer.
    """
    contact = search.contact
    residual = search.load
    for _ in range(ROUNDS):
        # The minimum with the closed springs as they are.
        try:
            target, reason = BoundedMinimum(search, diagonal, norm).solve(x)
        except Indefinite:
            return x, residual, INDEFINITE
        search.take_set()
        residual, size = search.form_residual(target)
        if reason != SOLVED:
            return target, residual, reason
        if not search.is_certain(size):
            return target, residual, STAGNATED
        wrong = search.wrong_signs(target, residual, 0.0)
        if not largest(search.comm, np.any(wrong & contact.soft)):
            return target, residual, SOLVED

        # Springs are wrong: go towards it as far as the energy falls, and close those of there.
        x = contact.project(x)
        x = x + _search_line(search, x, target - x) * (target - x)
        contact.close_springs(x)
        search.take_set()
    return x, residual, STAGNATED


def _search_line(search: Search, x: Array, d: Array) -> float:
    """Return the t in (0, 1] at which the energy is smallest along d. Collective.

    The energy is ½ xᵀA x - bᵀx + sum ½ k max(x - bound, 0)², and t a zero of its slope, found by
    bisection.

    Args:
        search: the step; its springs are open afterwards.
        x: padded, where the line begins.
        d: padded, where it leads.
    """
    # The slope of the part without one-sided springs is linear in t: two residuals give it.
    contact = search.contact
    contact.close_springs(None)
    search.take_set()
    here = search.load - (search.operator @ x)
    there = search.load - (search.operator @ (x + d))
    slope, curvature = search.comm.sum(np.array([-(d @ here), d @ (here - there)]))

    # That of the springs is monotone, and so is the sum: halve the interval that has its zero.
    low = 0.0
    high = 1.0
    for _ in range(HALVINGS):
        t = 0.5 * (low + high)
        springs = total(search.comm, contact.spring_slope(x, d, t))
        if slope + t * curvature + springs > 0.0:
            high = t
        else:
            low = t
    return high
