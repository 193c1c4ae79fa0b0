"""The particle in the boundary layer in closed form: V5.1, Figs. 1 to 3 of seed 001, and the
layer's own checks."""

from __future__ import annotations

import numpy as np
import pytest
from layer_numbers import DEEPEST, DURATION, RESTITUTION, C, K
from scipy.integrate import quad

from vi_contact.core.errors import InputError
from vi_contact.layer.layer import Layer
from vi_contact.layer.particle import ParticleImpact, damping_ratio, layer_for, restitution

pytestmark = pytest.mark.serial


def unit(k: float, c: float) -> ParticleImpact:
    """a = b = V = m = 1."""
    return ParticleImpact(Layer(1.0, k=k, c=c), mass=1.0, speed=1.0)


def test_restitution_and_duration_of_all_fifty_pairs():
    """V5.1: printed digits, and the equations they solve to 1e-12: (36) at t_f and t_c, e = tau/s -
    1."""
    for i, k in enumerate(K):
        for j, c in enumerate(C):
            impact, s = unit(k, c), c / k
            assert impact.restitution == pytest.approx(RESTITUTION[i][j], abs=5.001e-7)
            assert impact.duration == pytest.approx(DURATION[i][j], abs=5.001e-7)
            assert impact.position(impact.duration) == pytest.approx(1.0, abs=1e-12)
            assert impact.velocity(impact.duration) == pytest.approx(impact.restitution, abs=1e-12)
            assert impact.velocity(impact.compression_time) == pytest.approx(0.0, abs=1e-12)
            assert impact.position(impact.compression_time) == pytest.approx(
                impact.deepest, abs=1e-12
            )
            tau = s * (1.0 + impact.restitution)
            assert tau == pytest.approx((1.0 + s) * -np.expm1(-tau), abs=1e-12)


def test_greatest_compression():
    """V5.1: x_min."""
    for (k, c), expected in DEEPEST.items():
        assert unit(k, c).deepest == pytest.approx(expected, abs=5.001e-7)


def test_closed_form_is_that_of_the_source():
    """(36) as printed (V5.1, OCR corrected), for c > 0 and for c = 0, away from unit values."""
    m, V, a = 2.3, 1.7, 0.4
    for k, c in ((3.0, 0.8), (0.9, 2.0), (4.0, 0.0)):
        impact = ParticleImpact(Layer(0.4, k=k, c=c), mass=m, speed=V)
        t = np.linspace(0.0, impact.duration, 9)
        if c:
            decay = np.exp(-c * t / (m * V))
            beta = (V / c) ** 2 * ((k + c / a) * m * (decay - 1.0) + c * k * t / V)
            x, v = (
                a * np.exp(beta),
                V * ((1.0 / decay - 1.0) * a * k / c - 1.0) * np.exp(beta) * decay,
            )
        else:
            x = a * np.exp(-V * t / a + k * t**2 / (2.0 * m))
            v = x * (-V / a + k * t / m)
        assert impact.position(t) == pytest.approx(x, abs=1e-12)
        assert impact.velocity(t) == pytest.approx(v, abs=1e-12)


def test_closed_form_satisfies_the_equation_of_motion():
    """(35): d/dt [b² m v/x²] + b² m v²/x³ - k̂/x + ĉ v/x² = 0, by differences along (36)."""
    impact = unit(2.0, 1.3)
    t, h = 0.37 * impact.duration, 1e-5

    def momentum(t: float) -> float:
        return float(impact.velocity(t) / impact.position(t) ** 2)

    x, v = float(impact.position(t)), float(impact.velocity(t))
    residual = (
        (momentum(t + h) - momentum(t - h)) / (2.0 * h)
        + v**2 / x**3
        - float(impact.boundary_force(t))
    )
    assert abs(residual) < 1e-8


@pytest.mark.promise("theory/boundary_layer.md", "both are exactly equal")
def test_newton_and_poisson():
    """(37), (38), V5.1: equal for the force on the particle, virtually indistinguishable for the
    covector force."""
    for (k, c), expected in {
        (1.0, 1.0): 0.609461,
        (1.0, 5.0): 0.204157,
        (10.0, 1.0): 0.937947,
    }.items():
        impact = unit(k, c)
        assert impact.poisson == pytest.approx(impact.restitution, abs=1e-12)
        assert impact.poisson_covector == pytest.approx(expected, abs=5.001e-7)
        assert 0.0 < impact.poisson_covector - impact.restitution < 0.02
    assert unit(3.0, 0.0).poisson_covector == pytest.approx(1.0, abs=1e-9)


