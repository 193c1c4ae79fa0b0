"""Gather the outer boundary of all bodies of a mesh on every rank.

The bodies are the parts of the mesh that share no node. Their facets come in the order of the
numbers of their nodes, and what is computed from them is computed in this order, so that every rank
has the same and no number of ranks changes it. It takes some 300 bytes a facet in space.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from ...core.algebra import Array, Comm, Indices, Mask
from ...core.corners import FEATURE_ANGLE
from ...meshes.rows import number_alike
from .. import compat
from ..mesh.normals import outward_normals
from ..mesh.numbering import node_numbers, number_bodies
from ..mesh.tagged_mesh import local_count
from .clipping import areas
from .nodes import gather_rows

ROUND_OFF = 64.0 * np.finfo(float).eps  # of the largest coordinate
TOUCH = 1e-6  # of the size of a facet: what is as near as this touches


@dataclass(frozen=True, eq=False)
class Skin:
    """Hold the f facets of the outer boundary of all bodies.

    Attributes:
        nodes: (f, v) numbers of their nodes, anticlockwise as seen from outside.
        corners: (f, v, d) points of these [m].
        middles: (f, d) means of the corners [m].
        normals: (f, d) outward unit normals.
        tangents: (f, d - 1, d) unit vectors in the plane of each facet.
        reach: (f,) largest distance of a corner from the middle [m].
        measures: (f,) lengths [m] or areas [m²].
        body: (f,) their bodies, from 0 in the order of their least node number.
        bodies: how many bodies there are.
        links: (2, k) pairs of facets of one body that share a node and are of one smooth face.
        left_out: (f,) by how much a smooth curved face may be off a facet [m].
        round_off: of coordinates [m].
        local: (m,) this rank's facets among them, ghosts' too, ascending.
        place: (m,) which of the f these are.
        body_of_node: (n,) the body of each geometry node of this rank.
    """

    nodes: Indices
    corners: Array
    middles: Array
    normals: Array
    tangents: Array
    reach: Array
    measures: Array
    body: Indices
    bodies: int
    links: Indices
    left_out: Array
    round_off: float
    local: Indices
    place: Indices
    body_of_node: Indices

    @cached_property
    def local_of(self) -> Indices:
        """Return the local number (f,) of each facet on this rank, -1 where it has none."""
        numbers = np.full(len(self.body), -1)
        numbers[self.place] = self.local
        return numbers

    def tolerances(self, i: Indices, j: Indices) -> Array:
        """Return the distance (k,) [m] up to which facets i and j touch.

        It is a share of the larger facet, with what curved faces leave out.
        """
        size = 2.0 * np.maximum(self.reach[i], self.reach[j])
        return TOUCH * size + self.round_off + self.left_out[i] + self.left_out[j]

    def project(self, i: Indices, points: Array) -> Array:
        """Return points (k, p, d) in the planes of facets i, from their middles, (k, p, d - 1)."""
        away = points - self.middles[i][:, None, :]
        return np.einsum("kpd,ktd->kpt", away, self.tangents[i])


def gather_skin(comm: Comm, mesh: Any) -> Skin:
    """Gather the outer boundary of all bodies of a mesh. Collective.

    Args:
        comm: the ranks of the mesh.
        mesh: a DOLFINx mesh in the plane or in space.
    """
    d = mesh.geometry.dim
    names = node_numbers(mesh)
    body_of_node = _number_bodies(mesh, names)

    # the outer facets of this rank, with what orients them
    outer = compat.entities_where(mesh, d - 1, lambda x: np.ones(x.shape[1], dtype=bool))
    geometry = compat.entities_to_geometry(mesh, d - 1, outer)
    outward = outward_normals(mesh, outer, geometry)
    points = mesh.geometry.x[geometry][:, :, :d]
    body = body_of_node[geometry[:, 0]]
    nodes, points, outward, body = gather_rows(comm, names[geometry], points, outward, body)

    # each facet once, in the order of the numbers of its nodes
    order = np.argsort(nodes, axis=1)
    nodes, first = np.unique(np.take_along_axis(nodes, order, axis=1), axis=0, return_index=True)
    points = np.take_along_axis(points, order[:, :, None], axis=1)[first]
    normals, tangents = _orient(points, outward[first])
    nodes, points = _turn_round(nodes, points, tangents)

    # which facets of this rank are among them, ghosts' too
    every = compat.entities_to_geometry(
        mesh, d - 1, np.arange(local_count(mesh, 1), dtype=np.int32)
    )
    known, own = number_alike(nodes, names[every])
    where = np.full(int(max(known.max(initial=-1), own.max(initial=-1))) + 1, -1)
    where[known] = np.arange(len(known))
    local = np.flatnonzero(where[own] >= 0)

    middles = points.mean(axis=1)
    reach = np.linalg.norm(points - middles[:, None], axis=2).max(axis=1)
    links, turn = _link(nodes, normals)
    return Skin(
        nodes=nodes,
        corners=points,
        middles=middles,
        normals=normals,
        tangents=tangents,
        reach=reach,
        measures=_measure(points, middles, tangents),
        body=body[first],
        bodies=int(body.max(initial=-1)) + 1,
        links=links,
        # a chord 2 r of a circle of radius 2 r / turn is off it by r turn / 4
        left_out=0.25 * reach * turn,
        round_off=float(ROUND_OFF) * float(np.abs(points).max(initial=0.0)),
        local=local,
        place=where[own[local]],
        body_of_node=body_of_node,
    )


def _number_bodies(mesh: Any, names: Indices) -> Indices:
    """Return the body of each local geometry node. Collective."""
    corners = compat.geometry_dofmap(mesh)
    ghosts = names[mesh.geometry.index_map().size_local :]
    return number_bodies(mesh.comm, corners, names, ghosts)


def _orient(points: Array, outward: Array) -> tuple[Array, Array]:
    """Return outward unit normals (f, d) and tangents (f, d - 1, d) of facets.

    Args:
        points: (f, v, d), those of a facet in the order of their numbers [m].
        outward: (f, d) normals, of which the direction alone is taken.
    """
    d = points.shape[2]
    spokes = points - points.mean(axis=1, keepdims=True)
    # a facet extends least along its normal
    normals = np.linalg.svd(spokes)[2][:, -1]
    inward = np.sum(normals * outward, axis=1) < 0.0
    normals = np.where(inward[:, None], -normals, normals)
    if d == 2:
        return normals, np.stack([-normals[:, 1], normals[:, 0]], axis=1)[:, None, :]
    first = spokes[:, 0] - np.sum(spokes[:, 0] * normals, axis=1)[:, None] * normals
    first /= np.linalg.norm(first, axis=1)[:, None]
    return normals, np.stack([first, np.cross(normals, first)], axis=1)


def _turn_round(nodes: Indices, points: Array, tangents: Array) -> tuple[Indices, Array]:
    """Return nodes and points of facets anticlockwise, as seen from outside."""
    away = points - points.mean(axis=1, keepdims=True)
    flat = np.einsum("fvd,ftd->fvt", away, tangents)
    around = flat[:, :, 0]
    if flat.shape[2] == 2:
        around = np.arctan2(flat[:, :, 1], flat[:, :, 0])
    order = np.argsort(around, axis=1)
    return (
        np.take_along_axis(nodes, order, axis=1),
        np.take_along_axis(points, order[:, :, None], axis=1),
    )


def _measure(points: Array, middles: Array, tangents: Array) -> Array:
    """Return lengths or areas (f,) of facets."""
    flat = np.einsum("fvd,ftd->fvt", points - middles[:, None], tangents)
    if flat.shape[2] == 1:
        return np.ptp(flat[:, :, 0], axis=1)
    return areas(flat)


def _link(nodes: Indices, normals: Array) -> tuple[Indices, Array]:
    """Return pairs (2, k) of facets that share a node of a smooth face, and the turns (f,) there.

    Args:
        nodes: (f, v) their nodes.
        normals: (f, d).

    Returns:
        the pairs, and by how much [rad] the normal of each facet turns to such a neighbour, at
        most.
    """
    node = nodes.ravel()
    facet = np.repeat(np.arange(len(nodes)), nodes.shape[1])
    order = np.argsort(node, kind="stable")
    turn = np.zeros(len(nodes))
    links = []
    # all pairs of facets at one node: sorted by nodes they are 1, 2, … places apart
    most = int(np.unique(node, return_counts=True)[1].max(initial=1))
    for apart in range(1, most):
        same: Mask = node[order[:-apart]] == node[order[apart:]]
        first = facet[order[:-apart][same]]
        second = facet[order[apart:][same]]
        cosine = np.sum(normals[first] * normals[second], axis=1)
        angle = 2.0 * np.arcsin(np.minimum(_half_chord(normals[first], normals[second]), 1.0))
        smooth = (angle <= FEATURE_ANGLE * (1.0 + 1e-9)) & (cosine > 0.0)
        np.maximum.at(turn, first[smooth], angle[smooth])
        np.maximum.at(turn, second[smooth], angle[smooth])
        links.append(np.stack([first[smooth], second[smooth]]))
    # below round-off a face is plane
    turn[turn < TOUCH] = 0.0
    return np.concatenate([np.zeros((2, 0), dtype=np.int64), *links], axis=1), turn


def _half_chord(first: Array, second: Array) -> Array:
    """Return half the distance (k,) between unit vectors (k, d): the sine of half their angle."""
    return np.asarray(0.5 * np.linalg.norm(first - second, axis=1))
