"""Write docs/reference/promises.md: numbers that the pages promise, and the tests that show them.

    python3 docs/make_promises.py            # write the page: after every change of a sentence
    python3 docs/make_promises.py --check    # say whether it is up to date

A promise is a sentence that states by a number how well something holds: a closure, an agreement,
an order. A test shows it when it bears ``@pytest.mark.promise("guide/soil.md", "a piece of the
sentence")``. The piece may stand in one sentence of the page only. A test whose bound is wider than
the number of the sentence says so: ``bound="1e-10"``.
"""

from __future__ import annotations

import ast
import re
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
DOCS = ROOT / "docs"
PAGE = DOCS / "reference" / "promises.md"
SOURCES = (
    ROOT / "README.md",
    *(path for room in ("start", "guide", "theory") for path in sorted((DOCS / room).glob("*.md"))),
)

HEAD = """# Promises

This page is for readers who ask which numbers of these pages a test shows. It lists the sentences
of the README and of the pages on first runs, guide and theory that state by a number how well
something holds. Such a number is a closure, an agreement, a bound of an error or an order. Inputs,
times, costs and rows of tables with results alone are not listed.

A test shows a sentence when it bears the marker `promise` with a piece of it, and when its bound
is at least as strict as the sentence. It may show one case of a sentence that speaks of several.
Other tests have a wider bound, often because a measured number differs between processors. They
notice large faults, and the number of the sentence is what was measured. Sentences without any
test stand at the end. They were measured when they were written, and nothing notices when they
become wrong.

The page is written by `docs/make_promises.py` from the pages and the tests.
"""

# What no reader sees as a sentence: front matter, listings, equations, comments, pictures.
_UNREAD = re.compile(
    r"\A---\n.*?\n---\n|^ *(```|~~~).*?^ *\1$|\$\$.*?\$\$|<!--.*?-->|!\[[^\]]*\]\([^)]*\)",
    re.MULTILINE | re.DOTALL,
)
_ITEM = re.compile(r" *(?:[-*]|\d+\.) ")
_ENDS = re.compile(r"(?<=[.!?])[\"*)\]]*\s+(?=[\"*(\[]*[A-ZÀ-Þ\d`$])")

_SMALL = r"(?:\d+(?:\.\d+)?(?:e-|·10⁻)\d*|\$?(?:\d+ \\cdot )?10\^\{-\d+\}|10⁻)"
_SHARE = r"\d+(?:\.\d+)?(?: \\?%|%)"
_EXACT = r"(?:round-?(?:off|ing)|the (?:last|same) (?:bits?|digits?))"
_FEW = r"(?:at most|up to|about|less than|better than|some)"
_JUDGES = (
    r"(?:agree\w*|differ\w*|right|reproduce\w*|errors?|miss\w*|holds?|close[sd]?|equals?|same|"
    r"finds?|found|keeps?|as .{0,40} says?|accurate|exact|bounded|off|shows?|is(?= to)|is that)"
)
# How a sentence states that something holds, by a number.
_PROMISE = re.compile(
    # to 1e-12, below 1e-9, by at most 3e-7: such small numbers are bounds
    rf"\b(?:to|within|below|by|than|is|are|most|under) (?:{_FEW} )?{_SMALL}"
    # right to 2 %, differ by 0.5 %: a share is a bound beside a word that compares
    rf"|\b{_JUDGES}\b[^.;]{{0,120}}?\b(?:to|within|by|below|most|than|is) (?:{_FEW} )?{_SHARE}"
    rf"|\b(?:within|to) (?:{_FEW} )?{_SHARE}[^.;]{{0,60}}\b{_JUDGES}\b"
    rf"|(?<!\d )\bto {_SHARE}\.?$|{_SHARE} too (?:small|large|high|low|long|far|stiff)\b"
    # a step above 1e-9 is not accepted
    rf"|\baccepts?\b[^.;]*{_SMALL}"
    # to round-off, to the last bit, all digits
    rf"|\b(?:to|but|at|than|as|is|are) (?:the )?{_EXACT}"
    r"|\b(?:[Dd]igit by digit|digit for digit|[Bb]it (?:by|for) bit)\b"
    r"|\b(?:[Aa]ll|[Ee]very|\w+)(?: printed)? digits?\b[^.;]* (?:reproduced|tested)"
    r"|\bto (?:all|the last|three|four|five|six|seven|eight|nine|ten) digits?\b"
    # falls with order 2, of order 2, keeps its order
    r"|\b(?:with|of|is|has|keeps) (?:about |its )?(?:the )?orders? (?:up to )?\d"
    r"|\berrors?\b[^.;]* of (?:first|second) order|\b[Oo]bserved order\b"
)
# Numbers that are none: settings, thresholds of refusals, what others do, what rounding does.
_ASIDE = re.compile(
    r"\brefuse[sd]?\b|\bfirst corrected\b|[Bb]utterworth|rounding unit|\bcounts? as\b|eigenvalue"
    r"|not reproduced|not at round-off|iterations? to|unit of u|[Pp]rograms differ|rings \("
    r"|depends?\b|adds? up|that damps|between alpha and b/h|Anderson|factorise nothing"
    r"|oscillates|may miss|is rounded to|measured at|squared error"
    r"|off symmetry|off by"
)


