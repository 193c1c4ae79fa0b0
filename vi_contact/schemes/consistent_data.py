"""Make initial data consistent.

This is the acceleration that fits them, and equilibrium of unknowns without inertia.

What schemes with accelerations start from, also after an impact, fits a displacement and a
velocity:

    M a + C v + K u = f(t) - B_nᵀ r_n - B_tᵀ r_t
    0 <= r_n  ⊥  -a_n >= 0    on resting points (gap and v_n zero)
    |r_t| <= limit(r_n),    r_t along the slip rate v_t + dt a_t

Points that are open, or that move towards or off the obstacle, carry no normal reaction: the one a
collision made in the step before is spent. Springs carry theirs, (u_n - gap0)/compliance. The same
small problem as a step, with M in place of A. Unknowns without inertia have no acceleration, and
the reaction that keeps them in equilibrium.

Contact unknowns without inertia are in equilibrium with the body at every time:

    (K u)_c + r = f_c(t),    0 <= r_n  ⊥  gap0 - u_n >= 0    with the inner unknowns as they are

Initial data rarely know that. Kept as they are, what is missing in this equation would swing on at
the contact nodes from step to step for ever, so schemes put it right once, at the start; the energy
this takes is of the order of the mesh size, and the history starts after it.
"""

from dataclasses import replace

import numpy as np

from ..core.algebra import Array, EffectiveMatrix, max_abs
from ..core.free_unknowns import solve_free
from ..core.problem import ContactProblem
from ..core.sizes import small
from ..core.step import PreparedSolver, State, StepProblem
from ..core.surfaces import ContactSurface
from ..solvers.automatic import solver_beside_steps
from ..solvers.certified import TOLERANCE, CertifiedSolver

ROUND_OFF = 1e-12  # of the largest displacement or velocity: smaller gaps and velocities are zero


def consistent_acceleration(
    problem: ContactProblem, state: State, dt: float
) -> tuple[Array, Array]:
    """Return (a [m/s²], B_nᵀ r_n + B_tᵀ r_t [N]) of the state's u and v.

    They are on the owned unknowns of the rotated basis.
    """
    system = problem.equations
    force = system.load(state.t) - system.K @ state.u
    if system.C is not None:
        force -= system.C @ state.v
    if system.massless is None:
        return _with_contact(problem, state, force, dt)
    moving = np.where(system.massless, 0.0, force)
    if small(system.algebra.comm, system.rows, 0):
        return mass_matrix(problem).factor.solve(moving), force - moving
    a = solve_free(system.algebra, system.M, moving, system.massless, np.zeros_like(force))
    return a, force - moving


def _with_contact(
    problem: ContactProblem, state: State, force: Array, dt: float
) -> tuple[Array, Array]:
    """Solve the small problem of points that rest on their support."""
    surface, rigid = problem.surface, problem.surface.rigid
    compression = surface.normal_values(state.u) - surface.gap(state.t)
    pressed = np.divide(compression, surface.compliance, out=np.zeros(surface.count), where=~rigid)
    # only bilateral springs pull
    pressed = np.where(surface.bilateral, pressed, np.maximum(pressed, 0.0))
    springs = surface.reaction_load(pressed, len(force))
    u_max, v_max = ROUND_OFF * surface.comm.max(np.array([max_abs(state.u), max_abs(state.v)]))
    still = (compression >= -u_max) & (np.abs(surface.normal_values(state.v)) <= v_max)
    resting = np.asarray((still | surface.bilateral) & rigid)
    rate = None  # of slip: the tangential velocity relative to the obstacle [m/s]
    if problem.frictional:
        rate, sliding = surface.tangential_values(state.v), surface.sliding(state.t, state.t + dt)
        rate = rate if sliding is None else rate - sliding / dt
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
        slip0=None if rate is None else -rate / dt,
        rate_factor=dt,
    )
    solver: PreparedSolver = problem.equations.cached(
        "resting contacts",
        lambda: solver_beside_steps(step.A, step.surface).prepare(step.A, step.surface, 1.0),
        surface,
    )
    result = solver.solve(step)
    return result.x, springs + surface.reaction_load(result.r_n, len(force), result.r_t)


def mass_matrix(problem: ContactProblem) -> EffectiveMatrix:
    """Return M, with ones in place of the empty rows of massless unknowns."""
    system, massless = problem.equations, problem.equations.massless

    def made() -> EffectiveMatrix:
        M = system.M if massless is None else system.algebra.with_identity_rows(system.M, massless)
        return EffectiveMatrix(M, system.algebra)

    return system.cached("mass", made)


def rigid_part(surface: ContactSurface) -> ContactSurface:
    """Return the surface without springs: they are loads here, not bounds."""
    return replace(
        surface, compliance=np.zeros(surface.count), bilateral=surface.bilateral & surface.rigid
    )


def equilibrated(problem: ContactProblem, state: State) -> State:
    """Return the state with its massless unknowns, if any, in equilibrium.

    It has the reactions that belong to it.

    Only their own block of K is factorised, however large the body is; not even that when it is
    large itself.
    """
    system, layer = problem.equations, problem.equations.massless
    if layer is None:
        return state
    load = system.load(state.t) - system.K @ np.where(layer, 0.0, state.u)
    A = system.cached(
        "massless block",
        lambda: EffectiveMatrix(system.algebra.block(system.K, layer), system.algebra),
    )
    # among the massless unknowns, as all normal ones are
    place = np.where(layer, np.cumsum(layer) - 1, -1)
    surface = problem.surface
    tangents = np.where(surface.tangents >= 0, place[surface.tangents], -1)
    surface = replace(
        surface, owned=place[surface.owned], tangents=tangents, basis=None, coupling=None, dual=None
    )
    step = StepProblem(
        A=A,
        b=load[layer],
        bound=surface.gap(state.t),
        surface=surface,
        scale=1.0,
        guess=state.u[layer],
        active=state.active,
        t=state.t,
        k=state.k,
        friction=problem.friction,
        slip0=problem.slip_origin(state.u, state.t, state.t),
    )
    solver = solver_beside_steps(A, surface)
    result, _, _ = CertifiedSolver(problem, A, 1.0, [solver], TOLERANCE, surface=surface).solve(
        step
    )
    u = state.u.copy()
    u[layer] = result.x
    return replace(state, u=u, r_n=result.r_n, r_t=result.r_t, active=result.active)


def massless_take(problem: ContactProblem, given: Array | float, x: Array) -> Array:
    """Return x with these values on massless unknowns.

    They take a mean velocity, without momentum to keep, and no acceleration.
    """
    massless = problem.equations.massless
    return x if massless is None else np.where(massless, given, x)
