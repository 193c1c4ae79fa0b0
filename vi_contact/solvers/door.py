"""Refuse numbers that are none at the door of a step, before any solver works on them.

NaN spreads without a word.

What is asked of every step is three inner products; what is wrong, and where, is looked for only
when something is.
"""

from collections.abc import Callable, Iterator
from functools import partial
from math import isfinite
from typing import Any

import numpy as np

from ..core.algebra import Array, EffectiveMatrix, Mask, largest, max_abs
from ..core.checks import at, on_all
from ..core.errors import InputError, StepFailure
from ..core.problem import ContactProblem
from ..core.step import StepProblem
from ..core.system import SemiDiscreteSystem

DATA = "check the excitation, the tractions and the initial data"


Source = Callable[[], SemiDiscreteSystem]


def refuse_nan(step: StepProblem, source: Source | None = None) -> None:
    """Raise StepFailure for NaN or infinite loads, and NaN in gaps, guesses or slips.

    It tells time and place. It is asked of all ranks, so that all stop. ``source``: makes the
    system whose histories may be named. Collective.
    """
    bound, slip0 = step.bound, step.slip0
    # the quickest look there is; an overflow is looked into
    fine = isfinite(step.b.dot(step.guess))
    gaps = bound.dot(bound)  # infinite gaps are gaps that never close
    fine = fine and gaps == gaps and (slip0 is None or isfinite(np.vdot(slip0, slip0)))
    if largest(step.surface.comm, not fine):
        _refuse(step, source)


def _refuse(step: StepProblem, source: Source | None) -> None:
    """Raise StepFailure of the first array that has such numbers; large ones alone are none.

    Collective.
    """
    comm, space = step.surface.comm, step.A.space
    there = None if space is None else space.coordinates
    when = f"of step {step.k} at t = {step.t:.6g} s"
    for name, values, points, remedy in (
        ("load", step.b, there, DATA),
        ("guess", step.guess, there, "check the state that the step begins with, and the scheme"),
        (
            "gap",
            np.where(np.isnan(step.bound), np.nan, 0.0),
            step.surface.points,
            "check how the obstacle moves",
        ),
        ("slip", step.slip0, step.surface.points, "check how the obstacle slides, and the state"),
    ):
        if values is None:
            continue
        wrong = ~np.isfinite(values)
        wrong = wrong.any(axis=1) if wrong.ndim > 1 else wrong
        if not step.surface.some(wrong):
            continue
        text = f"the {name} {when} contains NaN or infinite values{_place(comm, wrong, points)}"
        cause = "".join(_histories(step, source())) if name == "load" and source is not None else ""
        raise StepFailure(f"{text}{cause}: {remedy}")


def _place(comm: Any, wrong: Mask, points: Array | None) -> str:
    """Where the first wrong row of all ranks is, if places are known and not all rows are wrong.

    Collective.
    """
    found = np.flatnonzero(wrong)
    said = at(points[found[0]]) if len(found) and points is not None else ""
    told = comm.bcast(comm.gather((said, bool(wrong.all()))))
    if all(every for _, every in told):
        return " everywhere"
    return next((f" at {text}" for text, _ in told if text), "")


def _histories(step: StepProblem, system: SemiDiscreteSystem) -> Iterator[str]:
    """Name the first history of a load or excitation that is no number.

    The time it was asked for is named too. Collective.
    """
    for t in dict.fromkeys([*system.times, step.t]):
        for _, history in system.load.separable:
            value = on_all(step.surface.comm, "the history of a load", partial(_number, history, t))
            if not isfinite(value):
                owner = getattr(history, "__self__", None)
                own = getattr(history, "__qualname__", type(history).__name__)
                name = own if owner is None else type(owner).__name__
                yield f", as {name} is {value:g} at t = {t:.6g} s"
                return


def _number(history: Callable[[float], float], t: float) -> float:
    return float(history(t))


def refuse_matrix(problem: ContactProblem, A: EffectiveMatrix) -> None:
    """Raise InputError for a matrix of the steps with entries that are no finite numbers.

    Once for every dt; a product with it. Collective.
    """
    ones = np.ones(A.matrix.rows)
    rows, comm = A.matrix @ ones, A.algebra.comm
    if not largest(comm, not isfinite(rows.sum())):
        return
    wrong = ~np.isfinite(rows)
    if not largest(comm, bool(wrong.any())):
        return
    system = problem.equations
    matrices = {"M": system.M, "C": system.C, "K": system.K}
    names = [
        name
        for name, one in matrices.items()
        if one is not None and largest(comm, not isfinite(max_abs(one @ ones)))
    ]
    whose = f" ({' and '.join(names)})" if names else ""
    place = _place(comm, wrong, None if A.space is None else A.space.coordinates)
    raise InputError(
        f"the matrix of the steps{whose} has NaN or infinite entries{place}: check materials, "
        "masses, damping, contact directions and the time step"
    )
