"""One loop for all roads: when passes end, how many factors they take, and whose equations the
certificate of an answer is of."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest
from chain import chain_problem
from rubbing import rubbing_block

import vi_contact as vc
from demos.parts.problems.nonlinear import make_chain
from vi_contact import solvers
from vi_contact.core.algebra import EffectiveMatrix, SerialAlgebra
from vi_contact.core.errors import StepFailure
from vi_contact.core.step import Report, StepProblem, StepResult
from vi_contact.core.surfaces import ContactSurface
from vi_contact.core.verify import kkt_residual
from vi_contact.run.static import Equilibria, static_equilibrium
from vi_contact.solvers.passes import Passes, certify

pytestmark = pytest.mark.serial
DECAY = vc.SlipRateCoulomb(vc.ExponentialDecay(mu_s=0.6, mu_k=0.3, v_c=0.1))
FACTORS = {
    "linear": (lambda: chain_problem(5, gap=0.01, constant=40.0), 1),
    "rates": (lambda: rubbing_block(DECAY), 1),
}


@dataclass(frozen=True)
class There:
    """A pass with this residual."""

    worst: float


def walk(residuals: list[float], **rules: Any) -> tuple[bool, Passes[There]]:
    """Whether passes with these residuals are certified, and what they have shown."""
    passes: Passes[There] = Passes(**{"tolerance": 1e-9, "goal": 1e-11, **rules})
    return certify(passes, iter(map(There, residuals)), 5), passes


@pytest.mark.parametrize(
    ("residuals", "count", "is_certified"),
    [
        ([1e-12, 0.0], 1, True),  # below the goal: at once
        ([1e-3, 1e-10, 9e-11, 0.0], 3, True),  # below the tolerance, and no more digits
        ([1e-3, 1e-10, 1e-11, 0.0], 3, True),
        ([1e-10, 3e-11, 2e-11, 0.0], 3, True),
        ([1.0, 2.0, 3.0, 1e-12, 0.0], 4, True),  # above the tolerance passes go on
        ([1.0, 1.0, 1.0, 1.0, 1.0, 0.0], 5, False),  # too many
        ([1.0, np.inf], 2, False),  # there is no other
        ([], 0, False),
    ],
)
def test_when_passes_end(residuals: list[float], count: int, is_certified: bool) -> None:
    found, passes = walk(residuals)
    assert found == is_certified and passes.count == count
    assert passes.least == min(residuals[:count], default=np.inf)
    assert passes.best is None or passes.best.worst == passes.least


def test_patience_and_a_given_place() -> None:
    """Two passes in vain where that is asked for; what is given counts for none."""
    assert walk([1e-10, 1e-10, 1e-10, 0.0], patience=2)[1].count == 3
    found, passes = walk([1.0], best=There(1e-12))
    assert found and passes.count == 0 and passes.best == There(1e-12)


def reports(problem: vc.ContactProblem, solver: Any, steps: int = 60) -> Iterator[Report]:
    for _, report in vc.march(problem, scheme=vc.Midpoint(), solver=solver, dt=5e-3, steps=steps):
        yield report


@pytest.mark.parametrize("name", FACTORS)
def test_a_linear_run_takes_one_factor_for_every_dt(
    name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With contact, with coefficients that change from pass to pass, and with halved steps."""
    make, most = FACTORS[name]
    problem = make()
    list(reports(problem, vc.Condensed(), 1))  # what the start of a run factorises
    factorised: list[Any] = []
    factor = SerialAlgebra.factor

    def count(algebra: SerialAlgebra, A: Any) -> Any:
        factorised.append(A)
        return factor(algebra, A)

    monkeypatch.setattr(SerialAlgebra, "factor", count)
    found = list(reports(problem, vc.Condensed()))
    assert any(report.new.active.any() for report in found) and len(factorised) == most
    factorised.clear()
    plan = vc.HalvedAtImpact(5e-3, 2)
    halved = list(vc.march(problem, scheme=vc.Midpoint(), solver=vc.Condensed(), dt=plan, steps=60))
    sizes = {round((report.new.t - report.old.t) / 5e-3, 6) for _, report in halved}
    assert len(sizes) == len(factorised) / most == 3


