"""Check what a user gives: one sentence that names the owner, the field, the value and the remedy.

Every constructor and every entry point of the package asks here, before any work is done. A check
returns the value in the type that the caller goes on with, so that one line reads and checks an
argument:

    dt = number("march", "dt", dt, positive=True, unit="s")

Such a check is named by what it returns, as ``float`` and ``int`` are: ``number``, ``whole``,
``flag``, ``array`` and the like. Its first arguments are ``owner``, who asks; ``meaning``, what the
value is in words; and the value. Together they make the sentence "owner: meaning is value; give …".
A check that returns nothing is a verb. Arguments whose limits stand in annotations are
checked by ``core.arguments`` instead.

``refuse`` and ``on_all`` raise on all ranks what is wrong on one: otherwise the others would wait
for ever in the next collective call.
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
from .errors import InputError, ViContactError, is_of_machine

T = TypeVar("T")

SHOWN = 60  # characters of a value in a sentence, at most
LARGEST = 50_000_000  # numbers in one array that an input may ask for: 400 MB
MOST_CELLS = 20_000_000  # of a mesh made here: Gmsh takes some kilobytes for each
LARGEST_WHOLE = 2.0**53  # beyond it not every whole number is a float


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

    Args:
        owner: class or function that asks, the first word of the sentence.
        meaning: what the value is, in words.
        value: what the user gave.
        positive: whether it must be above zero.
        not_negative: whether it must be zero or above.
        unit: SI unit to name in the sentence, "" for none.

    Raises:
        InputError: texts, NaN, infinity, truth values and wrong signs.
    """
    wanted = "a finite number"
    if positive:
        wanted = "a finite number above zero"
    elif not_negative:
        wanted = "zero or a positive finite number"
    if unit:
        wanted += f" in {unit}"

    # NaN stands for what is no number, and is refused as such.
    result = real(value)
    too_low = (positive and result <= 0.0) or (not_negative and result < 0.0)
    if too_low or not math.isfinite(result):
        raise InputError(f"{owner}: {meaning} is {quote(value)}; give {wanted}")
    return result


def whole(owner: str, meaning: str, value: Any, *, least: int = 0, most: int | None = None) -> int:
    """Return a whole number as an int; 3.0 counts as one, True does not.

    Args:
        owner: class or function that asks, the first word of the sentence.
        meaning: what the value is, in words.
        value: what the user gave.
        least: smallest number that is allowed.
        most: largest number that is allowed; None for no limit.

    Raises:
        InputError: fractions, numbers beyond the limits, and what is no number.
    """
    result = real(value)
    upper = math.inf if most is None else most
    if not math.isfinite(result) or result != int(result) or not least <= result <= upper:
        limit = "" if most is None else f" and at most {most}"
        raise InputError(
            f"{owner}: {meaning} is {quote(value)}; give a whole number of at least {least}{limit}"
        )
    return int(value)


def check_word(name: str, given: object, known: Sequence[str]) -> None:
    """Raise InputError for a word that is not among those known.

    Args:
        name: what the word chooses, for the sentence.
        given: what the user gave.
        known: the words to choose from.
    """
    if not isinstance(given, str) or given not in known:  # an array compares element by element
        raise InputError(f"unknown {name} {quote(str(given))}: choose one of {', '.join(known)}")


def check_count(
    owner: str, asked: str, value: Any, things: str = "samples", *, most: int = LARGEST
) -> int:
    """Return how many things an input asks for, before memory is taken for them.

    Args:
        owner: class or function that asks, the first word of the sentence.
        asked: the argument that asks for so many, in words.
        value: how many; a float is cut to an int.
        things: what is counted, for the sentence.
        most: largest number that is allowed.

    Raises:
        InputError: more than ``most``, and NaN.
    """
    count = real(value)
    if not count <= most:
        raise InputError(
            f"{owner}: {asked} asks for {count:.3g} {things}, and {most:.3g} are the most; ask for "
            "fewer"
        )
    return int(value)


def flag(owner: str, meaning: str, value: Any) -> bool:
    """Return True or False.

    Args:
        owner: class or function that asks, the first word of the sentence.
        meaning: what the value is, in words.
        value: what the user gave.

    Raises:
        InputError: anything else, 0 and 1 too.
    """
    if isinstance(value, bool | np.bool_):
        return bool(value)
    raise InputError(f"{owner}: {meaning} is {quote(value)}; give True or False")


def function(owner: str, meaning: str, value: Any, remedy: str) -> Any:
    """Return what can be called.

    Args:
        owner: class or function that asks, the first word of the sentence.
        meaning: what the value is, in words.
        value: what the user gave.
        remedy: what to give instead, the end of the sentence.

    Raises:
        InputError: anything else, and a class.
    """
    if callable(value) and not isinstance(value, type):
        return value
    raise InputError(f"{owner}: {meaning} is {quote(value)}; {suggest_object(value)}{remedy}")


