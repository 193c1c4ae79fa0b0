"""Write the step as a problem with simple bounds: what every PETSc method of the volume route sees.

    lower <= z <= upper,   A z - b >= 0 where z = lower,  <= 0 where z = upper,  = 0 elsewhere

On a rigid support z = x and the bounded unknowns are the normal displacements. A point on a spring
k = scale/compliance keeps law (5) of the boundary method on an enlarged body (the remark after its
eq. 6): the far end w = x_n - compliance r_n / scale of the spring is a further unknown, and the
bound is on w,

    z = (x, w),    [[A + Bᵀ k B, -Bᵀ k], [-k B, k]] z = (b, 0) - reactions,    w <= bound.

The spring unknowns of a rank follow its body unknowns. Contact arrays (m,) are of the conditions
that this rank owns.
"""

from functools import cache
from typing import Any

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, Comm, EffectiveMatrix, Indices, Mask, SerialMatrix
from ...core.errors import InputError
from ...core.step import StepProblem
from ...core.surfaces import ContactSurface
from ..petsc import PETSc


class BoundedSystem:
    """Hold A, the contact surface and its springs as one system.

    Attributes:
        A, surface, scale: as they were given.
        rows: unknowns of the body, on this rank.
        size: unknowns with those of the springs.
        soft: (m,) True where the support is a spring.
        spring, feet: stiffness k of these springs, in the unit of A, and the positions in x of
            their body ends.
        bounded: (m,) position of the bounded unknown in z.
        symmetric: whether A is.
    """

    def __init__(self, A: EffectiveMatrix, surface: ContactSurface, scale: float) -> None:
        """Find where the unknowns are.

        Args:
            A: the effective matrix.
            surface: the contact surface.
            scale: of reactions, over which compliances are divided.
        """
        self.A = A
        self.surface = surface
        self.scale = scale
        self.rows = A.matrix.rows
        self.symmetric = A.algebra.symmetric
        self.soft: Mask = surface.compliance > 0.0
        self.spring = scale / surface.compliance[self.soft]
        self.feet = surface.owned[self.soft]
        self.size = self.rows + len(self.spring)
        self.bounded = surface.owned.copy()
        self.bounded[self.soft] = self.rows + np.arange(len(self.spring))

    @property
    def comm(self) -> Any:
        """Return the PETSc communicator."""
        matrix: Any = self.A.matrix
        return own_communicator() if isinstance(matrix, SerialMatrix) else matrix.mat.comm

    def max(self, *values: float) -> Array:
        """Return the maxima over the ranks."""
        return np.asarray(self.surface.comm.max(np.array(values)))

    def apply(self, z: Array) -> Array:
        """Return A z."""
        result = np.empty(self.size)
        result[: self.rows] = self.A @ z[: self.rows]
        if self.soft.any():
            force = self.spring * (z[self.feet] - z[self.rows :])
            result[self.feet] += force
            result[self.rows :] = -force
        return result

    def load(self, b: Array) -> Array:
        """Return (b, 0)."""
        return np.concatenate([b, np.zeros(self.size - self.rows)])

    def bounds(self, step: StepProblem) -> tuple[Array, Array]:
        """Return (lower, upper) of the owned unknowns, both (size,).

        An infinite bound leaves its point free, bilateral or not.

        Raises:
            InputError: on all ranks, where a bound is NaN.
        """
        if self.surface.some(np.isnan(step.bound)):
            raise InputError(
                "the bound of the contact conditions contains NaN: check the gap and the time "
                "scheme"
            )
        lower = np.full(self.size, -np.inf)
        upper = np.full(self.size, np.inf)
        if step.lower is not None:
            lower[self.bounded] = step.lower
        upper[self.bounded] = step.bound
        held = self.surface.bilateral & np.isfinite(step.bound)
        lower[self.bounded[held]] = step.bound[held]
        return lower, upper

    def start(self, step: StepProblem) -> Array:
        """Return the guess, with springs at rest and the predicted contacts on their bounds."""
        z = np.concatenate([step.guess, step.guess[self.feet]])
        closed = (step.active | self.surface.bilateral) & np.isfinite(step.bound)
        z[self.bounded[closed]] = step.bound[closed]
        return z

    def reactions(self, f: Array) -> Array:
        """Return r_n (m,) from the residual f = A z - b, where the bound is active.

        On a spring it is k (x_n - w).
        """
        return np.asarray(-f[self.bounded])

    def norm(self) -> float:
        """Return an upper bound of the largest absolute row sum of A."""
        matrix: Any = self.A.matrix
        if isinstance(matrix, SerialMatrix):
            largest = float(abs(matrix.csr).sum(axis=1).max())
        else:
            largest = float(matrix.mat.norm(PETSc.NormType.NORM_INFINITY))
        return largest + 2.0 * float(self.max(np.max(self.spring, initial=0.0))[0])

    def assemble(self) -> Any:
        """Return A with its springs as an AIJ matrix. Collective.

        It is the given matrix when that is PETSc's and there are no springs.
        """
        mat = convert_to_aij(self.A)
        if not self.surface.some(self.soft):
            return mat

        # Every rank's part of the columns grows by its springs; each spring adds k to its two ends
        # and -k between them.
        indptr, columns, values = mat.getValuesCSR()
        first, columns, total = renumber(self.surface.comm, self.rows, self.size, columns)
        body = sp.csr_matrix((values, columns, indptr), shape=(self.rows, total)).tocoo()
        feet = self.feet
        tips = np.arange(self.rows, self.size)
        local = np.concatenate([body.row, feet, feet, tips, tips])
        remote = np.concatenate([body.col, first + feet, first + tips, first + feet, first + tips])
        k = self.spring
        entries = np.concatenate([body.data, k, -k, -k, k])
        rows = sp.csr_matrix((entries, (local, remote)), shape=(self.size, total))
        return make_aij(rows, self.comm)


