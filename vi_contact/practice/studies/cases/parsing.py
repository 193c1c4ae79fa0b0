"""Read values of a TOML file into nodes of calls, by type hints; see ``table_calls``."""

import logging
import os
from collections import ChainMap
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, is_dataclass, replace
from difflib import get_close_matches
from pathlib import Path
from typing import Any, get_args, get_origin

from ....core.arguments import members_of
from ....core.checks import SHOWN, quote
from ....core.errors import InputError
from ....core.renamed import WORDS
from .own_classes import own_class
from .quantities import FIELD, HISTORY, Expression, list_node, text_node
from .table_calls import GROUP, Call, Callee, Group, Node, Spot, callee

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Words:
    """Say what names mean.

    choices: of every type that tables can make, by the word after ``type``; default: where it may
    be left out; groups: types that are named groups of the mesh; short: the one key that a plain
    text stands for; allowed: the packages whose classes may be named; named: nodes by type and
    name; by "contact" the groups of contact tables.
    """

    folder: Path
    choices: Mapping[Any, Mapping[str, Callee]]
    default: Mapping[Any, str]
    groups: tuple[type, ...]
    short: Mapping[Any, str]
    allowed: Sequence[str] = ()
    named: dict[Any, dict[str, Node]] = field(default_factory=dict)


def read(value: Any, hint: Any, spot: Spot, words: Words) -> Node:
    """Return the node of a value for a parameter with this hint.

    InputError when it does not fit.
    """
    members = members_of(hint)
    # a text is the path then, and belongs to the case file's folder
    if any(is_path(member) for member in members):
        members = [member for member in members if member is not str]
    if isinstance(value, dict):
        return _table(value, members, spot, words)
    if isinstance(value, list):
        field = list_node(value, members, spot)
        return _list(value, members, spot, words) if field is None else field
    # a group, or such a name
    if {str, *words.groups} & {*members} > {str} and value in words.named.get("contact", ()):
        return replace(words.named["contact"][value], alias=value, spot=spot)
    for member in members:
        node = _scalar(value, member, spot, words)
        if node is not None:
            return node
    if HISTORY in members and isinstance(value, int | float) and not isinstance(value, bool):
        value = repr(float(value))  # the same at all times
    text = text_node(value, members, spot) if isinstance(value, str) else None
    if text is not None:
        return text
    raise spot.wrong(f"is {_shown(value)}: give {_expected(members, words)}")


def arguments(table: Mapping[str, Any], target: Callee, spot: Spot, words: Words) -> Call:
    """Return the call of this function with the keys of the table."""
    given = {key: value for key, value in table.items() if key != "type"}
    for key in given:
        if key not in target.hints:
            raise spot.inside(
                f"has the unknown key '{key}' for {target.name}: {nearest(key, target.hints)}"
            )
    missing = sorted(target.required - set(given))
    if missing:
        raise spot.inside(f"lacks the key '{missing[0]}', which {target.name} needs: give it")
    nodes = {
        key: read(value, target.hints[key], spot.at(key, target.unit(key)), words)
        for key, value in given.items()
    }
    return Call(target, nodes, spot)


def nearest(word: Any, known: Iterable[str]) -> str:
    """Return the rest of a sentence about a word nobody knows."""
    names = sorted(known) if isinstance(known, frozenset) else list(known)
    if not names:
        return "leave it out, as there are none"
    near = get_close_matches(str(word), names, n=3, cutoff=0.5)
    renamed = WORDS.get(str(word))
    if renamed in names:
        return f"it is now {renamed}"
    return (f"did you mean {' or '.join(near)}? " if near else "") + f"Known: {', '.join(names)}"


def _scalar(value: Any, member: Any, spot: Spot, words: Words) -> Node | None:
    """Return the node, or None where the value is nothing of this type."""
    if member in (Any, object):
        return value
    if isinstance(value, bool):
        return value if member is bool else None
    if isinstance(value, int | float) and member is float:
        return float(value)
    if isinstance(value, int) and member is int:
        return value
    return _read_text(value, member, spot, words) if isinstance(value, str) else None


def _read_text(value: str, member: Any, spot: Spot, words: Words) -> Node | None:
    """Return the node of a text, or None where it is nothing of this type."""
    if member in words.groups:
        return Group(value, member, spot)
    if member in words.named:
        if value not in words.named[member]:
            raise spot.wrong(
                f"names '{value}', which does not exist: {nearest(value, words.named[member])}"
            )
        return words.named[member][value]
    if member in words.short:
        return _table({words.short[member]: value}, [member], spot, words)
    if is_path(member):
        if not value.strip():
            raise spot.wrong("is empty: give the path of a file or folder")
        return words.folder / value
    return value if member is str else None


def is_path(member: Any) -> bool:
    """Tell whether values for this type are paths."""
    origin = get_origin(member) or member
    return isinstance(origin, type) and issubclass(origin, os.PathLike)


