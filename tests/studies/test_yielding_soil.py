"""Soil that yields in case files: materials, stress at rest, and what is refused in a sentence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

import vi_contact as vc
from vi_contact.laws import Geostatic
from vi_contact.practice.studies import read_case

WEIGHT = 19613.3  # N/m³
MOHR = 'type = "MohrCoulomb"\ncohesion = 0\nphi = "30 deg"\npsi = 0'
CASE = """
title = "Level ground"
[mesh]
type = "BlockMesh"
lengths = [4.0, 2.0]
divisions = [4, 2]
[material.soil]
E = "50 MPa"
nu = 0.3
rho = "2000 kg/m3"
{material}
[system]
integration = "bbar"
fixed = "bottom"
prescribed = [{{facets = "left", components = [0]}}, {{facets = "right", components = [0]}}]
{stress}
[gravity]
[run]
dt = 0.001
steps = 2
"""


def write(folder: Path, material: str = MOHR, stress: str = "") -> Any:
    path = folder / "ground.toml"
    path.write_text(CASE.format(material=material, stress=stress))
    return read_case(path)


@pytest.mark.serial
@pytest.mark.parametrize(
    "material",
    [
        MOHR,
        'type = "DruckerPrager"\ncohesion = "5 kPa"\nphi = 30\npsi = "0.1 rad"\nfit = "extension"',
        'type = "J2"\nyield_stress = "50 kPa"\nisotropic = "1 MPa"',
        'type = "Iwan"\ncurve = [[1e-4, 0.9], [1e-3, 0.5]]',
        'type = "Iwan"\ncurve = {type = "SoilCurves.seed_idriss"}',
    ],
)
def test_every_law_stands_in_a_case_file(tmp_path: Path, material: str) -> None:
    """Ground at rest under its weight bears it, whatever the law of its soil."""
    case = write(tmp_path, material)
    state = case.run(MPI.COMM_SELF, progress=False).state
    vertical = state.memory["material_0_sigma"][..., 1]
    ground = -WEIGHT * (2.0 - 2.0 * np.array([0.25, 0.75]))
    assert np.unique(np.round(vertical.mean(axis=1), 3)) == pytest.approx(ground, rel=1e-9)


@pytest.mark.serial
@pytest.mark.parametrize(
    "stress",
    [
        f"initial_stress = {{K0 = 0.5, unit_weight = {WEIGHT}, level = 2.0}}",
        f'initial_stress = ["{-WEIGHT}*0.5*(2-y)", "{-WEIGHT}*(2-y)", "{-WEIGHT}*0.5*(2-y)", 0]',
    ],
)
def test_ground_with_its_stress_does_not_move(tmp_path: Path, stress: str) -> None:
    """K0 = 1/2 is given: the stage of gravity finds it in equilibrium, to rounding."""
    state = write(tmp_path, stress=stress).run(MPI.COMM_SELF, progress=False).state
    alone = write(tmp_path).run(MPI.COMM_SELF, progress=False).state
    sigma = state.memory["material_0_sigma"]
    assert sigma[..., 0] == pytest.approx(0.5 * sigma[..., 1], rel=1e-12)
    assert np.abs(state.u).max() <= 1e-12 * np.abs(alone.u).max()


def test_stress_of_level_ground_in_space() -> None:
    """Three metres below a surface with a surcharge; none of the ground is above it."""
    stress = Geostatic(K0=0.5, unit_weight=20e3, level=1.0, surcharge=4e3)
    rows = stress(np.array([[0.0, 5.0, -2.0], [0.0, 0.0, 3.0]]))
    assert rows.tolist() == [[-32e3, -32e3, -64e3, 0, 0, 0], [-2e3, -2e3, -4e3, 0, 0, 0]]


K0 = f"initial_stress = {{K0 = 0.2, unit_weight = {WEIGHT}, level = 2.0}}"


@pytest.mark.serial
@pytest.mark.parametrize(
    ("material", "stress", "words"),
    [
        (MOHR.replace('"30 deg"', "0"), "", "phi and cohesion are both zero"),
        (MOHR.replace("psi = 0", "psi = 40"), "", "psi = 40 degrees is more than phi = 30 degrees"),
        (MOHR.replace('"30 deg"', "0.5"), "", "angles are in degrees and not in radians"),
        (MOHR.replace('"30 deg"', '"30 kPa"'), "", "'kPa' is not a unit of it: give it in deg"),
        (
            'type = "Iwan"\ncurve = [[1e-4, 0.5], [1e-3, 0.6]]',
            "",
            "G/Gmax of curve rises",
        ),
        (
            'type = "J2"\nyield_stress = 1e5\nisotropic = -1e6',
            "",
            "answers of softening depend on the mesh",
        ),
        (MOHR, 'section = {type = "PlaneStress", thickness = 1.0}', "is for plane strain"),
        (
            MOHR,
            K0,
            "outside of the yield surface of MohrCoulomb at 32 points, most at (0.211325, 0.2113",
        ),
        (MOHR, 'initial_stress = {K0 = "1 m", unit_weight = 1, level = 2}', "is not a unit of it"),
    ],
)
def test_bad_soil_is_refused_in_a_sentence(
    tmp_path: Path, material: str, stress: str, words: str
) -> None:
    with pytest.raises(vc.InputError) as caught:
        case = write(tmp_path, material, stress)
        case.check()
        case.problem(MPI.COMM_SELF)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.serial
def test_check_prints_the_soil(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Angles and cohesion, and how cells are integrated."""
    from vi_contact.practice.cli import main

    write(tmp_path)
    path = tmp_path / "ground.toml"
    assert main(["run", str(path), "--check", "--out", str(tmp_path / "out")]) == 0
    said = capsys.readouterr().out
    assert "angle of friction phi       30  deg" in said
    assert "angle of dilatancy psi" in said and "one mean dilatation a cell (bbar)" in said
