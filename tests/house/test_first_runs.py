"""The first command and the first program that a reader gives run on several ranks too."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from site_pages import blocks

from vi_contact.practice.cli.entry import main


def test_a_run_on_several_ranks(
    comm: Any, shared_tmp: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The command run, and README's program."""
    pytest.importorskip("dolfinx")
    monkeypatch.chdir(shared_tmp)
    assert main(["run", "wall", "--steps", "2", "--quiet", "--out", "wall"]) == 0
    code = blocks("README.md", "python")[0]
    assert code.count("steps=400") == 1
    exec(
        compile(code.replace("steps=400", "steps=4"), "first.py", "exec"), {"__name__": "__main__"}
    )
    comm.Barrier()
    assert (shared_tmp / "wall" / "history.csv").is_file()
