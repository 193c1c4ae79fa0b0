"""Write and read ``fields.vtkhdf``: the frames of a run in one HDF5 file, as VTK describes it.

An unstructured grid that stays the same in all frames is stored once, in pieces. An array has the
rows of all frames one after another, each piece by piece, and Steps says in which row a frame
begins. Points between two pieces are in both. The arrays ``node`` and ``cell`` have the numbers of
points and cells in the order of the input mesh.

The format: VTK file formats, VTKHDF, https://docs.vtk.org/en/latest/vtk_file_formats/.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from .algebra import Array, Indices
from .files import hdf5_atomically
from .hdf5 import refuse_damage
from .hdf5_changes import change_hdf5
from .own_files import is_own

FIELDS_VTKHDF = "fields.vtkhdf"
NODE = "node"  # number of a point in the order of the input mesh
CELL = "cell"  # of a cell
VERSION = (2, 0)  # of the format: the first with steps
MOST_ROWS = 2**24  # of a chunk: HDF5 takes less than 4 GiB
ROOT = "VTKHDF"
POINT_DATA = "PointData"
CELL_DATA = "CellData"


@dataclass(frozen=True)
class Pieces:
    """Hold a grid in pieces, as the file has it.

    Attributes:
        points: (n, 3) all nodes in the order of the input mesh [m].
        kind: VTK's number of the type of all cells.
        cells: for each piece the numbers (k, v) of the nodes of its cells, in VTK's order.
        numbers: for each piece the numbers (k,) of its cells in the order of the input mesh.
    """

    points: Array
    kind: int
    cells: Sequence[Indices]
    numbers: Sequence[Indices]

    @property
    def nodes(self) -> list[Indices]:
        """Return the numbers of the nodes of each piece."""
        return [np.unique(cells) for cells in self.cells]


@dataclass(frozen=True)
class Frame:
    """Hold the values of a frame, in the order of the input mesh.

    Attributes:
        k: number of the step.
        t: time [s].
        nodal: name -> (nodes, …).
        cellwise: name -> (cells, …).
    """

    k: int
    t: float
    nodal: Mapping[str, Array]
    cellwise: Mapping[str, Array]


def create(path: Path, pieces: Pieces, frames: Sequence[Callable[[], Frame]]) -> None:
    """Write the file anew, as a whole or not at all.

    Args:
        path: the file.
        pieces: the grid.
        frames: return the frames, at least one, in the order of time.

    Raises:
        OSError: names the file.
    """

    def fill(file: Any) -> None:
        root = file.create_group(ROOT)
        root.attrs["Version"] = np.array(VERSION, dtype=np.int64)
        # VTK asks for a text of fixed length
        root.attrs["Type"] = np.bytes_("UnstructuredGrid")
        _write_grid(root, pieces)
        for make in frames:
            _add(root, make())

    hdf5_atomically(path, fill)


def append(path: Path, frame: Frame) -> None:
    """Add a frame to the file; a crash or a full disk leaves those that are in it.

    Args:
        path: the file.
        frame: it, later than all others.

    Raises:
        OSError: names the file.
    """
    change_hdf5(path, lambda file: _add(file[ROOT], frame))


def _write_grid(root: Any, pieces: Pieces) -> None:
    """Write points and cells of all pieces, and make room for frames."""
    nodes = pieces.nodes
    local = [np.searchsorted(own, cells) for own, cells in zip(nodes, pieces.cells, strict=True)]
    corners = pieces.cells[0].shape[1]
    counts = np.array([len(cells) for cells in pieces.cells], dtype=np.int64)
    root["NumberOfPoints"] = np.array([len(own) for own in nodes], dtype=np.int64)
    root["NumberOfCells"] = counts
    root["NumberOfConnectivityIds"] = counts * corners
    root["Points"] = pieces.points[np.concatenate(nodes)]
    root["Connectivity"] = np.concatenate([rows.ravel() for rows in local]).astype(np.int64)
    root["Offsets"] = np.concatenate([np.arange(n + 1, dtype=np.int64) * corners for n in counts])
    root["Types"] = np.full(counts.sum(), pieces.kind, dtype=np.uint8)
    for group in (POINT_DATA, CELL_DATA, "FieldData"):
        root.create_group(group)
    root[f"{POINT_DATA}/{NODE}"] = np.concatenate(nodes).astype(np.int64)
    root[f"{CELL_DATA}/{CELL}"] = np.concatenate(pieces.numbers).astype(np.int64)
    _make_rows(root, "FieldData/step", (), np.int64, 64)

    # The grid of every frame is the first one.
    steps = root.create_group("Steps")
    steps.attrs["NSteps"] = np.int64(0)
    _make_rows(steps, "Values", (), np.float64, 64)
    for name in ("PartOffsets", "NumberOfParts", "PointOffsets"):
        _make_rows(steps, name, (), np.int64, 64)
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        _make_rows(steps, name, (1,), np.int64, 64)
    for name in (f"{POINT_DATA}Offsets/{NODE}", f"{CELL_DATA}Offsets/{CELL}"):
        _make_rows(steps, name, (), np.int64, 64)
    _make_rows(steps, "FieldDataOffsets/step", (), np.int64, 64)


def _make_rows(group: Any, name: str, shape: tuple[int, ...], kind: Any, chunk: int) -> Any:
    """Make a data set without rows, which can grow.

    Args:
        group: where it is.
        name: in the group.
        shape: of a row.
        kind: of its numbers.
        chunk: rows that are stored together.
    """
    rows = max(1, min(chunk, MOST_ROWS))
    return group.create_dataset(
        name, (0, *shape), maxshape=(None, *shape), dtype=kind, chunks=(rows, *shape)
    )


def _extend(dataset: Any, rows: Array) -> None:
    """Write rows behind those of a data set."""
    first = len(dataset)
    dataset.resize(first + len(rows), axis=0)
    dataset[first:] = rows


def _add(root: Any, frame: Frame) -> None:
    """Write a frame behind the others of an open file."""
    steps = root["Steps"]
    count = len(steps["Values"])
    for group, number, values in (
        (POINT_DATA, NODE, frame.nodal),
        (CELL_DATA, CELL, frame.cellwise),
    ):
        order = root[f"{group}/{number}"][()]
        _add_arrays(root, group, {name: rows[order] for name, rows in values.items()}, len(order))
        _extend(steps[f"{group}Offsets/{number}"], np.zeros(1))
    _extend(root["FieldData/step"], np.array([frame.k]))
    _extend(steps["FieldDataOffsets/step"], np.array([count]))
    _extend(steps["NumberOfParts"], np.array([len(root["NumberOfPoints"])]))
    for name in ("PartOffsets", "PointOffsets"):
        _extend(steps[name], np.zeros(1))
    for name in ("CellOffsets", "ConnectivityIdOffsets"):
        _extend(steps[name], np.zeros((1, 1)))
    _extend(steps["Values"], np.array([frame.t]))
    steps.attrs.modify("NSteps", np.int64(count + 1))


def _add_arrays(root: Any, group: str, values: Mapping[str, Array], rows: int) -> None:
    """Write the arrays of a frame behind those of the others.

    VTK wants every array in every frame. A frame without one has NaN, or zeros of whole numbers.

    Args:
        root: of the open file.
        group: POINT_DATA or CELL_DATA.
        values: name -> (rows, …), in the order of the file.
        rows: of a frame.
    """
    offsets = root[f"Steps/{group}Offsets"]
    count = len(root["Steps/Values"])
    for name, array in values.items():
        if name in root[group]:
            continue
        dataset = _make_rows(root[group], name, array.shape[1:], array.dtype, rows)
        _make_rows(offsets, name, (), np.int64, 64)
        if count:  # the frames before share one that is empty
            _extend(dataset, _fill_empty(dataset, rows))
            _extend(offsets[name], np.zeros(count))
    for name in root[group]:
        if name in (NODE, CELL):
            continue
        dataset = root[group][name]
        _extend(offsets[name], np.array([len(dataset)]))
        _extend(dataset, values[name] if name in values else _fill_empty(dataset, rows))


def _fill_empty(dataset: Any, rows: int) -> Array:
    """Return so many rows for a frame that has no values."""
    empty = np.nan if dataset.dtype.kind == "f" else 0
    return np.full((rows, *dataset.shape[1:]), empty, dtype=dataset.dtype)


class StoredSeries:
    """Read the frames of an open file, in the order of the input mesh.

    Attributes:
        steps: (f,) numbers of the steps.
        times: (f,) [s].
        points: (n, 3) of the mesh [m].
        names: of the arrays.
    """

    def __init__(self, file: Any) -> None:
        """Read the grid.

        Args:
            file: the open file, as of ``open_hdf5``.
        """
        root = file[ROOT]
        self._root = root
        self.times = root["Steps/Values"][()]
        self.steps = root["FieldData/step"][()]
        self._order = {
            POINT_DATA: root[f"{POINT_DATA}/{NODE}"][()],
            CELL_DATA: root[f"{CELL_DATA}/{CELL}"][()],
        }
        self.points = np.zeros((int(self._order[POINT_DATA].max()) + 1, 3))
        self.points[self._order[POINT_DATA]] = root["Points"][()]
        self._place = {
            name: group for group in self._order for name in root[group] if name not in (NODE, CELL)
        }

    @property
    def names(self) -> list[str]:
        """Return the names of the arrays."""
        return list(self._place)

    def read(self, name: str, frame: int) -> Array:
        """Return an array of a frame, by the number of the frame.

        Raises:
            KeyError: there is no such array.
        """
        group = self._place[name]
        order = self._order[group]
        first = int(self._root[f"Steps/{group}Offsets"][name][frame])
        rows = self._root[group][name][first : first + len(order)]
        values = np.zeros((int(order.max()) + 1, *rows.shape[1:]), dtype=rows.dtype)
        values[order] = rows
        return values

    def read_frame(self, frame: int) -> Frame:
        """Return a frame by its number."""
        arrays: dict[str, dict[str, Array]] = {POINT_DATA: {}, CELL_DATA: {}}
        for name, group in self._place.items():
            arrays[group][name] = self.read(name, frame)
        return Frame(
            k=int(self.steps[frame]),
            t=float(self.times[frame]),
            nodal=arrays[POINT_DATA],
            cellwise=arrays[CELL_DATA],
        )

    def read_pieces(self) -> Pieces:
        """Return the grid."""
        root = self._root
        cells = []
        numbers = []
        point = 0
        row = 0
        corners = int(root["NumberOfConnectivityIds"][0] // root["NumberOfCells"][0])
        connectivity = root["Connectivity"][()].reshape(-1, corners)
        counts = zip(root["NumberOfPoints"][()], root["NumberOfCells"][()], strict=True)
        for nodes, count in counts:
            own = self._order[POINT_DATA][point : point + nodes]
            cells.append(own[connectivity[row : row + count]])
            numbers.append(self._order[CELL_DATA][row : row + count])
            point += nodes
            row += count
        return Pieces(self.points, int(root["Types"][0]), cells, numbers)

    def read_cells(self) -> Indices:
        """Return the nodes (c, v) of all cells, in the order of the input mesh."""
        pieces = self.read_pieces()
        rows = np.concatenate(pieces.cells)
        cells = np.zeros_like(rows)
        cells[np.concatenate(pieces.numbers)] = rows
        return cells


@contextmanager
def open_series(path: Path) -> Iterator[StoredSeries]:
    """Open the file to be read; InputError when it is missing or damaged."""
    with refuse_damage(path, "restore it, or run again") as file:
        yield StoredSeries(file)


def list_steps(folder: Path) -> list[int]:
    """Return the steps whose frames are in the file of a run folder, none without a file."""
    path = folder / FIELDS_VTKHDF
    if not is_own(path):
        return []
    with open_series(path) as series:
        return [int(k) for k in series.steps]
