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
from ..core.checks import counted, flag, number, whole
from ..core.errors import InputError
from ..laws.materials import LinearElastic
from .boundary_mesh import BoundaryMesh
from .boundary_operators import Galerkin, OperatorMatrices, check_body
from .compressed import AHEAD, NUMBERS, CompressedBlocks, compressed_blocks
from .fundamental_solution import TimeKernels
from .quadrature import Orders

DENSE = 50_000_000  # numbers of all blocks beyond which they are compressed
SMALLEST_RATIO, GREATEST_RATIO = 0.05, 8.0  # limits of c_P dt / h


@dataclass(frozen=True, eq=False)
class EnergeticBlocks:
    """Hold the blocks of density 1.

    They depend on the mesh, the wave speeds and the time step only.

    single: (steps, 4n, 4n); double: (steps, 4n, 2n); hyper: (steps, 2n, 2n).
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
    """Raise InputError unless 0.05 <= c_P dt / h <= 8, h the longest element."""
    number("boundary elements", "the time step dt", dt, positive=True, unit="s")
    ratio = c_p * dt / float(mesh.lengths.max())
    if not SMALLEST_RATIO <= ratio <= GREATEST_RATIO:
        what = (
            "enlarge the time step or refine"
            if ratio < SMALLEST_RATIO
            else "reduce the time step or coarsen"
        )
        raise InputError(
            f"boundary elements: c_P dt / h is {ratio:.3g} (h = {mesh.lengths.max():.3g} m, "
            f"dt = {dt:.3g} s), beyond {SMALLEST_RATIO:g} to {GREATEST_RATIO:g}; {what} the mesh"
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
    """Assemble the blocks of `steps` time steps of dt [s]; dense ones take 224 steps n² bytes.

    compressed: whether to keep CompressedBlocks and solve on a circle of frequencies; None does so
    where dense blocks would take 400 MB. threads: how many integrate; answers do not depend on it.
    Raises InputError for a time step far too small or large for the mesh, and for a body too thin
    or sharp for it.
    """
    owner = "boundary elements"
    check_body(mesh, material, orders)
    steps = whole(owner, "the number of time steps", steps, least=1)
    whole(owner, "the number of threads", threads, least=1)
    numbers = 28 * steps * len(mesh) ** 2
    small = numbers <= DENSE if compressed is None else not flag(owner, "compressed", compressed)
    counted(
        owner,
        f"{steps} steps of {len(mesh)} elements",
        numbers,
        "numbers",
        most=NUMBERS * (1 if small else 10),
    )
    check_time_step(mesh, material.c_p, dt)
    galerkin, n, speeds = (
        Galerkin(mesh, material.c_s, orders),
        len(mesh),
        (material.c_p, material.c_s),
    )

    def assembled(
        among: Callable[[int], Mask] | None = None,
    ) -> Iterator[tuple[Array, Array, Array] | None]:
        """Return V^j, K^j, D^j.

        They are right where pairs are ``among`` those of the times j - 1, j and j + 1, all of them
        if None; there is None instead of them where there is no pair at j + 1.
        """

        def at(i: int) -> OperatorMatrices | None:
            some, t = copy(galerkin), i * dt
            some.pairs = galerkin.pairs if among is None else galerkin.pairs.where(among(i))
            if not len(some.pairs):
                return None
            return some.assemble(TimeKernels(t, *speeds), (speeds[1] * t, speeds[0] * t))

        a, b, c, change = (np.zeros(1) for _ in range(4))
        last = steps if small else AHEAD * steps
        with ThreadPoolExecutor(threads) as pool:
            for start in range(1, last + 1, threads):
                # each at a time of its own
                for now in pool.map(at, range(start, min(start + threads, last + 1))):
                    if now is None:
                        yield None
                        continue
                    yield now.single - a, (now.double - b) / dt, (now.hyper - c - change) / dt**2
                    a, b, c, change = now.single, now.double, now.hyper, now.hyper - c

    if not small:
        return compressed_blocks(mesh, galerkin.pairs, speeds, dt, steps, assembled)
    single, double, hyper = (np.empty((steps, a * n, b * n)) for a, b in ((4, 4), (4, 2), (2, 2)))
    for j, blocks in enumerate(assembled()):
        if blocks is not None:
            single[j], double[j], hyper[j] = blocks
    return EnergeticBlocks(mesh, *speeds, dt, single, double, hyper)


def marched(
    blocks: EnergeticBlocks,
    fixed: NDArray[np.bool_],
    forces: Array,
    prescribed: Array | None = None,
    *,
    symmetric: bool = True,
) -> tuple[Array, Array, Array]:
    """Return displacements (steps, 2n, R) at the ends of the steps, for R right-hand sides.

    With them come tractions (steps, 4n, R) and nodal forces (steps, 2n, R) in the steps, reactions
    included. The R right-hand sides are forces (steps, 2n, R), and ``prescribed`` (steps, 2n, R),
    read at ``fixed`` unknowns (2n,) only. For density 1: divide forces by rho before, multiply
    after.
    """
    steps, unknowns, count = forces.shape
    if steps > blocks.steps:
        raise InputError(
            f"boundary elements: the forces have {steps} steps and the operator {blocks.steps}; "
            "assemble it with more steps"
        )
    mass, free = blocks.mesh.mass, ~fixed
    v0 = cho_factor(0.5 * (blocks.single[0] + blocks.single[0].T))
    right = blocks.double[0] + 0.5 * mass
    left = right.T if symmetric else mass.T
    v0_right = cho_solve(v0, right)
    s0 = left @ v0_right
    if symmetric:
        s0 -= blocks.hyper[0]
        s0 = 0.5 * (s0 + s0.T)
    factor = lu_factor(s0[np.ix_(free, free)]) if free.any() else None
    u, p = np.zeros((steps, unknowns, count)), np.empty((steps, 2 * unknowns, count))
    total, before = forces.copy(), np.zeros((unknowns, count))
    for k in range(steps):
        past = summed(blocks.single[k:0:-1], p[:k]) - summed(blocks.double[k:0:-1], u[:k])
        v0_early = cho_solve(v0, 0.5 * mass @ before - past)
        known = left @ v0_early
        if symmetric and k:
            known = known + _adjoint(blocks, p[:k], u[:k])
        if prescribed is not None:
            u[k, fixed] = prescribed[k, fixed] - before[fixed]
        if factor is not None:
            pull = known + s0[:, fixed] @ u[k, fixed]
            u[k, free] = lu_solve(factor, (forces[k] - pull)[free])
        p[k] = v0_right @ u[k] + v0_early
        total[k] = np.where(free[:, None], forces[k], known + s0 @ u[k])
        before = before + u[k]
    return np.cumsum(u, axis=0, out=u), p, total


def _adjoint(blocks: EnergeticBlocks, p: Array, u: Array) -> Array:
    """Return the sum of K' p - D u over the k earlier steps of the symmetric form.

    K' acts on the jumps of p.
    """
    k, jumps = len(p), np.diff(p, axis=0, prepend=0.0)
    adjoint = summed(blocks.double[k:0:-1].swapaxes(1, 2), jumps) - blocks.double[0].T @ p[-1]
    return adjoint - summed(blocks.hyper[k:0:-1], u)


def summed(blocks: Array, values: Array) -> Array:
    """Return sum_l blocks[l] @ values[l], in groups so that the products stay small."""
    total = np.zeros((blocks.shape[1], values.shape[2]))
    for start in range(0, len(blocks), 16):
        total += np.matmul(blocks[start : start + 16], values[start : start + 16]).sum(axis=0)
    return total
