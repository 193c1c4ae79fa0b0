"""Bodies of finite elements whose internal force is a form of the user's."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import dolfinx
import numpy as np
import pytest
from mpi4py import MPI

import vi_contact as vc
from demos.parts.problems.nonlinear import Rubber, hang_block, throw_block
from vi_contact import fem, soil, vi
from vi_contact.core.algebra import max_abs, total
from vi_contact.core.errors import InputError
from vi_contact.fem import compat
from vi_contact.fem.output.fields import VonMises
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import TwoBlocks

RUBBER = Rubber()


def block(comm: Any, n: int = 6, **more: Any) -> tuple[Any, Any]:
    """A block 1 m wide and 2 m high, stated by forms."""
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 2.0), divisions=(n, 2 * n)), comm)
    return fem.assemble(mesh, forms=RUBBER.make_forms(), **more), tags


def sort_by_place(problem: vc.ContactProblem, state: Any) -> np.ndarray:
    """The displacements of the nodes of all ranks in the order of their places."""
    space: Any = problem.system.space
    nodal = space.expand(problem.cartesian(state.u), state.t)
    rows = np.concatenate(space.comm.mpi.allgather(np.hstack([np.round(space.points, 9), nodal])))
    return rows[np.lexsort(rows[:, :2].T)]


def test_the_forms_at_rest_are_those_of_the_linear_body(comm: Any) -> None:
    """K is the derivative at zero, which is that of Hooke's law; p is its product for small u."""
    system, _ = block(comm)
    mesh = system.space.mesh  # type: ignore[attr-defined]
    hooke = fem.assemble(
        mesh, vc.LinearElastic(E=RUBBER.E, nu=RUBBER.nu, rho=RUBBER.rho), section=vc.PlaneStrain()
    )
    x = system.space.coordinates
    u = 1e-7 * np.sin(3.0 * x[:, 0] + 2.0 * x[:, 1])
    assert system.internal is not None
    linear = hooke.K @ u
    size = vc.core.algebra.largest(system.algebra.comm, np.abs(linear).max(initial=0.0))
    for found in (system.K @ u, system.internal.force(u), system.internal.tangent(u) @ u):
        off = vc.core.algebra.largest(system.algebra.comm, np.abs(found - linear).max(initial=0.0))
        assert off <= 1e-5 * size


@pytest.mark.long
def test_a_block_is_thrown_with_friction(comm: Any) -> None:
    """Certificates of the nonlinear step, the ledger with W(u), and a loss of the scheme that is
    small beside the energy."""
    problem = throw_block(comm, friction=vc.Coulomb(0.3))
    found = vc.simulate(
        problem,
        scheme=vc.Midpoint(),
        dt=2e-3,
        steps=60,
        record=[vc.Energy(), vc.Contact()],
        progress=False,
    )
    history = found.history
    assert found.facts["worst_certificate"] <= 1e-9
    assert found.facts["energy_defect"] <= 1e-9
    if comm.rank == 0:
        most = history["energy_kinetic"][0]
        assert history["contact_active"].max() >= 5
        assert history["loss_friction"][-1] > 1e-3 * most
        assert abs(history["loss_algorithmic"][-1]) < 0.05 * most


def test_a_block_is_pressed_by_a_rising_ground(comm: Any) -> None:
    """Static stages: the ground rises by a quarter of the height of a flat block that hangs from
    its top, and the work of the contact forces is the stored energy, by Simpson's rule."""
    problem = hang_block(comm, lengths=(2.0, 1.0), divisions=(8, 4), sides=False)
    system = problem.system
    surface = problem.surface
    times = [0.03 * k for k in range(1, 9)]
    forces = [0.0]
    for state in vc.quasi_static(problem, times):
        forces.append(float(surface.comm.sum(state.r_n.sum())))
        assert np.all(state.r_n >= 0.0)
    weights = np.array([1.0, 4.0, 2.0, 4.0, 2.0, 4.0, 2.0, 4.0, 1.0]) * 0.03 / 3.0
    work = weights @ np.array(forces)
    assert system.internal is not None
    u = problem.cartesian(state.u)
    assert system.internal.energy(u) == pytest.approx(work, rel=2e-3)


def solve_by_vi(mesh: Any, stages: tuple[float, ...]) -> Any:
    """The displacement [m] of a block that hangs from its top, on a floor at the last stage."""
    V = compat.lagrange(mesh, 1, (2,))
    u = compat.function(V)
    floor = compat.function(V)
    top = compat.entities_where(mesh, 1, lambda x: np.isclose(x[1], 2.0))
    held = dolfinx.fem.dirichletbc(np.zeros(2), compat.locate_blocks(V, top), V)
    below = compat.locate_blocks(V, compat.entities_where(mesh, 1, lambda x: x[0] == x[0]))
    floor.x.array[:] = -np.inf
    floor.x.array[2 * below + 1] = stages[-1] - V.tabulate_dof_coordinates()[below, 1]
    problem = vi.Problem(energy=RUBBER.energy(u), u=u, bcs=[held])
    problem.solve(lower=floor)
    return u


