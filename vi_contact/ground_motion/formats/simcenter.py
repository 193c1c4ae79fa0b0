"""Read event files of the SimCenter tools (JSON): time series "name", "dT", "data", and patterns that explain them.

{"Events": [{"timeSeries": [{"name": "accel_X", "type": "Value", "dT": 0.01, "data": [...]}, ...],
"pattern": [{"type": "UniformAcceleration", "timeSeries": "accel_X", "dof": 1}, ...]}]}; the outer "Events" may be
missing. The unit of acceleration is not stated in such files.
"""

import json
from typing import Any

from ...core.checks import real, shown
from ...core.errors import InputError
from ..record import Record
from .text import HEAD, TextFile


def recognises(text: TextFile) -> bool:
    """Tell whether the first character begins a JSON object and a time series is mentioned."""
    return text.lines[0].lstrip().startswith("{") and any('"timeSeries"' in line for line in text.lines)


def read(text: TextFile) -> Record:
    """Return the record of one time series; units are required, channel (from 1) where there are several."""
    event, series = _series(text)
    chosen = series[text.chosen([_text(one.get("name")) for one in series])]
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
    if not isinstance(data, list) or len(data) < 2 or not all(abs(real(value)) < 1e300 for value in data):
        raise InputError(f"{text.path}: \"data\" of time series {name!r} is no list of two or more numbers; correct it")
    step = chosen.get("dT", event.get("dT"))
    if step is not None and not abs(real(step)) < 1e300:
        raise InputError(f"{text.path}: \"dT\" of time series {name!r} is {shown(step)}; give a number of seconds")
    title = _text(event.get("description")) or _text(event.get("name"))
    return text.record(data, units=None, dt=step, title=title, format="SimCenter", component=name)


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


def _text(value: Any) -> str:
    """Return a text of the file on one printable line: lone surrogates become question marks."""
    return " ".join(str(value)[:HEAD].encode("utf-8", "replace").decode().split()) if isinstance(value, str) else ""
