"""Columns and a mass that rub on their base, against exact solutions: V1.5, V1.6, V2.7 (iii).

Each with the midpoint rule on consistent mass and with the trapezoidal rule on redistributed mass;
errors fall with h.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from column import UNIT, column, rubbing_mass
from energy_checks import rounded
from exact_columns import ObliqueImpact, ShearColumn

from vi_contact.core.problem import ContactProblem
from vi_contact.laws.friction import Coulomb, Tresca
from vi_contact.laws.mass import ConsistentMass, Redistributed
from vi_contact.run.recorders import Contact, Energy
from vi_contact.run.simulate import simulate
from vi_contact.schemes.trapezoidal import Trapezoidal
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.friction.fixed_point import FixedPoint
from vi_contact.solvers.friction.nsgs import NSGS

pytestmark = pytest.mark.serial
PAIRS = [(ZienkiewiczWoodTaylor(), ConsistentMass()), (Trapezoidal(), Redistributed())]
NAMES = ["midpoint", "trapezoidal"]
N, DT = 100, 5e-3


def history(
    problem: ContactProblem, scheme: Any, *, t_end: float, dt: float = DT, **solver: Any
) -> dict[str, Any]:
    """The history, once every step is certified and the ledger (V9.7) with friction in it
    closes."""
    found = dict(
        simulate(
            problem,
            scheme=scheme,
            solver=Condensed(**solver),
            dt=dt,
            t_end=t_end,
            record=[Energy(), Contact()],
        ).history
    )
    total = found["energy_kinetic"] + found["energy_strain"]
    losses = sum(value for name, value in found.items() if name.startswith("loss_"))
    defect = total + losses - found["work_input"] - total[0]
    way = max(np.abs(found["slip"]).max(), np.abs(found["gap"]).max())
    # measured: 0.18 of it
    assert np.abs(defect).max() <= 1e-11 * total.max() + rounded(problem, way)
    assert found["certificate"].max() <= 1e-12
    assert np.diff(found["loss_friction"]).min() >= -1e-14 * total.max()
    return found


def impulses(found: dict[str, Any], scheme: Any) -> tuple[float, float]:
    """Normal (up) and tangential impulse of the base on the column: means of the step, or the
    trapezoidal rule."""
    forces = [found["contact_force_y"], found["friction_force_x"]]
    ends = [0.5 * force[0] if isinstance(scheme, Trapezoidal) else 0.0 for force in forces]
    return tuple(
        DT * (float(force[1:].sum()) + end) for force, end in zip(forces, ends, strict=True)
    )  # type: ignore


@pytest.mark.parametrize(("scheme", "mass"), PAIRS, ids=NAMES)
def test_V15_oblique_impact(scheme: Any, mass: Any) -> None:
    """V1.5: slip speed 0.575736 during the contact, impulses (2.0, -0.6), friction work 0.345442,
    energy 0.654558."""
    exact = ObliqueImpact(height=1.0, material=UNIT, speed_n=1.0, speed_t=1.0, mu=0.3)
    assert exact.slip_speed == pytest.approx(0.575736, abs=1e-6)
    assert exact.friction_work == pytest.approx(0.345442, abs=1e-6)
    found = history(column(N, v0=(1.0, -1.0), friction=Coulomb(0.3), mass=mass), scheme, t_end=1.6)
    normal, tangential = impulses(found, scheme)
    assert normal == pytest.approx(2.0, rel=0.005)
    assert tangential == pytest.approx(-0.6, rel=0.005)
    assert found["loss_friction"][-1] == pytest.approx(exact.friction_work, rel=0.002)
    assert found["energy_kinetic"][-1] + found["energy_strain"][-1] == pytest.approx(
        exact.energy, rel=0.005
    )
    inside = (found["t"] > 0.2) & (found["t"] < 1.2)
    slip, t = found["slip"][inside, 0, 0], found["t"][inside]
    assert (slip[-1] - slip[0]) / (t[-1] - t[0]) == pytest.approx(exact.slip_speed, rel=0.01)
    closed = found["active"][:, 0]
    np.testing.assert_allclose(
        found["traction_t"][closed, 0, 0], 0.3 * found["pressure"][closed, 0], rtol=1e-12
    )


@pytest.mark.parametrize(("scheme", "mass"), PAIRS, ids=NAMES)
def test_V15_sticks_under_much_friction(scheme: Any, mass: Any) -> None:
    """V1.5 with mu = 1.5: the base sticks at once; the traction is rho c_S v_t and no friction work
    is done but by the first step, in which the node of the base is stopped."""
    exact = ObliqueImpact(height=1.0, material=UNIT, speed_n=1.0, speed_t=1.0, mu=1.5)
    assert exact.slip_speed == 0.0
    found = history(column(N, v0=(1.0, -1.0), friction=Coulomb(1.5), mass=mass), scheme, t_end=1.3)
    inside = (found["t"] > 0.3) & (found["t"] < 1.2)
    assert np.ptp(found["slip"][inside, 0, 0]) == 0.0
    assert found["traction_t"][inside, 0, 0].mean() == pytest.approx(exact.traction, rel=0.01)
    assert found["loss_friction"][-1] <= 0.002


@pytest.mark.parametrize(("scheme", "mass"), PAIRS, ids=NAMES)
def test_V16_slides_to_rest(scheme: Any, mass: Any) -> None:
    """V1.6: slip speeds 0.85, 0.55, 0.25 for two seconds each, stick at t = 6 for good; slip 3.3,
    work 0.495."""
    exact = ShearColumn(height=1.0, material=UNIT, speed=1.0, tau_y=0.15)
    assert exact.slip_speeds == pytest.approx(
        [0.85, 0.55, 0.25]
    ) and exact.stick_time == pytest.approx(6.0)
    found = history(column(N, v0=(1.0, 0.0), friction=Tresca(0.15), mass=mass), scheme, t_end=8.0)
    slip, t = found["slip"][:, 0, 0], found["t"]
    for trip, speed in enumerate(exact.slip_speeds):
        first, last = np.searchsorted(t, [2.0 * trip + 0.4, 2.0 * trip + 1.6])
        assert (slip[last] - slip[first]) / (t[last] - t[first]) == pytest.approx(speed, rel=0.005)
    creep = np.ptp(slip[t > exact.stick_time + 0.2])
    if isinstance(scheme, Trapezoidal):  # no slip at all, not a little
        assert creep == 0.0 and np.ptp(slip[t > exact.stick_time - 0.1]) > 0.0
    else:  # the traction rings, now and then up to the threshold
        assert creep <= 1e-3 * exact.slip
    assert slip[-1] == pytest.approx(exact.slip, rel=0.001)
    assert found["loss_friction"][-1] == pytest.approx(exact.friction_work, rel=0.001)
    assert found["energy_kinetic"][-1] + found["energy_strain"][-1] == pytest.approx(
        exact.energy, abs=3e-4
    )


@pytest.mark.parametrize("method", [NSGS(), FixedPoint()], ids=["nsgs", "fixed point"])
def test_V15_other_methods_agree(method: Any) -> None:
    """V1.5 by other methods for the small problem: the same histories to 1e-10."""
    problem = column(20, v0=(1.0, -1.0), friction=Coulomb(0.3), mass=Redistributed())
    one = history(problem, Trapezoidal(), t_end=1.5, dt=0.02)
    other = history(problem, Trapezoidal(), t_end=1.5, dt=0.02, friction_method=method)
    assert one["loss_friction"][-1] > 0.3
    assert np.abs(other["slip"] - one["slip"]).max() <= 1e-10
    assert np.abs(other["traction_t"] - one["traction_t"]).max() <= 1e-10


@pytest.mark.parametrize("friction", [Coulomb(1.0), Tresca(1.0)], ids=repr)
def test_V27_friction_oscillator(friction: Any) -> None:
    """V2.7 (iii): M = 1, K = 1e4, mu N = 1, u0 = 0.85 mm: turns at -0.65, 0.45, -0.25, 0.05 mm,
    then sticks."""
    half = np.pi / 100.0
    found = history(
        rubbing_mass(u0=0.85e-3, friction=friction, mass=ConsistentMass()),
        ZienkiewiczWoodTaylor(),
        t_end=5.0 * half,
        dt=half / 200.0,
    )
    u = found["slip"][:, 0, 0]
    turns = u[200:1000:200]
    assert turns == pytest.approx([-0.65e-3, 0.45e-3, -0.25e-3, 0.05e-3], rel=0.005)
    assert np.ptp(u[-150:]) == 0.0 and u[-1] == pytest.approx(0.05e-3, rel=0.005)
