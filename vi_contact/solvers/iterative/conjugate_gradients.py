"""Solve on the free unknowns of one contact set by PETSc's conjugate gradients.

A watch may stop them.

PETSc sees the whole operator and a preconditioner that masks: directions have no part in held rows,
so that iterates and inner products are those of the reduced system, and the residual that PETSc
carries along is, in held rows, the reaction there. To look at the signs costs no product, and to go
on from a known residual costs none either: PETSc solves for the correction.
"""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

from ...core.algebra import Array
from ...core.errors import StepFailure
from ..petsc import PETSc
from ..volume.snes import Lent, weakly
from .operator import Operator
from .preconditioners import Masked

Watch = Callable[[int, Array, Callable[[], Array]], int]
SOLVED, WRONG_SIGNS = 3, 2  # of PETSc's reasons: below an absolute, a relative tolerance
# too many iterations; not a number; indefinite matrix
STAGNATED, NOT_A_NUMBER, INDEFINITE = (-3, -9, -10)
_OTHER_PRECONDITIONER = (
    "take another preconditioner, or Condensed() where a factor fits into memory"
)
_CHECK_MATRIX = (
    "check that every body is held or has mass, that A is positive definite, and that "
    "no material is a million times stiffer than its neighbour"
)
# PETSc's reasons for stopping: number -> (what happened, what helps).
REASONS: Mapping[int, tuple[str, str]] = {
    2: ("the contact set did not settle", _OTHER_PRECONDITIONER),
    -3: ("the residual stagnated", f"{_CHECK_MATRIX}; else {_OTHER_PRECONDITIONER}"),
    -8: ("the preconditioner is not positive definite", _OTHER_PRECONDITIONER),
    -9: (
        "the residual is not a number",
        "check the load, the guess and the bound of this step for NaN",
    ),
    -10: ("A is not positive definite", _CHECK_MATRIX),
    -11: ("the preconditioner could not be applied", _OTHER_PRECONDITIONER),
}
# Of what stopped for none of them.
CG_BROKE_DOWN = ("conjugate gradients broke down", f"{_CHECK_MATRIX}; else {_OTHER_PRECONDITIONER}")
GMRES_BROKE_DOWN = ("GMRES broke down", _OTHER_PRECONDITIONER)
SHOWN = 6  # residuals


class ConjugateGradients:
    """Run PETSc's KSP ``cg``; ``ksp`` is the PETSc object."""

    def __init__(self, operator: Operator, masked: Masked) -> None:
        shell = operator.shell()
        self._b, self._x = shell.createVecs()
        self._residual = self._b.duplicate()
        self._operator, self._masked = operator, masked  # for as long as PETSc applies them
        self._watch: Watch = lambda its, residual, x: SOLVED
        self.ksp = PETSc.KSP().create(shell.comm)
        self.ksp.setOperators(shell)
        self.ksp.setType("cg")
        self.ksp.setNormType(PETSc.KSP.NormType.NONE)  # the watch forms its own
        self.ksp.setTolerances(max_it=np.iinfo(np.int32).max)
        self.ksp.setConvergenceTest(weakly(self._test))
        self.ksp.pc.setType("python")
        self.ksp.pc.setPythonContext(Lent(masked))

    def solve(self, residual: Array, x: Array, watch: Watch) -> tuple[Array, Array, int]:
        """Return (x, residual, PETSc's reason) of where the watch stopped.

        ``watch(iterations, residual, x)`` returned a reason there; its x is a function.
        ``residual`` is that of x, with which it begins.
        """
        self._watch, self._start = watch, x
        self._b.array[:] = residual
        self.ksp.solve(self._b, self._x)
        self._operator.work.linear_iterations += self.ksp.getIterationNumber()
        return (
            x + self._x.array_r,
            np.array(self._residual.array_r),
            int(self.ksp.getConvergedReason()),
        )

    def _test(self, ksp: Any, iteration: int, _norm: float) -> int:
        ksp.buildResidual(self._residual)
        return self._watch(
            iteration, self._residual.array_r, lambda: self._start + ksp.getSolution().array_r
        )


def stopped(name: str, reason: int, iterations: int, history: Sequence[float]) -> StepFailure:
    """Return the failure of a solver that stopped for PETSc's ``reason``.

    ``history`` are residuals over the forces.
    """
    words, remedy = REASONS.get(reason, CG_BROKE_DOWN)
    return StepFailure(
        f"{name} stopped after {iterations} linear iterations, {words} (residuals "
        f"{told(history)}): {remedy}"
    )


def told(history: Sequence[float]) -> str:
    """Return the first residual, some, and the last."""
    last = len(history) - 1
    chosen = (
        sorted({round(i * last / (SHOWN - 1)) for i in range(SHOWN)})
        if last > 0
        else range(len(history))
    )
    return ", ".join(f"{history[i]:.1e}" for i in chosen) or "none"
