"""The iterative volume route beside the condensed one and PETSc's, step by step on finite
elements."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from contact_cases import PROBLEMS, pressed
from fem_problems import max_over_ranks, thrown_box
from mpi4py import MPI

import vi_contact as vc
from vi_contact.core.verify import kkt_residual
from vi_contact.solvers import Iterative
from vi_contact.solvers.iterative.layout import Nodewise
from vi_contact.solvers.iterative.preconditioners import KINDS, make_rigid_modes
from vi_contact.solvers.volume import ReducedNewton

COMM = MPI.COMM_WORLD


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", PROBLEMS)
@pytest.mark.promise("guide/solvers.md", "agree with `Condensed()` to 3e-10", bound="1e-9")
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


@pytest.mark.promise("guide/solvers.md", "They stop when the residual is 3e-10")
@pytest.mark.promise("guide/solvers.md", "Certificates are 2.1e-10 at most", bound="3e-10")
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
    modes = make_rigid_modes(A, surface, nodewise.layout, matrix.createVecLeft())
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
