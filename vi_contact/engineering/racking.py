"""Measure the racking of a frame.

It is the shear of four corner points, which no rigid rotation changes.
"""

import numpy as np
from numpy.typing import ArrayLike

from ..core.algebra import Array
from ..core.checks import array
from ..core.errors import InputError


def racking(corners: ArrayLike, displacements: Array) -> tuple[Array, Array]:
    """Return (racking, rotation) of four corners (4, 2) [m] moved by (..., 4, 2) [m].

    Each is (...,), in radians.

    The displacement gradient G that fits the corners best, u = a + G X, gives racking = du_x/dy +
    du_y/dx and rotation = (du_y/dx - du_x/dy)/2, anticlockwise. For a rectangle du_x/dy is the mean
    over its sides, du_y/dx over bottom and top (Wang 1993: the racking ratio is this over the free
    field's shear strain). InputError for corners on one line.
    """
    x = array("racking", "corners", corners, (4, 2), unit="m")
    arms = x - x.mean(axis=0)
    gram = arms.T @ arms
    if np.linalg.eigvalsh(gram)[0] <= 1e-12 * np.trace(gram):
        raise InputError("Racking: the four corners are on one line: give the corners of a frame")
    gradient = np.einsum(
        "...ki,kj->...ij", np.asarray(displacements, dtype=float), arms @ np.linalg.inv(gram)
    )
    return gradient[..., 0, 1] + gradient[..., 1, 0], 0.5 * (
        gradient[..., 1, 0] - gradient[..., 0, 1]
    )
