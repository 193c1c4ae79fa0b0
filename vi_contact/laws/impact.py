"""Change velocities after an impact: inelastic collision, velocity reversal, Newton's restitution.

After each step a law says which normal velocity every contact condition shall have, and an update
gives it to v:

* ``ComponentReset`` sets the components, as the boundary method does. With a consistent mass this
  is not an impulse: its energy change ½ v⁻ᵀMv⁻ - ½ v⁺ᵀMv⁺ may have either sign and the ledger books
  it with its sign.
* ``ImpulseUpdate`` applies the impulse on the contact unknowns that produces them, the M-orthogonal
  projection v⁺ = v⁻ + M⁻¹Bᵀ(B M⁻¹Bᵀ)⁻¹(target - B v⁻); identical for lumped masses. It takes ½ (v⁻
  - v⁺)ᵀM(v⁻ - v⁺) for target 0.

A law sees the velocity before the contact (the old state's) and the one the step left. Restitution
refers to the former: what the step leaves of the approach depends on when in the step the gap
closed. The step's contact work and the impact loss are therefore to be read together: what the step
took beyond the collision, the law gives back. Restitution here is a nodal law; on a fine mesh it
has no macroscopic effect.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Annotated, ClassVar, Protocol

import numpy as np
import scipy.sparse as sp

from ..core.algebra import Array, EffectiveMatrix, Indices, largest, max_abs, total
from ..core.arguments import check_fields
from ..core.checks import function
from ..core.corners import with_open_faces
from ..core.free_unknowns import solve_free
from ..core.protocols import Impact
from ..core.quantities import RATIO, Between
from ..core.sizes import is_small_problem
from ..core.surfaces import ContactSurface
from ..core.system import SemiDiscreteSystem
from ..core.traces import Traces
from ..kernels.condensation import condense

NEGLIGIBLE = 1e-17  # of the largest entry of a column of M⁻¹Bᵀ: what is left out
STORED = 20  # entries a row of M⁻¹Bᵀ: half a substitution reads more in two dimensions
# Problems in the plane are small up to so many times the unknowns of ``core.sizes``: their factors
# are sparse, and impacts come in every step.
IN_PLANE = 6
DEPENDENT = 1e-12  # of the largest singular value: impulses that have no effect
UPDATE_REMEDY = "give ComponentReset() or ImpulseUpdate()"


class VelocityUpdate(Protocol):
    """Give a velocity vector prescribed normal velocities; how it does so is the update's own."""

    def __call__(
        self, system: SemiDiscreteSystem, surface: ContactSurface, v: Array, target: Array
    ) -> Array:
        """Return the velocity (n,) [m/s] with the wanted normal velocities.

        Args:
            system: the equations that are marched.
            surface: the contact conditions.
            v: velocity (n,) [m/s] that the step left.
            target: wanted normal velocities (m,) [m/s], NaN where they stay as they are.
        """


@dataclass(frozen=True)
class ComponentReset:
    """Set the normal components: the literal rule of the boundary method.

    At a corner with oblique faces of which some only are closed the velocity of the node changes
    along the normals of these, and with it the normal components on its other faces, as at any
    other node. Where conditions share unknowns (``core.traces``) the unknowns that they read change
    as little as they can, each by the inverse of its diagonal entry of M, which keeps the sum of
    momenta of lumped masses.
    """

    by_rows: ClassVar[bool] = True

    def __call__(
        self, system: SemiDiscreteSystem, surface: ContactSurface, v: Array, target: Array
    ) -> Array:
        """Return the velocity with its normal components set; arguments of ``VelocityUpdate``."""
        if surface.traces is not None:
            return _reset_traces(system, surface, surface.traces, v, target)
        target = with_open_faces(surface, v, target)
        v_n = np.where(np.isnan(target), surface.normal_values(v), target)
        after = v.copy()
        after.T[surface.owned] = v_n.T
        return after


