"""Figures fit for print: legends off titles and curves, curves told apart in grey, one quantity an
axis, structures large, names that do not cover each other."""

from __future__ import annotations

from itertools import combinations, pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("matplotlib")
from matplotlib import colormaps
from matplotlib.colors import LinearSegmentedColormap, to_rgb
from matplotlib.figure import Figure
from matplotlib.text import Text
from mpl_toolkits.mplot3d.art3d import Line3DCollection

from vi_contact.practice.plots.bodies import Scene
from vi_contact.practice.plots.borders import chain_border
from vi_contact.practice.plots.charts import Chart, Line, chart_histories, draw_chart
from vi_contact.practice.plots.deformed import StoredFrames
from vi_contact.practice.plots.faces import PULLS, STATES
from vi_contact.practice.plots.histories import LEDGER, LOOKS
from vi_contact.practice.plots.maps import list_maps, name_faces
from vi_contact.practice.plots.report_words import CHARTS
from vi_contact.practice.plots.sketch import sketch
from vi_contact.practice.plots.studies import DemandPanel, plot_ida
from vi_contact.run.files.reading import ContactGeometry, RunFolder

pytestmark = pytest.mark.serial
T = np.linspace(0.0, 2.0, 81)
GREY = np.array([0.299, 0.587, 0.114])  # brightness of red, green and blue


def chart(names: list[str], title: str = "thrust") -> Chart:
    lines = [Line(name, T, np.sin(T + k)) for k, name in enumerate(names)]
    return Chart(title, "time [s]", "[kN]", tuple(lines))


def box(artist: Any) -> Any:
    return artist.get_window_extent()


def find_text(figure: Any, start: str) -> Any:
    (found,) = (one for one in figure.findobj(Text) if one.get_text().startswith(start))
    return found


def overlaps(one: Any, other: Any) -> bool:
    """Whether two boxes share more than a hair."""
    wide = min(one.x1, other.x1) - max(one.x0, other.x0)
    high = min(one.y1, other.y1) - max(one.y0, other.y0)
    return bool(wide > 0.5 and high > 0.5)


@pytest.mark.parametrize("layout", [None, "constrained"])
@pytest.mark.parametrize("count", [1, 4, 8])
def test_a_legend_is_between_title_and_curves(layout: str | None, count: int) -> None:
    """Also where it has several rows, in an axis as small as those of a page; a name and a title
    that are wider than the axis are cut."""
    names = [f"pressure_high_part_{k}" for k in range(count)]
    names[0] = "opening_of_a_face_with_a_name_that_is_longer_than_any_page_is_wide_by_far"
    title = "moment: " + ", ".join(names)
    figure = Figure(figsize=(3.5, 2.4), layout=layout)
    axis = figure.add_axes((0.15, 0.2, 0.8, 0.7)) if layout is None else figure.add_subplot()
    draw_chart(axis, chart(names, title))
    figure.draw_without_rendering()
    legend = box(axis.get_legend())
    above = find_text(figure, "moment")
    assert not overlaps(legend, box(axis)) and not overlaps(legend, box(above))
    assert box(above).y0 >= legend.y1 - 0.5 and box(above).y1 <= figure.bbox.y1 + 0.5
    assert legend.x1 <= figure.bbox.x1 and box(above).x1 <= figure.bbox.x1
    assert len(axis.get_legend().get_texts()) == count and above.get_text().endswith("…")


def test_curves_of_an_axis_differ_by_dash_or_marker() -> None:
    """Ten curves of a chart, and the terms of the ledger, without any colour; a smooth curve and
    the raw one behind it by their brightness."""
    axis = Figure().add_subplot()
    draw_chart(axis, chart([f"N_{k}" for k in range(len(LOOKS))]))
    looks = {(line.get_linestyle(), line.get_marker()) for line in axis.lines}
    assert len(looks) == len(LOOKS) == 10
    assert len({style for *_, style in LEDGER}) == len(LEDGER)
    axis = Figure().add_subplot()
    raw = Line("raw", T, np.cos(T), pale=True)
    draw_chart(axis, Chart("a", "t", "[g]", (Line("low", T, np.sin(T)), raw)))
    smooth, behind = (GREY @ to_rgb(line.get_color()) for line in axis.lines)
    assert behind - smooth > 0.4


def test_colours_get_darker_all_the_way() -> None:
    """So that a print in grey has the order of the numbers; states are far apart in grey."""
    maps = [colormaps[name] for name in ("YlGnBu", "YlOrRd", "magma_r", "Blues")]
    for colours in (*maps, LinearSegmentedColormap.from_list("pulls", PULLS)):
        greys = colours(np.linspace(0.0, 1.0, 65))[:, :3] @ GREY
        assert np.all(np.diff(greys) < 2e-3) and greys[0] - greys[-1] > 0.6, colours.name
    greys = np.sort([GREY @ to_rgb(colour) for _, colour in STATES.values()])
    assert np.all(np.diff(greys) > 0.2)


