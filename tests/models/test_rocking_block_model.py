"""The rocking block as a model: what it refuses, its rigid limit, its states and histories; its
demo and figures."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from demo_runs import demo
from mpi4py import MPI

import vi_contact as vc
from demos.parts.problems import rocking_block as rocking
from vi_contact.core.errors import InputError

COMM = MPI.COMM_WORLD
ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def model() -> rocking.RockingModel:
    return rocking.build(rocking.RockingBlock(), COMM)


@pytest.mark.serial
def test_soft_or_coarse_blocks_are_refused():
    """V3.1 asks for sqrt(E/rho)/height >= 200 p: here E >= 2.77 GPa."""
    concrete = rocking.RockingBlock().material
    assert rocking.RockingBlock(material=replace(concrete, E=2.8e9)).material.E == 2.8e9
    with pytest.raises(InputError, match=r"E = 2.7e\+09 Pa is too soft .* at least 2.8e\+09 Pa"):
        rocking.RockingBlock(material=replace(concrete, E=2.7e9))
    with pytest.raises(InputError, match="2 elements over the height: give at least 4"):
        rocking.RockingBlock(divisions=(1, 2))


@pytest.mark.serial
def test_rigid_limit_is_housners_block_in_other_units():
    """p_eff² = p² h/R and b/h instead of p² and alpha; amplitudes at equal phi and the loss are the
    same."""
    block = rocking.RockingBlock()
    b, h, R = 0.2, 1.0, np.hypot(0.2, 1.0)
    assert block.p**2 == pytest.approx(0.75 * 9.81 / R * h / R, rel=1e-12)
    assert block.overturning_angle == pytest.approx(
        b / h, rel=1e-15
    ) and block.mass == pytest.approx(1920.0)
    t0 = float(block.impact_times(0.1, 1)[0])
    assert t0 == pytest.approx(np.arccosh(1.0 / (1.0 - 0.5)) / block.p, rel=1e-12)
    assert block.amplitudes(0.1, 1)[1] == pytest.approx(
        0.2 * (1.0 - np.sqrt(1.0 - 0.88794379 * 0.75)), rel=1e-8
    )
    t = np.linspace(0.0, 0.9 * t0, 5)
    assert block.motion(0.1, t) == pytest.approx(0.2 - 0.1 * np.cosh(block.p * t), rel=1e-12)


def test_rest_is_an_equilibrium(model):
    """Each corner carries half the weight; nothing moves in 20 steps with any scheme."""
    weight = model.block.mass * 9.81
    everywhere = model.problem.surface.everywhere
    assert everywhere(model.rest.r_n) == pytest.approx([0.5 * weight] * 2, rel=1e-9)
    for scheme in (vc.MoreauJean(), vc.Trapezoidal()):
        state = model.rest
        for state, report in vc.march(  # noqa: B007  the last one counts
            model.problem, scheme=scheme, solver=vc.Condensed(), dt=1e-3, steps=20, state=model.rest
        ):
            assert report.certificate.worst <= 1e-9
        assert everywhere(state.r_n) == pytest.approx([0.5 * weight] * 2, rel=1e-6)
        assert abs(model.angle(state)) < 1e-12 and abs(model.spin(state)) < 1e-9


@pytest.mark.serial
def test_tilted_states(model):
    """A tilt is a rigid turn about the left corner: angle, spin and kinetic energy ½ (4/3) m R²
    rate² (the held base has no inertia sideways, which a turn about a base corner does not ask
    for)."""
    state = model.tilted(0.07, rate=-0.3)
    assert model.angle(state) == pytest.approx(0.07, rel=1e-12) and model.spin(
        state
    ) == pytest.approx(-0.3, rel=1e-12)
    system = model.problem.equations
    kinetic = 0.5 * system.algebra.dot(state.v, system.M @ state.v)
    assert kinetic == pytest.approx(0.5 * 4.0 / 3.0 * 1920.0 * 1.04 * 0.09, rel=1e-12)


@pytest.mark.serial
@pytest.mark.parametrize("n", [5, 10])
def test_onset_of_the_mesh(n):
    """g b/h = 1.962 m/s² on every mesh: the inertia load counts the mass that elements share with
    the held base."""
    model = rocking.build(rocking.RockingBlock(divisions=(2, n)), COMM)
    assert model.onset_acceleration == pytest.approx(1.962, rel=1e-10)


@pytest.mark.serial
def test_weight_has_the_arm_of_the_tilted_block(model):
    """Work of the weight over a turn theta: m g (b theta - ½ h theta²), from the loads and the
    geometric stiffness."""
    system, theta = model.problem.equations, 0.15
    turn = model.tilted(theta).u - model.rest.u
    work = system.algebra.dot(turn, system.load(0.0) - system.K @ model.rest.u)
    work -= 0.5 * system.algebra.dot(turn, system.K @ turn)
    assert work == pytest.approx(-1920.0 * 9.81 * (0.2 * theta - 0.5 * theta**2), rel=1e-8)


@pytest.mark.serial
def test_impacts_of_a_history():
    """Zero crossings between rows by straight lines; chatter near zero is one impact."""
    history = {
        "t": np.arange(9.0),
        "theta": np.array([0.4, 0.2, -1e-5, 1e-5, -0.2, -0.3, -0.1, 0.1, 0.2]),
    }
    times, peaks = rocking.impacts(history)
    assert times == pytest.approx([1.0 + 0.2 / 0.20001, 6.5]) and peaks == pytest.approx([0.4, 0.3])


@pytest.mark.slow
@pytest.mark.serial
def test_demo(shared_tmp, comm):
    """The quick demo: key numbers of V3.1, run folders and figures."""
    numbers = demo("rocking_block").main(quick=True, out=shared_tmp, progress=False)
    comm.Barrier()  # rank 0 draws
    assert 0.0 < numbers["certificate"] <= 1e-9
    assert numbers["worst_time_error"] < 0.02 and numbers["first_impact"] == pytest.approx(
        0.490304, rel=0.01
    )
    assert numbers["restitution"] == pytest.approx(0.94230769, rel=0.05)
    assert numbers["gap_0.99"] == 0.0 and numbers["gap_1.01"] > 1e-4
    assert numbers["last_angle_0.98"] < 0.8 and numbers["last_angle_1.02"] > 1.0
    for name in ("free", "onset_0.99", "onset_1.01", "overturning_0.98", "overturning_1.02"):
        summary = json.loads((shared_tmp / name / "summary.json").read_text(encoding="utf-8"))
        assert summary["status"] == "finished" and summary["ranks"] == comm.size
        header = (
            (shared_tmp / name / "history.csv")
            .read_text(encoding="utf-8")
            .split("\n", 1)[0]
            .split(",")
        )
        assert {"theta", "theta_rate", "r_left", "r_right", "u_x_top"} <= set(header)
        assert (shared_tmp / name / "fields.xdmf").stat().st_size > 0
    for figure in ("free_rocking.png", "pulses.png", "energy.png", "certificate.png"):
        assert (shared_tmp / figure).read_bytes().startswith(b"\x89PNG")
