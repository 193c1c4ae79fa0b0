"""Find a local minimum of an energy between bounds, by Newton's method with a trust region.

Each step makes the quadratic model q(s) = F·s + ½ s·J s of the energy small, for x + s between the
bounds and |s| not above a radius, in the norm |s|² = sum J_ii s_i². The radius grows where the
energy falls as the model says and shrinks where it does not, also where the energy at x + s is no
number. J need not be positive definite: along a direction of negative curvature the step goes to
the edge of the region. Reference: C.-J. Lin and J. J. Moré, 1999, Newton's method for large
bound-constrained optimization problems (TRON).

Where F alone is given and its Jacobian is symmetric, the work of F takes the place of the energy.
"""

import numpy as np

from ..core.algebra import Array
from ..solvers.volume.options import OptionLayers
from .equations import Equations
from .judged import Judged
from .model import Model
from .newton import Progress, begin

METHOD = "trust region"
ACCEPTED = 1e-4  # the part of the promised decrease that a step must bring
POOR = 0.25  # the part of it below which the radius shrinks
GOOD = 0.75  # the part of it above which the radius grows
SHRINK = 0.25  # by which it shrinks
GROW = 4.0  # by which it grows
AT_EDGE = 0.9  # of the radius: a longer step has used the region
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
    equations: Equations,
    lower: Array,
    upper: Array,
    tolerance: float,
    limit: int,
    layers: OptionLayers,
) -> Progress:
    """Go down to a local minimum between the bounds. Collective.

    Args:
        equations: of the energy, and u where to begin.
        lower: (n,) bounds of the free unknowns from below.
        upper: (n,) from above.
        tolerance: the largest residual of the certificate.
        limit: number of steps, at most.
        layers: options of the preconditioner.

    Returns:
        Where it ends: at a point whose certificate is below the tolerance, and where no direction
        of negative curvature is found; or with a failure.
    """
    equations.measure_work_from(None)
    point = begin(equations, lower, upper)
    progress = Progress(best=point, tolerance=tolerance, goal=tolerance, method=METHOD)
    while progress.best.left and not progress.failure:
        carry_conditions(progress, layers)
    if not progress.failure:
        descend(progress, tolerance, limit, layers)
    return progress


def carry_conditions(progress: Progress, layers: OptionLayers) -> None:
    """Take one step that carries Dirichlet conditions and bounds into the body. Collective.

    It goes as far as the energy is a number.
    """
    point = progress.best
    equations = point.equations
    model = Model(point, layers)
    step, iterations = model.minimise(np.inf)
    model.close()
    length = 1.0
    while length > SHORTEST:
        left = point.left * (1.0 - length)
        equations.put(point.x + length * step, left)
        if np.isfinite(equations.evaluate_energy()):
            # All the way the bounds hold exactly; on the way the point may still be outside.
            if length == 1.0:
                equations.put(np.clip(equations.x, point.lower, point.upper))
            next_point = Judged(equations, point.lower, point.upper, left)
            if not next_point.broken:
                go_on(progress, next_point)
                progress.inner += iterations
                return
        length *= 0.5
    progress.failure = (
        "Dirichlet conditions or bounds lead where the energy is not a number: take a smaller "
        "load step"
    )


def go_on(progress: Progress, point: Judged) -> None:
    """Count a step that has led to less energy."""
    progress.best = point
    progress.count += 1


@np.errstate(over="ignore", invalid="ignore")  # energies that have no minimum
def descend(progress: Progress, tolerance: float, limit: int, layers: OptionLayers) -> None:
    """Go down from the best point until it is a local minimum. Collective.

    Args:
        progress: where the descent is; it gets the new best points, or a failure.
        tolerance: the largest residual of the certificate.
        limit: number of steps, at most.
        layers: options of the preconditioner.
    """
    point = progress.best
    point.equations.measure_work_from(point.x)
    energy = point.equations.evaluate_energy()
    if point.broken or not np.isfinite(energy):
        progress.failure = NOT_A_NUMBER
    else:
        _follow(progress, energy, tolerance, limit, layers)


