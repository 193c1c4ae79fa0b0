"""Every known defect of Gmsh files and their readers (P21) is survived, or refused in one sentence
on all ranks."""

import math

import numpy as np
import pytest

from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.gmsh_session import session

pytest.importorskip("gmsh")
pytest.importorskip("dolfinx")
ufl = pytest.importorskip("ufl")

from mesh_tools import (  # noqa: E402
    BASE,
    LINE,
    NAMES,
    PRISM,
    QUADRANGLE,
    SQUARE,
    TRIANGLE,
    TWO_TRIANGLES,
    integral,
    msh,
    read_text,
    refusal,
    size,
    sizes,
)

from vi_contact import fem  # noqa: E402
from vi_contact.fem import compat  # noqa: E402

UNKNOWN_NODE = """$MeshFormat
4.1 0 8
$EndMeshFormat
$Entities
0 0 1 0
1 0 0 0 1 1 0 1 1 0
$EndEntities
$Nodes
1 3 1 3
2 1 0 3
1
2
3
0 0 0
1 0 0
1 1 0
$EndNodes
$Elements
1 2 1 2
2 1 2 2
1 1 2 3
2 1 3 4
$EndElements
"""


# Survived
# --------------------------------------------------------------------------------------------------


def test_node_tags_may_start_anywhere_have_holes_and_come_unsorted(comm, shared_tmp):
    """dolfinx#2460."""
    new = {1: 70, 2: 12, 3: 1000003, 4: 40}
    nodes = {new[tag]: SQUARE[tag] for tag in (3, 1, 4, 2)}
    elements = [
        (kind, p, e, [new[tag] for tag in tags]) for kind, p, e, tags in TWO_TRIANGLES + BASE
    ]
    mesh, tags = read_text(msh(nodes, elements, NAMES), comm, shared_tmp)
    assert sizes(tags) == {"body": 1.0, "base": 1.0}
    by_tag = np.array([nodes[tag][:2] for tag in sorted(nodes)])
    assert np.array_equal(mesh.geometry.x[:, :2], by_tag[fem.node_numbers(mesh)])


def test_a_half_disk_whose_named_arc_is_a_copy_of_its_boundary(comm):
    """dolfinx#2456: OpenCASCADE copies the arc, Gmsh meshes both."""

    class HalfDisk:
        def build(self, gmsh):
            occ = gmsh.model.occ
            line = occ.addLine(occ.addPoint(1, 0, 0), occ.addPoint(-1, 0, 0))
            arc = occ.addCircle(0, 0, 0, 1, angle1=0.0, angle2=math.pi)
            disk = occ.addPlaneSurface([occ.addCurveLoop([line, arc])])
            occ.synchronize()
            gmsh.model.setPhysicalName(1, gmsh.model.addPhysicalGroup(1, [arc]), "arc")
            gmsh.model.setPhysicalName(2, gmsh.model.addPhysicalGroup(2, [disk]), "disk")
            gmsh.model.mesh.generate(2)

    mesh, tags = fem.build_mesh(HalfDisk(), comm)
    owned = mesh.topology.index_map(1).size_local
    n = comm.allreduce(int((tags["arc"].indices < owned).sum()))
    assert n >= 8
    # Gmsh spaces to 1e-9
    assert size(tags["arc"]) == pytest.approx(2 * n * math.sin(math.pi / (2 * n)), rel=1e-6)


