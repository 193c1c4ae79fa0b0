"""Hand out states and stored frames as DOLFINx Functions, along the axes, with values of ghosts.

u and v are on the space of the system, ``system.space.V``, with the components that are prescribed
or tied. The stress sigma(u), without viscous parts, is the L2 projection onto discontinuous fields:
constant in a cell of triangles and tetrahedra, where that of P1 is so, (bi)linear in others; of P2
and Q2 one degree higher. The contact pressure r_n / weight is nodal, zero off the contact surface;
of several faces of a node it is that of the one which is pressed most. Nodes of the contact
boundary without a condition (held ones, and those that both sides share) and those that are hardly
covered take the mean of their neighbours on its facets: there ∫ p is more than the sum of
reactions.
"""

import xml.etree.ElementTree as ET
from pathlib import Path
from typing import Any

import numpy as np
import ufl
from petsc4py import PETSc

from ...core.algebra import Array, Indices
from ...core.checks import flag, instance, number, optional, quote, refuse
from ...core.errors import InputError, is_of_machine
from ...core.files import FIELDS, FIELDS_INDEX, list_frames, on_root, open_hdf5
from ...core.internal import remembers
from ...core.own_files import inner_folder, is_own, read_bytes
from ...core.problem import ContactProblem
from ...core.state_checks import check_problem_given, check_sizes
from ...core.step import State
from ...core.vtkhdf import FIELDS_VTKHDF, open_series
from .. import compat
from ..body.space import FemSpace, space_of, warn_of_other_matrices
from . import material_points
from .fields import (
    between,
    blocks_of_conditions,
    compute_gap,
    compute_rubbing,
    nodal_contact,
)

NAMES = (
    "u",
    "v",
    "stress",
    "contact_pressure",
    "contact_traction_t",
    "slip",
    "contact_gap",
    *material_points.SCALARS,
)
ACCURACY = 1e-13  # of a projection, in its residual
SAME = 1e-9  # of the size of the mesh, and of the longest time


def as_function(
    problem: ContactProblem, state: State, name: str, *, continuous: bool = False
) -> Any:
    """Return a state as a DOLFINx Function. Collective.

    Quantities of the contact are zero off the contact surface.

    Where a node of the contact boundary has no pressure or traction of its own, as one that is
    held, the function has the mean of those of its neighbours, so that the error of a right
    pressure falls with the size of the facets there too. Its gap and slip are zero. Every call
    makes a Function of its own.

    Args:
        problem: the problem of the state.
        state: of simulate, march, static_equilibrium or quasi_static of this problem.
        name: "u" [m], "v" [m/s], "stress" [Pa] (d, d), "contact_pressure" [Pa], "contact_gap" [m],
            or a vector along the axes: "contact_traction_t" [Pa], the tangential traction of the
            body on its support, and "slip" [m], its tangential displacement there. Of a body that
            yields also "equivalent_stress" [Pa], "plastic_strain" and "mobilised_strength", as of
            ``at_points``: these and its stress are means of the points, constant in each cell or,
            if continuous, P1 or Q1.
        continuous: whether the stress is projected onto P1, Q1, P2 or Q2, ∫ sigma_h : tau = ∫
            sigma(u) : tau; else onto discontinuous fields.

    Raises:
        InputError: a state of another problem, a system without a mesh, no such quantity.
    """
    space = _check_request("as_function", problem, name, continuous)
    check_sizes("as_function", problem, state)
    if name in material_points.SCALARS:
        material_points.refuse_elastic("as_function", problem, name)
    if name in material_points.NAMES and remembers(problem.system.internal):
        return material_points.make_function(problem, state, name, continuous)
    if name in ("u", "v", "stress"):
        if name == "v":
            nodal = space.expand(problem.cartesian(state.v), state.t, 1)
        else:
            nodal = space.expand(problem.cartesian(state.u), state.t, 0)
        return _make_function(problem, name, nodal, state.t, continuous)
    return _make_function(problem, name, _compute_contact(problem, state, name), state.t)


