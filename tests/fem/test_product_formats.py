"""How matrices are stored for products: the choice by counts, and products as those of AIJ, for
every kind of matrix, on any ranks."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from mpi4py import MPI

from vi_contact.core.algebra import Array, SerialComm, expect_products
from vi_contact.fem.matrices import product_formats
from vi_contact.fem.matrices.petsc_algebra import PetscAlgebra, PetscMatrix
from vi_contact.fem.matrices.petsc_rows import aij_of, rows_of
from vi_contact.fem.matrices.product_formats import Counts, choose_format, count_entries

COMM = MPI.COMM_WORLD
CLOSE = 1e-14  # of the sum of absolute terms: they are added in another order


def grid(width: int, *, coupled: bool, along: int = 12) -> sp.csr_matrix:
    """A matrix on a square of nodes that are coupled with their eight neighbours.

    A node has ``width`` unknowns; where they are not coupled, zeros are stored, as in a mass."""
    line = sp.diags([1.0, 4.0, 1.0], [-1, 0, 1], shape=(along, along))
    nodes = sp.coo_matrix(sp.kron(line, line))
    nodes.eliminate_zeros()
    block = np.add.outer(np.arange(width), 2.0 * np.arange(width)) + 3.0
    if not coupled:
        block = np.diag(np.diag(block))
    first, second = np.indices((width, width)).reshape(2, -1)
    row = (width * nodes.row[:, None] + first).ravel()
    column = (width * nodes.col[:, None] + second).ravel()
    values = np.outer(nodes.data, block.ravel()).ravel()
    return sp.csr_matrix(sp.coo_matrix((values, (row, column))))


def distributed(matrix: sp.csr_matrix, nodes_of: int) -> tuple[PetscMatrix, slice]:
    """The matrix on all ranks, in whole groups of ``nodes_of`` rows, with its owned rows."""
    groups = matrix.shape[0] // nodes_of
    first, last = (nodes_of * (groups * rank // COMM.size) for rank in (COMM.rank, COMM.rank + 1))
    mine = slice(first, last)
    return PetscMatrix(aij_of(matrix[mine], COMM)), mine


def alike(A: PetscMatrix, matrix: sp.csr_matrix, mine: slice) -> bool:
    """Whether products are those of scipy."""
    x = np.sin(1.0 + np.arange(matrix.shape[0]) ** 1.5)
    return within(A @ x[mine], (matrix @ x)[mine], (abs(matrix) @ abs(x))[mine])


def formats(coupled: bool) -> tuple[str, ...]:
    """The formats that may be found: AIJ too where this PETSc multiplies SELL of ranks wrongly."""
    if coupled:
        return ("baij",)
    return ("sell",) if COMM.size == 1 else ("sell", "aij")


def within(found: Array, expected: Array, size: Array) -> bool:
    worst = float(np.max(np.abs(found - expected) - CLOSE * size, initial=-1.0))
    return COMM.allreduce(worst, MPI.MAX) <= 0.0


@pytest.mark.parametrize(
    ("entries", "padded", "blocks", "expected"),
    [
        # K in the plane, 18 entries a row: blocks share columns
        (1800.0, 1900.0, {2: 1800.0}, "baij2"),
        # M there: half of the entries are zeros
        (1800.0, 950.0, {2: 1800.0}, "sell"),
        # nodes with some of their components: blocks with a fifth more entries, or with too many
        (1800.0, 1900.0, {2: 2100.0}, "baij2"),
        (1800.0, 1900.0, {2: 2200.0}, "aij"),
        # rows that no width divides, with long rows in some slices
        (1800.0, 1700.0, {}, "aij"),
        (1800.0, 1600.0, {}, "sell"),
        # in space rows are long
        (7500.0, 7700.0, {3: 7500.0, 2: 9900.0}, "baij3"),
        (7500.0, 7700.0, {}, "sell"),
        (7500.0, 2600.0, {3: 7500.0}, "sell"),
        # nothing stored
        (0.0, 0.0, {2: 0.0, 3: 0.0}, "aij"),
    ],
)
def test_the_format_with_the_fewest_bytes(entries, padded, blocks, expected):
    """Of 100 rows, by hand: AIJ 12 bytes an entry (24 beyond 40 entries a row), SELL 12, blocks
    9 and 8.44; a copy is made below 0.9 of AIJ's."""
    assert choose_format(Counts(100.0, entries, padded, blocks)) == expected


