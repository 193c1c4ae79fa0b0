"""Write fields for ParaView: ``fields.xdmf`` and HDF5 files of one frame or several.

Nodes and cells are in the order of the input mesh. Every file is replaced as a whole and the index
names only frames that are complete, so that ParaView can open it at any moment, also while the run
goes on or after it was killed. Nothing in the files depends on the number of ranks.

Bodies that are absent, not yet placed or removed, are left out with the nodes that are theirs
alone: the others keep their order. What a frame holds: docs/reference/files.md. In the first one a
is zero, and with friction all closed nodes stick.
"""

import logging
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import numpy as np

from ...core.algebra import Array, Indices, from_each, on_first
from ...core.arguments import check_fields
from ...core.checks import column_name
from ...core.corners import find_tangents
from ...core.errors import InputError
from ...core.files import (
    FIELDS,
    FIELDS_INDEX,
    FRAME,
    FRAMES,
    hdf5_atomically,
    list_frames,
    on_root,
    open_hdf5,
    write_atomically,
)
from ...core.internal import remembers
from ...core.own_files import inner_folder, make_inner_folder, remove
from ...core.problem import ContactProblem
from ...core.quantities import Positive
from ...core.step import Report, State, find_slipping
from ..matrices.own_matrices import MatrixSpace
from ..mesh.nodal_space import NodalSpace

if TYPE_CHECKING:
    from .own_functions import OwnFunctions

log = logging.getLogger(__name__)


class VonMises:
    """Compute the mean von Mises stress of owned cells [Pa].

    It is ∫ sqrt(3/2 s:s) / ∫ 1 over a cell, s = dev(sigma). Plane strain has sigma_zz = lambda
    tr(eps), plane stress none, a bar uniaxial stress. Viscous stresses are left out.
    """

    def __init__(self, forms: Any) -> None:
        """Compile the form. Collective.

        Args:
            forms: the ElasticForms of a system.
        """
        import ufl  # late, as compat: frames of own matrices need no DOLFINx

        from .. import compat
        from .outline import cell_volumes

        space = forms.space
        self._forms = forms
        self._assemble = compat.assemble_vector
        self._u = compat.function(space.V)
        # the constants of the forms carry the thickness as a factor, and so do their stresses
        sigma, across = (stress / forms.section.thickness for stress in forms.stresses(self._u))
        # s:s of the tensor in three dimensions: beside its part in d dimensions, ``across`` lies on
        # the diagonal as often as dimensions are missing
        mean = (ufl.tr(sigma) + across) / 3
        deviator = sigma - mean * ufl.Identity(space.dimension)
        squares = ufl.inner(deviator, deviator) + (3 - space.dimension) * (across - mean) ** 2
        cell = ufl.TestFunction(compat.cell_space(space.mesh))
        self._form = compat.compile_form(
            ufl.sqrt(1.5 * squares) * cell * ufl.dx(metadata={"quadrature_degree": 2})
        )
        self._volume = cell_volumes(space.mesh)

    def __call__(self, nodal: Array, t: float = 0.0) -> Array:
        """Return the mean stresses (owned cells,) [Pa]. Collective.

        Args:
            nodal: (owned nodes, d) displacements [m].
            t: time [s], of initial strains.
        """
        self._u.x.array[: nodal.size] = nodal.ravel()
        self._u.x.scatter_forward()
        self._forms.follow(self._u, t)
        return np.asarray(self._assemble(self._form).array_r / self._volume)


_CELLS = {
    (1, 2): "Polyline",
    (2, 3): "Triangle",
    (2, 4): "Quadrilateral",
    (3, 4): "Tetrahedron",
    (3, 8): "Hexahedron",
    (1, 3): "Edge_3",
    (2, 6): "Triangle_6",
    (2, 9): "Quadrilateral_9",
    (3, 10): "Tetrahedron_10",
    (3, 27): "Hexahedron_27",
}
"""XDMF's name of a cell by its dimension and number of nodes."""

_VECTORS = ("u", "v", "a")
_RUBBING = ("contact_traction_t", "slip")
_POINTS = {
    "von_mises": "equivalent_stress",
    "plastic_strain": "plastic_strain",
    "mobilised_strength": "mobilised_strength",
}
"""What frames of a body that yields have for each cell, and how its points call it."""
TAKEN = (*_VECTORS, *_RUBBING, "contact_pressure", "contact_status", "von_mises")
"""Names that Functions of the user cannot have in any run."""


