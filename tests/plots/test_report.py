"""Run folders read back, the pages of a report, its commands, and the example of
docs/guide/outputs.md."""

from __future__ import annotations

import json
import re
import warnings
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from chain import chain_problem
from pictures import is_drawn
from plain_pictures import plain_pictures
from written_runs import write_run

import vi_contact as vc
from vi_contact import engineering
from vi_contact.core.errors import InputError
from vi_contact.practice.cli.entry import main
from vi_contact.practice.plots.charts import smooth_acceleration
from vi_contact.practice.plots.pages import write_pages
from vi_contact.practice.plots.sections import Section, header_facts, sections_of
from vi_contact.practice.studies.cases.description.tables import input_tables
from vi_contact.practice.studies.report import _read_model, report
from vi_contact.practice.units.report_units import ReportUnits
from vi_contact.run.files.reading import ContactGeometry, RunFolder, read_run

pytestmark = pytest.mark.serial
pytest.importorskip("matplotlib")
ROOT = Path(__file__).resolve().parents[2]
G = 9.80665


@pytest.fixture(scope="module")
def solved(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, vc.Solution]:
    """A chain that bounces between walls for 300 steps, in a folder."""
    folder = tmp_path_factory.mktemp("run") / "chain"
    shake = vc.Ricker(3.0, 6.0, direction=(1.0,))
    problem = chain_problem(
        3, gap=1e-3, left_gap=2e-3, excitation=shake, consistent=True, damping=1e-3
    )
    right = vc.Resultants("right", (0.0,), where=lambda x, n: n[:, 0] > 0.0)
    record = [vc.Energy(), vc.Contact(), vc.Probe({"end": (3.0,)}, acceleration=True), right]
    scheme = vc.ZienkiewiczWoodTaylor()
    run = vc.simulate(
        problem, scheme=scheme, dt=5e-3, steps=300, record=record, out=folder, progress=False
    )
    return folder, run


@pytest.fixture
def plain() -> Iterator[None]:
    """Pictures that nobody looks at: how pages are arranged other tests see."""
    with plain_pictures():
        yield


