"""Eliminate everything but the contact unknowns: the condensed route.

See docs/reference/sources.md [1], sections 3, 4.

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
from functools import cached_property, partial
from typing import Any, NamedTuple, Protocol

import numpy as np
import scipy.sparse as sp

from ..core.algebra import Array, EffectiveMatrix, Mask, freeze
from ..core.checks import instance, provides
from ..core.problem import ContactProblem
from ..core.sizes import refuse_dense
from ..core.step import Answers, StepProblem, StepResult
from ..core.surfaces import ContactSurface
from ..core.timing import report_time
from ..kernels.bodies import CondensedBodies
from ..kernels.condensation import Condensation, CondensedLast, condense
from .certified import check_laws
from .condensed_passes import CondensedPasses
from .friction.condensed import CondensedFriction
from .friction.newton import FrictionNewton
from .friction.problem import FrictionMethod, check_inner_method
from .friction.slip_rate import RateIteration
from .normal.active_set import ActiveSet, PreparedSets
from .normal.lcp import LCPResult

SPARSE = 1000  # rows of G of conditions that are traces, from which on a sparse G is faster


class SmallMethod(Protocol):
    """Solve the small problem without friction: ActiveSet, Hildreth or Lemke."""

    def prepare(self, G: Array, bilateral: Mask) -> Any:
        """Check G (m, m) and factor or scale it, once for many right-hand sides.

        Args:
            G: the Delassus operator.
            bilateral: (m,) which rows are bilateral.

        Returns:
            What has ``solve(q, guess) -> LCPResult``, with q (m,) the gaps without reactions and
            guess (m,) the predicted contact set.
        """


@dataclass(frozen=True)
class Condensed:
    """Condense each step onto its contact unknowns and solve this smaller problem.

    It does so on any number of ranks. Matrices that are not symmetric need Lemke. For contact sets
    too large for a dense G use ``Iterative``.

    Attributes:
        method: solves it without friction: ActiveSet, Hildreth or Lemke.
        friction_method: solves it with friction: FrictionNewton, NSGS, FixedPoint or GivenForces.
        rates: the iteration around it for laws that depend on the slip rate.
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
        check_inner_method("Condensed", "friction_method", self.friction_method)
        instance("Condensed", "rates", self.rates, RateIteration, "give RateIteration()")

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError for what the route cannot treat. Collective.

        This is friction without a tangential direction, or of a wrong number of values, more
        contact unknowns than a dense matrix suits, and matrices that are not symmetric unless the
        methods take them.
        """
        surface = problem.surface
        methods: list[object] = [self.method]
        if problem.frictional:
            unknowns = surface.total * (1 + surface.tangents.shape[1])
            if not self.takes_bodies(surface):
                refuse_dense(f"Condensed() with {problem.friction}", unknowns)
            methods.append(self.friction_method)
        else:
            refuse_dense("Condensed()", surface.total)
        unsymmetric = all(getattr(method, "unsymmetric", False) for method in methods)
        check_laws("Condensed", problem, unsymmetric=unsymmetric)

    def prepare(
        self, A: EffectiveMatrix, surface: ContactSurface, scale: float
    ) -> "PreparedCondensed":
        """Return what condenses A at its first step, which tells of friction.

        Args:
            A: the effective matrix.
            surface: the contact surface.
            scale: of reactions, over which compliances are divided.

        Raises:
            InputError: for too many conditions.
        """
        refuse_dense("Condensed()", surface.total)
        return PreparedCondensed(self, A, surface, scale)

    def takes_bodies(self, surface: ContactSurface) -> bool:
        """Say whether steps with friction are condensed body by body, with a sparse G. Collective.

        That is where many conditions share unknowns, as those of a wall of stones do.

        Args:
            surface: the contact surface.
        """
        if surface.traces is None or not isinstance(self.friction_method, FrictionNewton):
            return False
        return surface.total * (1 + surface.tangents.shape[1]) >= SPARSE


class NormalProblem(NamedTuple):
    """Hold A condensed onto the normal unknowns, and the method for the small problem."""

    condensed: Condensation
    small: Any  # made by the method: PreparedLCP or its like


class PreparedCondensed:
    """Solve the condensed problem of one A.

    A is condensed onto the normal unknowns at the first step without friction, and onto normal and
    tangential ones at the first step with friction: most runs need one of both.
    """

    def __init__(
        self, settings: Condensed, A: EffectiveMatrix, surface: ContactSurface, scale: float
    ) -> None:
        """Note what is to be condensed: see ``Condensed.prepare``. Collective."""
        self._settings = settings
        self._A = A
        self._surface = surface
        self._scale = scale
        self._rigid = surface.everywhere(surface.rigid)
        self._name = f"condensed {type(settings.method).__name__}" if surface.total else "linear"
        self._normal: NormalProblem | None = None
        self._passes: CondensedPasses | None = None
        if surface.tangents.shape[1] == 0:
            self._condense_normal()  # in one dimension no step has friction

    def _condense_normal(self) -> "NormalProblem":
        """Condense A onto the normal unknowns, unless that is done, and return what it gave."""
        if self._normal is None:
            condensed = self._condense(frictional=False)
            bilateral = self._surface.everywhere(self._surface.bilateral)
            small = self._settings.method.prepare(condensed.flexibility, bilateral)
            self._normal = NormalProblem(condensed, small)
        return self._normal

    @report_time("condensing")
    def _condense(self, *, frictional: bool) -> Condensation:
        """Return A condensed, with the compliance of the support in its flexibility."""
        surface = self._surface
        traces = surface.traces
        condensed: Condensation
        if traces is not None and self._settings.takes_bodies(surface):
            condensed = CondensedBodies(self._A, traces, frictional=frictional)
        else:
            condensed = condense(self._A, surface, frictional=frictional)

        # A spring is in series with the body: its compliance adds to the flexibility of its normal
        # unknown. Contact unknowns stand condition by condition, the normal one first.
        compliance = surface.everywhere(surface.compliance) / self._scale
        unknowns_of_a_condition = len(condensed.movable) // max(surface.total, 1)
        normal = np.arange(surface.total) * unknowns_of_a_condition
        if isinstance(condensed, CondensedBodies):
            condensed.add_to_diagonal(normal, compliance)
            if not frictional:  # methods without friction take an array
                condensed.flexibility = condensed.flexibility.toarray()
        else:
            condensed.flexibility[normal, normal] += compliance
        return condensed

    @property
    def delassus(self) -> Array:
        """Return G of the normal unknowns: dense, equal on all ranks."""
        return self._condense_normal().condensed.flexibility

    @cached_property
    def friction(self) -> CondensedFriction:
        """Return the small problem with friction, made at the first step that has some."""
        settings = self._settings
        condensed = self._condense(frictional=True)
        return CondensedFriction(
            settings.friction_method, condensed, self._surface, rates=settings.rates
        )

    def solve(self, step: StepProblem) -> StepResult:
        """Return the answer to a step. Collective."""
        surface = self._surface
        if step.slip0 is not None and surface.total:
            return self.friction.solve(step, self._rigid)
        condensed, small = self._condense_normal()

        # Every rank solves the whole small problem, of the conditions of all ranks, so that nothing
        # is sent afterwards: all of them get the same r.
        bound = step.bound
        guess = step.active
        if surface.comm.size > 1:
            bound, guess = surface.everywhere(np.column_stack([bound, guess])).T
            guess = guess > 0.0

        # Forward substitution: Eᵀx_free; then q = bound - Eᵀx_free and the small problem.
        x_free = condensed.find_free_motion(step.b)  # keeps b for ``answer``
        answer: LCPResult = small.solve(bound - x_free, guess)

        # Backward substitution: x = A⁻¹(b - E r). Closed conditions on a rigid support go exactly
        # onto their bound, where they are but for rounding.
        x = condensed.answer(answer.r, (answer.r != 0.0) & self._rigid, bound)
        return StepResult(
            x,
            r_n=surface.mine(answer.r),
            active=surface.mine(answer.active),
            iterations=answer.iterations,
            method=self._name,
        )

    def make_passes(self, step: StepProblem) -> CondensedPasses:
        """Return what makes the passes of steps with a joint. Collective when first asked.

        Args:
            step: any step of this A, which tells of friction.
        """
        if self._passes is None:
            self._passes = self._prepare_passes(frictional=step.slip0 is not None)
        return self._passes

    def _prepare_passes(self, *, frictional: bool) -> CondensedPasses:
        """Return passes on normal unknowns or, with friction, on normal and tangential ones."""
        surface = self._surface
        springs = surface.everywhere(surface.compliance) / self._scale
        bilateral = surface.everywhere(surface.bilateral)
        if frictional and surface.total:
            friction = self.friction
            G: Any = friction.delassus
            if sp.issparse(G):  # the law of a joint needs its inverse
                refuse_dense("a joint in Condensed()", G.shape[0], instead="friction alone")
                G = G.toarray()
            compliance = np.zeros(len(G))
            compliance[:: len(compliance) // surface.total] = springs

            def rub(
                step: StepProblem, free: Array, near: Array | None, G: Array = G, small: Any = None
            ) -> Any:
                """Solve the small problem with friction, of this flexibility or another."""
                answer, held, values = friction.reactions(step, free, self._rigid, near, small)
                q = values.reshape(answer.r.shape) - free.reshape(answer.r.shape)
                moved = q + (G @ answer.r.ravel()).reshape(q.shape)
                found = (answer.r, moved, answer.active, answer.stick, held, values)
                return (*found, answer.iterations)

            def prepare_rub(G: Array) -> Any:
                """Return ``rub`` of another flexibility."""
                other = self._settings.friction_method.prepare(G, bilateral)
                return partial(rub, G=G, small=other)

            return CondensedPasses(
                friction.condensed,
                rub,
                G,
                compliance,
                surface,
                self._rigid,
                f"condensed {type(self._settings.friction_method).__name__}",
                prepare=prepare_rub,
            )
        condensed, small = self._condense_normal()
        G = condensed.flexibility

        def press(
            step: StepProblem, free: Array, near: Array | None, G: Array = G, small: Any = small
        ) -> Any:
            """Solve the small problem without friction, of this flexibility or another."""
            bound = surface.everywhere(step.bound)
            guess = surface.everywhere(step.active) if near is None else near[:, 0] > 0.0
            answer: LCPResult = small.solve(bound - free, guess)
            moved = (bound - free + G @ answer.r)[:, None]
            held = (answer.r != 0.0) & self._rigid
            closed = answer.active
            return answer.r[:, None], moved, closed, closed, held, bound, answer.iterations

        def prepare_press(G: Array) -> Any:
            """Return ``press`` of another flexibility."""
            return partial(press, G=G, small=self._settings.method.prepare(G, bilateral))

        return CondensedPasses(
            condensed,
            press,
            G,
            springs,
            surface,
            self._rigid,
            self._name,
            prepare=prepare_press,
        )

    def solve_many(self, many: StepProblem, own: Callable[[int], StepProblem]) -> Answers | None:
        """Return the answers to several steps of this A, which reads its factor once for all.

        Args:
            many: the steps; its arrays have a row for each.
            own: makes the step of one row.

        Returns:
            The answers; None where this cannot be: on several ranks, without contact unknowns last
            in the factor, and with other methods than ActiveSet. The steps are then solved one by
            one.
        """
        has_friction = many.slip0 is not None and self._surface.total > 0
        if has_friction:
            condensed = self.friction.condensed
        else:
            condensed, small = self._condense_normal()
        if self._surface.comm.size > 1 or not isinstance(condensed, CondensedLast):
            return None
        if has_friction:
            return self.friction.solve_many(many, own, self._rigid)
        if not isinstance(small, PreparedSets):
            return None

        # The same as in ``solve``, with a row for each step.
        gaps = many.bound - condensed.find_free_motion(many.b)
        r, active, counts, failed = small.solve_many(gaps, many.active)
        x = freeze(condensed.answer(r, (r != 0.0) & self._rigid, many.bound))
        return Answers(StepResult(x, r, active, 0, self._name), counts, failed)
