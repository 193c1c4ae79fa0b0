"""Make contact between two deformable bodies: unknowns of side 1 relative to side 2.

Opposite node s of side 1 with frame Q_s = (n, t), the other body moves by sum_j P_sj u_j. With û_s
= Q_sᵀ u_s, the unknowns û of the nodal frames are written in new ones ǔ,

    û = R ǔ,   û_s = ǔ_s + Q_sᵀ sum_j P_sj u_j   at contact nodes of side 1,   û = ǔ elsewhere

so that the relative normal displacement ǔ_n is one unknown again: ǔ_n <= gap0 is the condition,
friction acts on ǔ_t, and the work of a reaction on ǔ is that of the pair of forces r on side 1 and
-P_sjᵀ r on side 2: action is reaction. n is the outward normal of side 1, from side 1 to side 2.
Displacements are small: nobody's partner changes.

Both sides are gathered on every rank, which all do the same work up to the gaps; then each keeps
the conditions of its own nodes. Sides are ``Side`` (``matching``), what nodes of side 1 face is
``Matched``; ``_match_faces`` matches the faces of side 1 one by one.
"""

import logging
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, Indices, Mask
from ...core.checks import describe_point, flag, optional, provides
from ...core.collective import together
from ...core.corners import FEATURE_ANGLE
from ...core.errors import InputError
from ...core.internal import turns
from ...core.obstacles import PRESS_FIT
from ...core.surfaces import ContactSurface, empty_surface
from ...core.system import SemiDiscreteSystem
from ...core.timing import report_time
from ...meshes.rows import number_alike
from ..body.space import FemSpace
from ..mesh.tagged_mesh import Facets
from .borrowing import Borrowed, borrow
from .bubbles import average_bubbles
from .conditions import Facing, NodalConditions
from .counting import census_of_all, tell
from .covering import LEAST_SHARE
from .faces import check_angle, gather_boundary, split_at_corners, tell_corners
from .frames import snap_to_axes, surface_of
from .hinges import find_hinges, refuse_hinges
from .known_sides import KnownSides
from .matching import Matched, Matching, NodeToNode, Side
from .nodes import Nodes, everywhere, join_nodes
from .present import is_there, keep_present
from .skin import ROUND_OFF
from .surface import (
    contact_space,
    find_listed,
    make_prescribed_motion,
    merge_tied,
    nodes_on,
    refuse_followers,
)
from .watching import Watched, sort_held, watch_nodes

log = logging.getLogger(__name__)


def contact_pair(
    system: SemiDiscreteSystem,
    facets1: Facets,
    facets2: Facets,
    *,
    matching: Matching | None = None,
    points: Sequence[Sequence[float]] | None = None,
    feature_angle: float = FEATURE_ANGLE,
    hinges: bool = False,
) -> ContactSurface:
    """Make the contact conditions between two deformable boundaries.

    They are those of two bodies, or two faces of a crack.

    Each node of side 1 has a condition, with the normals, weights (times the section's thickness)
    and forces of side 1; r_n / weights is the pressure. Either side may be the first. Pressures are
    smoothest where side 1 is that of the softer body, or its facets are the smaller ones: those of
    a stiff side with facets a little larger than those of a soft side 2 zigzag. A body that rocks
    turns about its own edge where its base is side 1; where the ground is, about the ground's node
    next to this edge. With ``DualMortar`` nodes of side 1 beyond the edge of side 2 have no
    condition where less than half of their share is covered: the nodes inside carry it. Initial
    gaps are measured along the normals of side 1. Nodes that both sides share, at the tip of a
    crack, have no condition, and nodes that are clamped on both sides, or tied to the other side,
    have none either. Shared nodes round which the material does not go on, at the rim of a contact
    between bodies that are drawn between the same points, are refused unless ``hinges``. Nodes that
    are tied to one another share one. Prescribed nodes of side 2 move as they are prescribed, like
    a moving obstacle.

    Where side 1 turns by more than the feature angle its faces are matched one by one, and a node
    on several of them has one condition for each, as if every face were a pair of its own, joined
    by ``joined_surfaces``.

    Args:
        system: the system of both bodies, of ``assemble``.
        facets1: side 1, whose nodes have the conditions.
        facets2: side 2.
        matching: NodeToNode() by default, for sides meshed alike; DualMortar() for others.
        points: (k, d) coordinates; only the nodes of side 1 nearest to them have conditions, in
            this order.
        feature_angle: angle [rad]; facets around a node that turn by less from one another are one
            smooth face.
        hinges: True where bodies may hang together by nodes of these boundaries, as by a pin.

    Raises:
        InputError: nodes that only glue two bodies together, sides that do not pair or do not face
            each other, bodies that overlap, sides of one and the same boundary, contact directions
            that are partly prescribed, clamped nodes that face free ones.
    """
    return make_pair(
        system,
        facets1,
        facets2,
        matching=matching,
        points=points,
        feature_angle=feature_angle,
        hinges=hinges,
    )


