"""Chain the lines round a body in the plane, to fill it and to find where its name fits."""

from collections import defaultdict
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.algebra import Array

SAME = 1e-9  # ends that differ by less are one point, over the size of the body
FAR = 0.75  # over the largest distance from the border
GRID = 40  # points along each axis that are tried for the name


@dataclass(frozen=True)
class Border:
    """Hold the border of a body in the plane.

    Attributes:
        chains: (k, 2) points [m] one after another; a closed chain ends where it begins.
    """

    chains: tuple[Array, ...]

    @property
    def path(self) -> Any:
        """Return a matplotlib Path that is filled between the chains, not in holes."""
        from matplotlib.path import Path

        # What is filled is decided by directions: a chain within an even number of others goes
        # anticlockwise, the border of a hole clockwise.
        turned = []
        for number, chain in enumerate(self.chains):
            others = [one for place, one in enumerate(self.chains) if place != number]
            middle = chain[:2].mean(axis=0)
            depth = sum(Path(one).contains_point(middle) for one in others)
            wanted = 1.0 if depth % 2 == 0 else -1.0
            turned.append(chain if wanted * _find_area(chain) >= 0.0 else chain[::-1])
        return Path.make_compound_path(*(Path(chain, closed=True) for chain in turned))

    def find_middle(self) -> tuple[Array, float]:
        """Return a point (2,) inside that is far from the border, and its distance [m].

        Of those that are about as far as can be, it is the one nearest to the middle.
        """
        from matplotlib.path import Path

        corners = np.concatenate(self.chains)
        low = corners.min(axis=0)
        high = corners.max(axis=0)
        share = (np.arange(GRID) + 0.5) / GRID
        x, y = np.meshgrid(*(low + share[:, None] * (high - low)).T)
        tried = np.column_stack([x.ravel(), y.ravel()])

        # Inside is what an odd number of chains surrounds.
        around = sum(Path(chain).contains_points(tried).astype(int) for chain in self.chains)
        inside = tried[np.asarray(around) % 2 == 1]
        if not len(inside):
            return corners.mean(axis=0), 0.0
        first = np.concatenate([chain[:-1] for chain in self.chains])
        last = np.concatenate([chain[1:] for chain in self.chains])
        clear = _find_distances(inside, first, last)
        far = np.flatnonzero(clear >= FAR * clear.max())
        off = np.linalg.norm(inside[far] - inside.mean(axis=0), axis=1)
        best = int(far[off.argmin()])
        return inside[best], float(clear[best])


def chain_border(lines: Array) -> Border:
    """Chain lines (n, 4), each x0, y0, x1, y1 [m], in the order of the first line of each chain."""
    ends = lines.reshape(-1, 2)
    size = float(np.ptp(ends, axis=0).max()) or 1.0
    _, first, place = np.unique(
        np.round(ends / (SAME * size)), axis=0, return_index=True, return_inverse=True
    )
    points = ends[first]
    nodes = place.reshape(-1, 2)
    lines_of = defaultdict(list)
    for number, (start, end) in enumerate(nodes.tolist()):
        lines_of[start].append(number)
        lines_of[end].append(number)

    # Open chains first, from an end that belongs to one line; what is left is closed.
    ends_alone = [int(one) for one in nodes.ravel() if len(lines_of[int(one)]) == 1]
    left = set(range(len(nodes)))
    chains = []
    for start in [*ends_alone, *nodes[:, 0].tolist()]:
        chain = _follow(start, nodes, lines_of, left)
        if len(chain) > 1:
            chains.append(points[chain])
    return Border(tuple(chains))


def _follow(first: int, nodes: Array, lines_of: dict[int, list[int]], left: set[int]) -> list[int]:
    """Return the points of a chain from ``first``; its lines are taken from those left."""
    chain = [first]
    while True:
        free = [number for number in lines_of[chain[-1]] if number in left]
        if not free:
            return chain
        left.discard(free[0])
        start, end = nodes[free[0]].tolist()
        chain.append(end if start == chain[-1] else start)


def _find_area(chain: Array) -> float:
    """Return the area within a closed chain, positive where it goes anticlockwise."""
    x, y = (chain - chain[0]).T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def _find_distances(points: Array, first: Array, last: Array) -> Array:
    """Return the distance (k,) of points (k, 2) from the nearest of lines between ends (n, 2)."""
    along = last - first
    length = np.maximum(np.sum(along**2, axis=1), np.finfo(float).tiny)
    arms = points[:, None] - first
    share = np.clip(np.sum(arms * along, axis=2) / length, 0.0, 1.0)
    apart = arms - share[:, :, None] * along
    return np.asarray(np.sqrt(np.sum(apart**2, axis=2)).min(axis=1))