@pytest.mark.two_ranks
@pytest.mark.parametrize("stages", [(0.1, 0.2, 0.3), (0.3,)])
def test_a_barrel_is_pressed(comm: Any, stages: tuple[float, ...]) -> None:
    """A slender block with its sides in possible contact: without contact it would buckle, so that
    tangents are braced. The way does not change the end, which is that of ``vi.solve``."""
    problem = hang_block(comm, divisions=(8, 16))
    state = None
    for state in vc.quasi_static(problem, stages):
        assert state.certificate is not None and state.certificate <= 1e-9
    assert state is not None
    space: Any = problem.system.space
    u = solve_by_vi(space.mesh, stages)
    V = u.function_space
    theirs = u.x.array[: 2 * V.dofmap.index_map.size_local].reshape(-1, 2)
    ours = space.expand(problem.cartesian(state.u), state.t)
    assert np.allclose(V.tabulate_dof_coordinates()[: len(theirs), :2], space.points)
    assert np.abs(ours - theirs).max(initial=0.0) <= 1e-8


@pytest.mark.long
def test_the_ranks_do_not_change_the_answer(comm: Any) -> None:
    """Thrown with friction, to 1e-10 of the displacements."""
    ends = []
    for ranks in (comm, MPI.COMM_SELF):
        problem = throw_block(ranks, 4, friction=vc.Coulomb(0.3))
        stepper = vc.Stepper(problem, scheme=vc.Midpoint())
        for _ in range(60):
            stepper.accept(stepper.attempt(2e-3))
        assert problem.surface.some(stepper.state.active)
        ends.append(sort_by_place(problem, stepper.state)[:, 2:])
    assert np.abs(ends[0] - ends[1]).max() <= 1e-10 * np.abs(ends[1]).max()


@pytest.mark.slow
@pytest.mark.parametrize("friction", [vc.Frictionless(), vc.Coulomb(0.3)], ids=repr)
@pytest.mark.parametrize("solver", [vc.Volume(), vc.Iterative()], ids=repr)
def test_other_solvers_make_the_passes_too(comm: Any, solver: Any, friction: Any) -> None:
    """As Condensed does, to the tolerance of certificates over the steps."""
    problem = throw_block(comm, 2, friction=friction)
    ends = []
    for inner in (vc.Condensed(), solver):
        stepper = vc.Stepper(problem, scheme=vc.Midpoint(), solver=inner)
        for _ in range(45):
            stepper.accept(stepper.attempt(2e-3))
        assert problem.surface.some(stepper.state.active)
        ends.append(stepper.state.u)
    apart, size = problem.surface.comm.max(np.array([max_abs(ends[0] - ends[1]), max_abs(ends[0])]))
    assert apart <= 1e-7 * size


def test_von_mises_stresses_are_those_of_the_stress_form(comm: Any) -> None:
    """Of a uniform stretch: Cauchy's stress of neo-Hookean material by hand."""
    system, _ = block(comm, 2)
    stretch = np.array([1.2, 0.9])
    space: Any = system.space
    J = stretch.prod()
    along = RUBBER.mu / J * (stretch**2 - 1.0) + RUBBER.lame * np.log(J) / J
    sigma = np.array([*along, RUBBER.lame * np.log(J) / J])
    mises = np.sqrt(1.5 * np.sum((sigma - sigma.mean()) ** 2))
    found = VonMises(space.forms)(space.points * (stretch - 1.0))
    assert np.allclose(found, mises, rtol=1e-9)


def test_released_supports_leave_their_reactions(comm: Any) -> None:
    """Pressed on ground, then let go at the top: the reactions of the top hold it at rest."""
    pressed = hang_block(comm, lengths=(2.0, 1.0), divisions=(4, 2), sides=False)
    static = replace(pressed, surface=pressed.surface.moving(towards=lambda t: t))
    (state,) = vc.quasi_static(static, [0.1])
    mesh = pressed.system.space.mesh  # type: ignore[attr-defined]
    free = fem.assemble(mesh, forms=RUBBER.make_forms(), quadrature_degree=3)
    bottom = fem.Facets.where("bottom", mesh, lambda x: np.isclose(x[1], 0.0))
    ground = vc.HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    surface = fem.contact_surface(free, bottom, obstacle=ground)
    problem = vc.ContactProblem(free, surface.moving(towards=lambda t: 0.1 + 0.0 * t))
    problem, first = fem.release(static, state, problem)
    for report in vc.march(problem, scheme=vc.Midpoint(), dt=1e-3, steps=5, state=first):
        state = report[0]
    off, size = surface.comm.max(np.array([max_abs(state.u - first.u), max_abs(first.u)]))
    assert off <= 1e-9 * size


