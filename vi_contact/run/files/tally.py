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
        self._least: dict[str, float] = {}
        self._first: dict[str, float] = {}
        self._last: dict[str, float] = {}

    def add(self, rows: Mapping[str, Array]) -> None:
        """Add rows, in order: column -> values."""
        self._last = {name: float(rows[name][-1]) for name in ("t", *dict(LEDGER)) if name in rows}
        steps = slice(0 if self._rows else 1, None)
        self._rows += len(rows["t"])
        self._add("iterations", rows["iterations"][steps])
        self._add("escalated", rows["escalated"])
        self._raise("iterations", rows["iterations"][steps])
        self._raise("certificate", rows["certificate"])
        if "contact_uplift" in rows:
            self._raise("uplift", rows["contact_uplift"])
            gap = np.fmin.reduce(rows["contact_min_gap"])  # nan without contact points
            self._least["gap"] = float(np.fmin(self._least.get("gap", np.nan), gap))
            self._add("contact", (rows["contact_active"][steps] > 0).astype(float))
        if "energy_defect" in rows:
            self._add_energy(rows)
        self._first = self._first or {name: float(values) for name, values in self._beginning(rows).items()}

    def _add_energy(self, rows: Mapping[str, Array]) -> None:
        self._raise("energy", rows["energy_kinetic"] + rows["energy_strain"])
        self._raise("work", np.abs(rows["work_input"]))
        self._raise("defect", np.abs(rows["energy_defect"]))
        losses = np.asarray(sum(rows[name] for name, _ in LEDGER if name.startswith("loss_")))
        self._raise("created", -losses)

    @staticmethod
    def _beginning(rows: Mapping[str, Array]) -> dict[str, Any]:
        found = {"t": rows["t"][0]}
        return found | ({"energy": rows["energy_kinetic"][0] + rows["energy_strain"][0]} if "energy_kinetic" in rows
                        else {})

    def _add(self, name: str, values: Array) -> None:
        self._sums[name] = self._sums.get(name, 0.0) + float(np.sum(values))

    def _raise(self, name: str, values: Array) -> None:
        """The largest so far; NaN stays NaN."""
        if len(values):
            self._most[name] = float(np.maximum(self._most.get(name, -np.inf), np.max(values)))

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
            facts["smallest_gap"] = self._least["gap"]  # negative: gap drift of the scheme
            facts["steps_in_contact"] = int(self._sums["contact"])
        return facts | (self._energy() if "defect" in most else {})

    def _energy(self) -> dict[str, Any]:
        """The ledger at the end [J], and its largest defect relative to the largest energy or input work of the run."""
        most, last = self._most, self._last
        size = max(most["energy"], most["work"])
        relative = most["defect"] / size if size > 0.0 else most["defect"]
        created = max(0.0, most["created"])
        return {
            "energy": {"energy_start": self._first["energy"], "energy_max": most["energy"]}
            | {name: last[name] for name, _ in LEDGER[:-1]}
            | {"energy_defect_joule": last["energy_defect"], "energy_defect": relative},
            "energy_defect": relative,
            "energy_created": created / size if size > 0.0 else created,
        }
