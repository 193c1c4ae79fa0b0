"""Iterate on the whole space-time problem.

The algorithm is Uzawa's, of Aimi, Di Credico and Gimperlein (2024), with FFT.

    solve     v = v_free + W * lam                      all steps at once
    project   r <- Pr_C(r + rho (v_n - gap, slip)),
              Pr_C(w)_n = max(w_n, 0),  Pr_C(w)_t = w_t min(1, F/|w_t|)
    until     |Pr_C(r + rho_1 (v_n - gap, slip)) - r| <= tolerance |r|,
              rho_1 = 1/lambda_max(W[0]), whatever rho is

The normal multiplier meets the gap at the end of each step, the tangential one the slip of the
step; F is Tresca's threshold, or Coulomb's limit of the r_n of the same iteration. By default rho
is 1/lambda_max(W[0]), that of one step.

The operator of all steps is not normal: changes grow before they shrink, the more the more steps
there are, until rounding errors win. So long runs are cut into windows, which are solved one after
the other, with a known past.
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
from ..core.verify import kkt_residual
from ..laws.friction import project
from ..solvers.door import refuse_nan
from ..solvers.passes import Certified
from .contact import BoundaryContact
from .contact_run import ContactRun, run_steps
from .energetic import sum_products

GROWN = 1e12  # change over the first one: diverged
LOOSE = 10.0  # times the tolerance: certificates of a run, which were up to 1.1 times


@dataclass(frozen=True)
class SpaceTimeUzawa:
    """Solve the whole history at once, or window by window.

    The run's ``iterations`` has one entry for each window, ``history`` the relative changes. Its
    certificates measure each step by the largest forces and motions of the run, which is what this
    method solves for.

    Attributes:
        tolerance: relative change of the multiplier to stop at (the source's 1e-n), that of an
            iteration with the default rho.
        rho: step length of the iteration [N/m²]; None for 1/lambda_max(W[0]).
        max_iterations: of each window.
        window: number of steps that are solved at once; None for all.
    """

    tolerance: Annotated[float, Positive] = 1e-8
    rho: Annotated[float | None, Positive, Unit("N/m²")] = None
    max_iterations: Annotated[int, Positive] = 5000
    window: Annotated[int | None, Positive] = None

    def __post_init__(self) -> None:
        check_fields(self)

    def solve(self, contact: BoundaryContact) -> ContactRun:
        """Return the run of all steps.

        Raises:
            InputError: a law of friction that depends on the slip rate.
            StepFailure: ``max_iterations`` that do not reach the tolerance; certificates beyond
                LOOSE times the tolerance.
        """
        instance("SpaceTimeUzawa", "contact", contact, BoundaryContact, "give a BoundaryContact")
        some_rate = np.ones(contact.surface.count)
        if contact.frictional and contact.friction.at(some_rate) is not contact.friction:
            raise InputError(
                f"SpaceTimeUzawa: {contact.friction} depends on the slip rate; use march_contact"
            )
        total = len(contact.v_free)
        length = min(int(self.window or total), total)
        problem = _SpaceTime(contact, length)
        r = np.zeros((total, 2, contact.surface.count))
        history: list[float] = []
        counts: list[int] = []
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
        """Return the multipliers (steps, 2, c) of the window that was entered, and the changes.

        The changes are relative, those of each iteration with the default rho; ``r`` are the
        multipliers to start from.
        """
        rho = self.rho or problem.default_rho
        unit = float(norm(problem.violation(r).ravel()))
        changes: list[float] = []
        while len(changes) < self.max_iterations:
            pushed = problem.violation(r)
            default = problem.project_forces(r + problem.default_rho * pushed)
            size = float(norm(default.ravel()))
            change = float(norm((default - r).ravel())) / (size or 1.0)
            changes.append(change)
            if change <= self.tolerance:
                return default, changes
            r = default if rho == problem.default_rho else problem.project_forces(r + rho * pushed)
            if not np.isfinite(change) or size > GROWN * unit * problem.default_rho:
                break
        raise StepFailure(
            f"{self} stopped after {len(changes)} iterations with a change of {changes[-1]:.1e} at "
            f"rho = {rho:.3g}: take a fifth of this rho, a window of fewer steps, or march_contact"
        )


class _SpaceTime:
    """Describe a window of the history as one problem in r (steps, 2, c): normal, tangential.

    Attributes:
        contact: the condensed body and its support, of c conditions.
        default_rho: 1/lambda_max(W[0]) [N/m²].
    """

    def __init__(self, contact: BoundaryContact, window: int) -> None:
        """Transform the compliance for windows of so many steps."""
        surface = contact.surface
        steps = len(contact.v_free)
        self.contact = contact
        self._total = steps

        # Compliance of normal and tangential unknowns; what does not rub has zero rows and columns.
        tangents = surface.tangents[:, 0]
        self._rubs = (tangents >= 0) & contact.frictional
        places = np.concatenate([surface.owned, np.where(self._rubs, tangents, 0)])
        present = np.concatenate([np.ones(surface.count, bool), self._rubs])
        W = contact.W[:, places][:, :, places] * (present[:, None] & present)
        self._W = W
        self._v_free = contact.v_free[:, places] * present
        self.default_rho = 1.0 / float(np.linalg.eigvalsh(0.5 * (W[0] + W[0].T))[-1])

        # Twice the length: a circular convolution does not wrap around.
        self._length = next_fast_len(2 * window, real=True)
        self._kernel = rfft(W[:window], self._length, axis=0)

        # What the obstacle does, and what friction can carry: still + slope * r_n.
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
        first = window.start
        self._window = window
        self._free = self._v_free[window].copy()
        self._before = np.zeros(r.shape[2])  # tangential displacement at the start of the window
        if not first:
            return

        # What the forces of earlier steps move in the window, and had moved before it.
        lam = -r.reshape(self._total, -1, 1)[:first]
        moved = []
        for k in range(first, window.stop):
            moved.append(sum_products(self._W[k : k - first : -1], lam)[:, 0])
        self._free += np.array(moved)
        v = self._v_free[first - 1] + sum_products(self._W[first - 1 :: -1], lam)[:, 0]
        self._before = v.reshape(2, -1)[1]

    def violation(self, r: Array) -> Array:
        """Return (steps, 2, c): v_n - gap at the ends of the steps, and the slip in them [m]."""
        # The convolution W * r is a product of transforms.
        loads = rfft(r.reshape(len(r), -1), self._length, axis=0)
        products = np.matmul(self._kernel, loads[:, :, None])[:, :, 0]
        moved = irfft(products, self._length, axis=0)[: len(r)]
        v = (self._free - moved).reshape(r.shape)
        slip = np.diff(v[:, 1], axis=0, prepend=self._before[None]) - self._sliding[self._window]
        return np.stack([v[:, 0] - self._gap[self._window], slip * self._rubs], axis=1)

    def project_forces(self, w: Array) -> Array:
        """Project forces w (steps, 2, c) onto C: no tension, no more friction than the limit."""
        normal = w[:, 0] if self.contact.bilateral else np.maximum(w[:, 0], 0.0)
        tangential = project(w[:, 1].reshape(-1, 1), self._limit(normal).ravel())
        return np.stack([normal, tangential.reshape(normal.shape)], axis=1)

    def _limit(self, r_n: Array) -> Array:
        """Return what friction can carry (steps, c) [N/m]."""
        return (self._still + self._slope * np.maximum(r_n, 0.0)) * self._rubs

    def run(self, r: Array, counts: Array, history: tuple[float, ...]) -> ContactRun:
        """Return the steps of these multipliers with their certificates.

        Args:
            r: (all steps, 2, c), multipliers [N/m].
            counts: number of iterations of each window.
            history: relative changes.
        """
        contact = self.contact

        def answer(step: StepProblem) -> Certified:
            """Return the answer of a step whose reactions are known."""
            refuse_nan(step)
            r_n = r[step.k - 1, 0]
            r_t = r[step.k - 1, 1][:, None] if contact.frictional else None
            x = contact.matrix.factor.solve(step.b + contact.load(r_n, r_t))
            active = (r_n > 0.0) | contact.bilateral
            result = StepResult(x, r_n, active, int(counts.sum()), "space-time Uzawa", r_t)
            return Certified(result, kkt_residual(step, result), escalated=False)

        return self._certify(run_steps(contact, answer, iterations=counts, history=history))

    def _certify(self, run: ContactRun) -> ContactRun:
        """Return the run with the certificates of its steps measured by its largest numbers."""
        limit = self._limit(run.r_n)

        # Slips alone are no measure: where all points stick, they are errors.
        motion = max(max_abs(run.displacement), max_abs(self.contact.v_free)) or 1.0
        force = max(max_abs(limit), max_abs(run.r_t)) or 1.0
        gap = run.gap / motion
        slip = run.slip / motion
        limit = limit / force
        r_t = run.r_t / force

        # The residuals of every condition, then the largest one of each step.
        penetration = np.where(self.contact.bilateral, 0.0, -gap)
        complementarity = np.where(run.active, np.abs(gap), 0.0)
        cone = (np.abs(r_t) - limit) * self._rubs
        dissipation = (limit * np.abs(slip) - r_t * slip) * self._rubs
        certificates = []
        for k, certificate in enumerate(run.certificates):
            measured = replace(
                certificate,
                penetration=_largest_excess(penetration[k]),
                complementarity=_largest_excess(complementarity[k]),
                cone=_largest_excess(cone[k]),
                dissipation=_largest_excess(dissipation[k]),
            )
            certificates.append(measured)
        return replace(run, certificates=tuple(certificates))


def _largest_excess(residuals: Array) -> float:
    """Return the largest of the residuals, or 0 where all are below."""
    return float(residuals.max().clip(0.0))
