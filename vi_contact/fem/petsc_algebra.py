"""The algebra protocol on PETSc matrices, for any number of ranks. MUMPS factorises; vectors stay numpy arrays."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from mpi4py import MPI
from petsc4py import PETSc

from ..algebra import Array, Comm, Factor, Indices, Matrix
from ..errors import InputError

FULL_ROW = 40.0  # entries of a row: 2D meshes have fewer, 3D meshes more
CHUNK = 64  # right-hand sides per block solve: bounds the memory of the dense blocks


class MpiComm:
    """The collective operations on an MPI communicator."""

    def __init__(self, comm: Any) -> None:
        self.mpi = comm
        self.rank: int = comm.rank
        self.size: int = comm.size

    def _reduce(self, x: Array, operation: Any) -> Array:
        if self.size == 1:
            return x
        total = np.empty_like(x)
        self.mpi.Allreduce(np.ascontiguousarray(x), total, op=operation)
        return total

    def sum(self, x: Array) -> Array:
        return self._reduce(x, MPI.SUM)

    def max(self, x: Array) -> Array:
        return self._reduce(x, MPI.MAX)

    def bcast(self, value: Any) -> Any:
        return self.mpi.bcast(value, root=0)

    def gather(self, value: Any) -> list[Any] | None:
        gathered: list[Any] | None = self.mpi.gather(value, root=0)
        return gathered


class PetscMatrix:
    """An AIJ matrix behind the ``Matrix`` protocol; ``mat`` is the PETSc object."""

    def __init__(self, mat: Any) -> None:
        self.mat = mat
        self._x, self._y = mat.createVecs()

    @property
    def rows(self) -> int:
        return int(self.mat.getLocalSize()[0])

    def __matmul__(self, x: Array) -> Array:
        self._x.array[:] = x
        self.mat.mult(self._x, self._y)
        return np.array(self._y.array_r)

    def transpose_apply(self, x: Array) -> Array:
        self._y.array[:] = x
        self.mat.multTranspose(self._y, self._x)
        return np.array(self._x.array_r)

    def diagonal(self) -> Array:
        return np.array(self.mat.getDiagonal().array_r)


class PetscFactor:
    """A Cholesky factor; ``matrix_factor`` is the PETSc factor matrix.

    On one rank and for sparse rows (2D) PETSc's own factorisation with minimum degree ordering: its substitutions are
    4 to 15 times as fast as those of MUMPS, which factorises 3D matrices faster and is the one that works on many ranks.
    Options of the prefix vi_contact_factor_ choose otherwise. InputError when the matrix cannot be factorised.
    """

    def __init__(self, matrix: PetscMatrix) -> None:
        mat = matrix.mat
        mat.setOption(PETSc.Mat.Option.SYMMETRIC, True)
        self._pc = PETSc.PC().create(mat.comm)
        self._pc.setOptionsPrefix("vi_contact_factor_")
        self._pc.setType("cholesky")
        self._pc.setOperators(mat)
        rows = max(mat.getSize()[0], 1)
        if mat.comm.size == 1 and mat.getInfo()["nz_used"] < FULL_ROW * rows:
            self._pc.setFactorSolverType("petsc")
            self._pc.setFactorOrdering("amd")
        else:
            # P12: MUMPS may crash on distributed right-hand sides, and only the options database reaches it in time
            PETSc.Options("vi_contact_factor_")["mat_mumps_icntl_20"] = 0
            self._pc.setFactorSolverType("mumps")
        self._pc.setFromOptions()
        self._b, self._x = mat.createVecs()
        self._set_up()

    def _set_up(self) -> None:
        try:
            self._pc.setUp()
            self.matrix_factor = self._pc.getFactorMatrix()
            self._b.set(1.0)
            self.matrix_factor.solve(self._b, self._x)  # PETSc fills it with infinity when the factorisation failed
            failed = not np.isfinite(self._x.norm())
        except PETSc.Error:
            failed = True
        if failed:
            raise InputError(
                "the effective matrix cannot be factorised: it is singular or contains NaN; check the materials, and "
                "that every part of the body is clamped or has mass"
            )

    def solve(self, b: Array) -> Array:
        self._b.array[:] = b
        self.matrix_factor.solve(self._b, self._x)
        return np.array(self._x.array_r)

    def solve_units(self, owned: Indices, slots: Indices, m: int) -> Array:
        rows = self._x.getLocalSize()
        total = self._x.getSize()
        columns = np.zeros((rows, m))
        for first in range(0, m, CHUNK):
            width = min(CHUNK, m - first)
            units = PETSc.Mat().createDense(((rows, total), (None, width)), comm=self._x.comm)
            solved = PETSc.Mat().createDense(((rows, total), (None, width)), comm=self._x.comm)
            units.setUp()
            solved.setUp()
            mine = (slots >= first) & (slots < first + width)
            block = units.getDenseArray()
            block[owned[mine], slots[mine] - first] = 1.0
            units.assemble()
            solved.assemble()
            self.matrix_factor.matSolve(units, solved)
            columns[:, first : first + width] = solved.getDenseArray()
            units.destroy()
            solved.destroy()
        return columns


class PetscAlgebra:
    """PETSc matrices on one communicator."""

    def __init__(self, comm: Any) -> None:
        self.comm: Comm = MpiComm(comm)

    def combine(self, terms: Sequence[tuple[float, Matrix]]) -> Matrix:
        total = None
        for factor, matrix in terms:
            mat = as_petsc(matrix).mat
            if total is None:
                total = mat.copy()
                total.scale(factor)
            else:
                # M, C and K come from the same mesh and space: same sparsity unless a basis change dropped entries
                total.axpy(factor, mat, structure=PETSc.Mat.Structure.DIFFERENT_NONZERO_PATTERN)
        if total is None:
            raise ValueError("combine needs at least one term")
        return PetscMatrix(total)

    def congruence(self, T: Matrix, K: Matrix) -> Matrix:
        return PetscMatrix(as_petsc(K).mat.PtAP(as_petsc(T).mat))

    def factor(self, A: Matrix) -> Factor:
        return PetscFactor(as_petsc(A))

    def dot(self, x: Array, y: Array) -> float:
        return float(self.comm.sum(np.array([x @ y]))[0])


def as_petsc(matrix: Matrix) -> PetscMatrix:
    """The matrix as a PetscMatrix; TypeError when it belongs to another algebra."""
    if not isinstance(matrix, PetscMatrix):
        raise TypeError(f"PetscAlgebra got a {type(matrix).__name__}")
    return matrix
