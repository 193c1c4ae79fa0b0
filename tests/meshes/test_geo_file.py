"""Gmsh scripts meshed on request: what is allowed gives the mesh of Gmsh, all else is refused
before Gmsh sees it."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("gmsh")

from vi_contact.core.errors import InputError
from vi_contact.meshes import GeoFile
from vi_contact.meshes.extract import arrays_of
from vi_contact.meshes.geo_script import rewrite_script
from vi_contact.meshes.gmsh_session import session

pytestmark = pytest.mark.serial
WALL = """// an L-shaped wall /* no comment begins here
H = 6.0; B = 4; t = 0.5; h = 0.4;  /* sizes of
cells; */ DefineConstant[ n = 3 ];
Point(1) = {0, 0, 0, h}; Point(2) = {B, 0, 0, h}; Point(3) = {B, t, 0, h};
Point(4) = {t, t, 0, h}; Point(5) = {t, H, 0, h}; Point(6) = {0, H, 0, h};
corner[] = {};
For i In {1:5}
  Line(i) = {i, i + 1}; corner[] += {i};
EndFor
Line(6) = {6, 1};
Curve Loop(1) = {corner[], 6}; Plane Surface(1) = {1};
Field[1] = Distance; Field[1].CurvesList = {1}; Field[2] = MathEval; Field[2].F = "0.3 + 0.02*y";
Background Field = 2;
Mesh.Algorithm = 6;
If (n > 2)
  Physical Curve("base") = {1};
Else
  Physical Curve("socle à gauche") = {1};
