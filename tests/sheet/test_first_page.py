"""Page 1 of a report: the table [sheet], its units, and convergence that is measured or not
claimed."""

from __future__ import annotations

import json
import re
from hashlib import sha256
from html import unescape
from pathlib import Path

import numpy as np
import pytest
from report_packages import report_packages
from written_runs import write_run

pytest.importorskip("matplotlib")

from vi_contact.core.errors import InputError
from vi_contact.practice.plots import pages
from vi_contact.practice.plots.report_numbers import ReportNumbers, read_slice
from vi_contact.practice.plots.sections import Section
from vi_contact.practice.sheet.choices import Sheet
from vi_contact.practice.sheet.first_page import describe_first_page
from vi_contact.practice.sheet.rigid_base import find_edge_pressure
from vi_contact.practice.studies.report import report
from vi_contact.run.files.reading import RunFolder, read_run

pytestmark = pytest.mark.serial
EVIL = "<b>A & B</b> $x$ \\u001b \\n{{ 7 * 7 }}"
SHOWN = "<b>A & B</b> $x$ {{ 7 * 7 }}"


def first_page(
    run: RunFolder, sheet: Sheet | None = None, thickness: float | None = None, **more: object
) -> Section:
    """The section of the numbers that decide, of a run that was not refined."""
    sheet = sheet or Sheet()
    numbers = ReportNumbers(sheet.units, thickness)
    known = {"refined": {}, "failed": {}} | more
    return describe_first_page(run, sheet, numbers, **known)  # type: ignore[arg-type]


def rows(section: Section) -> dict[str, list[str]]:
    """Column -> value, time, duration, dt/2, h/2."""
    return {
        row[1]: [cell.replace("\xa0", " ") for cell in row[2:]] for row in section.tables[0].rows
    }


def made_run(folder: Path, scale: float = 1.0) -> RunFolder:
    """A run of five steps of 0.5 s with a blow of one step in N_stem, times a factor."""
    columns = {
        "N_stem": ("N", "thrust", scale * 1e5 * np.array([1.0, 1.0, 2.0, 1.0, 1.0, 1.0])),
        "M_stem": ("N m", "moment", scale * 1e3 * np.array([0.0, 4.0, 4.0, 4.0, 0.0, 0.0])),
        "u_x_top": ("m", "displacement", scale * 1e-3 * np.arange(6)),
        "uplift_stem": ("-", "open share", np.array([0.0, 0.1, 0.225, 0.1, 0.0, 0.0])),
    }
    return read_run(write_run(folder, columns, dt=0.5))


def test_values_have_the_units_of_the_report(tmp_path: Path) -> None:
    """200 kN on a slice of 2 m are 100 kN/m in plane strain, 200 kN otherwise; MN and cm when the
    sheet says so; shares in per cent."""
    run = made_run(tmp_path / "run")
    names = ["N_stem", "M_stem", "u_x_top", "uplift_stem"]
    whole = rows(first_page(run, Sheet(numbers=names)))
    assert whole["N_stem"] == ["200 kN", "1 s", "0.5 s, one step", "not tested", "not tested"]
    assert whole["M_stem"][:3] == ["4 kN m", "0.5 s", "1.5 s, 3 steps"]
    assert whole["u_x_top"][:3] == ["5 mm", "2.5 s", "0.5 s, one step"]
    assert whole["uplift_stem"][0] == "22.5 %"
    slice_of_two = first_page(run, Sheet(numbers=names), 2.0)
    assert rows(slice_of_two)["N_stem"][0] == "100 kN/m"
    assert rows(slice_of_two)["M_stem"][0] == "2 kN m/m"
    assert any(note.startswith("Plane strain: ") for note in slice_of_two.notes)
    units = json.loads('{"force": "MN", "length": "cm"}')
    chosen = rows(first_page(run, Sheet(numbers=names, units=type(Sheet().units)(**units))))
    assert (chosen["N_stem"][0], chosen["u_x_top"][0]) == ("0.2 MN", "0.5 cm")


