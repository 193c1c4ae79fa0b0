"""Closed forms of spheres in contact, and the displacements that they leave in the bodies, far from
the contact too.

Two bodies touch on a disk of radius a under the pressure of Hertz, p = p0 √(1 - r²/a²), p0 = 3 P/(2
π a²). Each is an elastic half-space; "body" below is one of two equal ones, which move by opposite
amounts. Johnson, Contact Mechanics (1985), sections 3.2, 3.6, 3.9, 4.2, 7.2 and 7.4, where the
originals are found: Cattaneo, Sul contatto di due corpi elastici (Rend. Accad. Lincei 27, 1938);
Mindlin, Compliance of elastic bodies in contact (J. Appl. Mech. 16, 1949); Lubkin, The torsion of
elastic spheres in contact (J. Appl. Mech. 18, 1951); Mindlin and Deresiewicz, Elastic spheres in
contact under varying oblique forces (J. Appl. Mech. 20, 1953).

Coordinates of a body: depth y >= 0, surface y = 0, axis x = z = 0. Lengths [m], forces [N], moduli
[Pa].
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.special import ellipe, ellipk

from vi_contact.core.algebra import Array

rule = cache(np.polynomial.legendre.leggauss)


def gauss(low: float, high: float, *, order: int = 24) -> tuple[Array, Array]:
    """Points and weights on an interval."""
    points, weights = rule(order)
    return low + 0.5 * (high - low) * (1.0 + points), 0.5 * (high - low) * weights


def under_point_loads(points: Array, places: Array, forces: Array, *, G: float, nu: float) -> Array:
    """Displacements (k, 3) of a half-space under forces (m, 3) at places (m, 2) of its surface (x,
    z): Boussinesq and Cerruti, Johnson (3.18) and (3.75). Axes x, y (depth), z, all forces along
    them.
    """
    local = 1.0 - 2.0 * nu
    x, z = points[:, None, 0] - places[:, 0], points[:, None, 2] - places[:, 1]
    y, (fx, fy, fz) = points[:, None, 1], forces.T
    rho = np.sqrt(x * x + y * y + z * z)
    deep, along = rho + y, fx * x + fz * z
    both = 1.0 / rho + local / deep
    outward = along * (1.0 / rho**3 - local / (rho * deep**2)) + fy * (
        y / rho**3 - local / (rho * deep)
    )
    down = along * (y / rho**3 + local / (rho * deep)) + fy * (
        y * y / rho**3 + 2.0 * (1.0 - nu) / rho
    )
    u = [fx * both + x * outward, down, fz * both + z * outward]
    return np.column_stack([one.sum(axis=1) for one in u]) / (4.0 * np.pi * G)


def under_hertz(points: Array, a: float, force: Array, *, G: float, nu: float) -> Array:
    """Displacements (k, 3) far from tractions f √(1 - r²/a²), whose resultant is ``force`` (3,): 8
    x 16 point loads."""
    theta, weight = gauss(0.0, 0.5 * np.pi, order=8)
    angle = 2.0 * np.pi * np.arange(16) / 16
    share = np.repeat(3.0 * np.cos(theta) ** 2 * np.sin(theta) * weight, 16) / 16
    places = a * np.column_stack(
        [np.outer(np.sin(theta), f(angle)).reshape(-1) for f in (np.cos, np.sin)]
    )
    return under_point_loads(points, places, np.outer(share, force), G=G, nu=nu)


@dataclass(frozen=True)
class Mindlin:
    """Two equal bodies under P, then under Q = share μ P (Cattaneo, Mindlin).

        q = μ p0 [√(1 - r²/a²) - (c/a) √(1 - r²/c²)],  c = a (1 - Q/(μ P))^(1/3),  no slip on r < c
        shift of a body: 3 μ P (2 - ν)/(16 G a) [1 - (1 - Q/(μ P))^(2/3)]

    All slip is along Q: exact for ν = 0, where a shear traction along x moves the surface along x
    only.
    """

    force: float
    a: float
    mu: float
    G: float
    nu: float

    def stick(self, share: float) -> float:
        """c [m]."""
        return self.a * (1.0 - share) ** (1.0 / 3.0)

    def shift(self, share: float) -> float:
        """What a distant point of one body moves [m]; half of that of one body on the other."""
        moved = 1.0 - (1.0 - share) ** (2.0 / 3.0)
        return 3.0 * self.mu * self.force * (2.0 - self.nu) / (16.0 * self.G * self.a) * moved

    def traction(self, r: Array, share: float) -> Array:
        """q [Pa]."""
        p0, c = 1.5 * self.force / (np.pi * self.a**2), self.stick(share)
        whole, core = (np.sqrt(np.maximum(1.0 - (r / reach) ** 2, 0.0)) for reach in (self.a, c))
        return np.asarray(self.mu * p0 * (whole - c / self.a * core))

    def field(self, points: Array, share: float) -> Array:
        """Displacements (k, 3) of a body far from the tractions q along x; the body's own shift is
        not in them."""
        push = np.array([self.mu * self.force, 0.0, 0.0])
        given = {"G": self.G, "nu": self.nu}
        left = (1.0 - share) * under_hertz(points, self.stick(share), push, **given)
        return under_hertz(points, self.a, push, **given) - left


@dataclass(frozen=True)
class Lubkin:
    """Two equal spheres under P, twisted about the common normal by a moment T (Lubkin).

    The surface of a half-space under τ(r) about the axis turns by v(r):

        v(r) = (1/r) ∫_0^min(r,a) t φ(t)/√(r² - t²) dt,   τ(r) = -G d/dr ∫_r^a φ(t)/√(t² - r²) dt,
        T = 4 π G ∫_0^a t φ(t) dt

    Without slip v = β r, φ = (4 β/π) t, τ = 4 G β r/(π √(a² - r²)), T = (16/3) G a³ β: τ is
    infinite at the edge, and slip begins there at once. With slip on c < r < a, where τ = μ p,
    Abel's inversion gives, with k² = 1 - t²/a²,

        φ = (4 β/π) t for t < c,   φ = (2/π)(μ p0/G) t [K(k) - E(k)] beyond

    and τ is finite at c where φ is continuous: β = (μ p0/2 G) [K(k) - E(k)] at k² = 1 - c²/a². β is
    the twist of one body; the twist of one on the other is 2 β. Sliding everywhere: T = 3 π μ P
    a/16.
    """

    force: float
    a: float
    mu: float
    G: float

    @property
    def limit(self) -> float:
        """μ p0 [Pa]."""
        return 1.5 * self.mu * self.force / (np.pi * self.a**2)

    @property
    def sliding(self) -> float:
        """The moment of full sliding [N m]."""
        return 3.0 * np.pi * self.mu * self.force * self.a / 16.0

    def no_slip(self, twist: float) -> float:
        """The moment [N m] without slip, of the twist β of one body."""
        return 16.0 / 3.0 * self.G * self.a**3 * twist

    def twist(self, c: float) -> float:
        """β [rad] of one body at the radius of stick c."""
        return 0.5 * self.limit / self.G * float(_gap(c, self.a))

    def density(self, t: Array, c: float) -> Array:
        """φ(t)."""
        return np.asarray(
            4.0 * self.twist(c) / np.pi * t * _gap(np.maximum(t, c), self.a) / _gap(c, self.a)
        )

    def over(self, function: Callable[[Array], Array], c: float) -> Array:
        """∫_0^a φ(t) function(t) dt; the last axis of what the function returns is t's."""
        parts = [gauss(0.0, c), gauss(c, self.a)]
        return sum(function(t) @ (w * self.density(t, c)) for t, w in parts)  # type: ignore

    def moment(self, c: float) -> float:
        """T [N m]."""
        return 4.0 * np.pi * self.G * float(self.over(lambda t: t, c))

    def traction(self, r: Array, c: float) -> Array:
        """τ [Pa] at each radius: -(G/r) ∫_r^a φ'(t) t/√(t² - r²) dt, for φ(a) = 0 and φ' = (2 μ
        p0/π G) (K - 2 E) beyond c."""
        return np.array(
            [
                self._stress(one, c)
                if one < c
                else self.limit * np.sqrt(max(1.0 - (one / self.a) ** 2, 0.0))
                for one in np.asarray(r, dtype=float)
            ]
        )

    def _stress(self, r: float, c: float) -> float:
        t, w = gauss(0.0, 1.0)
        low, high = np.sqrt(c**2 - r**2), np.sqrt(self.a**2 - r**2)
        s = low + (high - low) * t  # t² = r² + s², t dt = s ds
        m = np.maximum(1.0 - (r**2 + s**2) / self.a**2, 0.0)
        beyond = 2.0 * self.limit / np.pi * (high - low) * (w @ (ellipk(m) - 2.0 * ellipe(m)))
        return -(4.0 * self.G * self.twist(c) / np.pi * low + beyond) / r

    def field(self, points: Array, c: float) -> Array:
        """Displacements (k, 3) of a body far from τ of the radius of stick c, along (z, 0, -x)/r,
        without the twist."""
        return _round(points, self.over(lambda t: _disks(points, t), c))

    def stuck_field(self, points: Array, twist: float) -> Array:
        """The same without any slip: φ = (4 β/π) t up to a."""
        t, w = gauss(0.0, self.a)
        return _round(points, _disks(points, t) @ (w * 4.0 * twist / np.pi * t))


