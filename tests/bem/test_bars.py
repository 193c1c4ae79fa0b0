"""Bars of boundary elements that no other file has: a rod on a stiffer rod, long runs, the
projection of Uzawa."""

from __future__ import annotations

import numpy as np
import pytest
from bem_rod import rod as pulled_rod
from bem_rod import smooth_load
from plane_waves import MATERIAL, SQUARE

import vi_contact as vc
from demos.parts.problems.boundary_elements import pressed, steklov, unloaded
from vi_contact.bem import polygon
from vi_contact.bem.contact import BoundaryContact
from vi_contact.bem.contact_run import march_contact
from vi_contact.bem.energetic import energetic_blocks
from vi_contact.bem.joined_bodies import TwoBodies
from vi_contact.laws.friction import project

pytestmark = pytest.mark.serial
STIFF = vc.LinearElastic.from_wave_speeds(2.0, 1.0, 1.0)


@pytest.mark.long
def test_a_rod_on_a_stiffer_rod():
    """B8: c_P = 1 on c_P = 2, fixed at its base, rollers, a step until t = 5: pressures of the
    interface from the characteristics, 4/3, 20/9, 40/27 and 8/81 in a unit of time each, impulse
    5.13580 to 1e-4; never above 2.25."""
    k, exact = 6, 4.0 / 3.0 + 20.0 / 9.0 + 40.0 / 27.0 + 8.0 / 81.0
    upper = polygon([(0, 0), (1, 0), (1, 1), (0, 1)], 1.0 / k)
    lower = polygon([(0, -1), (1, -1), (1, 0), (0, 0)], 1.0 / k)
    rollers = [
        np.stack([mesh.nodes_of(mesh.labels % 2 == 1), np.zeros(len(mesh), bool)])
        for mesh in (upper, lower)
    ]
    rollers[1][1] = lower.nodes_of(lower.labels == 0)
    made = [
        steklov(mesh, material, dt=1.0 / k, steps=5 * k)
        for mesh, material in ((upper, MATERIAL), (lower, STIFF))
    ]
    above = pressed(
        made[0], pressure=lambda t: 1.0, top=2, contact=upper.labels == 0, fixed=rollers[0]
    )
    below = unloaded(made[1], contact=lower.labels == 2, fixed=rollers[1])
    found = march_contact(BoundaryContact(TwoBodies(above, below).condensed()))
    assert found.impulse[-1, 1] == pytest.approx(exact, rel=1e-4)
    assert found.resultant[:, 1].max() < 2.25 and found.worst < 1e-12


@pytest.mark.long
@pytest.mark.parametrize("ratio", [1.0, 4.0])
def test_long_runs_stay_bounded(ratio):
    """B5: the rod under the smooth load to t = 60, nothing grows, large steps damp (more:
    benchmarks/bem.py)."""
    dt = 0.5 * ratio
    blocks = energetic_blocks(polygon(SQUARE, 0.5), MATERIAL, dt=dt, steps=round(60.0 / dt))
    motion = pulled_rod(blocks, smooth_load).solve()
    size = np.abs(motion.displacement).max(axis=(1, 2))
    early, late = (motion.times > 2.0) & (motion.times <= 12.0), motion.times > 50.0
    assert size[late].max() < 1.05 * size[early].max() < 1.2
    assert motion.work.min() > -1e-12


def test_the_projection_of_uzawa_projects():
    """B10: what lies in the cone of a friction law stays as it is, to the last digit but one; twice
    is once."""
    random = np.random.default_rng(3)
    for dimensions in (1, 2):
        w, limit = random.standard_normal((200, dimensions)), np.abs(random.standard_normal(200))
        once = project(w, limit)
        assert (
            np.abs(project(once, limit) - once).max()
            <= 4.0 * np.finfo(float).eps * np.abs(once).max()
        )
        inside = np.linalg.norm(w, axis=1) <= limit
        assert 20 < inside.sum() < 180 and np.array_equal(once[inside], w[inside])
        assert (np.linalg.norm(once, axis=1) <= limit * (1.0 + 1e-15)).all()
