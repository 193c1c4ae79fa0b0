"""Write a step with given thresholds s of friction as a complementarity problem in simple bounds.

The tangential reactions lambda = r_t are unknowns beside the z of ``bounded_system``. A point that
has one free tangent (2D) carries

    F_lambda = slip0 - B_t x,     -s <= lambda <= s:
    0 where lambda is inside, <= 0 where lambda = s, >= 0 at -s

which is |r_t| <= s, r_t along the slip. A point with two (3D) carries the disk itself, no polygon:
with the speed factor gamma >= 0 of the slip, slip = gamma r_t,

    F_lambda = slip0 - B_t x + gamma lambda = 0
    F_gamma = (s² - |lambda|²)/s >= 0  ⊥  gamma >= 0.

The equations of the body gain B_tᵀ lambda. Where s = 0 the bounds hold lambda and gamma at zero. In
2D everything is linear and monotone; 3D has one solution too, the multiplier of a convex problem.
The Jacobian is not symmetric.

VINEWTONRSLS reads its next active set off the signs of F after a projection. F_lambda knows nothing
of the projected lambda, F_gamma nothing of the projected gamma: both are zero but for rounding
there, and the iteration would cycle, or end by luck. So SNES sees, with the diagonal c of A and E
the residual of the body, which vanish at the solution,

    F_lambda + E_t / c      and      F_gamma + c lambda·F_lambda / s,

whose signs after a projection say how far the unknown had gone beyond: the rule of the primal-dual
active set method.
"""

from dataclasses import dataclass

import numpy as np

from ...core.algebra import Array, Mask, max_abs
from ...core.step import StepProblem
from ...laws.friction import project
from .bounded_system import BoundedSystem
from .scaled_step import ScaledStep, divide


class FrictionSystem:
    """Number the unknowns of a rank.

    First comes z of ``body``, then lambda of the free tangents, point by point, then gamma.

    Attributes:
        point, component: (L,) contact point and component of each lambda.
        tangent, stiffness: (L,) its position in x, and the diagonal entry of A there.
        disk: (m,) True for points with two free tangents.
        any_disk: whether some rank has one.
        pairs: (D, 2) places of their lambdas.
        line: (L,) True for the other lambdas.
        first_gamma: where gamma begins.
        size: number of unknowns.
    """

    def __init__(self, body: BoundedSystem) -> None:
        """Find where the unknowns are. Collective."""
        self.body = body
        self.surface = body.surface
        free = body.surface.tangents >= 0
        self.point, self.component = np.nonzero(free)
        self.tangent = body.surface.tangents[free]
        self.disk: Mask = free.sum(axis=1) > 1
        self.pairs = np.flatnonzero(self.disk[self.point]).reshape(-1, 2)
        self.line: Mask = ~self.disk[self.point]
        self.first_gamma = body.size + len(self.tangent)
        self.size = self.first_gamma + len(self.pairs)
        self.any_disk = bool(body.max(float(len(self.pairs)))[0])
        self.stiffness = body.A.matrix.diagonal()[self.tangent]

    def split(self, y: Array) -> tuple[Array, Array, Array]:
        """Return the parts (z, lambda, gamma) of y."""
        z = y[: self.body.size]
        reaction = y[self.body.size : self.first_gamma]
        return z, reaction, y[self.first_gamma :]

    def origin(self, step: StepProblem) -> Array:
        """Return (L,) x of the free tangents where the slip is zero."""
        assert step.slip0 is not None
        return np.asarray(step.slip0[self.point, self.component])

    def by_point(self, values: Array) -> Array:
        """Return (m, d - 1) of values (L,), zero where a tangent is prescribed."""
        table = np.zeros(self.surface.tangents.shape)
        table[self.point, self.component] = values
        return table


@dataclass(frozen=True)
class FrictionUnknowns:
    """Hold the owned values of the unknowns of a rank.

    Attributes:
        z: the unknowns of the body and its springs.
        reaction: (L,) lambda [as r_t].
        gamma: (D,) slip over r_t of points with disks.
    """

    z: Array
    reaction: Array
    gamma: Array


