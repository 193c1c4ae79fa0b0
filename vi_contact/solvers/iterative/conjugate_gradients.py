"""Solve on the free unknowns of one contact set by PETSc's conjugate gradients.

A function watches them, and may stop them.

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
from ..volume.snes import LentContext, weakly
from .operator import Operator
from .preconditioners import Masked

# (iterations, residual, what makes the present x) -> PETSc's reason to stop, or 0
Watch = Callable[[int, Array, Callable[[], Array]], int]

# PETSc's reasons for stopping, as they are used here.
SOLVED = 3  # below an absolute tolerance
WRONG_SIGNS = 2  # below a relative one
STAGNATED = -3  # too many iterations
NOT_A_NUMBER = -9
INDEFINITE = -10  # the matrix is

_OTHER_PRECONDITIONER = (
    "take another preconditioner, or Condensed() where a factor fits into memory"
)
_CHECK_MATRIX = (
    "check that every body is held or has mass, that A is positive definite, and that "
    "no material is a million times stiffer than its neighbour"
)
# Reason -> (what happened, what helps).
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
    """Run PETSc's KSP ``cg``.

    Attributes:
        ksp: the PETSc object.
    """

    def __init__(self, operator: Operator, masked: Masked) -> None:
        """Make the solver of A with the closed springs, preconditioned on free unknowns."""
        shell = operator.shell()
        self._b, self._x = shell.createVecs()
        self._residual = self._b.duplicate()
        # Held for as long as PETSc applies them.
        self._operator = operator
        self._masked = masked
        self._watch: Watch = lambda its, residual, x: SOLVED
        self.ksp = PETSc.KSP().create(shell.comm)
        self.ksp.setOperators(shell)
        self.ksp.setType("cg")
        self.ksp.setNormType(PETSc.KSP.NormType.NONE)  # the watch forms its own
        self.ksp.setTolerances(max_it=np.iinfo(np.int32).max)
        self.ksp.setConvergenceTest(weakly(self._test))
        self.ksp.pc.setType("python")
        self.ksp.pc.setPythonContext(LentContext(masked))

    def solve(self, residual: Array, x: Array, watch: Watch) -> tuple[Array, Array, int]:
        """Solve from x until the watch says stop. Collective.

        Args:
            residual: padded, at x.
            x: padded.
            watch: is asked after every iteration.

        Returns:
            x and its residual where it stopped, and the reason that the watch gave.
        """
        self._watch = watch
        self._start = x
        self._b.array[:] = residual
        self.ksp.solve(self._b, self._x)
        self._operator.work.linear_iterations += self.ksp.getIterationNumber()
        return (
            x + self._x.array_r,
            np.array(self._residual.array_r),
            int(self.ksp.getConvergedReason()),
        )

    def _test(self, ksp: Any, iteration: int, _norm: float) -> int:
        """Ask the watch, as a convergence test of PETSc."""
        ksp.buildResidual(self._residual)
        return self._watch(
            iteration, self._residual.array_r, lambda: self._start + ksp.getSolution().array_r
        )


def make_cg_failure(
    name: str, reason: int, iterations: int, history: Sequence[float]
) -> StepFailure:
    """Return the error of a solver that stopped without an answer.

    Args:
        name: of the solver.
        reason: PETSc's.
        iterations: linear ones of the step.
        history: residuals over the forces.
    """
    words, remedy = REASONS.get(reason, CG_BROKE_DOWN)
    return StepFailure(
        f"{name} stopped after {iterations} linear iterations, {words} (residuals "
        f"{format_residuals(history)}): {remedy}"
    )


def format_residuals(history: Sequence[float]) -> str:
    """Return the first residual, some, and the last, as a text."""
    last = len(history) - 1
    shown: Sequence[int] = range(len(history))
    if last > 0:
        shown = sorted({round(i * last / (SHOWN - 1)) for i in range(SHOWN)})
    return ", ".join(f"{history[i]:.1e}" for i in shown) or "none"
