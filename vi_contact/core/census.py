"""Say what became of every node of a contact boundary: with a condition, left out, or in doubt.

``vi-contact run --check``, the log, the report and the picture of a model all read this one record,
so that they say the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from .algebra import Array
from .checks import describe_point

NAMED = 3  # places of a kind that are named
# kind -> what that means for the conditions
MEANINGS = {
    "shared by both sides": "joined there",
    "fixed": "left out",
    "prescribed": "left out",
    "tied to another": "one condition with it",
    "not listed": "left out",
    "in front of nothing": "left out",
    "partly covered": "carried by their neighbours",
    "hardly covered": "pressures left out of the largest",
}


@dataclass(frozen=True)
class Census:
    """Count the nodes of one contact boundary by their kinds, and say where the odd ones are.

    Args:
        name: the boundary, as the user named it; of a pair, that of side 1.
        nodes: number of nodes of the boundary on all ranks.
        points: number of contact conditions on all ranks. A node at an edge has one for each of its
            faces.
        places: kind of node -> coordinates (k, d) [m] of all nodes of this kind, on all ranks
            alike, ordered by node number. A kind says in a few words what became of the node, as in
            "shared by both sides", "fixed", "prescribed", "in front of nothing", "partly
            covered".
    """

    name: str
    nodes: int
    points: int
    places: Mapping[str, Array] = field(default_factory=dict)

    def in_words(self) -> str:
        """Return how many points of how many nodes there are, and each kind with first places."""
        kinds = [self._describe(kind, points) for kind, points in self.places.items()]
        return "; ".join([f"{self.points} points of {self.nodes} nodes", *kinds])

    def _describe(self, kind: str, points: Array) -> str:
        """Return how many nodes of a kind there are, and the first places of theirs (k, d) [m]."""
        meaning = f" ({MEANINGS[kind]})" if kind in MEANINGS else ""
        named = ", ".join(map(describe_point, points[:NAMED]))
        more = f" and {len(points) - NAMED} more places" if len(points) > NAMED else ""
        nodes = "1 node" if len(points) == 1 else f"{len(points)} nodes"
        return f"{nodes} {kind}{meaning}, at {named}{more}"
