"""Give contact nodes the velocity of the nodes behind them.

This is how redistributed mass leaves the contact surface.

A massless unknown i at node c, with direction q_i, gets the velocity of the rigid motion a that
fits its neighbours J best, weighted with their entries w_J of the mass matrix:

    v_i = R_i a,   G a = sum_J w_J R_Jᵀ v_J,   G = sum_J w_J R_Jᵀ R_J
    R = (q, q·(e_k x (X - X_c)) for rotations k)

so that every rigid motion is kept exactly. In 1D it is the velocity of the neighbour.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from ..core.algebra import Array, Indices, Mask, Matrix, from_each, largest
from ..core.errors import InputError
from ..core.system import SemiDiscreteSystem

BATCH = 4096  # rows that are fitted at a time: bounds the memory
KEPT = 1e-10  # of a rigid motion, in the units of the neighbourhood
NOTHING = 1e-10  # of a node's own mass: neighbours with less cannot carry it


def from_neighbours(
    system: SemiDiscreteSystem, massless: Mask, contact: Mask, nodal: Array
) -> list[Matrix]:
    """Return the matrices P_k of v = P_0 P_1 … v that replace massless unknowns.

    ``contact``: all unknowns of contact nodes.

    Contact nodes with neighbours behind the surface come last in the product; those in corners,
    with contact nodes around, follow them, and tied ones, which are in two places. InputError for
    contact nodes without material behind.
    """
    algebra, comm = system.algebra, system.algebra.comm
    node = np.asarray(system.space.ids) // system.influence.shape[1]
    levels: list[Matrix] = []
    tied = np.zeros_like(contact) if system.tied is None else system.tied
    left, donors, exact = massless.copy(), ~contact & ~tied & system.influence.any(axis=1), True
    while largest(comm, left.any()):
        ready, entries = _rows(system, left & ~tied if exact else left, donors, nodal, exact=exact)
        if largest(comm, len(ready)):
            levels.append(algebra.replaced_rows(system.rows, ready, entries))
            left[ready] = False
            donors |= contact & np.isin(node, node[ready])
        elif exact:
            # too few to tell a rotation: translations will do
            exact, donors = (False, donors | (tied & ~contact))
        else:
            raise InputError(
                "the mass of some contact nodes cannot be moved, as no node behind them has mass: "
                "refine the mesh across the body, or give the problem mass=ConsistentMass()"
            )
    return levels[::-1]


def _rows(
    system: SemiDiscreteSystem, left: Mask, donors: Mask, nodal: Array, *, exact: bool
) -> tuple[Indices, sp.csr_matrix]:
    """Return (numbers, rows of P) of unknowns ``left`` that have neighbours among the donors.

    ``exact``: there are enough of them to keep every rigid motion. Collective.
    """
    asked = np.flatnonzero(left)
    entries = system.algebra.entries(system.M, asked)
    neighbours = _neighbours(system, donors, entries.indices)
    weights = neighbours.weights(entries)
    enough = np.asarray(weights.sum(axis=1)).ravel() > NOTHING * nodal[asked]
    fitted, fits = neighbours.of_unknowns(weights), np.zeros(len(asked), dtype=bool)
    directions, points = system.influence[asked], system.space.coordinates[asked]
    for rows in _alike(np.diff(fitted.indptr), enough):
        places = fitted.indptr[rows][:, None] + np.arange(
            fitted.indptr[rows[0] + 1] - fitted.indptr[rows[0]]
        )
        row, error = neighbours.fit(
            fitted.indices[places],
            fitted.data[places],
            directions[rows],
            points[rows],
            turning=exact,
        )
        fitted.data[places] = row
        fits[rows] = True if not exact else error <= KEPT
    node = np.asarray(system.space.ids)[asked] // system.influence.shape[1]
    fits &= ~np.isin(node, node[~fits])  # a node goes as a whole
    columns = (
        neighbours.columns[fitted.indices] if len(fitted.indices) else np.zeros(0, dtype=np.int64)
    )
    rows_of_p = sp.csr_matrix((fitted.data, columns, fitted.indptr), shape=entries.shape)
    return asked[fits], rows_of_p[fits]


def _alike(counts: Indices, chosen: Mask) -> Iterator[Indices]:
    """Return the chosen rows, in batches of those with the same count."""
    for count in np.unique(counts[chosen]):
        rows = np.flatnonzero(chosen & (counts == count))
        yield from np.split(rows, range(BATCH, len(rows), BATCH))


@dataclass(frozen=True)
class _Neighbours:
    """Hold the unknowns of all donor nodes next to the contact nodes of this rank.

    There are some others too; all are sorted by column.

    columns: numbers over all ranks; node: 0, 1, … of their nodes; directions, points: (k, d).
    """

    columns: Indices
    node: Indices
    directions: Array
    points: Array

    def weights(self, entries: sp.csr_matrix) -> sp.csr_matrix:
        """Weight of every donor node in rows of M: the size of its entries there."""
        rows, count = (
            np.repeat(np.arange(entries.shape[0]), np.diff(entries.indptr)),
            len(self.columns),
        )
        place = np.minimum(np.searchsorted(self.columns, entries.indices), max(count - 1, 0))
        found = self.columns[place] == entries.indices if count else np.zeros(len(rows), dtype=bool)
        nodes = int(self.node.max(initial=-1)) + 1
        pairs, which = np.unique(rows[found] * nodes + self.node[place[found]], return_inverse=True)
        sizes = np.sqrt(
            np.bincount(which.ravel(), weights=entries.data[found] ** 2, minlength=len(pairs))
        )
        used = sizes > 0.0
        row, node = np.divmod(pairs[used], max(nodes, 1))
        return sp.csr_matrix((sizes[used], (row, node)), shape=(entries.shape[0], nodes))

    def of_unknowns(self, weights: sp.csr_matrix) -> sp.csr_matrix:
        """Weights of nodes, told to every unknown of theirs, columns ascending."""
        count = len(self.columns)
        spread = sp.csr_matrix(
            (np.ones(count), (self.node, np.arange(count))), shape=(weights.shape[1], count)
        )
        found = sp.csr_matrix(weights @ spread)
        found.sort_indices()
        return found

    def fit(
        self, used: Indices, weights: Array, directions: Array, points: Array, *, turning: bool
    ) -> tuple[Array, Array]:
        """Return (rows R_i G⁻¹ w_J R_Jᵀ (n, k), how much of a rigid motion each loses).

        The rows are on the ``used`` neighbours (n, k). With ``turning`` False they are of
        translations only, which a single neighbour can tell.
        """
        offset = self.points[used] - points[:, None, :]
        size = np.max(np.abs(offset), axis=(1, 2))[:, None, None]
        R = rigid_motions(self.directions[used], offset / size)
        target = rigid_motions(directions, np.zeros_like(points))
        if not turning:
            d = points.shape[1]
            R, target = R[:, :, :d], target[:, :d]
        root = np.sqrt(weights)
        U, values, V = np.linalg.svd(root[:, :, None] * R, full_matrices=False)
        kept = values > 1e-8 * values[:, :1]
        share = np.where(kept, (V @ target[:, :, None])[:, :, 0] / np.where(kept, values, 1.0), 0.0)
        # one order of sums, whatever the batch
        by_columns = np.ascontiguousarray(U.swapaxes(1, 2)).swapaxes(1, 2)
        row = root * (by_columns @ share[:, :, None])[:, :, 0]
        return row, np.max(np.abs((row[:, None, :] @ R)[:, 0] - target), axis=1)


def _neighbours(system: SemiDiscreteSystem, donors: Mask, columns: Indices) -> _Neighbours:
    """Return what this rank needs of the donor nodes in these columns.

    What other ranks own is told to all. Collective.
    """
    d, first = system.influence.shape[1], system.algebra.first(system.rows)
    node, every = np.asarray(system.space.ids) // d, system.space.coordinates

    def told(asked: Indices) -> tuple[Indices, Indices, Array, Array]:
        own = np.flatnonzero(np.isin(node, node[asked[donors[asked]]]))
        return first + own, node[own], system.influence[own], every[own]

    mine, foreign = _owned(system, columns)
    others = from_each(system.algebra.comm, told(foreign))
    others[system.algebra.comm.rank] = told(mine)
    numbers, nodes, directions, points = (
        np.concatenate([part[i] for part in others]) for i in range(4)
    )
    order = np.argsort(numbers)
    _, place = np.unique(nodes[order], return_inverse=True)
    return _Neighbours(numbers[order], place.ravel(), directions[order], points[order])


def _owned(system: SemiDiscreteSystem, columns: Indices) -> tuple[Indices, Indices]:
    """Owned unknowns whose columns this rank names, and those that others name. Collective."""
    first, named = system.algebra.first(system.rows), np.unique(columns)
    mine = (named >= first) & (named < first + system.rows)
    away = np.unique(np.concatenate(from_each(system.algebra.comm, named[~mine])))
    return named[mine] - first, away[(away >= first) & (away < first + system.rows)] - first


def named(system: SemiDiscreteSystem, columns: Indices) -> Indices:
    """Return those owned unknowns whose columns any rank names. Collective."""
    return np.union1d(*_owned(system, columns))


def rigid_motions(directions: Array, offset: Array) -> Array:
    """Return rows R of rigid motions (…, modes) of directions (…, d) at offsets.

    The modes are d translations and the rotations.
    """
    d = directions.shape[-1]
    turns = [
        directions[..., j] * offset[..., i] - directions[..., i] * offset[..., j]
        for i in range(d)
        for j in range(i + 1, d)
    ]
    return np.concatenate(
        [directions, np.stack(turns, axis=-1)] if turns else [directions], axis=-1
    )
