"""Friction laws: how large the tangential reaction may be, and the projection onto that disk.

With r_n >= 0 the normal reaction of a contact node and r_t its tangential reaction (d - 1 components), every law says

    |r_t| <= limit,      r_t along the slip rate when |r_t| = limit        (seed 003, friction threshold F)

and differs only in `limit`. Reactions are forces [N] for displacement schemes and impulses [N s] for velocity schemes;
`scale` (1 or the time step [s]) is the factor between the two, so that a stress times a nodal weight becomes either.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from numbers import Real
from typing import Protocol

import numpy as np

from .algebra import Array
from .errors import InputError


class FrictionLaw(Protocol):
    """What a solver asks of a friction law."""

    def limit(self, r_n: Array, weights: Array, scale: float) -> Array:
        """Largest tangential reaction of each node, shape (n,), in the unit of r_n.

        r_n: normal reactions, shape (n,) [N or N s]; weights: tributary lengths or areas, shape (n,) [m or m²];
        scale: 1 for forces, dt [s] for impulses.
        """
        ...


@dataclass(frozen=True)
class Frictionless:
    """No tangential reaction: limit = 0."""

    def limit(self, r_n: Array, weights: Array, scale: float) -> Array:
        """Zeros, shape (n,)."""
        return np.zeros_like(r_n, dtype=float)


@dataclass(frozen=True)
class Tresca:
    """A given threshold [Pa] >= 0, acting whether or not the node touches: limit = threshold · weight · scale.

    Raises InputError when the threshold is negative or not a finite number.
    """

    threshold: float

    def __post_init__(self) -> None:
        _check("Tresca", "the threshold [Pa]", self.threshold)

    def limit(self, r_n: Array, weights: Array, scale: float) -> Array:
        """threshold · weights · scale, shape (n,)."""
        return self.threshold * np.asarray(weights, dtype=float) * scale


@dataclass(frozen=True)
class Coulomb:
    """Dry friction with coefficient mu >= 0: limit = mu · r_n, zero for an open node.

    Raises InputError when mu is negative or not a finite number.
    """

    mu: float

    def __post_init__(self) -> None:
        _check("Coulomb", "the friction coefficient mu", self.mu)

    def limit(self, r_n: Array, weights: Array, scale: float) -> Array:
        """mu · max(r_n, 0), shape (n,): a tension left over in an unconverged iterate gives no friction."""
        return self.mu * np.maximum(r_n, 0.0)


def project(r_t: Array, limit: Array) -> Array:
    """Nearest point of the friction disks |r_t| <= limit: r_t · min(1, limit / |r_t|), node by node.

    r_t: tangential reactions, shape (n, d - 1); limit: radii >= 0, shape (n,), infinite for a node that cannot slip.
    Returns a new array of the shape of r_t. Raises InputError when the shapes do not match.
    """
    if r_t.ndim != 2 or limit.shape != r_t.shape[:1]:
        raise InputError(f"project: r_t has shape {r_t.shape} and limit {limit.shape}; "
                         "give one row of tangential components and one limit per node")
    size = np.linalg.norm(r_t, axis=1)
    factor = np.ones_like(size)
    np.divide(limit, size, out=factor, where=size > limit)
    return r_t * factor[:, np.newaxis]


def _check(law: str, meaning: str, value: float) -> None:
    if not isinstance(value, Real) or not math.isfinite(value) or value < 0:
        raise InputError(f"{law}: {meaning} is {value!r}; give zero or a positive finite number")


def refuse_friction(solver: str, law: FrictionLaw) -> None:
    """InputError unless the law is Frictionless: a solver that only enforces bounds would silently drop it."""
    if not isinstance(law, Frictionless):
        raise InputError(
            f"{solver} only enforces bounds and would ignore {law}: use Frictionless() here, "
            "no solver of this version carries friction, neither a condensed nor a volume one"
        )
