"""Distribute meshes with named groups, read from a file or built in memory by a Gmsh script.

Rank 0 reads and checks (vi_contact.meshes.extract), all ranks get the mesh or the same InputError.
Groups are recognised on each rank by the vertices of their members, numbered as in the input: a
facet may be in several.
"""

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any, ClassVar, Self

import numpy as np
import numpy.typing as npt
from dolfinx.mesh import Mesh
from mpi4py import MPI

from ...core.checks import explain_error, function, instance, mask, provides, quote, refuse, whole
from ...core.collective import Parts, agree
from ...core.errors import InputError
from ...core.files import on_root
from ...core.timing import report_time
from ...meshes.extract import MeshArrays, arrays_from_file, arrays_from_script
from ...meshes.gmsh_session import MeshScript
from ...meshes.partition import destinations
from ...meshes.rows import are_among, number_alike
from .. import compat
from ..compat import Indices
from .communicators import MpiComm
from .numbering import node_numbers

MOST_NAMED = 20  # values of tags in a message

_NOWHERE = (np.zeros(0, dtype=np.int32), np.zeros(1, dtype=np.int32))  # destinations of no cells


@dataclass(frozen=True, eq=False)
class Group:
    """Name a part of a mesh by local numbers; each is kept once, ascending.

    Attributes:
        name: that of the group.
        indices: local numbers of cells or facets, those of ghosts too.
        mesh: the mesh that they belong to.
        codimension: 0 of cells, 1 of facets.
    """

    name: str
    indices: Indices
    mesh: Mesh = field(repr=False)
    codimension: ClassVar[int]

    def __post_init__(self) -> None:
        owner = type(self).__name__
        instance(owner, "name", self.name, str, "give a text")
        mesh = instance(
            owner, "mesh", self.mesh, Mesh, "give the DOLFINx mesh that the numbers belong to"
        )
        count = local_count(mesh, self.codimension)
        numbers = np.asarray(self.indices)
        defect = ""
        if numbers.ndim != 1 or (numbers.dtype.kind not in "iu" and numbers.size):
            defect = (
                f"{owner}: indices is {quote(self.indices)}; give local numbers, such as "
                "tags.find(value) returns"
            )
        elif numbers.size and not 0 <= numbers.min() <= numbers.max() < count:
            defect = (
                f"{owner}: '{self.name}' has numbers from {numbers.min()} to {numbers.max()} but "
                f"the mesh has {count} {owner.lower()} here, counted from 0: give numbers of this "
                "mesh"
            )
        refuse([defect], MpiComm(mesh.comm))
        object.__setattr__(self, "indices", np.unique(numbers).astype(np.int32))

    @classmethod
    def tagged(cls, name: str, meshtags: Any, value: int, mesh: Mesh) -> Self:
        """Return the group of the facets, or cells, that have this value in DOLFINx MeshTags.

        Collective.

        Args:
            name: that of the group.
            meshtags: DOLFINx MeshTags of the mesh.
            value: which of their values.
            mesh: the mesh.

        Raises:
            InputError: on all ranks, tags of another mesh or dimension, and a value that none of
                any rank has.
        """
        owner = f"{cls.__name__}.tagged"
        things = cls.__name__.lower()
        instance(owner, "mesh", mesh, Mesh, "give the DOLFINx mesh of the tags")
        provides(owner, "meshtags", meshtags, ("dim", "indices", "values"), "give DOLFINx MeshTags")
        dim = mesh.topology.dim - cls.codimension
        values = np.asarray(meshtags.values)
        tagged = values == whole(owner, "value", value, least=-(2**31))
        chosen = np.asarray(meshtags.indices)[tagged]
        defect = ""
        if not compat.tags_of(meshtags, mesh):
            defect = (
                f"{owner}: the tags of '{name}' are those of another mesh; give tags of this mesh"
            )
        elif meshtags.dim != dim:
            defect = (
                f"{owner}: the tags of '{name}' are of dimension {meshtags.dim} and {things} of "
                f"this mesh have dimension {dim}; give the tags of its {things}"
            )
        refuse([defect], MpiComm(mesh.comm))
        if not mesh.comm.allreduce(len(chosen)):
            known = np.unique(np.concatenate(mesh.comm.allgather(np.unique(values))))
            listing = ", ".join(map(str, known[:MOST_NAMED]))
            if len(known) > MOST_NAMED:
                listing += ", …"
            raise InputError(
                f"{owner}: no {things} have the value {value} of '{name}'; give one of "
                f"{listing or 'none'}"
            )
        return cls(name, chosen, mesh)

    @classmethod
    def where(cls, name: str, mesh: Mesh, marker: Callable[[npt.NDArray[np.float64]], Any]) -> Self:
        """Return the group of the facets of the boundary, or of the cells, in a region. Collective.

        Their vertices are all marked.

        Args:
            name: that of the group.
            mesh: the mesh.
            marker: x (3, n) [m] -> (n,) truth values, as in DOLFINx.

        Raises:
            InputError: on all ranks, a marker that fails, or marks none on any rank.
        """
        owner = f"{cls.__name__}.where"
        things = cls.__name__.lower()
        defects = [""]
        instance(owner, "mesh", mesh, Mesh, "give a DOLFINx mesh")
        function(owner, "marker", marker, "give a function of x (3, n) that returns n truth values")

        # the other ranks must not wait where the marker raises: its error is told afterwards
        def mark_safely(x: Any) -> Any:
            try:
                if x.shape[1]:
                    return mask(
                        owner, f"what the marker of '{name}' returned", marker(x), (x.shape[1],)
                    )
            except Exception as error:  # of a user's function, which may raise anything
                defects.append(explain_error(f"{owner}: the marker of '{name}'", error))
            return np.zeros(x.shape[1], dtype=bool)

        chosen = compat.entities_where(mesh, mesh.topology.dim - cls.codimension, mark_safely)
        refuse(defects, MpiComm(mesh.comm))
        if not mesh.comm.allreduce(len(chosen)):
            candidates = "facets of the boundary" if cls.codimension else "cells"
            raise InputError(
                f"{owner}: the marker of '{name}' marks no {candidates}; mark all vertices of some "
                f"{things}, coordinates compared with np.isclose"
            )
        return cls(name, chosen, mesh)


