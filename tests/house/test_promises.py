"""Numbers that pages promise: the page of docs/make_promises.py is up to date, and its rules have
teeth."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest

pytestmark = pytest.mark.serial
ROOT = Path(__file__).resolve().parents[2]
SPEC = importlib.util.spec_from_file_location("make_promises", ROOT / "docs" / "make_promises.py")
assert SPEC is not None and SPEC.loader is not None
PROMISES = importlib.util.module_from_spec(SPEC)
sys.modules[SPEC.name] = PROMISES  # where dataclasses look for their types
SPEC.loader.exec_module(PROMISES)


def test_markers_name_sentences_and_the_page_is_theirs() -> None:
    """After a change of a sentence or a marker: python3 docs/make_promises.py."""
    promises, lost = PROMISES.gather()
    assert lost == []
    assert PROMISES.PAGE.read_text(encoding="utf-8") == PROMISES.write_page(promises)


def test_no_marker_is_overlooked() -> None:
    """Each one in a file is read: those of functions, with two strings."""
    written = "".join(PROMISES.read_tests().values()).count("mark.promise(")
    assert len(PROMISES.read_markers()) == written > 0


@pytest.mark.parametrize(
    "sentence",
    [
        "Both routes agree within 2e-8.",
        "The ledger closes to round-off.",
        "The run agrees with this to 2 %.",
        "The result is the same to the last bit.",
        "The tractions converge with order 0.6 to 1.7.",
        "The reaction is right to $10^{-9}$.",
        "All five digits of REF are reproduced.",
    ],
)
def test_promises_are_found(sentence: str) -> None:
    assert PROMISES.is_promise(sentence)


@pytest.mark.parametrize(
    "sentence",
    [
        "The upper 42 % of the stem are open.",
        "It takes 0.2 s and 315 MB.",
        "The body has 5 % of damping at 4 Hz.",
        "A motion that misses it by more than 10 % is refused.",
        "Give the steps in the order in which they are taken.",
        "Set the time step with `--set run.dt=1e-3`.",
    ],
)
def test_other_numbers_are_none(sentence: str) -> None:
    assert not PROMISES.is_promise(sentence)


def test_sentences_are_cut_where_readers_cut_them() -> None:
    text = (
        "# A\n\nOne to\n1e-9. Two.\n\n    code = 1\n\n- three\n  of four\n\n| a | b |\n|---|---|\n"
    )
    assert list(PROMISES.read_sentences(text)) == [
        "One to 1e-9.",
        "Two.",
        "three of four",
        "| a | b |",
        "|---|---|",
    ]
