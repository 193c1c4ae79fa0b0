"""March the energetic space-time Galerkin method on in time.

It is a block Toeplitz system (docs/theory/bem.md).

Tractions are constant, displacements linear in each time step; the first equation is tested with
constants, which is collocation at the ends of the steps, the second with the rates of
displacements, which is the mean over a step. With A, B, C the operators integrated once, twice,
three times and u_l the increment of the displacement in step l:

    V^j = A_(j+1) - A_j,  K^j = (B_(j+1) - B_j)/dt,
    D^j = (C_(j+1) - 2 C_j + C_(j-1))/dt²,  K'^j = (K^j - K^(j-1))ᵀ
    sum_l V^(k-l) p_l = sum_l (K^(k-l) + M/2) u_l              both forms
    Mᵀ p_k/2 + sum_l K'^(k-l) p_l - D^(k-l) u_l = F_k          symmetric
    Mᵀ p_k                                      = F_k          unsymmetric

F_k is the nodal force [N/m], the mean over step k. In the symmetric form the work sum_k F_k.u_k is
a positive definite quadratic form of the history of u: the energy of the body, from boundary data
alone.
"""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from copy import copy
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve, lu_factor, lu_solve

from ..core.algebra import Array, Mask
from ..core.checks import check_count, flag, number, whole
from ..core.errors import InputError
from ..laws.materials import LinearElastic
from .boundary_mesh import BoundaryMesh
from .boundary_operators import Galerkin, OperatorMatrices, check_body
from .compressed import AHEAD, NUMBERS, CompressedBlocks, compress_blocks
from .fundamental_solution import TimeKernels
from .quadrature import Orders

DENSE = 50_000_000  # numbers of all blocks beyond which they are compressed
SMALLEST_RATIO = 0.05  # of c_P dt / h
GREATEST_RATIO = 8.0


@dataclass(frozen=True, eq=False)
class EnergeticBlocks:
    """Hold the blocks V^j, K^j and D^j of density 1, for j from 0 to steps - 1.

    They depend on the mesh, the wave speeds and the time step only.

    Attributes:
        mesh: the boundary, of n elements.
        c_p: speed of pressure waves [m/s].
        c_s: speed of shear waves [m/s].
        dt: time step [s].
        single: (steps, 4n, 4n) V^j.
        double: (steps, 4n, 2n) K^j.
        hyper: (steps, 2n, 2n) D^j.
    """

    mesh: BoundaryMesh
    c_p: float
    c_s: float
    dt: float
    single: Array
    double: Array
    hyper: Array

    @property
    def steps(self) -> int:
        """Return the number of time steps."""
        return len(self.single)


def check_time_step(mesh: BoundaryMesh, c_p: float, dt: float) -> None:
    """Raise InputError unless 0.05 <= c_P dt / h <= 8, h the longest element.

    Args:
        mesh: the boundary.
        c_p: speed of pressure waves [m/s].
        dt: time step [s].
    """
    number("boundary elements", "the time step dt", dt, positive=True, unit="s")
    ratio = c_p * dt / float(mesh.lengths.max())
    if SMALLEST_RATIO <= ratio <= GREATEST_RATIO:
        return
    if ratio < SMALLEST_RATIO:
        remedy = "enlarge the time step or refine"
    else:
        remedy = "reduce the time step or coarsen"
    raise InputError(
        f"boundary elements: c_P dt / h is {ratio:.3g} (h = {mesh.lengths.max():.3g} m, "
        f"dt = {dt:.3g} s), beyond {SMALLEST_RATIO:g} to {GREATEST_RATIO:g}; {remedy} the mesh"
    )


