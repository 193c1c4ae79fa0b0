"""Draw squared energy errors of both forms of the boundary element operator.

They are drawn against the length of the elements.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from vi_contact.plots.histories import canvas, plain_numbers, save

STYLES: dict[str, dict[str, Any]] = {
    "symmetric": {"color": "black", "marker": "o", "ms": 5, "lw": 1.2},
    "unsymmetric": {"color": "tab:red", "marker": "x", "ms": 7, "lw": 1.0, "ls": "--"},
}


def plot_errors(rows: Sequence[Mapping[str, Any]], path: str | Path) -> Path:
    """Draw a panel per case: error² + e² over h of both forms, and their slopes; e² as a line."""
    cases = list(dict.fromkeys(row["case"] for row in rows))
    figure, axes = canvas(1, len(cases), (3.3 * len(cases) + 0.4, 3.6))
    for axis, case in zip(axes[0], cases, strict=True):
        _panel(axis, case, [row for row in rows if row["case"] == case])
    figure.suptitle("Squared energy error of both forms against the finest symmetric solution")
    return save(figure, path)


def _panel(axis: Any, case: str, rows: Sequence[Mapping[str, Any]]) -> None:
    # a row of the unsymmetric form there is no error, but a difference of the forms
    finest = rows[0]["finest"]
    reference = rows[0]["reference_error"]
    for form, style in STYLES.items():
        chosen = [row for row in rows if row["form"] == form and row["k"] < finest]
        h = np.array([1.0 / row["k"] for row in chosen])
        errors = np.array([row["error_squared"] for row in chosen]) + reference
        told = f"{form}: {chosen[0]['slope']:.2f}" + (
            "" if chosen[0]["settled"] else " (not settled)"
        )
        axis.loglog(h, errors, label=told, **style)
    axis.axhline(reference, color="0.5", lw=0.9, ls=":", label=f"$e^2$, k = {finest}")
    axis.set_title(case, fontsize=9)
    axis.set_xlabel("h [m]", fontsize=9)
    axis.set_ylabel("error² + e², of the energy [-]", fontsize=9)
    axis.tick_params(labelsize=7, which="both")
    plain_numbers(axis.xaxis)
    axis.legend(fontsize=7.5, title="slope", title_fontsize=7.5)
