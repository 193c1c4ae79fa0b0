"""Read text files of AFAD (Türkiye).

They have "KEY : value" lines, then three columns N-S, E-W, U-D in gal.
"""

from ....core.errors import InputError
from ..record import Record
from .text import TextFile

COMPONENTS = ("N-S", "E-W", "U-D")


def recognises(text: TextFile) -> bool:
    """Tell whether the title of the national network stands in the header, or its columns.

    With the columns their count has to stand there.
    """
    head = [line.strip().upper() for line in text.heads[:60]]
    titled = any(line.startswith("STRONG GROUND MOTION RECORDS OF TURK") for line in head)
    columns = any(tuple(line.split()) == COMPONENTS for line in head)
    return titled or columns and any(line.startswith("SAMPLING INTERVAL (SEC)") for line in head)


def read(text: TextFile) -> Record:
    """Return the record of one component; channel: 1 (N-S), 2 (E-W) or 3 (U-D).

    Nothing is subtracted.
    """
    channel = text.chosen(COMPONENTS)
    start = next(
        (k + 1 for k, line in enumerate(text.heads) if line.split() == list(COMPONENTS)), None
    )
    if start is None:
        raise InputError(
            f"{text.path}: no line 'N-S E-W U-D' announces the columns; get the complete file"
        )
    notes = [" ".join(line.split()) for line in text.heads[: start - 1]]
    parts = ((index, note.partition(":")) for index, note in enumerate(notes))
    header = {
        key.strip().upper(): (index, value.strip()) for index, (key, colon, value) in parts if colon
    }
    data = text.filled(start)
    samples = []
    text.refuse_misaligned(data)
    for index, row in zip(data, text.rows(data), strict=True):
        if len(row) != 3:
            raise InputError(
                f"{text.at(index)}: {len(row)} values instead of N-S, E-W and U-D; get the file "
                "again"
            )
        samples.append(row[channel])
    text.refuse_other_count(
        text.entry(header, "NUMBER OF DATA")[0],
        text.entry_number(header, "NUMBER OF DATA"),
        len(samples),
    )
    station, date = (header.get(key, (0, ""))[1] for key in ("STATION ID", "EARTHQUAKE DATE"))
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
