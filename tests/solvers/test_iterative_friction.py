"""Friction on the iterative route against the condensed one and the reference in the volume; serial
and parallel."""

from __future__ import annotations

import gc
import weakref
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

pytest.importorskip("petsc4py")

from friction_cases import LAWS, OPTIONS, M, agree, random_case, rubbing, spatial, states
from volume_cases import Case, case, pushed_block

from vi_contact.core.errors import StepFailure
from vi_contact.core.step import StepResult
from vi_contact.core.verify import kkt_residual
from vi_contact.laws.friction import (
    Coulomb,
    ExponentialDecay,
    SlipRateCoulomb,
    StaticKinetic,
    Tresca,
)
from vi_contact.solvers import Iterative
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.volume.route import ReducedNewton, Volume

NAMES = ["coulomb", "coulomb field", "tresca", "tresca field", "slip rate"]


@pytest.fixture(
    params=[
        pytest.param(False, marks=pytest.mark.serial, id="scipy"),
        pytest.param(True, id="petsc"),
    ]
)
def parallel(request: pytest.FixtureRequest) -> Iterator[bool]:
    if request.param:
        pytest.importorskip("mpi4py")
    yield request.param


def prepared(c: Case, kind: str = "icc", **settings: Any) -> Any:
    return Iterative(kind, **settings).prepare(c.step.A, c.step.surface, c.step.scale)


def solve(c: Case, solver: Any = None) -> StepResult:
    found = (
        prepared(c) if solver is None else solver.prepare(c.step.A, c.step.surface, c.step.scale)
    )
    result: StepResult = found.solve(c.step)
    return result


def sound(c: Case, result: StepResult) -> None:
    """The certificate with room; cone and dissipation but for the last digits; what sticks is where
    it was."""
    certificate = kkt_residual(c.step, result)
    assert certificate.worst <= 3.3e-10 and certificate.cone <= 1e-14
    slip = c.step.surface.tangential_values(result.x) - c.step.slip0
    limit = c.step.friction_at(slip).limit(result.r_n, c.step.surface.weights, c.step.scale)
    assert not np.any(slip[np.linalg.norm(result.r_t, axis=1) < 0.999 * limit])


# Closed forms
# --------------------------------------------------------------------------------------------------


@pytest.mark.serial
@pytest.mark.parametrize(("push", "pull"), [(2.0, 0.5), (2.0, -3.0), (2.0, 3.0), (-1.0, 3.0)])
@pytest.mark.parametrize("law", [Coulomb(0.5), Tresca(1.0)], ids=repr)
def test_one_point_by_hand(law: Any, push: float, pull: float) -> None:
    """A = diag(4, 2): r_n = push, r_t = pull where |pull| <= 1, else ±1, x_t = (pull - r_t)/2;
    open: Coulomb none."""
    c = rubbing(
        case(sp.diags([4.0, 2.0]), np.array([0]), np.array([push, pull]), np.zeros(1)), law, 0.0
    )
    result = solve(c)
    limit = 1.0 if push > 0.0 or isinstance(law, Tresca) else 0.0
    r_t = np.clip(pull, -limit, limit)
    assert result.r_n[0] == pytest.approx(max(push, 0.0), rel=1e-14)
    assert result.r_t[0, 0] == pytest.approx(r_t, rel=1e-13)
    assert result.x == pytest.approx(
        [min(push, 0.0) / 4.0, (pull - r_t) / 2.0], rel=1e-13, abs=1e-15
    )


@pytest.mark.serial
@pytest.mark.parametrize("law", [Coulomb(0.5), Tresca(1.0)], ids=repr)
@pytest.mark.promise("guide/solvers.md", "sticking points are where they were, to the last bit")
def test_slip_direction_in_space_by_hand(law: Any) -> None:
    """A = diag(4, 1, 3), s = 1: r_t = (cos a, sin a), slip = (r·k) factor: the pull is r_t + K
    slip, K = diag(1, 3)."""
    r_t = np.array([np.cos(0.7), np.sin(0.7)])
    slip, origin = 2.5 * r_t, np.array([0.3, -0.2])
    b = np.array([2.0, *(r_t + np.array([1.0, 3.0]) * (origin + slip))])
    c = rubbing(
        case(sp.diags([4.0, 1.0, 3.0]), np.array([0]), b, np.zeros(1)), law, origin, tangents=2
    )
    result = solve(c)
    assert result.r_t[0] == pytest.approx(r_t, rel=1e-9) and result.x[1:] == pytest.approx(
        origin + slip, rel=1e-9
    )
    inside = replace(c, step=replace(c.step, b=np.array([2.0, 0.3 + 0.1, 3.0 * -0.2 - 0.2])))
    stuck = solve(inside)
    assert np.array_equal(stuck.x[1:], origin) and stuck.r_t[0] == pytest.approx(
        [0.1, -0.2], rel=1e-12
    )


