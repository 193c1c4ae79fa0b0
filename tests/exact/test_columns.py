"""Bars on bars, and columns with friction at the base: V1.4, V1.5, V1.6."""

import math

import numpy as np
import pytest
from exact_checks import derivative_defect, wave_defect
from exact_columns import ObliqueImpact, ShearColumn
from two_bars import TwoBars

from vi_contact.core.errors import InputError
from vi_contact.laws.materials import LinearElastic

pytestmark = pytest.mark.serial
UNIT = LinearElastic(E=2.0, nu=0.0, rho=1.0)  # c_S = 1, c_P = sqrt(2)
OBLIQUE = ObliqueImpact(height=1.0, material=UNIT, speed_n=1.0, speed_t=1.0, mu=0.3)
SHEAR = ShearColumn(height=1.0, material=UNIT, speed=1.0, tau_y=0.15)
RANDOM = np.random.default_rng(0)
CELLS = (np.arange(20000) + 0.5)[:, np.newaxis] / 20000


def test_bars_of_the_same_material():
    """V1.4: p = rho c v0/2, duration 2 L1/c, bar 1 stops, bar 2 moves with v0 L1/L2, e = L1/L2;
    longer striker too."""
    bars = TwoBars(length1=1.0, length2=2.0)
    assert (bars.pressure, bars.duration, bars.velocity1, bars.velocity2, bars.restitution) == (
        0.5,
        2.0,
        0.0,
        0.5,
        0.5,
    )
    assert bars.force([-0.1, 1.0, 2.1]).tolist() == [0.0, 0.5, 0.0]
    swapped = TwoBars(length1=2.0, length2=1.0)
    assert (swapped.duration, swapped.velocity1, swapped.velocity2, swapped.restitution) == (
        2.0,
        0.5,
        1.0,
        0.5,
    )


def test_bars_of_two_materials():
    """V1.4: p = v0 z1 z2/(z1 + z2); momentum; against springs and masses integrated in time."""
    bars = TwoBars(length1=1.0, length2=3.0, z1=1.0, z2=4.0, c1=1.0, c2=2.0, speed=2.0)
    assert bars.pressure == pytest.approx(1.6) and bars.duration == 2.0
    assert bars.velocity1 + 6.0 * bars.velocity2 == pytest.approx(2.0)
    impulse, duration, v1, v2 = lattice_collision(bars, n1=100)
    assert impulse == pytest.approx(bars.impulse, rel=2e-2) and duration == pytest.approx(
        bars.duration, abs=5e-2
    )
    assert [v1, v2] == pytest.approx([bars.velocity1, bars.velocity2], abs=4e-2)


def lattice_collision(bars, n1):
    """Impulse, duration, mean velocities: explicit steps at the exact limit of lumped chains.

    Both chains have cells of one step's travel, where the lumped scheme moves waves exactly; the
    end nodes share one velocity while they push, then part for good.
    """
    dt = bars.length1 / bars.c1 / n1
    sides = ((n1, bars.z1, bars.speed), (round(bars.length2 / bars.c2 / dt), bars.z2, 0.0))
    u, mass = [np.zeros(n + 1) for n, _, _ in sides], [np.full(n + 1, z * dt) for n, z, _ in sides]
    v = [np.full(n + 1, v0) for n, _, v0 in sides]
    for m in mass:
        m[[0, -1]] *= 0.5
    impulse = duration = 0.0
    while True:
        for (_, z, _), w, rate, m in zip(sides, u, v, mass, strict=True):
            tension = z / dt * np.diff(w)
            rate += dt * (np.append(tension, 0.0) - np.append(0.0, tension)) / m
        push = (v[0][-1] - v[1][0]) / (1.0 / mass[0][-1] + 1.0 / mass[1][0])
        if push <= 1e-12:
            return (
                impulse,
                duration,
                *(np.average(rate, weights=m) for rate, m in zip(v, mass, strict=True)),
            )
        v[0][-1] -= push / mass[0][-1]
        v[1][0] += push / mass[1][0]
        impulse, duration = impulse + push, duration + dt
        for w, rate in zip(u, v, strict=True):
            w += dt * rate


def test_bars_that_part_later_are_refused():
    with pytest.raises(InputError, match="give it an impedance"):
        TwoBars(z1=2.0)


def test_oblique_impact_numbers():
    """V1.5 as printed."""
    assert OBLIQUE.duration == pytest.approx(math.sqrt(2.0)) and OBLIQUE.pressure == pytest.approx(
        math.sqrt(2.0)
    )
    assert OBLIQUE.slip_speed == pytest.approx(0.575736, abs=5e-7)
    assert OBLIQUE.impulses == pytest.approx((2.0, -0.6), rel=1e-14)
    assert OBLIQUE.friction_work == pytest.approx(0.345442, abs=5e-7)
    assert OBLIQUE.energy == pytest.approx(1.0 - OBLIQUE.friction_work)


