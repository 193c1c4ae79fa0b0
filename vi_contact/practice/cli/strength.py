"""``vi-contact strength-reduction``: the factor of safety of a case whose soil yields."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...core.files import on_root, write_csv
from .options import add_command, add_settings

if TYPE_CHECKING:
    from ..studies.strength_reduction import StrengthReduction

HEADER = ("factor", "displacement_m", "certificate", "reason")


def add_strength_command(commands: Any) -> None:
    """Add ``strength-reduction`` to the commands of the top parser."""
    parser = add_command(
        commands,
        "strength-reduction",
        _reduce,
        help="find by how much the strength of a case's soil may fall before it gives way",
        description=(
            "Divide c and tan phi of the materials of a case by a factor, until no equilibrium is "
            "found under its static loads. Writes a table of all trials and a picture of the "
            "mechanism."
        ),
    )
    parser.add_argument("case", help="path of a .toml file, or name of a case of the package")
    parser.add_argument(
        "--tolerance",
        type=float,
        default=0.01,
        metavar="R",
        help="relative width of the interval that is left (default 0.01)",
    )
    parser.add_argument(
        "--start", type=float, default=1.0, metavar="F", help="the first factor (default 1)"
    )
    parser.add_argument(
        "--out",
        metavar="FILE",
        default="strength_reduction.csv",
        help="the table; the picture stands beside it (default: strength_reduction.csv)",
    )
    add_settings(parser)


def _reduce(options: argparse.Namespace) -> str:
    """Carry out ``strength-reduction``: write table and picture, and return the factor."""
    from ..plots.strength_reduction import plot_strength_reduction
    from ..studies.cases.case import read_case
    from ..studies.cases.library import locate
    from ..studies.strength_reduction import strength_reduction

    case = read_case(locate(options.case), options.settings, allow=options.allow)
    found = strength_reduction(case, start=options.start, tolerance=options.tolerance)
    table = Path(options.out)
    on_root(found.problem.surface.comm, lambda: write_csv(table, HEADER, _list_rows(found)))
    lines = [f"{found}.", f"table: {table}"]
    if found.problem.surface.points.shape[1] == 2:
        picture = plot_strength_reduction(found, table.with_suffix(".png"))
        lines.append(f"picture: {picture}")
    return "\n".join(lines)


def _list_rows(found: "StrengthReduction") -> list[list[str]]:
    """Return the rows of the table: one for each trial."""
    rows = []
    for trial in found.trials:
        numbers = (trial.factor, trial.displacement, trial.certificate)
        rows.append([*(f"{number:.8g}" for number in numbers), trial.reason])
    return rows
