"""The one time loop: ``march`` is a generator over certified steps."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

from .errors import InputError, StepFailure
from .impact import Impact
from .step import (
    Certificate,
    ContactProblem,
    EffectiveMatrix,
    PreparedSolver,
    Report,
    Scheme,
    Solver,
    State,
    StepProblem,
    StepResult,
)
from .verify import kkt_residual

TOLERANCE = 1e-9


class CertifiedSolver:
    """A solver and the methods to escalate to, all bound to one effective matrix; nothing uncertified leaves it."""

    def __init__(
        self, problem: ContactProblem, A: EffectiveMatrix, scale: float, solvers: Sequence[Solver], tolerance: float
    ) -> None:
        for solver in solvers:
            solver.check(problem)
        self._surface, self._A, self._scale = problem.surface, A, scale
        self._solvers, self._tolerance = solvers, tolerance
        self._prepared: dict[int, PreparedSolver] = {}
        self._get(0)

    def _get(self, rank: int) -> PreparedSolver:
        """The solver of that rank of escalation, prepared when first needed."""
        if rank not in self._prepared:
            self._prepared[rank] = self._solvers[rank].prepare(self._A, self._surface, self._scale)
        return self._prepared[rank]

    def _refuse_nan(self, step: StepProblem) -> None:
        """A NaN would spread silently through every solver; asked of all ranks, so that all stop."""
        bad = float(not np.isfinite(np.sum(step.b)))
        if self._surface.comm.max(np.array([bad]))[0]:
            raise StepFailure(
                f"the load of step {step.k} at t = {step.t:.6g} s contains NaN or infinite values: "
                "check the excitation, the tractions and the initial data"
            )

    def solve(self, step: StepProblem) -> tuple[StepResult, Certificate, bool]:
        """(result, certificate, escalated) of the first method below tolerance; StepFailure when there is none."""
        self._refuse_nan(step)
        tried = []
        for rank in range(len(self._solvers)):
            try:
                result = self._get(rank).solve(step)
            except StepFailure as failure:
                tried.append(str(failure))
                continue
            certificate = kkt_residual(step, result)
            if certificate.worst <= self._tolerance:
                return result, certificate, rank > 0
            tried.append(f"{result.method}: {certificate}")
        raise StepFailure(
            f"step {step.k} at t = {step.t:.6g} s stayed above the certificate tolerance {self._tolerance:g} "
            f"({'; '.join(tried)}): try a smaller dt, another solver, or check the data of this time"
        )


def initial_state(problem: ContactProblem, t: float = 0.0) -> State:
    """u0, v0 of the system, in the rotated basis, no reaction; InputError when u0 penetrates the obstacle."""
    system, surface = problem.equations, problem.surface
    gap = surface.gap0 - surface.normal_values(system.u0)
    u_max = float(surface.comm.max(np.array([np.max(np.abs(system.u0), initial=0.0)]))[0])
    size = max(u_max, float(np.max(surface.gap0, initial=0.0)))
    if len(gap) and gap.min() < -1e-9 * size:
        raise InputError(
            f"the initial displacement penetrates the obstacle by {-gap.min():.3g} m: reduce it or enlarge the gap"
        )
    none = np.zeros(surface.count)
    return State(t, 0, system.u0.copy(), system.v0.copy(), none, surface.bilateral.copy())


def static_equilibrium(
    problem: ContactProblem, *, solver: Solver, t: float = 0.0, tolerance: float = TOLERANCE
) -> State:
    """The gravity stage: K u = f(t) - B_nᵀ r_n with contact active, without excitation; the state it leaves has v = 0,
    keeps stresses, reactions and contact set, and is the start of the dynamic stage.

    InputError for a floating body: its rigid motion is not held by prescribed displacements, so K is singular.
    """
    system = problem.static_load
    if system.floating:
        raise InputError(
            "the body floats in the static stage: no prescribed displacement holds its rigid motion; clamp a part of "
            "it, or skip the gravity stage and start the dynamics from rest"
        )
    start = initial_state(problem, t)
    A = EffectiveMatrix(system.algebra.combine([(1.0, system.K)]), system.algebra)
    step = StepProblem(
        A=A,
        b=system.load(t),
        bound=problem.surface.gap0,
        surface=problem.surface,
        scale=1.0,
        guess=start.u,
        active=start.active,
        t=t,
        k=0,
    )
    result, _, _ = CertifiedSolver(problem, A, 1.0, [solver], tolerance).solve(step)
    return State(t, 0, result.x, np.zeros_like(start.v), result.r_n, result.active)


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
