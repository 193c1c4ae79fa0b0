"""Bound friction: how large the tangential reaction may be, and the projection onto that disk.

With r_n >= 0 the normal reaction of a contact node and r_t its tangential reaction (d - 1
components), every law says

    |r_t| <= limit,      r_t along the slip rate when |r_t| = limit

and differs only in `limit`, which is affine in the pressure: limit = cohesion + slope max(r_n, 0).
Reactions are forces [N] for displacement schemes and impulses [N s] for velocity schemes; `scale`
(1 or the time step [s]) is the factor between the two, so that a stress times a nodal weight
becomes either. The slope may depend on the slip rate: `at`.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar

import numpy as np

from ..core.algebra import Array
from ..core.arguments import check_fields
from ..core.checks import function, shown
from ..core.errors import InputError
from ..core.quantities import RATIO, Between, Unit

ONE_EACH = "give zero or a positive finite number, or one per point"
PerPoint = Annotated[float | Array | tuple[float, ...], Between(0.0, math.inf, remedy=ONE_EACH)]


@dataclass(frozen=True)
class Tresca:
    """Bound friction by a threshold, whether or not the node touches.

    limit = threshold · weight · scale.

    ``threshold``: a number, or one per contact point (then kept as a tuple). Raises InputError for
    a wrong count, when used.
    """

    never_negative: ClassVar[bool] = True  # it has checked its values
    threshold: Annotated[PerPoint, Unit("Pa"), "the threshold"]

    def __post_init__(self) -> None:
        check_fields(self)
        object.__setattr__(self, "threshold", _frozen("Tresca", self.threshold))

    def limit(self, r_n: Array, weights: Array, scale: float) -> Array:
        """Return threshold · weights · scale, shape (n,)."""
        return (
            _nodal("Tresca", "threshold", self.threshold, len(weights))
            * np.asarray(weights, dtype=float)
            * scale
        )

    def slope(self, weights: Array) -> Array:
        """Return zeros, shape (n,)."""
        return np.zeros(len(weights))

    def at(self, speed: Array) -> "Tresca":
        """Return itself: the law does not know the slip rate."""
        return self


@dataclass(frozen=True)
class Coulomb:
    """Bound dry friction by a coefficient mu: limit = mu · r_n, zero for an open node.

    ``mu`` is a number, or has one per contact point (then kept as a tuple). InputError is raised,
    when the law is used, if their count is wrong.
    """

    never_negative: ClassVar[bool] = True  # it has checked its values
    mu: Annotated[PerPoint, RATIO, "the friction coefficient mu"]

    def __post_init__(self) -> None:
        check_fields(self)
        object.__setattr__(self, "mu", _frozen("Coulomb", self.mu))

    def limit(self, r_n: Array, weights: Array, scale: float) -> Array:
        """Return mu · max(r_n, 0), shape (n,).

        Tension, of a held point or on the way to an answer, rubs on nothing.
        """
        return _nodal("Coulomb", "mu", self.mu, len(r_n)) * np.maximum(r_n, 0.0)

    def slope(self, weights: Array) -> Array:
        """Return mu, shape (n,)."""
        return _nodal("Coulomb", "mu", self.mu, len(weights)) * np.ones(len(weights))

    def at(self, speed: Array) -> "Coulomb":
        """Return itself: the law does not know the slip rate."""
        return self


@dataclass(frozen=True)
class SlipRateCoulomb:
    """Bound dry friction by a coefficient that depends on the slip rate: limit = mu(|v|) · r_n.

    ``mu``: ExponentialDecay, StaticKinetic, or any function that takes speeds [m/s] >= 0, shape
    (n,), and returns as many coefficients, or one. InputError for no function and, when used, a
    negative or infinite coefficient.

    Implicit: |v| is that of the step being solved, (B_t u1 - B_t u0)/dt or B_t v1. mu(0) is the
    static coefficient.
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
        values = self.mu(speed)
        found = np.asarray(values)
        if found.dtype.kind not in "iuf" or found.shape not in ((), speed.shape):
            raise InputError(
                f"SlipRateCoulomb: mu returns {shown(values)}, of shape {found.shape} for "
                f"{len(speed)} slip rates; return one real coefficient per rate"
            )
        found = np.broadcast_to(found.astype(float), speed.shape)
        wrong = np.flatnonzero(~(np.isfinite(found) & (found >= 0.0)))
        if len(wrong):
            raise InputError(
                f"SlipRateCoulomb: mu({speed[wrong[0]]:.6g} m/s) is {found[wrong[0]]:.6g}; let it "
                "return zero or a positive finite number for every slip rate from 0 on"
            )
        return Coulomb(found)

    def limit(self, r_n: Array, weights: Array, scale: float) -> Array:
        """Return mu(0) · max(r_n, 0), shape (n,): at rest."""
        return self.at(np.zeros(len(r_n))).limit(r_n, weights, scale)

    def slope(self, weights: Array) -> Array:
        """Return mu(0), shape (n,): at rest."""
        return self.at(np.zeros(len(weights))).slope(weights)