def _reset_traces(
    system: SemiDiscreteSystem, surface: ContactSurface, traces: Traces, v: Array, target: Array
) -> Array:
    """Return v + m⁻¹Bᵀ(B m⁻¹Bᵀ)⁻¹(target - B v) with m = diag M. Collective.

    Args:
        system: the equations that are marched.
        surface: the contact conditions.
        traces: their B.
        v: velocity (n,) [m/s] before, or rows (k, n).
        target: wanted normal velocities (m,) [m/s], NaN where they stay; or rows (k, m).
    """
    if v.ndim == 2:
        rows = zip(v, target, strict=True)
        return np.stack([_reset_traces(system, surface, traces, *row) for row in rows])
    jump = surface.everywhere(target - surface.normal_values(v))
    chosen = np.flatnonzero(~np.isnan(jump))
    light = np.zeros(len(traces.unknowns))
    light[traces.places] = 1.0 / system.M.diagonal()[traces.own]
    light = surface.comm.sum(light)

    # Normal traces that depend on one another share the impulse equally: least squares.
    B = traces.every[:: surface.points.shape[1]][chosen]
    flexibility = (B.multiply(light) @ B.T).toarray()
    impulse = np.linalg.lstsq(flexibility, jump[chosen], rcond=DEPENDENT)[0]
    after = v.copy()
    after[traces.own] += (light * (B.T @ impulse))[traces.places]
    return after


@dataclass(frozen=True)
class ImpulseUpdate:
    """Apply the impulse on the chosen contact unknowns that gives the wanted velocities.

    It is the M-orthogonal projection onto these. The system remembers M condensed onto the contact
    unknowns, and M⁻¹Bᵀ where it is sparse, as it decays to round-off within thirty elements; else
    an impact costs half a substitution (``kernels.condensation``). Large systems, from 50 000
    unknowns in space and 300 000 in the plane, are not factorised: M (v⁺ - v⁻) = 0 off the chosen
    unknowns, by conjugate gradients to round-off at every impact.
    """

    def __call__(
        self, system: SemiDiscreteSystem, surface: ContactSurface, v: Array, target: Array
    ) -> Array:
        """Return the velocity after the impulse; the arguments are those of ``VelocityUpdate``."""
        worth = IN_PLANE if surface.points.shape[1] == 2 else 1
        is_small = system.make_once(
            "small impacts",
            lambda: is_small_problem(surface.comm, system.rows, surface.count, worth=worth),
            surface,
        )
        is_small = is_small or surface.traces is not None
        update = _update_condensed if is_small else _update_by_iterations
        return update(system, surface, v, target)


def _update_by_iterations(
    system: SemiDiscreteSystem, surface: ContactSurface, v: Array, target: Array
) -> Array:
    """Return v after the impulse: M (v⁺ - v⁻) = 0 off the chosen unknowns. Collective.

    Args:
        system: the equations that are marched.
        surface: the contact conditions.
        v: velocity (n,) [m/s] that the step left.
        target: wanted normal velocities (m,) [m/s], NaN where they stay as they are.
    """
    chosen = ~np.isnan(target)
    unknowns = surface.owned[chosen]
    prescribed = np.zeros(len(v), dtype=bool)
    prescribed[unknowns] = True
    jump = np.zeros(len(v))
    jump[unknowns] = (target - surface.normal_values(v))[chosen]
    return v + solve_free(system.algebra, system.M, np.zeros(len(v)), prescribed, jump)


def _update_condensed(
    system: SemiDiscreteSystem, surface: ContactSurface, v: Array, target: Array
) -> Array:
    """Return v after the impulse, which is solved for on every rank. Collective.

    Args:
        system: the equations that are marched.
        surface: the contact conditions.
        v: velocity (n,) [m/s] that the step left.
        target: wanted normal velocities (m,) [m/s], NaN where they stay as they are.
    """
    jump = surface.everywhere(target - surface.normal_values(v))
    chosen: Indices = np.flatnonzero(~np.isnan(jump))
    if len(chosen) == 0:
        return v
    flexibility, respond = system.make_once(
        "impulse update", lambda: _condense_mass(system, surface), surface
    )
    impulse = np.zeros(surface.total)
    part = flexibility[np.ix_(chosen, chosen)]
    if surface.traces is None:
        impulse[chosen] = np.linalg.solve(part, jump[chosen])
    else:  # traces may depend on one another
        impulse[chosen] = np.linalg.lstsq(part, jump[chosen], rcond=DEPENDENT)[0]
    return np.asarray(v + respond(impulse))


