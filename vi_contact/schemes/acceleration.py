"""The acceleration that fits a displacement and a velocity: what multistep schemes start from, also after an impact.

    M a + C v + K u = f(t) - B_nᵀ r_n,    0 <= r_n  ⊥  -a_n >= 0    on resting points (gap and v_n zero)

Points that are open, or that move towards or off the obstacle, carry no reaction: the one a collision made in the step
before is spent. Springs carry theirs, (u_n - gap0)/compliance. The same small problem as a step, with M in place of A.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..algebra import Array, Mask
from ..solvers.condensed import Condensed
from ..step import ContactProblem, EffectiveMatrix, PreparedSolver, StepProblem
from ..surfaces import ContactSurface

ROUND_OFF = 1e-12  # of the largest displacement or velocity: smaller gaps and velocities are zero


def consistent_acceleration(problem: ContactProblem, t: float, u: Array, v: Array) -> tuple[Array, Array]:
    """(a [m/s²], B_nᵀ r_n [N]), owned unknowns of the rotated basis."""
    system, surface = problem.equations, problem.surface
    compression = surface.normal_values(u) - surface.gap0
    springs = _spring_reactions(surface, compression)
    load = surface.reaction_load(springs, len(u))
    force = system.load(t) - system.K @ u - load
    if system.C is not None:
        force -= system.C @ v
    resting = _resting(surface, compression, u, v)
    step = StepProblem(
        A=_mass(problem),
        b=force,
        bound=np.where(resting, 0.0, np.inf),
        surface=_rigid_part(surface),
        scale=1.0,
        guess=np.zeros_like(u),
        active=resting,
        t=t,
        k=0,
    )
    solver: PreparedSolver = system.kept("resting contacts", lambda: Condensed().prepare(step.A, step.surface, 1.0))
    result = solver.solve(step)
    return result.x, load + surface.reaction_load(result.r_n, len(u))


def _mass(problem: ContactProblem) -> EffectiveMatrix:
    system = problem.equations
    matrix: EffectiveMatrix = system.kept("mass", lambda: EffectiveMatrix(system.M, system.algebra))
    return matrix


def _rigid_part(surface: ContactSurface) -> ContactSurface:
    """Springs are loads here, not bounds."""
    rigid = surface.compliance == 0.0
    return replace(surface, compliance=np.zeros(surface.count), bilateral=surface.bilateral & rigid)


def _spring_reactions(surface: ContactSurface, compression: Array) -> Array:
    """Of compliant points; only bilateral ones pull."""
    soft = surface.compliance > 0.0
    r_n = np.divide(compression, surface.compliance, out=np.zeros(surface.count), where=soft)
    return np.where(surface.bilateral, r_n, np.maximum(r_n, 0.0))


def _resting(surface: ContactSurface, compression: Array, u: Array, v: Array) -> Mask:
    """Rigid points that touch and do not move, and all rigid bilateral ones."""
    rigid = surface.compliance == 0.0
    local = np.array([np.max(np.abs(u), initial=0.0), np.max(np.abs(v), initial=0.0)])
    u_max, v_max = ROUND_OFF * surface.comm.max(local)
    still = (compression >= -u_max) & (np.abs(surface.normal_values(v)) <= v_max)
    return np.asarray((still | surface.bilateral) & rigid)
