"""Checks of what marches a problem: scheme, solvers, tolerance, the state it starts from, and its time steps.

Motions that were computed beforehand with a scheme and time steps of their own (``base_motion``, ``fem.FreeField``)
belong to runs with the same: systems and surfaces carry their ``Pace``, and it is compared with that of the run.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from ..core.algebra import max_abs
from ..core.checks import provides, real, several, shown
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.state_checks import check_sizes
from ..core.step import State
from ..core.system import Pace
from .time_steps import HalvedAtImpact, Schedule, TimeSteps, described

SCHEME = ("check", "start", "jump", "effective_matrix", "step", "finish", "balance")
SLACK = 10.0  # of the tolerance, and of the largest displacement: what a state may penetrate
SAME = 1e-12  # relative difference of time steps that were computed in two ways


def check_scheme(owner: str, value: Any) -> None:
    """InputError unless it is a time scheme, or None."""
    if value is not None:
        provides(owner, "scheme", value, SCHEME, "give a time scheme, such as Trapezoidal(), or None")


def check_solver(owner: str, value: Any, meaning: str = "solver") -> None:
    """InputError unless it is a solver of steps."""
    provides(owner, meaning, value, ("check", "prepare"), "give a solver, such as Condensed() or Volume()")


def check_methods(owner: str, solver: Any, escalation: Any, tolerance: Any) -> None:
    """InputError unless these are a solver or None, a list of solvers, and a tolerance between 0 and 1."""
    if solver is not None:
        check_solver(owner, solver)
    for one in several(owner, "escalation", escalation, "give a list of solvers"):
        check_solver(owner, one, "a solver of escalation")
    if not 0.0 < real(tolerance) <= 1.0:
        raise InputError(f"{owner}: tolerance is {shown(tolerance)}; give a relative residual above 0, such as 1e-9")


def check_state(owner: str, problem: ContactProblem, state: State, *, dt: float, tolerance: float, scheme: Any) -> None:
    """InputError, on all ranks, for a state of another problem, or one that penetrates the obstacle. Collective.

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


def check_pace(problem: ContactProblem, scheme: Any, plan: TimeSteps) -> None:
    """InputError naming a motion that was computed with other time steps, or another scheme, than those of the run."""
    for pace in (*problem.system.paces, *problem.surface.paces):
        if not _same_steps(pace.dt, plan):
            raise _other_pace(pace, f"dt = {_steps(pace.dt)}", f"dt = {_steps(plan)}")
        if _rule(pace.scheme) != _rule(scheme):
            raise _other_pace(pace, repr(pace.scheme), repr(scheme))


def _other_pace(pace: Pace, its: str, ours: str) -> InputError:
    return InputError(f"{pace.name} was computed with {its} and the run has {ours}: give both the same")


def _steps(plan: TimeSteps) -> str:
    return f"{plan} s" if isinstance(plan, float | int) else str(described(plan))


def _same_steps(one: float | Schedule, other: TimeSteps) -> bool:
    """Whether two plans have the same steps; halved ones are known to nobody beforehand."""
    if isinstance(other, HalvedAtImpact):
        return False
    pairs = [plan.pieces if isinstance(plan, Schedule) else ((plan, math.inf),) for plan in (one, other)]
    if len(pairs[0]) != len(pairs[1]):
        return False
    numbers = [np.array(pieces, dtype=float) for pieces in pairs]
    return bool(np.allclose(numbers[0], numbers[1], rtol=SAME, atol=0.0))


def _rule(scheme: Any) -> Any:
    """What of a scheme makes its steps: all but the mass that it proposes for contact nodes."""
    names: Sequence[str] = [one.name for one in fields(scheme) if one.name != "mass"] if _is_value(scheme) else ()
    return (type(scheme), *(getattr(scheme, name) for name in names)) if _is_value(scheme) else scheme


def _is_value(scheme: Any) -> bool:
    return hasattr(scheme, "__dataclass_fields__")
