"""Time calls and marched steps, for the scripts of this folder."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from mpi4py import MPI

import vi_contact as vc

COMM = MPI.COMM_WORLD


class Clock:
    """Add up the processor time that is spent in some functions."""

    def __init__(self) -> None:
        self.seconds: dict[str, float] = {}
        self._kept: list[tuple[Any, str, Any]] = []

    def watch(self, owner: Any, method: str, name: str) -> None:
        """Count what a method of a class takes under a name, less what it calls that is watched."""
        call = getattr(owner, method)
        self._kept.append((owner, method, call))
        self.seconds.setdefault(name, 0.0)

        def timed(*given: Any, **more: Any) -> Any:
            before = sum(self.seconds.values())
            start = time.process_time()
            answer = call(*given, **more)
            inside = sum(self.seconds.values()) - before
            self.seconds[name] += time.process_time() - start - inside
            return answer

        setattr(owner, method, timed)

    def stop(self) -> None:
        """Leave the methods as they were."""
        for owner, method, call in self._kept:
            setattr(owner, method, call)


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
