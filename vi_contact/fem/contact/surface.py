"""Make contact conditions of facets of a mesh, in front of a rigid obstacle.

The steps of ``contact_surface``, each on the nodes that this rank owns:

    nodes_on, free_nodes, find_listed    nodes of the facets, their normals and weights
    faces.split_at_corners               one row for each face of a node
    _make_question                       the obstacle says directions and gaps
    one_per_direction                    faces with one direction are one condition again
    merge_ties                           so are nodes that move as one
    frames.surface_of                    frames of the nodes, and the rotated basis

``pairs`` takes some of these steps for two deformable bodies.
"""

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, Indices, from_each, largest, total
from ...core.checks import array, describe_point, flag, optional, provides, several
from ...core.collective import agree
from ...core.corners import FEATURE_ANGLE, PARALLEL, make_tangent_vectors
from ...core.errors import InputError
from ...core.obstacles import Obstacle, Touching, check_gap, locate_obstacle
from ...core.surfaces import ContactSurface, empty_surface, list_tangential_columns
from ...core.system import SemiDiscreteSystem
from ...core.timing import report_time
from ..body.space import FemSpace, space_of
from ..mesh.group_checks import facets_of
from ..mesh.tagged_mesh import Facets
from .borrowing import borrow
from .bubbles import average_bubbles
from .conditions import NodalConditions, list_faced
from .counting import census_on_ranks, tell
from .faces import (
    check_angle,
    gather_boundary,
    in_symmetry_planes,
    integrate_nodal,
    split_at_corners,
    tell_corners,
)
from .flat_supports import choose_boundary, make_flat_question
from .frames import FemSurface, NodalFrames, gather_frame_data, snap_to_axes, surface_of
from .hinges import gather_points, mark_hinges, refuse_hinges
from .matching import EDGE_ON
from .nodes import Nodes, ask_alike, everywhere, gather_rows, join_nodes, slots_of
from .present import is_there, keep_present
from .traced import find_own_tangents
from .watching import Watched, sort_held, watch_nodes

log = logging.getLogger(__name__)


