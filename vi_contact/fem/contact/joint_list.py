"""Hold the joints that were found between bodies, and write them as a table."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import overload

import numpy as np

from ...core.algebra import Array, Indices
from ...core.checks import describe_point
from ..mesh.tagged_mesh import Facets

MOST_ROWS = 24  # of a list that is shown without being asked for
NAMED = 4  # places that are named
HEADINGS = ("no", "bodies", "facets", "size", "gap", "normal", "middle")


@dataclass(frozen=True, eq=False)
class Joint:
    """Hold a joint: facets of two bodies that face each other, and hang together on both.

    Everything but the facets is the same on every rank.

    Attributes:
        number: its number in the list, from 0.
        bodies: (2,) numbers of its bodies; side 1 is the first's.
        names: (2,) of its bodies.
        facets1: facets of side 1, of which the larger share is covered.
        facets2: facets of side 2.
        counts: (2,) how many facets there are on either side, on all ranks.
        size: length in the plane [m], area in space [m²], of the common part.
        covered: (2,) share of the facets of either side that is common.
        gap: mean gap [m].
        largest_gap: at the middle of a pair of facets [m].
        normal: (d,) mean unit normal of side 1, towards side 2.
        middle: (d,) of the common part, on side 1 [m].
        ends: (2, d) of the common part in the plane, on side 1 [m]; None in space.
        alike: whether the facets of both sides are the same but for the gap.
        rows: (2,) the facets of either side, as numbers in the outlines of all bodies.
        measures: (2,) lengths [m] or areas [m²] of these facets.
    """

    number: int
    bodies: tuple[int, int]
    names: tuple[str, str]
    facets1: Facets = field(repr=False)
    facets2: Facets = field(repr=False)
    counts: tuple[int, int]
    size: float
    covered: tuple[float, float]
    gap: float
    largest_gap: float
    normal: Array
    middle: Array
    ends: Array | None
    alike: bool
    rows: tuple[Indices, Indices] = field(repr=False)
    measures: tuple[Array, Array] = field(repr=False)

    def row(self) -> tuple[str, ...]:
        """Return the row of the table: the words under ``HEADINGS``."""
        return (
            f"{self.number + 1}",
            ", ".join(self.names),
            f"{self.counts[0]}, {self.counts[1]}",
            f"{self.size:.6g}",
            f"{self.gap:.3g}",
            describe_point(_drop_small(self.normal, 1.0)),
            describe_point(_drop_small(self.middle, float(np.abs(self.middle).max()))),
        )


@dataclass(frozen=True, eq=False)
class Joints(Sequence[Joint]):
    """Hold the joints of a mesh, in the order of their bodies, the same list on every rank.

    ``joints[3]``, ``len(joints)`` and loops give single joints; ``joints.table()`` writes all,
    ``plots.plot_joints`` draws them.

    Attributes:
        joints: all of them.
        within: largest gap that was asked for [m].
        names: (n,) of the bodies.
        lonely: numbers of bodies without a joint.
        corners: (k, d) points at which two bodies touch only by corners or edges [m]. They have no
            normal, so that no condition is made there.
        corner_bodies: (k, 2) the bodies of these.
        tied: how many pairs of facets were left out as they are tied.
        outlines: (f, v, d) the outer facets of all bodies [m].
        outline_normals: (f, d) outward unit normals.
        outline_bodies: (f,) their bodies.
    """

    joints: tuple[Joint, ...]
    within: float
    names: tuple[str, ...]
    lonely: tuple[int, ...]
    corners: Array
    corner_bodies: Indices
    tied: int
    outlines: Array
    outline_normals: Array
    outline_bodies: Indices

    @overload
    def __getitem__(self, place: int) -> Joint: ...

    @overload
    def __getitem__(self, place: slice) -> tuple[Joint, ...]: ...

    def __getitem__(self, place: int | slice) -> Joint | tuple[Joint, ...]:
        return self.joints[place]

    def __len__(self) -> int:
        return len(self.joints)

    def __iter__(self) -> Iterator[Joint]:
        return iter(self.joints)

    @property
    def dimension(self) -> int:
        """Return d."""
        return int(self.outlines.shape[2])

    def between(self, first: int, second: int) -> tuple[Joint, ...]:
        """Return the joints of two bodies, by their numbers."""
        return tuple(joint for joint in self if set(joint.bodies) == {first, second})

    def table(self, most: int | None = None) -> str:
        """Return all joints as text, or at most so many.

        Sizes are lengths in m or areas in m², gaps and middles are in m.
        """
        what = "length [m]" if self.dimension == 2 else "area [m²]"
        headings = [*HEADINGS[:3], what, "gap [m]", *HEADINGS[5:6], "middle [m]"]
        rows = [tuple(headings), *(joint.row() for joint in self.joints[:most])]
        widths = [max(len(row[column]) for row in rows) for column in range(len(headings))]
        lines = [self._head()]
        for row in rows:
            cells = [word.ljust(width) for word, width in zip(row, widths, strict=True)]
            lines.append("  ".join(cells).rstrip())
        if most is not None and len(self) > most:
            lines.append(f"… and {len(self) - most} more: print(joints.table())")
        return "\n".join([*lines, *self._remarks()])

    def __repr__(self) -> str:
        return self.table(MOST_ROWS)

    def _head(self) -> str:
        """Return how many joints there are."""
        count = "1 joint" if len(self) == 1 else f"{len(self)} joints"
        bodies = "1 body" if len(self.names) == 1 else f"{len(self.names)} bodies"
        return f"{count} of {bodies}, gaps within {self.within:g} m"

    def _remarks(self) -> Iterator[str]:
        """Yield what else there is to say: bodies without joints, corners, ties."""
        if self.lonely:
            names = ", ".join(self.names[number] for number in self.lonely[:NAMED])
            ending = ", …" if len(self.lonely) > NAMED else ""
            yield f"without a joint: {names}{ending}"
        if len(self.corners):
            places = []
            for point, (first, second) in zip(self.corners, self.corner_bodies, strict=True):
                where = describe_point(point)
                places.append(f"{self.names[first]} and {self.names[second]} at {where}")
            ending = f"; … ({len(places)} in all)" if len(places) > NAMED else ""
            yield (
                f"touch only by corners or edges, without a condition: "
                f"{'; '.join(places[:NAMED])}{ending}"
            )
        if self.tied:
            yield f"tied, and no joint: {self.tied} pairs of facets"


def _drop_small(values: Array, size: float) -> Array:
    """Return values (d,) without what is rounding beside the size."""
    return np.where(np.abs(values) > 1e-9 * size, values, 0.0)
