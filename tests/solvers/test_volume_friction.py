"""Friction on the volume route (SNES on displacements and tangential reactions) against closed
forms and the condensed route, which shares nothing with it but A and b: plane and spatial, stick,
slip and open points in one step."""

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
from petsc_packages import needs
from volume_cases import Case, case, pushed_block

from vi_contact.core.errors import InputError, StepFailure
from vi_contact.core.step import StepResult
from vi_contact.laws.friction import Coulomb, Tresca
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.friction.nsgs import NSGS
from vi_contact.solvers.volume.route import ReducedNewton, Volume

VOLUME = Volume(method=ReducedNewton())


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


def solve(c: Case, solver: Any = VOLUME) -> StepResult:
    result: StepResult = solver.prepare(c.step.A, c.step.surface, c.step.scale).solve(c.step)
    return result


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
def test_slip_direction_in_space_by_hand(law: Any) -> None:
    """A = diag(4, 1, 3), s = 1: r_t = (cos a, sin a), slip = (r·k) factor: the pull is r_t + K
    slip, K = diag(1, 3)."""
    a, factor = 0.7, 2.5
    r_t = np.array([np.cos(a), np.sin(a)])
    slip = factor * r_t
    origin = np.array([0.3, -0.2])
    b = np.array([2.0, *(r_t + np.array([1.0, 3.0]) * (origin + slip))])
    c = rubbing(
        case(sp.diags([4.0, 1.0, 3.0]), np.array([0]), b, np.zeros(1)), law, origin, tangents=2
    )
    result = solve(c)
    assert result.r_t[0] == pytest.approx(r_t, rel=1e-10) and result.x[1:] == pytest.approx(
        origin + slip, rel=1e-10
    )
    inside = replace(c, step=replace(c.step, b=np.array([2.0, 0.3 + 0.1, 3.0 * -0.2 - 0.2])))
    stuck = solve(inside)
    assert np.array_equal(stuck.x[1:], origin) and stuck.r_t[0] == pytest.approx(
        [0.1, -0.2], rel=1e-12
    )


# Random blocks
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("options", OPTIONS.values(), ids=OPTIONS.keys())
@pytest.mark.parametrize(
    "law", LAWS, ids=["coulomb", "coulomb field", "tresca", "tresca field", "slip rate"]
)
def test_agrees_with_the_condensed_route(parallel: bool, law: Any, options: dict[str, Any]) -> None:
    """V4.0 with friction: x, r_n and r_t of both routes to 1e-9, in steps with open, sticking and
    slipping points."""
    seen = []
    for seed in range(3):
        c = random_case(law, seed=seed, parallel=parallel, **options)
        result = solve(c)
        agree(c, result, solve(c, Condensed()))
        seen.append(states(c, result))
    assert max(min(found) for found in seen) > 0 or isinstance(law, Tresca)
    assert all(total > 0 for total in np.sum(seen, axis=0))


@pytest.mark.two_ranks
def test_large_friction(parallel: bool) -> None:
    """mu = 1.5: the fixed point needs its extrapolation, and Gauss-Seidel finds the same."""
    for seed in range(4):
        c = random_case(Coulomb(1.5), seed=seed, parallel=parallel)
        agree(c, solve(c), solve(c, Condensed(friction_method=NSGS())))


@pytest.mark.slow
@pytest.mark.parametrize("force", [1e-6, 1e6])
@pytest.mark.parametrize("length", [1e-6, 1e6])
def test_units_do_not_matter(parallel: bool, length: float, force: float) -> None:
    """V4.1 (6): the same case in other units of length and force."""
    one = solve(random_case(Coulomb(0.4), seed=4))
    c = random_case(Coulomb(0.4), seed=4, parallel=parallel, length=length, force=force)
    other = c.whole(solve(c))
    assert np.max(np.abs(other.r_t / force - one.r_t)) <= 1e-9 * np.max(np.abs(one.r_t))
    assert np.max(np.abs(other.x / length - one.x)) <= 1e-9 * np.max(np.abs(one.x))


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
    prepared = VOLUME.prepare(cases[0].step.A, cases[0].step.surface, 1.0)
    for c in [*cases, cases[0]]:
        step = replace(c.step, A=cases[0].step.A)
        one, other = prepared.solve(step), solve(c)
        assert np.max(np.abs(c.all(one.x - other.x))) <= 1e-11 * np.max(np.abs(c.all(other.x)))


