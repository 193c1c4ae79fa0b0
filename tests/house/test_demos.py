"""The demos and the command line: key numbers, every file they promise, and one sentence for bad
input."""

from __future__ import annotations

import csv
import json
import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from runpy import run_path
from typing import Any

import h5py
import numpy as np
import pytest
from demo_runs import ROOT, demo
from pictures import is_drawn

from vi_contact.practice.cli.entry import main
from vi_contact.practice.ground_motion import Record, pga, read_record

SHARED = Path(
    os.environ.get("VI_CONTACT_GROUND_MOTIONS", ROOT.parent / "shared" / "ground_motions")
)
FIGURES = ("excitation.png", "displacements_x.png", "energy.png", "certificate.png", "contact.png")
SUMMARY = (
    "versions",
    "ranks",
    "unknowns",
    "contact_points",
    "steps",
    "iterations_per_step",
    "worst_certificate",
    "cross_check",
    "energy",
    "energy_defect",
    "seconds_per_step",
    "seconds_per_linear_step",
)


def column(folder: Path, name: str) -> np.ndarray:
    """A column of history.csv."""
    with open(folder / "history.csv", encoding="utf-8", newline="") as file:
        return np.array([float(row[name]) for row in csv.DictReader(file)])


def check_folder(
    folder: Path, *, steps: int, frames_every: int, figures: Sequence[str] = FIGURES
) -> dict[str, Any]:
    """Every promised file is there and whole; returns summary.json."""
    rows = (folder / "history.csv").read_text(encoding="utf-8").splitlines()
    assert rows[0].startswith("t,") and len(rows) == steps + 2
    with h5py.File(folder / "history.h5") as file:
        assert len(file["t"]) == steps + 1 and file["pressure"].attrs["unit"] == "Pa"
    summary = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    assert [key for key in SUMMARY if key not in summary] == []
    assert summary["status"] == "finished" and summary["steps"] == steps
    assert min(summary["seconds_per_linear_step"], summary["seconds_per_step"]) > 0.0
    index = (folder / "fields.xdmf").read_text(encoding="utf-8")
    for k in range(0, steps + 1, frames_every):
        assert (
            f"fields/frame_{k:06d}.h5:/u" in index
            and (folder / f"fields/frame_{k:06d}.h5").is_file()
        )
    for figure in figures:
        assert is_drawn(folder / figure)
    assert "finished" in (folder / "run.log").read_text(encoding="utf-8")
    return summary


@pytest.mark.slow
def test_the_wall_demo(comm: Any, shared_tmp: Path) -> None:
    """V4.1 in its first 40 steps: frequency, dt, the top's displacement at steps 10, 20, 40; both
    routes agree."""
    numbers = demo("wall").main(quick=True, out=shared_tmp, progress=False)
    comm.Barrier()  # rank 0 draws
    assert numbers["frequency"] == pytest.approx(13.9983, abs=5e-5)
    assert numbers["dt"] == pytest.approx(1.785929e-3, abs=5e-10)
    assert numbers["decomposition"] < 1e-13  # u = u_1 + u_2, eq. (36)
    for name in ("data.png", "decomposition.png", "frames.png"):
        assert comm.rank or is_drawn(shared_tmp / name)
    for page in ("README.md", "docs/index.md"):  # whose first picture is frames.png
        told = f"displacements drawn {numbers.get('magnified', 0.0):g} times larger"
        assert comm.rank or told in " ".join((ROOT / page).read_text(encoding="utf-8").split()), (
            page
        )
    for case, expected in {
        "a": (-58.38955, -1.74828, -9.18182),
        "b": (-58.38955, -1.74828, 0.0),
    }.items():
        assert 0.0 < numbers[f"{case}_certificate"] <= 1e-9
        assert 0.0 < numbers[f"{case}_cross_check"] <= 1e-9
        assert numbers[f"{case}_energy_defect"] <= 1e-10
        summary = check_folder(shared_tmp / case, steps=40, frames_every=10)
        assert summary["ranks"] == comm.size and summary["unknowns"] == 216
        assert summary["contact_points"] == {"a": 3, "b": 11}[case]
        assert list(summary["cross_check"]) == ["Volume(ReducedNewton)"]
        top = 1e6 * column(shared_tmp / case, "u_x_12")
        assert top[[10, 20, 40]] == pytest.approx(expected, abs=5.001e-6)
        assert (1e6 * numbers[f"{case}_top_min"], 1e6 * numbers[f"{case}_top_max"]) == (
            top.min(),
            top.max(),
        )
        assert column(shared_tmp / case, "contact_active").max() > 0