class ScaledFrictionStep(ScaledStep):
    """Evaluate F(y), with bounds, for the step and limits set last.

    y = (z/x_ref, lambda/r_ref, gamma r_ref/x_ref).

    Attributes:
        friction: the numbers of the unknowns.
        limit: (m,) thresholds over r_ref.
    """

    def __init__(self, friction: FrictionSystem, tolerance: float) -> None:
        """Note the system; ``set_friction`` takes a step."""
        super().__init__(friction.body, tolerance)
        self.friction = friction
        self.limit = np.zeros(len(friction.disk))

    def set_friction(self, step: StepProblem, limit: Array, start: FrictionUnknowns) -> None:
        """Take a step with given thresholds. Collective.

        Args:
            step: the step.
            limit: (m,) thresholds [as r_t].
            start: where to begin.
        """
        friction = self.friction
        self.set(step, start.z)
        self.limit = limit / self.r_ref
        self._origin = friction.origin(step) / self.x_ref

        # lambda lies between -s and s at points with one tangent, and is free where there is a
        # disk; gamma >= 0 there. Both are held at zero where s = 0.
        s = self.limit[friction.point]
        s = np.where(friction.line | (s == 0.0), s, np.inf)
        disks = self.disk_limits
        self.lower = np.concatenate([self.lower, -s, np.zeros_like(disks)])
        self.upper = np.concatenate([self.upper, s, np.where(disks > 0.0, np.inf, 0.0)])
        factors = start.gamma * (self.r_ref / self.x_ref)
        self.start = np.concatenate([self.start, start.reaction / self.r_ref, factors])

    @property
    def disk_limits(self) -> Array:
        """Return (D,) scaled thresholds of the points with disks."""
        return self.limit[self.friction.disk]

    @property
    def disk_inverse(self) -> Array:
        """Return (D,) 1/s, zero where s = 0."""
        s = self.disk_limits
        return np.divide(1.0, s, out=np.zeros_like(s), where=s > 0.0)

    @property
    def disk_stiffness(self) -> Array:
        """Return (D,) scaled stiffness of the points with disks."""
        mean = self.friction.stiffness[self.friction.pairs].mean(axis=1)
        return np.asarray(mean * (self.x_ref / self.r_ref))

    def _evaluate_parts(self, y: Array) -> tuple[Array, Array, Array]:
        """Return E, F_lambda and F_gamma at y."""
        friction = self.friction
        z, reaction, gamma = friction.split(y)
        body = super().residual(z)
        body[friction.tangent] += reaction
        pairs = reaction[friction.pairs]
        still = self._origin - z[friction.tangent]
        still[friction.pairs] += gamma[:, None] * pairs
        room = self.disk_limits - np.sum(pairs**2, axis=1) * self.disk_inverse
        return body, still, room

    def disks(self, y: Array) -> tuple[Array, Array, Array]:
        """Return (D, 2) lambda, (D, 2) F_lambda and (D,) gamma of the points with disks."""
        friction = self.friction
        z, reaction, gamma = friction.split(y)
        pairs = reaction[friction.pairs]
        still = (self._origin - z[friction.tangent])[friction.pairs]
        return pairs, still + gamma[:, None] * pairs, gamma

    def residual(self, y: Array) -> Array:
        """Return F(y) as SNES sees it."""
        friction = self.friction
        body, still, room = self._evaluate_parts(y)

        # What tells the signs after a projection: c lambda·F_lambda / s of disks, E_t / c of lines.
        pairs, of_disks, _ = self.disks(y)
        room += self.disk_stiffness * self.disk_inverse * np.sum(pairs * of_disks, axis=1)
        line = friction.line
        unbalanced = body[friction.tangent[line]] * (self.r_ref / self.x_ref)
        still[line] += unbalanced / friction.stiffness[line]

        # Where s = 0 lambda and gamma are on both their bounds, and any F but zero keeps them.
        held = self.limit == 0.0
        still[held[friction.point]] = 1.0
        room[held[friction.disk]] = 1.0
        return np.concatenate([body, still, room])

    def errors(self, y: Array, F: Array) -> tuple[float, float, float]:
        """Return the errors as without friction; the second counts slips and disks too. Collective.

        F is not used: it is not what the certificate judges.
        """
        friction = self.friction
        s = self.disk_limits
        _, reaction, gamma = friction.split(y)
        body, still, room = self._evaluate_parts(y)
        force, gap, backward = super().errors(y[: self.system.size], body)

        # Slips that are wrong in size or sign beside the bounds of lambda.
        _, low, _ = friction.split(self.lower)
        _, high, _ = friction.split(self.upper)
        wrong = np.where(reaction >= high, np.maximum(still, 0.0), still)
        wrong = np.where(reaction <= low, np.minimum(still, 0.0), wrong)
        wrong[low == high] = 0.0
        slip, y_max = self.system.max(max_abs(wrong), max_abs(y[: self.system.rows]))

        # Of a disk either the slip or the distance from its edge is zero, as shares of their sizes.
        edge = np.minimum(gamma * s / y_max if y_max > 0.0 else gamma, room * self.disk_inverse)
        disk = float(self.system.max(max_abs(edge))[0])
        return force, max(gap, divide(slip, y_max), disk), backward

    def sliding(self, y: Array) -> Mask:
        """Return (m,) which points are on the edge of their disk."""
        friction = self.friction
        _, reaction, gamma = friction.split(y)
        at_bound = np.abs(reaction) >= self.limit[friction.point]
        slides = np.zeros(len(self.limit), dtype=bool)
        slides[friction.point[friction.line]] = at_bound[friction.line]
        slides[friction.disk] = gamma > 0.0
        return slides | (self.limit == 0.0)

    def physical(self, y: Array) -> FrictionUnknowns:
        """Return y in the units of the step."""
        z, reaction, gamma = self.friction.split(y)
        return FrictionUnknowns(
            z * self.x_ref, reaction * self.r_ref, gamma * (self.x_ref / self.r_ref)
        )

    def slip(self, z: Array, sliding: Mask) -> Array:
        """Return (L,) B_t x - slip0 of the owned points, zero where they stick."""
        friction = self.friction
        moved = z[friction.tangent] - self._origin * self.x_ref
        return np.where(sliding[friction.point], moved, 0.0)

    def fit_to_limits(self, state: FrictionUnknowns, slip: Array, limit: Array) -> FrictionUnknowns:
        """Return the state with reactions in new disks.

        Args:
            state: the unknowns.
            slip: (L,); points that slide are put on the edge of their disk, along their slip.
            limit: (m,) radii of the disks [as r_t].
        """
        friction = self.friction
        way = friction.by_point(slip)
        length = np.linalg.norm(way, axis=1)
        inside = project(friction.by_point(state.reaction), limit)
        reaction = np.divide(
            way * limit[:, None], length[:, None], out=inside, where=length[:, None] > 0.0
        )
        gamma = np.divide(length, limit, out=np.zeros_like(limit), where=limit > 0.0)
        return FrictionUnknowns(
            state.z, reaction[friction.point, friction.component], gamma[friction.disk]
        )
