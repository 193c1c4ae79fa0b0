"""Compute entries of the validation book, and judge what they find by their limits.

A figure that is missing, NaN, or outside of its limit is a fail, and so is an entry whose data are
missing or changed, or whose run ends in an error. Records that are not there are a skip. Nothing
of a limit is known to the computation.
"""

import math
import time
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

import numpy as np

from ..core.arguments import check_arguments
from ..core.checks import check_word, explain_error, quote
from ..core.errors import InputError, ViContactError
from .entry import RUN, SETTINGS, Entry, Missing, Mutant, Wanted, read_entry, refuse_units
from .found import Found
from .statistics import QUANTITIES, Agreement, agreement

PASS = "pass"
FAIL = "fail"
SKIP = "skip"
KNOWN = "known difference"  # within its limit, and no agreement
MANY = 5  # more values of one kind than these are told as a line of found over wanted too


@dataclass(frozen=True)
class Judgement:
    """Hold a figure that was found beside what was wanted.

    Attributes:
        name: of the figure or the statistic.
        unit: of the numbers.
        found: NaN where it is missing.
        wanted: of the source.
        limit: largest |found - wanted|.
        reason: of the limit.
        counted: whether it is judged in a series only, by its statistics.
        known: whether it is known to differ, so that it is no agreement within its limit either.
    """

    name: str
    unit: str
    found: float
    wanted: float
    limit: float
    reason: str
    counted: bool = False
    known: bool = False

    @property
    def error(self) -> float:
        """Return found - wanted."""
        return self.found - self.wanted

    @property
    def within(self) -> bool:
        """Say whether the figure is within its limit; NaN never is."""
        return abs(self.error) <= self.limit

    @property
    def verdict(self) -> str:
        """Return "pass", "known difference" or "fail"; of a series "within" or "outside"."""
        if self.counted:
            return "within" if self.within else "outside"
        if not self.within:
            return FAIL
        return KNOWN if self.known else PASS


@dataclass(frozen=True)
class Outcome:
    """Hold what came of an entry.

    Attributes:
        name: of the entry.
        setting: "smallest", "coarse" or "fine".
        status: "pass", "fail" or "skip".
        why: sentences about what failed, or why it was skipped.
        judgements: of figures and statistics.
        agreements: series -> how well it agrees.
        told: name -> what is told and not judged.
        seconds: of the processor, on this rank.
        found: what run.py returned; None where it returned nothing.
        entry: None where it could not be read.
        error: what the run raised, None if it came to its end.
    """

    name: str
    setting: str
    status: str
    why: Sequence[str] = ()
    judgements: Sequence[Judgement] = ()
    agreements: Mapping[str, Agreement] = field(default_factory=dict)
    told: Mapping[str, float] = field(default_factory=dict)
    seconds: float = 0.0
    found: Found | None = None
    entry: Entry | None = None
    error: Exception | None = None

    @property
    def failed(self) -> list[str]:
        """Return the names of the figures and statistics outside of their limits."""
        return [one.name for one in self.judgements if not one.counted and not one.within]


def count_within(verdicts: Sequence[str]) -> tuple[int, int]:
    """Return how many figures are within their limits, and of how many that are judged.

    A known difference is neither, unless it has grown beyond its limit: it then counts as a fail.

    Args:
        verdicts: of figures, as ``Judgement.verdict`` has them; others are passed over.
    """
    passed = verdicts.count(PASS)
    return passed, passed + verdicts.count(FAIL)


def group_by_reason(pairs: Iterable[tuple[str, str]]) -> list[tuple[str, str]]:
    """Return pairs (figures, reason): of each reason the first figure, and how many more have it.

    Args:
        pairs: (figure, reason of its limit); a figure may come again.
    """
    names: dict[str, dict[str, None]] = {}
    for name, reason in pairs:
        names.setdefault(reason, {})[name] = None
    rows = []
    for reason, group in names.items():
        words = next(iter(group))
        if len(group) > 1:
            words += f" and {len(group) - 1} more"
        rows.append((words, reason))
    return rows


@check_arguments
def run_entry(
    name: str | Path, *, setting: str = "coarse", change: Mapping[str, Any] | None = None
) -> Outcome:
    """Compute an entry and judge it. Collective.

    Args:
        name: of an entry of the package, or the folder of another one.
        setting: "smallest" for tests, "coarse" or "fine".
        change: input -> another value, as a mutant has.

    Returns:
        The outcome; what is wrong with the entry, and errors of its run, are a fail.

    Raises:
        InputError: a setting that does not exist.
    """
    check_word("setting", setting, SETTINGS)
    short = Path(name).name
    try:
        entry = read_entry(name)
        refuse_units(entry)
        inputs = entry.gather_inputs(setting, change)
    except Missing as error:
        return Outcome(short, setting, SKIP, [str(error)])
    except InputError as error:
        return Outcome(short, setting, FAIL, [str(error)])

    began = time.process_time()
    try:
        found = entry.run.figures(inputs, setting)
        if not isinstance(found, Found):
            raise TypeError(f"figures returned {quote(found)}: return a Found")
    except Exception as error:  # of an entry, which may be anybody's and raise anything
        ended = f"{short}: its run ended in {type(error).__name__}"
        return Outcome(
            short,
            setting,
            FAIL,
            [f"{ended}: {explain_error('run.py', error)}"],
            seconds=time.process_time() - began,
            entry=entry,
            error=error,
        )
    return judge(entry, setting, found, time.process_time() - began)


