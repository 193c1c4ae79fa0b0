"""Solve contact of a bar by another form of the same step."""

from __future__ import annotations

import numpy as np
from oscillator import dense


def kane(problem, u, v, dt: float):
    """(u, v, r) after a step of Kane's rule: trapezoidal elastic forces, contact force at the new
    time; one contact on the last unknown."""
    M, _, K = dense(problem)
    gap, f = problem.surface.gap0[0], problem.system.load.constant
    A = np.linalg.inv(M + dt**2 / 4.0 * K)
    free = A @ (M @ (u + dt * v) + dt**2 / 4.0 * (2.0 * f - K @ u))
    r = max((free[-1] - gap) / (0.5 * dt**2 * A[-1, -1]), 0.0)
    new = free - 0.5 * dt**2 * r * A[:, -1]
    force = f - 0.5 * K @ (u + new)
    force[-1] -= r
    return new, v + dt * np.linalg.solve(M, force), r
