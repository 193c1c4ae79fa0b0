"""Make incremental dynamic analyses.

One structure is put under many motions, each at many intensities; the result is one tidy table.

Vamvatsikos and Cornell, Earthquake Engng Struct. Dyn. 31 (2002). In the folder of a study, beside
``ida.csv``, ``columns.json`` and ``ida.png``: ``fragility.csv`` and ``fragility.png``, where there
are limits; ``ida.json``, the case and the records, so that no other study is mixed in, and
``runs/NAME_xSCALE``, the folder of every run, with its row.
"""

import hashlib
import math
import os
import time
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from datetime import timedelta
from functools import cache, cached_property
from pathlib import Path

import numpy as np

from ....core.algebra import Array, SerialComm
from ....core.arguments import check_arguments, check_fields
from ....core.errors import InputError
from ....core.files import to_json, write_atomically, write_csv
from ....core.own_files import inner_folder, is_own
from ....fem.mesh.tagged_mesh import alone
from ....run.files.folder import LOCK, lock_folder
from ....run.files.reading import read_run
from ....run.wall_time import WallTime
from ...plots.studies import DemandPanel, plot_fragility, plot_ida
from ..cases.case import Case, read_case
from ..cases.description import describe
from ..cases.parsing import nearest
from .fragility import fragility_curve, limit, passing
from .measures import Demand, Intensity, demand, fractiles, intensity
from .processes import executed, refuse_mpirun
from .runs import ROW, OneRun, Row, Shaking, read_json, read_row, shakings

Units = dict[str, tuple[str, str]]
SECONDS = 30.0  # between two lines about the time left
SHARES = (0.16, 0.50, 0.84)
TABLE, COLUMNS, FIGURE, STUDY, RUNS = "ida.csv", "columns.json", "ida.png", "ida.json", "runs"
FRAGILITY = "fragility.csv"
# Columns of ida.csv before and after the intensity and the demands: column -> (unit, meaning).
_FIRST_COLUMNS: Units = {
    "record": ("-", "name of the record"),
    "scale": ("-", "factor on the motion of the case"),
}
_LAST_COLUMNS: Units = {
    "certificate": ("-", "worst certificate of the run"),
    "energy_created": (
        "-",
        (
            "energy that contact and time scheme created, over the largest energy; with the "
            "recorder Energy() only"
        ),
    ),
    "steps": ("-", "steps of the run"),
    "status": ("-", "finished or failed"),
    "reason": ("-", "why the run failed"),
}


