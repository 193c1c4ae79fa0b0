"""Points and weights for double integrals over pairs of elements, split where a wave front cuts through them.

A kernel at time t has square-root kinks at r = c_S t and r = c_P t and a logarithm at r = 0. Pairs of elements that do
not touch are integrated with products of Gauss rules, or, where a front crosses, with both integrals split at the
front. Touching pairs use coordinates in which r is a product, so that the singularity and the fronts lie at ends of the
inner integral: z = xi - eta on one element, Duffy's (u, u w) at a common corner.

Every piece is mapped with w -> w²(3 - 2w), which makes square roots and logarithms at both ends harmless.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix

from .element_pairs import ElementPairs

Array = NDArray[np.float64]
Index = NDArray[np.int64]
CHUNK = 40_000  # points evaluated at once: keeps the arrays in the cache


@dataclass(frozen=True)
class Orders:
    """Gauss points: far and near pairs (each way); pieces of split pairs, outer and inner; touching pairs."""

    far: int = 4
    near: int = 8
    outer: int = 6
    inner: int = 8
    touching: int = 12


@dataclass(frozen=True)
class PointSet:
    """Points of some element pairs: x on the first element at xi, y on the second at eta, both in [0, 1].

    pairs: (p,) numbers of the pairs; owner: (m,) which of them a point belongs to, or None when the points come in
    equal blocks of len(weight); d: (2, m) x - y [m]; r: (m,) its length; xi, eta, weight: (m,), or one block of them.
    """

    pairs: Index
    owner: Index | None
    d: Array
    r: Array
    xi: Array
    eta: Array
    weight: Array

    def integrate(self, values: NDArray) -> NDArray:
        """(k, p, 4) integrals in (xi, eta) of (k, m) values against phi_a(xi) phi_b(eta), [2 a + b], phi = 1 - x, x."""
        shapes = np.stack(
            [(1 - self.xi) * (1 - self.eta), (1 - self.xi) * self.eta, self.xi * (1 - self.eta), self.xi * self.eta], 1
        ) * self.weight[:, None]
        if self.owner is None:
            return values.reshape(len(values), len(self.pairs), -1) @ shapes
        rows = 4 * self.owner[:, None] + np.arange(4)
        columns = np.arange(0, 4 * len(self.owner) + 1, 4)
        matrix = csc_matrix((shapes.ravel(), rows.ravel(), columns), shape=(4 * len(self.pairs), len(self.owner)))
        return np.asarray(matrix @ values.T).T.reshape(len(values), len(self.pairs), 4)


@lru_cache
def gauss(n: int) -> tuple[Array, Array]:
    """Gauss points and weights on [0, 1]."""
    x, w = np.polynomial.legendre.leggauss(n)
    return 0.5 * (x + 1.0), 0.5 * w


@lru_cache
def smoothed(n: int) -> tuple[Array, Array]:
    """Gauss rule after the substitution w²(3 - 2w): exact ends for square roots and logarithms."""
    x, w = gauss(n)
    return x**2 * (3.0 - 2.0 * x), 6.0 * w * x * (1.0 - x)


@lru_cache
def graded(n: int) -> tuple[Array, Array]:
    """Gauss rule after the substitution w³(10 - 15w + 6w²), for the logarithm at r = 0."""
    x, w = gauss(n)
    return x**3 * (10.0 - 15.0 * x + 6.0 * x**2), 30.0 * w * (x * (1.0 - x)) ** 2


def pieces(breaks: Array) -> tuple[Index, Array, Array]:
    """(row, start, length) of the parts into which each row of breaks cuts [0, 1]; NaN is no break."""
    inner = np.clip(np.nan_to_num(breaks, nan=0.0), 0.0, 1.0)
    ends = np.zeros((len(breaks), 1)), np.ones((len(breaks), 1))
    sorted_ends = np.sort(np.concatenate([ends[0], inner, ends[1]], axis=1), axis=1)
    lengths = np.diff(sorted_ends, axis=1)
    rows, columns = np.nonzero(lengths > 1e-12)
    return rows, sorted_ends[rows, columns], lengths[rows, columns]


def roots(a: Array, b: Array, c: Array) -> Array:
    """(..., 2) real roots of a x² + b x + c, NaN where there are none."""
    with np.errstate(invalid="ignore", divide="ignore"):
        q = -0.5 * (b + np.copysign(np.sqrt(b**2 - 4.0 * a * c), b))
        return np.stack([q / a, c / q], axis=-1)


def point_sets(pairs: ElementPairs, fronts: Sequence[float], orders: Orders = Orders()) -> Iterator[PointSet]:
    """All points needed for kernels with kinks at r in `fronts` [m], zero beyond the greatest of them; () is smooth."""
    reach = max(fronts, default=np.inf)
    crossed = np.zeros(len(pairs), bool)
    behind_soon = np.zeros(len(pairs), bool)
    for front in fronts:
        crossed |= (pairs.r_min < front) & (front < pairs.r_max)
        behind_soon |= (pairs.r_max <= front) & (front < pairs.r_max + pairs.h)
    reached = pairs.r_min < reach
    apart = reached & ~pairs.same & ~pairs.corner
    plain = apart & ~crossed
    fine = pairs.near | behind_soon
    yield from _products(pairs, np.flatnonzero(plain & ~fine), orders.far)
    yield from _products(pairs, np.flatnonzero(plain & fine), orders.near)
    yield from _split(pairs, np.flatnonzero(apart & crossed), fronts, orders)
    yield from _on_one_element(pairs, np.flatnonzero(pairs.same), fronts, orders.touching)
    yield from _at_corners(pairs, np.flatnonzero(pairs.corner), fronts, orders.touching)


def _products(pairs: ElementPairs, chosen: Index, order: int) -> Iterator[PointSet]:
    x, w = gauss(order)
    xi, eta = np.repeat(x, order), np.tile(x, order)
    weight = np.repeat(w, order) * np.tile(w, order)
    size = max(1, CHUNK // order**2)
    for start in range(0, len(chosen), size):
        part = chosen[start : start + size]
        d = (pairs.offset[:, part, None] + pairs.a[:, part, None] * xi - pairs.b[:, part, None] * eta).reshape(2, -1)
        yield PointSet(part, None, d, np.hypot(*d), xi, eta, weight)


def _flat(pairs: ElementPairs, chosen: Index, owner: Index, xi: Array, eta: Array, weight: Array) -> PointSet:
    pair = chosen[owner]
    d = pairs.offset[:, pair] + pairs.a[:, pair] * xi - pairs.b[:, pair] * eta
    return PointSet(chosen, owner, d, np.hypot(*d), xi, eta, weight)


def _split(pairs: ElementPairs, chosen: Index, fronts: Sequence[float], orders: Orders) -> Iterator[PointSet]:
    """Outer integral split where fronts reach the ends of the second element or graze it, inner one at the fronts."""
    for start in range(0, len(chosen), 200):
        part = chosen[start : start + 200]
        row, low, length = pieces(_outer_breaks(pairs, part, fronts))
        x, w = smoothed(orders.outer)
        outer = np.repeat(row, len(x))
        xi = (low[:, None] + length[:, None] * x).ravel()
        outer_weight = (length[:, None] * w).ravel()
        pair = part[outer]
        d = pairs.offset[:, pair] + pairs.a[:, pair] * xi
        b = pairs.b[:, pair]
        b2, projection, d2 = (b**2).sum(0), (d * b).sum(0), (d**2).sum(0)
        breaks = np.concatenate([roots(b2, -2.0 * projection, d2 - front**2) for front in fronts], axis=1)
        row, low, length = pieces(breaks)
        middle = d[:, row] - b[:, row] * (low + 0.5 * length)
        heard = (middle**2).sum(0) < max(fronts) ** 2
        row, low, length = row[heard], low[heard], length[heard]
        x, w = smoothed(orders.inner)
        eta = (low[:, None] + length[:, None] * x).ravel()
        weight = ((outer_weight[row] * length)[:, None] * w).ravel()
        point = np.repeat(row, len(x))
        yield _flat(pairs, part, outer[point], xi[point], eta, weight)


def _outer_breaks(pairs: ElementPairs, part: Index, fronts: Sequence[float]) -> Array:
    """(p, 6 per front) xi where the first element is at a front's distance from an end of the second, or its line."""
    offset, a, b = pairs.offset[:, part], pairs.a[:, part], pairs.b[:, part]
    a2 = (a**2).sum(0)
    normal = np.stack([b[1], -b[0]]) / np.hypot(*b)
    breaks = []
    for front in fronts:
        for start in (offset, offset - b):
            breaks.append(roots(a2, 2.0 * (start * a).sum(0), (start**2).sum(0) - front**2))
        with np.errstate(invalid="ignore", divide="ignore"):
            slope, height = (normal * a).sum(0), (normal * offset).sum(0)
            graze = np.stack([(front - height) / slope, (-front - height) / slope], axis=-1)
        breaks.append(np.where(np.isfinite(graze), graze, 0.0))
    return np.concatenate(breaks, axis=1)


