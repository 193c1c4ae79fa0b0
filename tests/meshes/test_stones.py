"""Meshes of stones, walls, drums, arches and bricks: each stone is a body, of the right size."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from mesh_tools import size
from mpi4py import MPI

from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.meshes import ArchMesh, BricksMesh, DrumsMesh, MasonryMesh
from vi_contact.meshes.drums import map_to_disk
from vi_contact.meshes.extract import arrays_from_script
from vi_contact.meshes.gmsh_session import session
from vi_contact.meshes.rows import number_parts

pytestmark = pytest.mark.serial

ALL = [
    MasonryMesh(),
    MasonryMesh(half_first=True, ground=0.3, unlike=3, angle=0.5, simplices=True),
    MasonryMesh(depth=0.2, rows=2, ground=0.2, head_gap=2e-3, stones=2, courses=2),
    DrumsMesh(top_width=0.8, ground=0.5),
    DrumsMesh(space=True, top_width=0.8, unlike=1, ground=0.5),
    DrumsMesh(space=True, simplices=True, drums=2),
    ArchMesh(),
    ArchMesh(curved=True, abutment=0.3, depth=0.5, voussoirs=5),
    BricksMesh(),
    BricksMesh(
        counts=(3, 2, 2), lengths=(0.1, 0.2, 0.1), gaps=(0.01, 0.0, 0.02), divisions=(1, 2, 2),
        table=0.1, overhang=0.1,
    ),
]  # fmt: skip


def measure(mesh: Any, name: str) -> float:
    """Length, area or volume of a group."""
    _, tags = fem.build_mesh(mesh, MPI.COMM_SELF)
    return float(size(tags[name]))


def bodies_of(arrays: Any) -> int:
    """How many parts share no node."""
    width = arrays.cells.shape[1] - 1
    first = np.repeat(arrays.cells[:, 0], width)
    part = number_parts(len(arrays.points), first, arrays.cells[:, 1:].ravel())
    return int(part.max()) + 1


@pytest.mark.parametrize("mesh", ALL, ids=lambda mesh: type(mesh).__name__)
def test_every_stone_is_a_body_and_a_group(mesh: Any) -> None:
    """Groups of single bodies have all cells once; one more group holds all stones."""
    arrays = arrays_from_script(mesh)
    kin = next(grid.kin for grid in mesh.grids())
    own = {name: cells for name, cells in arrays.cell_groups.items() if name != kin}
    assert bodies_of(arrays) == len(own) == len(mesh.grids())
    np.testing.assert_array_equal(np.sum(list(own.values()), axis=0), 1)
    others = [name for name in own if "abutment" in name or name == "ground"]
    assert arrays.cell_groups[kin].sum() + sum(own[name].sum() for name in others) == len(
        arrays.cells
    )


@pytest.mark.parametrize("mesh", ALL, ids=lambda mesh: type(mesh).__name__)
def test_files_hold_the_same_mesh(mesh: Any) -> None:
    """By way of Gmsh's model too, with groups that several bodies share."""
    pytest.importorskip("gmsh")
    from vi_contact.meshes.extract import extract

    arrays = arrays_from_script(mesh)
    with session() as gmsh:
        mesh.build(gmsh)
        other = extract(gmsh, "model")
    np.testing.assert_array_equal(arrays.points, other.points)
    assert arrays.cell_groups.keys() == other.cell_groups.keys()
    for name, cells in arrays.cell_groups.items():
        assert cells.sum() == other.cell_groups[name].sum()
    for name, facets in arrays.facet_groups.items():
        assert len(facets) == len(other.facet_groups[name])


def test_a_wall_has_its_stones_where_they_belong() -> None:
    wall = MasonryMesh(stones=3, courses=2, length=0.4, height=0.2)
    arrays = arrays_from_script(wall)
    assert [name for name in arrays.cell_groups if name != "stones"] == [
        *(f"stone_1_{i}" for i in (1, 2, 3)),
        *(f"stone_2_{i}" for i in (1, 2, 3, 4)),
    ]
    spans = {}
    for name, cells in arrays.cell_groups.items():
        points = arrays.points[arrays.cells[cells]].reshape(-1, 2)
        spans[name] = (points.min(axis=0).tolist(), points.max(axis=0).tolist())
    assert spans["stone_2_1"] == ([0.0, 0.2], [0.2, 0.4])
    assert spans["stone_2_2"][0] == [0.2, 0.2]
    np.testing.assert_allclose(spans["stones"][1], [1.2, 0.4], rtol=1e-15)
    # half a stone has half the cells
    assert arrays.cell_groups["stone_2_1"].sum() == 4
    assert arrays.cell_groups["stone_2_2"].sum() == 8
    for name, length in (("left", 0.4), ("right", 0.4), ("top", 1.2), ("bottom", 1.2)):
        assert measure(wall, name) == pytest.approx(length, rel=1e-13)


