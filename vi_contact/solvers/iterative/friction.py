"""Solve a step with friction by semismooth Newton on all unknowns.

Closed normals and sticking tangents are a mask.

Every Newton step solves the linear problem of the present states (``friction_states``) by GMRES
(``friction_krylov``), to a hundredth of its residual. The first states are those of the reactions
of the last step, with the slip that the step predicts: A x - b at a predicted x is no contact
force. In the end every residual is formed afresh; reactions are put on their cone, and tangents
that stick where they were.
"""

import numpy as np

from ...core.algebra import Array, Comm, Mask, largest, max_abs
from ...core.errors import StepFailure
from ...core.step import StepProblem, StepResult
from ...core.surfaces import ContactSurface
from ...laws.friction import project
from .conjugate_gradients import GMRES_BROKE_DOWN, NOT_A_NUMBER, REASONS, told
from .contact import Contact
from .friction_krylov import Gmres, Turned
from .friction_states import LawOfStep, Limits, States, Tangents
from .layout import Layout
from .measures import Measured, Worth
from .operator import Operator
from .preconditioners import Inverse

SHARE = 1e-2  # of the residual of a linear problem that GMRES may leave
AHEAD = 0.1  # of what Newton's last step left: it leaves less and less
# of the largest friction limit: residual at which coefficients that are given are taken anew
ROUND = 1e-4
CIRCLES = 15  # Newton steps after which limits are given,
GIVEN, MOST_GIVEN = 8, 256  # for so many rounds at first, and twice as many every time after
STEPS = 150  # of Newton


class Friction:
    """Solve steps with friction of one A.

    ``last`` holds r_n (m,), r_t and slip (m, d - 1) of the answer before.
    """

    def __init__(
        self,
        surface: ContactSurface,
        contact: Contact,
        layout: Layout,
        diagonal: Array,
        operator: Operator,
        inverse: Inverse,
        *,
        tolerance: float,
        patience: int,
        name: str,
    ) -> None:
        self.comm: Comm = surface.comm
        self.surface, self.contact, self.layout, self.operator = surface, contact, layout, operator
        self.inverse, self.tolerance, self.name = inverse, tolerance, name
        self.tangents = Tangents(surface, layout.places, diagonal)
        turned = Turned(inverse.pc, operator.blocks.createVecLeft(), self.tangents)
        self.gmres = Gmres(self.comm, operator, contact, turned, patience)
        self.last: tuple[Array, Array, Array] | None = None
        self.worth = Worth(surface.comm, 3, tolerance)

    def solve(self, step: StepProblem) -> StepResult:
        """Return the step.

        Raises:
            StepFailure: on all ranks, with the history of residuals, when there is no answer.
        """
        newton = Newton(self, step)
        while not newton.solved():
            newton.advance()
        self.worth.keep()
        result, self.last = newton.answer()
        return result


