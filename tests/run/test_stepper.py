"""A stepper for those who own the loop, and steps that are chosen by their error."""

from __future__ import annotations

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from marched_chain import difference
from shaken import shaken

import vi_contact as vc
from vi_contact.core.errors import InputError, StepFailure
from vi_contact.core.step import Report

DT = 5e-3
HALF = vc.ZienkiewiczWoodTaylor()


def stepped(stepper: vc.Stepper, sizes: list[float]) -> vc.State:
    """The state after steps of these sizes, each accepted."""
    for dt in sizes:
        stepper.accept(stepper.attempt(dt))
    return stepper.state


@pytest.mark.serial
@pytest.mark.parametrize("scheme", [HALF, vc.Trapezoidal(), vc.HHT(), vc.Houbolt()], ids=repr)
def test_a_stepper_makes_the_steps_of_a_march(scheme: Any) -> None:
    """To the last bit, also with rejected trials of other sizes in between."""
    problem = shaken()
    stepper = vc.Stepper(problem, scheme=scheme, solver=vc.Condensed())
    straight = vc.march(problem, scheme=scheme, solver=vc.Condensed(), dt=DT, steps=60)
    for state, _ in straight:
        stepper.attempt(0.3 * DT)
        trial = stepper.attempt(DT)
        stepper.attempt(2.0 * DT)
        assert difference(stepper.accept(trial), state) == 0.0


@pytest.mark.serial
def test_a_first_trial_is_accepted_whose_massless_nodes_were_out_of_equilibrium() -> None:
    """The trapezoidal rule brings them there before its first step: u is not the one that the
    stepper stands at."""
    K = [[200.0, -100.0], [-100.0, 200.0]]
    system = vc.system_from_arrays(
        [0.0, 1.0], None, K, coordinates=[[0.0], [1.0]], load=[3.0, 0.0], v0=[0.0, 1.0]
    )
    foot = vc.contact_points(system, [0], [1.0], gap0=[0.02])
    problem = vc.ContactProblem(system, foot, mass=vc.ConsistentMass())
    choice: dict[str, Any] = {"scheme": vc.Trapezoidal(), "solver": vc.Condensed()}
    stepper = vc.Stepper(problem, **choice)
    for state, _ in vc.march(problem, **choice, dt=DT, steps=20):
        assert difference(stepper.accept(stepper.attempt(DT)), state) == 0.0
    assert state.active.any()


@pytest.mark.serial
def test_factors_are_kept_by_the_size_of_the_step() -> None:
    stepper = vc.Stepper(shaken(), scheme=HALF, solver=vc.Condensed())
    stepped(stepper, [DT, 0.5 * DT, DT, 0.5 * DT])
    assert set(stepper.prepared) == {DT, 0.5 * DT}
    kept = stepper.prepared[DT]
    stepped(stepper, [DT])
    assert stepper.prepared[DT] is kept
    stepped(stepper, [DT * (1.0 + 0.01 * k) for k in range(1, 31)])
    assert len(stepper.prepared) <= 12


@pytest.mark.serial
def test_a_trial_of_another_state_is_refused() -> None:
    stepper = vc.Stepper(shaken(), scheme=HALF)
    late = stepper.attempt(DT)
    stepper.accept(stepper.attempt(DT))
    with pytest.raises(InputError, match=r"starts at t = 0 s, step 0, and the stepper stands at"):
        stepper.accept(late)
    with pytest.raises(InputError, match=r"Stepper\.attempt: dt is -1"):
        stepper.attempt(-1.0)
    with pytest.raises(InputError, match="give what attempt has returned"):
        stepper.accept(late.report)  # type: ignore[arg-type]


def spring(frequency: float) -> vc.ContactProblem:
    """A mass on a spring that nothing stops."""
    system = vc.system_from_arrays(
        [1.0], None, [[(2.0 * np.pi * frequency) ** 2]], coordinates=[[0.0]], u0=np.array([1.0])
    )
    return vc.ContactProblem(system, vc.contact_points(system, [0], [-1.0], gap0=1e3))


def lengths(reports: list[Report]) -> np.ndarray:
    return np.array([report.new.t - report.old.t for report in reports])


@pytest.mark.serial
@pytest.mark.parametrize("relative", [1e-3, 1e-5])
def test_the_error_of_a_spring_is_held(relative: float) -> None:
    """cos(2 pi t): with steps that are far too long the plan takes halves of one size. The error of
    an accepted pair of halves of a scheme of order 2 is a third of the difference that is judged;
    so the sum over a period stays below the bound times the number of pairs."""
    plan = vc.ErrorControlled(0.25, relative=relative, halvings=10)
    reports = [r for _, r in vc.march(spring(1.0), scheme=HALF, dt=plan, t_end=1.0)]
    sizes = lengths(reports)
    end = reports[-1].problem.cartesian(reports[-1].new.u)
    assert abs(end[0] - 1.0) <= relative * len(sizes)
    assert abs(sizes.sum() - 1.0) < 1e-12 and sizes.min() > 0.25 / 2**10
    assert all(after.old.t == before.new.t for before, after in pairwise(reports))


@pytest.mark.long
@pytest.mark.serial
def test_steps_do_not_chatter_around_an_impact() -> None:
    """Only parts around impacts are as short as allowed, and every base step begins anew."""
    problem = shaken(vc.Inelastic())
    plan = vc.ErrorControlled(4e-3, relative=1e-4, halvings=5)
    reports = [r for _, r in vc.march(problem, scheme=HALF, dt=plan, steps=200)]
    levels = np.log2(4e-3 / lengths(reports)).round().astype(int)
    closing = [bool(np.any(r.new.active & ~r.old.active)) for r in reports]
    assert sum(closing) >= 2 and levels.max() <= 5
    shortest = levels == 5
    assert 0 < shortest.sum() < 0.05 * len(levels)
    assert all(report.certificate.worst <= 1e-9 for report in reports)
    # the end of a base step is where the plan says
    ends = np.cumsum(2.0**-levels)
    assert set(np.arange(1, 201)) <= set(ends)


class Stubborn(vc.Condensed):
    """A solver that cannot do steps longer than a millisecond."""

    def prepare(self, A: Any, surface: Any, scale: float) -> Any:
        prepared = super().prepare(A, surface, scale)
        stiff = A.largest

        class Prepared:
            def solve(self, step: Any) -> Any:
                if step.rate_factor < 900.0:
                    raise StepFailure(f"too long for me ({stiff:g})")
                return prepared.solve(step)

        return Prepared()


@pytest.mark.serial
@pytest.mark.parametrize(
    "plan", [vc.HalvedAtImpact(4e-3, 3), vc.ErrorControlled(4e-3, halvings=3)], ids=repr
)
def test_a_step_that_cannot_be_done_is_halved(plan: Any) -> None:
    found = [r for _, r in vc.march(shaken(), scheme=HALF, solver=Stubborn(), dt=plan, steps=3)]
    assert lengths(found).max() <= 1e-3 * (1.0 + 1e-9) and abs(found[-1].new.t - 12e-3) < 1e-12
    with pytest.raises(StepFailure, match="too long for me"):
        list(vc.march(shaken(), scheme=HALF, solver=Stubborn(), dt=4e-3, steps=3))


def test_an_error_that_is_none_is_refused() -> None:
    for given, word in (({"relative": 0.0}, "relative"), ({"halvings": 0}, "halvings")):
        with pytest.raises(InputError, match=f"ErrorControlled {word} is 0"):
            vc.ErrorControlled(1e-2, **given)
