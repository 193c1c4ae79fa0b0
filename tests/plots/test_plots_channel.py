"""Pictures of the buried channel, drawn from a small run: what they show is what was recorded
(V4.2)."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from kept_figures import keep_figures
from plain_pictures import plain_pictures

import vi_contact as vc
from demos.parts.pictures import channel as own_pictures
from demos.parts.pictures import channel_interface as pictures
from demos.parts.pictures.channel import plot_beside, plot_layout, plot_moments
from demos.parts.pictures.channel_interface import (
    SHOWN,
    Outline,
    opening,
    plot_envelope,
    plot_interface,
    plot_openings,
    plot_rocking,
)
from demos.parts.pictures.channel_mesh import animate, read_bodies
from demos.parts.pictures.histories import draw_histories
from demos.parts.problems.channel import Channel, ChannelModel, build
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.meshes.channel import ChannelMesh
from vi_contact.plots.bodies import draw_run, film
from vi_contact.run.files.reading import read_run
from vi_contact.run.static import static_equilibrium

pytestmark = pytest.mark.serial
pytest.importorskip("matplotlib")
STEPS = 24
SHAPE = ChannelMesh(width=12.0, depth=6.0, size=1.0)


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> tuple[ChannelModel, Any, Path]:
    """(model, history, folder) of a coarse channel in its weight, shaken until its walls have
    opened."""
    from mpi4py import MPI

    model = build(Channel(SHAPE), MPI.COMM_WORLD)
    folder = tmp_path_factory.mktemp("channel")
    problem = model.problem(excitation=model.channel.harmonic(4.0))
    state = static_equilibrium(problem, solver=vc.Condensed())
    history = vc.simulate(
        problem,
        scheme=vc.ZienkiewiczWoodTaylor(phi=0.5),
        dt=1.0 / 80.0,
        steps=STEPS,
        state=state,
        record=model.recorders(),
        fields=fem.XDMF(every=4),
        out=folder,
        progress=False,
    ).history
    assert min(float(history[f"opening_{side}"].max()) for side in ("left", "right")) > 1e-5
    return model, history, folder


@pytest.fixture
def figures(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The figures that were saved, kept open to be looked into."""
    return keep_figures(monkeypatch, pictures, own_pictures)


def outline(model: ChannelModel) -> Outline:
    return Outline.of(model.surface.points, model.surface.normals)


def check(path: Path, figure: Any) -> None:
    """Written; no panel empty; every axis with ticks has a label, every quantity its unit."""
    assert path.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n" and path.stat().st_size > 10_000
    for axis in figure.axes:
        assert axis.has_data() or axis.get_label() == "<colorbar>"
        own = [axis.get_ylabel(), axis.get_xlabel()]
        shared = [
            text.get_text() for text in (figure._supxlabel, figure._supylabel) if text is not None
        ]
        assert any("[" in label for label in own + shared)


def test_the_outline_runs_down_along_and_up(run: Any) -> None:
    """Left wall 0 to 3 m, base to 7 m, right wall to 10 m; conditions at a corner in the order of
    their sides."""
    model, _, _ = run
    found = outline(model)
    places = dict(
        zip(
            model.sides,
            (model.surface.points[mask].T for mask in model.sides.values()),
            strict=True,
        )
    )
    x, y = SHAPE.x, SHAPE.y
    for side, arc in (
        ("left", y[3] - places["left"][1]),
        ("base", 3.0 + places["base"][0] - x[1]),
        ("right", 7.0 + places["right"][1] - y[1]),
    ):
        np.testing.assert_allclose(found.arc[model.sides[side]], arc, atol=1e-12)
    for name, side in (("left wall", "left"), ("base", "base"), ("right wall", "right")):
        assert np.array_equal(found.sides[name], model.sides[side])
    assert [name for name, _ in found.along()] == ["left wall", "base", "right wall"]
    assert found.corners() == pytest.approx([3.0, 7.0])
    order = np.argsort(found.places())
    names = [name for i in order for name, mask in found.sides.items() if mask[i]]
    assert names == [name for name, one in found.along() for _ in one] and names.count("base") == 6
    assert order.tolist() == np.concatenate([one for _, one in found.along()]).tolist()
    assert np.all(np.diff(found.places()[order]) > 0.0)


def test_openings_are_the_gaps_of_the_contact(run: Any, tmp_path: Path, figures: list[Any]) -> None:
    """V4.2, Fig. 7: at every point and normal the gap that Contact() records; drawn in
    millimetres."""
    model, history, _ = run
    gaps, compared = np.reshape(history["gap"], (STEPS + 1, -1)), 0
    for label, normal in [
        (label, normal) for row in SHOWN.values() for label, normal in row.items()
    ]:
        at = np.linalg.norm(model.surface.points - model.channel.point(int(label)), axis=1)
        facing = model.surface.normals @ normal > 0.5
        here = int(np.argmin(np.where(facing, at, np.inf)))
        if at[here] > 1e-9:
            continue  # the middle of a coarse wall is no node
        np.testing.assert_allclose(opening(history, label, normal), gaps[:, here], atol=1e-15)
        compared += 1
    assert compared == 6  # tops, feet, and the corners of the base
    path = plot_openings(history, tmp_path / "openings.png", title="Openings")
    check(path, figures[0])
    assert len(figures[0].axes) == 1 + len(SHOWN)
    top = {line.get_label(): line.get_ydata() for line in figures[0].axes[1].lines}
    np.testing.assert_allclose(top["point 19"], 1e3 * opening(history, "19", (-1.0, 0.0)))
    with pytest.raises(InputError, match="u_x_2"):
        opening(history, "2", (0.0, -1.0))


