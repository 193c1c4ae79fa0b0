"""Orthotropic and viscous materials against closed forms: compliance along and across the axes,
sections, limits."""

from __future__ import annotations

from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest

from vi_contact.core.errors import InputError
from vi_contact.laws import (
    KelvinVoigt,
    LinearElastic,
    Orthotropic,
    PlaneStrain,
    PlaneStress,
    Rayleigh,
    Solid,
)

pytestmark = pytest.mark.serial
SPRUCE = {  # [Pa]: along the grain, radial, tangential
    "E1": 11.6e9,
    "E2": 0.90e9,
    "E3": 0.50e9,
    "nu12": 0.37,
    "nu13": 0.42,
    "nu23": 0.47,
    "G12": 0.75e9,
    "G13": 0.72e9,
    "G23": 0.039e9,
    "rho": 390.0,
}
STEEL = LinearElastic(E=2.1e11, nu=0.3, rho=7850.0)
ISOTROPIC = {
    **{f"E{i}": STEEL.E for i in "123"},
    **{f"nu{ij}": STEEL.nu for ij in ("12", "13", "23")},
    **{f"G{ij}": STEEL.shear_modulus for ij in ("12", "13", "23")},
    "rho": STEEL.rho,
}


def test_strains_under_one_stress_are_the_definition() -> None:
    """sigma_11 alone: eps_11 = s/E1, eps_22 = -nu12 s/E1, eps_33 = -nu13 s/E1; sigma_22 alone:
    eps_33 = -nu23 s/E2."""
    C = Orthotropic(**SPRUCE).matrix(Solid(), 3)
    along, across = (np.linalg.solve(C, unit) for unit in np.eye(6)[:2])
    E1, E2 = SPRUCE["E1"], SPRUCE["E2"]
    assert along == pytest.approx([1 / E1, -0.37 / E1, -0.42 / E1, 0, 0, 0], rel=1e-12, abs=1e-20)
    assert across == pytest.approx([-0.37 / E1, 1 / E2, -0.47 / E2, 0, 0, 0], rel=1e-12, abs=1e-20)
    assert np.diag(C)[3:] == pytest.approx([SPRUCE["G23"], SPRUCE["G13"], SPRUCE["G12"]], rel=1e-14)


def test_a_lamina_at_an_angle_has_the_moduli_of_textbooks() -> None:
    """Plane stress: 1/E_x = c⁴/E1 + s⁴/E2 + c² s² (1/G12 - 2 nu12/E1) (Jones, Mechanics of
    Composite Materials, 2.97), shear coupling eps_xy/eps_x of the same formula's family, and
    nothing across."""
    angle = 0.6
    c, s = cos(angle), sin(angle)
    C = Orthotropic(**SPRUCE, axes=angle).matrix(PlaneStress(), 2)
    assert np.abs(C[3]).max() < 1e-14 * np.abs(C).max()
    strain = np.linalg.solve(C[:3], [1.0, 0.0, 0.0])
    E1, E2, G, nu = (SPRUCE[name] for name in ("E1", "E2", "G12", "nu12"))
    assert strain[0] == pytest.approx(
        c**4 / E1 + s**4 / E2 + c**2 * s**2 * (1 / G - 2 * nu / E1), rel=1e-12
    )
    coupling = (2 / E1 + 2 * nu / E1 - 1 / G) * s * c**3 - (2 / E2 + 2 * nu / E1 - 1 / G) * s**3 * c
    assert strain[2] == pytest.approx(coupling, rel=1e-12)


@pytest.mark.parametrize(
    "section, dimension", [(PlaneStress(), 2), (PlaneStrain(), 2), (Solid(), 3)]
)
def test_equal_moduli_are_isotropic_in_any_axes(section: Any, dimension: int) -> None:
    C = Orthotropic(**ISOTROPIC, axes=0.7).matrix(section, dimension)
    lame, shear = section.elastic_constants(STEEL)
    d = dimension
    exact = np.zeros(C.shape)
    exact[:d, :d] = lame
    if d == 2:
        exact[3, :2] = 0.0 if isinstance(section, PlaneStress) else lame
    exact[range(C.shape[1]), range(C.shape[1])] += [2 * shear] * d + [shear] * (C.shape[1] - d)
    assert np.abs(C - exact).max() < 1e-14 * exact.max()


def test_a_matrix_of_axes_is_the_angle() -> None:
    c, s = cos(0.3), sin(0.3)
    by_matrix = Orthotropic(**SPRUCE, axes=((c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0))).stiffness
    assert by_matrix == pytest.approx(
        Orthotropic(**SPRUCE, axes=0.3).stiffness, rel=1e-14, abs=1e-5
    )
    # axis 1 along y
    upright = Orthotropic(**SPRUCE, axes=((0.0, 0.0, 1.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)))
    assert upright.stiffness[1, 1, 1, 1] == Orthotropic(**SPRUCE).stiffness[0, 0, 0, 0]


@pytest.mark.parametrize(
    "wrong, words",
    [
        ({"nu12": 4.0}, "some strain has no positive energy"),
        ({"axes": ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, -1.0))}, "axes is not a rotation"),
        ({"axes": ((1.0, 0.1, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))}, "axes is not a rotation"),
        ({"axes": "grain"}, "the angle"),
    ],
)
def test_what_is_no_material_is_refused(wrong: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        Orthotropic(**{**SPRUCE, **wrong})


def test_axes_that_leave_the_plane_are_refused() -> None:
    c, s = cos(0.3), sin(0.3)
    tilted = Orthotropic(**SPRUCE, axes=((c, 0.0, s), (0.0, 1.0, 0.0), (-s, 0.0, c)))
    with pytest.raises(InputError, match="the body would leave its plane"):
        tilted.matrix(PlaneStrain(), 2)
    with pytest.raises(InputError, match="is for bodies in the plane or in space"):
        tilted.matrix(Solid(), 1)


def test_the_limit_of_poisson_s_ratio_is_sharp() -> None:
    """|nu12| < sqrt(E1/E2), the other ratios zero."""
    limit = (SPRUCE["E1"] / SPRUCE["E2"]) ** 0.5
    rest = {**SPRUCE, "nu13": 0.0, "nu23": 0.0}
    Orthotropic(**{**rest, "nu12": 0.999999 * limit})
    with pytest.raises(InputError, match="some strain"):
        Orthotropic(**{**rest, "nu12": 1.000001 * limit})


def test_one_retardation_time_is_stiffness_proportional() -> None:
    tau, G = 1e-3, STEEL.shear_modulus
    damping = KelvinVoigt(tau * G, tau * (STEEL.lame_lambda + 2.0 / 3.0 * G))
    lame, shear = damping.viscosities
    assert (lame, shear) == pytest.approx(
        (tau * STEEL.lame_lambda, tau * STEEL.shear_modulus), rel=1e-14
    )
    assert damping.coefficients(STEEL) == (0.0, 0.0) and Rayleigh(0.0, tau).ratio(
        1.0 / pi
    ) == pytest.approx(tau)
