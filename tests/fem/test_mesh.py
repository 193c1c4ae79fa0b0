"""Distributed meshes: exact sizes by assembly, groups by name, numbers of the input; on any number
of ranks."""

import math

import numpy as np
import pytest

from vi_contact.core.errors import ViContactError
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.cut import CutOpen
from vi_contact.meshes.extract import arrays_from_script
from vi_contact.meshes.geo_file import GeoFile
from vi_contact.meshes.gmsh_session import write
from vi_contact.meshes.wall import WallMesh

pytest.importorskip("gmsh")
pytest.importorskip("dolfinx")
ufl = pytest.importorskip("ufl")

from mesh_tools import integral, refusal, size, sizes  # noqa: E402

from vi_contact import fem  # noqa: E402
from vi_contact.fem import compat  # noqa: E402


@pytest.mark.parametrize(
    "options", [{}, {"triangles": True}, {"size": 1.1}, {"size": 1.1, "triangles": True}], ids=str
)
def test_wall_and_its_sides_have_their_exact_sizes(options, comm):
    mesh, tags = fem.build_mesh(WallMesh(**options), comm)
    assert sizes(tags) == {"wall": 54.0, "base": 6.0, "face": 9.0, "top": 6.0, "back": 9.0}
    assert isinstance(tags["wall"], fem.Cells) and tags["wall"].mesh is mesh
    assert isinstance(tags["base"], fem.Facets) and tags["base"].name == "base"


@pytest.mark.long
def test_a_script_of_gmsh_is_meshed_refined_and_cut(comm, shared_tmp):
    """C1.2: two bodies that share an edge, from a .geo, cut open along it: sizes, and four times
    the cells."""
    script = shared_tmp / "two.geo"
    if comm.rank == 0:
        script.write_text(
            "Point(1) = {0, 0, 0}; Point(2) = {2, 0, 0}; Point(3) = {2, 1, 0}; Point(4) = {0, 1, "
            "0};\n"
            "Point(5) = {2, 3, 0}; Point(6) = {0, 3, 0};\nLine(1) = {1, 2}; Line(2) = {2, 3}; "
            "Line(3) = {3, 4};\n"
            "Line(4) = {4, 1}; Line(5) = {3, 5}; Line(6) = {5, 6}; Line(7) = {6, 4};\n"
            "Curve Loop(1) = {1:4}; Plane Surface(1) = {1}; Curve Loop(2) = {5, 6, 7, -3}; Plane "
            "Surface(2) = {2};\n"
            'MeshSize{:} = 0.5;\nPhysical Curve("joint") = {3}; Physical Curve("foot") = {1};\n'
            'Physical Surface("rock") = {1}; Physical Surface("dam") = {2};\n',
            encoding="utf-8",
        )
    comm.Barrier()
    cells = []
    for refine in (0, 1):
        source = CutOpen(GeoFile(path=script, refine=refine), "joint", inside="dam")
        mesh, tags = fem.build_mesh(source, comm)
        assert sizes(tags) == {"rock": 2.0, "dam": 4.0, "foot": 2.0, "joint_1": 2.0, "joint_2": 2.0}
        cells.append(mesh.topology.index_map(2).size_global)
    assert cells[1] == 4 * cells[0]


@pytest.mark.parametrize("simplices", [True, False])
@pytest.mark.parametrize("d", [1, 2, 3])
def test_blocks_and_their_sides_have_their_exact_sizes_also_turned(d, simplices, comm):
    lengths = (2.0, 3.0, 5.0)[:d]
    block = BlockMesh(
        lengths=lengths, divisions=(3, 2, 4)[:d], simplices=simplices, angle=0.7 if d > 1 else 0.0
    )
    mesh, tags = fem.build_mesh(block, comm)
    sides = [math.prod(lengths) / length for length in lengths for _ in range(2)]
    names = ["left", "right", "bottom", "top", "back", "front"][: 2 * d]
    assert sizes(tags) == {"block": math.prod(lengths), **dict(zip(names, sides, strict=True))}


@pytest.mark.parametrize("simplices", [True, False])
@pytest.mark.parametrize("d", [2, 3])
def test_sides_face_outwards(d, simplices, comm):
    """Mean outward normal of the side of highest x, turned by an angle, is (cos, sin)."""
    mesh, tags = fem.build_mesh(
        BlockMesh(lengths=(1.0,) * d, divisions=(2,) * d, simplices=simplices, angle=0.7), comm
    )
    normal, ds = ufl.FacetNormal(mesh), compat.measure(mesh, d - 1, tags["right"].indices)
    assert integral(mesh, normal[0], ds) == pytest.approx(math.cos(0.7), rel=1e-13)
    assert integral(mesh, normal[1], ds) == pytest.approx(math.sin(0.7), rel=1e-13)


