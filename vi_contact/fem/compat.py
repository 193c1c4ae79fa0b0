"""Settle the differences between versions of DOLFINx.

Every one that this package meets is settled here and nowhere else.

Supported: 0.5 (Debian 12), 0.9 (Debian 13) and 0.11. Nothing else in `fem` asks for the version.
What changed: dofmaps became two-dimensional arrays and the ghost mode went to the partitioner
(0.6), UFL elements became Basix elements and function spaces take tuples (0.7), `create_mesh`
swapped two arguments (0.10), the geometry has one dofmap per cell type (0.11).
"""

from collections.abc import Callable
from contextlib import suppress
from itertools import product
from typing import Any

import basix
import dolfinx
import numpy as np
import numpy.typing as npt
import ufl
from cffi import VerificationError
from dolfinx.fem import petsc as fem_petsc
from dolfinx.mesh import GhostMode, Mesh, meshtags
from mpi4py import MPI
from petsc4py import PETSc

from ..core.errors import InputError

Indices = npt.NDArray[np.int32]

# untyped on purpose: names missing from the installed version are not errors here
fem: Any = dolfinx.fem
_mesh: Any = dolfinx.mesh

# DOLFINx's (major, minor)
VERSION: tuple[int, ...] = tuple(int(part) for part in dolfinx.__version__.split(".")[:2])

_BASIX_ELEMENTS = VERSION >= (0, 7)
_DOFMAP_PER_CELL_TYPE = VERSION >= (0, 11)
# how a vector treats what other ranks send: a name of dolfinx.la that changed in 0.6
_la: Any = dolfinx.la
_ADD = getattr(_la, "InsertMode" if hasattr(_la, "InsertMode") else "ScatterMode").add

# Seconds to wait for a form that another process compiles: a busy machine may take more than the 10
# of the default.
_jit: Any = dolfinx.jit
_defaults = (
    _jit.DOLFINX_DEFAULT_JIT_OPTIONS if VERSION >= (0, 6) else _jit.DOLFINX_DEFAULT_JIT_PARAMETERS
)
_defaults["timeout"] = (120, "Timeout for JIT compilation [s]")

# What compiles
# --------------------------------------------------------------------------------------------------

# errors that DOLFINx raises on all ranks when the first one could not compile; all but one are of
# others
TOGETHER = (
    "Failed just-in-time compilation of form",
    "Failed JIT compilation of form",
    "JIT compilation failed on rank 0",
)


def _compile_by(comm: MPI.Comm, make: Callable[[], Any]) -> Any:
    """Return make(), for which DOLFINx may have to compile. Collective.

    Args:
        comm: the ranks.
        make: calls DOLFINx.

    Raises:
        InputError: on all ranks, where no C compiler works.
    """
    try:
        return make()
    except (RuntimeError, VerificationError) as error:
        message = str(error)
        if comm.size > 1 and message.startswith(TOGETHER):
            message = comm.bcast(message)  # the first rank knows more
        if not any(f"{kind}Error: " in message for kind in ("Compile", "Link")):
            raise
        cause = message.split("Error: ", 1)[1].strip().splitlines()[0]
        raise InputError(
            f"DOLFINx cannot compile a finite element form ({cause}): it needs a C compiler and "
            "the headers of Python and of the C library; install them (Debian: gcc libc6-dev "
            "python3-dev), or name the compiler by the environment variable CC"
        ) from error


# Meshes
# --------------------------------------------------------------------------------------------------


def create_mesh(
    comm: MPI.Comm,
    cell: str,
    cells: npt.NDArray[np.int64],
    x: npt.NDArray[np.float64],
    destinations: tuple[Indices, Indices],
) -> Mesh:
    """Create a mesh of cells of first or second order, with a given distribution. Collective.

    A rank without input passes arrays of the right width and no rows.

    Args:
        comm: the ranks.
        cell: UFL's name of a cell: "interval", "triangle", "quadrilateral", "tetrahedron" or
            "hexahedron".
        cells: (n_cells, n_nodes) rows of ``x`` in DOLFINx's order of vertices and mid-points.
        x: (n_points, gdim) the points [m].
        destinations: the ranks each cell goes to, its owner first, and the offsets of the cells in
            that list.
    """

    # the arguments of a partitioner changed twice, what it returns did not
    def partition(*_: Any) -> Any:
        return dolfinx.cpp.graph.AdjacencyList_int32(*destinations)

    gdim = x.shape[1]
    degree = 1 if cells.shape[1] == len(basix.topology(getattr(basix.CellType, cell))[0]) else 2
    if _BASIX_ELEMENTS:
        from basix.ufl import element

        domain = ufl.Mesh(element("Lagrange", cell, degree, shape=(gdim,)))
        return _mesh.create_mesh(comm, cells=cells, x=x, e=domain, partitioner=partition)
    domain = ufl.Mesh(
        ufl.VectorElement("Lagrange", ufl.Cell(cell, geometric_dimension=gdim), degree)
    )
    # it tries an array first, and its error prints all arguments
    rows = dolfinx.cpp.graph.AdjacencyList_int64(cells)
    return _mesh.create_mesh(
        comm, rows, x, domain, ghost_mode=GhostMode.shared_facet, partitioner=partition
    )


