"""Model the tennis ball of Aimi, Di Credico and Gimperlein (2024).

It is a disk on a plane that pushes it up and retracts.

No weight and no other load: once released, the disk flies up with a constant velocity and swings.
The plane is rigid, stays horizontal and moves by s(t); the gap of a point of the disk is its height
above the plane, y + u_y - s(t).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, Any

from meshes.disk import DiskMesh
from vi_contact.core.arguments import check_fields
from vi_contact.core.checks import function, instance
from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import FrictionLaw, Frictionless, MassLaw
from vi_contact.core.quantities import Positive, Unit
from vi_contact.core.step import Columns, Report, Row, State
from vi_contact.core.system import SemiDiscreteSystem
from vi_contact.fem.assembly import assemble
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.fem.mesh import build_mesh
from vi_contact.laws.materials import LinearElastic, PlaneStrain


@dataclass(frozen=True)
class Push:
    """Push by s(t) = ``height`` sin²(pi t / (2 ``rise``)).

    It is zero again at t = 2 ``rise``; from then on the push is zero.

    With height 0.05 and rise 1 it is 0.05 (1 - cos pi t)/2 for t <= 1; it goes down as it came up.
    """

    height: Annotated[float, Positive, Unit("m")] = 0.05
    rise: Annotated[float, Positive, Unit("s")] = 1.0

    def __post_init__(self) -> None:
        check_fields(self)

    def __call__(self, t: float) -> float:
        """Return the push [m] at time t [s]."""
        return (
            self.height * math.sin(0.5 * math.pi * t / self.rise) ** 2
            if 0.0 < t < 2.0 * self.rise
            else 0.0
        )


@dataclass(frozen=True)
class Disk:
    """Describe a disk of ``radius``.

    It has cells of ``size``, is in plane strain, and is pushed by ``push``.
    """

    radius: Annotated[float, Positive, Unit("m")] = 0.5
    size: Annotated[float, Positive, Unit("m")] = 0.04
    material: LinearElastic = field(
        default_factory=lambda: LinearElastic.from_wave_speeds(2.0, 1.0, 1.0)
    )
    push: Push = field(default_factory=Push)

    def __post_init__(self) -> None:
        instance("Disk", "material", self.material, LinearElastic, "give a LinearElastic")
        function("Disk", "push", self.push, "give a Push(...), or a function of the time")
        check_fields(self)

    @property
    def time_step(self) -> float:
        """Return the time [s] in which a pressure wave crosses a cell.

        It is half the cell size in the paper's units.
        """
        return self.size / self.material.c_p


@dataclass(frozen=True)
class DiskModel:
    """Hold the assembled disk.

    ``foot`` is its contact side; ``mass`` is that of the disk as the mesh has it [kg/m].
    """

    disk: Disk
    system: SemiDiscreteSystem
    foot: Any
    mass: float

    def problem(
        self, *, friction: FrictionLaw | None = None, mass: MassLaw | None = None
    ) -> ContactProblem:
        """Set up the disk on its moving plane."""
        plane = HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
        surface = contact_surface(self.system, self.foot, obstacle=plane).moving(
            towards=self.disk.push
        )
        return ContactProblem(self.system, surface, friction=friction or Frictionless(), mass=mass)

    def probes(self) -> dict[str, tuple[float, float]]:
        """Return the lowest and highest point."""
        return {"bottom": (0.0, 0.0), "top": (0.0, 2.0 * self.disk.radius)}


def build(disk: Disk, comm: Any) -> DiskModel:
    """Mesh and assemble the disk; collective."""
    mesh, tags = build_mesh(DiskMesh(radius=disk.radius, size=disk.size), comm)
    system = assemble(mesh, disk.material, section=PlaneStrain())
    up = system.influence[:, 1]
    return DiskModel(disk, system, tags["foot"], system.algebra.dot(up, system.M @ up))


class Momentum:
    """Record the momentum rᵀMv of a body in the plane.

    It is that along x and y and about the point ``centre``; contact and friction are the only
    forces; M is the mass matrix of the run.
    """

    def __init__(self, centre: tuple[float, float]) -> None:
        self._centre = centre

    def columns(self) -> Columns:
        """Return the columns momentum_x, momentum_y, momentum_angular."""
        return {
            "momentum_x": ("kg m/s", "momentum along x"),
            "momentum_y": ("kg m/s", "momentum along y"),
            "momentum_angular": ("kg m²/s", "angular momentum, positive anticlockwise"),
        }

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Row:
        """Return the momentum of the initial state."""
        self._system = system = problem.equations
        x, y = (system.space.coordinates - self._centre).T
        along, up = system.influence.T
        self._motions = {"x": along, "y": up, "angular": up * x - along * y}
        return self._row(state)

    def row(self, report: Report) -> Row:
        """Return the values of a step."""
        return self._row(report.new)

    def _row(self, state: State) -> Row:
        impulse = self._system.M @ state.v
        return {
            f"momentum_{name}": self._system.algebra.dot(motion, impulse)
            for name, motion in self._motions.items()
        }
