"""The volume route against brute force over all contact sets (design idea 4): every method, serial
and parallel."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

pytest.importorskip("petsc4py")

from volume_cases import Case, block, case, pushed_block

from vi_contact.core.verify import kkt_residual
from vi_contact.solvers.volume.route import (
    ReducedNewton,
    SemismoothNewton,
    TaoTron,
    Volume,
)

METHODS = {
    "reduced": ReducedNewton(),
    "semismooth": SemismoothNewton(),
    "tron": TaoTron(),
}
M = 8  # contact points of pushed_block
OPTIONS: dict[str, dict[str, Any]] = {
    "rigid": {},
    "bilateral": {"bilateral": np.arange(M) % 3 == 0},
    "springs": {"compliance": np.full(M, 0.3)},
    "stiff and soft springs": {"compliance": 10.0 ** np.linspace(-3.0, 3.0, M)},
    "springs and rigid points": {"compliance": np.array([0.3, 0.0] * 4), "scale": 2.0},
    "springs and bilateral": {
        "compliance": np.array([0.3, 0.0] * 4),
        "bilateral": np.arange(M) < 3,
    },
}


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


@pytest.fixture(params=METHODS.values(), ids=METHODS.keys())
def method(request: pytest.FixtureRequest) -> Any:
    return request.param


def solve(c: Case, method: Any, **settings: Any) -> Any:
    prepared = Volume(method=method, **settings).prepare(c.step.A, c.step.surface, c.step.scale)
    return prepared.solve(c.step)


def agree(c: Case, result: Any, exact: Any) -> None:
    """x and r_n to 1e-9 of their largest values, the same contact set, and the certificate of the
    loop."""
    found, bilateral = c.whole(result), c.step.surface.everywhere(c.step.surface.bilateral)
    assert np.max(np.abs(found.x - exact.x)) <= 1e-9 * np.max(np.abs(exact.x))
    assert np.max(np.abs(found.r_n - exact.r_n), initial=0.0) <= 1e-9 * np.max(
        np.abs(exact.r_n), initial=0.0
    )
    assert np.array_equal(found.active, exact.active | bilateral)
    assert not np.any(found.r_n[~found.active])
    assert kkt_residual(c.step, result).worst <= 1e-9


@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS.keys())
def test_agrees_with_brute_force(parallel: bool, method: Any, options: dict[str, Any]) -> None:
    """V4.0: all routes to the step agree; partly active, with bilateral rows and deformable
    supports."""
    c = pushed_block(parallel=parallel, **options)
    exact = c.exact()
    assert 0 < np.sum(exact.active) < M
    agree(c, solve(c, method), exact)


@pytest.mark.two_ranks
def test_springs_far_from_the_stiffness_of_the_body(parallel: bool) -> None:
    """Springs 1e6 times stiffer and softer than the body: only the reduced method is up to
    these."""
    c = pushed_block(parallel=parallel, seed=0, compliance=10.0 ** np.linspace(-6.0, 6.0, M))
    agree(c, solve(c, ReducedNewton()), c.exact())


@pytest.mark.parametrize("seed", range(1, 6))
def test_agrees_on_other_loads(parallel: bool, method: Any, seed: int) -> None:
    c = pushed_block(parallel=parallel, seed=seed)
    agree(c, solve(c, method), c.exact())


def test_infinite_bounds_leave_points_free(parallel: bool, method: Any) -> None:
    """Moreau-Jean: +inf where no contact is predicted."""
    c = pushed_block(parallel=parallel, seed=3)
    bound = np.where(
        c.exact().active & (np.arange(M) > 3), np.inf, c.step.surface.everywhere(c.step.bound)
    )
    c = c.bounded(bound)
    assert np.isinf(bound).any()
    agree(c, solve(c, method), c.exact())


def test_negative_bounds(parallel: bool, method: Any) -> None:
    """Moreau-Jean: the bound -e v_n of an impact pulls the point back."""
    c = pushed_block(parallel=parallel, seed=2)
    c = c.bounded(-0.1 - np.arange(M) / 50.0)
    agree(c, solve(c, method), c.exact())


def test_nothing_happens_at_rest(parallel: bool, method: Any) -> None:
    """No load, touching supports: zero, without an iteration; 0/0 is not an error."""
    c = pushed_block(parallel=parallel)
    c = replace(c, step=replace(c.step, b=np.zeros_like(c.step.b)))
    result = c.whole(solve(c, method))
    assert (
        result.iterations == 0
        and not np.any(result.x)
        and not np.any(result.r_n)
        and not result.active.any()
    )


def test_no_contact_surface_is_a_linear_solve(parallel: bool, method: Any) -> None:
    body = block(3, 4)
    b = np.linspace(-1.0, 1.0, body.size)
    c = case(body.K, body.contact[:0], b, np.zeros(0), parallel=parallel)
    exact = np.linalg.solve(body.K.toarray(), b)
    result = solve(c, method)
    assert np.max(np.abs(c.all(result.x) - exact)) <= 1e-9 * np.max(np.abs(exact))


@pytest.mark.two_ranks
@pytest.mark.parametrize(
    "options", [OPTIONS["rigid"], OPTIONS["springs and bilateral"]], ids=["rigid", "springs"]
)
def test_warm_start_at_the_solution_costs_no_iteration(
    parallel: bool, method: Any, options: dict[str, Any]
) -> None:
    """P2: PETSc's own test would not stop there (solver notes 3d)."""
    c = pushed_block(parallel=parallel, **options)
    prepared = Volume(method=method).prepare(c.step.A, c.step.surface, c.step.scale)
    first = prepared.solve(c.step)
    again = prepared.solve(c.starting_at(first))
    assert again.iterations == 0 < first.iterations
    agree(c, again, c.exact())


