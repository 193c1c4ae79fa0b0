"""Read an entry of the validation book, and refuse what is missing or does not fit.

``entry.toml`` has, beside title, kind and sentences, these tables:

    [data]          sha256 of data.csv: a value that is changed is noticed
    [records]       file -> sha256, of records that stand where VI_CONTACT_RECORDS says
    [inputs.NAME]   value, unit, kind (measured, given or CHOSEN), source
    [rows]          setting -> which rows of data.csv it computes; all where it is not named
    [[figure]]      name, unit, limit, reason, and wanted, or column and where of data.csv;
                    known = true: a known difference, which its limit keeps from growing
    [[statistic]]   of which series of figures, what, wanted, limit, reason
    [[told]]        name, unit, reason: what is told and not judged
    [[mutant]]      name, change of inputs, red: the figures that must fail then, or "the run"
"""

import importlib.util
import math
import os
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from types import ModuleType
from typing import Any

from ..core.arguments import check_arguments
from ..core.checks import instance, number, optional, quote, several
from ..core.errors import InputError
from ..core.own_files import read_bytes
from .data import Data, Row, read_data
from .statistics import QUANTITIES

ENTRIES = Path(__file__).resolve().parent / "entries"
RECORDS = "VI_CONTACT_RECORDS"  # the environment variable that names the folder of records
KINDS = {
    "E": "measured",
    "B": "published by a program or a benchmark",
    "T": "textbook",
    "C": "closed form",
    "H": "calculated by hand for this book",
}
ORIGINS = ("measured", "given", "CHOSEN")
SETTINGS = ("smallest", "coarse", "fine")
RUN = "the run"  # among what a mutant turns red: it ends in an error

_TABLES = ("data", "records", "inputs", "rows", "figure", "statistic", "told", "mutant")
_WORDS = ("title", "kind", "about", "model", "is_not")
_FIGURE = (
    "name", "unit", "wanted", "column", "where", "limit", "relative", "floor", "up_to", "reason",
    "series", "at", "known",
)  # fmt: skip


class Missing(InputError):
    """Say that records are not there: the entry is skipped, and this is printed."""


@dataclass(frozen=True)
class Input:
    """Hold an input of a computation.

    Attributes:
        value: a number in ``unit``, or a word or a truth value that chooses.
        unit: of the number; "" for a choice.
        kind: "measured", "given" by the source, or "CHOSEN" here.
        source: where it comes from, or why it was chosen.
    """

    value: float | str | bool
    unit: str
    kind: str
    source: str


class Inputs(dict[str, Any]):
    """Hold what a computation is given: name -> value, and the conditions of the rows.

    Attributes:
        rows: rows of data.csv without the columns that figures are compared with.
        records: the folder of records; None for entries that need none.
    """

    rows: Sequence[Row]
    records: Path | None

    def __init__(
        self, values: Mapping[str, Any], rows: Sequence[Row] = (), records: Path | None = None
    ) -> None:
        """Copy the values.

        Args:
            values: name -> value.
            rows: as the attribute.
            records: as the attribute.

        Raises:
            InputError: an argument is of another type.
        """
        remedy = "give what entry.toml has under [inputs], name -> value"
        super().__init__(instance("Inputs", "values", values, Mapping, remedy))
        for row in several("Inputs", "rows", rows, "give the rows of data.csv"):
            instance("Inputs", "a row", row, Mapping, "give the rows of data.csv")
        optional(instance, "Inputs", "records", records, Path, "give Path('the folder')")
        self.rows = rows
        self.records = records


@dataclass(frozen=True)
class Wanted:
    """Hold a value that a figure is compared with.

    Attributes:
        name: of the figure.
        unit: of all three numbers.
        value: of the source.
        limit: largest |found - value|.
        reason: why the limit is what it is, one sentence.
        series: the series that it counts in; "" for a figure that is judged by itself.
        group: the series, or the name with its {columns} of the table that it is one of; "" for
            a figure that stands alone.
        known: whether it is known to differ: within its limit it does not agree either.
    """

    name: str
    unit: str
    value: float
    limit: float
    reason: str
    series: str = ""
    group: str = ""
    known: bool = False


