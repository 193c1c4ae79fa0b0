"""Contact nodes stay with their owners: what is gathered, and refusals that no number of ranks
changes."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI
from two_bodies import SOFT

from vi_contact import AnalyticGap
from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.problem import ContactProblem
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.contact.faces import gather_boundary
from vi_contact.fem.contact.nodes import ask_alike, slots_of
from vi_contact.fem.contact.surface import contact_surface, nodes_on
from vi_contact.fem.mesh.communicators import MpiComm
from vi_contact.fem.mesh.tagged_mesh import build_mesh
from vi_contact.laws.friction import Coulomb
from vi_contact.laws.mass import Redistributed
from vi_contact.meshes.block import BlockMesh

COMM = MPI.COMM_WORLD


def wavy(x: Array) -> Array:
    return np.column_stack(
        [x[:, 0], x[:, 1] + 0.05 * np.sin(3.0 * x[:, 0]) * np.cos(2.0 * x[:, 2]), x[:, 2]]
    )


def body(divisions: tuple[int, ...] = (12, 2, 12)) -> tuple[Any, Any]:
    mesh, tags = build_mesh(
        BlockMesh(lengths=(1.0, 0.3, 1.0), divisions=divisions, deform=wavy), COMM
    )
    return assemble(mesh, SOFT), tags


class Weighed(MpiComm):
    """Weigh the arrays that are gathered."""

    gathered = 0

    def gather(self, value: Any) -> Any:
        parts = value if isinstance(value, tuple) else (value,)
        self.gathered += sum(part.nbytes for part in parts if isinstance(part, np.ndarray))
        return super().gather(value)


def test_numbers_alone_are_gathered():
    """A smooth boundary of 169 nodes gathers no facet, but six times their numbers: before and
    after faces of one direction are joined, and four times in the search for hinges; and what ranks
    tell of nodes that they share.

    Friction and redistributed mass gather shared neighbours only."""
    system, tags = body()
    space, friction = system.space, Coulomb(0.3)
    assert not len(gather_boundary(space, tags["bottom"], beyond=0.5).vertices)
    space.comm = system.algebra.comm = weighed = Weighed(COMM)
    surface = contact_surface(system, tags["bottom"])
    # up to two cuts, seen from both sides: number and box
    shared = 0 if COMM.size == 1 else 4 * 13 * 8 * (1 + 2 * 3)
    shared *= 4  # facets round these nodes, and their parts, in the search for hinges
    own = len(nodes_on(space, tags["bottom"]).numbers)
    assert 48 * own <= weighed.gathered <= 48 * own + shared
    weighed.gathered = 0
    assert ContactProblem(
        system, surface, friction=friction, mass=Redistributed()
    ).equations.massless.any()
    # columns asked for, then unknowns told of
    neighbours = 0 if COMM.size == 1 else 4 * 3 * 13 * 3 * 8 * (1 + 8)
    assert weighed.gathered <= neighbours


def test_slots_do_not_depend_on_the_ranks():
    """Keys of all ranks in one order, those of one node after one another."""
    keys = np.sort(
        np.concatenate(
            [np.arange(COMM.rank, 20, COMM.size), np.arange(COMM.rank, 20, 5 * COMM.size)]
        )
    )
    found = slots_of(MpiComm(COMM), keys)
    every = np.sort(np.concatenate(COMM.allgather(keys)))
    assert np.array_equal(every[found], keys) and np.all(np.diff(found) > 0)
    assert np.array_equal(np.sort(np.concatenate(COMM.allgather(found))), np.arange(len(every)))


def test_what_one_rank_refuses_all_refuse():
    """With the first place in the order of the numbers, whichever rank owns it; what only seemed
    wrong is answered."""
    slots = np.arange(COMM.rank, 12, COMM.size)

    def refuse(values: Array) -> tuple[Any, ...]:
        for value in values[values > 5]:
            raise InputError(f"{value} is too large")
        return (2 * values,)

    with pytest.raises(InputError, match="^6 is too large"):
        ask_alike(MpiComm(COMM), slots, refuse, slots.copy())

    def all_or_none(values: Array) -> tuple[Any, ...]:
        if 0 not in values:
            raise InputError("the first is missing")
        return (2 * values,)

    assert np.array_equal(ask_alike(MpiComm(COMM), slots, all_or_none, slots.copy())[0], 2 * slots)


def test_obstacles_that_fail_at_one_place():
    """A user's function that raises at points of one rank ends on all ranks, and the deepest point
    is named on all."""
    system, tags = body((4, 1, 4))

    def broken(x: Array) -> Array:
        if np.any(x[:, 0] > 0.99):
            raise ValueError("too far")
        return np.zeros(len(x))

    with pytest.raises(ValueError, match="too far"):
        contact_surface(system, tags["bottom"], obstacle=AnalyticGap(broken))
    with pytest.raises(InputError, match=r"penetrates its obstacle by 1 m at \(1, .*, 0\)"):
        contact_surface(system, tags["bottom"], obstacle=AnalyticGap(lambda x: -x[:, 0]))


def all_rows(matrix: Any) -> Array:
    """A matrix as a dense array on every rank, in the order of the ranks."""
    mat = matrix.mat
    rows = mat.getValues(range(*mat.getOwnershipRange()), range(mat.getSize()[1]))
    return np.vstack(COMM.allgather(rows))


@pytest.mark.parametrize("simplices", [False, True])
def test_rows_of_matrices(simplices):
    """Many rows are taken, and put in place of others, at a time: as the dense matrix has them."""
    mesh, _ = build_mesh(BlockMesh(divisions=(4, 3), simplices=simplices), COMM)
    system = assemble(mesh, SOFT)
    algebra, whole = system.algebra, all_rows(system.K)
    first, rows = algebra.first(system.rows), np.arange(1, system.rows, 3)
    entries = algebra.entries(system.K, rows)
    assert np.array_equal(entries.toarray(), whole[first + rows])
    replaced = all_rows(algebra.replace_identity_rows(system.rows, rows, entries))
    wanted = np.eye(len(whole))
    every = np.concatenate(COMM.allgather(first + rows))
    wanted[every] = whole[every]
    assert np.array_equal(replaced, wanted)
