"""Rod and beam under the exact inequalities, as contact problems of the project, and Algorithm 10
beside them."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from energy_checks import rounded

import vi_contact as vc
from vi_contact.beam.algorithm import BeamRun, BeamStepper, run_beam
from vi_contact.beam.contact_problems import beam_problem, rod_forces, rod_problem, rubbing_problem
from vi_contact.beam.elements import Elements
from vi_contact.beam.published import published_mu, published_start
from vi_contact.beam.tip import ExactFriction, RegularisedFriction
from vi_contact.beam.values import Rod, Start, TimoshenkoBeam
from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.exact.bar import PeriodicBar

pytestmark = pytest.mark.serial
MU, PUSH = 0.3, 100.0
BEAM = TimoshenkoBeam(viscosity=0.001)
ROD = Rod(viscosity=0.002, gap=0.05, body_force=lambda t: 20.0 * (t < 1.5))


def histories(
    problem: vc.ContactProblem, dt: float, steps: int, **more: Any
) -> tuple[Array, Array, Array, float]:
    """Tip deflection, r_n, r_t after every step, and the worst certificate."""
    rows, worst = [], 0.0
    for state, report in vc.march(problem, dt=dt, steps=steps, **more):
        r_t = 0.0 if state.r_t is None else state.r_t[0, 0]
        rows.append((state.u[-1], state.r_n[0], r_t))
        worst = max(worst, report.certificate.worst)
    tip, r_n, friction = np.array(rows).T
    return tip, r_n, friction, worst


def algorithm(friction: Any, elements: Elements, dt: float, steps: int, **given: Any) -> BeamRun:
    """Algorithm 10 with the seed's start."""
    given = {"normal_force": lambda t: PUSH, "mu": lambda t, rate: MU} | given
    return run_beam(
        BeamStepper(BEAM, elements, dt, friction=friction, **given), published_start(), steps=steps
    )


@pytest.mark.long
@pytest.mark.parametrize(
    "elements", [Elements(50), Elements(50, reduced_shear=False, published_end=True)]
)
@pytest.mark.promise("theory/beam.md", "They agree within 1e-13 m", bound="1e-11 m")
def test_exact_law_through_the_contract(elements: Elements) -> None:
    """Given force, Coulomb: Midpoint and the condensed solver do what Algorithm 10 does with the
    inequality itself; the tip slips, sticks and slips back."""
    law = vc.Coulomb(MU)
    problem = beam_problem(
        BEAM, elements, normal_force=lambda t: PUSH, friction=law, start=published_start()
    )
    tip, r_n, friction, worst = histories(problem, 0.005, 400, scheme=vc.Midpoint())
    found = algorithm(ExactFriction(), elements, 0.005, 400)
    assert np.max(np.abs(tip - found.history["u_tip"][1:])) <= 1e-11
    assert np.max(np.abs(friction - found.history["friction_force"][1:])) <= 1e-9 * PUSH
    assert r_n == pytest.approx(PUSH, rel=1e-12) and worst <= 1e-12
    slip = found.history["slip"][1:]
    assert np.sum(slip == 0.0) > 40 and np.any(slip > 0.0) and np.any(slip < 0.0)
    assert (
        np.all(np.diff(found.energy) <= 1e-12)
        and np.max(np.abs(found.history["energy_defect"])) <= 1e-8
    )


@pytest.mark.promise("theory/beam.md", "the difference falls with the first order of eps")
def test_convergence_as_eps_vanishes() -> None:
    """Motion and friction loss of (7.1) tend to those of the inequality with order 1."""
    elements = Elements(50)
    exact = algorithm(ExactFriction(), elements, 0.005, 300).history
    errors = []
    for eps in (1e-4, 1e-5, 1e-6, 1e-7):
        found = algorithm(RegularisedFriction(eps), elements, 0.005, 300).history
        errors.append(
            [np.max(np.abs(found[name] - exact[name])) for name in ("u_tip", "loss_friction")]
        )
    orders = -np.diff(np.log10(errors), axis=0)
    assert np.all(np.abs(orders - 1.0) < 0.12) and errors[-1][0] < 1e-4


@pytest.mark.long
@pytest.mark.promise("theory/beam.md", "which is order 1")
def test_rate_dependent_friction() -> None:
    """mu = |rate|/100: of the old step in Algorithm 10, of the step itself in SlipRateCoulomb;
    order 1 between them."""
    elements, apart = Elements(50), []
    for steps in (100, 200):
        law = vc.SlipRateCoulomb(lambda rate: published_mu(0.0, 1.0) * rate)
        problem = beam_problem(
            BEAM, elements, normal_force=lambda t: PUSH, friction=law, start=published_start()
        )
        tip, _, _, worst = histories(problem, 1.0 / steps, steps, scheme=vc.Midpoint())
        found = algorithm(ExactFriction(), elements, 1.0 / steps, steps, mu=published_mu)
        apart.append(np.max(np.abs(tip - found.history["u_tip"][1:])))
        assert worst <= 1e-9
    assert apart[0] < 0.01 and apart[0] / apart[1] == pytest.approx(2.0, rel=0.05)


