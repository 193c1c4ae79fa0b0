"""Read and run case files whose table has a runner of its own: [beam], [layer]; [mesh] and [model] are in ``case``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Protocol

from ...core.algebra import Comm, SerialComm
from ...core.errors import InputError
from ...core.files import on_root
from ...run.files.folder import run_folder
from .beam_study import BeamStudy
from .case import Case, check_format, read_case
from .layer_study import LayerStudy
from .library import COPY, base_folder, keep_copy, read_copy
from .parsing import arguments
from .table_calls import Call, Spot, callee
from .toml_file import read_toml, with_settings
from .vocabulary import words

STUDIES = {"beam": callee(BeamStudy), "layer": callee(LayerStudy)}


class Study(Protocol):
    """What such a table makes."""

    def run(self, folder: Path) -> str:
        """Write what is found into the folder; return it as text."""
        ...

    def draw(self, folder: Path) -> list[Path]:
        """Draw the pictures of a run from its folder; return their files."""
        ...


@dataclass(frozen=True)
class OwnCase:
    """A case file of one of STUDIES, read and checked; ``path``, ``tables``, ``settings`` as those of ``Case``."""

    path: Path
    tables: Mapping[str, Any]
    settings: tuple[str, ...]
    node: Call = field(repr=False)

    def study(self) -> Study:
        """Return what its table makes; InputError for values out of range."""
        made: Study = self.node.build({})
        return made

    def run(self, comm: Comm, out: str | Path) -> str:
        """Run it on rank 0, whatever the number of ranks; return what it found, as text. Collective."""
        return on_root(comm, lambda: self._alone(Path(out))) or ""

    def _alone(self, out: Path) -> str:
        study = self.study()
        folder = run_folder(SerialComm(), out)
        keep_copy(self.path, self.settings, folder, SerialComm())
        return study.run(folder)


def open_case(path: str | Path, settings: Sequence[str] = (), allow: Sequence[str] = ()) -> Case | OwnCase:
    """Return the case of a file, whatever its tables; arguments and InputError as of ``read_case``."""
    path = Path(path)
    tables = with_settings(read_toml(path), settings)
    own = [name for name in tables if name in STUDIES]
    return _own(path, tables, settings) if own else read_case(path, settings, allow=allow)


def drawn_study(folder: Path) -> list[Path] | None:
    """Draw the pictures of the folder of one of STUDIES; None for the folder of another run."""
    tables = read_copy(folder)
    if not any(name in STUDIES for name in tables):
        return None
    return _own(folder / COPY, tables, ()).study().draw(folder)


def _own(path: Path, tables: Mapping[str, Any], settings: Sequence[str]) -> OwnCase:
    check_format(path, tables)
    name = next(one for one in tables if one in STUDIES)
    others = [one for one in tables if one not in ("format", "title", name)]
    if others:
        raise InputError(f"{path}: [{others[0]}] does not go with [{name}], which is a case of its own: leave it out")
    table = tables[name]
    if not isinstance(table, dict):
        raise InputError(f"{path}: [{name}] is no table: give its keys below it")
    node = arguments(table, STUDIES[name], Spot(str(path), "", name), words(base_folder(path)))
    return OwnCase(path, tables, tuple(settings), node)
