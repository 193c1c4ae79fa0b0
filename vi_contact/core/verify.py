"""Verify a step: compute its certificate from the answer alone, as a person would by hand.

``core.certificate`` defines the residuals. Nothing of a solver is used here but its answer, and
numpy alone computes, so that the file can be checked by eye.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from itertools import accumulate
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .algebra import Array, Comm
from .certificate import Certificate
from .collective import ask_limit
from .joints import judge_strength
from .step import StepProblem, StepResult

# How far rounding may show in A x, relative to the largest entry of A times that of x; and how
# much smaller than the displacements of a step a slip may be that friction is judged by
# (``Certificate`` has the reasons).
ROUNDING = 1e-5
# The first for bodies that turn, whose displacements are as large as themselves: ten times what
# rounding of their strains leaves (1e-16 |A||x|) is then the tolerance of 1e-9, and forces count
# wherever they can be told from that.
ROUNDING_TURNED = 1e-6
FEW = 5_000  # numbers in an array, up to which copies cost less than calls


def kkt_residual(step: StepProblem, result: StepResult, rest: Array | None = None) -> Certificate:
    """Return how well an answer satisfies the conditions of its step. Collective.

    Args:
        step: the problem, A x = b - B_nᵀ r_n - B_tᵀ r_t with 0 <= r_n ⊥ gap >= 0, and a law of
            friction, which is asked at the slip rates of the answer. Of a body that is not linear
            its own forces stand in the place of b - A x.
        result: the answer: x (n,), r_n (m,) [N, or N s where x is a velocity], r_t (m, d - 1) or
            None, active (m,).
        rest: what is left of the forces at x (n,), b - A x of a linear body, when whoever asks has
            found it; None: it is found here.

    Returns:
        The certificate, whose residuals are pure numbers. What is no number makes a residual
        infinite or NaN, so that it can never pass.
    """
    if rest is None and step.forces is not None:
        rest = step.forces.find_rest(result.x)
    (sizes,) = _measure_sizes(step, result, rest)
    certificate = _make_certificate(step, result, sizes)
    if step.joint is None:
        return certificate
    return replace(certificate, law=judge_strength(step, result))


def kkt_residuals(
    many: StepProblem,
    result: StepResult,
    own: Callable[[int], tuple[StepProblem, StepResult]],
) -> list[Certificate]:
    """Return the certificates of several steps of one matrix, on one rank.

    Args:
        many: the problems; b, guess (k, n) and active (k, m) have a row for each.
        result: the answers, a row for each.
        own: makes the problem and the answer of one row, whose friction is its own.

    Returns:
        The certificate of each row, equal to that of ``kkt_residual``.
    """
    certificates = []
    for row, sizes in enumerate(_measure_sizes(many, result)):
        # Without friction the sizes say all; a law of friction is asked for each run by itself.
        step, answer = (many, result) if many.slip0 is None else own(row)
        certificates.append(_make_certificate(step, answer, sizes))
    return certificates


class _Sizes(NamedTuple):
    """Hold what the conditions without friction are judged by, and are measured in.

    The fields are arrays of a step, or the largest size of each array.
    """

    unbalanced: Any  # A x + B_nᵀ r_n + B_tᵀ r_t - b: 0 in equilibrium
    overlap: Any  # the negative part of gaps
    tension: Any  # the negative part of r_n
    apart: Any  # the gap where a condition is said to be closed
    loose: Any  # r_n where it is said to be open
    load: Any  # b
    image: Any  # A x
    internal: Any  # K u where x is zero
    x: Any
    guess: Any  # of a step in increments, what x is an increment of
    r_n: Any


def _measure_sizes(
    step: StepProblem, result: StepResult, rest: Array | None = None
) -> list[_Sizes]:
    """Return the largest sizes of a step over all ranks; of several steps, an entry for each.

    The conditions are put in as they stand at the head of ``core.step``. Collective: one reduction.

    Args:
        step: the problem.
        result: its answer.
        rest: what is left of the forces at x (n,), in the place of b - A x.
    """
    surface = step.surface

    # Equilibrium: what is left of A x - b when the contact forces are added to it.
    image = step.A @ result.x if rest is None else step.b - rest
    reactions = surface.reaction_load(result.r_n, result.x.shape[-1], result.r_t)
    unbalanced = image - step.b + reactions

    # Signorini: no overlap and no tension. Where springs carry, the gap grows with the force. A
    # bilateral condition may pull, and its gap is zero.
    gap = step.bound - surface.normal_values(result.x)
    overlap = np.minimum(gap, 0.0)
    tension = np.minimum(result.r_n, 0.0)
    closed = result.active
    if not surface.plain:
        gap = gap + surface.compliance * result.r_n / step.scale
        overlap = np.where(surface.bilateral, 0.0, np.minimum(gap, 0.0))
        tension = np.where(surface.bilateral, 0.0, tension)
        closed = closed | surface.bilateral

    # Complementarity, with the set that the impact law will see: no gap where it says closed, and
    # no force where it says open.
    apart = np.where(closed, gap, 0.0)
    loose = np.where(closed, 0.0, result.r_n)

    arrays = _Sizes(
        unbalanced,
        overlap,
        tension,
        apart,
        loose,
        load=step.b,
        image=image,
        internal=step.b if step.internal is None else step.internal,
        x=result.x,
        guess=step.start,
        r_n=result.r_n,
    )
    largest = _find_largest(surface.comm, arrays)
    return [_Sizes(*sizes) for sizes in (largest if result.x.ndim == 2 else [largest])]


def _make_certificate(step: StepProblem, result: StepResult, sizes: _Sizes) -> Certificate:
    """Return the certificate: each size over the one that it is compared with. Collective.

    Args:
        step: the problem.
        result: its answer.
        sizes: the largest sizes over all ranks.
    """
    # x_ref and r_ref of ``Certificate``: the largest displacement (or velocity), and the largest
    # force, in the units of x and of b.
    length = max(sizes.x, sizes.guess)
    force = max(sizes.load, sizes.internal, sizes.r_n)
    share = ROUNDING_TURNED if step.forces is not None and step.forces.turns else ROUNDING
    rounding = share * step.A.largest * (sizes.x if step.origin is None else length)
    cone, dissipation = _judge_friction(step, result, length, force)
    return Certificate(
        equilibrium=_divide(
            sizes.unbalanced, max(sizes.load, sizes.internal, sizes.image, rounding)
        ),
        penetration=_divide(sizes.overlap, length),
        tension=_divide(sizes.tension, force),
        complementarity=float(
            np.maximum(_divide(sizes.apart, length), _divide(sizes.loose, force))  # keeps NaN
        ),
        cone=cone,
        dissipation=dissipation,
    )


def _judge_friction(
    step: StepProblem, result: StepResult, length: float, force: float
) -> tuple[float, float]:
    """Return (cone, dissipation) of ``Certificate``; zero without friction. Collective.

    cone: how far |r_t| exceeds its limit. dissipation: how far r_t misses the work limit |slip| of
    a point that slips, because of its size or its direction.

    Args:
        step: the problem.
        result: its answer.
        length: the largest displacement (or velocity) of the step.
        force: the largest load or reaction of the step.
    """
    if step.slip0 is None:
        return 0.0, 0.0
    surface = step.surface
    r_t = np.zeros_like(step.slip0) if result.r_t is None else result.r_t

    # The law at the slip rates of the answer, with the limit of its normal reactions.
    slip = surface.tangential_values(result.x) - step.slip0
    limit = ask_limit(step.friction_at(slip), result.r_n, surface.weights, step.scale)
    r_t_size = np.linalg.norm(r_t, axis=1)
    slip_size = np.linalg.norm(slip, axis=1)

    # The two conditions of the law, in newtons and in newton metres.
    beyond = np.maximum(r_t_size - limit, 0.0)
    missing = limit * slip_size - np.sum(r_t * slip, axis=1)

    # A step slides a small part of the way, and rubs with a small part of the inertia.
    beyond_most, missing_most, limit_most, r_t_most, slip_most = _find_largest(
        surface.comm, (beyond, missing, limit, r_t_size, slip_size)
    )
    tangential_force = max(limit_most, r_t_most, ROUNDING**2 * force)
    way = max(slip_most, ROUNDING * length)
    return _divide(beyond_most, tangential_force), _divide(missing_most, tangential_force * way)


def _find_largest(comm: Comm, arrays: Sequence[NDArray[Any]]) -> list[Any]:
    """Return max |a| along the last axis of each array, over all ranks by one reduction.

    Infinity stands for NaN, which no reduction keeps. Of arrays with a row for each of several
    steps it is a list for each step.

    Args:
        comm: the ranks that share the arrays.
        arrays: of any lengths, all of them (…) or all of them (k, …).

    Returns:
        A number for each array, or a list of such lists, one for each of the k steps.
    """
    lengths = tuple([array.shape[-1] for array in arrays])
    if arrays[0].size <= FEW and 0 not in lengths:
        # Small steps cost what calls of numpy cost: one for all arrays, side by side.
        joined = np.abs(np.concatenate(arrays, axis=-1))
        sizes = np.maximum.reduceat(joined, _find_starts(lengths), axis=-1)
    else:
        # Large ones cost the memory that is read and written: no copy.
        highest = [array.max(axis=-1, initial=0.0) for array in arrays]
        lowest = [array.min(axis=-1, initial=0.0) for array in arrays]
        sizes = np.maximum(highest, np.negative(lowest)).T
    sizes = np.fmin(sizes, np.inf)  # which leaves numbers, and infinity for NaN
    return (sizes if comm.size == 1 else comm.max(sizes)).tolist()


@cache
def _find_starts(lengths: tuple[int, ...]) -> list[int]:
    """Return where arrays of these lengths begin when they lie side by side."""
    return list(accumulate(lengths[:-1], initial=0))


def _divide(value: float, reference: float) -> float:
    """Return value / reference, with 0 / 0 = 0: where nothing happens, nothing is wrong.

    It is infinite where the reference alone is zero, and NaN for infinity over infinity: neither
    passes a tolerance.
    """
    if value == 0.0 and reference < np.inf:
        return 0.0
    return value / reference if reference else np.inf