def test_statements_of_the_figures():
    """Figs. 1 and 2 (V5.1): x_min grows with k and c, t_f falls with both, e grows with k and falls
    with c; symmetry about t_c without dissipation."""
    table = {
        name: np.array([[getattr(unit(k, c), name) for c in C] for k in K])
        for name in ("deepest", "duration", "restitution")
    }
    assert np.all(np.diff(table["deepest"], axis=0) > 0.0) and np.all(
        np.diff(table["deepest"], axis=1) > 0.0
    )
    assert np.all(np.diff(table["duration"], axis=0) < 0.0) and np.all(
        np.diff(table["duration"], axis=1) < 0.0
    )
    assert np.all(np.diff(table["restitution"][:, 1:], axis=0) > 0.0)
    assert np.all(np.diff(table["restitution"], axis=1) < 0.0) and np.all(
        table["restitution"][:, 0] == 1.0
    )
    for k in K:
        impact = unit(k, 0.0)
        t = np.linspace(0.0, impact.compression_time, 7)
        assert impact.duration == 2.0 * impact.compression_time
        assert impact.position(impact.duration - t) == pytest.approx(impact.position(t), abs=1e-12)
    for k in K:
        impact = unit(k, 2.0)  # with dissipation compression is the shorter part
        assert impact.compression_time < 0.5 * impact.duration


def test_limits_of_the_restitution():
    """e -> 1 - 2/3 s for small s, without loss of digits; e -> 1/s for large s."""
    assert restitution(0.0) == 1.0
    for s in (1e-12, 1e-9, 1e-6):
        assert restitution(s) == pytest.approx(1.0 - 2.0 / 3.0 * s, abs=2.0 * s**2 + 3e-16)
    assert restitution(60.0) == pytest.approx(1.0 / 60.0, rel=1e-12)
    assert restitution(1.0 - 1e-12) == pytest.approx(restitution(1.0 + 1e-12), abs=1e-11)


def test_wanted_restitution():
    """The inverse of e(s), and the layer made from it, at any scale."""
    for e in (1e-3, 0.05, 0.5, 0.593624, 0.9, 0.999999, 1.0):
        assert restitution(damping_ratio(e)) == pytest.approx(e, abs=1e-13)
        layer = layer_for(e, mass=70.0, speed=3.0, width=1e-3, start=4e-4, deepest=0.25)
        impact = ParticleImpact(layer, mass=70.0, speed=3.0)
        assert impact.restitution == pytest.approx(e, abs=1e-12)
        assert impact.deepest == pytest.approx(1e-4, rel=1e-10)


def test_only_the_ratio_of_the_speeds_counts():
    """A particle of another speed than the law's V: c is that many times as large; k = c = b = m =
    V = 1, U = 2."""
    layer = Layer(1.0, k=1.0, c=1.0, speed=1.0)
    assert ParticleImpact(layer, 1.0, 2.0).restitution == pytest.approx(restitution(2.0), abs=1e-15)
    assert ParticleImpact(Layer(1.0, k=1.0, c=1.0), 1.0, 2.0).restitution == pytest.approx(
        restitution(1.0), abs=1e-15
    )


def test_cut_off():
    """(25): 1 up to a, 0 from b on, ½ in the middle, antisymmetric about it, smooth."""
    layer = Layer(2.0, k=1.0, start=1.0)
    x = np.array([0.5, 1.0, 1.25, 1.5, 1.75, 2.0, 3.0])
    f = np.exp(-1.0 / np.array([0.25, 0.75]))
    assert layer.cut_off(x) == pytest.approx(
        [1.0, 1.0, f[1] / f.sum(), 0.5, f[0] / f.sum(), 0.0, 0.0], abs=1e-15
    )
    assert quad(lambda x: float(layer.cut_off(x)), 1.0, 2.0)[0] == pytest.approx(0.5, abs=1e-12)
    assert (
        layer.at(1.0).force(0.5, 0.0) == pytest.approx(8.0)
        and layer.at(1.0).force(2.5, -1.0) == 0.0
    )
    assert Layer(2.0, k=1.0).cut_off(np.array([2.0, 2.001])).tolist() == [1.0, 0.0]


@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: Layer(0.0, k=1.0), "layer width b is 0.0"),
        (lambda: Layer(1.0, k=-1.0), "parameter k is -1.0"),
        (lambda: Layer(1.0, k=1.0, c=float("nan")), "parameter c is nan"),
        (lambda: Layer(1.0, k=0.0), "k and c are both zero"),
        (lambda: Layer(1.0, k=1.0, speed=0.0), "layer speed V is 0.0"),
        (lambda: Layer(1.0, k=1.0, start=1.5), "layer start a is 1.5"),
        (lambda: Layer(1.0, k=1.0, c=1.0).v, "V is not given"),
        (lambda: ParticleImpact(Layer(1.0, k=0.0, c=1.0), 1.0, 1.0), "k is zero"),
        (lambda: ParticleImpact(Layer(1.0, k=1.0), -1.0, 1.0), "mass is -1.0"),
        (lambda: ParticleImpact(Layer(1.0, k=1.0), 1.0, 0.0), "speed is 0.0"),
        (lambda: restitution(-0.1), "damping ratio"),
        (lambda: damping_ratio(1.2), "restitution coefficient e is 1.2"),
        (lambda: damping_ratio(0.0), "restitution coefficient e is 0.0"),
        (lambda: layer_for(0.5, mass=1.0, speed=1.0, width=1.0, deepest=1.0), "deepest is 1.0"),
    ],
)
def test_parameters_outside_their_range(make, word):
    with pytest.raises(InputError, match=word):
        make()
