"""Solve a step with a joint by passes, until the strength used is that of the answer.

A pass is a step of the contract with known strengths F, C, mu and P (``core.joints``). Its answer
opens the joint by g and slips it by w, and the law has other strengths there. Newton's method
(``joint_newton``) expects an end of the step, and the law there gives the next strengths. Newton's
method goes on from there without a pass, while the points that are closed and those that stick stay
the same ones; where it meets all conditions it has the answer, as it mostly does. Else another pass
is made. Where a pass is no better than the best one, a part of Newton's step is gone. A joint that
holds everywhere needs no pass.

A point that has opened by very little closes on a steep line, F(kappa) g/kappa. There a constant
strength moves a point much further than the law would, and passes may go to and fro for good. After
``MOST`` of them the tension follows the opening *inside* a pass, as a spring of the law's slope
(``CondensedPasses.make_sprung``), which a few passes settle.

Where Newton's matrix is not positive, the joint loses more than the bodies give way: the step has
several answers (*snap-back*). The next pass then takes the strengths of the answer as they are,
which goes on from the strength before the step, and the log says so.

With ``Condensed`` all passes are on the contact unknowns (``condensed_passes``), and a step costs
one forward and one backward substitution as without a joint. Other solvers make whole steps, which
are accelerated (``acceleration``).
"""

import logging
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np

from ..core.algebra import Array, max_abs
from ..core.errors import InputError, StepFailure
from ..core.joints import JointStep, Strength, compare, judge_strength
from ..core.step import StepProblem
from ..core.verify import kkt_residual
from .acceleration import Anderson
from .certified import Certified
from .condensed_passes import CondensedPasses, Expected, PassEnd
from .joint_newton import correct
from .joint_rates import RatePasses, find_push

log = logging.getLogger(__name__)

MOST = 100  # passes of a step
FASTER = 0.1  # of what was missed before: Newton's method goes on with the sets that it has
# of the largest reaction: what an end misses that is near enough to be the one that passes lead to
CLOSE = 1e-3
SPRUNG = 200  # passes of a step on springs
SHARE = 0.1  # the least part of a pass on springs that is gone
AIM = 0.1  # of the tolerance: what passes on the contact unknowns come to
WATER = 400  # times that water follows what a static stage has opened
ADVICE = "try a smaller dt, or a joint that loses its strength over a longer way"


