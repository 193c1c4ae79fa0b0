"""The ball of tetrahedra: groups where they belong, nodes on the sphere, graded cells, the same
mesh every time."""

from math import pi

import numpy as np
import pytest

from vi_contact.core.errors import InputError
from vi_contact.meshes.ball import BallMesh
from vi_contact.meshes.extract import MeshArrays, arrays_from_file, arrays_from_script
from vi_contact.meshes.gmsh_session import write

gmsh = pytest.importorskip("gmsh")
pytestmark = pytest.mark.serial
RADIUS = 0.01
SMALL = {"radius": RADIUS, "size": 1.0e-4, "foot": 6.0e-4}


def volume(mesh: MeshArrays) -> float:
    corners = mesh.points[mesh.cells]
    return float(np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])).sum() / 6.0)


def area(mesh: MeshArrays, name: str) -> float:
    a, b, c = np.moveaxis(mesh.points[mesh.facet_groups[name]], 1, 0)
    return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


@pytest.mark.parametrize("eighth", [False, True])
@pytest.mark.parametrize("coarsest", [0.25, 0.1])
def test_ball_has_its_size_and_sides(eighth, coarsest):
    """Volume short by 0.35 (coarsest/R)² or a little less; flat sides exact planes, their areas
    short by about as much; every node of the surface at the distance R from the centre."""
    mesh = arrays_from_script(BallMesh(**SMALL, coarsest=coarsest * RADIUS, eighth=eighth))
    share, lack = (8.0, 0.4 * coarsest**2) if eighth else (4.0, 0.4 * coarsest**2)
    assert mesh.cell == "tetrahedron" and mesh.cell_groups["ball"].all()
    assert -lack < volume(mesh) / (4.0 / 3.0 * pi * RADIUS**3 / share) - 1.0 < 0.0
    assert -2.0 * lack < area(mesh, "surface") / (4.0 * pi * RADIUS**2 / share) - 1.0 < 0.0
    sides = {"side_x": (0, 0.0), "side_z": (2, 0.0)} | ({"cut": (1, RADIUS)} if eighth else {})
    assert set(mesh.facet_groups) == {"surface", "foot", *sides}
    for name, (axis, value) in sides.items():
        part = pi * RADIUS**2 / (4.0 if eighth else 2.0)
        assert np.abs(mesh.points[mesh.facet_groups[name]][..., axis] - value).max() < 1e-15
        assert -2.0 * lack < area(mesh, name) / part - 1.0 < 0.0
    shell = mesh.points[np.unique(mesh.facet_groups["surface"])] - (0.0, RADIUS, 0.0)
    assert np.abs(np.linalg.norm(shell, axis=1) / RADIUS - 1.0).max() < 1e-12
    assert mesh.points.min() > -1e-15
    assert np.linalg.norm(mesh.points, axis=1).min() < 1e-15  # the lowest point is a node


def test_foot_is_the_fine_part_of_the_surface():
    """Facets with centres nearer than `foot`; edges of about 1.2 `size` there, growing with the
    distance."""
    mesh = arrays_from_script(BallMesh(**SMALL, growth=0.2))
    foot, surface = mesh.facet_groups["foot"], mesh.facet_groups["surface"]
    centres = np.linalg.norm(mesh.points[foot].mean(axis=1), axis=1)
    assert centres.max() < SMALL["foot"] and {tuple(row) for row in foot} <= {
        tuple(row) for row in surface
    }
    assert area(mesh, "foot") == pytest.approx(pi / 4.0 * SMALL["foot"] ** 2, rel=0.1)
    corners = mesh.points[mesh.cells]
    edges = np.concatenate([corners[:, j] - corners[:, i] for i in range(4) for j in range(i)])
    middles = np.concatenate(
        [0.5 * (corners[:, j] + corners[:, i]) for i in range(4) for j in range(i)]
    )
    length, distance = np.linalg.norm(edges, axis=1), np.linalg.norm(middles, axis=1)
    near, far = distance < 0.8 * SMALL["foot"], distance > 0.5 * RADIUS
    assert np.median(length[near]) == pytest.approx(1.2 * SMALL["size"], rel=0.15)
    wanted = np.minimum(SMALL["size"] + 0.2 * (distance - SMALL["foot"]), 0.25 * RADIUS)
    assert np.median(length[far] / wanted[far]) == pytest.approx(1.1, rel=0.2)


@pytest.mark.long
def test_ball_is_written_the_same_every_time_and_read_back(tmp_path):
    ball = BallMesh(**SMALL, eighth=True)
    write(ball, tmp_path / "one.msh")
    write(ball, tmp_path / "two.msh")
    assert (tmp_path / "one.msh").read_bytes() == (tmp_path / "two.msh").read_bytes()
    memory, file = arrays_from_script(ball), arrays_from_file(tmp_path / "one.msh")
    assert np.allclose(memory.points, file.points, rtol=1e-15, atol=1e-18)
    assert {name: len(rows) for name, rows in memory.facet_groups.items()} == {
        name: len(rows) for name, rows in file.facet_groups.items()
    }


