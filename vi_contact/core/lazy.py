"""Give a package its public names, each imported when it is first used, and none before."""

import ast
import sys
import warnings
from collections.abc import Callable
from importlib import import_module
from os.path import splitext
from types import ModuleType
from typing import Any

from .packages import explain_no_dolfinx
from .renamed import NAMES


def lazy(
    package: str, file: str
) -> tuple[list[str], Callable[[str], Any], Callable[[], list[str]]]:
    """Return ``__all__``, ``__getattr__``, ``__dir__`` of a package (PEP 562), from its stub.

    A line ``from .module import Name as Name`` of the ``__init__.pyi`` beside its ``__init__.py``
    is a public name and its module, here and for checkers of types (Scientific Python, SPEC 1);
    ``from .room import *`` imports a room and hands on all its names, and
    ``from .practice import soil as soil`` hands on a room.
    """
    home: dict[str, str] = {}  # name -> module that has it
    # Importing pathlib would take longer than reading all stubs.
    with open(splitext(file)[0] + ".pyi", encoding="utf-8") as stub:
        statements = ast.parse(stub.read()).body
    for statement in statements:
        if isinstance(statement, ast.ImportFrom):
            # Each dot after the first leads out of a package.
            base = package.split(".")[: 1 - statement.level or None]
            module = ".".join([*base, str(statement.module)])
            for alias in statement.names:
                names = import_module(module).__all__ if alias.name == "*" else [alias.name]
                home.update(dict.fromkeys(names, module))
    public = sorted(home)

    def get(name: str) -> Any:
        if name in home:
            module = _import_home(package, name, home[name])
            if not hasattr(module, name):
                return import_module(f"{home[name]}.{name}")  # a room that is handed on
            return getattr(module, name)
        value = _get_renamed(package, name)
        if value is None:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        return value

    class Room(ModuleType):
        """Keep names when Python binds a module of the same name: run.simulate is the function."""

        def __setattr__(self, name: str, value: Any) -> None:
            if name not in home or not isinstance(value, ModuleType):
                super().__setattr__(name, value)

    sys.modules[package].__class__ = Room
    return public, get, lambda: public


def _import_home(package: str, name: str, home: str) -> ModuleType:
    """Import the module that has a name of a package.

    Raises:
        ModuleNotFoundError: a library is missing; where it comes with DOLFINx, it says how.
    """
    try:
        return import_module(home)
    except ModuleNotFoundError as error:
        sentence = explain_no_dolfinx(f"{package}.{name}", error.name)
        if sentence is None:
            raise
        raise ModuleNotFoundError(sentence, name=error.name) from error


def _get_renamed(package: str, name: str) -> Any:
    """Return the thing that had a public name of a package before, with a warning.

    Returns None for a name that never was.
    """
    path = NAMES.get(package, {}).get(name)
    if path is None:
        return None
    warnings.warn(
        f"'{package}.{name}' is now {path}: use that name", DeprecationWarning, stacklevel=3
    )
    module, _, now = path.rpartition(".")
    return getattr(import_module(module), now)
