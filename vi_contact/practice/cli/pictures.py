"""``vi-contact report``, ``plot`` and ``film``: options and what the commands do."""

import argparse
import time
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...core.checks import quote
from ...core.errors import InputError
from .errors import say, world
from .options import add_command, add_folder, output_file

if TYPE_CHECKING:
    from ...run.files.reading import RunFolder
    from ..plots.sections import Section


def add_picture_commands(commands: Any) -> None:
    """Add ``report``, ``plot`` and ``film`` to the commands of the top parser."""
    _add_report(commands)
    _add_plot(commands)
    _add_film(commands)


def _add_report(commands: Any) -> None:
    """Add ``report`` with its options."""
    report = add_command(
        commands,
        "report",
        _report,
        help="write a report on a run, with pictures",
        description=(
            "Write a report on a run from the files in its folder. It is a PDF "
            "file and, where jinja2 and plotly are installed, also a web page in "
            "one file. peaks.csv and the pictures are written beside it."
        ),
    )
    report.add_argument(
        "--out",
        metavar="FILE",
        help=("file of the report, .html or .pdf (default: DIR/report.pdf and DIR/report.html)"),
    )
    report.add_argument(
        "--title",
        help=("title of the report (default: the title of the case, or the name of the folder)"),
    )
    report.add_argument(
        "--show",
        metavar="COLUMN[,COLUMN...]",
        action="append",
        help=(
            "draw a chart of these columns, which must have one unit; the option may be "
            "repeated (default: a chart for each kind of column that changes during the "
            "run)"
        ),
    )
    report.add_argument(
        "--halved",
        action="store_true",
        help=(
            "run the case again with half the time step, into DIR/refined/dt, and say how far "
            "the numbers that decide change"
        ),
    )
    report.add_argument(
        "--refine",
        action="store_true",
        help=(
            "run the case again with half the element size and with half the time step, "
            "into DIR/refined, and compare the peaks"
        ),
    )
    report.add_argument(
        "--allow",
        action="append",
        default=[],
        metavar="PACKAGE",
        help="the option of 'vi-contact run', for the runs of --halved and --refine",
    )
    add_folder(report)


def _add_plot(commands: Any) -> None:
    """Add ``plot`` with its options."""
    plot = add_command(
        commands,
        "plot",
        _plot,
        help="draw the bodies of a run",
        description=(
            "Draw the deformed bodies of a run with their stress, contact "
            "pressure and contact states, from the frames that are stored in its "
            "folder."
        ),
    )
    plot.add_argument(
        "--times",
        metavar="T[,T...]",
        help=(
            "moments to draw [s] (default: the first, the last, and the one of the "
            "largest open share, contact pressure or displacement)"
        ),
    )
    plot.add_argument(
        "--out", metavar="FOLDER", help="folder for deformed.png and faces.png (default: DIR)"
    )
    add_folder(plot)
    _add_magnify(plot)


def _add_film(commands: Any) -> None:
    """Add ``film`` with its options."""
    film = add_command(
        commands,
        "film",
        _film,
        help="film the bodies of a run",
        description=(
            "Film the deformed bodies of a run above the curve of a history, "
            "from the frames that are stored in its folder."
        ),
    )
    film.add_argument(
        "--between",
        metavar="T,T",
        dest="times",
        help=(
            "first and last moment of the film [s] (default: 48 frames around the moment "
            "of the largest open share, contact pressure or displacement)"
        ),
    )
    film.add_argument(
        "--out",
        metavar="FILE",
        help=("file of the film, .gif or, where ffmpeg is installed, .mp4 (default: DIR/film.gif)"),
    )
    film.add_argument(
        "--column",
        metavar="COLUMN",
        help=(
            "column of history.csv that is drawn below the bodies (default: the open share, "
            "the contact pressure or the first displacement that changes)"
        ),
    )
    add_folder(film)
    _add_magnify(film)


def _add_magnify(parser: argparse.ArgumentParser) -> None:
    """Add the option of the scale of displacements in a drawing."""
    parser.set_defaults(spelling={"magnified": "--magnify"})
    parser.add_argument(
        "--magnify",
        type=float,
        metavar="F",
        dest="magnified",
        help=(
            "factor by which displacements are enlarged in the drawing (default: a round "
            "number that makes the displacements visible)"
        ),
    )


