"""Solve with a well-conditioned matrix, such as a mass matrix, by conjugate gradients."""

import numpy as np

from .algebra import Algebra, Array, Mask, Matrix
from .errors import StepFailure

# The residual at the end, of the first one. The one that conjugate gradients carry along goes on
# falling where the true one stays at round-off.
SOLVED = 1e-15
MOST_ITERATIONS = 2000  # a consistent mass matrix takes some fifty


def solve_free(algebra: Algebra, A: Matrix, b: Array, held: Mask, x: Array) -> Array:
    """Return x of A x = b in the rows that are not held. Collective.

    The method is conjugate gradients to round-off, preconditioned by the diagonal: a product and
    two reductions of one number an iteration.

    Args:
        algebra: that of the matrix.
        A: the matrix, symmetric and positive definite on unknowns that are not held.
        b: right-hand side (n,).
        held: (n,) True for unknowns that keep their values.
        x: (n,) values of held unknowns, and a first guess of the others.

    Raises:
        StepFailure: it takes too many iterations, or meets NaN.
    """
    diagonal = A.diagonal()
    inverse = np.divide(1.0, diagonal, out=np.zeros(len(b)), where=~held & (diagonal != 0.0))

    # r is the residual, z = D⁻¹ r, and size = r·z, the square of the residual in that norm.
    x = x.copy()
    r = np.where(held, 0.0, b - (A @ x))
    z = inverse * r
    size = algebra.dot(r, z)
    goal = SOLVED**2 * size
    direction = np.zeros(len(b))
    turn = 0.0  # share of the last direction in the next one: Fletcher and Reeves
    for _ in range(MOST_ITERATIONS):
        if not np.isfinite(size):
            break
        if size <= goal:
            return x
        direction = z + turn * direction
        image = np.where(held, 0.0, A @ direction)
        step = size / algebra.dot(direction, image)
        x += step * direction
        r -= step * image
        z = inverse * r
        last_size = size
        size = algebra.dot(r, z)
        turn = size / last_size
    raise StepFailure(
        f"conjugate gradients on a mass matrix did not end within {MOST_ITERATIONS} iterations: "
        "check loads and velocities for NaN, and materials for densities a million times as large "
        "as others"
    )
