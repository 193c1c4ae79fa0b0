"""The one time loop: ``march`` is a generator over certified steps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from .certified import TOLERANCE, CertifiedSolver
from .errors import InputError
from .impact import Impact
from .static import initial_state
from .step import ContactProblem, Report, Scheme, Solver, State


def count_steps(dt: float, steps: int | None, t_end: float | None, t0: float = 0.0) -> int:
    """The number of steps from ``steps`` or ``t_end``; InputError when dt, steps or t_end make no sense."""
    if not np.isfinite(dt) or dt <= 0.0:
        raise InputError(f"dt is {dt}: give a positive time step in seconds")
    if (steps is None) == (t_end is None):
        raise InputError("give either steps or t_end, and not both")
    wanted = steps if t_end is None else (t_end - t0) / dt
    if wanted is None or not np.isfinite(wanted) or wanted < 0:
        raise InputError(f"the run has {wanted} steps: give a finite t_end after the start, or steps >= 0")
    if t_end is not None:
        return int(np.ceil(wanted * (1.0 - 1e-12)))
    if int(wanted) != wanted:
        raise InputError(f"steps is {steps}: give a whole number of steps, or t_end in seconds")
    return int(wanted)


def march(
    problem: ContactProblem,
    *,
    scheme: Scheme,
    solver: Solver,
    dt: float,
    steps: int | None = None,
    t_end: float | None = None,
    state: State | None = None,
    escalation: Sequence[Solver] = (),
    tolerance: float = TOLERANCE,
) -> Iterator[tuple[State, Report]]:
    """Yields (state, report) after every certified step.

    A step whose certificate exceeds ``tolerance`` goes to the solvers of ``escalation`` in turn, then raises
    StepFailure with step, time, residuals and advice. ``state`` continues from a static stage or a checkpoint.
    """
    state = initial_state(problem) if state is None else state
    steps = count_steps(dt, steps, t_end, state.t)
    scheme.check(problem)
    A = scheme.effective_matrix(problem, dt)
    state = scheme.start(problem, state, dt)
    certified: CertifiedSolver | None = None
    for _ in range(steps):
        step = scheme.step(problem, state, A, dt)
        if certified is None:
            certified = CertifiedSolver(problem, A, step.scale, [solver, *escalation], tolerance)
        result, certificate, escalated = certified.solve(step)
        free = scheme.finish(problem, state, step, result, dt)
        new = after_impact(problem, scheme, state, free, dt)
        averages = partial(scheme.balance, problem, state, free, dt)
        yield new, Report(state, new, free.v, step, result, certificate, averages, escalated)
        state = new


def after_impact(problem: ContactProblem, scheme: Scheme, old: State, new: State, dt: float) -> State:
    """The state with the impact law applied. Massless supports (springs) do not collide: their points are left out."""
    law, surface = problem.impact, problem.surface
    if law is None:
        return new
    solid = surface.compliance == 0.0
    active = new.active & solid
    if not active.any():
        return new
    impact = Impact(surface.normal_values(old.v), surface.normal_values(new.v), active, active & ~old.active)
    target = law.target(impact)
    if np.all(np.isnan(target)):
        return new
    return scheme.jump(problem, new, law.apply(problem.equations, surface, new.v, target), dt)
