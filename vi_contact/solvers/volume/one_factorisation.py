"""Use one factorisation for every reduced system of the variational inequality of the volume route.

With the contact unknowns C, W = A⁻¹ E_C and the Delassus operator G = W_C, the system on the inactive set I that
VINEWTONRSLS asks for when the points a ⊂ C are held is solved exactly by

    y = A⁻¹ r,    y <- y - W_a G_aa⁻¹ y_a,    return y_I.

SNES still does the work: it finds the active sets, checks residuals, projects. Its Jacobian is a shell whose
submatrices are light shells too, so nothing is copied or factorised while the active set changes.
"""

from __future__ import annotations

import weakref
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from petsc4py import PETSc

from ...core.algebra import Array
from ...core.checks import whole
from ...core.sizes import refuse_dense
from ...core.step import StepProblem
from .bounded_system import BoundedSystem
from .held_points import HeldInverse
from .options import OptionLayers, Options, check_own_inverse
from .scaled_step import ScaledStep
from .snes import NEWTON_OPTIONS, SnesDriver


class ShellMatrix:
    """Apply H = A x_ref / r_ref on the unknowns ``local``, for PETSc's Python matrices; all unknowns when None."""

    def __init__(self, scaled: ScaledStep, local: Array | None = None) -> None:
        self._scaled = scaled
        size = scaled.system.size
        self.local = np.arange(size) if local is None else local
        free = np.zeros(size, dtype=bool)
        free[self.local] = True
        self.held = scaled.system.surface.everywhere(~free[scaled.system.bounded])

    def mult(self, mat: Any, x: Any, y: Any) -> None:
        """Compute y = H x."""
        y.array[:] = self._scaled.system.apply(self.spread(x))[self.local] * (self._scaled.x_ref / self._scaled.r_ref)

    def spread(self, x: Any) -> Array:
        """Return a vector on ``local`` with zeros elsewhere."""
        z = np.zeros(self._scaled.system.size)
        z[self.local] = x.array_r
        return z

    def createSubMatrix(self, mat: Any, rows: Any, columns: Any, out: Any = None) -> Any:
        """Return the shell on the given rows; PETSc calls it for the inactive set."""
        first, _ = mat.getOwnershipRange()
        return shell(ShellMatrix(self._scaled, rows.indices - first), mat.comm)


def shell(context: ShellMatrix, comm: Any) -> Any:
    """Return a PETSc matrix around the context."""
    size = (len(context.local), None)
    mat = PETSc.Mat().createPython((size, size), context, comm=comm)
    mat.setUp()
    return mat


class ShellJacobian:
    """Hand the Jacobian to SNES; it keeps the iterate of its last evaluation for ``ReducedInverse``."""

    def __init__(self, scaled: ScaledStep) -> None:
        self.mat = shell(ShellMatrix(weakref.proxy(scaled)), scaled.system.comm)  # PETSc holds it: see weakly()
        self.y = np.zeros(0)

    def rescale(self, ratio: float) -> None:
        """Do nothing: the context reads the scaled step."""

    def evaluate(self, snes: Any, y: Any, J: Any, P: Any) -> None:
        """Do nothing: the matrix is constant."""
        self.y = np.array(y.array_r)

    def destroy(self) -> None:
        """Free the matrix."""
        self.mat.destroy()


class ReducedInverse:
    """Precondition in Python: the exact inverse of the reduced matrix it is set up with.

    A back-substitution for every change of the active set would dominate the step. When the right-hand side is the
    residual F(y) of the current iterate, A⁻¹ F is known to be y - A⁻¹ b. Another right-hand side, or the same set once
    more (then it is a refinement), is back-substituted.
    """

    def __init__(self, scaled: ScaledStep, jacobian: ShellJacobian, settings: OneFactorisation) -> None:
        self._scaled, self._jacobian = scaled, jacobian
        self._inverse = HeldInverse(scaled.system, settings.limit)
        self._exchanges = settings.exchanges
        self._zero = np.zeros(scaled.system.surface.total)
        self._free, self._held = np.zeros(0), self._zero > 0.0

    def start(self, step: StepProblem) -> Array:
        """Return z with the predicted contacts held."""
        system = self._scaled.system
        self._free = self._inverse.unheld(system.load(step.b))
        everywhere = system.surface.everywhere
        self._held, bound = everywhere(system.predicted(step)), everywhere(step.bound)
        if self._exchanges:
            self._held = self._inverse.better_set(self._free, self._held, bound, self._exchanges)
        return self._inverse.hold(self._free, self._held, bound)

    def apply(self, pc: Any, r: Any, y: Any) -> None:
        """Compute y = H_II⁻¹ r."""
        matrix: ShellMatrix = pc.getOperators()[1].getPythonContext()
        scaled = self._scaled
        if self._is_residual(r.array_r, matrix):
            z = self._jacobian.y - self._free / scaled.x_ref
        else:
            z = self._inverse.unheld(matrix.spread(r)) * (scaled.r_ref / scaled.x_ref)
        self._held = matrix.held
        y.array[:] = self._inverse.hold(z, matrix.held, self._zero)[matrix.local]

    def _is_residual(self, r: Array, matrix: ShellMatrix) -> bool:
        """True, on all ranks, when r is F(y) on the unknowns of the matrix and the held set has changed."""
        if np.array_equal(matrix.held, self._held):
            return False
        other = not np.array_equal(r, self._scaled.last[matrix.local])
        return not self._scaled.system.max(float(other))[0]


class FactorisedDriver(SnesDriver):
    """Run SNES with the one factorisation."""

    def __init__(self, scaled: ScaledStep, layers: OptionLayers, settings: OneFactorisation) -> None:
        jacobian = ShellJacobian(scaled)
        self.inverse = ReducedInverse(scaled, jacobian, settings)
        super().__init__(
            scaled, layers, jacobian, snes_type="vinewtonrsls", check=check_own_inverse, inverse=self.inverse
        )


@dataclass(frozen=True)
class OneFactorisation:
    """Solve by SNES VINEWTONRSLS on the one factorisation of A. Iterations are those of SNES.

    It starts from the solution on a predicted contact set, so that a right prediction costs one back-substitution and
    no iteration.

    Attributes:
        exchanges: a predicted set whose signs are wrong is improved on the contact points alone, by at most so many
            exchanges, before SNES starts; with 0 SNES does all the work, two to five times as long.
        limit: W is kept when its rows x m numbers on a rank are not more (8 bytes each, taken as points come into
            contact); beyond it every change of the contact set costs a back-substitution.
    """

    carries_friction: ClassVar[bool] = False
    exchanges: int = 5
    limit: int = 5_000_000

    def __post_init__(self) -> None:
        for name in ("exchanges", "limit"):
            whole("OneFactorisation", name, getattr(self, name))

    def defaults(self, ranks: int) -> Options:
        """Return the options that come before the user's."""
        return NEWTON_OPTIONS

    def driver(self, scaled: ScaledStep, layers: OptionLayers) -> FactorisedDriver:
        """Return the SNES object. InputError for more contact conditions than a dense matrix suits."""
        refuse_dense("OneFactorisation()", scaled.system.surface.total)
        return FactorisedDriver(scaled, layers, self)

    def start(self, driver: FactorisedDriver, system: BoundedSystem, step: StepProblem) -> Array:
        """Return the solution with the predicted contacts held."""
        return driver.inverse.start(step)
