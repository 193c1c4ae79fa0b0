"""Mesh a half, a quarter or an eighth of a ball by tetrahedra, and an anvil below it.

They are finest at its lowest point, which lies on or strikes a plane.

The ball touches the plane y = 0 at the origin, its centre is (0, R, 0), and the planes x = 0 and z
= 0 are planes of symmetry: the half has z >= 0, the quarter also x >= 0, the eighth also y <= R.
Physical groups: cells "ball"; boundary "surface" (the sphere), "foot" (its part near the origin:
the contact side), "side_z" (z = 0), "side_x" (x = 0, not of the half) and, of the eighth, "cut" (y
= R). The anvil is a block below y = 0, cut by the same planes, a body of its own: cells "anvil";
boundary "anvil_foot" (its part near the origin), "anvil_top", "anvil_side_z", "anvil_side_x" and
"anvil_far", the other sides; and "cap" of the ball, what may face "anvil_foot". A ball that slides
along its anvil has the contact direction of the anvil: contact_pair(…, "anvil_foot", "cap").
"""

import math
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from vi_contact.core.arguments import check_fields
from vi_contact.core.checks import MOST_CELLS, check_count
from vi_contact.core.errors import InputError
from vi_contact.core.quantities import NotNegative, Positive, Unit
from vi_contact.meshes.gmsh_session import options

WIDER = 1.6  # CHOSEN: of the foot: what of the ball may face that of the anvil
COARSEST = 0.35  # CHOSEN: of the depth of the anvil, its largest cells
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

    `half`: half of the ball, for an oblique impact; else a quarter, or an `eighth`. The half has
    the poles of its sphere in the normal of its plane of symmetry, away from the foot. `anvil`:
    depth [m] of a block below the ball, as far to every side; its cells grow twice as fast.
    `height` [m] lifts the ball above y = 0.
    """

    radius: Annotated[float, Positive, Unit("m")]
    size: Annotated[float, Positive, Unit("m")]
    foot: Annotated[float, Positive, Unit("m")]
    growth: Annotated[float, Positive] = 0.3
    coarsest: float | None = None
    eighth: bool = False
    half: bool = False
    anvil: Annotated[float | None, Unit("m")] = None
    height: Annotated[float, NotNegative, Unit("m")] = 0.0

    def __post_init__(self) -> None:
        check_fields(self)
        if self.half and self.eighth:
            raise InputError("BallMesh: half and eighth are both True; give one of the two")
        if self.anvil is not None and not self.anvil >= 2.0 * self.foot:
            raise InputError(
                f"BallMesh: the anvil is {self.anvil!r} m deep and the foot {self.foot!r} m wide; "
                "give a depth of at least two feet, or None"
            )
        if not (self.size <= self.foot < self.radius and self.size <= self._largest <= self.radius):
            raise InputError(
                f"ball of radius {self.radius} m, cell size {self.size} m, foot {self.foot} m, "
                "coarsest"
                f" cell {self._largest} m: they must be size <= foot < radius, size <= coarsest <= "
                "radius"
            )
        cells = (self.foot / self.size) ** 3 + (self.radius / self._largest) ** 3
        if self.anvil is not None:
            cells *= 2.0
        check_count("ball", f"a cell size of {self.size} m", cells, "cells", most=MOST_CELLS)

    @property
    def _largest(self) -> float:
        return 0.25 * self.radius if self.coarsest is None else self.coarsest

    def build(self, gmsh: Any) -> None:
        """Add the ball to Gmsh's current model."""
        model = gmsh.model
        volume = _add_ball(model, self.radius, self.eighth, self.half)
        if self.height:
            model.occ.translate([(3, volume)], 0.0, self.height, 0.0)
            model.occ.synchronize()
        block = None if self.anvil is None else _add_anvil(model, self.anvil, self.half)
        field = model.mesh.field.add("MathEval")
        model.mesh.field.setString(field, "F", self._size_field())
        model.mesh.field.setAsBackgroundMesh(field)
        sphere = _name_sides(model, volume)
        top = None if block is None else _name_sides_of_anvil(model, block)
        with options(gmsh, _SIZES):
            model.mesh.generate(3)
        _add_foot(model, sphere, self.foot, "foot")
        if top is not None:
            _add_foot(model, sphere, WIDER * self.foot, "cap")
            _add_foot(model, top, self.foot, "anvil_foot")

    def _size_field(self) -> str:
        """Return min(coarsest, size + growth max(0, distance - foot)).

        It is written with abs, as MathEval has neither min nor max.
        """
        beyond = f"(sqrt(x^2+y^2+z^2)-{self.foot!r})"
        growth = f"{0.5 * self.growth!r}"
        largest = f"{self._largest!r}"
        if self.anvil is not None:
            # Below the edge of the foot there is the anvil, above it the ball: 1 and 0.
            edge = 0.25 * self.foot**2 / self.radius
            above = f"(y-{edge!r})"
            below = f"(0.5-0.5*{above}/(abs({above})+{1e-9 * self.radius!r}))"
            growth = f"({growth}*(1+{below}))"
            deepest = COARSEST * self.anvil
            largest = f"({largest}+{deepest - self._largest!r}*{below})"
        wanted = f"({self.size!r}+{growth}*({beyond}+abs({beyond})))"
        return f"0.5*({largest}+{wanted}-abs({largest}-{wanted}))"


