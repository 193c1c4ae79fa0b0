"""Condense A onto contact unknowns c: their flexibility, free motion, and the answer to reactions.

    G = (A⁻¹)_cc,    free motion: (A⁻¹b)_c,    answer: x = A⁻¹(b - r) with reactions r on c

A step asks twice: ``find_free_motion(b)`` before its reactions are known, and ``answer(r, …)`` when
a solver has found them in  x_c = (A⁻¹b)_c - G r.

With the contact unknowns last in the factor (``contact_last``) a step costs one forward and one
backward substitution, and G comes from the corner of the factor. Where there is no such factor it
costs two whole ones, and G one for each contact unknown. Contact values here are those of all
ranks, on every rank: the normal unknowns by the numbers of the conditions or, with friction, (r_n,
r_t) node by node. What cannot move (a prescribed tangent) stays at zero.

Where conditions are traces B of the unknowns c that they read (``core.traces``), A is condensed
onto these all the same, and G = B (A⁻¹)_cc Bᵀ, free motion B (A⁻¹b)_c, reactions Bᵀr.
"""

from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.linalg import lapack

from ..core.algebra import Array, Comm, EffectiveMatrix, Indices, Mask
from ..core.surfaces import ContactSurface
from ..core.traces import Traces
from .bodies import CondensedBodies, find_still
from .contact_last import ContactLast


def condense(
    A: EffectiveMatrix, surface: ContactSurface, *, frictional: bool = False
) -> "Condensation":
    """Factorise A and condense it onto contact unknowns. Collective.

    Args:
        A: the effective matrix.
        surface: the contact surface.
        frictional: whether tangential unknowns count, beside the normal ones.
    """
    if surface.traces is not None:
        return CondensedTraces(A, surface.traces, frictional=frictional)

    # Contact unknowns of this rank, a row for each condition, and of all ranks by global numbers;
    # -1 stands for one that cannot move.
    first = A.algebra.first(A.matrix.rows)
    rows = surface.owned[:, None]
    if frictional:
        rows = np.hstack([rows, surface.tangents])
    unknowns = surface.everywhere(np.where(rows >= 0, rows + first, -1)).ravel()
    movable = unknowns >= 0
    last = unknowns[movable]

    # An unknown of two conditions cannot be last twice.
    are_different = len(np.unique(last)) == len(last)
    factor = A.contact_last(last) if are_different else None
    if factor is not None:
        return CondensedLast(factor, movable)

    # Otherwise solve for each of them. Those of condition j stand at j width, j width + 1, … among
    # all.
    width = rows.shape[1]
    places = surface.slots[:, None] * width + np.arange(width)
    return CondensedTwice(A, surface.comm, rows[rows >= 0], places[rows >= 0], movable)


