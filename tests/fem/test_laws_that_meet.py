"""Laws that remember meet other ways to march: simulate, stages, escalation, corners, recorders."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI
from yielding_cases import step_of, throw

import vi_contact as vc
from vi_contact import fem, laws
from vi_contact.core.errors import InputError
from vi_contact.core.internal import select_memory
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.masonry import MasonryMesh

pytestmark = pytest.mark.serial
STONE = vc.LinearElastic(E=1e9, nu=0.2, rho=2000.0)
GROUND = vc.HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))


MESH, TAGS = fem.build_mesh(BlockMesh(lengths=(1.0, 0.5), divisions=(4, 2)), MPI.COMM_SELF)


def block(joint: Any, lift: float, **more: Any) -> vc.ContactProblem:
    """A block of 1 m x 0.5 m on a joint, whose top is pulled up by ``lift`` [Pa]."""
    mesh, tags = MESH, TAGS
    held = {name: tags[group] for name, group in more.items()}
    system = fem.assemble(mesh, STONE, loads=fem.Traction(tags["top"], (0.0, lift)), **held)
    surface = fem.contact_surface(system, tags["bottom"], obstacle=GROUND)
    return vc.ContactProblem(system, surface, joint=joint)


@cache
def throw_until_it_yields() -> tuple[vc.ContactProblem, vc.State]:
    """A thrown block, and its state after 60 steps of the midpoint rule."""
    problem = throw(MPI.COMM_SELF, n=2)
    *_, (state, _) = vc.march(problem, scheme=vc.Midpoint(), dt=step_of("J2", 2), steps=60)
    return problem, state


@pytest.mark.long
@pytest.mark.parametrize("scheme", [vc.Midpoint(), vc.Trapezoidal(), vc.Newmark(), vc.HHT()])
def test_all_ways_to_march_keep_what_materials_remember(scheme: Any) -> None:
    """Schemes replace the memory of a state at their start; that of materials stays."""
    problem, before = throw_until_it_yields()
    dt = step_of("J2", 2)
    *_, (state, _) = vc.march(problem, scheme=scheme, dt=dt, steps=5, state=before)
    solution = vc.simulate(problem, scheme=scheme, dt=dt, steps=5, state=before)
    assert np.array_equal(solution.state.u, state.u)
    for name, values in select_memory(state.memory).items():
        assert np.array_equal(solution.state.memory[name], values)
    *_, (_, report) = vc.march_many(
        [problem, problem], scheme=scheme, dt=dt, steps=5, states=[before, before]
    )
    assert np.array_equal(report.new.u, state.u)


def test_a_joint_that_has_cracked_stays_cracked_after_a_release() -> None:
    joint = laws.Joint(mu=0.6, cohesion=1e5, tension=5e4, opening=1e-4)
    held = block(joint, lift=6e4, clamped="top")
    *_, (state, _) = vc.march(held, scheme=vc.Midpoint(), dt=1e-3, steps=5)
    free = block(joint, lift=6e4)
    marks = {f"joint_{name}": x for name, x in joint.start(held.surface.count).items()}
    marks["joint_kappa"] = np.full(held.surface.count, 5e-5)
    cracked = vc.State(
        state.t, state.k, state.u, state.v, state.r_n, state.active, marks, state.r_t
    )
    _, first = fem.release(held, cracked, free)
    assert np.array_equal(first.memory["joint_kappa"], marks["joint_kappa"])


@pytest.mark.long
def test_passes_that_do_not_settle_go_on_as_whole_steps() -> None:
    """A block that is torn off by one step, which Volume could do and Condensed could not."""
    joint = laws.Joint(mu=0.6, cohesion=1e5, tension=5e4, opening=1e-3)
    ends = []
    for solver in (vc.Condensed(), vc.Volume()):
        *_, (state, report) = vc.march(block(joint, 4e4), dt=2e-3, steps=12, solver=solver)
        assert report.certificate.worst < 1e-9
        ends.append(state.u)
    assert np.allclose(ends[0], ends[1], rtol=0.0, atol=1e-6 * np.abs(ends[1]).max())


@pytest.mark.long
def test_a_joint_of_a_bonded_wall_cracks() -> None:
    """Conditions that share unknowns: the forces of the joint are its own, not read off a load."""
    wall = MasonryMesh(stones=2, courses=2, ground=0.2, divisions=(4, 2))
    mesh, tags = fem.build_mesh(wall, MPI.COMM_SELF)
    pull = fem.Traction(tags["top"], (1e5, 3e5))
    system = fem.assemble(mesh, STONE, clamped=tags["ground_bottom"], loads=pull)
    surface = fem.contact_pairs(system, within=1e-6)
    assert surface.traces is not None
    joint = laws.Joint(tension=2e5, opening=1e-3)
    problem = vc.ContactProblem(system, surface, joint=joint)
    reports = [report for _, report in vc.march(problem, dt=5e-4, steps=8)]
    assert max(report.certificate.worst for report in reports) < 1e-9
    assert reports[-1].new.memory["joint_kappa"].max() > 0.0


def test_water_in_a_joint_creates_no_energy() -> None:
    """Its work lifts the block, and is no gain of the scheme."""
    problem = block(laws.Joint(mu=0.6, water=4e4), lift=0.0)
    solution = vc.simulate(problem, dt=1e-3, steps=30)
    assert solution.history["work_joint_water"][-1] > 0.0
    assert solution.facts["energy_created"] < 1e-9
    assert solution.facts["energy_defect"] < 1e-9


def test_the_energy_of_no_joint_is_not_recorded() -> None:
    problem = block(None, lift=-1e4)
    with pytest.raises(InputError, match="the problem has no joint: leave the recorder out"):
        vc.simulate(problem, dt=1e-3, steps=1, record=[vc.JointEnergy()])


def test_a_problem_says_which_law_its_joint_has() -> None:
    problem = block(laws.Joint(mu=0.6), lift=-1e4)
    assert "joint: Joint(mu=0.6" in repr(problem) and "Frictionless" not in repr(problem)


@pytest.mark.parametrize("solver", [vc.Volume(), vc.Iterative()], ids=["volume", "iterative"])
def test_solvers_without_contact_unknowns_refuse_slip_rates_before_any_work(solver: Any) -> None:
    problem = block(laws.RateAndState(a=0.01, b=0.015, mu0=0.6, V0=1e-6, dc=1e-4), lift=0.0)
    with pytest.raises(InputError, match=r"cannot use RateAndState.*use Condensed\(\)"):
        vc.Stepper(problem, scheme=vc.Midpoint(), solver=solver)
