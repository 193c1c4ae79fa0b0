"""Hold contact conditions as linear traces of the unknowns: B_n and B_t with any entries.

A condition usually bounds one unknown of its own (``core.surfaces``). Where several conditions
share unknowns none has one: a stone on two stones, the crossing of joints, a corner that rubs on
all its faces. Every body then keeps its own unknowns along the axes, and a condition reads

    u_n = n·(u_a - sum_j P_aj u_j),    u_t = t·(u_a - sum_j P_aj u_j)

one row of B_n and d - 1 rows of B_t. Forces on the unknowns are Bᵀr, which adds where conditions
share an unknown. Rows stand on the rank that holds their condition; the columns, of all unknowns
that any row reads, are the same on all ranks.
"""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp

from .algebra import Array, Comm, Indices, Mask, from_each


@dataclass(frozen=True, eq=False)
class Traces:
    """Hold B_n and B_t of this rank's m conditions in d dimensions.

    Attributes:
        comm: the ranks that share the conditions.
        slots: (m,) the numbers of the conditions among those of all ranks.
        unknowns: (k,) numbers, among those of all ranks, of the unknowns that any condition reads,
            ascending.
        own: (p,) those of this rank, as its rows.
        places: (p,) where these stand among the k.
        normal: B_n (m, k).
        tangential: B_t (m (d - 1), k), the tangents of a condition side by side; rows of zeros
            where a tangent is prescribed.
        width: d - 1, which a rank without conditions cannot tell from its rows.
    """

    comm: Comm
    slots: Indices
    unknowns: Indices
    own: Indices
    places: Indices
    normal: sp.csr_matrix
    tangential: sp.csr_matrix
    width: int

    def normal_values(self, x: Array) -> Array:
        """Return B_n x (m,), or rows (k, m) of rows. Collective.

        Args:
            x: the unknowns (n,) of this rank, or rows (k, n).
        """
        return _multiply(self.normal, self._gather(x))

    def tangential_values(self, x: Array) -> Array:
        """Return B_t x (m, d - 1), or rows of it. Collective.

        Args:
            x: the unknowns (n,) of this rank, or rows (k, n).
        """
        values = _multiply(self.tangential, self._gather(x))
        return values.reshape(*x.shape[:-1], self.normal.shape[0], self.width)

    def load(self, r_n: Array, rows: int, r_t: Array | None = None) -> Array:
        """Return B_nᵀ r_n + B_tᵀ r_t (rows,) on the unknowns of this rank. Collective.

        Args:
            r_n: normal reactions (m,), or rows (k, m).
            rows: number of unknowns of this rank.
            r_t: tangential reactions (m, d - 1), or rows of them; None without friction.
        """
        force = _multiply(self.normal.T, r_n)
        if r_t is not None:
            flat = r_t.reshape(*r_n.shape[:-1], self.tangential.shape[0])
            force = force + _multiply(self.tangential.T, flat)
        force = self.comm.sum(force)
        load = np.zeros((*r_n.shape[:-1], rows))
        load[..., self.own] = force[..., self.places]
        return load

    def among(self, chosen: Mask, first: int) -> "Traces":
        """Return the same traces of a system that has some of the unknowns only. Collective.

        Args:
            chosen: (n,) which unknowns of this rank these are; all that conditions read are.
            first: the number, over all ranks, of the first of them on this rank.
        """
        own = (np.cumsum(chosen) - 1)[self.own]
        numbers = np.zeros(len(self.unknowns))
        numbers[self.places] = own + first
        unknowns = self.comm.sum(numbers).astype(np.int64)
        return replace(self, unknowns=unknowns, own=own)

    def without_tangents(self, rows: Indices) -> "Traces":
        """Return the same traces, of which some conditions (rows) have no tangents."""
        keep = np.ones(self.tangential.shape[0])
        keep[(rows[:, None] * self.width + np.arange(self.width)).ravel()] = 0.0
        tangential = self.tangential.copy()
        tangential.data *= np.repeat(keep, np.diff(tangential.indptr))
        return replace(self, tangential=_drop_zeros(tangential))

    def read_here(self, *, frictional: bool) -> Indices:
        """Return the unknowns of this rank that a condition of any rank reads. Collective.

        Args:
            frictional: whether tangents count too.
        """
        if frictional:
            return self.own
        reads = np.bincount(self.normal.indices, minlength=len(self.unknowns)).astype(float)
        return self.own[self.comm.sum(reads)[self.places] > 0.0]

    @cached_property
    def moves(self) -> Mask:
        """Return which tangents (m, d - 1) are not prescribed."""
        entries = np.diff(self.tangential.indptr)
        return np.asarray(entries.reshape(self.normal.shape[0], self.width) > 0)

    @cached_property
    def every(self) -> sp.csr_matrix:
        """Return B of the conditions of all ranks (total d, k), on every rank.

        The rows of a condition stand side by side, the normal one first, and conditions in the
        order of their numbers. Collective when first asked.
        """
        parts = from_each(self.comm, (self.slots, self.normal, self.tangential))
        slots, normal, tangential = zip(*parts, strict=True)
        rows = sp.csr_matrix(sp.vstack([*normal, *tangential]))

        # Conditions stand rank after rank, and behind all their normals all tangents.
        total = sum(map(len, slots))
        tangents = total + np.arange(total * self.width).reshape(total, self.width)
        order = np.argsort(np.concatenate(slots), kind="stable")
        places = np.column_stack([np.arange(total), tangents])[order]
        return sp.csr_matrix(rows[places.ravel()])

    def _gather(self, x: Array) -> Array:
        """Return the k unknowns that conditions read, (k,) of (n,) on this rank. Collective."""
        values = x[..., self.own]
        if self.comm.size == 1:
            return np.asarray(values)
        whole = np.zeros((*x.shape[:-1], len(self.unknowns)))
        whole[..., self.places] = values
        return self.comm.sum(whole)


def make_traces(
    comm: Comm,
    slots: Indices,
    rows: tuple[sp.csr_matrix, sp.csr_matrix],
    *,
    width: int,
    first: int,
    count: int,
) -> Traces:
    """Return traces, with columns for the unknowns alone that some condition reads. Collective.

    Args:
        comm: the ranks.
        slots: (m,) the numbers of this rank's conditions among those of all ranks.
        rows: B_n (m, n) and B_t (m (d - 1), n) of this rank's conditions, with a column for every
            unknown of all ranks.
        width: d - 1, tangents of a condition.
        first: the number of this rank's first unknown.
        count: how many it owns.
    """
    normal, tangential = (_drop_zeros(part) for part in rows)
    read = from_each(comm, np.unique(np.concatenate([normal.indices, tangential.indices])))
    unknowns = np.unique(np.concatenate(read)).astype(np.int64)
    places = np.flatnonzero((unknowns >= first) & (unknowns < first + count))
    return Traces(
        comm=comm,
        slots=slots,
        unknowns=unknowns,
        own=unknowns[places] - first,
        places=places,
        normal=normal[:, unknowns],
        tangential=tangential[:, unknowns],
        width=width,
    )


def _multiply(matrix: sp.spmatrix, x: Array) -> Array:
    """Return matrix x, of a vector (k,) or of rows (…, k)."""
    return np.asarray(matrix @ x) if x.ndim == 1 else np.asarray((matrix @ x.T).T)


def _drop_zeros(matrix: sp.csr_matrix) -> sp.csr_matrix:
    """Return a copy without entries that are zero: what is not read is no column."""
    matrix = sp.csr_matrix(matrix, copy=True)
    matrix.sum_duplicates()
    matrix.eliminate_zeros()
    return matrix
