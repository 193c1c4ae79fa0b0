"""March a small linear system beside a run.

It is the ground, or a free-field column, with the run's own scheme and steps.

Loads of the run ask for its motion. Displacement and velocity are straight lines between the steps,
as in the schemes' averages, so that such a load enters the equation of motion with the same weights
as the run's own u and v.
"""

from bisect import bisect_right
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import cached_property
from math import inf
from typing import Any

import numpy as np

from ...core.algebra import Array, SerialComm
from ...core.errors import InputError
from ...core.problem import ContactProblem
from ...core.step import Scheme, State
from ...core.surfaces import empty_surface
from ...core.system import Load
from ...fem.matrices.own_matrices import system_from_arrays
from ...laws.mass import ConsistentMass
from ...run.march import march
from ...run.time_steps import LARGEST, HalvedAtImpact, Schedule, TimeSteps


class CompanionRun:
    """March a serial system without contact from rest at t = 0.

    It goes as far as somebody asks for its u(t) and v(t).

    ``name`` is for messages; ``problem`` makes the system, with consistent mass, when it is first
    needed. A run *binds* it to its scheme and time steps, with which the motion is then integrated.
    Each rank marches its own copy.
    """

    def __init__(self, name: str, problem: Callable[[], ContactProblem]) -> None:
        self.name, self._make = name, problem
        self._bound: tuple[Scheme, TimeSteps] | None = None

    @cached_property
    def _problem(self) -> ContactProblem:
        return replace(self._make(), mass=ConsistentMass())

    def bind(self, scheme: Scheme, dt: TimeSteps) -> None:
        """March with this scheme and these time steps [s] from now on.

        Nothing happens when they are those it has.

        InputError for steps that the run itself chooses while it goes (``HalvedAtImpact``).
        """
        if self._bound is not None and self._bound == (scheme, dt):
            return
        if isinstance(dt, HalvedAtImpact):
            raise InputError(
                f"{self.name} is computed beside the run and needs its time steps beforehand, but "
                f"the run has {dt!r}: give dt as a number or a Schedule"
            )
        self._bound = scheme, dt
        # the last piece does not end: only the times of a run are asked for
        if isinstance(dt, Schedule):
            dt = Schedule((*dt.pieces[:-1], (dt.pieces[-1][0], inf)))
        self._steps: Iterator[tuple[State, Any]] = march(
            self._problem, scheme=scheme, dt=dt, steps=LARGEST
        )
        system = self._problem.system
        self._t, self._u, self._v = [0.0], [system.u0.copy()], [system.v0.copy()]

    def at(self, t: float) -> tuple[Array, Array]:
        """Return (u, v) at time t [s]; up to t = 0 the system is as it starts.

        InputError before a run has bound it.
        """
        if t <= 0.0:
            return self._problem.system.u0.copy(), self._problem.system.v0.copy()
        if self._bound is None:
            raise InputError(
                f"{self.name} is asked for its motion at t = {t:g} s, but no run has bound it yet: "
                "give it to a run as it is, not inside a function of your own, or call "
                "bind(scheme, dt) first"
            )
        while self._t[-1] < t:
            state, _ = next(self._steps)
            self._t.append(state.t)
            self._u.append(state.u)
            self._v.append(state.v)
        k = max(bisect_right(self._t, t) - 1, 0)
        if self._t[k] == t:
            return self._u[k], self._v[k]
        w = (t - self._t[k]) / (self._t[k + 1] - self._t[k])
        return (1.0 - w) * self._u[k] + w * self._u[k + 1], (1.0 - w) * self._v[k] + w * self._v[
            k + 1
        ]


def linear_problem(M: Any, C: Any | None, K: Any, load: Load, dimension: int) -> ContactProblem:
    """Return M u'' + C u' + K u = f, at rest.

    The matrices are sparse; there is no contact, and a node has ``dimension`` unknowns.
    """
    nowhere = np.zeros((M.shape[0] // dimension, dimension))  # nobody asks a companion for points
    system = system_from_arrays(M, C, K, coordinates=nowhere, load=load)
    return ContactProblem(system, empty_surface(SerialComm(), dimension))
