"""Recorders on the spring-mass chain: energy ledger (V9), contact quantities and probes against
hand calculations."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from chain import chain_problem, chain_surface

from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.problem import ContactProblem
from vi_contact.core.step import Report, State
from vi_contact.laws.excitation import Harmonic
from vi_contact.laws.impact import ImpulseUpdate, Inelastic, Newton
from vi_contact.run.march import march
from vi_contact.run.recorders import Contact, Energy, Probe
from vi_contact.run.recorders.steps import Steps
from vi_contact.run.simulate import simulate
from vi_contact.schemes.linear_multistep import LinearMultistep
from vi_contact.schemes.ss22 import SS22
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed

pytestmark = pytest.mark.serial

SHAKE = Harmonic(3.0, 2.0, direction=(1.0,))
DT = 5e-3


def reports(problem: ContactProblem, scheme: Any, steps: int = 300) -> list[Report]:
    """The reports of a march with the condensed solver."""
    return [
        report
        for _, report in march(problem, scheme=scheme, solver=Condensed(), dt=DT, steps=steps)
    ]


def history(
    problem: ContactProblem, scheme: Any, steps: int = 300, **more: Any
) -> dict[str, Array]:
    """The history of a simulation."""
    return dict(
        simulate(problem, scheme=scheme, solver=Condensed(), dt=DT, steps=steps, **more).history
    )


def test_contact_without_arrays() -> None:
    """The numbers are the same to the last bit on one rank, and the arrays are not there."""
    problem = chain_problem(5, gap=1e-3, left_gap=2e-3, excitation=SHAKE)
    whole = history(problem, ZienkiewiczWoodTaylor(), 80, record=[Contact()])
    thin = history(problem, ZienkiewiczWoodTaylor(), 80, record=[Contact(arrays=False)])
    assert set(whole) - set(thin) == {"pressure", "gap", "active"} and not set(thin) - set(whole)
    assert all(np.array_equal(thin[name], whole[name], equal_nan=True) for name in thin)
    assert thin["contact_active"].max() > 0
    with pytest.raises(InputError, match="Contact: arrays is 3"):
        Contact(arrays=3)  # type: ignore[arg-type]


def ledger_defect(found: dict[str, Array]) -> Array:
    """E + D_damping + D_contact + D_impact + D_algorithmic - W - E(0), over max E (V9.7)."""
    total = found["energy_kinetic"] + found["energy_strain"]
    losses = sum(
        found[name] for name in ("loss_damping", "loss_contact", "loss_impact", "loss_algorithmic")
    )
    return np.asarray(total + losses - found["work_input"] - total[0]) / total.max()


@pytest.mark.parametrize(
    "scheme",
    [
        ZienkiewiczWoodTaylor(0.5),
        ZienkiewiczWoodTaylor(0.8),
        SS22(0.6, 0.7),
        LinearMultistep.newmark(),
        LinearMultistep.newmark(beta=0.36, gamma=0.7),
    ],
    ids=repr,
)
@pytest.mark.parametrize(
    "impact", [None, Inelastic(), Inelastic(ImpulseUpdate()), Newton(0.5)], ids=repr
)
def test_v9_7_ledger_closes(scheme: Any, impact: Any) -> None:
    """V9.7: W + E(0) = E + D_damping + D_contact + D_impact + D_algorithmic to 1e-10 max E, walls
    on both sides."""
    problem = chain_problem(
        5,
        gap=1e-3,
        left_gap=2e-3,
        excitation=SHAKE,
        impact=impact,
        damping=1e-4,
        consistent=True,
        constant=1.0,
    )
    found = history(problem, scheme, 120)
    assert found["contact_active"].max() > 0
    assert np.abs(ledger_defect(found)).max() < 1e-10
    size = (found["energy_kinetic"] + found["energy_strain"]).max()
    assert np.abs(found["energy_defect"]).max() < 1e-10 * size
    assert np.abs(ledger_defect(found) - found["energy_defect"] / size).max() < 1e-13
    assert np.all(np.diff(found["loss_damping"]) >= 0.0)


def test_energies_are_those_of_the_final_state() -> None:
    """Kinetic and strain energy against dense matrices, in the system's own unknowns."""
    problem = chain_problem(
        4, gap=1e-3, left_gap=2e-3, excitation=SHAKE, impact=Inelastic(), consistent=True
    )
    solution = simulate(
        problem, scheme=ZienkiewiczWoodTaylor(), solver=Condensed(), dt=DT, steps=200
    )
    M, K = problem.system.M.csr.toarray(), problem.system.K.csr.toarray()
    u, v = problem.cartesian(solution.state.u), problem.cartesian(solution.state.v)
    assert solution.history["energy_kinetic"][-1] == pytest.approx(0.5 * v @ M @ v, rel=1e-13)
    assert solution.history["energy_strain"][-1] == pytest.approx(0.5 * u @ K @ u, rel=1e-13)


