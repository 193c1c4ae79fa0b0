"""Make the passes of a step with a joint on its contact unknowns alone.

A pass changes forces at contact unknowns only. With G and the free motion of the base step (a
forward substitution, made once), the free motion under further forces p there is

    x_c = (A⁻¹b)_c + G p

so a pass costs the small problem, and the last one a backward substitution more. ``JointSolver``
uses it where the solver is ``Condensed``. All arrays here are those of all ranks, on every rank.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import lapack

from ..core.algebra import Array, Mask
from ..core.step import StepProblem, StepResult
from ..core.surfaces import ContactSurface
from ..kernels.condensation import Condensation


@dataclass(frozen=True)
class PassEnd:
    """Hold where a pass has led, a row for each of the M conditions of all ranks.

    Attributes:
        gap: what is left of the gap (M,) [m].
        slip: of the step (M, d - 1) [m], zero where a point sticks.
        r: reactions (M, d) of r', ``scale`` times newtons.
        closed: (M,).
        sticks: (M,) closed points that do not slip.
        held: (M d,) which contact unknowns are held.
        values: (M d,) where.
        iterations: of the small problem.
    """

    gap: Array
    slip: Array
    r: Array
    closed: Mask
    sticks: Mask
    held: Mask
    values: Array
    iterations: int


class CondensedPasses:
    """Solve steps that differ in their forces at contact unknowns from a base step.

    Attributes:
        surface: the contact conditions.
        flexibility: G, with the compliance of the support.
        width: d, or 1 without friction: contact unknowns of a condition.
    """

    def __init__(
        self,
        condensed: Condensation,
        small: Callable[[StepProblem, Array, Array | None], Any],
        flexibility: Array,
        compliance: Array,
        surface: ContactSurface,
        name: str,
    ) -> None:
        """Hold A condensed.

        Args:
            condensed: A, condensed onto the contact unknowns.
            small: (step, free motion, reactions to begin with) -> (r, gap and minus slip, closed,
                sticks, held, values, iterations) of all ranks.
            flexibility: G, with the compliance.
            compliance: of the contact unknowns, over the scale.
            surface: the contact conditions.
            name: of the method.
        """
        self._condensed = condensed
        self._small = small
        self.flexibility = flexibility
        self._compliance = compliance
        self.surface = surface
        self._name = name
        self.width = len(compliance) // max(surface.total, 1)
        self._free = np.zeros(0)

    @cached_property
    def stiffness(self) -> Array | None:
        """Return G⁻¹; None where it is not positive definite to rounding."""
        factor, info = lapack.dpotrf(self.flexibility, lower=1)
        if info:
            return None
        inverse, info = lapack.dpotri(factor, lower=1)
        return None if info else np.tril(inverse) + np.tril(inverse, -1).T

    def begin(self, base: StepProblem) -> None:
        """Find the free motion of a step. Collective."""
        self._free = self._condensed.find_free_motion(base.b)

    def make(self, step: StepProblem, push: Array, before: PassEnd | None = None) -> PassEnd:
        """Return where a step leads whose loads are those of the base and a push. Collective.

        Args:
            step: with its own bound and friction.
            push: the further forces (M d,) at contact unknowns, ``scale`` times newtons.
            before: the pass before in this step, from which the search begins; None: the first.
        """
        near = None if before is None else before.r
        free = self._free + self.flexibility @ push - self._compliance * push
        r, moved, closed, sticks, held, values, iterations = self._small(step, free, near)
        slip = np.where(sticks[:, None], 0.0, -moved[:, 1:])
        return PassEnd(moved[:, 0], slip, r, closed, sticks, held, values, iterations)

    def finish(self, push: Array, end: PassEnd) -> StepResult:
        """Return the answer of the last pass, by a backward substitution. Collective.

        Args:
            push: its further forces (M d,).
            end: where it has led.
        """
        x = self._condensed.answer(end.r.ravel() - push, end.held, end.values)
        r = self.surface.mine(end.r)
        return StepResult(
            x,
            r_n=r[:, 0].copy(),
            active=self.surface.mine(end.closed),
            iterations=end.iterations,
            method=self._name,
            r_t=r[:, 1:].copy() if self.width > 1 else None,
        )
