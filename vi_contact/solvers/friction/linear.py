"""Solve the linear problems of semismooth Newton with friction, by the smaller of two matrices.

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
    """Hold the states of m nodes at y.

    Attributes:
        closed, stick: (m,) which nodes are closed, and which stick.
        direction: (m, d - 1) n of the nodes that slip, zero of all others.
        growth: (m,) by how much the friction of a node that slips grows with r_n.
        turns: (m,) which nodes slip along a direction that may turn: in 3D those that slip.
        turning: (t,) (|y_t| - limit)/limit of nodes that turn.
        fixed: (m, d) the part of the reactions that is known, cohesion along the slip: slip
            reactions are fixed + growth r_n direction.
        exact: whether no node turns: the linear problem then depends on ``key`` only.
        key: bytes that tell states apart.
    """

    def __init__(self, step: ScaledProblem, y: Array, before: "States | None") -> None:
        """Find the states.

        Args:
            step: the problem.
            y: (m, d) r - w.
            before: the states before: a node whose slip has turned back since then sticks first.
        """
        m, d = y.shape
        y_n = y[:, 0]
        y_t = y[:, 1:]
        limit = step.limit(y_n)
        size = np.linalg.norm(y_t, axis=1)

        # Which nodes are closed, stick and slip.
        self.closed: Mask = (y_n > 0.0) | step.delassus.bilateral
        sticks = size <= limit
        if before is not None:
            sticks |= np.sum(before.direction * y_t, axis=1) < 0.0
        self.stick: Mask = sticks & (limit > 0.0)
        slip = ~self.stick & (limit > 0.0)

        # How the friction of those that slip follows their normal reaction.
        self.direction: Array = np.divide(
            y_t, size[:, None], out=np.zeros((m, d - 1)), where=slip[:, None]
        )
        self.growth = np.where(slip & (y_n > 0.0), step.slope, 0.0)
        cohesion = np.where(slip, step.cohesion, 0.0)
        self.fixed = np.column_stack([np.zeros(m), cohesion[:, None] * self.direction])

        # Which of them may turn.
        self.turns: Mask = slip if d == 3 else np.zeros(m, dtype=bool)
        self.exact = not self.turns.any()
        self.turning = size[self.turns] / limit[self.turns] - 1.0

        parts = (self.closed, self.stick, self.direction, self.growth)
        self.key = b"".join(part.tobytes() for part in parts)


class LinearProblems:
    """Solve the linear problems of one run of Newton's method."""

    def __init__(self, delassus: ScaledDelassus, factors: "dict[bytes, Factored]") -> None:
        """Begin a run.

        Args:
            delassus: G.
            factors: those of the last sets of states of this G. They save time and change no digit:
                the way of solution depends on this run alone.
        """
        self._delassus = delassus
        self._factors = factors
        self._solved: set[bytes] = set()

    def solve(self, states: States, w: Array) -> Array | None:
        """Return r (m, d), for w = q + G fixed.

        It is None when the problem is singular, or exact and solved before.
        """
        if states.key in self._solved:
            return None
        reduced = Reduced(states)
        factored = self._factors.pop(states.key, None) or Factored(reduced, self._delassus)
        if states.exact:
            self._factors[states.key] = factored  # now the last one
            if len(self._factors) > KEPT:
                del self._factors[next(iter(self._factors))]
            self._solved.add(states.key)
        if not factored.sound:
            return None
        z = factored.solve(-reduced.rows(w))
        if not np.isfinite(z).all():
            return None
        return np.asarray(states.fixed + reduced.columns(z))


