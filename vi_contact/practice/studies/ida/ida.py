"""Make incremental dynamic analyses.

One structure is put under many motions, each at many intensities; the result is one tidy table.

Vamvatsikos and Cornell, Earthquake Engng Struct. Dyn. 31 (2002). In the folder of a study, beside
``ida.csv``, ``columns.json`` and ``ida.png``: ``fragility.csv`` and ``fragility.png``, where there
are limits, with ``fragility.xml`` for OpenQuake; ``ida.json``, the case and the records, so that no
other study is mixed in, and ``runs/NAME_xSCALE``, the folder of every run, with its row.
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
from ..cases.description.model import describe
from ..cases.parsing import suggest_nearest
from .fragility import bracket_capacities, fragility_curve, read_limit
from .measures import Demand, Intensity, compute_fractiles, read_demand, read_intensity
from .openquake import name_measure, write_fragility_model
from .processes import execute_runs, refuse_mpirun
from .runs import ROW, OneRun, Row, Shaking, gather_shakings, read_json, read_row
from .selection import Selected

Units = dict[str, tuple[str, str]]
SECONDS = 30.0  # between two lines about the time left
SHARES = (0.16, 0.50, 0.84)  # of the records below the curves of the figure

# Files and folders of a study.
TABLE = "ida.csv"
COLUMNS = "columns.json"
FIGURE = "ida.png"
DIGITS = 12  # of an intensity: rounding beyond them would print a level of 1 as 0.9999999999999999
STRETCHED = 4.0  # a record that is multiplied by more is no longer like a quake of that strength
STUDY = "ida.json"
RUNS = "runs"
FRAGILITY = "fragility.csv"
MODEL = "fragility.xml"

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

    Args:
        case: shaken by GroundMotions alone, whose record files are replaced.
        motions: a file, or one file per GroundMotion of the case, for each record; its name is that
            of its first file. Or what ``record_set`` returns of a selection, whose factors
            multiply scales.
        demands: "COLUMN" or "COLUMN:max", ":min", ":absmax", ":last" of history.csv.
        scales: factors on the motion as the case prepares it.
        levels: in place of scales, values of the intensity, in its unit.
        intensity: "pga", "pgv", "pgd", "sa:T", "sa:T1" (T1 as ``vi-contact run --check`` tells it),
            "arias", "cav", "housner", of the first motion.
        limits: "COLUMN:WAY=VALUE", each gets a fragility curve.

    Raises:
        InputError: for other words, no motions, two of one name, not exactly one of scales and
            levels.
    """

    case: Case
    motions: Sequence[str | Path | Sequence[str | Path] | Selected]
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
        # Words and files that are wrong are told now, and not by a run.
        _ = self.measure
        _ = self.wanted
        _ = self.shakings

    @cached_property
    def measure(self) -> Intensity:
        """Return the intensity measure."""
        return read_intensity(self.intensity, self._find_first_period)

    def _find_first_period(self) -> float:
        """Return T1 of the case with the first record [s]; zero where it has no periods."""
        settings = (*self.case.settings, *self.shakings[0].settings(self.case))
        case = read_case(self.case.path, settings, allow=self.case.allowed)
        model = describe(case, alone())
        return float(next(iter(model.get("periods", ())), 0.0))

    @property
    def wanted(self) -> list[Demand]:
        """Return the demand parameters, those of the limits among them."""
        demands = [read_demand(text) for text in self.demands]
        demands += [read_limit(text)[0] for text in self.limits]
        return list(dict.fromkeys(demands))

    @property
    def shakings(self) -> list[Shaking]:
        """Return the motions by name."""
        return gather_shakings(self.case, self.motions)

    def runs(self, out: Path) -> list[OneRun]:
        """Return every record at every scale, record by record."""
        values = (*self.scales, *self.levels)
        return [self._make_run(out, one, value) for one in self.shakings for value in values]

    def _make_run(self, out: Path, shaking: Shaking, value: float) -> OneRun:
        """Return the run of a record at a scale or level; one that cannot run tells why.

        Args:
            out: the folder of the study.
            shaking: the record.
            value: the scale, or the level.
        """
        kind = self.measure.name if self.levels else "x"
        folder = out / RUNS / f"{shaking.name}_{kind}{value!r}"
        try:
            record = shaking.record(self.case)
            factor = self.measure.scale(record, value) if self.levels else value
        except InputError as error:
            unknown = math.nan if self.levels else value
            return OneRun(self.case, shaking, unknown, folder, str(error))
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
    """Make the runs that have not finished yet, and table and figure of all that are in ``out``.

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

    Returns:
        The rows of the table.

    Raises:
        InputError: a folder of another study, or in which the same part runs, a part or number of
            jobs that makes no sense, inside mpirun.
        KeyboardInterrupt: after the runs have been told to stop. Call again to go on.
        OutOfTime: likewise.
    """
    refuse_mpirun()
    if jobs < 1 or not 1 <= part[0] <= part[1]:
        raise InputError(
            f"jobs = {jobs}, part = {part[0]}/{part[1]}: give one job or more, and 1 <= i <= n for "
            "i/n"
        )
    out = Path(out)
    end = WallTime(wall_time)
    _claim_folder(study, out)
    lock = LOCK if part[1] == 1 else f"{LOCK}-{part[0]}-of-{part[1]}"
    with lock_folder(SerialComm(), out, lock):
        every = study.runs(out)
        mine = every[part[0] - 1 :: part[1]]
        left = [run for run in mine if run.read_finished() is None]
        if left:
            _check_demands(study)
        _tell_stretched(left, say)
        say(
            f"{len(every)} runs, {len(mine)} of them here, {len(mine) - len(left)} finished already"
        )
        progress = _Progress(len(left), say)
        for news in execute_runs(left, jobs, launch, end):
            if isinstance(news, float):
                progress.tell_time_left(news)
            else:
                _write_table(study, out)
                progress.tell_row(news)
        rows = _write_table(study, out, draw=True)
        if study.limits:
            _write_fragilities(study, out, rows, say)
        return rows


