"""For tests of meshes: sizes by assembly, files written by hand, the one sentence all ranks are
refused with."""

import pytest

dolfinx = pytest.importorskip("dolfinx")

from vi_contact import fem  # noqa: E402
from vi_contact.core.errors import InputError  # noqa: E402
from vi_contact.fem import compat  # noqa: E402

LINE, TRIANGLE, QUADRANGLE, PRISM = 1, 2, 3, 6
SQUARE = {1: (0, 0, 0), 2: (1, 0, 0), 3: (1, 1, 0), 4: (0, 1, 0)}
TWO_TRIANGLES = [(TRIANGLE, 1, 1, (1, 2, 3)), (TRIANGLE, 1, 1, (1, 3, 4))]
BASE = [(LINE, 2, 1, (1, 2))]
NAMES = [(2, 1, "body"), (1, 2, "base")]


def integral(mesh, density, measure):
    one = dolfinx.fem.Constant(mesh, 1.0)  # keeps the mesh in the form when the density is a number
    return mesh.comm.allreduce(
        dolfinx.fem.assemble_scalar(compat.compile_form(one * density * measure))
    )


def size(group):
    """Length, area or volume of a group, by assembly."""
    dim = group.mesh.topology.dim - isinstance(group, fem.Facets)
    return integral(group.mesh, 1.0, compat.measure(group.mesh, dim, group.indices))


def sizes(tags):
    return {name: pytest.approx(size(group), rel=1e-13) for name, group in tags.items()}


def read_text(text, comm, folder):
    """Read a file with the given contents."""
    path = folder / "mesh.msh"
    if comm.rank == 0:
        path.write_text(text)
    comm.barrier()
    return fem.read_mesh(path, comm)


def refusal(comm, act):
    """The one sentence all ranks are refused with."""
    with pytest.raises(InputError) as refused:
        act()
    sentences = comm.allgather(str(refused.value))
    assert len(set(sentences)) == 1
    assert "\n" not in sentences[0]
    return sentences[0]


def msh(nodes, elements, names=()):
    """A file of Gmsh's format 2.2.

    Nodes: tag -> point; elements: (type, physical group, entity, node tags); names of groups: (dim,
    number, name).
    """

    def section(title, lines):
        return [f"${title}", str(len(lines)), *lines, f"$End{title}"]

    named = [f'{dim} {number} "{name}"' for dim, number, name in names]
    placed = [f"{tag} {x} {y} {z}" for tag, (x, y, z) in nodes.items()]
    linked = [
        f"{number} {kind} 2 {physical} {entity} {' '.join(map(str, vertices))}"
        for number, (kind, physical, entity, vertices) in enumerate(elements, start=1)
    ]
    lines = [
        "$MeshFormat",
        "2.2 0 8",
        "$EndMeshFormat",
        *(section("PhysicalNames", named) if named else []),
    ]
    return "\n".join([*lines, *section("Nodes", placed), *section("Elements", linked), ""])
