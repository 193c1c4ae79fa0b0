"""Split a contact boundary into faces where it turns by more than a feature angle.

Facets round a node are one face there as long as each turns by no more than the angle from another
one of them. A smooth node has one face, a node at an edge two, at a corner in space three. Normal
and weight of a face at a node are those of the facets of this face.

The steps: ``gather_boundary`` brings the facets round nodes where they may turn so far to every
rank; ``Boundary.corner_faces`` numbers the faces round each node; ``split_at_corners`` makes one
row for each face of a node, with the integrals of ``integrate_nodal`` over that face alone.
"""

import logging
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import ufl

from ...core.algebra import Array, Indices, Mask, from_each
from ...core.checks import describe_point, number
from ...core.errors import InputError
from ...core.surfaces import group_same_nodes
from ...meshes.rows import number_alike, number_parts
from .. import compat
from ..body.space import FemSpace
from ..mesh.normals import outward_normals
from ..mesh.numbering import facet_rows, is_curved
from ..mesh.tagged_mesh import Facets
from .nodes import Nodes, gather_rows

log = logging.getLogger(__name__)
LEANING = 0.9  # cosine of the angle (26°) up to which a normal counts as lying in a symmetry plane
MID_POINTS = {  # the vertices around those of a facet of second order, by its number of nodes
    3: [[0, 1]],
    6: [[1, 2], [0, 2], [0, 1]],
    9: [[0, 1], [0, 2], [1, 3], [2, 3], [0, 1, 2, 3]],
}
NAMED = 4  # corners that the log names


@dataclass(frozen=True, eq=False)
class Boundary:
    """Hold facets of a group, the same on every rank in the order of the numbers of their nodes.

    Attributes:
        vertices: (k, v) numbers of their nodes, mid-points too, ascending.
        normals: (k, v, d) outward there, unit ones.
        local: this rank's facets of the group.
        place: their numbers among the k.
    """

    vertices: Indices
    normals: Array
    local: Any
    place: Indices

    def corner_faces(self, angle: float) -> Indices:
        """Return the number (k, v) of the face that each facet is of round each of its nodes.

        Every node is looked at by itself, so that a facet has other numbers at other nodes.

        Args:
            angle: that up to which facets round a node are one face [rad].
        """
        # the things to be joined are corners, pairs of a facet and a node of it; those of one node
        # are joined where their normals are close
        node = self.vertices.ravel()
        normals = self.normals.reshape(-1, self.normals.shape[2])
        order = np.argsort(node, kind="stable")
        links = []
        # all pairs of facets at one node: sorted by nodes they are 1, 2, … places apart
        for apart in range(1, int(np.unique(node, return_counts=True)[1].max(initial=1))):
            same = node[order[:-apart]] == node[order[apart:]]
            first = order[:-apart][same]
            second = order[apart:][same]
            close = _angles(normals[first], normals[second]) <= angle * (1.0 + 1e-9)
            links.append(np.stack([first[close], second[close]]))
        pairs = np.concatenate([np.zeros((2, 0), dtype=np.int64), *links], axis=1)
        return number_parts(len(node), *pairs).reshape(self.vertices.shape)

    def faces(self, angle: float) -> Indices:
        """Return the number (k,) of the face of each facet over the whole boundary.

        Args:
            angle: that up to which facets round a node are one face [rad].
        """
        # a facet, 0 to k - 1, is linked to the faces that it is of at its nodes, from k on
        k, v = self.vertices.shape
        facet = np.repeat(np.arange(k), v)
        part = number_parts(k + k * v, facet, k + self.corner_faces(angle).ravel())
        _, number = np.unique(part[:k], return_inverse=True)
        return number.ravel()


def check_angle(owner: str, value: Any) -> float:
    """Return the feature angle as a float; InputError for what is no angle above 0 and up to pi."""
    angle = number(owner, "feature_angle", value, positive=True, unit="radians")
    if angle > np.pi:
        raise InputError(
            f"{owner}: feature_angle is {value}; give radians: with pi no edge counts as a corner"
        )
    return angle


