"""S4.9: Friction of its own for each [[contact]], against blocks that slide by hand."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

from vi_contact.core.errors import InputError
from vi_contact.practice.studies import read_case

COMM = MPI.COMM_WORLD
G, SPEED, ROUGH, SMOOTH = 10.0, 0.2, 0.4, 0.1
# Two blocks side by side on one level ground: each is a body of its own and slides to the right.
BLOCKS = """
[mesh]
type = "TwoBlocks"
lower = {lengths = [1.0, 0.5], divisions = [4, 2]}
upper = {lengths = [1.0, 0.5], divisions = [4, 2]}
gap = 1.0
[material.lower]
E = 1e10
nu = 0.0
rho = 2000.0
[material.upper]
E = 1e10
nu = 0.0
rho = 2000.0
[system]
initial_velocity = [0.2, 0.0]
damping = {type = "Rayleigh", alpha = 0.0, beta = 1e-4}
loads = [{type = "BodyForce", value = [0.0, -20000.0]}]
[[contact]]
name = "rough"
facets = "lower_bottom"
mu = 0.4
obstacle = {type = "HalfSpace", point = [0.0, 0.0], normal = [0.0, 1.0]}
[[contact]]
name = "smooth"
facets = "upper_bottom"
obstacle = {type = "HalfSpace", point = [0.0, 1.5], normal = [0.0, 1.0]}
[friction]
type = "Coulomb"
mu = 0.1
[[record]]
type = "Resultants"
part = "rough"
name = "rough"
[[record]]
type = "Resultants"
part = "smooth"
name = "smooth"
[run]
dt = 5e-4
t_end = 0.3
"""


def written(folder: Path, text: str = BLOCKS) -> Path:
    path = folder / "blocks.toml"
    if COMM.rank == 0:
        path.write_text(text, encoding="utf-8")
    COMM.Barrier()
    return path


@pytest.mark.long
def test_two_blocks_slide_by_their_own_coefficients(shared_tmp: Path) -> None:
    """v²/(2 mu g): 5 mm on the rough ground, 20 mm on the smooth one. The blocks are pressed at
    once, which swings the normal force: measured within 0.25 %."""
    path = written(shared_tmp)
    history = read_case(path).run(COMM, out=shared_tmp / "run", progress=False).history
    ways = {name: float(history[f"sliding_{name}"][-1]) for name in ("rough", "smooth")}
    for name, mu in (("rough", ROUGH), ("smooth", SMOOTH)):
        assert abs(ways[name]) == pytest.approx(SPEED**2 / (2.0 * mu * G), rel=0.01)
    # While both slide, T = mu N and nothing of the friction of either is left.
    for name, mu in (("rough", ROUGH), ("smooth", SMOOTH)):
        rows = slice(1, 61)
        ratio = np.abs(history[f"T_{name}"][rows]) / history[f"N_{name}"][rows]
        assert ratio == pytest.approx(mu, rel=1e-9)
        assert history[f"margin_{name}"][rows] == pytest.approx(0.0, abs=1e-9)


def test_the_model_tells_the_friction_of_each_table(shared_tmp: Path) -> None:
    path = written(shared_tmp)
    read_case(path, ["run.t_end=1e-3"]).run(COMM, out=shared_tmp / "run", progress=False)
    model = json.loads((shared_tmp / "run" / "model.json").read_text("utf-8"))
    told = [(row["name"], row["friction"], row["mu"]) for row in model["contact"]]
    assert told == [("rough", "Coulomb(mu=0.4)", 0.4), ("smooth", "Coulomb(mu=0.1)", 0.1)]


@pytest.mark.serial
@pytest.mark.parametrize(
    ("settings", "told"),
    [
        # name -> its coefficient; without [friction] the other table is smooth
        (["friction="], [0.4, 0.0]),
        (["contact.2.mu=0.3", "friction="], [0.4, 0.3]),
        (["contact.1.mu="], [0.1, 0.1]),
    ],
)
def test_a_table_without_mu_has_the_law_of_friction(
    tmp_path: Path, settings: list[str], told: list[float]
) -> None:
    case = read_case(written(tmp_path), settings)
    problem = case.problem(MPI.COMM_SELF)
    slope = problem.friction.slope(problem.surface.weights)
    assert np.array_equal(slope, np.repeat(told, 5))


@pytest.mark.serial
@pytest.mark.parametrize(
    ("change", "says"),
    [
        (
            ('type = "Coulomb"\nmu = 0.1', 'type = "Tresca"\nthreshold = 1e3'),
            "mu, which is Coulomb's, and .* Tresca",
        ),
        (
            ('facets = "upper_bottom"', 'facets = "upper_bottom"\nmu = 0.3'),
            "every .* has a mu of its own",
        ),
        (("mu = 0.4", "mu = -0.4"), "mu is -0.4"),
    ],
)
def test_what_does_not_go_together_is_refused(
    tmp_path: Path, change: tuple[str, str], says: str
) -> None:
    with pytest.raises(InputError, match=says):
        read_case(written(tmp_path, BLOCKS.replace(*change))).check()
