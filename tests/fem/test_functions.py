"""Functions of states and frames: nodal values, stresses and pressures against closed forms, on any
number of ranks."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

pytest.importorskip("dolfinx")

import ufl
from chain import chain_problem
from fem_problems import BODIES, CONCRETE, WALL_DT, block, linear, shaken_wall
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.problem import ContactProblem
from vi_contact.core.state_checks import initial_state
from vi_contact.fem import compat

RUN = {"scheme": vc.ZienkiewiczWoodTaylor(), "dt": WALL_DT}


def ends(comm: Any, values: Any) -> float:
    """The largest of values on all ranks."""
    return float(comm.allreduce(float(np.max(values, initial=-np.inf)), op=MPI.MAX))


def nodes(function: Any) -> tuple[Any, Any]:
    """(places, values) of all unknowns of a blocked Function on this rank, ghosts included."""
    V, d = function.function_space, function.function_space.mesh.geometry.dim
    x = V.tabulate_dof_coordinates()[:, :d]
    return x, function.x.array.reshape(len(x), -1)


def with_field(problem: ContactProblem, A: Any) -> vc.State:
    """The state of displacements A x and velocities 2 A x."""
    space, surface = problem.system.space, problem.surface
    u = surface.in_frames(space.restrict(space.points @ A.T))
    return replace(initial_state(problem), u=u, v=2.0 * u)


def on_sides(
    comm: Any, A: Any, integration: Any = "full", degree: int = 1, **spec: Any
) -> ContactProblem:
    """A body whose left side is moved by the field A x, and whose right side may touch an obstacle
    that is oblique."""
    mesh, tags = block(comm, **spec)
    grown = fem.Prescribed(
        tags["left"],
        displacement=lambda x, t: x @ A.T,
        velocity=lambda x, t: 2.0 * x @ A.T,
        acceleration=lambda x, t: 0.0 * x,
    )
    system = fem.assemble(mesh, CONCRETE, prescribed=grown, integration=integration, degree=degree)
    d = mesh.geometry.dim
    wall = vc.HalfSpace((3.0,) * d, (-1.0,) * d)
    return ContactProblem(system, fem.contact_surface(system, tags["right"], obstacle=wall))


@pytest.mark.two_ranks
@pytest.mark.parametrize(
    "body, options",
    [
        *((name, {}) for name in BODIES if name != "bar"),
        ("quadrilaterals", {"integration": "selective"}),
        ("triangles", {"degree": 2}),
        ("quadrilaterals", {"degree": 2}),
    ],
    ids=str,
)
def test_values_of_a_state(comm: Any, body: str, options: dict[str, Any]) -> None:
    """u and v are those of the state in Cartesian axes, though contact frames are turned, with the
    prescribed sides and with ghosts; the stress of a patch is Hooke's, in every cell and
    projected."""
    d = len(BODIES[body]["lengths"])
    A = 1e-4 * np.array([[1.0, 2.0, -1.0], [0.5, -3.0, 0.25], [2.0, 0.125, 1.5]])[:d, :d]
    problem = on_sides(comm, A, **options, **BODIES[body])
    state = with_field(problem, A)
    assert not np.allclose(problem.cartesian(state.u), state.u) or comm.size > 1
    for name, factor in (("u", 1.0), ("v", 2.0)):
        found = fem.as_function(problem, state, name)
        assert found.function_space is problem.system.space.V and found.name == name
        x, values = nodes(found)
        assert ends(comm, np.abs(values - factor * x @ A.T)) < 1e-18
    eps, (lame, shear) = 0.5 * (A + A.T), vc.PlaneStrain().elastic_constants(CONCRETE)
    exact = lame * np.trace(eps) * np.eye(d) + 2.0 * shear * eps
    for continuous in (False, True):
        stress = fem.as_function(problem, state, "stress", continuous=continuous)
        assert ends(comm, np.abs(nodes(stress)[1] - exact.ravel())) < 1e-11 * np.abs(exact).max()


def test_tied_sides_move_together(comm: Any) -> None:
    """A layer under its weight whose sides are tied: u is that of a column at every node, those
    that follow too."""
    mesh, tags = block(comm, lengths=(2.0, 1.0), divisions=(4, 3))
    system = fem.assemble(
        mesh,
        vc.LinearElastic(1.0e6, 0.0, 1.0),
        clamped=tags["bottom"],
        tied=fem.Tied(tags["left"], tags["right"]),
        loads=fem.BodyForce((0.0, -600.0)),
    )
    problem = linear(system)
    x, values = nodes(fem.as_function(problem, vc.static_equilibrium(problem), "u"))
    exact = -600.0 / 1.0e6 * (x[:, 1] - 0.5 * x[:, 1] ** 2)
    assert ends(comm, np.abs(values - np.column_stack([0.0 * exact, exact]))) < 1e-15


@pytest.mark.two_ranks
@pytest.mark.parametrize("continuous", [False, True])
def test_stress_of_bending_is_in_the_space_of_a_quadrilateral(comm: Any, continuous: bool) -> None:
    """u = (x y, 0), nu = 0, E = 1, plane stress: sigma_xx = y, sigma_xy = x/2, sigma_yy = 0:
    bilinear in every cell."""
    mesh, _ = block(comm, lengths=(1.0, 1.0), divisions=(2, 3))
    problem = linear(
        fem.assemble(mesh, vc.LinearElastic(1.0, 0.0, 1.0), section=vc.PlaneStress(0.2))
    )
    x, y = problem.system.space.points.T
    u = problem.system.space.restrict(np.column_stack([x * y, 0.0 * x]))
    stress = fem.as_function(
        problem, replace(initial_state(problem), u=u), "stress", continuous=continuous
    )
    (x, y), values = nodes(stress)[0].T, nodes(stress)[1]
    assert ends(comm, np.abs(values - np.column_stack([y, 0.5 * x, 0.5 * x, 0.0 * x]))) < 1e-11


@pytest.mark.two_ranks
def test_projection_of_a_jump(comm: Any) -> None:
    """A bar of three cells, E = 1, strains 1, 0, 2: the L2 projection onto P1 solves M s = b of hat
    functions."""
    mesh, _ = block(comm, lengths=(3.0,), divisions=(3,))
    problem = linear(fem.assemble(mesh, vc.LinearElastic(1.0, 0.0, 1.0)))
    x = problem.system.space.points[:, 0]
    u = problem.system.space.restrict(
        np.interp(x, [0.0, 1.0, 2.0, 3.0], [0.0, 1.0, 1.0, 3.0])[:, None]
    )
    state = replace(initial_state(problem), u=u)
    mass = (
        np.array(
            [[2.0, 1.0, 0.0, 0.0], [1.0, 4.0, 1.0, 0.0], [0.0, 1.0, 4.0, 1.0], [0.0, 0.0, 1.0, 2.0]]
        )
        / 6.0
    )
    exact = np.linalg.solve(mass, [0.5, 0.5, 1.0, 1.0])
    for continuous, values in (True, exact), (False, np.array([1.0, 0.0, 2.0])):
        stress = fem.as_function(problem, state, "stress", continuous=continuous)
        x = compat.lagrange(
            mesh, int(continuous), continuous=continuous
        ).tabulate_dof_coordinates()[:, 0]
        places = np.rint(x) if continuous else np.floor(x)
        assert ends(comm, np.abs(stress.x.array - values[places.astype(int)])) < 1e-12


def test_contact_pressure_integrates_to_the_resultant(comm: Any) -> None:
    """∫ p ds over the contact side, p zero at its clamped end, is the sum of the reactions over the
    thickness: weights are integrals of hats. The function has the pressure of the neighbour
    there."""
    problem = shaken_wall(comm, angle=0.3, simplices=True)
    solution = vc.simulate(problem, steps=33, **RUN)
    pressure, whole = solution.function("contact_pressure"), problem.surface.whole()
    x, values = nodes(pressure)
    largest = solution.history["contact_max_pressure"][-1]
    assert ends(comm, values) == pytest.approx(largest, rel=1e-12) and largest > 0.0
    inside = (x - whole.points[0]) @ whole.normals[0] < -1e-6
    assert not np.any(values[inside])
    places = np.linalg.norm(x[:, None] - whole.points, axis=2)
    held = np.flatnonzero((values[:, 0] != 0.0) & (places.min(axis=1) > 1e-9))
    end = problem.surface.everywhere(solution.state.r_n) / whole.weights
    for node in held:
        assert values[node, 0] == pytest.approx(end[np.argmin(places[node])], rel=1e-12)
    assert comm.allreduce(len(held)) >= 1
    pressure.x.array[held] = 0.0
    form = compat.compile_form(pressure * ufl.ds)
    total = comm.allreduce(compat.fem.assemble_scalar(form))
    assert 0.2 * total == pytest.approx(solution.history["contact_resultant"][-1], rel=1e-12)


def test_stored_frames(comm: Any, shared_tmp: Path) -> None:
    """A frame by its time or number is what XDMF shows, in the numbers of the input; a restart ends
    in the same."""
    problem = shaken_wall(comm, angle=0.3)
    first = vc.simulate(problem, steps=22, out=shared_tmp, fields=fem.XDMF(11), **RUN)
    solution = vc.simulate(
        problem, steps=33, out=shared_tmp, fields=fem.XDMF(11), restart=True, **RUN
    )
    assert first.state.k == 22
    space = problem.system.space
    for number, k in enumerate((0, 11, 22, 33)):
        u, v = (solution.function(name, frame=number) for name in "uv")
        with h5py.File(shared_tmp / "fields" / f"frame_{k:06d}.h5") as file:
            for name, found in ("u", u), ("v", v):
                assert np.array_equal(
                    found.x.array[: space.free.size], file[name][:][space.nodes, :2].ravel()
                )
        again = solution.function("u", t=solution.history["t"][k] * (1.0 + 1e-14))
        assert np.array_equal(u.x.array, again.x.array)
    for name in ("u", "v", "stress", "contact_pressure"):
        last, state = solution.function(name, frame=-1), solution.function(name)
        size = ends(comm, np.abs(state.x.array))
        assert size > 0.0 and ends(comm, np.abs(last.x.array - state.x.array)) <= 1e-12 * size
    size = ends(comm, np.abs(nodes(first.function("u"))[1]))
    difference = first.function("u").x.array - solution.function("u", frame=2).x.array
    assert ends(comm, np.abs(difference)) <= 1e-12 * size


def test_frames_of_one_rank_are_read_on_all(comm: Any, shared_tmp: Path) -> None:
    """The folder of a run of rank 0 alone; and what is refused."""
    if comm.rank == 0:
        vc.simulate(shaken_wall(MPI.COMM_SELF), steps=4, out=shared_tmp, fields=fem.XDMF(2), **RUN)
    comm.Barrier()
    problem = shaken_wall(comm)
    own = vc.simulate(problem, steps=4, **RUN)
    u = fem.read_function(problem, shared_tmp, "u", t=4 * WALL_DT)
    expected = own.function("u").x.array
    assert ends(comm, np.abs(u.x.array - expected)) < 1e-9 * ends(comm, np.abs(expected))
    stored = r"the 3 frames are at t = 0, 0\.00357142857, 0\.00714285714 s"
    for wanted, words in (
        ({"t": 0.5}, f"no frame at t = 0.5 s: {stored}"),
        ({"frame": 3}, f"no frame 3: {stored}"),
        ({"frame": -4}, "no frame -4"),
        ({}, "give either t or frame"),
        ({"t": 0.0, "frame": 0}, "and not both"),
        ({"t": "now"}, "t is 'now'"),
        ({"frame": 0.5}, "frame is 0.5"),
    ):
        with pytest.raises(vc.InputError, match=words):
            fem.read_function(problem, shared_tmp, "u", **wanted)
    with pytest.raises(vc.InputError, match="are of another mesh"):
        fem.read_function(shaken_wall(comm, divisions=(4, 7)), shared_tmp, "u", frame=0)
    with pytest.raises(vc.InputError, match=r"has no fields\.xdmf"):
        fem.read_function(problem, shared_tmp / "none", "u", frame=0)
    with pytest.raises(vc.InputError, match="the run kept no frames"):
        own.function("u", frame=0)
    with pytest.raises(
        vc.InputError, match="'w' is not a quantity; give one of 'u', 'v', 'stress', 'contact_p"
    ):
        own.function("w")
    with pytest.raises(vc.InputError, match="the state has u of shape"):
        fem.as_function(shaken_wall(comm, divisions=(8, 8)), own.state, "u")


@pytest.mark.serial
def test_a_damaged_folder_and_a_system_without_a_mesh_are_told(tmp_path: Path) -> None:
    problem = shaken_wall(MPI.COMM_SELF)
    solution = vc.simulate(problem, steps=2, out=tmp_path, fields=fem.XDMF(1), **RUN)
    (tmp_path / "fields" / "frame_000001.h5").write_bytes(b"no")
    with pytest.raises(vc.InputError, match="are incomplete or damaged"):
        solution.function("v", frame=1)
    (tmp_path / "fields.xdmf").write_text("<Xdmf>")
    with pytest.raises(vc.InputError, match="are incomplete or damaged"):
        solution.function("v", frame=2)
    chain = vc.simulate(chain_problem(3), dt=1e-3, steps=2)
    with pytest.raises(vc.InputError, match="the system has no mesh"):
        chain.function("u")
