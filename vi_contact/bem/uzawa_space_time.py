"""Uzawa's iteration on the whole space-time problem: the algorithm of seed 003 with convolutions by FFT.

    solve     v = v_free + W * lam                      all steps at once
    project   r <- Pr_C(r + rho (v_n - gap, slip)),     Pr_C(w)_n = max(w_n, 0),  Pr_C(w)_t = w_t min(1, F/|w_t|)
    until     |r_new - r| <= tolerance |r_new|

The normal multiplier meets the gap at the end of each step, the tangential one the slip of the step; F is Tresca's
threshold or Coulomb's limit of the r_n just found. rho = 1/lambda_max(W[0]) by default: that of one step. The operator
of all steps is not normal, changes grow before they shrink, and rho near 2/lambda_max may not converge at all.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from ..algebra import Array
from ..errors import InputError, StepFailure
from ..friction import project
from ..step import StepResult
from .contact import BoundaryContact
from .contact_run import ContactRun, run_of

GROWN = 1e12  # change over the first one: diverged


@dataclass(frozen=True)
class SpaceTimeUzawa:
    """Settings. tolerance: relative change of the multiplier at which it stops (the source's 1e-n); rho > 0 [N/m²] or
    None: 1/lambda_max(W[0]). The run's ``iterations`` has one entry, ``history`` the relative changes.

    Raises InputError for rho <= 0 and for a law that depends on the slip rate.
    """

    tolerance: float = 1e-8
    rho: float | None = None
    max_iterations: int = 5000

    def __post_init__(self) -> None:
        if self.rho is not None and not 0.0 < self.rho < np.inf:
            raise InputError(f"SpaceTimeUzawa: rho is {self.rho!r}; give a positive number, or None")

    def solve(self, contact: BoundaryContact) -> ContactRun:
        """The run; StepFailure when ``max_iterations`` do not reach the tolerance."""
        if contact.frictional and contact.friction.at(np.ones(contact.surface.count)) is not contact.friction:
            raise InputError(f"SpaceTimeUzawa: {contact.friction} depends on the slip rate; use march_contact")
        problem = _SpaceTime(contact)
        rho = self.rho or problem.default_rho
        r, history = np.zeros((len(contact.v_free), 2, contact.surface.count)), list[float]()
        while len(history) < self.max_iterations:
            new = problem.projected(r + rho * problem.violation(r))
            size = float(np.linalg.norm(new))
            change = float(np.linalg.norm(new - r)) / (size or 1.0)
            history.append(change)
            r = new
            if change <= self.tolerance:
                return problem.run(r, tuple(history))
            if not np.isfinite(change) or size > GROWN * problem.unit * rho:
                break
        raise StepFailure(f"{self} stopped after {len(history)} iterations with a change of {history[-1]:.1e} at "
                          f"rho = {rho:.3g}: take a fifth of this rho, or march_contact")


class _SpaceTime:
    """The whole history as one problem in r (steps, 2, c): normal, tangential."""

    def __init__(self, contact: BoundaryContact) -> None:
        self.contact, surface = contact, contact.surface
        self._steps = steps = len(contact.v_free)
        tangents = surface.tangents[:, 0]
        self._rubs = (tangents >= 0) & contact.frictional
        places = np.concatenate([surface.owned, np.where(self._rubs, tangents, 0)])
        present = np.concatenate([np.ones(surface.count, bool), self._rubs])
        W = contact.W[:, places][:, :, places] * (present[:, None] & present)
        self.default_rho = 1.0 / float(np.linalg.eigvalsh(0.5 * (W[0] + W[0].T))[-1])
        self._length = next_fast_len(2 * steps, real=True)
        self._kernel = rfft(W, self._length, axis=0)
        self._free = contact.v_free[:, places] * present
        times = contact.compliance.dt * np.arange(steps + 1)
        self._gap = np.array([surface.gap(t) for t in times[1:]])
        self._sliding = np.zeros((steps, surface.count))
        for k in range(steps):
            sliding = surface.sliding(times[k], times[k + 1])
            if sliding is not None:
                self._sliding[k] = sliding[:, 0] * self._rubs
        self._still = contact.friction.limit(np.zeros(surface.count), surface.weights, 1.0)
        self._slope = contact.friction.slope(surface.weights)
        self.unit = float(np.linalg.norm(self.violation(np.zeros((steps, 2, surface.count)))))

    def violation(self, r: Array) -> Array:
        """(steps, 2, c): v_n - gap at the ends of the steps, slip in them."""
        loads = rfft(r.reshape(self._steps, -1), self._length, axis=0)
        moved = irfft(np.matmul(self._kernel, loads[:, :, None])[:, :, 0], self._length, axis=0)[: self._steps]
        v = (self._free - moved).reshape(r.shape)
        slip = np.diff(v[:, 1], axis=0, prepend=0.0) - self._sliding
        return np.stack([v[:, 0] - self._gap, slip * self._rubs], axis=1)

    def projected(self, w: Array) -> Array:
        """Pr_C."""
        normal = w[:, 0] if self.contact.bilateral else np.maximum(w[:, 0], 0.0)
        limit = (self._still + self._slope * np.maximum(normal, 0.0)) * self._rubs
        return np.stack([normal, project(w[:, 1].reshape(-1, 1), limit.ravel()).reshape(normal.shape)], axis=1)

    def run(self, r: Array, history: tuple[float, ...]) -> ContactRun:
        """The steps of these multipliers with their certificates."""
        contact, steps, results = self.contact, [], []
        v, active = np.zeros(int(contact.kept.sum())), contact.surface.gap(0.0) <= 0.0
        loads = np.zeros_like(contact.v_free)
        for k in range(self._steps):
            r_t = r[k, 1][:, None] if contact.frictional else None
            step = contact.step(k, loads, v, active)
            loads[k] = contact.load(r[k, 0], r_t)
            v = contact.matrix.factor.solve(step.b + loads[k])
            active = (r[k, 0] > 0.0) | contact.bilateral
            steps.append(step)
            results.append(StepResult(v, r[k, 0], active, len(history), "space-time Uzawa", r_t))
        return run_of(contact, steps, results, iterations=np.array([len(history)]), history=history)