@pytest.mark.parametrize("wrong", ["force", "reaction", "displacement"])
def test_v9_7_defect_sees_a_wrong_step(wrong: str) -> None:
    """A step that does not satisfy its equation of motion leaves a defect: the ledger is not a
    tautology."""
    problem, scheme = (
        chain_problem(5, gap=1e-3, excitation=SHAKE, consistent=True),
        ZienkiewiczWoodTaylor(),
    )
    closing = [
        one for one in reports(problem, scheme) if one.new.active[0] and not one.old.active[0]
    ]
    report, recorder = closing[-1], Energy()
    recorder.start(problem, report.old)
    row = recorder.row(report)
    size = row["energy_kinetic"] + row["energy_strain"]
    assert abs(row["energy_defect"]) < 1e-14 * size
    balance = report.balance
    if wrong == "force":
        balance = replace(balance, f=1.001 * balance.f)
    elif wrong == "reaction":
        balance = replace(balance, r_n=1.001 * balance.r_n)
    else:
        balance = replace(balance, u=1.001 * balance.u)
    recorder.start(problem, report.old)
    assert (
        abs(recorder.row(replace(report, averages=lambda: balance))["energy_defect"]) > 1e-7 * size
    )


def test_v9_1_midpoint_loses_only_by_contact() -> None:
    """V9.1: at phi = ½ nothing is lost by the scheme, and each closure loses reaction times the gap
    it closed."""
    problem = chain_problem(5, gap=1e-3, left_gap=2e-3, excitation=SHAKE, consistent=True)
    found = history(problem, ZienkiewiczWoodTaylor(0.5))
    r_n, gap = 0.5 * found["pressure"], found["gap"]  # weights of the chain are ½
    size = (found["energy_kinetic"] + found["energy_strain"]).max()
    closures = np.cumsum(np.sum(r_n[1:] * gap[:-1], axis=1))
    assert closures[-1] > 1e-3 * size
    assert np.abs(found["loss_contact"][1:] - closures).max() < 1e-12 * size
    assert np.abs(found["loss_algorithmic"]).max() < 1e-13 * size


def test_v9_2_newmark_gains_at_release() -> None:
    """V9.2 at beta = ¼, gamma = ½, no load: E1 - E0 = ½ (r_n0 g1 - r_n1 g0), which gains energy at
    release."""
    problem = chain_problem(5, gap=1e-3, u0=np.linspace(0.0, -0.02, 5), consistent=True)
    found = history(problem, LinearMultistep.newmark(beta=0.25, gamma=0.5))
    total = found["energy_kinetic"] + found["energy_strain"]
    r_n, gap = 0.5 * found["pressure"][:, 0], found["gap"][:, 0]
    change = 0.5 * (r_n[:-1] * gap[1:] - r_n[1:] * gap[:-1])
    assert change.max() > 1e-6 * total.max()
    # as V9.7: 1/dt² amplifies round-off
    assert np.abs(np.diff(total) - change).max() < 1e-10 * total.max()