@cache
def own_communicator() -> Any:
    """Return a communicator of this rank alone, for matrices that no mesh has brought.

    It is a copy of PETSc's COMM_SELF. What waits there is freed by PETSc's end, after the end of
    Python, where solvers with contexts in Python would crash.
    """
    return PETSc.COMM_SELF.tompi4py().Dup()


def convert_to_aij(A: EffectiveMatrix) -> Any:
    """Return A as PETSc's AIJ matrix, its own where it has one."""
    matrix = A.matrix
    if isinstance(matrix, SerialMatrix):
        return make_aij(matrix.csr, own_communicator())
    return matrix.mat  # type: ignore[attr-defined]


def make_aij(rows: sp.csr_matrix, comm: Any) -> Any:
    """Return the square AIJ matrix with these rows of this rank. Collective.

    Columns are numbered over all ranks.
    """
    kind = PETSc.IntType
    size = (rows.shape[0], None)
    arrays = rows.indptr.astype(kind), rows.indices.astype(kind), rows.data
    return PETSc.Mat().createAIJ((size, size), csr=arrays, comm=comm)


def renumber(comm: Comm, old_size: int, new_size: int, columns: Any) -> tuple[int, Indices, int]:
    """Give columns new numbers, as the part of every rank grows at its end. Collective.

    Args:
        comm: of the contact surface.
        old_size: columns of this rank before.
        new_size: columns of this rank from now on.
        columns: (n,) global numbers before.

    Returns:
        This rank's first global number, the new global numbers (n,), and how many there are.
    """
    sizes = np.zeros((comm.size, 2))
    sizes[comm.rank] = old_size, new_size
    sizes = comm.sum(sizes)
    old = np.concatenate([[0], np.cumsum(sizes[:, 0])]).astype(np.int64)
    new = np.concatenate([[0], np.cumsum(sizes[:, 1])]).astype(np.int64)
    owner = np.searchsorted(old, columns, side="right") - 1
    return int(new[comm.rank]), columns + (new - old)[owner], int(new[-1])
