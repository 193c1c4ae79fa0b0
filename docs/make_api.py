"""Write docs/reference/api.md from the docstrings of the package. Run it after every change of a
public docstring:

    python3 docs/make_api.py            # write the page
    python3 docs/make_api.py --check    # status 1 and one sentence when the page is not what the docstrings say

It also puts the lines of every stub ``__init__.pyi``, the list of a room's public names, in order,
and writes its ``__all__``: the names are imported when they are first used, which checkers of types
and editors see in the stub only.
"""

from __future__ import annotations

import ast
import inspect
import re
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

from api_source import (
    PACKAGE,
    ROOT,
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
    stub_of,
)

PAGE = ROOT / "docs" / "reference" / "api.md"
ROOMS = (
    "core",
    "laws",
    "fem",
    "solvers",
    "vi",
    "schemes",
    "run",
    "soil",
    "engineering",
    "engineering.checks",
    "ground_motion",
    "bem",
    "meshes",
    "studies",
    "plots",
)
CONTRACT = (
    ("core.step", ("Scheme", "Solver", "PreparedSolver", "Recorder")),
    ("core.protocols", ("FrictionLaw", "ImpactLaw", "MassLaw", "Excitation")),
    ("core.obstacles", ("Obstacle",)),
    ("core.system", ("Companion",)),
)
VALUES = (
    ("core.step", ("State", "StepProblem", "EffectiveMatrix", "StepResult", "Balance", "Report")),
    ("core.protocols", ("Impact",)),
)
PROMISED = {name for _, names in CONTRACT for name in names}
HEAD = """# Names

This page is for users who write Python and look up how a name is called, and for developers of classes of their own.
In Python, `help(vc.simulate)` says more about each name: shapes, units, errors and sources.

The contract comes first: what schemes, solvers, recorders, laws, excitations and obstacles promise to the loop. A class
of your own needs these methods and no base class: [extend](../guide/extend.md) shows three. Then come the names of
`import vi_contact as vc`, and each *room* (a subpackage for one subject) with all its public names. Names are imported
when they are first used. So `import vi_contact` needs numpy and scipy only; `vi_contact.fem` needs DOLFINx, and
`Volume` needs PETSc.

How to read an entry: a value `…` is a default that is made anew for every object. Words such as `Array` are types. A
call that is [collective](glossary.md#collective) must be made on all ranks. Terms are in the [glossary](glossary.md).

Developers: `python3 docs/make_api.py` makes this page from the docstrings. Mend a docstring, then run it.
"""
STUB = (
    "# ruff: noqa",
    "# The public names of this package: one line each, here only. docs/make_api.py sorts them and "
    "writes __all__.",
)


def whole(node: Def) -> str:
    """Return the whole docstring; its lists of arguments, attributes and results become lists of
    the page."""

    def listed(found: re.Match[str]) -> str:
        items = re.sub(r"^ {4}(?! )", "- ", found[2], flags=re.MULTILINE)
        return f"*{found[1]}*\n\n" + re.sub(r"^ {8,}", "  ", items, flags=re.MULTILINE)

    heading = r"^(Args|Attributes|Returns|Raises):\n((?: {4}.*(?:\n|\Z))+)"
    return re.sub(heading, listed, documentation(node), flags=re.MULTILINE)


def below(where: Module, node: ast.stmt) -> str:
    """Return the text that stands below an assignment and explains it, or nothing."""
    after = where.tree.body[where.tree.body.index(node) + 1 :]
    value = after[0].value if after and isinstance(after[0], ast.Expr) else None
    return (
        inspect.cleandoc(value.value)
        if isinstance(value, ast.Constant) and isinstance(value.value, str)
        else ""
    )


def first_paragraph(where: Module, node: Def) -> str:
    """Return it on one line; where it refers to its module, after the first paragraph of the
    module."""
    words = documentation(node).split("\n\n")[0]
    for given in ("Step by the module's equations.", "Hold the settings."):
        if words.startswith(given):
            words = documentation(where.tree).split("\n\n")[0] + " " + words.removeprefix(given)
    return with_links(re.sub(r"\s+", " ", words).strip())


def with_links(words: str) -> str:
    """Return the words with a link to the glossary where a docstring says that a call is
    collective."""
    return re.sub(r"(?<=[.:)] )Collective(?=[.;])", "[Collective](glossary.md#collective)", words)