class JointSolver:
    """Solve steps with a joint, of one effective matrix.

    Attributes:
        passes: how many each step took.
        snapped: steps with a snap-back inside.
    """

    def __init__(
        self,
        solve: Callable[[StepProblem], Certified],
        prepared: Any,
        tolerance: float,
        *,
        advice: str = ADVICE,
    ) -> None:
        """Note what solves the steps.

        Args:
            solve: returns the certified answer of a step.
            prepared: the prepared solver, whose ``make_passes`` is used; None for none.
            tolerance: the largest residual of a certificate.
            advice: end of the sentence that refuses a step.
        """
        self._solve = solve
        self._make_passes = getattr(prepared, "make_passes", None)
        self._tolerance = tolerance
        self._advice = advice if self._make_passes else f"give solver=Condensed(), or {advice}"
        self.passes: list[int] = []
        self.snapped = 0
        self._rates: RatePasses | None = None

    def solve(self, base: StepProblem, joint: JointStep) -> tuple[StepProblem, Certified]:
        """Return the step for r' with its strength, and its certified answer. Collective.

        Args:
            base: the step without its joint.
            joint: at the beginning of the step.

        Raises:
            StepFailure: no pass has the strength of its answer, or a step has no answer.
        """
        if joint.at_end and getattr(joint.law, "water_follows", False):
            return self._follow_water(base, joint)
        return self._solve_passes(base, joint)

    def _follow_water(self, base: StepProblem, joint: JointStep) -> tuple[StepProblem, Certified]:
        """Solve a static stage whose water enters what opens. Collective.

        The water is held fast while the passes find the rest; then it goes where the joint has
        opened. More water opens more, so that pressures only grow, from those before the stage to
        the nearest answer above them. Faster methods could pass it by.

        Args:
            base: the stage without its joint.
            joint: at its beginning.

        Raises:
            StepFailure: there is no equilibrium: the water lifts the body off.
        """
        used = joint.guess(base)
        passes = 0
        for count in range(1, WATER + 1):
            held = replace(joint, water=used.water)
            try:
                step, certified = self._solve_passes(base, held)
            except (StepFailure, InputError) as failure:  # bodies that loads carry off are refused
                if count == 1:
                    raise
                raise _tell_uplift(
                    base, f"pass {count} has no equilibrium ({failure})"
                ) from failure
            passes += self.passes.pop()
            found = certified.result
            g1, s1 = joint.find_end(step, found)
            there = replace(joint, used=step.joint.used).ask(g1, s1)
            whole = replace(step, joint=replace(step.joint, water=None))
            judged = _with_law(whole, certified)
            if judged.certificate.law <= self._tolerance:
                self.passes.append(passes)
                return whole, judged
            used = there
        raise _tell_uplift(base, f"the crack still grows after {WATER} passes")

    def _solve_passes(self, base: StepProblem, joint: JointStep) -> tuple[StepProblem, Certified]:
        """Return the step for r' with its strength, and its certified answer. Collective.

        Args:
            base: the step without its joint.
            joint: at the beginning of the step.
        """
        if not joint.implicit:
            self.passes.append(1)
            return self._judge(joint.apply(base, joint.guess(base)))
        small = None if self._make_passes is None else self._make_passes(base)
        if hasattr(joint.law, "at_speed"):
            return self._solve_rates(base, joint, small)
        if small is not None and small.stiffness is not None and base.surface.total:
            return self._solve_small(base, joint, small)
        return self._solve_whole(base, joint, joint.guess(base))

    def _judge(self, step: StepProblem) -> tuple[StepProblem, Certified]:
        """Return a step and its certified answer, with ``law`` in the certificate. Collective."""
        certified = self._solve(_without_joint(step))
        return step, _with_law(step, certified)

    def _solve_whole(
        self, base: StepProblem, joint: JointStep, used: Strength
    ) -> tuple[StepProblem, Certified]:
        """Solve by passes that are whole steps. Collective.

        Args:
            base: the step without its joint.
            joint: at the beginning.
            used: the strength to begin with.
        """
        acceleration = Anderson(base.surface.comm.sum)
        for count in range(1, MOST + 1):
            step, certified = self._judge(joint.apply(base, used))
            if certified.certificate.law <= self._tolerance:
                self.passes.append(count)
                return step, certified
            g1, s1 = joint.find_end(step, certified.result)
            used = _extrapolate(acceleration, used, joint.ask(g1, s1))
        raise self._refuse(base, certified.certificate.law)

    def _solve_small(
        self, base: StepProblem, joint: JointStep, small: CondensedPasses
    ) -> tuple[StepProblem, Certified]:
        """Solve by passes on the contact unknowns. Collective.

        Args:
            base: the step without its joint.
            joint: at the beginning.
            small: makes the passes.
        """
        surface = base.surface
        small.begin(base)
        used = joint.guess(base)
        found = self._try_rest(base, joint, used, small)
        if found is not None:
            self.passes.append(1)
            return found
        lag = np.inf
        least = np.inf
        part = 1.0  # of Newton's step that is gone
        snaps = False
        end: PassEnd | None = None
        for count in range(1, MOST + 1):
            step = joint.apply(base, used)
            push = find_push(step, small.width)
            try:
                end = small.make(step, push, end)
            except StepFailure:  # whole steps have methods to escalate to
                return self._solve_whole(base, joint, used)
            g1, s1 = joint.end_at(
                surface.mine(end.gap), surface.mine(end.slip), surface.mine(end.closed)
            )
            there = joint.ask(g1, s1)
            r_n = np.maximum(surface.mine(end.r[:, 0]), 0.0) / step.scale
            friction = np.abs(there.mu - used.mu) * r_n
            force = max_abs(step.b) / step.scale
            lag = compare(surface, there, used, friction, used.mu * r_n, force)
            if lag <= AIM * self._tolerance:
                self.passes.append(count)
                return self._finish(step, small, push, end, count)
            part = min(1.0, 2.0 * part) if lag < least else 0.5 * part
            least = min(least, lag)
            expected = correct(joint, end, small, (g1, s1), there, used, step.scale)
            if expected is None:
                snaps = self._tell_snap(base, told=snaps)
                used = there
                continue
            if part < 1.0:
                g2 = surface.mine(expected.gap)
                s2 = s1 + surface.mine(expected.slip - end.slip)
                used = joint.ask(g1 + part * (g2 - g1), s1 + part * (s2 - s1))
                continue
            step, answer = self._follow(base, joint, small, expected, count)
            if answer is not None:
                self.passes.append(count)
                return step, answer
            used = step.joint.used
        found = self._solve_sprung(base, joint, small)
        if found is not None:
            return found
        # Passes by whole steps take another way, and ask methods that were named to escalate to.
        return self._solve_whole(base, joint, joint.guess(base))

    def _try_rest(
        self, base: StepProblem, joint: JointStep, used: Strength, small: CondensedPasses
    ) -> tuple[StepProblem, Certified] | None:
        """Return the answer where no point opens or slips, as of a joint that holds. Collective.

        Then no small problem is solved. None where some point moves, which the passes find.

        Args:
            base: the step without its joint.
            joint: at the beginning.
            used: the strength to begin with.
            small: makes the passes.
        """
        surface = base.surface
        if surface.some(~base.active | (joint.g0 > 0.0)):
            return None
        if base.slip0 is not None and surface.some(~joint.find_sticking(used)):
            return None
        still = np.ones(surface.total, dtype=bool)
        nothing = np.zeros((surface.total, small.width))
        place = Expected(nothing[:, 0], nothing[:, 1:], still, still)
        step = joint.apply(base, used)
        push = find_push(step, small.width)
        end, missing = small.settle(step, small.balance(step, push, place))
        if not missing <= AIM * self._tolerance:
            return None
        answer = _certify(step, small, push, end, 1)
        return (step, answer) if answer.worst <= self._tolerance else None

    def _follow(
        self,
        base: StepProblem,
        joint: JointStep,
        small: CondensedPasses,
        expected: Expected,
        count: int,
        *,
        force: float = 0.0,
    ) -> tuple[StepProblem, Certified | None]:
        """Repeat Newton's method from where it leads, while the sets stay. Collective.

        No small problem is solved. It ends at the answer of the step, or where the conditions of
        contact and friction are no longer met better.

        Args:
            base: the step without its joint.
            joint: at the beginning.
            small: makes the passes.
            expected: the end of the step after the last pass.
            count: how many passes there were.
            force: beside which reactions may be rounding, ``scale`` times newtons.

        Returns:
            The step with the last strength, and its certified answer; None: it has none.
        """
        surface = base.surface
        least = CLOSE / FASTER
        while True:
            g1 = surface.mine(expected.gap)
            s1 = joint.s0 + surface.mine(expected.slip)
            used = joint.ask(g1, s1)
            step = joint.apply(base, used)
            push = find_push(step, small.width)
            there = small.balance(step, push, expected)
            end, missing = small.settle(step, there, force=force)
            if missing <= AIM * self._tolerance:
                answer = _certify(step, small, push, end, count)
                return step, answer if answer.worst <= self._tolerance else None
            if not missing <= FASTER * least:
                return step, None
            least = missing
            further = correct(joint, there, small, (g1, s1), used, used, step.scale)
            if further is None:
                return step, None
            expected = further

    def _solve_sprung(
        self, base: StepProblem, joint: JointStep, small: CondensedPasses
    ) -> tuple[StepProblem, Certified] | None:
        """Return the answer by passes whose tension is on springs; None: there is none. Collective.

        They begin at the state before the step. Each has the law as a line about an expected end,
        and its own end is the next one. The limit of friction is that of the expected end.

        Args:
            base: the step without its joint.
            joint: at the beginning.
            small: makes the passes.
        """
        surface = base.surface
        gap = np.asarray(surface.everywhere(joint.g0))
        slip = np.zeros((len(gap), small.width - 1))
        least = np.inf
        part = 1.0  # of a pass that is gone
        for count in range(1, SPRUNG + 1):
            g1 = surface.mine(gap)
            s1 = joint.s0 + surface.mine(slip)
            used = joint.ask(g1, s1)
            step = joint.apply(base, used)
            slope = np.asarray(surface.everywhere(joint.find_slope(g1, s1).tension))
            # A closed point loses nothing until it opens.
            springs = step.scale * np.where(gap > 0.0, slope, np.maximum(slope, 0.0))
            push = find_push(step, small.width)
            try:
                expected = small.make_sprung(step, push, gap, springs)
                if expected is None:
                    # A snap-back: what is lost is lost between passes, which lead away from where
                    # the step began, so that they miss more before they miss less.
                    least = np.inf
                    springs = np.maximum(springs, 0.0)
                    expected = small.make_sprung(step, push, gap, springs)
            except StepFailure:
                return None
            if expected is None:
                return None

            # What its end misses: the tension of the law there against that of the line, and the
            # limits of friction at both ends.
            line = used.tension + surface.mine(springs * (expected.gap - gap)) / step.scale
            there = joint.ask(surface.mine(expected.gap), joint.s0 + surface.mine(expected.slip))
            limit = used.cohesion - used.mu * used.tension
            friction = np.abs(there.cohesion - there.mu * there.tension - limit)
            force = max_abs(step.b) / step.scale
            lag = compare(surface, there, used._replace(tension=line), friction, limit, force)
            step, answer = self._follow(base, joint, small, expected, count, force=max_abs(push))
            if answer is not None:
                self.passes.append(MOST + count)
                return step, answer
            part = min(1.0, 2.0 * part) if lag < least else max(0.5 * part, SHARE)
            least = min(least, lag)
            gap = gap + part * (expected.gap - gap)
            slip = slip + part * (expected.slip - slip)
        return None

    def _finish(
        self, step: StepProblem, small: CondensedPasses, push: Array, end: PassEnd, count: int
    ) -> tuple[StepProblem, Certified]:
        """Return the answer of the last pass; a whole step where it is not certified. Collective.

        Args:
            step: the step for r' with the strength of the last pass.
            small: which has made it.
            push: its further forces.
            end: where it has led.
            count: how many passes there were, which are the iterations of the step.
        """
        answer = _certify(step, small, push, end, count)
        if answer.worst <= self._tolerance:
            return step, answer
        step, certified = self._judge(step)
        if not certified.certificate.law <= self._tolerance:
            raise self._refuse(step, certified.certificate.law)
        return step, certified

    def _solve_rates(
        self, base: StepProblem, joint: JointStep, small: CondensedPasses | None
    ) -> tuple[StepProblem, Certified]:
        """Solve a step of a law of slip rates. Collective.

        Args:
            base: the step without its joint.
            joint: at the beginning.
            small: makes the passes; None: there is none.
        """
        if small is None or small.stiffness is None or small.width == 1:
            raise StepFailure(
                f"{type(joint.law).__name__} is solved for the slip rate on the contact unknowns: "
                "give solver=Condensed()"
            )
        if self._rates is None:
            self._rates = RatePasses(small)
        step, push, end, count = self._rates.solve(base, joint)
        self.passes.append(count)
        return self._finish(step, small, push, end, count)

    def _tell_snap(self, base: StepProblem, *, told: bool) -> bool:
        """Log, once a step on rank 0, that it has several answers; return True: it is told.

        Args:
            base: the step.
            told: whether this has been done.
        """
        if told:
            return True
        self.snapped += 1
        if base.surface.comm.rank == 0:
            log.info(
                "step %d at t = %.6g s: the joint snaps back inside the step, so the answer that "
                "is reached from the strength before it is taken",
                base.k,
                base.t,
            )
        return True

    def _refuse(self, base: StepProblem, lag: float) -> StepFailure:
        """Return the error of a step whose strength is not that of its answer."""
        self.passes.append(MOST)
        return StepFailure(
            f"step {base.k} at t = {base.t:.6g} s: after {MOST} passes the strength of the joint "
            f"still changes by {lag:.1e} of the largest: {self._advice}"
        )


