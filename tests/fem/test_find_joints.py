"""Joints found from the geometry: walls, gaps, turned and moved, on any ranks; what is refused."""

from __future__ import annotations

import logging
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

from vi_contact import fem, laws, meshes
from vi_contact.core.errors import InputError
from vi_contact.fem import compat
from vi_contact.fem.contact.joint_list import Joints
from vi_contact.meshes.grid import Grid
from vi_contact.meshes.stones import move_nodes

COMM = MPI.COMM_WORLD
SOLID = laws.LinearElastic(E=2.0e10, nu=0.2, rho=2400.0)
COMPILE = compat.compile_form


@dataclass(frozen=True)
class Moved:
    """A mesh whose points are moved by a function."""

    source: Any
    move: Callable[[Any], Any]

    def grids(self) -> list[Grid]:
        return [move_nodes(grid, self.move) for grid in self.source.grids()]

    def build(self, gmsh: Any) -> None:
        raise NotImplementedError


@dataclass(frozen=True)
class Boxes:
    """Boxes, each a body: (low, high, divisions)."""

    boxes: tuple[Any, ...]
    simplices: bool = False

    def grids(self) -> list[Grid]:
        return [
            meshes.stones.make_box(low, high, cells, simplices=self.simplices, name=f"box_{i + 1}")
            for i, (low, high, cells) in enumerate(self.boxes)
        ]

    def build(self, gmsh: Any) -> None:
        raise NotImplementedError


def find(script: Any, comm: MPI.Comm = COMM, **given: Any) -> Joints:
    mesh, tags = fem.build_mesh(script, comm)
    return fem.find_joints(mesh, tags=tags, **given)


def rows(joints: Joints) -> list[tuple[Any, ...]]:
    return [(joint.names, joint.counts, joint.alike) for joint in joints]


def same(one: Joints, other: Joints, tolerance: float = 1e-9) -> None:
    """Both lists have the same joints, numbers but for rounding."""
    assert rows(one) == rows(other)
    assert one.names == other.names
    assert one.lonely == other.lonely
    np.testing.assert_array_equal(one.corner_bodies, other.corner_bodies)
    for a, b in zip(one, other, strict=True):
        np.testing.assert_allclose(a.size, b.size, rtol=tolerance)
        np.testing.assert_allclose(a.normal, b.normal, atol=tolerance)
        np.testing.assert_allclose(a.middle, b.middle, atol=tolerance)


def wall_of(stones: int, courses: int, **given: Any) -> meshes.MasonryMesh:
    return meshes.MasonryMesh(stones=stones, courses=courses, **given)


def expected(stones: int, courses: int) -> tuple[int, float]:
    """Joints of a wall without ground, half stones in even courses, and their length [m]."""
    heads = sum(stones - 1 if course % 2 == 0 else stones for course in range(courses))
    beds = (courses - 1) * 2 * stones
    return heads + beds, heads * 0.175 + (courses - 1) * stones * 0.4


@pytest.mark.parametrize("unlike", [0, 5])
@pytest.mark.parametrize("simplices", [False, True])
def test_walls_have_their_joints(unlike: int, simplices: bool) -> None:
    """V2.20: every head and bed joint, with its length, whatever the meshes."""
    joints = find(wall_of(5, 6, unlike=unlike, simplices=simplices))
    count, length = expected(5, 6)
    assert len(joints) == count == 77
    np.testing.assert_allclose(sum(joint.size for joint in joints), length, rtol=1e-12)
    assert all(joint.gap == 0.0 for joint in joints)
    assert joints.lonely == ()
    assert not len(joints.corners)
    assert all(joint.alike for joint in joints) == (unlike == 0)


@pytest.mark.slow
@pytest.mark.parametrize(("stones", "courses", "count"), [(20, 10, 555), (20, 20, 1150)])
def test_large_walls_have_their_joints(stones: int, courses: int, count: int) -> None:
    joints = find(wall_of(stones, courses, unlike=4))
    assert (len(joints), count) == (expected(stones, courses)[0], len(joints))
    np.testing.assert_allclose(
        sum(joint.size for joint in joints), expected(stones, courses)[1], rtol=1e-12
    )