@dataclass(frozen=True)
class Statistic:
    """Hold a limit of a series: ``what`` is one of ``statistics.QUANTITIES``."""

    name: str
    series: str
    what: str
    value: float
    limit: float
    reason: str


@dataclass(frozen=True)
class Mutant:
    """Hold a change of inputs, and the figures and statistics that must fail with it."""

    name: str
    change: Mapping[str, Any]
    red: Sequence[str]


@dataclass(frozen=True)
class Told:
    """Hold a number that is told and not judged, and why."""

    name: str
    unit: str
    reason: str


@dataclass(frozen=True)
class Entry:
    """Hold an entry of the book, whose parts fit each other.

    Attributes:
        name: that of its folder.
        folder: where it stands.
        title: one line.
        kind: a key of ``KINDS``.
        about: what is compared, one or two sentences.
        model: how it is computed, sentence by sentence.
        is_not: what the result is not, sentence by sentence.
        inputs: name -> input.
        data: the numbers of the source.
        records: file -> sha256 of the records that it needs.
        statistics: limits of series.
        told: what is not judged.
        mutants: changes that must be noticed.
    """

    name: str
    folder: Path
    title: str
    kind: str
    about: str
    model: Sequence[str]
    is_not: Sequence[str]
    inputs: Mapping[str, Input]
    data: Data
    records: Mapping[str, str]
    statistics: Sequence[Statistic]
    told: Sequence[Told]
    mutants: Sequence[Mutant]
    figure_tables: Sequence[Mapping[str, Any]]
    row_filters: Mapping[str, Mapping[str, Any]]

    def rows(self, setting: str) -> list[Row]:
        """Return the rows of data.csv that a setting computes."""
        chosen = self.row_filters.get(setting, {})
        return [row for row in self.data.rows if _matches(row, chosen)]

    def list_wanted(self, setting: str) -> list[Wanted]:
        """Return what the figures of a setting are compared with, in the order of entry.toml."""
        wanted: list[Wanted] = []
        for table in self.figure_tables:
            if setting in table.get("at", SETTINGS):
                wanted += _expand_figure(self, table, self.rows(setting))
        return wanted

    def gather_inputs(self, setting: str, change: Mapping[str, Any] | None = None) -> Inputs:
        """Return the inputs of a computation.

        Args:
            setting: one of ``SETTINGS``.
            change: name -> another value, of a mutant.

        Raises:
            Missing: the records are not there.
            InputError: a record that was changed, or a change of an input that does not exist.
        """
        values = {name: one.value for name, one in self.inputs.items()}
        for name, value in (change or {}).items():
            if name not in values:
                raise InputError(
                    f"{self.name}: no input is called '{name}': change one of {list(values)}"
                )
            values[name] = value
        results = {table["column"] for table in self.figure_tables if "column" in table}
        conditions = []
        for row in self.rows(setting):
            conditions.append({key: cell for key, cell in row.items() if key not in results})
        return Inputs(values, conditions, find_records(self.name, self.records))

    @cached_property
    def run(self) -> ModuleType:
        """Return run.py as a module, with its function ``figures``."""
        return load_run(self.folder)


@check_arguments
def entry_names(folder: str | Path = ENTRIES) -> list[str]:
    """Return the names of the entries in a folder, those of the package by default."""
    return sorted(path.parent.name for path in Path(folder).glob("*/entry.toml"))


def find_entry(name: str | Path) -> Path:
    """Return the folder of an entry, by its name or its path; InputError if there is none."""
    known = entry_names()
    folder = ENTRIES / name if str(name) in known else Path(name)
    if not (folder / "entry.toml").is_file():
        raise InputError(
            f"no entry of the validation book is called {quote(str(name))}: choose one of "
            f"{', '.join(known)}, or give the folder of one"
        )
    return folder


