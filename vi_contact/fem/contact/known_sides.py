"""Know at once what the sides of many pairs need of the whole mesh.

An assembly goes over the whole mesh and looks up its compiled form, whatever the facets are. Sides
that share no node are integrated together, so that a wall takes as few assemblies as sides meet at
a node, not two for each side of each joint. The sums at a node are those of its side alone, in the
same order, so that no digit changes.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...core.algebra import Array, Indices, from_each
from ..body.space import FemSpace
from ..mesh.tagged_mesh import Facets
from .faces import integrate_nodal
from .hinges import find_hinges


@dataclass(frozen=True, eq=False)
class KnownSides:
    """Hold the nodal integrals of sides, and the hinges among their nodes.

    Attributes:
        sides: the sides.
        classes: the class of each; sides of one class share no node.
        integrals: of each class ``integrate_nodal`` (owned nodes, 1 + d) over all its sides.
        hinges: numbers of the nodes that are hinges (``find_hinges``).
    """

    sides: tuple[Facets, ...]
    classes: Indices
    integrals: tuple[Array, ...]
    hinges: Indices

    def find_integrals(self, facets: Facets) -> Array | None:
        """Return ``integrate_nodal`` of a side, right at its own nodes; None for another one."""
        row = self._places.get(id(facets))
        return None if row is None else self.integrals[self.classes[row]]

    @cached_property
    def _places(self) -> dict[int, int]:
        """Return the place of each side by its identity; ``sides`` keeps them alive."""
        return {id(side): row for row, side in enumerate(self.sides)}


def know_sides(space: FemSpace, sides: Sequence[Facets]) -> KnownSides:
    """Integrate over all sides, and find their hinges. Collective.

    Args:
        space: the bodies' unknowns.
        sides: those of all pairs.
    """
    nodes = [np.unique(space.corners_of_facets(side.indices)) for side in sides]
    parts = from_each(space.comm, nodes)
    whole = [np.unique(np.concatenate([part[row] for part in parts])) for row in range(len(sides))]
    classes = _classify(whole)
    integrals = []
    for number in range(int(classes.max(initial=-1)) + 1):
        members = np.flatnonzero(classes == number)
        facets = np.unique(np.concatenate([sides[member].indices for member in members]))
        integrals.append(integrate_nodal(space, facets))
    every = np.unique(np.concatenate(whole))
    return KnownSides(tuple(sides), classes, tuple(integrals), find_hinges(space, every))


def _classify(nodes: Sequence[Indices]) -> Indices:
    """Return a class (k,) of each side, the first that no side before it at its nodes has.

    Args:
        nodes: numbers of the nodes of each side.
    """
    classes = np.zeros(len(nodes), dtype=np.int64)
    taken: dict[int, set[int]] = {}
    for row, numbers in enumerate(nodes):
        around = [taken.setdefault(number, set()) for number in numbers.tolist()]
        used = set().union(*around)
        classes[row] = next(number for number in range(len(used) + 1) if number not in used)
        for there in around:
            there.add(int(classes[row]))
    return classes
