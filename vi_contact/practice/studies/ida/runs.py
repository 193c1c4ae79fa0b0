"""Make the runs of an incremental dynamic analysis: one case, its motions replaced and scaled."""

import signal
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

from ....core.arguments import check_arguments
from ....core.errors import InputError
from ....core.files import to_json, write_atomically
from ....core.own_files import inner_folder, make_inner_folder
from ....run.files.folder import SUMMARY
from ....run.files.reading import read_object
from ...ground_motion.excitation import GroundMotion
from ...ground_motion.processing import scaled
from ...ground_motion.record import Record
from ..cases.case import Case, read_case
from ..cases.stage_tables import refuse_own
from ..cases.toml_file import format_value
from .selection import Selected, read_selection

Row = dict[str, Any]  # of ida.csv, by column
ROW = "row.json"  # in the folder of a run that has ended
SAID = "failure.txt"  # all that a failed run has printed


@dataclass(frozen=True)
class Shaking:
    """Name the record files of one run.

    Attributes:
        name: of the record, as "h" of (h.at2, v.at2).
        files: one for each ground motion of the case.
        factor: of its own, on all of them, as a selection gives it.
    """

    name: str
    files: tuple[Path, ...]
    factor: float = 1.0

    def settings(self, case: Case, factor: float = 1.0) -> tuple[str, ...]:
        """Return KEY=VALUE that put these records into the case.

        Its own scales are multiplied by the factor, and by that of the record.
        """
        settings = []
        for (place, table), path in zip(gather_ground_motions(case), self.files, strict=True):
            record = table.get("record")
            has_keys = isinstance(record, dict) and "path" in record
            key = f"{place}.record.path" if has_keys else f"{place}.record"
            scale = float(table.get("scale", 1.0)) * factor * self.factor
            settings += [f"{key}={format_value(str(path))}", f"{place}.scale={scale!r}"]
        return tuple(settings)

    def record(self, case: Case) -> Record:
        """Return the first motion as the case prepares it, with the record's own factor.

        Raises:
            InputError: when a file is wrong.
        """
        return _read_record(case.path, (*case.settings, *self.settings(case)), case.allowed)


@cache
def _read_record(path: Path, settings: tuple[str, ...], allowed: tuple[str, ...]) -> Record:
    """Return the first motion of a case with its scale; each is read once."""
    motion = read_case(path, settings, allow=allowed).excitations()[0]
    assert isinstance(motion, GroundMotion)
    return scaled(motion.record, factor=motion.scale)


def gather_ground_motions(case: Case) -> list[tuple[str, Mapping[str, Any]]]:
    """Return (key, table) of the ground motions of a case.

    Raises:
        InputError: unless it is shaken by records alone.
    """
    refuse_own(case.tables, "excitation", f"{case.path}: ida")
    tables = case.tables.get("excitation", [])
    if isinstance(tables, dict):
        motions: list[tuple[str, Mapping[str, Any]]] = [("excitation", tables)]
    else:
        motions = [(f"excitation.{number}", table) for number, table in enumerate(tables, start=1)]
    for place, table in motions:
        if table.get("type") != "GroundMotion":
            raise InputError(
                f"{case.path}: [{place}] has no record that others can replace: make it a "
                "GroundMotion with a record file"
            )
    if not motions:
        raise InputError(
            f"{case.path}: no [[excitation]] has a record to replace: give a GroundMotion"
        )
    return motions


@check_arguments
def record_set(word: str) -> list[list[str] | Selected]:
    """Return the files of each record of a text.

    Args:
        word: "H", "H,V", a folder (its AT2 files, if it has any, else all) or "@LIST". A LIST is a
            file with "H" or "H,V" in each line, relative to its folder. One whose name ends in
            ".csv" is a selection with a header (``read_selection``), and has factors too.

    Raises:
        InputError: for other texts, and a folder or LIST that cannot be read.
    """
    folder = Path()
    path = Path(word.removeprefix("@"))
    if word.startswith("@") and path.suffix.lower() == ".csv":
        return [*read_selection(path)]
    try:
        if word.startswith("@"):
            folder = path.parent
            texts = _read_list(path)
        elif path.is_dir():
            texts = _list_records(path)
        else:
            texts = [word]
    except (OSError, ValueError) as error:
        raise InputError(
            f"--motions {word} cannot be read ({error}): give a text file, one record in a line"
        ) from None
    records = [_split_names(text) for text in texts]
    if not records or not all(map(all, records)):
        raise InputError(
            f"--motions {word}: give FILE or FILE,FILE, a folder, or @LIST with one record in a "
            "line"
        )
    return [_join_folder(folder, names) for names in records]


def _read_list(path: Path) -> list[str]:
    """Return the lines of a LIST, without comments and empty ones."""
    lines = path.read_text(encoding="utf-8").splitlines()
    texts = [line.partition("#")[0].strip() for line in lines]
    return [text for text in texts if text]


def _list_records(folder: Path) -> list[str]:
    """Return the AT2 files of a folder, if it has any, else all but hidden ones."""
    files = [path for path in folder.iterdir() if path.is_file() and not path.name.startswith(".")]
    every = sorted(str(path) for path in files)
    return [name for name in every if name.lower().endswith(".at2")] or every


