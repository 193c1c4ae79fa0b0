"""Record histories at points of the body."""

import logging
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from ...core.algebra import Array, Indices
from ...core.checks import array, column_name, describe_point, flag, instance, optional, provides
from ...core.errors import InputError
from ...core.problem import ContactProblem
from ...core.quantities import Unit
from ...core.step import AXES, Columns, Report, Row, State

log = logging.getLogger(__name__)
SAME = 1e-9  # of the size of the body: a point that is nearer to a node is at it


@dataclass(frozen=True)
class Places:
    """Hold the nodes that make the values at p points, and how much each of them weighs.

    Attributes:
        nodes: (p, n) numbers of nodes.
        weights: (p, n) their weights; of each point they add up to one.
        distances: (p,) how far from its point the value is taken [m].
    """

    nodes: Indices
    weights: Array
    distances: Array

    @classmethod
    def at_nodes(cls, nodes: Indices, distances: Array | None = None) -> "Places":
        """Return places at nodes (p,).

        Args:
            nodes: one for each point.
            distances: (p,) from the points [m], None where it does not matter.
        """
        distances = np.zeros(len(nodes)) if distances is None else distances
        return cls(np.asarray(nodes)[:, None], np.ones((len(nodes), 1)), distances)

    def interpolate(self, sampled: Array) -> Array:
        """Return values (p, d) at the points of those at the nodes (p n, d)."""
        table = sampled.reshape(*self.nodes.shape, -1)
        if table.shape[1] == 1:
            return np.asarray(table[:, 0])
        return np.einsum("pn,pnd->pd", self.weights, table)


@dataclass
class Probe:
    """Record histories at points of the body: label -> point (d,) [m].

    A point inside a cell has the value of the displacement's own interpolation there, Σ phi_i u_i,
    and one at a node that of the node. A point outside of the mesh, up to 5 % of the size of the
    body, and one of a body without cells, has the value of its nearest node. A warning tells the
    distance.

    The columns are u_x_<label>, u_y_<label> [m]; with ``velocity`` also v_x_<label> [m/s], after
    the impact law; with ``acceleration`` also a_x_<label> [m/s²], the *absolute* acceleration. This
    is the one of the step's equation of motion, without velocity jumps of the impact law, plus the
    mean ground acceleration of the step; row 0 has the ground's own. u and v are relative to the
    ground when an excitation shakes the body.

    ``nearest``: take the nearest node of every point; the log and the meaning of the columns tell
    its distance, as ``distances`` does after ``start``: label -> [m].

    ``cells``: the cell group (``fem.Cells``) that points are of: where two bodies touch, a point is
    at a node of both. None for the whole mesh; of several nodes at a place the one of least number
    counts then.

    InputError if a label has other characters than letters, digits and underscores, or a point is
    outside the body.
    """

    points: Annotated[Mapping[Any, Sequence[float]], Unit("m")]
    velocity: bool = False
    acceleration: bool = False
    nearest: bool = False
    cells: Any = None

    def __post_init__(self) -> None:
        instance("Probe", "points", self.points, Mapping, "give labels and points, {'top': (x, y)}")
        for name in ("velocity", "acceleration", "nearest"):
            flag("Probe", name, getattr(self, name))
        remedy = "give a cell group, such as tags['soil'], or leave it out"
        optional(provides, "Probe", "cells", self.cells, ("indices",), remedy)
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
        distances = getattr(self, "distances", {}) if self.nearest else {}
        places = {label: f"point {label}" for label in self.points}
        for label, distance in distances.items():
            places[label] += f", at the node {distance:.3g} m from it"
        return {
            f"{letter}_{axis}_{label}": (unit, f"{meaning} along {axis} at {places[label]}")
            for letter, (unit, meaning) in quantities.items()
            for label, point in self.points.items()
            for axis in AXES[: len(point)]
        }

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Row:
        """Find the nodes and their weights; return the row of the first state. Collective.

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
        self._places = self._find_places(problem, points)
        distances = self._places.distances.tolist()
        self.distances = dict(zip(self.points, distances, strict=True))
        self._tell_distances(problem)
        return self._row(
            state, lambda: np.tile(problem.ground_acceleration(state.t), (len(points), 1))
        )

    def _find_places(self, problem: ContactProblem, points: Array) -> Places:
        """Return the nodes that make the values at points (p, d) [m], and their weights.

        Collective.
        """
        space: Any = problem.system.space
        if not hasattr(space, "find_nearest"):  # of a user's own: where its nodes are is not known
            return Places.at_nodes(space.find_nodes(points))
        in_cells = hasattr(space, "find_in_cells") and not self.nearest
        chosen = None
        among = None
        if self.cells is not None:
            remedy = "leave cells out where bodies have no mesh"
            provides("Probe", "the system's space", space, ("find_nodes_of_cells",), remedy)
            chosen = self.cells.indices
            among = space.find_nodes_of_cells(chosen)
        nodes, distances = space.find_nearest(points, anywhere=True, among=among)
        distances[distances <= SAME * space.size] = 0.0
        away = np.flatnonzero(distances)

        # Points that are at no node are in a cell, or so near to the body that a node is meant:
        # others are refused.
        cells: list[tuple[Indices, Array] | None] = [None] * len(away)
        if in_cells and len(away):
            cells = space.find_in_cells(points[away], chosen)
        for k, cell in zip(away, cells, strict=True):
            if cell is None:
                self._refuse_outside(space, k, points[k], among)
        if not in_cells or not len(away):
            return Places.at_nodes(nodes, distances)

        # Rows of equal length: those of points at a node are filled up with weights of zero.
        width = max((len(cell[0]) for cell in cells if cell is not None), default=1)
        table = np.repeat(nodes[:, None], width, axis=1)
        weights = np.zeros(table.shape)
        weights[:, 0] = 1.0
        for k, cell in zip(away, cells, strict=True):
            if cell is not None:
                table[k], weights[k] = cell
                distances[k] = 0.0
        return Places(table, weights, distances)

    def _refuse_outside(self, space: Any, number: int, point: Array, among: Indices | None) -> None:
        """Raise InputError for a point that is not of the body, with its label. Collective.

        Args:
            space: of the body.
            number: of the point.
            point: (d,) [m].
            among: as of ``find_nearest``.
        """
        try:
            space.find_nearest(point[None], among=among)
        except InputError as error:
            label = list(self.points)[number]
            raise InputError(f"Probe: points['{label}']: {error}, or leave it out") from None

    def _tell_distances(self, problem: ContactProblem) -> None:
        """Say on rank 0 how far the nodes are that points take their values from."""
        if problem.surface.comm.rank:
            return
        level = logging.INFO if self.nearest else logging.WARNING
        why = "" if self.nearest else ", as it is in no cell"
        for label, distance in self.distances.items():
            if distance:
                log.log(
                    level,
                    "probe '%s' at %s takes the node that is %.3g m from it%s",
                    label,
                    describe_point(np.asarray(self.points[label], dtype=float)),
                    distance,
                    why,
                )

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
        """Return values (p, d) at the points.

        Args:
            x: displacements, velocities or accelerations (n,) in the basis of the nodal frames.
            t: the time [s], at which prescribed components are known.
            derivative: 0, 1 or 2, which of them x is.
        """
        sampled = self._problem.system.space.sample(
            self._problem.cartesian(x), self._places.nodes.ravel(), t, derivative
        )
        return self._places.interpolate(sampled)