def _compute_contact(problem: ContactProblem, state: State, name: str) -> Array:
    """Return a quantity of the contact at the owned nodes, (k,) or (k, d). Collective.

    Args:
        problem: the problem.
        state: a state of it.
        name: that of the quantity.
    """
    if name == "contact_pressure":
        pressure, _ = nodal_contact(problem, state, np.ones(len(state.r_n)))
        return add_borrowed(problem, pressure)[:, 0]
    if name == "contact_gap":
        return compute_gap(problem, state)[:, 0]
    traction, slip = compute_rubbing(problem, state)
    if name == "slip":
        return between(problem, slip)
    return add_borrowed(problem, between(problem, traction))


def add_borrowed(problem: ContactProblem, pressure: Array) -> Array:
    """Return nodal contact pressures or tractions (k, c) with those of borrowers. Collective.

    The nodes of contact boundaries that have none of their own take the mean of those of their
    neighbours (``contact.borrowing``).
    """
    space = space_of("contact_pressure", problem.system)
    surface = problem.surface
    blocks = blocks_of_conditions(problem)
    # nodes with a pressure of their own: those of conditions that are not hardly covered
    having = np.zeros(len(space.nodes), dtype=bool)
    having[blocks if surface.uncovered is None else blocks[~surface.uncovered]] = True

    # what all others borrow, and at mid-points what is between their ends
    borrowed = np.zeros_like(pressure)
    for part in getattr(surface, "parts", ()):
        if part.borrowed is not None:
            rows = space.blocks_of(part.borrowed.numbers)
            values = part.borrowed.values(space, pressure)
            borrowed[rows[~having[rows]]] = values[~having[rows]]
    own = pressure.copy()
    own[blocks[~having[blocks]]] = 0.0
    return own + between(problem, borrowed)


def read_function(
    problem: ContactProblem,
    folder: str | Path,
    name: str,
    *,
    t: float | None = None,
    frame: int | None = None,
    continuous: bool = False,
) -> Any:
    """Return a frame in the folder of a run, as ``as_function`` returns a state. Collective.

    The run, with ``fields=fem.XDMF(…)`` or ``fem.VTKHDF(…)``, may have had any number of ranks.

    Args:
        problem: that of the run.
        folder: that of the run.
        name: "u", "v", "stress" or "contact_pressure", as of ``as_function``.
        t: time of the frame [s]; give it or ``frame``.
        frame: its number in the order of time, 0 for the first and -1 for the last.
        continuous: whether the stress is projected onto continuous fields, as of ``as_function``.

    Raises:
        InputError: a time without a frame, fields of another mesh, files that are damaged.
    """
    space = _check_request("read_function", problem, name, continuous)
    optional(number, "read_function", "t", t, unit="s")
    optional(
        instance,
        "read_function",
        "frame",
        frame,
        int,
        "give its number, 0 for the first and -1 for the last",
    )
    if name in material_points.SCALARS:
        raise InputError(
            f"read_function: frames have {quote(name)} for each cell, which is no Function; give "
            "as_function a state"
        )
    if name == "contact_gap":
        raise InputError(
            "read_function: frames have no gap; give as_function a state, or record Contact()"
        )
    kind = "u" if name == "stress" else name
    comm = space.comm
    d = space.dimension
    points, values, t = comm.bcast(
        on_root(comm, lambda: _read_stored(Path(folder), kind, t, frame))
    )

    # the nodes of a frame have the numbers of the mesh: they must be at the same places
    fits = len(points) > np.max(space.nodes, initial=-1)
    if fits:
        apart = np.max(np.abs(points[space.nodes, :d] - space.points), initial=0.0)
        fits = apart <= SAME * space.size
    defect = f"the fields in '{folder}' are of another mesh: give the problem of that run"
    refuse(["" if fits else defect], comm)
    if name == "contact_pressure":
        pressure = add_borrowed(problem, values[space.nodes, None])
        return _make_function(problem, name, pressure[:, 0], t)
    if name == "contact_traction_t":
        return _make_function(problem, name, add_borrowed(problem, values[space.nodes, :d]), t)
    return _make_function(problem, name, values[space.nodes, :d], t, continuous)


