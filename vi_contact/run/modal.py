"""Find the lowest natural frequencies of a system, for choosing excitations and time steps."""

from typing import Annotated

import numpy as np

from ..core.algebra import Algebra, Array, Matrix, SerialFactor, SerialMatrix
from ..core.arguments import checked
from ..core.errors import InputError
from ..core.quantities import Positive, Remedy
from ..core.system import SemiDiscreteSystem

# of the largest K_ii / M_ii: added to K; below the other a motion is rigid
SHIFT, RIGID = (1e-6, 1e-13)


@checked
def lowest_frequency(
    system: Annotated[SemiDiscreteSystem, Remedy("give a system, such as fem.assemble returns")],
    *,
    max_iterations: Annotated[int, Positive] = 2000,
) -> float:
    """Return f1 [Hz] of K phi = (2 pi f)² M phi without contact.

    It is found by inverse iteration with one factorisation of K.

    The start vector is the static answer to a uniform acceleration in all directions:
    deterministic, and not orthogonal to the first mode of structures that a base motion can excite.
    Raises InputError for a floating body (K singular) and when the iteration does not settle.
    """
    system.refuse_statics_only("lowest_frequency")
    if system.floating:
        raise InputError(
            "the body is not held, so its lowest frequency is zero: clamp a part of it"
        )
    dot = system.algebra.dot
    factor = system.algebra.factor(system.K)
    force = system.M @ (system.influence @ (1.0 + 0.1 * np.arange(system.influence.shape[1])))
    square = 0.0
    for _ in range(max_iterations):
        mode = factor.solve(force)
        inertia = system.M @ mode
        norm = dot(mode, inertia)
        last, square = square, dot(mode, force) / norm
        force = inertia / np.sqrt(norm)
        if abs(square - last) <= 1e-15 * square:
            break
    if not abs(square - last) <= 1e-10 * square:
        raise InputError(
            "the lowest frequency did not settle: give a larger max_iterations, or the frequency"
        )
    return float(np.sqrt(square)) / (2.0 * np.pi)


def natural_modes(
    algebra: Algebra, K: Matrix, M: Matrix, *, count: int = 3, rigid: int = 0
) -> tuple[Array, Array, int]:
    """Return (frequencies, modes, number of rigid motions) of K phi = (2 pi f)² M phi.

    The frequencies [Hz] are the lowest above zero, ascending; their modes phi are (rows, k), of
    this rank's rows.

    rigid: there are no more rigid motions than these. Solved on rank 0, by Lanczos' method and one
    factor of K + s M, which there is where bodies float, too. Collective.
    """
    from scipy.sparse import vstack  # late: no step needs it
    from scipy.sparse.linalg import LinearOperator, eigsh

    parts, found = (
        algebra.comm.gather([algebra.entries(A, np.arange(A.rows)) for A in (K, M)]),
        None,
    )
    if parts is not None:
        k, m = (vstack(rows).tocsc() for rows in zip(*parts, strict=True))
        mass, n = m.diagonal(), k.shape[0]
        scale = float(np.max(k.diagonal()[mass > 0.0] / mass[mass > 0.0]))
        solve = LinearOperator(k.shape, SerialFactor(SerialMatrix(k + SHIFT * scale * m)).solve)
        wanted = {"k": min(count + rigid, n - 1), "v0": np.cos(np.arange(n) ** 2.0)}
        squares, vectors = eigsh(k, M=m, sigma=-SHIFT * scale, OPinv=solve, **wanted)
        order = np.argsort(squares)
        squares, vectors = squares[order], vectors[:, order]
        elastic = np.flatnonzero(squares > RIGID * scale)[:count]
        found = (
            squares[elastic],
            vectors[:, elastic],
            int(np.count_nonzero(squares <= RIGID * scale)),
        )
    squares, vectors, free = algebra.comm.bcast(found)
    first = algebra.first(K.rows)
    return np.sqrt(squares) / (2.0 * np.pi), vectors[first : first + K.rows], free