@pytest.mark.serial
@pytest.mark.long
@pytest.mark.promise("guide/nonlinear.md", "keeps 99 % of its energy over five turns", bound="0.99")
def test_a_block_spins(comm: Any) -> None:
    """Once a second, by HHT in 60 steps a turn, far above the ground."""
    stiff = Rubber(E=1e7)
    rate = 2.0 * np.pi
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(0.5, 1.0), divisions=(2, 4)), comm)
    system = fem.assemble(
        mesh,
        forms=stiff.make_forms(),
        quadrature_degree=3,
        initial_velocity=lambda x: rate * np.column_stack([0.5 - x[:, 1], x[:, 0] - 0.25]),
    )
    below = vc.HalfSpace(point=(0.0, -50.0), normal=(0.0, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=below)
    stepper = vc.Stepper(vc.ContactProblem(system, surface), scheme=vc.HHT(-0.05))
    ledger = vc.Energy()
    row = ledger.start(stepper.method.problem, stepper.state)
    start = row["energy_kinetic"]
    for _ in range(300):
        trial = stepper.attempt(1.0 / 60.0)
        row = ledger.row(trial.report)
        stepper.accept(trial)
    kept = (row["energy_kinetic"] + row["energy_strain"]) / start
    assert 0.99 <= kept <= 1.0
    assert abs(row["energy_defect"]) <= 1e-9 * start


@pytest.mark.serial
def test_what_takes_linear_forces_is_refused() -> None:
    """In a sentence that says what to do instead."""
    problem = throw_block(MPI.COMM_SELF, 2)
    system, tags = block(MPI.COMM_SELF, 2)
    cut = vc.SectionForces({"middle": ((0.0, 1.0), (1.0, 1.0))})
    with pytest.raises(InputError, match="knows linear bodies only"):
        vc.simulate(problem, dt=1e-3, steps=1, record=[cut], progress=False)
    moved = fem.Prescribed(tags["top"], lambda x, t: t * x)
    mesh = system.space.mesh  # type: ignore[attr-defined]
    with pytest.raises(InputError, match="does not go with supports that move"):
        fem.assemble(mesh, forms=RUBBER.make_forms(), prescribed=moved)
    shake = vc.Harmonic(1.0, 2.0)
    with pytest.raises(InputError, match="marched beside the run"):
        fem.assemble(
            mesh,
            vc.LinearElastic(E=RUBBER.E, nu=RUBBER.nu, rho=RUBBER.rho),
            forms=RUBBER.make_forms(),
            clamped=tags["bottom"],
            dashpots=[soil.FreeField(tags["left"], base=shake)],
        )


@pytest.mark.serial
def test_forms_that_are_none_are_refused() -> None:
    mass = RUBBER.inertia
    for given, sentence in (
        ({"mass": mass, "internal": RUBBER.internal}, "belong together"),
        ({"mass": mass}, "give stiffness=, the form of K, or internal="),
    ):
        with pytest.raises(InputError, match=sentence):
            fem.Forms(**given)
    mesh, _ = fem.build_mesh(BlockMesh(lengths=(1.0, 2.0), divisions=(2, 4)), MPI.COMM_SELF)
    wrong = fem.Forms(mass=mass, internal=lambda u, v: RUBBER.energy(u), energy=RUBBER.energy)
    with pytest.raises(InputError, match="is not a form in the given trial and test functions"):
        fem.assemble(mesh, forms=wrong)


@pytest.mark.two_ranks
def test_two_blocks_strike(comm: Any) -> None:
    """Forces are taken in unknowns relative to the other body: certificates and ledger say so, and
    the momentum of both is kept."""
    half = BlockMesh(lengths=(1.0, 0.5), divisions=(6, 3))
    both = TwoBlocks(lower=half, upper=half, gap=0.01)
    mesh, tags = fem.build_mesh(both, comm)

    def velocity(x: np.ndarray) -> np.ndarray:
        """The upper one falls on the other."""
        down = np.where(x[:, 1] > 0.505, -4.0, 0.0)
        return np.column_stack([0.0 * down, down])

    system = fem.assemble(
        mesh, forms=RUBBER.make_forms(), quadrature_degree=3, initial_velocity=velocity
    )
    surface = fem.contact_pair(system, tags["upper_bottom"], tags["lower_top"])
    problem = vc.ContactProblem(system, surface)
    stepper = vc.Stepper(problem, scheme=vc.Midpoint())
    ledger = vc.Energy()
    row = ledger.start(stepper.method.problem, stepper.state)
    start = row["energy_kinetic"]
    closed = 0
    for _ in range(40):
        trial = stepper.attempt(5e-4)
        row = ledger.row(trial.report)
        stepper.accept(trial)
        closed += surface.some(trial.state.active)
        assert trial.report.certificate.worst <= 1e-9
    assert closed >= 10
    assert row["energy_strain"] > 0.01 * start
    assert abs(row["energy_defect"]) <= 1e-9 * start
    v = problem.cartesian(stepper.state.v)
    momentum = total(system.algebra.comm, system.influence[:, 1] @ (system.M @ v))
    assert momentum == pytest.approx(
        total(system.algebra.comm, system.influence[:, 1] @ (system.M @ system.v0)), rel=1e-9
    )
