"""Evaluate radial functions of the fundamental solution of plane strain in the Laplace domain,
density 1.

With (Δ - s²/c_a²) Phi_a = -delta, that is Phi_a = K0(s r/c_a) / (2 pi), a = P, S,

    G(x - y) = 1/s² [(s/c_S)² Phi_S I - grad grad (Phi_S - Phi_P)] = g1 I - g2 r̂ r̂ᵀ
    r̂ = (x - y)/r.

Convolution quadrature is built on them; the kernels of the time domain (bem.TimeKernels) are tested
against them.
"""

from dataclasses import dataclass
from numbers import Number

import numpy as np
from numpy.typing import NDArray
from scipy.special import kv

from vi_contact.bem.fundamental_solution import TWO_PI, KernelSet, check_speeds
from vi_contact.core.algebra import Array
from vi_contact.core.checks import quote
from vi_contact.core.errors import InputError

EULER = float(np.euler_gamma)
SMALL = 0.7  # below this the Bessel function minus its pole is summed as a power series


@dataclass(frozen=True)
class LaplaceKernels:
    """Evaluate kernels at one complex frequency s [1/s], Re s > 0; call with distances r [m] >
    0."""

    s: complex
    c_p: float
    c_s: float

    def __post_init__(self) -> None:
        check_speeds(self)
        if (
            isinstance(self.s, bool)
            or not isinstance(self.s, Number)
            or not np.isfinite(complex(self.s))
            or (not complex(self.s).real > 0.0)
        ):
            raise InputError(
                f"LaplaceKernels: the frequency s is {quote(self.s)}; give a complex number with a "
                "positive real part [1/s]"
            )

    def __call__(self, r: Array) -> KernelSet:
        """Evaluate the seven functions that all three operators share."""
        s, ratio2 = self.s, (self.c_s / self.c_p) ** 2
        z_s, z_p = s * r / self.c_s, s * r / self.c_p
        k0_s, k0_p, kappa_s, kappa_p = kv(0, z_s), kv(0, z_p), kappa(z_s), kappa(z_p)
        scale = TWO_PI * self.c_s**2
        g1 = (k0_s + kappa_s - ratio2 * kappa_p) / scale
        g2 = (k0_s + 2.0 * kappa_s - ratio2 * (k0_p + 2.0 * kappa_p)) / scale
        phi = k0_s / TWO_PI
        dphi = -((s / self.c_s) ** 2 * kappa_s + 1.0 / r**2) / TWO_PI
        ddiff = ((s / self.c_s) ** 2 * kappa_s - (s / self.c_p) ** 2 * kappa_p) / TWO_PI
        double = phi, dphi, ddiff, g1, g2
        return KernelSet((g1, g2), double, (*double, s**2 * k0_p / TWO_PI, s**2 * phi))


def kappa(z: NDArray) -> NDArray:
    """Return K1(z)/z - 1/z², what of K1(z)/z stays logarithmic at z = 0; by its power series where
    |z| < 0.7."""
    z = np.asarray(z, complex)
    small = np.abs(z) < SMALL
    safe = np.where(small, 1.0, z)
    values = kv(1, safe) / safe - 1.0 / safe**2
    if small.any():
        values[small] = _kappa_series(z[small])
    return values


def _kappa_series(z: NDArray) -> NDArray:
    logarithm = 0.5 * (np.log(0.5 * z) + EULER)
    total, term, harmonic = np.zeros_like(z), np.ones_like(z), 0.0
    for k in range(10):
        total += term * (logarithm - 0.25 * (2.0 * harmonic + 1.0 / (k + 1)))
        harmonic += 1.0 / (k + 1)
        term *= 0.25 * z**2 / ((k + 1) * (k + 2))
    return total
