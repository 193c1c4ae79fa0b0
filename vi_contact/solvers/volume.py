"""The volume route: the one-step problem solved on all unknowns by PETSc's VI and bound-constrained solvers.

    A x = b - B_nᵀ r_n,    0 <= r_n  ⊥  bound - B_n x + compliance r_n / scale >= 0

In the rotated basis every condition is a bound on one unknown, which is all that SNES-VI and TAO know of contact. They
cannot carry friction. Reference: solver notes in docs; PETSc manual, chapters SNES (variational inequalities) and TAO.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np
from petsc4py import PETSc

from ..algebra import Array
from ..errors import InputError, StepFailure
from ..friction import refuse_friction
from ..step import ContactProblem, EffectiveMatrix, StepProblem, StepResult
from ..surfaces import ContactSurface
from .volume_factorised import OneFactorisation
from .volume_options import OptionLayers, Options
from .volume_reasons import raised, stopped
from .volume_snes import ReducedNewton, SemismoothNewton
from .volume_step import ScaledStep
from .volume_system import BoundedSystem
from .volume_tao import Selected, TaoBnls, TaoTron

__all__ = ["OneFactorisation", "ReducedNewton", "Selected", "SemismoothNewton", "TaoBnls", "TaoTron", "Volume"]


class Driver(Protocol):
    """A PETSc solver bound to a ScaledStep."""

    solver: Any
    reasons: type

    def run(self) -> tuple[Array, Array, int, int]:
        """(y, F(y), PETSc's reason, iterations) of the scaled step."""
        ...

    def destroy(self) -> None: ...


class Method(Protocol):
    """How the bounded problem is solved: settings that make a driver and choose where it starts."""

    def defaults(self, ranks: int) -> Options: ...
    def driver(self, scaled: ScaledStep, layers: OptionLayers) -> Any: ...
    def start(self, driver: Any, system: BoundedSystem, step: StepProblem) -> Array: ...


@dataclass(frozen=True)
class Volume:
    """Settings of the volume route.

    Attributes:
        method: OneFactorisation (fast), ReducedNewton (the reference), SemismoothNewton, TaoTron, TaoBnls or Selected.
        petsc_options: PETSc options without prefix, e.g. {"snes_monitor": None}; command-line options go before them.
        prefix: what these options are called on the command line and in PETSC_OPTIONS.
        tolerance: largest relative error accepted when a solver stops improving above round-off.
    """

    method: Method = field(default_factory=OneFactorisation)
    petsc_options: Mapping[str, object | None] = field(default_factory=dict)
    prefix: str = "vi_contact_volume_"
    tolerance: float = 1e-9

    def __post_init__(self) -> None:
        if not 0.0 < self.tolerance < 1.0:
            raise InputError(f"Volume tolerance is {self.tolerance}: give a relative error below 1, such as 1e-9")

    def check(self, problem: ContactProblem) -> None:
        """InputError for friction: bounds on single unknowns cannot express |r_t| <= threshold."""
        refuse_friction("Volume", problem.friction)

    def prepare(self, A: EffectiveMatrix, surface: ContactSurface, scale: float) -> PreparedVolume:
        """The solver for one effective matrix; collective. InputError for options that cannot work."""
        return PreparedVolume(self, A, surface, scale)


class PreparedVolume:
    """A PETSc solver bound to A; ``snes`` or ``tao`` is the PETSc object. ``close`` frees it.

    Without ``close`` it is freed at the first ``prepare`` after its last reference: destruction is collective, and
    Python's is not, so petsc4py only puts it aside.
    """

    def __init__(self, settings: Volume, A: EffectiveMatrix, surface: ContactSurface, scale: float) -> None:
        self._system = BoundedSystem(A, surface, scale)
        PETSc.garbage_cleanup(self._system.comm)
        self._method = settings.method
        defaults = settings.method.defaults(surface.comm.size)
        self._layers = OptionLayers(settings.prefix, defaults, settings.petsc_options)
        self._scaled = ScaledStep(self._system, settings.tolerance)
        self._name = f"Volume({getattr(settings.method, 'petsc_type', type(settings.method).__name__)})"
        self._driver: Driver | None = self._make()

    def _make(self) -> Driver:
        driver: Driver = self._method.driver(self._scaled, self._layers)
        return driver

    @property
    def snes(self) -> Any:
        """The SNES object; None when the method is TAO's or the solver is closed."""
        return self._petsc("SNES")

    @property
    def tao(self) -> Any:
        """The TAO object; None when the method is SNES's or the solver is closed."""
        return self._petsc("TAO")

    def _petsc(self, kind: str) -> Any:
        solver = None if self._driver is None else self._driver.solver
        return solver if isinstance(solver, getattr(PETSc, kind)) else None

    def close(self) -> None:
        """Free the PETSc objects; collective."""
        if self._driver is not None:
            self._driver.destroy()
            self._driver = None

    def solve(self, step: StepProblem) -> StepResult:
        """The step; StepFailure with PETSc's reason when it does not converge."""
        if self._driver is None:
            self._driver = self._make()
        try:
            self._scaled.set(step, self._method.start(self._driver, self._system, step))
            y, F, reason, iterations = self._driver.run()
        except PETSc.Error as error:
            self.close()  # its state is unknown; the next step gets a new one
            if error.__cause__ is not None:
                raise error.__cause__ from None  # raised in one of our callbacks; PETSc before 3.22 passes it on
            raise raised(self._name, error) from error
        except StepFailure:
            self.close()
            raise
        if reason <= 0 and not self._scaled.accepts(y, F):
            failure = stopped(self._name, self._driver.reasons, reason, iterations, self._scaled.worst)
            if np.isnan(self._scaled.worst):
                self.close()  # VINEWTONSSLS leaves its own residual installed and would call itself without end
            raise failure
        return self._result(y, F, iterations)

    def _result(self, y: Array, F: Array, iterations: int) -> StepResult:
        """x, and r_n on the active set. Off it r_n is zero, so that what is left of F shows in the certificate."""
        system, scaled = self._system, self._scaled
        active = scaled.active(y, F)
        r_n = np.where(active, system.reactions(F * scaled.r_ref), 0.0)
        return StepResult(
            x=y[: system.rows] * scaled.x_ref,
            r_n=system.shared(r_n),
            active=system.shared(active.astype(float)) > 0.0,
            iterations=iterations,
            method=self._name,
        )
