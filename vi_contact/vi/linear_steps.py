"""Solve a linear problem A x - b between bounds: one step of Newton's method.

    (A x - b)_i >= 0 where x_i = lower_i,    <= 0 where x_i = upper_i,    = 0 between

``LinearSteps`` asks the methods of the volume route, one after another. ``find_reduced_step`` needs
none of them: it takes the bounds that act as they are, and solves for the other unknowns.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..core.algebra import Array, EffectiveMatrix, total
from ..core.errors import InputError, StepFailure
from ..core.matrix_checks import SYMMETRIC, measure_asymmetry
from ..core.step import StepProblem
from ..core.surfaces import empty_surface
from ..fem.matrices.petsc_algebra import PetscAlgebra, PetscMatrix, UnsymmetricAlgebra
from ..fem.mesh.communicators import MpiComm
from ..solvers.volume.route import (
    Method,
    PreparedVolume,
    ReducedNewton,
    SemismoothNewton,
    TaoTron,
    Volume,
)
from .forms import make_error
from .judged import Judged


def is_symmetric(A: PetscMatrix, comm: MpiComm) -> bool:
    """Say whether A is symmetric to round-off. Collective."""
    numbers = PetscAlgebra(comm.mpi).first(A.rows) + np.arange(A.rows)
    return measure_asymmetry(A, comm, numbers) <= SYMMETRIC


class LinearSteps:
    """Solve the linear problems of a ``vi.Problem`` one after another.

    A method that failed is tried last from then on: the tangents of one answer are alike. PETSc's
    solvers are kept, as there is one matrix, whose entries change.

    Attributes:
        settings: options of PETSc, and the tolerance.
        given: the methods to try; those that suit A if there are none.
        failed: names of methods that have failed on the way to this answer.
        helps: whether no problem on this way was given up by all methods.
    """

    def __init__(self, settings: Volume, given: Sequence[Method], comm: MpiComm, rows: int) -> None:
        """Begin.

        Args:
            settings: options of PETSc, and the tolerance.
            given: the methods to try; those that suit A if there are none.
            comm: of the mesh.
            rows: number of the free unknowns of this rank.
        """
        self.settings = settings
        self.given = given
        self.comm = comm
        zero = np.zeros(rows)
        self._surface = replace(
            empty_surface(comm, 1),
            owned=np.arange(rows),
            gap0=zero,
            compliance=zero,
            bilateral=np.zeros(rows, dtype=bool),
        )
        self._matrix: EffectiveMatrix | None = None
        self._version = 0  # of the matrix
        # by method and whether the matrix is symmetric; and whose solver knows its present entries
        self._solvers: dict[tuple[str, bool], PreparedVolume] = {}
        self._current: set[tuple[str, bool]] = set()
        self.begin()

    def begin(self) -> None:
        """Begin the way to another answer."""
        self.failed: set[str] = set()
        self.helps = True

    def close(self) -> None:
        """Free PETSc's solvers. Collective."""
        for solver in self._solvers.values():
            solver.close()
        self._solvers.clear()

    def choose_methods(self, symmetric: bool) -> list[Method]:
        """Return the methods to try, in this order.

        Raises:
            InputError: the user's method does not suit A.
        """
        if self.given and isinstance(self.given[0], TaoTron) and not symmetric:
            raise make_error(
                f"{self.given[0]} minimises, and the form is not symmetric, so there is nothing to "
                "minimise: leave method out, or take ReducedNewton() or SemismoothNewton()"
            )
        suited: list[Method] = [ReducedNewton(), SemismoothNewton()]
        if symmetric:
            suited = [TaoTron(), ReducedNewton()]

        # The sort is stable: those that have failed go to the end, and all others stay in order.
        return sorted(self.given or suited, key=lambda method: type(method).__name__ in self.failed)

    def solve(self, point: Judged) -> tuple[Array, int, str]:
        """Return the answer of the first method that finds it. Collective.

        Args:
            point: has the matrix A, the right-hand side b, the bounds, and the x where to begin.

        Returns:
            x (n,), the iterations, and the name of the method.

        Raises:
            StepFailure: no method finds x; the error tells what each one said.
        """
        if point.equations.version != self._version:
            self._version = point.equations.version
            self._take_matrix(point.A)
        step = self._pose(point)

        # The first method that finds an answer has it.
        failures: list[str] = []
        for method in self.choose_methods(self._symmetric):
            name = type(method).__name__
            solver = self._prepare(method, name)
            if failures:
                solver.excuse_options()  # they were for the method before
            try:
                result = solver.solve(step)
                return np.clip(result.x, point.lower, point.upper), result.iterations, name
            except StepFailure as failure:
                failures.append(str(failure))
                self.failed.add(name)
        self.helps = False
        raise StepFailure("; ".join(failures))

    def _take_matrix(self, A: PetscMatrix) -> None:
        """Take the matrix, whose entries are new. Collective."""
        comm = self.comm
        self._symmetric = is_symmetric(A, comm)
        algebra = PetscAlgebra(comm.mpi) if self._symmetric else UnsymmetricAlgebra(comm.mpi)
        self._matrix = EffectiveMatrix(A, algebra)
        self._current.clear()

    def _prepare(self, method: Method, name: str) -> PreparedVolume:
        """Return PETSc's solver of a method, the one before where there is one. Collective."""
        assert self._matrix is not None
        key = (name, self._symmetric)
        if key not in self._solvers:
            settings = replace(self.settings, method=method)
            self._solvers[key] = settings.prepare(self._matrix, self._surface, 1.0)
        elif key not in self._current:
            self._solvers[key].renew()
        self._current.add(key)
        return self._solvers[key]

    def _pose(self, point: Judged) -> StepProblem:
        """Return the problem as a step of a body, every unknown of which is in contact.

        There are obstacles on both sides. Collective.
        """
        A = point.A
        b = point.b
        start = np.clip(point.x, point.lower, point.upper)

        # A start from nothing: along b to the minimum of ½ x·A x - b·x, between the bounds. It
        # tells the solvers the size of x.
        bAb = total(self.comm, b @ (A @ b))
        bb = total(self.comm, b @ b)
        has_start = total(self.comm, np.any(start)) > 0.0
        if bAb > 0.0 and not has_start:
            start = np.clip(bb / bAb * b, point.lower, point.upper)
        none = np.zeros(A.rows, dtype=bool)
        assert self._matrix is not None
        return StepProblem(
            self._matrix, b, point.upper, self._surface, 1.0, start, none, 0.0, 0, lower=point.lower
        )


