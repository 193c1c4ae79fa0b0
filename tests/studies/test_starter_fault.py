"""The starter ``fault``: what ``vi-contact new fault`` writes, and its rupture."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

from vi_contact.practice.cli.entry import main
from vi_contact.practice.studies import read_case
from vi_contact.practice.studies.cases.description.model import describe
from vi_contact.practice.studies.cases.library import STARTERS

pytestmark = pytest.mark.serial
SECOND = "run.t_end=1.0"  # the quick size that the case names


@pytest.mark.long
def test_the_fault_is_written_without_doubts(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """``new`` writes the case alone, which names its quick size; the model has no doubts, and twice
    as long elements have one."""
    monkeypatch.chdir(tmp_path)
    assert main(["new", "fault"]) == 0
    assert "wrote fault/fault.toml" in capsys.readouterr().out
    text = (tmp_path / "fault" / "fault.toml").read_text("utf-8")
    assert f"vi-contact run fault.toml --set {SECOND}" in text
    case = read_case(tmp_path / "fault" / "fault.toml", [])
    model = describe(case, MPI.COMM_SELF, case.parts(MPI.COMM_SELF))
    assert not model["defects"] and not model["warnings"]
    coarse = [f"mesh.{side}.divisions=[48, 12]" for side in ("lower", "upper")]
    case = read_case(tmp_path / "fault" / "fault.toml", coarse)
    model = describe(case, MPI.COMM_SELF, case.parts(MPI.COMM_SELF))
    (doubt,) = model["warnings"]
    assert "elements of 500 m at the fault are longer than" in doubt and "= 312 m" in doubt


@pytest.mark.long
def test_the_rupture_of_the_starter(shared_tmp: Path) -> None:
    """It is forced at 2 km/s as far as 1.5 km, is the same on both sides, and does not reach its
    ends; what it gives up is work of the prestress, and the ledger is closed."""
    run = read_case(STARTERS / "fault.toml", [SECOND]).run(
        MPI.COMM_SELF, out=shared_tmp, progress=False
    )
    history = run.history
    surface = run.problem.surface
    x = surface.points[:, 0] - 12e3
    order = np.argsort(x)
    way = run.state.memory["joint_way"][order]
    x = x[order]
    assert history["certificate"].max() < 1e-9
    assert np.max(np.abs(history["energy_defect"])) < 1e-10 * history["work_prestress"].max()
    assert np.max(np.abs(way - way[::-1])) < 1e-6 * way.max()
    reached = np.abs(x[way > 1e-3]).max()
    assert 1250.0 <= reached <= 3464.0 and way[np.abs(x) > 9e3].max() == 0.0
    assert 0.1 < way.max() < 1.0
    assert history["loss_rubbing"][-1] < history["work_prestress"][-1]
