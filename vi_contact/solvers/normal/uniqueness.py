"""Say whether contact has one solution whatever the loads are: whether G is a P-matrix.

All principal minors of a P-matrix are positive. Exactly then  w = q + G r, 0 <= r ⊥ w >= 0  has one solution for every
q (Samelson, Thrall and Wesler, Proc. Amer. Math. Soc. 9, 1958), and so has the box l <= r <= u, friction of given
limits in the plane (Cottle, Pang and Stone, The Linear Complementarity Problem, 1992, sections 3.3 and 3.4).
"""

from dataclasses import dataclass

import numpy as np

from ...core.algebra import Array, max_abs
from .lcp import EPS, energy_scale, scaled_matrix

MOST = 18  # rows: 2^18 pivots, a tenth of a second
NONE = "is no P-matrix to rounding, a principal minor is not positive: contact may have no solution or several"


@dataclass(frozen=True)
class PMatrix:
    """Hold whether it is one, ``holds`` None where that is not known, and a ``sentence`` that says why."""

    holds: bool | None
    sentence: str


def p_matrix(G: Array) -> PMatrix:
    """Return whether G (m, m) is a P-matrix. InputError unless it is finite.

    One with positive definite symmetric part is. Where that is not, up to 18 rows are tested exactly but for rounding,
    by the recursion of Tsatsomeros and Li (BIT 40, 2000): G is one if G_11 > 0, and G without row and column 1 and the
    Schur complement of G_11 are.
    """
    if not (np.asarray(G.diagonal()) > 0.0).all() and np.isfinite(G).all():
        return PMatrix(False, NONE)
    matrix, norm = scaled_matrix(G, energy_scale(G), unsymmetric=True)
    if np.linalg.eigvalsh(0.5 * (matrix + matrix.T)).min(initial=1.0) > len(G) * EPS * norm:
        return PMatrix(True, "is a P-matrix, its symmetric part is positive definite: the solution is unique")
    if len(G) > MOST:
        return PMatrix(None, f"may be a P-matrix or none: its symmetric part is not positive definite, and {len(G)} "
                             "rows are too many for all minors")
    parts = matrix[None]
    while parts.shape[1]:
        pivots = parts[:, 0, 0]
        if pivots.min() <= EPS * len(G) * max_abs(parts):
            return PMatrix(False, NONE)
        rest, across = parts[:, 1:, 1:], parts[:, 1:, :1] * parts[:, :1, 1:]
        parts = np.concatenate([rest, rest - across / pivots[:, None, None]])
    return PMatrix(True, "is a P-matrix, all its principal minors are positive: the solution is unique")
