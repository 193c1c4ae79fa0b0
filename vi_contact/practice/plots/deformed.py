"""Read bodies, and what happens on their contact, from the folder of a run to draw them.

A run in the plane or in space that writes fields (``fields=fem.XDMF(every=...)``) and records
``Contact()`` leaves all that is needed there.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

from ...core.algebra import Array, Indices, Mask
from ...core.arguments import check_arguments
from ...core.checks import array
from ...core.errors import InputError
from ...core.files import FIELDS, list_frames
from ...core.hdf5 import refuse_damage
from ...core.vtkhdf import FIELDS_VTKHDF, StoredSeries, list_steps
from ...meshes.rows import SIDES, number_parts
from ...run.files.reading import RunFolder, read_run
from ...run.recorders.contact_parts import Geometry, make_tangent_vectors

# States of contact points, as contact_status in fields.xdmf.
OPEN = 1
STICK = 2
SLIP = 3
# What lies at one place or in one plane may differ by this, over the size of what is drawn.
SAME = 1e-6
# Numbers from here on have no finite square: no run ends with them.
LARGEST = float(np.sqrt(np.finfo(float).max))
DAMAGED = "restore it, or draw without fields"
FACING = 0.5  # least cosine between the contact direction of a node and the normals of its facets
# (dimension, corners) -> kind of cell.
CELLS = {(2, 3): "triangle", (2, 4): "quadrilateral", (3, 4): "tetrahedron", (3, 8): "hexahedron"}
# Nodes of a cell of second order -> its vertices, which are its first nodes.
VERTICES = {6: 3, 9: 4, 10: 4, 27: 8}


@dataclass(frozen=True)
class StoredFrames:
    """Hold the fields of a run at its stored times.

    Attributes:
        points: (n, d) vertices [m].
        cells: (c, corners) their vertices.
        t: (f,) times [s].
        places: (file, group in it) of each time; of VTKHDF (file, number of the frame in it).
    """

    points: Array
    cells: Indices
    t: Array
    places: tuple[tuple[Path, str | int], ...]

    def at(self, t: float) -> tuple[float, Array, Array]:
        """Return (its time [s], u (n, d) [m], von Mises stress (c,) [Pa]) at t.

        They are those of the frame nearest to t; stresses are NaN where the run has none.
        """
        (row,) = find_nearest(self.t, [t])
        path, place = self.places[row]
        unknown = np.full(len(self.cells), np.nan)
        with refuse_damage(path, DAMAGED) as file:
            if isinstance(place, int):
                series = StoredSeries(file)
                u = series.read("u", place)
                stress = unknown
                if "von_mises" in series.names:
                    stress = series.read("von_mises", place)
            else:
                frame = file[place]
                u = frame["u"][:]
                stress = frame["von_mises"][:] if "von_mises" in frame else unknown
            if u.shape != (len(self.points), 3) or stress.shape != unknown.shape:
                raise ValueError("the numbers of nodes or cells are not those of the mesh")
            if not _is_sound(u) or not _is_sound(stress[~np.isnan(stress)]):
                raise ValueError("displacements or stresses are infinite, or no numbers")
            return float(self.t[row]), u[:, : self.points.shape[1]], stress

    @cached_property
    def bodies(self) -> Indices:
        """Return the number (c,) of the body of each cell.

        Cells that share nodes are of one body.
        """
        # Cells and nodes are one graph, in which nodes follow the cells.
        count, corners = self.cells.shape
        cells = np.repeat(np.arange(count), corners)
        nodes = count + self.cells.ravel()
        return number_parts(count + len(self.points), cells, nodes)[:count]

    def find_structure(self, up: int) -> Mask:
        """Return which cells (c,) are of bodies that own no side of the box round the model.

        The upper side counts for nothing: structures reach up to it. All other bodies are ground.
        Nothing is of the structure where every body is ground, everything where none is.

        up: number of the axis that points upwards.
        """
        sides, cell = self.boundary
        low = self.points[self.cells].min(axis=(0, 1))
        high = self.points[self.cells].max(axis=(0, 1))
        reach = SAME * float((high - low).max())
        corners = self.points[sides]
        on_low = np.all(np.abs(corners - low) <= reach, axis=1)
        on_high = np.all(np.abs(corners - high) <= reach, axis=1)
        on_high[:, up] = False
        owner = self.bodies[cell[np.any(on_low | on_high, axis=1)]]
        return ~np.isin(self.bodies, owner)

    @cached_property
    def boundary(self) -> tuple[Indices, Indices]:
        """Return the sides of cells (s, corners) that are no other cell's.

        The cell (s,) of each comes with them.
        """
        kind = CELLS[self.points.shape[1], self.cells.shape[1]]
        sides = self.cells[:, np.array(SIDES[kind])]
        # A side between two cells has the same nodes twice, in any order.
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

        # Candidates: up to four conditions at the place of each corner, those of all faces that
        # meet there. The number m stands for none.
        nodes, place = np.unique(sides, return_inverse=True)
        reach = SAME * float(np.ptp(self.points, axis=0).max())
        tree = cKDTree(contact.points)
        _, near = tree.query(self.points[nodes], k=[1, 2, 3, 4], distance_upper_bound=reach)
        candidates = near[place.ravel()].reshape(*sides.shape, 4)

        # Outward normals of the sides: away from the middle of their cells.
        corners = self.points[sides]
        away = corners.mean(axis=1) - self.points[self.cells[cell]].mean(axis=1)
        outwards = compute_normals(corners)
        outwards *= np.sign(np.sum(outwards * away, axis=1))[:, None]

        # Of the candidates of a corner the one whose direction is nearest to that normal; none has
        # a direction of zeros. A side faces the contact when this holds at all its corners.
        normals = np.vstack([contact.normals, np.zeros_like(contact.normals[:1])])
        cosines = np.einsum("scki,si->sck", normals[candidates], outwards)
        best = cosines.argmax(axis=2)[:, :, None]
        conditions = np.take_along_axis(candidates, best, axis=2)[:, :, 0]
        facing = np.all(cosines.max(axis=2) > FACING, axis=1)

        # Where no side faces the contact, the nearest vertex stands for a condition.
        node = cKDTree(self.points).query(contact.points)[1]
        node[conditions[facing]] = sides[facing]
        return conditions[facing], node


def compute_normals(polygons: Array) -> Array:
    """Compute a unit normal (p, d) of each line (p, 2, 2) or polygon (p, corners, 3).

    That of one without any size is zero.
    """
    if polygons.shape[2] == 2:
        normals = (polygons[:, 1] - polygons[:, 0]) @ np.array([[0.0, -1.0], [1.0, 0.0]])
    else:  # of quadrilaterals by their diagonals
        normals = np.cross(polygons[:, 2] - polygons[:, 0], polygons[:, -1] - polygons[:, 1])
    sizes = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray(normals / np.where(sizes > 0.0, sizes, 1.0))


def find_nearest(t: Array, times: Sequence[float] | Array) -> Indices:
    """Find the rows of ``t`` next to each of ``times`` [s].

    Raises:
        InputError: there are no times, or one of them is no number.
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
        slip = np.reshape(history["slip"], (*active.shape, -1))
        change[1:] = np.linalg.norm(np.diff(slip, axis=0), axis=2)
    slips = change > 1e-9 * np.max(change, initial=0.0)
    return np.where(active, np.where(slips, SLIP, STICK), OPEN)


