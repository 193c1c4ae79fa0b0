"""Pose the small problem of a step with friction.

Its residual, and the scaling all its methods share, are here.

    w = q + G r;    0 <= r_n  perpendicular to  w_n >= 0   (bilateral rows: w_n = 0, r_n free)
    |r_t| <= limit(r_n) = cohesion + slope max(r_n, 0)
    r_t = -limit w_t/|w_t| where w_t is not zero                                                (1)

G (m d, m d) is the Delassus operator of normal and tangential unknowns, node by node (r_n, then the
d - 1 components of r_t), symmetric positive definite; q_n is the gap and q_t minus the slip that
the step without reactions would have, w_n the gap and w_t minus the slip. Tresca's law has slope 0:
(1) is then the minimum of ½ rᵀG r + qᵀr over a product of half-lines and disks, and unique.
Coulomb's has cohesion 0: a solution exists (with s_i = limit the Tresca problems map bounded sets
of s into themselves continuously, Brouwer), and is unique for small slopes only.

(1) holds where the natural map vanishes (Alart and Curnier, Comput. Methods Appl. Mech. Eng. 92,
  1991, with y = r - w):

    F_n = r_n - max(y_n, 0)   (bilateral: w_n)
    F_t = r_t - projection of y_t on the disk |r_t| <= limit(r_n)                               (2)

Scaling. Normal rows are multiplied by G_nn^(-1/2), tangential ones by one number for each node
(disks stay disks), the mean of G_tt to the same power: reactions and displacements are then both in
sqrt(J), as in ``normal.lcp``.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Annotated, Any, ClassVar, Protocol

import numpy as np
from scipy.linalg import blas, lapack

from ...core.algebra import Array, Mask, max_abs
from ...core.arguments import check_fields
from ...core.checks import provides
from ...core.errors import InputError, StepFailure
from ...core.quantities import Positive
from ...laws.friction import project
from ..normal.lcp import EPS, check_gap, energy_scale, scaled_matrix

Iterated = tuple[Array, int, Sequence[float]]  # scaled r, iterations, history


@dataclass(frozen=True)
class FrictionResult:
    """Answer (1), when a friction method has reached its tolerance or the limit that rounding sets.

    ``r`` (m, d): r_n >= 0 exactly in unilateral rows, |r_t| <= limit(r_n) but for the last digit;
    ``active`` (m,): r_n > 0 or bilateral; ``stick`` (m,): w_t = 0 but for the residual reached,
    under a limit that is not zero; ``residual``: largest |F| of (2) over that of r = 0. Each method
    tells what ``iterations`` and ``history`` count.
    """

    r: Array
    active: Mask
    stick: Mask
    iterations: int
    residual: float
    method: object
    history: tuple[float, ...] = ()


class FrictionMethod(Protocol):
    """Solve (1): FrictionNewton, NSGS, FixedPoint or GivenForces."""

    @property
    def carries_friction(self) -> bool:
        """Say True: that tells such a method from those for the problem without friction."""

    def prepare(self, G: Array, bilateral: Mask) -> Any:
        """Check and scale G (m d, m d) and return ``PreparedFriction`` or its like for many q.

        ``bilateral`` (m,) says which rows are bilateral.
        """


@dataclass(frozen=True)
class Settings:
    """Hold what all methods here let one choose.

    This is ``tolerance``, and ``max_iterations`` that they may take.
    """

    carries_friction: ClassVar[bool] = True
    tolerance: Annotated[float, Positive] = 1e-12
    max_iterations: Annotated[int, Positive] = 1000

    def __post_init__(self) -> None:
        check_fields(self)


def inner_method(owner: str, meaning: str, value: Any) -> None:
    """Raise InputError unless it is a method for the small problem with friction."""
    remedy = "give FrictionNewton(), NSGS(), FixedPoint() or GivenForces()"
    provides(owner, meaning, value, ("prepare", "carries_friction"), remedy, lacks=("check",))


@dataclass(frozen=True)
class ScaledProblem:
    """Pose (1) in scaled numbers: q (m, d), cohesion and slope (m,)."""

    delassus: "ScaledDelassus"
    q: Array
    cohesion: Array
    slope: Array
    _last: list[Array] = field(default_factory=list, init=False, repr=False)  # r and G r

    @property
    def count(self) -> int:
        """Return m."""
        return len(self.cohesion)

    def moved(self, r: Array) -> Array:
        """Return G r (m, d), from the rows that carry something when they are few.

        Of the last r it is known.
        """
        if not (self._last and np.array_equal(self._last[0], r)):
            self._last[:] = r.copy(), self.delassus.product(r.ravel()).reshape(r.shape)
        return self._last[1]

    def w(self, r: Array) -> Array:
        """Return q + G r (m, d)."""
        return self.q + self.moved(r)

    def limit(self, r_n: Array) -> Array:
        """Return cohesion + slope max(r_n, 0)."""
        return self.cohesion + self.slope * np.maximum(r_n, 0.0)

    def residual(self, r: Array, w: Array) -> float:
        """Return max |F| of (2)."""
        y = r - w
        normal = np.where(self.delassus.bilateral, w[:, 0], r[:, 0] - np.maximum(y[:, 0], 0.0))
        tangential = r[:, 1:] - project(y[:, 1:], self.limit(r[:, 0]))
        return max(max_abs(normal), max_abs(tangential))

    @cached_property
    def unit(self) -> float:
        """Return the residual of r = 0: what there is to resolve."""
        return self.residual(np.zeros_like(self.q), self.q)

    def rounding(self, r: Array) -> float:
        """Return the residual below which there are rounding errors of q + G r only."""
        return 16.0 * EPS * self.delassus.norm * max_abs(r)

    def admissible(self, r: Array) -> Array:
        """Return r with r_n >= 0 and r_t within its disk.

        This removes rounding errors, and whatever else is outside.
        """
        r_n = np.where(self.delassus.bilateral, r[:, 0], np.maximum(r[:, 0], 0.0))
        return np.column_stack([r_n, project(r[:, 1:], self.limit(r_n))])

    def start(self, guess: Array | Mask | None) -> Array:
        """Return reactions to start from.

        They are those guessed, or what opens the guessed set row by row, at least energy.
        """
        if guess is None:
            return np.zeros_like(self.q)
        if guess.dtype != bool:
            return self.admissible(guess / self.delassus.scale)
        held = guess & np.isfinite(self.q[:, 0])
        r = self.admissible(np.where(held[:, None], -self.q, 0.0))
        carried = r != 0.0
        if carried.any():
            moved = self.moved(r)
            energy = np.vdot(moved, r)  # positive, unless G is not symmetric
            best = -(self.q[carried] @ r[carried]) / energy if energy > 0.0 else 0.0
            r *= best
            self._last[:] = r.copy(), best * moved
        return r

    def result(self, method: object, tolerance: float, found: Iterated) -> FrictionResult:
        """Return the result in newtons.

        Raises:
            StepFailure: the residual is above ``tolerance`` and above rounding.
        """
        r, iterations, history = found
        r = self.admissible(r)
        w = self.w(r)
        residual, unit = self.residual(r, w), self.unit or 1.0
        rounding = self.rounding(r)
        if not residual <= max(tolerance * unit, rounding):
            raise StepFailure(
                f"{method} stopped after {iterations} iterations with residual "
                f"{residual / unit:.1e}: try another friction method (FrictionNewton, NSGS, "
                "FixedPoint), or a smaller step of time or load"
            )
        still = np.linalg.norm(w[:, 1:], axis=1) <= 4.0 * max(residual, rounding)
        active = (r[:, 0] > 0.0) | self.delassus.bilateral
        stick = still & (self.limit(r[:, 0]) > 0.0)
        r = r * self.delassus.scale
        return FrictionResult(r, active, stick, iterations, residual / unit, method, tuple(history))


class ScaledDelassus:
    """Hold d G d with its scale (m, d): what the methods work on."""

    def __init__(self, G: Array, bilateral: Mask, *, unsymmetric: bool = False) -> None:
        m = len(bilateral)
        d = G.shape[0] // m if m else 1
        if G.ndim != 2 or G.shape != (m * d, m * d):
            raise InputError(
                f"the Delassus operator has shape {G.shape} for {m} points: give m d rows, node by "
                "node"
            )
        scale = energy_scale(G).reshape(m, d)
        if d > 1:
            scale[:, 1:] = np.mean(scale[:, 1:] ** -2.0, axis=1)[:, None] ** -0.5
        self.scale, self.bilateral, self.count, self.dimension = scale, bilateral.copy(), m, d
        self.matrix, self.norm = scaled_matrix(G, scale.ravel(), unsymmetric=unsymmetric)
        self.symmetric = not unsymmetric or np.array_equal(self.matrix, self.matrix.T)

    def product(self, r: Array) -> Array:
        """Return G r, (m d,)."""
        if not self.symmetric:
            return np.asarray(self.matrix @ r)
        carried = np.flatnonzero(r)
        if len(carried) <= 0.25 * len(r):
            return np.asarray(r[carried] @ self.matrix[carried])
        return np.asarray(blas.dsymv(1.0, self.matrix.T, r))  # reads half of it

    @cached_property
    def short(self) -> tuple[Any, ...]:
        """Return G in single precision for the compiled sweeps and, in 2D, inverses.

        These are its inverse H and the inverse of each node's block of H, in single precision too.
        There is None for what is missing, or is not positive definite to that precision.
        """
        G, d = self.matrix.astype(np.float32), self.dimension
        triangle, info = lapack.spotrf(G, lower=1) if d == 2 else (G, 1)
        if info:
            return G, None, None
        H = lapack.spotri(triangle, lower=1)[0]
        H = np.ascontiguousarray(np.tril(H) + np.tril(H, -1).T)
        places = np.arange(len(H)).reshape(-1, d)
        return G, H, np.ascontiguousarray(np.linalg.inv(H[places[:, :, None], places[:, None, :]]))

    @cached_property
    def inverse(self) -> Array | None:
        """Return the inverse of the matrix; None where it is not positive definite to rounding."""
        inverse, info = lapack.dpotri(lapack.dpotrf(self.matrix, lower=1)[0], lower=1)
        return None if info else np.tril(inverse) + np.tril(inverse, -1).T

    def problem(self, q: Array, cohesion: Array, slope: Array) -> ScaledProblem:
        """Return problem (1) in scaled numbers."""
        check_gap(q[:, 0], self.bilateral)
        if not np.isfinite(q[:, 1:]).all():
            raise InputError(
                "the slip without reactions contains NaN or infinity: check the loads of this step"
            )
        normal, tangential = self.scale[:, 0], self.scale[:, -1]
        return ScaledProblem(
            self, q * self.scale, cohesion / tangential, slope * (normal / tangential)
        )


@dataclass(frozen=True)
class PreparedFriction:
    """Solve (1) for one G and many right-hand sides.

    ``loop``: (problem, where to start) -> r, refused when its residual is above ``tolerance``.
    """

    method: object
    tolerance: float
    delassus: ScaledDelassus
    loop: Callable[[ScaledProblem, Array], Iterated]

    def solve(
        self, q: Array, cohesion: Array, slope: Array, guess: Array | Mask | None = None
    ) -> FrictionResult:
        """Return the answer for q (m, d), cohesion (m,) [as r], slope (m,).

        ``guess``: predicted contact set (m,), or reactions (m, d). StepFailure when the tolerance
        is not reached.
        """
        step = self.delassus.problem(q, cohesion, slope)
        found = self.loop(step, step.start(guess if step.unit > 0.0 else None))
        return step.result(self.method, self.tolerance, found)
