"""Changing dt in a run: plans, energy across changes, halving at impact (files:
test_time_steps_in_folders)."""

from __future__ import annotations

import sys
import weakref
from dataclasses import replace
from itertools import pairwise
from math import inf
from typing import Any

import numpy as np
import pytest
from bar import bar, run, thrown
from chain import chain_problem
from marched_chain import difference
from marched_chain import run as run_chain
from shaken import changes, shaken

from vi_contact.core.errors import InputError, StepFailure
from vi_contact.core.problem import ContactProblem
from vi_contact.core.stage import make_matrix
from vi_contact.core.step import Report
from vi_contact.laws.impact import ImpulseUpdate, Inelastic
from vi_contact.laws.mass import ConsistentMass, Redistributed
from vi_contact.run.recorders import Energy
from vi_contact.run.time_steps import HalvedAtImpact, Schedule, StepPlan, plan_steps
from vi_contact.schemes.linear_multistep import LinearMultistep
from vi_contact.schemes.ss22 import SS22
from vi_contact.schemes.trapezoidal import Trapezoidal
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor

serial = pytest.mark.serial
HALF, NEWMARK, DISSIPATIVE = (
    ZienkiewiczWoodTaylor(),
    LinearMultistep.newmark(),
    LinearMultistep.newmark(0.3025, 0.6),
)
SCHEMES = [HALF, SS22(), NEWMARK]
THREE = Schedule(((4e-3, 0.2), (1e-3, 0.3), (2.5e-3, inf)))
LONG = Schedule(((4e-3, 0.4), (1e-3, 0.6), (2.5e-3, inf)))  # contacts open and close in every piece


# plans


@serial
@pytest.mark.parametrize(
    ("dt", "steps", "t_end", "t0", "expected"),
    [
        (0.1, 7, None, 0.0, 7),
        (0.1, 0, None, 0.0, 0),
        (0.1, None, 0.3, 0.0, 3),  # not 4: 0.3/0.1 is a little more than 3
        (0.1, None, 0.31, 0.0, 4),
        (0.1, None, 1.0, 0.4, 6),
        (0.1, None, 0.0, 0.0, 0),
        (0.1, None, -0.5, -1.0, 5),
    ],
)
def test_steps_of_a_constant_dt(dt, steps, t_end, t0, expected):
    assert plan_steps(dt, steps, t_end, t0) == StepPlan(((dt, expected),))
    assert plan_steps(HalvedAtImpact(dt, 4), steps, t_end, t0) == StepPlan(((dt, expected),), 4)
    assert plan_steps(Schedule(((dt, inf),)), steps, t_end, t0) == StepPlan(((dt, expected),))


@serial
@pytest.mark.parametrize(
    ("steps", "t_end", "t0", "parts"),
    [
        (None, 0.4, 0.0, ((4e-3, 50), (1e-3, 100), (2.5e-3, 40))),
        (None, 0.25, 0.0, ((4e-3, 50), (1e-3, 50))),
        (120, None, 0.0, ((4e-3, 50), (1e-3, 70))),
        (160, None, 0.0, ((4e-3, 50), (1e-3, 100), (2.5e-3, 10))),
        (None, 0.3, 0.0, ((4e-3, 50), (1e-3, 100))),
        (110, None, 0.2, ((4e-3, 0), (1e-3, 100), (2.5e-3, 10))),
        # on from 0.2039: 97 steps reach 0.3
        (None, 0.4, 0.1999, ((4e-3, 1), (1e-3, 97), (2.5e-3, 40))),
        # round-off adds no step to any piece
        (None, 0.4, 0.2 - 1e-12, ((4e-3, 0), (1e-3, 100), (2.5e-3, 40))),
    ],
)
def test_steps_of_a_schedule(steps, t_end, t0, parts):
    """A piece ends with the first step that reaches its time."""
    found = plan_steps(THREE, steps, t_end, t0)
    assert found.parts == parts and found.steps == sum(count for _, count in parts)
    sizes = [dt for dt, count in parts for _ in range(count)]
    assert [found.dt(base) for base in range(found.steps)] == sizes and found.dt(
        found.steps + 5
    ) == sizes[-1]


