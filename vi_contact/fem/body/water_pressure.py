"""Solve for the pressure of incompressible water before a face that moves (in the plane).

    div grad p = 0,   p = 0 at the level,   dp/dn = 0 on the bottom and at the far end,
    dp/dn = -rho a·n on the face, with n into the water

on quadrilaterals between the wet face, given by its nodes, and a far end at a distance. In weak
form Kp p = rho q, with the fluxes q_k = ∫ psi_k a·n of the nodes of the face into the water. So
the pressures of the face are rho G q, with the symmetric matrix G = Kp⁻¹ at its nodes.
"""

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from ...core.algebra import Array

GROWTH = 1.15  # of the columns of cells away from the face, up to the size of the depth
CELLS = 0.1  # of the depth: the largest column of cells
GAUSS = 1.0 / np.sqrt(3.0)


def find_compliance(x: Array, y: Array, side: float, length: float) -> Array:
    """Return G (k, k): pressures at nodes of a wet face of unit fluxes into the water, over rho.

    Args:
        x: of the nodes of the face (k,) [m].
        y: their heights [m], ascending from the bottom to the level, where p = 0.
        side: 1 where the water lies towards x > 0, else -1.
        length: distance of the far end from the face [m].
    """
    layers = len(y)
    depth = float(y[-1] - y[0])
    way = _divide(length, float(np.min(np.diff(y))), CELLS * depth)

    # Columns of nodes: those of the face, moved away, until the far end stands upright.
    far = x[0] + side * length
    columns = x[None, :] + (way / way[-1])[:, None] * (far - x)[None, :]
    heights = np.broadcast_to(y, columns.shape)
    K, _ = assemble_grid(columns.ravel(), heights.ravel(), len(way), layers)
    held = np.zeros(columns.shape, dtype=bool)
    held[:, -1] = True
    free = np.flatnonzero(~held.ravel())
    factor = splu(sp.csc_matrix(K[free][:, free]))
    loads = np.zeros((len(free), layers - 1))
    loads[: layers - 1] = np.eye(layers - 1)  # the face comes first, without its node at the level
    G = np.zeros((layers, layers))
    G[:-1, :-1] = factor.solve(loads)[: layers - 1]
    return 0.5 * (G + G.T)


def _divide(length: float, first: float, largest: float) -> Array:
    """Return places from 0 to a length [m], whose spacing grows from ``first`` to ``largest``."""
    places = [0.0]
    cell = first
    while places[-1] < length:
        places.append(places[-1] + cell)
        cell = min(GROWTH * cell, largest)
    return np.array(places) * (length / places[-1])


def assemble_grid(
    x: Array, y: Array, columns: int, layers: int
) -> tuple[sp.csr_matrix, sp.csr_matrix]:
    """Return ∫ grad psi_i · grad psi_j and ∫ psi_i psi_j of bilinear quadrilaterals.

    Args:
        x: of the nodes (columns · layers,) [m], column after column.
        y: the like.
        columns: number of columns of nodes.
        layers: number of nodes of a column.
    """
    number = np.arange(columns * layers).reshape(columns, layers)
    corners = [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]]
    cells = np.column_stack([corner.ravel() for corner in corners])
    entries = np.zeros((len(cells), 4, 4))
    squares = np.zeros((len(cells), 4, 4))
    for r, s in ((-GAUSS, -GAUSS), (GAUSS, -GAUSS), (GAUSS, GAUSS), (-GAUSS, GAUSS)):
        in_r = 0.25 * np.array([s - 1.0, 1.0 - s, 1.0 + s, -1.0 - s])
        in_s = 0.25 * np.array([r - 1.0, -1.0 - r, 1.0 + r, 1.0 - r])
        x_r, x_s = x[cells] @ in_r, x[cells] @ in_s
        y_r, y_s = y[cells] @ in_r, y[cells] @ in_s
        area: Array = x_r * y_s - x_s * y_r
        in_x = (y_s[:, None] * in_r - y_r[:, None] * in_s) / area[:, None]
        in_y = (x_r[:, None] * in_s - x_s[:, None] * in_r) / area[:, None]
        weight = np.abs(area)[:, None, None]
        entries += weight * (in_x[:, :, None] * in_x[:, None, :])
        entries += weight * (in_y[:, :, None] * in_y[:, None, :])
        in_cell = 0.25 * np.outer([1.0 - s, 1.0 + s], [1.0 - r, 1.0 + r]).ravel()
        values = in_cell[[0, 1, 3, 2]]
        squares += weight * np.outer(values, values)
    rows = np.repeat(cells, 4, axis=1).ravel()
    places = np.tile(cells, (1, 4)).ravel()
    shape = (len(x), len(x))
    first, second = (
        sp.csr_matrix((values.ravel(), (rows, places)), shape=shape)
        for values in (entries, squares)
    )
    return first, second
