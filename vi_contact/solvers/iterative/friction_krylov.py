"""Solve the linear problem of given friction states by PETSc's GMRES.

It is not symmetric where points slip. Where none does, conjugate gradients serve, which do not
stagnate on weak springs.

The preconditioner is that of the frictionless step, made once: w W M⁻¹ W w, with zeros in w for
closed normals and sticking tangents, and in the tangent plane of a point that slips

    W = n nᵀ + sqrt(g / (g + kappa)) (1 - n nᵀ),    g = c / 2,

which gives M⁻¹ the diagonal of (A + kappa)⁻¹ across the slip, where 1/g is that of A⁻¹, and tends
to the mask of a point that cannot turn. About half of the diagonal of A is what its neighbours
leave a node of stiffness.
"""

from typing import Any

import numpy as np

from ...core.algebra import Array, Comm, largest
from ..petsc import PETSc
from ..volume.snes import LentContext
from .conjugate_gradients import SOLVED, STAGNATED
from .contact import ClosedSet
from .friction_states import States, Tangents, dot
from .operator import Operator
from .preconditioners import Masked

RESTART = 60
LEFT = 0.5  # g over c
# a residual is a norm of rows, at most so many times the largest: the last ones are less spread
SPREAD = 3.0
FALL = 0.1  # of the residual that is no stagnation


class TurnedInverse(Masked):
    """Apply w W M⁻¹ W w: the context of a PETSc shell preconditioner."""

    def __init__(self, inverse: Any, template: Any, tangents: Tangents) -> None:
        """Take the parts that all states share.

        Args:
            inverse: M⁻¹, a PETSc preconditioner.
            template: a PETSc vector of the size of M.
            tangents: where the tangents are.
        """
        super().__init__(inverse, template)
        self._tangents = tangents
        self._states: States | None = None

    def apply_states(self, contact: ClosedSet, states: States) -> None:
        """Take the mask of the closed set and of the states, and the curvature of the disks."""
        self.weights = contact.weights()
        self.weights[states.held] = 0.0
        g = LEFT * self._tangents.c
        self._less_across = 1.0 - np.sqrt(g / (g + states.kappa))
        self._states = states

    def apply(self, _pc: Any, r: Any, z: Any) -> None:
        """Apply w W M⁻¹ W w, as PETSc calls a shell preconditioner.

        Args:
            _pc: PETSc's preconditioner, whose context this object is.
            r: the PETSc vector to which it is applied.
            z: the PETSc vector that gets the result.
        """
        np.multiply(self.weights, r.array_r, out=self._r.array)
        self._turn(self._r.array)
        self._inverse.apply(self._r, z)
        z.array[:] *= self.weights
        self._turn(z.array)

    def _turn(self, v: Array) -> None:
        """Multiply v by W, in place: take away a part of what is across the slip."""
        assert self._states is not None
        tangents = self._tangents
        n = self._states.direction
        table = tangents.values(v)
        across = self._less_across[:, None] * (table - dot(n, table)[:, None] * n)
        v[tangents.rows] -= tangents.flatten(across)


class Gmres:
    """Run PETSc's KSP ``gmres``, or ``cg`` where no point slips, on the linear problem.

    ``gmres`` is preconditioned from the right. The object serves as the context of the matrix of
    the linear problem.

    Attributes:
        cg, gmres: PETSc's solvers.
        free: 1 in rows that are not held, 0 in the others.
    """

    def __init__(
        self,
        comm: Comm,
        operator: Operator,
        contact: ClosedSet,
        turned: TurnedInverse,
        patience: int,
    ) -> None:
        """Make both solvers.

        Args:
            comm: of the contact surface.
            operator: A with the closed springs.
            contact: the closed set.
            turned: the preconditioner.
            patience: iterations of one linear problem, at most.
        """
        self._comm = comm
        self._operator = operator
        self._turned = turned
        self._contact = contact
        self._patience = patience
        sizes = operator.blocks.getSizes()
        shell = PETSc.Mat().createPython(sizes, LentContext(self), comm=operator.blocks.comm)
        shell.setUp()
        self._b, self._x = shell.createVecs()
        self.cg = self._make_solver("cg", shell)
        self.gmres = self._make_solver("gmres", shell)
        self.gmres.setGMRESRestart(RESTART)
        self.gmres.setPCSide(PETSc.PC.Side.RIGHT)

    def _make_solver(self, kind: str, shell: Any) -> Any:
        """Return a KSP of this kind, for the matrix and the preconditioner of the states."""
        ksp = PETSc.KSP().create(shell.comm)
        ksp.setOperators(shell)
        ksp.setType(kind)
        ksp.setNormType(PETSc.KSP.NormType.UNPRECONDITIONED)
        ksp.pc.setType("python")
        ksp.pc.setPythonContext(LentContext(self._turned))
        return ksp

    def apply_states(self, states: States) -> None:
        """Take the linear problem of these states and of the closed set. Collective."""
        self._turned.apply_states(self._contact, states)
        self._states = states
        self.free = (self._turned.weights > 0.0).astype(float)
        self._slips = bool(largest(self._comm, np.any(states.slips)))

    def mult(self, _shell: Any, x: Any, y: Any) -> None:
        """Apply the matrix of the linear problem, as the product of a PETSc shell matrix.

        Args:
            _shell: PETSc's matrix, whose context this object is.
            x: the PETSc vector that is multiplied.
            y: the PETSc vector that gets the product.
        """
        self._operator.mult(None, x, y)
        values = y.array
        self._states.apply(self._contact, x.array_r, values)
        values *= self.free

    def solve(self, residual: Array, share: float, goal: float) -> tuple[Array, float, int]:
        """Solve for a correction, as far as is asked for. Collective.

        Args:
            residual: right-hand side, padded, zero in held rows.
            share: of the residual that may be left,
            goal: or the size in every row, about.

        Returns:
            The correction dx, the norm of what is left, and PETSc's reason for stopping.
        """
        self._b.array[:] = residual
        self._x.set(0.0)
        norm = self._b.norm()
        spread = min(norm / (self._b.norm(PETSc.NormType.INFINITY) or 1.0), SPREAD)
        ksp = self.gmres if self._slips else self.cg
        ksp.setTolerances(rtol=share, atol=goal * spread, divtol=1e10, max_it=self._patience)
        ksp.solve(self._b, self._x)
        self._operator.work.linear_iterations += ksp.getIterationNumber()
        left = float(ksp.getResidualNorm())
        reason = int(ksp.getConvergedReason())
        if reason == STAGNATED and left <= FALL * self._b.norm():
            reason = SOLVED  # as far as it came: Newton goes on from there
        return np.array(self._x.array_r), left, reason
