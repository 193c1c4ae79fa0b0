"""Joints of their own for each [[contact]]: as the Python interface has them, and what is
refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

from vi_contact import laws
from vi_contact.core.errors import InputError
from vi_contact.practice.studies import read_case

COMM = MPI.COMM_WORLD
# A block on a base that is bound to it, pushed at its left side.
BLOCK = """
[mesh]
type = "BlockMesh"
lengths = [2.0, 4.0]
divisions = [8, 8]
[material.body]
E = 1e9
nu = 0.2
rho = 2000.0
[system]
damping = {type = "Rayleigh", alpha = 0.0, beta = 1e-3}
[[system.loads]]
type = "BodyForce"
value = [0.0, -20000.0]
[[system.loads]]
type = "Traction"
facets = "left"
value = ["60 kPa", 0.0]
history = "min(t / 0.2, 1)"
[[contact]]
facets = "bottom"
obstacle = {type = "HalfSpace", point = [0.0, 0.0], normal = [0.0, 1.0]}
joint = {mu = 0.8, cohesion = "100 kPa", tension = "min(50000, 50000 + 0*x)", opening = "0.2 mm"}
[run]
dt = "2 ms"
t_end = 0.24
"""


def written(folder: Path, text: str = BLOCK) -> Path:
    path = folder / "block.toml"
    if COMM.rank == 0:
        path.write_text(text, encoding="utf-8")
    COMM.Barrier()
    return path


@pytest.mark.long
def test_a_joint_of_a_table_is_that_of_python(shared_tmp: Path) -> None:
    case = read_case(written(shared_tmp))
    problem = case.problem(COMM)
    law = laws.Joint(mu=0.8, cohesion=1e5, tension=5e4, opening=2e-4)
    count = problem.surface.count
    for name in ("mu", "cohesion", "tension", "opening"):
        assert np.allclose(problem.joint.spread(name, count), law.spread(name, count), rtol=1e-12)
    run = case.run(COMM, out=shared_tmp / "run", progress=False)
    assert run.history["certificate"].max() < 1e-9
    assert run.history["loss_fracture"][-1] > 0.0
    assert run.history["energy_joint"].max() > 0.0


@pytest.mark.long
@pytest.mark.serial  # ranks: the joint of a table
def test_tables_may_have_other_joints(shared_tmp: Path) -> None:
    """The base is bound, and the top, which is open, rubs only."""
    second = (
        '[[contact]]\nfacets = "top"\nmu = 0.3\n'
        'obstacle = {type = "HalfSpace", point = [0.0, 4.05], normal = [0.0, -1.0]}\n[run]'
    )
    case = read_case(written(shared_tmp, BLOCK.replace("[run]", second)), ["run.t_end=0.22"])
    problem = case.problem(COMM)
    run = case.run(COMM, out=shared_tmp / "run", progress=False)
    surface = problem.surface
    down = surface.normals[:, 1] < -0.5
    kappa = run.state.memory["joint_kappa"]
    assert surface.some(down) and surface.some(~down)
    assert surface.some(kappa[down] > 2e-4)
    strength = problem.joint.strength(
        problem.joint.start(surface.count),
        *(np.zeros(surface.count),) * 2,
        *(np.zeros(surface.tangents.shape),) * 2,
        0.0,
    )
    assert np.all(strength.tension[~down] == 0.0) and np.all(strength.mu[~down] == 0.3)
    assert np.allclose(strength.tension[down], 5e4) and np.all(strength.mu[down] == 0.8)
    assert run.history["certificate"].max() < 1e-9


@pytest.mark.serial
def test_lambda_is_told_by_a_check(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    from vi_contact.practice.cli import main

    path = written(tmp_path)
    assert main(["run", str(path), "--check", "--out", str(tmp_path / "out")]) == 0
    told = capsys.readouterr().out
    assert "joint: lambda of a step" in told and "Joint" in told


@pytest.mark.serial
def test_words_of_laws_are_read(tmp_path: Path) -> None:
    joint = (
        read_case(written(tmp_path, BLOCK.replace('opening = "0.2 mm"', 'softening = "brittle"')))
        .problem(COMM)
        .joint
    )
    assert joint.softening == "brittle"
    start = BLOCK.index("joint = {")
    end = BLOCK.index("[run]")
    fault = 'joint = {type = "RateAndState", a = 0.01, b = 0.015, mu0 = 0.6, V0 = 1e-6, dc = 1e-4, '
    text = f'{BLOCK[:start]}{fault}law = "slip"}}\n{BLOCK[end:]}'
    assert read_case(written(tmp_path, text)).problem(COMM).joint.law == "slip"


@pytest.mark.serial
@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("joint = {", "mu = 0.5\njoint = {", "has mu beside joint"),
        ("mu = 0.8", "mu = 8.0", "cohesion is less than mu times tension"),
        ('opening = "0.2 mm"', 'opening = "-0.2 mm"', "opening"),
        ('opening = "0.2 mm"', 'opening = "0.2 mm", energy = 3.0', "give either energy or opening"),
        ("joint = {", 'joint = {type = "Glue", ', "Glue"),
        ("joint = {", 'joint = {softening = "soft", ', "give 'linear' or 'brittle' or 'constant'"),
        ("[run]", '[impact]\ntype = "Inelastic"\n[run]', "leave impact out"),
    ],
)
def test_bad_joints_of_tables_are_refused(tmp_path: Path, old: str, new: str, words: str) -> None:
    text = BLOCK.replace('"min(50000, 50000 + 0*x)"', "50000.0").replace(old, new, 1)
    with pytest.raises(InputError, match=words):
        read_case(written(tmp_path, text)).problem(COMM)
