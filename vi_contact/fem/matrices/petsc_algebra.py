"""Implement the algebra protocol on PETSc matrices, on any number of ranks.

Vectors are numpy arrays of the entries that a rank owns (``core.algebra``). Every product goes
through two PETSc vectors whose memory is shared by all matrices of one size. Which factorisation is
taken: ``PetscFactor``.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cached_property
from typing import Any
from weakref import WeakValueDictionary

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc

from ...core.algebra import Array, Factor, Indices, Mask, Matrix, build_identity_with_rows, total
from ...kernels.contact_last import ContactLast
from ..mesh.communicators import MpiComm, give_back
from .copied_factor import contact_last, make_product_of_rows
from .direct import by_mumps, complete_pattern, failure, finite, ordering, own_serves
from .petsc_rows import aij_of, rows_of
from .product_formats import copy_for_products

PREFIX = "vi_contact_factor_"
OWN_FACTOR = {"ksp_type": "preonly", "pc_factor_mat_solver_type": "petsc"}
# options that choose no other factor
TUNING = ("redundant_", "mat_mumps_icntl_14", "mat_mumps_icntl_20")
_ENTRY = 8 + np.dtype(PETSc.IntType).itemsize  # bytes of an entry and its column
RIGHT_SIDES = 64  # right-hand sides per block solve: bounds the memory of the dense blocks


def _make_vector(comm: Any, size: int, way: int) -> tuple[Array, Any]:
    """Return an array that matrices of one size share, and a PETSc vector in it.

    A product needs it only for as long as it takes, so that a vector for each matrix would waste
    memory.

    Args:
        comm: the communicator.
        size: how many entries this rank owns.
        way: 1 for what a matrix takes, 0 for what it makes.
    """
    room = _ROOM.get((size, way))
    if room is None:
        _ROOM[size, way] = room = np.zeros(size)
    return room, PETSc.Vec().createWithArray(room, (size, None), comm=comm)


# the shared arrays by (size, way); one goes with the last matrix that uses it
_ROOM: WeakValueDictionary[tuple[int, int], Array] = WeakValueDictionary()


class PetscMatrix:
    """Hold an AIJ matrix behind the ``Matrix`` protocol.

    ``stored`` is the PETSc object, ``mat`` too unless it is stored otherwise: then it is made anew
    (``fem.matrices.half``). Products may be made by a copy in another format
    (``fem.matrices.product_formats``).
    """

    def __init__(self, mat: Any) -> None:
        self.stored = mat
        self._expects_products = False
        rows, columns = mat.getLocalSize()
        self._in, self._x = _make_vector(mat.comm, columns, 1)
        self._out, self._y = _make_vector(mat.comm, rows, 0)

    @property
    def mat(self) -> Any:
        """Return the PETSc matrix."""
        return self.stored

    @property
    def rows(self) -> int:
        """Return how many rows this rank owns."""
        return int(self.stored.getLocalSize()[0])

    @property
    def bytes(self) -> float:
        """Return the bytes of the entries of this rank and their columns, the copy's too."""
        size = _count_bytes(self.stored)
        copy = self.__dict__.get("_multiplied", self.stored)
        return size if copy is self.stored else size + _count_bytes(copy)

    def expect_products(self) -> None:
        """Say that many products follow, for which the next one may make a copy of the matrix."""
        if not self._expects_products:
            self._expects_products = True
            self.forget_copy()

    def forget_copy(self) -> None:
        """Forget the copy for products, which the next product makes again."""
        self.__dict__.pop("_multiplied", None)

    @property
    def product_format(self) -> str:
        """Return PETSc's name of the type that products read: aij, baij, sbaij or sell. Collective.

        The first call may make the copy.
        """
        return str(self._multiplied.getType()).removeprefix("seq").removeprefix("mpi")

    @cached_property
    def _multiplied(self) -> Any:
        """Return the PETSc matrix by which products are made."""
        if not self._expects_products:
            return self.stored
        return copy_for_products(self.stored, MpiComm(self.stored.comm.tompi4py()))

    def __matmul__(self, x: Array) -> Array:
        if x.ndim == 2:
            return self._rows_by(x)
        self._in[:] = x
        self._multiplied.mult(self._x, self._y)
        return self._out.copy()

    @cached_property
    def _rows_by(self) -> Callable[[Array], Array]:
        return make_product_of_rows(self)

    def transpose_apply(self, x: Array) -> Array:
        """Return Aᵀ x."""
        self._out[:] = x
        self.stored.multTranspose(self._y, self._x)
        return self._in.copy()

    def diagonal(self) -> Array:
        """Return the diagonal entries of the owned rows."""
        return np.array(self.stored.getDiagonal().array_r)


