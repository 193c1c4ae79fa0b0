"""Closed forms of waves in soil: layers, Rayleigh waves, dashpots (V8.1, V8.2, V8.3), and their
column of elements."""

from __future__ import annotations

import math

import numpy as np
import pytest
from dashpot_reflection import dashpot_energy, dashpot_reflection
from rayleigh_waves import rayleigh_motion, rayleigh_speed
from site_response import SoilLayer, viscous
from soil import SOIL, column_of

import vi_contact as vc
from vi_contact.core.errors import InputError
from vi_contact.practice.ground_motion import Record
from vi_contact.practice.soil import upgoing

pytestmark = pytest.mark.serial
ANGLES = (15, 30, 45, 60, 75, 85)
TABLE = {  # wave, nu -> reflected over incident energy flux at the angles above
    ("P", 0.25): (0.00016, 0.00031, 0.00394, 0.03590, 0.20269, 0.58633),
    ("P", 1 / 3): (0.00001, 0.00067, 0.00809, 0.05081, 0.23672, 0.61903),
    ("S", 0.25): (0.00297, 0.03590, 0.02869, 0.11325, 0.35092, 0.70798),
    ("S", 1 / 3): (0.00261, 0.00515, 0.02944, 0.11111, 0.34667, 0.70503),
}


def poisson(nu):
    return vc.LinearElastic(E=1.0e7, nu=nu, rho=2000.0)


@pytest.mark.parametrize("case", TABLE)
def test_what_dashpots_reflect_at_an_angle(case):
    """V8.1: printed digits; the two amplitudes printed for nu = 1/4."""
    wave, nu = case
    found = [dashpot_energy(poisson(nu), math.radians(angle), wave=wave) for angle in ANGLES]
    np.testing.assert_allclose(found, TABLE[case], atol=6e-6)
    for angle, amplitudes in ((30, (0.01604, 0.00895)), (60, (0.13397, 0.13397))):
        np.testing.assert_allclose(
            dashpot_reflection(poisson(0.25), math.radians(angle), wave="P"), amplitudes, atol=6e-6
        )


def test_dashpots_at_right_angles():
    """V8.1: R = (1 - a)/(1 + a) for dashpots a times too strong."""
    for a in (0.5, 1.0, 2.0):
        for wave, place in (("P", 0), ("S", 1)):
            found = dashpot_reflection(poisson(0.3), 0.0, wave=wave, normal=a, tangential=a)
            np.testing.assert_allclose(found[place], abs(1.0 - a) / (1.0 + a), atol=1e-15)
            assert abs(found[1 - place]) < 1e-15
    for no_dashpots in ("P", "S"):  # a free surface reflects everything
        energy = dashpot_energy(poisson(0.3), 0.5, wave=no_dashpots, normal=0.0, tangential=0.0)
        assert math.isclose(energy, 1.0, rel_tol=1e-12)
    with pytest.raises(InputError, match="give 'P' or 'S'"):
        dashpot_reflection(poisson(0.3), 0.5, wave="R")


def test_rayleigh_waves():
    """V8.3: printed digits; seed 003's speed of steel; the motion at the surface leaves it free of
    stress."""
    for nu, ratio in (
        (0.0, 0.874032),
        (0.1, 0.893106),
        (0.2, 0.9109959),
        (0.25, 0.9194017),
        (0.3, 0.9274127),
        (1 / 3, 0.9325259),
        (0.4, 0.9421954),
        (0.45, 0.9489597),
    ):
        assert math.isclose(rayleigh_speed(poisson(nu)) / poisson(nu).c_s, ratio, abs_tol=6e-7)
    for nu in (0.1, 0.25, 0.4):
        k, h, depth = 2.0 * math.pi, 1e-5, np.array([0.0, 1e-5, 2e-5])
        U, V = rayleigh_motion(poisson(nu), depth, 1.0)
        slope = [-(-1.5 * f[0] + 2.0 * f[1] - 0.5 * f[2]) / h for f in (U, V)]  # along y = -depth
        m = poisson(nu)
        tau = slope[0] + k * V[0]  # of cos k(x - ct)
        sigma = (m.lame_lambda + 2.0 * m.shear_modulus) * slope[1] - m.lame_lambda * k * U[0]
        assert abs(tau) < 1e-6 * k and abs(sigma) < 1e-6 * k * m.E and U[0] == pytest.approx(1.0)