def test_a_facet_may_be_in_two_groups_and_a_cell_too(comm, shared_tmp):
    """dolfinx#3332, in both file formats: a side "outer" of all four, "base" one of them; "body"
    and half of it."""

    class Shared:
        def build(self, gmsh):
            geo = gmsh.model.geo
            points = [
                geo.addPoint(x, y, 0, 0.5)
                for x, y in ((0, 0), (1, 0), (2, 0), (2, 1), (1, 1), (0, 1))
            ]
            ring = [geo.addLine(points[i], points[(i + 1) % 6]) for i in range(6)]
            middle = geo.addLine(points[1], points[4])
            left = geo.addPlaneSurface([geo.addCurveLoop([ring[0], middle, ring[4], ring[5]])])
            right = geo.addPlaneSurface([geo.addCurveLoop([ring[1], ring[2], ring[3], -middle])])
            geo.synchronize()
            lines = {"base": ring[:2], "outer": ring, "middle": [middle]}
            surfaces = {"body": [left, right], "half": [left]}
            named = [(1, *group) for group in lines.items()] + [
                (2, *group) for group in surfaces.items()
            ]
            for dim, name, entities in named:
                gmsh.model.setPhysicalName(dim, gmsh.model.addPhysicalGroup(dim, entities), name)
            gmsh.model.mesh.generate(2)

    expected = {"base": 2.0, "outer": 6.0, "middle": 0.0, "body": 2.0, "half": 1.0}
    _, tags = fem.build_mesh(Shared(), comm)
    # ds leaves out the inner facets of "middle", though they are there
    assert sizes(tags) == expected
    assert comm.allreduce(len(tags["middle"].indices)) > 0
    for version in (2.2, 4.1):
        if comm.rank == 0:
            with session() as gmsh:
                Shared().build(gmsh)
                gmsh.option.setNumber("Mesh.MshFileVersion", version)
                gmsh.write(str(shared_tmp / "shared.msh"))
        comm.barrier()
        _, tags = fem.read_mesh(shared_tmp / "shared.msh", comm)
        assert sizes(tags) == expected
        comm.barrier()


def test_a_mesh_without_groups_is_one_group_of_cells(comm, shared_tmp):
    """dolfinx#3859."""
    _, tags = read_text(
        msh(SQUARE, [(kind, 0, e, n) for kind, _, e, n in TWO_TRIANGLES + BASE]), comm, shared_tmp
    )
    assert sizes(tags) == {"all": 1.0}
    assert "its boundary groups are none, its cell groups all" in refusal(
        comm, lambda: tags["base"]
    )


def test_boundary_groups_may_come_without_a_group_of_cells_and_the_other_way_round(
    comm, shared_tmp
):
    """dolfinx#3860."""
    cells = [(kind, 0, e, n) for kind, _, e, n in TWO_TRIANGLES]
    _, tags = read_text(msh(SQUARE, cells + BASE, NAMES), comm, shared_tmp)
    assert sizes(tags) == {"base": 1.0, "all": 1.0}
    comm.barrier()
    _, tags = read_text(
        msh(SQUARE, TWO_TRIANGLES + [(LINE, 0, 1, (1, 2))], NAMES), comm, shared_tmp
    )
    assert sizes(tags) == {"body": 1.0}


def test_a_group_without_a_name_is_called_by_its_number(comm, shared_tmp):
    _, tags = read_text(msh(SQUARE, TWO_TRIANGLES + BASE), comm, shared_tmp)
    assert sizes(tags) == {"1": 1.0, "2": 1.0}


def test_nodes_no_cell_uses_are_dropped(comm, shared_tmp):
    nodes = {9: (50, 50, 7), **SQUARE, 11: (-3, 0, 0)}
    mesh, tags = read_text(msh(nodes, TWO_TRIANGLES + BASE, NAMES), comm, shared_tmp)
    assert mesh.geometry.index_map().size_global == 4
    assert mesh.geometry.x.max(initial=0.0) <= 1.0
    assert sizes(tags) == {"body": 1.0, "base": 1.0}


def test_cells_may_run_either_way_round(comm, shared_tmp):
    """Clockwise cells next to anticlockwise ones: area by assembly and, with outward normals, by
    Gauss's theorem."""
    elements = [(TRIANGLE, 1, 1, (1, 2, 3)), (TRIANGLE, 1, 1, (1, 4, 3)), *BASE]
    mesh, tags = read_text(msh(SQUARE, elements, NAMES), comm, shared_tmp)
    x, normal = ufl.SpatialCoordinate(mesh), ufl.FacetNormal(mesh)
    assert sizes(tags) == {"body": 1.0, "base": 1.0}
    assert integral(mesh, ufl.dot(x, normal), ufl.ds) == pytest.approx(2.0, rel=1e-13)