def _count_bytes(mat: Any) -> float:
    """Return the bytes of the entries of this rank of a PETSc matrix and of their columns.

    In blocks of b² entries, these share one column.
    """
    entries = float(mat.getInfo(PETSc.Mat.InfoType.LOCAL)["nz_allocated"])
    width = mat.getBlockSize() if mat.getType().endswith("baij") else 1
    return entries * (8.0 + (_ENTRY - 8.0) / width**2)


class PetscFactor:
    """Factorise a matrix by PETSc, A = L Lᵀ or A = L U, and solve with the factor.

    This serves matrices without contact unknowns, and all where CHOLMOD is missing
    (``copied_factor``). PETSc's own factorisation with minimum degree ordering is taken where it is
    the better one (``own_serves``): its substitutions are 4 to 15 times as fast as those of MUMPS.
    On several ranks each keeps a whole copy of it, so that results do not depend on the order of
    messages, as those of MUMPS do. MUMPS takes the rest: large 3D matrices on several ranks, and
    what is too large to be copied. Where PETSc has no MUMPS its own factorisation takes all, and
    without SuiteSparse nested dissection orders it; the log says so. Options with the prefix
    vi_contact_factor_ choose otherwise.

    Raises:
        InputError: the matrix cannot be factorised.
    """

    def __init__(self, matrix: PetscMatrix, *, symmetric: bool = True) -> None:
        """Factorise. Collective.

        Args:
            matrix: A, square.
            symmetric: whether A is symmetric and positive definite; else its LU is computed, by
                MUMPS where PETSc has it.
        """
        mat = matrix.mat
        by_blocks = by_mumps(mat, symmetric=symmetric, own=bool(PETSc.Options(PREFIX).getAll()))
        if symmetric and not by_blocks:
            mat = complete_pattern(mat)
        mat.setOption(PETSc.Mat.Option.SYMMETRIC, symmetric)
        kind = "cholesky" if symmetric else "lu"
        self._mat = mat
        self._b, self._x = mat.createVecs()
        self._pc = PETSc.PC().create(mat.comm)
        self._pc.setOptionsPrefix(PREFIX)
        self._pc.setOperators(mat)
        self._by_blocks = by_blocks
        defaults: dict[str, object] = {}
        if self._by_blocks:
            self._pc.setType(kind)
            self._pc.setFactorSolverType("mumps")
            # MUMPS may crash on distributed right-hand sides; on busy ranks 20 % of spare room may
            # be too little (-9)
            defaults = {"mat_mumps_icntl_14": 100, "mat_mumps_icntl_20": 0}
        elif mat.comm.size == 1:
            self._pc.setType(kind)
            self._pc.setFactorSolverType("petsc")
            self._pc.setFactorOrdering(ordering())
        else:
            self._pc.setType("redundant")
            own = OWN_FACTOR | {"pc_type": kind, "pc_factor_mat_ordering_type": ordering()}
            defaults = {f"redundant_{name}": value for name, value in own.items()}
        with _default_options(defaults):
            self._pc.setFromOptions()
            self._by_blocks = self._by_blocks and self._pc.getType() == kind
            self._set_up()

    def _set_up(self) -> None:
        """Factorise, and try the factor on a vector of ones; InputError where it fails."""
        try:
            self._pc.setUp()
            self._b.set(1.0)
            # PETSc fills the answer with infinity when the factorisation failed
            self._pc.apply(self._b, self._x)
            succeeded = finite(self._x)
        except PETSc.Error as error:
            raise failure(self._pc, self._mat, error) from error
        if not succeeded:
            raise failure(self._pc, self._mat)

    @property
    def bytes(self) -> float:
        """Return the bytes of the entries, an equal share on each rank.

        They are 0 for factors that do not tell, such as copies (PETSc's ``redundant``).
        """
        if self._pc.getType() not in ("cholesky", "lu"):
            return 0.0
        count = self._pc.getFactorMatrix().getInfo()["nz_used"]
        if count < 0.0:
            count = -1e6 * count  # MUMPS gives large numbers in millions, as negative ones
        return _ENTRY * count / self._b.comm.size

    def solve(self, b: Array) -> Array:
        """Return A⁻¹ b."""
        self._b.array[:] = b
        self._pc.apply(self._b, self._x)
        return np.array(self._x.array_r)

    def solve_units(
        self, owned: Indices, slots: Indices, m: int, rows: Indices | None = None
    ) -> Array:
        """Return the columns A⁻¹ e_j for m unit vectors, as ``Factor`` says.

        Args:
            owned: owned unknowns j of some of the unit vectors.
            slots: their columns.
            m: how many unit vectors there are on all ranks.
            rows: owned rows that are asked for, all when None.
        """
        size = self._x.getLocalSize()
        if rows is None:
            rows = np.arange(size)
        # RIGHT_SIDES columns at a time, of which only the rows that are asked for are kept
        columns = np.zeros((len(rows), m))
        for first in range(0, m, RIGHT_SIDES):
            width = min(RIGHT_SIDES, m - first)
            units = np.zeros((size, width))
            mine = (slots >= first) & (slots < first + width)
            units[owned[mine], slots[mine] - first] = 1.0
            if self._by_blocks:
                columns[:, first : first + width] = self._solve_block(units)[rows]
            else:
                for column in range(width):
                    columns[:, first + column] = self.solve(units[:, column])[rows]
        return columns

    def _solve_block(self, values: Array) -> Array:
        """Return A⁻¹ B of the owned rows (n, k) of B, solved at once: faster so with MUMPS."""
        shape = ((len(values), self._x.getSize()), (None, values.shape[1]))
        right, solved = (PETSc.Mat().createDense(shape, comm=self._x.comm) for _ in range(2))
        for matrix in (right, solved):
            matrix.setUp()
        right.getDenseArray()[:] = values
        for matrix in (right, solved):
            matrix.assemble()
        self._pc.getFactorMatrix().matSolve(right, solved)
        result = np.array(solved.getDenseArray())
        right.destroy()
        solved.destroy()
        return result


