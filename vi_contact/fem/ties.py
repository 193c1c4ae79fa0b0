"""Tie boundaries whose opposite nodes move together: tied sides of a soil layer, one period of a periodic body.

    u(x) = u(x + a),  x on the first boundary, a the distance between the two

The nodes of the second boundary are eliminated: P of u_full = P u_free + U gets, in their rows, the ones of their
partners, and Pᵀ adds their forces to them. Exact, no penalty. Tied sides reproduce the one-dimensional motion of a
layered soil exactly and send every other wave through: what leaves on the right comes back in from the left.
Source: Zienkiewicz, Bicanic and Shen (1988); compared with others by Kontoe et al. (2007).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ..core.algebra import Array, Indices
from ..core.checks import at
from ..core.errors import InputError
from .groups import components_given, components_of, facets_of
from .mesh import Facets

PLACE_TOLERANCE = 1e-6  # of the body's size: nodes farther from the place of their partner have none
NodesOf = Callable[[Facets], tuple[Indices, Array]]  # original numbers, ascending, and points of nodes, on every rank


@dataclass(frozen=True)
class Tied:
    """Tie the nodes of ``second`` to those of ``first`` that face them: in all components, or in those given."""

    first: Facets
    second: Facets
    components: tuple[int, ...] | None = None

    def __post_init__(self) -> None:
        for name in ("first", "second"):
            facets_of("Tied", name, getattr(self, name))
        components_given("Tied", self.components)


@dataclass(frozen=True, eq=False)
class Pairs:
    """Hold the original numbers of nodes that move together, the same on every rank; ``components`` they share."""

    first: Indices
    second: Indices
    components: tuple[int, ...]


def paired(tied: Sequence[Tied], dimension: int, near: float, nodes: NodesOf) -> list[Pairs]:
    """Pair the nodes of every tie, those that are ``near`` [m] to the place of their partner. Collective.

    InputError when nodes have no partner, when a node is tied twice, or a component that does not exist.
    """
    found = [_pairs(tie, dimension, near, nodes) for tie in tied]
    seconds = [number * dimension + c for one in found for number in one.second for c in one.components]
    firsts = [number * dimension + c for one in found for number in one.first for c in one.components]
    if len(set(seconds)) < len(seconds) or set(seconds) & set(firsts):
        raise InputError("a node is on several tied boundaries: tie a corner once, and no boundary to two others")
    return found


def _pairs(tie: Tied, dimension: int, near: float, nodes: NodesOf) -> Pairs:
    first, second = nodes(tie.first), nodes(tie.second)
    names = f"'{tie.first.name}' and '{tie.second.name}'"
    if len(first[0]) != len(second[0]) or not len(first[0]):
        raise InputError(f"tied boundaries {names} have {len(first[0])} and {len(second[0])} nodes: mesh them alike")
    apart = second[1].mean(axis=0) - first[1].mean(axis=0)
    distance = np.linalg.norm(first[1][:, None] + apart - second[1][None, :], axis=2)
    partner = distance.argmin(axis=1)
    worst = int(distance.min(axis=1).argmax())
    if distance[worst, partner[worst]] > near or len(set(partner)) < len(partner):
        raise InputError(f"node {at(first[1][worst])} of tied boundaries {names} has no partner at the same height on "
                         "the other: mesh both sides alike")
    return Pairs(first[0], second[0][partner], components_of("tied", tie.components, dimension))
