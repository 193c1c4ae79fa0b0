"""Traction, slip and gap of a state as Functions, and Functions of the user's in frames."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
from fem_problems import CONCRETE, block

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.core.state_checks import initial_state
from vi_contact.fem import compat

MU, PRESSURE, STIFF = 0.4, 3.0e5, 1.0e9


def nodes(function: Any) -> tuple[Any, Any]:
    """(places, values) of all unknowns of a blocked Function on this rank."""
    V, d = function.function_space, function.function_space.mesh.geometry.dim
    x = V.tabulate_dof_coordinates()[:, :d]
    return x, function.x.array.reshape(len(x), -1)


def shoved(comm: Any, d: int, degree: int = 1, *, simplices: bool = False) -> Any:
    """A block (nu = 0) on a rough plane whose sides are moved along it by 1 mm, pressed by its top:
    it slides everywhere, t = mu p."""
    mesh, tags = block(
        comm, lengths=(2.0, 1.0, 1.0)[:d], divisions=(4, 2, 2)[:d], simplices=simplices
    )
    material = vc.LinearElastic(E=STIFF, nu=0.0, rho=2000.0)
    along = [0.0] * d
    along[0] = 1.0e-3
    top = fem.Prescribed(
        tags["top"],
        tuple(np.array(along) - np.eye(d)[1] * PRESSURE / STIFF),
        history=lambda t: 1.0,
    )
    system = fem.assemble(mesh, material, prescribed=top, degree=degree)
    plane = vc.HalfSpace(point=(0.0,) * d, normal=tuple(np.eye(d)[1]))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=plane)
    return vc.ContactProblem(system, surface, friction=vc.Coulomb(MU)), tags


@pytest.mark.parametrize("d", [2, 3])
def test_traction_and_slip_of_a_block_that_slides(comm: Any, d: int) -> None:
    """The force of friction is mu N: ∫ t ds = mu N along x, and the slip of each node is its
    displacement along the plane; both are zero above the base."""
    problem, tags = shoved(comm, d)
    (state,) = vc.quasi_static(problem, [1.0])
    values = vc.contact_values(problem, state)
    assert np.allclose(values.used, 1.0, rtol=1e-9)
    traction = fem.as_function(problem, state, "contact_traction_t")
    x, t = nodes(traction)
    base = x[:, 1] < 1e-9
    assert not t[~base].any()
    ds = compat.measure(problem.system.space.mesh, d - 1, tags["bottom"].indices)
    force = [
        comm.allreduce(compat.assemble_scalar(compat.compile_form(traction[c] * ds)))
        for c in range(d)
    ]
    normal = float(np.sum(values.pressure * values.weights))
    assert force[0] == pytest.approx(MU * normal, rel=0.02)  # friction spreads by the edges
    assert np.sum(values.weights[:, None] * values.traction, axis=0)[0] == pytest.approx(
        MU * normal, rel=1e-3
    )
    assert max(abs(one) for one in force[1:]) < 1e-3 * force[0]

    # Each node has the vector of its condition.
    for name, wanted in (("contact_traction_t", values.traction), ("slip", values.slip)):
        places, found = nodes(fem.as_function(problem, state, name))
        for point, value in zip(places[base], found[base], strict=True):
            row = np.argmin(np.linalg.norm(values.points - point, axis=1))
            assert np.allclose(value, wanted[row], rtol=1e-12, atol=1e-12 * np.abs(wanted).max())
        assert not found[~base].any()
    u = nodes(fem.as_function(problem, state, "u"))[1]
    slip = nodes(fem.as_function(problem, state, "slip"))[1]
    assert np.allclose(slip[base, 0], u[base, 0], rtol=1e-12) and not slip[base, 1].any()


def test_gap_of_a_tilted_block(comm: Any) -> None:
    """gap = g0 + u_y at the nodes of the base, zero elsewhere."""
    mesh, tags = block(comm, lengths=(2.0, 1.0), divisions=(5, 2))
    system = fem.assemble(mesh, CONCRETE)
    plane = vc.HalfSpace(point=(0.0, -0.01), normal=(0.0, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=plane)
    problem = vc.ContactProblem(system, surface)
    points = system.space.points
    u = system.space.restrict(np.column_stack([0.0 * points[:, 0], 1e-3 * points[:, 0]]))
    state = replace(initial_state(problem), u=surface.in_frames(u))
    x, gap = nodes(fem.as_function(problem, state, "contact_gap"))
    wanted = np.where(x[:, 1] < 1e-9, 0.01 + 1e-3 * x[:, 0], 0.0)
    assert np.allclose(gap[:, 0], wanted, rtol=1e-12)
    still = nodes(fem.as_function(problem, state, "contact_traction_t"))[1]
    assert not still.any()


def own_functions(problem: Any) -> dict[str, Any]:
    """A number and a vector at nodes, a tensor in cells, and the stress of the state."""
    mesh = problem.system.space.mesh
    d = mesh.geometry.dim
    damage = compat.function(compat.lagrange(mesh, 1))
    damage.interpolate(lambda x: 3.0 * x[0] - x[1])
    wind = compat.function(compat.lagrange(mesh, 1, (d,)))
    wind.interpolate(lambda x: np.array([x[c] * (c + 1.0) for c in range(d)]))
    strain = compat.function(compat.lagrange(mesh, 0, (d, d), continuous=False))
    strain.x.array[:] = np.tile(np.arange(float(d * d)), len(strain.x.array) // (d * d))
    return {
        "damage": damage,
        "wind": wind,
        "plastic_strain": strain,
        "sigma": lambda state: fem.as_function(
            problem, state, "stress", continuous=problem.system.space.degree == 2
        ),
    }


@pytest.mark.parametrize("degree", [1, 2])
def test_frames_have_the_users_functions(comm: Any, shared_tmp: Path, degree: int) -> None:
    """Frames hold their values of the moment in the order of the input; a callback changes them;
    a restart knows which frames have which."""
    problem, _ = shoved(comm, 2, degree, simplices=True)
    own = own_functions(problem)

    def age(state: Any, report: Any) -> None:
        own["damage"].x.array[:] += 1.0

    run = {"dt": 1e-5, "out": shared_tmp, "progress": False, "record": [vc.Contact()]}
    vc.simulate(problem, steps=1, fields=fem.XDMF(1), **run)
    writer = fem.XDMF(1, functions=own)
    vc.simulate(problem, steps=3, fields=writer, callback=age, restart=True, **run)
    if comm.rank:
        return
    grids = ET.parse(shared_tmp / "fields.xdmf").getroot().findall(".//Grid[@GridType='Uniform']")
    names = [[one.get("Name") for one in grid.findall("Attribute")] for grid in grids]
    assert [set(own) <= set(each) for each in names] == [False, False, True, True]
    kinds = {
        one.get("Name"): (one.get("AttributeType"), one.get("Center"))
        for one in grids[-1].findall("Attribute")
    }
    assert kinds["damage"] == ("Scalar", "Node") and kinds["wind"] == ("Vector", "Node")
    assert kinds["plastic_strain"] == ("Tensor", "Cell")
    assert kinds["sigma"] == ("Tensor", "Cell" if degree == 1 else "Node")
    with h5py.File(shared_tmp / "fields" / "mesh.h5") as file:
        points = file["points"][:]
    for k in (2, 3):
        with h5py.File(shared_tmp / "fields" / f"frame_{k:06d}.h5") as file:
            wanted = 3.0 * points[:, 0] - points[:, 1] + (k - 2)
            assert np.allclose(file["damage"][:], wanted, atol=1e-12)
            vector = points * [1.0, 2.0, 0.0]
            assert np.allclose(file["wind"][:], vector, atol=1e-12)
            assert np.allclose(file["plastic_strain"][:], [0, 1, 0, 2, 3, 0, 0, 0, 0])
            assert len(file["sigma"]) == len(file["von_mises"] if degree == 1 else points)
            assert np.abs(file["sigma"][:, 4]).max() > 0.5 * PRESSURE


@pytest.mark.long
@pytest.mark.serial
def test_what_frames_cannot_hold(tmp_path: Path) -> None:
    from mpi4py import MPI

    problem, _ = shoved(MPI.COMM_SELF, 2)
    mesh = problem.system.space.mesh
    other = block(MPI.COMM_SELF, lengths=(1.0, 1.0), divisions=(2, 2))[0]
    jumps = compat.function(compat.lagrange(mesh, 1, continuous=False))
    away = compat.function(compat.lagrange(other, 1))
    for functions, words in (
        ({"a b": jumps}, "name of a Function"),
        ({"u": jumps}, "functions has the name 'u', which frames have already"),
    ):
        with pytest.raises(InputError, match=words):
            fem.XDMF(functions=functions)
    run = {"dt": 1e-5, "steps": 1, "out": tmp_path / "run", "progress": False}
    for given, words in (
        (jumps, "XDMF: 'mine' jumps between cells and changes in them; give a DOLFINx Function"),
        (away, "XDMF: 'mine' is on another mesh"),
        (3.0, "XDMF: 'mine'"),
        (lambda state: 3.0, "XDMF: 'mine'"),
    ):
        with pytest.raises(InputError, match=words):
            vc.simulate(problem, fields=fem.XDMF(1, functions={"mine": given}), **run)
    with pytest.raises(InputError, match="read_function: frames have no gap"):
        fem.read_function(problem, tmp_path, "contact_gap", frame=0)
