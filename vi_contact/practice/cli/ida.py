"""``vi-contact ida CASE.toml``: options and what the command does."""

import argparse
import shlex
import signal
from typing import TYPE_CHECKING, Any

from ...core.checks import quote
from ...core.errors import InputError, OutOfTime, ViContactError
from ..studies.cases.library import locate
from .errors import say
from .options import add_command, add_settings

if TYPE_CHECKING:
    from ..studies.ida.ida import IDA


def add_ida_commands(commands: Any) -> None:
    """Add ``ida`` to the commands of the top parser."""
    ida = add_command(
        commands,
        "ida",
        _analyse,
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
    choice = ida.add_mutually_exclusive_group(required=True)
    choice.add_argument(
        "--scales",
        type=_read_numbers,
        metavar="F,F,...",
        help="run each motion multiplied by each of these factors",
    )
    choice.add_argument(
        "--levels",
        type=_read_numbers,
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
        type=_read_part,
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


def _read_numbers(text: str) -> tuple[float, ...]:
    """Read numbers with commas between them."""
    try:
        return tuple(float(word) for word in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a list of numbers: give numbers such as 0.5,1,2"
        ) from None


def _read_part(text: str) -> tuple[int, int]:
    """Read "1/4" as (1, 4)."""
    first, slash, count = text.partition("/")
    if not (slash and first.isdecimal() and count.isdecimal()):
        raise argparse.ArgumentTypeError(
            f"{text!r} is not a part: give a part such as 1/4, the first of four"
        )
    return int(first), int(count)


def _analyse(options: argparse.Namespace) -> str:
    """Carry out ``vi-contact ida``: return how many runs there are; an error if one has failed."""
    from ..studies.ida.ida import run_ida

    launch = _split_launch(options.launch)
    study = _read_study(options)
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
    reasons = [row["reason"] for row in rows if row["status"] != "finished"]
    if reasons:
        raise ViContactError(
            f"{len(reasons)} of {len(rows)} runs have failed, the first because: {reasons[0]}; all "
            f"rows with their reasons are in {options.out}/ida.csv"
        )
    return f"{len(rows)} runs, 0 of them failed: {options.out}/ida.csv, ida.png"


def _split_launch(text: str) -> list[str]:
    """Split the words before the command of every run as a shell does."""
    try:
        return shlex.split(text)
    except ValueError as error:
        raise InputError(f"--launch {quote(text)}: {error}; close the quotation mark") from None


def _read_study(options: argparse.Namespace) -> "IDA":
    """Read case and records of an incremental dynamic analysis."""
    from ..studies.cases.case import read_case
    from ..studies.ida.ida import IDA
    from ..studies.ida.runs import record_set

    motions = [files for motion in options.motions for files in record_set(motion)]
    return IDA(
        read_case(locate(options.case), options.settings, allow=options.allow),
        motions,
        options.edp,
        scales=options.scales or (),
        levels=options.levels or (),
        intensity=options.im,
        limits=options.fragility,
    )