def column_name(kind: str, name: Any) -> str:
    """Return a name that columns may carry.

    Raises:
        InputError: the name is not made of letters, digits and underscores alone.
    """
    if isinstance(name, str | int) and re.fullmatch(r"\w+", str(name), re.ASCII):
        return str(name)
    raise InputError(
        f"{kind} {quote(name)}: use letters, digits and underscores for names of columns"
    )


def several(owner: str, meaning: str, value: Any, remedy: str) -> tuple[Any, ...]:
    """Return the members of a list, a tuple or an array as a tuple.

    Args:
        owner: class or function that asks, the first word of the sentence.
        meaning: what the value is, in words.
        value: what the user gave.
        remedy: what to give instead, the end of the sentence.

    Raises:
        InputError: one object, a text or a mapping in its place.
    """
    if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str | bytes):
        return tuple(value)
    raise InputError(f"{owner}: {meaning} is {quote(value)}; {suggest_object(value)}{remedy}")


def instance(
    owner: str, meaning: str, value: Any, kinds: type | tuple[type, ...], remedy: str
) -> Any:
    """Return an object of one of these types.

    Args:
        owner: class or function that asks, the first word of the sentence.
        meaning: what the value is, in words.
        value: what the user gave.
        kinds: the type, or the types, that are allowed.
        remedy: what to give instead, the end of the sentence.

    Raises:
        InputError: a class instead of an object, and anything else.
    """
    if isinstance(value, kinds):
        return value
    raise InputError(f"{owner}: {meaning} is {quote(value)}; {suggest_object(value)}{remedy}")


def provides(
    owner: str,
    meaning: str,
    value: Any,
    names: tuple[str, ...],
    remedy: str,
    *,
    lacks: tuple[str, ...] = (),
) -> Any:
    """Return an object that has the attributes of a protocol, and none of another kind's.

    Args:
        owner: class or function that asks, the first word of the sentence.
        meaning: what the value is, in words.
        value: what the user gave.
        names: attributes that it must have.
        remedy: what to give instead, the end of the sentence.
        lacks: attributes that it must not have, as they tell another kind of object.

    Raises:
        InputError: the object lacks an attribute, or has one of another kind; a class.
    """
    has_all = all(hasattr(value, name) for name in names)
    has_other = any(hasattr(value, name) for name in lacks)
    if has_all and not has_other and not isinstance(value, type):
        return value
    raise InputError(f"{owner}: {meaning} is {quote(value)}; {suggest_object(value)}{remedy}")


def array(
    owner: str, meaning: str, value: Any, shape: tuple[int | None, ...], *, unit: str = ""
) -> Array:
    """Return finite real values as a float array.

    Args:
        owner: class or function that asks, the first word of the sentence.
        meaning: what the values are, in words.
        value: what the user gave.
        shape: the shape that it must have; None stands for any length along an axis.
        unit: SI unit to name in the sentence, "" for none.

    Raises:
        InputError: other shapes, what are no real numbers, NaN and infinite values.
    """
    # The shape in words, as numpy writes it, with "any" for any length.
    lengths = ", ".join("any" if n is None else str(n) for n in shape)
    wanted = f"({lengths},)" if len(shape) == 1 else f"({lengths})"
    unit = f" in {unit}" if unit else ""

    # First the type: numpy raises for lists of different lengths, and makes objects of the rest.
    try:
        raw = np.asarray(value)
        if raw.dtype.kind not in "iuf":
            raise ValueError
        values = raw.astype(float)
    except (TypeError, ValueError):
        raise InputError(
            f"{owner}: {meaning} is {quote(value)}; give real numbers of shape {wanted}{unit}"
        ) from None

    # Then the shape, and last the values, so that the sentence names the first thing to put right.
    if values.ndim != len(shape) or any(
        n is not None and n != m for n, m in zip(shape, values.shape, strict=True)
    ):
        raise InputError(
            f"{owner}: {meaning} has shape {values.shape}; give numbers of shape {wanted}"
        )
    if not np.all(np.isfinite(values)):
        place = tuple(int(i) for i in np.argwhere(~np.isfinite(values))[0])
        raise InputError(f"{owner}: {meaning} is {values[place]} at {place}; give finite numbers")
    return values


def optional(
    check: Callable[..., Any], owner: str, meaning: str, value: Any, *more: Any, **options: Any
) -> None:
    """Check a value that may be left out: nothing is asked of None.

    Args:
        check: a check of this module, called as ``check(owner, meaning, value, …)``.
        owner: class or function that asks, the first word of the sentence.
        meaning: what the value is, in words.
        value: what the user gave.
        more: further positional arguments of the check.
        options: keyword arguments of the check.
    """
    if value is not None:
        check(owner, meaning, value, *more, **options)


