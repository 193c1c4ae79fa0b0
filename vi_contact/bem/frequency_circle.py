"""Solve boundary value problems of many steps on a circle of frequencies: a dense system each, no march.

With û(z) = sum_j z^j u_j for increments u_j, and so on, the march of energetic.py is a product of series in z,

    p̂ = V̂⁻¹ R̂ û,    R̂ = K̂ + M / (2 (1 - z)),    Ŝ û = F̂
    Ŝ = (1 - z) R̂ᵀ V̂⁻¹ R̂ - D̂     symmetric,    Ŝ = Mᵀ V̂⁻¹ R̂     unsymmetric

whose coefficients are those of a Fourier transform on |z| = R < 1. With L points step j + L adds R^L to step j, and
rounding is magnified by R^-N in the last of N: 1e-12 and 1e6 for L = 2 N. Ch. Lubich, Numer. Math. 52 (1988) 413.
"""

import numpy as np
from scipy.linalg import lu_factor, lu_solve, solve

from ..core.algebra import Array, Indices, Mask
from ..core.errors import InputError
from .compressed import CompressedBlocks

BALANCE = 1e-18  # R^(L + N)
BATCH = 12  # frequencies whose matrices are held at once


def on_circle(
    blocks: CompressedBlocks, fixed: Mask, forces: Array, prescribed: Array | None, units: Indices, symmetric: bool
) -> tuple[Array, Array, Array, Array]:
    """Return W (steps, m, m), the displacements of m unknowns after unit nodal forces on them during step 0, and as
    ``marched`` does displacements (steps, 2n), tractions (steps, 4n), nodal forces (steps, 2n) of one right-hand side:
    forces and prescribed, of fixed unknowns (2n,), both (steps, 2n)."""
    steps, m, mass, free = len(forces), len(units), blocks.mesh.mass, ~fixed
    if steps > blocks.steps:
        raise InputError(f"boundary elements: {steps} steps, blocks for {blocks.steps}; assemble it with more steps")
    count, radius = 2 * steps, BALANCE ** (1.0 / (3 * steps))
    scale, circle = radius ** np.arange(steps), radius * np.exp(-2j * np.pi / count * np.arange(count // 2 + 1))
    columns, W = np.zeros((len(free), m + 1), complex), np.empty((len(circle), m, m), complex)
    columns[units, np.arange(m)] = 1.0
    loads = np.fft.rfft(forces * scale[:, None], count, axis=0)
    given = np.zeros_like(forces) if prescribed is None else np.where(fixed, prescribed, 0.0)
    u = np.fft.rfft(np.diff(given, axis=0, prepend=0.0) * scale[:, None], count, axis=0)
    p = np.empty((len(u), 2 * len(free)), complex)
    for start in range(0, len(circle), BATCH):
        powers = circle[start : start + BATCH, None] ** np.arange(blocks.steps)
        for i, single, double, hyper in zip(range(start, len(circle)), *blocks.combined(powers), strict=False):
            z = circle[i]
            right = double + (0.5 / (1.0 - z)) * mass
            traction = lu_solve(lu_factor(single, check_finite=False), right, check_finite=False)
            stiffness = (1.0 - z) * (right.T @ traction) - hyper if symmetric else mass.T @ traction
            columns[:, -1] = loads[i] - stiffness[:, fixed] @ u[i, fixed]
            moved = np.zeros_like(columns)
            if free.any():
                moved[free] = solve(stiffness[np.ix_(free, free)], columns[free], check_finite=False)
            u[i, free] = moved[free, -1]
            p[i], loads[i] = traction @ u[i], stiffness @ u[i]
            u[i], W[i] = u[i] / (1.0 - z), moved[units, :-1] / (1.0 - z)
    W, u, p, total = ((np.fft.irfft(values, count, axis=0)[:steps].T / scale).T for values in (W, u, p, loads))
    return W, u, p, np.where(free, forces, total)
