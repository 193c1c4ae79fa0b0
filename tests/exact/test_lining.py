"""Closed forms of S3.3 to S3.5: rigid wall, racking frames, tunnel linings."""

from __future__ import annotations

import numpy as np
import pytest
from rigid_wall import RigidWall
from thick_lining import ThickLining
from thin_lining import ThinLining

from vi_contact import LinearElastic
from vi_contact.core.errors import InputError
from vi_contact.practice.engineering.checks.racking_ratio import flexibility, racking_ratio

pytestmark = pytest.mark.serial
CONCRETE, SOIL, GAMMA = (
    LinearElastic(E=25e9, nu=0.2, rho=2400.0),
    LinearElastic(E=100e6, nu=0.3, rho=1900.0),
    1e-3,
)


@pytest.mark.parametrize(("nu", "thrust"), [(0.3, 0.995), (1 / 3, 1.030), (0.4, 1.108)])
def test_thrust_on_a_rigid_wall(nu: float, thrust: float):
    wall = RigidWall(height=1.0, rho=1.0, nu=nu)
    assert wall.thrust(1.0) == pytest.approx(thrust, abs=5e-4)
    assert wall.moment(1.0) / wall.thrust(1.0) == pytest.approx(0.5986, abs=5e-5)
    assert RigidWall(height=3.0, rho=2.0, nu=nu).thrust(4.0) == pytest.approx(
        2.0 * 4.0 * 9.0 * wall.thrust(1.0)
    )


@pytest.mark.parametrize(
    ("flexibility", "thrust", "height"),
    [(0.0, 0.940, 0.599), (1.0, 0.567, 0.512), (2.0, 0.438, 0.447), (5.0, 0.305, 0.323)],
)
def test_thrust_on_a_wall_that_turns(flexibility: float, thrust: float, height: float):
    wall = RigidWall(height=1.0, rho=1.0, nu=1 / 3, simple=True, flexibility=flexibility)
    assert wall.thrust(1.0) == pytest.approx(thrust, abs=5.5e-4)
    assert wall.moment(1.0) / wall.thrust(1.0) == pytest.approx(height, abs=5.5e-4)


def test_pressure_integrates_to_thrust_and_moment():
    wall = RigidWall(height=2.0, rho=1800.0, nu=0.3)
    x, w = np.polynomial.legendre.leggauss(60)
    y = 1.0 + x
    p = wall.pressure(y, 3.0)
    assert w @ p == pytest.approx(wall.thrust(3.0), rel=1e-4)
    assert w @ (p * y) == pytest.approx(wall.moment(3.0), rel=1e-4)


def test_flexibility_of_frames():
    """The example of S3.4: Vs 150 m/s, rho 1900 kg/m³, t 0.4 m, E 30 GPa in plane strain."""
    G, bending = 1900.0 * 150.0**2, 30e9 / (1.0 - 0.2**2) * 0.4**3 / 12.0
    assert flexibility(G, 6.0, 4.0, bending, bending, bending) == pytest.approx(2.565, abs=5e-4)
    equal = G / 24.0 * (4.0**2 * 6.0 / bending + 4.0 * 6.0**2 / bending)
    assert flexibility(G, 6.0, 4.0, bending, bending, bending) == pytest.approx(equal, rel=1e-13)


def frame_force(W: float, H: float, wall: float, roof: float, invert: float) -> float:
    """S by the stiffness of a frame of inextensible members: sway and the four corner rotations."""
    K = np.zeros((5, 5))  # sway, rotations of bottom left, bottom right, top right, top left
    for bottom, top in ((1, 4), (2, 3)):
        k = wall / H
        for i, j, value in (
            (bottom, bottom, 4 * k),
            (top, top, 4 * k),
            (bottom, top, 2 * k),
            (top, bottom, 2 * k),
            (0, 0, 12 * k / H**2),
            (0, bottom, 6 * k / H),
            (bottom, 0, 6 * k / H),
            (0, top, 6 * k / H),
            (top, 0, 6 * k / H),
        ):
            K[i, j] += value
    for left, right, bending in ((1, 2, invert), (4, 3, roof)):
        k = bending / W
        for i, j, value in (
            (left, left, 4 * k),
            (right, right, 4 * k),
            (left, right, 2 * k),
            (right, left, 2 * k),
        ):
            K[i, j] += value
    return float(K[0, 0] - K[0, 1:] @ np.linalg.solve(K[1:, 1:], K[1:, 0]))


