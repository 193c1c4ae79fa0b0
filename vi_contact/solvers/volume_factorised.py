"""One factorisation for every reduced system of the volume VI (solver notes 1b).

With the contact unknowns C, W = A⁻¹ E_C and the Delassus operator G = W_C, the system on the inactive set I that
VINEWTONRSLS asks for when the points a ⊂ C are held is solved exactly by

    y = A⁻¹ r,    y <- y - W_a G_aa⁻¹ y_a,    return y_I.

SNES still does the work: it finds the active sets, checks residuals, projects. Its Jacobian is a shell whose
submatrices are light shells too, so nothing is copied or factorised while the active set changes.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from petsc4py import PETSc
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from ..algebra import Array, Indices, Mask
from ..errors import StepFailure
from ..step import StepProblem
from .volume_options import OptionLayers, Options, check_own_inverse
from .volume_snes import NEWTON_OPTIONS, SnesDriver
from .volume_step import ScaledStep
from .volume_system import BoundedSystem


class HeldInverse:
    """Solves A z = r + reactions with z = target on a held set of contact points, by the factor of A alone.

    Columns of W are made when a point is first held. At most ``limit`` numbers of them are kept on a rank; a set with
    columns beyond that costs a second back-substitution instead of the product with W. G costs m² numbers.
    Springs enter by their compliance only: eliminating w gives back A, and G + compliance/scale.
    """

    def __init__(self, system: BoundedSystem, limit: int) -> None:
        self._system = system
        self._factor = system.A.factor
        m = system.surface.count
        self._capacity = limit // max(system.rows, 1) if system.rows else m
        self._capacity = -int(system.max(-self._capacity)[0])  # ranks must agree on what is kept
        self._known = np.zeros(m, dtype=bool)
        self._kept: list[tuple[Indices, Array]] = []  # (slots, columns of W)
        self._stored = np.zeros(m, dtype=bool)
        self._G = np.zeros((m, m))
        self._set, self._cholesky = b"", None

    def solve(self, r: Array, held: Mask, target: Array) -> Array:
        """z for the load r; held: (m,); target: values of z at the m points, read where held."""
        system, n = self._system, self._system.rows
        force = r[:n].copy()
        force[system.feet] += r[n:]
        x = self._factor.solve(force)
        tips = r[n:] / system.spring
        reaction = np.zeros(len(held))
        if held.any():
            value = self._values(x, tips)
            reaction[held] = cho_solve(self._factored(held), (value - target)[held])
            x = self._correct(x, force, reaction)
        local = reaction[system.surface.slots]
        z = np.concatenate([x, x[system.feet] + tips - local[system.soft] / system.spring])
        mine = held[system.surface.slots]
        z[system.bounded[mine]] = target[system.surface.slots][mine]
        return z

    def _values(self, x: Array, tips: Array) -> Array:
        """(m,) the bounded unknowns when nothing is held."""
        local = x[self._system.surface.owned]
        local[self._system.soft] += tips
        return self._system.shared(local)

    def _correct(self, x: Array, force: Array, reaction: Array) -> Array:
        """x - W reaction."""
        if np.any(reaction[~self._stored]):
            return self._factor.solve(force - self._system.surface.reaction_load(reaction, len(force)))
        for slots, columns in self._kept:
            if reaction[slots].any():
                x -= columns @ reaction[slots]
        return x

    def _factored(self, held: Mask) -> Any:
        """Cholesky factor of G_aa + compliance/scale, kept until the held set changes."""
        if held.tobytes() != self._set:
            self._make_columns(held & ~self._known)
            surface = self._system.surface
            block = self._G[np.ix_(held, held)]
            block = 0.5 * (block + block.T) + np.diag(surface.compliance[held] / self._system.scale)
            try:
                self._cholesky = cho_factor(block, check_finite=False)
            except LinAlgError as error:
                raise StepFailure(
                    f"OneFactorisation found a compliance matrix of the contact points that is not positive definite "
                    f"({error}): A is not positive definite, check that the body is held or that mass enters A"
                ) from error
            self._set = held.tobytes()
        return self._cholesky

    def _make_columns(self, new: Mask) -> None:
        """Columns of W and G of the points ``new``."""
        if not new.any():
            return
        surface = self._system.surface
        position = np.cumsum(new) - 1
        mine = new[surface.slots]
        slots = np.flatnonzero(new)
        columns = self._factor.solve_units(surface.owned[mine], position[surface.slots[mine]], len(slots))
        part = np.zeros((surface.count, len(slots)))
        part[surface.slots] = columns[surface.owned]
        self._G[:, slots] = surface.comm.sum(part)
        self._known |= new
        if self._stored.sum() + len(slots) <= self._capacity:
            self._kept.append((slots, columns))
            self._stored |= new


class ShellMatrix:
    """H = A x_ref / r_ref on the unknowns ``local``, for PETSc's Python matrices; all unknowns when None."""

    def __init__(self, scaled: ScaledStep, local: Array | None = None) -> None:
        self._scaled = scaled
        size = scaled.system.size
        self.local = np.arange(size) if local is None else local
        free = np.zeros(size, dtype=bool)
        free[self.local] = True
        self.held = scaled.system.shared((~free[scaled.system.bounded]).astype(float)) > 0.0

    def mult(self, mat: Any, x: Any, y: Any) -> None:
        """y = H x."""
        y.array[:] = self._scaled.system.apply(self.spread(x))[self.local] * (self._scaled.x_ref / self._scaled.r_ref)

    def spread(self, x: Any) -> Array:
        """A vector on ``local`` with zeros elsewhere."""
        z = np.zeros(self._scaled.system.size)
        z[self.local] = x.array_r
        return z

    def createSubMatrix(self, mat: Any, rows: Any, columns: Any, out: Any = None) -> Any:
        """The shell on the given rows; PETSc calls it for the inactive set."""
        first, _ = mat.getOwnershipRange()
        return shell(ShellMatrix(self._scaled, rows.indices - first), mat.comm)


