"""Read TOML files, and set single values of what was read.

Every mistake is one sentence with the file.
"""

import json
import math
import re
import tomllib
from collections.abc import Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any

from ....core.checks import quote
from ....core.errors import InputError

BYTES, DEPTH = 10_000_000, 20  # of a case file; of tables and lists in each other
_TOO_DEEP = "is nested too deep: write tables and lists as docs/guide/studies.md does"
_TOO_LONG = "holds a whole number beyond 64 bits: write it with a point, as 1.0e30"
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+"""
_CHAIN = re.compile(rf"(?<![\w-])(?:{_PART}){{{DEPTH}}}")  # a key of many parts


def read_toml(path: str | Path) -> dict[str, Any]:
    """Return the tables of a file.

    InputError with file, line and reason when it cannot be read or is no TOML.
    """
    try:
        with open(path, "rb") as file:
            data = file.read(BYTES + 1)
        text = data.decode("utf-8")
    except OSError as error:
        raise InputError(
            f"{path}: cannot be read ({error.strerror}); give the path of a case file"
        ) from None
    except UnicodeDecodeError as error:
        raise InputError(
            f"{path}: byte {error.start} is no UTF-8 text; save the case file as UTF-8"
        ) from None
    if len(data) > BYTES:
        raise InputError(f"{path}: the file is larger than {BYTES:.0e} bytes; give a case file")
    if _CHAIN.search(text):  # before tomllib, whose time grows as the square of the parts of a key
        raise InputError(f"{path}: {_TOO_DEEP}")
    try:
        tables = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{path}: {error}; correct the TOML there") from None
    except RecursionError:
        raise InputError(f"{path}: {_TOO_DEEP}") from None
    except ValueError as error:
        raise InputError(f"{path}: {_value_error(error)}") from None
    return checked(tables, str(path))


def checked(tables: dict[str, Any], source: str) -> dict[str, Any]:
    """Return the tables; InputError naming the key for what no table of a case can hold.

    These are NaN, whole numbers beyond 64 bits, the character NUL, and tables in tables in tables
    without end.
    """
    left: list[tuple[str, Any, int]] = [("", tables, 0)]
    while left:
        key, value, depth = left.pop()
        wrong = _defect(value, depth)
        if wrong:
            raise InputError(f"{source}: {key[:200]} {wrong}")
        inside = (
            value.items()
            if isinstance(value, dict)
            else enumerate(value, 1)
            if isinstance(value, list)
            else ()
        )
        left += [(f"{key}.{name}".lstrip("."), one, depth + 1) for name, one in inside]
        if any("\0" in str(name) for name, _ in inside):
            raise InputError(
                f"{source}: a key below {key or 'the top'} contains the character NUL: correct it"
            )
    return tables


def _defect(value: Any, depth: int) -> str:
    if depth > DEPTH:
        return _TOO_DEEP
    if isinstance(value, float) and math.isnan(value):
        return "is nan: give a number"
    if isinstance(value, int) and not -(2**63) <= value < 2**63:
        return _TOO_LONG
    return (
        "contains the character NUL: leave it out"
        if isinstance(value, str) and "\0" in value
        else ""
    )


def with_settings(tables: dict[str, Any], settings: Sequence[str]) -> dict[str, Any]:
    """Return a copy of the tables with KEY=VALUE settings made.

    What is missing on the way to a key is added.

    KEY: names joined by dots; entries of lists are counted from 1 ("excitation.1.scale"). VALUE: as
    in TOML; what is no TOML is text; none takes the key away. InputError for a setting without "=",
    no such entry, a way through a value.
    """
    result = deepcopy(tables)
    for setting in settings:
        key, equals, value = setting.partition("=")
        if key.count(".") > DEPTH:
            raise InputError(f"setting {quote(setting)} {_TOO_DEEP}")
        if not equals or not key.strip():
            raise InputError(f"setting '{setting}': give KEY=VALUE, such as friction.mu=0.5")
        new = _value(value.strip()) if value.strip() else None
        _set(result, key.strip().split("."), new, setting)
    return checked(result, "settings")


def _value(text: str) -> Any:
    try:
        found = tomllib.loads(f"value = {text}")
    except tomllib.TOMLDecodeError:
        return text
    except RecursionError:
        raise InputError(f"setting {quote(text)} {_TOO_DEEP}") from None
    except ValueError as error:
        raise InputError(f"setting {quote(text)} {_value_error(error)}") from None
    return found["value"] if set(found) == {"value"} else text


def _value_error(error: ValueError) -> str:
    """Return what Python says of a value that is TOML.

    For a number of more digits than it reads, it says what helps.
    """
    return (
        _TOO_LONG
        if "digits" in str(error)
        else f"holds a value that cannot be read ({error}): correct it"
    )


def _set(there: Any, way: list[str], value: Any, setting: str) -> None:
    """Set the value at the end of the way, or take it away when there is none."""
    for name in way[:-1]:
        place = _place(there, name, setting)
        if isinstance(there, dict):
            there.setdefault(place, {})
        there = there[place]
    last = _place(there, way[-1], setting)
    if value is not None:
        there[last] = value
    elif not isinstance(there, dict) or last in there:
        del there[last]


def toml_value(value: Any) -> str:
    """Return a value as TOML writes it on one line."""
    if isinstance(value, dict):
        return (
            "{"
            + ", ".join(f"{_quoted(key)} = {toml_value(one)}" for key, one in value.items())
            + "}"
        )
    if isinstance(value, list):
        return "[" + ", ".join(map(toml_value, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, int | float) else _quoted(str(value))


def _quoted(text: str) -> str:
    """Return a basic string of TOML."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def _place(there: Any, name: str, setting: str) -> Any:
    """Return the key, or the index, of a name of the way."""
    if isinstance(there, dict):
        return name
    if not isinstance(there, list):
        raise InputError(
            f"setting '{setting}': the part before '{name}' is a plain value; shorten the key"
        )
    if not name.isdecimal() or not 1 <= int(name) <= len(there):
        raise InputError(
            f"setting '{setting}': there is no entry '{name}'; give a number from 1 to {len(there)}"
        )
    return int(name) - 1
