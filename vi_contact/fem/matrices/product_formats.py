"""Choose by counts how a matrix is stored for its products, and copy it.

A product reads every stored number once, so that it takes as long as these bytes take from memory.
Three formats of PETSc are compared, and the one with the fewest bytes is taken:

- AIJ, all entries, which the matrix has already. Its product reads the rows of a node side by side,
  which is slow where they are long and come from memory: they count twice.
- SELL, eight rows at a time, without the entries that are zero: for a mass, whose components are
  not coupled, a half or a third of them.
- BAIJ, blocks of nodes, which share the number of a column: for a stiffness.

Counts, and not a clock, choose: formats add in another order, and an answer must not depend on what
else a machine does.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache
from typing import Any

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc

from ...core.algebra import Comm, largest
from .direct import FULL_ROW
from .petsc_rows import aij_of, rows_of

ENTRY = 12.0  # bytes of an entry and its column
SLICE = 8  # rows of SELL that are stored to the length of the longest
WIDTHS = (2, 3)  # unknowns of a node for which there are blocks
SAMPLE = 200  # nodes at which blocks are counted
WORTH = 0.9  # of AIJ's bytes: with more of them a copy does not pay
ROUND_OFF = 1e-12  # of the sizes of a row's entries: sums of 1e3 terms in another order stay below


@dataclass(frozen=True)
class Counts:
    """Hold what is counted of a matrix on all ranks, for the choice of a format.

    Attributes:
        rows: how many rows there are.
        entries: entries of AIJ.
        padded: entries of SELL without zeros.
        blocks: width of a block -> entries of BAIJ; widths that do not divide the rows are missing.
    """

    rows: float
    entries: float
    padded: float
    blocks: Mapping[int, float]


def choose_format(counts: Counts) -> str:
    """Return the format whose product reads the fewest bytes: "aij", "sell", "baij2" or "baij3"."""
    beside = 2.0 if counts.entries > FULL_ROW * counts.rows else 1.0
    aij = beside * ENTRY * counts.entries
    read = {"sell": ENTRY * counts.padded}
    for width, entries in counts.blocks.items():
        read[f"baij{width}"] = (8.0 + 4.0 / width**2) * entries
    fewest = min(read, key=lambda name: read[name])
    return fewest if read[fewest] < WORTH * aij else "aij"


def count_entries(rows: sp.csr_matrix, comm: Comm) -> Counts:
    """Return the counts of a square matrix. Collective.

    Args:
        rows: (n, columns of all ranks) the owned rows.
        comm: the ranks.
    """
    n = rows.shape[0]
    # the longest row of every slice, without the entries that are zero
    ends = np.append(0, np.cumsum(rows.data != 0.0))[rows.indptr]
    lengths = np.diff(ends)
    whole = np.append(lengths, np.zeros(-n % SLICE, dtype=lengths.dtype))
    padded = SLICE * whole.reshape(-1, SLICE).max(axis=1).sum()
    # entries of blocks, where nodes have all their unknowns on one rank
    odd = [float(n % width) for width in WIDTHS]
    filled = [_count_in_blocks(rows, width) if n % width == 0 else 0.0 for width in WIDTHS]
    sums = comm.sum(np.array([n, rows.nnz, padded, *odd, *filled], dtype=float))
    total, entries, all_padded = sums[:3]
    k = len(WIDTHS)
    blocks = {width: float(sums[3 + k + i]) for i, width in enumerate(WIDTHS) if sums[3 + i] == 0.0}
    return Counts(float(total), float(entries), float(all_padded), blocks)


def _count_in_blocks(rows: sp.csr_matrix, width: int) -> float:
    """Return how many entries blocks would have, by those of ``SAMPLE`` nodes all over the rows.

    Args:
        rows: (n, columns of all ranks) owned rows.
        width: unknowns of a node, which divides n.
    """
    if not rows.nnz or rows.shape[1] % width:
        return 0.0 if not rows.nnz else np.inf
    nodes = np.unique(np.linspace(0, rows.shape[0] // width - 1, SAMPLE).astype(int))
    sample = rows[(width * nodes[:, None] + np.arange(width)).ravel()]
    filled = sample.tobsr((width, width)).nnz
    return filled * rows.nnz / max(sample.nnz, 1)


def copy_for_products(mat: Any, comm: Comm) -> Any:
    """Return a PETSc matrix whose products are those of ``mat``, or ``mat`` itself. Collective.

    Args:
        mat: a PETSc matrix; what is not square or not AIJ is returned.
        comm: its ranks.
    """
    rows, columns = mat.getLocalSize()
    if mat.getType() not in ("seqaij", "mpiaij") or largest(comm, rows != columns):
        return mat
    own = rows_of(mat)
    chosen = choose_format(count_entries(own, comm))
    if chosen == "sell" and has_sell():
        copy = _make_sell(own, mat)
    elif chosen.startswith("baij"):
        copy = _make_blocks(own, mat, int(chosen[-1]))
    else:
        return mat

    # PETSc 3.22 multiplies SELL of several ranks wrongly: no copy is used that was not compared.
    if multiplies_alike(copy, mat, own, comm):
        return copy
    copy.destroy()
    return mat


def multiplies_alike(copy: Any, mat: Any, rows: sp.csr_matrix, comm: Comm) -> bool:
    """Say whether the product of a copy with one vector without zeros is that of its matrix.

    Every row may differ by ``ROUND_OFF`` of the sum of its entries' sizes. Collective.

    Args:
        copy: a PETSc matrix.
        mat: the matrix that it was made of.
        rows: its owned rows.
        comm: its ranks.
    """
    x, of_mat = mat.createVecs()
    of_copy = of_mat.duplicate()
    x.setArray(1.0 + 0.5 * np.cos(np.arange(*mat.getOwnershipRangeColumn())))
    mat.mult(x, of_mat)
    copy.mult(x, of_copy)
    sizes = np.asarray(abs(rows).sum(axis=1)).ravel()
    difference = np.abs(of_copy.array - of_mat.array)
    # not a number is not alike either
    unlike = not np.all(difference <= ROUND_OFF * sizes)
    for vector in (x, of_mat, of_copy):
        vector.destroy()
    return not largest(comm, unlike)


@cache
def has_sell() -> bool:
    """Say whether this PETSc makes SELL of a matrix: it is tried once, with one entry."""
    one = aij_of(sp.csr_matrix([[2.0]]), PETSc.COMM_SELF)
    x, y = one.createVecs()
    x.set(1.0)
    try:
        one.convert("sell", PETSc.Mat()).mult(x, y)
    except PETSc.Error:
        return False
    return bool(y.sum() == 2.0)


def _make_sell(rows: sp.csr_matrix, mat: Any) -> Any:
    """Return the matrix in slices of rows, without the entries that are zero (SELL). Collective.

    Args:
        rows: its owned rows; they are changed.
        mat: the matrix.
    """
    rows.eliminate_zeros()
    few = aij_of(rows, mat.comm)
    sliced = few.convert("sell", PETSc.Mat())
    few.destroy()
    return sliced


def _make_blocks(rows: sp.csr_matrix, mat: Any, width: int) -> Any:
    """Return the matrix in blocks of ``width`` × ``width`` entries (BAIJ). Collective.

    Args:
        rows: its owned rows.
        mat: the matrix.
        width: unknowns of a node.
    """
    blocks = rows.tobsr((width, width))
    blocks.sort_indices()
    n = rows.shape[0]
    kind = PETSc.IntType
    csr = (blocks.indptr.astype(kind), blocks.indices.astype(kind), blocks.data)
    made = PETSc.Mat().createBAIJ(((n, None), (n, None)), width, csr=csr, comm=mat.comm)
    made.assemble()
    return made
