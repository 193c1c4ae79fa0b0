"""Find what the lines of a header say in words: units, step, number of samples, kind of motion."""

import re
from collections.abc import Iterable, Sequence

from ....core.errors import InputError
from ..record import UNITS, recognise_units
from .text import NUMBER, TextFile

_SECONDS = rf"({NUMBER})\s*+-?s(?:ec(?:ond)?s?)?\b"
_STEP_NAME = (
    r"\b(?:dt|delta[ _]?t|(?:time|sampl(?:e|ing))[ "
    r"_]?(?:step|increments?|intervals?|spacing|period)|"
    r"sampling[ _]interval[ _]s|intervalo de muestreo)\b"
)
_STEP = re.compile(
    rf"{_STEP_NAME}\s*+(?:[(\[]\s*+(?P<unit>[a-z]++)\s*+[)\]])?\s*+(?:[:=]|is|of)?\s*+"
    rf"(?P<step>{NUMBER})\s*+(?P<behind>[a-z]++)?",
    re.IGNORECASE,
)
_RATE = re.compile(
    r"\b(?:sampl(?:e|ing)[ _]?(?:rate|freq\w*+)|samples\s*+(?:per|/)\s*+sec\w*+|sps)\b\s*+"
    r"(?:[(\[]\s*+[a-z/]++\s*+[)\]])?"
    rf"\s*+(?:[:=]|is|of)?\s*+({NUMBER})",
    re.IGNORECASE,
)
_PROSE = (
    re.compile(
        rf"\b(?:spacing|spaced|step|intervals?|every|sampled at)\b[^\d.+-]{{0,20}}{_SECONDS}",
        re.IGNORECASE,
    ),
    re.compile(rf"{_SECONDS}\.?\s++(?:time\s++)?(?:spacing|steps?|intervals?)\b", re.IGNORECASE),
)
_COUNT = re.compile(
    r"\b(?:npts|ndata|n(?:umber|um|o)?\.?[ _]*+(?:of[ _])?(?:total[ "
    r"_])?(?:data|points?|samples?|values?|pts)"
    r"(?:[ _]points?)?)\s*+(?:[:=]|is)?\s*+(\d++)(?![\d.])",
    re.IGNORECASE,
)
_COUNT_FIRST = re.compile(
    r"(?<![\d.])(\d++)\s++(?:data\s++)?(?:points|samples|values)\s++"
    r"(?:at|of|equally|evenly|spaced|with)",
    re.IGNORECASE,
)
_UNIT = re.compile(
    r"(?<![\w/^*])(?:[cm]?ms?/s(?:ec)?(?:\s*+[*^]{0,2}\s*+2|²|/s(?:ec)?)(?![\w/])|"
    r"(?:in|ft)/s(?:ec)?(?:\s*+[*^]{0,2}\s*+2|²|/s(?:ec)?)(?![\w/])|"
    r"gals?\b|g/10\b|(?:[cm]?m)\s?s\^?-2\b|g(?:'s)?(?![\w/.']))",
    re.IGNORECASE,
)
_STATES_UNIT = re.compile(
    r"\b(?:units?|unidades|accel\w*+|acelera\w*+|acc?[eé]l\w*+|acc|gals?)\b|[\[(]", re.IGNORECASE
)
_UNITS_OF = re.compile(
    r"\bunits?\s*+(?:of|are|is|in|[=:])?\s*+(?:[=:])?\s*+(\([^()]*+\)|\[[^\[\]]*+\]|[^\s,;]++)",
    re.IGNORECASE,
)
_MEASURE = re.compile(
    r"\b(?:pg[avd]|peak|max\w*+|min\w*+|rms|arias|threshold|scale|filter\w*+|"
    r"corner|depth|sensitivity)\b",
    re.IGNORECASE,
)
_MOTION = re.compile(
    r"\b(?:(?P<acceleration>ac(?:c|c?[eé]l)\w*+|beschleunig\w*+)|"
    r"(?P<velocity>vel(?:oc\w*+)?|vitesse)|"
    r"(?P<displacement>disp\w*+|desplaz\w*+|spostament\w*+)|(?P<counts>counts?))\b",
    re.IGNORECASE,
)
_NO_MOTION = re.compile(
    r"\b(?:wave|shear|apparent|propagation|rupture|vs30)[ -]*velocit\w*+|\bvelocity "
    r"(?:structure|model)\b|"
    r"\baccording\b|\baccess\w*+|\baccount\w*+|\baccura\w*+|\bdisplay\w*+",
    re.IGNORECASE,
)
_SERIES = re.compile(r"\b(?:histor(?:y|ies)|series|units?|data|record|trace|time)\b", re.IGNORECASE)

# a lone "g" is a unit only behind these
_BEFORE_G = re.compile(r"(?:\b(?:of|in|are|is|and)|[:=(\[,])\s*+$", re.IGNORECASE)

Statement = tuple[int, float]  # index of a line, and the number that it states
TIME_UNITS = {
    "s": 1.0,
    "sec": 1.0,
    "secs": 1.0,
    "second": 1.0,
    "seconds": 1.0,
    "ms": 1e-3,
    "msec": 1e-3,
    "millisecond": 1e-3,
    "milliseconds": 1e-3,
    "us": 1e-6,
    "µs": 1e-6,
    "min": 60.0,
}


