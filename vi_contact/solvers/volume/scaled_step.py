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
from .failures import NOT_A_NUMBER, make_reason_failure

# backward error |A z - b| / (|A| |z| + |b|), largest entries, of a solve that cannot be improved
ROUND_OFF = 1e-14

INDEFINITE = 1e-8  # of the sizes in a curvature below zero: far above its rounding


class ScaledStep:
    """Evaluate F(y) = (A x_ref y - b) / r_ref with bounds on y, for the step set last.

    Attributes:
        system: A, the surface and its springs.
        tolerance: the largest relative error that is accepted.
        b: (n,) the load [N].
        x_ref, r_ref: units of z and of forces.
        lower, upper: (n,) bounds of y.
        start: (n,) where to begin.
        worst: relative error found last.
    """

    def __init__(self, system: BoundedSystem, tolerance: float) -> None:
        """Note the system; ``set`` takes a step."""
        self.system = system
        self.tolerance = tolerance
        self._norm = system.norm()

    def renew(self) -> None:
        """Measure A again, whose entries have changed. Collective."""
        self._norm = self.system.norm()

    def set(self, step: StepProblem, start: Array) -> None:
        """Take a step that starts from z = start (n,). Collective."""
        system = self.system
        self.b = system.load(step.b)
        lower, upper = system.bounds(step)

        # Units: the largest displacements and forces that are known before the step is solved.
        # Bounds from both sides tell nothing: boxes may be wider than anything in them.
        reach = upper[:0] if step.lower is not None else upper[np.isfinite(upper)]
        z_max, bound_max, b_max = system.max(max_abs(start), max_abs(reach), max_abs(self.b))
        if z_max == 0.0:
            z_max = self._estimate_size(self.b, b_max)
        # A load that is nothing, or what rounding has left of it, is no unit: forces are then those
        # of the start, and those that press back what the start is beyond its bounds.
        above = max_abs(np.maximum(start - upper, 0.0))
        below = max_abs(np.maximum(lower - start, 0.0))
        depth = float(system.max(max(above, below))[0])
        if b_max <= ROUND_OFF * self._norm * max(z_max, depth):
            of_start = float(system.max(max_abs(system.apply(start)))[0])
            b_max = max(b_max, of_start, self._norm * depth)
        self.x_ref = _round_up_to_power_of_two(max(z_max, bound_max))
        self.r_ref = _round_up_to_power_of_two(b_max)

        self.lower = lower / self.x_ref
        self.upper = upper / self.x_ref
        self.start = start / self.x_ref
        self._b_max = b_max / self.r_ref
        self.worst = np.inf

    def _estimate_size(self, b: Array, b_max: float) -> float:
        """Return the size of the minimiser of ½ zᵀA z - bᵀz along b, of largest entry b_max.

        It stands for the size of z when nothing else is known.
        """
        if b_max == 0.0:
            return 0.0
        unit = b / b_max
        local = np.array([unit @ unit, unit @ self.system.apply(unit)])
        bb, bAb = self.system.surface.comm.sum(local)
        return b_max * bb / bAb if bAb > 0.0 else 0.0

    def residual(self, y: Array) -> Array:
        """Return F(y)."""
        return np.asarray((self.system.apply(y * self.x_ref) - self.b) / self.r_ref)

    def write_residual(self, _solver: Any, y: Any, F: Any) -> None:
        """Evaluate F(y), as PETSc calls the function of a SNES.

        Args:
            _solver: the SNES.
            y: the PETSc vector of unknowns.
            F: the PETSc vector that gets the residual.
        """
        F.array[:] = self.residual(y.array_r)

    def write_gradient(self, _solver: Any, y: Any, G: Any) -> float:
        """Return f(y) - f(origin) and write the gradient F(y) into G, as TAO calls for both.

        f(y) = ½ y·Hy - y·b/r_ref, H = A x_ref / r_ref, so that with dy = y - origin

            f(y) - f(origin) = ½ dy·(F(y) + F(origin))

        A line search compares values, which agree in all their digits where the gradient still has
        eight to lose: values are therefore taken from an origin near the answer.

        Args:
            _solver: the TAO.
            y: the PETSc vector of unknowns.
            G: the PETSc vector that gets the gradient.
        """
        values = y.array_r
        F = self.residual(values)
        G.array[:] = F
        energy = 0.5 * ((values - self._origin) @ (F + self._F_at_origin))
        return total(self.system.surface.comm, energy)

    def measure_from(self, y: Array) -> None:
        """Take y as the origin of the objective."""
        self._origin = y
        self._F_at_origin = self.residual(y)

    def curves_down(self, y: Array, F: Array) -> bool:
        """Say whether dy·H dy is below zero by more than rounding. Collective.

        dy is the way from the origin of the objective to y, where the residual is F. If so, H is
        not positive definite.
        """
        dy = y - self._origin
        dF = F - self._F_at_origin
        sizes_of_F = np.abs(F) + np.abs(self._F_at_origin)
        local = np.array([dy @ dF, np.abs(dy) @ sizes_of_F])
        curvature, sizes = self.system.surface.comm.sum(local)
        return bool(curvature < -INDEFINITE * sizes)

    def active(self, y: Array, F: Array) -> Mask:
        """Return (m,) the active set of the natural map: where the reaction exceeds the gap."""
        bounded = self.system.bounded
        values = y[bounded]
        force = F[bounded]
        lower = self.lower[bounded]
        upper = self.upper[bounded]
        at_upper = upper - values < -force
        at_lower = values - lower < force
        return np.asarray(at_upper | at_lower | (lower == upper))

    def errors(self, y: Array, F: Array) -> tuple[float, float, float]:
        """Return relative errors of y, at which the residual is F. Collective.

        Returns:
            The largest |F| off the active set and |gap| on it, as in the certificate, and the
            backward error of F. All are NaN where F is.
        """
        system = self.system
        bounded = system.bounded
        active = self.active(y, F)

        # Distances from the bounds that are active.
        above_lower = y[bounded] - self.lower[bounded]
        below_upper = self.upper[bounded] - y[bounded]
        gap = np.where(above_lower < F[bounded], above_lower, below_upper)[active]

        # Forces that no bound carries; the body feels what is left over on its springs.
        force = F.copy()
        force[bounded[active]] = 0.0
        force[system.feet] += force[system.rows :]
        Ax = F + self.b / self.r_ref
        Ax[system.feet] += F[system.rows :]

        force_max, gap_max, y_max, Ax_max, is_nan = system.max(
            max_abs(force),
            max_abs(gap),
            max_abs(y),
            max_abs(Ax[: system.rows]),
            float(np.isnan(F).any()),
        )
        if is_nan:
            return np.nan, np.nan, np.nan
        size = self._norm * y_max * self.x_ref / self.r_ref + self._b_max
        return (
            divide(force_max, max(self._b_max, Ax_max)),
            divide(gap_max, y_max),
            divide(force_max, size),
        )

    def verdict(self, y: Array, F: Array) -> int:
        """Return SNES's reason to stop at y, where the residual is F. Collective.

        It is 0 to go on, 2 where the step is solved to round-off, and 4 below the tolerance where
        the error no longer falls. PETSc's own tests are relative to the first residual, which a
        good prediction makes so small that they cannot be met.
        """
        force, gap, backward = self.errors(y, F)
        if np.isnan(force):
            return NOT_A_NUMBER
        before = self.worst
        worst = max(force, gap)
        self.worst = worst
        if backward <= ROUND_OFF and worst <= self.tolerance and gap <= ROUND_OFF:
            return int(PETSc.SNES.ConvergedReason.CONVERGED_FNORM_ABS)
        if 0.5 * before < worst <= self.tolerance and np.isfinite(before):
            return int(PETSc.SNES.ConvergedReason.CONVERGED_SNORM_RELATIVE)
        return 0

    def answer(self, driver: Any, name: str) -> tuple[Array, Mask, Array, int]:
        """Run a PETSc solver of this step. Collective.

        Args:
            driver: of the solver.
            name: of the route, for messages.

        Returns:
            y (n,), the active set (m,), r_n (m,) and the number of iterations. Off the active set
            r_n is zero, so that what is left of F shows in the certificate.

        Raises:
            StepFailure: it stopped above the tolerance; the error tells PETSc's reason.
        """
        y, F, reason, iterations = driver.run()
        if reason <= 0 and not self.accepts(y, F):
            raise make_reason_failure(name, driver.reasons, reason, iterations, self.worst)
        active = self.active(y, F)
        r_n = np.where(active, self.system.reactions(F * self.r_ref), 0.0)
        return y, active, r_n, iterations

    def accepts(self, y: Array, F: Array) -> bool:
        """Say whether the error at y is below the tolerance. Collective.

        So a solver is done whose line search fails at the floor of round-off.
        """
        force, gap, _ = self.errors(y, F)
        self.worst = max(force, gap)
        return self.worst <= self.tolerance


def _round_up_to_power_of_two(value: float) -> float:
    """Return the power of two next above the value; one for zero, infinity and NaN.

    PETSc reports these itself.
    """
    if not 0.0 < value < np.inf:
        return 1.0
    return float(np.exp2(np.ceil(np.log2(value))))


def divide(value: float, reference: float) -> float:
    """Return value/reference, or the value itself where the reference is not above zero."""
    return value / reference if reference > 0.0 else value
