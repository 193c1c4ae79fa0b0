"""The default scheme in impacts with exact solutions: V1.1, V1.2, V1.3 and SDNV100, on bars and
strips of 100 elements.

The strip has nu = 0, three elements across and free sides. Energies are those of the exact solution
at most, but for 1e-9; V1.3 loses 1 % at its start, where the massless foot lets go of the energy of
the first element, which the exact bar keeps.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from bar import bouncing, energy, period_three
from bar import run as serial_run
from mpi4py import MPI

from demos.parts.problems.bar import Bar, build
from vi_contact.core.algebra import Array
from vi_contact.exact import BouncingBar, PeriodicBar, ThrownBar
from vi_contact.laws.mass import ConsistentMass, Redistributed
from vi_contact.run.march import march
from vi_contact.schemes.contact_stabilised import ContactStabilisedNewmark
from vi_contact.schemes.midpoint import Midpoint
from vi_contact.schemes.moreau_jean import MoreauJean
from vi_contact.schemes.newmark import Newmark
from vi_contact.schemes.trapezoidal import Trapezoidal

pytestmark = pytest.mark.slow

BODIES = {
    "bar": {"dimension": 1},
    "strip": {"dimension": 2},
    "triangles": {"dimension": 2, "triangles": True},
}


@dataclass(frozen=True)
class History:
    """Per step: time, contact force, mean force of the step and total energy, the last three over
    the section."""

    t: Array
    force: Array
    mean: Array
    energy: Array
    momentum: Array
    dt: float

    def impulse(self, start: float, end: float) -> float:
        inside = (self.t > start) & (self.t <= end)
        return float(self.mean[inside].sum() * self.dt)


def follow(
    bar: Bar, courant: float, t_end: float, *, scheme: Any = None, mass: Any = None
) -> History:
    """The bar's histories, by the default scheme unless told otherwise."""
    model, dt, rows = build(bar, MPI.COMM_WORLD), bar.time_step(courant), []
    for state, report in march(
        model.problem(mass=mass), scheme=scheme, dt=dt, steps=round(t_end / dt)
    ):
        system, load = report.problem.equations, report.problem.equations.load
        assert report.certificate.worst <= 1e-9
        total = system.kinetic_energy(state.v) + system.strain_energy(state.u)
        if np.any(load.constant):
            total -= system.algebra.dot(load.constant, state.u)
        up = system.influence[:, -1]
        momentum = system.algebra.dot(up, system.M @ state.v)
        forces = system.algebra.comm.sum(np.array([state.r_n.sum(), report.balance.r_n.sum()]))
        rows.append((state.t, *forces, total, momentum))
    t, *values = np.array(rows).T
    return History(t, *(value / bar.section for value in values), dt)


@pytest.mark.parametrize(
    "body, courant",
    [
        ("strip", 1.0),
        *(
            # one body on two ranks: the others have the same path
            pytest.param(body, courant, marks=pytest.mark.serial)
            for body, courant in (
                ("bar", 0.25),
                ("triangles", 0.5),
            )
        ),
    ],
)
def test_thrown_bar(body: str, courant: float) -> None:
    """V1.1: force within 1 % of 300 in the window, contact 2/3 s ± 2 dt, mean rebound 10 ± 2 %,
    energy within 1 %."""
    found = follow(Bar(ThrownBar(), **BODIES[body]), courant, 1.6)  # type: ignore[arg-type]
    window = (found.t > 0.6) & (found.t < 1.067)
    assert np.abs(found.force[window] / 300.0 - 1.0).max() <= 0.01
    touching = found.t[found.force > 0.0]
    assert touching[-1] - touching[0] == pytest.approx(2.0 / 3.0, abs=2.001 * found.dt)
    assert touching[0] == pytest.approx(0.5, abs=1.001 * found.dt)
    assert found.momentum[-1] / 10.0 == pytest.approx(10.0, rel=0.02)
    assert np.abs(found.energy / 500.0 - 1.0).max() <= 0.01
    assert found.impulse(0.0, 1.6) == pytest.approx(200.0, rel=0.02)


