"""Bodies that turn: energy-momentum steps, in free flight and on flat supports."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import cos, pi, sin
from typing import Any

import numpy as np
import pytest

import vi_contact as vc
from demos.parts.problems import turning
from demos.parts.problems.turning import RigidBlock
from vi_contact import fem
from vi_contact.core.errors import InputError, StepFailure
from vi_contact.core.ledger import energy_balance
from vi_contact.meshes.block import BlockMesh

SOFT = vc.SaintVenantKirchhoff(E=1e6, nu=0.3, rho=1000.0)
STIFF = vc.SaintVenantKirchhoff(E=1e9, nu=0.0, rho=2000.0)
FLOOR = vc.HalfSpace((0.0, 0.0), (0.0, 1.0))


@dataclass(frozen=True)
class OneEnd:
    """The internal force p(u) of a body that turns, without that of both ends of a step."""

    both: Any

    def force(self, u: np.ndarray) -> np.ndarray:
        return np.asarray(self.both.force(u))

    def energy(self, u: np.ndarray) -> float:
        return float(self.both.energy(u))

    def tangent(self, u: np.ndarray) -> Any:
        return self.both.tangent(u)


def follow(problem: vc.ContactProblem, dt: Any, **more: Any) -> tuple[Any, float, float]:
    """The last state, and the largest changes of energy and of momenta over those at the start."""
    start: Any = None
    energy = momenta = 0.0
    for state, report in vc.march(problem, dt=dt, **more):
        if start is None:
            start = (
                turning.find_energy(problem, report.old),
                turning.find_momenta(problem, report.old),
            )
        energy = max(energy, abs(turning.find_energy(problem, state) / start[0] - 1.0))
        change = turning.find_momenta(problem, state) - start[1]
        momenta = max(momenta, float(np.abs(change).max() / np.abs(start[1]).max()))
    return state, energy, momenta


@pytest.mark.long
@pytest.mark.serial  # ranks: the box tumbles on them
@pytest.mark.parametrize(("E", "turns"), [(1e6, 10), (1e8, 2)])
def test_ten_turns_keep_energy_and_spin(comm: Any, E: float, turns: int) -> None:
    """At 20 steps a turn. Round-off of the forces adds up: it grows with E."""
    problem = turning.spin_block(comm, replace(SOFT, E=E), divisions=(1, 2))
    _, energy, momenta = follow(problem, 0.05, steps=20 * turns)
    assert energy < 1e-10
    assert momenta < 1e-10


@pytest.mark.long
@pytest.mark.serial
def test_the_trapezoidal_rule_blows_up_in_three_turns(comm: Any) -> None:
    """The same block, mass and step length, without the force of both ends."""
    problem = turning.spin_block(comm, replace(SOFT, E=1e8), divisions=(2, 4))
    system = problem.system
    plain = system.changed(internal=OneEnd(system.internal))
    problem = vc.ContactProblem(plain, problem.surface, mass=vc.ConsistentMass())
    grown = 0.0
    try:
        for state, report in vc.march(
            problem, scheme=vc.Trapezoidal(mass=vc.ConsistentMass()), dt=0.05, steps=60
        ):
            before = turning.find_energy(problem, report.old)
            grown = max(grown, turning.find_energy(problem, state) / before)
    except StepFailure:
        grown = np.inf
    assert grown > 1.5


@pytest.mark.long
@pytest.mark.two_ranks
def test_a_turned_start_gives_a_turned_run(comm: Any) -> None:
    """No axis of space is better than another, at any strain."""
    ends = []
    angle = 0.7
    R = np.array([[cos(angle), sin(angle)], [-sin(angle), cos(angle)]])
    for turned in (False, True):
        turn = R if turned else np.eye(2)
        problem = turning.spin_block(
            comm,
            vc.NeoHookean(E=1e5, nu=0.3, rho=1000.0),
            divisions=(2, 4),
            initial_displacement=lambda x, turn=turn: (x * (1.0 + 0.1 * x)) @ turn.T - x,
            initial_velocity=lambda x, turn=turn: (6.0 * x[:, ::-1] * [-1.0, 1.0]) @ turn.T,
        )
        *_, (state, _) = vc.march(problem, dt=0.01, steps=20)
        points = problem.system.space.coordinates[::2]
        ends.append(points + problem.cartesian(state.u).reshape(-1, 2))
    off = comm.allreduce(np.abs(ends[1] - ends[0] @ R.T).max(initial=0.0), op=max)
    assert off < 1e-10


@pytest.mark.long
@pytest.mark.parametrize("simplices", [False, True])
def test_a_box_tumbles_in_space(comm: Any, simplices: bool) -> None:
    """About no axis of inertia, of rubber: the spin vector is kept while the box tumbles."""
    problem = turning.spin_block(
        comm,
        vc.NeoHookean(E=1e6, nu=0.3, rho=1000.0),
        lengths=(0.3, 0.6, 1.0),
        divisions=(1, 2, 3),
        spin=(2.0, 4.0, 1.0),
        simplices=simplices,
    )
    _, energy, momenta = follow(problem, 0.05, steps=20)
    assert energy < 1e-10
    assert momenta < 1e-10


@pytest.mark.serial
def test_drag_slows_a_flight_down_by_its_own_rate(comm: Any) -> None:
    """C = c/rho M is the same in any position: each step takes (2 - a dt)/(2 + a dt) of v."""
    rate = 3.0
    problem = turning.spin_block(
        comm, SOFT, divisions=(1, 2), damping=vc.MassProportional(rate * SOFT.rho)
    )
    dt = 0.01
    found: list[Any] = []
    for state, report in vc.march(problem, dt=dt, steps=10):
        if not found:
            found.append(turning.find_momenta(problem, report.old))
        found.append(turning.find_momenta(problem, state))
    # the drag acts on middle places, whose spin is that of both ends but for the strain
    kept = ((2.0 - rate * dt) / (2.0 + rate * dt)) ** 10
    assert found[-1][2] / found[0][2] == pytest.approx(kept, rel=1e-3)


@pytest.mark.long
@pytest.mark.two_ranks
@pytest.mark.parametrize(
    ("width", "theta0", "off"),
    [
        (0.5, 0.1, 5e-4),
        (0.5, 0.2, 1.2e-3),
        (0.5, 0.3, 1e-3),
        (1.0, 0.5, 3e-4),
        (1.0, 0.7, 1e-3),
    ],
)
def test_a_block_rocks_as_the_rigid_one(comm: Any, width: float, theta0: float, off: float) -> None:
    """Quarter periods. Energy is lost at landings alone, each time the work of the closing nodes:
    the ledger knows it to round-off."""
    block = RigidBlock(width, 1.0)
    quarter = block.find_quarter(theta0)
    dt = quarter / 50.0
    problem = turning.rock_block(comm, block, theta0, material=STIFF, divisions=(2, 4))
    unit = STIFF.rho * width * turning.GRAVITY * block.radius
    tilts = [theta0]
    lost = landing = 0.0
    for state, report in vc.march(problem, dt=dt, steps=52):
        step = energy_balance(problem, report.old, report.new, report.averages())
        assert abs(step.algorithmic) < 1e-14 * unit
        assert abs(step.defect) < 1e-11 * unit
        opened = problem.surface.everywhere(state.active).sum() <= 1
        if opened and not landing:
            assert lost + step.contact < 1e-3 * unit
        elif not landing:
            t = report.old.t
            landing = turning.find_landing(block, t, tilts[-1], tilts[-2], dt)
        lost += step.contact
        tilts.append(turning.find_tilt(problem, state))
    assert landing == pytest.approx(quarter, rel=off)


@pytest.mark.long
@pytest.mark.serial
def test_a_column_falls_over_and_lies(comm: Any) -> None:
    """Beside the rigid block's equation until it lands; its side comes to rest on the floor, and
    no node goes through it."""
    block = RigidBlock(0.5, 2.0)
    pulse = vc.HalfSine(amplitude=-7.0, duration=0.8)
    rigid = block.fall_over(lambda t: -pulse.acceleration(t), 2.0)
    problem = turning.shake_column(comm, block, pulse, material=STIFF, divisions=(2, 8))
    lies = float(rigid.t[-1])
    worst = lowest = 0.0
    for state, _ in vc.march(problem, dt=0.01, t_end=lies + 0.5):
        gap = problem.surface.gap(state.t) - problem.surface.normal_values(state.u)
        lowest = min(lowest, -comm.allreduce(-gap.min(initial=np.inf), op=max))
        tilt = turning.find_tilt(problem, state)
        if state.t < lies - 0.05:
            worst = max(worst, abs(tilt - rigid.sol(state.t)[0]))
    assert worst < 0.04
    assert tilt == pytest.approx(0.5 * pi, abs=0.02)
    assert lowest > -1e-12


def test_the_certificate_is_of_the_forces(comm: Any) -> None:
    """Of the answer: not of the stiffness times the displacement, in which a block of stone is 300
    times as large, and not of the straight way on which the step was guessed. What is left over the
    largest force, computed here, is the residual."""
    stone = replace(STIFF, E=1e10)
    problem = turning.rock_block(comm, RigidBlock(0.5, 1.0), 0.3, material=stone, divisions=(2, 4))
    surface = problem.surface
    for _, report in vc.march(problem, dt=0.01, steps=10):
        step = report.step
        x = report.result.x
        rest = step.forces.find_rest(x)
        load = surface.reaction_load(report.result.r_n, len(x), report.result.r_t)
        internal = step.scale * problem.equations.internal.between(report.old.u, step.origin + x)
        sizes = [rest - load, rest + internal, internal]
        left, *forces = surface.comm.max(np.array([np.abs(f).max(initial=0.0) for f in sizes]))
        assert report.certificate.equilibrium == pytest.approx(left / max(forces), rel=1e-6)


@pytest.mark.long
@pytest.mark.serial
def test_a_restart_is_the_straight_run(tmp_path: Any) -> None:
    from mpi4py import MPI

    def run(steps: int, **more: Any) -> Any:
        problem = turning.rock_block(MPI.COMM_SELF, RigidBlock(0.5, 1.0), 0.3, divisions=(2, 4))
        return vc.simulate(problem, dt=0.01, steps=steps, progress=False, **more)

    whole = run(30)
    run(20, out=tmp_path)
    again = run(30, out=tmp_path, restart=True)
    assert np.array_equal(whole.state.u, again.state.u)
    assert np.array_equal(whole.state.v, again.state.v)


@pytest.mark.long
@pytest.mark.serial
def test_steps_are_halved_where_a_corner_lands(comm: Any) -> None:
    """Halves lose less: a closure loses its force times the gap that is left to close."""
    lost = []
    for plan in (0.02, vc.HalvedAtImpact(0.02, halvings=4)):
        problem = turning.rock_block(comm, RigidBlock(0.5, 1.0), 0.2, divisions=(2, 4))
        (_, first), *_, (state, _) = vc.march(problem, dt=plan, t_end=0.34)
        lost.append(turning.find_energy(problem, first.old) - turning.find_energy(problem, state))
    assert 0.0 < lost[1] < 0.5 * lost[0]


@pytest.mark.long
@pytest.mark.two_ranks
@pytest.mark.parametrize(
    ("wall", "friction"),
    [
        ((1.0, 0.0), vc.Frictionless()),
        ((1.0, 0.0), vc.Coulomb(0.4)),
        ((0.8, 0.6), vc.Coulomb(0.4)),
    ],
)
def test_a_block_is_thrown_into_a_corner(comm: Any, wall: Any, friction: Any) -> None:
    """Floor and wall, at right angles or not: any node may land on either, and rubs on both.
    Contact creates no energy, what the walls give is the change of momentum, the ledger closes,
    and no node is ever behind a wall."""
    mesh, _ = fem.build_mesh(
        BlockMesh(lengths=(0.5, 1.0), divisions=(2, 4), corner=(0.3, 0.2)), comm
    )
    system = fem.assemble(
        mesh,
        SOFT,
        initial_velocity=lambda x: np.array([-3.0, -4.0]) + 2.0 * x[:, ::-1] * [-1.0, 1.0],
    )
    planes = (FLOOR, vc.HalfSpace((0.0, 0.0), wall))
    surface = fem.joined_surfaces(
        *[fem.contact_surface(system, obstacle=plane) for plane in planes]
    )
    problem = vc.ContactProblem(system, surface, friction=friction)
    surface = problem.surface
    before = 0.0
    impulse = np.zeros(2)
    touched = np.zeros(2)
    for state, report in vc.march(problem, dt=2e-3, steps=90):
        if not before:
            before = turning.find_energy(problem, report.old)
            momenta = turning.find_momenta(problem, report.old)
        load = surface.reaction_load(state.r_n, len(state.u), state.r_t)
        pressed = problem.cartesian(load).reshape(-1, 2)
        impulse -= 2e-3 * surface.comm.sum(pressed.sum(axis=0))
        on_floor, on_wall = (surface.everywhere(state.r_n) > 0.0).reshape(2, -1)
        touched += [on_floor.sum(), on_wall.sum()]
        gap = surface.gap(state.t) - surface.normal_values(state.u)
        assert gap.min(initial=0.0) > -1e-12
        assert turning.find_energy(problem, state) <= before * (1.0 + 1e-10)
        step = energy_balance(problem, report.old, report.new, report.averages())
        assert abs(step.defect) < 1e-11 * before
    assert np.all(touched > 0)
    change = turning.find_momenta(problem, state) - momenta
    assert np.allclose(change[:2], impulse, rtol=1e-9)


def throw(lengths: Any, divisions: Any, corner: Any, velocity: Any, law: Any, mu: float) -> Any:
    """A leaning body that flies into the corner of as many planes as space has dimensions."""
    from mpi4py import MPI

    d = len(lengths)
    middle = np.array(corner) + 0.5 * np.array(lengths)
    R = np.eye(d)
    R[:2, :2] = [[cos(0.3), -sin(0.3)], [sin(0.3), cos(0.3)]]
    mesh, _ = fem.build_mesh(
        BlockMesh(lengths=lengths, divisions=divisions, corner=corner), MPI.COMM_SELF
    )
    system = fem.assemble(
        mesh,
        law,
        initial_velocity=velocity,
        initial_displacement=lambda x: (x - middle) @ R.T - (x - middle),
    )
    planes = [vc.HalfSpace((0.0,) * d, tuple(normal)) for normal in np.eye(d)[::-1]]
    surface = fem.joined_surfaces(
        *[fem.contact_surface(system, obstacle=plane) for plane in planes]
    )
    friction = vc.Coulomb(mu) if mu else vc.Frictionless()
    return vc.ContactProblem(system, surface, friction=friction)


def follow_in_corner(problem: Any, **more: Any) -> np.ndarray:
    """March, and return which planes were touched: nothing is behind one, or gains energy."""
    before = 0.0
    touched = np.zeros(problem.system.space.dimension)
    surface = problem.surface
    for state, report in vc.march(problem, **more):
        if not before:
            before = turning.find_energy(problem, report.old)
        gap = surface.gap(state.t) - surface.normal_values(state.u)
        assert gap.min() > -1e-12
        assert turning.find_energy(problem, state) < before * (1.0 + 1e-10)
        step = energy_balance(problem, report.old, report.new, report.averages())
        assert abs(step.defect) < 1e-10 * before
        touched += (surface.everywhere(state.r_n) > 0.0).reshape(len(touched), -1).sum(axis=1)
    return touched


STRIP = ((1.0, 0.02), (8, 1), (0.1, 0.3), (-5.0, -20.0))


@pytest.mark.serial
def test_a_stop_in_a_corner_is_stepped_on() -> None:
    """A strip whose end is stopped has velocities that would turn its cells inside out in the next
    step: that step begins where none is, in place of a force that is NaN."""
    touched = follow_in_corner(throw(*STRIP, replace(SOFT, E=1e7), 0.4), dt=2e-3, steps=18)
    assert touched[0] > 0


@pytest.mark.serial
def test_a_box_sticks_in_a_corner_in_space() -> None:
    """A node that faces three rough planes rubs on those that it touches, and on no other one."""
    problem = throw((0.5,) * 3, (2, 2, 2), (0.1,) * 3, (-3.0, -2.0, -5.0), SOFT, 0.4)
    assert np.all(follow_in_corner(problem, dt=5e-3, steps=16) > 0)


def drop_strip() -> tuple[vc.ContactProblem, float]:
    """Return a flat strip 2 cm thick that falls on the floor at 20 m/s, and its energy [J]."""
    from mpi4py import MPI

    mesh, _ = fem.build_mesh(
        BlockMesh(lengths=(1.0, 0.02), divisions=(8, 1), corner=(0.0, 0.3)), MPI.COMM_SELF
    )
    system = fem.assemble(mesh, replace(SOFT, E=1e7), initial_velocity=(0.0, -20.0))
    problem = vc.ContactProblem(system, fem.contact_surface(system, obstacle=FLOOR))
    # all of it of motion
    return problem, 0.5 * SOFT.rho * 0.02 * 20.0**2


@pytest.mark.serial
def test_long_steps_of_a_strip_gain_no_energy() -> None:
    """Steps of 0.02 s take a strip of 2 cm down by 40 cm. Judged by forces of that straight way, a
    step gained 4e-8 of the energy; by forces of its answer it gains round-off."""
    problem, before = drop_strip()
    energy = before
    for state, _ in vc.march(problem, dt=vc.HalvedAtImpact(0.02, halvings=6), t_end=0.2):
        now = turning.find_energy(problem, state)
        assert now - energy < 1e-11 * before
        energy = now


@pytest.mark.serial
def test_a_step_that_crushes_a_body_is_made_in_halves() -> None:
    """Refused whole, by a sentence with its place and the remedy, which then is right."""
    problem = throw(*STRIP, replace(SOFT, E=1e7), 0.0)
    with pytest.raises(StepFailure, match=r"balance at \(.*give the run dt=HalvedAtImpact"):
        follow_in_corner(problem, dt=0.02, steps=3)
    touched = follow_in_corner(problem, dt=vc.HalvedAtImpact(0.02, halvings=6), t_end=0.06)
    assert touched[0] > 0


@pytest.mark.long
@pytest.mark.serial
def test_a_thin_body_does_not_go_through_in_one_step() -> None:
    """A strip of 2 cm at 20 m/s: a step takes it down by twenty times its thickness."""
    problem, before = drop_strip()
    landed = False
    for state, report in vc.march(problem, dt=0.02, steps=10):
        gap = problem.surface.gap(state.t) - problem.surface.normal_values(state.u)
        assert gap.min() > -1e-12
        assert turning.find_energy(problem, state) < before * (1.0 + 1e-10)
        step = energy_balance(problem, report.old, report.new, report.averages())
        assert abs(step.defect) < 1e-11 * before
        landed = landed or bool(state.active.any())
    assert landed


def test_an_edge_rubs_on_floor_and_wall(comm: Any) -> None:
    """A box slides along the edge of a floor and a wall that carry it: each takes mu times its own
    impulse, with the nodes of the edge, which face both, in either."""
    mu = 0.3
    mesh, _ = fem.build_mesh(BlockMesh(lengths=(0.5, 0.5, 1.0), divisions=(1, 1, 2)), comm)
    weight = turning.GRAVITY * STIFF.rho
    system = fem.assemble(
        mesh,
        STIFF,
        initial_velocity=(0.0, 0.0, 3.0),
        loads=fem.BodyForce((-0.5 * weight, -weight, 0.0)),
    )
    planes = [vc.HalfSpace((0.0, 0.0, 0.0), normal) for normal in ((0, 1, 0), (1, 0, 0))]
    surface = fem.joined_surfaces(
        *[fem.contact_surface(system, obstacle=plane) for plane in planes]
    )
    problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(mu))
    normal = np.zeros(2)
    start = None
    for state, report in vc.march(problem, dt=5e-3, steps=20):
        if start is None:
            start = turning.find_momenta(problem, report.old)
        normal += 5e-3 * problem.surface.everywhere(state.r_n).reshape(2, -1).sum(axis=1)
    change = turning.find_momenta(problem, state) - start
    edge = problem.surface.everywhere(state.r_n).reshape(2, -1)
    assert np.any((edge > 0.0).all(axis=0))
    assert change[2] == pytest.approx(-mu * normal.sum(), rel=1e-3)


@pytest.mark.serial
def test_schemes_that_blow_up_are_refused() -> None:
    from mpi4py import MPI

    problem = turning.spin_block(MPI.COMM_SELF, SOFT, divisions=(1, 2))
    for scheme in (vc.Trapezoidal(), vc.Midpoint(), vc.HHT(-0.05)):
        with pytest.raises(InputError, match=r"give EnergyMomentum\(\)"):
            next(vc.march(problem, scheme=scheme, dt=0.01, steps=1))
    rotated = replace(problem, mass=vc.Redistributed())
    with pytest.raises(InputError, match="does not go with mass=Redistributed"):
        next(vc.march(rotated, dt=0.01, steps=1))
    plain = problem.system.changed(internal=OneEnd(problem.system.internal))
    other = vc.ContactProblem(plain, problem.surface)
    with pytest.raises(InputError, match="needs the internal force of both ends"):
        next(vc.march(other, scheme=vc.EnergyMomentum(), dt=0.01, steps=1))


@pytest.mark.long
@pytest.mark.two_ranks
def test_friction_brakes_a_block_that_slides(comm: Any) -> None:
    """While all of it slides, the floor takes mu times the impulse that carries the weight."""
    mu = 0.3
    mesh, _ = fem.build_mesh(BlockMesh(lengths=(1.0, 0.5), divisions=(4, 2)), comm)
    system = fem.assemble(
        mesh,
        STIFF,
        initial_velocity=(3.0, 0.0),
        loads=fem.BodyForce((0.0, -turning.GRAVITY * STIFF.rho)),
    )
    surface = fem.contact_surface(system, obstacle=FLOOR)
    problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(mu))
    normal = 0.0
    for k, (state, report) in enumerate(vc.march(problem, dt=5e-3, steps=40)):
        if k == 0:
            start = turning.find_momenta(problem, report.old)
        normal += 5e-3 * problem.surface.comm.sum(np.array([state.r_n.sum()]))[0]
    change = turning.find_momenta(problem, state) - start
    assert change[0] == pytest.approx(-mu * normal, rel=1e-9)