class CondensedLast:
    """Hold A condensed onto k contact unknowns, which come last in its factor.

    ``find_free_motion`` begins a step, and ``answer`` ends it. Their arguments may also be those of
    several steps, a row for each.

    Attributes:
        flexibility: (k, k) G.
        movable: (k,) which unknowns can move.
    """

    def __init__(self, factor: ContactLast, movable: Mask) -> None:
        """Invert the corner of the factor.

        Args:
            factor: a factor of A with the movable contact unknowns last.
            movable: (k,) which contact unknowns can move; the others are not in the factor.
        """
        self._factor = factor
        self.movable = movable
        self._all = bool(movable.all())
        corner = factor.corner

        # G is the inverse of A condensed onto c, and that is (L_cc L_ccᵀ)⁻¹. LAPACK gives its lower
        # triangle.
        inverse = lapack.dpotri(corner, lower=1)[0] if len(corner) else corner
        self.flexibility: Array = np.zeros((len(movable), len(movable)))
        self.flexibility[np.ix_(movable, movable)] = np.tril(inverse) + np.tril(inverse, -1).T

    def find_free_motion(self, b: Array) -> Array:
        """Return x_c (k,) of A⁻¹b, and keep b for ``answer``. Collective.

        It takes the forward substitution of b, and a small one with the corner.
        """
        self._y = self._factor.forward(b)
        x = self._factor.solve_corner(self._y)
        if self._all:
            self._x = x
        else:
            self._x = np.zeros((*b.shape[:-1], len(self.movable)))
            self._x.T[self.movable] = x.T
        return self._x

    def _select_movable(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return the values of unknowns that can move."""
        return values if self._all else values.T[self.movable].T

    def answer(self, r: Array, held: Mask, values: Array) -> Array:
        """Return x = A⁻¹(b - r), owned rows, with some unknowns on given values. Collective.

        To hold them where they would be but for rounding removes this rounding.

        Args:
            r: (k,) reactions, in the unit of b.
            held: (k,) which contact unknowns are held.
            values: (k,) the x at which they are held; what stands beside the held ones is not read.
        """
        # Reactions change y_c alone, as the contact unknowns are the last ones. The backward
        # substitution then gives the other unknowns that are in equilibrium with x_c.
        if np.count_nonzero(r):
            x = self._factor.solve_corner(self._y - self._factor.reduce(self._select_movable(r)))
        else:
            x = self._select_movable(self._x)
        x_c = np.where(self._select_movable(held), self._select_movable(values), x)
        return self._factor.backward(x_c)

    def respond(self, r: Array) -> Array:
        """Return A⁻¹ r, owned rows, of forces r (k,). Collective."""
        self._factor.forget_load()
        y_c = self._factor.reduce(r[self.movable])
        return self._factor.backward(self._factor.solve_corner(y_c))


class CondensedTwice:
    """Hold A condensed onto k contact unknowns, with any factor of A.

    It has the methods and attributes of ``CondensedLast``, for one step at a time.
    """

    def __init__(
        self,
        A: EffectiveMatrix,
        comm: Comm,
        owned: Indices,
        places: Indices,
        movable: Mask,
    ) -> None:
        """Solve for a unit force on each contact unknown. Collective.

        Args:
            A: the effective matrix.
            comm: the ranks.
            owned: the contact unknowns of this rank that can move, as rows of A.
            places: where these stand among the k contact unknowns of all ranks.
            movable: (k,) which contact unknowns can move.
        """
        self._A = A
        self._comm = comm
        self._owned = owned
        self._places = places
        self.movable = movable
        G = self._gather(A.factor.solve_units(owned, places, len(movable), owned))
        self.flexibility: Array = 0.5 * (G + G.T) if A.algebra.symmetric else G

    def _gather(self, values: Array) -> Array:
        """Return the values at the contact unknowns of all ranks. Collective.

        Each rank gives those at its own, (owned, …). The answer (k, …) is the same on all ranks.
        """
        whole = np.zeros((len(self.movable), *values.shape[1:]))
        whole[self._places] = values
        return self._comm.sum(whole)

    def find_free_motion(self, b: Array) -> Array:
        """Return x_c (k,) of A⁻¹b, and keep A⁻¹b for ``answer``. Collective."""
        self._x = self._A.factor.solve(b)
        return self._gather(self._x[self._owned])

    def answer(self, r: Array, held: Mask, values: Array) -> Array:
        """Return x = A⁻¹(b - r), owned rows, with some unknowns on given values. Collective.

        The arguments are those of ``CondensedLast.answer``.

        Args:
            r: (k,) reactions, in the unit of b.
            held: (k,) which contact unknowns are held.
            values: (k,) the x at which they are held.
        """
        x = self._x - self.respond(r) if r.any() else self._x
        held_here = held[self._places]
        x[self._owned[held_here]] = values[self._places[held_here]]
        return x

    def respond(self, r: Array) -> Array:
        """Return A⁻¹ r, owned rows, of forces r (k,). Collective."""
        load = np.zeros(self._A.matrix.rows)
        load[self._owned] = r[self._places]
        return self._A.factor.solve(load)


class CondensedTraces:
    """Hold A condensed onto conditions that are traces of k unknowns.

    It has the methods and attributes of ``CondensedTwice``, whose contact values are those of the
    traces here. Of them only total forces are unique where traces depend on one another.
    """

    def __init__(self, A: EffectiveMatrix, traces: Traces, *, frictional: bool) -> None:
        """Condense A onto the unknowns that the traces read. Collective.

        Args:
            A: the effective matrix.
            traces: the conditions.
            frictional: whether tangential traces count, beside the normal ones.
        """
        B = traces.every
        if not frictional:
            B = B[:: 1 + traces.moves.shape[1]]
        self._B = B
        self._Bt = sp.csr_matrix(B.T)
        everything = np.ones(len(traces.unknowns), dtype=bool)
        factor = A.contact_last(traces.unknowns)
        if factor is None:
            twice = CondensedTwice(A, traces.comm, traces.own, traces.places, everything)
            self._unknowns: CondensedLast | CondensedTwice = twice
        else:
            self._unknowns = CondensedLast(factor, everything)
        self.movable: Mask = np.diff(B.indptr) > 0

        # G = B C Bᵀ, as symmetric as C.
        C = self._unknowns.flexibility
        G = np.asarray(B @ (B @ C.T).T)
        self.flexibility: Array = 0.5 * (G + G.T) if A.algebra.symmetric else G

    def find_free_motion(self, b: Array) -> Array:
        """Return B A⁻¹b, and keep b for ``answer``. Collective."""
        self._free = self._unknowns.find_free_motion(b)
        return np.asarray(self._B @ self._free)

    def answer(self, r: Array, held: Mask, values: Array) -> Array:
        """Return x = A⁻¹(b - Bᵀr), owned rows. Collective.

        A trace is no unknown that could be put on a value: rounding stays. Unknowns that reactions
        bring to rest but for rounding are zero.

        Args:
            r: reactions of the conditions, in the unit of b.
            held: is not read.
            values: is not read.
        """
        force = self._Bt @ r
        x = self._free - self._unknowns.flexibility @ force
        still = find_still(x, self._free)
        return self._unknowns.answer(force, still, np.zeros(len(still)))

    def respond(self, r: Array) -> Array:
        """Return A⁻¹ Bᵀ r, owned rows, of reactions r. Collective."""
        return self._unknowns.respond(self._Bt @ r)


Condensation = CondensedLast | CondensedTwice | CondensedTraces | CondensedBodies