@dataclass(frozen=True)
class IDA:
    """Say what an incremental dynamic analysis runs, and what it tells of the runs.

    case: shaken by GroundMotions alone, whose record files are replaced; motions: a file, or one
    file per GroundMotion of the case, for each record; its name is that of its first file. scales:
    factors on the motion as the case prepares it; or levels: values of the intensity, in its unit.
    intensity: "pga", "pgv", "pgd", "sa:T", "sa:T1" (T1 as ``vi-contact run --check`` tells it),
    "arias", "cav", "housner", of the first motion. demands: "COLUMN" or "COLUMN:max", ":min",
    ":absmax", ":last" of history.csv. limits: "COLUMN:WAY=VALUE", each gets a fragility curve.
    Raises InputError for other words, no motions, two of one name, not exactly one of scales and
    levels.
    """

    case: Case
    motions: Sequence[str | Path | Sequence[str | Path]]
    demands: Sequence[str]
    scales: Sequence[float] = ()
    levels: Sequence[float] = ()
    intensity: str = "pga"
    limits: Sequence[str] = ()

    def __post_init__(self) -> None:
        check_fields(self)
        if bool(self.scales) == bool(self.levels):
            raise InputError("give either scales or levels of the intensity, at least one value")
        values = (*self.scales, *self.levels)
        if len(set(values)) < len(values) or not all(0.0 < value < math.inf for value in values):
            raise InputError(
                f"scales or levels are {list(values)}: give different positive numbers"
            )
        if not self.demands:
            raise InputError(
                "demands is empty: give a column of history.csv, such as contact_uplift:max"
            )
        _ = self.measure, self.wanted, self.shakings

    @cached_property
    def measure(self) -> Intensity:
        """Return the intensity measure."""
        return intensity(self.intensity, self._first_period)

    def _first_period(self) -> float:
        settings = (*self.case.settings, *self.shakings[0].settings(self.case))
        model = describe(read_case(self.case.path, settings, allow=self.case.allowed), alone())
        return float(next(iter(model.get("periods", ())), 0.0))

    @property
    def wanted(self) -> list[Demand]:
        """Return the demand parameters, those of the limits among them."""
        return list(
            dict.fromkeys((*map(demand, self.demands), *(limit(text)[0] for text in self.limits)))
        )

    @property
    def shakings(self) -> list[Shaking]:
        """Return the motions by name."""
        return shakings(self.case, self.motions)

    def runs(self, out: Path) -> list[OneRun]:
        """Return every record at every scale, record by record."""
        return [
            self._run(out, one, value)
            for one in self.shakings
            for value in (*self.scales, *self.levels)
        ]

    def _run(self, out: Path, shaking: Shaking, value: float) -> OneRun:
        folder = out / RUNS / f"{shaking.name}_{self.measure.name if self.levels else 'x'}{value!r}"
        try:
            record = shaking.record(self.case)
            factor = self.measure.scale(record, value) if self.levels else value
        except InputError as error:
            return OneRun(
                self.case, shaking, math.nan if self.levels else value, folder, str(error)
            )
        return OneRun(self.case, shaking, factor, folder)


@check_arguments
def run_ida(
    study: IDA,
    out: str | Path,
    *,
    jobs: int = 1,
    part: tuple[int, int] = (1, 1),
    launch: Sequence[str] = (),
    say: Callable[[str], None] = print,
    wall_time: str | None = None,
) -> list[Row]:
    """Make the runs that have not finished yet, and table and figure of all.

    The table and figure are of all that are in ``out``. Return its rows.

    Eight runs share a process and, where the body serves all excitations, its assembly and every
    pass over its matrices (``simulate_many``). What a run cannot do is told in its row, and the
    others go on. Called again it keeps finished runs, continues interrupted ones from their
    checkpoints, and tries failed ones again. The table is made anew after every run, in one piece,
    the figure at the end.

    Args:
        study: the case, its records and the levels of their intensity.
        out: the folder of the runs, the table and the figure.
        jobs: processes at the same time.
        part: (i, n): only every n-th run from the i-th on, for job arrays that share the folder.
        launch: words in front of the command of a run, ("mpirun", "-n", "4"); each has a process of
            its own then.
        say: takes a line about each run, and every half a minute one about the time left.
        wall_time: as of ``simulate``: every run gets what is left of it, and ends with a checkpoint
            before it is over.

    Raises:
        InputError: a folder of another study, or in which the same part runs, a part or number of
            jobs that makes no sense, inside mpirun.
        KeyboardInterrupt: after the runs have been told to stop; OutOfTime: likewise. Call again to
            go on.
    """
    refuse_mpirun()
    if jobs < 1 or not 1 <= part[0] <= part[1]:
        raise InputError(
            f"jobs = {jobs}, part = {part[0]}/{part[1]}: give one job or more, and 1 <= i <= n for "
            "i/n"
        )
    out, end = Path(out), WallTime(wall_time)
    _claim(study, out)
    with lock_folder(SerialComm(), out, LOCK if part[1] == 1 else f"{LOCK}-{part[0]}-of-{part[1]}"):
        every = study.runs(out)
        mine = every[part[0] - 1 :: part[1]]
        left = [run for run in mine if run.done() is None]
        if left:
            _check_demands(study)
        say(
            f"{len(every)} runs, {len(mine)} of them here, {len(mine) - len(left)} finished already"
        )
        number, begin = 0, time.monotonic()
        told = begin
        for found in executed(left, jobs, launch, end):
            now = time.monotonic()
            if isinstance(found, float):
                if now > told + SECONDS and found > 0.0:
                    told = now
                    seconds = int((now - begin) / found * (len(left) - found))
                    say(
                        f"{100.0 * found / len(left):.0f} % of the steps are done, "
                        f"{timedelta(seconds=seconds)} left"
                    )
                continue
            number, told = number + 1, now
            _tell(study, out)
            scale = (
                "?"
                if found["scale"] is None or math.isnan(found["scale"])
                else f"{found['scale']:g}"
            )
            say(
                f"[{number}/{len(left)}] {found['record']} x {scale}: {found['status']}"
                + (f": {found['reason']}" if found["reason"] else "")
            )
        rows = _tell(study, out, draw=True)
        if study.limits:
            _fragilities(study, out, rows, say)
        return rows


