"""Carry what materials remember from state to state, and certify it: for bodies that yield.

Every function returns what it was given where materials have no memory.
"""

from dataclasses import replace
from typing import Any

from ..core.certificate import Certificate
from ..core.errors import StepFailure
from ..core.internal import remembers, select_memory
from ..core.problem import ContactProblem
from ..core.step import Scheme, State
from ..core.system import SemiDiscreteSystem


def start_scheme(problem: ContactProblem, scheme: Scheme, state: State, dt: float) -> State:
    """Return a state with the memory that a scheme needs, and what materials remember. Collective.

    Args:
        problem: that is marched.
        scheme: its time scheme, which may replace the memory of the state.
        state: the first one of steps of another length.
        dt: length of the steps [s].
    """
    if not remembers(problem.system.internal):
        return scheme.start(problem, state, dt)
    standing = problem.standing_at(state)
    return keep_material(standing.equations, state, scheme.start(standing, state, dt))


def keep_material(system: SemiDiscreteSystem, old: State, new: State) -> State:
    """Return a state with what materials remember in another one: schemes make memory anew.

    A first state remembers nothing: its displacement was reached from none. Collective.

    Args:
        system: the equations, whose materials stand at ``old``.
        old: that remembers.
        new: at the same place.
    """
    internal: Any = system.internal
    if not remembers(internal):
        return new
    known = select_memory(old.memory) or internal.remember(old.u)
    return replace(new, memory={**new.memory, **known})


def remember_material(system: SemiDiscreteSystem, state: State) -> State:
    """Return the state at the end of a step with what materials remember there. Collective.

    Args:
        system: the equations, whose materials stand at the beginning of the step.
        state: at its end.
    """
    internal: Any = system.internal
    if not remembers(internal):
        return state
    return replace(state, memory={**state.memory, **internal.remember(state.u)})


def certify_material(
    system: SemiDiscreteSystem, certificate: Certificate, state: State, tolerance: float
) -> Certificate:
    """Return the certificate with the residual of the laws of materials. Collective.

    Args:
        system: the equations, whose materials stand at the beginning of the step.
        certificate: of the step without it.
        state: at the end of the step.
        tolerance: the largest residual.

    Raises:
        StepFailure: the residual is above the tolerance.
    """
    internal: Any = system.internal
    if not remembers(internal):
        return certificate
    whole = replace(certificate, material=internal.residual(state.u))
    if not whole.worst <= tolerance:
        raise StepFailure(
            f"step {state.k} at t = {state.t:.6g} s: the law of a material is not satisfied to the "
            f"certificate tolerance {tolerance:g} ({whole}): check stress and f of the material"
        )
    return whole
