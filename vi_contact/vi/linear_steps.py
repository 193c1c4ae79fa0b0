"""Solve a linear problem between bounds, lower <= x <= upper with A x - b, by the methods of the volume route."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..core.algebra import Array, EffectiveMatrix, total
from ..core.errors import InputError, StepFailure
from ..core.matrix_checks import SYMMETRIC, asymmetry
from ..core.step import StepProblem
from ..core.surfaces import empty_surface
from ..fem.communicators import MpiComm
from ..fem.petsc_algebra import PetscAlgebra, PetscMatrix, UnsymmetricAlgebra
from ..solvers.volume.route import Method, ReducedNewton, SemismoothNewton, TaoTron, Volume
from .forms import refused
from .judged import Judged


def is_symmetric(A: PetscMatrix, comm: MpiComm) -> bool:
    """Say whether A is symmetric to round-off. Collective."""
    numbers = PetscAlgebra(comm.mpi).first(A.rows) + np.arange(A.rows)
    return asymmetry(A, comm, numbers) <= SYMMETRIC


class LinearSteps:
    """Solve the linear problems of one call of ``vi.solve`` one after another.

    ``methods``: those to try, in this order; those that suit A if none is given. A method that failed is tried last
    from then on: the tangents of one problem are alike."""

    def __init__(self, settings: Volume, methods: Sequence[Method], comm: MpiComm) -> None:
        self.settings, self.methods, self.comm = settings, list(methods), comm

    def solve(self, A: PetscMatrix, b: Array, lower: Array, upper: Array, start: Array) -> tuple[Array, int, str]:
        """Return (x, iterations, name of the method) of the first method that finds x; StepFailure with what all said.
        Every unknown is the one of a contact condition. Collective."""
        numbers, comm = np.arange(A.rows), self.comm
        symmetric = is_symmetric(A, comm)
        if not self.methods:
            self.methods = [TaoTron(), ReducedNewton()] if symmetric else [ReducedNewton(), SemismoothNewton()]
        elif isinstance(self.methods[0], TaoTron) and not symmetric:
            raise refused(f"{self.methods[0]} minimises, and the form is not symmetric, so there is nothing to "
                          "minimise: leave method out, or take ReducedNewton() or SemismoothNewton()")

        # A start from nothing: along b as far as energy and bounds say, which tells the solvers the size of x.
        bAb, bb, some = (total(comm, one) for one in (b @ (A @ b), b @ b, np.any(start)))
        if bAb > 0.0 and not some:
            start = np.clip(bb / bAb * b, lower, upper)

        # The problem as a step of a body whose every unknown is in contact, with obstacles on both sides.
        zero, none = np.zeros(A.rows), np.zeros(A.rows, dtype=bool)
        surface = replace(empty_surface(comm, 1), owned=numbers, gap0=zero, compliance=zero, bilateral=none)
        matrix = EffectiveMatrix(A, (PetscAlgebra if symmetric else UnsymmetricAlgebra)(comm.mpi))
        step = StepProblem(matrix, b, upper, surface, 1.0, start, none, 0.0, 0, lower=lower)

        failures = []
        for method in tuple(self.methods):
            solver = replace(self.settings, method=method).prepare(matrix, surface, 1.0)
            try:
                found = solver.solve(step)
                return np.clip(found.x, lower, upper), found.iterations, type(method).__name__
            except StepFailure as failure:
                failures.append(str(failure))
                self.methods.append(self.methods.pop(0))
            finally:
                solver.close()
        raise StepFailure("; ".join(failures))


def reduced_step(point: Judged) -> Array:
    """Return where one step leads with the unknowns held that lie on a bound which acts, and the others free:
    A_ii (x_i - x_i,k) = -F_i, then brought between the bounds; by LU, which asks nothing of A but that it is regular.
    This is a step of SNES VINEWTONRSLS. StepFailure where A_ii is singular. Collective."""
    x, F, comm = point.x, point.F, point.problem.comm
    held = ((x <= point.lower) & (F > 0.0)) | ((x >= point.upper) & (F < 0.0))
    algebra = UnsymmetricAlgebra(comm.mpi)
    try:
        step = algebra.factor(algebra.block(point.A, ~held)).solve(-F[~held])
    except InputError:
        raise StepFailure("the Jacobian is singular on the unknowns that are off their bounds") from None
    target = x.copy()
    target[~held] += step
    return np.clip(target, point.lower, point.upper)