def channel(run: RunFolder, rows: int = 50) -> RunFolder:
    """The same facts with a U-shaped contact line that opens from the top."""
    x = np.array(
        [[0.0, 2.0], [0.0, 1.0], [0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [2.0, 2.0]]
    )
    contact = ContactGeometry(
        x, np.tile([-1.0, 0.0], (7, 1)), np.ones(7), np.zeros(7), np.zeros(7, dtype=bool)
    )
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
    again = engineering.contact_summary(
        read.history, read.contact, centre=(0.0,), where=lambda x, n: n[:, 0] > 0.0
    )
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


def pages(
    run: RunFolder, path: Path, monkeypatch: pytest.MonkeyPatch, sections: list[Section]
) -> tuple[Any, Any]:
    """(axes, all words) of the pages."""
    from matplotlib.backends.backend_pdf import PdfPages
    from matplotlib.text import Text

    kept: list[Any] = []
    save = PdfPages.savefig
    monkeypatch.setattr(
        PdfPages, "savefig", lambda self, figure: (kept.append(figure), save(self, figure))
    )
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        write_pages(path, "A channel $x", header_facts(run), sections, "vi_contact")
    axes = [
        axis
        for figure in kept
        for axis in figure.axes
        if axis.axison and not hasattr(axis, "_colorbar")
    ]
    return axes, [one.get_text() for figure in kept for one in figure.findobj(Text)]


def test_pages_of_a_channel(
    solved: tuple[Path, vc.Solution], monkeypatch: Any, tmp_path: Path
) -> None:
    """Every axis is labelled and holds something, maps go by arc length, texts stay on the page; no
    warnings."""
    run = channel(read_run(solved[0]))
    sections = sections_of(run, {})
    axes, words = pages(run, tmp_path / "page.pdf", monkeypatch, sections)
    assert [one.title for one in sections] == [
        "Ground motion",
        "Base shear, thrust, open share and sliding",
        "Accelerations, low-passed and raw",
        "Histories",
        "Solver, certificate and energies",
        "Peak values of all columns",
    ]
    charts = sum(len(one.charts) + len(one.drawings) for one in sections)
    assert len(axes) == charts > 11
    for axis in axes:
        assert axis.get_xlabel() and axis.get_ylabel() and (axis.lines or axis.collections)
        box = axis.get_tightbbox()
        size = axis.figure.bbox
        assert box.x0 > 0.0 and box.x1 < size.x1 and box.y0 > 0.0 and box.y1 < size.y1, (
            axis.get_title(loc="left")
        )
    assert sum(axis.get_ylabel() == "arc length [m]" for axis in axes) == 2
    said = " ".join(words).replace("\n", " ")
    worst = run.history["certificate"].max()
    for word in (
        "A channel $x",
        f"{run.facts['energy_defect']:.4g}",
        f"{worst:.1e}",
        "0.005 s",
        "a_g_x",
        "ZienkiewiczWoodTaylor",
        "contact_resultant",
        "u_x_end",
        "not convergent",
        "1e-09 was",
    ):
        assert word in said, word
    assert f"{run.history['u_x_end'].max():.4g}" in said
    assert (tmp_path / "page.pdf").read_bytes()[:5] == b"%PDF-"


def test_what_was_not_recorded_has_no_section(solved: tuple[Path, vc.Solution]) -> None:
    """A run that recorded one probe and was not shaken: its history, the certificates, the peaks;
    chosen columns."""
    run = read_run(solved[0])
    names = ("t", "k", "iterations", "certificate", "escalated", "a_g_x", "u_x_end")
    bare = replace(
        run,
        history={name: run.history[name] for name in names} | {"a_g_x": np.zeros(301)},
        contact=None,
        columns={name: run.columns[name] for name in names},
    )
    found = sections_of(bare, {})
    assert [one.title for one in found] == [
        "Histories",
        "Solver, certificate and energies",
        "Peak values of all columns",
    ]
    assert [chart.title for one in found for chart in one.charts] == [
        "displacement along x",
        "certificate of every step",
    ]
    chosen = sections_of(run, {}, [["N_right", "contact_resultant"]])
    (histories,) = (one for one in chosen if one.title == "Histories")
    assert [chart.title for chart in histories.charts] == ["N_right, contact_resultant"]
    for columns, text in (
        ([["nonsense"]], "no column 'nonsense'"),
        ([["N_right", "u_x_end"]], "different units"),
    ):
        with pytest.raises(InputError, match=text):
            sections_of(run, {}, columns)
    with pytest.raises(InputError, match="is not an .html or .pdf file"):
        report(solved[0], out=solved[0] / "page.doc")


def table(sections: list[Section], title: str, place: int = 0) -> dict[str, dict[str, str]]:
    """Rows of a table of a section by their first cell, or the column they are about."""
    (section,) = (one for one in sections if one.title.startswith(title))
    found = section.tables[place]
    rows = [dict(zip(found.header, row, strict=True)) for row in found.rows]
    return {row.get("column", row[found.header[0]]): row for row in rows}


def test_numbers_of_the_report(tmp_path: Path) -> None:
    """Closed forms: peaks, height at the largest thrust, what is left of the slip, safety, a sine
    with the jump of one step, the spectrum of a harmonic motion at short periods, the ledger over
    its largest energy (V11.2)."""
    dt, n = 0.005, 2001
    t = dt * np.arange(n)
    thrust = 1e5 * (1.0 + np.sin(np.pi * t / t[-1]))  # largest in the middle
    jump = np.zeros(n)
    jump[700] = 300.0
    columns = {
        "a_g_x": ("m/s2", "ground", 2.0 * np.sin(2.0 * np.pi * t)),
        "reaction_x_base": ("N", "shear", -3.0 * thrust),
        "N_stem": ("N", "thrust", thrust),
        "T_stem": ("N", "shear", -0.2 * thrust),
        "height_stem": ("m", "height", np.where(t < 0.02, np.nan, 1.0 + t)),
        "sliding_stem": ("m", "slip", 1e-3 * t),
        "margin_stem": (
            "-",
            "margin",
            np.where(t < 0.02, np.nan, 0.6 + 0.2 * np.cos(np.pi * t / t[-1])),
        ),
        "a_x_top": ("m/s2", "acceleration", 4.0 * np.sin(4.0 * np.pi * t) + jump),
        "energy_kinetic": ("J", "kinetic", np.full(n, 3.0)),
        "energy_strain": ("J", "strain", np.full(n, 5.0)),
        "work_input": ("J", "work", 2.0 * t),
        "energy_defect": ("J", "defect", np.full(n, 8e-13)),
    }
    found = sections_of(read_run(write_run(tmp_path / "run", columns, dt=dt)), {})
    rows = table(found, "Base shear")
    assert (
        rows["reaction_x_base"]["largest in size"] == "-600"
        and rows["reaction_x_base"]["unit"] == "kN"
    )
    assert rows["N_stem"]["largest in size"] == "200" and rows["N_stem"]["at t [s]"] == "5"
    assert (
        rows["height_stem"]["largest in size"] == "6" and rows["sliding_stem"]["at the end"] == "10"
    )
    assert rows["sliding_stem"]["at the start"] == "0" and rows["sliding_stem"]["unit"] == "mm"
    safety = table(found, "Base shear", 1)["stem"]
    # 1 / (1 - 0.4)
    assert safety["factor of safety against sliding, smallest"] == "1.667" == safety["at the end"]
    (row,) = table(found, "Accelerations").values()
    low, raw = (
        float(row[name])
        for name in ("peak below 25 Hz [m/s²]", "raw peak, not convergent at impacts [m/s²]")
    )
    assert raw == pytest.approx(300.0)  # the sine is zero there
    fall = 2.0 * 25.0 * (np.pi / 8.0) / np.sin(np.pi / 8.0)  # ∫ df / (1 + (f / 25 Hz)⁸)
    assert low == pytest.approx(300.0 * dt * fall, rel=0.05)
    (motion,) = (one for one in found if one.title == "Ground motion")
    (_, spectrum) = motion.charts
    full = spectrum.lines[1]
    assert full.x[0] == pytest.approx(0.02) and spectrum.lines[0].x[0] >= 10.0 * dt > full.x[0]
    # stiff oscillators feel the ground's own peak
    assert full.y[0] * G == pytest.approx(2.0, rel=0.02)
    assert table(found, "Solver", 1)["kinetic"]["over the largest energy"] == "0.375"
    (certificate,) = (one for one in found if one.title.startswith("Solver"))
    assert "1.0e-13 of the largest energy (8 J)" in certificate.sentences[2]


@pytest.mark.promise(
    "guide/report.md",
    "0.7 % at 4 ms and 0.05 % at 1 ms",
    bound="2.1 %, falling with the square of the step",
)
def test_low_passed_peaks_converge_where_raw_ones_do_not() -> None:
    """A velocity jump of 1 m/s in one step: raw peaks double with every half step, those below 25
    Hz are 51 m/s² (V11.2)."""
    found = []
    for dt in (4e-3, 2e-3, 1e-3):
        a = np.zeros(round(4.0 / dt) + 1)
        a[len(a) // 2] = 1.0 / dt
        run = RunFolder(
            Path(),
            {"t": dt * np.arange(len(a)), "a_x_top": a},
            {"a_x_top": ("m/s2", "a")},
            {},
            None,
        )
        raw, low, corner = smooth_acceleration(run, "a_x_top")
        assert raw.acceleration.max() == 1.0 / dt and corner == 25.0
        found.append(low.acceleration.max())
    limit = 50.0 * (np.pi / 8.0) / np.sin(np.pi / 8.0)
    errors = np.abs(np.array(found) / limit - 1.0)
    assert errors[0] < 0.021 and np.all(errors[1:] < 0.3 * errors[:-1]), errors


def test_the_model_as_it_was_described(tmp_path: Path) -> None:
    """Bodies, supports, contact, periods and sketch of model.json; odd and damaged ones are no
    tracebacks."""
    wave = np.sin(np.arange(40.0))
    model = {
        "title": "$",
        "dimension": 2,
        "mass": 1.5e4,
        "periods": [0.5, 0.25, 0.125],
        "warnings": ["dt is long"],
        "bodies": [
            {"name": "wall", "cells": 8, "mass": 1.5e4, "material": {"name": "C30", "E": 3e10}}
        ],
        "supports": [{"kind": "fixed", "groups": ["base", "toe"], "components": ["x", "y"]}],
        "contact": [
            {
                "name": "stem",
                "points": 2,
                "size": 4.0,
                "friction": "0.5",
                "places": [[0.0, 1.0], [0.0, 2.0]],
            }
        ],
        "outline": [
            {"group": "base", "lines": [[0.0, 0.0, 3.0, 0.0]]},
            {"group": "", "lines": [[0, 0, 0, 4.0]]},
        ],
    }
    folder = write_run(tmp_path / "run", {"u_x_top": ("m", "u", wave)}, dt=0.1, model=model)
    run = read_run(folder)
    section = sections_of(run, model, inputs=input_tables(model, ReportUnits()))[0]
    assert section.sentences == ["Warning: dt is long."]
    rows = [row for table in section.tables for row in table.rows]
    assert ("mass", "15", "t", "") in rows
    assert ("wall: Young's modulus E", "30", "GPa", "") in rows
    assert ("base, toe", "fixed", "-", "along x, y") in rows
    assert ("stem: area", "4", "m²", "") in rows
    assert ("natural period T2, contact closed", "0.25", "s", "") in rows
    _, written = report(folder, out=tmp_path / "page.pdf")
    assert [path.name for path in written] == ["page.pdf", "peaks.csv", "model.png"]
    deep: Any = []
    for _ in range(900):
        deep = [deep]
    for odd in (None, 5, "x", [5], {"a": deep}, deep):
        keys = ("bodies", "supports", "waves", "periods", "mass", "warnings", "records", "contact")
        assert sections_of(run, dict.fromkeys(keys, odd))
        odd_model = model | {"sides": odd, "box": odd, "loads": odd}
        (folder / "model.json").write_text(json.dumps(odd_model))
        with suppress(InputError):  # any other error fails the test
            _read_model(folder, tmp_path / "model.png")
        (folder / "model.json").write_text(json.dumps(model | {"outline": odd, "contact": odd}))
        with pytest.raises(InputError, match=r"model\.json' is damaged"):
            report(folder, out=tmp_path / "page.pdf")


def test_commands(
    plain: None,
    solved: tuple[Path, vc.Solution],
    capsys: pytest.CaptureFixture[str],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Every command writes what it says; mistakes are one sentence."""
    folder, run = solved
    assert main(["report", str(folder), "--out", str(folder / "report.pdf")]) == 0
    assert (folder / "report.pdf").read_bytes()[:5] == b"%PDF-"
    numbers = [name for name in run.columns if run.history[name].ndim == 1]
    counters = ("t", "k", "iterations", "escalated")
    assert (folder / "peaks.csv").read_text().count("\n") == 1 + len(numbers) - len(counters)
    assert main(["post", "peaks", str(folder), "u_x_end", "--out", str(tmp_path / "p.csv")]) == 0
    name, quantity, unit, high, *_ = (tmp_path / "p.csv").read_text().splitlines()[1].split(",")
    assert (name, unit, float(high)) == ("u_x_end", "m", run.history["u_x_end"].max())
    assert (
        main(["post", "spectrum", str(folder), "a_x_end", "a_g_x", "--periods", "0.05", "1", "20"])
        == 0
    )
    assert (folder / "spectrum.csv").read_text().count("\n") == 41
    assert main(["post", "transfer", str(folder), "a_x_end"]) == 0
    assert main(["post", "loop", str(folder), "u_x_end", "N_right"]) == 0
    for picture in ("spectrum.png", "transfer.png", "loop.png"):
        assert is_drawn(folder / picture)
    capsys.readouterr()
    # without the packages that web pages need
    monkeypatch.setattr("importlib.util.find_spec", lambda _: None)
    before = sorted(tmp_path.iterdir())
    for wrong, text in (
        (["report", str(tmp_path)], "no history.csv"),
        (["report", str(folder), "--out", str(tmp_path / "no" / "page.pdf")], "folder that exists"),
        (
            ["report", str(folder), "--out", str(tmp_path / "page.svg")],
            "is not an .html or .pdf file",
        ),
        (["report", str(folder), "--out", str(tmp_path / "page.html")], "needs jinja2 and plotly"),
        (["report", str(folder), "--refine"], "holds no case.toml"),
        (["plot", str(folder)], "no frames in"),
        (["film", str(folder), "--out", str(tmp_path / "x.mp4")], "no frames in"),
        (["post", "loop", str(folder), "u_x_end", "nothing"], "no column 'nothing'"),
        (["post", "spectrum", str(folder), "u_x_end"], "not an acceleration"),
    ):
        assert main(wrong) == 1
        said = capsys.readouterr().err
        assert text in said and said.count("\n") == 1
    assert sorted(tmp_path.iterdir()) == before  # a command that refuses has drawn nothing


def test_example_of_the_documentation(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """It continues README's problem: records everything, reads it back, and the page shows it."""
    pytest.importorskip("dolfinx")
    (code,) = re.findall(
        r"^```python\n(.*?)^```$", (ROOT / "README.md").read_text(), re.MULTILINE | re.DOTALL
    )
    document = (ROOT / "docs" / "guide" / "outputs.md").read_text(encoding="utf-8")
    blocks = re.findall(r"^```python\n(.*?)^```$", document, re.MULTILINE | re.DOTALL)
    ready = "import numpy as np\n" + code[: code.index("solution = ")]
    monkeypatch.chdir(tmp_path)
    with plain_pictures():
        lines = compile(ready + "\n".join(blocks), "example.py", "exec")
        exec(lines, {"__name__": "__main__"})
    printed = capsys.readouterr().out
    assert re.fullmatch(r"50 periods, 101 points of the loop, \d+ columns\n6 frames, .*\n", printed)
    for picture in ("faces.png", "deformed.png"):
        assert is_drawn(tmp_path / "results" / picture)
    run = read_run(tmp_path / "results" / "engineering")
    described = json.loads((run.folder / "columns.json").read_text())
    for name in (
        "uplift_face",
        "height_upper",
        "theta_face",
        "racking_wall",
        "reaction_M_base",
        "M_third",
        "a_x_top",
    ):
        assert described[name]["unit"] and name in run.history
    with plain_pictures():
        assert (
            vc.studies.report(run.folder, out=tmp_path / "page.pdf")[1][0].stat().st_size > 30_000
        )
