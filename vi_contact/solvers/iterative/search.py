"""Find the contact set of a step by conjugate gradients that stop as soon as a sign is wrong.

A primal-dual active set method (M. Hintermüller, K. Ito, K. Kunisch, The primal-dual active set
strategy as a semismooth Newton method, SIAM J. Optim. 13, 2003, 865-888) with inexact solves. With
S the closed set and F = A x - b,

    x = bound on S,    F = 0 off S,    S <- (S less where -F < 0) and where x > bound.

Whenever the residual off S has fallen tenfold the signs are looked at; one that is wrong by more
than the residual will not come right, and the set changes there and then. In the end F is formed
afresh, and the signs have to hold to the last digit that the certificate sees.
"""

from collections.abc import Callable

import numpy as np

from ...core.algebra import Array, Comm, Mask, largest, total
from ...core.step import StepProblem
from .conjugate_gradients import NOT_A_NUMBER, SOLVED, STAGNATED, WRONG_SIGNS, ConjugateGradients
from .contact import Contact
from .measures import Measured, Worth, largest_free
from .operator import Operator
from .preconditioners import Inverse, Masked

FALL = 0.1  # of the residual between two looks at the signs


class Search:
    """Search the contact set of one step. ``history``: residuals over the forces, at every look."""

    def __init__(
        self,
        step: StepProblem,
        b: Array,
        contact: Contact,
        *,
        operator: Operator,
        masked: Masked,
        inverse: Inverse,
        worth: Worth,
        tolerance: float,
        patience: int,
    ) -> None:
        self.contact, self.operator, self.masked, self.inverse = contact, operator, masked, inverse
        self.comm: Comm = step.surface.comm
        self.b, self.tolerance, self.patience = b, tolerance, patience
        self.measured, self.worth, self.goal = Measured(step, b), worth, 0.0
        self.history: list[float] = []
        self._sets: set[float] = set()
        contact.begin(step)
        inverse.begin()
        self.take_set()

    def take_set(self) -> bool:
        """Take the closed set of ``contact``: mask, springs, load, preconditioner.

        False for one met before.
        """
        contact = self.contact
        self.masked.weights = contact.weights()
        self.operator.set_springs(*contact.sprung)
        self.load = contact.load(self.b)
        self.inverse.follow(contact.held)
        name = total(self.comm, contact.fingerprint())
        known = name in self._sets
        self._sets.add(name)
        return not known

    def watch(self, iteration: int, residual: Array, at: Callable[[], Array]) -> int:
        """Return whether conjugate gradients may stop, as PETSc takes it; 0 to go on.

        ``at()``:
        x.
        """
        norm = largest_free(self.comm, residual, self.masked.weights)
        if not np.isfinite(norm):
            return NOT_A_NUMBER
        if iteration == 0 or norm <= max(self.goal, self._mark):
            x = at()
            self.look(norm, x, residual, iteration)
            if norm <= self.goal:
                return SOLVED
            if iteration and largest(self.comm, np.any(self.wrong(x, residual, norm))):
                return WRONG_SIGNS
        if iteration - self._since < self.patience:
            return 0
        self.look(norm, at(), residual, iteration)
        return STAGNATED

    def look(self, norm: float, x: Array, residual: Array, iteration: int = 0) -> None:
        """Take the references at x, and note the residual; ``goal``: how small it has to become."""
        self._mark, self._since = FALL * norm, iteration
        self.scales = self.measured(self.contact, x, residual, self.load)
        self.goal = self.worth.goal(
            norm, self.scales, x, self.contact.reactions(x, residual), begin=iteration == 0
        )
        self.history.append(norm / self.scales.force if self.scales.force > 0.0 else norm)

    def wrong(self, x: Array, residual: Array, error: float) -> Mask:
        """Return the conditions of this rank whose signs are wrong by more than the error.

        The error is the largest residual.
        """
        r = self.contact.reactions(x, residual)
        least = 0.5 * self.tolerance * self.scales.reaction
        return self.contact.wrong(
            x, r, error=error, least_force=least, x_ref=self.scales.displacement
        )

    def afresh(self, x: Array) -> tuple[Array, float]:
        """Return (residual, largest of the free unknowns), formed anew at x: one product."""
        residual = self.load - (self.operator @ x)
        self.scales = self.measured(self.contact, x, residual, self.load)
        return residual, largest_free(self.comm, residual, self.masked.weights)

    def certain(self, norm: float) -> bool:
        """Say whether a residual formed afresh is small enough."""
        return norm <= self.tolerance * self.scales.force

    def change(self, wrong: Mask, x: Array, residual: Array) -> tuple[Array, Array, bool]:
        """Change the set, and return (x, residual, whether the set is a new one).

        It takes a product where a rigid support closes. One that opens leaves the residual as it
        is, and springs change it in their rows alone.
        """
        contact = self.contact
        moves = largest(self.comm, np.any(wrong & ~contact.closed & ~contact.soft))
        before = contact.spring_forces(x)
        contact.change(wrong)
        new = self.take_set()
        if moves:
            contact.place(x)
            return x, self.load - (self.operator @ x), new
        residual[contact.rows] += before - contact.spring_forces(x)
        return x, residual, new


def search(
    of: Search, cg: ConjugateGradients, x: Array, changes: int
) -> tuple[Array, Array, int, int]:
    """Return (x, residual, changes of the set, reason) of the search from x.

    The reason is SOLVED, or PETSc's for stopping, or WRONG_SIGNS when a set came twice or the set
    changed more often than ``changes``. Collective.
    """
    contact, count, refinements = of.contact, 0, 0
    contact.place(x)
    residual = of.load - (of.operator @ x)
    while True:
        x, residual, reason = cg.solve(residual, x, of.watch)
        if reason not in (SOLVED, WRONG_SIGNS):
            return x, residual, count, reason
        norm = 0.0
        if reason == SOLVED:
            residual, fresh = of.afresh(x)
            if not of.certain(fresh) and refinements < 3:
                refinements += 1
                continue
        else:
            norm = largest_free(of.comm, residual, of.masked.weights)
        wrong = of.wrong(x, residual, norm)
        if not largest(of.comm, np.any(wrong)):
            if reason == SOLVED:
                return x, residual, count, SOLVED
            continue
        if count == changes:
            return x, residual, count, WRONG_SIGNS
        count += 1
        x, residual, new = of.change(wrong, x, residual)
        if not new:
            return x, residual, count, WRONG_SIGNS
