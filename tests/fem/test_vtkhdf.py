"""Fields in one file: the numbers of XDMF, on any number of ranks, after restarts, and as VTK reads
them."""

from __future__ import annotations

import errno
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

import h5py
from bar_case import BAR
from fem_problems import CONCRETE, block, shaken_wall
from test_fields import DT
from test_fields import frames as xdmf_frames

import vi_contact as vc
from vi_contact import fem
from vi_contact.core import hdf5_changes
from vi_contact.core.errors import InputError, ViContactError
from vi_contact.core.files import write_all
from vi_contact.core.problem import ContactProblem
from vi_contact.core.vtkhdf import list_steps, open_series
from vi_contact.fem import compat
from vi_contact.practice.plots.deformed import read_frames

WALL = f"""{BAR}[scheme]
type = "ZienkiewiczWoodTaylor"
[run]
dt = 0.01
t_end = 0.05
"""
NAMES = ("u", "v", "a", "contact_traction_t", "slip", "contact_pressure", "contact_status")


def rough_wall(comm: Any) -> ContactProblem:
    """A shaken wall with friction, turned."""
    return replace(shaken_wall(comm, angle=0.3, gap=1e-7), friction=vc.Coulomb(0.3))


def run(problem: ContactProblem, out: Path, steps: int, fields: Any, **more: Any) -> Any:
    """A run with fields."""
    scheme = vc.ZienkiewiczWoodTaylor()
    return vc.simulate(problem, scheme=scheme, dt=DT, steps=steps, out=out, fields=fields, **more)


def read(folder: Path) -> list[Any]:
    """All frames of a run."""
    with open_series(folder / "fields.vtkhdf") as series:
        return [series.read_frame(i) for i in range(len(series.times))]


@pytest.mark.long
def test_numbers_are_those_of_xdmf(comm: Any, shared_tmp: Path) -> None:
    """Mesh, times and every array of every frame, bit by bit, in the order of the input mesh; a
    piece for each rank with cells, and every cell in one."""
    problem = rough_wall(comm)
    run(problem, shared_tmp / "xdmf", 36, fem.XDMF(every=12))
    run(problem, shared_tmp / "vtk", 36, fem.VTKHDF(every=12))
    found = xdmf_frames(shared_tmp / "xdmf")
    stored = read(shared_tmp / "vtk")
    assert [frame.t for frame in stored] == [frame["t"] for frame in found]
    assert [frame.k for frame in stored] == [0, 12, 24, 36] == list_steps(shared_tmp / "vtk")
    for frame, other in zip(stored, found, strict=True):
        assert set(frame.nodal) == set(NAMES) and set(frame.cellwise) == {"von_mises"}
        for name, values in (frame.nodal | frame.cellwise).items():
            assert np.array_equal(values, other[name]), name
    assert found[-1]["contact_status"].max() >= 2
    with open_series(shared_tmp / "vtk" / "fields.vtkhdf") as series:
        assert np.array_equal(series.points, found[0]["points"])
        assert np.array_equal(series.read_cells(), found[0]["cells"])
        pieces = series.read_pieces()
    assert 1 <= len(pieces.cells) <= comm.size
    numbers = np.sort(np.concatenate(pieces.numbers))
    assert np.array_equal(numbers, np.arange(len(found[0]["cells"])))


