"""What every exact motion u(x, t) of a bar must satisfy, whatever its formula."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vi_contact.core.algebra import Array

Field = Callable[[Array, Array], Array]


def wave_defect(u: Field, *, length: float, c: float, until: float, force: float = 0.0) -> float:
    """Largest |u(x, t+k) + u(x, t-k) - u(x+ck, t) - u(x-ck, t) - force k²|, over random
    parallelograms in the bar.

    Zero for solutions of u_tt = c² u_xx + force, also across fronts.
    """
    random = np.random.default_rng(1)
    x, t, k = random.random((3, 4000))
    x, t = length * x, until * t
    k = np.minimum(k * np.minimum(x, length - x) / c, t)
    return np.abs(
        u(x, t + k) + u(x, t - k) - u(x + c * k, t) - u(x - c * k, t) - force * k**2
    ).max()


def derivative_defect(
    u: Field, rate: Field, *, x: Array, t: Array, h: tuple[float, float]
) -> float:
    """Largest difference of `rate` and the central difference of u with the step (dx, dt) = h; one
    of them is 0.

    Points where the rate jumps within the step are left out, but most of the (x, t) must remain.
    """
    before, after = rate(x - h[0], t - h[1]), rate(x + h[0], t + h[1])
    mean = 0.5 * (before + after)
    smooth = np.abs(after - before) <= 1e-3 * np.abs(rate(x, t)).max()
    assert smooth.mean() > 0.9
    slope = (u(x + h[0], t + h[1]) - u(x - h[0], t - h[1])) / (2.0 * sum(h))
    return np.abs(slope - mean)[smooth].max()


def energies(
    u: Field,
    v: Field,
    strain: Field,
    *,
    length: float,
    E: float,
    rho: float,
    t: Array,
    g: float = 0.0,
) -> Array:
    """Kinetic, strain and weight energy at the times t by the midpoint rule on 20000 cells; u = 0
    is the zero level."""
    x = (np.arange(20000) + 0.5)[:, np.newaxis] * length / 20000
    return length * (
        0.5 * rho * v(x, t) ** 2 + 0.5 * E * strain(x, t) ** 2 + rho * g * u(x, t)
    ).mean(axis=0)
