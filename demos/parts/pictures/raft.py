"""Draw what the demo of the building on a raft shows beside its contact faces.

There are histories, and moments over rotations.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.plots.histories import History, canvas, panels, save, scale

CORNERS = {
    f"{x}_{y}": (i, j)
    for x, i in (("left", -1), ("right", 1))
    for y, j in (("back", -1), ("front", 1))
}


def instants(history: History) -> list[float]:
    """Return the last time [s] before the largest uplift of three openings.

    They are those at which a twentieth of it was open, half of it, and that of the largest.
    """
    uplift = history["uplift_raft"]
    widest = int(np.argmax(uplift))
    below = [np.flatnonzero(uplift[: widest + 1] <= part * uplift[widest]) for part in (0.05, 0.5)]
    return [float(history["t"][rows[-1] if len(rows) else 0]) for rows in below] + [
        float(history["t"][widest])
    ]


def plot_motions(history: History, path: str | Path, *, weight: float, mu: float) -> Path:
    """Draw ground and roof, the force of the soil on the raft, what is open, and the slip.

    The force is over the ``weight`` [N].
    """
    t = history["t"]
    figure, axes = panels(5, (8.5, 11.0))
    for axis, panel in zip("xy", axes, strict=False):
        panel.plot(
            t,
            history[f"a_{axis}_field"],
            color="0.6",
            lw=0.9,
            label="ground, at the edge of the soil",
        )
        panel.plot(t, history[f"a_{axis}_roof"], lw=0.9, label="roof")
        panel.set_ylabel(f"$a_{axis}$ [m/s²]")
    shear = np.hypot(history["force_x_raft"], history["force_y_raft"])
    axes[2].plot(t, history["N_raft"] / weight, lw=0.9, label="normal force")
    axes[2].plot(t, shear / weight, lw=0.9, label="base shear")
    axes[2].plot(
        t,
        mu * history["N_raft"] / weight,
        ":",
        color="0.4",
        lw=0.9,
        label=f"{mu:g} times normal force",
    )
    axes[2].set_ylabel("over the weight [-]")
    axes[3].fill_between(t, history["uplift_raft"], color="tab:blue", alpha=0.4, lw=0.0)
    axes[3].plot(t, history["uplift_raft"], lw=0.9)
    axes[3].set(ylabel="open share of the raft [-]", ylim=(0.0, 1.0))
    axes[4].plot(t, 1e3 * history["slip_raft"], lw=0.9, label="largest slip")
    axes[4].plot(t, 1e3 * history["opening_raft"], lw=0.9, label="largest opening")
    axes[4].set(ylabel="[mm]", xlim=(t[0], t[-1]))
    for panel in axes[[0, 2, 4]]:
        panel.legend(
            fontsize=8, ncol=3, loc="lower left", bbox_to_anchor=(0.0, 0.98), frameon=False
        )
    return save(figure, path, "A building on a raft on soil")


def rotations(history: History, sides: Sequence[float]) -> dict[str, Array]:
    """Return the rotations [rad] of the raft about x and y from the heights of its corners.

    ``sides`` are those of the raft [m].
    """
    corner = {name: history[f"u_z_{name}"] for name in CORNERS}
    about_x = (
        corner["right_front"] + corner["left_front"] - corner["right_back"] - corner["left_back"]
    )
    about_y = (
        corner["left_front"] + corner["left_back"] - corner["right_front"] - corner["right_back"]
    )
    return {"x": 0.5 * about_x / sides[1], "y": 0.5 * about_y / sides[0]}


def plot_moments(
    history: History, path: str | Path, *, weight: float, sides: Sequence[float]
) -> Path:
    """Draw the moment of the raft on the soil over its rotation.

    It is drawn over its rotation against the soil too, about x and y.

    Lines: the moments weight·B/6 and weight·B/2 of the side B [m] across; at the first a stiff raft
    on springs begins to lift off, beyond the second it would overturn at rest.
    """
    figure, axes = canvas(1, 2, (10.0, 4.8), sharey=True)
    factor, unit = scale(
        max(float(np.abs(history[f"M_{axis}_raft"]).max()) for axis in "xy"), "N m"
    )
    turned = rotations(history, sides)
    limits = 0.65 * factor * weight * max(sides) * np.array([-1.0, 1.0])
    for axis, panel, side in zip("xy", axes[0], sides[::-1], strict=True):
        moment = -factor * history[f"M_{axis}_raft"]
        for name, theta in (
            ("of the raft", turned[axis]),
            ("against the soil", history[f"theta_{axis}_raft"]),
        ):
            panel.plot(1e3 * theta, moment, lw=0.7, label=f"rotation {name}")
        panel.plot(1e3 * turned[axis][0], moment[0], "o", ms=4, color="k", label="at rest")
        for part, style in ((6.0, ":"), (2.0, "--")):
            for sign in (1.0, -1.0):
                panel.axhline(
                    sign * factor * weight * side / part,
                    color="0.5",
                    ls=style,
                    lw=0.9,
                    label=f"weight times side / {part:g}" if sign > 0.0 else None,
                )
        panel.set(
            xlabel=f"rotation about {axis} [mrad]",
            title=f"about {axis}, side {side:g} m",
            ylim=limits,
        )
    axes[0, 0].legend(fontsize=8, loc="upper left", framealpha=1.0)
    axes[0, 0].set_ylabel(f"moment of the raft on the soil [{unit}]")
    return save(figure, path, "Moment over rotation")
