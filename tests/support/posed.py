"""Pose the first step of a scheme, without a march."""

from typing import Any

from vi_contact.core.algebra import EffectiveMatrix
from vi_contact.core.problem import ContactProblem
from vi_contact.core.stage import make_matrix, pose
from vi_contact.core.state_checks import initial_state
from vi_contact.core.step import Scheme, State, StepProblem


def first_step(
    scheme: Scheme, problem: ContactProblem, dt: float, state: State | None = None
) -> StepProblem:
    """The first step of dt [s] from a state, by default the initial one; the matrix is in it."""
    begun: Any = scheme.start(problem, state or initial_state(problem), dt)
    stage = scheme.stage(problem, begun, dt)
    return pose(problem, stage, make_matrix(problem.equations, stage))


def matrix_of(scheme: Scheme, problem: ContactProblem, dt: float) -> EffectiveMatrix:
    """The effective matrix of steps of dt [s]."""
    begun = scheme.start(problem, initial_state(problem), dt)
    return make_matrix(problem.equations, scheme.stage(problem, begun, dt))
