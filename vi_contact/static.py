"""Where a run starts: the initial state of the data, or the equilibrium of a static (gravity) stage with contact."""

from __future__ import annotations

import numpy as np

from .certified import TOLERANCE, CertifiedSolver
from .errors import InputError
from .step import ContactProblem, EffectiveMatrix, Solver, State, StepProblem


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
