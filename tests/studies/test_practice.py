"""The cases that ``vi-contact new`` writes, with large cells and 200 steps of their motion:
equilibrium under gravity and water in closed form, one number of each beside a formula, and motions
that certificate and ledger vouch for."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")
pytest.importorskip("gmsh")

from mpi4py import MPI

import vi_contact as vc
from vi_contact import engineering
from vi_contact.core.units import STANDARD_GRAVITY as G
from vi_contact.practice.cli.entry import main
from vi_contact.practice.studies import comparisons, read_case
from vi_contact.practice.studies.cases.library import STARTERS
from vi_contact.practice.studies.cases.stages import run_leading_stages

pytestmark = pytest.mark.serial
LARGE = "mesh.refine=0"  # the quick size that each case names
# of the weight: sums of forces and moments of linear equations that are solved to round-off
EXACT = 1e-9


def settings(name: str) -> list[str]:
    """The options of the quick run in the head of a case, as settings."""
    head = (STARTERS / f"{name}.toml").read_text("utf-8").split("title =")[0]
    assert f"vi-contact run {name}.toml --set {LARGE} --steps 200" in head
    # strong at once
    return [
        LARGE,
        "run.steps=200",
        "run.t_end=",
        "fields=",
        "excitation.1.record.envelope.rise=0.2",
    ]


def run(name: str, out: Path, *more: str) -> Any:
    """The history of the quick size; certificate, ledger and what friction may carry hold in every
    step."""
    found = read_case(STARTERS / f"{name}.toml", [*settings(name), *more]).run(
        MPI.COMM_SELF, out=out, progress=False
    )
    history = found.history
    assert len(history["t"]) == 201 and history["certificate"].max() < 1e-10
    energy = max(
        np.abs(history[name]).max() for name in ("energy_strain", "energy_kinetic", "work_input")
    )
    assert np.abs(history["energy_defect"]).max() < 1e-10 * energy
    assert history["contact_min_gap"].min() >= 0.0 and history["work_input"].max() > 0.0
    return history


@pytest.mark.long
@pytest.mark.parametrize("name", ["wall", "dam", "culvert"])
def test_starter_is_written_and_checked(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """``new`` copies case and script into any folder, and --check reads them there."""
    assert main(["new", name, str(tmp_path / "mine")]) == 0
    assert sorted(one.name for one in (tmp_path / "mine").iterdir()) == [
        f"{name}.geo",
        f"{name}.toml",
    ]
    case = str(tmp_path / "mine" / f"{name}.toml")
    assert main(["run", case, "--check", "--set", LARGE, "--out", str(tmp_path / "checked")]) == 0
    assert "contact" in capsys.readouterr().out


@pytest.mark.long
def test_from_new_to_report_in_four_commands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Those that ``new`` prints, in the quick size, in any folder."""
    monkeypatch.chdir(tmp_path)
    assert main(["new", "pier"]) == 0
    commands = [
        line.split()[1:] for line in capsys.readouterr().out.split("next:")[1].splitlines() if line
    ]
    quick = ["--quiet", "--set", LARGE, "--set", "fields="]
    assert main([*commands[0], *quick]) == 0
    assert main([*commands[1], *quick, "--set", "run.t_end=", "--steps", "20"]) == 0
    assert (
        main(commands[2]) == 0
        and (tmp_path / "results" / "pier" / "report.pdf").stat().st_size > 10_000
    )


@pytest.mark.long
def test_wall_stands_between_active_pressure_and_that_at_rest(tmp_path: Path) -> None:
    """At rest the faces together carry the wall's weight and no shear, the rock carries all, and
    the thrust on the stem lies between Rankine's of a dense sand and K0 of the elastic soil;
    shaken, the wall is pushed away from its fill."""
    history = run("wall", tmp_path)
    wall, fill = 2500.0 * G * (0.5 * 5.4 + 4.0 * 0.6), 1900.0 * G * (18.5 * 6.0 - 2.5 * 0.6)
    whole = wall + fill + 2000.0 * G * 30.0 * 6.0
    across = history["contact_force_x"] + history["friction_force_x"]
    up = history["contact_force_y"] + history["friction_force_y"]
    assert abs(across[0]) < EXACT * wall and up[0] == pytest.approx(wall, rel=EXACT)
    assert history["reaction_y_rock"][0] == pytest.approx(whole, rel=EXACT)
    soil = 0.5 * 1900.0 * G * 5.4**2
    # phi = 40 degrees
    assert np.tan(np.radians(25.0)) ** 2 * soil < history["N_stem"][0] < 0.3 / 0.7 * soil
    # the elastic fill leans back from the top of the stem
    assert 0.1 * 5.4 < history["height_stem"][0] < 5.4 / 3.0
    assert np.all(np.abs(history["T_base"]) <= 0.5 * history["N_base"] * (1.0 + 1e-9))
    assert history["N_stem"].max() > 1.05 * history["N_stem"][0]
    found = {one.name: one for one in comparisons(tmp_path)}
    checks = ("AtRest", "Rankine", "CoulombWedge", "MononobeOkabe", "Wood", "VeletsosYounan")
    assert [name for name in found if ", moment" not in name] == list(checks)
    assert found["Rankine"].expected == pytest.approx(
        np.tan(np.radians(28.0)) ** 2 * soil, rel=1e-9
    )
    assert (
        found["Rankine"].found == history["N_stem"][0]
        and found["MononobeOkabe"].found == history["N_stem"].max()
    )


