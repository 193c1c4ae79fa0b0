"""Read text files of AFAD (Türkiye): "KEY : value" lines, then columns N-S, E-W, U-D in gal."""

from ....core.errors import InputError
from ..record import Record
from .text import TextFile

COMPONENTS = ("N-S", "E-W", "U-D")


def recognises(text: TextFile) -> bool:
    """Tell whether the header has the title of the national network, or its columns and step."""
    head = [line.strip().upper() for line in text.heads[:60]]
    titled = any(line.startswith("STRONG GROUND MOTION RECORDS OF TURK") for line in head)
    columns = any(tuple(line.split()) == COMPONENTS for line in head)
    step = any(line.startswith("SAMPLING INTERVAL (SEC)") for line in head)
    return titled or (columns and step)


def read(text: TextFile) -> Record:
    """Return the record of one component; channel: 1 (N-S), 2 (E-W) or 3 (U-D).

    Nothing is subtracted.
    """
    channel = text.choose(COMPONENTS)
    columns_line = next(
        (k for k, line in enumerate(text.heads) if line.split() == list(COMPONENTS)), None
    )
    if columns_line is None:
        raise InputError(
            f"{text.path}: no line 'N-S E-W U-D' announces the columns; get the complete file"
        )
    notes = [" ".join(line.split()) for line in text.heads[:columns_line]]
    header = {}
    for index, note in enumerate(notes):
        key, colon, value = note.partition(":")
        if colon:
            header[key.strip().upper()] = (index, value.strip())

    data = text.find_filled(columns_line + 1)
    samples = []
    text.refuse_misaligned(data)
    for index, row in zip(data, text.rows(data), strict=True):
        if len(row) != 3:
            raise InputError(
                f"{text.at(index)}: {len(row)} values instead of N-S, E-W and U-D; get the file "
                "again"
            )
        samples.append(row[channel])
    count_line, _ = text.entry(header, "NUMBER OF DATA")
    count = text.entry_number(header, "NUMBER OF DATA")
    text.refuse_other_count(count_line, count, len(samples))
    _, station = header.get("STATION ID", (0, ""))
    _, date = header.get("EARTHQUAKE DATE", (0, ""))
    step = text.entry_number(header, "SAMPLING INTERVAL (SEC)")
    return text.record(
        samples,
        lines=data,
        units="gal",
        dt=step,
        format="AFAD",
        title=f"{date} {station} {COMPONENTS[channel]}".strip(),
        station=station,
        notes=tuple(filter(None, notes)),
        component=COMPONENTS[channel],
    )
