"""Average bubbles of edges in contact conditions at vertices, for tetrahedra of second order.

With the hats phi_i of vertices and the bubbles b_k = 4 phi_a phi_b of the edges of contact facets,
displacements are sum phi_i v_i + sum b_k e_k (``body.hierarchical``). The gap of a condition is the
mean of the gap with the weight psi_i,

    gap_i = gap0_i - n·(v_i + sum_k c_ik e_k)
    c_ik = ∫ psi_i b_k / ∫ psi_i,   ∫ psi_i phi_j = delta_ij ∫ phi_i

on every facet, so that psi_i is a combination of its three hats and no gap asks for the v of
another vertex (dual Lagrange multipliers: Wohlmuth, SIAM J. Numer. Anal. 38 (2000), 989-1012; of
first order on facets of second: Puso, Laursen and Solberg, Comput. Methods Appl. Mech. Eng. 197
(2008), 555-566). The weights ∫ psi_i = ∫ phi_i are positive, those of first order; a uniform
pressure p gives r_i = p ∫ phi_i. On a flat facet of area A the integral of psi_i b_k is A / 5 for
its edges at vertex i and -A / 15 for the other one; on curved ones it is a quadrature on the
facet.
"""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, Indices, from_each
from ...core.checks import describe_point, refuse
from .. import compat
from ..body.hierarchical import Hierarchy
from ..body.space import FemSpace
from ..mesh.normals import outward_normals
from ..mesh.numbering import facet_rows
from ..mesh.tagged_mesh import Facets
from .conditions import Facing
from .nodes import Nodes, Rows

POINTS = 5  # of a rule in every direction: exact for degree 8 on flat facets
# both ends of edge k, in DOLFINx's order: edge k lies opposite vertex k
OTHERS = np.array([[1, 2], [0, 2], [0, 1]])


@dataclass(frozen=True, eq=False)
class Bubbles(Rows):
    """Hold k facets of second order, and the bubbles of their edges.

    Attributes:
        vertices: (k, 3) numbers of their vertices.
        middles: (k, 3) numbers of the mid-points of the edges opposite these.
        unknowns: (k, 3, d) unknowns e of these among those of all ranks, -1 where held.
        normals: (k, d) outward unit normals.
        areas: (k, 3) ∫ phi_i of the vertices [m²].
        integrals: (k, 3, 3) ∫ psi_i b_k of vertices and edges [m²].
    """

    vertices: Indices
    middles: Indices
    unknowns: Indices
    normals: Array
    areas: Array
    integrals: Array


def _gather_bubbles(
    space: FemSpace, hierarchy: Hierarchy, facets: Facets, everywhere: bool
) -> Bubbles:
    """Return the facets of a group that have a vertex of this rank, or all of them. Collective.

    Args:
        space: the body's unknowns.
        hierarchy: that of its tetrahedra.
        facets: the group.
        everywhere: whether all facets are asked for, on every rank.

    Raises:
        InputError: on all ranks, a mid-point that is held while an end of its edge is free.
    """
    # facets whose cell this rank owns, so that each is of one rank
    mesh = space.mesh
    local = np.asarray(facets.indices)
    rows = facet_rows(space.V, local)
    cell_of = mesh.topology.connectivity(mesh.topology.dim - 1, mesh.topology.dim)
    cells = cell_of.array[cell_of.offsets[:-1][local]]
    owned = cells < mesh.topology.index_map(mesh.topology.dim).size_local
    local = local[owned]
    rows = rows[owned]
    # a bubble is free where its mid-point is; it has to be held where both ends of its edge are
    numbers = hierarchy.with_ghosts(space.numbers)
    points = hierarchy.with_ghosts(space.points)
    unknowns = numbers.astype(np.int64)[rows]
    wrong = (unknowns[:, 3:] < 0) & (unknowns[:, OTHERS] >= 0).any(axis=2)
    where = points[rows[:, 3:][wrong.any(axis=2)]][:1]
    refuse(
        [
            f"the mid-point {describe_point(point)} on '{facets.name}' is prescribed and the ends "
            "of its edge are not: prescribe all nodes of an edge, or none"
            for point in where
        ],
        space.comm,
    )
    # what is to be known of them
    geometry = compat.entities_to_geometry(mesh, mesh.topology.dim - 1, local)
    nodes = space.node_of_block[rows]
    normals = outward_normals(mesh, local, geometry)
    areas, integrals = _integrate(points[rows])
    own = Bubbles(nodes[:, :3], nodes[:, 3:], unknowns[:, 3:], normals, areas, integrals)
    # facets with a vertex that another rank owns go to all ranks; tied ones count at their leaders
    corners = np.hstack([own.vertices, space.leaders(own.vertices.ravel()).reshape(-1, 3)])
    away = everywhere | ~np.isin(corners, space.nodes).all(axis=1)
    parts = from_each(space.comm, own.pick(away))
    if not everywhere:
        parts[space.comm.rank] = own
    return Bubbles.join(parts)


