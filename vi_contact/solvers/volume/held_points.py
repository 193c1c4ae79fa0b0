"""Hold contact points at given values, by the one factorisation of A and the Delassus operator."""

from __future__ import annotations

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.linalg.blas import dgemv

from ...core.algebra import Array, Mask
from ...core.errors import StepFailure
from .bounded_system import BoundedSystem


class HeldInverse:
    """Solve A z = r - reactions with z = target on a held set of contact points, by the factor of A alone.

    Sets and targets (total,) are those of all conditions, the same on every rank.

    Columns of W are made when a point is first held. They are kept when there is room for ``limit`` numbers on every
    rank; else W is applied as a second back-substitution. G costs m² numbers.
    Springs enter by their compliance only: eliminating w gives back A, and G + compliance/scale.
    """

    def __init__(self, system: BoundedSystem, limit: int) -> None:
        self._system = system
        self._factor = system.A.factor
        surface = system.surface
        m, self._extra = surface.total, surface.everywhere(surface.compliance) / system.scale
        self._bilateral = surface.everywhere(surface.bilateral)
        keep = system.max(float(m * system.rows))[0] <= limit
        self._W = np.empty((m if keep else 0, system.rows))  # row j is column j; memory is taken when it is written
        self._known = np.zeros(m, dtype=bool)
        self._G = np.zeros((m, m))
        self._set, self._cholesky = b"", (np.zeros((0, 0)), False)

    def unheld(self, r: Array) -> Array:
        """Return A⁻¹ r, nothing held: one back-substitution."""
        system, n = self._system, self._system.rows
        force = r[:n].copy()
        force[system.feet] += r[n:]
        x = self._factor.solve(force)
        return np.concatenate([x, x[system.feet] + r[n:] / system.spring])

    def hold(self, z: Array, held: Mask, target: Array) -> Array:
        """Return z - W reaction, with the reaction on ``held`` that brings its points to ``target``."""
        if not held.any():
            return z
        system, n = self._system, self._system.rows
        reaction = np.zeros(len(held))
        reaction[held] = self._solve(held, (system.surface.everywhere(z[system.bounded]) - target)[held])
        x = z[:n] - self._respond(reaction, held)
        w = z[n:] - z[system.feet] + x[system.feet]  # held tips are set below
        z = np.concatenate([x, w])
        mine = held[system.surface.slots]
        z[system.bounded[mine]] = target[system.surface.slots][mine]
        return z

    def better_set(self, z: Array, held: Mask, target: Array, exchanges: int) -> Mask:
        """Return a contact set to start from, for z = A⁻¹ b: ``held`` if its reactions push and no other point
        passes its target; else the points that z takes beyond their targets, with at most so many exchanges of wrong
        signs.

        Asked of the contact points alone, it costs little beside a step; SNES decides.
        """
        excess = self._system.surface.everywhere(z[self._system.bounded]) - target
        rounding = 1e-12 * float(np.max(np.abs(excess[np.isfinite(excess)]), initial=0.0))
        wrong = self._wrong(excess, held, rounding)
        if not wrong.any():
            return held
        held = (excess > 0.0) | (held & self._bilateral)
        for _ in range(exchanges):
            wrong = self._wrong(excess, held, rounding)
            if not wrong.any():
                break
            held = held ^ wrong
        return held

    def _wrong(self, excess: Array, held: Mask, rounding: float) -> Mask:
        """Held points whose reaction pulls, and others that pass their target."""
        wrong = excess > rounding
        if held.any():
            push = self._solve(held, excess[held])
            wrong = excess - self._G[:, held] @ push > rounding
            wrong[held] = (push < 0.0) & ~self._bilateral[held]
        return wrong

    def _respond(self, reaction: Array, held: Mask) -> Array:
        """W reaction; kept columns are multiplied in runs of neighbours, without copying."""
        if not len(self._W):
            surface = self._system.surface
            return self._factor.solve(surface.reaction_load(reaction[surface.slots], self._system.rows))
        x = np.zeros(self._system.rows)
        if not len(x):
            return x  # BLAS does not take empty matrices
        ends = np.flatnonzero(np.diff(np.concatenate([[False], held, [False]])))
        for first, last in ends.reshape(-1, 2):
            x = dgemv(1.0, self._W[first:last].T, reaction[first:last], beta=1.0, y=x, overwrite_y=True)
        return x

    def _solve(self, held: Mask, gap: Array) -> Array:
        """(G_aa + compliance/scale)⁻¹ gap; its Cholesky factor is kept until the held set changes."""
        if held.tobytes() != self._set:
            self._make_columns(held & ~self._known)
            block = self._G[np.ix_(held, held)]
            block = 0.5 * (block + block.T) + np.diag(self._extra[held])
            try:
                self._cholesky = cho_factor(block, check_finite=False)
            except LinAlgError as error:
                raise StepFailure(
                    f"OneFactorisation found a compliance matrix of the contact points that is not positive definite "
                    f"({error}): A is not positive definite, check that the body is held or that mass enters A"
                ) from error
            self._set = held.tobytes()
        return np.asarray(cho_solve(self._cholesky, gap, check_finite=False))

    def _make_columns(self, new: Mask) -> None:
        """Columns of W and G of the points ``new``."""
        if not new.any():
            return
        surface = self._system.surface
        position = np.cumsum(new) - 1
        mine = new[surface.slots]
        slots = np.flatnonzero(new)
        columns = self._factor.solve_units(surface.owned[mine], position[surface.slots[mine]], len(slots))
        self._G[:, slots] = surface.everywhere(columns[surface.owned])
        self._known |= new
        if len(self._W):
            self._W[slots] = columns.T
