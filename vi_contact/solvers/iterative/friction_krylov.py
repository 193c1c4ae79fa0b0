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
from ..volume.snes import Lent
from .conjugate_gradients import SOLVED, STAGNATED
from .contact import Contact
from .friction_states import States, Tangents, dot
from .operator import Operator
from .preconditioners import Masked

RESTART = 60
LEFT = 0.5  # g over c
# a residual is a norm of rows, at most so many times the largest: the last ones are less spread
SPREAD = 3.0
FALL = 0.1  # of the residual that is no stagnation


class Turned(Masked):
    """Apply w W M⁻¹ W w: the context of a PETSc shell preconditioner."""

    def __init__(self, inverse: Any, template: Any, tangents: Tangents) -> None:
        super().__init__(inverse, template)
        self._tangents = tangents
        self._states: States | None = None

    def take(self, contact: Contact, states: States) -> None:
        """Take mask and curvature of the states."""
        self.weights = contact.weights()
        self.weights[states.held] = 0.0
        g = LEFT * self._tangents.c
        self._across, self._states = 1.0 - np.sqrt(g / (g + states.kappa)), states

    def apply(self, pc: Any, r: Any, z: Any) -> None:
        """Apply w W M⁻¹ W w to r: PETSc vectors."""
        np.multiply(self.weights, r.array_r, out=self._r.array)
        self._turn(self._r.array)
        self._inverse.apply(self._r, z)
        z.array[:] *= self.weights
        self._turn(z.array)

    def _turn(self, v: Array) -> None:
        """Multiply v by W, in place."""
        assert self._states is not None
        tangents, n = self._tangents, self._states.direction
        table = tangents.of(v)
        across = self._across[:, None] * (table - dot(n, table)[:, None] * n)
        v[tangents.rows] -= tangents.flat(across)


class Gmres:
    """Run PETSc's KSP ``gmres``, or ``cg`` where no point slips, on the linear problem.

    ``gmres`` is preconditioned from the right. The object serves as the context of the matrix of
    the linear problem. ``free`` is 1 in rows that are not held, and 0.
    """

    def __init__(
        self, comm: Comm, operator: Operator, contact: Contact, turned: Turned, patience: int
    ) -> None:
        self._comm, self._operator, self._turned, self._contact = comm, operator, turned, contact
        shell = PETSc.Mat().createPython(
            operator.blocks.getSizes(), Lent(self), comm=operator.blocks.comm
        )
        shell.setUp()
        self._b, self._x = shell.createVecs()
        self._patience = patience
        self.cg, self.gmres = (PETSc.KSP().create(shell.comm) for _ in range(2))
        for ksp, kind in ((self.cg, "cg"), (self.gmres, "gmres")):
            ksp.setOperators(shell)
            ksp.setType(kind)
            ksp.setNormType(PETSc.KSP.NormType.UNPRECONDITIONED)
            ksp.pc.setType("python")
            ksp.pc.setPythonContext(Lent(turned))
        self.gmres.setGMRESRestart(RESTART)
        self.gmres.setPCSide(PETSc.PC.Side.RIGHT)

    def take(self, states: States) -> None:
        """Take the linear problem of these states and of the closed set of the contact."""
        self._turned.take(self._contact, states)
        self._states, self.free = states, (self._turned.weights > 0.0).astype(float)
        self._slips = bool(largest(self._comm, np.any(states.slips)))

    def mult(self, _shell: Any, x: Any, y: Any) -> None:
        """Apply the matrix of the linear problem to x: PETSc vectors."""
        self._operator.mult(None, x, y)
        values = y.array
        self._states.apply(self._contact, x.array_r, values)
        values *= self.free

    def solve(self, residual: Array, share: float, goal: float) -> tuple[Array, float, int]:
        """Return (dx, norm of what is left, PETSc's reason).

        ``share`` is left, or about ``goal`` in a row.
        """
        self._b.array[:] = residual
        self._x.set(0.0)
        spread = min(self._b.norm() / (self._b.norm(PETSc.NormType.INFINITY) or 1.0), SPREAD)
        ksp = self.gmres if self._slips else self.cg
        ksp.setTolerances(rtol=share, atol=goal * spread, divtol=1e10, max_it=self._patience)
        ksp.solve(self._b, self._x)
        self._operator.work.linear_iterations += ksp.getIterationNumber()
        left, reason = float(ksp.getResidualNorm()), int(ksp.getConvergedReason())
        if reason == STAGNATED and left <= FALL * self._b.norm():
            reason = SOLVED  # as far as it came: Newton goes on from there
        return np.array(self._x.array_r), left, reason
