"""The acceleration that fits a displacement and a velocity: what schemes with accelerations start from, also after an
impact.

    M a + C v + K u = f(t) - B_nᵀ r_n - B_tᵀ r_t,    0 <= r_n  ⊥  -a_n >= 0    on resting points (gap and v_n zero)
    |r_t| <= limit(r_n),    r_t along the slip rate v_t + dt a_t

Points that are open, or that move towards or off the obstacle, carry no normal reaction: the one a collision made in
the step before is spent. Springs carry theirs, (u_n - gap0)/compliance. The same small problem as a step, with M in
place of A. Unknowns without inertia have no acceleration, and the reaction that keeps them in equilibrium.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..core.algebra import Array, EffectiveMatrix, Mask, Matrix
from ..core.problem import ContactProblem
from ..core.step import PreparedSolver, State, StepProblem
from ..core.surfaces import ContactSurface
from ..solvers.condensed import Condensed

ROUND_OFF = 1e-12  # of the largest displacement or velocity: smaller gaps and velocities are zero


def consistent_acceleration(problem: ContactProblem, state: State, dt: float) -> tuple[Array, Array]:
    """(a [m/s²], B_nᵀ r_n + B_tᵀ r_t [N]) of the state's u and v, owned unknowns of the rotated basis."""
    system = problem.equations
    force = system.load(state.t) - system.K @ state.u
    if system.C is not None:
        force -= system.C @ state.v
    if system.massless is None:
        return _with_contact(problem, state, force, dt)
    moving = np.where(system.massless, 0.0, force)
    return mass_matrix(problem).factor.solve(moving), force - moving


def _with_contact(problem: ContactProblem, state: State, force: Array, dt: float) -> tuple[Array, Array]:
    """The small problem of points that rest on their support."""
    surface = problem.surface
    compression = surface.normal_values(state.u) - surface.gap(state.t)
    springs = surface.reaction_load(_spring_reactions(surface, compression), len(force))
    resting = _resting(surface, compression, state)
    slip = _slip_rate(problem, state, dt)
    step = StepProblem(
        A=mass_matrix(problem),
        b=force - springs,
        bound=np.where(resting, 0.0, np.inf),
        surface=rigid_part(surface),
        scale=1.0,
        guess=np.zeros_like(force),
        active=resting,
        t=state.t,
        k=state.k,
        friction=problem.friction,
        slip0=None if slip is None else -slip / dt,
        rate_factor=dt,
    )
    solver: PreparedSolver = problem.equations.kept(
        "resting contacts", lambda: Condensed().prepare(step.A, step.surface, 1.0)
    )
    result = solver.solve(step)
    return result.x, springs + surface.reaction_load(result.r_n, len(force), result.r_t)


def _slip_rate(problem: ContactProblem, state: State, dt: float) -> Array | None:
    """Tangential velocity relative to the obstacle [m/s]; None without friction."""
    if not problem.frictional:
        return None
    rate, sliding = problem.surface.tangential_values(state.v), problem.surface.sliding(state.t, state.t + dt)
    return rate if sliding is None else rate - sliding / dt


def without_inertia(problem: ContactProblem, a: Array) -> Array:
    """a, with zero on massless unknowns."""
    massless = problem.equations.massless
    return a if massless is None else np.where(massless, 0.0, a)


def mass_matrix(problem: ContactProblem) -> EffectiveMatrix:
    """M, with ones in place of the empty rows of massless unknowns."""
    system = problem.equations

    def make() -> EffectiveMatrix:
        regular: Matrix = system.M if system.massless is None else system.algebra.held(system.M, system.massless)
        return EffectiveMatrix(regular, system.algebra)

    matrix: EffectiveMatrix = system.kept("mass", make)
    return matrix


def rigid_part(surface: ContactSurface) -> ContactSurface:
    """Springs are loads here, not bounds."""
    rigid = surface.compliance == 0.0
    return replace(surface, compliance=np.zeros(surface.count), bilateral=surface.bilateral & rigid)


def _spring_reactions(surface: ContactSurface, compression: Array) -> Array:
    """Of compliant points; only bilateral ones pull."""
    soft = surface.compliance > 0.0
    r_n = np.divide(compression, surface.compliance, out=np.zeros(surface.count), where=soft)
    return np.where(surface.bilateral, r_n, np.maximum(r_n, 0.0))


def _resting(surface: ContactSurface, compression: Array, state: State) -> Mask:
    """Rigid points that touch and do not move, and all rigid bilateral ones."""
    rigid = surface.compliance == 0.0
    local = np.array([np.max(np.abs(state.u), initial=0.0), np.max(np.abs(state.v), initial=0.0)])
    u_max, v_max = ROUND_OFF * surface.comm.max(local)
    still = (compression >= -u_max) & (np.abs(surface.normal_values(state.v)) <= v_max)
    return np.asarray((still | surface.bilateral) & rigid)