class _Progress:
    """Tell of the runs that end, and now and then of the time that is left.

    Args:
        count: of the runs.
        say: takes a line.
    """

    def __init__(self, count: int, say: Callable[[str], None]) -> None:
        self._count = count
        self._say = say
        self._number = 0  # of runs that have ended
        self._begin = time.monotonic()
        self._last = self._begin  # when the last line was said

    def tell_time_left(self, done: float) -> None:
        """Say the time that is left, SECONDS after the last line; ``done``: runs and parts of."""
        now = time.monotonic()
        if now > self._last + SECONDS and done > 0.0:
            self._last = now
            seconds = int((now - self._begin) / done * (self._count - done))
            self._say(
                f"{100.0 * done / self._count:.0f} % of the steps are done, "
                f"{timedelta(seconds=seconds)} left"
            )

    def tell_row(self, row: Row) -> None:
        """Say how a run has ended."""
        self._last = time.monotonic()
        self._number += 1
        scale = row["scale"]
        factor = "?" if scale is None or math.isnan(scale) else f"{scale:g}"
        reason = f": {row['reason']}" if row["reason"] else ""
        self._say(
            f"[{self._number}/{self._count}] {row['record']} x {factor}: {row['status']}{reason}"
        )


def _tell_stretched(runs: Sequence[OneRun], say: Callable[[str], None]) -> None:
    """Say which records are multiplied by more than STRETCHED, and by how much at most."""
    factors: dict[str, float] = {}
    for run in runs:
        if run.factor > STRETCHED:  # NaN is not
            factors[run.shaking.name] = max(run.factor, factors.get(run.shaking.name, 0.0))
    if factors:
        names = ", ".join(f"{name} by up to {factor:.3g}" for name, factor in factors.items())
        say(
            f"records are multiplied by more than {STRETCHED:g}: {names}; a strong quake has "
            "another spectrum than a weak one enlarged, so take stronger records or lower levels"
        )


def _check_demands(study: IDA) -> None:
    """Raise InputError before the first run for a demand without a column.

    No run will write that column. It assembles the case once.
    """
    try:
        written = study.case.columns(alone())
    except InputError:
        return  # every run will say it, in its row
    for demand in study.wanted:
        if demand.column not in written:
            raise InputError(
                f"demand '{demand.column}': the runs record no such column: "
                f"{suggest_nearest(demand.column, written)}"
            )