@serial
@pytest.mark.parametrize("t0", [0.0, 0.3, 17.0])
def test_round_off_of_many_pieces_adds_no_step(t0):
    """1200 steps of a hundred lengths, each piece a dozen of them, end at the last one's time,
    wherever they begin."""
    sizes = [1e-3 * (1.0 + 0.01 * i) for i in range(100)]
    ends = [t0 + 12.0 * sum(sizes[: i + 1]) for i in range(100)]
    plan = Schedule(tuple(zip(sizes, ends, strict=True)))
    assert plan_steps(plan, None, ends[-1], t0) == StepPlan(tuple((size, 12) for size in sizes))
    assert plan_steps(plan, None, ends[-1] + 1e-10, t0 - 1e-10).steps == 1200
    thirds = Schedule(tuple((1.0 / 300.0, t0 + (i + 1) / 25.0) for i in range(100)))
    assert plan_steps(thirds, None, t0 + 4.0, t0).steps == 1200


@serial
@pytest.mark.parametrize(
    ("dt", "steps", "t_end", "word"),
    [
        (0.0, 5, None, "dt is 0.0"),
        (-1.0, 5, None, "positive time step"),
        (np.nan, 5, None, "positive time step"),
        (np.inf, 5, None, "positive time step"),
        ("0.1", 5, None, "positive time step in seconds, a Schedule, HalvedAtImpact"),
        (0.1, 5, 0.5, "not both"),
        (0.1, None, None, "either steps or t_end"),
        (0.1, -1, None, "steps is -1"),
        (0.1, None, -0.5, "t_end after the start"),
        (0.1, None, np.nan, "finite t_end"),
        (0.1, None, np.inf, "finite t_end"),
        (
            1e-90,
            None,
            1e300,
            r"the run to t_end = 1e\+300 s has more than 1e\+09 steps of dt = 1e-90 s: give",
        ),
        (1e-320, 2, None, r"dt is 9.99989e-321 s: give a time step between 1e-100 and 1e\+100 s"),
        (1e200, 2, None, r"dt is 1e\+200 s: give a time step between 1e-100 and 1e\+100 s"),
        (1e-30, None, 1.0, r"the run to t_end = 1 s has more than 1e\+09 steps of dt = 1e-30 s"),
        (0.1, 10**10, None, r"the run has more than 1e\+09 steps of dt = 0.1 s"),
        (
            Schedule(((1e-30, 0.5), (0.1, inf))),
            None,
            1.0,
            r"more than 1e\+09 steps of dt = 1e-30 s",
        ),
        (0.1, None, "1", "t_end = '1' s: give a finite"),
        (0.1, True, None, "steps is True: give a whole number"),
        (True, 5, None, "dt is True: give a positive time step"),
        (10**400, 5, None, "dt is 1000.*: give a positive time step"),
        (0.1, 2.5, None, "whole number of steps"),
        (
            Schedule(((0.1, 1.0), (0.2, 2.0))),
            None,
            2.5,
            "last piece of the Schedule ends at 2 s, before t_end = 2.5 s",
        ),
        (
            Schedule(((0.1, 1.0), (0.2, 2.0))),
            17,
            None,
            "ends at 2 s, before the 2 steps that are left",
        ),
        (
            HalvedAtImpact(Schedule(((0.1, 1.0),))),
            11,
            None,
            "ends at 1 s, before the 1 steps that are left: end it",
        ),
    ],
)
def test_nonsense_is_named(dt, steps, t_end, word):
    with pytest.raises(InputError, match=word):
        plan_steps(dt, steps, t_end)
    with pytest.raises(InputError, match=word):
        run_chain(None, steps, t_end=t_end, dt=dt)


