"""Solve the linear problems of semismooth Newton with friction.

It is done by whichever of two matrices is the smaller.

With the rows R that must hold, r = fixed + P z and w = q + G fixed:

    K z = -R w,    K = R G P (+ the turns in 3D)                                                (1)

Where most places are in R, the others S are fewer. With H = G⁻¹, made once, and C r = 0 what holds
there, r_S zero or growing with its normal, K z = v is r = H (v + s) with s at S only:

    (C H)_S s = -C H v                                                                          (2)
"""

from typing import Any

import numpy as np
from scipy.linalg import lapack

from ...core.algebra import Array, Indices, Mask
from .problem import ScaledDelassus, ScaledProblem

KEPT = 8  # factors
LARGE = 150  # unknowns from which (2) is faster, as measured
MOST = 0.55  # of all places, beyond which it is
INVERTED = 3000  # unknowns up to which H is worth its memory


class States:
    """Find the states of m nodes at y; a node that turned back since ``before`` sticks first.

    Masks (m,) ``closed``, ``stick`` and, in 3D, ``turns``, slip along an unknown direction. Slip
    reactions are fixed + growth r_n direction, (m, d - 1) with ``growth`` (m,); ``fixed`` (m, d).
    ``turning``: (|y_t| - limit)/limit of nodes that turn. ``exact``: none does, and the linear
    problem depends on ``key`` only.
    """

    def __init__(self, step: ScaledProblem, y: Array, before: "States | None") -> None:
        m, d = y.shape
        limit = step.limit(y[:, 0])
        size = np.linalg.norm(y[:, 1:], axis=1)
        self.closed: Mask = (y[:, 0] > 0.0) | step.delassus.bilateral
        back = (
            np.zeros(m, dtype=bool)
            if before is None
            else np.sum(before.direction * y[:, 1:], axis=1) < 0.0
        )
        self.stick: Mask = ((size <= limit) | back) & (limit > 0.0)
        slip = ~self.stick & (limit > 0.0)
        self.direction: Array = np.divide(
            y[:, 1:], size[:, None], out=np.zeros((m, d - 1)), where=slip[:, None]
        )
        self.growth = np.where(slip & (y[:, 0] > 0.0), step.slope, 0.0)
        self.turns: Mask = slip if d == 3 else np.zeros(m, dtype=bool)
        self.exact = not self.turns.any()
        self.turning = size[self.turns] / limit[self.turns] - 1.0
        self.fixed = np.column_stack(
            [np.zeros(m), np.where(slip, step.cohesion, 0.0)[:, None] * self.direction]
        )
        self.key = b"".join(
            part.tobytes() for part in (self.closed, self.stick, self.direction, self.growth)
        )


class LinearProblems:
    """Solve the linear problems of one run of Newton's method.

    The way of solution depends on this run alone, not on ``kept``, the factors of the last sets of
    states of one G: they save time and change no digit of an answer.
    """

    def __init__(self, delassus: ScaledDelassus, kept: "dict[bytes, Factored]") -> None:
        self._delassus, self._kept = delassus, kept
        self._solved: set[bytes] = set()

    def solve(self, states: States, w: Array) -> Array | None:
        """Return r; None when the problem is singular, or exact and solved before."""
        if states.key in self._solved:
            return None
        reduced = Reduced(states)
        factored = self._kept.pop(states.key, None) or Factored(reduced, self._delassus)
        if states.exact:
            self._kept[states.key] = factored  # now the last one
            if len(self._kept) > KEPT:
                del self._kept[next(iter(self._kept))]
            self._solved.add(states.key)
        z = factored.solve(-reduced.rows(w)) if factored.sound else None
        return (
            None
            if z is None or not np.isfinite(z).all()
            else np.asarray(states.fixed + reduced.columns(z))
        )