@dataclass(frozen=True, eq=False)
class Facets(Group):
    """Name a part of the boundary or of an inner surface. Collective.

    It is local facets, ghosts included; kept ascending.

    ``Facets.tagged`` takes them from DOLFINx MeshTags, ``Facets.where`` from a function that marks
    points. InputError, on all ranks, for numbers that are no facets of this mesh.
    """

    codimension: ClassVar[int] = 1


@dataclass(frozen=True, eq=False)
class Cells(Group):
    """Name a part of the body: local cells, ghosts included; kept ascending. Collective.

    ``Cells.tagged`` takes them from DOLFINx MeshTags, ``Cells.where`` from a function that marks
    points. InputError, on all ranks, for numbers that are no cells of this mesh.
    """

    codimension: ClassVar[int] = 0


def local_count(mesh: Mesh, codimension: int) -> int:
    """Return how many cells or facets there are on this rank, ghosts included. Collective."""
    dim = mesh.topology.dim - codimension
    mesh.topology.create_entities(dim)
    local = mesh.topology.index_map(dim)
    return int(local.size_local + local.num_ghosts)


class Tags(dict[str, Any]):
    """Hold the groups of a mesh by name.

    They are `Cells` or `Facets`, the same names on all ranks.

    Raises:
        InputError: other names.
    """

    def __missing__(self, name: str) -> Any:
        facets = [key for key, group in self.items() if isinstance(group, Facets)]
        cells = [key for key, group in self.items() if isinstance(group, Cells)]
        near = " or ".join(get_close_matches(str(name), self, cutoff=0.5))
        raise InputError(
            f"mesh has no group '{name}'; its boundary groups are {', '.join(facets) or 'none'}, "
            f"its cell groups {', '.join(cells)}: {near and f'did you mean {near}? Else '}name it "
            "in Gmsh as a physical group"
        )


def alone() -> MPI.Comm:
    """Return the communicator of this process by itself."""
    return MPI.COMM_SELF


def read_mesh(path: str | Path, comm: MPI.Comm) -> tuple[Mesh, Tags]:
    """Read a mesh and its physical groups.

    Cells are intervals, triangles, quadrilaterals, tetrahedra or hexahedra.

    Cells of second order, which may be curved, need ``assemble(…, degree=2)``. Coordinates are in
    metres. The file is in Gmsh's own format, MSH 2 to 4, text or binary. InputError is raised on
    every rank if the file is missing, is a script, or is not a usable mesh
    (`vi_contact.meshes.extract.extract` lists the reasons). Collective.
    """
    instance("read_mesh", "path", path, (str, Path), "give the path of a mesh file")
    return _distribute(comm, lambda: arrays_from_file(path))


def build_mesh(mesh: MeshScript, comm: MPI.Comm) -> tuple[Mesh, Tags]:
    """Build a mesh without a file from a script of ``vi_contact.meshes``.

    Any object with `build(gmsh)` serves too.

    It raises the errors of `read_mesh`. Collective.
    """
    if isinstance(comm, MPI.Comm):
        agree(MpiComm(comm), "build_mesh", {"mesh": Parts(mesh)})
    provides(
        "build_mesh",
        "mesh",
        mesh,
        ("build",),
        "give a script of vi_contact.meshes, BlockMesh(…) for example",
    )
    return _distribute(comm, lambda: arrays_from_script(mesh))


@report_time("mesh")
def _distribute(comm: MPI.Comm, produce: Callable[[], MeshArrays]) -> tuple[Mesh, Tags]:
    """Return the mesh that rank 0 produces, distributed, and its groups. Collective.

    Args:
        comm: the ranks.
        produce: returns points, cells and groups, on rank 0; what it raises, all ranks raise.
    """
    instance("mesh", "comm", comm, MPI.Comm, "give a communicator, such as MPI.COMM_WORLD")
    # rank 0 has points and cells, the others none; all have the groups
    arrays = on_root(MpiComm(comm), produce)
    groups = comm.bcast(
        arrays and replace(arrays, points=arrays.points[:0], cells=arrays.cells[:0])
    )
    arrays = arrays or groups
    cells = arrays.cells[:, compat.gmsh_order(arrays.cell, arrays.cells.shape[1])]
    where = _NOWHERE
    if comm.rank == 0:
        where = destinations(arrays.points, arrays.cells, arrays.cell, comm.size)
    mesh = compat.create_mesh(comm, arrays.cell, cells, arrays.points, where)

    # groups of cells by the numbers of the input, groups of facets by those of their vertices
    tags = Tags()
    original = np.asarray(mesh.topology.original_cell_index, dtype=np.int64)
    for name, members in arrays.cell_groups.items():
        tags[name] = Cells(name, np.flatnonzero(members[original]).astype(np.int32), mesh)
    everyone = compat.entities_to_geometry(
        mesh, mesh.topology.dim - 1, np.arange(local_count(mesh, 1), dtype=np.int32)
    )
    facets, *named = number_alike(node_numbers(mesh)[everyone], *arrays.facet_groups.values())
    for name, numbers in zip(arrays.facet_groups, named, strict=True):
        tags[name] = Facets(name, np.flatnonzero(are_among(facets, numbers)).astype(np.int32), mesh)
    return mesh, tags
