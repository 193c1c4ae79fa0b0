"""Name the table that an action of ``vi-contact post`` writes, and its picture beside it."""

import argparse
from pathlib import Path

from ...core.errors import InputError
from ...run.files.folder import FILES
from .options import PICTURES, output_file


def add_table(parser: argparse.ArgumentParser, action: str) -> None:
    """Add the option of the file of the table; ``action`` names it otherwise."""
    parser.add_argument(
        "--out",
        metavar="CSV",
        help=f"file of the table (default: DIR/{action}.csv); the picture is written beside it",
    )


def choose_table(options: argparse.Namespace) -> Path:
    """Return the table that a command is about to write.

    A picture of the same name is written beside it. It raises InputError where a file may not be
    written.
    """
    folder = Path(options.folder)
    out = output_file(
        options.out or folder / f"{options.action}.csv", reads=[folder / name for name in FILES]
    )
    if out.suffix.lower() in PICTURES:
        raise InputError(
            f"{out}: the table would be overwritten by its picture; give a name such as "
            f"{out.stem}.csv"
        )
    output_file(out.with_suffix(PICTURES[0]))
    return out
