"""Draw a model from what model.json says of it: outline, supports and the parts of the contact."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from ...core.algebra import Array
from .faces import add_polygons, set_limits, sheet
from .histories import escape_dollars

# what holds the bodies
LINES = ("tab:green", "tab:blue", "tab:purple", "tab:brown", "tab:olive", "tab:cyan")
MARKS = {  # kind of node of a contact boundary -> how it is marked
    "shared by both sides": ("s", "black"),
    "clamped": ("^", "black"),
    "prescribed": ("v", "black"),
    "tied to another": ("D", "black"),
    "partly covered": ("o", "tab:blue"),
    "hardly covered": ("P", "tab:red"),
    "in front of nothing": ("x", "0.5"),
}
DOTS = ("tab:red", "tab:orange", "tab:pink", "maroon")  # parts of the contact


def sketch(model: Mapping[str, Any]) -> Any:
    """Return a matplotlib Figure of a model.

    There is its outline, in space boxes around its bodies; in colours there are the groups that
    hold it, and as dots the points of each part of the contact.

    model: the keys title, dimension, outline, supports and contact of model.json.
    """
    d, colours = model["dimension"], dict[str, str]()
    figure, axes = sheet([d < 3], 1, (7.6, 6.0))
    axis = axes[0, 0]
    for k, one in enumerate(model["supports"]):
        words = f"{one['kind']} {', '.join(one['components'])}: {', '.join(one['groups'])}"
        axis.plot(
            *np.full((max(d, 2), 1), np.nan),
            lw=3.0,
            color=LINES[k % len(LINES)],
            label=escape_dollars(words),
        )
        colours |= dict.fromkeys(one["groups"], LINES[k % len(LINES)])
    for one in model["outline"]:
        width, colour = (3.0, colours[one["group"]]) if one["group"] in colours else (0.8, "0.3")
        add_polygons(
            axis,
            _points(one["lines"], d).reshape(-1, 2, max(d, 2)),
            edgecolors=colour,
            linewidths=width,
        )
    for k, one in enumerate(model["contact"]):
        dots = {"ls": "", "marker": "o", "ms": 3.0, "color": DOTS[k % len(DOTS)]}
        axis.plot(
            *_points(one["places"], d).T, label=escape_dollars(f"contact: {one['name']}"), **dots
        )
        for kind, places in one.get("others", {}).items():
            if kind in MARKS:
                marker, colour = MARKS[kind]
                marks = {
                    "ls": "",
                    "marker": marker,
                    "ms": 7.0,
                    "mfc": "none",
                    "mec": colour,
                    "mew": 1.4,
                }
                words = escape_dollars(f"{one['name']}: {len(places)} {kind}")
                axis.plot(*_points(places, d).T, label=words, zorder=5, **marks)
    ends = np.concatenate([_points(one["lines"], d) for one in model["outline"]])
    set_limits(axis, ends.min(axis=0), ends.max(axis=0), margin=0.06)
    axis.set_title(escape_dollars(model["title"]))
    axis.legend(loc="upper left", bbox_to_anchor=(1.02, 1.0), fontsize=8, frameon=False)
    return figure


def _points(values: Any, d: int) -> Array:
    """Points (k, d), those of a line in the plane."""
    return np.pad(np.reshape(values, (-1, d)), ((0, 0), (0, max(2 - d, 0))))
