"""Step by the implicit midpoint rule, with the contact condition at the end of the step.

    u1 - u0 = ½ dt (v0 + v1)
    M (v1 - v0)/dt + ½ C (v0 + v1) + ½ K (u0 + u1) = f(t0 + ½ dt) - B_nᵀ r̄_n - B_tᵀ r̄_t
    0 <= r̄_n  ⊥  gap0 - B_n u1 >= 0,    |r̄_t| <= limit(r̄_n) along B_t (u1 - u0)

In x = u1:  A = 4/dt² M + 2/dt C + K,  scale = 2. It is ZienkiewiczWoodTaylor(½), SS22(½, ½) and the
rule of Kane, Repetto, Ortiz and Marsden with implicit contact, identical to round-off (table 1.7).

Order 2, unconditionally stable, no damping of any frequency. Energy: it changes by work of loads,
damping and friction, and a closure loses r̄_n times the gap that was closed: contact never creates
energy. Contact forces ring, since contact nodes need their mass here. Impulses: dt r̄_n is the
change of momentum in every step. Source: Kane, Repetto, Ortiz and Marsden, Comput. Methods Appl.
Mech. Eng. 180 (1999) 1-26.
"""

from dataclasses import dataclass, field

from .zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor


@dataclass(frozen=True)
class Midpoint(ZienkiewiczWoodTaylor):
    """Step by the module's equations."""

    phi: float = field(default=0.5, init=False, repr=False)