@pytest.mark.parametrize("reading", ["literal", "projection"])
def test_v9_6_impact_loss(reading: str) -> None:
    """V9.6: ½ v⁻ᵀMv⁻ - ½ v⁺ᵀMv⁺ step by step; for the M-projection and e = 0 it is ½ |v⁻ - v⁺|²_M
    >= 0."""
    law = Inelastic() if reading == "literal" else Inelastic(ImpulseUpdate())
    problem = chain_problem(
        10, gap=1e-3, excitation=SHAKE, impact=law, consistent=True, stiffness=1e4
    )
    M = problem.equations.M.csr.toarray()
    found = history(problem, ZienkiewiczWoodTaylor())["loss_impact"]
    steps = reports(problem, ZienkiewiczWoodTaylor())
    losses = np.array(
        [0.5 * one.v_minus @ M @ one.v_minus - 0.5 * one.new.v @ M @ one.new.v for one in steps]
    )
    assert np.abs(np.diff(found) - losses).max() < 1e-12 * np.abs(found).max()
    if reading == "literal":
        assert losses.min() < 0.0 < losses.max()
    else:
        norms = [0.5 * (one.v_minus - one.new.v) @ M @ (one.v_minus - one.new.v) for one in steps]
        assert np.abs(losses - norms).max() < 1e-12 * losses.max()
        assert losses.max() > 0.0


def test_v9_8_momentum() -> None:
    """V9.8: contact impulses of a free chain under a constant force are its change of momentum less
    the force's."""
    problem = chain_problem(
        5, gap=1e-2, left_gap=2e-2, floating=True, constant=7.0, consistent=True
    )
    solution = simulate(
        problem, scheme=ZienkiewiczWoodTaylor(), solver=Condensed(), dt=DT, steps=400
    )
    momentum = np.ones(5) @ problem.system.M.csr @ problem.cartesian(solution.state.v)
    impulse = DT * solution.history["contact_force_x"].sum()
    assert impulse < -1.0
    assert momentum == pytest.approx(impulse + 7.0 * 400 * DT, abs=1e-12 * abs(impulse))


def state_of(r_n: list[float], active: list[bool], u: Array) -> State:
    """A state with these reactions."""
    return State(0.25, 3, u, np.zeros_like(u), np.array(r_n), np.array(active))


def test_contact_by_hand() -> None:
    """Resultant 8 N of 2 N at x = 5 and 6 N at x = 1 acts at x = 2; the walls push with -2 N and +6
    N."""
    problem = chain_problem(5, gap=0.5, left_gap=0.25)
    surface = replace(problem.surface, weights=np.array([1.0, 3.0]))
    problem = replace(problem, surface=surface)
    u = np.zeros(5)
    u[4], u[0] = 0.5, 0.2
    row = Contact().start(problem, state_of([2.0, 6.0], [True, False], u))
    assert row["contact_uplift"] == 0.75 and row["contact_active"] == 1
    assert (
        row["contact_resultant"] == 8.0
        and row["contact_force_x"] == 4.0
        and row["contact_x"] == 2.0
    )
    assert row["pressure"].tolist() == [2.0, 2.0] and row["contact_max_pressure"] == 2.0
    assert row["gap"] == pytest.approx([0.0, 0.05], abs=1e-16)
    assert row["contact_min_gap"] == row["gap"].min()
    assert row["active"].tolist() == [True, False]


def test_contact_open_and_absent() -> None:
    """Open contact acts nowhere; without conditions everything is lifted."""
    problem = chain_problem(3, gap=0.5)
    row = Contact().start(problem, state_of([0.0], [False], np.zeros(3)))
    assert (
        np.isnan(row["contact_x"])
        and row["contact_uplift"] == 1.0
        and str(row["contact_force_x"]) == "0.0"
    )
    surface = chain_surface(3)
    none = replace(
        surface,
        points=np.zeros((0, 1)),
        normals=np.zeros((0, 1)),
        weights=np.zeros(0),
        gap0=np.zeros(0),
        bilateral=np.zeros(0, bool),
        compliance=np.zeros(0),
        owned=np.zeros(0, int),
        slots=np.zeros(0, int),
        tangents=np.zeros((0, 0), int),
    )
    nowhere = State(0.0, 0, np.zeros(3), np.zeros(3), np.zeros(0), np.zeros(0, bool))
    row = Contact().start(replace(problem, surface=none), nowhere)
    assert (
        row["contact_uplift"] == 1.0
        and row["contact_resultant"] == 0.0
        and np.isnan(row["contact_min_gap"])
    )


