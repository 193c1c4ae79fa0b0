"""Find the answer by Newton's method for variational inequalities, when F(u; v) is given.

Each step solves F(u_k) + J(u_k) (u - u_k) in the place of F between the same bounds (N. H. Josephy,
1979, Newton's method for generalized equations) and goes towards the answer as far as makes the
natural residual smaller.

The first step begins at the u that was given, *before* Dirichlet conditions and bounds have changed
it, and carries their change through the body with the linear step. Written into u by themselves
they would turn the cells beside a clamped side inside out as soon as the change is larger than a
cell.
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ..core.algebra import Array
from ..core.errors import StepFailure
from ..solvers.volume.route import Method, Volume
from .forms import Problem
from .judged import Judged
from .linear_steps import LinearSteps, reduced_step

log = logging.getLogger(__name__)

ARMIJO = 1e-4  # the part of what the slope promises that a step must bring
HALVINGS = 24  # of a step that brings too little
SMALL_CHANGE = 2.0  # times the natural residual of the linear step that carries the change
STEPS_OF_A_PART = 20  # at most
# of the change that Dirichlet conditions bring, when it is taken in parts
SMALLEST_PART = 1.0 / 8.0
REFINEMENTS = 5  # of a linear problem, at most

NOT_A_NUMBER = "F or its Jacobian is not a number there: check the form and the first guess"
NO_STEP = (
    "no step of Newton's method improves u: take smaller load steps, or give a better first guess"
)
UNHELD = (
    "the linear problem is not solved: check that bcs or bounds hold u, that F is a(u, v) - L(v) "
    "with a(v, v) > 0, and that its coefficients are finite, or try another method="
)


@dataclass
class Ended:
    """Hold where a method stopped.

    This is the best u, whether all conditions were met from the start, how many steps it took, with
    which inner method, what failed, and whether a method for positive Jacobians did.
    """

    best: Judged
    at_once: bool = False
    steps: int = 0
    inner: int = 0
    method: str = ""
    failure: str = ""
    doubted: bool = False


def begin(problem: Problem, lower: Array, upper: Array, *, carry: bool = True) -> Judged:
    """Write where to begin into u, and judge it. Collective.

    Where conditions and bounds change a problem that is not linear, this is u as it was given; a
    small change, which leaves forces hardly larger than the linear step that carries it would, is
    written into u at once unless told to ``carry`` it. Else, and where F is not a number at this u,
    it is u with the conditions and between the bounds.
    """
    given = problem.x
    if not problem.constant and problem.moves(lower, upper):
        problem.put(given, 1.0)
        point = Judged(problem, lower, upper, 1.0)
        if not point.broken:
            changed = np.clip(given, lower, upper)
            forces = point.natural(changed, point.put(changed, 0.0))
            if carry or forces > SMALL_CHANGE * point.natural(point.x, point.F):
                problem.put(given, 1.0)
                return point
    problem.put(np.clip(given, lower, upper))
    return Judged(problem, lower, upper)


def solve_in_parts(
    problem: Problem,
    lower: Array,
    upper: Array,
    settings: Volume,
    methods: Sequence[Method],
    limit: int,
    *,
    carry: bool = True,
) -> Ended:
    """Return where Newton's method ends.

    Where it fails as Dirichlet conditions change the first guess too much at once, they change it
    in parts, each from the answer of the part before. Collective.
    """
    moves = not problem.constant and problem.moves(lower, upper)
    whole = newton(problem, lower, upper, settings, methods, limit, carry=False)
    if not whole.failure or not moves:
        return whole
    problem.put_back()
    reached, part, steps, inner = 0.0, 1.0 if whole.at_once else 0.5, whole.steps, whole.inner
    while part >= SMALLEST_PART:
        before = np.array(problem.u.x.array)
        problem.aim(reached + part)
        found = newton(problem, lower, upper, settings, methods, min(limit, STEPS_OF_A_PART))
        steps, inner = steps + found.steps, inner + found.inner
        if found.failure:
            problem.u.x.array[:] = before
            part *= 0.5
            continue
        problem.put(found.best.x)
        reached += part
        if reached == 1.0:
            found.steps, found.inner = steps, inner
            return found
    problem.put_back()
    return whole


def newton(
    problem: Problem,
    lower: Array,
    upper: Array,
    settings: Volume,
    methods: Sequence[Method],
    limit: int,
    *,
    carry: bool = True,
) -> Ended:
    """Return where Newton's method ends: below the tolerance of the settings, or with a failure.

    Collective.
    """
    point = begin(problem, lower, upper, carry=carry)
    found = Ended(point, at_once=point.left == 0.0)
    steps = LinearSteps(settings, methods, problem.comm)
    limit = min(limit, REFINEMENTS) if problem.constant else limit
    while found.best.certificate.worst > settings.tolerance:
        if point.broken:
            found.failure = NO_STEP if found.steps else NOT_A_NUMBER
            return found
        if found.steps == limit:
            found.failure = "give a better first guess in u, or more iterations"
            return found
        left = take_step(found, point, steps)
        found.doubted = bool(steps.failed)
        if left is None:
            return found
        point = Judged(problem, lower, upper, left)
        found.steps += 1
        if point.certificate.worst < found.best.certificate.worst or found.best.left:
            found.best = point
    return found


def take_step(found: Ended, point: Judged, steps: LinearSteps) -> float | None:
    """Take one step from a point, in u, and return what is then left.

    It goes towards the answer of the linear problem between the bounds or, where this one is not
    found or leads nowhere, is a reduced step. Returned is the share of the change of held unknowns
    that is then left; it is None, and the reason in ``found``, where neither helps. Collective.
    """
    # Where all methods have failed before, the tangents are not positive: a reduced step costs one
    # factor.
    ways = [linear_step, reduced] if steps.helps else [reduced, linear_step]
    if point.problem.constant:
        ways = [linear_step]
    for way in ways:
        left = way(found, point, steps)
        if left is not None:
            found.failure = ""
            return left
    return None


def linear_step(found: Ended, point: Judged, steps: LinearSteps) -> float | None:
    """Go towards the answer of the linear problem between the bounds; None if that fails.

    Collective.
    """
    start = np.clip(point.x, point.lower, point.upper)
    try:
        x, its, found.method = steps.solve(point.A, point.b, point.lower, point.upper, start)
    except StepFailure as failure:
        found.failure = UNHELD if point.problem.constant else NO_STEP
        log.debug("vi.solve: %s", failure)
        return None
    found.inner += its
    found.failure = NO_STEP
    return advance(point, x)


def reduced(found: Ended, point: Judged, steps: LinearSteps) -> float | None:
    """Take a reduced step; None if that fails. Collective."""
    found.failure = NO_STEP
    try:
        left = advance(point, reduced_step(point))
    except StepFailure as failure:
        log.debug("vi.solve: %s", failure)
        return None
    if left is not None:
        found.inner, found.method = found.inner + 1, "reduced step"
    return left


def advance(point: Judged, target: Array) -> float | None:
    """Go from a point towards the target as far as is an improvement, in u.

    Returned is the share of the change of held unknowns that is then left, None where no length
    helps. Collective.
    """
    problem = point.problem
    if problem.constant:
        problem.put(target)
        return 0.0
    # Bounds widened by both ends, which may lie outside: on the way nothing leaves them but by
    # rounding.
    lower = np.minimum(point.lower, np.minimum(point.x, target))
    upper = np.maximum(point.upper, np.maximum(point.x, target))
    step, natural = target - point.x, point.natural(point.x, point.F)
    for length in 0.5 ** np.arange(HALVINGS):
        x, left = np.clip(point.x + length * step, lower, upper), point.left * (1.0 - length)
        if point.natural(x, point.put(x, left)) <= (1.0 - 2.0 * ARMIJO * length) * natural:
            return float(left)
    return None
