"""Write fields for ParaView.

They are ``fields.xdmf`` and HDF5 files of one frame or several, in the order of the input mesh.

Every file is replaced as a whole and the index names only frames that are complete, so that
ParaView can open it at any moment, also while the run goes on or after it was killed. Nothing in
the files depends on the number of ranks.

What a frame holds: docs/reference/files.md. In the first one a is zero, and with friction all
closed nodes stick.
"""

import logging
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import numpy as np

from ...core.algebra import Array, Indices, Mask, from_each, on_first
from ...core.arguments import check_fields
from ...core.checks import column_name
from ...core.errors import InputError
from ...core.files import (
    FIELDS,
    FIELDS_INDEX,
    FRAME,
    FRAMES,
    frames_of,
    hdf5_atomically,
    on_root,
    open_hdf5,
    write_atomically,
)
from ...core.own_files import inner_folder, make_inner_folder, remove
from ...core.problem import ContactProblem
from ...core.quantities import Positive
from ...core.step import Report, State
from ..matrices.own_matrices import MatrixSpace
from ..mesh.nodal_space import NodalSpace

if TYPE_CHECKING:
    from .own_functions import OwnFunctions

log = logging.getLogger(__name__)


class VonMises:
    """Compute the mean von Mises stress of owned cells [Pa].

    It is ∫ sqrt(3/2 s:s) / ∫ 1 over a cell, s = dev(sigma).

    Plane strain has sigma_zz = lambda tr(eps), plane stress none, a bar uniaxial stress. Without
    viscous stresses.
    """

    def __init__(self, forms: Any) -> None:
        """Take ``forms``, the ElasticForms of a system.

        Their constants carry the thickness as a factor.
        """
        import ufl  # late, as compat: frames of own matrices need no DOLFINx

        from .. import compat
        from .outline import cell_volumes

        space = forms.space
        self._forms = forms
        self._assembled = compat.assemble_vector
        self._u = compat.function(space.V)
        sigma, across = (one / forms.section.thickness for one in forms.stresses(self._u))
        mean = (ufl.tr(sigma) + across) / 3
        deviator = sigma - mean * ufl.Identity(space.dimension)
        squares = ufl.inner(deviator, deviator) + (3 - space.dimension) * (across - mean) ** 2
        cell = ufl.TestFunction(compat.cell_space(space.mesh))
        self._form = compat.compile_form(
            ufl.sqrt(1.5 * squares) * cell * ufl.dx(metadata={"quadrature_degree": 2})
        )
        self._volume = cell_volumes(space.mesh)

    def __call__(self, nodal: Array, t: float = 0.0) -> Array:
        """Return the stresses of nodal displacements (owned nodes, d) at a time; collective."""
        self._u.x.array[: nodal.size] = nodal.ravel()
        self._u.x.scatter_forward()
        self._forms.follow(self._u, t)
        return np.asarray(self._assembled(self._form).array_r / self._volume)


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
TAKEN = (*_VECTORS, *_RUBBING, "contact_pressure", "contact_status", "von_mises")


@dataclass(frozen=True)
class XDMF:
    """Write a frame every so many steps, and one of the initial state.

    ``frames_per_file``: each time so many frames have files of their own they are put into one:
    some systems want few.

    ``functions``: name -> a DOLFINx Function of the user's on the mesh of the body, which every
    frame has with the values of its moment; or a function of the state (``State``) that returns
    one. It is of a continuous Lagrange space, interpolated at the nodes, or constant in each cell;
    a number, a vector or a tensor.
    """

    every: Annotated[int, Positive] = 10
    frames_per_file: Annotated[int, Positive] = 1
    functions: Mapping[str, Any] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        check_fields(self)
        for name in self.functions:
            column_name("name of a Function", name)
            if name in TAKEN:
                raise InputError(
                    f"XDMF: functions has the name '{name}', which frames have already; give "
                    "another"
                )

    def open(
        self, problem: ContactProblem, folder: Path, kept: Mapping[int, float]
    ) -> "FrameWriter":
        """Write the mesh; go on after the frames of ``kept`` (step -> time) that are in the folder.

        Collective.
        """
        space = problem.system.space
        own = None
        if isinstance(space, MatrixSpace):
            if self.functions:
                raise InputError(
                    "XDMF: functions are on a mesh, and the system was not made of one; leave them "
                    "out"
                )
            cells = Cells("Polyvertex", space.nodes[:, None], space.nodes)
        else:
            from .own_functions import OwnFunctions  # late: the other frames need no DOLFINx

            cells = _cells_of_body(problem)
            if self.functions:
                own = OwnFunctions(problem, self.functions)
        return FrameWriter(problem, folder, kept, self.frames_per_file, cells, own)


