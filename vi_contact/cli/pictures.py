"""``vi-contact report``, ``plot`` and ``film``: options and what the commands do."""

import argparse
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..core.checks import shown
from ..core.errors import InputError
from .errors import world
from .options import add_command, output_file


def add_picture_commands(commands: Any) -> None:
    """Add ``report``, ``plot`` and ``film`` to the commands of the top parser."""
    for name, run, more in (
        ("report", _report, ()),
        ("plot", _plot, ("magnify",)),
        ("film", _film, ("magnify",)),
    ):
        one = add_command(commands, name, run, name, "folder", *more)
        one.set_defaults(spelling={"magnified": "--magnify"})


def _report(options: argparse.Namespace) -> str:
    with suppress(ImportError):  # a report needs no MPI
        import mpi4py.MPI  # noqa: F401  # first: ``world`` finds it

    from ..plots.web_page import MISSING, can_write
    from ..studies.refinement import refine
    from ..studies.report import report

    comm = world()
    if options.out is not None:
        output_file(options.out)
    failed = refine(options.folder, comm, allow=options.allow) if options.refine else None
    if comm.rank != 0:
        return ""
    columns = None if options.show is None else [one.split(",") for one in options.show]
    told, written = report(
        options.folder, out=options.out, title=options.title, columns=columns, failed=failed
    )
    lines = [
        *told.sentences,
        *(
            f"{row[0]:<48}" + "".join(f"{cell:>13}" for cell in row[1:])
            for table in told.tables
            for row in (table.header, *table.rows)
        ),
    ]
    missing = [] if options.out is not None or can_write() else [f"no report.html: {MISSING}"]
    return "\n".join([*(lines if options.refine else ()), *map(str, written), *missing])


def _plot(options: argparse.Namespace) -> str:
    from ..plots.bodies import draw_run

    run, frames, title, times = _opened(options)
    out = output_file(Path(options.out or options.folder) / "deformed.png").parent
    return "\n".join(
        map(str, draw_run(run, out, title=title, times=times, magnified=options.magnified))
    )


def _film(options: argparse.Namespace) -> str:
    from ..plots.bodies import film

    run, frames, title, times = _opened(options)
    out = output_file(options.out or Path(options.folder) / "film.gif")
    if times is not None:
        times = [t for t in frames.t.tolist() if times[0] <= t <= times[-1]]
    return str(
        film(run, out, times=times, magnified=options.magnified, column=options.column, title=title)
    )


def _opened(options: argparse.Namespace) -> tuple[Any, Any, str, list[float] | None]:
    """Return the run, its frames, its title, and the moments.

    These are the moments asked for, which have to be within the run.
    """
    from ..plots.deformed import read_frames
    from ..run.files.reading import read_run
    from ..studies.cases.library import read_copy

    run, asked, times = read_run(options.folder), options.times, None
    frames, (first, last) = read_frames(run), run.history["t"][[0, -1]]
    if asked is not None:
        try:
            times = [float(one) for one in asked.split(",")]
        except ValueError:
            raise InputError(
                f"{shown(asked)} is not a list of moments: give seconds, such as 3.2,5"
            ) from None
        slack = 1e-9 * (last - first)
        if not all(first - slack <= one <= last + slack for one in times):
            raise InputError(
                f"{shown(asked)} is outside the run: give seconds from {first:g} to {last:g}"
            )
    return run, frames, str(read_copy(run.folder).get("title", "Deformed bodies")), times
