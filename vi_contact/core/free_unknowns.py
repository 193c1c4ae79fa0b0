"""Solve with a well-conditioned matrix, as mass matrices are, without a factor.

The method is conjugate gradients to round-off.
"""

import numpy as np

from .algebra import Algebra, Array, Mask, Matrix
from .errors import StepFailure

# of the first residual: what conjugate gradients carry along falls on where the true one stays
ROUND_OFF = 1e-15
PATIENCE = 2000  # iterations; a consistent mass matrix takes some fifty


def solve_free(algebra: Algebra, A: Matrix, b: Array, held: Mask, x: Array) -> Array:
    """Return x of A x = b in the rows that are not held.

    Held unknowns keep the values that ``x`` has.

    A is symmetric and positive definite on the others; it is preconditioned by its diagonal.
    StepFailure when it takes too long. Collective; a product and two reductions of one number an
    iteration.
    """
    diagonal = A.diagonal()
    inverse = np.divide(1.0, diagonal, out=np.zeros(len(b)), where=~held & (diagonal != 0.0))
    x, d = x.copy(), np.zeros(len(b))
    r = np.where(held, 0.0, b - (A @ x))
    z = inverse * r
    size = algebra.dot(r, z)
    goal, before = ROUND_OFF**2 * size, 1.0
    for iteration in range(PATIENCE):
        if not np.isfinite(size):
            break
        if size <= goal:
            return x
        d = z + (size / before if iteration else 0.0) * d
        image = np.where(held, 0.0, A @ d)
        step = size / algebra.dot(d, image)
        x += step * d
        r -= step * image
        z = inverse * r
        before, size = size, algebra.dot(r, z)
    raise StepFailure(
        f"conjugate gradients on a mass matrix did not end within {PATIENCE} iterations: check "
        "loads and velocities for NaN, and materials for densities a million times as large as "
        "others"
    )
