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
from .contact import ClosedSet
from .measures import StepMeasure, Worth, largest_free
from .operator import Operator
from .preconditioners import Inverse, Masked

FALL = 0.1  # of the residual between two looks at the signs
REFINEMENTS = 3  # solves that go on because the residual, formed afresh, is not small enough


class Search:
    """Hold the contact set of one step while it is searched.

    Attributes:
        load: b, padded, with the load of closed springs.
        scales: what residuals are relative to, at the x that was looked at last.
        goal: residual below which the present set is solved.
        history: residuals over the forces, at every look.
    """

    def __init__(
        self,
        step: StepProblem,
        b: Array,
        contact: ClosedSet,
        *,
        operator: Operator,
        masked: Masked,
        inverse: Inverse,
        worth: Worth,
        tolerance: float,
        patience: int,
    ) -> None:
        """Begin with the predicted set of a step.

        Args:
            step: the step.
            b: its load, padded.
            contact: the closed set.
            operator: A with the closed springs.
            masked: the preconditioner on the free unknowns.
            inverse: the preconditioner of all.
            worth: tells how small residuals have to be.
            tolerance: relative error that an answer may have.
            patience: linear iterations within which the residual has to fall tenfold.
        """
        self.contact = contact
        self.operator = operator
        self.masked = masked
        self.inverse = inverse
        self.comm: Comm = step.surface.comm
        self.b = b
        self.tolerance = tolerance
        self.patience = patience
        self.measure = StepMeasure(step, b)
        self.worth = worth
        self.goal = 0.0
        self.history: list[float] = []
        self._sets: set[float] = set()  # fingerprints of the sets that were taken
        self._mark = np.inf  # residual below which the signs are looked at next
        self._since = 0  # iteration of the last look
        contact.begin(step)
        inverse.begin()
        self.take_set()

    def take_set(self) -> bool:
        """Take the closed set of ``contact`` into mask, springs, load and preconditioner.

        Collective.

        Returns:
            Whether the set is a new one.
        """
        contact = self.contact
        self.masked.weights = contact.weights()
        self.operator.set_springs(*contact.sprung)
        self.load = contact.load(self.b)
        self.inverse.follow(contact.held)
        fingerprint = total(self.comm, contact.fingerprint())
        is_new = fingerprint not in self._sets
        self._sets.add(fingerprint)
        return is_new

    def watch(self, iteration: int, residual: Array, solution: Callable[[], Array]) -> int:
        """Say whether conjugate gradients may stop. Collective.

        Args:
            iteration: their number so far.
            residual: padded, as they carry it along.
            solution: makes the present x, which costs something.

        Returns:
            The reason, as PETSc takes it; 0 to go on.
        """
        norm = largest_free(self.comm, residual, self.masked.weights)
        if not np.isfinite(norm):
            return NOT_A_NUMBER

        # Look at x and the signs at the first iteration, and whenever the residual has fallen
        # tenfold, or to the goal. A sign that is wrong by more than the residual ends the solve: it
        # would not come right.
        if iteration == 0 or norm <= max(self.goal, self._mark):
            x = solution()
            self.look(norm, x, residual, iteration)
            if norm <= self.goal:
                return SOLVED
            if iteration and largest(self.comm, np.any(self.wrong_signs(x, residual, norm))):
                return WRONG_SIGNS

        # Go on, unless the residual has not fallen tenfold for too long.
        if iteration - self._since < self.patience:
            return 0
        self.look(norm, solution(), residual, iteration)
        return STAGNATED

    def look(self, norm: float, x: Array, residual: Array, iteration: int = 0) -> None:
        """Take references and goal at x, and note the residual. Collective.

        Args:
            norm: the largest residual of free unknowns.
            x: padded.
            residual: padded, at x.
            iteration: 0 where there is no earlier residual to compare with.
        """
        self._mark = FALL * norm
        self._since = iteration
        self.scales = self.measure(self.contact, x, residual, self.load)
        reactions = self.contact.reactions(x, residual)
        self.goal = self.worth.goal(norm, self.scales, x, reactions, begin=iteration == 0)
        force = self.scales.force
        self.history.append(norm / force if force > 0.0 else norm)

    def wrong_signs(self, x: Array, residual: Array, error: float) -> Mask:
        """Return the conditions of this rank whose signs are wrong by more than the error.

        Args:
            x: padded.
            residual: padded, at x.
            error: the largest residual of free unknowns.
        """
        return self.contact.wrong_signs(
            x,
            self.contact.reactions(x, residual),
            error=error,
            least_force=0.5 * self.tolerance * self.scales.reaction,
            x_ref=self.scales.displacement,
        )

    def form_first_residual(self, x: Array) -> Array:
        """Return the residual at the x that a step begins with. Collective.

        It costs one product, and none at x = 0, where increments begin.
        """
        if largest(self.comm, bool(x.any())):
            return np.asarray(self.load - (self.operator @ x))
        return self.load

    def form_residual(self, x: Array) -> tuple[Array, float]:
        """Return the residual formed afresh at x, and the largest of the free unknowns.

        It costs one product. Collective.
        """
        residual = self.load - (self.operator @ x)
        self.scales = self.measure(self.contact, x, residual, self.load)
        return residual, largest_free(self.comm, residual, self.masked.weights)

    def is_certain(self, norm: float) -> bool:
        """Say whether a residual that was formed afresh is small enough."""
        return norm <= self.tolerance * self.scales.force

    def change(self, wrong: Mask, x: Array, residual: Array) -> tuple[Array, Array, bool]:
        """Close and open conditions. Collective.

        It takes a product where a rigid support closes, and moves x there. One that opens leaves
        the residual as it is, which in its row was the reaction, and springs change it in their
        rows alone.

        Args:
            wrong: (m,) the conditions that change sides.
            x: padded; it is changed in place.
            residual: padded, at x; it is changed in place.

        Returns:
            x, its residual, and whether the set is a new one.
        """
        contact = self.contact
        moves = largest(self.comm, np.any(wrong & ~contact.closed & ~contact.soft))
        before = contact.spring_forces(x)
        contact.change(wrong)
        is_new = self.take_set()
        if moves:
            contact.place(x)
            return x, self.load - (self.operator @ x), is_new
        residual[contact.rows] += before - contact.spring_forces(x)
        return x, residual, is_new


