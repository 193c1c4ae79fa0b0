"""Draw a model from what model.json says of it.

A sketch has the bodies with their names, the size of the model, supports and parts of the contact
by name, and loads as arrows.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ...core.algebra import Array
from ..units.report_units import ReportUnits, write_number
from .borders import Border, chain_border
from .faces import add_polygons, set_limits
from .histories import STYLE, cut, escape_dollars, require_matplotlib, scale
from .labels import Labels
from .report_numbers import ReportNumbers, read_slice

# Colour and dashes of what holds the bodies: each is another one's nowhere in grey.
HOLDS = (
    ("#1b6e3c", "solid"),
    ("#1f5fa8", (0, (4, 1.5))),
    ("#6a3d9a", (0, (1, 1))),
    ("#8c5a2b", (0, (6, 1.5, 1, 1.5))),
    ("#5f6b1e", (0, (2.5, 1))),
    ("#127a8a", (0, (8, 2))),
)
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
# Colour and marker of the parts of the contact.
DOTS = (
    ("#c8201e", "o"),
    ("#e69f00", "s"),
    ("#d65fb0", "^"),
    ("#7a1010", "D"),
    ("#1f5fa8", "v"),
    ("#4d4d4d", "P"),
)
FILLS = ("0.80", "0.94", "0.87", "0.74", "0.97", "0.68")  # of bodies
# Over the largest size of the model: room around it, and where the lines are that give its size.
ROOM = 0.13
BEYOND = 0.075
ARROW = 0.16  # length of the arrow of the largest load, over the largest size of the model
LEAST_ARROW = 0.4  # of other arrows, over that length
# Of the picture [inches]: width of the model, bounds of its height.
WIDTH = 7.4
HEIGHTS = (1.6, 6.0)
LETTER = 0.07  # width of a letter in the picture [inches]
INK = 0.65  # brightness of a name over that of what it names, which may be pale
LONGEST = 56  # letters of a name in the legend, which would leave the model no room
LEADER = np.array([-1.0, 0.6])  # direction in which the name of a slender body stands


def sketch(model: Mapping[str, Any], units: ReportUnits = ReportUnits()) -> Any:
    """Return a matplotlib Figure of a model.

    In the plane it has the bodies, in space boxes around them; in colours and dashes the groups
    that hold it; as marks the points of each part of the contact; and arrows for its loads. What is
    not in the file is left out.

    Args:
        model: the keys title, dimension, section, bodies, outline, supports, contact and loads of
            model.json.
        units: of the resultants of loads.
    """
    d = model["dimension"]
    outline = model["outline"]
    ends = np.concatenate([_read_points(part["lines"], d) for part in outline])
    low = ends.min(axis=0)
    high = ends.max(axis=0)
    figure, axis = _make_axis(low, high, d)
    size = float((high - low).max()) or 1.0

    bodies = model.get("bodies") or ()
    if d == 2:
        _draw_bodies(axis, outline, bodies)
    holds = _name_supports(axis, model["supports"], d)
    _draw_outline(axis, outline, holds, d)
    for k, part in enumerate(model["contact"]):
        _draw_contact(axis, part, d, *DOTS[k % len(DOTS)])
    set_limits(axis, low, high, margin=ROOM)

    title = escape_dollars(model["title"])
    numbers = ReportNumbers(units, read_slice(model))
    if d == 3:
        title += "\n" + " × ".join(f"{write_number(length)} m" for length in high - low)
        _write_names_in_space(axis, model)
        _draw_loads_in_space(axis, model.get("loads"), size, numbers)
    else:
        room = Labels(axis, WIDTH / float(np.ptp(axis.get_xlim())))
        _write_size(room, low, high, BEYOND * size)
        _write_names(room, model, holds, d)
        _draw_loads(room, model.get("loads"), size, numbers)
    axis.set_title(title, fontsize=11)
    handles, labels = axis.get_legend_handles_labels()
    names = [cut(label, LONGEST) for label in labels]
    axis.legend(
        handles, names, loc="upper left", bbox_to_anchor=(1.02, 1.0), fontsize=8, frameon=False
    )
    return figure


def _make_axis(low: Array, high: Array, d: int) -> tuple[Any, Any]:
    """Make (figure, axis) as high as a model between two corners (d,) needs [m]."""
    require_matplotlib()
    import matplotlib
    from matplotlib.figure import Figure

    sizes = high - low + 2.0 * ROOM * float((high - low).max() or 1.0)
    height = 6.0 if d == 3 else float(np.clip(WIDTH * sizes[1] / sizes[0], *HEIGHTS))
    look = {"axes.grid": False, "xtick.labelsize": 8, "ytick.labelsize": 8}
    with matplotlib.rc_context(STYLE | look):
        figure = Figure(figsize=(WIDTH + 2.6, height + 0.9), layout="constrained")
        return figure, figure.add_subplot(projection="3d" if d == 3 else None)


def _draw_bodies(axis: Any, outline: Any, bodies: Sequence[Mapping[str, Any]]) -> None:
    """Fill the bodies in the plane, and say in the legend what they are made of."""
    from matplotlib.patches import PathPatch, Polygon

    for number, border in _list_borders(outline):
        fill = FILLS[number % len(FILLS)]
        axis.add_patch(PathPatch(border.path, facecolor=fill, edgecolor="none", zorder=0.5))
        if number < len(bodies):
            sizes = np.ptp(np.concatenate(border.chains), axis=0)
            label = escape_dollars(_describe_body(bodies[number], sizes))
            nowhere = np.full((1, 2), np.nan)
            axis.add_patch(Polygon(nowhere, facecolor=fill, edgecolor="0.3", label=label))


def _list_borders(outline: Any) -> Iterator[tuple[int, Border]]:
    """Yield the number and the border of each region that has one."""
    for part in outline:
        if "region" in part and len(part["lines"]):
            yield int(part["region"]), chain_border(np.array(part["lines"], dtype=float))


def _describe_body(body: Mapping[str, Any], sizes: Array) -> str:
    """Return the name of a body, its width and height (2,) [m], stiffness and density."""
    material = body.get("material")
    numbers = material if isinstance(material, Mapping) else {}
    words = [" × ".join(write_number(float(size)) for size in sizes) + " m"]
    E = numbers.get("E")
    if isinstance(E, int | float) and E > 0.0:
        factor, unit = scale(float(E), "Pa")
        words.append(f"E = {write_number(factor * E)} {unit}")
    rho = numbers.get("rho")
    if isinstance(rho, int | float):
        words.append(f"{write_number(float(rho))} kg/m³")
    name = str(body.get("name", "body"))
    return f"{name}: {', '.join(words)}"


def _name_supports(
    axis: Any, supports: Sequence[Mapping[str, Any]], d: int
) -> dict[str, tuple[str, Any]]:
    """Add the supports to the legend, by lines without points; return the look of each group."""
    looks: dict[str, tuple[str, Any]] = {}
    nowhere = np.full((max(d, 2), 1), np.nan)
    for k, support in enumerate(supports):
        colour, dash = HOLDS[k % len(HOLDS)]
        components = ", ".join(support["components"])
        label = f"{support['kind']} {components}: {', '.join(support['groups'])}"
        axis.plot(*nowhere, lw=3.0, color=colour, ls=dash, label=escape_dollars(label))
        looks |= dict.fromkeys(support["groups"], (colour, dash))
    return looks


def _draw_outline(axis: Any, outline: Any, holds: Mapping[str, tuple[str, Any]], d: int) -> None:
    """Draw the lines of the model, those of groups that hold it thick."""
    for part in outline:
        lines = _read_points(part["lines"], d).reshape(-1, 2, max(d, 2))
        if part["group"] not in holds:
            add_polygons(axis, lines, edgecolors="0.25", linewidths=0.8)
            continue
        colour, dash = holds[part["group"]]
        chains: Sequence[Array] = list(lines)
        if d == 2:  # in one piece, or dashes would begin anew at each facet
            chains = chain_border(lines.reshape(-1, 4)).chains
        for chain in chains:
            axis.plot(*chain.T, color=colour, ls=dash, lw=3.0, zorder=2.5)


def _draw_contact(axis: Any, part: Mapping[str, Any], d: int, colour: str, marker: str) -> None:
    """Draw the points of a part of the contact, and mark its nodes of other kinds."""
    axis.plot(
        *_read_points(part["places"], d).T,
        label=escape_dollars(f"contact: {part['name']}"),
        ls="",
        marker=marker,
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


def _draw_loads(labels: Labels, loads: Any, size: float, numbers: ReportNumbers) -> None:
    """Draw the loads in the plane as arrows, with the names of those that are no weights.

    Args:
        labels: of the picture.
        loads: of model.json.
        size: largest one of the model [m].
        numbers: writes the resultants, which stand beside the names.
    """
    arrows = _arrange_arrows(loads, 2, size, numbers)
    for arrow in arrows:
        look = {"arrowstyle": "-|>", "lw": 1.6, "color": "black", "shrinkA": 0, "shrinkB": 0}
        labels.axis.annotate("", arrow.tip, arrow.tail, arrowprops=look, zorder=6)
        labels.reserve(np.array([arrow.tip, arrow.tail]))
    for arrow in arrows:
        if arrow.name:
            labels.write(arrow.name, arrow.tail, arrow.tail - arrow.tip, style="italic")


def _draw_loads_in_space(axis: Any, loads: Any, size: float, numbers: ReportNumbers) -> None:
    """Draw the loads in space as arrows, with the names of those that are no weights.

    Args:
        axis: of the picture.
        loads: of model.json.
        size: largest one of the model [m].
        numbers: writes the resultants, which stand beside the names.
    """
    for arrow in _arrange_arrows(loads, 3, size, numbers):
        along = arrow.tip - arrow.tail
        axis.quiver(*arrow.tail, *along, color="black", lw=1.6, arrow_length_ratio=0.3)
        axis.text(*arrow.tail, arrow.name, fontsize=7, style="italic", ha="right", va="bottom")


@dataclass(frozen=True)
class _Arrow:
    """Hold the arrow of a load.

    Attributes:
        name: with the resultant; "" of a weight.
        tail: (d,) [m].
        tip: (d,) [m].
    """

    name: str
    tail: Array
    tip: Array


def _arrange_arrows(loads: Any, d: int, size: float, numbers: ReportNumbers) -> list[_Arrow]:
    """Return an arrow for each load that has a resultant and a point: it ends at this point.

    That of a weight begins there, in the middle of its body.

    Args:
        loads: of model.json.
        d: dimension of the model.
        size: largest one of the model [m].
        numbers: writes the resultants.
    """
    drawn = list(_list_loads(loads, d))
    most = max((float(np.linalg.norm(force)) for *_, force in drawn), default=0.0)
    arrows = []
    for name, is_weight, point, force in drawn:
        length = float(np.linalg.norm(force))
        share = LEAST_ARROW + (1.0 - LEAST_ARROW) * length / most
        along = ARROW * size * share * force / length
        if is_weight:
            arrows.append(_Arrow("", point, point + along))
            continue
        label = escape_dollars(f"{name}: {numbers.write(length, '', 'N')}")
        arrows.append(_Arrow(label, point - along, point))
    return arrows


def _list_loads(loads: Any, d: int) -> Iterator[tuple[str, bool, Array, Array]]:
    """Yield (name, whether it is a weight, point, force), (d,) each, of loads that have both."""
    for load in loads if isinstance(loads, list | tuple) else ():
        if not isinstance(load, Mapping):
            continue
        force = load.get("force") or load.get("resultant")
        point = load.get("point")
        if force is None or point is None:
            continue  # a couple, or what acts on no mesh
        vector = np.array(force, dtype=float)
        place = np.array(point, dtype=float)
        if vector.shape == place.shape == (d,) and np.any(vector) and np.all(np.isfinite(vector)):
            name = str(load.get("name", load.get("kind", "load")))
            yield name, load.get("kind") == "weight", place, vector


def _write_names(
    labels: Labels, model: Mapping[str, Any], holds: Mapping[str, tuple[str, Any]], d: int
) -> None:
    """Write the names of bodies, supports and parts of the contact where they are."""
    outline = model["outline"]
    lines = [_read_points(part["lines"], d) for part in outline]
    places = [_read_points(part["places"], d) for part in model["contact"]]
    for points in places:
        if len(points):
            labels.reserve(points)

    # Bodies first: a name that fits into its body has no other place.
    bodies = model.get("bodies") or ()
    for number, border in _list_borders(outline) if d == 2 else ():
        if number < len(bodies):
            _write_inside(labels, escape_dollars(str(bodies[number].get("name", ""))), border)

    # Names of supports stand outside of the model, those of faces on the sides to which these lie
    # from the middle of all of them.
    middle = _find_middle(np.concatenate(lines))
    for part, points in zip(outline, lines, strict=True):
        if part["group"] in holds and len(points):
            colour, _ = holds[part["group"]]
            _write_beside(labels, part["group"], points, middle, colour)
    middle = _find_middle(np.concatenate(places)) if places else middle
    for k, (part, points) in enumerate(zip(model["contact"], places, strict=True)):
        if len(points):
            colour, _ = DOTS[k % len(DOTS)]
            _write_beside(labels, part["name"], points, middle, colour)


def _write_names_in_space(axis: Any, model: Mapping[str, Any]) -> None:
    """Write the names of bodies in the middle of their boxes, those of faces beside them."""
    boxes = [part for part in model["outline"] if not part["group"]]
    for body, part in zip(model.get("bodies") or (), boxes, strict=False):
        middle = _find_middle(_read_points(part["lines"], 3))
        name = escape_dollars(str(body.get("name", "")))
        axis.text(*middle, name, fontsize=8, ha="center", va="bottom")
    for k, part in enumerate(model["contact"]):
        points = _read_points(part["places"], 3)
        if len(points):
            colour, _ = DOTS[k % len(DOTS)]
            axis.text(*points[-1], escape_dollars(str(part["name"])), fontsize=7, color=colour)


def _write_inside(labels: Labels, name: str, border: Border) -> None:
    """Write the name of a body in a wide place, or beside it with a line to that place."""
    place, clear = border.find_middle()
    if clear * labels.inches >= 0.5 * LETTER * len(name):
        half = np.array([0.5 * LETTER * len(name), LETTER]) / labels.inches
        labels.reserve(np.array([place - half, place + half]))
        look = {"fontsize": 8, "fontweight": "bold", "ha": "center", "va": "center"}
        labels.axis.text(*place, name, zorder=7, **look)
        return
    line = {"arrowstyle": "-", "lw": 0.6, "color": "0.3", "shrinkA": 0, "shrinkB": 0}
    labels.write(name, place, LEADER, size=8, fontweight="bold", arrowprops=line)


def _write_beside(labels: Labels, name: str, points: Array, centre: Array, colour: str) -> None:
    """Write the name of a line of points beside its middle, away from a centre."""
    from matplotlib.colors import to_rgb

    extent = np.ptp(points, axis=0)
    middle = points[int(np.linalg.norm(points - points.mean(axis=0), axis=1).argmin())]
    across = int(extent[1] <= extent[0])  # a flat line has its name above or below
    away = np.zeros(2)
    away[across] = 1.0 if middle[across] > centre[across] else -1.0
    dark = INK * np.array(to_rgb(colour))
    labels.write(escape_dollars(name), middle, away, color=tuple(dark))


def _find_middle(points: Array) -> Array:
    """Return the middle (d,) of the box round points; zeros without any."""
    if not len(points):
        return np.zeros(points.shape[1])
    return np.asarray(0.5 * (points.min(axis=0) + points.max(axis=0)))


def _write_size(labels: Labels, low: Array, high: Array, beyond: float) -> None:
    """Draw the width and the height of a model in the plane as lines with arrows and numbers."""
    width, height = high - low
    below = low[1] - beyond
    left = low[0] - beyond
    _write_length(labels, np.array([low[0], below]), np.array([high[0], below]), float(width))
    if height > 0.0:
        _write_length(labels, np.array([left, low[1]]), np.array([left, high[1]]), float(height))


def _write_length(labels: Labels, first: Array, last: Array, length: float) -> None:
    """Draw a line with arrows at both ends, and its length in its middle."""
    look = {"arrowstyle": "<->", "lw": 0.8, "color": "black", "shrinkA": 0, "shrinkB": 0}
    labels.axis.annotate("", first, last, arrowprops=look)
    labels.axis.text(
        *_find_middle(np.array([first, last])),
        f"{write_number(length)} m",
        rotation=90.0 if first[0] == last[0] else 0.0,
        fontsize=9,
        ha="center",
        va="center",
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
    )
    # with the height of its number
    half = 0.1 / labels.inches
    labels.reserve(np.array([first - half, last + half]))


def _read_points(values: Any, d: int) -> Array:
    """Return points (k, d); those on a line get a second coordinate, zero."""
    return np.pad(np.reshape(values, (-1, d)), ((0, 0), (0, max(2 - d, 0))))
