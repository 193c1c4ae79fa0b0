"""Repeat a run with half the element size and with half the time step.

The peaks are set beside each other.
"""

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ...beam import Elements
from ...core.arguments import check_type
from ...core.checks import quote
from ...core.errors import InputError, ViContactError
from ...core.own_files import inner_folder, is_own
from ...run.files.folder import CHECKPOINT, HISTORY_CSV
from ...run.files.reading import RunFolder, read_run
from ..engineering.peak_values import GROWS, peaks
from ..plots.sections import SAY, Section, Table, format_number
from .cases.library import COPY, read_copy, read_settings
from .cases.toml_file import format_value, with_settings

FOLDER = "refined"  # in the run folder
NAMES = {"h": "h/2", "dt": "dt/2"}
# columns without a size that mesh and step should leave
UNSIZED = ("certificate", "energy_defect", "contact_active")
NOISE = 1e-6  # of the largest peak in the same unit: columns that small are not compared


def refine(
    folder: str | Path, comm: Any, *, allow: Sequence[str] = (), progress: bool = True
) -> dict[str, str]:
    """Run the case of a finished run folder with h/2 and with dt/2, into refined/h and refined/dt.

    A finished run is kept, and an interrupted run is continued. Collective.

    Args:
        folder: of the run.
        comm: the ranks.
        allow: as of ``read_case``.
        progress: whether to print a progress line.

    Returns:
        "h" or "dt" -> why its run failed.

    Raises:
        InputError: for a folder without case file or whose run has not finished.
    """
    check_type("refine", "folder", folder, str | Path)
    run = read_run(folder)
    if not is_own(run.folder / COPY):
        raise InputError(
            f"'{folder}' holds no {COPY}, the case that is to be refined: give the folder of a "
            "case's run"
        )
    if run.facts.get("status") != "finished":
        raise InputError(
            f"the run in '{folder}' has not finished: continue it with --restart, then refine it"
        )
    failed = {}
    for name in NAMES:
        try:
            _run_refined(run, name, comm, allow, progress)
        except ViContactError as error:
            failed[name] = str(error)
    return failed


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
    return read_copy(inner_folder(run.folder, FOLDER, name)) == wanted


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


def describe_refinement(run: RunFolder, failed: Mapping[str, str]) -> Section:
    """Return the section with the peaks of a run and of those in its folder ``refined``.

    It says so if there are none; ``failed`` is name -> why, of ``refine``.
    """
    refined: dict[str, dict[str, Any]] = {}
    for name in NAMES:
        if name in failed:  # its folder may be none
            continue
        out = inner_folder(run.folder, FOLDER, name)
        if _read_status(out) == "finished" and _is_of_same_case(run, name):
            other = read_run(out)
            refined[name] = {peak.name: peak for peak in peaks(other.history, other.columns)}
    sentences = [f"The run with {NAMES[name]} failed: {why}." for name, why in failed.items()]
    if not refined:
        return Section("Discretisation error", [*sentences, SAY["untried"]])

    header = ["column", "unit", "this run"]
    for name in refined:
        header += [NAMES[name], "difference"]
    sized = [peak for peak in peaks(run.history, run.columns) if peak.name not in UNSIZED]
    rows = []
    for peak in sized:
        largest = max(_measure(other) for other in sized if other.unit == peak.unit)
        if _measure(peak) > NOISE * largest:
            rows.append(_compare(peak, refined))
    table = Table(header, rows, sortable=True)
    return Section("Discretisation error", [SAY["refined"], *sentences], [table])


def _compare(peak: Any, refined: Mapping[str, Mapping[str, Any]]) -> list[str]:
    """Return the row of a peak: its size, and those of the refined runs with the difference in %.

    Args:
        peak: of the run.
        refined: name of a refined run -> column -> its peak.
    """
    size = _measure(peak)
    mark = ", raw: not convergent at impacts" if peak.quantity.endswith(GROWS) else ""
    row = [peak.name + mark, peak.unit, format_number(size)]
    for others in refined.values():
        other = _measure(others[peak.name]) if peak.name in others else np.nan
        # adding zero makes -0 a zero
        row += [format_number(other), f"{round(100.0 * (other / size - 1.0), 2) + 0.0:+g} %"]
    return row


def _measure(peak: Any) -> float:
    """Return the larger magnitude of a peak's two ends; zero where they are no numbers."""
    return float(np.nan_to_num(max(abs(peak.max), abs(peak.min))))
