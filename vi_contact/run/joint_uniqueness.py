"""Say whether a step of a softening joint has one answer.

Newton's method of a step has the matrix H + S, with the stiffness H of the bodies at their contact
unknowns and the negative slopes S of the law: it is positive where

    lambda = largest eigenvalue of S^½ (scale G) S^½ < 1,        G = H⁻¹

with the steepest slopes of the law, f_t w/dc of openings and (mu_s - mu_d) r_n/dc of slips, and
half of them for the mean over a step. Above 1 the joint may *snap back* inside a step, which then
has several answers. With mass at the contact nodes lambda falls with dt², without it it stays at
that of statics, about 2 h f_t/(E dc) for elements of size h.
"""

from typing import Any

import numpy as np
from scipy.linalg import eigh

from ..core.arguments import check_arguments
from ..core.errors import InputError
from ..core.joints import pose_joint
from ..core.problem import ContactProblem
from ..core.sizes import refuse_dense
from ..core.stage import make_matrix
from ..core.state_checks import initial_state
from ..core.step import Scheme, State
from ..kernels.condensation import condense
from .method import with_defaults


@check_arguments
def joint_uniqueness(
    problem: ContactProblem,
    dt: float,
    *,
    scheme: Any = None,
    state: State | None = None,
) -> float:
    """Return lambda of the module: steps of dt have one answer where it is below 1. Collective.

    It takes a dense matrix of the contact unknowns.

    Args:
        problem: with a joint.
        dt: length of the step [s].
        scheme: the time scheme; None: that of ``march``.
        state: whose reactions press the joint; None: the prestress alone.

    Returns:
        The number; 0 for a joint that does not soften, infinite for one that is lost at once.

    Raises:
        InputError: a problem without a joint, or with too many contact unknowns.
    """
    if problem.joint is None:
        raise InputError("joint_uniqueness: the problem has no joint: give it joint=laws.Joint(…)")
    problem, chosen = with_defaults(problem, scheme)
    return _find_largest(problem, chosen, dt, state)


def _find_largest(problem: ContactProblem, scheme: Scheme, dt: float, state: State | None) -> float:
    """Return lambda of a problem with mass and scheme; the arguments are as above."""
    surface = problem.surface
    start = initial_state(problem) if state is None else state
    joint = pose_joint(problem, start, dt)
    law = joint.law
    if not hasattr(law, "softening_of"):
        return 0.0
    pressed = np.maximum(start.r_n if state is not None else joint.prestress[0], 0.0)
    slope = law.softening_of(pressed / surface.weights)
    springs = np.column_stack([surface.weights * slope.tension, pressed * slope.mu])
    of_all = np.asarray(surface.everywhere(springs))
    if not np.isfinite(of_all).all():
        return float("inf")
    if not of_all.any():
        return 0.0

    # Only unknowns that soften count, each with half of its slope: the mean over a step.
    frictional = problem.frictional
    width = surface.points.shape[1] if frictional else 1
    refuse_dense("joint_uniqueness", surface.total * width)
    stage = scheme.stage(problem, start, dt)
    A = make_matrix(problem.equations, stage)
    G = condense(A, surface, frictional=frictional).flexibility
    share = 0.5 if joint.implicit else 1.0
    diagonal = np.repeat(of_all[:, 1:], width, axis=1)
    diagonal[:, 0] = of_all[:, 0]
    root = np.sqrt(share * stage.scale * diagonal.ravel())
    chosen = np.flatnonzero(root)
    matrix = root[chosen, None] * G[np.ix_(chosen, chosen)] * root[chosen]
    last = len(chosen) - 1
    return float(eigh(matrix, eigvals_only=True, subset_by_index=(last, last))[0])
