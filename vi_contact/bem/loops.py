"""Check closed loops of segments: which way round they run, what they enclose, where they cross."""

import numpy as np

from ..core.algebra import Array, Indices
from ..core.checks import describe_point
from ..core.errors import InputError

TOUCHING = 1e-12  # of the size of the boundary: nearer is the same place


def signed_area(points: Array) -> float:
    """Return the area inside one loop, positive when it runs counter-clockwise [m²]."""
    x, y = (points - points[0]).T
    return float(0.5 * np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def inside(point: Array, loop: Array) -> bool:
    """Tell whether the point lies inside the loop, by counting crossings of a ray."""
    after = np.roll(loop, -1, axis=0)
    spans = (loop[:, 1] > point[1]) != (after[:, 1] > point[1])
    a = loop[spans]
    b = after[spans]
    crossing = a[:, 0] + (point[1] - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0])
    return bool(np.count_nonzero(crossing > point[0]) % 2)


def should_run_forward(loops: list[Array], *, exterior: bool) -> list[bool]:
    """Tell whether each loop has to run counter-clockwise.

    Outer loops do, holes do not; the reverse holds if exterior.
    """
    forward = []
    for loop in loops:
        around = [other for other in loops if other is not loop and inside(loop[0], other)]
        is_outer = len(around) % 2 == 0
        forward.append(is_outer != exterior)
    return forward


def check_orientation(points: Array, sizes: tuple[int, ...], *, exterior: bool) -> None:
    """Raise InputError when a loop does not keep the body on its left.

    Args:
        points: (n, 2), nodes, loop after loop [m].
        sizes: number of nodes of each loop.
        exterior: whether the body is the unbounded outside.
    """
    loops = np.split(points, np.cumsum(sizes)[:-1])
    ways = should_run_forward(loops, exterior=exterior)
    for i, (loop, forward) in enumerate(zip(loops, ways, strict=True)):
        if (signed_area(loop) > 0.0) != forward:
            raise InputError(
                f"BoundaryMesh: loop {i} has the wrong orientation, normals would point into the "
                f"body; reverse its points or set exterior={not exterior}"
            )


def check_size(points: Array, sizes: tuple[int, ...]) -> None:
    """Raise InputError when the area of a loop is no number above zero.

    Its points are then on a line, or too large for squares.
    """
    for i, loop in enumerate(np.split(points, np.cumsum(sizes)[:-1])):
        with np.errstate(all="ignore"):
            extent = np.ptp(loop, axis=0)
            smallest = extent.min() ** 2
            largest = extent @ extent
        if not (smallest > 0.0 and np.isfinite(largest)):
            raise InputError(
                f"BoundaryMesh: loop {i} is {extent[0]:.3g} m wide and {extent[1]:.3g} m high, "
                "which leaves no area to compute with; give points of a plane body, in units of "
                "its size"
            )


def check_simple(points: Array, after: Indices) -> None:
    """Raise InputError when two elements cross, or a node lies on an element of other nodes."""
    a = points
    b = points[after]
    index = np.arange(len(points))

    # Nodes on elements: every node with every element but the two that it is an end of.
    distance = distances(points[:, None], a, b)
    distance[index, index] = np.inf
    distance[after, index] = np.inf
    node, element = np.unravel_index(int(distance.argmin()), distance.shape)
    if distance[node, element] <= TOUCHING * np.hypot(*np.ptp(points, axis=0)):
        raise InputError(
            "BoundaryMesh: the boundary crosses or touches itself at "
            f"{describe_point(points[node])}, where node {node} lies on element {element}; give a "
            "boundary that does not meet itself"
        )

    def side(p: Array, q: Array, x: Array) -> Array:
        """Return on which side of each segment each point is: the sign of a product (n, n).

        Args:
            p: (n, 2), where the segments begin.
            q: (n, 2), where they end.
            x: (n, 2), the points.
        """
        along = (q - p)[:, None]
        away = x - p[:, None]
        return np.asarray(along[..., 0] * away[..., 1] - along[..., 1] * away[..., 0])

    # Two elements cross where each one splits the ends of the other.
    splits = side(a, b, a) * side(a, b, b) < 0.0
    neighbours = (
        (after[:, None] == index)
        | (after[None, :] == index[:, None])
        | np.eye(len(points), dtype=bool)
    )
    crossing = splits & splits.T & ~neighbours
    if crossing.any():
        i, j = np.argwhere(crossing)[0]
        raise InputError(
            f"BoundaryMesh: the boundary crosses itself near {describe_point(a[i])}, where "
            f"elements {i} and {j} cross; give a boundary that does not meet itself"
        )


def distances(x: Array, start: Array, end: Array) -> Array:
    """Return the distances (...) of points from segments [m].

    Args:
        x: (..., 2), points.
        start: (..., 2), where the segments begin, of a shape that fits.
        end: (..., 2), where they end.
    """
    along = end - start
    share = np.clip(((x - start) * along).sum(-1) / (along**2).sum(-1), 0.0, 1.0)
    away = x - start - share[..., None] * along
    return np.hypot(*np.moveaxis(away, -1, 0))