def geometry_dofmap(mesh: Mesh) -> Indices:
    """Return the local geometry nodes of each local cell (owned, then ghosts).

    The shape is (n_cells, n_nodes), vertices first.
    """
    if _DOFMAP_PER_CELL_TYPE:
        return mesh.geometry.dofmaps[0]
    rows = mesh.geometry.dofmap
    return rows if VERSION >= (0, 6) else _as_table(rows, mesh.geometry.cmap.create_dof_layout())


def sub_entities(mesh: Mesh, dim: int) -> list[list[int]]:
    """Return the local vertices of each entity of a dimension of a cell, in DOLFINx's order."""
    return basix.topology(getattr(basix.CellType, mesh.topology.cell_type.name))[dim]


def gmsh_order(cell: str, nodes: int) -> Any:
    """Return where in Gmsh's row of a cell the nodes in DOLFINx's order are.

    Args:
        cell: UFL's name of the cell.
        nodes: how many nodes it has.
    """
    return dolfinx.cpp.io.perm_gmsh(getattr(_mesh.CellType, cell), nodes)


def vtk_order(mesh: Mesh, nodes: int) -> Any:
    """Return where in DOLFINx's row of a cell the nodes in the order of VTK and XDMF are."""
    return np.argsort(dolfinx.cpp.io.perm_vtk(mesh.topology.cell_type, nodes))


def mesh_bytes(mesh: Mesh) -> int:
    """Return the bytes of the nodes and of the connectivities that there are, on this rank."""
    parts = [mesh.geometry.x, geometry_dofmap(mesh)]
    for pair in product(range(mesh.topology.dim + 1), repeat=2):
        with suppress(RuntimeError):  # from 0.6 on of what has not been made, which is None before
            links = mesh.topology.connectivity(*pair)
            if links is not None:
                parts += [links.array, links.offsets]
    return sum(part.nbytes for part in parts)


def entities_to_geometry(mesh: Mesh, dim: int, entities: Indices) -> Indices:
    """Return local geometry nodes of the vertices of each entity, (n_entities, n_vertices).

    Collective.

    Args:
        mesh: the mesh.
        dim: dimension of the entities.
        entities: (n_entities,) local numbers.
    """
    tdim = mesh.topology.dim
    cell = mesh.topology.cell_type
    mesh.topology.create_entities(dim)
    mesh.topology.create_connectivity(dim, tdim)
    mesh.topology.create_connectivity(tdim, dim)
    count = dolfinx.cpp.mesh.cell_num_vertices(dolfinx.cpp.mesh.cell_entity_type(cell, dim, 0))
    if not len(entities):  # 0.9 divides by their number
        return np.empty((0, count), dtype=np.int32)
    if _BASIX_ELEMENTS:
        # since 0.8 mid-points follow
        return _mesh.entities_to_geometry(mesh, dim, entities)[:, :count]
    return dolfinx.cpp.mesh.entities_to_geometry(mesh._mesh, dim, entities, False)


def tags_of(tags: Any, mesh: Mesh) -> bool:
    """Return whether MeshTags are those of this mesh.

    What they refer to, a mesh or a topology, changed in 0.7.
    """
    if hasattr(tags, "topology"):
        return _bare(tags.topology) is _bare(mesh.topology)
    return _bare(tags.mesh) is _bare(mesh)


def _bare(wrapped: Any) -> Any:
    """Return the C++ object behind one of DOLFINx's Python part, and other objects as they are."""
    return getattr(wrapped, "_cpp_object", getattr(wrapped, "_mesh", wrapped))


