"""Find the contact set of a step by conjugate gradients that stop as soon as a sign is wrong.

A primal-dual active set method (M. Hintermüller, K. Ito, K. Kunisch, The primal-dual active set strategy as a
semismooth Newton method, SIAM J. Optim. 13, 2003, 865-888) with inexact solves. With S the closed set and F = A x - b,

    x = bound on S,    F = 0 off S,    S <- (S less where -F < 0) and where x > bound.

Whenever the residual off S has fallen tenfold the signs are looked at; one that is wrong by more than the residual will
not come right, and the set changes there and then. In the end F is formed afresh, and the signs have to hold to the
last digit that the certificate sees.
"""

from __future__ import annotations

import numpy as np

from ...core.algebra import Array, Comm, Mask, largest, total
from ...core.step import StepProblem
from .conjugate_gradients import NOT_A_NUMBER, SOLVED, STAGNATED, WRONG_SIGNS, ConjugateGradients
from .contact import Contact
from .measures import Measured, largest_free
from .operator import Operator
from .preconditioners import Inverse, Masked

GOAL = 0.7  # of the tolerance: the rest is for what the carried residual and the one formed afresh differ by
FALL = 0.1  # of the residual between two looks at the signs


class Search:
    """Search the contact set of one step. ``history``: residuals over the forces, at every look."""

    def __init__(
        self, step: StepProblem, b: Array, contact: Contact, *, operator: Operator, masked: Masked, inverse: Inverse,
        tolerance: float, patience: int,
    ) -> None:
        self.contact, self.operator, self.masked, self.inverse = contact, operator, masked, inverse
        self.comm: Comm = step.surface.comm
        self.b, self.tolerance, self.patience = b, tolerance, patience
        self.measured = Measured(step, b)
        self.history: list[float] = []
        self._sets: set[float] = set()
        contact.begin(step)
        inverse.begin()
        self.take_set()

    def take_set(self) -> bool:
        """Take the closed set of ``contact``: mask, springs, load, preconditioner. False for one met before."""
        contact = self.contact
        self.masked.weights = contact.weights()
        self.operator.set_springs(*contact.sprung)
        self.load = contact.load(self.b)
        self.inverse.follow(contact)
        name = total(self.comm, contact.fingerprint())
        known = name in self._sets
        self._sets.add(name)
        return not known

    def watch(self, iteration: int, residual: Array, x: Array) -> int:
        """Return whether conjugate gradients may stop, as PETSc takes it; 0 to go on."""
        norm = largest_free(self.comm, residual, self.masked.weights)
        if not np.isfinite(norm):
            return NOT_A_NUMBER
        if iteration == 0:
            self.look(norm, x, residual, 0)
        if norm <= self.goal:
            self._note(norm)
            return SOLVED
        if norm <= self._mark:
            self.look(norm, x, residual, iteration)
            if largest(self.comm, np.any(self.wrong(x, residual, norm))):
                return WRONG_SIGNS
        if iteration - self._since < self.patience:
            return 0
        self._note(norm)
        return STAGNATED

    def look(self, norm: float, x: Array, residual: Array, iteration: int = 0) -> None:
        """Take the references at x, and note the residual."""
        self._mark, self._since = FALL * norm, iteration
        self.scales = self.measured(self.contact, x, residual, self.load)
        self.goal = GOAL * self.tolerance * self.scales.force
        self._note(norm)

    def _note(self, norm: float) -> None:
        self.history.append(norm / self.scales.force if self.scales.force > 0.0 else norm)

    def wrong(self, x: Array, residual: Array, error: float) -> Mask:
        """Return the conditions of this rank whose signs are wrong by more than the error, the largest residual."""
        r = self.contact.reactions(x, residual)
        least = 0.5 * self.tolerance * self.scales.reaction
        return self.contact.wrong(x, r, error=error, least_force=least, x_ref=self.scales.displacement)

    def afresh(self, x: Array) -> tuple[Array, float]:
        """Return (residual, largest of the free unknowns), formed anew at x: one product."""
        residual = self.load - (self.operator @ x)
        self.scales = self.measured(self.contact, x, residual, self.load)
        return residual, largest_free(self.comm, residual, self.masked.weights)

    def certain(self, norm: float) -> bool:
        """Say whether a residual formed afresh is small enough."""
        return norm <= self.tolerance * self.scales.force


def search(of: Search, cg: ConjugateGradients, x: Array, changes: int) -> tuple[Array, Array, int, int]:
    """Return (x, residual, changes of the set, reason) of the search from x. The reason is SOLVED, or PETSc's for
    stopping, or WRONG_SIGNS when a set came twice or the set changed more often than ``changes``. Collective."""
    contact, count, refinements = of.contact, 0, 0
    while True:
        contact.place(x)
        x, residual, reason = cg.solve(of.load, x, of.watch)
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
        contact.change(wrong)
        count += 1
        if not of.take_set():
            return x, residual, count, WRONG_SIGNS
