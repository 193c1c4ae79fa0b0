"""Pictures: every axis labelled, every file written, extreme histories drawn without warnings."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from contextlib import nullcontext
from typing import Any

import numpy as np
import pytest
from kept_figures import keep_figures
from plain_pictures import plain_pictures

from demos.parts.pictures import histories as plotting

pytestmark = pytest.mark.serial
pytest.importorskip("matplotlib")


def history(n: int = 401, m: int = 11) -> dict[str, Any]:
    """A synthetic run like the wall's: 400 steps, m contact points, energies in joules."""
    t = np.linspace(0.0, 0.7, n)
    wave = np.sin(2.0 * np.pi * 14.0 * t)
    push = np.maximum(wave, 0.0)
    share = np.linspace(0.2, 1.0, m)
    pressure = np.maximum(push[:, None] - share[::-1] / 2.0, 0.0) * 3e5
    found = {"t": t, "a_g_x": wave, "a_g_y": np.zeros(n), "pressure": pressure}
    found["contact_uplift"] = np.mean(pressure == 0.0, axis=1)
    found |= {
        f"u_x_{label}": -(i + 1) * 2e-5 * np.maximum(-wave, -0.1 * i)
        for i, label in enumerate(("4", "6", "12"))
    }
    found["work_input"] = 2e3 * np.cumsum(push) / n
    found["energy_kinetic"] = 400.0 * wave**2
    found["energy_strain"] = 400.0 * (1.0 - wave**2)
    found["loss_contact"] = 0.6 * found["work_input"]
    found["loss_impact"] = 0.3 * found["work_input"]
    found["loss_damping"] = np.zeros(n)
    found["loss_algorithmic"] = np.zeros(n)
    found["energy_defect"] = 1e-13 * np.cumsum(wave)
    found["certificate"] = 1e-15 * (1.5 + wave)
    found["iterations"] = np.round(2.0 + wave)
    return found


