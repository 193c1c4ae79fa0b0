"""Model the first example of the boundary method.

It is a wall clamped at its base, beside the ground (Figs. 2 to 5).

What the source leaves open is marked CHOSEN and explained in the documentation
(docs/start/first_wall.md).
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from vi_contact.core.checks import check_word
from vi_contact.core.errors import InputError
from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import Excitation, ImpactLaw, MassLaw
from vi_contact.core.surfaces import ContactSurface, empty_surface
from vi_contact.core.system import SemiDiscreteSystem
from vi_contact.core.units import STANDARD_GRAVITY
from vi_contact.engineering.modal import lowest_frequency
from vi_contact.fem.assembly import assemble
from vi_contact.fem.communicators import MpiComm
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.fem.loads import BodyForce
from vi_contact.fem.mesh import build_mesh
from vi_contact.laws.excitation import Harmonic
from vi_contact.laws.impact import Inelastic
from vi_contact.laws.mass import ConsistentMass
from vi_contact.laws.materials import Damping, LinearElastic, NoDamping, PlaneStress
from vi_contact.meshes.wall import WallMesh

CASES = {
    "a": (4, 7, 10),  # the three labelled points of Fig. 2
    "b": tuple(range(2, 13)),  # eleven points; CHOSEN 2..12, the source says only how many
    "bilateral": tuple(range(2, 13)),  # the points of case b, held on the ground
    "free": (),  # no contact: the linear run
}
BASE_INERTIA = {  # which mass the ground accelerates, and what log and summary say about it
    "whole": (
        "inertia load of the ground motion: the whole mass, that which elements share with the "
        "base included"
    ),
    "catalogue": (
        "inertia load of the ground motion: the convention of the catalogue's reference numbers, "
        "which leave out the mass that elements share with the base"
    ),
}


@dataclass(frozen=True)
class Wall:
    """Describe geometry and material of Fig. 2, in SI units.

    width: CHOSEN 6 m (8 base intervals of the 0.75 m spacing that 12 intervals on 9 m give).
    thickness: d = 0.20 m. rho: CHOSEN 2400 kg/m³, concrete (0.24 in the technical system).
    Divisions: the source's boundary nodes, 8 x 12.
    """

    height: float = 9.0
    width: float = 6.0
    thickness: float = 0.20
    material: LinearElastic = field(
        default_factory=lambda: LinearElastic(E=2.0e10, nu=0.0, rho=2400.0)
    )
    damping: Damping = field(default_factory=NoDamping)
    divisions: tuple[int, int] | None = (8, 12)
    size: float | None = None
    triangles: bool = False

    def mesh(self) -> WallMesh:
        """Return the Gmsh description; a ``size`` replaces the exact divisions."""
        divisions = None if self.size is not None else self.divisions
        return WallMesh(
            height=self.height,
            width=self.width,
            divisions=divisions,
            size=self.size,
            triangles=self.triangles,
        )

    def point(self, number: int) -> tuple[float, float]:
        """Return the source's boundary points 1..40.

        They go anticlockwise from the right side above the base.

        1-12 right side upwards (12 = top right corner), 13-20 top, 21-32 left side downwards, 33-40
        base.
        """
        if not 1 <= number <= 40:
            raise InputError(
                f"the wall has boundary points 1 to 40 (Fig. 2), there is no point {number}"
            )
        dx, dy = self.width / 8.0, self.height / 12.0
        if number <= 12:
            return self.width, number * dy
        if number <= 20:
            return self.width - (number - 12) * dx, self.height
        if number <= 32:
            return 0.0, self.height - (number - 20) * dy
        return (number - 32) * dx, 0.0


@dataclass(frozen=True)
class WallModel:
    """Hold the assembled wall: system, mesh and named boundaries."""

    wall: Wall
    mesh: Any
    tags: Any
    system: SemiDiscreteSystem

    def surface(self, case: str) -> ContactSurface:
        """Make the contact conditions of a case of CASES, or of the whole side for "face"."""
        ground = HalfSpace(point=(self.wall.width, 0.0), normal=(-1.0, 0.0))
        if case == "face":
            return contact_surface(self.system, self.tags["face"], obstacle=ground)
        if case not in CASES:
            raise InputError(f"unknown case '{case}': choose one of {', '.join(CASES)}")
        if case == "free":
            return empty_surface(MpiComm(self.mesh.comm), 2)
        points = [self.wall.point(number) for number in CASES[case]]
        surface = contact_surface(self.system, self.tags["face"], obstacle=ground, points=points)
        return surface.bilateral_everywhere() if case == "bilateral" else surface

    def problem(
        self,
        case: str,
        *,
        excitation: Excitation | Sequence[Excitation] | None = None,
        impact: ImpactLaw | None = Inelastic(),
        mass: MassLaw | None = None,
    ) -> ContactProblem:
        """Set up the wall in a case.

        By default there are the harmonic of Fig. 3 and the source's inelastic impact on its mass.

        Schemes with massless contact nodes take impact=None and their own mass; an impact law runs
        on consistent mass.
        """
        return ContactProblem(
            self.system,
            self.surface(case),
            impact=impact,
            mass=ConsistentMass() if impact is not None and mass is None else mass,
            excitation=self.harmonic() if excitation is None else excitation,
        )

    def harmonic(self, amplitude: float = 1.0) -> Harmonic:
        """Return a_g = a0 sin(2 pi f t), f = f1/2.

        CHOSEN: Fig. 3 prints neither amplitude nor period; a0 = 1 m/s².
        """
        return Harmonic(amplitude, 0.5 * lowest_frequency(self.system), direction=(1.0, 0.0))

    def time_step(self) -> float:
        """Return dt = 1/(40 f), a fortieth of the period of ``harmonic``. CHOSEN."""
        return 1.0 / (20.0 * lowest_frequency(self.system))

    def probes(self) -> dict[str, tuple[float, float]]:
        """Return the points that the figures show.

        They are contact points, points between them, top and far side.
        """
        return {str(number): self.wall.point(number) for number in (4, 6, 7, 10, 12, 26)}


def build(wall: Wall, comm: Any, *, weight: bool = False, base_inertia: str = "whole") -> WallModel:
    """Mesh and assemble the wall; ``weight`` adds its own weight, for a gravity stage.

    base_inertia: a word of BASE_INERTIA. "catalogue" reproduces the numbers of
    docs/start/first_wall.md, whose inertia load is 1.4 % short on 8 x 12 elements.
    """
    check_word("base_inertia", base_inertia, list(BASE_INERTIA))
    mesh, tags = build_mesh(wall.mesh(), comm)
    loads = (BodyForce((0.0, -wall.material.rho * STANDARD_GRAVITY)),) if weight else ()
    system = assemble(
        mesh,
        wall.material,
        section=PlaneStress(wall.thickness),
        clamped=tags["base"],
        loads=loads,
        damping=wall.damping,
        base_inertia=base_inertia == "whole",
    )
    return WallModel(wall, mesh, tags, replace(system, notes=(BASE_INERTIA[base_inertia],)))
