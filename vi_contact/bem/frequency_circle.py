"""Solve boundary value problems of many steps on a circle of frequencies.

Each frequency has a dense system of its own; nothing is marched.

With û(z) = sum_j z^j u_j for increments u_j, and likewise for p and F, the march of energetic.py is
a product of series in z,

    p̂ = V̂⁻¹ R̂ û,    R̂ = K̂ + M / (2 (1 - z)),    Ŝ û = F̂
    Ŝ = (1 - z) R̂ᵀ V̂⁻¹ R̂ - D̂     symmetric,    Ŝ = Mᵀ V̂⁻¹ R̂     unsymmetric

whose coefficients are those of a Fourier transform on |z| = R < 1. With L points step j + L adds
R^L to step j, and rounding is magnified by R^-N in the last of N: 1e-12 and 1e6 for L = 2 N. Ch.
Lubich, Numer. Math. 52 (1988) 413. What is added is the motion in steps N to 3 N: it stays small as
long as the blocks reach that far, and grows where they are cut off at N. Growth from N to 2 N says
what wraps around; the equations of the march are asked in two steps.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lu_factor, lu_solve, solve

from ..core.algebra import Array, Indices, Mask
from ..core.errors import InputError, StepFailure
from .compressed import CompressedBlocks

BALANCE = 1e-18  # R^(L + N): rounding and wrapping are then of like size
BATCH = 12  # frequencies whose sums over all steps are one product
DRIFT = 1e-2  # of the momentum of a free body: what rounding may add
# of displacements and of forces: what may wrap around, what the equations of the march may miss
SHARE = 1e-6
TINY = np.finfo(float).tiny


def solve_on_circle(
    blocks: CompressedBlocks,
    fixed: Mask,
    forces: Array,
    prescribed: Array | None,
    units: Indices,
    *,
    symmetric: bool,
) -> tuple[Array, Array, Array, Array]:
    """Solve for one right-hand side, and for unit forces in step 0, in all steps at once.

    Args:
        blocks: those of the body, of density 1.
        fixed: (2n,), which unknowns are prescribed.
        forces: (steps, 2n), nodal forces over rho.
        prescribed: (steps, 2n), displacements of the fixed unknowns [m]; None for zero.
        units: numbers of the m unknowns on which unit nodal forces act; there may be none.
        symmetric: whether to solve the symmetric form.

    Returns:
        W (steps, m, m), the displacements of these unknowns after the unit forces; and, as from
        ``march_blocks``, displacements (steps, 2n), tractions (steps, 4n) and nodal forces (steps,
        2n) of the right-hand side.

    Raises:
        InputError: more steps than the blocks are for; rounding of D that moves a free body.
        StepFailure: much that wraps around; a right-hand side or a unit force that misses the
            equations of the march.
    """
    steps = len(forces)
    m = len(units)
    free = ~fixed
    if steps > blocks.steps:
        raise InputError(
            f"boundary elements: blocks of {blocks.steps} steps for {steps}; assemble it with more "
            "steps"
        )
    if symmetric and not fixed.any():
        _refuse_drift(blocks, steps)

    # The upper half of the circle: all series are real.
    count = 2 * steps
    radius = BALANCE ** (1.0 / (3 * steps))
    scale = radius ** np.arange(steps)
    circle = radius * np.exp(-2j * np.pi / count * np.arange(count // 2 + 1))

    # Of all unit forces one is kept whole, in order to check it.
    one_unit = units[m // 2 : m // 2 + 1]
    pulls, prescribed_columns = _gather_columns(forces, fixed, prescribed, one_unit)

    def transform(values: Array) -> NDArray:
        """Return the values at the frequencies: the transform of what is scaled by R^j."""
        return np.fft.rfft(values * scale[:, None, None], count, axis=0)

    loads = transform(pulls)
    u = transform(np.diff(prescribed_columns, axis=0, prepend=0.0))
    W, p = _solve_frequencies(blocks, circle, fixed, units, u, loads, symmetric=symmetric)

    # Back to the steps, of which there are twice as many as asked for.
    histories = [np.fft.irfft(values, count, axis=0) for values in (W, u, p, loads)]
    lost = max(_estimate_wrapped_share(values, radius) for values in histories[:2])
    if not lost <= SHARE:
        raise StepFailure(
            _write_refusal(
                f"adds {lost:.1e} of the motion, which grows behind step {steps}", symmetric
            )
        )
    compliance, motions, tractions, total = ((values[:steps].T / scale).T for values in histories)
    motions[:, fixed] = prescribed_columns[:, fixed]
    total[:, free] = pulls[:, free]

    # The unit force is checked first, then the right-hand side.
    for column in reversed(range(motions.shape[-1])):
        _check_motion(
            blocks, motions[..., column], tractions[..., column], total[..., column], symmetric
        )
    return compliance, motions[..., 0], tractions[..., 0], total[..., 0]


def _solve_frequencies(
    blocks: CompressedBlocks,
    circle: NDArray,
    fixed: Mask,
    units: Indices,
    u: NDArray,
    loads: NDArray,
    *,
    symmetric: bool,
) -> tuple[NDArray, NDArray]:
    """Solve at every frequency, for the right-hand side and for all unit forces.

    Args:
        blocks: those of the body.
        circle: (f,), the frequencies, places on the circle.
        fixed: (2n,), which unknowns are prescribed.
        units: numbers of the m unknowns on which unit forces act.
        u: (f, 2n, 1 or 2), increments of the fixed unknowns of the right-hand side and of the unit
            force in the middle, where there is one; becomes all their displacements.
        loads: (f, 2n, 1 or 2), nodal forces on the free unknowns; becomes all nodal forces.
        symmetric: which form to solve.

    Returns:
        W (f, m, m), and the tractions (f, 4n, 1 or 2).
    """
    m = len(units)
    mass = blocks.mesh.mass
    free = ~fixed
    kept_columns = np.array([m, m // 2][: u.shape[-1]])
    p = np.empty((len(u), 2 * len(free), len(kept_columns)), complex)
    W = np.empty((len(circle), m, m), complex)
    columns = np.zeros((len(free), m + 1), complex)
    columns[units, np.arange(m)] = 1.0
    for start in range(0, len(circle), BATCH):
        powers = circle[start : start + BATCH, None] ** np.arange(blocks.reach)
        for i, (single, double, hyper) in enumerate(blocks.combine(powers), start):
            z = circle[i]
            traction, stiffness = _form_operators(single, double, hyper, mass, z, symmetric)

            # Free increments after the loads and after unit forces; those of fixed unknowns are
            # known.
            columns[:, -1] = loads[i, :, 0] - stiffness[:, fixed] @ u[i, fixed, 0]
            increments = np.zeros_like(columns)
            if free.any():
                operator = stiffness[np.ix_(free, free)]
                increments[free] = solve(operator, columns[free], check_finite=False)
            u[i, free] = increments[np.ix_(free, kept_columns)]
            p[i] = traction @ u[i]
            loads[i] = stiffness @ u[i]

            # The sum of increments is a division by 1 - z.
            u[i] = u[i] / (1.0 - z)
            W[i] = increments[units, :-1] / (1.0 - z)
    return W, p


def _gather_columns(
    forces: Array, fixed: Mask, prescribed: Array | None, one_unit: Indices
) -> tuple[Array, Array]:
    """Return nodal forces and prescribed displacements (steps, 2n, 1 or 2) in time.

    The first column is the right-hand side. The second one, where there is a unit force to check,
    is this force in step 0.

    Args:
        forces: (steps, 2n), nodal forces over rho of the right-hand side.
        fixed: (2n,), which unknowns are prescribed.
        prescribed: (steps, 2n), displacements of the fixed unknowns [m]; None for zero.
        one_unit: number of the unknown of the unit force, or none.
    """
    pulls = np.zeros((*forces.shape, 1 + len(one_unit)))
    pulls[..., 0] = forces
    pulls[0, one_unit, 1:] = 1.0
    displacements = np.zeros_like(pulls)
    if prescribed is not None:
        displacements[:, fixed, 0] = prescribed[:, fixed]
    return pulls, displacements


def _form_operators(
    single: NDArray, double: NDArray, hyper: NDArray, mass: Array, z: complex, symmetric: bool
) -> tuple[NDArray, NDArray]:
    """Return the operators of one frequency, from increments of displacement.

    The first, V⁻¹ R (4n, 2n), is that to tractions; the second, S (2n, 2n), to nodal forces.

    Args:
        single: V (4n, 4n) at this frequency.
        double: K (4n, 2n).
        hyper: D (2n, 2n).
        mass: M (4n, 2n) [m].
        z: the frequency, a place on the circle.
        symmetric: which form S has.
    """
    right = double + (0.5 / (1.0 - z)) * mass
    traction = lu_solve(lu_factor(single, check_finite=False), right, check_finite=False)
    if not symmetric:
        return traction, mass.T @ traction
    return traction, (1.0 - z) * (right.T @ traction) - hyper


def _check_motion(
    blocks: CompressedBlocks, u: Array, p: Array, forces: Array, symmetric: bool
) -> None:
    """Raise StepFailure unless a motion satisfies the equations of the march.

    It is checked in the middle and at the end.

    Args:
        blocks: those of the body.
        u: (steps, 2n), displacements.
        p: (steps, 4n), tractions over rho.
        forces: (steps, 2n), nodal forces over rho.
        symmetric: which form was solved.
    """
    steps = len(u)
    mass = 0.5 * blocks.mesh.mass
    changes = np.diff(u, axis=0, prepend=0.0)
    jumps = np.diff(p, axis=0, prepend=0.0)
    largest_moment = max(np.abs(u @ mass.T).max(), TINY)
    largest_force = max(np.abs(forces).max(), TINY)
    for k in sorted({steps // 2, steps - 1}):
        single, double, adjoint, hyper = blocks.apply(p[k::-1], changes[k::-1], jumps[k::-1])
        nodal = mass.T @ p[k] + adjoint - hyper if symmetric else 2.0 * mass.T @ p[k]
        first_equation = np.abs(single - double - mass @ u[k]).max() / largest_moment
        second_equation = np.abs(nodal - forces[k]).max() / largest_force
        lost = max(first_equation, second_equation)
        if not lost <= SHARE:
            fault = f"misses the equations of step {k + 1} of {steps} by a share of {lost:.1e}"
            raise StepFailure(_write_refusal(fault, symmetric))


def _estimate_wrapped_share(values: Array, radius: float) -> float:
    """Return which share of the motion wraps around onto the last of N steps.

    Growth from N to 2 N steps is taken to go on to 3 N.
    """
    points = len(values)
    largest = np.abs(values.reshape(points, -1)).max(1, initial=0.0)
    size = largest / radius ** np.arange(points)
    near = size[: points // 2].max()
    far = size[-1 - points // 16 :].max()
    return float(radius**points * (far / near) ** 2) if near else 0.0


def _write_refusal(fault: str, symmetric: bool) -> str:
    """Return the sentence that names the fault and the remedies."""
    other_form = "" if symmetric else " or the symmetric form"
    return (
        f"boundary elements: the compressed operator {fault}, and {SHARE:.0e} is the limit; "
        f"assemble with compressed=False, take fewer steps{other_form}"
    )


def _refuse_drift(blocks: CompressedBlocks, steps: int) -> None:
    """Raise InputError where rounding of the second differences D moves a free body.

    Behind the last wave the sum of D^j over steps j of a translation vanishes like t^-3. What it
    has instead is a force, whose impulse is compared with the momentum of the body.
    """
    n = len(blocks.mesh)
    if steps < 4 * max(part.smooth for part in blocks.stretches):
        return
    translation = np.zeros((steps, 2 * n))
    translation[steps // 2 :, :n] = 1.0
    nothing = np.zeros((steps, 4 * n))
    _, _, _, hyper = blocks.apply(nothing, translation, nothing)
    force = np.abs(hyper).max()
    if force * steps * blocks.dt**2 > DRIFT * abs(blocks.mesh.area):
        raise InputError(
            f"boundary elements: in {steps} steps rounding errors move a free body; take fewer "
            "steps, hold the body, or take the unsymmetric form"
        )
