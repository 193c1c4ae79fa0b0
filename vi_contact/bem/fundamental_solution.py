"""Evaluate the radial functions of the fundamental solution of plane-strain elastodynamics.

They are functions of time, of density 1.

With (Δ - s²/c_a²) Phi_a = -delta, that is Phi_a = K0(s r/c_a) / (2 pi), a = P, S (Laplace domain),

    G(x - y) = 1/s² [(s/c_S)² Phi_S I - grad grad (Phi_S - Phi_P)] = g1 I - g2 r̂ r̂ᵀ,
    r̂ = (x - y)/r.

For another density rho divide G by rho; the functions Phi do not depend on it. In the time domain
everything is integrated n times in time and closed (square roots, logarithms): F_n = n-fold
integral of H(t - r/c)/sqrt(t² - r²/c²),

    F_1 = ln((t + R) c/r),  F_2 = t F_1 - R,  (n-1)² F_n = (2n-3) t F_(n-1) - R² F_(n-2),
    R = sqrt(t² - r²/c²).

All are zero ahead of their front (r >= c t). See docs/theory/bem.md; for n = 0, Achenbach, Wave
Propagation in Elastic Solids, 3.10.
"""

from dataclasses import dataclass
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ..core.algebra import Array
from ..core.arguments import check_fields
from ..core.errors import InputError
from ..core.quantities import Positive, Unit

TWO_PI = 2.0 * np.pi


class KernelSet(NamedTuple):
    """Hold what the Galerkin layer integrates, arrays of the shape of r.

    Attributes:
        single: (g1, g2) of G.
        double: (phi, dphi, ddiff, g1, g2), where phi = Phi_S, dphi = Phi_S'/r and ddiff = (Phi_P -
            Phi_S)'/r; a prime is d/dr.
        hyper: the same, then (inertia_p, inertia_s) with inertia_a = s² Phi_a, which in time is
            Phi_a integrated twice less.
    """

    single: tuple[NDArray, ...]
    double: tuple[NDArray, ...]
    hyper: tuple[NDArray, ...]


Speed = Annotated[float, Positive, Unit("m/s")]


def check_speeds(kernels: Any) -> None:
    """Raise InputError unless c_p and c_s of kernels are positive and c_p is the larger."""
    check_fields(kernels)
    if kernels.c_p <= kernels.c_s:
        raise InputError(
            f"{type(kernels).__name__}: c_p is {kernels.c_p:g} and c_s is {kernels.c_s:g} m/s; "
            "give c_p above c_s: pressure waves are faster than shear waves"
        )


@dataclass(frozen=True)
class TimeKernels:
    """Evaluate kernels at a time t [s].

    The kernels are integrated in time once (single layer), twice (double layer) and three times
    (hypersingular operator), as tractions that are constant and displacements that are linear in a
    time step need it.

    Attributes:
        t: time since the impulse [s].
        c_p: speed of pressure waves [m/s].
        c_s: speed of shear waves [m/s].
    """

    t: Annotated[float, Positive, Unit("s")]
    c_p: Speed
    c_s: Speed

    def __post_init__(self) -> None:
        check_speeds(self)

    def __call__(self, r: Array) -> KernelSet:
        """Return the kernels at distances r > 0 [m]; they are zero where r >= c_p t."""
        t = self.t
        slow = 1.0 / self.c_s**2
        fast = 1.0 / self.c_p**2
        inverse = 1.0 / r**2

        # Single layer: F_1 of both waves. dQ_2 = (R_P - R_S)/r² is written so that behind the
        # fronts no two nearly equal numbers are subtracted.
        root_s, f1_s = front_functions(r, t, self.c_s)
        root_p, f1_p = front_functions(r, t, self.c_p)
        dq2 = np.where(
            root_s > 0.0, (slow - fast) / np.maximum(root_s + root_p, 1e-300), root_p * inverse
        )
        dq3 = 0.5 * (f1_s * slow - f1_p * fast + t * dq2)
        single = tensor(f1_s * slow, f1_p * fast, dq3)

        # Double layer, F_2, and below the hypersingular operator, F_3, by recursion:
        # (n-1)² dQ_n = (2n-3) t dQ_(n-1) - t² dQ_(n-2) + [(r F'_(n-2) + 2 F_(n-2))/c²] S minus P,
        # where r F_n' = (n-1) F_n - t F_(n-1) and Q_n = F_n'/r, dQ_n = Q_n^S - Q_n^P
        f2_s = t * f1_s - root_s
        f2_p = t * f1_p - root_p
        dq4 = (
            5.0 * t * dq3
            - t**2 * dq2
            + slow * (3.0 * f2_s - t * f1_s)
            - fast * (3.0 * f2_p - t * f1_p)
        ) / 9.0
        double = (
            f2_s / TWO_PI,
            -root_s * inverse / TWO_PI,
            -dq2 / TWO_PI,
            *tensor(f2_s * slow, f2_p * fast, dq4),
        )
        f3_s = 0.25 * (3.0 * t * f2_s - root_s**2 * f1_s)
        f3_p = 0.25 * (3.0 * t * f2_p - root_p**2 * f1_p)
        dq5 = (
            7.0 * t * dq4
            - t**2 * dq3
            + slow * (4.0 * f3_s - t * f2_s)
            - fast * (4.0 * f3_p - t * f2_p)
        ) / 16.0
        hyper = (
            f3_s / TWO_PI,
            (2.0 * f3_s - t * f2_s) * inverse / TWO_PI,
            -dq3 / TWO_PI,
            *tensor(f3_s * slow, f3_p * fast, dq5),
            f1_p / TWO_PI,
            f1_s / TWO_PI,
        )
        return KernelSet(single, double, hyper)


def front_functions(r: Array, t: float, c: float) -> tuple[Array, Array]:
    """Return R = sqrt(t² - r²/c²) and F_1 = ln((t + R) c/r), both zero ahead of the front.

    Args:
        r: distances [m].
        t: time [s].
        c: speed of the wave [m/s].
    """
    q = np.minimum(r / (c * t), 1.0)
    root = np.sqrt((1.0 - q) * (1.0 + q))
    return t * root, np.log((1.0 + root) / q)


def tensor(f_s: Array, f_p: Array, dq: Array) -> tuple[Array, Array]:
    """Return the radial functions (g1, g2) of G integrated n times in time.

    Args:
        f_s: F_n / c_S² of shear waves.
        f_p: F_n / c_P² of pressure waves.
        dq: dQ_(n+2).
    """
    return (f_s - dq) / TWO_PI, (f_s - f_p - 2.0 * dq) / TWO_PI
