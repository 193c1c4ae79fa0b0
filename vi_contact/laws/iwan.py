"""Yield little by little, as soil does under cyclic shear: Iwan's elements in parallel.

    sigma = p 1 + sum_k s_k,    p = K tr(eps),    |s_k| <= √2 G_k gamma_k,    Δs_k = 2 G_k Δe - ...

Each element is elastic with the modulus G_k and yields at the shear strain gamma_k, without
hardening. In monotonic shear the stress is the polygon through the table tau(gamma) = G gamma;
unloading and reloading follow Masing's rules by themselves, and the loops have the damping

    D = 2/pi (2 ∫ tau dgamma/(tau(a) a) - 1)    at the amplitude a.

The moduli are those of the place: they do not depend on the pressure, which would make energy.
Sources: Iwan, J. Appl. Mech. 34 (1967) 612-617; Masing, Proc. 2nd Int. Congr. Appl. Mech. (1926).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, Any

import numpy as np

from ..core.algebra import Array
from ..core.errors import InputError
from ..core.quantities import RATIO, Remedy
from .mandel import ROOT, deviator, deviator_matrix, dot, identity, norm, over, trace
from .yielding import PointState, YieldingMaterial, largest_of

FALLING = 1e-12  # of the first slope: by so much slopes may rise by rounding


@dataclass(frozen=True)
class Iwan(YieldingMaterial):
    """Describe a material by the law of the module. E and nu give the modulus at small strains.

    Attributes:
        curve: pairs (gamma, G/Gmax) of the engineering shear strain and the secant modulus there,
            with strains that increase. The polygon begins with the slope of the first pair, which
            should be near 1; beyond the last the stress stays.
    """

    curve: Annotated[
        Sequence[tuple[float, float]], Remedy("give pairs (shear strain, G/Gmax)"), RATIO
    ]

    def __post_init__(self) -> None:
        super().__post_init__()
        table = np.array(self.curve, dtype=float)
        if table.ndim != 2 or table.shape[1] != 2 or not np.all(np.isfinite(table)):
            raise InputError(
                f"Iwan: curve has the shape {table.shape}; give pairs (shear strain, G/Gmax)"
            )
        gamma, ratio = table.T
        if not (gamma[0] > 0.0 and np.all(np.diff(gamma) > 0.0)):
            raise InputError(
                "Iwan: the shear strains of curve do not increase from above zero; sort the table, "
                "and leave the strain zero out"
            )
        if not (np.all(ratio > 0.0) and ratio[0] <= 1.0 and np.all(np.diff(ratio) <= 0.0)):
            raise InputError(
                "Iwan: G/Gmax of curve rises, or is not between 0 and 1; give ratios that fall "
                "from at most 1"
            )
        slopes = self._find_slopes()
        rising = np.flatnonzero(np.diff(slopes) > FALLING * slopes[0])
        if len(rising):
            at = 0.0 if rising[0] == 0 else gamma[rising[0] - 1]
            raise InputError(
                f"Iwan: the stress G gamma of curve bends upwards, or falls, beyond gamma = "
                f"{at:g}; leave out what is beyond, or give a table whose stress rises ever more "
                "slowly"
            )

    def _find_slopes(self) -> Array:
        """Return the slopes [Pa] of the polygon (0, tau_1, …, tau_last, constant)."""
        gamma, ratio = np.array(self.curve, dtype=float).T
        places = np.concatenate([[0.0], gamma])
        tau = np.concatenate([[0.0], self.shear_modulus * ratio * gamma])
        slopes = np.diff(tau) / np.diff(places)
        return np.concatenate([slopes, [0.0]])

    @property
    def elements(self) -> tuple[Array, Array]:
        """Return G_k [Pa] and gamma_k of the elements, (k,) each."""
        gamma = np.array(self.curve, dtype=float)[:, 0]
        moduli = -np.diff(self._find_slopes())
        kept = moduli > FALLING * np.sum(np.abs(moduli))
        return moduli[kept], gamma[kept]

    def stiffness(self, n: int) -> Array:
        """Return C (n, n) [Pa] at small strains: the shear modulus is the sum of all G_k."""
        unit = identity(n)
        shear = np.sum(self.elements[0])
        return self.bulk_modulus * np.outer(unit, unit) + 2.0 * shear * deviator_matrix(n)

    def start(self, sigma: Array) -> dict[str, Array]:
        """Return the state of virgin elements: the deviator at the start is at rest, and none's.

        Args:
            sigma: stress in place (q, n) [Pa].
        """
        state = super().start(sigma)
        moduli, _ = self.elements
        q, n = state["sigma"].shape
        return {**state, "parts": np.zeros((q, len(moduli), n)), "lift": np.zeros(q)}

    def _rest(self, state: PointState) -> Array:
        """Return the deviator (q, n) [Pa] that no element carries."""
        rest: Array = deviator(state["sigma"]) - state["parts"].sum(axis=1)
        return rest

    def f(self, state: PointState) -> Array:
        """Return the yield function (q,) [Pa] of the element that is next to its limit."""
        moduli, strains = self.elements
        beyond: Array = norm(state["parts"]) / ROOT - moduli * strains
        return beyond.max(axis=1)

    def mobilised(self, state: PointState) -> Array:
        """Return the stress of all elements over the largest they bear together (q,)."""
        moduli, strains = self.elements
        return norm(state["parts"].sum(axis=1)) / (ROOT * float(moduli @ strains))

    def stored(self, state: PointState) -> Array:
        """Return W (q,) [J/m³] of pressure, elements, and the work of the stress at rest."""
        moduli, _ = self.elements
        p = trace(state["sigma"]) / 3.0
        parts = dot(state["parts"], state["parts"]) / (4.0 * moduli)
        return p * p / (2.0 * self.bulk_modulus) + parts.sum(axis=1) + state["lift"]

    def remainder(self, old: PointState, new: PointState) -> Array:
        """Return R (q,) [J/m³]; the work of the stress at rest is linear, and has none.

        Args:
            old: state before an increment.
            new: state after it.
        """
        change = {name: new[name] - old[name] for name in new}
        return self.stored({**change, "lift": np.zeros_like(change["lift"])})

    def _flow(self, de: Array, old: PointState, new: PointState) -> Array:
        """Return the plastic strains (q, k, n) of the elements."""
        moduli, _ = self.elements
        change = new["parts"] - old["parts"]
        return deviator(de)[:, None, :] - change / (2.0 * moduli)[:, None]

    def dissipation(self, de: Array, old: PointState, new: PointState) -> Array:
        """Return D (q,) [J/m³] of all elements that have slipped.

        Args:
            de: strain increment (q, n).
            old: state before it.
            new: state after it.
        """
        moduli, strains = self.elements
        lost = dot(new["parts"], self._flow(de, old, new))
        slipped = norm(new["parts"]) >= ROOT * moduli * strains * (1.0 - FALLING)
        sliding: Array = np.where(slipped, np.maximum(lost, 0.0), 0.0)
        return sliding.sum(axis=1)

    def stress(
        self, de: Array, old: PointState, tangent: bool = True
    ) -> tuple[dict[str, Array], Array | None]:
        """Return the state after a strain increment and its tangent: radial return of each."""
        n = de.shape[-1]
        moduli, strains = self.elements
        unit = identity(n)
        e = deviator(de)

        # Every element by itself: back to its radius where it is beyond.
        parts = old["parts"] + (2.0 * moduli)[:, None] * e[:, None, :]
        radius = norm(parts)
        limit = ROOT * moduli * strains
        share = np.minimum(1.0, limit / np.where(radius > 0.0, radius, limit))
        normal = over(parts, radius)
        parts = parts * share[:, :, None]
        change = (parts - old["parts"]).sum(axis=1)
        sigma = old["sigma"] + change + (self.bulk_modulus * trace(de))[:, None] * unit
        lift = old["lift"] + dot(self._rest(old), e)
        new = {"sigma": sigma, "parts": parts, "lift": lift}
        if not tangent:
            return new, None

        # 2 G_k a (P - n n) where it slips, 2 G_k P where it sticks
        weights = 2.0 * moduli * share
        slips = np.where(share < 1.0, weights, 0.0)
        D = weights.sum(axis=1)[:, None, None] * deviator_matrix(n)
        D = D - np.einsum("qk,qki,qkj->qij", slips, normal, normal, optimize=True)
        return new, D + self.bulk_modulus * np.outer(unit, unit)

    def residual(
        self, de: Array, old: PointState, new: PointState, sizes: tuple[float, float]
    ) -> Array:
        """Return how far an increment is from the equations of the module (q,)."""
        stress, strain = sizes
        moduli, strains = self.elements
        flow = self._flow(de, old, new)
        normal = over(new["parts"], norm(new["parts"]))
        gamma = dot(flow, normal)
        f = norm(new["parts"]) / ROOT - moduli * strains

        # Each element: flow along its stress, only at its limit, and forwards.
        along = norm(flow - gamma[:, :, None] * normal)
        slips: Any = np.maximum(along, np.maximum(-gamma, 0.0)) / strain
        slips = np.maximum(slips, np.abs(gamma * f) / (stress * strain))
        judged = np.minimum(norm(flow) / strain, slips).max(axis=1)

        # Their sum, and the pressure.
        total = new["sigma"] - old["sigma"] - (new["parts"] - old["parts"]).sum(axis=1)
        pressure = (self.bulk_modulus * trace(de))[:, None] * identity(de.shape[-1])
        return largest_of(
            np.maximum(f.max(axis=1), 0.0) / stress, judged, norm(total - pressure) / stress
        )
