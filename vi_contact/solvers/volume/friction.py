"""Solve friction on the volume route: a sequence of Tresca problems on all unknowns, by SNES.

    s <- cohesion + slope max(r_n(s), 0)

Every problem of given thresholds s is solved to round-off, as the mixed complementarity problem of
friction_system.py; Tresca's law is one such problem. It shares nothing with the condensed
route but A, b and the extrapolation of thresholds; references: ``friction.fixed_point``. The first
problem of Coulomb's law is without friction, every other starts from the solution before, its
sliding points on their new thresholds, and then mostly costs one factorisation. A law that depends
on the slip rate makes this a sequence of such sequences: ``friction.slip_rate``.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.algebra import Array, Mask, max_abs
from ...core.collective import ask_limit, ask_slope
from ...core.errors import StepFailure
from ...core.step import StepProblem, StepResult
from ...laws.friction import project
from ..friction.extrapolation import Anderson
from ..friction.slip_rate import RateIteration
from .friction_system import FrictionUnknowns, ScaledFrictionStep

TOLERANCE = 1e-11  # change of the thresholds over the largest: the error of the friction cone
NOISE = 1e-10  # below this, changes that do not shrink are those of round-off
PROBLEMS = 200
EXTRAPOLATION = Anderson(depth=5, after=3)


@dataclass(frozen=True)
class Solution:
    """Hold the solution of one problem or of a sequence.

    Attributes:
        state: the unknowns.
        r_n: (m,) normal reactions.
        active: (m,) which conditions are closed.
        slip: (L,) zero where points stick.
        iterations: of SNES.
        history: relative change of the thresholds in each problem of a sequence.
    """

    state: FrictionUnknowns
    r_n: Array
    active: Mask
    slip: Array
    iterations: int
    history: tuple[float, ...] = ()


class VolumeFriction:
    """Solve steps with friction of one A.

    Attributes:
        driver: of the PETSc solver of the scaled step.
    """

    def __init__(self, scaled: ScaledFrictionStep, driver: Any, name: str) -> None:
        """Take the parts of the solver.

        Args:
            scaled: evaluates a step.
            driver: of the PETSc solver.
            name: of the route, for messages.
        """
        self._scaled = scaled
        self.driver = driver
        self._name = name
        self._body = scaled.system
        self._friction = scaled.friction

    def solve(self, step: StepProblem) -> StepResult:
        """Return the answer to a step. Collective.

        Raises:
            StepFailure: with PETSc's reason, or when the thresholds do not settle.
        """
        surface = self._body.surface
        rest = step.friction_at(np.zeros((surface.count, surface.tangents.shape[1])))
        cohesion = ask_limit(rest, np.zeros(surface.count), surface.weights, step.scale)
        slope = surface.everywhere(ask_slope(rest, surface.weights))

        def solve(mu: Array, before: Solution | None) -> Solution:
            """Solve the step with the coefficients mu of all conditions."""
            return self._solve_sequence(step, cohesion, mu[surface.slots], before)

        def slip_of(solution: Solution) -> Array:
            """Return the slip of the conditions of this rank."""
            return self._friction.by_point(solution.slip)

        solution = RateIteration().solve(step, rest, slope, solve, slip_of)
        return self._make_result(step, solution)

    def _solve_sequence(
        self, step: StepProblem, cohesion: Array, slope: Array, before: Solution | None
    ) -> Solution:
        """Solve Coulomb's problem with given coefficients. Collective.

        Args:
            step: the step.
            cohesion: (m,) [as r_t].
            slope: (m,) coefficients.
            before: the solution with other coefficients, to begin from.

        Raises:
            StepFailure: a problem has no solution, or the thresholds do not settle.
        """
        # Thresholds are those of all conditions: every rank extrapolates and judges them alike.
        surface = self._body.surface
        mine = surface.slots
        r_n = np.zeros(surface.count) if before is None else before.r_n
        limit = surface.everywhere(cohesion + slope * np.maximum(r_n, 0.0))
        if before is None:
            start, iterations = self._find_start(step, limit)
        else:
            start = self._scaled.fit_to_limits(before.state, before.slip, limit[mine])
            iterations = 0

        choose_next = EXTRAPOLATION.start()
        history: list[float] = []
        while len(history) < PROBLEMS:
            solution = self._solve_tresca(step, limit[mine], start)
            iterations += solution.iterations
            new = surface.everywhere(cohesion + slope * np.maximum(solution.r_n, 0.0))
            size = max(max_abs(new), max_abs(limit))
            change = max_abs(new - limit) / size if size else 0.0
            is_noise = change <= NOISE and len(history) > 0 and change >= history[-1]
            if change <= TOLERANCE or is_noise:
                return replace(solution, iterations=iterations, history=tuple(history))
            history.append(change)
            limit = np.maximum(choose_next(limit, new), 0.0)
            start = self._scaled.fit_to_limits(solution.state, solution.slip, limit[mine])
        raise StepFailure(
            f"{self._name} stopped after {PROBLEMS} Tresca problems with a change of "
            f"{history[-1]:.1e} of the friction thresholds: take a smaller step of time or load, "
            "or use Condensed()"
        )

    def _find_start(self, step: StepProblem, limit: Array) -> tuple[FrictionUnknowns, int]:
        """Return where to begin, and the iterations that it took. Collective.

        It is the guess, sliding as predicted. With disks it is the solution without friction, whose
        slip gives the directions that Newton's method needs.

        Args:
            step: the step.
            limit: thresholds of all conditions [as r_t].
        """
        friction = self._friction
        scaled = self._scaled
        own = limit[self._body.surface.slots]
        state = FrictionUnknowns(
            z=self._body.start(step),
            reaction=np.zeros(len(friction.tangent)),
            gamma=np.zeros(len(friction.pairs)),
        )
        if not (friction.any_disk and limit.any()):
            slip = state.z[friction.tangent] - friction.origin(step)
            return scaled.fit_to_limits(state, slip, own), 0
        free = self._solve_tresca(step, np.zeros_like(own), state)
        return scaled.fit_to_limits(free.state, free.slip, own), free.iterations

    def _solve_tresca(self, step: StepProblem, limit: Array, start: FrictionUnknowns) -> Solution:
        """Solve the problem with given thresholds. Collective.

        Args:
            step: the step.
            limit: (m,) thresholds [as r_t].
            start: where to begin.
        """
        scaled = self._scaled
        scaled.set_friction(step, limit, start)
        y, active, r_n, iterations = scaled.answer(self.driver, self._name)
        state = scaled.physical(y)
        slip = scaled.slip(state.z, scaled.sliding(y))
        return Solution(state, r_n, active, slip, iterations)

    def _make_result(self, step: StepProblem, solution: Solution) -> StepResult:
        """Return the answer: points that stick are exactly where they were, r_t is on its disk."""
        surface = self._body.surface
        friction = self._friction
        law = step.friction_at(friction.by_point(solution.slip))
        limit = ask_limit(law, solution.r_n, surface.weights, step.scale)
        x = solution.state.z[: self._body.rows]
        stick = (solution.slip == 0.0) & (limit > 0.0)[friction.point]
        x[friction.tangent[stick]] = friction.origin(step)[stick]
        return StepResult(
            x,
            r_n=solution.r_n,
            active=solution.active,
            iterations=solution.iterations,
            method=self._name,
            r_t=project(friction.by_point(solution.state.reaction), limit),
            history=solution.history,
        )
