"""Model a rigid body that hits a plane without friction.

See b-geometry, ENOC 2017, "Spatial collision", 39 to 53.

Coordinates q = (r_c, p): mass centre and unit quaternion p = (p_0, p_1, p_2, p_3), R(p) from body
to space. Velocities v = (ṙ_c, Omega), Omega in the body frame (39); M = diag(m 1, J) (40) is
constant. The plane is n·x = d, the body before it, n·x > d; P is the body's point next to the
plane, l_P in the body frame:

    rho = n·(r_c + R l_P) - d,    A = (n; l_P x Rᵀn)        (45, 46)
    M v̇ = (F; T - Omega x J Omega) + Aᵀ lambda
    ṗ = ½ p ∘ (0, Omega)

The impact map, which the motion through a thin layer tends to: v⁺ = v⁻ - M⁻¹Aᵀ g_11 (1 + e) ρ̇⁻,
with the loss ½ g_11 (1 - e²) ρ̇⁻² and all momenta orthogonal to A unchanged.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.algebra import Array
from ..core.checks import array, find_shape, number
from ..core.errors import InputError
from .layer import check_size
from .motion import ConstrainedSystem, check_positive


@dataclass(frozen=True)
class Ellipsoid:
    """Find the point of an ellipsoid next to a plane, for ``point`` of ``RigidBody``.

    It has semi-axes ``axes`` [m] (along the body axes, about the mass centre): l = -D² nu/|D nu|, D
    = diag(axes), nu the plane's normal in the body frame.

    Raises:
        InputError: a semi-axis is not positive.
    """

    axes: tuple[float, float, float]

    def __post_init__(self) -> None:
        for length in array("Ellipsoid", "axes", self.axes, (3,), unit="m"):
            check_size("Ellipsoid", "a semi-axis of the ellipsoid", float(length), "m")

    def __call__(self, nu: Array) -> Array:
        """Return the point for the plane's normal nu in the body frame."""
        squares = np.asarray(self.axes, dtype=float) ** 2
        return np.asarray(-squares * nu / np.sqrt(nu @ (squares * nu)))


