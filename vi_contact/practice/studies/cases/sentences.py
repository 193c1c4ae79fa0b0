"""Write sentences about Python calls in the words of case files.

Rooms below know nothing of case files, and their messages name what a person writes in Python. Who
has a case file reads here what to write there:

    mass=ConsistentMass()            [mass] type = "ConsistentMass"
    Condensed(Lemke())               [solver] type = "Condensed" and method = {type = "Lemke"}
    hinges=True                      hinges = true
    pass channel= in ...             pass channel = … in ...
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

from ....core.errors import ViContactError

# What is no class and no keyword, as Python has it -> as case files have it.
PHRASES = {
    "surface.with_frictionless_corners()": "frictionless_corners = true in every [[contact]]",
    "fem.joined_surfaces": "two [[contact]] tables",
    "contact_pair(…)": '[[contact]] type = "contact_pair"',
    "contact_pairs(…)": '[[contact]] type = "contact_pairs"',
    "meshes.cut.CutOpen": '[mesh] type = "CutOpen"',
    "fem.InitialStrain": '[[system.loads]] type = "InitialStrain"',
    "quasi_static on surface.moving(towards=…)": "in Python by quasi_static, with a moving surface",
    "assemble with base_inertia=True": "give [system] base_inertia = true",
    "changed=True": "--restart-changed",
    "restart=True": "--restart",
}
_PROBE = re.compile(r"Probe: points\['(\w+)'\]:")  # a point of the recorder
# what the name of a table says once more
_TWICE = re.compile(
    r"the (?:(?:default )?(?:(?:impact |friction )?law|scheme|solver)|problem) (?=\[)"
)
_PACKAGES = "(?:(?:vc|fem|laws|meshes|soil)\\.)?"
_CALL = re.compile(rf"(?<![\w.'])(?:[a-z_]+=)?{_PACKAGES}([A-Z]\w*(?:\.\w+)?)\(")
_KEYWORD = re.compile(r"(?<![\w./'\-])([a-z_]\w*)=(?![=\w])(…|\.\.\.)?")
_VALUE = re.compile(r"(?<![\w./'\-])([a-z_]\w*)=('[^']*'|[\w.+-]*\w)")


def write_for_case_files(text: str) -> str:
    """Return a sentence with the words of case files in place of calls of Python."""
    for phrase, translation in PHRASES.items():
        text = text.replace(phrase, translation)
    text = _PROBE.sub(r"[record.points] \1:", text)
    place = 0
    while (match := _CALL.search(text, place)) is not None:
        end = _find_bracket(text, match.end())
        words = _write_call(match[1], text[match.end() : end - 1])
        if words is None:  # no word of case files: what stands in its brackets may have some
            place = match.end()
            continue
        text = text[: match.start()] + words + text[end:]
        place = match.start() + len(words)
    text = _TWICE.sub("", text)
    text = _VALUE.sub(lambda match: f"{match[1]} = {_write_value(match[2])}", text)
    return _KEYWORD.sub(r"\1 = …", text)


@contextmanager
def in_words_of_case_files() -> Iterator[None]:
    """Raise the errors of what is done in it with their sentences in the words of case files."""
    try:
        yield
    except ViContactError as error:
        error.args = (write_for_case_files(str(error)), *error.args[1:])
        raise


def _find_bracket(text: str, start: int) -> int:
    """Return the place after the bracket that closes what has been opened before ``start``."""
    level = 1
    for place in range(start, len(text)):
        level += {"(": 1, ")": -1}.get(text[place], 0)
        if level == 0:
            return place + 1
    return len(text)


def _write_call(name: str, inside: str) -> str | None:
    """Return the table of a class, or None where case files have no such word.

    Args:
        name: of the class.
        inside: what stands between the brackets of its call.
    """
    from .vocabulary import find_word  # late: finite elements

    found = find_word(name)
    if found is None:
        return None
    place, keys = found
    entries = [f'type = "{name}"', *_write_arguments(inside, keys)]
    if place.startswith("["):
        return f"{place} {' and '.join(entries)}"
    return f"{place} = {{{', '.join(entries)}}}"


def _write_arguments(inside: str, keys: tuple[str, ...]) -> Iterator[str]:
    """Yield "key = value" of the arguments of a call, of which some may be dots.

    Args:
        inside: what stands between the brackets.
        keys: names of the parameters, for values without one.
    """
    from .vocabulary import find_word  # late: finite elements

    for number, argument in enumerate(_split_arguments(inside)):
        key, sign, value = argument.partition("=")
        if not sign or not key.isidentifier():
            key = keys[number] if number < len(keys) else ""
            value = argument
        value = value.strip()
        if argument in ("…", "...") or not key:
            continue
        inner, bracket, rest = value.partition("(")
        if bracket and find_word(inner) is not None:
            table = _write_call(inner, rest.removesuffix(")"))
            yield f"{key} = {{{str(table).partition(' = {')[2]}" if table else key
        elif not value or value.isidentifier():
            yield f"{key} = {_write_value(value) if value in ('True', 'False') else '…'}"
        else:
            yield f"{key} = {_write_value(value)}"


def _split_arguments(inside: str) -> list[str]:
    """Split at the commas that stand in no brackets of their own."""
    arguments = [""]
    level = 0
    for letter in inside:
        level += {"(": 1, "[": 1, ")": -1, "]": -1}.get(letter, 0)
        if letter == "," and level == 0:
            arguments.append("")
        else:
            arguments[-1] += letter
    return [argument.strip() for argument in arguments if argument.strip()]


def _write_value(value: str) -> str:
    """Return a value of Python as TOML has it."""
    if value in ("True", "False"):
        return value.lower()
    if value[:1] == "(":
        return f"[{value[1:-1]}]"
    return value.replace("'", '"')
