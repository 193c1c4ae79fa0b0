"""Residual correction: an answer that is a little wrong is put right by the solver that gave it,
whatever the law."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest
from fem_problems import max_over_ranks, shaken_wall
from mpi4py import MPI
from posed import first_step

from vi_contact.core.algebra import EffectiveMatrix
from vi_contact.core.errors import StepFailure
from vi_contact.core.problem import ContactProblem
from vi_contact.core.state_checks import initial_state
from vi_contact.core.step import Scheme, StepProblem, StepResult
from vi_contact.core.verify import kkt_residual
from vi_contact.laws.friction import Coulomb, ExponentialDecay, SlipRateCoulomb, Tresca
from vi_contact.schemes.moreau_jean import MoreauJean
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.certified import NEAR, TOLERANCE, CertifiedSolver
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.correction import Share, add, choose_share, pose_remainder
from vi_contact.solvers.friction.nsgs import NSGS
from vi_contact.solvers.volume.route import ReducedNewton, Volume

COMM = MPI.COMM_WORLD
DECAY = SlipRateCoulomb(ExponentialDecay(0.6, 0.3, 0.05))
CASES = {
    "frictionless": ({}, None, Condensed()),
    "springs": ({"springs": 1.0e9}, None, Condensed()),
    "volume": ({}, None, Volume(ReducedNewton())),
    "Coulomb": ({}, Coulomb(0.4), Condensed()),
    "Tresca": ({}, Tresca(2.0e3), Condensed(friction_method=NSGS())),
    "rate": ({}, DECAY, Condensed()),
    "Coulomb, volume": ({}, Coulomb(0.4), Volume(ReducedNewton())),
}


def pressed(problem: ContactProblem, scheme: Scheme, dt: float) -> StepProblem:
    """A step that closes a part of the wall and rubs."""
    system = problem.equations
    points = system.space.coordinates
    v = problem.surface.in_frames(
        np.sin(3.0 * points[:, 1]) + 0.3 * np.cos(5.0 * points.sum(axis=1))
    )
    step = first_step(scheme, problem, dt, replace(initial_state(problem), v=v))
    return replace(step, active=np.zeros(problem.surface.count, dtype=bool))


def spoilt(step: StepProblem, result: StepResult, size: float) -> StepResult:
    """The answer with x and its reactions wrong by this size; those that are zero stay so."""
    wave = np.cos(np.arange(len(result.x)) + 3.0 * COMM.rank)
    x = result.x + size * max_over_ranks(COMM, result.x) * wave
    factor = 1.0 + size * np.sin(np.arange(len(result.r_n)))
    r_t = None if result.r_t is None else result.r_t * factor[:, None]
    return replace(result, x=x, r_n=result.r_n * factor, r_t=r_t)


@dataclass(frozen=True)
class Spoiling:
    """A solver whose first answer to every full step is wrong by ``size``; counts what it is
    asked."""

    solver: Any
    size: float
    asked: list[StepProblem] = field(default_factory=list)
    prepared: list[Any] = field(default_factory=list)

    def check(self, problem: ContactProblem) -> None:
        self.solver.check(problem)

    def prepare(self, A: EffectiveMatrix, surface: Any, scale: float) -> Spoiling:
        self.prepared[:] = [self.solver.prepare(A, surface, scale)]
        return self

    def solve(self, step: StepProblem) -> StepResult:
        result: StepResult = self.prepared[0].solve(step)
        self.asked.append(step)
        return spoilt(step, result, self.size) if len(self.asked) == 1 else result


@pytest.mark.serial
@pytest.mark.parametrize("name", CASES)
def test_an_answer_near_the_tolerance_is_corrected(name: str) -> None:
    """Spoilt by 1e-7 it is right to a hundredth of the tolerance after three corrections at most,
    with the same contact set; a clean answer is left as it is to the last digit."""
    given, law, solver = CASES[name]
    problem = replace(
        shaken_wall(COMM, contacts=None, **given), **({"friction": law} if law else {})
    )
    step = pressed(problem, ZienkiewiczWoodTaylor(), 2e-3)
    good = CertifiedSolver(problem, step.A, step.scale, [solver], TOLERANCE).solve(step)
    clean = good.result
    certificate = good.certificate
    again = solver.prepare(step.A, problem.surface, step.scale).solve(step)
    assert certificate.worst < 1e-12 and 0 < clean.active.sum() < len(clean.active)
    assert np.array_equal(clean.x, again.x) and np.array_equal(clean.r_n, again.r_n)
    wrong = Spoiling(solver, 1e-7)
    mended = CertifiedSolver(problem, step.A, step.scale, [wrong], TOLERANCE).solve(step)
    result = mended.result
    certificate = mended.certificate
    assert kkt_residual(step, spoilt(step, clean, 1e-7)).worst > 10.0 * TOLERANCE
    assert (
        certificate.worst <= NEAR * TOLERANCE and not mended.escalated and 1 < len(wrong.asked) <= 4
    )
    assert max_over_ranks(COMM, result.x - clean.x) < 1e-10 * max_over_ranks(COMM, clean.x)
    assert np.abs(result.r_n - clean.r_n).max() < 1e-10 * clean.r_n.max()
    assert np.array_equal(result.active, clean.active) and result.method == clean.method


def test_what_is_left_over_is_a_step_of_the_contract() -> None:
    """With every share, from every answer whose reactions are too large by less than that: the
    solution of the step."""
    problem = replace(shaken_wall(COMM), friction=Coulomb(0.4))
    step = pressed(problem, MoreauJean(), 2e-3)
    solver = Condensed().prepare(step.A, problem.surface, step.scale)
    exact = solver.solve(step)
    for share in (1.0, 2.0**-4, 2.0**-10):
        start = spoilt(step, exact, 0.3 * share)
        found = add(step, start, solver.solve(pose_remainder(step, start, share)), share)
        assert kkt_residual(step, found).worst < 1e-12
        assert max_over_ranks(COMM, found.x - exact.x) < 1e-11 * max_over_ranks(COMM, exact.x)


def test_garbage_is_not_corrected() -> None:
    """An answer that is wrong by more than round-off is refused, after one question."""
    problem = shaken_wall(COMM)
    step = pressed(problem, ZienkiewiczWoodTaylor(), 2e-3)
    wrong = Spoiling(Condensed(), 1e-2)
    with pytest.raises(StepFailure, match="stayed above the certificate tolerance"):
        CertifiedSolver(problem, step.A, step.scale, [wrong], TOLERANCE).solve(step)
    assert len(wrong.asked) == 1


@pytest.mark.serial
def test_shares_are_powers_of_two_that_leave_room() -> None:
    for residual in (0.0, 1e-15, 3e-9, 1e-4, 0.5, np.inf):
        share = choose_share(residual)
        assert np.log2(share) == round(np.log2(share)) and 2.0**-30 <= share <= 1.0
        assert share == 1.0 or share >= 1000.0 * residual


@pytest.mark.serial
def test_a_share_of_a_law() -> None:
    """The cohesive part shrinks, the slope and what depends on the rate do not."""
    weights, r_n = np.array([1.0, 2.0]), np.array([3.0, 4.0])
    assert Share(Tresca(2.0), 0.25).limit(r_n, weights, 1.0) == pytest.approx(0.25 * 2.0 * weights)
    assert Share(Coulomb(0.5), 0.25).limit(r_n, weights, 1.0) == pytest.approx(0.5 * r_n)
    law = Share(Coulomb(0.5), 0.25)
    assert law.at(weights) is law and np.array_equal(law.slope(weights), [0.5, 0.5])
    fast = Share(DECAY, 0.25).at(np.full(2, 1e3))
    assert fast.limit(r_n, weights, 1.0) == pytest.approx(0.3 * r_n)