@dataclass(frozen=True)
class Cells:
    """Hold the cells of a frame.

    This is XDMF's name of them, nodes of the owned ones, their numbers, and their stress.
    """

    kind: str
    nodes: Indices
    numbers: Indices
    von_mises: VonMises | None = None


class FrameWriter:
    """Write the frames of a run, so many in an HDF5 file."""

    def __init__(
        self,
        problem: ContactProblem,
        folder: Path,
        kept: Mapping[int, float],
        per_file: int,
        shown: Cells,
        own: "OwnFunctions | None" = None,
    ) -> None:
        """Write mesh and index. Collective.

        Args:
            problem: whose states they are.
            folder: that of the run.
            kept: step -> time [s] of frames that are there and stay.
            per_file: how many frames a file has in the end.
            shown: the cells.
            own: the user's Functions, None without.
        """
        space: Any = problem.system.space
        self._problem = problem
        self._space = space
        self._folder = folder
        self._per_file = per_file
        self._names = _VECTORS + (_RUBBING if problem.frictional else ())
        self._type = shown.kind
        self._cell_numbers = shown.numbers
        self._von_mises = shown.von_mises
        self._own = own
        self._has: dict[int, list[str]] = {}
        points = on_first(space.comm, space.nodes, _three(space.points))
        cells = on_first(space.comm, self._cell_numbers, shown.nodes)
        self._shape = (len(points), *cells.shape)
        on_root(space.comm, partial(self._start, points, cells, kept))

    def _start(self, points: Array, cells: Array, kept: Mapping[int, float]) -> None:
        """Write the mesh and the index of the frames that are kept, on rank 0."""
        folder = make_inner_folder(self._folder, FIELDS)

        def fill(file: Any) -> None:
            file["points"] = points
            file["cells"] = cells

        hdf5_atomically(folder / "mesh.h5", fill)
        found = frames_of(self._folder)
        self._times = {k: t for k, t in sorted(kept.items()) if k in found}
        self._places = {k: found[k] for k in self._times}
        if self._times:
            self._write_index()
        for path in {path for k, (path, group) in found.items() if group != "/" and k not in kept}:
            self._collect(path, [k for k, place in self._places.items() if place[0] == path])
        self._remove_others()

    def _collect(self, target: Path, steps: Sequence[int]) -> None:
        """Put these frames into one file, in the place of the one that has this name."""

        def fill(file: Any) -> None:
            for k in steps:
                path, group = self._places[k]
                with open_hdf5(path) as one:
                    one[group].copy_to(file, f"{k:06d}")

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
        """Write a frame of state, acceleration of its step (both in the rotated basis) and report.

        Collective.
        """
        problem = self._problem
        space = self._space
        moving = [
            space.expand(problem.cartesian(x), state.t, derivative)
            for derivative, x in enumerate((state.u, state.v, acceleration))
        ]
        von_mises = self._von_mises
        stress = (
            None
            if von_mises is None
            else on_first(space.comm, self._cell_numbers, von_mises(moving[0], state.t))
        )
        slipping = np.zeros(problem.surface.count, dtype=bool)
        if problem.frictional and report is not None:
            slipping = slipped(report)
        pressure, status = nodal_contact(
            problem, state, np.where(state.active, np.where(slipping, 3, 2), 1)
        )
        if problem.frictional:
            moving += [between(problem, nodal) for nodal in nodal_rubbing(problem, state)]
        rows = np.hstack([*(_three(nodal) for nodal in moving), pressure, status])
        own = {} if self._own is None else self._own.values(state)
        on_root(
            space.comm,
            partial(self._write, state, on_first(space.comm, space.nodes, rows), stress, own),
        )

    def _write(
        self, state: State, nodal: Array, stress: Array | None, own: Mapping[str, Array]
    ) -> None:
        """Write a frame and the index, on rank 0.

        Args:
            state: whose frame it is.
            nodal: (nodes, columns) all that nodes have.
            stress: (cells,) von Mises stresses [Pa], None without.
            own: the user's values by name, (nodes or cells, components).
        """

        def fill(file: Any) -> None:
            for i, name in enumerate(self._names):
                file[name] = nodal[:, 3 * i : 3 * i + 3]
            file["contact_pressure"] = nodal[:, -2]
            file["contact_status"] = nodal[:, -1].astype(np.int32)
            if stress is not None:
                file["von_mises"] = stress
            for name, values in own.items():
                file[name] = values

        path = inner_folder(self._folder, FIELDS) / f"frame_{state.k:06d}.h5"
        hdf5_atomically(path, fill)
        self._times[state.k] = state.t
        self._places[state.k] = (path, "/")
        self._has[state.k] = list(own)
        single = [k for k, (_, group) in self._places.items() if group == "/"]
        full = len(single) >= self._per_file > 1
        if full:
            self._collect(path.with_name(f"frames_{single[0]:06d}.h5"), single)
        self._write_index()
        if full:
            self._remove_others()

    def _write_index(self) -> None:
        """Write fields.xdmf with all complete frames."""
        frames = "".join(self._grid(k, t) for k, t in self._times.items())
        text = (
            '<?xml version="1.0"?>\n<Xdmf Version="3.0"><Domain>\n<Grid Name="frames" '
            'GridType="Collection" '
            f'CollectionType="Temporal">\n{frames}</Grid>\n</Domain></Xdmf>\n'
        )
        write_atomically(self._folder / FIELDS_INDEX, text.encode())

    def _own_kinds(self, k: int) -> dict[str, Any]:
        """Return which of the user's Functions the frame of a step has, and what they are.

        One of an earlier run, which this one goes on with, may have none.
        """
        if self._own is None:
            return {}
        if k not in self._has:
            path, group = self._places[k]
            with open_hdf5(path) as file:
                self._has[k] = [name for name in self._own.names if name in file[group]]
        # what the user's function of the state returns is known from its first frame on
        kinds = self._own.kinds
        return {name: kinds[name] for name in self._has[k] if name in kinds}

    def _grid(self, k: int, t: float) -> str:
        nodes, cells, corners = self._shape
        path, group = self._places[k]
        mesh = f"{FIELDS}/mesh.h5"
        frame = f"{FIELDS}/{path.name}:{group.rstrip('/')}"

        def attribute(
            name: str, center: str, *shape: int, number: str = "Float", size: int = 8
        ) -> str:
            kind = {1: "Scalar", 2: "Vector"}.get(len(shape), "Tensor")
            kind = "Tensor" if shape[1:] == (9,) else kind
            item = _item(shape, f"{frame}/{name}", number, size)
            return (
                f'<Attribute Name="{name}" AttributeType="{kind}" '
                f'Center="{center}">{item}</Attribute>\n'
            )

        attributes = [attribute(name, "Node", nodes, 3) for name in self._names]
        attributes.append(attribute("contact_pressure", "Node", nodes))
        attributes.append(attribute("contact_status", "Node", nodes, number="Int", size=4))
        if self._von_mises is not None:
            attributes.append(attribute("von_mises", "Cell", cells))
        for name, about in self._own_kinds(k).items():
            shape = (cells if about.in_cells else nodes, *about.components)
            attributes.append(attribute(name, "Cell" if about.in_cells else "Node", *shape))
        return (
            f'<Grid Name="step {k}" GridType="Uniform"><Time Value="{t!r}"/>\n'
            f'<Topology TopologyType="{self._type}" NumberOfElements="{cells}" '
            f'NodesPerElement="{corners}">'
            f"{_item((cells, corners), f'{mesh}:/cells', 'Int')}</Topology>\n"
            f'<Geometry GeometryType="XYZ">{_item((nodes, 3), f"{mesh}:/points")}</Geometry>\n'
            f"{''.join(attributes)}</Grid>\n"
        )


