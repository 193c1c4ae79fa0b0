"""Repeat a run with half the element size or with half the time step.

The peaks are set beside each other.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...beam import Elements
from ...core.arguments import check_type
from ...core.checks import check_word, quote, several
from ...core.errors import InputError, ViContactError
from ...core.own_files import inner_folder, is_own
from ...run.files.folder import CHECKPOINT, HISTORY_CSV, MODEL
from ...run.files.reading import RunFolder, read_object, read_run
from ..engineering.peak_values import GROWS, peaks
from ..plots.report_numbers import ReportNumbers
from ..plots.sections import NOISE, SAY, Section, Table, find_scales
from ..units.report_units import write_number
from .cases.library import COPY, read_copy, read_settings
from .cases.toml_file import format_value, with_settings

FOLDER = "refined"  # in the run folder
NAMES = {"h": "h/2", "dt": "dt/2"}
# columns without a size that mesh and step should leave
UNSIZED = ("certificate", "energy_defect", "contact_active")
IN_WORDS = {"h": "half the element size (h/2)", "dt": "half the time step (dt/2)"}
# What a refined run may differ in: what a report says beside the mechanics.
BESIDE = ("sheet", "check", "title")


def refine(
    folder: str | Path,
    comm: Any,
    *,
    names: Sequence[str] = ("h", "dt"),
    allow: Sequence[str] = (),
    progress: bool = True,
) -> dict[str, str]:
    """Run the case of a finished run folder with h/2 and with dt/2, into refined/h and refined/dt.

    A finished run is kept, and an interrupted run is continued. Collective.

    Args:
        folder: of the run.
        comm: the ranks.
        names: what is halved, "h", "dt" or both.
        allow: as of ``read_case``.
        progress: whether to print a progress line.

    Returns:
        "h" or "dt" -> why its run failed.

    Raises:
        InputError: for a folder without case file or whose run has not finished.
    """
    check_type("refine", "folder", folder, str | Path)
    run = _read_finished(folder)
    failed = {}
    for name in several("refine", "names", names, 'give "h", "dt" or both, as a list'):
        check_word("refined run", name, tuple(NAMES))
        try:
            _run_refined(run, name, comm, allow, progress)
        except ViContactError as error:
            failed[name] = str(error)
    return failed


def _read_finished(folder: str | Path) -> RunFolder:
    """Return the run of a folder; InputError for one that cannot be refined."""
    run = read_run(folder)
    _refuse_unfinished(run, folder)
    return run


def _refuse_unfinished(run: RunFolder, folder: str | Path) -> None:
    """Raise InputError for the run of a folder that cannot be refined."""
    if not is_own(run.folder / COPY):
        raise InputError(
            f"'{folder}' holds no {COPY}, the case that is to be refined: give the folder of a "
            "case's run"
        )
    if run.facts.get("status") != "finished":
        raise InputError(
            f"the run in '{folder}' has not finished: continue it with --restart, then refine it"
        )


def estimate_cost(folder: str | Path, names: Sequence[str]) -> str:
    """Say how long the refined runs will take that are not there yet, from the time of the run.

    Half the elements in each of d directions are 2^d times as many, which is the least that their
    run takes.

    Args:
        folder: of the run.
        names: what is halved, as of ``refine``.

    Raises:
        InputError: as of ``refine``.
    """
    return tell_cost(read_run(folder), names)


def tell_cost(run: RunFolder, names: Sequence[str]) -> str:
    """Say what ``estimate_cost`` does of a run that has finished.

    Args:
        run: what ``read_run`` returned.
        names: what is halved, as of ``refine``.

    Raises:
        InputError: as of ``refine``.
    """
    _refuse_unfinished(run, run.folder)
    seconds = _read_seconds(run)
    phrases = []
    for name in names:
        if _find_refined(run, name) is not None:
            phrases.append(f"{NAMES[name]} has run already")
        elif seconds is not None:
            times = 2.0 if name == "dt" else 2.0 ** _read_dimension(run)
            least = "about" if name == "dt" else "at least"
            phrases.append(f"{NAMES[name]} will take {least} {write_seconds(times * seconds)}")
        else:
            phrases.append(f"how long {NAMES[name]} will take is unknown")
    took = "" if seconds is None else f"the run took {write_seconds(seconds)}; "
    return took + ", ".join(phrases)


def _read_seconds(run: RunFolder) -> float | None:
    """Return how long a run took [s]; None where nothing tells it.

    The seconds of a run that was continued are those since then: its steps took longer.
    """
    seconds: Any = run.facts.get("seconds")
    per_step: Any = run.facts.get("seconds_per_step")
    steps: Any = run.facts.get("steps")
    if not _is_number(seconds):
        return None
    marched = per_step * steps if _is_number(per_step) and _is_number(steps) else 0.0
    return float(max(seconds, marched))


def _is_number(value: Any) -> bool:
    """Tell whether an entry of summary.json is a number."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def write_seconds(seconds: float) -> str:
    """Write a time for people, in seconds, minutes or hours."""
    if seconds < 120.0:
        return f"{write_number(seconds, 2)} s"
    if seconds < 7200.0:
        return f"{write_number(seconds / 60.0, 2)} min"
    return f"{write_number(seconds / 3600.0, 2)} h"


