"""Record files for other programs: two columns, PEER AT2, OpenSees path series."""

import os

from ....core.arguments import checked
from ....core.errors import InputError
from ....core.files import write_output
from ..record import UNITS, Record, canonical_units

# significant digits of a written sample; what is read back differs by half a unit in the last of
# them
DIGITS = 9


@checked
def write_columns(record: Record, path: str | os.PathLike[str], units: str) -> None:
    """Write time [s] and acceleration in `units`.

    They stand after comment lines "#" with title, units, time step and notes.
    """
    samples, name = _samples(record, units)
    comments = [
        record.title,
        f"time [s], acceleration [{name}], dt = {record.dt:.10g} s",
        *record.notes,
    ]
    rows = [f"{time:.10g} {sample}" for time, sample in zip(record.times, samples, strict=True)]
    _write(path, [" ".join(["#", *comment.split()]) for comment in comments if comment] + rows)


@checked
def write_at2(record: Record, path: str | os.PathLike[str], units: str = "g") -> None:
    """Write PEER AT2: four header lines with units, NPTS and DT, then five values a row."""
    samples, name = _samples(record, units)
    header = [
        "PEER AT2 format, written by vi_contact",
        " ".join(record.title.split()) or "record",
        f"ACCELERATION TIME SERIES IN UNITS OF {name.upper()}",
        f"NPTS= {record.acceleration.size}, DT= {record.dt:.10g} SEC",
    ]
    rows = [
        "".join(f"{sample:>18}" for sample in samples[k : k + 5]) for k in range(0, len(samples), 5)
    ]
    _write(path, header + rows)


@checked
def write_path_series(record: Record, path: str | os.PathLike[str], units: str) -> None:
    """Write one value a line, as `timeSeries Path -filePath` of OpenSees reads.

    It needs -dt and units.
    """
    _write(path, _samples(record, units)[0])


def _samples(record: Record, units: str) -> tuple[list[str], str]:
    """Return the accelerations in `units` as text, and the key of UNITS."""
    name = canonical_units("output units", units)
    return [f"{value:.{DIGITS - 1}e}" for value in record.acceleration / UNITS[name]], name


def _write(path: str | os.PathLike[str], lines: list[str]) -> None:
    try:
        write_output(path, ("\n".join(lines) + "\n").encode("utf-8"))
    except OSError as error:
        raise InputError(
            f"{os.fspath(path)}: cannot be written ({error.strerror or error}); give another file, "
            "or mend what the system says"
        ) from error
