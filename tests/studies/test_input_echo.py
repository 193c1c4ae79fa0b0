"""What was put in stands in tables with units: loads against calculations by hand, the same rows
in the check and in the report; doubts about numbers; and what the run refuses, the check refuses.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

from vi_contact.core.errors import InputError
from vi_contact.fem.output.load_resultants import find_point
from vi_contact.practice.cli.entry import main
from vi_contact.practice.ground_motion import EC8Spectrum, TabulatedSpectrum
from vi_contact.practice.sheet.choices import Sheet
from vi_contact.practice.studies import read_case
from vi_contact.practice.studies.cases.description.design_spectra import make_sheet_words
from vi_contact.practice.studies.cases.description.model import describe
from vi_contact.practice.studies.cases.description.motions import (
    describe_design_spectrum,
    describe_records,
)
from vi_contact.practice.studies.cases.description.pen import Pen
from vi_contact.practice.studies.cases.description.surroundings import describe_sides
from vi_contact.practice.studies.cases.description.tables import input_tables, print_tables
from vi_contact.practice.studies.cases.parsing import read_arguments
from vi_contact.practice.studies.cases.table_calls import Spot, make_callee
from vi_contact.practice.studies.report import WRITERS, report
from vi_contact.practice.units.report_units import ReportUnits

COMM = MPI.COMM_WORLD
G = 9.80665
# A dam 4 m wide and 10 m high on a foundation 20 m wide and 6 m deep, with 8 m of water on its
# left side and the pressure of the water in the joint below it.
DAM = """
title = "A dam on rock"
[mesh]
type = "TwoBlocks"
lower = {lengths = [20.0, 6.0], divisions = [20, 3]}
upper = {lengths = [4.0, 10.0], divisions = [4, 10]}
offset = [8.0]
[material.lower]
E = "40 GPa"
nu = 0.2
rho = 2700.0
[material.upper]
E = "25 GPa"
nu = 0.2
rho = 2400.0
[system]
clamped = "lower_bottom"
prescribed = [{facets = "lower_left", components = [0]}, {facets = "lower_right", components = [0]}]
loads = [
  {type = "Pressure", facets = "upper_left", value = "9810*max(0, 14 - y)"},
  {type = "Pressure", facets = "upper_bottom", value = "9810*8*(1 - (x - 8)/4)"},
]
damping = {type = "Rayleigh", alpha = 0.5, beta = 2e-4}
[gravity]
cells = "upper"
[[contact]]
type = "contact_pair"
name = "joint"
facets1 = "upper_bottom"
facets2 = "lower_top"
[friction]
type = "Coulomb"
mu = 0.7
[[excitation]]
type = "GroundMotion"
direction = [1.0, 0.0]
record = {type = "synthetic", spectrum = {s0 = 0.01}, duration = 4.0, dt = 0.01, seed = 3}
[run]
dt = 0.001
steps = 2
"""
THRUST = 0.5 * 9810.0 * 8.0**2  # N on a metre, at a third of the depth
UPLIFT = 0.5 * 9810.0 * 8.0 * 4.0  # N on a metre, at a third of the width
WEIGHT = 4.0 * 10.0 * 2400.0 * G


def written(folder: Path, text: str = DAM) -> Path:
    path = folder / "dam.toml"
    if COMM.rank == 0:
        path.write_text(text, encoding="utf-8")
    COMM.Barrier()
    return path


def described(folder: Path, *settings: str, text: str = DAM, comm: Any = COMM) -> dict[str, Any]:
    return describe(read_case(written(folder, text), settings), comm)


def rows_of(model: dict[str, Any], **units: str) -> dict[str, tuple[str, str, str]]:
    """The rows of all tables, by quantity."""
    tables = input_tables(model, ReportUnits(**units))
    return {row[0]: (row[1], row[2], row[3]) for table in tables for row in table.rows}


def test_loads_of_a_dam_by_hand(shared_tmp: Path) -> None:
    """Thrust, water pressure in the joint and weight, with their points, to ten digits."""
    model = described(shared_tmp)
    weight = next(one for one in model["loads"] if one["name"] == "weight of upper")
    thrust = next(one for one in model["loads"] if one["groups"] == ["upper_left"])
    uplift = next(one for one in model["loads"] if one["groups"] == ["upper_bottom"])
    expected = (
        (thrust, (THRUST, 0.0), (8.0, 6.0 + 8.0 / 3.0)),
        (uplift, (0.0, UPLIFT), (8.0 + 4.0 / 3.0, 6.0)),
        (weight, (0.0, -WEIGHT), (10.0, 11.0)),
    )
    for load, force, point in expected:
        assert load["force"] == pytest.approx(force, rel=1e-9)
        assert load["point"] == pytest.approx(point, rel=1e-9)
        moment = point[0] * force[1] - point[1] * force[0]
        assert load["moment"] == pytest.approx([moment], rel=1e-9)
        assert load["varies"] == ""
    total = model["constant_loads"]
    assert total["force"] == pytest.approx((THRUST, UPLIFT - WEIGHT), rel=1e-9)
    # It cuts the joint, y = 6, where the moments about the heel (8, 6) say.
    turning = THRUST * 8.0 / 3.0 - UPLIFT * 4.0 / 3.0 + WEIGHT * 2.0
    assert total["point"] == pytest.approx((8.0 + turning / (WEIGHT - UPLIFT), 6.0), rel=1e-9)


@pytest.mark.long
def test_loads_are_told_per_metre_whatever_the_slice(shared_tmp: Path) -> None:
    """A slice of 2 m carries twice the load, and a metre of it the same; a panel has its own."""
    one = rows_of(described(shared_tmp))
    name = "Pressure on 'upper_left': resultant"
    assert one[name] == ("(313.9, 0)", "kN/m", "")
    assert one["Pressure on 'upper_left': point of attack"][:2] == ("(8, 8.667)", "m")
    assert one["Pressure on 'upper_left': moment"][:2] == ("-2721", "kN m/m")
    assert one["upper: mass"][:2] == ("96", "t/m") and one["section"][0] == "plane strain"
    two = rows_of(described(shared_tmp, "system.section={type='PlaneStrain', thickness=2.0}"))
    assert two[name] == one[name] and two["upper: mass"] == one["upper: mass"]
    panel = rows_of(described(shared_tmp, "system.section={type='PlaneStress', thickness=2.0}"))
    assert panel[name] == ("(627.8, 0)", "kN", "") and panel["upper: mass"][:2] == ("192", "t")
    mega = rows_of(described(shared_tmp), force="MN", modulus="MPa")
    assert mega[name][:2] == ("(0.3139, 0)", "MN/m")
    assert mega["upper: Young's modulus E"][:2] == ("25000", "MPa")


@pytest.mark.long
def test_materials_sides_and_damping_by_hand(shared_tmp: Path) -> None:
    model = described(shared_tmp)
    rows = rows_of(model)
    assert rows["upper: Young's modulus E"][:2] == ("25", "GPa")
    assert rows["upper: shear modulus G"][:2] == ("10.42", "GPa")  # 25 / 2.4
    assert rows["upper: unit weight"][:2] == ("23.54", "kN/m³")  # 2400 * 9.80665
    assert rows["box of the model along y"][:2] == ("0 to 16", "m")
    assert rows["joint: friction"] == ("mu = 0.7", "-", "Coulomb")
    assert rows["distance of the side x min"][0] == "8"
    assert rows["distance of the side x min"][2].startswith("2.00 widths, ")
    assert rows["distance of the side y min"][2].startswith("1.50 widths, ")

    # A shear wave of the rock at the mean period of the record.
    speed = np.sqrt(40e9 / 2.4 / 2700.0)
    length = speed * model["records"][0]["mean_period"]
    assert model["sides"]["wave_length"] == pytest.approx(length, rel=1e-9)
    assert model["sides"]["distances"][0]["wave_lengths"] == pytest.approx(8.0 / length, rel=1e-9)

    # Rayleigh: xi = alpha / (2 w) + beta w / 2; no dashpots, so the modes have the same.
    for number, period in enumerate(model["periods"][:2], start=1):
        w = 2.0 * np.pi / period
        percent = 100.0 * (0.5 / (2.0 * w) + 2e-4 * w / 2.0)
        told, unit, _ = rows[f"lower, upper: damping ratio at T{number} by alpha and beta"]
        assert float(told) == pytest.approx(percent, rel=1e-3) and unit == "%"
        assert 100.0 * model["damping_ratios"][number - 1] == pytest.approx(percent, rel=1e-3)
    bare = rows_of(described(shared_tmp, "system.damping="))
    assert bare["law"][0] == "none"
    assert bare["natural period T1, contact closed"][2] == "no damping"


def test_loads_that_change_say_so(shared_tmp: Path) -> None:
    loads = (
        "system.loads=[{type='Traction', facets='upper_top', value=[0.0, -1e4], history='2*t'}, "
        "{type='BodyForce', value=[100.0, 0.0], cells='upper'}, "
        "{type='Pressure', facets='upper_right', value='1e3*(1 + t)'}]"
    )
    _, push, body, growing = described(shared_tmp, loads)["loads"]
    assert push["force"] == pytest.approx([0.0, -4e4], rel=1e-9)
    assert push["varies"] == "times its history, 0 at the start, at most 0.004 at t = 0.002 s"
    assert body["force"] == pytest.approx([4e3, 0.0], rel=1e-9)
    assert body["point"] == pytest.approx([10.0, 11.0], rel=1e-9) and body["varies"] == ""
    assert growing["force"] == pytest.approx([-1e4, 0.0], rel=1e-9)
    assert growing["varies"] == "at t = 0 s; it changes with time"


@pytest.mark.long
def test_any_number_of_ranks_tells_the_same(shared_tmp: Path) -> None:
    many = rows_of(described(shared_tmp))
    alone = rows_of(described(shared_tmp, comm=MPI.COMM_SELF))
    assert many == alone


IN_SPACE = {
    "[20.0, 6.0], divisions = [20, 3]": "[20.0, 6.0, 6.0], divisions = [10, 3, 2]",
    "[4.0, 10.0], divisions = [4, 10]": "[4.0, 10.0, 2.0], divisions = [2, 10, 1]",
    "offset = [8.0]": "offset = [8.0, 3.0]",
    'cells = "upper"': 'cells = "upper"\ndirection = [0.0, -1.0, 0.0]',
    "\ndirection = [1.0, 0.0]\n": "\ndirection = [1.0, 0.0, 0.0]\n",
    'facets2 = "lower_top"': 'facets2 = "lower_top"\nmatching = {type = "DualMortar"}',
}


def test_loads_and_sides_in_space(shared_tmp: Path) -> None:
    """The dam 2 m long, with gravity along -y: the loads are twice those of a metre."""
    text = DAM
    for old, new in IN_SPACE.items():
        assert text.count(old) == 1
        text = text.replace(old, new)
    model = described(shared_tmp, text=text)
    weight, thrust, uplift = model["loads"]
    assert weight["point"] == pytest.approx([10.0, 11.0, 4.0], rel=1e-9)
    assert thrust["force"] == pytest.approx([2.0 * THRUST, 0.0, 0.0], rel=1e-9)
    assert thrust["point"] == pytest.approx([8.0, 6.0 + 8.0 / 3.0, 4.0], rel=1e-9)
    assert uplift["point"] == pytest.approx([8.0 + 4.0 / 3.0, 6.0, 4.0], rel=1e-9)
    assert model["constant_loads"]["level"] == pytest.approx(6.0)
    assert model["constant_loads"]["point"][2] == pytest.approx(4.0)
    distances = {place["side"]: place["distance"] for place in model["sides"]["distances"]}
    assert distances == pytest.approx(
        {"x min": 8.0, "x max": 8.0, "y min": 6.0, "z min": 3.0, "z max": 1.0}
    )
    assert rows_of(model)["Pressure on 'upper_left': resultant"][1] == "kN"


@pytest.mark.serial
def test_points_of_attack_in_space() -> None:
    """A force of 2 N along -z through (1, 2), in the plane z = 3; a moment along it stays."""
    force = np.array([0.0, 0.0, -2.0])
    moment = np.cross([1.0, 2.0, 0.0], force) + np.array([0.0, 0.0, 5.0])
    near = np.array([4.0, 4.0, 3.0])
    point = find_point(force, moment, near=near, normal=np.array([0.0, 0.0, 1.0]))
    assert point == pytest.approx([1.0, 2.0, 3.0])
    # an inclined one meets the plane x = 0 where it did
    force = np.array([1.0, 0.0, -1.0])
    moment = np.cross([0.0, 2.0, 5.0], force)
    point = find_point(force, moment, near=np.zeros(3), normal=np.array([1.0, 0.0, 0.0]))
    assert point == pytest.approx([0.0, 2.0, 5.0])


@pytest.mark.long
@pytest.mark.serial
def test_the_report_has_the_rows_of_the_check(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """Every row, in the units of the sheet, and before the first figure."""
    path = str(written(tmp_path, f'{DAM}[sheet]\nunits = {{force = "MN"}}\n'))
    out = tmp_path / "out"
    assert main(["run", path, "--check", "--quiet", "--out", str(tmp_path / "checked")]) == 0
    printed = capsys.readouterr().out
    assert "MN/m" in printed and "kN" not in printed
    assert main(["run", path, "--quiet", "--out", str(out)]) == 0
    pages: list[Any] = []
    monkeypatch.setitem(
        WRITERS,
        ".pdf",
        lambda page, heading, facts, sections, foot: pages.append(sections),
    )
    report(out, out=out / "report.pdf")
    first = pages[0][1]  # after page 1
    assert len(first.tables) > 8 and not first.charts and not first.drawings
    assert print_tables(first.tables) in printed
    model = json.loads((out / "model.json").read_text("utf-8"))
    checked = json.loads((tmp_path / "checked" / "model.json").read_text("utf-8"))
    assert model == checked


@pytest.mark.long
@pytest.mark.parametrize(
    ("settings", "said"),
    [
        (["material.upper.E=30.0"], "'upper' has E = 30 Pa, less than any soil"),
        (
            ["mesh.lower.lengths=[2e4, 6e3]", "mesh.upper.lengths=[4e3, 1e4]", "mesh.offset=[8e3]"],
            "longer than that of any building",
        ),
        (
            ["excitation.1.direction=[1.0, 1.0]"],
            "has the length 1.414, so that it shakes with 1.414",
        ),
        (["excitation.1.scale=0.001"], "which is weak for a quake"),
        (["system.section={type='PlaneStrain', thickness=300.0}"], "is 300 m thick"),
    ],
    ids=["E", "mm", "direction", "weak", "thickness"],
)
def test_odd_numbers_are_doubted(shared_tmp: Path, settings: list[str], said: str) -> None:
    softer = ["material.upper.E=2e7", "material.lower.E=2e7"] if "mesh" in settings[0] else []
    model = described(shared_tmp, *softer, *settings)
    assert sum(said in warning for warning in model["warnings"]) == 1
    assert not any(said in warning for warning in described(shared_tmp)["warnings"])


@pytest.mark.long
def test_damping_by_mass_and_drift_on_a_compliant_base(shared_tmp: Path) -> None:
    """A record of one sign drifts away; alpha brakes what waves move in space."""
    base = (
        "system.dashpots=[{type='CompliantBase', facets='lower_bottom', "
        "motion={direction=[1.0, 0.0]}}]"
    )
    free = ["system.clamped=", "system.prescribed=", base, "friction.mu=0.7"]
    model = described(shared_tmp, *free)
    assert any("has a share of the mass, alpha" in one for one in model["warnings"])
    assert any("ends" in one and "a compliant base follows it" in one for one in model["warnings"])
    without = described(shared_tmp, *free, "system.damping={type='Rayleigh', alpha=0.0, beta=1e-4}")
    assert not any("has a share of the mass" in one for one in without["warnings"])
    assert not any("compliant base" in one for one in described(shared_tmp)["warnings"])


def read_design_spectrum(table: Any, source: str) -> Any:
    """What a report reads at the key design_spectrum of [sheet]."""
    words = make_sheet_words(Path())
    given = {"design_spectrum": table}
    return (
        read_arguments(given, make_callee(Sheet), Spot(source, "", "sheet"), words)
        .build({})
        .design_spectrum
    )


@pytest.mark.serial
def test_design_spectra_of_a_case() -> None:
    table = {"type": "EC8", "ground": "B", "ag": 1.6}
    spectrum = read_design_spectrum(table, "case.toml")
    assert spectrum == EC8Spectrum.on_ground("B", ag=1.6)
    told = describe_design_spectrum(spectrum)
    # plateau of ground B, type 1: 2.5 ag S between 0.15 and 0.5 s
    assert told["accelerations"][told["periods"].index(0.3)] == pytest.approx(2.5 * 1.6 * 1.2)
    points = {"periods": [0.0, 1.0, 2.0], "accelerations": [1.0, 3.0, 1.0]}
    own = read_design_spectrum(points, "case.toml")
    assert own == TabulatedSpectrum((0.0, 1.0, 2.0), (1.0, 3.0, 1.0))
    assert own.acceleration(np.array([0.5, 1.5, 5.0])) == pytest.approx(
        [2.0, 2.0, np.nan], nan_ok=True
    )
    vertical = read_design_spectrum({"type": "EC8", "vertical": True, "ag": 1.6}, "case.toml")
    assert vertical == EC8Spectrum.vertical(ag=1.6)


@pytest.mark.serial
@pytest.mark.parametrize(
    ("table", "said"),
    [
        ("EC8", "give a table with type = one of EC8, Tabulated"),
        ({"type": "EC9", "ag": 1.0}, "unknown type"),
        ({"type": "EC8", "ag": 1.0, "ground": "F"}, "give A, B, C, D or E"),
        ({"type": "EC8", "ground": "B"}, "lacks the key 'ag'"),
        ({"periods": [1.0, 0.5], "accelerations": [1.0, 1.0]}, "do not increase"),
        ({"periods": [0.0, 0.5], "accelerations": [1.0]}, "two lists of the same length"),
    ],
    ids=range(6),
)
def test_wrong_design_spectra_are_refused(table: Any, said: str) -> None:
    with pytest.raises(InputError, match=said) as refused:
        read_design_spectrum(table, "case.toml")
    assert "[sheet" in str(refused.value)


@pytest.mark.long
@pytest.mark.serial
def test_a_case_names_its_design_spectrum(shared_tmp: Path) -> None:
    """Both kinds, in the file; an example of docs/guide/check.md. It was refused as unknown key."""
    code = "sheet.design_spectrum={type='EC8', ground='B', ag='0.16 g'}"
    told = described(shared_tmp, code)["design_spectrum"]
    plateau = 2.5 * 0.16 * G * 1.2
    assert told["accelerations"][told["periods"].index(0.3)] == pytest.approx(plateau)
    points = "sheet.design_spectrum={periods=[0.0, 5.0], accelerations=[2.0, 2.0], name='site'}"
    model = described(shared_tmp, points)
    assert model["design_spectrum"]["name"] == "site"
    rows = rows_of(model)
    assert any("site: 2 m/s², of which it has" in remark for _, _, remark in rows.values())


def test_a_record_stands_beside_a_design_spectrum(shared_tmp: Path) -> None:
    """S_a of the motion with its scale, and its share of the design spectrum."""
    design = TabulatedSpectrum((0.0, 5.0), (2.0, 2.0), name="site")
    motions = list(read_case(written(shared_tmp), ["excitation.1.scale=3.0"]).excitations())
    records = describe_records(motions, design)
    model = {"records": records, "design_spectrum": describe_design_spectrum(design)}
    rows = rows_of(model)
    value = records[0]["spectrum"]["accelerations"][5]
    told, unit, remark = rows["synthetic, seed 3: S_a at 1 s, 5 %"]
    assert float(told) == pytest.approx(value, rel=1e-3) and unit == "m/s²"
    assert remark == f"site: 2 m/s², of which it has {value / 2.0:.2f}"


TWICE = """
[[record]]
type = "Probe"
points = {top = [8.0, 16.0]}
[[record]]
type = "Probe"
points = {top = [12.0, 16.0]}
"""
CUT = """
[[record]]
type = "SectionForces"
cuts = {stem = [[8.0, 8.5], [12.0, 8.5]]}
"""
ESCALATION = """
[[escalation]]
type = "Volume"
method = {type = "TaoTron"}
"""


STAGES = """
[[stage]]
name = "rest"
type = "static"
[[stage]]
name = "quake"
type = "dynamic"
[[stage]]
name = "after"
type = "dynamic"
run = {steps = 1}
[[stage.record]]
type = "Probe"
points = {top = [8.0, 16.0]}
[[stage.record]]
type = "Probe"
points = {top = [9.0, 16.0]}
"""


@pytest.mark.long
@pytest.mark.serial
@pytest.mark.parametrize(
    ("text", "settings", "said"),
    [
        (DAM + STAGES, [], "two recorders have the column"),
        (DAM + STAGES, ["friction="], "has no static equilibrium"),
        (DAM + TWICE, [], "two recorders have the column"),
        (DAM + CUT, ["system.degree=2"], "cuts cells of degree 2"),
        (DAM + ESCALATION, [], "only enforces bounds on displacements"),
        (DAM, ["friction="], "has no static equilibrium"),
    ],
    ids=["stage", "first stage", "columns", "degree", "escalation", "rest"],
)
def test_the_check_refuses_what_the_run_refuses(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    text: str,
    settings: list[str],
    said: str,
) -> None:
    """In the same sentence, and with no file of a run; a later stage is refused beforehand."""
    out = tmp_path / "out"
    command = ["run", str(written(tmp_path, text)), "--quiet", "--out", str(out)]
    for setting in settings:
        command += ["--set", setting]
    assert main(command) == 1
    of_run = capsys.readouterr().err
    assert said in of_run
    checked = tmp_path / "checked"
    command[command.index(str(out))] = str(checked)
    assert main([*command, "--check"]) == 1
    assert capsys.readouterr().err.splitlines()[-1] == of_run.splitlines()[-1]
    assert not (checked / "history.csv").exists() and not (checked / "case.toml").exists()


def test_columns_of_a_frame_are_no_ground() -> None:
    """Beams between columns: the columns fill a fifth of the box round them, soil fills its own."""
    beams = {"name": "beams", "box": {"min": [1.0, 2.0], "max": [9.0, 3.0]}, "size": 8.0}
    around = {"name": "around", "box": {"min": [0.0, 0.0], "max": [10.0, 4.0]}}
    model = {
        "dimension": 2,
        "gravity": None,
        "box": around["box"],
        "waves": [{"body": "around", "c_s": 100.0}],
        "records": [],
    }
    assert describe_sides(model | {"bodies": [beams, around | {"size": 8.0}]}) == {}
    sides = describe_sides(model | {"bodies": [beams, around | {"size": 32.0}]})
    assert sides["structure"] == ["beams"] and sides["ground"] == "around"


def test_rounding_beside_a_component_is_zero() -> None:
    """1e-16 m beside 2 m are none; what is small beside nothing is told."""
    pen = Pen(ReportUnits(), None)
    assert pen.row_of_several("c", [1e-16, 2.0], "m", quantity="size")[1] == "(0, 2)"
    assert pen.row_of_several("c", [1e-16, 0.0], "m", quantity="size")[1] == "(1e-16, 0)"
