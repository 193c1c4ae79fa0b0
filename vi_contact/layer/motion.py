"""Describe systems with one frictionless contact.

They are ordinary differential equations (b-geometry, ENOC 2017, 26 to 28).

In velocities v (of coordinates q, or quasi-velocities) with M = [g_IJ(q)] and A = d rho:

    q̇ = rates(q, v),    M v̇ = f(t, q, v) - Γ(q)(v, v) + Aᵀ lambda,    lambda = 0 outside the layer
    ρ̈ = A v̇ + Ȧ v
    lambda of metric.Metric inside the layer: a spring, a damper and the metric's own terms

Aᵀ lambda is (28): every component is a projection of the one normal equation. Γ is the covariant
part of (23) by the affinities of M, [Γ(v, v)]_I = Ṁ_IJ v_J - ½ ∂M_JK/∂q_I v_J v_K; a constant M has
none. The distance rho >= 0 is the caller's; where it is no length the law's parameters have its
units.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import Any

import numpy as np

from ..core.algebra import Array
from ..core.checks import array, function, number
from ..core.errors import InputError, StepFailure
from .layer import check_size

EVALUATIONS = 100_000  # of the acceleration in one motion
# Step of a central difference over the size of its argument: eps to the power 1/3.
DIFFERENCE_STEP = 6e-6


@dataclass(frozen=True)
class ConstrainedSystem:
    """Describe a configuration manifold with boundary, and the forces on it.

    Args:
        mass: M, (n, n) [kg], constant or a function of q.
        rho: q -> distance to the boundary, > 0 inside.
        gradient: q -> A (n,), ρ̇ = A v.
        force: (t, q, v) -> f (n,): applied forces and, for quasi-velocities, gyroscopic ones; None:
            no forces.
        rates: (q, v) -> q̇; None: v are the rates of q.
        gradient_rate: (q, v) -> Ȧ v; None: by a central difference, to ten digits.
        scale: a typical size of the coordinates, which central differences are taken over 6e-6 of.

    Raises:
        InputError: the mass is not symmetric positive definite, or a function is none.
    """

    mass: Array | Callable[[Array], Array]
    rho: Callable[[Array], float]
    gradient: Callable[[Array], Array]
    force: Callable[[float, Array, Array], Array] | None = None
    rates: Callable[[Array, Array], Array] | None = None
    gradient_rate: Callable[[Array, Array], float] | None = None
    scale: float = 1.0

    def __post_init__(self) -> None:
        owner = "ConstrainedSystem"
        check_size(owner, "the scale of the coordinates", self.scale, "their units")
        if not callable(self.mass):
            check_positive(owner, "the mass matrix", self.mass, "kg")
        for name in ("rho", "gradient", "force", "rates", "gradient_rate"):
            if name in ("rho", "gradient") or getattr(self, name) is not None:
                function(owner, name, getattr(self, name), "give a function, see its docstring")

    def check(self, q: Array, v: Array, t: float = 0.0) -> None:
        """Check what the functions return at a state.

        Args:
            q: coordinates (n_q,).
            v: velocities (n,).
            t: time [s].

        Raises:
            InputError: a function returns another shape, a text, NaN or infinity.
        """
        owner = "ConstrainedSystem"
        n = len(v)
        if self.rates is None and len(q) != n:
            raise InputError(
                f"{owner}: {len(q)} coordinates and {n} velocities; give as many, or rates(q, v)"
            )
        number(owner, "rho(q) at the start", self.rho(q))
        array(owner, "gradient(q) at the start", self.gradient(q), (n,))
        if callable(self.mass):
            check_positive(owner, "the mass matrix", self.mass(q), "kg")
        array(owner, f"the mass matrix of {n} velocities", self.matrix(q), (n, n), unit="kg")
        if self.force is not None:
            array(owner, "force(t, q, v) at the start", self.force(t, q, v), (n,))
        if self.rates is not None:
            array(owner, "rates(q, v) at the start", self.rates(q, v), (len(q),))
        if self.gradient_rate is not None:
            number(owner, "gradient_rate(q, v) at the start", self.gradient_rate(q, v))

    def matrix(self, q: Array) -> Array:
        """Return the mass matrix M(q), (n, n)."""
        return np.asarray(self.mass(q) if callable(self.mass) else self.mass, dtype=float)

    def velocity(self, q: Array, v: Array) -> Array:
        """Return q̇, the rates of the coordinates."""
        return v if self.rates is None else np.asarray(self.rates(q, v))

    def normal_rate(self, q: Array, v: Array) -> float:
        """Return ρ̇ = A v, the rate of the distance."""
        return float(np.dot(self.gradient(q), v))

    def turning(self, q: Array, v: Array) -> float:
        """Return Ȧ v, the part of ρ̈ that is there without acceleration."""
        if self.gradient_rate is not None:
            return float(self.gradient_rate(q, v))
        rate = self.velocity(q, v)
        size = float(np.max(np.abs(rate), initial=0.0))
        if size == 0.0:
            return 0.0
        h = self.difference(q) / size
        change = np.asarray(self.gradient(q + h * rate)) - np.asarray(self.gradient(q - h * rate))
        return float(change @ v) / (2.0 * h)

    def generalised_force(self, t: float, q: Array, v: Array) -> Array:
        """Return f - Γ(v, v), (n,) [N].

        Args:
            t: time [s].
            q: coordinates (n_q,).
            v: velocities (n,).
        """
        f = np.zeros_like(v) if self.force is None else np.asarray(self.force(t, q, v), dtype=float)
        if not callable(self.mass):
            return f

        # Slopes ∂M_IJ/∂q_K in [K, I, J] by central differences. Here v = q̇: a mass that is a
        # function of q goes with coordinates, not with quasi-velocities.
        h = self.difference(q)
        slopes = np.empty((len(q), len(v), len(v)))
        for K in range(len(q)):
            side = np.zeros_like(q)
            side[K] = h
            change = np.asarray(self.mass(q + side)) - np.asarray(self.mass(q - side))
            slopes[K] = change / (2.0 * h)

        # [Γ(v, v)]_I = Ṁ_IJ v_J - ½ ∂M_JK/∂q_I v_J v_K.
        rate = np.einsum("kij,k,j->i", slopes, v, v)
        gradient = np.einsum("ijk,j,k->i", slopes, v, v)
        return f - (rate - 0.5 * gradient)

    def difference(self, q: Array) -> float:
        """Return the way over which to take a central difference at q."""
        return DIFFERENCE_STEP * max(self.scale, float(np.max(np.abs(q))))

    def accelerations(self, t: float, q: Array, v: Array) -> tuple[Array, Array, float, float]:
        """Return (v̇ without layer (n,), M⁻¹Aᵀ (n,), g_11 [kg], ρ̈ without layer [m/s²]).

        Args:
            t: time [s].
            q: coordinates (n_q,).
            v: velocities (n,).
        """
        A = np.asarray(self.gradient(q), dtype=float)
        right_sides = np.column_stack([self.generalised_force(t, q, v), A])
        solutions = np.linalg.solve(self.matrix(q), right_sides)
        free = solutions[:, 0]
        along = solutions[:, 1]
        normal_mass = float(1.0 / (A @ along))
        return free, along, normal_mass, float(A @ free) + self.turning(q, v)


class Evaluations:
    """Count what an integration in time spends, so that no motion goes on for ever.

    Attributes:
        spent: number of evaluations of the acceleration.
        t: the time that the integration has come to [s].
    """

    def __init__(self) -> None:
        self.spent = 0
        self.t = 0.0

    def spend(self, t: float) -> None:
        """Count one evaluation; StepFailure, naming the time, when everything is spent."""
        self.spent = self.spent + 1
        self.t = t
        if self.spent > EVALUATIONS:
            raise StepFailure(
                f"the motion did not get beyond t = {t:.6g} s in {EVALUATIONS} evaluations of its "
                "acceleration: give a shorter time, a larger rtol, or forces that vary less"
            )


@contextmanager
def one_sentence() -> Iterator[None]:
    """Raise StepFailure for numbers that leave their range, or matrices that turn singular.

    These become singular on the way.
    """
    try:
        yield
    except (ArithmeticError, np.linalg.LinAlgError) as error:
        raise StepFailure(
            f"the motion could not be integrated, its numbers left their range ({error}): check "
            "forces, masses and the state at the start"
        ) from error


def check_tolerance(owner: str, rtol: float) -> None:
    """Raise InputError unless it is a relative tolerance, 0 < rtol < 1."""
    if number(owner, "rtol", rtol, positive=True) >= 1.0:
        raise InputError(f"{owner}: rtol is {rtol}; give a relative tolerance below 1")


def check_positive(owner: str, meaning: str, matrix: Any, unit: str) -> None:
    """Raise InputError unless the matrix is square, symmetric and positive definite.

    Args:
        owner: who asks, for messages.
        meaning: of the matrix, in words.
        matrix: to be checked.
        unit: of its entries, for messages.
    """
    M = array(owner, meaning, matrix, (None, None), unit=unit)
    if (
        M.shape[0] != M.shape[1]
        or not np.allclose(M, M.T)
        or np.min(np.linalg.eigvalsh(M), initial=np.inf) <= 0.0
    ):
        raise InputError(
            f"{owner}: {meaning} is not symmetric positive definite; check its entries"
        )
