"""Say what a material that yields is: elastic, with a stress that a yield function bounds.

    eps = C⁻¹ sigma + eps_p,    f(sigma, q) <= 0,    the plastic strain eps_p grows where f = 0

A material is asked at points (an axis of q points first) in Mandel's notation (``mandel``). What a
point remembers is a *state*: a dict of arrays with an axis of points first, which always holds
"sigma" (q, n) [Pa]. A state is never written to: ``stress`` makes the next one from it, so that a
step that is thrown away leaves nothing behind.

The stored energy W(state) [J/m³] counts hardening. What is neither stored nor elastic is
dissipated: D = sigma : Δeps_p less what hardening stores, with the stress at the end, D >= 0. An
increment of finite size has a remainder, which the energy ledger counts as algorithmic:

    sigma_end : Δeps = ΔW + D + R,    R = W(state_end - state_start) >= 0

where W is a quadratic form of the state, as it is for all laws of this package (``remainder``).

Source: Simo and Hughes, Computational Inelasticity (1998), chapters 2 and 3.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from math import sqrt
from typing import Annotated, Any

import numpy as np

from ..core.algebra import Array
from ..core.arguments import check_fields
from ..core.errors import InputError
from ..core.quantities import RATIO, Between, Positive, Unit
from .mandel import deviator, dot, elastic_matrix, norm, trace
from .materials import DampedBy, Density, LinearElastic

ROUND_OFF = 1e-13  # of the stress: f above it is a point that yields, below it rounding
PointState = Mapping[str, Array]
Modulus = Annotated[float, Positive, Unit("Pa"), "Young's modulus E"]
Poisson = Annotated[
    float,
    Between(-1.0, 0.5, "()", "give a number between -1 and 0.5, both excluded"),
    RATIO,
    "Poisson's ratio nu",
]


@dataclass(frozen=True)
class YieldingMaterial:
    """Hold the elastic part of a material that yields; laws derive from it.

    A law of your own gives ``stress``, ``f`` and ``dissipation``, and where it hardens ``start``
    and ``stored`` (docs/guide/extend.md).

    Attributes:
        E: Young's modulus [Pa].
        nu: Poisson's ratio.
        rho: mass density [kg/m³].
        xi: damping ratio at the frequency of ``DampingRatio``, the one law that reads it.
    """

    E: Modulus
    nu: Poisson
    rho: Density
    xi: DampedBy = field(default=0.0, kw_only=True)

    def __post_init__(self) -> None:
        check_fields(self)
        _ = self.elastic  # its limits hold here too

    @property
    def elastic(self) -> LinearElastic:
        """Return the material without yielding."""
        return LinearElastic(self.E, self.nu, self.rho, self.xi)

    @property
    def symmetric(self) -> bool:
        """Say whether the tangents of the law are symmetric, as those of flow along the normal."""
        return True

    @property
    def shear_modulus(self) -> float:
        """Return G = E / (2 (1 + nu)) [Pa]."""
        return self.E / (2.0 * (1.0 + self.nu))

    @property
    def bulk_modulus(self) -> float:
        """Return K = E / (3 (1 - 2 nu)) [Pa]."""
        return self.E / (3.0 * (1.0 - 2.0 * self.nu))

    def weaken(self, factor: float) -> "YieldingMaterial":
        """Return the material with its strength divided by a factor: itself where none yields.

        A law of your own says its own.

        Args:
            factor: F > 0.

        Raises:
            InputError: the law does not say it.
        """
        if type(self) is YieldingMaterial:
            return self
        raise InputError(
            f"{type(self).__name__} does not say what it is with another strength; give it a "
            "method weaken(factor), or take J2, DruckerPrager or MohrCoulomb"
        )

    def stiffness(self, n: int) -> Array:
        """Return C (n, n) [Pa] of n = 4 or 6 components."""
        return elastic_matrix(self.bulk_modulus, self.shear_modulus, n)

    def elastic_strain(self, sigma: Array) -> Array:
        """Return C⁻¹ sigma (…, n) of stresses (…, n) [Pa]."""
        strain = deviator(sigma) / (2.0 * self.shear_modulus)
        strain[..., :3] += (trace(sigma) / (9.0 * self.bulk_modulus))[..., None]
        return strain

    def plastic_increment(self, de: Array, old: PointState, new: PointState) -> Array:
        """Return Δeps_p = Δeps - C⁻¹ Δsigma (q, n)."""
        return de - self.elastic_strain(new["sigma"] - old["sigma"])

    def start(self, sigma: Array) -> dict[str, Array]:
        """Return the state of points that have never yielded, under a stress.

        Args:
            sigma: (q, n) [Pa], a copy of which is held.
        """
        return {"sigma": np.array(sigma, dtype=float)}

    def stress(
        self, de: Array, old: PointState, tangent: bool = True
    ) -> tuple[dict[str, Array], Array | None]:
        """Return the state after a strain increment, and the tangent dsigma/deps there.

        Args:
            de: strain increment (q, n).
            old: state before it, which is not written to.
            tangent: whether the tangent (q, n, n) [Pa] is asked for; else it is None.
        """
        C = self.stiffness(de.shape[-1])
        new = {**old, "sigma": old["sigma"] + de @ C}
        return new, np.broadcast_to(C, (len(de), *C.shape)) if tangent else None

    def f(self, state: PointState) -> Array:
        """Return the yield function (q,) [Pa], which is never above zero."""
        return np.full(len(state["sigma"]), -np.inf)

    def mobilised(self, state: PointState) -> Array:
        """Return the share of its strength that a point bears (q,), a number from 0 to 1.

        It is q/(q - f): the stress that f measures over its limit at the same mean stress. Here q
        is the equivalent stress; a law whose f measures another stress says its own. A point
        without any strength left, as one at the tip of a cone, has 1.

        Args:
            state: of the points.
        """
        return find_share(self.f(state), equivalent_stress(state["sigma"]))

    def stored(self, state: PointState) -> Array:
        """Return W (q,) [J/m³], ½ sigma : C⁻¹ sigma here."""
        sigma = state["sigma"]
        return 0.5 * dot(sigma, self.elastic_strain(sigma))

    def dissipation(self, de: Array, old: PointState, new: PointState) -> Array:
        """Return D (q,) [J/m³] of an increment, sigma : Δeps_p here.

        What is smaller than the rounding of sigma : Δeps is zero, as in steps that do not yield.

        Args:
            de: strain increment (q, n).
            old: state before it.
            new: state after it.
        """
        sigma = new["sigma"]
        lost = dot(sigma, self.plastic_increment(de, old, new))
        size = norm(sigma) * (norm(de) + norm(self.elastic_strain(old["sigma"])))
        return np.where(np.abs(lost) <= ROUND_OFF * size, 0.0, lost)

    def remainder(self, old: PointState, new: PointState) -> Array:
        """Return R (q,) [J/m³], what the stress at the end does beyond ΔW + D: W(new - old).

        A law whose W is no quadratic form of its state says its own.

        Args:
            old: state before an increment.
            new: state after it.
        """
        return self.stored({name: new[name] - old[name] for name in new})

    def residual(
        self, de: Array, old: PointState, new: PointState, sizes: tuple[float, float]
    ) -> Array:
        """Return how far an increment is from the equations of the law (q,), a pure number.

        Computed from the two states alone, and not by what ``stress`` computes with: laws add their
        flow rule to it. Here it is max(f, 0)/|sigma| and max(-D, 0)/(|sigma| |eps|).

        Args:
            de: strain increment (q, n).
            old: state before it.
            new: state after it.
            sizes: |sigma| [Pa] and |eps|, the largest of the body.
        """
        stress, strain = sizes
        beyond = np.maximum(self.f(new), 0.0) / stress
        gained = np.maximum(-self.dissipation(de, old, new), 0.0) / (stress * strain)
        return np.maximum(beyond, gained)


def equivalent_stress(sigma: Array) -> Array:
    """Return von Mises' √(3/2) |dev sigma| (…,) [Pa] of stresses (…, n) [Pa]."""
    return sqrt(1.5) * norm(deviator(sigma))


