"""Solve a linear problem A x - b between bounds, lower <= x <= upper.

The methods are those of the volume route.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..core.algebra import Array, EffectiveMatrix, total
from ..core.errors import InputError, StepFailure
from ..core.matrix_checks import SYMMETRIC, asymmetry
from ..core.step import StepProblem
from ..core.surfaces import empty_surface
from ..fem.matrices.petsc_algebra import PetscAlgebra, PetscMatrix, UnsymmetricAlgebra
from ..fem.mesh.communicators import MpiComm
from ..solvers.volume.route import Method, ReducedNewton, SemismoothNewton, TaoTron, Volume
from .forms import refused
from .judged import Judged


def is_symmetric(A: PetscMatrix, comm: MpiComm) -> bool:
    """Say whether A is symmetric to round-off. Collective."""
    numbers = PetscAlgebra(comm.mpi).first(A.rows) + np.arange(A.rows)
    return asymmetry(A, comm, numbers) <= SYMMETRIC


class LinearSteps:
    """Solve the linear problems of one call of ``vi.solve`` one after another.

    ``given``: the methods to try; those that suit A if there are none. A method that failed is
    tried last from then on: the tangents of one problem are alike.
    """

    def __init__(self, settings: Volume, given: Sequence[Method], comm: MpiComm) -> None:
        self.settings, self.given, self.comm = settings, given, comm
        self.failed: set[str] = set()
        self.helps = True  # whether no problem so far was given up by all methods

    def methods(self, symmetric: bool) -> list[Method]:
        """Return the methods to try, in this order; InputError for one that does not suit A."""
        if self.given and isinstance(self.given[0], TaoTron) and not symmetric:
            raise refused(
                f"{self.given[0]} minimises, and the form is not symmetric, so there is nothing to "
                "minimise: leave method out, or take ReducedNewton() or SemismoothNewton()"
            )
        suited: list[Method] = (
            [TaoTron(), ReducedNewton()] if symmetric else [ReducedNewton(), SemismoothNewton()]
        )
        return sorted(self.given or suited, key=lambda method: type(method).__name__ in self.failed)

    def solve(
        self, A: PetscMatrix, b: Array, lower: Array, upper: Array, start: Array
    ) -> tuple[Array, int, str]:
        """Return (x, iterations, name of the method) of the first method that finds x.

        Every unknown is the one of a contact condition. Collective.

        Raises:
            StepFailure: no method finds x; it tells what all said.
        """
        numbers, comm = np.arange(A.rows), self.comm
        symmetric = is_symmetric(A, comm)
        methods = self.methods(symmetric)

        # A start from nothing: along b as far as energy and bounds say, which tells the solvers the
        # size of x.
        bAb, bb, some = (total(comm, one) for one in (b @ (A @ b), b @ b, np.any(start)))
        if bAb > 0.0 and not some:
            start = np.clip(bb / bAb * b, lower, upper)

        # The problem as a step of a body whose every unknown is in contact, with obstacles on both
        # sides.
        zero, none = np.zeros(A.rows), np.zeros(A.rows, dtype=bool)
        surface = replace(
            empty_surface(comm, 1), owned=numbers, gap0=zero, compliance=zero, bilateral=none
        )
        matrix = EffectiveMatrix(A, (PetscAlgebra if symmetric else UnsymmetricAlgebra)(comm.mpi))
        step = StepProblem(matrix, b, upper, surface, 1.0, start, none, 0.0, 0, lower=lower)

        failures: list[str] = []
        for method in methods:
            solver = replace(self.settings, method=method).prepare(matrix, surface, 1.0)
            if failures:
                solver.excuse_options()  # they were for the method before
            try:
                found = solver.solve(step)
                return np.clip(found.x, lower, upper), found.iterations, type(method).__name__
            except StepFailure as failure:
                failures.append(str(failure))
                self.failed.add(type(method).__name__)
            finally:
                solver.close()
        self.helps = False
        raise StepFailure("; ".join(failures))


def reduced_step(point: Judged) -> Array:
    """Return where one step of Newton's method for the natural residual leads.

    Where a bound holds an unknown in that residual, lower + F/J_ii >= x or x >= upper + F/J_ii, the
    step goes to the bound; the others are free:

        A_ff d_f = -F_f - A_fh d_h,    d_h = bound - x_h

    The residual falls along this direction, whatever the signs of the eigenvalues of A are. The
    target may lie beyond bounds. By LU; StepFailure where A_ff is singular. Reference: the active
    set step of M. Hintermüller, K. Ito and K. Kunisch, 2003, The primal-dual active set strategy as
    a semismooth Newton method. Collective.
    """
    x, F, comm = point.x, point.F, point.problem.comm
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
    return x + step