@pytest.mark.long
def test_other_readers_take_it(comm: Any, shared_tmp: Path) -> None:
    """A frame as a Function, also at a time; and the frames of the pictures."""
    problem = rough_wall(comm)
    for name, fields in (("xdmf", fem.XDMF(every=6)), ("vtk", fem.VTKHDF(every=6))):
        run(problem, shared_tmp / name, 12, fields)
    one, other = (read_frames(shared_tmp / name) for name in ("xdmf", "vtk"))
    assert np.array_equal(one.cells, other.cells) and np.array_equal(one.points, other.points)
    assert np.array_equal(one.t, other.t)
    for mine, theirs in zip(one.at(12 * DT), other.at(12 * DT), strict=True):
        assert np.array_equal(mine, theirs)
    for name in ("u", "contact_pressure", "stress"):
        mine, theirs = (
            fem.read_function(problem, shared_tmp / kind, name, t=12 * DT)
            for kind in ("xdmf", "vtk")
        )
        assert np.array_equal(mine.x.array, theirs.x.array)
    with pytest.raises(InputError, match="no frame at t = 0.5 s: the 3 frames are at"):
        fem.read_function(problem, shared_tmp / "vtk", "u", t=0.5)


@pytest.mark.slow
def test_restart_is_the_straight_run(comm: Any, shared_tmp: Path) -> None:
    """Frames behind the checkpoint are removed, those before it stay."""
    problem = rough_wall(comm)
    run(problem, shared_tmp / "straight", 16, fem.VTKHDF(every=2))
    folder = shared_tmp / "parts"
    checkpoint = folder / "checkpoint.npz"
    run(problem, folder, 8, fem.VTKHDF(every=2))
    comm.Barrier()
    early = checkpoint.read_bytes()
    run(problem, folder, 12, fem.VTKHDF(every=2), restart=True)
    comm.Barrier()
    if comm.rank == 0:
        checkpoint.write_bytes(early)  # as of a run that was killed at step 12
    comm.Barrier()
    run(problem, folder, 9, fem.VTKHDF(every=2), restart=True)
    assert list_steps(folder) == [0, 2, 4, 6, 8]
    comm.Barrier()
    run(problem, folder, 16, fem.VTKHDF(every=2), restart=True)
    for mine, theirs in zip(read(folder), read(shared_tmp / "straight"), strict=True):
        assert mine.k == theirs.k and mine.t == theirs.t
        for name, values in (mine.nodal | mine.cellwise).items():
            exact = (theirs.nodal | theirs.cellwise)[name]
            size = np.max(np.abs(exact), initial=0.0)
            assert np.allclose(values, exact, rtol=0.0, atol=1e-10 * size), name
    comm.Barrier()
    run(problem, folder, 2, fem.VTKHDF(every=2))
    assert list_steps(folder) == [0, 2]


@pytest.mark.long
def test_own_functions(comm: Any, shared_tmp: Path) -> None:
    """Numbers in cells, vectors at nodes and a tensor that a function of the state returns; after a
    restart one is gone, and another is new: what a frame has not is NaN there."""
    problem = rough_wall(comm)
    space = problem.system.space
    mesh = space.mesh
    damage = compat.function(compat.cell_space(mesh))
    wind = compat.function(compat.lagrange(mesh, 1, (2,)))
    wind.interpolate(lambda x: np.array([2.0 * x[0], x[1]]))
    calls: list[float] = []

    def stress(state: Any) -> Any:
        calls.append(state.t)
        damage.x.array[:] = state.t  # for the frames after this one
        return fem.as_function(problem, state, "stress", continuous=True)

    own = {"damage": damage, "sigma": stress}
    run(problem, shared_tmp, 4, fem.VTKHDF(every=2, functions=own))
    comm.Barrier()
    more = {"wind": wind, "damage": damage}
    run(problem, shared_tmp, 6, fem.VTKHDF(every=2, functions=more), restart=True)
    stored = read(shared_tmp)
    assert len(stored) == 4 and calls == [0.0, 2 * DT, 4 * DT]
    before = [0.0, 0.0, 2 * DT, 4 * DT]
    for frame, value in zip(stored, before, strict=True):
        assert np.all(frame.cellwise["damage"] == value)
    last = stored[-1]
    with open_series(shared_tmp / "fields.vtkhdf") as series:
        points = series.points
    assert np.allclose(last.nodal["wind"], points * (2.0, 1.0, 0.0), rtol=1e-12)
    assert np.isnan(last.nodal["sigma"]).all() and np.isnan(stored[0].nodal["wind"]).all()
    sigma = stored[2].nodal["sigma"]
    assert sigma.shape[1] == 9 and not sigma[:, [2, 5, 6, 7, 8]].any() and sigma[:, 0].any()


