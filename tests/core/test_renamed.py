"""Names that have changed: an old program runs and is told the new name, and a case file is told
the new word."""

from __future__ import annotations

from importlib import import_module

import pytest

import vi_contact
from vi_contact.core import renamed
from vi_contact.practice.studies.cases.parsing import suggest_nearest

pytestmark = pytest.mark.serial


def test_an_old_name_gives_the_new_thing_and_a_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(renamed.NAMES, "vi_contact", {"Bounce": "vi_contact.laws.Elastic"})
    with pytest.warns(
        DeprecationWarning,
        match="'vi_contact.Bounce' is now vi_contact.laws.Elastic: use that name",
    ):
        law = vi_contact.Bounce
    assert law is vi_contact.Elastic


@pytest.mark.parametrize(
    ("room", "name"), [(room, name) for room, names in renamed.NAMES.items() for name in names]
)
def test_every_old_name_leads_to_a_new_one(room: str, name: str) -> None:
    pytest.importorskip("dolfinx")
    module, _, now = renamed.NAMES[room][name].rpartition(".")
    with pytest.warns(DeprecationWarning, match=f"'{room}.{name}' is now {module}.{now}: "):
        old = getattr(import_module(room), name)
    assert old is getattr(import_module(module), now)


def test_a_name_that_never_was_is_no_name(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(renamed.NAMES, "vi_contact", {"Bounce": "vi_contact.laws.Elastic"})
    with pytest.raises(AttributeError, match="module 'vi_contact' has no attribute 'Nonsense'$"):
        _ = vi_contact.Nonsense


def test_an_old_word_of_a_case_file_names_the_new_one(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(renamed.WORDS, "bouncing", "Elastic")
    assert suggest_nearest("bouncing", ["Elastic", "Inelastic"]) == "it is now Elastic"
    assert suggest_nearest("bouncing", ["Inelastic"]).endswith("Known: Inelastic")
