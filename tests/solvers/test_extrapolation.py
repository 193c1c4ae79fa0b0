"""Anderson's extrapolation on maps whose fixed point is known."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.solvers.friction.extrapolation import Anderson, Plain

pytestmark = pytest.mark.serial


def steps(way: Any, g: Callable[[Array], Array], x: Array, *, limit: int = 300) -> int:
    """Images taken until |g(x) - x| <= 1e-12 |g(x)|."""
    following = way.start()
    for count in range(1, limit + 1):
        image = g(x)
        if np.abs(image - x).max() <= 1e-12 * np.abs(image).max():
            return count
        x = following(x, image)
    return limit + 1


def test_one_unknown_and_a_linear_map_need_three_images() -> None:
    """x <- a x + 1, contracting, alternating or expanding the other way: the secant through two
    points is exact."""
    for a in (0.9, 0.5, -0.5, -3.0):
        assert steps(Anderson(), lambda x, a=a: a * x + 1.0, np.zeros(1)) <= 4
    assert steps(Plain(), lambda x: 0.9 * x + 1.0, np.zeros(1)) > 200


def test_linear_maps_of_n_unknowns() -> None:
    """Anderson with depth n ends after n + 2 images, like GMRES."""
    rng = np.random.default_rng(3)
    root = np.linalg.qr(rng.normal(size=(4, 4)))[0]
    A, b = root @ np.diag([0.9, 0.5, 0.2, -0.4]) @ root.T, rng.normal(size=4)
    counts = [steps(way, lambda x: A @ x + b, np.zeros(4)) for way in (Plain(), Anderson(depth=4))]
    assert counts[1] <= 7 < 0.5 * counts[0]


def test_plain_steps_where_the_map_expands() -> None:
    """g = min(1.2 x + 1, 10) from 0, kept positive: the fixed point is 10, a secant through the
    first two points leads to -5, and from there back to the start."""
    for way in (Plain(), Anderson()):
        assert steps(way, lambda x: np.clip(1.2 * x + 1.0, 0.0, 10.0), np.zeros(1)) < 16


def test_plain_start_and_memory_of_its_own() -> None:
    """``after`` plain steps first; an image that the caller overwrites later does no harm."""
    following, x = Anderson(depth=2, after=3).start(), np.zeros(2)
    image = np.empty(2)
    for _ in range(3):
        image[:] = 0.5 * x + 1.0
        x = following(x, image).copy()
        assert np.array_equal(x, image)
    image[:] = 0.5 * x + 1.0
    assert np.allclose(following(x, image), 2.0, rtol=0.0, atol=1e-14)


def test_bad_settings() -> None:
    for wrong in (lambda: Anderson(depth=0), lambda: Anderson(after=-1)):
        with pytest.raises(InputError, match="give"):
            wrong()
