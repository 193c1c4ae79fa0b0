"""Amplify a linear oscillator over one step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from bar import run
from oscillator import uncoupled

from vi_contact.core.state_checks import initial_state
from vi_contact.schemes.generalised_alpha import AlphaStep


def amplification(scheme: AlphaStep, frequency: float, damping: float = 0.0) -> np.ndarray:
    """3 x 3 amplification of (u, v, a) of u'' + 2 xi w u' + w² u = 0, dt = 1: one step from each
    unit vector."""
    problem = uncoupled(3, frequency=frequency, damping=damping)
    u, v, a = np.eye(3)
    state = replace(initial_state(problem), u=u, v=v)
    memory = dict(scheme.start(problem, state, 1.0).memory) | {"a": a, "reaction": np.zeros(3)}
    new = next(run(problem, scheme, dt=1.0, steps=1, state=replace(state, memory=memory))).new
    return np.array([new.u, new.v, new.memory["a"]])
