"""Iterate over friction coefficients that depend on the slip rate.

The rate is that of the step itself; ordinary problems are solved in turn.

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
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Annotated, Any

import numpy as np

from ...core.algebra import Array, max_abs
from ...core.arguments import check_fields
from ...core.collective import slope_of
from ...core.errors import StepFailure
from ...core.protocols import FrictionLaw
from ...core.quantities import Positive
from ...core.step import StepProblem
from .extrapolation import Anderson, Extrapolation, accelerated


@dataclass(frozen=True)
class RateIteration:
    """Hold the settings.

    ``tolerance``: change of coefficients over the largest; ``extrapolation``: the next guess.

    ``iterations`` of the result counts those of all inner problems, ``history`` is the change in
    each iteration.
    """

    tolerance: Annotated[float, Positive] = 1e-12
    max_iterations: Annotated[int, Positive] = 200
    extrapolation: Extrapolation = field(default_factory=lambda: Anderson(depth=5, after=4))

    def __post_init__(self) -> None:
        accelerated("RateIteration", self.extrapolation)
        check_fields(self)

    def solve(
        self,
        step: StepProblem,
        rest: FrictionLaw,
        mu: Array,
        solved: Callable[[Array, Any], Any],
        slip: Callable[[Any], Array],
    ) -> Any:
        """Iterate from mu, the coefficients under the law at ``rest``.

        They are those of all conditions. A law without rates is solved for once.

        ``solved``: the problem of given coefficients, starting from the last result, None at first;
        ``slip``: that of a result, B_t x - slip0 (m, d - 1) of this rank. StepFailure when the
        tolerance is not reached. Collective.
        """
        if rest is step.friction:
            return solved(mu, None)
        following, spent, surface = self.extrapolation.start(), 0, step.surface
        history: list[float] = []
        found = None
        while len(history) < self.max_iterations:
            found = solved(mu, found)
            spent += found.iterations
            new = np.asarray(
                surface.everywhere(slope_of(step.friction_at(slip(found)), surface.weights))
            )
            size = max(max_abs(new), max_abs(mu))
            history.append(max_abs(new - mu) / size if size else 0.0)
            if history[-1] <= self.tolerance:
                return replace(found, iterations=spent, history=tuple(history))
            mu = np.maximum(following(mu, new), 0.0)
        raise StepFailure(
            f"{self} stopped with a change of {history[-1] if history else np.inf:.1e} of the "
            "friction coefficients: take a smaller time step, or let mu(v) vary less with the slip "
            "rate"
        )