@report_time("contact")
def make_pair(
    system: SemiDiscreteSystem,
    facets1: Facets,
    facets2: Facets,
    *,
    matching: Matching | None = None,
    points: Sequence[Sequence[float]] | None = None,
    feature_angle: float = FEATURE_ANGLE,
    hinges: bool = False,
    known: KnownSides | None = None,
) -> ContactSurface:
    """Make the conditions of ``contact_pair``, with what is known of many sides. Collective.

    Args:
        system: the system of both bodies.
        facets1: side 1.
        facets2: side 2.
        matching: how nodes find what they face.
        points: a list of coordinates, or None.
        feature_angle: [rad].
        hinges: whether bodies may hang together by nodes.
        known: integrals and hinges of these sides among others, of pairs that will be joined; None:
            they are found here.

    Raises:
        InputError: as ``contact_pair``.
    """
    space, angle = _check_pair(system, facets1, facets2, points, matching, feature_angle)
    flag("contact_pair", "hinges", hinges)
    if matching is None:
        matching = NodeToNode()

    facets1, present2 = keep_present(space, facets1, facets2)
    facets2 = present2 or facets2
    if not is_there(space, facets1):
        return empty_surface(space.comm, space.dimension)

    # what faces what: nodes of both sides, and of each face of side 1 what it has in front
    side1, side2, shared = _two_sides(space, facets1, facets2, known)
    hinge = _mark_hinges(space, side1, side2, shared, allowed=hinges, known=known)
    side1 = replace(side1, tied=_find_tied_over(space, side1, side2))
    faces = _divide_faces(space, facets1, side1, angle)
    with together(space.comm):  # a matching of the user's may fail on one rank
        nodes, matched = _match_faces(faces, side2, matching, space.size)

    # which nodes have a condition, and what became of the others
    nodes, matched, kinds, watched = _sort_nodes(
        space, side1, side2, nodes, matched, shared=shared, hinge=hinge, watch=points is None
    )
    if points is not None:
        nodes, matched, kinds["not listed"] = _pick_listed(space, side1, nodes, matched, points)

    # gaps along the normals; nodes that are tied to one another share one condition
    alone = nodes.numbers
    directions = snap_to_axes(nodes.normals)
    gap = _measure_gap(space, side1.name, side2, nodes, directions, matched)
    P = matched.P
    if len(space.mean_nodes):
        faced = np.flatnonzero(np.asarray(abs(P).max(axis=0).todense()).ravel() > ROUND_OFF)
        refuse_followers(space, side2.name, side2.nodes.numbers[faced], side2.nodes.points[faced])
    if len(space.tied_nodes):
        nodes, directions, shares = merge_tied(space, side1.name, nodes, directions, angle)
        gap = shares @ gap
        P = sp.csr_matrix(shares @ P)
        kinds["tied to another"] = np.isin(side1.nodes.numbers, np.setdiff1d(alone, nodes.numbers))
    uncovered = np.isin(nodes.numbers, side1.nodes.numbers[kinds["hardly covered"]])
    some_uncovered = bool(uncovered.any())
    census = census_of_all(side1.name, side1.nodes, kinds, len(nodes.numbers))
    tell(space.comm, census)

    # from here on every rank has its own nodes of side 1
    slots = np.flatnonzero(space.blocks_of(nodes.numbers) >= 0)
    nodes = nodes.pick(slots)
    directions = directions[slots]
    gap = gap[slots]
    P = P[slots]
    uncovered = uncovered[slots]
    tell_corners(space, side1.name, nodes, slots, angle)
    own_bubbles = average_bubbles(space, facets1, nodes)
    their_bubbles = average_bubbles(space, facets2, side2.nodes, P)
    conditions = NodalConditions(
        nodes,
        directions,
        slots,
        facing=Facing(side2.nodes, P),
        bubbles=own_bubbles + their_bubbles,
        borrowed=_borrow(space, facets1, side1, kinds, nodes.numbers[~uncovered]),
    )
    surface = surface_of(
        space,
        [conditions],
        gap0=gap,
        weights=nodes.weights * space.forms.section.thickness,
        censuses=(census,),
        watched=watched,
        joins=known is not None,
    )
    if some_uncovered:
        surface = replace(surface, uncovered=uncovered)
    return replace(surface, **make_prescribed_motion(space, conditions, surface))


