"""Ask whether objects of a class are of a kind: the methods of a protocol, or a subclass of a class."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from inspect import Parameter, getattr_static, isfunction, signature
from typing import Any


def is_protocol(kind: Any) -> bool:
    """Return whether the kind is a protocol, which own classes may satisfy."""
    return bool(getattr(kind, "_is_protocol", False))


def defect(cls: type, kind: Any) -> str:
    """Return what a class lacks to be of this kind, "has no method …"; empty when it lacks nothing."""
    if not is_protocol(kind):
        return "" if issubclass(cls, kind) else f"is no {kind.__name__}"
    methods = dict(_asked(kind, isfunction))
    missing = [name for name in methods if not callable(_plain(cls, name))]
    if missing:
        return f"has no method {', '.join(missing)}"
    wrong = [f"{name}{_shown(asked)}" for name, asked in methods.items() if not _takes(cls, name, asked)]
    return f"cannot be called as {', '.join(wrong)}" if wrong else ""


def lacks(value: object, kind: Any) -> str:
    """Return the attributes of a protocol that an object of a fitting class lacks, "has no …"; empty when none."""
    missing = [name for name, _ in _asked(kind, lambda one: isinstance(one, property)) if not hasattr(value, name)]
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
        signature(_plain(cls, name)).bind(*(one for one in parameters if one.name not in named), **named)
    except TypeError:
        return False
    except (ValueError, NameError):  # compiled, and without a signature; type hints that Python 3.14 cannot resolve
        pass
    return True


def _shown(asked: Callable[..., Any]) -> str:
    """Return the parameters of a method without types: "(problem, state, dt)"."""
    return f"({', '.join(list(signature(asked).parameters)[1:])})"