@serial
@pytest.mark.parametrize(
    ("make", "word"),
    [
        (lambda: Schedule(()), "Schedule has no pieces: give at least one"),
        (lambda: Schedule(((0.1, 1.0), (0.0, 2.0))), "dt is 0.0: give a positive time step"),
        (
            lambda: Schedule(((0.1, 1.0), (0.2, 1.0))),
            "until 1 s does not end after 1 s: give increasing times",
        ),
        (lambda: Schedule(((0.1, inf), (0.2, inf))), "until inf s does not end after inf s"),
        (lambda: Schedule(((0.1, np.nan),)), "until nan s does not end"),
        (lambda: Schedule((0.1, 0.2)), r"Schedule pieces are \(0.1, 0.2\): give pairs"),
        (lambda: Schedule(((0.1, "late"),)), "give pairs"),
        (lambda: Schedule(0.1), "give pairs"),
        (lambda: HalvedAtImpact(-0.1), "dt is -0.1: give a positive"),
        (lambda: HalvedAtImpact(0.1, -1), "halvings is -1: give a whole number from 0 to 20"),
        (lambda: HalvedAtImpact(0.1, 21), "halvings is 21: give a whole number from 0 to 20"),
        (lambda: HalvedAtImpact(0.1, 2.5), "halvings is 2.5: give a whole number"),
        (lambda: HalvedAtImpact(HalvedAtImpact(0.1)), "positive time step in seconds, a Schedule"),
    ],
)
def test_nonsense_plans_are_refused(make, word):
    with pytest.raises(InputError, match=word):
        make()


@serial
def test_plans_say_the_same_whatever_numbers_they_are_given():
    """repr is what a checkpoint compares."""
    plain = HalvedAtImpact(Schedule(((1e-3, 1.0), (1.0, inf))), 2)
    other = HalvedAtImpact(
        Schedule([[np.float64(1e-3), 1], (1, np.inf)]),  # type: ignore[arg-type]
        np.int64(2),
    )
    assert plain == other and repr(plain) == repr(other)
    assert (
        repr(plain) == "HalvedAtImpact(dt=Schedule(pieces=((0.001, 1.0), (1.0, inf))), halvings=2)"
    )


# schedules


@serial
@pytest.mark.parametrize("scheme", [*SCHEMES, DISSIPATIVE], ids=repr)
def test_a_schedule_is_runs_one_after_the_other(scheme):
    """To the last bit: each piece goes on from the state that the one before has left."""
    problem = shaken(Inelastic())
    whole = list(run(problem, scheme, dt=LONG, steps=480))
    state, parts = None, []
    for dt, steps in ((4e-3, 100), (1e-3, 200), (2.5e-3, 180)):
        parts += list(run(problem, scheme, dt=dt, steps=steps, state=state))
        state = parts[-1].new
    assert min(changes(whole[:100]), changes(whole[100:300]), changes(whole[300:])) >= 1
    for one, other in zip(whole, parts, strict=True):
        assert difference(one.new, other.new) == 0.0
    assert whole[-1].new.k == 480 and whole[-1].new.t == pytest.approx(1.05, rel=1e-12)


def with_mass_of(scheme: Any) -> ContactProblem:
    """A thrown bar for the trapezoidal rule, whose contact nodes have no mass; the chain, an impact
    law for others."""
    if isinstance(scheme, Trapezoidal):
        return thrown(30, mass=Redistributed())
    return replace(shaken(Inelastic()), mass=ConsistentMass())


