"""The loop: starts, certificates and escalation, metamorphic tests, static stage, supports on
springs."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from bar import bar, energy, run
from chain import chain_problem
from shaken import changes, shaken

from vi_contact.core.algebra import SerialMatrix
from vi_contact.core.errors import InputError, StepFailure
from vi_contact.core.problem import ContactProblem
from vi_contact.core.step import State, StepResult
from vi_contact.laws.friction import Coulomb
from vi_contact.laws.impact import Elastic, Inelastic
from vi_contact.run.static import static_equilibrium
from vi_contact.schemes.linear_multistep import LinearMultistep
from vi_contact.schemes.ss22 import SS22
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed

pytestmark = pytest.mark.serial
HALF, NEWMARK = ZienkiewiczWoodTaylor(), LinearMultistep.newmark()
SCHEMES = [HALF, SS22(0.6, 0.7), NEWMARK]


# starts


def test_initial_penetration_is_refused():
    with pytest.raises(
        InputError, match=r"penetrates the obstacle by 0.002 m: reduce it, enlarge the gap, or"
    ):
        next(run(chain_problem(3, gap=0.01, u0=[0.0, 0.0, 0.012]), HALF, dt=0.1, steps=1))
    with pytest.raises(InputError, match="penetrates"):
        next(
            run(chain_problem(3, gap=0.01, u0=[0.0, 0.0, 0.01 * (1 + 1e-7)]), HALF, dt=0.1, steps=1)
        )
    touching = chain_problem(3, gap=0.01, u0=[0.0, 0.0, 0.01 * (1 + 1e-12)])
    assert len(list(run(touching, HALF, dt=0.1, steps=1))) == 1


def test_states_and_reports_fit_together():
    reports = list(run(shaken(Inelastic()), HALF, dt=5e-3, steps=20))
    for k, report in enumerate(reports, start=1):
        assert report.new.k == report.step.k == k
        assert report.new.t == report.step.t == pytest.approx(5e-3 * k, rel=1e-14)
        assert report.old.k == k - 1 and not report.escalated
    assert all(one.new is two.old for one, two in zip(reports[:-1], reports[1:], strict=True))


@pytest.mark.parametrize("scheme", SCHEMES, ids=lambda s: type(s).__name__)
@pytest.mark.parametrize("impact", [None, Elastic()], ids=["none", "elastic"])
def test_continuing_from_a_state_is_bit_equal(scheme, impact):
    whole = list(run(shaken(impact), scheme, dt=5e-3, steps=80))
    again = list(run(shaken(impact), scheme, dt=5e-3, steps=40, state=whole[39].new))
    assert changes(again) >= 2
    for name in ("t", "k", "u", "v", "r_n"):
        np.testing.assert_array_equal(getattr(again[-1].new, name), getattr(whole[-1].new, name))


# certificates and escalation


def test_nan_load_stops_at_its_step():
    """The force on the last mass turns NaN after t = 0.035."""
    problem = shaken(excitation=())
    problem = replace(
        problem,
        system=problem.system.with_load((np.ones(6), lambda t: np.nan if t > 0.035 else 0.0)),
    )
    steps = run(problem, ZienkiewiczWoodTaylor(1.0), dt=0.01, steps=10)
    for _ in range(3):
        next(steps)
    with pytest.raises(
        StepFailure, match=r"the load of step 4 at t = 0.04 s contains NaN or infinite"
    ):
        next(steps)


@dataclass(frozen=True)
class Careless:
    """Ignores the wall and calls the result solved; with ``honest`` it gives up instead."""

    honest: bool = False

    def check(self, problem: ContactProblem) -> None:
        """Takes everything."""

    def prepare(self, A, surface, scale):
        return self

    def solve(self, step):
        if self.honest:
            raise StepFailure("careless: I have no idea")
        m = step.surface.count
        return StepResult(
            step.A.factor.solve(step.b), np.zeros(m), np.zeros(m, dtype=bool), 0, "careless"
        )


@pytest.mark.parametrize("honest", [False, True])
def test_bad_step_goes_to_the_next_solver(honest):
    """The steps that close escalate, are reported, and the run is the one of the good solver."""
    bad = list(
        run(shaken(), HALF, dt=5e-3, steps=60, solver=Careless(honest), escalation=[Condensed()])
    )
    good = list(run(shaken(), HALF, dt=5e-3, steps=60))
    assert 5 < sum(report.new.active[0] for report in good) < 55
    for one, other in zip(bad, good, strict=True):
        assert one.escalated == (honest or bool(other.new.active[0]))
        assert one.certificate.worst <= 1e-9
        np.testing.assert_allclose(one.new.u, other.new.u, rtol=1e-12, atol=1e-15)


@pytest.mark.promise("start/model.md", "accept a step whose certificate is at or below")
@pytest.mark.promise("start/ten_minutes_form.md", "`simulate` accepts no step above 1e-9")
@pytest.mark.promise("theory/certificate.md", "A run accepts a step at or below `tolerance`")
def test_without_escalation_a_bad_step_raises_and_says_where():
    good = list(run(shaken(), HALF, dt=5e-3, steps=60))
    first = next(report.new for report in good if report.new.active[0])
    done = []
    with pytest.raises(StepFailure) as caught:
        done.extend(run(shaken(), HALF, dt=5e-3, steps=60, solver=Careless()))
    assert len(done) == first.k - 1  # they were handed out
    message = str(caught.value)
    assert f"step {first.k} at t = {first.t:.6g} s" in message
    for word in (
        "1e-09",
        "careless: Certificate(equilibrium=",
        "penetration=",
        "complementarity=",
        "try a smaller dt",
    ):
        assert word in message
    both = run(
        shaken(), HALF, dt=5e-3, steps=60, solver=Careless(), escalation=[Careless(honest=True)]
    )
    with pytest.raises(StepFailure, match=r"careless: Certificate.*; careless: I have no idea"):
        list(both)


def test_tolerance_decides_what_is_accepted():
    """The careless answer passes once the user accepts a residual of one."""
    assert len(list(run(shaken(), HALF, dt=5e-3, steps=60, solver=Careless(), tolerance=1.0))) == 60


def test_a_solver_that_cannot_take_the_problem_is_refused_also_for_escalation():
    problem = replace(chain_problem(3), friction=Coulomb(0.3))
    for solvers in ({"solver": Condensed()}, {"solver": Careless(), "escalation": [Condensed()]}):
        with pytest.raises(InputError, match=r"cannot use Coulomb\(mu=0.3\)"):
            list(run(problem, HALF, dt=0.1, steps=1, **solvers))


# gravity stage


def test_static_stage_of_a_bar_standing_on_its_foot():
    """V2-like, exact at the nodes: a clamped bar pressed onto the wall by its weight; the wall
    carries what the clamp does not: r = rho g L/2 - E gap/L for a gap that closes, and u from the
    discrete equations."""
    E, L, rho, g, gap = 900.0, 10.0, 1.0, 10.0, 0.1
    problem = bar(20, clamped=True, gravity=g, gap=gap)
    state = static_equilibrium(problem, solver=Condensed())
    x = np.linspace(0.0, L, 21)[:20]
    exact = rho * g / (2.0 * E) * (x**2 - L * x) - gap * (1.0 - x / L)
    np.testing.assert_allclose(problem.cartesian(state.u), exact, atol=1e-12)
    assert state.r_n[0] == pytest.approx(rho * g * L / 2.0 - E * gap / L, rel=1e-12)
    assert state.active.all() and not state.v.any() and state.k == 0
    hanging = static_equilibrium(bar(20, clamped=True, gravity=g, gap=0.6), solver=Condensed())
    assert not hanging.active.any() and hanging.u[0] == pytest.approx(
        rho * g * L**2 / (2.0 * E), rel=1e-12
    )


@pytest.mark.parametrize("scheme", SCHEMES, ids=lambda s: type(s).__name__)
@pytest.mark.parametrize("springs", [None, 4e3])
def test_static_state_is_an_equilibrium_of_every_scheme(scheme, springs):
    """Left alone it stays, with its reaction, to round-off."""
    problem = bar(20, clamped=True, gravity=10.0, gap=0.1, impact=Inelastic())
    if springs:
        problem = replace(problem, surface=problem.surface.on_springs(springs))
    state = static_equilibrium(problem, solver=Condensed())
    for report in run(problem, scheme, dt=0.02, steps=50, state=state):
        assert np.abs(report.new.u - state.u).max() <= 1e-12 * np.abs(state.u).max()
        assert report.new.r_n[0] == pytest.approx(state.r_n[0], rel=1e-9)


def test_static_stage_ignores_the_excitation():
    calm = static_equilibrium(shaken(excitation=(), constant=3.0), solver=Condensed(), t=1.0)
    shaking = static_equilibrium(shaken(constant=3.0), solver=Condensed(), t=1.0)
    np.testing.assert_array_equal(shaking.u, calm.u)
    assert shaking.t == 1.0


# deformable support


def sprung(problem: ContactProblem, modulus: float) -> ContactProblem:
    """On springs of this modulus [Pa/m] times the weight."""
    return replace(problem, surface=problem.surface.on_springs(modulus))


def glued(problem: ContactProblem, k: float) -> ContactProblem:
    """The same spring as a part of K, closed for good: K + k e eᵀ on the contact unknown, which
    then has no wall."""
    system, row = problem.system, int(problem.surface.owned[0])
    extra = np.zeros(system.rows)
    extra[row] = k
    K = SerialMatrix(system.K.csr + sp.diags(extra))
    free = replace(problem.surface, gap0=np.array([np.inf]))
    return replace(problem, system=replace(system, K=K), surface=free)


def test_static_spring_that_stays_closed_is_a_spring_of_the_structure():
    """Remark after seed 000 eq. 6: k = modulus times weight (0.5 m²), r = k u."""
    problem = shaken(gap=0.0, excitation=(), constant=30.0)
    soft = static_equilibrium(sprung(problem, 4e3), solver=Condensed())
    stiff = static_equilibrium(glued(problem, 2e3), solver=Condensed())
    np.testing.assert_allclose(soft.u, stiff.u, rtol=1e-12)
    assert soft.r_n[0] == pytest.approx(2e3 * soft.u[-1], rel=1e-12)


def ringing(**more: Any) -> ContactProblem:
    """Pressed on by 3000 N, the springs stay closed while it rings."""
    return shaken(
        gap=0.0, stiffness=1e3, excitation=(), constant=3000.0, u0=np.linspace(0.2, 1.2, 6), **more
    )


def displaced(problem: ContactProblem) -> State:
    """Its initial state, springs compressed."""
    system = problem.equations
    return State(0.0, 0, system.u0, system.v0, np.zeros(1), np.ones(1, dtype=bool))


@pytest.mark.parametrize(
    "scheme", [NEWMARK, ZienkiewiczWoodTaylor(1.0), SS22(1.0, 1.0)], ids=["lmm", "zwt", "ss22"]
)
def test_dynamic_spring_that_stays_closed_is_a_spring_of_the_structure(scheme):
    """Exactly so for schemes that balance forces at the end of the step."""
    soft, stiff = sprung(ringing(), 4e3), glued(ringing(), 2e3)
    for one, other in zip(
        run(soft, scheme, dt=5e-3, steps=200, state=displaced(soft)),
        run(stiff, scheme, dt=5e-3, steps=200),
        strict=True,
    ):
        assert one.new.active.all() and one.new.r_n[0] > 100.0
        np.testing.assert_allclose(one.new.u, other.new.u, rtol=1e-9)


def test_midpoint_rule_converges_to_the_spring_with_first_order():
    """Averages of the step meet the spring of its end, r = k u1: first order, and the spring loses
    ½ k du² a step."""
    errors = []
    for dt in (2e-3, 1e-3, 5e-4):
        soft, stiff = sprung(ringing(), 4e3), glued(ringing(), 2e3)
        steps = round(0.2 / dt)
        *_, one = run(soft, HALF, dt=dt, steps=steps, state=displaced(soft))
        *_, other = run(stiff, HALF, dt=dt, steps=steps)
        errors.append(np.abs(one.new.u - other.new.u).max())
        stored = 0.5 * 2e3 * (one.new.u[-1] ** 2 - one.old.u[-1] ** 2)
        du = one.new.u[-1] - one.old.u[-1]
        assert one.balance.r_n[0] * du == pytest.approx(stored + 0.5 * 2e3 * du**2, rel=1e-9)
    assert np.log2(errors[0] / errors[1]) == pytest.approx(1.0, abs=0.15)
    assert np.log2(errors[1] / errors[2]) == pytest.approx(1.0, abs=0.15)


def test_springs_open():
    """Unilateral: no tension; the body leaves and comes back; penetration = r/k while closed;
    energy with the springs' own never grows."""
    problem = sprung(shaken(gap=0.001, excitation=(), damping=0.0, v0=np.ones(6)), 4e4)
    reports = list(run(problem, HALF, dt=5e-3, steps=200))
    assert changes(reports) > 5
    last = np.inf
    for report in reports:
        compression = max(report.new.u[-1] - 0.001, 0.0)
        assert report.new.r_n[0] == pytest.approx(2e4 * compression, abs=1e-9 * 2e4 * 0.1)
        now = energy(problem, report.new) + 0.5 * 2e4 * compression**2
        assert now <= last * (1.0 + 1e-12)
        last = now


@pytest.mark.parametrize("scheme", SCHEMES, ids=lambda s: type(s).__name__)
def test_held_points_stay_and_pull(scheme):
    """The bilateral comparison case: u_n = gap0 with reactions of both signs."""
    problem = shaken(gap=0.0, impact=Inelastic())
    problem = replace(problem, surface=problem.surface.bilateral_everywhere())
    reactions = []
    for report in run(problem, scheme, dt=5e-3, steps=100):
        assert report.new.u[-1] == 0.0 and report.new.active.all()
        reactions.append(report.new.r_n[0])
    assert min(reactions) < -1.0 and max(reactions) > 1.0
