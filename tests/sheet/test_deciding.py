"""The numbers that decide: peaks, their times and durations in hand-made histories, and which
columns the rules take."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from vi_contact.core.errors import InputError
from vi_contact.practice.plots.charts import list_varying
from vi_contact.practice.sheet.deciding import choose_numbers, measure_peak
from vi_contact.practice.sheet.rules import RULES, find_columns
from vi_contact.run.files.reading import RunFolder

pytestmark = pytest.mark.serial
NAN = np.nan


@pytest.mark.parametrize(
    ("values", "wanted"),
    [
        # 9, 10 and 9.5 are above 9: three steps from t = 0.1 to 0.4
        ([0.0, 5.0, 9.0, 10.0, 9.5, 8.9, 0.0], (10.0, 0.3, 0.3, 3)),
        # the same downwards; the values of the other sign do not count
        ([0.0, 9.9, -10.0, 9.9, 0.0, 0.0, 0.0], (-10.0, 0.2, 0.1, 1)),
        # another peak nearly as large, not beside it, is none of it
        ([0.0, 9.9, 0.0, 10.0, 0.0, 9.9, 9.9], (10.0, 0.3, 0.1, 1)),
        # the state at the start is of no step
        ([10.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0], (10.0, 0.0, 0.0, 0)),
        ([10.0, 9.5, 0.0, 0.0, 0.0, 0.0, 0.0], (10.0, 0.0, 0.1, 1)),
        # no number is not nearly as large
        ([NAN, NAN, 9.5, 10.0, NAN, 10.0, 0.0], (10.0, 0.3, 0.2, 2)),
        ([0.0, 0.0, 0.0, 0.0, 9.0, 9.5, 10.0], (10.0, 0.6, 0.3, 3)),
    ],
)
def test_a_peak_lasts_while_nine_tenths_of_it_are_there(
    values: list[float], wanted: tuple[float, float, float, int]
) -> None:
    found = measure_peak(0.1 * np.arange(7), np.array(values))
    assert found[:3] == pytest.approx(wanted[:3]) and found[3] == wanted[3]


def test_steps_of_other_lengths_and_nothing_at_all() -> None:
    """A step counts with its own length; zeros and no numbers have no duration."""
    t = np.array([0.0, 0.1, 0.2, 0.25, 0.3, 0.4])
    found = measure_peak(t, np.array([0.0, 0.0, 0.0, 2.0, 1.9, 0.0]))
    assert found[:3] == pytest.approx((2.0, 0.25, 0.1)) and found[3] == 2
    assert np.isnan(measure_peak(t, np.full(6, NAN))[0])
    value, _, seconds, steps = measure_peak(t, np.zeros(6))
    assert value == 0.0 and np.isnan(seconds) and steps == 0


def made_run(names: dict[str, list[float]], unit: str = "N") -> RunFolder:
    """A run of three rows, 0.1 s apart."""
    history = {name: np.array(values) for name, values in names.items()}
    columns = {
        name: (unit, f"value of {name}, upwards, {kind} x")
        for name in names
        for kind in ["part" if name[0] == "N" else "nothing"]
    }
    return RunFolder(Path(), history | {"t": 0.1 * np.arange(3)}, columns, {}, None)


WALL = {
    "reaction_x_rock": [0.0, -3.0, 2.0],
    "reaction_y_rock": [9.0, 9.0, 9.0],
    "N_base": [8.0, 8.0, 8.0],  # carries most: the base
    "uplift_base": [0.0, 0.2, 0.1],
    "level_base": [NAN, NAN, NAN],
    "opening_base": [0.0, 1.0, 0.0],
    "sliding_base": [0.5, 3.0, 2.0],
    "pressure_low_base": [1.0, 5.0, 1.0],
    "pressure_high_base": [1.0, 4.0, 6.0],
    "margin_base": [NAN, 0.5, 0.2],
    "M_base": [0.0, 50.0, 0.0],
    "N_stem": [1.0, 2.0, 7.0],  # stands upright
    "uplift_stem": [0.0, 0.9, 0.0],
    "level_stem": [0.3, 0.3, 0.4],
    "opening_stem": [0.0, 7.0, 0.0],
    "sliding_stem": [0.0, 0.0, 9.0],
    "margin_stem": [0.0, 0.0, 0.0],
    "contact_resultant": [9.0, 10.0, 15.0],
    "contact_max_pressure": [9.0, 9.0, 9.0],
    "contact_uplift": [0.1, 0.1, 0.1],
    "u_x_top": [0.0, -4.0, 3.0],
    "u_x_toe": [0.0, 1.0, 1.0],
}


def test_the_rules_take_the_base_and_the_upright_part() -> None:
    """By hand: base shear -3; thrust of the stem 7; sliding 2 - 0.5; opening and share of the base;
    the larger toe pressure; 1 / (1 - 0.2); the larger displacement. What stands for others is left
    out."""
    found = choose_numbers(made_run(WALL), None)
    assert [(number.column, number.value) for number in found] == [
        ("reaction_x_rock", -3.0),
        ("N_stem", 7.0),
        ("sliding_base", 1.5),
        ("opening_base", 1.0),
        ("uplift_base", 0.2),
        ("pressure_high_base", 6.0),
        ("margin_base", 1.25),
        ("u_x_top", -4.0),
    ]
    assert all(number.rule for number in found)
    # friction used 0.8 of its limit in one step
    assert found[6].is_brief and found[6].t == pytest.approx(0.2)


def test_sections_and_plain_columns_and_space() -> None:
    """A section comes before a thrust, and the moment of a part is none; without parts the columns
    of the whole contact stand; in space y is level too."""
    section = {"V_foot": [0.0, 0.0, 0.0], "N_foot": [9.0, 9.0, 9.0], "M_foot": [0.0, 5.0, 1.0]}
    found = choose_numbers(made_run(WALL | section), None)
    assert [number.column for number in found][:3] == ["reaction_x_rock", "M_foot", "sliding_base"]
    whole = {name: WALL[name] for name in WALL if name.startswith("contact_")}
    assert [number.column for number in choose_numbers(made_run(whole), None)] == [
        "contact_resultant",
        "contact_uplift",
        "contact_max_pressure",
    ]
    in_space = made_run({f"reaction_{axis}_foot": [0.0, k, 0.0] for k, axis in enumerate("xyz", 1)})
    assert choose_numbers(in_space, None)[0].column == "reaction_y_foot"


def test_forces_of_water_are_no_open_shares() -> None:
    """Columns of Uplift begin as the open share of a part does: they decide nothing, and the report
    charts and tells them by their own names."""
    water = {"uplift_force": [5e6, 6e6, 5e6], "uplift_effective": [8e6, 7e6, 8e6]}
    whole = {name: WALL[name] for name in WALL if name.startswith("contact_")}
    for columns in (WALL, whole):
        plain, wet = (
            [(number.column, number.value) for number in choose_numbers(made_run(given), None)]
            for given in (columns, columns | water)
        )
        assert wet == plain
    run = made_run(WALL | water)
    assert set(list_varying(run, "uplift_")) == {"uplift_base", "uplift_stem"}
    assert list_varying(run, "uplift_force") == ["uplift_force"]


def test_a_level_base_has_a_shear_and_no_thrust() -> None:
    """A dam on its joint: without a support that is recorded, T of the joint is the base shear. A
    thrust that the case asks for is refused with a column."""
    joint = {
        "N_joint": [1.0, 1.0, 1.0],
        "T_joint": [0.0, -4.0, 0.0],
        "uplift_joint": [0.0, 0.0, 0.0],
        "level_joint": [NAN, NAN, NAN],
    }
    found = choose_numbers(made_run(joint), None)
    assert [number.column for number in found] == ["T_joint", "uplift_joint"]
    assert found[0].name == "base shear" and found[0].value == -4.0
    with pytest.raises(InputError, match="no part of the contact is one for 'thrust': .* N_joint"):
        choose_numbers(made_run(joint), ["thrust"])
    upright = joint | {"level_joint": [NAN, 0.5, 0.5]}
    columns = [number.column for number in choose_numbers(made_run(upright), None)]
    assert columns == ["N_joint", "uplift_joint"]


def test_named_numbers() -> None:
    """Columns as the case names them, rules by their words; sliding stays, a margin is a factor."""
    names = ["N_stem", "sliding_stem", "margin_stem", "sliding"]
    found = choose_numbers(made_run(WALL), names)
    assert [number.value for number in found] == [7.0, 9.0, 1.0, 1.5]
    assert [number.short_name for number in found] == [*names[:3], "sliding that stays"]
    assert found[0].name == "thrust, part stem" and not found[0].rule
    assert choose_numbers(made_run(WALL), ["N_base"])[0].name == "normal force, part base"
    assert choose_numbers(made_run(WALL), ["u_x_top"])[0].name == "value of u_x_top"


def test_every_rule_finds_a_column() -> None:
    """No word of a rule is in vain; words differ; the page has them all."""
    page = (Path(__file__).parents[2] / "docs" / "guide" / "report.md").read_text(encoding="utf-8")
    told = re.findall(r"^\| `(\w+)` \|", page, re.MULTILINE)
    assert told == [rule.word for rule in RULES]
    more = ("V_a", "M_a", "T_base", "racking_a", "contact_max_slip")
    names = WALL | dict.fromkeys(more, [0.0, 1.0, 0.0])
    run = made_run(names)
    assert len({rule.word for rule in RULES}) == len(RULES)
    for rule in RULES:
        assert find_columns(rule, run.history), rule.word
        assert set(rule.without) <= {other.word for other in RULES}
