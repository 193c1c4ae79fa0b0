"""Measure an iterate as the certificate of the step will (``core.verify``).

A residual is small or large only beside the forces of the step, a displacement beside the largest
one. ``StepMeasure`` gives these references at an iterate, ``Worth`` the residual below which a
better one is not worth its products. Each costs a reduction of a few numbers.
"""

from dataclasses import dataclass

import numpy as np

from ...core.algebra import Array, Comm, max_abs
from ...core.step import StepProblem
from ...core.verify import ROUNDING
from .contact import ClosedSet

# of the tolerance: estimates may be wrong, and the carried residual is not the one formed afresh
GOAL = 0.5
HALVED = 0.5  # of the residual, at least, between two answers that are compared
LEAST = 3e-4  # of the forces: reactions below are not asked for to so many digits
ROUND_OFF = 1e-15  # of |A||x| and of the forces: what a residual cannot fall below


@dataclass(frozen=True)
class Measures:
    """Hold what residuals are relative to; maxima over ranks.

    Attributes:
        force: the largest of b and A x.
        reaction: the largest of b and the reactions.
        displacement: the largest of x and the guess.
        round_off: residual that rounding leaves.
    """

    force: float
    reaction: float
    displacement: float
    round_off: float


class StepMeasure:
    """Measure the iterates of one step."""

    def __init__(self, step: StepProblem, load: Array) -> None:
        """Note what all iterates share; ``load`` is b, padded."""
        self._comm: Comm = step.surface.comm
        self._largest_entry = step.A.largest
        self._b = max_abs(load)
        if step.internal is not None:
            self._b = max(self._b, max_abs(step.internal))
        self._guess = max_abs(step.start)
        self._is_increment = step.origin is not None

    def __call__(self, contact: ClosedSet, x: Array, residual: Array, load: Array) -> Measures:
        """Return the references at x. Collective.

        Args:
            contact: the closed set.
            x: padded.
            residual: ``load`` - (A + K_s) x.
            load: b with the load of closed springs, padded.
        """
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
        length = max(size, guess)

        # The references of the certificate; rounding of A x is that of x alone, which may be an
        # increment that is small beside the displacements.
        entries = self._largest_entry * size
        of_certificate = self._largest_entry * length if self._is_increment else entries
        force = max(b, Ax, ROUNDING * of_certificate)
        return Measures(force, max(b, reaction), length, ROUND_OFF * max(entries, force))


class Worth:
    """Estimate how small a residual has to be for the accuracy that is asked for.

    x and reactions are to be known to ``tolerance`` of the largest so far. An iterate with the
    residual rho was wrong in a part p of the answer by about |p_new - p|, where p_new has at most
    half of this residual. The residual to come to is then

        tolerance · min over the parts of  size(p) rho / |p_new - p|

    What the last step showed of the conditioning is kept.
    """

    def __init__(self, comm: Comm, parts: int, tolerance: float) -> None:
        """Begin without knowledge.

        Args:
            comm: of the contact surface.
            parts: number of arrays of an answer: x, r_n and with friction r_t.
            tolerance: relative error that an answer may have.
        """
        self._comm = comm
        self._goal = GOAL * tolerance
        self._per_norm = np.zeros(parts)  # change of an array over the residual that it came with
        self._sizes = np.zeros(parts)  # of the present answer
        self._largest = np.zeros(parts)  # of the answers before
        self._seen: tuple[float, list[Array]] = (0.0, [])

    def keep(self) -> None:
        """Keep the last answer: it is one of a step."""
        self._largest = np.maximum(self._largest, self._sizes)

    def goal(self, norm: float, scales: Measures, *answer: Array, begin: bool) -> float:
        """Return the residual to stop at. Collective.

        It is what x and reactions need, but for round-off, or a share of the tolerance.

        Args:
            norm: the present residual.
            scales: what residuals are relative to.
            *answer: x, r_n and with friction r_t.
            begin: whether there is no larger residual to compare with.
        """
        # Compare with the last answer whose residual was at least twice as large.
        norm_before, answer_before = self._seen
        if begin or norm <= HALVED * norm_before:
            changes = []
            if not begin:
                changes = [new - old for new, old in zip(answer, answer_before, strict=True)]
            largest = self._comm.max(np.array([max_abs(part) for part in (*answer, *changes)]))
            self._seen = norm, [np.array(part) for part in answer]
            self._sizes = largest[: len(answer)]
            if not begin:
                self._per_norm = largest[len(answer) :] / norm_before

        # Each part may change by the tolerance of its size; the residual that brings this about.
        least = [scales.displacement, *[LEAST * scales.force] * (len(answer) - 1)]
        wanted = np.maximum(np.maximum(self._sizes, self._largest), least)
        moved = self._per_norm > 0.0
        needed = np.min(wanted[moved] / self._per_norm[moved], initial=np.inf)
        return float(min(self._goal * scales.force, max(self._goal * needed, scales.round_off)))


def largest_free(comm: Comm, residual: Array, weights: Array) -> float:
    """Return the largest residual of the unknowns that are not held. Collective.

    Args:
        comm: of the contact surface.
        residual: padded.
        weights: padded, zero where held.

    Returns:
        The residual; infinite where one is not a number.
    """
    value = max_abs(np.where(weights > 0.0, residual, 0.0))
    return float(comm.max(np.array([np.inf if np.isnan(value) else value]))[0])
