"""Write page 1 of a report: the title block, and the numbers that decide."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from textwrap import shorten
from typing import Any

import numpy as np

from ...core.version import __version__
from ...run.files.reading import RunFolder
from ..engineering.peak_values import NEARLY
from ..plots.report_numbers import ReportNumbers
from ..plots.sections import Section, Table
from ..units.report_units import Written, write_number
from .choices import Sheet
from .convergence import LIMIT, NOT_TESTED, TESTS, Change, compare
from .deciding import DecidingNumber, Measure, choose_numbers
from .rigid_base import explain_edge_pressures
from .signs import explain_signs

LONGEST = 300  # letters of a text of the title block
UNKNOWN = "-"
TOGETHER = "\N{NO-BREAK SPACE}"  # between a number and its unit
_HEADER = ("number", "column", "value", "at t", f"lasts above {100 * NEARLY:.0f} %")


def list_title_block(
    sheet: Sheet, run: RunFolder, *, case: str, settings: Sequence[str], checksum: str
) -> list[tuple[str, str]]:
    """Return (name, text) of the title block; a dash stands for what nobody has given.

    Args:
        sheet: of the case.
        run: what ``read_run`` returned.
        case: its title.
        settings: KEY=VALUE that replaced values of the case when it ran.
        checksum: of the case file; "" without one.
    """
    made_by = run.facts.get("versions", {}).get("vi_contact")
    program = f"vi_contact {made_by or __version__}"
    if made_by and made_by != __version__:
        program += f", report by {__version__}"
    entries = {
        "project": sheet.project,
        "author": sheet.author,
        "revision": sheet.revision,
        "checker": sheet.checker,
        "date": str(sheet.date),
        "program": program,
        "case": case,
        "SHA-256 of the case": checksum,
    }
    if settings:
        entries["changed by --set"] = ", ".join(settings)
    return [(name, _write_text(text)) for name, text in entries.items()]


def _write_text(text: str) -> str:
    """Return a text of a file on one line, without signs that no page shows."""
    line = "".join(sign if sign.isprintable() else " " for sign in text)
    return shorten(line, LONGEST, placeholder=" …") or UNKNOWN


def describe_first_page(
    run: RunFolder,
    sheet: Sheet,
    numbers: ReportNumbers,
    *,
    refined: Mapping[str, RunFolder],
    failed: Mapping[str, str],
    cost: str = "",
    sketches: Sequence[Path] = (),
    model: Mapping[str, Any] | None = None,
) -> Section:
    """Return the section with the numbers that decide, and the sketch of the model below it.

    Args:
        run: what ``read_run`` returned.
        sheet: of the case.
        numbers: writes them.
        refined: "h" or "dt" -> the refined run.
        failed: "h" or "dt" -> why there is none.
        cost: what half the time step would cost, in words; "" where it is unknown.
        sketches: pictures of the model.
        model: model.json; None where there is none.

    Raises:
        InputError: a number of the sheet that the run does not have.
    """
    deciding = choose_numbers(run, sheet.numbers)
    changes = compare(run, deciding, refined, failed)
    rows = []
    for place, number in enumerate(deciding):
        cells = [changes[name][place].text for name in TESTS]
        rows.append([*_write_number(number, run, numbers), *cells])
    table = Table((*_HEADER, *TESTS.values()), rows)
    if not rows:
        sentences = [
            "The run has recorded nothing that decides: add a [[record]], such as Resultants, "
            "Reactions or SectionForces."
        ]
        return Section("Numbers that decide", sentences, pictures=sketches)
    notes = [
        _explain_choice(deciding, sheet),
        *_explain_slice(numbers),
        *_explain_convergence(deciding, changes, refined, cost),
        *_explain_brief_peaks(deciding, changes),
        *explain_edge_pressures(deciding, run.history, model or {}, numbers),
        *explain_signs(deciding, run.columns, run.history),
    ]
    return Section("Numbers that decide", tables=[table], notes=notes, pictures=sketches)


def _write_number(number: DecidingNumber, run: RunFolder, numbers: ReportNumbers) -> list[str]:
    """Return the cells of a number, but for its convergence."""
    unit = run.columns[number.column][0]
    if number.measure is Measure.SAFETY:
        value = Written(write_number(number.value), "")
    else:
        value = numbers.write(number.value, number.column, unit)
    nothing = np.isnan(number.t) or number.value == 0.0
    at = UNKNOWN if nothing else f"{write_number(number.t)} s"
    name = shorten(number.name, 80, placeholder=" …")
    cells = [str(value), at, _write_duration(number)]
    return [name, number.column, *(cell.replace(" ", TOGETHER) for cell in cells)]


def _write_duration(number: DecidingNumber) -> str:
    """Return the cell of how long a peak lasts."""
    if number.measure is Measure.STAYS:
        return "stays"
    if np.isnan(number.seconds):
        return UNKNOWN
    if number.steps == 0:
        return "at the start only"
    steps = "one step" if number.is_brief else f"{number.steps} steps"
    return f"{write_number(number.seconds, 3)} s, {steps}"


def _explain_choice(deciding: Sequence[DecidingNumber], sheet: Sheet) -> str:
    """Say by whom or by which rules the numbers were chosen."""
    rules = {number.name: number.rule for number in deciding if number.rule}
    said = "; ".join(f"{name} is {rule}" for name, rule in rules.items())
    if sheet.numbers is not None:
        return f"Chosen by: [sheet] numbers of the case.{f' By rules: {said}.' if said else ''}"
    return (
        f"Chosen by: the rules of the report, as [sheet] numbers is not given: {said}. The base is "
        "the part of the contact that carries most."
    )


def _explain_slice(numbers: ReportNumbers) -> list[str]:
    """Say that forces are those of a metre, where they are."""
    if numbers.slice_thickness is None:
        return []
    return ["Plane strain: forces and moments are those of a metre of the body along its axis."]


def _explain_convergence(
    deciding: Sequence[DecidingNumber],
    changes: Mapping[str, Sequence[Change]],
    refined: Mapping[str, Any],
    cost: str,
) -> list[str]:
    """Say what was tested, and what was found; where nothing was, how to test it.

    Args:
        deciding: the numbers.
        changes: of each of them, as of ``compare``.
        refined: the refined runs that there are.
        cost: of half the time step, in words.
    """
    sentences = []
    if "dt" not in refined:
        costs = f" ({cost})" if cost else ""
        sentences.append(
            "Convergence in time was not tested: nothing is said about how far these numbers "
            "depend on the time step. `vi-contact report DIR --halved` runs the case with half "
            f"the time step{costs}, and `--refine` with half the element size too."
        )
    if refined:
        sentences.append(
            f"Converged means: half the step changes the number by at most {100 * LIMIT:.0f} %, "
            "and it is no peak that lasts one step in both runs. "
            "If the error falls with the first power of the step, the error of a number here is "
            "twice its change."
        )
    open_ones = [
        number.short_name
        for place, number in enumerate(deciding)
        if any(not changes[name][place].is_converged for name in refined)
    ]
    if open_ones:
        sentences.append(
            f"Not converged: {', '.join(open_ones)}. Shorten [run] dt, or the elements, and test "
            "again before these numbers are used."
        )
    return sentences


def _explain_brief_peaks(
    deciding: Sequence[DecidingNumber], changes: Mapping[str, Sequence[Change]]
) -> list[str]:
    """Say which peaks lasted one step, and what to do about them."""
    brief = [place for place, number in enumerate(deciding) if number.is_brief]
    if not brief:
        return []
    names = ", ".join(deciding[place].short_name for place in brief)
    untested = any(changes["dt"][place].text == NOT_TESTED for place in brief)
    remedy = "test it with `--halved`" if untested else "see the column of dt/2"
    return [
        f"Peak of one step: {names}. It may be the blow of an impact, which depends on the time "
        f"step: {remedy}. Where it changes, shorten [run] dt until it lasts several steps, or "
        "judge the structure by what lasts."
    ]