def test_infinite_bounds_and_nothing(parallel: bool) -> None:
    """Points without predicted contact (+inf) rub under Tresca's law only; no load at rest moves
    nothing."""
    for law in (Coulomb(0.4), Tresca(0.2)):
        c = random_case(law, seed=3, parallel=parallel)
        c = c.bounded(np.where(np.arange(M) < 4, np.inf, c.step.surface.everywhere(c.step.bound)))
        result = solve(c)
        agree(c, result, solve(c, Condensed()))
        assert np.any(c.whole(result).r_t[:4]) == isinstance(law, Tresca)
        zeros = np.zeros_like(c.step.bound)
        still = replace(c.step, b=np.zeros_like(c.step.b), slip0=zeros[:, None], bound=zeros)
        nothing = c.whole(VOLUME.prepare(still.A, still.surface, 1.0).solve(still))
        assert nothing.iterations == 0 and not np.any(nothing.x) and not np.any(nothing.r_t)


@pytest.mark.two_ranks
def test_history_is_that_of_the_thresholds(parallel: bool) -> None:
    """Coulomb: relative changes of the thresholds of every Tresca problem, decreasing to 1e-10;
    Tresca: none."""
    history = solve(random_case(Coulomb(0.4), parallel=parallel)).history
    assert len(history) > 3 and history[0] == 1.0 and min(history) < 1e-7
    assert solve(random_case(Tresca(0.2), parallel=parallel)).history == ()


# Spatial
# --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "law",
    [
        pytest.param(Coulomb(0.4), marks=pytest.mark.slow),
        Tresca(0.1),
        Tresca((0.0, 0.1, 0.3, 0.6, 1.0, 2.0)),
    ],
    ids=repr,
)
def test_disks_agree_with_the_condensed_route(parallel: bool, law: Any) -> None:
    """V4.0 with friction in space: the exact disk, no polygon; both routes to 1e-9."""
    seen = []
    for seed in range(5):
        c, _ = spatial(law, seed, parallel=parallel)
        result = solve(c)
        agree(c, result, solve(c, Condensed()))
        seen.append(states(c, result))
    assert all(total > 0 for total in np.sum(seen, axis=0))


# PETSc
# --------------------------------------------------------------------------------------------------


@pytest.mark.two_ranks
@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ({"pc_type": "cholesky"}, "not symmetric"),
        pytest.param({"ksp_type": "cg", "pc_type": "hypre"}, "not symmetric", marks=needs("hypre")),
        ({"pc_type": "fieldsplit", "ksp_type": "gmres"}, "wrong rows"),
        ({"pc_type": "ilu"}, "does not solve the system"),
    ],
)
def test_unsound_options_are_refused(parallel: bool, options: dict[str, str], reason: str) -> None:
    with pytest.raises(InputError, match=reason):
        solve(
            random_case(Coulomb(0.4), parallel=parallel),
            Volume(method=ReducedNewton(), petsc_options=options),
        )


@pytest.mark.two_ranks
def test_a_limit_of_iterations_is_told(parallel: bool) -> None:
    with pytest.raises(StepFailure, match="iteration limit"):
        solve(
            random_case(Coulomb(0.4), parallel=parallel),
            Volume(method=ReducedNewton(), petsc_options={"snes_max_it": 1}),
        )


def test_solvers_are_freed(parallel: bool) -> None:
    """As without friction: only PETSc objects outlive the last reference."""
    c = random_case(Coulomb(0.4), parallel=parallel)
    gc.disable()
    try:
        prepared = VOLUME.prepare(c.step.A, c.step.surface, 1.0)
        prepared.solve(c.step)
        friction = prepared._friction
        parts = [prepared, friction, *vars(friction).values(), *vars(friction.driver).values()]
        alive = [
            weakref.ref(part) for part in parts if type(part).__module__.startswith("vi_contact")
        ]
        assert (
            len(alive) >= 5 and prepared.snes.getType() == "vinewtonrsls" and prepared.tao is None
        )
        del prepared, friction, parts
        assert [reference() for reference in alive] == [None] * len(alive)
    finally:
        gc.enable()
