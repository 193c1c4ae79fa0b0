"""Say what became of every node of a contact boundary: with a condition, left out, or in doubt.

``vi-contact run --check``, the log, the report and the picture of a model all read this one record, so that they
say the same.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from .algebra import Array


@dataclass(frozen=True)
class Census:
    """Count the nodes of one contact boundary and hold the places of those that are not plain contact points.

    Args:
        name: the boundary, as the user named it; of a pair, that of side 1.
        nodes: number of nodes of the boundary on all ranks.
        points: number of contact conditions on all ranks. A node at an edge has one for each of its faces.
        places: kind of node -> coordinates (k, d) [m] of all nodes of this kind, on all ranks alike, ordered by node
            number. A kind says in a few words what became of the node, as in "shared by both sides", "clamped",
            "prescribed", "faces nothing", "partly covered".
    """

    name: str
    nodes: int
    points: int
    places: Mapping[str, Array] = field(default_factory=dict)