def entry(where: Module, name: str) -> str:
    """Return the line of a name: how it is called, and the first paragraph about it."""
    there, node = definition(where, name)
    if not isinstance(node, Def):
        value = there.source(node.value)  # type: ignore[attr-defined]
        told = f"is `{value}`." if len(value) < 60 else ""
        return " ".join(
            filter(None, [f"- **`{name}`**", told, re.sub(r"\s+", " ", below(there, node))])
        )
    call = constructor(there, node) if isinstance(node, ast.ClassDef) else function(there, node)
    has = (
        [one.name for one in methods(node)]
        if isinstance(node, ast.ClassDef) and name not in PROMISED
        else []
    )
    more = (
        f" It has {', '.join(f'`.{one}`' for one in has if one != '__call__')}."
        if set(has) - {"__call__"}
        else ""
    )
    return f"- **`{call}`** {first_paragraph(there, node)}{more}"


def listed(
    classes: Iterable[tuple[str, Iterable[str]]],
) -> Iterator[tuple[Module, ast.ClassDef, str]]:
    """Yield the module, the definition and the heading of every class of a list."""
    for path, names in classes:
        for name in names:
            where, node = definition(module(path), name)
            assert isinstance(node, ast.ClassDef)
            yield where, node, f"### `{name}` (`vi_contact.{path}`)\n"


def contract() -> Iterator[str]:
    """Yield the protocols with every method, then the values they exchange, and the whole of every
    docstring."""
    yield "## The contract\n"
    for where, node, heading in listed(CONTRACT):
        yield from (heading, f"{with_links(whole(node))}\n")
        for one in methods(node):
            yield from (f"#### `{function(where, one, 1)}`\n", f"{with_links(whole(one))}\n")
    yield "## Values of the contract\n"
    for where, node, heading in listed(VALUES):
        yield from (heading, f"`{constructor(where, node)}`\n", f"{whole(node)}\n")


def short_names() -> Iterator[str]:
    """Yield the names of ``vc.`` under the rooms that explain them."""
    yield "## `vi_contact`, imported as `vc`\n\n| room | names |\n|---|---|"
    home, seen = homes(module("")), public(module(""))
    for room in ROOMS:
        here = [f"`vc.{name}`" for name in seen if home[name].split(".")[0] == room]
        if here:
            yield f"| [`{room}`](#vi_contact{room}) | {', '.join(here)} |"
    yield ""


def room(name: str) -> Iterator[str]:
    """Yield the names of one room."""
    where = module(name)
    told = re.sub(
        r"(?ms)\n^>>> .*",
        lambda example: f"\n\n```pycon{example[0]}\n```",
        documentation(where.tree),
    )
    yield f"## `vi_contact.{name}`\n\n{told}\n"
    yield from (entry(where, one) for one in public(where))
    yield ""


def page() -> str:
    """Return the whole page."""
    parts = [HEAD, *contract(), *short_names(), *(line for name in ROOMS for line in room(name))]
    return re.sub(r"\n{3,}", "\n\n", "\n".join(parts)).rstrip() + "\n"


def stub(where: Module) -> str:
    """Return the stub of a package as it should be: its imports in order, and ``__all__`` of what
    they name."""
    imports = [
        line
        for line in stub_of(where).read_text(encoding="utf-8").splitlines()
        if line.startswith("from ")
    ]
    return "\n".join(
        [*STUB, *sorted(imports), "", f"__all__: list[str] = {sorted(public(where))}", ""]
    )


def files() -> Iterator[tuple[Path, str]]:
    """Yield every file that is made here, and what it holds."""
    yield PAGE, page()
    for path in sorted(PACKAGE.rglob("__init__.py")):
        where = module(path.parent.relative_to(PACKAGE).as_posix().replace("/", ".").strip("."))
        if stub_of(where).is_file():
            yield stub_of(where), stub(where)


def main(arguments: list[str]) -> int:
    """Write the page and the stubs, or compare them."""
    for path, text in files():
        if "--check" not in arguments:
            path.write_text(text, encoding="utf-8")
        elif not path.is_file() or path.read_text(encoding="utf-8") != text:
            name = path.relative_to(ROOT).as_posix()
            print(
                f"{name} is not what the docstrings say: run python3 docs/make_api.py",
                file=sys.stderr,
            )
            return 1
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
