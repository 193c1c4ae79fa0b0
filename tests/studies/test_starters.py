"""Cases to begin with: written by a command, checked, run for a moment."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

pytest.importorskip("dolfinx")
pytest.importorskip("gmsh")

from vi_contact.practice.cli.entry import main
from vi_contact.run.files.reading import read_run

pytestmark = pytest.mark.serial


@pytest.mark.long
def test_two_frames_pound(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """From ``new`` to a run in the quick size, in which the frames hit."""
    monkeypatch.chdir(tmp_path)
    assert main(["new", "pounding"]) == 0
    said = capsys.readouterr().out.splitlines()
    assert said[:3] == ["wrote pounding/pounding.toml", "wrote pounding/pounding.geo", "next:"]
    commands = [line.split()[1:] for line in said[3:]]
    assert main([*commands[0], "--quiet"]) == 0
    model = json.loads((tmp_path / "results" / "pounding" / "model.json").read_text("utf-8"))
    assert model["rigid_motions"] == 0 and 2.0 < model["periods"][0] / model["periods"][1] < 4.0
    assert main([*commands[1], "--quiet", "--set", "run.t_end=1.9"]) == 0
    run = read_run(tmp_path / "results" / "pounding")
    assert (
        run.history["contact_resultant"].max() > 1e5 and run.history["contact_resultant"][0] == 0.0
    )
    assert commands[2] == ["report", "results/pounding"]


def test_nothing_is_overwritten(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "pounding.geo").write_text("mine", encoding="utf-8")
    for arguments, words in (
        (["new", "pounding", "mine"], "'mine/pounding.geo' exists already"),
        (["new", "pound"], "no starter case 'pound': did you mean pounding?"),
    ):
        assert main(arguments) == 1
        assert words in capsys.readouterr().err
    assert [path.name for path in (tmp_path / "mine").iterdir()] == ["pounding.geo"]
    assert (tmp_path / "mine" / "pounding.geo").read_text("utf-8") == "mine"