def find_steps(text: TextFile, indices: Iterable[int]) -> list[Statement]:
    """Return the lines that state a time step, or a sampling rate, and the step [s]."""
    steps: list[Statement] = []
    for index in indices:
        line = text.heads[index]
        for match in _STEP.finditer(line):
            unit_name = match["unit"] or match["behind"] or "s"
            unit = TIME_UNITS.get(unit_name.lower(), 1.0)
            steps.append((index, unit * text.number(index, match["step"])))
        for match in _RATE.finditer(line):
            rate = text.number(index, match[1])
            if rate > 0.0:
                steps.append((index, 1.0 / rate))

        # Whole sentences are read where no entry states the step.
        if steps and steps[-1][0] == index:
            continue
        for pattern in _PROSE:
            for match in pattern.finditer(line):
                steps.append((index, text.number(index, match[1])))
    return steps


def find_counts(text: TextFile, indices: Iterable[int]) -> list[Statement]:
    """Return the lines that state a number of samples, and that number."""
    counts = []
    for index in indices:
        for pattern in (_COUNT, _COUNT_FIRST):
            for match in pattern.finditer(text.heads[index]):
                counts.append((index, text.number(index, match[1])))
    return counts


def find_units(text: TextFile, indices: Iterable[int]) -> list[tuple[int, str]]:
    """Return the lines that state units of acceleration, and the units, as keys of UNITS.

    Lines about peaks and filters are left out: a peak may be given in other units than the
    samples.
    """
    statements: list[tuple[int, str]] = []
    for index in indices:
        line = text.heads[index]
        if _MEASURE.search(line) or not _STATES_UNIT.search(line):
            continue
        units = set()
        for match in _UNIT.finditer(line):
            known = recognise_units(match[0])
            if known == "g" and not _BEFORE_G.search(line[: match.start()]):
                continue
            if known is not None:
                units.add(known)
        if "gal" in units:  # "gal (cm/s/s)" is one unit with its explanation
            units.discard("cm/s2")
        statements += [(index, unit) for unit in sorted(units)]
    return statements


def agree(
    text: TextFile, quantity: str, statements: Sequence[Statement], *, rounding: float = 1e-6
) -> Statement | None:
    """Return the first of several statements, or None where there is none.

    Args:
        text: the file.
        quantity: that is stated, in words for messages.
        statements: lines and numbers.
        rounding: relative difference that counts as none.

    Raises:
        InputError: statements that contradict each other.
    """
    if not statements:
        return None
    first_line, first = statements[0]
    for index, value in statements[1:]:
        if abs(value - first) > rounding * abs(first):
            raise InputError(
                f"{text.at(index)}: the header states {quantity} as {value:g}, but line "
                f"{first_line + 1} states it as {first:g}; correct the file, or get it again"
            )
    return first_line, first


def agree_on_units(text: TextFile, statements: Sequence[tuple[int, str]]) -> tuple[int, str] | None:
    """Return the first line that states the units, and the units, or None where none does.

    Raises InputError where statements contradict each other.
    """
    if not statements:
        return None
    first_line, first = statements[0]
    for index, units in statements[1:]:
        if UNITS[units] != UNITS[first]:
            raise InputError(
                f"{text.at(index)}: the header states units as {units}, but line {first_line + 1} "
                f"states them as {first}; correct the file, or get it again"
            )
    return first_line, first


def find_unknown_units(text: TextFile, indices: Iterable[int]) -> tuple[int, str] | None:
    """Return the line that says "units of X" or "units: X" of an unknown X, and X."""
    for index in indices:
        match = _UNITS_OF.search(text.heads[index])
        if match is None:
            continue
        word = match[1].strip("()[] .:=")
        looks_like_unit = re.search(r"[/\^]|^counts?$|^[a-z]$", word, re.I)
        if recognise_units(word) is None and word.lower() not in TIME_UNITS and looks_like_unit:
            return index, match[1]
    return None


def refuse_other_motion(text: TextFile, indices: Sequence[int]) -> None:
    """Raise InputError where a header says that samples are velocities, displacements or counts.

    The lines that speak of a history, a series, data or units decide; without one, any word of
    motion does, and acceleration wins.
    """
    about_series: list[tuple[int, str]] = []
    about_motion: list[tuple[int, str]] = []
    for index in indices:
        line = _NO_MOTION.sub("", text.heads[index])
        kinds = {match.lastgroup or "" for match in _MOTION.finditer(line)}
        if not kinds or _MEASURE.search(line):
            continue
        kind = "acceleration" if "acceleration" in kinds else sorted(kinds)[-1]
        statements = about_series if _SERIES.search(line) else about_motion
        statements.append((index, kind))
    deciding = about_series or about_motion
    if deciding and all(kind != "acceleration" for _, kind in deciding):
        index, kind = deciding[0]
        raise InputError(f"{text.at(index)}: the header says {kind}; get the file of accelerations")
