"""[reservoir] in case files, and what --check tells of it and of a joint law."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

from vi_contact.core.errors import InputError
from vi_contact.core.units import STANDARD_GRAVITY as G
from vi_contact.practice.studies.cases.case import read_case
from vi_contact.practice.studies.cases.description.doubts import find_warnings
from vi_contact.practice.studies.cases.description.model import describe
from vi_contact.practice.studies.cases.description.tables import input_tables, print_tables
from vi_contact.practice.units.report_units import ReportUnits

COMM = MPI.COMM_WORLD
DAM = """
[mesh]
type = "BlockMesh"
lengths = [6.0, 10.0]
divisions = [6, 10]

[material.body]
E = "25 GPa"
nu = 0.2
rho = 2400.0

[reservoir]
face = "left"
level = "9 m"
model = "incompressible"
silt = "2 m"
tail_face = "right"
tail = "2 m"

[gravity]

[[contact]]
name = "base"
facets = "bottom"
obstacle = {type = "HalfSpace", point = [0.0, 0.0], normal = [0.0, 1.0]}

[contact.joint]
mu = 0.8
cohesion = "300 kPa"
tension = "50 kPa"
energy = "100 N/m"

[contact.joint.water]
heel = ["0 m", "0 m"]
toe = ["6 m", "0 m"]
level = "9 m"
drain = "1 m"
quake = "none"

[[record]]
type = "Uplift"

[[stage]]
name = "dry"
type = "static"
reservoir = {face = "left", level = "1 m", model = "at rest"}

[[stage]]
name = "full"
type = "static"
"""


def write(folder: Path, text: str) -> Path:
    """The case on all ranks."""
    path = Path(COMM.bcast(str(folder / "case.toml")))
    if COMM.rank == 0:
        path.write_text(text, encoding="utf-8")
    COMM.barrier()
    return path


def described(path: Path) -> tuple[dict[str, Any], str]:
    """The model of the last stage, and the tables of --check."""
    case = read_case(path)
    model = describe(case, COMM, case.parts(COMM))
    return model, print_tables(input_tables(model, ReportUnits()))


def test_a_reservoir_is_a_table_and_its_loads_are_told(tmp_path: Path) -> None:
    """Levels with their units; gamma h²/2 of water, silt and tail water, each with its row."""
    model, text = described(write(tmp_path, DAM))
    forces = {load["name"]: load["force"][0] for load in model["loads"] if load["force"]}
    wanted = {
        "water on 'left'": 1000.0 * G * 81.0 / 2.0,
        "silt on 'left'": 0.5 * 9000.0 * 2.0,
        "tail water on 'right'": -1000.0 * G * 4.0 / 2.0,
    }
    assert {name: forces[name] for name in wanted} == pytest.approx(wanted, rel=1e-9)
    rows = [" ".join(line.split()) for line in text.splitlines()]
    for row in ("level 9 m", "model incompressible", "base: cohesion 300 kPa"):
        assert row in rows
    assert "base: water: toe (6, 0) m" in rows and "base: water: quake none" in rows
    assert max(len(line) for line in text.splitlines()) < 200


def test_unlike_levels_of_reservoir_and_joint_are_doubted(tmp_path: Path) -> None:
    """A level that one table alone has is told, with both heights."""
    joined = DAM.replace('drain = "1 m"', 'drain = "1 m"\ntail = "2 m"')
    lower = joined.replace('level = "9 m"\nmodel', 'level = "8 m"\nmodel')
    for text, words in (
        (joined, []),
        (DAM, ["the tail water stands at 2 m in [reservoir] and at no height in the joint 'base'"]),
        (lower, ["the water stands at 8 m in [reservoir] and at 9 m in the joint 'base'"]),
    ):
        model, _ = described(write(tmp_path, text))
        said = [one.partition(":")[0] for one in find_warnings(model) if "[reservoir]" in one]
        assert said == words


def test_a_stage_has_its_own_level(shared_tmp: Path) -> None:
    """The thrust that the joint carries is that of the stage, and M has the water's mass."""
    path = write(shared_tmp, DAM)
    case = read_case(path)
    dry, full = (stage.case for stage in case.stages)
    masses = []
    for stage in (dry, full):
        system = stage.parts(COMM).system
        r = np.array([1.0, 0.0])
        masses.append(float(COMM.allreduce(system.influence[:, 0] @ system.inertia(r))))
    body = 2400.0 * 60.0
    assert masses[0] == pytest.approx(body, rel=1e-9)
    # 0.5428 rho h² of a rigid wall, whose water is meshed by ten rows
    assert masses[1] - body == pytest.approx(0.5428 * 1000.0 * 81.0, rel=0.02)
    run = case.run(COMM, out=shared_tmp / "out", progress=False)
    head = 1000.0 * G * 9.0
    drained = head / 3.0
    uplift = 0.5 * (head + drained) * 1.0 + 0.5 * drained * 5.0
    assert run.history["uplift_force"][-1] == pytest.approx(uplift, rel=1e-9)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("[reservoir]", "[system.reservoir]", r"\[system\] has the key 'reservoir'.*\[reservoir\]"),
        ('level = "9 m"\nmodel', 'level = "9 kN"\nmodel', r"\[reservoir\] level"),
        ('level = "9 m"\nmodel', 'level = "19 m"\nmodel', r"Reservoir: the level 19 m is above"),
        ('silt = "2 m"', 'slit = "2 m"', r"unknown key 'slit' for Reservoir: did you mean silt"),
        ('toe = ["6 m"', 'toe = ["-6 m"', r"\[contact\[1\].joint\] JointWater: heel .* not the e"),
        ('cohesion = "300 kPa"', 'cohesion = "1e5*(x-3)"', r"\[contact\[1\].joint\] Joint: the c"),
        ('silt = "2 m"', "silt_ratio = 0.4", r"\[reservoir\] silt_ratio is of silt, and there is"),
        ('drain = "1 m"', "efficiency = 0.5", r"water\] efficiency is of drains, and there are n"),
        ('face = "left"', 'face = "lefft"', r"\[reservoir\] face is 'lefft'"),
    ],
)
def test_wrong_reservoirs_are_refused_in_words_of_the_file(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    """One sentence with table, key and remedy."""
    with pytest.raises(InputError, match=words):
        case = read_case(write(tmp_path, DAM.replace(old, new)))
        case.problem(COMM)
