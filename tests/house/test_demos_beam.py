"""The beam's demo and pictures: key numbers, every file they promise."""

from __future__ import annotations

from pathlib import Path

import pytest
from demo_runs import demo
from kept_figures import keep_figures
from pictures import is_drawn

from demos.parts.pictures import beam as plotting_beam
from vi_contact import beam
from vi_contact.beam.published import published_start

pytestmark = pytest.mark.serial


@pytest.mark.slow
def test_the_timoshenko_beam_demo(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """V6.1's invariants for every reading, two routes to the exact law, order 1 in eps, figures 8.1
    to 8.9."""
    numbers = demo("timoshenko_beam").main(quick=True, out=tmp_path, progress=False)
    for case in (
        f"a2 {viscosity} {name}" for viscosity in ("0.001", "2") for name in ("none", "A", "B", "C")
    ):
        assert numbers[f"{case}: defect"] <= 1e-8 and numbers[f"{case}: largest rise"] < 0.0
        assert 0.0 < numbers[f"{case}: energy"] < 20.8396
    assert numbers["routes apart"] <= 1e-10 and numbers["order in eps"] == pytest.approx(
        1.0, abs=0.1
    )
    assert numbers["rubbing certificate"] <= 1e-9 and numbers["rubbing defect"] <= 1e-10
    assert numbers["friction loss"] == pytest.approx(9.4, abs=0.3)
    figures = sorted(path.name for path in tmp_path.glob("*.png"))
    assert figures == sorted(
        [
            "fig_8_1_energy.png",
            "fig_8_2_tip.png",
            "fig_8_3_tip.png",
            *(f"fig_8_{k}_shapes.png" for k in range(4, 10)),
            "regularisation.png",
            "rod_and_beam.png",
        ]
    )
    assert all(is_drawn(tmp_path / name) for name in figures)
    printed = capsys.readouterr().out
    assert "of 200 steps stick; two routes differ by" in printed and "eps = 1e-06 m" in printed


def test_every_axis_has_a_label(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Quantity and unit; curves in every panel."""
    seen = keep_figures(monkeypatch, plotting_beam)
    stepper = beam.BeamStepper(
        beam.TimoshenkoBeam(), beam.Elements(10), 0.01, lambda t: 5.0, lambda t, rate: 0.2
    )
    run = beam.run_beam(stepper, published_start(), steps=40, every=4)
    plotting_beam.plot_beam_energies({"one": run}, tmp_path / "energy.png", title="Energy")
    plotting_beam.plot_tips({"one": run, "two": run}, tmp_path / "tips.png", title="Tips")
    plotting_beam.plot_shapes(
        run, tmp_path / "shapes.png", span=(0.1, 0.3), title="Shapes", count=4
    )
    energy, tips, shapes = seen
    for figure in (energy, tips):
        assert all("[" in axis.get_ylabel() and axis.lines for axis in figure.axes)
        assert figure.axes[-1].get_xlabel() == "time [s]"
    assert all("[" in axis.get_title() for axis in shapes.axes[:4])
    assert all(axis.get_xlabel() == "x [m]" for axis in shapes.axes[4:])
    assert all(len(axis.lines) == 4 for axis in shapes.axes)
    times = [float(text.get_text().split()[2]) for text in shapes.axes[3].get_legend().get_texts()]
    assert times == pytest.approx([0.12, 0.16, 0.24, 0.28])
