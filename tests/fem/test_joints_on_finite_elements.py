"""Joints on meshes: a dam block that cracks, a rupture along a fault, and the same on all ranks."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from fault import DISTANCE, HALF, KINETIC, NU, SHEAR, SIGMA, fault
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem, laws
from vi_contact.core.errors import InputError
from vi_contact.meshes import BlockMesh
from vi_contact.run.joint_elements import joint_warning

MIDPOINT = vc.ZienkiewiczWoodTaylor()
STONE = vc.LinearElastic(E=2e10, nu=0.2, rho=2400.0)


def block(comm: Any, joint: Any, cells: tuple[int, int] = (12, 15)) -> vc.ContactProblem:
    """A block 16 m wide and 40 m high, pushed at its upper left corner region until its heel
    opens; the push grows over one second."""
    import dolfinx

    shape = dolfinx.mesh.CellType.quadrilateral
    mesh = dolfinx.mesh.create_rectangle(comm, [[0.0, 0.0], [16.0, 40.0]], cells, shape)
    base = fem.Facets.where("base", mesh, lambda x: np.isclose(x[1], 0.0))
    face = fem.Facets.where("face", mesh, lambda x: np.isclose(x[0], 0.0))
    push = fem.Traction(face, (1.1e5, 0.0), history=lambda t: min(t, 1.0) ** 2)
    system = fem.assemble(
        mesh,
        STONE,
        loads=[fem.BodyForce((0.0, -24000.0)), push],
        damping=vc.Rayleigh(alpha=0.0, beta=2e-3),
    )
    surface = fem.contact_surface(system, base)
    return vc.ContactProblem(system, surface, joint=joint, mass=vc.ConsistentMass())


def march_block(comm: Any, joint: Any, solver: Any = None, **others: Any) -> Any:
    problem = block(comm, joint, **others)
    rest = vc.static_equilibrium(problem, tolerance=1e-7)
    return vc.simulate(
        problem,
        scheme=MIDPOINT,
        solver=solver or vc.Condensed(),
        dt=8e-3,
        t_end=1.2,
        state=rest,
        progress=False,
    )


BASE = laws.Joint(mu=1.0, cohesion=6e5, tension=2e5, opening=1e-4)


def sum_of_parts(history: Any) -> Any:
    """The parts of the joint's work that make the columns of contact and friction."""
    losses = ("loss_fracture", "loss_rubbing", "loss_closing", "loss_dilatancy")
    works = ("work_joint_water", "work_prestress")
    total = history["energy_joint"] - history["energy_joint"][0]
    total = total + sum(history[name] for name in losses)
    return total - sum(history[name] for name in works)


# three ranks take the last, which sends fewer messages
SOLVERS = {"Iterative": vc.Iterative(), "Condensed": vc.Condensed()}


@cache
def crack_base(solver: str, alone: bool = False) -> Any:
    """The run of the block whose base cracks, on all ranks or on each rank alone."""
    return march_block(MPI.COMM_SELF if alone else MPI.COMM_WORLD, BASE, SOLVERS[solver])


@pytest.mark.long
@pytest.mark.two_ranks
@pytest.mark.parametrize("solver", SOLVERS)
def test_the_base_of_a_block_cracks(solver: str) -> None:
    """All steps certified with their strength, the ledger closes, and its parts add up; half of the
    base loses its strength, and what it takes is ½ f_t kappa up to dc."""
    run = crack_base(solver)
    surface = run.problem.surface
    kappa = surface.everywhere(run.state.memory["joint_kappa"])
    weights = surface.everywhere(surface.weights)
    lost = np.sum(weights[kappa >= 1e-4])
    assert 3.0 < lost < 14.0
    largest = np.max(np.abs(run.history["loss_contact"]))
    assert run.history["certificate"].max() < 1e-9
    assert np.max(np.abs(run.history["energy_defect"])) < 1e-7 * run.history["work_input"].max()
    both = run.history["loss_contact"] + run.history["loss_friction"]
    assert np.max(np.abs(sum_of_parts(run.history) - both)) < 1e-6 * largest
    opened = surface.everywhere(run.state.memory["joint_opened"])
    taken = np.sum(weights * 0.5 * 2e5 * np.minimum(opened, 1e-4))
    assert run.history["loss_fracture"][-1] == pytest.approx(taken, rel=0.05)


