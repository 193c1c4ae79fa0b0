"""Draw friction from recorded histories.

There is force against slip, and where and when points stick or slip.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.practice.plots.deformed import contact_states
from vi_contact.practice.plots.faces import STATES
from vi_contact.practice.plots.histories import (
    History,
    canvas,
    cell_edges,
    length_unit,
    panels,
    save,
    scale_values,
)


def plot_hysteresis(
    history: History,
    path: str | Path,
    *,
    axis: str | None = None,
    tangent: int = 0,
    title: str = "Friction force and slip",
) -> Path:
    """Draw the tangential force of the body on its support along an axis.

    It is drawn against the mean slip of all contact points.

    ``axis``: x, y or z, where the force varies most when None; ``tangent``: which component of the
    slip. The slip's sign is that of the axis for work that is done on the support, so that the loop
    runs clockwise and its area is the work of friction where all points slide alike. InputError
    without records of friction.
    """
    force, name = _force(history, axis)
    slip = _slip(history)[:, :, tangent].mean(axis=1)
    work = float(np.sum(0.5 * (force[1:] + force[:-1]) * np.diff(slip)))
    slip = slip if work >= 0.0 else -slip
    metres, unit = length_unit(float(np.max(np.abs(slip), initial=0.0)))
    newtons, force_unit = scale_values(force, "N")
    figure, ((plot,),) = canvas(1, 1, (6.4, 4.8))
    plot.axhline(0.0, color="0.6", lw=0.6)
    plot.axvline(0.0, color="0.6", lw=0.6)
    plot.plot(slip / metres, newtons, color="black", lw=0.9)
    plot.plot(slip[:1] / metres, newtons[:1], "o", color="tab:green", ms=5, label="start")
    plot.plot(slip[-1:] / metres, newtons[-1:], "s", color="tab:red", ms=5, label="end")
    plot.legend(fontsize=8, ncol=2, loc="lower right", bbox_to_anchor=(1.0, 1.0), frameon=False)
    plot.set(
        xlabel=f"mean slip [{unit}]", ylabel=f"friction force on the support, {name} [{force_unit}]"
    )
    plot.set_title(title, loc="left")
    return save(figure, path)


def plot_states(
    history: History,
    path: str | Path,
    *,
    position: Array,
    axis_label: str = "position [m]",
    title: str = "Open, sticking and slipping points",
) -> Path:
    """Map the states of the contact points over position and time.

    ``position``: (m,) of the points.

    InputError without records of friction.
    """
    from matplotlib.colors import BoundaryNorm, ListedColormap
    from matplotlib.patches import Patch

    t = history["t"]
    order = np.argsort(position)
    _slip(history)
    states = contact_states(history)[:, order]
    figure, (panel,) = panels(1, (9.0, 4.0))
    panel.grid(False)
    colours = ListedColormap([colour for _, colour in STATES.values()])
    panel.pcolormesh(
        cell_edges(t),
        cell_edges(np.asarray(position)[order]),
        states.T,
        cmap=colours,
        norm=BoundaryNorm([0.5, 1.5, 2.5, 3.5], 3),
        rasterized=True,
    )
    patches = [
        Patch(facecolor=colour, edgecolor="0.5", label=label) for label, colour in STATES.values()
    ]
    panel.legend(
        handles=patches,
        fontsize=8,
        ncol=3,
        loc="lower right",
        bbox_to_anchor=(1.0, 1.0),
        frameon=False,
    )
    panel.set_ylabel(axis_label)
    panel.set_title(title, loc="left")
    return save(figure, path)


def _slip(history: History) -> Array:
    """(rows, m, d - 1)."""
    if "slip" not in history:
        raise InputError(
            "the history has no column slip: run a problem with friction and record Contact()"
        )
    rows = len(history["t"])
    points = np.reshape(history["active"], (rows, -1)).shape[1]
    return np.reshape(history["slip"], (rows, points, -1)).astype(float)


def _force(history: History, axis: str | None) -> tuple[Array, str]:
    """Force of the body on its support along the axis, and the name of the axis."""
    names = {name[-1]: name for name in history if name.startswith("friction_force_")}
    if not names:
        raise InputError(
            "the history has no friction_force: run a problem with friction and record Contact()"
        )
    if axis is None:
        axis = max(names, key=lambda one: float(np.ptp(history[names[one]])))
    if axis not in names:
        raise InputError(
            f"plot_hysteresis: no friction force is along {axis!r}, choose one of "
            f"{', '.join(names)}"
        )
    return 0.0 - history[names[axis]], axis
