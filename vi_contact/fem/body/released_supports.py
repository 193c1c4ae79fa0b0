"""Go from a static stage to one on other supports: reactions of removed ones become forces.

Dashpots hold no static load. A gravity stage therefore stands on rollers or clamps; where the
dynamic stage has dashpots or free sides instead, what these supports carried goes on as the
constant load

    F = K u_0 - f(0) + B_nᵀ r_n + B_tᵀ r_t     (zero where nothing was held)

so that u_0, its stresses and its contact are an equilibrium of the new problem too. A support that
is added holds the body where the stage before has left it: its own displacement counts from there.
Staging as in PLAXIS, LS-DYNA (INTERFACE_SSI_STATIC) and Abaqus (*GEOSTATIC).
"""

import logging
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from ...core.algebra import Array, Mask, from_each, largest, max_abs
from ...core.checks import several
from ...core.errors import InputError
from ...core.internal import MATERIAL, remembers
from ...core.joints import MEMORY, pose_joint
from ...core.problem import ContactProblem
from ...core.state_checks import check_problem_given, check_sizes
from ...core.step import State
from .. import compat
from .space import FemSpace

log = logging.getLogger(__name__)
BALANCED = 1e-6  # of the largest nodal force: what may be missing where nothing was released


def release(
    static: ContactProblem,
    state: State,
    problem: ContactProblem,
    *,
    earlier: Sequence[ContactProblem] = (),
) -> tuple[ContactProblem, State]:
    """Return the problem that goes on after a static stage, and its first state, at rest at t = 0.

    The reactions of supports that it does without are constant forces of this problem. The space of
    ``problem`` notes where supports that it adds hold the body.

    Args:
        static: the problem of the static stage.
        state: of ``static_equilibrium`` on it.
        problem: on the same mesh, with the same materials, loads and contact points, and a motion
            that starts from rest.
        earlier: problems of the stages before ``static``, whose supports may be released already.

    Raises:
        InputError: another mesh or other contact points, supports that hold the body elsewhere, and
            forces that are missing where nothing was released.
    """
    stages = several("release", "earlier", earlier, "give a list of problems, or leave it out")
    for given in (static, problem, *stages):
        check_problem_given("release", given)
    check_sizes("release", static, state)

    # where the body is, and that the problem begins there
    before, after = _spaces(static, problem)
    nodal = before.expand(static.cartesian(state.u), state.t)
    added = stand_on(before, after, nodal)
    u0 = after.restrict(nodal)
    still = np.zeros_like(u0)
    _, first = begin_from(problem, u0, still, state)
    _refuse_moved(static, state, nodal, problem, first)

    # unknowns that some support has held before may have lost it, and those beside an added one
    spaces = [_spaces(stage, problem)[0] for stage in (static, *earlier)]
    held = [space.held | np.isin(space.nodes, space.tied_nodes)[:, None] for space in spaces]
    any_held = np.any([*held, _beside(after, added)], axis=0)
    was_held = after.restrict(any_held.astype(float)) > 0.0
    force = _compute_missing(problem, u0, first, was_held)
    return begin_from(problem, u0, still, state, force)


def _spaces(static: ContactProblem, problem: ContactProblem) -> tuple[FemSpace, FemSpace]:
    """Return the unknowns of both problems. Collective.

    Raises:
        InputError: they are on different meshes, or have other contact points.
    """
    before = static.system.space
    after = problem.system.space
    if (
        not isinstance(before, FemSpace)
        or not isinstance(after, FemSpace)
        or before.mesh is not after.mesh
    ):
        raise InputError("release: give two problems of fem.assemble on one mesh")
    if largest(before.comm, not np.array_equal(static.surface.points, problem.surface.points)):
        raise InputError(
            "the static stage and the problem have different contact points, perhaps because "
            "fixed nodes are left out: name the same points for both (points=)"
        )
    return before, after


def same_supports(before: ContactProblem, problem: ContactProblem) -> bool:
    """Say whether two problems of one mesh and contact hold and tie the same. Collective.

    The later one stands where the earlier one does then.

    Raises:
        InputError: other contact points.
    """
    old, new = _spaces(before, problem)
    alike = np.array_equal(old.held, new.held) and np.array_equal(old.numbers, new.numbers)
    if largest(old.comm, not alike):
        return False
    new.stands = old.stands
    return True