def test_transfer_functions():
    """V8.2 and seismic practice 3.2: printed digits; natural frequencies."""
    layer, damped = SoilLayer(30.0, SOIL), SoilLayer(30.0, SOIL, xi=0.05)
    f = np.array([0.5, 1.0, 2.0, 3.0])
    np.testing.assert_allclose(
        layer.on_rigid_base(f), [1.122326, 1.701302, 3.236068, 1.051462], atol=6e-7
    )
    np.testing.assert_allclose(
        damped.on_rigid_base(f), [1.120939, 1.687834, 3.159038, 1.043650], atol=6e-7
    )
    assert layer.frequency() == pytest.approx(1.6667, abs=5e-5) and layer.frequency(
        2
    ) == pytest.approx(5.0)
    fine = np.linspace(1.5, 1.8, 3001)
    assert damped.on_rigid_base(fine).max() == pytest.approx(12.767, abs=5e-4)
    shallow = vc.LinearElastic.from_wave_speeds(600.0, 300.0, 2000.0)
    for xi, peaks in ((0.05, (12.77, 4.22)), (0.02, (31.84, 10.60))):
        column = SoilLayer(20.0, shallow, xi=xi)
        assert column.frequency() == 3.75
        for f_n, peak in zip((3.75, 11.25), peaks, strict=True):
            assert column.on_rigid_base(np.linspace(0.98, 1.02, 801) * f_n).max() == pytest.approx(
                peak, abs=6e-3
            )
    for speed, peak in ((1000.0, 3.141), (2000.0, 5.041)):
        rock = vc.LinearElastic.from_wave_speeds(2.0 * speed, speed, 2500.0)
        found = SoilLayer(20.0, shallow, xi=0.05).on_elastic_base(np.linspace(2.0, 5.0, 3001), rock)
        assert found.max() == pytest.approx(peak, abs=6e-4)


def harmonic_amplitude(values, t, f):
    """|amplitude| at frequency f, least squares."""
    waves = np.column_stack([np.cos(2 * np.pi * f * t), np.sin(2 * np.pi * f * t)])
    return float(np.hypot(*np.linalg.lstsq(waves, values, rcond=None)[0]))


@pytest.mark.long
@pytest.mark.parametrize("f", [1.0, 2.0])
def test_the_column_answers_like_the_layer(f):
    """V8.2 with stiffness damping, 5 % at this frequency, 30 elements, steady state: 1 %, and 0.5 %
    of its own k*."""
    beta = 0.05 / (np.pi * f)
    column = column_of(SOIL, np.linspace(0.0, 30.0, 31), beta=beta)
    shake = vc.Harmonic(1.0, f)
    problem = column.on_rigid_base(shake)
    dt = 1.0 / (80.0 * f)
    rows = [(s.t, s.u[-2]) for s, _ in vc.march(problem, dt=dt, steps=80 * 30)][-80 * 3 :]
    t, top = np.array(rows).T
    total = top - np.sin(2 * np.pi * f * t) / (2 * np.pi * f) ** 2  # the base goes as -sin/w²
    ratio = harmonic_amplitude(total, t, f) * (2 * np.pi * f) ** 2
    own = abs(1.0 / np.cos(viscous(SOIL, f, beta=beta) * 30.0))
    assert ratio == pytest.approx(own, rel=5e-3)
    assert ratio == pytest.approx(float(SoilLayer(30.0, SOIL, xi=0.05).on_rigid_base(f)), rel=1e-2)


@pytest.mark.long
@pytest.mark.parametrize("speed, peak", [(1000.0, 3.141), (2000.0, 5.041)])
def test_the_column_on_rock_answers_like_the_layer(speed, peak):
    """Seismic practice 3.2: largest amplification of an outcrop motion, 20 m on two rocks, damping
    5 % there: 1 %."""
    soil = vc.LinearElastic.from_wave_speeds(600.0, 300.0, 2000.0)
    rock = vc.LinearElastic.from_wave_speeds(2.0 * speed, speed, 2500.0)
    layer, fine = SoilLayer(20.0, soil, xi=0.05), np.linspace(2.0, 5.0, 601)
    f = float(fine[np.argmax(layer.on_elastic_base(fine, rock))])
    column = column_of(soil, np.linspace(0.0, 20.0, 31), beta=0.05 / (np.pi * f))
    up = upgoing(vc.Harmonic(1.0, f, phase=0.5 * np.pi), dt=1.0 / (400.0 * f))
    problem = column.on_dashpots(rock.rho * rock.c_s, rock.rho * rock.c_p, up)
    rows = [(s.t, s.v[-2]) for s, _ in vc.march(problem, dt=1.0 / (80.0 * f), steps=80 * 20)][
        -80 * 3 :
    ]
    t, top = np.array(rows).T
    ratio = harmonic_amplitude(top, t, f) * 2.0 * np.pi * f  # the outcrop's velocity has 1/w
    assert ratio == pytest.approx(peak, rel=1e-2)


def test_upgoing_velocity():
    """Half the integral of a record, exact between its samples; all of it when it is upgoing
    already."""
    record = Record(np.array([0.0, 2.0, -1.0, 0.0]), 0.1)
    half, whole = upgoing(record, direction=(0.0, 2.0)), upgoing(record, outcrop=False)
    assert half(0.0).tolist() == [0.0, 0.0] and half(-1.0).tolist() == [0.0, 0.0]
    np.testing.assert_allclose(half(0.05), [0.0, 0.5 * 2.0 * 0.025], rtol=1e-14)
    np.testing.assert_allclose(whole(0.2), [0.15, 0.0], rtol=1e-14)
    np.testing.assert_allclose(whole(9.0), [0.1, 0.0], rtol=1e-13)  # the drift of this record
    sine = upgoing(vc.Harmonic(3.0, 2.0), dt=1e-3)
    t = 0.3137
    assert sine(t)[0] == pytest.approx(
        0.5 * 3.0 / (4 * np.pi) * (1 - np.cos(4 * np.pi * t)), rel=1e-4
    )
    with pytest.raises(InputError, match="is to be integrated"):
        upgoing(vc.Harmonic(3.0, 2.0))
