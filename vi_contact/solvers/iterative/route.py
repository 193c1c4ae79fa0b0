"""Solve the step on all unknowns by conjugate gradients: no factor, nothing condensed or gathered.

    A x = b - B_nᵀ r_n,    0 <= r_n  ⊥  bound - B_n x + compliance r_n / scale >= 0

The contact set is a mask on the full-size vectors (``search``); a set that comes twice, or does not
end, goes to projected gradients, which decrease the energy in every step and so cannot cycle
(``projected_gradients``). Steps with friction take semismooth Newton and GMRES instead
(``friction``).
"""

import logging
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Any

import numpy as np

from ...core.algebra import EffectiveMatrix
from ...core.arguments import check_fields
from ...core.checks import check_word, instance
from ...core.errors import StepFailure
from ...core.problem import ContactProblem
from ...core.quantities import Between, NotNegative, Positive
from ...core.step import StepProblem, StepResult
from ...core.surfaces import ContactSurface
from ..certified import check_laws, refuse_rates, refuse_traces
from ..petsc import PETSc
from ..volume.failures import make_petsc_failure
from ..volume.options import OptionLayers
from .conjugate_gradients import SOLVED, WRONG_SIGNS, ConjugateGradients, make_cg_failure
from .contact import ClosedSet
from .friction import FrictionSolver
from .layout import Nodewise
from .measures import Worth
from .operator import Operator, Work
from .preconditioners import (
    GAMG,
    ICC,
    KINDS,
    RAISED,
    Inverse,
    Masked,
    Multigrid,
    choose_kind,
    compute_courant,
    defaults,
)
from .projected_gradients import descend, estimate_largest_eigenvalue
from .search import Search, search_set

log = logging.getLogger(__name__)
AUTO = "auto"


