"""Body forces on a part of a body, and prescribed motions with a history."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fem_problems import BODIES, CONCRETE, block, linear, resultant
from two_bodies import LENGTHS, blocks, two_blocks

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.errors import InputError


@pytest.mark.parametrize("simplices", [True, False])
@pytest.mark.parametrize("d", [2, 3])
def test_a_body_force_acts_on_its_cells_alone(comm: Any, d: int, simplices: bool) -> None:
    """The force on one of two bodies is f times its volume, at its middle; nothing acts on the
    other."""
    value = np.array([3.0, -2.0, 5.0])[:d]
    given: list[Any] = []

    def loads(tags: Any) -> Any:
        given.append(fem.BodyForce(tuple(value), cells=tags["upper"]))
        return given

    system, tags = two_blocks(comm, blocks(d, simplices=simplices), loads=loads)
    force = system.load(0.0)
    volume = float(np.prod(LENGTHS[:d]))
    assert resultant(system, force) == pytest.approx(volume * value, rel=1e-12)
    upper = np.isin(system.space.bodies, fem.bodies_of(system, tags["upper"]))
    assert not force[~upper].any()
    centre = 0.5 * np.array(LENGTHS[:d]) + np.eye(d)[1] * LENGTHS[1]
    arm = np.sum(force * (system.influence @ value) * system.space.coordinates[:, 1])
    assert comm.allreduce(arm) == pytest.approx(centre[1] * volume * value @ value, rel=1e-12)


def test_a_cut_through_cells_feels_their_force(comm: Any) -> None:
    """A column that is held at its foot and weighs in its upper half alone: N = -f A h above a cut
    in the middle of a cell, below the loaded part, and in it."""
    mesh, tags = block(comm, lengths=(0.5, 4.0), divisions=(2, 8))
    upper = fem.Cells.where("upper", mesh, lambda x: x[1] > 2.0 - 1e-9)
    load = fem.BodyForce((0.0, -1.0e4), cells=upper)
    system = fem.assemble(mesh, CONCRETE, clamped=tags["bottom"], loads=load)
    state = vc.static_equilibrium(linear(system))
    cuts = {name: ((0.0, y), (0.5, y)) for name, y in (("low", 0.7), ("high", 2.7))}
    row = vc.SectionForces(cuts, loads=load).start(linear(system), state)
    assert row["N_low"] == pytest.approx(-0.5 * 2.0 * 1.0e4, rel=1e-10)
    assert row["N_high"] == pytest.approx(-0.5 * 1.3 * 1.0e4, rel=1e-10)
    foot = vc.Reactions("foot", tags["bottom"], (0.25, 0.0), loads=load).start(
        linear(system), state
    )
    assert foot["reaction_y_foot"] == pytest.approx(1.0e4, rel=1e-10)


def test_groups_of_body_forces_are_checked(comm: Any) -> None:
    mesh, tags = block(comm, **BODIES["quadrilaterals"])
    other, _ = block(comm, **BODIES["triangles"])
    elsewhere = fem.Cells.where("all", other, lambda x: x[0] > -9.0)
    nothing = fem.Cells("nothing", np.zeros(0, dtype=np.int32), mesh)
    for cells, words in (
        (elsewhere, "is the cell group 'all' of another mesh"),
        (nothing, "the cell group 'nothing' of loads has no cells"),
    ):
        with pytest.raises(InputError, match=words):
            fem.assemble(mesh, CONCRETE, loads=fem.BodyForce((0.0, 1.0), cells=cells))
    with pytest.raises(InputError, match="BodyForce: cells is the boundary group 'top'"):
        fem.BodyForce((0.0, 1.0), cells=tags["top"])


def stretched(comm: Any, **motion: Any) -> Any:
    """A bar (plane stress, nu = 0) whose right end is moved."""
    mesh, tags = block(comm, lengths=(2.0, 1.0), divisions=(4, 2))
    material = vc.LinearElastic(E=3.0e9, nu=0.0, rho=2000.0)
    right = fem.Prescribed(tags["right"], **motion)
    return linear(fem.assemble(mesh, material, clamped=tags["left"], prescribed=right))


def test_a_history_scales_a_prescribed_displacement(comm: Any) -> None:
    """u_x = f(t) U x / L in every load step, as with a function of the time."""
    problem = stretched(comm, displacement=(2e-3, 0.0), history=lambda t: t**2)
    twin = stretched(comm, displacement=lambda x, t: np.tile([2e-3 * t**2, 0.0], (len(x), 1)))
    field = stretched(
        comm,
        displacement=lambda x, t: np.column_stack([1e-3 * x[:, 0], 0.0 * x[:, 0]]),
        history=lambda t: t**2,
    )
    times = [0.5, 1.0, 3.0]
    space = problem.system.space
    wanted = 1e-3 * space.coordinates[:, 0] * problem.system.influence[:, 0]
    for one in (problem, twin, field):
        for t, state in zip(times, vc.quasi_static(one, times), strict=True):
            assert np.allclose(state.u, t**2 * wanted, rtol=0.0, atol=1e-12 * t**2)


def test_three_histories_are_a_motion_with_its_rates(comm: Any) -> None:
    """(f, f', f'') gives the run of three functions of points and time, to the last bit."""
    a, w = 1e-4, 900.0
    rates = (
        lambda t: np.sin(w * t),
        lambda t: w * np.cos(w * t),
        lambda t: -(w**2) * np.sin(w * t),
    )

    def field(rate: Any) -> Any:
        return lambda x, t: rate(t) * np.tile([a, 0.0], (len(x), 1))

    names = ("displacement", "velocity", "acceleration")
    one = stretched(comm, displacement=(a, 0.0), history=rates)
    two = stretched(comm, **{name: field(rate) for name, rate in zip(names, rates, strict=True)})
    ends = [vc.simulate(problem, dt=1e-4, steps=20, progress=False).state for problem in (one, two)]
    assert np.array_equal(ends[0].u, ends[1].u) and np.array_equal(ends[0].v, ends[1].v)
    assert comm.allreduce(float(np.abs(ends[0].u).max(initial=0.0)), op=max) > 0.1 * a


def test_histories_that_cannot_be_meant_are_refused(comm: Any) -> None:
    mesh, tags = block(comm, **BODIES["quadrilaterals"])

    def f(t: float) -> float:
        return t

    for given, words in (
        ({"history": f}, "history is a factor of the displacement, which is left out"),
        ({"displacement": (0.0, 1.0), "history": (f, f)}, "history has 2 members; give a function"),
        ({"displacement": (0.0, 1.0), "history": 3.0}, "Prescribed: history is 3"),
        ({"displacement": (0.0, 1.0), "history": (f, 1.0, f)}, "Prescribed: history is 1"),
        (
            {"displacement": (0.0, 1.0), "velocity": (0.0, 1.0), "history": f},
            "a history, and a velocity or an acceleration of its own",
        ),
    ):
        with pytest.raises(InputError, match=words):
            fem.Prescribed(tags["top"], **given)
    moved = fem.Prescribed(tags["top"], (0.0, 1e-3), history=lambda t: "a")  # type: ignore
    with pytest.raises(InputError, match="prescribed motion on 'top' at t = "):
        list(vc.quasi_static(linear(fem.assemble(mesh, CONCRETE, prescribed=moved)), [1.0]))
    same = [fem.Prescribed(tags["top"], (0.0, 1e-3), history=f) for _ in range(2)]
    assert same[0].same_motion(same[1])
    assert not same[0].same_motion(fem.Prescribed(tags["top"], (0.0, 2e-3), history=f))
