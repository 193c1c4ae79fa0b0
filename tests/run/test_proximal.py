"""V2.9: static stages of stiff bodies on soft ones: residuals of round-off, equilibrium of rigid
bodies, few steps."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest
from chain import chain_problem
from fem_problems import CONCRETE, block, linear
from mpi4py import MPI

from demos.parts.problems.channel import Channel, build
from vi_contact.core.algebra import EffectiveMatrix
from vi_contact.core.certificate import Certificate
from vi_contact.core.errors import InputError, StepFailure
from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.core.state_checks import initial_state
from vi_contact.core.step import State, StepProblem, StepResult
from vi_contact.core.verify import kkt_residual
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import BodyForce, Prescribed, Traction
from vi_contact.fem.contact.pairs import contact_pair
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.fem.mesh.tagged_mesh import Cells, build_mesh
from vi_contact.laws.friction import Coulomb
from vi_contact.laws.materials import LinearElastic
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.channel import ChannelMesh
from vi_contact.meshes.two_blocks import Blocks
from vi_contact.run.proximal import Proximal
from vi_contact.run.rigid_bodies import RigidBodies
from vi_contact.run.static import static_equilibrium
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.friction.nsgs import NSGS

COMM = MPI.COMM_WORLD
WIDTH, HEIGHT, WEIGHT, LEAN, MU = 80.0, 100.0, 23544.0, 0.05, 0.6  # m, m, N/m³, of the weight, -


def certificate(problem: ContactProblem, state: State) -> Certificate:
    """Of a state as the solution of the static stage from the initial state."""
    system, surface, old = problem.static_load, problem.surface, initial_state(problem)
    A = EffectiveMatrix(system.algebra.combine([(1.0, system.K)]), system.algebra)
    load = system.load.at_rest(state.t)
    step = StepProblem(
        A=A,
        b=load,
        bound=surface.gap(state.t),
        surface=surface,
        scale=1.0,
        guess=old.u,
        active=old.active,
        t=state.t,
        k=0,
        friction=problem.friction,
        slip0=problem.slip_origin(old.u, old.t, state.t),
    )
    result = StepResult(state.u, state.r_n, state.active, 0, "", r_t=state.r_t)
    reaction = surface.reaction_load(state.r_n, len(load), state.r_t)
    return replace(
        kkt_residual(step, result), resultant=RigidBodies(problem).imbalance(load, reaction)
    )


@dataclass(frozen=True)
class Counting:
    """A solver that counts what it is asked."""

    solver: Any = field(default_factory=Condensed)
    asked: list[int] = field(default_factory=list)
    prepared: list[Any] = field(default_factory=list)

    def check(self, problem: ContactProblem) -> None:
        self.solver.check(problem)

    def prepare(self, A: EffectiveMatrix, surface: Any, scale: float) -> Counting:
        self.prepared.append(self.solver.prepare(A, surface, scale))
        return self

    def solve(self, step: StepProblem) -> StepResult:
        result: StepResult = self.prepared[-1].solve(step)
        self.asked.append(result.iterations)
        return result


@pytest.mark.serial
@pytest.mark.parametrize(
    ("size", "far"), [(0.5, 1.0), (0.5, 4.0), (0.25, 2.0), (0.2, 2.0), (0.15, 4.0)]
)
def test_the_channel_comes_to_rest_on_every_mesh(size: float, far: float) -> None:
    """Concrete in soil 200 times as soft, which contact alone holds: 1e-11, two digits below the
    tolerance."""
    model = build(Channel(ChannelMesh(size=size, far=far)), COMM)
    for contact in ({}, {"friction": Coulomb(0.5)}, {"bilateral": True}):
        problem = model.problem(excitation=(), **contact)
        assert certificate(problem, static_equilibrium(problem)).worst <= 1e-11


def leaning(n: int, *, soil: float = 2.5e6, rho: float = 1800.0) -> ContactProblem:
    """A block of concrete, n cells wide, on soft ground that is clamped at its base, under vertical
    and horizontal pressure on its top."""
    bodies = {
        "block": BlockMesh(
            lengths=(WIDTH, HEIGHT), divisions=(n, n + n // 4), corner=(WIDTH, WIDTH)
        ),
        "ground": BlockMesh(lengths=(3.0 * WIDTH, WIDTH), divisions=(3 * n, n)),
    }
    mesh, tags = build_mesh(Blocks(bodies), COMM)
    materials = [
        (tags["block"], LinearElastic(E=25e9, nu=0.2, rho=2400.0)),
        (tags["ground"], LinearElastic(E=soil, nu=0.3, rho=rho)),
    ]
    load = Traction(tags["block_top"], (LEAN * WEIGHT * HEIGHT, -WEIGHT * HEIGHT))
    system = assemble(mesh, materials, clamped=tags["ground_bottom"], loads=load)
    pair = contact_pair(system, tags["block_bottom"], tags["ground_top"])
    return ContactProblem(system, pair, friction=Coulomb(MU))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("n", "soil", "rho"), [(16, 2.5e6, 1800.0), (32, 2.5e6, 24.0), (16, 2.5e5, 1800.0)]
)
def test_a_stiff_block_leans_on_soft_ground(n: int, soil: float, rho: float) -> None:
    """Ten thousand times as soft and more, on any mesh and however light: weight, thrust and moment
    to 1e-9, in a few dozen steps of one factorisation."""
    problem, solver = leaning(n, soil=soil, rho=rho), Counting()
    state = static_equilibrium(problem, solver=solver)
    weight, x = WEIGHT * WIDTH * HEIGHT, problem.surface.points[:, 0] - 1.5 * WIDTH
    thrust = LEAN * weight
    assert state.r_t is not None and state.active.all()
    force, along, moment = COMM.allreduce(
        np.array([state.r_n.sum(), state.r_t.sum(), state.r_n @ x])
    )
    assert force == pytest.approx(weight, rel=1e-9)
    assert abs(along) == pytest.approx(thrust, rel=1e-8)  # 1e-9 of what acts on the block
    assert moment == pytest.approx(thrust * HEIGHT, rel=1e-8)
    assert certificate(problem, state).worst <= 1e-9
    assert len(solver.prepared) == 1 and len(solver.asked) <= 60


@pytest.mark.serial
def test_nodal_residuals_add_up_on_a_body() -> None:
    """Without resultants this would pass: every node off by 5e-10 of the largest load, the body by
    much more."""
    problem = leaning(16)
    state = static_equilibrium(problem)
    system = problem.static_load
    missing = (
        5e-10 * np.abs(system.load(0.0)).max() * system.influence[:, 1] * (system.space.bodies == 0)
    )
    load = system.load(0.0)
    reaction = problem.surface.reaction_load(state.r_n, len(load), state.r_t)
    wrong = RigidBodies(problem).imbalance(load + missing, reaction)
    assert RigidBodies(problem).imbalance(load, reaction) < 1e-9 < wrong
    assert Certificate(0.0, 0.0, 0.0, 0.0, resultant=wrong).worst == wrong


def test_held_bodies_and_components_are_no_free_motions() -> None:
    """A block on one whose nodes are all prescribed, and the same if it moves up and down only:
    what is left to be free carries the weight."""
    grid = {"lengths": (1.0, 1.0), "divisions": (1, 1)}
    bodies = {"lower": BlockMesh(corner=(0.0, -1.0), **grid), "upper": BlockMesh(**grid)}
    mesh, tags = build_mesh(Blocks(bodies), COMM)
    whole = [Prescribed(tags[f"lower_{side}"]) for side in ("bottom", "top")]
    along = [Prescribed(tags[f"upper_{side}"], components=(0,)) for side in ("bottom", "top")]
    for held, free in ((whole, 3), ([*whole, *along], 1)):
        system = assemble(
            mesh, CONCRETE, prescribed=held, loads=Traction(tags["upper_top"], (0.0, -1.0e3))
        )
        pair = contact_pair(system, tags["upper_bottom"], tags["lower_top"])
        problem = ContactProblem(system, pair)
        motions = [motion for body in RigidBodies(problem)._free for motion in body.motions.T]
        assert len(motions) == free and system.floating
        assert COMM.allreduce(static_equilibrium(problem).r_n.sum()) == pytest.approx(
            1.0e3, rel=1e-12
        )


@pytest.mark.parametrize("ratio", [1e-8, 1e-10])
def test_a_clamped_body_floats_on_no_contrast(ratio: float) -> None:
    """Steel and far more on a layer that is clamped: u = -p (h / E_layer + h / E) without
    contraction."""
    mesh, tags = block(COMM, lengths=(1.0, 2.0), divisions=(4, 8))
    high, low = (lambda x: x[1] > 1.0 - 1e-9), (lambda x: x[1] < 1.0 + 1e-9)
    parts = Cells.where("high", mesh, high), Cells.where("low", mesh, low)
    moduli, push = (1e11, 1e11 * ratio), 1e8 * ratio
    materials = [
        (part, LinearElastic(E=E, nu=0.0, rho=1.0)) for part, E in zip(parts, moduli, strict=True)
    ]
    system = assemble(
        mesh, materials, clamped=tags["bottom"], loads=Traction(tags["top"], (0.0, -push))
    )
    u = static_equilibrium(linear(system)).u
    assert not system.floating
    sag = COMM.allreduce(np.abs(u).max(initial=0.0), op=MPI.MAX)
    assert sag == pytest.approx(push * sum(1.0 / E for E in moduli), rel=2e-3)


@pytest.mark.parametrize("degree", [1, 2])
def test_a_clamped_body_that_hardly_changes_volume_is_held(degree: int) -> None:
    """On rollers it slides. Its stiffness against shear is 1e-11 of that against change of
    volume."""
    mesh, tags = block(COMM, lengths=(1.0, 2.0), divisions=(4, 8))
    rubber = LinearElastic(E=1e7, nu=0.49999999999, rho=1000.0)
    for components, floats in (((0, 1), False), ((1,), True)):
        held = Prescribed(tags["bottom"], components=components)
        assert assemble(mesh, rubber, prescribed=held, degree=degree).floating == floats


@pytest.mark.parametrize("angle", [0.0, 0.4])
def test_resultants_are_those_of_motions_that_nothing_holds(angle: float) -> None:
    """A free body has all, one on rollers those along them, a clamped one none; the part of a force
    that has its resultants leaves none, and costs no force that has none."""
    mesh, tags = block(COMM, lengths=(2.0, 1.0), divisions=(4, 2), angle=angle)
    ground = HalfSpace(point=(0.0, 0.0), normal=(-np.sin(angle), np.cos(angle)))
    for held, free in (
        ((), 3),
        (Prescribed(tags["left"], components=(0,)), 1),
        (Prescribed(tags["left"]), 0),
    ):
        system = assemble(mesh, CONCRETE, prescribed=held)
        surface = contact_surface(system, tags["bottom"], obstacle=ground) if free == 3 else None
        problem = linear(system) if surface is None else ContactProblem(system, surface)
        bodies, static = RigidBodies(problem), problem.static_load
        force = 1.0 + np.cos(1.0 + 5.0 * static.space.coordinates.sum(axis=1))
        left = force - bodies.resultants(force)
        assert bodies.imbalance(left, 0.0 * force) < 1e-14
        assert (bodies.imbalance(force, 0.0 * force) > 1e-3) == (free > 0)
        assert np.allclose(bodies.resultants(left), 0.0, atol=1e-13)
        rank = sum(motions.motions.shape[1] for motions in bodies._free)
        assert rank == free


def test_a_moment_turns_a_free_body_on_the_spot() -> None:
    """Loads without resultant, but with a moment, drive a motion that has no direction."""
    mesh, tags = block(COMM, lengths=(1.0, 1.0), divisions=(3, 3))
    couple = [Traction(tags["right"], (0.0, 1.0)), Traction(tags["left"], (0.0, -1.0))]
    with pytest.raises(InputError, match="its loads turn it on the spot and neither contact"):
        static_equilibrium(linear(assemble(mesh, CONCRETE, loads=couple)))


@pytest.mark.serial
def test_a_method_that_crawls_comes_to_an_end() -> None:
    """Gauss-Seidel on a body that is almost free: it gets stronger springs once, then an end, and
    no advice about time steps."""
    mesh, tags = block(COMM, lengths=(1.0, 3.0), divisions=(2, 4))
    system = assemble(mesh, CONCRETE, loads=BodyForce((2.0e3, -CONCRETE.rho * 9.81)))
    ground = HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    problem = ContactProblem(
        system, contact_surface(system, tags["bottom"], obstacle=ground), friction=Coulomb(0.5)
    )
    solver = Counting(Condensed(friction_method=NSGS(max_iterations=30)))
    with pytest.raises(StepFailure, match="held by contact alone was not solved") as failure:
        static_equilibrium(problem, solver=solver)
    assert (
        len(solver.prepared) == 2
        and "time step" not in str(failure.value)
        and "Condensed()" in str(failure.value)
    )


@pytest.mark.serial
def test_a_step_after_one_that_moved_nothing_is_not_prolonged() -> None:
    """There is no ratio of their sizes; bodies that were at rest to the last digit came to this."""
    problem = chain_problem(3, floating=True, gap=1.0)
    system, surface = problem.static_load, problem.surface
    A = EffectiveMatrix(system.K, system.algebra)
    proximal = Proximal(problem, A, Condensed(), 1e-9)
    u, none = np.zeros(system.rows), np.zeros(surface.count, dtype=bool)
    proximal.step = StepProblem(A, u, surface.gap(0.0), surface, 1.0, u, none, 0.0, 0)
    rest = proximal._measure_motion(u, none)
    moved = proximal._measure_motion(u + 1.0, none)
    answer = StepResult(u, np.zeros(surface.count), none, 1, "")
    assert rest.pace == 0.0 < moved.pace and proximal._look_ahead(rest, moved, answer) == 0.0
    assert proximal._look_ahead(moved, moved, answer) > 0.0
