"""Independent routes to the same step (volume and condensed, every method), and the same body
written differently.

Design idea 4: PETSc's SNES-VI and TAO on all unknowns share nothing with the condensed route but A
and b. From one state both must give the same step. And nothing may depend on the frame, the unit of
length or the number of ranks.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from math import pi
from typing import Any

import numpy as np
import pytest
from fem_problems import BOX_DT, WALL_DT, Run, max_over_ranks, run, shaken_wall, thrown_box, turned
from mpi4py import MPI

from vi_contact.core.problem import ContactProblem
from vi_contact.core.step import StepProblem
from vi_contact.run.cross_check import cross_check
from vi_contact.run.march import march
from vi_contact.schemes.zienkiewicz_wood_taylor import ZienkiewiczWoodTaylor
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.normal.active_set import ActiveSet
from vi_contact.solvers.normal.hildreth import Hildreth
from vi_contact.solvers.volume.route import ReducedNewton, SemismoothNewton, TaoTron, Volume

COMM = MPI.COMM_WORLD
SCHEME = ZienkiewiczWoodTaylor(phi=0.5)
CONDENSED = {
    "active set": Condensed(ActiveSet()),
    "Hildreth primal": Condensed(Hildreth(primal=True)),
    "Hildreth dual": Condensed(Hildreth(primal=False)),
}
VOLUME = {
    "reduced Newton": Volume(method=ReducedNewton()),
    "semismooth Newton": Volume(method=SemismoothNewton()),
    "TAO TRON": Volume(method=TaoTron()),
}
PROBLEMS: dict[str, Callable[[Any], ContactProblem]] = {
    "quadrilaterals": shaken_wall,
    "triangles": partial(shaken_wall, simplices=True),
    "turned wall": partial(shaken_wall, angle=pi / 6.0),
    "points and gap": partial(shaken_wall, contacts=(3.0, 6.0, 9.0), gap=2e-5),
    "soft springs": partial(shaken_wall, springs=3.0e9),
    "stiff springs": partial(shaken_wall, angle=pi / 6.0, springs=1.0e13),
    "box": thrown_box,
    "inclined box of tetrahedra": partial(thrown_box, simplices=True, angle=0.5),
}
problems = pytest.mark.parametrize("name", PROBLEMS)
# a kind of each
ON_RANKS = ("turned wall", "points and gap", "stiff springs", "inclined box of tetrahedra")
many_routes = pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=() if name in ON_RANKS else pytest.mark.serial) for name in PROBLEMS],
)


def timing(name: str) -> tuple[float, int]:
    """(dt, steps): long enough for several changes of the contact set."""
    return (BOX_DT, 8) if "box" in name else (WALL_DT, 34)


# Routes
# --------------------------------------------------------------------------------------------------


@pytest.mark.slow
@many_routes
@pytest.mark.promise("guide/solvers.md", "both routes agree in each step to 1e-9")
def test_all_routes_agree_at_every_step(name):
    """Every method against the active set on the condensed problem, from the same states: u and r_n
    to 1e-9.

    The wall is followed from just before its first contact, at step 20, over closing, sliding apart
    and closing again.
    """
    dt, steps = timing(name)
    problem = PROBLEMS[name](COMM)
    state = None
    if steps > 20:
        *_, (state, _) = march(problem, scheme=SCHEME, solver=Condensed(), dt=dt, steps=19)
        steps -= 19
    solvers = (*CONDENSED.values(), *VOLUME.values())
    checked = cross_check(problem, scheme=SCHEME, solvers=solvers, dt=dt, steps=steps, state=state)
    # both forms of Hildreth have one name
    assert len({found.method for found in checked.found}) == len(solvers) - 2
    for found in checked.found:
        assert found.relative["u"] < 1e-9, found.method
        assert found.relative["r_n"] < 1e-9, found.method
        assert found.steps == steps and found.size["r_n"] > 0.0


def busiest_step(problem: ContactProblem, dt: float, steps: int) -> StepProblem:
    """The last step that leaves a part of the surface closed."""
    found = None
    for _, report in march(problem, scheme=SCHEME, solver=Condensed(), dt=dt, steps=steps):
        if 0 < COMM.allreduce(int(report.result.active.sum())) < problem.surface.total:
            found = report.step
    assert found is not None
    return found


@pytest.mark.serial
@pytest.mark.slow
@many_routes
def test_warm_start_at_the_solution_costs_nothing(name):
    """A step begun at its own solution: no change of the contact set, no Newton step, no TAO
    iteration.

    (Hildreth counts sweeps; it is told the contact set, not the reactions.)
    """
    dt, steps = timing(name)
    problem = PROBLEMS[name](COMM)
    step = busiest_step(problem, dt, steps)
    for solver in (CONDENSED["active set"], *VOLUME.values()):
        prepared = solver.prepare(step.A, problem.surface, step.scale)
        first = prepared.solve(step)
        again = prepared.solve(replace(step, guess=first.x, active=first.active))
        assert again.iterations == 0, first.method
        assert np.array_equal(again.active, first.active)
        assert max_over_ranks(COMM, again.x - first.x) < 1e-13 * max_over_ranks(COMM, first.x)


@pytest.mark.serial
@pytest.mark.parametrize("solver", [Condensed(), Volume(method=ReducedNewton())])
def test_bilateral_points_by_both_routes(solver):
    """Held points: u_n = 0 all along, reactions of both signs, the same by every route."""
    problem = shaken_wall(COMM, angle=pi / 6.0)
    held = replace(problem, surface=problem.surface.bilateral_everywhere())
    found = run(held, dt=WALL_DT, steps=30, solver=solver)
    assert found.r_n.min() < 0.0 < found.r_n.max() and found.active.all()
    checked = cross_check(
        held, scheme=SCHEME, solvers=(solver, Condensed(Hildreth())), dt=WALL_DT, steps=30
    )
    assert checked.worst < 1e-9


@pytest.mark.serial
def test_stiff_springs_tend_to_the_rigid_wall():
    """Ground of 1e13 to 1e15 Pa/m under the shaken wall, without impact law: the distance to the
    rigid ground's motion falls as 1/k. (Points on springs have no impacts: the law is for rigid
    supports.)"""

    def motion(springs: float | None) -> Run:
        return run(replace(shaken_wall(COMM, springs=springs), impact=None), dt=WALL_DT, steps=24)

    rigid = motion(None)
    distance = [np.abs(motion(k).u - rigid.u).max() for k in (1e13, 1e14, 1e15)]
    assert rigid.active.any() and distance[0] < 1e-2 * np.abs(rigid.u).max()
    assert np.log10(distance[0] / distance[1]) == pytest.approx(1.0, abs=0.05)
    assert np.log10(distance[1] / distance[2]) == pytest.approx(1.0, abs=0.05)


# The same body, written differently
# -----------------------------------------------------------------------------------


@cache
def reference(name: str, *, alone: bool = False) -> Run:
    dt, steps = timing(name)
    return run(PROBLEMS[name](MPI.COMM_SELF if alone else COMM), dt=dt, steps=steps)


def same(found: Run, other: Run, *, u: Any = None, r_n: float = 1.0, digits: float = 1e-9) -> None:
    """Same contact sets; displacements and reactions equal after undoing the change of frame or
    unit."""
    seen = found.u if u is None else u(found.u)
    assert np.array_equal(found.active, other.active) and other.active.any()
    assert np.abs(seen - other.u).max() < digits * np.abs(other.u).max()
    assert np.abs(found.r_n / r_n - other.r_n).max() < digits * np.abs(other.r_n).max()
    assert max(found.certificate.max(), other.certificate.max()) < 1e-11


@pytest.mark.serial
@pytest.mark.parametrize("angle", [pi / 6.0, pi / 2.0, -2.0])
def test_turned_wall_moves_like_the_straight_one(angle):
    """Mesh, ground, contact directions and shaking turned together: the same motion, turned, to
    1e-9."""
    found = run(shaken_wall(COMM, angle=angle), dt=WALL_DT, steps=34)
    same(found, reference("quadrilaterals"), u=lambda u: turned(u, -angle))


@pytest.mark.serial
@pytest.mark.parametrize("simplices", [False, True])
def test_inclined_box_moves_like_the_level_one(simplices):
    """The same in three dimensions, with gravity and the throw turned about the z axis."""
    angle = 0.5
    level, inclined = (
        run(thrown_box(COMM, simplices=simplices, angle=a), dt=BOX_DT, steps=8)
        for a in (0.0, angle)
    )
    same(
        inclined,
        level,
        u=lambda u: np.concatenate([turned(u[..., :2], -angle), u[..., 2:]], axis=-1),
    )


@pytest.mark.serial  # many marches; that ranks do not matter is shown below
@pytest.mark.parametrize("metre", [1e3, 1e-3], ids=["mm", "km"])
@pytest.mark.parametrize("route", ["condensed", "reduced Newton", "TAO TRON"])
@pytest.mark.parametrize("name", ["turned wall", "soft springs"])
def test_the_unit_of_length_does_not_matter(name, route, metre):
    """Lengths, E, rho and acceleration in mm or km: the same motion to 1e-9, whatever solves the
    steps. No tolerance knows about metres."""
    settings = PROBLEMS[name].keywords
    solver = Condensed() if route == "condensed" else VOLUME[route]
    found = run(shaken_wall(COMM, metre=metre, **settings), dt=WALL_DT, steps=34, solver=solver)
    same(found, reference(name), u=lambda u: u / metre, r_n=metre)


@problems
def test_the_number_of_ranks_does_not_matter(name):
    """All ranks together and this rank alone: equal contact sets, displacements and reactions to
    1e-10."""
    same(reference(name), reference(name, alone=True), digits=1e-10)


@pytest.mark.serial
def test_listed_points_may_come_in_any_order():
    """The conditions are numbered as the points are listed; the motion is the same."""
    heights = [3.0, 6.0, 9.0]
    one, other = (
        run(shaken_wall(COMM, contacts=order), dt=WALL_DT, steps=34)
        for order in (heights, heights[::-1])
    )
    assert np.array_equal(one.active, other.active[:, ::-1]) and one.active.any()
    assert np.abs(one.u - other.u).max() < 1e-12 * np.abs(one.u).max()
    assert np.abs(one.r_n - other.r_n[:, ::-1]).max() < 1e-12 * one.r_n.max()