@pytest.mark.serial
@pytest.mark.parametrize(
    "body, courant",
    [("bar", 1.0), ("bar", 0.25), ("strip", 1.0), ("triangles", 0.5)],
)
def test_period_three(body: str, courant: float) -> None:
    """V1.3, four bounces: energy never above 1/8 nor below 98 % of it, force up to 1.8 times the
    exact one, impulse of the first contact within 2 %. Of all four together 4 % are missing at
    Courant number 1, 2.5 % at ½, 1.5 % at ¼: it has gone into waves too short for the mesh."""
    missing = {1.0: 0.04, 0.5: 0.025, 0.25: 0.015}[courant]
    found = follow(Bar(PeriodicBar(), **BODIES[body]), courant, 12.0)  # type: ignore[arg-type]
    assert found.energy.max() <= 0.125 * (1.0 + 1e-9) and found.energy[-1] >= 0.98 * 0.125
    assert found.force.max() <= 1.8 * 0.5
    assert found.impulse(0.0, 3.0) == pytest.approx(0.5, rel=0.02)
    assert found.impulse(0.0, 12.0) == pytest.approx(2.0, rel=missing)


@pytest.mark.serial
@pytest.mark.parametrize("courant, periods, floor", [(1.0, 2, 0.993), (0.5, 0.5, 0.999)])
def test_bouncing_strip(courant: float, periods: float, floor: float) -> None:
    """V1.2: energy after so many periods (ten of the bar: below), impulse of the first contact
    800/3 within 0.5 %."""
    bar = Bar(BouncingBar(), **BODIES["strip"])  # type: ignore[arg-type]
    found = follow(bar, courant, periods * 16.0 / 3.0)
    above = found.energy + bar.case.energy  # zero is the bar standing on the wall
    assert floor <= above[-1] / 500.0 and above.max() <= 500.0 * (1.0 + 1e-3)
    assert found.impulse(0.0, 2.5) == pytest.approx(800.0 / 3.0, rel=5e-3)


@pytest.mark.serial
@pytest.mark.parametrize(
    "courant, periods, floor", [(1.0, 10, 0.88), (0.5, 2, 0.992), (0.2, 0.5, 0.9999)]
)
def test_bouncing_bar_for_ten_periods(courant: float, periods: int, floor: float) -> None:
    """V1.2: energy >= 0.88 of the first after ten periods, 0.992 after two, 0.9999 after half of
    one (4000 steps), at most 1.001 of it; the foot as the exact bar's in the first period, 1.5 %
    rms of the height (measured 1.4, 1.1 and 0.9 %)."""
    exact, dt = BouncingBar(), courant / 300.0
    problem = bouncing(100, mass=Redistributed())
    lowest, highest, impulse, error = 1.0, 0.0, 0.0, []
    for report in serial_run(
        problem, Trapezoidal(), dt=dt, steps=round(periods * exact.period / dt)
    ):
        t = report.new.t
        if t < 2.5:
            impulse += dt * float(report.balance.r_n.sum())
        if t < exact.period and report.new.k % round(1.0 / courant) == 0:
            error.append(
                -problem.surface.normal_values(report.new.u)[0] - float(exact.displacement(0.0, t))
            )
        if report.new.k % 100 == 0:
            total = energy(problem, report.new) / 500.0 + 1.0
            lowest, highest = min(lowest, total), max(highest, total)
    assert floor <= lowest and highest <= 1.001
    assert impulse == pytest.approx(800.0 / 3.0, rel=5e-3)
    assert np.sqrt(np.mean(np.square(error))) <= 0.015 * exact.height


