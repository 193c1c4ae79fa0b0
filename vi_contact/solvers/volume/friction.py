"""Solve friction on the volume route.

Coulomb's law is a sequence of Tresca problems on all unknowns, by SNES.

    s <- cohesion + slope max(r_n(s), 0)

Every problem of given thresholds s is solved to round-off, as the mixed complementarity problem of
volume_friction_system.py; Tresca's law is one such problem. It shares nothing with the condensed
route but A, b and the extrapolation of thresholds; references: ``friction.fixed_point``. The first
problem of Coulomb's law is without friction, every other starts from the solution before, its
sliding points on their new thresholds, and then mostly costs one factorisation. A law that depends
on the slip rate makes this a sequence of such sequences: ``friction.slip_rate``.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.algebra import Array, Mask, max_abs
from ...core.collective import limit_of, slope_of
from ...core.errors import StepFailure
from ...core.step import StepProblem, StepResult
from ...laws.friction import project
from ..friction.extrapolation import Anderson
from ..friction.slip_rate import RateIteration
from .friction_system import FrictionUnknowns, ScaledFrictionStep

TOLERANCE = (
    1e-11  # change of the thresholds relative to the largest: the error of the friction cone
)
NOISE = 1e-10  # below this, changes that do not shrink are those of round-off
PROBLEMS = 200
EXTRAPOLATION = Anderson(depth=5, after=3)


@dataclass(frozen=True)
class Found:
    """Hold the solution of one problem or of a sequence.

    This is r_n (m,), slip (L,), 0 where points stick, and SNES iterations.
    """

    state: FrictionUnknowns
    r_n: Array
    active: Mask
    slip: Array
    iterations: int
    history: tuple[float, ...] = ()


class VolumeFriction:
    """Solve the step with friction of one A; ``driver`` is the PETSc solver of the scaled step."""

    def __init__(self, scaled: ScaledFrictionStep, driver: Any, name: str) -> None:
        self._scaled, self.driver, self._name = scaled, driver, name
        self._body, self._friction = scaled.system, scaled.friction

    def solve(self, step: StepProblem) -> StepResult:
        """Return the step.

        Raises:
            StepFailure: with PETSc's reason, or when the thresholds do not settle.
        """
        surface = self._body.surface
        rest = step.friction_at(np.zeros((surface.count, surface.tangents.shape[1])))
        cohesion = limit_of(rest, np.zeros(surface.count), surface.weights, step.scale)
        slope = surface.everywhere(slope_of(rest, surface.weights))

        def solved(mu: Array, before: Found | None) -> Found:
            return self._sequence(step, cohesion, mu[surface.slots], before)

        found = RateIteration().solve(
            step, rest, slope, solved, lambda found: self._friction.by_point(found.slip)
        )
        return self._result(step, found)

    def _sequence(
        self, step: StepProblem, cohesion: Array, slope: Array, before: Found | None
    ) -> Found:
        """Solve Coulomb's problem with a coefficient (m,) that is given.

        It begins from the solution of another one. The thresholds are those of all conditions:
        every rank extrapolates and judges them alike.
        """
        following, spent = EXTRAPOLATION.start(), 0
        history: list[float] = []
        surface = self._body.surface
        none, mine = np.zeros(surface.count), surface.slots
        limit = surface.everywhere(
            cohesion + slope * np.maximum(none if before is None else before.r_n, 0.0)
        )
        if before is None:
            start, spent = self._first(step, limit)
        else:
            start = self._scaled.moved(before.state, before.slip, limit[mine])
        while len(history) < PROBLEMS:
            found = self._tresca(step, limit[mine], start)
            spent += found.iterations
            new = surface.everywhere(cohesion + slope * np.maximum(found.r_n, 0.0))
            size = max(max_abs(new), max_abs(limit))
            change = max_abs(new - limit) / size if size else 0.0
            if change <= TOLERANCE or (change <= NOISE and history and change >= history[-1]):
                return Found(
                    found.state, found.r_n, found.active, found.slip, spent, tuple(history)
                )
            history.append(change)
            limit = np.maximum(following(limit, new), 0.0)
            start = self._scaled.moved(found.state, found.slip, limit[mine])
        raise StepFailure(
            f"{self._name} stopped after {PROBLEMS} Tresca problems with a change of "
            f"{history[-1]:.1e} of the friction thresholds: take a smaller step of time or load, "
            "or use Condensed()"
        )

    def _first(self, step: StepProblem, limit: Array) -> tuple[FrictionUnknowns, int]:
        """Return the guess, sliding as predicted, and no iterations.

        With disks it is the solution without friction, whose slip gives the directions that
        Newton's method needs.
        """
        friction, scaled, own = self._friction, self._scaled, limit[self._body.surface.slots]
        state = FrictionUnknowns(
            self._body.start(step), np.zeros(len(friction.tangent)), np.zeros(len(friction.pairs))
        )
        if not (friction.any_disk and limit.any()):
            return scaled.moved(state, state.z[friction.tangent] - friction.origin(step), own), 0
        free = self._tresca(step, np.zeros_like(own), state)
        return scaled.moved(free.state, free.slip, own), free.iterations

    def _tresca(self, step: StepProblem, limit: Array, start: FrictionUnknowns) -> Found:
        """Solve the problem with thresholds (m,)."""
        scaled = self._scaled
        scaled.set_friction(step, limit, start)
        y, active, r_n, iterations = scaled.answer(self.driver, self._name)
        state = scaled.physical(y)
        return Found(state, r_n, active, scaled.slip(state.z, scaled.sliding(y)), iterations)

    def _result(self, step: StepProblem, found: Found) -> StepResult:
        """Return x, with sticking points put exactly where they were, and r_t.

        r_t is within the last digit of its disk.
        """
        surface, friction = self._body.surface, self._friction
        law = step.friction_at(friction.by_point(found.slip))
        limit = limit_of(law, found.r_n, surface.weights, step.scale)
        x = found.state.z[: self._body.rows]
        stick = (found.slip == 0.0) & (limit > 0.0)[friction.point]
        x[friction.tangent[stick]] = friction.origin(step)[stick]
        r_t = project(friction.by_point(found.state.reaction), limit)
        return StepResult(
            x, found.r_n, found.active, found.iterations, self._name, r_t=r_t, history=found.history
        )