def begin_from(
    problem: ContactProblem, u0: Array, v0: Array, state: State, force: Array | float = 0.0
) -> tuple[ContactProblem, State]:
    """Return the problem that begins with u0, v0 and has a constant force more, and that beginning.

    Args:
        problem: the problem that begins; u0, v0 and the force are on its own unknowns.
        u0: (n,) initial displacement [m].
        v0: (n,) initial velocity [m/s].
        state: a state with the contact that the beginning has.
        force: (n,) constant force [N].
    """
    surface = problem.surface
    system = problem.system
    load = problem.system.load

    def turn(x: Array) -> Array:
        """Return x in the frames of nodes and, by R⁻¹ = 2 - R, relative to what they face."""
        x = surface.in_frames(x)
        if surface.coupling is None:
            return x.copy()
        return 2.0 * x - surface.coupling @ x

    r_t = state.r_t if problem.frictional else None
    # What joints and materials have gone through is their own, whatever supports there are.
    memory = {name: x for name, x in state.memory.items() if name.startswith((MEMORY, MATERIAL))}
    first = State(
        t=0.0,
        k=0,
        u=turn(u0),
        v=turn(v0),
        r_n=state.r_n,
        active=state.active,
        memory=memory,
        r_t=r_t,
        turned=surface.turned,
    )
    load = replace(load, constant=load.constant + force)
    return replace(problem, system=system.changed(u0=u0, v0=v0, load=load)), first


def _compute_missing(problem: ContactProblem, u0: Array, state: State, was_held: Mask) -> Array:
    """Return F = K u_0 - f(0) + B_nᵀ r_n + B_tᵀ r_t (n,) [N]. Collective.

    Of a body that is not linear p(u_0) takes the place of K u_0.

    Args:
        problem: the problem that begins.
        u0: (n,) where it begins [m].
        state: its contact.
        was_held: (n,) unknowns that were held before.

    Raises:
        InputError: it is not zero and nothing was held.
    """
    elastic = find_internal_force(problem, state, u0)
    force = np.asarray(elastic - problem.system.load.at_rest(0.0) + _contact_force(problem, state))
    # Of a body that only the prestress of a joint loads, the total reactions are the forces whose
    # rounding is missing.
    reaction = max_abs(state.r_n)
    sizes = np.array([max_abs(force[~was_held]), reaction, max_abs(elastic), max_abs(force)])
    missing, *largest_forces = problem.surface.comm.max(sizes)
    if missing > BALANCED * max(largest_forces):
        raise InputError(
            f"{missing:.3g} N are missing where no support was released: give both stages the "
            "same materials, loads and friction, and a motion that starts from rest"
        )
    log.info(
        "supports released: their reactions remain as nodal forces, the largest %.4g N",
        largest_forces[-1],
    )
    return force


def find_internal_force(problem: ContactProblem, state: State, u0: Array) -> Array:
    """Return p(u0) (n,) [N], of materials that remember with what they know in a state. Collective.

    Args:
        problem: that begins.
        state: its first one.
        u0: (n,) its displacement, on the unknowns of the system [m].
    """
    internal: Any = problem.system.internal
    if remembers(internal):
        return np.asarray(internal.go_on(state.memory, u0).force(u0))
    return np.asarray(problem.system.internal_force(u0))