def gather_boundary(space: FemSpace, facets: Facets, *, beyond: float | None = None) -> Boundary:
    """Gather the facets of a group on every rank. Collective.

    Args:
        space: the body's unknowns.
        facets: the group.
        beyond: an angle [rad]: only facets round nodes where some may turn by more than it from
            others, of a smooth boundary none; all when None.
    """
    mesh = space.mesh
    local = np.asarray(facets.indices)
    geometry = compat.entities_to_geometry(mesh, mesh.topology.dim - 1, local)
    vertices = space.corners_of_facets(local)
    # normals at the nodes of this rank's facets
    plane = outward_normals(mesh, local, geometry)
    normals = np.repeat(plane[:, None], vertices.shape[1], axis=1)
    if is_curved(mesh) and space.dimension > 1:
        normals = _compute_curved_normals(space, local, plane)[:, : vertices.shape[1]]
    if beyond is not None:
        turning = _find_turning(space, vertices, normals, beyond)
        near = np.isin(vertices, turning).any(axis=1)
        local = local[near]
        vertices = vertices[near]
        normals = normals[near]
    # those of all ranks, each once, with the nodes of a facet in the order of their numbers
    rows, normals = gather_rows(space.comm, vertices, normals)
    if not len(rows):
        return Boundary(rows, normals, local, np.zeros(0, dtype=np.int64))
    order = np.argsort(rows, axis=1)
    normals = np.take_along_axis(normals, order[:, :, None], axis=1)
    unique, first = np.unique(np.take_along_axis(rows, order, axis=1), axis=0, return_index=True)
    # where this rank's facets are among them
    known, own = number_alike(unique, vertices)
    order = np.argsort(known)
    return Boundary(unique, normals[first], local, order[np.searchsorted(known[order], own)])


def _find_turning(space: FemSpace, vertices: Indices, normals: Array, angle: float) -> Indices:
    """Return the nodes at which facets may turn by more, the same on every rank. Collective.

    Two unit vectors that turn by less than the angle are less than 2 sin(angle / 2) apart: where
    the box round the normals at a node is smaller, none turns by more. Of nodes that other ranks
    own every rank tells the box of those facets that it holds.

    Args:
        space: the body's unknowns.
        vertices: (k, v) numbers of the nodes of this rank's facets.
        normals: (k, v, d) outward there.
        angle: [rad].
    """
    every = normals.reshape(-1, normals.shape[2])
    numbers, low, high = _bound_rows(vertices.ravel(), every, every)
    away = ~np.isin(numbers, space.nodes)
    other_numbers, other_low, other_high = gather_rows(
        space.comm, numbers[away], low[away], high[away]
    )
    numbers, low, high = _bound_rows(
        np.concatenate([numbers, other_numbers]),
        np.concatenate([low, other_low]),
        np.concatenate([high, other_high]),
    )
    wide = np.linalg.norm(high - low, axis=1) > 2.0 * np.sin(0.5 * angle)
    return np.unique(np.concatenate(from_each(space.comm, numbers[wide])))


def _bound_rows(nodes: Indices, low: Array, high: Array) -> tuple[Indices, Array, Array]:
    """Return each node once, and the box round its rows: the least and the largest values (k, d).

    Args:
        nodes: (n,) the node of each row.
        low: (n, d) values, of which the least are sought.
        high: (n, d) values, of which the largest are sought.
    """
    if not len(nodes):
        return nodes, low, high
    order = np.argsort(nodes, kind="stable")
    numbers, starts = np.unique(nodes[order], return_index=True)
    return (
        numbers,
        np.minimum.reduceat(low[order], starts),
        np.maximum.reduceat(high[order], starts),
    )


def _compute_curved_normals(space: FemSpace, facets: Any, plane: Array) -> Array:
    """Return outward unit normals (k, n, d) at the nodes of curved facets.

    At a vertex it is at right angles to the tangents of its edges, at mid-points the mean of those
    of the vertices around.

    Args:
        space: the body's unknowns.
        facets: (k,) local numbers.
        plane: (k, d) outward normals of the planes of their vertices.
    """
    nodes = compat.dof_to_node(space.V)[facet_rows(space.V, facets)]
    x = space.mesh.geometry.x[nodes][:, :, : space.dimension]
    around = MID_POINTS[x.shape[1]]
    corners = x.shape[1] - len(around)
    normals = np.empty_like(x)
    for p in range(corners):
        # of each edge p-q with the mid-point m, the tangent at p is 4 x_m - 3 x_p - x_q
        tangents = []
        for i, ends in enumerate(around):
            if len(ends) == 2 and p in ends:
                m = corners + i
                q = sum(ends) - p
                tangents.append(4.0 * x[:, m] - 3.0 * x[:, p] - x[:, q])
        along = np.stack(tangents, axis=1)
        normal = np.linalg.svd(along)[2][:, -1]
        normals[:, p] = np.where(np.sum(normal * plane, axis=1)[:, None] < 0.0, -normal, normal)
    for i, vertices in enumerate(around):
        normals[:, corners + i] = normals[:, vertices].mean(axis=1)
    return np.asarray(normals / np.linalg.norm(normals, axis=2)[:, :, None])


