"""Find where bodies come that go on as they move, and turn as they turn.

A way w of the nodes at y is for each body a motion c + omega x (y - m) about the mean place m of
its nodes, by least squares, and a rest. Along straight lines a body that turns would grow: places
that go on by omega x r for an angle theta are 1 + ½ theta² times as far from m. So

    y1 - m - c = Q (y - m + ½ rest),    Q = (1 - ½ W)⁻¹ (1 + ½ W),    W r = omega x r

with the rotation Q of the midpoint rule (Cayley's), that of a free rigid body under
``EnergyMomentum``. Passes begin there, which decides how many there are, and nothing of the answer.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ...core.algebra import Array, Comm, Indices

PLANES = {1: (), 2: ((0, 1),), 3: ((1, 2), (2, 0), (0, 1))}
# The share of the rest that is gone: all of a slow bending, nothing of a vibration whose velocity
# turns around in every step.
UNRESOLVED = 0.5
FLAT = 1e-10  # of the largest: moments of inertia of a body that has none about an axis


@dataclass(frozen=True)
class RigidMotion:
    """Hold the bodies that the nodes of this rank belong to.

    Attributes:
        body: (owned nodes,) number of the body of each.
        bodies: how many there are.
        comm: the ranks.
    """

    body: Indices
    bodies: int
    comm: Comm

    def turn_on(self, y: Array, way: Array) -> Array:
        """Return how far the nodes come (owned nodes, d) [m]. Collective.

        Args:
            y: where they are (owned nodes, d) [m].
            way: how far their velocities take them (owned nodes, d) [m].
        """
        d = y.shape[1]
        r = y - self._average(y)[self.body]
        mean = self._average(way)[self.body]
        left = way - mean

        # Turns omega of each body: moments of the ways over the moments of inertia.
        turns = [_spin_matrix(plane, d) for plane in PLANES[d]]
        ways = [r @ turn.T for turn in turns]
        moments = np.array([(one * left).sum(axis=1) for one in ways])
        inertia = np.array([(one * other).sum(axis=1) for one in ways for other in ways])
        k = len(turns)
        sums = self._add(np.concatenate([moments, inertia]).T)
        squares = sums[:, k:].reshape(-1, k, k)
        omega = np.einsum("bij,bj->bi", np.linalg.pinv(squares, rcond=FLAT), sums[:, :k])

        W = np.einsum("bi,ijk->bjk", omega, np.array(turns).reshape(k, d, d))
        one = np.eye(d)
        Q = np.linalg.solve(one - 0.5 * W, one + 0.5 * W)
        rest = left - np.einsum("nij,nj->ni", W[self.body], r)
        end: Array = np.einsum("nij,nj->ni", Q[self.body], r + UNRESOLVED * rest)
        return mean + end - r

    def _average(self, values: Array) -> Array:
        """Return the mean of nodal values (owned nodes, k) over each body (bodies, k)."""
        sums = self._add(np.column_stack([values, np.ones(len(values))]))
        return np.asarray(sums[:, :-1] / np.maximum(sums[:, -1:], 1.0))

    def _add(self, values: Array) -> Array:
        """Return the sums of nodal values (owned nodes, k) over each body (bodies, k)."""
        sums = np.zeros((self.bodies, values.shape[1]))
        np.add.at(sums, self.body, values)
        return self.comm.sum(sums)


def _spin_matrix(plane: tuple[int, int], d: int) -> NDArray[np.float64]:
    """Return W (d, d) of a unit turn in a plane, from its first axis to its second."""
    W = np.zeros((d, d))
    W[plane[1], plane[0]] = 1.0
    W[plane[0], plane[1]] = -1.0
    return W
