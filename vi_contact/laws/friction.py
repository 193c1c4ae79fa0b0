"""Bound friction: how large the tangential reaction may be, and the projection onto that disk.

With r_n >= 0 the normal reaction of a contact node and r_t its tangential reaction (d - 1
components), every law says

    |r_t| <= limit,      r_t along the slip rate when |r_t| = limit

and differs only in `limit`, which is affine in the pressure: limit = cohesion + slope max(r_n, 0).
Reactions are forces [N] for displacement schemes and impulses [N s] for velocity schemes; `scale`
(1 or the time step [s]) is the factor between the two, so that a stress times a nodal weight
becomes either. The slope may depend on the slip rate: `at`. The arguments of the methods of a law
are those of ``core.protocols.FrictionLaw``, which explains them.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np

from ..core.algebra import Array
from ..core.arguments import check_fields
from ..core.checks import function, quote
from ..core.errors import InputError
from ..core.quantities import RATIO, Between, Unit

ONE_EACH = "give zero or a positive finite number, or one per point"
PerPoint = Annotated[float | Array | tuple[float, ...], Between(0.0, math.inf, remedy=ONE_EACH)]


@dataclass(frozen=True)
class Tresca:
    """Bound friction by a threshold, whether or not the node touches.

    limit = threshold · weight · scale. A wrong count of values raises InputError when the law is
    used.

    Attributes:
        threshold: a number [Pa], or one per contact point (then kept as a tuple).
    """

    never_negative: ClassVar[bool] = True  # it has checked its values
    threshold: Annotated[PerPoint, Unit("Pa"), "the threshold"]

    def __post_init__(self) -> None:
        check_fields(self)
        object.__setattr__(self, "threshold", keep_as_tuple("Tresca", self.threshold))

    def limit(self, r_n: Array, weights: Array, scale: float) -> Array:
        """Return threshold · weights · scale, shape (m,).

        Args:
            r_n: normal reactions (m,), [N] or [N s].
            weights: nodal weights (m,), areas in space.
            scale: factor from forces to reactions, 1 or the time step [s].
        """
        threshold = spread_values("Tresca", "threshold", self.threshold, len(weights))
        return threshold * np.asarray(weights, dtype=float) * scale

    def slope(self, weights: Array) -> Array:
        """Return zeros, shape (m,)."""
        return np.zeros(len(weights))

    def at(self, speed: Array) -> "Tresca":
        """Return itself: the law does not know the slip rate."""
        return self


@dataclass(frozen=True)
class Coulomb:
    """Bound dry friction by a coefficient mu: limit = mu · r_n, zero for an open node.

    A wrong count of values raises InputError when the law is used.

    Attributes:
        mu: a number, or one per contact point (then kept as a tuple).
    """

    never_negative: ClassVar[bool] = True  # it has checked its values
    mu: Annotated[PerPoint, RATIO, "the friction coefficient mu"]

    def __post_init__(self) -> None:
        check_fields(self)
        object.__setattr__(self, "mu", keep_as_tuple("Coulomb", self.mu))

    def limit(self, r_n: Array, weights: Array, scale: float) -> Array:
        """Return mu · max(r_n, 0), shape (m,).

        Tension, of a held point or on the way to an answer, rubs on nothing.

        Args:
            r_n: normal reactions (m,), [N] or [N s].
            weights: nodal weights (m,), areas in space.
            scale: factor from forces to reactions, 1 or the time step [s].
        """
        return spread_values("Coulomb", "mu", self.mu, len(r_n)) * np.maximum(r_n, 0.0)

    def slope(self, weights: Array) -> Array:
        """Return mu, shape (m,)."""
        return spread_values("Coulomb", "mu", self.mu, len(weights)) * np.ones(len(weights))

    def at(self, speed: Array) -> "Coulomb":
        """Return itself: the law does not know the slip rate."""
        return self


@dataclass(frozen=True)
class SlipRateCoulomb:
    """Bound dry friction by a coefficient that depends on the slip rate: limit = mu(|v|) · r_n.

    The law is implicit: |v| is that of the step being solved, (B_t u1 - B_t u0)/dt or B_t v1. mu(0)
    is the static coefficient. What is no function raises InputError, and so does, when the law is
    used, a negative or infinite coefficient.

    Attributes:
        mu: ExponentialDecay, StaticKinetic, or any function that takes speeds (m,) [m/s] >= 0, and
            returns as many coefficients, or one.
    """

    mu: Annotated["ExponentialDecay | StaticKinetic | Callable[[Array], Any]", RATIO]

    def __post_init__(self) -> None:
        function(
            "SlipRateCoulomb", "mu", self.mu, "give a function of the slip rate, or use Coulomb()"
        )

    def at(self, speed: Array) -> Coulomb:
        """Return Coulomb's law with the coefficients of these speeds."""
        if not len(speed):  # users' functions need not cope with none
            return Coulomb(speed)
        answer = self.mu(speed)
        values = np.asarray(answer)
        if values.dtype.kind not in "iuf" or values.shape not in ((), speed.shape):
            raise InputError(
                f"SlipRateCoulomb: mu returns {quote(answer)}, of shape {values.shape} for "
                f"{len(speed)} slip rates; return one real coefficient per rate"
            )
        mu = np.broadcast_to(values.astype(float), speed.shape)
        wrong = np.flatnonzero(~(np.isfinite(mu) & (mu >= 0.0)))
        if len(wrong):
            first = wrong[0]
            raise InputError(
                f"SlipRateCoulomb: mu({speed[first]:.6g} m/s) is {mu[first]:.6g}; let it "
                "return zero or a positive finite number for every slip rate from 0 on"
            )
        return Coulomb(mu)

    def limit(self, r_n: Array, weights: Array, scale: float) -> Array:
        """Return mu(0) · max(r_n, 0), shape (m,): at rest.

        Args:
            r_n: normal reactions (m,), [N] or [N s].
            weights: nodal weights (m,), areas in space.
            scale: factor from forces to reactions, 1 or the time step [s].
        """
        return self.at(np.zeros(len(r_n))).limit(r_n, weights, scale)

    def slope(self, weights: Array) -> Array:
        """Return mu(0), shape (m,): at rest."""
        return self.at(np.zeros(len(weights))).slope(weights)


