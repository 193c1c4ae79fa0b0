"""Compute strains at the points of integration of all cells, and forces and matrices from there.

    eps = B u,    p = ∑ w Bᵀ sigma,    K = ∑ w Bᵀ D B

B (n, k) has a row for each component in Mandel's notation (``laws.mandel``) and a column for each
component of the nodes of a cell; w is weight, Jacobian and thickness. Materials that yield are
numpy and not forms, so that B is tabulated once here and no compiler runs.

With the mean dilatation (B-bar), tr eps of every point is the mean of its cell: first-order cells
then do not lock where the flow keeps the volume (Hughes, Int. J. Numer. Methods Eng. 15 (1980),
1413-1418).

Each rank has its owned cells. Displacements come with ghosts, and forces on ghosts go to their
owners; nothing else is sent.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from ...core.algebra import Array, Indices, freeze
from ...laws.mandel import PAIRS, ROOT
from .. import compat
from .cell_matrices import CellMatrices
from .space import FemSpace

KEPT = 3  # displacements whose strains are remembered: both ends of a step, and a tangent's


def find_known(comm: Any, u: Array, known: Sequence[Array]) -> int | None:
    """Return which of several vectors is u on all ranks, the last one; None for none. Collective.

    A rank without unknowns has the same vector always: so the ranks are asked together.

    Args:
        comm: of the ranks.
        u: the vector (n,).
        known: vectors (n,), as many on each rank.
    """
    if not known:
        return None
    differs = np.array([0.0 if np.array_equal(other, u) else 1.0 for other in known])
    same = np.flatnonzero(comm.max(differs) == 0.0)
    return int(same[-1]) if len(same) else None


class StrainPoints:
    """Hold B at the points of integration of the owned cells.

    Attributes:
        cells: how many cells this rank owns.
        each: points in a cell.
        components: n, 4 in plane strain and 6 in space.
        weights: (cells, each) of the points [m³], or [m²] times the thickness.
        places: (cells, each, d) of the points [m].
    """

    def __init__(
        self,
        space: FemSpace,
        thickness: float,
        *,
        degree: int | None = None,
        mean_dilatation: bool = False,
    ) -> None:
        """Tabulate B. Collective.

        Args:
            space: the body's unknowns.
            thickness: of the section [m].
            degree: of the quadrature; None for that which is exact on cells with parallel sides.
            mean_dilatation: whether tr eps is the mean of its cell.
        """
        mesh = space.mesh
        d = space.dimension
        simplex = compat.is_simplex(mesh)
        if degree is None:
            degree = 2 * (space.degree - 1) if simplex else 2 * space.degree
        X, w = compat.make_quadrature(mesh, degree)
        self._space = space
        self._X = X
        self.cells = mesh.topology.index_map(mesh.topology.dim).size_local
        self.each = len(w)
        self.components = 4 if d == 2 else 6

        # Places and Jacobians of the points, by the shape functions of the mesh.
        geometry = compat.geometry_dofmap(mesh)[: self.cells]
        nodes = mesh.geometry.x[geometry][:, :, :d]
        shapes, slopes = compat.tabulate(mesh, nodes.shape[1], X)
        self.places: Array = np.einsum("qn,cni->cqi", shapes, nodes)
        jacobians = np.einsum("kqn,cni->cqik", slopes, nodes)
        self.weights: Array = thickness * w * np.abs(np.linalg.det(jacobians))

        # Gradients of the shape functions of the displacement, and rows of B.
        blocks = compat.cell_blocks(space.V)[: self.cells]
        _, slopes = compat.tabulate(mesh, blocks.shape[1], X)
        gradients = np.einsum("kqn,cqki->cqni", slopes, np.linalg.inv(jacobians))
        self._B = _make_rows(gradients, self.components)
        if mean_dilatation:
            _take_mean_dilatation(self._B, self.weights)
        self._B = self._B.reshape(self.cells, self.each * self.components, -1)
        self._dofs: Indices = (blocks[:, :, None] * d + np.arange(d)).reshape(self.cells, -1)
        self._field = compat.function(space.V)
        self._free: CellMatrices | None = None
        self._known: list[tuple[Array, Array]] = []

    @property
    def bytes(self) -> int:
        """Return the bytes of B, its weights and numbers, and of the pattern of tangents."""
        own = self._B.nbytes + self.weights.nbytes + self._dofs.nbytes + self.places.nbytes
        return own if self._free is None else own + self._free.bytes

    def strain(self, u: Array) -> Array:
        """Return eps (points, n) of free unknowns (n,) [m]. Collective.

        Those of the last few displacements are remembered: stress, tangent and the next step ask
        for the same.
        """
        place = find_known(self._space.comm, u, [known for known, _ in self._known])
        if place is not None:
            return self._known[place][1]
        eps = freeze(self._compute_strain(u))
        self._known = [*self._known[-(KEPT - 1) :], (np.array(u), eps)]
        return eps

    def _compute_strain(self, u: Array) -> Array:
        """Return eps (points, n) of free unknowns (n,) [m]. Collective."""
        full = self._space.expand(u, 0.0)  # nothing that is held moves: any time will do
        values = self._field.x.array
        values[: full.size] = full.ravel()
        self._field.x.scatter_forward()
        return self.strain_of(values)

    def strain_of(self, values: Array) -> Array:
        """Return eps (points, n) of all components (local nodes d,) [m], ghosts among them."""
        own = values[self._dofs][:, :, None]
        return np.matmul(self._B, own).reshape(-1, self.components)

    def tabulate(self, nodes: int) -> Array:
        """Return the shape functions (each, nodes) at the points, of elements of so many nodes."""
        return np.asarray(compat.tabulate(self._space.mesh, nodes, self._X)[0])

    def force(self, sigma: Array) -> Array:
        """Return p (n,) [N] of stresses (points, n) [Pa]. Collective."""
        return self._space.pull(self.nodal_force(sigma))

    def nodal_force(self, sigma: Array) -> Array:
        """Return p (owned nodes d,) [N] of stresses (points, n) [Pa], held ones too. Collective."""
        weighted = (self.weights.reshape(-1, 1) * sigma).reshape(self.cells, 1, -1)
        own = np.matmul(weighted, self._B).reshape(self.cells, -1)
        values = self._field.x.array
        values[:] = np.bincount(self._dofs.ravel(), own.ravel(), len(values))
        compat.add_to_owners(self._field)
        owned = len(self._space.nodes) * self._space.dimension
        return np.array(values[:owned])

    def free_matrix(self, D: Array) -> Any:
        """Return K of the free unknowns of tangents D (points, n, n) [Pa]. Collective."""
        if len(self._space.mean_nodes):
            # components that follow several others have no number of their own
            full = self.full_matrix(D)
            part = self._space.reduce(full)
            full.destroy()
            return part
        if self._free is None:
            self._free = CellMatrices(
                self._dofs,
                self._spread(self._space.numbers),
                int(self._space.free.sum()),
                self._space.comm,
            )
        return self._free.add_up(self._make_matrices(D))

    def full_matrix(self, D: Array) -> Any:
        """Return K of all components, before elimination, of tangents D [Pa]. Collective."""
        index_map = self._space.V.dofmap.index_map
        d = self._space.dimension
        first = index_map.local_range[0] * d
        owned = index_map.size_local * d
        numbers = self._spread(first + np.arange(owned))
        return CellMatrices(self._dofs, numbers, owned, self._space.comm).add_up(
            self._make_matrices(D)
        )

    def _spread(self, numbers: Indices) -> Indices:
        """Return the numbers of all local components, of those of the owned ones. Collective."""
        values = self._field.x.array
        values[: numbers.size] = numbers.ravel()
        self._field.x.scatter_forward()
        return np.rint(values).astype(np.int64)

    def _make_matrices(self, D: Array) -> Array:
        """Return ∑ w Bᵀ D B (cells, k, k) of tangents (points, n, n)."""
        n = self.components
        B = self._B.reshape(self.cells, self.each, n, -1)
        weighted = D.reshape(self.cells, self.each, n, n) * self.weights[:, :, None, None]
        DB = np.matmul(weighted, B).reshape(self.cells, self.each * n, -1)
        return np.matmul(self._B.swapaxes(1, 2), DB)


def _make_rows(gradients: Array, n: int) -> Array:
    """Return B (cells, points, n, nodes, d) of the gradients (cells, points, nodes, d)."""
    cells, each, nodes, d = gradients.shape
    B = np.zeros((cells, each, n, nodes, d))
    for i in range(d):
        B[:, :, i, :, i] = gradients[..., i]
    for place, (i, j) in enumerate(PAIRS[n]):
        B[:, :, 3 + place, :, i] = gradients[..., j] / ROOT
        B[:, :, 3 + place, :, j] = gradients[..., i] / ROOT
    return B


def _take_mean_dilatation(B: Array, weights: Array) -> None:
    """Replace tr eps of every point by the mean of its cell, in place.

    Args:
        B: rows (cells, points, n, nodes, d).
        weights: (cells, points).
    """
    trace = B[:, :, :3].sum(axis=2)
    mean = np.einsum("cq,cqnd->cnd", weights, trace) / weights.sum(axis=1)[:, None, None]
    B[:, :, :3] += ((mean[:, None] - trace) / 3.0)[:, :, None]