@report_time("contact")
def contact_surface(
    system: SemiDiscreteSystem,
    facets: Facets | None = None,
    *,
    obstacle: Obstacle | None = None,
    points: Sequence[Sequence[float]] | None = None,
    feature_angle: float = FEATURE_ANGLE,
    hinges: bool = False,
) -> ContactSurface:
    """Make the contact conditions of a part of the boundary, or of listed points of it only.

    Nodal weights are ∫ phi_i times the thickness of the section, so that r_n / weights is in Pa.
    Nodal normals have the direction of ∫ phi_i n over the facets; on rollers (a symmetry plane) the
    held component is left out. Nodes that are prescribed in every component, where the boundary
    meets a clamped or a moved part, have no condition; a motion that drives one of them into the
    obstacle is refused when it does. Nodes that move as one (``fem.Tied`` in all components) have
    one condition with the weights of all. P2 tetrahedra have their conditions at the vertices, for
    means of the gap around them (``fem.contact.bubbles``).

    Where the facets turn by more than the feature angle the boundary has faces, and a node on
    several of them has one condition for each, with the normal and the weight of this face, at any
    angle between them (``fem.contact.faces``). Where the obstacle gives all faces of a node one
    direction, as a HalfSpace does, the node has one condition.

    A body that turns (of SaintVenantKirchhoff, for example) may land with any node, on whichever
    side of it the node lies at the start: all of them have a condition with the flat support, whose
    normal does not turn (``fem.contact.flat_supports``).

    Args:
        system: the system of the body, of ``assemble``.
        facets: the part of the boundary; None: all of the boundary of a body that turns.
        obstacle: Touching() by default, HalfSpace, AnalyticGap or the user's own; it is asked for
            every face of a node.
        points: (k, d) coordinates; each is replaced by the nearest node of the facets. The order is
            kept.
        feature_angle: angle [rad]; facets around a node that turn by less from one another are one
            smooth face.
        hinges: True where the body may hang together with another one by nodes of this boundary, as
            by a pin.

    Raises:
        InputError: no contact nodes, nodes that only glue two bodies together, a listed point that
            is clamped or not on the facets, a contact direction that is partly prescribed, initial
            penetration, a node with more faces than the body has dimensions; another obstacle than
            a HalfSpace before a body that turns.
    """
    facets, body_turns = choose_boundary(system, facets, obstacle)
    space = contact_space(
        "contact_surface",
        system,
        {"facets": facets},
        points,
        obstacle=obstacle,
        feature_angle=feature_angle,
    )
    optional(
        provides,
        "contact_surface",
        "obstacle",
        obstacle,
        ("directions", "gap"),
        "give HalfSpace(…) or another",
    )
    angle = check_angle("contact_surface", feature_angle)
    flag("contact_surface", "hinges", hinges)
    comm = space.comm
    facets, _ = keep_present(space, facets)
    if not is_there(space, facets):
        return empty_surface(comm, space.dimension)

    # this rank's nodes of the facets, and those of them that are asked for: listed, or not clamped
    every = nodes_on(space, facets)
    hinge = mark_hinges(space, every)
    if not hinges:
        refuse_hinges("contact_surface", (facets.name,), gather_points(comm, every, hinge))
    if points is None:
        chosen = None
        whole = free_nodes(space, every, facets.name)
    else:
        chosen = find_listed(space, everywhere(comm, every), points, facets.name)
        whole = every.pick(_rows_of(every, chosen))

    # one node for each face, the obstacle's answer there, and one condition for each direction
    around = gather_boundary(space, facets, beyond=angle)
    nodes = whole if body_turns else split_at_corners(space, around, whole, angle)[0]
    slots = slots_of(comm, _places(nodes, chosen))
    count = round(total(comm, len(slots)))
    if body_turns:
        ask = make_flat_question(obstacle, space.size)
    else:
        ask = _make_question(obstacle, space.size, facets.name, angle, count)
    directions, gap = ask_alike(comm, slots, ask, nodes.points, nodes.normals)
    nodes, directions, gap = one_per_direction(whole, nodes, directions, gap)
    nodes, directions, gap = merge_ties(space, facets.name, nodes, directions, gap, angle)

    # conditions in the order of their nodes, or of the list
    order = np.argsort(_places(nodes, chosen), kind="stable")
    nodes = nodes.pick(order)
    directions = directions[order]
    gap = gap[order]
    slots = slots_of(comm, _places(nodes, chosen))
    tell_corners(space, facets.name, nodes, slots, angle)
    # nodes of the boundary without a condition borrow a pressure, unless points are listed
    without = every.numbers if chosen is None else every.numbers[:0]
    beside = borrow(space, facets, without, nodes.numbers)
    conditions = NodalConditions(
        nodes, directions, slots, bubbles=average_bubbles(space, facets, nodes), borrowed=beside
    )

    # what became of the nodes without a condition
    held = every.held.all(axis=1)
    wanted = np.isin(every.numbers, whole.numbers)
    kinds = dict(sort_held(space, every, held))
    kinds |= {
        "not listed": ~(held | wanted),
        "tied to another": wanted & ~np.isin(every.numbers, nodes.numbers),
        "shared with another body": hinge,
    }
    watched: tuple[Watched, ...] = ()
    if chosen is None and not body_turns:
        lost, _ = split_at_corners(space, around, every.pick(held), angle)
        watched = _watch_held(space, facets.name, lost, obstacle)
    census = census_on_ranks(comm, facets.name, every, kinds, len(slots))
    tell(comm, census)
    surface = surface_of(
        space,
        [conditions],
        gap0=gap,
        weights=nodes.weights * space.forms.section.thickness,
        censuses=(census,),
        watched=watched,
    )
    return replace(surface, **make_prescribed_motion(space, conditions, surface))


def make_prescribed_motion(
    space: FemSpace, conditions: NodalConditions, surface: FemSurface
) -> dict[str, Any]:
    """Return ``motion`` and slides of conditions that face prescribed nodes. Collective.

    Such nodes move like an obstacle. Bubbles of edges count as well: a prescribed vertex moves the
    mid-points that they are measured from.

    Args:
        space: the body's unknowns.
        conditions: this rank's.
        surface: what they are.

    Returns:
        functions of t [s], (m,) and (m, d - 1) [m], by the names of a ``FemSurface``; nothing where
        what conditions face is not moved.
    """
    faced = list_faced(conditions)
    moves = bool(faced) and space.moves
    held = any(part.nodes.held[part.P.indices].any() for part in faced)
    if not moves or not (space.hierarchy or largest(space.comm, held)):
        return {}
    traced = surface.traces is not None
    move = make_obstacle_motion(space, [conditions], traced=traced)
    alone = make_obstacle_motion(space, [conditions], traced=True)

    def motion(t: float) -> Array:
        towards, _ = move(space.evaluate_prescribed(t))
        return towards

    def slide(t: float) -> Array:
        _, along = move(space.evaluate_prescribed(t))
        return along

    def own_slide(t: float) -> Array:
        _, along = alone(space.evaluate_prescribed(t))
        return along

    return {"motion": motion, "slide": slide, "own_slide": own_slide}


