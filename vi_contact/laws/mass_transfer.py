"""Give contact nodes the velocity of the nodes behind them, which then carry their mass.

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
EXACT = 1e-10  # error of a rigid motion, in units of the neighbourhood, that is round-off
NOTHING = 1e-10  # of a node's own mass: neighbours with less cannot carry it
DEPENDENT = 1e-8  # relative; singular values of motions that the neighbours cannot tell


def transfer_to_neighbours(
    system: SemiDiscreteSystem, massless: Mask, contact: Mask, nodal: Array
) -> list[Matrix]:
    """Return the matrices P_k of v = P_0 P_1 … v that replace massless unknowns. Collective.

    Contact nodes with neighbours behind the surface come last in the product; those in corners,
    with contact nodes around, follow them, and tied ones, which are in two places.

    Args:
        system: the equations.
        massless: (n,) the unknowns that lose their mass.
        contact: (n,) all unknowns of contact nodes.
        nodal: (n,) the nodal masses.

    Raises:
        InputError: contact nodes without material behind.
    """
    algebra = system.algebra
    node = np.asarray(system.space.ids) // system.influence.shape[1]
    tied = np.zeros_like(contact) if system.tied is None else system.tied

    # Level by level: unknowns with enough neighbours among the donors are replaced, and become
    # donors for the next ones.
    levels: list[Matrix] = []
    remaining = massless.copy()
    donors = ~contact & ~tied & system.influence.any(axis=1)
    exact = True
    while largest(algebra.comm, remaining.any()):
        tried = remaining & ~tied if exact else remaining
        ready, entries = _fit_rows(system, tried, donors, nodal, exact=exact)
        if largest(algebra.comm, len(ready)):
            levels.append(algebra.replace_identity_rows(system.rows, ready, entries))
            remaining[ready] = False
            donors |= contact & np.isin(node, node[ready])
        elif exact:
            # The neighbours that are left are too few to tell a rotation: translations will do.
            exact = False
            donors = donors | (tied & ~contact)
        else:
            raise InputError(
                "the mass of some contact nodes cannot be moved, as no node behind them has mass: "
                "refine the mesh across the body, or give the problem mass=ConsistentMass()"
            )
    return levels[::-1]


def _fit_rows(
    system: SemiDiscreteSystem, massless: Mask, donors: Mask, nodal: Array, *, exact: bool
) -> tuple[Indices, sp.csr_matrix]:
    """Return the rows of P of those unknowns that donors can replace. Collective.

    Args:
        system: the equations.
        massless: (n,) the unknowns to replace.
        donors: (n,) the unknowns that may replace them.
        nodal: (n,) the nodal masses.
        exact: whether the donors must be enough to keep every rigid motion.

    Returns:
        The numbers (k,) of the unknowns, and their rows (k, unknowns of all ranks).
    """
    unknowns = np.flatnonzero(massless)
    entries = system.algebra.entries(system.M, unknowns)
    neighbours = _find_neighbours(system, donors, entries.indices)
    weights = neighbours.weights(entries)
    enough = np.asarray(weights.sum(axis=1)).ravel() > NOTHING * nodal[unknowns]

    # The weights of each row are replaced by what the fit makes of them, many rows of one length
    # at a time.
    fitted = neighbours.spread_to_unknowns(weights)
    fits = np.zeros(len(unknowns), dtype=bool)
    directions = system.influence[unknowns]
    points = system.space.coordinates[unknowns]
    lengths = np.diff(fitted.indptr)
    for rows in _batches(lengths, enough):
        places = fitted.indptr[rows][:, None] + np.arange(lengths[rows[0]])
        fit, error = neighbours.fit(
            fitted.indices[places],
            fitted.data[places],
            directions[rows],
            points[rows],
            turning=exact,
        )
        fitted.data[places] = fit
        fits[rows] = error <= EXACT if exact else True
    node = np.asarray(system.space.ids)[unknowns] // system.influence.shape[1]
    fits &= ~np.isin(node, node[~fits])  # a node goes as a whole
    columns = np.zeros(0, dtype=np.int64)
    if len(fitted.indices):
        columns = neighbours.columns[fitted.indices]
    P = sp.csr_matrix((fitted.data, columns, fitted.indptr), shape=entries.shape)
    return unknowns[fits], P[fits]


def _batches(counts: Indices, chosen: Mask) -> Iterator[Indices]:
    """Yield the chosen rows, in batches of those with the same count."""
    for count in np.unique(counts[chosen]):
        rows = np.flatnonzero(chosen & (counts == count))
        yield from np.split(rows, range(BATCH, len(rows), BATCH))


@dataclass(frozen=True)
class _Neighbours:
    """Hold the k unknowns of all donor nodes next to the contact nodes of this rank, and others.

    Attributes:
        columns: (k,) their numbers over all ranks, ascending.
        node: (k,) the node of each, numbered from 0 on.
        directions: (k, d) in which they point.
        points: (k, d) where they are [m].
    """

    columns: Indices
    node: Indices
    directions: Array
    points: Array

    def weights(self, entries: sp.csr_matrix) -> sp.csr_matrix:
        """Return the weights of donor nodes (rows, nodes) in rows of M: the sizes of its entries.

        The size is the root of the sum of squares over the unknowns of the node.
        """
        # Find the column of every entry among those of the donors.
        rows = np.repeat(np.arange(entries.shape[0]), np.diff(entries.indptr))
        count = len(self.columns)
        place = np.minimum(np.searchsorted(self.columns, entries.indices), max(count - 1, 0))
        of_donor = np.zeros(len(rows), dtype=bool)
        if count:
            of_donor = self.columns[place] == entries.indices

        # Sum over the entries of each pair of a row and a node.
        nodes = int(self.node.max(initial=-1)) + 1
        keys = rows[of_donor] * nodes + self.node[place[of_donor]]
        pairs, pair = np.unique(keys, return_inverse=True)
        squares = entries.data[of_donor] ** 2
        sizes = np.sqrt(np.bincount(pair.ravel(), weights=squares, minlength=len(pairs)))
        has_weight = sizes > 0.0
        row, node = np.divmod(pairs[has_weight], max(nodes, 1))
        return sp.csr_matrix((sizes[has_weight], (row, node)), shape=(entries.shape[0], nodes))

    def spread_to_unknowns(self, weights: sp.csr_matrix) -> sp.csr_matrix:
        """Return weights (rows, k) of unknowns, each that of its node, columns ascending."""
        count = len(self.columns)
        spread = sp.csr_matrix(
            (np.ones(count), (self.node, np.arange(count))), shape=(weights.shape[1], count)
        )
        of_unknowns = sp.csr_matrix(weights @ spread)
        of_unknowns.sort_indices()
        return of_unknowns

    def fit(
        self, donors: Indices, weights: Array, directions: Array, points: Array, *, turning: bool
    ) -> tuple[Array, Array]:
        """Fit rigid motions to neighbours, for n unknowns at a time.

        Args:
            donors: (n, j) which of these neighbours each unknown has.
            weights: (n, j) w_J of each.
            directions: (n, d) in which the unknowns point.
            points: (n, d) where they are [m].
            turning: whether rotations are fitted, and not translations alone, which a single
                neighbour can tell.

        Returns:
            The rows R_i G⁻¹ w_J R_Jᵀ (n, j), and how much of a rigid motion each loses (n,).
        """
        # Rigid motions about each unknown, in units of its neighbourhood.
        offset = self.points[donors] - points[:, None, :]
        size = np.max(np.abs(offset), axis=(1, 2))[:, None, None]
        R = rigid_motions(self.directions[donors], offset / size)
        target = rigid_motions(directions, np.zeros_like(points))
        if not turning:
            d = points.shape[1]
            R = R[:, :, :d]
            target = target[:, :d]

        # Least squares by the singular values of sqrt(w) R, without motions that the neighbours
        # cannot tell.
        root = np.sqrt(weights)
        U, values, V = np.linalg.svd(root[:, :, None] * R, full_matrices=False)
        independent = values > DEPENDENT * values[:, :1]
        inverse = np.where(independent, values, 1.0)
        share = np.where(independent, (V @ target[:, :, None])[:, :, 0] / inverse, 0.0)

        # Stored by columns, the product has one order of sums, whatever the size of the batch.
        by_columns = np.ascontiguousarray(U.swapaxes(1, 2)).swapaxes(1, 2)
        row = root * (by_columns @ share[:, :, None])[:, :, 0]
        error = np.max(np.abs((row[:, None, :] @ R)[:, 0] - target), axis=1)
        return row, error


def _find_neighbours(system: SemiDiscreteSystem, donors: Mask, columns: Indices) -> _Neighbours:
    """Return what this rank needs of the donor nodes in these columns. Collective.

    Every rank sends to all others what these name of its unknowns.

    Args:
        system: the equations.
        donors: (n,) the unknowns of this rank that may replace others.
        columns: (k,) the columns that this rank needs, numbered over all ranks.
    """
    algebra = system.algebra
    first = algebra.first(system.rows)
    node = np.asarray(system.space.ids) // system.influence.shape[1]
    coordinates = system.space.coordinates

    def describe(rows: Indices) -> tuple[Indices, Indices, Array, Array]:
        """Return all unknowns of the donor nodes in these rows, as ``_Neighbours`` holds them."""
        unknowns = np.flatnonzero(np.isin(node, node[rows[donors[rows]]]))
        return first + unknowns, node[unknowns], system.influence[unknowns], coordinates[unknowns]

    mine, foreign = _locate_named(system, columns)
    parts = from_each(algebra.comm, describe(foreign))
    parts[algebra.comm.rank] = describe(mine)
    numbers, nodes, directions, points = map(np.concatenate, zip(*parts, strict=True))
    order = np.argsort(numbers)
    _, place = np.unique(nodes[order], return_inverse=True)
    return _Neighbours(numbers[order], place.ravel(), directions[order], points[order])


def _locate_named(system: SemiDiscreteSystem, columns: Indices) -> tuple[Indices, Indices]:
    """Return owned unknowns whose columns this rank names, and those that others name. Collective.

    The columns (k,) are numbered over all ranks.
    """
    first = system.algebra.first(system.rows)
    end = first + system.rows
    named = np.unique(columns)
    is_mine = (named >= first) & (named < end)
    foreign = np.unique(np.concatenate(from_each(system.algebra.comm, named[~is_mine])))
    is_asked = (foreign >= first) & (foreign < end)
    return named[is_mine] - first, foreign[is_asked] - first


def select_named(system: SemiDiscreteSystem, columns: Indices) -> Indices:
    """Return those owned unknowns whose columns, numbered over all ranks, any rank names.

    Collective.
    """
    return np.union1d(*_locate_named(system, columns))


def rigid_motions(directions: Array, offset: Array) -> Array:
    """Return what rigid motions (…, modes) move in given directions: d translations, rotations.

    Args:
        directions: (…, d) in which the motion is measured.
        offset: (…, d) places from the centre of the rotations, in any unit.
    """
    d = directions.shape[-1]
    turns = [
        directions[..., j] * offset[..., i] - directions[..., i] * offset[..., j]
        for i in range(d)
        for j in range(i + 1, d)
    ]
    if not turns:
        return directions.copy()
    return np.concatenate([directions, np.stack(turns, axis=-1)], axis=-1)
