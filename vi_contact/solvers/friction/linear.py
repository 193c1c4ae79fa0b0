"""Solve the linear problems of semismooth Newton with friction, one with the factor of another.

With the rows R that must hold, r = fixed + P z and w = q + G fixed:

    K z = -R w,    K = R G P (+ the turns in 3D)                                                                   (1)

A step begins far from its states and ends by small changes. With the factor K0 of an earlier iterate, P x the columns
of places that were added and of slip reactions that grow otherwise, z of the places E that were dropped zero,

    K0 z0 + R0 G P x - E y = -R0 w,    R (w + G (P0 z0 + P x)) = 0 at added places,
    Eᵀz0 = 0,                          x = z0 of its normal for slip that grows otherwise                          (2)

which asks K0⁻¹ for one column per difference, once, and for the solution of a small dense problem.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.linalg import lapack

from ...core.algebra import Array, Indices, Mask
from .problem import ScaledProblem

KEPT = 8  # factors
LARGE = 150  # unknowns from which (2) is faster, as measured
SHARE = 0.125  # of them, differences up to which it is


class States:
    """Find the states of m nodes at y; a node that turned back since ``before`` sticks first.

    Masks (m,) ``closed``, ``stick`` and, in 3D, ``turns``, slip along an unknown direction. Slip reactions are
    fixed + growth r_n direction, (m, d - 1) with ``growth`` (m,); ``fixed`` (m, d). ``turning``: (|y_t| - limit)/limit
    of nodes that turn. ``exact``: none does, and the linear problem depends on ``key`` only.
    """

    def __init__(self, step: ScaledProblem, y: Array, before: States | None) -> None:
        m, d = y.shape
        limit = step.limit(y[:, 0])
        size = np.linalg.norm(y[:, 1:], axis=1)
        self.closed: Mask = (y[:, 0] > 0.0) | step.delassus.bilateral
        back = np.zeros(m, dtype=bool) if before is None else np.sum(before.direction * y[:, 1:], axis=1) < 0.0
        self.stick: Mask = ((size <= limit) | back) & (limit > 0.0)
        slip = ~self.stick & (limit > 0.0)
        self.direction: Array = np.zeros((m, d - 1))
        np.divide(y[:, 1:], size[:, None], out=self.direction, where=slip[:, None])
        self.growth = np.where(slip & (y[:, 0] > 0.0), step.slope, 0.0)
        self.turns: Mask = slip if d == 3 else np.zeros(m, dtype=bool)
        self.exact = not self.turns.any()
        self.turning = size[self.turns] / limit[self.turns] - 1.0
        self.fixed = np.column_stack([np.zeros(m), np.where(slip, step.cohesion, 0.0)[:, None] * self.direction])
        self.key = b"".join(part.tobytes() for part in (self.closed, self.stick, self.direction, self.growth))


class LinearProblems:
    """Solve the linear problems of one run of Newton's method. The way of solution depends on this run alone, not on
    ``kept``, the factors of the last sets of states of one G: they save time and change no digit of an answer."""

    def __init__(self, G: Array, kept: dict[bytes, Factored]) -> None:
        self._G, self._kept = G, kept
        self._near: Bordered | None = None
        self._bordered: set[bytes] = set()
        self._solved: set[bytes] = set()

    def solve(self, states: States, w: Array) -> Array | None:
        """Return r; None when the problem is singular, or exact and solved before. What (2) has solved without success,
        (1) solves once more."""
        if states.key in self._solved:
            return None
        reduced, near = Reduced(states), self._near
        z: Array | None = None
        if near and states.exact and states.key not in self._bordered and near.serves(reduced):
            self._bordered.add(states.key)
            z = near.solve(reduced, w)
        if z is None:
            factored = self._kept.pop(states.key, None) or Factored(reduced, self._G)
            z = factored.solve(-reduced.rows(w)) if factored.sound else None
            if states.exact:
                self._kept[states.key] = factored  # now the last one
                if len(self._kept) > KEPT:
                    del self._kept[next(iter(self._kept))]
                self._solved.add(states.key)
                self._near = Bordered(factored, self._G)
        return None if z is None or not np.isfinite(z).all() else np.asarray(states.fixed + reduced.columns(z))


class Reduced:
    """Hold R, P and the turns, by places in r.

    z: normals of closed nodes, each with the slip reaction that grows with it, tangents of sticking nodes, turns.
    """

    def __init__(self, states: States) -> None:
        m, d = self._shape = states.fixed.shape
        places = np.arange(m * d).reshape(m, d)
        self.closed, self._turning = states.closed, states.turning
        self.plain = np.concatenate([places[states.closed, 0], places[states.stick, 1:].ravel()])
        self.growth = states.growth[:, None] * states.direction
        n = states.direction[states.turns]
        self._across = n[:, ::-1] * np.array([-1.0, 1.0]) if d == 3 else np.zeros((0, d - 1))
        self._turned = places[states.turns, 1:]
        self.size = len(self.plain) + len(self._turned)

    def rows(self, w: Array) -> Array:
        """Return R w."""
        flat = w.ravel()
        return np.concatenate([flat[self.plain], np.sum(self._across * flat[self._turned], axis=1)])

    def columns(self, z: Array) -> Array:
        """Return P z (m, d)."""
        r = np.zeros(self._shape)
        flat, plain = r.ravel(), len(self.plain)
        flat[self.plain] = z[:plain]
        r[:, 1:] += self.growth * r[:, :1]
        flat[self._turned] += self._across * z[plain:, None]
        return r

    def transposed(self, w: Array) -> Array:
        """Return Pᵀ applied to rows (k, m d), where no node turns."""
        by_node = w.reshape(len(w), *self._shape)
        r = by_node.copy()
        r[:, :, 0] += np.sum(by_node[:, :, 1:] * self.growth, axis=2)
        return np.asarray(r.reshape(w.shape)[:, self.plain])

    def matrix(self, G: Array) -> Array:
        """Return K, made as its transpose: G is symmetric, and rows are near each other in memory."""
        places = np.concatenate([self.plain, self._turned.ravel()])
        part = _block(G, self.plain, places)
        growth = self.growth[self.closed]  # of the first rows of part
        grows = np.flatnonzero(growth.any(axis=1))
        for k in range(self._shape[1] - 1):
            tied = np.flatnonzero(self.closed)[grows] * self._shape[1] + 1 + k
            part[grows] += growth[grows, k, None] * _block(G, tied, places)
        if not len(self._turned):
            return part.T
        turned = _block(G, self._turned.ravel(), places).reshape(*self._turned.shape, -1)
        part = np.vstack([part, np.einsum("ik,ikj->ij", self._across, turned)])
        across = part[:, len(self.plain) :].reshape(len(part), *self._turned.shape)
        transpose = np.hstack([part[:, : len(self.plain)], np.einsum("ik,jik->ji", self._across, across)])
        turns = np.arange(len(self.plain), self.size)
        transpose[turns, turns] += self._turning
        return transpose.T


class Factored:
    """Hold (1) of one set of states with its factor. ``sound``: K is regular."""

    def __init__(self, reduced: Reduced, G: Array) -> None:
        self.reduced = reduced
        self._lu: Any = None
        self.sound = True
        if reduced.size:
            lu, pivots, info = lapack.dgetrf(reduced.matrix(G), overwrite_a=1)
            self._lu, self.sound = (lu, pivots), info == 0

    def solve(self, right: Array) -> Array:
        """Return K⁻¹ right, of one vector or of the columns of a matrix."""
        return np.asarray(lapack.dgetrs(*self._lu, right)[0]) if self.reduced.size else right


class Bordered:
    """Solve (2): problems near ``base``, in 2D or without slip; keeps what K0⁻¹ was applied to."""

    def __init__(self, base: Factored, G: Array) -> None:
        self._base, self._G, self.size = base, G, base.reduced.size
        self._known: dict[int, Array] = {}  # by place, columns of E after columns of G
        self._position = np.full(len(G), -1)
        self._position[base.reduced.plain] = np.arange(self.size)

    def _differences(self, new: Reduced) -> tuple[Indices, Indices, Indices]:
        """Places added, nodes whose slip reaction grows otherwise, positions dropped."""
        old = self._base.reduced
        kept = np.zeros(len(self._G), dtype=bool)
        kept[new.plain] = True
        added = new.plain[self._position[new.plain] < 0]
        other = np.flatnonzero(old.closed & new.closed & np.any(old.growth != new.growth, axis=1))
        return added, other, np.flatnonzero(~kept[old.plain])

    def serves(self, new: Reduced) -> bool:
        """Say whether (2) is faster than a factor."""
        limit = SHARE * self.size if self.size >= LARGE else 0.0
        return self._base.sound and sum(len(part) for part in self._differences(new)) <= limit

    def _applied(self, keys: Indices) -> Array:
        """K0⁻¹ times columns of R0 G and, for keys beyond their number, of E."""
        missing = [key for key in keys.tolist() if key not in self._known]
        if missing:
            count, plain = len(self._G), self._base.reduced.plain
            right = np.zeros((self.size, len(missing)), order="F")
            for i, key in enumerate(missing):
                if key < count:
                    right[:, i] = self._G[key, plain]
                else:
                    right[key - count, i] = 1.0
            self._known.update(zip(missing, self._base.solve(right).T, strict=True))
        return np.array([self._known[key] for key in keys.tolist()]).reshape(len(keys), self.size).T

    def solve(self, new: Reduced, w: Array) -> Array | None:
        """Return z of ``new``; None when it is singular."""
        G, old, flat, d = self._G, self._base.reduced, w.ravel(), w.shape[1]
        added, other, dropped = self._differences(new)
        a, nodes = len(added), np.concatenate([added // d, other])
        change = new.growth[nodes]
        change[:a][added % d != 0] = 0.0
        change[a:] -= old.growth[other]
        grows, k = np.nonzero(change)
        places = np.concatenate([added, nodes[grows] * d + 1 + k])
        P = np.zeros((len(places), len(nodes)))
        P[np.arange(a), np.arange(a)] = 1.0
        P[a + np.arange(len(grows)), grows] = change[grows, k]
        columns = np.hstack([self._applied(places) @ P, -self._applied(len(G) + dropped)])
        border, corner = np.zeros((columns.shape[1], self.size)), np.zeros((columns.shape[1],) * 2)
        border[:a] = old.transposed(G[added])
        border[np.arange(a, len(nodes)), self._position[other * d]] = -1.0
        border[np.arange(len(nodes), len(border)), dropped] = 1.0
        corner[:a, : len(nodes)] = _block(G, added, places) @ P
        corner[np.arange(a, len(nodes)), np.arange(a, len(nodes))] = 1.0
        z = -self._base.solve(flat[old.plain])
        right = -border @ z
        right[:a] -= flat[added]
        _, _, x, info = lapack.dgesv(corner - border @ columns, right)
        if info:
            return None
        r = np.zeros(len(G))
        r[old.plain] = z - columns @ x
        r[added] = x[:a]
        return r[new.plain]


def _block(G: Array, rows: Indices, columns: Indices) -> Array:
    """G at rows and columns; in two steps, which is faster than in one."""
    return np.asarray(G[rows][:, columns])
