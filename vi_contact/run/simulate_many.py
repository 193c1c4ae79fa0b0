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
from .files.log import give_turn
from .request import RunRequest
from .session import Session
from .simulate import open_run, simulate
from .solution import Solution
from .stop_signals import StopSignals
from .together import Together, group_runs

Ended = tuple[int, Solution | ViContactError]


def simulate_many(
    runs: Sequence[Mapping[str, Any]], *, tell: Callable[[float], None] = lambda share: None
) -> Iterator[Ended]:
    """Yield (number of the run, its solution) as the runs end. Collective.

    A run that fails yields its error instead, and the others go on; what cannot begin is told
    before the first step. Runs of one body step together, which costs less than one after the
    other: ``march_many`` says which can. The others are made one by one at the end. Every run has
    recorders and a folder of its own; its numbers are those of ``simulate`` to round-off, whatever
    the company.

    Args:
        runs: the arguments of ``simulate`` for each, by name.
        tell: it gets the share of all steps that is done, after every step, in the place of
            progress lines.

    Raises:
        InputError: arguments that ``simulate`` does not know, or a recorder or folder of two runs.
        Interrupted, OutOfTime: as of ``simulate``, when all runs that have begun have written their
            checkpoints: ``restart=True`` continues them.
    """
    # Check the arguments that runs must not share, before one is opened.
    checked = several("simulate_many", "runs", runs, "give a list of arguments of simulate")
    requests = [_make_request(run) for run in checked]
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
    return _simulate_in_turn(requests, tell)


def _refuse_shared(kind: str, things: Sequence[Hashable]) -> None:
    """Raise InputError when two runs have one of these things."""
    if len(set(things)) < len(things):
        raise InputError(
            f"simulate_many: two runs have one {kind}, which keeps results of one: give each "
            "its own"
        )


def _make_request(run: Mapping[str, Any]) -> RunRequest:
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
    """Hold one of the runs that take turns.

    Attributes:
        number: of the run in the list of all.
        session: the run.
        loop: its steps.
        steps: the generator of its base steps, which yields its solution in the end.
        begun: whether a step has been made.
    """

    number: int
    session: Session
    loop: Together
    steps: Generator[Solution | None, None, None]
    begun: bool = False

    def step(self) -> Solution | ViContactError | Interrupted | None:
        """Make a base step; return what the run has ended with, None when it goes on."""
        self.begun = True
        with give_turn(self):
            try:
                return next(self.steps)
            except (ViContactError, Interrupted) as error:
                return error

    def close(self) -> None:
        """End a run that nobody waits for any more, with its checkpoint."""
        with give_turn(self):
            self.steps.close()
        # the matrices of a run that has ended serve nobody
        self.session.last = None
        self.session.loop = None
        self.loop.prepared.clear()
        self.loop.joints.clear()


def _simulate_in_turn(
    requests: Sequence[RunRequest], tell: Callable[[float], None]
) -> Iterator[Ended]:
    """Make a base step of every run in turn, until all have ended.

    Args:
        requests: of the runs.
        tell: gets the share of all steps that is done.
    """
    going: list[_Turn] = []
    stopped: Interrupted | None = None  # the first error that ends all runs
    with StopSignals(lasting=True) as signals, ExitStack() as stack:
        # Open all runs; whatever ends this function closes each of them, with its checkpoint.
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
            loop = Together(
                session.method, session.step_plan, place.state, place.base, place.halved
            )
            session.loop = loop
            going.append(_Turn(number, session, loop, session.steps(writer, signals)))
            stack.callback(going[-1].close)

        # Runs of one body get into groups, and base steps are made until no run is left.
        group_runs([turn.loop for turn in going])
        made = 0
        total = sum(turn.session.left for turn in going)
        while going:
            begin = time.perf_counter()
            # The runs of one group step together. Runs alone go one after the other, not in turns:
            # each may need much memory. So do those that leave the group while others step.
            first = going[0]
            group = first.loop.group
            turns: list[_Turn] = []
            ends: list[Solution | ViContactError | Interrupted | None] = []
            for turn in going:
                if turn is first or (group and turn.loop.group is group):
                    turns.append(turn)
                    ends.append(turn.step())
            made += len(turns)
            tell(min(made / max(total, 1), 1.0))

            # Who has ended leaves its group. A signal, or the end of the wall time, ends those too
            # that have begun, each in its turn; the others never begin.
            for turn, end in zip(turns, ends, strict=True):
                if end is None:  # what was done in the turn of one run was done for all
                    turn.session.seconds[-1] = (time.perf_counter() - begin) / len(turns)
                    continue
                turn.loop.leave()
                turn.close()
                going.remove(turn)
                if isinstance(end, Interrupted):
                    stopped = end
                    going = [other for other in going if other.begun]
                else:
                    yield turn.number, end
        if stopped is not None:
            raise stopped
