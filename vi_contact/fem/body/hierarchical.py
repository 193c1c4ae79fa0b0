"""Give tetrahedra of second order unknowns of a hierarchy, with contact and mass at vertices.

    u_m = e_m + (v_a + v_b) / 2   at the mid-point m of every edge a-b

v are displacements of vertices, e what edges bend beside them: a field is that of first order plus
one bubble an edge. Rigid translations have e = 0, so that row sums of a mass matrix in these
unknowns are those of first order, positive, where nodal ones of vertices are negative (tetrahedra)
or zero (triangles). Rotations have e = 0 too where edges are straight. The nodal unknowns are u = H
û with H = 1 + N, where N has ½ in the rows of mid-points at both ends of their edges. N N = 0, so
that H⁻¹ = 1 - N = 2 - H.
"""

from typing import Any

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc

from ...core.algebra import Array, Mask, Matrix
from .. import compat
from ..matrices.petsc_algebra import PetscAlgebra, PetscMatrix, as_petsc
from ..mesh.numbering import supports

TETRAHEDRON = 10  # nodes of one of degree 2


def needs_hierarchy(V: Any) -> bool:
    """Say whether vertices have no weight of their own in a pressure on facets: P2 tetrahedra."""
    return V.mesh.topology.dim == 3 and len(supports(V)) == TETRAHEDRON


class Hierarchy:
    """Hold the edges of a space of P2 fields and the change of its unknowns.

    All it does is collective.

    Attributes:
        vertices: the P1 space, and the owned blocks of ``V`` that its own are.
        H, back: H and H⁻¹ = 2 - H, of the free unknowns.
    """

    def __init__(self, space: Any) -> None:
        """Find the edges and make H.

        Args:
            space: the FemSpace of a body of P2 tetrahedra.
        """
        V = space.V
        self._space = space

        # blocks of the mid-points of edges (k,), and of the ends (k, 2) of their edges, each taken
        # from one of the cells that have it
        blocks = compat.cell_blocks(V)
        around = supports(V)
        places = [place for place, vertices in enumerate(around) if len(vertices) == 2]
        self._mids, first_at = np.unique(blocks[:, places], return_index=True)
        cell, place = np.divmod(first_at, len(places))
        self._ends = blocks[cell[:, None], np.array([around[p] for p in places])[place]]

        # blocks of the vertices in both spaces, which may number them differently
        first = compat.vector_space(V.mesh)
        rows = np.empty(int(compat.cell_blocks(first).max(initial=-1)) + 1, dtype=np.int64)
        rows[compat.cell_blocks(first)] = blocks[:, : len(compat.sub_entities(V.mesh, 0))]
        self.vertices = first, rows[: first.dofmap.index_map.size_local]
        self.H = self._make_change(0.5)
        self.back = self._make_change(-0.5)

    def with_ghosts(self, values: Any) -> Array:
        """Return owned nodal values (k, c), c <= d, followed by those of the ghosts."""
        function = compat.function(self._space.V)
        rows = function.x.array.reshape(-1, self._space.dimension)[:, : values.shape[1]]
        rows[: len(values)] = values
        function.x.scatter_forward()
        return rows.copy()

    def split_bubbles(self, nodal: Array) -> Array:
        """Return û of owned nodal displacements (k, d): e in the place of those of mid-points."""
        every = self.with_ghosts(nodal)
        every[self._mids] -= every[self._ends].mean(axis=1)
        return every[: len(nodal)]

    def between(self, nodal: Array, chosen: Mask, mean: Any) -> Array:
        """Return owned nodal values (k, c), at chosen mid-points a mean of the ends of their edges.

        Args:
            nodal: (k, c) owned nodal values.
            chosen: (k,) mask of nodes; mid-points among them get the mean.
            mean: how the ends of an edge make the value of its mid-point, such as ``np.mean``.
        """
        every = self.with_ghosts(nodal)
        edges = self.with_ghosts(chosen[:, None])[self._mids, 0] > 0.0
        every[self._mids[edges]] = mean(every[self._ends[edges]], axis=1)
        return every[: len(nodal)]

    def around(self, turn: Matrix | None, dual: Matrix | None) -> tuple[Matrix, Matrix]:
        """Return T and T⁻ᵀ of u = T û with û in the frames of nodes too.

        Args:
            turn: Q of û = Q ů, ů along the vectors of the frames; None where it is the identity.
            dual: Q⁻ᵀ.

        Returns:
            H Q and H⁻ᵀ Q⁻ᵀ.
        """
        H_dual = PetscMatrix(self.back.mat.transpose(PETSc.Mat()))
        return _multiply(self.H, turn), _multiply(H_dual, dual)

    def _make_change(self, share: float) -> PetscMatrix:
        """Return the identity and, in rows of mid-points, ``share`` at the ends of their edges."""
        space = self._space
        algebra = PetscAlgebra(self._space.comm.mpi)
        n = len(space.ids)
        d = space.dimension

        # of each owned mid-point and component the columns of itself and of both ends, -1 where a
        # component is not free
        owned = self._mids < len(space.nodes)
        own = space.free_index.reshape(-1, d)[self._mids[owned]]
        ends = self.with_ghosts(space.numbers).astype(np.int64)[self._ends[owned]]
        columns = np.concatenate(
            [np.where(own >= 0, own + algebra.first(n), -1)[:, None], ends], axis=1
        )
        values = np.broadcast_to(np.array([1.0, share, share])[:, None], columns.shape)

        # a row for each free component of a mid-point
        free = own >= 0
        row = np.broadcast_to((np.cumsum(free).reshape(free.shape) - 1)[:, None], columns.shape)
        used = (columns >= 0) & free[:, None]
        entries = sp.csr_matrix(
            (values[used], (row[used], columns[used])), shape=(free.sum(), space.unknowns)
        )
        return as_petsc(algebra.replace_identity_rows(n, own[free], entries))


def _multiply(A: PetscMatrix, B: Matrix | None) -> Matrix:
    """Return A B, or A where B is None, the identity. Collective.

    The product that PETSc makes holds both factors for as long as it lives; hence a copy is
    returned.
    """
    if B is None:
        return A
    return PetscMatrix(A.mat.matMult(as_petsc(B).mat).duplicate(copy=True))
