"""Record gaps, pressures, forces and slip of the contact."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from ...core.algebra import Array, Mask, total
from ...core.arguments import check_fields
from ...core.corners import find_tangents
from ...core.joints import find_limit
from ...core.problem import ContactProblem
from ...core.step import AXES, Columns, Report, Row, State, find_slipping
from ...core.surfaces import ContactSurface
from .columns import expand_axes

# Column -> (unit, meaning). One with {axis} in its name is recorded once for each axis.
_CONTACT_COLUMNS: Columns = {
    "contact_uplift": ("-", "open share of the contact surface, by weight"),
    "contact_active": ("-", "number of closed contact points"),
    "contact_resultant": ("N", "sum of the normal reactions Σ r_n"),
    "contact_force_{axis}": ("N", "contact force on the body along {axis}, -Σ r_n n_{axis}"),
    "contact_{axis}": ("m", "{axis} of the point of action, Σ r_n {axis} / Σ r_n; nan while open"),
    "contact_min_gap": ("m", "smallest gap; nan without contact points"),
    "contact_max_pressure": ("Pa", "largest contact pressure; nan without contact points"),
    "pressure": ("Pa", "contact pressure r_n / weight of every contact point"),
    "gap": ("m", "gap of every contact point"),
    "active": ("-", "whether the contact point is closed"),
}
_FRICTION_COLUMNS: Columns = {
    "friction_force_{axis}": ("N", "friction force on the body along {axis}"),
    "contact_max_slip": (
        "m",
        "largest tangential displacement along the ground; nan without contact points",
    ),
    "friction_used": (
        "-",
        "share of the friction at rest that is used, Σ |r_t| / Σ limit(r_n); nan without a limit",
    ),
    "contact_slipping": (
        "-",
        "share of the closed points that slipped in the step; nan while open",
    ),
    "traction_t": (
        "Pa",
        "tangential reaction r_t / weight of every contact point, in its nodal tangents",
    ),
    "slip": ("m", "tangential displacement of every contact point, in its nodal tangents"),
}


def find_covered(surface: ContactSurface) -> Mask | None:
    """Return the conditions (m,) of this rank whose pressure counts among the largest. Collective.

    At ``uncovered`` points, in front of which there is little of the other side, r_n / weight is no
    pressure.

    Returns:
        The mask; None where all count, because no condition is uncovered, or all of all ranks are.
    """
    uncovered = surface.uncovered
    if uncovered is None:
        uncovered = np.zeros(surface.count, dtype=bool)
    left_out = total(surface.comm, np.count_nonzero(uncovered))
    return ~uncovered if 0 < left_out < surface.total else None


@dataclass
class Contact:
    """Record gaps, pressures, forces and slip of the contact.

    Reactions are mean or end values, as the scheme says.

    gap = gap0 - u_n, plus the shortening of a deformable support. pressure = r_n / weight; the
    largest is that of points that are covered (``ContactSurface.uncovered``). The force on the body
    is -Σ r_n n, and its point of action is Σ r_n X / Σ r_n (NaN while the contact is open). On rank
    0 the arrays (total,) have all conditions in the order of their numbers, as the points in
    ``history.h5``; on other ranks they are empty.

    With friction it also records the friction force on the body and the largest slip, which share
    of the friction is used, T/(mu N) of Coulomb's law, and which share of the closed points slipped
    in the step. Arrays (total, d - 1) are in the tangents of the nodal frames: traction_t = r_t /
    weight, the traction of the body on its support, and slip = B_t u, the tangential displacement
    on the support (of open points too).

    Ranks exchange a dozen numbers in each step. ``arrays=False`` leaves the arrays out, and then
    nothing is gathered.
    """

    arrays: bool = True
    # those of the problem, once it is started
    _axes = AXES
    _frictional = False
    # columns with arrays, in the order of ``_gather``
    _ARRAYS: ClassVar[tuple[str, ...]] = ("pressure", "gap", "active", "traction_t", "slip")

    def __post_init__(self) -> None:
        check_fields(self)

    def columns(self) -> Columns:
        """Name contact_uplift, contact_resultant, … and the arrays pressure, gap, active.

        Call ``start`` first.
        """
        columns = expand_axes(_CONTACT_COLUMNS, self._axes)
        if self._frictional:
            columns = {**columns, **expand_axes(_FRICTION_COLUMNS, self._axes)}
        if self.arrays:
            return columns
        return {name: about for name, about in columns.items() if name not in self._ARRAYS}

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Row:
        """Return the row of the initial contact: of a gravity stage, or open. Collective.

        Args:
            problem: what is marched.
            state: the first state.
            resumed: the last row of the run that is continued, None for a new run.
        """
        surface = problem.surface
        self._problem = problem
        self._frictional = problem.frictional
        self._axes = AXES[: surface.points.shape[1]]
        self._weight = total(surface.comm, surface.weights.sum())
        self._covered = find_covered(surface)
        self._numbers = [name for name in self.columns() if name not in self._ARRAYS]
        return self._row(state)

    def row(self, report: Report) -> Row:
        """Return the row of the step that ``report`` tells of."""
        slipping = find_slipping(report) if self._frictional else None
        return self._row(report.new, slipping)

    def _row(self, state: State, slipping: Mask | None = None) -> Row:
        """Return the row of a state. Collective.

        Values are listed in the order of the columns.

        Args:
            state: that of the end of a step, or the first one.
            slipping: (m,) which points slipped in the step; None where there was no step.
        """
        # What conditions of this rank have: gap, pressure and, with friction, traction and slip.
        surface = self._problem.surface
        r_n = state.r_n
        gap = surface.gap(state.t) - surface.normal_values(state.u)
        if not surface.plain:  # springs get shorter under pressure
            gap = gap + surface.compliance * r_n
        pressure = r_n / surface.weights
        rubbing = self._find_rubbing(state) if self._frictional else ()

        # Sums over the conditions of this rank, then of all ranks in one message: closed area and
        # number, Σ r_n, Σ r_n n, Σ r_n X.
        sums = [
            float(np.add.reduce(surface.weights[state.active])),
            float(np.count_nonzero(state.active)),
            float(np.add.reduce(r_n)),
            *(r_n @ surface.normals).tolist(),
            *(r_n @ surface.points).tolist(),
            *(self._sum_shares(state, slipping) if self._frictional else ()),
        ]
        if surface.comm.size > 1:
            sums = surface.comm.sum(np.array(sums)).tolist()
        closed, count, resultant, *vectors = sums
        pull = vectors[: len(self._axes)]
        moment = vectors[len(self._axes) : 2 * len(self._axes)]

        # Largest values: depth = -gap, pressure and slip. Moving obstacles also watch what lies
        # between the points.
        depth, highest, *farthest = self._find_largest(gap, pressure, *rubbing[1:])
        depth = max([depth, *(-watched.smallest(state.t) for watched in surface.watched)])

        values = [
            1.0 - closed / self._weight if self._weight else 1.0,
            int(count),
            resultant,
            *[0.0 - component for component in pull],  # not -component: no negative zeros
            *[component / resultant if resultant else np.nan for component in moment],
            -depth,
            highest,
        ]
        if self._frictional:
            used, limit, slid = vectors[2 * len(self._axes) :]
            values += [*self._sum_friction(state), *farthest]
            values.append(used / limit if limit > 0.0 else np.nan)
            values.append(slid / count if count else np.nan)
        row: dict[str, Any] = dict(zip(self._numbers, values, strict=True))
        if self.arrays:
            arrays = self._gather(pressure, gap, state.active, *rubbing)
            row.update(zip(self._ARRAYS, arrays, strict=False))  # without friction there are three
        return row

    def _gather(self, *arrays: Any) -> Sequence[Any]:
        """Return the arrays of all conditions on rank 0, by one message of each rank.

        They come as columns of one table: pressure, gap, active, and with friction the components
        of traction and slip.
        """
        if self._problem.surface.comm.size == 1:
            return arrays
        table = self._problem.surface.on_first(np.column_stack(arrays))
        pressure = table[:, 0]
        gap = table[:, 1]
        active = table[:, 2] > 0.0
        rubbing = np.hsplit(table[:, 3:], 2) if self._frictional else ()
        return [array.copy() for array in (pressure, gap, active, *rubbing)]

    def _find_largest(self, gap: Array, pressure: Array, *slip: Array) -> list[float]:
        """Return the largest depth, pressure and slip of all conditions; nan without any.

        Args:
            gap: of the conditions of this rank (m,) [m].
            pressure: the same (m,) [Pa].
            slip: one array (m, d - 1) [m] with friction, none without.
        """
        surface = self._problem.surface
        if not surface.total:
            return [np.nan] * (2 + len(slip))
        covered = pressure if self._covered is None else pressure[self._covered]
        own = [
            -gap.item(gap.argmin()) if len(gap) else -np.inf,  # item is faster than float(max())
            covered.item(covered.argmax()) if len(covered) else -np.inf,
        ]
        for vectors in slip:
            own.append(float(np.linalg.norm(vectors, axis=1).max()) if len(gap) else -np.inf)
        if surface.comm.size == 1:
            return own
        largest: list[float] = surface.comm.max(np.array(own)).tolist()
        return largest

    def _find_rubbing(self, state: State) -> tuple[Array, Array]:
        """Return tangential tractions [Pa] and slips [m], (m, d - 1) each."""
        surface = self._problem.surface
        slip = surface.slip(state.u, state.t)
        if state.r_t is None:
            return np.zeros_like(slip), slip
        return state.r_t / surface.weights[:, None], slip

    def _sum_shares(self, state: State, slipping: Mask | None) -> list[float]:
        """Return Σ |r_t| [N], Σ limit(r_n) [N] and how many closed points of this rank slipped.

        Args:
            state: whose reactions count.
            slipping: (m,) which points slipped, or None.
        """
        limit = find_limit(self._problem, state)
        used = 0.0 if state.r_t is None else float(np.linalg.norm(state.r_t, axis=1).sum())
        slid = 0 if slipping is None else np.count_nonzero(slipping & state.active)
        return [used, float(np.sum(limit)), float(slid)]

    def _sum_friction(self, state: State) -> list[float]:
        """Return the components [N] of the friction force on the body, -Σ r_t t. Collective."""
        surface = self._problem.surface
        system = self._problem.system
        if surface.traces is not None and state.r_t is not None:
            along = np.einsum("kdc,kc->d", find_tangents(surface), state.r_t)
            forces: list[float] = (0.0 - surface.comm.sum(along)).tolist()
            return forces
        load = surface.reaction_load(np.zeros(surface.count), system.rows, state.r_t)
        force = 0.0 - surface.comm.sum(system.influence.T @ surface.along_axes(load))
        return force.tolist()