@pytest.mark.slow
@pytest.mark.serial
def test_the_command_line_of_the_wall_demo(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """README's command: the run, both routes to every step, its report; numbers of the case that
    ships."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", ["wall.py", "--case", "b", "--out", "demo", "--steps", "9"])
    with pytest.raises(SystemExit) as ended:
        run_path(str(ROOT / "demos" / "wall.py"), run_name="__main__")
    assert ended.value.code == 0 and "cross-check Volume(ReducedNewton)" in capsys.readouterr().out
    for name in ("deformed.png", "report.pdf", "peaks.csv"):
        assert (tmp_path / "demo" / name).stat().st_size > 500, name
    assert main(["run", "wall", "--out", str(tmp_path / "run"), "--steps", "9", "--quiet"]) == 0
    assert (tmp_path / "demo" / "history.csv").read_bytes() == (
        tmp_path / "run" / "history.csv"
    ).read_bytes()


def recorded(folder: Path) -> Path:
    """El Centro 1940 where it is beside the checkout, else a record like it written here."""
    real = SHARED / "elcentro_1940_ns_peknold.at2"
    if real.is_file():
        return real
    t = 0.02 * np.arange(200)
    values = 0.3 * np.sin(7.0 * t) * np.exp(-0.5 * t) + 0.01 * np.cos(31.0 * t)
    path = folder / "record.at2"
    lines = [" ".join(f"{value:.6f}" for value in values[k : k + 5]) for k in range(0, 200, 5)]
    header = "PEER\nA MOTION\nACCELERATION TIME SERIES IN UNITS OF G\nNPTS= 200, DT= .02000 SEC\n"
    path.write_text(header + "\n".join(lines))
    return path


@pytest.mark.slow
@pytest.mark.serial
def test_the_wall_on_a_record(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The ground acceleration of the run is the record in m/s², scaled to 5 m/s², sample k at t = k
    dt."""
    path = recorded(tmp_path)
    monkeypatch.chdir(tmp_path)
    status = main(
        [
            "run",
            "wall",
            "--motion",
            str(path),
            "--set",
            "excitation.1.record.processing.pga=5",
            "--dt",
            "0.02",
            "--steps",
            "50",
            "--out",
            "out/quake",
            "--set",
            "fields.every=25",
            "--quiet",
        ]
    )
    told = capsys.readouterr()
    assert (status, told.err) == (0, "")
    assert "run finished: 50 steps" in told.out and "output: out/quake" in told.out
    assert main(["report", "out/quake"]) == 0
    summary = check_folder(
        tmp_path / "out" / "quake", steps=50, frames_every=25, figures=["model.png", "deformed.png"]
    )
    assert summary["worst_certificate"] <= 1e-9 and summary["energy_defect"] <= 1e-10
    record: Record = read_record(path)
    expected = record.acceleration[:51] * 5.0 / pga(record)
    assert column(tmp_path / "out" / "quake", "a_g_x") == pytest.approx(expected, abs=1e-9)
    assert not column(tmp_path / "out" / "quake", "a_g_y").any()
    assert column(tmp_path / "out" / "quake", "contact_active").max() == 11
    assert column(tmp_path / "out" / "quake", "contact_min_gap").min() == 0.0


BAD = {
    "missing record": (["--motion", "none.at2"], ["none.at2", "no such file"]),
    "record that is no text": (["--motion", "binary.at2"], ["binary.at2", "not a text file"]),
    "unknown table": (["--set", "model.case=c"], ["the table [model] is unknown", "Known: "]),
    "unknown solver": (["--solver", "magic"], ["'magic'", "Known: Automatic, Condensed"]),
    "folder below a file": (
        ["--set", "contact.points=", "--out", "file/run"],
        ["file/run", "choose another"],
    ),
    "dt zero": (["--set", "contact.points=", "--dt", "0"], ["dt is 0", "positive"]),
}


@pytest.mark.serial
@pytest.mark.parametrize("name", BAD)
def test_bad_input_is_one_sentence(
    tmp_path: Path, name: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Exit status 1, one line on standard error that names the thing and the remedy; nothing
    computed or written."""
    arguments, words = BAD[name]
    (tmp_path / "file").write_text("in the way")
    (tmp_path / "binary.at2").write_bytes(b"\0\1\2")
    before = sorted(tmp_path.rglob("*"))
    monkeypatch.chdir(tmp_path)
    status, (out, err) = main(["run", "wall", *arguments]), capsys.readouterr()
    assert status == 1 and out == ""
    assert err.startswith("vi-contact: ") and err.count("\n") == 1
    assert [word for word in words if word not in err] == []
    assert sorted(tmp_path.rglob("*")) == before and (tmp_path / "file").read_text() == "in the way"


@pytest.mark.slow
@pytest.mark.serial
def test_the_bouncing_bar_demo(
    comm: Any, shared_tmp: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """V1.3, one bounce: every scheme certified, its ledger closed; energy stays, but for Newmark on
    consistent mass."""
    numbers = demo("bouncing_bar").main(quick=True, out=shared_tmp, progress=False)
    comm.Barrier()  # rank 0 draws
    named = {name.split(":")[0] for name in numbers}
    assert len(named) == 9
    for name in named:
        prefix = next(key for key in numbers if key.startswith(name)).rsplit(":", 1)[0]
        assert (
            numbers[f"{prefix}: certificate"] <= 1e-9
            and numbers[f"{prefix}: ledger defect"] <= 1e-10
        )
        energy = numbers[f"{prefix}: energy at the end"]
        assert (energy > 2.0) if "do not use" in prefix else (0.85 < energy <= 1.0 + 1e-9), (
            prefix,
            energy,
        )
    assert is_drawn(shared_tmp / "bouncing_bar.png")
    # each run has a folder of its own
    assert len([path for path in shared_tmp.iterdir() if path.is_dir()]) == 9
    assert comm.rank or "trapezoidal, redistributed mass (default)" in capsys.readouterr().out


@pytest.mark.slow
def test_the_hertz_impact_demo(
    comm: Any, shared_tmp: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """V3.3 with 4 cells in the contact radius: within 5 % of the theory, certified, rebound with
    full speed."""
    numbers = demo("hertz_impact").main(quick=True, out=shared_tmp, progress=False)
    comm.Barrier()  # rank 0 draws
    of = {name.split(": ")[1]: value for name, value in numbers.items()}
    assert len(of) == len(numbers) == 6
    for name in ("approach", "duration", "force"):
        assert of[name] == pytest.approx(1.0, abs=0.05), name
    assert of["rebound"] == pytest.approx(1.0, abs=5e-3)
    assert 0.0 < of["certificate"] <= 1e-9 and of["ledger defect"] <= 1e-10
    assert is_drawn(shared_tmp / "hertz_impact.png")
    assert comm.rank or "4 cells in the contact radius" in capsys.readouterr().out


@pytest.mark.serial
def test_a_demo_in_a_folder_that_takes_no_files_says_so_in_a_sentence(tmp_path: Path) -> None:
    """What main() raises ends a script as it ends a command."""
    (tmp_path / "results").write_text("no folder\n")
    done = subprocess.run(
        [sys.executable, str(ROOT / "demos" / "timoshenko_beam.py")],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert (
        done.stderr.startswith("vi-contact: ")
        and "results" in done.stderr
        and done.stderr.count("\n") == 1
    )