def compute_tangents(contact: Geometry) -> Array:
    """Compute the tangents (m, d, d - 1) of slip and traction_t in a history.

    What is at one place is one node, unless each condition has tangents of its own.
    """
    return make_tangent_vectors(contact.normals, contact.frame_nodes)


@check_arguments
def read_frames(run: RunFolder | str | Path) -> StoredFrames:
    """Read the frames from the fields of a run in plane or space.

    Args:
        run: what ``read_run`` returned, or its folder.

    Raises:
        InputError: the folder has no fields, or they are damaged.
    """
    folder = run.folder if isinstance(run, RunFolder) else Path(run)
    places = _list_places(folder)
    contact = None
    if places:
        run = run if isinstance(run, RunFolder) else read_run(folder)
        history = run.history
        contact = run.contact
        times = dict(zip(history["k"].astype(int).tolist(), history["t"].tolist(), strict=True))
        # not those whose rows a killed run has lost
        places = {k: places[k] for k in sorted(places) if k in times}
    if not places:
        raise InputError(
            f"no frames in {folder / FIELDS}: run it with out and fields=fem.XDMF(every=...)"
        )
    path, _ = next(iter(places.values()))
    if path.name != FIELDS_VTKHDF:
        path = path.with_name("mesh.h5")
    points, cells = _read_mesh(path)
    if contact is not None and cells.shape[1] > 2 and contact.points.shape[1] != points.shape[1]:
        raise InputError(
            f"'{path}' has points of {points.shape[1]} coordinates, and contact points have "
            f"{contact.points.shape[1]}: {DAMAGED}"
        )
    return StoredFrames(points, cells, np.array([times[k] for k in places]), tuple(places.values()))


def _is_sound(values: Array) -> bool:
    """Return whether no value is infinite, NaN, or so large that its square is infinite."""
    return bool(np.all(np.abs(values) < LARGEST))


def has_frames(folder: Path) -> bool:
    """Return whether a run wrote fields."""
    return bool(_list_places(folder))


def _list_places(folder: Path) -> dict[int, tuple[Path, str | int]]:
    """Return step -> where its frame is: XDMF's, or without those VTKHDF's."""
    places: dict[int, tuple[Path, str | int]] = {**list_frames(folder)}
    if not places:
        path = folder / FIELDS_VTKHDF
        places = {k: (path, i) for i, k in enumerate(list_steps(folder))}
    return places


def _read_mesh(path: Path) -> tuple[Array, Indices]:
    """Read the vertices (n, d) [m] of a run, and those of each cell (c, corners).

    path: of the mesh of XDMF, or of the file of VTKHDF.
    """
    with refuse_damage(path, DAMAGED) as file:
        if path.name == FIELDS_VTKHDF:
            series = StoredSeries(file)
            points = series.points
            cells = series.read_cells()
        else:
            points = file["points"][:]
            cells = file["cells"][:]
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
    vertices = VERTICES.get(cells.shape[1], cells.shape[1])
    d = 3 if np.any(points[:, 2]) else 2  # a mesh of the plane is stored with z = 0
    if vertices > 2 and (d, vertices) not in CELLS:
        raise InputError(
            f"'{path}' is damaged (cells of {vertices} vertices in {d} dimensions): {DAMAGED}"
        )
    return points[:, :d], cells[:, :vertices]
