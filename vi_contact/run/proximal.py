"""Solve the static stage of a body that contact alone holds.

It is floating, as a block standing on the ground is, and K is singular.

Its equilibrium is the limit of the proximal-point iteration (Martinet 1970; Rockafellar, SIAM J.
Control Optim. 14, 1976, thm 1), solved for the increment d = u_{k+1} - u_k and with the reactions
of u_k (``correction``):

    (K + P) d = (f - K u_k) - B_nᵀ r_n - B_tᵀ r_t,    contact conditions on u_k + d

each step of which is an ordinary problem of the contract, with one factorisation for all. P is the
mass of every body on springs to where it is, as weak as the body's own stiffness allows
(``rigid_bodies.make_body_springs``). It converges from any start if there is an equilibrium. If
there is none, d tends to a rigid motion that no contact stops and that the loads drive; that is how
it is recognised (K d = 0, B_n d <= 0, f·d > 0: the energy has no minimum).

Rigid motions that no load drives stay where they start: along them P-weighted means of u are those
of u0 (the centre of mass of a block free to slide on level ground does not move). On a conservative
problem all else is unique.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from ..core.algebra import Array, EffectiveMatrix, Mask, largest, max_abs
from ..core.certificate import Certificate
from ..core.checks import describe_point
from ..core.errors import NoEquilibrium, StepFailure
from ..core.problem import ContactProblem
from ..core.step import Solver, StepProblem, StepResult
from ..core.verify import kkt_residual
from ..laws.free_motions import count_bodies
from ..solvers.correction import MARGIN, add, choose_share, keep_reactions, pose_remainder
from ..solvers.passes import Certified, Passes, certify
from .rigid_bodies import RigidBodies, make_body_springs

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
MOVES = 1e-3  # of the largest displacement: a body that moves more is counted
MOST = 0.999  # the same: bodies that move most, but for rounding


@dataclass(frozen=True)
class Motion:
    """Hold one step of the iteration.

    Attributes:
        d: the increment (n,) [m].
        pull: P d (n,) [N].
        pace: √(d·P d), the size of the step.
        closing: B_n d (m,) [m].
        active: the contact set it ended in (m,).
    """

    d: Array
    pull: Array
    pace: float
    closing: Array
    active: Mask


@dataclass(frozen=True)
class ProximalPass(Certified):
    """Hold the answer that a step has led to.

    Attributes:
        motion: the step.
    """

    motion: Motion


@dataclass(kw_only=True)
class Progress(Passes[ProximalPass]):
    """Hold the best answer so far, by residual and by size of step.

    A smaller step counts near round-off: the residual of a stiff body is there long before soft
    motions are. One that is neither is in vain.

    Attributes:
        slowest: the smallest size of a step so far.
    """

    slowest: float = np.inf

    def is_better(self, there: ProximalPass) -> bool:
        """Say whether an answer has a smaller residual or, near round-off, a smaller step."""
        is_slower = there.worst <= NEAR * self.tolerance and there.motion.pace < self.slowest
        return there.worst < self.least or is_slower

    gains = is_better

    def take(self, there: ProximalPass) -> None:
        """Take an answer into account."""
        super().take(there)
        self.slowest = min(there.motion.pace, self.slowest)


class Proximal:
    """Iterate by the proximal-point method for the matrix ``K``, which is singular.

    Attributes:
        step: the stage.
        motion: the last increment d (n,) [m]; where there is no equilibrium, what the loads drive.
    """

    step: StepProblem
    motion: Array
    strength: ClassVar[float] = 1.0  # of P, over ``make_body_springs``

    def __init__(
        self, problem: ContactProblem, K: EffectiveMatrix, solver: Solver, tolerance: float
    ) -> None:
        """Prepare the solver on K and weak springs.

        Args:
            problem: whose bodies contact alone holds.
            K: its stiffness, which is singular.
            solver: of the steps.
            tolerance: of the certificate, relative.
        """
        solver.check(problem)
        self._problem = problem
        self._system = problem.static_load
        self._surface = problem.surface
        self._K = K
        self._solver = solver
        self._bodies = RigidBodies(problem)
        self._weak = make_body_springs(problem)
        self._tolerance = tolerance
        self._stiffen(self.strength)

    def _stiffen(self, factor: float) -> None:
        """Take P so many times as strong, and factorise."""
        algebra = self._system.algebra
        self._strength = factor
        self._springs = self._weak if factor == 1.0 else algebra.combine([(factor, self._weak)])
        A = algebra.combine([(1.0, self._K.matrix), (factor, self._weak)])
        self._A = EffectiveMatrix(A, algebra, space=self._K.space, inertia=self._K.inertia)
        self._prepare()

    def _prepare(self) -> None:
        """Prepare what solves the steps on these springs."""
        self._prepared = self._solver.prepare(self._A, self._surface, 1.0)

    def certificate(self, result: StepResult) -> Certificate:
        """Return the certificate of the stage itself.

        It has the equilibrium of every body as a rigid one.
        """
        reaction = self.step.surface.reaction_load(result.r_n, len(result.x), result.r_t)
        resultant = self._bodies.imbalance(self.step.b, reaction)
        return replace(kkt_residual(self.step, result), resultant=resultant)

    def solve(self, step: StepProblem) -> Certified:
        """Iterate until two answers running are no better.

        If the solver fails, this is done once with stronger springs instead.

        Raises:
            StepFailure: no answer is certified.
        """
        self.step = step
        progress = Progress(tolerance=self._tolerance, goal=-np.inf, patience=2)
        answer = StepResult(step.guess, np.zeros(step.surface.count), step.active, 0, "")
        for _ in range(2):
            try:
                certify(progress, self._iterate(answer, progress), ITERATIONS)
                why = f"the residual stayed at {progress.least:.1e}"
                break
            except StepFailure as failure:
                why = str(failure)
            if progress.is_certified or self._strength == STIFFER:
                break
            self._stiffen(STIFFER)
            if progress.best is not None:
                answer = replace(progress.best.result, iterations=0)
        return self._judge(progress, why)

    def _judge(self, progress: Progress, why: str) -> Certified:
        """Return the best answer; StepFailure, with the reason why, if it has no certificate."""
        if progress.best is not None and progress.is_certified:
            return progress.best
        raise StepFailure(
            f"the static stage of a body held by contact alone was not solved ({why}): start "
            "closer to the obstacle, use stiffer supports, the solver Condensed(), or hold a part "
            "of the body"
        )

    def _iterate(self, answer: StepResult, progress: Progress) -> Iterator[ProximalPass]:
        """Yield the answers of steps that begin from this one.

        Raises:
            StepFailure: of the solver, or when it has spent too many iterations.
        """
        share = 1.0  # of the reactions, which the next step may change
        before = np.inf  # the residual of the step before
        again = False  # whether this step repeats the one before, with a smaller share
        centre = answer.x  # from where d counts
        carried = np.zeros_like(centre)  # resultants that the step before left
        old: Motion | None = None
        while True:
            # One step: an ordinary problem for what the answer leaves over.
            inner = self._pose_next(answer, share, centre, carried)
            increment = self._prepared.solve(inner)
            result = add(self.step, answer, increment, share)
            new = self._measure_motion(result.x - centre, increment.active)
            self.motion = new.d
            there = ProximalPass(result, self.certificate(result), False, new)
            worst = there.worst
            yield there
            if result.iterations > INNER:
                raise StepFailure(f"{result.method} took more than {INNER} iterations")
            if not progress.is_certified:
                self._refuse_flight(new, result.x)

            # Settled reactions need a share of themselves to change; a larger one when the last did
            # not help.
            last = share
            helped = again or last == 1.0 or worst < 0.5 * before
            share = choose_share(worst) if helped else min(1.0, MARGIN * last)
            again = share < last == 1.0
            before = worst
            answer = result
            if again:
                continue  # the same step, which corrects its round-off
            carried = self._find_missing(inner, increment)

            # Steps that are parallel are summed up at once. Once the tolerance is met they are
            # round-off: to go far along one would shift the body.
            ahead = 0.0
            if old is not None and not progress.is_certified:
                ahead = self._look_ahead(old, new, result)
            old = new if ahead == 0.0 else None
            answer = replace(result, x=result.x + ahead * new.d)
            centre = answer.x

    def _find_missing(self, inner: StepProblem, increment: StepResult) -> Array:
        """Return what a solver left of a step's resultants (n,) [N].

        The next step carries it, or bodies would drift along what P holds.
        """
        x = increment.x
        if increment.aim == 0.0:
            return np.zeros_like(x)
        reaction = inner.surface.reaction_load(increment.r_n, len(x), increment.r_t)
        return self._bodies.resultants(inner.b - self._springs @ x - reaction)

    def _pose_next(
        self, answer: StepResult, share: float, centre: Array, carried: Array
    ) -> StepProblem:
        """Return the next step, b with the forces' own resultants.

        K u has none, and its round-off would move the body.

        Args:
            answer: the best one so far, or the start.
            share: of its reactions, which the step may change.
            centre: from where the springs pull (n,) [m].
            carried: resultants that the step before left (n,) [N].
        """
        left = pose_remainder(self.step, answer, share)
        x = answer.x
        surface = self.step.surface
        r_n, r_t = keep_reactions(self.step, answer, share)
        forces = self.step.b - surface.reaction_load(r_n, len(x), r_t)
        b = (
            left.b
            + self._bodies.resultants(forces - left.b)
            + self._springs @ (centre - x)
            + carried
        )
        return replace(left, A=self._A, b=b)

    def _measure_motion(self, d: Array, active: Mask) -> Motion:
        """Return the step d (n,) [m] that ended with this contact set (m,). Collective."""
        pull = self._springs @ d
        pace = float(np.sqrt(max(self._system.algebra.dot(d, pull), 0.0)))
        return Motion(d, pull, pace, self.step.surface.normal_values(d), active)

    def _find_closing(self, motion: Motion) -> Mask:
        """Return the contact points (m,) that come nearer to their obstacle. Collective."""
        size = largest(self.step.surface.comm, max_abs(motion.d))
        return np.asarray((motion.closing > STOPPED * size) & np.isfinite(self.step.bound))

    def _refuse_flight(self, motion: Motion, u: Array) -> None:
        """Raise NoEquilibrium for a rigid motion without end that loads drive. Collective.

        It bends nothing, dᵀKd = 0, the loads work on it, f·d > 0, and no contact stops it. Where
        there is an equilibrium u*, f·d is at most u*ᵀK d for such a motion, so that a work below
        √(uᵀKu dᵀKd) tells nothing: soft motions of many bodies bend them a little.

        Args:
            motion: the step.
            u: where it has led (n,) [m].
        """
        system = self._system
        energy = motion.pace**2
        bending = 2.0 * system.strain_energy(motion.d)
        work = system.algebra.dot(self.step.b, motion.d)
        stopped = self.step.surface.some(self._find_closing(motion))
        # It does not move, it deforms the body, no load drives it, or a contact stops it.
        if energy == 0.0 or bending > RIGID * energy or work < DRIVEN * energy or stopped:
            return
        if work**2 < 2.0 * system.strain_energy(u) * bending:
            return
        way = self._describe_way(motion.d)
        raise NoEquilibrium(
            f"the body has no static equilibrium: its loads {way} and neither contact nor a "
            f"prescribed displacement stops it{self._describe_bodies(motion.d)}: hold it there, "
            "change the loads, or start the dynamics from rest"
        )

    def _describe_way(self, d: Array) -> str:
        """Return in words where a motion d (n,) goes: along its momentum, if it has one."""
        momentum = self._system.M @ d
        sums = np.column_stack([self._system.influence * momentum[:, None], np.abs(momentum)])
        *push, total = self._system.algebra.comm.sum(sums.sum(axis=0))
        largest = max_abs(np.array(push))
        if largest <= 1e-6 * total:
            return "turn it on the spot"
        way = ", ".join(f"{x / largest if abs(x) > 1e-4 * largest else 0.0:.2g}" for x in push)
        return f"carry it off along ({way})"

    def _describe_bodies(self, d: Array) -> str:
        """Return in words which of several bodies a motion d (n,) moves, "" for one. Collective."""
        problem = self._problem
        comm = problem.surface.comm
        space = problem.system.space
        numbers = np.asarray(space.bodies)
        count = count_bodies(comm, numbers)
        if count == 1:
            return ""

        # The largest displacement of each body, and the first of those that move most.
        size = np.zeros(count)
        np.maximum.at(size, numbers, np.abs(problem.cartesian(d)))
        size = comm.max(size)
        moving = np.count_nonzero(size > MOVES * size.max())
        first = int(np.flatnonzero(size > MOST * size.max())[0])

        # The mean of its nodes is where it is.
        own = space.coordinates[numbers == first]
        *place, nodes = comm.sum(np.append(own.sum(axis=0), len(own)))
        extent = comm.max(np.abs(space.coordinates).max(axis=0, initial=0.0)).max()
        place = [x / nodes if abs(x / nodes) > 1e-9 * extent else 0.0 for x in place]
        where = describe_point(np.array(place))
        return f" ({moving} of {count} bodies move, such as that at {where})"

    def _look_ahead(self, old: Motion, new: Motion, result: StepResult) -> float:
        """Return how many times d to go further at once.

        It is the sum of the steps to come when each is ‖d_new‖/‖d_old‖ of the one before (Aitken),
        or only as far as the next contact. It is 0 unless d_new and d_old are parallel, to the
        accuracy which that distance needs. Any start of the next step will do, so nothing but the
        speed depends on it.

        Args:
            old: the step before.
            new: the step.
            result: the answer that it led to.
        """
        surface = self.step.surface
        if 0.0 in (old.pace, new.pace) or surface.some(old.active != new.active):
            return 0.0

        # As far as the next contact: the least gap over its closing, of all ranks.
        rows = self._find_closing(new) & ~result.active
        gap = (self.step.bound - surface.normal_values(result.x))[rows]
        nearest = np.max(-np.maximum(gap, 0.0) / new.closing[rows], initial=-np.inf)
        stop = -largest(surface.comm, nearest)

        # Or the sum of a geometric series, if the steps are parallel: what is aside of d_old in
        # d_new, times the distance, must be less than half a step.
        ratio = new.pace / old.pace
        series = ratio / (1.0 - ratio) if ratio < UNBRAKED else np.inf
        ahead = min(stop, series)
        off = new.d - ratio * old.d
        force = new.pull - ratio * old.pull
        aside = float(np.sqrt(max(self._system.algebra.dot(off, force), 0.0)))
        return ahead if np.isfinite(ahead) and ahead * aside <= 0.5 * new.pace else 0.0