@pytest.mark.long
def test_elements_that_are_too_long_for_the_joint_are_told(comm: Any) -> None:
    """E dc/(4 f_t) is 2.5 m and 0.5 m, and elements are 4/3 m; of the fault, a third of
    mu* dc/(sigma (mu_s - mu_d)) is 390 m, and its barriers, which hold, are left out."""
    assert joint_warning(block(comm, BASE)) is None
    said = joint_warning(block(comm, replace(BASE, opening=2e-5)))
    assert said is not None
    assert "elements of 1.33 m at the joint are longer than E G_f/(2 f_t²) = 0.5 m" in said
    assert joint_warning(block(comm, laws.Joint(tension=1e5, cohesion=1e5, energy=1.0))) is not None
    assert joint_warning(block(comm, replace(BASE, opening=None, softening="brittle"))) is None
    said = joint_warning(fault(comm, 500.0))
    assert said is not None
    shear = SHEAR / (1.0 - NU)
    assert f"= {shear * DISTANCE / (3.0 * SIGMA * (0.677 - KINETIC)):.3g} m" in said
    assert joint_warning(fault(comm, 250.0)) is None


@pytest.mark.parametrize("solver", SOLVERS)
def test_ranks_change_nothing(solver: str) -> None:
    """The crack of one rank, to round-off."""
    if MPI.COMM_WORLD.size == 1:
        pytest.skip("compares several ranks with one")
    runs = [crack_base(solver, alone) for alone in (False, True)]
    of_all = []
    for run in runs:
        surface = run.problem.surface
        x = surface.everywhere(surface.points[:, 0])
        kappa = surface.everywhere(run.state.memory["joint_kappa"])
        of_all.append(kappa[np.argsort(x)])
    tolerance = 1e-10 if solver == "Condensed" else 1e-6
    assert np.max(np.abs(of_all[0] - of_all[1])) <= tolerance * np.max(of_all[1])
    for name in ("loss_fracture", "energy_joint", "loss_contact"):
        ours, alone = (run.history[name] for run in runs)
        assert np.max(np.abs(ours - alone)) <= 10.0 * tolerance * np.max(np.abs(alone)), name


@pytest.mark.long
@pytest.mark.two_ranks
def test_a_restart_on_these_ranks_is_the_straight_run(comm: Any, shared_tmp: Any) -> None:
    """Committed arrays are stored by the numbers of the conditions."""
    problem = block(comm, BASE)
    rest = vc.static_equilibrium(problem, tolerance=1e-7)

    def run(steps: int, **others: Any) -> Any:
        return vc.simulate(
            problem,
            scheme=MIDPOINT,
            solver=vc.Condensed(),
            dt=8e-3,
            steps=steps,
            progress=False,
            **others,
        )

    straight = run(140, state=rest)
    run(125, state=rest, out=shared_tmp)
    again = run(140, out=shared_tmp, restart=True)
    for name in ("joint_kappa", "joint_opened", "joint_way"):
        kept = again.state.memory[name]
        assert np.max(np.abs(kept - straight.state.memory[name]), initial=0.0) <= 1e-12
    assert again.history["loss_fracture"][-1] == pytest.approx(
        straight.history["loss_fracture"][-1], rel=1e-10
    )


def test_values_by_functions_and_tables_are_the_same(comm: Any) -> None:
    """A joint that is weak on the left: as f(points), and as one number per point."""
    weak = lambda x: np.where(x[:, 0] < 8.0, 1e5, 2e5)  # noqa: E731
    first = block(comm, replace(BASE, tension=weak))
    surface = first.surface
    table = tuple(surface.everywhere(weak(surface.points)).tolist())
    # on the same mesh: a graph partition may cut an equal one in another way
    second = replace(first, joint=replace(BASE, tension=table))
    assert first.joint == second.joint
    with pytest.raises(InputError, match=r"tension returns .* for \d+ points"):
        block(comm, replace(BASE, tension=lambda x: np.ones(len(x) + 1)))


@pytest.mark.long
@pytest.mark.serial
def test_dilatancy_lifts_what_slides(comm: Any) -> None:
    """A block pushed over its base rises by tan(psi) times the slip, and the parts add up."""
    joint = laws.Joint(mu=0.2, dilatancy=0.1)
    run = march_block(comm, joint, cells=(4, 4))
    surface = run.problem.surface
    way = run.state.memory["joint_way"]
    assert way.min() > 1e-3
    before = 0.1 * way  # the lift of the last step is made in the next one
    gap = surface.gap(run.state.t) - surface.normal_values(run.state.u)
    closed = run.state.active
    assert closed.any()
    assert np.max(np.abs(gap - run.state.memory["joint_raised"])[closed]) < 1e-12
    assert np.all(run.state.memory["joint_raised"] <= before)
    both = run.history["loss_contact"] + run.history["loss_friction"]
    assert np.max(np.abs(sum_of_parts(run.history) - both)) < 1e-7 * np.max(np.abs(both))
    assert run.history["loss_dilatancy"][-1] < 0.0