def test_full_disk(comm: Any, shared_tmp: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A frame that has no room: one sentence on every rank, the frames before stay, and the
    restart adds its own."""
    problem = shaken_wall(comm)
    full = [False]

    def limited(file: Any, data: Any) -> None:
        if full[0]:
            raise OSError(errno.ENOSPC, "No space left on device")
        write_all(file, data)

    class Fills:
        """Lets the disk be full from a step on."""

        def columns(self) -> dict[str, tuple[str, str]]:
            return {}

        def start(self, problem: Any, state: Any, resumed: Any = None) -> dict[str, float]:
            return {}

        def row(self, report: Any) -> dict[str, float]:
            full[0] = report.step.k >= 4
            return {}

    monkeypatch.setattr(hdf5_changes, "write_all", limited)
    fields = fem.VTKHDF(every=2)
    with pytest.raises(ViContactError, match=r"the disk is full: '.*fields.vtkhdf' could not"):
        run(problem, shared_tmp, 6, fields, record=[Fills()], checkpoint_every=2)
    assert list_steps(shared_tmp) == [0, 2]
    comm.Barrier()
    monkeypatch.undo()
    full[0] = False
    run(problem, shared_tmp, 6, fields, record=[Fills()], restart=True)
    # one rank alone leaves a checkpoint of step 4 behind, whose frame is missing
    assert list_steps(shared_tmp) == ([0, 2, 6] if comm.size == 1 else [0, 2, 4, 6])


@pytest.mark.two_ranks
def test_bad_settings_are_told(comm: Any, shared_tmp: Path) -> None:
    """One sentence for a number, a name that is taken, a mesh that is another, a damaged file."""
    with pytest.raises(InputError, match="VTKHDF: every is 0"):
        fem.VTKHDF(every=0)
    with pytest.raises(InputError, match="VTKHDF: functions has the name 'node', which frames"):
        fem.VTKHDF(functions={"node": None})
    problem = shaken_wall(comm)
    run(problem, shared_tmp, 4, fem.VTKHDF(every=2))
    comm.Barrier()
    path = shared_tmp / "fields.vtkhdf"
    if comm.rank == 0:
        with h5py.File(path, "a") as file:
            file["VTKHDF/Points"][0] += 1.0
    comm.Barrier()
    with pytest.raises(InputError, match="has another mesh than this problem"):
        run(problem, shared_tmp, 6, fem.VTKHDF(every=2), restart=True)
    comm.Barrier()
    if comm.rank == 0:
        path.write_bytes(b"no HDF5")
    comm.Barrier()
    with pytest.raises(InputError, match=r"fields.vtkhdf' is missing or damaged"):
        run(problem, shared_tmp, 6, fem.VTKHDF(every=2), restart=True)


@pytest.mark.parametrize(
    ("lengths", "divisions", "simplices", "degree"),
    [
        ((2.0, 3.0), (2, 3), False, 1),
        ((2.0, 3.0), (2, 3), True, 1),
        ((2.0, 1.0, 3.0), (2, 1, 3), False, 1),
        ((2.0, 1.0, 3.0), (2, 1, 3), True, 1),
        ((2.0, 3.0), (2, 3), False, 2),
        ((2.0, 3.0), (2, 3), True, 2),
        ((2.0, 1.0, 3.0), (2, 1, 3), False, 2),
        ((2.0, 1.0, 3.0), (2, 1, 3), True, 2),
    ],
)
def test_as_vtk_reads_it(
    comm: Any, shared_tmp: Path, lengths: Any, divisions: Any, simplices: bool, degree: int
) -> None:
    """VTK's own reader finds the times, every array of every frame, and cells whose nodes lie where
    VTK's kind of cell has them: an affine map of its parametric coordinates, of positive volume."""
    vtk = pytest.importorskip("vtk", reason="vtk is not installed: pip install vtk")
    from vtk.util.numpy_support import vtk_to_numpy

    mesh, tags = block(comm, lengths=lengths, divisions=divisions, simplices=simplices)
    system = fem.assemble(mesh, CONCRETE, clamped=tags["bottom"], degree=degree)
    problem = ContactProblem(system, fem.contact_surface(system, tags["right"]))
    run(problem, shared_tmp, 4, fem.VTKHDF(every=2))
    stored = read(shared_tmp)

    reader = vtk.vtkHDFReader()
    reader.SetFileName(str(shared_tmp / "fields.vtkhdf"))
    reader.UpdateInformation()
    steps = vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS()
    times = reader.GetOutputInformation(0).Get(steps)
    assert list(times) == [frame.t for frame in stored]
    grids: list[Any] = []
    for t, frame in zip(times, stored, strict=True):
        reader.UpdateTimeStep(t)
        found = reader.GetOutputDataObject(0)
        grids = [found]
        if found.IsA("vtkPartitionedDataSet"):
            grids = [found.GetPartition(i) for i in range(found.GetNumberOfPartitions())]
        for name, values in frame.nodal.items():
            for grid in grids:
                nodes = vtk_to_numpy(grid.GetPointData().GetArray("node"))
                array = vtk_to_numpy(grid.GetPointData().GetArray(name))
                assert np.array_equal(array, values[nodes]), name
        for grid in grids:
            numbers = vtk_to_numpy(grid.GetCellData().GetArray("cell"))
            array = vtk_to_numpy(grid.GetCellData().GetArray("von_mises"))
            assert np.array_equal(array, frame.cellwise["von_mises"][numbers])
    cells = [vtk_to_numpy(grid.GetCellData().GetArray("cell")) for grid in grids]
    count = len(stored[0].cellwise["von_mises"])
    assert np.array_equal(np.sort(np.concatenate(cells)), np.arange(count))
    for grid in grids:
        check_places(grid, len(lengths))


def check_places(grid: Any, d: int) -> None:
    """The nodes of each cell are an affine map of its parametric coordinates, of positive size."""
    from vtk.util.numpy_support import vtk_to_numpy

    points = vtk_to_numpy(grid.GetPoints().GetData())
    for i in range(grid.GetNumberOfCells()):
        cell = grid.GetCell(i)
        ids = [cell.GetPointId(j) for j in range(cell.GetNumberOfPoints())]
        places = np.reshape(cell.GetParametricCoords(), (-1, 3))[:, :d]
        affine = np.column_stack([np.ones(len(ids)), places])
        fit, *_ = np.linalg.lstsq(affine, points[ids][:, :d], rcond=None)
        assert np.allclose(affine @ fit, points[ids][:, :d], rtol=0.0, atol=1e-12)
        assert np.linalg.det(fit[1:]) > 0.0


@pytest.mark.two_ranks
def test_from_a_case_file(comm: Any, shared_tmp: Path) -> None:
    """[fields] with type = "VTKHDF" is the class; without a type it is XDMF."""
    from vi_contact.practice.studies import read_case

    path = shared_tmp / "case.toml"
    for line, name in (("", "fields.xdmf"), ('type = "VTKHDF"', "fields.vtkhdf")):
        comm.Barrier()
        if comm.rank == 0:
            path.write_text(f"{WALL}[fields]\nevery = 5\n{line}\n")
        comm.Barrier()
        out = shared_tmp / name
        read_case(path).run(comm, out=out, progress=False)
        assert [found.name for found in sorted(out.glob("fields.*"))] == [name]
    assert list_steps(out) == [0, 5]
