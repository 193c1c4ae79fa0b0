"""The slip of a rigid block on a shaken plane, against solutions of its own and small steps."""

from __future__ import annotations

import numpy as np
import pytest
from newmark_block import SlidingBlock

from vi_contact.core.algebra import Array
from vi_contact.practice.engineering.checks.rigid_slip import slide

pytestmark = pytest.mark.serial
G = 9.81
T = np.linspace(0.0, 10.0, 2001)


def noise(seed: int, size: float = 8.0) -> Array:
    white = np.random.default_rng(seed).standard_normal(len(T))
    return np.asarray(size * np.convolve(white, np.ones(20) / 20.0, "same"))


def by_small_steps(t: Array, w: Array, r: Array, *, one_sided: bool, parts: int) -> Array:
    """The same law with the velocity taken back by r in each of many steps."""
    u, slip, speed = np.zeros(len(t)), 0.0, 0.0
    share = (np.arange(parts) + 0.5) / parts
    for row, length in enumerate(np.diff(t) / parts):
        push, hold = (length * (x[row] + share * (x[row + 1] - x[row])) for x in (w, r))
        for gain, most in zip(push.tolist(), hold.tolist(), strict=True):
            free = speed + gain
            new = max(free - most, 0.0) - (0.0 if one_sided else max(-free - most, 0.0))
            slip, speed = slip + 0.5 * length * (speed + new), new
        u[row + 1] = slip
    return u


@pytest.mark.parametrize("mu", [1e-6, 0.02, 0.15, 0.3, 0.6])
@pytest.mark.parametrize("seed", [1, 2])
def test_level_base_is_exact(mu: float, seed: int) -> None:
    """Constant friction: the history of a solution in pieces that finds every start and stop, to
    1e-9 of the largest slip and 1e-12 m."""
    a = noise(seed)
    exact = SlidingBlock(mu, G).history(T, a)[0]
    found = slide(T, -a, np.full(len(T), mu * G))
    assert np.abs(found - exact).max() <= 1e-9 * np.abs(exact).max() + 1e-12
    assert (np.abs(exact).max() > 0.0) == (np.abs(a).max() > mu * G)


@pytest.mark.parametrize("one_sided", [True, False])
def test_friction_that_changes(one_sided: bool) -> None:
    """A plane that is shaken up and down too: small steps come nearer with their length, of the
    slips of 0.86 and 0.67 m to 2e-4 (measured 5e-5 where it turns back, 1e-6 to one side)."""
    w, r = noise(3), np.maximum(0.1 * (G + noise(4, 20.0)), 0.0)
    found = slide(T, w, r, one_sided=one_sided)
    errors = [
        np.abs(by_small_steps(T, w, r, one_sided=one_sided, parts=parts) - found).max()
        for parts in (8, 32)
    ]
    size = np.abs(found).max()
    assert errors[1] < 0.4 * errors[0] and errors[1] < (4e-6 if one_sided else 2e-4) * size
    if one_sided:
        assert np.all(np.diff(found) >= 0.0)


def test_jumps_and_short_records() -> None:
    """A time given twice is a jump: a pulse of a for t1, slip ½ a t1² (a/(mu g) - 1); nothing moves
    in a record of one row or below the threshold."""
    t = np.array([0.0, 0.5, 0.5, 2.0])
    w = -4.0 * np.array([1.0, 1.0, 0.0, 0.0])
    r = np.full(4, 2.0)
    wanted = 0.5 * 4.0 * 0.5**2 * (4.0 / 2.0 - 1.0)
    found = slide(t, w, r)
    assert found[-1] == pytest.approx(-wanted, rel=1e-14)
    assert found[1] == found[2] == pytest.approx(-0.5 * 2.0 * 0.5**2, rel=1e-14)
    assert slide(t, -w, r, one_sided=True)[-1] == pytest.approx(wanted, rel=1e-14)
    assert not slide(t, w, r, one_sided=True).any()
    assert slide(t[:1], w[:1], r[:1]).tolist() == [0.0]
    assert not slide(t, 0.5 * w, r).any()
    assert not slide(t, w, 0.0 * r - w * 1.0).any()  # |w| = r holds


def test_a_slide_that_lasts_to_the_end() -> None:
    """Without friction u is the double integral of w."""
    w = 1.0 + 0.5 * T
    found = slide(T, w, 0.0 * T)
    assert np.allclose(found, 0.5 * T**2 + T**3 / 12.0, rtol=1e-12)
