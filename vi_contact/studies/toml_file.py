"""Reads TOML files, and sets single values of what was read; every mistake is one sentence with the file."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ..errors import InputError

_REASON = re.compile(r"^(.*) \(at (?:line (\d+), column (\d+)|end of document)\)", re.DOTALL)


def read_toml(path: str | Path) -> dict[str, Any]:
    """The tables of a file. InputError with file, line and reason when it cannot be read or is no TOML."""
    try:
        text = Path(path).read_bytes().decode("utf-8")
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such file; give the path of a case file") from None
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}); give the path of a case file") from None
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: byte {error.start} is no UTF-8 text; save the case file as UTF-8") from None
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        reason, place = _reason(str(error), text)
        raise InputError(f"{path}, {place}: {reason}; correct the TOML there") from None


def _reason(said: str, text: str) -> tuple[str, str]:
    """(what is wrong, "line 3, column 7") of tomllib's sentence."""
    found = _REASON.fullmatch(said)
    if found is None:
        return said, f"line {text.count(chr(10)) + 1}"
    if found[2] is None:
        return found[1], f"line {max(len(text.splitlines()), 1)} (its end)"
    return found[1], f"line {found[2]}, column {found[3]}"


def with_settings(tables: dict[str, Any], settings: Sequence[str]) -> dict[str, Any]:
    """A copy of the tables with KEY=VALUE settings made; what is missing on the way to a key is added.

    KEY: names joined by dots; entries of lists are counted from 1 ("excitation.1.scale"). VALUE: as in TOML; what is no
    TOML is text. Raises InputError for a setting without "=", an entry that is not there, a way through a plain value.
    """
    result = _copied(tables)
    for setting in settings:
        key, equals, value = setting.partition("=")
        if not equals or not key.strip():
            raise InputError(f"setting '{setting}': give KEY=VALUE, such as friction.mu=0.5")
        _set(result, key.strip().split("."), _value(value.strip()), setting)
    return result


def _copied(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _copied(one) for key, one in value.items()}
    return [_copied(one) for one in value] if isinstance(value, list) else value


def _value(text: str) -> Any:
    try:
        found = tomllib.loads(f"value = {text}")
    except tomllib.TOMLDecodeError:
        return text
    return found["value"] if set(found) == {"value"} else text


def _set(there: Any, way: list[str], value: Any, setting: str) -> None:
    for name in way[:-1]:
        place = _place(there, name, setting)
        if isinstance(there, dict):
            there.setdefault(place, {})
        there = there[place]
    there[_place(there, way[-1], setting)] = value


def _place(there: Any, name: str, setting: str) -> Any:
    """The key, or the index, of a name of the way."""
    if isinstance(there, dict):
        return name
    if not isinstance(there, list):
        raise InputError(f"setting '{setting}': what comes before '{name}' is a plain value; shorten the key")
    if not name.isdecimal() or not 1 <= int(name) <= len(there):
        raise InputError(f"setting '{setting}': there is no entry '{name}'; give a number from 1 to {len(there)}")
    return int(name) - 1
