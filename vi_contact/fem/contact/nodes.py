"""Hold nodes of a contact boundary, and gather what ranks know of them.

Each rank holds the nodes that it owns, as rows of arrays (``Nodes``). Conditions of all ranks form
one list, and the place of a condition in it is its *slot*. Conditions are in the order of the
nodes' original numbers, or of the list of points that asked for them: no number of ranks changes
it. For that the numbers alone are gathered, 8 bytes a condition on every rank; what belongs to
nodes stays with their owners, but for the two sides of a pair of bodies, which every rank searches
for partners: some 120 bytes a node in space with its share of facets, 25 MB for two sides of 10⁵
nodes (``pairs.side_of``).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from typing import Any, Self, cast

import numpy as np

from ...core.algebra import Array, Comm, Indices, Mask, from_each, largest
from ...core.collective import together


def gather_rows(comm: Comm, *arrays: Any) -> tuple[Any, ...]:
    """Return arrays of rows, each with the rows of all ranks, on every rank. Collective."""
    parts = from_each(comm, arrays)
    return tuple(np.concatenate(array) for array in zip(*parts, strict=True))


class Rows:
    """Take rows out of a table, a dataclass of arrays with one row for each thing, and join tables.

    A dataclass that inherits from this holds such arrays and nothing else.
    """

    @classmethod
    def join(cls, parts: Sequence[Self]) -> Self:
        """Return the rows of all parts, one part after the other."""
        columns = []
        for column in fields(cast(Any, cls)):
            columns.append(np.concatenate([getattr(part, column.name) for part in parts]))
        return cls(*columns)

    def pick(self, rows: Any) -> Self:
        """Return the table of these rows: numbers of rows in the order wanted, or a mask."""
        columns = [getattr(self, column.name)[rows] for column in fields(cast(Any, self))]
        return type(self)(*columns)


@dataclass(frozen=True, eq=False)
class Nodes(Rows):
    """Hold k nodes of a boundary, those of this rank or all.

    A node may have several rows, one for each of its faces (``faces.split_at_corners``).

    Attributes:
        numbers: (k,) their numbers (``mesh.numbering``), the same on any number of ranks.
        points: (k, d) coordinates [m].
        normals: (k, d) outward unit normals of the body.
        weights: (k,) shares of the boundary, ∫ phi_i [m], [m²], without the thickness.
        held: (k, d) which components are prescribed.
        unknowns: (k, d) numbers of their free unknowns over all ranks, -1 for held ones.
    """

    numbers: Indices
    points: Array
    normals: Array
    weights: Array
    held: Mask
    unknowns: Indices


def join_nodes(parts: Sequence[Nodes]) -> Nodes:
    """Return the nodes of all parts, one part after the other."""
    return Nodes.join(parts)


def everywhere(comm: Comm, nodes: Nodes) -> Nodes:
    """Return the nodes of all ranks on every rank, ordered by their numbers. Collective.

    This takes about 90 bytes for each in space.
    """
    every = join_nodes(from_each(comm, nodes))
    return every.pick(np.argsort(every.numbers))


def slots_of(comm: Comm, keys: Indices) -> Indices:
    """Return the slots (m,) of this rank's conditions: their places among the keys of all ranks.

    Collective.

    Args:
        comm: the ranks.
        keys: (m,) what orders the conditions, ascending. Conditions of one node have equal keys,
            which are all on one rank and get slots in a row.
    """
    every = np.sort(np.concatenate(from_each(comm, keys)))
    # the slot of the first condition with this key, and how many of them are before here
    first = np.searchsorted(every, keys)
    before = np.arange(len(keys)) - np.searchsorted(keys, keys)
    return np.asarray(first + before)


def ask_alike(
    comm: Comm, slots: Indices, ask: Callable[..., tuple[Any, ...]], *values: Any
) -> tuple[Any, ...]:
    """Return what ``ask`` answers for this rank's rows of the values. Collective.

    Where it raises on some rank it is asked for the rows of all, in the order of their slots, so
    that all ranks raise what one rank alone would.

    Args:
        comm: the ranks.
        slots: (m,) numbers of this rank's rows among those of all ranks.
        ask: a function of the values of some rows, which returns arrays with a row for each.
        *values: arrays (m, …) of this rank's rows.

    Returns:
        the arrays of ``ask`` (m, …).

    Raises:
        InputError: what ``ask`` raises, on all ranks.
    """
    if comm.size == 1:
        return ask(*values)
    answer = ()
    failed = False
    try:
        answer = ask(*values)
    except Exception:  # also of a user's function: the other ranks must not wait for this one
        failed = True
    if not largest(comm, failed):
        return answer

    # some rank failed: every rank asks for all rows, as one rank alone would
    every_slot, *every = gather_rows(comm, slots, *values)
    order = np.argsort(every_slot)
    rows = [array[order] for array in every]
    # a function that depends on the rank may fail on one, and not on the others
    with together(comm):
        whole = ask(*rows)
    return tuple(array[slots] for array in whole)
