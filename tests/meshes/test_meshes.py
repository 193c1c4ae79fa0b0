"""Gmsh scripts: exact nodes, named groups, the same mesh every time, and no traces in the user's
Gmsh."""

import math
import os
import signal
import subprocess
import sys
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest

from meshes.__main__ import parser
from vi_contact import meshes
from vi_contact.core.errors import InputError
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.extract import arrays_from_file, arrays_from_script
from vi_contact.meshes.gmsh_session import session, write
from vi_contact.meshes.rows import cell_sides
from vi_contact.meshes.wall import WallMesh

gmsh = pytest.importorskip("gmsh")
pytestmark = pytest.mark.serial

SOURCE_TREE = Path(__file__).resolve().parents[2]


def nodes_of(rows):
    return np.unique(rows)


def segment_lengths(points, rows):
    return np.linalg.norm(points[rows[:, 1]] - points[rows[:, 0]], axis=1)


def polygon_areas(points, cells):
    x, y = points[cells].T
    return 0.5 * (x * np.roll(y, -1, axis=0) - y * np.roll(x, -1, axis=0)).sum(axis=0)


# The wall of seed 000, Fig. 2 (verification 4.2)
# ----------------------------------------------------------------------


def test_shaken_wall_has_its_nodes_at_exact_multiples_of_three_quarters():
    wall = arrays_from_script(WallMesh())
    assert wall.cell == "quadrilateral"
    assert wall.cells.shape == (8 * 12, 4)
    assert wall.points.shape == (9 * 13, 2)
    assert np.array_equal(wall.points / 0.75, np.rint(wall.points / 0.75))
    assert np.array_equal(wall.points.min(axis=0), [0.0, 0.0])
    assert np.array_equal(wall.points.max(axis=0), [6.0, 9.0])
    assert np.array_equal(polygon_areas(wall.points, wall.cells), np.full(96, 0.75**2))


def test_wall_groups_are_base_face_top_back_with_forty_boundary_nodes():
    wall = arrays_from_script(WallMesh())
    where = {"base": (1, 0.0), "face": (0, 6.0), "top": (1, 9.0), "back": (0, 0.0)}
    assert set(wall.facet_groups) == set(where)
    for name, (axis, value) in where.items():
        assert np.all(wall.points[wall.facet_groups[name]][..., axis] == value)
        assert len(wall.facet_groups[name]) == (12 if axis == 0 else 8)
    assert len(nodes_of(np.vstack(list(wall.facet_groups.values())))) == 40
    assert list(wall.cell_groups) == ["wall"] and wall.cell_groups["wall"].all()


def test_wall_of_triangles_halves_every_quadrilateral_with_the_same_nodes():
    quads, triangles = arrays_from_script(WallMesh()), arrays_from_script(WallMesh(triangles=True))
    assert triangles.cell == "triangle"
    assert np.array_equal(triangles.points, quads.points)
    assert np.array_equal(
        polygon_areas(triangles.points, triangles.cells), np.full(192, 0.5 * 0.75**2)
    )


@pytest.mark.parametrize("triangles", [False, True])
@pytest.mark.parametrize("size", [0.5, 1.1])
def test_irregular_wall_has_cells_of_one_type_and_about_the_asked_size(triangles, size):
    wall = arrays_from_script(WallMesh(size=size, triangles=triangles))
    assert wall.cell == ("triangle" if triangles else "quadrilateral")
    assert math.isclose(polygon_areas(wall.points, wall.cells).sum(), 54.0, rel_tol=1e-13)
    for name, length in {"base": 6.0, "face": 9.0, "top": 6.0, "back": 9.0}.items():
        segments = segment_lengths(wall.points, wall.facet_groups[name])
        assert math.isclose(segments.sum(), length, rel_tol=1e-13)
        assert np.all(segments < 1.3 * size) and np.all(segments > 0.6 * size)


