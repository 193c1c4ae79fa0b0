"""Write record files for other programs: two columns, PEER AT2, OpenSees path series."""

import os

from ....core.arguments import check_arguments
from ....core.errors import InputError
from ....core.files import write_output
from ..record import UNITS, Record, canonical_units

# significant digits of a written sample; what is read back differs by half a unit in the last of
# them
DIGITS = 9


@check_arguments
def write_columns(record: Record, path: str | os.PathLike[str], units: str) -> None:
    """Write time and acceleration after comment lines "#" with title, units, step and notes.

    Args:
        record: the motion.
        path: of the file.
        units: of the accelerations, a key of UNITS; times are in s.
    """
    samples, name = _print_samples(record, units)
    comments = [
        record.title,
        f"time [s], acceleration [{name}], dt = {record.dt:.10g} s",
        *record.notes,
    ]
    header = [" ".join(["#", *comment.split()]) for comment in comments if comment]
    rows = [f"{time:.10g} {sample}" for time, sample in zip(record.times, samples, strict=True)]
    _write(path, header + rows)


@check_arguments
def write_at2(record: Record, path: str | os.PathLike[str], units: str = "g") -> None:
    """Write PEER AT2: four header lines with units, NPTS and DT, then five values a row.

    Args:
        record: the motion.
        path: of the file.
        units: of the accelerations, a key of UNITS.
    """
    samples, name = _print_samples(record, units)
    header = [
        "PEER AT2 format, written by vi_contact",
        " ".join(record.title.split()) or "record",
        f"ACCELERATION TIME SERIES IN UNITS OF {name.upper()}",
        f"NPTS= {record.acceleration.size}, DT= {record.dt:.10g} SEC",
    ]
    cells = [f"{sample:>18}" for sample in samples]
    rows = ["".join(cells[k : k + 5]) for k in range(0, len(cells), 5)]
    _write(path, header + rows)


@check_arguments
def write_path_series(record: Record, path: str | os.PathLike[str], units: str) -> None:
    """Write one value a line, for `timeSeries Path -filePath` of OpenSees, which needs -dt.

    Args:
        record: the motion.
        path: of the file.
        units: of the accelerations, a key of UNITS.
    """
    samples, _ = _print_samples(record, units)
    _write(path, samples)


def _print_samples(record: Record, units: str) -> tuple[list[str], str]:
    """Return the accelerations in `units` as text, and the key of UNITS."""
    name = canonical_units("output units", units)
    values = record.acceleration / UNITS[name]
    return [f"{value:.{DIGITS - 1}e}" for value in values], name


def _write(path: str | os.PathLike[str], lines: list[str]) -> None:
    """Write the lines, or raise InputError where the system does not let us."""
    try:
        write_output(path, ("\n".join(lines) + "\n").encode("utf-8"))
    except OSError as error:
        raise InputError(
            f"{os.fspath(path)}: cannot be written ({error.strerror or error}); give another file, "
            "or mend what the system says"
        ) from error
