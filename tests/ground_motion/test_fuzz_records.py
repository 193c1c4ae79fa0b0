"""Mutated records of every format: refused in one sentence, or read with the numbers that the file holds.

The second opinion knows nothing of the readers: it takes the last numbers of the file, as many as the record has, and
the count and the step that a simple pattern finds in the header.
"""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import numpy as np
import pytest
from record_files import AFAD, VALUES, cosmos, csmip, esm, knet, smc

from vi_contact.core.errors import InputError
from vi_contact.ground_motion import UNITS, Record, read_record

pytestmark = pytest.mark.serial
COUNT = 1200
G10 = 98.0665
TABLE = "".join(f"{0.02 * k:.2f};{v:.4f}\n" for k, v in enumerate(VALUES))
AT2 = "PEER NGA\nA TITLE, 5/19/40\nACCELERATION TIME SERIES IN UNITS OF CM/S2\nNPTS=    11, DT=   .0200 SEC\n"
SEEDS: dict[str, tuple[str, dict[str, Any]]] = {
    "at2": (AT2 + "".join(f"{v:15.7E}" + "\n" * (k % 5 == 4) for k, v in enumerate(VALUES)), {}),
    "csmip": (csmip(), {}),
    "csmip, two channels": (csmip() + csmip(2), {"channel": 2}),
    "cosmos": (cosmos(), {}),
    "smc": (smc(), {}),
    "knet": (knet(), {}),
    "esm": (esm(), {}),
    "afad": (AFAD, {"channel": 2}),
    "columns": ("# a title\n" + TABLE.replace(";", " "), {"units": "gal"}),
    "semicolons": (TABLE, {"units": "gal"}),
    "decimal commas": (TABLE.replace(".", ","), {"units": "gal"}),
    "path series": ("".join(f"{v:.6e}\n" for v in VALUES), {"units": "gal", "dt": 0.02}),
    "path in rows": ("".join(f"{v:12.5e}" + "\n" * (k % 4 == 3) for k, v in enumerate(VALUES)),
                     {"units": "gal", "dt": 0.02}),
}
NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[EeDd][+-]?\d+)?"
PIECES = ["NaN", "inf", "1e400", "1" * 400, "1e305", ",", ";", "0,5", "-", ".", " ", "\t", "\n", "*", "E", "\0", "\xe9",
          "(", "1.2.3"]


def mutated(text: str, random: Random) -> str:
    """One to three accidents: bits flipped; lines lost, doubled, cut, exchanged; fields swapped; odd pieces; blocks."""
    for _ in range(random.choice((1, 1, 1, 2, 3))):
        lines = text.split("\n")
        at, other = random.randrange(len(lines)), random.randrange(len(lines))
        line = lines[at]
        place = random.randrange(len(line) + 1)
        kind = random.randrange(11)
        if kind == 0 and line:
            place = random.randrange(len(line))
            lines[at] = line[:place] + chr(ord(line[place]) ^ 1 << random.randrange(7)) + line[place + 1:]
        elif kind == 1:
            del lines[at]
        elif kind == 2:
            lines.insert(at, line)
        elif kind == 3:
            lines[at] = line[:place]
        elif kind == 4:
            lines[at], lines[other] = lines[other], lines[at]
        elif kind == 5:
            words = re.split(r"(\s+)", line)
            random.shuffle(words)
            lines[at] = "".join(words)
        elif kind == 6:
            lines[at] = line[:place] + random.choice(PIECES) + line[place:]
        elif kind == 7:
            lines[at] = re.sub(NUMBER, lambda _: random.choice(PIECES), line, count=1)
        elif kind == 8:
            lines = lines[:max(at, other)] + lines[min(at, other):]
        elif kind == 9:
            lines = lines[:at] + lines[other:]
        else:
            lines = lines[:at]
        text = "\n".join(lines)
    return text


def numbers(text: str, *, decimal: bool = False) -> list[float]:
    """All that looks like a number, in order."""
    found = re.findall(NUMBER, text.replace(",", ".") if decimal else text)
    return [float(word.upper().replace("D", "E")) for word in found]


def fixed(lines: list[str], width: int) -> list[float]:
    """Numbers in columns."""
    return [float(line.rstrip()[k:k + width].upper().replace("D", "E")) for line in lines
            for k in range(0, len(line.rstrip()), width)]


def said(pattern: str, text: str) -> float | None:
    """The last number that a header states so."""
    found = re.findall(pattern, text, re.IGNORECASE | re.MULTILINE)
    return float(found[-1].upper().replace("D", "E")) if found else None


Opinion = tuple[list[float], float | None, float | None]  # samples in the file's units, count, step


def of_at2(text: str, record: Record, options: dict[str, Any]) -> Opinion:
    values = numbers(text)[-record.acceleration.size:]
    start = text.split("*** Begin data")[0][:2000]
    dt = rf"\bDT[^\S\n]*[=:][^\S\n]*({NUMBER})"
    return values, said(r"\bNPTS[^\S\n]*[=:][^\S\n]*(\d+)", start), said(dt, start)


