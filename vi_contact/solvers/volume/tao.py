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


def check_tao(tao: Any, layers: OptionLayers) -> None:
    """Refuse other types and preconditioners that give wrong answers.

    So it does when they come from options (docs/reference/petsc.md: many types ignore bounds, and
    bqpip reports garbage as converged).
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
    """Run a TAO object bound to a scaled step; ``solver`` is the PETSc object."""

    reasons = PETSc.TAO.Reason

    def __init__(self, scaled: ScaledStep, layers: OptionLayers) -> None:
        self._scaled, self._layers = scaled, layers
        self._hessian = AssembledJacobian(scaled.system)
        self._y, G = self._hessian.mat.createVecs()
        self._vectors = [self._y, G, self._y.duplicate(), self._y.duplicate()]
        self.solver = PETSc.TAO().create(scaled.system.comm)
        self.solver.setOptionsPrefix(layers.prefix)
        self.solver.setType("tron")
        self.solver.setObjectiveGradient(weakly(scaled.objective), G)
        self.solver.setHessian(weakly(self._hessian.evaluate), self._hessian.mat)
        self.solver.setVariableBounds((self._vectors[2], self._vectors[3]))
        self.solver.setSolution(self._y)
        self.solver.setConvergenceTest(weakly(self._test))
        layers.apply(self.solver, check_tao)

    def run(self) -> tuple[Array, Array, int, int]:
        """Return (y, F(y), PETSc's reason, iterations) of the scaled step."""
        scaled, tao = self._scaled, self.solver
        self._hessian.rescale(scaled.x_ref / scaled.r_ref)
        y = np.clip(scaled.start, scaled.lower, scaled.upper)
        write_bounds(scaled, self._vectors[2], self._vectors[3])
        iterations, before = 0, np.inf
        while True:
            scaled.measure_from(y)
            self._y.array[:] = y
            with self._layers.in_force():
                tao.solve(self._y)
            y, reason = np.array(self._y.array_r), tao.getConvergedReason()
            F, iterations = scaled.residual(y), iterations + tao.getIterationNumber()
            failed = reason == PETSc.TAO.Reason.DIVERGED_LS_FAILURE and not scaled.accepts(y, F)
            if not (failed and scaled.worst <= 0.9 * before):  # NaN ends it too
                return y, F, reason, iterations
            # the values compared were round-off: measured from here they have all digits again
            before = scaled.worst

    def destroy(self) -> None:
        """Free the PETSc objects; collective."""
        for item in (self.solver, self._hessian, *self._vectors):
            item.destroy()

    def _test(self, tao: Any) -> int | None:
        """Return PETSc's reason to stop; None to go on.

        It is its own, which only the user's tolerances bring, then our verdict.
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
    """Solve by TAO TRON.

    This is trust region Newton with projected searches, conjugate gradients and incomplete
    Cholesky.

    Slow, or a StepFailure, with springs more than about 1e3 times stiffer than the body: they
    shrink its trust region.
    """

    carries_friction: ClassVar[bool] = False

    def defaults(self, ranks: int) -> Options:
        """Return the options that come before the user's.

        PETSc has no incomplete Cholesky for several ranks.
        """
        return {**TRON, "pc_type": "icc" if ranks == 1 else "bjacobi"}

    def driver(self, scaled: ScaledStep, layers: OptionLayers) -> TaoDriver:
        """Return the TAO object."""
        return TaoDriver(scaled, layers)
