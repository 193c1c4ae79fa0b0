"""Points at the thresholds of a joint, whose steps constant strengths do not settle."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from marched_chain import difference

import vi_contact as vc
from vi_contact import laws
from vi_contact.solvers.joints import MOST

pytestmark = pytest.mark.serial
MASS, STIFF, STRENGTH, OPENING, DT = 1000.0, 1e6, 2000.0, 1e-3, 1e-3  # kg, N/m, N, m, s
STEEP = (27, 31, 56, 66)  # seeds of two points whose tension has to be on springs
# Seeds that passes of constant strengths alone refuse, by the number of points.
REFUSED = {1: (80, 83, 86), 2: (56, 59, 66, 72, 79, 83)}


def draw(seed: int, count: int) -> tuple[vc.Stepper, dict[str, Any]]:
    """Coupled masses that have opened by 1 nm to 10 µm before, open, closed or between, in motion
    and under loads up to twice their strength; and what a step by hand needs."""
    rng = np.random.default_rng(seed)
    couple = np.eye(count) * count - np.ones((count, count))
    K = STIFF * (np.eye(count) + rng.uniform(0.2, 0.8) * couple)
    opened = 10.0 ** rng.uniform(-9.0, -5.0, count)
    g0 = opened * rng.choice([0.0, 0.3, 0.9, 1.0], count)
    v0 = rng.choice([-1.0, 1.0], count) * 10.0 ** rng.uniform(-6.0, -2.0, count)
    load = rng.uniform(0.0, 2.0 * STRENGTH, count)
    places = [[float(i)] for i in range(count)]
    system = vc.system_from_arrays(np.full(count, MASS), None, K, coordinates=places)
    surface = vc.contact_points(system, list(range(count)), [[-1.0]] * count)
    law = laws.Joint(tension=tuple(STRENGTH / surface.weights), opening=OPENING)
    system = system.with_load((load, lambda t: 1.0))
    problem = vc.ContactProblem(system, surface, joint=law, mass=vc.ConsistentMass())
    state = vc.State(
        t=0.0,
        k=0,
        u=surface.in_frames(g0),
        v=surface.in_frames(v0),
        r_n=np.zeros(count),
        active=g0 <= 0.0,
        memory={
            "joint_kappa": opened,
            "joint_opened": opened,
            "joint_way": np.zeros(count),
        },
    )
    stepper = vc.Stepper(problem, scheme=vc.Midpoint(), solver=vc.Condensed(), state=state)
    return stepper, {"K": K, "g0": g0, "v0": v0, "load": load, "opened": opened}


def pull(opened: float, g0: float, g1: float) -> float:
    """The mean force over the way: along the secant to the largest opening, then along the law."""
    left = STRENGTH * (1.0 - opened / OPENING)
    turn = min(g1, opened)
    work = 0.5 * left / opened * (turn - g0) * (turn + g0)
    if g1 > opened:
        end = min(g1, OPENING)
        work += STRENGTH * (end - opened) * (1.0 - 0.5 * (end + opened) / OPENING)
    return work / (g1 - g0) if g1 != g0 else left * g0 / opened


@pytest.mark.parametrize("count", [1, 2])
def test_steps_at_the_thresholds_are_the_answers_by_hand(count: int) -> None:
    """The midpoint rule by hand: a point that is open at the end is in balance with the mean force
    of its way, a closed one is pressed or pulled by less than its strength. The matrix of the step,
    2 M/dt² + K/2, is 2000 times the slope of the law, so there is one answer."""
    for seed in (*range(32), *REFUSED[count]):
        stepper, at = draw(seed, count)
        trial = stepper.attempt(DT)
        assert trial.report.certificate.worst < 1e-9, seed
        g1 = stepper.method.problem.cartesian(trial.state.u)
        rise = 2.0 * MASS / DT * ((g1 - at["g0"]) / DT - at["v0"])
        r = rise + at["K"] @ (at["g0"] + g1) / 2.0 - at["load"]  # that of the contact and the joint
        for i in range(count):
            if g1[i] > 0.0:
                force = pull(at["opened"][i], at["g0"][i], g1[i])
                assert abs(r[i] + force) < 3e-9 * STRENGTH, seed
            else:
                held = pull(at["opened"][i], at["g0"][i], 0.0)
                assert r[i] > -held - 1e-9 * STRENGTH, seed


def test_steep_steps_are_the_same_again_after_halves() -> None:
    """Trials of other sizes, some of them steep, change nothing, to the last bit."""
    for seed in STEEP:
        stepper, _ = draw(seed, 2)
        first = stepper.attempt(DT)
        assert stepper.joints[DT].passes[-1] > MOST
        stepper.attempt(0.5 * DT)
        stepper.attempt(2.0 * DT)
        again = stepper.attempt(DT)
        assert difference(again.state, first.state) == 0.0
        for name, values in first.state.memory.items():
            assert np.array_equal(again.state.memory[name], values)


def test_a_constant_tension_is_lost_in_the_mean_of_a_slip() -> None:
    """Slip of 0.9 mm to 1.1 mm takes half of its way beyond dc = 1 mm: half of the strengths is
    left in the mean, of the tension as of the cohesion, and nothing after the step."""
    law = laws.Joint(mu=0.5, cohesion=2e5, tension=2e5, opening=1e-3, softening="constant")
    zero = np.zeros(1)
    before = {"kappa": np.array([9e-4]), "opened": zero, "way": np.array([9e-4])}
    slips = (np.array([[9e-4]]), np.array([[1.1e-3]]))
    mean = law.strength(before, zero, zero, *slips, DT)
    assert mean.tension[0] == pytest.approx(1e5) and mean.cohesion[0] == pytest.approx(1e5)
    after = law.commit(before, zero, zero, *slips, DT)
    end = law.strength(after, zero, zero, slips[1], slips[1], DT)
    assert end.tension[0] == 0.0 and end.cohesion[0] == 0.0