@check_arguments
def read_entry(name: str | Path) -> Entry:
    """Read an entry: that of a name of the package, or that in a folder.

    Raises:
        InputError: one that does not exist, or whose parts are missing or do not fit each other.
            The sentence begins with the name of the entry.
    """
    folder = find_entry(name)
    try:
        return _read_folder(folder)
    except InputError as error:
        raise InputError(f"{folder.name}: {error}") from error


def _read_folder(folder: Path) -> Entry:
    """Return the entry in a folder."""
    path = folder / "entry.toml"
    try:
        tables = tomllib.loads(read_bytes(path).decode("utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputError(f"entry.toml cannot be read ({error}): correct it") from error
    for key in tables:
        if key not in (*_WORDS, *_TABLES):
            raise InputError(f"entry.toml has '{key}', which nothing reads: leave it out")
    if tables.get("kind") not in KINDS:
        raise InputError(f"kind is {quote(tables.get('kind'))}: give one of {', '.join(KINDS)}")
    for key in ("title", "about"):
        _text(tables, key, "entry.toml")
    for key in ("model", "is_not"):
        if not tables.get(key) or not all(isinstance(text, str) for text in tables[key]):
            raise InputError(f"entry.toml has no {key}: give a list of sentences")

    data = read_data(folder / "data.csv")
    _refuse_changed(data, tables.get("data", {}))
    entry = Entry(
        name=folder.name,
        folder=folder,
        title=tables["title"],
        kind=tables["kind"],
        about=tables["about"],
        model=tables["model"],
        is_not=tables["is_not"],
        inputs={name: _read_input(name, table) for name, table in tables.get("inputs", {}).items()},
        data=data,
        records=tables.get("records", {}),
        statistics=[_read_statistic(table) for table in tables.get("statistic", [])],
        told=[_read_told(table) for table in tables.get("told", [])],
        mutants=[_read_mutant(table) for table in tables.get("mutant", [])],
        figure_tables=tables.get("figure", []),
        row_filters=tables.get("rows", {}),
    )
    _refuse_unfit(entry)
    return entry


def _refuse_changed(data: Data, table: Mapping[str, Any]) -> None:
    """Raise InputError unless data.csv is the file whose checksum entry.toml has."""
    if table.get("sha256") != data.checksum:
        raise InputError(
            f"data.csv was changed: its checksum is {data.checksum}, and entry.toml has "
            f"{quote(table.get('sha256'))} in [data]: take the file of the book again, or, if the "
            "source was corrected, say so in the file and enter the new checksum"
        )


def _text(table: Mapping[str, Any], key: str, owner: str) -> str:
    """Return a text of a table; InputError where it is missing or empty."""
    value = table.get(key)
    if not isinstance(value, str) or not value.strip():
        raise InputError(f"{owner} has no {key}: give a text")
    return value


def _read_input(name: str, table: Any) -> Input:
    """Return an input of entry.toml."""
    owner = f"input '{name}'"
    if not isinstance(table, Mapping):
        raise InputError(f"{owner} is {quote(table)}: give a table [inputs.{name}]")
    if table.get("kind") not in ORIGINS:
        raise InputError(f"{owner} has kind {quote(table.get('kind'))}: give {', '.join(ORIGINS)}")
    source = _text(table, "source", owner)
    value = table.get("value")
    if isinstance(value, bool | str):
        return Input(value, "", table["kind"], source)
    value = number(owner, "value", value)
    return Input(value, _text(table, "unit", owner), table["kind"], source)


def _read_statistic(table: Mapping[str, Any]) -> Statistic:
    """Return a limit of a series."""
    owner = f"statistic {quote(table.get('name'))}"
    what = _text(table, "what", owner)
    if what not in QUANTITIES:
        raise InputError(f"{owner}: what is '{what}': give one of {', '.join(QUANTITIES)}")
    return Statistic(
        name=_text(table, "name", owner),
        series=_text(table, "series", owner),
        what=what,
        value=number(owner, "wanted", table.get("wanted")),
        limit=number(owner, "limit", table.get("limit"), positive=True),
        reason=_text(table, "reason", owner),
    )


def _read_told(table: Mapping[str, Any]) -> Told:
    """Return what is told and not judged."""
    owner = f"told {quote(table.get('name'))}"
    name, unit, reason = (_text(table, key, owner) for key in ("name", "unit", "reason"))
    return Told(name, unit, reason)


def _read_mutant(table: Mapping[str, Any]) -> Mutant:
    """Return a change that must be noticed."""
    owner = f"mutant {quote(table.get('name'))}"
    name = _text(table, "name", owner)
    change = table.get("change")
    red = table.get("red")
    if not isinstance(change, Mapping) or not change or not isinstance(red, list) or not red:
        raise InputError(f"{owner}: give change, a table of inputs, and red, a list of figures")
    return Mutant(name, change, red)


def _expand_figure(entry: Entry, table: Mapping[str, Any], rows: Sequence[Row]) -> Iterator[Wanted]:
    """Yield what a table [[figure]] wants: one value, or one for each row that it names."""
    owner = f"figure {quote(table.get('name'))}"
    for key in table:
        if key not in _FIGURE:
            raise InputError(f"{owner} has '{key}', which nothing reads: leave it out")
    name = _text(table, "name", owner)
    unit = _text(table, "unit", owner)
    reason = _text(table, "reason", owner)
    known = table.get("known", False)
    if not isinstance(known, bool):
        raise InputError(f"{owner}: known is {quote(known)}: give true or false")
    if ("wanted" in table) == ("column" in table):
        raise InputError(f"{owner}: give wanted, or a column of data.csv, and not both")
    if "wanted" in table:
        value = number(owner, "wanted", table.get("wanted"))
        yield Wanted(name, unit, value, _limit(table, value, owner), reason, known=known)
        return

    column = table["column"]
    if column not in entry.data.units:
        raise InputError(f"{owner}: data.csv has no column {quote(column)}: name one that it has")
    if entry.data.units[column] != unit:
        raise InputError(
            f"{owner} has the unit '{unit}', and column '{column}' of data.csv "
            f"'{entry.data.units[column]}': give both the same"
        )
    for row in rows:
        cell = row[column]
        if isinstance(cell, float) and _matches(row, table.get("where", {})):
            limit = _limit(table, cell, owner)
            yield Wanted(
                fill_in(name, row),
                unit,
                cell,
                limit,
                reason,
                series=table.get("series", ""),
                group=table.get("series", name),
                known=known,
            )


def fill_in(name: str, row: Row) -> str:
    """Return the name of a figure, with the values of a row in the place of {column}."""
    words = {key: f"{cell:g}" if isinstance(cell, float) else cell for key, cell in row.items()}
    return name.format(**words)


def _limit(table: Mapping[str, Any], value: float, owner: str) -> float:
    """Return the largest difference that a value is allowed, in its unit.

    ``floor`` is that of values up to ``up_to``.
    """
    limit = number(owner, "limit", table.get("limit"), positive=True)
    if "floor" in table and abs(value) <= number(owner, "up_to", table.get("up_to"), positive=True):
        return number(owner, "floor", table.get("floor"), positive=True)
    if not table.get("relative", False):
        return limit
    if value == 0.0:
        raise InputError(f"{owner}: a relative limit of zero is none: give an absolute one")
    return limit * abs(value)


def _matches(row: Row, chosen: Mapping[str, Any]) -> bool:
    """Say whether a row is one of those chosen.

    Args:
        row: column -> value.
        chosen: column -> a value, a list of values, or least and most of a range.
    """
    for column, wish in chosen.items():
        if column not in row:
            raise InputError(f"data.csv has no column '{column}', by which rows are chosen")
        value = row[column]
        if isinstance(wish, Mapping):
            least, most = wish.get("least", -math.inf), wish.get("most", math.inf)
            inside = isinstance(value, float) and least <= value <= most
        else:
            inside = value in (wish if isinstance(wish, list) else [wish])
        if not inside:
            return False
    return True


def _refuse_unfit(entry: Entry) -> None:
    """Raise InputError where the parts of an entry do not fit each other."""
    names = set()
    for setting in SETTINGS:
        names |= _names_of(entry, setting)
    for mutant in entry.mutants:
        for name in mutant.change:
            if name not in entry.inputs:
                raise InputError(
                    f"mutant '{mutant.name}' changes '{name}', which is no input: name one of "
                    f"{', '.join(entry.inputs)}"
                )
        for pattern in mutant.red:
            if pattern != RUN and not any(fnmatchcase(name, pattern) for name in names):
                raise InputError(
                    f"mutant '{mutant.name}' turns '{pattern}' red, which is no figure: name one"
                )


def _names_of(entry: Entry, setting: str) -> set[str]:
    """Return the names of all figures and statistics of a setting, each of which occurs once."""
    wanted = entry.list_wanted(setting)
    if not wanted:
        raise InputError(f"nothing is judged at the setting '{setting}': add a [[figure]]")
    names = [one.name for one in wanted] + [one.name for one in entry.statistics]
    names += [one.name for one in entry.told]
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"two figures are called '{name}': give each its own name")
    series = {one.series for one in wanted}
    for statistic in entry.statistics:
        if statistic.series not in series:
            raise InputError(
                f"statistic '{statistic.name}' is of the series '{statistic.series}', which no "
                "figure counts in: name another one"
            )
    return set(names)


def find_records(name: str, records: Mapping[str, str]) -> Path | None:
    """Return the folder of the records of an entry, all of which are there and unchanged.

    Args:
        name: of the entry.
        records: file -> sha256; none are asked for where it is empty.

    Raises:
        Missing: no folder, or one without some of the files.
        InputError: a file that was changed.
    """
    if not records:
        return None
    folder = Path(os.environ.get(RECORDS, ""))
    if not os.environ.get(RECORDS):
        raise Missing(
            f"{name}: its records are not part of the package: set {RECORDS} to their folder"
        )
    for file, checksum in records.items():
        if not (folder / file).is_file():
            raise Missing(f"{name}: {RECORDS} = '{folder}' has no '{file}': put it there")
        if sha256(read_bytes(folder / file)).hexdigest() != checksum:
            raise InputError(f"{name}: the record '{folder / file}' was changed: fetch it again")
    return folder


def load_run(folder: Path) -> ModuleType:
    """Load run.py of an entry.

    Raises:
        InputError: no such file, or one without ``figures`` and ``UNITS``.
    """
    path = folder / "run.py"
    if not path.is_file():
        raise InputError(f"{folder.name}: run.py is missing: write its function figures")
    spec = importlib.util.spec_from_file_location(f"{__name__}_{folder.name}", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    if not callable(getattr(module, "figures", None)) or not hasattr(module, "UNITS"):
        raise InputError(
            f"{folder.name}: run.py needs figures(inputs, fineness) and UNITS, the unit of each "
            "input and column that it reads"
        )
    return module


def refuse_units(entry: Entry) -> None:
    """Raise InputError unless inputs and columns have the units in which run.py takes them."""
    for name, unit in entry.run.UNITS.items():
        if name in entry.inputs:
            given = entry.inputs[name].unit
        elif name in entry.data.units:
            given = entry.data.units[name]
        else:
            raise InputError(f"{entry.name}: input '{name}' is missing: add [inputs.{name}]")
        if given != unit:
            raise InputError(
                f"{entry.name}: '{name}' is given in '{given}', and run.py takes '{unit}': "
                "convert it"
            )
    for name in entry.inputs:
        if name not in entry.run.UNITS:
            raise InputError(f"{entry.name}: run.py does not take the input '{name}': leave it out")
