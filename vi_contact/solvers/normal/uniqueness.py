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
from .lcp import EPS, check_operator, compute_scale

MOST = 18  # rows: 2^18 pivots, a tenth of a second
NONE = "is no P-matrix, a principal minor is not positive: contact may have no solution or several"


@dataclass(frozen=True)
class PMatrix:
    """Hold whether a matrix is a P-matrix.

    Attributes:
        holds: whether it is; None where that is not known.
        sentence: what is known, and why.
    """

    holds: bool | None
    sentence: str


def p_matrix(G: Array) -> PMatrix:
    """Return whether G (m, m) is a P-matrix.

    A matrix with positive definite symmetric part is one. Others of up to 18 rows are tested by the
    recursion of Tsatsomeros and Li (BIT 40, 2000): G is one if G_11 > 0, and G without row and
    column 1 and the Schur complement of G_11 are. Bounds of the rounding errors go along: a minor
    within them of zero decides nothing.

    Raises:
        InputError: G is not square or not finite.
    """
    G = array("p_matrix", "G", G, (None, None))
    check_operator(G, np.zeros(len(G), dtype=bool))
    if not (G.diagonal() > 0.0).all():
        return PMatrix(False, NONE)

    # The symmetric part, scaled to a diagonal of ones.
    d = compute_scale(G)
    matrix = d[:, None] * G * d
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

    # All minors: every matrix leaves two smaller ones, itself without its first row and column, and
    # its Schur complement. Their first entries are quotients of minors.
    matrices = matrix[None]
    errors = 2.0 * EPS * np.abs(matrix)[None]
    is_sure = True
    while matrices.shape[1]:
        first = matrices[:, 0, 0]
        error = errors[:, 0, 0]
        if (first < -error).any():
            return PMatrix(False, NONE)
        is_positive = first > error
        is_sure = is_sure and bool(is_positive.all())
        complements, doubts = _form_complements(matrices[is_positive], errors[is_positive])
        matrices = np.concatenate([matrices[:, 1:, 1:], complements])
        errors = np.concatenate([errors[:, 1:, 1:], doubts])
    if is_sure:
        return PMatrix(
            True, "is a P-matrix, all its principal minors are positive: the solution is unique"
        )
    return PMatrix(None, "may be a P-matrix or none: a principal minor is zero to rounding")


@np.errstate(all="ignore")  # entries that overflow decide nothing
def _form_complements(matrices: Array, errors: Array) -> tuple[Array, Array]:
    """Return the Schur complements of the first entries of many matrices.

    Args:
        matrices: (k, m, m).
        errors: (k, m, m), what their entries may be wrong by.

    Returns:
        The complements (k, m - 1, m - 1), and what their entries may be wrong by.
    """
    pivot = matrices[:, :1, :1]
    column = matrices[:, 1:, :1]
    row = matrices[:, :1, 1:]
    product = column * row / pivot
    complements = matrices[:, 1:, 1:] - product

    # The error of column row, then of its quotient with a pivot that may be smaller, and rounding.
    pivot_error = errors[:, :1, :1]
    column_error = errors[:, 1:, :1]
    row_error = errors[:, :1, 1:]
    doubt = column_error * (np.abs(row) + row_error) + np.abs(column) * row_error
    doubt = (doubt + np.abs(product) * pivot_error) / (pivot - pivot_error)
    rounding = 2.0 * EPS * (np.abs(product) + np.abs(complements))
    return complements, errors[:, 1:, 1:] + doubt + rounding