def test_model_json_tells_of_the_slice() -> None:
    """An old or damaged file tells nothing: forces are whole ones then."""
    assert read_slice({"section": {"type": "PlaneStrain", "thickness": 2.0}}) == 2.0
    panel = {"type": "PlaneStress", "thickness": 2.0}
    for section in (None, panel, {"type": "PlaneStrain", "thickness": "x"}, [1], "PlaneStrain"):
        assert read_slice({"section": section}) is None
    assert read_slice({}) is None


def test_convergence_is_measured_or_not_claimed(tmp_path: Path) -> None:
    """Without a refined run nothing is claimed; with one 4 % pass and 6 % do not, nor does a peak
    that is as short as the step; a run that failed is told. One step is named with what to do."""
    run = made_run(tmp_path / "run")
    sheet = Sheet(numbers=["N_stem", "M_stem"])
    bare = " ".join(first_page(run, sheet, cost="the run took 12 s").notes)
    assert "was not tested" in bare and "--halved" in bare and "the run took 12 s" in bare
    assert "Peak of one step: N_stem." in bare and "test it with `--halved`" in bare
    assert "Converged means" not in bare
    near = first_page(run, sheet, refined={"dt": made_run(tmp_path / "near", 1.04)})
    assert rows(near)["M_stem"][3:] == ["yes: +4 %", "not tested"]
    assert rows(near)["N_stem"][3] == "no: +4 %, still one step"
    assert "Not converged: N_stem." in " ".join(near.notes)
    assert "Converged means: half the step changes the number by at most 5 %" in near.notes[1]
    far = first_page(
        run, sheet, refined={"dt": made_run(tmp_path / "far", 0.94)}, failed={"h": "no mesh"}
    )
    assert rows(far)["M_stem"][3:] == ["no: -6 %", "its run failed"]
    assert "Not converged: N_stem, M_stem." in " ".join(far.notes)
    same = first_page(run, sheet, refined={"dt": made_run(tmp_path / "same", 1.0 + 1e-9)})
    assert rows(same)["M_stem"][3] == "yes: no change"


def evil_run(folder: Path) -> Path:
    """A run whose [sheet] is markup, and whose case has a line of its own."""
    t = np.arange(6.0)
    case = f'title = "T"\n[sheet]\nproject = "{EVIL}"\nauthor = "{EVIL}"\ndate = 2026-02-03\n'
    notes = "# set run.dt=0.5\n# its paths are relative to /\n"
    columns = {"u_x_top": ("m", "displacement", np.sin(t))}
    return write_run(folder, columns, dt=0.5, case=notes + case)