def _integrate(x: Array) -> tuple[Array, Array]:
    """Return ∫ phi_i (k, 3) and ∫ psi_i b_k (k, 3, 3) of facets [m²].

    Args:
        x: (k, 6, 3) points of their vertices and mid-points [m].
    """
    place, weight = np.polynomial.legendre.leggauss(POINTS)
    # Gauss points of a square, of which one side is drawn together: (s, (1 - s) t) of a triangle
    line = 0.5 + 0.5 * place
    s, t = (axis.ravel() for axis in np.meshgrid(line, line, indexing="ij"))
    weights = 0.25 * np.outer(weight, weight).ravel() * (1.0 - s)
    hats = np.stack([1.0 - s - (1.0 - s) * t, s, (1.0 - s) * t])
    slopes = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    # b_k = 4 phi_a phi_b, and its slopes 4 (phi_a grad phi_b + phi_b grad phi_a)
    bubbles = 4.0 * hats[OTHERS].prod(axis=1)
    bent = np.einsum("kaq,kag->kgq", 4.0 * hats[OTHERS], slopes[OTHERS[:, ::-1]])
    # x = sum phi_i x_i + sum b_k e_k, and its slopes: their cross product is the area
    straight = x[:, :3]
    e = x[:, 3:] - straight[:, OTHERS].mean(axis=2)
    along = np.einsum("fix,ig->fxg", straight, slopes)[..., None]
    along = along + np.einsum("fkx,kgq->fxgq", e, bent)
    sizes = weights * np.linalg.norm(np.cross(along[:, :, 0], along[:, :, 1], axis=1), axis=1)
    areas = sizes @ hats.T
    # psi = A phi with A = diag(∫ phi) (∫ phi phiᵀ)⁻¹, so that ∫ psi b = A ∫ phi b
    gram = np.einsum("fq,iq,jq->fij", sizes, hats, hats)
    products = np.einsum("fq,iq,jq->fij", sizes, hats, bubbles)
    return areas, areas[:, :, None] * np.linalg.solve(gram, products)


def average_bubbles(
    space: FemSpace, facets: Facets, nodes: Nodes, share: sp.csr_matrix | None = None
) -> tuple[Facing, ...]:
    """Return the bubbles in the gaps of conditions, as what the conditions face. Collective.

    A displacement of a condition is relative to what it faces, u_i - sum_k P_ik e_k. Of bubbles on
    the own side P = -c, so that it is u_i + sum_k c_ik e_k; of those on a side 2 that the
    conditions face by shares S of its nodes, P = S c. Where a node has several conditions each
    facet belongs to the one with the normal nearest to its own.

    Args:
        space: the body's unknowns.
        facets: those of the contact.
        nodes: this rank's with conditions, or those of side 2, the same on every rank.
        share: (conditions, nodes) S of side 2, None for nodes with conditions.

    Returns:
        one ``Facing``, none but in a hierarchy.

    Raises:
        InputError: on all ranks, a mid-point that is held while an end of its edge is free.
    """
    if space.hierarchy is None:
        return ()
    facet = _gather_bubbles(space, space.hierarchy, facets, share is not None)
    # the rows of ``nodes`` at each corner of a facet: from ``starts`` to ``ends`` in their order; a
    # node that follows another, and has no row, counts at its leader
    order = np.argsort(nodes.numbers, kind="stable")
    corner = facet.vertices.ravel()
    corner = np.where(np.isin(corner, nodes.numbers), corner, space.leaders(corner))
    starts, ends = (
        np.searchsorted(nodes.numbers, corner, side, sorter=order) for side in ("left", "right")
    )
    known = np.flatnonzero(ends > starts)
    # of several, the one with the normal nearest to that of the facet
    best = np.full(len(known), -np.inf)
    row = np.zeros(len(known), dtype=np.int64)
    for k in range(int((ends - starts).max(initial=0))):
        candidate = order[np.minimum(starts[known] + k, ends[known] - 1)]
        cosine = np.sum(facet.normals[known // 3] * nodes.normals[candidate], axis=1)
        row = np.where(cosine > best, candidate, row)
        best = np.maximum(cosine, best)
    # c_ik = ∫ psi_i b_k / ∫ psi_i, summed over the facets of each
    numbers, first, column = np.unique(facet.middles, return_index=True, return_inverse=True)
    sums = np.bincount(row, facet.areas.ravel()[known], minlength=len(nodes.numbers))
    places = np.repeat(row, 3), column.reshape(-1, 3)[known // 3].ravel()
    values = facet.integrals.reshape(-1, 3)[known] / sums[row][:, None]
    # what is faced are bubbles: of nodes there are numbers and unknowns alone
    unknowns = facet.unknowns.reshape(-1, space.dimension)[first]
    nothing = np.zeros(unknowns.shape)
    middles = Nodes(numbers, nothing, nothing, nothing[:, 0], unknowns < 0, unknowns)
    c = sp.csr_matrix((values.ravel(), places), shape=(len(nodes.numbers), len(numbers)))
    return (Facing(middles, -c if share is None else sp.csr_matrix(share @ c)),)
