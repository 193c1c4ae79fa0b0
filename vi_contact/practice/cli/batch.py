"""Make runs of one case that differ in what shakes them, in one process: what ``ida`` starts.

The one argument is a JSON object: "case", the file; "settings", "folders" and "restart", an entry
for each run; "allow" and "wall_time" as of ``vi-contact run``. Lines of JSON tell how a run ended,
{"ended": its number, "status", "said"}, and now and then {"share": of the steps that are done}.
"""

import json
import sys
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from functools import partial
from pathlib import Path
from typing import Any

from ...core.errors import ViContactError
from ...core.step import State
from ...run.simulate_many import Ended, simulate_many
from ..studies.cases.case import Case, read_case
from ..studies.cases.sentences import write_for_case_files
from ..studies.cases.stages import run_leading_stages
from ..studies.cases.vocabulary import Parts
from .entry import status_of
from .errors import explain_errors, world

Runs = dict[int, tuple[Case, dict[str, Any]]]  # by number, with arguments of Case.run
SECONDS = 5.0  # between two shares


def make_runs(
    asked: Mapping[str, Any], comm: Any, tell: Callable[[float], None]
) -> Iterator[Ended]:
    """Make the runs that are asked for.

    Those of a body that serves all excitations go together. Collective.

    Args:
        asked: the JSON object of the module's docstring.
        comm: MPI's communicator.
        tell: called with the share of the steps that are done.

    Yields:
        (number, solution or error) as the runs end.
    """
    runs: Runs = {}
    entries = zip(asked["settings"], asked["folders"], asked["restart"], strict=True)
    for number, (settings, folder, restart) in enumerate(entries):
        reading = partial(read_case, asked["case"], settings, allow=asked["allow"])
        try:
            case = explain_errors(reading, {})
            explain_errors(case.check, {})
        except ViContactError as error:
            yield number, error
        else:
            runs[number] = (
                case,
                {"out": Path(folder), "restart": restart, "wall_time": asked["wall_time"]},
            )
    if not runs:
        return

    # The stages before the one that differs are run once, for all.
    case, _ = next(iter(runs.values()))
    reached, parts, state = run_leading_stages(case, comm)
    if parts.steady and (reached is None or reached.number == len(case.stages) - 1):
        yield from _make_runs_together(runs, parts, state, tell)
        return
    for count, (number, (case, more)) in enumerate(runs.items(), start=1):
        try:
            yield number, case.run(comm, progress=False, reached=reached, **more)
        except ViContactError as error:
            yield number, error
        tell(count / len(runs))


def _make_runs_together(
    runs: Runs, parts: Parts, state: State | None, tell: Callable[[float], None]
) -> Iterator[Ended]:
    """Make runs of one body, which begin at rest in the same state; None: that of the first one."""
    numbers = list(runs)
    calls = []
    with ExitStack() as stack:
        for case, more in runs.values():
            calls.append(stack.enter_context(case.call(parts, more["out"], state)) | more)
            state = calls[0]["state"]
        for place, ended in simulate_many(calls, tell=tell):
            yield numbers[place], ended


def _print(line: Mapping[str, Any]) -> None:
    """Print an object as a line of JSON, on the first rank."""
    if world().rank == 0:
        print(json.dumps(line), flush=True)


def main() -> None:
    """Make the runs of the argument and tell of each."""
    import mpi4py.MPI  # noqa: F401

    last = time.monotonic()  # when the share was printed

    def tell(share: float) -> None:
        nonlocal last
        if time.monotonic() > last + SECONDS:
            last = time.monotonic()
            _print({"share": share})

    for number, ended in make_runs(json.loads(sys.argv[1]), world(), tell):
        failed = isinstance(ended, ViContactError)
        sentence = f"vi-contact: {write_for_case_files(str(ended))}" if failed else ""
        _print({"ended": number, "status": int(failed), "said": sentence})


if __name__ == "__main__":
    raise SystemExit(status_of(main))
