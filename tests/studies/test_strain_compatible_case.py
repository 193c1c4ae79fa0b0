"""Case files with [strain_compatible]: the calls of the Python interface, one run folder for each
run (V8.8)."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem, soil
from vi_contact.core.errors import InputError, ViContactError
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import TwoBlocks
from vi_contact.practice.cli.entry import main
from vi_contact.practice.studies import read_case
from vi_contact.practice.studies.cases.table_calls import build

pytestmark = pytest.mark.serial
COMM = MPI.COMM_WORLD
CASE = """
[mesh]
type = "TwoBlocks"
lower = {lengths = [8.0, 4.0], divisions = [4, 3]}
upper = {lengths = [2.0, 2.0], divisions = [1, 1]}
offset = [2.0, 0.0]
[material.lower]
E = 8e7
nu = 0.3
rho = 1900.0
[material.upper]
E = 2e9
nu = 0.2
rho = 2000.0
[system]
fixed = "lower_bottom"
tied = [{first = "lower_left", second = "lower_right"}]
damping = {type = "DampingRatio", frequency = 6.0, second = 20.0}
[strain_compatible]
curves = [["lower", {type = "SoilCurves.vucetic_dobry", plasticity = 15}],
          ["upper", {type = "SoilCurves.linear", damping = 0.02}]]