@dataclass(frozen=True)
class Marker:
    """Hold what a test says that it shows: a piece of a sentence of a page."""

    page: str
    piece: str
    file: str
    test: str
    bound: str  # of the test, if it is wider than the number of the sentence


@dataclass
class Promise:
    """Hold a sentence of a page, and the markers of tests that show it."""

    page: str
    text: str
    markers: list[Marker] = field(default_factory=list)

    @property
    def kind(self) -> str:
        """Return how it is shown: by a test, by one with a wider bound, or not."""
        if any(not marker.bound for marker in self.markers):
            return "shown"
        return "wider" if self.markers else "none"


def name_page(path: Path) -> str:
    """Return the name of a page as markers give it: README.md, guide/soil.md."""
    return path.relative_to(DOCS if DOCS in path.parents else ROOT).as_posix()


def read_blocks(text: str) -> Iterator[str]:
    """Yield paragraphs, items of lists and rows of tables, each on one line."""
    held: list[str] = []
    listing = False
    for line in [*_UNREAD.sub("\n", text).splitlines(), ""]:
        item = _ITEM.match(line)
        listing = line.startswith(" " * 4) and not item and (listing or not held)
        if listing or item or not line.strip() or line[0] in "|#":
            if held:
                yield " ".join(" ".join(held).split())
            held = []
        if line.strip() and not listing and line[0] != "#":
            held.append(line)


def read_sentences(text: str) -> Iterator[str]:
    """Yield the sentences of a page; a row of a table counts as one."""
    for block in read_blocks(text):
        if block[0] == "|":
            yield block
        else:
            yield from _ENDS.split(re.sub(rf"\A{_ITEM.pattern}", "", block))


def is_promise(sentence: str) -> bool:
    """Return whether a sentence states by a number how well something holds."""
    return bool(_PROMISE.search(sentence)) and not _ASIDE.search(sentence)


@cache
def read_tests() -> dict[str, str]:
    """Return the text of the files of tests that have markers, by their names in the clone."""
    paths = sorted([*(ROOT / "tests").rglob("test_*.py"), *DOCS.rglob("test_*.py")])
    texts = {path.relative_to(ROOT).as_posix(): path.read_text(encoding="utf-8") for path in paths}
    return {file: text for file, text in texts.items() if "@pytest.mark.promise(" in text}


