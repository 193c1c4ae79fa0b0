"""Waves that a load at the foot of a uniform bar or layer sends to its free top and back.

With z the impedance rho c, T = length / c and p(t) the traction on the foot x = 0 (zero for t < 0), the motion is that
of the rigid free body plus q(x, t) / z, where

    q_tt = c² q_xx,   q_x(length, t) = 0,   c q_x(0, t) = -p(t),
    q(x, t) = sum over k >= 0 of P(t - 2kT - x/c) + P(t - 2(k+1)T + x/c),      P(t) = integral of p from 0 to t

(d'Alembert; every term after the first of k = 0 is one more reflection). Replacing P by p gives q_t.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..core.algebra import Array

History = Callable[[Array], Array]


def reflected(history: History, delay: Array, t: Array, *, crossing: float) -> Array:
    """sum over k of history(t - 2k crossing - delay) + history(t - 2(k+1) crossing + delay).

    history: P [Pa s] or p [Pa], must vanish for negative times; delay = x/c [s]; t [s], of shapes that broadcast;
    crossing T [s]. Returns the unit of history, in the broadcast shape.
    """
    total = np.zeros(np.broadcast(delay, t).shape)
    for k in range(int(np.max(t, initial=0.0) / (2.0 * crossing)) + 1):
        total += history(t - 2 * k * crossing - delay) + history(t - 2 * (k + 1) * crossing + delay)
    return total
