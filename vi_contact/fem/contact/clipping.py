"""Clip convex polygons of a plane against one another, many at once, and integrate over the rest.

The algorithm is that of Sutherland and Hodgman (Reentrant polygon clipping, Communications of the
ACM 17, 1974, 32-42): a polygon is cut along the line of each side of the other one in turn, and
each cut keeps what is on the left of the line. Here one cut is made of all polygons at a time, in
arrays.

Polygons are (k, m, 2), corners anticlockwise; one with fewer corners repeats some, one that is cut
away has no area. So all polygons of an array have as many corners as the largest of them, and a
repeated corner makes a side without length, which every function here passes over.
"""

import numpy as np

from ...core.algebra import Array, Indices, Mask

SHORT = 1e-9  # of the longest side of a polygon: a shorter one is round-off of what was cut


def cut(polygons: Array, start: Array, along: Array) -> Array:
    """Return what of each polygon is on the left of its line: one step of Sutherland and Hodgman.

    Args:
        polygons: (k, m, 2) convex polygons [m].
        start: (k, 2) a point of the line of each [m].
        along: (k, 2) the direction of the line.

    Returns:
        (k, n, 2) polygons, n the most corners that one has, at least 3; a polygon with fewer
        repeats its last one, a polygon that is all on the right repeats one of its corners.
    """
    # signed distance of each corner from the line, times |along|; and that of the next corner
    offset = polygons - start[:, None, :]
    left = along[:, None, 0] * offset[:, :, 1] - along[:, None, 1] * offset[:, :, 0]
    after = np.roll(polygons, -1, axis=1)
    ahead = np.roll(left, -1, axis=1)

    # where a side crosses the line, as a share of its length: the signs of its ends differ there
    crossed = (left < 0.0) != (ahead < 0.0)
    share = np.where(crossed, left, 0.0) / np.where(crossed, left - ahead, 1.0)

    # each corner puts out itself if it is on the left, then the crossing of the side that follows
    corners = np.stack([polygons, polygons + share[:, :, None] * (after - polygons)], axis=2)
    used = np.stack([left >= 0.0, crossed], axis=2).reshape(len(left), 2 * left.shape[1])

    # move what is put out to the front of each row, in its order, and repeat the last one
    count = used.sum(axis=1)
    width = max(3, int(count.max(initial=0)))
    place = np.minimum(np.arange(width), np.maximum(count - 1, 0)[:, None])
    order = np.take_along_axis(np.argsort(~used, axis=1, kind="stable"), place, axis=1)
    return np.take_along_axis(corners.reshape(*used.shape, 2), order[:, :, None], axis=1)


def sides(polygons: Array) -> Array:
    """Return the vectors (k, m, 2) from each corner to the next.

    They are zero for round-off, which has no direction.
    """
    edges = np.roll(polygons, -1, axis=1) - polygons
    length = np.linalg.norm(edges, axis=2, keepdims=True)
    return np.where(length > SHORT * length.max(axis=1, keepdims=True), edges, 0.0)


def intersect(polygons: Array, others: Array) -> Array:
    """Return what each polygon shares with another one.

    All sides of the other one cut in turn; a side without length cuts nothing.

    Args:
        polygons: (k, m, 2) convex polygons [m].
        others: (k, n, 2) one for each of them.

    Returns:
        (k, c, 2) convex polygons.
    """
    edges = sides(others)
    for edge in range(others.shape[1]):
        polygons = cut(polygons, others[:, edge], edges[:, edge])
    return polygons


def subtract(polygons: Array, others: Array, least: Array) -> tuple[Indices, Array]:
    """Return the parts of each polygon that are outside of another one.

    Args:
        polygons: (k, m, 2) convex polygons [m].
        others: (k, n, 2) what is taken away from each.
        least: (k,) area up to which a part is nothing [m²].

    Returns:
        (p,) number of the polygon that each part is of, and the parts (p, c, 2), which are convex.
    """
    owner = np.arange(len(polygons))
    inside = polygons
    owners = []
    parts = []
    # each side of the other one cuts off what is on its right; the next side cuts the rest
    for start, along in zip(others.swapaxes(0, 1), sides(others).swapaxes(0, 1), strict=True):
        outside = cut(inside, start + along, -along)
        # a side between repeated corners cuts nothing off
        used = (areas(outside) > least) & along.any(axis=1)
        owners.append(owner[used])
        parts.append(outside[used])
        inside = cut(inside, start, along)
    return np.concatenate(owners), stack(parts)