def test_two_bodies_in_touch_keep_their_own_nodes_and_sides(comm, shared_tmp):
    """Two squares, one above the other, with two nodes at each common place: two groups, one of
    each body."""
    nodes = {**SQUARE, **{tag + 4: (x, y + 1, 0) for tag, (x, y, _) in SQUARE.items()}}
    elements = [
        (QUADRANGLE, 1, 1, (1, 2, 3, 4)),
        (QUADRANGLE, 2, 2, (5, 6, 7, 8)),
        (LINE, 3, 1, (3, 4)),
        (LINE, 4, 2, (5, 6)),
    ]
    names = [(2, 1, "lower"), (2, 2, "upper"), (1, 3, "lower side"), (1, 4, "upper side")]
    mesh, tags = read_text(msh(nodes, elements, names), comm, shared_tmp)
    assert mesh.geometry.index_map().size_global == 8
    assert sizes(tags) == {"lower": 1.0, "upper": 1.0, "lower side": 1.0, "upper side": 1.0}
    y = ufl.SpatialCoordinate(mesh)[1]
    assert integral(mesh, y, compat.measure(mesh, 2, tags["upper"].indices)) == pytest.approx(
        1.5, rel=1e-13
    )
    normal = ufl.FacetNormal(mesh)[1]
    for name, upwards in {"lower side": 1.0, "upper side": -1.0}.items():
        assert integral(mesh, normal, compat.measure(mesh, 1, tags[name].indices)) == pytest.approx(
            upwards, rel=1e-13
        )


# Refused
# --------------------------------------------------------------------------------------------------


def turned_quadrangle(order):
    return msh(SQUARE, [(QUADRANGLE, 1, 1, order)])


REFUSED = {
    "mixed cells": (
        msh(
            SQUARE | {5: (2, 0, 0)}, [(QUADRANGLE, 1, 1, (1, 2, 3, 4)), (TRIANGLE, 1, 1, (2, 5, 3))]
        ),
        "mixes cells (Quadrilateral 4, Triangle 3): mesh it with cells of one type",
    ),
    "serendipity": (
        msh(
            SQUARE | {5: (0.5, 0, 0), 6: (1, 0.5, 0), 7: (0.5, 1, 0), 8: (0, 0.5, 0)},
            [(16, 1, 1, (1, 2, 3, 4, 5, 6, 7, 8))],
        ),
        "cells of an order above 2, or without all mid-points (Quadrilateral 8)",
    ),
    "folded between curved sides": (
        msh(
            {
                1: (0, 0, 0),
                2: (1, 0, 0),
                3: (0, 1, 0),
                4: (0.5, 0.6, 0),
                5: (0.5, 0.5, 0),
                6: (0, 0.5, 0),
            },
            [(9, 1, 1, (1, 2, 3, 4, 5, 6))],
        ),
        "has a fold between its curved sides",
    ),
    "prisms": (
        msh(
            SQUARE | {5: (0, 0, 1), 6: (1, 0, 1), 7: (1, 1, 1)}, [(PRISM, 1, 1, (1, 2, 3, 5, 6, 7))]
        ),
        "cells of type Prism 6: use interval, triangle",
    ),
    "shell": (msh({**SQUARE, 3: (1, 1, 0.25)}, TWO_TRIANGLES), "leaves the plane z = 0 by 0.25 m"),
    "only boundaries saved": (
        msh(SQUARE, BASE + [(LINE, 2, 1, (2, 3))], NAMES),
        "name the surface as a physical group",
    ),
    "no area": (
        msh({**SQUARE, 2: (0.5, 0.5, 0)}, TWO_TRIANGLES),
        "mesh.msh has no volume, first at",
    ),
    "no area, far away": (
        msh(
            {1: (1e3, 1 / 3, 0), 2: (1e3 + 0.1, 1 / 3 + 0.1, 0), 3: (1e3 + 0.3, 1 / 3 + 0.3, 0)},
            TWO_TRIANGLES[:1],
        ),
        "has no volume",
    ),
    "crossed": (turned_quadrangle((1, 2, 4, 3)), "has crossing sides, first at (0.5, 0.5)"),
    "re-entrant": (
        msh({**SQUARE, 3: (0.3, 0.3, 0)}, [(QUADRANGLE, 1, 1, (1, 2, 3, 4))]),
        "has crossing sides",
    ),
    "folded": (
        msh({**SQUARE, 4: (2, 0.5, 0)}, TWO_TRIANGLES),
        "have a neighbour on the same side of a common facet",
    ),
    "three cells on a side": (
        msh(SQUARE | {5: (-1, 2, 0)}, [*TWO_TRIANGLES, (TRIANGLE, 1, 1, (1, 3, 5))]),
        "a neighbour on the same side of a common facet",
    ),
    "no number": (msh({**SQUARE, 2: ("nan", 0, 0)}, TWO_TRIANGLES), "coordinates are not numbers"),
    "boundary beside the body": (
        msh(SQUARE | {5: (3, 0, 0)}, [*TWO_TRIANGLES, *BASE, (LINE, 2, 1, (2, 5))], NAMES),
        "has 1 facet that is no side of a cell",
    ),
    "one name for two": (
        msh(SQUARE, TWO_TRIANGLES + BASE, [(2, 1, "wall"), (1, 2, "wall")]),
        "calls both cells and facets 'wall'",
    ),
}


