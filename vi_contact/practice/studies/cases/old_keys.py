"""Read keys of case files that have another name now, with one warning that tells the new one."""

import logging
from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from pathlib import Path
from typing import Any

from ....core.errors import InputError
from ....core.renamed import KEYS
from .toml_file import list_tables

log = logging.getLogger(__name__)


def renew_keys(
    path: Path, tables: Mapping[str, Any], settings: Sequence[str] = ()
) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Return the tables and settings of a case with the new names of all keys.

    Args:
        path: of the case file, for sentences.
        tables: of the file.
        settings: texts KEY=VALUE that replace values of it.

    Raises:
        InputError: a table that has a key under both names.
    """
    renewed = deepcopy(dict(tables))
    found: set[tuple[str, str]] = set()
    for name, table in _list_renewable(renewed):
        for old, new in KEYS.get(name, {}).items():
            if old not in table:
                continue
            if new in table:
                raise InputError(
                    f"{path}: [{name}] has '{new}' and '{old}', which is its old name: leave "
                    f"'{old}' out"
                )
            table[new] = table.pop(old)
            found.add((name, old))
    texts = tuple(_renew_setting(setting, found) for setting in settings)
    for name, old in sorted(found):
        log.warning("%s: [%s] %s is now %s: write that", path, name, old, KEYS[name][old])
    return renewed, texts


def _list_renewable(tables: Mapping[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the name and the content of all tables that may have old keys, those of stages too."""
    stages = tables.get("stage")
    wholes = [tables, *(stages if isinstance(stages, list) else [])]
    for whole in wholes:
        if not isinstance(whole, dict):
            continue
        for name in KEYS:
            for table in list_tables(whole.get(name)):
                yield name, table


def _renew_setting(setting: str, found: set[tuple[str, str]]) -> str:
    """Return a setting with the new name of its key, and note the old one among those found."""
    key, equals, value = setting.partition("=")
    names = key.strip().split(".")
    start = 2 if names[0] == "stage" else 0  # stage.NUMBER.
    if len(names) <= start:
        return setting
    table = names[start]
    place = start + 1
    if place < len(names) and names[place].isdecimal():  # contact.NUMBER.
        place += 1
    if place >= len(names) or names[place] not in KEYS.get(table, {}):
        return setting
    found.add((table, names[place]))
    names[place] = KEYS[table][names[place]]
    return ".".join(names) + equals + value
