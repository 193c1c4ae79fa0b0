"""Solve static stages of stones, with springs that weaken as their stage settles.

Stones that contact alone holds come to rest by the proximal-point iteration (``proximal``), which
is implicit Euler for the motion P du/dτ = f - K u - Bᵀr in a time τ that has no meaning: the weaker
the springs, the longer the steps. Long steps come to rest at once from near by. From far away
hundreds of joints change between open, stick and slip in one step, and Newton's iteration finds no
end. So steps begin short, grow tenfold after each one that succeeds, and are made tenfold shorter
where one fails (pseudo-transient continuation: Kelley and Keyes, SIAM J. Numer. Anal. 35, 1998,
508-523).

Each step takes the reactions of the one before as its start, and the first one those of the stage
before. Where there is no equilibrium a long step is the mechanism itself, as what bends in it is
small beside how far it goes.

Rigid motions are unknowns of their own (``solvers.floating``), so that weak springs cost no digits:
those of P stay, as along all other motions.
"""

from collections.abc import Iterator
from dataclasses import replace
from typing import ClassVar

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from ..core.algebra import Array, EffectiveMatrix, Mask
from ..core.errors import StepFailure
from ..core.problem import ContactProblem
from ..core.step import Solver, State, StepProblem, StepResult
from ..core.surfaces import ContactSurface
from ..solvers.automatic import Automatic
from ..solvers.condensed import Condensed
from ..solvers.correction import MARGIN, add, choose_share, keep_reactions
from ..solvers.floating import PreparedFloating
from ..solvers.friction.newton import FrictionNewton
from ..solvers.passes import Certified, certify
from .proximal import ITERATIONS, Motion, Progress, Proximal, ProximalPass
from .rigid_bodies import find_sprung_motions

FIRM = 1e3  # of the weak springs of ``proximal``: P of all motions but rigid ones
WEAKER = 0.1  # a step that succeeds makes springs so many times as strong
WEAKEST = 1e-8  # of P, along rigid motions
FIRMEST = 1e3  # the same, beyond which a step that fails is not made shorter
PATIENCE = 2  # answers running that are no better, once one is certified
STEADY = 2  # steps that must succeed after one that failed, before springs weaken again


def weakens(problem: ContactProblem, solver: Solver) -> bool:
    """Say whether static stages are those of this file: of stones, by Newton's method. Collective.

    Args:
        problem: whose bodies contact alone holds.
        solver: of its stages.
    """
    if isinstance(solver, Automatic):
        solver = solver.condensed
    if not isinstance(solver, Condensed) or not isinstance(solver.friction_method, FrictionNewton):
        return False
    surface: ContactSurface = problem.surface
    has_bodies = surface.traces is not None and surface.coupling is None
    has_law = problem.frictional and problem.joint is None
    return has_bodies and has_law and problem.static_load.algebra.symmetric