EndIf
Physical Surface("wall") = {1};
"""
BOX = """SetFactory("OpenCASCADE");
Box(1) = {0, 0, 0, 2, 1, 1}; Box(2) = {0, 0, 1, 2, 1, 1};
BooleanFragments{ Volume{1}; Delete; }{ Volume{2}; Delete; }
Physical Volume("low") = {1}; Physical Volume("high") = {2};
Physical Surface("foot") = Surface In BoundingBox {-1, -1, -0.1, 3, 2, 0.1};
"""


def written(folder: Path, text: str, name: str = "wall.geo") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def area(arrays: Any) -> float:
    x = arrays.points[arrays.cells]
    a, b = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]
    return float(0.5 * np.abs(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum())


@pytest.mark.long
def test_a_wall_is_meshed(tmp_path: Path) -> None:
    """Area 4·0.5 + 0.5·5.5 m², and its groups."""
    path = written(tmp_path, WALL)
    arrays = arrays_of(GeoFile(path=path))
    assert area(arrays) == pytest.approx(4.75, rel=1e-12)
    assert list(arrays.cell_groups) == ["wall"] and list(arrays.facet_groups) == ["base"]
    other = arrays_of(GeoFile(path=written(tmp_path, WALL.replace("n = 3", "n = 1"))))
    assert list(other.facet_groups) == ["socle à gauche"]
    assert sorted(one.name for one in tmp_path.iterdir()) == ["wall.geo"]


@pytest.mark.long
def test_bodies_in_space_are_meshed(tmp_path: Path) -> None:
    text = BOX.replace("Surface In BoundingBox {-1, -1, -0.1, 3, 2, 0.1}", "{5}")
    path = written(tmp_path, f"{text}MeshSize{{:}} = 1;")
    arrays = arrays_of(GeoFile(path=path))
    assert list(arrays.cell_groups) == ["low", "high"] and list(arrays.facet_groups) == ["foot"]
    edges = np.diff(arrays.points[arrays.cells], axis=1)
    volume = np.abs(np.linalg.det(edges)) / 6.0
    assert volume[arrays.cell_groups["low"]].sum() == pytest.approx(2.0, rel=1e-10)


SQUARE = """L = 2;
Point(1) = {0, 0, 0, 1}; Point(2) = {L, 0, 0, 1}; Point(3) = {L, 1, 0, 1}; Point(4) = {0, 1, 0, 1};
Line(1) = {1, 2}; Line(2) = {2, 3}; Line(3) = {3, 4}; Line(4) = {4, 1};
Curve Loop(1) = {1:4}; Plane Surface(1) = {1};
Transfinite Surface {1}; EXTRA
Physical Curve("base") = {1}; Physical Surface("body") = {1};
"""
SOLID = """out[] = Extrude {0, 0, 1} { Surface{1}; Layers{2}; EXTRA };
Physical Volume("body") = {out[1]}; Physical Surface("base") = {1};
"""


@pytest.mark.long
@pytest.mark.parametrize("cell", ["triangle", "quadrilateral", "tetrahedron", "hexahedron"])
def test_all_cells_are_divided(tmp_path: Path, cell: str) -> None:
    """C1.2: 2^d times as many cells, 2^(d-1) facets, twice over; the measure of body and base to
    1e-12."""
    boxes = cell in ("quadrilateral", "hexahedron")
    text = SQUARE.replace("EXTRA", "Recombine Surface {1};" if boxes else "")
    if d := 3 if cell in ("tetrahedron", "hexahedron") else 0:
        text = text[: text.index("Physical")] + SOLID.replace(
            "EXTRA", "Recombine;" if boxes else ""
        )
    path = written(tmp_path, text)
    coarse, fine = (arrays_of(GeoFile(path=path, refine=n)) for n in (0, 2))
    d = d or 2
    assert coarse.cell == fine.cell == cell
    assert len(fine.cells) == 4**d * len(coarse.cells) > 0
    assert len(fine.facet_groups["base"]) == 4 ** (d - 1) * len(coarse.facet_groups["base"])
    foot = fine.points[np.unique(fine.facet_groups["base"])]
    assert np.array_equal(foot[:, d - 1], np.zeros(len(foot))) and np.ptp(foot[:, 0]) == 2.0
    corners = {
        "triangle": (0, 1, 2),
        "quadrilateral": (0, 1, 3),
        "tetrahedron": (0, 1, 2, 3),
        "hexahedron": (0, 1, 3, 4),
    }[cell]
    x = fine.points[fine.cells[:, list(corners)]]
    part = {"triangle": 2.0, "tetrahedron": 6.0}.get(cell, 1.0)
    measure = np.abs(np.linalg.det(x[:, 1:] - x[:, :1])).sum() / part
    assert measure == pytest.approx(2.0, rel=1e-12)


FORBIDDEN = {
    "a command": ('SystemCall "touch broken";', "SystemCall"),
    "a command beside": ('NonBlockingSystemCall "touch broken";', "NonBlockingSystemCall"),
    "a command that was declared": ('SystemCall = 1; SystemCall "touch broken";', '"touch broken"'),
    "a file that is read": ('Merge "other.msh";', "Merge"),
    "a file that is included": ('Include "other.geo";', "Include"),
    "the end": ("Exit;", "Exit"),
    "a plugin": ("Plugin(MathEval).Run;", "Plugin"),
    "a macro": ("Macro m SystemCall x; Return", "Macro"),
    "a call": ("Call m;", "Call"),
    "a file of a field": ('Field[1] = Structured; Field[1].FileName = "x";', "Structured"),
    "the name of a file of a field": ('Field[1] = Distance; Field[1].FileName = "x";', "FileName"),
    "a process of a field": ("Field[1] = ExternalProcess;", "ExternalProcess"),
    "a command in a field": (
        'Field[1] = MathEval; Field[1].F = "`touch broken`";',
        '"`touch broken`"',
    ),
    "other options of meshes": ("Mesh.PartitionCreateTopology = 1;", "PartitionCreateTopology"),
    "an attribute": ("H.F = 1;", "."),
    "a text": ('s = "touch broken";', '"touch broken"'),
    "joined texts": ('s = StrCat("a", "b");', "StrCat"),
    "after a comment": ('/* // */ SystemCall "touch broken"; // */', "SystemCall"),
    "a comment in a text": ('Physical Point("/*") = {1}; Merge "x"; // */', "Merge"),
    "an open comment": ("/* SystemCall", "SystemCall"),
    "an open text": ('Physical Point("a\n") = {1};', '"'),
    "a backslash": ("Point\\\n(1) = {0, 0, 0};", "\\"),
    "a backslash in a text": ('Physical Point("a\\") = {1};', '"'),
    "letters that look alike": ("Рoint(1) = {0, 0, 0};", "Р"),
    "an invisible letter": ("Point\u200b(1) = {0, 0, 0};", "\u200b"),
    "NUL": ("Point\0(1) = {0, 0, 0};", "\0"),
    "the shell's quotes": ("x = `id`;", "`"),
    "names made of others": ("H~{1} = 1;", "~"),
}


@pytest.mark.parametrize("what", FORBIDDEN)
def test_all_else_is_refused(tmp_path: Path, what: str) -> None:
    """By its line and word, before Gmsh sees it."""
    text, word = FORBIDDEN[what]
    path = written(tmp_path, f"H = 1;\n{text}\n")
    with pytest.raises(
        InputError, match=r"wall.geo: line 2 has .*only words of geometry"
    ) as caught:
        GeoFile(path=path).build(None)
    assert repr(word)[1:-1].split("'")[0][:8] in str(caught.value)
    assert sorted(one.name for one in tmp_path.iterdir()) == ["wall.geo"]


PLAIN = SQUARE.replace("EXTRA", "")
HABITS = {  # statements that nearly every script has and that change no mesh
    "an option of files": "Mesh.MshFileVersion = 2.2;",
    "an option of the window": "General.Terminal = 1;",
    "a colour": "Mesh.Color.Lines = Black;",
    "a view": "View.Light = 0;",
    "numbers at points": "Geometry.PointNumbers = 1;",
    "a printed line": 'Printf("height %g\\n; {", H);',
    "a line in a file": 'Printf("x") > "broken";',
    "a file that is written": 'Save "broken";',
    "the mesh": "Mesh 2;",
    "coloured things": "Color {1, 2, 3} { Surface{1}; }",
    "a named colour": "Recursive Color Red { Surface{1}; };",
    "hidden things": "Hide { Line{1:2}; }",
    "all is shown": 'Show "*";',
    "a condition": 'If (H > 0) Printf("high"); EndIf',
}


@pytest.mark.parametrize("what", HABITS)
def test_harmless_habits_are_left_out(tmp_path: Path, what: str) -> None:
    """What Gmsh gets is what it gets of the script without them, each word in its line; no file is
    written."""
    plain = rewrite_script(written(tmp_path, "H = 1;\n\n" + PLAIN))
    script = rewrite_script(written(tmp_path, f"H = 1;\n{HABITS[what]}\n" + PLAIN))
    empty = "If ( own_H > 0 ) EndIf" if what == "a condition" else ""
    assert [line.strip() for line in script.text.splitlines()] == [
        empty if row == 1 else line.strip() for row, line in enumerate(plain.text.splitlines())
    ]
    assert plain.left_out == ()
    assert [line for line, _ in script.left_out] == [2]
    assert sorted(one.name for one in tmp_path.iterdir()) == ["wall.geo"]


@pytest.mark.long
def test_a_script_of_habits_has_the_mesh_of_the_script_without(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """A block as public scripts draw it; the log names the lines that were left out."""
    plain = """H = 10; h = 1;
