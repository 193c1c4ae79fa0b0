#!/usr/bin/env python3
"""Run the demos of the gallery, take their pictures, and compare what they print with what their
pages say.

    python3 docs/gallery/make.py                      all entries of demos.toml and made_by.toml, into build/gallery
    python3 docs/gallery/make.py --only wall crack    these alone
    python3 docs/gallery/make.py --jobs 1             one after the other instead of two at a time
    python3 docs/gallery/make.py --into build/site/_images    and put their pictures in the place of the stored ones
    python3 docs/gallery/make.py --store              and put them into docs/figures
    python3 docs/gallery/make.py --index              write index.md from demos.toml, and run nothing

Every entry runs in a process of its own. It runs again when its own files, the package or its entry
changed. The build of the site calls this script. It needs the standard library only; the demos
bring what they need.
"""

from __future__ import annotations

import argparse
import ast
import hashlib
import json
import os
import re
import shutil
import subprocess
import sys
import time
import tomllib
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
MADE = ROOT / "build" / "gallery"
COLUMNS = 2  # of the gallery
NEAR = 2e-3  # numbers agree relatively, or as residuals do:
BOUND = 1e-9  # both are below the bound of certificates, or
SMALL, ORDER = 1e-7, 10.0  # both are that small, and one is at most ten times the other
JOBS = 2  # entries that run at the same time
NUMBER = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?")
SHELL = """set -e
. "{root}/install/setup.sh"; vi_setup
vi-contact() {{ "$vi_python" -m vi_contact "$@"; }}
python3() {{ [ -f "$1" ] || set -- "{root}/$1" "${{@:2}}"; "$vi_python" "$@"; }}
bash() {{ command bash "{root}/$1" "${{@:2}}"; }}
{commands}
"$vi_python" -c '{palette}' {pictures}
"""
PALETTE = """
import sys
from PIL import Image
for made, kept in zip(sys.argv[1::2], sys.argv[2::2]):  # 256 colours: a third of the size
    Image.open(made).convert("RGB").quantize(256, dither=Image.Dither.NONE).save(kept, optimize=True)
"""
Entry = Mapping[str, Any]


def entries() -> dict[str, Entry]:
    """Return name -> entry of demos.toml, with its commands and its page."""
    raw = tomllib.loads((HERE / "demos.toml").read_text(encoding="utf-8"))
    found = {}
    for group in raw["group"]:
        for name, entry in group["entries"].items():
            usual = {"commands": [f"bash demos/run.sh {name}"], "page": f"{name}.md"}
            found[name] = usual | entry
    return found


def page_entries() -> dict[str, Entry]:
    """Return name -> entry of made_by.toml: pictures of other pages, from blocks and commands of
    these pages."""
    raw = tomllib.loads((HERE / "made_by.toml").read_text(encoding="utf-8"))
    return {name: {"blocks": {}} | entry for name, entry in raw["made"].items()}


def files(entry: Entry) -> dict[str, str]:
    """Return what the page of an entry says is to be in files: name -> text."""
    found = {}
    for name, words in entry.get("blocks", {}).items():
        language, number = words.split()
        text = (ROOT / entry["page"]).read_text(encoding="utf-8")
        blocks = re.findall(
            rf"^```{re.escape(language)}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL
        )
        found[name] = blocks[int(number) - 1]
    return found


