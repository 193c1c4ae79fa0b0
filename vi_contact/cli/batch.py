"""Make runs of one case that differ in what shakes them, in one process: what ``ida`` starts.

The one argument is a JSON object: "case", the file; "settings", "folders" and "restart", an entry for each run; "allow"
and "wall_time" as of ``vi-contact run``. Lines of JSON tell how a run ended, {"ended": its number, "status", "said"},
and now and then {"share": of the steps that are done}.
"""

import json
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from ..core.errors import ViContactError
from ..run.simulate_many import Ended, simulate_many
from ..studies.cases.case import Case, read_case
from ..studies.cases.vocabulary import Parts
from .entry import status_of
from .errors import told, world

SECONDS = 5.0  # between two shares


@dataclass(frozen=True)
class OneCase:
    """Hold a run: its number and folder, its case, and how it begins and ends."""

    number: int
    case: Case
    folder: Path
    more: dict[str, Any]


def results(asked: Mapping[str, Any], comm: Any, tell: Callable[[float], None]) -> Iterator[Ended]:
    """Yield (number, solution or error) as the runs end; those of a body that serves all excitations go together."""
    runs: list[OneCase] = []
    for number, (settings, folder, restart) in enumerate(
        zip(asked["settings"], asked["folders"], asked["restart"], strict=True)
    ):
        try:
            case = told(partial(read_case, asked["case"], settings, allow=asked["allow"]), {})
            told(case.check, {})
        except ViContactError as error:
            yield number, error
        else:
            more = {"restart": restart, "wall_time": asked["wall_time"]}
            runs.append(OneCase(number, case, Path(folder), more))
    parts = runs[0].case.parts(comm) if runs else None
    if parts is not None and parts.steady:
        yield from _together(runs, parts, tell)
        return
    for done, one in enumerate(runs, start=1):
        try:
            yield one.number, one.case.run(comm, out=one.folder, progress=False, **one.more)
        except ViContactError as error:
            yield one.number, error
        tell(done / len(runs))


def _together(runs: Sequence[OneCase], parts: Parts, tell: Callable[[float], None]) -> Iterator[Ended]:
    """Make runs of one body, which begin at rest in the same state."""
    state, calls = None, []
    with ExitStack() as stack:
        for one in runs:
            calls.append(stack.enter_context(one.case.call(parts, one.folder, state)) | one.more)
            state = calls[0]["state"]
        for place, ended in simulate_many(calls, tell=tell):
            yield runs[place].number, ended


class Shares:
    """Print the share of the steps that is done, now and then."""

    def __init__(self) -> None:
        self._told = time.monotonic()

    def tell(self, share: float) -> None:
        """Print this share, unless one has just been told."""
        if time.monotonic() > self._told + SECONDS:
            self._told = time.monotonic()
            _print({"share": share})


def _print(line: Mapping[str, Any]) -> None:
    if world().rank == 0:
        print(json.dumps(line), flush=True)


def main() -> None:
    """Make the runs of the argument and tell of each."""
    import mpi4py.MPI  # noqa: F401

    for number, ended in results(json.loads(sys.argv[1]), world(), Shares().tell):
        error = isinstance(ended, ViContactError)
        _print({"ended": number, "status": int(error), "said": f"vi-contact: {ended}" if error else ""})


if __name__ == "__main__":
    raise SystemExit(status_of(main))