Point(1) = {0,0,0,h}; Point(2) = {6,0,0,h}; Point(3) = {6,H,0,h}; Point(4) = {0,H,0,h};
Line(1) = {1,2}; Line(2) = {2,3}; Line(3) = {3,4}; Line(4) = {4,1};
Line Loop(1) = {1:4}; Plane Surface(1) = {1};
Transfinite Surface {1}; Recombine Surface {1};
Physical Surface("dam", 101) = {1}; Physical Line("base", 201) = {1};
"""
    habits = plain.replace("Surface {1}", 'Surface "*"')
    habits += 'Mesh.MshFileVersion = 2.2;\nPrintf("height %g", H);\nMesh 2;\nSave "dam.msh";\n'
    wanted = arrays_of(GeoFile(path=written(tmp_path, plain, "plain.geo")))
    made = arrays_of(GeoFile(path=written(tmp_path, habits, "habits.geo")))
    assert np.array_equal(made.points, wanted.points) and np.array_equal(made.cells, wanted.cells)
    assert made.cell == "quadrilateral" and list(made.facet_groups) == ["base"]
    (said,) = (one.getMessage() for one in caplog.records if "left out" in one.getMessage())
    assert said.endswith("line 7 Mesh.MshFileVersion, line 8 Printf, line 9 Mesh 2, line 10 Save")
    assert not (tmp_path / "dam.msh").exists()


@pytest.mark.long
def test_a_surface_that_cannot_be_transfinite_is_meshed_freely(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    """As Gmsh's own command does, with a warning that names the surface. Area of the trapezium: (6
    + 1)/2 10 m²."""
    text = PLAIN.replace("{L, 1, 0, 1}", "{1, 10, 0, 1}").replace("{0, 1, 0, 1}", "{0, 10, 0, 1}")
    text = text.replace("L = 2", "L = 6").replace(
        "Transfinite Surface {1}", 'Transfinite Surface "*"'
    )
    arrays = arrays_of(GeoFile(path=written(tmp_path, text)))
    assert area(arrays) == pytest.approx(35.0, rel=1e-12)
    said = [one.getMessage() for one in caplog.records]
    assert any("Surface 1 is meshed freely, not transfinite: " in one for one in said)


@pytest.mark.parametrize(
    "text",
    [
        "Mesh.ScalingFactor = 0.001;",
        "Geometry.Tolerance = 1;",
        "RefineMesh;",
        "SetOrder 2;",
        'Merge "a"; Printf("b");',
        'Printf("never closed"',
        "Color Red { Surface{1}; ",
        'x = Printf("a");',
    ],
)
def test_what_may_change_a_mesh_is_no_habit(tmp_path: Path, text: str) -> None:
    with pytest.raises(InputError, match=r"wall.geo: line 2 has .*only words of geometry"):
        rewrite_script(written(tmp_path, f"H = 1;\n{text}\n"))


def test_all_that_is_refused_is_told_at_once(tmp_path: Path) -> None:
    path = written(
        tmp_path, 'H = 1;\nMerge "a";\nPoint(1) = {0, 0, 0, H};\nPlugin(Cut).Run; Exit;\n'
    )
    with pytest.raises(InputError) as caught:
        rewrite_script(path)
    said = str(caught.value)
    assert "line 2 has 'Merge', line 4 has 'Plugin', line 4 has 'Exit', and only words" in said
    assert "leave them out" in said


def test_parameters_of_a_window_are_left_out(tmp_path: Path) -> None:
    """DefineConstant with a name, bounds and choices gives the mesh of its value."""
    constant = (
        'DefineConstant[ L = {2, Name "Sizes/L = 3", Min 0,\nMax {4}}, n = 3, w[] = {1, 2} ];'
    )
    script = rewrite_script(written(tmp_path, constant + PLAIN[6:]))
    head = script.text.split("Point")[0]
    assert (
        " ".join(head.split())
        == "DefineConstant [ own_L = 2 , own_n = 3 , own_w [ ] = { 1 , 2 } ] ;"
    )
    assert script.text.count("\n") == (constant + PLAIN[6:]).count("\n") + 1


@pytest.mark.long
def test_numbers_are_given_to_what_a_script_does_not_set(tmp_path: Path) -> None:
    """As -setnumber of Gmsh: for a name that is not set, and in the place of a DefineConstant.
    Lengths to 1e-12."""
    free = written(tmp_path, PLAIN.removeprefix("L = 2;"), "free.geo")
    default = written(
        tmp_path, "DefineConstant[ L = {2, Min 0} ];" + free.read_text(), "default.geo"
    )
    for path in (free, default):
        points = arrays_of(GeoFile(path=path, numbers={"L": 5})).points
        assert np.ptp(points[:, 0]) == pytest.approx(5.0, rel=1e-12)
    assert np.ptp(arrays_of(GeoFile(path=default)).points[:, 0]) == pytest.approx(2.0, rel=1e-12)
    with pytest.raises(
        InputError,
        match=r"line 2 uses 'L', which the script does not set: set it there, or give "
        r"numbers = \{L = …\}",
    ):
        rewrite_script(free)


@pytest.mark.parametrize(
    ("numbers", "said"),
    [
        (
            {"L": 5.0},
            r"numbers gives 'L', but line 1 sets it in any case: write DefineConstant\[ L = … \] "
            r"there",
        ),
        ({"M": 5.0}, "numbers gives 'M', which the script does not use: leave it out"),
        ({"L": float("nan")}, "numbers of 'L' is nan; give a finite number"),
        ({"L": "5"}, "numbers of 'L' is '5'; give a finite number"),
        ({"SystemCall x": 5.0}, "numbers has the name 'SystemCall x'; give a name of the script"),
        ([1.0], r"numbers is \[1.0\]; give names and their values"),
    ],
)
def test_numbers_without_effect_are_refused(tmp_path: Path, numbers: Any, said: str) -> None:
    with pytest.raises(InputError, match=said):
        GeoFile(path=written(tmp_path, PLAIN), numbers=numbers).build(None)


def test_gmsh_gets_no_word_but_those_of_the_lists(tmp_path: Path) -> None:
    """A script's own names are never commands, and line 7 stays line 7."""
    text = rewrite_script(written(tmp_path, WALL + "Exit = 3; Merge = Exit;\n")).text
    assert "own_Exit = 3 ; own_Merge = own_Exit ;" in text
    assert [line.split()[0] for line in text.split("\n")[6:9]] == ["For", "Line", "EndFor"]


