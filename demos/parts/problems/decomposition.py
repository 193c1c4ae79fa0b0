"""Split the answer of a step with contact into two structures without contact.

See the boundary method, eqs. 34 to 36.

    A u = b - B_nᵀ r_n,     u_1 = A⁻¹ b,     u_2 = -A⁻¹ B_nᵀ r_n,     u = u_1 + u_2

A is the stiffness with the springs of the time step, b holds the loads and what the steps before
leave behind. The first structure has all loads and no reactions, the second one the reactions
alone: mu_N = -r_n of the source.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from vi_contact.core.algebra import Array, max_abs
from vi_contact.core.problem import ContactProblem
from vi_contact.core.step import Report


@dataclass(frozen=True)
class Decomposition:
    """Hold what a step adds up to.

    It is that at the nodes of the mesh in rows from the foot upwards, each from left to right.

    points, u, loaded, pressed: (n, 2) [m] places, displacement of the step, u_1 and u_2; contact,
    forces: (m, 2) places [m] of the conditions and forces on the body [N]; t [s]; defect: largest
    |u - u_1 - u_2| over the largest |u_1|.
    """

    points: Array
    u: Array
    loaded: Array
    pressed: Array
    contact: Array
    forces: Array
    t: float
    defect: float


def split(problem: ContactProblem, report: Report) -> Decomposition | None:
    """Split a step without friction whose unknowns are displacements; None but on rank 0.

    Collective.
    """
    step, result, surface = report.step, report.result, problem.surface
    space: Any = problem.system.space
    n = len(step.b)
    origin = np.zeros(n) if step.origin is None else step.origin
    parts = [
        origin + result.x,
        origin + step.A.factor.solve(step.b),
        -step.A.factor.solve(surface.reaction_load(result.r_n, n)),
    ]
    defect = surface.comm.max(
        np.array([max_abs(parts[0] - parts[1] - parts[2]), max_abs(parts[1])])
    )
    fields = [space.expand(problem.cartesian(one), report.new.t) for one in parts]
    rows = space.comm.mpi.gather(np.hstack([space.points, *fields]), root=0)
    forces = (
        -surface.everywhere(result.r_n)[:, None] * surface.everywhere(surface.normals) / step.scale
    )
    contact = surface.everywhere(surface.points)
    if rows is None:
        return None
    rows = np.vstack(rows)
    rows = rows[np.lexsort(np.round(rows[:, :2], 9).T)]
    points, u, loaded, pressed = np.split(rows, 4, axis=1)
    return Decomposition(
        points, u, loaded, pressed, contact, forces, report.new.t, float(defect[0] / defect[1])
    )
