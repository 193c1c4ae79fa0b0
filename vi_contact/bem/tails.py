"""Interpolate what is left behind the last wave from a few steps, with a bound of the error.

Entries of a block are integrals of radial functions f_j(r) over distances r, and behind the last
wave the points of these integrals do not move: what interpolates all f_j(r), 0 < r <= r_max, from
steps i interpolates the blocks,

    f_j(r) = sum_i w_ji f_i(r)    =>    V^j = sum_i w_ji V^i,    likewise K^j, D^j.

An interpolative decomposition of a table of the functions chooses the steps (Cheng, Gimbutas,
Martinsson, Rokhlin, SIAM J. Sci. Comput. 26 (2005) 1389). The rows of w add up to one: static parts
are exact. Errors of functions bound those of entries through the lengths of the elements.
"""

import numpy as np
from scipy.linalg import qr, solve_triangular

from ..core.algebra import Array, Indices
from .fundamental_solution import TimeKernels

SHARE = 5e-10  # of its greatest value behind the last wave: what may be lost of a radial function
SAMPLES = 16  # distances at which functions are compared
# The radial functions, in the order of KernelSet: 2 of the single layer, 5 of the double layer, 7
# of the hypersingular operator. Their degrees of homogeneity in (r, t), gradients times r:
DEGREES = (0, 0, 1, 0, 0, 1, 1, 2, 1, 1, 2, 2, 0, 0)
GRADIENTS = [3, 4, 8, 9]


def tail(
    start: int, steps: int, dt: float, speeds: tuple[float, float], h: float
) -> tuple[Indices, Array, Array]:
    """Choose the steps of the tail that are kept.

    Args:
        start: first step of the tail.
        steps: the step behind the last one.
        dt: time step [s].
        speeds: (c_P, c_S) [m/s].
        h: length of the longest element [m].

    Returns:
        The kept steps (q,), the weights (length, q) that give all steps of the tail from them, and
        bounds (3,) of the errors of entries of V, K and D.
    """
    if start >= steps:
        return np.empty(0, int), np.empty((0, 0)), np.zeros(3)
    reach = (start - 1) * dt * speeds[1] - h
    table = _evaluate_radial_functions(reach * _place_samples(SAMPLES), start, steps, dt, speeds)

    # Interpolative decomposition: a QR factorisation with pivots of the table, each function over
    # its greatest value, puts the steps that tell most in front. R gives the others by them.
    flat = (table / np.abs(table).max((0, 2))[:, None]).reshape(len(table), -1)
    r, order = qr(flat.T, mode="r", pivoting=True, check_finite=False)
    rank = int(np.count_nonzero(np.abs(np.diag(r)) > SHARE * np.abs(r[0, 0])))
    weights_of_others = solve_triangular(r[:rank, :rank], r[:rank, rank:]).T
    weights = np.concatenate([np.eye(rank), weights_of_others])[np.argsort(order)]
    weights += (1.0 - weights.sum(1))[:, None] / rank
    chosen = order[:rank]

    # What is lost is measured at other places than the samples.
    check = _evaluate_radial_functions(
        reach * _place_samples(3 * SAMPLES + 1), start, steps, dt, speeds
    )
    lost = np.abs(check - np.tensordot(weights, check[chosen], 1)).max((0, 2))
    return start + chosen, weights, _bound_errors(lost, speeds[1] ** 2, h)


def _place_samples(count: int) -> Array:
    """Return Chebyshev's places (count,) in [0, 1]."""
    return np.sin(0.5 * np.pi * (np.arange(count) + 0.5) / count) ** 2


def _bound_errors(lost: Array, mu: float, h: float) -> Array:
    """Return the bounds (3,) of the errors of entries of V, K and D.

    An entry is an integral over two elements of at most the length h, whose shape functions are at
    most 1 and whose slopes are at most 1/h.

    Args:
        lost: (14,), errors of the radial functions, gradients times r.
        mu: c_S² [m²/s²].
        h: length of the longest element [m].
    """
    # Of the operators that have them: Phi_S, both gradients together, both parts of the tensor G.
    phi_double, phi_hyper = lost[[2, 7]]
    gradient_double, gradient_hyper = lost[[3, 8]] + lost[[4, 9]]
    tensor_single, tensor_double, tensor_hyper = lost[[0, 5, 10]] + lost[[1, 6, 11]]
    inertia = lost[12] + lost[13]

    double = 0.25 * h**2 * gradient_double + 0.5 * h * (phi_double + 2.0 * mu * tensor_double)
    hyper = 0.25 * h**2 * inertia + 4.0 * mu * (phi_hyper + mu * tensor_hyper)
    bounds = [
        0.25 * h**2 * tensor_single,
        2.0 * double,
        4.0 * (hyper + 2.0 * mu * h * gradient_hyper),
    ]
    return np.array(bounds)


def _evaluate_radial_functions(
    r: Array, start: int, steps: int, dt: float, speeds: tuple[float, float]
) -> Array:
    """Return the radial functions of the blocks (steps, 14, points) at distances r (points,) [m].

    The kernels are homogeneous in r and t: those at t = 1 and r/t give all others.

    Args:
        r: (points,), distances [m].
        start: first step.
        steps: the step behind the last one.
        dt: time step [s].
        speeds: (c_P, c_S) [m/s].
    """
    t = dt * np.arange(start - 1, steps + 1)[:, None]
    q = r / t
    kernels = TimeKernels(1.0, *speeds)(q)
    values = np.stack([*kernels.single, *kernels.double, *kernels.hyper], 1)
    values[:, GRADIENTS] *= q[:, None]
    values *= t[:, :, None] ** np.array(DEGREES)[:, None]

    # Blocks are differences in time: the first of V and K, the second of D.
    first = np.diff(values, axis=0)[1:]
    second = np.diff(values[:, 7:], 2, axis=0)
    return np.concatenate([first[:, :2], first[:, 2:7] / dt, second / dt**2], axis=1)