@pytest.mark.long
@pytest.mark.promise(
    "theory/beam.md", "the error falls with order 0.6 to 0.8", bound="0.003, order 0.4 to 0.95"
)
def test_rod_of_period_three() -> None:
    """V1.3 with the wall on the right: displacement of the tip, contact impulse 1/2 a period,
    energy; observed order between 0.4 and 0.95."""
    bar, errors = PeriodicBar(), []
    for n in (50, 100, 200):
        problem = rod_problem(Rod(1.0, 1.0, 1.0, 1.0), Elements(n), Start(u=lambda x: -0.5 * x))
        dt = 0.5 / n
        steps = round(6.0 / dt)
        tip, r_n, _, worst = histories(problem, dt, steps, scheme=vc.Midpoint())
        exact = -bar.displacement(0.0, dt * np.arange(1, steps + 1))
        errors.append(np.sqrt(np.mean((tip - exact) ** 2)))
        assert tip.max() <= 0.0 and r_n.min() >= 0.0 and worst <= 1e-12
        assert dt * r_n.sum() == pytest.approx(1.0, abs=0.03)
    orders = -np.diff(np.log2(errors))
    assert errors[-1] < 3e-3 and np.all((orders > 0.4) & (orders < 0.95))


def test_rod_ledger() -> None:
    """V9.1: midpoint rule with the inequality at the end of the step never creates energy; with
    viscosity it closes."""
    problem = rod_problem(
        Rod(1.0, 1.0, 1.0, 1.0, viscosity=0.01, gap=0.1), Elements(40), Start(u=lambda x: -0.5 * x)
    )
    solution = vc.simulate(
        problem, scheme=vc.Midpoint(), dt=0.0125, steps=400, record=[vc.Energy()], progress=False
    )
    history = solution.history
    assert np.all(np.diff(history["energy_kinetic"] + history["energy_strain"]) <= 1e-14)
    assert history["loss_contact"][-1] > 0.0 and history["loss_damping"][-1] > 0.0
    # round-off of K u at the start, when the tip is displaced by 0.5: a third of it
    assert np.abs(history["energy_defect"]).max() <= 2.0 * rounded(problem, 0.5)


@pytest.mark.long
@pytest.mark.promise("theory/beam.md", "The static contact force is right to 1e-3 N")
def test_rod_comes_to_rest() -> None:
    """Kelvin-Voigt, V9.1's scheme: the mean contact force tends to end force + half the body force
    - E A gap/l."""
    rod = Rod(viscosity=0.05, gap=0.05, body_force=lambda t: 20.0, end_force=lambda t: 3.0)
    _, ringing, _, _ = histories(rod_problem(rod, Elements(40)), 0.01, 1500, scheme=vc.Midpoint())
    assert 0.5 * (ringing[-1] + ringing[-2]) == pytest.approx(52.0, abs=1e-3)
    # default scheme: no mass at the tip
    _, quiet, _, _ = histories(rod_problem(rod, Elements(40)), 0.01, 1500)
    assert quiet[-2:] == pytest.approx(52.0, abs=1e-3)


@pytest.mark.promise("theory/beam.md", "is right to 1e-3.")
def test_rod_viscosity() -> None:
    """Free decay of the first mode, sin(pi x/2l), with the rate viscosity omega²/2."""
    rod = Rod(1.0, 1.0, 1.0, 4.0, viscosity=0.02, gap=10.0)
    omega = 0.5 * np.pi * 2.0
    problem = rod_problem(rod, Elements(50), Start(u=lambda x: np.sin(0.5 * np.pi * x)))
    tip, _, _, _ = histories(problem, 0.005, 400, scheme=vc.Midpoint())
    t, decay = 0.005 * np.arange(1, 401), 0.5 * rod.viscosity * omega**2
    swing = np.sqrt(omega**2 - decay**2)
    exact = np.exp(-decay * t) * (np.cos(swing * t) + decay / swing * np.sin(swing * t))
    assert np.max(np.abs(tip - exact)) < 1e-3


@pytest.fixture(scope="module")
def rubbing() -> tuple[Array, Array, Array, float]:
    """Rod and beam in one problem: touches, rubs, sticks, lets go."""
    problem = rubbing_problem(
        ROD, BEAM, Elements(50), friction=vc.Coulomb(MU), start=published_start()
    )
    return histories(problem, 0.005, 400)


