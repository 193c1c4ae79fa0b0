"""Record the largest shear strains of a run, which strain-compatible soil goes by."""

from collections.abc import Mapping

import numpy as np
import ufl

from ...core.algebra import Array, largest
from ...core.errors import InputError
from ...core.problem import ContactProblem
from ...core.step import Columns, Report, Row, State
from .. import compat
from ..body.space import space_of
from ..matrices.petsc_algebra import PetscMatrix


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
        """Measure from this state on. Collective."""
        if resumed is not None:
            raise InputError(
                "LargestStrain does not know the strains before the checkpoint: run from the start"
            )
        self._problem = problem
        self._space = space_of("LargestStrain", problem.system)
        V = self._space.V
        d = self._space.dimension
        if d == 1:
            raise InputError("LargestStrain: a body on a line has no shear strain; leave it out")
        tensors = compat.lagrange(V.mesh, 0, (d, d), continuous=False)
        q = ufl.TestFunction(tensors)
        eps = ufl.sym(ufl.grad(ufl.TrialFunction(V)))
        self._integral = PetscMatrix(
            compat.assemble_matrix(compat.compile_form(ufl.inner(q, eps) * ufl.dx))
        )
        volumes = np.array(compat.assemble_vector(compat.compile_form(q[0, 0] * ufl.dx)).array_r)
        self._volumes = volumes.reshape(-1, d * d)[:, :1]
        self._order = compat.cell_blocks(tensors)[: len(self._volumes), 0]
        self._begin = self._nodal(state)
        self.values = np.zeros(len(self._volumes))
        return self._row(state)

    def row(self, report: Report) -> Row:
        """Return the row of the step that ``report`` tells of."""
        return self._row(report.new)

    def _nodal(self, state: State) -> Array:
        return self._space.expand(self._problem.cartesian(state.u), state.t).ravel()

    def _row(self, state: State) -> Row:
        d = self._space.dimension
        eps = (self._integral @ (self._nodal(state) - self._begin)).reshape(
            -1, d * d
        ) / self._volumes
        square = 2.0 * (np.sum(eps**2, axis=1) - np.sum(eps[:, :: d + 1], axis=1) ** 2 / d)
        self.values = np.maximum(self.values, np.sqrt(np.maximum(square, 0.0))[self._order])
        return {"largest_shear_strain": largest(self._space.comm, self.values.max(initial=0.0))}