def is_on(space: Any, mesh: Mesh) -> bool:
    """Return whether a function space, or what a ``dirichletbc`` knows of one, is on this mesh."""
    return _bare(space.mesh) is _bare(mesh)


def entities_where(mesh: Mesh, dim: int, marker: Callable[[Any], Any]) -> Indices:
    """Return the local cells, or facets of the boundary, whose vertices are all marked.

    Args:
        mesh: the mesh.
        dim: that of cells, or one less for facets.
        marker: x (3, n) -> (n,) truth values.
    """
    mesh.topology.create_entities(dim)
    mesh.topology.create_connectivity(dim, mesh.topology.dim)
    locate = _mesh.locate_entities if dim == mesh.topology.dim else _mesh.locate_entities_boundary
    return np.asarray(locate(mesh, dim, marker), dtype=np.int32)


def cell_numbers(mesh: Mesh) -> npt.NDArray[np.int64]:
    """Return numbers of the owned cells.

    They are those of the input, which any ranks leave as they are, where there are any.
    """
    cells = mesh.topology.index_map(mesh.topology.dim)
    given = ()
    with suppress(RuntimeError):  # a part of a mesh has none: an empty array in 0.5, an error since
        given = mesh.topology.original_cell_index
    known = mesh.comm.allreduce(int(len(given) >= cells.size_local), op=MPI.MIN)
    here = given if known else cells.local_to_global(np.arange(cells.size_local, dtype=np.int32))
    return np.asarray(here, dtype=np.int64)[: cells.size_local]


def measure(mesh: Mesh, dim: int, indices: Indices) -> ufl.Measure:
    """Return dx (dim = topological dimension) or ds (one less) on these local entities.

    ds skips inner facets.

    Args:
        mesh: the mesh.
        dim: that of cells for dx, one less for ds.
        indices: local numbers of the cells or facets.
    """
    kind = "dx" if dim == mesh.topology.dim else "ds"
    tags = meshtags(
        mesh, dim, np.asarray(indices, dtype=np.int32), np.ones(len(indices), dtype=np.int32)
    )
    return ufl.Measure(kind, domain=mesh, subdomain_data=tags)(1)


# Function spaces
# --------------------------------------------------------------------------------------------------


def vector_space(mesh: Mesh, degree: int = 1) -> Any:
    """Make the space of continuous vector fields (P1, Q1, P2, Q2) with gdim components.

    The block size is gdim.
    """
    return lagrange(mesh, degree, (mesh.geometry.dim,))


def lagrange(
    mesh: Mesh, degree: int, shape: tuple[int, ...] = (), *, continuous: bool = True
) -> Any:
    """Make the space of Lagrange fields of values of this shape: (), (d,) or that of a matrix.

    Args:
        mesh: the mesh.
        degree: 0, 1 or 2.
        shape: () for numbers, (d,) for vectors, (n, n) for matrices.
        continuous: whether fields are.
    """
    discontinuous = "DG" if _BASIX_ELEMENTS or is_simplex(mesh) else "DQ"
    family = "Lagrange" if continuous else discontinuous

    def make() -> Any:
        if _BASIX_ELEMENTS:
            return fem.functionspace(mesh, (family, degree, shape) if shape else (family, degree))
        if len(shape) == 2:
            return fem.TensorFunctionSpace(mesh, (family, degree), shape=shape)
        return (fem.VectorFunctionSpace if shape else fem.FunctionSpace)(mesh, (family, degree))

    return _compile_by(mesh.comm, make)


def is_simplex(mesh: Mesh) -> bool:
    """Say whether the cells are intervals, triangles or tetrahedra."""
    return mesh.topology.cell_type.name in ("interval", "triangle", "tetrahedron")


def dof_to_node(space: Any) -> Indices:
    """Return the local geometry node of each block of unknowns (owned, then ghosts), (n_blocks,).

    This is for spaces whose nodes are those of the mesh: P1 or Q1 on first-order, P2 or Q2 on
    second-order cells. Unknown c of block i (index bs*i + c) is component c at the point
    `mesh.geometry.x[dof_to_node(space)[i]]`.
    """
    index_map = space.dofmap.index_map
    nodes = np.full(index_map.size_local + index_map.num_ghosts, -1, dtype=np.int32)
    nodes[cell_blocks(space)] = geometry_dofmap(space.mesh)
    return nodes


