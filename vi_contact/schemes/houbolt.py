"""Step by Houbolt's method: rates at the end are those of the cubic through four displacements.

    dt v1  = 11/6 u1 - 3 u0 + 3/2 u(-1) - 1/3 u(-2)
    dt² a1 = 2 u1 - 5 u0 + 4 u(-1) - u(-2)
    M a1 + C v1 + K u1 = f1 - B_nᵀ r_n1 - B_tᵀ r_t1
    0 <= r_n1  ⊥  gap0 - B_n u1 >= 0,    |r_t1| <= limit(r_n1) along B_t (u1 - u0)

The member a = (11/6, -3, 3/2, -1/3), b = (1, 0, 0, 0), gamma = (2, -5, 4, -1), mu = 1 of eqs. 11a,b
of the boundary method: see linear_multistep for A, start and restart. Order 2, unconditionally
stable. What is much faster than dt dies out in a few steps; slow vibrations lose 6 % a period at 20
steps a period, 0.6 % at 50 (as with rho_inf = 0).

Energy: the ledger closes with the means of both ends; the damping is its algorithmic part. Contact
stands in the balance of forces, but what it creates at high frequencies is damped away at once:
docs/guide/schemes.md has numbers. Impulses: those over a contact with free flight before and after
are the change of momentum; in single steps not. Source: Houbolt, J. Aeronaut. Sci. 17 (1950)
540-550; as a member of eqs. 11a,b: docs/reference/sources.md [1].
"""

from dataclasses import dataclass, field

from .linear_multistep import LinearMultistep


@dataclass(frozen=True)
class Houbolt(LinearMultistep):
    """Step by the module's equations."""

    a: tuple[float, ...] = field(default=(11 / 6, -3.0, 3 / 2, -1 / 3), init=False, repr=False)
    b: tuple[float, ...] = field(default=(1.0, 0.0, 0.0, 0.0), init=False, repr=False)
    gamma: tuple[float, ...] = field(default=(2.0, -5.0, 4.0, -1.0), init=False, repr=False)
    mu: float = field(default=1.0, init=False, repr=False)