def _check_pair(
    system: SemiDiscreteSystem,
    facets1: Facets,
    facets2: Facets,
    points: Sequence[Sequence[float]] | None,
    matching: Matching | None,
    feature_angle: float,
) -> tuple[FemSpace, float]:
    """Return the space of the system and the feature angle as a float [rad]. Collective.

    Args:
        system: the system of both bodies.
        facets1: side 1.
        facets2: side 2.
        points: a list of coordinates, or None.
        matching: how nodes find what they face, or None.
        feature_angle: [rad].

    Raises:
        InputError: on all ranks, wrong arguments.
    """
    if turns(getattr(system, "internal", None)):
        raise InputError(
            "contact_pair: bodies that turn have contact with flat rigid supports alone, as the "
            "normals between two bodies would turn: give LinearElastic materials, or "
            "contact_surface(system, obstacle=HalfSpace(…))"
        )
    space = contact_space(
        "contact_pair",
        system,
        {"facets1": facets1, "facets2": facets2},
        points,
        matching=matching,
        feature_angle=feature_angle,
    )
    optional(
        provides,
        "contact_pair",
        "matching",
        matching,
        ("match",),
        "give NodeToNode() or DualMortar(), or None",
    )
    angle = check_angle("contact_pair", feature_angle)
    if space.hierarchy is not None and not isinstance(matching or NodeToNode(), NodeToNode):
        raise InputError(
            "contact_pair: sides of P2 tetrahedra are matched by matching=NodeToNode() only: mesh "
            "both sides alike, or use degree=1"
        )
    return space, angle


def _two_sides(
    space: FemSpace, facets1: Facets, facets2: Facets, known: KnownSides | None
) -> tuple[Side, Side, Mask]:
    """Return both sides, and a mask of the nodes of side 1 that side 2 has too. Collective.

    Args:
        space: the bodies' unknowns.
        facets1: side 1.
        facets2: side 2.
        known: what is known of many sides, or None.

    Raises:
        InputError: sides of the same nodes, and a facet on both sides: nothing can part there.
    """
    side1 = side_of(space, facets1, known)
    side2 = side_of(space, facets2, known)
    shared = np.isin(side1.nodes.numbers, side2.nodes.numbers)
    if shared.all():
        raise InputError(
            f"'{side1.name}' and '{side2.name}' are the same nodes, so that nothing can part "
            "there: mesh the bodies one by one, or cut the mesh open (meshes.cut.CutOpen)"
        )
    _refuse_common(side1, side2)
    return side1, side2, shared


def _pick_listed(
    space: FemSpace,
    side1: Side,
    nodes: Nodes,
    matched: Matched,
    points: Sequence[Sequence[float]],
) -> tuple[Nodes, Matched, Mask]:
    """Return the conditions at the nodes nearest to points, in their order, and who is left out.

    Args:
        space: the bodies' unknowns.
        side1: side 1.
        nodes: those of it with a condition.
        matched: what they face.
        points: (k, d) coordinates [m].

    Returns:
        nodes and what they face, and a mask of the nodes of side 1 that are not listed.
    """
    chosen = find_listed(space, nodes, points, side1.name)
    rows = np.concatenate([np.flatnonzero(nodes.numbers == number) for number in chosen])
    others = np.isin(side1.nodes.numbers, np.setdiff1d(nodes.numbers, chosen))
    return nodes.pick(rows), matched.pick(rows), others