def _check_request(owner: str, problem: Any, name: Any, continuous: Any) -> FemSpace:
    """Return the space of the problem.

    Args:
        owner: who asks.
        problem: what was given.
        name: the quantity.
        continuous: whether the stress is projected.

    Raises:
        InputError: there is none, or no such quantity.
    """
    check_problem_given(owner, problem)
    flag(owner, "continuous", continuous)
    if not isinstance(name, str) or name not in NAMES:
        raise InputError(
            f"{owner}: {quote(name)} is not a quantity; give one of {', '.join(map(repr, NAMES))}"
        )
    return space_of(owner, problem.system)


def _make_function(
    problem: ContactProblem, name: str, nodal: Array, t: float, continuous: bool = False
) -> Any:
    """Return the Function of a quantity from values at the owned nodes at a time. Collective.

    Args:
        problem: the problem.
        name: the quantity.
        nodal: (k,) or (k, d) its values at the owned nodes; of the stress, displacements [m].
        t: time [s].
        continuous: whether the stress is projected onto continuous fields.
    """
    system = problem.system
    space = space_of(name, problem.system)
    V = space.V
    if nodal.ndim == 1:
        V = system.make_once("scalars", lambda: compat.lagrange(space.mesh, space.degree))
    function = compat.function(V)
    values = nodal[_match_blocks(V, space.V)].ravel()
    function.x.array[: values.size] = values
    function.x.scatter_forward()
    if name == "stress":
        warn_of_other_matrices("stress", system, "K")
        project = system.make_once(f"stress {continuous}", lambda: Stress(space, continuous))
        function = project(function, t)
    function.name = name
    return function


def _match_blocks(space: Any, other: Any) -> Indices:
    """Return which blocks of another space the owned blocks of a space are, (owned,).

    Both have the same element on one mesh, so that a node has the same place in a cell; their
    blocks may be numbered differently.
    """
    owned = space.dofmap.index_map.size_local
    ghosts = space.dofmap.index_map.num_ghosts
    blocks = np.zeros(owned + ghosts, dtype=np.int64)
    blocks[compat.cell_blocks(space)] = compat.cell_blocks(other)
    return blocks[:owned]


class Stress:
    """Project sigma(u) onto a space of tensors, component by component.

        M sigma_c = b_c,   M_ij = ∫ phi_i phi_j,   b_ci = ∫ sigma_c(u) phi_i

    by conjugate gradients with Jacobi preconditioning.
    """

    def __init__(self, space: FemSpace, continuous: bool) -> None:
        """Assemble M. Collective.

        Args:
            space: the body's unknowns, with its forms.
            continuous: whether the tensors are continuous, of the degree of u; else discontinuous,
                one degree lower on simplices, where the gradient of u is such a field.
        """
        d = space.dimension
        degree = space.degree
        if compat.is_simplex(space.mesh) and not continuous:
            degree = space.degree - 1
        self._tensors = compat.lagrange(space.mesh, degree, (d, d), continuous=continuous)
        self._u = compat.function(space.V)
        scalars = compat.lagrange(space.mesh, degree, continuous=continuous)
        self._blocks = _match_blocks(scalars, self._tensors)
        dx = ufl.dx(metadata={"quadrature_degree": 2 * degree + 2})
        self._forms = space.forms
        sigma = space.forms.stress(self._u) / space.forms.section.thickness
        self._load = compat.compile_form(ufl.inner(sigma, ufl.TestFunction(self._tensors)) * dx)
        mass = ufl.inner(ufl.TrialFunction(scalars), ufl.TestFunction(scalars)) * dx
        matrix = compat.assemble_matrix(compat.compile_form(mass))
        self._x, self._b = matrix.createVecs()
        self._ksp = PETSc.KSP().create(matrix.comm)
        self._ksp.setOperators(matrix)
        self._ksp.setType("cg")
        self._ksp.getPC().setType("jacobi")
        self._ksp.setTolerances(rtol=ACCURACY, atol=0.0)

    def __call__(self, u: Any, t: float) -> Any:
        """Return the stress (d, d) [Pa] of displacements at a time [s]. Collective."""
        self._u.x.array[:] = u.x.array
        self._forms.follow(self._u, t)
        stress = compat.function(self._tensors)
        values = stress.x.array.reshape(-1, self._tensors.dofmap.index_map_bs)
        loads = compat.assemble_vector(self._load).array_r.reshape(-1, values.shape[1])
        for c in range(values.shape[1]):
            self._b.array[:] = loads[self._blocks, c]
            self._ksp.solve(self._b, self._x)
            values[self._blocks, c] = self._x.array_r
        stress.x.scatter_forward()
        return stress


