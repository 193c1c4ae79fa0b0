"""Iterate over friction coefficients that depend on the slip rate of the step itself.

Problems with given coefficients are solved in turn.

    mu <- mu(|v|),    v = rate_factor w_t(mu)
    w_t(mu): slip of the step with the coefficients mu given                                    (1)

It starts from rest, mu(0), and every inner problem from the reactions of the one before. With the
mass m that a point slips with, (1) contracts with the factor c |mu'(v)|, c = r_n dt/m or, in a
velocity scheme, P_n/m. One point whose friction weakens with the rate converges for every dt: v(mu)
falls with mu, so that (1) climbs from rest to the smallest rate that solves the step, which is no
rate at all as long as the point can stick. For c |mu'| > 1 there may be other solutions, and
extrapolation, which begins after four plain steps, might end in one. Friction that grows with the
rate has one solution, but plain iterations need c mu' < 1; beyond that Anderson's method takes
over, a secant method for one point.

All this goes on inside of one linear step, on the small problem of its contact points: passes of
whole steps (``solvers.passes``) would ask for the factor of the body each time, which costs three
times as much with 2e4 unknowns. The certificate of the step does not know of it: it asks the law
itself at the slip rates of the answer.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Annotated, Any

import numpy as np

from ...core.algebra import Array, max_abs
from ...core.arguments import check_fields
from ...core.collective import ask_slope
from ...core.errors import StepFailure
from ...core.protocols import FrictionLaw
from ...core.quantities import Positive
from ...core.step import StepProblem
from .extrapolation import Anderson, Extrapolation, check_extrapolation


@dataclass(frozen=True)
class RateIteration:
    """Hold the settings of the iteration over coefficients.

    In the result ``iterations`` counts those of all inner problems, and ``history`` is the change
    of the coefficients in each iteration.

    Attributes:
        tolerance: change of the coefficients over the largest.
        max_iterations: number of inner problems, at most.
        extrapolation: how the next coefficients follow.
    """

    tolerance: Annotated[float, Positive] = 1e-12
    max_iterations: Annotated[int, Positive] = 200
    extrapolation: Extrapolation = field(default_factory=lambda: Anderson(depth=5, after=4))

    def __post_init__(self) -> None:
        check_extrapolation("RateIteration", self.extrapolation)
        check_fields(self)

    def solve(
        self,
        step: StepProblem,
        rest: FrictionLaw,
        mu: Array,
        solve_given: Callable[[Array, Any], Any],
        slip_of: Callable[[Any], Array],
    ) -> Any:
        """Iterate over the coefficients. A law without rates is solved for once. Collective.

        Args:
            step: the step.
            rest: its law at rest.
            mu: coefficients of all conditions under this law, to begin with.
            solve_given: solves the problem of given coefficients, and begins from the last answer,
                None at first.
            slip_of: makes B_t x - slip0 (m, d - 1) of this rank from an answer.

        Returns:
            The last answer of ``solve_given``.

        Raises:
            StepFailure: the tolerance is not reached.
        """
        if rest is step.friction:
            return solve_given(mu, None)
        surface = step.surface
        choose_next = self.extrapolation.start()
        iterations = 0
        history: list[float] = []
        answer = None
        while len(history) < self.max_iterations:
            answer = solve_given(mu, answer)
            iterations += answer.iterations
            law = step.friction_at(slip_of(answer))
            new = np.asarray(surface.everywhere(ask_slope(law, surface.weights)))
            size = max(max_abs(new), max_abs(mu))
            history.append(max_abs(new - mu) / size if size else 0.0)
            if history[-1] <= self.tolerance:
                return replace(answer, iterations=iterations, history=tuple(history))
            mu = np.maximum(choose_next(mu, new), 0.0)
        raise StepFailure(
            f"{self} stopped with a change of {history[-1] if history else np.inf:.1e} of the "
            "friction coefficients: take a smaller time step, or let mu(v) vary less with the slip "
            "rate"
        )