@pytest.mark.parametrize("text, words", REFUSED.values(), ids=REFUSED.keys())
def test_refused(text, words, comm, shared_tmp):
    assert words in refusal(comm, lambda: read_text(text, comm, shared_tmp))


def test_an_inner_diagonal_is_a_side_but_the_other_diagonal_is_not(comm, shared_tmp):
    _, tags = read_text(
        msh(SQUARE, [*TWO_TRIANGLES, (LINE, 2, 1, (3, 1))], NAMES), comm, shared_tmp
    )
    assert comm.allreduce(len(tags["base"].indices)) >= 1
    comm.barrier()
    sentence = refusal(
        comm,
        lambda: read_text(
            msh(SQUARE, [*TWO_TRIANGLES, (LINE, 2, 1, (2, 4))], NAMES), comm, shared_tmp
        ),
    )
    assert "has 1 facet that is no side of a cell" in sentence


def test_a_flawed_box_is_refused_in_three_dimensions(comm):
    class Flawed:
        def __init__(self, **moves):
            self.moves = moves

        def build(self, gmsh):
            BlockMesh(lengths=(1.0,) * 3, divisions=(2, 2, 2), **self.moves).build(gmsh)
            if "simplices" in self.moves:
                # the middle, out through the left side
                gmsh.model.mesh.setNode(14, [-0.7, 0.5, 0.5], [])
            else:
                gmsh.model.mesh.setNode(27, [0.4, 0.4, 0.4], [])  # a corner, in past the middle

    assert "crossing sides" in refusal(comm, lambda: fem.build_mesh(Flawed(), comm))
    assert "the same side of a common facet" in refusal(
        comm, lambda: fem.build_mesh(Flawed(simplices=True), comm)
    )


@pytest.mark.parametrize(
    "text",
    ["$MeshFormat\n4.1 0 8\n$EndMeshFormat\n", msh({}, []), msh(SQUARE, [])],
    ids=["header only", "empty sections", "nodes only"],
)
def test_a_file_without_cells_is_refused(text, comm, shared_tmp):
    assert "mesh.msh has no cells" in refusal(comm, lambda: read_text(text, comm, shared_tmp))


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "mesh.msh is empty"),
        ("\n", "does not begin with $MeshFormat"),
        ("this is no mesh\n", "does not begin with $MeshFormat"),
        ("$MeshFormat\n4.1 0 8\n", "has no cells"),
        (msh(SQUARE, TWO_TRIANGLES).split("$EndNodes")[0], "cut short or damaged near Nodes"),
        (UNKNOWN_NODE, "Unknown node 4 in element 2"),
    ],
    ids=["empty", "blank", "prose", "cut in the header", "cut after the nodes", "unknown node"],
)
def test_an_unreadable_file_is_refused(text, words, comm, shared_tmp):
    assert words in refusal(comm, lambda: read_text(text, comm, shared_tmp))
