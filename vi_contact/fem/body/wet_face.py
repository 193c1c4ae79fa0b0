"""Find the nodes of a wet face, and the volumes that its motion pushes into the water (plane).

S holds the forces of nodal pressures, ∫ psi_j n N_i, with n out of the body and so into the water:
Sᵀ u are the volumes that displacements u push into the shares of the nodes.
"""

from typing import Any

import numpy as np
import scipy.sparse as sp
import ufl

from ...core.algebra import Array
from ...core.errors import InputError
from .. import compat
from ..matrices.petsc_rows import aij_of, rows_of
from ..mesh.tagged_mesh import Facets
from .space import FemSpace

ALIKE = 1e-9  # of the depth: nodes of one height


class WetFace:
    """Hold a face in the plane that goes up all the way, the same on every rank.

    Attributes:
        nodes: number k of nodes of the face, from the bottom up.
        points: (k, 2) [m].
        below: (b,) which of them lie below the level.
        x: of these, and of the point at the level (b + 1,) [m].
        y: their heights (b + 1,) [m].
        side: 1 where the water lies towards x > 0, else -1.
        touched: (m,) rows of all components that S has.
        S: (m, k) forces of nodal pressures on them [m²].
        own: (owned components, k) those of this rank.
        first: the row of the first of these.
    """

    def __init__(self, space: FemSpace, face: Facets, level: float, thickness: float) -> None:
        """Find it. Collective.

        Args:
            space: the body's unknowns.
            face: its wet face.
            level: of the water [m].
            thickness: of the section [m].

        Raises:
            InputError: two nodes at one height.
        """
        # S [m²] on all components of a pressure of one at each node
        g = ufl.TrialFunction(space.V)
        v = ufl.TestFunction(space.V)
        n = ufl.FacetNormal(space.mesh)
        measure = compat.measure(space.mesh, space.mesh.topology.dim - 1, face.indices)
        form = thickness * ufl.inner(g[0] * n, v) * measure
        mat = compat.assemble_matrix(space.compile_form(form))
        own = rows_of(mat)
        entries = own.tocoo()
        self.first = mat.getOwnershipRange()[0]
        size = mat.getSize()[1]
        self._columns = mat.getLocalSize()[1]
        mat.destroy()

        # All ranks know the face: its nodes from the floor up, and S.
        blocks = space.facet_blocks(face.indices)
        numbers = self.first + space.dimension * blocks
        mine = (
            numbers,
            space.points[blocks],
            entries.row + self.first,
            entries.col,
            entries.data,
        )
        parts = space.comm.bcast(space.comm.gather(mine))
        number, points, rows, places, values = (
            np.concatenate([part[k] for part in parts]) for k in range(5)
        )
        order = np.argsort(points[:, 1], kind="stable")
        number = number[order]
        self.points: Array = points[order]
        whole = sp.csr_matrix((values, (rows, places)), shape=(size, size))
        self.touched: Array = np.unique(rows)
        self.S: Array = whole[self.touched][:, number].toarray()
        self.own: sp.csr_matrix = own.tocsc()[:, number].tocsr()
        self._size = size
        self.nodes = len(points)
        # n is out of the body, and so into the water.
        self.side = 1.0 if whole[:, number].sum(axis=1)[number].sum() > 0.0 else -1.0
        self._find_level(face.name, level)

    def _find_level(self, name: str, level: float) -> None:
        """Find the nodes below the level, and the point at it."""
        points = self.points
        if np.any(np.diff(points[:, 1]) <= ALIKE * self._depth_below(level)):
            raise InputError(
                f"Reservoir: '{name}' has two nodes at one height: 'incompressible' and "
                "'acoustic' water need a face that goes up all the way, so name its floor apart"
            )
        self.below = np.flatnonzero(points[:, 1] < level - ALIKE * self._depth_below(level))
        x = points[self.below, 0]
        y = points[self.below, 1]

        # A node of the water at the level: that of the face, or one on the line to the next node.
        end = points[self.below[-1] + 1]
        share = (level - y[-1]) / (end[1] - y[-1])
        self.x: Array = np.append(x, x[-1] + share * (end[0] - x[-1]))
        self.y: Array = np.append(y, level)

    def _depth_below(self, level: float) -> float:
        """Return the depth [m] below a level."""
        return float(level - self.points[0, 1])

    @property
    def depth(self) -> float:
        """Return the depth of the water [m]."""
        return float(self.y[-1] - self.y[0])

    def spread(self, space: FemSpace, form: Array) -> Any:
        """Return S form Sᵀ on all components (PETSc), with a form (k, k). Collective."""
        dense = self.S @ form @ self.S.T
        owned = self.own.shape[0]
        mine = (self.touched >= self.first) & (self.touched < self.first + owned)
        place = np.repeat(self.touched[mine] - self.first, len(self.touched))
        columns = np.tile(self.touched, int(mine.sum()))
        rows = sp.csr_matrix((dense[mine].ravel(), (place, columns)), shape=(owned, self._size))
        return aij_of(rows, space.mesh.comm, self._columns)
