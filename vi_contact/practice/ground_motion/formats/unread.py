"""Name the formats that are known but not read, each in a sentence of its own."""

import re
from itertools import chain

from ....core.errors import InputError
from .text import TextFile

_KNOWN = (
    (
        re.compile(
            r"^\s*+(?:response and fourier|fourier|response) (?:amplitude )?spectr", re.IGNORECASE
        ),
        "this file holds spectra (volume 3); get the file of accelerations of the same record "
        "(volume 2, .V2)",
    ),
    (
        re.compile(r"^\s*+<(?:\?xml|!doctype html|html|q:quakeml|fdsnstationxml)", re.IGNORECASE),
        "this is an XML or HTML page and no record; download the file of the record itself",
    ),
    (
        re.compile(r"^\s*+[{\[]\s*+(?:[\"{\[\]}]|$)"),
        "this is a JSON file, which is not read; write its accelerations to a text file, one value "
        "a line",
    ),
    (
        re.compile(r"^(?:WID[12]|XW01|BEGIN (?:GSE|IMS))", re.IGNORECASE),
        "this is a GSE or IMS file, which is not read; convert it to columns, for example with "
        "ObsPy",
    ),
    (
        re.compile(r"^TIMESERIES \S+, \d+ samples", re.IGNORECASE),
        "this is a TSPAIR or SLIST file of EarthScope in counts, which is not read; remove the "
        "response and write columns, for example with ObsPy",
    ),
)
_SAC = (
    "this is an alphanumeric SAC file, which is not read; convert it to columns, for example "
    "with ObsPy"
)


def refuse_unread(text: TextFile) -> None:
    """Raise InputError where the first line that is not blank is of a format that is not read."""
    index = next((k for k, line in enumerate(text.heads) if line.strip()), 0)
    for pattern, sentence in _KNOWN:
        if pattern.search(text.heads[index]):
            raise InputError(f"{text.at(index)}: {sentence}")

    # Alphanumeric SAC: 14 lines of five reals, among them marks of what is not defined.
    rows = [line.split() for line in text.heads[:14]]
    words = set(chain.from_iterable(rows))
    undefined = words & {"-12345.00", "-12345.0", "-12345"}
    if undefined and len(text.heads) > 30 and all(len(row) == 5 for row in rows):
        raise InputError(f"{text.at(index)}: {_SAC}")
