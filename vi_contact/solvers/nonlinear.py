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
converge linearly and are accelerated (D. G. Anderson, 1965, Iterative procedures for nonlinear
integral equations). Where the passes that are still expected would cost more than a new factor,
counted by unknowns and never by a clock, and where a pass does not help, K is replaced by the
tangent p'(u). Of a pass with a tangent that does not help only a part of the way is gone, as far as
the certificate's own residual becomes smaller.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import log as ln

import numpy as np

from ..core.algebra import Array, EffectiveMatrix, Mask
from ..core.certificate import Certificate
from ..core.errors import InputError, StepFailure
from ..core.problem import ContactProblem
from ..core.stage import Stage, find_rest, make_matrix, pose
from ..core.step import Solver, StepProblem, StepResult
from ..core.system import SemiDiscreteSystem
from ..core.verify import kkt_residual
from .certified import ADVICE, NEAR, Certified, CertifiedSolver

log = logging.getLogger(__name__)

MOST = 60  # passes of a step
DEPTH = 5  # passes that the acceleration remembers
HALVINGS = 10  # of a pass that does not help
ARMIJO = 1e-2  # of the part of a pass: the part of the residual that it must take away
SETTLED = 0.5  # of the residual before: a pass that gains less brings no more digits
# Passes with the reference that a new tangent with its factor costs, over the root of the unknowns
# over their logarithm in the plane, and over their power 2/3 in space (measured: 15 and 45 passes
# at 2e4 unknowns, which are the exponents of nested dissection).
PLANE = 1.05
SPACE = 0.061
MARGIN = 4.0  # passes that a tangent needs itself


@dataclass
class Anderson:
    """Extrapolate passes d -> d + delta(d) from the last few of them.

    The next d is that of the affine combination of the last passes whose delta is the smallest in
    the Euclidean norm over all ranks.

    Attributes:
        sum_over_ranks: adds up arrays over all ranks.
        points: the last d.
        changes: their delta.
    """

    sum_over_ranks: object
    points: list[Array]
    changes: list[Array]

    def extrapolate(self, d: Array, delta: Array) -> Array:
        """Return where the next pass starts. Collective.

        Args:
            d: where this pass started (n,).
            delta: what it changed (n,).
        """
        self.points.append(d)
        self.changes.append(delta)
        del self.points[: -DEPTH - 1]
        del self.changes[: -DEPTH - 1]
        if len(self.points) == 1:
            return d + delta

        # Least squares by the normal equations of the differences, which are few; directions that
        # are lost to rounding are left out.
        of_points = np.diff(np.array(self.points), axis=0)
        of_changes = np.diff(np.array(self.changes), axis=0)
        products = np.column_stack([of_changes @ of_changes.T, of_changes @ delta])
        products = self.sum_over_ranks(products)  # type: ignore[operator]
        weights = np.linalg.lstsq(products[:, :-1], products[:, -1], rcond=1e-12)[0]
        step: Array = delta - weights @ (of_points + of_changes)
        return d + step


@dataclass(frozen=True)
class Pass:
    """Hold where a pass has led.

    Attributes:
        d: the increment (n,).
        rest: rest(d) (n,).
        result: its answer, with x = d.
        certificate: of the nonlinear step.
    """

    d: Array
    rest: Array
    result: StepResult
    certificate: Certificate


