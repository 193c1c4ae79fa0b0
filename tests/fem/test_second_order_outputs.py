"""What is recorded and written of displacements of second order, on any number of ranks: fields
with all nodes in the order of VTK, stress, pressure, reactions and section forces, energies of a
run with friction between two bodies."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

import h5py
import ufl
from curved_cells import SHAPES, mesh_of
from fem_problems import CONCRETE, block, linear, nodal, run
from mesh_tools import integral, size
from mpi4py import MPI
from two_bodies import SOFT, blocks, per_body, two_blocks

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.fem import compat
from vi_contact.fem.output import fields, functions
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.cut import CutOpen
from vi_contact.practice.plots.bodies import Scene, plot_deformed
from vi_contact.practice.plots.deformed import read_frames
from vi_contact.practice.soil.free_field import FreeField

COMM = MPI.COMM_WORLD
P = 1.0e4
curved = pytest.mark.parametrize("curved", [False, True], ids=["straight", "curved"])
# which vertices every node of a cell is the mean of, in VTK's order (VTK book, quadratic cells)
VTK = {
    "triangles": [(0,), (1,), (2,), (0, 1), (1, 2), (0, 2)],
    "quadrilaterals": [(0,), (1,), (2,), (3,), (0, 1), (1, 2), (2, 3), (0, 3), (0, 1, 2, 3)],
    "tetrahedra": [(0,), (1,), (2,), (3,), (0, 1), (1, 2), (0, 2), (0, 3), (1, 3), (2, 3)],
    "hexahedra": [
        *((i,) for i in range(8)),
        (0, 1),
        (1, 2),
        (2, 3),
        (0, 3),
        (4, 5),
        (5, 6),
        (6, 7),
        (4, 7),
        (0, 4),
        (1, 5),
        (2, 6),
        (3, 7),
        (0, 3, 4, 7),
        (1, 2, 5, 6),
        (0, 1, 4, 5),
        (2, 3, 6, 7),
        (0, 1, 2, 3),
        (4, 5, 6, 7),
        tuple(range(8)),
    ],
}
TOPOLOGY = {
    "triangles": "Triangle_6",
    "quadrilaterals": "Quadrilateral_9",
    "tetrahedra": "Tetrahedron_10",
    "hexahedra": "Hexahedron_27",
}
SHEAR = CONCRETE.shear_modulus
STRAIN = 1e-4 * np.array([[1.0, 2.0, -1.0], [0.5, -3.0, 0.25], [2.0, 0.125, 1.5]])


WRITTEN = [*((name, False) for name in SHAPES), ("triangles", True), ("tetrahedra", True)]


@pytest.mark.parametrize("name, curved", WRITTEN)
def test_fields_have_all_nodes_in_the_order_of_vtk(
    name: str, curved: bool, shared_tmp: Path
) -> None:
    """The cells are turned the right way round, mid-points of straight cells lie where VTK expects
    them and curved ones not far from there; stress and displacements of a uniform strain are exact;
    pictures have the vertices."""
    mesh, _ = fem.build_mesh(mesh_of(name, curved), COMM)
    d = mesh.geometry.dim
    A = STRAIN[:d, :d]
    system = fem.assemble(mesh, CONCRETE, degree=2, initial_displacement=lambda x: x @ A.T)
    vc.simulate(
        linear(system),
        dt=1e-9,
        steps=1,
        out=shared_tmp / "run",
        fields=fem.XDMF(every=1),
        progress=False,
    )
    with h5py.File(shared_tmp / "run/fields/mesh.h5") as file:
        points, cells = file["points"][:, :d], file["cells"][:]
    with h5py.File(shared_tmp / "run/fields/frame_000000.h5") as file:
        u, stress = file["u"][:, :d], file["von_mises"][:]
    assert f'TopologyType="{TOPOLOGY[name]}"' in (shared_tmp / "run/fields.xdmf").read_text()
    assert np.array_equal(np.unique(cells), np.arange(len(points))) and np.allclose(
        u, points @ A.T, atol=1e-18
    )
    x, vertices = points[cells], [place for place, one in enumerate(VTK[name]) if len(one) == 1]
    means = np.stack([x[:, list(one)].mean(axis=1) for one in VTK[name]], axis=1)
    assert np.abs(x - means).max() < (0.11 if curved else 1e-14)
    first = {"quadrilaterals": [1, 3], "hexahedra": [1, 3, 4]}.get(name, list(range(1, d + 1)))
    assert np.abs(np.linalg.det(x[:, first] - x[:, :1])).min() > 0.01  # no diagonal for a side
    eps = 0.5 * (A + A.T)
    three = np.zeros((3, 3))
    three[:d, :d] = eps
    deviator = 2.0 * SHEAR * (three - np.trace(three) / 3.0 * np.eye(3))
    assert np.allclose(stress, np.sqrt(1.5 * np.sum(deviator**2)), rtol=1e-11)
    assert read_frames(shared_tmp / "run").cells.shape[1] == len(vertices)


def of_reactions(problem: vc.ContactProblem, state: vc.State) -> Any:
    """The contact pressure of the reactions alone: zero where a node has no condition."""
    nodal = fields.nodal_contact(problem, state, np.ones(len(state.r_n)))[0]
    return functions._make_function(problem, "contact_pressure", nodal[:, 0], state.t)


@pytest.mark.two_ranks
@pytest.mark.parametrize("name", ["triangles", "hexahedra"])
def test_functions_and_pressure(name: str) -> None:
    """The stress of a quadratic displacement is projected exactly (cells with straight sides), the
    contact pressure is on all nodes of the sides and its integral the resultant."""
    mesh, tags = block(COMM, **SHAPES[name])
    d = mesh.geometry.dim
    load = fem.Traction(tags["top"], (0.0, -2.0e4, 0.0)[:d])
    system = fem.assemble(mesh, CONCRETE, degree=2, loads=load, clamped=tags["left"])
    problem = vc.ContactProblem(system, fem.contact_surface(system, tags["bottom"]))
    state = vc.static_equilibrium(problem)
    pressure = fem.as_function(problem, state, "contact_pressure")
    ds = compat.measure(mesh, d - 1, tags["bottom"].indices)
    total = COMM.allreduce(state.r_n.sum())
    told = of_reactions(problem, state)
    assert integral(mesh, told, ds) == pytest.approx(total, rel=1e-12) and total > 1e3
    assert np.array_equal(told.x.array, pressure.x.array * (told.x.array != 0.0))
    # clamped nodes have the pressure of their neighbours
    assert integral(mesh, pressure, ds) > 1.01 * total
    free = linear(fem.assemble(mesh, CONCRETE, degree=2))
    bent = vc.State(
        0.0,
        0,
        nodal(free.system, lambda x: x[:, ::-1] * x[:, :1]),
        np.zeros(free.system.rows),
        np.zeros(0),
        np.zeros(0, dtype=bool),
    )
    for continuous in (False, True):
        stress = fem.as_function(free, bent, "stress", continuous=continuous)
        u = fem.as_function(free, bent, "u")
        away = stress - free.system.space.forms.stress(u)
        size = integral(mesh, ufl.inner(stress, stress), ufl.dx)
        assert integral(mesh, ufl.inner(away, away), ufl.dx) < 1e-20 * size


def test_reactions_and_sections_balance_the_loads() -> None:
    mesh, tags = fem.build_mesh(
        BlockMesh(lengths=(0.5, 4.0), divisions=(2, 8), simplices=True), COMM
    )
    loads = (fem.Traction(tags["right"], (-3.0e3, 0.0)), fem.BodyForce((0.0, -2.4e4)))
    problem = linear(fem.assemble(mesh, CONCRETE, degree=2, clamped=tags["bottom"], loads=loads))
    state = vc.static_equilibrium(problem)
    foot = vc.Reactions("foot", tags["bottom"], (0.25, 0.0), loads).start(problem, state)
    cut = vc.SectionForces({"a": ((0.0, 1.5), (0.5, 1.5))}, loads=loads).start(problem, state)
    assert foot["reaction_x_foot"] == pytest.approx(12.0e3, rel=1e-9)
    assert foot["reaction_y_foot"] == pytest.approx(2.4e4 * 2.0, rel=1e-9)
    assert foot["reaction_M_foot"] == pytest.approx(-3.0e3 * 4.0 * 2.0, rel=1e-9)
    assert cut["N_a"] == pytest.approx(-2.4e4 * 0.5 * 2.5, rel=1e-9)
    assert abs(cut["V_a"]) == pytest.approx(3.0e3 * 2.5, rel=1e-9)
    assert abs(cut["M_a"]) == pytest.approx(0.5 * 3.0e3 * 2.5**2, rel=1e-9)
    with pytest.raises(InputError, match="section 'a' cuts cells of degree 2"):
        vc.SectionForces({"a": ((0.0, 1.6), (0.5, 1.6))}, loads=loads).start(problem, state)


def thrown(comm: Any, name: str) -> vc.ContactProblem:
    """Two bodies that strike one another and rub."""
    both = blocks(
        3 if name == "hexahedra" else 2,
        simplices=name == "triangles",
        gap=1e-3,
        upper=(2, 2, 2),
        lower=(2, 2, 2),
    )
    system, tags = two_blocks(comm, both, degree=2)
    aside = np.array([1.0, -2.0, 0.5])[: system.space.dimension]
    system = system.changed(
        v0=per_body(system, lambda x: 0.0 * x, lambda x: aside + 0.2 * x[:, ::-1])
    )
    surface = fem.contact_pair(system, *(tags[side] for side in both.interface))
    return vc.ContactProblem(system, surface, friction=vc.Coulomb(0.3))


@pytest.mark.parametrize("name", ["triangles", "hexahedra"])
def test_two_bodies_strike_and_rub_alike_on_any_ranks(name: str) -> None:
    """Certificates and the energy ledger of the default scheme; the same run on all ranks as on one
    alone."""
    problem, alone = thrown(COMM, name), thrown(MPI.COMM_SELF, name)
    found = vc.simulate(problem, dt=2e-4, steps=40, progress=False, record=[vc.Energy()])
    facts, energy = found.facts, found.facts["energy"]
    assert facts["worst_certificate"] <= 1e-9 and facts["energy_defect"] <= 1e-10
    assert (
        facts.get("energy_created", 0.0) <= 1e-9
        and energy["loss_friction"] > 1e-6 * energy["energy_start"]
    )
    runs = [run(one, dt=2e-4, steps=40, scheme=vc.Trapezoidal()) for one in (problem, alone)]
    assert np.abs(runs[0].u - runs[1].u).max() <= 1e-8 * np.abs(runs[1].u).max()
    assert (
        np.abs(runs[0].r_n - runs[1].r_n).max() <= 1e-6 * np.abs(runs[1].r_n).max()
        and runs[0].r_n.max() > 0.0
    )


@pytest.mark.serial
@pytest.mark.parametrize("name", ["triangles", "hexahedra"])
def test_pictures_have_the_contact_of_mid_points_too(name: str, tmp_path: Path) -> None:
    vc.simulate(
        thrown(COMM, name),
        dt=2e-4,
        steps=2,
        out=tmp_path / "run",
        fields=fem.XDMF(every=1),
        progress=False,
        record=[vc.Contact()],
    )
    run = vc.read_run(tmp_path / "run")
    scene = Scene.read(run, [0.0], None)
    assert scene.contact is not None and len(scene.nodes) == (25 if name == "hexahedra" else 5)
    assert np.abs(scene.points[scene.nodes] - scene.contact.points).max() < 1e-14
    assert plot_deformed(run, tmp_path / "bodies.png").stat().st_size > 1000


@curved
def test_mass_of_contact_nodes_is_handed_on(curved: bool) -> None:
    """P2 triangles, whose row sums are zero at vertices, or of any sign with curved sides: those
    are not lumped. The mass and the inertia of the body stay what they are."""
    mesh, tags = fem.build_mesh(mesh_of("triangles", curved), COMM)
    system = fem.assemble(mesh, CONCRETE, degree=2)
    surface = fem.contact_surface(system, tags["bottom"])
    if curved:
        with pytest.raises(
            InputError, match=r"cannot lump negative row sums .* mass=Redistributed\(lumping=0.0\)"
        ):
            vc.Redistributed().apply(system, surface, tangential=False)
    moved = vc.Redistributed(0.0 if curved else 0.4).apply(system, surface, tangential=False)
    x, y = (
        nodal(system, lambda x: np.ones_like(x)),
        nodal(system, lambda x: x[:, ::-1] * [-1.0, 1.0]),
    )
    for one, other in ((x, x), (x, y), (y, y)):
        before, after = (system.algebra.dot(one, M @ other) for M in (system.M, moved.M))
        assert after == pytest.approx(before, rel=1e-11, abs=1e-8)
    assert np.array_equal(np.flatnonzero(moved.massless), np.sort(surface.owned))
    bottom = nodal(system, lambda x: np.where(x[:, 1:] == 0.0, [0.0, 1.0], 0.0))
    assert np.abs(moved.M @ bottom).max(initial=0.0) <= 1e-9 * np.abs(system.M @ x).max(initial=1.0)


@pytest.mark.two_ranks
def test_tied_sides_and_dashpots() -> None:
    """A layer with tied sides in shear moves as a column does; dashpots resist a motion of the
    whole side by the impedance times its length."""
    mesh, tags = block(COMM, lengths=(2.0, 1.5), divisions=(3, 3), simplices=True)
    loads = fem.Traction(tags["top"], (1.0e4, 0.0))
    tied = fem.Tied(tags["left"], tags["right"])
    system = fem.assemble(mesh, CONCRETE, degree=2, clamped=tags["bottom"], tied=tied, loads=loads)
    state = vc.static_equilibrium(linear(system))
    exact = nodal(system, lambda x: 1.0e4 / SHEAR * np.column_stack([x[:, 1], 0.0 * x[:, 1]]))
    assert np.abs(state.u - exact).max(initial=0.0) <= 1e-10 * 1.5e4 / SHEAR
    absorbing = fem.assemble(mesh, CONCRETE, degree=2, dashpots=fem.Dashpots(tags["bottom"]))
    across, along = absorbing.influence[:, 1], absorbing.influence[:, 0]
    resists = [absorbing.algebra.dot(one, absorbing.C @ one) for one in (across, along)]
    assert resists == pytest.approx(
        [2.0 * CONCRETE.rho * c for c in (CONCRETE.c_p, CONCRETE.c_s)], rel=1e-12
    )


@pytest.mark.two_ranks
def test_what_knows_first_order_only_says_so() -> None:
    mesh, tags = block(COMM, lengths=(2.0, 1.5), divisions=(3, 3))
    side = FreeField(tags["left"], base=vc.Harmonic(1.0, 2.0, direction=(1.0, 0.0)))
    with pytest.raises(
        InputError, match="FreeField has a soil column of first order: give assemble degree=1"
    ):
        fem.assemble(mesh, CONCRETE, degree=2, clamped=tags["bottom"], dashpots=side)
    with pytest.raises(InputError, match="a mesh of second order cannot be cut or welded"):
        fem.build_mesh(CutOpen(mesh_of("triangles", curved=True), "bottom"), COMM)


@pytest.mark.two_ranks
@curved
def test_reactions_hold_what_contact_does_to_held_edges(curved: bool) -> None:
    """A block clamped beside its contact: loads, contact, friction and reactions are in balance, at
    rest and in steps, and a cut along the clamped side has minus the reactions."""
    mesh, tags = fem.build_mesh(mesh_of("tetrahedra", curved), COMM)
    density = np.array([1e3, -3e4, 2e3])
    loads = fem.BodyForce(tuple(density))
    system = fem.assemble(mesh, SOFT, clamped=tags["left"], loads=loads, degree=2)
    surface = fem.contact_surface(
        system, tags["bottom"], obstacle=vc.AnalyticGap(lambda x: 1e-3 * x[:, 2])
    )
    problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(0.2))
    state = vc.static_equilibrium(problem, tolerance=1e-13)
    record: list[Any] = [
        vc.Reactions("left", tags["left"], (0.0, 0.0, 0.0), loads=loads),
        vc.Contact(),
    ]
    if not curved:
        side = (0.0, 0.0, 0.0), (0.0, 1.5, 0.0), (0.0, 0.0, 1.2)
        record.append(vc.SectionForces({"side": side}, loads=loads))
    history = vc.simulate(
        problem, dt=1e-3, steps=2, state=state, record=record, progress=False
    ).history
    total = density * integral(mesh, 1.0, ufl.dx)
    held = np.column_stack([history[f"reaction_{c}_left"] for c in "xyz"])
    contact = np.column_stack(
        [history[f"contact_force_{c}"] + history[f"friction_force_{c}"] for c in "xyz"]
    )
    assert contact[0, 1] > 0.2 * abs(total[1])
    assert np.abs(contact[:, [0, 2]]).max() > 0.01 * contact[0, 1]
    assert np.allclose(held + contact, -total, rtol=0.0, atol=1e-8 * abs(total[1]))
    if not curved:
        cut = np.column_stack([history[f"{name}_side"] for name in ("N", "V_2", "V_3")])
        assert np.allclose(cut, -held, rtol=0.0, atol=1e-8 * abs(total[1]))


@pytest.mark.parametrize("degree", [1, 2])
def test_reactions_of_both_sides_of_a_pair(degree: int) -> None:
    """Two blocks held beside their interface, or the lower one on it: each is in balance with its
    part of the loads."""
    both = blocks(3, upper=(2, 1, 2), lower=(2, 1, 2), simplices=True)
    mesh, tags = fem.build_mesh(both, COMM)
    load = fem.Traction(tags["upper_top"], (0.0, -P, 0.0))
    total = P * size(tags["upper_top"])
    for lower in (tags["lower_left"], tags["lower_top"]):
        system = fem.assemble(
            mesh, SOFT, clamped=[lower, tags["upper_left"]], loads=load, degree=degree
        )
        problem = vc.ContactProblem(
            system, fem.contact_pair(system, *(tags[side] for side in both.interface))
        )
        state = vc.static_equilibrium(problem, tolerance=1e-13)
        pressed = COMM.allreduce(float(state.r_n.sum()))
        below = vc.Reactions("lower", lower, (0.0, 0.0, 0.0), loads=load).start(problem, state)
        above = vc.Reactions("upper", tags["upper_left"], (0.0, 0.0, 0.0), loads=load).start(
            problem, state
        )
        assert pressed > 0.2 * total
        assert below["reaction_y_lower"] == pytest.approx(pressed, rel=1e-9)
        assert above["reaction_y_upper"] == pytest.approx(total - pressed, rel=1e-9)


@pytest.mark.two_ranks
@pytest.mark.parametrize(
    "points", [None, [(1.0, 0.0, 0.6), (2.0, 0.0, 1.2)]], ids=["all", "listed"]
)
def test_the_pressure_of_tetrahedra_has_the_contact_force(points: Any) -> None:
    """∫ p = sum r_n of p that is zero at vertices of contact facets without a condition, clamped or
    not listed; as a function clamped ones have the pressure of their neighbours."""
    mesh, tags = fem.build_mesh(mesh_of("tetrahedra", False), COMM)
    system = fem.assemble(
        mesh, SOFT, clamped=tags["left"], loads=fem.BodyForce((0.0, -3e4, 0.0)), degree=2
    )
    problem = vc.ContactProblem(system, fem.contact_surface(system, tags["bottom"], points=points))
    state = vc.static_equilibrium(problem)
    pressure = fem.as_function(problem, state, "contact_pressure")
    ds = compat.measure(mesh, 2, tags["bottom"].indices)
    force = COMM.allreduce(float(state.r_n.sum()))
    assert force > 0.0
    assert integral(mesh, of_reactions(problem, state), ds) == pytest.approx(force, rel=1e-12)
    more = integral(mesh, pressure, ds) / force - 1.0
    assert more > 0.01 if points is None else abs(more) < 1e-12
