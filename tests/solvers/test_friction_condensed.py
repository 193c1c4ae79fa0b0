"""The condensed route with friction: its Delassus operator, what it stores and when, springs under
it, its fallback."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from column import column
from posed import first_step, matrix_of
from small_steps import small

from vi_contact.core.algebra import SerialComm
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import Frictionless
from vi_contact.core.step import Report
from vi_contact.core.surfaces import ContactSurface
from vi_contact.kernels.compiler import load_loops
from vi_contact.laws.friction import Coulomb, Tresca
from vi_contact.laws.mass import ConsistentMass, Redistributed
from vi_contact.run.march import march
from vi_contact.schemes.trapezoidal import Trapezoidal
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.certified import TOLERANCE, CertifiedSolver
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.friction import newton
from vi_contact.solvers.friction.newton import FrictionNewton

pytestmark = pytest.mark.serial
SCHEME, DT = ZienkiewiczWoodTaylor(), 1e-2


def problem(friction: Any = Coulomb(0.4), **more: Any) -> ContactProblem:
    """A column in oblique impact."""
    return column(12, v0=(1.0, -1.0), friction=friction, **({"mass": ConsistentMass()} | more))


def rough(order: tuple[int, ...] = (1, 0, 2)) -> ContactProblem:
    """The column rubbing with three of its nodes, in any order; the last one may not move along the
    wall."""
    p, places = problem(), np.argsort(order)
    surface: ContactSurface = replace(
        p.surface,
        points=np.zeros((3, 2)),
        normals=np.tile([0.0, -1.0], (3, 1)),
        weights=np.ones(3),
        gap0=np.zeros(3),
        bilateral=np.zeros(3, dtype=bool),
        compliance=np.array([0.0, 0.0, 0.25]),
        owned=np.array([1, 5, 9])[places],
        slots=np.arange(3),
        tangents=np.array([[0], [4], [-1]])[places],
    )
    return replace(p, surface=surface)


def reports(
    p: ContactProblem, scheme: Any = SCHEME, steps: int = 100, solver: Any = None
) -> list[Report]:
    return [
        report
        for _, report in march(p, scheme=scheme, solver=solver or Condensed(), dt=DT, steps=steps)
    ]


def test_delassus_operator_from_its_definition() -> None:
    """DᵀA⁻¹D node by node, compliance/scale on the diagonal of normal rows; a prescribed tangent
    stands alone."""
    p = rough()
    A = matrix_of(SCHEME, p, DT)
    inverse = np.linalg.inv(np.column_stack([A @ e for e in np.eye(p.equations.rows)]))
    order = [5, 4, 1, 0, 9, -1]  # slots 0, 1, 2
    expected = np.zeros((6, 6))
    expected[:5, :5] = inverse[np.ix_(order[:5], order[:5])]
    expected[4, 4] += 0.25 / 2.0
    expected[5, 5] = expected[4, 4]
    found = Condensed().prepare(A, p.surface, 2.0).friction.delassus
    np.testing.assert_allclose(found, expected, atol=1e-14 * np.abs(expected).max())
    np.testing.assert_array_equal(found, found.T)


def test_nothing_is_made_without_friction() -> None:
    """Tangential columns cost back-substitutions: none before the first step that rubs."""
    p = problem(Frictionless())
    A = matrix_of(SCHEME, p, DT)
    solver = CertifiedSolver(p, A, 2.0, [Condensed()], 1e-9)
    prepared: Any = solver._get(0)
    state = next(report.old for report in reports(p) if report.new.active.any())
    result = solver.solve(first_step(SCHEME, p, DT, state)).result
    assert result.r_t is None and "friction" not in vars(prepared)
    rubbing = replace(p, friction=Coulomb(0.4))
    certified = solver.solve(first_step(SCHEME, rubbing, DT, state))
    result = certified.result
    certificate = certified.certificate
    assert result.r_t is not None and result.r_t.any() and "friction" in vars(prepared)
    assert result.method == "condensed FrictionNewton" and certificate.worst <= 1e-14


def test_the_order_of_conditions_has_no_effect() -> None:
    one, other = rough(), rough((0, 1, 2))
    other = replace(other, surface=replace(other.surface, compliance=np.array([0.0, 0.0, 0.25])))
    for a, b in zip(reports(one), reports(other), strict=True):
        np.testing.assert_allclose(b.new.u, a.new.u, rtol=0.0, atol=1e-13)
        np.testing.assert_allclose(b.new.r_t, a.new.r_t[[1, 0, 2]], rtol=0.0, atol=1e-11)


@pytest.mark.parametrize(
    ("scheme", "mass"), [(SCHEME, ConsistentMass()), (Trapezoidal(), Redistributed())]
)
def test_friction_on_springs(scheme: Any, mass: Any) -> None:
    """A compliant support rubs under the force of its springs; V9.7 is in the ledger tests."""
    p = problem(mass=mass)
    p = replace(p, surface=replace(p.surface, compliance=np.array([0.2])))
    closed = [report for report in reports(p, scheme) if report.new.r_n[0] > 0.0]
    assert len(closed) > 50
    for report in closed:
        assert report.certificate.worst <= 1e-12
        # u_n = -u_y of the base
        assert report.new.u[1] == pytest.approx(0.2 * report.new.r_n[0], rel=1e-9)
        assert report.new.r_t[0, 0] == pytest.approx(0.4 * report.new.r_n[0], rel=1e-12)


def test_no_coefficient_no_friction() -> None:
    """mu = 0, a threshold of 0 and no law: the same motion to round-off (metamorphic)."""
    plain = reports(problem(Frictionless()))
    for friction in (Coulomb(0.0), Tresca(0.0)):
        for one, other in zip(plain, reports(problem(friction)), strict=True):
            np.testing.assert_allclose(other.new.u, one.new.u, rtol=0.0, atol=1e-13)
            assert not other.new.r_t.any() and np.array_equal(other.new.active, one.new.active)


def test_newton_that_wanders_is_led_back() -> None:
    """Friction far beyond real values (mu = 3): two iterations do not solve some problems, sweeps
    and more do."""
    rescued = 0
    for seed in range(60):
        G, q, bilateral = small(seed, 10, 3)
        result = (
            FrictionNewton(max_iterations=2)
            .prepare(G, bilateral)
            .solve(q, np.zeros(10), np.full(10, 3.0))
        )
        assert result.residual <= TOLERANCE
        rescued += result.iterations > len(result.history)
    assert rescued > 0


@pytest.mark.parametrize("d", [2, 3])
def test_sweeps_leave_little_to_newton(monkeypatch: pytest.MonkeyPatch, d: int) -> None:
    """Compiled sweeps find the states in the plane, and in space the answer, of more nodes than a
    group of theirs has; the answer is that of Newton's method alone."""
    if load_loops(SerialComm()) is None:
        pytest.skip("nothing is compiled here")
    for seed in range(4):
        G, q, bilateral = small(seed, 100, d)
        given = q, np.zeros(100), np.full(100, 0.4), np.ones(100, dtype=bool)
        found = FrictionNewton().prepare(G, bilateral).solve(*given)
        assert found.iterations <= (2 if d == 2 else 1)
        with monkeypatch.context() as patched:
            patched.setattr(newton, "load_loops", lambda comm: None)
            alone = FrictionNewton().prepare(G, bilateral).solve(*given)
        np.testing.assert_allclose(found.r, alone.r, rtol=0.0, atol=1e-9 * np.abs(alone.r).max())
        assert np.array_equal(found.active, alone.active) and np.array_equal(
            found.stick, alone.stick
        )


def test_without_an_inverse_in_single_precision_sweeps_go_on() -> None:
    """A matrix that is positive definite in double precision only: sweeps do without its
    inverse."""
    vectors = np.linalg.qr(np.random.default_rng(0).normal(size=(40, 40)))[0]
    G = vectors @ np.diag(np.logspace(0.0, -9.0, 40)) @ vectors.T
    prepared = FrictionNewton().prepare(0.5 * (G + G.T), np.zeros(20, dtype=bool))
    assert prepared.delassus.make_short().H is None
    q = np.random.default_rng(1).normal(size=(20, 2))
    assert prepared.solve(q, np.full(20, 0.5), np.zeros(20)).residual <= TOLERANCE
