"""Listen to the loop: each recorder names its columns once and fills a row after every step.

Rows hold numbers (one column of ``history.csv`` each), equal on every rank, or arrays (HDF5 only),
those of rank 0. Displacements and velocities are those of the equations: relative to the ground
when an excitation shakes the body.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite
from typing import Annotated, Any, ClassVar

import numpy as np

from ..core.algebra import Array, Indices, Mask, total
from ..core.arguments import check_fields
from ..core.checks import array, column_name, flag, instance
from ..core.errors import InputError, StepFailure
from ..core.problem import ContactProblem
from ..core.quantities import Unit
from ..core.step import AXES, Columns, Report, Row, State
from ..core.surfaces import ContactSurface
from ..core.verify import Energies, energies, energy_balance

# Column -> (unit, meaning). One with {axis} in its name is recorded once for each axis.
_STEPS_COLUMNS: Columns = {
    "t": ("s", "time at the end of the step"),
    "k": ("-", "number of the step"),
    "iterations": ("-", "iterations of the solver in this step"),
    "certificate": ("-", "worst dimensionless residual of the inequality problem of this step"),
    "escalated": ("-", "1 when the step needed another solver than the first, else 0"),
    "a_g_{axis}": ("m/s²", "ground acceleration along {axis} at time t"),
}
_CONTACT_COLUMNS: Columns = {
    "contact_uplift": ("-", "uplift ratio: share of the contact surface, by weight, that is open"),
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
        "largest tangential displacement on the support; nan without contact points",
    ),
    "traction_t": (
        "Pa",
        "tangential reaction r_t / weight of every contact point, in its nodal tangents",
    ),
    "slip": ("m", "tangential displacement of every contact point, in its nodal tangents"),
}


def _named(columns: Columns, axes: str) -> Columns:
    """Return the columns with {axis} in their names and meanings filled in for each of the axes."""
    return {
        name.format(axis=one): (unit, meaning.format(axis=one))
        for name, (unit, meaning) in columns.items()
        for one in (axes if "{axis}" in name else "-")
    }


def refuse_overflow(row: Row) -> None:
    """Raise StepFailure for a number beyond those of the machine.

    It is infinite, or NaN in the energy ledger.
    """
    for name, value in row.items():
        if not isinstance(value, float) or isfinite(value):
            continue
        if np.isinf(value) or name.startswith(("energy_", "work_", "loss_")):
            raise StepFailure(
                f"step {row['k']} at t = {row['t']:.6g} s: {name} is {value}, too large for the "
                "machine: check the sizes and units of loads, motions and initial data"
            )


class Steps:
    """Record the columns of every run.

    They are time, step, iterations, certificate, escalation and ground acceleration.
    """

    _axes = AXES  # those of the problem, once it is started

    def columns(self) -> Columns:
        """Name t, k, iterations, certificate, escalated, a_g_x, and so on."""
        return _named(_STEPS_COLUMNS, self._axes)

    def _row(
        self, state: State, iterations: int = 0, certificate: float = 0.0, escalated: bool = False
    ) -> Row:
        ground = self._problem.ground_acceleration(state.t).tolist()
        values = (state.t, state.k, int(iterations), certificate, int(escalated), *ground)
        return dict(zip(self._names, values, strict=True))

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Row:
        """Return the initial row: no iterations and no certificate were needed, so zeros."""
        self._problem, self._axes = problem, AXES[: problem.system.influence.shape[1]]
        self._names = tuple(self.columns())
        return self._row(state)

    def row(self, report: Report) -> Row:
        """Return the row of the step that ``report`` tells of."""
        return self._row(
            report.new, report.result.iterations, report.certificate.worst, report.escalated
        )


class Energy:
    """Record the energy ledger of the run in joules. Works and losses are sums since the start.

        W_input + E(0) = E(t) + D_damping + D_contact + D_friction + D_impact + D_algorithmic -
        defect E = ½ vᵀMv + ½ uᵀKu of the free unknowns, with initial strains ½ vᵀMv + ½ uᵀKu -
        f_0·u + ½ ∫ eps_0 : C eps_0

    with f_0·u = ∫ C eps_0 : eps(u), so that E is ½ ∫ (eps - eps_0) : C (eps - eps_0) if supports
    are at zero. Rates of initial strains do work too. E has no energy that moved supports store by
    themselves: their pull -K U is a load. D_impact = ½ v⁻ᵀMv⁻ - ½ v⁺ᵀMv⁺ with its sign. W_input is
    the work of loads, inertia loads -M r a_g and prescribed motions. The defect is the summed work
    of the residual of the equation of motion; ``summary.json`` has its size over the largest energy
    or work. Each step costs three products, and damping and impacts cost one more each.
    """

    _COLUMNS: ClassVar[Columns] = {
        "energy_kinetic": ("J", "kinetic energy after the impact law, ½ vᵀMv"),
        "energy_strain": ("J", "strain energy ½ uᵀKu"),
        "work_input": ("J", "work of loads, ground motion and prescribed motions since the start"),
        "loss_damping": ("J", "work of viscous damping since the start"),
        "loss_contact": ("J", "work done on the support by the contact reactions since the start"),
        "loss_friction": ("J", "work of friction since the start"),
        "loss_impact": ("J", "kinetic energy taken by the impact law since the start, signed"),
        "loss_algorithmic": ("J", "numerical dissipation of the time scheme since the start"),
        "energy_defect": ("J", "what the ledger cannot explain since the start"),
    }
    _SUMS = tuple(_COLUMNS)[2:]

    def columns(self) -> Columns:
        """Name energy_kinetic, energy_strain, work_input, loss_*, energy_defect."""
        return self._COLUMNS

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Row:
        """Return the initial energies.

        Works and losses are zero, or those of the run that is continued.
        """
        self._problem = problem
        self._now, self._stored = (
            energies(problem.equations, state.u, state.v),
            self._of_strains(state),
        )
        self._sums = {term: 0.0 if resumed is None else float(resumed[term]) for term in self._SUMS}
        return self._row()

    def _row(self) -> Row:
        return {
            "energy_kinetic": self._now.kinetic,
            "energy_strain": self._now.strain + self._stored,
            **self._sums,
        }

    def _of_strains(self, state: State) -> float:
        """Return what initial strains add to ½ uᵀKu [J]."""
        initial = getattr(getattr(self._problem.system.space, "forms", None), "initial", None)
        return (
            0.0
            if initial is None
            else float(initial.energy(self._problem.cartesian(state.u), state.t))
        )

    def row(self, report: Report) -> Row:
        """Return the row of the step that ``report`` tells of."""
        system, new = self._problem.equations, report.new
        end = new if new.v is report.v_minus else new.with_velocity(report.v_minus)
        with np.errstate(over="ignore", invalid="ignore"):  # refuse_overflow tells of it
            free = energies(system, new.u, report.v_minus)
            step = energy_balance(
                self._problem, report.old, end, report.balance, before=self._now, after=free
            )
            self._now = free
            if new.v is not report.v_minus:  # the impact law changed it; displacements do not jump
                momentum = system.product("M", new.v)
                kinetic = 0.5 * system.algebra.dot(new.v, momentum)
                self._now = Energies(momentum, free.elastic, kinetic, free.strain)
        impact, before, self._stored = (
            free.kinetic - self._now.kinetic,
            self._stored,
            self._of_strains(new),
        )
        work = step.input + (self._stored - before)
        losses = (
            work,
            step.damping,
            step.contact,
            step.friction,
            impact,
            step.algorithmic,
            step.defect,
        )
        for term, loss in zip(self._SUMS, losses, strict=True):
            self._sums[term] += loss
        return self._row()


def told_pressures(surface: ContactSurface) -> Mask | None:
    """Return the conditions (m,) of this rank whose pressure counts among the largest.

    It is None for all of them.

    Where all on all ranks are ``uncovered`` all count. Collective.
    """
    uncovered = (
        np.zeros(surface.count, dtype=bool) if surface.uncovered is None else surface.uncovered
    )
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

    With friction it also records the friction force on the body, the largest slip, and arrays
    (total, d - 1) in the tangents of the nodal frames: traction_t = r_t / weight, the traction of
    the body on its support, and slip = B_t u, the tangential displacement on the support (of open
    points too).

    Ranks exchange a dozen numbers in each step. ``arrays=False`` leaves the arrays out, and then
    nothing is gathered.
    """

    arrays: bool = True
    _axes, _frictional = AXES, False  # those of the problem, once it is started
    _ARRAYS: ClassVar[tuple[str, ...]] = ("pressure", "gap", "active", "traction_t", "slip")

    def __post_init__(self) -> None:
        check_fields(self)

    def columns(self) -> Columns:
        """Name contact_uplift, contact_resultant, … and the arrays pressure, gap, active.

        Call ``start`` first.
        """
        every = _named(_CONTACT_COLUMNS, self._axes)
        if self._frictional:
            every = {**every, **_named(_FRICTION_COLUMNS, self._axes)}
        return {
            name: about for name, about in every.items() if self.arrays or name not in self._ARRAYS
        }

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Row:
        """Return the row of the initial contact: of a gravity stage, or open."""
        surface, self._problem, self._frictional = problem.surface, problem, problem.frictional
        self._axes = AXES[: surface.points.shape[1]]
        self._weight = total(surface.comm, surface.weights.sum())
        self._told = told_pressures(surface)
        self._numbers = [name for name in self.columns() if name not in self._ARRAYS]
        return self._row(state)

    def row(self, report: Report) -> Row:
        """Return the row of the step that ``report`` tells of."""
        return self._row(report.new)

    def _row(self, state: State) -> Row:
        surface, d, r_n = self._problem.surface, len(self._axes), state.r_n
        gap, added = surface.gap(state.t) - surface.normal_values(state.u), np.add.reduce
        gap = gap if surface.plain else gap + surface.compliance * r_n
        pressure, rubbing = r_n / surface.weights, self._rubbing(state) if self._frictional else ()
        sums = [
            float(added(surface.weights[state.active])),
            float(np.count_nonzero(state.active)),
            float(added(r_n)),
            *(r_n @ surface.normals).tolist(),
            *(r_n @ surface.points).tolist(),
        ]
        sums = sums if surface.comm.size == 1 else surface.comm.sum(np.array(sums)).tolist()
        closed, count, resultant, *vectors = sums
        # not -one: no negative zeros
        force, place = ([0.0 - one for one in vectors[:d]], vectors[d:])
        depth, highest, *farthest = self._largest(gap, pressure, *rubbing[1:])
        depth = max([depth, *(-one.smallest(state.t) for one in surface.watched)])
        values = [
            1.0 - closed / self._weight if self._weight else 1.0,
            int(count),
            resultant,
            *force,
            *[one / resultant if resultant else np.nan for one in place],
            -depth,
            highest,
        ]
        values += [*self._friction_force(state), *farthest] if self._frictional else []
        row: dict[str, Any] = dict(zip(self._numbers, values, strict=True))
        if self.arrays:
            row.update(
                zip(self._ARRAYS, self._whole(pressure, gap, state.active, *rubbing), strict=False)
            )
        return row

    def _whole(self, *each: Any) -> Sequence[Any]:
        """Return the arrays of all conditions on rank 0, by one message of each rank."""
        if self._problem.surface.comm.size == 1:
            return each
        found = self._problem.surface.on_first(np.column_stack(each))
        rubbing = np.hsplit(found[:, 3:], 2) if self._frictional else ()
        return [part.copy() for part in (found[:, 0], found[:, 1], found[:, 2] > 0.0, *rubbing)]

    def _largest(self, gap: Array, pressure: Array, *slip: Array) -> list[float]:
        """Return the largest depth, pressure and slip of all conditions; nan without any."""
        if not self._problem.surface.total:
            return [np.nan] * (2 + len(slip))
        some = len(gap) > 0
        told = pressure if self._told is None else pressure[self._told]
        tops = [
            -gap.item(gap.argmin()) if some else -np.inf,
            told.item(told.argmax()) if len(told) else -np.inf,
        ]
        tops += [float(np.linalg.norm(one, axis=1).max()) if some else -np.inf for one in slip]
        return (
            tops
            if self._problem.surface.comm.size == 1
            else self._problem.surface.comm.max(np.array(tops)).tolist()
        )

    def _rubbing(self, state: State) -> tuple[Array, Array]:
        """Tangential tractions and slips (m, d - 1)."""
        surface = self._problem.surface
        slip = surface.slip(state.u, state.t)
        return (
            np.zeros_like(slip) if state.r_t is None else state.r_t / surface.weights[:, None]
        ), slip

    def _friction_force(self, state: State) -> list[float]:
        surface, system = self._problem.surface, self._problem.system
        load = surface.reaction_load(np.zeros(surface.count), system.rows, state.r_t)
        force = 0.0 - surface.comm.sum(system.influence.T @ surface.along_axes(load))
        return force.tolist()


