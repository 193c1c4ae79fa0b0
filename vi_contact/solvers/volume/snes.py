"""Solve variational inequalities on all unknowns by PETSc SNES, with two assembled methods.

``ReducedNewton`` is VINEWTONRSLS, which without a line search is the primal-dual active set method:
solve with the active points held, project, read the next active set off the signs of the residual.
``SemismoothNewton`` is VINEWTONSSLS on the Fischer-Burmeister function. Both factorise in every
iteration; of ``Condensed`` they share A, b.
"""

import weakref
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...core.algebra import Array
from ..petsc import PETSc
from .bounded_system import BoundedSystem
from .friction_jacobian import FrictionJacobian
from .friction_system import ScaledFrictionStep
from .options import (
    NEWTON,
    OptionLayers,
    Options,
    check_friction,
    check_reduced,
    check_semismooth,
    choose_direct,
)
from .scaled_step import ScaledStep


class SnesDriver:
    """Run a SNES object bound to a scaled step.

    Attributes:
        solver: the PETSc object.
    """

    reasons = PETSc.SNES.ConvergedReason

    def __init__(
        self,
        scaled: ScaledStep,
        layers: OptionLayers,
        jacobian: "AssembledJacobian | FrictionJacobian",
        *,
        snes_type: str,
        check: Callable[[Any, OptionLayers], None],
    ) -> None:
        """Make the solver.

        Args:
            scaled: evaluates the step.
            layers: PETSc's options.
            jacobian: holds the derivatives.
            snes_type: PETSc's name of the method.
            check: refuses options that give wrong answers.

        Raises:
            InputError: PETSc or ``check`` does not take the options.
        """
        self._scaled = scaled
        self._layers = layers
        self._jacobian = jacobian
        self._y, self._F = jacobian.mat.createVecs()
        self._lower = self._y.duplicate()
        self._upper = self._y.duplicate()
        self.solver = PETSc.SNES().create(scaled.system.comm)
        self.solver.setOptionsPrefix(layers.prefix)
        self.solver.setType(snes_type)  # before the convergence test, which it would overwrite
        self._first = 0.0
        self.solver.setFunction(weakly(scaled.write_residual), self._F)
        self.solver.setJacobian(weakly(jacobian.evaluate), jacobian.mat)
        self.solver.setVariableBounds(self._lower, self._upper)
        self.solver.setConvergenceTest(weakly(self._test))
        layers.apply(self.solver, check)

    def run(self) -> tuple[Array, Array, int, int]:
        """Return (y, F(y), PETSc's reason, iterations) of the scaled step."""
        scaled = self._scaled
        snes = self.solver
        self._jacobian.rescale(scaled.x_ref / scaled.r_ref)
        self._y.array[:] = scaled.start
        write_bounds(scaled, self._lower, self._upper)
        with self._layers.in_force():
            snes.solve(None, self._y)
        y = np.array(self._y.array_r)
        F = np.array(self._F.array_r)
        return y, F, snes.getConvergedReason(), snes.getIterationNumber()

    def _test(self, snes: Any, iteration: int, norms: tuple[float, float, float]) -> int:
        """Return PETSc's reason to stop; 0 to go on.

        It is our verdict, or by tolerances of the user, which are relative to |b| and to the first
        norm.

        Args:
            snes: the solver.
            iteration: number of the iteration.
            norms: of x, of the step, and of F.
        """
        reason = self._scaled.verdict(snes.getSolution().array_r, snes.getFunction()[0].array_r)
        if reason:
            return reason
        rtol, atol, _, _ = snes.getTolerances()
        if iteration == 0:
            self._first = norms[2]
        if norms[2] < atol:
            return int(self.reasons.CONVERGED_FNORM_ABS)
        if iteration and norms[2] < rtol * self._first:
            return int(self.reasons.CONVERGED_FNORM_RELATIVE)
        return 0

    def renew(self) -> None:
        """Take the entries of A again, which have changed; without friction."""
        if isinstance(self._jacobian, AssembledJacobian):
            self._jacobian.renew()

    def destroy(self) -> None:
        """Free the PETSc objects; collective."""
        for item in (self.solver, self._jacobian, self._y, self._F, self._lower, self._upper):
            item.destroy()


