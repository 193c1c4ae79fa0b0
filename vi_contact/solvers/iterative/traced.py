"""Solve with A by conjugate gradients for conditions that share unknowns, which nothing holds.

A condition that is a trace has no unknown of its own that a mask could hold. The step is then that
of ``Condensed``, with solves by conjugate gradients in the place of a factor of A: one for each
unknown that contact reads, once for a dt, and two a step. G is a dense matrix on every rank.
"""

from dataclasses import replace
from typing import Any

import numpy as np

from ...core.algebra import Array, EffectiveMatrix, Indices
from ...core.errors import StepFailure
from ...core.step import StepProblem, StepResult
from ...core.surfaces import ContactSurface
from ..condensed import Condensed
from ..petsc import PETSc
from .layout import Nodewise
from .preconditioners import Inverse

EXACT = 1e-10  # of the right side, that one solution by conjugate gradients may leave
REFINEMENTS = 3  # more of what is left over: each adds as many digits, down to rounding
ROUNDING = 1e-15  # of the right side: nothing more to gain


class GradientFactor:
    """Solve with A as a factor does, by conjugate gradients. Solutions are refined to rounding."""

    def __init__(
        self, A: EffectiveMatrix, nodewise: Nodewise, inverse: Inverse, patience: int
    ) -> None:
        """Make the linear solver of PETSc. Collective.

        Args:
            A: the effective matrix.
            nodewise: makes matrices of A.
            inverse: the preconditioner.
            patience: iterations of one solution, at most.
        """
        self._A = A
        self._layout = nodewise.layout
        matrix = nodewise.entries()
        ksp = PETSc.KSP().create(matrix.comm)
        ksp.setType("cg")
        ksp.setPC(inverse.pc)
        ksp.setOperators(matrix, matrix)
        ksp.setTolerances(rtol=EXACT, atol=0.0, max_it=patience)
        self._ksp = ksp
        self._right, self._answer = matrix.createVecRight(), matrix.createVecLeft()

    def solve(self, b: Array) -> Array:
        """Return A⁻¹ b. Collective.

        Raises:
            StepFailure: the iterations do not converge.
        """
        algebra = self._A.algebra
        size = np.sqrt(algebra.dot(b, b))
        x = np.zeros_like(b)
        left = b
        for _ in range(1 + REFINEMENTS):
            if not np.sqrt(algebra.dot(left, left)) > ROUNDING * size:
                break
            self._right.array[:] = self._layout.pad(left)
            self._ksp.solve(self._right, self._answer)
            if self._ksp.getConvergedReason() < 0:
                raise StepFailure(
                    f"Iterative() stopped after {self._ksp.getIterationNumber()} iterations of "
                    "conjugate gradients: give a larger patience, or take Condensed()"
                )
            x = x + self._layout.strip(np.array(self._answer.array_r))
            left = b - self._A @ x
        return x

    def solve_units(
        self, owned: Indices, slots: Indices, m: int, rows: Indices | None = None
    ) -> Array:
        """Return the columns A⁻¹ e_j of m unit vectors. Collective.

        Args:
            owned: (k,) rows of this rank in which unit vectors have their ones.
            slots: (k,) the numbers j of these vectors.
            m: number of the vectors on all ranks.
            rows: which owned rows to return; None for all.
        """
        n = self._A.matrix.rows
        rows = np.arange(n) if rows is None else rows
        columns = np.zeros((len(rows), m))
        for j in range(m):
            unit = np.zeros(n)
            unit[owned[slots == j]] = 1.0
            columns[:, j] = self.solve(unit)[rows]
        return columns


class FactorlessMatrix(EffectiveMatrix):
    """Hold A, whose factor is an iteration."""

    def __init__(self, A: EffectiveMatrix, factor: GradientFactor) -> None:
        super().__init__(A.matrix, A.algebra, space=A.space, inertia=A.inertia)
        self.__dict__["factor"] = factor

    def contact_last(self, last: Indices) -> None:
        """Return None: nothing is factorised."""
        return None


class CondensedDense(Condensed):
    """Condense onto an array at any size: bodies would be factorised."""

    def takes_bodies(self, surface: ContactSurface) -> bool:
        """Say False."""
        return False


class TracedSteps:
    """Solve steps whose conditions are traces."""

    def __init__(
        self,
        A: EffectiveMatrix,
        surface: ContactSurface,
        scale: float,
        factor: GradientFactor,
        name: str,
    ) -> None:
        """Condense A by iterations, at the first step.

        Args:
            A: the effective matrix.
            surface: the contact surface.
            scale: of reactions, over which compliances are divided.
            factor: solves with A.
            name: of the solver, for results.
        """
        self._name = name
        self._condensed: Any = CondensedDense().prepare(FactorlessMatrix(A, factor), surface, scale)

    def solve(self, step: StepProblem) -> StepResult:
        """Return the answer to a step. Collective."""
        return replace(self._condensed.solve(step), method=self._name)
