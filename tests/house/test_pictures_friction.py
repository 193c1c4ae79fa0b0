"""Pictures of friction: loops and maps of known histories, and of a run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from kept_figures import keep_figures
from rubbing import rubbing_block

from demos.parts.pictures import friction as plotting_friction
from demos.parts.pictures.friction import plot_hysteresis, plot_states
from vi_contact.core.errors import InputError
from vi_contact.laws.friction import Coulomb
from vi_contact.plots.deformed import contact_states
from vi_contact.run.recorders import Contact
from vi_contact.run.simulate import simulate
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed

pytestmark = pytest.mark.serial
pytest.importorskip("matplotlib")


def cycles(n: int = 401, m: int = 6) -> dict[str, Any]:
    """A block on a spring k = 2e6 N/m and a slider of 1000 N, moved to and fro by 1.5 mm; points
    open in turn."""
    t = np.linspace(0.0, 2.0, n)
    drive = 1.5e-3 * np.sin(2.0 * np.pi * t)
    slip, force = np.zeros(n), np.zeros(n)
    for i in range(1, n):
        trial = 2e6 * (drive[i] - slip[i - 1])
        force[i] = np.clip(trial, -1000.0, 1000.0)
        slip[i] = drive[i] - force[i] / 2e6
    active = np.ones((n, m), dtype=bool)
    for point in range(m):
        active[60 * point : 60 * point + 30, point] = False
    return {
        "t": t,
        "friction_force_x": -force,
        "friction_force_y": 0.1 * force,
        "slip": -np.repeat(slip[:, None], m, axis=1)[:, :, None],
        "active": active,
    }


@pytest.fixture
def figures(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """The figures that were saved, kept open to be looked into."""
    return keep_figures(monkeypatch, plotting_friction)


def test_loop_of_a_slider(figures: list[Any], tmp_path: Path) -> None:
    """±1 kN, ±1 mm; the slip is drawn with the sign that makes the area 4 kN mm a cycle (V2.7 iii's
    law)."""
    path = plot_hysteresis(cycles(), tmp_path / "loop.png")
    assert path.stat().st_size > 3_000
    (axis,) = figures[0].axes
    x, y = axis.lines[2].get_xdata(), axis.lines[2].get_ydata()
    assert axis.get_xlabel() == "mean slip [mm]" and "x [kN]" in axis.get_ylabel()
    assert np.max(np.abs(y)) == pytest.approx(1.0) and np.max(np.abs(x)) == pytest.approx(
        1.0, rel=1e-3
    )
    last = slice(200, None)
    assert np.sum(0.5 * (y[last][1:] + y[last][:-1]) * np.diff(x[last])) == pytest.approx(
        4.0, rel=1e-2
    )
    plot_hysteresis(cycles(), tmp_path / "other.png", axis="y")
    assert np.max(np.abs(figures[1].axes[0].lines[2].get_ydata())) == pytest.approx(100.0)


def test_states_of_known_slips() -> None:
    """Open where not active, slip where the slip changed by more than rounding, else stick."""
    slip = np.array([[0.0, 0.0], [1.0, 1e-12], [1.0, 0.5]])[:, :, None]
    active = np.array([[1, 1], [1, 1], [0, 1]])
    states = contact_states({"t": np.arange(3.0), "slip": slip, "active": active})
    assert states.tolist() == [[2, 2], [3, 2], [1, 3]]


def test_map_has_all_points(figures: list[Any], tmp_path: Path) -> None:
    path = plot_states(cycles(), tmp_path / "map.png", position=np.linspace(1.0, 0.0, 6))
    assert path.stat().st_size > 2_000
    (axis,) = figures[0].axes
    (mesh,) = axis.collections
    shown = np.asarray(mesh.get_array()).reshape(6, 401)
    assert set(np.unique(shown)) == {1, 2, 3} and np.array_equal(
        shown[::-1], contact_states(cycles()).T
    )
    assert [text.get_text() for text in axis.get_legend().get_texts()] == ["open", "stick", "slip"]
    assert axis.get_xlabel() == "time [s]" and axis.get_ylabel() == "position [m]"


def test_a_run(figures: list[Any], tmp_path: Path) -> None:
    """The states of a recorded run are those that the solver's steps had."""
    problem = rubbing_block(Coulomb(0.3))
    solution = simulate(
        problem,
        scheme=ZienkiewiczWoodTaylor(),
        solver=Condensed(),
        dt=0.05,
        steps=80,
        record=[Contact()],
    )
    plot_states(solution.history, tmp_path / "map.png", position=problem.surface.points[:, 1])
    plot_hysteresis(solution.history, tmp_path / "loop.png")
    assert len(figures) == 2
    states = contact_states(solution.history)
    assert set(np.unique(states)) == {1, 2, 3}
    assert np.array_equal(
        states > 1, np.asarray(solution.history["active"], dtype=bool).reshape(states.shape)
    )


def test_histories_without_friction_are_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no column slip"):
        plot_states({"t": np.zeros(2)}, tmp_path / "map.png", position=np.zeros(1))
    with pytest.raises(InputError, match="no friction_force"):
        plot_hysteresis({"t": np.zeros(2)}, tmp_path / "loop.png")
    with pytest.raises(InputError, match="along 'z', choose one of x, y"):
        plot_hysteresis(cycles(), tmp_path / "loop.png", axis="z")
