"""Histories of static stages with friction: slip remembers, without finite element packages."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from math import nan
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from column import column, rubbing_mass, two_component_system

from vi_contact.core.algebra import Array, SerialComm
from vi_contact.core.errors import InputError
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import FrictionLaw
from vi_contact.core.step import State
from vi_contact.core.surfaces import ContactSurface
from vi_contact.laws.friction import (
    Coulomb,
    ExponentialDecay,
    SlipRateCoulomb,
    StaticKinetic,
    Tresca,
)
from vi_contact.run.static import quasi_static, static_equilibrium
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.friction.nsgs import NSGS

pytestmark = pytest.mark.serial
# EA of the bar [N], friction per length [N/m], distance of its nodes [m]
STIFFNESS, THRESHOLD, H = (4.0e6, 50.0, 0.1)


def pulled(
    problem: ContactProblem, direction: Array, history: Callable[[float], float]
) -> ContactProblem:
    """With the nodal forces direction · history(t) added."""
    return replace(problem, system=problem.system.with_load((direction, history)))


def slider(history: Callable[[float], float]) -> ContactProblem:
    """A mass on a spring of 1e4 N/m, pressed with 1 N on a base of mu = 1 and pulled along it."""
    return pulled(rubbing_mass(u0=0.0, friction=Coulomb(1.0)), np.array([1.0, 0.0]), history)


def ends(problem: ContactProblem, times: Any, **settings: Any) -> list[State]:
    return list(quasi_static(problem, times, solver=Condensed(), **settings))


def test_spring_and_slider():
    """K u = F - r_t with |r_t| <= mu N: u stays until F has changed by 2 mu N, then follows; a
    hysteresis loop."""
    pulls = [0.0, 0.5, 1.0, 3.0, 2.0, 1.0, 0.5, -3.0, -1.5, -1.0, 3.0]
    expected = [0.0, 0.0, 0.0, 2.0, 2.0, 2.0, 1.5, -2.0, -2.0, -2.0, 2.0]  # K u [N]
    found = ends(slider(lambda t: pulls[round(t)]), range(len(pulls)))
    assert [1.0e4 * state.u[0] for state in found] == pytest.approx(expected, abs=1e-12)
    friction = [float(state.r_t[0, 0]) for state in found if state.r_t is not None]
    assert friction == pytest.approx(np.subtract(pulls, expected), abs=1e-12)
    assert [state.k for state in found] == list(range(1, len(pulls) + 1))
    assert [state.t for state in found] == list(range(len(pulls)))
    assert not any(state.v.any() for state in found)


def test_one_stage_is_the_static_equilibrium():
    """A history of one step is the gravity stage; on the way back it is not: slip remembers."""
    problem = slider(lambda t: 3.0 if t == 1.0 else 1.0)
    there, back = ends(problem, [1.0, 2.0])
    assert np.array_equal(there.u, static_equilibrium(problem, solver=Condensed(), t=1.0).u)
    assert (
        static_equilibrium(problem, solver=Condensed(), t=2.0).u[0] == 0.0
        and back.u[0] == there.u[0] > 0.0
    )


def test_a_base_that_slides_takes_the_mass_along():
    """The base moves by s under the mass: u = s until K s = mu N, and on the way back likewise from
    there."""
    problem = rubbing_mass(u0=0.0, friction=Coulomb(1.0))
    ways = [0.0, 0.5e-4, 1.0e-4, 5.0e-4, 4.5e-4, 3.0e-4, 0.0]
    moving = problem.surface.moving(along=lambda t: ways[round(t)])
    found = ends(replace(problem, surface=moving), range(len(ways)))
    assert [1.0e4 * state.u[0] for state in found] == pytest.approx(
        [0.0, 0.5, 1.0, 1.0, 0.5, -1.0, -1.0], abs=1e-12
    )


def bar_on_bed(
    friction: FrictionLaw, history: Callable[[float], float], *, cells: int = 40
) -> ContactProblem:
    """A bar pressed against a rough base by 200 N/m, held at its far end and pulled at its near
    end, node 0.

    Half a cell belongs to the near end. The base is in direction +y, so that no change of basis is
    needed.
    """
    lengths = np.full(cells, H)
    lengths[0] *= 0.5
    own, side = np.full(cells, 2.0), np.full(cells - 1, -1.0)
    own[0] = 1.0
    K = STIFFNESS / H * sp.diags([side, own, side], [-1, 0, 1])
    system = two_component_system(
        sp.diags(lengths), K, STIFFNESS / H * sp.identity(cells), np.zeros(cells)
    )
    press = np.column_stack([np.zeros(cells), 4.0 * THRESHOLD * lengths]).ravel()
    system = replace(system, floating=False).with_load(
        (press, lambda t: 1.0), (np.eye(2 * cells)[0], history)
    )
    nodes = np.arange(cells)
    surface = ContactSurface(
        comm=SerialComm(),
        points=np.column_stack([H * nodes, 0.0 * nodes]),
        normals=np.tile([0.0, 1.0], (cells, 1)),
        weights=lengths,
        gap0=np.zeros(cells),
        bilateral=np.zeros(cells, dtype=bool),
        compliance=np.zeros(cells),
        owned=2 * nodes + 1,
        slots=nodes,
        tangents=2 * nodes[:, None],
    )
    return ContactProblem(system, surface, friction=friction)


def first_pull(force: Array | float) -> Array:
    """Displacement of the near end at the first loading: the zone of slip has the length F/q, u =
    F²/(2 EA q).

    The lattice has (F² - (q h/2)²)/(2 EA q) exactly where F/(q h) is a half-integer, linear
    between.
    """
    return (np.asarray(force) ** 2 - 0.25 * (THRESHOLD * H) ** 2) / (2.0 * STIFFNESS * THRESHOLD)


@pytest.mark.parametrize("friction", [Coulomb(0.25), Tresca(THRESHOLD)], ids=repr)
@pytest.mark.parametrize("stride", [1, 3, 21], ids=lambda n: f"every {n}")
def test_bar_on_a_rough_bed(friction, stride):
    """Zones of slip grow from the pulled end; after a turn half as fast (Masing): u = u* - 2 u1((F*
    - F)/2).

    A closed loop from the second quarter on, u to 1e-11 of the largest with 21, 7 or one step a
    turn; loop area 2 F*³/(3 EA q) less a lattice term."""
    unit = THRESHOLD * H
    top = 10.5 * unit
    down = np.arange(10.5, -11.0, -1.0)[::stride] * unit
    pulls = np.concatenate([[top], down[1:], -down[1:], down[1:]])
    found = ends(bar_on_bed(friction, lambda t: pulls[round(t)]), range(len(pulls)))
    u = np.array([state.u[0] for state in found])
    assert u[0] == pytest.approx(float(first_pull(top)), rel=1e-12)
    fall = (top - down[1:]) / unit
    exact = float(first_pull(top)) - 2.0 * first_pull(0.5 * unit * fall)
    odd = np.rint(fall) % 2 == 1
    n = len(down) - 1
    for turn, sign in enumerate((1.0, -1.0, 1.0)):
        part = u[1 + turn * n : 1 + (turn + 1) * n]
        assert odd.any() and part[odd] == pytest.approx(sign * exact[odd], abs=1e-11 * u[0])
    if stride == 1:
        v, F = u[n : 3 * n + 1], pulls[n : 3 * n + 1]
        area = 0.5 * float(np.sum((F[1:] + F[:-1]) * np.diff(v)))
        assert area == pytest.approx(2.0 * top**3 / (3.0 * STIFFNESS * THRESHOLD), rel=1e-2)


def test_the_part_that_moved_last_slips():
    """Unloaded from F* = 10.75 q h to 3.25 q h: the near end and 3 nodes slip back, the next bears
    half, 6 bear +q h still; the bar behind them never felt the load."""
    unit = THRESHOLD * H
    problem = bar_on_bed(Coulomb(0.25), lambda t: unit * (10.75 if t == 1.0 else 3.25))
    there, back = ends(problem, [1.0, 2.0])
    assert there.r_t is not None and back.r_t is not None
    moved = problem.surface.tangential_values(back.u - there.u)[:, 0]
    assert np.array_equal(np.flatnonzero(moved), np.arange(4)) and np.all(moved[:4] < 0.0)
    limit = 0.25 * there.r_n
    assert there.r_t[:11, 0] == pytest.approx(limit[:11], rel=1e-12)
    assert back.r_t[:4, 0] == pytest.approx(-limit[:4], rel=1e-12)
    assert back.r_t[4, 0] == pytest.approx(0.5 * limit[4], rel=1e-11)
    assert (
        back.r_t[5:11, 0] == pytest.approx(limit[5:11], rel=1e-12)
        and np.abs(back.r_t[12:]).max() < 1e-9
    )


def test_continued_history_is_the_same():
    """Stopped after 7 stages and continued from that state: the same to the last bit."""

    def history(t: float) -> float:
        return float(8.0 * THRESHOLD * H * np.sin(0.5 * t))

    whole = ends(bar_on_bed(Coulomb(0.25), history), range(1, 15))
    first = ends(bar_on_bed(Coulomb(0.25), history), range(1, 8))
    rest = ends(bar_on_bed(Coulomb(0.25), history), range(8, 15), state=first[-1])
    assert rest[-1].k == whole[-1].k == 14
    for one, other in zip(whole, first + rest, strict=True):
        assert np.array_equal(one.u, other.u) and np.array_equal(one.r_t, other.r_t)


def test_another_friction_method():
    """Gauss-Seidel: the same history to 1e-9."""
    problem = bar_on_bed(Coulomb(0.25), lambda t: float(8.0 * THRESHOLD * H * np.sin(t)), cells=20)
    other = quasi_static(
        problem, range(1, 4), solver=Condensed(friction_method=NSGS(tolerance=1e-13))
    )
    for one, two in zip(ends(problem, range(1, 4)), other, strict=True):
        assert np.abs(one.u - two.u).max() < 1e-9 * np.abs(one.u).max()


@pytest.mark.parametrize("times", [[1.0, 1.0], [2.0, 1.0], [-1.0], [nan], [0.0, np.inf]])
def test_times_must_increase(times):
    with pytest.raises(InputError, match="give times that increase, none before the start"):
        quasi_static(slider(lambda t: 0.0), times, solver=Condensed())


@pytest.mark.parametrize(
    "mu", [ExponentialDecay(0.6, 0.4, v_c=0.1), StaticKinetic(0.6, 0.4)], ids=repr
)
def test_friction_that_asks_for_a_rate_is_refused(mu):
    problem = replace(slider(lambda t: t), friction=SlipRateCoulomb(mu))
    with pytest.raises(
        InputError, match="no slip rate for SlipRateCoulomb.*: use Coulomb .*or compute"
    ):
        quasi_static(problem, [1.0], solver=Condensed())


def test_a_load_beyond_friction_is_refused_when_it_comes():
    """A column that only friction holds: up to mu N, then there is no equilibrium."""
    problem = column(4, v0=(0.0, 0.0), friction=Coulomb(0.5))
    weight = np.tile([0.0, -1.0], 5)  # 5 N
    problem = pulled(pulled(problem, weight, lambda t: 1.0), np.tile([0.5, 0.0], 5), lambda t: t)
    stages = quasi_static(problem, [0.5, 0.99, 1.01], solver=Condensed())
    assert [next(stages).t, next(stages).t] == [0.5, 0.99]
    with pytest.raises(
        InputError, match=r"no static equilibrium: its loads carry it off along \(1, 0\)"
    ):
        next(stages)
