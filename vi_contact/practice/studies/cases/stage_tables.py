"""Read [[stage]] tables.

They say what each stage replaces in the tables of the case, and single keys of [system] and [run].
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

from ....core.checks import flag, quote
from ....core.errors import InputError
from .parsing import nearest

BY_KEY = ("system", "run")
WHOLE = (
    "gravity",
    "contact",
    "friction",
    "impact",
    "mass",
    "excitation",
    "scheme",
    "solver",
    "escalation",
    "record",
    "fields",
)
KEYS = ("name", "type", "release", *BY_KEY, *WHOLE)
# what a static stage has no use for
OF_MOTION = ("excitation", "scheme", "impact", "mass", "escalation")
AT_REST = {"dt": 1.0, "steps": 0}  # [run] of a static stage: a row at t = 0
_NAME = re.compile(r"\w{1,40}", re.ASCII)


@dataclass(frozen=True)
class Stage:
    """Hold what a stage is.

    It has its tables, with those of the case, and the ``Case`` that is made of them.

    label: how sentences name it; release: reactions of supports that it does without go on as
    forces.
    """

    label: str
    name: str
    static: bool
    release: bool
    tables: Mapping[str, Any]
    case: Any = None


def split(path: Path, tables: Mapping[str, Any]) -> list[Stage]:
    """Return the stages of a case, none without [[stage]]; InputError for wrong keys and values."""
    if "stage" not in tables:
        return []
    given = tables["stage"]
    if not isinstance(given, list) or not given or not all(isinstance(one, dict) for one in given):
        raise InputError(
            f"{path}: [stage] is not a list of tables: write [[stage]] above the keys of each stage"
        )
    stages = [
        _stage(f"{path}: [[stage]] {number}", one, tables)
        for number, one in enumerate(given, start=1)
    ]
    if stages[0].release:
        raise InputError(
            f"{stages[0].label} has release = true, and is the first stage: leave it out"
        )
    for before, one in pairwise(stages):
        for key in ("contact", "friction"):
            if not one.static and one.tables.get(key) != before.tables.get(key):
                raise InputError(
                    f"{one.label} has another [{key}] than the stage before it, and would jump at "
                    "t = 0: give both the same, or put a static stage with this one between them"
                )
    return stages


def _stage(where: str, given: Mapping[str, Any], tables: Mapping[str, Any]) -> Stage:
    for key in given:
        if key not in KEYS:
            raise InputError(f"{where} has the unknown key '{key}': {nearest(key, KEYS)}")
    name, kind, release = given.get("name", ""), given.get("type"), given.get("release", False)
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise InputError(f"{where} has name = {quote(name)}: give letters, digits and underscores")
    if kind not in ("static", "dynamic"):
        raise InputError(f'{where} has type = {quote(kind)}: give "static" or "dynamic"')
    flag(where, "release", release)
    whole = {key: value for key, value in tables.items() if key != "stage"}
    for key in (key for key in BY_KEY if key in given):
        if not isinstance(given[key], dict) or not isinstance(whole.get(key, {}), dict):
            raise InputError(
                f"{where}: {key} is {quote(given[key])}: give a table, here and in the case"
            )
        # one of them ends a run
        lasts = {"steps", "t_end"} if {"steps", "t_end"} & given[key].keys() else set()
        whole[key] = {
            name: one for name, one in whole.get(key, {}).items() if name not in lasts
        } | given[key]
    if "out" in given.get("run", {}):
        raise InputError(
            f"{where}: run has the key 'out', which all stages share: give it in [run]"
        )
    if kind == "static":
        vain = [key for key in OF_MOTION if key in given] + [
            f"run.{key}" for key in given.get("run", {}) if key != "tolerance"
        ]
        if vain:
            raise InputError(
                f"{where} is static and cannot use {vain[0]}: leave it out, or move it to a "
                "dynamic one"
            )
        whole["run"] = {
            key: one for key, one in whole.get("run", {}).items() if key in ("tolerance", "out")
        } | AT_REST
    whole |= {key: given[key] for key in WHOLE if key in given}
    return Stage(f"{where} '{name}'", name, kind == "static", release, whole)


def refuse_own(tables: Mapping[str, Any], key: str, asked: str) -> None:
    """Raise InputError where something asks for another table of the case.

    That is where the last stage has one of its own.
    """
    stages = tables.get("stage")
    table = key.partition(".")[0].partition("=")[0]
    if isinstance(stages, list) and stages and isinstance(stages[-1], dict) and table in stages[-1]:
        raise InputError(
            f"{asked} changes [{table}], and the last [[stage]] has its own: leave it out there, "
            f"or give --set stage.{len(stages)}.{table}…"
        )
