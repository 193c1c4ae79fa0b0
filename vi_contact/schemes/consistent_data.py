"""Make initial data consistent: the acceleration that fits them, and massless equilibrium.

Schemes with accelerations start, also after an impact, from the acceleration that fits a
displacement and a velocity:

    M a + C v + K u = f(t) - B_nᵀ r_n - B_tᵀ r_t
    0 <= r_n  ⊥  -a_n >= 0    on resting points (gap and v_n zero)
    |r_t| <= limit(r_n),    r_t along the slip rate v_t + dt a_t

Points that are open, or that move towards or off the obstacle, carry no normal reaction: the one a
collision made in the step before is spent. Springs carry theirs, (u_n - gap0)/compliance. It is the
same small problem as a step, with M in place of A. Unknowns without inertia have no acceleration,
and the reaction that keeps them in equilibrium.

Contact unknowns without inertia are in equilibrium with the body at every time:

    (K u)_c + r = f_c(t),    0 <= r_n  ⊥  gap0 - u_n >= 0    with the inner unknowns as they are

Initial data rarely satisfy that. What is missing in this equation would swing on at the contact
nodes from step to step for ever, so schemes put it right once, at the start; the energy this takes
is of the order of the mesh size, and the history starts after it.
"""

from dataclasses import replace

import numpy as np

from ..core.algebra import Array, EffectiveMatrix, Mask, max_abs
from ..core.free_unknowns import solve_free
from ..core.problem import ContactProblem
from ..core.sizes import is_small_problem
from ..core.step import PreparedSolver, State, StepProblem
from ..core.surfaces import ContactSurface
from ..solvers.automatic import solver_beside_steps
from ..solvers.certified import TOLERANCE, CertifiedSolver

ROUND_OFF = 1e-12  # of the largest displacement or velocity: smaller gaps and velocities are zero


def consistent_acceleration(
    problem: ContactProblem, state: State, dt: float
) -> tuple[Array, Array]:
    """Return the acceleration that fits u and v of a state, and the reaction beside it.

    Args:
        problem: the problem that is marched.
        state: the state.
        dt: size of the next step [s], over which friction looks ahead.

    Returns:
        a (n,) [m/s²] and B_nᵀ r_n + B_tᵀ r_t (n,) [N], on the owned unknowns of the rotated basis.
    """
    system = problem.equations
    force = system.load(state.t) - system.internal_force(state.u)
    if system.C is not None:
        force -= system.C @ state.v
    if system.massless is None:
        return _accelerate_in_contact(problem, state, force, dt)

    # Massless unknowns are in equilibrium: the force on them is all reaction.
    moving = np.where(system.massless, 0.0, force)
    if is_small_problem(system.algebra.comm, system.rows, 0):
        a = mass_matrix(problem).factor.solve(moving)
    else:
        a = solve_free(system.algebra, system.M, moving, system.massless, np.zeros_like(force))
    return a, force - moving


def _accelerate_in_contact(
    problem: ContactProblem, state: State, force: Array, dt: float
) -> tuple[Array, Array]:
    """Solve the small problem of points with mass that rest on their support.

    Args:
        problem: the problem that is marched.
        state: the state.
        force: f - C v - K u (n,) [N].
        dt: size of the next step [s].

    Returns:
        As ``consistent_acceleration``.
    """
    surface = problem.surface
    rigid = surface.rigid

    # Springs are loads here: only bilateral ones pull.
    compression = surface.normal_values(state.u) - surface.gap(state.t)
    pressed = np.divide(compression, surface.compliance, out=np.zeros(surface.count), where=~rigid)
    pressed = np.where(surface.bilateral, pressed, np.maximum(pressed, 0.0))
    springs = surface.reaction_load(pressed, len(force))

    # Points rest that are closed and do not move, to round-off. They alone may get a reaction.
    u_max, v_max = ROUND_OFF * surface.comm.max(np.array([max_abs(state.u), max_abs(state.v)]))
    still = (compression >= -u_max) & (np.abs(surface.normal_values(state.v)) <= v_max)
    resting = np.asarray((still | surface.bilateral) & rigid)

    # The slip rate v_t + dt a_t, relative to the obstacle, is dt times a slip from slip0 = -v_t/dt.
    slip0 = None
    if problem.frictional:
        rate = surface.tangential_values(state.v)
        sliding = surface.sliding(state.t, state.t + dt)
        if sliding is not None:
            rate = rate - sliding / dt
        slip0 = -rate / dt

    # M a = force - springs - Bᵀr is a step with x = a: the bound a_n <= 0 holds on resting points.
    step = StepProblem(
        A=mass_matrix(problem),
        b=force - springs,
        bound=np.where(resting, 0.0, np.inf),
        surface=without_springs(surface),
        scale=1.0,
        guess=np.zeros_like(force),
        active=resting,
        t=state.t,
        k=state.k,
        friction=problem.friction,
        slip0=slip0,
        rate_factor=dt,
    )
    solver: PreparedSolver = problem.equations.make_once(
        "resting contacts",
        lambda: solver_beside_steps(step.A, step.surface).prepare(step.A, step.surface, 1.0),
        surface,
    )
    result = solver.solve(step)
    return result.x, springs + surface.reaction_load(result.r_n, len(force), result.r_t)