@pytest.mark.slow
@serial
@pytest.mark.parametrize("plan", [LONG, HalvedAtImpact(LONG, 3), HalvedAtImpact(5e-3, 4)], ids=repr)
@pytest.mark.parametrize("scheme", [*SCHEMES, Trapezoidal()], ids=repr)
def test_ledger_closes_across_changes(scheme, plan):
    """V9.7: a change of dt changes neither u nor v, and no energy appears or is lost between two
    steps."""
    problem = with_mass_of(scheme)
    # the thrown bar has to leave its wall
    steps = 600 if isinstance(scheme, Trapezoidal) else 360
    reports = list(run(problem, scheme, dt=plan, steps=steps))
    sizes = [report.new.t - report.old.t for report in reports]
    assert sum(abs(b / a - 1.0) > 0.1 for a, b in pairwise(sizes)) >= 2 and changes(reports) >= 2
    for one, two in pairwise(reports):
        assert np.array_equal(two.old.u, one.new.u) and np.array_equal(two.old.v, one.new.v)
        assert two.old.t == one.new.t and two.new.k == two.old.k + 1
    ledger = Energy()
    rows = [ledger.start(problem, reports[0].old), *map(ledger.row, reports)]
    size = max(row["energy_kinetic"] + row["energy_strain"] for row in rows)
    assert max(abs(row["energy_defect"]) for row in rows) < 1e-10 * size
    assert max(report.certificate.worst for report in reports) < 1e-9


def linear_error(scheme: Any, dt: float) -> float:
    """max |u - exact| / max |u| at t = 1 s of a free vibration, dt changed to dt/2 at 0.3 s and to
    2 dt at 0.6 s."""
    problem = chain_problem(
        4, gap=1e3, stiffness=50.0, u0=[0.1, -0.2, 0.3, 0.1], v0=[1.0, 0.0, -1.0, 0.5]
    )
    plan = Schedule(((dt, 0.3), (0.5 * dt, 0.6), (2.0 * dt, inf)))
    *_, last = run(problem, scheme, dt=plan, t_end=1.0, steps=None)
    system = problem.equations
    M, K = system.M.csr.toarray(), system.K.csr.toarray()
    squares, modes = np.linalg.eigh(K / M[0, 0])  # lumped: M is a multiple of the unit matrix
    w = np.sqrt(squares)
    t, u0, v0 = last.new.t, modes.T @ system.u0, modes.T @ system.v0
    exact = modes @ (np.cos(w * t) * u0 + np.sin(w * t) / w * v0)
    assert t == pytest.approx(1.0, rel=1e-12)
    return float(np.max(np.abs(last.new.u - exact)) / np.max(np.abs(exact)))


@serial
@pytest.mark.parametrize(
    ("scheme", "order"),
    [
        (HALF, 2),
        (SS22(), 2),
        (NEWMARK, 2),
        (Trapezoidal(), 2),
        (ZienkiewiczWoodTaylor(1.0), 1),
        (DISSIPATIVE, 1),
    ],
    ids=repr,
)
def test_order_with_a_change_in_mid_run(scheme, order):
    """Against the modes in closed form: the order of the scheme, as without changes (V8.5 without a
    mesh)."""
    coarse, fine = (linear_error(scheme, dt) for dt in (5e-3, 2.5e-3))
    assert np.log2(coarse / fine) == pytest.approx(order, abs=0.1)


# one matrix for every dt


class Counted:
    """Remembers the dt of every effective matrix of a march, and the matrices as long as somebody
    else keeps them."""

    def __init__(self, monkeypatch):
        self.made: list[tuple[float, Any]] = []
        loop = sys.modules["vi_contact.run.stepper"]
        monkeypatch.setattr(loop, "make_matrix", self._make)

    def _make(self, system, stage):
        A = make_matrix(system, stage)
        dt = float(f"{1.0 / stage.rate_factor:.12g}")
        self.made.append((dt, weakref.ref(A)))
        return A

    @property
    def sizes(self) -> list[float]:
        return [dt for dt, _ in self.made]

    @property
    def alive(self) -> set[float]:
        return {dt for dt, A in self.made if A() is not None}


@serial
def test_one_matrix_for_every_dt_of_a_halved_run(monkeypatch):
    """Flipping between few dts factorises each of them once; what is never needed is never made."""
    counted, problem = Counted(monkeypatch), shaken(Inelastic())
    reports = list(run(problem, HALF, dt=HalvedAtImpact(5e-3, 3), steps=300))
    assert changes(reports) >= 8
    assert counted.sizes == [5e-3, 2.5e-3, 1.25e-3, 0.625e-3]
    calm = Counted(monkeypatch)
    list(run(replace(problem, excitation=()), HALF, dt=HalvedAtImpact(5e-3, 3), steps=20))
    assert calm.sizes == [5e-3]