def test_a_wall_takes_other_sizes_and_divisions():
    wall = arrays_from_script(WallMesh(height=3.0, width=1.0, divisions=(2, 5)))
    assert len(wall.cells) == 10
    assert math.isclose(polygon_areas(wall.points, wall.cells).sum(), 3.0, rel_tol=1e-14)
    assert len(wall.facet_groups["face"]) == 5


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        ({"divisions": (8, 12), "size": 0.5}, "leave one of them out"),
        ({"height": -9.0}, "positive"),
        ({"width": float("nan")}, "positive"),
        ({"divisions": (8, 0)}, "at least 1"),
        ({"divisions": (8.5, 12)}, "whole numbers"),
        ({"size": 0.0}, "cell size is 0.0 m"),
        ({"size": 7.0}, "up to the wall"),
    ],
)
def test_a_wall_that_cannot_be_is_refused_with_a_sentence(bad, words):
    with pytest.raises(InputError, match=words):
        WallMesh(**bad)


# Blocks
# --------------------------------------------------------------------------------------------------


def volume(arrays):
    """Sum over cells of |det J| times the reference volume; exact for simplices and
    parallelepipeds."""
    d = arrays.points.shape[1]
    simplex = arrays.cells.shape[1] == d + 1
    ends = [1, 2, 3][:d] if simplex else [1, 3, 4][:d]
    edges = arrays.points[arrays.cells[:, ends]] - arrays.points[arrays.cells[:, :1]]
    return np.linalg.det(edges) / (math.factorial(d) if simplex else 1)


@pytest.mark.parametrize("simplices", [False, True])
@pytest.mark.parametrize("d", [1, 2, 3])
def test_block_fills_its_box_with_equal_right_handed_cells_and_names_its_sides(d, simplices):
    lengths, divisions = (2.0, 3.0, 5.0)[:d], (3, 4, 2)[:d]
    block = arrays_from_script(BlockMesh(lengths=lengths, divisions=divisions, simplices=simplices))
    boxes, pieces = math.prod(divisions), math.factorial(d) if simplices else 1
    assert np.allclose(volume(block), math.prod(lengths) / boxes / pieces, rtol=1e-13, atol=0.0)
    assert len(block.cells) == boxes * pieces
    names = (("left", "right"), ("bottom", "top"), ("back", "front"))[:d]
    assert list(block.facet_groups) == [name for pair in names for name in pair]
    for axis, pair in enumerate(names):
        for name, value in zip(pair, (0.0, lengths[axis]), strict=True):
            assert np.all(block.points[block.facet_groups[name]][..., axis] == value)
            expected = boxes // divisions[axis] * (math.factorial(d - 1) if simplices else 1)
            assert len(block.facet_groups[name]) == expected


@pytest.mark.parametrize("simplices", [False, True])
@pytest.mark.parametrize("d", [2, 3])
def test_block_groups_are_the_whole_boundary(d, simplices):
    block = arrays_from_script(
        BlockMesh(lengths=(1.0,) * d, divisions=(3, 2, 2)[:d], simplices=simplices)
    )
    sides, count = np.unique(cell_sides(block.cells, block.cell)[0], axis=0, return_counts=True)
    assert set(count) == {1, 2}
    named = np.sort(np.vstack(list(block.facet_groups.values())), axis=1)
    assert np.array_equal(np.unique(named, axis=0), sides[count == 1])


