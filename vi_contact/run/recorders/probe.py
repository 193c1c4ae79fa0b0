"""Record histories at points of the body."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from ...core.algebra import Array, Indices
from ...core.checks import array, column_name, flag, instance
from ...core.errors import InputError
from ...core.problem import ContactProblem
from ...core.quantities import Unit
from ...core.step import AXES, Columns, Report, Row, State


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
        """Find the nodes; return the row of the first state. Collective.

        Args:
            problem: what is marched.
            state: the first state.
            resumed: the last row of the run that is continued, None for a new run.

        Raises:
            InputError: a point has another dimension than the body, or is outside it.
        """
        self._problem = problem
        dimension = problem.system.space.dimension
        points = np.array(list(self.points.values()), dtype=float)
        if points.shape[1] != dimension:
            raise InputError(f"a probe point has {points.shape[1]} coordinates: give {dimension}")
        self._nodes = self._find_nodes(problem, points)
        return self._row(
            state, lambda: np.tile(problem.ground_acceleration(state.t), (len(points), 1))
        )

    def _find_nodes(self, problem: ContactProblem, points: Array) -> Indices:
        """Return the nodes (p,) nearest to points (p, d) [m]."""
        return problem.system.space.find_nodes(points)

    def row(self, report: Report) -> Row:
        """Return the row of the step that ``report`` tells of."""

        def sample_acceleration() -> Array:
            """Return the absolute accelerations (p, d) [m/s²], which cost a balance."""
            ground = self._problem.ground_acceleration
            t_old = report.old.t
            t_new = report.new.t
            mean = 0.5 * (ground(t_old) + ground(t_new))
            return self._sample(report.balance.a, t_new, 2) + mean

        return self._row(report.new, sample_acceleration)

    def _row(self, state: State, acceleration: Callable[[], Array]) -> Row:
        """Return the row of a state; ``acceleration`` (p, d) [m/s²] is called if it is recorded."""
        values = [self._sample(state.u, state.t, 0)]
        if self.velocity:
            values.append(self._sample(state.v, state.t, 1))
        if self.acceleration:
            values.append(acceleration())
        return dict(zip(self.columns(), np.concatenate(values, axis=None).tolist(), strict=True))

    def _sample(self, x: Array, t: float, derivative: int) -> Array:
        """Return values (p, d) at the nodes.

        Args:
            x: displacements, velocities or accelerations (n,) in the basis of the nodal frames.
            t: the time [s], at which prescribed components are known.
            derivative: 0, 1 or 2, which of them x is.
        """
        return self._problem.system.space.sample(
            self._problem.cartesian(x), self._nodes, t, derivative
        )