@pytest.mark.long
@pytest.mark.serial  # ranks: the block whose base cracks
def test_mixed_mode_loses_both_strengths(comm: Any) -> None:
    """A block that is pushed over a joint without friction loses its cohesion and its tension."""
    joint = laws.Joint(cohesion=1e5, tension=1e5, energy=50.0)
    run = march_block(comm, joint, cells=(4, 4))
    surface = run.problem.surface
    kappa = surface.everywhere(run.state.memory["joint_kappa"])
    assert kappa.min() > 2.0 * 50.0 / 1e5
    assert run.history["certificate"].max() < 1e-9
    # Work of the cohesion on the way: what is left is zero, G_f a metre of width and depth.
    rubbed = run.history["loss_rubbing"][-1] + run.history["loss_fracture"][-1]
    assert rubbed == pytest.approx(50.0 * 16.0, rel=0.05)


@pytest.mark.long
@pytest.mark.serial
def test_a_rupture_runs_along_a_fault(comm: Any) -> None:
    """h = 500 m: arrival at 9 km at 2.563 s as an independent program has it on this mesh; the work
    of friction is heat and fracture energy to round-off."""
    problem = fault(comm, 500.0)
    surface = problem.surface
    stepper = vc.Stepper(problem, scheme=MIDPOINT, solver=vc.Condensed())
    recorders = [vc.Energy(), vc.JointEnergy()]
    for recorder in recorders:
        recorder.start(stepper.method.problem, stepper.state)
    dt = 0.5 * 500.0 / 6000.0
    before = np.zeros(surface.count)
    arrival = np.full(surface.count, np.nan)
    row: dict[str, float] = {}
    while stepper.state.t < 2.7:
        old = stepper.state
        trial = stepper.attempt(dt)
        new = stepper.accept(trial)
        for recorder in recorders:
            row |= recorder.row(trial.report)
        assert trial.report.certificate.worst < 1e-9
        rate = np.abs(surface.tangential_values(new.u - old.u)[:, 0]) / dt
        fresh = np.isnan(arrival) & (rate > 1e-3)
        part = np.clip((1e-3 - before) / np.maximum(rate - before, 1e-300) - 0.5, -0.5, 0.5)
        arrival[fresh] = (old.t + dt * part)[fresh]
        before = rate
    x = surface.points[:, 0] - HALF
    order = np.argsort(x)
    for place in (-9000.0, 9000.0):
        at = float(np.interp(place, x[order], arrival[order]))
        assert at == pytest.approx(2.563, abs=2e-3)
    way = new.memory["joint_way"]
    short = np.minimum(way, DISTANCE)
    fracture = SIGMA * (0.677 - KINETIC) * short * (1.0 - 0.5 * short / DISTANCE)
    work = np.where(np.abs(x) < 10e3, SIGMA * KINETIC * way + fracture, 0.0)
    assert row["loss_rubbing"] == pytest.approx(np.sum(surface.weights * work), rel=1e-7)
    both = row["loss_contact"] + row["loss_friction"]
    assert row["loss_rubbing"] - row["work_prestress"] == pytest.approx(both, rel=1e-9)


