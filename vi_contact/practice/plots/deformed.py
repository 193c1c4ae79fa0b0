"""Read bodies and what happens on their contact to draw them.

They come from the folder of a run, in the plane and in space.

A run that writes fields (``fields=fem.XDMF(every=...)``) and records ``Contact()`` leaves all that
is needed there.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from ...core.algebra import Array, Indices
from ...core.arguments import check_arguments
from ...core.checks import array
from ...core.errors import InputError, is_of_machine
from ...core.files import FIELDS, list_frames, open_hdf5
from ...core.own_files import inner_folder
from ...meshes.rows import SIDES, connected
from ...run.files.reading import RunFolder, read_run
from ...run.recorders.contact_parts import Geometry, make_tangent_vectors

OPEN, STICK, SLIP = 1, 2, 3  # as contact_status in fields.xdmf
SAME = 1e-6  # of the size of what is drawn: what lies at one place or in one plane
FACING = 0.5  # least cosine between the contact direction of a node and the normals of its facets
# dimension, corners
CELLS = {(2, 3): "triangle", (2, 4): "quadrilateral", (3, 4): "tetrahedron", (3, 8): "hexahedron"}


@dataclass(frozen=True)
class StoredFrames:
    """Hold fields of a run.

    There are ``points`` (n, d) [m], ``cells`` (c, corners), times ``t`` (f,) [s], (file, group)
    each.
    """

    points: Array
    cells: Indices
    t: Array
    places: tuple[tuple[Path, str], ...]

    def at(self, t: float) -> tuple[float, Array, Array]:
        """Return (its time [s], u (n, d) [m], von Mises stress (c,) [Pa]) at t.

        They are those of the frame nearest to t; stresses are NaN where the run has none.
        """
        (row,) = nearest(self.t, [t])
        path, group = self.places[row]
        with _opened(path) as file:
            frame, unknown = file[group], np.full(len(self.cells), np.nan)
            stress = frame["von_mises"][:] if "von_mises" in frame else unknown
            u = frame["u"][:]
            if u.shape != (len(self.points), 3) or stress.shape != unknown.shape:
                raise ValueError("the numbers of nodes or cells are not those of the mesh")
            return float(self.t[row]), u[:, : self.points.shape[1]], stress

    @cached_property
    def bodies(self) -> Indices:
        """Return the number (c,) of the body of each cell.

        Cells that share nodes are of one body.
        """
        count, corners = self.cells.shape
        # from cells to their nodes
        links = (np.repeat(np.arange(count), corners), count + self.cells.ravel())
        return connected(count + len(self.points), *links)[:count]

    @cached_property
    def boundary(self) -> tuple[Indices, Indices]:
        """Return the sides of cells (s, corners) that are no other cell's.

        The cell (s,) of each comes with them.
        """
        sides = self.cells[:, np.array(SIDES[CELLS[self.points.shape[1], self.cells.shape[1]]])]
        rows = np.sort(sides.reshape(-1, sides.shape[2]), axis=1)
        _, first, counts = np.unique(rows, axis=0, return_index=True, return_counts=True)
        alone = np.sort(first[counts == 1])
        return sides.reshape(rows.shape)[alone], alone // sides.shape[1]

    def facing(self, contact: Geometry) -> tuple[Indices, Indices]:
        """Return the boundary's sides whose corners are contact points.

        They are conditions (s, corners). With them comes the node (m,) of each condition, on the
        body that its direction points away from, not on one that it touches there.
        """
        sides, cell = self.boundary
        nodes, place = np.unique(sides, return_inverse=True)
        reach = SAME * float(np.ptp(self.points, axis=0).max())
        tree = cKDTree(contact.points)
        _, near = tree.query(self.points[nodes], k=[1, 2, 3, 4], distance_upper_bound=reach)
        # those of all faces at this place; m: none
        candidates = near[place.ravel()].reshape(*sides.shape, 4)
        corners = self.points[sides]
        away = corners.mean(axis=1) - self.points[self.cells[cell]].mean(axis=1)
        outwards = plane_normals(corners)
        outwards *= np.sign(np.sum(outwards * away, axis=1))[:, None]
        normals = np.vstack([contact.normals, np.zeros_like(contact.normals[:1])])
        cosines = np.einsum("scki,si->sck", normals[candidates], outwards)
        chosen = np.take_along_axis(candidates, cosines.argmax(axis=2)[:, :, None], axis=2)[:, :, 0]
        found = np.all(cosines.max(axis=2) > FACING, axis=1)
        node = cKDTree(self.points).query(contact.points)[1]
        node[chosen[found]] = sides[found]
        return chosen[found], node


def plane_normals(polygons: Array) -> Array:
    """Return a unit normal (p, d) of each line (p, 2, 2) or polygon (p, corners, 3).

    That of one without any size is zero.
    """
    if polygons.shape[2] == 2:
        normals = (polygons[:, 1] - polygons[:, 0]) @ np.array([[0.0, -1.0], [1.0, 0.0]])
    else:  # of quadrilaterals by their diagonals
        normals = np.cross(polygons[:, 2] - polygons[:, 0], polygons[:, -1] - polygons[:, 1])
    sizes = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray(normals / np.where(sizes > 0.0, sizes, 1.0))


def nearest(t: Array, times: Sequence[float] | Array) -> Indices:
    """Return the rows of ``t`` next to each of ``times`` [s].

    InputError for no times, or what is none.
    """
    wanted = array("pictures of a run", "times", times, (None,), unit="seconds")
    if not len(wanted):
        raise InputError(
            "pictures of a run: times is empty; give moments in seconds, or leave it out"
        )
    return np.abs(t - wanted[:, None]).argmin(axis=1)


def contact_states(history: Mapping[str, Array]) -> Array:
    """Return 1 open, 2 stick, 3 slip, (rows, m).

    Closed points slip when their slip changed since the row before.

    Changes below 1e-9 of the largest one are rounding. In the first row, and without friction,
    closed points stick.
    """
    rows = len(history["t"])
    active = np.reshape(history["active"], (rows, -1)).astype(bool)
    change = np.zeros(active.shape)
    if "slip" in history:
        change[1:] = np.linalg.norm(
            np.diff(np.reshape(history["slip"], (*active.shape, -1)), axis=0), axis=2
        )
    moved = change > 1e-9 * np.max(change, initial=0.0)
    return np.where(active, np.where(moved, SLIP, STICK), OPEN)


def stored_tangents(contact: Geometry) -> Array:
    """Return the tangents (m, d, d - 1) of slip and traction_t in a history.

    What is at one place is one node.
    """
    return make_tangent_vectors(
        contact.normals, np.unique(contact.points, axis=0, return_inverse=True)[1].ravel()
    )


@check_arguments
def read_frames(run: RunFolder | str | Path) -> StoredFrames:
    """Read the frames from the fields of a run in plane or space.

    InputError for a folder without them.
    """
    folder = run.folder if isinstance(run, RunFolder) else Path(run)
    places = list_frames(folder)
    if places:
        history = run.history if isinstance(run, RunFolder) else read_run(folder).history
        times = dict(zip(history["k"].astype(int).tolist(), history["t"].tolist(), strict=True))
        # not those whose rows a killed run has lost
        places = {k: places[k] for k in sorted(places) if k in times}
    if not places:
        raise InputError(
            f"no frames in {folder / FIELDS}: run it with out and fields=fem.XDMF(every=...)"
        )
    with _opened(inner_folder(folder, FIELDS) / "mesh.h5") as file:
        points, cells = file["points"][:], file["cells"][:]
        if (
            points.ndim != 2
            or points.shape[1] != 3
            or cells.ndim != 2
            or cells.dtype.kind not in "iu"
        ):
            raise ValueError("points and cells are no arrays of a mesh")
        if (
            not np.all(np.isfinite(points))
            or not cells.size
            or cells.min() < 0
            or cells.max() >= len(points)
        ):
            raise ValueError("a cell has a point that is not there")
    # of second order: the vertices
    cells = cells[:, : {6: 3, 9: 4, 10: 4, 27: 8}.get(cells.shape[1])]
    d = 3 if np.any(points[:, 2]) else 2  # a mesh of the plane is stored with z = 0
    return StoredFrames(
        points[:, :d], cells, np.array([times[k] for k in places]), tuple(places.values())
    )


@contextmanager
def _opened(path: Path) -> Iterator[Any]:
    """Open a file of fields; InputError when it is missing or damaged."""
    try:
        with open_hdf5(path) as file:
            yield file
    except InputError:
        raise
    except (
        OSError,
        KeyError,
        ValueError,
        IndexError,
        TypeError,
        AttributeError,
        RuntimeError,
    ) as error:
        if is_of_machine(error):
            raise
        reason = " ".join(str(error).split())[:200]
        raise InputError(
            f"'{path}' is missing or damaged ({reason}): restore it, or draw without fields"
        ) from error