class Weakening(Proximal):
    """Iterate by the proximal-point method with springs that weaken along rigid motions."""

    strength: ClassVar[float] = FIRM

    def __init__(
        self, problem: ContactProblem, K: EffectiveMatrix, solver: Solver, tolerance: float
    ) -> None:
        """Prepare the solver on K and firm springs: see ``Proximal``."""
        if isinstance(solver, Automatic):
            solver = solver.condensed
        assert isinstance(solver, Condensed)
        assert isinstance(solver.friction_method, FrictionNewton)
        self._method = solver.friction_method
        self._kappa = 1.0
        super().__init__(problem, K, solver, tolerance)

    def _prepare(self) -> None:
        """Condense K with the springs, and find what they hold."""
        motions = find_sprung_motions(self._problem, self._springs)
        self._Rt_pull = sp.csr_matrix(motions.pull.T)
        self._pull = motions.pull
        self._energies = splu(sp.csc_matrix(motions.S))
        self._floating = PreparedFloating(
            self._A,
            self._surface,
            R=motions.R,
            pull=motions.pull,
            S=motions.S,
            method=self._method,
        )

    def solve(self, step: StepProblem, old: State | None = None) -> Certified:
        """Iterate until two answers running are no better, or rounding is reached.

        Args:
            step: the stage.
            old: the state before, with whose reactions the iteration begins.

        Raises:
            StepFailure: no answer is certified.
        """
        self.step = step
        # Forces that hardly move a stone settle last: rounding ends the iteration, and no goal.
        progress = Progress(tolerance=self._tolerance, goal=-np.inf, patience=PATIENCE)
        try:
            certify(progress, self._weaken(old, progress), ITERATIONS)
            why = f"the residual stayed at {progress.least:.1e}"
        except StepFailure as failure:
            why = str(failure)
        return self._judge(progress, why)

    def _weaken(self, old: State | None, progress: Progress) -> Iterator[ProximalPass]:
        """Yield the answers of steps, each on springs as weak as it allows.

        Args:
            old: the state before.
            progress: of the steps.

        Raises:
            StepFailure: of a step on the firmest springs.
        """
        self._kappa = 1.0
        step = self.step
        answer = StepResult(step.guess, np.zeros(step.surface.count), step.active, 0, "")
        near = None if old is None else _join(old.r_n, old.r_t, step)
        nothing = np.zeros_like(step.guess)
        share = 1.0  # of the reactions, which the next step may change
        before = np.inf  # the residual of the step before
        steady = STEADY  # steps running that have succeeded
        last: tuple[Motion, float] | None = None
        while True:
            inner = self._pose_next(answer, share, answer.x, nothing)
            try:
                increment = self._floating.solve(inner, self._kappa, near)
            except StepFailure:
                if self._kappa >= FIRMEST:
                    raise
                self._kappa /= WEAKER
                steady = 0
                continue
            result = add(step, answer, increment, share)
            motion = self._measure_motion(result.x - answer.x, increment.active)
            self.motion = motion.d
            there = ProximalPass(result, self.certificate(result), False, motion)
            yield there
            if not progress.is_certified:
                self._refuse_flight(motion, result.x)

            # Steps that are parallel are summed up at once, as those of equal length show.
            ahead = 0.0
            if last is not None and last[1] == self._kappa and not progress.is_certified:
                ahead = self._look_ahead(last[0], motion, result)
            last = (motion, self._kappa) if ahead == 0.0 else None
            answer = replace(result, x=result.x + ahead * motion.d)

            # Settled reactions need a share of themselves to change, more if less has not helped.
            worst = there.worst
            helped = share == 1.0 or worst < 0.5 * before
            share = choose_share(worst) if helped else min(1.0, MARGIN * share)
            before = worst
            kept = _join(*keep_reactions(step, answer, share), step)
            near = _join(answer.r_n, answer.r_t, step) - kept
            steady += 1
            if steady >= STEADY:
                self._kappa = max(WEAKEST, WEAKER * self._kappa)

    def _measure_motion(self, d: Array, active: Mask) -> Motion:
        """Return the step d (n,) [m] with what the weakened springs pull. Collective."""
        motion = super()._measure_motion(d, active)

        # Along rigid motions, P R S⁻¹ RᵀP d, springs are κ/(1 + κ) times as strong.
        comm = self._surface.comm
        rigid = self._pull @ self._energies.solve(comm.sum(self._Rt_pull @ d))
        pull = motion.pull - rigid / (1.0 + self._kappa)
        pace = float(np.sqrt(max(self._system.algebra.dot(d, pull), 0.0)))
        return replace(motion, pull=pull, pace=pace)


def _join(r_n: Array, r_t: Array | None, step: StepProblem) -> Array:
    """Return reactions (m, d), the normal one first."""
    assert step.slip0 is not None
    return np.column_stack([r_n, np.zeros_like(step.slip0) if r_t is None else r_t])