def _check_demands(study: IDA) -> None:
    """Raise InputError before the first run for a demand without a column.

    No run will write that column. It assembles the case once.
    """
    try:
        written = study.case.columns(alone())
    except InputError:
        return  # every run will say it, in its row
    for one in study.wanted:
        if one.column not in written:
            raise InputError(
                f"demand '{one.column}': the runs record no such column: "
                f"{nearest(one.column, written)}"
            )


def _claim(study: IDA, out: Path) -> None:
    """Note in the folder whose it is.

    It raises InputError when the folder is another study's.
    """
    case = _digest(to_json(study.case.tables).encode())
    records = {
        one.name: [_digest(path.read_bytes()) for path in one.files if path.is_file()]
        for one in study.shakings
    }
    old = read_json(out / STUDY)
    if old is None:
        if is_own(out / STUDY):
            raise InputError(
                f"'{out / STUDY}' is damaged, or of no study: restore it, choose another folder, "
                "or move this one away"
            )
        for name in (TABLE, COLUMNS, FIGURE, FRAGILITY):
            if os.path.lexists(out / name):
                raise InputError(
                    f"'{out / name}' is not of a study of vi_contact, which would replace it "
                    f"(there is no whole {STUDY} in '{out}'): choose another folder, or move the "
                    "file"
                )
    else:
        kept = old.get("records")
        if not isinstance(kept, dict) or "case" not in old:
            raise InputError(
                f"'{out / STUDY}' is damaged: restore it, choose another folder, or delete this one"
            )
        changed = [name for name, digests in records.items() if kept.get(name, digests) != digests]
        if old["case"] != case or changed:
            what = f"the record '{changed[0]}'" if changed else "the case"
            raise InputError(
                f"'{out}' holds runs from before {what} was changed: choose another folder, or "
                "delete it"
            )
        records = kept | records
    try:
        out.mkdir(parents=True, exist_ok=True)
        write_atomically(out / STUDY, to_json({"case": case, "records": records}).encode())
    except OSError as error:
        raise InputError(
            f"output folder '{out}' cannot be written ({error.strerror}): choose another one"
        ) from None


def _digest(data: bytes) -> str:
    return hashlib.sha256(data).hexdigest()


def _tell(study: IDA, out: Path, *, draw: bool = False) -> list[Row]:
    """Write table and units of all runs in the folder, and draw the figure."""
    rows, units = _tabulated(study.case, inner_folder(out, RUNS), study.measure, study.wanted)
    described = {
        name: {"unit": unit, "meaning": meaning} for name, (unit, meaning) in units.items()
    }
    write_csv(out / TABLE, list(units), (list(row.values()) for row in rows))
    write_atomically(out / COLUMNS, to_json(described).encode())
    if draw and any(row["status"] == "finished" for row in rows):
        panels = [
            _panel(rows, study.measure.name, one.name, units[one.name]) for one in study.wanted
        ]
        plot_ida(panels, out / FIGURE, unit=study.measure.unit, intensity=study.measure.meaning)
    return rows