def make_obstacle_motion(
    space: FemSpace, conditions: Sequence[NodalConditions], *, traced: bool = False
) -> Callable[[Array], tuple[Array, Array]]:
    """Return a function that tells how far prescribed nodes move as obstacles. Collective.

    What a condition faces moves by x = sum_j P_sj U_j; towards the node that is -n·x, and along
    each of its tangents t·x.

    Args:
        space: the bodies' unknowns.
        conditions: this rank's m conditions, one part after the other.
        traced: whether the tangents are those of conditions as traces.

    Returns:
        U (owned nodes, d), zero at free components -> (m,) and (m, d - 1) [m]; collective too.
    """
    # tangents of each condition that are free, and its vectors
    if traced:
        directions = np.concatenate([part.directions for part in conditions])
        tangents, free = find_own_tangents(conditions)
    else:
        frames = NodalFrames(*gather_frame_data(conditions))
        free = ~join_nodes([part.nodes for part in conditions]).held
        columns = list_tangential_columns(frames.column, space.dimension)
        free = np.take_along_axis(free, columns, axis=1) & frames.rubs
        tangents = make_tangent_vectors(frames.directions, frames.place)
        directions = frames.directions
    # the nodes that conditions of any rank face, each once
    faced = [list_faced(part) for part in conditions]
    own = [np.zeros(0, dtype=np.int64)]
    for others in faced:
        own += [other.nodes.numbers for other in others]
    numbers = np.unique(np.concatenate(from_each(space.comm, np.concatenate(own))))
    places = []
    for others in faced:
        places.append([np.searchsorted(numbers, other.nodes.numbers) for other in others])

    def move(nodal: Array) -> tuple[Array, Array]:
        nodal = nodal.reshape(-1, space.dimension)
        if space.hierarchy is not None:
            nodal = space.hierarchy.split_bubbles(nodal)
        values = space.at_nodes(numbers, nodal)
        motions = []
        for part, others, rows in zip(conditions, faced, places, strict=True):
            motion = np.zeros_like(part.directions)
            for other, place in zip(others, rows, strict=True):
                motion = motion + other.P @ values[place]
            motions.append(motion)
        x = np.concatenate(motions)
        return -np.sum(x * directions, axis=1), np.einsum("ijk,ij->ik", tangents, x) * free

    return move


def _make_question(
    obstacle: Obstacle | None, size: float, name: str, angle: float, count: int
) -> Callable[[Array, Array], tuple[Array, Array]]:
    """Return a function that asks an obstacle: points, normals (k, d) -> directions, gaps (k,) [m].

    It is called with the points of a rank or with all points of a boundary. Only where it has all
    of them, which their number tells, the far side of a round body can be let be
    (``locate_obstacle``).

    Args:
        obstacle: what the boundary faces; Touching() when None.
        size: that of the mesh [m].
        name: that of the boundary.
        angle: the feature angle [rad].
        count: how many points the boundary has on all ranks.
    """

    def ask(points: Array, normals: Array) -> tuple[Array, Array]:
        if not len(points):  # users' functions need not cope with none
            return np.zeros_like(points), np.zeros(0)
        way = Touching() if obstacle is None else obstacle
        directions, gap = locate_obstacle(
            way, points, normals, name=name, angle=angle, alone=len(points) == count
        )
        return snap_to_axes(directions), check_gap(gap, points, size)

    return ask


def _watch_held(
    space: FemSpace, name: str, nodes: Nodes, obstacle: Obstacle | None
) -> tuple[Watched, ...]:
    """Return what watches nodes that are prescribed in every component. Collective.

    Each is watched at those of its faces that look towards the obstacle.

    Args:
        space: the body's unknowns.
        name: that of the boundary.
        nodes: those of this rank that are held, a row for each face.
        obstacle: what the boundary faces.

    Raises:
        InputError: on all ranks, a face that is in the obstacle at the start.
    """
    slots = slots_of(space.comm, nodes.numbers)
    ask = _make_look(obstacle, space.size)
    directions, gap = ask_alike(space.comm, slots, ask, nodes.points, nodes.normals)
    rows = np.flatnonzero(directions.any(axis=1))
    return watch_nodes(space, name, nodes.pick(rows), directions[rows], gap[rows])


