"""Find the joints between the bodies of a mesh from the geometry, without named lines.

The steps: ``skin`` gathers the boundary of all bodies, ``facing`` pairs facets that face each
other, ``overlaps`` refuses bodies that overlap, and here pairs are grouped: a joint is pairs of
facets between two bodies that hang together, by common nodes of smooth faces on either side.
"""

import logging
from collections.abc import Sequence
from typing import Any

import numpy as np
from dolfinx.mesh import Mesh

from ...core.algebra import Array, Indices, Mask, from_each
from ...core.checks import instance, number, several
from ...core.errors import InputError
from ...core.surfaces import ContactSurface
from ...core.system import SemiDiscreteSystem
from ...core.timing import report_time
from .. import compat
from ..body.space import FemSpace, space_of
from ..mesh.communicators import MpiComm
from ..mesh.group_checks import cells_of
from ..mesh.tagged_mesh import Cells, Facets, Tags
from .corner_points import find_corner_points
from .facing import Sights, find_sights, group_pairs
from .joined import joined_surfaces
from .joint_list import NAMED, Joint, Joints
from .known_sides import know_sides
from .matching import Matching, NodeToNode
from .merged_joints import merge_joints
from .mortar import DualMortar
from .overlaps import find_deepest, refuse_overlaps
from .pairs import make_pair
from .skin import Skin, gather_skin

log = logging.getLogger(__name__)
ALIKE = 1e-6  # of a share: numbers that differ by less are equal
FULL = 1.0 - ALIKE


@report_time("joints")
def find_joints(
    where: SemiDiscreteSystem | Mesh,
    *,
    within: float = 0.0,
    between: Sequence[Cells] | None = None,
    tags: Tags | None = None,
) -> Joints:
    """Find all places where bodies of a mesh touch, or lie within a gap of each other. Collective.

    Bodies are parts of the mesh that share no node. Two facets of different bodies pair where their
    outward normals are opposite to 30°, the gap along the normal is at most ``within`` and no other
    facet lies between them. Pairs that hang together on both bodies are one joint; where a face
    turns by more than 30° another joint begins. Facets touch whose distance is at most 1e-6 of
    their size, at curved faces with what straight facets leave out. The list is the same on any
    number of ranks.

    Args:
        where: a mesh in the plane or in space, or a system of ``assemble``; facets that are tied in
            the system are left out.
        within: largest gap [m].
        between: groups of whole bodies. With one of them the joints among its bodies are found,
            with two the joints between a body of the first and a body of the second; None for all.
        tags: groups of the mesh: a cell group that is one whole body names it.

    Returns:
        the joints, with bodies that have none and points where only corners touch.

    Raises:
        InputError: on all ranks, wrong arguments, a group that is a part of a body, bodies that
            overlap by more than rounding.
    """
    mesh, ties = _read_where("find_joints", where)
    comm = MpiComm(mesh.comm)
    within = number("find_joints", "within", within, not_negative=True, unit="m")
    skin = gather_skin(comm, mesh)
    groups = _read_groups(mesh, skin, between)
    names = _name_bodies(mesh, skin, tags)

    pairs, behind = find_sights(skin, within)
    refuse_overlaps("find_joints", find_deepest(comm, mesh, skin, behind), names)
    tied = _find_tied(comm, skin, pairs, ties)
    corners, corner_bodies = find_corner_points(skin, pairs)

    wanted = _are_between(skin, pairs, groups) & ~tied
    joints = tuple(_make_joints(mesh, skin, pairs.pick(wanted), names))
    some = np.unique(skin.body[pairs.looking])
    asked = np.unique(np.concatenate(groups)) if groups else np.arange(skin.bodies)
    lonely = tuple(np.setdiff1d(asked, some).tolist())
    _warn_of_lonely(comm, lonely, names, within)
    return Joints(
        joints=joints,
        within=within,
        names=tuple(names),
        lonely=lonely,
        corners=corners,
        corner_bodies=corner_bodies,
        tied=int(tied.sum()) // 2,
        outlines=skin.corners,
        outline_normals=skin.normals,
        outline_bodies=skin.body,
    )


