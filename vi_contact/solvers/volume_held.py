"""Contact points held at given values, by the one factorisation of A and the Delassus operator (solver notes 1b)."""

from __future__ import annotations

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve

from ..algebra import Array, Indices, Mask
from ..errors import StepFailure
from .volume_system import BoundedSystem


class HeldInverse:
    """Solves A z = r - reactions with z = target on a held set of contact points, by the factor of A alone.

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
        self._set, self._cholesky = b"", (np.zeros((0, 0)), False)

    def unheld(self, r: Array) -> Array:
        """A⁻¹ r, nothing held: one back-substitution."""
        system, n = self._system, self._system.rows
        force = r[:n].copy()
        force[system.feet] += r[n:]
        x = self._factor.solve(force)
        return np.concatenate([x, x[system.feet] + r[n:] / system.spring])

    def hold(self, z: Array, held: Mask, target: Array) -> Array:
        """z - W reaction, with the reaction on ``held`` (m,) that brings its points to ``target`` (m,)."""
        if not held.any():
            return z
        system = self._system
        reaction = np.zeros(len(held))
        reaction[held] = self._solve(held, (system.shared(z[system.bounded]) - target)[held])
        change = self._respond(reaction)
        z = z - np.concatenate([change, change[system.feet]])
        z[system.rows :] -= reaction[system.surface.slots][system.soft] / system.spring
        mine = held[system.surface.slots]
        z[system.bounded[mine]] = target[system.surface.slots][mine]
        return z

    def _respond(self, reaction: Array) -> Array:
        """W reaction."""
        surface, rows = self._system.surface, self._system.rows
        if np.any(reaction[~self._stored]):
            return self._factor.solve(surface.reaction_load(reaction, rows))
        x = np.zeros(rows)
        for slots, columns in self._kept:
            if reaction[slots].any():
                x += columns @ reaction[slots]
        return x

    def _solve(self, held: Mask, gap: Array) -> Array:
        """(G_aa + compliance/scale)⁻¹ gap; its Cholesky factor is kept until the held set changes."""
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
        part = np.zeros((surface.count, len(slots)))
        part[surface.slots] = columns[surface.owned]
        self._G[:, slots] = surface.comm.sum(part)
        self._known |= new
        if self._stored.sum() + len(slots) <= self._capacity:
            self._kept.append((slots, columns))
            self._stored |= new
