"""Solve contact with friction by semismooth Newton: the default, in 2D an active-set method.

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
from .nsgs import make_sweep
from .problem import (
    LastIterate,
    PreparedFriction,
    ScaledDelassus,
    ScaledProblem,
    Settings,
    ShortMatrices,
)

ATTEMPTS = 10  # of Newton, with twice the sweeps before each
FIRST_SWEEPS = 2
SWEEPS = {2: 25, 3: 8}  # compiled sweeps in a row, by dimension: in 2D fewer when states settle
STAGES = {2: 1, 3: 16}  # of sweeps, each with a new w
FALL = 0.1  # of the residual in a stage: where it falls less Newton is faster
Factors = dict[bytes, Factored]  # by the key of their states


@dataclass(frozen=True)
class FrictionNewton(Settings):
    """Hold the settings of Newton's method.

    In the result ``iterations`` counts linear solves, fallback sweeps and, as one, the sweeps
    before (0: no contact), ``history`` the residual after those and after each linear solve.

    Attributes:
        tolerance: the residual above which it refuses, that of r = 0 being 1.
        max_iterations: of Newton in a row.
    """

    unsymmetric: ClassVar[bool] = True  # matrices are welcome
    tolerance: float = 1e-11
    max_iterations: int = 30

    def prepare(self, G: Array, bilateral: Mask) -> PreparedFriction:
        """Check and scale G (m d, m d); ``bilateral`` (m,) says which rows are bilateral.

        Answers depend on their right-hand side alone, not on those before.
        """
        delassus = ScaledDelassus(G, bilateral, unsymmetric=True)
        # Compiled sweeps read half of G.
        loops = load_loops(SerialComm()) if delassus.symmetric else None
        short = delassus.make_short() if loops and delassus.count else None
        loop = partial(self._iterate, loops, short, {})
        return PreparedFriction(self, self.tolerance, delassus, loop)

    def _iterate(
        self,
        loops: Any,
        short: ShortMatrices | None,
        factors: Factors,
        step: ScaledProblem,
        r: Array,
    ) -> LastIterate:
        """Sweep, and let Newton end it; where Newton goes in circles, sweep and begin anew.

        Args:
            loops: the compiled functions; None without a compiler.
            short: what they read; None where nothing is to be swept.
            factors: those of the last linear problems of this G.
            step: the problem.
            r: (m, d) reactions to start from, scaled.
        """
        history: list[float] = []
        if not step.unit > 0.0:
            return LastIterate(r, 0, history)
        w = None
        if loops and short is not None:
            r, w, left = sweep_in_stages(loops, short, step, r)
            history.append(left / step.unit)
            if step.delassus.dimension > 2 and left <= step.rounding(r):
                return LastIterate(r, 1, history)
        sweeps = 0
        for attempt in range(ATTEMPTS):
            y = r - (step.w(r) if w is None else w)
            r, is_solved = self._run_newton(factors, step, y, history)
            if is_solved or attempt == ATTEMPTS - 1:
                break
            sweep = make_sweep(step)
            r = step.admissible(r)
            w = None
            for _ in range(FIRST_SWEEPS * 2**attempt):
                r = sweep(r)
                sweeps += 1
                # With a G that is not symmetric or positive sweeps may grow: they lead nowhere.
                if not step.rounding(r) <= step.unit:
                    r = np.zeros_like(r)
                    break
        return LastIterate(r, len(history) + sweeps, history)

    def _run_newton(
        self, factors: Factors, step: ScaledProblem, y: Array, history: list[float]
    ) -> tuple[Array, bool]:
        """Iterate by Newton's method until it solves the problem or comes back to old states.

        Args:
            factors: those of the last linear problems of this G.
            step: the problem.
            y: (m, d) r - w, to start from.
            history: gets the residual of each iterate, that of r = 0 being 1.

        Returns:
            The best iterate r (m, d), and whether it solves the problem, to rounding or to the
            tolerance.
        """
        best = np.zeros_like(y)
        smallest = step.unit
        linear = LinearProblems(step.delassus, factors)
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
                best = r
                smallest = residual
            if residual <= step.rounding(r):
                return r, True
            y = r - w
        return best, smallest <= self.tolerance * step.unit


def sweep_in_stages(
    loops: Any, short: ShortMatrices, step: ScaledProblem, r: Array
) -> tuple[Array, Array, float]:
    """Sweep by the compiled functions, in 3D with w made anew between stages.

    Args:
        loops: the compiled functions.
        short: the matrices that they read.
        step: the problem.
        r: (m, d) reactions to start from, scaled.

    Returns:
        r, w = q + G r and the residual. In 2D, where r is a start only, w is as the sweeps left it.
    """
    delassus = step.delassus
    in_space = delassus.dimension > 2
    sweeps = FrictionSweeps(
        loops, *short, step.cohesion, step.slope, delassus.bilateral, r, step.w(r)
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
