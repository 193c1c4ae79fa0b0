"""Watch the nodes of a contact boundary that have no condition.

They are prescribed in every component.

Where they are depends on the time alone. The gap of such a node s with the direction n, in front of
nodes j that are prescribed too,

    g_s(t) = gap0_s - n·(U_s(t) - sum_j P_sj U_j(t))

less what a moving obstacle advances, counts in the smallest gap of the contact, and a motion that
drives the node into what it faces is refused.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from ...core.algebra import Array, Mask, from_each, largest
from ...core.checks import at
from ...core.errors import InputError
from .frames import Facing
from .nodes import Nodes

ROUND_OFF = 1e-9  # of the largest motion and gap of the nodes


@dataclass(frozen=True, eq=False)
class Watched:
    """Hold nodes of this rank without conditions on the boundary ``name``.

    This is their directions (k, d) and gaps (k,), and what they face, on side 2 (``side``); None
    where that is a rigid obstacle. ``advance``: how far a moving obstacle has come towards them at
    time t, minus infinity where it is not known.
    """

    space: Any
    name: str
    nodes: Nodes
    directions: Array
    gap0: Array
    facing: Facing | None = None
    side: str | None = None
    advance: Callable[[float], Any] | None = None

    def before_moving(self, towards: Callable[[float], Any] | None) -> "Watched":
        """Return the same nodes before an obstacle that moves towards them, t [s] -> [m].

        Where it moves by another value at every condition it is not known how far it moves at nodes
        without one.
        """
        if towards is None:
            return self

        def advance(t: float) -> float:
            value = np.asarray(towards(t))
            return float(value.ravel()[0]) if value.size == 1 else -np.inf

        return replace(self, advance=advance)

    def carried(self, ground: Callable[[float], Array]) -> "Watched":
        """Return the same nodes before an obstacle that the ground carries, t [s] -> (d,) [m]."""
        return (
            self
            if self.facing is not None
            else replace(self, advance=lambda t: -self.directions @ ground(t))
        )

    def gaps(self, t: float) -> Array:
        """Return the gaps (k,) at time t [m]. Collective."""
        return self.gap0 - self._towards(t)[0]

    def smallest(self, t: float) -> float:
        """Return the smallest gap of the nodes of all ranks at time t [m], infinite for none.

        Collective.
        """
        return -largest(self.space.comm, np.max(-self.gaps(t), initial=-np.inf))

    def refuse_driven(self, t: float) -> None:
        """Raise InputError, on all ranks, for a node that is in what it faces at time t.

        Collective.
        """
        moved, size = self._towards(t)
        behind = moved - self.gap0
        size = np.append(self.gap0, size).max()
        least = largest(self.space.comm, size) * ROUND_OFF
        if largest(self.space.comm, np.max(behind, initial=-np.inf)) <= least:
            return
        own = [
            (float(behind[row]), int(self.nodes.numbers[row]), self.nodes.points[row])
            for row in np.flatnonzero(behind > least)
        ]
        found = [one for part in from_each(self.space.comm, own) for one in part]
        depth, _, point = max(found, key=lambda one: (one[0], -one[1]))
        what = "its obstacle" if self.side is None else f"'{self.side}'"
        raise InputError(
            f"contact node {at(point)} of '{self.name}' is prescribed in every component and is "
            f"driven {depth:.3g} m into {what} at t = {t:.6g} s: prescribe a motion that keeps "
            "off, or only the components at right angles to its contact direction"
        )

    def _towards(self, t: float) -> tuple[Array, float]:
        """Return how far the nodes have moved towards what they face (k,). Collective.

        The largest displacement [m] is returned too.
        """
        space = self.space
        values = np.asarray(space.evaluate_prescribed(t)).reshape(-1, space.dimension)
        moved = values[space.blocks_of(self.nodes.numbers)]
        size = np.abs(moved).max(initial=0.0)
        if self.facing is not None:
            moved = moved - self.facing.P @ space.at_nodes(self.facing.nodes.numbers, values)
        towards = np.sum(moved * self.directions, axis=1)
        return (towards if self.advance is None else towards + self.advance(t)), float(size)


def watch_nodes(
    space: Any,
    name: str,
    nodes: Nodes,
    directions: Array,
    gap0: Array,
    facing: Facing | None = None,
    side: str | None = None,
) -> tuple[Watched, ...]:
    """Return what watches these nodes of this rank; none where nothing moves that is prescribed.

    Collective.

    Args:
        space: the body's unknowns.
        name: that of the boundary.
        nodes: this rank's, held in every component.
        directions: (k, d) towards what they face.
        gap0: (k,) gaps at rest [m].
        facing: nodes of side 2 that they face, None before a rigid obstacle.
        side: name of side 2.
    """
    if not largest(space.comm, len(nodes.numbers)) or not space.moves:
        return ()
    return (Watched(space, name, nodes, directions, gap0, facing, side),)


def sort_held(space: Any, nodes: Nodes, mask: Mask) -> Mapping[str, Mask]:
    """Return kind -> mask (k,) of the nodes in ``mask``.

    They are those of this rank, prescribed in every component: those that some condition moves are
    "prescribed", the others "clamped".

    Args:
        space: the body's unknowns.
        nodes: k nodes of a boundary.
        mask: (k,) which of them.
    """
    moved = np.zeros(len(space.nodes), dtype=bool)
    for support in space.supports:
        if support.moves:
            moved[support.places[0]] = True
    blocks = space.blocks_of(nodes.numbers)
    here = np.flatnonzero(mask & (blocks >= 0))  # a rank may have no nodes
    driven = np.zeros(len(blocks), dtype=bool)
    driven[here] = moved[blocks[here]]
    return {"clamped": mask & ~driven, "prescribed": driven}
