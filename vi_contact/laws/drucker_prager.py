"""Yield by friction and cohesion on a smooth cone: Drucker and Prager's law, for soil and concrete.

    f = √J2 + eta p - strength,    p = tr(sigma)/3,    √J2 = |dev sigma|/√2
    Δeps_p = gamma (n/√2 + etab/3 1),    n = dev sigma/|dev sigma|

The cone ends at a tip, p = strength/eta, which no mean tension exceeds: the tip is a cut-off too,
with a flow of any dilatancy, so that a material with psi = 0 has an answer in tension.

The cone stands for Mohr and Coulomb's (c, phi, psi). ``fit`` says how:

- "plane strain": the same load at collapse in plane strain, for any psi <= phi:
  eta = a sin phi/b, strength = a c cos phi/b, etab = sin psi/a, a = √(1 + sin²psi/3),
  b = 1 + sin phi sin psi/3. It follows from eps_p,zz = 0 at collapse.
- "compression", "extension": through these edges of the pyramid, eta = 6 sin phi/(√3 (3 ∓ sin phi))
  and so on. In plane strain the compression cone carries 2.2 times the load at 30°.

Sources: Drucker and Prager, Q. Appl. Math. 10 (1952) 157-165; de Souza Neto, Perić and Owen,
Computational Methods for Plasticity (2008), chapter 8.
"""

from dataclasses import dataclass, replace
from math import atan, cos, degrees, radians, sin, sqrt, tan
from typing import Annotated, Any

import numpy as np

from ..core.algebra import Array
from ..core.checks import check_word
from ..core.errors import InputError
from ..core.quantities import Between, NotNegative, Unit
from .mandel import ROOT, deviator, deviator_matrix, identity, norm, over, trace
from .yielding import (
    ROUND_OFF,
    PointState,
    YieldingMaterial,
    choose_flow,
    find_share,
    judge_multiplier,
    largest_of,
)

FITS = ("plane strain", "compression", "extension")
Cohesion = Annotated[float, NotNegative, Unit("Pa"), "the cohesion"]
BELOW_NINETY = Between(0.0, 90.0, "[)", "give degrees from 0 to less than 90")
DEGREES = Unit("deg")
SMALLEST = 1.0  # [degrees] below it a positive angle is probably in radians


def check_strength(owner: str, cohesion: float, phi: float, psi: float) -> None:
    """Raise InputError for angles and a cohesion that are no strength of soil.

    Args:
        owner: the law, the first word of the sentence.
        cohesion: c [Pa].
        phi: angle of friction [degrees].
        psi: angle of dilatancy [degrees].
    """
    if phi == 0.0 and cohesion == 0.0:
        raise InputError(
            f"{owner}: phi and cohesion are both zero, so the material carries no shear; give one "
            "of them"
        )
    if psi > phi:
        raise InputError(
            f"{owner}: psi = {psi:g} degrees is more than phi = {phi:g} degrees, so that flow "
            "would create energy; give psi from 0 to phi"
        )
    for name, angle in (("phi", phi), ("psi", psi)):
        if 0.0 < angle < SMALLEST:
            raise InputError(
                f"{owner}: {name} is {angle:g} degrees; angles are in degrees and not in radians: "
                f"give 0, or at least {SMALLEST:g}"
            )


def divide_strength(
    cohesion: float, phi: float, psi: float, factor: float
) -> tuple[float, float, float]:
    """Return c/F [Pa], atan(tan(phi)/F) and the smaller of psi and that [degrees].

    Args:
        cohesion: c [Pa].
        phi: angle of friction [degrees].
        psi: angle of dilatancy [degrees].
        factor: F > 0.
    """
    less = degrees(atan(tan(radians(phi)) / factor))
    return cohesion / factor, less, min(psi, less)