def find_reduced_step(point: Judged) -> tuple[Array, int, str]:
    """Return where one step of Newton's method for the natural residual leads, as ``solve`` does.

    Where a bound holds an unknown in that residual, lower + F/J_ii >= x or x >= upper + F/J_ii, the
    step goes to the bound; the others are free:

        A_ff d_f = -F_f - A_fh d_h,    d_h = bound - x_h

    The residual falls along this direction, whatever the signs of the eigenvalues of A are. The
    target may lie beyond bounds. By LU; StepFailure where A_ff is singular. Reference: the active
    set step of M. Hintermüller, K. Ito and K. Kunisch, 2003, The primal-dual active set strategy as
    a semismooth Newton method. Collective.
    """
    x = point.x
    F = point.F
    comm = point.equations.comm

    # A step of Jacobi's method would lead to ``aim``. Unknowns that it would lead to a bound, or
    # beyond, are held by this bound: they go to it, and the others are solved for.
    aim = x - F / point.diagonal
    held = (aim <= point.lower) | (aim >= point.upper)
    step = np.where(held, np.clip(aim, point.lower, point.upper) - x, 0.0)
    right = -(F + point.A @ step)[~held]
    algebra = UnsymmetricAlgebra(comm.mpi)
    try:
        step[~held] = algebra.factor(algebra.block(point.A, ~held)).solve(right)
    except InputError:
        raise StepFailure(
            "the Jacobian is singular on the unknowns that are off their bounds"
        ) from None
    return x + step, 1, "reduced step"
