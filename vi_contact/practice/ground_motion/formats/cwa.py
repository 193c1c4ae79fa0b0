"""Read files of the Central Weather Administration of Taiwan: "#Key: value" lines, then columns.

The first column is the time.
"""

import math
import re

import numpy as np

from ....core.algebra import Array
from ....core.errors import InputError
from ..record import Record
from .text import SAME_STEP, Entries, TextFile
from .times import time_step

_FORMAT = re.compile(r"^(\d{1,4}+)F(\d{1,4}+)\.(\d{1,4}+)$", re.IGNORECASE)
_UNIT = re.compile(r"[a-z0-9/^]++", re.IGNORECASE)
_DIRECTION = re.compile(r"^([^()]*+)\(([+-])\)$")


def recognises(text: TextFile) -> bool:
    """Tell whether two of the three entries are there that say what the columns are."""
    header = _read_header(text)
    keys = ("SAMPLERATE(HZ)", "AMPLITUDEUNIT", "DATASEQUENCE")
    return sum(key in header for key in keys) >= 2


def read(text: TextFile) -> Record:
    """Return the record of one column.

    ``channel`` is 1 for the one after the time, or its name such as "U".
    """
    header = _read_header(text)
    sequence_line, sequence = text.entry(header, "DATASEQUENCE")
    first, *names = [" ".join(part.split()) for part in re.split(r"[;\s]+", sequence) if part]
    if first.lower() != "time" or not names:
        raise InputError(
            f"{text.at(sequence_line)}: the columns {sequence!r} do not begin with the time; get "
            "the file again"
        )
    form_line, form = text.entry(header, "DATA")
    columns = len(names) + 1
    fields = _FORMAT.match(form)
    if fields is None or int(fields[1]) != columns or int(fields[2]) < 1:
        raise InputError(
            f"{text.at(form_line)}: the format {form!r} is not one of {columns} columns, as "
            "'4F10.3' is; get the file again"
        )

    # Names such as "U(+)" say which way is positive.
    plain_names = []
    points_down = []
    for name in names:
        direction = _DIRECTION.match(name)
        plain_names.append(direction[1] if direction else name)
        points_down.append(direction is not None and direction[2] == "-")
    place = text.choose(plain_names)

    lines, table = _read_rows(text, form_line + 1, columns, int(fields[2]))
    rate_line, rate = _check_rate(text, header, lines, table[:, 0], int(fields[3]))
    units_line, units = text.entry(header, "AMPLITUDEUNIT")
    unit = _UNIT.match(units)
    _, station = header.get("STATIONCODE", (0, ""))
    origins = [content for key, (_, content) in header.items() if key.startswith("ORIGIN TIME")]
    origin = origins[0] if origins else ""
    other_way = ", positive the other way" if points_down[place] else ""
    filled_lines = [index for index, content in header.values() if content]
    return text.record(
        table[:, place + 1],
        units=unit[0] if unit else units,
        line=units_line,
        dt=1.0 / rate,
        lines=lines,
        format="CWA",
        title=f"{origin} {station}".strip(),
        station=station,
        component=plain_names[place] + other_way,
        notes=tuple(text.heads[index].lstrip("# ").strip() for index in filled_lines),
        dt_from=f"header, line {rate_line + 1}",
    )


def _read_rows(text: TextFile, start: int, columns: int, width: int) -> tuple[list[int], Array]:
    """Return the indices of the lines of numbers, and the numbers, (rows, columns).

    Args:
        text: the file.
        start: index of the first line that may hold numbers.
        columns: number of columns.
        width: of the columns, in characters.
    """
    data = text.find_filled(start)
    lines = [index for index in data if not text.lines[index].startswith("#")]
    rows = []
    for index in lines:
        row = text.cut_fields(index, width)
        if len(row) != columns:
            raise InputError(
                f"{text.at(index)}: {len(row)} values instead of {columns}; a value is "
                "missing or too many, get the complete file"
            )
        rows.append(row)
    return lines, np.array(rows).reshape(-1, columns)


def _check_rate(
    text: TextFile, header: Entries, lines: list[int], times: Array, decimals: int
) -> tuple[int, float]:
    """Return the line of the sampling rate, and the rate [Hz].

    Raises InputError where duration, number of samples and times do not agree with it.

    Args:
        text: the file.
        header: its entries.
        lines: indices of the lines of numbers.
        times: (rows,), on these [s].
        decimals: of the times as they are printed.
    """
    count = len(lines)
    rate_line, _ = text.entry(header, "SAMPLERATE(HZ)")
    rate = text.entry_number(header, "SAMPLERATE(HZ)")
    seconds_line, _ = text.entry(header, "RECORDLENGTH(SEC)")
    seconds = text.entry_number(header, "RECORDLENGTH(SEC)")
    if rate <= 0.0 or count < 2:
        raise InputError(
            f"{text.at(rate_line)}: {count} samples at {rate:g} Hz are no record; get the "
            "complete file"
        )
    if not abs(count - seconds * rate) <= 0.5:
        raise InputError(
            f"{text.at(seconds_line)}: {seconds:g} s at {rate:g} Hz "
            f"are announced but {count} samples follow; get the complete file"
        )
    step, rounding, uneven = time_step(text, lines, times, decimals=decimals)
    if uneven or not math.isclose(step, 1.0 / rate, rel_tol=max(rounding, SAME_STEP)):
        raise InputError(
            f"{text.at(rate_line)}: {rate:g} Hz are announced but the times count up by {step:g} "
            "s; get the complete file"
        )
    return rate_line, rate


def _read_header(text: TextFile) -> dict[str, tuple[int, str]]:
    """Return the line and the value of every key of "#Key: value"; of two alike the first."""
    entries: dict[str, tuple[int, str]] = {}
    for index, line in enumerate(text.heads[:60]):
        key, colon, value = line.partition(":")
        if line.startswith("#") and colon:
            entries.setdefault(key.lstrip("# ").strip().upper(), (index, value.strip()))
    return entries
