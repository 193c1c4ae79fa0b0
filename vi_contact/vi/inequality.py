"""Find u between bounds: F(u; v - u) >= 0 for all v with lower <= v <= upper, at the points of a Function's space.

Newton's method (N. H. Josephy, 1979) solves F(u_k) + J(u_k) (u - u_k) in the place of F (``solve_linear``) and goes
towards the answer as far as makes the natural residual u - mid(lower, u - F/J_ii, upper) smaller by a part of what the
slope promises. A linear problem takes one step."""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.algebra import total
from ..core.certificate import Certificate
from ..core.checks import instance, whole
from ..core.errors import StepFailure
from ..fem import compat
from ..fem.form_checks import refuse_complex
from ..solvers.volume.route import Method, TaoTron, Volume
from .forms import Problem, refused
from .newton import newton


@dataclass(frozen=True)
class Result:
    """Hold the answer of ``solve``: u, the Function that was given, and what is known of it.

    ``lambda_lower``, ``lambda_upper``: Functions of the multipliers, forces at points in the unit of F >= 0. With F the
    vector of F(u; phi_i), F = lambda_lower - lambda_upper where bcs prescribe nothing, and zero off the bounds.
    ``active``: how many unknowns are on their lower and upper bounds, those where the multiplier is above zero.
    ``certificate``: relative residuals (``core.certificate``): equilibrium of inactive unknowns, distance of active
    ones from their bound (complementarity), signs of distances (penetration) and of multipliers (tension).
    ``iterations``, ``inner``: Newton steps, and iterations of ``method`` in them; ``seconds`` of this rank's processor.
    """

    u: Any
    lambda_lower: Any
    lambda_upper: Any
    active: tuple[int, int]
    certificate: Certificate
    iterations: int
    inner: int
    method: str
    reason: str
    seconds: Mapping[str, float]


def solve(form: Any, u: Any, *, lower: Any = None, upper: Any = None, bcs: Sequence[Any] = (), J: Any = None,
          method: Method | None = None, petsc_options: Mapping[str, object | None] | None = None,
          prefix: str = "vi_contact_vi_", tolerance: float = 1e-9, iterations: int = 50) -> Result:
    """Solve F(u; v - u) >= 0 for all v between the bounds; u holds the first guess, and the answer.

    ``form``: F(u; v) of UFL, linear or not in the Function u, or (a, L) for a(u, v) - L(v). ``lower``, ``upper``:
    Functions on the space of u, Constants, numbers, one or one for each component, or None. ``bcs``: dirichletbc on
    that space or its components. ``J``: the Jacobian, else the derivative of F.
    ``method``: TaoTron(), ReducedNewton() or SemismoothNewton() of ``solvers``; None takes the first two where J is
    symmetric, the last two elsewhere. ``petsc_options``: for it, under ``prefix`` on the command line.

    The unknowns must be values at points (Lagrange of any degree, DG0, …): bounds hold there, which for degrees above
    one is not everywhere. InputError for forms, bounds and bcs that do not fit; StepFailure when the certificate stays
    above ``tolerance`` after ``iterations`` Newton steps, with the best u so far kept. Collective."""
    start, limit = time.process_time(), whole("vi.solve", "iterations", iterations, least=1)
    refuse_complex("vi.solve")
    instance("vi.solve", "u", u, compat.fem.Function, "give the DOLFINx Function to solve for")
    if not compat.nodal(u.function_space):
        raise refused("the unknowns of u are not values of one field at points: take Lagrange or DG0, not mixed")
    settings = Volume(method or TaoTron(), {} if petsc_options is None else petsc_options, prefix, tolerance)
    problem = Problem(form, u, bcs, J)
    low, high = problem.bounds(lower, upper)
    ready = time.process_time()
    try:
        found = newton(problem, low, high, settings, () if method is None else (method,), limit)
    finally:
        problem.close()
    best = found.best
    problem.put(best.x, best.left)
    reason = f"the certificate is {best.certificate.worst:.1e} after {found.steps} Newton steps"
    if found.failure:
        raise StepFailure(f"vi.solve: {reason}, above {tolerance:g}: {found.failure} (u holds the best iterate)")
    active = [round(total(problem.comm, np.count_nonzero(push))) for push in best.push]
    pushes, seconds = [problem.spread(one) for one in best.push], time.process_time() - ready
    return Result(u, pushes[0], pushes[1], (active[0], active[1]), best.certificate, found.steps, found.inner,
                  found.method, reason, {"setup": ready - start, "solve": seconds})
