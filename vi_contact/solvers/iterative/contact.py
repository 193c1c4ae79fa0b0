"""Hold the contact conditions of a step on the full-size vectors: which of them are closed.

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


class ClosedSet:
    """Hold the closed set of one step.

    Attributes:
        rows: (m,) where the normal unknowns stand in padded vectors.
        closed: (m,) which conditions are closed.
        bilateral, soft: (m,) which are always closed, and which are springs.
        k: (m,) stiffness of the springs, in the unit of A.
        diagonal: (m,) of A in the rows.
        reach: (m,) which conditions have a finite bound.
        bound: (m,) upper bounds, zero where they are not finite.
    """

    def __init__(
        self,
        surface: ContactSurface,
        scale: float,
        rows: Indices,
        diagonal: Array,
        missing: Indices,
    ) -> None:
        """Take the conditions of a surface.

        Args:
            surface: the contact surface.
            scale: of reactions, over which compliances are divided.
            rows: (m,) where the normal unknowns stand in padded vectors.
            diagonal: of A, padded.
            missing: places in padded vectors that are no unknowns.
        """
        self._owned = surface.owned
        self.rows = rows
        self._size = len(diagonal)
        self._missing = missing
        self.bilateral = surface.bilateral
        self.soft = surface.compliance > 0.0
        self.k = np.zeros(len(rows))
        self.k[self.soft] = scale / surface.compliance[self.soft]
        self.diagonal = diagonal[rows]
        self.closed: Mask = np.zeros(len(rows), dtype=bool)

    def begin(self, step: StepProblem) -> None:
        """Take the bounds of a step, and its predicted set with what the guess lets penetrate.

        Raises:
            InputError: on all ranks, where a bound is NaN.
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
        closed_springs = self.closed & self.soft
        return self.rows[closed_springs], self.k[closed_springs]

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
        """Return the mask w of the free unknowns, padded, for the preconditioner w M⁻¹ w.

        It is 0 where an unknown is held or missing, and 1 elsewhere. At a closed spring it is
        sqrt(A_ii / (A_ii + k)), which gives M the diagonal of A + k there, and tends to 0 as the
        spring becomes rigid.
        """
        w = np.ones(self._size)
        w[self._missing] = 0.0
        w[self.held] = 0.0
        springs = self.closed & self.soft
        diagonal = self.diagonal[springs]
        w[self.rows[springs]] = np.sqrt(diagonal / (diagonal + self.k[springs]))
        return w

    def reactions(self, x: Array, residual: Array) -> Array:
        """Return r_n (m,) of the closed conditions, zero of the others.

        ``residual`` is load - (A + K_s) x, padded like x.
        """
        rigid = np.where(self.closed, residual[self.rows], 0.0)
        return np.where(self.soft, self.spring_forces(x), rigid)

    def spring_forces(self, x: Array) -> Array:
        """Return the forces of the closed springs, zero of all other conditions."""
        return np.where(self.closed & self.soft, self.k * (x[self.rows] - self.bound), 0.0)

    def body_forces(self, x: Array, residual: Array, load: Array) -> float:
        """Return the largest |A x| on this rank, without the springs.

        Args:
            x: padded.
            residual: load - (A + K_s) x.
            load: b with the load of closed springs, padded.
        """
        Ax = load - residual
        rows, k = self.sprung
        Ax[rows] -= k * x[rows]
        Ax[self._missing] = 0.0
        return max_abs(Ax)

    def wrong_signs(
        self, x: Array, r_n: Array, *, error: float, least_force: float, x_ref: float
    ) -> Mask:
        """Return the conditions (m,) whose signs are wrong by more than the error.

        A closed one is wrong that pulls, an open one that has penetrated by more than the error
        moves its unknown.

        Args:
            x: padded.
            r_n: (m,) reactions.
            error: the largest residual of free unknowns.
            least_force: tension that rounding may leave.
            x_ref: size of displacements, by which the rounding of a gap is judged.
        """
        # A force on the unknown of a spring is carried by the spring and by the body.
        carried = np.where(self.soft, self.k / (self.diagonal + self.k), 1.0)
        pulls = r_n < -np.maximum(least_force, error * carried)
        inside = x[self.rows] - self.bound > np.maximum(CLOSING * x_ref, error / self.diagonal)
        should_open = self.closed & ~self.bilateral & pulls
        should_close = ~self.closed & self.reach & inside
        return np.asarray(should_open | should_close)

    def change(self, wrong: Mask) -> None:
        """Close what is open and open what is closed of these conditions."""
        self.closed = self.closed ^ wrong

    def project(self, x: Array) -> Array:
        """Return x with no rigid support penetrated, and bilateral ones on their bound."""
        x = x.copy()
        rigid = self.reach & ~self.soft
        rows = self.rows[rigid]
        bound = self.bound[rigid]
        x[rows] = np.where(self.bilateral[rigid], bound, np.minimum(x[rows], bound))
        return x

    @property
    def _one_sided_springs(self) -> Mask:
        """Return which conditions are springs that open."""
        return self.soft & ~self.bilateral & self.reach

    def close_springs(self, x: Array | None) -> None:
        """Close the springs that x presses, or none."""
        pressed = False if x is None else x[self.rows] > self.bound
        self.closed = np.where(self._one_sided_springs, pressed, self.closed)

    def spring_slope(self, x: Array, d: Array, t: float) -> float:
        """Return sum k max(x + t d - bound, 0) d over the one-sided springs of this rank.

        It is the slope of their energy along the line.

        Args:
            x: padded, where the line begins.
            d: padded, its direction.
            t: how far along it.
        """
        springs = self._one_sided_springs
        rows = self.rows[springs]
        pressed = np.maximum(x[rows] + t * d[rows] - self.bound[springs], 0.0)
        return float(np.sum(self.k[springs] * pressed * d[rows]))

    def fingerprint(self) -> float:
        """Return a number for the closed set of this rank.

        Sums over ranks of two sets are different, in all likelihood.
        """
        return float(zlib.crc32(np.packbits(self.closed).tobytes()))
