"""Pair boundary elements, each pair once.

The pairs have the distances that decide how they are integrated.
"""

from copy import copy

import numpy as np

from ..core.algebra import Array, Indices, Mask
from ..core.checks import describe_point, instance
from ..core.errors import InputError
from .boundary_mesh import BoundaryMesh
from .loops import distances

NEAR_LENGTHS = 3.0  # pairs closer than this many element lengths get the finer rule
# pairs whose elements are this share of the longer one's length apart are integrated with their
# feet
CLOSE = 0.9
LEAST = 0.05  # of the longer element: nearer ones are refused, for nothing is known of the answers


class ElementPairs:
    """Hold all p pairs of elements, first <= second, with x on the first and y on the second.

    With xi and eta in [0, 1], x - y = offset + a xi - b eta.

    Attributes:
        first: (p,) number of the first element.
        second: (p,) number of the second element.
        a: (2, p) vector along the first element [m].
        b: (2, p) vector along the second element [m].
        offset: (2, p) from the start of the second element to that of the first [m].
        h: (p,) length of the longer element [m].
        r_min: (p,) least distance between the elements [m].
        r_max: (p,) greatest distance between the elements [m].
        width: (p,) what lies between the elements, over h. Of elements with a common corner it is
            the distance of a free end from the other element; of one element it is infinite.
        same: (p,) whether both are the same element.
        corner: (p,) whether both have a common corner.
        shares_end: (p,) whether that corner is the end of the first element.
        near: (p,) whether they are within three lengths.
        close: (p,) whether they face each other at less than about their length.

    Raises:
        InputError: elements that are nearer than a twentieth of the longer one's length; corners
            of two elements so sharp, or of lengths so different, that an end of one is as near to
            the other.
    """

    def __init__(self, mesh: BoundaryMesh) -> None:
        remedy = "give a BoundaryMesh, for example polygon(...)"
        instance("boundary elements", "the mesh", mesh, BoundaryMesh, remedy)
        first, second = np.triu_indices(len(mesh))
        starts = mesh.points
        ends = mesh.points[mesh.after]
        self.first: Indices = first
        self.second: Indices = second
        self.a: Array = (ends - starts)[first].T
        self.b: Array = (ends - starts)[second].T
        self.offset: Array = (starts[first] - starts[second]).T
        self.h: Array = np.maximum(mesh.lengths[first], mesh.lengths[second])
        self.same = first == second
        self.shares_end = mesh.after[first] == second
        self.corner = self.shares_end | (mesh.after[second] == first)

        # Two segments are farthest apart at two of their ends.
        between_ends = []
        for of_first in (starts, ends):
            for of_second in (starts, ends):
                between_ends.append(np.hypot(*(of_first[first] - of_second[second]).T))
        self.r_max: Array = np.stack(between_ends).max(axis=0)

        # Two segments that do not cross are nearest at an end of one of them.
        to_second = [distances(end[first], starts[second], ends[second]) for end in (starts, ends)]
        to_first = [distances(end[second], starts[first], ends[first]) for end in (starts, ends)]
        nearest = np.min(to_second + to_first, axis=0)
        self.r_min: Array = np.where(self.same | self.corner, 0.0, nearest)

        # At a common corner the free ends tell how close the elements are.
        free_of_first = np.where(self.shares_end, to_second[0], to_second[1])
        free_of_second = np.where(self.shares_end, to_first[1], to_first[0])
        nearest_free_end = np.minimum(free_of_first, free_of_second)
        width = np.where(self.corner, nearest_free_end, self.r_min) / self.h
        self.width: Array = np.where(self.same, np.inf, width)
        self.close = self.width < CLOSE
        self.near = self.r_min < NEAR_LENGTHS * self.h
        self._refuse_thin(mesh)

    def _refuse_thin(self, mesh: BoundaryMesh) -> None:
        """Raise InputError where elements are too near each other to be integrated."""
        thin = self.width < LEAST * (1.0 - 1e-9)
        if not thin.any():
            return
        facing = thin & ~self.corner
        refused = facing if facing.any() else thin
        pair = int(np.where(refused, self.width, np.inf).argmin())
        first = self.first[pair]
        second = self.second[pair]
        h = self.h[pair]
        apart = self.width[pair] * h
        if self.corner[pair]:
            fault = "has a sharp or uneven corner"
            remedy = "widen its angle or make its two elements more equal"
        else:
            fault = "comes near itself"
            remedy = (
                f"take elements of at most {apart / LEAST:.3g} m there, or widen the "
                "angle if two sides meet near by"
            )
        raise InputError(
            f"boundary elements: the boundary {fault} at {describe_point(mesh.points[second])}, "
            f"where elements {first} and {second} are {apart:.3g} m apart, less than 1/20 of the "
            f"{h:.3g} m of the longer one; {remedy}"
        )

    def where(self, chosen: Mask) -> "ElementPairs":
        """Return the chosen pairs, given as a mask (p,)."""
        part = copy(self)
        for name, values in self.__dict__.items():
            setattr(part, name, values[..., chosen])
        return part

    def __len__(self) -> int:
        return len(self.first)
