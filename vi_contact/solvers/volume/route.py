"""Solve the step on all unknowns, by PETSc's solvers for inequalities and bounds.

This is the volume route; the inequalities are variational.

    A x = b - B_nᵀ r_n,    0 <= r_n  ⊥  bound - B_n x + compliance r_n / scale >= 0

In the rotated basis every condition is a bound on one unknown, which is all that SNES-VI and TAO
know of contact. With friction the tangential reactions become bounded unknowns too (``friction``);
then there is nothing to minimise, and only SNES can do it. Reference: PETSc manual, chapters SNES
(variational inequalities) and TAO.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol, cast

from ...core.algebra import EffectiveMatrix
from ...core.checks import instance, provides, real, shown
from ...core.errors import InputError, StepFailure
from ...core.problem import ContactProblem
from ...core.step import StepProblem, StepResult
from ...core.surfaces import ContactSurface
from ..certified import check_laws
from ..petsc import PETSc
from .bounded_system import BoundedSystem
from .failures import petsc_failure
from .friction import VolumeFriction
from .friction_system import FrictionSystem, ScaledFrictionStep
from .options import OptionLayers, Options, direct
from .scaled_step import ScaledStep
from .snes import ReducedNewton, SemismoothNewton, SnesDriver
from .tao import TaoDriver, TaoTron

__all__ = ["ReducedNewton", "SemismoothNewton", "TaoTron", "Volume"]


class Method(Protocol):
    """Say how the bounded problem is solved: settings that make a driver.

    One that ``carries_friction`` makes two, as ReducedNewton does.
    """

    @property
    def carries_friction(self) -> bool: ...

    def defaults(self, ranks: int) -> Options: ...
    def driver(self, scaled: ScaledStep, layers: OptionLayers) -> Any: ...


@dataclass(frozen=True)
class Volume:
    """Solve each step on all unknowns of the body by PETSc, and hold the settings for it.

    Attributes:
        method: ReducedNewton (the reference), SemismoothNewton or TaoTron.
        petsc_options: PETSc options without prefix, e.g. {"snes_monitor": None}; the command line
            overrides them. One that nothing has read by the end of the first step with an iteration
            is refused, with the nearest known.
        prefix: the prefix of these options on the command line and in PETSC_OPTIONS.
        tolerance: the largest relative error that is accepted when a solver stops improving above
            round-off.
    """

    method: Method = field(default_factory=ReducedNewton)
    petsc_options: Mapping[str, object | None] = field(default_factory=dict)
    prefix: str = "vi_contact_volume_"
    tolerance: float = 1e-9

    def __post_init__(self) -> None:
        names = ("carries_friction", "defaults", "driver")
        provides("Volume", "method", self.method, names, "give ReducedNewton() or another")
        instance(
            "Volume",
            "petsc_options",
            self.petsc_options,
            Mapping,
            "give a dict of PETSc options without prefix",
        )
        instance("Volume", "prefix", self.prefix, str, "give a text such as 'vi_contact_volume_'")
        if not 0.0 < real(self.tolerance) < 1.0:
            tolerance = shown(self.tolerance)
            raise InputError(
                f"Volume tolerance is {tolerance}: give a relative error below 1, such as 1e-9"
            )

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError for friction that the method cannot carry.

        So it does for friction without a tangent, or of wrong length.
        """
        if problem.frictional and not self.method.carries_friction:
            raise InputError(
                f"Volume({self.method}) only enforces bounds on displacements and would ignore "
                f"{problem.friction}: use Volume(ReducedNewton()), or Condensed(), the condensed "
                "route"
            )
        check_laws(
            f"Volume({self.method})", problem, unsymmetric=not isinstance(self.method, TaoTron)
        )

    def prepare(
        self, A: EffectiveMatrix, surface: ContactSurface, scale: float
    ) -> "PreparedVolume":
        """Return the solver for one effective matrix; collective.

        InputError for options that cannot work.
        """
        return PreparedVolume(self, A, surface, scale)


