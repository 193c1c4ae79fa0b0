"""Entries of the validation book that are wrong fail, with their name, and say what is wrong."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from book_entries import HEADER, ROWS, RUN, TOML, checksum, small_entry

from vi_contact.core.errors import InputError
from vi_contact.practice.cli.entry import main
from vi_contact.validation import read_entry, run_entry
from vi_contact.validation.data import read_data
from vi_contact.validation.entry import RECORDS
from vi_contact.validation.report import describe, figure_rows, write_report
from vi_contact.validation.results import find_moved, rows_of
from vi_contact.validation.runner import count_within, judge_mutant
from vi_contact.validation.statistics import agreement

pytestmark = pytest.mark.serial


def refuses(folder: Path, sentence: str) -> str:
    """The entry fails, by a sentence that begins with its name; the sentence."""
    outcome = run_entry(folder)
    assert outcome.status == "fail" and outcome.why[0].startswith("line: ")
    assert sentence in outcome.why[0]
    return outcome.why[0]


def test_an_entry_passes(tmp_path: Path) -> None:
    outcome = run_entry(small_entry(tmp_path / "line"))
    assert outcome.status == "pass" and outcome.why == []
    assert [one.name for one in outcome.judgements] == ["y at 1 m, here", "y at 2 m, there"]
    assert [one.error for one in outcome.judgements] == [0.0, 0.0]


def test_a_known_difference_is_no_agreement_and_fails_when_it_grows(tmp_path: Path) -> None:
    toml = TOML.replace('reason = "Rounding."', 'reason = "Rounding."\nknown = true')
    outcome = run_entry(small_entry(tmp_path / "line", toml=toml))
    assert outcome.status == "pass"
    assert {row["verdict"] for row in rows_of(outcome)} == {"known difference"}
    assert {row[-1] for row in figure_rows(outcome)} == {"known difference"}
    assert "known difference  y at 1 m" in describe(outcome)
    grown = run_entry(small_entry(tmp_path / "grown", toml=toml, rows=ROWS.replace("20", "21.01")))
    assert grown.status == "fail" and grown.failed == ["y at 2 m, there"]
    assert [row["verdict"] for row in rows_of(grown)] == ["known difference", "fail"]


def test_a_run_sees_no_value_that_it_is_compared_with(tmp_path: Path) -> None:
    given = read_entry(small_entry(tmp_path / "line")).gather_inputs("coarse")
    assert given.rows[0] == {"x": 1.0, "place": "here"}


@pytest.mark.parametrize(
    ("rows", "sentence"),
    [
        (ROWS.replace("10", ""), "row 1 has no value of y"),
        (ROWS.replace("10", "nan"), "row 1 has y = 'nan'"),
        (ROWS.replace("10", "inf"), "row 1 has y = 'inf'"),
        (ROWS.replace("10", "ten"), "row 1 has y = 'ten'"),
        (ROWS.replace(",10", ""), "row 1 has 2 values for 3 columns"),
        ("", "has no values"),
    ],
)
def test_data_that_are_no_numbers_fail(tmp_path: Path, rows: str, sentence: str) -> None:
    why = refuses(small_entry(tmp_path / "line", rows=rows), sentence)
    assert "data.csv" in why


def test_data_without_a_source_or_a_unit_fail(tmp_path: Path) -> None:
    for number, line in enumerate(HEADER.splitlines()[:-1]):
        lacking = HEADER.replace(f"{line}\n", "")
        outcome = run_entry(small_entry(tmp_path / f"line{number}", header=lacking))
        assert outcome.status == "fail", line
        assert line.split(":")[0].removeprefix("# unit of ").lstrip("# ") in outcome.why[0]


def test_missing_data_fail(tmp_path: Path) -> None:
    folder = small_entry(tmp_path / "line")
    (folder / "data.csv").unlink()
    outcome = run_entry(folder)
    assert outcome.status == "fail" and "data.csv' is missing" in outcome.why[0]


def test_any_change_of_the_data_is_noticed_by_the_checksum(tmp_path: Path) -> None:
    outcome = run_entry(
        small_entry(tmp_path / "line", rows=ROWS.replace("20", "20.001"), sealed=HEADER + ROWS)
    )
    assert outcome.status == "fail" and "line: data.csv was changed" in outcome.why[0]


def test_a_value_changed_by_two_limits_is_noticed_without_the_checksum(tmp_path: Path) -> None:
    for number, value in enumerate(("21.01", "18.99")):
        outcome = run_entry(small_entry(tmp_path / f"l{number}", rows=ROWS.replace("20", value)))
        assert outcome.status == "fail" and outcome.failed == ["y at 2 m, there"]


def test_line_ends_of_another_system_are_no_change(tmp_path: Path) -> None:
    text = HEADER + ROWS
    path = tmp_path / "data.csv"
    path.write_bytes(text.replace("\n", "\r\n").encode())
    assert read_data(path).checksum == checksum(text)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        ('unit = "Pa"\ncolumn', 'unit = "kPa"\ncolumn', "has the unit 'kPa', and column 'y'"),
        ('unit = "Pa/m"', 'unit = "kPa/m"', "'factor' is given in 'kPa/m', and run.py takes"),
        ('kind = "CHOSEN"', 'kind = "guessed"', "input 'factor' has kind 'guessed'"),
        ('kind = "T"', 'kind = "X"', "kind is 'X'"),
        ("value = 10.0", "value = nan", "input 'factor': value is nan"),
        ("limit = 0.5", "limit = 0.0", "limit is 0.0"),
        ("limit = 0.5", "limit = nan", "limit is nan"),
        ('reason = "Rounding."', 'reason = ""', "has no reason"),
        ('column = "y"', 'column = "z"', "data.csv has no column 'z'"),
        ('red = ["y at *"]', 'red = ["z at *"]', "turns 'z at *' red, which is no figure"),
        ("change = {{ factor", "change = {{ fator", "changes 'fator', which is no input"),
        ('title = "A line"', 'titel = "A line"', "'titel', which nothing reads"),
        ('is_not = ["It is no measurement."]', "", "has no is_not"),
        ('reason = "Rounding."', 'reason = "R."\nlimits = 1', "has 'limits', which nothing reads"),
        ('reason = "Rounding."', 'reason = "R."\nknown = 1', "known is 1: give true or false"),
    ],
)
def test_an_entry_that_does_not_fit_fails(
    tmp_path: Path, old: str, new: str, sentence: str
) -> None:
    assert old in TOML
    refuses(small_entry(tmp_path / "line", toml=TOML.replace(old, new)), sentence)


@pytest.mark.parametrize(
    ("old", "new", "sentence"),
    [
        (
            'inputs["factor"] * row',
            "float('nan') * row",
            "'y at 1 m, here' was not found or is nan",
        ),
        ("< 3.0", "< 2.0", "'y at 2 m, there' was not found"),
        ("< 3.0", "< 4.0", "run.py found 'y at 3 m, here', which entry.toml does not judge"),
        ("    return found", "    return found.figures", "figures returned"),
        ("    found = Found()", "    found = Found() / 0", "its run ended in TypeError"),
        ('"x": "m"', '"x": "m", "z": "m"', "input 'z' is missing"),
        ('"factor": "Pa/m", ', "", "does not take the input 'factor'"),
        ("UNITS", "UNIT", "run.py needs figures(inputs, fineness) and UNITS"),
    ],
)
def test_a_run_that_finds_something_else_fails(
    tmp_path: Path, old: str, new: str, sentence: str
) -> None:
    assert old in RUN
    refuses(small_entry(tmp_path / "line", run=RUN.replace(old, new)), sentence)


def test_an_entry_without_inputs_fails(tmp_path: Path) -> None:
    toml = TOML[: TOML.index("[inputs.factor]")] + TOML[TOML.index("[[figure]]") :]
    refuses(small_entry(tmp_path / "line", toml=toml), "changes 'factor', which is no input")


def test_a_known_difference_that_has_grown_counts_as_a_fail() -> None:
    verdicts = ["pass", "known difference", "fail", "told", "within", "outside"]
    assert count_within(verdicts) == (1, 2)


def test_a_step_failure_fails_with_the_name(tmp_path: Path) -> None:
    raises = "    raise vi_contact.StepFailure('no answer at t = 1 s')"
    run = "import vi_contact\n" + RUN.replace("    return found", raises)
    folder = small_entry(tmp_path / "line", run=run)
    outcome = run_entry(folder)
    assert outcome.status == "fail"
    assert outcome.why == ["line: its run ended in StepFailure: no answer at t = 1 s"]
    (mutant,) = read_entry(folder).mutants
    assert not judge_mutant(folder, mutant)[0]  # its figures did not fail: there were none


def test_records_that_are_not_there_are_a_skip_and_changed_ones_a_fail(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    records = '[records]\n"a.csv" = "' + checksum("t,a") + '"\n\n[inputs.factor]'
    folder = small_entry(tmp_path / "line", toml=TOML.replace("[inputs.factor]", records))
    monkeypatch.delenv(RECORDS, raising=False)
    outcome = run_entry(folder)
    assert outcome.status == "skip" and RECORDS in outcome.why[0]
    monkeypatch.setenv(RECORDS, str(tmp_path))
    outcome = run_entry(folder)
    assert outcome.status == "skip" and "has no 'a.csv'" in outcome.why[0]
    (tmp_path / "a.csv").write_text("t,a")
    assert run_entry(folder).status == "pass"
    (tmp_path / "a.csv").write_text("t,b")
    outcome = run_entry(folder)
    assert outcome.status == "fail" and "a.csv' was changed" in outcome.why[0]


def test_a_mutant_must_turn_its_figures_red(tmp_path: Path) -> None:
    folder = small_entry(tmp_path / "line")
    (mutant,) = read_entry(folder).mutants
    assert judge_mutant(folder, mutant)[0]
    same = TOML.replace("change = {{ factor = 20.0 }}", "change = {{ factor = 10.0 }}")
    folder = small_entry(tmp_path / "same", toml=same)
    (mutant,) = read_entry(folder).mutants
    assert not judge_mutant(folder, mutant)[0]


def test_statistics_are_those_of_a_line() -> None:
    wanted = np.array([1.0, 2.0, 3.0, 4.0])
    found = 2.0 * wanted + 1.0
    one = agreement(list("abcd"), found, wanted, np.array([2.5, 2.5, 2.5, 2.5]))
    assert (one.slope, one.intercept, one.r2) == pytest.approx((2.0, 1.0, 1.0), rel=1e-14)
    assert (one.share, one.largest, one.where, one.count) == (0.25, 5.0, "d", 4)
    assert one.median == pytest.approx(0.5 * (1.5 + 4.0 / 3.0))
    found[1] = np.nan
    lost = agreement(list("abcd"), found, wanted, np.full(4, 100.0))
    assert lost.share == 0.75 and lost.where == "b" and np.isnan([lost.slope, lost.r2]).all()


def test_figures_that_have_moved_are_told(tmp_path: Path) -> None:
    outcome = run_entry(small_entry(tmp_path / "line"))
    stored = rows_of(outcome)
    assert find_moved(outcome, stored) == []
    stored[0]["found"] = 10.16  # less than a third of the limit
    assert find_moved(outcome, stored) == []
    stored[0]["found"] = 10.17
    assert find_moved(outcome, stored) == ["line: 'y at 1 m, here' has moved from 10.17 to 10"]


def test_the_command_prints_and_ends_with_its_status(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    good = small_entry(tmp_path / "line")
    bad = small_entry(tmp_path / "bad", rows=ROWS.replace("20", "21.01"))
    assert main(["validate", str(good), "--mutants"]) == 0
    text = capsys.readouterr().out
    assert "line: pass" in text and "mutant noticed: twice" in text and "limit: Rounding." in text
    assert main(["validate", str(good), str(bad)]) == 1
    said = capsys.readouterr()
    assert "bad: fail" in said.out and "1 of 2 entries have failed" in said.err
    assert "bad: 'y at 2 m, there' is 20 Pa, wanted 21.01 Pa" in said.err
    assert main(["validate", str(good), "--json"]) == 0
    (one,) = json.loads(capsys.readouterr().out)
    assert one["status"] == "pass" and one["certificate"] is None
    assert [figure["verdict"] for figure in one["figures"]] == ["pass", "pass"]
    assert main(["validate", "no_such_entry"]) == 1
    assert "no entry of the validation book is called" in capsys.readouterr().err
    assert main(["validate", "--list"]) == 0
    assert "NAFEMS" in capsys.readouterr().out


def test_the_report_has_a_table_and_a_page(tmp_path: Path) -> None:
    good = run_entry(small_entry(tmp_path / "line"))
    bad = run_entry(small_entry(tmp_path / "bad", rows=""))
    paths = write_report(tmp_path / "out", [good, bad])
    assert [path.name for path in paths] == ["report.csv", "report.pdf"]
    lines = paths[0].read_text(encoding="utf-8").splitlines()
    assert len(lines) == 4 and lines[0].startswith("entry,setting,figure,unit,found,wanted")
    assert lines[3].startswith("bad,coarse,") and ",fail," in lines[3]
    assert paths[1].read_bytes().startswith(b"%PDF")


def test_an_unknown_setting_is_refused() -> None:
    with pytest.raises(InputError, match="setting"):
        run_entry("wedge", setting="finest")
