"""Check what a user gives: one sentence that names the owner, the field, the value and the remedy.

Every constructor and every entry point of the package asks here, before any work is done. A check
returns the value in the type that the caller goes on with, so that one line reads and checks an
argument.
"""

import math
import re
import traceback
from collections.abc import Callable, Iterable, Sequence
from numbers import Integral, Real
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from .algebra import Array, Comm, Indices, Mask, largest
from .errors import InputError, ViContactError, of_machine

T = TypeVar("T")

SHOWN = 60  # characters of a value in a sentence
LARGEST = 50_000_000  # numbers in one array that an input may ask for: 400 MB
MOST_CELLS = 20_000_000  # of a mesh made here: Gmsh takes some kilobytes for each


def number(
    owner: str,
    meaning: str,
    value: Any,
    *,
    positive: bool = False,
    not_negative: bool = False,
    unit: str = "",
) -> float:
    """Return a finite real number as a float.

    Raises:
        InputError: texts, NaN, infinity, truth values and wrong signs.
    """
    kind = "a finite number above zero" if positive else "zero or a positive finite number"
    wanted = (kind if positive or not_negative else "a finite number") + (
        f" in {unit}" if unit else ""
    )
    found = real(value)
    if (
        not math.isfinite(found)
        or found < 0.0
        and (positive or not_negative)
        or found == 0.0
        and positive
    ):
        raise InputError(f"{owner}: {meaning} is {shown(value)}; give {wanted}")
    return found


def whole(owner: str, meaning: str, value: Any, *, least: int = 0, most: int | None = None) -> int:
    """Return a whole number between ``least`` and ``most`` as an int.

    3.0 counts as a whole number, True does not.
    """
    found = real(value)
    if (
        not math.isfinite(found)
        or found != int(found)
        or found < least
        or (most is not None and found > most)
    ):
        upper = "" if most is None else f" and at most {most}"
        raise InputError(
            f"{owner}: {meaning} is {shown(value)}; give a whole number of at least {least}{upper}"
        )
    return int(value)


def between(what: str, value: Any, low: float, high: float, remedy: str) -> None:
    """Raise InputError unless it is a real number from ``low`` to ``high``, both included."""
    if not low <= real(value) <= high:
        raise InputError(f"{what} is {shown(value)}: {remedy}")


def check_word(name: str, given: object, known: Sequence[str]) -> None:
    """Raise InputError for a word that is not among those known."""
    if not isinstance(given, str) or given not in known:  # an array compares element by element
        raise InputError(f"unknown {name} {shown(str(given))}: choose one of {', '.join(known)}")


def counted(
    owner: str, asked: str, value: Any, things: str = "samples", *, most: int = LARGEST
) -> int:
    """Return how many things an input asks for, before memory is taken for them.

    Raises:
        InputError: more than ``most``, and NaN.
    """
    found = real(value)
    if not found <= most:
        raise InputError(
            f"{owner}: {asked} asks for {found:.3g} {things}, and {most:.3g} are the most; ask for "
            "fewer"
        )
    return int(value)


def flag(owner: str, meaning: str, value: Any) -> bool:
    """Return True or False; InputError for anything else, 0 and 1 too."""
    if isinstance(value, bool | np.bool_):
        return bool(value)
    raise InputError(f"{owner}: {meaning} is {shown(value)}; give True or False")


def function(owner: str, meaning: str, value: Any, remedy: str) -> Any:
    """Return what can be called; InputError for anything else, and for a class."""
    if callable(value) and not isinstance(value, type):
        return value
    raise InputError(f"{owner}: {meaning} is {shown(value)}; {called(value)}{remedy}")


def column_name(kind: str, name: Any) -> str:
    """Return a name that columns may carry.

    Raises:
        InputError: the name is not made of letters, digits and underscores alone.
    """
    if isinstance(name, str | int) and re.fullmatch(r"\w+", str(name), re.ASCII):
        return str(name)
    raise InputError(
        f"{kind} {shown(name)}: use letters, digits and underscores for names of columns"
    )


def several(owner: str, meaning: str, value: Any, remedy: str) -> tuple[Any, ...]:
    """Return the members of a list or tuple.

    Raises:
        InputError: one object, a text or a mapping in its place.
    """
    if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str | bytes):
        return tuple(value)
    raise InputError(f"{owner}: {meaning} is {shown(value)}; {called(value)}{remedy}")


def instance(
    owner: str, meaning: str, value: Any, kinds: type | tuple[type, ...], remedy: str
) -> Any:
    """Return an object of one of these types.

    Raises:
        InputError: a class instead of an object, and anything else.
    """
    if isinstance(value, kinds):
        return value
    raise InputError(f"{owner}: {meaning} is {shown(value)}; {called(value)}{remedy}")


def provides(
    owner: str,
    meaning: str,
    value: Any,
    names: tuple[str, ...],
    remedy: str,
    *,
    lacks: tuple[str, ...] = (),
) -> Any:
    """Return an object with these attributes (a protocol's) and without those of other kinds.

    Raises:
        InputError: the object lacks an attribute, or has one of another kind.
    """
    fits = all(hasattr(value, name) for name in names) and not any(
        hasattr(value, name) for name in lacks
    )
    if fits and not isinstance(value, type):
        return value
    raise InputError(f"{owner}: {meaning} is {shown(value)}; {called(value)}{remedy}")