@dataclass(frozen=True)
class TwoCoefficients:
    """Hold a static and a kinetic coefficient, each a number or one per contact point."""

    mu_s: Annotated[PerPoint, RATIO, "the static coefficient mu_s"]
    mu_k: Annotated[PerPoint, RATIO, "the kinetic coefficient mu_k"]

    def __post_init__(self) -> None:
        check_fields(self)
        for name in ("mu_s", "mu_k"):
            object.__setattr__(self, name, keep_as_tuple(type(self).__name__, getattr(self, name)))
        static = self.mu_s
        kinetic = self.mu_k
        if not isinstance(static, tuple) or not isinstance(kinetic, tuple):
            return
        if len(static) != len(kinetic):
            raise InputError(
                f"{self}: there are {len(static)} mu_s and {len(kinetic)} mu_k; give as many"
            )

    def _coefficients(self, count: int) -> tuple[Array, Array]:
        """Return mu_s and mu_k as arrays that broadcast over ``count`` nodes."""
        owner = type(self).__name__
        static = spread_values(owner, "mu_s", self.mu_s, count)
        kinetic = spread_values(owner, "mu_k", self.mu_k, count)
        return static, kinetic


@dataclass(frozen=True)
class ExponentialDecay(TwoCoefficients):
    """Give a friction coefficient that decays with the slip rate.

    mu(v) = mu_k + (mu_s - mu_k) exp(-v/v_c): from static to kinetic friction over the speed v_c.

    Attributes:
        mu_s: the static coefficient, a number or one per contact point.
        mu_k: the kinetic coefficient, a number or one per contact point.
        v_c: the speed [m/s].
    """

    v_c: Annotated[
        float,
        Between(0.0, math.inf, "(]", "give a positive speed, or StaticKinetic()"),
        Unit("m/s"),
        "v_c",
    ]

    def __call__(self, speed: Array) -> Array:
        """Return mu (m,) of each speed (m,) [m/s]."""
        static, kinetic = self._coefficients(len(speed))
        return np.asarray(kinetic + (static - kinetic) * np.exp(-speed / self.v_c))


@dataclass(frozen=True)
class StaticKinetic(TwoCoefficients):
    """Give mu_s at rest, mu_k in motion: the limit of ExponentialDecay for v_c -> 0.

    Where a step can be solved both at rest and in motion, rest is chosen.

    Attributes:
        mu_s: the static coefficient, a number or one per contact point; at least mu_k.
        mu_k: the kinetic coefficient, a number or one per contact point.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        if np.any(np.asarray(self.mu_s) < np.asarray(self.mu_k)):
            raise InputError(
                f"{self}: friction that begins to grow with slip has no rate; give mu_s >= mu_k"
            )

    def __call__(self, speed: Array) -> Array:
        """Return mu (m,) of each speed (m,) [m/s]."""
        static, kinetic = self._coefficients(len(speed))
        return np.where(speed == 0.0, static, kinetic)


def project(r_t: Array, limit: Array) -> Array:
    """Return the nearest points of the friction disks |r_t| <= limit, node by node.

    They are r_t · min(1, limit / |r_t|), in a new array.

    Args:
        r_t: tangential reactions (m, d - 1).
        limit: radii (m,) >= 0, infinite for a node that cannot slip.

    Raises:
        InputError: the shapes do not match.
    """
    if r_t.ndim != 2 or limit.shape != r_t.shape[:1]:
        raise InputError(
            f"project: r_t has shape {r_t.shape} and limit {limit.shape}; give one row of "
            "tangential components and one limit per node"
        )
    size = np.abs(r_t[:, 0]) if r_t.shape[1] == 1 else np.linalg.norm(r_t, axis=1)
    factor = np.divide(limit, size, out=np.ones(len(size)), where=size > limit)
    return r_t * factor[:, np.newaxis]


def keep_as_tuple(law: str, value: Any) -> Any:
    """Return one value as it is, and values per point as a tuple, which laws can be compared by."""
    if np.ndim(value) > 1:
        raise InputError(f"{law}: the values have shape {np.shape(value)}; {ONE_EACH}")
    per_point = isinstance(value, (tuple, list, np.ndarray)) and np.ndim(value) == 1
    return tuple(map(float, value)) if per_point else value


def spread_values(law: str, name: str, value: Any, count: int) -> Array:
    """Return the value as an array that broadcasts over ``count`` nodes.

    Args:
        law: class of the law, for the sentence.
        name: the coefficient.
        value: a number, or a tuple of one per node.
        count: number of nodes.
    """
    if isinstance(value, tuple) and len(value) != count:
        raise InputError(
            f"{law}: {name} has {len(value)} values but there are {count} contact points: give one "
            "number, or one per contact point in the order of surface.points"
        )
    return np.asarray(value, dtype=float)