@pytest.mark.long
@pytest.mark.serial
@pytest.mark.parametrize(
    "joint",
    [
        laws.Joint(mu=0.6, cohesion=2e5, tension=1e5, energy=20.0),
        laws.SlipWeakening(static=0.6, kinetic=0.3, distance=2e-3),
    ],
    ids=lambda joint: type(joint).__name__,
)
def test_a_block_in_space_breaks_loose(comm: Any, joint: Any) -> None:
    """Pushed along both tangents: certified, the ledger closed, and the same by both solvers."""
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(4.0,) * 3, divisions=(3,) * 3), comm)
    push = fem.Traction(tags["left"], (3e5, 0.0, 1.5e5), history=lambda t: min(t / 0.1, 1.0) ** 2)
    system = fem.assemble(
        mesh,
        vc.LinearElastic(E=1e10, nu=0.2, rho=2400.0),
        loads=[fem.BodyForce((0.0, -24000.0, 0.0)), push],
        damping=vc.Rayleigh(alpha=0.0, beta=1e-3),
    )
    surface = fem.contact_surface(system, tags["bottom"])
    problem = vc.ContactProblem(system, surface, joint=joint, mass=vc.ConsistentMass())
    rest = vc.static_equilibrium(problem, tolerance=1e-7)
    rubbed = []
    for solver in (vc.Condensed(), vc.Iterative()):
        run = vc.simulate(
            problem,
            scheme=MIDPOINT,
            solver=solver,
            dt=2e-3,
            t_end=0.14,
            state=rest,
            progress=False,
        )
        history = run.history
        assert history["certificate"].max() < 1e-9
        assert np.abs(history["energy_defect"]).max() < 1e-9 * history["work_input"].max()
        assert run.state.memory["joint_way"].min() > 2e-3
        both = history["loss_contact"] + history["loss_friction"]
        assert np.abs(sum_of_parts(history) - both).max() < 1e-9 * np.abs(both).max()
        rubbed.append(history["loss_rubbing"][-1])
    assert rubbed[1] == pytest.approx(rubbed[0], rel=1e-7)


@pytest.mark.long
@pytest.mark.serial
def test_mortar_and_node_to_node_rupture_alike(comm: Any) -> None:
    """The largest slip on matching meshes, which the two take from the same forces, to 1e-9."""
    slips = []
    for matching in (fem.NodeToNode(), fem.DualMortar()):
        problem = fault(comm, 1000.0, matching)
        stepper = vc.Stepper(problem, scheme=MIDPOINT, solver=vc.Condensed())
        for _ in range(20):
            trial = stepper.attempt(0.08)
            assert trial.report.certificate.worst < 1e-9
            stepper.accept(trial)
        slips.append(stepper.state.memory["joint_way"].max())
    assert slips[1] == pytest.approx(slips[0], rel=1e-9)


@pytest.mark.serial
@pytest.mark.parametrize("creep", [1e-6, 1e-12])
def test_rate_and_state_on_a_fault(comm: Any, creep: float) -> None:
    """A fault that creeps, or hardly moves, is pushed harder in its middle: all points are solved
    together in two passes, also where slips are as small as rounding; friction is what the law
    says at the rates."""
    law = laws.RateAndState(
        a=0.012,
        b=lambda x: np.where(np.abs(x[:, 0] - HALF) < 10e3, 0.016, 0.008),
        mu0=0.6,
        V0=1e-6,
        dc=0.02,
        theta=0.02 / creep,
        speed=creep,
        prestress=laws.Prestress(
            normal=SIGMA,
            shear=lambda x: 75e6 + 6e6 * np.exp(-(((x[:, 0] - HALF) / 1500.0) ** 2)),
        ),
    )
    problem = replace(fault(comm, 1000.0), joint=law)
    stepper = vc.Stepper(problem, scheme=MIDPOINT, solver=vc.Condensed())
    recorders = [vc.Energy(), vc.JointEnergy()]
    row: dict[str, float] = {}
    for recorder in recorders:
        row |= recorder.start(stepper.method.problem, stepper.state)
    for _ in range(40):
        before = stepper.state
        trial = stepper.attempt(0.02)
        state = stepper.accept(trial)
        assert trial.report.certificate.worst < 1e-9
        for recorder in recorders:
            row |= recorder.row(trial.report)
    assert np.mean(stepper.joints[0.02].passes) < 3.0
    surface = problem.surface
    committed = {name: before.memory[f"joint_{name}"] for name in ("theta", "speed")}
    speed = state.memory["joint_speed"]
    mu, _ = problem.joint.at_speed(committed, speed, 0.02)
    assert np.allclose(np.abs(state.r_t[:, 0]), mu * state.r_n, rtol=1e-9)
    slip = np.abs(surface.tangential_values(state.u - before.u)[:, 0])
    # The prestress alone would move a point by 6 mm in a step, whose rounding the slip has.
    assert np.allclose(slip, 0.02 * speed, rtol=1e-6, atol=1e-14)
    both = row["loss_contact"] + row["loss_friction"]
    parts = row["loss_rubbing"] + row["loss_closing"] - row["work_prestress"]
    assert parts == pytest.approx(both, abs=1e-8 * row["loss_rubbing"])
