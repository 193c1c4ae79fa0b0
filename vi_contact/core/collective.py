"""Call what users give on all ranks together, and compare what all ranks must give alike.

On several ranks a function of the user's may fail on one of them: at the points that this rank
owns. The others would wait for it for ever in the next collective call. So there are two ways to
call such a function:

- ``on_all`` (core.checks) calls it and then asks all ranks: for what is called once.
- ``together`` opens a frame. Within it ``users`` calls a function, keeps what it raises, and goes
  on with another value; at the end of the frame all ranks are asked once, however many functions
  were called. This is for every step.

On one rank a frame does nothing, and errors are raised where they happen.
"""

from collections.abc import Callable, Iterator, Mapping, Set
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import fields, is_dataclass
from enum import Enum
from hashlib import sha256
from pathlib import PurePath
from typing import Any, TypeVar

import numpy as np

from .algebra import Comm, from_each, largest
from .checks import ended, shown
from .errors import InputError, StepFailure, ViContactError

T = TypeVar("T")

# what other ranks may raise as it is
KINDS: tuple[type[ViContactError], ...] = (InputError, StepFailure)
DEPTH = 6  # how deep arguments are compared: laws within laws within lists
LONG = 64  # members of a list, from which on it is seen as an array
LOCAL = ("indices", "mesh")  # of groups of cells and facets: each rank has its own
# what ``users`` kept in each of the frames that this process is in
_OPEN: list[list[ViContactError]] = []
_NO_FRAME = nullcontext()  # of one rank, in every step


def together(comm: Comm) -> AbstractContextManager[None]:
    """Open a frame at whose end errors are raised on all ranks.

    These are what ``users`` keeps in it, and what this rank raises. Collective.

    Where ``users`` kept an error, all ranks raise the first of these. Otherwise a rank raises its
    own error, and those without one raise that of the first rank that has one. What is raised
    within the frame between collective calls, and not by a function that ``users`` calls, may still
    leave the others waiting: give it a frame of its own.
    """
    return _NO_FRAME if comm.size == 1 else _frame(comm)


@contextmanager
def _frame(comm: Comm) -> Iterator[None]:
    """Open the frame of ``together`` on several ranks."""
    kept: list[ViContactError] = []
    broken: Exception | None = None
    _OPEN.append(kept)
    try:
        yield
    except Exception as error:
        broken = error
    finally:
        _OPEN.pop()
    if largest(comm, broken is not None or bool(kept)):
        raise _told(comm, kept[0] if kept else None, broken)


def together_if_own(comm: Comm, value: Any) -> AbstractContextManager[None]:
    """Open a frame for calls of a scheme, a solver or a law of the user's own.

    These may raise anywhere.
    """
    if comm.size == 1 or type(value).__module__.startswith("vi_contact."):
        return _NO_FRAME
    return together(comm)


def _told(comm: Comm, kept: ViContactError | None, broken: Exception | None) -> Exception:
    """Return the error that this rank raises when some rank has one. Collective."""
    own: Any = kept or broken
    kind = next((number for number, kind in enumerate(KINDS) if isinstance(own, kind)), None)
    every = from_each(comm, None if own is None else (kept is not None, kind, str(own), repr(own)))
    if own is None or (kept is None and any(one is not None and one[0] for one in every)):
        rank, found = min(
            ((rank, one) for rank, one in enumerate(every) if one is not None),
            key=lambda pair: (not pair[1][0], pair[0]),
        )
        told = (
            ViContactError(f"rank {rank}: {found[3]}")
            if found[1] is None
            else KINDS[found[1]](found[2])
        )
        told.__cause__, own = own, told
    own = getattr(own, "as_it_is", own)
    own.on_all_ranks = True  # all of them raise: what follows may be collective
    error: Exception = own
    return error


def users(name: str, call: Callable[[], T], instead: T, *, as_it_is: bool = False) -> T:
    """Return what a user's function returns.

    Where it raises, InputError says so with its name and
    line: at once, or in a frame of several ranks at its end, and ``instead`` is returned.
    ``as_it_is``: its own rank raises what it has raised, and the other ranks alone that
    InputError.
    """
    try:
        return call()
    except Exception as error:
        if as_it_is and not _OPEN:
            raise
        if as_it_is:
            told: Any = _input_error(name, error)
            told.as_it_is = error
            _OPEN[-1].append(told)
            return instead
        return kept_error(name, error, instead)


def _input_error(name: str, error: Exception) -> ViContactError:
    return error if isinstance(error, ViContactError) else InputError(ended(name, error))


def kept_error(name: str, error: Exception, instead: T) -> T:
    """Raise what a user's function has raised, or keep it for the end of the frame.

    When it is kept, ``instead`` is returned.
    """
    told = _input_error(name, error)
    if not _OPEN:
        raise told from (None if told is error else error)
    _OPEN[-1].append(told)
    return instead


