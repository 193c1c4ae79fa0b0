"""Contact steps on a Q1 plane-strain block, on one process or in parallel, with a dense brute-force
solution.

The block stands on a clamped base; its right side may touch a wall, u_x <= bound. Every rank
assembles the same scipy matrix and keeps its rows, so that a case is one problem whatever the
number of ranks.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from reference_lcp import enumerate_lcp

from vi_contact.core.algebra import Array, EffectiveMatrix, SerialAlgebra, SerialComm, SerialMatrix
from vi_contact.core.step import StepProblem, StepResult
from vi_contact.core.surfaces import ContactSurface


def q1_element(nu: float) -> tuple[Array, Array]:
    """(stiffness, mass) of a unit square, E = rho = 1, plane strain; nodes anticlockwise,
    components interleaved."""
    D = np.array([[1.0 - nu, nu, 0.0], [nu, 1.0 - nu, 0.0], [0.0, 0.0, 0.5 - nu]]) / (
        (1.0 + nu) * (1.0 - 2.0 * nu)
    )
    K, M = np.zeros((8, 8)), np.zeros((8, 8))
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])
    for point in corners / np.sqrt(3.0):
        N = np.prod(1.0 + corners * point, axis=1) / 4.0
        dN = corners * (1.0 + corners * point)[:, ::-1] / 2.0
        B = np.zeros((3, 8))
        B[0, ::2], B[1, 1::2] = dN.T
        B[2, ::2], B[2, 1::2] = dN.T[::-1]
        K += B.T @ D @ B / 4.0
        M += np.kron(np.outer(N, N), np.eye(2)) / 4.0
    return K, M


@dataclass(frozen=True)
class Block:
    """nx x ny elements of size h: K [N/m], M [kg], and the unknowns u_x of the right side, base
    excluded."""

    K: Any
    M: Any
    contact: Any

    @property
    def size(self) -> int:
        return int(self.K.shape[0])


def block(
    nx: int, ny: int, *, h: float = 1.0, modulus: float = 1.0, density: float = 1.0, nu: float = 0.3
) -> Block:
    """The block with its base removed."""
    node = np.arange((nx + 1) * (ny + 1)).reshape(ny + 1, nx + 1)
    elements = np.stack(
        [node[:-1, :-1], node[:-1, 1:], node[1:, 1:], node[1:, :-1]], axis=-1
    ).reshape(-1, 4)
    dofs = (2 * elements[:, :, None] + np.arange(2)).reshape(-1, 8)
    rows, columns = np.repeat(dofs, 8, axis=1).ravel(), np.tile(dofs, 8).ravel()
    free = slice(2 * (nx + 1), None)
    K, M = (
        sp.coo_matrix((np.tile(values.ravel(), len(dofs)), (rows, columns))).tocsr()[free, free]
        for values in (q1_element(nu)[0] * modulus, q1_element(nu)[1] * density * h**2)
    )
    return Block(K, M, 2 * node[1:, -1] - 2 * (nx + 1))


@dataclass(frozen=True)
class Case:
    """A step and where its rows are: ``rows`` of this rank in the global vector."""

    step: StepProblem
    matrix: Any
    contact: Any
    rows: slice
    b: Array

    def all(self, x: Array) -> Array:
        """The global vector of owned parts."""
        total = np.zeros(len(self.b))
        total[self.rows] = x
        return self.step.surface.comm.sum(total)

    def exact(self) -> StepResult:
        """Brute force over all contact sets (m <= 12), with dense algebra."""
        step, surface = self.step, self.step.surface
        bound, bilateral, compliance = (
            surface.everywhere(values)
            for values in (step.bound, surface.bilateral, surface.compliance)
        )
        E = np.zeros((len(self.b), surface.total))
        E[self.contact, np.arange(surface.total)] = 1.0
        W = np.linalg.solve(self.matrix.toarray(), E)
        free = np.linalg.solve(self.matrix.toarray(), self.b)
        G = W[self.contact] + np.diag(compliance / step.scale)
        r_n = enumerate_lcp(G, bound - free[self.contact], bilateral)
        return StepResult(free - W @ r_n, r_n, r_n > 0.0, 0, "brute force")

    def whole(self, result: StepResult) -> StepResult:
        """The result with all unknowns and all conditions, on every rank."""
        everywhere = self.step.surface.everywhere
        r_t = None if result.r_t is None else everywhere(result.r_t)
        return replace(
            result,
            x=self.all(result.x),
            r_n=everywhere(result.r_n),
            active=everywhere(result.active),
            r_t=r_t,
        )

    def bounded(self, bound: Array) -> Case:
        """The case with other bounds, given for all conditions."""
        return replace(
            self, step=replace(self.step, bound=np.asarray(bound)[self.step.surface.slots])
        )

    def starting_at(self, result: StepResult) -> StepProblem:
        """The step with the owned part of a solution as prediction."""
        return replace(self.step, guess=result.x, active=result.active)


def case(
    matrix: Any,
    contact: Any,
    b: Array,
    bound: Array,
    *,
    parallel: bool = False,
    of_node: int = 1,
    bilateral: Any = None,
    compliance: Any = None,
    scale: float = 1.0,
) -> Case:
    """The step A x = b - reactions, x <= bound at the unknowns ``contact``, starting from rest
    without prediction."""
    rows, A, comm = (
        _parallel(matrix, of_node)
        if parallel
        else (slice(0, len(b)), _serial(matrix), SerialComm())
    )
    mine = (contact >= rows.start) & (contact < rows.stop)
    own = int(mine.sum())
    surface = ContactSurface(
        comm=comm,
        points=np.zeros((own, 2)),
        normals=np.tile([1.0, 0.0], (own, 1)),
        weights=np.ones(own),
        gap0=np.zeros(own),
        bilateral=np.zeros(own, dtype=bool) if bilateral is None else bilateral[mine],
        compliance=np.zeros(own) if compliance is None else compliance[mine],
        owned=np.asarray(contact)[mine] - rows.start,
        slots=np.flatnonzero(mine),
        tangents=np.zeros((own, 0), dtype=np.int64),
    )
    guess = np.zeros(rows.stop - rows.start)
    step = StepProblem(
        A, b[rows].copy(), bound[mine], surface, scale, guess, np.zeros(own, dtype=bool), 0.0, 1
    )
    return Case(step, matrix, np.asarray(contact), rows, b)


def _serial(matrix: Any) -> EffectiveMatrix:
    return EffectiveMatrix(SerialMatrix(matrix), SerialAlgebra())


def _parallel(matrix: Any, of_node: int) -> tuple[slice, EffectiveMatrix, Any]:
    from mpi4py import MPI
    from petsc4py import PETSc

    from vi_contact.fem.matrices.petsc_algebra import PetscAlgebra, PetscMatrix

    comm, n = MPI.COMM_WORLD, matrix.shape[0]
    nodes = n // of_node  # a rank owns whole nodes
    rows = slice(*(of_node * (nodes * rank // comm.size) for rank in (comm.rank, comm.rank + 1)))
    part = matrix.tocsr()[rows]
    arrays = (part.indptr.astype(PETSc.IntType), part.indices.astype(PETSc.IntType), part.data)
    size = (rows.stop - rows.start, n)
    mat = PETSc.Mat().createAIJ((size, size), csr=arrays, comm=comm)
    algebra = PetscAlgebra(comm)
    return rows, EffectiveMatrix(PetscMatrix(mat), algebra), algebra.comm


def pushed_block(
    nx: int = 5,
    ny: int = 8,
    *,
    length: float = 1.0,
    force: float = 1.0,
    seed: int = 2,
    **options: Any,
) -> Case:
    """A dynamic step of the block under loads that close half of its points; ``length`` and
    ``force`` are units."""
    rng = np.random.default_rng(seed)
    body = block(nx, ny)
    matrix = (body.K + 4.0 * body.M) * (force / length)
    b = 0.1 * rng.normal(size=body.size)
    b[body.contact] += rng.normal(size=len(body.contact))
    bound = length * rng.choice([0.0, 0.05, 0.2], size=len(body.contact))
    return case(matrix, body.contact, force * b, bound, **options)