def side_of(space: FemSpace, facets: Facets, known: KnownSides | None = None) -> Side:
    """Gather a boundary on every rank: nodes in the order of their numbers, each facet once.

    Collective.

    Args:
        space: the bodies' unknowns.
        facets: the boundary.
        known: what is known of many sides, or None.
    """
    integrals = None if known is None else known.find_integrals(facets)
    nodes = everywhere(space.comm, nodes_on(space, facets, integrals))
    rows = np.concatenate(
        space.comm.bcast(space.comm.gather(space.corners_of_facets(facets.indices)))
    )
    _, first = np.unique(np.sort(rows, axis=1), axis=0, return_index=True)
    return Side(facets.name, nodes, np.searchsorted(nodes.numbers, rows[first]))


def _sort_nodes(
    space: FemSpace,
    side1: Side,
    side2: Side,
    nodes: Nodes,
    matched: Matched,
    *,
    shared: Mask,
    hinge: Mask,
    watch: bool,
) -> tuple[Nodes, Matched, dict[str, Mask], tuple[Watched, ...]]:
    """Sort the matched nodes into those with a condition and others. Collective.

    Args:
        space: the bodies' unknowns.
        side1: side 1, of m nodes.
        side2: side 2.
        nodes: the matched nodes of side 1, a row for each face.
        matched: what they face.
        shared: (m,) nodes of both sides.
        hinge: (m,) nodes that only glue bodies together.
        watch: whether nodes that are prescribed in every component are watched.

    Returns:
        the nodes with a condition, what they face, kind -> mask (m,) of all others and of those
        with hardly anything in front of them, and what watches prescribed ones.
    """
    # nodes of both sides, and nodes tied over, cannot part
    tied = side1.nodes.numbers[np.asarray(side1.tied) >= 0]
    opposite = np.concatenate([nodes.numbers, matched.carried])
    carried = np.setdiff1d(matched.carried, nodes.numbers)
    can_part = ~np.isin(nodes.numbers, np.union1d(side2.nodes.numbers, tied))
    nodes = nodes.pick(can_part)
    matched = matched.pick(can_part)

    # nodes that are held in every component have no condition
    free = _find_unclamped(space, side1.name, nodes, side2, matched)
    kinds = _sort_kinds(side1, shared, opposite, nodes.numbers[~free])
    kinds |= _sort_held_anywhere(space, side1, kinds["fixed"])
    watched: tuple[Watched, ...] = ()
    if watch:
        watched = _watch_held(space, side1, side2, nodes.pick(~free), matched.pick(~free))

    # what lies in front of the others: others carry nodes with little, if there are any
    kinds["partly covered"] = np.isin(side1.nodes.numbers, carried)
    little = nodes.numbers[free & (matched.shares < LEAST_SHARE)]
    kinds["hardly covered"] = np.isin(side1.nodes.numbers, little)
    _warn_of_coarse(space, side1, side2, little)
    kinds |= {
        "shared with another body": hinge & ~shared,
        "tied to the other side": np.isin(side1.nodes.numbers, tied),
    }
    kinds["in front of nothing"] &= ~kinds["tied to the other side"]
    return nodes.pick(free), matched.pick(free), kinds, watched


def _sort_kinds(side1: Side, shared: Mask, opposite: Indices, clamped: Indices) -> dict[str, Mask]:
    """Return kind -> mask (m,) of the nodes of side 1 that have no condition, as a census says it.

    Args:
        side1: side 1, of m nodes.
        shared: (m,) nodes of both sides.
        opposite: numbers of those in front of side 2.
        clamped: numbers of those that are clamped.
    """
    numbers = side1.nodes.numbers
    return {
        "shared by both sides": shared,
        "fixed": np.isin(numbers, clamped),
        "in front of nothing": ~(shared | np.isin(numbers, opposite)),
    }


def _warn_of_coarse(space: FemSpace, side1: Side, side2: Side, little: Indices) -> None:
    """Warn, on rank 0, of nodes with a condition around which little of side 1 is covered.

    Args:
        space: the bodies' unknowns.
        side1: side 1.
        side2: side 2.
        little: numbers of these nodes.
    """
    if len(little) and space.comm.rank == 0:
        where = describe_point(side1.nodes.points[np.searchsorted(side1.nodes.numbers, little[0])])
        log.warning(
            "%d contact nodes of '%s', the first at %s, have hardly anything of '%s' in front of "
            "their facets, and no whole facet is near: their pressures are left out of the largest "
            "ones; make '%s' the first side, or mesh '%s' finer",
            len(little),
            side1.name,
            where,
            side2.name,
            side2.name,
            side1.name,
        )