def test_counts_by_hand():
    """Twelve rows of a band, with one zero and one long row: slices of eight rows are as long as
    their longest row."""
    dense = np.diag(np.full(12, 2.0)) + np.diag(np.ones(11), 1) + np.diag(np.ones(11), -1)
    dense[9] = 1.0
    rows = sp.csr_matrix(dense)
    rows.data[1] = 0.0
    found = count_entries(rows, SerialComm())
    assert (found.rows, found.entries) == (12.0, 34.0 + 9.0)
    assert found.padded == 8 * 3 + 8 * 12
    # blocks of two rows: two, three, three, three, six, two
    assert found.blocks[2] == 4 * (2 + 3 + 3 + 3 + 6 + 2)
    # of three: two, three, three, and the long row alone
    assert found.blocks[3] == 9 * (2 + 3 + 3 + 4)


@pytest.mark.parametrize("width", [2, 3])
@pytest.mark.parametrize("coupled", [False, True])
def test_products_of_nodes(width, coupled):
    """A stiffness is multiplied in blocks and a mass in slices, once many products are expected;
    what factorisations and other readers see stays AIJ."""
    matrix = grid(width, coupled=coupled)
    A, mine = distributed(matrix, width)
    assert A.product_format == "aij" and alike(A, matrix, mine)
    size = A.bytes
    expect_products(A, None)
    assert alike(A, matrix, mine)
    assert A.product_format in formats(coupled)
    assert A.mat.getType() in ("seqaij", "mpiaij")
    assert abs(rows_of(A.mat) - matrix[mine]).nnz == 0
    x = np.cos(np.arange(matrix.shape[0]))
    assert within(A.transpose_apply(x[mine]), (matrix.T @ x)[mine], (abs(matrix.T) @ abs(x))[mine])
    # the copy of a rank is no larger than its AIJ matrix
    assert size <= A.bytes <= 2.0 * size
    assert (size < A.bytes) == (A.product_format != "aij")


def test_nodes_that_are_shared_out():
    """Where a rank owns a part of a node there are no blocks, and products are the same."""
    matrix = grid(2, coupled=True, along=13)
    A, mine = distributed(matrix, 1)
    split = COMM.allreduce((mine.stop - mine.start) % 2)
    expect_products(A)
    assert alike(A, matrix, mine)
    assert A.product_format == ("aij" if split else "baij")


@pytest.mark.parametrize("owner", range(COMM.size))
def test_a_rank_without_rows(owner):
    """All rows on one rank, the others own none."""
    for coupled in (False, True):
        matrix = grid(3, coupled=coupled, along=5)
        mine = slice(0, matrix.shape[0] if COMM.rank == owner else 0)
        A = PetscMatrix(aij_of(matrix[mine], COMM))
        expect_products(A)
        assert alike(A, matrix, mine)
        assert A.product_format in formats(coupled)


@pytest.mark.parametrize("kind", ["_make_blocks", "_make_sell"])
@pytest.mark.parametrize("owner", range(COMM.size))
def test_a_copy_that_multiplies_wrongly_is_not_used(kind, owner, monkeypatch):
    """PETSc 3.22 has such SELL on several ranks: energies were wrong by 8 per cent. One entry of
    one rank is wrong here, by a thousandth or not a number."""
    matrix = grid(3, coupled=kind == "_make_blocks")
    make = getattr(product_formats, kind)
    for factor in (1.001, np.nan):

        def make_wrong(rows: sp.csr_matrix, mat: Any, *width: int, by: float = factor) -> Any:
            wrong = rows.copy()
            if COMM.rank == owner:
                wrong.data[-1] *= by
            return make(wrong, mat, *width)

        monkeypatch.setattr(product_formats, kind, make_wrong)
        A, mine = distributed(matrix, 3)
        expect_products(A)
        assert alike(A, matrix, mine)
        assert A.product_format == "aij"


