"""Split forces over rings of conditions: the least of all splits that act alike.

Displacements and Bᵀr are unique on a ring, r is not (``rings``). Of all reactions that fit the same
displacements, with the states that these have, that one is taken with the least sum

    Σ |r|²/weight   with   Bᵀr kept,   r = 0 where the gap is open,
    r_n >= 0 and |r_t| <= cohesion + slope r_n where it is closed and sticks (a held condition
    that pulls stays as it is),
    r_t along the slip, of that size, where it slips

so that equal stones press alike, mirror images give mirror forces, turned ones turned forces, and
no number of ranks and no method of solution shows. It is unique, as the sum is strictly convex.

Each ring is a least-distance problem: its unknowns are few, and disks are replaced by the half
planes in which the answer lies, one after another where it leaves them. Source of the reduction to
non-negative least squares: Lawson and Hanson, Solving Least Squares Problems, 1974, chapter 23.
"""

from dataclasses import dataclass

import numpy as np

from ...core.algebra import Array, Indices, Mask, max_abs
from .rings import DEPENDENT, Ring, find_null_space

CUTS = 60  # half planes of one disk, at most; each brings the answer nearer by its square
TINY = 1e-300  # in the place of the size of traces that are all zero
ROUNDING = 1e-14  # of gradients of unit columns
CHANGES = 10  # of the active set, for each column, at most
CLOSE = 1e-13  # of the largest force: how far outside a disk counts as on it


@dataclass(frozen=True)
class States:
    """Hold what the conditions (m,) do, and the law of those that touch.

    Attributes:
        closed: which touch.
        stick: which of these do not slip.
        bilateral: which may pull.
        slip: (m, d - 1) unit vectors of the reaction of those that slip.
        cohesion: (m,) of the limits [N].
        slope: (m,) of the limits.
    """

    closed: Mask
    stick: Mask
    bilateral: Mask
    slip: Array
    cohesion: Array
    slope: Array

    def pick(self, rows: Indices) -> "States":
        """Return what is in these rows."""
        return States(
            self.closed[rows],
            self.stick[rows],
            self.bilateral[rows],
            self.slip[rows],
            self.cohesion[rows],
            self.slope[rows],
        )


def split_least(r: Array, ring: Ring, states: States, weights: Array, movable: Mask) -> Array:
    """Return the reactions (c, d) of a ring with the least sum of squares over weights.

    Args:
        r: (c, d) reactions that fit the displacements [N].
        ring: its conditions.
        states: theirs.
        weights: (c,) their lengths or areas.
        movable: (c, d) which entries are forces; others are left.
    """
    c, d = r.shape
    places = np.arange(c * d).reshape(c, d)
    size = max_abs(r)
    if not size > 0.0:
        return r

    # What must not change: the forces on the unknowns, reactions of open points, and tangential
    # ones that follow their normal.
    identity = np.eye(c * d)
    fixed = [ring.B.T * (1.0 / max(max_abs(ring.B), TINY))]
    fixed.append(identity[~movable.ravel()])
    # A held condition that pulls has no friction: it stays one that pulls.
    pulls = states.bilateral & (states.slope > 0.0) & (r[:, 0] <= 0.0)
    fixed.append(identity[places[~states.closed | pulls].ravel()])
    for i in np.flatnonzero(states.closed & ~states.stick):
        for k in range(d - 1):
            row = identity[places[i, 1 + k]].copy()
            row[places[i, 0]] -= states.slope[i] * states.slip[i, k]
            fixed.append(row[None])
    Z = find_null_space(np.vstack(fixed))
    if Z.shape[1] == 0:
        return r

    # Least distance: y = r / sqrt(weight) = y0 + Q s with orthonormal Q, least |s + Qᵀy0|.
    root = np.repeat(1.0 / np.sqrt(weights / weights.max()), d)
    Q, R = np.linalg.qr(root[:, None] * Z)
    ways = np.linalg.solve(R.T, Z.T).T  # r = r0 + ways s
    y0 = Q.T @ (root * r.ravel())

    # Inequalities a·s >= b: those of normal forces, and half planes of disks. That r itself is
    # allowed but for rounding makes all b <= 0.
    pressed = states.closed & ~pulls & ~(states.bilateral & (states.slope == 0.0))
    a = [ways[places[pressed, 0]]]
    b = [-r[pressed, 0]]
    sticking = np.flatnonzero(states.closed & states.stick & ~pulls & movable[:, 1:].any(axis=1))
    if d == 2:  # disks are intervals
        for sign in (1.0, -1.0):
            more = _cut(r, ways, places, states, sticking, np.full((len(sticking), 1), sign))
            a.append(more[0])
            b.append(more[1])
    s = _find_least(np.vstack(a), np.concatenate(b), y0)
    answer = r + (ways @ s).reshape(c, d)
    for _ in range(CUTS if d == 3 else 0):
        limit = states.cohesion + states.slope * np.maximum(answer[:, 0], 0.0)
        reach = np.linalg.norm(answer[:, 1:], axis=1)
        outside = sticking[(reach - limit)[sticking] > CLOSE * size]
        if not len(outside):
            break
        toward = answer[outside, 1:] / reach[outside, None]
        more = _cut(r, ways, places, states, outside, toward)
        a.append(more[0])
        b.append(more[1])
        s = _find_least(np.vstack(a), np.concatenate(b), y0)
        answer = r + (ways @ s).reshape(c, d)
    return np.asarray(answer)