@pytest.mark.slow
def test_what_does_not_end_is_ended(tmp_path: Path) -> None:
    """A loop without end, and a list that no memory holds, whichever ends first."""
    path = written(
        tmp_path, "For i In {1:1000000000}\nFor j In {1:1000000000}\nx = j;\nEndFor\nEndFor\n"
    )
    with pytest.raises(InputError, match="did not end within 0.5 s"):
        arrays_of(GeoFile(path=path, time_limit=0.5))
    path = written(tmp_path, "x[] = {1:1000000000000};\n")
    with pytest.raises(InputError, match="did not end within|cannot mesh it"):
        arrays_of(GeoFile(path=path, time_limit=0.8))


@pytest.mark.long
def test_other_mistakes_are_told(tmp_path: Path) -> None:
    path = written(tmp_path, WALL)
    for given, said in (
        ({"refine": -1}, "refine is -1; give a whole number of at least 0"),
        ({"refine": 30}, "refine is 30; give a whole number of at least 0 and at most 8"),
        ({"time_limit": 0.0}, "time_limit is 0.0; give a finite number above zero"),
    ):
        with pytest.raises(InputError, match=said):
            GeoFile(path=path, **given).build(None)
    with pytest.raises(InputError, match="cannot be read .*No such file"):
        GeoFile(path=tmp_path / "missing.geo").build(None)
    broken = written(tmp_path, WALL.replace("{B, 0, 0, h}", "{B, 0, 0, h"))
    with pytest.raises(InputError, match=r"wall.geo: Gmsh cannot mesh it: .*line 4"):
        arrays_of(GeoFile(path=broken))
    stopped = "it stopped at a formula or size: check Field"
    # newer versions name it
    for wrong, said in (
        (
            'Field[1] = MathEval; Field[1].F = "nofun(x)"; Background Field = 1;',
            f"{stopped}|invalid",
        ),
        ("Mesh.MeshSizeMax = -1;", f"{stopped}|Wrong mesh element size"),
    ):
        with pytest.raises(InputError, match=f"Gmsh cannot mesh it: .*({said})"):
            arrays_of(GeoFile(path=written(tmp_path, SQUARE.replace("EXTRA", wrong))))
    with pytest.raises(
        InputError, match="no cells in a group: name the body by a Physical Surface"
    ):
        arrays_of(GeoFile(path=written(tmp_path, SQUARE[: SQUARE.index("EXTRA")])))
    with pytest.raises(InputError, match="no cells"):
        arrays_of(GeoFile(path=written(tmp_path, "Point(1) = {0, 0, 0};")))


