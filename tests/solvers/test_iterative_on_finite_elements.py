"""The iterative volume route beside the condensed one and PETSc's, step by step on finite
elements."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from fem_problems import block, max_over_ranks, shaken_wall, thrown_box, turned
from mpi4py import MPI
from two_bodies import SOFT, blocks, thrown, two_blocks

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.verify import kkt_residual
from vi_contact.solvers import Iterative
from vi_contact.solvers.iterative.layout import Nodewise
from vi_contact.solvers.iterative.preconditioners import KINDS, rigid_modes
from vi_contact.solvers.volume import ReducedNewton

COMM = MPI.COMM_WORLD


def wall(**how: Any) -> vc.ContactProblem:
    """The shaken wall, under motion that closes about half of its points."""
    return replace(shaken_wall(COMM, simplices=True, **how), impact=None)


def on_rollers(d: int) -> vc.ContactProblem:
    """A quarter of a block between two symmetry planes, whose nodes keep some of their components,
    thrown down."""
    mesh, tags = block(COMM, lengths=(1.5, 1.0, 1.2)[:d], divisions=(4, 3, 3)[:d])
    planes = [("left", 0), ("back", 2)][: d - 1]
    held = [fem.Prescribed(tags[name], components=(c,)) for name, c in planes]
    speed = (0.0, -1.0, 0.0)[:d]
    system = fem.assemble(mesh, SOFT, prescribed=held, initial_velocity=speed)
    wavy = vc.AnalyticGap(lambda x: 1e-3 * (1.0 + np.sin(7.0 * x[:, 0])))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=wavy)
    return vc.ContactProblem(system, surface, mass=vc.ConsistentMass())


def pair(d: int, **how: Any) -> vc.ContactProblem:
    """Two blocks thrown at one another, obliquely; unknowns of the contact are relative ones."""
    mesh = blocks(d, angle=0.4, simplices=True, gap=1e-4, upper=(3, 2, 2), lower=(3, 2, 2))
    system, tags = two_blocks(COMM, mesh)
    down = np.append(turned((0.0, -1.0), 0.4), np.zeros(d - 2))
    system = thrown(system, lambda x: 0.0 * x, lambda x: 0.0 * x + down)
    one, two = (tags[side] for side in mesh.interface)
    return vc.ContactProblem(
        system, fem.contact_pair(system, one, two, **how), mass=vc.ConsistentMass()
    )


def corner() -> vc.ContactProblem:
    """A parallelogram in a notch: three faces, no right angle."""
    mesh, tags = block(
        COMM,
        lengths=(1.5, 1.0),
        divisions=(4, 3),
        deform=lambda x: x @ np.array([[1, 0.2], [0.35, 1]]),
    )
    system = fem.assemble(mesh, SOFT, initial_velocity=(-1.0, -2.0))
    near = vc.AnalyticGap(lambda x: np.full(len(x), 1e-3))
    surfaces = (
        fem.contact_surface(system, tags[name], obstacle=near)
        for name in ("left", "bottom", "right")
    )
    return vc.ContactProblem(system, fem.joined_surfaces(*surfaces), mass=vc.ConsistentMass())


def moving() -> vc.ContactProblem:
    """A plane that rises towards a box which it then throws up."""
    given = thrown_box(COMM)
    return replace(
        given, surface=given.surface.moving(lambda t: 0.5 * np.sin(40.0 * t) ** 2 / 40.0)
    )


def some_bilateral() -> vc.ContactProblem:
    given = thrown_box(COMM, simplices=True, angle=0.4)
    first = np.arange(given.surface.count) % 4 == 0
    return replace(
        given, surface=replace(given.surface, bilateral=first & (given.surface.gap0 < 0.1))
    )


PROBLEMS: dict[str, tuple[Callable[[], vc.ContactProblem], float]] = {  # name -> problem, dt
    "box, C = 0.2": (lambda: thrown_box(COMM), 1e-3),
    "box, C = 5": (lambda: thrown_box(COMM), 3e-2),
    "box, C = 50": (lambda: thrown_box(COMM), 0.3),
    "springs": (lambda: wall(springs=1e9), 1.0 / 140.0),
    "inclined": (lambda: wall(angle=0.5), 1.0 / 140.0),
    "bilateral": (some_bilateral, 3e-3),
    "rollers, 2D": (lambda: on_rollers(2), 2e-3),
    "rollers, 3D": (lambda: on_rollers(3), 2e-3),
    "pair, 2D": (lambda: pair(2, matching=fem.DualMortar()), 2e-3),
    "pair, 3D": (lambda: pair(3), 2e-3),
    "corner": (corner, 2e-3),
    "moving": (moving, 2e-3),
}


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", PROBLEMS)
def test_steps_agree_with_the_condensed_route(name: str, kind: str) -> None:
    """u and r_n of every step to 1e-9 of their largest values; contact closes, and on most of them
    opens again."""
    make, dt = PROBLEMS[name]
    steps = 8 if name in ("springs", "inclined") else 4  # until the walls have closed
    checked = vc.cross_check(make(), solvers=(Iterative(kind), vc.Condensed()), dt=dt, steps=steps)
    assert max_over_ranks(COMM, np.array([checked.found[0].size["r_n"]])) > 0.0
    assert checked.worst <= 1e-9


def test_agrees_with_reduced_newton() -> None:
    solvers = (Iterative(), vc.Volume(ReducedNewton()))
    assert vc.cross_check(thrown_box(COMM), solvers=solvers, dt=3e-3, steps=5).worst <= 1e-9


def pressed(d: int) -> vc.ContactProblem:
    """A block, clamped at its top and pressed on a wavy plane by its weight; static."""
    mesh, tags = block(COMM, lengths=(1.5, 1.0, 1.2)[:d], divisions=(6, 4, 4)[:d])
    weight = fem.BodyForce((0.0, -2e4, 0.0)[:d])
    system = fem.assemble(mesh, SOFT, clamped=tags["top"], loads=weight)
    wavy = vc.AnalyticGap(lambda x: 2e-3 * (1.0 + np.sin(7.0 * x[:, 0])))
    return vc.ContactProblem(system, fem.contact_surface(system, tags["bottom"], obstacle=wavy))


@pytest.mark.parametrize("kind", ["auto", *KINDS])
@pytest.mark.parametrize("d", [2, 3])
def test_statics_agree_with_the_condensed_route(d: int, kind: str) -> None:
    problem = pressed(d)
    one, two = (
        vc.static_equilibrium(problem, solver=solver)
        for solver in (Iterative(kind), vc.Condensed())
    )
    load = [problem.surface.reaction_load(state.r_n, len(state.u)) for state in (one, two)]
    comm = problem.surface.comm
    for found, exact in ((one.u, two.u), (load[0], load[1])):
        size, error = comm.max(
            np.array([np.abs(exact).max(initial=0.0), np.abs(found - exact).max(initial=0.0)])
        )
        assert size > 0.0 and error <= 1e-9 * size
    assert np.array_equal(one.active, two.active)


def test_a_rebound_opens_all_points_at_once() -> None:
    """The box pressed flat, then pulled off: the prediction is all wrong, and the answer is right
    in the first step."""
    problem = thrown_box(COMM, divisions=(5, 3, 5))
    solver, reports = Iterative("icc"), []
    for _, report in vc.march(problem, solver=solver, dt=3e-3, steps=4):
        reports.append(report)
    step = reports[-1].step
    toward = problem.surface.reaction_load(problem.surface.weights, len(step.b))
    pulled = replace(step, b=step.b - 1e6 * toward, active=np.ones_like(step.active))
    result = solver.prepare(step.A, step.surface, step.scale).solve(pulled)
    assert not result.active.any() and not np.any(result.r_n) and result.iterations >= 1
    assert kkt_residual(pulled, result).worst <= 3e-10


class Kept(Iterative):
    """Keep what was prepared."""

    def prepare(self, *given: Any) -> Any:
        object.__setattr__(self, "prepared", super().prepare(*given))
        return self.prepared


@pytest.mark.parametrize("simplices", [False, True])
def test_ranks_that_overlap_take_hardly_more_iterations_than_one(simplices: bool) -> None:
    """A layer that all its factors share: at most a fifth more than one rank, where none takes a
    third more, and so does a layer that is counted twice."""
    counts = []
    for comm in (MPI.COMM_SELF, COMM):
        solver = Kept("icc")
        problem = thrown_box(comm, divisions=(9, 6, 6), simplices=simplices)
        list(vc.march(problem, solver=solver, dt=1e-2, steps=2))
        counts.append(solver.prepared.work.linear_iterations)
    assert counts[1] <= 1.2 * counts[0]
    shares = solver.prepared._masked._shares
    assert np.all((shares > 0.3) & (shares <= 1.0)) and bool(np.any(shares < 1.0)) == (
        COMM.size > 1
    )


def test_the_answer_is_taken_as_it_is() -> None:
    """An answer that stopped where it was told to is not corrected: products are those of one solve
    a step."""
    problem, solver = thrown_box(COMM), Kept("icc")
    changes, worst = 0, 0.0
    for _, report in vc.march(problem, solver=solver, dt=3e-3, steps=4):
        changes += report.result.iterations
        worst = max(worst, report.certificate.worst)
        assert report.result.method == "Iterative(icc)"
    assert 1e-12 < worst <= 3e-10
    work = solver.prepared.work
    assert work.products <= work.linear_iterations + changes + 3 * 4


@pytest.mark.parametrize("name", ["pair, 2D", "pair, 3D", "corner", "bilateral"])
def test_rigid_modes_in_turned_and_relative_unknowns(name: str) -> None:
    """K times a rigid motion vanishes, and there are as many as a body has."""
    problem = PROBLEMS[name][0]()
    system, surface = problem.equations, problem.surface
    A = system.effective(m=0.0, c=0.0, k=1.0)
    nodewise = Nodewise(A)
    matrix = nodewise.entries()
    modes = rigid_modes(A, surface, nodewise.layout, matrix.createVecLeft())
    d = system.space.dimension
    assert len(modes) == d * (d + 1) // 2
    assert np.allclose([[a.dot(b) for a in modes] for b in modes], np.eye(len(modes)), atol=1e-13)
    image = matrix.createVecLeft()
    for mode in modes:
        matrix.mult(mode, image)
        assert image.norm() <= 1e-12 * A.largest


def test_the_choice_is_said_once(caplog: pytest.LogCaptureFixture) -> None:
    with caplog.at_level("INFO"):
        vc.simulate(thrown_box(COMM), solver=Iterative(), dt=1e-3, steps=2)
    said = [r.getMessage() for r in caplog.records if "chosen at" in r.getMessage()]
    assert len(said) == (COMM.rank == 0) and all(
        "jacobi, chosen at Courant number 0." in one for one in said
    )
