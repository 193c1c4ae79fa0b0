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
