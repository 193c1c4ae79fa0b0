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

BYTES = 10_000_000  # of a case file, at most
DEPTH = 20  # of tables and lists in each other
_TOO_DEEP = "is nested too deep: write tables and lists as docs/guide/studies.md does"
_TOO_LONG = "holds a whole number beyond 64 bits: write it with a point, as 1.0e30"
_PART = r"""(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+"""
_CHAIN = re.compile(rf"(?<![\w-])(?:{_PART}){{{DEPTH}}}")  # a key of many parts


def read_toml(path: str | Path) -> dict[str, Any]:
    """Return the tables of a file.

    Raises:
        InputError: with file, line and reason, when it cannot be read or is no TOML.
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
        raise InputError(f"{path}: {_explain_value_error(error)}") from None
    return check_tables(tables, str(path))


def check_tables(tables: dict[str, Any], source: str) -> dict[str, Any]:
    """Return the tables, if a table of a case can hold what is in them.

    Raises:
        InputError: with the key, for NaN, whole numbers beyond 64 bits, the character NUL, and
            tables in tables in tables without end.
    """
    # A list of what is still to check, and no recursion: the tables may be deeper than the stack.
    left: list[tuple[str, Any, int]] = [("", tables, 0)]
    while left:
        key, value, depth = left.pop()
        defect = _describe_defect(value, depth)
        if defect:
            raise InputError(f"{source}: {key[:200]} {defect}")
        entries = _list_entries(value)
        left += [(f"{key}.{name}".lstrip("."), entry, depth + 1) for name, entry in entries]
        if any("\0" in str(name) for name, _ in entries):
            raise InputError(
                f"{source}: a key below {key or 'the top'} contains the character NUL: correct it"
            )
    return tables


def _list_entries(value: Any) -> list[tuple[Any, Any]]:
    """Return (key, value) of a table, (number from 1, value) of a list; nothing of all else."""
    if isinstance(value, dict):
        return list(value.items())
    if isinstance(value, list):
        return list(enumerate(value, 1))
    return []


def _describe_defect(value: Any, depth: int) -> str:
    """Return why no table of a case can hold a value; "" where it can."""
    if depth > DEPTH:
        return _TOO_DEEP
    if isinstance(value, float) and math.isnan(value):
        return "is nan: give a number"
    if isinstance(value, int) and not -(2**63) <= value < 2**63:
        return _TOO_LONG
    if isinstance(value, str) and "\0" in value:
        return "contains the character NUL: leave it out"
    return ""


def with_settings(tables: dict[str, Any], settings: Sequence[str]) -> dict[str, Any]:
    """Return a copy of the tables with KEY=VALUE settings made.

    Tables that are missing on the way to a key are added. KEY is names joined by dots; entries of
    lists are counted from 1 ("excitation.1.scale"). VALUE is as in TOML; what is no TOML is text;
    none takes the key away.

    Raises:
        InputError: for a setting without "=", an entry that a list does not have, and a way
            through a plain value.
    """
    result = deepcopy(tables)
    for setting in settings:
        key, equals, value = setting.partition("=")
        if key.count(".") > DEPTH:
            raise InputError(f"setting {quote(setting)} {_TOO_DEEP}")
        if not equals or not key.strip():
            raise InputError(f"setting '{setting}': give KEY=VALUE, such as friction.mu=0.5")
        new = _read_value(value.strip()) if value.strip() else None
        _set_value(result, key.strip().split("."), new, setting)
    return check_tables(result, "settings")


def _read_value(text: str) -> Any:
    """Return the value of a setting; what is no value of TOML is a text."""
    try:
        tables = tomllib.loads(f"value = {text}")
    except tomllib.TOMLDecodeError:
        return text
    except RecursionError:
        raise InputError(f"setting {quote(text)} {_TOO_DEEP}") from None
    except ValueError as error:
        raise InputError(f"setting {quote(text)} {_explain_value_error(error)}") from None
    # A text of several lines may hold keys of its own.
    return tables["value"] if set(tables) == {"value"} else text


def _explain_value_error(error: ValueError) -> str:
    """Return what Python says of a value that is TOML.

    For a number of more digits than it reads, the remedy is another.
    """
    if "digits" in str(error):
        return _TOO_LONG
    return f"holds a value that cannot be read ({error}): correct it"


def _set_value(tables: Any, way: list[str], value: Any, setting: str) -> None:
    """Set the value at the end of the way, or take it away when it is None."""
    inner = tables
    for name in way[:-1]:
        key = _find_key(inner, name, setting)
        if isinstance(inner, dict):
            inner.setdefault(key, {})
        inner = inner[key]
    last = _find_key(inner, way[-1], setting)
    if value is not None:
        inner[last] = value
    elif not isinstance(inner, dict) or last in inner:
        del inner[last]


def _find_key(inner: Any, name: str, setting: str) -> Any:
    """Return the key of a table, or the index of a list, that a name of the way stands for."""
    if isinstance(inner, dict):
        return name
    if not isinstance(inner, list):
        raise InputError(
            f"setting '{setting}': the part before '{name}' is a plain value; shorten the key"
        )
    if not name.isdecimal() or not 1 <= int(name) <= len(inner):
        raise InputError(
            f"setting '{setting}': there is no entry '{name}'; give a number from 1 to {len(inner)}"
        )
    return int(name) - 1


def format_value(value: Any) -> str:
    """Return a value as TOML writes it on one line."""
    if isinstance(value, dict):
        entries = [f"{_quote(key)} = {format_value(entry)}" for key, entry in value.items()]
        return "{" + ", ".join(entries) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(format_value, value)) + "]"
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, int | float) else _quote(str(value))


def _quote(text: str) -> str:
    """Return a basic string of TOML."""
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007f")


def list_tables(value: Any) -> list[dict[str, Any]]:
    """Return a table, or the tables of a list."""
    values = value if isinstance(value, list) else [value]
    return [table for table in values if isinstance(table, dict)]