@pytest.mark.long
@pytest.mark.promise("theory/beam.md", "the results agree within 1e-11 m", bound="1e-10 m")
def test_the_rod_drives_the_friction(rubbing: tuple[Array, Array, Array, float]) -> None:
    """One problem for both gives what rod first, beam second gives; regularised: order 1 in eps."""
    tip, r_n, friction, worst = rubbing
    forces = rod_forces(ROD, Elements(50), dt=0.005, steps=400)
    assert np.array(forces.forces) == pytest.approx(r_n, abs=1e-10 * r_n.max())
    errors = []
    for law in (ExactFriction(), RegularisedFriction(1e-5), RegularisedFriction(1e-6)):
        found = algorithm(law, Elements(50), 0.005, 400, normal_force=forces).history
        errors.append(np.max(np.abs(found["u_tip"][1:] - tip)))
    assert errors[0] <= 1e-10 and 8.0 < errors[1] / errors[2] < 12.0 and worst <= 1e-10
    assert np.all(np.abs(friction) <= MU * r_n * (1.0 + 1e-12) + 1e-12)
    assert np.sum(r_n > 0.0) > 300 and r_n[0] == 0.0 and r_n[-1] == 0.0  # open, closed, open again
    with pytest.raises(InputError, match=r"0 <= t < 2 s, not at 2 s"):
        forces(2.0)


@pytest.mark.long
def test_schemes_agree(rubbing: tuple[Array, Array, Array, float]) -> None:
    """Impulses on velocities, whose forces do not ring, move the tip alike."""
    problem = rubbing_problem(
        ROD, BEAM, Elements(50), friction=vc.Coulomb(MU), start=published_start()
    )
    tip, r_n, _, _ = histories(problem, 0.005, 400, scheme=vc.MoreauJean())
    assert np.max(np.abs(tip - rubbing[0])) < 0.01 * np.max(np.abs(tip))
    assert np.sum(r_n) == pytest.approx(np.sum(rubbing[1]), rel=5e-3)


def test_records_and_ledger(tmp_path: Any) -> None:
    """``simulate`` with all recorders; the closed ledger includes the friction between rod and
    beam."""
    problem = rubbing_problem(
        ROD, BEAM, Elements(20), friction=vc.Coulomb(MU), start=published_start()
    )
    probe = vc.Probe({"tip": (5.0, 0.0), "middle": (2.5, 0.0)})
    solution = vc.simulate(
        problem,
        dt=0.01,
        steps=200,
        record=[vc.Energy(), vc.Contact(), probe],
        out=tmp_path,
        progress=False,
    )
    history = solution.history
    assert solution.facts["energy_defect"] <= 1e-10 and history["loss_friction"][-1] > 1.0
    assert history["u_x_tip"].max() == 0.05 and history["contact_max_slip"] == pytest.approx(
        np.abs(history["u_y_tip"])
    )
    assert np.min(history["u_y_middle"]) > np.min(history["u_y_tip"])
    assert history["friction_force_y"].max() > 5.0 > -5.0 > history["friction_force_y"].min()


def test_bad_input() -> None:
    """Rod and beam are one body; probes lie on its axis."""
    with pytest.raises(InputError, match="the rod is 2 m long and the beam 5 m"):
        rubbing_problem(Rod(length=2.0), TimoshenkoBeam(), Elements(4), friction=vc.Coulomb(0.1))
    problem = rod_problem(Rod(), Elements(4))
    assert problem.system.space.find_nodes(np.array([[5.0], [1.3]])).tolist() == [4, 1]
    for x in (5.3, -0.3, 0.5):
        with pytest.raises(
            InputError, match="away from the nearest node: give a point of the body"
        ):
            problem.system.space.find_nodes(np.array([[x]]))


@pytest.mark.parametrize("published", [False, True])
def test_ground_accelerates_the_mass_shared_with_the_clamp(published: bool) -> None:
    """The inertia load is that of the whole mass, rho A h at every node and half of it at the tip,
    along and across, and rotations feel none: what a uniform body force of minus rho A a does."""
    elements = Elements(4, reduced_shear=not published, published_end=published)
    rod, beam = Rod(length=2.0, rho=3.0), TimoshenkoBeam(length=2.0, rho=3.0)
    mass = 3.0 * np.array([0.5, 0.5, 0.5, 0.25])
    assert rod_problem(rod, elements).system.inertia(np.ones(1)) == pytest.approx(mass, rel=1e-14)
    problem = rubbing_problem(rod, beam, elements, friction=vc.Coulomb(MU))
    load = replace(problem, excitation=vc.FullSine(2.0, 1.0, direction=(1.0, -0.5))).equations.load(
        0.25
    )
    expected = -2.0 * np.concatenate([mass, np.zeros(4), -0.5 * mass])
    assert load == pytest.approx(expected, rel=1e-14, abs=1e-14)


def test_loads_that_stop_being_numbers() -> None:
    """The function and the time are named."""
    rod = Rod(end_force=lambda t: 1.0 if t < 0.05 else np.nan)
    with pytest.raises(
        InputError, match=r"end_force\(0\.05\d* s\) is nan; give a finite number in N"
    ):
        rod_forces(rod, Elements(4), dt=0.01, steps=20)
