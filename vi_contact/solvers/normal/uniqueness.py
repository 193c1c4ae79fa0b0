"""Say whether contact has one solution whatever the loads are: whether G is a P-matrix.

All principal minors of a P-matrix are positive. Exactly then  w = q + G r, 0 <= r ⊥ w >= 0  has one
solution for every q (Samelson, Thrall and Wesler, Proc. Amer. Math. Soc. 9, 1958), and so has the
box l <= r <= u, friction of given limits in the plane (Cottle, Pang and Stone, The Linear
Complementarity Problem, 1992, sections 3.3 and 3.4).
"""

from dataclasses import dataclass

import numpy as np

from ...core.algebra import Array
from ...core.checks import array
from .lcp import EPS, check_operator, energy_scale

MOST = 18  # rows: 2^18 pivots, a tenth of a second
NONE = "is no P-matrix, a principal minor is not positive: contact may have no solution or several"


@dataclass(frozen=True)
class PMatrix:
    """Hold whether a matrix is a P-matrix, and the reason (``sentence``).

    ``holds`` is None where that is not known.
    """

    holds: bool | None
    sentence: str


def p_matrix(G: Array) -> PMatrix:
    """Return whether G (m, m) is a P-matrix. InputError unless it is square and finite.

    One with positive definite symmetric part is. Where that is not, up to 18 rows are tested by the
    recursion of Tsatsomeros and Li (BIT 40, 2000): G is one if G_11 > 0, and G without row and
    column 1 and the Schur complement of G_11 are. Bounds of the rounding errors go along: a minor
    within them of zero decides nothing.
    """
    G = array("p_matrix", "G", G, (None, None))
    check_operator(G, np.zeros(len(G), dtype=bool))
    if not (G.diagonal() > 0.0).all():
        return PMatrix(False, NONE)
    matrix = energy_scale(G)[:, None] * G * energy_scale(G)
    norm = float(np.abs(matrix).sum(axis=1).max(initial=0.0))
    if np.linalg.eigvalsh(0.5 * (matrix + matrix.T)).min(initial=1.0) > len(G) * EPS * norm:
        return PMatrix(
            True, "is a P-matrix, its symmetric part is positive definite: the solution is unique"
        )
    if len(G) > MOST:
        return PMatrix(
            None,
            f"may be a P-matrix or none: its symmetric part is not positive definite, and {len(G)} "
            "rows are too many for all minors",
        )
    parts, errors, sure = matrix[None], 2.0 * EPS * np.abs(matrix)[None], True
    while parts.shape[1]:
        if (parts[:, 0, 0] < -errors[:, 0, 0]).any():
            return PMatrix(False, NONE)
        clear = parts[:, 0, 0] > errors[:, 0, 0]
        sure = sure and bool(clear.all())
        rest, doubt = _complements(parts[clear], errors[clear])
        parts, errors = (
            np.concatenate([parts[:, 1:, 1:], rest]),
            np.concatenate([errors[:, 1:, 1:], doubt]),
        )
    if sure:
        return PMatrix(
            True, "is a P-matrix, all its principal minors are positive: the solution is unique"
        )
    return PMatrix(None, "may be a P-matrix or none: a principal minor is zero to rounding")


@np.errstate(all="ignore")  # entries that overflow decide nothing
def _complements(parts: Array, errors: Array) -> tuple[Array, Array]:
    """Return the Schur complements of the first entries of many matrices.

    What their entries may be wrong by is returned too.
    """
    pivots, column, row = parts[:, :1, :1], parts[:, 1:, :1], parts[:, :1, 1:]
    within, below, beside = errors[:, :1, :1], errors[:, 1:, :1], errors[:, :1, 1:]
    taken, doubt = column * row / pivots, below * (np.abs(row) + beside) + np.abs(column) * beside
    rest, doubt = parts[:, 1:, 1:] - taken, (doubt + np.abs(taken) * within) / (pivots - within)
    return rest, errors[:, 1:, 1:] + doubt + 2.0 * EPS * (np.abs(taken) + np.abs(rest))