def contact_pairs(
    system: SemiDiscreteSystem,
    *,
    within: float = 0.0,
    between: Sequence[Cells] | None = None,
    tags: Tags | None = None,
    matching: Matching | None = None,
) -> ContactSurface:
    """Make the contact conditions of all joints that ``find_joints`` finds. Collective.

    They are those of ``contact_pair`` for each joint, in the order of the list, joined by
    ``joined_surfaces``. Joints by mortar that share a facet, as two stones above a third that share
    one of its facets, are one pair: such a facet is covered wholly by both, while the part that
    each covers alone would press unevenly.

    Args:
        system: the system of all bodies, of ``assemble``.
        within: largest gap [m].
        between: groups of whole bodies, as in ``find_joints``; None for all.
        tags: groups of the mesh, which name bodies in messages.
        matching: how nodes find what they face; None for NodeToNode() at joints of equal facets and
            DualMortar() at others.

    Raises:
        InputError: on all ranks, what ``find_joints`` and ``contact_pair`` refuse; no joints.
    """
    space: FemSpace = space_of("contact_pairs", system)
    joints = find_joints(system, within=within, between=between, tags=tags)
    if not len(joints):
        raise InputError(
            f"contact_pairs: no two bodies touch within {within:g} m: give within= a larger gap, "
            "or look at the mesh, where bodies may share nodes (meshes.CutApart)"
        )
    pairs = list(merge_joints(joints, matching))
    # with absent bodies each pair keeps other facets, and is integrated by itself
    known = None
    if space.absent is None:
        known = know_sides(space, [side for pair in pairs for side in pair[:2]])
    surfaces = []
    for facets1, facets2, alike in pairs:
        way = matching or (NodeToNode() if alike else DualMortar())
        surfaces.append(make_pair(system, facets1, facets2, matching=way, known=known))
    return joined_surfaces(*surfaces)


# Arguments
# --------------------------------------------------------------------------------------------------


def _read_where(owner: str, where: Any) -> tuple[Mesh, list[tuple[Facets, Facets]]]:
    """Return the mesh of a system or the mesh itself, and what is tied in it.

    Raises:
        InputError: anything else, and a mesh in one dimension.
    """
    ties: list[tuple[Facets, Facets]] = []
    mesh = where
    if isinstance(where, SemiDiscreteSystem):
        space: FemSpace = space_of(owner, where)
        mesh = space.mesh
        ties = [(tie.first, tie.second) for tie in space.ties]
    instance(owner, "where", mesh, Mesh, "give a DOLFINx mesh, or a system of fem.assemble")
    if mesh.geometry.dim not in (2, 3) or mesh.topology.dim != mesh.geometry.dim:
        raise InputError(
            f"{owner}: the mesh has cells of dimension {mesh.topology.dim} in a space of dimension "
            f"{mesh.geometry.dim}; give bodies in the plane or in space"
        )
    return mesh, ties


def _read_groups(mesh: Mesh, skin: Skin, between: Sequence[Cells] | None) -> list[Indices]:
    """Return the bodies of each group, none where all bodies count. Collective.

    Raises:
        InputError: more than two groups, what is no group of cells, parts of bodies.
    """
    if between is None:
        return []
    remedy = "give one or two groups of cells in a list"
    given = several("find_joints", "between", between, remedy)
    if not 1 <= len(given) <= 2:
        raise InputError(f"find_joints: between has {len(given)} members; {remedy}")
    groups = []
    for group in given:
        cells_of("find_joints", "between", group, mesh)
        whole, part = _list_bodies(mesh, skin, [group])[0]
        if len(part) or not len(whole):
            raise InputError(
                f"find_joints: the cell group '{group.name}' is a part of a body and shares nodes "
                "with other cells; give a group of whole bodies, or cut them apart "
                "(meshes.CutApart)"
            )
        groups.append(whole)
    return groups


