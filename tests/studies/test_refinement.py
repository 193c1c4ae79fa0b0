"""``report --refine``: the case again with h/2 and with dt/2, whose peaks stand beside those of the
run."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from bar_case import BAR
from mpi4py import MPI

from vi_contact.core.errors import InputError
from vi_contact.practice.cli.entry import main
from vi_contact.practice.studies.cases.library import find_base_folder, read_copy
from vi_contact.practice.studies.refinement import describe_refinement, refine
from vi_contact.run.files.reading import read_run

pytestmark = pytest.mark.serial
pytest.importorskip("dolfinx")
CASE = f"""title = "A bar that rings"{BAR}[[excitation]]
type = "GroundMotion"
direction = [1.0, 0.0]
record = {{path = "motion.txt", units = "m/s2"}}
[scheme]
type = "ZienkiewiczWoodTaylor"
[run]
dt = 0.01
t_end = 0.2
[[record]]
type = "Energy"
[[record]]
type = "Contact"
[[record]]
type = "Probe"
points = {{end = [2.0, 1.0]}}
acceleration = true
[fields]
every = 10
"""


def written(folder: Path) -> Path:
    t = 0.01 * np.arange(21)
    np.savetxt(folder / "motion.txt", np.column_stack([t, -20.0 * np.sin(20.0 * t)]), fmt="%.6f")
    path = folder / "case.toml"
    path.write_text(CASE)
    return path


@pytest.mark.long
def test_both_columns_and_their_difference(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Twice the elements along each side, twice the steps, of the same duration; the table has
    their numbers; nothing that is there is computed again; another case is. Paths stay relative to
    the case that was run (V11.3)."""
    case, out = written(tmp_path), tmp_path / "out" / "run"
    assert main(["run", str(case), "--out", str(out), "--quiet"]) == 0
    assert find_base_folder(out / "case.toml") == tmp_path
    assert main(["report", str(out), "--refine", "--out", str(tmp_path / "page.pdf")]) == 0
    said = capsys.readouterr().out
    base, fine, short = (
        read_run(folder) for folder in (out, out / "refined" / "h", out / "refined" / "dt")
    )
    assert base.contact is not None and fine.contact is not None
    assert (len(base.contact.points), len(fine.contact.points)) == (2, 4)  # the corner is clamped
    assert fine.facts["steps"] == base.facts["steps"] == 20 and short.facts["steps"] == 40
    assert base.history["t"][-1] == pytest.approx(short.history["t"][-1]) == pytest.approx(0.2)
    section = describe_refinement(base, {})
    (table,) = section.tables
    assert table.header == ["column", "unit", "this run", "h/2", "difference", "dt/2", "difference"]
    rows = {row[0]: row for row in table.rows}
    own, *others = (float(np.max(np.abs(one.history["u_x_end"]))) for one in (base, fine, short))
    told = [f"{1e3 * own:.4g}"]
    for other in others:
        told += [f"{1e3 * other:.4g}", f"{round(100.0 * (other / own - 1.0), 2) + 0.0:+g} %"]
    assert rows["u_x_end"] == ["u_x_end", "mm", *told]
    assert own > 1e-3 and all(abs(other / own - 1.0) > 1e-4 for other in others)
    assert "a_x_end, raw: not convergent at impacts" in rows
    assert "u_x_end" in said and told[1] in said and told[4] in said  # both columns are printed
    stamp = (out / "refined" / "h" / "history.csv").stat().st_mtime_ns
    assert refine(out, MPI.COMM_SELF, progress=False) == {}
    assert (out / "refined" / "h" / "history.csv").stat().st_mtime_ns == stamp
    assert "fields" not in read_copy(out / "refined" / "h")
    assert (
        main(["run", str(case), "--out", str(out), "--quiet", "--set", "material.rubber.E=2e6"])
        == 0
    )
    assert not describe_refinement(read_run(out), {}).tables  # those were of another case
    assert "was not measured" in describe_refinement(read_run(out), {}).sentences[-1]


@pytest.mark.long
def test_what_fails_is_told(tmp_path: Path) -> None:
    """A refined run that cannot be made is a sentence of the report, the other one a column."""
    case, out = written(tmp_path), tmp_path / "run"
    assert main(["run", str(case), "--out", str(out), "--quiet", "--set", "run.t_end=0.05"]) == 0
    (out / "refined").mkdir()
    (out / "refined" / "h").write_text("no folder")
    failed = refine(out, MPI.COMM_SELF, progress=False)
    assert list(failed) == ["h"]
    section = describe_refinement(read_run(out), failed)
    assert any(text.startswith("The run with h/2 failed: ") for text in section.sentences)
    assert section.tables[0].header[3:] == ["dt/2", "difference"]
    (out / "case.toml").unlink()
    with pytest.raises(InputError, match=r"holds no case\.toml"):
        refine(out, MPI.COMM_SELF)
