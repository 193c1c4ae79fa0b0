"""Solve boundary value problems of many steps on a circle of frequencies.

Each frequency has a dense system of its own; nothing is marched.

With û(z) = sum_j z^j u_j for increments u_j, and so on, the march of energetic.py is a product of
series in z,

    p̂ = V̂⁻¹ R̂ û,    R̂ = K̂ + M / (2 (1 - z)),    Ŝ û = F̂
    Ŝ = (1 - z) R̂ᵀ V̂⁻¹ R̂ - D̂     symmetric,    Ŝ = Mᵀ V̂⁻¹ R̂     unsymmetric

whose coefficients are those of a Fourier transform on |z| = R < 1. With L points step j + L adds
R^L to step j, and rounding is magnified by R^-N in the last of N: 1e-12 and 1e6 for L = 2 N. Ch.
Lubich, Numer. Math. 52 (1988) 413. What is added is the motion in steps N to 3 N: it stays small as
long as the blocks reach that far, and grows where they are cut off at N. Growth from N to 2 N says
what wraps around; the equations of the march are asked in two steps.
"""

import numpy as np
from scipy.linalg import lu_factor, lu_solve, solve

from ..core.algebra import Array, Indices, Mask
from ..core.errors import InputError, StepFailure
from .compressed import CompressedBlocks

BALANCE = 1e-18  # R^(L + N)
BATCH = 12  # frequencies whose sums over all steps are one product
DRIFT = 1e-2  # of the momentum of a free body: what rounding may add
# of displacements and of forces: what may wrap around, what the equations of the march may miss
SHARE = 1e-6