def _read_dimension(run: RunFolder) -> int:
    """Return the dimension of the model of a run; that of the plane where nothing tells it."""
    if not is_own(run.folder / MODEL):
        return 2
    dimension = read_object(run.folder / MODEL).get("dimension")
    return dimension if dimension in (1, 2, 3) else 2


def _run_refined(
    run: RunFolder, name: str, comm: Any, allow: Sequence[str], progress: bool
) -> None:
    """Make one of the refined runs, unless it has finished; the last arguments as of ``refine``."""
    from .cases.case import read_case  # late: finite elements

    out = inner_folder(run.folder, FOLDER, name)
    same = _is_of_same_case(run, name)
    settings = [*read_settings(run.folder), *_halve(run, name)]
    if same and _read_status(out) == "finished":
        return
    case = read_case(run.folder / COPY, settings, allow=allow)
    restart = same and is_own(out / CHECKPOINT)
    case.run(comm, out=out, restart=restart, progress=progress)


def _is_of_same_case(run: RunFolder, name: str) -> bool:
    """Tell whether the refined run is of the case that the run folder holds."""
    wanted = with_settings(read_copy(run.folder), list(_halve(run, name)))
    there = read_copy(inner_folder(run.folder, FOLDER, name))
    for beside in BESIDE:
        wanted.pop(beside, None)
        there.pop(beside, None)
    return there == wanted


def _halve(folder: RunFolder, name: str) -> Iterator[str]:
    """Yield the settings that halve elements, for "h", or time steps, for "dt".

    The runs have the same duration and no fields.
    """
    tables = read_copy(folder.folder)
    if "fields" in tables:
        yield "fields="
    if name == "dt":
        yield from _halve_steps(tables, folder.facts.get("dt"))
    elif "mesh" in tables:
        yield _halve_mesh(tables["mesh"])
    else:
        yield f"beam.elements.count={2 * _count_elements(tables)}"


def _halve_mesh(mesh: Mapping[str, Any]) -> str:
    """Return the setting that halves elements of a mesh: by [mesh] divisions, or by refining it."""
    divisions = mesh.get("divisions")  # numbers of elements, or their size
    if isinstance(divisions, list):
        return f"mesh.divisions={format_value([2 * number for number in divisions])}"
    if isinstance(divisions, float):
        return f"mesh.divisions={format_value(0.5 * divisions)}"
    return f"mesh.refine={1 + mesh.get('refine', 0)}"


def _halve_steps(tables: Mapping[str, Any], dt: Any) -> Iterator[str]:
    """Yield the settings that halve the time step of the case and of all stages.

    Args:
        tables: of the case.
        dt: of the run [s].
    """
    if not isinstance(dt, int | float):
        raise InputError(
            f"the time step is not a number, {dt}: halve it in the case and compare the runs"
        )
    yield f"run.dt={0.5 * dt!r}"
    for k, table in enumerate([tables, *tables.get("stage", ())]):  # stages count from 1
        key = f"stage.{k}.run" if k else "run"
        run = table.get("run", {})
        if k and "dt" in run:
            yield f"{key}.dt={0.5 * _check_number(run['dt'], f'{key}.dt')!r}"
        if "steps" in run:
            yield f"{key}.steps={2 * _check_number(run['steps'], f'{key}.steps')}"


