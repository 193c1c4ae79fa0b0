"""Evaluate a friction law in a step: limits that are affine in r_n, with coefficients that may depend on the slip rate.

A law with rates may have several solutions where it weakens. As in ``friction.slip_rate`` the step begins with the
coefficients of rest and takes those of the slip found in a few rounds; then they follow every Newton step, with
their derivative, by differences.

Where Newton's steps go in circles, which large coefficients may bring about, limits are given for some rounds, those
of the r_n found last: Tresca problems, which are convex (Nečas, Jarušek and Haslinger, Boll. Unione Mat. Ital. 17-B,
1980). A law that weakens steeply goes back to the coefficients of rest, and climbs for more rounds than before.
"""

import numpy as np

from ...core.algebra import Array
from ...core.step import StepProblem
from .friction_states import Limits

ROUNDS = 4  # with coefficients that are given
DIFFERENCE = 1e-6  # of the slip


class LawOfStep:
    """Evaluate the law of a step. ``settled``: its coefficients are constant, or follow the slip by now."""

    def __init__(self, step: StepProblem) -> None:
        self._step = step
        rest = np.zeros((step.surface.count, step.surface.tangents.shape[1]))
        self._constant = step.rate_factor == 0.0 or step.friction_at(rest) is step.friction
        self._given, self._left = rest, 0 if self._constant else ROUNDS
        self._limit, self._tresca = np.zeros(len(rest)), 0

    @property
    def settled(self) -> bool:
        """Say whether an answer with the present coefficients is one of the step."""
        return self._left == 0 and self._tresca == 0

    def advance(self, slip: Array, r_n: Array) -> None:
        """Take the coefficients of this slip (m, d - 1), or the limits of r_n; after some rounds they follow."""
        if self._tresca:
            self._tresca -= 1
            self._limit = self._at(slip)(r_n)
        else:
            self._given = slip
            self._left -= 1

    def give(self, rounds: int, slip: Array, r_n: Array) -> None:
        """Begin rounds of given coefficients, those of rest, or of given limits where coefficients are constant."""
        if self._constant:
            self._limit, self._tresca = self._at(slip)(r_n), rounds
        else:
            self._given, self._left = np.zeros_like(slip), rounds

    def __call__(self, slip: Array, r_n: Array, reach: Array) -> Limits:
        """Return the limits at this slip, or at the one that is given. ``reach`` (m,): slips that points at rest may
        come to; they rise with the law where it grows."""
        if self._tresca:
            none = np.zeros_like(self._limit)
            return Limits(self._limit, none, none)
        if self._constant or self._left:
            return self._at(self._given)
        here, rest, size = self._at(slip), self._at(np.zeros_like(slip)), np.linalg.norm(slip, axis=1)
        moved = size > 0.0
        h = DIFFERENCE * np.where(moved, size, reach)
        change = self._at(np.column_stack([size + h, *np.zeros_like(slip.T[1:])]))(r_n) - here(r_n)
        rise = np.where(h > 0.0, change, 0.0) / np.where(h > 0.0, h, 1.0)
        return Limits(here.cohesion, here.slope, np.where(moved, rise, np.maximum(rise, 0.0)), rest)

    def _at(self, slip: Array) -> Limits:
        step, none = self._step, np.zeros(self._step.surface.count)
        law = step.friction_at(slip)
        weights = step.surface.weights
        return Limits(law.limit(none, weights, step.scale), law.slope(weights), none)
