"""Give a body the unknowns of compressible water (``acoustic_water``), beside those of its nodes.

They are the last ones of the last rank, and no displacements of points: no translation moves them,
and outputs of the body do not see them.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, Indices, Mask
from ..matrices.petsc_algebra import PetscAlgebra, PetscMatrix
from ..matrices.petsc_rows import aij_of, rows_of
from .acoustic_water import WaterData, WaterEquations, find_water
from .space import FemSpace
from .wet_face import WetFace


class AcousticWater:
    """Hold the water of a body: its equations, its face and its place among the unknowns.

    Attributes:
        equations: those of the water, the same on every rank.
        face: the wet face.
        data: which water it is.
        here: whether this rank owns the unknowns.
    """

    def __init__(self, space: FemSpace, face: WetFace, data: WaterData) -> None:
        """Find the equations, and add the unknowns to those of the body. Collective.

        Args:
            space: the body's unknowns.
            face: its wet face.
            data: of the water.
        """
        self.face = face
        self.data = data
        self._space = space
        # found once: no rank may see other modes
        own = find_water(face.x, face.y, face.side, data) if space.comm.rank == 0 else None
        self.equations: WaterEquations = space.comm.bcast(own)
        self.here = space.comm.rank == space.comm.size - 1
        self._start = space.unknowns
        owned = np.array(space.comm.bcast(space.comm.gather(len(space.ids))))
        self._first = int(owned[: space.comm.rank].sum())
        body = self._find_body()
        space.add_unknowns(self.equations.count if self.here else 0, face.points[0], body)

    def _find_body(self) -> int:
        """Return the body that has the face. Collective."""
        space = self._space
        at = (self.face.touched - self.face.first) // space.dimension
        at = at[(at >= 0) & (at < len(space.nodes))]
        found = np.max(space.body_of_node[at], initial=-1)
        return int(space.comm.max(np.array([found], dtype=float))[0])

    def mass_of_face(self) -> Any:
        """Return rho S Kp⁻¹ Sᵀ on all components (PETSc). Collective."""
        form = np.zeros((self.face.nodes, self.face.nodes))
        form[np.ix_(self.face.below, self.face.below)] = self.equations.of_face
        return self.face.spread(self._space, form)

    def find_volumes(self, nodal: Array) -> Array:
        """Return Sᵀ of a motion (owned nodes, d): volumes of the nodes below the level. Collective.

        The unit is m³ of displacements, and the like of their rates.
        """
        volumes: Array = self._space.comm.sum(np.asarray(self.face.own.T @ nodal.ravel()))
        return volumes[self.face.below]

    @property
    def outlets(self) -> Mask | None:
        """Return which unknowns (n,) are outlets, None where nothing flows out."""
        damping = self.equations.damping
        return self.put(damping) > 0.0 if damping.any() else None

    @property
    def static_springs(self) -> Array:
        """Return springs (n,) [N/m] that hold the outlets in statics, as stiff as the water."""
        return self.put(self.equations.damping * (self.data.speed / self.face.depth))

    def own_values(self, x: Array) -> Array:
        """Return the values (w,) of the water in a vector (n,), on every rank. Collective."""
        count = self.equations.count
        mine = x[len(x) - count :] if self.here else np.zeros(count)
        return self._space.comm.sum(mine)

    def find_force(self, pressure: Array) -> Array:
        """Return the force (d,) [N] of pressures (b,) [Pa] of nodes below the level on the body."""
        nodal = self.face.S[:, self.face.below] @ pressure
        # rows of all components begin with a node, and n of S points into the water
        component = self.face.touched % self._space.dimension
        return np.array([-nodal[component == c].sum() for c in range(self._space.dimension)])

    def put(self, values: Array) -> Array:
        """Return a vector (n,) with these values (w,) of the water, and zero elsewhere."""
        vector = np.zeros(len(self._space.ids))
        if self.here:
            vector[len(vector) - len(values) :] = values
        return vector

    def add_momenta(self, momenta: Array) -> None:
        """Add what horizontal unit accelerations of all nodes pull on the water. Collective."""
        for column in range(self._space.dimension - 1):  # the last axis points up
            volumes = self.find_volumes(self._space.translations[column])
            momenta[:, column] += self.put(self.equations.coupling.T @ volumes)

    def make_load(self) -> Callable[[float], Array]:
        """Return t [s] -> what accelerated held nodes do on the water (n,) [N]."""

        def load(t: float) -> Array:
            volumes = self.find_volumes(self._space.evaluate_prescribed(t, 2))
            return self.put(-self.equations.coupling.T @ volumes)

        return load

    def join(self, name: str, matrix: PetscMatrix | None, algebra: PetscAlgebra) -> Any:
        """Return M, C or K of body and water; None for a C without any damping. Collective.

        Args:
            name: "M", "C" or "K".
            matrix: that of the body, None where it has none.
            algebra: how the matrix is stored.
        """
        equations = self.equations
        if name == "M":
            entries = add_entries(self._couple(), self._stand_alone(equations.mass))
        else:
            diagonal = equations.damping if name == "C" else equations.stiffness
            if matrix is None and not diagonal.any():
                return None
            entries = self._stand_alone(np.diag(diagonal))
        if matrix is not None:
            body = rows_of(matrix.mat)
            body.resize(entries.shape)
            entries = add_entries(entries, body)
        return algebra.store(aij_of(entries, algebra.comm.mpi, entries.shape[0]))

    def _stand_alone(self, block: Array) -> sp.csr_matrix:
        """Return the owned rows of a matrix with a block (w, w) of the water."""
        row, column = np.nonzero(block) if self.here else (np.zeros(0, int), np.zeros(0, int))
        start = len(self._space.ids) - self.equations.count
        return self._rows(start + row, self._start + column, block[row, column])

    def _couple(self) -> sp.csr_matrix:
        """Return the owned rows of the coupling of face and water, both ways. Collective."""
        space = self._space
        face = self.face
        coupling = face.S[:, face.below] @ self.equations.coupling

        # unknowns of the touched components over all ranks, -1 where they are held; tied ones have
        # those of others, and their entries add up there
        place = face.touched - face.first
        mine = np.flatnonzero((place >= 0) & (place < face.own.shape[0]))
        unknown = np.zeros(len(face.touched))
        unknown[mine] = space.numbers.ravel()[place[mine]]
        numbers = np.rint(space.comm.sum(unknown)).astype(np.int64)

        # rows of the face, of this rank's unknowns
        w = self.equations.count
        owned = len(space.ids) - (w if self.here else 0)
        rows = numbers - self._first
        local = np.flatnonzero((rows >= 0) & (rows < owned))
        columns = np.tile(self._start + np.arange(w), len(local))
        entries = self._rows(np.repeat(rows[local], w), columns, coupling[local].ravel())
        if not self.here:
            return entries

        # rows of the water
        moves = np.flatnonzero(numbers >= 0)
        below = np.repeat(owned + np.arange(w), len(moves))
        columns = np.tile(numbers[moves], w)
        return add_entries(entries, self._rows(below, columns, coupling[moves].T.ravel()))

    def _rows(self, rows: Indices, columns: Indices, values: Array) -> sp.csr_matrix:
        """Return owned rows with these entries."""
        shape = (len(self._space.ids), self._start + self.equations.count)
        return sp.csr_matrix((values, (rows, columns)), shape=shape)


def add_entries(one: sp.csr_matrix, other: sp.csr_matrix) -> sp.csr_matrix:
    """Return the sum of two sparse matrices, with every entry that either of them stores.

    scipy's own sum leaves out entries that cancel. By rounding this may happen on one side of the
    diagonal only, and a symmetric matrix would lose its symmetric pattern.
    """
    first = one.tocoo()
    second = other.tocoo()
    rows = np.concatenate([first.row, second.row])
    columns = np.concatenate([first.col, second.col])
    values = np.concatenate([first.data, second.data])
    return sp.csr_matrix((values, (rows, columns)), shape=one.shape)
