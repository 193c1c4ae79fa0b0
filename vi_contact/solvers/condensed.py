"""Eliminate everything but the contact unknowns.

This is the condensed route (docs/reference/sources.md [1], sections 3, 4).

With the one factorisation of A and the unit vectors E of the normal unknowns:

    x_free = A⁻¹ b                     the unilateral constraints ignored (problem 34)
    G = EᵀA⁻¹E (+ compliance/scale)    Delassus operator, the flexibility b~ of eq. 39; G⁻¹ is the
                                       matrix D~ of eq. 49
    q = bound - Eᵀx_free               gap that is left; z~ = D~ Eᵀx_free in eq. 49
    0 <= r ⊥ q + G r >= 0              the small problem: eq. 42 in r, eqs. 46, 49 in the
                                       displacements
    x = A⁻¹ (b - E r)

A step costs one forward and one backward substitution and the small problem, whatever the number of
contact changes: ``kernels.condensation``. With friction the tangential unknowns of the contact
points are kept too: ``friction.condensed``.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, Protocol

import numpy as np

from ..core.algebra import Array, EffectiveMatrix, Mask
from ..core.checks import instance, provides
from ..core.problem import ContactProblem
from ..core.products import freeze
from ..core.sizes import refuse_dense
from ..core.step import Answers, StepProblem, StepResult
from ..core.surfaces import ContactSurface
from ..core.timing import report_time
from ..kernels.condensation import Condensation, Last, condense
from .certified import check_laws
from .friction.condensed import CondensedFriction
from .friction.newton import FrictionNewton
from .friction.problem import FrictionMethod, inner_method
from .friction.slip_rate import RateIteration
from .normal.active_set import ActiveSet, PreparedSets
from .normal.lcp import LCPResult


class SmallMethod(Protocol):
    """Solve the small problem without friction: ActiveSet, Hildreth or Lemke."""

    def prepare(self, G: Array, bilateral: Mask) -> Any:
        """Check G (m, m) and factor or scale it, once for many right-hand sides.

        ``bilateral`` (m,) says which rows are bilateral.

        What it returns has ``solve(q, guess) -> LCPResult``, q (m,) the gaps without reactions and
        ``guess`` (m,).
        """


@dataclass(frozen=True)
class Condensed:
    """Condense each step onto its contact unknowns and solve this smaller problem.

    It does so on any number of ranks.

    ``method`` solves it without friction: ActiveSet, Hildreth or Lemke. ``friction_method`` solves
    it with friction: FrictionNewton, NSGS, FixedPoint or GivenForces. ``rates`` is the iteration
    around it for laws that depend on the slip rate. Matrices that are not symmetric need Lemke. For
    contact sets too large for a dense G use ``Iterative``.
    """

    method: SmallMethod = field(default_factory=ActiveSet)
    friction_method: FrictionMethod = field(default_factory=FrictionNewton)
    rates: RateIteration = field(default_factory=RateIteration)

    def __post_init__(self) -> None:
        remedy = "give ActiveSet(), Hildreth() or Lemke()"
        provides(
            "Condensed",
            "method",
            self.method,
            ("prepare",),
            remedy,
            lacks=("check", "carries_friction"),
        )
        inner_method("Condensed", "friction_method", self.friction_method)
        instance("Condensed", "rates", self.rates, RateIteration, "give RateIteration()")

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError for what the route cannot treat.

        This is friction without a tangential direction, or of a wrong number of values, more
        contact unknowns than a dense matrix suits, and matrices that are not symmetric unless the
        methods take them.
        """
        surface = problem.surface
        if problem.frictional:
            refuse_dense(
                f"Condensed() with {problem.friction}",
                surface.total * (1 + surface.tangents.shape[1]),
            )
        else:
            refuse_dense("Condensed()", surface.total)
        used = (self.method, self.friction_method) if problem.frictional else (self.method,)
        check_laws(
            "Condensed",
            problem,
            unsymmetric=all(getattr(one, "unsymmetric", False) for one in used),
        )

    def prepare(
        self, A: EffectiveMatrix, surface: ContactSurface, scale: float
    ) -> "PreparedCondensed":
        """Return what condenses A at its first step, which tells of friction.

        InputError for too many conditions.
        """
        refuse_dense("Condensed()", surface.total)
        return PreparedCondensed(self, A, surface, scale)


