"""Write the JSON schema of case files, which tells editors tables, keys, types, limits and units.

It is made from the annotations that read case files.
"""

import json
import math
from collections.abc import Mapping, Sequence
from datetime import date
from inspect import getdoc
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from ....core.arguments import members_of
from ....core.quantities import Between
from ....laws.materials import LinearElastic
from .bodies import BODY_TABLES
from .case import TABLES
from .own_classes import is_protocol
from .parsing import Words, find_choices, is_list, is_path
from .quantities import AT_START, FIELD, HISTORY, OF_POINTS, Expression
from .stage_tables import BY_KEY, WHOLE
from .table_calls import Callee
from .vocabulary import make_words

DRAFT = "http://json-schema.org/draft-07/schema#"
_PLAIN: Mapping[Any, Any] = {
    float: {"type": ["number", "string"]},
    int: {"type": ["integer", "string"]},
    bool: {"type": "boolean"},
    str: {"type": "string"},
    date: {"type": "string"},
    HISTORY: {"type": ["number", "string"]},
    Expression: {"type": "string"},
    FIELD: {"type": ["string", "array"]},
    AT_START: {"type": "array"},
    OF_POINTS: {"type": "string"},
}
_OWN_CLASS = {
    "type": "object",
    "properties": {"type": {"type": "string", "pattern": ":"}},
    "required": ["type"],
}
_MATERIALS = {"type": "string", "description": "the NAME of [material.NAME]"}


def write_schema() -> str:
    """Return the schema (draft 7) of case files."""
    schema = _Schema(make_words(Path()))
    properties = {}
    for name, hint in TABLES.items():
        is_call = isinstance(hint, Callee)
        properties[name] = schema.describe_call(hint) if is_call else schema.describe_type(hint)
    properties["stage"] = {
        "type": "array",
        "items": _describe_stage(properties),
        "description": "stages, one after the other",
    }
    head = {
        "$schema": DRAFT,
        "title": "A case file of vi_contact",
        "type": "object",
        "additionalProperties": False,
        "anyOf": [{"required": [body]} for body in ("mesh", *BODY_TABLES)],
    }
    sections = {
        "properties": {"format": {"const": 1}, **properties},
        "definitions": dict(sorted(schema.definitions.items())),
    }
    # One line for each table and definition: the file can be compared line by line.
    parts = [json.dumps(head)[1:-1]]
    for key, section in sections.items():
        parts.append(f"{json.dumps(key)}: {{\n{_write_lines(section)}\n}}")
    return "{" + ",\n".join(parts) + "}\n"


def _describe_stage(tables: Mapping[str, Any]) -> dict[str, Any]:
    """Return the schema of a stage: tables of the case that it replaces, whole or by keys."""
    kind = {"anyOf": [{"const": "static"}, {"const": "dynamic"}]}
    names = {"anyOf": [_PLAIN[str], {"type": "array", "items": _PLAIN[str]}]}
    keys = {"name": _PLAIN[str], "type": kind, "release": _PLAIN[bool]}
    keys |= {"add": names, "remove": names}
    parts = {key: tables[key] | {"required": []} for key in BY_KEY}
    wholes = {key: tables[key] for key in WHOLE}
    wholes["reservoir"] = wholes["reservoir"] | {"required": []}  # empty: there is no water
    return {
        "type": "object",
        "additionalProperties": False,
        "required": ["name", "type"],
        "properties": keys | parts | wholes,
    }


def _write_lines(table: dict[str, Any]) -> str:
    """Return the members of a table, each on a line of its own."""
    lines = [
        f"{json.dumps(key)}: {json.dumps(value, ensure_ascii=False)}"
        for key, value in table.items()
    ]
    return ",\n".join(lines)


def _add_limits(schema: dict[str, Any], limit: Between | None) -> dict[str, Any]:
    """Return the schema with limits, which hold for its numbers; texts with units stay allowed."""
    if limit is None:
        return schema
    if "anyOf" in schema:
        return schema | {"anyOf": [_add_limits(choice, limit) for choice in schema["anyOf"]]}
    if schema.get("type") == "array":
        if "items" not in schema:
            return schema
        return schema | {"items": _add_limits(schema["items"], limit)}
    types = schema.get("type", ())
    if "integer" in types:
        ends = {"minimum": limit.least(), "maximum": limit.most()}
    elif "number" in types:
        open_low = limit.ends[0] == "("
        open_high = limit.ends[1] == ")"
        ends = {
            "exclusiveMinimum" if open_low else "minimum": limit.low,
            "exclusiveMaximum" if open_high else "maximum": limit.high,
        }
    else:
        return schema
    return schema | {word: end for word, end in ends.items() if math.isfinite(end)}


