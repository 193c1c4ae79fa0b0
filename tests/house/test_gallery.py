"""The gallery: every demo has a picture, a sentence, a command, and a page that tells what it
prints."""

from __future__ import annotations

import importlib.util
import re
import tomllib
from pathlib import Path
from typing import Any

import pytest

from vi_contact.studies.cases.library import starters

pytestmark = pytest.mark.serial
ROOT = Path(__file__).resolve().parents[2]
GALLERY = ROOT / "docs" / "gallery"


@pytest.fixture(scope="module")
def make() -> Any:
    """The script that runs the demos and takes their pictures."""
    spec = importlib.util.spec_from_file_location("gallery_make", GALLERY / "make.py")
    assert spec and spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_every_demo_and_every_starter_has_an_entry(make: Any) -> None:
    demos = {path.stem for path in (ROOT / "demos").glob("*.py")}
    assert set(make.entries()) == demos | {f"new_{name}" for name in starters()}


def test_the_gallery_is_what_its_list_says(make: Any) -> None:
    """After a change of demos.toml: python3 docs/gallery/make.py --index."""
    assert (GALLERY / "index.md").read_text(encoding="utf-8") == make.index()


def test_every_entry_is_whole(make: Any) -> None:
    """A sentence, stored pictures, commands that its page writes, and pictures on the page that the
    demo writes."""
    for name, entry in make.entries().items():
        text = (GALLERY / entry["page"].partition("#")[0]).read_text(encoding="utf-8")
        assert re.fullmatch(r"[A-Z].*\.", entry["sentence"]) and len(entry["sentence"]) < 130, name
        assert all(command in text for command in entry["commands"]), name
        assert make.said(entry), name
        shown = set(re.findall(r"\]\(\.\./figures/(\w+\.png)\)", text))
        assert entry["pictures"] and shown & set(entry["pictures"]), name
        assert all(
            (ROOT / "docs" / "figures" / picture).is_file() for picture in entry["pictures"]
        ), name
        if "#" not in entry["page"]:
            assert shown <= set(entry["pictures"]), name
            sources = make.imported(ROOT / "demos" / f"{name}.py", set())
            source = "".join(path.read_text(encoding="utf-8") for path in sources)
            names = [
                re.sub(r"\{.*?\}", "{}", one) for one in re.findall(r'"([^"\n]*\.png)"', source)
            ]
            drawn = re.compile("|".join(re.escape(one).replace(r"\{\}", r"\w+") for one in names))
            assert [
                made for made in entry["pictures"].values() if not drawn.fullmatch(Path(made).name)
            ] == [], name


def test_every_figure_has_something_that_makes_it(make: Any) -> None:
    """The gallery, a page, the theory pages or a notebook; or the table says why it is stored.
    Pages show it.

    After a new picture: enter it in docs/gallery/made_by.toml, or in docs/gallery/demos.toml.
    """
    stored = tomllib.loads((GALLERY / "made_by.toml").read_text(encoding="utf-8"))["stored"]
    made = [
        picture
        for entry in (make.entries() | make.page_entries()).values()
        for picture in entry["pictures"]
    ]
    theory = [f"theory_{path.stem}.png" for path in (ROOT / "docs" / "theory").glob("*.md")]
    notebooks = [f"notebook_{path.stem}.png" for path in (ROOT / "docs" / "notebooks").glob("*.md")]
    figures = {path.name for path in (ROOT / "docs" / "figures").glob("*.png")}
    assert len(made) + len(stored) == len({*made, *stored})
    assert {*made, *stored} <= figures <= {*made, *stored, *theory, *notebooks}
    for entry in make.page_entries().values():
        text = (ROOT / entry["page"]).read_text(encoding="utf-8")
        assert (
            all(f"../figures/{picture})" in text for picture in entry["pictures"])
            and make.files(entry) is not None
        )
    for picture, told in stored.items():
        assert f"../figures/{picture})" in (ROOT / told["page"]).read_text(encoding="utf-8"), (
            picture
        )
        assert told["command"] and told["why"], picture
        scripts = [word for word in told["command"].split() if word.endswith(".py")]
        assert all((ROOT / script).is_file() for script in scripts), picture


