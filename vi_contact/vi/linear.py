"""Solve A x = b between bounds by the volume route: one step of Newton's method, or a linear problem."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ..core.algebra import Array, EffectiveMatrix, total
from ..core.errors import StepFailure
from ..core.matrix_checks import SYMMETRIC, asymmetry
from ..core.step import StepProblem
from ..core.surfaces import empty_surface
from ..fem.communicators import MpiComm
from ..fem.petsc_algebra import PetscAlgebra, PetscMatrix, UnsymmetricAlgebra
from ..solvers.volume.route import Method, ReducedNewton, SemismoothNewton, TaoTron, Volume
from .forms import refused


def solve_linear(
    settings: Volume, methods: Sequence[Method], A: PetscMatrix, b: Array, lower: Array, upper: Array, start: Array,
    comm: MpiComm,
) -> tuple[Array, int, str]:
    """Return (x, iterations, name) of the first method that finds x, of those that suit A if none is given; StepFailure
    with what all said. Every unknown is the one of a contact condition. Collective."""
    numbers, tried = np.arange(A.rows), []
    symmetric = asymmetry(A, comm, PetscAlgebra(comm.mpi).first(A.rows) + numbers) <= SYMMETRIC
    if not methods:
        methods = (TaoTron(), ReducedNewton()) if symmetric else (ReducedNewton(), SemismoothNewton())
    elif isinstance(methods[0], TaoTron) and not symmetric:
        raise refused(f"{methods[0]} minimises, and the form is not symmetric, so there is nothing to minimise: leave "
                      "method out, or take ReducedNewton() or SemismoothNewton()")
    bAb, bb, some = (total(comm, one) for one in (b @ (A @ b), b @ b, np.any(start)))
    if bAb > 0.0 and not some:  # from nothing: along b as far as energy and bounds say, which tells the size of x
        start = np.clip(bb / bAb * b, lower, upper)
    zero, none = np.zeros(A.rows), np.zeros(A.rows, dtype=bool)
    surface = replace(empty_surface(comm, 1), owned=numbers, gap0=zero, compliance=zero, bilateral=none)
    matrix = EffectiveMatrix(A, (PetscAlgebra if symmetric else UnsymmetricAlgebra)(comm.mpi))
    step = StepProblem(matrix, b, upper, surface, 1.0, start, none, 0.0, 0, lower=lower)
    for method in methods:
        solver = replace(settings, method=method).prepare(matrix, surface, 1.0)
        try:
            found = solver.solve(step)
            return np.clip(found.x, lower, upper), found.iterations, type(method).__name__
        except StepFailure as failure:
            tried.append(str(failure))
        finally:
            solver.close()
    raise StepFailure("; ".join(tried))