def test_texts_of_the_sheet_are_shown_as_they_are(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In the PDF no dollar begins a formula; the title block has what was set and the checksum of
    the case file without the notes of its copy."""
    from matplotlib.text import Text

    folder = evil_run(tmp_path / "run")
    kept = []
    end = pages._Pages.end
    monkeypatch.setattr(
        pages._Pages, "end", lambda self, file: (kept.extend(self.figures), end(self, file))
    )
    report(folder, out=tmp_path / "page.pdf")
    words = [text.get_text().replace("\n", " ") for text in kept[0].findobj(Text)]
    assert words.count(SHOWN) == 2
    assert "2026-02-03" in words and "run.dt=0.5" in words
    own = (folder / "case.toml").read_text().partition("relative to /\n")[2]
    checksum = sha256(own.encode()).hexdigest()
    assert checksum in " ".join(words).replace(" ", "")
    assert f"page 1 of {len(kept)}" in words[-1]


def test_texts_of_the_sheet_are_escaped_on_the_web_page(tmp_path: Path) -> None:
    report_packages()
    report(evil_run(tmp_path / "run"), out=tmp_path / "page.html")
    text = re.sub(r"<script.*?</script>", "", (tmp_path / "page.html").read_text(), flags=re.DOTALL)
    assert "<b>" not in text and "{{ 7 * 7 }}" in text
    assert re.findall(r"<dt>project</dt><dd>(.*?)</dd>", unescape(text)) == [SHOWN]


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ("numbers = ['M_stam']", "'M_stam', which is neither a column of the run nor a rule: "),
        ("numbers = ['section_moment']", r"add a \[\[record\]\] of type SectionForces"),
        ("numbers = []", "numbers is empty"),
        ("numbers = ['sliding', 'sliding']", "names 'sliding' twice"),
        ("units = {force = 'kg'}", r"\[sheet\.units\] units: force is 'kg', which is none"),
        ("units = {length = 'ell'}", "length is 'ell'"),
        ("units = {forces = 'kN'}", "unknown key 'forces' for ReportUnits: did you mean force"),
        ("authors = 'A'", "unknown key 'authors' for Sheet: did you mean author"),
        ("project = 3", r"\[sheet\] project is 3: give text"),
        ("date = 12:30:00", r"\[sheet\] date is .*: give text or a date"),
    ],
)
def test_wrong_sheets_are_refused(tmp_path: Path, table: str, words: str) -> None:
    columns = {"u_x_top": ("m", "displacement", np.arange(6.0))}
    folder = write_run(tmp_path / "run", columns, dt=0.5, case=f"[sheet]\n{table}\n")
    with pytest.raises(InputError, match=words) as caught:
        report(folder, out=tmp_path / "page.pdf")
    assert "case.toml: [sheet" in str(caught.value) and "\n" not in str(caught.value)


def test_a_rigid_base_stands_beside_the_pressure_of_an_edge(tmp_path: Path) -> None:
    """By hand, a base of 4 m and 2 m thick: N/A (1 + 6 e/W) = 80/8 * 1.75 = 17.5 kPa for e = 0.5 m;
    2 N/(3 t (W/2 - e)) = 160/(6 * 1) = 26.67 kPa for e = 1 m; N outside of the base has none."""
    assert find_edge_pressure(80e3, -0.5, 4.0, 8.0) == pytest.approx(17.5e3)
    assert find_edge_pressure(80e3, 1.0, 4.0, 8.0) == pytest.approx(80e3 / 3.0)
    assert np.isnan(find_edge_pressure(80e3, 2.0, 4.0, 8.0))
    columns = {
        "N_base": ("N", "normal force", np.full(6, 80e3)),
        "e_base": ("m", "eccentricity", np.array([0.0, 0.5, 0.5, 0.5, 0.5, 0.5])),
        "pressure_low_base": ("Pa", "pressure", 1e3 * np.array([1.0, 2.0, 90.0, 2.0, 2.0, 2.0])),
    }
    run = read_run(write_run(tmp_path / "run", columns, dt=0.5))
    part = {"name": "base", "size": 8.0}
    section = {"type": "PlaneStrain", "thickness": 2.0}
    model = {"dimension": 2, "section": section, "contact": [part]}
    sheet = Sheet(numbers=["pressure_low_base"])
    note = first_page(run, sheet, 2.0, model=model).notes[-1]
    assert "At 1 s a rigid base on springs" in note and "has 17.5 kPa at its edge" in note
    assert "N = 40 kN/m, e = 0.5 m, width 4 m" in note
    for unknown in ({}, model | {"dimension": 3}, model | {"contact": [part | {"name": "x"}]}):
        notes = first_page(run, sheet, 2.0, model=unknown).notes
        assert not any("rigid base" in other for other in notes)


def test_a_small_displacement_changes_beside_large_places(tmp_path: Path) -> None:
    """1.5 µm more than 0.5 µm are no rounding, though the thrust acts 4 m above the ground."""
    runs = []
    for name, most in (("run", 5e-7), ("near", 2e-6)):
        columns = {
            "u_x_top": ("m", "displacement", most * np.array([0.0, 1.0, 1.0, 1.0, 0.0, 0.0])),
            "height_stem": ("m", "height of the thrust", np.full(6, 4.0)),
        }
        runs.append(read_run(write_run(tmp_path / name, columns, dt=0.5)))
    page = first_page(runs[0], Sheet(numbers=["u_x_top"]), refined={"dt": runs[1]})
    assert rows(page)["u_x_top"][0] == "0.5 µm"
    assert rows(page)["u_x_top"][3] == "no: +300 %"