@pytest.mark.parametrize("unlike", [0, 3])
def test_stones_in_space_lie_on_two_or_on_four(unlike: int) -> None:
    """With rows across the wall a stone lies on four, with one row on two."""
    one = find(wall_of(2, 2, depth=0.2, unlike=unlike))
    # head joints 1 + 2, bed joints 2 a whole stone; areas 0.175 x 0.2 and 0.2 x 0.2
    assert len(one) == 3 + 4
    np.testing.assert_allclose(sum(joint.size for joint in one), 3 * 0.035 + 4 * 0.04, rtol=1e-12)
    two = find(wall_of(2, 2, depth=0.2, rows=2, unlike=unlike))
    below = {name: set() for name in two.names}  # type: ignore[var-annotated]
    for joint in two:
        first, second = sorted(joint.names)
        if first.split("_")[1] != second.split("_")[1]:
            below[second].add(first)
    assert len(below["stone_2_2_2"]) == 4  # the whole stone in the middle
    assert sum(map(len, below.values())) == 16


def turned(angle: float) -> Callable[[Any], Any]:
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    return lambda points: points @ turn.T


@pytest.mark.parametrize("unlike", [0, 5])
def test_the_list_is_the_same_turned_moved_scaled_and_mirrored(unlike: int) -> None:
    wall = wall_of(4, 4, unlike=unlike, ground=0.2, half_first=True)
    joints = find(wall)
    cases: list[tuple[Callable[[Any], Any], float]] = [
        (turned(math.pi / 6), 1.0),
        (lambda points: points + 1e4, 1.0),
        (lambda points: 1e3 * points, 1e3),
        (lambda points: points * [-1.0, 1.0], 1.0),
    ]
    for move, scale in cases:
        other = find(Moved(wall, move))
        assert rows(other) == rows(joints)
        # coordinates 1e4 m away have rounding of 1e-12 m
        sizes = [joint.size for joint in joints]
        np.testing.assert_allclose([joint.size / scale for joint in other], sizes, rtol=1e-9)
        for a, b in zip(joints, other, strict=True):
            np.testing.assert_allclose(move(a.middle[None])[0], b.middle, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(
    "script",
    [
        wall_of(3, 3, unlike=2, ground=0.2, simplices=True),
        wall_of(2, 3, depth=0.2, rows=2, ground=0.2),
        meshes.BricksMesh(
            counts=(2, 2, 2), lengths=(0.1, 0.2, 0.1), gaps=(0.0,) * 3, divisions=(2, 2, 2)
        ),
    ],
    ids=["wall", "wall in space", "bricks"],
)
def test_the_list_does_not_depend_on_ranks(script: Any) -> None:
    """On all ranks together as on each alone, and the facets are those of the mesh."""
    alone = find(script, MPI.COMM_SELF)
    together = find(script)
    same(alone, together, 1e-14)
    np.testing.assert_array_equal(alone.outlines, together.outlines)
    np.testing.assert_array_equal(alone.corners, together.corners)
    lists = COMM.allgather(repr(together))
    assert len(set(lists)) == 1


def test_facets_of_a_joint_are_its_sides() -> None:
    """Their nodes are where the sides are; every owned facet is on one rank."""
    mesh, _ = fem.build_mesh(wall_of(2, 1), COMM)
    (joint,) = fem.find_joints(mesh)
    owned = mesh.topology.index_map(1).size_local
    for facets, count in zip((joint.facets1, joint.facets2), joint.counts, strict=True):
        mine = int((facets.indices < owned).sum())
        assert COMM.allreduce(mine) == count == 2
        nodes = fem.compat.entities_to_geometry(mesh, 1, facets.indices)
        np.testing.assert_allclose(mesh.geometry.x[nodes][:, :, 0], 0.4)
    np.testing.assert_allclose(joint.normal, [1.0, 0.0], atol=1e-14)
    assert joint.ends is not None
    np.testing.assert_allclose(joint.ends, [[0.4, 0.0], [0.4, 0.175]], atol=1e-14)


@pytest.mark.long
def test_gaps_are_found_within_what_is_asked() -> None:
    """Heads that are 2 mm open: beds alone, then all; a gap too large does not skip a stone."""
    wall = wall_of(5, 6, head_gap=2e-3, unlike=4)
    beds = 5 * 10
    assert len(find(wall)) == beds
    for within in (3e-3, 0.2, 0.5):
        joints = find(wall, within=within)
        assert len(joints) == 77
        heads = [joint for joint in joints if abs(joint.normal[0]) > 0.5]
        np.testing.assert_allclose([joint.gap for joint in heads], 2e-3, rtol=1e-9)
        np.testing.assert_allclose([joint.size for joint in heads], 0.175, rtol=1e-9)


def test_what_is_half_hidden_counts_as_far_as_it_is_seen() -> None:
    """A plate over two blocks of unlike height: 0.6 m of the lower one are in front of it."""
    script = Boxes(
        (
            ((0.0, 0.0), (1.0, 1.0), (1, 1)),
            ((0.4, 1.5), (1.4, 2.0), (1, 1)),
            ((-1.0, 3.0), (3.0, 3.5), (1, 1)),
        )
    )
    joints = find(script, within=5.0)
    sizes = {joint.names: joint.size for joint in joints}
    assert sizes[("box_1", "box_2")] == pytest.approx(0.6)
    upper = {frozenset(names): size for names, size in sizes.items()}
    assert upper[frozenset(("box_1", "box_3"))] == pytest.approx(0.4)
    assert upper[frozenset(("box_2", "box_3"))] == pytest.approx(1.0)
    in_space = Boxes(
        tuple(
            ((*low, 0.0), (*high, 1.0 + number), (*cells, 1))
            for number, (low, high, cells) in enumerate(script.boxes)
        ),
        simplices=True,
    )
    areas = {frozenset(joint.names): joint.size for joint in find(in_space, within=5.0)}
    assert areas[frozenset(("box_1", "box_2"))] == pytest.approx(0.6)
    assert areas[frozenset(("box_1", "box_3"))] == pytest.approx(0.4)


def test_side_one_is_the_side_that_is_covered() -> None:
    """A small block on a coarse large one, whichever comes first in the mesh."""
    low = ((0.0, 0.0), (3.0, 1.0), (1, 1))
    high = ((1.0, 1.0), (2.0, 2.0), (4, 4))
    for boxes in ((low, high), (high, low)):
        (joint,) = find(Boxes(boxes))
        assert joint.names[0] == f"box_{1 + boxes.index(high)}"
        assert joint.covered == pytest.approx((1.0, 1.0 / 3.0))
        np.testing.assert_allclose(joint.normal, [0.0, -1.0], atol=1e-14)


def test_two_pads_are_two_joints_and_a_notch_has_one_for_each_side() -> None:
    pads = (
        ((0.0, 0.0), (1.0, 1.0), (2, 2)),
        ((3.0, 0.0), (4.0, 1.0), (2, 2)),
        ((0.0, 1.0), (4.0, 2.0), (8, 2)),
    )
    assert len(find(Boxes(pads))) == 2

    # one body of three blocks round a fourth one: the sides of the notch turn by 90°
    mesh = meshes.ChannelMesh(size=0.5)
    joints = find(mesh)
    normals = sorted(tuple(np.round(joint.normal, 6) + 0.0) for joint in joints)
    assert len(joints) == 3
    assert {abs(normal[0]) for normal in normals} == {0.0, 1.0}


@dataclass(frozen=True)
class Rings:
    """Two concentric quarter rings that touch, of so many chords each, curved."""

    inner: int
    outer: int

    def grids(self) -> list[Grid]:
        parts = []
        for name, radius, cells in (("inner", 0.5, self.inner), ("outer", 1.5, self.outer)):
            box = meshes.stones.make_box(
                (0.0, 0.0), (1.0, 1.0), (cells, 2), simplices=False, name=name
            )

            def shape(points: Any, radius: float = radius) -> Any:
                angle = 0.5 * math.pi * points[:, 0]
                r = radius + points[:, 1]
                return np.column_stack([r * np.sin(angle), r * np.cos(angle)])

            parts.append(move_nodes(box, shape))
        return parts

    def build(self, gmsh: Any) -> None:
        raise NotImplementedError


@pytest.mark.parametrize(("inner", "outer"), [(8, 8), (8, 13), (24, 9), (31, 32)])
def test_curved_joints_have_no_gaps_and_no_overlaps(inner: int, outer: int) -> None:
    """Polygons of a circle leave it; where they enter each other nothing overlaps."""
    (joint,) = find(Rings(inner, outer))
    assert joint.largest_gap == 0.0
    # the chords of side 1 add up to at most the arc, up to (angle of a chord)²/24 less
    arc = 1.5 * 0.5 * math.pi
    assert arc * (1.0 - (0.5 * math.pi / min(inner, outer)) ** 2 / 8.0) < joint.size < arc * 1.02


def test_corners_that_meet_alone_are_listed() -> None:
    """Two bricks that meet at a corner have no joint, beside those of the crossing."""
    joints = find(meshes.BricksMesh(counts=(2, 2), gaps=(0.0, 0.0)))
    assert len(joints) == 4
    np.testing.assert_allclose(joints.corners, [[0.1, 0.2], [0.1, 0.2]], rtol=1e-14)
    assert [tuple(row) for row in joints.corner_bodies] == [(0, 3), (1, 2)]
    assert "brick_1_1 and brick_2_2 at (0.1, 0.2)" in repr(joints)
    # a block that stands on its corner
    box = ((0.0, 0.0), (1.0, 1.0), (2, 2))
    half = math.sqrt(0.5)
    tilted = meshes.Blocks(
        {
            "ground": meshes.BlockMesh(lengths=(4.0, 1.0), divisions=(3, 1), corner=(-2.0, -1.0)),
            "block": meshes.BlockMesh(lengths=(half, half), angle=math.pi / 4),
        }
    )
    joints = find(tilted)
    assert not len(joints)
    assert box and len(joints.corners) == 1
    np.testing.assert_allclose(joints.corners, [[0.0, 0.0]], atol=1e-15)


def test_bodies_without_joints_are_told(caplog: pytest.LogCaptureFixture) -> None:
    script = Boxes((((0.0, 0.0), (1.0, 1.0), (2, 2)), ((3.0, 0.0), (4.0, 1.0), (2, 2))))
    with caplog.at_level(logging.WARNING):
        joints = find(script)
    assert joints.lonely == (0, 1)
    assert "without a joint: box_1, box_2" in repr(joints)
    if COMM.rank == 0:
        assert "2 of 2 bodies touch no other within 0 m: box_1, box_2" in caplog.text


@pytest.mark.parametrize(
    ("boxes", "depth", "place"),
    [
        # by a hundredth, by the millionth part that rounding does not explain, through and through
        ([((0.0, 0.0), (1.0, 1.0), (4, 4)), ((0.2, 0.99), (1.2, 1.99), (7, 7))], 0.01, 1),
        ([((0.0, 0.0), (1.0, 1.0), (4, 4)), ((0.2, 1.0 - 1e-5), (1.2, 2.0), (7, 7))], 1e-5, 1),
        ([((0.0, 0.0), (1.0, 1.0), (4, 4)), ((0.0, 0.0), (1.0, 1.0), (3, 3))], 1.0, None),
        ([((0.0, 0.0), (4.0, 4.0), (9, 9)), ((1.9, 1.9), (2.1, 2.1), (1, 1))], 2.0, None),
        ([((0.0, 0.4), (3.0, 0.6), (9, 1)), ((1.4, 0.0), (1.6, 1.0), (1, 5))], 0.1, None),
    ],
)
def test_bodies_that_overlap_are_refused(boxes: list[Any], depth: float, place: int | None) -> None:
    with pytest.raises(
        InputError, match="box_1 and box_2 overlap by|box_2 and box_1 overlap by"
    ) as e:
        find(Boxes(tuple(boxes)))
    told = float(str(e.value).split("overlap by ")[1].split(" m ")[0])
    # that of a body deep inside another is a distance to some facet, told roughly
    if place is not None:
        assert told == pytest.approx(depth, rel=2e-2)
    else:
        assert 0.0 < told <= 1.01 * depth
    with pytest.raises(InputError, match="overlap by"):
        in_space = tuple(((*low, 0.0), (*high, 1.0), (*cells, 2)) for low, high, cells in boxes)
        find(Boxes(in_space, simplices=True))


def test_rounding_and_thin_layers_are_no_overlap() -> None:
    """Layers thinner than their facets, and stones 1e-8 m in each other."""
    layers = [((0.0, 0.1 * k), (2.0, 0.1 * (k + 1)), (2, 1)) for k in range(5)]
    assert len(find(Boxes(tuple(layers)))) == 4
    layers[2] = ((0.0, 0.2 - 1e-8), (2.0, 0.3 + 1e-8), (2, 1))
    assert len(find(Boxes(tuple(layers)))) == 4
    in_space = tuple(((*low, 0.0), (*high, 2.0), (*cells, 2)) for low, high, cells in layers)
    assert len(find(Boxes(in_space))) == 4


def test_groups_say_between_which_bodies() -> None:
    mesh, tags = fem.build_mesh(wall_of(2, 2, ground=0.2), COMM)
    every = fem.find_joints(mesh, tags=tags)
    stones = fem.find_joints(mesh, tags=tags, between=[tags["stones"]])
    beds = fem.find_joints(mesh, tags=tags, between=[tags["ground"], tags["stones"]])
    assert (len(every), len(stones), len(beds)) == (9, 7, 2)
    assert all("ground" in joint.names for joint in beds)
    one = tags["stone_1_1"]
    part = fem.Cells.where("part", mesh, lambda x: (x[0] < 0.15) & (x[1] > -1e-9) & (x[1] < 0.18))
    with pytest.raises(InputError, match="'part' is a part of a body"):
        fem.find_joints(mesh, between=[part])
    with pytest.raises(InputError, match="between has 3 members; give one or two groups"):
        fem.find_joints(mesh, between=[one, one, one])
    with pytest.raises(InputError, match="within is -1.0; give zero or a positive finite number"):
        fem.find_joints(mesh, within=-1.0)
    with pytest.raises(InputError, match="give a DOLFINx mesh, or a system"):
        fem.find_joints("wall")  # type: ignore[arg-type]


def test_ties_are_no_joints() -> None:
    """A tied joint is left out, and the list says so."""
    box = meshes.BlockMesh(lengths=(2.0, 1.0), divisions=(4, 2))
    mesh, tags = fem.build_mesh(meshes.TwoBlocks(lower=box, upper=box), COMM)
    tie = fem.Tied(tags["lower_top"], tags["upper_bottom"])
    system = fem.assemble(mesh, SOLID, clamped=tags["lower_bottom"], tied=[tie])
    joints = fem.find_joints(system)
    assert (len(joints), joints.tied, joints.lonely) == (0, 4, ())
    assert "tied, and no joint: 4 pairs of facets" in repr(joints)
    assert len(fem.find_joints(mesh)) == 1


def test_contact_pairs_makes_the_conditions_of_all_joints() -> None:
    """A column of drums on the ground: the conditions of its pairs, one after the other."""
    column = meshes.DrumsMesh(drums=3, ground=0.5, divisions=(3, 2))
    mesh, tags = fem.build_mesh(column, COMM)
    system = fem.assemble(mesh, SOLID, clamped=tags["ground_bottom"])
    surface = fem.contact_pairs(system, tags=tags)
    assert surface.total == 3 * 4
    np.testing.assert_allclose(surface.everywhere(surface.gap0), 0.0, atol=1e-12)
    assert COMM.allreduce(surface.weights.sum()) == pytest.approx(3.0)
    apart = Boxes((((0.0, 0.0), (1.0, 1.0), (2, 2)), ((3.0, 0.0), (4.0, 1.0), (2, 2))))
    mesh, _ = fem.build_mesh(apart, COMM)
    with pytest.raises(InputError, match="no two bodies touch within 0 m: give within="):
        fem.contact_pairs(fem.assemble(mesh, SOLID))


@pytest.mark.parametrize("unlike", [0, 3])
def test_joints_share_their_assemblies(unlike: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Forms are looked up, two an assembly, no oftener for 180 joints than for a fourth of them."""
    counts = []
    for stones in (4, 8):
        wall = meshes.MasonryMesh(
            stones=stones, courses=stones, ground=0.2, divisions=(2, 1), unlike=unlike
        )
        mesh, tags = fem.build_mesh(wall, COMM)
        system = fem.assemble(mesh, SOLID, clamped=tags["ground_bottom"])
        calls = []

        def compile_form(form: Any, *given: Any, calls: Any = calls) -> Any:
            calls.append(form)
            return COMPILE(form, *given)

        monkeypatch.setattr(compat, "compile_form", compile_form)
        assert fem.contact_pairs(system).total > 3 * stones**2
        counts.append(len(calls))
    assert 0 < counts[1] <= counts[0]
