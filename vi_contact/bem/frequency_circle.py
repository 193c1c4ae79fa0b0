"""Solve boundary value problems of many steps on a circle of frequencies: a dense system each, no march.

With û(z) = sum_j z^j u_j for increments u_j, and so on, the march of energetic.py is a product of series in z,

    p̂ = V̂⁻¹ R̂ û,    R̂ = K̂ + M / (2 (1 - z)),    Ŝ û = F̂
    Ŝ = (1 - z) R̂ᵀ V̂⁻¹ R̂ - D̂     symmetric,    Ŝ = Mᵀ V̂⁻¹ R̂     unsymmetric

whose coefficients are those of a Fourier transform on |z| = R < 1. With L points step j + L adds R^L to step j, and
rounding is magnified by R^-N in the last of N: 1e-12 and 1e6 for L = 2 N. Ch. Lubich, Numer. Math. 52 (1988) 413. What
is added is the motion in steps N to 3 N: it stays small as long as the blocks reach that far, and grows where they are
cut off at N. Whether it did is asked of the equations of the march in two steps.
"""

import numpy as np
from scipy.linalg import lu_factor, lu_solve, solve

from ..core.algebra import Array, Indices, Mask
from ..core.errors import InputError, StepFailure
from .compressed import CompressedBlocks

BALANCE = 1e-18  # R^(L + N)
BATCH = 12  # frequencies whose matrices are held at once
SHARE = 1e-7  # of displacements and of forces: what the equations of the march may miss


def on_circle(
    blocks: CompressedBlocks, fixed: Mask, forces: Array, prescribed: Array | None, units: Indices, symmetric: bool
) -> tuple[Array, Array, Array, Array]:
    """Return W (steps, m, m), the displacements of m unknowns after unit nodal forces on them during step 0, and as
    ``marched`` does displacements (steps, 2n), tractions (steps, 4n), nodal forces (steps, 2n) of one right-hand side:
    forces and prescribed, of fixed unknowns (2n,), both (steps, 2n). Raises InputError for more steps than the blocks
    are for, StepFailure where the right-hand side or a unit force misses the equations of the march."""
    steps, m, mass, free = len(forces), len(units), blocks.mesh.mass, ~fixed
    if steps > blocks.steps:
        raise InputError(f"boundary elements: {steps} steps, blocks for {blocks.steps}; assemble it with more steps")
    count, radius = 2 * steps, BALANCE ** (1.0 / (3 * steps))
    scale, circle = radius ** np.arange(steps), radius * np.exp(-2j * np.pi / count * np.arange(count // 2 + 1))
    columns, W = np.zeros((len(free), m + 1), complex), np.empty((len(circle), m, m), complex)
    columns[units, np.arange(m)] = 1.0
    pulls, kept = np.zeros((steps, len(free), 1 + (m > 0))), [m, m // 2][: 1 + (m > 0)]  # and one unit force, to check
    pulls[..., 0], pulls[0, units[m // 2 : m // 2 + 1], 1:] = forces, 1.0
    given = np.zeros_like(pulls)
    if prescribed is not None:
        given[:, fixed, 0] = prescribed[:, fixed]
    loads, u = (np.fft.rfft(values * scale[:, None, None], count, axis=0)
                for values in (pulls, np.diff(given, axis=0, prepend=0.0)))
    p = np.empty((len(u), 2 * len(free), len(kept)), complex)
    for start in range(0, len(circle), BATCH):
        powers = circle[start : start + BATCH, None] ** np.arange(blocks.reach)
        for i, single, double, hyper in zip(range(start, len(circle)), *blocks.combined(powers), strict=False):
            z = circle[i]
            right = double + (0.5 / (1.0 - z)) * mass
            traction = lu_solve(lu_factor(single, check_finite=False), right, check_finite=False)
            stiffness = (1.0 - z) * (right.T @ traction) - hyper if symmetric else mass.T @ traction
            columns[:, -1] = loads[i, :, 0] - stiffness[:, fixed] @ u[i, fixed, 0]
            moved = np.zeros_like(columns)
            if free.any():
                moved[free] = solve(stiffness[np.ix_(free, free)], columns[free], check_finite=False)
            u[i, free] = moved[np.ix_(free, kept)]
            p[i], loads[i] = traction @ u[i], stiffness @ u[i]
            u[i], W[i] = u[i] / (1.0 - z), moved[units, :-1] / (1.0 - z)
    W, u, p, total = ((np.fft.irfft(values, count, axis=0)[:steps].T / scale).T for values in (W, u, p, loads))
    u[:, fixed], total[:, free] = given[:, fixed], pulls[:, free]
    for column in range(len(kept)):
        _check(blocks, u[..., column], p[..., column], total[..., column], symmetric)
    return W, u[..., 0], p[..., 0], total[..., 0]


def _check(blocks: CompressedBlocks, u: Array, p: Array, forces: Array, symmetric: bool) -> None:
    """Raise StepFailure unless a motion satisfies the equations of the march in the middle and at the end."""
    steps, mass = len(u), 0.5 * blocks.mesh.mass
    changes, jumps = np.diff(u, axis=0, prepend=0.0), np.diff(p, axis=0, prepend=0.0)
    for k in sorted({steps // 2, steps - 1}):
        v, double, adjoint, hyper = blocks.applied(p[k::-1], changes[k::-1], jumps[k::-1])
        found = mass.T @ p[k] + adjoint - hyper if symmetric else 2.0 * mass.T @ p[k]
        lost = [np.abs(v - double - mass @ u[k]).max() / max(np.abs(u @ mass.T).max(), np.finfo(float).tiny),
                np.abs(found - forces[k]).max() / max(np.abs(forces).max(), np.finfo(float).tiny)]
        if not max(lost) <= SHARE:
            raise StepFailure(
                f"boundary elements: the circle of frequencies misses the equations of step {k + 1} of {steps} by "
                f"{max(lost):.1e} of their size, {SHARE:.0e} is the most; assemble with compressed=False, take fewer "
                "steps" + ("" if symmetric else " or the symmetric form"))