class _Schema:
    """Describe types and calls in JSON schema, and collect the definitions that they refer to.

    Attributes:
        definitions: "TYPE.WORD" -> the schema of the table that a word calls.
    """

    def __init__(self, words: Words) -> None:
        self._words = words
        self.definitions: dict[str, Any] = {}

    def describe_type(self, hint: Any) -> dict[str, Any]:
        """Return the schema of values for a parameter with this hint; {} for any value."""
        members = members_of(hint)
        # A key that takes a number takes arithmetic as a text, as that of a number.
        members = [member for member in members if member != FIELD or float not in members]
        choices = [choice for member in members for choice in self._describe_member(member)]
        choices += self._describe_tables(members)
        choices = [choice for k, choice in enumerate(choices) if choice not in choices[:k]]
        if not choices or {} in choices:
            return {}
        return choices[0] if len(choices) == 1 else {"anyOf": choices}

    def describe_call(self, target: Callee, word: str = "") -> dict[str, Any]:
        """Return the schema of the table of a call; ``word``: what its ``type`` may be."""
        keys = {key: self._describe_key(target, key) for key in target.hints}
        kind = {"type": {"const": word}} if word else {}
        return {
            "type": "object",
            "additionalProperties": False,
            "required": sorted(target.required),
            "properties": kind | keys,
            "description": (getdoc(target.function) or target.name).split("\n")[0],
        }

    def _describe_key(self, target: Callee, key: str) -> dict[str, Any]:
        """Return the schema of a key: its type, with limits, meaning and unit of its annotation."""
        quantity = target.quantities[key]
        unit = target.unit(key)
        schema = _add_limits(self.describe_type(quantity.kind), quantity.limit)
        phrases = [quantity.meaning] if quantity.meaning else []
        if unit not in (None, "1"):
            phrases.append(f"in {unit}, or with its unit")
        if not phrases or not schema:
            return schema
        return schema | {"description": ", ".join(phrases)}

    def _describe_member(self, member: Any) -> list[dict[str, Any]]:
        """Return what values of one type may be, but for tables with a ``type``."""
        if member in (Any, object):
            return [{}]
        if member in _PLAIN:
            return [_PLAIN[member]]
        if is_path(member) or member in self._words.groups or member in self._words.short:
            return [_PLAIN[str]]
        if get_origin(member) is Literal:
            return [{"enum": list(get_args(member))}]
        if is_list(member):
            kinds = [kind for kind in dict.fromkeys(get_args(member)) if kind is not Ellipsis]
            entries = [self.describe_type(kind) for kind in kinds]
            items = entries[0] if len(entries) == 1 else {"anyOf": entries}
            return [{"type": "array", "items": items}]
        if get_origin(member) in (Mapping, dict):
            inner = self.describe_type(get_args(member)[1])
            return [{"type": "object", "additionalProperties": inner}]
        return [_MATERIALS] if member is LinearElastic else []

    def _describe_tables(self, members: Sequence[Any]) -> list[dict[str, Any]]:
        """Return the tables with a ``type`` that these types may be.

        The type of one of them may be left out.
        """
        targets = {
            (member, word): target
            for member in members
            for word, target in find_choices(member, self._words).items()
        }
        defaults = [
            self._words.default[member] for member in members if member in self._words.default
        ]
        choices: list[dict[str, Any]] = []
        for (member, word), target in targets.items():
            name = f"{member.__name__}.{word}"
            if name not in self.definitions:
                self.definitions[name] = {}  # what is inside may name it
                self.definitions[name] = self.describe_call(target, word)
            reference = {"$ref": f"#/definitions/{name}"}
            if len(targets) == 1 or word in defaults[:1]:
                choices.append(reference)
            else:
                choices.append({"allOf": [reference, {"required": ["type"]}]})
        if any(is_protocol(member) for member in members):
            choices.append(_OWN_CLASS)
        return choices
