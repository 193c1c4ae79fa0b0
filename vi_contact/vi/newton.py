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
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from ..core.algebra import Array
from ..core.errors import StepFailure
from ..solvers.passes import Passes, certify
from .equations import Equations
from .judged import Judged
from .linear_steps import LinearSteps, find_reduced_step

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


@dataclass(kw_only=True)
class Progress(Passes[Judged]):
    """Hold how far a method has come.

    Attributes:
        best: the best u so far, judged.
        count: number of steps.
        at_once: whether all conditions were met from the start.
        inner: number of iterations of the inner method in the steps.
        method: the inner method of the last step.
        failure: why it stopped without an answer; empty where it has one or goes on.
        doubted: whether an inner method for positive Jacobians has failed.
    """

    best: Judged
    at_once: bool = False
    inner: int = 0
    method: str = ""
    failure: str = ""
    doubted: bool = False

    def is_better(self, there: Judged) -> bool:
        """Say whether a u is the best so far.

        While conditions are still to be met no certificate is finite, and the last u is the best.
        """
        return there.worst < self.least or self.best.left > 0.0


def begin(equations: Equations, lower: Array, upper: Array, *, carry: bool = True) -> Judged:
    """Write where to begin into u, and judge it. Collective.

    Where conditions and bounds change a problem that is not linear, this is u as it was given, and
    the first step carries the change. Elsewhere, and where F is not a number at this u, it is u
    with the conditions and between the bounds.

    Args:
        equations: with u as it was given.
        lower: (n,) bounds of the free unknowns from below.
        upper: (n,) from above.
        carry: True to carry small changes too; False to write into u at once what leaves forces
            hardly larger than the linear step that carries it would.
    """
    # Try the u that was given first, with the change of the conditions (all of it, 1.0) still to
    # come. To carry it is worth a step only if it would leave larger forces when written at once.
    given = equations.x
    if not equations.constant and equations.moves(lower, upper):
        equations.put(given, 1.0)
        point = Judged(equations, lower, upper, 1.0)
        if not point.broken:
            changed = np.clip(given, lower, upper)
            forces = point.measure_natural_residual(changed, point.put(changed, 0.0))
            if carry or forces > SMALL_CHANGE * point.measure_natural_residual(point.x, point.F):
                equations.put(given, 1.0)
                return point
    equations.put(np.clip(given, lower, upper))
    return Judged(equations, lower, upper)


def solve_in_parts(
    equations: Equations,
    lower: Array,
    upper: Array,
    steps: LinearSteps,
    limit: int,
) -> Progress:
    """Return where Newton's method ends. Collective.

    Where it fails as Dirichlet conditions change the first guess too much at once, they change it
    in parts, each from the answer of the part before.

    Args:
        equations: with u as it was given.
        lower: (n,) bounds of the free unknowns from below.
        upper: (n,) from above.
        steps: solves linear problems, and has the tolerance of the answer.
        limit: number of steps, at most.
    """
    moves = not equations.constant and equations.moves(lower, upper)
    whole = run_newton(equations, lower, upper, steps, limit, carry=False)
    if not whole.failure or not moves:
        return whole

    # Half of the change first, or all of it where it was written into u at once; of a part that
    # fails half.
    equations.put_back()
    reached = 0.0
    part = 1.0 if whole.at_once else 0.5
    count = whole.count
    inner = whole.inner
    while part >= SMALLEST_PART:
        before = np.array(equations.u.x.array)
        equations.aim(reached + part)
        progress = run_newton(equations, lower, upper, steps, min(limit, STEPS_OF_A_PART))
        count += progress.count
        inner += progress.inner
        if progress.failure:
            equations.u.x.array[:] = before
            part *= 0.5
            continue
        equations.put(progress.best.x)
        reached += part
        if reached == 1.0:
            progress.count = count
            progress.inner = inner
            return progress
    equations.put_back()
    return whole


def run_newton(
    equations: Equations,
    lower: Array,
    upper: Array,
    steps: LinearSteps,
    limit: int,
    *,
    carry: bool = True,
) -> Progress:
    """Return where Newton's method ends: below the tolerance, or with a failure.

    Collective.

    Args:
        equations: with u where it begins.
        lower: (n,) bounds of the free unknowns from below.
        upper: (n,) from above.
        steps: solves linear problems, and has the tolerance of the answer.
        limit: number of steps, at most.
        carry: see ``begin``.
    """
    point = begin(equations, lower, upper, carry=carry)
    tolerance = steps.settings.tolerance
    progress = Progress(best=point, tolerance=tolerance, goal=tolerance, at_once=point.left == 0.0)
    steps.begin()
    limit = min(limit, REFINEMENTS) if equations.constant else limit
    if not certify(progress, make_points(progress, steps), limit) and not progress.failure:
        progress.failure = "give a better first guess in u, or more iterations"
    return progress


def make_points(progress: Progress, steps: LinearSteps) -> Iterator[Judged]:
    """Yield the u of one step after another, judged. Collective.

    Args:
        progress: has the first u, and gets the reason where there is no further step.
        steps: solves linear problems.
    """
    point = progress.best
    while not point.broken:
        left = take_step(progress, point, steps)
        progress.doubted = bool(steps.failed)
        if left is None:
            return
        point = Judged(point.equations, point.lower, point.upper, left)
        yield point
    progress.failure = NO_STEP if progress.count else NOT_A_NUMBER


def take_step(progress: Progress, point: Judged, steps: LinearSteps) -> float | None:
    """Take one step from a point, in u. Collective.

    It goes towards the answer of the linear problem between the bounds or, where this one has no
    answer or leads nowhere, is a reduced step.

    Args:
        progress: gets the reason where neither helps.
        point: where the step begins.
        steps: solves linear problems.

    Returns:
        The share of the change of held unknowns that is then left; None where neither helps.
    """
    # Where all methods have failed before, the tangents are not positive: a reduced step costs one
    # factor.
    is_linear = point.equations.constant
    ways = [steps.solve] if is_linear else [steps.solve, find_reduced_step]
    if not steps.helps:
        ways.reverse()
    for find in ways:
        progress.failure = UNHELD if is_linear else NO_STEP
        try:
            x, iterations, progress.method = find(point)
        except StepFailure as failure:
            log.debug("vi.solve: %s", failure)
            continue
        progress.inner += iterations
        left = advance(point, x)
        if left is not None:
            progress.failure = ""
            return left
    return None


def advance(point: Judged, target: Array) -> float | None:
    """Go from a point towards the target, in u, as far as the natural residual falls. Collective.

    Returns:
        The share of the change of held unknowns that is then left; None where no length helps.
    """
    equations = point.equations
    if equations.constant:
        equations.put(target)
        return 0.0
    # Bounds widened by both ends, which may lie outside: on the way nothing leaves them but by
    # rounding.
    lower = np.minimum(point.lower, np.minimum(point.x, target))
    upper = np.maximum(point.upper, np.maximum(point.x, target))

    # Armijo's rule, by halvings. To first order r becomes (1 - length) r, and the size of the
    # natural residual, sum J_ii r², falls by 2 length of itself: a part of that must come true.
    step = target - point.x
    natural = point.measure_natural_residual(point.x, point.F)
    for length in 0.5 ** np.arange(HALVINGS):
        x = np.clip(point.x + length * step, lower, upper)
        left = point.left * (1.0 - length)
        F = point.put(x, left)
        if point.measure_natural_residual(x, F) <= (1.0 - 2.0 * ARMIJO * length) * natural:
            return float(left)
    return None
