"""Read what a run left in its folder.

This is histories, units, facts and the geometry of the contact points.
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from textwrap import shorten
from typing import Any, TypeVar

import numpy as np

from ...core.algebra import Array, Indices, Mask
from ...core.arguments import check_arguments
from ...core.checks import SHOWN, quote
from ...core.errors import InputError, is_of_machine
from ...core.files import describe_os_error, open_hdf5
from ...core.hdf5 import StoredFile
from ...core.own_files import is_own, open_to_read, read_bytes
from .folder import COLUMNS, HISTORY_CSV, HISTORY_H5, SUMMARY, check_folder_format
from .stored_rows import parse_numbers

T = TypeVar("T")
BYTES = 100_000_000  # of a JSON file
_NEEDED = ("t", "k", "iterations", "certificate", "escalated")  # columns of every run
_NUMBER = (int, float)
_KINDS: dict[str, type | tuple[type, ...]] = {  # of the entries of summary.json that are used
    "scheme": str,
    "mass": str,
    "solver": str,
    "status": str,
    "reason": str,
    "dt": (int, float, str),
    "versions": dict,
    "iterations_per_step": dict,
    "tolerance": _NUMBER,
    "ranks": int,
    "unknowns": int,
    "contact_points": int,
    "energy_defect": _NUMBER,
    "worst_certificate": _NUMBER,
    "energy_created": _NUMBER,
    "steps": int,
}


@dataclass(frozen=True)
class ContactGeometry:
    """Hold contact points as group ``contact`` of history.h5 has them: see ``ContactSurface``.

    ``uncovered`` and ``alone`` are None in runs before 0.3, which do not tell.
    """

    points: Array
    normals: Array
    weights: Array
    gap0: Array
    bilateral: Mask
    uncovered: Mask | None = None
    alone: Mask | None = None

    @property
    def frame_nodes(self) -> Indices | None:
        """Return numbers (m,) of the nodes whose frames hold the tangents of their conditions.

        What is at one place is one node. It is None where each condition has tangents of its own.
        """
        if self.alone is not None and self.alone.any():
            return None
        return np.unique(self.points, axis=0, return_inverse=True)[1].ravel()


@dataclass(frozen=True)
class RunFolder:
    """Hold a run read from its files, as ``Solution`` has it.

    Attributes:
        folder: where it is.
        history: column -> values, (rows,) or (rows, …) for arrays per contact point.
        columns: column -> (unit, meaning).
        facts: summary.json; empty while a run goes on or after it was killed.
        contact: None when history.h5 is missing, as early in a run, or the problem has no contact
            points.
    """

    folder: Path
    history: Mapping[str, Array]
    columns: Mapping[str, tuple[str, str]]
    facts: Mapping[str, Any]
    contact: ContactGeometry | None

    def to_xarray(self) -> Any:
        """Return the histories as an xarray Dataset, as ``Solution.to_xarray`` does.

        Raises:
            InputError: xarray is not installed.
        """
        from ..dataset import make_dataset  # late: only who asks needs xarray

        return make_dataset(self.history, self.columns, self.facts, self.contact)


@check_arguments
def read_run(folder: str | Path) -> RunFolder:
    """Read a run folder of ``simulate``.

    For a run that is still going on or was killed, return what is there. Numbers come from
    history.csv, which has every step. Arrays come from history.h5, when it has all steps too (it
    does once the run has ended).

    Raises:
        InputError: there is no history, or a file is damaged.
    """
    folder = Path(folder)
    if not is_own(folder / HISTORY_CSV):
        raise InputError(f"'{folder}' has no {HISTORY_CSV}: give the output folder of a run")
    check_folder_format(folder)
    history = _read_numbers(folder / HISTORY_CSV)
    columns = _read_file(folder / COLUMNS, lambda path: _check_columns(read_object(path), history))
    facts = _read_file(folder / SUMMARY, _read_summary)
    _check_rows(folder, history, facts)
    arrays, contact = _read_file(folder / HISTORY_H5, lambda path: _read_arrays(path, history))
    return RunFolder(folder, history | arrays, columns, facts, contact)


def _read_file(path: Path, read: Callable[[Path], T]) -> T:
    """Return what is read from a file of a run.

    Raises:
        InputError: names the file when it is missing or damaged.
    """
    try:
        return read(path)
    except InputError:
        raise
    except (OSError, ValueError, KeyError, TypeError, RuntimeError, AttributeError) as error:
        # of json and h5py
        if is_of_machine(error):
            raise
        raise InputError(
            f"a file of the run, '{path}', is missing or damaged ({_shorten(error)}): restore it"
        ) from error


def _shorten(error: Exception) -> str:
    """Return the reason on one line; that of a damaged table may be as long as the table."""
    return shorten(" ".join(part[:SHOWN] for part in str(error).split()), 200, placeholder=" …")


def read_object(path: Path) -> dict[str, Any]:
    """Return the JSON object of a file.

    Raises:
        ValueError: anything else, NaN, and texts that cannot be printed.
    """
    with open_to_read(path) as file:
        data = file.read(BYTES + 1)
    if len(data) > BYTES:
        raise ValueError(f"{path.name} is larger than {BYTES:.0e} bytes")
    try:
        content = json.loads(data.decode("utf-8"), parse_constant=lambda word: [])
    except RecursionError:
        raise ValueError(f"{path.name} is nested too deep") from None
    if not isinstance(content, dict):
        raise ValueError(f"{path.name} does not hold an object")
    json.dumps(content, ensure_ascii=False).encode()  # lone surrogates
    return content


def _check_columns(
    content: dict[str, Any], history: Mapping[str, Array]
) -> dict[str, tuple[str, str]]:
    """Return column -> (unit, meaning) of the content of columns.json, which knows all columns."""
    columns = {name: (about["unit"], about["meaning"]) for name, about in content.items()}
    if not all(isinstance(text, str) for pair in columns.values() for text in pair):
        raise ValueError(f"{COLUMNS}: units and meanings are texts")
    for name in history:
        if name not in columns:
            raise ValueError(f"{COLUMNS} does not know the column {quote(name)}")
    return columns


def _read_summary(path: Path) -> dict[str, Any]:
    """Return the content of summary.json; nothing when there is none yet."""
    return _check_facts(read_object(path)) if is_own(path) else {}


def _check_facts(facts: dict[str, Any]) -> dict[str, Any]:
    """Return the summary, its entries of the kinds that ``Solution`` writes."""
    for name, kinds in _KINDS.items():
        value = facts.get(name)
        if value is not None and not _fits(value, kinds):
            raise ValueError(f"{SUMMARY}: {name} is {quote(value)}")
    mean = (facts.get("iterations_per_step") or {}).get("mean")
    if mean is not None and not _fits(mean, _NUMBER):
        raise ValueError(f"{SUMMARY}: iterations_per_step is {quote(mean)}")
    return facts


def _fits(value: Any, kinds: type | tuple[type, ...]) -> bool:
    """Say whether a value is of these kinds, a number no larger than those of the machine."""
    if not isinstance(value, kinds) or isinstance(value, bool):
        return False
    return not isinstance(value, int | float) or abs(value) < 1e300


def _read_numbers(path: Path) -> dict[str, Array]:
    """Return the columns of history.csv; a last line that a crash cut short is left out."""
    try:
        whole_lines = []
        for line in read_bytes(path).splitlines(keepends=True):
            if line.endswith(b"\n"):
                whole_lines.append(line)
        header, *lines = whole_lines
        names = header.decode().strip().split(",")
        history = dict(zip(names, parse_numbers(str(path), lines, len(names), 0).T, strict=True))
        if not lines or len(history) != len(names):
            raise ValueError("there are no rows, or two columns have one name")
        missing = [name for name in _NEEDED if name not in history]
        if missing:
            raise ValueError(f"no column {missing[0]}")
        if not np.all(np.isfinite(history["t"])) or np.any(np.diff(history["t"]) <= 0.0):
            raise ValueError("the times do not increase")
    except InputError:
        raise
    except OSError as error:
        raise InputError(describe_os_error(error)) from error
    except ValueError as error:
        raise InputError(
            f"'{path}' is damaged ({_shorten(error)}): restore it or run again"
        ) from error
    return history


def _check_rows(folder: Path, history: Mapping[str, Array], facts: Mapping[str, Any]) -> None:
    """Raise InputError when history.csv has lost rows.

    Numbers of steps follow each other, up to the one of the summary.

    Args:
        folder: of the run.
        history: its numbers.
        facts: its summary; empty while it goes on.
    """
    rows = len(history["t"])
    steps = facts.get("steps")
    gaps = np.flatnonzero(np.diff(history["k"]) != 1.0)
    if len(gaps):
        raise InputError(
            f"'{folder / HISTORY_CSV}' is damaged (the steps k after line {gaps[0] + 2} do not "
            "follow each other): restore it or run again"
        )
    if isinstance(steps, int) and rows < steps + 1:
        raise InputError(
            f"'{folder / HISTORY_CSV}' is damaged ({rows} rows are there, {SUMMARY} tells of "
            f"{steps} steps and the initial state): restore it or run again"
        )


def _compare(path: Path, file: StoredFile, history: Mapping[str, Array]) -> None:
    """Raise InputError when history.csv and history.h5 differ in a row that both have.

    They hold the same numbers.

    Args:
        path: of history.h5.
        file: the same, open.
        history: the numbers of history.csv.
    """
    for name, numbers in history.items():
        if name not in file or file[name].ndim != 1:
            raise ValueError(f"{HISTORY_H5}: the column {quote(name)} is missing")
        in_hdf5 = file[name][: len(numbers)]
        in_csv = numbers[: len(in_hdf5)]
        are_equal = (in_hdf5 == in_csv) | (np.isnan(in_hdf5) & np.isnan(in_csv))
        differ = np.flatnonzero(~are_equal)
        if len(differ):
            csv = path.with_name(HISTORY_CSV)
            raise InputError(
                f"'{csv}' and '{path}' differ in {name}, line {differ[0] + 2}: one of them is "
                f"damaged or was changed; restore it, or move {HISTORY_H5} away to read the other "
                "alone"
            )


def _read_arrays(
    path: Path, history: Mapping[str, Array]
) -> tuple[dict[str, Array], ContactGeometry | None]:
    """Return (array columns when they have all rows, geometry of the contact points)."""
    rows = len(history["t"])
    if not is_own(path):
        return {}, None
    with open_hdf5(path) as file:
        _compare(path, file, history)
        group = file["contact"]
        geometry = ContactGeometry(
            points=group["points"][()],
            normals=group["normals"][()],
            weights=group["weights"][()],
            gap0=group["gap0"][()],
            bilateral=group["bilateral"][()],
            uncovered=group["uncovered"][()].astype(bool) if "uncovered" in group else None,
            alone=group["alone"][()].astype(bool) if "alone" in group else None,
        )

        # What is damaged may have any shapes: one number, or one vector, for each point.
        count = len(geometry.weights)
        numbers = [geometry.weights, geometry.gap0, geometry.bilateral]
        numbers += [mask for mask in (geometry.uncovered, geometry.alone) if mask is not None]
        vectors = np.shape(geometry.points)
        fit = all(np.shape(values) == (count,) for values in numbers)
        fit = fit and len(vectors) == 2 and vectors[0] == count
        if not fit or np.shape(geometry.normals) != vectors:
            raise ValueError(f"{HISTORY_H5}: the contact points do not fit each other")

        # Arrays have a row for each step and point; numbers come from history.csv.
        arrays = {}
        for name in file:
            if name != "contact" and file[name].ndim > 1 and file[name].shape[0] == rows:
                arrays[name] = file[name][()]
        if any(values.shape[1] != count for values in arrays.values()):
            raise ValueError(f"{HISTORY_H5}: arrays are not those of {count} contact points")
    return arrays, geometry if count else None
