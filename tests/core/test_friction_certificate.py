"""The certificate of a step with friction: 0 for the answer, and it sees what is wrong however long
the way behind."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from column import column

from vi_contact.core.errors import InputError
from vi_contact.core.protocols import FrictionLaw
from vi_contact.core.step import Report, StepResult
from vi_contact.core.surfaces import ContactSurface
from vi_contact.core.verify import kkt_residual
from vi_contact.laws.friction import Coulomb, Tresca
from vi_contact.laws.mass import ConsistentMass
from vi_contact.run.march import march
from vi_contact.run.recorders import Contact
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed

pytestmark = pytest.mark.serial
SCHEME, DT = ZienkiewiczWoodTaylor(), 5e-3


def last(
    friction: FrictionLaw, steps: int = 20, v0: tuple[float, float] = (1.0, -1.0), **more: Any
) -> Report:
    """The last report of a column in oblique impact."""
    problem = column(20, v0=v0, friction=friction, mass=ConsistentMass(), **more)
    return [
        report
        for _, report in march(problem, scheme=SCHEME, solver=Condensed(), dt=DT, steps=steps)
    ][-1]


def other(report: Report, surface: ContactSurface, r_t: float) -> StepResult:
    """The answer to another tangential reaction, everything else in equilibrium with it."""
    step, result = report.step, report.result
    change = np.array([[r_t]]) - result.r_t
    x = result.x - step.A.factor.solve(surface.reaction_load(np.zeros(1), len(result.x), change))
    return replace(result, x=x, r_t=np.array([[r_t]]))


def test_the_answer_is_certified() -> None:
    for friction in (Coulomb(0.3), Coulomb(1.5), Tresca(0.1)):
        report = last(friction)
        assert report.certificate == kkt_residual(report.step, report.result)
        assert report.certificate.worst <= 1e-14


def test_wrong_reactions_while_it_slips() -> None:
    """Too little, none, the wrong way: dissipation 1 - r/limit; too much: outside the cone."""
    report = last(Coulomb(0.3))
    step, surface = report.step, report.step.surface
    limit = 0.3 * report.result.r_n[0]
    assert report.result.r_t[0, 0] == pytest.approx(limit, rel=1e-14)
    for share in (0.99, 0.5, 0.0, -1.0):
        found = kkt_residual(step, other(report, surface, share * limit))
        assert found.dissipation == pytest.approx(1.0 - share, rel=1e-6) and found.cone == 0.0
        assert found.equilibrium <= 1e-14
    found = kkt_residual(step, other(report, surface, 1.1 * limit))
    assert found.cone == pytest.approx(0.1 / 1.1, rel=1e-9)
    assert kkt_residual(step, replace(report.result, r_t=None)).dissipation == pytest.approx(1.0)
    nan = kkt_residual(step, replace(report.result, r_t=np.array([[np.nan]])))
    assert nan.worst == np.inf


def test_slip_below_the_limit() -> None:
    """The reaction that sticks, a little less: the node slips although the cone has room."""
    report = last(Coulomb(3.0))
    r_t = report.result.r_t[0, 0]
    assert 0.0 < r_t < 0.9 * 3.0 * report.result.r_n[0]
    found = kkt_residual(report.step, other(report, report.step.surface, 0.999 * r_t))
    assert found.dissipation > 1e-4


def test_a_long_way_blunts_nothing() -> None:
    """A column that has slid 1e4 steps far under a weak law: a promille less of the reaction is a
    promille still."""
    report = last(Tresca(1e-4), v0=(1.0, 0.0))
    step = report.step
    far = np.zeros_like(step.guess)
    far[::2] = 1e4 * np.abs(report.result.x[0] - step.slip0[0, 0])
    moved = replace(
        step, b=step.b + step.A @ far, guess=step.guess + far, slip0=step.slip0 + far[0]
    )
    result = replace(report.result, x=report.result.x + far)
    assert kkt_residual(moved, result).worst <= 1e-10
    wrong = other(
        replace(report, step=moved, result=result), step.surface, 0.999 * report.result.r_t[0, 0]
    )
    assert kkt_residual(moved, wrong).dissipation == pytest.approx(1e-3, rel=1e-2)


def test_tresca_rubs_on_open_nodes_and_coulomb_does_not() -> None:
    """A column in flight above its base: Tresca's law acts whether or not the node touches."""
    for friction, traction in ((Tresca(0.1), 0.1), (Coulomb(0.3), 0.0)):
        report = last(friction, v0=(1.0, 1.0))
        assert report.new.r_n[0] == 0.0 and report.new.r_t[0, 0] == pytest.approx(traction)
        assert report.certificate.worst <= 1e-14


def test_held_points_rub_under_pressure_only() -> None:
    """A bilateral base under Coulomb's law: pressed it rubs, pulled it slides freely."""
    for v_y, share in ((-1.0, 1.0), (1.0, 0.0)):
        report = last(Coulomb(0.3), v0=(1.0, v_y), held=True, steps=1)
        assert np.sign(report.new.r_n[0]) == -v_y
        assert report.new.r_t[0, 0] == pytest.approx(
            share * 0.3 * abs(report.new.r_n[0]), abs=1e-15
        )
        assert report.certificate.worst <= 1e-14


def test_one_coefficient_per_point_is_the_same_for_one_point() -> None:
    one, field = last(Coulomb(0.3)), last(Coulomb(np.array([0.3])))
    assert np.array_equal(one.new.u, field.new.u)
    with pytest.raises(InputError, match="mu has 2 values but there are 1 contact points"):
        last(Coulomb((0.3, 0.3)))


def test_contact_recorder_by_hand() -> None:
    """Friction on the body is -r_t along x; without friction the columns are those of before."""
    report = last(Coulomb(0.3))
    recorder = Contact()
    row = recorder.start(
        column(20, v0=(0.0, 0.0), friction=Coulomb(0.3), mass=ConsistentMass()), report.new
    )
    assert set(row) == set(recorder.columns())
    assert row["friction_force_x"] == -report.new.r_t[0, 0] < 0.0 and row["friction_force_y"] == 0.0
    assert row["contact_force_y"] == report.new.r_n[0]
    assert row["slip"].shape == row["traction_t"].shape == (1, 1)
    assert row["contact_max_slip"] == row["slip"][0, 0] == report.new.u[0]
    plain = Contact()
    assert "slip" not in plain.start(column(20, v0=(0.0, 0.0), mass=ConsistentMass()), report.new)
    assert not any("friction" in name or name in ("slip", "traction_t") for name in plain.columns())