@cache
def read_markers() -> tuple[Marker, ...]:
    """Return the markers of all tests, in the order of files; no test is imported.

    Tests are functions of a module.
    """
    markers = []
    for file, text in read_tests().items():
        tests = [node for node in ast.parse(text).body if isinstance(node, ast.FunctionDef)]
        for test in tests:
            for mark in test.decorator_list:
                if isinstance(mark, ast.Call) and ast.unparse(mark.func) == "pytest.mark.promise":
                    page, piece = (ast.literal_eval(argument) for argument in mark.args)
                    bounds = [ast.literal_eval(keyword.value) for keyword in mark.keywords]
                    markers.append(Marker(page, piece, file, test.name, "".join(bounds)))
    return tuple(markers)


def gather() -> tuple[list[Promise], list[Marker]]:
    """Return the promises of all pages with their tests, and the markers that fit none.

    A sentence that a marker names is a promise, whether or not it looks like one. A marker fits
    none when its piece stands in no sentence of its page, or in several.
    """
    sentences = [
        Promise(name_page(path), sentence)
        for path in SOURCES
        for sentence in read_sentences(path.read_text(encoding="utf-8"))
    ]
    lost = []
    for marker in read_markers():
        fitting = [
            sentence
            for sentence in sentences
            if sentence.page == marker.page and marker.piece in sentence.text
        ]
        if len(fitting) == 1:
            fitting[0].markers.append(marker)
        else:
            lost.append(marker)
    promises = [one for one in sentences if one.markers or is_promise(one.text)]
    return promises, lost


def write_cell(text: str) -> str:
    """Return a sentence as a cell of a table: no links, which would lead elsewhere from here."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", text)
    if "$" not in text:
        text = re.sub(r"(?<!\w)\*+(?=\w)|(?<=[\w.!?])\*+(?!\w)", "", text)  # no half of an emphasis
    return re.sub(r"\s*\|\s*", "; ", text.strip(" |"))


def write_rows(promises: list[Promise], kind: str) -> Iterator[str]:
    """Yield a table for each page that has promises of a kind."""
    for page in dict.fromkeys(one.page for one in promises if one.kind == kind):
        target = "../../README.md" if page == "README.md" else f"../{page}"
        yield f"**[{page}]({target})**\n"
        yield "| promise |" if kind == "none" else "| promise | test |"
        yield "|---|" if kind == "none" else "|---|---|"
        for one in promises:
            if one.page == page and one.kind == kind:
                tests = ", ".join(map(write_test, one.markers))
                yield f"| {write_cell(one.text)} |" + (f" {tests} |" if tests else "")
        yield ""


def write_test(marker: Marker) -> str:
    """Return a link to the file of a test, and its bound if that is wider."""
    link = f"[{marker.test}](../../{marker.file})"
    return f"{link}: {marker.bound}" if marker.bound else link


def write_page(promises: list[Promise]) -> str:
    """Return the page."""
    shown, wider, none = (
        sum(one.kind == kind for one in promises) for kind in ("shown", "wider", "none")
    )
    lines = [
        HEAD,
        f"Of {len(promises)} promises {shown} are shown by tests, {wider} by tests with a wider",
        f"bound only, and {none} by none.\n",
        "## Shown by tests\n",
        *write_rows(promises, "shown"),
        "## Tested to a wider bound\n",
        *write_rows(promises, "wider"),
        "## Without a test\n",
        *write_rows(promises, "none"),
    ]
    return "\n".join(lines).rstrip() + "\n"


def main() -> int:
    """Write the page, or with --check say whether it is up to date."""
    promises, lost = gather()
    for marker in lost:
        print(
            f"{marker.file}, {marker.test}: not one sentence of {marker.page} has {marker.piece!r}",
            file=sys.stderr,
        )
    page = write_page(promises)
    if "--check" not in sys.argv[1:]:
        PAGE.write_text(page, encoding="utf-8")
    elif not PAGE.is_file() or PAGE.read_text(encoding="utf-8") != page:
        print(
            f"{PAGE.name} is not that of pages and tests: python3 docs/make_promises.py",
            file=sys.stderr,
        )
        return 1
    return int(bool(lost))


if __name__ == "__main__":
    sys.exit(main())
