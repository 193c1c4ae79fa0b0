"""Count the nodes of a contact boundary by what became of them: the `Census` of a surface."""

import logging
from collections.abc import Mapping

import numpy as np

from ...core.algebra import Array, Comm, Mask, total
from ...core.census import Census
from .nodes import Nodes, gather_rows

log = logging.getLogger(__name__)


def census_on_ranks(
    comm: Comm, name: str, nodes: Nodes, kinds: Mapping[str, Mask], points: int
) -> Census:
    """Return the census of a boundary whose ``nodes`` are those of this rank only. Collective.

    Args:
        comm: the ranks that share the boundary.
        name: of the boundary.
        nodes: those of this rank.
        kinds: kind -> mask (k,) of the nodes of this rank that are of this kind.
        points: number of contact conditions on this rank.
    """
    return Census(
        name=name,
        nodes=round(total(comm, len(nodes.numbers))),
        points=round(total(comm, points)),
        places=_drop_empty(
            {kind: _gather_points(comm, nodes.pick(mask)) for kind, mask in kinds.items()}
        ),
    )


def census_of_all(name: str, nodes: Nodes, kinds: Mapping[str, Mask], points: int) -> Census:
    """Return the census of a boundary whose ``nodes``, ordered by number, every rank has.

    Args:
        name: of the boundary.
        nodes: those of all ranks, ordered by number.
        kinds: kind -> mask (k,) of the nodes that are of this kind.
        points: number of contact conditions on all ranks.
    """
    places = {kind: nodes.points[mask] for kind, mask in kinds.items()}
    return Census(name, len(nodes.numbers), points, _drop_empty(places))


def tell(comm: Comm, census: Census) -> None:
    """Log, on rank 0, what became of the nodes of a boundary, unless all are contact points."""
    if census.places and comm.rank == 0:
        log.info("contact on '%s': %s", census.name, census.in_words())


def _gather_points(comm: Comm, nodes: Nodes) -> Array:
    """Return the points (k, d) of the nodes of all ranks, by their numbers. Collective."""
    numbers, points = gather_rows(comm, nodes.numbers, nodes.points)
    return np.asarray(points[np.argsort(numbers)])


def _drop_empty(places: Mapping[str, Array]) -> dict[str, Array]:
    """Return the kinds of which there are nodes, and where these are."""
    return {kind: points for kind, points in places.items() if len(points)}
