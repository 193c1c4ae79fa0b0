"""Make passes until an answer is certified: the one loop around linear steps.

A *pass* solves a linear step about where the passes before have led, with the conditions of contact
and the law of friction as they are, and is judged by the equations as they are. Whoever has such
equations writes a generator that yields its passes, each after a look at what they have shown so
far (``Passes``); this file alone says when to stop:

- below the goal, at once;
- below the tolerance, when passes bring no more digits;
- never above the tolerance, but when there is no other pass, or too many have been made.

A linear step is certified by its first pass, which needs no loop. The others, and what their
passes are:

========================  =========================================================================
``certified``             what an answer of a linear step leaves over, where that is near the
                          tolerance (``correction``)
``nonlinear``             Newton's method, modified and accelerated, for bodies with forces of their
                          own
``run.proximal``          static stages of bodies on weak springs to where they are
``vi.newton``             Newton's method for inequalities of a user's own forms
========================  =========================================================================
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Generic, Protocol, TypeVar

import numpy as np

from ..core.algebra import Array, EffectiveMatrix, Mask
from ..core.certificate import Certificate
from ..core.step import StepProblem, StepResult

SETTLED = 0.5  # of the residual before: a pass that gains less brings no more digits


class Pass(Protocol):
    """Hold where a pass has led."""

    @property
    def worst(self) -> float:
        """Return the largest residual there of the equations as they are, infinite for none."""


@dataclass(frozen=True)
class Certified:
    """Hold an answer with its certificate.

    Attributes:
        result: the answer.
        certificate: of the equations as they are; of whoever hands it out it is below the
            tolerance.
        escalated: whether it is by a method that was escalated to.
    """

    result: StepResult
    certificate: Certificate
    escalated: bool

    @property
    def worst(self) -> float:
        """Return the largest residual."""
        return self.certificate.worst


P = TypeVar("P", bound=Pass)


@dataclass(kw_only=True)
class Passes(Generic[P]):
    """Hold what the passes to one answer have shown.

    Attributes:
        tolerance: the largest residual of an answer.
        goal: the residual that needs no further pass.
        patience: how many passes running may be in vain below the tolerance.
        best: the pass with the smallest residual; None before the first one. It may be given, as
            where the passes start, and then counts for none.
        least: the smallest residual.
        rate: that of the best pass over the one before; 1 where nothing is known of it.
        vain: how many passes running have gained too little.
        count: how many passes have been made.
    """

    tolerance: float
    goal: float
    patience: int = 1
    best: P | None = None
    least: float = np.inf
    rate: float = 1.0
    vain: int = 0
    count: int = 0

    def __post_init__(self) -> None:
        if self.best is not None:
            self.least = self.best.worst

    @property
    def is_certified(self) -> bool:
        """Say whether the smallest residual is below the tolerance."""
        return self.least <= self.tolerance

    def is_better(self, there: P) -> bool:
        """Say whether a pass is better than the best so far."""
        return there.worst < self.least

    def gains(self, there: P) -> bool:
        """Say whether a pass brings more digits."""
        return there.worst <= SETTLED * self.least

    def take(self, there: P) -> None:
        """Take a pass into account."""
        self.vain = 0 if self.gains(there) else self.vain + 1
        if self.is_better(there):
            self.rate = there.worst / self.least if 0.0 < self.least < np.inf else 1.0
            self.best = there
        self.least = min(there.worst, self.least)
        self.count += 1


def certify(passes: Passes[P], road: Iterator[P], most: int) -> bool:
    """Make passes until the best one is the answer, and say whether it is certified. Collective.

    Args:
        passes: what they have shown; one may be there already.
        road: makes the next pass, and ends where there is no other.
        most: number of passes.
    """
    last = passes.count + most
    while passes.count < last:
        is_settled = passes.is_certified and passes.vain >= passes.patience
        if passes.least <= passes.goal or is_settled:
            break
        there = next(road, None)
        if there is None:
            break
        passes.take(there)
    return passes.is_certified


def pose_about(
    step: StepProblem, x: Array, b: Array, active: Mask, A: EffectiveMatrix | None = None
) -> StepProblem:
    """Return the linear step for what is missing at x, with the conditions on x + d.

    Args:
        step: the step.
        x: where the pass begins (n,).
        b: what is left of the forces there (n,), in the unit of the step.
        active: predicted contact set (m,).
        A: of the pass; None: that of the step.
    """
    surface = step.surface
    slip0 = step.slip0
    if slip0 is not None:
        slip0 = slip0 - surface.tangential_values(x)
    return replace(
        step,
        A=step.A if A is None else A,
        b=b,
        bound=step.bound - surface.normal_values(x),
        guess=np.zeros_like(x),
        active=active,
        slip0=slip0,
        origin=x if step.origin is None else step.origin + x,
        forces=None,
    )
