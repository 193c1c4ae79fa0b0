"""Solve contact with friction where contact alone holds bodies, with rigid motions as unknowns.

A body on springs P that are weak is as flexible along its rigid motions R as the springs, and the
digits of G = B (K + P)⁻¹ Bᵀ drown in this. So the rigid motions are unknowns α of their own here,
and b + P R α is the load of the step, from which the pull is taken that springs shall not have. As
K R = 0, (K + P)⁻¹ P R = R, and

    x = A⁻¹ (b - Bᵀr) + R α,   A = K + P
    w = q + G r - H α,         H = B R,   q = bound - B A⁻¹ b
    Hᵀr + κ S α = Rᵀb,         S = RᵀP R                                                        (1)

This is the step on springs that are κ/(1 + κ) times as strong along rigid motions, and as strong as
before along all others: G is that of firm springs, and κ may be as small as one likes. States,
slips and residuals of conditions are those of ``sparse``, and Newton's linear problem has a border:

    [R_s G + D   -R_s H] [dr]
    [   Hᵀ         κ S ] [dα]

with R_s and D the blocks of the states. Where traces depend on one another σ Z Zᵀ is added to G in
this matrix alone (``hyperstatic``). It is factorised for each set of states, as static stages are
few.
"""

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from ...core.algebra import Array, Mask, max_abs
from ...core.errors import StepFailure
from .hyperstatic import Hyperstatic
from .linear import States
from .problem import FrictionResult, ScaledProblem
from .rings import Ring
from .sparse import SparseDelassus, pose_by_states, put_by_states

MOST_STEPS = 60  # of Newton
GOAL = 1e-12  # of the residual without forces and motions: the iteration ends
ENOUGH = 1e-7  # the same: what an answer may leave; the certificate of the stage judges it
PATIENCE = 4  # iterations with the same states, after which only rounding is left
SEEN = 2  # how often a set of states may come before Newton goes in circles


@dataclass(frozen=True, eq=False)
class Border:
    """Hold what rigid motions add to G.

    Attributes:
        H: (m d, k) B R.
        S: (k, k) RᵀP R.
    """

    H: sp.csr_matrix
    S: sp.csr_matrix