def nodal_contact(problem: ContactProblem, state: State, status: Array) -> tuple[Array, Array]:
    """Return (contact pressure, status), (k, 1) at the owned nodes. Collective.

    They are made of those of the conditions: of several faces of a node the pressure of the one
    that is pressed most, and the highest status.

    Args:
        problem: the problem.
        state: a state of it.
        status: (conditions,) a number for each condition.
    """
    space = cast(NodalSpace, problem.system.space)
    blocks = blocks_of_conditions(problem)
    surface = problem.surface
    pressure, highest = np.zeros((2, len(space.nodes), 1))
    each = state.r_n / surface.weights
    order = np.argsort(np.abs(each), kind="stable")
    pressure[blocks[order], 0] = each[order]
    np.maximum.at(highest[:, 0], blocks, status)
    return between(problem, pressure), between(problem, highest, np.min)


def nodal_rubbing(problem: ContactProblem, state: State) -> tuple[Array, Array]:
    """Return tangential traction [Pa] and slip [m] along the axes at the owned nodes, (k, d) each.

    The traction is that of the body on its support; both are zero off the contact surface.
    """
    surface = problem.surface
    slip = surface.slip(state.u, state.t)
    r_t = np.zeros_like(slip) if state.r_t is None else state.r_t
    traction = _nodal_tangential(problem, r_t / surface.weights[:, None])
    return traction, _nodal_tangential(problem, slip)