def weakly(method: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function that calls the bound method, and does not keep its object alive.

    That is what PETSc may hold: petsc4py frees a solver late and all at once; whatever PETSc object
    only its callbacks kept alive would then be lost to the clean-up and never be freed.
    """
    reference = weakref.WeakMethod(method)

    def call(*arguments: Any) -> Any:
        """Call the method, while its object lives."""
        alive = reference()
        assert alive is not None, "a PETSc solver outlived its driver"
        return alive(*arguments)

    return call


class LentContext:
    """Pass an object to PETSc as context, and do not keep it alive: see ``weakly``."""

    def __init__(self, lent: Any) -> None:
        self._lent = weakref.ref(lent)

    def __getattr__(self, name: str) -> Any:
        """Return what the object has of this name."""
        return getattr(self._lent(), name)


def write_bounds(scaled: ScaledStep, lower: Any, upper: Any) -> None:
    """Write the bounds of a step into PETSc's vectors, with PETSc's own infinities for none.

    Args:
        scaled: has the bounds.
        lower: a PETSc vector.
        upper: a PETSc vector.
    """
    lower.array[:] = np.maximum(scaled.lower, PETSc.NINFINITY)
    upper.array[:] = np.minimum(scaled.upper, PETSc.INFINITY)


class AssembledJacobian:
    """Assemble H = A x_ref / r_ref as an AIJ matrix.

    It is positive definite, and symmetric where A is.

    Attributes:
        mat: the matrix.
    """

    def __init__(self, system: BoundedSystem) -> None:
        """Make a matrix of the pattern of A. Collective."""
        self._A = system.assemble()
        self._own = self._A is not getattr(system.A.matrix, "mat", None)
        self.mat = self._A.duplicate(copy=True)
        self._symmetric = system.symmetric
        self._ratio = np.nan

    def rescale(self, ratio: float) -> None:
        """Take the units of a step."""
        if ratio != self._ratio:
            self._ratio = ratio
            self._copy()
            self.mat.setOption(PETSc.Mat.Option.SPD, self._symmetric)

    def renew(self) -> None:
        """Copy A again at the next step, as its entries have changed."""
        self._ratio = np.nan

    def evaluate(self, snes: Any, y: Any, J: Any, P: Any) -> None:
        """Do nothing when PETSc calls for a Jacobian: the matrix is constant.

        Args:
            snes: PETSc's solver, or TAO's.
            y: the PETSc vector of unknowns.
            J: PETSc's Jacobian, which is ``mat``.
            P: the matrix for the preconditioner, the same.
        """

    def _copy(self) -> None:
        """Write H into the matrix."""
        self._A.copy(self.mat, structure=PETSc.Mat.Structure.SAME_NONZERO_PATTERN)
        self.mat.scale(self._ratio)

    def destroy(self) -> None:
        """Free what this object made."""
        self.mat.destroy()
        if self._own:
            self._A.destroy()


class SemismoothJacobian(AssembledJacobian):
    """Assemble H anew for every iteration.

    VINEWTONSSLS overwrites it by D_a + D_b H, which is not symmetric.
    """

    def rescale(self, ratio: float) -> None:
        """Take the units of a step."""
        self._ratio = ratio

    def evaluate(self, snes: Any, y: Any, J: Any, P: Any) -> None:
        """Make a fresh copy, as PETSc calls for a Jacobian.

        Args:
            snes: PETSc's solver, or TAO's.
            y: the PETSc vector of unknowns.
            J: PETSc's Jacobian, which is ``mat``.
            P: the matrix for the preconditioner, the same.
        """
        self._copy()
        self.mat.setOption(PETSc.Mat.Option.SYMMETRIC, False)


@dataclass(frozen=True)
class ReducedNewton:
    """Solve by an active set method of PETSc, SNES VINEWTONRSLS.

    It makes a factor by MUMPS in every iteration: Cholesky's, or with friction, and where A is not
    symmetric, LU. Other linear solvers are chosen by ``petsc_options``, e.g. {"ksp_type": "cg",
    "pc_type": "hypre"}; gamg, mg and fieldsplit are refused, they do not survive the reduction.
    """

    carries_friction: ClassVar[bool] = True

    def defaults(self, ranks: int) -> Options:
        """Return the options that come before the user's."""
        return {**NEWTON, **choose_direct("cholesky", ranks)}

    def driver(self, scaled: ScaledStep, layers: OptionLayers) -> SnesDriver:
        """Return the SNES object."""
        jacobian = AssembledJacobian(scaled.system)
        return SnesDriver(scaled, layers, jacobian, snes_type="vinewtonrsls", check=check_reduced)

    def friction_defaults(self, ranks: int) -> Options:
        """Return the options that come before the user's, with friction.

        They take LU, as the system with friction is not symmetric. Its zeros on the diagonal delay
        pivots, for which MUMPS on several ranks needs more room than usual, or stops with
        INFOG(1) = -9.
        """
        return {**NEWTON, **choose_direct("lu", ranks, exchanges=True), "mat_mumps_icntl_14": 200}

    def friction_driver(self, scaled: ScaledFrictionStep, layers: OptionLayers) -> SnesDriver:
        """Return the SNES object of a step with friction."""
        jacobian = FrictionJacobian(scaled)
        return SnesDriver(scaled, layers, jacobian, snes_type="vinewtonrsls", check=check_friction)


@dataclass(frozen=True)
class SemismoothNewton:
    """Solve by a semismooth Newton method of PETSc, SNES VINEWTONSSLS, with LU by MUMPS.

    It is a diagnostic. Iterates may penetrate by 1e-13. With springs 1e6 times stiffer or softer
    than the body its line search may fail.
    """

    carries_friction: ClassVar[bool] = False

    def defaults(self, ranks: int) -> Options:
        """Return the options that come before the user's."""
        return {**NEWTON, "snes_linesearch_type": "bt", **choose_direct("lu", ranks)}

    def driver(self, scaled: ScaledStep, layers: OptionLayers) -> SnesDriver:
        """Return the SNES object."""
        jacobian = SemismoothJacobian(scaled.system)
        return SnesDriver(
            scaled, layers, jacobian, snes_type="vinewtonssls", check=check_semismooth
        )