def test_products_are_the_same_every_time():
    """To the last bit: of a matrix made anew, and after a change of basis forgot its copy."""
    matrix = grid(2, coupled=True)
    x = np.sin(np.arange(matrix.shape[0]))
    A, mine = distributed(matrix, 2)
    again, _ = distributed(matrix, 2)
    expect_products(A, again)
    first = A @ x[mine]
    c, s = np.cos(0.3), np.sin(0.3)
    turn = sp.csr_matrix(sp.block_diag([np.array([[c, -s], [s, c]])] * (matrix.shape[0] // 2)))
    T, _ = distributed(turn, 2)
    turned: Any = PetscAlgebra(COMM).congruence(T, A)
    assert np.array_equal(first, A @ x[mine]) and np.array_equal(first, again @ x[mine])
    expect_products(turned)
    assert alike(turned, sp.csr_matrix(turn.T @ matrix @ turn), mine)


def test_what_is_not_square_stays():
    """Ties and loads multiply matrices of other shapes."""
    tall = sp.csr_matrix(np.arange(12.0 * 4 * COMM.size).reshape(12, -1))
    A = PetscMatrix(aij_of(tall, COMM, 4))
    expect_products(A)
    assert A.product_format == "aij"
    x = np.arange(4.0 * COMM.size)
    mine = slice(4 * COMM.rank, 4 * COMM.rank + 4)
    assert within(A @ x[mine], tall @ x, abs(tall) @ x)


def problems() -> Iterator[tuple[str, Any]]:
    """Systems of finite elements: name, system in the nodal frames."""
    from fem_problems import block

    import vi_contact as vc
    from vi_contact import fem

    material = vc.LinearElastic(E=1e7, nu=0.3, rho=1e3)
    for lengths, divisions in (((1.0, 2.0), (4, 6)), ((1.0, 2.0, 1.0), (2, 3, 2))):
        for simplices in (False, True):
            for degree in (1, 2):
                mesh, tags = block(
                    COMM, lengths=lengths, divisions=divisions, simplices=simplices, angle=0.4
                )
                system = fem.assemble(
                    mesh,
                    material,
                    clamped=tags["top"],
                    prescribed=fem.Prescribed(tags["left"], components=(0,)),
                    degree=degree,
                    damping=vc.Rayleigh(2.0, 1e-4),
                )
                ground = vc.AnalyticGap(lambda x: 1e-4 * (1.0 + x[:, 0] ** 2))
                surface = fem.contact_surface(system, tags["bottom"], obstacle=ground)
                name = f"{len(lengths)}D simplices={simplices} degree={degree}"
                yield name, vc.ContactProblem(system, surface, mass=vc.ConsistentMass())


@pytest.mark.slow
def test_products_of_finite_elements():
    """M, C, K and A, with a clamped side, a side on rollers, and turned contact frames."""
    pytest.importorskip("dolfinx")
    used = set()
    for name, problem in problems():
        for system in (problem.system, problem.equations):
            A = system.effective(m=1e3, c=2.0, k=1.0)
            x = np.sin(np.asarray(system.space.ids, dtype=float))
            for matrix in (system.M, system.C, system.K, A.matrix):
                assert isinstance(matrix, PetscMatrix)
                plain = PetscMatrix(matrix.mat)
                size = PetscMatrix(aij_of(abs(rows_of(matrix.mat)), COMM)) @ abs(x)
                assert within(matrix @ x, plain @ x, size), name
                used.add(matrix.product_format)
    # Which copy of several ranks is right depends on PETSc, and only right ones are used.
    assert ({"sell", "baij"} if COMM.size == 1 else {"baij"}) <= used