def of_blocks(text: str, record: Record, options: dict[str, Any]) -> Opinion:
    """The lines after the one that announces accelerations, the last of the channel chosen."""
    lines = text.split("\n")
    announced = re.compile(r"\s*\d+\s.*\baccel.*\(\d*(?:1P)?[FE]\d+", re.IGNORECASE)
    found = [k for k, line in enumerate(lines) if announced.match(line)]
    at = [k for k in found if int(lines[k].split()[0]) == record.acceleration.size and close(
        column_values(lines, k, record.acceleration.size), record)]
    assert at, found
    step = said(rf"equally[- ]spaced\s+at\s+({NUMBER})", lines[at[0]])
    return column_values(lines, at[0], record.acceleration.size), record.acceleration.size, step


def column_values(lines: list[str], at: int, count: int) -> list[float]:
    stated = re.findall(r"\((\d*)(?:1P)?[FEfe](\d+)[^()]*\)", lines[at])
    per_line, width = (int(part or 1) for part in stated[0]) if stated else (8, 10)
    try:
        return fixed(lines[at + 1:at + 1 - (-count // per_line)], width)
    except ValueError:
        return []


def close(values: list[float], record: Record) -> bool:
    return len(values) == record.acceleration.size and np.allclose(
        record.acceleration, UNITS[record.units] * np.array(values), rtol=1e-12, atol=0.0)


def of_smc(text: str, record: Record, options: dict[str, Any]) -> Opinion:
    lines = text.split("\n")
    comments, count = int(float(lines[12][70:80])), int(float(lines[13][0:10]))
    return fixed(lines[27 + comments:], 10), count, 1.0 / float(lines[17][15:30])


def of_knet(text: str, record: Record, options: dict[str, Any]) -> Opinion:
    top, bottom = re.findall(rf"^Scale Factor.*?({NUMBER})\s*\([^()]*\)\s*/\s*({NUMBER})", text, re.MULTILINE)[-1]
    counts = np.array(numbers(text.rpartition("Memo.")[2].partition("\n")[2]))
    rate = said(rf"^Sampling Freq\(Hz\)\s*({NUMBER})", text)
    seconds = said(rf"^Duration Time\(s\)\s*({NUMBER})", text)
    assert rate and seconds
    samples = float(top) / float(bottom) * (counts - np.mean(counts))
    return list(samples), round(rate * seconds), 1.0 / rate


def of_esm(text: str, record: Record, options: dict[str, Any]) -> Opinion:
    values = numbers(text)[-record.acceleration.size:]
    return values, said(rf"^\s*NDATA\s*:\s*({NUMBER})", text), said(rf"^\s*SAMPLING_INTERVAL_S\s*:\s*({NUMBER})", text)


def of_afad(text: str, record: Record, options: dict[str, Any]) -> Opinion:
    values = numbers(text)[-3 * record.acceleration.size:][options["channel"] - 1::3]
    count = said(rf"NUMBER\s+OF\s+DATA\s*:\s*({NUMBER})", text)
    return values, count, said(rf"INTERVAL\s+\(SEC\)\s*:\s*({NUMBER})", text)


def of_columns(text: str, record: Record, options: dict[str, Any]) -> Opinion:
    lines = [line for line in text.split("\n") if line.strip() and not line.lstrip().startswith("#")]
    data = "\n".join(lines)
    decimal = ";" in data and "." not in data
    if "dt" in options:
        return numbers(data, decimal=decimal)[-record.acceleration.size:], None, options["dt"]
    pairs = np.array(numbers(data, decimal=decimal)).reshape(-1, 2)
    return list(pairs[:, 1]), None, float(np.median(np.diff(pairs[:, 0])))


OPINIONS: dict[str, Callable[[str, Record, dict[str, Any]], Opinion]] = {
    "PEER AT2": of_at2, "CSMIP": of_blocks, "COSMOS": of_blocks, "USGS SMC": of_smc, "K-NET": of_knet, "ESM": of_esm,
    "AFAD": of_afad, "columns": of_columns,
}


def check(text: str, record: Record, options: dict[str, Any]) -> None:
    """Finite numbers, plausible, and those of the file."""
    values, count, step = OPINIONS[record.format](text, record, options)
    samples = UNITS[record.units] * np.array(values, dtype=float)
    assert np.all(np.isfinite(record.acceleration)) and np.max(np.abs(record.acceleration)) <= G10
    assert record.acceleration.shape == samples.shape
    assert np.allclose(record.acceleration, samples, rtol=1e-12, atol=1e-14)
    assert count is None or count == record.acceleration.size
    assert step is None or np.isclose(step, record.dt, rtol=2e-6)


@pytest.mark.parametrize("name", SEEDS)
def test_mutated_records(name: str, tmp_path: Path) -> None:
    seed, options = SEEDS[name]
    random, read, path = Random(name), 0, tmp_path / "record.txt"
    for number in range(COUNT // len(SEEDS)):
        text = seed if number == 0 else mutated(seed, random)
        path.write_bytes(text.encode("latin-1", "replace"))
        try:
            record = read_record(path, **options)
        except InputError as error:
            assert str(path) in str(error) and "\n" not in str(error) and len(str(error)) < 700
            assert number, error
            continue
        check(text, record, options)
        read += 1
    assert 5 < read < COUNT // len(SEEDS) - 5
