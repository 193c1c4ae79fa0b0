"""``vi-contact report``, ``plot`` and ``film``: options and what the commands do."""

import argparse
from contextlib import suppress
from pathlib import Path
from typing import Any

from ..core.checks import shown
from ..core.errors import InputError
from .errors import world
from .options import output_file


def add_picture_commands(commands: Any) -> None:
    """Add ``report``, ``plot`` and ``film`` to the commands of the top parser."""
    report = commands.add_parser(
        "report", help="report on a run, with its pictures", description="Report on a run from the files in its "
        "folder, as PDF and, with jinja2 and plotly, as a web page in one file; beside it peaks.csv and pictures."
    )
    report.add_argument("--out", metavar="FILE", help=".html or .pdf (default DIR/report.pdf and DIR/report.html)")
    report.add_argument("--title", help="default: that of the case, or the name of the folder")
    report.add_argument("--show", metavar="COLUMN[,COLUMN...]", action="append",
                        help="a chart with these columns, of one unit; repeat for more (default: what moves)")
    report.add_argument("--refine", action="store_true", help="run the case again with half the element size and with "
                        "half the time step, into DIR/refined, and set the peaks beside each other")
    report.add_argument("--allow", action="append", default=[], metavar="PACKAGE", help="as of run, for --refine")
    plot = commands.add_parser("plot", help="draw the bodies of a run", description="Draw the deformed bodies of a run "
                               "with their stress, contact pressure and states, from the frames in its folder.")
    plot.add_argument("--times", metavar="T[,T...]", help="moments [s] (default: start, end, when most happens)")
    plot.add_argument("--out", metavar="FOLDER", help="where deformed.png and faces.png go (default DIR)")
    film = commands.add_parser("film", help="film the bodies of a run", description="Film the deformed bodies of a run "
                               "above a history, from the frames in its folder.")
    film.add_argument("--between", metavar="T,T", dest="times", help="first and last moment [s] (default: 48 frames "
                      "around the one when most happens)")
    film.add_argument("--out", metavar="FILE", help=".gif or, with ffmpeg, .mp4 (default DIR/film.gif)")
    film.add_argument("--column", metavar="COLUMN", help="the history below (default: the one that tells most)")
    for one, run in ((report, _report), (plot, _plot), (film, _film)):
        one.add_argument("folder", metavar="DIR", help="output folder of a run")
        one.set_defaults(run=run, spelling={"magnified": "--magnify"})
    for one in (plot, film):
        one.add_argument("--magnify", type=float, metavar="F", dest="magnified",
                         help="how many times larger displacements are drawn (default: so that they are seen)")


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
    told, written = report(options.folder, out=options.out, title=options.title, columns=columns, failed=failed)
    lines = [*told.sentences, *(f"{row[0]:<48}" + "".join(f"{cell:>13}" for cell in row[1:]) for table in told.tables
                                for row in (table.header, *table.rows))]
    missing = [] if options.out is not None or can_write() else [f"no report.html: {MISSING}"]
    return "\n".join([*(lines if options.refine else ()), *map(str, written), *missing])


def _plot(options: argparse.Namespace) -> str:
    from ..plots.bodies import draw_run

    run, frames, title, times = _opened(options)
    out = output_file(Path(options.out or options.folder) / "deformed.png").parent
    return "\n".join(map(str, draw_run(run, out, title=title, times=times, magnified=options.magnified)))


def _film(options: argparse.Namespace) -> str:
    from ..plots.bodies import film

    run, frames, title, times = _opened(options)
    out = output_file(options.out or Path(options.folder) / "film.gif")
    if times is not None:
        times = [t for t in frames.t.tolist() if times[0] <= t <= times[-1]]
    return str(film(run, out, times=times, magnified=options.magnified, column=options.column, title=title))


def _opened(options: argparse.Namespace) -> tuple[Any, Any, str, list[float] | None]:
    """Return the run, its frames, its title, and the moments asked for, which have to be within the run."""
    from ..plots.deformed import read_frames
    from ..run.files.reading import read_run
    from ..studies.cases.library import read_copy

    run, asked, times = read_run(options.folder), options.times, None
    frames, (first, last) = read_frames(run), run.history["t"][[0, -1]]
    if asked is not None:
        try:
            times = [float(one) for one in asked.split(",")]
        except ValueError:
            raise InputError(f"{shown(asked)} are no moments: give seconds, as 3.2,5") from None
        slack = 1e-9 * (last - first)
        if not all(first - slack <= one <= last + slack for one in times):
            raise InputError(f"{shown(asked)} is not within the run, which goes from {first:g} to {last:g} s")
    return run, frames, str(read_copy(run.folder).get("title", "Deformed bodies")), times