def on_circle(
    blocks: CompressedBlocks,
    fixed: Mask,
    forces: Array,
    prescribed: Array | None,
    units: Indices,
    symmetric: bool,
) -> tuple[Array, Array, Array, Array]:
    """Return W (steps, m, m), the displacements of m unknowns after unit forces in step 0.

    The unit nodal forces act on these unknowns. With them come, as from ``marched``, displacements
    (steps, 2n), tractions (steps, 4n), nodal forces (steps, 2n) of one right-hand side: forces and
    prescribed, of fixed unknowns (2n,), both (steps, 2n). Raises InputError for more steps than the
    blocks are for and where rounding of D moves a free body, StepFailure where much wraps around,
    and where the right-hand side or a unit force misses the equations of the march.
    """
    steps, m, mass, free = len(forces), len(units), blocks.mesh.mass, ~fixed
    if steps > blocks.steps:
        raise InputError(
            f"boundary elements: blocks of {blocks.steps} steps for {steps}; assemble it with more "
            "steps"
        )
    if symmetric and not fixed.any():
        _check_drift(blocks, steps)
    count, radius = 2 * steps, BALANCE ** (1.0 / (3 * steps))
    scale, circle = (
        radius ** np.arange(steps),
        radius * np.exp(-2j * np.pi / count * np.arange(count // 2 + 1)),
    )
    columns, W = np.zeros((len(free), m + 1), complex), np.empty((len(circle), m, m), complex)
    columns[units, np.arange(m)] = 1.0
    kept = np.array([m, m // 2][: 1 + (m > 0)])  # the right-hand side; one unit force, to check
    pulls = np.zeros((steps, len(free), len(kept)))
    pulls[..., 0], pulls[0, units[m // 2 : m // 2 + 1], 1:] = forces, 1.0
    given = np.zeros_like(pulls)
    if prescribed is not None:
        given[:, fixed, 0] = prescribed[:, fixed]
    loads, u = (
        np.fft.rfft(values * scale[:, None, None], count, axis=0)
        for values in (pulls, np.diff(given, axis=0, prepend=0.0))
    )
    p = np.empty((len(u), 2 * len(free), len(kept)), complex)
    for start in range(0, len(circle), BATCH):
        powers = circle[start : start + BATCH, None] ** np.arange(blocks.reach)
        for i, (single, double, hyper) in enumerate(blocks.combined(powers), start):
            z = circle[i]
            right = double + (0.5 / (1.0 - z)) * mass
            traction = lu_solve(lu_factor(single, check_finite=False), right, check_finite=False)
            stiffness = (1.0 - z) * (right.T @ traction) - hyper if symmetric else mass.T @ traction
            columns[:, -1] = loads[i, :, 0] - stiffness[:, fixed] @ u[i, fixed, 0]
            moved = np.zeros_like(columns)
            if free.any():
                moved[free] = solve(
                    stiffness[np.ix_(free, free)], columns[free], check_finite=False
                )
            u[i, free] = moved[np.ix_(free, kept)]
            p[i], loads[i] = traction @ u[i], stiffness @ u[i]
            u[i], W[i] = u[i] / (1.0 - z), moved[units, :-1] / (1.0 - z)
    found = [np.fft.irfft(values, count, axis=0) for values in (W, u, p, loads)]
    lost = max(_around(values, radius) for values in found[:2])
    if not lost <= SHARE:
        raise StepFailure(
            _refusal(f"adds {lost:.1e} of the motion, which grows behind step {steps}", symmetric)
        )
    compliance, *motion = ((values[:steps].T / scale).T for values in found)
    motion[0][:, fixed], motion[2][:, free] = given[:, fixed], pulls[:, free]
    for column in reversed(range(len(kept))):
        moves, pressed, total = (values[..., column] for values in motion)
        _check(blocks, moves, pressed, total, symmetric)
    return compliance, moves, pressed, total


def _check(blocks: CompressedBlocks, u: Array, p: Array, forces: Array, symmetric: bool) -> None:
    """Raise StepFailure unless a motion satisfies the equations of the march.

    It is checked in the middle and at the end.
    """
    steps, mass = len(u), 0.5 * blocks.mesh.mass
    changes, jumps = np.diff(u, axis=0, prepend=0.0), np.diff(p, axis=0, prepend=0.0)
    for k in sorted({steps // 2, steps - 1}):
        v, double, adjoint, hyper = blocks.applied(p[k::-1], changes[k::-1], jumps[k::-1])
        found = mass.T @ p[k] + adjoint - hyper if symmetric else 2.0 * mass.T @ p[k]
        lost = [
            np.abs(v - double - mass @ u[k]).max()
            / max(np.abs(u @ mass.T).max(), np.finfo(float).tiny),
            np.abs(found - forces[k]).max() / max(np.abs(forces).max(), np.finfo(float).tiny),
        ]
        if not max(lost) <= SHARE:
            what = f"misses the equations of step {k + 1} of {steps} by a share of {max(lost):.1e}"
            raise StepFailure(_refusal(what, symmetric))


def _around(values: Array, radius: float) -> float:
    """Return what wraps around onto the last of N steps.

    It is a share, which holds if growth from N to 2 N goes on to 3 N.
    """
    size = np.abs(values.reshape(len(values), -1)).max(1, initial=0.0) / radius ** np.arange(
        len(values)
    )
    near, far = size[: len(values) // 2].max(), size[-1 - len(values) // 16 :].max()
    return float(radius ** len(values) * (far / near) ** 2) if near else 0.0


def _refusal(what: str, symmetric: bool) -> str:
    """Return the sentence that names the fault and the remedies."""
    return (
        f"boundary elements: the compressed operator {what}, and {SHARE:.0e} is the limit; "
        "assemble with compressed=False, take fewer "
        "steps" + ("" if symmetric else " or the symmetric form")
    )


def _check_drift(blocks: CompressedBlocks, steps: int) -> None:
    """Raise InputError where rounding of the second differences D matters.

    What it would change is the momentum of a drifting body.

    Behind the last wave the sum of D^j over steps j of a translation vanishes like t^-3; what it
    has instead is force.
    """
    n = len(blocks.mesh)
    if steps < 4 * max(part.smooth for part in blocks.stretches):
        return
    ones = np.zeros((steps, 2 * n))
    ones[steps // 2 :, :n] = 1.0
    force = np.abs(
        blocks.applied(np.zeros((steps, 4 * n)), ones, np.zeros((steps, 4 * n)))[3]
    ).max()
    if force * steps * blocks.dt**2 > DRIFT * abs(blocks.mesh.area):
        raise InputError(
            f"boundary elements: in {steps} steps rounding errors move a free body; take fewer "
            "steps, hold the body, or take the unsymmetric form"
        )
