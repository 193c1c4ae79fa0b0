"""Check matrices that a user brings: finite, symmetric, and masses that are not negative.

A matrix is seen through its products A w and Aᵀ w with a vector made of the numbers of the
unknowns, in units in which its diagonal is one: nothing is stored, and the answer depends neither
on the ranks nor on the units.
"""

from collections.abc import Iterator
from typing import Any

import numpy as np

from .algebra import Array, Comm, Indices, Matrix, largest, max_abs

# of A w: far above the round-off of assembly, far below what anybody means by another entry
SYMMETRIC = 1e-9
GOLDEN = 0.6180339887498949


def probe(numbers: Any, j: int) -> Array:
    """Return values between -1/2 and 1/2 at these whole numbers; each j gives others.

    Multiples of the golden ratio, without their whole part, never repeat: products with them meet
    every entry of a matrix, and are the same on any number of ranks.

    Args:
        numbers: (n,) those of the owned unknowns.
        j: 0, 1, … for different vectors.
    """
    turns = np.asarray(numbers, dtype=float) * (GOLDEN / (j + 1))
    return np.asarray(turns % 1.0 - 0.5)


def measure_asymmetry(A: Matrix, comm: Comm, numbers: Indices) -> float:
    """Return max |A w - Aᵀ w| / max |A w|, NaN or infinity where A has them. Collective.

    Args:
        A: the matrix.
        comm: the ranks that share it.
        numbers: (n,) those of the owned unknowns, which do not depend on the ranks.
    """
    # In units in which the diagonal of A is one, and what has no diagonal entry is as large as the
    # largest.
    size = np.sqrt(np.abs(A.diagonal()))
    size = np.where(size > 0.0, size, largest(comm, max_abs(size)) or 1.0)
    w = probe(numbers, 0) / size
    with np.errstate(all="ignore"):  # infinite entries
        image = (A @ w) / size
        transposed = A.transpose_apply(w) / size
        error = largest(comm, max_abs(np.nan_to_num(image - transposed, nan=np.inf)))
        scale = largest(comm, max_abs(np.nan_to_num(image, nan=np.inf)))
        return float(np.float64(error) / scale) if scale else error


def find_matrix_defects(
    owner: str, comm: Comm, numbers: Indices, **matrices: Matrix
) -> Iterator[str]:
    """Yield a sentence for each matrix that is not finite, and for each defect of M.

    M must be symmetric and have no masses below zero. Collective: take all sentences on every rank.

    Args:
        owner: class or function that asks, the first word of the sentence.
        comm: the ranks that share the matrices.
        numbers: (n,) those of the owned unknowns, which do not depend on the ranks.
        matrices: the matrices by their names, M among them.
    """
    for name, A in matrices.items():
        defect = measure_asymmetry(A, comm, numbers)
        if not np.isfinite(defect):
            yield f"{owner}: {name} has NaN or infinite entries; give finite numbers"
        elif defect > SYMMETRIC and name == "M":
            yield (
                f"{owner}: M is not symmetric, M w and Mᵀ w differ by {defect:.1g} of their size; "
                "give a symmetric one"
            )

    # No mass is negative, and one of zero stands alone in its row: M has no entry beside it.
    M = matrices["M"]
    masses = M.diagonal()
    if largest(comm, -np.min(masses, initial=0.0)) > 0.0:
        yield f"{owner}: M has a diagonal entry below zero; give masses that are positive, or zero"
    if largest(comm, np.any((masses == 0.0) & (M @ probe(numbers, 0) != 0.0))):
        yield (
            f"{owner}: M has a zero on its diagonal beside other entries; give positive masses, or "
            "empty rows"
        )