def _count_elements(tables: Mapping[str, Any]) -> int:
    """Return the number of elements of a beam; InputError for a body without elements."""
    if "beam" not in tables:
        raise InputError("a particle has no elements to halve: halve the time step alone")
    count = tables["beam"].get("elements", {}).get("count", Elements().count)
    return int(_check_number(count, "beam.elements.count"))


def _check_number(value: Any, key: str) -> Any:
    """Return a number of the case; InputError for one written as a text, which has no half."""
    if isinstance(value, int | float):
        return value
    raise InputError(
        f"{key} is {quote(value)}, which has no half: write it as a number in the case, in SI units"
    )


def _read_status(folder: Path) -> str:
    """Return the status of a run; "" without one."""
    return str(read_run(folder).facts.get("status")) if is_own(folder / HISTORY_CSV) else ""


def _find_refined(run: RunFolder, name: str) -> RunFolder | None:
    """Return a refined run of the same case that has finished; None without."""
    if not is_own(run.folder / COPY):
        return None
    out = inner_folder(run.folder, FOLDER, name)
    if not is_own(out / HISTORY_CSV):
        return None
    refined = read_run(out)
    is_whole = refined.facts.get("status") == "finished" and _is_of_same_case(run, name)
    return refined if is_whole else None


def read_refined(run: RunFolder, failed: Mapping[str, str]) -> dict[str, RunFolder]:
    """Return "h" or "dt" -> the refined run in the folder ``refined`` of a run.

    Those of another case, and those that have not finished, are left out.

    Args:
        run: whose folder it is.
        failed: what ``refine`` returned.
    """
    refined = {}
    for name in NAMES:
        if name in failed:  # its folder may be none
            continue
        found = _find_refined(run, name)
        if found is not None:
            refined[name] = found
    return refined


def describe_refinement(
    run: RunFolder,
    failed: Mapping[str, str],
    numbers: ReportNumbers | None = None,
    refined: Mapping[str, RunFolder] | None = None,
) -> Section:
    """Return the section with the peaks of a run and of those in its folder ``refined``.

    It says so if there are none.

    Args:
        run: what ``read_run`` returned.
        failed: name -> why, of ``refine``.
        numbers: writes them; None: in the usual units.
        refined: what ``read_refined`` returned; None: it is read here.
    """
    numbers = numbers or ReportNumbers()
    if refined is None:
        refined = read_refined(run, failed)
    peaks_of = {
        name: {peak.name: peak for peak in peaks(other.history, other.columns)}
        for name, other in refined.items()
    }
    sentences = [f"The run with {NAMES[name]} failed: {why}." for name, why in failed.items()]
    if not refined:
        return Section("Discretisation error", [*sentences, SAY["untried"]])

    header = ["column", "unit", "this run"]
    for name in refined:
        header += [NAMES[name], "difference"]
    sized = [peak for peak in peaks(run.history, run.columns) if peak.name not in UNSIZED]
    scales = find_scales(run)
    rows = [
        _compare(peak, peaks_of, numbers)
        for peak in sized
        if _measure(peak) > NOISE * scales[peak.unit]
    ]
    table = Table(header, rows, sortable=True)
    finer = " and with ".join(IN_WORDS[name] for name in refined)
    return Section(
        "Discretisation error", [SAY["refined"].format(finer=finer), *sentences], [table]
    )


def _compare(
    peak: Any, refined: Mapping[str, Mapping[str, Any]], numbers: ReportNumbers
) -> list[str]:
    """Return the row of a peak: its size, and those of the refined runs with the difference in %.

    Args:
        peak: of the run.
        refined: name of a refined run -> column -> its peak.
        numbers: writes them.
    """
    size = _measure(peak)
    mark = ", raw: not convergent at impacts" if peak.quantity.endswith(GROWS) else ""
    factor, unit = numbers.choose_unit(peak.name, peak.unit, size)
    row = [peak.name + mark, unit, write_number(factor * size)]
    for others in refined.values():
        other = _measure(others[peak.name]) if peak.name in others else np.nan
        # adding zero makes -0 a zero
        change = round(100.0 * (other / size - 1.0), 2) + 0.0
        row += [write_number(factor * other), f"{change:+g} %"]
    return row


def _measure(peak: Any) -> float:
    """Return the larger magnitude of a peak's two ends; zero where they are no numbers."""
    return float(np.nan_to_num(max(abs(peak.max), abs(peak.min))))