def curved_area(arrays: Any) -> float:
    """Sum ∮ x dy of triangles with mid-points, exact by Simpson's rule."""
    total = 0.0
    for i, j, k in ((0, 1, 3), (1, 2, 4), (2, 0, 5)):
        a, b, m = (arrays.points[arrays.cells[:, one]] for one in (i, j, k))
        slopes = 4 * m - 3 * a - b, 4 * (b - a), a - 4 * m + 3 * b
        total += (
            sum(float(x[:, 0] @ slope[:, 1]) for x, slope in zip((a, m, b), slopes, strict=True))
            / 6.0
        )
    return total


@pytest.mark.long
def test_divided_cells_of_second_order_stay_curved(tmp_path: Path) -> None:
    """A disk of radius 1 m: the area is wrong by O(h⁴), a 16th after a division; 8 leaves room for
    the first mesh."""
    disk = """SetFactory("OpenCASCADE"); Disk(1) = {0, 0, 0, 1};
    Mesh.MeshSizeMax = 0.8; Mesh.MeshSizeMin = 0.8;
    Mesh.ElementOrder = 2; Physical Surface("disk") = {1};"""
    path = written(tmp_path, disk)
    coarse, fine = (arrays_of(GeoFile(path=path, refine=n)) for n in (0, 1))
    assert coarse.cells.shape[1] == fine.cells.shape[1] == 6 and len(fine.cells) == 4 * len(
        coarse.cells
    )
    wrong = [abs(curved_area(one) - np.pi) for one in (coarse, fine)]
    assert wrong[1] < wrong[0] / 8.0 < 1e-2