def find_share(f: Array, size: Array) -> Array:
    """Return size/(size - f) (q,), the share of a limit: 1 where there is no limit left.

    Args:
        f: yield function (q,) [Pa], size less the limit.
        size: of the stress that f measures (q,) [Pa].
    """
    limit = size - f
    share = np.divide(size, limit, out=np.ones_like(size), where=limit > 0.0)
    return np.minimum(share, 1.0)


def choose_flow(candidates: list[Array]) -> Array:
    """Return the least residual (q,) of the ways in which points may have flowed.

    Each way is judged by all of its conditions, so that one small residual proves the flow.

    Args:
        candidates: residuals (q,) of the ways.
    """
    least: Array = np.minimum.reduce(candidates)
    return least


def judge_multiplier(gamma: Array, f: Array, sizes: tuple[float, float]) -> Array:
    """Return the residual (q,) of gamma >= 0 and gamma f = 0.

    Args:
        gamma: multiplier (q,), a strain.
        f: yield function (q,) [Pa].
        sizes: |sigma| [Pa] and |eps|.
    """
    stress, strain = sizes
    negative = np.maximum(-gamma, 0.0) / strain
    return np.maximum(negative, np.abs(gamma * f) / (stress * strain))


def largest_of(*residuals: Any) -> Array:
    """Return the largest of several residuals at each point."""
    largest: Array = np.maximum.reduce(np.broadcast_arrays(*residuals))
    return largest
