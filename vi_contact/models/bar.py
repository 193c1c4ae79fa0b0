"""Model a bar that strikes a rigid wall with its foot, as a finite element body in 1, 2 or 3 dimensions.

In 2D and 3D it is a strip or a column with nu = 0 and free sides, in which the 1D solutions are exact. Forces and
energies divided by ``section`` compare with those of ``vi_contact.exact``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from ..core.algebra import Array
from ..core.obstacles import HalfSpace
from ..core.problem import ContactProblem
from ..core.protocols import ImpactLaw, MassLaw
from ..core.system import SemiDiscreteSystem
from ..exact.bar import PeriodicBar, ThrownBar
from ..exact.bouncing_bar import BouncingBar
from ..fem.assembly import assemble
from ..fem.contact.surface import contact_surface
from ..fem.loads import BodyForce
from ..fem.mesh import build_mesh
from ..laws.materials import LinearElastic, PlaneStrain, Solid
from ..meshes.block import BlockMesh

SIDES = {1: ("left", "right"), 2: ("bottom", "top"), 3: ("bottom", "top")}  # foot and top of a BlockMesh
UP = {1: 0, 2: 1, 3: 1}  # component of the bar's axis


@dataclass(frozen=True)
class Bar:
    """Describe a bar. ``case``: exact solution with its data; ``elements`` along the bar, ``across`` it (cubes)."""

    case: ThrownBar | BouncingBar | PeriodicBar = field(default_factory=ThrownBar)
    elements: int = 100
    dimension: int = 1
    across: int = 3
    triangles: bool = False

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

    def problem(self, *, mass: MassLaw | None = None, impact: ImpactLaw | None = None) -> ContactProblem:
        """Set up the bar in possible contact along its foot."""
        point, normal = np.zeros(self.bar.dimension), np.zeros(self.bar.dimension)
        point[UP[self.bar.dimension]], normal[UP[self.bar.dimension]] = -self.gap, 1.0
        wall = HalfSpace(point=tuple(point), normal=tuple(normal))
        return ContactProblem(
            self.system, contact_surface(self.system, self.foot, obstacle=wall), mass=mass, impact=impact
        )

    def probes(self) -> dict[str, tuple[float, ...]]:
        """Return the middle of the foot and of the top."""
        middle = 0.5 * self.bar.across * self.bar.cell
        ends = {}
        for name, height in (("foot", 0.0), ("top", self.bar.length)):
            point = np.full(self.bar.dimension, middle)
            point[UP[self.bar.dimension]] = height
            ends[name] = tuple(point)
        return ends


def build(bar: Bar, comm: Any) -> BarModel:
    """Mesh and assemble the bar, with the initial data of its case."""
    d, case = bar.dimension, bar.case
    axis = UP[d]
    lengths, divisions = np.full(d, bar.across * bar.cell), np.full(d, bar.across)
    lengths[axis], divisions[axis] = bar.length, bar.elements
    mesh, tags = build_mesh(
        BlockMesh(lengths=tuple(lengths), divisions=tuple(int(n) for n in divisions), simplices=bar.triangles), comm
    )
    foot, top = (tags[name] for name in SIDES[d])

    def upwards(values: Array) -> Array:
        field = np.zeros((len(values), d))
        field[:, axis] = values
        return field

    data: dict[str, Any] = {}
    gap = 0.0
    if isinstance(case, ThrownBar):
        gap = case.height
        data["initial_velocity"] = lambda x: upwards(np.full(len(x), -case.speed))
    elif isinstance(case, BouncingBar):
        gap = case.height
        weight = np.zeros(d)
        weight[axis] = -case.rho * case.gravity
        data["loads"] = BodyForce(tuple(weight))
    else:
        data["clamped"] = top
        data["initial_displacement"] = lambda x: upwards(0.5 * (1.0 - x[:, axis]))
    section = {1: None, 2: PlaneStrain(), 3: Solid()}[d]
    return BarModel(bar, assemble(mesh, bar.material, section=section, **data), foot, gap)