@dataclass(frozen=True)
class XDMF:
    """Write a frame every so many steps, and one of the initial state.

    Args:
        every: a frame each so many steps.
        frames_per_file: each time so many frames have files of their own they are put into one:
            some file systems want few files.
        functions: name -> a DOLFINx Function of the user's on the mesh of the body, which every
            frame has with the values of its moment; or a function of the state (``State``) that
            returns one. It is of a continuous Lagrange space, interpolated at the nodes, or
            constant in each cell; a number, a vector or a tensor.
    """

    every: Annotated[int, Positive] = 10
    frames_per_file: Annotated[int, Positive] = 1
    functions: Mapping[str, Any] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        check_fields(self)
        check_names("XDMF", self.functions, TAKEN)

    def open(
        self, problem: ContactProblem, folder: Path, kept: Mapping[int, float]
    ) -> "XDMFWriter":
        """Write the mesh, and return what writes the frames. Collective.

        Args:
            problem: that of the run.
            folder: that of the run.
            kept: step -> time [s] of frames with which the run goes on; those of them that are in
                the folder stay, and all others are removed.
        """
        values = FrameValues("XDMF", problem, self.functions)
        return XDMFWriter(values, folder, kept, self.frames_per_file)


@dataclass(frozen=True)
class Cells:
    """Hold the owned cells of a frame.

    Attributes:
        kind: XDMF's name of them.
        nodes: (k, v) numbers of their nodes, in VTK's order.
        numbers: (k,) their numbers in the file.
        von_mises: computes their stress, None where the forms have none.
    """

    kind: str
    nodes: Indices
    numbers: Indices
    von_mises: VonMises | None = None


def check_names(owner: str, functions: Mapping[str, Any], taken: Sequence[str]) -> None:
    """Raise InputError for a name of a Function that frames cannot have, or have already.

    Args:
        owner: the beginning of messages.
        functions: the user's, by name.
        taken: names that frames have already.
    """
    for name in functions:
        column_name("name of a Function", name)
        if name in taken:
            raise InputError(
                f"{owner}: functions has the name '{name}', which frames have already; give another"
            )


@dataclass(frozen=True)
class Grid:
    """Hold the mesh of all ranks on rank 0, in the order of the input mesh.

    Attributes:
        kind: XDMF's name of the cells.
        points: (n, 3) nodes [m].
        cells: (c, v) their nodes, in VTK's order.
        owners: (c,) the rank of each cell.
    """

    kind: str
    points: Array
    cells: Indices
    owners: Indices


@dataclass(frozen=True)
class Kept:
    """Hold which nodes and cells of a mesh frames have, on rank 0, where bodies may be absent.

    Attributes:
        nodes: (k,) their numbers in the order of the input mesh; none on other ranks.
        cells: (c,) likewise.
    """

    nodes: Indices
    cells: Indices

    def keep_grid(self, whole: Grid) -> Grid:
        """Return the part of a grid that is kept, with nodes counted anew."""
        return Grid(
            whole.kind,
            whole.points[self.nodes],
            np.searchsorted(self.nodes, whole.cells[self.cells]),
            whole.owners[self.cells],
        )