def stack(parts: list[Array]) -> Array:
    """Return all polygons of the parts (k, m, 2), with as many corners as the largest has.

    The others repeat their last corner.
    """
    width = max(part.shape[1] for part in parts)
    padded = []
    for part in parts:
        padded.append(np.pad(part, ((0, 0), (0, width - part.shape[1]), (0, 0)), "edge"))
    return np.concatenate(padded)


def areas(polygons: Array) -> Array:
    """Return the area (k,) of each polygon [m²]: that of the triangles round its first corner."""
    spokes = polygons[:, 1:] - polygons[:, :1]
    return 0.5 * cross(spokes[:, :-1], spokes[:, 1:]).sum(axis=1)


def cross(first: Array, second: Array) -> Array:
    """Return the products first_x second_y - first_y second_x of plane vectors (..., 2)."""
    return np.asarray(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])


def turns(polygons: Array) -> Array:
    """Return twice the signed area (k, m) [m²] of the triangle at each corner with both neighbours.

    All are positive on a convex polygon whose corners are anticlockwise.
    """
    edges = np.roll(polygons, -1, axis=1) - polygons
    return cross(np.roll(edges, 1, axis=1), edges)


def triangles(polygons: Array) -> tuple[Indices, Array]:
    """Return triangles that make up the polygons: a fan round the first corner of each.

    Returns:
        (n,) number of the polygon that each triangle is of, and its corners (n, 3, 2).
    """
    k, m, _ = polygons.shape
    first = np.broadcast_to(polygons[:, :1], (k, m - 2, 2))
    fan = np.stack([first, polygons[:, 1:-1], polygons[:, 2:]], axis=2).reshape(-1, 3, 2)
    owner = np.repeat(np.arange(k), m - 2)
    # repeated corners make triangles without area
    real: Mask = areas(fan) > 0.0
    return owner[real], fan[real]


def rule(n: int) -> tuple[Array, Array]:
    """Return a rule that integrates degree 2n - 2 exactly over a triangle of area 1.

    These are Gauss points of a square of which one side is drawn together.

    Args:
        n: points a way.

    Returns:
        (n², 3) barycentric coordinates, and (n²,) weights, which add up to one.
    """
    x, w = np.polynomial.legendre.leggauss(n)
    # from (-1, 1) to (0, 1)
    x = 0.5 + 0.5 * x
    w = 0.5 * w
    u, v = (axis.ravel() for axis in np.meshgrid(x, x, indexing="ij"))
    # the square's side u = 1 becomes a corner: the Jacobian is 1 - u
    weights = 2.0 * np.outer(w * (1.0 - x), w).ravel()
    return np.column_stack([u, (1.0 - u) * v, (1.0 - u) * (1.0 - v)]), weights


def hats(corners: Array, points: Array) -> Array:
    """Return the shape functions of facets at points in them.

    They are linear on a triangle and bilinear on a quadrilateral. A point is r = x b + y c + x y d
    from the first corner, and its coordinates (x, y) are roots of quadratic equations; neither
    denominator vanishes in a convex facet, where the determinant of the map is positive at all
    corners.

    Args:
        corners: (k, v, 2) of the facets, v = 3 or 4 [m].
        points: (k, p, 2) in them [m].

    Returns:
        (k, p, v), which add up to one.
    """
    origin = corners[:, :1]
    r = points - origin
    b = corners[:, 1:2] - origin
    c = corners[:, -1:] - origin
    quadrilateral = corners.shape[1] == 4
    d = corners[:, 2:3] - origin - b - c if quadrilateral else np.zeros_like(b)

    # products with c, and with b, of r = x b + y c + x y d leave one equation of x, and one of y
    area = cross(b, c)
    bent = cross(r, d)
    up = cross(b, r)
    along = cross(r, c)
    determinant = np.sqrt(np.maximum((area + bent) ** 2 - 4.0 * cross(c, d) * up, 0.0))
    # the form of the roots that has no difference of equal numbers where d is small
    x = 2.0 * along / (area - bent + determinant)
    y = 2.0 * up / (area + bent + determinant)
    if quadrilateral:
        return np.stack([(1.0 - x) * (1.0 - y), x * (1.0 - y), x * y, (1.0 - x) * y], axis=2)
    return np.stack([1.0 - x - y, x, y], axis=2)