@pytest.mark.serial
@pytest.mark.parametrize("body", ["bar", "triangles"])
def test_code_aster_sdnv100(body: str) -> None:
    """The second data set of V1.1: contact from 2e-5 to 1e-4 s, the top 4 mm lower at the deepest
    than at touch-down (6 mm than at the start), 8e6 S joule, velocity of the top -100 to 100 m/s
    within 1 %, pressure 4e9 Pa."""
    case = ThrownBar(length=0.2, E=2.0e11, rho=8000.0, height=2.0e-3, speed=100.0)
    bar = Bar(case, **BODIES[body])  # type: ignore[arg-type]
    model, dt = build(bar, MPI.COMM_WORLD), bar.time_step(0.5)
    problem = model.problem()
    ends = problem.system.space.find_nodes(
        np.array([model.probes()["foot"], model.probes()["top"]])
    )
    rows = []
    for state, report in march(problem, dt=dt, steps=round(1.2e-4 / dt)):
        u, v = (
            problem.system.space.sample(problem.cartesian(x), ends, state.t)[:, -1]
            for x in (state.u, state.v)
        )
        system = report.problem.equations
        total = system.kinetic_energy(state.v) + system.strain_energy(state.u)
        force = MPI.COMM_WORLD.allreduce(state.r_n.sum())
        rows.append((state.t, *u, v[1], force / bar.section, total / bar.section))
    t, foot, top, v_top, pressure, total = np.array(rows).T
    touching = t[pressure > 0.0]
    assert touching[0] == pytest.approx(2.0e-5, abs=1.001 * dt)
    assert touching[-1] == pytest.approx(1.0e-4, abs=2.001 * dt)
    deepest = np.argmin(np.abs(t - 6.0e-5))
    assert foot[deepest] == pytest.approx(-2.0e-3, rel=1e-9) and top[deepest] == pytest.approx(
        -6.0e-3, rel=0.01
    )
    early, late = t < 5.5e-5, t > 1.03e-4
    assert np.abs(v_top[early] / -100.0 - 1.0).max() <= 0.01 and v_top[
        late
    ].mean() == pytest.approx(100.0, rel=0.01)
    window = (t > 3.2e-5) & (t < 9.0e-5)
    assert np.abs(pressure[window] / 4.0e9 - 1.0).max() <= 0.01
    assert np.abs(total / 8.0e6 - 1.0).max() <= 0.01


@pytest.mark.serial
@pytest.mark.parametrize(
    ("scheme", "courant"),
    [
        *((scheme, 1.0) for scheme in (Midpoint(), ContactStabilisedNewmark(), MoreauJean())),
        (ContactStabilisedNewmark(), 0.5),
        (MoreauJean(), 0.5),
        (MoreauJean(), 0.1),
    ],
    ids=repr,
)
def test_dissipative_schemes_never_gain(scheme: Any, courant: float) -> None:
    """No step of V1.3 raises the energy by more than 1e-11 of its start: two periods, at Courant
    number 0.1 the first contact."""
    problem = period_three(100, mass=ConsistentMass())
    last, periods = 0.125, 2.0 if courant > 0.1 else 0.7
    for report in serial_run(
        problem, scheme, dt=courant / 100.0, steps=round(300 * periods / courant)
    ):
        now = energy(problem, report.new)
        assert now - last <= 1e-11 * 0.125
        last = now


@pytest.mark.serial
@pytest.mark.parametrize(
    ("case", "courant"),
    [(ThrownBar(), 1.0), (ThrownBar(), 0.5), (PeriodicBar(), 1.0), (PeriodicBar(), 0.1)],
    ids=lambda value: type(value).__name__ if not isinstance(value, float) else str(value),
)
def test_dissipative_schemes_never_gain_on_a_strip(case: Any, courant: float) -> None:
    """The same on strips of 40 elements: the contact-stabilised scheme in V1.1 and in one period of
    V1.3."""
    bar = Bar(case, elements=40, dimension=2)
    t_end = 1.3 if isinstance(case, ThrownBar) else 3.0
    found = follow(bar, courant, t_end, scheme=ContactStabilisedNewmark())
    assert np.diff(found.energy).max() <= 1e-11 * case.energy
    assert found.energy[-1] >= 0.97 * case.energy


@pytest.mark.serial
def test_newmark_on_consistent_mass_blows_up_on_a_strip() -> None:
    """Negative test: V1.3 on a strip of triangles, Courant number ½, where not all nodes of the
    foot act as one (bars: schemes/test_newmark.py)."""
    found = follow(
        Bar(PeriodicBar(), dimension=2, triangles=True),
        0.5,
        12.0,
        scheme=Newmark(),
        mass=ConsistentMass(),
    )
    assert found.energy[-1] > 10.0 * 0.125