def shell(context: ShellMatrix, comm: Any) -> Any:
    """A PETSc matrix around the context."""
    size = (len(context.local), None)
    mat = PETSc.Mat().createPython((size, size), context, comm=comm)
    mat.setUp()
    return mat


class ShellJacobian:
    """The Jacobian handed to SNES."""

    def __init__(self, scaled: ScaledStep) -> None:
        self.mat = shell(ShellMatrix(scaled), scaled.system.comm)

    def rescale(self, ratio: float) -> None:
        """The context reads the scaled step."""

    def evaluate(self, snes: Any, y: Any, J: Any, P: Any) -> None:
        """Constant."""

    def destroy(self) -> None:
        """Free the matrix."""
        self.mat.destroy()


class ReducedInverse:
    """The Python preconditioner: the exact inverse of the reduced matrix it is set up with."""

    def __init__(self, scaled: ScaledStep, inverse: HeldInverse) -> None:
        self._scaled, self.inverse = scaled, inverse
        self._zero = np.zeros(scaled.system.surface.count)

    def apply(self, pc: Any, r: Any, y: Any) -> None:
        """y = H_II⁻¹ r."""
        matrix: ShellMatrix = pc.getOperators()[1].getPythonContext()
        z = self.inverse.solve(matrix.spread(r), matrix.held, self._zero)
        y.array[:] = z[matrix.local] * (self._scaled.r_ref / self._scaled.x_ref)


class FactorisedDriver(SnesDriver):
    """SNES with the one factorisation."""

    def __init__(self, scaled: ScaledStep, layers: OptionLayers, limit: int) -> None:
        self.inverse = HeldInverse(scaled.system, limit)
        super().__init__(
            scaled,
            layers,
            ShellJacobian(scaled),
            snes_type="vinewtonrsls",
            check=check_own_inverse,
            inverse=ReducedInverse(scaled, self.inverse),
        )


@dataclass(frozen=True)
class OneFactorisation:
    """SNES VINEWTONRSLS on the one factorisation of A. Iterations are back-substitutions after the first.

    It starts from the solution on the predicted contact set, so a right prediction costs one back-substitution and no
    iteration. ``limit``: numbers of W kept on a rank (8 bytes each); beyond it, one more back-substitution is used.
    """

    limit: int = 50_000_000

    def defaults(self, ranks: int) -> Options:
        """Options before the user's."""
        return NEWTON_OPTIONS

    def driver(self, scaled: ScaledStep, layers: OptionLayers) -> FactorisedDriver:
        """The SNES object."""
        return FactorisedDriver(scaled, layers, self.limit)

    def start(self, driver: FactorisedDriver, system: BoundedSystem, step: StepProblem) -> Array:
        """The solution with the predicted contacts held."""
        return driver.inverse.solve(system.load(step.b), system.predicted(step), step.bound)