def _on_one_element(pairs: ElementPairs, chosen: Index, fronts: Sequence[float], order: int) -> Iterator[PointSet]:
    """r depends on z = |xi - eta| alone: one integral in z, split at the fronts; two points across are exact."""
    h = np.hypot(*pairs.a[:, chosen])
    breaks = np.stack([front / h for front in fronts], axis=1) if len(fronts) else np.empty((len(h), 0))
    row, low, length = pieces(breaks)
    heard = (low + 0.5 * length) * h[row] < max(fronts, default=np.inf)
    row, low, length = row[heard], low[heard], length[heard]
    x, w = graded(order)
    across, across_weight = gauss(2)
    z = (low[:, None] + length[:, None] * x)[:, :, None]
    small = (1.0 - z) * across
    large = z + small
    weight = ((length[:, None] * w)[:, :, None] * (1.0 - z) * across_weight).ravel()
    owner = np.repeat(row, 2 * order)
    yield _flat(pairs, chosen, np.tile(owner, 2), np.concatenate([large.ravel(), small.ravel()]),
                np.concatenate([small.ravel(), large.ravel()]), np.tile(weight, 2))


def _at_corners(pairs: ElementPairs, chosen: Index, fronts: Sequence[float], order: int) -> Iterator[PointSet]:
    """Distances from the corner are (u, u w) and (u w, u): r = u R(w), inner integral in u split at fronts/R(w)."""
    if not len(chosen):
        return
    at_end = pairs.shares_end[chosen]  # the corner is the end of the first element and the start of the second
    from_corner = np.where(at_end, -1.0, 1.0)
    a, b = pairs.a[:, chosen] * from_corner, -pairs.b[:, chosen] * from_corner
    aa, ab, bb = (a**2).sum(0), (a * b).sum(0), (b**2).sum(0)
    sets = []
    for first in (True, False):
        c0, c2 = (aa, bb) if first else (bb, aa)
        cuts = [roots(c2, -2.0 * ab, c0 - front**2) for front in fronts]
        row, low, length = pieces(np.concatenate(cuts, axis=1) if cuts else np.empty((len(chosen), 0)))
        x, w = smoothed(order)
        owner, ratio = np.repeat(row, order), (low[:, None] + length[:, None] * x).ravel()
        outer_weight = (length[:, None] * w).ravel()
        distance = np.sqrt(c0[owner] - 2.0 * ratio * ab[owner] + ratio**2 * c2[owner])
        reached = np.stack([front / distance for front in fronts], axis=1) if cuts else np.empty((len(ratio), 0))
        row, low, length = pieces(reached)
        heard = (low + 0.5 * length) * distance[row] < max(fronts, default=np.inf)
        row, low, length = row[heard], low[heard], length[heard]
        x, w = graded(order)
        u = low[:, None] + length[:, None] * x
        weight = ((outer_weight[row] * length)[:, None] * w * u).ravel()
        long, short = u.ravel(), (u * ratio[row, None]).ravel()
        sets.append((np.repeat(owner[row], order), *((long, short) if first else (short, long)), weight))
    owner, xi, eta, weight = (np.concatenate(parts) for parts in zip(*sets, strict=True))
    end = at_end[owner]
    yield _flat(pairs, chosen, owner, np.where(end, 1.0 - xi, xi), np.where(end, eta, 1.0 - eta), weight)
