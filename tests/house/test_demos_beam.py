"""The beam's demo, command and pictures: key numbers, every file they promise, one sentence for bad input."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from demo_runs import demo
from kept_figures import keep_figures

from vi_contact import beam, cli
from vi_contact.studies.cases.beam_study import BeamStudy, read_beam_run

pytestmark = pytest.mark.serial
ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.slow
def test_the_timoshenko_beam_demo(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """V6.1's invariants for every reading, two routes to the exact law, order 1 in eps, figures 8.1 to 8.9."""
    numbers = demo("timoshenko_beam").main(quick=True, out=tmp_path, progress=False)
    for case in (f"a2 {viscosity} {name}" for viscosity in ("0.001", "2") for name in ("none", "A", "B", "C")):
        assert numbers[f"{case}: defect"] <= 1e-8 and numbers[f"{case}: largest rise"] < 0.0
        assert 0.0 < numbers[f"{case}: energy"] < 20.8396
    assert numbers["routes apart"] <= 1e-10 and numbers["order in eps"] == pytest.approx(1.0, abs=0.1)
    assert numbers["rubbing certificate"] <= 1e-9 and numbers["rubbing defect"] <= 1e-10
    assert numbers["friction loss"] == pytest.approx(9.4, abs=0.3)
    figures = sorted(path.name for path in tmp_path.glob("*.png"))
    assert figures == sorted([
        "fig_8_1_energy.png", "fig_8_2_and_8_3_tip.png", *(f"fig_8_{k}_shapes.png" for k in range(4, 10)),
        "regularisation.png", "rod_and_beam.png",
    ])
    assert all((tmp_path / name).stat().st_size > 20_000 for name in figures)
    printed = capsys.readouterr().out
    assert "of 200 steps stick; two routes differ by" in printed and "eps = 1e-06 m" in printed


