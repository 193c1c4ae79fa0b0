"""Model a square that is pressed on a rigid support.

These are compression tests of Aimi, Di Credico and Gimperlein (2024).

A uniform pressure acts on the top of [-a/2, a/2]², the bottom is in possible contact, the sides are
free, plane strain; at rest for t <= 0. In the source's units: c_P = 1, c_S = 1/2, rho = 1, side 1,
pressure 0.1 from t = 0 on.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Annotated, Any

from vi_contact.core.arguments import check_fields
from vi_contact.core.checks import function, instance, optional
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import FrictionLaw, Frictionless, MassLaw
from vi_contact.core.quantities import Finite, Positive, Unit
from vi_contact.core.system import SemiDiscreteSystem
from vi_contact.fem.assembly import assemble
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.fem.loads import Prescribed, Traction
from vi_contact.fem.mesh import build_mesh
from vi_contact.laws.materials import LinearElastic, PlaneStrain
from vi_contact.meshes.block import BlockMesh


@dataclass(frozen=True)
class Square:
    """Describe a square of ``cells`` bilinear cells a ``side``.

    ``pressure`` acts on the top times ``history``(t).

    ``confined``: the sides move vertically only, so that plane waves run up and down.
    """

    cells: Annotated[int, Positive] = 20
    side: Annotated[float, Positive, Unit("m")] = 1.0
    material: LinearElastic = field(
        default_factory=lambda: LinearElastic.from_wave_speeds(1.0, 0.5, 1.0)
    )
    pressure: Annotated[float, Finite, Unit("Pa")] = 0.1
    history: Callable[[float], float] | None = None
    confined: bool = False

    def __post_init__(self) -> None:
        instance("Square", "material", self.material, LinearElastic, "give a LinearElastic")
        optional(
            function, "Square", "history", self.history, "give a function of the time, or None"
        )
        check_fields(self)

    @property
    def time_step(self) -> float:
        """Return the time in which a pressure wave crosses a cell [s]."""
        return self.side / self.cells / self.material.c_p


def concrete(cells: int = 20) -> Square:
    """Describe a box of concrete on steel, 1 m wide.

    It has c_P = 3253 m/s, c_S = 1992 m/s, 4 MPa tanh((t/15 ms)²).
    """
    return Square(
        cells=cells,
        material=LinearElastic.from_wave_speeds(3253.0, 1992.0, 2400.0),
        pressure=4.0e6,
        history=lambda t: math.tanh((t / 0.015) ** 2),
    )


@dataclass(frozen=True)
class SquareModel:
    """Hold the assembled square; ``bottom``: its contact side."""

    square: Square
    system: SemiDiscreteSystem
    bottom: Any

    def problem(
        self, *, friction: FrictionLaw | None = None, mass: MassLaw | None = None
    ) -> ContactProblem:
        """Set up the square on a support that it fits."""
        surface = contact_surface(self.system, self.bottom)
        return ContactProblem(self.system, surface, friction=friction or Frictionless(), mass=mass)

    def probes(self) -> dict[str, tuple[float, float]]:
        """Return the middle of the top and the corner at the right end of the contact."""
        half = 0.5 * self.square.side
        return {"top": (0.0, half), "corner": (half, -half)}


def build(square: Square, comm: Any) -> SquareModel:
    """Mesh and assemble the square; collective."""
    half = 0.5 * square.side
    mesh, tags = build_mesh(
        BlockMesh(lengths=(square.side,) * 2, divisions=(square.cells,) * 2, corner=(-half, -half)),
        comm,
    )
    load = Traction(tags["top"], (0.0, -square.pressure), history=square.history)
    rollers = (
        [Prescribed(tags[side], components=(0,)) for side in ("left", "right")]
        if square.confined
        else []
    )
    system = assemble(mesh, square.material, section=PlaneStrain(), loads=load, prescribed=rollers)
    return SquareModel(square, system, tags["bottom"])
