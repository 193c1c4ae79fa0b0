"""Model a bar that strikes a rigid wall with its foot.

It is a finite element body in 1, 2 or 3 dimensions.

In 2D and 3D it is a strip or a column with nu = 0 and free sides, in which the 1D solutions are
exact. Forces and energies divided by ``section`` compare with those of ``demos.parts.exact``.
"""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import ImpactLaw, MassLaw
from vi_contact.core.system import SemiDiscreteSystem
from vi_contact.exact import BouncingBar, PeriodicBar, ThrownBar
from vi_contact.fem.assembly import assemble
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.fem.loads import BodyForce
from vi_contact.fem.mesh import build_mesh
from vi_contact.laws.materials import LinearElastic, PlaneStrain, Solid
from vi_contact.meshes.block import BlockMesh

# foot and top of a BlockMesh
SIDES = {1: ("left", "right"), 2: ("bottom", "top"), 3: ("bottom", "top")}
UP = {1: 0, 2: 1, 3: 1}  # component of the bar's axis


@dataclass(frozen=True)
class Bar:
    """Describe a bar.

    ``case``: exact solution with its data; ``elements`` along the bar, ``across`` it (cubes).

    ``degree`` 2 for P2 or Q2.
    """

    case: ThrownBar | BouncingBar | PeriodicBar = field(default_factory=ThrownBar)
    elements: int = 100
    dimension: int = 1
    across: int = 3
    triangles: bool = False
    degree: int = 1

    @property
    def length(self) -> float:
        """Return the length of the bar [m]."""
        return self.case.length

    @property
    def material(self) -> LinearElastic:
        """Return the material, with nu = 0."""
        return LinearElastic(E=self.case.E, nu=0.0, rho=self.case.rho)

    @property
    def cell(self) -> float:
        """Return the length of an element [m]."""
        return self.length / self.elements

    @property
    def section(self) -> float:
        """Return the area of the section per unit of whatever the dimension leaves out."""
        return float((self.across * self.cell) ** (self.dimension - 1))

    def along(self, value: float, across: float = 0.0) -> Array:
        """Return the vector (d,) with this component along the bar, upwards, and ``across`` it."""
        return np.where(np.arange(self.dimension) == UP[self.dimension], value, across)

    def time_step(self, courant: float = 1.0) -> float:
        """Return courant * cell / c [s]."""
        c = np.sqrt(self.material.E / self.material.rho)
        return float(courant * self.cell / c)


@dataclass(frozen=True)
class BarModel:
    """Hold the assembled bar over its wall."""

    bar: Bar
    system: SemiDiscreteSystem
    foot: Any
    gap: float

    def problem(
        self, *, mass: MassLaw | None = None, impact: ImpactLaw | None = None
    ) -> ContactProblem:
        """Set up the bar in possible contact along its foot."""
        normal = self.bar.along(1.0)
        wall = HalfSpace(point=tuple(-self.gap * normal), normal=tuple(normal))
        surface = contact_surface(self.system, self.foot, obstacle=wall)
        return ContactProblem(self.system, surface, mass=mass, impact=impact)

    def probes(self) -> dict[str, tuple[float, ...]]:
        """Return the middle of the foot and of the top."""
        middle = 0.5 * self.bar.across * self.bar.cell
        heights = {"foot": 0.0, "top": self.bar.length}
        return {name: tuple(self.bar.along(height, middle)) for name, height in heights.items()}


def build(bar: Bar, comm: Any) -> BarModel:
    """Mesh and assemble the bar, with the initial data of its case."""
    d, case = bar.dimension, bar.case
    lengths = tuple(bar.along(bar.length, bar.across * bar.cell))
    divisions = tuple(int(n) for n in bar.along(bar.elements, bar.across))
    mesh, tags = build_mesh(
        BlockMesh(lengths=lengths, divisions=divisions, simplices=bar.triangles), comm
    )
    foot, top = (tags[name] for name in SIDES[d])
    data: dict[str, Any] = {}
    gap = 0.0
    if isinstance(case, ThrownBar):
        gap = case.height
        data["initial_velocity"] = tuple(bar.along(-case.speed))
    elif isinstance(case, BouncingBar):
        gap = case.height
        data["loads"] = BodyForce(tuple(bar.along(-case.rho * case.gravity)))
    else:
        data["clamped"] = top
        data["initial_displacement"] = lambda x: np.outer(0.5 * (1.0 - x[:, UP[d]]), bar.along(1.0))
    section = {1: None, 2: PlaneStrain(), 3: Solid()}[d]
    return BarModel(
        bar, assemble(mesh, bar.material, section=section, degree=bar.degree, **data), foot, gap
    )
