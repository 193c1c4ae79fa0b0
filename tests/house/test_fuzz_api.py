"""Whatever an argument is given instead of what it should be: one sentence, before any work is
done."""

from __future__ import annotations

import re
from collections.abc import Callable

import pytest

from vi_contact.core.errors import InputError

pytestmark = pytest.mark.serial
LONGEST = 400  # characters of a sentence


def told(name: str, call: Callable[[], object]) -> str:
    """What is wrong with the answer to a misuse; empty when it is an InputError of one line that
    names a thing: one of the words in the name of the misuse."""
    try:
        call()
    except InputError as error:
        text = str(error)
        words = [
            word
            for word in re.findall(r"[A-Z]?[a-z0-9]+|[A-Z]+", name)
            if word.lower() not in ("a", "of", "the")
        ]
        named = any(
            re.search(rf"(?i)(\b|_){word}(\b|_|s\b)", text) or len(word) > 3 and word in text
            for word in words
        )
        short = len(text) < LONGEST and "\n" not in text and len(text.split()) > 3
        return (
            ""
            if short and named
            else f"not one short sentence that names the thing: {text[:LONGEST]!r}"
        )
    except Exception as error:  # what the interface must never raise here
        return f"{type(error).__name__}: {str(error)[:200]}"
    return "accepted"


def tables() -> dict[str, Callable[[], object]]:
    """The misuses of the core, and of boundary elements, beam and layer."""
    from misuses_core import MISUSES as core
    from misuses_wings import MISUSES as wings

    assert not set(core) & set(wings)
    return core | wings


def test_every_misuse_is_an_input_error_of_one_sentence() -> None:
    misuses = tables()
    defects = {name: text for name, call in misuses.items() if (text := told(name, call))}
    assert not defects, "\n".join(f"{name} -> {text}" for name, text in defects.items())
    assert len(misuses) >= 3000


def test_what_they_were_made_of_is_right() -> None:
    """A misuse is refused for its one wrong argument: with the right one the same call goes
    through."""
    from misuses_core import RIGHT as core
    from misuses_wings import RIGHT as wings

    for name, call in [*core, *wings]:
        assert call() is not None, name
