"""Check the arguments of public functions against their types: a sentence, and no traceback.

``@check_arguments`` is for functions that users call with their own values, and that look at these
before any other function does; ``check_fields`` is for dataclasses. Both check the limits of
numbers that annotations mark: ``core.quantities``.

``fits`` is the heart: it looks a type up in two tables, ``_SIMPLE`` and ``_MADE_OF`` at the end of
the file, and asks what a value is made of by itself. Types are read as a user means them: ``float``
takes whole numbers, ``int`` takes 3.0 and not True, a tuple or an array may come as a list, and an
array of numbers as anything that numpy makes one of. ``describe_type`` has the words of each type
for the sentence.
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

from .checks import find_shape, quote, real, suggest_object
from .errors import InputError
from .quantities import Between, Quantity, read_quantities

_PLURALS: dict[Any, str] = {float: "real numbers", int: "whole numbers", str: "texts"}
P = ParamSpec("P")
R = TypeVar("R")


def check_arguments(function: Callable[P, R]) -> Callable[P, R]:
    """Return the function with a check of its arguments.

    The check raises InputError for an argument that is not of its type, or beyond the limits that
    its annotation marks (``core.quantities``).
    """
    owner = function.__qualname__
    # Annotations are read at the first call and not here: they may name classes that come later in
    # the module.
    get_parameters = cache(lambda: _read_parameters(function))

    @wraps(function)
    def call(*args: P.args, **kwargs: P.kwargs) -> R:
        own_signature, quantity_of = get_parameters()
        for name, value in own_signature.bind(*args, **kwargs).arguments.items():
            if name in quantity_of:
                _check_quantity(owner, name, value, quantity_of[name])
        return function(*args, **kwargs)

    return call


def _read_parameters(function: Callable[..., Any]) -> tuple[Signature, dict[str, Quantity]]:
    """Return the signature, and what the annotation of each parameter asks for.

    Parameters that collect others, such as ``*args``, are left out.
    """
    own_signature = signature(function)
    quantity_of = read_quantities(function)
    collecting = (Parameter.VAR_POSITIONAL, Parameter.VAR_KEYWORD)
    names = [
        name
        for name, parameter in own_signature.parameters.items()
        if parameter.kind not in collecting and name in quantity_of
    ]
    return own_signature, {name: quantity_of[name] for name in names}


def check_fields(value: Any) -> None:
    """Raise InputError for the first field of a dataclass that is wrong.

    A field is wrong that is not of its type, or beyond the limits that its annotation marks
    (``core.quantities``). Call it in ``__post_init__``.
    """
    kind: Any = type(value)
    for name, quantity in _read_fields(kind):
        _check_quantity(kind.__name__, name, getattr(value, name), quantity)


@cache
def _read_fields(kind: Any) -> tuple[tuple[str, Quantity], ...]:
    """Return what the annotation of each field of a dataclass asks for."""
    quantity_of = read_quantities(kind)
    names = [field.name for field in fields(kind) if field.name in quantity_of]
    return tuple((name, quantity_of[name]) for name in names)


def check_type(owner: str, meaning: str, value: Any, kind: Any) -> None:
    """Raise InputError unless the value is of a type.

    Args:
        owner: class or function that asks, the first word of the sentence.
        meaning: what the value is, in words.
        value: what the user gave.
        kind: the type, as annotations have it.
    """
    if not fits(value, kind):
        raise InputError(f"{owner}: {meaning} is {quote(value)}; give {describe_type(kind)}")


def _check_quantity(owner: str, name: str, value: Any, quantity: Quantity) -> None:
    """Raise InputError unless the value is of its type and within its limits.

    Args:
        owner: class or function that asks, the first word of the sentence.
        name: the argument or field.
        value: what the user gave.
        quantity: what the annotation asks for.
    """
    kind = quantity.kind
    limit = quantity.limit
    if limit is not None and type(value) is float and limit.holds(value) and kind is float:
        return  # as most are: objects are built in loops

    # Of a single number, type and limit are one question, with one sentence.
    number_kind = None if limit is None else _single_number(kind)
    if number_kind is None and not fits(value, kind):
        remedy = f"give {describe_type(kind)}"
        if quantity.other is not None:
            remedy = f"{suggest_object(value)}{quantity.other.text}"
        elif limit is not None and limit.remedy:
            remedy = limit.remedy
        raise InputError(f"{owner}: {quantity.describe(name)} is {quote(value)}; {remedy}")
    if limit is None or (value is None and type(None) in _members(kind)):
        return

    if number_kind is not None:
        place = None if _holds(value, limit, number_kind) else ""
        wrong = value
    else:
        place, wrong = _locate_beyond(value, limit)
    if place is not None:
        defect = f"{quantity.describe(name)}{place} is {quote(wrong)}"
        raise InputError(f"{owner}: {defect}; {quantity.remedy(number_kind is int)}")


def _holds(value: Any, limit: Between, kind: type) -> bool:
    """Return whether a value is a number within a limit, and a whole one where ``kind`` is int."""
    number = real(value)
    return limit.holds(number) and (kind is float or number == math.floor(number))


@cache
def _members(kind: Any) -> tuple[Any, ...]:
    """Return the types of a union, or the type itself."""
    return typing.get_args(kind) if _is_union(kind) else (kind,)


def members_of(kind: Any) -> list[Any]:
    """Return the types of a union but for None, or the one type."""
    return [member for member in _members(kind) if member is not type(None)]


@cache
def _single_number(kind: Any) -> type | None:
    """Return float or int where a value of this type is such a number or None; else None."""
    members = members_of(kind)
    return members[0] if len(members) == 1 and members[0] in (float, int) else None


def _locate_beyond(value: Any, limit: Between) -> tuple[str | None, Any]:
    """Return the place of the first number that is beyond a limit, and that number.

    The place is an index such as "[2]", "" for a single number, None where all are within.
    """
    if _is_number(value):
        return (None if limit.holds(real(value)) else ""), value
    if isinstance(value, bool | np.bool_):
        return "", value
    if not _is_sequence(value):
        return None, value
    # The two ends of many numbers are looked at first: most often both are within.
    if _are_numbers(value) and np.size(value):
        ends = (np.min(value), np.max(value))
        if all(limit.holds(real(end)) for end in ends):
            return None, value
    for index, member in enumerate(value):
        place, wrong = _locate_beyond(member, limit)
        if place is not None:
            return f"[{index}]{place}", wrong
    return None, value


def fits(value: Any, kind: Any) -> bool:
    """Return whether a value is of a type; every value is of a type that is not understood.

    Args:
        value: what the user gave.
        kind: the type, as an annotation has it, without marks.
    """
    # Of list[int], for example, the origin is list, and int stands inside.
    origin = _find_origin(kind)
    inside = typing.get_args(kind)
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
    if any(map(_is_path, kinds)) and str in kinds:
        kinds = (Path, *(kind for kind in kinds if kind is not str))
    return any(fits(value, kind) for kind in kinds)


def _fits_object(value: Any, kind: Any, origin: Any) -> bool:
    """Return whether a value is a function, satisfies a protocol, or is of a class.

    Args:
        value: what the user gave.
        kind: a type that is in no table.
        origin: the type without its brackets; None where it has none.
    """
    if kind is Callable or origin is Callable:
        return callable(value) and not isclass(value)
    protocol = kind if origin is None else origin  # without what stands in its brackets
    if getattr(protocol, "_is_protocol", False):
        names = _names_asked(protocol)
        return not isclass(value) and all(hasattr(value, name) for name in names)
    return isinstance(value, kind) if isclass(kind) and origin is None else True


def describe_type(kind: Any) -> str:
    """Return the words for a type in a sentence, such as "whole numbers in a list or None"."""
    origin = _find_origin(kind)
    inside = typing.get_args(kind)
    if _is_union(kind):
        is_path = any(map(_is_path, inside))
        texts = [describe_type(member) for member in inside if not (is_path and member is str)]
        return " or ".join(dict.fromkeys(texts))
    if kind is None or kind is type(None):
        return "None"
    if _is_path(kind):
        return "a path"
    if origin is np.ndarray:
        return "real numbers in a list or array"
    # A tuple of some length, of one type or of several; with an ellipsis of any length.
    if origin is tuple:
        count = "" if inside[-1] is Ellipsis else f"{len(inside)} "
        if len(set(inside) - {Ellipsis}) == 1:
            return f"{count}{_PLURALS.get(inside[0], 'values')} in a tuple"
        return f"a tuple of {', '.join(map(describe_type, inside))}"
    if origin in (Sequence, Iterable, list):
        return f"{_PLURALS.get(inside[0], 'values')} in a list"
    if origin in (Mapping, dict):
        return "a mapping"
    if kind is Callable or origin is Callable:
        return "a function"
    known = {float: "a real number", int: "a whole number", bool: "True or False", str: "a text"}
    return known.get(kind, f"an object of {getattr(kind, '__name__', str(kind))}")


def _find_origin(kind: Any) -> Any:
    """Return a type without its brackets, None where it has none.

    ``NDArray[…]`` is a name for ``np.ndarray[…]`` since numpy 2.5, and was that type before.
    """
    origin = typing.get_origin(kind)
    named = getattr(origin, "__value__", None)
    return origin if named is None else typing.get_origin(named)


def _is_union(kind: Any) -> bool:
    """Return whether a type is a union of types."""
    return typing.get_origin(kind) in (typing.Union, types.UnionType)


def _is_path(kind: Any) -> bool:
    """Return whether a type is one of paths."""
    return kind is Path or kind is os.PathLike or typing.get_origin(kind) is os.PathLike


def _fits_path(value: Any) -> bool:
    """Return whether a value is a path or a text that can be one."""
    if not isinstance(value, str | os.PathLike):
        return False
    return bool(os.fspath(value)) and "\0" not in os.fsdecode(value)


def _is_number(value: Any) -> bool:
    """Return whether a value is one real number; truth values are none."""
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    return isinstance(value, Real) and not isinstance(value, bool | np.bool_)


def _is_whole(value: Any) -> bool:
    """Return whether a value is one whole number; 3.0 is one."""
    if not _is_number(value):
        return False
    return isinstance(value, Integral) or real(value) == np.rint(real(value))


def _are_numbers(value: Any) -> bool:
    """Return whether a value is a number, or numbers in lists or arrays of equal lengths."""
    if isinstance(value, str | bytes) or find_shape(value) == (-1,):
        return False
    return np.asarray(value).dtype.kind in "iufb"


def _is_sequence(value: Any) -> bool:
    """Return whether a value is a list, a tuple or an array, but no text."""
    if isinstance(value, np.ndarray):
        return value.ndim > 0
    return isinstance(value, Sequence) and not isinstance(value, str | bytes)


def _fits_tuple(value: Any, inside: tuple[Any, ...]) -> bool:
    """Return whether a value is a list of members of these types."""
    if not _is_sequence(value):
        return False
    if inside[-1] is Ellipsis:
        return all(fits(member, inside[0]) for member in value)
    return len(inside) == len(value) and all(map(fits, value, inside))


def _fits_sequence(value: Any, inside: tuple[Any, ...]) -> bool:
    """Return whether a value is a list of members of the one type inside."""
    return _is_sequence(value) and all(fits(member, inside[0]) for member in value)


def _fits_mapping(value: Any, inside: tuple[Any, ...]) -> bool:
    """Return whether a value is a mapping of these types of keys and values."""
    if not isinstance(value, Mapping):
        return False
    return all(fits(key, inside[0]) and fits(value[key], inside[1]) for key in value)


# Type -> whether a value is of it.
_SIMPLE: dict[Any, Callable[[Any], bool]] = {
    float: _is_number,
    int: _is_whole,
    complex: lambda value: isinstance(value, Number) and not isinstance(value, bool),
    bool: lambda value: isinstance(value, bool | np.bool_),
    np.ndarray: _are_numbers,
}
# Type without its brackets -> whether a value is of it, given the types inside the brackets.
_MADE_OF: dict[Any, Callable[[Any, tuple[Any, ...]], bool]] = {
    np.ndarray: lambda value, _: _are_numbers(value),
    tuple: _fits_tuple,
    Sequence: _fits_sequence,
    Iterable: _fits_sequence,
    list: _fits_sequence,
    Mapping: _fits_mapping,
    dict: _fits_mapping,
}


def _names_asked(protocol: Any) -> list[str]:
    """Return the attributes and methods that a protocol, and those it is made of, ask for."""
    names: set[str] = set()
    for base in protocol.__mro__:
        if getattr(base, "_is_protocol", False):
            names.update(vars(base), getattr(base, "__annotations__", {}))
    return sorted(name for name in names if not name.startswith("_"))