# Random bodies
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS.keys())
@pytest.mark.parametrize("law", LAWS, ids=NAMES)
def test_agrees_with_the_condensed_route(parallel: bool, law: Any, options: dict[str, Any]) -> None:
    """x, r_n and r_t to 1e-9, the same sets, in steps with open, sticking and slipping points."""
    seen = []
    for seed in range(3):
        c = random_case(law, seed=seed, parallel=parallel, **options)
        result, condensed = solve(c), solve(c, Condensed())
        agree(c, result, condensed)
        sound(c, result)
        seen.append(states(c, result))
        assert seen[-1] == states(c, condensed)
    assert all(total > 0 for total in np.sum(seen, axis=0))


@pytest.mark.parametrize(
    "kind, law",
    [
        ("icc", Coulomb(0.3)),
        ("jacobi", Coulomb(0.8)),
        ("gamg", Coulomb(0.8)),
        ("icc", Coulomb(1.2)),
        ("icc", Tresca((0.0, 0.1, 0.3, 0.6, 1.0, 2.0))),
        ("gamg", Tresca(0.1)),
    ],
    ids=str,
)
def test_disks_agree_with_the_condensed_route(parallel: bool, kind: str, law: Any) -> None:
    """In space: the exact disk, no polygon; at most 12 Newton steps."""
    seen = []
    for seed in range(5):
        c, _ = spatial(law, seed, parallel=parallel)
        result = solve(c, Iterative(kind))
        agree(c, result, solve(c, Condensed()))
        sound(c, result)
        assert result.iterations <= 12
        seen.append(states(c, result))
    assert all(total > 0 for total in np.sum(seen, axis=0))


@pytest.mark.two_ranks
def test_agrees_with_the_reference_in_the_volume(parallel: bool) -> None:
    for law in (Coulomb(1.2), Tresca(0.1)):
        c, _ = spatial(law, 3, parallel=parallel)
        agree(c, solve(c), solve(c, Volume(ReducedNewton())))


@pytest.mark.two_ranks
@pytest.mark.parametrize(
    "mu",
    [
        ExponentialDecay(0.8, 0.2, 0.5),
        ExponentialDecay(0.2, 0.8, 0.5),
        StaticKinetic(0.6, 0.4),
        lambda v: 0.1 + 0.2 * v,
    ],
    ids=["weakening", "strengthening", "static and kinetic", "viscous"],
)
def test_rates_in_space(parallel: bool, mu: Any) -> None:
    """The coefficient of the rate that the step itself finds."""
    for seed in range(3):
        c, _ = spatial(Coulomb(0.0), seed, parallel=parallel)
        c = replace(c, step=replace(c.step, friction=SlipRateCoulomb(mu), rate_factor=2.0))
        result = solve(c)
        agree(c, result, solve(c, Condensed()))
        sound(c, result)


@pytest.mark.two_ranks
def test_newton_in_circles_goes_on_with_given_limits(parallel: bool) -> None:
    """mu = 2 on ten points that hardly stand alone: Tresca problems lead out of the circle, and the
    answer is right."""
    c, _ = spatial(Coulomb(2.0), 7, parallel=parallel, m=10, alone=0.01)
    solver = prepared(c, "jacobi")
    result = solver.solve(c.step)
    agree(c, result, solve(c, Condensed()))
    sound(c, result)
    assert solver.work.fallbacks == 1 and result.iterations > 15


@pytest.mark.two_ranks
def test_answers_do_not_depend_on_steps_before(parallel: bool) -> None:
    """One prepared solver over many steps, and a new one for each; Tresca, Coulomb and frictionless
    steps mixed."""
    cases = [
        random_case(law, seed=seed, parallel=parallel)
        for seed in range(3)
        for law in (Coulomb(0.4), Tresca(0.2))
    ]
    cases.append(pushed_block(parallel=parallel, seed=3))
    first = replace(cases[0], step=replace(cases[0].step))
    solver = prepared(first, "gamg")
    for c in [*cases, cases[0]]:
        one, other = solver.solve(replace(c.step, A=first.step.A)), solve(c)
        assert np.max(np.abs(c.all(one.x - other.x))) <= 1e-9 * np.max(np.abs(c.all(other.x)))


@pytest.mark.two_ranks
@pytest.mark.parametrize("length, force", [(1e-6, 1e6), (1e6, 1e-6)])
def test_units_do_not_matter(parallel: bool, length: float, force: float) -> None:
    """The same case in other units of length and force: the same numbers, and the same work."""
    one, c = (
        random_case(Coulomb(0.4), seed=4, parallel=parallel),
        pushed_block(seed=4, parallel=parallel, length=length, force=force),
    )
    c = rubbing(c, Coulomb(0.4), length * one.step.surface.everywhere(one.step.slip0))
    first, second = prepared(one), prepared(c)
    a, b = one.whole(first.solve(one.step)), c.whole(second.solve(c.step))
    assert np.max(np.abs(b.r_t / force - a.r_t)) <= 1e-9 * np.max(np.abs(a.r_t))
    assert np.max(np.abs(b.x / length - a.x)) <= 1e-9 * np.max(np.abs(a.x))
    assert first.work.products == second.work.products