def test_what_is_no_script_is_refused_at_once(tmp_path: Path) -> None:
    """Comments that nothing closes, however many, and what is no file: a pipe would be waited
    for."""
    path = written(tmp_path, "/* " * 100_000)
    start = time.process_time()
    with pytest.raises(InputError, match="line 1 has '/"):
        rewrite_script(path)
    assert time.process_time() - start < 1.0
    os.mkfifo(tmp_path / "pipe.geo")
    with pytest.raises(InputError, match="cannot be read .it is no file"):
        rewrite_script(tmp_path / "pipe.geo")


def test_gmsh_ends_with_the_process_that_began_it(tmp_path: Path) -> None:
    path = written(
        tmp_path, "For i In {1:1000000000}\nFor j In {1:1000000000}\nx = j;\nEndFor\nEndFor\n"
    )
    script = f"GeoFile(path={str(path)!r}, time_limit={3.0 * PATIENCE})"
    code = f"from vi_contact.meshes import GeoFile; {script}.build(None)"
    parent = subprocess.Popen(
        [sys.executable, "-c", code], env=os.environ | {"PYTHONPATH": ":".join(sys.path)}
    )
    try:
        children = Path(f"/proc/{parent.pid}/task/{parent.pid}/children")
        waited(lambda: bool(children.read_text().split()))
        child = Path("/proc", children.read_text().split()[0])
        waited(lambda: "libgmsh" in (child / "maps").read_text())
    finally:
        parent.terminate()
        parent.wait()
    waited(lambda: ended(child))


PATIENCE = 120.0  # s, of which an idle machine needs two


def waited(true: Callable[[], bool]) -> None:
    """Wait until it is true."""
    end = time.monotonic() + PATIENCE
    while not true():
        assert time.monotonic() < end
        time.sleep(0.05)


def ended(process: Path) -> bool:
    """Whether a process of /proc is over; it may be collected while this looks."""
    try:
        return ") Z " in (process / "stat").read_text()
    except OSError:
        return True


