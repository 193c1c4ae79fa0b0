"""Go from a static stage on firm supports to a dynamic stage on others: reactions of removed ones become forces.

Dashpots hold no static load. A gravity stage therefore stands on rollers or clamps; where the dynamic stage has
dashpots or free sides instead, what these supports carried goes on as the constant load

    F = K u_0 - f(0) + B_nᵀ r_n + B_tᵀ r_t     (zero where nothing was held)

so that u_0, its stresses and its contact are an equilibrium of the new problem too. Staging as in PLAXIS, LS-DYNA
(INTERFACE_SSI_STATIC) and Abaqus (*GEOSTATIC).
"""

import logging
from dataclasses import replace

import numpy as np

from ..core.algebra import Array, largest, max_abs
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.state_checks import check_problem_given, check_sizes, initial_state
from ..core.step import State
from .space import FemSpace

log = logging.getLogger(__name__)
BALANCED = 1e-6  # of the largest nodal force: what may be missing where nothing was released


def release(static: ContactProblem, state: State, problem: ContactProblem) -> tuple[ContactProblem, State]:
    """Return (problem with the reactions of removed supports as forces, its first state at rest) after a static stage.

    ``state``: of ``static_equilibrium`` on ``static``; ``problem``: on the same mesh, with the same materials, loads
    and contact points, and a motion that starts from rest. t = 0.
    InputError for another mesh or other contact points, or when forces are missing where nothing was released.
    """
    for one in (static, problem):
        check_problem_given("release", one)
    check_sizes("release", static, state)
    before, after = static.system.space, problem.system.space
    if not isinstance(before, FemSpace) or not isinstance(after, FemSpace) or before.mesh is not after.mesh:
        raise InputError("release needs two problems of fem.assemble on one mesh")
    if largest(before.comm, not np.array_equal(static.surface.points, problem.surface.points)):
        raise InputError("the static stage has other contact points than the problem: give both the same boundaries")
    nodal = before.expand(static.cartesian(state.u), state.t)
    u0 = after.restrict(nodal)
    _refuse_moved(after, nodal, u0)
    system = problem.system.changed(u0=u0, v0=np.zeros_like(u0))
    still = system.load.at_rest(0.0)
    force = system.K @ u0 - still + _contact_force(problem, state)
    was_held = (before.held | np.isin(before.nodes, before.tied_nodes)[:, None]).ravel()[after.free]
    missing = after.comm.max(np.array([max_abs(force[~was_held]), max_abs(system.K @ u0), max_abs(force)]))
    if missing[0] > BALANCED * max(missing[1:]):
        raise InputError(f"{missing[0]:.3g} N are missing where no support was released: give both stages the same "
                         "materials and loads, and a motion that starts from rest")
    log.info("supports released: their reactions go on as nodal forces, the largest %.4g N", missing[2])
    load = replace(system.load, constant=system.load.constant + force)
    released = replace(problem, system=replace(system, load=load))
    return released, replace(initial_state(released), r_n=state.r_n, r_t=state.r_t, active=state.active)


def _refuse_moved(space: FemSpace, nodal: Array, u0: Array) -> None:
    """The new supports must hold the body where the static stage has left it."""
    away = np.array([max_abs((space.expand(u0, 0.0) - nodal).ravel()), max_abs(nodal.ravel())])
    distance, size = space.comm.max(away)
    if distance > BALANCED * size:
        raise InputError(f"a support or tie of the problem is {distance:.3g} m away from where the static stage has "
                         "left the body: hold or tie it there in both stages, or free it in both")


def _contact_force(problem: ContactProblem, state: State) -> Array:
    """B_nᵀ r_n + B_tᵀ r_t on the system's own unknowns."""
    surface = problem.surface
    force = surface.reaction_load(state.r_n, problem.system.rows, state.r_t)
    if surface.coupling is not None:  # the load of relative unknowns is Rᵀ f, and R⁻¹ = 2 - R
        force = 2.0 * force - surface.coupling.transpose_apply(force)
    return surface.along_axes(force)
