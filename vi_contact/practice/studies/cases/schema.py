"""Write the JSON schema of case files, which tells editors tables, keys, types, limits and units.

It is made from the annotations that read case files.
"""

import json
import math
from collections.abc import Mapping, Sequence
from inspect import getdoc
from pathlib import Path
from typing import Any, get_args, get_origin

from ....core.arguments import members_of
from ....core.quantities import Between
from ....laws.materials import LinearElastic
from .bodies import OWN
from .case import TABLES
from .own_classes import is_protocol
from .parsing import Words, choices_of, is_list, is_path
from .quantities import AT_START, FIELD, HISTORY, Expression
from .stage_tables import BY_KEY, WHOLE
from .table_calls import Callee
from .vocabulary import words

DRAFT = "http://json-schema.org/draft-07/schema#"
_PLAIN: Mapping[Any, Any] = {
    float: {"type": ["number", "string"]},
    int: {"type": ["integer", "string"]},
    bool: {"type": "boolean"},
    str: {"type": "string"},
    HISTORY: {"type": ["number", "string"]},
    Expression: {"type": "string"},
    FIELD: {"type": ["string", "array"]},
    AT_START: {"type": "array"},
}
_OWN_CLASS = {
    "type": "object",
    "properties": {"type": {"type": "string", "pattern": ":"}},
    "required": ["type"],
}
_MATERIALS = {"type": "string", "description": "the NAME of [material.NAME]"}


def text() -> str:
    """Return the schema (draft 7) of case files."""
    found = _Schema(words(Path()))
    properties = {
        name: found.call(one) if isinstance(one, Callee) else found.of(one)
        for name, one in TABLES.items()
    }
    properties["stage"] = {
        "type": "array",
        "items": _stage(properties),
        "description": "stages, one after the other",
    }
    head = {
        "$schema": DRAFT,
        "title": "A case file of vi_contact",
        "type": "object",
        "additionalProperties": False,
        "anyOf": [{"required": [body]} for body in ("mesh", *OWN)],
    }
    definitions = dict(sorted(found.definitions.items()))
    inside = {"properties": {"format": {"const": 1}, **properties}, "definitions": definitions}
    parts = [
        json.dumps(head)[1:-1],
        *(f"{json.dumps(key)}: {{\n{_lines(one)}\n}}" for key, one in inside.items()),
    ]
    return "{" + ",\n".join(parts) + "}\n"


def _stage(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Return the schema of a stage: tables of the case that it replaces, whole or by keys."""
    kind = {"anyOf": [{"const": "static"}, {"const": "dynamic"}]}
    keys = {"name": _PLAIN[str], "type": kind, "release": _PLAIN[bool]}
    parts = {key: tables[key] | {"required": []} for key in BY_KEY}
    return {
        "type": "object",
        "additionalProperties": False,
        "required": ["name", "type"],
        "properties": keys | parts | {key: tables[key] for key in WHOLE},
    }


def _lines(table: dict[str, Any]) -> str:
    """Return the members of a table, each on a line of its own."""
    return ",\n".join(
        f"{json.dumps(key)}: {json.dumps(one, ensure_ascii=False)}" for key, one in table.items()
    )


def _limited(schema: dict[str, Any], limit: Between | None) -> dict[str, Any]:
    """Return the schema with limits, which hold for its numbers; texts with units stay allowed."""
    if limit is None:
        return schema
    if "anyOf" in schema:
        return schema | {"anyOf": [_limited(one, limit) for one in schema["anyOf"]]}
    if schema.get("type") == "array":
        return schema | {"items": _limited(schema["items"], limit)} if "items" in schema else schema
    if not {"number", "integer"} & {*schema.get("type", ())}:
        return schema
    if "integer" in schema["type"]:
        whole = {"minimum": limit.least(), "maximum": limit.most()}
        return schema | {word: end for word, end in whole.items() if math.isfinite(end)}
    low, high = ("minimum", "exclusiveMinimum"), ("maximum", "exclusiveMaximum")
    ends = ((low, limit.low, limit.ends[0] == "("), (high, limit.high, limit.ends[1] == ")"))
    return schema | {words[out]: end for words, end, out in ends if math.isfinite(end)}


class _Schema:
    def __init__(self, words: Words) -> None:
        self._words = words
        self.definitions: dict[str, Any] = {}

    def of(self, hint: Any) -> dict[str, Any]:
        """Return the schema of values for a parameter with this hint."""
        members = members_of(hint)
        # a text, as that of a number
        members = [one for one in members if one != FIELD or float not in members]
        found = [one for member in members for one in self._one(member)] + self._tables(members)
        return {} if {} in found or not found else found[0] if len(found) == 1 else {"anyOf": found}

    def call(self, target: Callee, word: str = "") -> dict[str, Any]:
        """Return the schema of the table of a call; ``word``: what its ``type`` may be."""
        keys = {key: self._key(target, key) for key in target.hints}
        kind = {"type": {"const": word}} if word else {}
        return {
            "type": "object",
            "additionalProperties": False,
            "required": sorted(target.required),
            "properties": kind | keys,
            "description": (getdoc(target.function) or target.name).split("\n")[0],
        }

    def _key(self, target: Callee, key: str) -> dict[str, Any]:
        """Return the schema of a key: its type, with limits, meaning and unit of its annotation."""
        said, unit = target.said[key], target.unit(key)
        found = _limited(self.of(said.kind), said.limit)
        words = [said.meaning] if said.meaning else []
        words += [f"in {unit}, or with its unit"] if unit not in (None, "1") else []
        return found | {"description": ", ".join(words)} if words and found else found

    def _one(self, member: Any) -> list[dict[str, Any]]:
        if member in (Any, object):
            return [{}]
        if member in _PLAIN:
            return [_PLAIN[member]]
        if is_path(member) or member in self._words.groups or member in self._words.short:
            return [_PLAIN[str]]
        if is_list(member):
            inside = [
                self.of(one) for one in dict.fromkeys(get_args(member)) if one is not Ellipsis
            ]
            return [
                {"type": "array", "items": inside[0] if len(inside) == 1 else {"anyOf": inside}}
            ]
        if get_origin(member) in (Mapping, dict):
            return [{"type": "object", "additionalProperties": self.of(get_args(member)[1])}]
        return [_MATERIALS] if member is LinearElastic else []

    def _tables(self, members: Sequence[Any]) -> list[dict[str, Any]]:
        """Return the tables with a ``type`` that these types may be.

        The type of one of them may be left out.
        """
        every = {
            (member, word): target
            for member in members
            for word, target in choices_of(member, self._words).items()
        }
        default = next(
            (self._words.default[one] for one in members if one in self._words.default), None
        )
        found: list[dict[str, Any]] = []
        for (member, word), target in every.items():
            name = f"{member.__name__}.{word}"
            if name not in self.definitions:
                self.definitions[name] = {}  # what is inside may name it
                self.definitions[name] = self.call(target, word)
            one = {"$ref": f"#/definitions/{name}"}
            found.append(
                one
                if len(every) == 1 or word == default
                else {"allOf": [one, {"required": ["type"]}]}
            )
        return found + [_OWN_CLASS] * any(is_protocol(member) for member in members)