def turned(points: Array, twist: float) -> Array:
    """Displacements (k, 3) of a rigid body turned about the axis y."""
    return twist * np.column_stack([points[:, 2], 0.0 * points[:, 1], -points[:, 0]])


def _disks(points: Array, t: Array) -> Array:
    """v (k, n) about the axis of φ that is a unit pulse at each t:

    ∫ exp(-s y) J1(s r) sin(s t) ds = -Im[ζ/√(ζ² + r²)]/r,   ζ = y - i t
    """
    r, zeta = np.hypot(points[:, 0], points[:, 2])[:, None], points[:, 1, None] - 1j * t
    inside = np.maximum(r, 1e-9 * t.max())
    return np.asarray(-(zeta / np.sqrt(zeta**2 + inside**2)).imag / inside)


def _round(points: Array, v: Array) -> Array:
    """v about the axis as displacements (k, 3)."""
    r = np.maximum(np.hypot(points[:, 0], points[:, 2]), np.finfo(float).tiny)
    return np.column_stack([v * points[:, 2] / r, 0.0 * v, -v * points[:, 0] / r])


def _gap(t: Array | float, a: float) -> Array:
    """K(k) - E(k), k² = 1 - t²/a²."""
    m = 1.0 - np.square(t) / a**2
    return np.asarray(ellipk(m) - ellipe(m))
