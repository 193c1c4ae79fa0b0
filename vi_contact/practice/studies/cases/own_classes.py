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
from .table_calls import Callee, Spot, make_callee

_WORD = "[A-Za-z][A-Za-z0-9_]{0,63}"
_PACKAGE = re.compile(rf"{_WORD}(?:\.{_WORD}){{0,7}}")
_CLASS = re.compile(rf"({_PACKAGE.pattern}):({_WORD})")
GROUP = "vi_contact"  # of entry points


def check_packages(names: Iterable[str]) -> tuple[str, ...]:
    """Return the names of packages that a user allows; InputError for what is no such name."""
    allowed = (names,) if isinstance(names, str) else tuple(names)
    for name in allowed:
        if not isinstance(name, str) or not _PACKAGE.fullmatch(name):
            raise InputError(
                f"--allow {quote(name)}: give the name of a Python package, such as mypackage"
            )
    return allowed


def find_own_class(text: str, kinds: Sequence[Any], allowed: Sequence[str], spot: Spot) -> Callee:
    """Return how to call the class "package.module:Name".

    Args:
        text: the ``type`` of a table.
        kinds: the types that the table may make.
        allowed: the packages whose classes may be named.
        spot: where the table stands.

    Raises:
        InputError: unless the class is allowed and of one of the kinds.
    """
    match = _CLASS.fullmatch(text)
    if match is None:
        raise spot.make_table_error(
            f"has the type {quote(text)}: give package.module:Name, in plain letters, digits and "
            "underscores"
        )
    protocols = [kind for kind in kinds if is_protocol(kind)]
    if not protocols:
        raise spot.make_table_error(
            f"has the type '{text}', but accepts built-in classes only: leave it out to see them"
        )
    from importlib.metadata import entry_points  # late: it takes a while

    module, name = match.groups()
    registered = [entry.value.partition(":")[0].strip() for entry in entry_points(group=GROUP)]
    trusted = (*allowed, *registered)

    # Importing a module runs it: it has to be of a trusted package.
    if not _is_within(module, trusted):
        package = module.partition(".")[0]
        raise spot.make_table_error(
            f"has the type '{text}' of the package '{package}', and a case file imports nothing by "
            f"itself: give --allow {package} if you trust it"
        )
    cls = _import_class(module, name, spot)
    if not isinstance(cls, type):
        raise spot.make_table_error(f"has the type '{text}', which is not a class: give one")

    # A trusted module may have imported the class from one that is not.
    if not _is_within(cls.__module__, trusted):
        raise spot.make_table_error(
            f"has the type '{text}', which {cls.__module__} defines: name it there, and allow that "
            "package if you trust it"
        )

    # It is enough to be of one of the kinds.
    defects = [describe_defect(cls, kind) for kind in protocols]
    if all(defects):
        raise spot.make_table_error(
            f"has the type '{text}', which {defects[0]}, as {protocols[0].__name__} must: see "
            "docs/reference/api.md"
        )
    return _make_callee_of_class(cls, text, protocols, spot)


def _is_within(module: str, packages: Iterable[str]) -> bool:
    """Tell whether a module is one of these packages or lies below one."""
    return any(module == package or module.startswith(f"{package}.") for package in packages)


def _import_class(module: str, name: str, spot: Spot) -> Any:
    """Return what a module calls by this name; InputError where it cannot be imported."""
    try:
        return getattr(import_module(module), name)
    except (Exception, SystemExit) as error:  # a module may raise anything
        reason = f"{type(error).__name__}: {_put_on_one_line(error)}"
        remedy = f"correct {module}, or the name"
        if isinstance(error, ModuleNotFoundError):
            missing = (error.name or module).partition(".")[0]
            remedy = f"correct the name, install {missing}, or set PYTHONPATH to its folder"
        raise spot.make_table_error(
            f"has the type '{module}:{name}', which Python cannot import ({reason}): {remedy}"
        ) from error


def _put_on_one_line(error: BaseException) -> str:
    """Return what an error says, on one line."""
    return " ".join(str(error).split())[:200]


