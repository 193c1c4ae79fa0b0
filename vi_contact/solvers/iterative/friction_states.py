"""Hold which contact points are open, stick and slip, and the linear problem of these states on the full-size vectors.

With the force r_t = (b - A x)_t on the tangents, the slip s = x_t - slip0, a stiffness c of each point (the diagonal of
A) and y = r_t + c s, a point sticks where |y| <= limit(r_n) and else slips along n = y/|y|. The natural map

    r_t - projection of y on the disk |r_t| <= limit(r_n)

vanishes at the solution (Alart and Curnier, Comput. Methods Appl. Mech. Eng. 92, 1991). Newton's step for it is the
linear problem of the states (Hüeber, Stadler and Wohlmuth, SIAM J. Sci. Comput. 30, 2008):

    stick  s = 0        slip  r_t = (cohesion + slope r_n) n + kappa (s - n n·s),  kappa = limit c / (|y| - limit)

in which kappa, the friction limit over the slip, is the curvature of the disk; it turns n along the slip. Coefficients
that depend on the slip rate add their derivative times n n·s. Arrays have one row for each condition of this rank.
"""

from dataclasses import dataclass

import numpy as np

from ...core.algebra import Array, Indices, Mask
from ...core.surfaces import ContactSurface
from .contact import Contact

STIFFEST = 1e6  # kappa over c at most: at the solution kappa multiplies zero, and the matrix stays well conditioned


class Tangents:
    """Read the tangential unknowns of padded vectors. ``rows`` (L,): where the free ones are, point by point."""

    def __init__(self, surface: ContactSurface, places: Indices, diagonal: Array) -> None:
        self._free = surface.tangents >= 0
        self.rows: Indices = places[surface.tangents[self._free]]
        count = self._free.sum(axis=1)
        self.rubs: Mask = count > 0
        self.c = np.where(self.rubs, np.sum(self.of(diagonal), axis=1) / np.maximum(count, 1), 1.0)

    def of(self, v: Array) -> Array:
        """Return the tangential values (m, d - 1) of v, zero where a tangent is prescribed."""
        table = np.zeros(self._free.shape)
        table[self._free] = v[self.rows]
        return table

    def flat(self, table: Array) -> Array:
        """Return the entries of a table (m, d - 1) for ``rows``."""
        return np.asarray(table[self._free])



@dataclass(frozen=True)
class Limits:
    """Hold the friction limit cohesion + slope r_n of every point, its ``rise`` [A] with the slip, and that at rest."""

    cohesion: Array
    slope: Array
    rise: Array
    rest: "Limits | None" = None

    def __call__(self, r_n: Array) -> Array:
        """Return the limit (m,): tension rubs on nothing."""
        return self.cohesion + self.slope * np.maximum(r_n, 0.0)

    def sticking(self, r_n: Array) -> Array:
        """Return the limit (m,) below which a point sticks: of a slip that is slower under the law, or of rest."""
        return self(r_n) if self.rest is None else np.minimum(self(r_n), self.rest(r_n))


def dot(a: Array, b: Array) -> Array:
    """Return the inner products of the rows."""
    return np.asarray(np.sum(a * b, axis=1))


class States:
    """Take the states at y_n (m,), y_t (m, d - 1), and with them the linear problem. ``slip``: s where y was taken.

    Slip that turned back since ``before`` overshot, and sticks first. ``stuck``: points that stick, whatever y says.
    """

    def __init__(self, tangents: Tangents, limits: Limits, y: tuple[Array, Array], slip: Array, *,
                 before: "States | None" = None, stuck: Mask | None = None) -> None:
        self._tangents = tangents
        y_n, y_t = y
        limit, size, c = limits(y_n), np.linalg.norm(y_t, axis=1), tangents.c
        sticks = size <= limits.sticking(y_n)
        if before is not None:
            sticks |= dot(before.direction, y_t) < 0.0
        self.stick: Mask = tangents.rubs & (limit > 0.0) & sticks
        if stuck is not None:
            self.stick |= stuck & tangents.rubs
        self.slips: Mask = tangents.rubs & (limit > 0.0) & ~self.stick
        over = np.where(self.slips, np.where(size > limit, size - limit, c * np.linalg.norm(slip, axis=1)), 1.0)
        self.direction: Array = np.where(self.slips[:, None], y_t, 0.0) / np.where(self.slips, size, 1.0)[:, None]
        self.kappa = np.where(self.slips, np.minimum(limit * c / np.maximum(over, limit / STIFFEST), STIFFEST * c), 0.0)
        if y_t.shape[1] < 2:
            self.kappa[:] = 0.0
        self._growth = np.where(self.slips & (y_n > 0.0), limits.slope, 0.0)
        self._cohesion = np.where(self.slips, limits.cohesion, 0.0)
        self._rise = np.where(self.slips, limits.rise, 0.0)
        self._base = dot(self.direction, slip)

    @property
    def held(self) -> Indices:
        """Return the rows of the tangents that stick."""
        sticks = np.repeat(self.stick[:, None], self.direction.shape[1], axis=1)
        return self._tangents.rows[self._tangents.flat(sticks)]

    def turned(self, p: Array) -> Array:
        """Return kappa (p - n n·p) + rise n n·p of tangential values p (m, d - 1)."""
        along = dot(self.direction, p)
        return self.kappa[:, None] * p + ((self._rise - self.kappa) * along)[:, None] * self.direction

    def apply(self, contact: Contact, p: Array, y: Array) -> None:
        """Turn y = A p into the product of p with the matrix of the linear problem, in the rows of the tangents."""
        tangents = self._tangents
        rise = np.where(contact.soft, contact.k * p[contact.rows], -y[contact.rows])
        extra = self.turned(tangents.of(p)) + (self._growth * rise)[:, None] * self.direction
        y[tangents.rows] += tangents.flat(extra)

    def residual(self, r_n: Array, r_t: Array, slip: Array) -> Array:
        """Return the residual (m, d - 1) of the linear problem, of all points as if they did not stick."""
        limit = self._cohesion + self._growth * r_n - self._rise * self._base
        return np.asarray(r_t - limit[:, None] * self.direction - self.turned(slip))
