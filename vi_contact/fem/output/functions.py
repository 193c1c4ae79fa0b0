"""Hand out states and stored frames as DOLFINx Functions.

They are along the axes and with the values of ghosts.

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
from ...core.checks import flag, instance, number, optional, refuse, shown
from ...core.errors import InputError, of_machine
from ...core.files import FIELDS, FIELDS_INDEX, frames_of, on_root, open_hdf5
from ...core.own_files import inner_folder, is_own, read_bytes
from ...core.problem import ContactProblem
from ...core.state_checks import check_problem_given, check_sizes
from ...core.step import State
from .. import compat
from ..body.space import FemSpace, known_matrices, space_of
from .fields import (
    between,
    blocks_of_conditions,
    nodal_contact,
    nodal_gap,
    nodal_rubbing,
)

NAMES = ("u", "v", "stress", "contact_pressure", "contact_traction_t", "slip", "contact_gap")
ACCURACY = 1e-13  # of a projection, in its residual
SAME = 1e-9  # of the size of the mesh, and of the longest time


def as_function(
    problem: ContactProblem, state: State, name: str, *, continuous: bool = False
) -> Any:
    """Return a state as a DOLFINx Function.

    It is "u" [m], "v" [m/s], "stress" [Pa] (d, d), "contact_pressure" [Pa], "contact_gap" [m], or
    a vector along the axes: "contact_traction_t" [Pa], the tangential traction of the body on its
    support, and "slip" [m], its tangential displacement there. Those of the contact are zero off
    the contact surface.

    Where a node of the contact boundary has no pressure or traction of its own, as one that is
    held, the function has the mean of those of its neighbours, so that the error of a right
    pressure falls with the size of the facets there too. Its gap and slip are zero.

    ``state``: of simulate, march, static_equilibrium or quasi_static of this problem.
    ``continuous``: the stress projected onto P1, Q1, P2 or Q2, ∫ sigma_h : tau = ∫ sigma(u) : tau.
    Every call makes a Function of its own. Collective. InputError for a state of another problem,
    and a system without a mesh.
    """
    space = _checked("as_function", problem, name, continuous)
    check_sizes("as_function", problem, state)
    if name in ("u", "v", "stress"):
        x, derivative = (state.v, 1) if name == "v" else (state.u, 0)
        return _function(
            problem,
            name,
            space.expand(problem.cartesian(x), state.t, derivative),
            state.t,
            continuous,
        )
    return _function(problem, name, _of_contact(problem, state, name), state.t)


def _of_contact(problem: ContactProblem, state: State, name: str) -> Array:
    """Return a quantity of the contact at the owned nodes, (k,) or (k, d). Collective.

    Args:
        problem: the problem.
        state: a state of it.
        name: the quantity.
    """
    if name == "contact_pressure":
        pressure = nodal_contact(problem, state, np.ones(len(state.r_n)))[0]
        return with_borrowed(problem, pressure)[:, 0]
    if name == "contact_gap":
        return nodal_gap(problem, state)[:, 0]
    traction, slip = nodal_rubbing(problem, state)
    if name == "slip":
        return between(problem, slip)
    return with_borrowed(problem, between(problem, traction))


def with_borrowed(problem: ContactProblem, pressure: Array) -> Array:
    """Return nodal contact pressures (k, 1) with those of borrowing nodes. Collective.

    The nodes of contact boundaries that have none of their own take the mean of those of their
    neighbours (``contact.borrowing``).
    """
    space = space_of("contact_pressure", problem.system)
    surface = problem.surface
    blocks = blocks_of_conditions(problem)
    told = np.zeros(len(space.nodes), dtype=bool)
    told[blocks if surface.uncovered is None else blocks[~surface.uncovered]] = True
    found = np.zeros_like(pressure)
    for part in getattr(surface, "parts", ()):
        if part.borrowed is not None:
            rows = space.blocks_of(part.borrowed.numbers)
            values = part.borrowed.values(space, pressure)
            found[rows[~told[rows]]] = values[~told[rows]]
    kept = pressure.copy()
    kept[blocks[~told[blocks]]] = 0.0
    return kept + between(problem, found)


def read_function(
    problem: ContactProblem,
    folder: str | Path,
    name: str,
    *,
    t: float | None = None,
    frame: int | None = None,
    continuous: bool = False,
) -> Any:
    """Return a frame in the folder of a run (``fields=fem.XDMF(…)``).

    It is as ``as_function`` returns a state.

    ``t``: its time [s]; ``frame``: its number in the order of time, 0 for the first and -1 for the
    last. The run may have had any number of ranks. Collective. InputError for a time without a
    frame, and fields of another mesh.
    """
    space = _checked("read_function", problem, name, continuous)
    optional(number, "read_function", "t", t, unit="s")
    optional(
        instance,
        "read_function",
        "frame",
        frame,
        int,
        "give its number, 0 for the first and -1 for the last",
    )
    if name == "contact_gap":
        raise InputError(
            "read_function: frames have no gap; give as_function a state, or record Contact()"
        )
    kind = "u" if name == "stress" else name
    comm = space.comm
    d = space.dimension
    points, values, t = comm.bcast(on_root(comm, lambda: _stored(Path(folder), kind, t, frame)))
    fits = len(points) > np.max(space.nodes, initial=-1)
    fits = (
        fits
        and np.max(np.abs(points[space.nodes, :d] - space.points), initial=0.0) <= SAME * space.size
    )
    refuse(
        [
            ""
            if fits
            else f"the fields in '{folder}' are of another mesh: give the problem of that run"
        ],
        comm,
    )
    if name == "contact_pressure":
        return _function(problem, name, with_borrowed(problem, values[space.nodes, None])[:, 0], t)
    if name == "contact_traction_t":
        return _function(problem, name, with_borrowed(problem, values[space.nodes, :d]), t)
    return _function(problem, name, values[space.nodes, :d], t, continuous)


def _checked(owner: str, problem: Any, name: Any, continuous: Any) -> FemSpace:
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
            f"{owner}: {shown(name)} is not a quantity; give one of {', '.join(map(repr, NAMES))}"
        )
    return space_of(owner, problem.system)


def _function(
    problem: ContactProblem, name: str, nodal: Array, t: float, continuous: bool = False
) -> Any:
    """Return the Function of values at the owned nodes, (k,) or (k, d), at a time.

    The stress is that of displacements.

    Args:
        problem: the problem.
        name: the quantity.
        nodal: values at the owned nodes.
        t: time [s].
        continuous: whether the stress is projected.
    """
    system = problem.system
    space = space_of(name, problem.system)
    V = (
        system.cached("scalars", lambda: compat.lagrange(space.mesh, space.degree))
        if nodal.ndim == 1
        else space.V
    )
    found = compat.function(V)
    values = nodal[_blocks(V, space.V)].ravel()
    found.x.array[: values.size] = values
    found.x.scatter_forward()
    if name == "stress":
        known_matrices("stress", system, "K")
        found = system.cached(f"stress {continuous}", lambda: Stress(space, continuous))(found, t)
    found.name = name
    return found


def _blocks(of: Any, among: Any) -> Indices:
    """Return the owned blocks of unknowns of a space among those of another one.

    Both have the same element.
    """
    owned = of.dofmap.index_map.size_local
    ghosts = of.dofmap.index_map.num_ghosts
    blocks = np.zeros(owned + ghosts, dtype=np.int64)
    blocks[compat.cell_blocks(of)] = compat.cell_blocks(among)
    return blocks[:owned]


class Stress:
    """Project sigma(u) by conjugate gradients.

    M sigma_c = ∫ sigma(u) : tau_c for every component c.
    """

    def __init__(self, space: FemSpace, continuous: bool) -> None:
        d = space.dimension
        degree = space.degree - (compat.is_simplex(space.mesh) and not continuous)
        self._tensors = compat.lagrange(space.mesh, degree, (d, d), continuous=continuous)
        self._u = compat.function(space.V)
        scalars = compat.lagrange(space.mesh, degree, continuous=continuous)
        self._blocks = _blocks(scalars, self._tensors)
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
        """Return the stress (d, d) of displacements at a time; collective."""
        self._u.x.array[:] = u.x.array
        self._forms.follow(self._u, t)
        found = compat.function(self._tensors)
        values = found.x.array.reshape(-1, self._tensors.dofmap.index_map_bs)
        loads = compat.assemble_vector(self._load).array_r.reshape(-1, values.shape[1])
        for c in range(values.shape[1]):
            self._b.array[:] = loads[self._blocks, c]
            self._ksp.solve(self._b, self._x)
            values[self._blocks, c] = self._x.array_r
        found.x.scatter_forward()
        return found


def _stored(
    folder: Path, name: str, t: float | None, frame: int | None
) -> tuple[Array, Array, float]:
    """Return points of the mesh, a quantity of a frame at them, and its time."""
    if not is_own(folder / FIELDS_INDEX):
        raise InputError(
            f"'{folder}' has no {FIELDS_INDEX}: run again with out and fields=fem.XDMF(every=10)"
        )
    try:
        index: Any = ET.fromstring(read_bytes(folder / FIELDS_INDEX))
        attributes = {one.get("Name") for one in index.iterfind(".//Attribute")}
        if attributes and name not in attributes:
            raise InputError(
                f"the frames in '{folder}' have no '{name}', as those of a run without friction"
            )
        places = sorted(
            (
                float(grid.find("Time").get("Value")),
                grid.find(f"Attribute[@Name='{name}']/DataItem").text,
            )
            for grid in index.findall(".//Grid[@GridType='Uniform']")
        )
        time, place = places[_chosen([time for time, _ in places], t, frame)]
        file, path = place.split(":")
        known = {str(one.relative_to(folder)): one for one, _ in frames_of(folder).values()}
        with (
            open_hdf5(inner_folder(folder, FIELDS) / "mesh.h5") as mesh,
            open_hdf5(known[file]) as fields,
        ):
            return mesh["points"][()], fields[path][()], time
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
        if of_machine(error):
            raise
        raise InputError(
            f"the fields in '{folder}' are incomplete or damaged ({error}): run again"
        ) from error


def _chosen(times: list[float], t: float | None, frame: int | None) -> int:
    """Return the number of the frame of a time, or of this number.

    Args:
        times: those of the frames [s].
        t: the time that is asked for, or None.
        frame: the number that is asked for, or None.
    """
    told = ", ".join(f"{one:.9g}" for one in times[:12]) + (
        f", … {times[-1]:.9g}" if len(times) > 12 else ""
    )
    stored = f"the {len(times)} frames are at t = {told} s"
    if (t is None) == (frame is None):
        raise InputError(f"a stored frame: give either t or frame, and not both; {stored}")
    slack = SAME * max(map(abs, times), default=0.0)
    wanted = (
        range(len(times))[frame:][:1]
        if t is None
        else [i for i, one in enumerate(times) if abs(one - t) <= slack]
    )
    if not wanted or (frame or 0) < -len(times):
        raise InputError(
            f"no frame {shown(frame) if t is None else f'at t = {shown(t)} s'}: {stored}"
        )
    return wanted[0]
