"""``vi-contact ida CASE.toml``: options and what the command does."""

import argparse
import shlex
import signal
from typing import Any

from ..core.checks import shown
from ..core.errors import InputError, OutOfTime, ViContactError
from ..studies.cases.library import located
from .errors import say
from .options import add_command


def add_ida_commands(commands: Any) -> None:
    """Add ``ida`` to the commands of the top parser."""
    add_command(
        commands,
        "ida",
        _ida,
        "ida",
        "ida options",
        "settings",
        words={"numbers": _numbers, "part": _part},
    )


def _numbers(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(word) for word in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a list of numbers: give numbers such as 0.5,1,2"
        ) from None


def _part(text: str) -> tuple[int, int]:
    first, slash, count = text.partition("/")
    if not (slash and first.isdecimal() and count.isdecimal()):
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a part: give a part such as 1/4, the first of four"
        )
    return int(first), int(count)


def _ida(options: argparse.Namespace) -> str:
    from ..studies.cases.case import read_case
    from ..studies.ida.ida import IDA, run_ida
    from ..studies.ida.runs import record_set

    try:
        launch = shlex.split(options.launch)
    except ValueError as error:
        raise InputError(
            f"--launch {shown(options.launch)}: {error}; close the quotation mark"
        ) from None
    motions = [files for motion in options.motions for files in record_set(motion)]
    study = IDA(
        read_case(located(options.case), options.settings, allow=options.allow),
        motions,
        options.edp,
        scales=options.scales or (),
        levels=options.levels or (),
        intensity=options.im,
        limits=options.fragility,
    )
    # a scheduler's end of time is as Ctrl-C, also in the background
    for signum in (signal.SIGINT, signal.SIGTERM):
        signal.signal(signum, signal.default_int_handler)
    try:
        rows = run_ida(
            study,
            options.out,
            jobs=options.jobs,
            part=options.part,
            launch=launch,
            say=say,
            wall_time=options.wall_time,
        )
    except OutOfTime:
        raise
    except KeyboardInterrupt:
        raise ViContactError(
            "interrupted: give the same command again to continue the study"
        ) from None
    failed = [row["reason"] for row in rows if row["status"] != "finished"]
    if failed:
        raise ViContactError(
            f"{len(failed)} of {len(rows)} runs have failed, the first because: {failed[0]}; all "
            f"rows with their reasons are in {options.out}/ida.csv"
        )
    return f"{len(rows)} runs, 0 of them failed: {options.out}/ida.csv, ida.png"
