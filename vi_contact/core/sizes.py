"""Say which problems suit a dense matrix on every rank, or a factor that is made in passing."""

from .algebra import Comm, total
from .errors import InputError

DENSE_ROWS = 10_000  # 0.8 GB a matrix, and its factor and a copy while it is made, on every rank
# Beyond it a factor of the mass matrix takes seconds, conjugate gradients a tenth of one.
OWN_UNKNOWNS = 50_000
OWN_CONDITIONS = 1_000  # as many back-substitutions, and a dense matrix


def refuse_dense(owner: str, rows: int, *, instead: str = "Iterative(), which stores none") -> None:
    """Raise InputError for more contact unknowns than a dense matrix on every rank suits.

    Args:
        owner: class that stores the matrix, the first word of the sentence.
        rows: number of contact unknowns.
        instead: what to take, for the sentence.
    """
    if rows > DENSE_ROWS:
        raise InputError(
            f"{owner} stores a dense matrix of its {rows} contact unknowns on every rank, "
            f"{8e-9 * rows**2:.2g} GB: take {instead}, or at most {DENSE_ROWS}"
        )


def refuse_memory(owner: str, size: float, *, instead: str) -> None:
    """Raise InputError for a factor that takes more memory than the largest dense matrix.

    Args:
        owner: class that stores the factor, the first word of the sentence.
        size: what it takes [bytes], known before it is made.
        instead: what to take, for the sentence.
    """
    most = 8.0 * DENSE_ROWS**2
    if size > most:
        raise InputError(
            f"{owner} stores a factor of {1e-9 * size:.2g} GB on every rank, more than the "
            f"{1e-9 * most:.2g} GB that it may take: take {instead}"
        )


def is_small_problem(comm: Comm, unknowns: int, conditions: int, *, worth: int = 1) -> bool:
    """Say whether a problem that the package solves beside the steps is small. Collective.

    Small ones are condensed with a factor of their own, whatever solves the steps; larger ones are
    solved by conjugate gradients.

    Args:
        comm: the ranks.
        unknowns: number of unknowns of this rank.
        conditions: number of contact conditions of this rank.
        worth: so many times more unknowns count as few, for problems that come again and again.
    """
    if total(comm, unknowns) > worth * OWN_UNKNOWNS:
        return False
    return total(comm, conditions) <= OWN_CONDITIONS
