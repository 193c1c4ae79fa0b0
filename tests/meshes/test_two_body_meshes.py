"""Meshes of two bodies: blocks side by side, joints and cracks cut open, sides welded together."""

from dataclasses import replace

import numpy as np
import pytest

from vi_contact.core.errors import InputError
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.cut import CutOpen, Welded, cut_open, weld
from vi_contact.meshes.extract import add_arrays, arrays_from_script
from vi_contact.meshes.gmsh_session import session, write
from vi_contact.meshes.rows import cell_sides, number_alike
from vi_contact.meshes.two_blocks import Blocks, TwoBlocks

gmsh = pytest.importorskip("gmsh")
pytestmark = pytest.mark.serial
shapes = pytest.mark.parametrize("simplices", [False, True], ids=["tensor", "simplices"])


def stacked(d, simplices=False, **data):
    lower = BlockMesh(lengths=(2.0, 1.0, 1.5)[:d], divisions=(4, 2, 3)[:d], simplices=simplices)
    return TwoBlocks(lower=lower, upper=lower, **data)


def bodies(arrays):
    """Nodes of each connected part of the mesh."""
    import scipy.sparse as sp
    from scipy.sparse.csgraph import connected_components

    first = np.repeat(arrays.cells[:, :1], arrays.cells.shape[1], axis=1).ravel()
    graph = sp.coo_matrix(
        (np.ones(len(first)), (first, arrays.cells.ravel())), shape=(len(arrays.points),) * 2
    )
    count, part = connected_components(graph, directed=False)
    return [np.flatnonzero(part == i) for i in range(count)]


def outside(arrays):
    """Facets of one cell only, as sets of places."""
    sides, _ = cell_sides(arrays.cells, arrays.cell)
    (number,) = number_alike(sides)
    return sides[np.bincount(number)[number] == 1]


def places(arrays, rows):
    """Facets by the places of their vertices, in any order."""
    return sorted(
        tuple(sorted(map(tuple, points))) for points in np.round(arrays.points[rows], 9).tolist()
    )


@shapes
@pytest.mark.parametrize("d", [1, 2, 3])
def test_two_blocks_touch_without_a_common_node(d, simplices):
    """Two bodies, interface nodes at the same places; named sides are where they say, gaps and
    offsets too."""
    mesh = stacked(d, simplices)
    arrays = arrays_from_script(mesh)
    lower, upper = bodies(arrays)
    assert list(arrays.cell_groups) == ["lower", "upper"] and len(lower) == len(upper)
    one, two = (arrays.facet_groups[name] for name in mesh.interface)
    assert np.isin(one, upper).all() and np.isin(two, lower).all()
    assert places(arrays, one) == places(arrays, two)
    up = 0 if d == 1 else 1
    moved = arrays_from_script(stacked(d, simplices, gap=0.25, offset=(0.5, 0.125)))
    shift = moved.points[upper] - arrays.points[upper]
    assert np.array_equal(
        shift, np.tile({1: [0.25], 2: [0.5, 0.25], 3: [0.5, 0.25, 0.125]}[d], (len(upper), 1))
    )
    assert np.array_equal(moved.points[lower], arrays.points[lower])
    assert np.all(
        arrays.points[arrays.facet_groups[mesh.interface[1]]][..., up] == mesh.lower.lengths[up]
    )


def test_blocks_turn_together_and_have_to_be_alike():
    straight, turned = (arrays_from_script(stacked(2, angle=angle)) for angle in (0.0, 0.3))
    c, s = np.cos(0.3), np.sin(0.3)
    assert turned.points == pytest.approx(straight.points @ np.array([[c, s], [-s, c]]), abs=1e-14)
    with pytest.raises(InputError, match="give the blocks of one mesh the same number of lengths"):
        Blocks({"a": BlockMesh(), "b": BlockMesh(simplices=True)})


