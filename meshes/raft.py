"""Mesh a building on a raft that stands on a box of soil.

It is meshed by tetrahedra, as two bodies, each meshed for itself.

The building is one body: a raft, a hollow core of walls on it and a slab over every storey. The
soil's surface is z = 0 with the middle of the raft at the origin. Physical groups: cells
"building", "soil"; boundary "raft_bottom" and, facing it, "soil_foot", which reaches a cell
further; "soil_surface" around that; "soil_bottom", "soil_left", "soil_right" (x), "soil_back",
"soil_front" (y), opposite ones divided alike so that they can be tied; "roof".
"""

import sys
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path
from typing import Annotated, Any

import numpy as np

if __name__ == "__main__":  # run as a file of the source tree, maybe not installed
    sys.path[0] = str(Path(__file__).resolve().parents[1])

from vi_contact.core.arguments import check_fields
from vi_contact.core.checks import MOST_CELLS, array, check_count
from vi_contact.core.errors import InputError
from vi_contact.core.quantities import Positive, Unit


@dataclass(frozen=True, kw_only=True)
class RaftMesh:
    """Describe a building on soil; all lengths in metres.

    `raft` has the lengths of the raft along x and y, and its thickness. `core` has x and y of the
    middle of the core, and its outer lengths along x and y; `wall` is the thickness of its walls.
    `storeys` has the heights of the storeys. `slab` is the thickness of the floors, which are as
    wide as the raft and lie in the upper part of each storey. `soil` has the lengths of the soil
    along x and y, and its depth. Cells of the building have about `size`; cells of the soil have
    about `soil_size` under the raft and `far` at the outer edges. Raises InputError for sizes that
    make no such building.
    """

    raft: tuple[float, ...] = (12.0, 9.0, 1.5)
    core: tuple[float, ...] = (0.75, 0.0, 8.0, 6.0)
    wall: Annotated[float, Positive, Unit("m")] = 0.8
    storeys: tuple[float, ...] = (4.0, 4.0, 4.0)
    slab: Annotated[float, Positive, Unit("m")] = 0.6
    soil: tuple[float, ...] = (42.0, 36.0, 12.0)
    size: Annotated[float, Positive, Unit("m")] = 1.2
    soil_size: Annotated[float, Positive, Unit("m")] = 0.8
    far: Annotated[float, Positive, Unit("m")] = 4.0

    def __post_init__(self) -> None:
        for name, count in (("raft", 3), ("core", 4), ("storeys", None), ("soil", 3)):
            array("RaftMesh", name, getattr(self, name), (count,), unit="metres")
        check_fields(self)
        (lx, ly, thick), (x, y, cx, cy), (wide, deep, depth) = self.raft, self.core, self.soil
        inside = (
            2.0 * self.wall < min(cx, cy)
            and abs(x) + 0.5 * cx <= 0.5 * lx
            and abs(y) + 0.5 * cy <= 0.5 * ly
        )
        if not (thick > 0.0 and inside and min(self.storeys, default=0.0) > self.slab):
            raise InputError(
                f"a core {cx} x {cy} m at ({x}, {y}), walls {self.wall}, storeys {self.storeys}, "
                f"slabs {self.slab} m on a raft {lx} x {ly} x {thick} m: it needs room inside, "
                "storeys higher than their slabs, and the raft under all of it"
            )
        if not (
            depth > 0.0 and lx + 4.0 * self.soil_size < wide and ly + 4.0 * self.soil_size < deep
        ):
            raise InputError(
                f"soil {wide} x {deep} x {depth} m: give depth, and two cells of {self.soil_size} "
                f"m more than a raft {lx} x {ly} m on every side"
            )
        cells = 6.0 * lx * ly * (thick / self.size**3 + min(depth, lx) / self.soil_size**3)
        check_count(
            "RaftMesh",
            f"cells of {self.size} and {self.soil_size} m",
            cells,
            "cells",
            most=MOST_CELLS,
        )

    def build(self, gmsh: Any) -> None:
        """Add both bodies to Gmsh's current model."""
        model = gmsh.model
        building, (soil, foot) = self._building(model.occ), self._soil(model.occ)
        model.occ.synchronize()
        faces = self._faces(model, building, soil, foot)
        groups = [
            (3, "building", [building]),
            (3, "soil", [soil]),
            *((2, *face) for face in faces.items()),
        ]
        for dim, name, entities in groups:
            model.setPhysicalName(dim, model.addPhysicalGroup(dim, entities), name)
        for size, entity in (
            (self.far, (3, soil)),
            (self.size, (3, building)),
            (self.soil_size, (2, foot)),
        ):
            model.mesh.setSize(model.getBoundary([entity], combined=False, recursive=True), size)
        for first, second, axis in (("left", "right", 0), ("back", "front", 1)):
            shift = np.eye(4)
            shift[axis, 3] = self.soil[axis]
            model.mesh.setPeriodic(
                2, faces[f"soil_{second}"], faces[f"soil_{first}"], shift.ravel().tolist()
            )
        model.mesh.generate(3)

    def _building(self, occ: Any) -> int:
        """Add raft, core and slabs as one body; return its tag."""
        (lx, ly, z), (x, y, cx, cy), wall, height = (
            self.raft,
            self.core,
            self.wall,
            sum(self.storeys),
        )
        raft = occ.addBox(-0.5 * lx, -0.5 * ly, 0.0, lx, ly, z)
        outer = occ.addBox(x - 0.5 * cx, y - 0.5 * cy, z, cx, cy, height)
        inside = 2.0 * wall
        hole = occ.addBox(
            x - 0.5 * cx + wall, y - 0.5 * cy + wall, z, cx - inside, cy - inside, height
        )
        walls, _ = occ.cut([(3, outer)], [(3, hole)])
        tops = (z + top - self.slab for top in accumulate(self.storeys))
        slabs = [(3, occ.addBox(-0.5 * lx, -0.5 * ly, top, lx, ly, self.slab)) for top in tops]
        ((_, body),), _ = occ.fuse([(3, raft)], [*walls, *slabs])
        return int(body)

    def _soil(self, occ: Any) -> tuple[int, int]:
        """Add the soil with the face under the raft, a cell wider than it; return both tags."""
        (lx, ly, _), (wide, deep, depth), more = self.raft, self.soil, 2.0 * self.soil_size
        box = occ.addBox(-0.5 * wide, -0.5 * deep, -depth, wide, deep, depth)
        foot = occ.addRectangle(-0.5 * (lx + more), -0.5 * (ly + more), 0.0, lx + more, ly + more)
        _, (volumes, faces) = occ.fragment([(3, box)], [(2, foot)])
        return int(volumes[0][1]), int(faces[0][1])

    def _faces(self, model: Any, building: int, soil: int, foot: int) -> dict[str, list[int]]:
        """Return the faces of every named boundary, found by where their middles lie."""
        wide, deep, depth = self.soil
        places = {
            building: {"raft_bottom": (2, 0.0), "roof": (2, self.raft[2] + sum(self.storeys))},
            soil: {
                "soil_left": (0, -0.5 * wide),
                "soil_right": (0, 0.5 * wide),
                "soil_back": (1, -0.5 * deep),
                "soil_front": (1, 0.5 * deep),
                "soil_bottom": (2, -depth),
                "soil_surface": (2, 0.0),
            },
        }
        found: dict[str, list[int]] = {"soil_foot": [foot]}
        for body, sides in places.items():
            faces = [
                face for _, face in model.getBoundary([(3, body)], oriented=False) if face != foot
            ]
            for name, (axis, place) in sides.items():
                found[name] = [
                    face
                    for face in faces
                    if abs(model.occ.getCenterOfMass(2, face)[axis] - place) < 1e-6 * wide
                ]
        return found


if __name__ == "__main__":  # python3 meshes/raft.py is python3 meshes raft
    from meshes.__main__ import main

    main([Path(__file__).stem, *sys.argv[1:]])