@dataclass(frozen=True)
class DruckerPrager(YieldingMaterial):
    """Describe a material that yields by the law of the module.

    Attributes:
        cohesion: c [Pa].
        phi: angle of friction [degrees].
        psi: angle of dilatancy [degrees], at most phi.
        fit: "plane strain", "compression" or "extension".
    """

    cohesion: Cohesion
    phi: Annotated[float, BELOW_NINETY, DEGREES, "the angle of friction phi"]
    psi: Annotated[float, BELOW_NINETY, DEGREES, "the angle of dilatancy psi"]
    fit: str = "plane strain"

    def __post_init__(self) -> None:
        super().__post_init__()
        check_word("DruckerPrager: fit", self.fit, FITS)
        check_strength("DruckerPrager", self.cohesion, self.phi, self.psi)

    @property
    def cone(self) -> tuple[float, float, float]:
        """Return eta, strength [Pa] and etab."""
        s = sin(radians(self.phi))
        c = self.cohesion * cos(radians(self.phi))
        t = sin(radians(self.psi))
        if self.fit == "plane strain":
            a = sqrt(1.0 + t * t / 3.0)
            b = 1.0 + s * t / 3.0
            return a * s / b, a * c / b, t / a
        sign = -1.0 if self.fit == "compression" else 1.0
        of_phi = 6.0 / (sqrt(3.0) * (3.0 + sign * s))
        of_psi = 6.0 / (sqrt(3.0) * (3.0 + sign * t))
        return of_phi * s, of_phi * c, of_psi * t

    @property
    def symmetric(self) -> bool:
        """Say whether tangents are symmetric: psi is phi."""
        return self.psi == self.phi

    def weaken(self, factor: float) -> "DruckerPrager":
        """Return the material with c and tan phi over a factor, and psi at most that phi."""
        c, phi, psi = divide_strength(self.cohesion, self.phi, self.psi, factor)
        return replace(self, cohesion=c, phi=phi, psi=psi)

    def start(self, sigma: Array) -> dict[str, Array]:
        """Return the state of points that have never yielded; alpha is the plastic strain."""
        return {**super().start(sigma), "alpha": np.zeros(len(sigma))}

    def f(self, state: PointState) -> Array:
        """Return the yield function (q,) [Pa]."""
        eta, strength, _ = self.cone
        sigma = state["sigma"]
        return norm(deviator(sigma)) / ROOT + eta * trace(sigma) / 3.0 - strength

    def mobilised(self, state: PointState) -> Array:
        """Return √J2 over its limit at the same mean stress (q,)."""
        return find_share(self.f(state), norm(deviator(state["sigma"])) / ROOT)

    def stress(
        self, de: Array, old: PointState, tangent: bool = True
    ) -> tuple[dict[str, Array], Array | None]:
        """Return the state after a strain increment and its tangent: to the cone, or its tip."""
        n = de.shape[-1]
        G = self.shear_modulus
        K = self.bulk_modulus
        eta, strength, etab = self.cone
        C = self.stiffness(n)
        unit = identity(n)
        trial = old["sigma"] + de @ C
        p = trace(trial) / 3.0
        s = deviator(trial)
        size = norm(s)
        root = size / ROOT

        # To the cone, along a direction that the return does not turn.
        beyond = root + eta * p - strength
        rounding = ROUND_OFF * (root + np.abs(p) + strength)
        A = 1.0 / (G + K * eta * etab)
        gamma = np.where(beyond > rounding, A * beyond, 0.0)
        on = gamma > 0.0
        normal = over(s, size)
        sigma: Array = trial - gamma[:, None] * (ROOT * G * normal + K * etab * unit)

        # Beyond the tip, where the cone would take more than all of the deviator.
        tip = on & (root < G * gamma)
        if tip.any():
            sigma[tip] = strength / eta * unit
        flow = de - self.elastic_strain(sigma - old["sigma"])
        grown = np.where(on, np.sqrt(2.0 / 3.0) * norm(flow), 0.0)
        new = {"sigma": sigma, "alpha": old["alpha"] + grown}
        if not tangent:
            return new, None

        D = np.broadcast_to(C, (len(de), n, n)).copy()
        cone = on & ~tip
        theta = (G * gamma[cone] / root[cone])[:, None, None]
        N = normal[cone]
        NN = N[:, :, None] * N[:, None, :]
        N1 = N[:, :, None] * unit
        oneN = unit[:, None] * N[:, None, :]
        D[cone] -= 2.0 * G * (theta * (deviator_matrix(n) - NN) + G * A * NN)
        D[cone] -= ROOT * G * K * A * (eta * N1 + etab * oneN)
        D[cone] -= K * K * eta * etab * A * np.outer(unit, unit)
        D[tip] = 0.0
        return new, D

    def residual(
        self, de: Array, old: PointState, new: PointState, sizes: tuple[float, float]
    ) -> Array:
        """Return how far an increment is from the equations of the module (q,)."""
        stress, strain = sizes
        eta, strength, etab = self.cone
        sigma = new["sigma"]
        flow = self.plastic_increment(de, old, new)
        f = self.f(new)
        s = deviator(sigma)
        unit = identity(sigma.shape[-1])

        # On the cone the flow is gamma (n/√2 + etab/3 1).
        normal = over(s, norm(s))
        gamma = ROOT * np.sum(flow * normal, axis=-1)
        way = normal / ROOT + etab / 3.0 * unit
        cone = largest_of(
            norm(flow - gamma[:, None] * way) / strain, judge_multiplier(gamma, f, sizes)
        )
        still = norm(flow) / strain
        candidates: list[Any] = [still, cone]

        # At the tip it is in the cone of all these ways and of 1.
        if eta > 0.0:
            missing = np.maximum(etab * ROOT * norm(deviator(flow)) - trace(flow), 0.0)
            off = norm(sigma - strength / eta * unit)
            candidates.append(largest_of(missing / strain, off / stress))
        return largest_of(np.maximum(f, 0.0) / stress, choose_flow(candidates))
