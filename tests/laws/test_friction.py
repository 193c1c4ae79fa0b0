"""Friction limits and the projection onto the friction disk."""

import math

import numpy as np
import pytest

from vi_contact.core.errors import InputError
from vi_contact.core.protocols import Frictionless
from vi_contact.laws.friction import (
    Coulomb,
    ExponentialDecay,
    SlipRateCoulomb,
    StaticKinetic,
    Tresca,
    project,
)

pytestmark = pytest.mark.serial

R_N = np.array([0.0, 2.0, -1e-9, 5.0])
WEIGHTS = np.array([0.5, 1.0, 1.0, 0.5])


def test_frictionless_limit_is_zero():
    assert np.array_equal(Frictionless().limit(R_N, WEIGHTS, 1.0), np.zeros(4))


def test_tresca_limit_is_stress_times_weight_times_scale_whatever_the_pressure():
    assert np.array_equal(Tresca(100.0).limit(R_N, WEIGHTS, 1.0), [50.0, 100.0, 100.0, 50.0])
    assert np.array_equal(Tresca(100.0).limit(R_N, WEIGHTS, 0.25), [12.5, 25.0, 25.0, 12.5])


def test_coulomb_limit_follows_the_reaction_and_needs_no_scale():
    for scale in (1.0, 1e-3):
        assert np.array_equal(Coulomb(0.5).limit(R_N, WEIGHTS, scale), [0.0, 1.0, 0.0, 2.5])


@pytest.mark.parametrize("law", [Tresca, Coulomb])
@pytest.mark.parametrize("value", [-0.1, math.nan, math.inf, "0.3"])
def test_bad_coefficient_is_refused(law, value):
    with pytest.raises(InputError, match="give zero or a positive finite number"):
        law(value)


def test_a_field_has_one_value_per_point():
    """Given as any sequence, kept as a tuple: laws stay comparable. Wrong counts are told when
    used."""
    law = Coulomb(np.array([0.0, 0.5, 0.5, 1.0]))
    assert law == Coulomb([0.0, 0.5, 0.5, 1.0]) and law.mu == (0.0, 0.5, 0.5, 1.0)
    assert np.array_equal(law.limit(R_N, WEIGHTS, 1.0), [0.0, 1.0, 0.0, 5.0])
    assert np.array_equal(law.slope(WEIGHTS), [0.0, 0.5, 0.5, 1.0])
    assert np.array_equal(
        Tresca((4.0, 3.0, 2.0, 1.0)).limit(R_N, WEIGHTS, 2.0), [4.0, 6.0, 4.0, 1.0]
    )
    for wrong in (Coulomb((0.3, 0.3)), Tresca((0.3, 0.3))):
        with pytest.raises(InputError, match="has 2 values but there are 4 contact points"):
            wrong.limit(R_N, WEIGHTS, 1.0)


@pytest.mark.parametrize("value", [[0.3, -0.1], np.array([0.3, math.nan]), np.eye(2), None])
def test_bad_fields_are_refused(value):
    for law in (Coulomb, Tresca):
        with pytest.raises(InputError, match="or one per point"):
            law(value)


def test_limits_are_affine_in_the_pressure():
    """limit = cohesion + slope max(r_n, 0), what the solvers use."""
    for law in (Frictionless(), Tresca(100.0), Coulomb(0.5), Coulomb((0.1, 0.2, 0.3, 0.4))):
        cohesion = law.limit(np.zeros(4), WEIGHTS, 0.5)
        expected = cohesion + law.slope(WEIGHTS) * np.maximum(R_N, 0.0)
        assert np.array_equal(law.limit(R_N, WEIGHTS, 0.5), expected)


def test_laws_without_rates_stay_themselves():
    for law in (Frictionless(), Tresca(100.0), Coulomb(0.5)):
        assert law.at(np.ones(4)) is law


