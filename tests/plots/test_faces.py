"""Pictures of contact in space, drawn from the folder of a small run with friction between blocks
whose meshes do not match: what they show is what was recorded."""

from __future__ import annotations

import shutil
import sys
import warnings
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from kept_figures import keep_figures

pytest.importorskip("dolfinx")
pytest.importorskip("matplotlib")
from mpi4py import MPI
from plain_pictures import plain_pictures
from two_bodies import SOFT, two_blocks

import vi_contact as vc
from demos.parts.pictures.rendered import render_deformed
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.core.files import open_hdf5
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import TwoBlocks
from vi_contact.practice.plots import bodies, faces
from vi_contact.practice.plots.bodies import film, plot_deformed
from vi_contact.practice.plots.deformed import OPEN, SLIP, STICK, contact_states, read_frames
from vi_contact.practice.plots.faces import (
    Painter,
    choose_times,
    find_leading_column,
    plot_faces,
    split_faces,
)
from vi_contact.run.files.reading import RunFolder, read_run

pytestmark = pytest.mark.serial
STEPS, DT = 30, 1e-3


def rubbed(folder: Path, simplices: bool) -> RunFolder:
    """A block of 3 x 3 x 3 cells on one of 4 x 2 x 4, which is wider by half of it; pressed and
    pushed aside."""
    lower, upper = (
        BlockMesh(lengths=lengths, divisions=divisions, simplices=simplices)
        for lengths, divisions in (((2.0, 1.0, 2.0), (4, 2, 4)), ((1.0, 1.0, 1.0), (3, 3, 3)))
    )

    def push(x: Any, t: float) -> Any:
        return np.tile(min(t / 0.01, 1.0) * np.array([2.2e3, -4.0e3, 1.1e3]), (len(x), 1))

    system, tags = two_blocks(
        MPI.COMM_SELF,
        TwoBlocks(lower=lower, upper=upper, offset=(0.5, 0.5)),
        SOFT,
        clamped=lambda tags: tags["lower_bottom"],
        loads=lambda tags: [fem.Traction(tags["upper_top"], push)],
    )
    surface = fem.contact_pair(
        system, tags["upper_bottom"], tags["lower_top"], matching=fem.DualMortar()
    )
    problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(0.3))
    vc.simulate(
        problem,
        dt=DT,
        steps=STEPS,
        out=folder,
        record=[vc.Contact()],
        fields=fem.XDMF(every=3),
        progress=False,
    )
    return read_run(folder)


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, RunFolder]:
    found = {
        kind: rubbed(tmp_path_factory.mktemp(kind), kind == "tetrahedra")
        for kind in ("hexahedra", "tetrahedra")
    }
    for run in found.values():
        states = contact_states(run.history)
        assert all(np.any(states == state) for state in (OPEN, STICK, SLIP))
    return found


