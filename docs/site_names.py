"""Write the pages of names that only the site has: one a room, with an entry of the index for each
name and method.

``docs/conf.py`` calls it before each build. The pages are not kept; ``docs/reference/api.md`` tells
the same in short.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator

from api_source import (
    Def,
    Module,
    constructor,
    definition,
    documentation,
    function,
    homes,
    methods,
    module,
    public,
)
from make_api import ROOMS, ROOT, below, whole

FOLDER = ROOT / "docs" / "reference" / "names"


def directive(kind: str, signature: str, text: str, *options: str) -> str:
    """Return a directive of Sphinx's Python domain, in MyST's words, with more colons than what it
    holds."""
    colons = ":" * (
        3 + max((len(found) - 2 for found in re.findall(r"^:{3,}", text, re.MULTILINE)), default=0)
    )
    return "\n".join([f"{colons}{{py:{kind}}} {signature}", *options, "", text, colons, ""])


def described(text: str) -> str:
    """Return a docstring as Markdown: examples in blocks, links to documents, dollar signs as they
    are."""
    text = re.sub(r"(?ms)^>>> .*?(?=\n\n|\Z)", lambda example: f"```pycon\n{example[0]}\n```", text)
    text = re.sub(r"(?<![\w`/])(?:docs/\w+/\w+|README)\.md", r"[\g<0>](../../../\g<0>)", text)
    return text.replace("$", r"\$")


def members(where: Module, node: ast.ClassDef) -> Iterator[str]:
    """Yield the entries of the methods and properties of a class."""
    for one in methods(node):
        call = function(where, one, 1)
        name, colon, result = (
            call.partition(": ") if "(" not in call.split(":")[0] else (call, "", "")
        )
        text, silent = described(whole(one)), [":no-index-entry:"] * (one.name == "__call__")
        kind, written, options = (
            ("property", name, [f":type: {result}"]) if colon else ("method", call, silent)
        )
        yield directive(kind, written, text, *options)


def entry(name: str, where: Module, short: bool) -> str:
    """Return the entry of a public name of a room; where ``vc.`` has it too, links to that name
    lead here as well."""
    there, node = definition(where, name)
    options = [f":canonical: vi_contact.{name}"] if short else []
    if not isinstance(node, Def):
        value = there.source(node.value)  # type: ignore[attr-defined]
        told = [f"It is `{value}`." if len(value) < 60 else "", below(there, node)]
        return directive("data", name, " ".join(filter(None, told)), *options)
    text = described(whole(node)) + (f"\n\nIt is `vc.{name}` too.\n" if short else "\n")
    if isinstance(node, ast.ClassDef):
        return directive(
            "class", constructor(there, node), "\n".join([text, *members(there, node)]), *options
        )
    return directive("function", function(there, node), text, *options)


def room_page(name: str) -> str:
    """Return the page of one room."""
    where, above = module(name), homes(module(""))
    path = f"vi_contact.{name}"
    entries = (entry(one, where, above.get(one, "").split(".")[0] == name) for one in public(where))
    head = f"# {path}\n\n:::{{py:module}} {path}\n:::\n"
    told = (
        "This page is for users who write Python. It has every public name of this room, with "
        "its whole docstring.\n"
    )
    return "\n".join([head, told, described(documentation(where.tree)), "", *entries])


def overview() -> str:
    """Return the page that lists the rooms."""
    told = {
        name: documentation(module(name).tree).split("\n\n")[0].replace("\n", " ") for name in ROOMS
    }
    rows = (f"| [vi_contact.{name}]({name}.myst) | {text} |" for name, text in told.items())
    head = "# Every name, room by room\n"
    more = (
        "These pages are for users who write Python and look up a name: its arguments, units, "
        "errors and sources. "
        "They are made from the docstrings. {ref}`The index <genindex>` has all names.\n"
    )
    table = ["| room | what it holds |", "|---|---|", *rows, ""]
    below = ["```{toctree}", ":hidden:", "", *(f"{room} <{room}>" for room in ROOMS), "```"]
    return "\n".join([head, more, *table, *below])


def write_site_pages() -> None:
    """Write every page that has changed."""
    FOLDER.mkdir(exist_ok=True)
    for name, text in {"index": overview(), **{room: room_page(room) for room in ROOMS}}.items():
        path = FOLDER / f"{name}.myst"
        if not path.is_file() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")
