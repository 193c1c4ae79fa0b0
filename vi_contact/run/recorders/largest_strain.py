"""Record the largest shear strains of a run, which strain-compatible soil goes by."""

from collections.abc import Mapping

import numpy as np

from ...core.algebra import Array, largest
from ...core.errors import InputError
from ...core.problem import ContactProblem
from ...core.step import Columns, Report, Row, State
from ...fem.body.space import space_of
from ...fem.output.cell_strains import CellStrains


class LargestStrain:
    """Record the largest shear strain since the start.

    That of every cell is kept in ``values`` (owned cells,).

    gamma² = 2 dev(eps):dev(eps) of the mean eps of a cell, in the plane of the body or in space: in
    the plane the difference of the principal strains, in simple shear gamma_xy. Strains of the
    start, of gravity say, do not count. InputError for a run that is continued, and for a body on a
    line.
    """

    values: Array

    def columns(self) -> Columns:
        """Name largest_shear_strain."""
        return {"largest_shear_strain": ("-", "largest shear strain of any cell since the start")}

    def start(
        self, problem: ContactProblem, state: State, resumed: Mapping[str, float] | None = None
    ) -> Row:
        """Measure from this state on. Collective.

        Args:
            problem: what is marched.
            state: the first state.
            resumed: the last row of the run that is continued, None for a new run.

        Raises:
            InputError: the run is continued, or the body is on a line.
        """
        if resumed is not None:
            raise InputError(
                "LargestStrain does not know the strains before the checkpoint: run from the start"
            )
        self._problem = problem
        self._space = space_of("LargestStrain", problem.system)
        if self._space.dimension == 1:
            raise InputError("LargestStrain: a body on a line has no shear strain; leave it out")
        self._strains = CellStrains(self._space)
        self._begin = self._nodal(state)
        self.values = np.zeros(len(self._strains))
        return self._row(state)

    def row(self, report: Report) -> Row:
        """Return the row of the step that ``report`` tells of."""
        return self._row(report.new)

    def _nodal(self, state: State) -> Array:
        """Return the displacements of all nodes [m], as one row."""
        return self._space.expand(self._problem.cartesian(state.u), state.t).ravel()

    def _row(self, state: State) -> Row:
        """Take a state into the largest values, and return the largest of all cells."""
        d = self._space.dimension
        eps = self._strains.mean(self._nodal(state) - self._begin)
        # dev(eps):dev(eps) = eps:eps - tr(eps)²/d, which round-off may leave just below zero
        trace = np.sum(eps[:, :: d + 1], axis=1)
        square = 2.0 * (np.sum(eps**2, axis=1) - trace**2 / d)
        self.values = np.maximum(self.values, np.sqrt(np.maximum(square, 0.0)))
        return {"largest_shear_strain": largest(self._space.comm, self.values.max(initial=0.0))}
