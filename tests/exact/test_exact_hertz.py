"""Hertz contact, punches and the quasi-static impact: V2.3, V2.5, V3.3 and the integral equations
of the half-space."""

import math

import numpy as np
import pytest
from hertz_line import HertzLine, StripPunch
from scipy.integrate import quad, solve_ivp

from vi_contact.core.errors import InputError
from vi_contact.exact.hertz import (
    HertzImpact,
    HertzPoint,
    contact_modulus,
    contact_radius,
)

pytestmark = pytest.mark.serial
RIGID_PLANE = contact_modulus((1.0, 0.3))


def test_lines_numbers():
    """V2.3 (i) the NAFEMS benchmark, in N and mm, and (ii)."""
    benchmark = HertzLine(35e3, contact_modulus((210e3, 0.3), (70e3, 0.3)), contact_radius(50.0))
    assert benchmark.modulus == pytest.approx(57692.31, abs=5e-3)
    assert benchmark.half_width == pytest.approx(6.2146, abs=5e-5)
    assert benchmark.peak == pytest.approx(3585.36, abs=5e-3)
    unit = HertzLine(0.02, RIGID_PLANE, 1.0)
    assert (unit.modulus, unit.half_width, unit.peak) == pytest.approx(
        (1.098901, 0.152227, 0.083641), abs=5e-7
    )


def test_points_numbers():
    """V2.3 (iii) Code_Aster SSNV104, (iv) a steel sphere on a rigid plane, in N and mm."""
    modulus = contact_modulus((2e4, 0.3), (2e4, 0.3))
    spheres = HertzPoint.from_approach(4.0, modulus=modulus, radius=contact_radius(50.0, 50.0))
    assert (spheres.contact_radius, spheres.approach) == pytest.approx((10.0, 4.0), rel=1e-14)
    assert spheres.peak == pytest.approx(2798.33, abs=5e-3) and spheres.force == pytest.approx(
        5.8608e5, abs=5.0
    )
    steel = HertzPoint(100.0, contact_modulus((210e3, 0.3)), 8.0)
    assert steel.contact_radius == pytest.approx(0.137507, abs=5e-7)
    assert steel.peak == pytest.approx(2525.18, abs=5e-3) and steel.approach == pytest.approx(
        2.3635e-3, abs=5e-8
    )


def test_line_pressure_bends_the_half_plane_to_the_cylinder():
    """V2.3: integral of p is P; Flamant: u(x) - u(0) = -2/(pi E*) integral of p(s) ln|(x - s)/s| is
    -x²/(2R)."""
    line = HertzLine(0.02, RIGID_PLANE, 1.0)
    a = line.half_width
    assert quad(line.pressure, -a, a, epsabs=0.0)[0] == pytest.approx(line.force, rel=1e-6)
    # Gauss-Chebyshev of the second kind, nearly
    s = -a * np.cos((np.arange(20000) + 0.5) * math.pi / 20000)
    weight = math.pi / 20000 * np.sqrt(a * a - s * s) * line.pressure(s)
    for x in (0.3 * a, 0.8 * a):
        sunk = -2.0 / (math.pi * RIGID_PLANE) * (weight * np.log(np.abs((x - s) / s))).sum()
        assert sunk == pytest.approx(-(x**2) / 2.0, rel=2e-3)
    assert line.pressure([-1.1 * a, a, 0.0]).tolist() == [0.0, 0.0, line.peak]


def test_point_pressure_bends_the_half_space_to_the_sphere():
    """V2.3: integral of p is F; Boussinesq on the axis: 2/E* integral of p dr is the approach."""
    point = HertzPoint(100.0, 230.0, 8.0)
    a = point.contact_radius
    assert quad(lambda r: 2.0 * math.pi * r * point.pressure(r), 0.0, a)[0] == pytest.approx(
        100.0, rel=1e-7
    )
    assert 2.0 / 230.0 * quad(point.pressure, 0.0, a)[0] == pytest.approx(point.approach, rel=1e-7)


def test_a_punch_is_flat():
    """V2.5: total force; equal sinking; edge exponent -1/2."""
    strip = StripPunch(half_width=2.0, force=3.0)
    angle = (np.arange(20000) + 0.5) * math.pi / 20000
    s = -2.0 * np.cos(angle)
    weight = math.pi / 20000 * 2.0 * np.sin(angle) * strip.pressure(s)
    assert weight.sum() == pytest.approx(3.0, rel=1e-12)
    sunk = [(weight * np.log(np.abs(x - s))).sum() for x in (0.0, 0.7, 1.9)]
    assert sunk == pytest.approx(np.full(3, sunk[0]), abs=1e-3)
    near, far = strip.pressure(2.0 - 1e-6), strip.pressure(2.0 - 1e-4)
    assert math.log(near / far) / math.log(1e-2) == pytest.approx(-0.5, abs=1e-4)
    assert strip.pressure([2.0, 2.1]).tolist() == [math.inf, 0.0]


def test_impact_numbers():
    """V3.3 as printed but for the last digits of d_max and t_c (2.81313, 8.2797), settled below."""
    mass = 7800.0 * 4.0 / 3.0 * math.pi * 0.01**3
    impact = HertzImpact(mass=mass, speed=0.1, modulus=contact_modulus((210e9, 0.3)), radius=0.01)
    assert impact.approach == pytest.approx(2.81314e-6, abs=5e-12)
    assert impact.duration == pytest.approx(8.2798e-5, abs=5e-10)
    assert impact.deepest.force == pytest.approx(145.18, abs=5e-3)
    assert impact.deepest.contact_radius == pytest.approx(1.6772e-4, abs=5e-9)
    unit = HertzImpact(mass=1.0, speed=1.0, modulus=0.75, radius=1.0)  # d'' = -d^(3/2)

    def leaves(t, y):
        return y[0]

    leaves.terminal, leaves.direction = True, -1
    run = solve_ivp(
        lambda t, y: (y[1], -(max(y[0], 0.0) ** 1.5)),
        (0.0, 9.0),
        (0.0, 1.0),
        rtol=1e-11,
        atol=1e-13,
        events=[leaves, lambda t, y: y[1]],
    )
    assert run.t_events[0][-1] == pytest.approx(unit.duration, rel=1e-8)
    assert run.y_events[1][0, 0] == pytest.approx(unit.approach, rel=1e-9)
    assert unit.deepest.force == pytest.approx(unit.approach**1.5, rel=1e-12)
    assert unit.duration / unit.approach == pytest.approx(2.9433, abs=5e-5)


def test_wrong_data_are_refused():
    with pytest.raises(InputError, match="no elastic body"):
        contact_modulus()
    with pytest.raises(InputError, match="nu = 0.7"):
        contact_modulus((1.0, 0.7))
    with pytest.raises(InputError, match="give radii whose sum"):
        contact_radius(5.0, -4.0)
    with pytest.raises(InputError, match="HertzLine: force is 0"):
        HertzLine(0, 1.0, 1.0)
    with pytest.raises(InputError, match="approach is -1"):
        HertzPoint.from_approach(-1, modulus=1.0, radius=1.0)
