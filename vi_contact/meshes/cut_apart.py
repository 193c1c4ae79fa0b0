"""Cut a mesh open wherever its bodies share points, so that each has nodes of its own.

The bodies are groups of cells. ``CutOpen`` cuts along one joint and names its sides; here all
joints are cut at once, and none needs a name, as joints are found from the geometry afterwards
(``fem.find_joints``).
"""

import logging
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

from vi_contact.core.checks import describe_point, quote, several
from vi_contact.core.errors import InputError
from vi_contact.meshes.cut import Beside, double_nodes, find_twins
from vi_contact.meshes.extract import MeshArrays, Source, add_arrays, arrays_of
from vi_contact.meshes.rows import Rows, cell_sides, number_alike, vertex_count

log = logging.getLogger(__name__)
NAMED = 6  # pairs of bodies that the log names


@dataclass(frozen=True)
class CutApart:
    """Describe the mesh of a script or of a file, cut open wherever its bodies share points.

    Attributes:
        source: the mesh.
        bodies: groups of cells that are bodies; None for all groups. Cells of no group are a body
            too.
        keep: pairs of these groups that stay together where they share facets.
    """

    source: Source
    bodies: tuple[str, ...] | None = None
    keep: tuple[tuple[str, str], ...] = ()

    def build(self, gmsh: Any) -> None:
        """Add the mesh to Gmsh's current model."""
        add_arrays(gmsh, cut_apart(arrays_of(self.source), self.bodies, keep=self.keep))


def cut_apart(
    arrays: MeshArrays,
    bodies: Sequence[str] | None = None,
    *,
    keep: Sequence[tuple[str, str]] = (),
) -> MeshArrays:
    """Give each body nodes of its own where it shares points with others.

    A point of several bodies gets a copy for each group of cells of one body that hang together
    round it by their facets. The log says between which bodies, at how many points, and where.

    Args:
        arrays: the mesh.
        bodies: groups of cells that are bodies; None for all groups. Cells of no group are a body
            too.
        keep: pairs of these groups that stay together where they share facets.

    Returns:
        The mesh. A facet between bodies is twice in each group that had it.

    Raises:
        InputError: groups that do not exist or have common cells, bodies that share no point.
    """
    if arrays.cells.shape[1] > vertex_count(arrays.cell):
        raise InputError(
            "CutApart: a mesh of second order cannot be cut: mesh it with Mesh.ElementOrder = 1"
        )
    names = list(arrays.cell_groups) if bodies is None else list(bodies)
    body = _number_bodies(arrays, names)
    kept = _read_pairs(names, keep)

    # Points of several bodies: the least and the largest number of a body there differ.
    node = arrays.cells.ravel()
    body_of_entry = np.repeat(body, arrays.cells.shape[1])
    least = np.full(len(arrays.points), len(names) + 1)
    most = np.full(len(arrays.points), -1)
    np.minimum.at(least, node, body_of_entry)
    np.maximum.at(most, node, body_of_entry)
    shared = np.flatnonzero(least < most)
    if not len(shared):
        raise InputError(
            "CutApart: the bodies share no point, so that nothing is there to cut: leave it out, "
            "or name groups of cells that touch"
        )

    # Cells hang together across facets within a body, and across those that are to be kept.
    sides, owner = cell_sides(arrays.cells, arrays.cell)
    side, *numbers = number_alike(sides, *arrays.facet_groups.values())
    first, second = find_twins(side)
    pair = np.sort(np.column_stack([body[owner[first]], body[owner[second]]]), axis=1)
    whole = pair[:, 0] == pair[:, 1]
    for one, other in kept:
        whole |= (pair[:, 0] == one) & (pair[:, 1] == other)
    cells, points = double_nodes(arrays, shared, sides, owner, first[whole], second[whole])

    beside = Beside(arrays.cells, cells, owner, side)
    groups = {}
    for (name, rows), number in zip(arrays.facet_groups.items(), numbers, strict=True):
        groups[name] = beside.renew_group(rows, number)
    _tell(arrays, body, names, kept, shared)
    return replace(arrays, points=points, cells=cells, facet_groups=groups)


def _number_bodies(arrays: MeshArrays, names: Sequence[str]) -> Rows:
    """Return the number of the body of each cell: its place among the names, or their count.

    Raises:
        InputError: groups that do not exist, and cells in two of them.
    """
    body = np.full(len(arrays.cells), len(names), dtype=np.int64)
    for number, name in enumerate(names):
        if name not in arrays.cell_groups:
            raise InputError(
                f"CutApart: mesh has no cell group '{name}'; it has "
                f"{', '.join(arrays.cell_groups)}: give some of these as bodies"
            )
        taken = body[arrays.cell_groups[name]]
        if len(taken) and taken.min() < len(names):
            other = names[int(taken.min())]
            raise InputError(
                f"CutApart: cell groups '{other}' and '{name}' have common cells, so that they are "
                "not two bodies: name the groups that are bodies, bodies=(…)"
            )
        body[arrays.cell_groups[name]] = number
    return body


def _read_pairs(names: Sequence[str], keep: Sequence[tuple[str, str]]) -> list[tuple[int, int]]:
    """Return pairs of names as ascending pairs of their places; InputError for other names."""
    pairs = []
    for given in several("CutApart", "keep", keep, 'give pairs such as (("dam", "rock"),)'):
        words = () if isinstance(given, str) else tuple(given)
        if len(words) != 2 or words[0] == words[1] or not set(words) <= set(names):
            raise InputError(
                f"CutApart: keep has {quote(given)}; give pairs of two of the bodies "
                f"{', '.join(names)}"
            )
        low, high = sorted(names.index(word) for word in words)
        pairs.append((low, high))
    return pairs


def _tell(
    arrays: MeshArrays,
    body: Rows,
    names: Sequence[str],
    kept: Sequence[tuple[int, int]],
    shared: Rows,
) -> None:
    """Log between which bodies the mesh was cut, at how many points, and where.

    Args:
        arrays: the mesh as it was.
        body: the number of the body of each cell.
        names: of the bodies.
        kept: pairs of bodies that stay together.
        shared: points of several bodies.
    """
    # each point with each of its bodies once
    around, column = np.nonzero(np.isin(arrays.cells, shared))
    rows = np.unique(np.column_stack([arrays.cells[around, column], body[around]]), axis=0)
    words = [f"'{name}'" for name in names] + ["the rest"]
    points_of_pair: dict[tuple[int, int], list[int]] = {}
    for point in shared:
        start, end = np.searchsorted(rows[:, 0], [point, point + 1])
        for pair in combinations(rows[start:end, 1].tolist(), 2):
            if pair not in kept:
                points_of_pair.setdefault(pair, []).append(int(point))
    parts = []
    for (one, other), points in sorted(points_of_pair.items())[:NAMED]:
        where = describe_point(arrays.points[points[0]])
        count = "1 point" if len(points) == 1 else f"{len(points)} points"
        parts.append(f"{words[one]} and {words[other]} at {count}, the first at {where}")
    more = len(points_of_pair) - NAMED
    ending = f"; and between {more} more pairs" if more > 0 else ""
    log.info("bodies that shared points are cut open: %s%s", "; ".join(parts), ending)