def energetic_blocks(
    mesh: BoundaryMesh,
    material: LinearElastic,
    *,
    dt: float,
    steps: int,
    orders: Orders = Orders(),
    compressed: bool | None = None,
    threads: int = 1,
) -> EnergeticBlocks | CompressedBlocks:
    """Assemble the blocks of all time steps; dense ones take 224 steps n² bytes.

    Args:
        mesh: the boundary, of n elements.
        material: of the body. Its density has no effect on the blocks beyond the wave speeds.
        dt: time step [s].
        steps: number of time steps.
        orders: numbers of Gauss points.
        compressed: whether to keep ``CompressedBlocks`` and solve on a circle of frequencies. None
            does so where dense blocks would take more than 400 MB.
        threads: how many threads integrate. Answers do not depend on it.

    Returns:
        The blocks, dense or compressed.

    Raises:
        InputError: a time step far too small or large for the mesh; a body too thin or too sharp
            for the mesh.
    """
    owner = "boundary elements"
    check_body(mesh, material, orders)
    steps = whole(owner, "the number of time steps", steps, least=1)
    whole(owner, "the number of threads", threads, least=1)
    n = len(mesh)
    numbers = 28 * steps * n**2
    dense = numbers <= DENSE if compressed is None else not flag(owner, "compressed", compressed)
    most = NUMBERS if dense else 10 * NUMBERS
    check_count(owner, f"{steps} steps of {n} elements", numbers, "numbers", most=most)
    check_time_step(mesh, material.c_p, dt)
    galerkin = Galerkin(mesh, material.c_s, orders)
    speeds = (material.c_p, material.c_s)

    def assemble_blocks(
        among: Callable[[int], Mask] | None = None,
    ) -> Iterator[tuple[Array, Array, Array] | None]:
        """Yield V^j, K^j, D^j for one step after the other.

        They are right for pairs that are ``among`` those of the times j - 1, j and j + 1, or for
        all pairs if it is None. Where there is no pair at j + 1, None is yielded instead.
        """
        last = steps if dense else AHEAD * steps
        return _difference_blocks(galerkin, speeds, dt, last, threads, among)

    if not dense:
        return compress_blocks(mesh, galerkin.pairs, speeds, dt, steps, assemble_blocks)
    single = np.empty((steps, 4 * n, 4 * n))
    double = np.empty((steps, 4 * n, 2 * n))
    hyper = np.empty((steps, 2 * n, 2 * n))
    for j, blocks in enumerate(assemble_blocks()):
        if blocks is not None:
            single[j], double[j], hyper[j] = blocks
    return EnergeticBlocks(mesh, *speeds, dt, single, double, hyper)


def _difference_blocks(
    galerkin: Galerkin,
    speeds: tuple[float, float],
    dt: float,
    last: int,
    threads: int,
    among: Callable[[int], Mask] | None,
) -> Iterator[tuple[Array, Array, Array] | None]:
    """Yield V^j, K^j, D^j: differences of the integrated operators A, B, C over their times.

    Args:
        galerkin: integrates the operators.
        speeds: (c_P, c_S) [m/s].
        dt: time step [s].
        last: number of times dt, 2 dt, ... at which the operators are integrated.
        threads: how many of them are integrated at once.
        among: the pairs (p,) to integrate at time i dt; None for all.
    """

    def operators_at(i: int) -> OperatorMatrices | None:
        """Return A, B, C at the time i dt, or None where no pair is wanted."""
        t = i * dt
        some = copy(galerkin)
        some.pairs = galerkin.pairs if among is None else galerkin.pairs.where(among(i))
        if not len(some.pairs):
            return None
        return some.assemble(TimeKernels(t, *speeds), (speeds[1] * t, speeds[0] * t))

    # What was there one time before: A, B, C, and the last increment of C.
    single_before = np.zeros(1)
    double_before = np.zeros(1)
    hyper_before = np.zeros(1)
    hyper_change = np.zeros(1)
    with ThreadPoolExecutor(threads) as pool:
        for start in range(1, last + 1, threads):
            times = range(start, min(start + threads, last + 1))  # one for each thread
            for now in pool.map(operators_at, times):
                if now is None:
                    yield None
                    continue
                V = now.single - single_before
                K = (now.double - double_before) / dt
                D = (now.hyper - hyper_before - hyper_change) / dt**2
                yield V, K, D
                hyper_change = now.hyper - hyper_before
                single_before = now.single
                double_before = now.double
                hyper_before = now.hyper


