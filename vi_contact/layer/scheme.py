"""Step by the midpoint rule with the boundary layer in the place of the exact inequality.

    u1 - u0 = ½ dt (v0 + v1)
    M (v1 - v0)/dt + ½ C (v0 + v1) + ½ K (u0 + u1) = f(t0 + ½ dt) - B_nᵀ r̄_n
    r̄_n = weight · p̄(gap1; gap0, rate0)

p̄ is ``ContactLayer.mean_pressure``. The contact points' part is solved first, by Newton's method
in their gaps on the compliance G = B A⁻¹ Bᵀ; its reactions are loads of the step, which then goes
to the solver as any other. The exact inequality stays on behind the layer as a guard and never
closes: the certificate certifies the equilibrium, with the layer's reactions, and an open gap.

Order 2. Energy: r̄_n does the work of a potential, of the damper (never positive) and of the
metric's inertia, all of it booked as contact work; what the layer holds at a time comes back when
the gap opens.
"""

from dataclasses import dataclass, replace
from typing import ClassVar
from weakref import WeakKeyDictionary

import numpy as np

from ..core.algebra import Array, EffectiveMatrix, max_abs
from ..core.checks import instance
from ..core.errors import InputError, StepFailure
from ..core.problem import ContactProblem
from ..core.sizes import refuse_dense
from ..core.stage import Answer, Stage
from ..core.step import State, StepProblem
from ..schemes.midpoint import Midpoint
from ..solvers.condensed import Condensed
from .contact_law import ContactLayer

NEWTON_STEPS = 60
HALVINGS = 30
LEAST_SHARE = 0.2  # of a gap, below which Newton's method does not begin
RATE = "layer_rate"  # in a state's memory: d ln(gap)/dt of the contact points [1/s]
# Newton's method ends at such changes of the gaps.
GAP_TOLERANCE = 1e-11  # relative to the gaps
ROUNDING = 1e-15  # relative to the displacements that a gap is a difference of


