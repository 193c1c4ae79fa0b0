"""Model a ball that is thrown on a rigid plane.

It is a quarter of tetrahedra with two planes of symmetry.

It flies down along -y without gravity and strikes the plane with its lowest point. Forces, masses
and energies of the model are a quarter of the ball's: times ``QUARTERS`` they compare with those of
``vi_contact.exact.hertz``.
"""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import betaincinv

from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import MassLaw
from vi_contact.core.system import SemiDiscreteSystem
from vi_contact.exact.hertz import HertzImpact, contact_modulus
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import Prescribed
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.fem.mesh.tagged_mesh import build_mesh
from vi_contact.laws.materials import LinearElastic
from vi_contact.meshes.ball import BallMesh

QUARTERS = 4.0
FOOT = 1.3  # contact side over the largest contact radius
CELL_GROWTH = 1.2


@dataclass(frozen=True)
class Ball:
    """Describe a ball of ``radius`` [m] at ``height`` [m] above the plane.

    It has ``speed`` [m/s] towards the plane.

    The mesh has ``cells`` cells in the largest contact radius and about as many in the radius of
    the ball; from one size to the other they grow by 1.2/cells of the distance: twice the number
    refines everything, everywhere. InputError for fewer than 3 cells or height < 0.
    """

    radius: float = 0.01
    speed: float = 0.1
    height: float = 1.0e-7
    material: LinearElastic = field(
        default_factory=lambda: LinearElastic(E=2.1e11, nu=0.3, rho=7800.0)
    )
    cells: float = 5.0

    def __post_init__(self) -> None:
        if not self.cells >= 3.0 or not self.height >= 0.0:
            raise InputError(
                f"Ball: {self.cells!r} cells in the contact radius, {self.height!r} m above the "
                "plane; give at least 3 cells and a height >= 0"
            )

    def impact(self, mass: float) -> HertzImpact:
        """Return the quasi-static impact of such a ball of that mass [kg]."""
        modulus = contact_modulus((self.material.E, self.material.nu))
        return HertzImpact(mass=mass, speed=self.speed, modulus=modulus, radius=self.radius)

    @property
    def mesh(self) -> BallMesh:
        """Return the mesh, fine where the sphere of volume 4/3 pi R³ is going to touch."""
        sphere = 4.0 / 3.0 * math.pi * self.radius**3
        a = self.impact(self.material.rho * sphere).deepest.contact_radius
        return BallMesh(
            radius=self.radius,
            size=a / self.cells,
            foot=FOOT * a,
            growth=CELL_GROWTH / self.cells,
            coarsest=self.radius / self.cells,
        )


@dataclass(frozen=True)
class BallModel:
    """Hold the assembled quarter.

    ``mass`` [kg]: of the whole ball as the mesh has it, a little less than a sphere's.

    ``exact``: the quasi-static impact of that mass.
    """

    ball: Ball
    system: SemiDiscreteSystem
    foot: Any
    mass: float

    @property
    def exact(self) -> HertzImpact:
        """Return the impact of the mesh's mass, so that only the error of the mechanics differs."""
        return self.ball.impact(self.mass)

    def time_step(self, steps: int = 200) -> float:
        """Return the time step [s] that makes so many steps of the exact contact time."""
        return self.exact.duration / steps

    def problem(self, *, mass: MassLaw | None = None) -> ContactProblem:
        """Set up the ball above the plane y = -height."""
        plane = HalfSpace(point=(0.0, -self.ball.height, 0.0), normal=(0.0, 1.0, 0.0))
        return ContactProblem(
            self.system, contact_surface(self.system, self.foot, obstacle=plane), mass=mass
        )

    def probes(self) -> dict[str, tuple[float, ...]]:
        """Return the points foot, centre and top."""
        return {
            name: (0.0, share * self.ball.radius, 0.0)
            for name, share in (("foot", 0), ("centre", 1), ("top", 2))
        }


def build(ball: Ball, comm: Any) -> BallModel:
    """Mesh and assemble a quarter of the ball; collective."""
    mesh, tags = build_mesh(ball.mesh, comm)
    system = assemble(
        mesh,
        ball.material,
        prescribed=[
            Prescribed(tags["side_x"], components=(0,)),
            Prescribed(tags["side_z"], components=(2,)),
        ],
        initial_velocity=(0.0, -ball.speed, 0.0),
    )
    up = system.influence[:, 1]
    return BallModel(ball, system, tags["foot"], QUARTERS * system.algebra.dot(up, system.M @ up))


def hertz_motion(exact: HertzImpact, t: ArrayLike) -> tuple[Array, Array]:
    """Return (approach d [m], force F [N]) at times t [s].

    The times count from the first touch; both are zero before it and after the contact:

        m d'' = -F(d),  energy: d' = v sqrt(1 - x),  x = (d/d_max)^(5/2)
        =>  t/duration = ½ I_x(2/5, 1/2) until d_max

    with the regularised incomplete beta function I, and the same backwards; F = F_max
    (d/d_max)^(3/2).
    """
    phase = np.clip(np.asarray(t, dtype=float) / exact.duration, 0.0, 1.0)
    share = betaincinv(0.4, 0.5, 1.0 - np.abs(2.0 * phase - 1.0)) ** 0.4
    return exact.approach * share, exact.deepest.force * share**1.5
