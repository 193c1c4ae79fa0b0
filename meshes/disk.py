"""Mesh a disk by triangles of one size.

Its left half is the mirror image of the right one; it is a ball in the plane.

The disk touches the line y = 0 at the origin, its centre is (0, R). Physical groups: cells "disk";
boundary "foot" (the arc within an angle of the lowest point: the contact side) and "rest".
Symmetric loads leave it exactly symmetric.
"""

import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

if __name__ == "__main__":  # run as a file of the source tree, maybe not installed
    sys.path[0] = str(Path(__file__).resolve().parents[1])

from vi_contact.core.checks import MOST_CELLS, check_count
from vi_contact.core.errors import InputError

_LINE, _TRIANGLE = 1, 2  # Gmsh's numbers


@dataclass(frozen=True, kw_only=True)
class DiskMesh:
    """Describe a mesh of a disk of `radius` [m] with cells of about `size` [m].

    `foot` [rad] is half the angle of the contact side, less than a right angle. The circle becomes
    a polygon inside it: the area is too small by (size/radius)²/6. Raises InputError for sizes that
    make no disk.
    """

    radius: float
    size: float
    foot: float = math.pi / 3.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.radius) and 0.0 < self.size <= 0.5 * self.radius):
            raise InputError(
                f"disk of radius {self.radius} m with cells of {self.size} m: give a positive "
                "radius and"
                " cells of at most half of it"
            )
        check_count(
            "disk",
            f"a cell size of {self.size} m",
            (self.radius / self.size) ** 2,
            "cells",
            most=MOST_CELLS,
        )
        if not self.size / self.radius <= self.foot < 0.5 * math.pi:
            raise InputError(
                f"foot of a disk is {self.foot} rad: give an angle from one cell to less than pi/2"
            )

    def build(self, gmsh: Any) -> None:
        """Add the disk to Gmsh's current model."""
        model = gmsh.model
        half, foot, rest = self._add_half(model.geo)
        model.geo.synchronize()
        model.mesh.generate(2)
        image = _mirror_nodes(model)
        left = _mirrored(model, 2, half, _TRIANGLE, image)
        _name(model, 2, "disk", [half, left])
        for name, arc in (("foot", foot), ("rest", rest)):
            _name(model, 1, name, [arc, _mirrored(model, 1, arc, _LINE, image)])

    def _add_half(self, geo: Any) -> tuple[int, int, int]:
        """Add the half x >= 0, its sides evenly divided: (surface, foot, rest)."""
        R = self.radius
        end = R * math.sin(self.foot), R * (1.0 - math.cos(self.foot))
        places = ((0.0, 0.0), end, (0.0, 2.0 * R), (0.0, R))
        low, side, top, centre = (geo.addPoint(x, y, 0.0, self.size) for x, y in places)
        arcs = [geo.addCircleArc(low, centre, side), geo.addCircleArc(side, centre, top)]
        axis = geo.addLine(top, low)
        lengths = (2.0 * R, R * self.foot, R * (math.pi - self.foot))
        for curve, length in zip((axis, *arcs), lengths, strict=True):
            geo.mesh.setTransfiniteCurve(curve, max(round(length / self.size), 1) + 1)
        return geo.addPlaneSurface([geo.addCurveLoop([*arcs, axis])]), arcs[0], arcs[1]


def _mirror_nodes(model: Any) -> npt.NDArray[np.int_]:
    """Add the mirror images of all nodes off the axis to a surface.

    It returns image[tag], the tag itself on the axis.
    """
    tags, points, _ = model.mesh.getNodes()
    tags, points = np.asarray(tags, dtype=int), np.reshape(points, (-1, 3))
    off = points[:, 0] > 1e-9 * float(np.max(points[:, 0]))
    image = np.arange(tags.max() + 1)
    image[tags[off]] = tags.max() + 1 + np.arange(off.sum())
    home = model.addDiscreteEntity(2)
    model.mesh.addNodes(2, home, image[tags[off]], (points[off] * (-1.0, 1.0, 1.0)).reshape(-1))
    return image


def _mirrored(
    model: Any, dimension: int, entity: int, kind: int, image: npt.NDArray[np.int_]
) -> int:
    """Add an entity with the mirror images of the cells of another.

    These are turned round so that they stay positive.
    """
    _, nodes = model.mesh.getElementsByType(kind, entity)
    cells = image[np.asarray(nodes, dtype=int).reshape(-1, dimension + 1)][:, ::-1]
    left: int = model.addDiscreteEntity(dimension)
    model.mesh.addElementsByType(left, kind, [], cells.reshape(-1))
    return left


def _name(model: Any, dimension: int, name: str, entities: list[int]) -> None:
    model.setPhysicalName(dimension, model.addPhysicalGroup(dimension, entities), name)


if __name__ == "__main__":  # python3 meshes/disk.py is python3 meshes disk
    from meshes.__main__ import main

    main([Path(__file__).stem, *sys.argv[1:]])
