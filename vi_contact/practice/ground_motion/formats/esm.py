"""Read files of the Engineering Strong-Motion database, ESM and ITACA, and alike of AFAD.

They have 64 lines "KEY: value", then a sample a line. Read DATA_LICENSE and DATA_CITATION, kept in
the notes, before passing a record on.
"""

import re
from itertools import takewhile

from ....core.errors import InputError
from ..record import Record
from .text import TextFile

_KEY = re.compile(r"[A-Z][A-Z0-9_/^ ]*+")


def recognises(text: TextFile) -> bool:
    """Tell whether line 1 is an entry "KEY: value", and one of the first 100 is of such a file."""
    entries = [_split_entry(line) for line in text.heads[:100]]
    if entries[0] is None:
        return False
    keys = {entry[0] for entry in entries if entry is not None}
    return not keys.isdisjoint(("EVENT_NAME", "SAMPLING_INTERVAL_S", "NDATA"))


def read(text: TextFile) -> Record:
    """Return the record of an ESM ASCII file; units and dt are only checked."""
    entries = list(takewhile(bool, map(_split_entry, text.heads)))
    header = {entry[0]: (index, entry[1]) for index, entry in enumerate(entries) if entry}
    index, kind = header.get("DATA_TYPE", (0, "ACCELERATION"))
    if kind and "ACCELERATION" not in kind.upper():
        raise InputError(
            f"{text.at(index)}: the file holds {kind.lower()}; get the file of accelerations "
            "(.ACC.ASC)"
        )
    values, lines = text.series(len(entries))
    count_line, _ = text.entry(header, "NDATA")
    text.refuse_other_count(count_line, text.entry_number(header, "NDATA"), len(values))
    line, units = text.entry(header, "UNITS")
    value = {key: content for key, (_, content) in header.items()}
    station = ".".join(filter(None, (value.get("NETWORK"), value.get("STATION_CODE"))))
    title_parts = (
        value.get("EVENT_NAME"),
        value.get("EVENT_DATE_YYYYMMDD"),
        value.get("EVENT_TIME_HHMMSS"),
        station,
        value.get("STREAM"),
    )
    notes = []
    for key, content in value.items():
        if content and not key.startswith("USER"):
            notes.append(f"{key}: {content}")
    return text.record(
        values,
        units=units,
        line=line,
        lines=lines,
        dt=text.entry_number(header, "SAMPLING_INTERVAL_S"),
        format="ESM",
        title=" ".join(filter(None, title_parts)),
        notes=tuple(notes),
        station=station,
        component=value.get("STREAM", ""),
    )


def _split_entry(line: str) -> tuple[str, str] | None:
    """Return the key and the value of a line "KEY: value", or None for any other line."""
    key, colon, value = (part.strip() for part in line.partition(":"))
    return (key, value) if colon and _KEY.fullmatch(key) else None