def test_contact_on_springs_adds_their_shortening() -> None:
    """The gap to a support that is pressed in by r_n compliance: body at u_n = 0.3, gap0 = 0.1, 2 N
    on 0.1 m/N."""
    problem = chain_problem(2, gap=0.1)
    problem = replace(problem, surface=replace(problem.surface, compliance=np.array([0.1])))
    row = Contact().start(problem, state_of([2.0], [True], np.array([0.0, 0.3])))
    assert row["gap"] == pytest.approx([0.0], abs=1e-16)


def test_probe_turns_back_the_basis() -> None:
    """u_x of the left mass, whose contact frame points the other way, has the sign of the axis."""
    problem = chain_problem(4, gap=1.0, left_gap=1.0)
    probe = Probe({12: (1.0,), "end": (4.0,)}, velocity=True)
    u, v = np.array([-1e-3, 0.0, 0.0, 2e-3]), np.array([-0.5, 0.0, 0.0, 0.25])
    row = probe.start(problem, State(0.0, 0, u, v, np.zeros(2), np.zeros(2, bool)))
    assert row == {"u_x_12": 1e-3, "u_x_end": 2e-3, "v_x_12": 0.5, "v_x_end": 0.25}
    assert list(probe.columns()) == ["u_x_12", "u_x_end", "v_x_12", "v_x_end"]
    assert probe.columns()["v_x_end"][0] == "m/s"


def test_probe_absolute_acceleration_of_a_free_body_is_zero() -> None:
    """Nothing holds the floating chain: it stays where it is while the ground moves, so relative
    plus ground is 0."""
    problem = chain_problem(3, gap=1.0, floating=True, excitation=SHAKE)
    probe = Probe({"a": (1.0,), "b": (3.0,)}, acceleration=True)
    found = history(problem, ZienkiewiczWoodTaylor(0.5), 50, record=[probe])
    ground = found["a_g_x"]
    trapezoid = 0.5 * (ground[1:] + ground[:-1])
    midpoint = np.array([SHAKE.acceleration((k + 0.5) * DT) for k in range(50)])
    assert np.abs(midpoint).max() > 1.0
    # the scheme takes the load at midpoints, the recorder the mean of both ends
    for name in ("a_x_a", "a_x_b"):
        assert found[name][1:] == pytest.approx(trapezoid - midpoint, abs=1e-9)
        assert found[name][0] == ground[0]


def test_probe_refuses_bad_points() -> None:
    """Labels become column names; points must lie on the body and have its dimension."""
    problem = chain_problem(3)
    zero = State(0.0, 0, np.zeros(3), np.zeros(3), np.zeros(1), np.zeros(1, bool))
    with pytest.raises(InputError, match="probe label 'top left'"):
        Probe({"top left": (1.0,)})
    with pytest.raises(InputError, match="different numbers of coordinates"):
        Probe({"a": (1.0,), "b": (1.0, 2.0)})
    with pytest.raises(InputError, match="2 coordinates: give 1"):
        Probe({"a": (1.0, 0.0)}).start(problem, zero)
    with pytest.raises(InputError, match="give a point of the body"):
        Probe({"a": (9.0,)}).start(problem, zero)


def test_steps_tell_time_iterations_and_ground() -> None:
    """The columns every run has."""
    problem = chain_problem(3, gap=1e-3, excitation=SHAKE)
    found = history(problem, ZienkiewiczWoodTaylor(), 20, record=[])
    assert list(found) == ["t", "k", "iterations", "certificate", "escalated", "a_g_x"]
    assert found["k"].tolist() == list(range(21))
    assert found["t"] == pytest.approx(DT * np.arange(21), rel=1e-14)
    assert found["a_g_x"].tolist() == [SHAKE.acceleration(t) for t in found["t"]]
    steps = Steps()
    assert [name for name in steps.columns() if name.startswith("a_g")] == [
        "a_g_x",
        "a_g_y",
        "a_g_z",
    ]