def _sort_held_anywhere(space: FemSpace, side1: Side, clamped: Mask) -> dict[str, Mask]:
    """Return kind -> mask of the nodes of side 1 held in every component, at rest or moved.

    Collective.

    Args:
        space: the bodies' unknowns.
        side1: side 1, of m nodes.
        clamped: (m,) nodes held in every component.
    """
    # a rank knows of its own nodes only whether something moves them
    own = sort_held(space, side1.nodes, clamped)
    moved = space.comm.max(own["prescribed"].astype(float)) > 0.0
    return {"fixed": clamped & ~moved, "prescribed": clamped & moved}


def _watch_held(
    space: FemSpace, side1: Side, side2: Side, nodes: Nodes, matched: Matched
) -> tuple[Watched, ...]:
    """Return what watches nodes of side 1 that are held in every component. Collective.

    Only those in front of nodes that are held so too are watched.

    Args:
        space: the bodies' unknowns.
        side1: side 1.
        side2: side 2.
        nodes: the held nodes of side 1, of all ranks.
        matched: what they face.
    """
    # what faces no free node of side 2
    free_share = matched.P @ (~side2.nodes.held.all(axis=1)).astype(float)
    known = np.asarray(free_share) == 0.0
    nodes = nodes.pick(known)
    matched = matched.pick(np.flatnonzero(known))
    if not len(nodes.numbers):
        return ()
    directions = snap_to_axes(nodes.normals)
    gap = _measure_gap(space, side1.name, side2, nodes, directions, matched)
    own = np.flatnonzero(space.blocks_of(nodes.numbers) >= 0)
    opposite = Facing(side2.nodes, sp.csr_matrix(matched.P[own]))
    return watch_nodes(
        space, side1.name, nodes.pick(own), directions[own], gap[own], opposite, side2.name
    )


def _borrow(
    space: FemSpace, facets: Facets, side1: Side, kinds: dict[str, Mask], having: Indices
) -> Borrowed | None:
    """Return what nodes of side 1 without a pressure of their own take of neighbours. Collective.

    Nodes in front of nothing take none: there the pressure is zero.

    Args:
        space: the bodies' unknowns.
        facets: those of side 1.
        side1: side 1.
        kinds: what became of its nodes.
        having: numbers of this rank's nodes with a pressure.
    """
    without = np.any(
        [mask for kind, mask in kinds.items() if kind not in ("in front of nothing", "not listed")],
        axis=0,
    )
    return borrow(space, facets, side1.nodes.numbers[without], having)


def _mark_hinges(
    space: FemSpace,
    side1: Side,
    side2: Side,
    shared: Mask,
    *,
    allowed: bool,
    known: KnownSides | None,
) -> Mask:
    """Return a mask (m,) of the nodes of side 1 that only glue bodies together. Collective.

    Args:
        space: the bodies' unknowns.
        side1: side 1, of m nodes.
        side2: side 2.
        shared: (m,) nodes of both sides.
        allowed: whether bodies may hang together so.
        known: what is known of many sides, or None.

    Raises:
        InputError: there are some, and they are not ``allowed``.
    """
    numbers = np.union1d(side1.nodes.numbers, side2.nodes.numbers)
    clamped = [side.nodes.numbers[side.nodes.held.all(axis=1)] for side in (side1, side2)]
    asked = np.setdiff1d(numbers, np.concatenate(clamped))
    every = find_hinges(space, asked) if known is None else known.hinges
    hinges = np.intersect1d(asked, every)
    here = np.isin(side1.nodes.numbers, hinges)
    if not allowed:
        refuse_hinges("contact_pair", (side1.name, side2.name), side1.nodes.points[here & shared])
        for side in (side1, side2):
            there = np.isin(side.nodes.numbers, hinges)
            refuse_hinges("contact_pair", (side.name,), side.nodes.points[there])
    return np.asarray(here)