def _cut(
    r: Array, ways: Array, places: Indices, states: States, rows: Indices, toward: Array
) -> tuple[Array, Array]:
    """Return (a, b) of  a·s >= b:  toward·r_t <= cohesion + slope r_n  at some conditions.

    Args:
        r: (c, d) where s is zero.
        ways: (c d, z) how r changes with s.
        places: (c, d) of the entries of r.
        states: of the conditions.
        rows: (k,) which conditions.
        toward: (k, d - 1) unit vectors.
    """
    slope = states.slope[rows]
    across = np.einsum("kc,kcz->kz", toward, ways[places[rows, 1:]])
    a = slope[:, None] * ways[places[rows, 0]] - across
    free = states.cohesion[rows] + slope * r[rows, 0] - np.sum(toward * r[rows, 1:], axis=1)
    return a, -free


def _find_least(a: Array, b: Array, y0: Array) -> Array:
    """Return s with a s >= b and the least |s + y0|, for b whose positive part is rounding.

    Args:
        a: (k, z) left sides.
        b: (k,) right sides.
        y0: (z,) minus the s that is wanted.
    """
    # With t = s + y0:  a t >= h, least |t|, by non-negative least squares in the multipliers.
    size = np.linalg.norm(a, axis=1)
    used = size > 0.0
    a = a[used] / size[used, None]
    h = np.minimum(b[used] / size[used], 0.0) + a @ y0
    unit = float(h.max(initial=0.0))  # what is missing; far limits may be as large as they like
    if unit == 0.0:
        return -y0  # the least of all is allowed
    E = np.vstack([a.T, h[None] / unit])
    f = np.zeros(len(E))
    f[-1] = 1.0
    on_edge = _find_multipliers(E, f) > 0.0
    # The same once more with the edges that hold, to all digits.
    edges = a[on_edge]
    t = np.linalg.lstsq(edges, h[on_edge], rcond=DEPENDENT)[0]
    return np.asarray(t - y0)


def _find_multipliers(E: Array, f: Array) -> Array:
    """Return x >= 0 with the least |E x - f|, by the active set of Lawson and Hanson.

    Half planes that are nearly parallel need every digit, which a library that stops at a tolerance
    of its own does not give in all its versions.

    Args:
        E: (k, n) columns.
        f: (k,) right side.
    """
    n = E.shape[1]
    x = np.zeros(n)
    is_free = np.zeros(n, dtype=bool)
    scale = np.linalg.norm(E, axis=0)
    for _ in range(CHANGES * n):
        # The column that helps most becomes free; one that would turn negative at once does not.
        gradient = E.T @ (f - E @ x) / scale
        gradient[is_free] = 0.0
        while True:
            enters = int(np.argmax(gradient))
            if not gradient[enters] > ROUNDING:
                return x
            is_free[enters] = True
            wanted = _solve_free(E, f, is_free)
            if wanted[enters] > 0.0:
                break
            is_free[enters] = False
            gradient[enters] = 0.0

        # Those that would turn negative are left at zero, one after another.
        while (wanted[is_free] <= 0.0).any():
            falls = is_free & (wanted <= 0.0)
            ratio = np.where(falls, x / np.where(falls, x - wanted, 1.0), np.inf)
            x = x + ratio.min() * (wanted - x)
            is_free &= ~(falls & (ratio <= ratio.min()))
            x[~is_free] = 0.0
            wanted = _solve_free(E, f, is_free)
        x = wanted
    return x


def _solve_free(E: Array, f: Array, is_free: Mask) -> Array:
    """Return the x of least squares of some columns, zero elsewhere."""
    x = np.zeros(E.shape[1])
    x[is_free] = np.linalg.lstsq(E[:, is_free], f, rcond=None)[0]
    return x
