"""Options that several commands share, and checks of the files they write."""

import argparse
import math
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from ...core.checks import check_count, quote
from ...core.errors import InputError

MOST_SPACED = 100_000  # periods or frequencies of a spectrum
PICTURES = (".png", ".pdf", ".svg")


def add_command(
    commands: Any,
    name: str,
    run: Callable[[argparse.Namespace], str],
    *,
    help: str,
    description: str | None = None,
) -> argparse.ArgumentParser:
    """Add a command, and return its parser for its options.

    Args:
        commands: what argparse's ``add_subparsers`` returned, of the top parser or of a command
            that has actions.
        name: the word that calls it.
        run: what it does; it returns the text that is printed.
        help: the line about it in the list of commands, without a period.
        description: the text above its options; ``help`` as a sentence when None.
    """
    if description is None:
        description = f"{help[0].upper()}{help[1:]}."
    parser: argparse.ArgumentParser = commands.add_parser(name, help=help, description=description)
    parser.set_defaults(run=run, parser=parser)
    return parser


def add_actions(commands: Any, name: str, *, help: str) -> Any:
    """Add a command that has actions.

    Args:
        commands: what argparse's ``add_subparsers`` returned, of the top parser.
        name: the word that calls it.
        help: the line about it in the list of commands, without a period.

    Returns:
        what its actions are added to by ``add_command``.
    """
    actions = commands.add_parser(name, help=help)
    return actions.add_subparsers(dest="action", required=True, metavar="ACTION")


def add_settings(parser: argparse.ArgumentParser) -> None:
    """Add the options that change a case and allow classes of the user's own."""
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="KEY=VALUE",
        dest="settings",
        help=(
            "replace a value of the case, such as friction.mu=0.5 or "
            "excitation.1.scale=2; KEY= alone removes the value; the option may be "
            "repeated"
        ),
    )
    parser.add_argument(
        "--allow",
        action="append",
        default=[],
        metavar="PACKAGE",
        help=(
            "allow the case to name classes of this Python package as "
            "package.module:Name, and so to run its code; the option may be repeated "
            "(docs/guide/extend.md)"
        ),
    )


def add_folder(parser: argparse.ArgumentParser) -> None:
    """Add the argument of commands that read the folder of a run."""
    parser.add_argument("folder", metavar="DIR", help="output folder of a run")


def space_numbers(option: str, values: Sequence[float]) -> Any:
    """Read FROM, TO, N as N logarithmically spaced numbers.

    Raises:
        InputError: for others, before memory is taken.
    """
    first, last, count = values
    if not (0.0 < first < last < math.inf and 2 <= count < math.inf and count == int(count)):
        raise InputError(
            f"{option} {first:g} {last:g} {count:g}: give FROM below TO and a whole number N from "
            "2 on"
        )
    number = check_count(option, f"N = {count:g}", count, "numbers", most=MOST_SPACED)
    return np.geomspace(first, last, number)


def output_file(
    path: str | Path, *, reads: Iterable[str | Path] = (), picture: bool = False
) -> Path:
    """Return the file that a command is about to write, checked before any work is done.

    Args:
        path: the file.
        reads: files of the command's input, which it must not overwrite.
        picture: whether the name says the format of a picture.

    Raises:
        InputError: a folder, a file in no folder, one of ``reads``, or a name without the ending
            of a picture.
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
            f"{quote(str(path))}: cannot be written; give the name of a file in a folder that "
            "exists"
        )
    if picture and out.suffix.lower() not in PICTURES:
        raise InputError(
            f"{out}: a picture ends in {', '.join(PICTURES[:-1])} or {PICTURES[-1]}; give it such "
            "a name"
        )
    if out.exists() and any(Path(source).exists() and out.samefile(source) for source in reads):
        raise InputError(
            f"{out} is read by this command, which would overwrite it: give another name for the "
            "output"
        )
    return out
