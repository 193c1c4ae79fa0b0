"""Simulate several runs of one body at once.

Each is recorded in its own folder as ``simulate`` does.
"""

import time
from collections.abc import Callable, Generator, Hashable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from inspect import signature
from pathlib import Path
from typing import Any

from ..core.checks import several
from ..core.errors import InputError, Interrupted, ViContactError
from .files.log import turn_of
from .request import RunRequest
from .session import Session
from .simulate import open_run, simulate
from .solution import Solution
from .stop_signals import StopSignals
from .together import Together, grouped

Ended = tuple[int, Solution | ViContactError]


def simulate_many(
    runs: Sequence[Mapping[str, Any]], *, tell: Callable[[float], None] = lambda share: None
) -> Iterator[Ended]:
    """Yield (number of the run, its solution) as the runs end.

    Each is given by the arguments of ``simulate``.

    A run that fails yields its error instead, and the others go on; what cannot begin is told
    before the first step. Runs of one body step together, which costs less than one after the
    other: ``march_many`` says which can. The others are made one by one at the end. Every run has
    recorders and a folder of its own; its numbers are those of ``simulate`` to round-off, whatever
    the company. In the place of progress lines ``tell`` gets the share of all steps that is done,
    after every step. Collective.

    Raises InputError for arguments that ``simulate`` does not know; Interrupted and OutOfTime as
    ``simulate`` does, when all runs that have begun have written their checkpoints:
    ``restart=True`` continues them.
    """
    given = several("simulate_many", "runs", runs, "give a list of arguments of simulate")
    requests = [_request(run) for run in given]
    recorders: list[int] = []
    folders: list[Path] = []
    for request in requests:
        # What is no list of recorders or no path is refused when the run is opened.
        if isinstance(request.record, Sequence):
            recorders += map(id, request.record)
        if isinstance(request.out, str | Path):
            folders.append(Path(request.out).resolve())
    _refuse_shared("recorder", recorders)
    _refuse_shared("folder", folders)
    return _in_turn(requests, tell)


def _refuse_shared(kind: str, things: Sequence[Hashable]) -> None:
    """Raise InputError when two runs have one of these things."""
    if len(set(things)) < len(things):
        raise InputError(
            f"simulate_many: two runs have one {kind}, which keeps results of one: give each "
            "its own"
        )


def _request(run: Mapping[str, Any]) -> RunRequest:
    """Return the request of a call of ``simulate`` with these arguments, without progress line.

    The names are the user's, so the signature of ``simulate`` says here which are known and what is
    meant by those that are left out.
    """
    try:
        bound = signature(simulate).bind(**run)
    except TypeError as error:
        raise InputError(
            f"simulate_many: {error}; give the arguments of simulate for every run"
        ) from None
    bound.apply_defaults()
    return replace(RunRequest(**bound.arguments), progress=False)


@dataclass
class _Turn:
    """One of the runs that take turns."""

    number: int
    session: Session
    loop: Together
    steps: Generator[Solution | None, None, None]
    begun: bool = False

    def step(self) -> Solution | ViContactError | Interrupted | None:
        """Make a base step; what the run has ended with, None when it goes on."""
        self.begun = True
        with turn_of(self):
            try:
                return next(self.steps)
            except (ViContactError, Interrupted) as error:
                return error

    def close(self) -> None:
        """End a run that nobody waits for any more, with its checkpoint."""
        with turn_of(self):
            self.steps.close()
        self.session.last = self.session.loop = (
            None  # the matrices of one that has ended serve nobody
        )
        self.loop.prepared.clear()


def _in_turn(requests: Sequence[RunRequest], tell: Callable[[float], None]) -> Iterator[Ended]:
    """Make a base step of every run in turn, until all have ended."""
    going: list[_Turn] = []
    stopped: Interrupted | None = None
    with StopSignals(lasting=True) as signals, ExitStack() as stack:
        for number, request in enumerate(requests):
            others = [turn.session.method.problem for turn in going]
            try:
                session, writer = stack.enter_context(
                    open_run(request, others=others, runs=len(requests))
                )
            except ViContactError as error:
                yield number, error
                continue
            place = session.place
            loop = session.loop = Together(
                session.method, session.step_plan, place.state, place.base, place.halved
            )
            going.append(_Turn(number, session, loop, session.steps(writer, signals)))
            stack.callback(going[-1].close)
        grouped([one.loop for one in going])
        made, total = 0, sum(one.session.left for one in going)
        while going:
            begin = time.perf_counter()
            group = going[0].loop.group  # one alone may need much memory: one after the other
            ends = [
                (one, one.step())
                for one in going
                if one is going[0] or (group and one.loop.group is group)
            ]
            made += len(ends)
            tell(min(made / max(total, 1), 1.0))
            for one, end in ends:
                if end is None:  # what was done in the turn of one was done for all
                    one.session.seconds[-1] = (time.perf_counter() - begin) / len(ends)
                    continue
                one.loop.leave()
                one.close()
                going.remove(one)
                if isinstance(end, Interrupted):
                    stopped = end
                    going = [other for other in going if other.begun]
                else:
                    yield one.number, end
        if stopped is not None:
            raise stopped
