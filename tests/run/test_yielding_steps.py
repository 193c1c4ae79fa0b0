"""Bodies that yield through the certified step: thrown on rough ground, halved, stopped and gone on
with, on any ranks, and at rest."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from yielding_cases import LAWS, SOIL, STEEL, step_of, throw

import vi_contact as vc
from vi_contact import fem, soil
from vi_contact.core.algebra import largest
from vi_contact.core.errors import InputError, StepFailure
from vi_contact.core.internal import MATERIAL
from vi_contact.core.surfaces import empty_surface
from vi_contact.laws import J2, ConsistentMass, Iwan, MohrCoulomb
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import TwoBlocks
from vi_contact.schemes import SS22, Houbolt, MoreauJean
from vi_contact.solvers import Iterative, Volume

ROUND = ("certificate", "energy_defect", "loss_algorithmic", "iterations")


def run(problem: Any, law: str, steps: int = 40, **more: Any) -> Any:
    """A history of the thrown block."""
    given: dict[str, Any] = {
        "solver": vc.Condensed(),
        "record": [vc.Energy(), vc.Contact()],
        "progress": False,
        "dt": step_of(law),
        **more,
    }
    return vc.simulate(problem, steps=steps, **given)


@pytest.mark.long
@pytest.mark.parametrize("law", LAWS)
def test_a_block_is_thrown(comm: Any, law: str) -> None:
    """Every step is certified, the law of the material too; the ledger closes by formulas of their
    own; plastic work only grows."""
    few = comm.size > 1  # a step sends many small messages
    found = run(throw(comm, law), law, steps=6 if few else 25)
    assert found.facts["worst_certificate"] <= 1e-9
    assert found.facts["energy_defect"] <= 1e-9
    if comm.rank == 0:
        history = found.history
        start = history["energy_kinetic"][0]
        assert history["loss_plastic"][-1] > (0.01 if few else 0.1) * start
        assert np.all(np.diff(history["loss_plastic"]) >= 0.0)
        assert history["loss_friction"][-1] > (0.0 if few else 0.005) * start
        assert abs(history["loss_algorithmic"][-1]) < 0.15 * start
        assert history["iterations"].mean() <= 25.0


@pytest.mark.long
@pytest.mark.two_ranks
@pytest.mark.parametrize("solver", [Volume(), Iterative()], ids=repr)
def test_solvers_agree(comm: Any, solver: Any) -> None:
    steps = 6 if comm.size > 1 else 25
    first = run(throw(comm, "J2"), "J2", steps=steps)
    other = run(throw(comm, "J2"), "J2", steps=steps, solver=solver)
    size = largest(comm_of(first), np.abs(first.state.u).max())
    off = largest(comm_of(first), np.abs(first.state.u - other.state.u).max())
    assert off <= 1e-7 * size


def comm_of(found: Any) -> Any:
    """The ranks of a solution."""
    return found.problem.surface.comm


@pytest.mark.serial
@pytest.mark.parametrize(
    "scheme",
    [
        vc.Midpoint(),
        vc.ZienkiewiczWoodTaylor(0.7),
        vc.Trapezoidal(mass=ConsistentMass()),
        vc.HHT(-0.1),
        vc.GeneralisedAlpha.spectral_radius(0.8),
        vc.Newmark(0.3025, 0.6),
    ],
    ids=repr,
)
def test_schemes_close_the_ledger(comm: Any, scheme: Any) -> None:
    """Each takes the stress at the ends of its steps, with weights of its own; a body in free
    flight that rings."""
    mesh, _ = fem.build_mesh(BlockMesh(lengths=(0.5, 1.0), divisions=(3, 6)), comm)
    ringing = fem.assemble(
        mesh,
        STEEL,
        integration="bbar",
        initial_velocity=lambda x: np.stack([0.0 * x[:, 0], 40.0 * (x[:, 1] - 0.5)], axis=1),
    )
    surface = empty_surface(ringing.space.comm, 2)
    problem = vc.ContactProblem(ringing, surface, mass=ConsistentMass())
    found = run(problem, "J2", scheme=scheme, record=[vc.Energy()])
    assert found.facts["worst_certificate"] <= 1e-9
    assert found.facts["energy_defect"] <= 1e-10
    assert found.history["loss_plastic"][-1] > 0.05 * found.history["energy_kinetic"][0]


@pytest.mark.serial
@pytest.mark.parametrize(
    "scheme", [SS22(), MoreauJean(), vc.ContactStabilisedNewmark(), Houbolt()], ids=repr
)
def test_schemes_that_take_other_stresses_are_refused(comm: Any, scheme: Any) -> None:
    with pytest.raises(InputError, match="take Midpoint"):
        run(throw(comm), "J2", scheme=scheme)


@pytest.mark.long
@pytest.mark.serial
def test_the_loss_of_the_mean_of_both_ends_is_of_second_order(comm: Any) -> None:
    """Smooth yielding of a body that rings: the algorithmic loss of a fixed time falls by four
    where steps are halved."""
    losses = []
    for parts in (1, 2, 4):
        mesh, _ = fem.build_mesh(BlockMesh(lengths=(0.5, 1.0), divisions=(2, 4)), comm)
        system = fem.assemble(
            mesh,
            STEEL,
            integration="bbar",
            initial_velocity=lambda x: np.stack([0.0 * x[:, 0], 40.0 * (x[:, 1] - 0.5)], axis=1),
        )
        problem = vc.ContactProblem(system, empty_surface(system.space.comm, 2))
        found = run(
            problem,
            "J2",
            steps=24 * parts,
            dt=2e-5 / parts,
            scheme=vc.Midpoint(),
            record=[vc.Energy()],
        )
        losses.append(abs(found.history["loss_algorithmic"][-1]))
    assert losses[0] / losses[2] >= 6.0


@pytest.mark.long
@pytest.mark.serial
def test_what_is_thrown_away_leaves_no_trace(comm: Any) -> None:
    """Attempts of other lengths between accepted steps change nothing, to the last bit; nor do
    questions to the force."""
    problem = throw(comm)
    dt = step_of("J2")
    plain = vc.Stepper(problem, scheme=vc.Midpoint(), solver=vc.Condensed())
    busy = vc.Stepper(problem, scheme=vc.Midpoint(), solver=vc.Condensed())
    for _ in range(12):
        plain.accept(plain.attempt(dt))
        for part in (0.5, 2.0):
            report = busy.attempt(part * dt).report
            report.problem.equations.internal.energy(2.0 * report.new.u)
        busy.accept(busy.attempt(dt))
    assert np.array_equal(plain.state.u, busy.state.u)
    names = [name for name in plain.state.memory if name.startswith(MATERIAL)]
    assert len(names) == 3
    for name in names:
        assert np.array_equal(plain.state.memory[name], busy.state.memory[name])


@pytest.mark.long
@pytest.mark.serial
def test_halved_steps_are_those_of_a_plan_of_halves(comm: Any) -> None:
    """A base step that is halved at an impact is thrown away; its halves go on from where it
    began."""
    problem = throw(comm)
    dt = step_of("J2")
    halved = list(
        vc.march(
            problem,
            scheme=vc.Midpoint(),
            solver=vc.Condensed(),
            dt=vc.HalvedAtImpact(dt, 2),
            steps=10,
        )
    )
    lengths = np.diff([0.0, *[state.t for state, _ in halved]])
    assert lengths.min() < 0.9 * dt
    stepper = vc.Stepper(problem, scheme=vc.Midpoint(), solver=vc.Condensed())
    for length, (state, _) in zip(lengths, halved, strict=True):
        exact = dt * round(length / dt * 4) / 4
        stepper.accept(stepper.attempt(exact))
        assert np.abs(stepper.state.u - state.u).max() <= 1e-12 * np.abs(state.u).max()


@pytest.mark.long
@pytest.mark.serial
@pytest.mark.parametrize("law", ["J2", "Iwan"])
def test_a_restart_is_the_straight_run(comm: Any, tmp_path: Path, law: str) -> None:
    """To the last bit: what materials remember is in the checkpoint."""
    problem = throw(comm, law)
    straight = run(problem, law)
    run(problem, law, steps=17, out=tmp_path)
    again = run(problem, law, out=tmp_path, restart=True)
    assert np.array_equal(again.state.u, straight.state.u)
    for name, values in straight.state.memory.items():
        assert np.array_equal(again.state.memory[name], values), name
    assert np.array_equal(again.history["loss_plastic"], straight.history["loss_plastic"])


@pytest.mark.long
def test_restart_on_another_number_of_ranks(comm: Any, shared_tmp: Path) -> None:
    """A checkpoint of one rank goes on on all of them, and one of all of them on one."""
    from mpi4py import MPI

    alone = run(throw(MPI.COMM_SELF), "J2", steps=9)
    if comm.rank == 0:
        run(throw(MPI.COMM_SELF), "J2", steps=5, out=shared_tmp / "one")
    comm.Barrier()
    spread = run(throw(comm), "J2", steps=9, out=shared_tmp / "one", restart=True)
    run(throw(comm), "J2", steps=5, out=shared_tmp / "all")
    gathered = run(throw(MPI.COMM_SELF), "J2", steps=9, restart=shared_tmp / "all")
    for name, values in alone.history.items():
        if name in ROUND:
            continue
        size = np.nanmax(np.abs(values)) or 1.0
        for other in (spread, gathered):
            assert np.allclose(
                other.history[name], values, rtol=0.0, atol=1e-8 * size, equal_nan=True
            ), name


@pytest.mark.long
@pytest.mark.serial
def test_a_checkpoint_of_other_materials_is_refused(comm: Any, tmp_path: Path) -> None:
    run(throw(comm, "J2"), "J2", steps=5, out=tmp_path)
    with pytest.raises(InputError, match="restart the same run"):
        run(throw(comm, "MohrCoulomb"), "J2", out=tmp_path, restart=True)
    with pytest.raises(InputError, match="remembers other materials"):
        run(throw(comm, "MohrCoulomb"), "J2", out=tmp_path, restart=True, changed=True)
    run(throw(comm, "J2"), "J2", out=tmp_path, restart=True, changed=True, dt=0.5 * step_of("J2"))


@pytest.mark.long
@pytest.mark.serial
def test_another_length_of_steps_keeps_what_materials_remember(comm: Any, tmp_path: Path) -> None:
    """A changed dt makes schemes begin anew; the body stays deformed, as a stepper shows."""
    problem = throw(comm)
    dt = step_of("J2")
    run(problem, "J2", steps=10, out=tmp_path)
    changed = run(problem, "J2", steps=20, out=tmp_path, restart=True, changed=True, dt=0.5 * dt)
    stepper = vc.Stepper(problem, solver=vc.Condensed())
    for length in (*[dt] * 10, *[0.5 * dt] * 20):
        stepper.accept(stepper.attempt(length))
    steps_gone = changed.state.k - 10
    assert steps_gone >= 10
    if steps_gone == 20:
        size = np.abs(stepper.state.u).max()
        assert np.abs(stepper.state.u - changed.state.u).max() <= 1e-9 * size


class Wrong(MohrCoulomb):
    """A law whose return misses the surface by a part in a thousand."""

    def stress(self, de: Any, old: Any, tangent: bool = True) -> Any:
        new, D = super().stress(de, old, tangent)
        yields = new["alpha"] > old["alpha"]
        factor = np.where(yields, 1.001, 1.0)[:, None]
        return {**new, "sigma": factor * new["sigma"]}, D


class Boasting(J2):
    """A law that tells a tenth too much of what it dissipates."""

    def dissipation(self, de: Any, old: Any, new: Any) -> Any:
        return 1.1 * super().dissipation(de, old, new)


class Forgetful(J2):
    """A law that leaves out what a step of finite size has beyond W and D."""

    def remainder(self, old: Any, new: Any) -> Any:
        return np.zeros(len(new["sigma"]))


def column(
    comm: Any, law: Any, *, weight: bool = True, n: int = 6, mesh: Any = None
) -> vc.ContactProblem:
    """Ground 1 m wide and 3 m high between smooth walls, under its own weight."""
    if mesh is None:
        mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 3.0), divisions=(2, n)), comm)
    else:
        mesh, tags = mesh
    smooth = [fem.Prescribed(tags[side], components=(0,)) for side in ("left", "right")]
    system = fem.assemble(
        mesh,
        law,
        integration="bbar",
        prescribed=[*smooth, fem.Prescribed(tags["bottom"], components=(1,))],
        loads=fem.BodyForce((0.0, -9.81 * law.rho)) if weight else (),
    )
    return vc.ContactProblem(system, empty_surface(system.space.comm, 2))


@pytest.mark.serial
def test_a_law_that_is_wrong_gets_no_certificate(comm: Any) -> None:
    wrong = Wrong(1e8, 0.2, 2000.0, 0.0, 30.0, 0.0)
    with pytest.raises(StepFailure, match="the law of a material is not satisfied"):
        vc.static_equilibrium(column(comm, wrong))


@pytest.mark.serial
@pytest.mark.parametrize("kind", [Boasting, Forgetful])
def test_the_ledger_tells_wrong_terms(comm: Any, kind: Any) -> None:
    """No term is what the others leave, so that a wrong one shows in the defect."""
    wrong = kind(200e9, 0.3, 7800.0, 250e6, isotropic=2e9)
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(0.5, 1.0), divisions=(2, 4)), comm)
    system = fem.assemble(mesh, wrong, integration="bbar", initial_velocity=(0.0, -20.0))
    ground = vc.HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=ground)
    found = run(vc.ContactProblem(system, surface), "J2", steps=20)
    assert found.facts["energy_defect"] > 1e-3


@pytest.mark.parametrize(("nu", "ratio"), [(0.2, 1.0 / 3.0), (0.3, 0.3 / 0.7)])
def test_ground_yields_under_its_own_weight(comm: Any, nu: float, ratio: float) -> None:
    """Sand of 30 degrees between walls: where the elastic ratio nu/(1 - nu) is below Ka = 1/3 the
    stage leaves Ka, else the elastic ratio."""
    state = vc.static_equilibrium(column(comm, MohrCoulomb(1e8, nu, 2000.0, 0.0, 30.0, 0.0)))
    sigma = state.memory["material_0_sigma"]
    assert state.certificate is not None and state.certificate <= 1e-9
    assert np.abs(sigma[..., 0] / sigma[..., 1] - ratio).max(initial=0.0) <= 1e-9


@pytest.mark.serial
def test_a_stage_hands_its_stresses_to_the_run(comm: Any) -> None:
    """Ground at rest under its weight stays at rest when it is marched."""
    problem = column(comm, MohrCoulomb(1e8, 0.2, 2000.0, 0.0, 30.0, 0.0))
    state = vc.static_equilibrium(problem)
    found = vc.simulate(
        problem, state=state, dt=1e-3, steps=20, record=[vc.Energy()], progress=False
    )
    assert np.abs(found.state.u - state.u).max() <= 1e-10 * np.abs(state.u).max()
    assert found.history["energy_strain"][0] == pytest.approx(
        problem.standing_at(state).equations.internal.energy(state.u), rel=1e-12
    )


@pytest.mark.serial
def test_damping_is_of_the_elastic_stiffness(comm: Any) -> None:
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 1.0), divisions=(2, 2)), comm)
    system = fem.assemble(
        mesh, SOIL, integration="bbar", clamped=tags["bottom"], damping=vc.Rayleigh(0.0, 2e-3)
    )
    u = np.cos(np.arange(system.rows))
    assert system.C is not None
    assert np.allclose(system.C @ u, 2e-3 * (system.K @ u), rtol=1e-12)


@pytest.mark.long
@pytest.mark.serial
def test_a_shaken_layer_of_iwan_soil_loses_what_masing_says(comm: Any) -> None:
    """A layer in simple shear, to and fro by its top in load steps: the work of a loop is that of
    the polygon."""
    curve = [(1e-4 * 2.0**k, 1.0 / (1.0 + 0.1 * 2.0**k)) for k in range(8)]
    law = Iwan(50e6, 0.3, 1900.0, curve)
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 1.0), divisions=(2, 2)), comm)
    amplitude = 0.5 * float(np.interp(2e-3, [g for g, _ in curve], [g * r for g, r in curve]))
    tau = 2.0 * law.shear_modulus * amplitude

    def history(t: float) -> float:
        return float(np.interp(t, [0.0, 1.0, 3.0, 5.0], [0.0, 1.0, -1.0, 1.0]))

    sides = [
        fem.Traction(tags["top"], (tau, 0.0), history=history),
        fem.Traction(tags["left"], (0.0, -tau), history=history),
        fem.Traction(tags["right"], (0.0, tau), history=history),
    ]
    system = fem.assemble(mesh, law, integration="bbar", clamped=tags["bottom"], loads=sides)
    problem = vc.ContactProblem(system, empty_surface(system.space.comm, 2))
    times = np.linspace(0.0, 5.0, 101)[1:]
    internal: Any = system.internal
    lost = 0.0
    old: Any = None
    for state in vc.quasi_static(problem, times):
        if old is not None and state.t > 1.0 + 1e-9:
            standing = internal.go_on(old.memory, problem.cartesian(old.u))
            lost += standing.dissipation(problem.cartesian(state.u))
        old = state
    sigma = state.memory["material_0_sigma"]
    assert np.abs(sigma[..., 3] / np.sqrt(2.0) / tau - 1.0).max() <= 1e-6

    # Masing: the loop between -gamma and gamma encloses 8 (∫ tau dgamma - tau gamma/2).
    places = np.concatenate([[0.0], [g for g, _ in curve]])
    stresses = np.concatenate([[0.0], [law.shear_modulus * r * g for g, r in curve]])
    gamma = float(np.interp(tau, stresses, places))
    below = places < gamma
    x = np.append(places[below], gamma)
    y = np.append(stresses[below], tau)
    area = 8.0 * (np.sum(0.5 * np.diff(x) * (y[1:] + y[:-1])) - 0.5 * tau * gamma)
    assert lost == pytest.approx(area, rel=0.03)


@pytest.mark.serial
def test_histories_of_linear_bodies_have_no_plastic_loss(comm: Any) -> None:
    problem = throw(comm)
    linear = replace(problem, system=problem.system.changed(internal=None))
    found = run(linear, "J2", steps=3)
    assert "loss_plastic" not in found.history


@pytest.mark.long
@pytest.mark.two_ranks
@pytest.mark.parametrize("mortar", [False, True], ids=["nodes", "mortar"])
def test_a_block_falls_on_ground_that_yields(comm: Any, mortar: bool) -> None:
    """Two bodies of two materials with friction between them, and a side that lets waves out."""
    lower = BlockMesh(lengths=(2.0, 1.0), divisions=(8, 4))
    upper = BlockMesh(lengths=(0.5, 0.5), divisions=(3 if mortar else 2, 2))
    mesh, tags = fem.build_mesh(
        TwoBlocks(lower=lower, upper=upper, offset=(0.75, 0.0), gap=1e-3), comm
    )
    system = fem.assemble(
        mesh,
        [(tags["lower"], SOIL), (tags["upper"], vc.LinearElastic(2e9, 0.2, 2400.0))],
        integration="bbar",
        clamped=tags["lower_bottom"],
        dashpots=[fem.Dashpots(tags["lower_left"]), fem.Dashpots(tags["lower_right"])],
        initial_velocity=[(tags["upper"], (0.5, -3.0)), (tags["lower"], (0.0, 0.0))],
    )
    surface = fem.contact_pair(
        system,
        tags["upper_bottom"],
        tags["lower_top"],
        matching=fem.DualMortar() if mortar else None,
    )
    problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(0.4))
    found = run(problem, "J2", steps=8 if comm.size > 1 else 25, dt=5e-4)
    assert found.facts["worst_certificate"] <= 1e-9
    assert found.facts["energy_defect"] <= 1e-9
    if comm.rank == 0:
        history = found.history
        assert history["loss_plastic"][-1] > 0.05 * history["energy_kinetic"][0]
        assert history["loss_damping"][-1] > 0.0


@pytest.mark.serial
def test_a_free_field_beside_yielding_ground_is_refused(comm: Any) -> None:
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(2.0, 1.0), divisions=(4, 2)), comm)
    sides = soil.FreeField(tags["left"], base=vc.Ricker(1.0, 4.0))
    with pytest.raises(InputError, match="side 'left' stands beside cells of"):
        fem.assemble(mesh, SOIL, integration="bbar", clamped=tags["bottom"], dashpots=sides)


@pytest.mark.serial
def test_a_state_without_its_stresses_is_refused(comm: Any) -> None:
    """As one whose memory was lost, or one of another body."""
    problem = throw(comm)
    found = run(problem, "J2", steps=8)
    lost = replace(found.state, memory={})
    with pytest.raises(InputError, match="remembers no stress of the body"):
        run(problem, "J2", steps=1, state=lost)
    with pytest.raises(InputError, match="remembers other materials"):
        run(throw(comm, "MohrCoulomb"), "J2", steps=1, state=found.state)


def test_supports_of_a_body_that_yields_are_released(comm: Any) -> None:
    """The walls beside ground that has yielded go; what they bore stays, and nothing moves."""
    sand = MohrCoulomb(1e8, 0.2, 2000.0, 0.0, 30.0, 0.0)
    meshed = fem.build_mesh(BlockMesh(lengths=(1.0, 3.0), divisions=(2, 6)), comm)
    problem = column(comm, sand, mesh=meshed)
    state = vc.static_equilibrium(problem)
    bottom = fem.Prescribed(meshed[1]["bottom"])
    weight = fem.BodyForce((0.0, -9.81 * sand.rho))
    free = fem.assemble(meshed[0], sand, integration="bbar", prescribed=bottom, loads=weight)
    alone = vc.ContactProblem(free, empty_surface(free.space.comm, 2))
    begun, first = fem.release(problem, state, alone)
    found = vc.simulate(begun, state=first, dt=1e-3, steps=10, progress=False)
    moved = np.abs(found.state.u - first.u).max(initial=0.0)
    assert moved <= 1e-9 * np.abs(state.u).max(initial=np.finfo(float).tiny)


@pytest.mark.serial
def test_an_initial_displacement_has_yielded_already(comm: Any) -> None:
    """A body that is let go from a stretch beyond yield: its first stress is on the surface, and
    ledger counts from there."""
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 1.0), divisions=(3, 3)), comm)
    system = fem.assemble(
        mesh,
        STEEL,
        integration="bbar",
        clamped=tags["bottom"],
        initial_displacement=lambda x: np.stack([0.0 * x[:, 0], 4e-3 * x[:, 1]], axis=1),
    )
    problem = vc.ContactProblem(system, empty_surface(system.space.comm, 2))
    stepper = vc.Stepper(problem, solver=vc.Condensed())
    first = stepper.attempt(1e-5).report.old
    alpha = first.memory["material_0_alpha"]
    assert alpha.min() > 1e-4
    found = run(problem, "J2", steps=20, dt=1e-5, record=[vc.Energy()])
    assert found.facts["energy_defect"] <= 1e-10
    assert found.history["loss_plastic"][1] < 0.1 * found.history["energy_strain"][0]


@pytest.mark.serial
@pytest.mark.parametrize("law", ["J2", "MohrCoulomb"])
def test_mirrored_throws_are_mirrored(comm: Any, law: str) -> None:
    """A block thrown to the left moves as the mirror image of one thrown to the right."""
    ends = []
    for sign in (1.0, -1.0):
        mesh, tags = fem.build_mesh(BlockMesh(lengths=(0.5, 1.0), divisions=(2, 4)), comm)
        system = fem.assemble(
            mesh, LAWS[law], integration="bbar", initial_velocity=(sign * 1.0, -4.0)
        )
        ground = vc.HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
        surface = fem.contact_surface(system, tags["bottom"], obstacle=ground)
        problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(0.3))
        found = run(problem, law, steps=20)
        space: Any = system.space
        nodal = space.expand(problem.cartesian(found.state.u), 0.0) * np.array([sign, 1.0])
        place = space.points[:, 0] if sign > 0.0 else 0.5 - space.points[:, 0]
        ends.append(nodal[np.lexsort((np.round(place, 9), np.round(space.points[:, 1], 9)))])
    assert np.abs(ends[0] - ends[1]).max() <= 1e-7 * np.abs(ends[0]).max()


@pytest.mark.long
@pytest.mark.serial
def test_units_of_force_do_not_matter(comm: Any) -> None:
    """With all masses and stresses in thousands the motion is the same."""
    ends = []
    for unit in (1.0, 1e3):
        law = MohrCoulomb(50e6 / unit, 0.3, 1900.0 / unit, 10e3 / unit, 30.0, 10.0)
        mesh, tags = fem.build_mesh(BlockMesh(lengths=(0.5, 1.0), divisions=(2, 4)), comm)
        system = fem.assemble(mesh, law, integration="bbar", initial_velocity=(1.0, -2.0))
        ground = vc.HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
        surface = fem.contact_surface(system, tags["bottom"], obstacle=ground)
        problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(0.3))
        ends.append(run(problem, "MohrCoulomb", steps=12).state.u)
    assert np.abs(ends[0] - ends[1]).max() <= 1e-7 * np.abs(ends[0]).max()


@pytest.mark.long
@pytest.mark.serial
def test_hexahedra_and_tetrahedra_are_thrown(comm: Any) -> None:
    """The same laws in space, with bbar and with degree 2."""
    for simplices, divisions in ((False, (2, 2, 2)), (True, (1, 1, 1))):
        mesh, tags = fem.build_mesh(
            BlockMesh(lengths=(0.5, 0.5, 0.5), divisions=divisions, simplices=simplices),
            comm,
        )
        system = fem.assemble(
            mesh,
            SOIL,
            degree=2 if simplices else 1,
            integration="full" if simplices else "bbar",
            initial_velocity=(0.5, 0.0, -3.0),
        )
        ground = vc.HalfSpace(point=(0.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0))
        surface = fem.contact_surface(system, tags["back"], obstacle=ground)
        problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(0.3))
        found = run(problem, "MohrCoulomb", steps=10, dt=1e-3)
        assert found.facts["worst_certificate"] <= 1e-9
        assert found.facts["energy_defect"] <= 1e-9
        assert found.history["loss_plastic"][-1] > 0.05 * found.history["energy_kinetic"][0]


@pytest.mark.serial
def test_a_block_of_soil_stands_by_contact_alone(comm: Any) -> None:
    """Nothing holds it but the ground, which bears its weight; it stands as elastic bodies do."""
    problem = throw(comm, "MohrCoulomb")
    standing = replace(problem, system=vc.with_weight(problem.system))
    state = vc.static_equilibrium(standing)
    weight = 1900.0 * 9.80665 * 0.5
    assert state.certificate is not None and state.certificate <= 1e-9
    assert state.r_n.sum() == pytest.approx(weight, rel=1e-8)