class Reduced:
    """Hold R, P and the turns, by places in r.

    z: normals of closed nodes, each with the slip reaction that grows with it, tangents of sticking
    nodes, turns.

    Attributes:
        shape: m and d.
        closed: (m,) which nodes are.
        plain: places of the unknowns that are entries of r: all but turns.
        growth: (m, d - 1) by how much slip reactions grow with their normal.
        size: number of unknowns.
    """

    def __init__(self, states: States) -> None:
        """Find the unknowns of these states."""
        self.shape = states.fixed.shape
        m, d = self.shape
        places = np.arange(m * d).reshape(m, d)
        normals = places[states.closed, 0]
        tangents = places[states.stick, 1:].ravel()
        self.closed = states.closed
        self.plain = np.concatenate([normals, tangents])
        self.growth = states.growth[:, None] * states.direction

        # A turn moves the reaction of its node across the slip.
        self._turning = states.turning
        self._turned = places[states.turns, 1:]
        self._across = np.zeros((0, d - 1))
        if d == 3:
            n = states.direction[states.turns]
            self._across = n[:, ::-1] * np.array([-1.0, 1.0])
        self.size = len(self.plain) + len(self._turned)

    def rows(self, w: Array) -> Array:
        """Return R w."""
        flat = w.ravel()
        across = np.sum(self._across * flat[self._turned], axis=1)
        return np.concatenate([flat[self.plain], across])

    def columns(self, z: Array) -> Array:
        """Return P z (m, d)."""
        r = np.zeros(self.shape)
        flat = r.ravel()
        plain = len(self.plain)
        flat[self.plain] = z[:plain]
        r[:, 1:] += self.growth * r[:, :1]
        flat[self._turned] += self._across * z[plain:, None]
        return r

    def matrix(self, G: Array) -> Array:
        """Return K of a transposed G.

        K is made as its transpose, whose rows are near each other in memory.
        """
        # Pᵀ Gᵀ: rows of the unknowns that are entries of r, at the places of R.
        plain = len(self.plain)
        places = np.concatenate([self.plain, self._turned.ravel()])
        part = _take_block(G, self.plain, places)

        # To the row of a normal comes what its slip reaction adds.
        growth = self.growth[self.closed]  # of the first rows of part
        grows = np.flatnonzero(growth.any(axis=1))
        for k in range(self.shape[1] - 1):
            tied = np.flatnonzero(self.closed)[grows] * self.shape[1] + 1 + k
            part[grows] += growth[grows, k, None] * _take_block(G, tied, places)
        if not len(self._turned):
            return part.T

        # Rows and columns of turns: the same across the slip; on the diagonal their own equation.
        turned = _take_block(G, self._turned.ravel(), places).reshape(*self._turned.shape, -1)
        part = np.vstack([part, np.einsum("ik,ikj->ij", self._across, turned)])
        across = part[:, plain:].reshape(len(part), *self._turned.shape)
        transpose = np.hstack([part[:, :plain], np.einsum("ik,jik->ji", self._across, across)])
        turns = np.arange(plain, self.size)
        transpose[turns, turns] += self._turning
        return transpose.T


class Factored:
    """Hold (1) of one set of states, or (2) where that is smaller, with its factor.

    Attributes:
        reduced: the unknowns of the states.
        sound: whether the matrix is regular.
    """

    def __init__(self, reduced: Reduced, delassus: ScaledDelassus) -> None:
        """Form and factorise the smaller matrix."""
        self.reduced = reduced
        self._delassus = delassus
        self._H: Array | None = None
        self._lu: Any = None
        self.sound = True

        has_turns = reduced.size != len(reduced.plain)
        is_large = delassus.symmetric and reduced.size >= LARGE and not has_turns
        if is_large and MOST * len(delassus.matrix) < reduced.size < INVERTED:
            self._H = delassus.inverse
        if self._H is not None:
            matrix = self._form_rest(self._H)
        else:
            transposed = delassus.matrix if delassus.symmetric else delassus.matrix.T
            matrix = reduced.matrix(transposed)
        if matrix.size:
            lu, pivots, info = lapack.dgetrf(matrix, overwrite_a=1)
            self._lu = lu, pivots
            self.sound = info == 0

    def _form_rest(self, H: Array) -> Array:
        """Return the matrix of (2), and note the other places and how they follow normals."""
        reduced = self.reduced
        left = np.ones(len(H), dtype=bool)
        left[reduced.plain] = False
        self._others = np.flatnonzero(left)

        # r at the other places is growth times the normal of its node: C = 1 - growth.
        d = reduced.shape[1]
        growth = np.zeros(reduced.shape)
        growth[:, 1:] = reduced.growth
        self._normals = self._others // d * d
        self._growth = growth.ravel()[self._others]
        self._rows = H[self._others]
        of_normals = _take_block(H, self._normals, self._others)
        return np.asarray(self._rows[:, self._others] - self._growth[:, None] * of_normals)

    def solve(self, right: Array) -> Array:
        """Return K⁻¹ right."""
        if self._H is None:
            return np.asarray(lapack.dgetrs(*self._lu, right)[0]) if self.reduced.size else right
        plain = self.reduced.plain
        r = self._solve_whole(self._H, right)
        # H is less exact than factors: one step of refinement.
        left = right - self._delassus.product(r)[plain]
        r += self._solve_whole(self._H, left)
        return np.asarray(r[plain])

    def _solve_whole(self, H: Array, v: Array) -> Array:
        """Return r of (2), at all places."""
        full = np.zeros(len(H))
        full[self.reduced.plain] = v
        r = H @ full
        if len(self._others):
            missing = self._growth * r[self._normals] - r[self._others]
            s = lapack.dgetrs(*self._lu, missing)[0]
            r += s @ self._rows
            r[self._others] = self._growth * r[self._normals]
        return np.asarray(r)


def _take_block(G: Array, rows: Indices, columns: Indices) -> Array:
    """Return G at rows and columns; in two steps, which is faster than in one."""
    return np.asarray(G[rows][:, columns])