@dataclass(frozen=True)
class AtRest:
    """A solver that takes the law at rest whatever the slip rate is."""

    solver: Any

    def check(self, problem: vc.ContactProblem) -> None:
        self.solver.check(problem)

    def prepare(self, A: EffectiveMatrix, surface: ContactSurface, scale: float) -> PreparedAtRest:
        return PreparedAtRest(self.solver.prepare(A, surface, scale))


@dataclass(frozen=True)
class PreparedAtRest:
    prepared: Any

    def solve(self, step: StepProblem) -> StepResult:
        rest = step.friction.at(np.zeros(step.surface.count))
        result: StepResult = self.prepared.solve(replace(step, friction=rest))
        return result


@pytest.mark.parametrize(
    "solver", [vc.Condensed(), vc.Volume(), vc.Iterative()], ids=lambda one: type(one).__name__
)
def test_the_law_is_certified_at_the_rates_of_the_answer(solver: Any) -> None:
    """Friction of points that slip is mu(rate) r_n, by hand. With another mu than that of the
    answer's own rates the certificate says how wrong it is, and a solver that takes the law at
    rest is refused."""
    slipped = 0
    for report in reports(rubbing_block(DECAY), solver):
        step = report.step
        result = report.result
        assert report.certificate == kkt_residual(step, result)
        assert result.r_t is not None and step.slip0 is not None
        slip = step.surface.tangential_values(result.x) - step.slip0
        rate = step.rate_factor * np.abs(slip[:, 0])
        moving = (rate > 1e-2) & (result.r_n > 1e-3 * result.r_n.max())
        mu = 0.3 + 0.3 * np.exp(-rate / 0.1)
        assert np.abs(result.r_t[moving, 0]) == pytest.approx((mu * result.r_n)[moving], rel=1e-7)
        if moving.any():
            slipped += 1
            for other in (0.9, 1.1):
                wrong = replace(step, friction=vc.Coulomb(float(other * mu[moving][0])))
                assert kkt_residual(wrong, result).worst > 1e-3
    assert slipped > 3
    with pytest.raises(StepFailure, match="stayed above the certificate tolerance"):
        list(reports(rubbing_block(DECAY), AtRest(solver)))


def test_a_body_that_is_not_linear_is_certified_by_its_own_forces() -> None:
    """Whoever asks again gets the same certificate, and one of K alone is far above it."""
    stiffened = 0
    for report in reports(make_chain(speed=12.0), vc.Condensed(), 40):
        step = report.step
        assert report.certificate.worst <= 1e-9
        assert kkt_residual(step, report.result).worst == pytest.approx(
            report.certificate.worst, rel=1e-6, abs=1e-15
        )
        linear = replace(step, forces=None)
        stiffened += kkt_residual(linear, report.result).worst > 1e-6
    assert stiffened > 10


def test_a_static_stage_is_certified_without_the_springs_that_hold_it() -> None:
    """A chain that floats between walls: the certificate is that of K and its loads alone."""
    problem = chain_problem(5, floating=True, gap=0.05, left_gap=0.01, constant=3.0)
    state = static_equilibrium(problem)
    system = problem.static_load
    load = system.load.at_rest(0.0)
    pushed = problem.surface.reaction_load(state.r_n, len(load), None)
    left = np.abs(system.K @ state.u + pushed - load).max() / np.abs(load).max()
    assert state.certificate is not None and max(left, state.certificate) <= 1e-9
    assert type(Equilibria(problem).solver).__name__ == "Proximal"


def test_solvers_have_one_form() -> None:
    """A stepper holds one solver for every dt, whether the body is linear or not."""
    for problem, kind in ((chain_problem(5), "CertifiedSolver"), (make_chain(), "NonlinearSolver")):
        stepper = vc.Stepper(problem, scheme=vc.Midpoint(), solver=solvers.Condensed())
        stepper.attempt(1e-3)
        assert [type(one).__name__ for one in stepper.prepared.values()] == [kind]
