"""Yield at a largest distortion energy: von Mises' law with linear hardening, for metal and clay.

    f = √(3/2) |s - beta| - (yield_stress + isotropic alpha),    s = dev sigma
    Δeps_p = √(3/2) Δalpha n,    n = (s - beta)/|s - beta|,    Δbeta = 2/3 kinematic Δeps_p
    W = ½ sigma : C⁻¹ sigma + ½ isotropic alpha² + 3/4 |beta|²/kinematic,    D = yield_stress Δalpha

Undrained clay of the shear strength c_u has yield_stress = √3 c_u in plane strain. The return to
the surface is one linear equation (Simo and Hughes, Computational Inelasticity (1998), box 3.2).
"""

from dataclasses import dataclass, replace
from math import inf
from typing import Annotated

import numpy as np

from ..core.algebra import Array
from ..core.quantities import Between, Positive, Unit
from .mandel import deviator, deviator_matrix, dot, norm, over
from .yielding import (
    ROUND_OFF,
    PointState,
    YieldingMaterial,
    choose_flow,
    equivalent_stress,
    find_share,
    judge_multiplier,
    largest_of,
)

HARDENS = "give zero or a positive modulus, as answers of softening depend on the mesh"
Hardening = Annotated[float, Between(0.0, inf, remedy=HARDENS), Unit("Pa")]
RADIUS = float(np.sqrt(1.5))


@dataclass(frozen=True)
class J2(YieldingMaterial):
    """Describe a material that yields by the law of the module.

    Attributes:
        yield_stress: in a uniaxial test [Pa].
        isotropic: modulus of isotropic hardening [Pa], by which the surface grows.
        kinematic: modulus of kinematic hardening [Pa], by which it moves (Prager's rule).
    """

    yield_stress: Annotated[float, Positive, Unit("Pa"), "the yield stress"]
    isotropic: Hardening = 0.0
    kinematic: Hardening = 0.0

    def weaken(self, factor: float) -> "J2":
        """Return the material with the yield stress over a factor."""
        return replace(self, yield_stress=self.yield_stress / factor)

    def start(self, sigma: Array) -> dict[str, Array]:
        """Return the state of points that have never yielded: no hardening."""
        state = super().start(sigma)
        return {**state, "beta": np.zeros_like(state["sigma"]), "alpha": np.zeros(len(sigma))}

    def f(self, state: PointState) -> Array:
        """Return the yield function (q,) [Pa]."""
        size = RADIUS * norm(deviator(state["sigma"]) - state["beta"])
        return size - self.yield_stress - self.isotropic * state["alpha"]

    def mobilised(self, state: PointState) -> Array:
        """Return √(3/2) |s - beta| over its limit (q,)."""
        return find_share(self.f(state), equivalent_stress(state["sigma"] - state["beta"]))

    def stored(self, state: PointState) -> Array:
        """Return W (q,) [J/m³] with both hardenings."""
        energy = super().stored(state) + 0.5 * self.isotropic * state["alpha"] ** 2
        if self.kinematic:
            energy = energy + 0.75 / self.kinematic * dot(state["beta"], state["beta"])
        return energy

    def dissipation(self, de: Array, old: PointState, new: PointState) -> Array:
        """Return D (q,) [J/m³], the yield stress times what alpha has grown."""
        return self.yield_stress * (new["alpha"] - old["alpha"])

    def stress(
        self, de: Array, old: PointState, tangent: bool = True
    ) -> tuple[dict[str, Array], Array | None]:
        """Return the state after a strain increment and its tangent, by radial return."""
        n = de.shape[-1]
        G = self.shear_modulus
        C = self.stiffness(n)
        trial = old["sigma"] + de @ C

        # The elastic trial, and how far it is beyond the surface.
        shifted = deviator(trial) - old["beta"]
        radius = norm(shifted)
        size = RADIUS * radius
        limit = self.yield_stress + self.isotropic * old["alpha"]
        beyond = size - limit
        resistance = 3.0 * G + self.isotropic + self.kinematic
        gamma = np.where(beyond > ROUND_OFF * limit, beyond / resistance, 0.0)

        # Back along the normal, which the return does not turn.
        normal = over(shifted, radius)
        flow = (RADIUS * gamma)[:, None] * normal
        new = {
            "sigma": trial - 2.0 * G * flow,
            "beta": old["beta"] + 2.0 / 3.0 * self.kinematic * flow,
            "alpha": old["alpha"] + gamma,
        }
        if not tangent:
            return new, None

        # C - 2G (theta P + (3G/resistance - theta) n n), theta = 3G gamma/size
        D = np.broadcast_to(C, (len(de), n, n)).copy()
        on = gamma > 0.0
        theta = (3.0 * G * gamma[on] / size[on])[:, None, None]
        along = normal[on, :, None] * normal[on, None, :]
        D[on] -= 2.0 * G * (theta * deviator_matrix(n) + (3.0 * G / resistance - theta) * along)
        return new, D

    def residual(
        self, de: Array, old: PointState, new: PointState, sizes: tuple[float, float]
    ) -> Array:
        """Return how far an increment is from the equations of the module (q,)."""
        stress, strain = sizes
        flow = self.plastic_increment(de, old, new)
        shifted = deviator(new["sigma"]) - new["beta"]
        normal = over(shifted, norm(shifted))
        f = self.f(new)
        gamma = dot(flow, normal) / RADIUS
        plastic = largest_of(
            norm(flow - (RADIUS * gamma)[:, None] * normal) / strain,
            judge_multiplier(gamma, f, sizes),
        )
        still = norm(flow) / strain
        hardening = largest_of(
            np.abs(new["alpha"] - old["alpha"] - norm(flow) / RADIUS) / strain,
            norm(new["beta"] - old["beta"] - 2.0 / 3.0 * self.kinematic * flow) / stress,
        )
        return largest_of(np.maximum(f, 0.0) / stress, choose_flow([still, plastic]), hardening)
