"""Read values of a TOML file into nodes of calls, by type hints; see ``table_calls``."""

import logging
import os
from collections import ChainMap
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, is_dataclass, replace
from datetime import date
from difflib import get_close_matches
from pathlib import Path
from typing import Any, Literal, get_args, get_origin

from ....core.arguments import members_of
from ....core.checks import SHOWN, quote
from ....core.errors import InputError
from ....core.renamed import WORDS
from .own_classes import find_own_class
from .quantities import FIELD, HISTORY, OF_POINTS, Expression, read_field, read_quantity
from .table_calls import GROUP, Call, Callee, Group, Node, Spot, make_callee

log = logging.getLogger(__name__)


@dataclass(frozen=True)
class Words:
    """Say what names mean.

    Attributes:
        folder: where relative paths begin.
        choices: of every type that tables can make, by the word after ``type``.
        default: the word of a type where ``type`` may be left out.
        groups: types that are named groups of the mesh.
        short: the one key of a type that a plain text stands for.
        allowed: the packages whose classes may be named.
        named: nodes by type and name; by "contact" the groups of contact tables. It grows while a
            case is read.
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

    Args:
        value: of the file.
        hint: type of the parameter.
        spot: where the value stands.
        words: what names mean.

    Raises:
        InputError: for a value that does not fit.
    """
    members = members_of(hint)
    # a text is the path then, and belongs to the case file's folder
    if any(is_path(member) for member in members):
        members = [member for member in members if member is not str]
    if isinstance(value, dict):
        return _read_table(value, members, spot, words)
    if isinstance(value, list):
        field = read_field(value, members, spot)
        return _read_list(value, members, spot, words) if field is None else field
    # a group, or the name of a contact table
    if {str, *words.groups} & {*members} > {str} and value in words.named.get("contact", ()):
        return replace(words.named["contact"][value], alias=value, spot=spot)
    for member in members:
        node = _read_scalar(value, member, spot, words)
        if node is not None:
            return node
    if HISTORY in members and isinstance(value, int | float) and not isinstance(value, bool):
        value = repr(float(value))  # the same at all times
    quantity = read_quantity(value, members, spot) if isinstance(value, str) else None
    if quantity is not None:
        return quantity
    raise spot.make_error(f"is {_show(value)}: give {_describe_all(members, words)}")


def read_arguments(table: Mapping[str, Any], target: Callee, spot: Spot, words: Words) -> Call:
    """Return the call of a function with the keys of a table.

    Args:
        table: of the file; its key ``type`` has led to the function.
        target: the function.
        spot: where the table stands.
        words: what names mean.

    Raises:
        InputError: for a key that the function does not have, one that it needs and that is
            missing, and a value that does not fit.
    """
    values = {key: value for key, value in table.items() if key != "type"}
    for key in values:
        if key not in target.hints:
            nearest = suggest_nearest(key, target.hints)
            raise spot.make_table_error(f"has the unknown key '{key}' for {target.name}: {nearest}")
    missing = sorted(target.required - set(values))
    if missing:
        raise spot.make_table_error(
            f"lacks the key '{missing[0]}', which {target.name} needs: give it"
        )
    nodes = {
        key: read(value, target.hints[key], spot.go_to_key(key, target.unit(key)), words)
        for key, value in values.items()
    }
    return Call(target, nodes, spot)


def suggest_nearest(word: Any, known: Iterable[str]) -> str:
    """Return the rest of a sentence about a word nobody knows."""
    names = sorted(known) if isinstance(known, frozenset) else list(known)
    if not names:
        return "leave it out, as there are none"
    renamed = WORDS.get(str(word))
    if renamed in names:
        return f"it is now {renamed}"
    near = get_close_matches(str(word), names, n=3, cutoff=0.5)
    question = f"did you mean {' or '.join(near)}? " if near else ""
    return f"{question}Known: {', '.join(names)}"


def _read_scalar(value: Any, member: Any, spot: Spot, words: Words) -> Node | None:
    """Return the node, or None where the value is nothing of this type."""
    if member in (Any, object):
        return value
    if isinstance(value, bool):
        return value if member is bool else None
    if isinstance(value, int | float) and member is float:
        return float(value)
    if isinstance(value, int) and member is int:
        return value
    if isinstance(value, date) and member is date:
        return value
    return _read_text(value, member, spot, words) if isinstance(value, str) else None


def _read_text(value: str, member: Any, spot: Spot, words: Words) -> Node | None:
    """Return the node of a text, or None where it is nothing of this type."""
    if member in words.groups:
        return Group(value, member, spot)
    if member in words.named:
        named = words.named[member]
        if value not in named:
            raise spot.make_error(
                f"names '{value}', which does not exist: {suggest_nearest(value, named)}"
            )
        return named[value]
    if get_origin(member) is Literal:
        return value if value in get_args(member) else None
    if member in words.short:
        return _read_table({words.short[member]: value}, [member], spot, words)
    if is_path(member):
        if not value.strip():
            raise spot.make_error("is empty: give the path of a file or folder")
        return words.folder / value
    return value if member is str else None


def is_path(member: Any) -> bool:
    """Tell whether values for this type are paths."""
    origin = get_origin(member) or member
    return isinstance(origin, type) and issubclass(origin, os.PathLike)


def _read_list(value: list[Any], members: list[Any], spot: Spot, words: Words) -> Node:
    """Return the nodes of a list, of the first type that it fits.

    Where it fits none, the error is that of the first list.
    """
    first_error: InputError | None = None
    for member in members:
        if is_list(member):
            try:
                return _read_entries(value, member, spot, words)
            except InputError as error:
                first_error = first_error or error
    if first_error is not None:
        raise first_error
    if any(member in (Any, object) for member in members):
        return value
    raise spot.make_error(f"is a list: give {_describe_all(members, words)}")


