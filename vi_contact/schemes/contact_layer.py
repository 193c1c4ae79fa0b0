"""The massless contact layer: contact unknowns without inertia are in equilibrium with the body at every time.

    (K u)_c + r = f_c(t),    0 <= r_n  ⊥  gap0 - u_n >= 0    with the inner unknowns as they are

Initial data rarely know that. Kept as they are, what is missing in this equation would swing on in the contact layer
from step to step for ever, so schemes put it right once, at the start; the energy this takes is of the order of the
mesh size, and the history starts after it.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..core.algebra import EffectiveMatrix, Mask
from ..core.problem import ContactProblem
from ..core.step import State, StepProblem
from ..core.surfaces import ContactSurface
from ..solvers.certified import TOLERANCE, CertifiedSolver
from ..solvers.condensed import Condensed


def relaxed(problem: ContactProblem, state: State) -> State:
    """The state with its massless unknowns, if there are any, in equilibrium, and the reactions that belong to it.

    Only their own block of K is factorised, however large the body is.
    """
    system, layer = problem.equations, problem.equations.massless
    if layer is None:
        return state
    load = system.load(state.t) - system.K @ np.where(layer, 0.0, state.u)
    A = system.kept("contact layer", lambda: EffectiveMatrix(system.algebra.block(system.K, layer), system.algebra))
    surface = _within(problem.surface, layer)
    step = StepProblem(
        A=A,
        b=load[layer],
        bound=surface.gap(state.t),
        surface=surface,
        scale=1.0,
        guess=state.u[layer],
        active=state.active,
        t=state.t,
        k=state.k,
        friction=problem.friction,
        slip0=problem.slip_origin(state.u, state.t, state.t),
    )
    result, _, _ = CertifiedSolver(problem, A, 1.0, [Condensed()], TOLERANCE, surface=surface).solve(step)
    u = state.u.copy()
    u[layer] = result.x
    return replace(state, u=u, r_n=result.r_n, r_t=result.r_t, active=result.active)


def _within(surface: ContactSurface, layer: Mask) -> ContactSurface:
    """The surface on the unknowns of the layer alone, in which all normal ones are."""
    place = np.where(layer, np.cumsum(layer) - 1, -1)
    tangents = np.where(surface.tangents >= 0, place[surface.tangents], -1)
    return replace(surface, owned=place[surface.owned], tangents=tangents, basis=None, coupling=None, dual=None)


def at_rest_between(problem: ContactProblem, old: State, u: np.ndarray, v: np.ndarray, dt: float) -> np.ndarray:
    """v, with the mean velocity of the step on massless unknowns: they have no momentum to carry on."""
    massless = problem.equations.massless
    return v if massless is None else np.where(massless, (u - old.u) / dt, v)
