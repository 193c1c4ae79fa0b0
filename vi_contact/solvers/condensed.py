"""Eliminate everything but the contact unknowns: the condensed route (docs/reference/sources.md [1], sections 3, 4).

With the one factorisation of A and the unit vectors E of the normal unknowns:

    x_free = A⁻¹ b                     the unilateral constraints ignored (problem 34)
    G = EᵀA⁻¹E (+ compliance/scale)    Delassus operator, the flexibility b~ of eq. 39; G⁻¹ is the matrix D~ of eq. 49
    q = bound - Eᵀx_free               gap that is left; z~ = D~ Eᵀx_free in eq. 49
    0 <= r ⊥ q + G r >= 0              the small problem: eq. 42 in r, eqs. 46, 49 in the displacements
    x = A⁻¹ (b - E r)                  one more back-substitution, or a dense product with the stored A⁻¹E

A step costs one back-substitution, the small problem and the correction, whatever the number of contact changes.
With friction the tangential unknowns of the contact points are kept too: ``friction.condensed``.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from ..core.algebra import Array, EffectiveMatrix, Mask, total
from ..core.checks import instance, on_all, provides
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.sizes import refuse_dense
from ..core.step import StepProblem, StepResult
from ..core.surfaces import ContactSurface
from .friction.condensed import CondensedFriction
from .friction.newton import FrictionNewton
from .friction.problem import FrictionMethod, inner_method
from .friction.slip_rate import RateIteration
from .normal.active_set import ActiveSet
from .normal.lcp import LCPResult

STORED_ENTRIES = 200_000  # of A⁻¹E over all ranks: beyond it a second back-substitution is cheaper than the product


class SmallMethod(Protocol):
    """Solve the small problem without friction: ActiveSet or Hildreth."""

    def prepare(self, G: Array, bilateral: Mask) -> Any:
        """Check G (m, m) and factor or scale it, once for many right-hand sides; ``bilateral`` (m,).

        What it returns has ``solve(q, guess) -> LCPResult``, q (m,) the gaps without reactions and ``guess`` (m,).
        """
        ...


@dataclass(frozen=True)
class Condensed:
    """Condense onto the contact unknowns, with a method for the small problem; with or without friction, any number of
    ranks.

    ``method`` solves it without friction: ActiveSet or Hildreth. ``friction_method`` solves it with friction:
    FrictionNewton, NSGS or FixedPoint, GivenForces or Uzawa; ``rates`` is the iteration around it for laws that depend
    on the slip rate. Contact sets too large for a dense G are for ``Iterative``.
    """

    method: SmallMethod = field(default_factory=ActiveSet)
    friction_method: FrictionMethod = field(default_factory=FrictionNewton)
    rates: RateIteration = field(default_factory=RateIteration)

    def __post_init__(self) -> None:
        remedy = "give ActiveSet() or Hildreth()"
        provides("Condensed", "method", self.method, ("prepare",), remedy, lacks=("check", "carries_friction"))
        inner_method("Condensed", "friction_method", self.friction_method)
        instance("Condensed", "rates", self.rates, RateIteration, "give RateIteration()")

    def check(self, problem: ContactProblem) -> None:
        """Raise InputError for friction without a tangential direction, or of a wrong number of values, and for more
        contact unknowns than a dense matrix suits."""
        surface = problem.surface
        if problem.frictional:
            refuse_dense(f"Condensed() with {problem.friction}", surface.total * (1 + surface.tangents.shape[1]))
        else:
            refuse_dense("Condensed()", surface.total)
        if problem.frictional and surface.tangents.shape[1] == 0:
            raise InputError(
                f"Condensed would ignore {problem.friction}: a body in one dimension cannot slide, use Frictionless()"
            )
        on_all(surface.comm, "the friction law",
               lambda: problem.friction.limit(np.zeros(surface.count), surface.weights, 1.0))

    def prepare(self, A: EffectiveMatrix, surface: ContactSurface, scale: float) -> PreparedCondensed:
        """Factorise A and condense it; once per time step size. InputError for more contact conditions than a dense
        matrix suits."""
        refuse_dense("Condensed()", surface.total)
        return PreparedCondensed(self, A, surface, scale)


class PreparedCondensed:
    """Solve the condensed problem of one A. ``delassus`` and ``schur`` are G and D~ (dense, equal on all ranks)."""

    def __init__(self, settings: Condensed, A: EffectiveMatrix, surface: ContactSurface, scale: float) -> None:
        self._settings, self._A, self._surface = settings, A, surface
        self._friction: CondensedFriction | None = None
        self._columns: Array | None = None
        self._rigid = surface.compliance == 0.0
        self._name = f"condensed {type(settings.method).__name__}"
        A.factor  # noqa: B018  made here, so that the first step is not charged for it
        extra = surface.everywhere(surface.compliance) / scale
        self.delassus: Array = np.zeros((0, 0))
        if surface.total:
            self.delassus = self._form(extra)
            self._small = settings.method.prepare(self.delassus, surface.everywhere(surface.bilateral))

    def _form(self, extra: Array) -> Array:
        """G, symmetrised; keeps A⁻¹E when it is small."""
        surface, A = self._surface, self._A
        keep = total(surface.comm, A.matrix.rows * surface.total) <= STORED_ENTRIES
        rows = None if keep else surface.owned
        columns = A.factor.solve_units(surface.owned, surface.slots, surface.total, rows)
        G = surface.everywhere(columns[surface.owned] if keep else columns)
        self._columns = columns if keep else None
        return np.asarray(0.5 * (G + G.T) + np.diag(extra))

    @property
    def schur(self) -> Array:
        """Return D~ = G⁻¹: reactions of the contact points to unit normal displacements (eq. 49)."""
        return np.asarray(np.linalg.inv(self.delassus))

    def solve(self, step: StepProblem) -> StepResult:
        """Return x, r_n and the active set of a step."""
        x, surface = self._A.factor.solve(step.b), self._surface
        if surface.total == 0:
            none = np.zeros(0)
            return StepResult(x, none, none.astype(bool), 0, "linear")
        if step.slip0 is not None:
            return self._with_friction(step, x)
        gap, guess = surface.everywhere(np.column_stack([step.bound - surface.normal_values(x), step.active])).T
        small: LCPResult = self._small.solve(np.ascontiguousarray(gap), guess > 0.0)
        if small.r.any():
            x = self._corrected(x, small.r, step)
        return StepResult(x, small.r[surface.slots], small.active[surface.slots], small.iterations, self._name)

    @property
    def friction(self) -> CondensedFriction:
        """Return the small problem with friction, made at the first step that has some."""
        if self._friction is None:
            method, rates, keep = self._settings.friction_method, self._settings.rates, self._columns is not None
            self._friction = CondensedFriction(method, self._A, self._surface, self.delassus, rates=rates, keep=keep)
        return self._friction

    def _with_friction(self, step: StepProblem, x: Array) -> StepResult:
        """The step with tangential reactions."""
        small, mine = self.friction.solve(step, x), self._surface.slots
        if small.r.any():
            x = self._corrected(x, small.r[:, 0], step, small.r[:, 1:])
            self.friction.hold_sticking(x, step, small)
        name, r = f"condensed {type(self._settings.friction_method).__name__}", small.r[mine]
        return StepResult(
            x, r[:, 0].copy(), small.active[mine], small.iterations, name, r_t=r[:, 1:].copy(), history=small.history
        )

    def _corrected(self, x: Array, r: Array, step: StepProblem, r_t: Array | None = None) -> Array:
        """A⁻¹(b - E r_n - F r_t) for the reactions of all ranks; unknowns on a rigid support are put on their bound,
        which removes round-off only."""
        surface, mine = self._surface, self._surface.slots
        if self._columns is None:
            along = None if r_t is None else r_t[mine]
            x = self._A.factor.solve(step.b - surface.reaction_load(r[mine], len(x), along))
        elif r_t is None:
            x = x - self._columns @ r
        else:
            x = x - self._columns @ r - self.friction.columns @ r_t.ravel()
        closed = (r[mine] != 0.0) & self._rigid
        x[surface.owned[closed]] = step.bound[closed]
        return x
