"""Tie boundaries whose opposite nodes move together, as the sides of one period of a body.

    u(x) = u(x + a),  x on the first boundary, a the distance between the two

The nodes of the second boundary are eliminated: P of u_full = P u_free + U gets, in their rows, the
ones of their partners, and Pᵀ adds their forces to them. Exact, no penalty. Tied sides reproduce
the one-dimensional motion of a layered soil exactly and send every other wave through: what leaves
on the right comes back in from the left. Source: Zienkiewicz, Bicanic and Shen (1988); compared
with others by Kontoe et al. (2007).

Boundaries that are not meshed alike are tied in the mean (``Tied.matching``, ``blending``).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...core.algebra import Indices
from ...core.checks import describe_point
from ...core.errors import InputError
from ...meshes.rows import number_parts
from ..mesh.group_checks import check_components, components_of, facets_of
from ..mesh.tagged_mesh import Facets
from .blending import NO_BLENDS, Blends, Coupling, TiedSide, blend

# of the body's size: a node that is farther from where its partner should be has none
PLACE_TOLERANCE = 1e-6


@dataclass(frozen=True)
class Tied:
    """Tie the nodes of a boundary to those of another one that face them. Ties may meet.

    Without ``matching`` both are meshed alike, and each node of the second one moves as its partner
    does. With ``matching=DualMortar()`` they may be meshed in any way: nodes of one follow the
    other in the mean over what both have in common, which are the nodes of the second one unless
    the first is covered better. A constant stress passes through plane boundaries, and through
    others that lie in each other, as through one mesh. Forces and moments balance on all.

    Args:
        first: a boundary.
        second: another one, whose nodes follow those of the first; of the same shape.
        components: in which their displacements are the same; all when None.
        matching: ``DualMortar()`` for boundaries that are not meshed alike.
    """

    first: Facets
    second: Facets
    components: tuple[int, ...] | None = None
    matching: Coupling | None = None

    def __post_init__(self) -> None:
        for name in ("first", "second"):
            facets_of("Tied", name, getattr(self, name))
        check_components("Tied", self.components)
        if self.matching is not None and not isinstance(self.matching, Coupling):
            raise InputError(
                "Tied: matching must be DualMortar() or None, got "
                f"{type(self.matching).__name__}: leave it out for sides that are meshed alike"
            )


@dataclass(frozen=True, eq=False)
class Links:
    """Hold unknowns that move as others do, the same arrays on every rank.

    An unknown is node number * d + component.

    Attributes:
        followers: (k,) unknowns that are eliminated.
        leaders: (k,) the unknown that each of them follows; none of them follows another.
        blends: unknowns that follow several others.
    """

    followers: Indices
    leaders: Indices
    blends: Blends = NO_BLENDS

    def of_nodes(self, d: int) -> dict[int, int]:
        """Return the node that each tied node follows in all d components.

        Leaders follow themselves, and -1 stands for nodes that are tied in part, or to several.
        """
        nodes = np.column_stack([self.followers, self.leaders]) // d
        pairs, count = np.unique(nodes, axis=0, return_counts=True)
        whole = pairs[count == d]
        # what is known of a node replaces what stood there before
        node_of = dict.fromkeys(nodes.ravel().tolist(), -1)
        node_of |= dict(whole[:, [1, 1]].tolist())
        node_of |= dict(whole.tolist())
        return node_of | dict.fromkeys((self.blends.followers // d).tolist(), -1)


UNTIED = Links(np.zeros(0, dtype=np.int64), np.zeros(0, dtype=np.int64))


def link(
    tied: Sequence[Tied], sides: Sequence[tuple[TiedSide, TiedSide]], dimension: int, size: float
) -> Links:
    """Join the unknowns of every tie.

    What several ties join moves as one: of the four vertical edges of a box whose sides are tied
    both ways, three follow the one that is on no second boundary.

    Args:
        tied: at least one tie.
        sides: both boundaries of each tie, the same on every rank.
        dimension: d, components of a node.
        size: that of the body [m].

    Returns:
        the links of all ties.

    Raises:
        InputError: nodes without a partner, boundaries that share nodes, and a component that does
            not exist.
    """
    near = PLACE_TOLERANCE * size
    alike = [place for place, tie in enumerate(tied) if tie.matching is None]
    pairs = [_pair(tied[place], *sides[place], dimension, near) for place in alike]
    couplings = []
    for place, tie in enumerate(tied):
        if tie.matching is not None:
            others = [side for at, both in enumerate(sides) if at != place for side in both]
            components = np.array(components_of("tied", tie.components, dimension))
            couplings.append((tie.matching, sides[place], others, components))
    meant = [blend(*coupling, near) for coupling in couplings]
    pairs += [mean.pairs for mean in meant]
    first, second = (np.concatenate(side) for side in zip(*pairs, strict=True))
    # what hangs together through ties is one part, and moves as one: its leader is the least
    # unknown that is on no second boundary, or the least of all
    members, index = np.unique(np.concatenate([first, second]), return_inverse=True)
    part = number_parts(len(members), *index.ravel().reshape(2, -1))
    order = np.lexsort((members, np.isin(members, second), part))
    _, start = np.unique(part[order], return_index=True)
    leaders = members[order[start]][part]
    follows = leaders != members
    one = Links(members[follows], leaders[follows])
    if not meant:
        return one
    held = [side.held_unknowns for both in sides for side in both]
    blends = Blends.join(meant, one.followers, one.leaders, held)
    single = ~np.isin(one.followers, blends.followers)
    return Links(one.followers[single], one.leaders[single], blends)


def _pair(
    tie: Tied, first: TiedSide, second: TiedSide, dimension: int, near: float
) -> tuple[Indices, Indices]:
    """Return the unknowns (k,) of the first boundary, and those of the second that move alike.

    Args:
        tie: the boundaries and components.
        first: the first boundary.
        second: the second one.
        dimension: d, components of a node.
        near: how far a partner may be from its place [m].

    Raises:
        InputError: boundaries that are not meshed alike, or share a node.
    """
    names = f"'{tie.first.name}' and '{tie.second.name}'"
    unlike = "mesh both sides alike, or give matching=DualMortar()"
    count = len(first.numbers)
    if len(second.numbers) != count or not count:
        raise InputError(
            f"tied boundaries {names} have {count} and {len(second.numbers)} nodes: {unlike}"
        )
    for shared in first.points[np.isin(first.numbers, second.numbers)]:
        raise InputError(
            f"tied boundaries {names} share the node {describe_point(shared)}: tie boundaries "
            "without common nodes"
        )
    from scipy.spatial import cKDTree  # late: most bodies have no ties

    # a partner is the node next to where the first boundary, moved as a whole, has its node
    apart = second.points.mean(axis=0) - first.points.mean(axis=0)
    distance, partner = cKDTree(second.points).query(first.points + apart)
    worst = int(distance.argmax())
    if distance[worst] > near or len(set(partner)) < len(partner):
        raise InputError(
            f"node {describe_point(first.points[worst])} of tied boundaries {names} has no partner "
            f"opposite it on the other: {unlike}"
        )
    components = np.array(components_of("tied", tie.components, dimension))
    own = first.numbers[:, None] * dimension + components
    others = second.numbers[partner][:, None] * dimension + components
    return own.ravel(), others.ravel()
