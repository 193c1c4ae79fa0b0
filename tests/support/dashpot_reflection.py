"""Solve what dashpots on a plane boundary reflect, in closed form.

The dashpots are those of Lysmer and Kuhlemeyer, sigma_n = -rho c_P v_n and tau = -rho c_S v_t.
"""

import math

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.laws.materials import LinearElastic


def dashpot_reflection(
    material: LinearElastic,
    angle: float,
    *,
    wave: str,
    normal: float = 1.0,
    tangential: float = 1.0,
) -> tuple[float, float]:
    """Return (|A_P|, |A_S|) of the waves reflected by dashpots, for one of amplitude 1 that arrives
    at ``angle`` [rad].

    angle: from the normal of the boundary, 0 to pi/2; wave: "P" or "S"; normal, tangential: factors
    of rho c_P and rho c_S. Amplitudes of displacement. InputError for another wave or angle.

    Boundary y = 0, body y < 0, factor exp(i w (t - p x)) with slowness p along the boundary. P
    waves have displacement (p, ±eta_p) c_P, S waves (±eta_s, -p) c_S with the vertical slownesses
    eta (+ travels towards the boundary).
    """
    if wave not in ("P", "S") or not 0.0 <= angle < 0.5 * math.pi:
        raise InputError(
            f"dashpot reflection of wave {wave!r} at {angle!r} rad: give 'P' or 'S' and 0 <= angle "
            "< pi/2"
        )
    c_p, c_s, rho = material.c_p, material.c_s, material.rho
    p = math.sin(angle) / (c_p if wave == "P" else c_s)
    eta_p, eta_s = (complex(np.emath.sqrt(1.0 / c**2 - p**2)) for c in (c_p, c_s))
    # evanescent waves decay into the body: exp(-i w eta_y y) with y < 0, reflected ones go with the
    # other sign
    eta_p, eta_s = (complex(eta.real, -abs(eta.imag)) for eta in (eta_p, eta_s))

    def residual(u: tuple[complex, complex], eta: complex) -> Array:
        """Return (sigma_xy + c v_x, sigma_yy + c v_y)/(i w) of u exp(i w (t - p x - eta y))."""
        lame, shear = material.lame_lambda, material.shear_modulus
        tau = -shear * (eta * u[0] + p * u[1])
        sigma = -(lame * (p * u[0] + eta * u[1]) + 2.0 * shear * eta * u[1])
        return np.array([tau + tangential * rho * c_s * u[0], sigma + normal * rho * c_p * u[1]])

    def p_wave(eta: complex) -> Array:
        return residual((p * c_p, eta * c_p), eta)

    def s_wave(eta: complex) -> Array:
        return residual((eta * c_s, -p * c_s), eta)

    incident = p_wave(eta_p) if wave == "P" else s_wave(eta_s)
    a_p, a_s = np.linalg.solve(np.column_stack([p_wave(-eta_p), s_wave(-eta_s)]), -incident)
    return float(abs(a_p)), float(abs(a_s))


def dashpot_energy(
    material: LinearElastic,
    angle: float,
    *,
    wave: str,
    normal: float = 1.0,
    tangential: float = 1.0,
) -> float:
    """Return reflected over incident energy flux at right angles to the boundary; see
    ``dashpot_reflection``."""
    amplitudes = dashpot_reflection(
        material, angle, wave=wave, normal=normal, tangential=tangential
    )
    speeds = material.c_p, material.c_s
    speed = speeds["PS".index(wave)]
    p = math.sin(angle) / speed
    cosines = [np.emath.sqrt(1.0 - (p * c) ** 2).real for c in speeds]
    fluxes = [c * cosine * a**2 for c, cosine, a in zip(speeds, cosines, amplitudes, strict=True)]
    return float(sum(fluxes) / (speed * math.cos(angle)))
