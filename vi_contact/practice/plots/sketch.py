"""Draw a model from what model.json says of it: outline, supports and the parts of the contact."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ...core.algebra import Array
from .faces import add_polygons, set_limits, sheet
from .histories import escape_dollars

# Colours of what holds the bodies.
LINES = ("tab:green", "tab:blue", "tab:purple", "tab:brown", "tab:olive", "tab:cyan")
# Kind of node of a contact boundary -> marker and its colour.
MARKS = {
    "shared by both sides": ("s", "black"),
    "fixed": ("^", "black"),
    "prescribed": ("v", "black"),
    "tied to another": ("D", "black"),
    "partly covered": ("o", "tab:blue"),
    "hardly covered": ("P", "tab:red"),
    "in front of nothing": ("x", "0.5"),
}
DOTS = ("tab:red", "tab:orange", "tab:pink", "maroon")  # of parts of the contact


def sketch(model: Mapping[str, Any]) -> Any:
    """Return a matplotlib Figure of a model.

    It has the outline of the model, in space boxes around its bodies; in colours the groups that
    hold it; and as dots the points of each part of the contact.

    model: the keys title, dimension, outline, supports and contact of model.json.
    """
    d = model["dimension"]
    figure, axes = sheet([d < 3], 1, (7.6, 6.0))
    axis = axes[0, 0]
    colours = _name_supports(axis, model["supports"], d)
    for part in model["outline"]:
        held = part["group"] in colours
        add_polygons(
            axis,
            _read_points(part["lines"], d).reshape(-1, 2, max(d, 2)),
            edgecolors=colours[part["group"]] if held else "0.3",
            linewidths=3.0 if held else 0.8,
        )
    for k, part in enumerate(model["contact"]):
        _draw_contact(axis, part, d, DOTS[k % len(DOTS)])
    ends = np.concatenate([_read_points(part["lines"], d) for part in model["outline"]])
    set_limits(axis, ends.min(axis=0), ends.max(axis=0), margin=0.06)
    axis.set_title(escape_dollars(model["title"]))
    axis.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), fontsize=8, frameon=False)
    return figure


def _name_supports(axis: Any, supports: Sequence[Mapping[str, Any]], d: int) -> dict[str, str]:
    """Add the supports to the legend, by lines without points; return the colour of each group."""
    colours: dict[str, str] = {}
    nowhere = np.full((max(d, 2), 1), np.nan)
    for k, support in enumerate(supports):
        colour = LINES[k % len(LINES)]
        components = ", ".join(support["components"])
        label = f"{support['kind']} {components}: {', '.join(support['groups'])}"
        axis.plot(*nowhere, lw=3.0, color=colour, label=escape_dollars(label))
        colours |= dict.fromkeys(support["groups"], colour)
    return colours


def _draw_contact(axis: Any, part: Mapping[str, Any], d: int, colour: str) -> None:
    """Draw the points of a part of the contact, and mark its nodes of other kinds."""
    axis.plot(
        *_read_points(part["places"], d).T,
        label=escape_dollars(f"contact: {part['name']}"),
        ls="",
        marker="o",
        ms=3.0,
        color=colour,
    )
    for kind, places in part.get("others", {}).items():
        if kind in MARKS:
            marker, edge = MARKS[kind]
            axis.plot(
                *_read_points(places, d).T,
                label=escape_dollars(f"{part['name']}: {len(places)} {kind}"),
                zorder=5,
                ls="",
                marker=marker,
                ms=7.0,
                mfc="none",
                mec=edge,
                mew=1.4,
            )


def _read_points(values: Any, d: int) -> Array:
    """Return points (k, d); those on a line get a second coordinate, zero."""
    return np.pad(np.reshape(values, (-1, d)), ((0, 0), (0, max(2 - d, 0))))
