"""A block that rests on another, with random meshes and offsets: its contact forces balance its
weight by hand.

The sum of the normal forces is the weight, their moment is that of the weight at the middle of the
block, and all of them press, whatever the facets of both sides: slivers at the ends, cells of other
sizes, nodes that nearly meet."""

from __future__ import annotations

from math import isclose
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from fuzz import Fuzz
from two_bodies import SOFT, two_blocks

import vi_contact as vc
from vi_contact import fem
from vi_contact.fem.contact.mortar import DualMortar
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import TwoBlocks

st = pytest.importorskip("hypothesis.strategies")

pytestmark = pytest.mark.serial
WEIGHT = 9.81 * SOFT.rho  # [N/m³]
WIDE, LONG, HIGH = 4.0, 2.0, 0.5  # lengths of lower and upper block, height of both [m]
SAME = 1e-7  # of the weight: certificates are below 1e-9


@pytest.mark.long
@Fuzz("pairs", __file__).property(
    upper=st.integers(1, 7),
    lower=st.integers(1, 9),
    simplices=st.booleans(),
    swapped=st.booleans(),
    offset=st.integers(-90, 90),
    sliver=st.integers(-12, -1),
    examples=20,
)
def test_contact_forces_balance_the_weight(
    upper: int, lower: int, simplices: bool, swapped: bool, offset: int, sliver: int
) -> None:
    """A place in hundredths of the overhang, and a sliver of a power of ten beside it."""
    from mpi4py import MPI

    middle = 0.5 * (WIDE - LONG) * (1.0 + offset / 100.0) + 10.0**sliver
    blocks = TwoBlocks(
        upper=BlockMesh(lengths=(LONG, HIGH), divisions=(upper, 2), simplices=simplices),
        lower=BlockMesh(lengths=(WIDE, HIGH), divisions=(lower, 2), simplices=simplices),
        offset=(middle, 0.0),
    )
    loads = lambda tags: [fem.BodyForce((0.0, -WEIGHT))]  # noqa: E731
    system, tags = two_blocks(
        MPI.COMM_SELF, blocks, clamped=lambda tags: tags["lower_bottom"], loads=loads
    )
    sides = [tags["upper_bottom"], tags["lower_top"]]
    try:
        surface = fem.contact_pair(
            system, *(sides[::-1] if swapped else sides), matching=DualMortar()
        )
    except vc.InputError as refusal:
        # nodes that coincide but for a sliver may be refused, with their place; nothing else may
        assert "(" in str(refusal) and " at " in str(refusal)
        return
    problem = vc.ContactProblem(system, surface)
    state = vc.static_equilibrium(problem)
    weight, x = WEIGHT * LONG * HIGH, surface.points[:, 0]
    assert np.all(state.r_n >= 0.0)
    assert isclose(state.r_n.sum(), weight, rel_tol=SAME)
    upper_one, both = moments(problem, state, middle)
    assert abs(upper_one) <= SAME * weight * WIDE, x
    # what the lower block feels is the opposite, at the same place
    assert abs(both) <= SAME * weight * WIDE, x


def moments(problem: Any, state: Any, middle: float) -> tuple[float, float]:
    """The moments of contact forces on the upper block, and on both, about the middle of its foot
    [N m], by virtual work: a small turn moves nodes by (x - middle) upwards, and the forces do the
    work of the moment."""
    system, surface, space = problem.static_load, problem.surface, problem.system.space
    turn = np.zeros((len(space.nodes), 2))
    turn[:, 1] = space.points[:, 0] - middle - 0.5 * LONG
    turn[:, 0] = HIGH - space.points[:, 1]
    over = space.body_of_node == space.body_of_node[np.argmax(space.points[:, 1])]
    load = surface.reaction_load(state.r_n, system.rows)

    def work(moved: Any) -> float:
        free = surface.in_frames(space.restrict(moved))
        if surface.coupling is not None:
            free = 2.0 * free - surface.coupling @ free
        return float(free @ load)

    return work(np.where(over[:, None], turn, 0.0)), work(turn)