def _add_ball(model: Any, radius: float, eighth: bool, half: bool) -> int:
    """Add the part of the ball.

    Its parametric poles are on the x axis, of the half on the z axis, away from the foot, where
    cells are finest.

    Args:
        model: Gmsh's current model.
        radius: of the ball [m].
        eighth: whether only what is below the centre is added.
        half: whether what is beyond x = 0 is added too.
    """
    turn = 0.5 * math.pi
    if half:
        half_ball: int = model.occ.addSphere(0.0, 0.0, 0.0, radius, -1, 0.0, turn)
        # the seam of the sphere begins at the foot, which is a node then
        model.occ.rotate([(3, half_ball)], 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, -turn)
        model.occ.translate([(3, half_ball)], 0.0, radius, 0.0)
        model.occ.synchronize()
        return half_ball
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


def _add_anvil(model: Any, depth: float, half: bool) -> int:
    """Add the block below y = 0, so deep and so far to every side.

    Args:
        model: Gmsh's current model.
        depth: of the block [m].
        half: whether it has what is beyond x = 0.
    """
    left = -depth if half else 0.0
    block: int = model.occ.addBox(left, -depth, 0.0, depth - left, depth, depth)
    model.occ.synchronize()
    return block


def _name_sides_of_anvil(model: Any, volume: int) -> int:
    """Name the physical groups of the block; return the tag of its top."""
    model.setPhysicalName(3, model.addPhysicalGroup(3, [volume]), "anvil")
    depth = -model.getBoundingBox(3, volume)[1]
    groups: dict[str, list[int]] = {}
    for _, surface in model.getBoundary([(3, volume)], oriented=False):
        x, y, z = model.occ.getCenterOfMass(2, surface)
        low, high = np.reshape(model.getBoundingBox(2, surface), (2, 3))
        flat = int(np.argmin(high - low))
        near = 1e-3 * depth
        name = "anvil_far"
        if flat == 1 and abs(y) < near:
            name = "anvil_top"
        elif flat == 2 and abs(z) < near:
            name = "anvil_side_z"
        elif flat == 0 and abs(x) < near:
            name = "anvil_side_x"
        groups.setdefault(name, []).append(surface)
    for name, surfaces in groups.items():
        model.setPhysicalName(2, model.addPhysicalGroup(2, surfaces), name)
    return groups["anvil_top"][0]


def _name_sides(model: Any, volume: int) -> int:
    """Name the physical groups; return the tag of the spherical surface."""
    model.setPhysicalName(3, model.addPhysicalGroup(3, [volume]), "ball")
    groups: dict[str, list[int]] = {}
    for _, surface in model.getBoundary([(3, volume)], oriented=False):
        name = "surface"
        if model.getType(2, surface) == "Plane":
            # a plane side is flat along the axis that names it
            box = np.reshape(model.getBoundingBox(2, surface), (2, 3))
            name = ("side_x", "cut", "side_z")[int(np.argmin(np.ptp(box, axis=0)))]
        groups.setdefault(name, []).append(surface)
    for name, surfaces in groups.items():
        model.setPhysicalName(2, model.addPhysicalGroup(2, surfaces), name)
    return groups["surface"][0]


def _add_foot(model: Any, sphere: int, foot: float, name: str) -> None:
    """Group the triangles of a surface whose centre is nearer to the origin than `foot`.

    Args:
        model: Gmsh's current model.
        sphere: the surface.
        foot: the distance [m].
        name: of the group.
    """
    _, nodes = model.mesh.getElementsByType(_TRIANGLE, sphere)
    tags, points, _ = model.mesh.getNodes(2, sphere, includeBoundary=True)
    order = np.argsort(tags)
    triangles = np.asarray(nodes).reshape(-1, 3)
    corners = np.reshape(points, (-1, 3))[order[np.searchsorted(tags, triangles, sorter=order)]]
    near = np.linalg.norm(corners.mean(axis=1), axis=1) < foot
    entity = model.addDiscreteEntity(2)
    model.mesh.addElementsByType(entity, _TRIANGLE, [], triangles[near].reshape(-1))
    model.setPhysicalName(2, model.addPhysicalGroup(2, [entity]), name)
