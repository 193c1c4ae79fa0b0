"""Pose bodies that turn, for tests, ``demos/column.py`` and ``benchmarks/turning.py``.

- ``spin_block``: a free block that spins.
- ``rock_block``: a block that leans on a corner, and is let go.
- ``shake_column``: a free-standing column on a ground that moves.
- ``pulse_column``: how far one turns under a pulse, beside the rigid block.

Beside them stands the rigid block (Housner, Bull. Seism. Soc. Am. 53, 1963), at any angle: R is
half its diagonal, alpha = atan(width/height), p² = 3g/4R, and about its corner

    theta'' = -p² (sin(alpha - theta) - a/g cos(alpha - theta))

where a is the acceleration of the ground towards the corner.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import atan2, cos, hypot, pi, sin, sqrt
from typing import Any

import numpy as np

import vi_contact as vc
from vi_contact import fem
from vi_contact.meshes.block import BlockMesh

GRAVITY = 9.81  # m/s²
STONE = vc.SaintVenantKirchhoff(E=1e8, nu=0.0, rho=2000.0)  # soft, so that 50 steps see its waves
SECONDS = 2.0  # that a column is followed after a pulse
FALLEN = 1.0  # rad, from which on it falls
ROUGH = vc.Coulomb(5.0)  # corners do not slide, as those of the rigid block


@dataclass(frozen=True)
class RigidBlock:
    """Hold a rigid block that does not slide.

    Attributes:
        width: of the base [m].
        height: [m].
    """

    width: float
    height: float

    @property
    def radius(self) -> float:
        """Return R, from a corner to the middle [m]."""
        return 0.5 * hypot(self.width, self.height)

    @property
    def alpha(self) -> float:
        """Return the angle at which it stands on its corner without falling [rad]."""
        return atan2(self.width, self.height)

    @property
    def p2(self) -> float:
        """Return p² [1/s²]."""
        return 0.75 * GRAVITY / self.radius

    def find_quarter(self, theta0: float) -> float:
        """Return the time [s] from rest at an angle to the landing of the base.

        By energy it is ∫ d theta / sqrt(2 p² (cos(alpha - theta0) - cos(alpha - theta))) over
        theta from 0 to theta0; with theta = theta0 (1 - s²) the integrand is smooth.
        """
        s, weights = np.polynomial.legendre.leggauss(60)
        s = 0.5 * (s + 1.0)
        theta = theta0 * (1.0 - s**2)
        fall = np.cos(self.alpha - theta0) - np.cos(self.alpha - theta)
        return float(0.5 * weights @ (2.0 * theta0 * s / np.sqrt(2.0 * self.p2 * fall)))

    def fall_over(self, acceleration: Callable[[float], float], t_end: float) -> Any:
        """Return theta(t), theta'(t) from rest on its base until it lies, as SciPy's solution.

        Args:
            acceleration: of the ground towards the corner [m/s²], a function of t [s].
            t_end: when to give up [s].
        """
        from scipy.integrate import solve_ivp

        def rate(t: float, y: Any) -> list[float]:
            lean = self.alpha - y[0]
            moment = sin(lean) - acceleration(t) / GRAVITY * cos(lean)
            on_base = y[0] <= 0.0 and y[1] <= 0.0 and moment > 0.0
            return [0.0, 0.0] if on_base else [y[1], -self.p2 * moment]

        def lies(t: float, y: Any) -> float:
            return float(y[0] - 0.5 * pi)

        lies.terminal = True  # type: ignore[attr-defined]
        return solve_ivp(
            rate,
            (0.0, t_end),
            [0.0, 0.0],
            events=lies,
            rtol=1e-10,
            atol=1e-12,
            max_step=1e-3,
            dense_output=True,
        )


def turn_about(centre: np.ndarray, angle: float) -> Callable[[Any], Any]:
    """Return the displacements of points (k, 2) turned clockwise about a point.

    Args:
        centre: (2,) [m].
        angle: [rad].
    """
    R = np.array([[cos(angle), sin(angle)], [-sin(angle), cos(angle)]])
    return lambda points: (points - centre) @ R.T - (points - centre)


def spin_block(
    comm: Any,
    material: Any,
    *,
    lengths: tuple[float, ...] = (0.5, 1.0),
    divisions: tuple[int, ...] = (4, 8),
    spin: tuple[float, float, float] = (0.0, 0.0, 2.0 * pi),
    simplices: bool = False,
    degree: int = 1,
    **more: Any,
) -> vc.ContactProblem:
    """Return a free block far above a floor, which spins about its middle.

    Args:
        comm: the ranks.
        material: of the block.
        lengths: (d,) of its sides [m].
        divisions: (d,) cells along them.
        spin: angular velocity [rad/s]; in the plane its third component.
        simplices: whether cells are split.
        degree: of the displacement.
        more: arguments of ``fem.assemble``.
    """
    d = len(lengths)
    block = BlockMesh(
        lengths=lengths,
        divisions=divisions,
        simplices=simplices,
        corner=tuple(-0.5 * length for length in lengths),
    )
    mesh, _ = fem.build_mesh(block, comm)

    def velocity(points: Any) -> Any:
        if d == 3:
            return np.cross(spin, points)
        return spin[2] * np.column_stack([-points[:, 1], points[:, 0]])

    given: dict[str, Any] = {"initial_velocity": velocity, "degree": degree} | more
    system = fem.assemble(mesh, material, **given)
    up = np.eye(d)[-1]
    floor = vc.HalfSpace(tuple(-50.0 * up), tuple(up))
    return vc.ContactProblem(system, fem.contact_surface(system, obstacle=floor))


def find_momenta(problem: vc.ContactProblem, state: Any) -> np.ndarray:
    """Return the momentum (d,) [N s] and the spin about the origin [N m s] of a state.

    They are ∑ p and ∑ (X + u) x p of the nodal momenta p = M v. Collective.
    """
    system = problem.system
    d = system.space.dimension
    u = problem.cartesian(state.u).reshape(-1, d)
    p = (system.M @ problem.cartesian(state.v)).reshape(-1, d)
    y = system.space.coordinates[::d] + u
    planes = [(0, 1)] if d == 2 else [(1, 2), (2, 0), (0, 1)]
    spin = np.column_stack([y[:, i] * p[:, j] - y[:, j] * p[:, i] for i, j in planes])
    return np.asarray(system.algebra.comm.sum(np.concatenate([p.sum(axis=0), spin.sum(axis=0)])))


def find_energy(problem: vc.ContactProblem, state: Any) -> float:
    """Return kinetic and stored energy less the work of the constant load [J]. Collective."""
    system = problem.equations
    work = system.algebra.dot(system.load.constant, state.u)
    return system.kinetic_energy(state.v) + system.strain_energy(state.u) - work


def rock_block(
    comm: Any,
    block: RigidBlock,
    theta0: float,
    *,
    material: Any = STONE,
    divisions: tuple[int, int] = (4, 8),
    friction: Any = ROUGH,
    **more: Any,
) -> vc.ContactProblem:
    """Return a block that leans on its right corner by an angle, at rest.

    Args:
        comm: the ranks.
        block: its sides.
        theta0: the angle, clockwise [rad].
        material: of the block.
        divisions: cells along the sides.
        friction: of the floor.
        more: other laws of the ContactProblem.
    """
    system = _stand(comm, block, material, divisions, theta0)
    return vc.ContactProblem(system, make_floor(system), friction=friction, **more)


def shake_column(
    comm: Any,
    block: RigidBlock,
    excitation: Any,
    *,
    material: Any = STONE,
    divisions: tuple[int, int] = (4, 16),
    friction: Any = ROUGH,
    **more: Any,
) -> vc.ContactProblem:
    """Return a column that stands on a moving ground.

    Args:
        comm: the ranks.
        block: its sides.
        excitation: of the ground.
        material: of the column.
        divisions: cells along the sides.
        friction: of the ground.
        more: other laws of the ContactProblem.
    """
    system = _stand(comm, block, material, divisions, 0.0)
    return vc.ContactProblem(
        system, make_floor(system), friction=friction, excitation=excitation, **more
    )


def pulse_column(
    comm: Any, block: RigidBlock, strength: float, duration: float
) -> tuple[float, float]:
    """Return how far a column and the rigid block turn under half a sine [rad]. Collective.

    They are followed for two seconds, or until they have fallen (``FALLEN``).

    Args:
        comm: the ranks.
        block: the column.
        strength: of the pulse, over the acceleration g tan(alpha) that lifts the base off.
        duration: of the pulse [s].
    """
    amplitude = strength * GRAVITY * block.width / block.height
    pulse = vc.HalfSine(amplitude=-amplitude, duration=duration)
    rigid = block.fall_over(lambda t: -pulse.acceleration(t), SECONDS)
    stone = vc.SaintVenantKirchhoff(E=1e9, nu=0.0, rho=2000.0)
    problem = shake_column(comm, block, pulse, material=stone, divisions=(1, 4))
    tilt = 0.0
    for state, _ in vc.march(problem, dt=0.01, t_end=SECONDS):
        now = find_tilt(problem, state)
        tilt = max(tilt, now)
        if tilt > FALLEN or now < -0.5 * block.alpha:
            break
    return tilt, float(rigid.y[0].max())


def make_floor(system: Any) -> Any:
    """Return the conditions of all boundary nodes with the floor y = 0."""
    return fem.contact_surface(system, obstacle=vc.HalfSpace((0.0, 0.0), (0.0, 1.0)))


def find_tilt(problem: vc.ContactProblem, state: Any) -> float:
    """Return by how much the base of a block has turned clockwise [rad]. Collective."""
    space: Any = problem.system.space
    points = np.array([[0.0, 0.0], [space.comm.max(np.max(space.points[:, 0])), 0.0]])
    nodes = space.find_nodes(points)
    u = space.sample(problem.cartesian(state.u), nodes, state.t)
    side = (points + u)[0] - (points + u)[1]
    return atan2(side[1], -side[0])


def find_landing(block: RigidBlock, t: float, tilt: float, before: float, dt: float) -> float:
    """Return when the base lands, by the parabola of the rigid block's fall [s].

    Args:
        block: the block.
        t: a time before the landing [s].
        tilt: at that time [rad].
        before: a step before it [rad].
        dt: the step [s].
    """
    push = block.p2 * sin(block.alpha)
    rate = (before - tilt) / dt + 0.5 * push * dt
    return t + (sqrt(rate**2 + 2.0 * push * tilt) - rate) / push


def _stand(
    comm: Any, block: RigidBlock, material: Any, divisions: tuple[int, int], angle: float
) -> Any:
    """Return the system of a block on its base, turned clockwise about its right corner."""
    mesh, _ = fem.build_mesh(
        BlockMesh(lengths=(block.width, block.height), divisions=divisions), comm
    )
    corner = np.array([block.width, 0.0])
    return fem.assemble(
        mesh,
        material,
        loads=fem.BodyForce((0.0, -GRAVITY * material.rho)),
        initial_displacement=turn_about(corner, angle),
    )


def find_tilts(block: RigidBlock, history: Any) -> np.ndarray:
    """Return the clockwise turns of the base [rad] of a history.

    Args:
        block: the block.
        history: with the displacements of a probe at its corners "left" and "right".
    """
    across = block.width + history["u_x_right"] - history["u_x_left"]
    up = history["u_y_left"] - history["u_y_right"]
    return np.asarray(np.unwrap(np.arctan2(up, across)))