class FrameValues:
    """Compute what a frame holds, on all ranks, and hand it to rank 0.

    Attributes:
        comm: of the ranks.
        names: of the nodal vectors.
        grid: on rank 0; on others its arrays are empty.
        cell_names: of the numbers of each cell, the user's apart.
        own: the user's Functions, None without.
    """

    def __init__(self, owner: str, problem: ContactProblem, functions: Mapping[str, Any]) -> None:
        """Gather the mesh. Collective.

        Args:
            owner: the beginning of messages.
            problem: that of the run.
            functions: the user's, by name.
        """
        space: Any = problem.system.space
        self.own: OwnFunctions | None = None
        if isinstance(space, MatrixSpace):
            if functions:
                raise InputError(
                    f"{owner}: functions are on a mesh, and the system was not made of one; leave "
                    "them out"
                )
            cells = Cells("Polyvertex", space.nodes[:, None], space.nodes)
        else:
            from . import own_functions  # late: the other frames need no DOLFINx

            cells = _cells_of_body(owner, problem)
            if functions:
                self.own = own_functions.OwnFunctions(owner, problem, functions)
        self.comm = space.comm
        self.names = _VECTORS + (_RUBBING if problem.frictional else ())
        self._yields = remembers(problem.system.internal) and not isinstance(space, MatrixSpace)
        self.cell_names: tuple[str, ...] = ()
        if self._yields:
            self.cell_names = tuple(_POINTS)
            check_names(owner, functions, self.cell_names)
        elif cells.von_mises is not None:
            self.cell_names = ("von_mises",)
        self._problem = problem
        self._space = space
        self._cell_numbers = cells.numbers
        self._von_mises = cells.von_mises
        owners = np.full(len(cells.numbers), space.comm.rank)
        whole = Grid(
            cells.kind,
            on_first(space.comm, space.nodes, _pad_axes(space.points)),
            on_first(space.comm, cells.numbers, cells.nodes),
            on_first(space.comm, cells.numbers, owners),
        )
        absent = getattr(space, "absent", None)
        self._kept: Kept | None = None
        self.grid = whole
        if absent is not None:
            there = on_first(space.comm, cells.numbers, ~absent[: len(cells.numbers)])
            self._kept = Kept(np.unique(whole.cells[there]), np.flatnonzero(there))
            self.grid = self._kept.keep_grid(whole)

    def gather(
        self, state: State, acceleration: Array, report: Report | None
    ) -> tuple[dict[str, Array], dict[str, Array]]:
        """Return the values of a frame on rank 0, by name: of nodes, and of cells. Collective.

        Args:
            state: at the end of the step.
            acceleration: (n,) of the step, in the rotated basis [m/s²].
            report: that of the step, which tells what slips; None for the initial state.
        """
        problem = self._problem
        space = self._space

        # motion of the nodes and stress of the cells
        vectors = [
            space.expand(problem.cartesian(x), state.t, derivative)
            for derivative, x in enumerate((state.u, state.v, acceleration))
        ]
        cellwise = self._gather_points(state) if self._yields else {}
        if self._von_mises is not None:
            stress = self._von_mises(vectors[0], state.t)
            cellwise["von_mises"] = on_first(space.comm, self._cell_numbers, stress)

        # contact: 1 open, 2 sticking, 3 slipping
        slipping = np.zeros(problem.surface.count, dtype=bool)
        if problem.frictional and report is not None:
            slipping = find_slipping(report)
        pressure, status = nodal_contact(
            problem, state, np.where(state.active, np.where(slipping, 3, 2), 1)
        )
        if problem.frictional:
            vectors += [between(problem, nodal) for nodal in compute_rubbing(problem, state)]

        # the rows of all nodes, in the order of ``names``, and the user's Functions
        rows = np.hstack([*(_pad_axes(nodal) for nodal in vectors), pressure, status])
        rows = on_first(space.comm, space.nodes, rows)
        nodal = {name: rows[:, 3 * i : 3 * i + 3] for i, name in enumerate(self.names)}
        nodal["contact_pressure"] = rows[:, -2]
        nodal["contact_status"] = rows[:, -1].astype(np.int32)
        if self.own is not None:
            for name, values in self.own.gather_values(state).items():
                place = cellwise if self.own.kinds[name].in_cells else nodal
                place[name] = values
        if self._kept is not None and self.comm.rank == 0:
            nodal = {name: values[self._kept.nodes] for name, values in nodal.items()}
            cellwise = {name: values[self._kept.cells] for name, values in cellwise.items()}
        return nodal, cellwise

    def _gather_points(self, state: State) -> dict[str, Array]:
        """Return the cell means of a body that yields on rank 0, by name. Collective."""
        from . import material_points  # late, as compat

        standing = material_points.stand(self._problem, state)
        cellwise = {}
        for name, quantity in _POINTS.items():
            means = material_points.compute_cell_means(standing, quantity)
            cellwise[name] = on_first(self.comm, self._cell_numbers, means)
        return cellwise


