"""Read text files of AFAD (Türkiye): "KEY : value" lines, then three columns N-S, E-W, U-D in gal."""

from __future__ import annotations

import numpy as np

from ...core.errors import InputError
from ..record import UNITS, Record, file_dt, file_units
from .text import TextFile, filled_lines, header_number

COMPONENTS = ("N-S", "E-W", "U-D")


def recognises(text: TextFile) -> bool:
    """Tell whether the first line is one of the national network."""
    return text.lines[0].strip().upper().startswith("STRONG GROUND MOTION RECORDS OF TURK")


def read(text: TextFile, units: str | None = None, dt: float | None = None, channel: int | None = None) -> Record:
    """Return the record of one component; channel: 1 (N-S), 2 (E-W) or 3 (U-D). Nothing is subtracted.

    Raises InputError naming the file, mostly with a line: no channel chosen, an entry of the header missing or no
    number, a row that has not three numbers, a number of rows unlike "NUMBER OF DATA".
    """
    if channel not in (1, 2, 3):
        raise InputError(f"{text.path}: the file holds 3 channels (1: N-S, 2: E-W, 3: U-D); pass channel=")
    start = next((k + 1 for k, line in enumerate(text.heads) if line.split() == list(COMPONENTS)), None)
    if start is None:
        raise InputError(f"{text.path}: no line 'N-S E-W U-D' announces the columns; get the complete file")
    header = {}
    for index, line in enumerate(text.heads[:start - 1]):
        key, colon, value = line.partition(":")
        if colon:
            header[" ".join(key.split()).upper()] = index, " ".join(value.split())
    count, step = header_number(text, header, "NUMBER OF DATA"), header_number(text, header, "SAMPLING INTERVAL (SEC)")
    data = filled_lines(text, start)
    rows = list(zip(data, text.rows(data), strict=True))
    for index, row in rows:
        if len(row) != 3:
            raise InputError(f"{text.at(index)}: {len(row)} values instead of N-S, E-W and U-D; get the file again")
    if len(rows) != count:
        raise InputError(f"{text.at(header['NUMBER OF DATA'][0])}: {count:g} samples are announced but {len(rows)} "
                         "follow; get the complete file")
    name = file_units(text.path, "gal", units)
    samples = np.array([row[channel - 1] for _, row in rows])
    lines = tuple(" ".join(line.split()) for line in text.heads[:start - 1] if line.strip())
    station, date = (header.get(key, (0, ""))[1] for key in ("STATION ID", "EARTHQUAKE DATE"))
    return Record(acceleration=UNITS[name] * samples, dt=file_dt(text.path, step, dt), source=text.path, units=name,
                  title=f"{date} {station} {COMPONENTS[channel - 1]}".strip(),
                  format="AFAD", sha256=text.sha256, notes=lines, station=station, component=COMPONENTS[channel - 1])