@contextmanager
def _default_options(values: Mapping[str, object]) -> Iterator[None]:
    """Set PETSc options of the factor, for as long as it is made.

    An option that the user has given keeps the user's value.
    """
    database = PETSc.Options(PREFIX)
    added = [name for name in values if not database.hasName(name)]
    for name in added:
        database[name] = values[name]
    try:
        yield
    finally:
        for name in added:
            del database[name]


class PetscAlgebra:
    """Make and combine PETSc matrices on one communicator.

    ``symmetric``: whether those of its system are. ``keeps_whole``: whether it stores matrices that
    are not, as a tangent.
    """

    symmetric = True
    keeps_whole = True

    def __init__(self, comm: Any) -> None:
        self.comm = MpiComm(comm)

    def unsymmetric(self) -> "UnsymmetricAlgebra":
        """Return the algebra of matrices that are not symmetric, on the same ranks."""
        return UnsymmetricAlgebra(self.comm.mpi)

    def combine(self, terms: Sequence[tuple[float, Matrix]]) -> Matrix:
        """Return the sum of factor times matrix over the terms (factor, matrix). Collective."""
        total = None
        give_back(self.comm.mpi)
        for factor, matrix in terms:
            # a matrix that is stored compactly makes ``mat`` anew, which may be overwritten here
            mat = as_petsc(matrix).mat
            stored = mat is as_petsc(matrix).stored
            if total is None:
                total = mat.copy() if stored else mat
                total.scale(factor)
            else:
                # M, C and K come from the same mesh and space: same sparsity unless a basis change
                # dropped entries
                total.axpy(factor, mat, structure=PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
                if not stored:
                    mat.destroy()
        if total is None:
            raise ValueError("combine: give at least one term")
        return self.store(total)

    def store(self, mat: Any) -> PetscMatrix:
        """Return a PETSc matrix as this algebra stores it; nobody else may need ``mat``."""
        return PetscMatrix(mat)

    def congruence(self, T: Matrix, K: Matrix) -> Matrix:
        """Return Tᵀ K T. K is hardly multiplied from now on: its copy for products goes."""
        turned = self.store(triple_product(as_petsc(K).mat, as_petsc(T).mat))
        as_petsc(K).forget_copy()
        return turned

    def local(self, rows: Indices, columns: Indices, values: Array, n: int) -> Matrix:
        """Return the matrix of entries between the n unknowns of one rank.

        Args:
            rows: owned rows.
            columns: owned columns.
            values: entries.
            n: how many unknowns this rank owns.
        """
        places = (rows, self.first(n) + np.asarray(columns))
        every = int(self.comm.mpi.allreduce(n))
        return PetscMatrix(aij_of(sp.coo_matrix((values, places), shape=(n, every)), self.comm.mpi))

    def first(self, n: int) -> int:
        """Return the number of the first of the n unknowns that this rank owns."""
        return int(self.comm.mpi.exscan(n) or 0)

    def entries(self, A: Matrix, rows: Indices) -> sp.csr_matrix:
        """Return these owned rows of A, their columns numbered over all ranks."""
        mat = as_petsc(A).mat
        start, _ = mat.getOwnershipRange()
        first, last = mat.getOwnershipRangeColumn()
        chosen = PETSc.IS().createGeneral((start + rows).astype(PETSc.IntType), comm=mat.comm)
        whole = PETSc.IS().createStride(last - first, first, 1, comm=mat.comm)
        part = mat.createSubMatrix(chosen, whole)
        entries = rows_of(part)
        part.destroy()
        return entries

    def replace_identity_rows(self, n: int, rows: Indices, entries: sp.csr_matrix) -> Matrix:
        """Return the identity of n owned rows with some of them replaced.

        Args:
            n: how many rows this rank owns.
            rows: which of them are replaced.
            entries: (rows, unknowns of all ranks) what takes their place.
        """
        return PetscMatrix(
            aij_of(build_identity_with_rows(n, rows, entries, first=self.first(n)), self.comm.mpi)
        )

    def with_identity_rows(self, A: Matrix, mask: Mask) -> Matrix:
        """Return A with the rows and columns of masked unknowns replaced by the identity's."""
        every = np.arange(len(mask))
        # a row of zeros may have no diagonal entry
        ones = self.local(every, every, mask.astype(float), len(mask))
        mat = as_petsc(self.combine([(1.0, A), (1.0, ones)])).mat
        rows = (mat.getOwnershipRange()[0] + np.flatnonzero(mask)).astype(PETSc.IntType)
        mat.zeroRowsColumns(rows, diag=1.0)
        return PetscMatrix(mat)

    def block(self, A: Matrix, mask: Mask) -> Matrix:
        """Return the rows and columns of A of the masked unknowns."""
        chosen = make_index_set(as_petsc(A), mask)
        return PetscMatrix(as_petsc(A).mat.createSubMatrix(chosen, chosen))

    def factor(self, A: Matrix) -> Factor:
        """Return a factor of A."""
        return PetscFactor(as_petsc(A))

    def contact_last(self, A: Matrix, last: Indices) -> ContactLast | None:
        """Return a factor with these unknowns last, or None where there is none."""
        mat = as_petsc(A).mat
        # options of the user, but for those of tuning, choose PETSc's factor
        options = PETSc.Options(PREFIX).getAll()
        if any(not name.startswith(TUNING) for name in options):
            return None
        if self.comm.size > 1 and not own_serves(mat):
            return None  # each rank would hold too large a copy
        return contact_last(self.comm, mat, last)

    def dot(self, x: Array, y: Array) -> float:
        """Return x·y over all ranks."""
        return total(self.comm, x @ y)


class UnsymmetricAlgebra(PetscAlgebra):
    """Make and combine the matrices of a system of which some is not symmetric."""

    symmetric = False

    def factor(self, A: Matrix) -> Factor:
        """Return a factor of A."""
        return PetscFactor(as_petsc(A), symmetric=False)

    def contact_last(self, A: Matrix, last: Indices) -> None:
        """Return None: there is no factor with these unknowns last."""
        return None


def make_index_set(A: PetscMatrix, mask: Mask) -> Any:
    """Return PETSc's index set of the owned rows that are masked."""
    rows = A.mat.getOwnershipRange()[0] + np.flatnonzero(mask)
    return PETSc.IS().createGeneral(rows.astype(PETSc.IntType), comm=A.mat.comm)


def triple_product(K: Any, P: Any) -> Any:
    """Return PᵀKP of PETSc matrices. Collective.

    The product that PETSc makes holds K and P for as long as it lives; hence a copy is returned.
    """
    give_back(K.comm)
    product = K.PtAP(P)
    copy = product.duplicate(copy=True)
    product.destroy()
    return copy


def as_petsc(matrix: Matrix) -> PetscMatrix:
    """Return the matrix as a PetscMatrix; TypeError when it belongs to another algebra."""
    if not isinstance(matrix, PetscMatrix):
        raise TypeError(f"PetscAlgebra got a {type(matrix).__name__}; give a PetscMatrix")
    return matrix