def test_block_is_placed_bent_and_truly_turned():
    """A quarter ring 1 < r < 2 from a rectangle, then turned: radii stay, polar angles run from 30
    to 120 degrees."""

    def ring(x):
        return np.stack([x[:, 0] * np.cos(x[:, 1]), x[:, 0] * np.sin(x[:, 1])], axis=1)

    block = BlockMesh(
        lengths=(1.0, math.pi / 2),
        divisions=(2, 8),
        corner=(1.0, 0.0),
        deform=ring,
        angle=math.radians(30.0),
    )
    arrays = arrays_from_script(block)
    for name, radius in {"left": 1.0, "right": 2.0}.items():
        x, y = arrays.points[nodes_of(arrays.facet_groups[name])].T
        assert np.allclose(np.hypot(x, y), radius, rtol=1e-15)
    for name, degrees in {"bottom": 30.0, "top": 120.0}.items():
        x, y = arrays.points[nodes_of(arrays.facet_groups[name])].T
        assert np.allclose(np.degrees(np.arctan2(y, x)), degrees, rtol=1e-14)


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        ({"lengths": (1.0,) * 4, "divisions": (1,) * 4}, "1, 2 or 3"),
        ({"lengths": (1.0, 1.0), "divisions": (1,)}, "1, 2 or 3"),
        ({"lengths": (1.0, math.inf)}, "positive"),
        ({"divisions": (0, 1)}, "at least 1"),
        ({"corner": (1.0,)}, "give 2 coordinates"),
        ({"lengths": (1.0,), "divisions": (1,), "angle": 0.1}, "cannot be turned"),
    ],
)
def test_a_block_that_cannot_be_is_refused_with_a_sentence(bad, words):
    with pytest.raises(InputError, match=words):
        BlockMesh(**bad)


def test_a_map_that_folds_the_block_over_itself_is_refused():
    with pytest.raises(InputError, match="8 cells of BlockMesh have a neighbour on the same side"):
        arrays_from_script(BlockMesh(divisions=(4, 4), deform=lambda x: (x - [0.4, 0.0]) ** [2, 1]))
    with pytest.raises(
        InputError, match=r"returned shape \(25, 1\) for points \(25, 2\): return that"
    ):
        arrays_from_script(BlockMesh(divisions=(4, 4), deform=lambda x: x[:, :1]))


# Files
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "mesh",
    [
        WallMesh(),
        WallMesh(size=1.0),
        BlockMesh(lengths=(1.0,) * 3, divisions=(2, 2, 2), simplices=True, angle=0.5),
    ],
    ids=["divisions", "size", "tetrahedra"],
)
def test_a_written_mesh_reads_back_the_same_and_is_written_the_same_every_time(mesh, tmp_path):
    write(mesh, tmp_path / "one.msh")
    write(mesh, tmp_path / "two.msh")
    assert (tmp_path / "one.msh").read_bytes() == (tmp_path / "two.msh").read_bytes()
    memory, file = arrays_from_script(mesh), arrays_from_file(tmp_path / "one.msh")
    assert np.allclose(memory.points, file.points, rtol=1e-15, atol=0.0)  # Gmsh writes 16 digits
    assert np.array_equal(memory.cells, file.cells)
    assert memory.facet_groups.keys() == file.facet_groups.keys()
    assert all(
        np.array_equal(memory.facet_groups[name], file.facet_groups[name])
        for name in file.facet_groups
    )


def run(*arguments, cwd):
    command = [sys.executable, *map(str, arguments)]  # env: see shell() in test_cli.py
    return subprocess.run(
        command, cwd=cwd, capture_output=True, text=True, timeout=600, env=dict(os.environ)
    )


