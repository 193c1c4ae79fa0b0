"""Describe a plane body's boundary by closed loops of straight elements.

The mesh comes with its two spaces and the mass matrix between them.

The body lies to the left of its boundary: outer loops run counter-clockwise, holes clockwise, and
the normal points out of the body. `exterior=True` means the unbounded outside of the loops:
everything reversed. Element i starts at node i.

Displacements: continuous P1, values (2, n) (component, node). Tractions: discontinuous P1, values
(2, n, 2) (component, element, end), so that a corner carries two tractions. Flattened in that order
they are the unknowns of the matrices.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike, NDArray

from ..core.algebra import Array
from ..core.arguments import check_arguments
from ..core.checks import (
    array,
    check_count,
    find_shape,
    flag,
    function,
    integers,
    mask,
    number,
    whole,
)
from ..core.errors import InputError
from ..core.quantities import Between, Positive, Unit
from .loops import check_orientation, check_simple, check_size

MOST_ELEMENTS = 3000  # elements: the matrices of one time step take 2 GB
P1_MASS = np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0


@dataclass(frozen=True, eq=False)
class BoundaryMesh:
    """Describe closed loops of straight elements.

    Attributes:
        points: (n, 2) nodes [m], loop after loop, in the direction that keeps the body on the left.
        loop_sizes: number of nodes of each loop; () for one loop of all nodes.
        labels: (n,) integer of each element, to name parts of the boundary; none given is 0.
        exterior: whether the body is the unbounded outside.

    Raises:
        InputError: fewer than three nodes in a loop; elements of no length; a boundary that crosses
            or touches itself, or runs the wrong way round.
    """

    points: Array
    loop_sizes: tuple[int, ...] = ()
    labels: NDArray[np.int64] = field(default_factory=lambda: np.empty(0, np.int64))
    exterior: bool = False

    def __post_init__(self) -> None:
        points = array("BoundaryMesh", "points", self.points, (None, 2), unit="m")
        check_count("BoundaryMesh", "points", len(points), "elements", most=MOST_ELEMENTS)
        given_sizes = integers("BoundaryMesh", "loop_sizes", self.loop_sizes, (None,))
        sizes = tuple(given_sizes.tolist()) or (len(points),)
        if min(sizes) < 3 or sum(sizes) != len(points):
            raise InputError(
                f"BoundaryMesh: loop_sizes is {sizes}; give at least 3 points for each loop, "
                f"and {len(points)} for all loops together"
            )
        flag("BoundaryMesh", "exterior", self.exterior)
        tags = np.zeros(len(points)) if find_shape(self.labels) == (0,) else self.labels
        labels = integers("BoundaryMesh", "labels", tags, (len(points),))
        object.__setattr__(self, "points", points)
        object.__setattr__(self, "loop_sizes", sizes)
        object.__setattr__(self, "labels", labels)
        if self.lengths.min() <= 1e-12 * self.size:
            raise InputError(
                f"BoundaryMesh: element {int(self.lengths.argmin())} has no length; remove doubled "
                "points"
            )
        check_size(points, sizes)
        check_simple(points, self.after)
        check_orientation(points, sizes, exterior=self.exterior)

    def __len__(self) -> int:
        return len(self.points)

    @cached_property
    def after(self) -> NDArray[np.int64]:
        """Return the node (and element) that follows each (n,).

        Element i goes from node i to node after[i].
        """
        after = np.arange(1, len(self.points) + 1)
        ends = np.cumsum(self.loop_sizes)
        after[ends - 1] = ends - self.loop_sizes
        return after

    @cached_property
    def elements(self) -> NDArray[np.int64]:
        """Return the first and the last node of each element (n, 2)."""
        return np.stack([np.arange(len(self.points)), self.after], axis=1)

    @cached_property
    def lengths(self) -> Array:
        """Return the length of each element (n,) [m]."""
        return np.hypot(*(self.points[self.after] - self.points).T)

    @cached_property
    def tangents(self) -> Array:
        """Return the unit tangents (n, 2), tau = (-n_2, n_1), in the direction of the loop."""
        return (self.points[self.after] - self.points) / self.lengths[:, None]

    @cached_property
    def normals(self) -> Array:
        """Return the unit normals (n, 2), out of the body."""
        return np.stack([self.tangents[:, 1], -self.tangents[:, 0]], axis=1)

    @cached_property
    def size(self) -> float:
        """Return the diagonal of the box around the boundary [m]."""
        return float(np.hypot(*np.ptp(self.points, axis=0)))

    @cached_property
    def area(self) -> float:
        """Return the area inside the loops, holes taken off [m²]; negative for an exterior body."""
        return float(0.5 * np.sum(self.lengths * np.sum(self.normals * self.midpoints, axis=1)))

    @cached_property
    def midpoints(self) -> Array:
        """Return the middles of the elements (n, 2) [m]."""
        return 0.5 * (self.points + self.points[self.after])

    @cached_property
    def mass(self) -> Array:
        """Return the mass matrix <u, psi> (4n, 2n) [m].

        Continuous displacements are tested with discontinuous tractions.
        """
        n = len(self)
        mass = np.zeros((2, n, 2, 2, n))
        element = np.arange(n)
        for a in range(2):
            for b in range(2):
                node = self.elements[:, b]
                entry = self.lengths * P1_MASS[a, b]
                for component in range(2):
                    mass[component, element, a, component, node] = entry
        return mass.reshape(4 * n, 2 * n)

    def elements_where(self, chosen: Callable[[Array], ArrayLike]) -> NDArray[np.bool_]:
        """Return the mask (n,) of elements whose ends are both chosen.

        ``chosen`` is a function of points (n, 2) that returns a mask (n,).
        """
        owner = "BoundaryMesh.elements_where"
        function(owner, "chosen", chosen, "give a function of points (m, 2)")
        inside = mask(owner, "what chosen(points) returns", chosen(self.points), (len(self),))
        return inside & inside[self.after]

    def nodes_of(self, elements: ArrayLike) -> NDArray[np.bool_]:
        """Return the mask (n,) of nodes that touch one of the elements of a mask (n,)."""
        chosen = self._mask(elements)
        nodes = chosen.copy()
        nodes[self.after[chosen]] = True
        return nodes

    def node_lengths(self, elements: ArrayLike) -> Array:
        """Return half the lengths of the masked elements that meet at each node (n,) [m]."""
        half = 0.5 * self.lengths * self._mask(elements)
        return half + np.bincount(self.after, half, len(self))

    def node_normals(self, elements: ArrayLike) -> Array:
        """Return unit normals at nodes (n, 2).

        They are the means of the masked elements by their lengths; elsewhere they are zero.
        """
        weighted = self.normals * (self.lengths * self._mask(elements))[:, None]
        of_element_before = [np.bincount(self.after, w, len(self)) for w in weighted.T]
        sums = weighted + np.stack(of_element_before, axis=1)
        length = np.hypot(*sums.T)
        return sums / np.where(length > 0.0, length, 1.0)[:, None]

    def node_turns(self, elements: ArrayLike) -> Array:
        """Return the angle by which the boundary turns at each node (n,) [rad].

        It is taken between two masked elements; elsewhere it is zero.
        """
        chosen = self._mask(elements)
        before = np.empty(len(self), dtype=np.int64)
        before[self.after] = np.arange(len(self))

        # Between unit vectors a and b: tan(angle/2) = |a - b| / |a + b|, exact for small angles.
        difference = self.normals[before] - self.normals
        total = self.normals[before] + self.normals
        turns = 2.0 * np.arctan2(np.hypot(*difference.T), np.hypot(*total.T))
        return np.where(chosen & chosen[before], turns, 0.0)

    def _mask(self, elements: ArrayLike) -> NDArray[np.bool_]:
        """Return a mask of elements (n,), or raise InputError where it is none."""
        return mask("BoundaryMesh", "elements", elements, (len(self),))


def polygon(
    corners: ArrayLike, h: float | Sequence[int], *, exterior: bool = False
) -> BoundaryMesh:
    """Mesh a polygon.

    The label of an element is the number of its side; side i goes from corner i to corner i + 1.

    Args:
        corners: (m, 2) [m], counter-clockwise, or clockwise for an exterior body.
        h: greatest length of an element [m], or the number of elements of every side (m,).
        exterior: whether the body is the unbounded outside.
    """
    start = array("polygon", "corners", corners, (None, 2), unit="m")
    if len(start) < 3:
        raise InputError(f"polygon: corners has {len(start)} points; give three or more")
    sides = np.roll(start, -1, axis=0) - start
    if find_shape(h) != ():
        counts = integers("polygon", "the number of elements of a side", h, (len(start),))
        whole("polygon", "the number of elements of a side", int(counts.min()), least=1)
    else:
        length = number("polygon", "the element length h", h, positive=True, unit="m")
        with np.errstate(over="ignore"):
            numbers = np.maximum(1.0, np.ceil(np.hypot(*sides.T) / length - 1e-9))
        total = float(numbers.sum())
        check_count("polygon", f"h = {length:g} m", total, "elements", most=MOST_ELEMENTS)
        counts = numbers.astype(int)
    check_count("polygon", "h", int(counts.sum()), "elements", most=MOST_ELEMENTS)
    fractions = [np.arange(count)[:, None] / count for count in counts]
    points = [p + f * side for p, f, side in zip(start, fractions, sides, strict=True)]
    labels = np.repeat(np.arange(len(start)), counts)
    return BoundaryMesh(np.concatenate(points), labels=labels, exterior=exterior)


@check_arguments
def circle(
    radius: Annotated[float, Positive, Unit("m")],
    count: Annotated[int, Between(3, math.inf)],
    *,
    centre: ArrayLike = (0.0, 0.0),
    exterior: bool = False,
) -> BoundaryMesh:
    """Mesh a disk by chords, starting at its lowest point.

    Args:
        radius: of the circle on which the nodes lie.
        count: number of chords.
        centre: (2,) [m].
        exterior: whether the body is the space around a round hole instead.
    """
    middle = array("circle", "centre", centre, (2,), unit="m")
    check_count("circle", "count", count, "elements", most=MOST_ELEMENTS)
    once_around = -2.0 * np.pi if exterior else 2.0 * np.pi
    angle = once_around * (np.arange(count) / count) - 0.5 * np.pi
    directions = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    return BoundaryMesh(middle + radius * directions, exterior=exterior)
