"""Report on the run of a case.

It says what its folder holds, the checks that the case asks for, and its discretisation.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from ...core.arguments import check_arguments
from ...core.errors import InputError, ViContactError
from ...core.files import describe_os_error, write_output
from ...core.own_files import is_own
from ...core.version import __version__
from ...run.files.folder import MODEL
from ...run.files.reading import read_object, read_run
from ..engineering import checks
from ..engineering.checks.comparison import Check, Comparison
from ..engineering.peak_values import peaks, write_peaks
from ..plots.bodies import draw_run
from ..plots.histories import render_image
from ..plots.pages import write_pages
from ..plots.sections import HEADERS, Section, Table, format_number, header_facts, sections_of
from ..plots.sketch import sketch
from ..plots.web_page import MISSING, can_write, write_web_page
from ..units.report_units import ReportUnits
from .cases.description.tables import input_tables
from .cases.library import COPY, read_copy
from .cases.parsing import Words, read
from .cases.table_calls import Spot, build, make_callee
from .refinement import describe_refinement

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
    folder = Path(folder)
    case = read_copy(folder)
    run = read_run(folder)
    heading = str(title or case.get("title") or f"Run {folder.resolve().name}")
    pages = _choose_pages(folder, out)

    # The sections: what the run has told, and before the last two of them what is known beside it.
    model, inputs, sketches = _read_model(folder, pages[0].with_name("model.png"))
    sections = sections_of(run, model, columns, inputs=inputs)
    pictures = draw_run(run, pages[0].parent, title=heading)
    if model:
        sections[0] = replace(sections[0], pictures=sketches)
    comparison = _describe_checks(folder)
    error = describe_refinement(run, failed or {})
    more = [comparison, error, Section("Pictures", pictures=pictures)]
    sections[-2:-2] = [one for one in more if one.sentences or one.tables or one.pictures]

    for page in pages:
        write = WRITERS[page.suffix.lower()]
        write(page, heading, header_facts(run), sections, f"vi_contact {__version__}")
    table = write_peaks(pages[0].with_name("peaks.csv"), peaks(run.history, run.columns))
    return error, [*pages, table, *sketches, *pictures]


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


def _read_model(folder: Path, picture: Path) -> tuple[dict[str, Any], list[Table], list[Path]]:
    """Return what model.json says, in tables too, and its sketch; nothing where there is none."""
    if not is_own(folder / MODEL):
        return {}, [], []
    try:
        model = read_object(folder / MODEL)
        inputs = input_tables(model, ReportUnits())
        image = render_image(sketch(model), bbox_inches="tight")
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
    """Return the comparisons of a run folder, one for each [[check]] of the case it keeps.

    Raises:
        InputError: without a run.
    """
    folder = Path(folder)
    table = read_copy(folder).get("check", [])
    spot = Spot(str(folder / COPY), "", "check")
    choices = {name: make_callee(getattr(checks, name)) for name in checks.__all__}
    words = Words(folder, {Check: choices}, default={}, groups=(), short={})
    value = build(read(table, Check | Sequence[Check], spot, words), {})
    wanted = value if isinstance(value, tuple) else (value,)
    history = read_run(folder).history if wanted else {}
    return tuple(check.compare(history) for check in wanted)


def _describe_checks(folder: Path) -> Section:
    """Return what the run found beside the formulas that its case names."""
    rows = [_describe_comparison(comparison) for comparison in comparisons(folder)]
    tables = [Table(HEADERS["checks"], rows)] if rows else []
    return Section("Checks against formulas", tables=tables)


def _describe_comparison(comparison: Comparison) -> list[str]:
    """Return the row of a comparison."""
    inputs = [
        f"{name} = {format_number(value)} {unit}"
        for name, (value, unit) in comparison.inputs.items()
    ]
    applies = comparison.applies
    return [
        comparison.name,
        comparison.formula,
        ", ".join(inputs),
        format_number(comparison.expected),
        format_number(comparison.found),
        comparison.unit,
        f"does not apply: {applies}" if applies else format_number(comparison.ratio),
        comparison.source,
    ]
