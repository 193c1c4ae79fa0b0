"""Say by which rules the numbers that decide are found among the columns of a run.

A rule finds columns by their names. Of several it takes the one with the largest number.
"""

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from enum import Enum
from functools import partial

import numpy as np

from ...core.algebra import Array
from ...run.recorders.contact_parts import is_upright
from ..engineering.column_groups import begins

History = Mapping[str, Array]  # column -> values (rows,)
Names = Collection[str]
# What of a part of the contact decides: its columns are <kind>_<part>.
_KINDS = ("N", "T", "sliding", "opening", "uplift", "pressure_low", "pressure_high", "margin")


class Measure(Enum):
    """Say what of a column decides."""

    PEAK = "largest in size"
    STAYS = "at the end less at the start"
    SAFETY = "smallest 1 / (1 - margin)"


class Where(Enum):
    """Say which parts of the contact a rule is about."""

    ANYWHERE = "all columns"
    BASE = "the part that carries most"
    LEVEL_BASE = "the part that carries most, if it is level"
    UPRIGHT = "the parts that stand upright"


@dataclass(frozen=True)
class Rule:
    """Find a number that decides.

    Attributes:
        word: of the rule in ``[sheet] numbers``.
        name: of the number on the page.
        says: the rule in words; it continues "base shear is …".
        find: names of columns -> those that the rule is about, in their order.
        recorder: the type of [[record]] that records them.
        measure: what of the column decides.
        where: which of the columns count.
        without: words of rules; where one of them finds something, this rule is not applied by
            itself.
    """

    word: str
    name: str
    says: str
    find: Callable[[Names], list[str]]
    recorder: str
    measure: Measure = Measure.PEAK
    where: Where = Where.ANYWHERE
    without: tuple[str, ...] = ()


def _begin(*prefixes: str) -> Callable[[Names], list[str]]:
    """Return what finds the columns that begin so."""
    return partial(_list_columns, prefixes=prefixes)


def _list_columns(names: Names, *, prefixes: tuple[str, ...]) -> list[str]:
    """Return the columns that begin with one of the prefixes."""
    return [name for name in names if begins(name, prefixes)]


def _find_level(kind: str) -> Callable[[Names], list[str]]:
    """Return what finds the columns of a kind along the level axes, such as "reaction_"."""
    return partial(_list_level, kind=kind)


def _list_level(names: Names, *, kind: str) -> list[str]:
    """Return the columns along x, in space along y too: the last axis is upright."""
    in_space = any(name.startswith(f"{kind}z_") for name in names)
    prefixes = (f"{kind}x_", f"{kind}y_") if in_space else (f"{kind}x_",)
    return _list_columns(names, prefixes=prefixes)


def find_part(column: str, names: Names) -> str:
    """Return the part of the contact that a column <kind>_<part> is of; "" if it is of none.

    Parts open, and sections do not: a part has a column of its open share.
    """
    part = column.partition("_")[2]
    return part if f"uplift_{part}" in names else ""


def _list_thrusts(names: Names) -> list[str]:
    """Return the normal forces of parts of the contact."""
    return [name for name in names if name.startswith("N_") and find_part(name, names)]


def _list_shears(names: Names) -> list[str]:
    """Return the shears of parts of the contact; in space T is the size of a vector."""
    return [f"T_{name[2:]}" for name in _list_thrusts(names) if f"T_{name[2:]}" in names]


def _list_section_moments(names: Names) -> list[str]:
    """Return the moments of sections: a section has V too, a part of the contact has not."""
    return [name for name in names if name.startswith("M_") and f"V_{name[2:]}" in names]