def _claim_folder(study: IDA, out: Path) -> None:
    """Note in the folder whose it is.

    Raises:
        InputError: for the folder of another study, and for files that no study has made.
    """
    # What a report says beside the mechanics makes no other study.
    tables = {name: table for name, table in study.case.tables.items() if name != "sheet"}
    case = _digest(to_json(tables).encode())
    records = {shaking.name: _digest_files(shaking) for shaking in study.shakings}
    old = read_json(out / STUDY)
    if old is None:
        _refuse_files_of_others(out)
    else:
        old_records = old.get("records")
        if not isinstance(old_records, dict) or "case" not in old:
            raise InputError(
                f"'{out / STUDY}' is damaged: restore it, choose another folder, or delete this one"
            )
        changed = [
            name for name, digests in records.items() if old_records.get(name, digests) != digests
        ]
        if old["case"] != case or changed:
            subject = f"the record '{changed[0]}'" if changed else "the case"
            raise InputError(
                f"'{out}' holds runs from before {subject} was changed: choose another folder, or "
                "delete it"
            )
        records = old_records | records
    try:
        out.mkdir(parents=True, exist_ok=True)
        write_atomically(out / STUDY, to_json({"case": case, "records": records}).encode())
    except OSError as error:
        raise InputError(
            f"output folder '{out}' cannot be written ({error.strerror}): choose another one"
        ) from None


def _refuse_files_of_others(out: Path) -> None:
    """Raise InputError for files that a study would replace, in a folder that is of none."""
    if is_own(out / STUDY):
        raise InputError(
            f"'{out / STUDY}' is damaged, or of no study: restore it, choose another folder, "
            "or move this one away"
        )
    for name in (TABLE, COLUMNS, FIGURE, FRAGILITY, MODEL):
        if os.path.lexists(out / name):
            raise InputError(
                f"'{out / name}' is not of a study of vi_contact, which would replace it "
                f"(there is no whole {STUDY} in '{out}'): choose another folder, or move the "
                "file"
            )


def _digest_files(shaking: Shaking) -> list[str]:
    """Return the checksums of the files of a record, and its factor if it has one.

    A file that is missing is told by its runs.
    """
    digests = [_digest(path.read_bytes()) for path in shaking.files if path.is_file()]
    return digests if shaking.factor == 1.0 else [*digests, repr(shaking.factor)]


def _digest(data: bytes) -> str:
    """Return the checksum of a file."""
    return hashlib.sha256(data).hexdigest()


def _write_table(study: IDA, out: Path, *, draw: bool = False) -> list[Row]:
    """Write table and units of all runs in the folder, and draw the figure."""
    rows, units = _tabulate(study.case, inner_folder(out, RUNS), study.measure, study.wanted)
    columns = {name: {"unit": unit, "meaning": meaning} for name, (unit, meaning) in units.items()}
    write_csv(out / TABLE, list(units), (list(row.values()) for row in rows))
    write_atomically(out / COLUMNS, to_json(columns).encode())
    if draw and any(row["status"] == "finished" for row in rows):
        panels = [
            _make_panel(rows, study.measure.name, demand.name, units[demand.name])
            for demand in study.wanted
        ]
        plot_ida(panels, out / FIGURE, unit=study.measure.unit, intensity=study.measure.meaning)
    return rows