class Newton:
    """Iterate over one step.

    ``history``: residuals over the forces; ``steps``: linear problems solved.
    """

    def __init__(self, of: Friction, step: StepProblem) -> None:
        self.of = of
        self.law = LawOfStep(step)
        assert step.slip0 is not None
        self.slip0 = step.slip0
        self.b = of.layout.padded(step.b)
        self.measured = Measured(step, self.b)
        self.history: list[float] = []
        self.steps, self._newton, self._rounds = 0, 0, GIVEN
        of.contact.begin(step)
        of.inverse.begin()
        self.x = of.layout.padded(step.guess)
        self._take(self._predicted())

    def _predicted(self) -> States:
        """Return the states of the last reactions and the predicted slip.

        Without any, points stick where they touch.
        """
        of, slip = self.of, self._slip()
        if of.last is None:
            none = np.zeros(len(slip))
            limits = self.law(np.zeros_like(slip), none, none)
            return States(
                of.tangents,
                limits,
                (none, of.tangents.c[:, None] * slip),
                slip,
                stuck=of.contact.closed & (limits.slope > 0.0),
            )
        last_r_n, last_r_t, last_slip = of.last
        r_n = np.where(of.contact.closed, last_r_n, 0.0)
        y_t = last_r_t + of.tangents.c[:, None] * slip
        return States(
            of.tangents,
            self._limits(slip, r_n, y_t),
            (r_n, y_t),
            slip,
            stuck=of.contact.closed & ~np.any(last_slip, axis=1) & (last_r_n > 0.0),
        )

    def _slip(self) -> Array:
        """B_t x - slip0 (m, d - 1), zero where a tangent is prescribed."""
        of = self.of
        return np.where(of.surface.tangents >= 0, of.tangents.of(self.x) - self.slip0, 0.0)

    def _take(self, states: States, changed: Mask | None = None) -> None:
        """Take states and the closed set of the contact.

        What they hold is held, and the residual is formed, a product, unless nothing moved.
        ``changed``: conditions that closed or opened, None before the first residual.
        """
        of, contact, x = self.of, self.of.contact, self.x.copy()
        self.states = states
        contact.place(x)
        origin = of.tangents.flat(self.slip0)
        sticks = of.tangents.flat(np.repeat(states.stick[:, None], self.slip0.shape[1], axis=1))
        x[of.tangents.rows[sticks]] = origin[sticks]
        of.operator.set_springs(*contact.sprung)
        of.gmres.take(states)
        of.inverse.follow(np.concatenate([contact.held, states.held]))
        self.load = contact.load(self.b)
        moved = changed is None or bool(np.any(changed)) or not np.array_equal(x, self.x)
        if largest(of.comm, moved):
            self.x = x
            self._form()

    def _form(self) -> None:
        """Form the residual at x, and what follows from it."""
        of = self.of
        self.residual = self.load - (of.operator @ self.x)
        self.scales = self.measured(of.contact, self.x, self.residual, self.load)
        self.r_n = of.contact.reactions(self.x, self.residual)
        self.r_t, self.slip = of.tangents.of(self.residual), self._slip()
        self.limits = self._limits(self.slip, self.r_n, self.r_t)

    def _limits(self, slip: Array, r_n: Array, y_t: Array) -> Limits:
        return self.law(slip, r_n, np.linalg.norm(y_t, axis=1) / self.of.tangents.c)

    def _rubbed(self) -> Array:
        """Return the friction (m, d - 1) that the law allows next to r_t.

        It is along a slip that is certain, or the projection.
        """
        limit, size = self.limits(self.r_n), np.linalg.norm(self.slip, axis=1)
        y_t = self.r_t + self.of.tangents.c[:, None] * self.slip
        along = self.slip * (limit / np.where(size > 0.0, size, 1.0))[:, None]
        goal = self.of.tolerance * self.scales.force
        certain = (np.linalg.norm(y_t, axis=1) > limit) & (
            np.linalg.norm(self.r_t - along, axis=1) <= 0.5 * goal
        )
        return np.where(certain[:, None], along, project(y_t, limit))

    def solved(self) -> bool:
        """Say whether x solves the step.

        Raises:
            StepFailure: x is not a number, or there were too many steps.
        """
        of = self.of
        error = np.where(of.contact.weights() > 0.0, self.residual, 0.0)
        error[of.tangents.rows] = of.tangents.flat(self.r_t - self._rubbed())
        wrong = self._wrong(0.0)
        local = np.array(
            [max_abs(error), np.any(wrong), max_abs(self.limits(self.r_n))], dtype=float
        )
        self.error, any_wrong, limit = of.comm.max(np.where(np.isnan(local), np.inf, local))
        force = self.scales.force
        self.history.append(self.error / force if 0.0 < force < np.inf else self.error)
        if not np.isfinite(self.error):
            raise self._stopped(*REASONS[NOT_A_NUMBER])
        self.goal = of.worth.goal(
            self.error, self.scales, self.x, self.r_n, self.r_t, begin=self.steps == 0
        )
        if self.law.settled and self.error <= self.goal and not any_wrong:
            return True
        if not self.law.settled and not any_wrong and self.error <= max(ROUND * limit, self.goal):
            self.law.advance(self.slip, self.r_n)
            self.limits = self._limits(self.slip, self.r_n, self.r_t)
            return self.solved()
        if self.steps == STEPS:
            raise self._stopped(
                "the states of friction did not settle", "take a smaller step of time or load"
            )
        self._newton += self.law.settled
        if self._newton > CIRCLES:
            self._leave_the_circle()
        return False

    def _leave_the_circle(self) -> None:
        """Give limits or coefficients for some rounds, from which Newton begins anew."""
        self.of.operator.work.fallbacks += self._rounds == GIVEN
        self.law.give(self._rounds, self.slip, self.r_n)
        self._newton, self._rounds = 0, min(2 * self._rounds, MOST_GIVEN)

    def _wrong(self, error: float) -> Mask:
        """Conditions whose signs are wrong by more than the error of the residual."""
        least = 0.5 * self.of.tolerance * self.scales.reaction
        return self.of.contact.wrong(
            self.x, self.r_n, error=error, least_force=least, x_ref=self.scales.displacement
        )

    def advance(self) -> None:
        """Solve the linear problem of the states, and take those of its solution."""
        of = self.of
        residual = np.where(of.gmres.free > 0.0, self.residual, 0.0)
        rows = of.tangents.rows
        residual[rows] = (
            of.tangents.flat(self.states.residual(self.r_n, self.r_t, self.slip))
            * of.gmres.free[rows]
        )
        last = self.history[-2:]
        share = min(SHARE, AHEAD * last[1] / last[0]) if last[0] > 0.0 and len(last) > 1 else SHARE
        dx, left, reason = of.gmres.solve(residual, share, 0.5 * self.goal)
        if reason < 0:
            raise self._stopped(*REASONS.get(reason, GMRES_BROKE_DOWN))
        of.operator.work.newton_steps += 1
        self.steps += 1
        self.x += dx
        self._form()
        self._take(*self._next(left))

    def _next(self, error: float) -> tuple[States, Mask]:
        """Return the states at x, and the conditions that close or open with them."""
        of, contact = self.of, self.of.contact
        wrong = self._wrong(0.0 if error <= self.goal else error)
        stiffness = np.where(contact.soft, contact.k, contact.diagonal)
        pressed = stiffness * (self.x[contact.rows] - contact.bound)
        y_n = np.where(wrong, np.where(contact.closed, 0.0, pressed), self.r_n)
        contact.change(wrong)
        y_t = self.r_t + of.tangents.c[:, None] * self.slip
        limits = self._limits(self.slip, y_n, y_t)
        return States(of.tangents, limits, (y_n, y_t), self.slip, before=self.states), wrong

    def answer(self) -> tuple[StepResult, tuple[Array, Array, Array]]:
        """Return the result, and what the next step begins with."""
        of, contact = self.of, self.of.contact
        pulls = ~contact.bilateral & (self.r_n < 0.0)
        self.r_n = np.where(pulls, 0.0, self.r_n)
        r_t = self._rubbed()
        y_t = self.r_t + of.tangents.c[:, None] * self.slip
        limit = self.limits(self.r_n)
        still = (np.linalg.norm(y_t, axis=1) <= limit) & (limit > 0.0)
        x = of.layout.stripped(self.x)
        there = (of.surface.tangents >= 0) & still[:, None]
        x[of.surface.tangents[there]] = self.slip0[there]
        slip = np.where(still[:, None], 0.0, self.slip)
        result = StepResult(
            x=x,
            r_n=self.r_n,
            active=contact.closed.copy(),
            iterations=self.steps,
            method=of.name,
            r_t=r_t,
            history=tuple(self.history),
            aim=of.tolerance,
        )
        return result, (self.r_n, r_t, slip)

    def _stopped(self, words: str, remedy: str) -> StepFailure:
        """Return the failure, with the history of residuals."""
        return StepFailure(
            f"{self.of.name} stopped after {self.steps} Newton steps, {words} (residuals "
            f"{told(self.history)}): {remedy}"
        )
