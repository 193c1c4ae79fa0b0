"""Compact matrices of large bodies: what AIJ holds, and the steps that go with it, in any basis and
on any ranks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

pytest.importorskip("dolfinx")

from fem_problems import block, max_over_ranks, thrown_box, turned
from mpi4py import MPI
from two_bodies import SOFT, blocks, thrown, two_blocks

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.algebra import Matrix
from vi_contact.core.matrix_checks import probe
from vi_contact.fem.matrices import half
from vi_contact.fem.matrices.petsc_algebra import PetscMatrix
from vi_contact.fem.matrices.petsc_rows import aij_of

COMM = MPI.COMM_WORLD
CLOSE = 1e-13  # of the largest entry of a product: round-off of some tens of terms


def pair() -> vc.ContactProblem:
    """Two blocks, turned: relative unknowns in the nodal frames."""
    mesh = blocks(
        3, angle=0.4, simplices=True, upper=(2, 5, 2), lower=(2, 5, 2), lengths=(1.0, 2.0, 1.0)
    )
    system, tags = two_blocks(COMM, mesh, damping=vc.Rayleigh(2.0, 1e-4))
    system = thrown(
        system, lambda x: 0.0 * x, lambda x: 0.0 * x + np.append(turned((0.0, -1.0), 0.4), 0.0)
    )
    one, two = (tags[side] for side in mesh.interface)
    return vc.ContactProblem(system, fem.contact_pair(system, one, two), mass=vc.Redistributed())


def shaken() -> vc.ContactProblem:
    """A block between a roller and a moving top: nodes with some of their components, and the pull
    of the top."""
    mesh, tags = block(COMM, lengths=(1.0, 2.0, 1.0), divisions=(3, 5, 3))
    top = fem.Prescribed(tags["top"], lambda x, t: np.full_like(x, -1e-3 * np.sin(40.0 * t)))
    system = fem.assemble(
        mesh, SOFT, prescribed=[top, fem.Prescribed(tags["left"], components=(0,))]
    )
    wavy = vc.AnalyticGap(lambda x: 1e-4 * (1.0 + np.sin(7.0 * x[:, 2])))
    return vc.ContactProblem(system, fem.contact_surface(system, tags["bottom"], obstacle=wavy))


def tall() -> vc.ContactProblem:
    """Few of its rows are those of contact nodes, which are turned."""
    return replace(
        thrown_box(COMM, simplices=True, angle=0.4, divisions=(2, 6, 2)), mass=vc.Redistributed()
    )


PROBLEMS: dict[str, Callable[[], vc.ContactProblem]] = {
    "tall": tall,
    "flat": lambda: thrown_box(COMM, angle=0.4),
    "pair": pair,
    "shaken": shaken,
}


def both(name: str, monkeypatch: pytest.MonkeyPatch) -> tuple[vc.ContactProblem, vc.ContactProblem]:
    """The problem as it is, and with compact matrices."""
    plain = PROBLEMS[name]()
    monkeypatch.setattr(half, "COMPACT", 0)
    return plain, PROBLEMS[name]()


def alike(one: Any, two: Any) -> bool:
    return max_over_ranks(COMM, np.abs(one - two)) <= CLOSE * max_over_ranks(COMM, np.abs(two))


@pytest.mark.parametrize("name", PROBLEMS)
def test_the_same_matrices(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """M, C, K and A in every basis: products, diagonals, rows, and the whole when it is asked
    for."""
    plain, packed = both(name, monkeypatch)
    x = probe(np.asarray(plain.system.space.ids), 0)
    rows = np.flatnonzero(np.arange(len(x)) % 5 == 0)
    kinds = set()
    for basis in ("system", "turned", "equations"):
        ours, theirs = getattr(packed, basis), getattr(plain, basis)
        pairs: list[tuple[Matrix, Matrix]] = [(ours.M, theirs.M), (ours.K, theirs.K)]
        pairs += [(ours.C, theirs.C)] if theirs.C is not None else []
        pairs.append(tuple(one.effective(m=1e3, c=2.0, k=1.0).matrix for one in (ours, theirs)))
        for one, two in pairs:
            kinds.add(type(one).__name__)
            assert isinstance(one, PetscMatrix) and one.rows == two.rows
            assert alike(one @ x, two @ x) and alike(one.transpose_apply(x), two @ x)
            assert alike(one.diagonal(), two.diagonal()) and alike(
                PetscMatrix(one.mat) @ x, two @ x
            )
            algebra, mask = ours.algebra, np.arange(len(x)) % 3 > 0
            assert alike(
                algebra.entries(one, rows).toarray(), theirs.algebra.entries(two, rows).toarray()
            )
            held = [
                of.algebra.with_identity_rows(A, mask) @ x for of, A in ((ours, one), (theirs, two))
            ]
            assert alike(*held)
        assert alike(ours.inertia(np.eye(3)[1]), theirs.inertia(np.eye(3)[1]))
        assert alike(ours.load(0.01), theirs.load(0.01))
    assert kinds == ({"Half", "Replaced"} if name != "flat" else {"Half"})
    size = [
        sum(one.M.bytes + one.K.bytes for one in (of.system, of.turned)) for of in (packed, plain)
    ]
    assert COMM.allreduce(size[0]) < 0.7 * COMM.allreduce(size[1])


@pytest.mark.parametrize("name", ["tall", "pair", "shaken"])
@pytest.mark.parametrize("solver", [vc.Iterative("icc", tolerance=1e-13), vc.Condensed()])
def test_the_same_steps(name: str, solver: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    """Twelve steps with contact, on the package's own mass."""
    states, closed = [], False
    for problem in both(name, monkeypatch):
        for state, report in vc.march(problem, solver=solver, dt=5e-3, steps=12):
            assert report.certificate.worst <= 1e-11
            closed |= problem.surface.some(state.active)
        states.append(state)
    one, two = states
    assert max_over_ranks(COMM, np.abs(one.u - two.u)) <= 1e-9 * max_over_ranks(COMM, np.abs(two.u))
    assert closed and np.array_equal(one.active, two.active)


def test_bodies_below_the_limit_stay_as_they_are() -> None:
    """Nothing compact for small ones, nor in the plane."""
    assert type(thrown_box(COMM).system.K) is PetscMatrix
    assert type(half.algebra_for(COMM, 2, 10**6)) is not half.CompactAlgebra
    assert type(half.algebra_for(COMM, 3, half.COMPACT)) is half.CompactAlgebra


def test_rows_of_a_node_may_have_entries_in_different_places() -> None:
    """The blocks of a node are then met in any order: the first row of each rank's first node names
    the last node of all, the others their own before."""
    nodes, algebra = 2, half.CompactAlgebra(COMM, 3)
    n = 3 * nodes
    first, dense = n * COMM.rank, np.eye(n * COMM.size)
    for rank in range(COMM.size):
        mine = slice(n * rank, n * rank + 3)
        dense[mine, -3:] = dense[-3:, mine] = 1.0
        dense[n * rank, mine] = dense[mine, n * rank] = (
            0.0  # the own block is met after the far one
        )
    rows = sp.csr_matrix(dense[first : first + n])
    held = algebra.store(aij_of(rows, COMM))
    assert isinstance(held, half.Half)
    x = np.sin(np.arange(n * COMM.size) + 1.0)
    assert alike(held @ x[first : first + n], rows @ x)