def _make_look(
    obstacle: Obstacle | None, size: float
) -> Callable[[Array, Array], tuple[Array, Array]]:
    """Return a function that asks an obstacle, as ``_make_question`` does, about held nodes.

    Directions are zero where they do not lead out of the body, or where the obstacle refuses to
    answer: at such nodes there is nothing to watch.

    Args:
        obstacle: what the boundary faces; Touching() when None.
        size: that of the mesh [m].
    """

    def ask(points: Array, normals: Array) -> tuple[Array, Array]:
        directions = np.zeros_like(points)
        gap = np.zeros(len(points))
        if not len(points):  # users' functions need not cope with none
            return directions, gap
        try:
            ways, gaps = locate_obstacle(
                Touching() if obstacle is None else obstacle, points, normals
            )
        except InputError:
            return directions, gap
        cosine = np.sum(ways * normals, axis=1)
        rows = np.flatnonzero(cosine > EDGE_ON * np.linalg.norm(ways, axis=1))
        directions[rows] = snap_to_axes(ways[rows])
        gap[rows] = check_gap(gaps[rows], points[rows], size)
        return directions, gap

    return ask


def _rows_of(nodes: Nodes, chosen: Indices) -> Indices:
    """Return the rows of those nodes that are chosen, in the order of the choice."""
    rows = np.flatnonzero(np.isin(nodes.numbers, chosen))
    return np.asarray(rows[np.argsort(_places(nodes.pick(rows), chosen))])


def _places(nodes: Nodes, chosen: Indices | None) -> Indices:
    """Return what orders the conditions of all ranks: numbers of nodes, or places in a list.

    Args:
        nodes: k nodes.
        chosen: numbers of listed nodes, in the order of the list; None without a list.

    Returns:
        (k,) keys.
    """
    if chosen is None:
        return nodes.numbers
    order = np.argsort(chosen)
    return np.asarray(order[np.searchsorted(chosen, nodes.numbers, sorter=order)])


def one_per_direction(
    whole: Nodes, nodes: Nodes, directions: Array, gap: Array
) -> tuple[Nodes, Array, Array]:
    """Return nodes, directions and gaps of conditions, one for each direction of a node.

    Faces of a node with one direction are one condition, with the sum of their weights and the
    smaller gap.

    Args:
        whole: the nodes, with the weights of all their faces.
        nodes: k rows, one for each face of a node, those of one node in a row.
        directions: (k, d) contact directions of these.
        gap: (k,) their gaps [m].
    """
    if len(nodes.numbers) == len(whole.numbers):
        return nodes, directions, gap
    weights = nodes.weights.copy()
    gap = gap.copy()
    stays = np.ones(len(nodes.numbers), dtype=bool)
    _, starts, counts = np.unique(nodes.numbers, return_index=True, return_counts=True)
    whole_weight = dict(zip(whole.numbers.tolist(), whole.weights, strict=True))
    several = counts > 1
    for start, count in zip(starts[several].tolist(), counts[several].tolist(), strict=True):
        # each row of the node joins the first row before it that has its direction, if any
        conditions: list[int] = []
        for row in range(start, start + count):
            alike = [
                other
                for other in conditions
                if directions[row] @ directions[other] > 1.0 - PARALLEL
            ]
            if alike:
                weights[alike[0]] += weights[row]
                gap[alike[0]] = min(gap[alike[0]], gap[row])
                stays[row] = False
            else:
                conditions.append(row)
        # where all faces are one condition its weight is that of the node to the last digit
        if len(conditions) == 1:
            weights[start] = whole_weight[int(nodes.numbers[start])]
    return replace(nodes, weights=weights).pick(stays), directions[stays], gap[stays]


