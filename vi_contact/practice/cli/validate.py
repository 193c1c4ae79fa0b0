"""``vi-contact validate``: compute entries of the validation book, and judge them."""

import argparse
import sys
import time
from typing import TYPE_CHECKING, Any

from ...core.errors import ViContactError
from ...core.files import to_json
from .errors import say, world
from .options import add_command

if TYPE_CHECKING:
    from ...validation.runner import Outcome


def add_validate_command(commands: Any) -> None:
    """Add ``validate`` to the commands of the top parser."""
    validate = add_command(
        commands,
        "validate",
        _validate,
        help="compare the package with experiments and published numbers, and judge it by limits",
    )
    validate.add_argument(
        "names",
        metavar="NAME",
        nargs="*",
        help="entries of the validation book, or folders of others (default: all of the book)",
    )
    validate.add_argument(
        "--list", action="store_true", help="print the names and titles of the entries, and stop"
    )
    setting = validate.add_mutually_exclusive_group()
    setting.add_argument("--fine", action="store_true", help="take finer meshes and shorter steps")
    setting.add_argument(
        "--smallest", action="store_true", help="take the smallest settings, those of the tests"
    )
    validate.add_argument(
        "--mutants",
        action="store_true",
        help=(
            "compute every entry with each of its wrong inputs too, at the smallest setting: they "
            "must be noticed"
        ),
    )
    validate.add_argument(
        "--json", action="store_true", help="print one JSON list with all figures, and no text"
    )
    validate.add_argument(
        "--out", metavar="DIR", help="write report.csv, report.pdf and pictures there"
    )
    validate.add_argument("--quiet", action="store_true", help="print no progress")


def _validate(options: argparse.Namespace) -> str:
    import mpi4py.MPI  # noqa: F401  # first: ``world`` finds it

    from ...validation.entry import entry_names, find_entry, read_entry  # late
    from ...validation.report import write_report
    from ...validation.results import estimate_seconds, read_results

    names = options.names or entry_names()
    for name in names:
        find_entry(name)  # a name that is none is told before anything is computed
    if options.list:
        titles = [f"{name:<16} {read_entry(name).title}" for name in names]
        return "\n".join(titles) if world().rank == 0 else ""
    setting = "coarse"
    if options.fine or options.smallest:
        setting = "fine" if options.fine else "smallest"
    stored = read_results(setting)
    progress = _Progress({name: estimate_seconds(name, stored) for name in names}, options.quiet)
    outcomes = []
    mutants: dict[str, dict[str, bool]] = {}
    for name in names:
        progress.tell(name)
        outcome = _judge(options, name, setting, stored)
        outcomes.append(outcome)
        mutants[outcome.name] = _judge_mutants(options, name, outcome) if options.mutants else {}
        progress.finish(name)

    if options.out is not None and world().rank == 0:
        paths = write_report(options.out, outcomes)
        _print(options, "written: " + ", ".join(map(str, paths)))
    if options.json and world().rank == 0:
        objects = [_as_object(one) | {"mutants": mutants[one.name]} for one in outcomes]
        say(to_json(objects))
    _refuse_failed(outcomes, mutants)
    skipped = sum(outcome.status == "skip" for outcome in outcomes)
    _print(options, f"{len(outcomes) - skipped} entries within their limits, {skipped} skipped")
    return ""


def _judge(options: argparse.Namespace, name: str, setting: str, stored: Any) -> "Outcome":
    """Compute an entry, print what came of it, and return it.

    Args:
        options: of the command.
        name: of the entry.
        setting: "smallest", "coarse" or "fine".
        stored: rows of the last run of the book.
    """
    from ...validation.report import describe
    from ...validation.results import find_moved
    from ...validation.runner import run_entry

    outcome = run_entry(name, setting=setting)
    _print(options, describe(outcome))
    for sentence in find_moved(outcome, stored):
        _print(options, f"  moved  {sentence}")
    return outcome


def _judge_mutants(options: argparse.Namespace, name: str, outcome: "Outcome") -> dict[str, bool]:
    """Compute the mutants of an entry, print what came of each; return which were noticed."""
    from ...validation.runner import judge_mutant

    mutants = () if outcome.entry is None else outcome.entry.mutants
    verdicts = {}
    for mutant in mutants:
        verdicts[mutant.name], changed = judge_mutant(name, mutant)
        words = "noticed" if verdicts[mutant.name] else "NOT NOTICED"
        fails = ", ".join(changed.failed) or " ".join(changed.why)
        _print(options, f"  mutant {words}: {mutant.name}: {fails}")
    return verdicts


def _refuse_failed(outcomes: list["Outcome"], mutants: dict[str, dict[str, bool]]) -> None:
    """Raise ViContactError where an entry has failed, or a mutant was not noticed."""
    reasons = [outcome.why[0] for outcome in outcomes if outcome.status == "fail"]
    failed = len(reasons)
    for name, verdicts in mutants.items():
        for mutant, noticed in verdicts.items():
            if not noticed:
                reasons.append(f"{name}: mutant '{mutant}' was not noticed")
    if reasons:
        raise ViContactError(
            f"{failed} of {len(outcomes)} entries have failed, and {len(reasons) - failed} mutants "
            f"were not noticed; the first: {reasons[0]}"
        )


def _print(options: argparse.Namespace, text: str) -> None:
    """Print a text on the first rank, unless JSON is asked for."""
    if world().rank == 0 and not options.json:
        say(text)


def _as_object(outcome: "Outcome") -> dict[str, Any]:
    """Return an outcome as JSON has it."""
    from ...validation.results import rows_of

    rows = rows_of(outcome) if outcome.judgements else []
    shared = ("entry", "setting", "seconds", "unknowns", "certificate", "energy_defect")
    figures = []
    for row in rows:
        figures.append({key: value for key, value in row.items() if key not in shared})
    found = outcome.found
    series = {}
    for name, one in outcome.agreements.items():
        series[name] = dict(vars(one))
    return {
        "entry": outcome.name,
        "setting": outcome.setting,
        "status": outcome.status,
        "why": list(outcome.why),
        "seconds": outcome.seconds,
        "unknowns": None if found is None else found.unknowns,
        "certificate": None if found is None else found.certificate,
        "energy_defect": None if found is None else found.defect,
        "series": series,
        "figures": figures,
    }


class _Progress:
    """Tell on a terminal which entry is computed, and how long the rest will take."""

    def __init__(self, seconds: dict[str, float], quiet: bool) -> None:
        self._left = dict(seconds)  # of the last run of the book, of entries that are to come
        self._whole = sum(seconds.values())
        self._count = len(seconds)
        self._began = time.monotonic()
        self._shown = not quiet and world().rank == 0 and sys.stderr.isatty()

    def tell(self, name: str) -> None:
        """Print a line before an entry is computed."""
        if not self._shown:
            return
        # What is left took so long then; this machine is as much slower as it was so far.
        left = sum(self._left.values())
        done = self._whole - left
        slower = (time.monotonic() - self._began) / done if done > 0.0 else 1.0
        number = self._count - len(self._left) + 1
        text = f"{name} ({number} of {self._count}), about {slower * left:.0f} s left"
        print(f"vi-contact validate: {text}", file=sys.stderr, flush=True)

    def finish(self, name: str) -> None:
        """Take an entry off what is left."""
        self._left.pop(name, None)
