"""Write fields for ParaView and VTK: one file ``fields.vtkhdf`` with all frames of a run.

What a frame holds is what it holds in XDMF: ``fields``. The file: ``core.vtkhdf``.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import numpy as np

from ...core.algebra import Array
from ...core.arguments import check_fields
from ...core.errors import InputError
from ...core.files import on_root
from ...core.hdf5_changes import undo_broken_change
from ...core.own_files import is_own, remove
from ...core.problem import ContactProblem
from ...core.quantities import Positive
from ...core.step import Report, State
from ...core.vtkhdf import CELL, FIELDS_VTKHDF, NODE, Frame, Pieces, append, create, open_series
from .fields import TAKEN, FrameValues, check_names

_KINDS = {
    "Polyvertex": 1,
    "Polyline": 3,
    "Triangle": 5,
    "Quadrilateral": 9,
    "Tetrahedron": 10,
    "Hexahedron": 12,
    "Edge_3": 21,
    "Triangle_6": 22,
    "Quadrilateral_9": 28,
    "Tetrahedron_10": 24,
    "Hexahedron_27": 29,
}
"""VTK's number of a cell by XDMF's name of it."""


@dataclass(frozen=True)
class VTKHDF:
    """Write a frame every so many steps, and one of the initial state, all into one file.

    VTK 9.3 and ParaView 5.12 read it, and newer ones. The mesh is stored once, in as many pieces as
    ranks began the run, so that ParaView on several ranks reads it in parts. Rank 0 writes.

    Args:
        every: a frame each so many steps.
        functions: name -> a DOLFINx Function of the user's, or a function of the state that returns
            one, as of ``XDMF``.
    """

    every: Annotated[int, Positive] = 10
    functions: Mapping[str, Any] = field(default_factory=dict, hash=False)

    def __post_init__(self) -> None:
        check_fields(self)
        check_names("VTKHDF", self.functions, (*TAKEN, NODE, CELL))

    def open(
        self, problem: ContactProblem, folder: Path, kept: Mapping[int, float]
    ) -> "VTKHDFWriter":
        """Return what writes the frames. Collective.

        Args:
            problem: that of the run.
            folder: that of the run.
            kept: step -> time [s] of frames with which the run goes on; those of them that are in
                the file stay, and all others are removed.
        """
        return VTKHDFWriter(FrameValues("VTKHDF", problem, self.functions), folder, kept)


class VTKHDFWriter:
    """Write the frames of a run; rank 0 alone touches the file."""

    def __init__(self, values: FrameValues, folder: Path, kept: Mapping[int, float]) -> None:
        """Keep the frames that stay. Collective.

        Args:
            values: what frames hold.
            folder: that of the run.
            kept: step -> time [s] of frames with which the run goes on.
        """
        self._values = values
        self._path = folder / FIELDS_VTKHDF
        self._begun = False  # whether the file is of this run
        on_root(values.comm, partial(self._start, kept))

    def _start(self, kept: Mapping[int, float]) -> None:
        """Write the file anew with the frames that stay, on rank 0; without any there is none."""
        undo_broken_change(self._path)
        if not is_own(self._path):
            return
        if not kept:
            remove(self._path)
            return
        with open_series(self._path) as series:
            numbers = [i for i, k in enumerate(series.steps.tolist()) if k in kept]
            pieces = series.read_pieces()
            grid = self._values.grid
            if not (
                np.array_equal(pieces.points, grid.points)
                and np.array_equal(series.read_cells(), grid.cells)
            ):
                raise InputError(
                    f"'{self._path}' has another mesh than this problem: remove it, or run into "
                    "another folder"
                )
            if numbers:
                frames = [partial(series.read_frame, i) for i in numbers]
                create(self._path, pieces, frames)
                self._begun = True
        if not numbers:
            remove(self._path)

    def write(self, state: State, acceleration: Array, report: Report | None = None) -> None:
        """Write a frame. Collective.

        Args:
            state: at the end of the step.
            acceleration: (n,) of the step, in the rotated basis [m/s²].
            report: that of the step, which tells what slips; None for the initial state.
        """
        nodal, cellwise = self._values.gather(state, acceleration, report)
        frame = Frame(state.k, state.t, nodal, cellwise)
        on_root(self._values.comm, partial(self._write, frame))

    def _write(self, frame: Frame) -> None:
        """Write a frame, on rank 0."""
        if self._begun:
            append(self._path, frame)
        else:
            create(self._path, self._divide(), [lambda: frame])
            self._begun = True

    def _divide(self) -> Pieces:
        """Return the mesh in pieces, one for each rank that has cells."""
        grid = self._values.grid
        numbers = [np.flatnonzero(grid.owners == rank) for rank in np.unique(grid.owners)]
        cells = [grid.cells[rows] for rows in numbers]
        return Pieces(grid.points, _KINDS[grid.kind], cells, numbers)
