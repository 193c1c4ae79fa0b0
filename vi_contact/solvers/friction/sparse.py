"""Solve contact with friction by semismooth Newton with a sparse G, as of many bodies.

The states and the linear problems are those of ``newton``. Here the unknowns of a linear problem
are all reactions, and its rows

    open   r_n = 0                        closed   w_n = 0
    stick  w_t = 0                        slip     n·r_t - growth r_n = cohesion
                                                   t·w_t + turning t·r_t = 0  (in space)

make a Jacobian  J = R G + D  with blocks R, D (d, d) of the conditions, as sparse as G. Problem
after problem is solved with a factor by bodies (``fronts``) that is kept (``kept_factor``). The
first problem has the states of the last step, and so its factor. Linear problems need not be solved
exactly: Newton goes on from what is left, and ends at rounding.
"""

from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, Indices, Mask, max_abs
from ...core.errors import InputError
from ...core.sizes import refuse_memory
from ...kernels.dissection import dissect
from ...kernels.fronts import Fronts
from ..normal.lcp import EPS, SYMMETRIC
from .kept_factor import Jacobian, KeptFactor
from .linear import States
from .problem import LastIterate, ScaledDelassus, ScaledProblem

FOLLOW = 0.1  # of the residual: what the shifted problem may leave where the shift follows
ENOUGH = 1e-2  # of the tolerance: a residual from which on no more is asked for
MOST_STEPS = 60  # of Newton
SLOW = 0.5  # of the residual: a step that leaves more of it is slow
PATIENCE = 4  # slow steps in a row, after which only rounding is left below the goal
# Where traces depend on one another q has rounding that no r removes. With states that stay the
# search ends below this, of the residual of r = 0, and the certificate of the step judges.
STALLED = 1e-6
SEEN = 2  # how often a set of states may come before Newton goes in circles


class SparseDelassus(ScaledDelassus):
    """Hold a sparse d G d with its scale."""

    def __init__(self, G: sp.csr_matrix, bilateral: Mask) -> None:
        """Scale G.

        Args:
            G: (m d, m d) the Delassus operator [m/N].
            bilateral: (m,) which rows are bilateral.

        Raises:
            InputError: G is not finite, or its diagonal not positive.
        """
        m = len(bilateral)
        d = G.shape[0] // m
        diagonal = G.diagonal()
        if not (np.isfinite(G.data).all() and (diagonal > 0.0).all()):
            raise InputError(
                "the Delassus operator contains NaN, or a row that cannot move: check the "
                "factorisation it came from"
            )
        scale = (diagonal**-0.5).reshape(m, d)
        mean = np.mean(scale[:, 1:] ** -2.0, axis=1)  # disks stay disks
        scale[:, 1:] = mean[:, None] ** -0.5
        by_scale = sp.diags(scale.ravel())
        matrix = sp.csr_matrix(by_scale @ G @ by_scale)
        self.scale = scale
        self.bilateral = bilateral.copy()
        self.count = m
        self.dimension = d
        self.symmetric = bool(max_abs((matrix - matrix.T).data) <= SYMMETRIC)
        self.matrix: Any = sp.csr_matrix(0.5 * (matrix + matrix.T)) if self.symmetric else matrix
        self.norm = float(abs(self.matrix).sum(axis=1).max())

    def product(self, r: Array) -> Array:
        """Return G r (m d,)."""
        return np.asarray(self.matrix @ r)

    @cached_property
    def _nodes(self) -> list[tuple[Indices, Array]]:
        """Return, of each node, the places where its rows have entries, and the rows there."""
        d = self.dimension
        nodes = []
        for i in range(self.count):
            rows = self.matrix[i * d : (i + 1) * d]
            places = np.unique(rows.indices)
            nodes.append((places, rows[:, places].toarray()))
        return nodes

    def product_at(self, i: int, r: Array) -> Array:
        """Return the rows (d,) of node i of G r, r (m d,)."""
        places, rows = self._nodes[i]
        return np.asarray(rows @ r[places])

    def block_at(self, i: int) -> Array:
        """Return the block (d, d) of node i on the diagonal of G."""
        rows = slice(i * self.dimension, (i + 1) * self.dimension)
        return np.asarray(self.matrix[rows, rows].toarray())