def _find_tied_over(space: FemSpace, side1: Side, side2: Side) -> Indices:
    """Find the nodes of side 2 to which those of side 1 are tied in all components.

    Such nodes cannot part, as the two sides of a weld.

    Args:
        space: the bodies' unknowns.
        side1: side 1, of m nodes.
        side2: side 2.

    Returns:
        (m,) places on side 2; of several, as where ties meet, the nearest one; -1 for none.
    """
    places = np.full(len(side1.nodes.numbers), -1)
    if not len(space.tied_nodes):
        return places
    # nodes that follow one leader move as one
    own = space.leaders(side1.nodes.numbers)
    others = space.leaders(side2.nodes.numbers)
    tied = np.isin(side1.nodes.numbers, space.tied_nodes) & (own >= 0) & np.isin(own, others)
    for row in np.flatnonzero(tied):
        alike = np.flatnonzero(others == own[row])
        apart = np.linalg.norm(side2.nodes.points[alike] - side1.nodes.points[row], axis=1)
        places[row] = alike[np.argmin(apart)]
    return places


def _refuse_common(side1: Side, side2: Side) -> None:
    """Raise InputError for a facet that is listed on both sides."""
    own, others = number_alike(*(side.nodes.numbers[side.facets] for side in (side1, side2)))
    for facet in np.flatnonzero(np.isin(own, others))[:1]:
        where = describe_point(side1.nodes.points[side1.facets[facet]].mean(axis=0))
        raise InputError(
            f"a facet of both '{side1.name}' and '{side2.name}' at {where}: a facet cannot touch "
            "itself, so list it on one side only"
        )


def _divide_faces(
    space: FemSpace, facets1: Facets, side1: Side, angle: float
) -> list[tuple[Side, Array]]:
    """Divide side 1 into its smooth faces, each a side by itself. Collective.

    Args:
        space: the bodies' unknowns.
        facets1: the facets of side 1.
        side1: side 1.
        angle: that up to which facets round a node are one face [rad].

    Returns:
        pairs of a face, with normals and weights of its own, and the normals (n, d) that its nodes
        have over the whole of side 1.

    Raises:
        InputError: a face that meets itself.
    """
    # the facets of all ranks are gathered only where some of them may turn so far
    around = gather_boundary(space, facets1, beyond=angle)
    if len(around.vertices):
        around = gather_boundary(space, facets1)
    nodes, facet = split_at_corners(space, around, side1.nodes, angle)
    if len(nodes.numbers) == len(side1.nodes.numbers):
        return [(side1, side1.nodes.normals)]

    # each face has the nodes of its facets; of a node with several rows it has the one of the face
    face_of = around.faces(angle)
    faces = []
    for face in range(int(face_of.max()) + 1):
        facets = side1.facets[face_of == face]
        used = np.unique(facets)
        inside = np.isin(nodes.numbers, side1.nodes.numbers[used]) & (
            (facet < 0) | (face_of[facet] == face)
        )
        own = nodes.pick(inside)
        if len(own.numbers) > len(used):
            again = own.points[1:][np.diff(own.numbers) == 0][0]
            raise InputError(
                f"'{side1.name}' turns round and meets itself at {describe_point(again)}: give "
                f"it as two "
                "boundaries (fem.joined_surfaces), or treat the corner as smooth (a larger "
                "feature_angle=)"
            )
        tied = None if side1.tied is None else side1.tied[used]
        side = Side(side1.name, own, np.searchsorted(used, facets), tied)
        faces.append((side, side1.nodes.normals[used]))
    return faces


def _match_faces(
    faces: Sequence[tuple[Side, Array]], side2: Side, matching: Matching, size: float
) -> tuple[Nodes, Matched]:
    """Match all faces of side 1, and put what they face together.

    Faces in front of nothing are left out where the matching leaves out parts of sides
    (``partial``), unless all are.

    Args:
        faces: those of side 1, and the normals of their nodes over the whole side.
        side2: side 2.
        matching: how nodes find what they face.
        size: that of the mesh [m].

    Returns:
        the m matched nodes with the normals and weights of their faces, ordered by number, and what
        they face, ``carried`` being numbers of nodes here.
    """
    refusal = None
    parts: list[Nodes] = []
    matches: list[Matched] = []
    for side, mean in faces:
        try:
            matched = _match_face(side, mean, side2, matching, size)
        except InputError as error:
            if not getattr(matching, "partial", False):
                raise
            refusal = refusal or error
        else:
            parts.append(side.nodes.pick(matched.rows))
            carried = side.nodes.numbers[matched.carried]
            matches.append(replace(matched, carried=carried))
    if refusal is not None and not matches:
        raise refusal

    # all faces together; a node of several of them has several rows, side by side
    nodes = join_nodes(parts)
    order = np.arange(len(nodes.numbers))
    if len(parts) > 1:
        order = np.argsort(nodes.numbers, kind="stable")
    weights = np.concatenate([matched.weights for matched in matches])
    whole = Matched(
        rows=np.arange(len(order)),
        P=sp.csr_matrix(sp.vstack([matched.P for matched in matches])),
        weights=weights,
        overlap=np.concatenate([matched.overlap for matched in matches]),
        covered=np.concatenate([matched.shares for matched in matches]),
        carried=np.concatenate([matched.carried for matched in matches]),
    )
    return replace(nodes, weights=weights).pick(order), whole.pick(order)


