"""Change velocities after an impact: inelastic collision, velocity reversal, Newton's restitution, or a law of one's
own.

After each step a law says which normal velocity every contact condition shall have, and a reading says how the
velocity vector v is given it:

* ``ComponentReset`` sets the components, as the seed does. With a consistent mass this is not an impulse: its energy
  change ½ v⁻ᵀMv⁻ - ½ v⁺ᵀMv⁺ may have either sign and the ledger books it with its sign.
* ``MassProjection`` applies the impulse on the contact unknowns that produces them, the M-orthogonal projection
  v⁺ = v⁻ + M⁻¹Bᵀ(B M⁻¹Bᵀ)⁻¹(target - B v⁻); identical for lumped masses. It takes ½ (v⁻ - v⁺)ᵀM(v⁻ - v⁺) for target 0.

A law sees the velocity before the contact (the old state's) and the one the step left. Restitution refers to the
former: what the step leaves of the approach depends on when in the step the gap closed. The step's contact work and the
impact loss are therefore to be read together: what the step took beyond the collision, the law gives back. Restitution
here is a nodal law; on a fine mesh it has no macroscopic effect.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from ..core.algebra import Array, Factor, Indices, total
from ..core.checks import function, real, shown
from ..core.corners import with_open_faces
from ..core.errors import InputError
from ..core.protocols import Impact
from ..core.surfaces import ContactSurface
from ..core.system import SemiDiscreteSystem

STORED_ENTRIES = 200_000  # of M⁻¹Bᵀ over all ranks: beyond it a back-substitution is cheaper than the product


READING = "give ComponentReset() or MassProjection()"


class Reading(Protocol):
    """How a velocity vector is given prescribed normal velocities."""

    def __call__(self, system: SemiDiscreteSystem, surface: ContactSurface, v: Array, target: Array) -> Array: ...


@dataclass(frozen=True)
class ComponentReset:
    """The seed's literal rule: overwrite the normal components.

    At a corner with oblique faces of which some only are closed the velocity of the node changes along the normals of
    these, and with it the normal components on its other faces, as at any other node.
    """

    def __call__(self, system: SemiDiscreteSystem, surface: ContactSurface, v: Array, target: Array) -> Array:
        target = with_open_faces(surface, v, target)
        wanted = target[surface.slots]
        chosen = ~np.isnan(wanted)
        after = v.copy()
        after[surface.owned[chosen]] = wanted[chosen]
        return after


class MassProjection:
    """The M-orthogonal reading: an impulse on the chosen contact unknowns. Keeps the factor of M, and M⁻¹Bᵀ when it is
    small: one back-substitution per contact point at first, then one per impact or a dense product."""

    def __init__(self) -> None:
        self._system: SemiDiscreteSystem | None = None
        self._factor: Factor
        self._columns: Array | None = None
        self._delassus: Array = np.zeros((0, 0))

    def __repr__(self) -> str:
        return "MassProjection()"  # in logs, summaries and names of tests: without an address

    def _prepare(self, system: SemiDiscreteSystem, surface: ContactSurface) -> None:
        comm = system.algebra.comm
        self._factor = system.algebra.factor(system.M)
        columns = self._factor.solve_units(surface.owned, surface.slots, surface.count)
        rows = np.zeros((surface.count, surface.count))
        rows[surface.slots] = columns[surface.owned]
        self._delassus = comm.sum(rows)
        entries = total(comm, columns.size)
        self._columns = columns if entries <= STORED_ENTRIES else None
        self._system = system

    def __call__(self, system: SemiDiscreteSystem, surface: ContactSurface, v: Array, target: Array) -> Array:
        chosen: Indices = np.flatnonzero(~np.isnan(target))
        if len(chosen) == 0:
            return v
        if self._system is not system:
            self._prepare(system, surface)
        jump = target[chosen] - surface.normal_values(v)[chosen]
        impulse = np.zeros(surface.count)
        impulse[chosen] = np.linalg.solve(self._delassus[np.ix_(chosen, chosen)], jump)
        if self._columns is not None:
            return np.asarray(v + self._columns @ impulse)
        return np.asarray(v + self._factor.solve(surface.reaction_load(impulse, system.rows)))


@dataclass(frozen=True)
class NoImpact:
    """Velocities are left as the step computed them."""

    def target(self, impact: Impact) -> Array:
        return np.full(len(impact.v_n), np.nan)

    def apply(self, system: SemiDiscreteSystem, surface: ContactSurface, v: Array, target: Array) -> Array:
        return v


@dataclass(frozen=True)
class Inelastic:
    """v_n⁺ = 0 on every closed point: the seed's perfectly plastic collision."""

    reading: Reading = field(default_factory=ComponentReset)

    def __post_init__(self) -> None:
        function("Inelastic", "reading", self.reading, READING)

    def target(self, impact: Impact) -> Array:
        return np.where(impact.active, 0.0, np.nan)

    def apply(self, system: SemiDiscreteSystem, surface: ContactSurface, v: Array, target: Array) -> Array:
        return self.reading(system, surface, v, target)


@dataclass(frozen=True)
class Newton:
    """Newton's law v_n⁺ = -e v_n⁻ on points that have just closed; points that stay closed are left to the step.

    v_n⁻ is the velocity of approach before the step: a single mass rebounds with e times its speed at every dt.
    """

    e: float
    reading: Reading = field(default_factory=ComponentReset)

    def __post_init__(self) -> None:
        if not 0.0 <= real(self.e) <= 1.0:
            raise InputError(f"restitution coefficient e is {shown(self.e)}: give a number from 0 (inelastic) to 1 "
                             "(elastic)")
        function("Newton", "reading", self.reading, READING)

    def target(self, impact: Impact) -> Array:
        return np.where(impact.closing, -self.e * np.maximum(impact.before, 0.0), np.nan)

    def apply(self, system: SemiDiscreteSystem, surface: ContactSurface, v: Array, target: Array) -> Array:
        return self.reading(system, surface, v, target)


def Elastic(reading: Reading | None = None) -> Newton:
    """Make the law of velocity reversal, Newton's law with e = 1."""
    return Newton(1.0, ComponentReset() if reading is None else reading)
