"""The runs of an incremental dynamic analysis: one case, its motions replaced and scaled."""

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
from ..cases.toml_file import toml_value

Row = dict[str, Any]
ROW = "row.json"
SAID = "failure.txt"


@dataclass(frozen=True)
class Shaking:
    """Name the record files of one run.

    There is one for each ground motion of the case, as "h" of (h.at2, v.at2).
    """

    name: str
    files: tuple[Path, ...]

    def settings(self, case: Case, factor: float = 1.0) -> tuple[str, ...]:
        """Return KEY=VALUE that put these records into the case.

        Its own scales are multiplied by the factor.
        """
        found = []
        for (place, table), path in zip(ground_motions(case), self.files, strict=True):
            record = table.get("record")
            key = (
                f"{place}.record.path"
                if isinstance(record, dict) and "path" in record
                else f"{place}.record"
            )
            found += [
                f"{key}={toml_value(str(path))}",
                f"{place}.scale={float(table.get('scale', 1.0)) * factor!r}",
            ]
        return tuple(found)

    def record(self, case: Case) -> Record:
        """Return the first motion as the case prepares it.

        The factor is 1; it raises InputError when a file is wrong.
        """
        return _record(case.path, (*case.settings, *self.settings(case)), case.allowed)


@cache
def _record(path: Path, settings: tuple[str, ...], allowed: tuple[str, ...]) -> Record:
    motion = read_case(path, settings, allow=allowed).excitations()[0]
    assert isinstance(motion, GroundMotion)
    return scaled(motion.record, factor=motion.scale)


def ground_motions(case: Case) -> list[tuple[str, Mapping[str, Any]]]:
    """Return (key, table) of the ground motions of a case.

    It raises InputError unless it is shaken by records alone.
    """
    refuse_own(case.tables, "excitation", f"{case.path}: ida")
    tables = case.tables.get("excitation", [])
    found: list[tuple[str, Mapping[str, Any]]] = [("excitation", tables)]
    if not isinstance(tables, dict):
        found = [(f"excitation.{number}", table) for number, table in enumerate(tables, start=1)]
    for place, table in found:
        if table.get("type") != "GroundMotion":
            raise InputError(
                f"{case.path}: [{place}] has no record that others can replace: make it a "
                "GroundMotion with a record file"
            )
    if not found:
        raise InputError(
            f"{case.path}: no [[excitation]] has a record to replace: give a GroundMotion"
        )
    return found


@check_arguments
def record_set(word: str) -> list[list[str]]:
    """Return the files of each record of a text.

    It is "H", "H,V", a folder (its AT2 files, if it has any, else all) or "@LIST". A LIST is a file
    with "H" or "H,V" in each line, relative to its folder. InputError for others.
    """
    folder, names, path = Path(), [word], Path(word.removeprefix("@"))
    try:
        if word.startswith("@"):
            folder, lines = path.parent, path.read_text(encoding="utf-8").splitlines()
            names = [one for line in lines if (one := line.partition("#")[0].strip())]
        elif path.is_dir():
            every = sorted(
                str(one) for one in path.iterdir() if one.is_file() and not one.name.startswith(".")
            )
            names = [one for one in every if one.lower().endswith(".at2")] or every
    except (OSError, ValueError) as error:
        raise InputError(
            f"--motions {word} cannot be read ({error}): give a text file, one record in a line"
        ) from None
    found = [[name.strip() for name in one.split(",")] for one in names]
    if not found or not all(map(all, found)):
        raise InputError(
            f"--motions {word}: give FILE or FILE,FILE, a folder, or @LIST with one record in a "
            "line"
        )
    return [[str(folder / name) for name in files] for files in found]


def shakings(case: Case, motions: Sequence[str | Path | Sequence[str | Path]]) -> list[Shaking]:
    """Return the records by name.

    A motion is a file, or one file for each ground motion of the case.
    """
    count = len(ground_motions(case))
    found: dict[str, Shaking] = {}
    for motion in motions:
        files = tuple(
            Path(one).resolve() for one in ([motion] if isinstance(motion, str | Path) else motion)
        )
        if len(files) != count:
            names = ", ".join(one.name for one in files)
            raise InputError(
                f"{names}: the case has {count} ground motion{'s' * (count > 1)}: give as many "
                "files"
            )
        name = files[0].stem
        if name in found:
            raise InputError(
                f"two motions are called '{name}': rename a file, as their runs need different "
                "names"
            )
        found[name] = Shaking(name, files)
    if not found:
        raise InputError("motions is empty: give at least one record file")
    return list(found.values())


@dataclass(frozen=True)
class OneRun:
    """Run one record at one scale, in its folder. ``wrong``: why it cannot run at all."""

    case: Case
    shaking: Shaking
    factor: float
    folder: Path
    wrong: str = ""

    def done(self) -> Row | None:
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
        asked = "fields" not in self.case.tables or any(
            one.startswith("fields") for one in self.case.settings
        )
        return (
            *self.case.settings,
            *self.shaking.settings(self.case, self.factor),
            *(() if asked else ("fields=",)),
        )

    def keep(self, said: str, code: int) -> Row:
        """Write the row of a run that ended with this status.

        It has said this; failed ones leave that in a file.
        """
        facts = read_json(self.folder / SUMMARY) or {}
        finished = code == 0 and facts.get("status") == "finished"
        row = {
            "record": self.shaking.name,
            "files": [str(path) for path in self.shaking.files],
            "scale": self.factor,
            "status": "finished" if finished else "failed",
            "reason": "" if finished else _sentence(said, code),
            "certificate": facts.get("worst_certificate"),
            "energy_created": facts.get("energy_created"),
            "steps": facts.get("steps"),
        }
        make_inner_folder(self.folder.parents[1], self.folder.parent.name, self.folder.name)
        if not finished:
            write_atomically(self.folder / SAID, said.encode())
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
    files, scale = row.get("files"), row.get("scale")
    whole = all(isinstance(row.get(name), str) for name in ("record", "status", "reason"))
    numbers = scale is None or (isinstance(scale, int | float) and not isinstance(scale, bool))
    return (
        row
        if whole and numbers and isinstance(files, list) and all(isinstance(f, str) for f in files)
        else None
    )


def _sentence(said: str, code: int) -> str:
    """Why a run ended: its own sentence, else its last words, else how it was stopped."""
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    own = [line.removeprefix("vi-contact: ") for line in lines if line.startswith("vi-contact: ")]
    if own:
        return own[-1]
    if code < 0:
        return f"ended by {signal.Signals(-code).name}"
    return lines[-1] if lines else f"ended with status {code}"
