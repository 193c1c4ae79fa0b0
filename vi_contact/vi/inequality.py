"""Find u between bounds with F(u; v - u) >= 0 for all v with lower <= v <= upper.

The bounds hold at the points of a Function's space. With F the vector of F(u; phi_i) this says of
every unknown i that no condition holds

    F_i >= 0 where u_i = lower_i,    F_i <= 0 where u_i = upper_i,    F_i = 0 between

``solve`` is the door for users. It reads what they give (``forms``), and takes one of two ways:

- a form F(u; v), with any Jacobian: Newton's method for variational inequalities (``newton``),
  whose linear problems are those of the volume route (``linear_steps``). It makes the natural
  residual u - mid(lower, u - F/J_ii, upper) smaller in each step; a linear problem takes one step.
- an energy, whose derivative F is: a descent with a trust region (``minimum``), which also leaves
  maxima and saddles.

What either has found is judged by one certificate (``judged``).
"""

import logging
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from ..core.certificate import Certificate
from ..core.checks import instance, quote, whole
from ..core.collective import agree
from ..core.errors import StepFailure
from ..fem import compat
from ..fem.body.form_checks import refuse_complex
from ..fem.mesh.communicators import MpiComm, keep_communicator
from ..solvers.volume.options import OptionLayers
from ..solvers.volume.route import Method, TaoTron, Volume
from .forms import Problem, make_error, take_common_part
from .judged import Judged
from .linear_steps import is_symmetric
from .minimum import minimise
from .model import Model
from .newton import Progress, solve_in_parts

log = logging.getLogger(__name__)

NEGATIVE = (
    "the Jacobian of F is not positive at this u, so that Newton's method may lead away from every "
    "answer: give the functional whose derivative F is as energy= in the place of F, or take "
    "smaller load steps"
)
HILL = (
    "the Jacobian of F is not positive at the answer: if F is the derivative of an energy, this u "
    "is no minimum of it, and energy= in the place of F finds one"
)
NEWTON_STEPS = 50  # of a form, at most, unless the user gives a number
DESCENT_STEPS = 500  # of an energy


@dataclass(frozen=True)
class Result:
    """Hold the answer of ``solve``, and what is known of it.

    Attributes:
        u: the Function that was given.
        lambda_lower, lambda_upper: Functions of the multipliers, forces at points in the unit of
            F >= 0. With F the vector of F(u; phi_i), F = lambda_lower - lambda_upper where bcs
            prescribe nothing, and zero off the bounds.
        active: how many unknowns are on their lower and upper bounds: where the multiplier is above
            zero.
        certificate: relative residuals (``core.certificate``): equilibrium of inactive unknowns,
            distance of active ones from their bound (complementarity), signs of distances
            (penetration) and of multipliers (tension).
        iterations: steps of Newton's method, or downhill.
        inner: iterations of ``method`` in them, of conjugate gradients for an energy.
        method: the name of the method that solved the last linear problem.
        reason: why it ended, and whether u is a local minimum.
        seconds: of this rank's processor, for "setup" and "solve".
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
        iterations: steps, at most; None: 50, and 500 of an energy.

    Returns:
        The answer, with multipliers and certificate.

    Raises:
        InputError: forms, bounds or bcs do not fit.
        StepFailure: the certificate stays above the tolerance; u keeps the best values so far.
    """
    start = time.process_time()
    limit = NEWTON_STEPS if energy is None else DESCENT_STEPS
    if iterations is not None:
        limit = whole("vi.solve", "iterations", iterations, least=1)
    refuse_complex("vi.solve")
    refuse_unknowns(u)
    refuse_choices(form, energy, J, method)
    choices = {
        "lower": take_common_part(lower),
        "upper": take_common_part(upper),
        "J": J is None,
        "energy": energy is None,
        "method": method,
        "number of bcs": len(bcs) if isinstance(bcs, list | tuple) else bcs,
        "petsc_options": petsc_options,
        "prefix": prefix,
        "tolerance": tolerance,
        "iterations": iterations,
    }
    agree(MpiComm(keep_communicator(u.function_space.mesh.comm)), "vi.solve", choices)
    options = {} if petsc_options is None else petsc_options
    settings = Volume(method or TaoTron(), options, prefix, tolerance)

    # Read forms and bounds; from here on u changes.
    problem = Problem(form, u, bcs, J, energy)
    low, high = problem.read_bounds(lower, upper)
    ready = time.process_time()

    # Newton's method for a form, a descent for an energy.
    layers = OptionLayers(prefix, choose_preconditioner(problem.comm.size), settings.petsc_options)
    is_hill = False
    try:
        if energy is None:
            methods = () if method is None else (method,)
            progress = solve_in_parts(problem, low, high, settings, methods, limit)
            # A Jacobian with negative curvature explains a failure, and casts doubt on an answer.
            if progress.failure or progress.doubted:
                is_hill = curves_down(progress, layers)
        else:
            progress = minimise(problem, low, high, tolerance, limit, layers)
    finally:
        problem.close()

    steps = "Newton steps" if energy is None else "steps downhill"
    worst = progress.best.certificate.worst
    reason = f"the certificate is {worst:.1e} after {progress.steps} {steps}"
    if progress.failure:
        cause = NEGATIVE if is_hill else progress.failure
        raise give_up(problem, progress, f"vi.solve: {reason}, above {tolerance:g}: {cause}")
    if is_hill:
        reason += f", {HILL}"
        if problem.comm.rank == 0:
            log.warning("vi.solve: %s", HILL)
    if energy is not None:
        reason += ", at a local minimum: no direction of negative curvature is found"
    return finish(problem, progress, reason, start=start, ready=ready)