def find_removed_support(
    before: ContactProblem, after: ContactProblem, force: Array, elastic: Array
) -> tuple[str, float]:
    """Return (name, reaction [N]) of the removed support with most of a force. Collective.

    It is the support that ``after`` does without and that carries most of this force; "" for none.
    The reaction is its resultant, or its largest nodal force where this is larger.

    Args:
        before: the problem with the support.
        after: the problem without it.
        force: (n,) on the unknowns of ``after`` [N].
        elastic: p(u0) (n,) there [N].
    """
    old, new = _spaces(before, after)
    candidates = [("", 0.0)]
    nodal = np.zeros(new.held.size)
    nodal[new.free] = force[: np.count_nonzero(new.free)]
    # forces that are round-off of these are none
    size = largest(new.comm, max(max_abs(elastic), max_abs(force)))
    # of each support, and of the ties that are gone, what of the force is on what it held
    untied = np.isin(old.nodes, np.setdiff1d(old.tied_nodes, new.tied_nodes)), slice(None)
    supports = [(support.condition.name, support.places) for support in old.supports]
    for name, places in [*supports, ("tied", untied)]:
        own = np.zeros_like(old.points)
        own[places] = np.where(new.held, 0.0, nodal.reshape(own.shape))[places]
        peak = largest(new.comm, max_abs(own.ravel()))
        resultant = float(np.linalg.norm(new.comm.sum(own.sum(axis=0))))
        if peak > BALANCED * size:
            candidates.append((name, max(resultant, peak)))
    return max(candidates, key=lambda candidate: candidate[1])


def stand_on(before: FemSpace, after: FemSpace, nodal: Array) -> Mask:
    """Let what ``after`` holds in addition stay where the body is (``after.stands``). Collective.

    Args:
        before: the unknowns of the stage before.
        after: those of the problem that begins.
        nodal: (k, d) where nodes are [m].

    Returns:
        (k, d) mask of the components that stay off their own place.
    """
    stays = np.where(after.held & ~before.held, nodal, 0.0)
    if before.stands is not None:
        stays = np.where(after.held & before.held, before.stands, stays)
    after.stands = stays if largest(after.comm, max_abs(stays.ravel())) > 0.0 else None
    return stays != 0.0


def _beside(space: FemSpace, chosen: Mask) -> Mask:
    """Return a mask (k, d) of the owned nodes that share a cell with a node of chosen components.

    The cell may be of any rank. Collective.

    Args:
        space: the body's unknowns.
        chosen: (k, d) mask of components of the owned nodes.
    """
    numbers = np.concatenate(from_each(space.comm, space.nodes[chosen.any(axis=1)]))
    cells = space.node_of_block[compat.cell_blocks(space.V)]
    near = np.concatenate(
        from_each(space.comm, np.unique(cells[np.isin(cells, numbers).any(axis=1)]))
    )
    return np.isin(space.nodes, near)[:, None] & np.ones_like(space.held)


def _refuse_moved(
    static: ContactProblem, state: State, nodal: Array, problem: ContactProblem, begun: State
) -> None:
    """Raise InputError unless the new supports hold the body where it is.

    They must hold it, and what its contact points face, where the static stage has left it.

    Args:
        static: the problem of the stage before.
        state: where that stage has ended.
        nodal: (k, d) where nodes are then [m].
        problem: the problem that begins.
        begun: its first state.
    """
    # how far nodes of the body, and gaps of its conditions, are from where the stage has left them
    space: FemSpace = problem.system.space  # type: ignore[assignment]
    begins = space.expand(problem.cartesian(begun.u), 0.0)
    before = static.surface.gap(state.t) - static.surface.normal_values(state.u)
    after = problem.surface.gap(0.0) - problem.surface.normal_values(begun.u)
    own = max(max_abs((begins - nodal).ravel()), max_abs(after - before))
    distance, size = problem.surface.comm.max(np.array([own, max_abs(nodal.ravel())]))
    if distance > BALANCED * size:
        raise InputError(
            f"a support or tie of the problem is {distance:.3g} m away from where the static stage "
            "has left the body: hold or tie it there in both stages, or free it in both"
        )


def _contact_force(problem: ContactProblem, state: State) -> Array:
    """Return B_nᵀ r_n + B_tᵀ r_t (n,) [N] on the system's own unknowns, without frames.

    The reactions of a joint are the total ones, and only what they are more than its prestress
    loads the bodies.
    """
    surface = problem.surface
    r_n, r_t = state.r_n, state.r_t
    if problem.joint is not None:
        normal, shear = pose_joint(problem, state, 0.0).prestress
        r_n = r_n - normal
        r_t = None if r_t is None else r_t - shear
    force = surface.reaction_load(r_n, problem.system.rows, r_t)
    if surface.coupling is not None:  # the load of relative unknowns is Rᵀ f, and R⁻¹ = 2 - R
        force = 2.0 * force - surface.coupling.transpose_apply(force)
    return surface.along_axes(force)
