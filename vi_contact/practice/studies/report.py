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
from ..plots.histories import image_of
from ..plots.pages import write_pages
from ..plots.sections import HEADERS, Section, Table, header_facts, number, sections_of
from ..plots.sketch import sketch
from ..plots.web_page import MISSING, can_write, write_web_page
from .cases.library import COPY, read_copy
from .cases.parsing import Words, read
from .cases.table_calls import Spot, build, callee
from .refinement import refinement

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

    Return what the report says of the discretisation error, and the paths of the files.

    ``out``: an .html or .pdf file; None: report.pdf in the folder and, with jinja2 and plotly,
    report.html. ``columns``: groups of columns of one unit, a chart each, in place of those that
    move; ``failed``: what ``refine`` returned. What has no data is left out. InputError as of
    ``read_run``, for a run of one row, columns that do not exist, another kind of file, .html
    without jinja2 and plotly, and a damaged model.json.
    """
    folder = Path(folder)
    case = read_copy(folder)
    run = read_run(folder)
    heading = str(title or case.get("title") or f"Run {folder.resolve().name}")
    pages = (
        [Path(out)]
        if out is not None
        else [folder / f"report.{end}" for end in ("pdf", "html")[: 1 + can_write()]]
    )
    if pages[0].suffix.lower() not in WRITERS:
        raise InputError(f"'{pages[0]}' is not an .html or .pdf file: give such a name")
    # before a picture is drawn over another one
    if pages[0].suffix.lower() == ".html" and not can_write():
        raise InputError(MISSING)
    model, sketched = _model(folder, pages[0].with_name("model.png"))
    sections, drawn = (
        sections_of(run, model, columns),
        draw_run(run, pages[0].parent, title=heading),
    )
    sections[:0] = [replace(sections.pop(0), pictures=sketched)] if model else []
    more = [
        _checks(folder),
        error := refinement(run, failed or {}),
        Section("Pictures", pictures=drawn),
    ]
    sections[-2:-2] = [one for one in more if one.sentences or one.tables or one.pictures]
    for page in pages:
        WRITERS[page.suffix.lower()](
            page, heading, header_facts(run), sections, f"vi_contact {__version__}"
        )
    table = write_peaks(pages[0].with_name("peaks.csv"), peaks(run.history, run.columns))
    return error, [*pages, table, *sketched, *drawn]


def _model(folder: Path, picture: Path) -> tuple[dict[str, Any], list[Path]]:
    """Return what model.json says, and its sketch; nothing where there is none."""
    if not is_own(folder / MODEL):
        return {}, []
    try:
        model = read_object(folder / MODEL)
        image = image_of(sketch(model), bbox_inches="tight")
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
    return model, [picture]


@check_arguments
def comparisons(folder: str | Path) -> tuple[Comparison, ...]:
    """Return the comparisons of a run folder.

    There is one for each [[check]] of the case it keeps; it raises InputError without a run.
    """
    folder = Path(folder)
    table = read_copy(folder).get("check", [])
    words = Words(
        folder,
        {Check: {name: callee(getattr(checks, name)) for name in checks.__all__}},
        {},
        (),
        {},
    )
    made = build(
        read(table, Check | Sequence[Check], Spot(str(folder / COPY), "", "check"), words), {}
    )
    each = made if isinstance(made, tuple) else (made,)
    history = read_run(folder).history if each else {}
    return tuple(one.compare(history) for one in each)


def _checks(folder: Path) -> Section:
    """Return what the run found beside the formulas that its case names."""
    rows = [
        [
            one.name,
            one.formula,
            ", ".join(
                f"{name} = {number(value)} {unit}" for name, (value, unit) in one.inputs.items()
            ),
            number(one.expected),
            number(one.found),
            one.unit,
            f"does not apply: {one.applies}" if one.applies else number(one.ratio),
            one.source,
        ]
        for one in comparisons(folder)
    ]
    return Section(
        "Checks against formulas", tables=[Table(HEADERS["checks"], rows)] if rows else []
    )
