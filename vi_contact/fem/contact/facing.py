"""Find which facets of different bodies face each other, and at what distance.

Each facet i looks along its outward normal. It sees a facet j of another body, in front of it, if

    n_i·n_j < -cos 30°,   gap <= within,   overlap > 1e-3 of the smaller facet,

where the overlap is that of i with the projection of j along n_i, and the gap is the distance along
n_i in the middle of the overlap. What is hidden by a nearer facet, of any body, is not seen. Facets
pair where each sees the other, unless others leave less than a quarter of what their faces have in
common: that is a look through a slit.

The candidates come from trees of middles of facets. Facets are sorted into classes by their size,
by factors of two, so that one large facet does not make every search wide: the search of a class in
another one has the radius of both, plus the gap.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from ...core.algebra import Array, Indices, Mask
from ...core.corners import FEATURE_ANGLE
from ...meshes.rows import number_parts
from .clipping import areas, intersect, subtract, triangles
from .nodes import Rows
from .sight import pairs_of
from .skin import Skin

FACING = np.cos(FEATURE_ANGLE)  # CHOSEN: normals of a pair are opposite to 30°
LEAST_OVERLAP = 1e-3  # CHOSEN: of the smaller facet; less is a sliver at the edge
# CHOSEN: of the overlap of two faces; less that is seen of it between others is a slit
LEAST_SEEN = 0.25
# cosine up to which a facet that turns away from a look still hides what is behind it
EDGE_ON = 0.02


@dataclass(frozen=True, eq=False)
class Sights(Rows):
    """Hold k sights: a facet of one body, seen by a facet of another one.

    Attributes:
        looking: (k,) facets that look.
        seen: (k,) facets that are seen.
        gaps: (k,) along the normal of the looking facet, in the middle of the overlap [m].
        overlaps: (k,) lengths or areas of what is seen, in the plane of the looking facet.
        middles: (k, d) of the overlaps, on the looking facet [m].
        shapes: (k, c, d - 1) the overlaps: two ends, or a polygon, from the middle of the looking
            facet, along its tangents [m].
    """

    looking: Indices
    seen: Indices
    gaps: Array
    overlaps: Array
    middles: Array
    shapes: Array


def find_sights(skin: Skin, within: float) -> tuple[Sights, Sights]:
    """Return which facets pair, each pair both ways, and which facets lie behind each other.

    Args:
        skin: the boundary of all bodies.
        within: largest gap [m].

    Returns:
        the pairs in the order of the looking facets, and the sights with a gap below minus the
        tolerance: where bodies overlap, or a thin body lies in front of another.
    """
    nothing = np.zeros(0, dtype=np.int64)
    parts = [_look(skin, i, j) for i, j in [(nothing, nothing), *_find_near(skin, within)]]
    # polygons get as many corners as the largest has
    width = max(part.shapes.shape[1] for part in parts)
    padded = []
    for part in parts:
        missing = (0, width - part.shapes.shape[1])
        padded.append(replace(part, shapes=np.pad(part.shapes, ((0, 0), missing, (0, 0)), "edge")))
    sights = Sights.join(padded)
    order = np.lexsort((sights.seen, sights.looking))
    sights = sights.pick(order)

    tolerance = skin.tolerances(sights.looking, sights.seen)
    other = skin.body[sights.looking] != skin.body[sights.seen]
    cosine = np.sum(skin.normals[sights.looking] * skin.normals[sights.seen], axis=1)
    facing = other & (cosine < -FACING)
    smaller = np.minimum(skin.measures[sights.looking], skin.measures[sights.seen])
    large = sights.overlaps > LEAST_OVERLAP * smaller
    behind = sights.pick(facing & large & (sights.gaps < -tolerance))

    # what is in front, and of it what no nearer facet hides
    front = large & (sights.gaps >= -tolerance) & (sights.gaps <= within + tolerance)
    sights = sights.pick(front)
    tolerance = tolerance[front]
    least = LEAST_OVERLAP * smaller[front]
    overlaps = _see(sights, tolerance, least)

    # of what faces each other, where enough of both sides is seen
    rows = np.flatnonzero(facing[front])
    rows = rows[_are_mutual(sights.pick(rows), len(skin.body))]
    face = group_pairs(skin, sights.pick(rows))
    total = np.bincount(face, weights=sights.overlaps[rows])
    seen = np.bincount(face, weights=overlaps[rows])
    rows = rows[(overlaps[rows] > least[rows]) & (seen > LEAST_SEEN * total)[face]]
    # polygons at curved joints have gaps that the joint does not have
    gaps = np.where(sights.gaps <= tolerance, 0.0, sights.gaps)
    pairs = replace(sights, gaps=gaps, overlaps=overlaps).pick(rows)
    return pairs.pick(_are_mutual(pairs, len(skin.body))), behind


def _find_near(skin: Skin, within: float) -> Iterator[tuple[Indices, Indices]]:
    """Yield facets and what may be in front of them, both ways.

    Without a gap facets of one body hide nothing of other bodies, and are left out.

    Args:
        skin: the boundary of all bodies.
        within: largest gap [m].
    """
    from scipy.spatial import cKDTree  # late: it takes a while

    if not len(skin.reach):
        return
    # of what may hide others normals need not be opposite
    cosine = -EDGE_ON if within > 0.0 else -FACING
    level = np.floor(np.log2(skin.reach / skin.reach.min())).astype(int)
    levels = np.unique(level)
    for a in levels:
        small = np.flatnonzero(level == a)
        tree = cKDTree(skin.middles[small])
        for b in levels[levels >= a]:
            large = np.flatnonzero(level == b)
            radius = (skin.reach[large] + skin.reach[small].max()) * (1.0 + 1e-3) + within
            radius += skin.left_out[large] + skin.left_out[small].max()
            found = tree.query_ball_point(skin.middles[large], radius)
            counts = [len(some) for some in found]
            first = np.repeat(large, counts)
            second = small[np.concatenate([np.asarray(some, dtype=np.int64) for some in found])]
            apart = np.sum(skin.normals[first] * skin.normals[second], axis=1) < cosine
            if within == 0.0:
                apart &= skin.body[first] != skin.body[second]
            first = first[apart]
            second = second[apart]
            yield first, second
            if a != b:
                yield second, first


def _look(skin: Skin, i: Indices, j: Indices) -> Sights:
    """Return what facets i see of facets j, whatever the gap; overlaps may be zero.

    Args:
        skin: the boundary of all bodies.
        i: (k,) facets that look.
        j: (k,) facets.
    """
    theirs = skin.project(i, skin.corners[j])
    ours = skin.project(i, skin.corners[i])
    if skin.corners.shape[2] == 2:
        low = np.maximum(ours.min(axis=1), theirs.min(axis=1))
        high = np.minimum(ours.max(axis=1), theirs.max(axis=1))
        shapes = np.stack([low, high], axis=1)
        overlaps = np.maximum(high - low, 0.0)[:, 0]
        middle = 0.5 * (low + high)
    else:
        # seen from the other side their corners are clockwise
        shapes = intersect(ours, theirs[:, ::-1])
        overlaps = areas(shapes)
        middle = _find_centroids(shapes)
    points = skin.middles[i] + np.einsum("kt,ktd->kd", middle, skin.tangents[i])
    # the point x + gap n_i is in the plane of j
    cosine = np.sum(skin.normals[i] * skin.normals[j], axis=1)
    gaps = np.sum((skin.middles[j] - points) * skin.normals[j], axis=1) / cosine
    return Sights(i, j, gaps, overlaps, points, shapes)


def _find_centroids(polygons: Array) -> Array:
    """Return the centroids (k, 2) of polygons (k, c, 2), the mean of the corners of empty ones."""
    owner, parts = triangles(polygons)
    sizes = areas(parts)
    total = np.bincount(owner, weights=sizes, minlength=len(polygons))
    centroids = polygons.mean(axis=1)
    some = total > 0.0
    for axis in range(2):
        moment = np.bincount(
            owner, weights=sizes * parts[:, :, axis].mean(axis=1), minlength=len(polygons)
        )
        centroids[some, axis] = moment[some] / total[some]
    return centroids


def _see(sights: Sights, tolerance: Array, least: Array) -> Array:
    """Return the part (k,) of each overlap that no nearer facet hides [m], [m²].

    Args:
        sights: in the order of the looking facets.
        tolerance: (k,) distances that count as none [m].
        least: (k,) sizes that count as none.
    """
    seen = sights.overlaps.copy()
    behind, before = pairs_of(sights.looking)
    nearer = sights.gaps[before] < sights.gaps[behind] - tolerance[behind]
    behind = behind[nearer]
    before = before[nearer]
    # of each sight that something is in front of, take away one after the other
    starts = np.flatnonzero(np.diff(behind, prepend=-1))
    ends = np.append(starts, len(behind))[1:]
    for start, end in zip(starts, ends, strict=True):
        row = behind[start]
        hiding = sights.shapes[before[start:end]]
        if sights.shapes.shape[2] == 1:
            seen[row] = _cut_interval(sights.shapes[row, :, 0], hiding[:, :, 0])
        else:
            seen[row] = _cut_polygon(sights.shapes[row], hiding, least[row])
    return seen


def _cut_interval(interval: Array, others: Array) -> float:
    """Return the length of an interval (2,) without others (k, 2) [m]."""
    low, high = interval
    covered = 0.0
    end = low
    for first, last in others[np.argsort(others[:, 0], kind="stable")]:
        start = max(float(first), end)
        stop = min(float(last), high)
        if stop > start:
            covered += stop - start
            end = stop
    return float(high - low - covered)


def _cut_polygon(polygon: Array, others: Array, least: float) -> float:
    """Return the area of a polygon (c, 2) without others (k, c, 2) [m²].

    Args:
        polygon: convex, anticlockwise.
        others: the same.
        least: area that counts as none.
    """
    parts = polygon[None]
    for other in others:
        if not len(parts):
            return 0.0
        many = np.broadcast_to(other, (len(parts), *other.shape))
        _, parts = subtract(parts, many, np.full(len(parts), 1e-3 * least))
    return float(areas(parts).sum())


def _are_mutual(sights: Sights, count: int) -> Mask:
    """Say of which sights the seen facet sees the looking one too.

    Args:
        sights: of pairs of facets.
        count: number of facets.
    """
    way = sights.looking * count + sights.seen
    back = sights.seen * count + sights.looking
    return np.isin(way, back)


def group_pairs(skin: Skin, pairs: Sights) -> Indices:
    """Return the number (k,) of the joint of each pair of facets.

    What is joined are entries, pairs of a facet and the body that it faces: those of two facets
    that see each other, and those of neighbours on a smooth face that face the same body.

    Args:
        skin: the boundary of all bodies.
        pairs: of facets, each both ways.
    """
    key = pairs.looking * skin.bodies + skin.body[pairs.seen]
    back = pairs.seen * skin.bodies + skin.body[pairs.looking]
    entries, entry = np.unique(key, return_inverse=True)
    # neighbours on smooth faces: each entry of the first, and that of the second with its body
    first, second = skin.links
    start = np.searchsorted(entries, first * skin.bodies)
    count = np.searchsorted(entries, (first + 1) * skin.bodies) - start
    link = np.repeat(np.arange(len(first)), count)
    among = np.arange(len(link)) - np.repeat(np.cumsum(count) - count, count)
    ours = start[link] + among
    wanted = second[link] * skin.bodies + entries[ours] % max(skin.bodies, 1)
    theirs = np.minimum(np.searchsorted(entries, wanted), max(len(entries) - 1, 0))
    there = entries[theirs] == wanted if len(entries) else np.zeros(0, dtype=bool)
    number_of = number_parts(
        len(entries),
        np.concatenate([entry, ours[there]]),
        np.concatenate([np.searchsorted(entries, back), theirs[there]]),
    )
    return number_of[entry]
