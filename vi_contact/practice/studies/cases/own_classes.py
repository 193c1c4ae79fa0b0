"""Find the classes of others that a case file names as "package.module:Name".

Ask too whether they fit.

Importing a module runs it, and a case file may come from anybody: alone it imports nothing. Whoever
starts the run names the packages (``--allow PACKAGE``, ``read_case(path, allow=("package",))``), or
has installed one that registers an entry point of the group ``vi_contact``. The module is such a
package or lies below one, by whole names: "pack" allows "pack.sub", not "packet". The class is
defined in one, too: "pack.tools:Popen" would start programs wherever pack.tools uses
``subprocess``. And it has all methods of the protocol that the table asks for. Python searches its
own path without the folder of the case file, whose author could have put a module of a trusted name
there.
"""

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from importlib import import_module
from inspect import Parameter, getattr_static, isfunction, signature
from typing import Any

from ....core.checks import quote
from ....core.errors import InputError
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
            raise InputError(
                f"--allow {quote(name)}: give the name of a Python package, such as mypackage"
            )
    return found


def own_class(text: str, kinds: Sequence[Any], allowed: Sequence[str], spot: Spot) -> Callee:
    """Return how to call the class "package.module:Name".

    It raises InputError unless it is allowed and of one of the kinds.
    """
    found = _CLASS.fullmatch(text)
    if found is None:
        raise spot.inside(
            f"has the type {quote(text)}: give package.module:Name, in plain letters, digits and "
            "underscores"
        )
    asked = [kind for kind in kinds if is_protocol(kind)]
    if not asked:
        raise spot.inside(
            f"has the type '{text}', but accepts built-in classes only: leave it out to see them"
        )
    from importlib.metadata import entry_points  # late: it takes a while

    module, name = found.groups()
    allowed = (
        *allowed,
        *(one.value.partition(":")[0].strip() for one in entry_points(group=GROUP)),
    )
    if not _within(module, allowed):
        package = module.partition(".")[0]
        raise spot.inside(
            f"has the type '{text}' of the package '{package}', and a case file imports nothing by "
            f"itself: give --allow {package} if you trust it"
        )
    cls = _imported(module, name, spot)
    if not isinstance(cls, type):
        raise spot.inside(f"has the type '{text}', which is not a class: give one")
    if not _within(cls.__module__, allowed):
        raise spot.inside(
            f"has the type '{text}', which {cls.__module__} defines: name it there, and allow that "
            "package if you trust it"
        )
    defects = [defect(cls, kind) for kind in asked]
    if all(defects):
        raise spot.inside(
            f"has the type '{text}', which {defects[0]}, as {asked[0].__name__} must: see "
            "docs/reference/api.md"
        )
    return _callee(cls, text, asked, spot)


def _within(module: str, allowed: Iterable[str]) -> bool:
    return any(module == one or module.startswith(f"{one}.") for one in allowed)


def _imported(module: str, name: str, spot: Spot) -> Any:
    try:
        return getattr(import_module(module), name)
    except (Exception, SystemExit) as error:  # a module may raise anything
        why, package = f"{type(error).__name__}: {_line(error)}", module.partition(".")[0]
        remedy = f"correct {module}, or the name"
        if isinstance(error, ModuleNotFoundError):
            missing = (error.name or package).partition(".")[0]
            remedy = f"correct the name, install {missing}, or set PYTHONPATH to its folder"
        raise spot.inside(
            f"has the type '{module}:{name}', which Python cannot import ({why}): {remedy}"
        ) from error


def _line(error: BaseException) -> str:
    """Return what an error says, on one line."""
    return " ".join(str(error).split())[:200]


def _callee(cls: type, text: str, asked: Sequence[Any], spot: Spot) -> Callee:
    """Return the call, which looks up what only objects show.

    It tells errors of the constructor.
    """

    def made(**given: Any) -> Any:
        try:
            one = cls(**given)
        except InputError:
            raise
        except (TypeError, ValueError) as error:
            raise InputError(f"{text}: {_line(error)}") from error
        defects = [lacks(one, kind) for kind in asked if not defect(cls, kind)]
        if all(defects):
            raise InputError(
                f"{text} {defects[0]}, as {asked[0].__name__} must: see docs/reference/api.md"
            )
        return one

    try:
        return replace(callee(cls, name=text, given=()), function=made)
    except Exception as error:  # type hints are evaluated
        raise spot.inside(
            f"has the type '{text}', whose arguments cannot be read ({_line(error)}): correct the "
            "type hints of its constructor"
        ) from error


def is_protocol(kind: Any) -> bool:
    """Return whether the kind is a protocol, which own classes may satisfy."""
    return bool(getattr(kind, "_is_protocol", False))


def defect(cls: type, kind: Any) -> str:
    """Return what a class lacks to be of this kind, "has no method …".

    It is empty when it lacks nothing.
    """
    if not is_protocol(kind):
        return "" if issubclass(cls, kind) else f"is no {kind.__name__}"
    methods = dict(_asked(kind, isfunction))
    missing = [name for name in methods if not callable(_plain(cls, name))]
    if missing:
        return f"has no method {', '.join(missing)}"
    wrong = [
        f"{name}{_shown(asked)}" for name, asked in methods.items() if not _takes(cls, name, asked)
    ]
    return f"cannot be called as {', '.join(wrong)}" if wrong else ""


def lacks(value: object, kind: Any) -> str:
    """Return the attributes of a protocol that an object of a fitting class lacks.

    It reads "has no …", and is empty when it lacks none.
    """
    missing = [
        name
        for name, _ in _asked(kind, lambda one: isinstance(one, property))
        if not hasattr(value, name)
    ]
    return f"has no {', '.join(missing)}" if missing else ""


def _asked(kind: Any, wanted: Callable[[Any], bool]) -> Iterator[tuple[str, Any]]:
    """Yield the public members of a protocol and of those it extends."""
    for base in kind.__mro__:
        for name, value in vars(base).items() if is_protocol(base) else ():
            if wanted(value) and (name == "__call__" or not name.startswith("_")):
                yield name, value


def _plain(cls: type, name: str) -> Any:
    """Return the function behind a method; None where there is none."""
    found = next((vars(base)[name] for base in cls.__mro__ if name in vars(base)), None)
    return getattr(found, "__func__", found)


def _takes(cls: type, name: str, asked: Callable[..., Any]) -> bool:
    """Return whether a method of a class can be called with the arguments of the protocol's."""
    parameters = list(signature(asked).parameters.values())
    if isinstance(getattr_static(cls, name), staticmethod):
        parameters = parameters[1:]
    named = {one.name: one for one in parameters if one.kind is Parameter.KEYWORD_ONLY}
    try:
        signature(_plain(cls, name)).bind(
            *(one for one in parameters if one.name not in named), **named
        )
    except TypeError:
        return False
    except (ValueError, NameError):
        # compiled, and without a signature; type hints that Python 3.14 cannot resolve
        pass
    return True


def _shown(asked: Callable[..., Any]) -> str:
    """Return the parameters of a method without types: "(problem, state, dt)"."""
    return f"({', '.join(list(signature(asked).parameters)[1:])})"
