"""Independent solvers agree step by step; a wrong one is found."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from bar import run, thrown
from chain import chain_problem
from posed import matrix_of
from rubbing import rubbing_block
from shaken import SHAKE, shaken

from vi_contact.core.errors import InputError
from vi_contact.laws.friction import Coulomb, Tresca
from vi_contact.laws.impact import Inelastic
from vi_contact.run.cross_check import CrossChecked, cross_check
from vi_contact.run.time_steps import HalvedAtImpact, Schedule
from vi_contact.schemes.linear_multistep import LinearMultistep
from vi_contact.schemes.ss22 import SS22
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.friction.nsgs import NSGS
from vi_contact.solvers.normal.active_set import ActiveSet
from vi_contact.solvers.normal.hildreth import Hildreth

pytestmark = pytest.mark.serial
HALF = ZienkiewiczWoodTaylor()
METHODS = [Condensed(), Condensed(Hildreth()), Condensed(Hildreth(primal=False))]


def between_walls(**more: Any) -> Any:
    return chain_problem(
        5, gap=0.02, left_gap=0.01, stiffness=2e4, excitation=SHAKE, impact=Inelastic(), **more
    )


@pytest.mark.parametrize(
    "scheme", [HALF, SS22(0.6, 0.7), LinearMultistep.newmark()], ids=lambda s: type(s).__name__
)
@pytest.mark.parametrize("floating", [False, True])
def test_methods_agree_to_1e9(scheme, floating):
    """Active set, Hildreth primal and dual: u and r_n of every step to 1e-9."""
    checked = cross_check(
        between_walls(floating=floating), scheme=scheme, solvers=METHODS, dt=5e-3, steps=80
    )
    assert 0.0 < checked.worst <= 1e-9
    assert all(one.steps == 80 and one.size["r_n"] > 1.0 for one in checked.found)


def test_report_names_every_method():
    checked = cross_check(shaken(), scheme=HALF, solvers=METHODS, dt=5e-3, steps=60)
    assert list(checked.report()) == ["condensed Hildreth #1", "condensed Hildreth #2"]
    for entry in checked.report().values():
        assert (
            entry["u"] <= 1e-9
            and entry["r_n"] <= 1e-9
            and 0.0 < entry["iterations_per_step"] < 10.0
        )


def test_it_returns_the_primary_answer():
    plain = list(run(shaken(), HALF, dt=5e-3, steps=60))
    checked = list(
        run(
            shaken(),
            HALF,
            dt=5e-3,
            steps=60,
            solver=CrossChecked(Condensed(), [Condensed(Hildreth())]),
        )
    )
    np.testing.assert_array_equal(checked[-1].new.u, plain[-1].new.u)


@dataclass(frozen=True)
class Off:
    """Condensed, with answers that are wrong by fixed factors."""

    u: float
    r: float

    def check(self, problem: Any) -> None:
        """Takes everything."""

    def prepare(self, A: Any, surface: Any, scale: float) -> Any:
        prepared, off = Condensed().prepare(A, surface, scale), self

        class Prepared:
            def solve(self, step: Any) -> Any:
                result = prepared.solve(step)
                x = result.x + (off.u - 1.0) * (step.origin + result.x)
                return replace(result, x=x, r_n=result.r_n * off.r, method="off", iterations=2)

        return Prepared()


def test_differences_are_measured_at_their_size():
    checked = cross_check(
        shaken(), scheme=HALF, solvers=[Condensed(), Off(1.001, 1.25)], dt=5e-3, steps=60
    )
    entry = checked.report()["off"]
    assert entry["u"] == pytest.approx(1e-3, rel=1e-9) and entry["r_n"] == pytest.approx(
        0.25, rel=1e-9
    )
    assert entry["iterations_per_step"] == 2.0
    assert checked.worst == entry["r_n"]


@dataclass(frozen=True)
class WrongWhenClosing(Off):
    """Off in the steps that close a point, but right in the shortest ones."""

    shortest: Any

    def prepare(self, A: Any, surface: Any, scale: float) -> Any:
        wrong, right, off = (
            Off.prepare(self, A, surface, scale),
            Condensed().prepare(A, surface, scale),
            self,
        )

        class Prepared:
            def solve(self, step: Any) -> Any:
                result = right.solve(step)
                ones = np.ones_like(step.b)
                final = np.array_equal(A @ ones, off.shortest @ ones)
                return (
                    result
                    if final or not np.any(result.active & ~step.active)
                    else wrong.solve(step)
                )

        return Prepared()


def test_attempts_that_were_thrown_away_do_not_count():
    """HalvedAtImpact: every step that closes a point is halved, down to the last halving. Another
    solver that is wrong in nothing but the attempts agrees, and as many steps are compared as were
    accepted."""
    problem, base, plan = shaken(), 5e-3, HalvedAtImpact(5e-3, halvings=3)
    accepted = list(run(problem, HALF, dt=plan, steps=200))
    assert len(accepted) > 200 + 3 * 3
    attempts = WrongWhenClosing(1.0, 2.0, matrix_of(HALF, problem, base / 8))
    checked = cross_check(problem, scheme=HALF, solvers=[Condensed(), attempts], dt=plan, steps=200)
    assert checked.worst <= 1e-9 and checked.found[0].steps == len(accepted)
    whole = cross_check(problem, scheme=HALF, solvers=[Condensed(), attempts], dt=base, steps=200)
    assert whole.worst > 0.1 and whole.found[0].steps == 200


def test_schedules_of_steps():
    """The pieces of a Schedule, with halves in them; two runs with one CrossChecked add up."""
    plan = HalvedAtImpact(Schedule(((5e-3, 0.1), (2e-3, np.inf))), halvings=2)
    for dt in (plan, plan.dt):
        accepted = len(list(run(shaken(), HALF, dt=dt, steps=120)))
        checked = cross_check(shaken(), scheme=HALF, solvers=METHODS[:3], dt=dt, steps=120)
        assert (
            0.0 < checked.worst <= 1e-9 and [one.steps for one in checked.found] == [accepted] * 2
        )
    for _ in run(shaken(), HALF, dt=plan.dt, steps=120, solver=checked):
        pass
    assert checked.found[0].steps == 2 * accepted


def test_no_contact_and_no_steps():
    flying = cross_check(thrown(10), scheme=HALF, solvers=METHODS[:2], dt=0.01, steps=5)
    assert flying.worst == 0.0 and flying.found[0].size["r_n"] == 0.0
    assert cross_check(thrown(10), scheme=HALF, solvers=METHODS[:2], dt=0.01, steps=0).worst == 0.0


def test_every_solver_must_take_the_problem():
    problem = replace(shaken(), friction=Tresca(1.0))
    with pytest.raises(InputError, match="Tresca"):
        cross_check(
            problem, scheme=HALF, solvers=[Off(1.0, 1.0), Condensed(ActiveSet())], dt=5e-3, steps=1
        )


class HalfTheFriction(Off):
    """Condensed, with r_t that is wrong by a factor, or missing for the factor zero."""

    def prepare(self, A: Any, surface: Any, scale: float) -> Any:
        prepared, off = Condensed().prepare(A, surface, scale), self

        class Prepared:
            def solve(self, step: Any) -> Any:
                result = prepared.solve(step)
                return replace(
                    result, r_t=result.r_t * off.r if off.r else None, method=f"times {off.r}"
                )

        return Prepared()


@pytest.mark.long
def test_friction_is_compared():
    """r_t counts where there is friction, at its own size, and is in the report; missing is wrong
    by as much as all."""
    solvers = [
        Condensed(),
        HalfTheFriction(1.0, 0.5),
        HalfTheFriction(1.0, 0.0),
        Condensed(friction_method=NSGS()),
    ]
    checked = cross_check(
        rubbing_block(Coulomb(0.3)), scheme=HALF, solvers=solvers, dt=0.05, steps=60
    )
    half, missing, same = checked.report().values()
    assert half["r_t"] == pytest.approx(0.5, rel=1e-12) and half["u"] == half["r_n"] == 0.0
    assert missing["r_t"] == checked.worst == pytest.approx(1.0, rel=1e-12)
    assert 0.0 < same["r_t"] <= 1e-9
    without = cross_check(shaken(), scheme=HALF, solvers=METHODS[:2], dt=5e-3, steps=60)
    assert "r_t" not in without.report()["condensed Hildreth"]