def run_of(columns: dict[str, tuple[str, float]], **more: Any) -> RunFolder:
    """A run whose columns are waves of a unit and a size."""
    history = {name: size * np.sin(T + k) for k, (name, (_, size)) in enumerate(columns.items())}
    units = {name: (unit, "") for name, (unit, _) in columns.items()}
    return RunFolder(Path(), {"t": T, **history, **more}, units, {}, more.get("contact"))


def test_an_axis_has_one_quantity_of_one_size() -> None:
    """Four moments between 3 kN m and 9 MN m stand on three axes, each named; forces and moments,
    and displacements along x and y, do not meet; nothing of all faces together where parts have
    names."""
    moments = {"M_base": 9e6, "M_stem": 2e6, "M_heel": 8e4, "M_end": 3e3}
    columns = {name: ("N m", size) for name, size in moments.items()}
    columns |= {"N_base": ("N", 4e5), "contact_resultant": ("N", 9e5), "sliding_base": ("m", 1e-3)}
    columns |= {"u_x_top": ("m", 1e-2), "u_y_top": ("m", 1e-2), "opening_base": ("m", 1e-4)}
    found = chart_histories(run_of(columns), CHARTS)
    names = {one.title: [line.name for line in one.lines] for one in found}
    assert names == {
        "thrust, normal force": ["N_base"],
        "sliding": ["sliding_base"],
        "opening": ["opening_base"],
        "moment: base, stem": ["M_base", "M_stem"],
        "moment: heel": ["M_heel"],
        "moment: end": ["M_end"],
        "displacement along x": ["u_x_top"],
        "displacement along y": ["u_y_top"],
    }
    for one in found:
        sizes = [np.abs(line.y).max() for line in one.lines]
        assert max(sizes) < 10.0 * min(sizes)
    assert [one.y for one in found if one.title.startswith("moment")] == [
        "[MN m]",
        "[kN m]",
        "[kN m]",
    ]
    run = run_of(columns)
    chosen = chart_histories(run, CHARTS, lambda name, unit, size: (1e-3, f"k{unit}/m"))
    assert chosen[0].y == "[kN/m]"
    assert np.array_equal(chosen[0].lines[0].y, 1e-3 * run.history["N_base"])


def faces_of(points: list[list[float]]) -> tuple[RunFolder, Any]:
    """A run whose contact has these points, and model.json's parts: the first three, the others."""
    places = np.array(points)
    m = len(places)
    contact = ContactGeometry(
        places, np.tile([1.0, 0.0], (m, 1)), np.ones(m), np.zeros(m), np.zeros(m, dtype=bool)
    )
    wave = np.abs(np.sin(T))[:, None] * np.arange(1.0, m + 1.0)
    history = {"t": T, "pressure": 1e3 * wave, "gap": np.zeros((len(T), m))}
    parts = [{"name": "stem", "places": points[:3]}, {"name": "heel", "places": points[3:]}]
    return RunFolder(Path(), history, {}, {}, contact), {"contact": parts}


