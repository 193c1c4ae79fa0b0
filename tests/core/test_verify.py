"""The certificate finds each kind of defect at its size; the energy ledger closes for every scheme
(V9)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from bar import before_impact, bouncing, period_three, run, thrown
from chain import chain_problem
from shaken import changes, shaken

from vi_contact.core.algebra import EffectiveMatrix, SerialMatrix
from vi_contact.core.ledger import compute_energies, energy_balance
from vi_contact.core.state_checks import initial_state
from vi_contact.core.step import Report, StepProblem, StepResult
from vi_contact.core.verify import kkt_residual, kkt_residuals
from vi_contact.laws.impact import ComponentReset, Elastic, ImpulseUpdate, Inelastic, Newton
from vi_contact.schemes.linear_multistep import LinearMultistep
from vi_contact.schemes.ss22 import SS22
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor

pytestmark = pytest.mark.serial
HALF, NEWMARK = ZienkiewiczWoodTaylor(), LinearMultistep.newmark()
HOUBOLT = LinearMultistep(
    a=(11 / 6, -3.0, 3 / 2, -1 / 3), b=(1.0, 0.0, 0.0, 0.0), gamma=(2.0, -5.0, 4.0, -1.0)
)
SCHEMES = {
    "zwt ½": HALF,
    "zwt 0.7": ZienkiewiczWoodTaylor(0.7),
    "ss22": SS22(0.6, 0.9),
    "newmark": NEWMARK,
    "newmark gamma 0.6": LinearMultistep.newmark(0.3025, 0.6),
    "houbolt": HOUBOLT,
}


def pressed() -> tuple[StepProblem, StepResult]:
    """A step of the chain between two walls: closed on the right (0), open on the left (1)."""
    problem = chain_problem(4, gap=0.01, left_gap=0.02, constant=40.0, damping=1e-3)
    report = list(run(problem, HALF, dt=0.02, steps=15))[-1]
    assert report.new.active.tolist() == [True, False] and report.certificate.worst <= 1e-14

    # The step of a scheme is one for an increment; here is the one for x itself.
    step, origin = report.step, report.step.origin
    whole = replace(
        step,
        b=step.b + step.A @ origin,
        bound=step.bound + step.surface.normal_values(origin),
        guess=origin,
        origin=None,
        internal=None,
    )
    return whole, replace(report.result, x=origin + report.result.x)


def size(step: StepProblem, result: StepResult) -> tuple[float, float]:
    """(x_ref, r_ref) as documented in Certificate."""
    x_ref = max(np.abs(result.x).max(), np.abs(step.guess).max())
    return x_ref, max(np.abs(step.b).max(), np.abs(result.r_n).max())


def test_equilibrium_defect():
    """delta on a free unknown: |A e_1|_max delta / max(|b|, |A x|)."""
    step, result = pressed()
    wrong = result.x.copy()
    wrong[1] += 1e-6
    found = kkt_residual(step, replace(result, x=wrong))
    column = np.abs(step.A @ np.eye(4)[1]).max() * 1e-6
    largest = max(np.abs(step.b).max(), np.abs(step.A @ wrong).max())
    assert found.equilibrium == pytest.approx(column / largest, rel=1e-6)
    assert found.penetration == found.tension == 0.0 and found.complementarity <= 1e-14


def test_reaction_defect():
    """A reaction that is 3 N too small is 3 N of equilibrium."""
    step, result = pressed()
    found = kkt_residual(step, replace(result, r_n=result.r_n - [3.0, 0.0]))
    largest = max(np.abs(step.b).max(), np.abs(step.A @ result.x).max())
    assert found.equilibrium == pytest.approx(3.0 / largest, rel=1e-9)


@pytest.mark.parametrize("depth", [1e-4, 1e-9])
def test_penetration_defect(depth):
    step, result = pressed()
    inside = result.x.copy()
    inside[3] += depth
    found = kkt_residual(step, replace(result, x=inside))
    x_ref, _ = size(step, replace(result, x=inside))
    assert found.penetration == pytest.approx(depth / x_ref, rel=1e-6)
    assert found.complementarity == pytest.approx(depth / x_ref, rel=1e-6)


def test_tension_and_force_at_a_distance():
    """-5 N on the open wall is tension, +5 N is force over a gap; both are complementarity
    5/r_ref."""
    step, result = pressed()
    _, r_ref = size(step, result)
    for sign in (-1.0, 1.0):
        found = kkt_residual(step, replace(result, r_n=result.r_n + [0.0, 5.0 * sign]))
        assert found.tension == pytest.approx(max(-5.0 * sign, 0.0) / r_ref, rel=1e-9)
        assert found.complementarity == pytest.approx(5.0 / r_ref, rel=1e-9)


def test_wrong_active_set_defect():
    """A right answer with a wrong set: the impact law would act on it. Each wrong row shows what
    makes it wrong."""
    step, result = pressed()
    x_ref, r_ref = size(step, result)
    gap = step.bound - step.surface.normal_values(result.x)
    opened = kkt_residual(step, replace(result, active=np.array([False, False])))
    assert opened.complementarity == pytest.approx(result.r_n[0] / r_ref, rel=1e-12)
    closed = kkt_residual(step, replace(result, active=np.array([True, True])))
    assert closed.complementarity == pytest.approx(gap[1] / x_ref, rel=1e-12)


def test_bilateral_row_knows_both_signs():
    """A held point: reaction of either sign, but no gap of either sign."""
    step, result = pressed()
    held = replace(step, surface=replace(step.surface, bilateral=np.array([True, False])))
    assert kkt_residual(held, replace(result, r_n=result.r_n * -1.0)).tension == 0.0
    for delta in (1e-5, -1e-5):
        moved = result.x.copy()
        moved[3] += delta
        found = kkt_residual(held, replace(result, x=moved))
        assert found.penetration == 0.0
        assert found.complementarity == pytest.approx(
            1e-5 / size(held, replace(result, x=moved))[0], rel=1e-6
        )


def test_springs_are_allowed_to_sink_in():
    """gap = bound - x + compliance r_n/scale."""
    step, result = pressed()
    depth = 1e-3
    soft = replace(step.surface, compliance=np.array([depth * step.scale / result.r_n[0], 1.0]))
    sunk = result.x.copy()
    sunk[3] += depth
    found = kkt_residual(replace(step, surface=soft), replace(result, x=sunk))
    assert found.penetration <= 1e-14 and found.complementarity <= 1e-14


def test_a_wide_gap_blunts_nothing():
    """The residuals of the narrow gap are the same when the other wall is a kilometre away, or
    gone."""
    step, result = pressed()
    inside = replace(result, x=result.x + [0.0, 0.0, 0.0, 1e-6])
    near = kkt_residual(step, inside)
    for bound in (1e3, np.inf):
        assert kkt_residual(replace(step, bound=np.array([step.bound[0], bound])), inside) == near


def test_units_do_not_matter():
    """x in units of a millionth, r in units of a thousand: A, b and bounds follow, the certificate
    stays."""
    step, result = pressed()
    length, force = 2.0**20, 2.0**-10  # powers of two: bit-equal
    A = EffectiveMatrix(step.A.algebra.combine([(force / length, step.A.matrix)]), step.A.algebra)
    wrong = replace(result, x=result.x + 1e-7, r_n=result.r_n - 0.5)
    other = replace(
        step, A=A, b=step.b * force, bound=step.bound * length, guess=step.guess * length
    )
    assert kkt_residual(
        other, replace(wrong, x=wrong.x * length, r_n=wrong.r_n * force)
    ) == kkt_residual(step, wrong)


def test_nan_and_nothing():
    """NaN anywhere in the answer is infinitely bad and raises no warning; 0/0 is perfect."""
    step, result = pressed()
    for name in ("x", "r_n"):
        broken = getattr(result, name).copy()
        broken[0] = np.nan
        assert kkt_residual(step, replace(result, **{name: broken})).worst == np.inf
    zero = replace(step, b=0.0 * step.b, guess=0.0 * step.guess)
    nothing = replace(
        result, x=0.0 * result.x, r_n=0.0 * result.r_n, active=np.zeros(2, dtype=bool)
    )
    assert kkt_residual(zero, nothing).worst == 0.0
    assert kkt_residual(zero, replace(nothing, r_n=np.array([0.0, 1e-300]))).worst == np.inf
    assert kkt_residual(replace(zero, bound=np.array([-1e-300, 1.0])), nothing).worst == np.inf


IMPACTS: dict[str, Any] = {
    "none": None,
    "reset": Inelastic(ComponentReset()),
    "projection": Inelastic(ImpulseUpdate()),
    "newton": Newton(0.5),
    "elastic": Elastic(ImpulseUpdate()),
}


def ledger(
    problem: Any, scheme: Any, *, dt: float, steps: int, tolerance: float = 1e-12
) -> tuple[list[Report], dict[str, float], float]:
    """(reports, totals [J], largest energy or total so far); asserts that every step closes to
    1e-12 of it, and the sum to ``tolerance``."""
    totals = dict.fromkeys(("input", "damping", "contact", "algorithmic", "impact"), 0.0)
    reports: list[Report] = []
    start = initial_state(problem)
    first = biggest = compute_energies(problem.equations, start.u, start.v).total
    for report in run(problem, scheme, dt=dt, steps=steps):
        now = compute_energies(problem.equations, report.new.u, report.new.v)
        found = energy_balance(problem, report.old, before_impact(report), report.balance)
        for name in ("input", "damping", "contact", "algorithmic"):
            totals[name] += getattr(found, name)
        totals["impact"] += problem.equations.kinetic_energy(report.v_minus) - now.kinetic
        reports.append(report)
        biggest = max(biggest, now.total, *(abs(value) for value in totals.values()))
        assert abs(found.defect) <= 1e-12 * biggest
        lost = totals["damping"] + totals["contact"] + totals["algorithmic"] + totals["impact"]
        assert abs(now.total - first - totals["input"] + lost) <= tolerance * biggest
    return reports, totals, biggest


@pytest.mark.parametrize("scheme", SCHEMES.values(), ids=SCHEMES)
@pytest.mark.parametrize("damping", [0.0, 1e-3])
@pytest.mark.parametrize("impact", IMPACTS.values(), ids=IMPACTS)
def test_V97_ledger_closes(scheme, damping, impact):
    """V9.7: W_ext + E0 = E_end + D_visc + D_contact + D_impact + D_alg in every step, to 1e-12 of
    the largest term."""
    problem = shaken(impact, damping=damping)
    reports, totals, biggest = ledger(problem, scheme, dt=5e-3, steps=100)
    assert changes(reports) >= 2 and totals["input"] != 0.0 and totals["contact"] != 0.0
    assert (totals["damping"] > 1e-3 * biggest) == (damping > 0.0)
    assert (totals["impact"] != 0.0) == (impact is not None)
    if scheme is HALF:
        # the midpoint rule has no algorithmic loss
        assert abs(totals["algorithmic"]) <= 1e-12 * biggest
    if isinstance(impact, Inelastic) and isinstance(impact.update, ImpulseUpdate):
        assert totals["impact"] > 0.0


@pytest.mark.long
@pytest.mark.parametrize("scheme", [HALF, NEWMARK], ids=["zwt", "newmark"])
@pytest.mark.parametrize("body", [thrown, bouncing, period_three], ids=["V1.1", "V1.2", "V1.3"])
def test_V97_ledger_closes_for_bars(scheme, body):
    """The bars fly 5 m, so that velocities carry the rounding of displacements over dt: V9.7's
    1e-10 for the sum."""
    n = 50
    dt = 0.5 / n if body is period_three else 1 / 150
    _, totals, biggest = ledger(body(n), scheme, dt=dt, steps=500, tolerance=1e-10)
    if scheme is HALF:
        assert 0.0 < totals["contact"] < 0.05 * biggest  # V9.1: closures only take
    else:
        assert totals["contact"] < 0.0  # V9.2: hard contact gains at release


def test_ledger_with_known_energies_is_the_same():
    problem = shaken(damping=1e-3)
    report = list(run(problem, HALF, dt=5e-3, steps=9))[-1]
    states = report.old, before_impact(report)
    before, after = (compute_energies(problem.equations, state.u, state.v) for state in states)
    assert energy_balance(
        problem, *states, report.balance, before=before, after=after
    ) == energy_balance(problem, *states, report.balance)
    assert before.total == before.kinetic + before.strain


def test_ledger_finds_a_wrong_step():
    """A step that did not satisfy its equation of motion, here with a lighter M, leaves a
    defect."""
    problem = shaken()
    report = list(run(problem, HALF, dt=5e-3, steps=30))[-1]
    lost = 0.01 * (problem.equations.M @ report.balance.a)
    wrong = replace(report.balance, a=1.01 * report.balance.a, of_momentum=None)
    found = energy_balance(problem, report.old, before_impact(report), wrong)
    du = report.new.u - report.old.u
    assert isinstance(problem.equations.M, SerialMatrix)
    assert found.algorithmic == pytest.approx(du @ lost, rel=1e-6)
    lighter = replace(report.balance, f=report.balance.f + 1.0)
    defect = energy_balance(problem, report.old, before_impact(report), lighter).defect
    assert defect == pytest.approx(-du.sum(), rel=1e-9)


class ByRows(EffectiveMatrix):
    """One that multiplies rows (k, n), as those of PETSc do."""

    def __matmul__(self, x):
        return np.stack([self.matrix @ row for row in np.atleast_2d(x)]).reshape(x.shape)


def test_certificates_of_several_steps_are_those_of_each():
    """Digit by digit: rows of a matrix, with springs, held conditions, and NaN."""
    step, result = pressed()
    step = replace(step, A=ByRows(step.A.matrix, step.A.algebra))
    rng, m, n = np.random.default_rng(3), 2, len(result.x)
    odd = replace(step.surface, bilateral=np.array([True, False]), compliance=np.array([0.0, 1e-3]))
    for surface in (step.surface, odd):
        x, r_n = rng.normal(size=(4, n)), rng.normal(size=(4, m))
        x[3, 1] = np.nan
        answers = replace(result, x=x, r_n=r_n, active=rng.random((4, m)) < 0.5, r_t=None)
        many = replace(
            step,
            surface=surface,
            b=rng.normal(size=(4, n)),
            guess=-0.5 * x,
            active=answers.active,
            slip0=None,
        )
        singles = [
            kkt_residual(
                replace(many, b=many.b[row], guess=many.guess[row], active=many.active[row]),
                replace(answers, x=x[row], r_n=r_n[row], active=answers.active[row]),
            )
            for row in range(4)
        ]
        rows = (many, answers)  # without friction none is asked for its own
        together = kkt_residuals(many, answers, lambda row, rows=rows: rows)
        assert [repr(one) for one in together] == [repr(one) for one in singles]
        assert np.isinf(together[3].worst) and 0.0 < together[0].worst < np.inf
