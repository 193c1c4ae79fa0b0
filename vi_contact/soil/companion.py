"""Small linear systems marched in step with a run: the ground, or a free-field column, with the run's own scheme.

What they do is needed at the times at which the run's loads are evaluated. Displacement and velocity are straight lines
between the steps, as in the schemes' own averages of them, so that a load made of them enters the run's equation of
motion with the same weights as the run's own u and v.
"""

from __future__ import annotations

from bisect import bisect_right
from math import inf

from ..core.algebra import Array
from ..core.errors import InputError
from ..core.problem import ContactProblem
from ..core.step import Scheme
from ..laws.mass import ConsistentMass
from ..run.march import march
from ..run.time_steps import LARGEST, HalvedAtImpact, Schedule, course


def given_steps(dt: float | Schedule) -> None:
    """InputError for time steps that the run itself chooses, and for what are none."""
    if isinstance(dt, HalvedAtImpact):
        raise InputError(f"the time step {dt!r} is found while the run goes: a motion computed alongside needs dt "
                         "as a number or a Schedule")
    course(dt, 1, None)


def _endless(dt: float | Schedule) -> float | Schedule:
    """A plan whose last piece does not end: only the times of a run are asked for."""
    return Schedule((*dt.pieces[:-1], (dt.pieces[-1][0], inf))) if isinstance(dt, Schedule) else dt


class Alongside:
    """u(t) and v(t) of a system without contact, marched as far as somebody asks.

    ``scheme`` and ``dt`` [s] (a number or a Schedule) must be those of the run, which begins at t = 0; before that the
    system is as it starts. ``mass`` is consistent. Each rank marches its own copy: the system is serial.
    InputError for time steps that the run itself chooses.
    """

    def __init__(self, problem: ContactProblem, *, scheme: Scheme, dt: float | Schedule) -> None:
        given_steps(dt)
        self.scheme, self.dt = scheme, dt
        system = problem.system
        self._steps = march(
            ContactProblem(system, problem.surface, excitation=problem.excitation, mass=ConsistentMass()),
            scheme=scheme, dt=_endless(dt), steps=LARGEST,
        )
        self._t, self._u, self._v = [0.0], [system.u0.copy()], [system.v0.copy()]

    def at(self, t: float) -> tuple[Array, Array]:
        """(u, v) at time t [s]."""
        if t <= 0.0:
            return self._u[0], self._v[0]
        while self._t[-1] < t:
            state, _ = next(self._steps)
            self._t.append(state.t)
            self._u.append(state.u)
            self._v.append(state.v)
        k = max(bisect_right(self._t, t) - 1, 0)
        if self._t[k] == t:
            return self._u[k], self._v[k]
        w = (t - self._t[k]) / (self._t[k + 1] - self._t[k])
        return (1.0 - w) * self._u[k] + w * self._u[k + 1], (1.0 - w) * self._v[k] + w * self._v[k + 1]
