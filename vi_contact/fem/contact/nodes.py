"""Hold nodes of a contact boundary, and ask of all ranks what is known of them on each.

Conditions are numbered in the order of the nodes' original numbers, or of the list of points that
asked for them: no number of ranks changes it. For that the numbers alone are gathered, 8 bytes a
condition on every rank; what belongs to nodes stays with their owners, but for the two sides of a
pair of bodies, which every rank searches for partners: some 120 bytes a node in space with its
share of facets, 25 MB for two sides of 10⁵ nodes (``pairs.side_of``).
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
    """Take rows out of all arrays of a dataclass that holds nothing else, and join them."""

    @classmethod
    def join(cls, parts: Sequence[Self]) -> Self:
        """Return the rows of all parts, one part after the other."""
        names = [each.name for each in fields(cast(Any, cls))]
        arrays = [[getattr(part, name) for part in parts] for name in names]
        return cls(*map(np.concatenate, arrays))

    def pick(self, rows: Any) -> Self:
        """Return what is in these rows."""
        return type(self)(*(getattr(self, each.name)[rows] for each in fields(cast(Any, self))))


@dataclass(frozen=True, eq=False)
class Nodes(Rows):
    """Hold k nodes of a boundary, those of this rank or all.

    Attributes:
        numbers: (k,) their original numbers.
        points: (k, d) coordinates [m].
        normals: (k, d) outward unit normals of the body.
        weights: (k,) shares of the boundary [m], [m²].
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
    """Return the nodes of all ranks on every rank, by their numbers. Collective.

    It takes about 90 bytes for each in space.
    """
    every = join_nodes(from_each(comm, nodes))
    return every.pick(np.argsort(every.numbers))


def slots_of(comm: Comm, keys: Indices) -> Indices:
    """Return the places (m,) of this rank's ascending keys among all; equal ones are of one rank.

    Collective.
    """
    every = np.sort(np.concatenate(from_each(comm, keys)))
    return np.asarray(
        np.searchsorted(every, keys) + np.arange(len(keys)) - np.searchsorted(keys, keys)
    )


def ask_alike(
    comm: Comm, slots: Indices, ask: Callable[..., tuple[Any, ...]], *values: Any
) -> tuple[Any, ...]:
    """Return what ``ask`` answers for this rank's rows of the values.

    Where it raises on some rank it is asked for the rows of all, in the order of their slots, so
    that all ranks raise what one rank alone would. Collective.

    Args:
        comm: the ranks.
        slots: (m,) numbers of this rank's rows among those of all ranks.
        ask: a function of the values of some rows.
        *values: arrays (m, …) of this rank's rows.
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
    every_slot, *every = gather_rows(comm, slots, *values)
    order = np.argsort(every_slot)
    rows = [array[order] for array in every]
    # a function that depends on the rank may fail on one, and not on the others
    with together(comm):
        whole = ask(*rows)
    return tuple(array[slots] for array in whole)
