"""Materials, sections and damping against closed forms and published numbers."""

import math

import pytest

from vi_contact.core.errors import InputError
from vi_contact.laws.materials import (
    LinearElastic,
    MassProportional,
    NoDamping,
    PlaneStrain,
    PlaneStress,
    Rayleigh,
    Solid,
)

pytestmark = pytest.mark.serial

STEEL = LinearElastic(E=2.1e11, nu=0.3, rho=7850.0)


def close(value, exact):
    return math.isclose(value, exact, rel_tol=1e-14)


def test_lame_constants_of_nu_one_quarter_are_equal():
    material = LinearElastic(E=2.5e9, nu=0.25, rho=1000.0)
    assert close(material.lame_lambda, 1e9) and close(material.shear_modulus, 1e9)
    assert close(material.c_p, math.sqrt(3e6)) and close(material.c_s, 1e3)


def test_pressure_waves_are_those_of_a_bar_without_lateral_strain():
    """nu = 0: c_p = sqrt(E / rho) = sqrt(2) c_s."""
    material = LinearElastic(E=2.0e10, nu=0.0, rho=2400.0)
    assert close(material.c_p, math.sqrt(2.0e10 / 2400.0))
    assert close(material.c_p, math.sqrt(2.0) * material.c_s)


def test_concrete_on_steel_from_its_wave_speeds():
    """verification.md section 7: c_p = 3253, c_s = 1992 m/s, rho = 2400 give nu = 0.2000, E =
    22.857 GPa.

    The exact E = rho c_s² (3 c_p² - 4 c_s²) / (c_p² - c_s²) is 22.8565 GPa: one unit of the last
    digit is allowed.
    """
    concrete = LinearElastic.from_wave_speeds(3253.0, 1992.0, 2400.0)
    assert abs(concrete.nu - 0.2000) < 5e-5 and abs(concrete.E - 22.857e9) < 1e6
    assert close(
        concrete.E, 2400.0 * 1992.0**2 * (3 * 3253.0**2 - 4 * 1992.0**2) / (3253.0**2 - 1992.0**2)
    )
    assert close(concrete.c_p, 3253.0) and close(concrete.c_s, 1992.0)


def test_pressed_square_has_nu_one_third():
    material = LinearElastic.from_wave_speeds(1.0, 0.5, 1.0)
    assert close(material.nu, 1.0 / 3.0) and close(material.shear_modulus, 0.25)


@pytest.mark.parametrize(
    "E, nu, rho, word",
    [
        (0.0, 0.2, 1.0, "E [Pa]"),
        (1.0, 0.5, 1.0, "between -1 and 0.5"),
        (1.0, -1.0, 1.0, "between -1 and 0.5"),
    ],
)
def test_material_out_of_range_is_named(E, nu, rho, word):
    with pytest.raises(InputError, match=word.replace("[", r"\[").replace("]", r"\]")):
        LinearElastic(E=E, nu=nu, rho=rho)


@pytest.mark.parametrize(
    "c_p, c_s", [(1.0, 1.0), (math.sqrt(4.0 / 3.0) * 0.999, 1.0), (0.0, 1.0), (2.0, math.nan)]
)
def test_impossible_wave_speeds_are_refused(c_p, c_s):
    with pytest.raises(InputError, match="c_[ps]"):
        LinearElastic.from_wave_speeds(c_p, c_s, 1.0)


def test_plane_stress_constants_are_those_of_hookes_law():
    """sigma_xx = E / (1 - nu²) (eps_xx + nu eps_yy) in a panel (Timoshenko and Goodier)."""
    lame, shear = PlaneStress(thickness=0.2).elastic_constants(STEEL)
    assert close(lame + 2.0 * shear, 2.1e11 / 0.91) and close(lame, 0.3 * 2.1e11 / 0.91)


def test_uniaxial_plane_stress_returns_youngs_modulus():
    lame, shear = PlaneStress().elastic_constants(STEEL)
    lateral = -STEEL.nu
    assert close(lame * (1.0 + lateral) + 2.0 * shear, STEEL.E)
    assert abs(lame * (1.0 + lateral) + 2.0 * shear * lateral) < 1e-15 * STEEL.E * 10