def _split_names(text: str) -> list[str]:
    """Return the names in "H,V"."""
    return [name.strip() for name in text.split(",")]


def _join_folder(folder: Path, names: list[str]) -> list[str]:
    """Return the paths of names that are relative to a folder."""
    return [str(folder / name) for name in names]


def gather_shakings(
    case: Case, motions: Sequence[str | Path | Sequence[str | Path] | Selected]
) -> list[Shaking]:
    """Return the records by name.

    A motion is a file, or one file for each ground motion of the case; of a selected record the
    first ones are taken.
    """
    count = len(gather_ground_motions(case))
    by_name: dict[str, Shaking] = {}
    for motion in motions:
        factor = 1.0
        paths: Sequence[str | Path]
        if isinstance(motion, Selected):
            paths = motion.files[:count]
            factor = motion.factor
        else:
            paths = [motion] if isinstance(motion, str | Path) else motion
        files = tuple(Path(path).resolve() for path in paths)
        if len(files) != count:
            names = ", ".join(file.name for file in files)
            plural = "s" if count > 1 else ""
            raise InputError(
                f"{names}: the case has {count} ground motion{plural}: give as many files"
            )
        name = files[0].stem
        if name in by_name:
            raise InputError(
                f"two motions are called '{name}': rename a file, as their runs need different "
                "names"
            )
        by_name[name] = Shaking(name, files, factor)
    if not by_name:
        raise InputError("motions is empty: give at least one record file")
    return list(by_name.values())


@dataclass(frozen=True)
class OneRun:
    """Say what one run is: one record at one scale, in its folder.

    Attributes:
        case: whose motions are replaced.
        shaking: the record.
        factor: on its motions; NaN where it cannot be found.
        folder: of the run.
        wrong: why it cannot run at all; "" where it can.
    """

    case: Case
    shaking: Shaking
    factor: float
    folder: Path
    wrong: str = ""

    def read_finished(self) -> Row | None:
        """Return the row of a run that has finished, or None."""
        inner_folder(self.folder.parents[1], self.folder.parent.name, self.folder.name)
        row = read_row(self.folder / ROW)
        if row is None and (read_json(self.folder / SUMMARY) or {}).get("status") == "finished":
            row = self.keep("", 0)  # it outlived the process that had started it
        return row if row is not None and row["status"] == "finished" else None

    @property
    def settings(self) -> tuple[str, ...]:
        """Return all KEY=VALUE that make the run of the case file.

        It writes fields only if the study sets them.
        """
        settings = (*self.case.settings, *self.shaking.settings(self.case, self.factor))
        set_by_study = any(setting.startswith("fields") for setting in self.case.settings)
        if "fields" in self.case.tables and not set_by_study:
            settings = (*settings, "fields=")
        return settings

    def keep(self, printed: str, code: int) -> Row:
        """Write the row of a run that has ended, and return it.

        Args:
            printed: by the run; a failed one leaves it in a file.
            code: status of its process.
        """
        facts = read_json(self.folder / SUMMARY) or {}
        finished = code == 0 and facts.get("status") == "finished"
        row = {
            "record": self.shaking.name,
            "files": [str(path) for path in self.shaking.files],
            "scale": self.factor * self.shaking.factor,
            "status": "finished" if finished else "failed",
            "reason": "" if finished else _find_reason(printed, code),
            "certificate": facts.get("worst_certificate"),
            "energy_created": facts.get("energy_created"),
            "steps": facts.get("steps"),
        }
        make_inner_folder(self.folder.parents[1], self.folder.parent.name, self.folder.name)
        if not finished:
            write_atomically(self.folder / SAID, printed.encode())
        write_atomically(self.folder / ROW, to_json(row).encode())
        return row


def read_json(path: Path) -> dict[str, Any] | None:
    """Return a whole JSON object, or None when there is none."""
    try:
        return read_object(path)
    except (OSError, ValueError):
        return None


def read_row(path: Path) -> dict[str, Any] | None:
    """Return the row of a run.

    It is None when there is none, or the file is not as ``OneRun.keep`` leaves it.
    """
    row = read_json(path) or {}
    files = row.get("files")
    scale = row.get("scale")
    has_texts = all(isinstance(row.get(name), str) for name in ("record", "status", "reason"))
    is_number = isinstance(scale, int | float) and not isinstance(scale, bool)
    has_files = isinstance(files, list) and all(isinstance(file, str) for file in files)
    if has_texts and has_files and (is_number or scale is None):
        return row
    return None


def _find_reason(printed: str, code: int) -> str:
    """Return why a run ended: its own sentence, else its last words, else how it was stopped."""
    lines = [line.strip() for line in printed.splitlines() if line.strip()]
    own = [line.removeprefix("vi-contact: ") for line in lines if line.startswith("vi-contact: ")]
    if own:
        return own[-1]
    if code < 0:
        return f"ended by {signal.Signals(-code).name}"
    return lines[-1] if lines else f"ended with status {code}"
