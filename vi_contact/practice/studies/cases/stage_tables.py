"""Read [[stage]] tables.

They say what each stage replaces in the tables of the case, and single keys of [system] and [run].
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import Any

from ....core.checks import flag, quote
from ....core.errors import InputError
from .parsing import suggest_nearest

BY_KEY = ("system", "run")
WHOLE = (
    "gravity",
    "reservoir",
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
KEYS = ("name", "type", "release", "add", "remove", *BY_KEY, *WHOLE)
# what a static stage has no use for
OF_MOTION = ("excitation", "scheme", "impact", "mass", "escalation")
AT_REST = {"dt": 1.0, "steps": 0}  # [run] of a static stage: a row at t = 0
_NAME = re.compile(r"\w{1,40}", re.ASCII)


@dataclass(frozen=True)
class Stage:
    """Hold what a stage is.

    Attributes:
        label: how sentences name it.
        name: of the file, which its run folder has, too.
        static: it finds an equilibrium, and does not march.
        release: reactions of supports that it does without go on as forces.
        tables: its own, with those of the case.
        changes: whether it adds or removes bodies.
        case: the ``Case`` that is made of them.
    """

    label: str
    name: str
    static: bool
    release: bool
    tables: Mapping[str, Any]
    changes: bool = False
    case: Any = None


def split_stages(path: Path, tables: Mapping[str, Any]) -> list[Stage]:
    """Return the stages of a case, none without [[stage]]; InputError for wrong keys and values."""
    if "stage" not in tables:
        return []
    own_tables = tables["stage"]
    is_list = isinstance(own_tables, list) and bool(own_tables)
    if not is_list or not all(isinstance(own, dict) for own in own_tables):
        raise InputError(
            f"{path}: [stage] is not a list of tables: write [[stage]] above the keys of each stage"
        )
    stages = [
        _read_stage(f"{path}: [[stage]] {number}", own, tables)
        for number, own in enumerate(own_tables, start=1)
    ]
    stages = _list_absent(stages, own_tables)
    if stages[0].release:
        raise InputError(
            f"{stages[0].label} has release = true, and is the first stage: leave it out"
        )
    for before, stage in pairwise(stages):
        for key in ("contact", "friction"):
            if not stage.static and stage.tables.get(key) != before.tables.get(key):
                raise InputError(
                    f"{stage.label} has another [{key}] than the stage before it, and would jump "
                    "at t = 0: give both the same, or put a static stage with this one between them"
                )
    return stages


def _read_stage(label: str, own: Mapping[str, Any], tables: Mapping[str, Any]) -> Stage:
    """Return a stage.

    Args:
        label: how sentences begin.
        own: the table [[stage]].
        tables: of the case.

    Raises:
        InputError: for a key that no stage has or that a static one has no use for, and for a value
            that does not fit.
    """
    for key in own:
        if key not in KEYS:
            raise InputError(f"{label} has the unknown key '{key}': {suggest_nearest(key, KEYS)}")
    name = own.get("name", "")
    kind = own.get("type")
    release = own.get("release", False)
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        raise InputError(f"{label} has name = {quote(name)}: give letters, digits and underscores")
    if kind not in ("static", "dynamic"):
        raise InputError(f'{label} has type = {quote(kind)}: give "static" or "dynamic"')
    flag(label, "release", release)
    whole = {key: value for key, value in tables.items() if key != "stage"}
    for key in BY_KEY:
        if key in own:
            whole[key] = _replace_keys(label, key, whole.get(key, {}), own[key])
    if "out" in own.get("run", {}):
        raise InputError(
            f"{label}: run has the key 'out', which all stages share: give it in [run]"
        )
    if kind == "static":
        _refuse_motion(label, own)
        run = whole.get("run", {})
        whole["run"] = {key: run[key] for key in run if key in ("tolerance", "out")} | AT_REST
    whole |= {key: own[key] for key in WHOLE if key in own}
    if whole.get("reservoir") == {}:  # a stage whose reservoir is empty
        del whole["reservoir"]
    return Stage(f"{label} '{name}'", name, kind == "static", release, whole)


def _list_absent(stages: list[Stage], own_tables: list[dict[str, Any]]) -> list[Stage]:
    """Return the stages with the cell groups that are absent in each, in their [system].

    A body that some stage adds is absent before it; all others are there from the beginning.

    Args:
        stages: of a case.
        own_tables: their tables [[stage]].

    Raises:
        InputError: a stage adds what is there, or removes what is not; it is dynamic, or the first.
    """
    changes = [
        (_read_bodies(stage, own, "add"), _read_bodies(stage, own, "remove"))
        for stage, own in zip(stages, own_tables, strict=True)
    ]
    if not any(added or removed for added, removed in changes):
        return stages
    absent: list[str] = []
    seen: set[str] = set()
    for added, removed in changes:
        absent += [name for name in added if name not in seen]
        seen.update((*added, *removed))
    result = []
    for stage, (added, removed) in zip(stages, changes, strict=True):
        if (added or removed) and (stage is stages[0] or not stage.static):
            raise InputError(
                f"{stage.label} adds or removes a body: give add and remove to a static stage that "
                "is not the first, which begins with all bodies that no stage adds"
            )
        for name in added:
            if name not in absent:
                raise InputError(f"{stage.label} adds '{name}', which is there: leave it out")
        for name in removed:
            if name in absent:
                raise InputError(f"{stage.label} removes '{name}', which is absent: leave it out")
        absent = [name for name in absent if name not in added] + removed
        system = {**stage.tables.get("system", {}), "absent": list(absent)}
        tables = {**stage.tables, "system": system}
        result.append(replace(stage, tables=tables, changes=bool(added or removed)))
    return result


def _read_bodies(stage: Stage, own: Mapping[str, Any], key: str) -> list[str]:
    """Return the cell groups that a stage adds or removes; InputError for no names."""
    value = own.get(key, [])
    names = [value] if isinstance(value, str) else value
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise InputError(
            f"{stage.label} has {key} = {quote(value)}: give the name of a cell group, or a list"
        )
    return names


def _replace_keys(label: str, key: str, table: Any, own: Any) -> dict[str, Any]:
    """Return [system] or [run] of the case, with the keys that a stage replaces."""
    if not isinstance(own, dict) or not isinstance(table, dict):
        raise InputError(f"{label}: {key} is {quote(own)}: give a table, here and in the case")
    # One of these ends a run: a stage that gives one does without the other of the case.
    ends = {"steps", "t_end"}
    replaced = ends if ends & own.keys() else set()
    return {name: value for name, value in table.items() if name not in replaced} | own


def _refuse_motion(label: str, own: Mapping[str, Any]) -> None:
    """Raise InputError for keys that a static stage has no use for."""
    run_keys = [f"run.{key}" for key in own.get("run", {}) if key != "tolerance"]
    vain = [key for key in OF_MOTION if key in own] + run_keys
    if vain:
        raise InputError(
            f"{label} is static and cannot use {vain[0]}: leave it out, or move it to a dynamic one"
        )


def refuse_own(tables: Mapping[str, Any], key: str, asked: str) -> None:
    """Raise InputError where something changes a table which the last stage replaces.

    Args:
        tables: of the case.
        key: a table, or a setting KEY=VALUE of it.
        asked: what changes it, the first words of the sentence.
    """
    stages = tables.get("stage")
    table = key.partition(".")[0].partition("=")[0]
    if isinstance(stages, list) and stages and isinstance(stages[-1], dict) and table in stages[-1]:
        raise InputError(
            f"{asked} changes [{table}], and the last [[stage]] has its own: leave it out there, "
            f"or give --set stage.{len(stages)}.{table}…"
        )