class XDMFWriter:
    """Write the frames of a run.

    A frame is written into a file of its own, at the path "/". Each time ``per_file`` frames have
    one they are collected in one file, each in a group of its own. ``_places`` says which file and
    group a step is in, and the index lists the steps of ``_times``: both are those of rank 0.
    """

    def __init__(
        self, values: FrameValues, folder: Path, kept: Mapping[int, float], per_file: int
    ) -> None:
        """Write the mesh, and the index of the frames that stay. Collective.

        Args:
            values: what frames hold.
            folder: that of the run.
            kept: step -> time [s] of frames with which the run goes on.
            per_file: how many frames are collected in a file.
        """
        self._values = values
        self._folder = folder
        self._per_file = per_file
        self._own_names: dict[int, list[str]] = {}  # of the frame of each step
        on_root(values.comm, partial(self._start, values.grid.points, values.grid.cells, kept))

    def _start(self, points: Array, cells: Indices, kept: Mapping[int, float]) -> None:
        """Write the mesh and the index of the frames that are kept, on rank 0."""
        folder = make_inner_folder(self._folder, FIELDS)

        def fill(file: Any) -> None:
            file["points"] = points
            file["cells"] = cells

        hdf5_atomically(folder / "mesh.h5", fill)
        stored = list_frames(self._folder)
        self._times = {k: t for k, t in sorted(kept.items()) if k in stored}
        self._places = {k: stored[k] for k in self._times}
        if self._times:
            self._write_index()
        # files with frames that are not kept are written anew with the others of theirs
        mixed = {path for k, (path, group) in stored.items() if group != "/" and k not in kept}
        for path in mixed:
            self._collect(path, [k for k, place in self._places.items() if place[0] == path])
        self._remove_others()

    def _collect(self, target: Path, steps: Sequence[int]) -> None:
        """Put the frames of these steps into one file, which may replace one of theirs."""

        def fill(file: Any) -> None:
            for k in steps:
                path, group = self._places[k]
                with open_hdf5(path) as source:
                    source[group].copy_to(file, f"{k:06d}")

        hdf5_atomically(target, fill)
        self._places |= {k: (target, f"/{k:06d}") for k in steps}

    def _remove_others(self) -> None:
        """Remove files of frames that hold none of the index; files of others stay."""
        known = {path for path, _ in self._places.values()}
        folder = inner_folder(self._folder, FIELDS)
        for name in os.listdir(folder):
            if folder / name not in known and (FRAME.fullmatch(name) or FRAMES.fullmatch(name)):
                remove(folder / name)

    def write(self, state: State, acceleration: Array, report: Report | None = None) -> None:
        """Write a frame. Collective.

        Args:
            state: at the end of the step.
            acceleration: (n,) of the step, in the rotated basis [m/s²].
            report: that of the step, which tells what slips; None for the initial state.
        """
        nodal, cellwise = self._values.gather(state, acceleration, report)
        on_root(self._values.comm, partial(self._write, state, nodal | cellwise))

    def _write(self, state: State, arrays: Mapping[str, Array]) -> None:
        """Write a frame and the index that names it, on rank 0.

        Args:
            state: that of the frame.
            arrays: values at all nodes or cells by name.
        """

        def fill(file: Any) -> None:
            for name, values in arrays.items():
                file[name] = values

        path = inner_folder(self._folder, FIELDS) / f"frame_{state.k:06d}.h5"
        hdf5_atomically(path, fill)
        self._times[state.k] = state.t
        self._places[state.k] = (path, "/")
        own = self._values.own
        self._own_names[state.k] = [] if own is None else own.names
        single = [k for k, (_, group) in self._places.items() if group == "/"]
        full = len(single) >= self._per_file > 1
        if full:
            self._collect(path.with_name(f"frames_{single[0]:06d}.h5"), single)
        self._write_index()
        if full:
            self._remove_others()

    def _write_index(self) -> None:
        """Write fields.xdmf with all complete frames."""
        frames = "".join(self._describe_frame(k, t) for k, t in self._times.items())
        text = (
            '<?xml version="1.0"?>\n<Xdmf Version="3.0"><Domain>\n<Grid Name="frames" '
            'GridType="Collection" '
            f'CollectionType="Temporal">\n{frames}</Grid>\n</Domain></Xdmf>\n'
        )
        write_atomically(self._folder / FIELDS_INDEX, text.encode())

    def _find_own_kinds(self, k: int) -> dict[str, Any]:
        """Return which of the user's Functions the frame of a step has, and what they are.

        A frame of an earlier run, which this one goes on with, may have none.
        """
        own = self._values.own
        if own is None:
            return {}
        if k not in self._own_names:
            path, group = self._places[k]
            with open_hdf5(path) as file:
                self._own_names[k] = [name for name in own.names if name in file[group]]
        # what the user's function of the state returns is known from its first frame on
        kinds = own.kinds
        return {name: kinds[name] for name in self._own_names[k] if name in kinds}

    def _describe_frame(self, k: int, t: float) -> str:
        """Return XDMF's Grid of the frame of step k at time t [s]."""
        nodes = len(self._values.grid.points)
        cells, corners = self._values.grid.cells.shape
        path, group = self._places[k]
        mesh = f"{FIELDS}/mesh.h5"
        frame = f"{FIELDS}/{path.name}:{group.rstrip('/')}"

        def describe(name: str, center: str, *shape: int, **number: Any) -> str:
            # a row of nine components is a tensor, one of three a vector
            kind = {1: "Scalar", 2: "Vector"}.get(len(shape), "Tensor")
            if shape[1:] == (9,):
                kind = "Tensor"
            item = _describe_data(shape, f"{frame}/{name}", **number)
            return (
                f'<Attribute Name="{name}" AttributeType="{kind}" '
                f'Center="{center}">{item}</Attribute>\n'
            )

        attributes = [describe(name, "Node", nodes, 3) for name in self._values.names]
        attributes.append(describe("contact_pressure", "Node", nodes))
        attributes.append(describe("contact_status", "Node", nodes, number="Int", size=4))
        attributes += [describe(name, "Cell", cells) for name in self._values.cell_names]
        for name, own_kind in self._find_own_kinds(k).items():
            shape = (cells if own_kind.in_cells else nodes, *own_kind.components)
            attributes.append(describe(name, "Cell" if own_kind.in_cells else "Node", *shape))
        return (
            f'<Grid Name="step {k}" GridType="Uniform"><Time Value="{t!r}"/>\n'
            f'<Topology TopologyType="{self._values.grid.kind}" NumberOfElements="{cells}" '
            f'NodesPerElement="{corners}">'
            f"{_describe_data((cells, corners), f'{mesh}:/cells', 'Int')}</Topology>\n"
            '<Geometry GeometryType="XYZ">'
            f"{_describe_data((nodes, 3), f'{mesh}:/points')}</Geometry>\n"
            f"{''.join(attributes)}</Grid>\n"
        )