class PreparedCondensed:
    """Solve the condensed problem of one A. ``delassus`` is G (dense, equal on all ranks)."""

    def __init__(
        self, settings: Condensed, A: EffectiveMatrix, surface: ContactSurface, scale: float
    ) -> None:
        self._settings, self._A, self._surface, self._scale = settings, A, surface, scale
        self._rigid = surface.everywhere(surface.rigid)
        self._name = f"condensed {type(settings.method).__name__}" if surface.total else "linear"
        if surface.tangents.shape[1] == 0:
            self._normal  # noqa: B018  nothing rubs in one dimension

    @cached_property
    def _normal(self) -> tuple[Condensation, Any]:
        """A condensed onto the normal unknowns, and the method for the small problem."""
        made, bilateral = (
            self._condensed(frictional=False),
            self._surface.everywhere(self._surface.bilateral),
        )
        return made, self._settings.method.prepare(made.flexibility, bilateral)

    @report_time("condensing")
    def _condensed(self, *, frictional: bool) -> Condensation:
        """Return A condensed, with the compliance of the support in its flexibility."""
        made, surface = condense(self._A, self._surface, frictional=frictional), self._surface
        extra = surface.everywhere(surface.compliance) / self._scale
        normal = np.arange(surface.total) * (len(made.there) // max(surface.total, 1))
        made.flexibility[normal, normal] += extra
        return made

    @property
    def delassus(self) -> Array:
        """Return G of the normal unknowns."""
        return self._normal[0].flexibility

    @cached_property
    def friction(self) -> CondensedFriction:
        """Return the small problem with friction, made at the first step that has some."""
        method, rates = self._settings.friction_method, self._settings.rates
        return CondensedFriction(
            method, self._condensed(frictional=True), self._surface, rates=rates
        )

    def solve(self, step: StepProblem) -> StepResult:
        """Return x, r_n and the active set of a step."""
        if step.slip0 is not None and self._surface.total:
            return self.friction.solve(step, self._rigid)
        surface, (condensed, small), bound, guess = (
            self._surface,
            self._normal,
            step.bound,
            step.active,
        )
        if surface.comm.size > 1:
            bound, guess = surface.everywhere(np.column_stack([bound, guess])).T
            guess = guess > 0.0
        found: LCPResult = small.solve(bound - condensed.free(step.b), guess)
        x = condensed.answer(found.r, (found.r != 0.0) & self._rigid, bound)
        return StepResult(
            x, surface.mine(found.r), surface.mine(found.active), found.iterations, self._name
        )

    def solve_many(self, many: StepProblem, own: Callable[[int], StepProblem]) -> Answers | None:
        """Return the answers to the steps that are rows of ``many``; ``own`` makes one.

        None where this cannot be: on several ranks, without contact unknowns last in the factor,
        and with other methods than ActiveSet.
        """
        surface, rubs = self._surface, many.slip0 is not None and self._surface.total > 0
        condensed, small = (self.friction.condensed, None) if rubs else self._normal
        if surface.comm.size > 1 or not isinstance(condensed, Last):
            return None
        if rubs:
            return self.friction.solve_many(many, own, self._rigid)
        if not isinstance(small, PreparedSets):
            return None
        r, active, counts, failed = small.solve_many(
            many.bound - condensed.free(many.b), many.active
        )
        x = freeze(condensed.answer(r, (r != 0.0) & self._rigid, many.bound))
        return Answers(StepResult(x, r, active, 0, self._name), counts, failed)
