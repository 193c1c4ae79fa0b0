"""Read and run case files whose table has a runner of its own: [beam], [layer]; [mesh] and [model] are in ``case``."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ...core.algebra import Comm, SerialComm
from ...core.errors import InputError
from ...core.files import on_root
from ...run.files.folder import locked, run_folder
from .library import base_folder, check_format, keep_copy
from .parsing import Words, arguments
from .table_calls import Spot, callee
from .toml_file import read_toml, with_settings

if TYPE_CHECKING:
    from .beam_study import BeamStudy
    from .case import Case
    from .layer_study import LayerStudy

STUDIES = ("beam", "layer")


@dataclass(frozen=True)
class OwnCase:
    """Hold a case file of one of STUDIES, read and checked; ``path``, ``tables``, ``settings`` as in ``Case``."""

    path: Path
    tables: Mapping[str, Any]
    settings: Sequence[str]
    study: "BeamStudy | LayerStudy" = field(repr=False)

    def run(self, comm: Comm, out: str | Path) -> str:
        """Run it on rank 0, whatever the number of ranks; return what it found, as text. Collective."""

        def alone() -> str:
            folder = run_folder(SerialComm(), out)
            with locked(SerialComm(), folder):
                found = self.study.run(folder)
                keep_copy(self.path, self.settings, folder, SerialComm())
            return found

        return on_root(comm, alone) or ""


def open_case(path: str | Path, settings: Sequence[str] = (), allow: Sequence[str] = ()) -> "Case | OwnCase":
    """Return the case of a file, whatever its tables; arguments and InputError as of ``read_case``."""
    path = Path(path)
    tables = with_settings(read_toml(path), settings)
    if any(name in STUDIES for name in tables):
        return OwnCase(path, tables, settings, study_of(path, tables))
    from .case import read_case  # late: the others need no finite elements

    return read_case(path, settings, allow=allow)


def study_of(path: Path, tables: Mapping[str, Any]) -> "BeamStudy | LayerStudy":
    """Return what the tables of a case of its own make; InputError for other tables and values out of range."""
    from .beam_study import BeamStudy  # late: [mesh] and [model] need neither
    from .layer_study import LayerStudy

    check_format(path, tables)
    name = next(one for one in tables if one in STUDIES)
    others = [one for one in tables if one not in ("format", "title", name)]
    if others:
        raise InputError(f"{path}: [{others[0]}] does not go with [{name}], which is a case of its own: leave it out")
    table = tables[name]
    if not isinstance(table, dict):
        raise InputError(f"{path}: [{name}] is no table: give its keys below it")
    call = callee(BeamStudy if name == "beam" else LayerStudy)
    node = arguments(table, call, Spot(str(path), "", name), Words(base_folder(path), {}, {}, (), {}))
    study: BeamStudy | LayerStudy = node.build({})
    return study