@dataclass(frozen=True, kw_only=True)
class BoundaryLayer(Midpoint):
    """Step by the midpoint rule with the law of a boundary layer at the contact points.

    The equations are those at the head of this file. There is no friction, supports are rigid and
    at rest, and there is mass at the contact nodes. Reactions push away from the obstacle. The
    gap that the surface has is that to the obstacle, so that a body at rest begins at the edge of
    the layer after ``ContactLayer.set_back``.

    Raises:
        InputError: the law is none, or, when a run begins, the problem has friction, an impact law
            or other supports, or a gap that is not positive.
        StepFailure: Newton's method for the gaps of a step fails.
    """

    by_rows: ClassVar[bool] = False  # each run has gaps of its own

    law: ContactLayer

    def __post_init__(self) -> None:
        instance("BoundaryLayer", "law", self.law, ContactLayer, "give contact_layer(...)")

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError for what the law does not cover."""
        super().check(problem)
        surface = problem.surface
        problem.system.refuse_nonlinear("BoundaryLayer", "use an impact law, such as Newton(e)")
        if problem.frictional:
            raise InputError(
                f"BoundaryLayer is a law without friction: leave {problem.friction} out"
            )
        if problem.impact is not None:
            raise InputError(
                f"BoundaryLayer makes the rebound itself: leave the impact law {problem.impact} out"
            )
        if surface.some(surface.bilateral | (surface.compliance != 0.0)):
            raise InputError(
                "BoundaryLayer needs unilateral contact on rigid supports: leave held points, "
                "springs out"
            )
        if surface.motion is not None:
            raise InputError(
                "BoundaryLayer needs an obstacle at rest: move the body's support instead"
            )
        refuse_dense(
            "BoundaryLayer", surface.total, instead="an impact law with restitution, Newton(e)"
        )

    def start(self, problem: ContactProblem, state: State, dt: float) -> State:
        """Return the state as it is.

        Args:
            problem: the problem of the run.
            state: with which the run begins.
            dt: first time step [s].

        Raises:
            InputError: the layer would have to begin behind the obstacle.
        """
        surface = problem.surface
        gap = surface.everywhere(surface.gap(state.t) - surface.normal_values(state.u))
        if len(gap) and not gap.min() > 0.0:
            where = int(np.argmin(gap))
            raise InputError(
                f"contact point {where} starts with gap {gap[where]:.3g} m, outside the admissible "
                "set of the layer, gap > 0: move the obstacle back by the layer's width, for "
                "example with ContactLayer.set_back(surface)"
            )
        return state

    def press(
        self, problem: ContactProblem, state: State, stage: Stage, step: StepProblem, dt: float
    ) -> Stage:
        """Return the midpoint's stage with the layer's reactions in its balance. Collective.

        Args:
            problem: the problem of the run.
            state: at the beginning of the step.
            stage: the midpoint's.
            step: what is posed of it, without the layer.
            dt: time step [s].

        Raises:
            StepFailure: a gap that is closed, or Newton's method for the gaps fails.
        """
        surface = problem.surface
        if surface.total == 0:
            return stage
        old = surface.gap(state.t) - surface.normal_values(state.u)
        closed, away = surface.comm.max(
            np.array([np.max(-old, initial=-np.inf), max_abs(stage.bound - old)])
        )
        if not closed < 0.0:
            raise StepFailure(
                f"step {step.k} at t = {step.t:.6g} s begins with a gap of {-closed:.1e} m, a "
                f"rounding error beside displacements of {away:.1e} m: make the layer wider"
            )

        # The gaps of all ranks: the old ones, those of the step without layer, and the old rates.
        A = step.A
        free = step.bound - surface.normal_values(A.factor.solve(step.b))
        rate = self._rate(problem, state, old)
        values = surface.everywhere(np.column_stack([old, free, rate, surface.weights]))
        old, free, rate, weights = (np.ascontiguousarray(column) for column in values.T)

        # The pressures where some gap is inside the layer, at the beginning or at the end.
        pressure = np.zeros(surface.total)
        if min(old.min(), free.min()) < self.law.layer.width:
            compliances: WeakKeyDictionary[EffectiveMatrix, Array] = problem.equations.make_once(
                "layer", WeakKeyDictionary
            )
            if A not in compliances:  # B A⁻¹ Bᵀ (m, m), made once for every A
                condensed = Condensed().prepare(A, surface, step.scale)
                compliances[A] = np.asarray(condensed.delassus)
            G = compliances[A] * (step.scale * weights)
            pressure = self._pressure(step, G, free, old, rate, dt)

        # They stand in the balance of the step, which has no contact of its own any more.
        reaction = surface.weights * pressure[surface.slots]
        carried = surface.reaction_load(reaction, len(step.b))
        return replace(stage, carried=carried, active=np.zeros(surface.count, dtype=bool))

    def _rate(self, problem: ContactProblem, state: State, gap: Array) -> Array:
        """Return ẏ = w_0 (m,) [1/s]: carried inside the layer, from the velocities outside.

        Args:
            problem: the problem of the run.
            state: at the beginning of the step.
            gap: (m,) at the beginning of the step [m].
        """
        surface = problem.surface
        rate = -surface.normal_values(state.v) / gap
        carried = surface.normal_values(state.memory[RATE]) if RATE in state.memory else rate
        return np.where(gap < self.law.layer.width, carried, rate)

    def _pressure(
        self, step: StepProblem, G: Array, free: Array, old: Array, rate: Array, dt: float
    ) -> Array:
        """Return p̄ (m,) of gap = free + G p̄(gap).

        Newton's method solves it, in steps that leave a tenth of every gap at least.

        Args:
            step: for messages.
            G: (m, m) gaps per pressure [m/Pa].
            free: (m,) gaps at the end of the step without the layer [m].
            old: (m,) gaps at its beginning [m].
            rate: (m,) w_0 [1/s].
            dt: time step [s].
        """
        law = self.law
        rho = old * np.maximum(1.0 + dt * rate, LEAST_SHARE)
        p, slope = law.mean_pressure(rho, old, rate, dt)
        residual = rho - free - G @ p
        for _ in range(NEWTON_STEPS):
            change = -np.linalg.solve(np.eye(len(rho)) - G * slope, residual)
            if np.all(np.abs(change) <= GAP_TOLERANCE * rho + ROUNDING * np.abs(free)):
                return p

            # Take the largest share of the change that keeps the gaps open, and halve it until the
            # residual falls.
            share = 1.0 / max(1.0, float(np.max(-change / (0.9 * rho))))
            size = float(np.linalg.norm(residual))
            for _ in range(HALVINGS):
                p, slope = law.mean_pressure(rho + share * change, old, rate, dt)
                residual = rho + share * change - free - G @ p
                if np.linalg.norm(residual) < size:
                    break
                share *= 0.5
            rho = rho + share * change
        raise StepFailure(
            f"the layer's reactions of step {step.k} at t = {step.t:.6g} s were not found in "
            f"{NEWTON_STEPS} Newton steps: reduce the time step, or make the layer wider"
        )

    def finish(
        self, problem: ContactProblem, state: State, stage: Stage, answer: Answer, dt: float
    ) -> State:
        """Return the midpoint's state, whose reactions are the layer's.

        Its active points are those inside the layer.

        Args:
            problem: the problem of the run.
            state: at the beginning of the step.
            stage: with the layer's reactions.
            answer: of the step.
            dt: time step [s].
        """
        new = super().finish(problem, state, stage, answer, dt)
        if stage.carried is None:
            return new
        surface = problem.surface
        reaction = surface.normal_values(stage.carried)

        # w_1 of the midpoint rule in ln(gap). It is kept as a vector of unknowns, since these pass
        # through checkpoints.
        gap = surface.gap(stage.t) - surface.normal_values(new.u)
        old = surface.gap(state.t) - surface.normal_values(state.u)
        rate = 2.0 / dt * np.log(np.maximum(gap / old, 1e-300)) - self._rate(problem, state, old)
        memory = {RATE: surface.reaction_load(rate, len(new.u))}
        active = gap < self.law.layer.width
        return replace(new, r_n=new.r_n + reaction, active=active, memory=memory)