def test_coefficients_of_slip_rates():
    """mu_s at rest, mu_k far beyond v_c, their mean at v_c ln 2; a jump; any function, any number
    of values."""
    v = np.array([0.0, 0.1 * math.log(2.0), 10.0])
    decay = ExponentialDecay(mu_s=0.6, mu_k=0.4, v_c=0.1)
    np.testing.assert_allclose(decay(v), [0.6, 0.5, 0.4], rtol=1e-15)
    np.testing.assert_array_equal(StaticKinetic(0.6, 0.4)(v), [0.6, 0.4, 0.4])
    np.testing.assert_array_equal(StaticKinetic((0.6, 0.7, 0.8), 0.4)(v), [0.6, 0.4, 0.4])
    law = SlipRateCoulomb(decay)
    assert law.at(v) == Coulomb(decay(v)) and law == SlipRateCoulomb(
        ExponentialDecay(0.6, 0.4, 0.1)
    )
    assert np.array_equal(law.slope(WEIGHTS), np.full(4, 0.6))
    assert np.array_equal(law.limit(R_N, WEIGHTS, 1.0), 0.6 * np.maximum(R_N, 0.0))
    assert SlipRateCoulomb(lambda v: 0.3).at(v) == Coulomb((0.3, 0.3, 0.3))


@pytest.mark.parametrize(
    "wrong, message",
    [
        (lambda: SlipRateCoulomb(0.3), "mu is 0.3; give a function"),
        (
            lambda: SlipRateCoulomb(lambda v: 0.3 - v).at(np.array([0.1, 0.5])),
            r"mu\(0.5 m/s\) is -0.2; let it return zero",
        ),
        (lambda: SlipRateCoulomb(lambda v: v / 0.0 * 0.0).slope(WEIGHTS), r"mu\(0 m/s\) is nan"),
        (
            lambda: SlipRateCoulomb(lambda v: np.zeros(3)).slope(WEIGHTS),
            r"shape \(3,\) for 4 slip rates",
        ),
        (
            lambda: ExponentialDecay(-0.1, 0.3, 0.1),
            "static coefficient mu_s is -0.1; give zero or a positive",
        ),
        (lambda: ExponentialDecay(0.6, math.nan, 0.1), "kinetic coefficient mu_k is nan"),
        (lambda: ExponentialDecay(0.6, 0.3, 0.0), "v_c .* is 0.0; give a positive speed"),
        (lambda: StaticKinetic(0.3, 0.6), "give mu_s >= mu_k"),
        (lambda: StaticKinetic((0.3, 0.6), (0.1, 0.1, 0.1)), "2 mu_s and 3 mu_k; give as many"),
        (
            lambda: ExponentialDecay((0.6, 0.5), 0.3, 0.1)(np.zeros(4)),
            "has 2 values but there are 4 contact points",
        ),
    ],
)
@pytest.mark.filterwarnings("ignore:invalid value")
def test_bad_laws_of_rates_are_refused(wrong, message):
    with pytest.raises(InputError, match=message):
        wrong()


def test_projection_in_two_dimensions_is_clipping():
    r_t, limit = np.array([[3.0], [-3.0], [0.5], [0.0]]), np.array([1.0, 2.0, 1.0, 0.0])
    assert np.array_equal(project(r_t, limit), [[1.0], [-2.0], [0.5], [0.0]])


def test_projection_in_three_dimensions_keeps_the_direction():
    r_t, limit = (
        np.array([[3.0, 4.0], [3.0, -4.0], [0.3, 0.4], [1.0, 1.0]]),
        np.array([10.0, 2.5, 0.0, math.inf]),
    )
    assert np.array_equal(project(r_t, limit), [[3.0, 4.0], [1.5, -2.0], [0.0, 0.0], [1.0, 1.0]])


def test_projection_is_the_nearest_point_of_the_disk():
    """Its variational inequality: (r - p)·(q - p) <= 0 for every q of the disk."""
    rng = np.random.default_rng(0)
    r_t, q = rng.normal(size=(200, 2)), rng.normal(size=(200, 2))
    limit = rng.uniform(0.1, 1.0, 200)
    p, q = project(r_t, limit), project(q, limit)
    assert np.all(np.linalg.norm(p, axis=1) <= limit * (1.0 + 1e-15 * 4))
    assert np.max(np.sum((r_t - p) * (q - p), axis=1)) <= 1e-14


def test_projection_leaves_its_argument_alone():
    r_t = np.array([[3.0]])
    project(r_t, np.array([1.0]))
    assert r_t[0, 0] == 3.0


@pytest.mark.parametrize(
    "r_t, limit",
    [
        (np.zeros(3), np.zeros(3)),
        (np.zeros((3, 1)), np.zeros(2)),
        (np.zeros((3, 1)), np.zeros((3, 1))),
    ],
)
def test_shapes_that_do_not_match_are_refused(r_t, limit):
    with pytest.raises(InputError, match="one limit per node"):
        project(r_t, limit)
