"""The notebooks: text without outputs, programs that check the numbers of their pages, and the same
in Jupyter."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.serial
ROOT = Path(__file__).resolve().parents[2]
FOLDER = ROOT / "docs" / "notebooks"
NAMES = sorted(path.stem for path in FOLDER.glob("*.md") if path.stem != "index")
RUN, SITE = FOLDER / "run.py", ROOT / ".venv" / "site"
QUICK = ("obstacle_membrane", "signorini_square")
HEADER = """---
jupytext:
  text_representation:
    extension: .md
    format_name: myst
    format_version: 0.13
kernelspec:
  display_name: Python 3
  language: python
  name: python3
---

# """
EXECUTE = """
import json, sys
import jupytext
from nbclient import NotebookClient
book = jupytext.read(sys.argv[1])
NotebookClient(
    book, timeout=600, startup_timeout=600, iopub_timeout=600,  # a busy kernel is late, and late lines are left out
    kernel_name="python3", resources={"metadata": {"path": sys.argv[2]}},
).execute()
print(json.dumps([[{"text": one.get("text", ""), "kinds": list(one.get("data", {}))} for one in cell.outputs]
                  for cell in book.cells if cell.cell_type == "code"]))
"""


def test_there_are_notebooks() -> None:
    """Those that run.py knows are those of the folder, and the index lists each."""
    listed = re.findall(
        r"^(\w+)$",
        (FOLDER / "index.md").read_text("utf-8").partition("```{toctree}")[2],
        re.MULTILINE,
    )
    known = re.search(r"^NAMES = \((.*?)^\)$", RUN.read_text("utf-8"), re.MULTILINE | re.DOTALL)
    assert (
        known
        and set(re.findall(r'"(\w+)"', known[1])) == set(NAMES) == set(listed)
        and len(NAMES) >= 6
    )


@pytest.mark.parametrize("name", NAMES)
def test_a_notebook_is_text_without_outputs(name: str) -> None:
    """Cells are Python; nothing is kept of a run; the first lines say for whom; the last cell
    checks numbers."""
    text = (FOLDER / f"{name}.md").read_text(encoding="utf-8")
    assert text.startswith(HEADER)
    fences = re.findall(r"^```(.*)$", text, re.MULTILINE)
    assert fences[::2] == ["{code-cell} ipython3"] * (len(fences) // 2) and set(fences[1::2]) == {
        ""
    }
    assert len(fences) >= 16 and not re.search(
        r"base64,[A-Za-z0-9+/]{40}|^ *outputs?:|https?://", text, re.MULTILINE
    )
    told = text.split("\n\n")[2]
    assert told.startswith("This notebook is for ") and "minutes to read" in told.replace("\n", " ")
    assert "to run" in told
    assert re.search(r"^## Exercises\n\n1\. ", text, re.MULTILINE)
    *cells, last = re.findall(
        r"^```\{code-cell\} ipython3\n(.*?)^```$", text, re.MULTILINE | re.DOTALL
    )
    assert len(re.findall(r"^ *assert ", last, re.MULTILINE)) >= 5 and "assert" not in "".join(
        cells
    )
    for cell in (*cells, last):
        compile(cell, name, "exec")


def plain(names: tuple[str, ...], folder: Path) -> str:
    """What notebooks print as plain programs, run in a folder of their own."""
    done = subprocess.run(
        [sys.executable, str(RUN), *names, "--out", "pictures"],
        cwd=folder,
        capture_output=True,
        encoding="utf-8",
        timeout=600,
        check=False,
        env=os.environ | {"PYTHONIOENCODING": "utf-8"},
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_quick_ones_run_as_programs(tmp_path: Path) -> None:
    """Their last cells pass, and they draw."""
    pytest.importorskip("dolfinx")
    told = r"^all numbers are as the page says\n(\w+): .* s of processor time, pictures in "
    ends = re.findall(told, plain(QUICK, tmp_path), re.MULTILINE)
    assert ends == list(QUICK)  # the one line that docs/start/ten_minutes_bar.md tells of
    for name in QUICK:
        assert all(
            (tmp_path / "pictures" / f"{name}_{k}.png").stat().st_size > 5000 for k in (1, 2)
        )


@pytest.mark.slow
@pytest.mark.parametrize("name", NAMES)
def test_a_notebook_runs_in_jupyter(name: str, tmp_path: Path) -> None:
    """As the site's build runs it: from its folder, without anything installed; each has pictures
    or a film."""
    pytest.importorskip("dolfinx")
    installed = SITE / "installed"
    if (
        not installed.is_file()
        or installed.read_bytes() != (ROOT / "install" / "site-requirements.txt").read_bytes()
    ):
        pytest.skip("Jupyter's kernel and jupytext are missing: bash install/site.sh brings them")
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(
        [str(SITE / "bin" / "python"), "-c", EXECUTE, str(FOLDER / f"{name}.md"), str(FOLDER)],
        cwd=tmp_path,
        env=environment | {"JUPYTER_PREFER_ENV_PATH": "1", "PYTHONIOENCODING": "utf-8"},
        capture_output=True,
        encoding="utf-8",
        timeout=600,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    cells = json.loads(done.stdout.splitlines()[-1])
    # a busy kernel sends one line in several messages
    told = "".join(one["text"] for one in cells[-1])
    assert told == "all numbers are as the page says\n"
    kinds = [kind for cell in cells for one in cell for kind in one["kinds"]]
    assert kinds.count("image/png") >= 2 and ("text/html" in kinds) == (name == "shaken_wall")