def mass_matrix(problem: ContactProblem) -> EffectiveMatrix:
    """Return M, with ones in place of the empty rows of massless unknowns."""
    system = problem.equations
    massless = system.massless

    def make() -> EffectiveMatrix:
        M = system.M if massless is None else system.algebra.with_identity_rows(system.M, massless)
        return EffectiveMatrix(M, system.algebra)

    return system.make_once("mass", make)


def without_springs(surface: ContactSurface) -> ContactSurface:
    """Return the surface without springs: they are loads here, not bounds."""
    return replace(
        surface, compliance=np.zeros(surface.count), bilateral=surface.bilateral & surface.rigid
    )


def equilibrate(problem: ContactProblem, state: State) -> State:
    """Return the state with its massless unknowns in equilibrium, and the reactions of that.

    Only their own block of K is factorised, however large the body is; not even that when it is
    large itself.
    """
    system = problem.equations
    layer = system.massless
    if layer is None:
        return state
    system.refuse_nonlinear(
        "the equilibrium of contact nodes without mass", "give the problem mass=ConsistentMass()"
    )

    # The block of K of the massless unknowns, under the load that the others leave on them.
    load = system.load(state.t) - system.K @ np.where(layer, 0.0, state.u)
    A = system.make_once(
        "massless block",
        lambda: EffectiveMatrix(system.algebra.block(system.K, layer), system.algebra),
    )

    surface = _number_among(problem.surface, layer, A)
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

    # Solve it as any step, and put the answer into the massless unknowns alone.
    solvers = [solver_beside_steps(A, surface)]
    certified = CertifiedSolver(problem, A, 1.0, solvers, TOLERANCE, surface=surface)
    result = certified.solve(step).result
    u = state.u.copy()
    u[layer] = result.x
    return replace(state, u=u, r_n=result.r_n, r_t=result.r_t, active=result.active)


def _number_among(surface: ContactSurface, layer: Mask, A: EffectiveMatrix) -> ContactSurface:
    """Return a surface whose conditions bound massless unknowns, numbered among these. Collective.

    Args:
        surface: the contact conditions.
        layer: (n,) the massless unknowns.
        A: the block of K of these.
    """
    if surface.traces is not None:
        first = A.algebra.first(A.matrix.rows)
        return replace(surface, traces=surface.traces.among(layer, first))
    place = np.where(layer, np.cumsum(layer) - 1, -1)
    tangents = np.where(surface.tangents >= 0, place[surface.tangents], -1)
    return replace(
        surface, owned=place[surface.owned], tangents=tangents, basis=None, coupling=None, dual=None
    )


def replace_massless(problem: ContactProblem, x: Array, values: Array | float) -> Array:
    """Return a velocity or an acceleration with other values on massless unknowns.

    These have no momentum to keep: schemes give them the mean velocity of a step, and no
    acceleration.

    Args:
        problem: the problem that is marched.
        x: velocity [m/s] or acceleration [m/s²] (n,), or rows (k, n).
        values: those of massless unknowns, one number or of the shape of x.
    """
    massless = problem.equations.massless
    return x if massless is None else np.where(massless, values, x)


def replace_in_bodies(problem: ContactProblem, v: Array, values: Array) -> Array:
    """Return velocities with other values on nodes of bodies without mass.

    No momentum changes by it. Contact unknowns are those of one side relative to the other one:
    v of the bodies is R v, and what moves relative to a node without mass changes with it.

    Args:
        problem: the problem that is marched.
        v: velocity [m/s] (n,), or rows (k, n).
        values: those of nodes without mass, of the shape of v.
    """
    massless = problem.system.massless
    if massless is None or not problem.system.has_massless_bodies:
        return v
    if v.ndim > 1:
        pairs = zip(v, values, strict=True)
        return np.stack([replace_in_bodies(problem, *pair) for pair in pairs])
    R = problem.surface.coupling
    if R is None:
        return np.where(massless, values, v)
    of_bodies = np.where(massless, R @ values, R @ v)
    return np.asarray(2.0 * of_bodies - R @ of_bodies)  # R⁻¹ = 2 - R