def test_groups_are_ascending_local_indices_on_every_rank_even_where_empty(comm):
    mesh, tags = fem.build_mesh(BlockMesh(divisions=(1, 2)), comm)
    for group in tags.values():
        dim = mesh.topology.dim - isinstance(group, fem.Facets)
        local = mesh.topology.index_map(dim).size_local + mesh.topology.index_map(dim).num_ghosts
        assert group.indices.dtype == np.int32
        assert np.all(np.diff(group.indices) > 0)
        assert np.all((group.indices >= 0) & (group.indices < local))
    assert len(set(comm.allgather(tuple(tags)))) == 1


@pytest.mark.parametrize(
    "script",
    [
        WallMesh(size=1.3, triangles=True),
        BlockMesh(lengths=(1.0,) * 3, divisions=(2, 3, 2), angle=0.3),
    ],
    ids=["triangles", "hexahedra"],
)
def test_nodes_keep_their_input_numbers(script, comm):
    mesh, _ = fem.build_mesh(script, comm)
    points = comm.bcast(arrays_from_script(script).points if comm.rank == 0 else None)
    numbers = fem.node_numbers(mesh)
    assert numbers.shape == (len(mesh.geometry.x),)
    assert np.array_equal(mesh.geometry.x[:, : points.shape[1]], points[numbers])
    owned = numbers[: mesh.geometry.index_map().size_local]
    assert np.array_equal(np.sort(np.concatenate(comm.allgather(owned))), np.arange(len(points)))


def test_a_mesh_is_distributed_and_numbered_the_same_every_time(comm):
    script = BlockMesh(lengths=(1.0, 2.0), divisions=(13, 17), simplices=True)
    (one, tags), (two, again) = fem.build_mesh(script, comm), fem.build_mesh(script, comm)
    assert np.array_equal(fem.node_numbers(one), fem.node_numbers(two))
    assert np.array_equal(compat.geometry_dofmap(one), compat.geometry_dofmap(two))
    assert all(np.array_equal(tags[name].indices, again[name].indices) for name in tags)
    shares = comm.allgather(one.topology.index_map(2).size_local)
    assert max(shares) - min(shares) <= 2


def test_there_may_be_more_ranks_than_cells(comm):
    """A rank without cells takes part in everything."""
    mesh, tags = fem.build_mesh(BlockMesh(), comm)
    assert sizes(tags) == {"block": 1.0, "left": 1.0, "right": 1.0, "bottom": 1.0, "top": 1.0}
    assert comm.allreduce(len(compat.dof_to_node(compat.vector_space(mesh)))) == 4


# Files
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "script",
    [WallMesh(), BlockMesh(lengths=(1.0,) * 3, divisions=(2, 2, 2), simplices=True)],
    ids=["wall", "tetrahedra"],
)
def test_a_file_gives_the_mesh_of_its_script(script, comm, shared_tmp):
    if comm.rank == 0:
        write(script, shared_tmp / "mesh.msh")
    comm.barrier()
    _, from_file = fem.read_mesh(str(shared_tmp / "mesh.msh"), comm)
    _, from_script = fem.build_mesh(script, comm)
    assert list(from_file) == list(from_script)
    assert sizes(from_file) == {name: size(group) for name, group in from_script.items()}


def test_a_missing_group_is_named_with_those_there_are(comm):
    _, tags = fem.build_mesh(WallMesh(), comm)
    sentence = refusal(comm, lambda: tags["fase"])
    assert sentence == (
        "mesh has no group 'fase'; its boundary groups are back, face, base, top, its cell groups "
        "wall:"
        " did you mean face or base? Else name it in Gmsh as a physical group"
    )
    assert "fase" not in tags and tags.get("fase") is None


def test_a_missing_file_is_refused_on_all_ranks(comm, shared_tmp):
    assert "nowhere.msh does not exist" in refusal(
        comm, lambda: fem.read_mesh(shared_tmp / "nowhere.msh", comm)
    )
    assert "does not exist" in refusal(comm, lambda: fem.read_mesh(shared_tmp, comm))


def test_a_defect_of_a_script_reaches_all_ranks(comm):
    class Faulty:
        def build(self, gmsh):
            raise ZeroDivisionError("of the script")

    with pytest.raises(
        ZeroDivisionError if comm.rank == 0 else ViContactError, match="of the script"
    ):
        fem.build_mesh(Faulty(), comm)
    _, tags = fem.build_mesh(BlockMesh(), comm)  # and nothing is left behind
    assert size(tags["block"]) == pytest.approx(1.0, rel=1e-13)