def _make_callee_of_class(cls: type, text: str, protocols: Sequence[Any], spot: Spot) -> Callee:
    """Return how to call a class; the call tells errors of the constructor by InputError.

    Attributes of a protocol are looked up when an object is made, as only objects show them.
    """

    def construct(**arguments: Any) -> Any:
        try:
            value = cls(**arguments)
        except InputError:
            raise
        except (TypeError, ValueError) as error:
            raise InputError(f"{text}: {_put_on_one_line(error)}") from error
        fitting = [kind for kind in protocols if not describe_defect(cls, kind)]
        lacks = [describe_lack(value, kind) for kind in fitting]
        if all(lacks):
            raise InputError(
                f"{text} {lacks[0]}, as {protocols[0].__name__} must: see docs/reference/api.md"
            )
        return value

    try:
        return replace(make_callee(cls, name=text, supplied=()), function=construct)
    except Exception as error:  # type hints are evaluated
        raise spot.make_table_error(
            f"has the type '{text}', whose arguments cannot be read ({_put_on_one_line(error)}): "
            "correct the type hints of its constructor"
        ) from error


def is_protocol(kind: Any) -> bool:
    """Return whether the kind is a protocol, which own classes may satisfy."""
    return bool(getattr(kind, "_is_protocol", False))


def describe_defect(cls: type, kind: Any) -> str:
    """Return what a class lacks to be of this kind, "has no method …".

    It is empty when it lacks nothing.
    """
    if not is_protocol(kind):
        return "" if issubclass(cls, kind) else f"is no {kind.__name__}"
    methods = dict(_list_members(kind, isfunction))
    missing = [name for name in methods if not callable(_find_function(cls, name))]
    if missing:
        return f"has no method {', '.join(missing)}"
    unfit = [
        f"{name}{_describe_parameters(method)}"
        for name, method in methods.items()
        if not _takes_arguments(cls, name, method)
    ]
    return f"cannot be called as {', '.join(unfit)}" if unfit else ""


def describe_lack(value: object, kind: Any) -> str:
    """Return the attributes of a protocol that an object of a fitting class lacks.

    It reads "has no …", and is empty when it lacks none.
    """
    properties = _list_members(kind, lambda member: isinstance(member, property))
    missing = [name for name, _ in properties if not hasattr(value, name)]
    return f"has no {', '.join(missing)}" if missing else ""


def _list_members(kind: Any, is_wanted: Callable[[Any], bool]) -> Iterator[tuple[str, Any]]:
    """Yield the public members of a protocol and of those it extends."""
    for protocol in filter(is_protocol, kind.__mro__):
        for name, member in vars(protocol).items():
            if is_wanted(member) and (name == "__call__" or not name.startswith("_")):
                yield name, member


def _find_function(cls: type, name: str) -> Any:
    """Return the function behind a method; None where there is none."""
    for base in cls.__mro__:
        if name in vars(base):
            member = vars(base)[name]
            return getattr(member, "__func__", member)
    return None


def _takes_arguments(cls: type, name: str, method: Callable[..., Any]) -> bool:
    """Return whether a method of a class can be called with the arguments of the protocol's."""
    parameters = list(signature(method).parameters.values())
    if isinstance(getattr_static(cls, name), staticmethod):
        parameters = parameters[1:]
    by_keyword = {
        parameter.name: parameter
        for parameter in parameters
        if parameter.kind is Parameter.KEYWORD_ONLY
    }
    by_position = [parameter for parameter in parameters if parameter.name not in by_keyword]
    try:
        signature(_find_function(cls, name)).bind(*by_position, **by_keyword)
    except TypeError:
        return False
    except (ValueError, NameError):
        # compiled, and without a signature; type hints that Python 3.14 cannot resolve
        pass
    return True


def _describe_parameters(method: Callable[..., Any]) -> str:
    """Return the parameters of a method without types: "(problem, state, dt)"."""
    return f"({', '.join(list(signature(method).parameters)[1:])})"