def _condense_mass(
    system: SemiDiscreteSystem, surface: ContactSurface
) -> tuple[Array, Callable[[Array], Array]]:
    """Return the mass condensed onto the contact unknowns. Collective.

    Returns:
        B M⁻¹Bᵀ (total, total), and a function of impulses (total,) that gives the owned rows of
        M⁻¹Bᵀ times them.
    """
    comm = surface.comm
    condensed = condense(EffectiveMatrix(system.M, system.algebra), surface)

    # Store the columns of M⁻¹Bᵀ without what is round-off, as long as they take less memory than a
    # substitution reads; otherwise every impact makes a substitution.
    columns = []
    room = STORED * total(comm, system.rows)
    for impulse in np.eye(surface.total):
        column = condensed.respond(impulse)
        column[np.abs(column) < NEGLIGIBLE * largest(comm, max_abs(column))] = 0.0
        columns.append(sp.csr_matrix(column))
        room -= total(comm, columns[-1].nnz)
        if room < 0:
            return condensed.flexibility, condensed.respond
    stored = sp.csr_matrix(sp.vstack(columns).T) if columns else sp.csr_matrix((system.rows, 0))
    return condensed.flexibility, lambda impulse: np.asarray(stored @ impulse)


class ByUpdate:
    """Share what laws have in common that leave it to an update to change velocities.

    Attributes:
        update: how velocities are changed.
    """

    update: VelocityUpdate

    @property
    def by_rows(self) -> bool:
        """Say whether velocities and impacts may be rows, one for each of several runs."""
        return getattr(self.update, "by_rows", False)

    def apply(
        self, system: SemiDiscreteSystem, surface: ContactSurface, v: Array, target: Array
    ) -> Array:
        """Return the velocity (n,) [m/s] changed by ``update``.

        Args:
            system: the equations that are marched.
            surface: the contact conditions.
            v: velocity (n,) [m/s] that the step left.
            target: normal velocities (m,) [m/s], NaN where they stay as they are.
        """
        return self.update(system, surface, v, target)


@dataclass(frozen=True)
class Inelastic(ByUpdate):
    """Stop every closed point, v_n⁺ = 0: the perfectly plastic collision of the boundary method."""

    update: VelocityUpdate = field(default_factory=ComponentReset)

    def __post_init__(self) -> None:
        function("Inelastic", "update", self.update, UPDATE_REMEDY)

    def target(self, impact: Impact) -> Array:
        """Return zero at active conditions, NaN elsewhere."""
        return np.where(impact.active, 0.0, np.nan)


@dataclass(frozen=True)
class Newton(ByUpdate):
    """Apply Newton's law of restitution v_n⁺ = -e v_n⁻ on points that have just closed.

    Points that stay closed are left to the step. v_n⁻ is the velocity of approach before the step:
    a single mass rebounds with e times its speed at every dt.

    Attributes:
        e: restitution coefficient, from 0 (inelastic) to 1 (elastic).
        update: how velocities are changed.
    """

    e: Annotated[
        float,
        Between(0.0, 1.0, remedy="give a number from 0 (inelastic) to 1 (elastic)"),
        RATIO,
        "restitution coefficient e",
    ]
    update: VelocityUpdate = field(default_factory=ComponentReset)

    def __post_init__(self) -> None:
        function("Newton", "update", self.update, UPDATE_REMEDY)
        check_fields(self)

    def target(self, impact: Impact) -> Array:
        """Return -e v_n⁻ at conditions that have just closed, NaN elsewhere."""
        return np.where(impact.closing, -self.e * np.maximum(impact.before, 0.0), np.nan)


def Elastic(update: VelocityUpdate | None = None) -> Newton:
    """Make the law of velocity reversal, Newton's law with e = 1."""
    return Newton(1.0, ComponentReset() if update is None else update)