class FloatingNewton(Hyperstatic):
    """Solve problems (1) of one G.

    Attributes:
        kappa: κ of the next problem.
        load: Rᵀb (k,) of the next problem.
        motion: α (k,) of the last answer.
    """

    def __init__(
        self,
        method: object,
        G: sp.csr_matrix,
        bilateral: Mask,
        *,
        rings: list[Ring],
        weights: Array,
        movable: Mask,
        border: Border,
    ) -> None:
        """Scale G and its border.

        Args:
            method: of which results are said to be.
            G: (m d, m d).
            bilateral: (m,) which conditions may pull.
            rings: groups whose traces depend on one another.
            weights: (m,) lengths or areas.
            movable: (m d,) which tangents are not prescribed, True for normals.
            border: of G.
        """
        self._method: Any = method
        self._rings = rings
        self._weights = weights
        self._movable = movable.reshape(len(bilateral), -1)
        self._delassus = SparseDelassus(G, bilateral)

        # Reactions, displacements and rigid motions are in sqrt(J).
        by_scale = sp.diags(self._delassus.scale.ravel())
        shift = by_scale @ self._make_sparse_shift(G) @ by_scale
        self._shifted = sp.csr_matrix(self._delassus.matrix + shift)
        self._sizes = np.sqrt(border.S.diagonal())
        by_size = sp.diags(1.0 / self._sizes)
        self._H = sp.csr_matrix(by_scale @ border.H @ by_size)
        self._Ht = sp.csr_matrix(self._H.T)
        self._S = sp.csr_matrix(by_size @ border.S @ by_size)
        self.kappa = 1.0
        self.load = np.zeros(len(self._sizes))
        self.motion = np.zeros(len(self._sizes))

    def solve(
        self, q: Array, cohesion: Array, slope: Array, guess: Array | Mask | None = None
    ) -> FrictionResult:
        """Solve problem (1) with ``kappa`` and ``load``, and leave its ``motion``.

        Args:
            q: (m, d) gap, and minus the slip, without reactions and rigid motions.
            cohesion: (m,) [N].
            slope: (m,).
            guess: reactions (m, d) [N] to begin with. A contact set is not read.

        Raises:
            StepFailure: the states do not settle.
        """
        step = self._delassus.problem(q, cohesion, slope)
        known = guess is not None and guess.dtype != bool
        r, a, history = self._iterate(step, step.start(guess if known else None))
        self.motion = a / self._sizes
        moved = replace(step, q=step.q - (self._H @ a).reshape(step.q.shape))
        return self._finish(moved, r, len(history), history)

    def _iterate(self, step: ScaledProblem, r: Array) -> tuple[Array, Array, list[float]]:
        """Return reactions (m, d) and motions (k,), scaled, and the residuals on the way.

        Args:
            step: the problem without rigid motions.
            r: (m, d) reactions to begin with.
        """
        g = self.load / self._sizes
        a = np.zeros_like(g)
        unit = max(step.unit, max_abs(g)) or 1.0
        best = (r, a)
        least = np.inf
        history: list[float] = []
        states: States | None = None
        seen: dict[bytes, int] = {}
        stays = 0
        while len(history) < MOST_STEPS:
            # States of the last iterate; those that came before lead in circles.
            before = b"" if states is None else states.key
            states = States(step, r - self._find_gaps(step, r, a), states)
            stays = stays + 1 if states.key == before else 0
            if not stays:
                seen[states.key] = seen.get(states.key, 0) + 1
                if seen[states.key] > SEEN:
                    break
            found = self._advance(step, states, r, a)
            if found is None:
                break
            r, a = found
            gaps = self._find_gaps(step, r, a)
            residual = max(step.residual(r, gaps), max_abs(self._find_imbalance(r, a)))
            history.append(residual / unit)
            if residual < least:
                best = (r, a)
                least = residual
            if residual <= max(GOAL * unit, step.rounding(r)) or stays >= PATIENCE:
                break
        if not least <= ENOUGH * unit:
            raise StepFailure(
                f"Newton's iteration stopped after {len(history)} iterations with residual "
                f"{least / unit:.1e}"
            )
        return *best, history

    def _find_gaps(self, step: ScaledProblem, r: Array, a: Array) -> Array:
        """Return w = q + G r - H a (m, d)."""
        return np.asarray(step.w(r) - (self._H @ a).reshape(r.shape))

    def _find_imbalance(self, r: Array, a: Array) -> Array:
        """Return Hᵀr + κ S a - g (k,)."""
        g = self.load / self._sizes
        return np.asarray(self._Ht @ r.ravel() + self.kappa * (self._S @ a) - g)

    def _advance(
        self, step: ScaledProblem, states: States, r: Array, a: Array
    ) -> tuple[Array, Array] | None:
        """Return the next r (m, d) and a (k,): those of the linear problem of the states.

        Args:
            step: the problem without rigid motions.
            states: of the conditions.
            r: (m, d) reactions so far.
            a: (k,) motions so far.
        """
        # Reactions that the states tell are put on their values, as ``sparse`` does.
        r = put_by_states(states, r)
        R, D, free = pose_by_states(states)
        gaps = self._find_gaps(step, r, a)
        left = -np.einsum("ijk,ik->ij", R, gaps) - np.einsum("ijk,ik->ij", D, r - states.fixed)
        left[~free] = 0.0
        right = np.concatenate([left.ravel(), -self._find_imbalance(r, a)])

        rows = (np.arange(len(r)), np.arange(len(r) + 1))
        by_states = sp.bsr_matrix((R, *rows))
        blocks = [
            [by_states @ self._shifted + sp.bsr_matrix((D, *rows)), -(by_states @ self._H)],
            [self._Ht, self.kappa * self._S],
        ]
        J = sp.csc_matrix(sp.bmat(blocks))
        J.eliminate_zeros()
        try:
            lu = splu(J)
        except RuntimeError:  # singular
            return None
        change = lu.solve(right)
        change += lu.solve(right - J @ change)
        if not np.isfinite(change).all():
            return None
        return put_by_states(states, r + change[: r.size].reshape(r.shape)), a + change[r.size :]
