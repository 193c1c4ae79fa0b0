"""V7.1: the compressed square of seed 003 against an independent script, boundary elements and its
own statements."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from demo_runs import demo
from mpi4py import MPI

import vi_contact as vc
from demos.parts.pictures.tractions import read_tractions
from demos.parts.problems.square import Square, SquareModel, build
from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.practice.plots.deformed import read_frames

pytestmark = pytest.mark.slow

LAWS = {
    "none": vc.Frictionless(),
    "tresca": vc.Tresca(0.05),
    "coulomb": vc.Coulomb(0.5),
    "weak tresca": vc.Tresca(0.005),
}
one_rank = pytest.mark.serial  # whole marches, slow on several ranks: these have the reference runs
RUBBING = ("none", "tresca", "coulomb")
SCHEMES: dict[str, Any] = {"midpoint": vc.Midpoint(), "default": None}


@cache
def model(cells: int, confined: bool = False) -> SquareModel:
    return build(Square(cells=cells, confined=confined), MPI.COMM_WORLD)


@cache
def run(law: str, scheme: str, cells: int = 20, confined: bool = False) -> dict[str, Array]:
    """The history to t = 6 with dt = h, with the energy; certified and with a closed ledger."""
    square = model(cells, confined)
    solution = vc.simulate(
        square.problem(friction=LAWS[law]),
        scheme=SCHEMES[scheme],
        dt=square.square.time_step,
        t_end=6.0,
        record=(vc.Energy(), vc.Contact(), vc.Probe(square.probes())),
        progress=False,
    )
    assert 0.0 < solution.facts["worst_certificate"] <= 1e-9
    assert 0.0 < solution.facts["energy_defect"] <= 1e-10
    history = solution.history
    return {**history, "energy": history["energy_kinetic"] + history["energy_strain"]}


def at(history: dict[str, Array], column: str, *times: float) -> Array:
    """The column at these times."""
    dt = history["t"][1]
    return history[column][[round(t / dt) for t in times]]


REFERENCE: dict[str, dict[str, tuple[float, ...]]] = {
    "none": {
        "energy": (0.00532, 0.01137, 0.02328, 0.01976, 0.00841, 0.01163),
        "loss_friction": (0.0, 0.0),
        "u_y_top": (-0.1075, -0.2339, -0.2236),
        "u_x_corner": (0.0771, -0.0056),
        "force": (0.150,),
    },
    "tresca": {
        "energy": (0.00532, 0.01137, 0.02301, 0.01781, 0.00569, 0.01394),
        "loss_friction": (0.00026, 0.00068),
        "u_y_top": (-0.1075, -0.2338, -0.2050),
        "u_x_corner": (0.0236, 0.0294),
        "force": (0.158,),
    },
    "coulomb": {
        "energy": (0.00532, 0.01137, 0.02327, 0.01801, 0.00542, 0.01458),
        "loss_friction": (0.0, 0.00005),
        "u_y_top": (-0.1075, -0.2338, -0.2010),
        "u_x_corner": (0.0001, 0.0005),
        "force": (0.160,),
    },
}
TIMES = {
    "energy": (0.5, 1.0, 2.0, 3.0, 4.0, 6.0),
    "loss_friction": (2.0, 6.0),
    "u_y_top": (1.0, 2.0, 3.0),
    "u_x_corner": (2.0, 4.0),
}
LAST_DIGIT = {"energy": 1e-5, "loss_friction": 1e-5, "u_y_top": 1e-4, "u_x_corner": 1e-4}


@pytest.mark.parametrize(
    "law", [pytest.param(law, marks=() if law == "coulomb" else one_rank) for law in RUBBING]
)
@pytest.mark.promise("guide/pressed_blocks.md", "**every printed digit of REF is reproduced**")
def test_midpoint_on_the_reference_mesh(law):
    """V7.1, 20 x 20 cells, consistent mass: energies, work of friction, displacements and the mean
    force of the steps between t = 1.2 and 1.8 to every printed digit."""
    history, reference = run(law, "midpoint"), REFERENCE[law]
    for column, times in TIMES.items():
        expected = pytest.approx(reference[column], rel=0.0, abs=0.5001 * LAST_DIGIT[column])
        assert at(history, column, *times) == expected, column
    # means of the steps that end at 1.25 ... 1.8
    force = history["contact_resultant"][25:37].mean()
    assert force == pytest.approx(reference["force"][0], rel=0.0, abs=0.5001e-3)


@one_rank
@pytest.mark.parametrize("scheme", SCHEMES)
@pytest.mark.promise("guide/pressed_blocks.md", "with and without friction, to round-off")
def test_the_wave_takes_in_energy_at_a_constant_rate(scheme):
    """V7.1: E = p² L/(rho c_P) t + 1.4e-3 t² until the wave is at the support, t = 1, to 1 % of
    E(1); until then it does not matter whether and how the support rubs."""
    history = run("none", scheme)
    early = history["t"] < 1.0 - 1e-9
    t, energy = history["t"][early], history["energy"][early]
    assert np.max(np.abs(energy - (0.01 * t + 1.4e-3 * t**2))) < 0.01 * 0.0114
    for law in ("tresca", "coulomb"):
        assert np.max(np.abs(run(law, scheme)["energy"][early] - energy)) < 1e-12 * energy.max()


@one_rank
@pytest.mark.parametrize("scheme", SCHEMES)
def test_friction_takes_energy_for_a_while(scheme):
    """V7.1: less energy with friction for 2 <= t <= 4, more at t = 6, where the phases have drifted
    apart; the work of friction never decreases; with Coulomb's mu = 0.5 the corner nearly sticks
    until t = 4."""
    free = run("none", scheme)
    between = (free["t"] > 2.0 - 1e-9) & (free["t"] < 4.0 + 1e-9)
    for law in ("tresca", "coulomb"):
        rubbed = run(law, scheme)
        assert np.all(rubbed["energy"][between] < free["energy"][between])
        assert rubbed["energy"][-1] > free["energy"][-1]
        assert np.diff(rubbed["loss_friction"]).min() >= 0.0 < rubbed["loss_friction"][-1]
    corner = [
        np.max(np.abs(run(law, scheme)["u_x_corner"][: len(between) * 4 // 6])) for law in RUBBING
    ]
    assert corner[2] < 0.02 * corner[0] and corner[1] < 0.5 * corner[0]


@one_rank
@pytest.mark.parametrize("scheme", SCHEMES)
def test_confined_square(scheme):
    """V7.1 with sides on rollers, plane waves: E = 0.01 t until t = 2, to 0.5 % of E(2); twice the
    pressure on the base for 1 < t < 3, to 1.5 % in the mean."""
    history = run("none", scheme, confined=True)
    t = history["t"]
    rising, pressed = (t > 0.2) & (t < 1.9), (t > 1.2) & (t < 2.8)
    assert np.max(np.abs(history["energy"] - 0.01 * t)[rising]) < 0.005 * 0.02
    assert history["contact_resultant"][pressed].mean() == pytest.approx(0.2, rel=0.015)


@one_rank
@pytest.mark.parametrize(
    ("scheme", "law"), [("midpoint", "none"), ("default", "none"), ("default", "coulomb")]
)
@pytest.mark.promise("guide/pressed_blocks.md", "These differences fall with order 1")
def test_energies_converge_with_the_mesh(scheme, law):
    """V7.1: the mean square over time of E_N - E_2N, N = 10, 20, halves with h: order 1 +- 0.3, as
    a front has it."""
    energies = [run(law, scheme, cells)["energy"][:: cells // 10] for cells in (10, 20, 40)]
    coarse, fine = (
        np.sqrt(np.mean((a - b) ** 2)) for a, b in zip(energies, energies[1:], strict=False)
    )
    assert 0.7 < np.log2(coarse / fine) < 1.3


@one_rank
def test_space_time_boundary_elements():
    """V7.1 against an independent script of space-time boundary elements, 20 and 40 per side:
    energies at t = 0.5, 1, ... 5 to 1.5 % of the largest, impulse at t = 4 to 0.1 %, work of
    friction to 1 %; default scheme, 40 cells."""
    free, rubbed = run("none", "default", 40), run("weak tresca", "default", 40)
    times = tuple(0.5 * np.arange(1, 11))
    smooth = (0.5339, 1.1351, 1.7723, 2.3529, 2.3045, 1.9808, 1.4837, 0.8213, 0.3292, 0.3049)
    rough = (0.5339, 1.1351, 1.7641, 2.3341, 2.2702, 1.9331, 1.4205, 0.7669, 0.3107, 0.2992)
    for history, expected in ((free, smooth), (rubbed, rough)):
        found = 100.0 * at(history, "energy", *times)  # the script's pressure is 1
        assert found == pytest.approx(expected, rel=0.0, abs=0.015 * max(expected))
    force, dt = free["contact_resultant"][:161], free["t"][1]
    assert 10.0 * dt * (force.sum() - 0.5 * force[-1]) == pytest.approx(4.7033, rel=1e-3)
    assert 100.0 * at(rubbed, "loss_friction", 4.0)[0] == pytest.approx(0.05069, rel=0.01)


def test_a_square_needs_cells():
    with pytest.raises(InputError, match="at least 1"):
        Square(cells=0)


@one_rank
def test_the_square_demo(comm: Any, shared_tmp: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """V7.1 on 10 cells: all runs certified with closed ledgers, figures drawn, table printed."""
    numbers = demo("square").main(quick=True, out=shared_tmp, progress=False)
    comm.Barrier()  # rank 0 draws
    named = sorted({name.split(":")[0] for name in numbers})
    assert len(named) == 3
    for name in named:
        assert (
            0.0 < numbers[f"{name}: certificate"] <= 1e-9
            and 0.0 < numbers[f"{name}: ledger defect"] <= 1e-10
        )
        assert numbers[f"{name}: E(1)"] == pytest.approx(0.0114, rel=0.02)
        assert (numbers[f"{name}: friction"] > 0.0) == ("no friction" not in name)
    for figure in ("snapshots", "tractions", "energies"):
        assert (shared_tmp / f"{figure}.png").stat().st_size > 10_000
    if comm.rank == 0:
        check_what_is_drawn(shared_tmp / "Tresca_0.05_default_scheme")
    assert comm.rank or "Coulomb 0.5, default scheme" in capsys.readouterr().out


def check_what_is_drawn(folder: Path) -> None:
    """Frames and tractions are those of the history: displacement of the top, resultants of
    pressure and friction; at t = 2 friction holds the square together, at both ends with Tresca's
    threshold."""
    frames, tractions = read_frames(folder), read_tractions(folder)
    columns = np.genfromtxt(folder / "history.csv", delimiter=",", names=True)
    t, u, stress = frames.at(2.01)
    assert t == pytest.approx(2.0, rel=1e-12) and stress.shape == (len(frames.cells),) == (100,)
    row = int(np.argmin(np.abs(columns["t"] - t)))
    top = int(np.argmin(np.linalg.norm(frames.points - (0.0, 0.5), axis=1)))
    assert u[top, 1] == pytest.approx(columns["u_y_top"][row], rel=1e-9)
    pressure, shear = tractions.at(t)
    weights = np.where(np.abs(tractions.points[:, 0]) > 0.49, 0.05, 0.1)
    assert weights @ pressure == pytest.approx(columns["contact_resultant"][row], rel=1e-9)
    assert weights @ shear[:, 0] == pytest.approx(columns["friction_force_x"][row], abs=1e-12)
    order = np.argsort(tractions.points[:, 0])
    assert shear[order][[0, -1], 0] == pytest.approx([0.05, -0.05], rel=1e-12)
    assert np.array_equal(tractions.tangents, np.tile([[1.0], [0.0]], (11, 1, 1)))


@one_rank
def test_pictures_need_a_run(tmp_path):
    for read, words in ((read_frames, "no frames in"), (read_tractions, "has no history.csv")):
        with pytest.raises(InputError, match=words):
            read(tmp_path)