def test_plane_strain_and_solid_use_the_lame_constants():
    lame = (STEEL.lame_lambda, STEEL.shear_modulus)
    assert PlaneStrain().elastic_constants(STEEL) == lame == Solid().elastic_constants(STEEL)
    assert (PlaneStrain().thickness, PlaneStress(0.2).thickness, Solid().thickness) == (
        1.0,
        0.2,
        1.0,
    )


def test_damping_coefficients_of_the_three_laws():
    """Seed 000 eq. 7: the force c u' per unit volume is c / rho times the mass matrix."""
    assert NoDamping().coefficients(STEEL) == (0.0, 0.0)
    assert MassProportional(c=785.0).coefficients(STEEL) == (0.1, 0.0)
    assert Rayleigh(alpha=0.5, beta=1e-3).coefficients(STEEL) == (0.5, 1e-3)


def test_rayleigh_five_percent_at_one_and_ten_hertz():
    """seismic.md 2.4: alpha = 0.5712 1/s, beta = 1.4469e-3 s, smallest ratio 2.87 % at 3.16 Hz."""
    damping = Rayleigh.from_frequencies(1.0, 10.0, xi1=0.05, xi2=0.05)
    assert abs(damping.alpha - 0.5712) < 5e-5 and abs(damping.beta - 1.4469e-3) < 5e-8
    f_min = math.sqrt(damping.alpha / damping.beta) / (2.0 * math.pi)
    assert abs(f_min - 3.16) < 5e-3 and abs(damping.ratio(f_min) - 0.0287) < 5e-5
    assert close(damping.ratio(f_min), math.sqrt(damping.alpha * damping.beta))


@pytest.mark.parametrize(
    "f1, f2, xi1, xi2", [(1.0, 10.0, 0.05, 0.05), (2.0, 7.0, 0.02, 0.06), (7.0, 2.0, 0.06, 0.02)]
)
def test_rayleigh_has_the_two_ratios_asked_for(f1, f2, xi1, xi2):
    damping = Rayleigh.from_frequencies(f1, f2, xi1=xi1, xi2=xi2)
    assert close(damping.ratio(f1), xi1) and close(damping.ratio(f2), xi2)


def test_rayleigh_at_the_ends_of_the_possible_range():
    """Ratios proportional to f need alpha = 0, to 1/f beta = 0; round-off must not make them
    negative."""
    for f1, f2 in [(0.3, 7.7), (1.1, 3.3), (2.3, 2.9)]:
        stiffness = Rayleigh.from_frequencies(f1, f2, xi1=0.01 * f1, xi2=0.01 * f2)
        mass = Rayleigh.from_frequencies(f1, f2, xi1=0.01 / f1, xi2=0.01 / f2)
        assert stiffness.alpha <= 1e-12 and close(stiffness.beta, 0.01 / math.pi)
        assert mass.beta <= 1e-12 and close(mass.alpha, 0.04 * math.pi)


@pytest.mark.parametrize(
    "f1, f2, xi1, xi2, word",
    [
        (1.0, 10.0, 0.05, 0.6, "negative coefficient"),
        (1.0, 10.0, 0.6, 0.05, "negative coefficient"),
        (2.0, 2.0, 0.05, 0.05, "two frequencies"),
    ],
)
def test_rayleigh_without_solution_is_refused(f1, f2, xi1, xi2, word):
    with pytest.raises(InputError, match=word):
        Rayleigh.from_frequencies(f1, f2, xi1=xi1, xi2=xi2)


def test_a_mode_without_a_frequency_has_no_ratio():
    with pytest.raises(InputError, match=r"Rayleigh.ratio: the frequency f \[Hz\] is 0.0"):
        Rayleigh(alpha=1.0, beta=0.0).ratio(0.0)


def test_numbers_of_no_material_are_refused():
    """Their squares would be no numbers any more."""
    for wrong in ({"rho": 1e300}, {"E": 1e101}, {"rho": 1e-200}):
        with pytest.raises(
            InputError, match="no material has E .*; give numbers between 1e-100 and 1e\\+100"
        ):
            LinearElastic(**({"E": 1.0, "nu": 0.0, "rho": 1.0} | wrong))


def test_functions_of_the_place_are_another_material() -> None:
    with pytest.raises(InputError, match=r"numbers; give fem\.Heterogeneous\(E, nu, rho, xi\)"):
        LinearElastic(E=lambda x: 2.0e10 * (1.0 + x[0]), nu=0.3, rho=2400.0)  # type: ignore