def _tell_uplift(base: StepProblem, what: str) -> StepFailure:
    """Return the error of a static stage that water lifts.

    Args:
        base: the stage.
        what: what the passes have come to.
    """
    return StepFailure(
        f"step {base.k} at t = {base.t:.6g} s: uplift: the water follows the opening of the joint, "
        f"and {what}: lower the level, add weight or drains, or march in time, where inertia "
        "decides"
    )


def _certify(
    step: StepProblem, small: CondensedPasses, push: Array, end: PassEnd, count: int
) -> Certified:
    """Return the answer of a pass with its certificate. Collective.

    Args:
        step: the step for r' with the strength of the pass.
        small: which has made it.
        push: its further forces.
        end: where it has led.
        count: how many passes there were, which are the iterations of the step.
    """
    result = replace(small.finish(push, end), iterations=count)
    return Certified(result, kkt_residual(step, result), escalated=False)


def _without_joint(step: StepProblem) -> StepProblem:
    """Return the step as solvers see it, whose certificate says nothing of the law."""
    return replace(step, joint=None)


def _with_law(step: StepProblem, certified: Certified) -> Certified:
    """Return a certified answer with ``law`` in its certificate. Collective."""
    law = judge_strength(step, certified.result)
    certificate = replace(certified.certificate, law=law)
    return replace(certified, certificate=certificate)


def _extrapolate(acceleration: Anderson, used: Strength, there: Strength) -> Strength:
    """Return the next strength of passes without Newton's method. Collective.

    Args:
        acceleration: what the passes have shown.
        used: the strength of a pass [N].
        there: that of its answer.
    """
    # Forces and mu are of unlike sizes, and Anderson's method weighs differences: mu counts in the
    # size of the forces.
    size = max(max_abs(used.tension), max_abs(used.cohesion), max_abs(used.water))
    scale = np.array([1.0, 1.0, size or 1.0, 1.0])
    before = np.concatenate([s * part for s, part in zip(scale, used, strict=True)])
    after = np.concatenate([s * part for s, part in zip(scale, there, strict=True)])
    found = np.maximum(acceleration.extrapolate(before, after - before), 0.0)
    tension, cohesion, mu, water = found.reshape(4, -1) / scale[:, None]
    return Strength(tension, np.maximum(cohesion, mu * tension), mu, water)
