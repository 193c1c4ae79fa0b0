"""Give a package its public names, each imported when it is first used.

What nobody asks for need not be installed.
"""

import ast
import sys
import warnings
from collections.abc import Callable
from importlib import import_module
from os.path import splitext
from types import ModuleType
from typing import Any

from .renamed import NAMES


def lazy(
    package: str, file: str
) -> tuple[list[str], Callable[[str], Any], Callable[[], list[str]]]:
    """Return ``__all__``, ``__getattr__``, ``__dir__`` of a package (PEP 562).

    The stub beside its ``__init__.py`` says what they are.

    A line ``from .module import Name as Name`` of ``__init__.pyi`` is a public name and its module,
    here and for checkers of types (Scientific Python, SPEC 1); ``from .room import *`` imports a
    room and hands on all its names; ``from .practice import soil as soil`` hands on a room.
    """
    home: dict[str, str] = {}
    # importing pathlib takes longer than all stubs
    with open(splitext(file)[0] + ".pyi", encoding="utf-8") as stub:
        listed = ast.parse(stub.read()).body
    for node in listed:
        if isinstance(node, ast.ImportFrom):
            # each dot after the first leads out of a package
            base = package.split(".")[: 1 - node.level or None]
            module = ".".join([*base, str(node.module)])
            for one in node.names:
                home.update(
                    dict.fromkeys(
                        import_module(module).__all__ if one.name == "*" else [one.name], module
                    )
                )
    public = sorted(home)

    def get(name: str) -> Any:
        if name not in home:
            renamed = _renamed(package, name)
            if renamed is None:
                raise AttributeError(f"module '{package}' has no attribute '{name}'")
            return renamed
        module = import_module(home[name])
        if not hasattr(module, name):
            return import_module(f"{home[name]}.{name}")  # a room that is handed on
        return getattr(module, name)

    class Room(ModuleType):
        """Keep names when Python binds a module of the same name.

        So ``run.simulate`` stays the function.
        """

        def __setattr__(self, name: str, value: Any) -> None:
            if name not in home or not isinstance(value, ModuleType):
                super().__setattr__(name, value)

    sys.modules[package].__class__ = Room
    return public, get, lambda: public


def _renamed(package: str, name: str) -> Any:
    """Return what an old public name of a package is called now, with a warning.

    It is None for a name that never was.
    """
    path = NAMES.get(package, {}).get(name)
    if path is None:
        return None
    warnings.warn(
        f"'{package}.{name}' is now {path}: use that name", DeprecationWarning, stacklevel=3
    )
    module, _, now = path.rpartition(".")
    return getattr(import_module(module), now)
