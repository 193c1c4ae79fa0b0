"""Model concrete in concrete, a box in the notch of a block.

They are the two bodies of Aimi, Di Credico and Gimperlein (2024).

The box [-a/2, a/2]² is pressed down on its top. Its lower half stands in a notch of the block
[-3a/2, 3a/2] x [-2a, 0], which is clamped at its bottom: contact on floor and walls of the notch,
without initial gaps. The block is five sub-meshes with nodes of their own, welded along their
common sides (the transmission interfaces of the source).
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from demos.parts.problems.square import Square, concrete
from vi_contact.core.checks import instance, optional
from vi_contact.core.errors import InputError
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import FrictionLaw, Frictionless, MassLaw
from vi_contact.core.surfaces import ContactSurface
from vi_contact.core.system import SemiDiscreteSystem
from vi_contact.fem.assembly import assemble
from vi_contact.fem.contact.joined import joined_surfaces
from vi_contact.fem.contact.pairs import contact_pair
from vi_contact.fem.loads import Traction
from vi_contact.fem.mesh import build_mesh
from vi_contact.laws.materials import LinearElastic, PlaneStrain
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.cut import Welded
from vi_contact.meshes.two_blocks import Blocks

CONTACT = (
    ("foot_bottom", "under_top"),
    ("foot_left", "left_wall_right"),
    ("foot_right", "right_wall_left"),
)
TRANSMISSION = (
    ("left_right", "under_left"), ("right_left", "under_right"),
    ("left_top", "left_wall_bottom"), ("right_top", "right_wall_bottom"),
)  # fmt: skip
WAIST = ("foot_top", "head_bottom")
BOX = ("foot", "head")
GROUND = ("left", "right", "under")
WALLS = ("left_wall", "right_wall")


@dataclass(frozen=True)
class Embedded:
    """Describe box and block.

    ``box``: the pressed one, with an even number of cells per side; ``block``: the material around
    it, that of the box by default. InputError for an odd number of cells and for rollers.
    """

    box: Square = field(default_factory=lambda: concrete(cells=10))
    block: LinearElastic | None = None

    def __post_init__(self) -> None:
        instance(
            "Embedded", "box", self.box, Square, "give a Square, for example concrete(cells=10)"
        )
        optional(
            instance,
            "Embedded",
            "block",
            self.block,
            LinearElastic,
            "give a LinearElastic, or None",
        )
        if self.box.cells % 2:
            raise InputError(
                f"Embedded: box of {self.box.cells} cells per side: give an even number, half are "
                "in it"
            )
        if self.box.confined:
            raise InputError(
                "Embedded: the box is on rollers; give a box with confined=False, the notch is "
                "what confines it"
            )

    def blocks(self) -> Blocks:
        """Return the sub-meshes.

        They are "foot" and "head" of the box, "left", "right", "under" (the notch), "left_wall" and
        "right_wall" of the block.
        """
        a = 0.5 * self.box.side
        n = self.box.cells // 2
        places = {  # lowest corner, width, height in units of half a side
            "foot": (-1, -1, 2, 1),
            "head": (-1, 0, 2, 1),
            "left": (-3, -4, 2, 3),
            "right": (1, -4, 2, 3),
            "under": (-1, -4, 2, 3),
            "left_wall": (-3, -1, 2, 1),
            "right_wall": (1, -1, 2, 1),
        }
        return Blocks({
            name: BlockMesh(lengths=(a * w, a * h), divisions=(n * w, n * h), corner=(a * x, a * y))
            for name, (x, y, w, h) in places.items()
        })  # fmt: skip

    def mesh(self) -> Welded:
        """Return the two bodies: foot and head are one, the sub-meshes of the block are one."""
        welded = Welded(self.blocks(), *WAIST)
        for sides in TRANSMISSION:
            welded = Welded(welded, *sides)
        return welded


@dataclass(frozen=True)
class EmbeddedModel:
    """Hold the assembled box and block.

    ``surface`` is the contact of floor, left and right wall, in this order.
    """

    embedded: Embedded
    system: SemiDiscreteSystem
    surface: ContactSurface

    def problem(
        self, *, friction: FrictionLaw | None = None, mass: MassLaw | None = None
    ) -> ContactProblem:
        """Set up the box in its notch, at rest."""
        return ContactProblem(
            self.system, self.surface, friction=friction or Frictionless(), mass=mass
        )

    def probes(self) -> dict[str, tuple[float, float]]:
        """Return the middle of the top of the box, rim of the block half a side from the notch."""
        side = self.embedded.box.side
        return {"top": (0.0, 0.5 * side), "rim": (side, 0.0)}


def build(embedded: Embedded, comm: Any, *, mesh: Callable[[], Any] | None = None) -> EmbeddedModel:
    """Build mesh, system and contact surface; collective.

    ``mesh``: makes another mesh with the same groups.
    """
    box = embedded.box
    built, tags = build_mesh((mesh or embedded.mesh)(), comm)
    around = embedded.block or box.material
    materials = [(tags[name], box.material) for name in BOX]
    materials += [(tags[name], around) for name in GROUND + WALLS]
    system = assemble(built, materials, section=PlaneStrain(),
                      loads=Traction(tags["head_top"], (0.0, -box.pressure), history=box.history),
                      clamped=[tags[f"{name}_bottom"] for name in GROUND])  # fmt: skip
    pairs = [contact_pair(system, tags[one], tags[two]) for one, two in CONTACT]
    return EmbeddedModel(embedded, system, joined_surfaces(*pairs).with_frictionless_corners())
