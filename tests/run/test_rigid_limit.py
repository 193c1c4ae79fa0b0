"""Limit loads of rigid blocks: by hand, of walls, of arches; mirrored, turned, in other units."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem, meshes
from vi_contact.core.errors import InputError, StepFailure
from vi_contact.run.rigid_blocks import GROUND, RigidBlocks

COMM = MPI.COMM_WORLD


def blocks_of(mesh: Any, *fixed: str) -> RigidBlocks:
    built, tags = fem.build_mesh(mesh, COMM)
    return vc.rigid_blocks(fem.find_joints(built, tags=tags), fixed=fixed)


def wall(half_first: bool, **given: Any) -> RigidBlocks:
    mesh = meshes.MasonryMesh(
        stones=5, courses=6, half_first=half_first, ground=0.2, divisions=(2, 1), **given
    )
    return blocks_of(mesh, "ground")


def stack(k: int, b: float = 1.0, h: float = 0.5) -> RigidBlocks:
    mesh = meshes.BricksMesh(
        counts=(1, k), lengths=(b, h), gaps=(0.0, 0.0), divisions=(1, 1), table=h, overhang=b
    )
    return blocks_of(mesh, "ground")


def certified(limit: vc.RigidLimit, mu: float) -> None:
    """Forces in their cones, blocks in balance by hand, a mechanism that associated flow allows."""
    assert limit.certificate < 1e-12
    pressing, shear = limit.forces[..., 0], limit.forces[..., 1]
    largest = np.abs(limit.forces).max()
    assert pressing.min() >= -1e-9 * largest
    assert np.all(np.abs(shear) <= mu * pressing + 1e-9 * largest)
    opening, sliding = limit.rates[..., 0], limit.rates[..., 1]
    assert np.all(opening >= mu * np.abs(sliding) - 1e-9)
    # no work in joints: the second block, which opens and slides, has N n - T t
    work = pressing * opening - shear * sliding
    assert np.abs(work).max() < 1e-9 * largest


@pytest.mark.parametrize("mu", [0.3, 0.65, 2.0])
@pytest.mark.parametrize("k", [1, 2, 4])
def test_a_stack_slides_or_topples(k: int, mu: float) -> None:
    """V2.21: tan = min(mu, b/(k h)) for k stones; four of 1 x 0.5 m topple at 0.5."""
    limit = vc.rigid_limit_load(stack(k), mu=mu)
    assert limit.multiplier == pytest.approx(min(mu, 1.0 / (k * 0.5)), rel=1e-12)
    certified(limit, mu)
    # to the other side too
    other = vc.rigid_limit_load(stack(k), mu=mu, live=(-1.0, 0.0))
    assert other.multiplier == pytest.approx(limit.multiplier, rel=1e-12)


@pytest.mark.parametrize(("half_first", "multiplier"), [(True, 0.642859), (False, 0.650000)])
def test_walls_have_the_known_bound(half_first: bool, multiplier: float) -> None:
    """V2.21: 5 x 6 stones of 0.4 x 0.175 m, mu 0.65, pushed in proportion to weight: half stones in
    the courses 1, 3, 5, and in 2, 4, 6."""
    limit = vc.rigid_limit_load(wall(half_first), mu=0.65)
    assert limit.multiplier == pytest.approx(multiplier, abs=1e-6)
    certified(limit, 0.65)
    assert bool(np.ptp(limit.velocities[:, 2]) > 1e-6) == half_first  # the other one slides


def test_unlike_meshes_have_the_same_bound() -> None:
    """Blocks are rigid: what counts is their outline."""
    limit = vc.rigid_limit_load(wall(True, unlike=3), mu=0.65)
    assert limit.multiplier == pytest.approx(0.642859, abs=1e-6)


def least_thickness(n: int, make: Any, mu: float = 1e3) -> float:
    """t/R below which an arch of n voussoirs does not stand, by bisection to 1e-7."""
    low, high = 0.05, 0.2
    while high - low > 1e-7:
        middle = 0.5 * (low + high)
        try:
            vc.rigid_limit_load(make(n, middle), mu=mu)
            high = middle
        except StepFailure:
            low = middle
    return high


def straight_arch(n: int, t: float) -> RigidBlocks:
    """Voussoirs with straight inner and outer sides, on abutments."""
    mesh = meshes.ArchMesh(voussoirs=n, thickness=t, abutment=0.2, divisions=(1, 1))
    return blocks_of(mesh, "left_abutment", "right_abutment")


def round_arch(n: int, t: float) -> RigidBlocks:
    """Voussoirs that are pieces of the ring itself, written down block by block."""
    inner, outer = 1.0 - 0.5 * t, 1.0 + 0.5 * t
    angles = meshes.ArchMesh(voussoirs=n).joint_angles
    middle = 0.5 * (angles[1:] + angles[:-1])
    half = 0.5 * math.pi / n
    area = half * (outer**2 - inner**2)
    radius = 2.0 / 3.0 * (outer**3 - inner**3) / (outer**2 - inner**2) * math.sin(half) / half
    direction = np.column_stack([np.sin(angles), np.cos(angles)])
    bodies = np.column_stack([np.arange(-1, n), np.append(np.arange(n), GROUND)])
    return RigidBlocks(
        areas=np.full(n, area),
        centres=radius * np.column_stack([np.sin(middle), np.cos(middle)]),
        bodies=bodies,
        ends=np.stack([inner * direction, outer * direction], axis=1),
        normals=np.column_stack([np.cos(angles), -np.sin(angles)]),
    )


@pytest.mark.slow
@pytest.mark.serial
@pytest.mark.parametrize(
    ("make", "known"),
    [
        (straight_arch, {16: 0.107076, 32: 0.107197, 64: 0.107383}),
        (round_arch, {16: 0.107237, 32: 0.107237, 64: 0.107394}),
    ],
    ids=["straight", "round"],
)
def test_arches_stand_down_to_the_known_thickness(make: Any, known: dict[int, float]) -> None:
    """V2.22: Milankovitch's 0.1075 of the semicircle is reached from below; halving joints never
    lowers it."""
    found = {n: least_thickness(n, make) for n in known}
    for n, ratio in known.items():
        assert found[n] == pytest.approx(ratio, abs=2e-6)
        assert found[n] <= 0.1075
    assert found[16] <= found[32] + 1e-6
    assert found[32] <= found[64] + 1e-6


def test_an_arch_below_the_known_thickness_is_told_by_its_hinges() -> None:
    """The symmetric mechanism of five hinges: the crown, the haunches and the springings."""
    vc.rigid_limit_load(straight_arch(16, 0.1072), mu=1e3)
    with pytest.raises(StepFailure, match="no equilibrium under the dead load") as failure:
        vc.rigid_limit_load(straight_arch(16, 0.1069), mu=1e3)
    assert "voussoir_8 and voussoir_9 at (0, 1)" in str(failure.value)
    assert "voussoir_3 and voussoir_4" in str(failure.value)
    # friction as small as 0.3 lets the same arch slide at the springings, however thick
    with pytest.raises(StepFailure, match="no equilibrium"):
        vc.rigid_limit_load(straight_arch(16, 0.18), mu=0.2)


def test_bounds_are_the_same_turned_mirrored_and_in_millimetres() -> None:
    blocks = wall(True)
    limit = vc.rigid_limit_load(blocks, mu=0.65)
    turn = np.array([[math.cos(0.5), -math.sin(0.5)], [math.sin(0.5), math.cos(0.5)]])
    turned = replace(
        blocks,
        centres=blocks.centres @ turn.T,
        ends=blocks.ends @ turn.T,
        normals=blocks.normals @ turn.T,
    )
    other = vc.rigid_limit_load(turned, mu=0.65, live=turn @ [1.0, 0.0], dead=turn @ [0.0, -1.0])
    assert other.multiplier == pytest.approx(limit.multiplier, rel=1e-10)
    mirror = np.array([-1.0, 1.0])
    mirrored = replace(
        blocks,
        centres=blocks.centres * mirror,
        ends=blocks.ends * mirror,
        normals=blocks.normals * mirror,
    )
    other = vc.rigid_limit_load(mirrored, mu=0.65, live=(-1.0, 0.0))
    assert other.multiplier == pytest.approx(limit.multiplier, rel=1e-10)
    scaled = replace(
        blocks, areas=1e6 * blocks.areas, centres=1e3 * blocks.centres, ends=1e3 * blocks.ends
    )
    other = vc.rigid_limit_load(scaled, mu=0.65, dead=(0.0, -7.0), live=(7.0, 0.0))
    assert other.multiplier == pytest.approx(limit.multiplier, rel=1e-10)
    np.testing.assert_allclose(
        other.forces.sum(axis=(0, 1))[0], 7e6 * limit.forces.sum(axis=(0, 1))[0]
    )


def test_loads_of_single_blocks_and_friction_of_single_joints() -> None:
    """A force on the top stone alone: it slides off at mu of its own weight, or where a joint below
    is smoother there."""
    blocks = stack(3)
    force = np.zeros((3, 3))
    force[2, 0] = 1.0
    weight = 0.5
    limit = vc.rigid_limit_load(blocks, mu=0.2, live=force)
    assert limit.multiplier == pytest.approx(0.2 * weight, rel=1e-12)
    assert limit.describe() == "brick_1_2 and brick_1_3 at (0.5, 1)"
    mu = [0.2, 0.2, 0.2]
    mu[next(j for j in range(3) if GROUND in blocks.bodies[j])] = 0.05
    limit = vc.rigid_limit_load(blocks, mu=mu, live=force)
    assert limit.multiplier == pytest.approx(0.05 * 3 * weight, rel=1e-12)
    assert limit.describe() == "brick_1_1 and the ground at (0.5, 0)"


def test_a_load_without_a_limit_has_no_mechanism() -> None:
    limit = vc.rigid_limit_load(stack(1), mu=0.3, live=(0.0, -1.0))
    assert limit.multiplier == math.inf
    assert limit.moving == ()


def test_blocks_that_nothing_holds_fall() -> None:
    blocks = RigidBlocks(
        areas=[1.0, 1.0],
        centres=[[0.0, 0.5], [5.0, 0.5]],
        bodies=[[0, GROUND]],
        ends=[[[-0.5, 0.0], [0.5, 0.0]]],
        normals=[[0.0, -1.0]],
        names=("held", "free"),
    )  # type: ignore[arg-type]
    with pytest.raises(StepFailure, match="fall: free$"):
        vc.rigid_limit_load(blocks, mu=0.5)


def test_wrong_input_is_refused() -> None:
    blocks = stack(1)
    for given, sentence in (
        ({"mu": -0.1}, "mu is -0.1; give zero or positive numbers"),
        ({"mu": [0.1, 0.2]}, "mu has shape .2,.; give numbers of shape .1,."),
        ({"mu": 0.1, "live": (0.0, 0.0)}, "live is zero everywhere; give the load that grows"),
        ({"mu": 0.1, "live": (0.0,)}, "live has shape .1,."),
        ({"mu": 0.1, "dead": [[0.0, 1.0, 0.0]] * 2}, "dead has shape .2, 3."),
    ):
        with pytest.raises(InputError, match=sentence):
            vc.rigid_limit_load(blocks, **given)  # type: ignore[arg-type]
    mesh, tags = fem.build_mesh(meshes.BricksMesh(counts=(1, 2), gaps=(0.0, 0.0)), COMM)
    joints = fem.find_joints(mesh, tags=tags)
    for fixed, sentence in (
        ([], "fixed is empty; give a body that does not move"),
        (["wall"], "fixed has 'wall'; give one of brick_1_1, brick_1_2, or its number"),
        ([0, 1], "fixed holds all bodies"),
    ):
        with pytest.raises(InputError, match=sentence):
            vc.rigid_blocks(joints, fixed=fixed)
    space, _ = fem.build_mesh(meshes.DrumsMesh(space=True, drums=2), COMM)
    with pytest.raises(InputError, match="the bound is for blocks in the plane"):
        vc.rigid_blocks(fem.find_joints(space), fixed=[0])
    with pytest.raises(InputError, match="areas is .0.0.; give positive numbers"):
        replace(blocks, areas=[0.0])  # type: ignore[arg-type]
    with pytest.raises(InputError, match="joint 0 is between block 0 and itself"):
        replace(blocks, bodies=[[0, 0]])  # type: ignore[arg-type]
    with pytest.raises(InputError, match="numbers from -1 to 3 and there are 1 blocks"):
        replace(blocks, bodies=[[3, -1]])  # type: ignore[arg-type]


def test_areas_and_centres_are_those_of_the_outlines() -> None:
    """Of trapezia too, far from the origin, turned."""
    column = meshes.DrumsMesh(drums=2, width=2.0, top_width=1.0, height=1.0, ground=0.5)
    blocks = blocks_of(column, "ground")
    # trapezium of the sides a below, b above and height h: A = (a + b) h / 2,
    # y = h (a + 2 b) / (3 (a + b))
    np.testing.assert_allclose(blocks.areas, [1.75, 1.25], rtol=1e-12)
    heights = [5.0 / 10.5, 1.0 + 3.5 / 7.5]
    np.testing.assert_allclose(blocks.centres[:, 1], heights, rtol=1e-12)
    np.testing.assert_allclose(blocks.centres[:, 0], 0.0, atol=1e-12)
    assert blocks.names == ("drum_1", "drum_2")
