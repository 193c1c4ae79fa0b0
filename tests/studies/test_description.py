"""What ``run --check`` tells of a model: exact masses and periods, on any number of ranks; and what
it refuses."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

import vi_contact as vc
from vi_contact.practice.cli.entry import main
from vi_contact.practice.plots.sketch import sketch
from vi_contact.practice.studies import read_case
from vi_contact.practice.studies.cases.description.doubts import find_warnings
from vi_contact.practice.studies.cases.description.model import describe
from vi_contact.practice.studies.cases.description.words import put_in_words

COMM = MPI.COMM_WORLD
HEIGHT, CELLS, E, RHO = 4.0, 16, 1.8e9, 2000.0
BLOCKS = """
title = "Two blocks that carry axial waves"
[mesh]
type = "TwoBlocks"
lower = {lengths = [0.25, 2.0], divisions = [1, 8]}
upper = {lengths = [0.25, 2.0], divisions = [1, 8]}
[material]
lower = {E = 1.8e9, nu = 0.0, rho = 2000.0}
upper = {E = 1.8e9, nu = 0.0, rho = 2000.0}
[system]
fixed = "lower_bottom"
prescribed = [{facets = "lower_left", components = [0]}, {facets = "lower_right", components = [0]}]
dashpots = [{facets = "upper_top", normal = 0.1}]
[gravity]
[[contact]]
type = "contact_pair"
facets1 = "upper_bottom"
facets2 = "lower_top"
[friction]
type = "Coulomb"
mu = 0.5
[[excitation]]
type = "GroundMotion"
direction = [0.0, 1.0]
scale = 2.0
record = {type = "synthetic", spectrum = {s0 = 0.01}, duration = 1.0, dt = 0.01, seed = 3}
[run]
dt = 0.002
steps = 3
"""


def written(folder: Path, text: str = BLOCKS) -> Path:
    path = folder / "blocks.toml"
    if COMM.rank == 0:
        path.write_text(text, encoding="utf-8")
    COMM.Barrier()
    return path


def described(path: Path, comm: Any = COMM, *settings: str) -> dict[str, Any]:
    return describe(read_case(path, settings), comm)


def axial(n: int, height: float, cells: int) -> float:
    """The n-th period of a column of linear elements with consistent mass, clamped at its foot:
    closed form."""
    h, c = height / cells, np.sqrt(E / RHO)
    kh = (2 * n - 1) * np.pi / (2.0 * height) * h
    return float(2.0 * np.pi / np.sqrt(6.0 * c**2 / h**2 * (1.0 - np.cos(kh)) / (2.0 + np.cos(kh))))


@pytest.mark.long
@pytest.mark.serial
def test_numbers_of_two_blocks(shared_tmp: Path) -> None:
    """V11.1: masses, sizes, wave lengths; periods of axial waves in both blocks as one where they
    touch, in the lower one with a gap. Held sideways they have no other modes as low; what rubs
    sticks, what slides is free to."""
    sides = ("lower_left", "lower_right", "upper_left", "upper_right")
    held = ",".join(f"{{facets='{one}', components=[0]}}" for one in sides)
    free, path = described(written(shared_tmp)), shared_tmp / "blocks.toml"
    assert free["mass"] == pytest.approx(HEIGHT * 0.25 * RHO, rel=1e-9)
    assert [(one["name"], one["cells"]) for one in free["bodies"]] == [("lower", 8), ("upper", 8)]
    assert free["bodies"][0]["material"] == {"type": "LinearElastic", "E": E, "nu": 0.0, "rho": RHO}
    assert {"name": "upper_left", "kind": "facets"} in free["groups"] and len(free["groups"]) == 10
    assert [(one["kind"], one["groups"], one["components"]) for one in free["supports"]] == [
        ("fixed", ["lower_bottom"], ["x", "y"]),
        ("roller, fixed", ["lower_left"], ["x"]),
        ("roller, fixed", ["lower_right"], ["x"]),
        ("dashpots", ["upper_top"], ["x", "y"]),
    ]
    (contact,) = free["contact"]
    assert contact["name"] == "upper_bottom on lower_top" and contact["points"] == 2
    assert contact["size"] == pytest.approx(0.25) and contact["friction"] == "Coulomb(mu=0.5)"
    c_s = np.sqrt(0.5 * E / RHO)
    for wave in free["waves"]:
        assert [wave[key] for key in ("c_s", "h", "f_max", "dt_ratio")] == pytest.approx(
            [c_s, 0.25, c_s / 2.0, 0.002 * c_s / 0.25], rel=1e-9
        )
    assert free["run"] == {"dt": 0.002, "t_end": pytest.approx(0.006), "steps": 3}
    (record,) = free["records"]
    assert (
        record["file"] == "synthetic, seed 3"
        and record["scale"] == 2.0
        and 1.0 < record["f_95"] < 50.0
    )
    # it may slide
    assert free["rigid_motions"] == 0 and described(path, COMM, "friction=")["rigid_motions"] == 1
    closed = described(path, COMM, f"system.prescribed=[{held}]")
    assert closed["periods"] == pytest.approx(
        [axial(n, HEIGHT, CELLS) for n in (1, 2, 3)], rel=1e-8
    )
    gap = described(path, COMM, f"system.prescribed=[{held}]", "mesh.gap=0.1")
    assert gap["rigid_motions"] == 1
    assert gap["periods"][0] == pytest.approx(axial(1, HEIGHT / 2, CELLS // 2), rel=1e-8)
    across = described(
        path, COMM, f"system.prescribed=[{held}]", "mesh.gap=0.1", "contact.1.roller=true"
    )
    assert (
        across["periods"] == pytest.approx(closed["periods"], rel=1e-8)
        and across["rigid_motions"] == 0
    )
    assert "periods" not in describe(read_case(path), COMM, most=51)


@pytest.mark.serial
@pytest.mark.parametrize(
    ("axes", "G"), [("0.3", 5e8), ("[[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]]", 2e8)]
)
def test_shear_in_the_plane_is_that_of_the_axes_there(
    shared_tmp: Path, axes: str, G: float
) -> None:
    """The other two moduli carry no wave in the plane, however soft."""
    timber = (
        '{type = "Orthotropic", E1 = 1e10, E2 = 1e9, E3 = 1e9, nu12 = 0.0, nu13 = 0.0, nu23 = 0.0, '
        "G12 = 5e8, "
        f"G13 = 1e8, G23 = 2e8, rho = 500.0, axes = {axes}}}"
    )
    model = described(written(shared_tmp), COMM, "system.dashpots=", f"material.upper={timber}")
    assert {one["body"]: one["c_s"] for one in model["waves"]}["upper"] == pytest.approx(
        np.sqrt(G / 500.0), rel=1e-9
    )


@pytest.mark.long
def test_any_number_of_ranks_describes_alike(shared_tmp: Path) -> None:
    path = written(shared_tmp)
    whole, alone = described(path), described(path, MPI.COMM_SELF)
    assert [
        len(one["lines"]) for one in alone["outline"] if one["group"] in ("", "upper_left")
    ] == [36, 8, 18, 18]
    read_case(path).run(COMM, out=shared_tmp / "run", progress=False)
    kept = json.loads((shared_tmp / "run" / "model.json").read_text("utf-8"))
    for model in (whole, kept) if COMM.rank == 0 else (whole,):
        assert model.pop("periods") == pytest.approx(alone["periods"], rel=1e-8)
        assert {key: one for key, one in model.items() if key != "outline"} == {
            key: one for key, one in alone.items() if key not in ("outline", "periods")
        }
        assert COMM.rank > 0 or model["outline"] == alone["outline"]


@pytest.mark.serial
def test_the_command_tells_and_draws(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert main(["run", str(written(tmp_path)), "--out", str(out), "--quiet", "--check"]) == 0
    printed = capsys.readouterr().out
    assert {path.name for path in out.iterdir()} == {"model.json", "model.png"}
    model = json.loads((out / "model.json").read_text("utf-8"))
    assert printed.startswith(put_in_words(model))
    assert printed.endswith("the file is in order; 1 doubt about the model\n")
    assert re.search(r"  upper_bottom on lower_top: area +0\.25  m²\n", printed)
    assert re.search(r"  upper_bottom on lower_top: friction +mu = 0\.5 +Coulomb\n", printed)
    assert (out / "model.png").read_bytes()[:4] == b"\x89PNG"


@pytest.mark.long
@pytest.mark.serial
@pytest.mark.filterwarnings("ignore:Glyph 27")
def test_the_model_of_a_run_is_kept(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """model.json is what its history was computed with: a check of the case as it is now leaves
    it."""
    text = BLOCKS.replace("Two blocks that carry", "Two \\u001b[2J blocks that carry")
    path, out = str(written(tmp_path, text)), tmp_path / "out"
    assert main(["run", path, "--out", str(out), "--quiet"]) == 0
    model = (out / "model.json").read_bytes()
    assert (
        main(
            [
                "run",
                path,
                "--out",
                str(out),
                "--quiet",
                "--check",
                "--set",
                "material.upper.rho=1000.0",
            ]
        )
        == 0
    )
    told = capsys.readouterr().out
    assert (
        f"picture: {out / 'check' / 'model.png'}\n" in told
        and "\x1b" not in told
        and "Two \\x1b[2J blocks" in told
    )
    assert (out / "model.json").read_bytes() == model and not (out / "model.png").exists()
    assert (out / "check" / "model.png").read_bytes()[:4] == b"\x89PNG"


@pytest.mark.long
@pytest.mark.serial
def test_the_page_shows_what_the_command_tells(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    page = (Path(__file__).resolve().parents[2] / "docs" / "guide" / "check.md").read_text(
        encoding="utf-8"
    )
    (shown,) = re.findall(r"^```text\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)
    monkeypatch.chdir(tmp_path)
    assert main(["run", "channel", "--check", "--quiet"]) == 0
    *told, last = capsys.readouterr().out.splitlines()
    assert told == shown.splitlines() and last.endswith(
        "A channel buried in soil, shaken: the file is in order; 1 doubt about the model"
    )


@pytest.mark.serial
@pytest.mark.parametrize("d", [1, 2, 3])
def test_a_sketch_shows_what_holds_and_touches(tmp_path: Path, d: int) -> None:
    """Lines of groups that hold a body are thick and in the legend; boxes in space; dots where they
    may touch."""
    text = BLOCKS
    if d == 3:
        text = text.replace("[0.25, 2.0]", "[0.25, 2.0, 1.0]").replace("[1, 8]", "[1, 8, 2]")
        text = text.replace("direction = [0.0, 1.0]", "direction = [0.0, 1.0, 0.0]")
    if d == 1:
        text = re.sub(
            r"prescribed = .*\n", "", text.replace("[0.25, 2.0]", "[2.0]").replace("[1, 8]", "[8]")
        )
        text = text.replace("direction = [0.0, 1.0]", "direction = [1.0]").replace(
            "_bottom", "_left"
        )
        text = (
            text.replace("lower_top", "lower_right")
            .replace("upper_top", "upper_right")
            .replace("[friction]", "")
        )
        text = text.replace('type = "Coulomb"\nmu = 0.5\n', "")
    model = described(written(tmp_path, text))
    (axis,) = sketch(model).axes
    names = [one.get_text() for one in axis.get_legend().get_texts()]
    letters = ", ".join("xyz"[:d])
    bodies = []
    if d == 2:
        bodies = [f"{one}: 0.25 × 2 m, E = 1.8 GPa, 2000 kg/m³" for one in ("lower", "upper")]
    assert names[: len(bodies)] == bodies
    assert names[len(bodies)] == f"fixed {letters}: lower_{'left' if d == 1 else 'bottom'}"
    assert names[-1].startswith("contact")
    assert len(model["outline"]) == {1: 2, 2: 11, 3: 2}[d]
    dots = axis.lines[-1]
    shown = np.array(dots.get_data_3d() if d == 3 else dots.get_xydata().T)
    assert shown[min(d - 1, 1)] == pytest.approx(2.0)


RECORD = '{type = "synthetic", spectrum = {s0 = 0.01}, duration = 1.0, dt = 0.01, seed = 3}'
SECOND = (
    '\n[[excitation]]\ntype = "GroundMotion"\ndirection = [1.0, 0.0]\nrecord = ' + RECORD + "\n"
)


@pytest.mark.serial
@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"upper_bottom"', '"uper_bottom"', "did you mean upper_bottom"),
        ('"lower_bottom"', '"zz"', "upper: name it in Gmsh"),
        (
            "[run]",
            SECOND.replace("dt = 0.01", "dt = 0.02") + "[run]",
            "have samples every 0.01 and 0.02 s: bring them to one step",
        ),
        (
            "[run]",
            SECOND.replace("duration = 1.0", "duration = 2.0") + "[run]",
            "last 1 and 2 s: trim or pad one",
        ),
        (
            "dt = 0.002",
            "dt = 0.02",
            "time step of 0.02 s leaves out samples of 'synthetic, seed 3'",
        ),
        (RECORD, '"none.at2"', "none.at2: there is no such file"),
        (
            "steps = 3",
            'steps = 3\n[[record]]\ntype = "Probe"\npoints = {far = [9.0, 9.0]}',
            "m away from the nearest node",
        ),
        (
            "dashpots",
            'loads = [{type = "Pressure", facets = "upper_top", value = "9810*(35 - '
            'z)"}]\ndashpots',
            "[system] '9810*(35 - z)' has z, and a model of dimension 2 has only x, y",
        ),
    ],
    ids=range(8),
)
def test_check_ends_with_what_is_wrong(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], old: str, new: str, said: str
) -> None:
    assert BLOCKS.count(old) == 1
    path = written(tmp_path, BLOCKS.replace(old, new))
    assert main(["run", str(path), "--check", "--quiet", "--out", str(tmp_path / "out")]) == 1
    error = capsys.readouterr().err
    assert error.count("\n") == 1 and said in error


@pytest.mark.serial
@pytest.mark.parametrize(
    "motion",
    [RECORD, f'[{{type = "GroundMotion", direction = [0.0, 1.0], record = {RECORD}}}]'],
    ids=["record", "excitation"],
)
def test_motions_of_a_compliant_base_are_records(tmp_path: Path, motion: str) -> None:
    """Told once, however many boundaries it comes through, and looked at as those of excitations
    are."""
    base = (
        'facets = "lower_bottom", normal = 0.5, motion = {direction = [0.0, 1.0], motion = '
        + motion
        + "}}, "
    )
    bases = "".join(
        f'{{type = "CompliantBase", {one}' for one in (base, base.replace("_bottom", "_left"))
    )
    text = re.sub(r"\[\[excitation\]\].*?\n(?=\[run\])", "", BLOCKS, flags=re.DOTALL)
    text = re.sub("fixed = .*\nprescribed = .*\n", "", text).replace(
        "dashpots = [", f"dashpots = [{bases}"
    )
    model = described(written(tmp_path, text.replace("dt = 0.002", "dt = 0.02")))
    (record,) = model["records"]
    assert record["file"] == "synthetic, seed 3" and 1.0 < record["f_95"] < 50.0
    (said,) = model["defects"]
    assert "time step of 0.02 s leaves out samples of 'synthetic, seed 3'" in said


@pytest.mark.serial
def test_warnings_name_what_is_coarse(tmp_path: Path) -> None:
    """Edges too long for the record's energy, and steps longer than a twentieth of the first
    period."""
    soft = described(written(tmp_path, BLOCKS.replace("E = 1.8e9", "E = 1.8e4")))
    assert "the first natural period is 30.42 s" in soft["warnings"].pop(0)
    assert [one.split()[0] for one in soft["warnings"]] == ["'lower'", "'upper'"]
    assert (
        np.sqrt(0.5 * 1.8e4 / RHO) / 2.0 == pytest.approx(1.06, rel=1e-2)
        and "up to 1.06 Hz" in soft["warnings"][0]
    )
    (slow,) = described(written(tmp_path), COMM, "run.dt=0.005")["warnings"]
    assert "0.005 s is longer than a twentieth of the first natural period" in slow


RAFT = """
title = "A raft on coarser soil"
[mesh]
type = "TwoBlocks"
lower = {lengths = [20.0, 6.0], divisions = [13, 4]}
upper = {lengths = [8.0, 0.8], divisions = [16, 2]}
offset = [6.4]
[material]
lower = {E = 5e7, nu = 0.3, rho = 1900.0}
upper = {E = 3e10, nu = 0.2, rho = 2500.0}
[system]
fixed = ["lower_bottom", "lower_left"]
[gravity]
cells = "upper"
[[contact]]
type = "contact_pair"
name = "base"
facets1 = "upper_bottom"
facets2 = "lower_top"
matching = {type = "DualMortar"}
[run]
dt = 0.002
steps = 2
"""
EXCHANGED = RAFT.replace('1 = "upper_bottom"', '1 = "lower_top"').replace(
    '2 = "lower_top"', '2 = "upper_bottom"'
)
FINER = RAFT.replace("divisions = [13, 4]", "divisions = [40, 8]")


def test_contact_nodes_are_counted_and_placed(shared_tmp: Path) -> None:
    """14 nodes on the soil: 6 points, one that is partly covered, and 7 beside the raft, of which
    one is clamped."""
    model = describe(read_case(written(shared_tmp, EXCHANGED)), COMM)
    (contact,) = model["contact"]
    assert contact["nodes"] == (
        "6 points of 14 nodes; 7 nodes in front of nothing (left out), at (0, 6), (1.53846, 6), "
        "(3.07692, 6) and 4 more places; 1 node partly covered (carried by their neighbours), at "
        "(15.3846, 6)"
    )
    assert f"  {contact['nodes']}\n" in put_in_words(model)
    assert {kind: len(places) for kind, places in contact["others"].items()} == {
        "in front of nothing": 7,
        "partly covered": 1,
    }
    labels = (
        sketch(model).axes[0].get_legend_handles_labels()[1]
        if COMM.rank == 0
        else ["base: 1 partly covered"]
    )
    assert "base: 1 partly covered" in labels


@pytest.mark.parametrize(("text", "warns"), [(RAFT, True), (EXCHANGED, False), (FINER, False)])
def test_a_softer_side_2_with_longer_edges_is_told(
    shared_tmp: Path, text: str, warns: bool, caplog: Any
) -> None:
    """By the check and, as points are open at rest, by the static stage; both remedies close all of
    them."""
    case = read_case(written(shared_tmp, text))
    model = describe(case, COMM)
    sides = model["contact"][0]["sides"]
    assert [round(side["h"], 9) for side in sides] == {
        RAFT: [0.5, 1.538461538],
        EXCHANGED: [1.538461538, 0.5],
        FINER: [0.5, 0.5],
    }[text]
    said = [one for one in model["warnings"] if "zigzag" in one]
    assert len(said) == warns
    assert all("'upper_bottom', side 1 of its contact, has edges of 0.5 m" in one for one in said)
    problem = case.problem(COMM)
    with caplog.at_level("WARNING"):
        state = vc.static_equilibrium(problem)
    opened = COMM.allreduce(float(np.sum(problem.surface.weights[~state.active]))) / COMM.allreduce(
        float(np.sum(problem.surface.weights))
    )
    assert (opened > 0.2) if warns else opened == 0.0
    if COMM.rank == 0:
        assert ("of the contact area that touches at the start is open" in caplog.text) is warns


def test_steps_are_compared_with_periods_of_open_contact(shared_tmp: Path) -> None:
    """The lower block carries the upper one: apart, the clamped one swings as it does alone,
    quicker than both."""
    sides = ", ".join(
        f'{{facets = "{block}_{side}", components = [0]}}'
        for block in ("lower", "upper")
        for side in ("left", "right")
    )
    model = described(written(shared_tmp), COMM, f"system.prescribed=[{sides}]")
    assert model["periods_open"] == pytest.approx([axial(1, HEIGHT / 2, CELLS // 2)], rel=1e-8)
    assert model["periods_open"][0] < 0.51 * model["periods"][0]
    model["periods"].clear()  # as where closed contact holds everything
    for dt, count in ((0.99, 0), (1.01, 1)):
        model["run"]["dt"] = dt * model["periods_open"][0] / 20.0
        said = [
            one
            for one in find_warnings(model)
            if "first natural period with the contact open" in one
        ]
        assert len(said) == count
    model["run"]["steps"] = 0  # static stages alone
    assert not [one for one in find_warnings(model) if "shorten [run] dt" in one]
    assert set(described(written(shared_tmp), COMM, "mesh.gap=0.1")) - set(model) == set()


def test_a_harmonic_that_no_step_sees(shared_tmp: Path) -> None:
    shaking = """[[excitation]]
type = "Harmonic"
amplitude = 1.0
frequency = 250.0
direction = [0.0, 1.0]
"""
    text = BLOCKS.replace(BLOCKS[BLOCKS.index("[[excitation]]") : BLOCKS.index("[run]")], shaking)
    words = "is 1 times half the period of Harmonic of 250 Hz"
    assert sum(words in one for one in described(written(shared_tmp, text), COMM)["warnings"]) == 1
