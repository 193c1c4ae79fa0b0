"""Obstacles, contact surfaces and nodal frames."""

from __future__ import annotations

import numpy as np
import pytest
from chain import chain_surface

from vi_contact.core.algebra import SerialComm
from vi_contact.core.errors import InputError
from vi_contact.core.obstacles import (
    AnalyticGap,
    HalfSpace,
    Touching,
    check_gap,
    locate_obstacle,
)
from vi_contact.core.surfaces import empty_surface, make_nodal_frames

pytestmark = pytest.mark.serial
POINTS = np.array([[0.0, 1.0], [2.0, 3.0], [-1.0, 0.5]])
DOWN = np.tile([0.0, -1.0], (3, 1))


def test_half_space_below_a_body():
    """(X + u - point)·normal >= 0: the gap is the distance from the plane, the contact direction
    minus its normal."""
    ground = HalfSpace(point=(5.0, 0.25), normal=(0.0, 2.0))  # any length of the normal
    np.testing.assert_allclose(ground.gap(POINTS, DOWN), [0.75, 2.75, 0.25], rtol=1e-15)
    np.testing.assert_array_equal(ground.directions(POINTS, DOWN), DOWN)


def test_half_space_oblique():
    """Gap and direction do not depend on the boundary's own normal (curved boundaries)."""
    slope = HalfSpace(point=(0.0, 0.0), normal=(1.0, 1.0))
    normals = np.array([[-1.0, 0.0], [0.0, -1.0], [-0.6, -0.8]])
    np.testing.assert_allclose(
        slope.gap(POINTS, normals), POINTS.sum(axis=1) / np.sqrt(2.0), rtol=1e-15
    )
    np.testing.assert_allclose(
        slope.directions(POINTS, normals), -np.sqrt(0.5) * np.ones((3, 2)), rtol=1e-15
    )


def test_half_space_along_a_whole_side_is_refused():
    """A side at right angles to the contact direction, but for rounding, can never touch."""
    for across in (1e-16, -1e-16):
        side = np.tile([1.0, across], (3, 1))
        with pytest.raises(
            InputError,
            match=r"is along the boundary at 90 degrees to its mean outward normal \(1, ",
        ):
            locate_obstacle(HalfSpace((0.0, 0.0), (0.0, 1.0)), POINTS, side)


@pytest.mark.parametrize(
    ("obstacle", "word"),
    [
        (lambda: HalfSpace((0.0, 0.0), (0.0, 0.0)), "nonzero normal"),
        (lambda: HalfSpace((0.0, 0.0), (0.0, np.nan)), "give finite numbers"),
        (lambda: HalfSpace((0.0, 0.0, 0.0), (0.0, 1.0)), "same number"),
        (
            lambda: locate_obstacle(HalfSpace((0.0, 0.0), (0.0, -1.0)), POINTS, DOWN),
            "turn its sign",
        ),
        (
            lambda: locate_obstacle(HalfSpace((0.0, 0.0, 0.0), (0.0, 0.0, 1.0)), POINTS, DOWN),
            "numbers of shape",
        ),
        (
            lambda: locate_obstacle(AnalyticGap(lambda x: 0.5), POINTS, DOWN),
            "one real gap per point",
        ),
    ],
)
def test_wrong_obstacles_are_refused(obstacle, word):
    with pytest.raises(InputError, match=word):
        obstacle()


def test_touching_and_analytic_gap_use_the_bodys_own_normal():
    assert not Touching().gap(POINTS, DOWN).any()
    assert Touching().directions(POINTS, DOWN) is DOWN
    parabola = AnalyticGap(lambda x: 0.5 * x[:, 0] ** 2)
    np.testing.assert_array_equal(parabola.gap(POINTS, DOWN), [0.0, 2.0, 0.5])
    assert parabola.directions(POINTS, DOWN) is DOWN


def test_admissible_gap_removes_round_off_only():
    gap = np.array([-1e-13, 0.0, 0.3])
    np.testing.assert_array_equal(check_gap(gap, POINTS, size=1.0), [0.0, 0.0, 0.3])
    with pytest.raises(InputError, match=r"penetrates its obstacle by 1e-13 m at \(0, 1\)"):
        check_gap(gap, POINTS, size=1e-3)
    with pytest.raises(InputError, match="NaN"):
        check_gap(np.array([0.0, np.nan, 0.0]), POINTS, size=1.0)


@pytest.mark.parametrize("d", [1, 2, 3])
def test_nodal_frames_are_orthonormal(d):
    n = np.random.default_rng(d).normal(size=(50, d))
    n = np.vstack([n, np.eye(d), -np.eye(d)])
    n /= np.linalg.norm(n, axis=1)[:, None]
    frames = make_nodal_frames(n)
    np.testing.assert_array_equal(frames[:, :, 0], n)
    np.testing.assert_allclose(
        frames.transpose(0, 2, 1) @ frames, np.tile(np.eye(d), (len(n), 1, 1)), atol=1e-14
    )
    if d > 1:
        np.testing.assert_allclose(np.linalg.det(frames), 1.0, rtol=1e-14)  # right-handed


def test_selection_and_its_transpose():
    """B_n x and B_nᵀ r are adjoint."""
    surface = chain_surface(4, left_gap=0.2)
    x, r = np.arange(4.0), np.array([3.0, -7.0])
    np.testing.assert_array_equal(surface.normal_values(x), [3.0, 0.0])
    np.testing.assert_array_equal(surface.reaction_load(r, 4), [-7.0, 0.0, 0.0, 3.0])
    assert surface.reaction_load(r, 4) @ x == r @ surface.normal_values(x)


def test_held_and_on_springs():
    surface = chain_surface(4, weight=0.25)
    assert surface.bilateral_everywhere().bilateral.all() and not surface.bilateral.any()
    # k = 8 Pa/m times 0.25 m²
    np.testing.assert_array_equal(surface.on_springs(8.0).compliance, [0.5])
    for stiffness in (0.0, -1.0, np.inf, np.nan):
        with pytest.raises(InputError, match=r"foundation modulus \[Pa/m\] is"):
            surface.on_springs(stiffness)


def test_empty_surface():
    surface = empty_surface(SerialComm(), 2)
    assert surface.count == 0
    assert surface.normal_values(np.ones(5)).shape == (0,)
    assert not surface.reaction_load(np.zeros(0), 5).any()