@dataclass(frozen=True)
class RigidBody:
    """Describe a rigid body before a plane.

    Coordinates, velocities and equations are those at the head of this file.

    Args:
        mass: [kg].
        inertia: (3, 3) or its diagonal (3,), about the mass centre in the body frame [kg m²].
        point: l_P (3,) [m], or a function of the plane's normal in the body frame that returns it
            (``Ellipsoid``).
        normal: n, of the plane, towards the body.
        offset: d [m], of the plane n·x = d.
        gravity: acceleration of free fall in space (3,) [m/s²].

    Raises:
        InputError: mass or inertia is not positive, or the normal has length zero.

    Source: ENOC 2017, Spatial collision, equations 39 to 53.
    """

    mass: float
    inertia: Any
    point: Any
    normal: tuple[float, float, float] = (0.0, 0.0, 1.0)
    offset: float = 0.0
    gravity: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        owner = "RigidBody"
        check_size(owner, "the body's mass", self.mass, "kg")
        is_matrix = len(find_shape(self.inertia)) == 2
        array(owner, "inertia", self.inertia, (3, 3) if is_matrix else (3,), unit="kg m²")
        if not callable(self.point) or isinstance(self.point, type):
            array(owner, "point", self.point, (3,), unit="m")
        for name in ("normal", "gravity"):
            array(owner, name, getattr(self, name), (3,))
        number(owner, "offset", self.offset, unit="m")
        check_positive(owner, "the body's inertia", self.J, "kg m²")
        if not np.linalg.norm(self.normal) > 0.0:
            raise InputError("RigidBody: the plane's normal has length zero; give a direction")

    @property
    def J(self) -> Array:
        """Return the inertia (3, 3)."""
        J = np.asarray(self.inertia, dtype=float)
        return np.diag(J) if J.ndim == 1 else J

    @property
    def n(self) -> Array:
        """Return the unit normal (3,)."""
        return np.asarray(self.normal, dtype=float) / np.linalg.norm(self.normal)

    @property
    def matrix(self) -> Array:
        """Return M = diag(m 1, J) (40), (6, 6)."""
        return np.block([[self.mass * np.eye(3), np.zeros((3, 3))], [np.zeros((3, 3)), self.J]])

    def nearest(self, q: Array) -> tuple[Array, Array]:
        """Return the nearest point and the normal, (l_P, n), in the body frame."""
        nu = rotation(q[3:]).T @ self.n
        point = self.point(nu) if callable(self.point) else self.point
        return np.asarray(point, dtype=float), nu

    def rho(self, q: Array) -> float:
        """Return the distance of P from the plane [m] (44), q as of ``after_impact``."""
        l_P, nu = self.nearest(q)
        return float(self.n @ q[:3] + nu @ l_P) - self.offset

    def gradient(self, q: Array) -> Array:
        """Return A (6,) of (45), (46)."""
        l_P, nu = self.nearest(q)
        return np.concatenate([self.n, np.cross(l_P, nu)])

    def kinetic_energy(self, v: Array) -> float:
        """Return ½ vᵀMv [J]."""
        return float(0.5 * v @ self.matrix @ v)

    def energy(self, q: Array, v: Array) -> float:
        """Return the kinetic energy less the work of gravity [J]."""
        return self.kinetic_energy(v) - self.mass * float(np.dot(self.gravity, q[:3]))

    def normal_mass(self, q: Array) -> float:
        """Return g_11 of (50) [kg]."""
        A = self.gradient(q)
        return float(1.0 / (A @ np.linalg.solve(self.matrix, A)))

    def after_impact(self, q: Array, v: Array, e: float) -> Array:
        """Return the velocity v⁺ (6,) after an impact, by the impact map.

        Args:
            q: mass centre [m] and unit quaternion (7,).
            v: velocity of the mass centre [m/s] and spin in the body [rad/s] before it (6,).
            e: restitution [-].

        Raises:
            InputError: another shape, or a negative e.
        """
        owner = "RigidBody.after_impact"
        q = array(owner, "q", q, (7,))
        v = array(owner, "v", v, (6,))
        number(owner, "e", e, not_negative=True)
        A = self.gradient(q)
        along = np.linalg.solve(self.matrix, A)
        return np.asarray(v - along * (1.0 + e) * (A @ v) / (A @ along))

    def system(self) -> ConstrainedSystem:
        """Return the system for ``layer_motion``: coordinates (7,), velocities (6,)."""
        turning = None if callable(self.point) else self._turning
        return ConstrainedSystem(
            self.matrix,
            self.rho,
            self.gradient,
            force=self._force,
            rates=_rates,
            gradient_rate=turning,
        )

    def _force(self, t: float, q: Array, v: Array) -> Array:
        """Return (m g, -Omega x J Omega), (6,) [N, N m], at any time and place."""
        spin = v[3:]
        weight = self.mass * np.asarray(self.gravity)
        return np.concatenate([weight, -np.cross(spin, self.J @ spin)])

    def _turning(self, q: Array, v: Array) -> float:
        """Return Ȧ v = n·R (Omega x (Omega x l_P)), of a point fixed in the body."""
        l_P, nu = self.nearest(q)
        return float(nu @ np.cross(v[3:], np.cross(v[3:], l_P)))


def rotation(p: Array) -> Array:
    """Return R (3, 3) of the quaternion p (4,), which need not have length one."""
    array("rotation", "p", p, (4,))
    # As it lies in memory, and not the copy of the check: a copy is rounded in another order, which
    # a body that strikes again and again makes visible.
    p = np.asarray(p, dtype=float)
    w, x, y, z = p / np.linalg.norm(p)
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y - w * z), 2.0 * (x * z + w * y)],
            [2.0 * (x * y + w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z - w * x)],
            [2.0 * (x * z - w * y), 2.0 * (y * z + w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def _rates(q: Array, v: Array) -> Array:
    """Return q̇ = (ṙ_c, ½ p ∘ (0, Omega)), (7,)."""
    w = q[3]
    u = q[4:]
    spin = v[3:]
    return np.concatenate([v[:3], 0.5 * np.r_[-(u @ spin), w * spin + np.cross(u, spin)]])
