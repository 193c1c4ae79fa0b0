"""Solve contact with friction by semismooth Newton: the default.

In 2D it is an active-set method and ends exactly.

With y = r - w of the last iterate every node is open (y_n <= 0) or closed, and sticks (|y_t| <=
limit) or slips along n = y_t/|y_t|. The next iterate solves the linear problem of these states,
Newton's step for the natural map (2) of ``problem`` with the limit of the augmented reaction
max(y_n, 0) (Alart and Curnier 1991; Hüeber, Stadler and Wohlmuth, SIAM J. Sci. Comput. 30, 2008):

    open   r_n = 0                        closed   w_n = 0
    stick  w_t = 0                        slip     r_t = limit(r_n) n + eta t
                                                   t·w_t + (|y_t| - limit)/limit eta = 0

eta is the turn of the slip direction, t perpendicular to n: in 2D there is none, the problem is
piecewise linear, and the iterate of the right states is exact. linear.py solves these problems.

Compiled Gauss-Seidel sweeps go before, in single precision. In 2D they alternate between G, whose
sweeps damp the long waves of r, and its inverse H, whose sweeps damp the short ones: some fifteen
find all states, up to one or two. In 3D those with G alone find the answer, w made anew in double
precision between them. Without a compiler Newton does all.

Slip that turned back within one iteration overshot: such a node sticks in the next, which ends the
usual cycles of slip to and fro. Where Newton cycles all the same, Gauss-Seidel sweeps (nsgs.py)
lead to a better start.
"""

from dataclasses import dataclass
from functools import partial
from typing import Any, ClassVar

import numpy as np

from ...core.algebra import Array, Mask, SerialComm
from ...kernels.compiler import load_loops
from ...kernels.friction_sweeps import FrictionSweeps
from .linear import Factored, LinearProblems, States
from .nsgs import sweeper
from .problem import Iterated, PreparedFriction, ScaledDelassus, ScaledProblem, Settings

ATTEMPTS = 10  # of Newton, with twice the sweeps before each
FIRST_SWEEPS = 2
SWEEPS = {2: 25, 3: 8}  # compiled sweeps in a row, by dimension: in 2D fewer when states settle
STAGES = {2: 1, 3: 16}  # of sweeps, each with a new w
FALL = 0.1  # of the residual in a stage: where it falls less Newton is faster
Kept = dict[bytes, Factored]  # factors by the key of their states


@dataclass(frozen=True)
class FrictionNewton(Settings):
    """Hold the settings.

    ``tolerance``: residual above which it refuses; ``max_iterations`` of Newton in a row.

    In the result ``iterations`` counts linear solves, fallback sweeps and, as one, the sweeps
    before (0: no contact), ``history`` the residual after those and after each linear solve.
    """

    unsymmetric: ClassVar[bool] = True  # matrices are welcome
    tolerance: float = 1e-11
    max_iterations: int = 30

    def prepare(self, G: Array, bilateral: Mask) -> PreparedFriction:
        """Check and scale G (m d, m d).

        Answers depend on their right-hand side alone, not on steps before.
        """
        delassus = ScaledDelassus(G, bilateral, unsymmetric=True)
        # its sweeps read half of G
        loops = load_loops(SerialComm()) if delassus.symmetric else None
        if loops and delassus.count:
            delassus.short  # noqa: B018  a part of set-up
        return PreparedFriction(self, self.tolerance, delassus, partial(self._loop, loops, {}))

    def _loop(self, loops: Any, kept: Kept, step: ScaledProblem, r: Array) -> Iterated:
        history: list[float] = []
        swept, w = 0, None
        if loops and step.unit > 0.0:
            r, w, left = sweep_in_stages(loops, step, r)
            history.append(left / step.unit)
            if step.delassus.dimension > 2 and left <= step.rounding(r):
                return r, 1, history
        for attempt in range(ATTEMPTS if step.unit > 0.0 else 0):
            r, done = self._newton(kept, step, r - (step.w(r) if w is None else w), history)
            if done or attempt == ATTEMPTS - 1:
                break
            sweep, r, w = sweeper(step), step.admissible(r), None
            for _ in range(FIRST_SWEEPS * 2**attempt):
                r, swept = sweep(r), swept + 1
                # they lead nowhere
                if not step.delassus.symmetric and not step.rounding(r) <= step.unit:
                    r = np.zeros_like(r)
                    break
        return r, len(history) + swept, history

    def _newton(
        self, kept: Kept, step: ScaledProblem, y: Array, history: list[float]
    ) -> tuple[Array, bool]:
        """Return the best iterate r, and whether it solves the problem.

        It does so to rounding or to the tolerance.
        """
        best, smallest = np.zeros_like(y), step.unit
        linear = LinearProblems(step.delassus, kept)
        states: States | None = None
        for _ in range(self.max_iterations):
            states = States(step, y, states)
            r = linear.solve(states, step.w(states.fixed))
            if r is None:
                break
            w = step.w(r)
            residual = step.residual(r, w)
            history.append(residual / step.unit)
            if residual < smallest:
                best, smallest = r, residual
            if residual <= step.rounding(r):
                return r, True
            y = r - w
        return best, smallest <= self.tolerance * step.unit


def sweep_in_stages(loops: Any, step: ScaledProblem, r: Array) -> tuple[Array, Array, float]:
    """Return r, w = q + G r and the residual after compiled sweeps.

    In 2D, where they are a start only, w is as the sweeps left it.
    """
    delassus = step.delassus
    in_space = delassus.dimension > 2
    G, H, blocks = delassus.short
    sweeps = FrictionSweeps(
        loops, G, H, blocks, step.cohesion, step.slope, delassus.bilateral, r, step.w(r)
    )
    left = np.inf
    for _ in range(STAGES[delassus.dimension]):
        before = left
        least = 0.5 * step.rounding(sweeps.r) if in_space else 0.0
        sweeps.sweep(SWEEPS[delassus.dimension], least)
        if in_space:  # w follows r in single precision, which is not enough to judge by
            sweeps.w[:] = step.w(sweeps.r)
        left = step.residual(sweeps.r, sweeps.w)
        if left <= step.rounding(sweeps.r) or not left <= FALL * before:
            break
    return sweeps.r, sweeps.w, left