@dataclass(frozen=True)
class TwoCoefficients:
    """Hold static and kinetic coefficients, or one of both per contact point."""

    mu_s: Annotated[PerPoint, RATIO, "the static coefficient mu_s"]
    mu_k: Annotated[PerPoint, RATIO, "the kinetic coefficient mu_k"]

    def __post_init__(self) -> None:
        check_fields(self)
        for name in ("mu_s", "mu_k"):
            object.__setattr__(self, name, _frozen(type(self).__name__, getattr(self, name)))
        if (
            isinstance(self.mu_s, tuple)
            and isinstance(self.mu_k, tuple)
            and len(self.mu_s) != len(self.mu_k)
        ):
            raise InputError(
                f"{self}: there are {len(self.mu_s)} mu_s and {len(self.mu_k)} mu_k; give as many"
            )

    def _nodal(self, count: int) -> list[Array]:
        """mu_s and mu_k as arrays that broadcast over the nodes."""
        return [
            _nodal(type(self).__name__, name, getattr(self, name), count)
            for name in ("mu_s", "mu_k")
        ]


@dataclass(frozen=True)
class ExponentialDecay(TwoCoefficients):
    """Give a friction coefficient that decays with the slip rate.

    mu(v) = mu_k + (mu_s - mu_k) exp(-v/v_c): from static to kinetic friction over the speed v_c.

    mu_s, mu_k: numbers, or one per contact point.
    """

    v_c: Annotated[
        float,
        Between(0.0, math.inf, "(]", "give a positive speed, or StaticKinetic()"),
        Unit("m/s"),
        "v_c",
    ]

    def __call__(self, speed: Array) -> Array:
        """Return mu of each speed."""
        static, kinetic = self._nodal(len(speed))
        return np.asarray(kinetic + (static - kinetic) * np.exp(-speed / self.v_c))


@dataclass(frozen=True)
class StaticKinetic(TwoCoefficients):
    """Give mu_s at rest, mu_k in motion: the limit of ExponentialDecay for v_c -> 0.

    Where both hold, rest is chosen.

    mu_s >= mu_k: numbers, or one per contact point.
    """

    def __post_init__(self) -> None:
        super().__post_init__()
        if np.any(np.asarray(self.mu_s) < np.asarray(self.mu_k)):
            raise InputError(
                f"{self}: friction that begins to grow with slip has no rate; give mu_s >= mu_k"
            )

    def __call__(self, speed: Array) -> Array:
        """Return mu of each speed."""
        static, kinetic = self._nodal(len(speed))
        return np.where(speed == 0.0, static, kinetic)


def project(r_t: Array, limit: Array) -> Array:
    """Return the nearest point of the friction disks |r_t| <= limit, node by node.

    It is r_t · min(1, limit / |r_t|).

    r_t: tangential reactions, shape (n, d - 1); limit: radii >= 0, shape (n,), infinite for a node
    that cannot slip. Returns a new array of the shape of r_t. Raises InputError when the shapes do
    not match.
    """
    if r_t.ndim != 2 or limit.shape != r_t.shape[:1]:
        raise InputError(
            f"project: r_t has shape {r_t.shape} and limit {limit.shape}; give one row of "
            "tangential components and one limit per node"
        )
    size = np.abs(r_t[:, 0]) if r_t.shape[1] == 1 else np.linalg.norm(r_t, axis=1)
    factor = np.divide(limit, size, out=np.ones(len(size)), where=size > limit)
    return r_t * factor[:, np.newaxis]


def _frozen(law: str, value: Any) -> Any:
    """Return the value, or those of a field as a tuple (frozen, comparable)."""
    if np.ndim(value) > 1:
        raise InputError(f"{law}: the values have shape {np.shape(value)}; {ONE_EACH}")
    field = isinstance(value, (tuple, list, np.ndarray)) and np.ndim(value) == 1
    return tuple(float(one) for one in value) if field else value


def _nodal(law: str, name: str, value: Any, count: int) -> Array:
    """Return the value as an array that broadcasts over the nodes."""
    if isinstance(value, tuple) and len(value) != count:
        raise InputError(
            f"{law}: {name} has {len(value)} values but there are {count} contact points: give one "
            "number, or one per contact point in the order of surface.points"
        )
    return np.asarray(value, dtype=float)
