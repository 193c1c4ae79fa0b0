"""Sum the inertia of a mass matrix."""

from __future__ import annotations

from typing import Any

import numpy as np
from fem_problems import BODIES, CONCRETE, block
from mpi4py import MPI

from vi_contact.core.obstacles import Touching
from vi_contact.core.problem import ContactProblem
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.contact.surface import contact_surface

FINER = BODIES | {
    "bar": {"lengths": (2.0,), "divisions": (12,)},
    "hexahedra": {"lengths": (2.0, 1.5, 1.2), "divisions": (7, 4, 4)},
    "tetrahedra": {
        "lengths": (2.0, 1.5, 1.2),
        "divisions": (7, 4, 4),
        "simplices": True,
        "angle": 0.4,
    },
}


def problem(
    name: str, comm: Any = MPI.COMM_WORLD, side: str = "left", **data: Any
) -> ContactProblem:
    """A free body of every cell type with one side in possible contact."""
    mesh, tags = block(comm, **FINER[name])
    system = assemble(mesh, CONCRETE)
    return ContactProblem(system, contact_surface(system, tags[side], obstacle=Touching()), **data)


def inertia(problem: ContactProblem) -> np.ndarray:
    """RᵀMR of the rigid motions about the origin, in 1D of translation and uniform stretch, with M
    of the equations."""
    system = problem.equations
    x, d = system.space.coordinates, problem.system.influence.shape[1]
    plain = problem.system.influence
    modes = [plain[:, c] for c in range(d)]
    modes += [plain[:, 0] * x[:, 0]] if d == 1 else []
    modes += [
        plain[:, j] * x[:, i] - plain[:, i] * x[:, j] for i in range(d) for j in range(i + 1, d)
    ]
    basis = problem.surface.basis
    R = np.column_stack([mode if basis is None else basis.transpose_apply(mode) for mode in modes])
    MR = np.column_stack([system.M @ mode for mode in R.T])
    return np.asarray(system.algebra.comm.sum(R.T @ MR))