def _report(options: argparse.Namespace) -> str:
    """Carry out ``vi-contact report``: return the paths of what was written. Collective."""
    with suppress(ImportError):  # a report needs no MPI
        import mpi4py.MPI  # noqa: F401  # first: ``world`` finds it

    from ..plots.web_page import MISSING, can_write
    from ..studies.refinement import estimate_cost, refine, write_seconds
    from ..studies.report import write_report

    comm = world()
    if options.out is not None:
        output_file(options.out)
    halved = ["dt"] if options.halved else []
    if options.refine:
        halved = ["h", "dt"]
    failed = None
    if halved:
        cost = estimate_cost(options.folder, halved)
        if comm.rank == 0:
            say(cost)
        failed = refine(options.folder, comm, names=halved, allow=options.allow)
    if comm.rank != 0:
        return ""
    begin = time.perf_counter()
    columns = None if options.show is None else [group.split(",") for group in options.show]
    written = write_report(
        options.folder, out=options.out, title=options.title, columns=columns, failed=failed
    )
    lines = _format_tables(written.first) if halved else []
    lines += _format_tables(written.error) if options.refine else []
    lines += map(str, written.paths)
    lines.append(f"report written in {write_seconds(time.perf_counter() - begin)}")
    if options.out is None and not can_write():
        lines.append(f"no report.html: {MISSING}")
    return "\n".join(lines)


def _format_tables(section: "Section") -> list[str]:
    """Return the lines of a section: sentences, tables in columns, and notes."""
    lines = [*section.sentences]
    for table in section.tables:
        rows = [table.header, *table.rows]
        widths = [2 + max(map(len, column)) for column in zip(*rows, strict=True)]
        for row in rows:
            cells = [cell.ljust(width) for cell, width in zip(row, widths, strict=True)]
            lines.append("".join(cells).rstrip())
    return [*lines, *section.notes]


def _plot(options: argparse.Namespace) -> str:
    """Carry out ``vi-contact plot``: return the paths of the pictures."""
    from ...run.files.reading import read_run
    from ..plots.bodies import draw_run
    from ..plots.deformed import read_frames

    run = read_run(options.folder)
    read_frames(run)  # without them there is nothing to draw: an InputError says so
    times = _read_times(run, options.times)
    out = output_file(Path(options.out or options.folder) / "deformed.png").parent
    paths = draw_run(run, out, title=_read_title(run), times=times, magnified=options.magnified)
    return "\n".join(map(str, paths))


def _film(options: argparse.Namespace) -> str:
    """Carry out ``vi-contact film``: return the path of the film."""
    from ...run.files.reading import read_run
    from ..plots.bodies import film
    from ..plots.deformed import read_frames

    run = read_run(options.folder)
    frames = read_frames(run)
    times = _read_times(run, options.times)
    title = _read_title(run)
    out = output_file(options.out or Path(options.folder) / "film.gif")
    if times is not None:
        times = [t for t in frames.t.tolist() if times[0] <= t <= times[-1]]
    path = film(
        run, out, times=times, magnified=options.magnified, column=options.column, title=title
    )
    return str(path)


def _read_title(run: "RunFolder") -> str:
    """Read the title of the case of a run."""
    from ..studies.cases.library import read_copy

    return str(read_copy(run.folder).get("title", "Deformed bodies"))


def _read_times(run: "RunFolder", text: str | None) -> list[float] | None:
    """Read the moments asked for [s], which have to be within the run; None for none."""
    if text is None:
        return None
    try:
        times = [float(word) for word in text.split(",")]
    except ValueError:
        raise InputError(
            f"{quote(text)} is not a list of moments: give seconds, such as 3.2,5"
        ) from None
    first, last = run.history["t"][[0, -1]]
    slack = 1e-9 * (last - first)
    if not all(first - slack <= t <= last + slack for t in times):
        raise InputError(
            f"{quote(text)} is outside the run: give seconds from {first:g} to {last:g}"
        )
    return times
