"""Read files of UNAM (Mexico), "ARCHIVO ESTANDAR DE ACELERACION".

They have lines "KEY : value", then a column for each channel, in gal.
"""

import re

from ....core.errors import InputError
from ..record import Record
from .statements import agree
from .text import TextFile

_FORMAT = re.compile(r"^(\d++)F(\d++)\.(\d++)$", re.IGNORECASE)
_KEY = re.compile(r"^\s*+([^:]*[^:\s])\s*+:(.*+)$")


def recognises(text: TextFile) -> bool:
    """Tell whether the title of the format, or the beginning of its data, stands in the header."""
    head = text.heads[:200]
    titled = any("ARCHIVO ESTANDAR DE ACELERACION" in line.upper() for line in head)
    return titled or any(line.strip().upper() == "DATOS DE ACELERACION:" for line in head)


def read(text: TextFile) -> Record:
    """Return the record of one channel.

    ``channel`` is its number, from 1, or its direction such as "N00E".
    """
    start = next(
        (k for k, line in enumerate(text.heads) if line.strip().upper() == "DATOS DE ACELERACION:"),
        None,
    )
    if start is None:
        raise InputError(
            f"{text.path}: no line 'DATOS DE ACELERACION:' announces the columns; get the complete "
            "file"
        )
    header: dict[str, tuple[int, str]] = {}
    for index in range(start):
        entry = _KEY.match(text.heads[index])
        if entry and entry[1].strip():
            key = " ".join(entry[1].split()).upper()
            header.setdefault(key, (index, entry[2].strip()))
    form_line, form = _get_entry(text, header, "FORMATO DATOS")
    fields = _FORMAT.match(form)
    if fields is None:
        raise InputError(
            f"{text.at(form_line)}: the format {form!r} of the data is not like '3F10.4'; get the "
            "file again"
        )
    channels = int(fields[1])
    width = int(fields[2])
    _, directions = _get_entry(text, header, "ORIENTACION C1")
    names = _split(directions)
    if len(names) != channels or width < 1:
        raise InputError(
            f"{text.at(form_line)}: the data have {channels} columns and the header names "
            f"{len(names)} directions; get the file again"
        )
    place = text.choose(names)
    data = _find_first_row(text, start)
    values: list[float] = []
    lines = text.find_filled(data)
    for index in lines:
        row = text.cut_fields(index, width)
        if len(row) != channels:
            raise InputError(
                f"{text.at(index)}: {len(row)} values instead of {channels}, one of each channel; "
                "a value is missing or too many, get the complete file"
            )
        values.append(row[place])
    count_line, counts = _get_entry(text, header, "NUM. TOTAL DE MUESTRAS, C1")
    count = _read_number(text, count_line, counts, place)
    text.refuse_other_count(count_line, count, len(values))
    step_line, step = _read_step(text, header, place, count)
    units_line, units = _get_entry(text, header, "UNIDADES DE LOS DATOS")
    _, station = header.get("CLAVE DE LA ESTACION", (0, ""))
    _, date = header.get("FECHA DEL SISMO [GMT]", (0, ""))
    _, hour = header.get("HORA EPICENTRO (GMT)", (0, ""))
    filled_lines = [index for index, content in header.values() if content]
    notes = tuple(" ".join(text.heads[index].split()) for index in filled_lines)
    return text.record(
        values,
        units=units.partition("(")[0] or units,
        line=units_line,
        dt=step,
        lines=lines,
        format="UNAM",
        title=f"{date} {hour} {station}".strip(),
        station=station,
        component=names[place],
        notes=notes,
        dt_from=f"header, line {step_line + 1}",
    )


def _get_entry(text: TextFile, header: dict[str, tuple[int, str]], start: str) -> tuple[int, str]:
    """Return the line and the value of the entry whose key begins so.

    Raises InputError where it is missing or empty.
    """
    for key, (line, value) in header.items():
        if key.startswith(start) and value:
            return line, value
    raise InputError(f"{text.path}: the header does not give {start!r}; get the complete file")


def _split(value: str) -> list[str]:
    """Return the parts of "/200/200/200"."""
    return [part.strip() for part in value.strip().lstrip("/").split("/")]


def _read_number(text: TextFile, line: int, value: str, place: int) -> float:
    """Return the number of one channel of "/200/200/200".

    Args:
        text: the file.
        line: index of the line, for messages.
        value: numbers of all channels, between slashes.
        place: number of the channel, from 0.
    """
    parts = _split(value)
    return text.number(line, parts[place] if place < len(parts) else "", " of the channel")


def _read_step(
    text: TextFile, header: dict[str, tuple[int, str]], place: int, count: float
) -> tuple[int, float]:
    """Return the line of the time step, and the step [s].

    The sampling rate and the duration must confirm it.

    Args:
        text: the file.
        header: its entries.
        place: number of the channel, from 0.
        count: number of samples.
    """
    line, steps = _get_entry(text, header, "INTERVALO DE MUESTREO, C1")
    step = _read_number(text, line, steps, place)
    statements = [(line, step)]
    rate_line, rates = _get_entry(text, header, "VEL. DE MUESTREO, C1")
    rate = _read_number(text, rate_line, rates, place)
    if rate > 0.0:
        statements.append((rate_line, 1.0 / rate))
    agree(text, "the time step", statements, rounding=1e-3)
    seconds_line, seconds = _get_entry(text, header, "DURACION DEL REGISTRO (S), C1")
    duration = _read_number(text, seconds_line, seconds, place)
    if not abs(duration - count * step) <= 1.01 * step + 0.01:
        raise InputError(
            f"{text.at(seconds_line)}: {duration:g} s are announced but {count:g} samples at "
            f"{step:g} s follow; get the complete file"
        )
    return line, step


def _find_first_row(text: TextFile, start: int) -> int:
    """Return the index of the line after the second ruler, or after the line of directions."""
    near = range(start, min(start + 8, len(text.lines)))
    rulers = [k for k in near if text.heads[k].strip().startswith("-----")]
    if len(rulers) < 2:
        raise InputError(
            f"{text.at(start)}: the names of the columns do not stand between two rulers '-----'; "
            "get the complete file"
        )
    return rulers[-1] + 1
