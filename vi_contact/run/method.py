"""Check what marches a problem: scheme, solvers, tolerance, the state it starts from, and its time steps."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..core.algebra import max_abs
from ..core.checks import provides, real, several, shown
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.state_checks import check_sizes
from ..core.step import Scheme, State
from .time_steps import TimeSteps

SCHEME = ("check", "start", "jump", "effective_matrix", "step", "finish", "balance")
SLACK = 10.0  # of the tolerance, and of the largest displacement: what a state may penetrate


def check_scheme(owner: str, value: Any) -> None:
    """Raise InputError unless it is a time scheme, or None."""
    if value is not None:
        provides(owner, "scheme", value, SCHEME, "give a time scheme, such as Trapezoidal(), or None")


def check_solver(owner: str, value: Any, meaning: str = "solver") -> None:
    """Raise InputError unless it is a solver of steps."""
    provides(owner, meaning, value, ("check", "prepare"), "give a solver, such as Condensed() or Volume()")


def check_methods(owner: str, solver: Any, escalation: Any, tolerance: Any) -> None:
    """Raise InputError unless these are a solver or None, a list of solvers, and a tolerance between 0 and 1."""
    if solver is not None:
        check_solver(owner, solver)
    for one in several(owner, "escalation", escalation, "give a list of solvers"):
        check_solver(owner, one, "a solver of escalation")
    if not 0.0 < real(tolerance) <= 1.0:
        raise InputError(f"{owner}: tolerance is {shown(tolerance)}; give a relative residual above 0, such as 1e-9")


def check_state(owner: str, problem: ContactProblem, state: State, *, dt: float, tolerance: float, scheme: Any) -> None:
    """Raise InputError, on all ranks, for a state of another problem, or one that penetrates the obstacle. Collective.

    A scheme that ``penetrates``, whose condition is one on velocities, may go on from states of its own runs (k > 0).
    """
    check_sizes(owner, problem, state)
    surface, rigid = problem.surface, problem.surface.compliance == 0.0
    if not rigid.any() or (state.k > 0 and getattr(scheme, "penetrates", False)):
        return
    gap = np.where(rigid, surface.gap(state.t) - surface.normal_values(state.u), np.inf)
    moved = surface.comm.max(np.array([max_abs(state.u), dt * max_abs(state.v)]))
    worst = int(np.argmin(gap))
    if gap[worst] < -SLACK * tolerance * max(float(moved.max()), max_abs(surface.gap0[rigid])):
        where = ", ".join(f"{x:g}" for x in surface.points[worst])
        raise InputError(
            f"{owner}: the state lies {-gap[worst]:.3g} m inside the obstacle at ({where}): start from one with every "
            "gap >= 0"
        )


def bind_companions(problem: ContactProblem, scheme: Scheme, dt: TimeSteps) -> None:
    """Hand scheme and time steps to the motions that are marched beside the run; nothing to do when they have them."""
    for companion in (*problem.system.companions, *problem.surface.companions):
        companion.bind(scheme, dt)
