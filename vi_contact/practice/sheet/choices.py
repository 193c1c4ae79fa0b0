"""Hold what the table [sheet] of a case says: who signs, which numbers decide, in which units."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from datetime import date as Date
from difflib import get_close_matches

from ...core.arguments import check_fields
from ...core.checks import quote
from ...core.errors import InputError
from ..ground_motion.design_spectrum import DesignSpectrum
from ..units.report_units import ReportUnits
from .rules import WORDS


@dataclass(frozen=True)
class Sheet:
    """Say whose work a report is, which numbers decide, and in which units they are written.

    The mechanics do not read it: it may be changed in case.toml of a run folder after the run.

    Attributes:
        project: its name.
        author: of the calculation.
        date: of the calculation, a text or a date.
        revision: of the calculation.
        checker: who checks it.
        numbers: columns of history.csv, and words of ``WORDS``; None: those of the rules.
        units: of the report.
        design_spectrum: of a code, which stands beside those of the records; None: there is none.
    """

    project: str = ""
    author: str = ""
    date: str | Date = ""
    revision: str = ""
    checker: str = ""
    numbers: Sequence[str] | None = None
    units: ReportUnits = ReportUnits()
    design_spectrum: DesignSpectrum | None = None

    def __post_init__(self) -> None:
        check_fields(self)
        numbers = self.numbers
        if numbers is None:
            return
        if not numbers:
            raise InputError("numbers is empty: name columns or rules, or leave it out")
        for name in numbers:
            if list(numbers).count(name) > 1:
                raise InputError(f"numbers names {quote(name)} twice: leave one out")


def refuse_unknown_numbers(sheet: Sheet, columns: Collection[str]) -> None:
    """Raise InputError for numbers of a sheet that a run does not have.

    Args:
        sheet: of the case.
        columns: that the run writes into history.csv.
    """
    for name in sheet.numbers or ():
        if name in columns:
            continue
        if name not in WORDS:
            near = get_close_matches(name, [*columns, *WORDS], n=3, cutoff=0.5)
            question = f"did you mean {' or '.join(near)}? " if near else ""
            raise InputError(
                f"numbers names {quote(name)}, which is neither a column of the run nor a rule: "
                f"{question}The rules are {', '.join(WORDS)}"
            )
        if not WORDS[name].find(columns):
            raise InputError(
                f"numbers names '{name}', and the run records nothing of the kind: add a "
                f"[[record]] of type {WORDS[name].recorder}, or leave it out"
            )
