"""Record compressible water before a dam: its energy, what leaves it, and its push on the face."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.algebra import Array
from ...core.arguments import check_fields
from ...core.errors import InputError
from ...core.problem import ContactProblem
from ...core.step import AXES, Columns, Report, Row, State

_FORCE = "force of the moving water on the face along {}, mean of the step, without that at rest"
_SUMS = ("loss_radiated", "loss_bottom")


@dataclass
class ReservoirWater:
    """Record the water of ``fem.Reservoir(model="acoustic")``.

    The columns of ``Energy`` contain all of it: energy_water is a part of its kinetic and strain
    energy, loss_radiated + loss_bottom of loss_damping. With w of ``fem.body.acoustic_water``

        energy_water = ½ rho w'ᵀ Kp⁻¹ w' + ½ rho zᵀ Mp⁻¹ z,    p = rho Kp⁻¹ w''

    Velocities are relative to the ground, and p is that of the accelerations in space. p is the
    mean of the step, in the sense of the time scheme, and without the pressure at rest. The first
    row has none.

    Args:
        arrays: whether the pressures of the nodes of the face are recorded too.
    """

    arrays: bool = True

    def __post_init__(self) -> None:
        check_fields(self)

    def columns(self) -> Columns:
        """Name energy_water, loss_radiated, loss_bottom, water_force_x, … and face_pressure."""
        columns = {
            "energy_water": ("J", "kinetic energy and compression of the water"),
            "loss_radiated": ("J", "energy of waves that left at the far end since the start"),
            "loss_bottom": ("J", "energy of waves that left through the bottom since the start"),
            "water_force_x": ("N", _FORCE.format("x")),
            "water_force_y": ("N", _FORCE.format("y")),
        }
        if self.arrays:
            columns["face_pressure"] = (
                "Pa",
                "pressure of the moving water at the nodes of the face below the level, from the "
                "bottom up, mean of the step",
            )
        return columns

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Row:
        """Return the row of the first state. Collective.

        Args:
            problem: what is marched, with acoustic water.
            state: the first state.
            resumed: the last row of the run that is continued, None for a new run.

        Raises:
            InputError: the water is not compressible, or there is none.
        """
        water = getattr(problem.system.space, "water", None)
        if water is None:
            raise InputError(
                "ReservoirWater: the system has no compressible water: assemble it with "
                "fem.Reservoir(…, model='acoustic'), or leave the recorder out"
            )
        self._problem = problem
        self._water = water
        self._space: Any = problem.system.space
        self._sums = dict.fromkeys(_SUMS, 0.0)
        if resumed is not None:
            self._sums = {name: float(resumed[name]) for name in _SUMS}
        return self._make_row(state, np.zeros(len(water.face.below)))

    def row(self, report: Report) -> Row:
        """Return the row of the step that ``report`` tells of. Collective."""
        water = self._water
        equations = water.equations
        balance = report.balance
        # what outlets lose: the work of their dashpots, at the far end and on the bottom
        moved = water.own_values(report.new.u - report.old.u)
        lost = moved * equations.damping * water.own_values(balance.v)
        self._sums["loss_radiated"] += float(lost @ equations.at_end)
        self._sums["loss_bottom"] += float(lost @ (1.0 - equations.at_end))

        # p = rho Kp⁻¹ w'', with the accelerations in space
        t0, t1 = report.old.t, report.new.t
        nodal = self._space.expand(self._problem.cartesian(balance.a), 0.5 * (t0 + t1), 2)
        ground: Array = self._problem.ground_acceleration(t0)
        ground = 0.5 * (ground + self._problem.ground_acceleration(t1))
        ground[-1] = 0.0  # water does not rise with the ground
        volumes = water.find_volumes(nodal + ground)
        pressure = equations.of_face @ volumes
        pressure = pressure + equations.coupling @ water.own_values(balance.a)
        return self._make_row(report.new, pressure)

    def _make_row(self, state: State, pressure: Array) -> Row:
        """Return the row of a state. Collective.

        Args:
            state: whose energy counts.
            pressure: (b,) [Pa] at the nodes of the face below the level.
        """
        water = self._water
        row: dict[str, Any] = {"energy_water": self._compute_energy(state), **self._sums}
        force = water.find_force(pressure)
        row |= {f"water_force_{AXES[c]}": float(force[c]) for c in range(len(force))}
        if self.arrays:
            row["face_pressure"] = pressure
        return row

    def _compute_energy(self, state: State) -> float:
        """Return kinetic energy and compression of the water [J]. Collective."""
        water = self._water
        equations = water.equations
        nodal = self._space.expand(self._problem.cartesian(state.v), state.t, 1)
        volumes = water.find_volumes(nodal)
        v = water.own_values(state.v)
        u = water.own_values(state.u)
        kinetic = volumes @ equations.of_face @ volumes + v @ equations.mass @ v
        kinetic += 2.0 * volumes @ equations.coupling @ v
        return float(0.5 * (kinetic + u @ (equations.stiffness * u)))