def cell_blocks(space: Any) -> Indices:
    """Return the local blocks of unknowns of each cell (owned, then ghosts).

    The shape is (n_cells, n_nodes), vertices first.
    """
    return _as_table(space.dofmap.list, space.dofmap.dof_layout)


def blocks_of_cells(space: Any) -> Indices:
    """Return ``cell_blocks`` of the space of a ``dirichletbc``, which is V or V.sub(i).

    The space is in C++ up to 0.11, in Python since. V.sub(i) has one unknown a node, with the
    number that it has in V.
    """
    rows = getattr(space.dofmap, "map", None) or space.dofmap.list
    table = _as_table(rows() if callable(rows) else rows, space.dofmap.dof_layout)
    if space.dofmap.bs == space.dofmap.index_map_bs:
        return table
    return table // space.dofmap.index_map_bs


def bc_values(bc: Any, count: int) -> tuple[Indices, npt.NDArray[np.float64]]:
    """Return the local unknowns (k,) that a ``dirichletbc`` holds, ghosts too, and their values.

    Args:
        bc: the condition.
        count: how many local unknowns its space has.
    """
    values = np.zeros(count)
    bc.set(values, None, 1.0) if hasattr(bc, "set") else fem.set_bc(values, [bc])
    dofs = bc.dof_indices()[0]
    return dofs, values[dofs]


def _as_table(rows: Any, layout: Any) -> Indices:
    """Return rows of cells as a table (cells, n): an AdjacencyList in 0.5, an array since.

    Args:
        rows: one of the two; a rank may have no cells.
        layout: that of the unknowns of a cell, which knows n.
    """
    return rows if isinstance(rows, np.ndarray) else rows.array.reshape(-1, layout.num_dofs)


# Assembly
# --------------------------------------------------------------------------------------------------


def compile_form(ufl_form: ufl.Form, degree: int | None = None) -> Any:
    """Generate, compile and load the code of a variational form. Collective.

    The code is cached on disk by the form's signature.

    Args:
        ufl_form: the form.
        degree: quadrature degree of the integrals that do not say their own; None leaves it to
            UFL's estimate.
    """
    if degree is not None:
        integrals = [
            integral
            if "quadrature_degree" in integral.metadata()
            else integral.reconstruct(metadata={**integral.metadata(), "quadrature_degree": degree})
            for integral in ufl_form.integrals()
        ]
        ufl_form = ufl.Form(integrals)
    comm = ufl_form.ufl_domain().ufl_cargo().comm
    return _compile_by(comm, lambda: fem.form(ufl_form))


def assemble_matrix(form: Any) -> PETSc.Mat:
    """Assemble the matrix of a compiled bilinear form, without boundary conditions.

    It is ready to use.
    """
    matrix = fem_petsc.assemble_matrix(form)
    matrix.assemble()
    return matrix


def create_matrix(form: Any, comm: MPI.Comm) -> PETSc.Mat:
    """Make a matrix into which ``assemble_again`` assembles a compiled bilinear form. Collective.

    Args:
        form: the form.
        comm: a communicator of the ranks of its mesh, which may last longer than this one.
    """
    given = assemble_matrix(form)
    n, columns = given.getLocalSize()
    mat = PETSc.Mat().createAIJ(
        ((n, None), (columns, None)),
        bsize=given.getBlockSize(),
        csr=given.getValuesCSR(),
        comm=comm,
    )
    # Assembly counts rows and columns on the rank, blocks of them where there are blocks.
    maps = [
        PETSc.LGMap().create(local.getBlockIndices(), bsize=local.getBlockSize(), comm=comm)
        for local in given.getLGMap()
    ]
    mat.setLGMap(*maps)
    given.destroy()
    return mat


def assemble_again(form: Any, mat: PETSc.Mat) -> None:
    """Assemble a compiled bilinear form into a matrix that ``create_matrix`` made. Collective."""
    mat.zeroEntries()
    fem_petsc.assemble_matrix(mat, form)
    mat.assemble()


def assemble_into(form: Any, field: Any) -> None:
    """Assemble a compiled linear form into the array of a Function. Collective.

    Contributions of all ranks are added on the owner; ghost entries are left stale.
    """
    field.x.array[:] = 0.0
    fem.assemble_vector(field.x.array, form)
    add_to_owners(field)