def _name_bodies(mesh: Mesh, skin: Skin, tags: Tags | None) -> list[str]:
    """Return the names of the bodies: of the group that is one of them, or by number. Collective.

    Args:
        mesh: the mesh.
        skin: the boundary of all bodies.
        tags: groups of the mesh, or None.
    """
    names = [f"body {number}" for number in range(skin.bodies)]
    if tags is None:
        return names
    instance("find_joints", "tags", tags, Tags, "give the groups that build_mesh returns")
    groups = [group for group in tags.values() if isinstance(group, Cells)]
    found = _list_bodies(mesh, skin, groups)
    named: set[int] = set()
    for group, (whole, part) in zip(groups, found, strict=True):
        if len(whole) == 1 and not len(part) and int(whole[0]) not in named:
            named.add(int(whole[0]))
            names[int(whole[0])] = group.name
    return names


def _list_bodies(mesh: Mesh, skin: Skin, groups: Sequence[Cells]) -> list[tuple[Indices, Indices]]:
    """Return the bodies that are in each group as a whole, and those in part. Collective.

    Args:
        mesh: the mesh.
        skin: the boundary of all bodies.
        groups: of cells.
    """
    owned = mesh.topology.index_map(mesh.topology.dim).size_local
    body = skin.body_of_node[compat.geometry_dofmap(mesh)[:owned, 0]]
    counts = np.zeros((len(groups) + 1, skin.bodies), dtype=np.int64)
    counts[-1] = np.bincount(body, minlength=skin.bodies)
    for row, group in enumerate(groups):
        mine = group.indices[group.indices < owned]
        counts[row] = np.bincount(body[mine], minlength=skin.bodies)
    counts = np.sum(from_each(MpiComm(mesh.comm), counts), axis=0)
    every = counts[-1]
    answers = []
    for inside in counts[:-1]:
        whole = np.flatnonzero((inside == every) & (every > 0))
        part = np.flatnonzero((inside > 0) & (inside < every))
        answers.append((whole, part))
    return answers


def _are_between(skin: Skin, pairs: Sights, groups: list[Indices]) -> Mask:
    """Say which pairs (k,) of facets are between bodies of the groups."""
    if not groups:
        return np.ones(len(pairs.looking), dtype=bool)
    first = skin.body[pairs.looking]
    second = skin.body[pairs.seen]
    low, high = groups[0], groups[-1]
    forward = np.isin(first, low) & np.isin(second, high)
    backward = np.isin(first, high) & np.isin(second, low)
    return np.asarray(forward | backward)


def _find_tied(comm: MpiComm, skin: Skin, pairs: Sights, ties: list[tuple[Facets, Facets]]) -> Mask:
    """Say which pairs (k,) of facets are tied to each other. Collective.

    Args:
        comm: the ranks.
        skin: the boundary of all bodies.
        pairs: of facets.
        ties: both sides of each tie.
    """
    tied = np.zeros(len(pairs.looking), dtype=bool)
    for first, second in ties:
        sides = []
        for side in (first, second):
            mine = skin.place[np.isin(skin.local, side.indices)]
            sides.append(np.unique(np.concatenate(from_each(comm, mine))))
        for one, other in (sides, sides[::-1]):
            tied |= np.isin(pairs.looking, one) & np.isin(pairs.seen, other)
    return tied


def _warn_of_lonely(
    comm: MpiComm, lonely: Sequence[int], names: Sequence[str], within: float
) -> None:
    """Warn, on rank 0, of bodies that have no joint with any other."""
    if lonely and comm.rank == 0:
        some = ", ".join(names[number] for number in lonely[:NAMED])
        ending = ", …" if len(lonely) > NAMED else ""
        log.warning(
            "%d of %d bodies touch no other within %g m: %s%s; a gap can be given as within=, and "
            "bodies that share nodes are one",
            len(lonely),
            len(names),
            within,
            some,
            ending,
        )


# Grouping
# --------------------------------------------------------------------------------------------------


def _make_joints(mesh: Mesh, skin: Skin, pairs: Sights, names: Sequence[str]) -> list[Joint]:
    """Return the joints that pairs of facets make, in the order of their bodies and facets."""
    part = group_pairs(skin, pairs)
    body = skin.body[pairs.looking]
    other = skin.body[pairs.seen]
    low = np.minimum(body, other)
    high = np.maximum(body, other)
    # the least facet of the body with the lower number tells the order of joints of two bodies
    lead = np.where(body < other, pairs.looking, pairs.seen)
    order = np.lexsort((lead, high, low))
    parts, first = np.unique(part[order], return_index=True)
    ordered = parts[np.argsort(first, kind="stable")]
    # rows of each joint, in one sorting
    rows = np.argsort(part, kind="stable")
    starts = np.searchsorted(part[rows], ordered, "left")
    ends = np.searchsorted(part[rows], ordered, "right")
    joints = []
    for place, (start, end) in enumerate(zip(starts, ends, strict=True)):
        joints.append(_make_joint(mesh, skin, pairs.pick(rows[start:end]), names, place))
    return joints


