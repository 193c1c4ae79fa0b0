"""Interpolate in time what is left behind the last wave from a few steps.

It comes with a bound of the error.

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
DEGREES = (0, 0, 1, 0, 0, 1, 1, 2, 1, 1, 2, 2, 0, 0)  # of homogeneity in (r, t), gradients times r


def tail(
    start: int, steps: int, dt: float, speeds: tuple[float, float], h: float
) -> tuple[Indices, Array, Array]:
    """Return the kept steps (q,) of the tail from `start` to `steps`.

    With them come weights (length, q) that give all its steps, and bounds (3,) of the errors of
    entries of V, K and D; ``speeds`` are (c_P, c_S) [m/s], ``h`` is the longest element [m].
    """
    if start >= steps:
        return np.empty(0, int), np.empty((0, 0)), np.zeros(3)
    reach = (start - 1) * dt * speeds[1] - h
    places = (
        np.sin(0.5 * np.pi * (np.arange(count) + 0.5) / count) ** 2
        for count in (SAMPLES, 3 * SAMPLES + 1)
    )
    table, check = (_table(reach * place, start, steps, dt, speeds) for place in places)
    flat = (table / np.abs(table).max((0, 2))[:, None]).reshape(len(table), -1)
    r, order = qr(flat.T, mode="r", pivoting=True, check_finite=False)
    rank = int(np.count_nonzero(np.abs(np.diag(r)) > SHARE * np.abs(r[0, 0])))
    weights = np.concatenate([np.eye(rank), solve_triangular(r[:rank, :rank], r[:rank, rank:]).T])[
        np.argsort(order)
    ]
    weights += (1.0 - weights.sum(1))[:, None] / rank
    lost = np.abs(check - np.tensordot(weights, check[order[:rank]], 1)).max((0, 2))
    mu = speeds[1] ** 2  # from here on: errors of entries, gradients being times r
    phi, gradient, tensor = (
        lost[[2, 7]],
        lost[[3, 8]] + lost[[4, 9]],
        lost[[0, 5, 10]] + lost[[1, 6, 11]],
    )
    double = 0.25 * h**2 * gradient[0] + 0.5 * h * (phi[0] + 2.0 * mu * tensor[1])
    hyper = 0.25 * h**2 * (lost[12] + lost[13]) + 4.0 * mu * (phi[1] + mu * tensor[2])
    bounds = [0.25 * h**2 * tensor[0], 2.0 * double, 4.0 * (hyper + 2.0 * mu * h * gradient[1])]
    return start + order[:rank], weights, np.array(bounds)


def _table(r: Array, start: int, steps: int, dt: float, speeds: tuple[float, float]) -> Array:
    """Return (steps, 14, points) the radial functions of the blocks.

    They come from functions that are homogeneous in r and t.
    """
    t = dt * np.arange(start - 1, steps + 1)[:, None]
    q = r / t
    kernels = TimeKernels(1.0, *speeds)(q)
    values = np.stack([*kernels.single, *kernels.double, *kernels.hyper], 1)
    values[:, [3, 4, 8, 9]] *= q[:, None]
    values *= t[:, :, None] ** np.array(DEGREES)[:, None]
    rates, second = np.diff(values, axis=0)[1:], np.diff(values[:, 7:], 2, axis=0)
    return np.concatenate([rates[:, :2], rates[:, 2:7] / dt, second / dt**2], axis=1)
