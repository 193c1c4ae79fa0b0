"""Join loose segments to the closed loops of a mesh of boundary elements.

They may be in any order and direction.
"""

import numpy as np
from numpy.typing import ArrayLike

from vi_contact.bem.boundary_mesh import BoundaryMesh
from vi_contact.bem.loops import should_run_forward, signed_area
from vi_contact.core.algebra import Array, Indices
from vi_contact.core.checks import array, integers
from vi_contact.core.errors import InputError


def from_segments(
    points: ArrayLike,
    segments: ArrayLike,
    *,
    labels: ArrayLike | None = None,
    exterior: bool = False,
) -> BoundaryMesh:
    """Join loose segments to a mesh.

    They are for example the facets of a finite element boundary, in any order and direction.

    points: (p, 2) or (p, 3) coordinates [m]; segments: (n, 2) indices of points; labels: (n,) e.g.
    facet tags. Loops are joined and turned so that the body is on the left. Raises InputError when
    a curve is open or branches.
    """
    coordinates = array("from_segments", "points", points, (None, None), unit="m")[:, :2]
    pairs = integers("from_segments", "segments", segments, (None, 2))
    if len(pairs) and not 0 <= pairs.min() <= pairs.max() < len(coordinates):
        raise InputError(
            f"from_segments: segments name the points {pairs.min()} to {pairs.max()}, there are "
            f"{len(coordinates)}; number points from 0 on"
        )
    order, sizes = ordered_loops(coordinates, pairs, exterior=exterior)
    tags = integers(
        "from_segments", "labels", np.zeros(len(pairs)) if labels is None else labels, (len(pairs),)
    )
    return BoundaryMesh(coordinates[order[:, 0]], sizes, tags[order[:, 1]], exterior)


def ordered_loops(
    points: Array, segments: Indices, *, exterior: bool
) -> tuple[Indices, tuple[int, ...]]:
    """Return ((n, 2) start point and number of each segment; sizes of the loops).

    They come loop after loop, with the body on the left.
    """
    ends = np.bincount(segments.ravel(), minlength=len(points))
    if len(segments) == 0 or (ends[np.unique(segments)] != 2).any():
        bad = int(np.argmax((ends != 2) & (ends > 0)))
        raise InputError(
            f"the boundary curve is open or branches at point {bad} ({points[bad].tolist()}), "
            f"where {int(ends[bad])} segments meet; give every segment of closed curves"
        )
    at_point: dict[int, list[int]] = {}
    for number, pair in enumerate(segments.tolist()):
        for point in pair:
            at_point.setdefault(point, []).append(number)
    left = set(range(len(segments)))
    loops: list[list[tuple[int, int]]] = []
    while left:
        number = min(left)
        point = int(segments[number, 0])
        loop = []
        while number in left:
            left.discard(number)
            loop.append((point, number))
            point = int(segments[number].sum()) - point
            number = next((n for n in at_point[point] if n != number), number)
        loops.append(loop)
    chains = [np.array(loop, np.int64) for loop in loops]
    curves = [points[chain[:, 0]] for chain in chains]
    turned = []
    for chain, curve, forward in zip(
        chains, curves, should_run_forward(curves, exterior=exterior), strict=True
    ):
        if (signed_area(curve) > 0.0) != forward:
            chain = np.stack([np.roll(chain[::-1, 0], 1), chain[::-1, 1]], axis=1)
        turned.append(chain)
    return np.concatenate(turned), tuple(len(chain) for chain in turned)
