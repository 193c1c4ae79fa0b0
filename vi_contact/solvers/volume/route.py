"""Solve the step on all unknowns, by PETSc's solvers for bounds: the volume route.

    A x = b - B_nᵀ r_n,    0 <= r_n  ⊥  bound - B_n x + compliance r_n / scale >= 0

In the rotated basis every condition is a bound on one unknown, which is all that SNES-VI and TAO
know of contact. With friction the tangential reactions become bounded unknowns too (``friction``);
then there is nothing to minimise, and only SNES can do it. Reference: PETSc manual, chapters SNES
(variational inequalities) and TAO.

From the settings to PETSc: ``Volume`` holds the settings; ``PreparedVolume`` has one PETSc solver
for one A, which a *driver* runs (``snes``, ``tao``); the driver sees a step through
``scaled_step.ScaledStep``, whose numbers are near one, of a ``bounded_system.BoundedSystem``; the
options of method, user and command line are laid over each other by ``options.OptionLayers``.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Protocol, cast

from ...core.algebra import EffectiveMatrix
from ...core.checks import instance, provides, quote, real
from ...core.errors import InputError, StepFailure
from ...core.problem import ContactProblem
from ...core.step import StepProblem, StepResult
from ...core.surfaces import ContactSurface
from ..certified import check_laws, refuse_rates, refuse_traces
from ..petsc import PETSc
from .bounded_system import BoundedSystem
from .failures import make_petsc_failure
from .friction import VolumeFriction
from .friction_system import FrictionSystem, ScaledFrictionStep
from .options import OptionLayers, Options, choose_direct
from .scaled_step import ScaledStep
from .snes import ReducedNewton, SemismoothNewton, SnesDriver
from .tao import TaoDriver, TaoTron

__all__ = ["ReducedNewton", "SemismoothNewton", "TaoTron", "Volume"]


class Method(Protocol):
    """Say how the bounded problem is solved: settings that make a driver.

    One that carries friction has ``friction_defaults`` and ``friction_driver`` too, as
    ReducedNewton has.
    """

    @property
    def carries_friction(self) -> bool:
        """Say whether it solves steps with friction."""

    def defaults(self, ranks: int) -> Options:
        """Return the options that come before the user's, on so many ranks."""

    def driver(self, scaled: ScaledStep, layers: OptionLayers) -> Any:
        """Return what runs PETSc's solver of a scaled step, with these options."""


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
            tolerance = quote(self.tolerance)
            raise InputError(
                f"Volume tolerance is {tolerance}: give a relative error below 1, such as 1e-9"
            )

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError for friction that the method cannot carry, or that does not fit.

        So it does for friction without a tangential direction, or of a wrong length.
        """
        if problem.frictional and not self.method.carries_friction:
            raise InputError(
                f"Volume({self.method}) only enforces bounds on displacements and would ignore "
                f"{problem.friction}: use Volume(ReducedNewton()), or Condensed(), the condensed "
                "route"
            )
        refuse_traces(f"Volume({self.method})", problem.surface)
        refuse_rates(f"Volume({self.method})", problem)
        check_laws(
            f"Volume({self.method})", problem, unsymmetric=not isinstance(self.method, TaoTron)
        )

    def prepare(
        self, A: EffectiveMatrix, surface: ContactSurface, scale: float
    ) -> "PreparedVolume":
        """Return the solver for one effective matrix. Collective.

        Args:
            A: the effective matrix.
            surface: the contact surface.
            scale: of reactions, over which compliances are divided.

        Raises:
            InputError: for options that cannot work.
        """
        return PreparedVolume(self, A, surface, scale)


class PreparedVolume:
    """Run a PETSc solver bound to A. ``close`` frees it.

    Without ``close`` it is freed at the first ``prepare`` after its last reference: to free it is
    collective.
    """

    def __init__(
        self, settings: Volume, A: EffectiveMatrix, surface: ContactSurface, scale: float
    ) -> None:
        """Make the solver without friction: see ``Volume.prepare``. Collective."""
        self._settings = settings
        self._method = settings.method
        self._name = f"Volume({type(settings.method).__name__})"
        self._comm = surface.comm
        self._system = BoundedSystem(A, surface, scale)
        PETSc.garbage_cleanup(self._system.comm)  # frees solvers of before that nobody has closed

        # Options; a matrix that is not symmetric has no Cholesky factor.
        self._read: set[str] = set()  # options of the user that PETSc has read
        self._all_read = False  # whether it is known that PETSc reads all of them
        ranks = surface.comm.size
        defaults = settings.method.defaults(ranks)
        if not self._system.symmetric:
            defaults = {**defaults, **choose_direct("lu", ranks)}
        self._layers = self._make_layers(defaults)

        # One driver at a time: of steps without friction at first, or of those with friction, which
        # ``_prepare_friction`` puts into its place. None when it is closed.
        self._scaled = ScaledStep(self._system, settings.tolerance)
        self._friction: VolumeFriction | None = None
        self._driver: SnesDriver | TaoDriver | None
        self._driver = self._method.driver(self._scaled, self._layers)

    def _make_layers(self, defaults: Options) -> OptionLayers:
        """Return the options of the user over these."""
        settings = self._settings
        return OptionLayers(settings.prefix, defaults, settings.petsc_options, self._read)

    def _prepare_friction(self) -> VolumeFriction:
        """Return the solver of steps with friction, made at the first of them. Collective.

        It takes the place of the other one.
        """
        if self._friction is None:
            self.close()
            method = cast(ReducedNewton, self._method)
            friction_system = FrictionSystem(self._system)
            scaled = ScaledFrictionStep(friction_system, self._settings.tolerance)
            layers = self._make_layers(method.friction_defaults(self._system.comm.size))
            self._driver = method.friction_driver(scaled, layers)
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
        """Return the PETSc object if it is of this kind."""
        solver = None if self._driver is None else self._driver.solver
        return solver if isinstance(solver, getattr(PETSc, kind)) else None

    def close(self) -> None:
        """Free the PETSc objects; collective."""
        if self._driver is not None:
            self._driver.destroy()
        self._driver = None
        self._friction = None

    def renew(self) -> None:
        """Take the entries of A again, which have changed in place. Collective.

        Its pattern is the same, and there are no springs and no friction.
        """
        self._scaled.renew()
        if self._driver is not None:
            self._driver.renew()

    def solve(self, step: StepProblem) -> StepResult:
        """Return the answer to a step. Collective.

        Raises:
            StepFailure: PETSc's solver does not converge; the error tells its reason.
        """
        try:
            if step.slip0 is None:
                result = self._solve_without_friction(step)
            else:
                result = self._prepare_friction().solve(step)
        except PETSc.Error as error:
            self.close()  # its state is unknown; the next step gets a new one
            if error.__cause__ is not None:
                # raised in one of our callbacks; PETSc before 3.22 passes it on
                raise error.__cause__ from None
            raise make_petsc_failure(self._name, error) from error
        except StepFailure:
            self.close()
            raise
        self._refuse_unread(result.iterations)
        return result

    def excuse_options(self) -> None:
        """Do not refuse options that nothing reads: they are for a method that was tried before."""
        self._all_read = True

    def _refuse_unread(self, iterations: int) -> None:
        """Raise InputError for options that nothing has read after the first iterations.

        PETSc reads some of them only when a solver iterates. Collective.
        """
        if iterations and not self._all_read:
            self._all_read = True
            self._layers.refuse_unread(self._name, self._comm)

    def _solve_without_friction(self, step: StepProblem) -> StepResult:
        """Return the answer to a step without friction."""
        system = self._system
        scaled = self._scaled
        if self._driver is None or self._friction is not None:  # closed, or of steps with friction
            self.close()
            self._driver = self._method.driver(scaled, self._layers)

        # Solve for y = z / x_ref; x are the first rows of z, the others belong to springs.
        scaled.set(step, system.start(step))
        y, active, r_n, iterations = scaled.answer(self._driver, self._name)
        return StepResult(y[: system.rows] * scaled.x_ref, r_n, active, iterations, self._name)
