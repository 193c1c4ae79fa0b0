"""Displacement inside the body from the boundary: a plane pulse, a smoothly pulled rod, points that
are refused."""

from __future__ import annotations

import numpy as np
import pytest
from bem_rod import rod, smooth_integral, smooth_load
from plane_waves import MATERIAL, SQUARE, pulse

from demos.parts.problems.interior import interior_displacement
from vi_contact.bem import (
    BoundaryProblem,
    PoincareSteklov,
    circle,
    energetic_blocks,
    polygon,
    traction_forces,
)
from vi_contact.core.errors import InputError

pytestmark = pytest.mark.serial
POINTS = np.array([(0.0, 0.0), (0.3, -0.2), (-0.41, 0.43), (0.1, 0.49)])


@pytest.mark.long
@pytest.mark.promise("theory/bem.md", "It is of order 2 up to a tenth of an element")
def test_pulse_crosses_the_square():
    """B4: order 2 at points inside, one of them a tenth of an element from the boundary."""
    wave, errors = pulse(), []
    for k in (5, 10):
        mesh, steps = polygon(SQUARE, 1.0 / k), 3 * k
        blocks = energetic_blocks(mesh, MATERIAL, dt=1.0 / k, steps=steps)
        operator = PoincareSteklov(blocks, 1.0)
        motion = BoundaryProblem(
            operator, traction_forces(mesh, wave.traction, dt=blocks.dt, steps=steps)
        ).solve()
        found = interior_displacement(operator, motion, POINTS)
        exact = np.array([wave.displacement(POINTS, t) for t in motion.times])
        errors.append(np.linalg.norm(found - exact) / np.linalg.norm(exact))
    assert errors[1] < 1.5e-2 and np.log2(errors[0] / errors[1]) > 1.8


@pytest.mark.long
def test_rod_inside_and_density():
    """The rod's wave before its echo from the top, at chosen steps; density divides
    displacement."""
    blocks = energetic_blocks(polygon(SQUARE, 0.1), MATERIAL, dt=0.1, steps=15)
    problem = rod(blocks, smooth_load, rho=2.0)
    steps = [4, 9, 14]
    found = interior_displacement(problem.operator, problem.solve(), POINTS, steps=steps)
    for k, step in enumerate(steps):
        t, y = 0.1 * (step + 1), POINTS[:, 1]
        exact = smooth_integral(t - (0.5 - y)) - smooth_integral(t - (1.5 + y))
        assert (
            found[k, :, 1] == pytest.approx(0.5 * exact, abs=1.5e-2)
            and np.abs(found[k, :, 0]).max() < 5e-3
        )


def test_points_that_are_refused():
    blocks = energetic_blocks(polygon(SQUARE, 0.5), MATERIAL, dt=0.5, steps=2)
    problem = rod(blocks, smooth_load)
    motion = problem.solve()
    for point in ((0.5, 0.1), (0.7, 0.0)):
        with pytest.raises(InputError, match="on the boundary or outside"):
            interior_displacement(problem.operator, motion, point)
    hole = PoincareSteklov(
        energetic_blocks(circle(0.5, 8, exterior=True), MATERIAL, dt=0.3, steps=2), 1.0
    )
    pushed = BoundaryProblem(hole, np.ones((2, 2, 8))).solve()
    assert interior_displacement(hole, pushed, (0.8, 0.0)).shape == (2, 1, 2)
    with pytest.raises(InputError, match="outside"):
        interior_displacement(hole, pushed, (0.0, 0.0))
