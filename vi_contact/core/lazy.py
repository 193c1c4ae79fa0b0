"""Give a package its public names, each imported when it is first used: what nobody asks for need not be installed."""

import sys
from collections.abc import Callable, Mapping, Sequence
from importlib import import_module
from types import ModuleType
from typing import Any


def lazy(package: str,
         contents: Mapping[str, Sequence[str]]) -> tuple[list[str], Callable[[str], Any], Callable[[], list[str]]]:
    """Return ``__all__``, ``__getattr__``, ``__dir__`` of a package (PEP 562): module -> names."""
    home = {name: module for module, names in contents.items() for name in names}
    public = sorted(home)

    def get(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        return getattr(import_module(f"{package}.{home[name]}"), name)

    class Room(ModuleType):
        """Keep names when Python binds a module of the same name: ``run.simulate`` stays the function."""

        def __setattr__(self, name: str, value: Any) -> None:
            if name not in home or not isinstance(value, ModuleType):
                super().__setattr__(name, value)

    sys.modules[package].__class__ = Room
    return public, get, lambda: public