def _follow(
    progress: Progress, energy: float, tolerance: float, limit: int, layers: OptionLayers
) -> None:
    """Take steps with a trust region from the best point. Collective.

    Args:
        progress: where the descent is.
        energy: of its best point.
        tolerance: the largest residual of the certificate.
        limit: number of steps, at most.
        layers: options of the preconditioner.
    """
    point = progress.best
    equations = point.equations
    model = Model(point, layers)
    first = FIRST_RADIUS * model.measure_jacobi_step()
    radius = first
    # the length of a step along negative curvature, as a share of the first one that is tried
    share = 1.0
    while True:
        is_stationary = point.certificate.worst <= tolerance
        step, iterations = _find_step(model, radius, share if is_stationary else None)
        progress.inner += iterations
        if step is None:
            break
        if is_stationary:
            first = model.measure_length(step)
            radius = first
        if progress.count >= limit or radius > UNBOUNDED * first:
            progress.failure = TOO_FEW if progress.count >= limit else NO_DESCENT
            break
        length = model.measure_length(step)
        trial, ratio = _try_step(model, point, step, energy)
        radius = _trust(radius, length, ratio)

        # A step that brings enough is taken, unless nothing can be judged where it leads.
        if ratio > ACCEPTED:
            next_point = Judged(equations, point.lower, point.upper)
            if not next_point.broken:
                model.close()
                point = next_point
                energy = trial
                equations.measure_work_from(point.x, energy)
                model = Model(point, layers)
                go_on(progress, point)
                share = 1.0
                continue
            # Judging the broken point has replaced the Jacobian of this one: judge it again.
            model.close()
            equations.put(point.x)
            point = Judged(equations, point.lower, point.upper)
            model = Model(point, layers)
            radius = SHRINK * length

        # Too far: shorter, until what is promised is rounding of the energy.
        if is_stationary:
            share *= SHRINK
            if share <= SHORTEST:
                break
        elif radius <= SHORTEST * first:
            progress.failure = NO_DESCENT
            break
    model.close()


def _find_step(model: Model, radius: float, share: float | None) -> tuple[Array | None, int]:
    """Return a step (n,), or None where there is none, and its iterations. Collective.

    Where first-order conditions hold, a maximum or a saddle is left along a direction of negative
    curvature; elsewhere the step goes to the minimum of the model within the region.

    Args:
        model: the quadratic model.
        radius: that of the region, in the norm of the model.
        share: of the first length that is tried along negative curvature; None where first-order
            conditions do not hold yet.
    """
    return model.minimise(radius) if share is None else model.find_step_downhill(share)


def _try_step(model: Model, point: Judged, step: Array, energy: float) -> tuple[float, float]:
    """Write the point after a step into u. Collective.

    Args:
        model: the quadratic model.
        point: where it was made.
        step: (n,) change of the free unknowns.
        energy: that of the point.

    Returns:
        The energy there, and what was gained over what the model promises; -inf where it promises
        nothing.
    """
    equations = point.equations
    # The ratio of what was gained to what the model promised tells how far to trust the model.
    promised = -model.evaluate(step)
    equations.put(np.clip(point.x + step, point.lower, point.upper))
    trial = equations.evaluate_energy()
    gained = energy - trial
    # Differences of energies lose digits that the work of the forces has.
    if np.isfinite(trial) and abs(promised) <= DIGITS * max(abs(energy), abs(trial)):
        gained = -0.5 * equations.dot(point.F + equations.assemble_residual(), step)
    return trial, gained / promised if promised > 0.0 else -np.inf


def _trust(radius: float, length: float, ratio: float) -> float:
    """Return the next radius: smaller after a poor step, larger after a good one at the edge.

    Args:
        radius: the present one.
        length: that of the step, in the same norm.
        ratio: what it gained over what was promised, a pure number.
    """
    if ratio < POOR:
        return SHRINK * length
    is_at_edge = length > AT_EDGE * radius
    return GROW * radius if ratio > GOOD and is_at_edge else radius
