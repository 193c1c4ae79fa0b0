"""Oscillators without contact: exact motion, amplification and observed order of time schemes."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import scipy.sparse as sp
from bar import run
from chain import chain_problem
from scipy.linalg import expm

from vi_contact.core.algebra import SerialMatrix
from vi_contact.core.problem import ContactProblem
from vi_contact.core.step import State
from vi_contact.laws.excitation import Harmonic

FAR = 1e6  # gap that never closes
SHAKEN = Harmonic(amplitude=3.0, frequency=0.7, phase=0.4, direction=(1.0,))


def oscillators(n: int = 3, **system: Any) -> ContactProblem:
    """n masses in motion, far from their wall; keywords as for chain_problem."""
    v0 = np.linspace(1.0, -0.5, n)
    u0 = np.linspace(0.0, 0.3, n)
    settings: dict[str, Any] = {"gap": FAR, "mass": 2.0, "stiffness": 50.0, "u0": u0, "v0": v0}
    return chain_problem(n, **(settings | system))


@cache
def plain_chain(n: int) -> ContactProblem:
    """What ``uncoupled`` gives other matrices, for one frequency after the other."""
    return oscillators(n)


def uncoupled(n: int, *, frequency: float, damping: float, **start: Any) -> ContactProblem:
    """n times u'' + 2 xi w u' + w² u = 0, w = ``frequency``: n starts in one march."""
    chain, one = oscillators(n, **start) if start else plain_chain(n), sp.identity(n, format="csr")
    C = SerialMatrix(2.0 * damping * frequency * one) if damping else None
    system = replace(chain.system, M=SerialMatrix(one), C=C, K=SerialMatrix(frequency**2 * one))
    return replace(chain, system=system)


def dense(problem: ContactProblem) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """M, C, K as arrays."""
    system = problem.equations
    unit = np.eye(system.rows)
    return tuple(
        np.zeros_like(unit) if matrix is None else np.column_stack([matrix @ e for e in unit])
        for matrix in (system.M, system.C, system.K)
    )


def exact(
    problem: ContactProblem, t: float, excitation: Harmonic | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """(u, v) at time t under the constant load and a harmonic base motion: matrix exponential of
    the first-order system of (u, v, 1, sin, cos)."""
    M, C, K = dense(problem)
    n = len(M)
    inverse = np.linalg.inv(M)
    w, a = (2.0 * np.pi * excitation.frequency, excitation.amplitude) if excitation else (0.0, 0.0)
    phase = excitation.phase if excitation else 0.0
    whole = np.zeros((2 * n + 3, 2 * n + 3))
    whole[:n, n : 2 * n] = np.eye(n)
    whole[n : 2 * n, :n], whole[n : 2 * n, n : 2 * n] = -inverse @ K, -inverse @ C
    whole[n : 2 * n, 2 * n] = inverse @ problem.system.load.constant
    whole[n : 2 * n, 2 * n + 1] = -a  # M⁻¹(-M r a_g)
    whole[2 * n + 1, 2 * n + 2], whole[2 * n + 2, 2 * n + 1] = w, -w
    start = np.r_[problem.system.u0, problem.system.v0, 1.0, np.sin(phase), np.cos(phase)]
    end = expm(t * whole) @ start
    return end[:n], end[n : 2 * n]


def last_state(problem: ContactProblem, scheme: Any, *, dt: float, steps: int) -> State:
    """The state after so many steps."""
    state = None
    for report in run(problem, scheme, dt=dt, steps=steps):
        state = report.new
    assert state is not None
    return state


def observed_order(
    scheme: Any, *, damping: float = 0.02, t_end: float = 2.0, steps: int = 200
) -> float:
    """log2 of the error ratio in (u, v) from ``steps`` steps to twice as many, with damping, load
    and base motion."""
    problem = oscillators(damping=damping, constant=4.0, excitation=SHAKEN)
    u, v = exact(problem, t_end, SHAKEN)
    errors = []
    for count in (steps, 2 * steps):
        state = last_state(problem, scheme, dt=t_end / count, steps=count)
        errors.append(
            np.linalg.norm(state.u - u) / np.linalg.norm(u)
            + np.linalg.norm(state.v - v) / np.linalg.norm(v)
        )
    return float(np.log2(errors[0] / errors[1]))


def amplification(scheme: Any, *, frequency: float, damping: float, dt: float = 1.0) -> np.ndarray:
    """2 x 2 amplification of (u, v) by a one-step scheme, of u'' + 2 xi w u' + w² u = 0; dt = 1, w
    = ``frequency``."""
    u0, v0 = np.eye(2)
    state = last_state(
        uncoupled(2, frequency=frequency, damping=damping, u0=u0, v0=v0), scheme, dt=dt, steps=1
    )
    return np.array([state.u, state.v])
