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
(``rules.place_rule``).

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
from .rules import Rule, gauss, grade_rule, pieces, place_rule, roots, smooth_rule

MOST_POINTS = 200  # Gauss points a rule may have
CHUNK = 40_000  # points evaluated at once: keeps the arrays in the cache
SPLIT_PAIRS = 200  # pairs that are split at once, for the same reason


@dataclass(frozen=True)
class Orders:
    """Hold the numbers of Gauss points for each kind of pair of elements.

    Attributes:
        far: points along each element of pairs that are far apart and that no front crosses.
        near: the same, of pairs within a few lengths, or behind which a front has just passed.
        outer: points of each piece of the first element, of pairs that a front crosses.
        inner: points of each piece of the second element, of the same pairs.
        touching: points of each piece in both coordinates, of one element with itself and of
            elements with a common corner.
        close: points of each piece of both elements, of pairs that face each other at less than
            their length.
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
    """Hold m points (x, y) of p pairs: x on the first element at xi, y on the second at eta.

    Attributes:
        pairs: (p,) numbers of the pairs.
        owner: (m,) which of these pairs a point belongs to; None where the points come in equal
            blocks, one for each pair, and xi, eta and weight are those of one block.
        d: (2, m) x - y [m].
        r: (m,) length of d [m].
        xi: (m,) place of x in [0, 1] on the first element.
        eta: (m,) place of y in [0, 1] on the second element.
        weight: (m,) of the point in the double integral over [0, 1]².
    """

    pairs: Indices
    owner: Indices | None
    d: Array
    r: Array
    xi: Array
    eta: Array
    weight: Array

    def integrate(self, values: NDArray) -> NDArray:
        """Return the integrals (k, p, 4) of values (k, m) times phi_a(xi) phi_b(eta).

        The last index is 2 a + b; phi_0 = 1 - x and phi_1 = x.
        """
        count = len(self.pairs)
        if self.owner is None:
            return values.reshape(len(values), count, -1) @ self._weighted_shapes
        integrals = np.asarray(self.shapes() @ values.T).T
        return integrals.reshape(len(values), count, 4)

    def shapes(self) -> csc_matrix:
        """Return the weighted shape functions (4 p, m), whose product with values integrates."""
        count = len(self.pairs)
        if self.owner is not None:
            return integration_matrix(self._weighted_shapes, self.owner, count)
        owner = np.repeat(np.arange(count), len(self.weight))
        return integration_matrix(np.tile(self._weighted_shapes, (count, 1)), owner, count)

    @property
    def _weighted_shapes(self) -> Array:
        """Return weight times phi_a(xi) phi_b(eta), (m, 4) or those of one block."""
        xi = self.xi
        eta = self.eta
        shapes = np.stack([(1 - xi) * (1 - eta), (1 - xi) * eta, xi * (1 - eta), xi * eta], 1)
        return shapes * self.weight[:, None]


def integration_matrix(weighted: Array, owner: Indices, count: int) -> csc_matrix:
    """Return the matrix (k count, m) that integrates values at m points over their owners.

    Args:
        weighted: (m, k), weight times the k shape functions at every point.
        owner: (m,), which element or pair a point belongs to.
        count: number of owners.
    """
    k = weighted.shape[1]
    rows = k * owner[:, None] + np.arange(k)
    column_starts = np.arange(0, weighted.size + 1, k)  # every column has k entries
    shape = (k * count, len(owner))
    return csc_matrix((weighted.ravel(), rows.ravel(), column_starts), shape=shape)


def point_sets(
    pairs: ElementPairs, fronts: Sequence[float], orders: Orders = Orders()
) -> Iterator[PointSet]:
    """Yield all points for kernels that have kinks at the fronts.

    Args:
        pairs: the pairs of elements.
        fronts: distances r of the kinks [m]. Beyond the greatest of them kernels are zero; without
            any they are smooth and reach everywhere.
        orders: numbers of Gauss points.
    """
    # What the fronts are to each pair: between its least and greatest distance, or just beyond.
    reach = max(fronts, default=np.inf)
    crossed = np.zeros(len(pairs), bool)
    just_passed = np.zeros(len(pairs), bool)
    for front in fronts:
        crossed |= (pairs.r_min < front) & (front < pairs.r_max)
        just_passed |= (pairs.r_max <= front) & (front < pairs.r_max + pairs.h)
    reached = pairs.r_min < reach

    # Elements apart: products of rules, or split integrals where a front crosses.
    apart = reached & ~pairs.same & ~pairs.corner & ~pairs.close
    smooth = apart & ~crossed
    fine = pairs.near | just_passed
    yield from _place_products(pairs, np.flatnonzero(smooth & ~fine), orders.far)
    yield from _place_products(pairs, np.flatnonzero(smooth & fine), orders.near)
    outer = smooth_rule(orders.outer)
    inner = smooth_rule(orders.inner)
    yield from _place_split(pairs, np.flatnonzero(apart & crossed), fronts, outer, inner)

    # Elements that face each other: split about the feet as well, whether a front crosses or not.
    facing = reached & pairs.close & ~pairs.corner
    rule = smooth_rule(orders.close)
    yield from _place_split(pairs, np.flatnonzero(facing), fronts, rule, rule, close=True)

    # Elements that touch.
    yield from _place_on_one_element(pairs, np.flatnonzero(pairs.same), fronts, orders.touching)
    for sharp in (False, True):
        corner = np.flatnonzero(pairs.corner & (pairs.close == sharp))
        yield from _place_at_corners(pairs, corner, fronts, orders.touching, sharp=sharp)


def _place_products(pairs: ElementPairs, chosen: Indices, order: int) -> Iterator[PointSet]:
    """Yield the products of two Gauss rules on the chosen pairs, in equal blocks."""
    x, w = gauss(order)
    xi = np.repeat(x, order)
    eta = np.tile(x, order)
    weight = np.repeat(w, order) * np.tile(w, order)
    size = max(1, CHUNK // order**2)
    for start in range(0, len(chosen), size):
        part = chosen[start : start + size]
        on_first = pairs.a[:, part, None] * xi
        on_second = pairs.b[:, part, None] * eta
        d = (pairs.offset[:, part, None] + on_first - on_second).reshape(2, -1)
        yield PointSet(part, None, d, np.hypot(*d), xi, eta, weight)


def _make_point_set(
    pairs: ElementPairs, chosen: Indices, owner: Indices, xi: Array, eta: Array, weight: Array
) -> PointSet:
    """Return points (m,) whose owners are numbered among the chosen pairs.

    Args:
        pairs: the pairs of elements.
        chosen: (p,), numbers of the chosen pairs.
        owner: (m,), which of these a point belongs to.
        xi: (m,), place on the first element.
        eta: (m,), place on the second element.
        weight: (m,), of the point.
    """
    pair = chosen[owner]
    d = pairs.offset[:, pair] + pairs.a[:, pair] * xi - pairs.b[:, pair] * eta
    return PointSet(chosen, owner, d, np.hypot(*d), xi, eta, weight)


def _place_split(
    pairs: ElementPairs,
    chosen: Indices,
    fronts: Sequence[float],
    outer: Rule,
    inner: Rule,
    *,
    close: bool = False,
) -> Iterator[PointSet]:
    """Yield points with the integrals over both elements split at the fronts.

    The outer integral is split where fronts reach the second element's ends or graze it. The inner
    integral is split at the fronts. If ``close``, both are split about the feet as well, and
    stretched there.

    Args:
        pairs: the pairs of elements.
        chosen: numbers of the pairs that are integrated.
        fronts: distances of the kinks [m].
        outer: rule of each piece of the first element.
        inner: rule of each piece of the second element.
        close: whether the elements face each other.
    """
    for start in range(0, len(chosen), SPLIT_PAIRS):
        part = chosen[start : start + SPLIT_PAIRS]
        owner, xi, weight = _place_outer(pairs, part, fronts, outer, close)
        row, eta, weight = _place_inner(pairs, part[owner], xi, weight, fronts, inner, close)
        yield _make_point_set(pairs, part, owner[row], xi[row], eta, weight)


def _place_outer(
    pairs: ElementPairs, part: Indices, fronts: Sequence[float], rule: Rule, close: bool
) -> tuple[Indices, Array, Array]:
    """Return (pair in ``part``, xi, weight) of the points on the first elements.

    Args:
        pairs: the pairs of elements.
        part: numbers of some pairs.
        fronts: distances of the kinks [m].
        rule: of each piece.
        close: whether to split and stretch about the feet.
    """
    breaks = _find_outer_breaks(pairs, part, fronts)
    if close:
        # Every piece is stretched about that foot which is the nearer one to its middle.
        feet, heights = _find_feet(pairs, part)
        between_feet = feet.mean(axis=1, keepdims=True)
        row, low, length = pieces(np.concatenate([breaks, feet, between_feet], axis=1))
        middle = (low + 0.5 * length)[:, None]
        nearer = np.hypot(feet[row] - middle, heights[row]).argmin(axis=1)
        about = (feet[row, nearer], heights[row, nearer])
        xi, weight = place_rule(low, length, rule, about=about)
    else:
        row, low, length = pieces(breaks)
        xi, weight = place_rule(low, length, rule)
    points_of_rule = len(rule[0])
    return np.repeat(row, points_of_rule), xi.ravel(), weight.ravel()


def _place_inner(
    pairs: ElementPairs,
    pair: Indices,
    xi: Array,
    scale: Array,
    fronts: Sequence[float],
    rule: Rule,
    close: bool,
) -> tuple[Indices, Array, Array]:
    """Return (place in ``xi``, eta, weight) of the points on the second elements.

    Only those pieces have points that the last front has reached.

    Args:
        pairs: the pairs of elements.
        pair: (q,), number of the pair of every outer point.
        xi: (q,), place of the outer points on the first element.
        scale: (q,), weights of the outer points.
        fronts: distances of the kinks [m].
        rule: of each piece.
        close: whether to split and stretch about the foot of the outer point.
    """
    # On the second element |x - y|² = b² eta² - 2 (d·b) eta + d², d from its start to x: the
    # fronts cut it at the roots of a quadratic, and x has its foot at d·b / b².
    b = pairs.b[:, pair]
    d = pairs.offset[:, pair] + pairs.a[:, pair] * xi
    b2 = (b**2).sum(0)
    projection = (d * b).sum(0)
    d2 = (d**2).sum(0)
    breaks = [roots(b2, -2.0 * projection, d2 - front**2) for front in fronts]
    foot = projection / b2
    height = np.abs(d[0] * b[1] - d[1] * b[0]) / b2
    if close:
        breaks.append(foot[:, None])
    row, low, length = pieces(np.concatenate(breaks, axis=1))

    # Ahead of the last front the kernels are zero.
    middle = d[:, row] - b[:, row] * (low + 0.5 * length)
    reached = (middle**2).sum(0) < max(fronts, default=np.inf) ** 2
    row = row[reached]
    low = low[reached]
    length = length[reached]
    about = (foot[row], height[row]) if close else None
    eta, weight = place_rule(low, length, rule, scale[row], about)
    points_of_rule = len(rule[0])
    return np.repeat(row, points_of_rule), eta.ravel(), weight.ravel()


def _find_feet(pairs: ElementPairs, part: Indices) -> tuple[Array, Array]:
    """Return the feet of the second element's ends on the line of the first, and their heights.

    Both are (p, 2), in lengths of the first element.
    """
    a = pairs.a[:, part]
    offset = pairs.offset[:, part]
    a2 = (a**2).sum(0)
    ends = (-offset, pairs.b[:, part] - offset)
    feet = [(end * a).sum(0) / a2 for end in ends]
    heights = [np.abs(end[0] * a[1] - end[1] * a[0]) / a2 for end in ends]
    return np.stack(feet, axis=1), np.stack(heights, axis=1)


def _find_outer_breaks(pairs: ElementPairs, part: Indices, fronts: Sequence[float]) -> Array:
    """Return the places xi (p, 6 per front) where the first element is a front away.

    The distance is that from an end of the second element, or from its line.
    """
    offset = pairs.offset[:, part]
    a = pairs.a[:, part]
    b = pairs.b[:, part]
    a2 = (a**2).sum(0)
    normal = np.stack([b[1], -b[0]]) / np.hypot(*b)
    breaks = []
    for front in fronts:
        # The front reaches an end: a circle about the end cuts the line of the first element.
        for from_end in (offset, offset - b):
            along = 2.0 * (from_end * a).sum(0)
            breaks.append(roots(a2, along, (from_end**2).sum(0) - front**2))

        # The front grazes the element: a line beside it at this distance. Parallel ones never meet.
        with np.errstate(invalid="ignore", divide="ignore"):
            slope = (normal * a).sum(0)
            height = (normal * offset).sum(0)
            graze = np.stack([(front - height) / slope, (-front - height) / slope], axis=-1)
        breaks.append(np.where(np.isfinite(graze), graze, 0.0))
    return np.concatenate(breaks, axis=1) if breaks else np.empty((len(part), 0))


def _place_on_one_element(
    pairs: ElementPairs, chosen: Indices, fronts: Sequence[float], order: int
) -> Iterator[PointSet]:
    """Yield points of elements with themselves, in z = |xi - eta|, on which alone r depends.

    The integral over z is split at the fronts. Across, at one z, shape functions are quadratic and
    the kernel is constant: two points are exact.

    Args:
        pairs: the pairs of elements.
        chosen: numbers of the pairs of an element with itself.
        fronts: distances of the kinks [m].
        order: Gauss points of a piece.
    """
    row, low, length = _cut_reached_pieces(np.hypot(*pairs.a[:, chosen]), fronts)
    x, w = grade_rule(order)
    across, across_weight = gauss(2)
    z = (low[:, None] + length[:, None] * x)[:, :, None]
    small = (1.0 - z) * across
    large = z + small
    weight = ((length[:, None] * w)[:, :, None] * (1.0 - z) * across_weight).ravel()
    owner = np.repeat(row, 2 * order)

    # Both halves of the square: xi > eta, then xi < eta.
    yield _make_point_set(
        pairs,
        chosen,
        np.tile(owner, 2),
        np.concatenate([large.ravel(), small.ravel()]),
        np.concatenate([small.ravel(), large.ravel()]),
        np.tile(weight, 2),
    )


def _cut_reached_pieces(distance: Array, fronts: Sequence[float]) -> tuple[Indices, Array, Array]:
    """Return the pieces of [0, 1], as ``pieces`` does, that the last front has reached.

    Here r is the place in [0, 1] times a distance (p,) [m].
    """
    row, low, length = pieces(np.array(fronts, float) / distance[:, None])
    reached = (low + 0.5 * length) * distance[row] < max(fronts, default=np.inf)
    return row[reached], low[reached], length[reached]


def _place_at_corners(
    pairs: ElementPairs, chosen: Indices, fronts: Sequence[float], order: int, *, sharp: bool
) -> Iterator[PointSet]:
    """Yield points of elements with a common corner, at distances u and u w from it (Duffy).

    The square is cut along its diagonal: in one half the first element has u and the second u w,
    in the other half it is the other way round. Then r = u R(w), and the inner integral over u is
    split at fronts / R(w).

    Args:
        pairs: the pairs of elements.
        chosen: numbers of the pairs with a common corner.
        fronts: distances of the kinks [m].
        order: Gauss points of a piece.
        sharp: whether R(w) falls to a small share of its greatest value, at the foot of one end on
            the other element.
    """
    if not len(chosen):
        return
    # Vectors from the corner, which is the end of the first element and the start of the second,
    # or the other way round.
    at_end = pairs.shares_end[chosen]
    from_corner = np.where(at_end, -1.0, 1.0)
    a = pairs.a[:, chosen] * from_corner
    b = -pairs.b[:, chosen] * from_corner
    height = np.abs(a[0] * b[1] - a[1] * b[0])
    halves = [
        _place_half_of_corner(a, b, height, fronts, order, sharp=sharp),
        _place_half_of_corner(b, a, height, fronts, order, sharp=sharp),
    ]
    owner = np.concatenate([half.owner for half in halves])
    along_first = np.concatenate([halves[0].long, halves[1].short])
    along_second = np.concatenate([halves[0].short, halves[1].long])
    weight = np.concatenate([half.weight for half in halves])

    # From distances along the elements to their own coordinates.
    end = at_end[owner]
    xi = np.where(end, 1.0 - along_first, along_first)
    eta = np.where(end, along_second, 1.0 - along_second)
    yield _make_point_set(pairs, chosen, owner, xi, eta, weight)


@dataclass(frozen=True)
class _HalfOfCorner:
    """Hold the points of one half of Duffy's square, arrays (m,).

    Attributes:
        owner: which of the pairs a point belongs to.
        long: u, the distance from the corner on the element that has it.
        short: u w, the distance from the corner on the other element.
        weight: of the point.
    """

    owner: Indices
    long: Array
    short: Array
    weight: Array


def _place_half_of_corner(
    of_u: Array,
    of_uw: Array,
    height: Array,
    fronts: Sequence[float],
    order: int,
    *,
    sharp: bool,
) -> _HalfOfCorner:
    """Return the points at which one element has u and the other u w.

    Args:
        of_u: (2, p), vectors of the elements with u, from the corner [m].
        of_uw: (2, p), those of the elements with u w [m].
        height: (p,), area that both span [m²].
        fronts: distances of the kinks [m].
        order: Gauss points of a piece.
        sharp: whether to stretch w about the foot of the first vector's tip on the second.
    """
    # Outer integral over w: R(w)² = c0 - 2 w ab + w² c2. It is cut where R(w) is a front, so that
    # u = 1 lies on it, and about the foot, where R is least.
    c0 = (of_u**2).sum(0)
    c2 = (of_uw**2).sum(0)
    ab = (of_u * of_uw).sum(0)
    cuts = [roots(c2, -2.0 * ab, c0 - front**2) for front in fronts]
    foot = ab / c2
    cuts.append(foot[:, None] if sharp else np.empty((len(foot), 0)))
    row, low, length = pieces(np.concatenate(cuts, axis=1))
    about = (foot[row], (height / c2)[row]) if sharp else None
    w, w_weight = place_rule(low, length, smooth_rule(order), about=about)
    owner = np.repeat(row, order)
    w = w.ravel()
    w_weight = w_weight.ravel()

    # Inner integral over u, cut at fronts / R(w); u is the Jacobian of Duffy's coordinates.
    distance = np.sqrt(c0[owner] - 2.0 * w * ab[owner] + w**2 * c2[owner])
    row, low, length = _cut_reached_pieces(distance, fronts)
    u, u_weight = place_rule(low, length, grade_rule(order), w_weight[row])
    return _HalfOfCorner(
        owner=np.repeat(owner[row], order),
        long=u.ravel(),
        short=(u * w[row, None]).ravel(),
        weight=(u_weight * u).ravel(),
    )
