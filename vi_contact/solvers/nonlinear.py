"""Solve the step of a body whose internal force is not linear, by certified linear steps.

What is asked for is the increment d and the reactions r of ``core.stage``,

    rest(d) = Bᵀ(scale r),    rest(d) = scale (f - carried - M a(d) - C v(d) - p(d))

with the contact conditions and the law of friction as they are. About an increment d_k each pass is
a linear step of the contract, for the change that is missing and for the *whole* reactions:

    A delta = rest(d_k) - Bᵀ(scale r),    conditions on d_k + delta

so that contact is exact in every pass, and a fixed point satisfies the equations as they are. The
certificate is that of the nonlinear equations: ``kkt_residual`` with rest(d) in the place of
b - A d. The loop is that of ``passes``.

A is m M + c C + k K with the reference stiffness K, whose factor is made once. Passes with it
converge linearly and are accelerated (``acceleration``). K is replaced by the tangent p'(u) where
the passes that are still expected would cost more than a new factor, counted by unknowns and never
by a clock, and where a pass has no smaller residual than the best one before it.

A tangent that is not symmetric (psi < phi) is taken as a whole, by its LU, where ``Condensed``
makes the passes and contact conditions are few; else its symmetric part leads the passes, which may
then converge slowly or not at all.

From such a pass only a part may be gone. Between d_k and d_k + delta, which both are outside of the
obstacle, the potential of all forces falls at first, if A is positive definite, with the slope
-(rest - B_tᵀ scale r_t)·delta. The whole way is gone where its slope at the end is negative or
small, else as far as that (``line_search``). The first pass, which brings d out of a moved
obstacle, is gone as a whole where the forces at its end are numbers.
"""

import logging
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from math import isfinite
from math import log as ln
from typing import Any

import numpy as np

from ..core.algebra import Array, EffectiveMatrix, Mask, Matrix, largest, max_abs
from ..core.errors import InputError, StepFailure
from ..core.problem import ContactProblem
from ..core.sizes import OWN_CONDITIONS
from ..core.stage import NonlinearForces, add_increment
from ..core.step import Solver, StepProblem, StepResult
from ..core.verify import kkt_residual
from .acceleration import Anderson
from .automatic import Automatic
from .certified import ADVICE, NEAR, CertifiedSolver
from .condensed import Condensed
from .door import describe_place
from .line_search import FLAT, find_finite, find_flat
from .normal.lemke import Lemke
from .passes import Certified, Passes, certify, pose_about

log = logging.getLogger(__name__)

MOST = 60  # passes of a step
# Passes with the reference that a new tangent with its factor costs, over the root of the unknowns
# over their logarithm in the plane, and over their power 2/3 in space (measured: 15 and 45 passes
# at 2e4 unknowns, which are the exponents of nested dissection).
PLANE = 1.05
SPACE = 0.061
MARGIN = 4.0  # passes that a tangent needs itself
# The share of the reference in tangents, each tried where the one before was of no use. All but the
# first are braced at the contact.
SHARES = (0.0, 0.0, 0.1, 0.4)
FAR = 1e3  # times the increment so far: a pass that adds so much is by a tangent that is singular
TURNED = 0.5  # half the angle of a step that is too long for anything else
STARTS = (1.0, 0.5, 0.25, 0.0)  # shares of the way of a turning body that are tried in turn
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
class Pass(Certified):
    """Hold where a pass has led: its answer has x = d, its certificate is of the nonlinear step.

    Attributes:
        place: its end.
    """

    place: Place


