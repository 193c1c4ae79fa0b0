"""Take a joint through a step of a scheme: pose it, complete its answer, and commit what it did."""

from dataclasses import replace
from typing import Any

import numpy as np

from ..core.errors import InputError
from ..core.joints import keep_committed
from ..core.problem import ContactProblem
from ..core.stage import Answer
from ..core.step import State, StepProblem, StepResult

NO_JOINT = (
    "a joint goes with linear bodies only: give the body a linear material, or the contact a law "
    "of friction in the place of the joint"
)


def refuse_scheme(problem: ContactProblem, scheme: Any) -> None:
    """Raise InputError for schemes and bodies that no joint goes with yet.

    Args:
        problem: what is marched.
        scheme: its time scheme.
    """
    if problem.joint is None:
        return
    if not getattr(scheme, "takes_joints", False):
        raise InputError(
            f"{type(scheme).__name__} does not take a joint: {_say_why(scheme)}; give Midpoint(), "
            "ZienkiewiczWoodTaylor(), SS22(), EnergyMomentum() or ContactStabilisedNewmark(), or "
            "no scheme"
        )
    if problem.system.internal is not None:
        raise InputError(NO_JOINT)


def _say_why(scheme: Any) -> str:
    """Return why the energy of a joint would not be that under its law with a scheme."""
    if getattr(scheme, "penetrates", False):
        return "its contact is between velocities, and a joint is lost by its opening"
    return (
        "its reactions are those at one time, so that their work is not the area under the law, "
        "whose strength is a mean over the step"
    )


def refuse_statics(problem: ContactProblem) -> None:
    """Raise InputError for joints and bodies that have no static stage."""
    if problem.joint is None:
        return
    if hasattr(problem.joint, "at_speed"):
        raise InputError(
            f"{type(problem.joint).__name__} has no static stage, as it has no slip rate at rest: "
            "march from a state made by hand, or with the prestress of the joint"
        )
    if problem.system.internal is not None:
        raise InputError(NO_JOINT)


def release(step: StepProblem, answer: Answer) -> Answer:
    """Return an answer with the total reactions, which the bodies feel: r' - F + P.

    Args:
        step: the step for r'.
        answer: with r' [N].
    """
    return replace(answer, r_n=answer.r_n - step.joint.pull)


def relieve(step: StepProblem, answer: Answer) -> Answer:
    """Return an answer with reactions less the prestress, which move the bodies.

    Args:
        step: the step for r'.
        answer: with the total reactions [N].
    """
    normal, shear = step.joint.prestress
    r_t = None if answer.r_t is None else answer.r_t - shear
    return replace(answer, r_n=answer.r_n - normal, r_t=r_t)


def commit(state: State, step: StepProblem, result: StepResult) -> State:
    """Return the state at the end of a step with what its joint has gone through.

    Args:
        state: at the end.
        step: the step for r'.
        result: its answer.
    """
    committed = step.joint.commit(step, result)
    return keep_committed(state, {name: np.asarray(committed[name]) for name in committed})
