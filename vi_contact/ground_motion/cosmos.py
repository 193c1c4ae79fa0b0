"""COSMOS and CSMIP files (.V1, .V2, .V2c): one or more channels, each with text, numbers and blocks of samples.

A block begins with a line that states its number of points, quantity, units and Fortran format, such as
"7500 points of accel data equally spaced at .010 sec, in cm/sec2. (8f10.6)" (CSMIP) or
"12091 acceleration pts, approx 120 secs, units=cm/sec2(04),Format=(8F10.5)" (COSMOS), the time step of the latter being
real number 34 of its header. Without a stated format it is (8F10.3). Samples are cut by column, for they may touch.
Velocities and displacements are skipped.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from ..algebra import Array
from ..errors import InputError
from .record import UNITS, Record, file_dt, file_units
from .text import NUMBER, TextFile, to_float

STEP = 33
"""Place of the time step among the real header values of COSMOS, from 0."""

_FIRST = re.compile(r"^\s*(?:un)?corrected accelerogram|\(\s*format\s+v[\d.]+ with \d+ text lines", re.IGNORECASE)
_BLOCK = re.compile(r"^\s*(\d+)\s+.*?\b(accel|veloc|displ)\w*\.?.*?(?:\bpts\b|\bspaced\b|\bdata\b)", re.IGNORECASE)
_FORMAT = re.compile(r"\(\s*(\d*)\s*(?:1P)?[FEIDG](\d+)[^)]*\)", re.IGNORECASE)
_UNITS = (re.compile(r"units?\s*(?:[=:]|\bof\b)\s*(g/10|[^,()\s]+)", re.IGNORECASE),
          re.compile(r"\bin\s+(g/10|cm/s(?:ec)?[*^]*2|cm/s(?:ec)?/s(?:ec)?|g)\b", re.IGNORECASE))
_SPACED = re.compile(rf"equally[- ]spaced\s+(?:at|intervals\s+of)\s+({NUMBER})\s*sec", re.IGNORECASE)
_RATE = re.compile(rf"\bat\s+({NUMBER})\s*pts/sec", re.IGNORECASE)
_REALS = re.compile(r"^\s*(\d+)\s+real-header values follow on\s+(\d+)\s+lines", re.IGNORECASE)
_CHANNEL = re.compile(r"\bchan?:?\s+([\w?]+):\s*([^(]*?)\s*(?:\(|\bfrom\b|$)", re.IGNORECASE)
_STATION = re.compile(r"\bstat(?:io)?n\s*(?:no|id)[.:]\s*(?:.*?\bcode:\s*)?(\S+)", re.IGNORECASE)
_EVENT = re.compile(r"re?co?rd of", re.IGNORECASE)
_UNKNOWN = re.compile(rf"unknown/unspecified:\s*{NUMBER}[,\s]+({NUMBER})", re.IGNORECASE)


@dataclass(frozen=True)
class Block:
    """Samples announced on lines[line]: `count` in columns of `width`, `per_line` a line; header: its lines."""

    line: int
    header: range
    count: int
    per_line: int
    width: int

    @property
    def end(self) -> int:
        """Index of the line after the samples."""
        return self.line + 1 + -(-self.count // self.per_line)


def recognises(text: TextFile) -> bool:
    """Whether the first line is that of a COSMOS or CSMIP file of any volume."""
    return _FIRST.search(text.lines[0]) is not None


def read(text: TextFile, units: str | None = None, dt: float | None = None, channel: int | None = None) -> Record:
    """The record of one channel; channel: 1 for the first of the file, required where it holds several.

    Raises InputError naming the file, mostly with a line: no acceleration in it, several channels, samples missing,
    unequal steps, counts instead of accelerations, an unknown sample, text where a number should be.
    """
    blocks = _blocks(text)
    if not blocks:
        raise InputError(f"{text.at(0)}: no block of accelerations follows; get the corrected accelerations (V2)")
    block = _chosen(text, blocks, channel)
    line = text.lines[block.line]
    if re.search(r"unequally", line, re.IGNORECASE):
        raise InputError(f"{text.at(block.line)}: the samples are unequally spaced; get the corrected file (V2)")
    stated = next((match[1] for match in (pattern.search(line) for pattern in _UNITS) if match), None)
    name = file_units(text.at(block.line), stated, units)
    words, comments = _words(text, block)
    cosmos = "format v" in text.lines[0].lower()
    event = next(filter(_EVENT.match, words), " ".join(words[1:2] if cosmos else words[2:3]))
    return Record(acceleration=UNITS[name] * _samples(text, block), dt=file_dt(text.path, _step(text, block), dt),
                  title=event, source=text.path, units=name, sha256=text.sha256,
                  format="COSMOS" if cosmos else "CSMIP", notes=(*words, *comments),
                  station=_station(text, block), component=_component(text, block))


def _blocks(text: TextFile) -> list[Block]:
    """The blocks of accelerations; blocks of other quantities belong to the channel before them."""
    found, index, start = [], 0, 0
    while index < len(text.lines):
        match = _BLOCK.match(text.lines[index])
        form = _FORMAT.search(text.lines[index])
        if match and (form or _SPACED.search(text.lines[index])):
            per_line, width = (int(form[1] or 1), int(form[2])) if form else (8, 10)
            block = Block(index, range(start, index), int(match[1]), max(per_line, 1), max(width, 1))
            if match[2].lower() == "accel":
                found.append(block)
            index = start = block.end
        elif re.match(r"\s*(?:end-of-data|/&)", text.lines[index], re.IGNORECASE):
            index = start = index + 1
        else:
            index += 1
    return found


def _words(text: TextFile, block: Block) -> tuple[list[str], list[str]]:
    """The text of a channel's header, which ends where its numbers begin, and its comments, blanks squeezed."""
    header = [" ".join(text.lines[index].split()) for index in block.header]
    numbers = (k for k, entry in enumerate(header) if re.fullmatch(r"[\s\d-]+", entry) or "header values" in entry)
    comments = [entry.lstrip("| ") for entry in header if entry.startswith("|")]
    return [entry for entry in header[:next(numbers, len(header))] if entry], [entry for entry in comments if entry]