@pytest.fixture
def figures(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    return keep_figures(monkeypatch, bodies, faces)


@pytest.fixture(autouse=True)
def _kept_corners(monkeypatch: pytest.MonkeyPatch) -> None:
    """Collections in space keep the corners that they are given; releases of matplotlib hide them
    in other places."""
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    begin = Poly3DCollection.__init__

    def keep(self: Any, corners: Any, *others: Any, **named: Any) -> None:
        self.given_corners = np.asarray(corners)
        begin(self, corners, *others, **named)

    monkeypatch.setattr(Poly3DCollection, "__init__", keep)


@pytest.mark.parametrize("kind", ["hexahedra", "tetrahedra"])
def test_what_belongs_to_whom(runs: Any, kind: str) -> None:
    """Bodies by what their cells share; the surface of both; the sides of the face are those of the
    upper block alone, though the lower one has nodes at the same places; their shares are as large
    as the weights."""
    run, frames = runs[kind], read_frames(runs[kind])
    per_cell, per_side = (1, 1) if kind == "hexahedra" else (6, 2)
    assert np.bincount(frames.bodies).tolist() == [32 * per_cell, 27 * per_cell]
    sides, cells = frames.boundary
    boxes = (2 * 16 + 4 * 8, 6 * 9)
    assert np.bincount(frames.bodies[cells]).tolist() == [per_side * count for count in boxes]
    facing, nodes = frames.facing(run.contact)
    assert len(facing) == 9 * per_side
    assert np.array_equal(frames.points[nodes], run.contact.points)
    assert np.all(np.isin(nodes, frames.cells[frames.bodies == 1]))
    with open_hdf5(frames.places[7][0]) as file:  # of step 21, told by the solver
        assert np.array_equal(file["contact_status"][:][nodes], contact_states(run.history)[21])
    (face,) = split_faces(run.contact, facing)
    assert face.name == "face towards -y" and np.array_equal(face.conditions, np.arange(16))
    one, other = face.parts[:, 2] - face.parts[:, 0], face.parts[:, 3] - face.parts[:, 1]
    weights = np.bincount(face.owners, 0.5 * np.linalg.norm(np.cross(one, other), axis=1))
    assert weights.sum() == pytest.approx(1.0, rel=1e-12)
    assert weights == pytest.approx(run.contact.weights, rel=1e-9)


def test_faces(runs: Any, figures: list[Any], tmp_path: Path) -> None:
    """Pressures, states and slips of the rows next to the times, on the shares of their points."""
    run, times = runs["tetrahedra"], (0.0, 0.0151, STEPS * DT)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        path = plot_faces(run, tmp_path / "faces.png", times=times, title="$")
    assert path.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    history, axes = run.history, figures[0].axes[:6]
    conditions = read_frames(run).facing(run.contact)[0].ravel()
    states, slip = contact_states(history), history["slip"]
    for column, row in enumerate((0, 15, STEPS)):
        over, under = axes[column], axes[3 + column]
        assert over.get_title() == f"face towards -y, t = {row * DT:.4g} s"
        assert (
            (over.get_xlabel(), over.get_ylabel())
            == ("x [m]", "z [m]")
            == (under.get_xlabel(), under.get_ylabel())
        )
        pressure = over.collections[0]
        assert np.asarray(pressure.get_array()) == pytest.approx(
            1e-3 * history["pressure"][row, conditions]
        )
        shown = pressure.to_rgba(pressure.get_array())
        open_points = history["active"][row, conditions] == 0
        assert np.array_equal(np.all(shown[:, :3] == 1.0, axis=1), open_points)
        assert np.array_equal(under.collections[0].get_array(), states[row, conditions])
        arrows = [one for one in under.collections if hasattr(one, "U")]
        drawn = np.column_stack([arrows[0].U, arrows[0].V]) if arrows else np.zeros((0, 2))
        rubs = (states[row] != OPEN) & (np.linalg.norm(slip[row], axis=1) > 0.0)
        assert len(drawn) == np.count_nonzero(rubs)
        if len(drawn):
            places = run.contact.points[rubs][:, [0, 2]]
            assert np.array_equal(np.column_stack([arrows[0].X, arrows[0].Y]), places)
            assert drawn / np.abs(drawn).max() == pytest.approx(
                slip[row][rubs] / np.abs(slip[row][rubs]).max()
            )
    assert "contact pressure [kPa]" in figures[0].axes[6].get_ylabel()
    texts = [text.get_text() for text in figures[0].legends[0].get_texts()]
    longest = max(
        float(np.linalg.norm(slip[row][states[row] != OPEN], axis=1).max(initial=0.0))
        for row in (15, STEPS)
    )
    assert texts[:3] == ["open", "stick", "slip"] and texts[3].endswith(f" {1e6 * longest:.3g} µm")


def test_curved_faces_and_corners(tmp_path: Path, figures: list[Any]) -> None:
    """A bent base is one face, in projection, and a side of the same body another; the edge between
    them has conditions on both. Nothing rubs: closed points are said to be closed."""

    def bend(x: Any) -> Any:
        return np.column_stack([x[:, :2], x[:, 2] + 0.4 * (1.0 - x[:, 2]) * x[:, 1] ** 2])

    mesh, tags = fem.build_mesh(
        BlockMesh(lengths=(1.0,) * 3, divisions=(3, 3, 3), deform=bend), MPI.COMM_SELF
    )

    def push(x: Any, t: float) -> Any:
        return np.tile([3.0e3, 0.0, -4.0e3], (len(x), 1))

    system = fem.assemble(mesh, SOFT, loads=[fem.Traction(tags["front"], push)])
    surface = fem.joined_surfaces(
        *(fem.contact_surface(system, tags[side]) for side in ("back", "right"))
    )
    problem = vc.ContactProblem(system, surface, mass=vc.ConsistentMass())
    vc.simulate(
        problem,
        scheme=vc.Newmark(),
        dt=DT,
        steps=2,
        out=tmp_path,
        record=[vc.Contact()],
        fields=fem.XDMF(every=1),
        progress=False,
    )
    run = read_run(tmp_path)
    curved, flat = split_faces(run.contact, read_frames(run).facing(run.contact)[0])
    assert (curved.name, flat.name) == ("curved face", "face towards x")
    assert (
        len(curved.owners) == len(flat.owners) == 36
        and not np.intersect1d(curved.owners, flat.owners).size
    )
    assert np.sort([*curved.conditions, *flat.conditions]).tolist() == list(range(32))
    plot_faces(run, tmp_path / "faces.png", times=[2.0 * DT])
    in_space, states = figures[0].axes[:2]
    shown = in_space.collections[0]
    assert np.asarray(shown.get_array()) == pytest.approx(
        1e-3 * run.history["pressure"][2, curved.owners]
    )
    assert np.array_equal(shown.given_corners, curved.parts)
    assert [axis.name for axis in figures[0].axes[:4]] == ["3d", "3d", "rectilinear", "rectilinear"]
    assert np.array_equal(
        states.collections[0].get_array(), contact_states(run.history)[2, curved.owners]
    )
    assert [text.get_text() for text in figures[0].legends[0].get_texts()] == ["open", "closed"]


def test_faces_without_fields(runs: Any, figures: list[Any], tmp_path: Path) -> None:
    """Dots at the points, of the same values; another run is refused in one sentence."""
    run = replace(runs["hexahedra"], folder=tmp_path)
    plot_faces(run, tmp_path / "faces.png", times=[STEPS * DT])
    (dots,) = figures[0].axes[0].collections
    assert np.array_equal(dots.get_offsets(), run.contact.points[:, [0, 2]])
    assert np.asarray(dots.get_array()) == pytest.approx(1e-3 * run.history["pressure"][STEPS])
    arrayless = {name: run.history[name] for name in ("t", "iterations")}
    for less in (replace(run, contact=None), replace(run, history=arrayless)):
        with pytest.raises(InputError, match="run in space"):
            plot_faces(less, tmp_path / "none.png")
        with pytest.raises(InputError, match="no frames in"):
            plot_deformed(less, tmp_path / "none.png")


def test_deformed_bodies(runs: Any, figures: list[Any], tmp_path: Path) -> None:
    """The outside of both bodies, displaced as the title tells, coloured by the stress of the cells
    behind it."""
    run, frames = runs["hexahedra"], read_frames(runs["hexahedra"])
    plot_deformed(run, tmp_path / "bodies.png", times=[0.0, 0.0205], magnified=7.0, title="Blocks")
    assert figures[0]._suptitle.get_text() == "Blocks (displacements x 7)"
    assert [axis.get_title() for axis in figures[0].axes[:2]] == ["t = 0 s", "t = 0.021 s"]
    sides, cells = frames.boundary
    _, u, stress = frames.at(0.021)
    axis, bar = figures[0].axes[1:]
    (drawn,) = axis.collections
    assert drawn.given_corners == pytest.approx((frames.points + 7.0 * u)[sides], abs=1e-12)
    assert "von Mises stress [kPa]" in bar.get_ylabel()
    most = float(np.percentile(np.array([frames.at(t)[2] for t in (0.0, 0.021)])[:, cells], 99.0))
    from matplotlib import colormaps

    colours = drawn._facecolor3d[:, :3] / colormaps["YlGnBu"](stress[cells] / most)[:, :3]
    assert (
        np.ptp(colours, axis=1) == pytest.approx(0.0, abs=1e-12)
        and 0.59 < colours.min() < colours.max() < 1.01
    )
    assert len(np.unique(drawn._edgecolor3d, axis=0)) == 2  # bodies
    low, high = np.array([getattr(axis, f"get_{letter}lim")() for letter in "xyz"]).T
    assert axis._box_aspect / axis._box_aspect[0] == pytest.approx((high - low) / (high - low)[0])


def test_edges_of_fine_meshes_in_space(
    runs: Any, figures: list[Any], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """A mesh that counts as fine is drawn, and each of its edges has the colour of its polygon."""
    monkeypatch.setattr(bodies, "FINE", 1)
    plot_deformed(runs["hexahedra"], tmp_path / "fine.png", times=[0.021], title="Blocks")
    (drawn,) = figures[0].axes[0].collections
    assert np.array_equal(drawn._edgecolor3d, drawn._facecolor3d)
    assert (tmp_path / "fine.png").stat().st_size > 0


def test_points_that_pull() -> None:
    """Held points may pull: then zero is in the middle of the colours, else at their end, where it
    alone is white."""
    pulling, pushing = (
        Painter.of_pressure(1.0e3 * np.array(values)) for values in ((-2.0, 1.0), (0.0, 1.0))
    )
    assert pulling.label == "contact pressure [kPa], negative: pull"
    assert np.asarray(pulling.norm([-2.0, 0.0, 2.0])) == pytest.approx([0.0, 0.5, 1.0])
    assert np.asarray(pushing.norm([0.0, 0.25, 1.0])) == pytest.approx([0.0, 0.5, 1.0])
    assert np.all(pushing.map_colours(np.array([0.0, 0.1, 1.0e3])) == 1.0, axis=1).tolist() == [
        True,
        False,
        False,
    ]


def test_moments() -> None:
    """When most happens: the largest uplift, or pressure where all was open at the start, or
    displacement."""
    t = np.arange(4.0)
    uplift, pressure, u = np.array(
        [[0.0, 0.1, 0.5, 0.2], [np.nan, 3.0, 1.0, 2.0], [0.0, 1.0, 2.0, -3.0]]
    )
    for less, column, when in (((), "contact_uplift", 2.0), ((1.0,), "contact_max_pressure", 1.0)):
        history = {
            "t": t,
            "contact_uplift": np.append(less, uplift)[:4],
            "contact_max_pressure": pressure,
            "u_x_a": u,
        }
        assert find_leading_column(history) == (column, when) and choose_times(history) == [
            0.0,
            when,
            3.0,
        ]
    assert choose_times({"t": t, "u_x_top": u}) == [0.0, 3.0, 3.0]
    assert choose_times({"t": t, "iterations": np.zeros(4)}) == [0.0, 0.0, 3.0]


def test_all_pictures_of_a_run(
    runs: Any, figures: list[Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What ``vi-contact report`` draws; the frames of the film move."""
    from PIL import Image

    run = runs["hexahedra"]
    drawn = bodies.draw_run(run, tmp_path, title="Blocks")
    assert [path.name for path in drawn] == ["deformed.png", "faces.png"]
    with plain_pictures():
        film(run, tmp_path / "film.gif", times=[0.012, 0.021, 0.03], title="Blocks")
    shown = sorted(set(choose_times(run.history)))
    assert [axis.get_title() for axis in figures[1].axes[: len(shown)]] == [
        f"face towards -y, t = {t:.4g} s" for t in shown
    ]
    with Image.open(tmp_path / "film.gif") as moving:
        assert moving.n_frames == 3
        shots = []
        for k in range(3):
            moving.seek(k)
            shots.append(np.asarray(moving.convert("L"), dtype=float))
    assert min(np.mean(np.abs(one - two)) for one, two in zip(shots, shots[1:], strict=False)) > 0.2


def test_films_and_what_is_no_film(
    runs: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A film of bodies whose contact was not recorded; other files, columns and damaged folders in
    one sentence."""
    run = runs["tetrahedra"]
    with plain_pictures():
        assert (
            film(replace(run, contact=None), tmp_path / "film.gif", times=[0.03]).stat().st_size
            > 5000
        )
    with pytest.raises(InputError, match=r"'film\.avi' is not a .gif or .mp4"):
        film(run, tmp_path / "film.avi")
    monkeypatch.setattr("matplotlib.animation.FFMpegWriter.isAvailable", lambda: False)
    with pytest.raises(InputError, match="needs ffmpeg"):
        film(run, tmp_path / "film.mp4")
    for times, words in (([], "times is empty"), (["soon"], "times is .*give real numbers")):
        for draw in (plot_faces, plot_deformed, film):
            with pytest.raises(InputError, match=words):
                draw(run, tmp_path / "none.gif", times=times)
    with pytest.raises(InputError, match="magnified is -1"):
        plot_deformed(run, tmp_path / "none.png", magnified=-1.0)
    with pytest.raises(InputError, match="no column 'nosuch'"):
        film(run, tmp_path / "film.gif", column="nosuch")
    shutil.copytree(run.folder, tmp_path / "copy")
    copy = read_run(tmp_path / "copy")
    (copy.folder / "fields" / "frame_000030.h5").write_bytes(b"no frame")
    with pytest.raises(InputError, match=r"frame_000030\.h5' is missing or damaged"):
        plot_deformed(copy, tmp_path / "none.png")
    (copy.folder / "fields" / "mesh.h5").unlink()
    with pytest.raises(InputError, match=r"mesh\.h5' is missing or damaged"):
        plot_faces(copy, tmp_path / "none.png")


def test_a_film_of_ffmpeg(runs: Any, tmp_path: Path) -> None:
    if shutil.which("ffmpeg") is None:
        pytest.skip("no ffmpeg here: apt-get install ffmpeg brings it")
    found = film(
        runs["hexahedra"], tmp_path / "film.mp4", times=[0.012, 0.03], title="A long title " * 9
    ).read_bytes()
    assert found[4:8] == b"ftyp" and len(found) > 3_000


def test_rendering(runs: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """What a stand-in for pyvista gets: both bodies displaced with the stress of every side, the
    contact face with its pressures; without pyvista one sentence."""
    run, frames, calls = runs["tetrahedra"], read_frames(runs["tetrahedra"]), []

    class PolyData:
        def __init__(self, points: Any, faces: Any) -> None:
            self.points, self.faces, self.cell_data, self.point_data = (
                points,
                faces.reshape(-1, 4),
                {},
                {},
            )

    class Plotter:
        def __init__(self, off_screen: bool) -> None:
            assert off_screen

        def __getattr__(self, name: str) -> Any:
            return lambda *data, **look: calls.append((name, *data))

    monkeypatch.setitem(sys.modules, "pyvista", SimpleNamespace(PolyData=PolyData, Plotter=Plotter))
    assert (
        render_deformed(run, tmp_path / "bodies.png", t=0.0205, magnified=3.0)
        == tmp_path / "bodies.png"
    )
    (_, skin), (_, face) = (call for call in calls if call[0] == "add_mesh")
    assert [call[0] for call in calls[-2:]] == ["screenshot", "close"]
    assert ("add_text", "t = 0.021 s, displacements x 3") in calls
    _, u, stress = frames.at(0.021)
    sides, cells = frames.boundary
    moved = frames.points + 3.0 * u
    assert np.all(skin.faces[:, 0] == 3) and np.array_equal(
        skin.points[skin.faces[:, 1:]], moved[sides]
    )
    assert np.array_equal(skin.cell_data["von Mises stress [Pa]"], stress[cells])
    facing, nodes = frames.facing(run.contact)
    assert np.array_equal(face.points, moved[nodes]) and np.array_equal(face.faces[:, 1:], facing)
    assert np.array_equal(face.point_data["contact pressure [Pa]"], run.history["pressure"][21])
    monkeypatch.setitem(sys.modules, "pyvista", None)
    with pytest.raises(InputError, match="needs pyvista"):
        render_deformed(run, tmp_path / "none.png", t=0.0)


@pytest.mark.parametrize(
    "high", [(0.5, 6.0), (0.1, 6.0), (2.0, 6.0), (4.0, 6.0), (6.0, 0.5), (1.3, 1.0)]
)
def test_numbers_on_slender_panels_do_not_overlap(high: tuple[float, float]) -> None:
    """In panels of the size of plot_deformed, with the body displaced to negative x; some numbers
    are left."""
    figure, axes = faces.sheet([True], 1, (4.2, 3.8))
    axis = axes[0, 0]
    faces.set_limits(axis, np.array([-0.6 * high[0], 0.0]), np.array(high), margin=0.03)
    figure.draw_without_rendering()
    for line, side in ((axis.xaxis, 0), (axis.yaxis, 1)):
        low, top = line.get_view_interval()
        drawn = [
            label.get_window_extent()
            for tick, label in zip(line.get_majorticklocs(), line.get_ticklabels(), strict=True)
            if low <= tick <= top
        ]
        assert drawn and all(one.max[side] < after.min[side] for one, after in pairwise(drawn))
