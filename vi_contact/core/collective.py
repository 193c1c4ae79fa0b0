"""Call what users give on all ranks together, and compare what all ranks must give alike.

On several ranks a function of the user's may fail on one of them: at the points that this rank
owns. The others would wait for it for ever in the next collective call. So there are two ways to
call such a function:

- ``on_all`` (core.checks) calls it and then asks all ranks: for what is called once.
- ``together`` opens a frame. Within it ``call_user`` calls a function, keeps what it raises, and
  goes on with another value; at the end of the frame all ranks are asked once, however many
  functions were called. This is for every step.

On one rank a frame does nothing, and errors are raised where they happen.
"""

from collections.abc import Callable, Iterator, Mapping, Set
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import fields, is_dataclass
from enum import Enum
from hashlib import sha256
from pathlib import PurePath
from typing import Any, NamedTuple, TypeVar, cast

import numpy as np

from .algebra import Comm, from_each, largest
from .checks import explain_error, quote
from .errors import InputError, StepFailure, ViContactError

T = TypeVar("T")

# Errors that are the same on another rank: others are named there as text.
SHARED_KINDS: tuple[type[ViContactError], ...] = (InputError, StepFailure)
DEPTH = 6  # how deep arguments are compared: laws within laws within lists
LONG = 64  # members of a list, from which on it is seen as an array
LOCAL_FIELDS = ("indices", "mesh")  # of groups of cells and facets: each rank has its own
# Whole numbers above it are no floats, so that comparing them as floats would take two for one.
EXACT = 2.0**53
# What ``call_user`` kept in each of the frames that this process is in.
_OPEN: list[list[ViContactError]] = []
_NO_FRAME = nullcontext()  # of one rank, in every step


def together(comm: Comm) -> AbstractContextManager[None]:
    """Open a frame at whose end errors of any rank are raised on all ranks. Collective.

    Where ``call_user`` kept an error, all ranks raise the first of these. Otherwise a rank raises
    its own error, and those without one raise that of the first rank that has one. What is raised
    within the frame between collective calls, and not by a function that ``call_user`` calls, may
    still leave the others waiting: give it a frame of its own.
    """
    return _NO_FRAME if comm.size == 1 else _frame(comm)


@contextmanager
def _frame(comm: Comm) -> Iterator[None]:
    """Open the frame of ``together`` on several ranks."""
    errors: list[ViContactError] = []  # what ``call_user`` keeps
    broken: Exception | None = None
    _OPEN.append(errors)
    try:
        yield
    except Exception as error:
        broken = error
    finally:
        _OPEN.pop()
    if largest(comm, broken is not None or bool(errors)):
        raise _choose_error(comm, errors[0] if errors else None, broken)


def together_if_own(comm: Comm, value: Any) -> AbstractContextManager[None]:
    """Open a frame for calls of a scheme, a solver or a law of the user's own.

    What is the user's own may raise anywhere; the package's own needs no frame.
    """
    is_own = not type(value).__module__.startswith("vi_contact.")
    return together(comm) if is_own else _NO_FRAME


class _RankError(NamedTuple):
    """Tell the other ranks of an error."""

    kept: bool  # whether ``call_user`` kept it, and not a rank broke off
    kind: int | None  # its place in SHARED_KINDS; None for others
    text: str
    repr: str


def _choose_error(comm: Comm, kept: ViContactError | None, broken: Exception | None) -> Exception:
    """Return the error that this rank raises when some rank has one. Collective.

    Args:
        comm: the ranks of the frame.
        kept: the first error that ``call_user`` kept on this rank.
        broken: what ended the frame on this rank.
    """
    # Tell the other ranks of the error of this one, in texts: not every error can be sent.
    error: Any = kept or broken
    message = None
    if error is not None:
        kinds = [number for number, kind in enumerate(SHARED_KINDS) if isinstance(error, kind)]
        kind = kinds[0] if kinds else None
        message = _RankError(kept is not None, kind, str(error), repr(error))
    messages = from_each(comm, message)
    errors = [(rank, answer) for rank, answer in enumerate(messages) if answer is not None]

    # Kept errors come before others, and lower ranks before higher ones.
    rank, first = min(errors, key=lambda pair: (not pair[1].kept, pair[0]))
    if error is None or (kept is None and first.kept):
        foreign: Any = ViContactError(f"rank {rank}: {first.repr}")
        if first.kind is not None:
            foreign = SHARED_KINDS[first.kind](first.text)
        foreign.__cause__ = error
        error = foreign
    chosen: Any = getattr(error, "as_it_is", error)
    chosen.on_all_ranks = True  # all of them raise: what follows may be collective
    return cast(Exception, chosen)


def call_user(name: str, call: Callable[[], T], instead: T, *, as_it_is: bool = False) -> T:
    """Return what a user's function returns.

    Where the function raises, an InputError says so with its name and line: at once, or at the end
    of a frame of several ranks.

    Args:
        name: the function, in words.
        call: calls it.
        instead: what is returned in a frame where it raises.
        as_it_is: whether its own rank raises what the function has raised, and the other ranks
            alone that InputError.
    """
    try:
        return call()
    except Exception as error:
        if not as_it_is:
            return keep_error(name, error, instead)
        if not _OPEN:
            raise
        wrapped: Any = _as_input_error(name, error)
        wrapped.as_it_is = error
        _OPEN[-1].append(wrapped)
        return instead


def _as_input_error(name: str, error: Exception) -> ViContactError:
    """Return an error of the package as it is, and any other as an InputError with its line."""
    return error if isinstance(error, ViContactError) else InputError(explain_error(name, error))


