"""The sample profile of SHAKE91 (Idriss and Sun 1992): 150 ft of sand and clay on rock, and what
pystrata makes of it.

The input of the program is public (test-data/INP.DAT of shyang107/goshake); its record is not, so
the motion is a sum of Ricker pulses with the peak of the sample, 0.1 g, on the outcrop. Numbers of
pystrata 0.5.4, EquivalentLinearCalculator: strain ratio 0.5, tolerance 1e-6, COMP_MODULUS_MODEL
"seed", which is G (1 + 2 i xi).
"""

from __future__ import annotations

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.laws.materials import LinearElastic
from vi_contact.practice.ground_motion.record import Record
from vi_contact.practice.soil.curves import SoilCurves
from vi_contact.practice.soil.equivalent_linear import Layer

FOOT, PCF, G = 0.3048, 16.018463, 9.80665
STRAINS = [1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2, 1e-1]
REDUCTION = {
    "clay": [1, 1, 1, 0.981, 0.941, 0.847, 0.656, 0.438, 0.238, 0.144, 0.110],
    "sand": [1, 1, 0.99, 0.96, 0.85, 0.64, 0.37, 0.18, 0.08, 0.05, 0.035],
}
DAMPED = [1e-6, 3e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3, 3.16e-3, 1e-2, 3.16e-2, 1e-1]
DAMPING = [0.0024, 0.0042, 0.008, 0.014, 0.028, 0.051, 0.098, 0.155, 0.21, 0.25, 0.28]
FEET = [5, 5] + [10] * 14
# ft/s
SPEED = [
    1000,
    900,
    900,
    950,
    1000,
    1000,
    1100,
    1100,
    1300,
    1300,
    1400,
    1400,
    1500,
    1500,
    1600,
    1800,
]
KIND = ["sand"] * 4 + ["clay"] * 4 + ["sand"] * 8
WEIGHT = [125] * 8 + [130] * 8  # lb/ft³
ROCK = LinearElastic.from_wave_speeds(8000 * FOOT, 4000 * FOOT, 140 * PCF)

# from the top: G [Pa], damping ratio and largest strain in the middle of each layer; peak at the
# surface [m/s²]
EXPECTED_SHEAR = np.array(
    [
        1.84567020e08,
        1.44739375e08,
        1.34606365e08,
        1.43788788e08,
        1.74905423e08,
        1.71782138e08,
        2.09511728e08,
        2.08015944e08,
        2.79685754e08,
        2.75290704e08,
        3.24156974e08,
        3.21604478e08,
        3.73882044e08,
        3.72358617e08,
        4.28805400e08,
        5.56202490e08,
    ]
)
EXPECTED_DAMPING = np.array(
    [
        0.007169125,
        0.013880747,
        0.022483210,
        0.027175321,
        0.028183960,
        0.032292152,
        0.030492696,
        0.032118704,
        0.027307644,
        0.028876481,
        0.027378904,
        0.028202784,
        0.026863405,
        0.027308835,
        0.025986914,
        0.023246664,
    ]
)
EXPECTED_STRAIN = np.array(
    [
        1.53709934e-05,
        5.87040706e-05,
        1.24447530e-04,
        1.86307142e-04,
        2.01765137e-04,
        2.45509405e-04,
        2.25288742e-04,
        2.43483789e-04,
        1.88439336e-04,
        2.08550904e-04,
        1.89597669e-04,
        2.01946638e-04,
        1.81376025e-04,
        1.88458637e-04,
        1.68207091e-04,
        1.32892391e-04,
    ]
)
EXPECTED_PEAK = 1.854352541


def curves(kind: str) -> SoilCurves:
    """Modulus and damping have tables with other strains: one with those of both, interpolated as
    pystrata does."""
    strains = np.unique(STRAINS + DAMPED)
    where = np.log(strains)
    return SoilCurves(
        strains,
        np.interp(where, np.log(STRAINS), REDUCTION[kind]),
        np.interp(where, np.log(DAMPED), DAMPING),
        kind,
    )


def layers() -> list[Layer]:
    """The sixteen layers from the top; pressure waves are twice as fast, which nothing here depends
    on."""
    return [
        (h * FOOT, LinearElastic.from_wave_speeds(2 * v * FOOT, v * FOOT, w * PCF), curves(kind))
        for h, v, w, kind in zip(FEET, SPEED, WEIGHT, KIND, strict=True)
    ]


def motion(peak: float = 0.1 * G, dt: float = 0.02, n: int = 2048) -> Record:
    """Five Ricker pulses in the first ten seconds of 41."""
    t, a = dt * np.arange(n), np.zeros(n)
    for f, start, size in (
        (0.8, 3.0, 0.3),
        (1.7, 4.5, -0.7),
        (2.9, 6.0, 1.0),
        (5.0, 5.0, 0.6),
        (8.0, 7.0, 0.4),
    ):
        x = (np.pi * f * (t - start)) ** 2
        a += size * (1.0 - 2.0 * x) * np.exp(-x)
    return Record(a * peak / np.abs(a).max(), dt)


def by_pystrata(record: Record) -> tuple[Array, Array, Array, float]:
    """The four expected things by pystrata itself, where it is installed."""
    import pystrata
    from pystrata import motion as motions
    from pystrata import propagation, site

    site.COMP_MODULUS_MODEL = "seed"
    assert pystrata

    def soil(weight: float, kind: str) -> site.SoilType:
        return site.SoilType(
            kind,
            weight * PCF * G / 1e3,
            site.NonlinearProperty(kind, STRAINS, REDUCTION[kind], "mod_reduc"),
            site.NonlinearProperty(kind, DAMPED, DAMPING, "damping"),
        )

    rows = zip(FEET, SPEED, WEIGHT, KIND, strict=True)
    rock = site.Layer(site.SoilType("rock", 140 * PCF * G / 1e3, None, 0.01), 0, 4000 * FOOT)
    profile = site.Profile(
        [*(site.Layer(soil(w, kind), h * FOOT, v * FOOT) for h, v, w, kind in rows), rock]
    )
    shaken = motions.TimeSeriesMotion("", "", record.dt, record.acceleration / G)
    below, above = profile.location("outcrop", index=-1), profile.location("outcrop", index=0)
    found = propagation.EquivalentLinearCalculator(
        strain_ratio=0.5, tolerance=1e-6, max_iterations=60
    )
    found(shaken, profile, below)
    each = list(profile)[:-1]
    return (
        np.array([one.shear_mod * 1e3 for one in each]),
        np.array([one.damping for one in each]),
        np.array([one.strain_max for one in each]),
        G * shaken.calc_peak(found.calc_accel_tf(below, above)),
    )