def _match_face(side: Side, mean: Array, side2: Side, matching: Matching, size: float) -> Matched:
    """Return what a face of side 1 faces: along its own normals, else along mean ones.

    Across a gap the partner of a corner lies on the bisector of its faces, along the mean of their
    normals. A matching that leaves out what faces nothing looks along the own normals only: sides
    of a block would see the ground beside its base.

    Args:
        side: a face of side 1.
        mean: (n, d) normals of its nodes over the whole side.
        side2: side 2.
        matching: how nodes find what they face.
        size: that of the mesh [m].
    """
    try:
        return matching.match(side, side2, size)
    except InputError:
        if getattr(matching, "partial", False) or np.array_equal(mean, side.nodes.normals):
            raise
        try:
            return matching.match(
                replace(side, nodes=replace(side.nodes, normals=mean)), side2, size
            )
        except InputError:
            pass
        raise


def _find_unclamped(
    space: FemSpace, name: str, nodes: Nodes, side2: Side, matched: Matched
) -> Mask:
    """Return a mask (m,) of the matched nodes that are not clamped.

    Args:
        space: the bodies' unknowns.
        name: that of side 1.
        nodes: its matched nodes.
        side2: side 2.
        matched: what they face.

    Raises:
        InputError: clamped nodes face free ones, or none are left.
    """
    clamped = nodes.held.all(axis=1)
    facing = np.asarray(matched.P.argmax(axis=1)).ravel()
    lost = np.flatnonzero(clamped & ~side2.nodes.held[facing].all(axis=1))
    if len(lost):
        raise InputError(
            f"contact node {describe_point(nodes.points[lost[0]])} of '{name}' is fixed but "
            f"faces a free "
            f"node of '{side2.name}': make '{side2.name}' the first side, or fix less"
        )
    if clamped.all():
        raise InputError(
            f"no contact nodes: every node of '{name}' that faces '{side2.name}' is fixed, on "
            "both sides or tied to the other side; fix or tie less"
        )
    if clamped.any() and space.comm.rank == 0:
        log.info("%d fixed nodes of '%s' are left out of the contact", clamped.sum(), name)
    return np.asarray(~clamped)


def _measure_gap(
    space: FemSpace, name: str, side2: Side, nodes: Nodes, directions: Array, matched: Matched
) -> Array:
    """Return initial gaps n·(P x_2 - x_1) >= 0 (m,) [m].

    Overlaps of round-off (1e-12 of the mesh's size) or of polygons count as 0.

    Args:
        space: the bodies' unknowns.
        name: that of side 1.
        side2: side 2.
        nodes: m nodes of side 1.
        directions: (m, d) unit vectors n towards side 2.
        matched: what they face.

    Raises:
        InputError: a larger overlap.
    """
    gap = np.sum((matched.P @ side2.nodes.points - nodes.points) * directions, axis=1)
    # rounding is that of the mesh's size, or of coordinates where the mesh lies far from the origin
    far = float(np.abs(side2.nodes.points).max(initial=0.0))
    rounding = max(1e-12 * space.size, float(ROUND_OFF) * far)
    behind = -gap - np.maximum(matched.overlap, rounding)
    if behind.max() > 0.0:
        worst = int(np.argmax(behind))
        raise InputError(
            f"'{side2.name}' lies {-gap[worst]:.3g} m behind '{name}' at "
            f"{describe_point(nodes.points[worst])}"
            ": the bodies overlap there, or these are not the boundaries between them; choose the "
            f"sides that face, or {PRESS_FIT}"
        )
    if gap.min() < -rounding and space.comm.rank == 0:
        log.warning(
            "'%s' and '%s' overlap by up to %.3g m: they count as touching there",
            name,
            side2.name,
            -gap.min(),
        )
    return np.maximum(gap, 0.0)
