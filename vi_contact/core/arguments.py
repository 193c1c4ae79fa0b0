"""Check the arguments of public functions against their types.

A wrong argument is then a sentence and no traceback.

``@checked`` is for functions that users call with their own values, and that look at these before
any other function does; ``check_fields`` is for dataclasses. Both check the limits of numbers that
annotations mark: ``core.quantities``.
"""

import math
import os
import types
import typing
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields
from functools import cache, wraps
from inspect import Parameter, Signature, isclass, signature
from numbers import Integral, Number, Real
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numpy as np

from .checks import called, real, shape_of, shown
from .errors import InputError
from .quantities import Between, Quantity, quantities

_MANY: dict[Any, str] = {float: "real numbers", int: "whole numbers", str: "texts"}
P = ParamSpec("P")
R = TypeVar("R")


def checked(function: Callable[P, R]) -> Callable[P, R]:
    """Return the function with a check of its arguments.

    The check raises InputError for an argument that is not of its type, or beyond the limits that
    its annotation marks (``core.quantities``).
    """
    name, found = function.__qualname__, cache(lambda: _parameters(function))

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        of, known = found()
        for argument, value in of.bind(*args, **kwargs).arguments.items():
            if argument in known:
                _check(name, argument, value, known[argument])
        return function(*args, **kwargs)

    return call


def _parameters(function: Callable[..., Any]) -> tuple[Signature, dict[str, Quantity]]:
    """Return the signature, and what is asked of each argument of its own."""
    of, said = signature(function), quantities(function)
    several = (Parameter.VAR_POSITIONAL, Parameter.VAR_KEYWORD)
    return of, {
        name: said[name]
        for name, one in of.parameters.items()
        if one.kind not in several and name in said
    }


def check_fields(one: Any) -> None:
    """Raise InputError for the first field of a dataclass that is wrong.

    It is not of its type, or beyond the limits that its annotation marks (``core.quantities``).
    Call it in ``__post_init__``.
    """
    kind: Any = type(one)
    for name, asked in _fields(kind):
        _check(kind.__name__, name, getattr(one, name), asked)


@cache
def _fields(kind: Any) -> tuple[tuple[str, Quantity], ...]:
    """Return what is asked of each field of a dataclass."""
    said = quantities(kind)
    return tuple((one.name, said[one.name]) for one in fields(kind) if one.name in said)


def check(owner: str, meaning: str, value: Any, kind: Any) -> None:
    """Raise InputError unless the value is of this type, as annotations have it."""
    if not fits(value, kind):
        raise InputError(f"{owner}: {meaning} is {shown(value)}; give {words(kind)}")


def _check(owner: str, name: str, value: Any, asked: Quantity) -> None:
    """Raise InputError unless the value is of its type and within its limits."""
    kind, limit = asked.kind, asked.limit
    if limit is not None and type(value) is float and limit.holds(value) and kind is float:
        return  # as most are: objects are built in loops
    one = None if limit is None else _one_number(kind)
    if one is None and not fits(value, kind):
        told = limit.remedy if limit is not None and limit.remedy else f"give {words(kind)}"
        told = told if asked.other is None else f"{called(value)}{asked.other.text}"
        raise InputError(f"{owner}: {asked.named(name)} is {shown(value)}; {told}")
    if limit is None or (value is None and type(None) in _members(kind)):
        return
    if one is None:
        place, wrong = _beyond(value, limit)
    else:
        place, wrong = None if _holds(value, limit, one) else "", value
    if place is not None:
        said = f"{asked.named(name)}{place} is {shown(wrong)}"
        raise InputError(f"{owner}: {said}; {asked.remedy(one is int)}")


def _holds(value: Any, limit: Between, kind: type) -> bool:
    """Return whether a value is a number, or whole one, within a limit."""
    found = real(value)
    return limit.holds(found) and (kind is float or found == math.floor(found))


@cache
def _members(kind: Any) -> tuple[Any, ...]:
    """Return the types of a union, or the one type."""
    return typing.get_args(kind) if _is_union(kind) else (kind,)


@cache
def _one_number(kind: Any) -> type | None:
    """Return float or int where a value is one such number or None; else None."""
    found = [one for one in _members(kind) if one is not type(None)]
    return found[0] if len(found) == 1 and found[0] in (float, int) else None


def _beyond(value: Any, limit: Between) -> tuple[str | None, Any]:
    """Return the place of the first number of a list or array that is beyond a limit, and it.

    The place of one number is ""; it is None where all are within.
    """
    if _is_number(value):
        return (None if limit.holds(real(value)) else ""), value
    if isinstance(value, bool | np.bool_):
        return "", value
    if not _is_sequence(value):
        return None, value
    ends = (np.min(value), np.max(value)) if _are_numbers(value) and np.size(value) else ()
    if ends and all(limit.holds(real(one)) for one in ends):
        return None, value
    for index, one in enumerate(value):
        place, wrong = _beyond(one, limit)
        if place is not None:
            return f"[{index}]{place}", wrong
    return None, value


def fits(value: Any, kind: Any) -> bool:
    """Return whether a value is of a type; of one that is not understood every value is."""
    origin, inside = typing.get_origin(kind), typing.get_args(kind)
    if kind is Any:
        return True
    if _is_union(kind):
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
    protocol = kind if origin is None else origin  # without what stands in its brackets
    if getattr(protocol, "_is_protocol", False):
        return not isclass(value) and all(hasattr(value, name) for name in _asked(protocol))
    return isinstance(value, kind) if isclass(kind) and origin is None else True


def words(kind: Any) -> str:
    """Return the words for a type in a sentence."""
    origin, inside = typing.get_origin(kind), typing.get_args(kind)
    if _is_union(kind):
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


def _is_union(kind: Any) -> bool:
    return typing.get_origin(kind) in (typing.Union, types.UnionType)


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
    complex: lambda value: isinstance(value, Number) and not isinstance(value, bool),
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
