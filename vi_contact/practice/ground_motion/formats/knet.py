"""Read NIED K-NET and KiK-net files, of one component each.

They have 17 header lines, then integer counts, eight a row.

Acceleration = count x "Scale Factor", written as 3920(gal)/6182761. The counts carry the sensor's
offset, so their mean is removed, as the agency does before it prints "Max. Acc.". NIED forbids
passing these files on.
"""

import re

import numpy as np

from ....core.errors import InputError
from ..record import Record, canonical_units
from .text import NUMBER, TextFile

# header entries used here; the last one ends the header
KEYS = (
    "Origin Time",
    "Station Code",
    "Dir.",
    "Record Time",
    "Sampling Freq(Hz)",
    "Duration Time(s)",
    "Scale Factor",
    "Max. Acc. (gal)",
    "Memo.",
)

_SCALE = re.compile(rf"({NUMBER})\s*+\(([^()]*+)\)\s*+/\s*+({NUMBER})\s*+$")
_FREQUENCY = re.compile(rf"({NUMBER})\s*+(?:Hz)?\s*+$", re.IGNORECASE)


def recognises(text: TextFile) -> bool:
    """Tell whether five of the entries of a header, in any line, are there."""
    head = text.heads[:30]
    present = 0
    for key in KEYS:
        if any(line.startswith(key) for line in head):
            present += 1
    return present >= 5


def read(text: TextFile) -> Record:
    """Return the record of a K-NET or KiK-net file, its mean removed.

    Units and dt are only checked.
    """
    header = {}
    for key in KEYS:
        for index, line in enumerate(text.heads):
            if line.startswith(key):
                header[key] = index
    missing = [key for key in KEYS if key not in header]
    if missing:
        raise InputError(
            f"{text.path}: the header has no line {missing[0]!r}; get the complete file"
        )
    scale, name = _read_scale(text, header["Scale Factor"])
    frequency = _read_number(text, header["Sampling Freq(Hz)"], "Sampling Freq(Hz)")
    counts, _ = text.series(header["Memo."] + 1)
    seconds = _read_number(text, header["Duration Time(s)"], "Duration Time(s)")
    if not counts or not abs(len(counts) - seconds * frequency) <= 0.5:
        raise InputError(
            f"{text.at(header['Duration Time(s)'])}: {seconds:g} s at {frequency:g} Hz are "
            f"announced but {len(counts)} samples follow; get the complete file"
        )
    notes = [" ".join(line.split()) for line in text.heads[: header["Memo."]]]
    mean = np.mean(counts)
    notes.append(f"mean of {scale * mean:.6g} {name} removed")
    time = _read_value(text, header["Origin Time"], "Origin Time")
    station = _read_value(text, header["Station Code"], "Station Code")
    direction = _read_value(text, header["Dir."], "Dir.")
    return text.record(
        np.array(counts) - mean,
        units=name,
        line=header["Scale Factor"],
        scale=scale,
        dt=1.0 / frequency,
        format="K-NET",
        station=station,
        component=direction,
        title=f"{time}, {station} {direction}",
        notes=tuple(notes),
    )


def _read_value(text: TextFile, index: int, key: str) -> str:
    """Return what follows a key on its line."""
    return text.heads[index][len(key) :].strip()


def _read_scale(text: TextFile, index: int) -> tuple[float, str]:
    """Return the size of a count, and its unit, of "Scale Factor      3920(gal)/6182761"."""
    match = _SCALE.search(text.heads[index])
    if match is None or text.number(index, match[3]) == 0.0:
        raise InputError(
            f"{text.at(index)}: the scale factor is not like '3920(gal)/6182761'; get the file "
            "again"
        )
    size = text.number(index, match[1]) / text.number(index, match[3])
    return size, canonical_units(text.at(index), match[2])


def _read_number(text: TextFile, index: int, key: str) -> float:
    """Return the positive number after a key, "Hz" allowed."""
    match = _FREQUENCY.match(_read_value(text, index, key))
    if match is None or text.number(index, match[1]) <= 0.0:
        raise InputError(f"{text.at(index)}: {key!r} has no positive number; get the file again")
    return text.number(index, match[1])
