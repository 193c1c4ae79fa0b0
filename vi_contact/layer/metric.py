"""Compute metric and affinities of a configuration manifold near its boundary.

See b-geometry, ENOC 2017, 8 to 21.

With the covector A = d rho in the coordinates of the velocities and M = [g_IJ]:

    g_11 = 1/(A M⁻¹ Aᵀ)  (12, 13),    ĝ_11 = g_11 (b/rho)²  (9, 10),    ĝ_IJ = A_I A_J ĝ_11  (14)
    B^J = g_11 (M⁻¹Aᵀ)^J  (20),       Λ̂^1_11 = -1/rho,    Λ̂^K_IJ = B^K A_I A_J Λ̂^1_11  (21)

ĝ and Λ̂ are added to the metric and to the affinities of the manifold without boundary. Λ̂^1_11 is
the Levi-Civita affinity of ĝ_11 with g_11 constant, so that the covariant derivative of the normal
momentum is ĝ_11 (ρ̈ - ρ̇²/ρ).

What a point on its way through the layer is subject to can be read in two ways, and finite elements
need two more; ``Metric`` says which. All of them move M q̈ + ... = f + Aᵀ lambda, and momenta along
the boundary are unchanged.
"""

from enum import Enum

from ..core.checks import quote
from ..core.errors import InputError
from .layer import Layer


class Metric(Enum):
    """Name the terms of the normal equation act in the layer.

    There n = g_11 times the normal acceleration without layer.

    DOMINANT: ĝ_11 (ρ̈ - ρ̇²/ρ) = f̂_1 + n. The terms of order (b/rho)² alone, as (26) says and
        (35), (36) and Figs. 1 to 3 use; the default. The restitution depends on c/(a k) only.
    FULL: g_11 ρ̈ + ĝ_11 (ρ̈ - ρ̇²/ρ) = f̂_1 + n. The complete metric of (8) and (15). The velocity,
        not the momentum, is continuous where the layer begins.
    BLENDED: g_11 ρ̈ + delta ĝ_11 (ρ̈ - ρ̇²/ρ) = f̂_1 + n. The same with the metric's terms cut off
        like the force, so that the reaction is a smooth function of state; FULL in the limit a ->
        b.
    FLAT: g_11 ρ̈ = f̂_1 + n. The boundary force alone; what is left when the law is a potential and
    a damper.
    """

    DOMINANT = "dominant"
    FULL = "full"
    BLENDED = "blended"
    FLAT = "flat"

    @classmethod
    def _missing_(cls, value: object) -> "Metric":
        """Raise InputError for a value that names no metric."""
        known = ", ".join(repr(metric.value) for metric in cls)
        raise InputError(f"Metric: value is {quote(value)}; give one of {known}")

    def reaction(self, layer: Layer, g: float, rho: float, rate: float, free: float) -> float:
        """Return lambda [N] of g ρ̈ = g ``free`` + lambda, positive away from the obstacle.

        Args:
            layer: the law, whose speed V is known.
            g: g_11 [kg], the mass along the normal.
            rho: distance [m], positive.
            rate: ρ̇ [m/s], negative on the way in.
            free: the acceleration ρ̈ [m/s²] without the layer.
        """
        force = float(layer.force(rho, rate))
        ratio = (layer.width / rho) ** 2
        if self is Metric.DOMINANT:
            return g * (rate**2 / rho + force / (g * ratio) + free / ratio - free)
        ratio *= {Metric.FULL: 1.0, Metric.FLAT: 0.0}.get(self, float(layer.cut_off(rho)))
        return (force - g * ratio * (free - rate**2 / rho)) / (1.0 + ratio)
