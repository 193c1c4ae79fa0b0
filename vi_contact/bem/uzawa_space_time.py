"""Iterate on the whole space-time problem.

The algorithm is Uzawa's, of Aimi, Di Credico and Gimperlein (2024), with FFT.

    solve     v = v_free + W * lam                      all steps at once
    project   r <- Pr_C(r + rho (v_n - gap, slip)),
              Pr_C(w)_n = max(w_n, 0),  Pr_C(w)_t = w_t min(1, F/|w_t|)
    until     |Pr_C(r + rho_1 (v_n - gap, slip)) - r| <= tolerance |r|,
              rho_1 = 1/lambda_max(W[0]), whatever rho is

The normal multiplier meets the gap at the end of each step, the tangential one the slip of the
step; F is Tresca's threshold or Coulomb's limit of the r_n just found. rho = 1/lambda_max(W[0]) by
default: that of one step. The operator of all steps is not normal, so that changes grow before they
shrink, the more the more steps there are, until rounding errors win: long runs are cut into
windows, one after the other, the past of which is known.
"""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft
from scipy.linalg import norm  # of tiny numbers too, whose squares are zero

from ..core.algebra import Array, max_abs
from ..core.arguments import check_fields
from ..core.checks import instance
from ..core.errors import InputError, StepFailure
from ..core.quantities import Positive, Unit
from ..core.step import StepProblem, StepResult, refuse_limits
from ..laws.friction import project
from .contact import BoundaryContact
from .contact_run import ContactRun, run_steps
from .energetic import sum_products

GROWN = 1e12  # change over the first one: diverged
LOOSE = 10.0  # times the tolerance: certificates of a run, which were up to 1.1 times


@dataclass(frozen=True)
class SpaceTimeUzawa:
    """Solve the whole history at once, or window by window.

    tolerance: relative change of the multiplier to stop at (the source's 1e-n), that of a step of
    the default rho; rho, or None: 1/lambda_max(W[0]); window: steps that are solved at
    once, all of them if None. The run's ``iterations`` has one entry per window, ``history`` the
    relative changes. Its certificates measure each step by the largest forces and motions of the
    run, which is what this method solves for.

    Raises InputError for a law that depends on the slip rate.
    """

    tolerance: Annotated[float, Positive] = 1e-8
    rho: Annotated[float | None, Positive, Unit("N/m²")] = None
    max_iterations: Annotated[int, Positive] = 5000
    window: Annotated[int | None, Positive] = None

    def __post_init__(self) -> None:
        check_fields(self)

    def solve(self, contact: BoundaryContact) -> ContactRun:
        """Solve the problem.

        It raises StepFailure when ``max_iterations`` do not reach the tolerance, or certificates
        are not within LOOSE times the tolerance.
        """
        instance("SpaceTimeUzawa", "contact", contact, BoundaryContact, "give a BoundaryContact")
        if (
            contact.frictional
            and contact.friction.at(np.ones(contact.surface.count)) is not contact.friction
        ):
            raise InputError(
                f"SpaceTimeUzawa: {contact.friction} depends on the slip rate; use march_contact"
            )
        total = len(contact.v_free)
        length = min(int(self.window or total), total)
        problem = _SpaceTime(contact, length)
        r, history, counts = np.zeros((total, 2, contact.surface.count)), list[float](), list[int]()
        for first in range(0, total, length):
            window = slice(first, min(first + length, total))
            problem.enter(window, r)
            r[window], changes = self._window(problem, np.zeros_like(r[window]))
            history += changes
            counts.append(len(changes))
        run = problem.run(r, np.array(counts), tuple(history))
        if not run.worst <= LOOSE * self.tolerance:
            raise StepFailure(
                f"{self}: the worst certificate is {run.worst:.1e}, of the run's largest numbers, "
                f"and {LOOSE * self.tolerance:.1e} is the limit; take a smaller tolerance, or "
                "march_contact"
            )
        return run

    def _window(self, problem: "_SpaceTime", r: Array) -> tuple[Array, list[float]]:
        """Return the multipliers (steps, 2, c) of the window.

        The window is the one that was entered. With them come the relative changes on the way.
        """
        rho, unit = self.rho or problem.default_rho, float(norm(problem.violation(r).ravel()))
        changes: list[float] = []
        while len(changes) < self.max_iterations:
            pushed = problem.violation(r)
            best = problem.projected(r + problem.default_rho * pushed)
            size = float(norm(best.ravel()))
            change = float(norm((best - r).ravel())) / (size or 1.0)
            changes.append(change)
            if change <= self.tolerance:
                return best, changes
            r = best if rho == problem.default_rho else problem.projected(r + rho * pushed)
            if not np.isfinite(change) or size > GROWN * unit * problem.default_rho:
                break
        raise StepFailure(
            f"{self} stopped after {len(changes)} iterations with a change of {changes[-1]:.1e} at "
            f"rho = {rho:.3g}: take a fifth of this rho, a window of fewer steps, or march_contact"
        )