def assemble_vector(form: Any) -> PETSc.Vec:
    """Assemble a compiled linear form, contributions of all ranks added on the owner.

    Ghost entries are left stale.
    """
    vector = fem_petsc.assemble_vector(form)
    vector.ghostUpdate(addv=PETSc.InsertMode.ADD, mode=PETSc.ScatterMode.REVERSE)
    return vector


def assemble_scalar(form: Any) -> float:
    """Assemble a compiled functional over the cells and facets of this rank.

    The ranks' values are not added.
    """
    return float(fem.assemble_scalar(form))


def cell_space(mesh: Mesh) -> Any:
    """Make the space of functions that are constant on every cell."""
    return lagrange(mesh, 0, continuous=False)


def expression(expr: Any, space: Any) -> Any:
    """Make what ``Function.interpolate`` takes of an expression of UFL, for a space."""
    points = space.element.interpolation_points
    places = points() if callable(points) else points  # a property since 0.10
    return _compile_by(space.mesh.comm, lambda: fem.Expression(expr, places))


def constant(mesh: Mesh, value: float) -> Any:
    """Make a number that is no part of the compiled code of a form."""
    return fem.Constant(mesh, PETSc.ScalarType(value))


def function(space: Any) -> Any:
    """Make a zero finite element function."""
    return fem.Function(space)


def locate_blocks(space: Any, facets: Indices) -> Indices:
    """Return the local blocks of unknowns on the facets. Collective.

    They are found on every rank that owns or ghosts them.
    """
    mesh = space.mesh
    tdim = mesh.topology.dim
    mesh.topology.create_connectivity(tdim - 1, tdim)
    return fem.locate_dofs_topological(space, tdim - 1, np.asarray(facets, dtype=np.int32))


def locate_owned_blocks(space: Any, facets: Indices) -> npt.NDArray[np.int64]:
    """Return the owned blocks of unknowns on the facets, wherever these are owned. Collective."""
    blocks = locate_blocks(space, facets)
    return np.asarray(blocks[blocks < space.dofmap.index_map.size_local], dtype=np.int64)


def nodal(space: Any) -> bool:
    """Say whether the unknowns of a space are values at points, of one field.

    They are not moments, and there is no mixed element.
    """
    element = space.element
    return (
        element.num_sub_elements in (0, space.dofmap.index_map_bs) and element.interpolation_ident
    )


def constrains(bc: Any, space: Any) -> bool:
    """Say whether this is a Dirichlet condition on a space, or on a component of it."""
    return hasattr(bc, "function_space") and bool(_bare(space).contains(_bare(bc.function_space)))


def evaluate(field: Any, point: Any, cell: int) -> npt.NDArray[np.float64]:
    """Return the components of a function at a point (3,) [m] in a local cell, (bs,)."""
    return np.asarray(field.eval(np.reshape(point, (1, 3)), [cell]), dtype=float).ravel()


def continuous(space: Any) -> bool:
    """Say whether the fields of a space do not jump between cells."""
    element = space.ufl_element()
    if not _BASIX_ELEMENTS:  # of vectors it is the one of their components that knows
        parts = element.sub_elements()
        element = parts[0] if parts else element
    return element in ufl.H1


# Points of integration
# --------------------------------------------------------------------------------------------------


def make_quadrature(mesh: Mesh, degree: int) -> tuple[Any, Any]:
    """Return points (q, d) and weights (q,) of the reference cell, exact up to a degree."""
    return basix.make_quadrature(getattr(basix.CellType, mesh.topology.cell_type.name), degree)


def tabulate(mesh: Mesh, nodes: int, points: Any) -> tuple[Any, Any]:
    """Return the Lagrange shape functions (q, n) of cells at points, and their slopes (d, q, n).

    Args:
        mesh: the mesh, of cells of first or second order.
        nodes: n, how many nodes a cell of this element has.
        points: (q, d) in the reference cell.
    """
    cell = getattr(basix.CellType, mesh.topology.cell_type.name)
    degree = 1 if nodes == len(basix.topology(cell)[0]) else 2
    element = basix.create_element(
        basix.ElementFamily.P, cell, degree, basix.LagrangeVariant.gll_warped
    )
    table = element.tabulate(1, points)[:, :, :, 0]
    return table[0], table[1:]


def add_to_owners(field: Any) -> None:
    """Add the ghost entries of a Function to those of their owners. Collective."""
    field.x.scatter_reverse(_ADD)
