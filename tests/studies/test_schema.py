"""The JSON schema of case files: it takes the cases that run, and refuses what they refuse."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("dolfinx")

from vi_contact.practice.cli.entry import main
from vi_contact.practice.studies.cases.schema import write_schema
from vi_contact.practice.studies.cases.toml_file import read_toml, with_settings

pytestmark = pytest.mark.serial
ROOT = Path(__file__).resolve().parents[2]
STUDIES = ROOT / "vi_contact" / "practice" / "studies"
WALL = ROOT / "demos" / "cases" / "wall.toml"


def test_keys_have_the_limits_units_and_meanings_of_annotations() -> None:
    """They hold for numbers; texts with units stay allowed."""
    rules = json.loads(write_schema())
    body = rules["definitions"]["LinearElastic.LinearElastic"]["properties"]
    assert body["E"] == {
        "type": ["number", "string"],
        "exclusiveMinimum": 0.0,
        "description": "Young's modulus E, in Pa, or with its unit",
    }
    assert body["nu"]["exclusiveMinimum"] == -1.0 and body["nu"]["exclusiveMaximum"] == 0.5
    friction = rules["definitions"]["FrictionLaw.Coulomb"]["properties"]["mu"]
    assert [one["minimum"] for one in (friction["anyOf"][0], friction["anyOf"][1]["items"])] == [
        0
    ] * 2
    mesh = rules["definitions"]["MeshScript.GeoFile"]["properties"]
    assert (mesh["refine"]["minimum"], mesh["refine"]["maximum"]) == (0, 8)
    assert rules["definitions"]["SmallMethod.Lemke"]["properties"]["max_iterations"]["minimum"] == 1
    loads = rules["definitions"]["BodyForce.BodyForce"]["properties"]
    assert loads["value"]["description"] == "in N/m3, or with its unit"
    assert rules["properties"]["run"]["properties"]["t_end"]["description"].startswith("in s,")


def within(value: float, rule: Any) -> bool:
    """Whether a number is within the limits of a rule."""
    low, high = rule.get("minimum", value), rule.get("maximum", value)
    above, below = rule.get("exclusiveMinimum"), rule.get("exclusiveMaximum")
    return (
        low <= value <= high
        and (above is None or above < value)
        and (below is None or value < below)
    )


def valid(value: Any, rule: Any, whole: Any) -> bool:
    """Whether a value keeps to a rule of JSON schema, of the words that ours has."""
    if "$ref" in rule:
        return valid(value, whole["definitions"][rule["$ref"].rpartition("/")[2]], whole)
    kinds = {
        "object": dict,
        "array": list,
        "string": str,
        "boolean": bool,
        "integer": int,
        "number": (int, float),
    }
    wanted = rule.get("type", [])
    if wanted and not any(
        isinstance(value, kinds[one]) and (one == "boolean" or not isinstance(value, bool))
        for one in ([wanted] if isinstance(wanted, str) else wanted)
    ):
        return False
    if (
        "const" in rule
        and value != rule["const"]
        or not all(valid(value, one, whole) for one in rule.get("allOf", []))
    ):
        return False
    if "pattern" in rule and rule["pattern"] not in value:
        return False
    if "anyOf" in rule and not any(valid(value, one, whole) for one in rule["anyOf"]):
        return False
    if isinstance(value, int | float) and not within(value, rule):
        return False
    if isinstance(value, list):
        return all(valid(one, rule.get("items", {}), whole) for one in value)
    if not isinstance(value, dict):
        return True
    known, more = rule.get("properties", {}), rule.get("additionalProperties", {})
    return all(one in value for one in rule.get("required", [])) and all(
        valid(one, known[key], whole)
        if key in known
        else more is not False and valid(one, more, whole)
        for key, one in value.items()
    )


def test_the_schema_takes_the_cases_that_run_and_no_others(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["schema"]) == 0
    rules = json.loads(capsys.readouterr().out)
    folders = (STUDIES / "cases" / "builtin", STUDIES / "starters", ROOT / "demos" / "cases")
    shipped = [path for folder in folders for path in folder.glob("*.toml")]
    assert len(shipped) >= 6
    for path in shipped:
        assert valid(read_toml(path), rules, rules), path
    tables = read_toml(WALL)
    for setting in ("friction.type=Coulomb", "mesh.height=9 m", "scheme.type=package.module:Own"):
        assert valid(
            with_settings(
                tables, [setting, "friction.mu=0.5"] if "friction" in setting else [setting]
            ),
            rules,
            rules,
        ), setting
    for setting in (
        "scheme.phj=1",
        "material.concrete.E=",
        "material.concrete.nu=0.5",
        "material.concrete.rho=-1",
        "system.fixed=3",
        "run.steps=[1]",
        "solver.type=Condenst",
        "contct.facets=face",
        "mesh=",
        "contact.1.obstacle.points=[0.0, 0.0]",
    ):
        assert not valid(with_settings(tables, [setting]), rules, rules), setting
    staged = read_toml(ROOT / "demos" / "cases" / "raft.toml")
    for setting in (
        "stage.1.type=statc",
        "stage.1.sistem.clamped=base",
        "stage.2.release=1",
        "stage.2.name=",
    ):
        assert not valid(with_settings(staged, [setting]), rules, rules), setting
    try:
        import jsonschema
    except ImportError:
        return
    jsonschema.Draft7Validator.check_schema(rules)
    for path in shipped:
        jsonschema.validate(read_toml(path), rules)
