"""Find a local minimum of an energy between bounds, by Newton's method with a trust region.

Each step makes the quadratic model q(s) = F·s + ½ s·J s of the energy small, for x + s between the
bounds and |s| not above a radius, in the norm |s|² = sum J_ii s_i². The radius grows where the
energy falls as the model says and shrinks where it does not, also where the energy at x + s is no
number. J need not be positive definite: along a direction of negative curvature the step goes to
the edge of the region. Reference: C.-J. Lin and J. J. Moré, 1999, Newton's method for large
bound-constrained optimization problems (TRON).
"""

import numpy as np

from ..core.algebra import Array
from ..solvers.volume.options import OptionLayers
from .forms import Problem
from .judged import Judged
from .model import Model
from .newton import Ended, begin

ACCEPTED = 1e-4  # the part of the promised decrease that a step must bring
POOR, GOOD = 0.25, 0.75  # parts of it below which the radius shrinks and above which it grows
FIRST_RADIUS = 1e3  # steps of Jacobi's method: the first radius
DIGITS = 1e-8  # of the energy: a smaller decrease is taken from forces, as energies cancel
UNBOUNDED = 1e30  # times the first radius: no answer is so far away
SHORTEST = 1e-14  # of the first radius, and of the whole change of the conditions
NOT_A_NUMBER = (
    "the energy or its derivatives are not a number there: check the energy and the first guess"
)
TOO_FEW = "the iterations are used up: give a better first guess in u, or more iterations"
NO_DESCENT = (
    "no step makes the energy smaller: check that it is smooth and bounded below between the bounds"
)


def minimise(
    problem: Problem, lower: Array, upper: Array, tolerance: float, limit: int, layers: OptionLayers
) -> Ended:
    """Return where the descent ends: at a point that is found, or with a failure.

    Such a point has a certificate below the tolerance, and no direction of negative curvature is
    found there. ``layers``: options of the preconditioner. Collective.
    """
    found = Ended(begin(problem, lower, upper), method="trust region")
    while found.best.left and not found.failure:
        carry_conditions(found, layers)
    if not found.failure:
        descend(found, tolerance, limit, layers)
    return found


def carry_conditions(found: Ended, layers: OptionLayers) -> None:
    """Take one step that carries Dirichlet conditions and bounds into the body.

    It goes as far as the energy is a number.
    """
    point = found.best
    problem = point.problem
    model = Model(point, layers)
    step, its = model.minimise(np.inf)
    model.close()
    length = 1.0
    while length > SHORTEST:
        problem.put(point.x + length * step, point.left * (1.0 - length))
        if np.isfinite(problem.energy()):
            # All the way the bounds hold exactly; on the way the point may still be outside.
            if length == 1.0:
                problem.put(np.clip(problem.x, point.lower, point.upper))
            next_point = Judged(problem, point.lower, point.upper, point.left * (1.0 - length))
            if not next_point.broken:
                found.best, found.inner, found.steps = (
                    next_point,
                    found.inner + its,
                    found.steps + 1,
                )
                return
        length *= 0.5
    found.failure = (
        "Dirichlet conditions or bounds lead where the energy is not a number: take a smaller "
        "load step"
    )


@np.errstate(over="ignore", invalid="ignore")  # energies that have no minimum
def descend(found: Ended, tolerance: float, limit: int, layers: OptionLayers) -> None:
    """Go down from the best point until it is a local minimum. Collective."""
    point = found.best
    energy = point.problem.energy()
    if point.broken or not np.isfinite(energy):
        found.failure = NOT_A_NUMBER
    else:
        _follow(found, energy, tolerance, limit, layers)


def _follow(
    found: Ended, energy: float, tolerance: float, limit: int, layers: OptionLayers
) -> None:
    """Take steps with a trust region from the best point, whose energy is given. Collective."""
    point = found.best
    problem = point.problem
    model = Model(point, layers)
    radius = first = FIRST_RADIUS * model.jacobi_step()
    # the length of a step along negative curvature, as a share of the first one that is tried
    shrunk = 1.0
    while True:
        done = point.certificate.worst <= tolerance
        if done:
            # First-order conditions hold. A maximum or a saddle is left along a direction of
            # negative curvature.
            step, its = model.downward(shrunk)
            found.inner += its
            if step is None:
                break
            radius = first = model.length(step)
        else:
            step, its = model.minimise(radius)
            found.inner += its
        if found.steps >= limit or radius > UNBOUNDED * first:
            found.failure = TOO_FEW if found.steps >= limit else NO_DESCENT
            break
        length = model.length(step)
        trial, ratio = _try_step(model, point, step, energy)
        radius = _trust(radius, length, ratio)

        if ratio > ACCEPTED:
            next_point = Judged(problem, point.lower, point.upper)
            if not next_point.broken:
                model.close()
                point, energy = next_point, trial
                model = Model(point, layers)
                found.best, found.steps, shrunk = point, found.steps + 1, 1.0
                continue
            # Judging the broken point has replaced the Jacobian of this one: judge it again.
            model.close()
            problem.put(point.x)
            point = Judged(problem, point.lower, point.upper)
            model, radius = Model(point, layers), 0.25 * length
        if done:
            # Too far in this direction: shorter, until what is promised is rounding of the energy.
            shrunk *= 0.25
            if shrunk <= SHORTEST:
                break
        elif radius <= SHORTEST * first:
            found.failure = NO_DESCENT
            break
    model.close()


def _try_step(model: Model, point: Judged, step: Array, energy: float) -> tuple[float, float]:
    """Write the point after a step into u.

    Returns:
        The energy there, and what was gained over what the model promises; -inf where it promises
        nothing.
    """
    problem, promised = point.problem, -model.value(step)
    problem.put(np.clip(point.x + step, point.lower, point.upper))
    trial = problem.energy()
    gained = energy - trial
    if np.isfinite(trial) and abs(promised) <= DIGITS * max(abs(energy), abs(trial)):
        gained = -0.5 * problem.dot(point.F + problem.residual(), step)
    return trial, gained / promised if promised > 0.0 else -np.inf


def _trust(radius: float, length: float, ratio: float) -> float:
    """Return the next radius: smaller after a poor step, larger after a good one at the edge."""
    if ratio < POOR:
        return 0.25 * length
    return 4.0 * radius if ratio > GOOD and length > 0.9 * radius else radius