def test_lines_agree_but_for_rounding(make: Any) -> None:
    """Words count, numbers to two per mille; of residuals the order does, but none above the bound
    is one below."""
    assert make.agree("force 1.0005 N,  worst 2.6e-14", "force 1.0001 N, worst 1.2e-15")
    assert make.agree("worst certificate 8.75e-13", "worst certificate 4e-12") and make.agree(
        "gap 0", "gap -3e-17"
    )
    assert make.agree("difference 1.7e-08", "difference 5.2e-08")
    assert not make.agree("worst certificate 8.75e-13", "worst certificate 9e-8")
    assert not make.agree("worst certificate 8.75e-13", "worst certificate 1.1e-9")
    assert not make.agree("difference 1.7e-08", "difference 9.9e-07")
    assert not make.agree("force 1.0005 N", "force 1.01 N")
    assert not make.agree("force 1 N", "work 1 N")
    assert not make.agree("force 1 N", "force 1 N, 2 N")


def test_the_cache_sees_changes(make: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """The hash follows the files that a demo imports and its entry, and nothing else."""
    name, entry = "bouncing_bar", make.entries()["bouncing_bar"]
    used = {
        str(path.relative_to(ROOT))
        for path in make.imported(ROOT / "demos" / "bouncing_bar.py", set())
    }
    assert {
        "demos/bouncing_bar.py",
        "demos/pictures/bars.py",
        "demos/exact/bar.py",
        "demos/problems/bar.py",
    } <= used
    assert "demos/crack.py" not in used and "demos/pictures/raft.py" not in used
    before = make.key(name, entry)
    other = {**entry, "commands": ["bash demos/run.sh -n 2 bouncing_bar"]}
    assert before == make.key(name, entry) != make.key(name, other)
    monkeypatch.setattr(make, "imported", lambda path, seen: set())
    assert make.key(name, entry) != before


def test_entries_run_beside_each_other_and_complaints_end_the_build(
    make: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """A run that fails, a line that is not printed and a picture that no page shows: each is told
    and is status 1."""
    usual = {"page": "one.md", "title": "", "sentence": ""}
    draw = '"$vi_python" -c \'from PIL import Image; Image.new("RGB", (9, 9)).save("a.png")\''
    commands = {
        "good": ["echo force 1 N", draw],
        "bad": ["echo no >&2", "false"],
        "hidden": ["echo force 2 N", draw],
    }
    every = {
        name: usual | {"commands": one, "pictures": {f"{name}.png": "a.png"}}
        for name, one in commands.items()
    }
    monkeypatch.setattr(make, "MADE", tmp_path / "made")
    monkeypatch.setattr(make, "HERE", tmp_path)
    monkeypatch.setattr(make, "entries", lambda: every)
    monkeypatch.setattr(make, "page_entries", dict)
    (tmp_path / "one.md").write_text("```text\nforce 1 N\n```\n", encoding="utf-8")
    site = tmp_path / "site"
    site.mkdir()
    (site / "good.png").touch()
    assert (
        make.main(["--only", "good", "--into", str(site)]) == 0
        and (site / "good.png").stat().st_size > 50
    )
    out, err = capsys.readouterr()
    assert "good " in out and err == ""
    assert make.main(["--into", str(site), "--jobs", "2"]) == 1
    out, err = capsys.readouterr()
    assert "made before" in out and len(re.findall("^gallery: ", err, re.MULTILINE)) == 3
    assert "gallery: bad failed:\nno\n" in err
    assert "gallery: one.md has a line that the demo does not print: force 1 N" in err
    assert "gallery: no page of the site shows hidden.png of hidden" in err
