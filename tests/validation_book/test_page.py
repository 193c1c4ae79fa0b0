"""The page of the validation book is what the stored results give, and these are of its entries."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

from vi_contact.validation import entry_names, read_entry
from vi_contact.validation.results import read_results

pytestmark = pytest.mark.serial
ROOT = Path(__file__).resolve().parents[2]


def test_the_page_is_that_of_the_stored_results() -> None:
    """After a change of an entry: python3 docs/make_validation.py."""
    command = [sys.executable, str(ROOT / "docs" / "make_validation.py"), "--check"]
    done = subprocess.run(command, capture_output=True, encoding="utf-8", timeout=600)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize("setting", ["smallest", "coarse", "fine"])
@pytest.mark.parametrize("name", entry_names())
def test_stored_results_are_within_today_s_limits(name: str, setting: str) -> None:
    """Of every figure, with the wanted values and limits that the entry has now."""
    entry = read_entry(name)
    stored = {row["figure"]: row for row in read_results(setting) if row["entry"] == name}
    assert stored, "python3 docs/make_validation.py --run"
    for one in entry.list_wanted(setting):
        row = stored[one.name]
        assert (row["wanted"], row["limit"]) == pytest.approx((one.value, one.limit), rel=1e-12)
        assert row["reason"] == one.reason
        assert one.series or (row["verdict"] == "known difference") == one.known
        assert one.series or abs(row["found"] - one.value) <= one.limit
    for statistic in entry.statistics:
        assert abs(stored[statistic.name]["found"] - statistic.value) <= statistic.limit