@pytest.mark.long
def test_wall_shares_its_gravity_stage_and_its_matrices_over_records() -> None:
    """What a study computes once for all records, without a folder for the fields that the case
    writes."""
    reached, parts, state = run_leading_stages(
        read_case(STARTERS / "wall.toml", [LARGE]), MPI.COMM_SELF
    )
    assert reached is not None and reached.number == 1 and parts.steady and state is not None
    assert state.r_n.max() > 0.0


@pytest.mark.long
@pytest.mark.promise("guide/practice.md", "the run has them to nine digits")
def test_dam_has_the_resultant_of_weight_water_and_uplift(tmp_path: Path) -> None:
    """N = W, T = -H and their eccentricity, uplift with drains and safety with cohesion, in closed
    form; under a strong motion the joint cracks, slides, and has lost what fracture took."""
    # the joint is solved to a tenth of the tolerance; large cells have a corner at 6 m, where the
    # line of the pressure has its kink
    finer = ("run.tolerance=1e-10", "contact.1.joint.water.drain=6.0")
    history = run("dam", tmp_path, "excitation.1.scale=3.0", *finer)
    weight, arm = 700.0 * 2400.0 * G, (200.0 * 2.5 + 500.0 * (5.0 + 25.0 / 3.0)) / 700.0
    head = 1000.0 * G * 36.0
    water = 0.5 * head * 36.0
    left = 1.0 - 0.6667  # by the drains
    uplift = 0.5 * head * ((1.0 + left) * 6.0 + left * 24.0)
    e = arm + water * 12.0 / weight - 15.0  # from the middle, towards the toe
    assert history["N_joint"][0] == pytest.approx(weight, rel=EXACT)
    assert history["uplift_force"] == pytest.approx(np.full(201, uplift), rel=EXACT)  # kept
    assert history["uplift_effective"][0] == pytest.approx(weight - uplift, rel=EXACT)
    assert history["T_joint"][0] == pytest.approx(-water, rel=EXACT)
    assert history["e_joint"][0] == pytest.approx(e, rel=1e-8)
    safety = (0.75 * (weight - uplift) + 3e5 * 30.0) / water  # 3.09 against sliding
    # an end of the joint slips by less than a micrometre and loses a little of its cohesion
    assert 0.999 * safety < 1.0 / (1.0 - history["margin_joint"][0]) < safety
    assert history["sliding_joint"][0] < 1e-6

    # nothing has cracked at rest; a square metre of crack takes 100 J
    assert history["crack_length"][0] == 0.0 and history["crack_length"].max() > 3.0
    assert 10.0 < history["loss_fracture"][-1] <= 100.0 * 30.0
    assert history["sliding_joint"][-1] - history["sliding_joint"][0] > 1e-4
    model = json.loads((tmp_path / "model.json").read_text("utf-8"))
    assert [part["name"] for part in model["contact"]] == ["joint"]
    toes = json.loads((tmp_path / "columns.json").read_text("utf-8"))
    assert "at the toe" in toes["pressure_high_joint"]["meaning"]


