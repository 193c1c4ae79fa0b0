"""What guides tell beside their blocks: tables alone stand in case files, mistakes are told as the
pages say, and the table of schemes is that of the program."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import pytest
from site_pages import DOCS, ROOT, blocks, loaded

from vi_contact.core.errors import InputError
from vi_contact.practice.cli.entry import main
from vi_contact.practice.studies import read_case
from vi_contact.practice.studies.cases.own_classes import GROUP

pytestmark = pytest.mark.serial


def test_tables_of_the_guides_stand_in_case_files(tmp_path: Path) -> None:
    """Tables alone are read as a part of another page's case; a mistake in one of them would be
    told."""
    pytest.importorskip("dolfinx")
    guides = ("stages", "soil", "clusters")
    (house,), (damped,), (fields,) = (blocks(f"docs/guide/{name}.md", "toml") for name in guides)
    (system, laws), case = damped.split("\n\n"), house[: house.index("[[stage]]")]
    named = laws.replace('"clay"', '"lower"').replace('"wall"', '"upper"')
    with_laws = (
        re.sub(r"^\[system\].*\n", f'{system}\nfixed = "lower_bottom"\n', case, flags=re.MULTILINE)
        + named
    )
    assert "DampingRatio" in with_laws and named != laws
    for text, word in ((with_laws, "plasticity"), (case + fields, "frames_per_file")):
        (tmp_path / "case.toml").write_text(text, encoding="utf-8")
        read_case(tmp_path / "case.toml").check()
        (tmp_path / "case.toml").write_text(text.replace(word, word + "s"), encoding="utf-8")
        with pytest.raises(InputError, match=f"unknown key '{word}s'"):
            read_case(tmp_path / "case.toml").check()


def test_the_entry_point_is_in_the_group_that_is_read() -> None:
    (text,) = (
        one for one in blocks("docs/guide/extend.md", "toml") if one.startswith("# pyproject.toml")
    )
    assert list(tomllib.loads(text)["project"]["entry-points"]) == [GROUP]


def test_mistakes_are_told_as_the_page_says(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    text = (DOCS / "guide" / "studies.md").read_text(encoding="utf-8")
    key, syntax = re.findall(r"^    (vi-contact: .*)$", text, re.MULTILINE)
    case = blocks("docs/guide/studies.md", "toml")[0]
    lines = case.splitlines()
    at, column = map(int, re.findall(r"line (\d+), column (\d+)", syntax)[0])
    lines[at - 1] = "dt = " + " " * (column - 6) + "oops"
    monkeypatch.chdir(tmp_path)
    for wrong, said in ((case.replace("\nmu =", "\nnu ="), key), ("\n".join(lines), syntax)):
        Path("wall.toml").write_text(wrong, encoding="utf-8")
        assert main(["run", "wall.toml", "--check"]) == 1
        assert capsys.readouterr().err == f"{said}\n"


def test_lines_on_initial_strains_are_calls() -> None:
    """Each line of docs/guide/bring_your_own.md makes a load of a body."""
    pytest.importorskip("dolfinx")
    lines = re.findall(
        r"^    (fem\.InitialStrain\(.*)$",
        (DOCS / "guide" / "bring_your_own.md").read_text("utf-8"),
        re.MULTILINE,
    )
    names = dict(vars(loaded(DOCS / "page_wall.py")))
    names |= {
        "temperature": lambda t: 20.0 * t,
        "b": [1e-4, 0.0],
        "n": [0.0, 1.0],
        "h": 3.0,
        "layer": names["tags"]["wall"],
    }
    assert len(lines) == 4
    for line in lines:
        names["load"] = eval(line, names)
        exec(
            "assert abs(fem.assemble(mesh, material, clamped=tags['base'], "
            "loads=load).load(0.5)).max() > 0.0",
            names,
        )


@pytest.mark.parametrize("name", ["`Trapezoidal`", "`HHT`"])
def test_the_schemes_of_the_first_wall(name: str) -> None:
    """Two rows, with the step of the article; benchmarks/wall_schemes.py prints
    all."""
    pytest.importorskip("dolfinx")
    table = loaded(ROOT / "benchmarks" / "wall_schemes.py")
    page = (DOCS / "start" / "first_wall.md").read_text(encoding="utf-8")
    ((fine, share),) = re.findall(
        rf"^\| {re.escape(name)} \|[^|]*\|([^|]*)\|[^|]*\|([^|]*)\|$", page, re.MULTILINE
    )
    assert (
        table.row(name, table.run(table.SCHEMES[name]), (fine.strip(), share.strip()))
        in page.splitlines()
    )
    assert re.findall(r"^\| (`.*?) \| -[\d.]+ to ", page, re.MULTILINE) == list(table.SCHEMES)
