"""Pose the small problem of a step with friction, with its residual and the scaling of all methods.

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
from typing import Annotated, Any, ClassVar, NamedTuple, Protocol

import numpy as np
from scipy.linalg import blas, lapack

from ...core.algebra import Array, Mask, max_abs
from ...core.arguments import check_fields
from ...core.checks import provides
from ...core.errors import InputError, StepFailure
from ...core.quantities import Positive
from ...laws.friction import project
from ..normal.lcp import EPS, check_gap, compute_scale, scale_matrix

FEW = 0.25  # share of the unknowns that carry something, up to which a product by rows is faster
STILL = 4.0  # how many times the residual, or its rounding, the slip of points that stick may be


class LastIterate(NamedTuple):
    """Hold where a method ended."""

    r: Array  # (m, d), scaled
    iterations: int
    history: Sequence[float]


class ShortMatrices(NamedTuple):
    """Hold what the compiled sweeps read, in single precision."""

    G: Any  # (m d, m d), scaled
    H: Any  # its inverse in 2D; None where it is not positive definite to this precision
    blocks: Any  # (m, d, d) inverses of the blocks of H on its diagonal; None with H


@dataclass(frozen=True)
class FrictionResult:
    """Answer (1), when a friction method has reached its tolerance or the limit that rounding sets.

    Attributes:
        r: (m, d) reactions: r_n >= 0 exactly in unilateral rows, |r_t| <= limit(r_n) but for the
            last digit.
        active: (m,) r_n > 0 or bilateral.
        stick: (m,) w_t = 0 but for the residual reached, under a limit that is not zero.
        iterations: each method tells what it counts.
        residual: the largest |F| of (2) over that of r = 0.
        method: the settings that made it.
        history: each method tells what it holds.
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

        Args:
            G: the Delassus operator.
            bilateral: (m,) which rows are bilateral.
        """


@dataclass(frozen=True)
class Settings:
    """Hold the settings that all methods here have.

    Attributes:
        tolerance: each method tells of what.
        max_iterations: that it may take.
    """

    carries_friction: ClassVar[bool] = True
    tolerance: Annotated[float, Positive] = 1e-12
    max_iterations: Annotated[int, Positive] = 1000

    def __post_init__(self) -> None:
        check_fields(self)


def check_inner_method(owner: str, meaning: str, value: Any) -> None:
    """Raise InputError unless the value is a method for the small problem with friction.

    Args:
        owner: whose setting it is.
        meaning: the name of the setting.
        value: what was given.
    """
    remedy = "give FrictionNewton(), NSGS(), FixedPoint() or GivenForces()"
    provides(owner, meaning, value, ("prepare", "carries_friction"), remedy, lacks=("check",))


@dataclass(frozen=True)
class ScaledProblem:
    """Pose (1) in scaled numbers.

    Attributes:
        delassus: G.
        q: (m, d).
        cohesion, slope: (m,).
    """

    delassus: "ScaledDelassus"
    q: Array
    cohesion: Array
    slope: Array
    _last: list[Array] = field(default_factory=list, init=False, repr=False)  # r and G r

    @property
    def count(self) -> int:
        """Return m."""
        return len(self.cohesion)

    def product(self, r: Array) -> Array:
        """Return G r (m, d). Of the last r it is remembered."""
        if not (self._last and np.array_equal(self._last[0], r)):
            image = self.delassus.product(r.ravel()).reshape(r.shape)
            self._last[:] = [r.copy(), image]
        return self._last[1]

    def w(self, r: Array) -> Array:
        """Return q + G r (m, d)."""
        return self.q + self.product(r)

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
        """Return r (m, d) with r_n >= 0, and r_t put onto its disk where it is outside."""
        r_n = np.where(self.delassus.bilateral, r[:, 0], np.maximum(r[:, 0], 0.0))
        return np.column_stack([r_n, project(r[:, 1:], self.limit(r_n))])

    def start(self, guess: Array | Mask | None) -> Array:
        """Return reactions (m, d), scaled, to start from.

        Args:
            guess: reactions (m, d) [N]; or the contact set (m,), of which every row is opened by
                itself, and all are scaled to the least energy; or None for zero.
        """
        if guess is None:
            return np.zeros_like(self.q)
        if guess.dtype != bool:
            return self.admissible(guess / self.delassus.scale)

        # One step of Jacobi's method on the set, and a line search for the minimum of
        # ½ rᵀG r + qᵀr along it. The product with G serves for the scaled r too.
        held = guess & np.isfinite(self.q[:, 0])
        r = self.admissible(np.where(held[:, None], -self.q, 0.0))
        carried = r != 0.0
        if carried.any():
            image = self.product(r)
            energy = np.vdot(image, r)  # positive, unless G is not symmetric
            best = -(self.q[carried] @ r[carried]) / energy if energy > 0.0 else 0.0
            r *= best
            self._last[:] = [r.copy(), best * image]
        return r

    def result(self, method: object, tolerance: float, last: LastIterate) -> FrictionResult:
        """Judge where a method ended, and return the result in newtons.

        Args:
            method: its settings.
            tolerance: of the residual, that of r = 0 being 1.
            last: where it ended.

        Raises:
            StepFailure: the residual is above the tolerance and above rounding.
        """
        iterations = last.iterations
        r = self.admissible(last.r)
        w = self.w(r)
        residual = self.residual(r, w)
        unit = self.unit or 1.0
        rounding = self.rounding(r)
        if not residual <= max(tolerance * unit, rounding):
            raise StepFailure(
                f"{method} stopped after {iterations} iterations with residual "
                f"{residual / unit:.1e}: try another friction method (FrictionNewton, NSGS, "
                "FixedPoint), or a smaller step of time or load"
            )
        is_still = np.linalg.norm(w[:, 1:], axis=1) <= STILL * max(residual, rounding)
        return FrictionResult(
            r=r * self.delassus.scale,
            active=(r[:, 0] > 0.0) | self.delassus.bilateral,
            stick=is_still & (self.limit(r[:, 0]) > 0.0),
            iterations=iterations,
            residual=residual / unit,
            method=method,
            history=tuple(last.history),
        )


class ScaledDelassus:
    """Hold d G d with its scale: what the methods work on.

    Attributes:
        scale: (m, d) the numbers d.
        matrix: (m d, m d) the scaled G.
        norm: the largest sum of absolute entries of one of its rows.
        bilateral: (m,) which rows are.
        count, dimension: m and d.
        symmetric: whether G is.
    """

    def __init__(self, G: Array, bilateral: Mask, *, unsymmetric: bool = False) -> None:
        """Check and scale G.

        Args:
            G: the Delassus operator (m d, m d) [m/N].
            bilateral: (m,) which rows are bilateral.
            unsymmetric: whether G need not be symmetric.

        Raises:
            InputError: G has not m d rows for some d, or is not finite, or not symmetric.
        """
        m = len(bilateral)
        d = G.shape[0] // m if m else 1
        if G.ndim != 2 or G.shape != (m * d, m * d):
            raise InputError(
                f"the Delassus operator has shape {G.shape} for {m} points: give m d rows, node by "
                "node"
            )
        scale = compute_scale(G).reshape(m, d)
        if d > 1:  # one number for the tangents of a node: disks stay disks
            tangents = np.ascontiguousarray(scale[:, 1:])  # without gaps: see energy_scale
            mean = np.mean(tangents**-2.0, axis=1)
            scale[:, 1:] = mean[:, None] ** -0.5
        self.scale = scale
        self.bilateral = bilateral.copy()
        self.count = m
        self.dimension = d
        self.matrix, self.norm = scale_matrix(G, scale.ravel(), unsymmetric=unsymmetric)
        self.symmetric = not unsymmetric or np.array_equal(self.matrix, self.matrix.T)

    def product(self, r: Array) -> Array:
        """Return G r (m d,). Of a symmetric G few rows are read where few carry something."""
        if not self.symmetric:
            return np.asarray(self.matrix @ r)
        carried = np.flatnonzero(r)
        if len(carried) <= FEW * len(r):
            return np.asarray(r[carried] @ self.matrix[carried])
        return np.asarray(blas.dsymv(1.0, self.matrix.T, r))  # reads half of it

    def product_at(self, i: int, r: Array) -> Array:
        """Return the rows (d,) of node i of G r, r (m d,)."""
        d = self.dimension
        return np.asarray(self.matrix[i * d : (i + 1) * d] @ r)

    def block_at(self, i: int) -> Array:
        """Return the block (d, d) of node i on the diagonal of G."""
        rows = slice(i * self.dimension, (i + 1) * self.dimension)
        return np.asarray(self.matrix[rows, rows])

    def make_short(self) -> ShortMatrices:
        """Return what the compiled sweeps read, in single precision."""
        G = self.matrix.astype(np.float32)
        d = self.dimension
        if d != 2:
            return ShortMatrices(G, None, None)
        triangle, info = lapack.spotrf(G, lower=1)
        if info:  # not positive definite to single precision
            return ShortMatrices(G, None, None)
        H = lapack.spotri(triangle, lower=1)[0]
        H = np.ascontiguousarray(np.tril(H) + np.tril(H, -1).T)
        places = np.arange(len(H)).reshape(-1, d)
        blocks = np.linalg.inv(H[places[:, :, None], places[:, None, :]])
        return ShortMatrices(G, H, np.ascontiguousarray(blocks))

    @cached_property
    def inverse(self) -> Array | None:
        """Return the inverse of the matrix; None where it is not positive definite to rounding."""
        factor = lapack.dpotrf(self.matrix, lower=1)[0]
        inverse, info = lapack.dpotri(factor, lower=1)
        return None if info else np.tril(inverse) + np.tril(inverse, -1).T

    def problem(self, q: Array, cohesion: Array, slope: Array) -> ScaledProblem:
        """Return problem (1) in scaled numbers.

        Args:
            q: (m, d) gap, and minus the slip, without reactions [m].
            cohesion: (m,) [N].
            slope: (m,).

        Raises:
            InputError: q contains NaN, or infinity where no gap may be open for ever.
        """
        check_gap(q[:, 0], self.bilateral)
        if not np.isfinite(q[:, 1:]).all():
            raise InputError(
                "the slip without reactions contains NaN or infinity: check the loads of this step"
            )
        normal = self.scale[:, 0]
        tangential = self.scale[:, -1]
        return ScaledProblem(
            self,
            q=q * self.scale,
            cohesion=cohesion / tangential,
            slope=slope * (normal / tangential),
        )


@dataclass(frozen=True)
class PreparedFriction:
    """Solve (1) for one G and many right-hand sides.

    Attributes:
        method: the settings.
        tolerance: the residual above which an answer is refused, that of r = 0 being 1.
        delassus: G.
        loop: (problem, where to start) -> where the method ended.
    """

    method: object
    tolerance: float
    delassus: ScaledDelassus
    loop: Callable[[ScaledProblem, Array], LastIterate]

    def solve(
        self, q: Array, cohesion: Array, slope: Array, guess: Array | Mask | None = None
    ) -> FrictionResult:
        """Solve (1).

        Args:
            q: (m, d) gap, and minus the slip, without reactions.
            cohesion: (m,) [as r].
            slope: (m,).
            guess: (m,) predicted contact set, or reactions (m, d).

        Raises:
            StepFailure: the tolerance is not reached.
        """
        step = self.delassus.problem(q, cohesion, slope)
        start = step.start(guess if step.unit > 0.0 else None)
        return step.result(self.method, self.tolerance, self.loop(step, start))
