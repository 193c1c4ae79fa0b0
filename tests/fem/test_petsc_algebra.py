"""The algebra protocol on PETSc matrices: the same answers as scipy's, for any number of ranks and
any row layout."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from mpi4py import MPI
from petsc4py import PETSc

from vi_contact.core.algebra import Array, SerialAlgebra, SerialMatrix
from vi_contact.core.errors import InputError
from vi_contact.fem.matrices.petsc_algebra import RIGHT_SIDES, PetscAlgebra, PetscMatrix
from vi_contact.fem.mesh.communicators import MpiComm

COMM = MPI.COMM_WORLD
N = 200


def layout(empty_rank: bool = False) -> tuple[int, int]:
    """First and last row of this rank; with ``empty_rank`` the last rank owns nothing, as on a tiny
    mesh."""
    sharing = max(COMM.size - 1, 1) if empty_rank else COMM.size
    ends = [N * min(rank, sharing) // sharing for rank in range(COMM.size + 1)]
    return ends[COMM.rank], ends[COMM.rank + 1]


def spd(seed: int, reach: int) -> sp.csr_matrix:
    """A sparse symmetric positive definite matrix with some far couplings, the same on all
    ranks."""
    rng = np.random.default_rng(seed)
    near = sp.diags(
        [rng.normal(size=N - k) for k in range(1, reach + 1)], range(1, reach + 1), shape=(N, N)
    )
    far = sp.random(N, N, density=2.0 / N, random_state=rng)
    upper = sp.triu(near + far, k=1)
    matrix = upper + upper.T
    return sp.csr_matrix(matrix + sp.diags(np.asarray(abs(matrix).sum(axis=1)).ravel() + 1.0))


def distributed(matrix: sp.csr_matrix, empty_rank: bool = False) -> PetscMatrix:
    first, last = layout(empty_rank)
    rows = sp.csr_matrix(matrix[first:last])
    arrays = (rows.indptr.astype(PETSc.IntType), rows.indices.astype(PETSc.IntType), rows.data)
    size = (last - first, N)
    mat = PETSc.Mat().createAIJ((size, size), csr=arrays, comm=COMM)
    mat.assemble()
    return PetscMatrix(mat)


def owned(x: Array, empty_rank: bool = False) -> Array:
    first, last = layout(empty_rank)
    return np.array(x[first:last])


def everywhere(x: Array) -> Array:
    return np.concatenate(COMM.allgather(x))


def close(found: Array, expected: Array, digits: float = 1e-13) -> bool:
    """Compared with the largest entry, on all ranks."""
    return bool(np.abs(everywhere(found) - expected).max() <= digits * np.abs(expected).max())


X = np.random.default_rng(5).normal(size=N)
BOTH = pytest.mark.parametrize("empty_rank", [False, True])


@BOTH
def test_products(empty_rank):
    """A x, Aᵀ x of an unsymmetric matrix, and the diagonal."""
    matrix = spd(1, 3) + sp.diags([np.arange(N - 1.0)], [1])
    A, x = distributed(matrix, empty_rank), owned(X, empty_rank)
    assert A.rows == len(x)
    assert close(A @ x, matrix @ X)
    assert close(A.transpose_apply(x), matrix.T @ X)
    assert close(A.diagonal(), matrix.diagonal(), 0.0)


def test_products_own_their_answer():
    """The next product must not overwrite the last one's result, nor its argument."""
    A, x = distributed(spd(1, 3)), owned(X)
    first = A @ x
    kept, argument = first.copy(), x.copy()
    A @ (2.0 * x)
    A.transpose_apply(3.0 * x)
    assert np.array_equal(first, kept) and np.array_equal(x, argument)


@BOTH
def test_combine_matrices_of_different_sparsity(empty_rank):
    """A = 2 M + K with other nonzeros in K than in M; the terms stay as they are."""
    m, k = spd(1, 1), spd(2, 4)
    M, K = distributed(m, empty_rank), distributed(k, empty_rank)
    A = PetscAlgebra(COMM).combine([(2.0, M), (1.0, K), (-0.5, M)])
    x = owned(X, empty_rank)
    assert close(A @ x, 1.5 * (m @ X) + k @ X)
    assert close(M @ x, m @ X) and close(K @ x, k @ X)


