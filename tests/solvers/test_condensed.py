"""The condensed route: D~ from its definition, primal and dual, all small methods, special surfaces
(V4.0)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from bar import bar, run, thrown
from chain import chain_problem
from posed import matrix_of
from shaken import SHAKE, shaken

from vi_contact.core.algebra import SerialComm
from vi_contact.core.errors import InputError
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import Frictionless
from vi_contact.core.step import StepProblem
from vi_contact.core.surfaces import ContactSurface, empty_surface
from vi_contact.core.verify import kkt_residual
from vi_contact.laws.friction import Coulomb
from vi_contact.schemes.linear_multistep import LinearMultistep
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.normal.active_set import ActiveSet
from vi_contact.solvers.normal.hildreth import Hildreth

pytestmark = pytest.mark.serial
HALF, DT = ZienkiewiczWoodTaylor(), 5e-3
METHODS = [ActiveSet(), Hildreth(), Hildreth(primal=False)]


def rows(n: int, owned: list[int], **more: Any) -> ContactSurface:
    """Contact conditions on these unknowns, from the last to the first, so that order matters."""
    m = len(owned)
    settings = {
        "points": np.array(owned, dtype=float)[::-1, None],
        "normals": np.ones((m, 1)),
        "weights": np.ones(m),
        "gap0": np.linspace(0.0, 0.01, m),
        "bilateral": np.zeros(m, dtype=bool),
        "compliance": np.zeros(m),
        "tangents": np.zeros((m, 0), dtype=np.int64),
    }
    return ContactSurface(
        comm=SerialComm(), owned=np.array(owned)[::-1], slots=np.arange(m), **(settings | more)
    )


def problem(m: int = 5, **more: Any) -> ContactProblem:
    """A shaken chain of ten whose last m masses may each touch an obstacle of their own."""
    return replace(
        chain_problem(10, consistent=True, stiffness=2e4, damping=1e-4, excitation=SHAKE),
        surface=rows(10, list(range(10 - m, 10)), **more),
    )


def dense(p: ContactProblem, dt: float) -> np.ndarray:
    """The effective matrix in contact order: conditions first (by slot), then the rest."""
    A = matrix_of(HALF, p, dt)
    return np.column_stack([A @ e for e in np.eye(p.equations.rows)])


def stepped(p: ContactProblem, k: int) -> StepProblem:
    """The k-th step of the run."""
    return list(run(p, HALF, dt=DT, steps=k))[-1].step


def test_V40_schur_matrix_from_its_definition():
    """V4.0, 4.1: D~ = K_cc - K_ci K_ii⁻¹ K_ic, the reactions to unit displacements, to 1e-10;
    symmetric to 1e-12, SPD; its eigenvalues are the inverse ones of the flexibility."""
    p = problem()
    K = dense(p, DT)
    c = p.surface.owned
    i = np.setdiff1d(np.arange(10), c)
    D = K[np.ix_(c, c)] - K[np.ix_(c, i)] @ np.linalg.solve(K[np.ix_(i, i)], K[np.ix_(i, c)])
    prepared = Condensed().prepare(matrix_of(HALF, p, DT), p.surface, 2.0)
    schur = np.linalg.inv(prepared.delassus)
    assert np.abs(schur - D).max() <= 1e-10 * np.abs(D).max()
    assert np.abs(schur - schur.T).max() <= 1e-12 * np.abs(D).max()
    np.testing.assert_array_equal(prepared.delassus, prepared.delassus.T)
    eigenvalues = np.linalg.eigvalsh(schur)
    assert eigenvalues[0] > 0.0
    np.testing.assert_allclose(
        np.sort(1.0 / np.linalg.eigvalsh(prepared.delassus)), eigenvalues, rtol=1e-10
    )


def test_V40_primal_and_dual_forms_of_a_step():
    """V4.0: (49) swept in v on D~ and z~, and (42) in r: the same (u_n, r_n) to 1e-10; z~ from its
    partition."""
    p = problem()
    step = next(
        report.step for report in run(p, HALF, dt=DT, steps=60) if 2 <= report.new.active.sum() <= 3
    )
    K, c = dense(p, DT), p.surface.owned
    i = np.setdiff1d(np.arange(10), c)
    D = K[np.ix_(c, c)] - K[np.ix_(c, i)] @ np.linalg.solve(K[np.ix_(i, i)], K[np.ix_(i, c)])
    z = step.b[c] - K[np.ix_(c, i)] @ np.linalg.solve(K[np.ix_(i, i)], step.b[i])
    v = np.minimum(0.0, step.bound)
    for _ in range(5000):
        for row in range(len(v)):
            v[row] = min(step.bound[row], v[row] + (z[row] - D[row] @ v) / D[row, row])
    r = z - D @ v
    assert 0 < np.count_nonzero(r > 1e-6 * np.abs(r).max()) < len(r)
    for method in METHODS:
        result = Condensed(method).prepare(step.A, p.surface, step.scale).solve(step)
        assert np.abs(p.surface.normal_values(result.x) - v).max() <= 1e-10 * np.abs(v).max()
        assert np.abs(result.r_n - r).max() <= 1e-10 * np.abs(r).max()


@pytest.mark.parametrize("method", METHODS, ids=lambda m: type(m).__name__)
def test_every_step_is_certified_and_never_penetrates(method):
    """Closed rigid contacts are exactly on their bound: gap 0, not 1e-17."""
    p, closed = problem(), 0
    for report in run(p, HALF, dt=DT, steps=100, solver=Condensed(method)):
        gap = p.surface.gap(report.new.t) - p.surface.normal_values(report.new.u)
        assert report.certificate.worst <= 1e-12
        assert np.all(gap[report.new.active] == 0.0) and np.all(report.result.r_n >= 0.0)
        assert np.all(gap >= -1e-17)
        closed += int(report.new.active.sum())
    assert closed > 50


@pytest.mark.parametrize("method", METHODS, ids=lambda m: type(m).__name__)
def test_conditions_out_of_reach(method):
    """bound = +inf: such rows carry nothing, the others act as if alone."""
    gaps = np.array([0.0, np.inf, 0.005, np.inf, 0.01])
    some = problem(gap0=gaps)
    finite = np.isfinite(gaps[::-1])
    owned = [row for row, reached in zip(range(5, 10), finite, strict=True) if reached]
    alone = replace(some, surface=rows(10, owned, gap0=gaps[np.isfinite(gaps)]))
    for one, other in zip(
        run(some, HALF, dt=DT, steps=60, solver=Condensed(method)),
        run(alone, HALF, dt=DT, steps=60),
        strict=True,
    ):
        assert not one.new.r_n[np.isinf(gaps)].any() and not one.new.active[np.isinf(gaps)].any()
        np.testing.assert_allclose(one.new.u, other.new.u, atol=1e-11)


@pytest.mark.parametrize("method", METHODS, ids=lambda m: type(m).__name__)
def test_held_beside_unilateral(method):
    """Two of five points held: an equality with reactions of either sign; with all held, the
    reduced linear system."""
    mixed = problem(bilateral=np.array([True, False, False, True, False]))
    mixed = replace(
        mixed, surface=replace(mixed.surface, gap0=np.array([0.0, 0.01, 0.01, 0.0, 0.01]))
    )
    signs: set[float] = set()
    for report in run(mixed, HALF, dt=DT, steps=60, solver=Condensed(method)):
        assert np.all(np.abs(mixed.surface.normal_values(report.new.u)[[0, 3]]) == 0.0)
        assert np.all(report.new.active[[0, 3]]) and report.certificate.worst <= 1e-11
        signs |= set(np.sign(report.new.r_n[[0, 3]]))
    assert {-1.0, 1.0} <= signs
    held = replace(mixed, surface=replace(mixed.surface.bilateral_everywhere(), gap0=np.zeros(5)))
    step = stepped(held, 10)
    K, free = dense(held, DT), np.arange(5)
    result = Condensed(method).prepare(step.A, held.surface, step.scale).solve(step)
    np.testing.assert_allclose(
        result.x[free], np.linalg.solve(K[np.ix_(free, free)], step.b[free]), rtol=1e-9
    )


def test_springs_add_their_compliance():
    """G + compliance/scale: one mass on a spring of 1/c, r = u/c."""
    for scheme, scale in ((HALF, 2.0), (LinearMultistep.newmark(), 1.0)):
        p = bar(1, clamped=True, gap=0.0)
        p = replace(p, surface=replace(p.surface, compliance=np.array([0.125])))
        prepared = Condensed().prepare(matrix_of(scheme, p, DT), p.surface, scale)
        rigid = Condensed().prepare(
            matrix_of(scheme, p, DT), replace(p.surface, compliance=np.zeros(1)), scale
        )
        assert prepared.delassus - rigid.delassus == pytest.approx(0.125 / scale)


def test_no_contact_conditions_at_all():
    p = replace(thrown(10), surface=empty_surface(SerialComm(), 1))
    report = list(run(p, HALF, dt=0.01, steps=100))[-1]
    assert report.result.method == "linear" and report.result.iterations == 0
    np.testing.assert_allclose(report.new.u, -10.0, rtol=1e-12)  # through where the wall was


def test_results_tell_method_and_iterations():
    report = list(run(shaken(), HALF, dt=DT, steps=9))[-1]
    assert report.result.method == "condensed ActiveSet" and report.new.active.all()
    step = report.step
    prepared = Condensed().prepare(step.A, step.surface, step.scale)
    # the guess was right
    assert prepared.solve(replace(step, active=np.array([True]))).iterations == 0
    assert prepared.solve(replace(step, active=np.array([False]))).iterations == 1
    assert kkt_residual(step, prepared.solve(step)).worst <= 1e-14


def test_friction_that_cannot_act_is_refused_not_ignored():
    """A chain moves in one dimension only."""
    with pytest.raises(
        InputError, match=r"Condensed cannot use Coulomb\(mu=0.3\): a body in one dimension"
    ):
        Condensed().check(replace(shaken(), friction=Coulomb(0.3)))
    Condensed().check(replace(shaken(), friction=Frictionless()))


def test_a_contact_that_cannot_move_is_named():
    p = replace(problem(), surface=rows(10, [8, 9, 9]))
    with pytest.raises(InputError, match="twice"):
        Condensed().prepare(matrix_of(HALF, p, DT), p.surface, 2.0)
