"""Water pressure on faces against hydrostatics: forces, moments, sections, on any ranks."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fem_problems import CONCRETE, block, linear

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError

# N/m³, m; the upstream face leans by SLOPE
GAMMA, LEVEL, HEIGHT, BASE, SLOPE = (9810.0, 5.0, 6.0, 4.0, 0.2)


def water(points: Array, t: float) -> Array:
    return GAMMA * np.maximum(0.0, LEVEL - points[:, 1])


def uplift(points: Array, t: float) -> Array:
    return GAMMA * LEVEL * (1.0 - points[:, 0] / BASE)


def lean(points: Array) -> Array:
    return np.column_stack([points[:, 0] + SLOPE * points[:, 1], points[:, 1:]])


def dam(
    comm: Any, depth: float | None, simplices: bool, held: bool = True
) -> tuple[Any, Any, list[Any]]:
    """A leaning dam with nodes at the water level, under water on its left face and below its
    base."""
    lengths, divisions = (BASE, HEIGHT), (3, 6)
    if depth is not None:
        lengths, divisions = (*lengths, depth), (*divisions, 2)
    mesh, tags = block(comm, lengths=lengths, divisions=divisions, simplices=simplices, deform=lean)
    loads = [fem.Pressure(tags["left"], water), fem.Pressure(tags["bottom"], uplift)]
    return (
        fem.assemble(mesh, CONCRETE, clamped=tags["bottom"] if held else (), loads=loads),
        tags,
        loads,
    )


def water_above(y: float, x: float) -> tuple[float, float, float]:
    """Force to the right, upwards, and moment about (x, y) of the water above a level, for a dam 1
    m deep."""
    h = LEVEL - y
    force = 0.5 * GAMMA * h**2
    arm = h / 3.0  # of its resultant, normal to the face
    return force, -SLOPE * force, -force * arm - SLOPE * force * (SLOPE * (y + arm) - x)


@pytest.mark.parametrize("simplices", [False, True], ids=["boxes", "simplices"])
@pytest.mark.parametrize("depth", [None, 2.0], ids=["plane", "space"])
def test_resultants_are_those_of_hydrostatics(
    comm: Any, depth: float | None, simplices: bool
) -> None:
    """C1.1: force and moment on the foot, of water and of a linear uplift, to 1e-12 of the
    largest."""
    system, tags, loads = dam(comm, depth, simplices)
    problem = linear(system)
    state = vc.static_equilibrium(problem, solver=vc.Condensed())
    centre = (0.0, 0.0) if depth is None else (0.0, 0.0, 0.5 * depth)
    row = vc.Reactions("foot", tags["bottom"], centre, loads).start(problem, state)
    across, down, turning = water_above(0.0, 0.0)
    up = 0.5 * GAMMA * LEVEL * BASE
    wide = depth or 1.0
    moment = "reaction_M_foot" if depth is None else "reaction_M_z_foot"
    found = [row[name] for name in ("reaction_x_foot", "reaction_y_foot", moment)]
    expected = -wide * np.array([across, down + up, turning + up * BASE / 3.0])
    assert found == pytest.approx(expected, abs=1e-9 * abs(expected).max())


@pytest.mark.parametrize("simplices", [False, True], ids=["quadrilaterals", "triangles"])
def test_sections_through_elements_carry_the_water_above(comm: Any, simplices: bool) -> None:
    system, _, loads = dam(comm, None, simplices)
    problem = linear(system)
    state = vc.static_equilibrium(problem, solver=vc.Condensed())
    y = 3.3
    left = SLOPE * y
    row = vc.SectionForces({"a": ((left, y), (left + BASE, y))}, loads=loads).start(problem, state)
    across, up, turning = water_above(y, left + 0.5 * BASE)
    found = [row[f"{name}_a"] for name in ("V", "N", "M")]
    assert found == pytest.approx([across, up, turning], abs=1e-9 * abs(turning))


def test_a_pressure_may_change_with_time(comm: Any) -> None:
    """A number with a history, and a function of place and time: the resultants of a body that
    nothing holds."""
    mesh, tags = block(comm, lengths=(2.0, 3.0), divisions=(2, 3))
    for load, at_two in (
        (fem.Pressure(tags["left"], 700.0, lambda t: 3.0 * t), 700.0 * 6.0 * 3.0),
        (fem.Pressure(tags["left"], lambda points, t: t * points[:, 1]), 2.0 * 4.5),
    ):
        system = fem.assemble(mesh, CONCRETE, loads=load)
        force = comm.allreduce(system.influence.T @ system.load(2.0))
        assert force == pytest.approx([at_two, 0.0], abs=1e-12 * at_two)


def test_wrong_pressures_are_refused(comm: Any) -> None:
    mesh, tags = block(comm, lengths=(2.0, 3.0), divisions=(2, 3))
    with pytest.raises(InputError, match="Pressure: value is .*; give a finite number in Pa"):
        fem.Pressure(tags["left"], (1.0, 0.0))  # type: ignore[arg-type]
    with pytest.raises(
        InputError, match="Pressure at t = 0 s .*[Bb]roadcast|Pressure at t = 0 s .*more dimensions"
    ):
        fem.assemble(
            mesh, CONCRETE, loads=fem.Pressure(tags["left"], lambda points, t: points)
        ).load(0.0)
    with pytest.raises(InputError, match="give a boundary group"):
        fem.Pressure(tags["block"], 1.0)
