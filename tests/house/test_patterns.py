"""Every regular expression of the package takes a time that grows as the text does, whatever the
text is."""

from __future__ import annotations

import ast
import importlib
import re
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

import vi_contact

pytestmark = pytest.mark.serial
ROOT = Path(vi_contact.__file__).parent
SOURCES = {path: path.read_text("utf-8") for path in sorted(ROOT.rglob("*.py"))}
PIECES = (
    "1",
    "1.",
    ".",
    "1.1",
    "1D",
    "+",
    "-",
    " ",
    "\t",
    "\n",
    "*",
    "* ",
    "(",
    "1(",
    "1(gal)",
    "1 (x) / ",
    ")",
    "a",
    "A ",
    "A_^/",
    "KEY ",
    ":",
    "=",
    "/",
    "0 Hz ",
    "NPTS ",
    "NPTS=",
    "DT =",
    "1 1, ",
    "units of ",
    "units (",
    "step ",
    "1 s ",
    "begin data ",
    "*begin data",
    "1 accel pts ",
    "1 accel ",
    "in g ",
    "(1F1",
    "(8F10.3) ",
    "format v1.",
    "format v1 with ",
    "chan 1: ",
    "chan x from ",
    "station = ",
    "station component",
    "station no: ",
    "code: ",
    "unknown/unspecified: 1, ",
    "equally spaced at 1 ",
    "at 1 ",
    "1 real-header values follow on 1 ",
    "a.",
    '"a".',
    "'",
    "x (at line 1, ",
    "2 corrected ",
    "\n$Nodes ",
)
SHORT, LONG = 200, 3200
MANY = 20  # tries, where few may tell of what else ran beside the short text or beside the long one
SLOWER = 64.0  # of LONG over SHORT: 16 where time grows as the text, 256 where as its square


def patterns() -> Iterator[tuple[str, re.Pattern[str] | re.Pattern[bytes]]]:
    """Compiled ones in the modules, alone and in tuples, and constant texts given to functions of
    ``re``."""
    for path, source in SOURCES.items():
        if not re.search(r"\bre\.\w+\(", source):
            continue
        module = importlib.import_module(
            ".".join(path.relative_to(ROOT.parent).with_suffix("").parts)
        )
        for name, value in vars(module).items():
            several = value if isinstance(value, tuple) else (value,)
            yield from (
                (f"{path.stem}.{name}", one) for one in several if isinstance(one, re.Pattern)
            )
        for call in ast.walk(ast.parse(source)):
            if (
                isinstance(call, ast.Call)
                and ast.unparse(call.func).startswith("re.")
                and call.args
            ):
                inside = ast.unparse(call.func) != "re.compile"
                assert not inside or isinstance(call.args[0], ast.Constant), (
                    f"{path}: a pattern that is not tested"
                )
                if inside:
                    yield (
                        f"{path.stem}, line {call.lineno}",
                        re.compile(ast.literal_eval(call.args[0])),
                    )


def seconds(pattern: re.Pattern[str] | re.Pattern[bytes], text: str) -> float:
    """Of this process, for a search and a match."""
    given = text.encode() if isinstance(pattern.pattern, bytes) else text
    begin = time.process_time()
    pattern.search(given)  # type: ignore[arg-type]
    pattern.fullmatch(given)  # type: ignore[arg-type]
    return time.process_time() - begin


def grows(pattern: re.Pattern[str] | re.Pattern[bytes], text: str, tries: int = 3) -> float:
    """How much longer a text of sixteen times the length takes, each at its quickest of tries that
    alternate."""
    short, long = ((text * size)[:size] + "!" for size in (SHORT, LONG))
    times = [(seconds(pattern, short), seconds(pattern, long)) for _ in range(tries)]
    quick, slow = map(min, zip(*times, strict=True))
    return slow / max(quick, 2e-5)


def test_time_grows_as_the_text() -> None:
    found = dict(patterns())
    assert len(found) > 20 and "cosmos._UNITS" in found and "text._NUMBER" in found
    for name, pattern in patterns():
        for piece in PIECES:
            times = grows(pattern, piece)
            times = times if times <= SLOWER else grows(pattern, piece, MANY)
            assert times <= SLOWER, (
                f"{name} takes {times:.0f} times as long for sixteen times {piece!r}"
            )


def test_a_quadratic_pattern_is_found() -> None:
    """The test can fail: a search for digits before a bracket begins at each of them anew."""
    assert grows(re.compile(r"\d+\("), "1", MANY) > SLOWER
