"""Run the snippets and commands of the pages, with Sybil (``bash docs/test.sh``).

Each page has a folder that looks like a clone. In the order of the page, ``python`` blocks run and
share their names, ``sh`` blocks run as a reader types them, and the lines of a ``text`` block must
have been printed, in their order, by the blocks above it; a word ``...`` of theirs stands for any
word, where a number hangs on the rounding of the machine. Every block is also a file, block.py or
block.toml or block.geo, until the next one of its language.

What a page needs and does not show stands in it as a comment, and so does what is not run:

    <!-- invisible-code-block: sh
    cp block.toml wall.toml
    -->
    <!-- skip: next "needs Slurm" -->
    <!-- clear-namespace -->

``vi-contact`` and ``python3`` are those of this clone, and three records of shaking are there.
``keep PICTURE NAME`` in a comment says which file of the run is which picture of docs/figures. With
VI_CONTACT_FIGURES=DIR, from the root, it is put there.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shutil
import subprocess
import tempfile
from difflib import get_close_matches
from functools import partial
from pathlib import Path
from typing import Any

from sybil import Example, Sybil
from sybil.parsers.myst import ClearNamespaceParser, CodeBlockParser, SkipParser

ROOT = Path(__file__).resolve().parents[1]
LIMIT = 900  # s, of a block of commands
NEAR = 2e-3  # numbers agree relatively, or as residuals do:
BOUND = 1e-9  # both are below the bound of certificates, or
SMALL, ORDER = 1e-7, 10.0  # both are that small, and one is at most ten times the other
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?")
PRINTED: list[str] = []  # lines, by the blocks of this page
FOLDERS = tempfile.TemporaryDirectory(prefix="pages_")  # removed at the end
PALETTE = """
import sys
from PIL import Image  # 256 colours: a third of the size
picture = Image.open(sys.argv[1]).convert("RGB").quantize(256, dither=Image.Dither.NONE)
picture.save(sys.argv[2], optimize=True)
"""
SHELL = f"""set -e
. "{ROOT}/install/setup.sh"; vi_setup >&2
vi-contact() {{ "$vi_python" -m vi_contact "$@"; }}
python3() {{ "$vi_python" "$@"; }}
keep() {{ "$vi_python" -c '{PALETTE}' "$1" "${{VI_CONTACT_FIGURES:-.}}/$2"; }}
export -f vi-contact python3; export vi_python
"""


def residuals(size: float, other: float) -> bool:
    """Say whether two sizes are alike as rounding is.

    Another processor makes more or less of it.
    """
    least, most = sorted((size, other))
    return most <= BOUND or (most <= SMALL and most <= ORDER * least)


def agree(line: str, printed: str) -> bool:
    """Say whether two lines have the same words and, but for rounding, the same numbers.

    A word ``...`` of the page stands for any word.
    """
    words, others = line.split(), printed.split()
    return len(words) == len(others) and all(map(alike, words, others))


def alike(word: str, printed: str) -> bool:
    """Say whether two words are the same but for the rounding of numbers in them."""
    if word == "...":
        return True
    if NUMBER.sub("#", word) != NUMBER.sub("#", printed):
        return False
    pairs = zip(map(float, NUMBER.findall(word)), map(float, NUMBER.findall(printed)), strict=True)
    return all(
        abs(a - b) <= NEAR * max(abs(a), abs(b)) or residuals(abs(a), abs(b)) for a, b in pairs
    )


def run_python(example: Example) -> None:
    """Run a block with the names of those above it, and keep what it prints."""
    code = str(example.parsed)
    Path("block.py").write_text(code, encoding="utf-8")
    printed = io.StringIO()
    lines = "\n" * (example.line + example.parsed.line_offset)  # errors tell the line of the page
    with contextlib.redirect_stdout(printed):
        exec(compile(lines + code, example.path, "exec"), example.namespace)
    PRINTED.extend(printed.getvalue().splitlines())


def run_commands(example: Example) -> None:
    """Run a block as a reader types it, and keep what it prints."""
    done = subprocess.run(
        ["bash", "-c", SHELL + str(example.parsed)],
        stdin=subprocess.DEVNULL,
        capture_output=True,
        encoding="utf-8",
        timeout=LIMIT,
    )
    PRINTED.extend(done.stdout.splitlines())
    assert done.returncode == 0, done.stderr[-2000:] or done.stdout[-2000:]


def compare(example: Example) -> None:
    """Find the lines of a block in what was printed, in their order."""
    printed = iter(PRINTED)
    for line in filter(str.strip, str(example.parsed).splitlines()):
        if line.strip().startswith("wall time"):  # the clock's
            continue
        if not any(agree(line, one) for one in printed):
            nearest = get_close_matches(line, PRINTED, n=3, cutoff=0.0)
            raise AssertionError("\n".join([f"not printed here: {line}", "but:", *nearest]))


def keep(example: Example, file: str) -> None:
    """Write a block into a file."""
    Path(file).write_text(str(example.parsed), encoding="utf-8")


def begin(namespace: dict[str, Any]) -> None:
    """Go into a new folder that looks like a clone, with records of shaking."""
    folder = Path(tempfile.mkdtemp(dir=FOLDERS.name))
    for one in ROOT.iterdir():
        # not .venv: a page must not install anything into it
        if one.name not in ("results", "build") and not one.name.startswith("."):
            (folder / one.name).symlink_to(one)
    samples = "\n".join(f"{0.03 * (-1) ** (k // 5) * (1 - k / 100):.4f}" for k in range(100))
    for name in ("elcentro.at2", "h.at2", "v.at2"):
        (folder / name).write_text(f"A motion\nunits of g\nNPTS= 100, DT= .01 SEC\n{samples}\n")
    os.environ["PYTHONPATH"] = str(ROOT)
    if figures := os.environ.get("VI_CONTACT_FIGURES"):
        os.environ["VI_CONTACT_FIGURES"] = str(ROOT / figures)
    os.chdir(folder)
    PRINTED.clear()
    namespace |= {"__name__": "__main__", "which": shutil.which}


pytest_collect_file = Sybil(
    parsers=[
        CodeBlockParser("python", run_python),
        CodeBlockParser("sh", run_commands),
        CodeBlockParser("text", compare),
        CodeBlockParser("toml", partial(keep, file="block.toml")),
        CodeBlockParser("c++", partial(keep, file="block.geo")),
        SkipParser(),
        ClearNamespaceParser(),
    ],
    patterns=["*.md"],
    setup=begin,
).pytest()