def imported(path: Path, seen: set[Path]) -> set[Path]:
    """Return the file and all of demos/ and meshes/ that it imports, directly or not."""
    if path in seen or not path.is_file():
        return seen
    seen.add(path)
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        names = []
        if isinstance(node, ast.Import):
            names = [one.name for one in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = "." * node.level + (node.module or "")
            if node.level:
                base = ".".join(
                    [*path.relative_to(ROOT).parts[: -node.level], *filter(None, [node.module])]
                )
            names = [base, *(f"{base}.{one.name}" for one in node.names)]
        for name in names:
            if name.split(".")[0] in ("demos", "meshes"):
                place = ROOT.joinpath(*name.split("."))
                imported(place.with_suffix(".py"), seen)
                imported(place / "__init__.py", seen)
    return seen


def key(name: str, entry: Entry) -> str:
    """Return the hash of all that the pictures of an entry depend on."""
    scripts = [word for line in entry["commands"] for word in line.split() if word.endswith(".py")]
    used = imported(ROOT / "demos" / f"{name}.py", set())
    for script in scripts:
        imported(ROOT / script, used)
    used |= {
        path
        for path in (ROOT / "vi_contact").rglob("*")
        if path.suffix in (".py", ".toml", ".geo", ".csv")
    }
    given = [entry["commands"], entry["pictures"], *files(entry).items()]
    told = hashlib.sha256(json.dumps(given).encode())
    for path in sorted(used):
        told.update(str(path.relative_to(ROOT)).encode() + path.read_bytes())
    return told.hexdigest()


def make(name: str, entry: Entry) -> dict[str, Any]:
    """Run an entry, unless it is made already; keep its pictures and what it prints; return the
    times of its run."""
    place, now = MADE / name, key(name, entry)
    note = place / "made.json"
    if note.is_file() and json.loads(note.read_text())["key"] == now:
        return json.loads(note.read_text()) | {"cached": True}
    shutil.rmtree(place, ignore_errors=True)
    (place / "run").mkdir(parents=True)
    for file, text in files(entry).items():
        (place / "run" / file).write_text(text, encoding="utf-8")
    script = SHELL.format(
        root=ROOT,
        commands="\n".join(entry["commands"]),
        palette=PALETTE,
        pictures=" ".join(
            f'"{source}" "{place / picture}"' for picture, source in entry["pictures"].items()
        ),
    )
    start = time.monotonic()
    with (
        (place / "printed.txt").open("w") as printed,
        (place / "complaints.txt").open("w") as complaints,
    ):
        started = subprocess.Popen(
            ["bash", "-c", script], cwd=place / "run", stdout=printed, stderr=complaints
        )
        # the times of this entry, not of those beside it
        _, status, used = os.wait4(started.pid, 0)
        started.returncode = os.waitstatus_to_exitcode(status)
    if started.returncode:
        said = (place / "complaints.txt").read_text(encoding="utf-8", errors="replace")
        raise RuntimeError(f"gallery: {name} failed:\n{said[-2000:].rstrip()}")
    shutil.rmtree(place / "run")
    told = {
        "key": now,
        "processor": used.ru_utime + used.ru_stime,
        "wall": time.monotonic() - start,
    }
    note.write_text(json.dumps(told))
    return told | {"cached": False}


def agree(line: str, other: str) -> bool:
    """Say whether two lines have the same words and, but for rounding, the same numbers."""
    if NUMBER.sub("#", line).split() != NUMBER.sub("#", other).split():
        return False
    pairs = zip(map(float, NUMBER.findall(line)), map(float, NUMBER.findall(other)), strict=True)
    return all(
        abs(a - b) <= NEAR * max(abs(a), abs(b)) or residuals(abs(a), abs(b)) for a, b in pairs
    )


def residuals(size: float, other: float) -> bool:
    """Say whether two sizes are alike as rounding is, of which another processor makes more or
    less."""
    least, most = sorted((size, other))
    return most <= BOUND or (most <= SMALL and most <= ORDER * least)


def said(entry: Entry) -> list[str]:
    """Return the lines that the page of an entry says are printed: those of its blocks of text, in
    its section."""
    page, _, anchor = entry["page"].partition("#")
    text = (HERE / page).read_text(encoding="utf-8")
    if anchor:
        sections = re.findall(r"^## (.*)\n((?:(?!## ).*\n)*)", text, re.MULTILINE)
        (text,) = (body for head, body in sections if head.lower() == anchor)
    blocks = re.findall(r"^```text\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)
    return [line for block in blocks for line in block.splitlines() if line.strip()]


def compare(name: str, entry: Entry) -> list[str]:
    """Return a complaint for each line of the page that the run did not print, in that order."""
    printed, missing, at = (
        (MADE / name / "printed.txt").read_text(encoding="utf-8").splitlines(),
        [],
        0,
    )
    for line in said(entry):
        found = next((k for k in range(at, len(printed)) if agree(line, printed[k])), None)
        if found is None:
            missing.append(f"{entry['page']} has a line that the demo does not print: {line}")
        else:
            at = found + 1
    return missing


def index() -> str:
    """Return the text of index.md: groups of cells, each a picture, a sentence and a command."""
    raw = tomllib.loads((HERE / "demos.toml").read_text(encoding="utf-8"))
    lines = ["# Gallery", "", raw["head"].strip()]
    every = entries()
    for group in raw["group"]:
        lines += ["", f"## {group['title']}", "", "| " * COLUMNS + "|", "|---" * COLUMNS + "|"]
        cells = [cell(every[name]) for name in group["entries"]]
        cells += [" "] * (-len(cells) % COLUMNS)
        lines += [
            f"| {' | '.join(cells[k : k + COLUMNS])} |" for k in range(0, len(cells), COLUMNS)
        ]
    pages = dict.fromkeys(entry["page"].partition(".md")[0] for entry in every.values())
    return "\n".join(
        [*lines, "", raw["foot"].strip(), "", "```{toctree}", ":hidden:", "", *pages, "```", ""]
    )


def cell(entry: Entry) -> str:
    """Return the picture of an entry, its title, its sentence and its first command, in a line."""
    picture, page, (first, *more) = next(iter(entry["pictures"])), entry["page"], entry["commands"]
    others = f" and [{len(more)} more commands]({page})" if more else ""
    return (
        f"[![{entry['title']}](../figures/{picture})]({page}) **[{entry['title']}]({page}).** "
        f"{entry['sentence']} `{first}`{others}"
    )


def main(words: Sequence[str]) -> int:
    """Do what the command line says."""
    options = argparse.ArgumentParser(prog="make.py", description=(__doc__ or "").splitlines()[0])
    options.add_argument("--only", nargs="+", metavar="NAME", help="these entries alone")
    options.add_argument(
        "--jobs", type=int, default=JOBS, help=f"how many run at the same time; {JOBS} without it"
    )
    options.add_argument(
        "--into", type=Path, metavar="DIR", help="replace the pictures of the same name there"
    )
    options.add_argument("--store", action="store_true", help="put the pictures into docs/figures")
    options.add_argument("--index", action="store_true", help="write index.md, and run nothing")
    given = options.parse_args(words)
    if given.index:
        (HERE / "index.md").write_text(index(), encoding="utf-8")
        return 0
    gallery = entries()
    every = gallery | page_entries()
    unknown = sorted(set(given.only or ()) - set(every))
    if unknown:
        print(
            f"gallery: no entry {', '.join(unknown)}: choose from {', '.join(every)}",
            file=sys.stderr,
        )
        return 2
    names, wrong, total = given.only or list(every), 0, 0.0
    with ThreadPoolExecutor(max(1, given.jobs)) as pool:
        runs = [(name, pool.submit(make, name, every[name])) for name in names]
        for name, run in runs:
            try:
                told = run.result()
            except RuntimeError as why:
                print(why, file=sys.stderr, flush=True)
                wrong += 1
                continue
            total += 0.0 if told["cached"] else told["processor"]
            before = ", made before" if told["cached"] else ""
            print(f"{name:<22} {told['processor']:7.1f} s of a processor{before}", flush=True)
            # tests compare those of other pages
            lines = compare(name, every[name]) if name in gallery else []
            for complaint in (*lines, *keep(name, every[name], given.into, given.store)):
                wrong += 1
                print(f"gallery: {complaint}", file=sys.stderr, flush=True)
    print(f"{'used now':<22} {total:7.1f} s of a processor")
    return 1 if wrong else 0


def keep(name: str, entry: Entry, into: Path | None, store: bool) -> list[str]:
    """Copy the pictures of an entry to where they are wanted; return what is wrong with that."""
    wrong = []
    for picture in entry["pictures"]:
        made = MADE / name / picture
        if into and (into / picture).is_file():
            shutil.copyfile(made, into / picture)
        elif into:
            wrong.append(f"no page of the site shows {picture} of {name}: {into} has no such file")
        if store:
            shutil.copyfile(made, ROOT / "docs" / "figures" / picture)
    return wrong


if __name__ == "__main__":
    raise SystemExit(main(sys.argv[1:]))
