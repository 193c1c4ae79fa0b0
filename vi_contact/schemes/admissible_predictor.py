"""Find the nearest admissible displacement in the norm of the mass matrix: it keeps contact forces from ringing.

    u_p = argmin ½ (u - u_f)ᵀ M (u - u_f)  over  B_n u <= gap0  (= on bilateral rows)
    that is    M w = -B_nᵀ q,    0 <= q  ⊥  gap0 - B_n u_f - B_n w >= 0,    u_p = u_f + w

The same small problem as a step with A = M, solved in the increment w, so that nothing is rounded where nothing is in
the way. Springs give way: their points are not projected. Normal directions only; friction has no part in it.
Source: Deuflhard, Krause and Ertel, Int. J. Numer. Meth. Engng 73 (2008) 1274-1290.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..core.algebra import Array, Mask
from ..core.errors import StepFailure
from ..core.problem import ContactProblem
from ..core.protocols import Frictionless
from ..core.step import State, StepProblem
from ..solvers.certified import TOLERANCE, CertifiedSolver
from ..solvers.condensed import Condensed
from .consistent_data import mass_matrix, rigid_part


def admissible(problem: ContactProblem, state: State, u: Array, dt: float) -> tuple[Array, Mask]:
    """Return (u_p, the points that stopped it) for a predicted displacement ``u`` of the step of dt after ``state``.

    StepFailure when the projection cannot be certified.
    """
    surface, system = problem.surface, problem.equations
    rigid = surface.compliance == 0.0
    gap = np.where(rigid, surface.gap(state.t + dt) - surface.normal_values(u), np.inf)
    closed = (gap < 0.0) | (surface.bilateral & rigid)
    if np.isnan(gap).any() or not np.any(gap[closed] != 0.0):
        return u, closed  # nothing in the way; of NaN the step itself tells
    bounds: ContactProblem = system.cached(  # springs are not bounds here, and nothing rubs
        "admissible predictor, bounds",
        lambda: replace(problem, surface=rigid_part(surface), friction=Frictionless()),
    )
    solver: CertifiedSolver = system.cached(
        "admissible predictor", lambda: CertifiedSolver(bounds, mass_matrix(problem), 1.0, [Condensed()], TOLERANCE)
    )
    step = StepProblem(
        A=mass_matrix(problem),
        b=np.zeros_like(u),
        bound=gap,
        surface=bounds.surface,
        scale=1.0,
        guess=np.zeros_like(u),
        active=closed,
        t=state.t + dt,
        k=state.k + 1,
    )
    try:
        result, _, _ = solver.solve(step)
    except StepFailure as failure:
        raise StepFailure(f"the predictor could not be projected onto the admissible set: {failure}") from failure
    return u + result.x, result.active