def find_shape(value: Any) -> tuple[int, ...]:
    """Return the shape of numbers in lists or arrays.

    Lists of different lengths have no shape; (-1,) stands for it.
    """
    try:
        return np.shape(value)
    except ValueError:
        return (-1,)


def integers(owner: str, meaning: str, value: Any, shape: tuple[int | None, ...]) -> Indices:
    """Return whole numbers as an integer array; 3.0 counts as one.

    Args:
        owner: class or function that asks, the first word of the sentence.
        meaning: what the values are, in words.
        value: what the user gave.
        shape: the shape that it must have; None stands for any length along an axis.

    Raises:
        InputError: fractions, numbers above 2^53, and what ``array`` refuses.
    """
    values = array(owner, meaning, value, shape)
    if np.any(values != np.rint(values)) or np.any(np.abs(values) > LARGEST_WHOLE):
        raise InputError(f"{owner}: {meaning} is {quote(value)}; give whole numbers")
    return values.astype(np.int64)


def mask(owner: str, meaning: str, value: Any, shape: tuple[int, ...]) -> Mask:
    """Return truth values as a boolean array.

    Args:
        owner: class or function that asks, the first word of the sentence.
        meaning: what the values are, in words.
        value: what the user gave.
        shape: the shape that it must have.

    Raises:
        InputError: indices, numbers, texts and other shapes.
    """
    try:
        values = np.asarray(value)
    except ValueError:
        values = np.empty(0)
    if values.dtype == bool and values.shape == shape:
        return values
    defect = f"has shape {values.shape}" if values.dtype == bool else f"is {quote(value)}"
    raise InputError(f"{owner}: {meaning} {defect}; give a boolean mask of shape {shape}")


def path(owner: str, meaning: str, value: Any) -> Path:
    """Return a path.

    Args:
        owner: class or function that asks, the first word of the sentence.
        meaning: what the file is, in words.
        value: what the user gave.

    Raises:
        InputError: what is no path, and an empty one.
    """
    if not isinstance(value, str | Path) or not str(value).strip() or "\0" in str(value):
        raise InputError(f"{owner}: {meaning} is {quote(value)}; give the path of a file")
    return Path(value)


def describe_point(point: Array) -> str:
    """Return a point, or a direction, as words for a sentence: (1, 0.5)."""
    return f"({', '.join(f'{x:g}' for x in point)})"


def quote(value: Any) -> str:
    """Return the value for a sentence: short, on one line, also where its own repr fails."""
    if isinstance(value, type):
        return f"the class {value.__name__}"
    try:
        text = " ".join(repr(value).split())
    except Exception:
        # A foreign repr may raise anything, and Python prints no number of very many digits.
        text = f"an object of type {type(value).__name__}"
    return text if len(text) <= SHOWN else text[: SHOWN - 1] + "…"


def suggest_object(value: Any) -> str:
    """Return the start of a remedy for a class that was given in place of an object, else ""."""
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

    It does not matter which rank has the text. Collective.

    Args:
        defects: texts of this rank, "" for no defect.
        comm: the ranks that are asked.
    """
    # One number tells all ranks whether there is any text; only then are texts sent.
    mine = next((text for text in defects if text), "")
    if largest(comm, bool(mine)):
        texts = comm.bcast(comm.gather(mine))
        raise InputError(next(text for text in texts if text))


def explain_error(name: str, error: Exception) -> str:
    """Return the sentence about an error in a user's function.

    The package's own errors have their sentence; of others it names the kind and the line.

    Args:
        name: the function, in words.
        error: what it has raised.
    """
    frame = traceback.extract_tb(error.__traceback__)[-1]
    place = f"{Path(frame.filename).name}, line {frame.lineno}"
    ending = f"{name} ended in {type(error).__name__}: {error} ({place})"
    if is_of_machine(error):
        return f"{ending}: the machine refused it"
    if isinstance(error, ViContactError):
        return str(error)
    return f"{ending}: correct its function"


def on_all(comm: Comm, name: str, call: Callable[[], T]) -> T:
    """Return what a call of a user's function returns. Collective.

    Args:
        comm: the ranks that call it together.
        name: the function, in words.
        call: calls it.

    Raises:
        InputError: on all ranks, where the call raises on one.
    """
    # The answer stands in a list, as it may be None itself.
    results = []
    failure = None
    try:
        results.append(call())
    except Exception as error:
        # A user's function may raise anything, and the others must not wait for this one.
        failure = error
    defect = "" if failure is None else explain_error(name, failure)
    try:
        refuse([defect], comm)
    except InputError as error:
        # Whoever prints it sees what it came from, such as a lack of memory.
        raise error from failure
    return results[0]
