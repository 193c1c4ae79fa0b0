"""Gather what the histories say about a run, block by block, so that no history has to be kept for it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...core.algebra import Array

LEDGER = (
    ("work_input", "input work"),
    ("energy_kinetic", "kinetic energy"),
    ("energy_strain", "strain energy"),
    ("loss_damping", "damping"),
    ("loss_contact", "contact work"),
    ("loss_friction", "friction work"),
    ("loss_impact", "impact loss"),
    ("loss_algorithmic", "algorithmic loss"),
    ("energy_defect", "defect"),
)


class Tally:
    """Step, iterations, worst certificate, contact and energy ledger of a run. Row 0 is the initial state."""

    def __init__(self) -> None:
        self._rows = 0
        self._sums: dict[str, float] = {}
        self._most: dict[str, float] = {}
        self._first: dict[str, float] = {}
        self._last: dict[str, float] = {}

    def add(self, rows: Mapping[str, Array]) -> None:
        """Add rows, in order: column -> values."""
        ends = [name for name in ("t", *dict(LEDGER)) if name in rows]
        self._last = {name: float(rows[name][-1]) for name in ends}
        self._first = self._first or {name: float(rows[name][0]) for name in ends}
        steps = slice(0 if self._rows else 1, None)
        self._rows += len(rows["t"])
        self._add("iterations", rows["iterations"][steps])
        self._add("escalated", rows["escalated"])
        self._raise("iterations", rows["iterations"][steps])
        self._raise("certificate", rows["certificate"])
        if "contact_uplift" in rows:
            self._raise("uplift", rows["contact_uplift"])
            self._raise("depth", -rows["contact_min_gap"], np.fmax)  # nan without contact points
            self._add("contact", np.sign(rows["contact_active"][steps]))
        if "energy_defect" in rows:
            self._raise("energy", rows["energy_kinetic"] + rows["energy_strain"])
            self._raise("work", np.abs(rows["work_input"]))
            self._raise("defect", np.abs(rows["energy_defect"]))
            self._raise("created", -np.asarray(sum(rows[name] for name, _ in LEDGER if name.startswith("loss_"))))

    def _add(self, name: str, values: Array) -> None:
        self._sums[name] = self._sums.get(name, 0.0) + float(np.sum(values))

    def _raise(self, name: str, values: Array, larger: np.ufunc = np.maximum) -> None:
        """The largest so far; NaN stays NaN, but is left out with ``np.fmax``."""
        if len(values):
            found = float(larger.reduce(values))
            self._most[name] = float(larger(self._most.get(name, found), found))

    def facts(self) -> dict[str, Any]:
        """Return the numbers for summary.json."""
        steps, most = self._rows - 1, self._most
        facts: dict[str, Any] = {
            "steps": steps,
            "t_start": self._first["t"],
            "t_end": self._last["t"],
            "iterations_per_step": {
                "mean": self._sums["iterations"] / steps if steps else 0.0,
                "max": int(most.get("iterations", 0)),
            },
            "escalated_steps": int(self._sums["escalated"]),
            "worst_certificate": most["certificate"],
        }
        if "uplift" in most:
            facts["largest_uplift"] = most["uplift"]
            facts["smallest_gap"] = -self._most["depth"]  # negative: gap drift of the scheme
            facts["steps_in_contact"] = int(self._sums["contact"])
        return facts | (self._energy() if "defect" in most else {})

    def _energy(self) -> dict[str, Any]:
        """The ledger at the end [J], and its largest defect relative to the largest energy or input work of the run."""
        most, last = self._most, self._last
        start = self._first["energy_kinetic"] + self._first["energy_strain"]
        size = max(most["energy"], most["work"])
        relative = most["defect"] / size if size > 0.0 else most["defect"]
        created = max(0.0, most["created"])
        return {
            "energy": {"energy_start": start, "energy_max": most["energy"]}
            | {name: last[name] for name, _ in LEDGER[:-1]}
            | {"energy_defect_joule": last["energy_defect"], "energy_defect": relative},
            "energy_defect": relative,
            "energy_created": created / size if size > 0.0 else created,
        }
