"""Find what the lines of a header say in words.

They say units, time step, number of samples and kind of motion.
"""

import re
from collections.abc import Iterable, Sequence

from ...core.errors import InputError
from ..record import UNITS, known_units
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
    r"(?<![\d.])(\d++)\s++(?:data\s++)?(?:points|samples|values)\s++(?:at|of|equally|evenly|spaced|with)",
    re.IGNORECASE,
)
_UNIT = re.compile(
    r"(?<![\w/^*])(?:[cm]?ms?/s(?:ec)?(?:\s*+[*^]{0,2}\s*+2|²|/s(?:ec)?)(?![\w/])|(?:in|ft)/s(?:ec)?"
    r"(?:\s*+[*^]{0,2}\s*+2|²|/s(?:ec)?)(?![\w/])|gals?\b|g/10\b|(?:[cm]?m)\s?s\^?-2\b|g(?:'s)?(?![\w/.']))",
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
    r"\b(?:pg[avd]|peak|max\w*+|min\w*+|rms|arias|threshold|scale|filter\w*+|corner|depth|sensitivity)\b",
    re.IGNORECASE,
)
_MOTION = re.compile(
    r"\b(?:(?P<acceleration>ac(?:c|c?[eé]l)\w*+|beschleunig\w*+)|(?P<velocity>vel(?:oc\w*+)?|vitesse)|"
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

Found = tuple[int, float]  # index of a line, and what it says
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


def find_steps(text: TextFile, indices: Iterable[int]) -> list[Found]:
    """Return the lines that state a time step, or a sampling rate, and the step [s]."""
    found: list[Found] = []
    for index in indices:
        line = text.heads[index]
        for match in _STEP.finditer(line):
            unit = TIME_UNITS.get((match["unit"] or match["behind"] or "s").lower(), 1.0)
            found.append((index, unit * text.number(index, match["step"])))
        for match in _RATE.finditer(line):
            rate = text.number(index, match[1])
            found += [(index, 1.0 / rate)] if rate > 0.0 else []
        if not found or found[-1][0] != index:
            found += [
                (index, text.number(index, match[1]))
                for pattern in _PROSE
                for match in pattern.finditer(line)
            ]
    return found


def find_counts(text: TextFile, indices: Iterable[int]) -> list[Found]:
    """Return the lines that state a number of samples, and that number."""
    return [
        (index, text.number(index, match[1]))
        for index in indices
        for pattern in (_COUNT, _COUNT_FIRST)
        for match in pattern.finditer(text.heads[index])
    ]


def find_units(text: TextFile, indices: Iterable[int]) -> list[tuple[int, str]]:
    """Return the lines that state units of acceleration, and the units, as keys of UNITS.

    Lines about peaks and filters are left out: a peak may be given in other units than the
    samples.
    """
    found: list[tuple[int, str]] = []
    for index in indices:
        line = text.heads[index]
        if _MEASURE.search(line) or not _STATES_UNIT.search(line):
            continue
        said = {
            known
            for match in _UNIT.finditer(line)
            if (known := known_units(match[0])) is not None
            and (known != "g" or _BEFORE_G.search(line[: match.start()]))
        }
        if "gal" in said:  # "gal (cm/s/s)" is one unit with its explanation
            said -= {"cm/s2"}
        found += [(index, one) for one in sorted(said)]
    return found


def agree(
    text: TextFile, what: str, found: Sequence[Found], *, rounding: float = 1e-6
) -> Found | None:
    """Return the first of several statements.

    It is None where there is none; it raises InputError where they contradict.
    """
    for index, value in found[1:]:
        if abs(value - found[0][1]) > rounding * abs(found[0][1]):
            raise InputError(
                f"{text.at(index)}: the header states {what} as {value:g}, but line "
                f"{found[0][0] + 1} states it as {found[0][1]:g}; correct the file, or get it again"
            )
    return found[0] if found else None


def agree_on_units(text: TextFile, found: Sequence[tuple[int, str]]) -> tuple[int, str] | None:
    """Return the units that all statements share.

    They are None where there are none; it raises InputError where they contradict.
    """
    for index, units in found[1:]:
        if UNITS[units] != UNITS[found[0][1]]:
            raise InputError(
                f"{text.at(index)}: the header states units as {units}, but line {found[0][0] + 1} "
                f"states them as {found[0][1]}; correct the file, or get it again"
            )
    return found[0] if found else None


def find_unknown_units(text: TextFile, indices: Iterable[int]) -> tuple[int, str] | None:
    """Return the line that says "units of X" or "units: X", and X.

    It does so where X is no unit of acceleration.
    """
    for index in indices:
        if match := _UNITS_OF.search(text.heads[index]):
            word = match[1].strip("()[] .:=")
            if (
                known_units(word) is None
                and word.lower() not in TIME_UNITS
                and re.search(r"[/\^]|^counts?$|^[a-z]$", word, re.I)
            ):
                return index, match[1]
    return None


def refuse_other_motion(text: TextFile, indices: Sequence[int]) -> None:
    """Raise InputError where a header says that samples are velocities.

    It does the same for displacements and for counts.

    The line that speaks of a history, a series, data or units decides; without one, any word of
    motion does, and acceleration wins.
    """
    said: dict[bool, list[tuple[int, str]]] = {True: [], False: []}
    for index in indices:
        line = _NO_MOTION.sub("", text.heads[index])
        kinds = {match.lastgroup or "" for match in _MOTION.finditer(line)}
        if not kinds or _MEASURE.search(line):
            continue
        kind = "acceleration" if "acceleration" in kinds else sorted(kinds)[-1]
        said[bool(_SERIES.search(line))].append((index, kind))
    deciding = said[True] or said[False]
    if deciding and all(kind != "acceleration" for _, kind in deciding):
        index, kind = deciding[0]
        raise InputError(f"{text.at(index)}: the header says {kind}; get the file of accelerations")
