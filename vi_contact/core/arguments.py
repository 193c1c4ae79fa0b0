"""Check the arguments of public functions against their types.

A wrong argument is then a sentence and no traceback.

``@checked`` is for functions that users call with their own values, and that look at these before
any other function does. Limits of numbers (positive, finite) are checked by the functions
themselves.
"""

import os
import types
import typing
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields
from functools import cache, wraps
from inspect import Parameter, isclass, signature
from numbers import Integral, Real
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numpy as np

from .checks import real, shape_of, shown
from .errors import InputError

_MANY: dict[Any, str] = {float: "real numbers", int: "whole numbers", str: "texts"}
P = ParamSpec("P")
R = TypeVar("R")


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Return the function with a check of its arguments.

    The check raises InputError for an argument that is not of its type.
    """
    name, of = function.__qualname__, signature(function)

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        hints, bound = _hints(function), of.bind(*args, **kwargs)
        for argument, value in bound.arguments.items():
            if of.parameters[argument].kind not in (
                Parameter.VAR_POSITIONAL,
                Parameter.VAR_KEYWORD,
            ):
                check(name, argument, value, hints.get(argument, Any))
        return function(*args, **kwargs)

    return call


def check_fields(one: Any) -> None:
    """Raise InputError for the first field of a dataclass that is not of its type.

    Call it in ``__post_init__``.
    """
    kind: Any = type(one)
    hints = _hints(kind)
    for field in fields(one):
        check(type(one).__name__, field.name, getattr(one, field.name), hints[field.name])


def check(owner: str, meaning: str, value: Any, kind: Any) -> None:
    """Raise InputError unless the value is of this type, as annotations have it."""
    if not fits(value, kind):
        raise InputError(f"{owner}: {meaning} is {shown(value)}; give {words(kind)}")


@cache
def _hints(owner: Any) -> dict[str, Any]:
    """Return the types of arguments or fields, each once."""
    return typing.get_type_hints(owner)


def fits(value: Any, kind: Any) -> bool:
    """Return whether a value is of a type; of one that is not understood every value is."""
    origin, inside = typing.get_origin(kind), typing.get_args(kind)
    if kind is Any:
        return True
    if origin in (typing.Union, types.UnionType):
        return _fits_one_of(value, inside)
    if kind is None or kind is type(None):
        return value is None
    if _is_path(kind):
        return _fits_path(value)
    if kind in _SIMPLE:
        return _SIMPLE[kind](value)
    if origin in _MADE_OF:
        return _MADE_OF[origin](value, inside)
    return _fits_object(value, kind, origin)


def _fits_one_of(value: Any, kinds: tuple[Any, ...]) -> bool:
    """Return whether a value is of one of several types; a text beside a path is a path."""
    is_path = any(_is_path(one) for one in kinds)
    return any(_fits_path(value) if is_path and one is str else fits(value, one) for one in kinds)


def _fits_object(value: Any, kind: Any, origin: Any) -> bool:
    """Return whether a value is a function, satisfies a protocol, or is of a class."""
    if kind is Callable or origin is Callable:
        return callable(value) and not isclass(value)
    if getattr(kind, "_is_protocol", False):
        return not isclass(value) and all(hasattr(value, name) for name in _asked(kind))
    return isinstance(value, kind) if isclass(kind) and origin is None else True


def words(kind: Any) -> str:
    """Return the words for a type in a sentence."""
    origin, inside = typing.get_origin(kind), typing.get_args(kind)
    if origin in (typing.Union, types.UnionType):
        is_path = any(_is_path(one) for one in inside)
        said = [words(one) for one in inside if not (is_path and one is str)]
        return " or ".join(dict.fromkeys(said))
    if kind is None or kind is type(None):
        return "None"
    if _is_path(kind):
        return "a path"
    if origin is np.ndarray:
        return "real numbers in a list or array"
    if origin is tuple:
        alike = len({one for one in inside if one is not Ellipsis}) == 1
        several = "" if inside[-1] is Ellipsis else f"{len(inside)} "
        if alike:
            return f"{several}{_MANY.get(inside[0], 'values')} in a tuple"
        return f"a tuple of {', '.join(words(one) for one in inside)}"
    if origin in (Sequence, Iterable, list):
        return f"{_MANY.get(inside[0], 'values')} in a list"
    if origin in (Mapping, dict):
        return "a mapping"
    if kind is Callable or origin is Callable:
        return "a function"
    known = {float: "a real number", int: "a whole number", bool: "True or False", str: "a text"}
    return known.get(kind, f"an object of {getattr(kind, '__name__', str(kind))}")


def _is_path(kind: Any) -> bool:
    return kind is Path or kind is os.PathLike or typing.get_origin(kind) is os.PathLike


def _fits_path(value: Any) -> bool:
    if not isinstance(value, str | os.PathLike):
        return False
    return bool(os.fspath(value)) and "\0" not in os.fsdecode(value)


def _is_number(value: Any) -> bool:
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    return isinstance(value, Real) and not isinstance(value, bool | np.bool_)


def _is_whole(value: Any) -> bool:
    return _is_number(value) and (
        isinstance(value, Integral) or real(value) == np.rint(real(value))
    )


def _are_numbers(value: Any) -> bool:
    return (
        not isinstance(value, str | bytes)
        and shape_of(value) != (-1,)
        and np.asarray(value).dtype.kind in "iufb"
    )


def _is_sequence(value: Any) -> bool:
    if isinstance(value, np.ndarray):
        return value.ndim > 0
    return isinstance(value, Sequence) and not isinstance(value, str | bytes)


def _fits_tuple(value: Any, inside: tuple[Any, ...]) -> bool:
    if not _is_sequence(value):
        return False
    kinds = [inside[0]] * len(value) if inside[-1] is Ellipsis else list(inside)
    return len(kinds) == len(value) and all(
        fits(one, kind) for one, kind in zip(value, kinds, strict=True)
    )


def _fits_sequence(value: Any, inside: tuple[Any, ...]) -> bool:
    return _is_sequence(value) and all(fits(one, inside[0]) for one in value)


def _fits_mapping(value: Any, inside: tuple[Any, ...]) -> bool:
    return isinstance(value, Mapping) and all(
        fits(key, inside[0]) and fits(value[key], inside[1]) for key in value
    )


_SIMPLE: dict[Any, Callable[[Any], bool]] = {
    float: _is_number,
    int: _is_whole,
    bool: lambda value: isinstance(value, bool | np.bool_),
    np.ndarray: _are_numbers,
}
_MADE_OF: dict[Any, Callable[[Any, tuple[Any, ...]], bool]] = {
    np.ndarray: lambda value, _: _are_numbers(value),
    tuple: _fits_tuple,
    Sequence: _fits_sequence,
    Iterable: _fits_sequence,
    list: _fits_sequence,
    Mapping: _fits_mapping,
    dict: _fits_mapping,
}


def _asked(protocol: Any) -> list[str]:
    """Return the attributes and methods that a protocol asks for."""
    names = {
        name
        for one in protocol.__mro__
        if getattr(one, "_is_protocol", False)
        for name in (*vars(one), *getattr(one, "__annotations__", {}))
    }
    return sorted(name for name in names if not name.startswith("_"))