def limit_of(law: Any, r_n: Any, weights: Any, scale: float) -> Any:
    """Return the friction limit of a law (m,), ``users`` for laws of the user's own."""
    return users(
        f"the friction law {type(law).__name__}",
        lambda: law.limit(r_n, weights, scale),
        np.zeros(np.shape(weights)),
    )


def slope_of(law: Any, weights: Any) -> Any:
    """Return the slope of the friction limit of a law (m,), as ``limit_of``."""
    return users(
        f"the friction law {type(law).__name__}",
        lambda: law.slope(weights),
        np.zeros(np.shape(weights)),
    )


def agree(comm: Comm, owner: str, given: Mapping[str, Any]) -> None:
    """Raise InputError on all ranks unless arguments are the same on all of them.

    The error names the first argument that is not the same. Collective.

    Numbers, texts, arrays, and lists and dataclasses of these are compared; of functions and of
    other objects the type alone. ``Parts`` says of which argument each rank may hold its part:
    there lists and arrays are not compared.
    """
    if comm.size == 1:
        return
    own = {
        name: sha256(_described(value, DEPTH).encode()).digest()[:8]
        for name, value in given.items()
    }
    # One reduction of two numbers tells whether all are alike: the largest digest is the smallest
    # one, too.
    # 48 bits: a whole number that a float holds
    whole = sha256(repr(tuple(own.items())).encode()).digest()[:6]
    digest_of_all = float(int.from_bytes(whole, "big"))
    highest, lowest = comm.max(np.array([digest_of_all, -digest_of_all]))
    if highest == -lowest:
        return
    every = from_each(comm, tuple(own.items()))
    for place, (name, digest) in enumerate(every[0]):
        others = [rank for rank, one in enumerate(every) if one[place] != (name, digest)]
        if others:
            texts = from_each(comm, shown(given[name]))
            theirs = texts[others[0]]
            apart = (
                f"is {texts[0]} on rank 0 and {theirs}"
                if theirs != texts[0]
                else "is not the same on rank 0 and"
            )
            ranks = (
                f"rank {others[0]}" if len(others) == 1 else "ranks " + ", ".join(map(str, others))
            )
            raise InputError(f"{owner}: {name} {apart} on {ranks}; give the same on all ranks")


class Parts:
    """Wrap an argument of which each rank may hold its part.

    Its tuples, lists and arrays are not compared.
    """

    def __init__(self, value: Any) -> None:
        self.value = value

    def __repr__(self) -> str:
        return repr(self.value)


def _described(value: Any, depth: int, parts: bool = False) -> str:
    """Return a text that is the same on all ranks where the argument is."""
    kind = f"{type(value).__module__}.{type(value).__qualname__}"
    if isinstance(value, Parts):
        return _described(value.value, depth, parts=True)
    if isinstance(value, Enum):
        return str(value)
    if value is None or isinstance(value, bool | np.bool_ | str | bytes | PurePath):
        return repr(str(value))
    if isinstance(value, int | float | complex | np.number):
        number: Any = value
        return repr(complex(number)) if abs(number) < 2.0**53 else repr(number)
    if depth == 0:
        return kind
    if isinstance(value, Mapping):
        return kind + str(
            [(str(key), _described(one, depth - 1, parts)) for key, one in value.items()]
        )
    if isinstance(value, Set):
        return kind + str(sorted(_described(one, depth - 1, parts) for one in value))
    if isinstance(value, list | tuple | np.ndarray):
        return "several" if parts else _of_many(value, depth)
    if is_dataclass(value) and not isinstance(value, type):
        return kind + str(
            [
                (one.name, _described(getattr(value, one.name, None), depth - 1, parts))
                for one in fields(value)
                if one.compare and one.name not in LOCAL
            ]
        )
    return kind if not isinstance(value, type) else f"{value.__module__}.{value.__qualname__}"


def _of_many(value: Any, depth: int) -> str:
    """Return a text of the members of a list or array, short where they are many numbers."""
    if (
        isinstance(value, np.ndarray)
        or len(value) > LONG
        and isinstance(value[0], int | float | np.number)
    ):
        try:
            numbers = np.asarray(value, dtype=float) + 0.0
        except (TypeError, ValueError):  # no real numbers, or lists of different lengths
            numbers = None
        if numbers is not None:
            return f"{numbers.shape} {sha256(numbers.tobytes()).hexdigest()}"
    return str(
        [_described(one, depth - 1) for one in np.ravel(value)]
        if isinstance(value, np.ndarray)
        else [_described(one, depth - 1) for one in value]
    )
