"""Run folders read back, the page about a run, its commands, and the example of docs/guide/outputs.md."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import warnings
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from chain import chain_problem

import vi_contact as vc
from vi_contact import engineering
from vi_contact.cli.entry import main
from vi_contact.core.errors import InputError
from vi_contact.plots.report import header_facts, plot_report, table_rows
from vi_contact.run.files.reading import ContactGeometry, RunFolder, read_run

pytestmark = pytest.mark.serial
pytest.importorskip("matplotlib")
ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, vc.Solution]:
    """A chain that bounces between walls for 300 steps, in a folder."""
    folder = tmp_path_factory.mktemp("run") / "chain"
    shake = vc.Ricker(3.0, 6.0, direction=(1.0,))
    problem = chain_problem(3, gap=1e-3, left_gap=2e-3, excitation=shake, consistent=True, damping=1e-3)
    right = engineering.Resultants("right", (0.0,), where=lambda x, n: n[:, 0] > 0.0)
    record = [vc.Energy(), vc.Contact(), vc.Probe({"end": (3.0,)}, acceleration=True), right]
    scheme = vc.ZienkiewiczWoodTaylor()
    run = vc.simulate(problem, scheme=scheme, dt=5e-3, steps=300, record=record, out=folder, progress=False)
    return folder, run


def channel(run: RunFolder, rows: int = 50) -> RunFolder:
    """The same facts with a U-shaped contact line that opens from the top."""
    x = np.array([[0.0, 2.0], [0.0, 1.0], [0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [2.0, 2.0]])
    contact = ContactGeometry(x, np.tile([-1.0, 0.0], (7, 1)), np.ones(7), np.zeros(7), np.zeros(7, dtype=bool))
    t = run.history["t"][:rows]
    wave = np.sin(20.0 * t)[:, None] * (1.0 + x[:, 1])
    arrays = {"pressure": 1e4 * np.maximum(wave, 0.0), "gap": 1e-4 * np.maximum(-wave, 0.0)}
    numbers = {name: values[:rows] for name, values in run.history.items() if values.ndim == 1}
    return replace(run, history=numbers | arrays, contact=contact)


def test_a_folder_holds_what_the_run_returned(solved: tuple[Path, vc.Solution]) -> None:
    folder, run = solved
    read = read_run(folder)
    assert read.columns == dict(run.columns)
    for name, values in run.history.items():
        assert np.array_equal(read.history[name], values, equal_nan=True), name
    assert read.facts["steps"] == 300 and read.contact is not None
    again = engineering.contact_summary(read.history, read.contact, centre=(0.0,), where=lambda x, n: n[:, 0] > 0.0)
    assert np.array_equal(again["N"], run.history["N_right"])


def test_killed_and_damaged_runs(solved: tuple[Path, vc.Solution], tmp_path: Path) -> None:
    """history.csv alone is enough, its cut last line is left out; what is no run says so."""
    folder, _ = solved
    text = (folder / "history.csv").read_text()
    (tmp_path / "columns.json").write_text((folder / "columns.json").read_text())
    (tmp_path / "history.csv").write_text(text[:-20])
    read = read_run(tmp_path)
    assert len(read.history["t"]) == 300 and read.facts == {} and read.contact is None
    assert dict(header_facts(read))["status"] == "not ended"
    assert "pressure" not in read.history and engineering.peaks(read.history, read.columns)
    (tmp_path / "history.csv").write_text(text.replace("\n0.005", "\nwrong", 1))
    with pytest.raises(InputError, match="damaged"):
        read_run(tmp_path)
    with pytest.raises(InputError, match="no history.csv"):
        read_run(tmp_path / "nothing")


def texts(run: RunFolder, monkeypatch: pytest.MonkeyPatch, **options: Any) -> tuple[list[Any], list[str]]:
    """(panels, all words) of the page."""
    from matplotlib.figure import Figure
    from matplotlib.text import Text

    kept: list[Figure] = []
    monkeypatch.setattr(Figure, "savefig", lambda self, path, **more: kept.append(self))
    plot_report(run, "page.png", **options)
    axes = [axis for axis in kept[0].axes if axis.axison and not hasattr(axis, "_colorbar")]
    words = [one.get_text() for one in kept[0].findobj(Text)]
    tables = [table for axis in kept[0].axes for table in axis.tables]
    words += [cell.get_text().get_text() for table in tables for cell in table.get_celld().values()]
    return axes, words


def test_page_of_a_channel(solved: tuple[Path, vc.Solution], monkeypatch: pytest.MonkeyPatch) -> None:
    """Facts, ten panels with labelled axes that hold something, maps by arc length, peaks; no warnings."""
    run = channel(read_run(solved[0]))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        axes, words = texts(run, monkeypatch, title="A channel")
    assert len(axes) == 10
    for axis in axes:
        assert axis.get_xlabel() and axis.get_ylabel() and axis.get_title(loc="left")
        assert axis.lines or axis.collections
    assert sum(axis.get_ylabel() == "arc length [m]" for axis in axes) == 2
    said = " ".join(words)
    for word in ("A channel", f"{run.facts['energy_defect']:.2e}", f"{run.history['certificate'].max():.2e}", "0.005 s",
                 "ZienkiewiczWoodTaylor", "a_g_x", "contact_resultant", "u_x_end"):
        assert word in said, word
    row = next(row for row in table_rows(run) if row.name == "u_x_end")
    assert row.max == run.history["u_x_end"].max() and f"{row.max:.4g}" in said


def test_page_without_motion_contact_and_energy(solved: tuple[Path, vc.Solution], monkeypatch: Any) -> None:
    """A run that recorded one probe and was not shaken: its history and the certificates, nothing empty."""
    run = read_run(solved[0])
    names = ("t", "k", "iterations", "certificate", "escalated", "a_g_x", "u_x_end")
    bare = replace(run, history={name: run.history[name] for name in names} | {"a_g_x": np.zeros(301)}, contact=None,
                   columns={name: run.columns[name] for name in names})
    axes, _ = texts(bare, monkeypatch)
    assert [axis.get_title(loc="left") for axis in axes] == ["displacement", "certificate of every step"]
    chosen, _ = texts(run, monkeypatch, columns=[["N_right", "contact_resultant"]])
    assert "N_right, contact_resultant" in [axis.get_title(loc="left") for axis in chosen]
    for columns, text in (([["nonsense"]], "no column 'nonsense'"), ([["N_right", "u_x_end"]], "different units")):
        with pytest.raises(InputError, match=text):
            plot_report(run, "page.png", columns=columns)
    with pytest.raises(InputError, match="is a .png"):
        plot_report(run, "page.doc")


def test_commands(solved: tuple[Path, vc.Solution], capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """Every command writes what it says; mistakes are one sentence."""
    folder, run = solved
    assert main(["report", str(folder)]) == 0
    assert (folder / "report.pdf").read_bytes()[:5] == b"%PDF-"
    numbers = [name for name in run.columns if run.history[name].ndim == 1]
    counters = ("t", "k", "iterations", "escalated")
    assert (folder / "peaks.csv").read_text().count("\n") == 1 + len(numbers) - len(counters)
    assert main(["post", "peaks", str(folder), "u_x_end", "--out", str(tmp_path / "p.csv")]) == 0
    name, quantity, unit, high, *_ = (tmp_path / "p.csv").read_text().splitlines()[1].split(",")
    assert (name, unit, float(high)) == ("u_x_end", "m", run.history["u_x_end"].max())
    assert main(["post", "spectrum", str(folder), "a_x_end", "a_g_x", "--periods", "0.05", "1", "20"]) == 0
    assert (folder / "spectrum.csv").read_text().count("\n") == 41
    assert main(["post", "transfer", str(folder), "a_x_end"]) == 0
    assert main(["post", "loop", str(folder), "u_x_end", "N_right"]) == 0
    for picture in ("spectrum.png", "transfer.png", "loop.png"):
        assert (folder / picture).stat().st_size > 10_000
    capsys.readouterr()
    for wrong, text in (
        (["report", str(tmp_path)], "no history.csv"),
        (["report", str(folder), "--out", str(tmp_path / "no" / "page.pdf")], "folder that exists"),
        (["post", "loop", str(folder), "u_x_end", "nothing"], "no column 'nothing'"),
        (["post", "spectrum", str(folder), "u_x_end"], "no acceleration"),
    ):
        assert main(wrong) == 1
        said = capsys.readouterr().err
        assert text in said and said.count("\n") == 1


def test_example_of_the_documentation(tmp_path: Path) -> None:
    """It continues README's problem: records everything, reads it back, and the page shows it."""
    pytest.importorskip("dolfinx")
    (code,) = re.findall(r"^```python\n(.*?)^```$", (ROOT / "README.md").read_text(), re.MULTILINE | re.DOTALL)
    document = (ROOT / "docs" / "guide" / "outputs.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```$", document, re.MULTILINE | re.DOTALL)
    ready = "import numpy as np\n" + code[: code.index("solution = ")]
    (tmp_path / "example.py").write_text(ready + "\n".join(blocks), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "example.py"], cwd=tmp_path, env=os.environ | {"PYTHONPATH": str(ROOT)}, timeout=600,
        capture_output=True, encoding="utf-8",
    )
    assert done.returncode == 0, done.stderr
    assert re.fullmatch(r"50 periods, 101 points of the loop, \d+ columns\n", done.stdout)
    for picture in ("faces.png", "deformed.png"):
        assert (tmp_path / "results" / picture).stat().st_size > 30_000
    run = read_run(tmp_path / "results" / "engineering")
    described = json.loads((run.folder / "columns.json").read_text())
    for name in ("uplift_face", "height_upper", "theta_face", "racking_wall", "reaction_M_base", "M_third", "a_x_top"):
        assert described[name]["unit"] and name in run.history
    assert plot_report(run, tmp_path / "page.png").stat().st_size > 50_000
