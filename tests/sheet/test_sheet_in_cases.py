"""[sheet] in case files: read and checked before the run, ignored by the mechanics, changed after
the run; and half the time step alone."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from bar_case import BAR
from written_runs import write_run

pytest.importorskip("dolfinx")

from vi_contact.core.errors import InputError
from vi_contact.practice.cli.entry import main
from vi_contact.practice.studies import read_case
from vi_contact.practice.studies.cases.library import locate
from vi_contact.practice.studies.refinement import estimate_cost
from vi_contact.practice.studies.report import report
from vi_contact.run.files.reading import read_run

pytestmark = pytest.mark.serial
CASE = f"""title = "A bar that rings"{BAR}[[excitation]]
type = "Harmonic"
amplitude = 20.0
frequency = 3.0
direction = [1.0, 0.0]
[scheme]
type = "ZienkiewiczWoodTaylor"
[run]
dt = 0.01
t_end = 0.2
[[record]]
type = "Contact"
[[record]]
type = "Probe"
points = {{end = [2.0, 1.0]}}
"""
SHEET = '[sheet]\nproject = "P"\nnumbers = ["contact_resultant", "u_x_end"]\n'


@pytest.mark.long
def test_half_the_time_step_alone(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The cost is told before; the case runs with dt/2 and no finer mesh; the sheet has the change
    of each number; a sheet that is changed after the run asks for no run."""
    case = tmp_path / "bar.toml"
    case.write_text(CASE + SHEET)
    out = tmp_path / "run"
    assert main(["run", str(case), "--out", str(out), "--quiet"]) == 0
    seconds = read_run(out).facts["seconds"]
    assert estimate_cost(out, ["dt"]).startswith("the run took ") and seconds > 0.0
    assert "h/2 will take at least " in estimate_cost(out, ["dt", "h"])
    capsys.readouterr()
    command = ["report", str(out), "--halved", "--out", str(tmp_path / "page.pdf")]
    assert main(command) == 0
    said = capsys.readouterr().out
    assert said.startswith("the run took ") and "dt/2 will take about " in said
    assert "report written in " in said
    assert os.listdir(out / "refined") == ["dt"]

    # Each number of the sheet and its change, as the two runs have them.
    base, half = (read_run(folder).history["u_x_end"] for folder in (out, out / "refined" / "dt"))
    peaks = [values[np.argmax(np.abs(values))] for values in (base, half)]
    change = 100.0 * (peaks[1] - peaks[0]) / abs(peaks[0])
    (row,) = (line.replace("\xa0", " ") for line in said.splitlines() if " u_x_end " in line)
    assert f" {1e3 * peaks[0]:.4g} mm " in row
    verdict = "yes" if abs(change) <= 5.0 else "no"
    assert f"{verdict}: {change:+.2g} %" in row and "not tested" in row and abs(change) > 1e-3

    # Who signs is written into the copy afterwards: nothing is computed again.
    stamp = (out / "refined" / "dt" / "history.csv").stat().st_mtime_ns
    copy = out / "case.toml"
    copy.write_text(copy.read_text().replace('project = "P"', 'project = "Q"\nauthor = "A"'))
    assert main(command) == 0
    assert "dt/2 has run already" in capsys.readouterr().out
    assert (out / "refined" / "dt" / "history.csv").stat().st_mtime_ns == stamp
    error, _ = report(out, out=tmp_path / "page.pdf")
    assert error.tables and "half the time step (dt/2)" in error.sentences[0]
    assert "element size" not in error.sentences[0]


@pytest.mark.parametrize(
    ("facts", "cost"),
    [
        # the seconds of a continued run are those since then
        ({"seconds": 12.0, "seconds_per_step": 0.1, "steps": 5}, "the run took 12 s; dt/2 will"),
        ({"seconds": 2.0, "seconds_per_step": 3.0, "steps": 5}, "the run took 15 s; dt/2 will"),
        (
            {"seconds": 7200.0},
            "the run took 2 h; dt/2 will take about 4 h, h/2 will take at least 8 h",
        ),
        ({"seconds": 150.0}, "the run took 2.5 min; dt/2 will take about 5 min"),
        ({}, "how long dt/2 will take is unknown"),
    ],
)
def test_the_cost_in_words(tmp_path: Path, facts: dict[str, float], cost: str) -> None:
    """Half the step costs twice the time; half the elements four times, in the plane."""
    columns = {"u_x_top": ("m", "displacement", np.arange(6.0))}
    case = "[mesh]\n[run]\ndt = 0.5\nsteps = 5\n"
    more = {"dt": 0.5, "steps": 5} | facts
    folder = write_run(tmp_path / "run", columns, dt=0.5, case=case, facts=more)
    assert estimate_cost(folder, ["dt", "h"]).startswith(cost)


def test_a_number_that_the_run_does_not_have_is_told_before(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """By --check and by the run, which computes no step."""
    case = tmp_path / "bar.toml"
    case.write_text(CASE + '[sheet]\nnumbers = ["sliding_base"]\n')
    out = tmp_path / "run"
    for options in ([], ["--check"]):
        assert main(["run", str(case), "--out", str(out), "--quiet", *options]) == 1
        said = capsys.readouterr().err
        assert f"{case}: [sheet] numbers names 'sliding_base', which is neither" in said
        assert said.count("\n") == 1 and not (out / "history.csv").exists()
    with pytest.raises(InputError, match=r"\[sheet\.units\] units: stress is 'm', which is none"):
        read_case(case, ["sheet.units.stress=m"]).check()


@pytest.mark.long
def test_the_mechanics_do_not_read_the_sheet() -> None:
    """The shipped wall with a sheet makes the same problem and columns."""
    from mpi4py import MPI

    plain = read_case(locate("wall"), ["run.steps=1"])
    signed = read_case(locate("wall"), ["run.steps=1", "sheet.author=A", "sheet.date=2026-01-02"])
    assert signed.sheet.author == "A" and str(signed.sheet.date) == "2026-01-02"
    assert plain.columns(MPI.COMM_SELF) == signed.columns(MPI.COMM_SELF)