@pytest.mark.long
def test_the_folder_of_the_source_tree_writes_meshes_without_installation(tmp_path):
    options = ["--height", 4, "--width", 2, "--divisions", 2, 4, "--triangles", "-o", "wall.msh"]
    done = run(SOURCE_TREE / "meshes", "wall", *options, cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    wall = arrays_from_file(tmp_path / "wall.msh")
    assert (wall.cell, len(wall.cells)) == ("triangle", 16)
    assert np.array_equal(wall.points.max(axis=0), [2.0, 4.0])


@pytest.mark.long
def test_it_runs_as_a_module(tmp_path):
    options = [
        "--lengths",
        1,
        2,
        3,
        "--divisions",
        1,
        2,
        3,
        "--simplices",
        "--angle",
        0.1,
        "-o",
        tmp_path / "it.msh",
    ]
    done = run("-m", "meshes", "block", *options, cwd=SOURCE_TREE)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert len(arrays_from_file(tmp_path / "it.msh").cells) == 36


@pytest.mark.parametrize("shape", ["block", "channel", "wall"])
def test_every_number_of_a_shape_is_an_option(shape: str, capsys):
    with pytest.raises(SystemExit, match="^0$"):
        parser().parse_args([shape, "--help"])
    said = capsys.readouterr().out
    for field in fields(getattr(meshes, f"{shape.capitalize()}Mesh")):
        assert field.name in (
            "corner",
            "deform",
        ) or f"--{field.name.replace('_', '-')} " in said.replace("]", " ")


@pytest.mark.long
@pytest.mark.parametrize(
    "shape, words, kind",
    [
        ("wall", "--divisions 2 4", "quadrilateral"),
        ("disk", "--radius 1 --size 0.5 --foot 0.5", "triangle"),
        ("ball", "--radius 1 --size 0.25 --foot 0.5", "tetrahedron"),
    ],
)
def test_every_shape_is_a_command(shape: str, words: str, kind: str, tmp_path):
    """As python3 meshes SHAPE, and as the file of the shape."""
    here = (
        [SOURCE_TREE / "meshes", shape]
        if shape == "disk"
        else [SOURCE_TREE / "meshes" / f"{shape}.py"]
    )
    done = run(*here, *words.split(), "-o", "it.msh", cwd=tmp_path)
    assert (done.returncode, done.stdout, done.stderr) == (0, "", "")
    assert arrays_from_file(tmp_path / "it.msh").cell == kind


@pytest.mark.long
def test_meshes_explain_bad_input_in_one_line(tmp_path):
    for words, said in (
        (("wall", "--size", -1), "cell size is -1.0 m: give one above 0 and up to the wall's"),
        (("block", "-o", "nowhere/block.msh"), "nowhere does not exist"),
    ):
        done = run(SOURCE_TREE / "meshes", *words, cwd=tmp_path)
        assert done.returncode == 1
        assert done.stderr.count("\n") == 1 and said in done.stderr


# The user's Gmsh
# --------------------------------------------------------------------------------------------------


def test_a_session_is_silent_and_gives_gmsh_and_interrupts_back(capfd):
    handler = signal.getsignal(signal.SIGINT)
    for _ in range(2):
        with session() as ours:
            assert ours.model.getEntities() == []
            assert signal.getsignal(signal.SIGINT) is handler
    arrays_from_script(WallMesh(size=2.0))
    assert signal.getsignal(signal.SIGINT) is handler
    assert capfd.readouterr() == ("", "")


def test_a_gmsh_in_use_keeps_its_models_and_options():
    gmsh.initialize([], readConfigFiles=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.ElementOrder", 2)
        gmsh.option.setNumber("Mesh.SaveAll", 1)
        gmsh.model.add("mine")
        gmsh.model.geo.addPoint(1.0, 2.0, 3.0, tag=7)
        gmsh.model.geo.synchronize()
        gmsh.model.add("mine too")
        gmsh.model.setCurrent("mine")
        models = list(gmsh.model.list())
        wall = arrays_from_script(WallMesh(size=2.0))
        assert wall.cell == "quadrilateral"
        with pytest.raises(ZeroDivisionError), session():
            1 / 0  # noqa: B018
        assert list(gmsh.model.list()) == models
        assert gmsh.model.getCurrent() == "mine"
        assert gmsh.model.getEntities() == [(0, 7)]
        assert gmsh.option.getNumber("Mesh.ElementOrder") == 2
        assert gmsh.option.getNumber("Mesh.SaveAll") == 1
        assert gmsh.option.getNumber("General.Terminal") == 0
    finally:
        gmsh.finalize()