def search_set(
    search: Search, cg: ConjugateGradients, x: Array, changes: int
) -> tuple[Array, Array, int, int]:
    """Search the contact set from x, by solves on one set after another. Collective.

    Args:
        search: the step.
        cg: conjugate gradients on its free unknowns.
        x: padded; it is changed in place.
        changes: number of changes of the set, at most.

    Returns:
        x, its residual, the number of changes, and the reason: SOLVED, or PETSc's for stopping, or
        WRONG_SIGNS when a set came twice or the set changed too often.
    """
    # Put what the predicted set holds onto its bounds; the residual there is the reaction.
    contact = search.contact
    count = 0  # changes of the set
    refinements = 0  # solves that began from a residual formed afresh
    contact.place(x)
    residual = search.form_first_residual(x)
    while True:
        # Solve on the present set, until that is done or a sign is wrong.
        x, residual, reason = cg.solve(residual, x, search.watch)
        if reason not in (SOLVED, WRONG_SIGNS):
            return x, residual, count, reason

        # A residual that is carried along drifts from the true one: form it afresh, go on from it.
        # The signs are then judged without allowance; those of an unfinished solve may be wrong by
        # as much as its residual.
        error = 0.0
        if reason == SOLVED:
            residual, fresh = search.form_residual(x)
            if not search.is_certain(fresh) and refinements < REFINEMENTS:
                refinements += 1
                continue
        else:
            error = largest_free(search.comm, residual, search.masked.weights)

        # Change the set where signs are wrong.
        wrong = search.wrong_signs(x, residual, error)
        if not largest(search.comm, np.any(wrong)):
            if reason == SOLVED:
                return x, residual, count, SOLVED
            continue
        if count == changes:
            return x, residual, count, WRONG_SIGNS
        count += 1
        x, residual, is_new = search.change(wrong, x, residual)
        if not is_new:
            return x, residual, count, WRONG_SIGNS