# The rules in the order of the page.
RULES = (
    Rule(
        "base_shear",
        "base shear",
        "the largest level force of a support",
        _find_level("reaction_"),
        "Reactions",
    ),
    Rule(
        "base_friction",
        "base shear",
        "the largest shear of the base, as no force of a support is recorded",
        _list_shears,
        "Resultants",
        where=Where.LEVEL_BASE,
        without=("base_shear",),
    ),
    Rule(
        "section_moment",
        "bending moment of a section",
        "the largest bending moment of the recorded sections",
        _list_section_moments,
        "SectionForces",
    ),
    Rule(
        "thrust",
        "thrust",
        "the largest normal force of a part of the contact that stands upright",
        _list_thrusts,
        "Resultants",
        where=Where.UPRIGHT,
        without=("section_moment",),
    ),
    Rule(
        "contact_force",
        "contact force",
        "the largest sum of the normal reactions",
        _begin("contact_resultant"),
        "Contact",
        without=("base_shear", "section_moment", "thrust"),
    ),
    Rule(
        "sliding",
        "sliding that stays",
        "the mean sliding of the base at the end, less that at the start",
        _begin("sliding_"),
        "Resultants",
        measure=Measure.STAYS,
        where=Where.BASE,
    ),
    Rule(
        "slip",
        "largest slip",
        "the largest slip of a contact point",
        _begin("contact_max_slip"),
        "Contact",
        without=("sliding",),
    ),
    Rule(
        "opening",
        "largest opening",
        "the largest gap of the base",
        _begin("opening_"),
        "Resultants",
        where=Where.BASE,
    ),
    Rule(
        "open_share",
        "largest open share",
        "the largest share of the base that is open; without parts, of the whole contact",
        _begin("uplift_", "contact_uplift"),
        "Resultants",
        where=Where.BASE,
    ),
    Rule(
        "toe_pressure",
        "largest toe pressure",
        "the larger pressure of the two ends of the base",
        _begin("pressure_low_", "pressure_high_"),
        "Resultants",
        where=Where.BASE,
    ),
    Rule(
        "contact_pressure",
        "largest contact pressure",
        "the largest pressure of a contact point",
        _begin("contact_max_pressure"),
        "Contact",
        without=("toe_pressure",),
    ),
    Rule(
        "safety",
        "factor against sliding",
        "the smallest ratio of the friction mu N that the base could carry to its shear",
        _begin("margin_"),
        "Resultants",
        measure=Measure.SAFETY,
        where=Where.BASE,
    ),
    Rule(
        "drift",
        "drift",
        "the largest racking of a frame",
        _begin("racking_"),
        "Racking",
    ),
    Rule(
        "displacement",
        "largest level displacement",
        "the largest level displacement of a recorded point",
        _find_level("u_"),
        "Probe",
        without=("drift",),
    ),
)
WORDS = {rule.word: rule for rule in RULES}


def list_rules(names: Names) -> list[Rule]:
    """Return the rules that apply by themselves to a run with these columns."""
    fruitful = {rule.word for rule in RULES if rule.find(names)}
    return [
        rule for rule in RULES if rule.word in fruitful and not fruitful.intersection(rule.without)
    ]


def find_columns(rule: Rule, history: History) -> list[str]:
    """Return the columns of a run that a rule is about, of the parts that count alone."""
    found = [name for name in rule.find(history) if np.ndim(history[name]) == 1]
    names = _list_thrusts(history)
    if rule.where is Where.ANYWHERE or not names:
        return found
    parts = _choose_parts(rule.where, [name.removeprefix("N_") for name in names], history)
    own = {f"{kind}_{part}" for kind in _KINDS for part in parts}
    return [name for name in found if name in own]


def _choose_parts(where: Where, parts: list[str], history: History) -> list[str]:
    """Return the parts of the contact that count.

    Args:
        where: which of them.
        parts: names of all.
        history: of the run.
    """
    # The base is the part that carries most, in the median of the rows.
    base = max(
        parts, key=lambda part: float(np.median(np.abs(np.nan_to_num(history[f"N_{part}"]))))
    )

    upright = [part for part in parts if is_upright(part, history)]
    if where is Where.UPRIGHT:
        return [part for part in upright if part != base] or upright
    return [] if where is Where.LEVEL_BASE and base in upright else [base]
