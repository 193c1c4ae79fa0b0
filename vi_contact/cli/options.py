"""Options that several commands share, and checks of the files they write."""

import argparse
import math
import tomllib
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ..core.checks import counted, shown
from ..core.errors import InputError

MOST_SPACED = 100_000  # periods or frequencies of a spectrum
PICTURES = (".png", ".pdf", ".svg")
_TOLD = tomllib.loads(Path(__file__).with_name("options.toml").read_text(encoding="utf-8"))


def add_command(
    commands: Any,
    name: str,
    run: Callable[[argparse.Namespace], str],
    *parts: str,
    words: Mapping[str, Any] | None = None,
) -> argparse.ArgumentParser:
    """Add a command and return its parser.

    It may be an action of one such as "motion info"; it has these parts of options.toml.

    run: what it calls. words: what the texts there, and the names of types, are looked up in.
    """
    known, command = {"float": float, "int": int} | dict(words or {}), _TOLD[name]
    told = command["help"]
    about = command.get("description", f"{told[0].upper()}{told[1:]}.")
    parser: argparse.ArgumentParser = commands.add_parser(
        name.split()[-1], help=told, description=about
    )
    for part in parts:
        table = _TOLD[part]
        titled = (
            parser.add_argument_group(table["title"], table.get("about"))
            if "title" in table
            else parser
        )
        _add(titled, table, known)
    parser.set_defaults(run=run)
    return parser


def add_actions(commands: Any, name: str) -> Any:
    """Add a command that has actions, and return what they are added to."""
    actions = commands.add_parser(name, help=_TOLD[name]["help"])
    return actions.add_subparsers(dest="action", required=True, metavar="ACTION")


def _add(place: Any, table: Mapping[str, Any], known: Mapping[str, Any]) -> None:
    """Add the options of a table, which are its own tables."""
    for option, told in table.items():
        if option == "one_of":
            _add(
                place.add_mutually_exclusive_group(required=told.get("required", False)),
                told,
                known,
            )
        elif isinstance(told, dict):
            given = told | {"help": told["help"].format_map(known)}
            given |= {"type": known[told["type"]]} if "type" in told else {}
            if isinstance(told.get("metavar"), list):
                given["metavar"] = tuple(told["metavar"])
            place.add_argument(option, **given)


def spaced(option: str, values: Sequence[float]) -> Any:
    """Read FROM, TO, N as N logarithmically spaced numbers.

    It raises InputError for others, before memory is taken.
    """
    first, last, count = values
    if not (0.0 < first < last < math.inf and 2 <= count < math.inf and count == int(count)):
        raise InputError(
            f"{option} {first:g} {last:g} {count:g}: give FROM below TO and a whole number N from "
            "2 on"
        )
    return np.geomspace(
        first, last, counted(option, f"N = {count:g}", count, "numbers", most=MOST_SPACED)
    )


def output_file(
    path: str | Path, *, reads: Iterable[str | Path] = (), picture: bool = False
) -> Path:
    """Return the file that a command is about to write, checked before any work is done.

    reads: files of its input, which it must not overwrite; picture: whether its name says the
    format of a picture. InputError for a folder, a file in no folder, one of ``reads``, or a name
    without the ending of a picture.
    """
    out = Path(path)
    try:
        with suppress(FileNotFoundError):
            out.stat()  # is_dir alone hides from Python 3.14 on what OSError says
        fits = out.parent.is_dir() and not out.is_dir()
    except (OSError, ValueError):
        # a name that is too long or holds NUL, a folder that may not be looked into
        fits = False
    if not fits:
        raise InputError(
            f"{shown(str(path))}: cannot be written; give the name of a file in a folder that "
            "exists"
        )
    if picture and out.suffix.lower() not in PICTURES:
        raise InputError(
            f"{out}: a picture ends in {', '.join(PICTURES[:-1])} or {PICTURES[-1]}; give it such "
            "a name"
        )
    if out.exists() and any(Path(one).exists() and out.samefile(one) for one in reads):
        raise InputError(
            f"{out} is read by this command, which would overwrite it: give another name for the "
            "output"
        )
    return out
