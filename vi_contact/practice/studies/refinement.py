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
from ..plots.sections import SAY, Section, Table, number
from .cases.library import COPY, copied_settings, read_copy
from .cases.toml_file import toml_value, with_settings

FOLDER = "refined"  # in the run folder
NAMES = {"h": "h/2", "dt": "dt/2"}
# columns without a size that mesh and step should leave
UNSIZED = ("certificate", "energy_defect", "contact_active")
NOISE = 1e-6  # of the largest peak in the same unit: columns that small are not compared


def refine(
    folder: str | Path, comm: Any, *, allow: Sequence[str] = (), progress: bool = True
) -> dict[str, str]:
    """Run the case of a finished run folder with h/2 and with dt/2, into refined/h and refined/dt.

    Return name -> why it failed. A finished run is kept, and an interrupted run is continued.
    Collective.

    InputError for a folder without case file or whose run has not finished. ``allow``: as of
    ``read_case``.
    """
    from .cases.case import read_case  # late: finite elements

    check_type("refine", "folder", folder, str | Path)
    run, failed = read_run(folder), {}
    if not is_own(run.folder / COPY):
        raise InputError(
            f"'{folder}' holds no {COPY}, the case that is to be refined: give the folder of a "
            "case's run"
        )
    if run.facts.get("status") != "finished":
        raise InputError(
            f"the run in '{folder}' has not finished: continue it with --restart, then refine it"
        )
    for name in NAMES:
        try:
            out = inner_folder(run.folder, FOLDER, name)
            same, settings = _same(run, name), [*copied_settings(run.folder), *_halved(run, name)]
            if not (same and _status(out) == "finished"):
                case = read_case(run.folder / COPY, settings, allow=allow)
                case.run(
                    comm, out=out, restart=same and is_own(out / CHECKPOINT), progress=progress
                )
        except ViContactError as error:
            failed[name] = str(error)
    return failed


def _same(run: RunFolder, name: str) -> bool:
    """Whether the refined run is of the case that the run folder holds."""
    wanted = with_settings(read_copy(run.folder), list(_halved(run, name)))
    return read_copy(inner_folder(run.folder, FOLDER, name)) == wanted


def _halved(folder: RunFolder, name: str) -> Iterator[str]:
    """Yield the settings that halve elements or time steps.

    The runs have the same duration and no fields.
    """
    tables, dt = read_copy(folder.folder), folder.facts.get("dt")
    if "fields" in tables:
        yield "fields="
    if name == "h" and "mesh" not in tables:
        yield f"beam.elements.count={2 * _elements(tables)}"
    elif name == "h":
        size = tables["mesh"].get("divisions")  # numbers of elements, or their size
        finer = (
            [2 * one for one in size]
            if isinstance(size, list)
            else 0.5 * size
            if isinstance(size, float)
            else None
        )
        refine = 1 + tables["mesh"].get("refine", 0)
        yield f"mesh.refine={refine}" if finer is None else f"mesh.divisions={toml_value(finer)}"
    elif not isinstance(dt, int | float):
        raise InputError(
            f"the time step is not a number, {dt}: halve it in the case and compare the runs"
        )
    else:
        yield f"run.dt={0.5 * dt!r}"
        for k, stage in enumerate([tables, *tables.get("stage", ())]):
            key, own = f"stage.{k}.run" if k else "run", stage.get("run", {})
            if k and "dt" in own:
                yield f"{key}.dt={0.5 * _plain(own['dt'], f'{key}.dt')!r}"
            if "steps" in own:
                yield f"{key}.steps={2 * _plain(own['steps'], f'{key}.steps')}"


def _elements(tables: Mapping[str, Any]) -> int:
    """Return the number of elements of a beam; InputError for a body without elements."""
    if "beam" not in tables:
        raise InputError("a particle has no elements to halve: halve the time step alone")
    count = tables["beam"].get("elements", {}).get("count", Elements().count)
    return int(_plain(count, "beam.elements.count"))


def _plain(value: Any, key: str) -> Any:
    """Return a number of the case.

    It raises InputError for one that is written as a text, which has no half.
    """
    if isinstance(value, int | float):
        return value
    raise InputError(
        f"{key} is {quote(value)}, which has no half: write it as a number in the case, in SI units"
    )


def _status(folder: Path) -> str:
    return str(read_run(folder).facts.get("status")) if is_own(folder / HISTORY_CSV) else ""


def refinement(run: RunFolder, failed: Mapping[str, str]) -> Section:
    """Return the section with the peaks of a run and of those in its folder ``refined``.

    It says so if there are none; ``failed`` is name -> why, of ``refine``.
    """
    found = {}
    for name in NAMES:
        if name in failed:
            continue
        out = inner_folder(run.folder, FOLDER, name)
        if _status(out) == "finished" and _same(run, name):
            other = read_run(out)
            found[name] = {one.name: one for one in peaks(other.history, other.columns)}
    said = [f"The run with {NAMES[name]} failed: {why}." for name, why in failed.items()]
    if not found:
        return Section("Discretisation error", [*said, SAY["untried"]])
    header = ["column", "unit", "this run"] + [
        text for one in found for text in (NAMES[one], "difference")
    ]
    rows, own = [], [one for one in peaks(run.history, run.columns) if one.name not in UNSIZED]
    for one in own:
        base, like = _size(one), max(_size(other) for other in own if other.unit == one.unit)
        told = [_size(each[one.name]) if one.name in each else np.nan for each in found.values()]
        if base > NOISE * like:
            pairs = [
                (number(other), f"{round(100.0 * (other / base - 1.0), 2) + 0.0:+g} %")
                for other in told
            ]
            mark = ", raw: not convergent at impacts" if one.quantity.endswith(GROWS) else ""
            rows.append(
                [
                    one.name + mark,
                    one.unit,
                    number(base),
                    *(text for pair in pairs for text in pair),
                ]
            )
    return Section(
        "Discretisation error", [SAY["refined"], *said], [Table(header, rows, sortable=True)]
    )


def _size(peak: Any) -> float:
    return float(np.nan_to_num(max(abs(peak.max), abs(peak.min))))
