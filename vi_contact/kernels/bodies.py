"""Split A into bodies that no entry couples, and factorise each shape of body once.

Contact alone joins the stones of a wall, so A is block diagonal. Bodies whose blocks are equal but
for rounding have one *shape*: one factor, and one compliance C = (A⁻¹)_cc on the unknowns c that
contact reads of any of them. All bodies of a shape are one solve with many right-hand sides.

Unknowns of a body are put in the order of their places in it, so that the order in which a mesh
numbers its nodes, which depends on the number of ranks, does not tell equal bodies apart. Bodies
that are turned have another block, and so another shape.

Every rank holds all bodies, as every rank holds the whole small problem.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components
from scipy.sparse.linalg import splu

from ..core.algebra import Array, EffectiveMatrix, Indices, Mask, from_each
from ..core.traces import Traces

SAME = 1e-12  # of the largest entry: by how much blocks of one shape differ, by rounding
ROUNDING = 2e-15  # of the largest free motion, as sums of reactions leave it
AT_REST = 1e-12  # the same of all unknowns at once
PLACES = 618033.988  # places along a body that count as different; no mesh size divides it


@dataclass(frozen=True, eq=False)
class Shape:
    """Hold what bodies of one shape share.

    Attributes:
        lu: the factor of the block.
        unknowns: (bodies, n) the unknowns of each body, in the order of the block.
        read: (p,) those of the block that contact reads of any of its bodies.
        columns: (n, p) of the inverse of the block, at these.
    """

    lu: Any
    unknowns: Indices
    read: Indices
    columns: Array

    @property
    def bytes(self) -> float:
        """Return the memory of factor and columns."""
        return 12.0 * (self.lu.L.nnz + self.lu.U.nnz) + 8.0 * self.columns.size


class Bodies:
    """Hold the factors of the bodies of A, the same on every rank.

    Attributes:
        shapes: the different ones.
        rows: number of unknowns of all ranks.
        mine: those of this rank.
    """

    def __init__(self, A: EffectiveMatrix, read: Indices) -> None:
        """Find the bodies, and factorise each shape. Collective.

        Args:
            A: the effective matrix.
            read: (k,) the unknowns that contact reads, numbered over all ranks.
        """
        algebra = A.algebra
        self._comm = algebra.comm
        n = A.matrix.rows
        first = algebra.first(n)
        self.mine = slice(first, first + n)
        matrix, order = gather_matrix(A)
        self.rows = matrix.shape[0]
        is_read = np.zeros(self.rows, dtype=bool)
        is_read[read] = True
        try:
            self.shapes = _find_shapes(matrix, order, is_read)
        except RuntimeError:  # a body is singular, which the factor of the whole says better
            _ = A.factor
            raise

    def gather(self, b: Array) -> Array:
        """Return the vector (rows,) of all ranks whose part here is b. Collective."""
        if self._comm.size == 1:
            return b
        whole = np.zeros(self.rows)
        whole[self.mine] = b
        return self._comm.sum(whole)

    def solve(self, b: Array) -> Array:
        """Return A⁻¹ b (rows,) of a vector of all ranks."""
        x = np.empty(self.rows)
        for shape in self.shapes:
            x[shape.unknowns] = shape.lu.solve(np.ascontiguousarray(b[shape.unknowns].T)).T
        return x

    def number_unknowns(self) -> Indices:
        """Return the number of the body of each unknown (rows,)."""
        numbers = np.empty(self.rows, dtype=np.int64)
        count = 0
        for shape in self.shapes:
            for unknowns in shape.unknowns:
                numbers[unknowns] = count
                count += 1
        return numbers

    def respond(self, force: Array) -> Array:
        """Return A⁻¹ force (rows,) of forces (rows,) on unknowns that contact reads."""
        x = np.empty(self.rows)
        for shape in self.shapes:
            x[shape.unknowns] = force[shape.unknowns[:, shape.read]] @ shape.columns.T
        return x

    def find_compliance(self, read: Indices) -> sp.csr_matrix:
        """Return C (k, k) of the unknowns that contact reads, with blocks for bodies alone.

        Args:
            read: (k,) these unknowns, as they were given.
        """
        place = np.full(self.rows, -1)
        place[read] = np.arange(len(read))
        rows, columns, values = [], [], []
        for shape in self.shapes:
            block = shape.columns[shape.read]
            for unknowns in shape.unknowns:
                at = place[unknowns[shape.read]]
                here = np.flatnonzero(at >= 0)
                rows.append(np.repeat(at[here], len(here)))
                columns.append(np.tile(at[here], len(here)))
                values.append(block[np.ix_(here, here)].ravel())
        entries = (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns)))
        return sp.csr_matrix(sp.coo_matrix(entries, shape=(len(read), len(read))))


def gather_matrix(A: EffectiveMatrix) -> tuple[sp.csr_matrix, Indices]:
    """Return the whole A on every rank, and its unknowns in the order of their places. Collective.

    Args:
        A: the effective matrix.
    """
    algebra = A.algebra
    n = A.matrix.rows
    rows = algebra.entries(A.matrix, np.arange(n))
    places = np.zeros((n, 0))
    components = np.zeros(n, dtype=np.int64)
    if A.space is not None:
        places = np.asarray(A.space.coordinates)
        components = np.asarray(A.space.ids) % A.space.dimension
    parts = from_each(algebra.comm, (rows, places, components))
    matrix = sp.csr_matrix(sp.vstack([part[0] for part in parts]))
    _, body = connected_components(matrix, directed=False)
    points = np.vstack([part[1] for part in parts])
    component = np.concatenate([part[2] for part in parts])

    # Places from the lowest corner of each body, in steps of its size.
    count = body.max(initial=-1) + 1
    keys = [component]
    for x in points.T:
        low = np.full(count, np.inf)
        high = np.full(count, -np.inf)
        np.minimum.at(low, body, x)
        np.maximum.at(high, body, x)
        size = np.where(high > low, high - low, 1.0)
        keys.append(np.rint((x - low[body]) / size[body] * PLACES))
    order = np.lexsort((*keys, body))
    return matrix, np.stack([order, body[order]])


def _find_shapes(matrix: sp.csr_matrix, order: Indices, is_read: Mask) -> tuple[Shape, ...]:
    """Return the shapes of the bodies of a matrix.

    Args:
        matrix: (rows, rows).
        order: (2, rows) the unknowns, body after body, and the number of the body of each.
        is_read: (rows,) which unknowns contact reads.
    """
    unknowns, body = order
    ends = np.flatnonzero(np.diff(body)) + 1
    blocks: list[sp.csc_matrix] = []
    members: list[list[Indices]] = []
    for own in np.split(unknowns, ends):
        block = sp.csc_matrix(matrix[own][:, own])
        block.sort_indices()
        same = [i for i, other in enumerate(blocks) if _are_same(block, other)]
        if same:
            members[same[0]].append(own)
        else:
            blocks.append(block)
            members.append([own])

    shapes = []
    options = {"SymmetricMode": True}
    for block, bodies in zip(blocks, members, strict=True):
        lu = splu(block, permc_spec="MMD_AT_PLUS_A", options=options)
        together = np.array(bodies)
        read = np.flatnonzero(is_read[together].any(axis=0))
        units = np.zeros((block.shape[0], len(read)))
        units[read, np.arange(len(read))] = 1.0
        columns = np.asarray(lu.solve(units)) if len(read) else units
        shapes.append(Shape(lu, together, read, columns))
    return tuple(shapes)


def _are_same(one: sp.csc_matrix, other: sp.csc_matrix) -> bool:
    """Say whether two blocks are equal but for rounding."""
    if one.shape != other.shape or one.nnz != other.nnz:
        return False
    if not np.array_equal(one.indptr, other.indptr):
        return False
    if not np.array_equal(one.indices, other.indices):
        return False
    size = np.abs(other.data).max(initial=0.0)
    return bool(np.abs(one.data - other.data).max(initial=0.0) <= SAME * size)


class CondensedBodies:
    """Hold A condensed onto conditions that are traces, with a sparse flexibility.

    It has the methods and attributes of ``condensation.CondensedTraces``.

    Attributes:
        bodies: the factors.
        flexibility: G = B C Bᵀ, sparse: two conditions share an entry where they share a body.
        movable: which conditions and tangents can move.
    """

    def __init__(self, A: EffectiveMatrix, traces: Traces, *, frictional: bool) -> None:
        """Condense A onto the traces. Collective.

        Args:
            A: the effective matrix.
            traces: the conditions.
            frictional: whether tangential traces count, beside the normal ones.
        """
        self._traces = traces
        B = traces.every
        self._B = B if frictional else sp.csr_matrix(B[:: 1 + traces.width])
        self._Bt = sp.csr_matrix(self._B.T)
        self.movable: Mask = np.diff(self._B.indptr) > 0
        self.bodies = Bodies(A, traces.unknowns)
        C = self.bodies.find_compliance(traces.unknowns)
        G = sp.csr_matrix(self._B @ C @ self._Bt)
        if A.algebra.symmetric:
            G = sp.csr_matrix(0.5 * (G + G.T))
        self.flexibility: Any = G

    def add_to_diagonal(self, rows: Indices, values: Array) -> None:
        """Add values (k,) to the diagonal of G in rows (k,)."""
        entries = (values, (rows, rows))
        shape = self.flexibility.shape
        self.flexibility = sp.csr_matrix(self.flexibility + sp.coo_matrix(entries, shape=shape))

    def find_touched(self) -> sp.csr_matrix:
        """Return which bodies each condition reads, (m, bodies), not zero where it does."""
        width = 1 + self._traces.width
        entries = sp.coo_matrix(self._traces.every)
        bodies = self.bodies.number_unknowns()[self._traces.unknowns[entries.col]]
        shape = (entries.shape[0] // width, int(bodies.max(initial=-1)) + 1)
        return sp.csr_matrix((np.ones(entries.nnz), (entries.row // width, bodies)), shape=shape)

    def find_free_motion(self, b: Array) -> Array:
        """Return B A⁻¹b, and keep A⁻¹b for ``answer``. Collective."""
        self._x = self.bodies.solve(self.bodies.gather(b))
        return np.asarray(self._B @ self._x[self._traces.unknowns])

    def _respond(self, force: Array) -> Array:
        """Return A⁻¹ (rows,) of forces (k,) on the unknowns that contact reads."""
        whole = np.zeros(self.bodies.rows)
        whole[self._traces.unknowns] = force
        return self.bodies.respond(whole)

    def answer(self, r: Array, held: Mask, values: Array) -> Array:
        """Return x = A⁻¹(b - Bᵀr), owned rows. Collective.

        Args:
            r: reactions of the conditions, in the unit of b.
            held: is not read, as a trace is no unknown that could be put on a value.
            values: is not read.
        """
        x = self._x - self._respond(self._Bt @ r)
        read = self._traces.unknowns
        x[read[find_still(x[read], self._x[read])]] = 0.0
        return x[self.bodies.mine].copy()

    def respond(self, r: Array) -> Array:
        """Return A⁻¹ Bᵀ r, owned rows, of reactions r. Collective."""
        return self._respond(self._Bt @ r)[self.bodies.mine].copy()


def find_still(x: Array, free: Array) -> Mask:
    """Return which unknowns (k,) reactions have brought to rest but for rounding.

    Args:
        x: (k,) with the reactions.
        free: (k,) without them.
    """
    # Where all are at rest what is left of them is rounding of the method too.
    size = np.abs(free).max(initial=0.0)
    is_at_rest = np.abs(x).max(initial=0.0) <= AT_REST * size
    return np.asarray(np.abs(x) <= (AT_REST if is_at_rest else ROUNDING) * size)
