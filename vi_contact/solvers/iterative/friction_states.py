"""Hold which contact points are open, stick and slip.

The linear problem of these states on the full-size vectors is here too.

With the force r_t = (b - A x)_t on the tangents, the slip s = x_t - slip0, a stiffness c of each
point (the diagonal of A) and y = r_t + c s, a point sticks where |y| <= limit(r_n) and else slips
along n = y/|y|. The natural map

    r_t - projection of y on the disk |r_t| <= limit(r_n)

vanishes at the solution (Alart and Curnier, Comput. Methods Appl. Mech. Eng. 92, 1991). Newton's
step for it is the linear problem of the states (Hüeber, Stadler and Wohlmuth, SIAM J. Sci. Comput.
30, 2008):

    stick  s = 0
    slip   r_t = (cohesion + slope r_n) n + kappa (s - n n·s),  kappa = limit c / (|y| - limit)

in which kappa, the friction limit over the slip, is the curvature of the disk; it turns n along the
slip. Coefficients that depend on the slip rate add their derivative times n n·s. Arrays have one
row for each condition of this rank.
"""

from dataclasses import dataclass

import numpy as np

from ...core.algebra import Array, Indices, Mask
from ...core.collective import limit_of, slope_of
from ...core.step import StepProblem
from ...core.surfaces import ContactSurface
from .contact import Contact

# kappa over c at most: at the solution kappa multiplies zero, and the matrix stays well conditioned
STIFFEST = 1e6
ROUNDS = 4  # with coefficients of friction that are given
DIFFERENCE = 1e-6  # of the slip, for the derivative of coefficients


class Tangents:
    """Read the tangential unknowns of padded vectors.

    ``rows`` (L,): where the free ones are, point by point.
    """

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
    """Hold the friction limit cohesion + slope r_n of every point.

    Its ``rise`` [A] with the slip, and the limit at rest, are held too.
    """

    cohesion: Array
    slope: Array
    rise: Array
    rest: "Limits | None" = None

    def __call__(self, r_n: Array) -> Array:
        """Return the limit (m,): tension rubs on nothing."""
        return self.cohesion + self.slope * np.maximum(r_n, 0.0)

    def sticking(self, r_n: Array) -> Array:
        """Return the limit (m,) below which a point sticks.

        It is that of a slip that is slower under the law, or of rest.
        """
        return self(r_n) if self.rest is None else np.minimum(self(r_n), self.rest(r_n))


def dot(a: Array, b: Array) -> Array:
    """Return the inner products of the rows."""
    return np.asarray(np.sum(a * b, axis=1))


class States:
    """Take the states at y_n (m,), y_t (m, d - 1), and with them the linear problem.

    ``slip``: s where y was taken.

    Slip that turned back since ``before`` overshot, and sticks first. ``stuck``: points that stick,
    whatever y says.
    """

    def __init__(
        self,
        tangents: Tangents,
        limits: Limits,
        y: tuple[Array, Array],
        slip: Array,
        *,
        before: "States | None" = None,
        stuck: Mask | None = None,
    ) -> None:
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
        over = np.where(
            self.slips, np.where(size > limit, size - limit, c * np.linalg.norm(slip, axis=1)), 1.0
        )
        self.direction: Array = (
            np.where(self.slips[:, None], y_t, 0.0) / np.where(self.slips, size, 1.0)[:, None]
        )
        self.kappa = np.where(
            self.slips,
            np.minimum(limit * c / np.maximum(over, limit / STIFFEST), STIFFEST * c),
            0.0,
        )
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
        return (
            self.kappa[:, None] * p + ((self._rise - self.kappa) * along)[:, None] * self.direction
        )

    def apply(self, contact: Contact, p: Array, y: Array) -> None:
        """Turn y = A p into the product of p with the matrix of the linear problem.

        It changes the rows of the tangents.
        """
        tangents = self._tangents
        rise = np.where(contact.soft, contact.k * p[contact.rows], -y[contact.rows])
        extra = self.turned(tangents.of(p)) + (self._growth * rise)[:, None] * self.direction
        y[tangents.rows] += tangents.flat(extra)

    def residual(self, r_n: Array, r_t: Array, slip: Array) -> Array:
        """Return the residual (m, d - 1) of the linear problem.

        It is that of all points as if they did not stick.
        """
        limit = self._cohesion + self._growth * r_n - self._rise * self._base
        return np.asarray(r_t - limit[:, None] * self.direction - self.turned(slip))


class LawOfStep:
    """Evaluate the friction law of a step.

    Its limits are affine in r_n, with coefficients that may depend on the slip rate. ``settled``:
    the coefficients are constant, or follow the slip by now.

    A law with rates may have several solutions where it weakens. As in ``friction.slip_rate`` the
    step begins with the coefficients of rest and takes those of the slip found in a few rounds;
    then they follow every Newton step, with their derivative, by differences.

    Where Newton's steps go in circles, which large coefficients may bring about, limits are given
    for some rounds, those of the r_n found last: Tresca problems, which are convex (Nečas, Jarušek
    and Haslinger, Boll. Unione Mat. Ital. 17-B, 1980). A law that weakens steeply goes back to the
    coefficients of rest, and climbs for more rounds than before.
    """

    def __init__(self, step: StepProblem) -> None:
        self._step = step
        rest = np.zeros((step.surface.count, step.surface.tangents.shape[1]))
        self._constant = step.rate_factor == 0.0 or step.friction_at(rest) is step.friction
        self._given, self._left = rest, 0 if self._constant else ROUNDS
        self._limit, self._tresca = np.zeros(len(rest)), 0

    @property
    def settled(self) -> bool:
        """Say whether an answer with the present coefficients is one of the step."""
        return self._left == 0 and self._tresca == 0

    def advance(self, slip: Array, r_n: Array) -> None:
        """Take the coefficients of this slip (m, d - 1), or the limits of r_n.

        After some rounds they follow.
        """
        if self._tresca:
            self._tresca -= 1
            self._limit = self._at(slip)(r_n)
        else:
            self._given = slip
            self._left -= 1

    def give(self, rounds: int, slip: Array, r_n: Array) -> None:
        """Begin rounds of given coefficients, those of rest.

        Where coefficients are constant, the rounds are of given limits.
        """
        if self._constant:
            self._limit, self._tresca = self._at(slip)(r_n), rounds
        else:
            self._given, self._left = np.zeros_like(slip), rounds

    def __call__(self, slip: Array, r_n: Array, reach: Array) -> Limits:
        """Return the limits at this slip, or at the one that is given.

        ``reach`` (m,): slips that points at rest may come to; they rise with the law where it
        grows.
        """
        if self._tresca:
            none = np.zeros_like(self._limit)
            return Limits(self._limit, none, none)
        if self._constant or self._left:
            return self._at(self._given)
        here, rest, size = (
            self._at(slip),
            self._at(np.zeros_like(slip)),
            np.linalg.norm(slip, axis=1),
        )
        moved = size > 0.0
        h = DIFFERENCE * np.where(moved, size, reach)
        change = self._at(np.column_stack([size + h, *np.zeros_like(slip.T[1:])]))(r_n) - here(r_n)
        rise = np.where(h > 0.0, change, 0.0) / np.where(h > 0.0, h, 1.0)
        return Limits(here.cohesion, here.slope, np.where(moved, rise, np.maximum(rise, 0.0)), rest)

    def _at(self, slip: Array) -> Limits:
        step, none = self._step, np.zeros(self._step.surface.count)
        law = step.friction_at(slip)
        weights = step.surface.weights
        return Limits(limit_of(law, none, weights, step.scale), slope_of(law, weights), none)