def contact_space(
    owner: str, system: SemiDiscreteSystem, groups: Mapping[str, Facets], points: Any, **others: Any
) -> FemSpace:
    """Check what ``contact_surface`` and ``contact_pair`` both take; return the space. Collective.

    Args:
        owner: who asks.
        system: the system of ``assemble``.
        groups: what each boundary group means, and the group.
        points: a list of coordinates, or None.
        others: arguments that all ranks must give alike.

    Raises:
        InputError: another kind, groups of another mesh, a list of no points, and where ranks give
            other ``groups``, ``points`` or ``others``.
    """
    space = space_of(owner, system)
    agree(space.comm, owner, {**groups, "points": points, **others})
    for meaning, group in groups.items():
        facets_of(owner, meaning, group, space.mesh)
    if points is not None:
        for point in several(owner, "points", points, "give a list of points, or None"):
            several(owner, "a point", point, f"give {space.dimension} coordinates")
            array(owner, "a point", point, (None,))
    return space


def nodes_on(space: FemSpace, facets: Facets, integrals: Array | None = None) -> Nodes:
    """Return this rank's nodes of the facets, ordered by their numbers. Collective.

    Their weights are ∫ phi_i, their normals have the direction of ∫ phi_i n over the facets.

    Args:
        space: the body's unknowns.
        facets: the boundary.
        integrals: ``integrate_nodal`` of the facets where it is known, or None.

    Raises:
        InputError: on all ranks, facets without nodes, and facets inside of the body.
    """
    values = integrate_nodal(space, facets.indices) if integrals is None else integrals
    blocks = space.facet_blocks(facets.indices)
    if space.hierarchy is not None:
        blocks = np.intersect1d(blocks, space.hierarchy.vertices[1])
    blocks = blocks[np.argsort(space.nodes[blocks])]
    weights = values[blocks, 0]
    sums = values[blocks, 1:]
    held = space.held[blocks]
    if not largest(space.comm, len(blocks)):
        raise InputError(
            f"no contact nodes: boundary group '{facets.name}' is empty: choose a group with facets"
        )
    if largest(space.comm, not weights.all()):
        raise InputError(
            f"boundary group '{facets.name}' lies inside the body, where cells on both sides share "
            "its nodes: cut the mesh open there (meshes.cut.CutOpen), or choose an outer boundary"
        )
    # of facets that close round a node the sum is zero, and so is its normal here
    length = np.linalg.norm(sums, axis=1)[:, None]
    normals = in_symmetry_planes(sums / np.maximum(length, np.finfo(float).tiny), held)
    return Nodes(
        space.nodes[blocks], space.points[blocks], normals, weights, held, space.numbers[blocks]
    )


def free_nodes(space: FemSpace, nodes: Nodes, name: str) -> Nodes:
    """Return the nodes that are not held in every component. Collective.

    Args:
        space: the body's unknowns.
        nodes: those of this rank.
        name: that of the boundary.

    Raises:
        InputError: none is left on any rank.
    """
    clamped = nodes.held.all(axis=1)
    count = round(total(space.comm, clamped.sum()))
    if not largest(space.comm, (~clamped).any()):
        raise InputError(
            f"no contact nodes: every node of boundary group '{name}' is also fixed, and a point "
            "cannot be fixed and in contact: choose another boundary or fix less"
        )
    if count:
        log.info("%d fixed nodes of '%s' are left out of the contact surface", count, name)
    return nodes.pick(~clamped)


def find_listed(
    space: FemSpace, nodes: Nodes, points: Sequence[Sequence[float]], name: str
) -> Indices:
    """Return the numbers (k,) of the nodes nearest to listed points, in the order of the list.

    Args:
        space: the body's unknowns.
        nodes: those of all ranks.
        points: (k, d) coordinates [m].
        name: that of the boundary.

    Raises:
        InputError: an empty list, a point that is not on the boundary, clamped, or listed twice.
    """
    rows = []
    for point in points:
        x = np.asarray(point, dtype=float)
        if x.shape != (space.dimension,):
            raise InputError(f"contact point {tuple(point)}: give {space.dimension} coordinates")
        distance = np.linalg.norm(nodes.points - x, axis=1)
        row = int(np.argmin(distance))
        if distance[row] > 0.05 * space.size:
            raise InputError(
                f"contact point {describe_point(x)} is {distance[row]:.3g} m away from boundary "
                f"group '{name}': give a point on it, or leave points= out for the whole boundary"
            )
        if distance[row] > 1e-6 * space.size and space.comm.rank == 0:
            log.warning(
                "contact point %s is replaced by the nearest node, %.3g m away",
                describe_point(x),
                distance[row],
            )
        if nodes.held[row].all():
            raise InputError(
                f"contact point {describe_point(x)} is also fixed: leave it out, or fix less"
            )
        if row in rows:
            raise InputError(
                f"contact point {describe_point(x)} is listed twice (nearest node "
                f"{nodes.numbers[row]}): list each once, or leave points= out "
                "for the whole boundary"
            )
        rows.append(row)
    if not rows:
        raise InputError(
            f"no contact nodes: the list of contact points on '{name}' is empty: give points"
        )
    return np.asarray(nodes.numbers[rows])