@pytest.fixture
def figures(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The figures that were saved, kept open to be looked into."""
    return keep_figures(monkeypatch, plotting)


@pytest.fixture
def plain() -> Iterator[None]:
    """What is asked of the figures does not depend on how they are arranged."""
    with plain_pictures():
        yield


DRAW = {
    "points": lambda h, path: plotting.plot_points(
        h, ["4", "6", "12"], path, title="Wall", unilateral=["4"], reference=h
    ),
    "excitation": plotting.plot_excitation,
    "energy": plotting.plot_energy,
    "certificate": plotting.plot_certificate,
    "contact": lambda h, path: plotting.plot_contact(h, path, position=np.linspace(0.75, 8.25, 11)),
}
# the colour bar is an axis too
PANELS = {"points": 3, "excitation": 1, "energy": 2, "certificate": 2, "contact": 3}


@pytest.mark.parametrize("name", DRAW)
def test_every_picture_is_written_and_every_axis_labelled(name, tmp_path, figures):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        path = DRAW[name](history(), tmp_path / f"{name}.png")
    assert path == tmp_path / f"{name}.png"
    assert path.read_bytes()[:8] == b"\x89PNG\r\n\x1a\n" and path.stat().st_size > 10_000
    axes = figures[0].axes
    assert len(axes) == PANELS[name]
    assert all(axis.get_ylabel() for axis in axes)
    # shared by the panels above
    assert axes[len(axes) - 1 - (name == "contact")].get_xlabel() == "time [s]"
    assert all("[" in axis.get_ylabel() for axis in axes)  # with its unit
    assert figures[0]._suptitle if name == "points" else axes[0].get_title()


def lines(axis: Any) -> dict[str, np.ndarray]:
    return {line.get_label(): line.get_ydata() for line in axis.lines}


def test_displacements_are_drawn_in_a_readable_unit(plain, tmp_path, figures):
    """6e-5 m at most: micrometres, the same scale in every panel; bound at zero for contact points
    only."""
    h = history()
    plotting.plot_points(h, ["4", "6", "12"], tmp_path / "p.png", title="Wall", unilateral=["4"])
    axes = figures[0].axes
    assert axes[0].get_ylabel() == "$u_x$ [µm]"
    for axis, label in zip(axes, ("4", "6", "12"), strict=True):
        np.testing.assert_allclose(lines(axis)["with contact"], 1e6 * h[f"u_x_{label}"], rtol=1e-12)
        assert len(axis.lines) == (2 if label == "4" else 1)
        assert ("contact point" in axis.get_title(loc="left")) == (label == "4")


def test_energy_terms_share_one_unit(plain, tmp_path, figures):
    h = history()
    plotting.plot_energy(h, tmp_path / "e.png")
    top, bottom = figures[0].axes
    assert "[J]" in top.get_ylabel()
    # the others are zero
    assert set(lines(top)) == {"input work", "kinetic", "strain", "contact work", "impact loss"}
    np.testing.assert_allclose(lines(top)["kinetic"], h["energy_kinetic"])
    assert bottom.get_yscale() == "log"
    for name in [name for name in h if name.startswith(("energy", "loss", "work"))]:
        h[name] = 1e6 * h[name]
    plotting.plot_energy(h, tmp_path / "e.png")
    assert "[MJ]" in figures[1].axes[0].get_ylabel()
    np.testing.assert_allclose(lines(figures[1].axes[0])["kinetic"], h["energy_kinetic"] / 1e6)


def test_length_unit():
    sizes = {
        2.0: "m",
        1.0: "m",
        0.5: "mm",
        2e-3: "mm",
        9e-5: "µm",
        3e-8: "nm",
        1e-12: "nm",
        0.0: "m",
    }
    assert {size: plotting.length_unit(size)[1] for size in sizes} == sizes


def test_nothing_happened(tmp_path):
    """All zeros, and a single step: drawn without a warning; the many zeros without the care for
    how they look."""
    for n in (2, 401):
        h = {name: np.zeros_like(values) for name, values in history(n).items()} | {
            "t": np.linspace(0.0, 1.0, n)
        }
        with warnings.catch_warnings(), plain_pictures() if n > 2 else nullcontext():
            warnings.simplefilter("error")
            for name, draw in DRAW.items():
                assert draw(h, tmp_path / f"{name}.png").stat().st_size > 1000


def test_one_contact_point_is_visible(plain, tmp_path, figures):
    """A map of one row has a height."""
    plotting.plot_contact(history(m=1), tmp_path / "c.png", position=np.array([4.0]))
    mesh = figures[0].axes[0].collections[0]
    corners = mesh.get_coordinates()
    assert corners.shape[0] == 2 and np.ptp(corners[:, :, 1]) > 0.0


def test_held_points_that_pull_are_not_called_open(plain, tmp_path, figures):
    h = history()
    h["pressure"] -= 1e5
    plotting.plot_contact(h, tmp_path / "c.png", position=np.linspace(0.75, 8.25, 11))
    low, high = figures[0].axes[0].collections[0].get_clim()
    assert low == -high == -np.abs(h["pressure"]).max() / 1e3
    assert "negative: pull" in figures[0].axes[-1].get_ylabel()


def test_the_users_matplotlib_is_left_alone(tmp_path):
    import matplotlib

    before = dict(matplotlib.rcParams), matplotlib.get_backend()
    plotting.plot_energy(history(), tmp_path / "e.png")
    assert (dict(matplotlib.rcParams), matplotlib.get_backend()) == before


def test_contact_map_is_sorted_by_position(plain, tmp_path, figures):
    h = history()
    plotting.plot_contact(h, tmp_path / "c.png", position=np.linspace(8.25, 0.75, 11))
    drawn = np.asarray(figures[0].axes[0].collections[0].get_array()).reshape(11, 401)
    np.testing.assert_allclose(drawn, h["pressure"][:, ::-1].T / 1e3)
    assert "[kPa]" in figures[0].axes[-1].get_ylabel()
