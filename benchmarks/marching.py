"""Time calls and marched steps, for the scripts of this folder."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from mpi4py import MPI

import vi_contact as vc

COMM = MPI.COMM_WORLD


def spend(call: Callable[[], Any]) -> tuple[float, Any]:
    """Return the processor time of a call on the busiest rank [s], and what it returns."""
    start = time.process_time()
    answer = call()
    return max(COMM.allgather(time.process_time() - start)), answer


def march(
    problem: vc.ContactProblem, scheme: Any, dt: float, steps: int
) -> tuple[vc.Stepper, list[Any]]:
    """Return the stepper after so many steps with ``Condensed``, and their reports.

    Args:
        problem: what is marched.
        scheme: of time.
        dt: length of a step [s].
        steps: number of steps.
    """
    stepper = vc.Stepper(problem, scheme=scheme, solver=vc.Condensed())
    reports = []
    for _ in range(steps):
        trial = stepper.attempt(dt)
        stepper.accept(trial)
        reports.append(trial.report)
    return stepper, reports