@shapes
@pytest.mark.parametrize("d", [1, 2, 3])
def test_welded_blocks_are_one_block_and_cut_open_two_again(d, simplices):
    """Welded: nodes, cells and outer sides of the single block; cut open again along the weld: two
    bodies, whose new sides are the old interface; the same through a file."""
    mesh = stacked(d, simplices)
    one, two = mesh.interface
    apart = arrays_from_script(mesh)
    joined = arrays_from_script(Welded(mesh, two, one))
    up = 0 if d == 1 else 1
    tall = list(mesh.lower.lengths), list(mesh.lower.divisions)
    for values in tall:
        values[up] *= 2
    whole = arrays_from_script(
        BlockMesh(lengths=tuple(tall[0]), divisions=tuple(tall[1]), simplices=simplices)
    )
    assert places(joined, joined.cells) == places(whole, whole.cells)
    assert len(joined.points) == len(whole.points) and len(bodies(joined)) == 1
    assert places(joined, outside(joined)) == places(whole, outside(whole))
    for again in (
        cut_open(joined, one, inside="upper"),
        cut_open(joined, one, towards=-np.eye(d)[up]),
    ):
        assert len(bodies(again)) == 2 and len(again.points) == len(apart.points)
        assert places(again, outside(again)) == places(apart, outside(apart))
        upper = np.unique(again.cells[again.cell_groups["upper"]])
        assert np.isin(again.facet_groups[f"{one}_1"], upper).all()
        assert not np.isin(again.facet_groups[f"{one}_2"], upper).any()
        for name in set(apart.facet_groups) - {one, two}:
            assert places(again, again.facet_groups[name]) == places(
                apart, apart.facet_groups[name]
            )
        assert not {one} & set(again.facet_groups)


def test_scripts_and_files_give_the_same(tmp_path):
    """CutOpen and Welded take scripts and files; what they write is read back with all groups,
    overlapping ones too."""
    mesh = stacked(3, True, angle=0.2)
    write(mesh, tmp_path / "apart.msh")
    write(Welded(tmp_path / "apart.msh", "lower_top", "upper_bottom"), tmp_path / "joined.msh")
    cut = arrays_from_script(CutOpen(tmp_path / "joined.msh", "upper_bottom", inside="upper"))
    direct = cut_open(
        weld(arrays_from_script(mesh), "lower_top", "upper_bottom"),
        "upper_bottom",
        inside="upper",
    )
    assert cut.points == pytest.approx(direct.points, abs=1e-15) and set(cut.facet_groups) == set(
        direct.facet_groups
    )
    assert places(cut, cut.cells) == places(direct, direct.cells)
    assert {"lower_top", "upper_bottom_2"} <= set(cut.facet_groups)  # one boundary, two names
    for name, rows in direct.facet_groups.items():
        assert places(cut, cut.facet_groups[name]) == places(direct, rows)


def test_facets_keep_their_turn():
    """Quadrilateral sides stay quadrilaterals: Gmsh would show crossed ones."""
    mesh = stacked(3)
    joined = weld(arrays_from_script(mesh), *mesh.interface[::-1])
    with session() as model:
        add_arrays(model, cut_open(joined, "upper_bottom", inside="upper"))
        gathered = model.model.mesh.getElementsByType(3)[1].reshape(-1, 4)
        tags, points, _ = model.model.mesh.getNodes()
    x = points.reshape(-1, 3)[np.argsort(tags)][gathered.astype(int) - 1]
    assert np.abs(x[:, 0] + x[:, 2] - x[:, 1] - x[:, 3]).max() < 1e-14 and len(x) > 24


def strip_with(lines):
    """Nine squares, and inner boundary groups as pairs of points."""
    arrays = arrays_from_script(BlockMesh(lengths=(3.0, 3.0), divisions=(3, 3)))
    number = {tuple(point): i for i, point in enumerate(arrays.points.tolist())}
    rows = {
        name: np.array([[number[a], number[b]] for a, b in pairs]) for name, pairs in lines.items()
    }
    arrays.facet_groups.update(rows)
    return arrays


def test_a_crack_stays_closed_at_its_tip():
    """From the left side to the middle of the block: its mouth opens, its tip does not; one body
    with four more facets outside."""
    arrays = strip_with({"crack": [((0.0, 1.0), (1.0, 1.0)), ((1.0, 1.0), (2.0, 1.0))]})
    cut = cut_open(arrays, "crack", towards=(0.1, 1.0))
    assert len(bodies(cut)) == 1 and len(cut.points) == len(arrays.points) + 2
    assert sorted(map(tuple, cut.points[len(arrays.points) :].tolist())) == [(0.0, 1.0), (1.0, 1.0)]
    assert len(outside(cut)) == len(outside(arrays)) + 4
    below, above = cut.facet_groups["crack_1"], cut.facet_groups["crack_2"]
    assert len(np.intersect1d(below, above)) == 1
    in_cells = cut.cells[np.isin(cut.cells, np.setdiff1d(below, above)).any(axis=1)]
    assert cut.points[in_cells][..., 1].max() <= 1.0
    assert len(cut.facet_groups["left"]) == 3


