"""``vi-contact post profile``: the pressure on a wall over its height, beside formulas."""

import argparse
from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING, Any

from ...core.checks import quote
from ...core.errors import InputError
from ...core.files import write_csv
from ..units.report_units import choose_unit, write_number
from .options import add_command, add_folder
from .tables import add_table, choose_table

if TYPE_CHECKING:
    from ..engineering.pressure_profile import PressureProfile
    from ..studies.profiles import ProfileReport

HEADER = ("t_s", "height_m", "pressure_Pa", "shear_Pa", "state")
LARGEST = "max"
# of the printed table: name of the column, SI unit, quantity of the units of a report
COLUMNS = (("thrust", "N", "force"), ("at height", "m", "size"), ("moment", "N m", "moment"))


def add_profile(actions: Any) -> None:
    """Add ``profile`` with its options."""
    profile = add_command(
        actions,
        "profile",
        _write_profile,
        help=(
            "compute the pressure on a wall over its height, beside the formulas of the [[check]] "
            "tables, as a CSV table and a picture"
        ),
    )
    add_folder(profile)
    profile.add_argument(
        "part", metavar="PART", help="part of the contact: the name of a [[contact]] or Resultants"
    )
    profile.add_argument(
        "--times",
        nargs="+",
        default=["0", LARGEST],
        metavar="T",
        help="times [s]; max is the time of the largest thrust (default 0 max)",
    )
    profile.add_argument(
        "--foot",
        type=float,
        metavar="Y",
        help="level from which heights count [m] (default: the lowest point of the part)",
    )
    add_table(profile, "profile")


def _write_profile(options: argparse.Namespace) -> str:
    """Carry out ``post profile``: write table and picture, and return the resultants."""
    from ..plots.pressure_profile import draw_profile
    from ..studies.profiles import profile

    times = [_read_time(word) for word in options.times]
    report = profile(options.folder, options.part, times=times, foot=options.foot)
    table = choose_table(options)
    write_csv(table, HEADER, _list_rows(report.profiles))
    title = f"Pressure on '{report.part}'"
    picture = draw_profile(
        report.profiles,
        report.lines,
        table.with_suffix(".png"),
        title=title,
        units=report.units,
    )
    return "\n".join([*_describe(report), f"table: {table}", f"picture: {picture}"])


def _read_time(word: str) -> float | str:
    """Return a time [s], or the word for that of the largest thrust."""
    if word == LARGEST:
        return word
    try:
        return float(word)
    except ValueError:
        raise InputError(
            f"--times {quote(word)} is no time: give seconds, or max for the largest thrust"
        ) from None


def _list_rows(profiles: Sequence["PressureProfile"]) -> Iterator[list[Any]]:
    """Yield the rows of the table: one for each time and point."""
    for one in profiles:
        for height, pressure, shear, state in zip(
            one.heights, one.pressure, one.shear, one.states, strict=True
        ):
            numbers = (one.t, height, pressure, shear)
            yield [*(f"{number:.8g}" for number in numbers), state]


def _describe(report: "ProfileReport") -> list[str]:
    """Return the resultants of the run and of the formulas, and sentences about both."""
    from ..plots.pressure_profile import describe_time

    columns = [
        choose_unit(
            unit,
            report.units,
            quantity=quantity,
            slice_thickness=None if quantity == "size" else report.width,
        )
        for _, unit, quantity in COLUMNS
    ]
    factors = [factor for factor, _ in columns]
    titles = [
        f"{f'{name} [{symbol}]':>22}"
        for (name, _, _), (_, symbol) in zip(COLUMNS, columns, strict=True)
    ]
    lines = [f"{'':<36}{''.join(titles)}"]
    for one in report.profiles:
        numbers = (one.thrust, one.height, one.moment)
        lines.append(_write_row(describe_time(one), numbers, factors))

    # Formulas are those of a metre of wall, of which the run has so many.
    width = report.width or 1.0
    for formula in report.lines:
        if formula.applies:
            lines.append(f"{formula.name}: does not apply: {formula.applies}")
        else:
            numbers = (width * formula.thrust, formula.height, width * formula.moment)
            lines.append(_write_row(formula.name, numbers, factors))
    for one in report.profiles:
        shear = f"{write_number(factors[0] * abs(one.lift))} {columns[0][1]}"
        way = "upwards" if one.lift > 0.0 else "downwards"
        lines.append(
            f"{describe_time(one)}: rubbed {way} with {shear}, and {one.open_share:.0%} of the "
            "part is open"
        )
    notes = dict.fromkeys(
        [*report.notes, *(f"{one.name}: {note}" for one in report.lines for note in one.notes)]
    )
    return [*lines, *(f"note: {note}" for note in notes)]


def _write_row(name: str, numbers: Sequence[float], factors: Sequence[float]) -> str:
    """Return a line of the printed table, its numbers times their factors."""
    cells = [
        f"{write_number(factor * number):>22}"
        for number, factor in zip(numbers, factors, strict=True)
    ]
    return f"{name:<36}{''.join(cells)}"