def _tabulated(
    case: Case, out: Path, measure: Intensity, demands: Sequence[Demand]
) -> tuple[list[Row], Units]:
    """Return (rows by record and scale, column -> (unit, meaning)) of ended runs.

    They are all runs in the folder that have ended; it is None for what a run has not measured.
    InputError when a finished run has no such column.
    """
    folders = [out / name for name in sorted(os.listdir(out))] if out.is_dir() else []
    own = [one for one in folders if one.is_dir() and not one.is_symlink()]
    found = [(one, row) for one in own if (row := read_row(one / ROW)) is not None]
    found.sort(
        key=lambda one: (one[1]["record"], math.inf if one[1]["scale"] is None else one[1]["scale"])
    )
    units: Units = _FIRST_COLUMNS | {
        measure.name: (measure.unit, f"{measure.meaning} of the scaled motion")
    }
    units |= {one.name: ("", one.meaning) for one in demands} | _LAST_COLUMNS
    rows = []
    for folder, row in found:
        measured: Row = {measure.name: None} | {one.name: None for one in demands}
        shaking = Shaking(row["record"], tuple(map(Path, row["files"])))
        if row["scale"] is not None:
            with suppress(InputError):
                measured[measure.name] = (
                    measure.of(shaking.record(case)) * row["scale"] ** measure.degree
                )
        if row["status"] == "finished":
            history, of_column = _history(folder, tuple(one.column for one in demands))
            for one in demands:
                measured[one.name] = one.of(history)
                units[one.name] = (
                    of_column[one.column][0],
                    f"{one.meaning}: {of_column[one.column][1]}",
                )
        rows.append({name: measured.get(name, row.get(name)) for name in units})
    return rows, units


@cache
def _history(folder: Path, wanted: tuple[str, ...]) -> tuple[dict[str, Array], Units]:
    """Return the wanted columns of a finished run, read once.

    Where one of them is missing, it returns all names.
    """
    run = read_run(folder)
    numbers = {name: values for name, values in run.history.items() if np.ndim(values) == 1}
    kept = {name: numbers[name] for name in wanted if name in numbers}
    return (kept if len(kept) == len(set(wanted)) else numbers), dict(run.columns)


def _fragilities(study: IDA, out: Path, rows: Sequence[Row], say: Callable[[str], None]) -> None:
    """Fit, write and draw the curves of the limits, and say each.

    Where none can be fitted, it says why.
    """
    found, table, measure = {}, [], study.measure
    for text in study.limits:
        try:
            fit = fragility_curve(passing(rows, text, measure.name))
        except InputError as error:
            say(f"fragility of {text}: {error}")
            continue
        found[text] = fit.probability, fit.brackets
        table.append(
            [text, fit.theta, *fit.intervals[0], fit.beta, *fit.intervals[1], len(fit.brackets)]
        )
        say(
            "fragility of {}: median {:.4g} ({:.4g} to {:.4g}) {unit}, dispersion {:.3g} ({:.3g} "
            "to {:.3g}), {} records".format(*table[-1], unit=measure.unit)
        )
    names = [
        "limit",
        "theta",
        "theta_low",
        "theta_high",
        "beta",
        "beta_low",
        "beta_high",
        "records",
    ]
    write_csv(out / FRAGILITY, names, table)
    if found:
        plot_fragility(
            found,
            (out / FRAGILITY).with_suffix(".png"),
            unit=measure.unit,
            intensity=measure.meaning,
        )


def _panel(rows: Sequence[Row], level: str, name: str, column: tuple[str, str]) -> DemandPanel:
    """Return what one demand shows."""
    curves: dict[str, tuple[Array, Array]] = {}
    failed: list[float] = []
    known = sorted(
        (row for row in rows if row[level] is not None), key=lambda row: float(row[level])
    )
    for record in dict.fromkeys(row["record"] for row in rows):
        own = [row for row in known if row["record"] == record]
        good = [
            (row[level], row[name])
            for row in own
            if row["status"] == "finished" and math.isfinite(row[name])
        ]
        failed += [row[level] for row in own if row["status"] != "finished"]
        levels, values = np.array(good).reshape(-1, 2).T
        curves[record] = levels, values
    return DemandPanel(
        column[1].partition(":")[0], column[0], curves, *fractiles(curves, SHARES), tuple(failed)
    )