def test_gaps_of_heads_leave_the_ends_where_they_are() -> None:
    wall = MasonryMesh(stones=2, courses=2, head_gap=0.01)
    x = [grid.nodes[..., 0] for grid in wall.grids()]
    ends = [(float(nodes.min()), float(nodes.max())) for nodes in x]
    np.testing.assert_allclose(
        ends, [(0.0, 0.395), (0.405, 0.8), (0.0, 0.195), (0.205, 0.595), (0.605, 0.8)]
    )


def test_round_drums_are_polygons() -> None:
    """Of 4 n sides, as large as such a polygon; tapered ones are frusta."""
    n = 4
    drum = DrumsMesh(space=True, drums=1, divisions=(n, 2), width=2.0)
    sides = 4 * n
    area = 0.5 * sides * math.sin(2.0 * math.pi / sides)
    assert measure(drum, "top") == pytest.approx(area, rel=1e-12)
    tapered = DrumsMesh(space=True, drums=2, divisions=(n, 2), width=2.0, top_width=1.0)
    assert measure(tapered, "top") == pytest.approx(0.25 * area, rel=1e-12)
    points = arrays_from_script(tapered).points
    radius = np.linalg.norm(points[:, [0, 2]], axis=1)
    assert np.all(radius <= 1.0 - 0.25 * points[:, 1] + 1e-12)


def test_the_map_to_the_disk_keeps_ratios_of_areas() -> None:
    x, y = np.meshgrid(np.linspace(-1.0, 1.0, 201), np.linspace(-1.0, 1.0, 201), indexing="ij")
    image = map_to_disk(np.column_stack([x.ravel(), y.ravel()])).reshape(201, 201, 2)
    first = image[1:, :-1] - image[:-1, :-1]
    second = image[:-1, 1:] - image[:-1, :-1]
    third = image[1:, 1:] - image[:-1, :-1]
    cross = lambda a, b: a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]  # noqa: E731
    areas = 0.5 * (cross(first, third) + cross(third, second))
    # all cells are alike but for chords of their curved sides, which are long round the centre
    areas[97:103, 97:103] = math.pi / 200**2
    np.testing.assert_allclose(areas, math.pi / 200**2, rtol=2e-2)
    np.testing.assert_allclose(np.linalg.norm(image[0], axis=1), 1.0, rtol=1e-14)


@pytest.mark.parametrize(("curved", "cells"), [(False, 1), (True, 1), (True, 8)])
def test_arches_have_the_area_of_their_ring(curved: bool, cells: int) -> None:
    """Chords of straight voussoirs, of curved ones between their nodes."""
    n, t = 16, 0.2
    arch = ArchMesh(voussoirs=n, thickness=t, curved=curved, divisions=(cells, 2))
    pieces = n * cells if curved else n
    angle = math.pi / pieces
    area = 0.5 * pieces * math.sin(angle) * ((1.0 + t / 2) ** 2 - (1.0 - t / 2) ** 2)
    assert measure(arch, "voussoirs") == pytest.approx(area, rel=1e-12)
    # symmetric, joints along radii
    x = arrays_from_script(arch).points[:, 0]
    assert abs(x.max() + x.min()) < 1e-15
    assert measure(arch, "left_springing") == pytest.approx(t, rel=1e-12)


@pytest.mark.parametrize(
    ("make", "sentence"),
    [
        (lambda: MasonryMesh(divisions=(2,)), "divisions is .2,.; give 2 whole numbers of cells"),
        (lambda: MasonryMesh(depth=0.2, divisions=(2, 2)), "give 3 whole numbers of cells"),
        (lambda: MasonryMesh(rows=2), "rows is 2 and depth is None; give the depth of a stone"),
        (lambda: MasonryMesh(head_gap=0.3), "head_gap is 0.3 m and half a stone 0.2 m; give a gap"),
        (lambda: MasonryMesh(stones=0), "stones is 0; give a whole number of at least 1"),
        (lambda: DrumsMesh(width=-1.0), "width is -1.0; give a finite number above zero"),
        (lambda: ArchMesh(thickness=2.0), "thickness is 2.0 m and radius 1.0 m; give a ring"),
        (lambda: ArchMesh(voussoirs=1), "1 voussoirs for an opening of 3.14159 rad; give more"),
        (lambda: BricksMesh(counts=(1,)), "counts is .1,.; give 2 or 3 whole numbers"),
        (lambda: BricksMesh(gaps=(0.1,)), "gaps is .0.1,. and counts .9, 1.; give as many"),
        (lambda: BricksMesh(divisions=(1, 10**8)), "asks for 9e.08 cells"),
    ],
)
def test_wrong_sizes_are_refused(make: Any, sentence: str) -> None:
    with pytest.raises(InputError, match=sentence):
        make()
