"""Find the lowest natural frequencies of a system, for choosing excitations and time steps."""

from collections.abc import Sequence
from typing import Annotated

import numpy as np
import scipy.sparse as sp

from ..core.algebra import Algebra, Array, Mask, Matrix, SerialFactor, SerialMatrix
from ..core.arguments import check_arguments
from ..core.errors import InputError
from ..core.quantities import Positive, Remedy
from ..core.system import SemiDiscreteSystem

# both of the largest K_ii / M_ii, an estimate of the largest (2 pi f)²
SHIFT = 1e-6  # K + SHIFT M has a factor, where a body floats too
RIGID = 1e-13  # (2 pi f)² below which a motion meets no stiffness
SETTLED = 1e-15  # relative change of (2 pi f)² at which the inverse iteration ends,
GOOD = 1e-10  # and up to which its last value counts


@check_arguments
def lowest_frequency(
    system: Annotated[SemiDiscreteSystem, Remedy("give a system, such as fem.assemble returns")],
    *,
    max_iterations: Annotated[int, Positive] = 2000,
) -> float:
    """Return f1 [Hz] of K phi = (2 pi f)² M phi without contact.

    K is the reference stiffness of a body that is not linear.

    Outlets of a reservoir are closed.

    By inverse iteration with one factorisation of K. The start vector is the static answer to a
    uniform acceleration in all directions: deterministic, and not orthogonal to the first mode of
    structures that a base motion can excite.

    Raises:
        InputError: the body floats (K is singular), or the iteration does not settle.
    """
    system.refuse_statics_only("lowest_frequency")
    if system.floating:
        raise InputError("the body is not held, so its lowest frequency is zero: fix a part of it")
    dot = system.algebra.dot
    # What meets dashpots alone is held.
    K = system.K
    still: Mask | None = getattr(system.space, "outlets", None)
    if still is not None:
        K = system.algebra.with_identity_rows(K, still)
    factor = system.algebra.factor(K)
    directions = 1.0 + 0.1 * np.arange(system.influence.shape[1])
    force = _hold(system.M @ (system.influence @ directions), still)
    square = 0.0  # (2 pi f)²
    for _ in range(max_iterations):
        # K phi_new = M phi; the Rayleigh quotient phiᵀ K phi / phiᵀ M phi needs no product with K,
        # because K phi_new is the force at hand.
        mode = factor.solve(force)
        inertia = _hold(system.M @ mode, still)
        norm = dot(mode, inertia)
        last = square
        square = dot(mode, force) / norm
        force = inertia / np.sqrt(norm)
        if abs(square - last) <= SETTLED * square:
            break
    if not abs(square - last) <= GOOD * square:
        raise InputError(
            "the lowest frequency did not settle: give a larger max_iterations, or the frequency"
        )
    return float(np.sqrt(square)) / (2.0 * np.pi)


def _hold(force: Array, still: Mask | None) -> Array:
    """Return a force (n,) without its entries at unknowns that are held."""
    return force if still is None else np.where(still, 0.0, force)


def natural_modes(
    algebra: Algebra, K: Matrix, M: Matrix, *, count: int = 3, rigid: int = 0
) -> tuple[Array, Array, int]:
    """Return the lowest modes of K phi = (2 pi f)² M phi that are not rigid motions. Collective.

    Solved on rank 0 by Lanczos' method, shift and invert, with one factor of K + s M, which exists
    where bodies float too.

    Args:
        algebra: of the matrices.
        K: the stiffness.
        M: the mass, which may be zero in some rows.
        count: how many modes there shall be.
        rigid: how many rigid motions there are at most.

    Returns:
        Their frequencies (k,) [Hz], ascending; the modes (rows, k), of this rank's rows; and the
        number of rigid motions.
    """
    # The whole matrices are gathered on rank 0: nobody else has parts.
    rows = np.arange(K.rows)
    parts = algebra.comm.gather([algebra.entries(K, rows), algebra.entries(M, rows)])
    answer = None
    if parts is not None:
        answer = _solve_eigenproblem(parts, count, rigid)
    squares, vectors, free = algebra.comm.bcast(answer)
    first = algebra.first(K.rows)
    return np.sqrt(squares) / (2.0 * np.pi), vectors[first : first + K.rows], free


def _solve_eigenproblem(
    parts: Sequence[Sequence[sp.csr_matrix]], count: int, rigid: int
) -> tuple[Array, Array, int]:
    """Return (2 pi f)² (k,), the modes (n, k), and how many motions are rigid.

    Args:
        parts: the rows of K and of M that each rank has.
        count: how many modes there shall be.
        rigid: how many rigid motions there are at most.
    """
    from scipy.sparse.linalg import LinearOperator, eigsh  # late: no step needs it

    K = sp.vstack([k for k, _ in parts]).tocsc()
    M = sp.vstack([m for _, m in parts]).tocsc()
    n = K.shape[0]
    mass = M.diagonal()
    scale = float(np.max(K.diagonal()[mass > 0.0] / mass[mass > 0.0]))

    # Lanczos' method on (K + s M)⁻¹ M, whose largest values are the lowest frequencies. The start
    # vector is fixed, so that the answer is the same every time.
    factor = SerialFactor(SerialMatrix(K + SHIFT * scale * M))
    squares, vectors = eigsh(
        K,
        M=M,
        k=min(count + rigid, n - 1),
        v0=np.cos(np.arange(n) ** 2.0),
        sigma=-SHIFT * scale,
        OPinv=LinearOperator(K.shape, factor.solve),
    )
    order = np.argsort(squares)
    squares = squares[order]
    vectors = vectors[:, order]
    elastic = np.flatnonzero(squares > RIGID * scale)[:count]
    rigid_motions = int(np.count_nonzero(squares <= RIGID * scale))
    return squares[elastic], vectors[:, elastic], rigid_motions
