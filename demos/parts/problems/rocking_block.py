"""Model a stiff block that stands on the ground with its two lower corners.

It is the rigid limit of contact.

The base may lift but not slide: in small displacements the base of a block that turns about one of
its corners does not move sideways, so its horizontal displacement is held. The weight's lever arm b
- h theta is a second-order effect, the geometric stiffness of the gravity stage. In the rigid limit
the block therefore is the slender block

    phi'' = p_eff² (phi - 1)            (theta > 0, mirrored below)
    phi = theta/(b/h),  p_eff² = p² h/R = p² cos(alpha)

where Housner's has phi = theta/alpha and p²: for b/h = 0.2, angles 1.3 % larger and times 1.0 %
longer at equal phi. The restitution e = 1 - (3/2) sin²(alpha) is Housner's: the mass matrix knows
the true moments of inertia.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from demos.parts.problems.geometric_stiffness import geometric_stiffness
from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import Excitation
from vi_contact.core.step import Columns, Report, Row, State
from vi_contact.exact import HousnerBlock
from vi_contact.fem.assembly import assemble
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.fem.loads import BodyForce, Prescribed
from vi_contact.fem.mesh import build_mesh
from vi_contact.laws.materials import Damping, LinearElastic, PlaneStress, Rayleigh
from vi_contact.meshes.block import BlockMesh
from vi_contact.run.static import static_equilibrium
from vi_contact.run.time_steps import HalvedAtImpact

RIGID = 200.0  # least sqrt(E/rho)/height over p


@dataclass(frozen=True)
class RockingBlock:
    """Describe width and height of ``shape`` [m].

    With them come a material stiff enough to be rigid, and the mesh.

    ``damping``: the default is 5 % of critical in the block's lowest bending vibration and nothing
    in rigid rotations; without it the vibrations of an impact last and stir the next one.
    InputError unless sqrt(E/rho)/height >= 200 p (waves cross the block many times while it rocks
    once), and for fewer than 4 elements over the height.
    """

    shape: HousnerBlock = field(default_factory=lambda: HousnerBlock(width=0.4, height=2.0))
    material: LinearElastic = field(
        default_factory=lambda: LinearElastic(E=3.0e10, nu=0.0, rho=2400.0)
    )
    damping: Damping = field(default_factory=lambda: Rayleigh(alpha=0.0, beta=3.0e-4))
    divisions: tuple[int, int] = (2, 10)

    def __post_init__(self) -> None:
        least = self.material.rho * (RIGID * self.shape.p * self.shape.height) ** 2
        if least > self.material.E:
            raise InputError(
                f"RockingBlock: E = {self.material.E:g} Pa is too soft for a rigid block of this "
                f"size: give at least {least:.2g} Pa"
            )
        if self.divisions[1] < 4:
            raise InputError(
                f"RockingBlock: {self.divisions[1]} elements over the height: give at least 4"
            )

    @property
    def overturning_angle(self) -> float:
        """Return b/h [rad]: at rest there the weight has no lever arm, in small displacements."""
        return self.shape.width / self.shape.height

    @property
    def p(self) -> float:
        """Return p_eff = p sqrt(cos(alpha)) [1/s]."""
        return self.shape.p * math.sqrt(math.cos(self.shape.alpha))

    @property
    def mass(self) -> float:
        """Return the mass [kg] for a thickness of 1 m."""
        return self.material.rho * self.shape.width * self.shape.height

    def motion(self, theta0: float, t: Array) -> Array:
        """Return theta(t) [rad] of the rigid limit released at rest.

        It is Housner's phi, p_eff for p and b/h for alpha.
        """
        return self._scaled(self.shape.free_rocking(self._twin(theta0), t * self.p / self.shape.p))

    def impact_times(self, theta0: float, impacts: int) -> Array:
        """Return the times of the first impacts of the rigid limit [s]."""
        return self.shape.impact_times(self._twin(theta0), impacts) * self.shape.p / self.p

    def amplitudes(self, theta0: float, impacts: int) -> Array:
        """Return the largest abs(theta) of the rigid limit after 0, 1, ... impacts [rad]."""
        return self._scaled(self.shape.amplitudes(self._twin(theta0), impacts))

    def _twin(self, theta0: float) -> float:
        """Housner's angle with the same phi."""
        return theta0 / self.overturning_angle * self.shape.alpha

    def _scaled(self, theta: Array) -> Array:
        return np.asarray(theta / self.shape.alpha * self.overturning_angle)


