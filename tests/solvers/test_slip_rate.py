"""Friction that depends on the slip rate: against ordinary differential equations, at rest, and at
every slow rate."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from column import rubbing_mass
from rubbing import rubbing_block
from scipy.integrate import solve_ivp

import vi_contact as vc
from vi_contact import solvers
from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError, StepFailure
from vi_contact.core.problem import ContactProblem
from vi_contact.core.step import Report
from vi_contact.laws.friction import Coulomb, ExponentialDecay, SlipRateCoulomb, StaticKinetic
from vi_contact.laws.mass import ConsistentMass
from vi_contact.run.march import march
from vi_contact.run.static import static_equilibrium
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.friction.extrapolation import Plain
from vi_contact.solvers.friction.slip_rate import RateIteration

pytestmark = pytest.mark.serial
MIDPOINT, BACKWARD = vc.ZienkiewiczWoodTaylor(), vc.ZienkiewiczWoodTaylor(phi=1.0)
DECAY = ExponentialDecay(mu_s=0.6, mu_k=0.3, v_c=0.1)
SCHEMES = [
    vc.ZienkiewiczWoodTaylor(),
    vc.SS22(),
    vc.Midpoint(),
    vc.Newmark(),
    vc.HHT(),
    vc.GeneralisedAlpha.spectral_radius(),
    vc.Houbolt(),
    vc.ContactStabilisedNewmark(),
    vc.MoreauJean(),
    vc.LinearMultistep.newmark(),
    vc.Trapezoidal(),
]


def belted(
    mu: Any, along: Any, *, stiffness: float = 100.0, normal_force: float = 10.0, **more: Any
) -> ContactProblem:
    """1 kg on a spring, pressed onto a belt that has moved along(t) [m]."""
    law = mu if isinstance(mu, Coulomb) else SlipRateCoulomb(mu)
    mass = rubbing_mass(
        u0=0.0,
        stiffness=stiffness,
        normal_force=normal_force,
        friction=law,
        mass=ConsistentMass(),
        **more,
    )
    return replace(mass, surface=mass.surface.moving(along=along))


def reports(
    problem: ContactProblem, dt: float, t_end: float, *, scheme: Any = MIDPOINT, **more: Any
) -> list[Report]:
    return [
        report
        for _, report in march(problem, scheme=scheme, solver=Condensed(**more), dt=dt, t_end=t_end)
    ]


def rate(report: Report) -> Array:
    """|v| of the step (m,), as the law sees it."""
    slip = report.step.surface.tangential_values(report.result.x) - report.step.slip0
    return report.step.rate_factor * np.linalg.norm(slip, axis=1)


def started(t: float, speed: float) -> float:
    """Way of a belt that takes one second to gain its speed."""
    return speed * (0.5 * t**2 if t < 1.0 else t - 0.5)


def stick_slip(speed: float, times: Array, *, k: float = 100.0, force: float = 10.0) -> Array:
    """Position of 1 kg on the belt of ``started`` under DECAY: rides until k x = mu_s N, slips
    until its rate is 0."""
    t, x, found = 1.0, started(1.0, speed), np.array([started(t, speed) for t in times])
    while t < times[-1]:
        release = t + (0.6 * force / k - x) / speed
        riding = (times >= t) & (times <= release)
        found[riding] = x + speed * (times[riding] - t)

        def motion(_: float, y: Array) -> list[float]:
            return [y[1], -k * y[0] + force * float(DECAY(np.array([speed - y[1]]))[0])]

        def caught(at: float, y: Array, start: float = release) -> float:
            return float(speed - y[1]) if at > start + 1e-2 else 1.0

        caught.terminal = True  # type: ignore[attr-defined]
        run = solve_ivp(
            motion,
            (release, release + 5.0),
            [0.6 * force / k, speed],
            method="DOP853",
            events=caught,
            dense_output=True,
            rtol=1e-10,
            atol=1e-13,
        )
        t, x = float(run.t[-1]), float(run.y[0, -1])
        slipping = (times > release) & (times <= t)
        if slipping.any():
            found[slipping] = run.sol(times[slipping])[0]
    return found


@pytest.mark.slow
@pytest.mark.parametrize(
    ("scheme", "fine", "t_end", "error", "gain"),
    [(MIDPOINT, 2e-3, 4.0, 3e-4, 12.0), (vc.MoreauJean(), 4e-3, 2.3, 0.03, 3.0)],
    ids=["displacements", "velocities"],
)
def test_stick_slip_on_a_belt(
    scheme: Any, fine: float, t_end: float, error: float, gain: float
) -> None:
    """Rides on the belt to 0.06 m, slips back, is caught: two cycles and a half of the differential
    equation. Order 2 where the rate is that of the mean reaction; order 1, in the first cycle, with
    the impulses of Moreau and Jean."""
    errors = []
    for dt in (4.0 * fine, fine):
        run = reports(belted(DECAY, lambda t: started(t, 0.05)), dt, t_end, scheme=scheme)
        x, t = np.array([r.new.u[0] for r in run]), np.array([r.new.t for r in run])
        assert max(r.certificate.worst for r in run) <= 1e-11
        errors.append(np.abs(x - stick_slip(0.05, t)).max() / 0.06)
    assert errors[1] < error and errors[1] < errors[0] / gain


@pytest.mark.slow
def test_oscillator_slides_to_rest() -> None:
    """The friction oscillator of V2.7 with mu falling over v_c = 0.02 m/s: turning points of the
    differential equation, and rest where the spring is weaker than mu_s N."""
    mu = ExponentialDecay(mu_s=0.9, mu_k=0.4, v_c=0.02)
    turns, x = [], 0.45e-3
    while 1.0e4 * abs(x) > 0.9:
        side = -np.sign(x)

        def motion(_: float, y: Array, side: float = side) -> list[float]:
            return [y[1], -1.0e4 * y[0] - side * float(mu(np.abs(y[1:2]))[0])]

        def turned(at: float, y: Array, side: float = side) -> float:
            return float(y[1]) * side if at > 1e-3 else 1.0

        turned.terminal = True  # type: ignore[attr-defined]
        way = solve_ivp(
            motion, (0.0, 1.0), [x, 0.0], events=turned, method="DOP853", rtol=1e-10, atol=1e-13
        )
        x = float(way.y[0, -1])
        turns.append(x)
    run = reports(
        rubbing_mass(u0=0.45e-3, friction=SlipRateCoulomb(mu), mass=ConsistentMass()), 2.5e-4, 0.15
    )
    u = np.array([r.new.u[0] for r in run])
    peaks = u[1:-1][(np.diff(u)[:-1] * np.diff(u)[1:] <= 0.0) & (np.diff(u)[:-1] != 0.0)]
    assert len(turns) >= 3 and peaks == pytest.approx(turns, rel=0.0, abs=2e-4 * 0.45e-3)
    assert u[-1] == u[-80] == peaks[-1]


@pytest.mark.slow
def test_steady_sliding() -> None:
    """mu = 0.2 + v damps: the mass comes to rest at x = mu(V) N/k, the belt slides on under mu(V)
    N."""
    for scheme, t_end in ((MIDPOINT, 5.0), (vc.MoreauJean(), 6.0), (vc.Newmark(), 4.0)):
        run = reports(belted(lambda v: 0.2 + v, lambda t: 0.2 * t), 0.05, t_end, scheme=scheme)
        last = run[-1]
        assert last.new.u[0] == pytest.approx(0.4 * 10.0 / 100.0, rel=1e-9)
        assert last.new.r_t[0, 0] == pytest.approx(-4.0, rel=1e-9) and rate(last) == pytest.approx(
            0.2, rel=1e-9
        )


LAWS = {
    "decay": DECAY,
    "jump": StaticKinetic(0.6, 0.3),
    "slow": ExponentialDecay(0.6, 0.3, 1e-4),
    "falling logarithm": lambda v: 0.6 - 0.01 * np.log1p(v / 1e-6),
    "growing logarithm": lambda v: 0.3 + 0.01 * np.log1p(v / 1e-6),
    "growing": lambda v: 0.3 + v,
}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("law", "scheme"),
    [
        *((law, BACKWARD) for law in LAWS),
        ("jump", vc.MoreauJean(1.0)),
        ("growing logarithm", vc.MoreauJean(1.0)),
    ],
    ids=lambda value: value if isinstance(value, str) else type(value).__name__,
)
def test_slow_slip_stays_inside_the_cone(law: str, scheme: Any) -> None:
    """A belt whose speed grows from 1e-6 to 1 m/s: |r_t| <= mu(|v|) r_n in every step, equal where
    it slips, with the exact law at the rate of the step; mu_s where it sticks. Rates over five
    decades occur under growing friction."""
    growth, mu = np.log(1e6) / 6.0, LAWS[law]
    dt = 4e-2 if law == "growing logarithm" else 8e-2
    run = reports(
        belted(mu, lambda t: 1e-6 * np.expm1(growth * t) / growth), dt, 6.0, scheme=scheme
    )
    speeds = np.array([rate(r)[0] for r in run])
    friction = np.array([abs(r.result.r_t[0, 0]) for r in run])
    limit = np.array([mu(rate(r))[0] * r.result.r_n[0] for r in run])
    assert np.all(friction <= limit * (1.0 + 1e-10))
    assert np.all(friction[speeds > 0.0] >= limit[speeds > 0.0] * (1.0 - 1e-10)) and np.any(
        speeds > 0.0
    )
    assert max(r.certificate.worst for r in run) <= 1e-10
    assert speeds.max() > 0.3
    if law == "growing logarithm":
        assert speeds[speeds > 0.0].min() < 1e-5


@pytest.mark.parametrize("scheme", SCHEMES, ids=lambda scheme: type(scheme).__name__)
def test_every_scheme_knows_its_rate(scheme: Any) -> None:
    """Displacement schemes: (u1 - u0)/dt; Moreau-Jean: v1. The reactions obey mu at that rate."""
    law = SlipRateCoulomb(lambda v: 0.1 + 0.5 * v)
    problem = rubbing_mass(
        u0=0.01, stiffness=100.0, normal_force=1.0, friction=law, mass=ConsistentMass()
    )
    slid = 0
    for report in reports(problem, 0.01, 0.2, scheme=scheme):
        v = (
            report.new.v[0]
            if isinstance(scheme, vc.MoreauJean)
            else (report.new.u[0] - report.old.u[0]) / 0.01
        )
        assert rate(report)[0] == pytest.approx(abs(v), rel=1e-9, abs=1e-12)
        r_n, r_t = report.result.r_n[0], report.result.r_t[0, 0]
        if abs(v) > 1e-6:
            assert r_t == pytest.approx(np.sign(v) * (0.1 + 0.5 * abs(v)) * r_n, rel=1e-9)
            slid += 1
    assert slid > 10


def test_static_and_kinetic_coefficients() -> None:
    """A pull that grows by less than 0.1 N a step: rest up to mu_s N, in motion mu_k N at once.

    The static stage rests too.
    """
    problem = belted(StaticKinetic(0.6, 0.3), lambda t: 0.5 * t**2)
    run = reports(problem, 2e-3, 0.36, scheme=BACKWARD)
    friction = np.array([-r.result.r_t[0, 0] for r in run])
    first = int(np.argmax([rate(r)[0] > 0.0 for r in run]))
    assert 0.58 * 10.0 < friction[first - 1] <= 6.0 and np.all(np.diff(friction[:first]) > 0.0)
    assert friction[first] == pytest.approx(3.0, rel=1e-12)
    for pull, sticks in ((5.9, True), (6.1, False)):
        still = rubbing_mass(
            u0=0.0,
            stiffness=100.0,
            normal_force=10.0,
            friction=SlipRateCoulomb(DECAY),
            mass=ConsistentMass(),
        )
        loaded = replace(
            still, system=still.system.with_load((np.array([pull, 0.0]), lambda t: 1.0))
        )
        state = static_equilibrium(loaded, solver=Condensed())
        assert bool(state.u[0] == 0.0) is sticks
        assert state.r_t[0, 0] == pytest.approx(min(pull, 6.0), rel=1e-12)


@pytest.fixture(scope="module")
def rubbed() -> list[Report]:
    """The block of the next test by the default method."""
    law = SlipRateCoulomb(ExponentialDecay((0.5, 0.6, 0.7), 0.2, 0.1))
    return reports(rubbing_block(law), 0.1, 6.0, scheme=BACKWARD)


@pytest.mark.slow
@pytest.mark.parametrize(
    "method", [solvers.FrictionNewton(), solvers.FixedPoint(), solvers.GivenForces()], ids=repr
)
def test_several_points_with_every_method(method: Any, rubbed: list[Report]) -> None:
    """A block that rubs along a wall with three points: certified with the exact law, the same with
    all methods; few outer iterations, logged with every step."""
    law = SlipRateCoulomb(ExponentialDecay((0.5, 0.6, 0.7), 0.2, 0.1))
    run = reports(rubbing_block(law), 0.1, 6.0, scheme=BACKWARD, friction_method=method)
    assert np.allclose(run[-1].new.u, rubbed[-1].new.u, rtol=0.0, atol=1e-8)
    touching = [r for r in run if r.new.r_n.any()]
    assert len(touching) > 20 and max(r.certificate.worst for r in run) <= 1e-10
    assert (
        all(r.result.history[-1] <= 1e-12 for r in touching)
        and max(len(r.result.history) for r in touching) <= 20
    )
    assert any(np.any(rate(r) > 0.0) for r in touching)


def test_a_constant_function_is_coulombs_law() -> None:
    """The same motion to the last bit, in one outer iteration."""
    one = reports(rubbing_block(Coulomb(0.3)), 0.1, 6.0)
    other = reports(rubbing_block(SlipRateCoulomb(lambda v: 0.3)), 0.1, 6.0)
    assert np.array_equal(one[-1].new.u, other[-1].new.u)
    assert all(len(r.result.history) == 1 for r in other)


def test_failures_are_told() -> None:
    """Coefficients that are none, at the rate that was tried; an iteration that does not end."""
    problem = belted(lambda v: 0.3 - v, lambda t: t)
    with pytest.raises(
        InputError, match=r"mu\([0-9.e-]+ m/s\) is -[0-9.]+; let it return zero or a positive"
    ):
        reports(problem, 1e-2, 1.0)
    with pytest.raises(InputError, match=r"mu\([0-9.e-]+ m/s\) is nan"):
        reports(belted(lambda v: np.where(v > 0.1, np.nan, 0.3), lambda t: t), 1e-2, 1.0)
    steep = belted(lambda v: 0.3 + 100.0 * v, lambda t: t)
    with pytest.raises(StepFailure, match="let mu\\(v\\) vary less with the slip rate"):
        reports(steep, 1e-2, 0.1, rates=RateIteration(extrapolation=Plain()))
    assert max(r.certificate.worst for r in reports(steep, 1e-2, 0.1)) <= 1e-10
