"""Find u between bounds with F(u; v - u) >= 0 for all v with lower <= v <= upper.

The bounds hold at the points of a Function's space. With F the vector of F(u; phi_i) this says of
every unknown i that no condition holds

    F_i >= 0 where u_i = lower_i,    F_i <= 0 where u_i = upper_i,    F_i = 0 between
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from ..solvers.volume.route import Method
from .problem import Problem, Result


def solve(
    form: Any = None,
    u: Any = None,
    *,
    energy: Any = None,
    lower: Any = None,
    upper: Any = None,
    bcs: Sequence[Any] = (),
    J: Any = None,
    method: Method | None = None,
    petsc_options: Mapping[str, object | None] | None = None,
    prefix: str = "vi_contact_vi_",
    tolerance: float = 1e-9,
    iterations: int | None = None,
) -> Result:
    """Solve F(u; v - u) >= 0 for all v between bounds, or minimise an energy between them.

    The unknowns must be values at points (Lagrange of any degree, DG0, …): bounds hold there, which
    for degrees above one is not everywhere. Collective.

    Args:
        form: F(u; v) of UFL, linear or not in the Function u, or (a, L) for a(u, v) - L(v).
        u: the Function to solve for; it holds the first guess, and then the answer.
        energy: in the place of the form a functional Pi(u), whose derivative is F; F need not be
            monotone then. The answer satisfies the same conditions, is a local minimum, and no
            direction of negative curvature is found there.
        lower: bounds from below: a Function on the space of u, a Constant, numbers, one or one for
            each component, or None.
        upper: bounds from above, as ``lower``.
        bcs: dirichletbc on that space or its components; what they change in u goes into it with
            the first step.
        J: the Jacobian, else the derivative of F.
        method: TaoTron(), ReducedNewton() or SemismoothNewton() of ``solvers``; None takes the
            first two where J is symmetric, the last two elsewhere.
        petsc_options: for the method, and of an energy for the preconditioner of conjugate
            gradients, e.g. {"pc_type": "hypre"}.
        prefix: of these options on the command line.
        tolerance: the largest residual of the certificate.
        iterations: steps, at most; None: 50, and 1000 of an energy.

    Returns:
        The answer, with multipliers and certificate.

    Raises:
        InputError: forms, bounds or bcs do not fit.
        StepFailure: the certificate stays above the tolerance; u keeps the best values so far.
    """
    start = time.process_time()
    problem = Problem(
        form,
        u,
        energy=energy,
        bcs=bcs,
        J=J,
        method=method,
        petsc_options=petsc_options,
        prefix=prefix,
        tolerance=tolerance,
    )
    prepared = time.process_time()
    try:
        result = problem.solve(lower=lower, upper=upper, iterations=iterations)
    finally:
        problem.close()
    setup = prepared - start + result.seconds["setup"]
    return replace(result, seconds={**result.seconds, "setup": setup})
