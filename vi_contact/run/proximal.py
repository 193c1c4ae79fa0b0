"""Solve the static stage of a body that contact alone holds.

It is floating, as a block standing on the ground is, and K is singular.

Its equilibrium is the limit of the proximal-point iteration (Martinet 1970; Rockafellar, SIAM J.
Control Optim. 14, 1976, thm 1), solved for the increment d = u_{k+1} - u_k and with the reactions
of u_k (``correction``):

    (K + P) d = (f - K u_k) - B_nᵀ r_n - B_tᵀ r_t,    contact conditions on u_k + d

each step of which is an ordinary problem of the contract, with one factorisation for all. P is the
mass of every body on springs to where it is, as weak as the body's own stiffness allows
(``rigid_bodies.body_springs``). It converges from any start if there is an equilibrium. If there is
none, d tends to a rigid motion that no contact stops and that the loads drive; that is how it is
recognised (K d = 0, B_n d <= 0, f·d > 0: the energy has no minimum).

Rigid motions that no load drives stay where they start: along them P-weighted means of u are those
of u0 (the centre of mass of a block free to slide on level ground does not move). On a conservative
problem all else is unique.
"""

from dataclasses import dataclass, replace

import numpy as np

from ..core.algebra import Array, EffectiveMatrix, Mask, largest, max_abs
from ..core.certificate import Certificate
from ..core.errors import InputError, StepFailure
from ..core.problem import ContactProblem
from ..core.step import Solver, StepProblem, StepResult
from ..core.verify import kkt_residual
from ..solvers.correction import MARGIN, add, kept_reactions, left_over, share_of
from .rigid_bodies import RigidBodies, body_springs

ITERATIONS = 200
STIFFER = 1e3  # springs for solvers that the weak ones defeat
# iterations of the solver in all: methods that crawl on a body that is almost free would never end
INNER = 20_000
RIGID = 1e-4  # dᵀKd over dᵀPd below which a motion deforms nothing
DRIVEN = 0.5  # f·d over dᵀPd above which the loads drive it
NEAR = 1e-3  # of the tolerance: what stiff bodies reach on soft ones
UNBRAKED = 0.99999  # of the step before: a motion that only a new contact can stop
# of the largest motion: what a contact point may move towards its obstacle in a free motion
STOPPED = 1e-9


@dataclass(frozen=True)
class _Motion:
    """One step d of the iteration: P d, its size √(d·P d), B_n d, the contact set it ended in."""

    d: Array
    pull: Array
    pace: float
    closing: Array
    active: Mask


@dataclass
class _Progress:
    """The best answer so far; ``vain``: how many since then were no better."""

    tolerance: float
    best: StepResult | None = None
    least: float = np.inf
    slowest: float = np.inf
    vain: int = 0

    @property
    def certified(self) -> bool:
        """Whether the best answer is below the tolerance."""
        return self.least <= self.tolerance

    def take(self, result: StepResult, worst: float, pace: float) -> None:
        """Take an answer that is better than the best so far.

        It is better with a smaller residual or, near round-off, with the smallest step: the
        residual of a stiff body is there long before soft motions are.
        """
        better = worst < self.least or (worst <= NEAR * self.tolerance and pace < self.slowest)
        self.vain, self.best = (0, result) if better else (self.vain + 1, self.best)
        self.least, self.slowest = min(worst, self.least), min(pace, self.slowest)