def _read_stored(
    folder: Path, name: str, t: float | None, frame: int | None
) -> tuple[Array, Array, float]:
    """Return points of the mesh (nodes, 3) [m], a quantity of a frame there, and its time [s].

    Args:
        folder: that of the run.
        name: the quantity, as the files call it.
        t: time of the frame [s], or None.
        frame: its number, or None.

    Raises:
        InputError: there are no fields, or no such frame, or files are damaged.
    """
    if not is_own(folder / FIELDS_INDEX):
        if is_own(folder / FIELDS_VTKHDF):
            return _read_series(folder, name, t, frame)
        raise InputError(
            f"'{folder}' has no {FIELDS_INDEX}: run again with out and fields=fem.XDMF(every=10)"
        )
    try:
        # the index says at which times there are frames, and where each of them is: "file:path"
        index: Any = ET.fromstring(read_bytes(folder / FIELDS_INDEX))
        attributes = {attribute.get("Name") for attribute in index.iterfind(".//Attribute")}
        if attributes and name not in attributes:
            raise _missing(folder, name)
        places = []
        for grid in index.findall(".//Grid[@GridType='Uniform']"):
            time = float(grid.find("Time").get("Value"))
            places.append((time, grid.find(f"Attribute[@Name='{name}']/DataItem").text))
        places.sort()
        time, place = places[_choose_frame([time for time, _ in places], t, frame)]
        file, dataset = place.split(":")

        # only files that a run writes are opened, whatever the index names
        known = {str(own.relative_to(folder)): own for own, _ in list_frames(folder).values()}
        with (
            open_hdf5(inner_folder(folder, FIELDS) / "mesh.h5") as mesh,
            open_hdf5(known[file]) as fields,
        ):
            return mesh["points"][()], fields[dataset][()], time
    except InputError:
        raise
    except (
        ET.ParseError,
        OSError,
        KeyError,
        AttributeError,
        TypeError,
        ValueError,
        RuntimeError,
    ) as error:
        if is_of_machine(error):
            raise
        raise InputError(
            f"the fields in '{folder}' are incomplete or damaged ({error}): run again"
        ) from error


def _read_series(
    folder: Path, name: str, t: float | None, frame: int | None
) -> tuple[Array, Array, float]:
    """Return what ``_read_stored`` does, of a run with one file for all frames."""
    with open_series(folder / FIELDS_VTKHDF) as series:
        if name not in series.names:
            raise _missing(folder, name)
        times = [float(time) for time in series.times]
        place = _choose_frame(times, t, frame)
        return series.points, series.read(name, place), times[place]


def _missing(folder: Path, name: str) -> InputError:
    """Return the error about a quantity that the frames of a folder have not."""
    return InputError(
        f"the frames in '{folder}' have no '{name}', as those of a run without friction"
    )


def _choose_frame(times: list[float], t: float | None, frame: int | None) -> int:
    """Return the place among ``times`` of the frame that is asked for.

    Args:
        times: those of the frames, ascending [s].
        t: the time that is asked for, or None.
        frame: the number that is asked for, or None.

    Raises:
        InputError: there is none, or both or neither of t and frame are given.
    """
    listed = ", ".join(f"{time:.9g}" for time in times[:12])
    if len(times) > 12:
        listed += f", … {times[-1]:.9g}"
    stored = f"the {len(times)} frames are at t = {listed} s"
    if (t is None) == (frame is None):
        raise InputError(f"a stored frame: give either t or frame, and not both; {stored}")
    slack = SAME * max(map(abs, times), default=0.0)
    if t is not None:
        near = [i for i, time in enumerate(times) if abs(time - t) <= slack]
        if not near:
            raise InputError(f"no frame at t = {quote(t)} s: {stored}")
        return near[0]
    if frame is None or not -len(times) <= frame < len(times):
        raise InputError(f"no frame {quote(frame)}: {stored}")
    return frame % len(times)
