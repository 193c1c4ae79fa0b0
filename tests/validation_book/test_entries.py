"""Every entry of the validation book is within its limits at its smallest setting, and each of its
mutants is noticed."""

from __future__ import annotations

import os
from dataclasses import replace

import pytest
from book_entries import shared_records

from vi_contact.validation import entry_names, read_entry, run_entry
from vi_contact.validation.entry import RECORDS, Missing
from vi_contact.validation.results import find_moved, read_results
from vi_contact.validation.runner import judge_mutant

pytestmark = [pytest.mark.serial, pytest.mark.slow]
NAMES = entry_names()
MUTANTS = [(name, mutant.name) for name in NAMES for mutant in read_entry(name).mutants]


@pytest.fixture(autouse=True)
def _records(monkeypatch: pytest.MonkeyPatch) -> None:
    beside = shared_records()
    if RECORDS not in os.environ and beside.is_dir():
        monkeypatch.setenv(RECORDS, str(beside))


def need_records(name: str) -> None:
    """Skip where the records of an entry are not there; the sentence says how to get them."""
    try:
        read_entry(name).gather_inputs("smallest")
    except Missing as error:
        pytest.skip(str(error))


@pytest.mark.parametrize("name", NAMES)
def test_an_entry_is_within_its_limits(name: str) -> None:
    need_records(name)
    outcome = run_entry(name, setting="smallest")
    assert outcome.status == "pass", outcome.why
    assert outcome.found is not None and not outcome.found.certificate > 1e-9
    assert not outcome.found.defect > 1e-8
    assert find_moved(outcome, read_results("smallest")) == []
    # a value of the source that is changed by two limits fails; in a series the checksum tells
    for one in outcome.judgements:
        for sign in (-2.0, 2.0):
            changed = replace(one, wanted=one.wanted + sign * one.limit)
            assert one.counted or not changed.within, one


@pytest.mark.parametrize(("name", "mutant"), MUTANTS)
def test_a_mutant_is_noticed(name: str, mutant: str) -> None:
    need_records(name)
    (change,) = (one for one in read_entry(name).mutants if one.name == mutant)
    noticed, outcome = judge_mutant(name, change)
    assert noticed and outcome.status == "fail", outcome.failed or outcome.why
