"""Cases whose joints are found from the geometry."""

from __future__ import annotations

from pathlib import Path

import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

from vi_contact.core.errors import InputError
from vi_contact.practice.studies.cases.case import read_case
from vi_contact.practice.studies.cases.description.model import describe

COMM = MPI.COMM_WORLD
COLUMN = """
[mesh]
type = "DrumsMesh"
drums = 3
ground = 0.5
divisions = [4, 4]

[material.drum]
E = "25 GPa"
nu = 0.2
rho = 2400.0

[system]
fixed = "ground_bottom"

[gravity]

[mass]
type = "ConsistentMass"

[run]
dt = 0.001
steps = 0
"""
FRICTION = """
[friction]
type = "Coulomb"
mu = 0.6
"""


def write(tmp_path: Path, text: str) -> Path:
    path = Path(COMM.bcast(str(tmp_path / "case.toml")))
    if COMM.rank == 0:
        path.write_text(COLUMN + text)
    COMM.barrier()
    return path


def test_one_table_has_all_joints(tmp_path: Path) -> None:
    """Three joints of five points: the column stands, and the description counts them together."""
    case = read_case(write(tmp_path, FRICTION + '[[contact]]\ntype = "contact_pairs"\n'))
    parts = case.parts(COMM)
    assert (parts.surface.total, parts.tables) == (15, (3,))
    (contact,) = describe(case, COMM, parts)["contact"]
    assert (contact["name"], contact["points"]) == ("all joints", 15)
    assert contact["size"] == pytest.approx(3.0)
    assert contact["mu"] == 0.6


def test_tables_of_joints_and_of_groups_have_friction_of_their_own(tmp_path: Path) -> None:
    """The drums rub on each other by 0.4, and the lowest on the ground by 0.7."""
    text = """
[[contact]]
type = "contact_pairs"
between = ["drums"]
mu = 0.4
name = "drums"

[[contact]]
type = "contact_pairs"
between = ["drums", "ground"]
mu = 0.7
name = "foot"
"""
    case = read_case(write(tmp_path, text))
    parts = case.parts(COMM)
    assert parts.tables == (2, 1)
    # each rank has the values of its own points
    mu = sum(COMM.allgather(list(case.problem(COMM, parts).friction.mu)), [])
    assert sorted(mu) == 10 * [0.4] + 5 * [0.7]
    contacts = describe(case, COMM, parts)["contact"]
    assert [contact["name"] for contact in contacts] == ["drums", "foot"]
    assert [contact["points"] for contact in contacts] == [10, 5]


def test_bodies_that_touch_nowhere_are_told_in_words_of_the_case(tmp_path: Path) -> None:
    text = '[[contact]]\ntype = "contact_pairs"\nbetween = ["drum_1", "drum_3"]\n'
    with pytest.raises(InputError, match="no two bodies touch within 0 m"):
        read_case(write(tmp_path, text)).parts(COMM)


def test_a_column_that_nothing_holds_is_told_by_its_bodies(tmp_path: Path) -> None:
    """Without ground all drums fall as one: how many, and where one of them is."""
    path = write(tmp_path, FRICTION + '[[contact]]\ntype = "contact_pairs"\n')
    if COMM.rank == 0:
        text = path.read_text().replace("ground = 0.5\n", "")
        path.write_text(text.replace('[system]\nfixed = "ground_bottom"\n', ""))
    COMM.barrier()
    told = r"along \(0, -1\).*\(3 of 3 bodies move, such as that at \(0, 0.5\)\): hold it there"
    with pytest.raises(InputError, match=told):
        read_case(path).run(COMM, progress=False)


@pytest.mark.long
def test_a_wall_has_joints_and_a_foot(tmp_path: Path) -> None:
    """Stones in running bond, T joints and all: both tables have their points, and
    friction of its own."""
    path = Path(COMM.bcast(str(tmp_path / "wall.toml")))
    if COMM.rank == 0:
        path.write_text(WALL)
    COMM.barrier()
    case = read_case(path)
    parts = case.parts(COMM)
    assert parts.tables == (13, 3)
    contacts = describe(case, COMM, parts)["contact"]
    told = [(contact["name"], contact["mu"], contact["points"]) for contact in contacts]
    assert told == [("joints", 0.65, 26), ("foot", 0.5, 7)]


WALL = """
[mesh]
type = "MasonryMesh"
stones = 2
courses = 3
half_first = true
ground = 0.2
divisions = [2, 1]

[material.stones]
E = "5 GPa"
nu = 0.2
rho = 2000.0

[material.ground]
E = "5 GPa"
nu = 0.2
rho = 2000.0

[system]
fixed = "ground_bottom"

[gravity]

[[contact]]
type = "contact_pairs"
between = ["stones"]
name = "joints"
mu = 0.65

[[contact]]
type = "contact_pairs"
between = ["stones", "ground"]
name = "foot"
mu = 0.5

[mass]
type = "ConsistentMass"

[run]
dt = 0.002
steps = 0
"""