def test_ball_leaves_gmsh_options_alone():
    gmsh.initialize([], readConfigFiles=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.MeshSizeMax", 7.0)
        arrays_from_script(BallMesh(**SMALL, eighth=True))
        assert gmsh.option.getNumber("Mesh.MeshSizeMax") == 7.0
        assert gmsh.option.getNumber("Mesh.MeshSizeExtendFromBoundary") != 0
    finally:
        gmsh.finalize()


@pytest.mark.parametrize(
    ("wrong", "word"),
    [
        ({"size": 0.0}, "size is 0.0; give a finite number above zero"),
        ({"foot": 0.02}, "they must be size <= foot < radius"),
        ({"radius": float("nan")}, "radius is nan; give a finite number above zero"),
        ({"growth": 0.0}, "growth is 0.0; give a finite number above zero"),
        ({"coarsest": 1.0e-5}, "coarsest cell 1e-05 m: they must be"),
    ],
)
def test_sizes_that_make_no_ball_are_refused(wrong, word):
    with pytest.raises(InputError, match=word):
        BallMesh(**{**SMALL, **wrong})


@pytest.mark.long
def test_half_ball_stands_on_its_anvil():
    """Half of the sphere's volume, its plane of symmetry and its lowest node; below it a block of 2
    L x L x L, all of whose sides are named, as finely meshed at the foot; two bodies."""
    anvil = 0.02
    mesh = arrays_from_script(BallMesh(**SMALL, half=True, anvil=anvil, coarsest=0.15 * RADIUS))
    ball, block = mesh.cell_groups["ball"], mesh.cell_groups["anvil"]
    assert np.array_equal(ball, ~block)
    corners = mesh.points[mesh.cells]
    sizes = np.abs(np.linalg.det(corners[:, 1:] - corners[:, :1])) / 6.0
    lack = 0.4 * 0.15**2
    assert -lack < sizes[ball].sum() / (2.0 / 3.0 * pi * RADIUS**3) - 1.0 < 0.0
    assert sizes[block].sum() == pytest.approx(2.0 * anvil**3, rel=1e-12)
    assert not np.intersect1d(mesh.cells[ball], mesh.cells[block]).size
    wanted = {"surface", "foot", "cap", "side_z"} | {
        f"anvil_{name}" for name in ("top", "foot", "side_z", "far")
    }
    assert set(mesh.facet_groups) == wanted
    for name, (axis, part) in {
        "side_z": (2, pi * RADIUS**2),
        "anvil_side_z": (2, 2.0 * anvil**2),
        "anvil_top": (1, 2.0 * anvil**2),
    }.items():
        assert np.abs(mesh.points[mesh.facet_groups[name]][..., axis]).max() < 1e-15
        assert area(mesh, name) == pytest.approx(part, rel=2.0 * lack)
    assert area(mesh, "anvil_far") == pytest.approx(6.0 * anvil**2, rel=1e-12)
    shell = mesh.points[np.unique(mesh.facet_groups["surface"])]
    assert np.abs(np.linalg.norm(shell - (0.0, RADIUS, 0.0), axis=1) / RADIUS - 1.0).max() < 1e-12
    assert np.linalg.norm(shell, axis=1).min() < 1e-15  # the lowest point is a node
    foot, below = mesh.facet_groups["foot"], mesh.facet_groups["anvil_foot"]
    assert area(mesh, "foot") == pytest.approx(pi / 2.0 * SMALL["foot"] ** 2, rel=0.1)
    assert area(mesh, "anvil_foot") == pytest.approx(area(mesh, "foot"), rel=0.1)
    assert area(mesh, "cap") > 2.0 * area(mesh, "foot")
    assert len(below) == pytest.approx(len(foot), rel=0.2)
    lifted = arrays_from_script(
        BallMesh(**SMALL, half=True, anvil=anvil, coarsest=0.15 * RADIUS, height=1e-6)
    )
    assert lifted.points[np.unique(lifted.cells[lifted.cell_groups["ball"]]), 1].min() == (
        pytest.approx(1e-6, rel=1e-9)
    )


def test_quarter_stands_on_a_quarter_of_the_anvil():
    mesh = arrays_from_script(BallMesh(**SMALL, anvil=0.02))
    assert {"anvil_side_x", "anvil_side_z", "side_x", "side_z"} <= set(mesh.facet_groups)
    assert area(mesh, "anvil_side_x") == pytest.approx(0.02**2, rel=1e-12)
    assert area(mesh, "anvil_far") == pytest.approx(3.0 * 0.02**2, rel=1e-12)


@pytest.mark.parametrize(
    ("wrong", "word"),
    [
        ({"half": True, "eighth": True}, "half and eighth are both True"),
        ({"anvil": 1.0e-3}, "give a depth of at least two feet"),
        ({"anvil": "deep"}, "anvil is 'deep'"),
    ],
)
def test_halves_and_anvils_that_cannot_be(wrong, word):
    with pytest.raises(InputError, match=word):
        BallMesh(**{**SMALL, **wrong})