LOOPS = {  # the points that they make
    "For i In {1:3} Point(i) = {i, 0, 0}; EndFor": 3,
    "For i In {1:3}\n Point(i) = {i, 0, 0}; EndFor Point(9) = {9, 0, 0};": 4,
    "For i In {0:1} For j In {1:2} Point(10*i + j) = {i, j, 0}; EndFor EndFor Point(9) = {9, 0, "
    "0};": 5,
    "n[] = {1, 3}; For i In {n[0]:n[1]} /* a\n b */ Point(i) = {i, 0, 0}; EndFor // x": 3,
    "For (1:3) If (1 > 0) Point(newp) = {0, 0, 0}; EndIf EndFor If (0) Point(8) = {1, 0, 0}; "
    "EndIf": 3,
    "// lines of old\rFor i In {1:3}\r Point(i) = {i, 0, 0};\rEndFor\r": 3,
    "// and of others\r\nFor i In {1:3}\r\n Point(i) = {i, 0, 0};\r\nEndFor\r\n": 3,
    "\ufeffFor i In {1:3}\n Point(i) = {i, 0, 0};\nEndFor": 3,
}


@pytest.mark.parametrize("text", LOOPS, ids=range(len(LOOPS)))
def test_loops_go_round_however_lines_end(tmp_path: Path, text: str) -> None:
    path = tmp_path / "loop.geo"
    path.write_bytes(text.encode())
    made = written(tmp_path, rewrite_script(path).text)
    with session() as gmsh:
        gmsh.merge(str(made))
        gmsh.model.geo.synchronize()
        assert len(gmsh.model.getEntities(0)) == LOOPS[text]


@pytest.mark.long
@pytest.mark.parametrize(
    ("groups", "said"),
    [
        ('Physical Curve("base") = {1, 88};', "Unknown .* 88 in the group base"),
        ('Physical Curve("50 % (left)") =\n {-1, 7:9};', "Unknown .* 7 in the group 50"),
        (
            'n[] = {2}; Physical Curve("base") = {1};\nPhysical Curve("base") += {n[], 5};',
            "Unknown .* 5 in the group base",
        ),
        ('n[] = {}; Physical Curve("none") = n[];', "it is empty, the group none"),
    ],
    ids=range(4),
)
def test_groups_that_gmsh_would_cut_are_refused(tmp_path: Path, groups: str, said: str) -> None:
    """It leaves out what is not there, and whole groups."""
    path = written(
        tmp_path, SQUARE.replace("EXTRA", "").replace('Physical Curve("base") = {1};', groups)
    )
    with pytest.raises(InputError, match=said):
        arrays_of(GeoFile(path=path))


@pytest.mark.long
def test_groups_are_what_their_lists_say(tmp_path: Path) -> None:
    """All kinds of lists; groups of branches that are not taken are none; in loops they grow."""
    groups = """Physical Curve("all") = Curve{:};
    Physical Curve("around") = Boundary{ Surface{1}; };
    Physical Curve("turned") = {-1, 2}; If (0) Physical Curve("no") = {99}; EndIf
    Physical Curve("two") = {1};
    For i In {2:2} Physical Curve("two") += {i}; EndFor Physical Curve("low", 70) =
    1; Physical Curve(9) = {3};"""
    path = written(
        tmp_path, SQUARE.replace("EXTRA", "").replace('Physical Curve("base") = {1};', groups)
    )
    found = arrays_of(GeoFile(path=path)).facet_groups
    n = {1: 2, 2: 1, 3: 2, 4: 1}  # facets of the curves
    counts = {
        "all": (1, 2, 3, 4),
        "around": (1, 2, 3, 4),
        "turned": (1, 2),
        "two": (1, 2),
        "low": (1,),
        "9": (3,),
    }
    assert {name: len(rows) for name, rows in found.items()} == {
        name: sum(n[curve] for curve in curves) for name, curves in counts.items()
    }
