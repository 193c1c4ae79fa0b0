"""What the one-step problems of all schemes have in common whose unknown is the displacement at the end of the step."""

from __future__ import annotations

from ..core.algebra import Array, EffectiveMatrix, Mask
from ..core.problem import ContactProblem
from ..core.step import State, StepProblem


def position_step(
    problem: ContactProblem,
    state: State,
    A: EffectiveMatrix,
    dt: float,
    *,
    b: Array,
    scale: float,
    guess: Array | None = None,
    active: Mask | None = None,
) -> StepProblem:
    """A x = b - …, x = u1: gap and slip of the end of the step; by default free flight as the guess."""
    end = state.t + dt
    return StepProblem(
        A=A,
        b=b,
        bound=problem.surface.gap(end),
        surface=problem.surface,
        scale=scale,
        guess=state.u + dt * state.v if guess is None else guess,
        active=state.active if active is None else active,
        t=end,
        k=state.k + 1,
        friction=problem.friction,
        slip0=problem.slip_origin(state.u, state.t, end),
        rate_factor=1.0 / dt,
    )