[gravity]
direction = [0.0, -1.0]
[[contact]]
type = "contact_pair"
facets1 = "upper_bottom"
facets2 = "lower_top"
[friction]
type = "Coulomb"
mu = 0.5
[[excitation]]
type = "Ricker"
amplitude = 3.0
frequency = 4.0
[run]
dt = 0.01
steps = 35
"""

STAGES = """
[[stage]]
name = "gravity"
type = "static"
[[stage]]
name = "motion"
type = "dynamic"
"""


def written(folder: Path, text: str = CASE) -> Path:
    (folder / "case.toml").write_text(text)
    return folder / "case.toml"


def by_hand() -> Any:
    """The same in Python."""
    lower, upper = (
        BlockMesh(lengths=(8.0, 4.0), divisions=(4, 3)),
        BlockMesh(lengths=(2.0, 2.0), divisions=(1, 1)),
    )
    mesh, tags = fem.build_mesh(TwoBlocks(lower=lower, upper=upper, offset=(2.0, 0.0)), COMM)
    materials = [
        (tags["lower"], vc.LinearElastic(E=8e7, nu=0.3, rho=1900.0)),
        (tags["upper"], vc.LinearElastic(E=2e9, nu=0.2, rho=2000.0)),
    ]
    curves = [
        (tags["lower"], soil.SoilCurves.vucetic_dobry(15)),
        (tags["upper"], soil.SoilCurves.linear(0.02)),
    ]

    def run(material: Any, strain: Any) -> Any:
        system = vc.with_weight(
            fem.assemble(
                mesh,
                material,
                damping=vc.DampingRatio(6.0, 20.0),
                clamped=tags["lower_bottom"],
                tied=fem.Tied(tags["lower_left"], tags["lower_right"]),
            ),
            direction=(0.0, -1.0),
        )
        contact = fem.contact_pair(system, tags["upper_bottom"], tags["lower_top"])
        problem = vc.ContactProblem(
            system, contact, friction=vc.Coulomb(0.5), excitation=vc.Ricker(3.0, 4.0)
        )
        return vc.simulate(
            problem,
            state=vc.static_equilibrium(problem),
            dt=0.01,
            steps=35,
            progress=False,
            record=(vc.Energy(), vc.Contact(), strain),
        )

    return soil.strain_compatible(mesh, materials, curves, run)


@pytest.mark.long
def test_a_case_is_the_calls_of_python(tmp_path):
    """The last run is DIR, those before it DIR/iterations/1, 2, …; a second time they are
    replaced."""
    expected, out = by_hand(), tmp_path / "out"
    for _ in range(2):
        found = read_case(written(tmp_path)).run(COMM, out=out, progress=False)
    for name in ("contact_resultant", "largest_shear_strain", "energy_strain"):
        ours, theirs = found.history[name], expected.solution.history[name]
        assert np.allclose(ours, theirs, rtol=1e-8, atol=1e-8 * np.abs(theirs).max())
    folders = sorted(int(path.name) for path in (out / "iterations").iterdir())
    assert folders == list(range(1, len(expected.changes))) and len(folders) >= 2
    for folder in (out, out / "iterations" / "1"):
        assert (folder / "history.csv").is_file() and (folder / "case.toml").is_file()
    changes = json.loads((out / "strain_compatible.json").read_text())["changes"]
    assert np.allclose(changes, expected.changes, rtol=1e-5) and changes[-1] < 0.01
    assert json.loads((out / "summary.json").read_text())["status"] == "finished"
    first, last = (
        np.loadtxt(path / "history.csv", delimiter=",", skiprows=1, usecols=1)
        for path in (out / "iterations" / "1", out)
    )
    assert len(first) == len(last) == 36


def test_units_of_curves(tmp_path):
    curves = 'type = "SoilCurves.darendeli", mean_stress = "100 kPa", plasticity = 15'
    text = CASE.replace('type = "SoilCurves.vucetic_dobry", plasticity = 15', curves).replace(
        "20.0}", '"20 Hz"}'
    )
    case = read_case(written(tmp_path, text))
    _, tags = case.meshed(COMM)
    asked = build(case.nodes["strain_compatible"], {"tags": tags})
    assert asked["curves"][0] == (
        tags["lower"],
        soil.SoilCurves.darendeli(mean_stress=1e5, plasticity=15),
    )


@pytest.mark.long
def test_with_stages_the_last_one_tells_the_strains(tmp_path):
    """Gravity as a stage of its own: the same run, its folders within those of the runs."""
    plain = read_case(written(tmp_path)).run(COMM, progress=False)
    staged = read_case(written(tmp_path, CASE + STAGES)).run(
        COMM, out=tmp_path / "out", progress=False
    )
    for name in ("contact_resultant", "largest_shear_strain"):
        scale = np.abs(plain.history[name]).max()
        assert np.abs(staged.history[name] - plain.history[name]).max() < 1e-6 * scale
    assert (tmp_path / "out" / "stages" / "1_gravity").is_dir()
    assert (tmp_path / "out" / "iterations" / "1" / "stages" / "1_gravity").is_dir()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('["upper", {', '["uper", {', "uper"),
        ("plasticity = 15", "plasticity = 300", "end at 200 %"),
        ("SoilCurves.vucetic_dobry", "SoilCurves.vucetic", "vucetic_dobry"),
        ('["upper", {', '["lower", {', "some cells have two curves"),
        (
            '"DampingRatio", frequency = 6.0, second = 20.0',
            '"Rayleigh", alpha = 0.1, beta = 0.0',
            "DampingRatio",
        ),
        (
            'damping = {type = "DampingRatio", frequency = 6.0, second = 20.0}',
            "",
            "gives every cell its damping ratio",
        ),
        (
            "[strain_compatible]\n",
            "[strain_compatible]\nfrequency = 2.0\n",
            "unknown key 'frequency'",
        ),
    ],
)
def test_what_is_refused(tmp_path, old, new, words):
    assert old in CASE
    with pytest.raises(ViContactError, match=words):
        read_case(written(tmp_path, CASE.replace(old, new, 1))).run(COMM, progress=False)


@pytest.mark.long
@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("amplitude = 3.0", "amplitude = 300.0", "and 'Vucetic-Dobry PI 15' ends at 1 %"),
        ("[strain_compatible]\n", "[strain_compatible]\nmost = 2\n", "after 2 runs"),
    ],
)
def test_a_folder_without_compatible_soil_looks_unfinished(tmp_path, old, new, words):
    """It is refused; the last run stands with the others, and the folder holds no summary; a later
    run is not disturbed."""
    out = tmp_path / "out"
    with pytest.raises(ViContactError, match=words):
        read_case(written(tmp_path, CASE.replace(old, new, 1))).run(COMM, out=out, progress=False)
    assert [one.name for one in out.iterdir()] == ["iterations"]
    folders = [
        out / "iterations" / f"{number}"
        for number in range(1, 1 + len(list((out / "iterations").iterdir())))
    ]
    assert len(folders) > 1
    assert all(
        json.loads((one / "summary.json").read_text())["status"] == "finished" for one in folders
    )


def test_no_restart_no_static_end_and_no_study(tmp_path):
    case = read_case(written(tmp_path))
    with pytest.raises(InputError, match="cannot be continued: run it from the start"):
        case.run(COMM, out=tmp_path / "out", restart=True)
    with (
        pytest.raises(InputError, match="leave it out of stages and studies"),
        case.call(case.parts(COMM), None),
    ):
        pass
    with pytest.raises(InputError, match="the last stage, which is static"):
        read_case(written(tmp_path, CASE + STAGES.replace("dynamic", "static"))).run(COMM)


@pytest.mark.long
def test_the_command_runs_it(tmp_path, capsys):
    assert main(["run", str(written(tmp_path)), "--check", "--out", str(tmp_path / "checked")]) == 0
    assert (
        main(
            [
                "run",
                str(written(tmp_path)),
                "--out",
                str(tmp_path / "out"),
                "--quiet",
                "--steps",
                "30",
            ]
        )
        == 0
    )
    assert (tmp_path / "out" / "iterations" / "1" / "summary.json").is_file()