def keep_error(name: str, error: Exception, instead: T) -> T:
    """Raise what a user's function has raised, or keep it for the end of the frame.

    Args:
        name: the function, in words.
        error: what it has raised.
        instead: what is returned when the error is kept.
    """
    wrapped = _as_input_error(name, error)
    if not _OPEN:
        raise wrapped from (None if wrapped is error else error)
    _OPEN[-1].append(wrapped)
    return instead


def ask_limit(law: Any, r_n: Any, weights: Any, scale: float) -> Any:
    """Return the friction limit of a law (m,), by ``call_user`` as the law may be the user's own.

    Args:
        law: a ``core.protocols.FrictionLaw``.
        r_n: normal reactions (m,), ``scale`` times newtons.
        weights: tributary areas (m,) [m²].
        scale: how many times newtons the reactions of the step are.
    """
    return call_user(
        f"the friction law {type(law).__name__}",
        lambda: law.limit(r_n, weights, scale),
        np.zeros(np.shape(weights)),
    )


def ask_slope(law: Any, weights: Any) -> Any:
    """Return the slope of the friction limit of a law (m,), as ``ask_limit`` does."""
    return call_user(
        f"the friction law {type(law).__name__}",
        lambda: law.slope(weights),
        np.zeros(np.shape(weights)),
    )


def agree(comm: Comm, owner: str, given: Mapping[str, Any]) -> None:
    """Raise InputError on all ranks unless arguments are the same on all of them. Collective.

    Numbers, texts, arrays, and lists and dataclasses of these are compared; of functions and of
    other objects the type alone. ``Parts`` says of which argument each rank may hold its part:
    there lists and arrays are not compared.

    Args:
        comm: the ranks that are compared.
        owner: class or function that asks, the first word of the sentence.
        given: name -> argument.
    """
    if comm.size == 1:
        return
    texts = {name: _describe(value, DEPTH) for name, value in given.items()}
    digest_of = {name: sha256(text.encode()).digest()[:8] for name, text in texts.items()}

    # One reduction of two numbers tells whether all are alike: the largest digest is the smallest
    # one, too. 48 bits are a whole number that a float holds.
    whole = sha256(repr(tuple(digest_of.items())).encode()).digest()[:6]
    digest_of_all = float(int.from_bytes(whole, "big"))
    highest, lowest = comm.max(np.array([digest_of_all, -digest_of_all]))
    if highest == -lowest:
        return

    # Otherwise find the first argument that is not the same, and the ranks on which it is not.
    digests = from_each(comm, tuple(digest_of.items()))
    for place, (name, digest) in enumerate(digests[0]):
        apart = [rank for rank, theirs in enumerate(digests) if theirs[place] != (name, digest)]
        if apart:
            # Long values may be quoted alike and differ all the same.
            values = from_each(comm, quote(given[name]))
            difference = "is not the same on rank 0 and"
            if values[apart[0]] != values[0]:
                difference = f"is {values[0]} on rank 0 and {values[apart[0]]}"
            ranks = "ranks " + ", ".join(map(str, apart))
            if len(apart) == 1:
                ranks = f"rank {apart[0]}"
            raise InputError(f"{owner}: {name} {difference} on {ranks}; give the same on all ranks")


class Parts:
    """Wrap an argument of which each rank may hold its part.

    Its tuples, lists and arrays are not compared.
    """

    def __init__(self, value: Any) -> None:
        self.value = value

    def __repr__(self) -> str:
        return repr(self.value)


def _describe(value: Any, depth: int, parts: bool = False) -> str:
    """Return a text that is the same on all ranks where the argument is.

    Args:
        value: the argument, or a part of it.
        depth: how many levels of parts are looked at, from here on.
        parts: whether each rank may hold its part of lists and arrays.
    """
    kind = f"{type(value).__module__}.{type(value).__qualname__}"

    # Single values: their text, where 1 and 1.0 are the same number.
    if isinstance(value, Parts):
        return _describe(value.value, depth, parts=True)
    if isinstance(value, Enum):
        return str(value)
    if value is None or isinstance(value, bool | np.bool_ | str | bytes | PurePath):
        return repr(str(value))
    if isinstance(value, int | float | complex | np.number):
        number: Any = value
        return repr(complex(number)) if abs(number) < EXACT else repr(number)

    # Values made of others: the texts of these; of functions and all other objects the type.
    if depth == 0:
        return kind
    if isinstance(value, list | tuple | np.ndarray):
        return "several" if parts else _describe_members(value, depth)
    members = _members_of(value)
    if isinstance(value, Set):
        return kind + str(sorted(_describe(member, depth - 1, parts) for member in value))
    if members is not None:
        texts = [(name, _describe(member, depth - 1, parts)) for name, member in members]
        return kind + str(texts)
    return kind if not isinstance(value, type) else f"{value.__module__}.{value.__qualname__}"


def _members_of(value: Any) -> list[tuple[str, Any]] | None:
    """Return the members of a mapping or a dataclass, each with its name; None of others."""
    if isinstance(value, Mapping):
        return [(str(key), member) for key, member in value.items()]
    if is_dataclass(value) and not isinstance(value, type):
        names = [f.name for f in fields(value) if f.compare and f.name not in LOCAL_FIELDS]
        return [(name, getattr(value, name, None)) for name in names]
    return None


def _describe_members(value: Any, depth: int) -> str:
    """Return a text of the members of a list or array, short where they are many numbers."""
    is_array = isinstance(value, np.ndarray)
    if is_array or (len(value) > LONG and isinstance(value[0], int | float | np.number)):
        try:
            numbers = np.asarray(value, dtype=float) + 0.0
        except (TypeError, ValueError):  # no real numbers, or lists of different lengths
            numbers = None
        if numbers is not None:
            return f"{numbers.shape} {sha256(numbers.tobytes()).hexdigest()}"
    members = np.ravel(value) if is_array else value
    return str([_describe(member, depth - 1) for member in members])
