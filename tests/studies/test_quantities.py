"""Values with units, and expressions, in case files: SI values, and one sentence for what does not
fit."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

from vi_contact import core, fem, meshes
from vi_contact.core.errors import InputError
from vi_contact.practice.studies import read_case
from vi_contact.practice.studies.cases.quantities import read_quantity
from vi_contact.practice.studies.cases.short_settings import ShortOptions
from vi_contact.practice.studies.cases.table_calls import Call, Spot

COMM = MPI.COMM_WORLD
ROOT = Path(__file__).resolve().parents[2]
WALL = ROOT / "demos" / "cases" / "wall.toml"
VALUES = {
    ("30 MPa", "Pa"): 30e6,
    ("2.1e4 N/mm2", "Pa"): 2.1e10,
    ("3 kN/cm^2", "Pa"): 3e7,
    ("5 kN m-2", "Pa"): 5e3,
    ("2400 kg/m3", "kg/m3"): 2400.0,
    ("2.4 t/m³", "kg/m3"): 2400.0,
    ("0.35 g", "m/s2"): 0.35 * 9.80665,
    ("35 cm/s2", "m/s2"): 0.35,
    ("100 cm/s/s", "m/s2"): 1.0,
    ("25 kN/m3", "N/m3"): 25e3,
    ("6 m", "m"): 6.0,
    ("-12 mm", "m"): -0.012,
    ("7mm", "m"): 0.007,
    ("3 µm", "m"): 3e-6,
    ("5 %", "1"): 0.05,
    ("0.3", "1"): 0.3,
    ("90 deg", "rad"): math.pi / 2,
    ("45 °", "rad"): math.pi / 4,
    ("2 kHz", "Hz"): 2000.0,
    ("3 1/s", "1/s"): 3.0,
    ("5 ms", "s"): 0.005,
    ("40 MPa*s", "Pa*s"): 4e7,
    ("2 kPa·s", "Pa*s"): 2e3,
    ("2*9.81", "m/s2"): 19.62,
    ("50*9.81 kN/m2", "Pa"): 490500.0,
    ("(1 + 1e-1)/2 mm", "m"): 0.00055,
    ("100 kPa/mm", "Pa/m"): 1e8,
    ("12 rad/s", "rad/s"): 12.0,
    ("1e-2 m2/s3", "m2/s3"): 0.01,
    ("1/200", None): 0.005,
}


def spot(unit: str | None) -> Spot:
    return Spot("wall.toml", "material.soil", "E", unit)


@pytest.mark.serial
@pytest.mark.parametrize(("text", "unit"), VALUES)
def test_values_are_those_of_si(text: str, unit: str) -> None:
    assert read_quantity(text, [float], spot(unit)) == pytest.approx(VALUES[text, unit], rel=1e-15)


WRONG = {
    ("٣ m", "m"): "'٣' in it does not belong to arithmetic",
    ("2400 kg/m3", "Pa"): "'kg/m3' is not a unit of it: give it in Pa",
    ("30 MPa", "1"): "give it in % or as a plain",
    ("2*x kN/m2", "Pa"): "'kN' in it has no sign before it: give one, or leave it out if",
    ("5 %", "Pa"): "'%' is not a unit of it",
    ("12 Hz", "rad/s"): "'Hz' is not a unit of it: give it in rad/s",
    ("1.8 g/cm3", "kg/m3"): "'g/cm3' is not a unit of it: give it in kg",
    ("3 mPaa", "Pa"): "'mPaa' is not a unit here",
    ("30 MPa", None): "no unit is known for it here: leave 'MPa' out",
    ("30 Mpa", "Pa"): "'Mpa' is not a unit here",
    ("3 N//m2", "Pa"): "is not a unit: write one as",
    ("30 MPa + 1", "Pa"): "give a number, one with its unit, or",
    ("1/0", "Pa"): "which is inf: give a finite number",
    ("1e999", "Pa"): "which is inf",
    ("log(0)", "Pa"): "is -inf",
    ("sqrt(-1)", "Pa"): "which is nan",
    ("exp(1000)", "1"): "which is inf",
    ("1e999 Pa", "Pa"): "'inf' in it is no",
    ("stiff", "Pa"): "give a number, one with its unit",
    ("y", "Pa"): "give a number, one with its unit",
}


@pytest.mark.serial
@pytest.mark.parametrize(("text", "unit"), WRONG)
def test_what_does_not_fit_is_refused(text: str, unit: str) -> None:
    with pytest.raises(InputError) as caught:
        read_quantity(text, [float], spot(unit))
    said = str(caught.value)
    assert (
        said.startswith(f"wall.toml: [material.soil] E is '{text}'") and WRONG[text, unit] in said
    ), said


def given(node: Any) -> Any:
    """What a table gives to what it calls."""
    if isinstance(node, Call):
        return node.callee.name, {key: given(one) for key, one in node.arguments.items()}
    if isinstance(node, dict):
        return {key: given(one) for key, one in node.items()}
    return [given(one) for one in node] if isinstance(node, tuple) else getattr(node, "name", node)


@pytest.mark.serial
def test_a_case_with_units_is_the_case_without(tmp_path: Path) -> None:
    """demos/cases/wall.toml, its numbers as texts: the same values, also by --set."""
    text = WALL.read_text(encoding="utf-8")
    for old, new in (
        ("height = 9.0", 'height = "900 cm"'),
        ("E = 2.0e10", 'E = "20 GPa"'),
        ("rho = 2400.0", 'rho = "2.4 t/m3"'),
        ("thickness = 0.20", 'thickness = "200 mm"'),
        ("dt = 0.0017857142857142857", 'dt = "1/560"'),
    ):
        assert old in text, old
        text = text.replace(old, new)
    path = tmp_path / "wall.toml"
    path.write_text(text, encoding="utf-8")
    settings = ["run.steps=2*3", "contact.1.obstacle.point=['6 m', 0]"]
    found, plain = read_case(path, settings), read_case(WALL, ["run.steps=6"])
    for name in ("mesh", "material", "system", "contact", "run"):
        assert given(found.nodes[name]) == given(plain.nodes[name]), name
    with pytest.raises(
        InputError, match=r"\[mesh\] height is '9 s': 's' is not a unit of it: give it in m"
    ):
        read_case(path, ["mesh.height=9 s"])
    with pytest.raises(InputError, match=r"\[run\] steps is '5/2', which is 2.5: give"):
        read_case(path, ["run.steps=5/2"])


BLOCK = """
[mesh]
type = "BlockMesh"
lengths = ["4 m", 6.0]
divisions = [2, 3]
corner = [-2, 0]
deform = ["x + 0.2*y", "y"]

