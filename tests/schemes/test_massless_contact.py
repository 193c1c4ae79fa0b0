"""Massless contact nodes at the start of a run: in equilibrium, at the cost of their own rows of
K."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fem_problems import max_over_ranks, shaken_wall
from mpi4py import MPI
from two_bodies import two_blocks

from vi_contact.core import sizes
from vi_contact.core.algebra import Array, EffectiveMatrix, SerialAlgebra, total
from vi_contact.core.problem import ContactProblem
from vi_contact.core.step import State, StepProblem
from vi_contact.fem.body.loads import BodyForce, Traction
from vi_contact.fem.contact.pairs import contact_pair
from vi_contact.fem.matrices.petsc_algebra import PetscAlgebra
from vi_contact.laws.friction import Coulomb
from vi_contact.laws.mass import Redistributed
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import TwoBlocks
from vi_contact.run.simulate import simulate
from vi_contact.schemes.consistent_data import equilibrate
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.volume.route import ReducedNewton, Volume

COMM = MPI.COMM_WORLD
Rows = list[float]


@pytest.fixture
def factorised(monkeypatch: pytest.MonkeyPatch) -> Iterator[Rows]:
    """Rows, on all ranks, of every matrix that is factorised."""
    found: Rows = []

    def watched(make: Callable[..., Any]) -> Callable[..., Any]:
        def factor(algebra: Any, A: Any, *last: Any) -> Any:
            made = make(algebra, A, *last)
            found.extend([] if made is None else [total(algebra.comm, A.rows)])
            return made

        return factor

    for algebra in (PetscAlgebra, SerialAlgebra):
        for name in ("factor", "contact_last"):
            monkeypatch.setattr(algebra, name, watched(getattr(algebra, name)))
    yield found


def pair(*, rubbing: bool) -> ContactProblem:
    """Two blocks, pressed and sheared; nodes of both lose their mass."""
    mesh = TwoBlocks(
        lower=BlockMesh(lengths=(1.5, 1.0), divisions=(6, 4)),
        upper=BlockMesh(lengths=(1.5, 1.0), divisions=(6, 4)),
    )
    system, tags = two_blocks(
        COMM, mesh, clamped=lambda tags: tags["lower_bottom"],
        loads=lambda tags: [BodyForce((0.0, -1.0e4)), Traction(tags["upper_top"], (3.0e3, 0.0))],
    )  # fmt: skip
    surface = contact_pair(system, tags["upper_bottom"], tags["lower_top"])
    return ContactProblem(
        system, surface, mass=Redistributed(), **({"friction": Coulomb(0.2)} if rubbing else {})
    )


def wall(**data: Any) -> ContactProblem:
    return replace(shaken_wall(COMM, divisions=(6, 8), **data), mass=Redistributed(), impact=None)


PROBLEMS = {
    "wall": wall,
    "turned, on springs": lambda: wall(angle=0.4, springs=1.0e9),
    "rubbing": lambda: replace(wall(), friction=Coulomb(0.5)),
    "pair": lambda: pair(rubbing=False),
    "rubbing pair": lambda: pair(rubbing=True),
}


def disturbed(problem: ContactProblem) -> State:
    """A state whose contact layer is not in equilibrium: it points into the obstacle and along
    it."""
    system, surface = problem.equations, problem.surface
    size = 1e-4 * surface.whole().weights.mean()
    u = size * np.sin(1.0 + 7.0 * system.space.coordinates.sum(axis=1))
    u[surface.owned] = np.minimum(u[surface.owned], surface.gap0)
    return State(
        0.0, 0, u, np.zeros_like(u), np.zeros(surface.count), np.zeros(surface.count, dtype=bool)
    )


def with_the_whole_matrix(problem: ContactProblem, state: State) -> tuple[Array, Array]:
    """(u, r_n) from K with the rows of the identity in place of those of inner unknowns."""
    system, surface = problem.equations, problem.surface
    assert system.massless is not None
    inner = ~system.massless
    A = EffectiveMatrix(system.algebra.with_identity_rows(system.K, inner), system.algebra)
    step = StepProblem(
        A=A,
        b=np.where(inner, state.u, system.load(0.0) - system.K @ (inner * state.u)),
        bound=surface.gap(0.0),
        surface=surface,
        scale=1.0,
        guess=state.u,
        active=state.active,
        t=0.0,
        k=0,
        friction=problem.friction,
        slip0=problem.slip_origin(state.u, 0.0, 0.0),
    )
    result = Condensed().prepare(A, surface, 1.0).solve(step)
    return result.x, result.r_n


@pytest.mark.parametrize("name", PROBLEMS)
def test_only_contact_rows_are_factorised(name: str, factorised: Rows) -> None:
    """The equilibrium of the layer is that of the whole matrix, to 1e-11, and inner unknowns stay
    as they are."""
    problem = PROBLEMS[name]()
    state = disturbed(problem)
    u, r_n = with_the_whole_matrix(problem, state)
    factorised.clear()
    found = equilibrate(problem, state)
    massless = problem.equations.massless
    assert massless is not None
    assert (
        factorised == [COMM.allreduce(float(massless.sum()))]
        and factorised[0] < problem.system.space.unknowns / 2
    )
    assert max_over_ranks(COMM, found.u - u) < 1e-11 * max_over_ranks(COMM, u)
    assert max_over_ranks(COMM, found.r_n - r_n) < 1e-11 * max_over_ranks(COMM, r_n)
    assert problem.surface.some(found.active)
    assert np.array_equal(found.u[~massless], state.u[~massless])


@pytest.mark.parametrize("name", PROBLEMS)
def test_a_large_layer_is_not_factorised(
    name: str, factorised: Rows, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same equilibrium by conjugate gradients, to 1e-11."""
    problem = PROBLEMS[name]()
    state = disturbed(problem)
    small = equilibrate(problem, state)
    monkeypatch.setattr(sizes, "OWN_UNKNOWNS", 0)
    factorised.clear()
    large = equilibrate(replace(problem), state)
    assert not factorised and np.array_equal(large.active, small.active)
    assert max_over_ranks(COMM, large.u - small.u) < 1e-11 * max_over_ranks(COMM, small.u)
    assert max_over_ranks(COMM, large.r_n - small.r_n) < 1e-11 * max_over_ranks(COMM, small.r_n)


def test_an_iterative_run_factorises_no_whole_matrix(factorised: Rows) -> None:
    """The default scheme with conjugate gradients, from the start of a run to its summary."""
    solver = Volume(
        ReducedNewton(), petsc_options={"ksp_type": "cg", "pc_type": "jacobi", "ksp_rtol": 1e-12}
    )
    problem = wall()
    solution = simulate(problem, solver=solver, dt=1e-3, steps=3, progress=False)
    assert isinstance(solution.facts["scheme"], str) and "Trapezoidal" in solution.facts["scheme"]
    assert (
        solution.facts["steps"] == 3
        and np.isnan(solution.facts["seconds_per_linear_step"])
        and factorised
    )
    assert max(factorised) < problem.system.space.unknowns / 2
