"""Scale one step to the numbers PETSc computes with, and decide when it is solved.

PETSc's VI and bound-constrained solvers carry absolute tolerances in unknown units. They are handed
z / x_ref and (A z - b) / r_ref instead, with powers of two for x_ref and r_ref, so that both are
near one in any system of units and scaling loses no digit: a bound stays exactly a bound.
"""

from typing import Any

import numpy as np

from ...core.algebra import Array, Mask, max_abs, total
from ...core.step import StepProblem
from ..petsc import PETSc
from .bounded_system import BoundedSystem
from .failures import NOT_A_NUMBER, reason_failure

# backward error |A z - b| / (|A| |z| + |b|), largest entries, of a solve that cannot be improved
ROUND_OFF = 1e-14

INDEFINITE = 1e-8  # of the sizes in a curvature below zero: far above its rounding


class ScaledStep:
    """Evaluate F(y) = (A x_ref y - b) / r_ref with bounds on y, for the step set last.

    ``worst``: error found last.
    """

    def __init__(self, system: BoundedSystem, tolerance: float) -> None:
        self.system, self.tolerance = system, tolerance
        self._norm = system.norm()

    def set(self, step: StepProblem, start: Array) -> None:
        """Take a step that starts from z = start."""
        system = self.system
        self.b = system.load(step.b)
        lower, upper = system.bounds(step)
        # boxes may be wider than anything in them
        reach = upper[np.isfinite(upper) & (step.lower is None)]
        z_max, bound_max, b_max = system.max(max_abs(start), max_abs(reach), max_abs(self.b))
        if z_max == 0.0:
            z_max = self._along(self.b, b_max)
        if b_max <= ROUND_OFF * self._norm * z_max:  # nothing, or what rounding left of it
            b_max = max(b_max, float(system.max(max_abs(system.apply(start)))[0]))
        self.x_ref, self.r_ref = _power_of_two(max(z_max, bound_max)), _power_of_two(b_max)
        self.lower, self.upper = lower / self.x_ref, upper / self.x_ref
        self.start = start / self.x_ref
        self._b_max = b_max / self.r_ref
        self.worst = np.inf

    def _along(self, b: Array, b_max: float) -> float:
        """Return the size of the minimiser of ½ zᵀA z - bᵀz along b.

        It is the size of z when nothing else is known.
        """
        if b_max == 0.0:
            return 0.0
        unit = b / b_max
        bb, bAb = self.system.surface.comm.sum(
            np.array([unit @ unit, unit @ self.system.apply(unit)])
        )
        return b_max * bb / bAb if bAb > 0.0 else 0.0

    def residual(self, y: Array) -> Array:
        """Return F(y)."""
        return np.asarray((self.system.apply(y * self.x_ref) - self.b) / self.r_ref)

    def function(self, _solver: Any, y: Any, F: Any) -> None:
        """Evaluate F(y) as a PETSc callback (SNES function, TAO gradient)."""
        F.array[:] = self.residual(y.array_r)

    def objective(self, _solver: Any, y: Any, G: Any) -> float:
        """Return f(y) - f(origin) and the gradient F(y), for TAO.

        f(y) = ½ y·Hy - y·b/r_ref, H = A x_ref / r_ref.

        A line search compares values, which agree in all their digits where the gradient still has
        eight to lose.
        """
        values = y.array_r
        F = self.residual(values)
        G.array[:] = F
        energy = 0.5 * ((values - self._zero[0]) @ (F + self._zero[1]))
        return total(self.system.surface.comm, energy)

    def measure_from(self, y: Array) -> None:
        """Take y as the origin of the objective."""
        self._zero = y, self.residual(y)

    def curves_down(self, y: Array, F: Array) -> bool:
        """Say whether dy·H dy is below zero by more than rounding.

        dy is the way from the origin of the objective. Below zero, H is not positive definite.
        Collective.
        """
        dy, dF = y - self._zero[0], F - self._zero[1]
        comm = self.system.surface.comm
        curvature, sizes = comm.sum(
            np.array([dy @ dF, np.abs(dy) @ (np.abs(F) + np.abs(self._zero[1]))])
        )
        return bool(curvature < -INDEFINITE * sizes)

    def active(self, y: Array, F: Array) -> Mask:
        """Return (m,) what the natural map chooses.

        It is True where the reaction exceeds the remaining gap.
        """
        i = self.system.bounded
        above, below = self.upper[i] - y[i] < -F[i], y[i] - self.lower[i] < F[i]
        return np.asarray(above | below | (self.lower[i] == self.upper[i]))

    def errors(self, y: Array, F: Array) -> tuple[float, float, float]:
        """Return the largest |F| off the active set and |gap| on it, as in the certificate.

        The backward error of F follows.
        """
        system, i = self.system, self.system.bounded
        active = self.active(y, F)
        gap = np.where(y[i] - self.lower[i] < F[i], y[i] - self.lower[i], self.upper[i] - y[i])[
            active
        ]
        force = F.copy()
        force[i[active]] = 0.0
        # the body feels what is left over on its springs
        force[system.feet] += force[system.rows :]
        Ax = F + self.b / self.r_ref
        Ax[system.feet] += F[system.rows :]
        local = (
            max_abs(force),
            max_abs(gap),
            max_abs(y),
            max_abs(Ax[: system.rows]),
            float(np.isnan(F).any()),
        )
        force_max, gap_max, y_max, Ax_max, broken = system.max(*local)
        if broken:
            return np.nan, np.nan, np.nan
        size = self._norm * y_max * self.x_ref / self.r_ref + self._b_max
        return (
            fraction(force_max, max(self._b_max, Ax_max)),
            fraction(gap_max, y_max),
            fraction(force_max, size),
        )

    def verdict(self, y: Array, F: Array) -> int:
        """Return SNES's reason.

        It is 0 to go on, 2 solved to round-off, 4 below the tolerance and no longer improving.

        PETSc's own tests are relative to the first residual, which a good prediction makes
        unreachable.
        """
        force, gap, backward = self.errors(y, F)
        if np.isnan(force):
            return NOT_A_NUMBER
        worst, before = max(force, gap), self.worst
        self.worst = worst
        if backward <= ROUND_OFF and worst <= self.tolerance and gap <= ROUND_OFF:
            return int(PETSc.SNES.ConvergedReason.CONVERGED_FNORM_ABS)
        if 0.5 * before < worst <= self.tolerance and np.isfinite(before):
            return int(PETSc.SNES.ConvergedReason.CONVERGED_SNORM_RELATIVE)
        return 0

    def answer(self, driver: Any, name: str) -> tuple[Array, Mask, Array, int]:
        """Run a PETSc solver of this step; return (y, active (m,), r_n (m,), iterations).

        StepFailure with its reason.

        Off the active set r_n is zero, so that what is left of F shows in the certificate.
        """
        y, F, reason, iterations = driver.run()
        if reason <= 0 and not self.accepts(y, F):
            raise reason_failure(name, driver.reasons, reason, iterations, self.worst)
        active = self.active(y, F)
        return y, active, np.where(active, self.system.reactions(F * self.r_ref), 0.0), iterations

    def accepts(self, y: Array, F: Array) -> bool:
        """Return True below the tolerance.

        A solver whose line search fails at the floor of round-off is done.
        """
        force, gap, _ = self.errors(y, F)
        self.worst = max(force, gap)
        return self.worst <= self.tolerance


def _power_of_two(value: float) -> float:
    """Return the power of two next above the value.

    It is one for zero, infinity and NaN, which PETSc reports itself.
    """
    return float(np.exp2(np.ceil(np.log2(value)))) if 0.0 < value < np.inf else 1.0


def fraction(value: float, reference: float) -> float:
    """Return value/reference, or the value itself where the reference is not above zero."""
    return value / reference if reference > 0.0 else value