def test_cuts_that_cross():
    """A horizontal and a vertical cut, one after the other: four bodies, four nodes where they
    cross."""
    across = [((i + 0.0, 1.0), (i + 1.0, 1.0)) for i in range(3)]
    upright = [((2.0, i + 0.0), (2.0, i + 1.0)) for i in range(3)]
    arrays = strip_with({"across": across, "upright": upright})
    cut = cut_open(cut_open(arrays, "across", towards=(0.0, 1.0)), "upright", towards=(1.0, 0.0))
    assert len(bodies(cut)) == 4
    assert np.sum(np.all(cut.points == (2.0, 1.0), axis=1)) == 4
    assert len(cut.points) == 16 + 4 + 4 + 1
    for name in ("across_1", "across_2", "upright_1", "upright_2"):
        assert len(cut.facet_groups[name]) == 3


def test_refusals():
    arrays = strip_with({"line": [((0.0, 1.0), (1.0, 1.0))]})
    arrays.cell_groups["half"] = arrays.points[arrays.cells][..., 0].max(axis=1) <= 1.0
    for act, sentence in (
        (
            lambda: cut_open(arrays, "seam", towards=(0, 1)),
            "mesh has no boundary group 'seam'; it has left, right",
        ),
        (
            lambda: cut_open(arrays, "line"),
            "give its first side, either by inside=a cell group or by towards",
        ),
        (
            lambda: cut_open(arrays, "left", towards=(1, 0)),
            "'left' has facets without cells on both sides",
        ),
        (
            lambda: cut_open(arrays, "line", inside="half"),
            "cell group 'half' is not on one side of 'line' only",
        ),
        (
            lambda: cut_open(arrays, "line", inside="rock"),
            "mesh has no cell group 'rock'; it has block, half",
        ),
        (
            lambda: cut_open(arrays, "line", towards=(1, 0)),
            r"towards=\(1.0, 0.0\) runs along 'line' somewhere",
        ),
        (
            lambda: weld(arrays, "left", "right"),
            r"group 'right' has a node at \(3, 0\), 3 m away from every node of",
        ),
    ):
        with pytest.raises(InputError, match=sentence):
            act()


def test_bodies_of_gmsh_geometry():
    """Two rectangles of Gmsh's OpenCASCADE, body by body, and one geometry fragmented along the
    joint and cut open."""

    class Dam:
        def __init__(self, fragmented):
            self.fragmented = fragmented

        def build(self, gmsh):
            occ, model = gmsh.model.occ, gmsh.model
            rock, dam = occ.addRectangle(0, 0, 0, 4, 1), occ.addRectangle(1, 1, 0, 1, 2)
            if self.fragmented:
                occ.fragment([(2, rock)], [(2, dam)])
            occ.synchronize()
            model.setPhysicalName(2, model.addPhysicalGroup(2, [rock]), "rock")
            model.setPhysicalName(2, model.addPhysicalGroup(2, [dam]), "dam")
            lines = model.getEntitiesInBoundingBox(0.9, 0.9, -0.1, 2.1, 1.1, 0.1, 1)
            for number, (_, line) in enumerate(lines):
                model.setPhysicalName(1, model.addPhysicalGroup(1, [line]), f"joint{number}")
            gmsh.option.setNumber("Mesh.MeshSizeMax", 0.3)
            model.mesh.generate(2)

    apart = arrays_from_script(Dam(False))
    assert len(bodies(apart)) == 2
    joint = arrays_from_script(Dam(True))
    assert len(bodies(joint)) == 1
    cut = arrays_from_script(CutOpen(Dam(True), "joint0", inside="dam"))
    assert len(bodies(cut)) == 2 and {"joint0_1", "joint0_2"} == set(cut.facet_groups)
    assert np.ptp(cut.points[np.unique(cut.facet_groups["joint0_1"])], axis=0) == pytest.approx(
        [1.0, 0.0], abs=1e-12
    )


@shapes
@pytest.mark.parametrize("d", [2, 3])
def test_a_joint_between_two_cell_groups_needs_no_boundary_group(d, simplices):
    """What lies between the groups is cut like a named boundary; side 1 is that of the first
    group."""
    mesh = stacked(d, simplices)
    one, two = mesh.interface
    joined = weld(arrays_from_script(mesh), two, one)
    named = cut_open(joined, one, inside="upper")
    for names, sides in ((("upper", "lower"), ("1", "2")), (("lower", "upper"), ("2", "1"))):
        cut = cut_open(joined, between=names)
        group = "_".join(names)
        assert len(bodies(cut)) == 2
        for own, other in zip("12", sides, strict=True):
            wanted = named.facet_groups[f"{one}_{other}"]
            assert places(cut, cut.facet_groups[f"{group}_{own}"]) == places(named, wanted)
        assert np.isin(cut.facet_groups[f"{group}_1"], cut.cells[cut.cell_groups[names[0]]]).all()
        assert {"upper_top", "lower_bottom"} <= set(cut.facet_groups)


