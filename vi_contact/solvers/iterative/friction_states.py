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
from ...core.collective import ask_limit, ask_slope
from ...core.step import StepProblem
from ...core.surfaces import ContactSurface
from .contact import ClosedSet

# kappa over c at most: at the solution kappa multiplies zero, and the matrix stays well conditioned
STIFFEST = 1e6
ROUNDS = 4  # with coefficients of friction that are given
DIFFERENCE = 1e-6  # of the slip, for the derivative of coefficients


class Tangents:
    """Read the tangential unknowns of padded vectors.

    Attributes:
        rows: (L,) where the free ones are, point by point.
        rubs: (m,) which points have one.
        c: (m,) stiffness of each point: the mean of the diagonal of A over its tangents.
    """

    def __init__(self, surface: ContactSurface, places: Indices, diagonal: Array) -> None:
        """Note where the tangents are.

        Args:
            surface: the contact surface.
            places: where the unknowns of this rank stand in padded vectors.
            diagonal: of A, padded.
        """
        self._free = surface.tangents >= 0
        self.rows: Indices = places[surface.tangents[self._free]]
        count = self._free.sum(axis=1)
        self.rubs: Mask = count > 0
        mean = np.sum(self.values(diagonal), axis=1) / np.maximum(count, 1)
        self.c = np.where(self.rubs, mean, 1.0)

    def values(self, v: Array) -> Array:
        """Return the tangential values (m, d - 1) of v, zero where a tangent is prescribed."""
        table = np.zeros(self._free.shape)
        table[self._free] = v[self.rows]
        return table

    def flatten(self, table: Array) -> Array:
        """Return the entries of a table (m, d - 1) for ``rows``."""
        return np.asarray(table[self._free])


@dataclass(frozen=True)
class Limits:
    """Hold the friction limit of every point, cohesion + slope r_n.

    Attributes:
        cohesion: (m,) the limit without pressure.
        slope: (m,) by how much it grows with r_n.
        rise: (m,) by how much it grows with the slip, in the unit of A.
        rest: the limits of points at rest, where they are others.
    """

    cohesion: Array
    slope: Array
    rise: Array
    rest: "Limits | None" = None

    def __call__(self, r_n: Array) -> Array:
        """Return the limit (m,): a point in tension has no friction but its cohesion."""
        return self.cohesion + self.slope * np.maximum(r_n, 0.0)

    def below_which_points_stick(self, r_n: Array) -> Array:
        """Return the limit (m,) below which a point sticks.

        It is the smaller one of those at the slip and at rest.
        """
        if self.rest is None:
            return self(r_n)
        return np.minimum(self(r_n), self.rest(r_n))


def dot(a: Array, b: Array) -> Array:
    """Return the inner products of the rows."""
    return np.asarray(np.sum(a * b, axis=1))


