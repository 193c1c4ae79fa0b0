"""Watch the nodes of a contact boundary that are prescribed in every component.

No solver can keep such a node off an obstacle, so that it has no condition. Where it is depends on
the time alone. Its gap along the direction n, in front of nodes j that are prescribed too,

    g_s(t) = gap0_s - n·(U_s(t) - sum_j P_sj U_j(t))

less what a moving obstacle advances, counts in the smallest gap of the contact, and a motion that
drives the node into what it faces is refused. Nodes in front of free ones are no matter of this
file: ``pairs`` refuses them.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any

import numpy as np

from ...core.algebra import Array, Mask, from_each, largest
from ...core.checks import describe_point
from ...core.errors import InputError
from .conditions import Facing
from .nodes import Nodes

ROUND_OFF = 1e-9  # of the largest motion and gap of the nodes


@dataclass(frozen=True, eq=False)
class Watched:
    """Hold k nodes of this rank without conditions.

    Attributes:
        space: the body's unknowns.
        name: that of their boundary.
        nodes: the nodes.
        directions: (k, d) unit vectors n towards what they face.
        gap0: (k,) gaps at rest [m].
        facing: nodes of side 2 that they face, all prescribed; None before a rigid obstacle.
        side: name of side 2, None before a rigid obstacle.
        advance: t [s] -> how far a moving obstacle has come towards them, (k,) or one number [m];
            minus infinity where it is not known.
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
        """Return the same nodes before an obstacle that moves.

        Args:
            towards: t [s] -> how far it moves towards all conditions [m], None where it does not
                move. Where it gives a value for each condition, it is not known how far the
                obstacle moves at nodes without one, and these count as far away.
        """
        if towards is None:
            return self

        def advance(t: float) -> float:
            value = np.asarray(towards(t))
            return float(value.ravel()[0]) if value.size == 1 else -np.inf

        return replace(self, advance=advance)

    def carry(self, ground: Callable[[float], Array]) -> "Watched":
        """Return the same nodes before an obstacle that the ground carries, t [s] -> (d,) [m]."""
        if self.facing is not None:
            return self
        return replace(self, advance=lambda t: -self.directions @ ground(t))

    def gaps(self, t: float) -> Array:
        """Return the gaps (k,) at time t [m]. Collective."""
        return self.gap0 - self._towards(t)[0]

    def smallest(self, t: float) -> float:
        """Return the smallest gap of the nodes of all ranks at time t [m], infinite for none.

        Collective.
        """
        return -largest(self.space.comm, np.max(-self.gaps(t), initial=-np.inf))

    def refuse_driven(self, t: float) -> None:
        """Raise InputError, on all ranks, for a node that is in what it faces at time t [s].

        Collective.
        """
        moved, motion = self._towards(t)
        depths = moved - self.gap0
        size = np.append(self.gap0, motion).max()
        least = largest(self.space.comm, size) * ROUND_OFF
        if largest(self.space.comm, np.max(depths, initial=-np.inf)) <= least:
            return
        # the deepest node of all ranks, of several the one of least number
        own = [
            (float(depths[row]), -int(self.nodes.numbers[row]), self.nodes.points[row])
            for row in np.flatnonzero(depths > least)
        ]
        driven = list(chain(*from_each(self.space.comm, own)))
        depth, _, point = max(driven, key=lambda node: node[:2])
        obstacle = "its obstacle" if self.side is None else f"'{self.side}'"
        raise InputError(
            f"contact node {describe_point(point)} of '{self.name}' is prescribed in every "
            f"component and is "
            f"driven {depth:.3g} m into {obstacle} at t = {t:.6g} s: prescribe a motion that keeps "
            "off, or only the components at right angles to its contact direction"
        )

    def _towards(self, t: float) -> tuple[Array, float]:
        """Return how far the nodes have moved towards what they face (k,) [m]. Collective.

        The largest displacement of this rank [m] is returned too: what is round-off beside it
        counts as nothing.
        """
        space = self.space
        values = np.asarray(space.evaluate_prescribed(t)).reshape(-1, space.dimension)
        moved = values[space.blocks_of(self.nodes.numbers)]
        size = np.abs(moved).max(initial=0.0)
        if self.facing is not None:
            moved = moved - self.facing.P @ space.at_nodes(self.facing.nodes.numbers, values)
        towards = np.sum(moved * self.directions, axis=1)
        if self.advance is not None:
            towards = towards + self.advance(t)
        return towards, float(size)


def watch_nodes(
    space: Any,
    name: str,
    nodes: Nodes,
    directions: Array,
    gap0: Array,
    facing: Facing | None = None,
    side: str | None = None,
) -> tuple[Watched, ...]:
    """Return what watches these nodes: nothing where no rank has any, or all stand still.

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
    """Sort nodes that are held in every component into those at rest and those that are moved.

    Args:
        space: the body's unknowns.
        nodes: k nodes of a boundary.
        mask: (k,) which of them are held in every component.

    Returns:
        "prescribed" -> (k,) mask of those of this rank that some condition moves, "fixed" -> the
        others in ``mask``.
    """
    moved = np.zeros(len(space.nodes), dtype=bool)
    for support in space.supports:
        if support.moves:
            moved[support.places[0]] = True
    blocks = space.blocks_of(nodes.numbers)
    here = np.flatnonzero(mask & (blocks >= 0))  # a rank may have no nodes
    driven = np.zeros(len(blocks), dtype=bool)
    driven[here] = moved[blocks[here]]
    return {"fixed": mask & ~driven, "prescribed": driven}