def _angles(first: Array, second: Array) -> Array:
    """Return the angles (k,) between unit vectors (k, d) [rad], exact for small ones too."""
    return np.asarray(
        2.0
        * np.arctan2(np.linalg.norm(first - second, axis=1), np.linalg.norm(first + second, axis=1))
    )


def integrate_nodal(space: FemSpace, indices: Any) -> Array:
    """Integrate phi_i and phi_i n over facets, (owned nodes, 1 + d) [m], [m²]. Collective.

    In a hierarchy phi_i are those of the vertices, of first order, and mid-points have zeros.

    Args:
        space: the body's unknowns.
        indices: local facets.
    """
    mesh = space.mesh
    d = space.dimension
    ds = compat.measure(mesh, mesh.topology.dim - 1, indices)
    V: Any = space.V
    blocks: Any = slice(None)
    if space.hierarchy is not None:
        V, blocks = space.hierarchy.vertices

    # of a vector-valued test function with the shape functions as components: ∫ phi_i is in each of
    # them, ∫ phi_i n_c in the c-th one
    v = ufl.TestFunction(V)
    weight_form = compat.compile_form(sum(v[c] for c in range(d)) * ds)
    weights = compat.assemble_vector(weight_form).array_r.reshape(-1, d)
    normal_form = compat.compile_form(ufl.inner(ufl.FacetNormal(mesh), v) * ds)
    normals = compat.assemble_vector(normal_form).array_r.reshape(-1, d)
    nodal = np.zeros((len(space.nodes), 1 + d))
    nodal[blocks] = np.column_stack([weights[:, 0], normals])
    return nodal


def split_at_corners(
    space: FemSpace, around: Boundary, nodes: Nodes, angle: float
) -> tuple[Nodes, Indices]:
    """Split nodes at corners into one for each face, with its normal and weight. Collective.

    Args:
        space: the body's unknowns.
        around: the facets round its corners.
        nodes: those of this rank or of all; the order is kept.
        angle: that up to which facets round a node are one face [rad].

    Returns:
        nodes, those of one node in a row, and (nodes,) a facet of the face of each, -1 for nodes
        with one face.
    """
    if not len(around.vertices):
        return nodes, np.full(len(nodes.numbers), -1)
    corners = nodes.numbers[np.isin(nodes.numbers, around.vertices)]
    labels = around.corner_faces(angle)
    known = np.isin(around.vertices, np.concatenate(from_each(space.comm, corners)))
    if not known.any():
        return nodes, np.full(len(nodes.numbers), -1)
    # pairs of a node and a face, of nodes with several faces
    pairs = np.unique(np.column_stack([around.vertices[known], labels[known]]), axis=0)
    numbers, counts = np.unique(pairs[:, 0], return_counts=True)
    pairs = pairs[np.isin(pairs[:, 0], numbers[counts > 1])]
    if not len(pairs):
        return nodes, np.full(len(nodes.numbers), -1)
    starts, ends = (np.searchsorted(pairs[:, 0], nodes.numbers, side) for side in ("left", "right"))
    # each of these nodes as often as it has faces, the others once
    times = np.maximum(ends - starts, 1)
    repeated = nodes.pick(np.repeat(np.arange(len(times)), times))
    among = np.arange(times.sum()) - np.repeat(np.cumsum(times) - times, times)
    pair = np.where(np.repeat(ends > starts, times), np.repeat(starts, times) + among, -1)
    # normals and weights of these from their faces
    double = pair >= 0
    values = _integrate_faces(space, around, labels, pairs)[pair]
    unit = values[:, 1:] / np.linalg.norm(values[:, 1:], axis=1)[:, None]
    normals = np.where(double[:, None], in_symmetry_planes(unit, repeated.held), repeated.normals)
    _, corner = np.unique(labels, return_index=True)
    facet = corner // labels.shape[1]
    split_nodes = replace(
        repeated, normals=normals, weights=np.where(double, values[:, 0], repeated.weights)
    )
    return split_nodes, np.where(double, facet[pairs[pair, 1]], -1)


