"""Place points and weights for double integrals over pairs of elements.

Both integrals are split where a wave front cuts through an element.

A kernel at time t has square-root kinks at r = c_S t and r = c_P t and a logarithm at r = 0. Pairs
of elements that do not touch are integrated with products of Gauss rules, or, where a front
crosses, with both integrals split at the front. Touching pairs use coordinates in which r is a
product, so that the singularity and the fronts lie at ends of the inner integral: z = xi - eta on
one element, Duffy's (u, u w) at a common corner.

Elements that face each other at a fraction of their length have peaks of that width: the inner
integral is split and stretched about the foot of x on the second element, the outer one about the
feet of that element's ends, the integral over w about the foot of one end on the other element
(rules.placed).

Every piece is mapped with w -> w²(3 - 2w), which makes square roots and logarithms at both ends
harmless.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix

from ..core.algebra import Array, Indices
from ..core.arguments import check_fields
from ..core.quantities import Between
from .element_pairs import ElementPairs
from .rules import gauss, graded, pieces, placed, roots, smoothed

Rule = tuple[Array, Array]
MOST_POINTS = 200  # Gauss points a rule may have
CHUNK = 40_000  # points evaluated at once: keeps the arrays in the cache


@dataclass(frozen=True)
class Orders:
    """Hold counts of Gauss points.

    Far and near pairs (each way); pieces of split pairs, outer and inner; touching pairs; pieces of
    close pairs.
    """

    far: Annotated[int, Between(1, MOST_POINTS)] = 4
    near: Annotated[int, Between(1, MOST_POINTS)] = 8
    outer: Annotated[int, Between(1, MOST_POINTS)] = 6
    inner: Annotated[int, Between(1, MOST_POINTS)] = 8
    touching: Annotated[int, Between(1, MOST_POINTS)] = 12
    close: Annotated[int, Between(1, MOST_POINTS)] = 10

    def __post_init__(self) -> None:
        check_fields(self)


@dataclass(frozen=True)
class PointSet:
    """Hold points of some element pairs.

    They are x on the first element at xi, y on the second at eta, both in [0, 1].

    pairs: (p,) numbers of the pairs; owner: (m,) which of them a point belongs to, or None when the
    points come in equal blocks of len(weight); d: (2, m) x - y [m]; r: (m,) its length; xi, eta,
    weight: (m,), or one block of them.
    """

    pairs: Indices
    owner: Indices | None
    d: Array
    r: Array
    xi: Array
    eta: Array
    weight: Array

    def integrate(self, values: NDArray) -> NDArray:
        """Return (k, p, 4) integrals of (k, m) values times phi_a(xi) phi_b(eta).

        Their index is [2 a + b], and phi = 1 - x, x.
        """
        if self.owner is None:
            return values.reshape(len(values), len(self.pairs), -1) @ self._weighted
        return np.asarray(self.shapes() @ values.T).T.reshape(len(values), len(self.pairs), 4)

    def shapes(self) -> csc_matrix:
        """Return (4 p, m) weighted shape functions.

        Their product with values at the points integrates them.
        """
        count = len(self.pairs)
        owner = np.repeat(np.arange(count), len(self.weight)) if self.owner is None else self.owner
        weighted = np.tile(self._weighted, (count, 1)) if self.owner is None else self._weighted
        return at_points(weighted, owner, count)

    @property
    def _weighted(self) -> Array:
        """Return (m, 4) weight times phi_a(xi) phi_b(eta), or one block of them."""
        xi, eta = self.xi, self.eta
        return (
            np.stack([(1 - xi) * (1 - eta), (1 - xi) * eta, xi * (1 - eta), xi * eta], 1)
            * self.weight[:, None]
        )


def at_points(weighted: Array, owner: Indices, count: int) -> csc_matrix:
    """Return (k count, m) that adds up values times shape functions.

    The values are at m points; the k weighted shape functions (m, k) are those of the points'
    owners.
    """
    k = weighted.shape[1]
    rows, columns = k * owner[:, None] + np.arange(k), np.arange(0, weighted.size + 1, k)
    return csc_matrix((weighted.ravel(), rows.ravel(), columns), shape=(k * count, len(owner)))


def point_sets(
    pairs: ElementPairs, fronts: Sequence[float], orders: Orders = Orders()
) -> Iterator[PointSet]:
    """Return all points for kernels with kinks at r in `fronts` [m].

    They are zero beyond the greatest of them; () is smooth.
    """
    reach = max(fronts, default=np.inf)
    crossed = np.zeros(len(pairs), bool)
    behind_soon = np.zeros(len(pairs), bool)
    for front in fronts:
        crossed |= (pairs.r_min < front) & (front < pairs.r_max)
        behind_soon |= (pairs.r_max <= front) & (front < pairs.r_max + pairs.h)
    reached = pairs.r_min < reach
    apart = reached & ~pairs.same & ~pairs.corner & ~pairs.close
    plain = apart & ~crossed
    fine = pairs.near | behind_soon
    yield from _products(pairs, np.flatnonzero(plain & ~fine), orders.far)
    yield from _products(pairs, np.flatnonzero(plain & fine), orders.near)
    yield from _split(
        pairs,
        np.flatnonzero(apart & crossed),
        fronts,
        smoothed(orders.outer),
        smoothed(orders.inner),
    )
    close = smoothed(orders.close)
    yield from _split(
        pairs,
        np.flatnonzero(reached & pairs.close & ~pairs.corner),
        fronts,
        close,
        close,
        close=True,
    )
    yield from _on_one_element(pairs, np.flatnonzero(pairs.same), fronts, orders.touching)
    for sharp in (False, True):
        corner = np.flatnonzero(pairs.corner & (pairs.close == sharp))
        yield from _at_corners(pairs, corner, fronts, orders.touching, sharp=sharp)


def _products(pairs: ElementPairs, chosen: Indices, order: int) -> Iterator[PointSet]:
    x, w = gauss(order)
    xi, eta = np.repeat(x, order), np.tile(x, order)
    weight = np.repeat(w, order) * np.tile(w, order)
    size = max(1, CHUNK // order**2)
    for start in range(0, len(chosen), size):
        part = chosen[start : start + size]
        d = (
            pairs.offset[:, part, None] + pairs.a[:, part, None] * xi - pairs.b[:, part, None] * eta
        ).reshape(2, -1)
        yield PointSet(part, None, d, np.hypot(*d), xi, eta, weight)


def _flat(
    pairs: ElementPairs, chosen: Indices, owner: Indices, xi: Array, eta: Array, weight: Array
) -> PointSet:
    pair = chosen[owner]
    d = pairs.offset[:, pair] + pairs.a[:, pair] * xi - pairs.b[:, pair] * eta
    return PointSet(chosen, owner, d, np.hypot(*d), xi, eta, weight)


def _split(
    pairs: ElementPairs,
    chosen: Indices,
    fronts: Sequence[float],
    outer: Rule,
    inner: Rule,
    *,
    close: bool = False,
) -> Iterator[PointSet]:
    """Split the outer integral where fronts reach the second element's ends or graze it.

    The inner integral is split at the fronts. If ``close``, both are split about the feet as well,
    and stretched there.
    """
    for start in range(0, len(chosen), 200):
        part = chosen[start : start + 200]
        owner, xi, weight = _outer(pairs, part, fronts, outer, close)
        row, eta, weight = _inner(pairs, part[owner], xi, weight, fronts, inner, close)
        yield _flat(pairs, part, owner[row], xi[row], eta, weight)


def _outer(
    pairs: ElementPairs, part: Indices, fronts: Sequence[float], rule: Rule, close: bool
) -> tuple[Indices, Array, Array]:
    """Return (pair in ``part``, xi, weight) of the points on the first elements."""
    breaks = _outer_breaks(pairs, part, fronts)
    if close:
        feet, heights = _feet(pairs, part)
        row, low, length = pieces(
            np.concatenate([breaks, feet, feet.mean(axis=1, keepdims=True)], axis=1)
        )
        nearer = np.hypot(feet[row] - (low + 0.5 * length)[:, None], heights[row]).argmin(axis=1)
        xi, weight = placed(low, length, rule, about=(feet[row, nearer], heights[row, nearer]))
    else:
        row, low, length = pieces(breaks)
        xi, weight = placed(low, length, rule)
    return np.repeat(row, len(rule[0])), xi.ravel(), weight.ravel()


def _inner(
    pairs: ElementPairs,
    pair: Indices,
    xi: Array,
    scale: Array,
    fronts: Sequence[float],
    rule: Rule,
    close: bool,
) -> tuple[Indices, Array, Array]:
    """Return (row of ``xi``, eta, weight) of points.

    They are those on the second elements that the last front has reached.
    """
    d, b = pairs.offset[:, pair] + pairs.a[:, pair] * xi, pairs.b[:, pair]
    b2, projection, d2 = (b**2).sum(0), (d * b).sum(0), (d**2).sum(0)
    breaks = [roots(b2, -2.0 * projection, d2 - front**2) for front in fronts]
    foot, height = projection / b2, np.abs(d[0] * b[1] - d[1] * b[0]) / b2
    row, low, length = pieces(np.concatenate([*breaks, foot[:, None]] if close else breaks, axis=1))
    middle = d[:, row] - b[:, row] * (low + 0.5 * length)
    heard = (middle**2).sum(0) < max(fronts, default=np.inf) ** 2
    row, low, length = row[heard], low[heard], length[heard]
    eta, weight = placed(low, length, rule, scale[row], (foot[row], height[row]) if close else None)
    return np.repeat(row, len(rule[0])), eta.ravel(), weight.ravel()


def _feet(pairs: ElementPairs, part: Indices) -> tuple[Array, Array]:
    """Return (p, 2) xi of the feet of the second element's ends on the line of the first.

    With them come their heights over it.
    """
    offset, a, b = pairs.offset[:, part], pairs.a[:, part], pairs.b[:, part]
    a2 = (a**2).sum(0)
    ends = (-offset, b - offset)
    feet = [(end * a).sum(0) / a2 for end in ends]
    heights = [np.abs(end[0] * a[1] - end[1] * a[0]) / a2 for end in ends]
    return np.stack(feet, axis=1), np.stack(heights, axis=1)


def _outer_breaks(pairs: ElementPairs, part: Indices, fronts: Sequence[float]) -> Array:
    """Return (p, 6 per front) xi where the first element is a front away.

    The distance is that from an end of the second element, or from its line.
    """
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
    return np.concatenate(breaks, axis=1) if breaks else np.empty((len(part), 0))


def _on_one_element(
    pairs: ElementPairs, chosen: Indices, fronts: Sequence[float], order: int
) -> Iterator[PointSet]:
    """Integrate once in z = |xi - eta|, on which alone r depends.

    The integral is split at the fronts; two points across are exact.
    """
    row, low, length = _reached(np.hypot(*pairs.a[:, chosen]), fronts)
    x, w = graded(order)
    across, across_weight = gauss(2)
    z = (low[:, None] + length[:, None] * x)[:, :, None]
    small = (1.0 - z) * across
    large = z + small
    weight = ((length[:, None] * w)[:, :, None] * (1.0 - z) * across_weight).ravel()
    owner = np.repeat(row, 2 * order)
    yield _flat(
        pairs,
        chosen,
        np.tile(owner, 2),
        np.concatenate([large.ravel(), small.ravel()]),
        np.concatenate([small.ravel(), large.ravel()]),
        np.tile(weight, 2),
    )


def _reached(distance: Array, fronts: Sequence[float]) -> tuple[Indices, Array, Array]:
    """Return the pieces of [0, 1] that the last front has reached.

    They are as those of ``pieces``. Here r is x times a distance.
    """
    row, low, length = pieces(np.array(fronts, float) / distance[:, None])
    heard = (low + 0.5 * length) * distance[row] < max(fronts, default=np.inf)
    return row[heard], low[heard], length[heard]


def _at_corners(
    pairs: ElementPairs, chosen: Indices, fronts: Sequence[float], order: int, *, sharp: bool
) -> Iterator[PointSet]:
    """Place points at (u, u w) and (u w, u) from the corner.

    There r = u R(w). The inner integral in u is split at fronts/R(w). ``sharp`` says that R(w)
    falls to a small share of its greatest value at the foot of one end on the other element.
    """
    if not len(chosen):
        return
    # the corner is the end of the first element and the start of the second
    at_end = pairs.shares_end[chosen]
    from_corner = np.where(at_end, -1.0, 1.0)
    a, b = pairs.a[:, chosen] * from_corner, -pairs.b[:, chosen] * from_corner
    aa, ab, bb = (a**2).sum(0), (a * b).sum(0), (b**2).sum(0)
    height = np.abs(a[0] * b[1] - a[1] * b[0])
    sets = []
    for first in (True, False):
        c0, c2 = (aa, bb) if first else (bb, aa)
        cuts = [roots(c2, -2.0 * ab, c0 - front**2) for front in fronts]
        foot = (ab / c2)[:, None]
        row, low, length = pieces(
            np.concatenate([*cuts, foot] if sharp else [foot[:, :0], *cuts], axis=1)
        )
        about = (foot[row, 0], (height / c2)[row]) if sharp else None
        ratios, weights = placed(low, length, smoothed(order), about=about)
        owner, ratio, outer_weight = np.repeat(row, order), ratios.ravel(), weights.ravel()
        distance = np.sqrt(c0[owner] - 2.0 * ratio * ab[owner] + ratio**2 * c2[owner])
        row, low, length = _reached(distance, fronts)
        along, weight = placed(low, length, graded(order), outer_weight[row])
        weight, long = (weight * along).ravel(), along.ravel()
        short = (along * ratio[row, None]).ravel()
        sets.append(
            (np.repeat(owner[row], order), *((long, short) if first else (short, long)), weight)
        )
    owner, xi, eta, weight = (np.concatenate(parts) for parts in zip(*sets, strict=True))
    end = at_end[owner]
    yield _flat(
        pairs, chosen, owner, np.where(end, 1.0 - xi, xi), np.where(end, eta, 1.0 - eta), weight
    )
