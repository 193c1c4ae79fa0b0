"""Draw rows of benchmarks/bem_multiplier.py: what the mesh of the contact multiplier does."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from vi_contact.plots.histories import canvas, plain_numbers, save

Row = dict[str, Any]
LOOK = {
    "end": ("tested at the ends of intervals", "tab:blue"),
    "mean": ("tested in the mean", "tab:red"),
}
KINDS: dict[str, tuple[Callable[[Row], bool], str]] = {
    "space": (lambda row: row["DT_over_dt"] == 1, "s"),
    "time": (lambda row: row["H_over_h"] == 1, "v"),
    "both": (lambda row: row["H_over_h"] == row["DT_over_dt"], "o"),
}


def plot_multiplier(rows: Sequence[Row], path: str | Path) -> Path:
    """Draw histories of the contact force.

    Constants of the pairing, oscillations and errors are drawn over the ratio.
    """
    figure, axes = canvas(2, 2, (10.0, 7.2))
    finest = max(row["k"] for row in rows)
    plain = [row for row in rows if row["law"] == "none" and row["sigma"] == 0.0]
    best = [row for row in plain if row["k"] == finest and row["degree"] == 0]
    _forces(axes[0, 0], [row for row in best if row["H_over_h"] == row["DT_over_dt"] == 4], finest)
    _constants(axes[0, 1], plain)
    _ratios(axes[1, 0], best, "oscillation", f"oscillation of the contact force [-]\nk = {finest}")
    _ratios(axes[1, 1], best, "impulse_error", f"error of the contact impulse [-]\nk = {finest}")
    return save(figure, path)


def _forces(axis: Any, rows: Sequence[Row], k: int) -> None:
    for row in rows:
        axis.stairs(
            row["force"],
            row["t"],
            color=LOOK[row["testing"]][1],
            label=LOOK[row["testing"]][0],
            lw=1.4,
        )
    axis.stairs(
        rows[0]["finest"],
        rows[0]["t"],
        color="black",
        label="finest answer, its means",
        lw=1.0,
        ls="--",
    )
    highest = max(max(row["force"]) for row in rows)
    axis.set(
        xlabel="time [s]",
        ylabel="contact force [N/m]",
        title=f"H = 4 h, DT = 4 dt, k = {k}",
        ylim=(0.0, 1.35 * highest),
    )
    axis.legend(fontsize=7.5, loc="upper left")


def _constants(axis: Any, rows: Sequence[Row]) -> None:
    kinds = {
        "constant, in space": (0, "end", "space", "-"),
        "linear, in space": (1, "end", "both", "--"),
        "constant, in space and time, means": (0, "mean", "both", ":"),
    }
    for (label, (degree, testing, kind, line)), colour in zip(
        kinds.items(), ("tab:blue", "tab:green", "tab:red"), strict=True
    ):
        for k in sorted({row["k"] for row in rows}):
            chosen = [
                row
                for row in rows
                if row["k"] == k
                and row["degree"] == degree
                and row["testing"] == testing
                and KINDS[kind][0](row)
            ]
            axis.plot(
                [row["H_over_h"] for row in chosen],
                [row["inf_sup"] for row in chosen],
                line,
                color=colour,
                marker=".",
                lw=0.6 + k / 16.0,
                label=f"{label}, k = {k}",
            )
    axis.set(
        xlabel="ratio H/h, or H/h = DT/dt [-]",
        ylabel="inf-sup constant [-]",
        ylim=(0.0, 1.05),
        xscale="log",
        title="what displacements see of the multiplier",
    )
    plain_numbers(axis.xaxis)
    axis.legend(fontsize=6.5, loc="lower right")


def _ratios(axis: Any, rows: Sequence[Row], name: str, label: str) -> None:
    for testing, (words, colour) in LOOK.items():
        for kind, (chosen, marker) in KINDS.items():
            line = [row for row in rows if row["testing"] == testing and chosen(row)]
            ratio = [max(row["H_over_h"], row["DT_over_dt"]) for row in line]
            axis.plot(
                ratio,
                [row[name] for row in line],
                marker=marker,
                color=colour,
                ms=4.0,
                lw=1.0,
                ls={"space": "--", "time": ":", "both": "-"}[kind],
                label=f"{kind}: {words}",
            )
    axis.set(xlabel="ratio H/h, DT/dt, or both [-]", ylabel=label, xscale="log", yscale="log")
    plain_numbers(axis.xaxis)
    low, high = axis.get_ylim()
    axis.set_ylim(low, high * (high / low) ** 0.35)  # room for the legend
    axis.legend(fontsize=6.5, loc="upper left", ncol=2)