class PreparedVolume:
    """Run a PETSc solver bound to A; ``snes`` or ``tao`` is the PETSc object. ``close`` frees it.

    Without ``close`` it is freed at the first ``prepare`` after its last reference: to free it is
    collective.
    """

    def __init__(
        self, settings: Volume, A: EffectiveMatrix, surface: ContactSurface, scale: float
    ) -> None:
        self._system = BoundedSystem(A, surface, scale)
        PETSc.garbage_cleanup(self._system.comm)
        self._settings, self._method = settings, settings.method
        self._comm, self._read, self._all_read = surface.comm, set[str](), False
        ranks = surface.comm.size
        own = settings.method.defaults(ranks)
        self._layers = self._layered(
            own if self._system.symmetric else {**own, **direct("lu", ranks)}
        )
        self._scaled = ScaledStep(self._system, settings.tolerance)
        self._name = f"Volume({type(settings.method).__name__})"
        self._friction: VolumeFriction | None = None
        self._driver: SnesDriver | TaoDriver | None = self._method.driver(
            self._scaled, self._layers
        )

    def _layered(self, defaults: Options) -> OptionLayers:
        return OptionLayers(
            self._settings.prefix, defaults, self._settings.petsc_options, self._read
        )

    def _friction_method(self) -> VolumeFriction:
        """Return the problem with friction, in the place of the other one.

        It is made at the first step that has some.
        """
        if self._friction is None:
            self.close()
            method, tolerance = cast(ReducedNewton, self._method), self._settings.tolerance
            scaled = ScaledFrictionStep(FrictionSystem(self._system), tolerance)
            defaults = method.friction_defaults(self._system.comm.size)
            self._driver = method.friction_driver(scaled, self._layered(defaults))
            self._friction = VolumeFriction(scaled, self._driver, self._name)
        return self._friction

    @property
    def snes(self) -> Any:
        """Return the SNES object; None when the method is TAO's or the solver is closed."""
        return self._petsc("SNES")

    @property
    def tao(self) -> Any:
        """Return the TAO object; None when the method is SNES's or the solver is closed."""
        return self._petsc("TAO")

    def _petsc(self, kind: str) -> Any:
        solver = None if self._driver is None else self._driver.solver
        return solver if isinstance(solver, getattr(PETSc, kind)) else None

    def close(self) -> None:
        """Free the PETSc objects; collective."""
        if self._driver is not None:
            self._driver.destroy()
        self._driver = self._friction = None

    def solve(self, step: StepProblem) -> StepResult:
        """Return the step; StepFailure with PETSc's reason when it does not converge."""
        try:
            found = self._solve(step) if step.slip0 is None else self._friction_method().solve(step)
        except PETSc.Error as error:
            self.close()  # its state is unknown; the next step gets a new one
            if error.__cause__ is not None:
                # raised in one of our callbacks; PETSc before 3.22 passes it on
                raise error.__cause__ from None
            raise petsc_failure(self._name, error) from error
        except StepFailure:
            self.close()
            raise
        self._refuse_unread(found.iterations)
        return found

    def excuse_options(self) -> None:
        """Take options that nothing reads.

        They are for another method, in whose place this one is tried.
        """
        self._all_read = True

    def _refuse_unread(self, iterations: int) -> None:
        """Raise InputError for options that nothing has read.

        It is asked once the parts of the solver have been at work.
        """
        if iterations and not self._all_read:
            self._all_read = True
            self._layers.refuse_unread(self._name, self._comm)

    def _solve(self, step: StepProblem) -> StepResult:
        """Solve the step without friction."""
        system, scaled = self._system, self._scaled
        if self._driver is None or self._friction is not None:
            self.close()
            self._driver = self._method.driver(scaled, self._layers)
        scaled.set(step, system.start(step))
        y, active, r_n, iterations = scaled.answer(self._driver, self._name)
        return StepResult(y[: system.rows] * scaled.x_ref, r_n, active, iterations, self._name)