def _integrate_faces(space: FemSpace, around: Boundary, labels: Indices, pairs: Indices) -> Array:
    """Return ``integrate_nodal`` (pairs, 1 + d) at nodes over one of their faces. Collective.

    An integral over each face by itself would be one assembly for each of many. Facets are sorted
    into few classes instead, in which those at one node are all of one face, and each class is
    integrated.

    Args:
        space: the body's unknowns.
        around: the facets round its corners.
        labels: (k, v) the face of each facet at each of its nodes.
        pairs: (p, 2) node and face.
    """
    corners = np.unique(pairs[:, 0])
    classes = _classify(around.vertices, labels, corners)
    row_of = np.full(int(labels.max()) + 1, -1)
    row_of[pairs[:, 1]] = np.arange(len(pairs))
    total = np.zeros((len(pairs), 1 + space.dimension))
    for chosen in range(int(classes.max()) + 1):
        local = np.asarray(around.local)[classes[around.place] == chosen]
        values = space.at_nodes(corners, integrate_nodal(space, local))
        inside = classes == chosen
        rows = np.unique(row_of[labels[inside]])
        rows = rows[rows >= 0]
        total[rows] += values[np.searchsorted(corners, pairs[rows, 0])]
    return total


def _classify(vertices: Indices, labels: Indices, corners: Indices) -> Indices:
    """Return the class (k,) of every facet at a corner, -1 for others.

    Facets of different faces at a node differ in class: facets are coloured one after the other,
    each with the first class that no facet of another face at its nodes has.

    Args:
        vertices: (k, v) numbers of the nodes of facets.
        labels: (k, v) the face of each facet at each of them.
        corners: numbers of the nodes at corners.
    """
    classes = np.full(len(vertices), -1, dtype=np.int64)
    at_corner = np.isin(vertices, corners)
    # node -> facets there that have a class, and their faces
    around: dict[int, list[tuple[int, int]]] = {int(node): [] for node in corners}
    for facet in np.flatnonzero(at_corner.any(axis=1)):
        own = [
            (int(vertices[facet, i]), int(labels[facet, i]))
            for i in np.flatnonzero(at_corner[facet])
        ]
        taken = set()
        for node, label in own:
            taken |= {int(classes[other]) for other, face in around[node] if face != label}
        classes[facet] = next(c for c in range(len(taken) + 1) if c not in taken)
        for node, label in own:
            around[node].append((int(facet), label))
    return classes


def in_symmetry_planes(normals: Array, held: Mask) -> Array:
    """Return normals (k, d) without the prescribed components, where that turns them by little.

    On a symmetry plane the true normal lies in the plane; that of the facets on one side of it
    leans to that side.

    Args:
        normals: (k, d) unit vectors.
        held: (k, d) which components of the nodes are prescribed.
    """
    inside = np.where(held, 0.0, normals)
    length = np.linalg.norm(inside, axis=1)[:, None]
    return np.asarray(np.where(length > LEANING, inside / np.maximum(length, LEANING), normals))


def tell_corners(space: FemSpace, name: str, nodes: Nodes, slots: Indices, angle: float) -> None:
    """Log, on rank 0, how many nodes have several conditions, and where. Collective.

    Args:
        space: the body's unknowns.
        name: that of the boundary.
        nodes: this rank's, one for each condition.
        slots: their numbers among those of all ranks.
        angle: the feature angle [rad].
    """
    # the first row of each node with several, where it turns and where it faces several partners
    turning: list[int] = []
    shared: list[int] = []
    for rows in group_same_nodes(nodes.numbers):
        is_flat = np.array_equal(nodes.normals[rows], nodes.normals[rows[:1]].repeat(len(rows), 0))
        (shared if is_flat else turning).append(int(rows[0]))
    turns = f"turns by more than {np.degrees(angle):.4g} degrees"
    for what, first, each in (
        (turns, turning, "face"),
        ("faces several bodies", shared, "of them"),
    ):
        own = np.array(first, dtype=np.int64)
        numbers, points = gather_rows(space.comm, slots[own], nodes.points[own])
        if space.comm.rank == 0 and len(numbers):
            some = points[np.argsort(numbers)[:NAMED]]
            places = ", ".join(describe_point(point) for point in some)
            if len(numbers) > NAMED:
                places += ", …"
            log.info(
                "'%s' %s at %d contact nodes, which have one condition for every %s: %s",
                name,
                what,
                len(numbers),
                each,
                places,
            )