class Proximal:
    """Iterate by the proximal-point method for the matrix ``K``, which is singular."""

    step: StepProblem

    def __init__(
        self, problem: ContactProblem, K: EffectiveMatrix, solver: Solver, tolerance: float
    ) -> None:
        solver.check(problem)
        self._system, self._surface, self._K, self._solver = (
            problem.static_load,
            problem.surface,
            K,
            solver,
        )
        self._bodies = RigidBodies(problem)
        self._weak = body_springs(problem)
        self._tolerance = tolerance
        self._stiffen(1.0)

    def _stiffen(self, factor: float) -> None:
        """Take P so many times as strong, and factorise."""
        algebra = self._system.algebra
        self._strength = factor
        self._springs = self._weak if factor == 1.0 else algebra.combine([(factor, self._weak)])
        A = algebra.combine([(1.0, self._K.matrix), (factor, self._weak)])
        self._A = EffectiveMatrix(A, algebra, space=self._K.space, inertia=self._K.inertia)
        self._prepared = self._solver.prepare(self._A, self._surface, 1.0)

    def certificate(self, result: StepResult) -> Certificate:
        """Return the certificate of the stage itself.

        It has the equilibrium of every body as a rigid one.
        """
        reaction = self.step.surface.reaction_load(result.r_n, len(result.x), result.r_t)
        resultant = self._bodies.imbalance(self.step.b, reaction)
        return replace(kkt_residual(self.step, result), resultant=resultant)

    def solve(self, step: StepProblem) -> StepResult:
        """Iterate until two answers running are no better.

        If the solver fails, this is done once with stronger springs instead.
        """
        self.step = step
        progress = _Progress(self._tolerance)
        answer = StepResult(step.guess, np.zeros(step.surface.count), step.active, 0, "")
        for _ in range(2):
            try:
                self._iterate(replace(progress.best or answer, iterations=0), progress)
                why = f"the residual stayed at {progress.least:.1e}"
                break
            except StepFailure as failure:
                why = str(failure)
            if progress.certified or self._strength == STIFFER:
                break
            self._stiffen(STIFFER)
        if progress.best is not None and progress.certified:
            return progress.best
        raise StepFailure(
            f"the static stage of a body held by contact alone was not solved ({why}): start "
            "closer to the obstacle, use stiffer supports, the solver Condensed(), or hold a part "
            "of the body"
        )

    def _iterate(self, answer: StepResult, progress: _Progress) -> None:
        """From the answer; StepFailure of the solver, or when it has spent too many iterations."""
        share, before, again, centre = 1.0, np.inf, False, answer.x
        old: _Motion | None = None
        carried = np.zeros_like(centre)
        for _ in range(ITERATIONS):
            inner = self._left_over(answer, share, centre, carried)
            found = self._prepared.solve(inner)
            result = add(self.step, answer, found, share)
            worst, new = (
                self.certificate(result).worst,
                self._motion(result.x - centre, found.active),
            )
            progress.take(result, worst, new.pace)
            if progress.certified and progress.vain == 2:
                return
            if result.iterations > INNER:
                raise StepFailure(f"{result.method} took more than {INNER} iterations")
            if not progress.certified:
                self._refuse_flight(new)
            # settled reactions need a share of themselves to change; a larger one when the last did
            # not help
            helped = again or share == 1.0 or worst < 0.5 * before
            last, share = share, share_of(worst) if helped else min(1.0, MARGIN * share)
            before, answer, again = worst, result, share < last == 1.0
            if again:
                continue  # the same step, which corrects its round-off
            carried = self._missing(inner, found)
            # once the tolerance is met steps are round-off: to go far along one would shift the
            # body
            ahead = 0.0 if old is None or progress.certified else self._ahead(old, new, result)
            old = new if ahead == 0.0 else None
            answer = replace(result, x=result.x + ahead * new.d)
            centre = answer.x

    def _missing(self, inner: StepProblem, found: StepResult) -> Array:
        """Return what a solver left of a step's resultants.

        The next step carries it, or bodies would drift along what P holds.
        """
        if found.aim == 0.0:
            return np.zeros_like(found.x)
        reaction = inner.surface.reaction_load(found.r_n, len(found.x), found.r_t)
        return self._bodies.resultants(inner.b - self._springs @ found.x - reaction)

    def _left_over(
        self, answer: StepResult, share: float, centre: Array, carried: Array
    ) -> StepProblem:
        """Return the next step, b with the forces' own resultants.

        K u has none, and its round-off would move the body.
        """
        left, x, surface = left_over(self.step, answer, share), answer.x, self.step.surface
        r_n, r_t = kept_reactions(self.step, answer, share)
        forces = self.step.b - surface.reaction_load(r_n, len(x), r_t)
        b = (
            left.b
            + self._bodies.resultants(forces - left.b)
            + self._springs @ (centre - x)
            + carried
        )
        return replace(left, A=self._A, b=b)

    def _motion(self, d: Array, active: Mask) -> _Motion:
        pull = self._springs @ d
        pace = float(np.sqrt(max(self._system.algebra.dot(d, pull), 0.0)))
        return _Motion(d, pull, pace, self.step.surface.normal_values(d), active)

    def _closes(self, motion: _Motion) -> Mask:
        """Contact points that come nearer to their obstacle."""
        size = largest(self.step.surface.comm, max_abs(motion.d))
        return np.asarray((motion.closing > STOPPED * size) & np.isfinite(self.step.bound))

    def _refuse_flight(self, motion: _Motion) -> None:
        """InputError for a driven rigid motion without end."""
        system, energy = self._system, motion.pace**2
        bending, work = (
            2.0 * system.strain_energy(motion.d),
            system.algebra.dot(self.step.b, motion.d),
        )
        stopped = self.step.surface.some(self._closes(motion))
        if energy == 0.0 or bending > RIGID * energy or work < DRIVEN * energy or stopped:
            return
        raise InputError(
            f"the body has no static equilibrium: its loads {self._way(motion.d)} and neither "
            "contact nor a prescribed displacement stops it: hold it there, change the loads, or "
            "start the dynamics from rest"
        )

    def _way(self, d: Array) -> str:
        """Where a motion goes: the direction of its momentum, if it has one."""
        momentum = self._system.M @ d
        sums = np.column_stack([self._system.influence * momentum[:, None], np.abs(momentum)])
        *push, total = self._system.algebra.comm.sum(sums.sum(axis=0))
        largest = max_abs(np.array(push))
        if largest <= 1e-6 * total:
            return "turn it on the spot"
        way = ", ".join(f"{x / largest if abs(x) > 1e-4 * largest else 0.0:.2g}" for x in push)
        return f"carry it off along ({way})"

    def _ahead(self, old: _Motion, new: _Motion, result: StepResult) -> float:
        """Return how many times d to go further at once.

        It is the sum of the steps to come when each is ‖d_new‖/‖d_old‖ of the one before (Aitken),
        or only as far as the next contact. It is 0 unless d_new and d_old are parallel, to the
        accuracy which that distance needs. Any start of the next step will do, so nothing but the
        speed depends on it.
        """
        if 0.0 in (old.pace, new.pace) or self.step.surface.some(old.active != new.active):
            return 0.0
        surface, ratio = self.step.surface, new.pace / old.pace
        rows = self._closes(new) & ~result.active
        gap = (self.step.bound - surface.normal_values(result.x))[rows]
        stop = -largest(
            surface.comm, np.max(-np.maximum(gap, 0.0) / new.closing[rows], initial=-np.inf)
        )
        ahead = min(stop, ratio / (1.0 - ratio) if ratio < UNBRAKED else np.inf)
        off, force = new.d - ratio * old.d, new.pull - ratio * old.pull
        aside = float(np.sqrt(max(self._system.algebra.dot(off, force), 0.0)))
        return ahead if np.isfinite(ahead) and ahead * aside <= 0.5 * new.pace else 0.0
