"""Cut segments of the boundaries of plane bodies where those of another boundary begin and end."""

from collections.abc import Iterator

import numpy as np

from ...core.algebra import Array
from .matching import Side


def find_normals(side: Side, ends: Array) -> Array:
    """Return outward unit normals (k, 2) of the segments with these ends (k, 2, 2)."""
    along = ends[:, 1] - ends[:, 0]
    normals = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
    outward = np.sum(normals[:, None, :] * side.nodes.normals[side.facets], axis=(1, 2))
    return np.asarray(np.where(outward[:, None] < 0.0, -normals, normals))


def cut_segment(
    ends: Array, normal: Array, ends2: Array, normals2: Array
) -> Iterator[tuple[float, float, int, Array]]:
    """Yield the pieces of a segment of side 1, in its coordinate from 0 to 1.

    Each is (low, high, segment of side 2, its coordinates at low and high): where several segments
    lie opposite, the nearest.

    Args:
        ends: (2, 2) ends of the segment [m].
        normal: (2,) its outward normal.
        ends2: (k, 2, 2) ends of the segments of side 2 [m].
        normals2: (k, 2) their outward normals.
    """
    # project the ends of all segments of side 2; those that face this one cut it at their ends
    along = ends[1] - ends[0]
    place = (ends2 - ends[0]) @ along / (along @ along)  # (k, 2): projections of the ends of side 2
    height = (ends2 - ends[0]) @ normal
    low = np.maximum(place.min(axis=1), 0.0)
    high = np.minimum(place.max(axis=1), 1.0)
    near = np.flatnonzero((normals2 @ normal < 0.0) & (high - low > 1e-12))
    cuts = np.unique(np.concatenate([low[near], high[near]]))
    for start, end in zip(cuts[:-1], cuts[1:], strict=True):
        # of the segments in front of a piece, the nearest at its middle
        middle = 0.5 * (start + end)
        over = near[(low[near] < middle) & (middle < high[near])]
        if end - start > 1e-12 and len(over):
            slope = place[over, 1] - place[over, 0]
            share = (middle - place[over, 0]) / slope
            distance = np.abs(height[over, 0] + share * (height[over, 1] - height[over, 0]))
            nearest = int(np.argmin(distance))
            segment = int(over[nearest])
            yield start, end, segment, (np.array([start, end]) - place[segment, 0]) / slope[nearest]
