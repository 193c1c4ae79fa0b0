"""What all schemes share that carry nothing but u and v from one step to the next."""

from __future__ import annotations

from dataclasses import replace

from ..core.algebra import Array
from ..core.problem import ContactProblem
from ..core.protocols import MassLaw
from ..core.step import State, StepProblem, StepResult
from ..laws.mass import ConsistentMass
from .guard import needs_mass


class SingleStep:
    """Self-starting, and not disturbed by velocity jumps: that is why seed 000 chose such a scheme."""

    @property
    def mass(self) -> MassLaw:
        """Contact here is an impulse within the step: the contact nodes need their mass."""
        return ConsistentMass()

    def check(self, problem: ContactProblem) -> None:
        """InputError for massless contact nodes."""
        needs_mass(type(self).__name__, problem)

    def start(self, problem: ContactProblem, state: State, dt: float) -> State:
        """Nothing to prepare."""
        return state

    def jump(self, problem: ContactProblem, state: State, v: Array, dt: float) -> State:
        """The new velocity, and nothing to restart."""
        return replace(state, v=v)


def stepped(step: StepProblem, result: StepResult, u: Array, v: Array) -> State:
    """The state after the step, with the mean reactions r/scale; what another scheme remembered is forgotten."""
    r_t = None if result.r_t is None else result.r_t / step.scale
    return State(step.t, step.k, u, v, result.r_n / step.scale, result.active, r_t=r_t)
