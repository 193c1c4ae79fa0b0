"""Cut convex polygons of a plane against one another, many at once.

It is integrated over what is left.

Polygons are (k, m, 2), corners anticlockwise; one with fewer corners repeats some, one that is cut
away has no area.
"""

import numpy as np

from ...core.algebra import Array, Indices, Mask

SHORT = 1e-9  # of the longest side of a polygon: round-off of what was cut


def cut(polygons: Array, start: Array, along: Array) -> Array:
    """Return what of each polygon is on the left of its line.

    The line goes through ``start`` (k, 2) along ``along`` (k, 2).
    """
    offset = polygons - start[:, None, :]
    left = along[:, None, 0] * offset[:, :, 1] - along[:, None, 1] * offset[:, :, 0]
    after, ahead = np.roll(polygons, -1, axis=1), np.roll(left, -1, axis=1)
    crossed = (left < 0.0) != (ahead < 0.0)
    share = np.where(crossed, left, 0.0) / np.where(crossed, left - ahead, 1.0)
    corners = np.stack([polygons, polygons + share[:, :, None] * (after - polygons)], axis=2)
    used = np.stack([left >= 0.0, crossed], axis=2).reshape(len(left), 2 * left.shape[1])
    count = used.sum(axis=1)
    place = np.minimum(
        np.arange(max(3, int(count.max(initial=0)))), np.maximum(count - 1, 0)[:, None]
    )
    order = np.take_along_axis(np.argsort(~used, axis=1, kind="stable"), place, axis=1)
    return np.take_along_axis(corners.reshape(*used.shape, 2), order[:, :, None], axis=1)


def sides(polygons: Array) -> Array:
    """Return the vectors (k, m, 2) from each corner to the next.

    They are zero for round-off, which has no direction.
    """
    edges = np.roll(polygons, -1, axis=1) - polygons
    length = np.linalg.norm(edges, axis=2, keepdims=True)
    return np.where(length > SHORT * length.max(axis=1, keepdims=True), edges, 0.0)


def overlaps(polygons: Array, others: Array) -> Array:
    """Return what each polygon shares with another one."""
    edges = sides(others)
    for edge in range(others.shape[1]):
        polygons = cut(polygons, others[:, edge], edges[:, edge])
    return polygons


def without(polygons: Array, others: Array, least: Array) -> tuple[Indices, Array]:
    """Return (number of its polygon, polygons) of the parts of each polygon outside of another.

    The parts are convex, and their areas above ``least`` (k,).
    """
    owner, inside, parts = np.arange(len(polygons)), polygons, []
    for start, along in zip(others.swapaxes(0, 1), sides(others).swapaxes(0, 1), strict=True):
        outside = cut(inside, start + along, -along)
        kept = (areas(outside) > least) & along.any(axis=1)  # other corners than repeated ones
        parts.append((owner[kept], outside[kept]))
        inside = cut(inside, start, along)
    return np.concatenate([part[0] for part in parts]), stacked([part[1] for part in parts])


def stacked(parts: list[Array]) -> Array:
    """Return all polygons of the parts, of as many corners as the largest has."""
    width = max(part.shape[1] for part in parts)
    return np.concatenate(
        [np.pad(p, ((0, 0), (0, width - p.shape[1]), (0, 0)), "edge") for p in parts]
    )


def areas(polygons: Array) -> Array:
    """Return the area (k,) of each polygon."""
    spokes = polygons[:, 1:] - polygons[:, :1]
    return 0.5 * cross(spokes[:, :-1], spokes[:, 1:]).sum(axis=1)


def cross(one: Array, two: Array) -> Array:
    """Return the products one_x two_y - one_y two_x of plane vectors (..., 2)."""
    return np.asarray(one[..., 0] * two[..., 1] - one[..., 1] * two[..., 0])


def turns(polygons: Array) -> Array:
    """Return twice the area (k, m) of the triangle at each corner.

    It is of one sign on convex polygons.
    """
    edges = np.roll(polygons, -1, axis=1) - polygons
    return cross(np.roll(edges, 1, axis=1), edges)


def triangles(polygons: Array) -> tuple[Indices, Array]:
    """Return (number of its polygon, corners (n, 3, 2)) of triangles that make up the polygons."""
    k, m, _ = polygons.shape
    fan = np.stack(
        [np.broadcast_to(polygons[:, :1], (k, m - 2, 2)), polygons[:, 1:-1], polygons[:, 2:]],
        axis=2,
    )
    owner, fan = np.repeat(np.arange(k), m - 2), fan.reshape(-1, 3, 2)
    real: Mask = areas(fan) > 0.0
    return owner[real], fan[real]


def rule(n: int) -> tuple[Array, Array]:
    """Return (barycentric coordinates (n², 3), weights (n²)) of a rule on a triangle.

    They integrate degree 2n - 2 exactly over a triangle of area 1: Gauss points of a square of
    which one side is drawn together.
    """
    x, w = np.polynomial.legendre.leggauss(n)
    x, w = 0.5 + 0.5 * x, 0.5 * w
    u, v = (one.ravel() for one in np.meshgrid(x, x, indexing="ij"))
    weights = 2.0 * np.outer(w * (1.0 - x), w).ravel()
    return np.column_stack([u, (1.0 - u) * v, (1.0 - u) * (1.0 - v)]), weights


def hats(corners: Array, points: Array) -> Array:
    """Return the shape functions (k, p, v) of each facet at points (k, p, 2) in it.

    They are linear on a triangle and bilinear on a quadrilateral; the facets have these corners (k,
    v, 2).

    Coordinates (x, y) of a point r = x b + y c + x y d from the first corner are roots of quadratic
    equations; neither denominator vanishes in a convex facet, where the determinant of the map is
    positive at all corners.
    """
    origin = corners[:, :1]
    r, b, c = points - origin, corners[:, 1:2] - origin, corners[:, -1:] - origin
    quadrilateral = corners.shape[1] == 4
    d = corners[:, 2:3] - origin - b - c if quadrilateral else np.zeros_like(b)
    area, bent, up, along = cross(b, c), cross(r, d), cross(b, r), cross(r, c)
    determinant = np.sqrt(np.maximum((area + bent) ** 2 - 4.0 * cross(c, d) * up, 0.0))
    x, y = 2.0 * along / (area - bent + determinant), 2.0 * up / (area + bent + determinant)
    if quadrilateral:
        return np.stack([(1.0 - x) * (1.0 - y), x * (1.0 - y), x * y, (1.0 - x) * y], axis=2)
    return np.stack([1.0 - x - y, x, y], axis=2)
