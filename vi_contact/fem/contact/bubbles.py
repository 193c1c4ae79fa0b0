"""Average bubbles of edges to contact conditions at vertices.

These are dual conditions of tetrahedra of second order.

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
from ...core.checks import at, refuse
from .. import compat
from ..body.hierarchical import Hierarchy
from ..body.space import FemSpace
from ..mesh.numbering import facet_rows
from ..mesh.tagged_mesh import Facets
from .faces import outward
from .frames import Facing
from .nodes import Nodes, Rows

POINTS = 5  # of a rule in every direction: exact for degree 8 on flat facets
# vertices of the edge opposite each vertex, in DOLFINx's order of edges
OTHERS = np.array([[1, 2], [0, 2], [0, 1]])


@dataclass(frozen=True, eq=False)
class Bubbles(Rows):
    """Hold facets of second order, and their bubbles.

    These are numbers (k, 3) of their vertices and of the mid-points opposite, and of these the
    unknowns (k, 3, d) of all ranks; outward normals (k, d), ∫ phi_i (k, 3), ∫ psi_i b_k (k, 3, 3).
    """

    vertices: Indices
    middles: Indices
    unknowns: Indices
    normals: Array
    areas: Array
    integrals: Array


def _bubbles(space: FemSpace, hierarchy: Hierarchy, facets: Facets, everywhere: bool) -> Bubbles:
    """Return the facets of a group that have a vertex of this rank, or all of them."""
    mesh = space.mesh
    local = np.asarray(facets.indices)
    rows = facet_rows(space.V, local)
    cell_of = mesh.topology.connectivity(mesh.topology.dim - 1, mesh.topology.dim)
    owner = (
        cell_of.array[cell_of.offsets[:-1][local]]
        < mesh.topology.index_map(mesh.topology.dim).size_local
    )
    local = local[owner]
    rows = rows[owner]
    numbers, points = (hierarchy.with_ghosts(one) for one in (space.numbers, space.points))
    unknowns = numbers.astype(np.int64)[rows]
    wrong = (unknowns[:, 3:] < 0) & (unknowns[:, OTHERS] >= 0).any(axis=2)
    where = points[rows[:, 3:][wrong.any(axis=2)]][:1]
    refuse(
        [
            f"the mid-point {at(one)} on '{facets.name}' is prescribed and the ends of its edge "
            "are not: prescribe all nodes of an edge, or none"
            for one in where
        ],
        space.comm,
    )
    geometry = compat.entities_to_geometry(mesh, mesh.topology.dim - 1, local)
    nodes = space.node_of_block[rows]
    normals = outward(mesh, local, geometry)
    found = Bubbles(nodes[:, :3], nodes[:, 3:], unknowns[:, 3:], normals, *_integrals(points[rows]))
    # tied ones count there
    corners = np.hstack([found.vertices, space.leaders(found.vertices.ravel()).reshape(-1, 3)])
    away = everywhere | ~np.isin(corners, space.nodes).all(axis=1)
    parts = from_each(space.comm, found.pick(away))
    if not everywhere:
        parts[space.comm.rank] = found
    return Bubbles(
        *(
            np.concatenate([getattr(part, name) for part in parts])
            for name in Bubbles.__annotations__
        )
    )


def _integrals(x: Array) -> tuple[Array, Array]:
    """Return (∫ phi_i (k, 3), ∫ psi_i b_k (k, 3, 3)) of facets with these points.

    These are the points of vertices and mid-points (k, 6, 3).
    """
    place, weight = np.polynomial.legendre.leggauss(POINTS)
    s, t = (one.ravel() for one in np.meshgrid(0.5 + 0.5 * place, 0.5 + 0.5 * place, indexing="ij"))
    # of a triangle: its point (s, (1 - s) t)
    weights = 0.25 * np.outer(weight, weight).ravel() * (1.0 - s)
    hats = np.stack([1.0 - s - (1.0 - s) * t, s, (1.0 - s) * t])
    slopes = np.array([[-1.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    bubbles = 4.0 * hats[OTHERS].prod(axis=1)
    # slopes of bubbles
    bent = np.einsum("kaq,kag->kgq", 4.0 * hats[OTHERS], slopes[OTHERS[:, ::-1]])
    straight = x[:, :3]
    e = x[:, 3:] - straight[:, OTHERS].mean(axis=2)
    along = np.einsum("fix,ig->fxg", straight, slopes)[..., None] + np.einsum(
        "fkx,kgq->fxgq", e, bent
    )
    sizes = weights * np.linalg.norm(np.cross(along[:, :, 0], along[:, :, 1], axis=1), axis=1)
    areas = sizes @ hats.T
    gram, products = (np.einsum("fq,iq,jq->fij", sizes, hats, one) for one in (hats, bubbles))
    return areas, areas[:, :, None] * np.linalg.solve(gram, products)


def averaged(
    space: FemSpace, facets: Facets, nodes: Nodes, share: sp.csr_matrix | None = None
) -> tuple[Facing, ...]:
    """Return the bubbles that displacements of conditions contain, none but in a hierarchy.

    They are -c_ik of this rank's nodes with conditions or, where these face ``nodes``, the same on
    every rank, with ``share``, share times c_ik.

    Where a node has several conditions each facet belongs to the one with the normal nearest to its
    own. Collective. InputError for a mid-point that is held while an end of its edge is free.
    """
    if space.hierarchy is None:
        return ()
    found = _bubbles(space, space.hierarchy, facets, share is not None)
    order = np.argsort(nodes.numbers, kind="stable")
    corner = found.vertices.ravel()
    corner = np.where(np.isin(corner, nodes.numbers), corner, space.leaders(corner))
    starts, ends = (
        np.searchsorted(nodes.numbers, corner, side, sorter=order) for side in ("left", "right")
    )
    known = np.flatnonzero(ends > starts)
    best = np.full(len(known), -np.inf)
    row = np.zeros(len(known), dtype=np.int64)
    for k in range(int((ends - starts).max(initial=0))):
        candidate = order[np.minimum(starts[known] + k, ends[known] - 1)]
        cosine = np.sum(found.normals[known // 3] * nodes.normals[candidate], axis=1)
        row = np.where(cosine > best, candidate, row)
        best = np.maximum(cosine, best)
    numbers, first, column = np.unique(found.middles, return_index=True, return_inverse=True)
    sums = np.bincount(row, found.areas.ravel()[known], minlength=len(nodes.numbers))
    places = np.repeat(row, 3), column.reshape(-1, 3)[known // 3].ravel()
    values = found.integrals.reshape(-1, 3)[known] / sums[row][:, None]
    unknowns = found.unknowns.reshape(-1, space.dimension)[first]
    nothing = np.zeros(unknowns.shape)
    middles = Nodes(numbers, nothing, nothing, nothing[:, 0], unknowns < 0, unknowns)
    c = sp.csr_matrix((values.ravel(), places), shape=(len(nodes.numbers), len(numbers)))
    return (Facing(middles, -c if share is None else sp.csr_matrix(share @ c)),)