def is_list(member: Any) -> bool:
    """Tell whether values for this type are lists."""
    return get_origin(member) in (tuple, list, Sequence)


def _read_entries(value: list[Any], member: Any, spot: Spot, words: Words) -> tuple[Node, ...]:
    """Return the nodes of a list for one type; InputError for another number of entries."""
    kinds = get_args(member)
    if get_origin(member) is not tuple or kinds[-1] is Ellipsis:
        kinds = (kinds[0],) * len(value)  # any number of entries, all of one type
    elif len(kinds) != len(value):
        raise spot.make_error(f"has {len(value)} entries: give {len(kinds)}")
    pairs = enumerate(zip(value, kinds, strict=True), start=1)
    return tuple(
        read(entry, kind, spot.go_to_entry(number), words) for number, (entry, kind) in pairs
    )


def _read_table(value: dict[str, Any], members: list[Any], spot: Spot, words: Words) -> Node:
    """Return the call that a table is, or the nodes of a table of names."""
    choices_of_members = [find_choices(member, words) for member in members]
    callable_choices: list[Any] = [choices for choices in choices_of_members if choices]
    if callable_choices:
        # A ChainMap has words in the order of the list, and looks them up one by one.
        choices = ChainMap(*callable_choices[::-1])
        defaults = [words.default[member] for member in members if member in words.default]
        word = value.get("type", defaults[0] if defaults else None)
        if word is None and len(choices) == 1:
            word = next(iter(choices))
        target = _choose(word, choices, members, spot, words)
        return read_arguments(value, target, spot, words)
    for member in members:
        if get_origin(member) in (Mapping, dict):
            kind = get_args(member)[1]
            return {
                key: read(entry, kind, spot.go_to_key(key, spot.unit), words)
                for key, entry in value.items()
            }
    raise spot.make_error(f"is a table: give {_describe_all(members, words)}")


def _choose(
    word: Any, choices: Mapping[str, Callee], kinds: Sequence[Any], spot: Spot, words: Words
) -> Callee:
    """Return what the ``type`` of a table calls.

    It is one of the choices, or a class of others of these kinds.
    """
    if isinstance(word, str) and ":" in word:
        return find_own_class(word, kinds, words.allowed, spot)
    if word is None:
        raise spot.make_table_error(f"has no type: give type = one of {', '.join(choices)}")
    renamed = WORDS.get(str(word))
    if renamed is not None and word not in choices and renamed in choices:
        warning = spot.make_table_error(f"type {_show(word)} is now {_show(renamed)}: write that")
        log.warning("%s", warning)
        return choices[renamed]
    if not isinstance(word, str) or word not in choices:
        raise spot.make_table_error(
            f"has the unknown type {_show(word)}: {suggest_nearest(word, choices)}"
        )
    return choices[word]


def find_choices(member: Any, words: Words) -> Mapping[str, Callee]:
    """Return what a table may make for this type.

    It is as listed, or an object of the value class itself.
    """
    if member in words.choices:
        return words.choices[member]
    if isinstance(member, type) and is_dataclass(member) and member not in words.groups:
        return {member.__name__: make_callee(member)}
    return {}


def _show(value: Any) -> str:
    """Return a value as in the file."""
    if isinstance(value, bool):
        return str(value).lower()
    return f"'{value[:SHOWN]}'" if isinstance(value, str) else quote(value)


_SCALARS = {
    float: "a number",
    int: "a whole number",
    bool: "true or false",
    str: "text",
    date: "a date",
}


def _describe_all(members: Sequence[Any], words: Words) -> str:
    """Return what would fit one of these types."""
    phrases = [phrase for member in members for phrase in _describe(member, members, words)]
    takes_functions = any(Callable in (member, get_origin(member)) for member in members)
    if takes_functions or not phrases:
        phrases.append("a function, which only the Python interface takes")
    return " or ".join(dict.fromkeys(phrases))


def _describe(member: Any, members: Sequence[Any], words: Words) -> list[str]:
    """Return what would fit one type of these."""
    if member in _SCALARS:
        return [_SCALARS[member]]
    if member in words.groups:
        return [f"the name of {GROUP[member.__name__]}"]
    if is_path(member):
        return ["the path of a file"]
    if get_origin(member) is Literal:
        return [" or ".join(_show(word) for word in get_args(member))]
    choices = find_choices(member, words)
    if choices:
        table = f"a table with type = one of {', '.join(choices)}"
        named = words.named.get(member)
        return [table, f"one of the names {', '.join(named)}"] if named else [table]
    if is_list(member):
        return [_describe_list(member, words)]
    if get_origin(member) in (Mapping, dict):
        return ["a table of names"]
    if member in (FIELD, HISTORY, OF_POINTS, Expression):
        return [_describe_expression(member, members)]
    return []


def _describe_list(member: Any, words: Words) -> str:
    """Return the kind of list, with that of its entries where they are numbers or texts."""
    kind = get_args(member)[0]
    if not _SCALARS.get(kind):
        return "a list"
    return f"a list of {_describe_all([kind], words).removeprefix('a ')}s"


def _describe_expression(member: Any, members: Sequence[Any]) -> str:
    """Return of what an expression may be."""
    if member == HISTORY:
        return "an expression of t"
    return "an expression" if float in members else "expressions of x, y, z, t, one per dimension"
