"""Make the first exchanges of the active-set method, compiled, for several problems of one matrix.

    0 <= r  ⊥  q + G r >= 0  (bilateral rows: q + G r = 0)

``solvers.normal.active_set`` explains the method, and does the same in numpy; it goes on where
these exchanges end without an answer.
"""

from ctypes import c_double
from typing import Any, NamedTuple

import numpy as np

from ..core.algebra import Array, Indices, Mask
from .compiler import locate_arrays

NO_SET = 2  # in the first place of a remembered set: none is remembered


class Exchanged(NamedTuple):
    """Hold the answers to k problems of m rows.

    Its fields are in the order in which the C function takes the arrays that it fills.
    """

    r: Array  # (k, m)
    active: Mask  # (k, m)
    residual: Array  # (k,)
    changes: Indices  # (k,): how often the set changed; -1 where there is no answer
    moved: Indices  # (k, most): how many rows changed sides in each exchange


class Exchanges:
    """Hold the matrix of the problems, and the last set of every row with its factor."""

    def __init__(
        self,
        loops: Any,
        matrix: Array,
        scale: Array,
        bilateral: Mask,
        *,
        rounding: float,
        tolerance: float,
        most: int,
    ) -> None:
        """Note what all problems share.

        Args:
            loops: the compiled functions (``compiler.load_loops``).
            matrix: d G d (m, m), whose diagonal is one.
            scale: d (m,).
            bilateral: (m,), which rows are equations.
            rounding: what rounding may leave of w = q + G r, relative to the largest r.
            tolerance: residual, relative to the largest violation by q, that an answer may have.
            most: number of exchanges after which they end.
        """
        self._loops = loops
        self._most = most
        self._matrix = matrix
        self._scale = scale
        self._bilateral = bilateral
        self._limits = (c_double(rounding), c_double(tolerance))
        self._rows = 0

    def solve(self, q: Array, guess: Mask) -> Exchanged:
        """Return the answers; all but r and active are overwritten by the next ones.

        Args:
            q: (k, m) or (m,), gaps without reactions.
            guess: (k, m) or (m,), the sets to start from, True where r may be above zero.
        """
        # The C function reads and fills the arrays of this object, whose addresses were noted once:
        # to look them up takes longer than the exchanges of a small problem.
        k = len(q) if q.ndim == 2 else 1
        if k > self._rows:
            self._make_room(k)
        self._q[:k] = q
        self._guess[:k] = guess
        self._loops.exchanges(k, *self._arguments)
        answers = self._answers
        return Exchanged(
            answers.r[:k].copy(),
            answers.active[:k].copy(),
            answers.residual[:k],
            answers.changes[:k],
            answers.moved[:k],
        )

    def _make_room(self, k: int) -> None:
        """Make arrays for k problems, and note their addresses once.

        Sets and factors that were remembered are forgotten.
        """
        m = len(self._bilateral)
        self._rows = k
        self._q = np.empty((k, m))
        self._guess = np.empty((k, m), dtype=bool)
        self._answers = Exchanged(
            r=np.empty((k, m)),
            active=np.empty((k, m), dtype=bool),
            residual=np.empty(k),
            changes=np.empty(k, np.int32),
            moved=np.empty((k, self._most), np.int32),
        )
        self._remembered = (
            np.full((k, m), NO_SET, np.uint8),  # sets
            np.empty((k, m, m)),  # their factors
            np.empty(3 * m),  # room
            np.empty(m, np.int32),  # places of a set
        )
        # In the order of the parameters of the C function.
        arrays = (
            self._matrix,
            self._scale,
            self._bilateral,
            self._q,
            self._guess,
            *self._remembered,
            *self._answers,
        )
        self._arguments = (m, self._most, *self._limits, *locate_arrays(*arrays))
