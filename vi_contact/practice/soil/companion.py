"""March a small linear system beside a run, with the run's own scheme and steps.

The system is the ground, or a free-field column. Loads of the run ask for its motion. Displacement
and velocity are straight lines between the steps, as in the schemes' averages, so that such a load
enters the equation of motion with the same weights as the run's own u and v.
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
from ...core.state_checks import initial_state
from ...core.step import Scheme, State
from ...core.surfaces import empty_surface
from ...core.system import Load
from ...fem.matrices.own_matrices import system_from_arrays
from ...laws.mass import ConsistentMass
from ...run.march import march
from ...run.time_steps import LARGEST, Halved, Schedule, TimeSteps


class CompanionRun:
    """March a serial system without contact from rest at t = 0, as far as somebody asks.

    A run *binds* it to its scheme and time steps, with which the motion is then integrated. Each
    rank marches its own copy.

    Attributes:
        name: of the companion in messages.
    """

    def __init__(self, name: str, problem: Callable[[], ContactProblem]) -> None:
        """Note how the system is made.

        Args:
            name: of the companion in messages.
            problem: makes the system when it is first needed; its mass becomes consistent.
        """
        self.name = name
        self._make = problem
        self._bound: tuple[Scheme, TimeSteps] | None = None

    @cached_property
    def _problem(self) -> ContactProblem:
        """Return the system, with consistent mass."""
        return replace(self._make(), mass=ConsistentMass())

    def bind(self, scheme: Scheme, dt: TimeSteps) -> None:
        """March with this scheme and these time steps [s] from now on.

        Nothing happens where it has the same ones already.

        Raises:
            InputError: steps that the run itself chooses while it goes (``HalvedAtImpact``,
                ``ErrorControlled``, ``BySlipRate``).
        """
        if self._bound is not None and self._bound == (scheme, dt):
            return
        if isinstance(dt, Halved):
            raise InputError(
                f"{self.name} is computed beside the run and needs its time steps beforehand, but "
                f"the run has {dt!r}: give dt as a number or a Schedule"
            )
        self._bound = scheme, dt
        # The last piece does not end: only the times of a run are asked for.
        if isinstance(dt, Schedule):
            *pieces, (last_step, _) = dt.pieces
            dt = Schedule((*pieces, (last_step, inf)))
        # A run that begins with a state of its own is not searched for loose bodies: a companion is
        # made here and not by the user, and is meant to move freely.
        problem = self._problem
        self._steps: Iterator[tuple[State, Any]] = march(
            problem, scheme=scheme, dt=dt, steps=LARGEST, state=initial_state(problem)
        )
        system = problem.system
        self._t = [0.0]
        self._u = [system.u0.copy()]
        self._v = [system.v0.copy()]

    def at(self, t: float) -> tuple[Array, Array]:
        """Return (u, v) at time t [s]; up to t = 0 the system is as it starts.

        Raises:
            InputError: no run has bound it yet.
        """
        if t <= 0.0:
            system = self._problem.system
            return system.u0.copy(), system.v0.copy()
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
        u = (1.0 - w) * self._u[k] + w * self._u[k + 1]
        v = (1.0 - w) * self._v[k] + w * self._v[k + 1]
        return u, v


def linear_problem(M: Any, C: Any | None, K: Any, load: Load, dimension: int) -> ContactProblem:
    """Return the problem M u'' + C u' + K u = f without contact, from rest.

    Args:
        M: mass, sparse.
        C: damping, sparse; None for none.
        K: stiffness, sparse.
        load: f.
        dimension: number of unknowns of a node.
    """
    nowhere = np.zeros((M.shape[0] // dimension, dimension))  # nobody asks a companion for points
    system = system_from_arrays(M, C, K, coordinates=nowhere, load=load)
    return ContactProblem(system, empty_surface(SerialComm(), dimension))
