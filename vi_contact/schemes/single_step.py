"""What all schemes share that carry nothing but u and v from one step to the next."""

from __future__ import annotations

from dataclasses import replace

from ..algebra import Array
from ..step import ContactProblem, State


class SingleStep:
    """Self-starting, and not disturbed by velocity jumps: that is why seed 000 chose such a scheme."""

    def check(self, problem: ContactProblem) -> None:
        """Works with every contact problem."""

    def start(self, problem: ContactProblem, state: State, dt: float) -> State:
        """Nothing to prepare."""
        return state

    def jump(self, problem: ContactProblem, state: State, v: Array, dt: float) -> State:
        """The new velocity, and nothing to restart."""
        return replace(state, v=v)
