"""Write the two tables of docs/reference/glossary.md from its entries.

They lead from German to English and from French to English.

    python3 docs/make_glossary.py            # write them: after every change of an entry
    python3 docs/make_glossary.py --check    # say whether they are up to date

An entry is a heading ``### term``, a line with its words in German and French, and a paragraph.
"""

from __future__ import annotations

import re
import sys
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

PAGE = Path(__file__).resolve().parent / "reference" / "glossary.md"
LANGUAGES = ("German", "French")
_ENTRY = re.compile(
    r"^### (?P<term>[^\n]+)\n\n"
    r"German \*(?P<german>[^*\n]+)\*, French \*(?P<french>[^*\n]+)\*\.(?P<facts>[^\n]*)\n\n"
    r"(?P<text>[^\n#][^\n]*)$",
    re.MULTILINE,
)


@dataclass(frozen=True)
class Entry:
    """Hold one term and what it means.

    It has the words in German and French, its symbol, its unit and its names in the code.
    """

    term: str
    german: tuple[str, ...]
    french: tuple[str, ...]
    facts: str
    text: str

    @property
    def anchor(self) -> str:
        """Return the anchor of the heading, as GitHub makes it."""
        return re.sub(r"[^\w\- ]", "", self.term.lower()).replace(" ", "-")

    def words(self, language: str) -> tuple[str, ...]:
        """Return the words of a language."""
        return {"German": self.german, "French": self.french}[language]


def entries(page: str) -> list[Entry]:
    """Return the entries of a page, in its order."""
    found = []
    for one in _ENTRY.finditer(page):
        german, french = (tuple(one[language].split(", ")) for language in ("german", "french"))
        found.append(Entry(one["term"], german, french, one["facts"], one["text"]))
    return found


def order(word: str) -> str:
    """Return what words are sorted by: without accents and capitals."""
    bare = unicodedata.normalize("NFKD", word.casefold())
    return "".join(letter for letter in bare if not unicodedata.combining(letter))


def table(found: list[Entry], language: str) -> Iterator[str]:
    """Return the lines of the table of a language."""
    yield f"| {language} | English |"
    yield "|---|---|"
    pairs = {(word, one) for one in found for word in one.words(language)}
    for word, one in sorted(pairs, key=lambda pair: (order(pair[0]), order(pair[1].term))):
        yield f"| {word} | [{one.term}](#{one.anchor}) |"


def written(page: str) -> str:
    """Return the page with its tables made anew."""
    found = entries(page)
    for language in LANGUAGES:
        start, end = f"<!-- {language} to English -->\n", f"<!-- end of {language} -->"
        before, rest = page.split(start)
        page = before + start + "\n".join(table(found, language)) + "\n" + end + rest.split(end)[1]
    return page


def main() -> int:
    """Write the tables, or with --check say whether they are up to date."""
    page = PAGE.read_text(encoding="utf-8")
    if "--check" in sys.argv[1:]:
        if written(page) != page:
            print(
                f"{PAGE.name}: tables are not those of its entries: python3 docs/make_glossary.py",
                file=sys.stderr,
            )
            return 1
        return 0
    PAGE.write_text(written(page), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
