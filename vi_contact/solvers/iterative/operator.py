"""Apply A, and the springs of closed points, to what PETSc hands over, and count the work."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.algebra import Array, Indices
from ..petsc import PETSc
from ..volume.snes import LentContext


@dataclass
class Work:
    """Hold sums since the solver was prepared.

    Attributes:
        linear_iterations: of conjugate gradients, those of the fallback too, or of GMRES.
        newton_steps: of steps with friction.
        products: with A.
        renewals: of the preconditioner after the first.
        fallbacks: steps that ended by projected gradients, or with limits of friction given for
            some rounds.
    """

    linear_iterations: int = 0
    newton_steps: int = 0
    products: int = 0
    renewals: int = 0
    fallbacks: int = 0


class Operator:
    """Multiply by A + the stiffness of closed springs: the context of a PETSc shell matrix.

    Held rows are multiplied too. Conjugate gradients whose preconditioner leaves these rows alone
    never move them, and the residual that they carry along is the reaction there.

    Attributes:
        blocks: A, a PETSc matrix.
        work: where products are counted.
    """

    def __init__(self, blocks: Any, work: Work) -> None:
        self.blocks = blocks
        self.work = work
        self._x, self._y = blocks.createVecs()
        self.set_springs(np.zeros(0, dtype=np.int64), np.zeros(0))

    def set_springs(self, rows: Indices, stiffness: Array) -> None:
        """Take the springs that are closed: their rows and stiffnesses, in the unit of A."""
        self._rows = rows
        self._stiffness = stiffness

    def mult(self, _shell: Any, x: Any, y: Any) -> None:
        """Apply A + K_s, as the product of a PETSc shell matrix.

        Args:
            _shell: PETSc's matrix, whose context this object is.
            x: the PETSc vector that is multiplied.
            y: the PETSc vector that gets the product.
        """
        self.work.products += 1
        self.blocks.mult(x, y)
        if len(self._rows):
            y.array[self._rows] += self._stiffness * x.array_r[self._rows]

    def __matmul__(self, x: Array) -> Array:
        """Return (A + K_s) x, padded."""
        self._x.array[:] = x
        self.mult(None, self._x, self._y)
        return np.array(self._y.array_r)

    def shell(self) -> Any:
        """Return a PETSc matrix that applies this operator. The operator must outlive it.

        PETSc does not hold the operator: its clean-up loses whatever only its contexts kept alive.
        """
        mat = PETSc.Mat().createPython(
            self.blocks.getSizes(), LentContext(self), comm=self.blocks.comm
        )
        mat.setUp()
        return mat