def judge(entry: Entry, setting: str, found: Found, seconds: float) -> Outcome:
    """Return the outcome of an entry, of what its run has found.

    Args:
        entry: whose limits count.
        setting: "smallest", "coarse" or "fine".
        found: what run.py returned.
        seconds: that it took.
    """
    wanted = entry.list_wanted(setting)
    judgements = [_judge_figure(one, found) for one in wanted]
    agreements = compare_groups(wanted, found.figures)
    for statistic in entry.statistics:
        value = float(getattr(agreements[statistic.series], statistic.what))
        unit = "-"
        if QUANTITIES[statistic.what][1]:
            unit = next(one.unit for one in wanted if one.series == statistic.series)
        judgements.append(
            Judgement(
                statistic.name, unit, value, statistic.value, statistic.limit, statistic.reason
            )
        )

    # what was found and nobody asked for, and the other way round
    why = []
    told = {one.name: found.figures.get(one.name, math.nan) for one in entry.told}
    judged = {one.name for each in SETTINGS for one in entry.list_wanted(each)}
    unasked = set(found.figures) - judged - set(told)
    if unasked:
        why.append(f"{entry.name}: run.py found '{min(unasked)}', which entry.toml does not judge")
    for one in judgements:
        if not one.within and not one.counted:
            why.append(_explain(entry.name, one))
    for one in judgements:
        if one.counted and math.isnan(one.found):
            why.append(f"{entry.name}: '{one.name}' was not found: a figure that is missing fails")
    return Outcome(
        name=entry.name,
        setting=setting,
        status=FAIL if why else PASS,
        why=why,
        judgements=judgements,
        agreements=agreements,
        told=told,
        seconds=seconds,
        found=found,
        entry=entry,
    )


def _judge_figure(wanted: Wanted, found: Found) -> Judgement:
    """Return a figure beside what is wanted; NaN where the run did not find it."""
    value = float(found.figures.get(wanted.name, math.nan))
    return Judgement(
        wanted.name,
        wanted.unit,
        value,
        wanted.value,
        wanted.limit,
        wanted.reason,
        counted=bool(wanted.series),
        known=wanted.known,
    )


def compare_groups(wanted: Sequence[Wanted], figures: Mapping[str, float]) -> dict[str, Agreement]:
    """Return how well series agree, and other groups of more than ``MANY`` values.

    Args:
        wanted: what the figures are compared with.
        figures: name -> what was found.
    """
    agreements = {}
    for group in dict.fromkeys(one.group for one in wanted if one.group):
        members = [one for one in wanted if one.group == group]
        if not members[0].series and len(members) <= MANY:
            continue
        names = [one.name for one in members]
        agreements[group] = agreement(
            names,
            np.array([float(figures.get(name, math.nan)) for name in names]),
            np.array([one.value for one in members]),
            np.array([one.limit for one in members]),
        )
    return agreements


def _explain(name: str, one: Judgement) -> str:
    """Return the sentence about a figure that is outside of its limit."""
    if math.isnan(one.found):
        return f"{name}: '{one.name}' was not found or is nan: a figure that is missing fails"
    unit = "" if one.unit == "-" else f" {one.unit}"
    return (
        f"{name}: '{one.name}' is {one.found:.6g}{unit}, wanted {one.wanted:.6g}{unit} within "
        f"{one.limit:.3g}"
    )


def judge_mutant(
    name: str | Path, mutant: Mutant, *, setting: str = "smallest"
) -> tuple[bool, Outcome]:
    """Compute an entry with a change that must be noticed. Collective.

    Args:
        name: of the entry, or its folder.
        mutant: the change.
        setting: "smallest" for tests, "coarse" or "fine".

    Returns:
        Whether all figures and statistics that the mutant names have failed, or where it names
        the run, whether this was refused or ended in StepFailure; and the outcome.
    """
    outcome = run_entry(name, setting=setting, change=mutant.change)
    if RUN in mutant.red:
        return isinstance(outcome.error, ViContactError), outcome
    names = [one.name for one in outcome.judgements if not one.counted]
    red: set[str] = set()
    for pattern in mutant.red:
        red |= {one for one in names if fnmatchcase(one, pattern)}
    return bool(red) and red <= set(outcome.failed), outcome