@dataclass
class Probe:
    """Record histories at points of the body, each at its nearest node: label -> point (d,) [m].

    The columns are u_x_<label>, u_y_<label> [m]; with ``velocity`` also v_x_<label> [m/s], after
    the impact law; with ``acceleration`` also a_x_<label> [m/s²], the *absolute* acceleration. This
    is the one of the step's equation of motion, without velocity jumps of the impact law, plus the
    mean ground acceleration of the step; row 0 has the ground's own. u and v are relative to the
    ground when an excitation shakes the body.

    InputError if a label has other characters than letters, digits and underscores, or a point is
    outside the body.
    """

    points: Annotated[Mapping[Any, Sequence[float]], Unit("m")]
    velocity: bool = False
    acceleration: bool = False

    def __post_init__(self) -> None:
        instance("Probe", "points", self.points, Mapping, "give labels and points, {'top': (x, y)}")
        for name in ("velocity", "acceleration"):
            flag("Probe", name, getattr(self, name))
        if not self.points:
            raise InputError(
                "Probe: points is empty; give labels and points, {'top': (x, y)}, or leave it out"
            )
        for label, point in self.points.items():
            column_name("probe label", label)
            array("Probe", f"the point '{label}'", point, (None,), unit="metres")
        if len({len(point) for point in self.points.values()}) > 1:
            raise InputError(
                "the probe points have different numbers of coordinates: give one for each "
                "dimension"
            )

    def columns(self) -> Columns:
        """Name u_x_<label> and the like."""
        quantities = {"u": ("m", "displacement")}
        if self.velocity:
            quantities["v"] = ("m/s", "velocity after the impact law")
        if self.acceleration:
            quantities["a"] = ("m/s²", "absolute acceleration, mean of the step")
        return {
            f"{letter}_{axis}_{label}": (unit, f"{meaning} along {axis} at point {label}")
            for letter, (unit, meaning) in quantities.items()
            for label, point in self.points.items()
            for axis in AXES[: len(point)]
        }

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Row:
        """Find the nodes."""
        self._problem, dimension = problem, problem.system.space.dimension
        points = np.array(list(self.points.values()), dtype=float)
        if points.shape[1] != dimension:
            raise InputError(f"a probe point has {points.shape[1]} coordinates: give {dimension}")
        self._nodes = self._found(problem, points)
        return self._row(
            state, lambda: np.tile(problem.ground_acceleration(state.t), (len(points), 1))
        )

    def _found(self, problem: ContactProblem, points: Array) -> Indices:
        return problem.system.space.find_nodes(points)

    def row(self, report: Report) -> Row:
        """Return the row of the step that ``report`` tells of."""
        old, new, ground = report.old.t, report.new.t, self._problem.ground_acceleration
        return self._row(
            report.new,
            lambda: self._sample(report.balance.a, new, 2) + 0.5 * (ground(old) + ground(new)),
        )

    def _row(self, state: State, acceleration: Callable[[], Array]) -> Row:
        values = [self._sample(state.u, state.t, 0)]
        if self.velocity:
            values.append(self._sample(state.v, state.t, 1))
        if self.acceleration:
            values.append(acceleration())
        return dict(zip(self.columns(), np.concatenate(values, axis=None).tolist(), strict=True))

    def _sample(self, x: Array, t: float, derivative: int) -> Array:
        return self._problem.system.space.sample(
            self._problem.cartesian(x), self._nodes, t, derivative
        )
