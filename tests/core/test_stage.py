"""What a stage poses: forces in the unit of the step, whichever the scheme multiplies them by."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from chain import chain_problem

import vi_contact as vc
from vi_contact.core.stage import make_matrix, pose
from vi_contact.core.state_checks import initial_state

pytestmark = pytest.mark.serial
SCHEMES = (
    vc.MoreauJean(),
    vc.ZienkiewiczWoodTaylor(),
    vc.SS22(),
    vc.Midpoint(),
    vc.ContactStabilisedNewmark(),
    vc.Trapezoidal(),
)


@pytest.mark.parametrize("scheme", SCHEMES, ids=lambda scheme: type(scheme).__name__)
def test_the_internal_force_is_in_the_unit_of_the_load(scheme: Any) -> None:
    """A strained chain without load and velocity: all that is left at the guess is its internal
    force, so b = -internal. Rounding is judged beside it. Without the factor of the scheme
    certificates of MoreauJean, whose steps are for impulses, were too small by 1/dt."""
    problem = chain_problem(5, gap=1e3, u0=np.linspace(0.1, 0.5, 5) ** 2)
    state = initial_state(problem)
    dt = 1e-3
    state = scheme.start(problem, state, dt)
    stage = scheme.stage(problem, state, dt)
    step = pose(problem, stage, make_matrix(problem.equations, stage))
    assert step.internal is not None and np.abs(step.internal).max() > 0.0
    if stage.carried is None and stage.a.at_guess is None:
        np.testing.assert_allclose(step.b, -step.internal, rtol=1e-12)
    expected = stage.scale * (problem.equations.K @ stage.u.at_guess)
    np.testing.assert_allclose(step.internal, expected, rtol=1e-12)
