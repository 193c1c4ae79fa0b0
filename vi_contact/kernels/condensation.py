"""Condense A onto contact unknowns c: their flexibility, free motion, and the answer to reactions.

    G = (A⁻¹)_cc,    free: (A⁻¹b)_c,    answer: x = A⁻¹(b - r) with reactions r on c

With the contact unknowns last in the factor (``contact_last``) a step costs one forward and one
backward substitution, and G comes from the corner of the factor. Where there is no such factor it
costs two whole ones, and G one for each contact unknown. Contact values here are those of all
ranks, on every rank: the normal unknowns by the numbers of the conditions or, with friction, (r_n,
r_t) node by node. What cannot move (a prescribed tangent) stays at zero.
"""

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import lapack

from ..core.algebra import Array, EffectiveMatrix, Indices, Mask
from ..core.surfaces import ContactSurface
from .contact_last import ContactLast


def condense(
    A: EffectiveMatrix, surface: ContactSurface, *, frictional: bool = False
) -> "CondensedLast | CondensedTwice":
    """Factorise A and condense it onto contact unknowns. Collective.

    Args:
        A: the effective matrix.
        surface: the contact surface.
        frictional: whether tangential unknowns count, beside the normal ones.
    """
    # Contact unknowns of this rank, a row for each condition, and of all ranks by global numbers;
    # -1 stands for one that cannot move.
    first = A.algebra.first(A.matrix.rows)
    own = surface.owned[:, None]
    if frictional:
        own = np.hstack([own, surface.tangents])
    unknowns = surface.everywhere(np.where(own >= 0, own + first, -1)).ravel()
    moves = unknowns >= 0
    last = unknowns[moves]

    # An unknown of two conditions cannot be last twice.
    are_different = len(np.unique(last)) == len(last)
    factor = A.contact_last(last) if are_different else None
    if factor is not None:
        return CondensedLast(factor, moves)
    width = own.shape[1]
    places = surface.slots[:, None] * width + np.arange(width)
    return CondensedTwice(A, surface, own[own >= 0], places[own >= 0], moves)


class CondensedLast:
    """Hold A condensed onto k contact unknowns, which come last in its factor.

    ``free`` begins a step, and ``answer`` ends it. Their arguments may also be those of several
    steps, a row for each.

    Attributes:
        flexibility: (k, k) G.
        there: (k,) which unknowns can move.
    """

    def __init__(self, factor: ContactLast, there: Mask) -> None:
        """Invert the corner of the factor; ``there`` (k,) says which unknowns can move."""
        self._factor = factor
        self.there = there
        self._all = bool(there.all())
        corner = factor.corner
        inverse = lapack.dpotri(corner, lower=1)[0] if len(corner) else corner
        self.flexibility: Array = np.zeros((len(there), len(there)))
        self.flexibility[np.ix_(there, there)] = np.tril(inverse) + np.tril(inverse, -1).T

    def free(self, b: Array) -> Array:
        """Return x_c (k,) of A⁻¹b, and keep b for ``answer``. Collective."""
        self._y = self._factor.forward(b)
        x = self._factor.free(self._y)
        if self._all:
            self._x = x
        else:
            self._x = np.zeros((*b.shape[:-1], len(self.there)))
            self._x.T[self.there] = x.T
        return self._x

    def _moving(self, values: NDArray[Any]) -> NDArray[Any]:
        """Return the values of unknowns that can move."""
        return values if self._all else values.T[self.there].T

    def answer(self, r: Array, held: Mask, values: Array) -> Array:
        """Return x = A⁻¹(b - r), owned rows, with some unknowns on given values. Collective.

        To hold them where they would be but for rounding removes this rounding.

        Args:
            r: (k,) reactions.
            held: (k,) which unknowns are held.
            values: (k,) on what.
        """
        if np.count_nonzero(r):
            x = self._factor.free(self._y - self._factor.reduced(self._moving(r)))
        else:
            x = self._moving(self._x)
        return self._factor.backward(np.where(self._moving(held), self._moving(values), x))

    def response(self, r: Array) -> Array:
        """Return A⁻¹ r, owned rows, of forces r (k,). Collective."""
        self._factor.unloaded()
        return self._factor.backward(self._factor.free(self._factor.reduced(r[self.there])))


class CondensedTwice:
    """Hold A condensed onto k contact unknowns, with any factor of A: see ``CondensedLast``."""

    def __init__(
        self,
        A: EffectiveMatrix,
        surface: ContactSurface,
        owned: Indices,
        places: Indices,
        there: Mask,
    ) -> None:
        """Solve for a unit force on each contact unknown. Collective.

        Args:
            A: the effective matrix.
            surface: the contact surface.
            owned: the contact unknowns of this rank,
            places: and where they stand among all.
            there: (k,) which unknowns can move.
        """
        self._A = A
        self._comm = surface.comm
        self._owned = owned
        self._places = places
        self.there = there
        G = self._everywhere(A.factor.solve_units(owned, places, len(there), owned))
        self.flexibility: Array = 0.5 * (G + G.T) if A.algebra.symmetric else G

    def _everywhere(self, values: Array) -> Array:
        """Return the values at this rank's contact unknowns, for those of all ranks. Collective."""
        whole = np.zeros((len(self.there), *values.shape[1:]))
        whole[self._places] = values
        return self._comm.sum(whole)

    def free(self, b: Array) -> Array:
        """Return x_c (k,) of A⁻¹b, and keep A⁻¹b for ``answer``. Collective."""
        self._x = self._A.factor.solve(b)
        return self._everywhere(self._x[self._owned])

    def answer(self, r: Array, held: Mask, values: Array) -> Array:
        """Return x = A⁻¹(b - r), owned rows, with some unknowns on given values. Collective.

        Args:
            r: (k,) reactions.
            held: (k,) which unknowns are held.
            values: (k,) on what.
        """
        x = self._x - self.response(r) if r.any() else self._x
        held_here = held[self._places]
        x[self._owned[held_here]] = values[self._places[held_here]]
        return x

    def response(self, r: Array) -> Array:
        """Return A⁻¹ r, owned rows, of forces r (k,). Collective."""
        load = np.zeros(self._A.matrix.rows)
        load[self._owned] = r[self._places]
        return self._A.factor.solve(load)


Condensation = CondensedLast | CondensedTwice