def nodal_contact(problem: ContactProblem, state: State, status: Array) -> tuple[Array, Array]:
    """Return contact pressure [Pa] and status at the owned nodes, (k, 1) each. Collective.

    A node with several conditions has the pressure of the one that is pressed most, and the highest
    status; nodes without one have zeros.

    Args:
        problem: the problem.
        state: a state of it.
        status: (conditions,) a number for each condition.
    """
    space = cast(NodalSpace, problem.system.space)
    blocks = blocks_of_conditions(problem)
    surface = problem.surface
    pressure, highest = np.zeros((2, len(space.nodes), 1))
    # written in the order of their size, so that of several the largest stays
    pressures = state.r_n / surface.weights
    order = np.argsort(np.abs(pressures), kind="stable")
    pressure[blocks[order], 0] = pressures[order]
    np.maximum.at(highest[:, 0], blocks, status)
    return between(problem, pressure), between(problem, highest, np.min)


def compute_rubbing(problem: ContactProblem, state: State) -> tuple[Array, Array]:
    """Return tangential traction [Pa] and slip [m] along the axes at the owned nodes, (k, d) each.

    The traction is that of the body on its support; both are zero off the contact surface.
    """
    surface = problem.surface
    slip = surface.slip(state.u, state.t)
    r_t = np.zeros_like(slip) if state.r_t is None else state.r_t
    traction = _turn_to_axes(problem, r_t / surface.weights[:, None])
    return traction, _turn_to_axes(problem, slip)


def _turn_to_axes(problem: ContactProblem, tangential: Array) -> Array:
    """Return vectors at the owned nodes (k, d) of components in nodal tangents (m, d - 1)."""
    space = cast(NodalSpace, problem.system.space)
    surface = problem.surface
    if surface.traces is not None:
        # vectors of conditions that share a node add up there
        vectors = np.einsum("kdc,kc->kd", find_tangents(surface), tangential)
        nodal = np.zeros((len(space.nodes), space.dimension))
        np.add.at(nodal, blocks_of_conditions(problem), vectors)
        return nodal
    in_frames = surface.reaction_load(np.zeros(surface.count), len(space.ids), tangential)
    # forces and motions turn alike here, as tangents are at right angles to all that is oblique
    along = surface.along_axes(in_frames)
    # of the free unknowns alone: what is prescribed or follows others has no part in it
    return NodalSpace.expand(space, along, 0.0)


