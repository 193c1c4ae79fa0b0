"""The near-fault pulse against the velocity and the displacement of its source in closed form."""

import math

import numpy as np
import pytest

from vi_contact.laws import NearFaultPulse

pytestmark = pytest.mark.serial

PULSES = [
    NearFaultPulse(velocity=0.8, frequency=0.5, cycles=2.2, phase=phase, start=start)
    for phase, start in ((0.0, 0.0), (0.5 * math.pi, 0.3), (1.1, 0.7))
]


def velocity(pulse: NearFaultPulse, t: np.ndarray) -> np.ndarray:
    """The velocity of Mavroeidis and Papageorgiou (2003)."""
    f = pulse.frequency
    s = t - pulse.start - 0.5 * pulse.cycles / f
    bell = 1.0 + np.cos(2.0 * np.pi * f / pulse.cycles * s)
    return 0.5 * pulse.velocity * bell * np.cos(2.0 * np.pi * f * s + pulse.phase)


@pytest.mark.parametrize("pulse", PULSES)
def test_the_acceleration_is_the_rate_of_the_velocity(pulse: NearFaultPulse) -> None:
    """Simpson's rule on 2000 intervals is exact to 1e-12 for a function as smooth."""
    t = np.linspace(pulse.start, pulse.duration, 2001)
    h = t[1] - t[0]
    a = np.array([pulse.acceleration(one) for one in t])
    middle = np.array([pulse.acceleration(one) for one in t[:-1] + 0.5 * h])
    gained = np.concatenate([[0.0], np.cumsum(h / 6.0 * (a[:-1] + 4.0 * middle + a[1:]))])
    assert np.max(np.abs(gained - velocity(pulse, t))) < 1e-10 * pulse.velocity


@pytest.mark.parametrize("pulse", PULSES)
def test_the_displacement_that_stays(pulse: NearFaultPulse) -> None:
    """A cos(phase) sin(pi cycles) / (2 pi f (1 - cycles²)), integrated by hand."""
    t = np.linspace(pulse.start, pulse.duration, 4001)
    stays = float(np.sum(velocity(pulse, t)) * (t[1] - t[0]))  # both ends are zero
    wanted = pulse.velocity * math.cos(pulse.phase) * math.sin(math.pi * pulse.cycles)
    wanted /= 2.0 * math.pi * pulse.frequency * (1.0 - pulse.cycles**2)
    assert abs(stays - wanted) < 1e-6 * pulse.velocity / pulse.frequency


def test_it_begins_and_ends_without_a_jump() -> None:
    for pulse in PULSES:
        inside = pulse.acceleration(pulse.duration - 1e-9)
        assert pulse.acceleration(pulse.duration + 1e-9) == 0.0
        assert abs(inside) < 1e-6 * pulse.velocity * pulse.frequency
        assert pulse.acceleration(pulse.start - 1e-9) == 0.0
