"""Semismooth Newton for contact with friction: the default. In 2D it is an active-set method and ends exactly.

With y = r - w of the last iterate every node is open (y_n <= 0) or closed, and sticks (|y_t| <= limit) or slips along
n = y_t/|y_t|. The next iterate solves the linear problem of these states, Newton's step for the natural map (2) of
friction_small.py with the limit of the augmented reaction max(y_n, 0) (Alart and Curnier 1991; Hüeber, Stadler and
Wohlmuth, SIAM J. Sci. Comput. 30, 2008):

    open   r_n = 0                        closed   w_n = 0
    stick  w_t = 0                        slip     r_t = limit(r_n) n + eta t,   t·w_t + (|y_t| - limit)/limit eta = 0

eta is the turn of the slip direction, t perpendicular to n: in 2D there is none, the problem is piecewise linear, and
the iterate of the right states is exact. The factors of the last sets of states are kept, so that a step whose states
are those of a step before costs triangular solves only; they change no digit of the answer.

Slip that turned back within one iteration overshot: such a node sticks in the next, which ends the usual cycles of
slip to and fro. Where Newton cycles all the same, Gauss-Seidel sweeps (nsgs.py) lead to a better start.
"""

from __future__ import annotations

from collections import OrderedDict
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import lapack

from .friction_small import Blocks, FrictionResult, Step
from .lcp import Array, Mask
from .nsgs import sweeps

KEPT = 8  # factors
ATTEMPTS = 8  # of Newton, with twice the sweeps before each
FIRST_SWEEPS = 10


@dataclass(frozen=True)
class FrictionNewton:
    """Settings. ``tolerance``: residual above which the answer is refused; ``max_iterations`` of Newton in a row.

    In the result ``iterations`` counts linear solves and fallback sweeps (0: no contact), ``history`` the residual
    after each linear solve.
    """

    tolerance: float = 1e-11
    max_iterations: int = 30

    def prepare(self, G: Array, bilateral: Mask) -> PreparedNewton:
        """Check and scale G (m d, m d)."""
        return PreparedNewton(self, G, bilateral)


class PreparedNewton:
    """One G, many right-hand sides. The answer depends on these alone, not on steps before."""

    def __init__(self, method: FrictionNewton, G: Array, bilateral: Mask) -> None:
        self.method = method
        self.blocks = Blocks(G, bilateral)
        self._kept: OrderedDict[bytes, tuple[_Reduced, Any]] = OrderedDict()

    def solve(self, q: Array, cohesion: Array, slope: Array, guess: Array | Mask | None = None) -> FrictionResult:
        """See PreparedFriction."""
        step = self.blocks.step(q, cohesion, slope)
        history: list[float] = []
        r, swept = np.zeros_like(step.q), 0
        y = _start(step, guess)
        for attempt in range(ATTEMPTS if step.unit > 0.0 else 0):
            r, done = self._newton(step, y, history)
            if done or attempt == ATTEMPTS - 1:
                break
            number = FIRST_SWEEPS * 2**attempt
            r, swept = sweeps(step, step.admissible(r), number), swept + number
            y = r - step.w(r)
        return step.result(
            r,
            iterations=len(history) + swept,
            method=self.method,
            tolerance=self.method.tolerance,
            history=tuple(history),
        )

    def _newton(self, step: Step, y: Array, history: list[float]) -> tuple[Array, bool]:
        """The best iterate, and whether it solves the problem to rounding or to the tolerance."""
        best, smallest = np.zeros_like(y), step.unit
        seen: set[bytes] = set()
        states: _States | None = None
        for _ in range(self.method.max_iterations):
            states = _States(step, y, states)
            r = None if states.key in seen else self._solved(step, states)
            if r is None:
                break
            if states.exact:
                seen.add(states.key)
            w = step.w(r)
            residual = step.residual(r, w)
            history.append(residual / step.unit)
            if residual < smallest:
                best, smallest = r, residual
            if residual <= step.rounding(r):
                return r, True
            y = r - w
        return best, smallest <= self.method.tolerance * step.unit

    def _solved(self, step: Step, states: _States) -> Array | None:
        """The next iterate; None when the linear problem is singular."""
        reduced, factor = self._linear(states)
        if reduced.size == 0:
            return states.fixed
        if factor is None:
            return None
        solved, _ = lapack.dgetrs(*factor, -reduced.rows(step.w(states.fixed)))
        if not np.isfinite(solved).all():
            return None
        return np.asarray(states.fixed + reduced.columns(solved))

    def _linear(self, states: _States) -> tuple[_Reduced, Any]:
        """The linear problem of the states and its factor, kept where they do not depend on more."""
        if states.exact and states.key in self._kept:
            self._kept.move_to_end(states.key)
            return self._kept[states.key]
        reduced, factor = _Reduced(states), None
        if reduced.size:
            lu, pivots, info = lapack.dgetrf(reduced.matrix(self.blocks.matrix), overwrite_a=1)
            factor = None if info else (lu, pivots)
        if states.exact:
            self._kept[states.key] = (reduced, factor)
            if len(self._kept) > KEPT:
                self._kept.popitem(last=False)
        return reduced, factor


