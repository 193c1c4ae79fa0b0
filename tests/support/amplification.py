"""Amplify a linear oscillator over one step."""

from __future__ import annotations

import numpy as np
from bar import run
from oscillator import oscillators

from vi_contact.core.state_checks import initial_state
from vi_contact.schemes.generalised_alpha import AlphaStep


def amplification(scheme: AlphaStep, frequency: float, damping: float = 0.0) -> np.ndarray:
    """3 x 3 amplification of (u, v, a) of u'' + 2 xi w u' + w² u = 0, dt = 1: one step from each unit vector."""
    problem = oscillators(1, mass=1.0, stiffness=frequency**2, damping=2.0 * damping / frequency)
    columns = []
    for u, v, a in np.eye(3):
        state = initial_state(problem)
        zero = np.zeros(1)
        state = type(state)(0.0, 0, np.array([u]), np.array([v]), zero, state.active)
        memory = dict(scheme.start(problem, state, 1.0).memory) | {"a": np.array([a]), "reaction": zero}
        state = type(state)(0.0, 0, state.u, state.v, zero, state.active, memory)
        new = next(run(problem, scheme, dt=1.0, steps=1, state=state)).new
        columns.append([new.u[0], new.v[0], new.memory["a"][0]])
    return np.array(columns).T
