"""Let rooms that have moved be imported by their old path, with a warning.

``from vi_contact.soil import FreeField`` was the path up to version 0.2, and gives the same objects
as ``from vi_contact.practice.soil import FreeField``. A path stays here for the versions that
docs/reference/releases.md promises.
"""

import sys
import warnings
from collections.abc import Sequence
from importlib import import_module
from importlib.abc import Loader, MetaPathFinder
from importlib.machinery import ModuleSpec
from types import ModuleType

# Old path of a room -> new path.
MOVED = {
    f"vi_contact.{room}": f"vi_contact.practice.{room}"
    for room in ("cli", "engineering", "ground_motion", "plots", "soil", "studies")
}


class OldPaths(MetaPathFinder, Loader):
    """Find modules by their old paths, and give the modules themselves, not copies."""

    def __init__(self) -> None:
        # Specs of modules at their new paths, by the old path, while an import goes on.
        self._specs: dict[str, ModuleSpec | None] = {}

    def find_spec(
        self, fullname: str, path: Sequence[str] | None = None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        """Return where to find a module by its old path; None for any other path.

        Args:
            fullname: dotted path that is imported.
            path: where to look for submodules; not read, as the new path says it.
            target: a module that is loaded anew; not read.
        """
        return None if _new_path(fullname) is None else ModuleSpec(fullname, self)

    def create_module(self, spec: ModuleSpec) -> ModuleType:
        """Return the module at the new path."""
        new = str(_new_path(spec.name))
        warnings.warn(f"{spec.name} is now {new}: import that", DeprecationWarning, stacklevel=2)
        module = import_module(new)
        self._specs[spec.name] = module.__spec__
        return module

    def exec_module(self, module: ModuleType) -> None:
        """Give the module the spec back that the import of the old path has replaced."""
        module.__spec__ = self._specs.pop(str(module.__spec__ and module.__spec__.name))


def _new_path(path: str) -> str | None:
    """Return the new path of a module; None where it has not moved."""
    for old, new in MOVED.items():
        if path == old or path.startswith(f"{old}."):
            return new + path.removeprefix(old)
    return None


def accept_old_paths() -> None:
    """Let old paths be imported from now on in this process."""
    if not any(isinstance(finder, OldPaths) for finder in sys.meta_path):
        # before the finder that looks into folders, which would load the files anew
        sys.meta_path.insert(0, OldPaths())