def test_flexibility_is_that_of_the_frame():
    frame, G = (6.0, 4.0, 1.3e8, 2.1e8, 3.7e8), 4e7
    assert flexibility(G, *frame) == pytest.approx(G * 6.0 / (frame_force(*frame) * 4.0), rel=1e-12)


def test_racking_ratio():
    assert racking_ratio(7.567, 0.4) == pytest.approx(2.02529, abs=5e-6)
    rows = {0.1: 0.147, 0.5: 0.609, 1.0: 1.0, 2.0: 1.474, 5.0: 2.059, 10.0: 2.373, 1e9: 2.80}
    for flexible, ratio in rows.items():
        assert racking_ratio(flexible, 0.3) == pytest.approx(ratio, abs=6e-4)
        assert racking_ratio(flexible, 0.5) == pytest.approx(
            2.0 * flexible / (1.0 + flexible), rel=1e-14
        )


def test_thin_lining():
    thin = ThinLining(3.0, 0.3, CONCRETE, SOIL)
    assert thin.compressibility == pytest.approx(0.0738, abs=5e-5)
    assert thin.flexibility == pytest.approx(5.908, abs=5e-4)
    assert thin.full_slip == pytest.approx(0.5594, abs=5e-5)
    assert thin.diameter_change(GAMMA) == pytest.approx(6.61e-3, abs=5e-6)
    assert thin.thrust(GAMMA, slip=True) == pytest.approx(21.5e3, abs=50.0)
    assert thin.moment(GAMMA) == pytest.approx(64.5e3, abs=50.0)
    assert thin.thrust(GAMMA, slip=False) == pytest.approx(141.7e3, abs=50.0)


def test_thick_lining_tends_to_the_thin_one():
    """With the bending stiffness kept, thickness R/1000: full slip to 0.1 %."""
    thickness = 3e-3
    stiff = LinearElastic(E=25e9 * (0.3 / thickness) ** 3, nu=0.2, rho=2400.0)
    thick = ThickLining(3.0 - 0.5 * thickness, 3.0 + 0.5 * thickness, stiff, SOIL)
    thin = ThinLining(3.0, thickness, stiff, SOIL)
    assert thick.diameter_change(GAMMA) == pytest.approx(thin.diameter_change(GAMMA), rel=1e-3)
    assert abs(thick.moment(GAMMA)) == pytest.approx(thin.moment(GAMMA), rel=2e-3)
    assert abs(thick.thrust(GAMMA)) == pytest.approx(thin.thrust(GAMMA, slip=True), rel=2e-3)


@pytest.mark.parametrize("slip", [True, False])
def test_a_lining_without_stiffness_is_a_hole(slip: bool):
    """dD/D = 2 (1 - nu) gamma (S3.5)."""
    soft = LinearElastic(E=1.0, nu=0.2, rho=1.0)
    hole = ThickLining(2.9, 3.0, soft, SOIL, slip)
    assert hole.diameter_change(GAMMA) / 6.0 == pytest.approx(1.4 * GAMMA, rel=1e-6)


def test_a_lining_of_soil_is_no_lining():
    """Tied and of the ground's own material around a tiny hole: the ground's own shear, dD = gamma
    D/2."""
    whole = ThickLining(1e-3, 3.0, SOIL, SOIL, slip=False)
    assert whole.diameter_change(GAMMA) == pytest.approx(0.5 * GAMMA * 6.0, rel=1e-5)
    assert whole.pressure(GAMMA) == pytest.approx(SOIL.shear_modulus * GAMMA, rel=1e-5)


def test_thick_lining_is_in_equilibrium():
    """(r sigma_r)' - sigma_theta + 2 tau = 0 for fields cos 2 theta, sin 2 theta; the inside is
    free."""
    lining = ThickLining(2.7, 3.0, CONCRETE, SOIL)
    r, h = 2.85, 1e-4
    slope = (
        (r + h) * lining.field("sigma_r", r + h, 1.0)
        - (r - h) * lining.field("sigma_r", r - h, 1.0)
    ) / (2 * h)
    terms = slope, -lining.field("sigma_theta", r, 1.0), 2.0 * lining.field("tau", r, 1.0)
    assert abs(sum(terms)) < 1e-6 * max(map(abs, terms))
    for name in ("sigma_r", "tau"):
        assert abs(lining.field(name, 2.7, 1.0)) < 1e-9 * abs(lining.field("sigma_theta", 2.7, 1.0))
    with pytest.raises(InputError, match="inner < outer"):
        ThickLining(3.0, 2.9, CONCRETE, SOIL)