def merge_tied(
    space: FemSpace, name: str, nodes: Nodes, directions: Array, angle: float
) -> tuple[Nodes, Array, Any]:
    """Merge the conditions of nodes that move as one (tied boundaries), one for each face.

    A merged condition has the sum of their weights, and means of all else by weight.

    Args:
        space: the body's unknowns.
        name: that of the boundary.
        nodes: those of the m conditions of all ranks.
        directions: (m, d) contact directions.
        angle: the feature angle [rad]: conditions whose directions turn by less are of one face.

    Returns:
        nodes and directions of the k conditions that are left, and their shares (k, m) in the m.

    Raises:
        InputError: a node that is tied in some components only, or to one without such a condition.
    """
    refuse_followers(space, name, nodes.numbers, nodes.points)
    leaders = space.leaders(nodes.numbers)
    # the row of a leader with the direction nearest to that of each node which follows it
    target = np.arange(len(nodes.numbers))
    for row in np.flatnonzero(np.isin(nodes.numbers, space.tied_nodes)):
        alike = np.flatnonzero(nodes.numbers == leaders[row])
        turn = directions[alike] @ directions[row]
        if turn.max(initial=-2.0) < np.cos(angle):
            if leaders[row] < 0:
                how = "is tied in some components only"
                remedy = "tie all components"
            else:
                how = "is tied to a node outside this contact"
                remedy = "add the boundary of that node to the group"
            raise InputError(
                f"contact node {describe_point(nodes.points[row])} of '{name}' {how}: leave it "
                f"out, by listing the others as points=, or {remedy}"
            )
        target[row] = alike[turn.argmax()]
    # one condition for all that have one target: shares are their weights over the sum of these
    targets, place = np.unique(target, return_inverse=True)
    sums = sp.csr_matrix((nodes.weights, (place.ravel(), np.arange(len(target)))))
    weights = np.asarray(sums.sum(axis=1)).ravel()
    shares = sp.csr_matrix(sp.diags([1.0 / weights], [0]) @ sums)
    merged = np.diff(shares.indptr) > 1
    directions = np.where(merged[:, None], snap_to_axes(shares @ directions), directions[targets])
    return replace(nodes.pick(targets), weights=weights), directions, shares


def refuse_followers(space: FemSpace, name: str, numbers: Indices, points: Array) -> None:
    """Raise InputError for nodes of a contact that follow several others through a tie.

    Args:
        space: the body's unknowns.
        name: that of the boundary.
        numbers: (k,) of its nodes.
        points: (k, d) their coordinates [m].
    """
    for row in np.flatnonzero(np.isin(numbers, space.mean_nodes))[:1]:
        raise InputError(
            f"contact node {describe_point(points[row])} of '{name}' is tied by matching= to "
            "several nodes: a contact beside such a tie takes the facets beside it alone, and both "
            "bodies need nodes at the same places where tie and contact meet"
        )


def merge_ties(
    space: FemSpace, name: str, nodes: Nodes, directions: Array, gap: Array, angle: float
) -> Any:
    """Return nodes, directions and gaps of this rank's conditions, tied ones merged. Collective.

    Args:
        space: the body's unknowns.
        name: that of the boundary.
        nodes: those of this rank's m conditions.
        directions: (m, d) contact directions.
        gap: (m,) [m].
        angle: the feature angle [rad].
    """
    tied = np.isin(nodes.numbers, space.tied_nodes)
    every = join_nodes(from_each(space.comm, nodes.pick(tied)))
    ways, gaps = gather_rows(space.comm, directions[tied], gap[tied])
    if not len(gaps):
        return nodes, directions, gap
    # merge those of all ranks, and keep what this rank owns of them
    every, ways, shares = merge_tied(space, name, every, ways, angle)
    own = np.flatnonzero(space.blocks_of(every.numbers) >= 0)
    nodes = join_nodes([nodes.pick(~tied), every.pick(own)])
    directions = np.concatenate([directions[~tied], ways[own]])
    return nodes, directions, np.concatenate([gap[~tied], (shares @ gaps)[own]])