@dataclass(frozen=True)
class Iterative:
    """Solve each step on all unknowns by conjugate gradients, on any number of ranks.

    The object holds the settings.

    Attributes:
        preconditioner: "jacobi", "icc" (incomplete Cholesky factors, one on each rank), "gamg"
            (algebraic multigrid with rigid body modes), or "auto", which takes the first up to a
            Courant number of 0.5 in A, the second up to 30, and the third beyond. PETSc's options
            may name another.
        petsc_options: options of the preconditioner without prefix, e.g. {"pc_gamg_threshold":
            0.02}; those of ICC begin with ``sub_pc_``. Options of the command line override them.
            One that nothing reads is refused.
        prefix: the prefix of these options on the command line and in PETSC_OPTIONS.
        tolerance: it stops when the residual, measured as the certificate, and the estimated error
            are below this.
        changes: number of changes of the contact set in a step without friction; after more, or
            when a set comes twice, projected gradients continue.
        patience: number of linear iterations within which the residual has to fall tenfold.
    """

    preconditioner: str = AUTO
    petsc_options: Mapping[str, object | None] = field(default_factory=dict)
    prefix: str = "vi_contact_iterative_"
    tolerance: Annotated[
        float, Between(0.0, 1.0, "()", "give a relative error below 1, such as 3e-10")
    ] = 3e-10
    changes: Annotated[int, NotNegative] = 15
    patience: Annotated[int, Positive] = 1000

    def __post_init__(self) -> None:
        check_word("preconditioner", self.preconditioner, (AUTO, *KINDS))
        remedy = "give a dict of PETSc options without prefix"
        instance("Iterative", "petsc_options", self.petsc_options, Mapping, remedy)
        instance(
            "Iterative", "prefix", self.prefix, str, "give a text such as 'vi_contact_iterative_'"
        )
        check_fields(self)

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError for friction without a tangential direction, or of a wrong length."""
        refuse_traces("Iterative()", problem.surface)
        refuse_rates("Iterative()", problem)
        check_laws("Iterative()", problem)

    def prepare(
        self, A: EffectiveMatrix, surface: ContactSurface, scale: float
    ) -> "PreparedIterative":
        """Choose and make the preconditioner. Collective.

        Args:
            A: the effective matrix.
            surface: the contact surface.
            scale: of reactions, over which compliances are divided.

        Raises:
            InputError: for options that cannot work.
        """
        return PreparedIterative(self, A, surface, scale)


class PreparedIterative:
    """Solve steps of one A.

    Attributes:
        work: what it has done.
        kind: its preconditioner.
    """

    def __init__(
        self, settings: Iterative, A: EffectiveMatrix, surface: ContactSurface, scale: float
    ) -> None:
        """Choose and make the preconditioner: see ``Iterative.prepare``."""
        self._settings = settings
        self._surface = surface
        self.work = Work()

        # A in whole nodes, and what has been left of earlier solvers is freed.
        nodewise = Nodewise(A)
        self._layout = nodewise.layout
        self.kind = self._choose_preconditioner(A)
        self._blocks = nodewise.blocks()
        PETSc.garbage_cleanup(self._blocks.comm)
        self._operator = Operator(self._blocks, self.work)

        # The preconditioner, and whether PETSc has read all options for it.
        self._raised = False  # whether factors of a larger diagonal are in use
        self._layers = OptionLayers(
            settings.prefix, defaults(self.kind, A.algebra.comm.size), settings.petsc_options
        )
        if self.kind == GAMG:
            self._use(Multigrid(nodewise, surface, self._layers, self.work))
        else:
            self._use(Inverse(self._blocks, self._layers))
        if settings.preconditioner == AUTO:
            self._layers.excuse_known()  # they may be for a kind that another time step makes
        self._layers.refuse_unread(self._name, surface.comm)

        # The contact set, and how small residuals have to be.
        self._diagonal = np.array(self._blocks.getDiagonal().array_r)
        rows = self._layout.places[surface.owned]
        self._contact = ClosedSet(surface, scale, rows, self._diagonal, self._layout.missing)
        self._norm: float | None = None  # of D^-½ A D^-½, estimated when it is needed
        self._worth = Worth(surface.comm, 2, settings.tolerance)

    def _choose_preconditioner(self, A: EffectiveMatrix) -> str:
        """Return the preconditioner, and write it into the log. Collective."""
        number = compute_courant(A)
        asked = self._settings.preconditioner
        kind = choose_kind(number, A.space is not None) if asked == AUTO else asked
        if A.algebra.comm.rank == 0:
            overlaps = kind == ICC and A.algebra.comm.size > 1
            log.info(
                "Iterative: preconditioner %s, %s at Courant number %.3g%s",
                kind,
                "chosen" if asked == AUTO else "asked for",
                number,
                "; ranks overlap by a layer" if overlaps else "",
            )
        return kind

    def _use(self, inverse: Inverse) -> None:
        """Precondition with this one from now on."""
        self._inverse = inverse
        self._masked = Masked(inverse.pc, self._blocks.createVecLeft())
        self._cg = ConjugateGradients(self._operator, self._masked)
        self.__dict__.pop("_friction", None)  # made for the one before

    @property
    def ksp(self) -> Any:
        """Return PETSc's linear solver."""
        return self._cg.ksp

    def solve(self, step: StepProblem) -> StepResult:
        """Return the answer to a step. Collective.

        Raises:
            StepFailure: on all ranks, with the history of residuals, when there is no answer.
        """
        if self.kind != ICC or self._raised:
            return self._attempt(step)
        try:
            # Factors that are not positive definite may bring forth anything.
            with np.errstate(over="ignore", invalid="ignore"):
                return self._attempt(step)
        except StepFailure as error:
            if self._surface.comm.rank == 0:
                log.info(
                    "%s: the step is tried again with incomplete factors of a larger diagonal",
                    error,
                )
        self._raised = True
        self._use(Inverse(self._blocks, self._layers, RAISED))
        return self._attempt(step)

    def _attempt(self, step: StepProblem) -> StepResult:
        """Return the answer, with the preconditioner that there is."""
        try:
            if step.slip0 is not None:
                return self._friction.solve(step)
            return self._solve_without_friction(step)
        except PETSc.Error as error:
            if error.__cause__ is not None:
                # raised in one of our callbacks; PETSc before 3.22 passes it on
                raise error.__cause__ from None
            raise make_petsc_failure(self._name, error) from error

    @cached_property
    def _friction(self) -> FrictionSolver:
        """Return the solver of steps with friction, made at the first of them."""
        settings = self._settings
        return FrictionSolver(
            self._surface,
            self._contact,
            self._layout,
            self._diagonal,
            self._operator,
            self._inverse,
            tolerance=settings.tolerance,
            patience=settings.patience,
            name=self._name,
        )

    @property
    def _name(self) -> str:
        """Return the name of the solver, for messages."""
        return f"Iterative({self.kind})"

    def _solve_without_friction(self, step: StepProblem) -> StepResult:
        """Return the answer: search the contact set, and where that goes in circles descend."""
        settings = self._settings
        contact = self._contact
        layout = self._layout
        before = self.work.linear_iterations
        search = Search(
            step,
            layout.pad(step.b),
            contact,
            operator=self._operator,
            masked=self._masked,
            inverse=self._inverse,
            worth=self._worth,
            tolerance=settings.tolerance,
            patience=settings.patience,
        )
        x, residual, changes, reason = search_set(
            search, self._cg, layout.pad(step.guess), settings.changes
        )
        if reason == WRONG_SIGNS:
            self.work.fallbacks += 1
            if self._norm is None:
                self._norm = estimate_largest_eigenvalue(search, self._diagonal)
            x, residual, reason = descend(search, self._diagonal, self._norm, x)
        if reason != SOLVED:
            iterations = self.work.linear_iterations - before
            raise make_cg_failure(self._name, reason, iterations, search.history)
        self._worth.keep()
        return StepResult(
            x=layout.strip(x),
            r_n=contact.reactions(x, residual),
            active=contact.closed.copy(),
            iterations=changes,
            method=self._name,
            aim=settings.tolerance,
        )