def test_a_map_has_a_panel_for_each_named_face() -> None:
    """With the coordinate along it; a model that is not the run's names nothing."""
    points = [[0.0, 3.0], [0.0, 2.0], [0.0, 1.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [4.0, 0.0]]
    run, model = faces_of(points)
    assert name_faces(run.contact, model) == {"stem": slice(0, 3), "heel": slice(3, 7)}
    (drawing,) = list_maps(run, model)
    axis = Figure(figsize=(8.0, 3.0)).add_subplot()
    drawing(axis)
    axis.figure.draw_without_rendering()
    panels = [one for one in axis.child_axes if one.get_title(loc="left")]
    assert [one.get_title(loc="left") for one in panels] == ["stem", "heel"]
    assert [one.get_ylabel() for one in panels] == ["y [m]", "x [m]"]
    assert [one.collections[0].get_array().size for one in panels] == [3 * len(T), 4 * len(T)]
    boxes = [one.get_tightbbox() for one in panels]
    assert not overlaps(*boxes)
    moved = [{"name": "stem", "places": [[0.0, 9.0]] * 3}, model["contact"][1]]
    for other in (None, {}, {"contact": 5}, {"contact": [5]}, {"contact": moved}):
        assert name_faces(run.contact, other) == {"": slice(0, 7)}


def lattice(x: Any, y: Any, first: int = 0) -> tuple[Any, Any]:
    """Nodes and quadrilaterals of a grid."""
    points = np.array([[one, other] for other in y for one in x])
    n = len(x)
    corners = [0, 1, n + 1, n]
    cells = [
        [first + row * n + column + corner for corner in corners]
        for row in range(len(y) - 1)
        for column in range(n - 1)
    ]
    return points, np.array(cells)


def scene_of(*grids: tuple[Any, Any]) -> Scene:
    """Bodies, each a grid, at two times; in the second all move to the right by 0.1 m."""
    points = np.zeros((0, 2))
    cells = np.zeros((0, 4), dtype=np.int64)
    for x, y in grids:
        own, quadrilaterals = lattice(x, y, len(points))
        points = np.vstack([points, own])
        cells = np.vstack([cells, quadrilaterals])
    frames = StoredFrames(points, cells, np.zeros(2), ())
    structure = frames.find_structure(1)
    u = np.zeros((2, len(points), 2))
    u[1, :, 0] = 0.1
    outlines, _ = frames.boundary
    return Scene(
        times=np.array([0.0, 1.0]),
        points=points,
        polygons=cells,
        body=frames.bodies,
        u=u,
        stress=np.ones((2, len(cells))),
        magnified=5.0,
        contact=None,
        sides=cells[:0],
        nodes=cells[:0, 0],
        pressure=np.zeros((2, 0)),
        states=np.zeros((2, 0)),
        structure=structure if structure.any() else ~structure,
        outlines=outlines,
    )


def test_pictures_show_the_structure_large() -> None:
    """A block of 2 m x 4 m on ground of 40 m x 10 m: all of it is seen at all times with half its
    size around, drawn moved by 0.5 m; the ground, which owns sides of the box, is not of it."""
    ground = (np.linspace(-20.0, 20.0, 21), np.linspace(-10.0, 0.0, 6))
    scene = scene_of(ground, ([0.0, 1.0, 2.0], [0.0, 2.0, 4.0]))
    assert scene.structure.sum() == 4 and scene.structure[-4:].all() and scene.zoomed
    low, high = scene.window
    assert low == pytest.approx([-1.0, -2.0])
    assert high == pytest.approx([3.5, 4.0 + 0.03 * 40.5])  # with the margin of the whole model
    axis = Figure().add_subplot()
    scene.draw(axis, 0)
    assert axis.get_xlim() == pytest.approx((low[0], high[0]))
    widths = [one.get_linewidths()[0] for one in axis.collections]
    assert widths[0] <= 0.2  # edges of elements

    # Two blocks whose feet and outer sides are those of the box: nothing is ground.
    blocks = scene_of(([0.0, 1.0], [0.0, 4.0]), ([1.5, 2.5], [0.0, 3.0]))
    assert blocks.structure.all() and not blocks.zoomed


def model_of(**more: Any) -> dict[str, Any]:
    """What model.json says of a dam on rock with water in front of it."""
    base = [[float(x), 0.0] for x in range(11)]
    rock = [[-20, -15, 30, -15], [30, -15, 30, 0], [30, 0, -20, 0], [-20, 0, -20, -15]]
    dam = [[0, 0, 10, 0], [10, 0, 2, 20], [2, 20, 0, 20], [0, 20, 0, 0]]
    return {
        "title": "A dam",
        "dimension": 2,
        "bodies": [
            {"name": "dam", "material": {"E": 25e9, "rho": 2400.0}},
            {"name": "rock", "material": {"type": "Own"}},
        ],
        "supports": [
            {"kind": "fixed", "groups": ["rock_bottom"], "components": ["x", "y"]},
            {"kind": "roller, fixed", "groups": ["left_side"], "components": ["x"]},
        ],
        "contact": [{"name": "joint", "places": base}],
        "outline": [
            {"group": "", "lines": rock + dam},
            {"group": "rock_bottom", "lines": rock[:1]},
            {"group": "left_side", "lines": rock[3:]},
            {"group": "", "region": 0, "lines": dam},
            {"group": "", "region": 1, "lines": rock},
        ],
        **more,
    }


def test_a_sketch_has_sizes_names_and_loads() -> None:
    """Names stand outside of each other, the legend outside of the axis; an arrow for each load
    that has a resultant and a point."""
    loads = [
        {"name": "water", "kind": "Pressure", "force": [2e6, 0.0], "point": [0.0, 6.0]},
        {"name": "weight of dam", "kind": "weight", "force": [0.0, -1e7], "point": [3.5, 7.0]},
        {"name": "strain", "kind": "InitialStrain", "force": [], "varies": ""},
    ]
    figure = sketch(model_of(loads=loads))
    figure.draw_without_rendering()
    (axis,) = figure.axes
    texts = [one for one in axis.texts if one.get_text()]
    said = sorted(one.get_text() for one in texts)
    names = ["35 m", "50 m", "dam", "joint", "left_side", "rock", "rock_bottom"]
    assert said == sorted([*names, "water: 2000 kN"])
    for one, other in combinations(texts, 2):
        boxes = [Text.get_window_extent(text) for text in (one, other)]
        assert not overlaps(*boxes), (one.get_text(), other.get_text())
    assert not overlaps(box(axis.get_legend()), box(axis))
    legend = [one.get_text() for one in axis.get_legend().get_texts()]
    assert legend == [
        "dam: 10 × 20 m, E = 25 GPa, 2400 kg/m³",
        "rock: 50 × 15 m",
        "fixed x, y: rock_bottom",
        "roller, fixed x: left_side",
        "contact: joint",
    ]

    def count_arrows(one: Any) -> int:
        return sum(text.arrowprops is not None for text in one.texts if not text.get_text())

    assert count_arrows(axis) == 2 + 2  # two lines with the sizes
    for less in ({}, {"loads": None}, {"loads": [{"name": "odd"}]}):
        assert count_arrows(sketch(model_of(**less)).axes[0]) == 2


def test_loads_in_space_are_arrows_too() -> None:
    """The arrow of a load ends at its point and has its name; that of a weight begins there."""
    corners = [[0, 0, 0], [4, 0, 0], [4, 3, 0], [0, 3, 0]]
    edges = [one + other for one, other in pairwise([*corners, corners[0]])]
    top = [[x, y, 2, u, v, 2] for x, y, _, u, v, _ in edges]
    loads = [
        {"name": "wind", "kind": "Pressure", "force": [3e4, 0.0, 0.0], "point": [0.0, 1.5, 1.0]},
        {"name": "weight", "kind": "weight", "force": [0.0, 0.0, -6e4], "point": [2.0, 1.5, 1.0]},
    ]
    model = {
        "title": "A block",
        "dimension": 3,
        "bodies": [{"name": "block"}],
        "supports": [],
        "contact": [],
        "outline": [{"group": "", "lines": edges + top}],
        "loads": loads,
    }
    (axis,) = sketch(model).axes
    assert {one.get_text() for one in axis.texts} == {"block", "wind: 30 kN", ""}
    arrows = [one for one in axis.collections if isinstance(one, Line3DCollection)][-2:]
    wind, weight = (np.array(one._segments3d[0]) for one in arrows)
    assert wind.max(axis=0) == pytest.approx([0.0, 1.5, 1.0]) and wind[:, 0].min() < 0.0
    # the largest load has the longest arrow, 0.16 of the model
    assert weight.max(axis=0) == pytest.approx([2.0, 1.5, 1.0])
    assert weight.min(axis=0) == pytest.approx([2.0, 1.5, 1.0 - 0.16 * 4.0])


def test_borders_of_bodies() -> None:
    """A square with a hole is filled outside of the hole; a name has room beside it."""
    square = np.array([[0, 0], [9, 0], [9, 4], [0, 4], [0, 0]], dtype=float)
    hole = np.array([[1, 1], [1, 3], [3, 3], [3, 1], [1, 1]], dtype=float)
    lines = [np.hstack([one[:-1], one[1:]]) for one in (square, hole)]
    border = chain_border(np.vstack(lines)[::-1])
    assert sorted(len(chain) for chain in border.chains) == [5, 5]
    place, clear = border.find_middle()
    assert border.path.contains_point(place) and clear > 1.4 and place[0] > 4.0
    areas = [
        path[:, 0] @ np.roll(path[:, 1], -1) - path[:, 1] @ np.roll(path[:, 0], -1)
        for path in border.path.to_polygons()
    ]
    assert sorted(areas) == pytest.approx([-8.0, 72.0])  # twice the areas, a hole is clockwise


def test_names_of_records_stay_off_the_curves(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The legend of an incremental analysis lies in its figure, above the panels."""
    drawn: list[Figure] = []
    monkeypatch.setattr(Figure, "savefig", lambda figure, *_, **__: drawn.append(figure))
    levels = np.arange(1.0, 4.0)
    names = ["RSN 179 Imperial Valley El Centro array 4", "kobe", "loma_prieta_corralitos_090.at2"]
    curves = {name: (levels, levels * (k + 1.0)) for k, name in enumerate(names)}
    panel = DemandPanel("sliding", "m", curves, levels, np.outer(levels, [1.0, 2.0, 3.0]), (2.5,))
    for count in (1, 2):
        plot_ida([panel] * count, tmp_path / "ida.png", intensity="PGA", unit="m/s²")
        figure = drawn[-1]
        figure.draw_without_rendering()
        legend = box(figure.legends[0])
        assert legend.x0 >= 0.0 and legend.x1 <= figure.bbox.x1 and legend.y1 <= figure.bbox.y1
        assert not any(overlaps(legend, axis.get_tightbbox()) for axis in figure.axes)
        looks = {(one.get_linestyle(), one.get_marker()) for one in figure.axes[0].lines}
        assert len(looks) == len(figure.axes[0].lines) == 7
