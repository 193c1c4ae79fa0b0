"""The condensed route: everything eliminated but the contact unknowns (seed 000, sections 3 and 4).

With the one factorisation of A and the unit vectors E of the normal unknowns:

    x_free = A⁻¹ b                     the unilateral constraints ignored (problem 34)
    G = EᵀA⁻¹E (+ compliance/scale)    Delassus operator, the flexibility b~ of eq. 39; G⁻¹ is the matrix D~ of eq. 49
    q = bound - Eᵀx_free               gap that is left; z~ = D~ Eᵀx_free in eq. 49
    0 <= r ⊥ q + G r >= 0              the small problem: eq. 42 in r, eqs. 46, 49 in the displacements
    x = A⁻¹ (b - E r)                  one more back-substitution, or a dense product with the stored A⁻¹E

A step costs one back-substitution, the small problem and the correction, whatever the number of contact changes.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any, Protocol

import numpy as np

from ..algebra import Array, Mask
from ..friction import refuse_friction
from ..step import ContactProblem, EffectiveMatrix, StepProblem, StepResult
from ..surfaces import ContactSurface
from .active_set import ActiveSet
from .lcp import LCPResult
from .mprgp import ProjectedCG

STORED_ENTRIES = 200_000  # of A⁻¹E over all ranks: beyond it a second back-substitution is cheaper than the product


class SmallMethod(Protocol):
    """A method for the small problem: ActiveSet, Hildreth or ProjectedCG."""

    def prepare(self, G: Any, bilateral: Mask) -> Any: ...


@dataclass(frozen=True)
class Condensed:
    """Boundary condensation with a method for the small problem; frictionless contact, any number of ranks.

    ``ProjectedCG`` never forms G: each of its products is a back-substitution, for contact sets too large to store.
    """

    method: SmallMethod = field(default_factory=ActiveSet)

    def check(self, problem: ContactProblem) -> None:
        """InputError when the problem has friction."""
        refuse_friction("Condensed", problem.friction)

    def prepare(self, A: EffectiveMatrix, surface: ContactSurface, scale: float) -> PreparedCondensed:
        """Factorises A and condenses it; once per time step size."""
        return PreparedCondensed(self, A, surface, scale)


class AppliedDelassus:
    """G as an operator: each product is one back-substitution. Nothing of size rows x m is stored."""

    def __init__(self, A: EffectiveMatrix, surface: ContactSurface, extra: Array) -> None:
        self._A, self._surface, self._extra = A, surface, extra
        self.shape = (surface.count, surface.count)

    def __matmul__(self, r: Array) -> Array:
        x = self._A.factor.solve(self._surface.reaction_load(r, self._A.matrix.rows))
        return self._surface.normal_values(x) + self._extra * r


class PreparedCondensed:
    """The condensed problem of one A. ``delassus`` and ``schur`` are G and D~ (dense, equal on all ranks)."""

    def __init__(self, settings: Condensed, A: EffectiveMatrix, surface: ContactSurface, scale: float) -> None:
        self._A, self._surface = A, surface
        self._columns: Array | None = None
        self._rigid = surface.compliance == 0.0
        self._name = f"condensed {type(settings.method).__name__}"
        A.factor  # noqa: B018  made here, so that the first step is not charged for it
        extra = surface.compliance / scale
        self.delassus: Any = None
        if surface.count == 0:
            return
        if isinstance(settings.method, ProjectedCG):
            self.delassus = AppliedDelassus(A, surface, extra)
        else:
            self.delassus = self._form(extra)
        self._small = settings.method.prepare(self.delassus, surface.bilateral)

    def _form(self, extra: Array) -> Array:
        """G, symmetrised; keeps A⁻¹E when it is small."""
        surface, m = self._surface, self._surface.count
        columns = self._A.factor.solve_units(surface.owned, surface.slots, m)
        rows = np.zeros((m, m))
        rows[surface.slots] = columns[surface.owned]
        G = surface.comm.sum(rows)
        entries = float(surface.comm.sum(np.array([float(columns.size)]))[0])
        self._columns = columns if entries <= STORED_ENTRIES else None
        return np.asarray(0.5 * (G + G.T) + np.diag(extra))

    @property
    def schur(self) -> Array:
        """D~ = G⁻¹: reactions of the contact points to unit normal displacements (eq. 49)."""
        return np.asarray(np.linalg.inv(self.delassus))

    def solve(self, step: StepProblem) -> StepResult:
        """x, r_n and the active set of a step."""
        x = self._A.factor.solve(step.b)
        if self._surface.count == 0:
            none = np.zeros(0)
            return StepResult(x, none, none.astype(bool), 0, "linear")
        small: LCPResult = self._small.solve(step.bound - self._surface.normal_values(x), step.active)
        if small.r.any():
            x = self._corrected(x, small.r, step)
        return StepResult(x, small.r, small.active, small.iterations, self._name)

    def _corrected(self, x: Array, r: Array, step: StepProblem) -> Array:
        """A⁻¹(b - E r); contact unknowns on a rigid support are put on their bound, which removes round-off only."""
        surface = self._surface
        if self._columns is not None:
            x = x - self._columns @ r
        else:
            x = self._A.factor.solve(step.b - surface.reaction_load(r, len(x)))
        closed = ((r != 0.0) & self._rigid)[surface.slots]
        x[surface.owned[closed]] = step.bound[surface.slots[closed]]
        return x