def _list(value: list[Any], members: list[Any], spot: Spot, words: Words) -> Node:
    wrong: InputError | None = None
    for member in members:
        if is_list(member):
            try:
                return _items(value, get_args(member), get_origin(member) is tuple, spot, words)
            except InputError as error:
                wrong = wrong or error
    if wrong is not None:
        raise wrong
    if any(member in (Any, object) for member in members):
        return value
    raise spot.wrong(f"is a list: give {_expected(members, words)}")


def is_list(member: Any) -> bool:
    """Tell whether values for this type are lists."""
    return get_origin(member) in (tuple, list, Sequence)


def _items(
    value: list[Any], kinds: tuple[Any, ...], fixed: bool, spot: Spot, words: Words
) -> tuple[Node, ...]:
    if not fixed or kinds[-1] is Ellipsis:
        kinds = (kinds[0],) * len(value)
    elif len(kinds) != len(value):
        raise spot.wrong(f"has {len(value)} entries: give {len(kinds)}")
    pairs = enumerate(zip(value, kinds, strict=True), start=1)
    return tuple(read(one, kind, spot.entry(number), words) for number, (one, kind) in pairs)


def _table(value: dict[str, Any], members: list[Any], spot: Spot, words: Words) -> Node:
    found: list[Any] = [one for one in (choices_of(member, words) for member in members) if one]
    if found:
        # in which words come in the order of ``found``, and are looked up one by one
        choices = ChainMap(*found[::-1])
        word = value.get(
            "type",
            next((words.default[member] for member in members if member in words.default), None),
        )
        if word is None and len(choices) == 1:
            word = next(iter(choices))
        return arguments(value, _chosen(word, choices, members, spot, words), spot, words)
    for member in members:
        if get_origin(member) in (Mapping, dict):
            kind = get_args(member)[1]
            return {
                key: read(one, kind, spot.at(key, spot.unit), words) for key, one in value.items()
            }
    raise spot.wrong(f"is a table: give {_expected(members, words)}")


def _chosen(
    word: Any, choices: Mapping[str, Callee], kinds: Sequence[Any], spot: Spot, words: Words
) -> Callee:
    """Return what the ``type`` of a table calls.

    It is one of the choices, or a class of others of these kinds.
    """
    if isinstance(word, str) and ":" in word:
        return own_class(word, kinds, words.allowed, spot)
    if word is None:
        raise spot.inside(f"has no type: give type = one of {', '.join(choices)}")
    renamed = WORDS.get(str(word))
    if renamed is not None and word not in choices and renamed in choices:
        log.warning("%s", spot.inside(f"type {_shown(word)} is now {_shown(renamed)}: write that"))
        return choices[renamed]
    if not isinstance(word, str) or word not in choices:
        raise spot.inside(f"has the unknown type {_shown(word)}: {nearest(word, choices)}")
    return choices[word]


def choices_of(member: Any, words: Words) -> Mapping[str, Callee]:
    """Return what a table may make for this type.

    It is as listed, or an object of the value class itself.
    """
    if member in words.choices:
        return words.choices[member]
    if isinstance(member, type) and is_dataclass(member) and member not in words.groups:
        return {member.__name__: callee(member)}
    return {}


def _shown(value: Any) -> str:
    """Return a value as in the file."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"'{value[:SHOWN]}'" if isinstance(value, str) else quote(value)


_EXPECTED = {float: "a number", int: "a whole number", bool: "true or false", str: "text"}


def _expected(members: Sequence[Any], words: Words) -> str:
    """Return what would fit."""
    found = [one for member in members for one in _describe(member, members, words)]
    if not found or any(get_origin(member) is Callable or member is Callable for member in members):
        found.append("a function, which only the Python interface takes")
    return " or ".join(dict.fromkeys(found))


def _describe(member: Any, members: Sequence[Any], words: Words) -> list[str]:
    """Return what would fit one type of these."""
    if member in _EXPECTED:
        return [_EXPECTED[member]]
    if member in words.groups:
        return [f"the name of {GROUP[member.__name__]}"]
    if is_path(member):
        return ["the path of a file"]
    if choices := choices_of(member, words):
        table = f"a table with type = one of {', '.join(choices)}"
        named = words.named.get(member)
        return [table, f"one of the names {', '.join(named)}"] if named else [table]
    if is_list(member):
        return [_describe_list(member, words)]
    if get_origin(member) in (Mapping, dict):
        return ["a table of names"]
    if member in (FIELD, HISTORY, Expression):
        return [_describe_expression(member, members)]
    return []


def _describe_list(member: Any, words: Words) -> str:
    """Return the kind of list, with that of its entries where they are numbers or texts."""
    inner = [one for one in get_args(member) if one is not Ellipsis]
    if not _EXPECTED.get(inner[0]):
        return "a list"
    return f"a list of {_expected(inner[:1], words).removeprefix('a ')}s"


def _describe_expression(member: Any, members: Sequence[Any]) -> str:
    """Return of what an expression may be."""
    if member == HISTORY:
        return "an expression of t"
    return "an expression" if float in members else "expressions of x, y, z, t, one per dimension"
