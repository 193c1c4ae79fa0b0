"""Tie boundaries whose opposite nodes move together, as the sides of one period of a body.

    u(x) = u(x + a),  x on the first boundary, a the distance between the two

The nodes of the second boundary are eliminated: P of u_full = P u_free + U gets, in their rows, the
ones of their partners, and Pᵀ adds their forces to them. Exact, no penalty. Tied sides reproduce
the one-dimensional motion of a layered soil exactly and send every other wave through: what leaves
on the right comes back in from the left. Source: Zienkiewicz, Bicanic and Shen (1988); compared
with others by Kontoe et al. (2007).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...core.algebra import Array, Indices
from ...core.checks import describe_point
from ...core.errors import InputError
from ...meshes.rows import number_parts
from ..mesh.group_checks import check_components, components_of, facets_of
from ..mesh.tagged_mesh import Facets

# of the body's size: a node that is farther from where its partner should be has none
PLACE_TOLERANCE = 1e-6
# original numbers (k,), ascending, and points (k, d) [m] of the nodes of a boundary
Nodes = tuple[Indices, Array]


@dataclass(frozen=True)
class Tied:
    """Tie the nodes of a boundary to those of another one that face them. Ties may meet.

    Args:
        first: a boundary.
        second: another one, of the same shape and mesh, whose nodes follow those of the first.
        components: in which their displacements are the same; all when None.
    """

    first: Facets
    second: Facets
    components: tuple[int, ...] | None = None

    def __post_init__(self) -> None:
        for name in ("first", "second"):
            facets_of("Tied", name, getattr(self, name))
        check_components("Tied", self.components)


@dataclass(frozen=True, eq=False)
class Links:
    """Hold unknowns that move as others do, the same arrays on every rank.

    An unknown is node number * d + component.

    Attributes:
        followers: (k,) unknowns that are eliminated.
        leaders: (k,) the unknown that each of them follows; none of them follows another.
    """

    followers: Indices
    leaders: Indices

    def of_nodes(self, d: int) -> dict[int, int]:
        """Return the node that each tied node follows in all d components.

        Leaders follow themselves, and -1 stands for nodes that are tied in part.
        """
        nodes = np.column_stack([self.followers, self.leaders]) // d
        pairs, count = np.unique(nodes, axis=0, return_counts=True)
        whole = pairs[count == d]
        # what is known of a node replaces what stood there before
        node_of = dict.fromkeys(nodes.ravel().tolist(), -1)
        node_of |= dict(whole[:, [1, 1]].tolist())
        node_of |= dict(whole.tolist())
        return node_of


UNTIED = Links(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))


def link(
    tied: Sequence[Tied], sides: Sequence[tuple[Nodes, Nodes]], dimension: int, near: float
) -> Links:
    """Join the unknowns of every tie.

    What several ties join moves as one: of the four vertical edges of a box whose sides are tied
    both ways, three follow the one that is on no second boundary.

    Args:
        tied: at least one tie.
        sides: the nodes of both boundaries of each tie, the same on every rank.
        dimension: d, components of a node.
        near: how far a partner may be from the place that it should have [m].

    Returns:
        the links of all ties.

    Raises:
        InputError: nodes without a partner, boundaries that share nodes, and a component that does
            not exist.
    """
    pairs = [_pair(tie, *both, dimension, near) for tie, both in zip(tied, sides, strict=True)]
    first, second = (np.concatenate(side) for side in zip(*pairs, strict=True))
    # what hangs together through ties is one part, and moves as one: its leader is the least
    # unknown that is on no second boundary, or the least of all
    members, index = np.unique(np.concatenate([first, second]), return_inverse=True)
    part = number_parts(len(members), *index.ravel().reshape(2, -1))
    order = np.lexsort((members, np.isin(members, second), part))
    _, start = np.unique(part[order], return_index=True)
    leaders = members[order[start]][part]
    follows = leaders != members
    return Links(members[follows], leaders[follows])


def _pair(
    tie: Tied, first: Nodes, second: Nodes, dimension: int, near: float
) -> tuple[Indices, Indices]:
    """Return the unknowns (k,) of the first boundary, and those of the second that move alike.

    Args:
        tie: the boundaries and components.
        first: nodes of the first boundary.
        second: nodes of the second one.
        dimension: d, components of a node.
        near: how far a partner may be from its place [m].

    Raises:
        InputError: boundaries that are not meshed alike, or share a node.
    """
    names = f"'{tie.first.name}' and '{tie.second.name}'"
    if len(first[0]) != len(second[0]) or not len(first[0]):
        raise InputError(
            f"tied boundaries {names} have {len(first[0])} and {len(second[0])} nodes: mesh them "
            "alike"
        )
    for shared in first[1][np.isin(first[0], second[0])]:
        raise InputError(
            f"tied boundaries {names} share the node {describe_point(shared)}: tie boundaries "
            "without common nodes"
        )
    from scipy.spatial import cKDTree  # late: most bodies have no ties

    # a partner is the node next to where the first boundary, moved as a whole, has its node
    apart = second[1].mean(axis=0) - first[1].mean(axis=0)
    distance, partner = cKDTree(second[1]).query(first[1] + apart)
    worst = int(distance.argmax())
    if distance[worst] > near or len(set(partner)) < len(partner):
        raise InputError(
            f"node {describe_point(first[1][worst])} of tied boundaries {names} has no partner "
            "opposite it on the other: mesh both sides alike"
        )
    components = np.array(components_of("tied", tie.components, dimension))
    own = first[0][:, None] * dimension + components
    others = second[0][partner][:, None] * dimension + components
    return own.ravel(), others.ravel()
