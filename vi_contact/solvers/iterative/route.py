"""Solve the step on all unknowns by conjugate gradients.

Nothing is factorised, condensed or gathered.

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
from ..certified import check_laws
from ..petsc import PETSc
from ..volume.failures import raised
from ..volume.options import OptionLayers
from .conjugate_gradients import SOLVED, WRONG_SIGNS, ConjugateGradients, stopped
from .contact import Contact
from .friction import Friction
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
    chosen,
    courant,
    defaults,
)
from .projected_gradients import largest_eigenvalue, projected_gradients
from .search import Search, search

log = logging.getLogger(__name__)
AUTO = "auto"


@dataclass(frozen=True)
class Iterative:
    """Solve each step on all unknowns by conjugate gradients, and hold the settings for it.

    It does so on any number of ranks.

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
        """Raise InputError for friction that does not fit.

        It has no tangential direction, or a wrong number of values.
        """
        check_laws("Iterative()", problem)

    def prepare(
        self, A: EffectiveMatrix, surface: ContactSurface, scale: float
    ) -> "PreparedIterative":
        """Choose and make the preconditioner; collective.

        InputError for options that cannot
        work.
        """
        return PreparedIterative(self, A, surface, scale)


class PreparedIterative:
    """Solve steps of one A.

    ``work``: what it has done; ``kind``: its preconditioner; ``ksp``: PETSc's object.
    """

    def __init__(
        self, settings: Iterative, A: EffectiveMatrix, surface: ContactSurface, scale: float
    ) -> None:
        self._settings, self.work = settings, Work()
        nodewise = Nodewise(A)
        self._layout = layout = nodewise.layout
        self.kind = self._chosen(A)
        blocks = nodewise.blocks()
        PETSc.garbage_cleanup(blocks.comm)
        self._operator = Operator(blocks, self.work)
        self._layers = OptionLayers(
            settings.prefix, defaults(self.kind, A.algebra.comm.size), settings.petsc_options
        )
        self._blocks, self._raised = blocks, False
        self._take(
            Multigrid(nodewise, surface, self._layers, self.work)
            if self.kind == GAMG
            else Inverse(blocks, self._layers)
        )
        if settings.preconditioner == AUTO:
            self._layers.excuse_known()  # they may be for a kind that another time step makes
        self._layers.refuse_unread(self._name, surface.comm)
        self._diagonal = np.array(blocks.getDiagonal().array_r)
        self._contact = Contact(
            surface, scale, layout.places[surface.owned], self._diagonal, layout.missing
        )
        self._norm: float | None = None
        self._surface, self._worth = surface, Worth(surface.comm, 2, settings.tolerance)

    def _chosen(self, A: EffectiveMatrix) -> str:
        """Return the preconditioner, said in the log."""
        number, asked = courant(A), self._settings.preconditioner
        kind = chosen(number, A.space is not None) if asked == AUTO else asked
        if A.algebra.comm.rank == 0:
            layer = kind == ICC and A.algebra.comm.size > 1
            log.info(
                "Iterative: preconditioner %s, %s at Courant number %.3g%s",
                kind,
                "chosen" if asked == AUTO else "asked for",
                number,
                "; ranks overlap by a layer" if layer else "",
            )
        return kind

    def _take(self, inverse: Inverse) -> None:
        """Precondition with this one from now on."""
        self._inverse, self._masked = inverse, Masked(inverse.pc, self._blocks.createVecLeft())
        self._cg = ConjugateGradients(self._operator, self._masked)
        self.__dict__.pop("_friction", None)

    @property
    def ksp(self) -> Any:
        """Return PETSc's linear solver."""
        return self._cg.ksp

    def solve(self, step: StepProblem) -> StepResult:
        """Return the step.

        Raises:
            StepFailure: on all ranks, with the history of residuals, when there is no answer.
        """
        if self.kind != ICC or self._raised:
            return self._attempt(step)
        try:
            # of factors that are not positive definite
            with np.errstate(over="ignore", invalid="ignore"):
                return self._attempt(step)
        except StepFailure as error:
            if self._surface.comm.rank == 0:
                log.info(
                    "%s: the step is tried again with incomplete factors of a larger diagonal",
                    error,
                )
        self._raised = True
        self._take(Inverse(self._blocks, self._layers, RAISED))
        return self._attempt(step)

    def _attempt(self, step: StepProblem) -> StepResult:
        """Return the step with the preconditioner that there is."""
        try:
            return self._solve(step) if step.slip0 is None else self._friction.solve(step)
        except PETSc.Error as error:
            if error.__cause__ is not None:
                # raised in one of our callbacks; PETSc before 3.22 passes it on
                raise error.__cause__ from None
            raise raised(self._name, error) from error

    @cached_property
    def _friction(self) -> Friction:
        """The solver of steps with friction."""
        settings = self._settings
        return Friction(
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
        return f"Iterative({self.kind})"

    def _solve(self, step: StepProblem) -> StepResult:
        settings, contact, layout = self._settings, self._contact, self._layout
        before = self.work.linear_iterations
        of = Search(
            step,
            layout.padded(step.b),
            contact,
            operator=self._operator,
            masked=self._masked,
            inverse=self._inverse,
            worth=self._worth,
            tolerance=settings.tolerance,
            patience=settings.patience,
        )
        x, residual, changes, reason = search(
            of, self._cg, layout.padded(step.guess), settings.changes
        )
        if reason == WRONG_SIGNS:
            self.work.fallbacks += 1
            if self._norm is None:
                self._norm = largest_eigenvalue(of, self._diagonal)
            x, residual, reason = projected_gradients(of, self._diagonal, self._norm, x)
        if reason != SOLVED:
            raise stopped(self._name, reason, self.work.linear_iterations - before, of.history)
        self._worth.keep()
        return StepResult(
            x=layout.stripped(x),
            r_n=contact.reactions(x, residual),
            active=contact.closed.copy(),
            iterations=changes,
            method=self._name,
            aim=settings.tolerance,
        )