@serial
def test_factors_of_pieces_that_are_over_are_freed(monkeypatch):
    """A plan of ten pieces keeps one matrix (and that of the last report), with halves those of the
    piece."""
    sizes = [round(1e-3 * (1.0 + 0.1 * i), 9) for i in range(10)]
    times = np.cumsum([5.0 * dt for dt in sizes])
    plan = Schedule(tuple(zip(sizes, times, strict=True)))
    counted = Counted(monkeypatch)
    for i, _ in enumerate(run(shaken(), HALF, dt=plan, steps=50)):
        assert counted.alive == {sizes[i // 5]} and counted.sizes == sizes[: i // 5 + 1]
    halved, dyadic = Counted(monkeypatch), Schedule(((4e-3, 0.4), (2e-3, inf)))
    alive = [
        set(halved.alive) for _ in run(shaken(), HALF, dt=HalvedAtImpact(dyadic, 2), steps=200)
    ]
    assert alive[-1] == {2e-3, 1e-3, 0.5e-3} and {4e-3, 2e-3, 1e-3} in alive
    assert halved.sizes == [4e-3, 2e-3, 1e-3, 0.5e-3]  # shared by both pieces


# halving at impact


def closes(report: Report) -> bool:
    return bool(np.any(report.new.active & ~report.old.active))


@serial
@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_every_closure_happens_in_a_shortest_step(scheme):
    """Base steps end where they did; only steps of dt/8 close a contact; their times fit
    together."""
    dt, halvings = 4e-3, 3
    reports = list(run(shaken(Inelastic()), scheme, dt=HalvedAtImpact(dt, halvings), steps=500))
    sizes = np.array([report.new.t - report.old.t for report in reports])
    levels = np.rint(np.log2(dt / sizes))
    assert np.allclose(sizes, dt / 2.0**levels, rtol=1e-9) and set(levels) == {0, 1, 2, 3}
    closing = [closes(report) for report in reports]
    assert sum(closing) >= 4 and set(levels[closing]) == {halvings}
    assert [report.new.k for report in reports] == list(range(1, len(reports) + 1))
    base = np.cumsum(2.0**-levels)
    # every base step ends; nothing is skipped
    assert base[-1] == 500 and set(np.arange(1, 501)) <= set(base)
    assert all(report.certificate.worst <= 1e-9 for report in reports)


@serial
@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_rejected_attempts_leave_no_trace(scheme):
    """Given the accepted sizes as a constant dt each, the run is the same to the last bit."""
    problem = shaken(Inelastic(ImpulseUpdate()))
    reports = list(run(problem, scheme, dt=HalvedAtImpact(5e-3, 2), steps=60))
    first = next(i for i, report in enumerate(reports) if report.new.t - report.old.t < 4e-3)
    state = reports[first - 1].new
    for report in reports[first : first + 6]:
        dt = 5e-3 / 2 ** round(np.log2(5e-3 / (report.new.t - report.old.t)))
        (again,) = run(problem, scheme, dt=dt, steps=1, state=state)
        assert difference(again.new, report.new) == 0.0
        state = again.new


@serial
@pytest.mark.parametrize("scheme", SCHEMES, ids=repr)
def test_no_halvings_is_the_constant_dt(scheme):
    plain = list(run(shaken(Inelastic()), scheme, dt=5e-3, steps=100))
    for plan in (
        HalvedAtImpact(5e-3, 0),
        Schedule(((5e-3, inf),)),
        Schedule(((5e-3, 0.2), (5e-3, inf))),
    ):
        for one, other in zip(
            plain, run(shaken(Inelastic()), scheme, dt=plan, steps=100), strict=True
        ):
            assert difference(one.new, other.new) == 0.0


@serial
def test_resting_and_held_contacts_are_not_halved():
    """Only points that were open close: a bilateral point never does, one that rests on its wall
    does not again."""
    problem = shaken(gap=0.0, excitation=(), constant=3.0)
    resting = replace(next(run(problem, HALF, dt=1e-3, steps=1)).new, active=np.ones(1, dtype=bool))
    assert len(list(run(problem, HALF, dt=HalvedAtImpact(1e-3), steps=20, state=resting))) == 20
    held = replace(shaken(gap=0.0), surface=shaken(gap=0.0).surface.bilateral_everywhere())
    assert len(list(run(held, HALF, dt=HalvedAtImpact(5e-3), steps=50))) == 50


@serial
@pytest.mark.parametrize(("halvings", "dt"), [(0, 0.0125), (2, 0.0125), (4, 0.0125), (2, 0.006)])
def test_time_of_the_first_contact_of_the_thrown_bar(halvings, dt):
    """V1.1: at t = 1/2 exactly, found to dt/2**halvings; the steps before it are those without
    halving."""
    dt *= 1.01  # 1/2 is not at the end of a step
    for report in run(thrown(20), HALF, dt=HalvedAtImpact(dt, halvings), steps=120):
        if report.new.active.any():
            break
    assert 0.5 <= report.new.t <= 0.5 + dt / 2**halvings
    assert report.old.t <= 0.5


@serial
def test_contact_work_of_the_thrown_bar_falls_with_halving():
    """V9.1: the first closure loses its reaction times the gap before it, which halving makes
    smaller."""
    # the bar arrives at 0.9 of a step, 0.15 of a quarter, 0.025 after the last sixteenth
    lost, dt = ([], 0.5 / 44.9)
    for halvings in (0, 2, 4):
        reports = run(thrown(100), HALF, dt=HalvedAtImpact(dt, halvings), steps=100)
        report = next(report for report in reports if report.new.active.any())
        gap = 5.0 + report.old.u[0] * -1.0  # u_n = -u of the foot
        work = float(report.balance.r_n @ (report.new.u[:1] - report.old.u[:1]))
        assert work == pytest.approx(report.new.r_n[0] * gap, rel=1e-12) and work > 0.0
        lost.append(gap)
    np.testing.assert_allclose(lost, 10.0 * dt * np.array([0.9, 0.15, 0.025]), rtol=1e-6)


@pytest.mark.long
@serial
def test_means_over_arrival_times_of_the_thrown_bar():
    """The table in docs/guide/schemes.md: delay [dt] and work lost [J] of the first closure,
    halvings 0, 1, 2, 3."""
    delay, lost = np.zeros(4), np.zeros(4)
    for halvings in range(4):
        for i in range(16):
            dt = 0.5 / (44.0 + (i + 1.0 / np.pi) / 16.0)
            t = 0.5 - 40.0 * dt  # forty steps of the fall, in which nothing happens, are left out
            problem = bar(100, gap=10.0 * t, v0=lambda x: np.full_like(x, -10.0))
            reports = run(problem, HALF, dt=HalvedAtImpact(dt, halvings), steps=60)
            first = next(report for report in reports if report.new.active.any())
            delay[halvings] += (first.new.t - t) / dt / 16.0
            lost[halvings] += float(first.balance.r_n @ (first.new.u - first.old.u)[:1]) / 16.0
    np.testing.assert_allclose(delay, [0.511, 0.261, 0.136, 0.0739], rtol=5e-3)
    np.testing.assert_allclose(lost, [5.71, 2.98, 1.74, 1.28], rtol=5e-3)


@serial
def test_a_step_that_fails_in_a_half_says_where():
    """A load that turns into NaN within a halved step."""
    problem = shaken(Inelastic())
    reports = list(run(problem, HALF, dt=HalvedAtImpact(5e-3), steps=60))
    bad = next(report for report in reports if closes(report))
    broken = problem.system.with_load((np.ones(6), lambda t: np.nan if t > bad.old.t else 0.0))
    with pytest.raises(StepFailure, match="contains NaN"):
        list(run(replace(problem, system=broken), HALF, dt=HalvedAtImpact(5e-3), steps=60))