class NonlinearSolver:
    """Solve steps of one length; the reference is factorised once for all of them.

    Attributes:
        tangents: how many tangents have been made.
        passes: how many linear steps.
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
        self.passes = 0
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
        whole = pose(self._problem, stage, self.A, self._system)
        aim = NEAR * self._tolerance
        here = self._start(whole)
        best: Pass | None = None
        before = np.inf
        escalated = False
        solver = self._reference
        A = self.A
        may_be_tangent = True
        accelerate = self._begin_acceleration()
        for count in range(1, MOST + 1):
            try:
                linear = solver.solve(self._pose_about(whole, here, A))
            except (InputError, StepFailure) as refusal:
                # A tangent that is not positive, as that of a body about to buckle, has no factor
                # or no answer: the reference goes on from here, without tangents.
                if solver is self._reference:
                    raise
                log.debug("step %d: a tangent is of no use (%s)", whole.k, refusal)
                solver = self._reference
                A = self.A
                may_be_tangent = False
                accelerate = self._begin_acceleration()
                continue
            escalated = escalated or linear.escalated
            self.passes += 1
            there = self._judge(stage, whole, here, linear.result)
            worst = there.certificate.worst
            settled = best is not None and worst > SETTLED * best.certificate.worst
            if best is None or worst < best.certificate.worst:
                best = there
            certified = best.certificate.worst <= self._tolerance
            if worst <= aim or (certified and settled):
                return whole, self._finish(whole, best, count, escalated)

            # A pass that does not help: the reference is too soft or too stiff, and a tangent takes
            # its place; with a tangent, only a part of the way is gone.
            helps = worst < before
            if helps:
                here = self._move(stage, here, there, accelerate)
            elif solver is not self._reference or not np.isfinite(worst):
                there = self._shorten(stage, whole, here, linear.result, before)
                worst = there.certificate.worst
                here = there
            wanted = not helps or self._wants_tangent(worst, before, aim)
            if wanted and may_be_tangent:
                A = self._make_tangent(stage, here)
                solver = self._prepare(stage, A)
                accelerate = self._begin_acceleration()
            before = worst if helps or here is there else before
        reached = "" if best is None else f" ({best.certificate})"
        raise StepFailure(
            f"step {whole.k} at t = {whole.t:.6g} s of a body that is not linear did not come "
            f"below the certificate tolerance {self._tolerance:g} in {MOST} linear steps{reached}: "
            f"{self._advice}"
        )

    def _shorten(
        self, stage: Stage, whole: StepProblem, here: Pass, result: StepResult, before: float
    ) -> Pass:
        """Return the longest part of a pass that makes the residual of the certificate smaller.

        Displacements and reactions go the same part of their way. Collective.

        Args:
            stage: the balance.
            whole: the step at the guess.
            here: where the pass started.
            result: the answer of its linear step.
            before: the residual where it started; infinite where nothing is known of it.

        Raises:
            StepFailure: no part helps.
        """
        old = here.result
        for part in 0.5 ** np.arange(1, HALVINGS + 1):
            r_t = result.r_t
            if r_t is not None:
                r_t = part * r_t if old.r_t is None else old.r_t + part * (r_t - old.r_t)
            shorter = replace(
                result,
                x=part * result.x,
                r_n=old.r_n + part * (result.r_n - old.r_n),
                r_t=r_t,
            )
            there = self._judge(stage, whole, here, shorter)
            if there.certificate.worst < (1.0 - ARMIJO * part) * before:
                return there
        raise StepFailure(
            f"step {whole.k} at t = {whole.t:.6g} s of a body that is not linear: no part of a "
            f"linear step makes the residual {before:.1e} smaller: {self._advice}"
        )

    def _begin_acceleration(self) -> Anderson:
        return Anderson(self._problem.surface.comm.sum, [], [])

    def _start(self, whole: StepProblem) -> Pass:
        """Return the guess as a pass that has led nowhere yet."""
        surface = whole.surface
        none = StepResult(whole.guess, np.zeros(surface.count), whole.active, 0, "")
        return Pass(whole.guess, whole.b, none, Certificate(np.inf, 0.0, 0.0, 0.0))

    def _pose_about(self, whole: StepProblem, here: Pass, A: EffectiveMatrix) -> StepProblem:
        """Return the linear step about an increment.

        Args:
            whole: the step at the guess.
            here: the increment, with its rest.
            A: the matrix of the pass.
        """
        surface = whole.surface
        slip0 = whole.slip0
        if slip0 is not None:
            slip0 = slip0 - surface.tangential_values(here.d)
        origin = here.d if whole.origin is None else whole.origin + here.d
        return replace(
            whole,
            A=A,
            b=here.rest,
            bound=whole.bound - surface.normal_values(here.d),
            slip0=slip0,
            active=here.result.active,
            origin=origin,
        )

    def _judge(self, stage: Stage, whole: StepProblem, here: Pass, result: StepResult) -> Pass:
        """Return where a linear step has led, with the certificate of the equations as they are.

        Args:
            stage: the balance.
            whole: the step at the guess.
            here: where the linear step began.
            result: its answer.
        """
        surface = whole.surface
        d = here.d + result.x

        # Rounding of the sum must not open a closed point, nor move one that sticks.
        closed: Mask = surface.normal_values(result.x) == whole.bound - surface.normal_values(
            here.d
        )
        surface.put_normal(d, whole.bound, closed)
        if whole.slip0 is not None:
            slip0 = whole.slip0 - surface.tangential_values(here.d)
            sticks = surface.tangential_values(result.x) == slip0
            surface.put_tangential(d, whole.slip0, sticks)
        rest = find_rest(self._system, stage, d)
        answer = replace(result, x=d)
        return Pass(d, rest, answer, kkt_residual(whole, answer, whole.b - rest))

    def _move(self, stage: Stage, here: Pass, there: Pass, accelerate: Anderson) -> Pass:
        """Return from where the next pass starts. Collective.

        Args:
            stage: the balance.
            here: where this pass started.
            there: where it led.
            accelerate: what the passes before say.
        """
        d = accelerate.extrapolate(here.d, there.d - here.d)
        if len(accelerate.points) == 1:
            return there
        return replace(there, d=d, rest=find_rest(self._system, stage, d))

    def _wants_tangent(self, worst: float, before: float, aim: float) -> bool:
        """Tell whether the passes that are still expected cost more than a new factor.

        With the rate of the last pass so many are expected: log(aim/worst) / log(worst/before).

        Args:
            worst: residual now.
            before: that of the pass before; infinite for the first one.
            aim: the residual to come to.
        """
        if not np.isfinite(before):
            return False
        if not worst < before:
            return True
        return ln(aim / worst) / ln(worst / before) > self._cost + MARGIN

    def _make_tangent(self, stage: Stage, here: Pass) -> EffectiveMatrix:
        """Return A with the tangent at an increment."""
        system = self._system
        if system.internal is None:
            return self.A
        self.tangents += 1
        u = stage.u(here.d)
        if stage.old is not None:
            share, u0 = stage.old
            u = u - share * u0
        return make_matrix(system, stage, system.internal.tangent(u))

    def _finish(self, whole: StepProblem, best: Pass, count: int, escalated: bool) -> Certified:
        """Return the best pass as the certified answer of the step."""
        log.debug(
            "step %d at t = %.6g s: %d linear steps, residual %.1e",
            whole.k,
            whole.t,
            count,
            best.certificate.worst,
        )
        result = replace(best.result, iterations=count)
        return Certified(result, best.certificate, escalated)


def _count_passes_of_a_factor(problem: ContactProblem) -> float:
    """Return how many passes with a factor a new tangent with its factor costs."""
    space = problem.system.space
    n = max(space.unknowns, 3)
    if space.dimension == 3:
        return SPACE * n ** (2.0 / 3.0)
    return PLANE * n**0.5 / ln(n) if space.dimension == 2 else 1.0
