"""``vi-contact ida CASE.toml``: options and what the command does."""

import argparse
import shlex
import signal
from typing import Any

from ..core.checks import shown
from ..core.errors import InputError, OutOfTime, ViContactError
from ..studies.cases.library import located
from .options import WALL_TIME, add_settings


def add_ida_commands(commands: Any) -> None:
    """Add ``ida`` to the commands of the top parser."""
    sentence = "incremental dynamic analysis: a case file under many records, each at many intensities"
    one = commands.add_parser("ida", help=sentence, description=sentence[0].upper() + sentence[1:] + ".")
    one.add_argument("case", help="case file shaken by GroundMotions (docs/guide/studies.md)")
    one.add_argument("--motions", nargs="+", required=True, metavar="FILE",
                     help="record files, H.at2,V.at2 where the case has two ground motions; a folder of them; @LIST, a "
                     "file with a record a line")
    values = one.add_mutually_exclusive_group(required=True)
    values.add_argument("--scales", type=_numbers, metavar="F,F,...", help="factors on the motions")
    values.add_argument("--levels", type=_numbers, metavar="I,I,...", help="values of the intensity measure, SI units")
    one.add_argument("--im", default="pga", metavar="IM",
                     help="intensity of the first motion: pga (default), pgv, pgd, sa:T (5 %% damping, T in s), sa:T1 "
                     "(at the first period of the model), arias, cav, housner")
    one.add_argument("--edp", nargs="+", required=True, metavar="COLUMN[:WAY]",
                     help="columns of history.csv; WAY: absmax (default), max, min, last")
    one.add_argument("--fragility", nargs="+", default=(), metavar="COLUMN:WAY=LIMIT",
                     help="fit the probability that a demand passes this limit, in the unit of its column")
    one.add_argument("--out", required=True, metavar="DIR", help="folder of the study; the same again to go on")
    one.add_argument("--jobs", type=int, default=1, metavar="N", help="processes, of up to 8 runs each (default 1)")
    one.add_argument("--part", type=_part, default=(1, 1), metavar="I/N", help="only every N-th run, for job arrays")
    one.add_argument("--launch", default="", metavar="WORDS", help="in front of every run, such as 'mpirun -n 4'")
    one.add_argument("--wall-time", metavar="TIME", help=f"{WALL_TIME}; every run gets what is left")
    add_settings(one)
    one.set_defaults(run=_ida)


def _numbers(text: str) -> tuple[float, ...]:
    try:
        return tuple(float(word) for word in text.split(","))
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no list of numbers such as 0.5,1,2") from None


def _part(text: str) -> tuple[int, int]:
    first, slash, count = text.partition("/")
    if not (slash and first.isdecimal() and count.isdecimal()):
        raise argparse.ArgumentTypeError(f"{text!r} is no part such as 1/4")
    return int(first), int(count)


def _ida(options: argparse.Namespace) -> str:
    from ..studies.cases.case import read_case
    from ..studies.ida.ida import IDA, run_ida
    from ..studies.ida.runs import record_set

    try:
        launch = shlex.split(options.launch)
    except ValueError as error:
        raise InputError(f"--launch {shown(options.launch)}: {error}; close the quotation mark") from None
    motions = [files for motion in options.motions for files in record_set(motion)]
    study = IDA(read_case(located(options.case), options.settings, allow=options.allow), motions, options.edp,
                scales=options.scales or (), levels=options.levels or (), intensity=options.im,
                limits=options.fragility)
    for signum in (signal.SIGINT, signal.SIGTERM):  # a scheduler's end of time is as Ctrl-C, also in the background
        signal.signal(signum, signal.default_int_handler)
    try:
        rows = run_ida(study, options.out, jobs=options.jobs, part=options.part, launch=launch,
                       say=lambda line: print(line, flush=True), wall_time=options.wall_time)
    except OutOfTime:
        raise
    except KeyboardInterrupt:
        raise ViContactError("interrupted: give the same command again to go on") from None
    failed = [row["reason"] for row in rows if row["status"] != "finished"]
    if failed:
        raise ViContactError(f"{len(failed)} of {len(rows)} runs have failed, the first because: {failed[0]}; all rows "
                             f"are in {options.out}/ida.csv")
    return f"{len(rows)} rows, 0 of failed runs: {options.out}/ida.csv, ida.png"
