"""Assemble plane frames of Euler–Bernoulli beams with numpy only, as any frame program would.

Three unknowns a node: displacements along x and y, and the rotation, at rows 3 node + 0, 1, 2.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp


def member(a: Any, b: Any, *, EA: float, EI: float, rho_A: float) -> tuple[Any, Any]:
    """(M, K), 6 x 6, of a member from a to b: linear along, cubic across."""
    way = np.subtract(b, a)
    h = float(np.hypot(*way))
    c, s = way / h
    K, M = np.zeros((6, 6)), np.zeros((6, 6))
    along = np.ix_([0, 3], [0, 3])
    across = np.ix_([1, 2, 4, 5], [1, 2, 4, 5])
    K[along] = EA / h * np.array([[1.0, -1.0], [-1.0, 1.0]])
    M[along] = rho_A * h / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]])
    bending = [[12, 6 * h, -12, 6 * h], [6 * h, 4 * h**2, -6 * h, 2 * h**2]]
    bending += [[-12, -6 * h, 12, -6 * h], [6 * h, 2 * h**2, -6 * h, 4 * h**2]]
    K[across] = EI / h**3 * np.array(bending)
    inertia = [[156, 22 * h, 54, -13 * h], [22 * h, 4 * h**2, 13 * h, -3 * h**2]]
    inertia += [[54, 13 * h, 156, -22 * h], [-13 * h, -3 * h**2, -22 * h, 4 * h**2]]
    M[across] = rho_A * h / 420.0 * np.array(inertia)
    turn = np.kron(np.eye(2), np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]))
    return turn.T @ M @ turn, turn.T @ K @ turn


def frame(nodes: Any, members: Sequence[tuple[int, int]], **section: float) -> dict[str, Any]:
    """Give M, K, coordinates and unknowns of a frame for ``system_from_arrays``; C is None."""
    nodes = np.asarray(nodes, dtype=float)
    n = 3 * len(nodes)
    M, K = sp.lil_matrix((n, n)), sp.lil_matrix((n, n))
    for one, two in members:
        rows = np.ix_(*[[*range(3 * one, 3 * one + 3), *range(3 * two, 3 * two + 3)]] * 2)
        mass, stiffness = member(nodes[one], nodes[two], **section)
        M[rows] += mass
        K[rows] += stiffness
    node = np.repeat(np.arange(len(nodes)), 3)
    return {
        "M": M.tocsr(),
        "C": None,
        "K": K.tocsr(),
        "coordinates": nodes,
        "unknowns": np.column_stack([node, np.tile([0, 1, -1], len(nodes))]),
    }


def line(a: Any, b: Any, count: int) -> Any:
    """Nodes of a line of so many members."""
    return np.linspace(a, b, count + 1)
