"""Hold the contact conditions of a step on the full-size vectors.

It is known which are closed, and which of them have wrong signs.

A closed rigid condition holds its unknown on the bound; the residual there is the reaction. A
closed spring, of stiffness k = scale / compliance, leaves its unknown free and adds k to the
diagonal and k bound to the load; its reaction is k (x - bound). An infinite bound is never closed.
Arrays have one entry for each condition of this rank.
"""

import zlib

import numpy as np

from ...core.algebra import Array, Indices, Mask, max_abs
from ...core.errors import InputError
from ...core.step import StepProblem
from ...core.surfaces import ContactSurface

CLOSING = 1e-12  # penetration, relative to |x|, that closes a condition at the end of a solve


class Contact:
    """Hold the closed set of one step.

    ``rows`` say where the normal unknowns stand in the padded vectors of ``size``.
    """

    def __init__(
        self,
        surface: ContactSurface,
        scale: float,
        rows: Indices,
        diagonal: Array,
        missing: Indices,
    ) -> None:
        self._owned, self.rows, self._size, self._missing = (
            surface.owned,
            rows,
            len(diagonal),
            missing,
        )
        self.bilateral, self.soft = surface.bilateral, surface.compliance > 0.0
        self.k = np.zeros(len(rows))
        self.k[self.soft] = scale / surface.compliance[self.soft]
        self.diagonal = diagonal[rows]
        self.closed: Mask = np.zeros(len(rows), dtype=bool)

    def begin(self, step: StepProblem) -> None:
        """Take the bounds of a step, and its predicted set.

        The points that the guess lets penetrate are added to it.
        """
        if step.surface.some(np.isnan(step.bound)):
            raise InputError(
                "the bound of the contact conditions contains NaN: check the gap and the time "
                "scheme"
            )
        self.reach = np.isfinite(step.bound)
        self.bound = np.where(self.reach, step.bound, 0.0)
        inside = step.guess[self._owned] > self.bound
        self.closed = (step.active | self.bilateral | inside) & self.reach

    @property
    def held(self) -> Indices:
        """Return the rows of unknowns on a rigid support that are closed."""
        return self.rows[self.closed & ~self.soft]

    @property
    def sprung(self) -> tuple[Indices, Array]:
        """Return rows and stiffnesses of the springs that are closed."""
        chosen = self.closed & self.soft
        return self.rows[chosen], self.k[chosen]

    def place(self, x: Array) -> None:
        """Put the held unknowns of x on their bounds."""
        x[self.held] = self.bound[self.closed & ~self.soft]

    def load(self, b: Array) -> Array:
        """Return b + k bound of the closed springs."""
        rows, k = self.sprung
        if not len(rows):
            return b
        load = b.copy()
        load[rows] += k * self.bound[self.closed & self.soft]
        return load

    def weights(self) -> Array:
        """Return the mask of the free unknowns.

        It is 1, 0 where held or missing, and less than 1 at closed springs.

        w M⁻¹ w is the preconditioner: sqrt(A_ii / (A_ii + k)) at a spring gives M the diagonal of A
        + k there, and tends to the mask as the spring becomes rigid.
        """
        w = np.ones(self._size)
        w[self._missing] = 0.0
        w[self.held] = 0.0
        chosen = self.closed & self.soft
        w[self.rows[chosen]] = np.sqrt(
            self.diagonal[chosen] / (self.diagonal[chosen] + self.k[chosen])
        )
        return w

    def reactions(self, x: Array, residual: Array) -> Array:
        """Return r_n of the closed conditions, zero of the others.

        ``residual`` is load - (A + K_s) x.
        """
        return np.where(
            self.soft, self.spring_forces(x), np.where(self.closed, residual[self.rows], 0.0)
        )

    def spring_forces(self, x: Array) -> Array:
        """Return the forces of the closed springs, zero of all other conditions."""
        return np.where(self.closed & self.soft, self.k * (x[self.rows] - self.bound), 0.0)

    def body_forces(self, x: Array, residual: Array, load: Array) -> float:
        """Return the largest |A x| on this rank, without the springs."""
        Ax = load - residual
        rows, k = self.sprung
        Ax[rows] -= k * x[rows]
        Ax[self._missing] = 0.0
        return max_abs(Ax)

    def wrong(self, x: Array, r: Array, *, error: float, least_force: float, x_ref: float) -> Mask:
        """Return the conditions whose signs are wrong by more than ``error``, the largest residual.

        A closed one pulls: r below -error and -least_force; an open one has penetrated by more than
        the error moves its unknown, error / A_ii, and by more than round-off.
        """
        stiff = np.where(self.soft, self.k / (self.diagonal + self.k), 1.0)
        pulls = self.closed & ~self.bilateral & (r < -np.maximum(least_force, error * stiff))
        inside = x[self.rows] - self.bound > np.maximum(CLOSING * x_ref, error / self.diagonal)
        return np.asarray(pulls | (~self.closed & self.reach & inside))

    def change(self, wrong: Mask) -> None:
        """Close what is open and open what is closed of these conditions."""
        self.closed = self.closed ^ wrong

    def feasible(self, x: Array) -> Array:
        """Return x with no rigid support penetrated."""
        x = x.copy()
        rigid = self.reach & ~self.soft
        rows, bound = self.rows[rigid], self.bound[rigid]
        x[rows] = np.where(self.bilateral[rigid], bound, np.minimum(x[rows], bound))
        return x

    @property
    def _one_sided_springs(self) -> Mask:
        return self.soft & ~self.bilateral & self.reach

    def close_springs(self, x: Array | None) -> None:
        """Close the springs that x presses, or none."""
        pressed = False if x is None else x[self.rows] > self.bound
        self.closed = np.where(self._one_sided_springs, pressed, self.closed)

    def spring_slope(self, x: Array, d: Array, t: float) -> float:
        """Return sum k max(x + t d - bound, 0) d over the one-sided springs of this rank."""
        rows, bound, k = (
            values[self._one_sided_springs] for values in (self.rows, self.bound, self.k)
        )
        return float(np.sum(k * np.maximum(x[rows] + t * d[rows] - bound, 0.0) * d[rows]))

    def fingerprint(self) -> float:
        """Return a number of the closed set of this rank.

        Its sum over ranks tells sets apart, in all likelihood.
        """
        return float(zlib.crc32(np.packbits(self.closed).tobytes()))