def test_congruence():
    """Tᵀ K T for a rotation of neighbouring unknowns, as scipy's."""
    c, s = np.cos(0.3), np.sin(0.3)
    turn = sp.csr_matrix(sp.block_diag([np.array([[c, -s], [s, c]])] * (N // 2)))
    k = spd(3, 2)
    A = PetscAlgebra(COMM).congruence(distributed(turn), distributed(k))
    B = SerialAlgebra().congruence(SerialMatrix(turn), SerialMatrix(k))
    assert close(A @ owned(X), B @ X)
    assert np.abs(everywhere(A.diagonal()) - B.diagonal()).max() < 1e-12 * B.diagonal().max()


@BOTH
def test_factor_solves(empty_rank):
    matrix = spd(4, 3)
    factor = PetscAlgebra(COMM).factor(distributed(matrix, empty_rank))
    for _ in range(2):
        assert close(factor.solve(owned(matrix @ X, empty_rank)), X, 1e-11)
    b = owned(matrix @ X, empty_rank)
    kept = b.copy()
    factor.solve(b)
    assert np.array_equal(b, kept)


@BOTH
@pytest.mark.parametrize("m", [0, 1, 5, RIGHT_SIDES, 2 * RIGHT_SIDES + 7])
def test_columns_of_the_inverse(empty_rank, m):
    """A^-1 e_j in the order of the slots, across several blocks of right-hand sides, wherever the
    rows live."""
    matrix = spd(4, 3)
    rows = np.random.default_rng(6).permutation(N)[:m]  # slot -> global row
    first, last = layout(empty_rank)
    slots = np.flatnonzero((rows >= first) & (rows < last))[::-1]  # in any order
    factor = PetscAlgebra(COMM).factor(distributed(matrix, empty_rank))
    columns = factor.solve_units(rows[slots] - first, slots, m)
    assert columns.shape == (last - first, m)
    some = np.arange(last - first)[::-3]
    assert np.array_equal(factor.solve_units(rows[slots] - first, slots, m, some), columns[some])
    expected = np.linalg.inv(matrix.toarray())[:, rows]
    found = np.concatenate(COMM.allgather(columns))
    assert np.abs(found - expected).max(initial=0.0) <= 1e-12 * np.abs(expected).max(initial=1.0)


@pytest.mark.parametrize("value", [0.0, float("nan")])
def test_a_matrix_that_cannot_be_factorised(value):
    """Singular (an unknown without stiffness and mass) or NaN: one sentence, on all ranks."""
    matrix = spd(4, 1).tolil()
    matrix[17, :] = matrix[:, 17] = 0.0
    matrix[17, 17] = value
    with pytest.raises(
        InputError,
        match="the effective matrix cannot be factorised: it is singular or contains NaN",
    ):
        PetscAlgebra(COMM).factor(distributed(sp.csr_matrix(matrix)))


def test_dot_is_the_same_number_on_all_ranks():
    algebra = PetscAlgebra(COMM)
    found = COMM.allgather(algebra.dot(owned(X), owned(2.0 * X)))
    assert len(set(found)) == 1
    assert found[0] == pytest.approx(2.0 * X @ X, rel=1e-14)


def test_comm_reduces_arrays():
    comm = MpiComm(COMM)
    mine = np.array([float(COMM.rank), -float(COMM.rank), 1.0])
    total = COMM.size * (COMM.size - 1) / 2.0
    assert comm.sum(mine).tolist() == [total, -total, COMM.size]
    assert comm.max(mine).tolist() == [COMM.size - 1.0, 0.0, 1.0]
    assert comm.sum(np.zeros(0)).shape == (0,)
    assert comm.bcast(COMM.rank) == 0
    assert comm.gather(COMM.rank) == (list(range(COMM.size)) if COMM.rank == 0 else None)
    assert mine.tolist() == [float(COMM.rank), -float(COMM.rank), 1.0]


def test_foreign_matrices_are_refused():
    algebra = PetscAlgebra(COMM)
    with pytest.raises(TypeError, match="PetscAlgebra got a SerialMatrix"):
        algebra.factor(SerialMatrix(sp.identity(3)))
    with pytest.raises(ValueError, match="at least one term"):
        algebra.combine([])