def test_rocking_and_runs_beside_each_other(run: Any, tmp_path: Path, figures: list[Any]) -> None:
    """V4.2, Figs. 8 and 9: the parts of u_y add up; the reference is drawn below the others."""
    history = run[1]
    check(plot_rocking(history, tmp_path / "rocking.png", title="Rocking"), figures[0])
    curves = [line.get_ydata() for axis in figures[0].axes for line in axis.lines]
    (left, right, static, rocking, common) = curves
    np.testing.assert_allclose(rocking + common + static[0], right, atol=1e-9)
    np.testing.assert_allclose(common + static[0] - rocking, left, atol=1e-9)
    check(
        plot_beside({"a": history, "b": history}, "b", tmp_path / "beside.png", title="Two runs"),
        figures[1],
    )
    assert len(figures[1].axes) == 4
    assert [line.get_label() for line in figures[1].axes[0].lines] == ["b", "a"]


def test_maps_and_envelopes(run: Any, tmp_path: Path, figures: list[Any]) -> None:
    """Where a map shows an opening it shows no pressure, and one of them everywhere; envelopes
    reach the extremes."""
    model, history, _ = run
    runs = {"one": history, "two": history}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check(plot_interface(runs, outline(model), tmp_path / "map.png", title="Map"), figures[0])
        check(
            plot_envelope(runs, outline(model), tmp_path / "envelope.png", title="Envelope"),
            figures[1],
        )
    gap, pressure = (
        np.ma.filled(image.get_array(), np.nan) for image in figures[0].axes[0].collections[:2]
    )
    assert gap.size == model.surface.count * (STEPS + 1)
    assert np.all(np.isfinite(gap) != np.isfinite(pressure)) and np.isfinite(gap).any()
    assert np.nanmax(gap) == pytest.approx(1e3 * np.max(history["gap"]))
    drawn = [line.get_ydata() for line in figures[1].axes[0].lines if line.get_marker() == "."]
    assert max(float(values.max()) for values in drawn) == pytest.approx(
        1e-3 * np.max(history["pressure"])
    )


def test_layout_and_moments(run: Any, tmp_path: Path, figures: list[Any]) -> None:
    """V4.2, Fig. 6: all cells, each in its body; 19 numbers; moments name the frames' own times."""
    model, _, folder = run
    bodies = read_bodies(folder)
    sizes = np.ptp(bodies.frames.points[bodies.frames.cells[bodies.cells]], axis=1)
    assert np.sum(np.prod(sizes, axis=1)) == pytest.approx(4.0 * 3.0 - 3.0 * 2.5)  # m² of concrete
    np.testing.assert_allclose(bodies.frames.points[bodies.nodes], model.surface.points, atol=1e-12)
    points = {str(number): model.channel.point(number) for number in range(1, 20)}
    path = plot_layout(
        folder,
        points,
        tmp_path / "layout.png",
        title="Layout",
        soil="soil",
        concrete="c",
        ends="ends",
    )
    check(path, figures[0])
    assert {text.get_text() for text in figures[0].axes[0].texts} >= set(points)
    path = plot_moments(
        {"one": folder, "two": folder},
        (0.1, 0.21),
        tmp_path / "moments.png",
        title="Moments",
        magnified=300.0,
    )
    check(path, figures[1])
    assert figures[1].axes[1].get_title() == "one, t = 0.2 s"


def test_the_film(run: Any, tmp_path: Path) -> None:
    """A GIF with a frame per time, which move; another kind of file is refused in one sentence."""
    from PIL import Image

    _, history, folder = run
    arguments: dict[str, Any] = {
        "title": "film",
        "magnified": 300.0,
        "history": history,
        "times": (0.05, 0.15, 0.2),
        "openings": {"top": opening(history, "19", (-1.0, 0.0))},
    }
    path = animate(folder, tmp_path / "channel.gif", **arguments)
    with Image.open(path) as moving:
        assert moving.n_frames == 3 and path.stat().st_size < 500_000
        shots = []
        for k in range(3):
            moving.seek(k)
            shots.append(np.asarray(moving.convert("L"), dtype=float))
    assert min(np.mean(np.abs(one - two)) for one, two in zip(shots, shots[1:], strict=False)) > 0.5
    with pytest.raises(InputError, match=r"'film\.mp4'"):
        animate(folder, tmp_path / "film.mp4", **arguments)


@pytest.mark.slow
def test_pictures_of_a_plane_run_from_its_folder_alone(run: Any, tmp_path: Path) -> None:
    """What a run of the command left is enough: deformed bodies, film; histories and the map of the
    contact."""
    read = read_run(run[2])
    with plain_pictures():  # how they are arranged is seen above
        drawn = draw_run(read, tmp_path, title="Channel")
        drawn += [
            film(read, tmp_path / "film.gif"),
            *draw_histories(read.history, read.contact, tmp_path, title="$"),
        ]
    assert {path.name for path in drawn} >= {
        "deformed.png",
        "film.gif",
        "excitation.png",
        "energy.png",
        "contact.png",
    }
    assert all(path.stat().st_size > 3_000 for path in drawn)
