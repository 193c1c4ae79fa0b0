"""Solve by PETSc TAO on the same bounds, as a second opinion.

It minimises ½ xᵀA x - bᵀx subject to x_n <= bound.

TAO's tolerances and trust regions are absolute, harmless in a scaled step; ``ScaledStep.verdict``
judges convergence.
"""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...core.algebra import Array
from ..petsc import PETSc
from .options import REDUCED_PC, TRON, OptionLayers, Options, refuse
from .scaled_step import ScaledStep
from .snes import AssembledJacobian, weakly, write_bounds

BETTER = 0.9  # of the error: what a run from a new origin must leave at most


def check_tao(tao: Any, layers: OptionLayers) -> None:
    """Raise InputError for types and preconditioners, given as options, that give wrong answers.

    Many types ignore bounds, and bqpip reports garbage as converged: docs/reference/petsc.md.
    """
    if tao.getType() != "tron":
        refuse(
            f"TAO type {tao.getType()}",
            "other types ignore bounds, or stop short or wrong",
            "leave it out",
        )
    pc = layers.chosen("pc_type")
    if pc in REDUCED_PC:
        refuse(f"pc_type {pc} with TAO tron", REDUCED_PC[pc], "use icc, bjacobi or hypre")


class TaoDriver:
    """Run a TAO object bound to a scaled step.

    Attributes:
        solver: the PETSc object.
    """

    reasons = PETSc.TAO.Reason

    def __init__(self, scaled: ScaledStep, layers: OptionLayers) -> None:
        """Make the solver; InputError where PETSc or we do not take the options."""
        self._scaled = scaled
        self._layers = layers
        self._hessian = AssembledJacobian(scaled.system)
        self._y = self._hessian.mat.createVecRight()
        self._lower = self._y.duplicate()
        self._upper = self._y.duplicate()
        self.solver = PETSc.TAO().create(scaled.system.comm)
        self.solver.setOptionsPrefix(layers.prefix)
        self.solver.setType("tron")
        # No vector for the gradient is given: TRON makes one of its own, and forgets the given one.
        self.solver.setObjectiveGradient(weakly(scaled.write_gradient), None)
        self.solver.setHessian(weakly(self._hessian.evaluate), self._hessian.mat)
        self.solver.setVariableBounds((self._lower, self._upper))
        self.solver.setSolution(self._y)
        self.solver.setConvergenceTest(weakly(self._test))
        layers.apply(self.solver, check_tao)

    def run(self) -> tuple[Array, Array, int, int]:
        """Return (y, F(y), PETSc's reason, iterations) of the scaled step."""
        scaled = self._scaled
        tao = self.solver
        self._hessian.rescale(scaled.x_ref / scaled.r_ref)
        y = np.clip(scaled.start, scaled.lower, scaled.upper)
        write_bounds(scaled, self._lower, self._upper)
        iterations = 0
        before = np.inf
        while True:
            # Values of the objective are differences to the one at y.
            scaled.measure_from(y)
            self._y.array[:] = y
            with self._layers.in_force():
                tao.solve(self._y)
            y = np.array(self._y.array_r)
            F = scaled.residual(y)
            reason = tao.getConvergedReason()
            iterations += tao.getIterationNumber()

            # Where a line search fails, the values it compared may have been round-off: measured
            # from here they have all digits again. NaN ends it too.
            failed = reason == PETSc.TAO.Reason.DIVERGED_LS_FAILURE and not scaled.accepts(y, F)
            if not (failed and scaled.worst <= BETTER * before):
                return y, F, reason, iterations
            before = scaled.worst

    def destroy(self) -> None:
        """Free the PETSc objects; collective."""
        for item in (self.solver, self._hessian, self._y, self._lower, self._upper):
            item.destroy()

    def renew(self) -> None:
        """Take the entries of A again, which have changed."""
        self._hessian.renew()

    def _test(self, tao: Any) -> int | None:
        """Return PETSc's reason to stop by our verdict; None to go on.

        A reason of its own, which only tolerances of the user bring, stays.
        """
        if tao.getConvergedReason():
            return None
        y = tao.getSolution().array_r
        F = self._scaled.residual(y)  # TRON overwrites its gradient by the projected one
        if self._scaled.curves_down(y, F):
            return int(PETSc.TAO.Reason.DIVERGED_USER)  # without bounds it would go on for ever
        reason = self._scaled.verdict(y, F)
        if reason < 0:
            return int(PETSc.TAO.Reason.DIVERGED_NAN)
        return int(PETSc.TAO.Reason.CONVERGED_USER) if reason else None


@dataclass(frozen=True)
class TaoTron:
    """Solve by TAO TRON, Newton's method with a trust region.

    It has projected searches, conjugate gradients and incomplete Cholesky. With springs more than
    about 1e3 times stiffer than the body, which shrink its trust region, it is slow or ends in a
    StepFailure.
    """

    carries_friction: ClassVar[bool] = False

    def defaults(self, ranks: int) -> Options:
        """Return the options that come before the user's, on so many ranks.

        PETSc has no incomplete Cholesky for several ranks.
        """
        return {**TRON, "pc_type": "icc" if ranks == 1 else "bjacobi"}

    def driver(self, scaled: ScaledStep, layers: OptionLayers) -> TaoDriver:
        """Return the TAO object."""
        return TaoDriver(scaled, layers)
