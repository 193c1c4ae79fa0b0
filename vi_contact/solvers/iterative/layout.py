"""Number the unknowns in whole nodes, so that matrices can be stored in blocks of two nodes.

A product with blocks of 3 x 3 reads one column number where AIJ reads nine, and half of a symmetric
matrix serves for all of it (SBAIJ): it takes a third of the time. Prescribed components are no
unknowns, and a node that keeps others would break the blocks: it gets them back here as unknowns
that are always held at zero.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, EffectiveMatrix, Indices, largest, take_upper_blocks
from ..petsc import PETSc
from ..volume.bounded_system import convert_to_aij


@dataclass(frozen=True)
class Layout:
    """Say where this rank's unknowns stand among the components of whole nodes.

    Attributes:
        width: components of a node.
        places: (n,) where the unknowns stand in padded vectors.
        size: length of padded vectors.
        complete: whether all components are unknowns, on all ranks.
    """

    width: int
    places: Indices
    size: int
    complete: bool

    def pad(self, x: Array) -> Array:
        """Return the values of all components of the nodes, a copy.

        They are zero where there is no unknown.
        """
        if self.complete:
            return np.array(x)
        values = np.zeros(self.size)
        values[self.places] = x
        return values

    def strip(self, values: Array) -> Array:
        """Return the values of the unknowns; a copy."""
        return np.array(values) if self.complete else values[self.places]

    @property
    def missing(self) -> Indices:
        """Return the places of components that are no unknowns."""
        return np.setdiff1d(np.arange(self.size), self.places)


def find_layout(A: EffectiveMatrix) -> Layout:
    """Return the layout of the unknowns of A; one unknown a block where nothing is known of nodes.

    Collective.
    """
    n = A.matrix.rows
    if A.space is None or A.space.dimension == 1:
        return Layout(1, np.arange(n), n, complete=True)

    # A node begins where its number changes, or where the component does not grow.
    d = int(A.space.dimension)
    node, component = np.divmod(np.asarray(A.space.ids), d)
    first = np.ones(n, dtype=bool)
    first[1:] = (node[1:] != node[:-1]) | (component[1:] <= component[:-1])
    places = d * (np.cumsum(first) - 1) + component
    size = d * int(first.sum())
    return Layout(d, places, size, complete=not largest(A.algebra.comm, size != n))


class Nodewise:
    """Make matrices of A in whole nodes."""

    def __init__(self, A: EffectiveMatrix) -> None:
        """Make the layout of A. Collective."""
        self.A = A
        self.layout = find_layout(A)

    @cached_property
    def source(self) -> Any:
        """Return A as AIJ."""
        return convert_to_aij(self.A)

    def blocks(self) -> Any:
        """Return A in symmetric blocks (SBAIJ), or its own AIJ where blocks have one entry.

        Collective.
        """
        layout = self.layout
        d = layout.width
        if d == 1:
            return self.source

        # A matrix that is stored in such blocks already is used as it is.
        stored: Any = getattr(self.A.matrix, "stored", None)
        has_blocks = stored is not None and "sbaij" in stored.getType()
        if layout.complete and has_blocks and stored.getBlockSize() == d:
            stored.setOption(PETSc.Mat.Option.SPD, True)
            return stored

        # Otherwise the blocks on and above the diagonal are copied.
        mat = convert_to_aij(self.A) if layout.complete else self.entries()
        indptr, columns, values = mat.getValuesCSR()
        rows = sp.csr_matrix((values, columns, indptr), shape=(layout.size, mat.getSize()[1]))
        ends, columns, values = take_upper_blocks(rows, d, mat.getOwnershipRange()[0])
        arrays = (ends.astype(PETSc.IntType), columns.astype(PETSc.IntType), values)
        sizes = ((layout.size, None), (layout.size, None))
        blocks = PETSc.Mat().createSBAIJ(sizes, d, csr=arrays, comm=mat.comm)
        blocks.assemble()
        blocks.setOption(PETSc.Mat.Option.SPD, True)
        return blocks

    def entries(self, result: Any = None) -> Any:
        """Return A as an AIJ matrix of whole nodes, each block stored in full. Collective.

        Rows of missing components hold the largest diagonal entry of A. ``result`` is an earlier
        matrix to refill.
        """
        mat = self.source.PtAP(self._selected, result=result)
        mat.setBlockSize(self.layout.width)
        mat.setOption(PETSc.Mat.Option.KEEP_NONZERO_PATTERN, True)
        if not self.layout.complete:
            rows = mat.getOwnershipRange()[0] + self.layout.missing
            mat.zeroRowsColumns(rows.astype(PETSc.IntType), diag=self.A.largest)
        mat.setOption(PETSc.Mat.Option.SPD, True)
        return mat

    @cached_property
    def _selected(self) -> Any:
        """Return P of A -> PᵀAP. Zeros are stored for the other components of a node.

        So every row of P has a whole block, and PᵀAP has full blocks.
        """
        layout = self.layout
        kind = PETSc.IntType
        d = layout.width
        n = len(layout.places)
        first = self.source.comm.tompi4py().scan(layout.size) - layout.size
        columns = (layout.places // d * d)[:, None] + np.arange(d)
        values = (columns == layout.places[:, None]).astype(float)
        csr = (
            np.arange(0, d * n + 1, d).astype(kind),
            (first + columns).ravel().astype(kind),
            values.ravel(),
        )
        selection = PETSc.Mat().createAIJ(
            (self.source.getSizes()[0], (layout.size, None)), csr=csr, comm=self.source.comm
        )
        selection.assemble()
        return selection
