"""Give contact nodes the velocity of the nodes behind them: how redistributed mass leaves the contact surface.

A massless unknown i at node c, with direction q_i, gets the velocity of the rigid motion a that fits its neighbours J
best, weighted with their entries w_J of the mass matrix:

    v_i = R_i a,   G a = sum_J w_J R_Jᵀ v_J,   G = sum_J w_J R_Jᵀ R_J,   R = (q, q·(e_k x (X - X_c)) for rotations k)

so that every rigid motion is kept exactly. In 1D it is the velocity of the neighbour.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..core.algebra import Array, Indices, Mask, Matrix, largest
from ..core.errors import InputError
from ..core.system import SemiDiscreteSystem

KEPT = 1e-10  # of a rigid motion, in the units of the neighbourhood
NOTHING = 1e-10  # of a node's own mass: neighbours with less cannot carry it


def from_neighbours(system: SemiDiscreteSystem, massless: Mask, contact: Mask, nodal: Array) -> list[Matrix]:
    """Return the matrices P_k of v = P_0 P_1 … v that replace massless unknowns; contact: all unknowns of contact
    nodes.

    Contact nodes with neighbours behind the surface come last in the product, those with contact nodes around them
    only, in corners, follow these. Tied nodes carry nothing: they are in two places. InputError when some contact
    nodes have no material behind them at all.
    """
    algebra, comm = system.algebra, system.algebra.comm
    node = np.asarray(system.space.ids) // system.influence.shape[1]
    levels: list[Matrix] = []
    left, donors, exact = massless.copy(), ~contact, True
    if system.tied is not None:
        donors &= ~system.tied
    while largest(comm, left.any()):
        rows = _rows(system, left, donors, nodal, exact=exact)
        if largest(comm, len(rows)):
            levels.append(algebra.replaced_rows(system.rows, rows))
            ready = np.fromiter(rows, dtype=np.int64, count=len(rows))
            left[ready] = False
            donors |= contact & np.isin(node, node[ready])
        elif exact:
            exact = False  # too few neighbours to tell a rotation: translations will do
        else:
            raise InputError(
                "the mass of some contact nodes has nowhere to go, no node behind them carries any: refine the mesh "
                "across the body, or give the problem mass=ConsistentMass()"
            )
    return levels[::-1]


def _rows(
    system: SemiDiscreteSystem, left: Mask, donors: Mask, nodal: Array, *, exact: bool
) -> dict[int, tuple[Indices, Array]]:
    """Rows of P for those of the unknowns ``left`` that have neighbours among the donors; ``exact``: enough of them to
    keep every rigid motion."""
    entries = {int(row): system.algebra.entries(system.M, row) for row in np.flatnonzero(left)}
    neighbours = _neighbours(system, donors, [columns for columns, _ in entries.values()])
    points, rows = system.space.coordinates, {}
    node = np.asarray(system.space.ids) // system.influence.shape[1]
    for row, (columns, values) in entries.items():
        weights = neighbours.weights(columns, values)
        if weights.sum() > NOTHING * nodal[row]:
            fitted, error = neighbours.fit(weights, system.influence[row], points[row], turning=exact)
            if error <= KEPT or not exact:
                rows[row] = fitted
    waiting = set(node[[row for row in entries if row not in rows]])  # a node goes as a whole
    return {row: fitted for row, fitted in rows.items() if node[row] not in waiting}


@dataclass(frozen=True)
class _Neighbours:
    """Unknowns of all donor nodes next to contact nodes, on every rank, sorted by column.

    columns: numbers over all ranks; node: 0, 1, … of their nodes; directions, points: (k, d).
    """

    columns: Indices
    node: Indices
    directions: Array
    points: Array

    def weights(self, columns: Indices, values: Array) -> Array:
        """Weight of every donor node in a row of M: the size of its entries there."""
        place = np.minimum(np.searchsorted(self.columns, columns), max(len(self.columns) - 1, 0))
        found = self.columns[place] == columns if len(self.columns) else np.zeros(len(columns), dtype=bool)
        total = np.zeros(int(self.node.max(initial=-1)) + 1)
        np.add.at(total, self.node[place[found]], values[found] ** 2)
        return np.asarray(np.sqrt(total))

    def fit(
        self, weights: Array, direction: Array, point: Array, *, turning: bool
    ) -> tuple[tuple[Indices, Array], float]:
        """(columns, values) of the row R_i G⁻¹ w_J R_Jᵀ, and how much of a rigid motion it loses; with ``turning``
        False of translations only, which a single neighbour can tell."""
        of_unknown = weights[self.node]
        used = np.flatnonzero(of_unknown)
        offset = self.points[used] - point
        size = float(np.max(np.abs(offset)))
        R = rigid_motions(self.directions[used], offset / size)
        target = rigid_motions(direction[None, :], np.zeros((1, len(point))))[0]
        if not turning:
            R, target = R[:, : len(point)], target[: len(point)]
        root = np.sqrt(of_unknown[used])
        U, values, V = np.linalg.svd(root[:, None] * R, full_matrices=False)
        kept = values > 1e-8 * values[0]
        row = root * (U[:, kept] @ (V[kept] @ target / values[kept]))
        return (self.columns[used], row), float(np.max(np.abs(row @ R - target)))


def _neighbours(system: SemiDiscreteSystem, donors: Mask, columns: list[Indices]) -> _Neighbours:
    """What all ranks need to know of the donor nodes in these columns. Collective."""
    comm, d = system.algebra.comm, system.influence.shape[1]
    first, node = system.algebra.first(system.rows), np.asarray(system.space.ids) // d
    asked = named(system, columns)
    own = np.flatnonzero(np.isin(node, node[asked[donors[asked]]]))
    told = (first + own, node[own], system.influence[own], system.space.coordinates[own])
    parts = comm.bcast(comm.gather(told))
    numbers, nodes, directions, points = (np.concatenate([part[i] for part in parts]) for i in range(4))
    order = np.argsort(numbers)
    _, place = np.unique(nodes[order], return_inverse=True)
    return _Neighbours(numbers[order], place, directions[order], points[order])


def named(system: SemiDiscreteSystem, columns: list[Indices]) -> Indices:
    """Return those owned unknowns whose columns any rank names. Collective."""
    comm, first = system.algebra.comm, system.algebra.first(system.rows)
    mine = np.unique(np.concatenate(columns)) if columns else np.zeros(0, dtype=np.int64)
    wanted = np.unique(np.concatenate(comm.bcast(comm.gather(mine))))
    return np.asarray(wanted[(wanted >= first) & (wanted < first + system.rows)] - first)


def rigid_motions(directions: Array, offset: Array) -> Array:
    """Return the rows R of rigid motions: d translations and the rotations, of unknowns with these directions at these
    places."""
    d = directions.shape[1]
    turns = [
        directions[:, j] * offset[:, i] - directions[:, i] * offset[:, j] for i in range(d) for j in range(i + 1, d)
    ]
    return np.column_stack([directions, *turns])