@pytest.mark.long
@pytest.mark.promise(
    "guide/practice.md", "a beam with shear and a rigid deck, to 0.2 %", bound="1 %"
)
def test_pier_rocks_within_the_moment_that_overturns_it(tmp_path: Path) -> None:
    """Its weight on the raft; N never acts beyond the edge, so that |M| <= N B/2, as the raft lifts
    off; clamped at its foot and with stiff raft and deck it has the frequency of a beam with shear,
    consistent mass and a rigid deck."""
    history = run("pier", tmp_path, "excitation.1.scale=3.0")
    weight = (2500.0 * (7.0 * 1.5 + 2.0 * 9.0) + 6000.0 * 6.0 * 1.5) * G
    assert (
        history["N_raft"][0] == pytest.approx(weight, rel=EXACT)
        and abs(history["e_raft"][0]) < 1e-6 * 7.0
    )
    assert np.all(np.abs(history["M_raft"]) <= 3.5 * history["N_raft"] * (1.0 + 1e-9))
    assert history["uplift_raft"].max() > 0.1 and np.abs(history["theta_raft"]).max() > 1e-4
    clamped = [
        LARGE,
        "contact=",
        "friction=",
        "gravity=",
        "record=",
        "fields=",
        "material.raft.E=3e14",
        "material.deck.E=3e14",
        'system.fixed=["rock", "raft_bottom"]',
    ]
    system = read_case(STARTERS / "pier.toml", clamped).parts(MPI.COMM_SELF).system
    assert engineering.lowest_frequency(system) == pytest.approx(beam_with_deck(), rel=0.01)


def beam_with_deck() -> float:
    """The lowest frequency [Hz] of the pier, clamped at its foot, in deflection and rotation of its
    top."""
    length, width, stiff, shear = 9.0, 2.0, 3e10 / (1.0 - 0.2**2), 3e10 / 2.4
    bending, deck = stiff * width**3 / 12.0, 6000.0 * 6.0 * 1.5
    flexibility = (
        np.array([[length**3 / 3.0, length**2 / 2.0], [length**2 / 2.0, length]]) / bending
    )
    flexibility[0, 0] += length / (5.0 / 6.0 * shear * width)
    beam = (
        2500.0
        * width
        * length
        / 420.0
        * np.array([[156.0, -22.0 * length], [-22.0 * length, 4.0 * length**2]])
    )
    raised = deck * np.array([[1.0, 0.75], [0.75, 0.75**2 + (1.5**2 + 6.0**2) / 12.0]])
    squares = np.linalg.eigvals(np.linalg.solve(beam + raised, np.linalg.inv(flexibility)))
    return float(np.sqrt(squares.min()) / (2.0 * np.pi))


PUSHED = """
[[stage]]
name = "released"
type = "static"
release = true
system = {prescribed = [
    {facets = "left_side", components = [1]},
    {facets = "right_side", components = [1]},
]}

[[stage]]
name = "pushed"
type = "static"
gravity = {acceleration = %r, direction = [%r, %r]}
system = {prescribed = [
    {facets = "left_side", components = [1]},
    {facets = "right_side", components = [1]},
]}
"""


@pytest.mark.long
@pytest.mark.promise(
    "guide/practice.md", "the run agrees with this to 2 %", bound="8 %, beside the box"
)
def test_culvert_racks_with_the_ground(tmp_path: Path) -> None:
    """Under 0.1 g sideways, without time, the free field shears by rho a z/G, and the box by less:
    its frame is stiffer than the soil. Shaken, it carries its weight all the while it accelerates
    with the ground."""
    history = run("culvert", tmp_path / "run")
    weight = 2500.0 * G * (6.0 * 4.0 - 5.0 * 3.0)
    assert history["contact_force_y"][0] + history["friction_force_y"][0] == pytest.approx(
        weight, rel=EXACT
    )
    (found,) = comparisons(tmp_path / "run")
    # it slips at first
    assert found.expected == pytest.approx(0.965, abs=1e-3) and 0.3 < found.found < 1.0
    head, _ = (STARTERS / "culvert.toml").read_text("utf-8").split('[[stage]]\nname = "motion"')
    _, records = (
        (STARTERS / "culvert.toml").read_text("utf-8").split("# What is written of every step")
    )
    (tmp_path / "culvert.geo").write_text((STARTERS / "culvert.geo").read_text("utf-8"), "utf-8")
    size = float(np.hypot(1.0, 0.1))
    text = head + "#" + records + PUSHED % (G * size, 0.1 / size, -1.0 / size)
    (tmp_path / "culvert.toml").write_text(text, "utf-8")
    read_case(tmp_path / "culvert.toml", [LARGE, "fields="]).run(
        MPI.COMM_SELF, out=tmp_path / "out", progress=False
    )
    folders = tmp_path / "out" / "stages" / "1_gravity", tmp_path / "out"
    before, after = (vc.read_run(folder).history for folder in folders)
    sheared, racked = (
        float(after[f"racking_{one}"][0] - before[f"racking_{one}"][0])
        for one in ("free_field", "box")
    )
    strain = 1900.0 * 0.1 * G * 7.0 / (111e6 / 2.6)
    # 20 m from the box, which disturbs it by some per cent
    assert sheared == pytest.approx(strain, rel=0.08)
    assert 0.6 * sheared < racked < 0.9 * sheared
