"""Metamorphic tests of whole runs (section 9 of the verification document): no reference is
needed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bar import run
from chain import chain_problem
from shaken import SHAKE, changes, shaken

from vi_contact.core.errors import InputError
from vi_contact.core.state_checks import initial_state
from vi_contact.laws.impact import Elastic, Inelastic
from vi_contact.schemes.linear_multistep import LinearMultistep
from vi_contact.schemes.ss22 import SS22
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor

pytestmark = pytest.mark.serial
HALF = ZienkiewiczWoodTaylor()
SCHEMES = [HALF, SS22(0.6, 0.7), LinearMultistep.newmark()]


@pytest.mark.parametrize("scheme", SCHEMES, ids=lambda s: type(s).__name__)
@pytest.mark.parametrize(
    "impact", [None, Inelastic(), Elastic()], ids=["none", "inelastic", "elastic"]
)
def test_positive_homogeneity(scheme, impact):
    """Loads, gap and base motion times 2.5: everything times 2.5, to 1e-12."""
    one = list(run(shaken(impact), scheme, dt=5e-3, steps=50))
    more = list(
        run(
            shaken(impact, gap=0.025, excitation=replace(SHAKE, amplitude=-75.0)),
            scheme,
            dt=5e-3,
            steps=50,
        )
    )
    assert changes(one) >= 2
    for name in ("u", "v", "r_n"):
        biggest = max(np.abs(getattr(report.new, name)).max() for report in one)
        for a, b in zip(one, more, strict=True):
            assert (
                np.abs(getattr(b.new, name) - 2.5 * getattr(a.new, name)).max()
                <= 1e-12 * 2.5 * biggest
            )


@pytest.mark.parametrize("scheme", SCHEMES, ids=lambda s: type(s).__name__)
@pytest.mark.parametrize("gap", [0.0, 0.3])
def test_zero_stays_zero(scheme, gap):
    for report in run(chain_problem(4, gap=gap, impact=Inelastic()), scheme, dt=0.01, steps=5):
        assert not report.new.u.any() and not report.new.v.any() and not report.new.r_n.any()
        assert report.certificate.worst == 0.0 and not report.new.active.any()


@pytest.mark.parametrize("scheme", SCHEMES, ids=lambda s: type(s).__name__)
def test_translation_of_the_time_origin(scheme):
    """The same shaking one period (1/3 s) later, started one period later."""
    start = initial_state(shaken())
    now = list(run(shaken(Inelastic()), scheme, dt=5e-3, steps=60, state=start))
    later = list(
        run(shaken(Inelastic()), scheme, dt=5e-3, steps=60, state=replace(start, t=1.0 / 3.0))
    )
    assert changes(now) >= 2
    assert later[-1].new.t == pytest.approx(0.3 + 1.0 / 3.0)
    for a, b in zip(now, later, strict=True):
        np.testing.assert_allclose(b.new.u, a.new.u, atol=1e-10 * 0.1)
        np.testing.assert_array_equal(b.new.active, a.new.active)


def test_a_gap_that_never_closes_is_no_contact():
    """gap -> infinity, also literally: the linear run, bit for bit the same r_n = 0."""
    wide = list(run(shaken(gap=1e3), HALF, dt=5e-3, steps=100))
    none = list(run(shaken(gap=np.inf), HALF, dt=5e-3, steps=100))
    np.testing.assert_array_equal(none[-1].new.u, wide[-1].new.u)
    assert not any(report.new.r_n.any() for report in none)
    assert max(report.certificate.worst for report in none) <= 1e-12


def test_units_do_not_matter():
    """Metres or millimetres (K, M in N/mm, t): the same motion, contacts and certificates of the
    same size."""
    metres = list(run(shaken(), HALF, dt=5e-3, steps=60))
    mm = shaken(gap=10.0, mass=2e-3, stiffness=20.0, excitation=replace(SHAKE, amplitude=-3e4))
    for one, other in zip(metres, run(mm, HALF, dt=5e-3, steps=60), strict=True):
        np.testing.assert_allclose(other.new.u, 1e3 * one.new.u, rtol=1e-9, atol=1e-9)
        np.testing.assert_array_equal(other.new.active, one.new.active)
        assert other.certificate.worst <= 1e-14


@pytest.mark.parametrize("impact", [None, Inelastic()], ids=["none", "inelastic"])
def test_mirror_symmetry(impact):
    """A free chain between two walls: shaken the other way, with the gaps exchanged, it moves the
    other way."""
    right = chain_problem(
        5, gap=0.02, left_gap=0.01, floating=True, stiffness=2e4, excitation=SHAKE, impact=impact
    )
    back = replace(SHAKE, amplitude=-SHAKE.amplitude)
    left = chain_problem(
        5, gap=0.01, left_gap=0.02, floating=True, stiffness=2e4, excitation=back, impact=impact
    )
    reports = list(run(right, HALF, dt=5e-3, steps=100))
    assert changes(reports) > 5
    for one, other in zip(reports, run(left, HALF, dt=5e-3, steps=100), strict=True):
        u, mirrored = right.cartesian(one.new.u), left.cartesian(other.new.u)
        np.testing.assert_allclose(mirrored, -u[::-1], atol=1e-10 * 0.02)
        np.testing.assert_allclose(other.new.r_n, one.new.r_n[::-1], atol=1e-8 * 100.0)


def test_doubled_condition_has_no_effect():
    """The same bound twice would be two reactions for one motion: refused by name, not shared at
    random."""
    problem = shaken()
    surface = problem.surface
    twice = {
        name: np.repeat(getattr(surface, name), 2, axis=0)
        for name in (
            "points",
            "normals",
            "weights",
            "gap0",
            "bilateral",
            "compliance",
            "owned",
            "tangents",
        )
    }
    problem = replace(problem, surface=replace(surface, **twice, slots=np.array([0, 1])))
    with pytest.raises(InputError, match="remove constraints that act on the same motion twice"):
        list(run(problem, HALF, dt=5e-3, steps=1))
