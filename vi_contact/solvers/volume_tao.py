"""PETSc TAO on the same bounds: minimise ½ xᵀA x - bᵀx subject to x_n <= bound, as a second opinion.

TAO's tolerances and trust regions are absolute (P18), which the scaled step makes harmless; its own convergence tests
are replaced by ``ScaledStep.verdict``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from petsc4py import PETSc

from ..algebra import Array
from ..checks import instance
from ..errors import InputError
from ..step import StepProblem
from .volume_friction_step import ScaledRubbing
from .volume_options import REDUCED_PC, OptionLayers, Options, refuse
from .volume_snes import AssembledJacobian, ReducedNewton, SemismoothNewton, SnesDriver, weakly, write_bounds
from .volume_step import ScaledStep
from .volume_system import BoundedSystem

UNCONSTRAINED = "it ignores bounds, so the body would penetrate"
OTHER = "it solves another class of problem (it wants constraint functions or a least-squares structure)"
REFUSED = {
    "bqpip": "it needs two finite bounds on every unknown and otherwise reports garbage as converged",
    "gpcg": "on elasticity it needs thousands of iterations and stops short of the solution",
    **dict.fromkeys(("lmvm", "nls", "ntr", "ntl", "cg", "nm", "owlqn", "bmrm"), UNCONSTRAINED),
    **dict.fromkeys(("pounders", "brgn", "lcl", "admm", "almm", "ipm", "pdipm", "shell", "python"), OTHER),
    **dict.fromkeys(("ssils", "ssfls", "asils", "asfls"), f"{OTHER}; SemismoothNewton() is its like in SNES"),
}
SOUND = ("tron", "bnls", "bntr", "bntl", "bqnls", "bqnkls", "bqnktr", "bqnktl", "blmvm", "bncg")
FULL_NEWTON = ("bnls", "bntr", "bntl")
FIRST_ORDER = ("bqnls", "bqnkls", "bqnktr", "bqnktl", "blmvm", "bncg")


def tao_options(ranks: int, kind: str) -> Options:
    """Defaults: TRON reads plain pc_type, the Newton-Krylov types tao_bnk_pc_type (P18), where the quasi-Newton types
    want their own. PETSc has no incomplete Cholesky for several ranks."""
    prefix = "tao_bnk_" if kind in FULL_NEWTON else ""
    return {
        "tao_gatol": 0.0,
        "tao_grtol": 0.0,
        "tao_gttol": 0.0,
        "tao_steptol": 0.0,
        "tao_max_it": 5000 if kind in FIRST_ORDER else 200,
        f"{prefix}pc_type": "icc" if ranks == 1 else "bjacobi",
        f"{prefix}sub_pc_type": "icc",
    }


def check_tao(tao: Any, layers: OptionLayers) -> None:
    """Refuse types and preconditioners that give wrong answers, also when they come from options."""
    refuse_type(tao.getType())
    for key in ("pc_type", "tao_bnk_pc_type"):
        pc = layers.chosen(key)
        if pc in REDUCED_PC:
            refuse(f"{key} {pc} with TAO {tao.getType()}", REDUCED_PC[pc], "use icc, bjacobi or hypre")


def refuse_type(kind: str) -> None:
    """InputError for TAO types that cannot solve the contact problem."""
    if kind in REFUSED:
        refuse(f"TAO type {kind}", REFUSED[kind], "use TaoTron(), TaoBnls() or ReducedNewton()")
    if kind not in SOUND:
        raise InputError(f"TAO type {kind!r} is not known to solve contact problems: choose one of {', '.join(SOUND)}")


class TaoDriver:
    """A TAO object bound to a scaled step; ``solver`` is the PETSc object."""

    reasons = PETSc.TAO.Reason

    def __init__(self, scaled: ScaledStep, layers: OptionLayers, tao_type: str) -> None:
        self._scaled, self._layers = scaled, layers
        self._hessian = AssembledJacobian(scaled.system)
        self._y, G = self._hessian.mat.createVecs()
        self._vectors = [self._y, G, self._y.duplicate(), self._y.duplicate()]
        self.solver = PETSc.TAO().create(scaled.system.comm)
        self.solver.setOptionsPrefix(layers.prefix)
        self.solver.setType(tao_type)
        self._test = Test(scaled)
        self.solver.setObjectiveGradient(weakly(scaled.objective), G)
        self.solver.setHessian(weakly(self._hessian.evaluate), self._hessian.mat)
        self.solver.setVariableBounds((self._vectors[2], self._vectors[3]))
        self.solver.setSolution(self._y)
        self.solver.setConvergenceTest(weakly(self._test.reason))
        layers.apply(self.solver, check_tao)

    def run(self) -> tuple[Array, Array, int, int]:
        """(y, F(y), PETSc's reason, iterations) of the scaled step."""
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
            before = scaled.worst  # the values compared were round-off: measured from here they have all digits again

    def destroy(self) -> None:
        """Free the PETSc objects; collective."""
        for item in (self.solver, self._hessian, *self._vectors):
            item.destroy()


class Test:
    """The TAO convergence test: PETSc's own, which only the user's tolerances switch on, then our verdict."""

    def __init__(self, scaled: ScaledStep) -> None:
        self._scaled = scaled

    def reason(self, tao: Any) -> int | None:
        """PETSc's reason to stop, None to go on."""
        if tao.getConvergedReason():
            return None
        y = tao.getSolution().array_r
        reason = self._scaled.verdict(y, self._scaled.residual(y))  # TRON overwrites its gradient by the projected one
        if reason < 0:
            return int(PETSc.TAO.Reason.DIVERGED_NAN)
        return int(PETSc.TAO.Reason.CONVERGED_USER) if reason else None


@dataclass(frozen=True)
class TaoTron:
    """TAO TRON: trust region Newton with projected searches; conjugate gradients with incomplete Cholesky inside.

    Slow, or a StepFailure, with springs more than about 1e3 times stiffer than the body: they shrink its trust region.
    """

    carries_friction: ClassVar[bool] = False
    tao_type: ClassVar[str] = "tron"

    def defaults(self, ranks: int) -> Options:
        """Options before the user's."""
        return tao_options(ranks, self.tao_type)

    def driver(self, scaled: ScaledStep, layers: OptionLayers) -> TaoDriver:
        """The TAO object."""
        return TaoDriver(scaled, layers, self.tao_type)

    def start(self, driver: TaoDriver, system: BoundedSystem, step: StepProblem) -> Array:
        """The guess with the predicted contacts on their bounds."""
        return system.start(step)


@dataclass(frozen=True)
class TaoBnls(TaoTron):
    """TAO BNLS: bound-constrained Newton with a line search; conjugate gradients with incomplete Cholesky inside."""

    tao_type: ClassVar[str] = "bnls"


@dataclass(frozen=True)
class Selected:
    """Any sound solver by PETSc's own name: vinewtonrsls, vinewtonssls or a TAO type.

    bntr, bntl, the quasi-Newton types, blmvm and bncg are experimental and slow for elasticity. InputError, with the
    reason, for types that ignore bounds, need another structure or are known to report wrong answers as converged.
    """

    petsc_type: str

    def __post_init__(self) -> None:
        instance("Selected", "petsc_type", self.petsc_type, str, "give a PETSc type, such as 'vinewtonrsls'")
        if self.petsc_type not in SNES_TYPES:
            refuse_type(self.petsc_type)

    @property
    def carries_friction(self) -> bool:
        """Whether it is vinewtonrsls."""
        return isinstance(SNES_TYPES.get(self.petsc_type), ReducedNewton)

    def defaults(self, ranks: int) -> Options:
        """Options before the user's."""
        if self.petsc_type in SNES_TYPES:
            return SNES_TYPES[self.petsc_type].defaults(ranks)
        return tao_options(ranks, self.petsc_type)

    def driver(self, scaled: ScaledStep, layers: OptionLayers) -> SnesDriver | TaoDriver:
        """The SNES or TAO object."""
        if self.petsc_type in SNES_TYPES:
            return SNES_TYPES[self.petsc_type].driver(scaled, layers)
        return TaoDriver(scaled, layers, self.petsc_type)

    def start(self, driver: Any, system: BoundedSystem, step: StepProblem) -> Array:
        """The guess with the predicted contacts on their bounds."""
        return system.start(step)

    def friction_defaults(self) -> Options:
        """Options before the user's, with friction."""
        return ReducedNewton().friction_defaults()

    def friction_driver(self, scaled: ScaledRubbing, layers: OptionLayers) -> SnesDriver:
        """The SNES object of a step with friction."""
        return ReducedNewton().friction_driver(scaled, layers)


SNES_TYPES: Mapping[str, ReducedNewton | SemismoothNewton] = {
    "vinewtonrsls": ReducedNewton(),
    "vinewtonssls": SemismoothNewton(),
}