class _SpaceTime:
    """Describe a window of the history as one problem in r (steps, 2, c): normal, tangential."""

    def __init__(self, contact: BoundaryContact, window: int) -> None:
        self.contact, surface = contact, contact.surface
        self._total = steps = len(contact.v_free)
        tangents = surface.tangents[:, 0]
        self._rubs = (tangents >= 0) & contact.frictional
        places = np.concatenate([surface.owned, np.where(self._rubs, tangents, 0)])
        present = np.concatenate([np.ones(surface.count, bool), self._rubs])
        W = contact.W[:, places][:, :, places] * (present[:, None] & present)
        self.default_rho = 1.0 / float(np.linalg.eigvalsh(0.5 * (W[0] + W[0].T))[-1])
        self._W, self._v_free = W, contact.v_free[:, places] * present
        self._length = next_fast_len(2 * window, real=True)
        self._kernel = rfft(W[:window], self._length, axis=0)
        times = contact.compliance.dt * np.arange(steps + 1)
        self._gap = np.array([surface.gap(t) for t in times[1:]])
        self._sliding = np.zeros((steps, surface.count))
        for k in range(steps):
            sliding = surface.sliding(times[k], times[k + 1])
            if sliding is not None:
                self._sliding[k] = sliding[:, 0] * self._rubs
        refuse_limits(contact.friction, surface, 1.0, 0.0)
        self._still = contact.friction.limit(np.zeros(surface.count), surface.weights, 1.0)
        self._slope = contact.friction.slope(surface.weights)

    def enter(self, window: slice, r: Array) -> None:
        """Make a window current; r (all steps, 2, c) is final before it."""
        first, lam = window.start, -r.reshape(self._total, -1, 1)
        self._window, self._free = window, self._v_free[window].copy()
        self._before = np.zeros(r.shape[2])
        if first:
            self._free += np.array(
                [
                    sum_products(self._W[k : k - first : -1], lam[:first])[:, 0]
                    for k in range(first, window.stop)
                ]
            )
            v = self._v_free[first - 1] + sum_products(self._W[first - 1 :: -1], lam[:first])[:, 0]
            self._before = v.reshape(2, -1)[1]

    def violation(self, r: Array) -> Array:
        """Return (steps, 2, c): v_n - gap at the ends of the steps, slip in them."""
        loads = rfft(r.reshape(len(r), -1), self._length, axis=0)
        moved = irfft(np.matmul(self._kernel, loads[:, :, None])[:, :, 0], self._length, axis=0)[
            : len(r)
        ]
        v = (self._free - moved).reshape(r.shape)
        slip = np.diff(v[:, 1], axis=0, prepend=self._before[None]) - self._sliding[self._window]
        return np.stack([v[:, 0] - self._gap[self._window], slip * self._rubs], axis=1)

    def projected(self, w: Array) -> Array:
        """Project onto C."""
        normal = w[:, 0] if self.contact.bilateral else np.maximum(w[:, 0], 0.0)
        limit = (self._still + self._slope * np.maximum(normal, 0.0)) * self._rubs
        return np.stack(
            [normal, project(w[:, 1].reshape(-1, 1), limit.ravel()).reshape(normal.shape)], axis=1
        )

    def run(self, r: Array, counts: Array, history: tuple[float, ...]) -> ContactRun:
        """Return the steps of these multipliers with their certificates."""
        contact = self.contact

        def solved(step: StepProblem) -> StepResult:
            r_n, r_t = r[step.k - 1, 0], r[step.k - 1, 1][:, None] if contact.frictional else None
            x = contact.matrix.factor.solve(step.b + contact.load(r_n, r_t))
            return StepResult(
                x, r_n, (r_n > 0.0) | contact.bilateral, int(counts.sum()), "space-time Uzawa", r_t
            )

        return self._certified(run_steps(contact, solved, iterations=counts, history=history))

    def _certified(self, run: ContactRun) -> ContactRun:
        """Return the run with the certificates of its steps measured by its largest numbers."""
        limit = (self._still + self._slope * np.maximum(run.r_n, 0.0)) * self._rubs
        motion = max(max_abs(run.displacement), max_abs(self.contact.v_free)) or 1.0
        # slips alone are no measure: where all stick, they are errors
        gap, slip = (run.gap / motion, run.slip / motion)
        limit, r_t = (
            one / (max(max_abs(limit), max_abs(run.r_t)) or 1.0) for one in (limit, run.r_t)
        )
        parts = (
            np.where(self.contact.bilateral, 0.0, -gap),
            np.where(run.active, np.abs(gap), 0.0),
            (np.abs(r_t) - limit) * self._rubs,
            (limit * np.abs(slip) - r_t * slip) * self._rubs,
        )
        rows = zip(
            run.certificates, *(part.max(axis=1).clip(0.0).tolist() for part in parts), strict=True
        )
        return replace(
            run,
            certificates=tuple(
                replace(one, penetration=a, complementarity=b, cone=c, dissipation=d)
                for one, a, b, c, d in rows
            ),
        )
