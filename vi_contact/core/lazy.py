"""Give a package its public names, each imported when it is first used: what nobody asks for need not be installed."""

import ast
import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module
from os.path import dirname, splitext
from types import ModuleType
from typing import Any


def lazy(package: str, file: str) -> tuple[list[str], Callable[[str], Any], Callable[[], list[str]]]:
    """Return ``__all__``, ``__getattr__``, ``__dir__`` of a package (PEP 562) by the stub beside its ``__init__.py``.

    A line ``from .module import Name as Name`` of ``__init__.pyi`` is a public name and its module, here and for
    checkers of types (Scientific Python, SPEC 1); ``from .room import *`` imports a room and hands on all its names."""
    home: dict[str, str] = {}
    with open(splitext(file)[0] + ".pyi", encoding="utf-8") as stub:  # importing pathlib takes longer than all stubs
        listed = ast.parse(stub.read()).body
    for node in listed:
        if isinstance(node, ast.ImportFrom):
            module = f"{package}.{node.module}"
            for one in node.names:
                home.update(dict.fromkeys(import_module(module).__all__ if one.name == "*" else [one.name], module))
    public = sorted(home)

    def get(name: str) -> Any:
        if name not in home:
            raise AttributeError(f"module '{package}' has no attribute '{name}'{since(package, name)}")
        return getattr(import_module(home[name]), name)

    class Room(ModuleType):
        """Keep names when Python binds a module of the same name: ``run.simulate`` stays the function."""

        def __setattr__(self, name: str, value: Any) -> None:
            if name not in home or not isinstance(value, ModuleType):
                super().__setattr__(name, value)

    sys.modules[package].__class__ = Room
    return public, get, lambda: public


def since(package: str, name: str) -> str:
    """Return the end of a sentence about a name of version 0.1 that is another one now; empty for all else."""
    now = retired().get(package, {}).get(name)
    return f": since 0.2.0 it is {now}" if now else ""


@cache
def retired() -> dict[str, Any]:
    """Return core/retired.toml, read once: Python and its tools often ask a package for names that it has not."""
    import tomllib

    with open(f"{dirname(__file__)}/retired.toml", "rb") as table:
        return tomllib.load(table)
