"""Find the case files that ship with the package.

Keep in a run folder the copy of the case that made it.
"""

import re
from collections.abc import Mapping, Sequence
from hashlib import sha256
from itertools import dropwhile
from pathlib import Path
from typing import Any

from ....core.algebra import Comm, SerialComm
from ....core.checks import quote
from ....core.errors import InputError
from ....core.files import on_root, write_atomically
from ....core.own_files import is_own, read_bytes
from ....run.files.folder import COPY
from .parsing import suggest_nearest
from .toml_file import read_toml, with_settings

FOLDER = Path(__file__).parent / "builtin"
STARTERS = Path(__file__).parents[1] / "starters"  # cases to begin with: copied, and then changed
FORMAT = 1  # of case files
_SET = "# set "  # before a setting, in the copy
_FROM = "# its paths are relative to "  # before a folder, in the copy


def list_builtin_cases() -> dict[str, str]:
    """Return the names and titles of the case files that ship with the package."""
    return {path.stem: str(read_toml(path)["title"]) for path in sorted(FOLDER.glob("*.toml"))}


def list_starters() -> list[str]:
    """Return the names of the cases to begin with."""
    return sorted(path.stem for path in STARTERS.glob("*.toml"))


def copy_starter(name: str, folder: Path) -> list[Path]:
    """Copy the files of a case to begin with into a folder, and return them.

    The folder is made if need be.

    Raises:
        InputError: for a name that nobody knows, and for files that exist already: they may have
            been changed.
    """
    if name not in list_starters():
        raise InputError(
            f"there is no starter case {quote(name)}: {suggest_nearest(name, list_starters())}"
        )
    files = sorted(STARTERS.glob(f"{name}.*"), reverse=True)  # the case file before its mesh
    copies = {folder / file.name: file.read_bytes() for file in files}
    for path in copies:
        if path.exists():
            raise InputError(f"'{path}' exists already: give another folder, or move the file")

    def copy() -> None:
        folder.mkdir(parents=True, exist_ok=True)
        for path, data in copies.items():
            write_atomically(path, data)

    on_root(SerialComm(), copy)
    return list(copies)


def locate(case: str) -> Path:
    """Return the file of a case.

    What ends in ".toml" is a file, all else the name of one that ships.
    """
    if case.endswith(".toml"):
        return Path(case)
    if case not in list_builtin_cases():
        nearest = suggest_nearest(case, list_builtin_cases())
        raise InputError(
            f"there is no built-in case {quote(case)}: {nearest}; a file ends in .toml"
        )
    return FOLDER / f"{case}.toml"


def check_format(path: Path, tables: Mapping[str, Any]) -> None:
    """Raise InputError for the format of another version."""
    number = tables.get("format", FORMAT)
    if number != FORMAT or isinstance(number, bool):
        raise InputError(
            f"{path}: format is {quote(number)}, and this version of vi_contact reads format "
            f"{FORMAT}: use the version that it was written for, or correct the number"
        )


def find_base_folder(path: Path) -> Path:
    """Return the folder to which relative paths of a case belong.

    This is the folder of the case file. A copy in a run folder notes that of the case from which it
    was made; for the cases that ship it is the working folder.
    """
    if path.name == COPY:
        notes = _find_notes(path.read_bytes(), _FROM)
        if notes:
            return Path(notes[0])
    return Path() if path.parent == FOLDER else path.parent


def _find_notes(data: bytes, mark: str) -> list[str]:
    """Return what follows a mark at the beginnings of lines."""
    lines = data.decode("utf-8", "surrogateescape").splitlines()
    return [line.removeprefix(mark) for line in lines if line.startswith(mark)]


def keep_copy(path: Path, settings: Sequence[str], folder: Path, comm: Comm) -> None:
    """Write a copy of the case file into the run folder, with the settings as comments.

    Collective.

    Args:
        path: of the case file.
        settings: the KEY=VALUE made after reading it.
        folder: of the run.
        comm: the ranks of the run.
    """
    notes = "".join(f"{_SET}{' '.join(setting.split(chr(10)))}\n" for setting in settings)
    notes += f"{_FROM}{find_base_folder(path).resolve()}\n"

    def copy() -> None:
        # The file may itself be the copy in another run folder: its notes are of that run.
        text = re.sub(rb"(?m)^# (set|its paths) ", rb"# once \1 ", path.read_bytes())
        if not _is_the_copy(path, folder):
            write_atomically(folder / COPY, notes.encode() + text)

    on_root(comm, copy)


def refuse_case_of_others(path: Path, folder: Path) -> None:
    """Raise InputError for a case file in a run folder.

    No run has written it, and this run would replace it.
    """
    if (
        is_own(folder / COPY)
        and not _is_the_copy(path, folder)
        and not _find_notes(read_bytes(folder / COPY), _FROM)
    ):
        raise InputError(
            f"'{folder / COPY}' is not the copy of a case that a run has made, and this run would "
            "replace it: choose another output folder, or move the file"
        )


def _is_the_copy(path: Path, folder: Path) -> bool:
    """Tell whether a case file is the one in the run folder."""
    return (folder / COPY).exists() and path.exists() and path.samefile(folder / COPY)


def read_copy(folder: Path) -> dict[str, Any]:
    """Return the tables of the case that made a run folder.

    Settings are included; it is empty where no case file made the folder.
    """
    path = folder / COPY
    if not is_own(path):
        return {}
    return with_settings(read_toml(path), read_settings(folder))


def compute_checksum(folder: Path) -> str:
    """Return the SHA-256 of the case that made a run folder, without the notes of its copy.

    It is that of the case file itself; "" where no case file made the folder.
    """
    path = folder / COPY
    if not is_own(path):
        return ""
    lines = read_bytes(path).splitlines(keepends=True)
    marks = (_SET.encode(), _FROM.encode())
    kept = dropwhile(lambda line: line.startswith(marks), lines)
    return sha256(b"".join(kept)).hexdigest()


def read_settings(folder: Path) -> list[str]:
    """Return the settings KEY=VALUE that were made when the case of a run folder ran."""
    return _find_notes(read_bytes(folder / COPY), _SET)
