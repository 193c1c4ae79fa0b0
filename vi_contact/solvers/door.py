"""Refuse NaN and infinity at the door of a step, before any solver works on them.

NaN spreads without a word. Every step is asked for three inner products; what is wrong, and where,
is looked for only when something is.
"""

from collections.abc import Callable
from functools import partial
from math import isfinite, isnan
from typing import Any

import numpy as np

from ..core.algebra import Array, EffectiveMatrix, Mask, largest, max_abs
from ..core.checks import describe_point, on_all
from ..core.errors import InputError, StepFailure
from ..core.problem import ContactProblem
from ..core.step import StepProblem
from ..core.system import SemiDiscreteSystem

DATA = "check the excitation, the tractions and the initial data"

Source = Callable[[], SemiDiscreteSystem]


def refuse_nan(step: StepProblem, source: Source | None = None) -> None:
    """Raise StepFailure for NaN or infinite loads, guesses and slips, and for NaN in gaps.

    The error tells time and place. Collective.

    Args:
        step: the step.
        source: makes the system whose histories may be named.
    """
    # Inner products are the quickest look there is. One that overflows is looked into.
    slip0 = step.slip0
    guess = step.start
    is_fine = isfinite(step.b.dot(guess))
    is_fine = is_fine and not isnan(step.bound.dot(step.bound))  # infinite gaps never close
    is_fine = is_fine and (slip0 is None or isfinite(np.vdot(slip0, slip0)))
    if largest(step.surface.comm, not is_fine):
        _refuse(step, source)


def _refuse(step: StepProblem, source: Source | None) -> None:
    """Raise StepFailure of the first array that has NaN or infinite numbers. Collective.

    Where numbers are only large, and their inner product overflowed, there is none.
    """
    surface = step.surface
    guess = step.start
    space = step.A.space
    nodes = None if space is None else space.coordinates
    nan_gaps = np.where(np.isnan(step.bound), np.nan, 0.0)
    arrays: tuple[tuple[str, Array | None, Array | None, str], ...] = (
        ("load", step.b, nodes, DATA),
        ("guess", guess, nodes, "check the state that the step begins with, and the scheme"),
        ("gap", nan_gaps, surface.points, "check how the obstacle moves"),
        ("slip", step.slip0, surface.points, "check how the obstacle slides, and the state"),
    )
    for name, values, points, remedy in arrays:
        if values is None:
            continue
        wrong = ~np.isfinite(values)
        if wrong.ndim > 1:
            wrong = wrong.any(axis=1)
        if not surface.some(wrong):
            continue
        cause = ""
        if name == "load" and source is not None:
            cause = _name_history(step, source())
        place = describe_place(surface.comm, wrong, points)
        raise StepFailure(
            f"the {name} of step {step.k} at t = {step.t:.6g} s contains NaN or infinite values"
            f"{place}{cause}: {remedy}"
        )


def describe_place(comm: Any, wrong: Mask, points: Array | None) -> str:
    """Return " at" and where the first wrong row of all ranks is, or " everywhere". Collective.

    Args:
        comm: of the rows.
        wrong: (n,) rows of this rank.
        points: (n, d) where they are; None where that is not known, which gives no text.
    """
    rows = np.flatnonzero(wrong)
    place = ""
    if len(rows) and points is not None:
        place = describe_point(points[rows[0]])
    of_ranks = comm.bcast(comm.gather((place, bool(wrong.all()))))
    if all(is_whole_rank for _, is_whole_rank in of_ranks):
        return " everywhere"
    return next((f" at {place}" for place, _ in of_ranks if place), "")


def _name_history(step: StepProblem, system: SemiDiscreteSystem) -> str:
    """Return a clause about the first history of a load or excitation that is no finite number.

    It names the history, its value and the time at which it was asked. Collective.
    """
    for t in dict.fromkeys([*system.times, step.t]):
        for _, history in system.load.separable:
            value = on_all(step.surface.comm, "the history of a load", partial(_number, history, t))
            if not isfinite(value):
                owner = getattr(history, "__self__", None)
                name = getattr(history, "__qualname__", type(history).__name__)
                if owner is not None:
                    name = type(owner).__name__
                return f", as {name} is {value:g} at t = {t:.6g} s"
    return ""


def _number(history: Callable[[float], float], t: float) -> float:
    """Return the value of a history as a float."""
    return float(history(t))


def refuse_matrix(problem: ContactProblem, A: EffectiveMatrix) -> None:
    """Raise InputError for a matrix of the steps with NaN or infinite entries. Collective.

    It is asked once for every dt, and costs a product with the matrix.
    """
    comm = A.algebra.comm
    ones = np.ones(A.matrix.rows)
    row_sums = A.matrix @ ones
    if not largest(comm, not isfinite(row_sums.sum())):
        return
    wrong = ~np.isfinite(row_sums)
    if not largest(comm, bool(wrong.any())):
        return

    # Which matrices of the system it comes from, and where.
    system = problem.equations
    names = []
    for name, matrix in (("M", system.M), ("C", system.C), ("K", system.K)):
        if matrix is not None and largest(comm, not isfinite(max_abs(matrix @ ones))):
            names.append(name)
    whose = f" ({' and '.join(names)})" if names else ""
    place = describe_place(comm, wrong, None if A.space is None else A.space.coordinates)
    raise InputError(
        f"the matrix of the steps{whose} has NaN or infinite entries{place}: check materials, "
        "masses, damping, contact directions and the time step"
    )
