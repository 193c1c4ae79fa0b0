"""Measure an iterate as the certificate of the step will (``core.verify``).

It takes reductions of a few numbers.
"""

from dataclasses import dataclass

import numpy as np

from ...core.algebra import Array, Comm, max_abs
from ...core.step import StepProblem
from ...core.verify import ROUNDING
from .contact import Contact

# of the tolerance: estimates may be wrong, and the carried residual is not the one formed afresh
GOAL = 0.5
HALVED = 0.5  # of the residual, at least, between two answers that are compared
LEAST = 3e-4  # of the forces: reactions below are not asked for to so many digits
ROUND_OFF = 1e-15  # of |A||x| and of the forces: what a residual cannot fall below


@dataclass(frozen=True)
class Measures:
    """Hold what residuals are relative to: forces, reactions, displacements; and their round-off.

    Maxima over ranks.
    """

    force: float
    reaction: float
    displacement: float
    round_off: float


class Measured:
    """Measure the iterates of one step. ``load``: b, padded."""

    def __init__(self, step: StepProblem, load: Array) -> None:
        self._comm: Comm = step.surface.comm
        self._largest = step.A.largest
        self._b, self._guess = max_abs(load), max_abs(step.guess)

    def __call__(self, contact: Contact, x: Array, residual: Array, load: Array) -> Measures:
        """Return the references at x, where ``residual`` is ``load`` - (A + K_s) x. Collective."""
        local = np.array(
            [
                self._b,
                contact.body_forces(x, residual, load),
                max_abs(x),
                self._guess,
                max_abs(contact.reactions(x, residual)),
            ]
        )
        b, Ax, size, guess, reaction = self._comm.max(np.where(np.isnan(local), np.inf, local))
        whole = self._largest * size
        force = max(b, Ax, ROUNDING * whole)
        return Measures(force, max(b, reaction), max(size, guess), ROUND_OFF * max(whole, force))


class Worth:
    """Estimate how small a residual has to be for the accuracy that is asked for.

    x and reactions are to be known to ``tolerance`` of the largest so far. It is estimated from
    what they changed by since it was larger. What the last step showed of the conditioning is kept.
    """

    def __init__(self, comm: Comm, parts: int, tolerance: float) -> None:
        self._comm, self._goal = comm, GOAL * tolerance
        self._per_norm = self._sizes = self._largest = np.zeros(parts)
        self._seen: tuple[float, list[Array]] = (0.0, [])

    def keep(self) -> None:
        """Keep the last answer: it is one of a step."""
        self._largest = np.maximum(self._largest, self._sizes)

    def goal(self, norm: float, of: Measures, *answer: Array, begin: bool) -> float:
        """Return the residual to stop at.

        It is what x and reactions need, but for round-off, or a share of the tolerance. ``norm``:
        the present one; ``begin``: there is no larger one to compare with. Collective.
        """
        last, seen = self._seen
        if begin or norm <= HALVED * last:
            changes = [] if begin else [one - old for one, old in zip(answer, seen, strict=True)]
            largest = self._comm.max(np.array([max_abs(one) for one in (*answer, *changes)]))
            self._seen = norm, [np.array(one) for one in answer]
            self._sizes = largest[: len(answer)]
            if not begin:
                self._per_norm = largest[len(answer) :] / last
        least = [of.displacement, *[LEAST * of.force] * (len(answer) - 1)]
        wanted = np.maximum(np.maximum(self._sizes, self._largest), least)
        moved = self._per_norm > 0.0
        needed = np.min(wanted[moved] / self._per_norm[moved], initial=np.inf)
        return float(min(self._goal * of.force, max(self._goal * needed, of.round_off)))


def largest_free(comm: Comm, residual: Array, weights: Array) -> float:
    """Return the largest residual of the unknowns that are not held. Collective.

    It is infinite where it is not a number.
    """
    value = max_abs(np.where(weights > 0.0, residual, 0.0))
    return float(comm.max(np.array([np.inf if np.isnan(value) else value]))[0])
