"""Case files whose stages add and remove bodies: restarts, contact, and what is refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from mpi4py import MPI

from vi_contact import InputError, StepFailure
from vi_contact.practice.plots.deformed import read_frames
from vi_contact.practice.studies import read_case

GEO = """
// A pit beside a block: ground of three parts, and a block that is placed on the left one.
w = 2.0;
h = 1.0;
Point(1) = {0, 0, 0, 0.5};
Point(2) = {w, 0, 0, 0.5};
Point(3) = {w, h, 0, 0.5};
Point(4) = {0, h, 0, 0.5};
Point(5) = {w, 2 * h, 0, 0.5};
Point(6) = {0, 2 * h, 0, 0.5};
Line(1) = {1, 2};
Line(2) = {2, 3};
Line(3) = {3, 4};
Line(4) = {4, 1};
Line(5) = {3, 5};
Line(6) = {5, 6};
Line(7) = {6, 4};
Curve Loop(1) = {1, 2, 3, 4};
Plane Surface(1) = {1};
Curve Loop(2) = {-3, 5, 6, 7};
Plane Surface(2) = {2};
Point(11) = {0, 2 * h, 0, 0.5};
Point(12) = {w, 2 * h, 0, 0.5};
Point(13) = {w, 3 * h, 0, 0.5};
Point(14) = {0, 3 * h, 0, 0.5};
Line(11) = {11, 12};
Line(12) = {12, 13};
Line(13) = {13, 14};
Line(14) = {14, 11};
Curve Loop(3) = {11, 12, 13, 14};
Plane Surface(3) = {3};
Physical Surface("ground") = {1};
Physical Surface("fill") = {2};
Physical Surface("block") = {3};
Physical Curve("bottom") = {1};
Physical Curve("fill_top") = {6};
Physical Curve("block_bottom") = {11};
Physical Curve("sides") = {2, 4, 5, 7};
"""
SOIL = (
    'E = "20 MPa"\nnu = 0.3\nrho = 2000\ntype = "MohrCoulomb"\ncohesion = 2e4\nphi = 30\npsi = 30\n'
)
CASE = f"""
title = "A block on fill"
[mesh]
type = "GeoFile"
path = "pit.geo"
[material.ground]
{SOIL}
[material.fill]
{SOIL}
[material.block]
E = "1 GPa"
nu = 0.2
rho = 2400
[system]
degree = 2
fixed = "bottom"
damping = {{type = "Rayleigh", alpha = 0.0, beta = 1e-3}}
[gravity]
[[contact]]
type = "contact_pair"
name = "foot"
facets1 = "block_bottom"
facets2 = "fill_top"
[friction]
type = "Coulomb"
mu = 0.5
[[excitation]]
type = "Ricker"
amplitude = 3.0
frequency = 6.0
[run]
dt = 0.005
steps = 12
[[stage]]
name = "ground"
type = "static"
[[stage]]
name = "fill"
type = "static"
add = "fill"
[[stage]]
name = "block"
type = "static"
add = ["block"]
[[stage]]
name = "shock"
type = "dynamic"
[[stage]]
name = "rest"
type = "static"
remove = "block"
[[stage]]
name = "again"
type = "dynamic"
"""
WEIGHT = 2400 * 9.80665 * 2.0  # N/m


def write(folder: Path, text: str = CASE) -> Path:
    (folder / "pit.geo").write_text(GEO)
    path = folder / "pit.toml"
    path.write_text(text)
    return path


@pytest.mark.long
@pytest.mark.serial
def test_a_restart_of_lifts_is_the_straight_run(tmp_path: Path) -> None:
    """Six stages, a quake between: stopped in the first motion, and gone on, the last state is the
    same to the last bit; every ledger is closed, and the block has stood on the fill."""
    path = write(tmp_path)
    straight = read_case(path).run(MPI.COMM_SELF, progress=False, out=tmp_path / "straight")
    assert straight.facts["energy_defect"] <= 1e-9
    folder = tmp_path / "halves"
    short = path.with_name("short.toml")
    short.write_text(CASE.replace("steps = 12", "steps = 5"))
    read_case(short).run(MPI.COMM_SELF, progress=False, out=folder)
    gone_on = read_case(path).run(MPI.COMM_SELF, progress=False, out=folder, restart=True)
    assert np.array_equal(gone_on.state.u, straight.state.u)
    for name, values in straight.state.memory.items():
        assert np.array_equal(gone_on.state.memory[name], values)
    block = np.genfromtxt(
        tmp_path / "straight" / "stages" / "3_block" / "history.csv", delimiter=",", names=True
    )
    assert block["contact_force_y"] == pytest.approx(WEIGHT, rel=1e-7)


@pytest.mark.serial
@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('name = "fill"\ntype = "static"', 'name = "fill"\ntype = "dynamic"', "adds or removes a"),
        ('remove = "block"', 'remove = "fill_2"', "fill_2"),
        ('add = ["block"]', 'add = ["fill"]', "adds 'fill', which is there"),
        ('remove = "block"', "remove = 3", "remove = 3: give the name of a cell group, or a list"),
        (
            'name = "ground"\ntype = "static"',
            'name = "ground"\ntype = "static"\nadd = "fill"',
            "is not the first",
        ),
    ],
)
def test_wrong_lifts_are_refused_in_a_sentence(
    tmp_path: Path, old: str, new: str, words: str
) -> None:
    with pytest.raises(InputError) as caught:
        case: Any = read_case(write(tmp_path, CASE.replace(old, new, 1)))
        case.problem(MPI.COMM_SELF)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


@pytest.mark.serial
@pytest.mark.parametrize("kind", ["XDMF", "VTKHDF"])
def test_frames_have_the_bodies_that_are_there(tmp_path: Path, kind: str) -> None:
    """Ground alone, with fill, with the block, and without it again: the area of the cells of each
    stage, every node is of a cell, and the picture of the model has the same bodies."""
    text = CASE.replace("steps = 12", "steps = 2").replace(
        "[[excitation]]", f'[fields]\ntype = "{kind}"\nevery = 2\n[[excitation]]'
    )
    out = tmp_path / "out"
    read_case(write(tmp_path, text)).run(MPI.COMM_SELF, progress=False, out=out)
    areas = {"stages/1_ground": 2.0, "stages/2_fill": 4.0, "stages/4_shock": 6.0, ".": 4.0}
    for folder, area in areas.items():
        frames = read_frames(out / folder)
        corners = frames.points[frames.cells]
        sides = corners[:, 1:] - corners[:, :1]
        assert np.abs(np.linalg.det(sides)).sum() / 2.0 == pytest.approx(area, rel=1e-12)
        assert frames.points[:, 1].max() == pytest.approx(area / 2.0)
        _, u, stress = frames.at(0.0)
        assert u.shape == frames.points.shape
        assert np.all(stress > 0.0)
        model = json.loads((out / folder / "model.json").read_text())
        drawn = [np.array(part["lines"]) for part in model["outline"] if part["lines"]]
        lines = np.concatenate(drawn)
        assert lines[:, [1, 3]].max() == pytest.approx(area / 2.0)
    # what is placed touches what has settled, and a linear body is called so
    model = json.loads((out / "stages" / "3_block" / "model.json").read_text())
    assert np.abs(model["contact"][0]["gaps"]).max() <= 1e-12
    assert [body["material"]["type"] for body in model["bodies"]][-1] == "LinearElastic"


@pytest.mark.serial
def test_what_is_absent_is_named(tmp_path: Path) -> None:
    """A record of a part whose bodies are absent, and a body that loses what it stands on: one
    sentence each, which names the stage or the part."""
    record = '[[record]]\ntype = "Resultants"\nname = "foot"\npart = "foot"\n'
    early = write(tmp_path, CASE.replace("[[stage]]", record + "[[stage]]", 1))
    with pytest.raises(InputError, match="part 'foot': nothing is in contact there while bodies"):
        read_case(early).run(MPI.COMM_SELF, progress=False)
    short = CASE[: CASE.index('[[stage]]\nname = "shock"')]
    gone = write(tmp_path, short + '[[stage]]\nname = "dug"\ntype = "static"\nremove = "fill"\n')
    with pytest.raises(StepFailure, match=r"'dug': .* nothing holds the body of .* nodes"):
        read_case(gone).run(MPI.COMM_SELF, progress=False)


@pytest.mark.serial
def test_a_body_that_is_taken_away_and_placed_again(tmp_path: Path) -> None:
    """The block goes and comes back, and fill and block come at once: it stands with its weight,
    and the supports carry what is there."""
    head = CASE[: CASE.index("[[stage]]")].replace("steps = 12", "steps = 2")
    reactions = (
        '[[record]]\ntype = "Contact"\n[[record]]\ntype = "Reactions"\nname = "rock"\n'
        'facets = "bottom"\ncentre = [1.0, 0.0]\ngravity = [0.0, -9.80665]\n'
    )

    def list_stages(*rows: tuple[str, str]) -> str:
        tables = []
        for number, (verb, bodies) in enumerate(rows):
            table = f'[[stage]]\nname = "s{number}"\ntype = "static"\n'
            tables.append(table + (f"{verb} = {bodies}\n" if verb else ""))
        return "".join(tables)

    ways = {
        "again": (("", ""), ("add", '"fill"'), ("add", '"block"'), ("remove", '"block"')),
        "at once": (("", ""), ("add", '["fill", "block"]')),
    }
    for name, rows in ways.items():
        if name == "again":
            rows = (*rows, ("add", '"block"'))
        path = write(tmp_path, head + reactions + list_stages(*rows))
        history = read_case(path).run(MPI.COMM_SELF, progress=False).history
        assert history["contact_force_y"][-1] == pytest.approx(WEIGHT, rel=1e-7)
        soil = 2000 * 9.80665 * 4.0
        assert history["reaction_y_rock"][-1] == pytest.approx(soil + WEIGHT, rel=1e-8)