class Reduced:
    """Hold R, P and the turns, by places in r.

    z: normals of closed nodes, each with the slip reaction that grows with it, tangents of sticking
    nodes, turns.
    """

    def __init__(self, states: States) -> None:
        m, d = self.shape = states.fixed.shape
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
        r = np.zeros(self.shape)
        flat, plain = r.ravel(), len(self.plain)
        flat[self.plain] = z[:plain]
        r[:, 1:] += self.growth * r[:, :1]
        flat[self._turned] += self._across * z[plain:, None]
        return r

    def matrix(self, G: Array) -> Array:
        """Return K, made as its transpose.

        The rows of the transpose are near each other in memory; G is transposed too.
        """
        places = np.concatenate([self.plain, self._turned.ravel()])
        part = _block(G, self.plain, places)
        growth = self.growth[self.closed]  # of the first rows of part
        grows = np.flatnonzero(growth.any(axis=1))
        for k in range(self.shape[1] - 1):
            tied = np.flatnonzero(self.closed)[grows] * self.shape[1] + 1 + k
            part[grows] += growth[grows, k, None] * _block(G, tied, places)
        if not len(self._turned):
            return part.T
        turned = _block(G, self._turned.ravel(), places).reshape(*self._turned.shape, -1)
        part = np.vstack([part, np.einsum("ik,ikj->ij", self._across, turned)])
        across = part[:, len(self.plain) :].reshape(len(part), *self._turned.shape)
        transpose = np.hstack(
            [part[:, : len(self.plain)], np.einsum("ik,jik->ji", self._across, across)]
        )
        turns = np.arange(len(self.plain), self.size)
        transpose[turns, turns] += self._turning
        return transpose.T


class Factored:
    """Hold (1) of one set of states, or (2) where that is smaller, with its factor.

    ``sound``: it is regular.
    """

    def __init__(self, reduced: Reduced, delassus: ScaledDelassus) -> None:
        self.reduced, self._delassus, self._H = reduced, delassus, None
        self._lu: Any = None
        self.sound = True
        large = delassus.symmetric and LARGE <= reduced.size == len(reduced.plain)
        if large and MOST * len(delassus.matrix) < reduced.size < INVERTED:
            self._H = delassus.inverse
        G = delassus.matrix if delassus.symmetric else delassus.matrix.T
        matrix = reduced.matrix(G) if self._H is None else self._rest(self._H)
        if matrix.size:
            lu, pivots, info = lapack.dgetrf(matrix, overwrite_a=1)
            self._lu, self.sound = (lu, pivots), info == 0

    def _rest(self, H: Array) -> Array:
        """Return the matrix of (2)."""
        growth, left = np.zeros(self.reduced.shape), np.ones(len(H), dtype=bool)
        growth[:, 1:], left[self.reduced.plain] = self.reduced.growth, False
        self._others = others = np.flatnonzero(left)
        self._normals, self._rows = others // growth.shape[1] * growth.shape[1], H[others]
        self._growth = growth.ravel()[others]
        return np.asarray(
            self._rows[:, others] - self._growth[:, None] * _block(H, self._normals, others)
        )

    def solve(self, right: Array) -> Array:
        """Return K⁻¹ right."""
        if self._H is None:
            return np.asarray(lapack.dgetrs(*self._lu, right)[0]) if self.reduced.size else right
        r = self._whole(self._H, right)
        # H is less exact than factors
        r += self._whole(self._H, right - self._delassus.product(r)[self.reduced.plain])
        return np.asarray(r[self.reduced.plain])

    def _whole(self, H: Array, v: Array) -> Array:
        """Return r of (2)."""
        full = np.zeros(len(H))
        full[self.reduced.plain] = v
        r = H @ full
        if len(self._others):
            r += (
                lapack.dgetrs(*self._lu, self._growth * r[self._normals] - r[self._others])[0]
                @ self._rows
            )
            r[self._others] = self._growth * r[self._normals]
        return np.asarray(r)


def _block(G: Array, rows: Indices, columns: Indices) -> Array:
    """G at rows and columns; in two steps, which is faster than in one."""
    return np.asarray(G[rows][:, columns])
