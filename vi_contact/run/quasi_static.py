"""Load histories so slow that inertia does not matter: one static stage after another.

Friction makes the equilibrium depend on the way to it. Each stage solves the static problem with slips counted from
the stage before (slip rate times time step, implicit Euler):

    K u_k = f(t_k) - B_nᵀ r_n - B_tᵀ r_t,    r_t against B_t (u_k - u_{k-1}),    |r_t| <= limit(r_n)

so that t only orders the loads: histories of ``Traction`` and ``BodyForce``, ``Prescribed`` displacements, and
obstacles that move. Without friction every stage is the equilibrium of its own loads. Slip between stages has no rate,
so a law that asks for one is refused: its value at rest would be wrong for points in motion wherever it jumps there.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from ..core.checks import real, shown
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.state_checks import check_problem_given, check_sizes, initial_state
from ..core.step import Solver, State
from ..solvers.certified import TOLERANCE
from .method import check_methods
from .static import Equilibria


def quasi_static(
    problem: ContactProblem,
    times: Iterable[float],
    *,
    solver: Solver | None = None,
    state: State | None = None,
    tolerance: float = TOLERANCE,
) -> Iterator[State]:
    """Yield the equilibrium at each of the times, from where the one before left the body. v = 0; k counts stages.

    A load that grows in proportion needs one step as long as all slips go one way; a cyclic one at least a step for
    every turn, and more where zones of slip grow (small steps follow the path, the error is that of implicit Euler).
    K is factorised once. Prescribed motions should have no velocity and acceleration: their C U' + M U'' are loads.

    Args:
        solver: Condensed() when None.
        times: increasing, none before ``state.t``; the loads are taken there, excitations are not.
        state: where the history starts, from ``static_equilibrium`` or an earlier history; u0 at t = 0 without
            reactions when None. A body pressed without friction first: the state of that problem.
    Raises:
        InputError: times that do not increase; friction that depends on the slip rate; loads that drive a rigid motion
            which nothing stops.
        StepFailure: no answer below the certificate tolerance.
    """
    check_problem_given("quasi_static", problem)
    check_methods("quasi_static", solver, (), tolerance)
    if problem.friction.at(np.zeros(problem.surface.count)) is not problem.friction:
        raise InputError(
            f"load steps with {problem.friction}: slip between them has no rate; use Coulomb with the coefficient of "
            "slow sliding, or march through the history in time"
        )
    if state is None:
        state = initial_state(problem)
    else:
        check_sizes("quasi_static", problem, state)
    order = _checked(times, state.t)
    return _stages(Equilibria(problem, solver=solver, tolerance=tolerance), state, order)


def _stages(equilibria: Equilibria, state: State, times: list[float]) -> Iterator[State]:
    for t in times:
        state = replace(equilibria.after(state, t), k=state.k + 1)
        yield state


def _checked(times: Iterable[float], start: float) -> list[float]:
    """The times as a list."""
    if not isinstance(times, Iterable) or isinstance(times, str | bytes):
        raise InputError(f"load steps at {shown(times)}: give times in seconds")
    order = [real(t) for t in times]
    ways = np.diff([start, *order])
    if not (np.all(np.isfinite(ways)) and np.all(ways >= 0.0) and np.all(ways[1:] > 0.0)):
        raise InputError(f"load steps from t = {start:g} s at {order}: give times that increase, none before the start")
    return order