def compute_gap(problem: ContactProblem, state: State) -> Array:
    """Return the gap [m] at the owned nodes, (k, 1): of several faces the smallest. Collective.

    It is zero off the contact surface, and at nodes without a condition. It grows by what
    compliant conditions are pressed together.
    """
    space = cast(NodalSpace, problem.system.space)
    surface = problem.surface
    gaps = surface.gap(state.t) - surface.normal_values(state.u) + surface.compliance * state.r_n
    gap = np.full((len(space.nodes), 1), np.inf)
    np.minimum.at(gap[:, 0], blocks_of_conditions(problem), gaps)
    gap[~np.isfinite(gap)] = 0.0
    return between(problem, gap)


def blocks_of_conditions(problem: ContactProblem) -> Indices:
    """Return the owned nodes (m,), by their places, of this rank's conditions."""
    space = cast(NodalSpace, problem.system.space)
    surface = problem.surface
    if surface.traces is not None:
        return np.asarray(space.blocks_of(cast(Indices, surface.nodes)))
    return np.asarray(space.blocks_of(space.ids[surface.owned] // space.dimension))


def between(problem: ContactProblem, nodal: Array, mean: Any = np.mean) -> Array:
    """Return nodal values with those of the mid-points of contact facets added. Collective.

    This is done where only vertices have conditions (P2 tetrahedra): linear from end to end, zero
    at ends without a condition, so that ∫ p = sum r_n. Elsewhere the values are returned.

    Args:
        problem: the problem.
        nodal: (k, c) owned nodal values.
        mean: how the ends of an edge make the value of its mid-point.
    """
    space = cast(NodalSpace, problem.system.space)
    if space.hierarchy is None:
        return nodal
    # the mid-points of contact facets are the nodes of their bubbles, of any rank
    own = [np.zeros(0, dtype=np.int64)]
    for conditions in getattr(problem.surface, "parts", ()):
        own += [bubbles.nodes.numbers for bubbles in conditions.bubbles]
    middles = np.concatenate(from_each(space.comm, np.concatenate(own)))
    return space.hierarchy.between(nodal, np.isin(space.nodes, middles), mean)


def _describe_data(shape: tuple[int, ...], where: str, number: str = "Float", size: int = 8) -> str:
    """Return XDMF's DataItem of an array in an HDF5 file.

    Args:
        shape: that of the array.
        where: "file:path" of it.
        number: "Float" or "Int".
        size: bytes of a number.
    """
    dimensions = " ".join(map(str, shape))
    kind = f'NumberType="{number}" Precision="{size}"'
    return f'<DataItem Dimensions="{dimensions}" {kind} Format="HDF">{where}</DataItem>'


def _pad_axes(nodal: Array) -> Array:
    """Return rows (k, 3) of rows (k, d), with zeros for the missing axes."""
    return np.pad(nodal, ((0, 0), (0, 3 - nodal.shape[1])))


def _cells_of_body(owner: str, problem: ContactProblem) -> Cells:
    """Return the cells of a mesh by the numbers of their nodes, in VTK's order. Collective.

    Args:
        owner: the beginning of messages.
        problem: that of the run.
    """
    from .. import compat
    from ..body.space import space_of, warn_of_other_matrices

    space = space_of(owner, problem.system)
    if space.forms.tells_stress:
        warn_of_other_matrices(f"{owner}, von_mises", problem.system, "K")
    elif space.comm.rank == 0 and not remembers(problem.system.internal):
        log.info(
            "%s: forms=… have no stress, so frames have no von_mises: give fem.Forms(…, stress=)",
            owner,
        )
    mesh = space.mesh
    stress = VonMises(space.forms) if space.forms.tells_stress else None
    dim = mesh.topology.dim
    owned = mesh.topology.index_map(dim).size_local
    rows = space.node_of_block[compat.cell_blocks(space.V)[:owned]]
    order = compat.vtk_order(mesh, rows.shape[1])
    return Cells(_CELLS[dim, rows.shape[1]], rows[:, order], compat.cell_numbers(mesh), stress)