def _nodal_tangential(problem: ContactProblem, tangential: Array) -> Array:
    """Return components (m, d - 1) in nodal tangents as vectors (k, d) at the owned nodes."""
    space = cast(NodalSpace, problem.system.space)
    surface = problem.surface
    turned = surface.reaction_load(np.zeros(surface.count), len(space.ids), tangential)
    along = surface.along_axes(turned)  # tangents are at right angles to all that is oblique
    return NodalSpace.expand(space, along, 0.0)  # not what is prescribed or follows


def nodal_gap(problem: ContactProblem, state: State) -> Array:
    """Return the gap [m] at the owned nodes, (k, 1): of several faces the smallest. Collective.

    It is zero off the contact surface, and at nodes without a condition.
    """
    space = cast(NodalSpace, problem.system.space)
    surface = problem.surface
    each = surface.gap(state.t) - surface.normal_values(state.u) + surface.compliance * state.r_n
    gap = np.full((len(space.nodes), 1), np.inf)
    np.minimum.at(gap[:, 0], blocks_of_conditions(problem), each)
    gap[~np.isfinite(gap)] = 0.0
    return between(problem, gap)


def blocks_of_conditions(problem: ContactProblem) -> Indices:
    """Return the owned nodes (m,), by their places, of this rank's conditions."""
    space = cast(NodalSpace, problem.system.space)
    return np.asarray(space.blocks_of(space.ids[problem.surface.owned] // space.dimension))


def between(problem: ContactProblem, nodal: Array, mean: Any = np.mean) -> Array:
    """Return nodal values (k, c) with those of the mid-points of contact facets. Collective.

    These are added where conditions are those of vertices only: linear from end to end, zero at
    ends without a condition, so that ∫ p = sum r_n.

    Args:
        problem: the problem.
        nodal: (k, c) owned nodal values.
        mean: how the ends of an edge make the value of its mid-point.
    """
    space = cast(NodalSpace, problem.system.space)
    if space.hierarchy is None:
        return nodal
    own = [
        part.nodes.numbers for one in getattr(problem.surface, "parts", ()) for part in one.bubbles
    ]
    middles = np.concatenate(
        from_each(space.comm, np.concatenate([np.zeros(0, dtype=np.int64), *own]))
    )
    return space.hierarchy.between(nodal, np.isin(space.nodes, middles), mean)


def slipped(report: Report) -> Mask:
    """Return the points (m,) that moved along their support in a step with friction."""
    step = report.step
    result = report.result
    return np.asarray(np.any(step.surface.tangential_values(result.x) != step.slip0, axis=1))


def _item(shape: tuple[int, ...], where: str, number: str = "Float", size: int = 8) -> str:
    """Return a DataItem in an HDF5 file."""
    dimensions = " ".join(map(str, shape))
    kind = f'NumberType="{number}" Precision="{size}"'
    return f'<DataItem Dimensions="{dimensions}" {kind} Format="HDF">{where}</DataItem>'


def _three(nodal: Array) -> Array:
    """Return rows (k, d) with zeros for the missing axes, (k, 3)."""
    return np.pad(nodal, ((0, 0), (0, 3 - nodal.shape[1])))


def _cells_of_body(problem: ContactProblem) -> Cells:
    """Return the cells of a mesh by the numbers of their nodes. Collective.

    The order is that of VTK.
    """
    from .. import compat
    from ..body.space import known_matrices, space_of

    space = space_of("XDMF", problem.system)
    if space.forms.tells_stress:
        known_matrices("XDMF, von_mises", problem.system, "K")
    elif space.comm.rank == 0:
        log.info(
            "XDMF: forms=… have no stress, so frames have no von_mises: give fem.Forms(…, stress=)"
        )
    mesh = space.mesh
    stress = VonMises(space.forms) if space.forms.tells_stress else None
    dim = mesh.topology.dim
    rows = space.node_of_block[
        compat.cell_blocks(space.V)[: mesh.topology.index_map(dim).size_local]
    ]
    order = compat.vtk_order(mesh, rows.shape[1])
    return Cells(_CELLS[dim, rows.shape[1]], rows[:, order], compat.cell_numbers(mesh), stress)