def _start(step: Step, guess: Array | Mask | None) -> Array:
    """y to start from. A guessed set gives a direction d, which opens it row by row; r = -(q·d)/(d·G d) d."""
    r = step.start(guess)
    carried = r != 0.0
    if guess is not None and guess.dtype == bool and carried.any():
        r *= -(step.q[carried] @ r[carried]) / np.vdot(step.moved(r), r)
    return np.asarray(r - step.w(r))


class _States:
    """The states of all nodes at y; a node that turned back since ``before`` sticks first.

    ``exact``: the linear problem depends on ``key`` only.
    """

    def __init__(self, step: Step, y: Array, before: _States | None) -> None:
        m, d = y.shape
        limit = step.limit(y[:, 0])
        size = np.linalg.norm(y[:, 1:], axis=1)
        self.closed: Mask = (y[:, 0] > 0.0) | step.blocks.bilateral
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


class _Reduced:
    """Rows R, columns P and turning t of  R (q + G (fixed + P z)) + t z = 0,  r = fixed + P z, by places in r.

    z: normals of closed nodes, each with the slip reaction that grows with it, tangents of sticking nodes, turns.
    """

    def __init__(self, states: _States) -> None:
        m, d = self._shape = states.fixed.shape
        self._closed, self._turns, self._turning = states.closed, states.turns, states.turning
        places = np.arange(m * d).reshape(m, d)
        self._plain = np.concatenate([places[states.closed, 0], places[states.stick, 1:].ravel()])
        self._tied = places[states.closed, 1:]
        self._growth = (states.growth[:, None] * states.direction)[states.closed]
        n = states.direction[states.turns]
        self._across = n[:, ::-1] * np.array([-1.0, 1.0]) if d == 3 else np.zeros((0, d - 1))
        self._turned = places[states.turns, 1:]
        self.size = len(self._plain) + len(self._turned)

    def rows(self, w: Array) -> Array:
        """R w."""
        flat = w.ravel()
        return np.concatenate([flat[self._plain], np.sum(self._across * flat[self._turned], axis=1)])

    def columns(self, z: Array) -> Array:
        """P z (m, d)."""
        r = np.zeros(self._shape)
        flat, plain = r.ravel(), len(self._plain)
        flat[self._plain] = z[:plain]
        r[self._closed, 1:] += self._growth * z[: len(self._tied), None]
        flat[self._turned] += self._across * z[plain:, None]
        return r

    def matrix(self, G: Array) -> Array:
        """R G P + diag(t), by rows of its transpose: G is symmetric."""
        part, plain = G[self._plain], len(self._plain)
        grows = np.flatnonzero(self._growth.any(axis=1))
        for k in range(self._shape[1] - 1):
            part[grows] += self._growth[grows, k, None] * G[self._tied[grows, k]]
        if len(self._turned):
            part = np.vstack([part, np.einsum("ik,ikj->ij", self._across, G[self._turned])])
        transpose = np.empty((self.size, self.size))
        transpose[:, :plain] = np.take(part, self._plain, axis=1)
        if len(self._turned):
            transpose[:, plain:] = np.einsum("ik,jik->ji", self._across, part[:, self._turned])
        turns = np.arange(plain, self.size)
        transpose[turns, turns] += self._turning
        return transpose.T
