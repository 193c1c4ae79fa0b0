"""Write a Gmsh script anew in words that can do no harm: geometry, sizes, groups and arithmetic.

Gmsh runs commands of the shell and opens files from scripts, so none is given to it as it stands.
The script is cut into tokens. Statements that change no mesh, as most scripts have some
(``Printf``, ``Save``, ``Mesh 2``, options of the window), are left out. All other tokens must be
words that geo_words.py lists, or names that the script sets. Those names get a prefix, so that
none of them can be a command, and texts stand only where groups are named.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from stat import S_ISREG
from typing import NamedTuple

from vi_contact.core.checks import quote
from vi_contact.core.errors import InputError
from vi_contact.meshes.geo_words import (
    FIELD_OPTIONS,
    MESH_OPTIONS,
    PARAMETERS,
    UNSEEN_OF_GEOMETRY,
    UNSEEN_OF_MESH,
    WORDS,
)

LARGEST = 2_000_000  # bytes of a script
MOST_PLACES = 20  # how many refused places one message names
PREFIX = "own_"  # before the names that a script sets

_UNSEEN_OPTIONS = frozenset(("General", "Print", "PostProcessing", "View"))  # all options of these
_UNSEEN_COMMANDS = frozenset(("Printf", "Print", "Save", "Draw"))  # up to their semicolon
# up to their semicolon, or the brace that ends them
_UNSEEN_BRACES = frozenset(("Color", "Show", "Hide"))

_TOKEN = re.compile(
    r"(?P<blank>[ \t]+|//[^\n]*|/\*.*?\*/|\n)"
    r"|(?P<open>/\*[^\n]*)"
    r"|(?P<text>\"[^\"\\\x00-\x1f]*\")"
    r"|(?P<escaped>\"(?:[^\"\\\x00-\x1f]|\\[^\x00-\x1f])*\")"
    r"|(?P<name>[A-Za-z_]\w*)"
    r"|(?P<sign>(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][+-]?\d+)?"
    r"|[-+*/<>=!]=|&&|\|\||\+\+|--|[-+*/%^<>!?:=,;.#(){}\[\]])",
    re.ASCII | re.DOTALL,
)
# Names that a script sets: h = …, list[] = …, list() = …, For i In …
_SET = re.compile(r"(?<![\w.])([A-Za-z_]\w*)\s*(?:=(?!=)|\[\s*\]\s*=|\(\s*\)\s*=|In\b)", re.ASCII)
_ARITHMETIC = re.compile(r'"[\w\s.,+*/^()-]*"', re.ASCII)
# Gmsh leaves out of a group what is not there, without a word. What is written in the place of a
# group asks for it.
_GROUP = re.compile(
    r'( Physical\s+(Line|Curve|Surface|Volume)\s+\(\s*(?:"([^"%]*)[^"]*")?[^"()]*\)\s+\+?=)'
    r"(?!\s*\{\s*:)((?:[^;{}]|\{(?:[^{}]|\{(?:[^{}]|\{[^{}]*+\})*+\})*+\})*+);"
)
_CHECKED = (
    r' told [ ] =\4; If (#told[] == 0) Error("it is empty, the group \3"); EndIf Printf("in the '
    r'group \3");'
    r" told_[] = Boundary{ \2{ told[] }; };\1 told [ ] ;"
)


class Token(NamedTuple):
    """Hold a piece of a script.

    It is blank, open (comment), text, escaped (text), name, sign, or "" for what is none.
    """

    kind: str
    word: str
    line: int


@dataclass(frozen=True)
class Script:
    """Hold the text that Gmsh gets, and (line, beginning) of the statements that were left out."""

    text: str
    left_out: tuple[tuple[int, str], ...]


def rewrite_script(path: Path, numbers: Mapping[str, float] | None = None) -> Script:
    """Return the script in listed words alone, each in its line.

    Args:
        path: the script.
        numbers: values of names that the script uses and does not set, or sets by DefineConstant
            alone, as Gmsh's option -setnumber gives them.

    Raises:
        InputError: a file that cannot be read, words that are not allowed, all of them with their
            lines, and a number that the script does not use or sets itself.
    """
    text = _read(path)
    value_of_name = dict(numbers or {})
    tokens = _cut(text)
    _refuse_numbers_without_effect(path, tokens, value_of_name)
    own_names = (set(_SET.findall(text)) | set(value_of_name)) - WORDS
    statements, left_out = _leave_out(tokens)
    written = "".join(_write(path, _drop_parameters(statements), own_names))
    values = ""
    for name, value in value_of_name.items():
        values += f"{PREFIX}{name} = {float(value)!r}; "
    return Script(values + _GROUP.sub(_CHECKED, written) + "\n", tuple(left_out))


def _read(path: Path) -> str:
    """Return the text of a script with line ends as on Unix."""
    try:
        if not S_ISREG(os.stat(path).st_mode):
            raise OSError("it is no file")
        with open(path, "rb") as file:
            data = file.read(LARGEST + 1)
        text = data.decode("utf-8-sig")
    except (OSError, ValueError) as error:
        raise InputError(
            f"Gmsh script {quote(str(path))} cannot be read ({error}): check the path"
        ) from None
    if len(data) > LARGEST:
        raise InputError(f"{path}: the script has more than {LARGEST} bytes: mesh it yourself")
    return re.sub("\r\n?", "\n", text)


def _cut(text: str) -> list[Token]:
    """Cut a text into tokens."""
    tokens = []
    place = 0
    line = 1
    while place < len(text):
        match = _TOKEN.match(text, place)
        word = match[0] if match else text[place]
        kind = str(match.lastgroup) if match else ""
        place += len(word)
        line += word.count("\n")
        tokens.append(Token(kind, word, line))
    return tokens


def _leave_out(tokens: Sequence[Token]) -> tuple[list[Token], list[tuple[int, str]]]:
    """Return the tokens without the statements that change no mesh, and what these were.

    Each of these statements is told by its line and its beginning.
    """
    remaining: list[Token] = []
    left_out: list[tuple[int, str]] = []
    before = ""  # the last word that is no blank
    place = 0
    while place < len(tokens):
        token = tokens[place]
        end = _find_end_of_unseen(tokens, place) if _can_begin(before) else place
        if end == place:
            remaining.append(token)
            if token.kind != "blank":
                before = token.word
            place += 1
            continue
        # Line ends stay, so that what Gmsh says of a line is true of the user's script.
        statement = tokens[place:end]
        remaining += [token for token in statement if token.kind == "blank"]
        left_out.append((token.line, _name_statement(statement)))
        place = end
    return remaining, left_out


def _can_begin(before: str) -> bool:
    """Tell whether a statement can begin after this word."""
    return before in ("", ";", "}", ")", "EndIf", "EndFor", "Else")


def _name_statement(statement: Sequence[Token]) -> str:
    """Return the words by which a user knows a statement that was left out."""
    words = [token.word for token in statement if token.kind != "blank"]
    if words[1:2] == ["."]:
        return "".join(words[:3])
    return " ".join(words[:2]) if words[0] in ("Mesh", "Recursive") else words[0]


def _find_end_of_unseen(tokens: Sequence[Token], start: int) -> int:
    """Return the place after the statement at ``start`` if it changes no mesh, else ``start``."""
    ahead = [token.word for token in tokens[start : start + 12] if token.kind != "blank"]
    first, second, third = [*ahead, "", "", ""][:3]
    if first == "Recursive":
        first = second
    option = second == "."
    unseen = (
        (first in _UNSEEN_COMMANDS and not option)
        or first in _UNSEEN_BRACES
        or (first == "Mesh" and second in ("1", "2", "3") and third == ";")
        or (option and first in _UNSEEN_OPTIONS)
        or (option and first == "Mesh" and third in UNSEEN_OF_MESH)
        or (option and first == "Geometry" and third in UNSEEN_OF_GEOMETRY)
    )
    if not unseen:
        return start
    return _find_end(tokens, start, braces=first in _UNSEEN_BRACES)


def _find_end(tokens: Sequence[Token], start: int, *, braces: bool) -> int:
    """Return the place after the statement that begins at ``start``.

    Args:
        tokens: of the script.
        start: where the statement begins.
        braces: whether a closing brace ends it too, unless another brace opens behind it, as in
            Color {1, 2, 3} { Line{1}; }

    Returns:
        The place, or ``start`` where the statement does not end.
    """
    level = 0
    for place in range(start, len(tokens)):
        token = tokens[place]
        if token.kind in ("", "open"):
            return start  # what is no word of a script is refused, wherever it stands
        if token.kind != "sign":
            continue
        level += _change_level(token.word)
        if level < 0:
            return start
        if level == 0 and token.word == ";":
            return place + 1
        if level == 0 and braces and token.word == "}":
            after = _find_next_word(tokens, place + 1)
            following = tokens[after].word if after < len(tokens) else ""
            if following == ";":
                return after + 1
            if following != "{":
                return place + 1
    return start


def _change_level(word: str) -> int:
    """Return how a sign changes the number of open brackets: 1, -1 or 0."""
    if word in ("(", "[", "{"):
        return 1
    return -1 if word in (")", "]", "}") else 0


def _find_next_word(tokens: Sequence[Token], place: int) -> int:
    """Return the first place, from ``place`` on, of a token that is no blank."""
    while place < len(tokens) and tokens[place].kind == "blank":
        place += 1
    return place


def _drop_parameters(tokens: Sequence[Token]) -> list[Token]:
    """Return the tokens without the parameters of definitions.

    DefineConstant[ h = {1, Name "size", Min 0} ] becomes DefineConstant[ h = 1 ]. What follows the
    value tells a window how to show it, and a text could name a file.
    """
    remaining: list[Token] = []
    place = 0
    inside = False  # the brackets of a DefineConstant
    level = 0
    before = ""  # the last word that is no blank
    while place < len(tokens):
        token = tokens[place]
        if before == "DefineConstant" and token.word in ("[", "("):
            inside = True
            level = 0
        if inside:
            level += _change_level(token.word)
            inside = level > 0
        if inside and before == "=" and token.word == "{":
            value, after = _find_value_and_end(tokens, place)
            if value is not None:
                remaining += value
                before = "}"
                level -= 1  # the closing brace is dropped too
                place = after
                continue
        remaining.append(token)
        if token.kind != "blank":
            before = token.word
        place += 1
    return remaining


def _find_value_and_end(tokens: Sequence[Token], start: int) -> tuple[list[Token] | None, int]:
    """Return the tokens of the value in {value, parameters}, and the place after the closing brace.

    Line ends among the parameters stay. Braces without parameters hold a list of numbers: for them
    the answer is None, and the place is ``start``.
    """
    level = 0
    comma = 0  # the first one at the level of the braces
    named = False  # whether a parameter stands behind a comma
    before = ""
    for place in range(start, len(tokens)):
        token = tokens[place]
        if token.kind == "blank":
            continue
        level += _change_level(token.word)
        if level == 0:
            if not named:
                return None, start
            blanks = [token for token in tokens[comma:place] if token.kind == "blank"]
            return [*tokens[start + 1 : comma], *blanks], place + 1
        if level == 1 and token.word == "," and not comma:
            comma = place
        named = named or (level == 1 and before == "," and token.word in PARAMETERS)
        before = token.word
    return None, start


def _write(path: Path, tokens: Sequence[Token], own_names: set[str]) -> Iterator[str]:
    """Yield the words that Gmsh gets, behind line ends where it needs them.

    Args:
        path: the script, for messages.
        tokens: what is left of it.
        own_names: names that the script sets, which get a prefix.

    Raises:
        InputError: words that are not allowed, all of them.
    """
    refused: list[tuple[Token, bool]] = []  # with whether it is a value that nobody has set
    words = ["", "", ""]
    level = 0  # brackets that are open since the last For
    skipping = False  # the rest of a statement that is refused
    # Gmsh repeats whole lines, from the one below For {…} to that of EndFor: they end there.
    begins = False
    ends = False
    for place, token in enumerate(tokens):
        kind = token.kind
        word = token.word
        if kind == "blank":
            line_ends = word.count("\n")
            if line_ends:
                ends = False
            yield "\n" * line_ends
            continue
        if skipping:
            skipping = word != ";"
        elif not _fits(kind, word, words, own_names):
            refused.append((token, _is_value(tokens, place, words)))
            skipping = word != ";"
        if ends:
            yield "\n"
        is_own = word in own_names and words[-1] != "."
        yield f" {PREFIX}{word}" if is_own else f" {word}"
        words.append(word)
        level = 0 if word == "For" else level + _change_level(word)
        ends = word == "EndFor" or (begins and level == 0 and word in (")", "]", "}"))
        begins = (begins or word == "For") and not ends
    if refused:
        raise InputError(f"{path}: {_write_sentence(refused)}")


def _fits(kind: str, word: str, words: Sequence[str], own_names: set[str]) -> bool:
    """Tell whether a token may stand behind these words.

    Args:
        kind: of the token.
        word: its text.
        words: what stands before it, three words or more.
        own_names: names that the script sets.
    """
    if kind == "text":
        names_a_group = words[-1] == "(" and (words[-2] == "SetFactory" or words[-3] == "Physical")
        is_formula = list(words[-3:]) == [".", "F", "="] and bool(_ARITHMETIC.fullmatch(word))
        means_all = word == '"*"' and words[-2] in ("Transfinite", "Recombine")
        return names_a_group or is_formula or means_all
    if kind == "name" and words[-1] == ".":
        is_mesh_option = words[-2] == "Mesh" and word in MESH_OPTIONS
        is_field_option = words[-2] == "]" and word in FIELD_OPTIONS
        return is_mesh_option or is_field_option
    if kind == "name":
        return word in WORDS or word in own_names
    return kind == "sign" and (word != "." or words[-1] in ("Mesh", "]"))


def _is_value(tokens: Sequence[Token], place: int, words: Sequence[str]) -> bool:
    """Tell whether a name stands where a number is wanted.

    It is then no command, no function, no option and no kind of field.
    """
    before = words[-1]
    is_field = list(words[-2:]) == ["]", "="] and "Field" in words[-6:]
    next_place = _find_next_word(tokens, place + 1)
    after = tokens[next_place].word if next_place < len(tokens) else ""
    return (
        tokens[place].kind == "name"
        and not _can_begin(before)
        and before != "."
        and not is_field
        and after[:1] in (",", ";", ")", "}", "]", "+", "-", "*", "/", "^", "<", ">", "?", ":")
    )


def _write_sentence(refused: Sequence[tuple[Token, bool]]) -> str:
    """Return the sentence of all that is refused, with its lines, and the remedy of each kind."""
    values = dict.fromkeys(token.word for token, is_value in refused if is_value)
    foreign = [token for token, is_value in refused if not is_value]
    parts = []
    if foreign:
        listed = foreign[:MOST_PLACES]
        places = ", ".join(f"line {token.line} has {quote(token.word)}" for token in listed)
        unlisted = len(foreign) - MOST_PLACES
        ending = f", and {unlisted} more" if unlisted > 0 else ""
        pronoun = "them" if len(foreign) > 1 else "it"
        parts.append(
            f"{places}{ending}, and only words of geometry, sizes, groups and arithmetic are "
            f"meshed here: leave {pronoun} out, or mesh the script yourself and give the .msh"
        )
    if values:
        first = {token.word: token.line for token, is_value in reversed(refused) if is_value}
        places = ", ".join(f"line {first[name]} uses '{name}'" for name in values)
        table = ", ".join(f"{name} = …" for name in values)
        parts.append(
            f"{places}, which the script does not set: set it there, or give numbers = {{{table}}}"
        )
    return "; ".join(parts)


def _refuse_numbers_without_effect(
    path: Path, tokens: Sequence[Token], numbers: Mapping[str, float]
) -> None:
    """Raise InputError for a number that the script does not use, or sets whatever is given."""
    words = [token for token in tokens if token.kind != "blank"]
    names = {token.word for token in words if token.kind == "name"}
    define = 0  # level of brackets inside a DefineConstant
    set_at: dict[str, int] = {}
    for before, token, after in zip(words, words[1:], words[2:], strict=False):
        if define or before.word == "DefineConstant":
            define += _change_level(token.word)
        elif token.kind == "name" and after.word in ("=", "In") and before.word != ".":
            set_at.setdefault(token.word, token.line)
    if len(words) > 1 and words[0].kind == "name" and words[1].word == "=":
        set_at.setdefault(words[0].word, words[0].line)
    for name in numbers:
        if name not in names:
            raise InputError(
                f"{path}: numbers gives '{name}', which the script does not use: leave it out"
            )
        if name in set_at:
            raise InputError(
                f"{path}: numbers gives '{name}', but line {set_at[name]} sets it in any case: "
                f"write DefineConstant[ {name} = … ] there"
            )