def march_blocks(
    blocks: EnergeticBlocks,
    fixed: NDArray[np.bool_],
    forces: Array,
    prescribed: Array | None = None,
    *,
    symmetric: bool = True,
) -> tuple[Array, Array, Array]:
    """March through all steps for R right-hand sides at once.

    Args:
        blocks: those of the body, of density 1.
        fixed: (2n,), which unknowns are prescribed.
        forces: (steps, 2n, R), nodal forces over rho, means over the steps.
        prescribed: (steps, 2n, R), displacements [m] at the ends of the steps, read at ``fixed``
            unknowns only; None for zero.
        symmetric: whether to march the symmetric form.

    Returns:
        Displacements (steps, 2n, R) at the ends of the steps [m], tractions over rho (steps, 4n,
        R) and nodal forces over rho (steps, 2n, R) in the steps, reactions included.

    Raises:
        InputError: forces of more steps than the blocks have.
    """
    steps, unknowns, count = forces.shape
    if steps > blocks.steps:
        raise InputError(
            f"boundary elements: the forces have {steps} steps and the operator {blocks.steps}; "
            "assemble it with more steps"
        )
    mass = blocks.mesh.mass
    free = ~fixed

    # Eliminate the traction of a step: p = V0⁻¹ (K0 + M/2) u + ..., and with it the operator S0 of
    # one step, from increments of displacement to nodal forces.
    single = blocks.single[0]
    v0 = cho_factor(0.5 * (single + single.T))
    right = blocks.double[0] + 0.5 * mass
    tested = right.T if symmetric else mass.T
    v0_right = cho_solve(v0, right)
    s0 = tested @ v0_right
    if symmetric:
        s0 -= blocks.hyper[0]
        s0 = 0.5 * (s0 + s0.T)
    factor = lu_factor(s0[np.ix_(free, free)]) if free.any() else None

    u = np.zeros((steps, unknowns, count))  # increments, until they are added up at the end
    p = np.empty((steps, 2 * unknowns, count))
    total = forces.copy()
    before = np.zeros((unknowns, count))  # displacement at the start of the step
    for k in range(steps):
        # What earlier steps have left: traction at no increment, and the nodal forces of it.
        past = sum_products(blocks.single[k:0:-1], p[:k])
        past = past - sum_products(blocks.double[k:0:-1], u[:k])
        v0_early = cho_solve(v0, 0.5 * mass @ before - past)
        known = tested @ v0_early
        if symmetric and k:
            known = known + _sum_adjoint(blocks, p[:k], u[:k])

        # Solve for the free increments; then tractions, and reactions of the fixed unknowns.
        if prescribed is not None:
            u[k, fixed] = prescribed[k, fixed] - before[fixed]
        if factor is not None:
            pull = known + s0[:, fixed] @ u[k, fixed]
            u[k, free] = lu_solve(factor, (forces[k] - pull)[free])
        p[k] = v0_right @ u[k] + v0_early
        total[k] = np.where(free[:, None], forces[k], known + s0 @ u[k])
        before = before + u[k]
    return np.cumsum(u, axis=0, out=u), p, total


def _sum_adjoint(blocks: EnergeticBlocks, p: Array, u: Array) -> Array:
    """Return the sum of K' p - D u over the k earlier steps of the symmetric form.

    K'^j = (K^j - K^(j-1))ᵀ: its sum with p is that of K^jᵀ with the jumps of p, but for the last
    traction, which K^0 has not met yet.
    """
    k = len(p)
    jumps = np.diff(p, axis=0, prepend=0.0)
    adjoint = sum_products(blocks.double[k:0:-1].swapaxes(1, 2), jumps) - blocks.double[0].T @ p[-1]
    return adjoint - sum_products(blocks.hyper[k:0:-1], u)


def sum_products(blocks: Array, values: Array) -> Array:
    """Return sum_l blocks[l] @ values[l], of (l, a, b) and (l, b, R).

    Groups of steps keep the products small.
    """
    total = np.zeros((blocks.shape[1], values.shape[2]))
    for start in range(0, len(blocks), 16):
        group = slice(start, start + 16)
        total += np.matmul(blocks[group], values[group]).sum(axis=0)
    return total
