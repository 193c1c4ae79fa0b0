"""Build the Jacobian of a step with friction.

Its parts are H = A x_ref/r_ref, B_t, and in 3D the derivatives of the disks.
"""

import weakref
from typing import Any

import numpy as np
import scipy.sparse as sp

from ...core.algebra import Array, Indices
from ..petsc import PETSc
from .bounded_system import make_aij, renumber
from .friction_system import FrictionSystem, ScaledFrictionStep

Entries = tuple[Any, Any, Array]  # rows of this rank, columns of all, values


class FrictionJacobian:
    """Hold the derivatives of ``ScaledFrictionStep.residual`` as an AIJ matrix.

    Names are those of that function.
    """

    def __init__(self, scaled: ScaledFrictionStep) -> None:
        """Make the pattern of the matrix. Collective."""
        self._system: FrictionSystem = scaled.friction
        self._scaled = weakref.proxy(scaled)  # PETSc holds the matrix: see weakly()
        self._ratio = np.nan
        total, parts = self._list_entries()

        # The entries of all parts, none of which is given twice, are sorted once by rows and
        # columns: a matrix of their numbers tells the order.
        rows = np.concatenate([rows for rows, _, _ in parts.values()])
        columns = np.concatenate([columns for _, columns, _ in parts.values()])
        numbers = np.arange(1.0, 1.0 + len(rows))
        places = sp.csr_matrix((numbers, (rows, columns)), shape=(self._system.size, total))
        places.sort_indices()
        self._order = places.data.astype(np.int64) - 1

        self._values = {name: values for name, (_, _, values) in parts.items()}
        self._A = parts["A"][2]
        self._flexibility = 1.0 / self._system.stiffness[self._system.line]
        self.mat = make_aij(places, self._system.body.comm)
        self._csr = places.indptr.astype(PETSc.IntType), places.indices.astype(PETSc.IntType)

    def _list_entries(self) -> tuple[int, dict[str, Entries]]:
        """Return how many columns there are on all ranks, and the parts of the matrix. Collective.

        What changes from step to step, or with y, is zero.
        """
        system = self._system
        body = system.body
        line = system.line
        pairs = system.pairs
        indptr, columns, A = _copy_rows(body)
        first, columns, total = renumber(system.surface.comm, body.size, system.size, columns)
        lam = body.size + np.arange(len(system.tangent))
        gamma = system.first_gamma + np.arange(len(pairs))

        # The rows F_lambda + E_t / c of points with one tangent: the rows of A of these tangents,
        # over their diagonal entries.
        slices = [np.arange(indptr[row], indptr[row + 1]) for row in system.tangent[line]]
        row, entry = _spread(lam[line], slices)
        column = columns[entry]
        tangent, _ = _spread(system.tangent[line], slices)
        stiffness, _ = _spread(system.stiffness[line], slices)

        # Rows of disks: first all first components, then all second ones.
        both = body.size + pairs.T.ravel()
        twice = np.tile(gamma, 2)
        moved = system.tangent[pairs.T.ravel()]
        none = np.zeros(len(both))
        return total, {
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
            self._values["A"] = self._A * ratio
            self._values["line lambda"] = self._flexibility / ratio
            self._write()

    def evaluate(self, snes: Any, y: Any, J: Any, P: Any) -> None:
        """Compute the derivatives at y, as PETSc calls for a Jacobian; constant in 2D.

        Args:
            snes: PETSc's solver.
            y: the PETSc vector of unknowns.
            J: PETSc's Jacobian, which is ``mat``.
            P: the matrix for the preconditioner, the same.
        """
        if self._system.any_disk:
            self._update_disks(np.array(y.array_r))
            self._write()

    def _update_disks(self, y: Array) -> None:
        """Compute the entries of disks at y."""
        pairs, still, gamma = self._scaled.disks(y)
        c = self._scaled.disk_stiffness
        over = self._scaled.disk_inverse
        by_reaction = (c[:, None] * (still + gamma[:, None] * pairs) - 2.0 * pairs) * over[:, None]
        self._values |= {
            "disk lambda": np.tile(gamma, 2),
            "disk gamma": pairs.T.ravel(),
            "gamma lambda": by_reaction.T.ravel(),
            "gamma x": -((c * over)[:, None] * pairs).T.ravel(),
            "gamma gamma": c * over * np.sum(pairs**2, axis=1),
        }

    def _write(self) -> None:
        """Write all entries into the matrix. Collective."""
        values = np.concatenate(list(self._values.values()))
        self.mat.setValuesCSR(*self._csr, values[self._order])
        self.mat.assemble()

    def destroy(self) -> None:
        """Free the matrix."""
        self.mat.destroy()


def _copy_rows(body: Any) -> Any:
    """Return CSR arrays of the owned rows of the body with its springs, in copies."""
    assembled = body.assemble()
    arrays = [np.array(part) for part in assembled.getValuesCSR()]
    if assembled is not getattr(body.A.matrix, "mat", None):
        assembled.destroy()
    return arrays


def _spread(values: Any, slices: list[Indices]) -> tuple[Any, Any]:
    """Return values[i] for every entry of slices[i], and these entries."""
    lengths = [len(entries) for entries in slices]
    all_entries = np.concatenate(slices) if slices else np.zeros(0, dtype=np.int64)
    return np.repeat(values, lengths), all_entries