def test_what_cannot_be_cut_between_cell_groups():
    mesh = stacked(2)
    apart = arrays_from_script(mesh)
    joined = weld(apart, *mesh.interface[::-1])
    for arguments, sentence in (
        ({"between": ("upper", "sea")}, "mesh has no cell group 'sea'; it has lower, upper"),
        ({"between": ("upper", "upper")}, "between is .*; give the names of two groups of cells"),
        ({"between": "upper"}, "between is 'upper'; give the names of two groups of cells"),
        (
            {"between": ("upper", "lower"), "inside": "upper"},
            "has its first side in 'upper': leave out inside and towards",
        ),
        (
            {"between": ("upper", "lower"), "group": "upper_bottom"},
            "give group=, .*, or between=, two groups of cells",
        ),
        ({}, "give group=, the name of an inner boundary, or between=, two groups of cells"),
    ):
        with pytest.raises(InputError, match=sentence):
            cut_open(joined, **arguments)
    with pytest.raises(
        InputError,
        match="'upper' and 'lower' have no common facet, so that there is nothing to cut",
    ):
        cut_open(apart, between=("upper", "lower"))
    again = cut_open(joined, "upper_bottom", inside="upper")
    taken = {
        name.replace("upper_bottom_1", "upper_top_1"): rows
        for name, rows in again.facet_groups.items()
    }
    with pytest.raises(
        InputError, match="has a group 'upper_bottom_2' already, the name of a side of the cut"
    ):
        cut_open(
            replace(
                joined,
                facet_groups=joined.facet_groups | {"upper_bottom_2": taken["upper_bottom_2"]},
            ),
            "upper_bottom",
            inside="upper",
        )


def test_welds_to_several_nodes_at_one_place_are_refused():
    """A stone is welded to two stones, which have a node each at the joint; the stone's side first
    is no riddle."""
    block = BlockMesh(lengths=(1.0, 1.0), divisions=(2, 2))
    stones = Blocks(
        {
            "a": block,
            "b": replace(block, corner=(1.0, 0.0)),
            "up": BlockMesh(lengths=(2.0, 1.0), divisions=(4, 2), corner=(0.0, 1.0)),
        }
    )
    arrays = arrays_from_script(stones)
    tops = np.concatenate([arrays.facet_groups["a_top"], arrays.facet_groups["b_top"]])
    arrays = replace(arrays, facet_groups=arrays.facet_groups | {"tops": tops})
    with pytest.raises(
        InputError, match=r"group 'tops' has several nodes at \(1, 1\), of bodies that meet there"
    ):
        weld(arrays, "tops", "up_bottom")
    assert len(bodies(weld(arrays, "up_bottom", "tops"))) == 1


DAM = """
Point(1) = {0,0,0,1}; Point(2) = {2,0,0,1}; Point(3) = {2,1,0,1}; Point(4) = {0,1,0,1};
Point(5) = {0,2,0,1}; Point(6) = {2,2,0,1};
Line(1) = {1,2}; Line(2) = {2,3}; Line(3) = {3,4}; Line(4) = {4,1};
Line(5) = {3,6}; Line(6) = {6,5}; Line(7) = {5,4};
Curve Loop(1) = {1,2,3,4}; Plane Surface(1) = {1};
Curve Loop(2) = {-3,5,6,7}; Plane Surface(2) = {2};
Physical Surface("rock") = {1}; Physical Surface("dam") = {2}; Physical Curve("bottom") = {1};
"""
CASE = """
[mesh]
type = "CutOpen"
between = ["dam", "rock"]
source = {type = "GeoFile", path = "dam.geo"}
[material.dam]
E = 2e10
nu = 0.2
rho = 2400.0
[material.rock]
E = 4e10
nu = 0.2
rho = 2600.0
[system]
fixed = "bottom"
[gravity]
[[contact]]
type = "contact_pair"
facets1 = "dam_rock_1"
facets2 = "dam_rock_2"
[run]
steps = 1
dt = 0.01
"""


@pytest.mark.long
def test_a_case_file_cuts_between_two_cell_groups(tmp_path):
    """The weight of the dam, 2 m by 1 m, rests on its joint, which no line of the script names."""
    pytest.importorskip("dolfinx")
    from mpi4py import MPI

    import vi_contact as vc
    from vi_contact.practice.studies import read_case

    (tmp_path / "dam.geo").write_text(DAM)
    (tmp_path / "dam.toml").write_text(CASE)
    problem = read_case(tmp_path / "dam.toml").problem(MPI.COMM_SELF)
    assert vc.static_equilibrium(problem).r_n.sum() == pytest.approx(
        2.0 * 2400.0 * 9.80665, rel=1e-9
    )
