"""Solve contact with friction by semismooth Newton: the default. In 2D it is an active-set method and ends exactly.

With y = r - w of the last iterate every node is open (y_n <= 0) or closed, and sticks (|y_t| <= limit) or slips along
n = y_t/|y_t|. The next iterate solves the linear problem of these states, Newton's step for the natural map (2) of
``problem`` with the limit of the augmented reaction max(y_n, 0) (Alart and Curnier 1991; Hüeber, Stadler and
Wohlmuth, SIAM J. Sci. Comput. 30, 2008):

    open   r_n = 0                        closed   w_n = 0
    stick  w_t = 0                        slip     r_t = limit(r_n) n + eta t,   t·w_t + (|y_t| - limit)/limit eta = 0

eta is the turn of the slip direction, t perpendicular to n: in 2D there is none, the problem is piecewise linear, and
the iterate of the right states is exact. friction_linear.py solves these problems.

Slip that turned back within one iteration overshot: such a node sticks in the next, which ends the usual cycles of
slip to and fro. Where Newton cycles all the same, Gauss-Seidel sweeps (nsgs.py) lead to a better start.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from ...core.algebra import Array, Mask
from ...core.checks import attributes
from .linear import Factors, LinearProblems
from .nsgs import sweeps
from .problem import FrictionResult, ScaledDelassus, ScaledProblem

ATTEMPTS = 10  # of Newton, with twice the sweeps before each
FIRST_SWEEPS = 2


@dataclass(frozen=True)
class FrictionNewton:
    """Hold the settings. ``tolerance``: residual above which the answer is refused; ``max_iterations`` of Newton in a
    row.

    In the result ``iterations`` counts linear solves and fallback sweeps (0: no contact), ``history`` the residual
    after each linear solve.
    """

    carries_friction: ClassVar[bool] = True
    tolerance: float = 1e-11
    max_iterations: int = 30

    def __post_init__(self) -> None:
        attributes(self, positive=("tolerance",), counts=("max_iterations",))

    def prepare(self, G: Array, bilateral: Mask) -> PreparedNewton:
        """Check and scale G (m d, m d)."""
        return PreparedNewton(self, G, bilateral)


class PreparedNewton:
    """Solve for one G and many right-hand sides. The answer depends on these alone, not on steps before."""

    def __init__(self, method: FrictionNewton, G: Array, bilateral: Mask) -> None:
        self.method = method
        self.delassus = ScaledDelassus(G, bilateral)
        self._factors = Factors(self.delassus.matrix)

    def solve(self, q: Array, cohesion: Array, slope: Array, guess: Array | Mask | None = None) -> FrictionResult:
        """Solve the small problem; see PreparedFriction."""
        step = self.delassus.problem(q, cohesion, slope)
        history: list[float] = []
        r, swept = step.start(guess if step.unit > 0.0 else None), 0
        w = step.w(r)
        for attempt in range(ATTEMPTS if step.unit > 0.0 else 0):
            r, w, done = self._newton(step, r - w, history)
            if done or attempt == ATTEMPTS - 1:
                break
            number = FIRST_SWEEPS * 2**attempt
            r, swept = sweeps(step, step.admissible(r), number), swept + number
            w = step.w(r)
        return step.result(
            r,
            w=w,
            iterations=len(history) + swept,
            method=self.method,
            tolerance=self.method.tolerance,
            history=tuple(history),
        )

    def _newton(self, step: ScaledProblem, y: Array, history: list[float]) -> tuple[Array, Array, bool]:
        """The best iterate r with its w, and whether it solves the problem to rounding or to the tolerance."""
        best, smallest = (np.zeros_like(y), step.q), step.unit
        linear = LinearProblems(self._factors)
        states: _States | None = None
        for _ in range(self.method.max_iterations):
            states = _States(step, y, states)
            r = linear.solve(states, step.w(states.fixed))
            if r is None:
                break
            w = step.w(r)
            residual = step.residual(r, w)
            history.append(residual / step.unit)
            if residual < smallest:
                best, smallest = (r, w), residual
            if residual <= step.rounding(r):
                return r, w, True
            y = r - w
        return *best, smallest <= self.method.tolerance * step.unit


class _States:
    """The states of all nodes at y; a node that turned back since ``before`` sticks first.

    See NodeStates for the attributes.
    """

    def __init__(self, step: ScaledProblem, y: Array, before: _States | None) -> None:
        m, d = y.shape
        limit = step.limit(y[:, 0])
        size = np.linalg.norm(y[:, 1:], axis=1)
        self.closed: Mask = (y[:, 0] > 0.0) | step.delassus.bilateral
        back = np.zeros(m, dtype=bool) if before is None else np.sum(before.direction * y[:, 1:], axis=1) < 0.0
        self.stick: Mask = ((size <= limit) | back) & (limit > 0.0)
        slip = ~self.stick & (limit > 0.0)
        self.direction: Array = np.zeros((m, d - 1))
        np.divide(y[:, 1:], size[:, None], out=self.direction, where=slip[:, None])
        self.growth = np.where(slip & (y[:, 0] > 0.0), step.slope, 0.0)
        self.turns: Mask = slip if d == 3 else np.zeros(m, dtype=bool)
        self.exact = not self.turns.any()
        self.turning = size[self.turns] / limit[self.turns] - 1.0
        self.fixed = np.column_stack([np.zeros(m), np.where(slip, step.cohesion, 0.0)[:, None] * self.direction])
        self.key = b"".join(part.tobytes() for part in (self.closed, self.stick, self.direction, self.growth))