def _make_joint(mesh: Mesh, skin: Skin, pairs: Sights, names: Sequence[str], place: int) -> Joint:
    """Return a joint of all these pairs of facets, each both ways.

    Args:
        mesh: the mesh.
        skin: the boundary of all bodies.
        pairs: of facets.
        names: of the bodies.
        place: number of the joint.
    """
    body = skin.body[pairs.looking]
    bodies = np.unique(body)
    sides = [pairs.pick(body == number) for number in bodies]
    facets = [np.unique(side.looking) for side in sides]
    measures = [float(skin.measures[rows].sum()) for rows in facets]
    covered = [
        float(side.overlaps.sum()) / measure for side, measure in zip(sides, measures, strict=True)
    ]
    # side 1 is the one that is covered more; of sides alike that of the smaller facets
    sizes = [measure / len(rows) for measure, rows in zip(measures, facets, strict=True)]
    turned = covered[1] > covered[0] + ALIKE
    if abs(covered[1] - covered[0]) <= ALIKE:
        turned = sizes[1] < sizes[0] * FULL
    if turned:
        bodies, sides, facets, covered = bodies[::-1], sides[::-1], facets[::-1], covered[::-1]
    own = sides[0]
    weights = own.overlaps / own.overlaps.sum()
    normal = weights @ skin.normals[own.looking]
    normal = normal / np.linalg.norm(normal)
    called = (names[bodies[0]], names[bodies[1]])
    return Joint(
        number=place,
        bodies=(int(bodies[0]), int(bodies[1])),
        names=called,
        facets1=_pick_facets(mesh, skin, facets[0], f"{called[0]} beside {called[1]}"),
        facets2=_pick_facets(mesh, skin, facets[1], f"{called[1]} beside {called[0]}"),
        counts=(len(facets[0]), len(facets[1])),
        size=float(own.overlaps.sum()),
        covered=(covered[0], covered[1]),
        gap=float(weights @ own.gaps),
        largest_gap=float(own.gaps.max()),
        normal=normal,
        middle=weights @ own.middles,
        ends=_find_ends(skin, own, normal),
        alike=_are_alike(skin, own, facets),
        rows=(facets[0], facets[1]),
        measures=(skin.measures[facets[0]], skin.measures[facets[1]]),
    )


def _pick_facets(mesh: Mesh, skin: Skin, chosen: Indices, name: str) -> Facets:
    """Return the local facets of those of the skin, as a group."""
    local = skin.local_of[chosen]
    return Facets(name, local[local >= 0].astype(np.int32), mesh)


def _find_ends(skin: Skin, own: Sights, normal: Array) -> Array | None:
    """Return the two ends (2, d) of a joint in the plane, None in space.

    Args:
        skin: the boundary of all bodies.
        own: what its side 1 sees.
        normal: its mean normal.
    """
    if skin.corners.shape[2] == 3:
        return None
    middles = skin.middles[own.looking]
    tangents = skin.tangents[own.looking][:, 0]
    points = middles[:, None] + own.shapes[:, :, :1] * tangents[:, None]
    points = points.reshape(-1, 2)
    along = points @ np.array([-normal[1], normal[0]])
    return points[[int(np.argmin(along)), int(np.argmax(along))]]


def _are_alike(skin: Skin, own: Sights, facets: Sequence[Indices]) -> bool:
    """Say whether each facet of either side sees just one, of its own size.

    Args:
        skin: the boundary of all bodies.
        own: what side 1 sees.
        facets: of both sides.
    """
    if not len(own.looking) == len(facets[0]) == len(facets[1]):
        return False
    least = FULL * np.maximum(skin.measures[own.looking], skin.measures[own.seen])
    return bool(np.all(own.overlaps >= least))
