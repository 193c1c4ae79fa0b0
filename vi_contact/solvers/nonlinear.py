"""Solve the step of a body whose internal force is not linear, by certified linear steps.

What is asked for is the increment d and the reactions r of ``core.stage``,

    rest(d) = Bᵀ(scale r),    rest(d) = scale (f - carried - M a(d) - C v(d) - p(d))

with the contact conditions and the law of friction as they are. About an increment d_k each pass is
a linear step of the contract, for the change that is missing and for the *whole* reactions:

    A delta = rest(d_k) - Bᵀ(scale r),    conditions on d_k + delta

so that contact is exact in every pass, and a fixed point satisfies the equations as they are. The
certificate is that of the nonlinear equations: ``kkt_residual`` with rest(d) in the place of
b - A d.

A is m M + c C + k K with the reference stiffness K, whose factor is made once. Passes with it
converge linearly and are accelerated (``acceleration``). K is replaced by the tangent p'(u) where
the passes that are still expected would cost more than a new factor, counted by unknowns and never
by a clock, and where a pass has no smaller residual than the best one before it.

From such a pass only a part may be gone. Between d_k and d_k + delta, which both are outside of the
obstacle, the potential of all forces falls at first, if A is positive definite, with the slope
-(rest - B_tᵀ scale r_t)·delta. The whole way is gone where its slope at the end is negative or
small, else as far as that (``line_search``). The first pass, which brings d out of a moved
obstacle, is gone as a whole where the forces at its end are numbers.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import isfinite
from math import log as ln

import numpy as np

from ..core.algebra import Array, EffectiveMatrix, Mask, Matrix, largest
from ..core.certificate import Certificate
from ..core.errors import InputError, StepFailure
from ..core.problem import ContactProblem
from ..core.stage import Stage, find_rest, make_matrix, pose
from ..core.step import Solver, StepProblem, StepResult
from ..core.system import SemiDiscreteSystem
from ..core.verify import kkt_residual
from .acceleration import Anderson
from .certified import ADVICE, NEAR, Certified, CertifiedSolver
from .line_search import FLAT, find_finite, find_flat

log = logging.getLogger(__name__)

MOST = 60  # passes of a step
SETTLED = 0.5  # of the residual before: a pass that gains less brings no more digits
# Passes with the reference that a new tangent with its factor costs, over the root of the unknowns
# over their logarithm in the plane, and over their power 2/3 in space (measured: 15 and 45 passes
# at 2e4 unknowns, which are the exponents of nested dissection).
PLANE = 1.05
SPACE = 0.061
MARGIN = 4.0  # passes that a tangent needs itself
# The share of the reference in tangents, each tried where the one before was of no use. All but the
# first are braced at the contact.
SHARES = (0.0, 0.0, 0.1, 0.4)
BRACE = 10.0  # of the stiffness of a closed point: that of a spring which braces a tangent there


@dataclass(frozen=True)
class Place:
    """Hold an increment, from which a pass may start or to which it has led.

    Attributes:
        d: the increment (n,).
        rest: rest(d) (n,).
        active: the contact set (m,) that is expected.
    """

    d: Array
    rest: Array
    active: Mask


@dataclass(frozen=True)
class Pass:
    """Hold where a pass has led.

    Attributes:
        place: its end.
        result: its answer, with x = d.
        certificate: of the nonlinear step.
    """

    place: Place
    result: StepResult
    certificate: Certificate


@dataclass
class Walk:
    """Hold how far the passes of one step have come.

    Attributes:
        stage: the balance.
        whole: the step at the guess.
        here: where the next pass starts.
        base: the last place that no extrapolation has made.
        outside: whether ``base`` is outside of the obstacle, as the end of every pass is.
        solver: of the passes.
        acceleration: what the passes with this matrix have shown.
        best: the pass with the smallest residual, None before the first one.
        rate: its residual over the one before; 1 where nothing is known of it.
        tangent_due: whether the next pass is one with a new tangent.
        care: how many tangents were of no use: place in ``SHARES`` of the next one.
        escalated: whether a pass was by a method that was escalated to.
    """

    stage: Stage
    whole: StepProblem
    here: Place
    base: Place
    solver: CertifiedSolver
    acceleration: Anderson
    outside: bool = False
    best: Pass | None = None
    rate: float = 1.0
    tangent_due: bool = False
    care: int = 0
    escalated: bool = False

    @property
    def least(self) -> float:
        """Return the smallest residual so far."""
        return np.inf if self.best is None else self.best.certificate.worst

    @property
    def refused(self) -> bool:
        """Say whether tangents are of no use in this step."""
        return self.care == len(SHARES)


class NonlinearSolver:
    """Solve steps of one length; the reference is factorised once for all of them.

    Attributes:
        tangents: how many tangents have been made.
        counts: how many linear steps each step took.
    """

    def __init__(
        self,
        problem: ContactProblem,
        stage: Stage,
        solvers: Sequence[Solver],
        tolerance: float,
        *,
        system: SemiDiscreteSystem | None = None,
        advice: str = ADVICE,
    ) -> None:
        """Prepare the reference. Collective.

        Args:
            problem: the contact problem.
            stage: of any step of this length.
            solvers: of linear steps, and the methods to escalate to.
            tolerance: the largest residual of a certificate.
            system: the equations of the steps; None: those that are marched.
            advice: end of the sentence that refuses a step.
        """
        self._problem = problem
        self._system = problem.equations if system is None else system
        self._solvers = solvers
        self._tolerance = tolerance
        self._advice = advice
        self.tangents = 0
        self.counts: list[int] = []
        self.A = make_matrix(self._system, stage)
        self._reference = self._prepare(stage, self.A)
        self._cost = _count_passes_of_a_factor(problem)

    def _prepare(self, stage: Stage, A: EffectiveMatrix) -> CertifiedSolver:
        """Return the certified solver of linear steps with a matrix."""
        return CertifiedSolver(
            self._problem, A, stage.scale, self._solvers, self._tolerance, advice=self._advice
        )

    def solve(self, stage: Stage) -> tuple[StepProblem, Certified]:
        """Return the step at the guess, and its certified answer with x = d. Collective.

        Raises:
            StepFailure: no pass came below the tolerance, or a linear step has no answer.
        """
        walk = self._begin(stage)
        for count in range(1, MOST + 1):
            there = self._make_pass(walk)
            if there is None:
                continue
            if self._is_answer(walk, there):
                return walk.whole, self._finish(walk, count)
            if walk.best is there:
                self._extrapolate(walk, there)
            else:
                self._fall_back(walk, there)
        self.counts.append(MOST)
        reached = "" if walk.best is None else f" ({walk.best.certificate})"
        if walk.care:
            reached += "; its tangent is not positive there, as that of a body that gives way"
        raise StepFailure(
            f"{_name(walk)} did not come below the certificate tolerance {self._tolerance:g} in "
            f"{MOST} linear steps{reached}: {self._advice}"
        )

    def _begin(self, stage: Stage) -> Walk:
        """Return the walk that begins at the guess of a stage. Collective.

        Raises:
            StepFailure: the internal force is no number there, as that of a body inside out.
        """
        whole = pose(self._problem, stage, self.A, self._system)
        start = Place(whole.guess, whole.b, whole.active)
        walk = Walk(stage, whole, start, start, self._reference, self._make_acceleration())
        # The reference of a body that has turned is of no use: its passes go with a tangent.
        walk.tangent_due = stage.between is not None
        if whole.internal is not None and not self._is_finite(whole.internal):
            raise StepFailure(
                f"{_name(walk)} begins where its internal force is NaN or infinite: {self._advice}"
            )
        return walk

    def _make_acceleration(self) -> Anderson:
        return Anderson(self._problem.surface.comm.sum)

    def _is_finite(self, x: Array) -> bool:
        """Tell whether a vector (n,) is finite on all ranks. Collective."""
        return not largest(self._problem.surface.comm, not isfinite(x.sum()))

    def _make_pass(self, walk: Walk) -> Pass | None:
        """Return where the next pass leads; None where there is none, and another way is open.

        Collective.

        Raises:
            InputError, StepFailure: a pass with the reference has no answer.
        """
        try:
            if walk.tangent_due:
                self._take_tangent(walk)
            linear = walk.solver.solve(self._pose_about(walk))
        except (InputError, StepFailure) as refusal:
            log.debug("%s: a pass is of no use (%s)", _name(walk), refusal)
            of_tangent = walk.tangent_due or walk.solver is not self._reference
            if of_tangent:  # one that is not positive has no factor or no answer
                self._refuse_tangent(walk)
            elif walk.here is walk.base:
                raise
            else:
                self._go_back(walk)
            return None
        walk.escalated = walk.escalated or linear.escalated
        return self._judge(walk, linear.result)

    def _take_tangent(self, walk: Walk) -> None:
        """Go on with the tangent of where the walk is. Collective."""
        stage = walk.stage
        self.tangents += 1
        walk.solver = self._reference  # the tangent before gives its memory back
        tangent = stage.find_tangent(self._system, walk.here.d)
        if walk.care:
            tangent = self._brace(tangent, walk.here.active, SHARES[walk.care])
        walk.solver = self._prepare(stage, make_matrix(self._system, stage, tangent))
        walk.acceleration = self._make_acceleration()
        walk.tangent_due = False

    def _brace(self, tangent: Matrix, closed: Mask, share: float) -> Matrix:
        """Return a tangent with stiff springs at closed points, and a share of the reference.

        Without its contact a compressed body may be about to buckle. The springs change nothing in
        the answer of a pass whose closed points stay closed, as these do not move then.

        Args:
            tangent: p'(u).
            closed: (m,) points.
            share: of K, in the place of as much of the tangent.
        """
        system = self._system
        rows = self._problem.surface.owned[closed]
        springs = BRACE * np.abs(system.K.diagonal()[rows])
        brace = system.algebra.local(rows, rows, springs, system.rows)
        return system.algebra.combine([(1.0 - share, tangent), (share, system.K), (1.0, brace)])

    def _refuse_tangent(self, walk: Walk) -> None:
        """Go on with a tangent of more care.

        Where there is none the reference makes all further passes.
        """
        walk.care += 1
        if walk.refused:
            walk.solver = self._reference
        self._go_back(walk)

    def _go_back(self, walk: Walk) -> None:
        """Go on from the last place that was no extrapolation, by a tangent if there may be one."""
        walk.here = walk.base
        walk.acceleration = self._make_acceleration()
        walk.tangent_due = not walk.refused

    def _pose_about(self, walk: Walk) -> StepProblem:
        """Return the linear step about where the walk is."""
        whole = walk.whole
        surface = whole.surface
        here = walk.here
        slip0 = whole.slip0
        if slip0 is not None:
            slip0 = slip0 - surface.tangential_values(here.d)
        return replace(
            whole,
            A=walk.solver.A,
            b=here.rest,
            bound=whole.bound - surface.normal_values(here.d),
            slip0=slip0,
            active=here.active,
            origin=here.d if whole.origin is None else whole.origin + here.d,
        )

    def _judge(self, walk: Walk, result: StepResult) -> Pass:
        """Return where a linear step has led, with the certificate of the equations as they are.

        Args:
            walk: so far.
            result: the answer of the step.
        """
        whole = walk.whole
        surface = whole.surface
        d0 = walk.here.d
        d = d0 + result.x

        # Rounding of the sum must not open a closed point, nor move one that sticks.
        bound = whole.bound - surface.normal_values(d0)
        closed: Mask = surface.normal_values(result.x) == bound
        surface.put_normal(d, whole.bound, closed)
        if whole.slip0 is not None:
            slip0 = whole.slip0 - surface.tangential_values(d0)
            sticks = surface.tangential_values(result.x) == slip0
            surface.put_tangential(d, whole.slip0, sticks)
        rest = find_rest(self._system, walk.stage, d)
        answer = replace(result, x=d)
        certificate = kkt_residual(whole, answer, whole.b - rest)
        return Pass(Place(d, rest, result.active), answer, certificate)

    def _is_answer(self, walk: Walk, there: Pass) -> bool:
        """Take a pass into account, and tell whether the best one is the answer.

        It is one far below the tolerance, or below it where this pass gains nothing more.
        """
        worst = there.certificate.worst
        before = walk.least
        if worst < before:
            walk.rate = worst / before if isfinite(before) else 1.0
            walk.best = there
        if worst <= NEAR * self._tolerance:
            return True
        return walk.least <= self._tolerance and worst > SETTLED * before

    def _extrapolate(self, walk: Walk, there: Pass) -> None:
        """Go on from the best pass so far, or from where it points to. Collective."""
        end = there.place
        start = walk.here
        walk.base = end
        walk.here = end
        walk.outside = True
        d = walk.acceleration.extrapolate(start.d, end.d - start.d)
        if len(walk.acceleration.points) > 1:
            rest = find_rest(self._system, walk.stage, d)
            if self._is_finite(rest):
                walk.here = Place(d, rest, end.active)
        walk.tangent_due = self._wants_tangent(walk)

    def _wants_tangent(self, walk: Walk) -> bool:
        """Tell whether the passes that are still expected cost more than a new factor.

        With the rate of the best pass so many are expected: log(aim/residual) / log(rate).
        """
        if walk.rate == 1.0 or walk.refused:
            return False
        left = ln(NEAR * self._tolerance / walk.least) / ln(walk.rate)
        return left > self._cost + MARGIN

    def _fall_back(self, walk: Walk, there: Pass) -> None:
        """Go on after a pass that was not the best. Collective.

        An extrapolation that led there is given up; else a part of the way is gone.
        """
        if walk.here is walk.base:
            walk.base = self._shorten(walk, there)
        self._go_back(walk)

    def _shorten(self, walk: Walk, there: Pass) -> Place:
        """Return how far to go towards the end of a pass. Collective.

        Args:
            walk: which is at its start.
            there: its end.

        Raises:
            StepFailure: no part of the way leads to forces that are numbers, or down.
        """
        start = walk.here
        end = there.place
        way = end.d - start.d
        first = self._find_slope(there, start.rest, way)
        last = self._find_slope(there, end.rest, way)

        def ask(part: float) -> tuple[Place, float]:
            """Return the place after a part of the way, and the slope there."""
            d = start.d + part * way
            place = Place(d, find_rest(self._system, walk.stage, d), end.active)
            return place, self._find_slope(there, place.rest, way)

        # Out of a moved obstacle the whole way is gone, and so is one that still leads down.
        if not walk.outside:
            walk.outside = isfinite(last)
            place = end if walk.outside else find_finite(ask)
        elif first < 0.0:
            place = end if last <= FLAT * abs(first) else find_flat(ask, first, last)
        elif walk.solver is self._reference and isfinite(last):
            place = end  # friction has no energy, and passes of the reference are trusted
        else:
            self._refuse_tangent(walk)  # it is not positive, as it leads up
            place = start
        if place is None:
            raise StepFailure(
                f"{_name(walk)}: no part of a linear step leads to less energy: {self._advice}"
            )
        return place

    def _find_slope(self, there: Pass, rest: Array, way: Array) -> float:
        """Return the slope of the potential along a way, -(rest - B_tᵀ scale r_t)·way. Collective.

        Infinite where it is no number.

        Args:
            there: the pass, whose tangential reactions are loads here.
            rest: rest(d) (n,) where the slope is asked for.
            way: of the pass (n,).
        """
        surface = self._problem.surface
        force = rest
        if there.result.r_t is not None:
            nothing = np.zeros_like(there.result.r_n)
            force = rest - surface.reaction_load(nothing, len(rest), there.result.r_t)
        slope = -self._system.algebra.dot(force, way)
        return slope if isfinite(slope) else np.inf

    def _finish(self, walk: Walk, count: int) -> Certified:
        """Return the best pass as the certified answer of the step."""
        best = walk.best
        assert best is not None  # it is the answer
        log.debug("%s: %d linear steps, %s", _name(walk), count, best.certificate)
        self.counts.append(count)
        return Certified(replace(best.result, iterations=count), best.certificate, walk.escalated)


def _name(walk: Walk) -> str:
    """Return the step in words."""
    whole = walk.whole
    return f"step {whole.k} at t = {whole.t:.6g} s of a body that is not linear"


def _count_passes_of_a_factor(problem: ContactProblem) -> float:
    """Return how many passes with a factor a new tangent with its factor costs."""
    space = problem.system.space
    n = max(space.unknowns, 3)
    if space.dimension == 3:
        return SPACE * n ** (2.0 / 3.0)
    return PLANE * n**0.5 / ln(n) if space.dimension == 2 else 1.0