def finish(
    problem: Problem, progress: Progress, reason: str, *, start: float, ready: float
) -> Result:
    """Write the best values into u, and return the answer. Collective.

    Args:
        problem: with u.
        progress: of the method, which has found the answer.
        reason: why it ended.
        start: processor time [s] when ``solve`` was called.
        ready: processor time [s] when forms and bounds had been read.
    """
    best = progress.best
    problem.put(best.x)
    on_lower, on_upper = (problem.count(multiplier != 0.0) for multiplier in best.push)
    lambda_lower, lambda_upper = (problem.spread(multiplier) for multiplier in best.push)
    return Result(
        u=problem.u,
        lambda_lower=lambda_lower,
        lambda_upper=lambda_upper,
        active=(on_lower, on_upper),
        certificate=best.certificate,
        iterations=progress.steps,
        inner=progress.inner,
        method=progress.method,
        reason=reason,
        seconds={"setup": ready - start, "solve": time.process_time() - ready},
    )


def refuse_unknowns(u: Any) -> None:
    """Raise InputError unless u is a Function whose unknowns are values of one field at points."""
    instance("vi.solve", "u", u, compat.fem.Function, "give the DOLFINx Function to solve for")
    if not compat.nodal(u.function_space):
        raise make_error(
            "the unknowns of u are not values of one field at points: take Lagrange or DG0, not "
            "mixed"
        )


def refuse_choices(form: Any, energy: Any, J: Any, method: Any) -> None:
    """Raise InputError unless there is a form or an energy, and what belongs to it.

    Args:
        form: F(u; v), or (a, L).
        energy: the functional of u.
        J: the Jacobian, of a form only.
        method: for linear steps, of a form only.
    """
    if form is None and energy is None:
        raise make_error(
            "there is nothing to solve: give the form F(u; v), or energy=, a functional of u"
        )
    if form is not None and energy is not None:
        raise make_error(
            "both a form and energy= are given: give one of them, as the form is the "
            "derivative of the energy"
        )
    if energy is not None and J is not None:
        raise make_error("J is given beside energy=, whose second derivative is J: leave J out")
    if energy is not None and method is not None:
        raise make_error(
            f"method is {quote(method)}, which solves the linear steps of a form; leave it "
            "out with energy="
        )


def choose_preconditioner(ranks: int) -> Mapping[str, object | None]:
    """Return the options that come before the user's, for conjugate gradients on so many ranks."""
    return {"pc_type": "icc"} if ranks == 1 else {"pc_type": "bjacobi", "sub_pc_type": "icc"}


def curves_down(progress: Progress, layers: OptionLayers) -> bool:
    """Say whether F has a symmetric Jacobian with a direction of negative curvature at the best u.

    Collective.
    """
    best = progress.best
    problem = best.problem
    if best.broken or problem.constant:
        return False
    problem.put(best.x, best.left)
    # The Jacobian there, which later points have replaced.
    point = Judged(problem, best.lower, best.upper, best.left)
    if not is_symmetric(point.A, problem.comm):
        return False
    model = Model(point, layers)
    negative = model.curves_down()
    model.close()
    return negative


def give_up(problem: Problem, progress: Progress, sentence: str) -> StepFailure:
    """Write the best values into u, and return the error. Collective.

    Where conditions were never met, these are the first guess.

    Args:
        problem: with u.
        progress: of the method that failed.
        sentence: of the error; what u holds is added.
    """
    if progress.best.left:
        problem.put_back()
        return StepFailure(f"{sentence} (u holds the first guess)")
    problem.put(progress.best.x)
    return StepFailure(f"{sentence} (u holds the best iterate)")
