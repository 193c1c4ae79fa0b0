"""Solve a step with friction by semismooth Newton on all unknowns.

Closed normals and sticking tangents are held: they are a mask on the full-size vectors, and the
residual in their rows is the reaction, r = b - A x. With the states of the points (open, stick,
slip) one step of a time scheme goes

1. ``_predict_states``: the states of the reactions of the step before, with the slip that this step
   predicts. A x - b at a predicted x is no contact force, so that it cannot tell them.
2. ``_apply_states``: put what is held into x, and form the residual.
3. ``judge``: end where the error is below the goal; the law may take other coefficients.
4. ``advance``: solve the linear problem of the states (``friction_states``) by GMRES
   (``friction_krylov``), to a hundredth of its residual; take the states at the new x; go to 2.
5. ``answer``: reactions are put on their cone, and tangents that stick where they were.

Where the states go in circles, limits or coefficients of friction are given for some rounds: a
*round* ends where x solves the step with those that are given, and takes new ones. Vectors are
padded to whole nodes (``layout``).
"""

from typing import NamedTuple

import numpy as np

from ...core.algebra import Array, Comm, Mask, largest, max_abs
from ...core.errors import StepFailure
from ...core.step import StepProblem, StepResult
from ...core.surfaces import ContactSurface
from ...laws.friction import project
from .conjugate_gradients import GMRES_BROKE_DOWN, NOT_A_NUMBER, REASONS, format_residuals
from .contact import ClosedSet
from .friction_krylov import Gmres, TurnedInverse
from .friction_states import LawOfStep, Limits, States, Tangents
from .layout import Layout
from .measures import StepMeasure, Worth
from .operator import Operator
from .preconditioners import Inverse

SHARE = 1e-2  # of the residual of a linear problem that GMRES may leave, or less:
AHEAD = 0.1  # of the factor by which Newton's last step has lowered the residual
ROUND = 1e-4  # of the largest friction limit: residual at which a round ends
CIRCLES = 15  # Newton steps after which limits or coefficients are given
GIVEN = 8  # rounds for which they are at first, and for twice as many every time after,
MOST_GIVEN = 256  # up to so many
STEPS = 150  # of Newton, at most


class LastContact(NamedTuple):
    """Hold what the next step begins with: reactions and slip of the answer of this one."""

    r_n: Array  # (m,)
    r_t: Array  # (m, d - 1)
    slip: Array  # (m, d - 1)


class FrictionSolver:
    """Solve steps with friction of one A.

    Attributes:
        tangents: where the tangential unknowns are.
        gmres: solves the linear problems.
        last: reactions and slip of the answer before; None at first.
        worth: tells how small residuals have to be.
    """

    def __init__(
        self,
        surface: ContactSurface,
        contact: ClosedSet,
        layout: Layout,
        diagonal: Array,
        operator: Operator,
        inverse: Inverse,
        *,
        tolerance: float,
        patience: int,
        name: str,
    ) -> None:
        """Make GMRES for this A.

        Args:
            surface: the contact surface.
            contact: the closed set, which every step changes.
            layout: where the unknowns stand in padded vectors.
            diagonal: of A, padded.
            operator: A with the closed springs.
            inverse: the preconditioner of the frictionless step.
            tolerance: relative error that an answer may have.
            patience: linear iterations of one linear problem, at most.
            name: of the solver, for messages.
        """
        self.comm: Comm = surface.comm
        self.surface = surface
        self.contact = contact
        self.layout = layout
        self.operator = operator
        self.inverse = inverse
        self.tolerance = tolerance
        self.name = name
        self.tangents = Tangents(surface, layout.places, diagonal)
        turned = TurnedInverse(inverse.pc, operator.blocks.createVecLeft(), self.tangents)
        self.gmres = Gmres(self.comm, operator, contact, turned, patience)
        self.last: LastContact | None = None
        self.worth = Worth(surface.comm, 3, tolerance)

    def solve(self, step: StepProblem) -> StepResult:
        """Return the answer to a step. Collective.

        Raises:
            StepFailure: on all ranks, with the history of residuals, when there is no answer.
        """
        newton = FrictionNewtonStep(self, step)
        while not newton.judge():
            newton.advance()
        self.worth.keep()
        result, self.last = newton.answer()
        return result