@dataclass
class Walk:
    """Hold where the next pass of one step starts, and how it is made.

    Attributes:
        whole: the step.
        forces: of the step.
        here: where the next pass starts.
        base: the last place that no extrapolation has made.
        solver: of the passes.
        acceleration: what the passes with this matrix have shown.
        outside: whether ``base`` is outside of the obstacle, as the end of every pass is.
        tangent_due: whether the next pass is one with a new tangent.
        care: how many tangents were of no use: place in ``SHARES`` of the next one.
        escalated: whether a pass was by a method that was escalated to.
    """

    whole: StepProblem
    forces: NonlinearForces
    here: Place
    base: Place
    solver: CertifiedSolver
    acceleration: Anderson
    outside: bool = False
    tangent_due: bool = False
    care: int = 0
    escalated: bool = False

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
        A: EffectiveMatrix,
        scale: float,
        solvers: Sequence[Solver],
        tolerance: float,
        *,
        advice: str = ADVICE,
    ) -> None:
        """Prepare the reference. Collective.

        Args:
            problem: the contact problem.
            A: the effective matrix of its steps, with the reference stiffness.
            scale: of reactions, over which compliances are divided.
            solvers: of linear steps, and the methods to escalate to.
            tolerance: the largest residual of a certificate.
            advice: end of the sentence that refuses a step.
        """
        self._problem = problem
        self._scale = scale
        self._solvers = solvers
        self._tolerance = tolerance
        self._advice = advice
        self.tangents = 0
        self.counts: list[int] = []
        self.A = A
        self._reference = self._prepare(A)
        # Whole tangents that are not symmetric: where few conditions are condensed, with no joint.
        internal = problem.system.internal
        surface = problem.surface
        conditions = surface.total * (1 + surface.tangents.shape[1])
        self._takes_whole = (
            conditions <= OWN_CONDITIONS
            and problem.joint is None
            and not getattr(internal, "symmetric", True)
            and getattr(problem.system.algebra, "keeps_whole", False)
            and isinstance(solvers[0], Automatic | Condensed)
        )
        self._cost = _count_passes_of_a_factor(problem)

    def _prepare(self, A: EffectiveMatrix) -> CertifiedSolver:
        """Return the certified solver of linear steps with a matrix."""
        return CertifiedSolver(
            self._problem, A, self._scale, self._solvers, self._tolerance, advice=self._advice
        )

    def _prepare_whole(self, A: EffectiveMatrix) -> CertifiedSolver:
        """Return the certified solver of linear steps by the LU of a tangent.

        Its contact is condensed by methods that take any matrix: Lemke's, and Newton's with
        friction.

        Args:
            A: which is not symmetric.
        """
        algebra: Any = A.algebra
        whole = EffectiveMatrix(A.matrix, algebra.unsymmetric(), space=A.space, inertia=A.inertia)
        solvers = [Condensed(Lemke())]
        return CertifiedSolver(
            self._problem, whole, self._scale, solvers, self._tolerance, advice=self._advice
        )

    def solve(self, step: StepProblem) -> Certified:
        """Return the certified answer of a step, x = d. Collective.

        Raises:
            StepFailure: no pass came below the tolerance, or a linear step has no answer.
        """
        walk = self._begin(step)
        passes: Passes[Pass] = Passes(tolerance=self._tolerance, goal=NEAR * self._tolerance)
        is_certified = certify(passes, self._go(walk, passes), MOST)
        self.counts.append(passes.count)
        best = passes.best
        if best is not None and is_certified:
            log.debug("%s: %d linear steps, %s", _name(step), passes.count, best.certificate)
            return replace(best, result=replace(best.result, iterations=passes.count))
        if walk.forces.turns:
            self._refuse_turning(step, best)
        reached = "" if best is None else f" ({best.certificate})"
        if walk.care:
            reached += "; its tangent is not positive there, as that of a body that gives way"
        raise StepFailure(
            f"{_name(step)} did not come below the certificate tolerance {self._tolerance:g} in "
            f"{MOST} linear steps{reached}: {self._advice}"
        )

    def _refuse_turning(self, step: StepProblem, best: Pass | None) -> None:
        """Raise StepFailure for a step of a body that turns. Collective.

        Args:
            step: the step.
            best: its best pass; None where none has led anywhere.
        """
        place = ""
        if best is not None:
            result = best.result
            surface = self._problem.surface
            load = surface.reaction_load(result.r_n, len(result.x), result.r_t)
            left = np.abs(best.place.rest - load)
            left[~np.isfinite(left)] = np.inf  # as of cells that are inside out
            wrong = left == largest(surface.comm, max_abs(left))
            points = self._problem.system.space.coordinates
            place = describe_place(surface.comm, wrong, points)
            place = f"; the forces are the farthest from balance{place} of the undeformed body"
        raise StepFailure(
            f"{_name(step)} did not come below the certificate tolerance {self._tolerance:g}, as "
            f"where a step is so long that what lands crushes the cells behind it{place}: give "
            "the run dt=HalvedAtImpact(dt, halvings=6), which makes such a step in parts, or a "
            "smaller dt"
        )

    def _begin(self, step: StepProblem) -> Walk:
        """Return the walk that begins at the guess of a step. Collective.

        Raises:
            StepFailure: the internal force is no number there, as that of a body inside out.
        """
        forces = step.forces
        assert isinstance(forces, NonlinearForces)  # linear bodies have no walk
        d = forces.find_start()
        if d is not None:
            start = self._find_upright(step, forces, d)
        elif step.internal is not None and not self._is_finite(step.internal):
            raise StepFailure(
                f"{_name(step)} begins where its internal force is NaN or infinite: {self._advice}"
            )
        else:
            start = Place(step.guess, step.b, step.active)
        walk = Walk(step, forces, start, start, self._reference, self._make_acceleration())
        # The reference of a body that has turned is of no use: its passes go with a tangent, in
        # static stages too.
        walk.tangent_due = forces.may_have_turned
        return walk

    def _find_upright(self, step: StepProblem, forces: NonlinearForces, d: Array) -> Place:
        """Return where passes of a body that turns begin. Collective.

        A stop in a step leaves velocities that would turn cells inside out on their way on. Then a
        part of the way is gone from the displacement before, where no cell is inside out.

        Args:
            step: the step.
            forces: of the step.
            d: the increment (n,) at the end of the way.
        """
        old = forces.find_old()
        for part in STARTS:
            start = old + part * (d - old) if part < 1.0 else d
            rest = forces.find_rest(start)
            if self._is_finite(rest):
                break
        return Place(start, rest, step.active)

    def _go(self, walk: Walk, passes: Passes[Pass]) -> Iterator[Pass]:
        """Yield passes, each from where the ones before point to. Collective.

        Args:
            walk: where the first one starts.
            passes: what they have shown.
        """
        while True:
            there = self._make_pass(walk)
            if there is None:
                continue  # another way is open, of which there are few
            yield there
            if passes.best is there:
                self._extrapolate(walk, there, passes)
            else:
                self._fall_back(walk, there)

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
            here = walk.here
            posed = pose_about(walk.whole, here.d, here.rest, here.active, walk.solver.A)
            linear = walk.solver.solve(posed)
            self._refuse_runaway(walk, linear.result.x)
        except (InputError, StepFailure) as refusal:
            log.debug("%s: a pass is of no use (%s)", _name(walk.whole), refusal)
            of_tangent = walk.tangent_due or walk.solver is not self._reference
            if of_tangent:  # one that is not positive has no factor or no answer
                self._refuse_tangent(walk)
            elif walk.here is walk.base:
                raise
            else:
                self._go_back(walk)
            return None
        walk.escalated = walk.escalated or linear.escalated
        return self._judge(walk, posed, linear.result)

    def _refuse_runaway(self, walk: Walk, x: Array) -> None:
        """Raise StepFailure for a pass that a whole tangent sends far away. Collective.

        Such a tangent may be all but singular, as flow is not unique where psi < phi: stresses are
        lost in the rounding of the strains then, and balanced all the same.

        Args:
            walk: where the pass starts.
            x: what it adds to the increment (n,).
        """
        if not self._takes_whole or walk.solver is self._reference:
            return
        system = self._problem.system
        far = system.algebra.dot(x, x)
        gone = system.algebra.dot(walk.here.d, walk.here.d)
        # the first way from the beginning of a step may have any length
        if gone > 0.0 and far > FAR**2 * gone:
            raise StepFailure("a tangent leads too far")

    def _take_tangent(self, walk: Walk) -> None:
        """Go on with the tangent of where the walk is. Collective."""
        self.tangents += 1
        walk.solver = self._reference  # the tangent before gives its memory back
        tangent = walk.forces.find_tangent(walk.here.d, whole=self._takes_whole)
        if walk.care:
            tangent = self._brace(walk, tangent, SHARES[walk.care])
        A = walk.forces.make_matrix(tangent)
        walk.solver = self._prepare_whole(A) if self._takes_whole else self._prepare(A)
        walk.acceleration = self._make_acceleration()
        walk.tangent_due = False

    def _brace(self, walk: Walk, tangent: Matrix, share: float) -> Matrix:
        """Return a tangent with stiff springs at closed points, and a share of the reference.

        Without its contact a compressed body may be about to buckle. The springs change nothing in
        the answer of a pass whose closed points stay closed, as these do not move then.

        Args:
            walk: where the tangent is taken.
            tangent: p'(u).
            share: of K, in the place of as much of the tangent.
        """
        system = walk.forces.system
        surface = walk.whole.surface
        # Traces have no unknown to brace: their closed points may move together.
        braced = walk.here.active if surface.traces is None else np.zeros(surface.count, dtype=bool)
        rows = surface.owned[braced]
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

    def _judge(self, walk: Walk, posed: StepProblem, result: StepResult) -> Pass:
        """Return where a linear step has led, with the certificate of the equations as they are.

        Args:
            walk: so far.
            posed: the linear step.
            result: its answer.
        """
        whole = walk.whole
        d = add_increment(walk.here.d, whole.bound, whole.slip0, posed, result)
        answer = replace(result, x=d)
        if walk.forces.turns:
            # Forces of the guess, a straight way, may be a thousand times those of the answer.
            rest, acting, internal = walk.forces.measure(d)
            whole = replace(whole, b=acting, internal=internal)
        else:
            rest = walk.forces.find_rest(d)
        certificate = kkt_residual(whole, answer, rest)
        return Pass(answer, certificate, walk.escalated, Place(d, rest, result.active))

    def _extrapolate(self, walk: Walk, there: Pass, passes: Passes[Pass]) -> None:
        """Go on from the best pass so far, or from where it points to. Collective."""
        end = there.place
        start = walk.here
        walk.base = end
        walk.here = end
        walk.outside = True
        d = walk.acceleration.extrapolate(start.d, end.d - start.d)
        if len(walk.acceleration.points) > 1:
            rest = walk.forces.find_rest(d)
            if self._is_finite(rest):
                walk.here = Place(d, rest, end.active)
        walk.tangent_due = not walk.refused and self._wants_tangent(walk, passes)

    def _wants_tangent(self, walk: Walk, passes: Passes[Pass]) -> bool:
        """Tell whether the passes that are still expected cost more than a new factor.

        With the rate of the best pass so many are expected: log(aim/residual) / log(rate). That of
        a body that turns is about half the angle of the step, wherever its tangent is taken: a new
        one is no better, unless the rate is worse than that.

        Args:
            walk: so far.
            passes: what they have shown.
        """
        if passes.rate == 1.0 or (walk.forces.turns and passes.rate < TURNED):
            return False
        left = ln(passes.goal / passes.least) / ln(passes.rate)
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
            place = Place(d, walk.forces.find_rest(d), end.active)
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
            if walk.forces.turns:
                self._refuse_turning(walk.whole, there)
            raise StepFailure(
                f"{_name(walk.whole)}: no part of a linear step leads to less energy: "
                f"{self._advice}"
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
        slope = -self._problem.system.algebra.dot(force, way)
        return slope if isfinite(slope) else np.inf


def _name(step: StepProblem) -> str:
    """Return the step in words."""
    return f"step {step.k} at t = {step.t:.6g} s of a body that is not linear"


def _count_passes_of_a_factor(problem: ContactProblem) -> float:
    """Return how many passes with a factor a new tangent with its factor costs."""
    space = problem.system.space
    n = max(space.unknowns, 3)
    if space.dimension == 3:
        return SPACE * n ** (2.0 / 3.0)
    return PLANE * n**0.5 / ln(n) if space.dimension == 2 else 1.0