@dataclass(frozen=True)
class RockingModel:
    """Hold the model.

    ``problem``: the block with geometric stiffness; ``rest``: the block still under its weight.
    """

    block: RockingBlock
    problem: ContactProblem
    rest: State

    def shaken(self, excitation: Excitation | Sequence[Excitation]) -> ContactProblem:
        """Set up the problem on a ground that moves."""
        return replace(self.problem, excitation=excitation)

    def time_steps(self, *, dt: float | None = None, halvings: int = 4) -> HalvedAtImpact:
        """Return steps of 1/(400 p).

        They are halved where a corner lands, as the loss of an impact needs its time resolved.
        """
        return HalvedAtImpact(1.0 / (400.0 * self.block.shape.p) if dt is None else dt, halvings)

    def tilted(self, theta: float, *, rate: float = 0.0) -> State:
        """Return the block at rest, turned by theta [rad] about its lower left corner.

        It turns at ``rate`` [rad/s].
        """
        u = self.rest.u + theta * self._turn
        v = rate * self._turn
        none = np.zeros(self.problem.surface.count)
        return replace(self.rest, u=u, v=v, r_n=none, active=none.astype(bool))

    @property
    def onset_acceleration(self) -> float:
        """Return the horizontal acceleration [m/s²] that lifts the block.

        It does so when it grows slowly, and is m g b / turn·M r.
        """
        system = self.problem.equations
        overturning = float(system.algebra.dot(self._turn, system.inertia(np.array([1.0, 0.0]))))
        return (
            0.5
            * self.block.mass
            * self.block.shape.gravity
            * self.block.shape.width
            / abs(overturning)
        )

    def angle(self, state: State) -> float:
        """Return the rotation [rad] by the heights of the corners.

        It is positive when the right one is up.
        """
        surface = self.problem.surface
        down = surface.everywhere(surface.normal_values(state.u - self.rest.u))
        return float(down[0] - down[1]) / self.block.shape.width

    def spin(self, state: State) -> float:
        """Return the angular velocity [rad/s] by vertical velocities.

        It is s·M v / s·M s with s = (x - b) e_y.
        """
        return float(self.problem.system.algebra.dot(self._spin, state.v))

    @cached_property
    def _turn(self) -> Array:
        """Displacements of a unit turn to the left about the lower left corner, x = 0."""
        system = self.problem.equations
        x = system.space.coordinates
        return np.asarray(system.influence[:, 1] * x[:, 0] - system.influence[:, 0] * x[:, 1])

    @cached_property
    def _spin(self) -> Array:
        """M s / s·M s."""
        system = self.problem.equations
        s = system.influence[:, 1] * (system.space.coordinates[:, 0] - 0.5 * self.block.shape.width)
        momentum = system.M @ s
        return np.asarray(momentum / system.algebra.dot(s, momentum))


@dataclass(frozen=True)
class Rocking:
    """Record the rotation, angular velocity and corner reactions of a model's block."""

    model: RockingModel

    def columns(self) -> Columns:
        """Return the columns theta, theta_rate, r_left, r_right."""
        return {
            "theta": ("rad", "rotation, positive when the right corner is up"),
            "theta_rate": ("rad/s", "angular velocity, mean over the block by mass"),
            "r_left": ("N", "reaction of the ground at the left corner, mean of the step"),
            "r_right": ("N", "reaction of the ground at the right corner, mean of the step"),
        }

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Row:
        """Return the row of the initial state."""
        return self._row(state)

    def row(self, report: Report) -> Row:
        """Return the values of a step."""
        return self._row(report.new)

    def _row(self, state: State) -> Row:
        left, right = self.model.problem.surface.everywhere(state.r_n)
        return {
            "theta": self.model.angle(state),
            "theta_rate": self.model.spin(state),
            "r_left": float(left),
            "r_right": float(right),
        }


def build(block: RockingBlock, comm: Any) -> RockingModel:
    """Build mesh, gravity stage and second-order system of the block.

    The stresses are those of the block on its whole base: standing on its corners it pushes them
    apart, and the thrust of the held base would be counted as weight (virial theorem, see
    ``geometric_stiffness``).
    """
    width, height, gravity = block.shape.width, block.shape.height, block.shape.gravity
    mesh, tags = build_mesh(BlockMesh(lengths=(width, height), divisions=block.divisions), comm)
    system = assemble(
        mesh,
        block.material,
        section=PlaneStress(1.0),
        damping=block.damping,
        prescribed=Prescribed(tags["bottom"], components=(0,)),
        loads=BodyForce((0.0, -block.material.rho * gravity)),
    )
    ground = HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    whole = ContactProblem(system, contact_surface(system, tags["bottom"], obstacle=ground))
    heavy = geometric_stiffness(whole, static_equilibrium(whole))
    corners = contact_surface(
        heavy, tags["bottom"], obstacle=ground, points=[(0.0, 0.0), (width, 0.0)]
    )
    problem = ContactProblem(heavy, corners)
    return RockingModel(block, problem, static_equilibrium(problem))


def impacts(history: Mapping[str, Array]) -> tuple[Array, Array]:
    """Return (times when theta passes zero [s], largest abs(theta) between) of a free block.

    The angle [rad] is that between them and before.

    The other side counts once a thousandth of the largest rotation is reached there: landing
    corners may chatter.
    """
    t, theta = history["t"], history["theta"]
    rows = np.flatnonzero(np.abs(theta) > 1e-3 * np.max(np.abs(theta)))
    times = []
    for row in rows[:-1][theta[rows[1:]] * theta[rows[:-1]] < 0.0]:
        after = row + int(np.argmax(theta[row:] * theta[row] <= 0.0))
        share = theta[after - 1] / (theta[after - 1] - theta[after])
        times.append(float(t[after - 1] + share * (t[after] - t[after - 1])))
    ends = np.searchsorted(t, [t[0], *times])
    peaks = [
        float(np.max(np.abs(theta[i : j + 1]))) for i, j in zip(ends[:-1], ends[1:], strict=True)
    ]
    return np.array(times), np.array(peaks)


def restitution(block: RockingBlock, history: Mapping[str, Array], impact: float) -> float:
    """Return the ratio of angular velocities over the first impact at time ``impact`` [s].

    Means from 0.1/p to 0.3/p before and after it of the velocity that the rigid block has there at
    theta = 0, sqrt(theta'² + p² theta (2b/h - theta)), which is constant between impacts:
    vibrations have left the mean by then.
    """
    t = history["t"]
    theta = np.abs(history["theta"])
    unit = 1.0 / block.p
    speed = np.sqrt(
        history["theta_rate"] ** 2 + theta * (2.0 * block.overturning_angle - theta) / unit**2
    )
    before = (t > impact - 0.3 * unit) & (t < impact - 0.1 * unit)
    after = (t > impact + 0.1 * unit) & (t < impact + 0.3 * unit)
    return float(np.mean(speed[after]) / np.mean(speed[before]))