class SparseNewton:
    """Solve the small problem of one sparse G, which may be singular.

    Attributes:
        delassus: G, scaled.
        kept: the factor, and what has been done with it.
    """

    def __init__(
        self,
        method: Any,
        G: sp.csr_matrix,
        shift: sp.csr_matrix,
        bilateral: Mask,
        *,
        touched: sp.csr_matrix,
        points: Array,
    ) -> None:
        """Scale G.

        Args:
            method: FrictionNewton, for its tolerance.
            G: (m d, m d).
            shift: (m d, m d) what is added to G in Jacobians alone, that they be regular.
            bilateral: (m,) which rows are bilateral.
            touched: (m, bodies) not zero where a condition reads a body.
            points: (m, dimension) where conditions are [m].

        Raises:
            InputError: a factor would take too much memory.
        """
        self._method = method
        self.delassus = SparseDelassus(G, bilateral)
        by_scale = sp.diags(self.delassus.scale.ravel())
        self._shift = sp.csr_matrix(by_scale @ shift @ by_scale)
        self._shifted = sp.csr_matrix(self.delassus.matrix + self._shift)
        d = self.delassus.dimension
        together = _couple(self._shift, d) @ touched
        fronts = Fronts(self._shifted, dissect(sp.csr_matrix(together), points), d)
        refuse_memory("Condensed()", fronts.bytes, instead="fewer stones, or coarser ones")
        self.kept = KeptFactor(fronts)
        self._before: Array | None = None  # r - w of the last answer

    def solve(self, step: ScaledProblem, guess: Array | Mask | None) -> LastIterate:
        """Solve problem (1) of ``problem``, as far as rounding lets it.

        Args:
            step: the problem.
            guess: (m,) predicted contact set, or reactions (m, d) [N].

        Raises:
            StepFailure: the states do not settle.
        """
        r = step.start(guess if step.unit > 0.0 else None)
        if not step.unit > 0.0:
            return LastIterate(r, 0, [])
        # Most states are those of the step before, whose factor is there. Where that leads nowhere
        # the states of the guess are the first.
        if self._before is not None:
            first = States(step, self._before, None)
            self._before = None
            last, tolerance = self._iterate(step, r, first)
            if step.residual(last.r, step.w(last.r)) <= tolerance * step.unit:
                self._before = last.r - step.w(last.r)
                return last
        last, tolerance = self._iterate(step, r, None)
        step.result(self._method, tolerance, last)  # refuses
        self._before = last.r - step.w(last.r)
        return last

    def _iterate(
        self, step: ScaledProblem, r: Array, first: States | None
    ) -> tuple[LastIterate, float]:
        """Iterate by Newton's method until nothing but rounding is left, or in circles.

        With where it ended comes the residual that this may have, that of r = 0 being 1.

        Args:
            step: the problem.
            r: (m, d) reactions to start from, scaled.
            first: the states of the first linear problem; None: those of r.
        """
        tolerance = self._method.tolerance
        goal = tolerance * step.unit
        best = center = r
        least = np.inf
        slow = stays = 0
        history: list[float] = []
        states: States | None = None
        seen: dict[bytes, int] = {}
        w = step.w(r)
        while len(history) < MOST_STEPS:
            # States of the shifted problem, w + σ Z Zᵀ (r - center): it is regular.
            before = b"" if states is None else states.key
            states = first or States(step, r - w - self._spread(r - center), states)
            first = None
            if states.key != before:
                seen[states.key] = seen.get(states.key, 0) + 1
                if seen[states.key] > SEEN:
                    break
            found = self._advance(step, states, r, center, is_rough=slow == 0)
            if found is None:
                break
            r = found
            w = step.w(r)
            residual = step.residual(r, w)
            history.append(residual / step.unit)
            slow = 0 if residual <= SLOW * least else slow + 1
            stays = stays + 1 if states.key == before else 0
            if residual < least:
                best = r
                least = residual
            if residual <= max(ENOUGH * goal, step.rounding(r)):
                break
            if slow >= PATIENCE and least <= goal:
                break
            if min(slow, stays) >= PATIENCE and least <= STALLED * step.unit:
                tolerance = STALLED
                break
            # The shift follows where r solves the shifted problem better than the one wanted.
            if step.residual(r, w + self._spread(r - center)) <= FOLLOW * residual:
                center = r
        return LastIterate(best, len(history), history), tolerance

    def _spread(self, r: Array) -> Array:
        """Return σ Z Zᵀ r (m, d)."""
        return np.asarray(self._shift @ r.ravel()).reshape(r.shape)

    def _advance(
        self,
        step: ScaledProblem,
        states: States,
        r: Array,
        center: Array,
        *,
        is_rough: bool,
    ) -> Array | None:
        """Return the next r (m, d): that of the linear problem of the states.

        Args:
            step: the problem.
            states: of the conditions.
            r: (m, d) reactions so far.
            center: (m, d) those from which the shift counts.
            is_rough: whether the digits of the factor are enough.
        """
        # Reactions that the states tell are put on their values. What r then leaves of the rows is
        # that of the other rows alone.
        r = put_by_states(states, r)
        w = step.w(r) + self._spread(r - center)
        R, D, free = pose_by_states(states)
        left = -np.einsum("ijk,ik->ij", R, w) - np.einsum("ijk,ik->ij", D, r - states.fixed)
        left[~free] = 0.0
        J = Jacobian(self._shifted, R, D)
        marks = np.column_stack([states.closed, states.stick, states.direction])
        dr = self.kept.solve(J, left.ravel(), marks, is_rough=is_rough)
        if dr is None or not np.isfinite(dr).all():
            return None
        return put_by_states(states, r + dr.reshape(r.shape))


