"""Report on the run of a case.

It says what its folder holds, the checks that the case asks for, and its discretisation.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any

from ...core.arguments import check_arguments
from ...core.errors import InputError, ViContactError
from ...core.files import describe_os_error, write_output
from ...core.own_files import is_own
from ...core.version import __version__
from ...run.files.folder import MODEL
from ...run.files.reading import RunFolder, read_object, read_run
from ..engineering import checks
from ..engineering.checks.comparison import Check, Comparison
from ..engineering.checks.model_facts import ModelFacts
from ..engineering.peak_values import peaks, write_peaks
from ..plots.bodies import draw_run
from ..plots.histories import render_image
from ..plots.pages import write_pages
from ..plots.report_numbers import ReportNumbers, read_slice
from ..plots.sections import HEADERS, Section, Table, sections_of
from ..plots.sketch import sketch
from ..plots.web_page import MISSING, can_write, write_web_page
from ..sheet.choices import Sheet, refuse_unknown_numbers
from ..sheet.first_page import describe_first_page, list_title_block
from ..units.report_units import ReportUnits, write_number
from .cases.description.design_spectra import make_sheet_words
from .cases.description.tables import input_tables
from .cases.library import COPY, compute_checksum, read_copy, read_settings
from .cases.parsing import Words, read, read_arguments
from .cases.table_calls import Spot, build, make_callee
from .refinement import describe_refinement, read_refined, tell_cost

WRITERS = {".html": write_web_page, ".pdf": write_pages}


@check_arguments
def report(
    folder: str | Path,
    *,
    out: str | Path | None = None,
    title: str | None = None,
    columns: Sequence[Sequence[str]] | None = None,
    failed: Mapping[str, str] | None = None,
) -> tuple[Section, list[Path]]:
    """Write the report on a run folder, and beside it the table peaks.csv and the pictures.

    What has no data is left out.

    Args:
        folder: of the run.
        out: an .html or .pdf file; None: report.pdf in the folder and, with jinja2 and plotly,
            report.html.
        title: of the report; None: that of the case.
        columns: groups of columns of one unit, a chart each, in place of those that move.
        failed: what ``refine`` returned.

    Returns:
        What the report says of the discretisation error, and the paths of the files.

    Raises:
        InputError: as of ``read_run``, for a run of one row, columns that do not exist, another
            kind of file, .html without jinja2 and plotly, and a damaged model.json.
    """
    written = write_report(folder, out=out, title=title, columns=columns, failed=failed)
    return written.error, written.paths


@dataclass(frozen=True)
class WrittenReport:
    """Hold what a report says first, and where it is.

    Attributes:
        first: page 1, the numbers that decide.
        error: what it says of the discretisation error.
        paths: of the files.
    """

    first: Section
    error: Section
    paths: list[Path]


def write_report(
    folder: str | Path,
    *,
    out: str | Path | None = None,
    title: str | None = None,
    columns: Sequence[Sequence[str]] | None = None,
    failed: Mapping[str, str] | None = None,
) -> WrittenReport:
    """Write the report on a run folder; arguments and errors as of ``report``."""
    folder = Path(folder)
    case = read_copy(folder)
    run = read_run(folder)
    failed = failed or {}
    heading = str(title or case.get("title") or f"Run {folder.resolve().name}")
    sheet = read_sheet(folder, case, run)
    pages = _choose_pages(folder, out)

    # Page 1 and its sketch, and the sections of what the run has told.
    picture = pages[0].with_name("model.png")
    model, inputs, sketches = _read_model(folder, picture, sheet.units)
    numbers = ReportNumbers(sheet.units, read_slice(model))
    refined = read_refined(run, failed)
    first = describe_first_page(
        run,
        sheet,
        numbers,
        refined=refined,
        failed=failed,
        cost="" if "dt" in refined else _tell_cost(run),
        sketches=sketches,
        model=model,
    )
    told = sections_of(run, model, columns, inputs=inputs, units=sheet.units)
    told[0] = replace(told[0], begins_page=True)

    # Before the last two of them, the solver's and the peaks, what is known beside the run.
    pictures = draw_run(run, pages[0].parent, title=heading)
    comparison = _describe_checks(folder, numbers)
    error = describe_refinement(run, failed, numbers, refined)
    more = [comparison, error, Section("Pictures", pictures=pictures)]
    told[-2:-2] = [section for section in more if not section.is_empty]

    facts = list_title_block(
        sheet,
        run,
        case=str(case.get("title") or folder.resolve().name),
        settings=read_settings(folder) if case else (),
        checksum=compute_checksum(folder),
    )
    for page in pages:
        write = WRITERS[page.suffix.lower()]
        write(page, heading, facts, [first, *told], f"vi_contact {__version__}")
    table = write_peaks(pages[0].with_name("peaks.csv"), peaks(run.history, run.columns))
    return WrittenReport(first, error, [*pages, table, *sketches, *pictures])


def read_sheet(folder: Path, case: Mapping[str, Any], run: RunFolder) -> Sheet:
    """Return what [sheet] of the case that a run folder keeps says.

    Args:
        folder: of the run.
        case: the tables of that case.
        run: what ``read_run`` returned.

    Raises:
        InputError: for a wrong value, and for numbers that the run does not have.
    """
    spot = Spot(str(folder / COPY), "", "sheet")
    table = case.get("sheet", {})
    if not isinstance(table, dict):
        raise spot.make_error("is not a table: write its keys below it")
    words = make_sheet_words(folder)
    sheet: Sheet = read_arguments(table, make_callee(Sheet), spot, words).build({})
    numbers = [name for name, values in run.history.items() if values.ndim == 1]
    try:
        refuse_unknown_numbers(sheet, numbers)
    except InputError as error:
        raise spot.make_table_error(f"{error}") from error
    return sheet


def _tell_cost(run: RunFolder) -> str:
    """Return what half the time step would cost, in words; "" for a run that cannot be refined."""
    try:
        return tell_cost(run, ["dt"])
    except InputError:
        return ""


def _choose_pages(folder: Path, out: str | Path | None) -> list[Path]:
    """Return the files of the report; InputError for a kind that cannot be written."""
    if out is None:
        kinds = ("pdf", "html") if can_write() else ("pdf",)
        return [folder / f"report.{kind}" for kind in kinds]
    page = Path(out)
    if page.suffix.lower() not in WRITERS:
        raise InputError(f"'{page}' is not an .html or .pdf file: give such a name")
    # before a picture is drawn over another one
    if page.suffix.lower() == ".html" and not can_write():
        raise InputError(MISSING)
    return [page]


def _read_model(
    folder: Path, picture: Path, units: ReportUnits = ReportUnits()
) -> tuple[dict[str, Any], list[Table], list[Path]]:
    """Return what model.json says, in tables too, and its sketch; nothing where there is none."""
    if not is_own(folder / MODEL):
        return {}, [], []
    try:
        model = read_object(folder / MODEL)
        inputs = input_tables(model, units)
        image = render_image(sketch(model, units), bbox_inches="tight")
    except InputError:
        raise
    except OSError as error:
        raise ViContactError(describe_os_error(error)) from error
    except (KeyError, TypeError, ValueError, IndexError, AttributeError) as error:
        # of what the file says
        reason = " ".join(str(error).split())[:200]
        raise InputError(
            f"'{folder / MODEL}' is damaged ({reason}): restore it, or delete it"
        ) from error
    write_output(picture, image)
    return model, inputs, [picture]


@check_arguments
def comparisons(folder: str | Path) -> tuple[Comparison, ...]:
    """Return the comparisons of a run folder, of each [[check]] of the case it keeps.

    An earth pressure has two: of the thrust, and of its moment about the foot.

    Raises:
        InputError: without a run.
    """
    folder = Path(folder)
    wanted = read_checks(folder)
    if not wanted:
        return ()
    history = read_run(folder).history
    facts = ModelFacts.read(folder)
    return tuple(chain.from_iterable(check.compare_all(history, facts) for check in wanted))


def read_checks(folder: Path) -> tuple[Check, ...]:
    """Return the [[check]] tables of the case that a run folder keeps."""
    table = read_copy(folder).get("check", [])
    spot = Spot(str(folder / COPY), "", "check")
    choices = {name: make_callee(getattr(checks, name)) for name in checks.__all__}
    words = Words(folder, {Check: choices}, default={}, groups=(), short={})
    value = build(read(table, Check | Sequence[Check], spot, words), {})
    return value if isinstance(value, tuple) else (value,)


def _describe_checks(folder: Path, numbers: ReportNumbers) -> Section:
    """Return what the run found beside the formulas that its case names."""
    results = comparisons(folder)
    rows = [_describe_comparison(comparison, numbers) for comparison in results]
    tables = [Table(HEADERS["checks"], rows)] if rows else []
    return Section("Checks against formulas", sentences=remarks(results), tables=tables)


def remarks(results: Sequence[Comparison]) -> list[str]:
    """Return what is to be said of comparisons: how long peaks last, what ratios mean, all notes.

    What several of them say is said once, with their names.
    """
    names: dict[str, list[str]] = {}
    for result in results:
        sentences = list(result.notes)
        if math.isfinite(result.lasted):
            sentences.append(f"the run is above 90 % of its peak for {result.lasted:.3g} s")
        if result.reading and not result.applies:
            sentences.append(result.reading)
        for sentence in sentences:
            names.setdefault(sentence, []).append(result.name)
    return [f"{'; '.join(owners)}: {sentence}." for sentence, owners in names.items()]


def _describe_comparison(comparison: Comparison, numbers: ReportNumbers) -> list[str]:
    """Return the row of a comparison."""
    inputs = [
        f"{name} = {write_number(value)} {unit}".removesuffix(" -")
        for name, (value, unit) in comparison.inputs.items()
    ]
    applies = comparison.applies
    factor, unit = numbers.choose_unit("", comparison.unit, abs(comparison.found))
    return [
        comparison.name,
        comparison.formula,
        ", ".join(inputs),
        write_number(factor * comparison.expected),
        write_number(factor * comparison.found),
        unit,
        f"does not apply: {applies}" if applies else write_number(comparison.ratio),
        comparison.source,
    ]