@pytest.mark.two_ranks
def test_wrong_prediction_is_corrected(parallel: bool, method: Any) -> None:
    """The solution does not depend on the predicted set."""
    c = pushed_block(parallel=parallel)
    exact = c.exact()
    c = replace(c, step=replace(c.step, active=~exact.active[c.step.surface.slots]))
    agree(c, solve(c, method), exact)


def test_one_solver_many_steps(parallel: bool, method: Any) -> None:
    """Loads that differ by orders of magnitude and in their contact sets, one prepared solver."""
    c = pushed_block(parallel=parallel)
    prepared = Volume(method=method).prepare(c.step.A, c.step.surface, c.step.scale)
    for seed, factor in enumerate([1.0, 1e-3, -1.0, 1e4]):
        b = factor * pushed_block(seed=seed).b
        new = replace(c, b=b, step=replace(c.step, b=b[c.rows], bound=abs(factor) * c.step.bound))
        agree(new, prepared.solve(new.step), new.exact())


@pytest.mark.two_ranks
@pytest.mark.parametrize("force", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize("length", [1e-6, 1.0, 1e6])
def test_units_do_not_matter(parallel: bool, method: Any, length: float, force: float) -> None:
    """V4.1 (6), P1, P18: the same case in other units of length and force gives the same numbers to
    1e-9."""
    options = OPTIONS["springs and rigid points"]
    exact = pushed_block(seed=4, **options).exact()
    scaled = {
        key: value * length / force if key == "compliance" else value
        for key, value in options.items()
    }
    c = pushed_block(parallel=parallel, seed=4, length=length, force=force, **scaled)
    result = c.whole(solve(c, method))
    assert np.max(np.abs(result.x / length - exact.x)) <= 1e-9 * np.max(np.abs(exact.x))
    assert np.max(np.abs(result.r_n / force - exact.r_n)) <= 1e-9 * np.max(exact.r_n)


@pytest.mark.two_ranks
@pytest.mark.parametrize("unit", [1e-6, 1e6])
def test_units_do_not_matter_when_nothing_gives_the_scale(
    parallel: bool, method: Any, unit: float
) -> None:
    """P18: from rest and in touch, only A and b tell how large the displacements are."""
    cases = [pushed_block(parallel=parallel, seed=4, length=length) for length in (1.0, unit)]
    one, other = (c.whole(solve(c.bounded(np.zeros(M)), method)) for c in cases)
    assert np.max(np.abs(other.x / unit - one.x)) <= 1e-9 * np.max(np.abs(one.x))
    assert other.iterations == pytest.approx(one.iterations, abs=2)


@pytest.mark.two_ranks
def test_a_start_below_the_tolerance_is_still_improved(parallel: bool, method: Any) -> None:
    """A small residual is not a small error: what can be solved to round-off is, from a guess that
    is off by 1e-11."""
    c = pushed_block(parallel=parallel)
    exact = c.exact()
    mine = replace(
        exact, x=exact.x[c.rows] * (1.0 + 1e-11), active=exact.active[c.step.surface.slots]
    )
    step = c.starting_at(mine)
    result = Volume(method=method).prepare(step.A, step.surface, step.scale).solve(step)
    assert np.max(np.abs(c.all(result.x) - exact.x)) <= 1e-13 * np.max(np.abs(exact.x))


def test_held_points_stay_exactly_on_the_bound(parallel: bool) -> None:
    """V4.1 (2): contact unknowns never exceed their bound, not by a rounding error."""
    for method in (ReducedNewton(), TaoTron()):
        c = pushed_block(parallel=parallel, length=0.3)
        result = solve(c, method)
        on_bound = c.step.surface.normal_values(result.x)[result.active]
        assert np.array_equal(on_bound, c.step.bound[result.active])


@pytest.mark.two_ranks
def test_a_wall_larger_than_brute_force(parallel: bool) -> None:
    """All methods agree with each other on 1600 unknowns and 40 points, statically, where A is
    worst conditioned."""
    body = block(19, 40)
    b = np.zeros(body.size)
    b[body.contact] = np.sin(np.linspace(0.0, 3.0 * np.pi, 40))
    c = case(body.K, body.contact, b, np.linspace(1.0, 0.0, 40), parallel=parallel)
    reference = c.whole(solve(c, ReducedNewton()))
    assert 0 < np.sum(reference.active) < 40
    for method in METHODS.values():
        agree(c, solve(c, method), reference)


@pytest.mark.serial
def test_condensed_and_volume_agree() -> None:
    """V4.0: primal and dual solution of the same step to 1e-10."""
    from vi_contact.solvers.condensed import Condensed

    c = pushed_block(seed=7)
    dual = Condensed().prepare(c.step.A, c.step.surface, c.step.scale).solve(c.step)
    primal = solve(c, ReducedNewton())
    assert np.max(np.abs(primal.x - dual.x)) <= 1e-10 * np.max(np.abs(dual.x))
    assert np.max(np.abs(primal.r_n - dual.r_n)) <= 1e-10 * np.max(np.abs(dual.r_n))


@pytest.mark.serial
def test_one_spring_and_one_wall_by_hand() -> None:
    """k x = b - r, wall at g on a spring of compliance c: r = (b - k g)/(1 + k c), x = g + c r."""
    k, b, g, c = 4.0, 3.0, 0.5, 0.125
    by_hand = (b - k * g) / (1.0 + k * c)
    one = case(
        sp.csr_matrix([[k]]), np.array([0]), np.array([b]), np.array([g]), compliance=np.array([c])
    )
    for method in METHODS.values():
        result = solve(one, method)
        assert result.r_n[0] == pytest.approx(by_hand, rel=1e-12)
        assert result.x[0] == pytest.approx(g + c * by_hand, rel=1e-12)
