"""Find the classes of others that a case file names as "package.module:Name".

Importing a module runs it, and a case file may come from anybody. So a case file alone imports nothing: the person who
starts the run names the packages (``--allow PACKAGE``, ``read_case(path, allow=("package",))``), or has installed one
that registers an entry point of the group ``vi_contact``. Then three rules hold.

The module is an allowed package or lies below one, by whole names: "pack" allows "pack" and "pack.sub", not "packet".
The class is defined in an allowed package, too: what a module merely imports for its own use is not what it offers, and
"pack.tools:Popen" would start programs wherever pack.tools uses ``subprocess``. A package may hand on its own classes,
"pack:Law" from "pack.laws". And the class has all methods of the protocol that the table asks for, which is looked up
before an object is made. Python searches its own path; the folder of the case file is not added to it,
since whoever wrote the file could have put a module of a trusted name there.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from dataclasses import replace
from importlib import import_module
from importlib.metadata import entry_points
from typing import Any

from ...core.checks import shown
from ...core.errors import InputError
from .conformity import defect, is_protocol, lacks
from .table_calls import Callee, Spot, callee

_WORD = "[A-Za-z][A-Za-z0-9_]{0,63}"
_PACKAGE = re.compile(rf"{_WORD}(?:\.{_WORD}){{0,7}}")
_CLASS = re.compile(rf"({_PACKAGE.pattern}):({_WORD})")
GROUP = "vi_contact"  # of entry points


def packages(names: Iterable[str]) -> tuple[str, ...]:
    """Return the names of packages that a user allows; InputError for what is no such name."""
    found = (names,) if isinstance(names, str) else tuple(names)
    for name in found:
        if not isinstance(name, str) or not _PACKAGE.fullmatch(name):
            raise InputError(f"--allow {shown(name)}: give the name of a Python package, such as mypackage")
    return found


def own_class(text: str, kinds: Sequence[Any], allowed: Sequence[str], spot: Spot) -> Callee:
    """Return how to call the class "package.module:Name"; InputError unless it is allowed and of one of the kinds."""
    found = _CLASS.fullmatch(text)
    if found is None:
        raise spot.inside(f"has the type {shown(text)}: give package.module:Name, in plain letters, digits and "
                          "underscores")
    asked = [kind for kind in kinds if is_protocol(kind)]
    if not asked:
        raise spot.inside(f"has the type '{text}', and takes no classes but its own: leave the type out to see them")
    module, name = found.groups()
    allowed = (*allowed, *_registered())
    if not _within(module, allowed):
        package = module.partition(".")[0]
        raise spot.inside(f"has the type '{text}' of the package '{package}', and a case file imports nothing by "
                          f"itself: give --allow {package} if you trust it")
    cls = _imported(module, name, spot)
    _check(cls, text, asked, allowed, spot)
    return _callee(cls, text, asked, spot)


def _registered() -> list[str]:
    """Return the packages whose entry points somebody has installed."""
    return [one.value.partition(":")[0].strip() for one in entry_points(group=GROUP)]


def _within(module: str, allowed: Iterable[str]) -> bool:
    return any(module == one or module.startswith(f"{one}.") for one in allowed)


def _imported(module: str, name: str, spot: Spot) -> Any:
    try:
        return getattr(import_module(module), name)
    except (Exception, SystemExit) as error:  # a module may raise anything
        why = f"{type(error).__name__}: {_line(error)}"
        raise spot.inside(f"has the type '{module}:{name}', which Python cannot import ({why}): install "
                          f"{module.partition('.')[0]}, or set PYTHONPATH to its folder") from error


def _line(error: BaseException) -> str:
    """Return what an error says, on one line."""
    return " ".join(str(error).split())[:200]


def _check(cls: Any, text: str, asked: Sequence[Any], allowed: Sequence[str], spot: Spot) -> None:
    if not isinstance(cls, type):
        raise spot.inside(f"has the type '{text}', which is no class: give one")
    if not _within(cls.__module__, allowed):
        raise spot.inside(f"has the type '{text}', which {cls.__module__} defines: name it there, and allow that "
                          "package if you trust it")
    defects = [defect(cls, kind) for kind in asked]
    if all(defects):
        raise spot.inside(f"has the type '{text}', which {defects[0]}, as {asked[0].__name__} must: see "
                          "docs/reference/api.md")


def _callee(cls: type, text: str, asked: Sequence[Any], spot: Spot) -> Callee:
    """Return the call, which looks up what only objects show, and tells errors of the constructor."""

    def made(**given: Any) -> Any:
        try:
            one = cls(**given)
        except InputError:
            raise
        except (TypeError, ValueError) as error:
            raise InputError(f"{text}: {_line(error)}") from error
        defects = [lacks(one, kind) for kind in asked if not defect(cls, kind)]
        if all(defects):
            raise InputError(f"{text} {defects[0]}, as {asked[0].__name__} must: see docs/reference/api.md")
        return one

    try:
        return replace(callee(cls, name=text, given=()), function=made)
    except Exception as error:  # type hints are evaluated
        raise spot.inside(f"has the type '{text}', whose arguments cannot be read ({_line(error)}): correct the type "
                          "hints of its constructor") from error