def array(
    owner: str, meaning: str, value: Any, shape: tuple[int | None, ...], *, unit: str = ""
) -> Array:
    """Return finite real values as a float array of this shape.

    None in the shape stands for any length along an axis.
    """
    unit = f" in {unit}" if unit else ""
    wanted = (
        "("
        + ", ".join("any" if n is None else str(n) for n in shape)
        + ("," if len(shape) == 1 else "")
        + ")"
    )
    try:
        raw = np.asarray(value)
        if raw.dtype.kind not in "iuf":
            raise ValueError
        found = raw.astype(float)
    except (TypeError, ValueError):
        raise InputError(
            f"{owner}: {meaning} is {shown(value)}; give real numbers of shape {wanted}{unit}"
        ) from None
    if found.ndim != len(shape) or any(
        n is not None and n != m for n, m in zip(shape, found.shape, strict=True)
    ):
        raise InputError(
            f"{owner}: {meaning} has shape {found.shape}; give numbers of shape {wanted}"
        )
    if not np.all(np.isfinite(found)):
        place = tuple(int(i) for i in np.argwhere(~np.isfinite(found))[0])
        raise InputError(f"{owner}: {meaning} is {found[place]} at {place}; give finite numbers")
    return found


def optional(
    check: Callable[..., Any], owner: str, meaning: str, value: Any, *more: Any, **options: Any
) -> None:
    """Check a value that may be left out: ``check(owner, meaning, value, …)`` unless it is None."""
    if value is not None:
        check(owner, meaning, value, *more, **options)


def shape_of(value: Any) -> tuple[int, ...]:
    """Return the shape of numbers in lists or arrays.

    Lists of different lengths have none: (-1,) stands for it.
    """
    try:
        return np.shape(value)
    except ValueError:
        return (-1,)


def integers(owner: str, meaning: str, value: Any, shape: tuple[int | None, ...]) -> Indices:
    """Return whole numbers as an integer array of this shape; 3.0 counts as one."""
    found = array(owner, meaning, value, shape)
    if np.any(found != np.rint(found)) or np.any(np.abs(found) > 2.0**53):
        raise InputError(f"{owner}: {meaning} is {shown(value)}; give whole numbers")
    return found.astype(np.int64)


def mask(owner: str, meaning: str, value: Any, shape: tuple[int, ...]) -> Mask:
    """Return truth values of this shape.

    Raises:
        InputError: indices, numbers, texts and other shapes.
    """
    try:
        found = np.asarray(value)
    except ValueError:
        found = np.empty(0)
    if found.dtype != bool or found.shape != shape:
        is_what = f"has shape {found.shape}" if found.dtype == bool else f"is {shown(value)}"
        raise InputError(f"{owner}: {meaning} {is_what}; give a boolean mask of shape {shape}")
    return found


def path(owner: str, meaning: str, value: Any) -> Path:
    """Return a path; InputError for what is none, and for an empty one."""
    if not isinstance(value, str | Path) or not str(value).strip() or "\0" in str(value):
        raise InputError(f"{owner}: {meaning} is {shown(value)}; give the path of a file")
    return Path(value)


def at(point: Array) -> str:
    """Return a point as words for a sentence."""
    return f"({', '.join(f'{x:g}' for x in point)})"


def shown(value: Any) -> str:
    """Return the value for a sentence: short, on one line, also where its own repr fails."""
    if isinstance(value, type):
        return f"the class {value.__name__}"
    try:
        text = " ".join(repr(value).split())
    except Exception:
        # of a foreign repr, which may raise anything; and numbers of more digits than Python prints
        text = f"an object of type {type(value).__name__}"
    return text if len(text) <= SHOWN else text[: SHOWN - 1] + "…"


def called(value: Any) -> str:
    """Return the remedy for a class in place of an object, as the start of another one."""
    return f"make an object of it, {value.__name__}(…), or " if isinstance(value, type) else ""


def real(value: Any) -> float:
    """Return the value as a float, NaN for what is no real number.

    Integers too large for a float are infinite.
    """
    if isinstance(value, np.ndarray) and value.ndim == 0:
        value = value[()]
    if isinstance(value, bool | np.bool_) or not isinstance(value, Real | Integral):
        return math.nan
    try:
        return float(value)
    except OverflowError:
        return math.inf


def refuse(defects: Iterable[str], comm: Comm) -> None:
    """Raise InputError on all ranks with the first text that is not empty.

    It does not matter which rank found it. Collective.
    """
    mine = next((text for text in defects if text), "")
    if largest(comm, bool(mine)):
        found = comm.bcast(comm.gather(mine))
        raise InputError(next(text for text in found if text))


def ended(name: str, error: Exception) -> str:
    """Return the sentence about an error in a user's function.

    The package's own errors are told as they are, others with their line.
    """
    place = traceback.extract_tb(error.__traceback__)[-1]
    said = f"{type(error).__name__}: {error} ({Path(place.filename).name}, line {place.lineno})"
    if of_machine(error):
        return f"{name} ended in {said}: the machine refused it"
    return (
        str(error)
        if isinstance(error, ViContactError)
        else f"{name} ended in {said}: correct its function"
    )


def on_all(comm: Comm, name: str, call: Callable[[], T]) -> T:
    """Return what a call of a user's function returns.

    Collective.

    Raises:
        InputError: on all ranks, where the call raises on one.
    """
    found, defect, failure = [], "", None
    try:
        found.append(call())
    except Exception as error:
        # A user's function may raise anything, and the others must not wait for this one.
        defect, failure = ended(name, error), error
    try:
        refuse([defect], comm)
    except InputError as told:
        raise told from failure  # whoever tells it sees what it came from, such as a lack of memory
    return found[0]
