"""``vi-contact ida CASE.toml``: options and what the command does."""

import argparse
import shlex
import signal
from typing import Any

from ...core.checks import quote
from ...core.errors import InputError, OutOfTime, ViContactError
from ..studies.cases.library import located
from .errors import say
from .options import add_command, add_settings


def add_ida_commands(commands: Any) -> None:
    """Add ``ida`` to the commands of the top parser."""
    ida = add_command(
        commands,
        "ida",
        _ida,
        help=(
            "incremental dynamic analysis: run a case file under many records, each at several "
            "intensities"
        ),
    )
    ida.add_argument(
        "case",
        help=(
            "case file whose excitation is one or more GroundMotion tables (docs/guide/studies.md)"
        ),
    )
    ida.add_argument(
        "--motions",
        nargs="+",
        required=True,
        metavar="FILE",
        help=(
            "record files, each as H.at2,V.at2 when the case has two ground motions; or "
            "a folder of record files; or @LIST, where LIST is a text file with one "
            "record in each line"
        ),
    )
    one_of = ida.add_mutually_exclusive_group(required=True)
    one_of.add_argument(
        "--scales",
        type=_numbers,
        metavar="F,F,...",
        help="run each motion multiplied by each of these factors",
    )
    one_of.add_argument(
        "--levels",
        type=_numbers,
        metavar="I,I,...",
        help=("scale each motion to each of these values of the intensity measure, in SI units"),
    )
    _add_study(ida)
    add_settings(ida)


def _add_study(parser: argparse.ArgumentParser) -> None:
    """Add the options of the demands, of the output and of the processes."""
    parser.add_argument(
        "--im",
        default="pga",
        metavar="IM",
        help=(
            "intensity measure of the first motion: pga (default), pgv, pgd, sa:T (5 %% "
            "damping, T in s), sa:T1 (at the first natural period of the model), arias, "
            "cav or housner"
        ),
    )
    parser.add_argument(
        "--edp",
        nargs="+",
        required=True,
        metavar="COLUMN[:WAY]",
        help=(
            "demands: columns of history.csv, each with the value that counts, WAY = "
            "absmax (default), max, min or last"
        ),
    )
    parser.add_argument(
        "--fragility",
        nargs="+",
        default=[],
        metavar="COLUMN:WAY=LIMIT",
        help=(
            "fit the probability that a demand passes this limit; give the limit in the "
            "unit of the column"
        ),
    )
    parser.add_argument(
        "--out",
        required=True,
        metavar="DIR",
        help="folder of the study; give the same folder again to continue the study",
    )
    parser.add_argument(
        "--jobs",
        type=int,
        default=1,
        metavar="N",
        help="number of processes at a time, each with up to 8 runs (default 1)",
    )
    parser.add_argument(
        "--part",
        type=_part,
        default="1/1",
        metavar="I/N",
        help="compute every N-th run only, beginning with run I; use it in job arrays",
    )
    parser.add_argument(
        "--launch",
        default="",
        metavar="WORDS",
        help="words before the command of every run, such as 'mpirun -n 4'",
    )
    parser.add_argument(
        "--wall-time",
        metavar="TIME",
        help=(
            "write checkpoints and end with status 75 before this time since the start "
            "is over; give hours:minutes:seconds, or another form that Slurm reads as "
            "--time; every run gets the time that is left"
        ),
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
            f"--launch {quote(options.launch)}: {error}; close the quotation mark"
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
