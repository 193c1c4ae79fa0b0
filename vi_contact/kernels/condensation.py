"""Condense A onto contact unknowns c.

What comes of it is their flexibility, their motion without reactions, and the answer to reactions.

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
) -> "Last | _Twice":
    """Factorise A and condense it onto the normal and, with friction, tangential contact unknowns.

    Collective.
    """
    mine, first = surface.owned[:, None], A.algebra.first(A.matrix.rows)
    if frictional:
        mine = np.hstack([mine, surface.tangents])
    unknowns = surface.everywhere(np.where(mine >= 0, mine + first, -1)).ravel()
    last = unknowns[unknowns >= 0]
    factor = A.contact_last(last) if len(np.unique(last)) == len(last) else None
    if factor is not None:
        return Last(factor, unknowns >= 0)
    places = surface.slots[:, None] * mine.shape[1] + np.arange(mine.shape[1])
    return _Twice(A, surface, mine[mine >= 0], places[mine >= 0], unknowns >= 0)


class Last:
    """Hold A condensed onto k contact unknowns, which come last in its factor.

    ``free`` begins a step, ``answer`` ends it; collective. ``flexibility`` (k, k); ``there`` (k,):
    what can move.
    """

    def __init__(self, factor: ContactLast, there: Mask) -> None:
        self._factor, self.there, corner = factor, there, factor.corner
        self._all = bool(there.all())
        inverse = lapack.dpotri(corner, lower=1)[0] if len(corner) else corner
        self.flexibility: Array = np.zeros((len(there), len(there)))
        self.flexibility[np.ix_(there, there)] = np.tril(inverse) + np.tril(inverse, -1).T

    def free(self, b: Array) -> Array:
        """Return x_c (k,) of A⁻¹b; of several loads, a row for each."""
        self._y = self._factor.forward(b)
        self._x = x = self._factor.free(self._y)
        if not self._all:
            self._x = np.zeros((*b.shape[:-1], len(self.there)))
            self._x.T[self.there] = x.T
        return self._x

    def _moving(self, x: NDArray[Any]) -> NDArray[Any]:
        return x if self._all else x.T[self.there].T

    def answer(self, r: Array, held: Mask, values: Array) -> Array:
        """Return x = A⁻¹(b - r), owned rows, with ``held`` unknowns (k,) on these values.

        Holding them removes round-off only.
        """
        if np.count_nonzero(r):
            x = self._factor.free(self._y - self._factor.reduced(self._moving(r)))
        else:
            x = self._moving(self._x)
        return self._factor.backward(np.where(self._moving(held), self._moving(values), x))

    def response(self, r: Array) -> Array:
        """Return A⁻¹ r, owned rows, of forces r (k,)."""
        self._factor.unloaded()
        return self._factor.backward(self._factor.free(self._factor.reduced(r[self.there])))


class _Twice:
    """Hold the same with any factor of A.

    There are ``owned`` contact unknowns of this rank and they have ``places`` among all.
    """

    def __init__(
        self,
        A: EffectiveMatrix,
        surface: ContactSurface,
        owned: Indices,
        places: Indices,
        there: Mask,
    ) -> None:
        self._A, self._comm, self._owned, self._places, self.there = (
            A,
            surface.comm,
            owned,
            places,
            there,
        )
        G = self._everywhere(A.factor.solve_units(owned, places, len(there), owned))
        self.flexibility: Array = 0.5 * (G + G.T) if A.algebra.symmetric else G

    def _everywhere(self, values: Array) -> Array:
        whole = np.zeros((len(self.there), *values.shape[1:]))
        whole[self._places] = values
        return self._comm.sum(whole)

    def free(self, b: Array) -> Array:
        self._x = self._A.factor.solve(b)
        return self._everywhere(self._x[self._owned])

    def answer(self, r: Array, held: Mask, values: Array) -> Array:
        x, mine = self._x - self.response(r) if r.any() else self._x, held[self._places]
        x[self._owned[mine]] = values[self._places[mine]]
        return x

    def response(self, r: Array) -> Array:
        load = np.zeros(self._A.matrix.rows)
        load[self._owned] = r[self._places]
        return self._A.factor.solve(load)


Condensation = Last | _Twice
