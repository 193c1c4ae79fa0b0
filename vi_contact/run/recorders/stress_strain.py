"""Record stress and strain at named points of a body that yields: their loops."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from ...core.algebra import Array, from_each
from ...core.checks import array, column_name, describe_point, instance
from ...core.errors import InputError
from ...core.internal import remembers
from ...core.problem import ContactProblem
from ...core.quantities import Unit
from ...core.step import Columns, Report, Row, State
from ...laws.mandel import PAIRS, ROOT

AXES = "xyz"


@dataclass
class StressStrain:
    """Record stress and strain of a body that yields: label -> point (d,) [m].

    The columns are stress_xx_<label>, stress_yy_<label>, stress_zz_<label>, stress_xy_<label> [Pa]
    and strain_xx_<label>, strain_yy_<label>, strain_xy_<label>, in space with the components of z
    too. Tension is positive; strain_xy is the engineering shear strain gamma_xy = 2 eps_xy. One
    over the other is a loop (``engineering.loop_damping``). Values are those of the point of
    integration that is nearest; ``places`` has it after ``start``: label -> (d,) [m].

    InputError if a label has other characters than letters, digits and underscores, a point is
    outside of the body, or the body does not yield.
    """

    points: Annotated[Mapping[Any, Sequence[float]], Unit("m")]

    def __post_init__(self) -> None:
        remedy = "give labels and points, {'middle': (x, y)}"
        instance("StressStrain", "points", self.points, Mapping, remedy)
        if not self.points:
            raise InputError(f"StressStrain: points is empty; {remedy}, or leave it out")
        for label, point in self.points.items():
            column_name("label of StressStrain", label)
            array("StressStrain", f"the point '{label}'", point, (None,), unit="metres")
        self._dimension = len(next(iter(self.points.values())))
        if any(len(point) != self._dimension for point in self.points.values()):
            raise InputError(
                "StressStrain: the points have different numbers of coordinates: give one for each "
                "dimension"
            )

    def columns(self) -> Columns:
        """Name stress_xx_<label> and the like."""
        columns: dict[str, tuple[str, str]] = {}
        stresses = [f"{axis}{axis}" for axis in AXES]
        strains = stresses[: self._dimension]
        shears = [f"{AXES[i]}{AXES[j]}" for i, j in PAIRS[4 if self._dimension == 2 else 6]]
        for label in self.points:
            for pair in [*stresses, *shears]:
                meaning = f"stress {pair} at the point of integration next to {label}"
                columns[f"stress_{pair}_{label}"] = ("Pa", f"{meaning}, tension positive")
            for pair in [*strains, *shears]:
                kind = "engineering shear strain" if pair in shears else "strain"
                meaning = f"{kind} {pair} at the point of integration next to {label}"
                columns[f"strain_{pair}_{label}"] = ("-", meaning)
        return columns

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Row:
        """Find the points of integration; return the row of the first state. Collective.

        Args:
            problem: what is marched.
            state: the first state.
            resumed: the last row of the run that is continued, None for a new run.

        Raises:
            InputError: the body does not yield, or a point is outside of it.
        """
        internal: Any = problem.system.internal
        if not remembers(internal) or not hasattr(internal, "tell"):
            raise InputError(
                "StressStrain is of materials that yield, and this body has none: leave it out, or "
                "take Probe"
            )
        space: Any = problem.system.space
        if self._dimension != space.dimension:
            raise InputError(
                f"a point of StressStrain has {self._dimension} coordinates: give {space.dimension}"
            )
        self._problem = problem
        self._comm = space.comm
        wanted = np.array(list(self.points.values()), dtype=float)
        for label, cell in zip(self.points, space.find_in_cells(wanted), strict=True):
            if cell is None:
                at = describe_point(np.asarray(self.points[label], dtype=float))
                raise InputError(
                    f"StressStrain: points['{label}'] at {at} is outside of the body; give a point "
                    "of it, or leave it out"
                )
        self._find_nearest(internal, wanted)
        return self._row(state)

    def _find_nearest(self, internal: Any, wanted: Array) -> None:
        """Find the nearest point of integration to each place, of the lowest rank. Collective.

        Args:
            internal: the body's force.
            wanted: the places (p, d) [m].
        """
        places = internal.points.places.reshape(-1, self._dimension)
        self._rows = np.zeros(len(wanted), dtype=np.int64)
        distances = np.full(len(wanted), np.inf)
        for k, place in enumerate(wanted):
            if len(places):
                apart = np.linalg.norm(places - place, axis=1)
                self._rows[k] = np.argmin(apart)
                distances[k] = apart.min()
        table = np.array(from_each(self._comm, distances))
        self._own = np.argmin(table, axis=0) == self._comm.rank
        own = np.zeros((len(wanted), self._dimension))
        own[self._own] = places[self._rows[self._own]]
        found = self._comm.sum(own)
        self.places = dict(zip(self.points, found, strict=True))

    def row(self, report: Report) -> Row:
        """Return the row of the step that ``report`` tells of."""
        return self._row(report.new)

    def _row(self, state: State) -> Row:
        """Return the row of a state. Collective."""
        problem = self._problem
        internal: Any = problem.system.internal
        standing = internal.go_on(state.memory, problem.cartesian(state.u))
        d = self._dimension
        sigma = self._share(standing.tell("stress"))
        eps = self._share(standing.tell("strain"))
        # From Mandel's components, √2 times those of the tensor: tau, and gamma = 2 eps_xy.
        sigma[:, 3:] /= ROOT
        eps[:, 3:] *= ROOT
        values = np.hstack([sigma, eps[:, :d], eps[:, 3:]])
        return dict(zip(self.columns(), values.ravel().tolist(), strict=True))

    def _share(self, values: Array) -> Array:
        """Return the rows (p, n) of the points on all ranks. Collective."""
        own = np.zeros((len(self._own), values.shape[1]))
        own[self._own] = values[self._rows[self._own]]
        return self._comm.sum(own)
