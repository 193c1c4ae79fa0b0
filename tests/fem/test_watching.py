"""Nodes of a contact boundary that are prescribed in every component: their gaps, and motions that
are refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.meshes import BlockMesh, TwoBlocks

COMM = MPI.COMM_WORLD
MATERIAL = vc.LinearElastic(E=1e9, nu=0.3, rho=2000.0)
GROUND = vc.HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))


def moved(x: Any, t: float, speed: float) -> Any:
    """A displacement along y that grows with time."""
    return np.tile((0.0, speed * t), (len(x), 1))


def block(prescribed: Any, **data: Any) -> vc.ContactProblem:
    """A block on the ground."""
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(2.0, 1.0), divisions=(8, 4)), COMM)
    system = fem.assemble(mesh, MATERIAL, prescribed=[one(tags) for one in prescribed], **data)
    return vc.ContactProblem(system, fem.contact_surface(system, tags["bottom"], obstacle=GROUND))


def lowered(speed: float) -> Any:
    """The left side moves along y at this speed [m/s]."""
    return lambda tags: fem.Prescribed(
        tags["left"],
        lambda x, t: moved(x, t, speed),
        lambda x, t: np.tile((0.0, speed), (len(x), 1)),
    )


def test_a_side_that_is_pushed_into_the_ground_is_refused():
    problem = block([lambda tags: fem.Prescribed(tags["left"], (0.0, -1e-3))])
    with pytest.raises(
        InputError, match=r"node \(0, 0\) of 'bottom' .* 0\.001 m into its obstacle at t = 0 s"
    ):
        vc.static_equilibrium(problem)


@pytest.mark.parametrize("many", [False, True])
def test_a_side_that_moves_into_the_ground_is_refused_in_time(many):
    problem = block([lowered(-0.05)])
    with pytest.raises(
        InputError, match=r"\(0, 0\) of 'bottom' .* 5e-05 m into its obstacle at t = 0\.001 s"
    ):
        if many:
            for _, found in vc.march_many([problem, problem], dt=1e-3, steps=3):
                if isinstance(found, Exception):
                    raise found
        else:
            list(vc.march(problem, dt=1e-3, steps=3))


def test_load_steps_are_refused_when_the_side_arrives():
    problem = block([lowered(-0.05), lambda tags: fem.Prescribed(tags["right"], (0.0, 0.0))])
    states = vc.quasi_static(problem, [0.0, 0.01])
    next(states)
    with pytest.raises(InputError, match=r"at t = 0\.01 s"):
        next(states)


def test_the_gap_of_a_prescribed_node_is_the_smallest():
    mesh, tags = fem.build_mesh(
        BlockMesh(lengths=(2.0, 1.0), divisions=(8, 4), corner=(0.0, 0.1)), COMM
    )
    down = fem.Prescribed(
        tags["left"], lambda x, t: moved(x, t, -5.0), lambda x, t: moved(x, 1.0, -5.0)
    )
    system = fem.assemble(mesh, MATERIAL, prescribed=[down])
    problem = vc.ContactProblem(
        system, fem.contact_surface(system, tags["bottom"], obstacle=GROUND)
    )
    solution = vc.simulate(problem, dt=1e-3, steps=5, record=[vc.Contact()], progress=False)
    smallest = solution.history["contact_min_gap"]
    assert smallest == pytest.approx(0.1 - 5.0 * solution.history["t"], abs=1e-12)
    assert (
        COMM.bcast(solution.history["gap"][-1].min() if COMM.rank == 0 else None)
        > smallest[-1] + 1e-6
    )


def test_a_node_may_be_prescribed_at_right_angles_to_its_contact_direction():
    problem = block(
        [lambda tags: fem.Prescribed(tags["left"], (0.01, 0.0), components=(0,))],
        loads=fem.BodyForce((0.0, -1e4)),
    )
    state = vc.static_equilibrium(problem)
    surface = problem.surface
    assert surface.total == 9
    assert surface.everywhere(state.r_n).sum() == pytest.approx(2e4)
    assert surface.everywhere(surface.gap(0.0) - surface.normal_values(state.u)).min() >= -1e-15


def test_a_node_that_is_prescribed_along_its_contact_direction_only_is_refused():
    down = fem.Prescribed
    with pytest.raises(InputError, match="also prescribed along its contact direction"):
        block([lambda tags: down(tags["left"], lambda x, t: moved(x, 1.0, -1e-3), components=(1,))])


@pytest.mark.parametrize("mortar", [False, True])
def test_two_prescribed_bodies_are_refused_where_they_meet(mortar):
    """The left sides of both bodies are prescribed: they may move together, and not into each
    other."""
    one = BlockMesh(lengths=(1.0, 1.0), divisions=(3, 3))
    mesh, tags = fem.build_mesh(TwoBlocks(upper=one, lower=one), COMM)

    def problem(upper: float, lower: float) -> vc.ContactProblem:
        sides = [
            fem.Prescribed(tags["upper_left"], (0.0, upper)),
            fem.Prescribed(tags["lower_left"], (0.0, lower)),
        ]
        system = fem.assemble(mesh, MATERIAL, prescribed=sides)
        matching = fem.DualMortar() if mortar else None
        return vc.ContactProblem(
            system,
            fem.contact_pair(system, tags["upper_bottom"], tags["lower_top"], matching=matching),
        )

    if not mortar:
        state = vc.static_equilibrium(problem(-1e-3, -1e-3))
        assert np.all(np.isfinite(state.u))
        with pytest.raises(
            InputError, match=r"of 'upper_bottom' .* 0\.002 m into 'lower_top' at t = 0 s"
        ):
            vc.static_equilibrium(problem(-1e-3, 1e-3))
    else:
        assert problem(-1e-3, -1e-3).surface.censuses[0].places["prescribed"].tolist() == [
            [0.0, 1.0]
        ]


def test_a_side_that_the_obstacle_follows_is_not_refused():
    """The ground sinks as fast as the side: gap and reaction stay zero there."""
    problem = block([lowered(-0.05)])
    surface = problem.surface.moving(towards=lambda t: -0.05 * t)
    sinking = vc.ContactProblem(problem.system, surface)
    assert len(list(vc.march(sinking, dt=1e-3, steps=3))) == 3
    rising = vc.ContactProblem(problem.system, problem.surface.moving(towards=lambda t: 0.01 * t))
    with pytest.raises(InputError, match=r"6e-05 m into its obstacle at t = 0\.001 s"):
        list(vc.march(rising, dt=1e-3, steps=3))