class States:
    """Hold which points stick and slip at some y, and the linear problem of these states.

    Attributes:
        stick, slips: (m,) which points stick, and which slip.
        direction: (m, d - 1) n of the points that slip, zero of all others.
        kappa: (m,) curvature of the disk, zero of points that do not slip, and in 2D.
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
        """Take the states at y.

        Args:
            tangents: where the tangents are.
            limits: of friction at this slip.
            y: y_n (m,) and y_t (m, d - 1).
            slip: s (m, d - 1), where y was taken.
            before: the states before; a slip that turned back since then overshot, and sticks.
            stuck: (m,) points that stick, whatever y says.
        """
        self._tangents = tangents
        y_n, y_t = y
        limit = limits(y_n)
        size = np.linalg.norm(y_t, axis=1)
        c = tangents.c

        # Which points stick and which slip; one without a limit does neither.
        sticks = size <= limits.below_which_points_stick(y_n)
        if before is not None:
            sticks |= dot(before.direction, y_t) < 0.0
        has_friction = tangents.rubs & (limit > 0.0)
        self.stick: Mask = has_friction & sticks
        if stuck is not None:
            self.stick |= stuck & tangents.rubs
        self.slips: Mask = has_friction & ~self.stick

        # n = y/|y|, and kappa = limit c / (|y| - limit). A point that slips with |y| below its
        # limit, as one may between the limits of slip and of rest, has c |s| for the difference.
        slip_size = np.linalg.norm(slip, axis=1)
        over = np.where(self.slips, np.where(size > limit, size - limit, c * slip_size), 1.0)
        y_of_slips = np.where(self.slips[:, None], y_t, 0.0)
        self.direction: Array = y_of_slips / np.where(self.slips, size, 1.0)[:, None]
        kappa = np.minimum(limit * c / np.maximum(over, limit / STIFFEST), STIFFEST * c)
        self.kappa = np.where(self.slips, kappa, 0.0)
        if y_t.shape[1] < 2:
            self.kappa[:] = 0.0

        # The coefficients of the linearised law, and n·s of the slip that it is linearised about.
        self._growth = np.where(self.slips & (y_n > 0.0), limits.slope, 0.0)
        self._cohesion = np.where(self.slips, limits.cohesion, 0.0)
        self._rise = np.where(self.slips, limits.rise, 0.0)
        self._base = dot(self.direction, slip)

    @property
    def held(self) -> Indices:
        """Return the rows of the tangents that stick."""
        sticks = np.repeat(self.stick[:, None], self.direction.shape[1], axis=1)
        return self._tangents.rows[self._tangents.flatten(sticks)]

    def turn(self, p: Array) -> Array:
        """Return kappa (p - n n·p) + rise n n·p of tangential values p (m, d - 1)."""
        along = dot(self.direction, p)
        across = self.kappa[:, None] * p
        return across + ((self._rise - self.kappa) * along)[:, None] * self.direction

    def apply(self, contact: ClosedSet, p: Array, y: Array) -> None:
        """Make of y = A p the product of p with the matrix of the linear problem, in place.

        Args:
            contact: the closed set.
            p: padded vector.
            y: A p, padded, whose rows of tangents are changed.
        """
        tangents = self._tangents
        rise_of_r_n = np.where(contact.soft, contact.k * p[contact.rows], -y[contact.rows])
        turn = self.turn(tangents.values(p))
        extra = turn + (self._growth * rise_of_r_n)[:, None] * self.direction
        y[tangents.rows] += tangents.flatten(extra)

    def residual(self, r_n: Array, r_t: Array, slip: Array) -> Array:
        """Return the residual (m, d - 1) of the linear problem, as if no point stuck.

        Args:
            r_n: (m,), normal reactions.
            r_t: (m, d - 1), friction.
            slip: (m, d - 1).
        """
        limit = self._cohesion + self._growth * r_n - self._rise * self._base
        return np.asarray(r_t - limit[:, None] * self.direction - self.turn(slip))


class LawOfStep:
    """Evaluate the friction law of a step: limits affine in r_n.

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
        self._given_slip = rest
        self._rounds_of_slip = 0 if self._constant else ROUNDS
        self._given_limit = np.zeros(len(rest))
        self._rounds_of_limit = 0

    @property
    def settled(self) -> bool:
        """Say whether an answer with the present coefficients is one of the step.

        They are constant then, or follow the slip.
        """
        return self._rounds_of_slip == 0 and self._rounds_of_limit == 0

    def advance(self, slip: Array, r_n: Array) -> None:
        """End a round: give the coefficients of this slip (m, d - 1), or the limits of r_n (m,)."""
        if self._rounds_of_limit:
            self._rounds_of_limit -= 1
            self._given_limit = self._find_limits(slip)(r_n)
        else:
            self._given_slip = slip
            self._rounds_of_slip -= 1

    def give(self, rounds: int, slip: Array, r_n: Array) -> None:
        """Begin rounds of given coefficients, those of rest.

        Where coefficients are constant, the rounds are of given limits.

        Args:
            rounds: their number.
            slip: (m, d - 1), the present one.
            r_n: (m,), the present one.
        """
        if self._constant:
            self._given_limit = self._find_limits(slip)(r_n)
            self._rounds_of_limit = rounds
        else:
            self._given_slip = np.zeros_like(slip)
            self._rounds_of_slip = rounds

    def __call__(self, slip: Array, r_n: Array, reach: Array) -> Limits:
        """Return the limits at this slip, or those that are given.

        Args:
            slip: (m, d - 1).
            r_n: (m,), at which the rise with the slip is taken.
            reach: (m,), slips that points at rest may come to; their limits rise with the law where
                it grows.
        """
        if self._rounds_of_limit:
            none = np.zeros_like(self._given_limit)
            return Limits(self._given_limit, none, none)
        if self._constant or self._rounds_of_slip:
            return self._find_limits(self._given_slip)

        # The derivative with the slip, by a difference; only the size of the slip counts.
        here = self._find_limits(slip)
        rest = self._find_limits(np.zeros_like(slip))
        size = np.linalg.norm(slip, axis=1)
        moved = size > 0.0
        h = DIFFERENCE * np.where(moved, size, reach)
        further = np.column_stack([size + h, *np.zeros_like(slip.T[1:])])
        change = self._find_limits(further)(r_n) - here(r_n)
        rise = np.where(h > 0.0, change, 0.0) / np.where(h > 0.0, h, 1.0)
        rise = np.where(moved, rise, np.maximum(rise, 0.0))
        return Limits(here.cohesion, here.slope, rise, rest)

    def _find_limits(self, slip: Array) -> Limits:
        """Return the limits under the coefficients of a slip (m, d - 1)."""
        step = self._step
        none = np.zeros(step.surface.count)
        law = step.friction_at(slip)
        weights = step.surface.weights
        return Limits(ask_limit(law, none, weights, step.scale), ask_slope(law, weights), none)