def _chosen(text: TextFile, blocks: list[Block], channel: int | None) -> Block:
    """The block of a channel; InputError that lists them when there are several and none is named."""
    names = ", ".join(f"{k}: {_component(text, block) or 'unnamed'}" for k, block in enumerate(blocks, 1))
    if channel is None and len(blocks) > 1:
        raise InputError(f"{text.path}: the file holds {len(blocks)} channels ({names}); pass channel=")
    if channel is not None and not 1 <= channel <= len(blocks):
        raise InputError(f"{text.path}: there is no channel {channel}; the file holds {names}")
    return blocks[(channel or 1) - 1]


def _samples(text: TextFile, block: Block) -> Array:
    """The samples in the file's units, shape (count,)."""
    marks = filter(None, (_UNKNOWN.search(text.lines[index]) for index in block.header))
    unknown = next((to_float(mark[1]) for mark in marks), None)
    values: list[float] = []
    for index in range(block.line + 1, block.end):
        row = text.fixed(index, block.width) if index < len(text.lines) else []
        if len(row) != min(block.per_line, block.count - len(values)):
            raise InputError(f"{text.at(block.line)}: {block.count} samples are announced but line {index + 1} holds "
                             f"{len(row)} of them instead of {min(block.per_line, block.count - len(values))}; get the "
                             "complete file")
        if unknown in row:
            raise InputError(f"{text.at(index)}: a sample is marked as unknown ({unknown:g}); use another record")
        values += row
    return np.array(values)


def _step(text: TextFile, block: Block) -> float | None:
    """The time step stated with the samples, in the text of the header or among its real numbers."""
    rate = _RATE.search(text.lines[block.line])
    if rate and to_float(rate[1]) > 0.0:
        return 1.0 / to_float(rate[1])
    for index in (block.line, *block.header):
        spaced = _SPACED.search(text.lines[index])
        if spaced:
            return to_float(spaced[1])
    for index in block.header:
        reals, form = _REALS.match(text.lines[index]), _FORMAT.search(text.lines[index])
        if reals and form:
            rows = range(index + 1, min(index + 1 + int(reals[2]), block.line))
            values = [value for row in rows for value in text.fixed(row, int(form[2]))]
            return values[STEP] if len(values) > STEP and values[STEP] > 0.0 else None
    return None


def _component(text: TextFile, block: Block) -> str:
    """Direction of the channel, such as "90 Deg" or "UP", from the text of its header."""
    found = (_CHANNEL.search(text.lines[index]) for index in block.header)
    return next((" ".join(match[2].split()) for match in found if match and match[2]), "")


def _station(text: TextFile, block: Block) -> str:
    """Number or code of the station, from the text of the header."""
    match = next(filter(None, (_STATION.search(text.lines[index]) for index in block.header)), None)
    return match[1] if match else ""
