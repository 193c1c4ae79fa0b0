"""Mesh a quarter or an eighth of a ball by tetrahedra.

They are finest at its lowest point, which lies on or strikes a plane.

The ball touches the plane y = 0 at the origin, its centre is (0, R, 0), and the planes x = 0 and z
= 0 are planes of symmetry: the quarter has x >= 0 and z >= 0, the eighth also y <= R. Physical
groups: cells "ball"; boundary "surface" (the sphere), "foot" (its part near the origin: the contact
side), "side_x" (x = 0), "side_z" (z = 0) and, of the eighth, "cut" (y = R).
"""

import math
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np

if __name__ == "__main__":  # run as a file of the source tree, maybe not installed
    sys.path[0] = str(Path(__file__).resolve().parents[1])

from vi_contact.core.arguments import check_fields
from vi_contact.core.checks import MOST_CELLS, check_count
from vi_contact.core.errors import InputError
from vi_contact.core.quantities import Positive, Unit
from vi_contact.meshes.gmsh_session import options

_TRIANGLE = 2  # Gmsh's number
_SIZES = {  # the size field alone decides
    "Mesh.MeshSizeExtendFromBoundary": 0,
    "Mesh.MeshSizeFromPoints": 0,
    "Mesh.MeshSizeFromCurvature": 0,
    "Mesh.MeshSizeMin": 0,
    "Mesh.MeshSizeMax": 1e22,
}


@dataclass(frozen=True, kw_only=True)
class BallMesh:
    """Describe a mesh of a ball of `radius` [m].

    Cells have about `size` [m] within the distance `foot` [m] of the origin. Farther away they have
    about `size` plus `growth` times the distance from the foot, but at most `coarsest` (a quarter
    of the radius unless given). The sphere becomes a polyhedron inside it: volume and mass are too
    small by about 0.35 (coarsest/radius)². Raises InputError for sizes that make no ball.
    """

    radius: Annotated[float, Positive, Unit("m")]
    size: Annotated[float, Positive, Unit("m")]
    foot: Annotated[float, Positive, Unit("m")]
    growth: Annotated[float, Positive] = 0.3
    coarsest: float | None = None
    eighth: bool = False

    def __post_init__(self) -> None:
        check_fields(self)
        if not (self.size <= self.foot < self.radius and self.size <= self._largest <= self.radius):
            raise InputError(
                f"ball of radius {self.radius} m, cell size {self.size} m, foot {self.foot} m, "
                "coarsest"
                f" cell {self._largest} m: they must be size <= foot < radius, size <= coarsest <= "
                "radius"
            )
        cells = (self.foot / self.size) ** 3 + (self.radius / self._largest) ** 3
        check_count("ball", f"a cell size of {self.size} m", cells, "cells", most=MOST_CELLS)

    @property
    def _largest(self) -> float:
        return 0.25 * self.radius if self.coarsest is None else self.coarsest

    def build(self, gmsh: Any) -> None:
        """Add the ball to Gmsh's current model."""
        model = gmsh.model
        volume = _add_ball(model, self.radius, self.eighth)
        field = model.mesh.field.add("MathEval")
        model.mesh.field.setString(field, "F", self._size_field())
        model.mesh.field.setAsBackgroundMesh(field)
        sphere = _name_sides(model, volume, self.radius)
        with options(gmsh, _SIZES):
            model.mesh.generate(3)
        _add_foot(model, sphere, self.foot)

    def _size_field(self) -> str:
        """Return min(coarsest, size + growth max(0, distance - foot)).

        It is written with abs, as MathEval has neither min nor max.
        """
        beyond = f"(sqrt(x^2+y^2+z^2)-{self.foot!r})"
        wanted = f"({self.size!r}+{0.5 * self.growth!r}*({beyond}+abs({beyond})))"
        return f"0.5*({self._largest!r}+{wanted}-abs({self._largest!r}-{wanted}))"


def _add_ball(model: Any, radius: float, eighth: bool) -> int:
    """Add the part of the ball.

    Its parametric poles are on the x axis, away from the foot, where cells are finest.
    """
    turn = 0.5 * math.pi
    ball: int = model.occ.addSphere(
        0.0, 0.0, 0.0, radius, -1, 0.0, turn, turn if eighth else 2.0 * turn
    )
    # x to y to z to x
    model.occ.rotate([(3, ball)], 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 2.0 * math.pi / 3.0)
    if eighth:
        model.occ.rotate([(3, ball)], 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, turn)
    model.occ.translate([(3, ball)], 0.0, radius, 0.0)
    model.occ.synchronize()
    return ball


def _name_sides(model: Any, volume: int, radius: float) -> int:
    """Name the physical groups; return the tag of the spherical surface."""
    model.setPhysicalName(3, model.addPhysicalGroup(3, [volume]), "ball")
    groups: dict[str, list[int]] = {}
    for _, surface in model.getEntities(2):
        centre = np.array(model.occ.getCenterOfMass(2, surface)) - (0.0, radius, 0.0)
        flat = np.abs(centre) < 1e-6 * radius
        # the sphere of the quarter is centred there as well
        flat[1] &= model.getType(2, surface) == "Plane"
        names = [name for name, here in zip(("side_x", "cut", "side_z"), flat, strict=True) if here]
        groups.setdefault(names[0] if names else "surface", []).append(surface)
    for name, surfaces in groups.items():
        model.setPhysicalName(2, model.addPhysicalGroup(2, surfaces), name)
    return groups["surface"][0]


def _add_foot(model: Any, sphere: int, foot: float) -> None:
    """Group the triangles of the sphere whose centre is nearer to the origin than `foot`."""
    _, nodes = model.mesh.getElementsByType(_TRIANGLE, sphere)
    tags, points, _ = model.mesh.getNodes(2, sphere, includeBoundary=True)
    order = np.argsort(tags)
    triangles = np.asarray(nodes).reshape(-1, 3)
    corners = np.reshape(points, (-1, 3))[order[np.searchsorted(tags, triangles, sorter=order)]]
    near = np.linalg.norm(corners.mean(axis=1), axis=1) < foot
    entity = model.addDiscreteEntity(2)
    model.mesh.addElementsByType(entity, _TRIANGLE, [], triangles[near].reshape(-1))
    model.setPhysicalName(2, model.addPhysicalGroup(2, [entity]), "foot")


if __name__ == "__main__":  # python3 meshes/ball.py is python3 meshes ball
    from meshes.__main__ import main

    main([Path(__file__).stem, *sys.argv[1:]])
