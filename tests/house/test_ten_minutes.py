"""The pages of ten minutes: what they give to be typed runs, and they print what runs print."""

from __future__ import annotations

import csv
import math
import re
from pathlib import Path
from typing import Any

import pytest
from pictures import is_drawn

import vi_contact as vc
from vi_contact.practice.cli import main

pytestmark = pytest.mark.serial
ROOT = Path(__file__).resolve().parents[2]
START = ROOT / "docs" / "start"


def blocks(page: str, language: str) -> list[str]:
    """The fenced blocks of a language."""
    text = (START / page).read_text(encoding="utf-8")
    return re.findall(rf"^```{language}\n(.*?)^```$", text, re.MULTILINE | re.DOTALL)


def same(told: str, printed: str) -> bool:
    """Numbers agree to a hundredth, as another Gmsh may mesh a little differently; round-off is
    round-off in both."""
    try:
        expected, found = (float(word.rstrip(",;")) for word in (told, printed))
    except ValueError:
        return told == printed
    return math.isclose(expected, found, rel_tol=0.01) or max(abs(expected), abs(found)) < 1e-9


def agree(told: str, printed: str) -> None:
    """All lines agree word by word, but those of times that the clock took."""
    lines = [one for one in printed.splitlines() if one.strip()]
    assert len(told.splitlines()) == len(lines)
    for line, other in zip(told.splitlines(), lines, strict=True):
        if "wall time per step" in line:
            assert "wall time per step" in other
            continue
        words, others = line.split(), other.split()
        assert len(words) == len(others) and all(map(same, words, others)), f"{line!r} is {other!r}"


def peaks(folder: Path) -> dict[str, tuple[float, float, float]]:
    """The least, the largest and the last value of each column of a run."""
    with open(folder / "history.csv", encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    names = ("u_x_top", "sliding_base", "theta_base", "N_base", "T_base")
    columns = {name: [float(row[name]) for row in rows] for name in names}
    return {name: (min(values), max(values), values[-1]) for name, values in columns.items()}


def test_your_wall(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """The two files of the page are checked and run by its commands; the higher wall is the same
    files, changed."""
    (geo,), (case,) = (blocks("ten_minutes_wall.md", language) for language in ("c\\+\\+", "toml"))
    check, summary = blocks("ten_minutes_wall.md", "text")
    page = (START / "ten_minutes_wall.md").read_text(encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    Path("wall.geo").write_text(geo, encoding="utf-8")
    Path("wall.toml").write_text(case, encoding="utf-8")
    capfd.readouterr()
    assert main(["run", "wall.toml", "--check"]) == 0
    agree(check, capfd.readouterr().out)
    assert Path("results/wall/model.png").stat().st_size > 5000
    assert main(["run", "wall.toml"]) == 0
    agree(summary, capfd.readouterr().out)

    assert main(["post", "peaks", "results/wall"]) == 0
    (never,) = re.findall(r"`nan` stands where a column never has a value: `(\w+)`", page)
    assert re.findall(r"^(\w+) .* nan +nan ", capfd.readouterr().out, re.MULTILINE) == [never]

    found = peaks(Path("results/wall"))
    rows = re.findall(
        r"^\| `(\w+)` \|.*\| (-?[\d.]+) to (-?[\d.]+) [a-zA-Z/]+ \|$", page, re.MULTILINE
    )
    assert [name for name, _, _ in rows] == ["u_x_top", "theta_base", "N_base", "T_base"]
    for name, low, high in rows:
        scale = 1e-3 if name[0] in "NT" else 1e3
        assert [scale * value for value in found[name][:2]] == pytest.approx(
            [float(low), float(high)], rel=0.02
        )

    Path("wall.geo").write_text(geo.replace("H = 4.0;", "H = 5.0;"), encoding="utf-8")
    changed = case.replace("points = {top = [0.0, 4.0]}", "points = {top = [0.0, 5.0]}")
    assert changed != case and "`points = {top = [0.0, 5.0]}`" in page and "`H = 5.0;`" in page
    Path("wall.toml").write_text(changed, encoding="utf-8")
    assert main(["run", "wall.toml", "--out", "results/higher"]) == 0
    for name in ("wall", "higher"):
        found = peaks(Path("results") / name)
        # as the page says of the peaks
        assert 0.0 < found["sliding_base"][1] - found["sliding_base"][2] <= 1.1e-4
        now = (
            1e3 * found["sliding_base"][2],
            1e3 * found["theta_base"][1],
            1e-3 * found["N_base"][1],
        )
        (told,) = re.findall(rf"^\| `{name}` \| (\S+) \| (\S+) \| (\S+) \|$", page, re.MULTILINE)
        assert now == pytest.approx([float(one) for one in told], rel=0.02)


@pytest.mark.promise("start/ten_minutes_form.md", "They agree to 0.06 %.")
@pytest.mark.promise("start/ten_minutes_form.md", "The first is round-off.")
@pytest.mark.promise(
    "start/ten_minutes_form.md", "Here the displacements of both agree", bound="1e-11"
)
def test_your_form(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The program prints what its page says on all versions of DOLFINx, draws its picture and is
    that short."""
    (code,), (printed,) = (
        blocks("ten_minutes_form.md", "python"),
        blocks("ten_minutes_form.md", "text"),
    )
    assert len(code.splitlines()) <= 60
    monkeypatch.chdir(tmp_path)
    names: dict[str, Any] = {"__name__": "__main__"}
    exec(compile(code, "form.py", "exec"), names)
    assert capsys.readouterr().out == printed
    assert is_drawn(tmp_path / "form.png")
    assert names["here"] == pytest.approx(names["impulse"], rel=6e-4)
    facts = names["solution"].facts
    assert 0.0 < facts["energy_defect"] < 1e-11 and facts["energy_created"] < 1e-12
    both = vc.CrossChecked(vc.Condensed(), [vc.Volume()])
    again = vc.simulate(
        names["problem"], dt=1e-3, steps=60, solver=both, cross_check=both, progress=False
    )
    (compared,) = again.facts["cross_check"].values()
    assert 0.0 < compared["u"] < 1e-11 and 0.0 < compared["r_n"] < 1e-11
