"""A bar of P1 elements whose foot may touch a wall: exact solutions (V1.1–V1.3) without finite
element packages.

Node i sits at x = i L/n; the foot x = 0 may touch a wall below it, so its contact direction is -1
and the change of basis is not the identity. u is positive upwards, area 1. The top x = L is free,
or clamped and then not an unknown.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse as sp

import vi_contact as vc
from vi_contact.core.algebra import Array
from vi_contact.core.problem import ContactProblem
from vi_contact.core.step import Report, State
from vi_contact.laws.mass import ConsistentMass
from vi_contact.run.march import march
from vi_contact.solvers.condensed import Condensed


def bar_matrices(
    n: int, *, length: float, E: float, rho: float, lumped: bool = False
) -> tuple[Any, Any]:
    """(M, K) of n + 1 nodes: rho h/6 tridiag(1, 4, 1) or its row sums, E/h tridiag(-1, 2, -1),
    halved at the ends."""
    h = length / n
    ends = np.full(n + 1, 2.0)
    ends[[0, -1]] = 1.0
    side = np.ones(n)
    K = E / h * sp.diags([-side, ends, -side], [-1, 0, 1])
    M = rho * h / 6.0 * sp.diags([side, 2.0 * ends, side], [-1, 0, 1])
    return (sp.diags(np.asarray(M.sum(axis=1)).ravel()) if lumped else M).tocsr(), K.tocsr()


def bar(
    n: int = 100,
    *,
    length: float = 10.0,
    E: float = 900.0,
    rho: float = 1.0,
    clamped: bool = False,
    gap: float = 0.0,
    u0: Callable[[Array], Array] = np.zeros_like,
    v0: Callable[[Array], Array] = np.zeros_like,
    gravity: float = 0.0,
    damping: float = 0.0,
    lumped: bool = False,
    **problem: Any,
) -> ContactProblem:
    """The bar over its wall, by default that of V1.1; C = damping * K [s]; consistent mass unless
    told otherwise; other keywords go to ContactProblem."""
    M, K = bar_matrices(n, length=length, E=E, rho=rho, lumped=lumped)
    x = np.linspace(0.0, length, n + 1)
    system = vc.system_from_arrays(
        M,
        damping * K if damping else None,
        K,
        coordinates=x[:, None],
        clamped=[n] if clamped else (),
        load=-gravity * np.asarray(M.sum(axis=1)).ravel(),
        u0=u0(x),
        v0=v0(x),
    )
    foot = vc.contact_points(system, [0], [-1.0], gap0=gap)
    return ContactProblem(system, foot, **({"mass": ConsistentMass()} | problem))


def thrown(n: int = 100, **more: Any) -> ContactProblem:
    """V1.1: initial height 5 m, initial velocity -10 m/s; contact from t = 1/2 to 7/6 under the
    pressure 300."""
    return bar(n, gap=5.0, v0=lambda x: np.full_like(x, -10.0), **more)


def bouncing(n: int = 100, **more: Any) -> ContactProblem:
    """V1.2: falls 5 m from rest under g = 10; period 16/3."""
    return bar(n, gap=5.0, gravity=10.0, **more)


def period_three(n: int = 100, **more: Any) -> ContactProblem:
    """V1.3: clamped at x = 1, released from u = (1 - x)/2; period 3."""
    return bar(n, length=1.0, E=1.0, clamped=True, u0=lambda x: 0.5 * (1.0 - x), **more)


def run(
    problem: ContactProblem, scheme: Any, *, dt: float, steps: int, solver: Any = None, **more: Any
) -> Iterator[Report]:
    """The reports of a march, with the condensed solver unless told otherwise."""
    for _, report in march(
        problem, scheme=scheme, solver=solver or Condensed(), dt=dt, steps=steps, **more
    ):
        yield report


def before_impact(report: Report) -> State:
    """The new state as the step left it, before the impact law."""
    return replace(report.new, v=report.v_minus)


def energy(problem: ContactProblem, state: State) -> float:
    """½ vᵀMv + ½ uᵀKu - gᵀu with the constant load g [J] (V9)."""
    system = problem.equations
    potential = system.algebra.dot(system.load.constant, state.u)
    return system.kinetic_energy(state.v) + system.strain_energy(state.u) - potential
