"""A rigid block that rocks on the four corners of its base, in space, by small rotations: its
equations, solved exactly from event to event.

Unknowns q = (w, theta_x, theta_z): lift of the middle of the base, and turns about horizontal axes
through it. The base does not slide and does not spin, so that a corner (x, z) is at the height w +
theta_z x - theta_x z >= 0, and

    M q'' = (-g, g h theta_x, g h theta_z) + Bᵀ r,    0 <= r  ⊥  B q >= 0
    M = diag(1, (c² + 4 h²)/3, (a² + 4 h²)/3)

for a uniform block of 2a x 2h x 2c and of mass one. g h theta is the second-order effect of the
weight, as geometric stiffness has it: on an edge this is the slender block of
``demos.parts.problems.rocking_block``. Impacts are inelastic: the velocity after one is the
nearest, in the norm of M, at which no closed corner goes on down. From one edge or corner to the
next that is the conservation of angular momentum about the new one (Housner, Bull. Seism. Soc. Am.
53, 1963).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations

import numpy as np
from scipy.linalg import expm
from scipy.optimize import brentq

from vi_contact.core.algebra import Array, Mask

ROUNDED = 1e-9  # of the heights or speeds of the corners: what counts as none


@dataclass(frozen=True)
class Phase:
    """Smooth motion on the same pivots from start to end [s], from q with the velocity v."""

    start: float
    end: float
    q: Array
    v: Array
    pivots: Mask


@dataclass(frozen=True)
class RigidBlock:
    """A block with these lengths 2a, 2h, 2c [m] along x, y (upwards) and z."""

    lengths: tuple[float, float, float]
    gravity: float = 9.81

    @cached_property
    def half(self) -> Array:
        """a, h, c"""
        return 0.5 * np.array(self.lengths)

    @cached_property
    def mass(self) -> Array:
        """The diagonal of M."""
        a, h, c = self.half
        return np.array([1.0, (c**2 + 4.0 * h**2) / 3.0, (a**2 + 4.0 * h**2) / 3.0])

    @cached_property
    def corners(self) -> Array:
        """(4, 3): the corners of the base, from its middle."""
        a, _, c = self.half
        return np.array([(x, 0.0, z) for z in (-c, c) for x in (-a, a)])

    @cached_property
    def B(self) -> Array:
        """(4, 3): heights of the corners are B q."""
        return np.column_stack([np.ones(4), -self.corners[:, 2], self.corners[:, 0]])

    @cached_property
    def stiffness(self) -> Array:
        """(3, 3): the force is (-g, 0, 0) plus this times q."""
        return np.diag([0.0, 1.0, 1.0]) * self.gravity * self.half[1]

    def force(self, q: Array) -> Array:
        return np.asarray(self.stiffness @ q - [self.gravity, 0.0, 0.0])

    def tilted(self, corner: int, theta_x: float, theta_z: float) -> Array:
        """q of a block that is turned about a corner."""
        return np.array([-self.B[corner, 1:] @ (theta_x, theta_z), theta_x, theta_z])

    def projected(self, x: Array, closed: Mask) -> tuple[Array, Array]:
        """(the vector nearest to x at which no closed corner goes down, impulses of all
        corners)."""
        for count in range(4):  # three corners hold all of q
            for chosen in combinations(np.flatnonzero(closed), count):
                B, push = self.B[list(chosen)], np.zeros(4)
                push[list(chosen)] = np.linalg.solve(B / self.mass @ B.T, -B @ x)
                found = x + self.B.T @ push / self.mass
                if push.min() >= 0.0 and np.all(
                    self.B[closed] @ found >= -ROUNDED * np.abs(self.B @ x).max()
                ):
                    return found, push
        raise AssertionError("no admissible velocity")

    def pivots(self, q: Array, v: Array, closed: Mask) -> Mask:
        """The closed corners that carry the block, which starts with v."""
        at_rest = closed & (np.abs(self.B @ v) <= ROUNDED * np.abs(self.B @ v).max())
        return np.asarray(self.projected(self.force(q) / self.mass, at_rest)[1] > 0.0)

    def moved(self, q: Array, v: Array, pivots: Mask, t: float) -> tuple[Array, Array]:
        """(q, v) after a time t on these pivots, q = N y:  (Nᵀ M N) y'' = Nᵀ force(N y), by a
        matrix exponential."""
        N = np.linalg.svd(self.B[pivots])[2][pivots.sum() :].T if pivots.any() else np.eye(3)
        k, inverse = N.shape[1], np.linalg.inv(N.T * self.mass @ N)
        A = np.zeros((2 * k + 1, 2 * k + 1))
        A[:k, k:-1] = np.eye(k)
        A[k:-1, :k] = inverse @ N.T @ self.stiffness @ N
        A[k:-1, -1] = inverse @ N.T @ self.force(np.zeros(3))
        end = expm(t * A) @ np.concatenate([N.T @ q, N.T @ v, [1.0]])
        return N @ end[:k], N @ end[k:-1]

    def reactions(self, q: Array, pivots: Mask) -> Array:
        """Forces on the pivots in smooth motion."""
        B = self.B[pivots]
        return np.asarray(np.linalg.solve(B / self.mass @ B.T, -B @ (self.force(q) / self.mass)))

    def phases(self, q: Array, t_end: float, dt: float = 2e-3) -> Iterator[Phase]:
        """Smooth motions one after the other, from rest at q on some corner; landings are looked
        for every dt [s]."""
        t, v, size = 0.0, np.zeros(3), np.abs(self.B @ q).max()
        while t < t_end:
            closed = self.B @ q <= ROUNDED * size
            v = self.projected(v, closed)[0]
            pivots = self.pivots(q, v, closed)

            def left(s: float, q: Array = q, v: Array = v, pivots: Mask = pivots) -> float:
                """What is left of the least height or reaction after a time s."""
                now = self.moved(q, v, pivots, s)[0]
                reactions = self.reactions(now, pivots).min(initial=np.inf)
                return float(min((self.B @ now)[~pivots].min() / size, reactions / self.gravity))

            s = dt
            while left(s) > 0.0 and t + s < t_end:
                s += dt
            if t + s < t_end:
                s = float(brentq(left, max(s - dt, 1e-3 * dt), s, xtol=1e-14))
            yield Phase(t, t + s, q, v, pivots)
            q, v = self.moved(q, v, pivots, s)
            t += s

    def motion(self, phases: list[Phase], t: Array) -> tuple[Array, Array]:
        """q and v (k, 3) at times within the phases."""
        rows = np.searchsorted([one.start for one in phases], t, side="right") - 1
        found = [
            self.moved(one.q, one.v, one.pivots, s - one.start)
            for s, one in zip(t, (phases[row] for row in rows), strict=True)
        ]
        q, v = (np.array(column) for column in zip(*found, strict=True))
        return q, v
