"""The language of the pages: for whom each is, no sentence without an end, none too long."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import pytest

pytestmark = pytest.mark.serial
ROOT = Path(__file__).resolve().parents[2]
PAGES = sorted([*ROOT.glob("*.md"), *(ROOT / "docs").rglob("*.md")])
WORDS = 50  # of a sentence
FOR = re.compile(
    r"\bThis (?:page|demo|notebook) is for \w|\b(?:These pages are|It is|documentation,) for \w"
)
# code inside a line, equations, and the addresses of links
CODE = re.compile(r"``[^`]*``|`[^`]*`|\$[^$]*\$|\w\([^()]*…[^()]*\)|\]\([^)]*\)")
ENDS = re.compile(r"(?<=[.!?])[\"*)\]]*\s+(?=[\"*(\[]*[A-ZÀ-Þ\d`])")


def blocks(text: str) -> Iterator[str]:
    """Paragraphs, items of lists, headings and rows of tables, each on one line, without code and
    equations."""
    text = re.sub(r"\A---\n.*?\n---\n", "", text, flags=re.DOTALL)
    text = re.sub(
        r"^ *```.*?^ *```$|\$\$.*?\$\$|<!--.*?-->", "\n", text, flags=re.MULTILINE | re.DOTALL
    )
    held = [""]
    quoted = False
    for line in [*text.splitlines(), ""]:
        item = re.match(r" *(?:[-*]|\d+\.) ", line)
        quoted = line.startswith(" " * 4) and (quoted or held == [""]) and not item
        if quoted or item or not line.strip() or line[0] in "|#":
            yield from filter(None, [" ".join(held).strip()])
            held = [""]
        if not quoted and line.strip():
            held.append(line.strip())


def prose(page: Path) -> list[str]:
    """The blocks of a page, with C for what is code in them."""
    text = page.read_text(encoding="utf-8")
    return [
        CODE.sub(lambda code: "]" if code[0][0] == "]" else "C", block) for block in blocks(text)
    ]


def long_sentences(block: str) -> list[str]:
    """Those of a paragraph that have too many words; a colon or a semicolon does not end a
    sentence."""
    return (
        [] if block[:1] in "|#" else [one for one in ENDS.split(block) if len(one.split()) > WORDS]
    )


def ellipses(block: str) -> list[str]:
    """Dots that leave something out; those of a series, "+ ...", are mathematics."""
    return re.findall(r".{0,30}(?<!\+ )(?:…|\.\.\.).{0,10}", block)


@pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_a_page_says_for_whom_and_speaks_in_sentences(page: Path) -> None:
    text = prose(page)
    first = next(block for block in text if block[0] not in "#|!")
    assert FOR.search(first), first
    assert [found for block in text for found in ellipses(block)] == []
    assert [found for block in text for found in long_sentences(block)] == []


def test_bad_language_is_found() -> None:
    """The rules have teeth."""
    assert (
        ellipses("`u_x_1`, … of the points")
        and ellipses("from 1 ... 3")
        and not ellipses("x = 1 + 2 y + ...")
    )
    assert long_sentences("so " * WORDS + "it ends.")
    assert not long_sentences("so " * 40 + "it ends. " + "So " * 40 + "it ends.")
    assert list(
        blocks(
            "# A\n\nOne\ntwo.\n\n    code ...\n    more ...\n\n- an item\n  of two lines\n- next\n"
        )
    ) == ["# A", "One two.", "- an item of two lines", "- next"]
