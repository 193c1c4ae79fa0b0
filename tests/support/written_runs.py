"""Write the folder of a run that nobody made: histories of any length, names and texts of any
kind."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np


def write_run(
    folder: Path,
    columns: Mapping[str, tuple[str, str, Any]],
    *,
    dt: float,
    facts: Mapping[str, Any] | None = None,
    case: str = "",
    model: Mapping[str, Any] | None = None,
) -> Path:
    """Write columns name -> (unit, meaning, values (n,)), with those of every run; ``case``: text
    of case.toml."""
    folder.mkdir(parents=True)
    count = len(next(iter(columns.values()))[2])
    needed = {
        "t": ("s", "time", dt * np.arange(count)),
        "k": ("-", "step", np.arange(count)),
        "iterations": ("-", "iterations", np.ones(count)),
        "escalated": ("-", "escalated", np.zeros(count)),
        "certificate": ("-", "residual", np.full(count, 1e-14)),
    }
    every = {**needed, **columns}
    table = np.column_stack([values for *_, values in every.values()])
    rows = [",".join(map(repr, row)) for row in table.tolist()]
    (folder / "history.csv").write_text("\n".join([",".join(every), *rows, ""]), encoding="utf-8")
    described = {
        name: {"unit": unit, "meaning": meaning} for name, (unit, meaning, _) in every.items()
    }
    (folder / "columns.json").write_text(json.dumps(described), encoding="utf-8")
    (folder / "summary.json").write_text(
        json.dumps({"status": "finished", "tolerance": 1e-9, **(facts or {})})
    )
    if case:
        (folder / "case.toml").write_text(case, encoding="utf-8")
    if model is not None:
        (folder / "model.json").write_text(json.dumps(model), encoding="utf-8")
    return folder
