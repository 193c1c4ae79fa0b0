"""Measure the numbers that decide: how large, when, and for how long they were nearly so large."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ...core.algebra import Array
from ...core.errors import InputError
from ...run.files.reading import RunFolder
from ...run.recorders.contact_parts import is_upright
from ..engineering.peak_values import column_of, find_stretch
from .rules import WORDS, History, Measure, Rule, find_columns, find_part, list_rules

FORCES = {"N": "normal force", "T": "shear", "M": "moment about the centre"}  # of parts
WHOLE = {
    "contact_resultant": "contact force",
    "contact_uplift": "open share of the contact",
    "contact_max_pressure": "largest contact pressure",
    "contact_max_slip": "largest slip",
}


@dataclass(frozen=True)
class DecidingNumber:
    """Hold a number that decides.

    Attributes:
        name: on the page.
        column: of history.csv.
        measure: what of the column it is.
        value: the number, in the SI unit of its column; nan where the run has none.
        t: when it came [s].
        seconds: how long it lasted above 90 % of its size [s]; nan where it stays.
        steps: in how many steps of the run; 0 at the start.
        rule: the rule in words; "" where the case names the column.
    """

    name: str
    column: str
    measure: Measure
    value: float
    t: float
    seconds: float
    steps: int
    rule: str = ""

    @property
    def short_name(self) -> str:
        """Return the name in a sentence: that of a rule, or the column."""
        return self.name if self.rule else self.column

    @property
    def is_brief(self) -> bool:
        """Say whether it is a peak of one step."""
        return self.steps == 1


def choose_numbers(run: RunFolder, names: Sequence[str] | None) -> list[DecidingNumber]:
    """Return the numbers that decide in a run.

    Args:
        run: what ``read_run`` returned.
        names: columns and words of rules; None: those of the rules that apply by themselves.

    Raises:
        InputError: a column that the history does not have, and a rule about parts of the contact
            of which none is one.
    """
    if names is None:
        found = [_apply_rule(rule, run.history) for rule in list_rules(run.history)]
        return [number for number in found if number is not None and not np.isnan(number.value)]
    numbers = []
    for name in names:
        if name in run.history or name not in WORDS:
            numbers.append(_take_column(name, run))
            continue
        number = _apply_rule(WORDS[name], run.history)
        if number is None:
            raise InputError(
                f"[sheet] numbers: no part of the contact is one for '{name}': name a column, such "
                f"as {WORDS[name].find(run.history)[0]}"
            )
        numbers.append(number)
    return numbers


def measure_again(number: DecidingNumber, history: History) -> DecidingNumber | None:
    """Return the same number of another run of the case; None where it has no such column."""
    if number.column not in history:
        return None
    return measure_column(number.name, number.column, number.measure, history, rule=number.rule)


def _apply_rule(rule: Rule, history: History) -> DecidingNumber | None:
    """Return the number of a rule, of the column in which it decides most; None without one."""
    numbers = [
        measure_column(rule.name, column, rule.measure, history, rule=rule.says)
        for column in find_columns(rule, history)
    ]
    worst = min if rule.measure is Measure.SAFETY else max
    known = [number for number in numbers if not np.isnan(number.value)] or numbers[:1]
    return worst(known, key=lambda number: abs(number.value), default=None)


def _take_column(name: str, run: RunFolder) -> DecidingNumber:
    """Return the number of a column that the case names."""
    history = {"t": run.history["t"], name: column_of(run.history, name)}
    meaning = run.columns[name][1]
    if name.startswith("sliding_"):
        return measure_column(
            f"sliding that stays, part {name.removeprefix('sliding_')}",
            name,
            Measure.STAYS,
            history,
        )
    if name.startswith("margin_"):
        return measure_column(
            f"factor against sliding, part {name.removeprefix('margin_')}",
            name,
            Measure.SAFETY,
            history,
        )
    return measure_column(_name_column(name, meaning, run.history), name, Measure.PEAK, history)


def _name_column(name: str, meaning: str, history: History) -> str:
    """Return what a column is called on the page, in words of the trade where it is a force."""
    if name in WHOLE:
        return WHOLE[name]
    kind, _, part = name.partition("_")
    if kind == "reaction":
        axis, _, support = part.partition("_")
        return (
            f"moment of support {support}"
            if axis[0] == "M"
            else (f"force of support {support} along {axis}")
        )
    if kind not in FORCES or not find_part(name, history):
        return _shorten_meaning(meaning)
    word = "thrust" if kind == "N" and is_upright(part, history) else FORCES[kind]
    return f"{word}, part {part}"


def _shorten_meaning(meaning: str) -> str:
    """Return what a column is without its sign convention: up to a comma, and of which part."""
    first, *rest = meaning.split(", ")
    if rest and rest[-1].startswith(("part ", "section ")):
        return f"{first}, {rest[-1]}"
    return first


def measure_column(
    name: str, column: str, measure: Measure, history: History, *, rule: str = ""
) -> DecidingNumber:
    """Return the number of a column.

    Args:
        name: on the page.
        column: of the history.
        measure: what of the column decides.
        history: column -> values (rows,).
        rule: by which the column was chosen, in words.
    """
    t = history["t"]
    values = history[column]
    if measure is Measure.STAYS:
        stays = float(values[-1]) - float(values[0])
        return DecidingNumber(name, column, measure, stays, float(t[-1]), np.nan, 0, rule)
    if measure is Measure.SAFETY:
        used = 1.0 - values  # of the friction; its peak is the smallest factor
        share, at, seconds, steps = measure_peak(t, used)
        factor = 1.0 / share if share > 0.0 else np.nan
        return DecidingNumber(name, column, measure, factor, at, seconds, steps, rule)
    return DecidingNumber(name, column, measure, *measure_peak(t, values), rule)


def measure_peak(t: Array, values: Array) -> tuple[float, float, float, int]:
    """Return (peak, its time, how long it lasted, in how many steps).

    The peak is the value (rows,) of largest size, with its sign. It lasts while the values around
    it stay above 90 % of it. A row k > 0 stands for the step from t[k - 1] to t[k], row 0 for
    none. All are nan, and no step, where there are no numbers.

    Args:
        t: times (rows,) [s].
        values: of the column (rows,).
    """
    if np.isnan(values).all():
        return np.nan, np.nan, np.nan, 0
    row = int(np.nanargmax(np.abs(values)))
    peak = float(values[row])
    if peak == 0.0:
        return 0.0, float(t[row]), np.nan, 0

    first, last = find_stretch(values * np.sign(peak))
    seconds = float(t[last] - t[max(first - 1, 0)])
    return peak, float(t[row]), seconds, last + 1 - max(first, 1)
