"""Build the Jacobian of a step with friction: H = A x_ref/r_ref, B_t, and in 3D what lambda and gamma make of it."""

import weakref
from typing import Any

import numpy as np
import scipy.sparse as sp
from petsc4py import PETSc

from ...core.algebra import Array, Indices
from .bounded_system import renumbered
from .friction_system import FrictionSystem, ScaledFrictionStep

Entries = tuple[Any, Any, Array]  # rows of this rank, columns of all, values


class FrictionJacobian:
    """Hold the derivatives of ``ScaledFrictionStep.residual`` as an AIJ matrix; see there for the names."""

    def __init__(self, scaled: ScaledFrictionStep) -> None:
        self._system: FrictionSystem = scaled.friction
        self._scaled = weakref.proxy(scaled)  # PETSc holds the matrix: see weakly()
        self._ratio = np.nan
        first, total, parts = self._entries()
        self._where, self._csr = _merged(list(parts.values()), (self._system.size, total))
        self._place = dict(zip(parts, self._where, strict=True))
        self._values = np.zeros(len(self._csr[1]))
        for name, (_, _, values) in parts.items():
            self._values[self._place[name]] = values
        self._A, self._inverse = parts["A"][2], 1.0 / self._system.stiffness[self._system.line]
        shape = (self._system.size, None)
        self.mat = PETSc.Mat().createAIJ((shape, shape), csr=(*self._csr, self._values), comm=self._system.comm)

    def _entries(self) -> tuple[int, int, dict[str, Entries]]:
        """First global number of this rank, their total, and the parts of the matrix; zeros for what changes."""
        system = self._system
        body, line, pairs = system.body, system.line, system.pairs
        indptr, columns, A = _rows_of(body)
        first, columns, total = renumbered(system.surface.comm, body.size, system.size, columns)
        lam, gamma = body.size + np.arange(len(system.tangent)), system.first_gamma + np.arange(len(pairs))
        slices = [np.arange(*indptr[row : row + 2]) for row in system.tangent[line]]
        row, entry = _spread(lam[line], slices)
        column = columns[entry]
        tangent, stiffness = _spread(system.tangent[line], slices)[0], _spread(system.stiffness[line], slices)[0]
        both, twice = body.size + pairs.T.ravel(), np.tile(gamma, 2)
        moved = system.tangent[pairs.T.ravel()]
        none = np.zeros(len(both))
        return first, total, {
            "A": (np.repeat(np.arange(body.size), np.diff(indptr)), columns, A),
            "B": (system.tangent, first + lam, np.ones(len(lam))),
            "line": (row, column, A[entry] / stiffness - (column == first + tangent)),
            "line lambda": (lam[line], first + lam[line], np.zeros(int(line.sum()))),
            "disk": (both, first + moved, none - 1.0),
            "disk lambda": (both, first + both, none),
            "disk gamma": (both, first + twice, none),
            "gamma lambda": (twice, first + both, none),
            "gamma x": (twice, first + moved, none),
            "gamma gamma": (gamma, first + gamma, np.zeros(len(gamma))),
        }

    def rescale(self, ratio: float) -> None:
        """Take the units of a step."""
        if ratio != self._ratio:
            self._ratio = ratio
            self._values[self._place["A"]] = self._A * ratio
            self._values[self._place["line lambda"]] = self._inverse / ratio
            self._write()

    def evaluate(self, snes: Any, y: Any, J: Any, P: Any) -> None:
        """Compute the derivatives at y; constant in 2D."""
        if self._system.any_disk:
            self._turn(np.array(y.array_r))
            self._write()

    def _turn(self, y: Array) -> None:
        """The entries of disks."""
        pairs, still, gamma = self._scaled.disks(y)
        c, over = self._scaled.disk_stiffness, self._scaled.disk_inverse
        by_reaction = (c[:, None] * (still + gamma[:, None] * pairs) - 2.0 * pairs) * over[:, None]
        for name, values in (
            ("disk lambda", np.tile(gamma, 2)),
            ("disk gamma", pairs.T.ravel()),
            ("gamma lambda", by_reaction.T.ravel()),
            ("gamma x", -((c * over)[:, None] * pairs).T.ravel()),
            ("gamma gamma", c * over * np.sum(pairs**2, axis=1)),
        ):
            self._values[self._place[name]] = values

    def _write(self) -> None:
        self.mat.setValuesCSR(*self._csr, self._values)
        self.mat.assemble()

    def destroy(self) -> None:
        """Free the matrix."""
        self.mat.destroy()


def _rows_of(body: Any) -> Any:
    """CSR arrays of the owned rows of the body with its springs, in copies."""
    assembled = body.assembled()
    arrays = [np.array(part) for part in assembled.getValuesCSR()]
    if assembled is not getattr(body.A.matrix, "mat", None):
        assembled.destroy()
    return arrays


def _spread(values: Any, slices: list[Indices]) -> tuple[Any, Any]:
    """values[i] for every entry of slices[i], and these entries."""
    lengths = [len(part) for part in slices]
    return np.repeat(values, lengths), np.concatenate(slices) if slices else np.zeros(0, dtype=np.int64)


def _merged(parts: list[Entries], shape: tuple[int, int]) -> tuple[list[Indices], tuple[Any, Any]]:
    """Where the entries of each part, none given twice, are in the CSR matrix of all, and its indptr and columns."""
    count = [len(part[0]) for part in parts]
    order = np.arange(1.0, 1.0 + sum(count))
    rows, columns = (np.concatenate([part[i] for part in parts]) for i in (0, 1))
    csr = sp.csr_matrix((order, (rows, columns)), shape=shape)
    csr.sort_indices()
    where = np.empty(len(order), dtype=np.int64)
    where[csr.data.astype(np.int64) - 1] = np.arange(len(order))
    kind = PETSc.IntType
    return np.split(where, np.cumsum(count)[:-1]), (csr.indptr.astype(kind), csr.indices.astype(kind))