def test_oblique_impact_that_sticks():
    """V1.5: traction rho c_S v_t, no work, when mu c_P v_n > c_S v_t."""
    column = ObliqueImpact(height=1.0, material=UNIT, speed_n=1.0, speed_t=0.4, mu=0.3)
    assert (column.slip_speed, column.friction_work) == (
        0.0,
        0.0,
    ) and column.traction == pytest.approx(0.4)
    assert np.abs(column.velocity(0.0, np.linspace(0.01, 1.4, 50))[..., 1]).max() < 1e-15


@pytest.mark.parametrize("nu", [0.0, 0.3])
def test_oblique_impact_obeys_its_equations(nu):
    """V1.5: two wave equations, velocities, energy before and after, traction = shear stress of the
    base."""
    material = LinearElastic(E=2.0, nu=nu, rho=1.3)
    column = ObliqueImpact(height=1.5, material=material, speed_n=1.0, speed_t=1.0, mu=0.3)
    y, t = 1.5 * (0.1 + 0.8 * RANDOM.random(1000)), 0.2 + 7.0 * RANDOM.random(1000)
    for axis, c in enumerate((material.c_p, material.c_s)):

        def u(y, t, axis=axis):
            return column.displacement(y, t)[..., axis]

        def v(y, t, axis=axis):
            return column.velocity(y, t)[..., axis]

        assert wave_defect(u, length=1.5, c=c, until=8.0) < 1e-13
        assert derivative_defect(u, v, x=y, t=t, h=(0.0, 1e-4)) < 1e-9
    slip = column.displacement(0.0, np.array([0.0, column.duration]))[:, 1]
    assert np.diff(slip) == pytest.approx(column.slip_speed * column.duration)
    during, after = 0.5 * column.duration, column.duration + 2.345
    for when in (during, after):
        lost = column.traction * column.slip_speed * min(when, column.duration)
        assert column_energy(column, material, when) == pytest.approx(1.3 * 1.5 - lost, rel=2e-3)
    assert column_energy(column, material, after) == pytest.approx(column.energy, rel=2e-3)
    momentum = 1.5 * 1.3 * column.velocity(1.5 * CELLS, after).mean(axis=(0, 1))
    assert momentum == pytest.approx(1.5 * 1.3 * np.array([-1.0, 1.0]) + column.impulses, rel=1e-3)
    assert column.displacement(0.0, after)[0] > 0.0


def column_energy(column, material, when):
    """Kinetic and strain energy from the motion itself [J/m²], strains by differences."""
    edges = np.linspace(0.0, column.height, 20001)
    strain = np.diff(column.displacement(edges, when), axis=0) * 20000 / column.height
    v = column.velocity(column.height * CELLS[:, 0], when)
    moduli = material.rho * np.array([material.c_p**2, material.c_s**2])
    return 0.5 * column.height * (material.rho * v**2 + moduli * strain**2).mean(axis=0).sum()


def test_shear_column_numbers():
    """V1.6 as printed."""
    assert SHEAR.slip_speeds == pytest.approx([0.85, 0.55, 0.25], rel=1e-14)
    assert (SHEAR.stick_time, SHEAR.delta) == (6.0, 0.15)
    assert (SHEAR.slip, SHEAR.friction_work, SHEAR.energy) == pytest.approx(
        (3.3, 0.495, 0.005), rel=1e-12
    )


def test_shear_column_obeys_its_equations():
    """V1.6: wave equation, base speeds, rest of the base after t = 6, threshold, energy."""
    y, t = 0.1 + 0.8 * RANDOM.random(1000), 0.2 + 10.0 * RANDOM.random(1000)
    assert wave_defect(SHEAR.displacement, length=1.0, c=1.0, until=11.0) < 1e-13
    assert derivative_defect(SHEAR.displacement, SHEAR.velocity, x=y, t=t, h=(0.0, 1e-4)) < 1e-9
    base = SHEAR.velocity(0.0, np.array([1.0, 3.0, 5.0, 7.0, 9.0, 11.0]))
    assert base == pytest.approx([0.85, 0.55, 0.25, 0.0, 0.0, 0.0], abs=1e-14)
    assert SHEAR.displacement(0.0, np.array([6.0, 7.3, 20.1])) == pytest.approx(
        [3.3, 3.3, 3.3], rel=1e-13
    )
    assert SHEAR.traction([1.0, 5.0, 7.0, 9.0]) == pytest.approx([0.15, 0.15, 0.1, -0.1])
    v, edges = SHEAR.velocity(CELLS, 7.3), np.linspace(0.0, 1.0, 20001)
    strain = np.diff(SHEAR.displacement(edges, 7.3)) * 20000
    assert 0.5 * (v**2).mean() + 0.5 * (strain**2).mean() == pytest.approx(SHEAR.energy, rel=1e-3)


def test_column_that_never_slips():
    """V1.6 with v0 < delta."""
    column = ShearColumn(height=1.0, material=UNIT, speed=0.1, tau_y=0.15)
    assert (len(column.slip_speeds), column.slip, column.stick_time) == (0, 0.0, 0.0)
    assert np.abs(column.displacement(0.0, np.linspace(0.0, 9.0, 100))).max() < 1e-15