def test_every_axis_has_a_label(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Quantity and unit; curves in every panel."""
    from vi_contact.plots import studies as plotting_beam

    seen = keep_figures(monkeypatch, plotting_beam)
    stepper = beam.BeamStepper(beam.TimoshenkoBeam(), beam.Elements(10), 0.01, lambda t: 5.0, lambda t, rate: 0.2)
    run = beam.run_beam(stepper, beam.published_start(), steps=40, every=4)
    plotting_beam.plot_beam_energies({"one": run}, tmp_path / "energy.png", title="Energy")
    plotting_beam.plot_tips({"one": run, "two": run}, tmp_path / "tips.png", title="Tips")
    plotting_beam.plot_shapes(run, tmp_path / "shapes.png", span=(0.1, 0.3), title="Shapes", count=4)
    energy, tips, shapes = seen
    for figure in (energy, tips):
        assert all("[" in axis.get_ylabel() and axis.lines for axis in figure.axes)
        assert figure.axes[-1].get_xlabel() == "time [s]"
    assert all("[" in axis.get_title() for axis in shapes.axes[:4])
    assert all(axis.get_xlabel() == "x [m]" for axis in shapes.axes[4:])
    assert all(len(axis.lines) == 4 for axis in shapes.axes)
    times = [float(text.get_text().split()[2]) for text in shapes.axes[3].get_legend().get_texts()]
    assert times == pytest.approx([0.12, 0.16, 0.24, 0.28])


def rows(folder: Path) -> dict[str, np.ndarray]:
    """history.csv by columns."""
    table = np.genfromtxt(folder / "history.csv", delimiter=",", names=True)
    assert table.dtype.names is not None
    return {name: table[name] for name in table.dtype.names}


def words(settings: str) -> list[str]:
    """The arguments --set beam.KEY=VALUE."""
    return [word for setting in settings.split() for word in ("--set", f"beam.{setting}")]


def test_the_command(tmp_path: Path) -> None:
    """By default the published data with reading C: V6.1's energy at t = 0.02 in ten steps; the report's pictures."""
    command = [sys.executable, "-m", "vi_contact"]
    environment = dict(os.environ) | {"PYTHONPATH": str(ROOT)}
    for arguments in (["run", "beam", *words("t_end=0.02"), "--out", "run"], ["report", "run"]):
        done = subprocess.run(
            [*command, *arguments], cwd=tmp_path, capture_output=True, text=True, check=False, env=environment
        )
        assert (done.returncode, done.stderr) == (0, "")
        if arguments[0] == "run":
            assert "10 steps, t = 0 to 0.02 s" in done.stdout and "20.1243 J at the end" in done.stdout
    history = rows(tmp_path / "run")
    assert history["energy_kinetic"][-1] + history["energy_strain"][-1] == pytest.approx(20.1243, abs=5e-5)
    for name in ("energy.png", "tip.png", "shapes.png"):
        assert (tmp_path / "run" / name).stat().st_size > 10_000


def test_the_folder_holds_the_run(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """What is read back is what was computed, to the last bit; a damaged file is told in a sentence."""
    given = words("elements=20 t_end=0.1 force=100 mu=0.3")
    assert cli.main(["run", "beam", *given, "--dt", "0.01", "--out", str(tmp_path)]) == 0
    study = BeamStudy(elements=20, t_end=0.1, force=100.0, mu=0.3, dt=0.01)
    expected, found = beam.run_beam(study.stepper, beam.published_start(), steps=10, every=1), read_beam_run(tmp_path)
    assert list(found.history) == list(expected.history) and np.array_equal(found.x, expected.x)
    assert all(np.array_equal(found.history[name], expected.history[name]) for name in expected.history)
    assert [one.t for one in found.snapshots] == [one.t for one in expected.snapshots]
    assert all(np.array_equal(a.values, b.values)
               for a, b in zip(found.snapshots, expected.snapshots, strict=True))
    (tmp_path / "shapes.npz").write_bytes(b"PK")
    capsys.readouterr()
    assert cli.main(["report", str(tmp_path)]) == 1
    assert "is missing or damaged" in capsys.readouterr().err


def test_the_command_with_a_rod(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The rod's own force: nothing rubs before it touches, the exact law sticks and slips afterwards."""
    given = words("rod=20 gap=0.05 mu=0.3 elements=50 dt=0.005 t_end=1 exact=true free_end=true")
    assert cli.main(["run", "beam", *given, "--out", str(tmp_path)]) == 0
    assert "Newton updates per step 0, at most 0" in capsys.readouterr().out
    history = rows(tmp_path)
    touching = history["normal_force"] > 0.0
    assert not touching[:10].any() and touching.mean() > 0.8 and not history["friction_force"][~touching].any()
    assert np.all(np.abs(history["friction_force"]) <= 0.3 * history["normal_force"] * (1.0 + 1e-12))
    assert np.any(history["slip"][touching] == 0.0) and np.any(history["slip"][touching] != 0.0)


BAD = {
    "reading=X": "unknown reading 'X': choose one of none, A, B, C",
    "force=-3": "normal_force(0 s) is -3.0; give",
    "force=3 rod=4": "force and rod are normal forces: give one of them",
    "mu=-0.1": "mu(0 s, 5 m/s) is -0.1; give",
    "eps=0": "eps is 0.0; give a finite number above zero",
    "elements=1": "count is 1; give a whole number",
    "dt=0": "dt is 0 s and t_end 2 s: give 0 < dt <= t_end",
    "viscosity=-1": "viscosity is -1.0; give zero",
    "rod=20 gap=-1": "gap is -1.0; give zero",
    "width=1": "unknown key 'width' for BeamStudy",
}


@pytest.mark.parametrize("settings", BAD)
def test_bad_input_is_one_sentence(tmp_path: Path, capsys: pytest.CaptureFixture[str], settings: str) -> None:
    """Exit status 1 and the sentence."""
    assert cli.main(["run", "beam", *words(settings), "--out", str(tmp_path)]) == 1
    told = capsys.readouterr().err
    assert told.startswith("vi-contact: ") and told.count("\n") == 1 and BAD[settings] in told