def put_by_states(states: States, r: Array) -> Array:
    """Return r (m, d) with open conditions free of forces, and friction of those that slip."""
    r_n = np.where(states.closed, r[:, 0], 0.0)
    across = np.zeros_like(r[:, 1:])
    if r.shape[1] == 3:
        n = states.direction
        t = n[:, ::-1] * np.array([-1.0, 1.0])
        across = np.sum(t * r[:, 1:], axis=1)[:, None] * t
        across[~states.turns] = 0.0
    slips = states.fixed[:, 1:] + (states.growth * r_n)[:, None] * states.direction + across
    return np.column_stack([r_n, np.where(states.stick[:, None], r[:, 1:], slips)])


def _couple(shift: sp.csr_matrix, d: int) -> sp.csr_matrix:
    """Return which conditions a shift couples, (m, m), each with itself.

    Stones that meet at a corner have joints without a common body, which the shift couples.

    Args:
        shift: (m d, m d).
        d: rows of a condition.
    """
    m = shift.shape[0] // d
    entries = sp.coo_matrix(shift)
    large = np.abs(entries.data) > EPS * max_abs(entries.data)
    places = (entries.row[large] // d, entries.col[large] // d)
    pattern = sp.csr_matrix((np.ones(len(places[0])), places), shape=(m, m))
    return sp.csr_matrix(pattern + sp.identity(m))


def pose_by_states(states: States) -> tuple[Array, Array, Mask]:
    """Return blocks R, D (m, d, d) of  R w + D (r - fixed) = 0.

    With them comes which rows (m, d) are not those of the identity.
    """
    m, d = states.fixed.shape
    R = np.zeros((m, d, d))
    D = np.zeros((m, d, d))
    free = np.zeros((m, d), dtype=bool)

    R[:, 0, 0] = states.closed
    D[:, 0, 0] = ~states.closed
    free[:, 0] = states.closed
    tangents = np.arange(1, d)
    R[:, tangents, tangents] = states.stick[:, None]
    D[:, tangents, tangents] = ~states.stick[:, None]
    free[:, 1:] = (states.stick | states.direction.any(axis=1))[:, None]

    # Slip follows its normal; in space it may turn, which the part across the slip says.
    D[:, 1:, 0] = -states.growth[:, None] * states.direction
    if d == 3:
        n = states.direction[states.turns]
        across = n[:, ::-1] * np.array([-1.0, 1.0])
        square = across[:, :, None] * across[:, None, :]
        R[states.turns, 1:, 1:] = square
        D[states.turns, 1:, 1:] += (states.turning[:, None, None] - 1.0) * square
    return R, D, free