[material.soil]
type = "Heterogeneous"
E = "30e6 + 2e6*y"
nu = 0.3
rho = "1.8 t/m3"

[system]
fixed = "bottom"
initial_velocity = ["0.1*y", "0"]

[[system.loads]]
type = "Pressure"
facets = "left"
value = "9810*max(0, 5 - y)"
history = "min(1, t/2)"

[[system.loads]]
facets = "top"
value = ["0", "-1 kPa"]

[[system.loads]]
facets = "right"
value = ["1e3*t*y", "2 kPa"]

[[system.loads]]
type = "InitialStrain"
value = "1e-5*(10 + y)*t"

[[system.loads]]
type = "InitialStrain"
value = "0.03 %"
history = "t^2"
cells = "block"

[[system.loads]]
type = "InitialStrain"
value = [["0.03 %", "-1e-4/2"], [0.0, 2e-4]]

[[contact]]
facets = "right"
obstacle = {type = "AnalyticGap", function = "0.01 + 0.001*y^2"}

[run]
dt = "10 ms"
steps = 3
"""


def test_expressions_are_the_functions_of_the_interface(tmp_path_factory: Any) -> None:
    """C1.3: mesh, material, loads, gap and initial values, on any ranks, against the same functions
    in Python."""
    folder = Path(COMM.bcast(str(tmp_path_factory.mktemp("case")) if COMM.rank == 0 else ""))
    path = folder / "block.toml"
    if COMM.rank == 0:
        path.write_text(BLOCK, encoding="utf-8")
    COMM.Barrier()
    parts = read_case(path).parts(COMM)
    lean = meshes.BlockMesh(
        lengths=(4.0, 6.0),
        divisions=(2, 3),
        corner=(-2.0, 0.0),
        deform=lambda p: np.column_stack([p[:, 0] + 0.2 * p[:, 1], p[:, 1]]),
    )
    mesh, tags = fem.build_mesh(lean, COMM)
    loads = [
        fem.Pressure(
            tags["left"],
            lambda p, t: 9810.0 * np.maximum(0.0, 5.0 - p[:, 1]),
            lambda t: min(1.0, 0.5 * t),
        ),
        fem.Traction(tags["top"], (0.0, -1e3)),
        fem.Traction(
            tags["right"], lambda p, t: np.column_stack([1e3 * t * p[:, 1], np.full(len(p), 2e3)])
        ),
        fem.InitialStrain(lambda p, t: 1e-5 * (10.0 + p[:, 1]) * t),
        fem.InitialStrain(3e-4, lambda t: t**2, tags["block"]),
        fem.InitialStrain([[3e-4, -5e-5], [0.0, 2e-4]]),
    ]
    system = fem.assemble(
        mesh,
        fem.Heterogeneous(lambda x: 30e6 + 2e6 * x[1], 0.3, 1800.0),
        clamped=tags["bottom"],
        loads=loads,
        initial_velocity=lambda p: np.column_stack([0.1 * p[:, 1], np.zeros(len(p))]),
    )
    obstacle = core.AnalyticGap(lambda p: 0.01 + 1e-3 * p[:, 1] ** 2)
    surface = fem.contact_surface(system, tags["right"], obstacle=obstacle)
    for t in (0.0, 0.5, 3.0):
        assert np.allclose(parts.system.load(t), system.load(t), rtol=1e-13, atol=1e-9)
    assert np.array_equal(parts.system.v0, system.v0) and np.allclose(
        parts.surface.gap(0.0), surface.gap(0.0), rtol=1e-14, atol=0.0
    )
    ones = np.ones(len(system.v0))
    assert np.allclose(parts.system.K @ ones, system.K @ ones, rtol=1e-10, atol=1e-4)


@pytest.mark.serial
def test_expressions_where_none_belongs_are_refused(tmp_path: Path) -> None:
    path = tmp_path / "block.toml"
    for old, new, said in (
        (
            "30e6 + 2e6*y",
            "30e6 + 2e6*t",
            r"\[material.soil\] E is '30e6 \+ 2e6\*t': give a number, .* x, y, z; 't'",
        ),
        (
            "min(1, t/2)",
            "x",
            r"history is 'x': give a number, one with its unit, or arithmetic of t; 'x' in it",
        ),
        (
            '["0.1*y", "0"]',
            '["0.1*y", "0 m"]',
            r"initial_velocity\[2\] is '0 m': 'm' is not a unit of it: give",
        ),
        (
            '["0.1*y", "0"]',
            '["0.1*y*t", 0]',
            r"initial_velocity\[1\] is '0.1\*y\*t': .*'t' in it is not a number",
        ),
        (
            '["0", "-1 kPa"]',
            '"-1 kPa"',
            r"value is '-1 kPa': give a list of numbers or expressions of x, y, z, t",
        ),
        (
            "2e-4]]",
            '"1e-4*t"]]',
            r"value\[2\]\[2\] is '1e-4\*t': give a number, .*'t' in it is not a number",
        ),
        (
            '"1e-5*(10 + y)*t"',
            '["1e-5*t", "0"]',
            r"value\[1\] is '1e-5\*t': give a list of numbers",
        ),
        (
            '"9810*max(0, 5 - y)"',
            '["9810*y", "0"]',
            "value is a list: give a number or an expression or a function",
        ),
        ("divisions = [2, 3]", 'divisions = [2, "x"]', r"divisions\[2\] is 'x': give a number"),
    ):
        assert old in BLOCK
        path.write_text(BLOCK.replace(old, new), encoding="utf-8")
        with pytest.raises(InputError, match=said):
            read_case(path)


@pytest.mark.serial
def test_amplitudes_with_units_are_scaled() -> None:
    tables = {"excitation": {"type": "Harmonic", "amplitude": "0.5 g", "frequency": 1.0}}
    assert ShortOptions(scale=2.0).settings(tables) == ["excitation.amplitude=9.80665"]
    tables["excitation"]["amplitude"] = "0.5 m"
    with pytest.raises(
        InputError,
        match=r"--scale: \[excitation\[1\]\] amplitude is '0.5 m': 'm' is not a unit of it",
    ):
        ShortOptions(scale=2.0).settings(tables)
