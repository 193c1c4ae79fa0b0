"""The iterative route with friction beside the condensed one, step by step on finite elements, any
number of ranks."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from chain import chain_problem
from contact_cases import PROBLEMS, WEAKENING, pressed
from fem_problems import BOX_DT, thrown_box
from mpi4py import MPI
from tipped import ROUGH_ON_ONE_SIDE, tipped

import vi_contact as vc
from vi_contact.core.errors import InputError
from vi_contact.laws.friction import ExponentialDecay, SlipRateCoulomb
from vi_contact.run.cross_check import CrossChecked
from vi_contact.solvers import Iterative
from vi_contact.solvers.volume import ReducedNewton

COMM = MPI.COMM_WORLD
AT_REST = SlipRateCoulomb(ExponentialDecay(0.2, 0.1, 2.0))


def checked(
    problem: vc.ContactProblem, dt: float, steps: int, kind: str = "icc"
) -> tuple[CrossChecked, np.ndarray]:
    """The cross-check of a run: u, r_n and r_t to 1e-9; and the counts of open, sticking and
    slipping points."""
    compared, counts = CrossChecked(Iterative(kind), [vc.Condensed()]), np.zeros(3)
    for _, report in vc.march(problem, solver=compared, dt=dt, steps=steps):
        result = report.result
        slips = result.active & np.any(
            problem.surface.tangential_values(result.x) != report.step.slip0, axis=1
        )
        counts += [np.sum(~result.active), np.sum(result.active & ~slips), np.sum(slips)]
    assert compared.found[0].size["r_t"] > 0.0 and compared.worst <= 1e-9
    return compared, problem.surface.comm.sum(counts)


@pytest.mark.serial
@pytest.mark.parametrize(
    "law", [*ROUGH_ON_ONE_SIDE, WEAKENING], ids=["coulomb", "tresca", "slip rate"]
)
def test_a_tipped_block(law: Any) -> None:
    """Open, sticking and slipping points in the same step, mu up to 1.2 on one side."""
    _, counts = checked(tipped(COMM, law, simplices=True, angle=0.3), BOX_DT, 15)
    assert counts.min() > 0


@pytest.mark.parametrize(
    "name",
    [
        "box, C = 5",
        "box, C = 50",
        "springs",
        "inclined",
        "bilateral",
        "rollers, 3D",
        "pair, 2D",
        "pair, 3D",
        "corner",
        "moving",
    ],
)
@pytest.mark.promise("guide/solvers.md", "agree with `Condensed()` to 3e-10", bound="1e-9")
def test_steps_agree_with_the_condensed_route(name: str) -> None:
    make, dt = PROBLEMS[name]
    problem = make()
    if name == "corner":
        problem = replace(problem, surface=problem.surface.with_frictionless_corners())
    checked(replace(problem, friction=vc.Coulomb(0.8 if name == "springs" else 0.3)), dt, 6)


@pytest.mark.parametrize("kind", ["jacobi", "gamg"])
def test_preconditioners(kind: str) -> None:
    """In space, with a turned obstacle: curved friction, with every preconditioner."""
    for law in (vc.Coulomb(0.8), vc.Tresca(2e4)):
        problem = replace(thrown_box(COMM, angle=0.3, simplices=True), friction=law)
        checked(problem, 3e-3, 5, kind)


def test_agrees_with_reduced_newton() -> None:
    problem = replace(thrown_box(COMM, angle=0.3, simplices=True), friction=vc.Coulomb(0.3))
    solvers = (Iterative(), vc.Volume(ReducedNewton()))
    assert vc.cross_check(problem, solvers=solvers, dt=BOX_DT, steps=6).worst <= 1e-9


@pytest.mark.parametrize("law", [vc.Coulomb(0.2), vc.Tresca(3e3), AT_REST], ids=repr)
@pytest.mark.parametrize("d", [2, 3])
def test_statics_agree_with_the_condensed_route(d: int, law: Any) -> None:
    """A block pressed on a wavy plane: it slips where it is pressed aside."""
    problem = replace(pressed(d), friction=law)
    solvers = (Iterative(), vc.Condensed())
    one, two = (vc.static_equilibrium(problem, solver=solver) for solver in solvers)
    surface = problem.surface
    pairs = [(one.u, two.u), (one.r_n, two.r_n), (one.r_t, two.r_t)]
    local = [np.abs(value).max(initial=0.0) for a, b in pairs for value in (b, a - b)]
    sizes, errors = surface.comm.max(np.array(local)).reshape(-1, 2).T
    assert np.all(sizes > 0.0) and np.all(errors <= 1e-9 * sizes)
    assert np.array_equal(one.active, two.active)
    slips = [
        np.any(surface.tangential_values(state.u) != 0.0, axis=1) & state.active
        for state in (one, two)
    ]
    assert surface.some(slips[0]) and np.array_equal(*slips)


@pytest.mark.promise("guide/solvers.md", "They stop when the residual is 3e-10")
def test_newton_steps_are_few_and_reductions_short() -> None:
    """At most 12 Newton steps where contact comes and goes, and no reduction of more than a dozen
    numbers."""
    problem, prepared = replace(thrown_box(COMM, divisions=(6, 3, 6)), friction=vc.Coulomb(0.3)), []
    lengths: list[int] = []

    class Counting:
        rank, size, bcast, gather = COMM.rank, COMM.size, COMM.bcast, COMM.gather

        def sum(self, x: Any) -> Any:
            lengths.append(np.size(x))
            return problem.surface.comm.sum(x)

        def max(self, x: Any) -> Any:
            lengths.append(np.size(x))
            return problem.surface.comm.max(x)

    class Kept(Iterative):
        def prepare(self, A: Any, surface: Any, scale: float) -> Any:
            prepared.append(super().prepare(A, replace(surface, comm=Counting()), scale))
            return prepared[-1]

    for _, report in vc.march(problem, solver=Kept("icc"), dt=BOX_DT, steps=8):
        assert report.result.iterations <= 12 and report.certificate.worst <= 3e-10
    assert prepared[0].work.newton_steps > 8 and 0 < max(lengths) <= 12


@pytest.mark.two_ranks
def test_a_body_in_one_dimension_cannot_slide() -> None:
    with pytest.raises(InputError, match="a body in one dimension cannot slide"):
        vc.simulate(
            replace(chain_problem(3), friction=vc.Coulomb(0.3)),
            solver=Iterative(),
            dt=1e-3,
            steps=1,
        )
