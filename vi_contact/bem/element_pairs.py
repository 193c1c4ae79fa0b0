"""Pair boundary elements, each pair once.

The pairs have the distances that decide how they are integrated.
"""

from copy import copy

import numpy as np

from ..core.algebra import Array, Indices, Mask
from ..core.checks import at, instance
from ..core.errors import InputError
from .boundary_mesh import BoundaryMesh
from .loops import distances

NEAR_LENGTHS = 3.0  # pairs closer than this many element lengths get the finer rule
# pairs whose elements are this share of the longer one's length apart are integrated with their
# feet
CLOSE = 0.9
LEAST = 0.05  # of the longer element: nearer ones are refused, for nothing is known of the answers


class ElementPairs:
    """Hold all pairs first <= second.

    On them x = point + a xi on the first, y on the second, x - y = offset + a xi - b eta.

    offset, a, b: (2, p) [m]; r_min, r_max: least and greatest distance [m]; h: the longer element
    [m]; width: what is between them over h; of two elements with a common corner, the distance of a
    free end from the other. same, corner, near, close: boolean masks; shares_end: the common corner
    is the end of the first element.

    Raises InputError for elements that are nearer than a twentieth of the longer one's length, and
    for corners of two elements so sharp, or of lengths so different, that an end of one is as near
    to the other.
    """

    def __init__(self, mesh: BoundaryMesh) -> None:
        instance(
            "boundary elements",
            "the mesh",
            mesh,
            BoundaryMesh,
            "give a BoundaryMesh, for example polygon(...)",
        )
        first, second = np.triu_indices(len(mesh))
        starts, ends = mesh.points, mesh.points[mesh.after]
        self.first: Indices = first
        self.second: Indices = second
        self.a: Array = (ends - starts)[first].T
        self.b: Array = (ends - starts)[second].T
        self.offset: Array = (starts[first] - starts[second]).T
        self.h: Array = np.maximum(mesh.lengths[first], mesh.lengths[second])
        corners = np.stack(
            [np.hypot(*(p[first] - q[second]).T) for p in (starts, ends) for q in (starts, ends)]
        )
        self.r_max: Array = corners.max(axis=0)
        self.same = first == second
        self.shares_end = mesh.after[first] == second
        self.corner = self.shares_end | (mesh.after[second] == first)
        to_second = [distances(p[first], starts[second], ends[second]) for p in (starts, ends)]
        to_first = [distances(p[second], starts[first], ends[first]) for p in (starts, ends)]
        self.r_min: Array = np.where(
            self.same | self.corner, 0.0, np.min(to_second + to_first, axis=0)
        )
        free = [np.where(self.shares_end, ends[0], ends[1]) for ends in (to_second, to_first[::-1])]
        width = np.where(self.corner, np.minimum(*free), self.r_min) / self.h
        self.width: Array = np.where(self.same, np.inf, width)
        self.close = self.width < CLOSE
        self.near = self.r_min < NEAR_LENGTHS * self.h
        self._check_width(mesh)

    def _check_width(self, mesh: BoundaryMesh) -> None:
        thin = self.width < LEAST * (1.0 - 1e-9)
        if not thin.any():
            return
        facing = thin & ~self.corner
        pair = int(np.where(facing if facing.any() else thin, self.width, np.inf).argmin())
        first, second, h, apart = (
            self.first[pair],
            self.second[pair],
            self.h[pair],
            self.width[pair] * self.h[pair],
        )
        near, remedy = (
            "comes near itself",
            (
                f"take elements of at most {apart / LEAST:.3g} m there, or widen the "
                "angle if two sides meet near by"
            ),
        )
        if self.corner[pair]:
            near, remedy = (
                "has a sharp or uneven corner",
                "widen its angle or make its two elements more equal",
            )
        raise InputError(
            f"boundary elements: the boundary {near} at {at(mesh.points[second])}, where elements "
            f"{first} and {second} are {apart:.3g} m apart, less than 1/20 of the {h:.3g} m of the "
            f"longer one; {remedy}"
        )

    def where(self, chosen: Mask) -> "ElementPairs":
        """Return the chosen pairs (p,)."""
        part = copy(self)
        part.__dict__.update({name: values[..., chosen] for name, values in self.__dict__.items()})
        return part

    def __len__(self) -> int:
        return len(self.first)