@pytest.mark.two_ranks
def test_the_mirrored_problem_has_the_mirrored_answer(parallel: bool) -> None:
    """Tangents that point the other way."""
    rng = np.random.default_rng(5)
    root, b, mirror = rng.normal(size=(18, 18)), rng.normal(size=18), np.tile([1.0, -1.0, 1.0], 6)
    slip0 = 0.1 * rng.normal(size=(6, 2))
    found = []
    for turn in (np.ones(18), mirror):
        matrix = sp.csr_matrix((root @ root.T / 18.0 + np.eye(18)) * np.outer(turn, turn))
        c = case(
            matrix,
            np.arange(0, 18, 3),
            turn * (b + np.tile([0.5, 0.0, 0.0], 6)),
            np.full(6, 0.05),
            parallel=parallel,
        )
        c = rubbing(c, Coulomb(0.5), slip0 * turn[1:3], tangents=2)
        found.append(c.whole(solve(c)))
    one, other = found
    assert np.max(np.abs(one.r_t)) > 0.0 and np.array_equal(one.active, other.active)
    assert np.max(np.abs(one.r_t - other.r_t * mirror[1:3])) <= 1e-9 * np.max(np.abs(one.r_t))
    assert np.max(np.abs(one.x - other.x * mirror)) <= 1e-9 * np.max(np.abs(one.x))


def test_infinite_bounds_nothing_and_everything_opens(parallel: bool) -> None:
    """Points without predicted contact (+inf) rub under Tresca's law only; no load at rest moves
    nothing; pulled off, nothing rubs."""
    for law in (Coulomb(0.4), Tresca(0.2)):
        c = random_case(law, seed=3, parallel=parallel)
        c = c.bounded(np.where(np.arange(M) < 4, np.inf, c.step.surface.everywhere(c.step.bound)))
        solver = prepared(c)
        result = solver.solve(c.step)
        agree(c, result, solve(c, Condensed()))
        assert np.any(c.whole(result).r_t[:4]) == isinstance(law, Tresca)
        toward = c.step.surface.reaction_load(np.ones_like(c.step.bound), len(c.step.b))
        pulled = replace(
            c, step=replace(c.step, b=c.step.b - 50.0 * toward, active=np.ones_like(c.step.active))
        )
        off = solver.solve(pulled.step)
        agree(pulled, off, solve(pulled, Condensed())) if isinstance(law, Tresca) else None
        assert (
            not off.active.any()
            and not np.any(off.r_n)
            and np.any(c.whole(off).r_t) == isinstance(law, Tresca)
        )
        zeros = np.zeros_like(c.step.bound)
        still = replace(c.step, b=np.zeros_like(c.step.b), slip0=zeros[:, None], bound=zeros)
        nothing = c.whole(prepared(c).solve(still))
        assert nothing.iterations == 0 and not np.any(nothing.x) and not np.any(nothing.r_t)


def test_work_is_counted_and_a_warm_start_is_one(parallel: bool) -> None:
    c = random_case(Coulomb(0.4), parallel=parallel)
    solver = prepared(c)
    result, work = solver.solve(c.step), solver.work
    assert work.newton_steps == result.iterations == len(result.history) - 1 > 1
    assert work.linear_iterations > work.newton_steps
    assert work.products <= work.linear_iterations + 2 * work.newton_steps + 1
    assert (
        result.history[-1] <= 1.5e-10 and result.method == "Iterative(icc)" and result.aim == 3e-10
    )
    before = work.linear_iterations
    again = solver.solve(c.starting_at(result))
    assert again.iterations == 0 and work.linear_iterations == before
    assert np.array_equal(again.active, result.active)


# What cannot be solved
# ------------------------------------------------------------------------------------------------


def test_not_a_number_is_a_sentence(parallel: bool) -> None:
    c = random_case(Coulomb(0.4), parallel=parallel)
    with pytest.raises(
        StepFailure,
        match=r"stopped after 0 Newton steps, the residual is not a number \(residuals .*",
    ):
        prepared(c).solve(replace(c.step, b=np.full_like(c.step.b, np.nan)))


@pytest.mark.two_ranks
def test_stagnation_is_a_sentence_with_the_history(parallel: bool) -> None:
    """A tolerance below round-off is reached by no step."""
    c = random_case(Coulomb(0.4), parallel=parallel)
    solver = Iterative("jacobi", tolerance=1e-30, patience=2).prepare(
        c.step.A, c.step.surface, c.step.scale
    )
    with pytest.raises(StepFailure, match=r"Newton steps, .*\(residuals .*, .*\): ") as found:
        solver.solve(c.step)
    assert "\n" not in str(found.value)


def test_solvers_are_freed(parallel: bool) -> None:
    """Only PETSc objects outlive the last reference."""
    c = random_case(Coulomb(0.4), parallel=parallel)
    gc.disable()
    try:
        solver = prepared(c)
        solver.solve(c.step)
        friction = solver._friction
        alive = [weakref.ref(part) for part in (solver, friction, friction.gmres)]
        assert friction.gmres.gmres.getType() == "gmres"
        del solver, friction
        assert [reference() for reference in alive] == [None] * len(alive)
    finally:
        gc.enable()