class FrictionNewtonStep:
    """Iterate by Newton's method over one step.

    Attributes:
        x: the iterate, padded.
        states: which points stick and slip in the next linear problem.
        load: b, padded, with the load of closed springs.
        residual: load - (A + K_s) x: the reactions, in held rows.
        r_n, r_t, slip: reactions and slip at x.
        limits: of friction at x.
        scales: what residuals are relative to.
        goal: residual below which x solves the step.
        history: residuals over the forces.
        steps: linear problems solved.
    """

    def __init__(self, solver: FrictionSolver, step: StepProblem) -> None:
        self.solver = solver
        self.law = LawOfStep(step)
        assert step.slip0 is not None
        self.slip0 = step.slip0
        self.b = solver.layout.pad(step.b)
        self.measure = StepMeasure(step, self.b)
        self.history: list[float] = []
        self.steps = 0
        self._newton_steps = 0  # with the step's own law, since something was given last
        self._rounds = GIVEN  # for which limits or coefficients are given next
        solver.contact.begin(step)
        solver.inverse.begin()
        self.x = solver.layout.pad(step.guess)
        self._apply_states(self._predict_states())

    def _predict_states(self) -> States:
        """Return the states of the last reactions and the predicted slip.

        Where no step was solved before, points stick where they touch.
        """
        solver = self.solver
        tangents = solver.tangents
        closed = solver.contact.closed
        slip = self._compute_slip()

        # No reactions are known: y = c slip alone, which would let all points slip.
        if solver.last is None:
            none = np.zeros(len(slip))
            limits = self.law(np.zeros_like(slip), none, none)
            y_t = tangents.c[:, None] * slip
            stuck = closed & (limits.slope > 0.0)
            return States(tangents, limits, (none, y_t), slip, stuck=stuck)

        # y = r + c slip with the last reactions; points that stuck under pressure stick again.
        last = solver.last
        r_n = np.where(closed, last.r_n, 0.0)
        y_t = last.r_t + tangents.c[:, None] * slip
        stuck = closed & ~np.any(last.slip, axis=1) & (last.r_n > 0.0)
        return States(tangents, self._find_limits(slip, r_n, y_t), (r_n, y_t), slip, stuck=stuck)

    def _compute_slip(self) -> Array:
        """Return B_t x - slip0 (m, d - 1), zero where a tangent is prescribed."""
        solver = self.solver
        moved = solver.tangents.values(self.x) - self.slip0
        return np.where(solver.surface.tangents >= 0, moved, 0.0)

    def _apply_states(self, states: States, changed: Mask | None = None) -> None:
        """Take these states and the closed set of the contact, and hold in x what they hold.

        The residual is then formed, which costs a product, unless nothing moved.

        Args:
            states: which points stick and slip.
            changed: (m,) conditions that closed or opened; None before the first residual.
        """
        solver = self.solver
        contact = solver.contact
        tangents = solver.tangents
        self.states = states

        # Closed rigid conditions go onto their bound, sticking tangents where the slip is zero.
        x = self.x.copy()
        contact.place(x)
        origin = tangents.flatten(self.slip0)
        stick = np.repeat(states.stick[:, None], self.slip0.shape[1], axis=1)
        sticks = tangents.flatten(stick)
        x[tangents.rows[sticks]] = origin[sticks]

        # Matrix, preconditioner and load of the linear problem follow the closed set.
        solver.operator.set_springs(*contact.sprung)
        solver.gmres.apply_states(states)
        solver.inverse.follow(np.concatenate([contact.held, states.held]))
        self.load = contact.load(self.b)

        moved = changed is None or bool(np.any(changed)) or not np.array_equal(x, self.x)
        if largest(solver.comm, moved):
            self.x = x
            self._update_residual()

    def _update_residual(self) -> None:
        """Form the residual at x, and what follows from it."""
        solver = self.solver
        self.residual = self.load - (solver.operator @ self.x)
        self.scales = self.measure(solver.contact, self.x, self.residual, self.load)
        self.r_n = solver.contact.reactions(self.x, self.residual)
        self.r_t = solver.tangents.values(self.residual)
        self.slip = self._compute_slip()
        self.limits = self._find_limits(self.slip, self.r_n, self.r_t)

    def _find_limits(self, slip: Array, r_n: Array, y_t: Array) -> Limits:
        """Return the friction limits at a slip, for points that y_t would move from rest."""
        return self.law(slip, r_n, np.linalg.norm(y_t, axis=1) / self.solver.tangents.c)

    def _put_on_cone(self) -> Array:
        """Return the friction (m, d - 1) that the law allows next to r_t.

        It is along the slip where that is certain, and the projection of y_t elsewhere.
        """
        tangents = self.solver.tangents
        limit = self.limits(self.r_n)
        size = np.linalg.norm(self.slip, axis=1)
        y_t = self.r_t + tangents.c[:, None] * self.slip
        along = self.slip * (limit / np.where(size > 0.0, size, 1.0))[:, None]

        # y_t = r_t + c slip loses digits of a small slip beside a large force, or the reverse: a
        # slip is certain where the point slides, and r_t is along it to half the tolerance.
        goal = self.solver.tolerance * self.scales.force
        slides = np.linalg.norm(y_t, axis=1) > limit
        is_along = np.linalg.norm(self.r_t - along, axis=1) <= 0.5 * goal
        return np.where((slides & is_along)[:, None], along, project(y_t, limit))

    def judge(self) -> bool:
        """Judge x, and say whether it solves the step. Collective.

        Where it solves the step with coefficients or limits that are given, the next ones are taken
        and x is judged again.

        Raises:
            StepFailure: x is not a number, or there were too many steps.
        """
        solver = self.solver
        tangents = solver.tangents

        # The residual of free rows; in the rows of tangents, what r_t misses of the law.
        error = np.where(solver.contact.weights() > 0.0, self.residual, 0.0)
        error[tangents.rows] = tangents.flatten(self.r_t - self._put_on_cone())
        wrong = self._find_wrong_signs(0.0)
        local = np.array(
            [max_abs(error), np.any(wrong), max_abs(self.limits(self.r_n))], dtype=float
        )
        sizes = solver.comm.max(np.where(np.isnan(local), np.inf, local))
        self.error, any_wrong, limit = sizes

        # How small the error has to be, from what x and the reactions have changed by.
        force = self.scales.force
        self.history.append(self.error / force if 0.0 < force < np.inf else self.error)
        if not np.isfinite(self.error):
            raise self._make_failure(*REASONS[NOT_A_NUMBER])
        self.goal = solver.worth.goal(
            self.error, self.scales, self.x, self.r_n, self.r_t, begin=self.steps == 0
        )
        if self.law.settled and self.error <= self.goal and not any_wrong:
            return True

        # An answer with given coefficients or limits need not be exact: the next ones come sooner.
        # The error with them is another, and is judged at once.
        is_round_done = not any_wrong and self.error <= max(ROUND * limit, self.goal)
        if not self.law.settled and is_round_done:
            self.law.advance(self.slip, self.r_n)
            self.limits = self._find_limits(self.slip, self.r_n, self.r_t)
            return self.judge()

        # x does not solve the step: refuse, or see to it that Newton does not go in circles.
        if self.steps == STEPS:
            raise self._make_failure(
                "the states of friction did not settle", "take a smaller step of time or load"
            )
        if self.law.settled:
            self._newton_steps += 1
        if self._newton_steps > CIRCLES:
            self._leave_the_circle()
        return False

    def _leave_the_circle(self) -> None:
        """Give limits or coefficients for some rounds, from which Newton begins anew."""
        if self._rounds == GIVEN:
            self.solver.operator.work.fallbacks += 1
        self.law.give(self._rounds, self.slip, self.r_n)
        self._newton_steps = 0
        self._rounds = min(2 * self._rounds, MOST_GIVEN)

    def _find_wrong_signs(self, error: float) -> Mask:
        """Return the conditions (m,) whose signs are wrong by more than the error of the residual.

        The error is in the unit of forces.
        """
        solver = self.solver
        return solver.contact.wrong_signs(
            self.x,
            self.r_n,
            error=error,
            least_force=0.5 * solver.tolerance * self.scales.reaction,
            x_ref=self.scales.displacement,
        )

    def advance(self) -> None:
        """Solve the linear problem of the states, and take the states of its solution."""
        solver = self.solver
        tangents = solver.tangents

        # Right-hand side: the residual off the held rows, and in the rows of tangents that slip
        # what is left of the linearised law.
        free = solver.gmres.free
        residual = np.where(free > 0.0, self.residual, 0.0)
        left_of_law = self.states.residual(self.r_n, self.r_t, self.slip)
        residual[tangents.rows] = tangents.flatten(left_of_law) * free[tangents.rows]

        # How exact: as Newton converges, more than it gained last.
        share = SHARE
        if len(self.history) > 1 and self.history[-2] > 0.0:
            share = min(SHARE, AHEAD * self.history[-1] / self.history[-2])
        dx, left, reason = solver.gmres.solve(residual, share, 0.5 * self.goal)
        if reason < 0:
            raise self._make_failure(*REASONS.get(reason, GMRES_BROKE_DOWN))

        solver.operator.work.newton_steps += 1
        self.steps += 1
        self.x += dx
        self._update_residual()
        self._apply_states(*self._update_states(left))

    def _update_states(self, error: float) -> tuple[States, Mask]:
        """Return the states at x, and the conditions (m,) that close or open with them.

        The error is what the linear problem left of its residual.
        """
        solver = self.solver
        contact = solver.contact
        tangents = solver.tangents
        wrong = self._find_wrong_signs(0.0 if error <= self.goal else error)

        # y_n is r_n; of a condition that closes it is what presses it back onto its bound.
        stiffness = np.where(contact.soft, contact.k, contact.diagonal)
        pressed = stiffness * (self.x[contact.rows] - contact.bound)
        y_n = np.where(wrong, np.where(contact.closed, 0.0, pressed), self.r_n)
        contact.change(wrong)

        y_t = self.r_t + tangents.c[:, None] * self.slip
        limits = self._find_limits(self.slip, y_n, y_t)
        return States(tangents, limits, (y_n, y_t), self.slip, before=self.states), wrong

    def answer(self) -> tuple[StepResult, LastContact]:
        """Return the result, and what the next step begins with."""
        solver = self.solver
        contact = solver.contact
        tangents = solver.tangents

        # Reactions on their cone: no tension but of bilateral conditions, r_t as the law allows.
        pulls = ~contact.bilateral & (self.r_n < 0.0)
        self.r_n = np.where(pulls, 0.0, self.r_n)
        r_t = self._put_on_cone()

        # Tangents that stick go exactly where the slip is zero.
        y_t = self.r_t + tangents.c[:, None] * self.slip
        limit = self.limits(self.r_n)
        still = (np.linalg.norm(y_t, axis=1) <= limit) & (limit > 0.0)
        x = solver.layout.strip(self.x)
        held = (solver.surface.tangents >= 0) & still[:, None]
        x[solver.surface.tangents[held]] = self.slip0[held]
        slip = np.where(still[:, None], 0.0, self.slip)

        result = StepResult(
            x=x,
            r_n=self.r_n,
            active=contact.closed.copy(),
            iterations=self.steps,
            method=solver.name,
            r_t=r_t,
            history=tuple(self.history),
            aim=solver.tolerance,
        )
        return result, LastContact(self.r_n, r_t, slip)

    def _make_failure(self, words: str, remedy: str) -> StepFailure:
        """Return the error of a step without an answer, with the history of residuals."""
        return StepFailure(
            f"{self.solver.name} stopped after {self.steps} Newton steps, {words} (residuals "
            f"{format_residuals(self.history)}): {remedy}"
        )