def _tabulate(
    case: Case, out: Path, measure: Intensity, demands: Sequence[Demand]
) -> tuple[list[Row], Units]:
    """Return the rows of all runs in the folder that have ended, and what their columns mean.

    Args:
        case: of the study.
        out: the folder of its runs.
        measure: of the intensity.
        demands: on the structure.

    Returns:
        Rows by record and scale, with None for what a run has not measured, and column -> (unit,
        meaning).

    Raises:
        InputError: where a finished run has no column of a demand.
    """
    units: Units = dict(_FIRST_COLUMNS)
    units[measure.name] = (measure.unit, f"{measure.meaning} of the scaled motion")
    units |= {demand.name: ("", demand.meaning) for demand in demands} | _LAST_COLUMNS
    rows = []
    for folder, row in _read_rows(out):
        measured: Row = {measure.name: None} | {demand.name: None for demand in demands}
        if row["scale"] is not None:
            # The intensity is that of the unscaled motion, times a power of the scale.
            shaking = Shaking(row["record"], tuple(map(Path, row["files"])))
            with suppress(InputError):
                unscaled = measure.compute(shaking.record(case))
                intensity = unscaled * row["scale"] ** measure.degree
                measured[measure.name] = float(f"{intensity:.{DIGITS}g}")
        if row["status"] == "finished":
            history, columns = _read_history(folder, tuple(demand.column for demand in demands))
            for demand in demands:
                measured[demand.name] = demand.compute(history)
                unit, meaning = columns[demand.column]
                units[demand.name] = (unit, f"{demand.meaning}: {meaning}")
        rows.append({name: measured.get(name, row.get(name)) for name in units})
    return rows, units


def _read_rows(out: Path) -> list[tuple[Path, Row]]:
    """Return folder and row of the runs that have ended, by record and scale."""
    folders = [out / name for name in sorted(os.listdir(out))] if out.is_dir() else []
    rows: list[tuple[Path, Row]] = []
    for folder in folders:
        if folder.is_dir() and not folder.is_symlink():
            row = read_row(folder / ROW)
            if row is not None:
                rows.append((folder, row))
    rows.sort(key=lambda entry: _make_sort_key(entry[1]))
    return rows


def _make_sort_key(row: Row) -> tuple[str, float]:
    """Return by what rows are sorted; those without a scale are the last of their record."""
    return row["record"], math.inf if row["scale"] is None else row["scale"]


@cache
def _read_history(folder: Path, wanted: tuple[str, ...]) -> tuple[dict[str, Array], Units]:
    """Return the wanted columns of a finished run, read once, and what its columns mean.

    Where one of them is missing, it returns all, whose names the error tells.
    """
    run = read_run(folder)
    numbers = {name: values for name, values in run.history.items() if np.ndim(values) == 1}
    selected = {name: numbers[name] for name in wanted if name in numbers}
    complete = len(selected) == len(set(wanted))
    return selected if complete else numbers, dict(run.columns)


def _write_fragilities(
    study: IDA, out: Path, rows: Sequence[Row], say: Callable[[str], None]
) -> None:
    """Fit, write and draw the curves of the limits, and say each.

    Where none can be fitted, it says why.
    """
    measure = study.measure
    curves = {}
    fits = {}
    table = []
    for text in study.limits:
        try:
            fit = fragility_curve(bracket_capacities(rows, text, measure.name))
        except InputError as error:
            say(f"fragility of {text}: {error}")
            continue
        fits[text] = fit
        curves[text] = (fit.probability, fit.brackets)
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
    if fits and name_measure(measure.name) is not None:
        taxonomy = study.case.path.stem
        write_fragility_model(out / MODEL, fits, measure.name, taxonomy=taxonomy)
    if curves:
        plot_fragility(
            curves,
            (out / FRAGILITY).with_suffix(".png"),
            unit=measure.unit,
            intensity=measure.meaning,
        )


def _make_panel(rows: Sequence[Row], level: str, name: str, column: tuple[str, str]) -> DemandPanel:
    """Return what the figure shows of one demand.

    Args:
        rows: of the table.
        level: the column of the intensity.
        name: the column of the demand.
        column: unit and meaning of the demand.
    """
    curves: dict[str, tuple[Array, Array]] = {}
    failed: list[float] = []
    known = sorted(
        (row for row in rows if row[level] is not None), key=lambda row: float(row[level])
    )
    for record in dict.fromkeys(row["record"] for row in rows):
        own = [row for row in known if row["record"] == record]
        finished = [row for row in own if row["status"] == "finished"]
        points = [(row[level], row[name]) for row in finished if math.isfinite(row[name])]
        levels, values = np.array(points).reshape(-1, 2).T
        curves[record] = (levels, values)
        failed += [row[level] for row in own if row["status"] != "finished"]
    unit, meaning = column
    title = meaning.partition(":")[0]
    return DemandPanel(title, unit, curves, *compute_fractiles(curves, SHARES), tuple(failed))
