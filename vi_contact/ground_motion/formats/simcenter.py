"""Read event files of the SimCenter tools (JSON): time series "name", "dT", "data", and patterns that explain them.

{"Events": [{"timeSeries": [{"name": "accel_X", "type": "Value", "dT": 0.01, "data": [...]}, ...],
"pattern": [{"type": "UniformAcceleration", "timeSeries": "accel_X", "dof": 1}, ...]}]}; the outer "Events" may be
missing. The unit of acceleration is not stated in such files.
"""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from ...core.checks import shown
from ...core.errors import InputError
from ..record import UNITS, Record, file_dt, file_units
from .text import HEAD, TextFile


def recognises(text: TextFile) -> bool:
    """Tell whether the first character begins a JSON object and a time series is mentioned."""
    return text.lines[0].lstrip().startswith("{") and any('"timeSeries"' in line for line in text.lines)


def read(text: TextFile, units: str | None = None, dt: float | None = None, channel: int | None = None) -> Record:
    """Return the record of one time series; units are required, channel (from 1) where there are several.

    Raises InputError naming the file, and the line where it is not JSON: no series, several and none chosen, a velocity
    or displacement, a factor, data that are not numbers, no step.
    """
    event, series = _series(text)
    names = ", ".join(f"{k}: {_text(one.get('name')) or 'unnamed'}" for k, one in enumerate(series, 1))
    if channel is None and len(series) > 1:
        raise InputError(f"{text.path}: the file holds {len(series)} channels ({names}); pass channel=")
    if channel is not None and not 1 <= channel <= len(series):
        raise InputError(f"{text.path}: there is no channel {channel}; the file holds {names}")
    chosen = series[(channel or 1) - 1]
    name = _text(chosen.get("name"))
    patterns = event.get("pattern") or event.get("patterns")
    for pattern in patterns if isinstance(patterns, list) else []:
        kind = _text(pattern.get("type")) if isinstance(pattern, dict) else ""
        other = kind != "" and "acceleration" not in kind.lower()
        if other and _text(pattern.get("timeSeries")) == name:
            raise InputError(f"{text.path}: time series {name!r} is of type {kind!r}; give one of accelerations")
    if chosen.get("factor", 1.0) != 1.0:
        raise InputError(f"{text.path}: time series {name!r} has a factor {shown(chosen['factor'])}, whose meaning "
                         "differs between tools; put it into the data")
    data = chosen.get("data")
    if not isinstance(data, list) or len(data) < 2 or not all(_is_number(value) for value in data):
        raise InputError(f"{text.path}: \"data\" of time series {name!r} is no list of two or more numbers; correct it")
    step = chosen.get("dT", event.get("dT"))
    if step is not None and not _is_number(step):
        raise InputError(f"{text.path}: \"dT\" of time series {name!r} is {shown(step)}; give a number of seconds")
    unit = file_units(text.path, None, units)
    title = _text(event.get("description")) or _text(event.get("name"))
    return Record(acceleration=UNITS[unit] * np.array(data, dtype=float), dt=file_dt(text.path, step, dt), title=title,
                  source=text.path, format="SimCenter", units=unit, sha256=text.sha256, component=name)


def _series(text: TextFile) -> tuple[dict[str, Any], list[dict[str, Any]]]:
    """Return the first event that holds time series, and its series."""
    try:
        content = json.loads("\n".join(text.lines))
    except json.JSONDecodeError as error:
        raise InputError(f"{text.at(error.lineno - 1)}: this is not JSON ({error.msg}); correct it") from None
    except (RecursionError, ValueError):  # brackets in brackets in brackets, numbers of more digits than Python reads
        raise InputError(f"{text.path}: its JSON is nested too deep or holds a number too long; correct it") from None
    events = content.get("Events", [content])
    for event in events if isinstance(events, list) else []:
        series = event.get("timeSeries") if isinstance(event, dict) else None
        if isinstance(series, list) and series and all(isinstance(one, dict) for one in series):
            return event, series
    raise InputError(f"{text.path}: no event holds \"timeSeries\" with data; give the event file, not the workflow's")


def _is_number(value: Any) -> bool:
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return abs(value) < 1e300


def _text(value: Any) -> str:
    """Return a text of the file on one printable line: lone surrogates become question marks."""
    return " ".join(str(value)[:HEAD].encode("utf-8", "replace").decode().split()) if isinstance(value, str) else ""
