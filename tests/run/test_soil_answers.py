"""Soil with friction beside published answers: bearing capacity of a surcharge, earth pressure with
cohesion and with friction of the wall, an infinite slope."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.surfaces import empty_surface
from vi_contact.laws import MohrCoulomb
from vi_contact.meshes.block import BlockMesh
from vi_contact.practice import studies
from vi_contact.practice.engineering.checks.earth_pressure_static import wedge

pytestmark = pytest.mark.serial


def press_beside_a_surcharge(comm: Any, n: int, depths: Any) -> float:
    """Mean pressure below a smooth stiff strip over the surcharge beside it: half a strip 2 m wide
    on soil of 20 degrees without cohesion and weight, triangles of degree 2."""
    q = 10e3
    sand = MohrCoulomb(1e3 * q, 0.3, 2000.0, 0.0, 20.0, 20.0)
    mesh, tags = fem.build_mesh(
        BlockMesh(lengths=(5.0, 2.5), divisions=(5 * n, 5 * n // 2), simplices=True), comm
    )
    below = fem.Facets.where("strip", mesh, lambda x: (x[1] > 2.5 - 1e-9) & (x[0] < 1.0 + 1e-9))
    beside = fem.Facets.where("beside", mesh, lambda x: (x[1] > 2.5 - 1e-9) & (x[0] > 1.0 - 1e-9))
    system = fem.assemble(
        mesh,
        sand,
        degree=2,
        clamped=[tags["bottom"], tags["right"]],
        prescribed=fem.Prescribed(tags["left"], components=(0,)),
        initial_stress=lambda x: np.tile([-q, -q, -q, 0.0], (len(x), 1)),
        loads=fem.Pressure(beside, q),
    )
    stamp = vc.HalfSpace(point=(0.0, 2.5), normal=(0.0, -1.0))
    surface = fem.contact_surface(system, below, obstacle=stamp)
    problem = vc.ContactProblem(system, surface.moving(towards=lambda t: t))
    for state in vc.quasi_static(problem, depths):
        assert state.certificate is not None and state.certificate <= 1e-9
    return float(state.r_n.sum()) / q


def test_bearing_capacity_of_a_surcharge(comm: Any) -> None:
    """Reissner's N_q = e^(pi tan phi) tan²(45° + phi/2) = 6.39939352 with psi = phi = 20°. Three
    meshes, from above: 1.081, 1.042 and 1.022 of it. The excess halves with the cells, as half a
    cell beside the strip bears too."""
    tangent = np.tan(np.radians(20.0))
    exact = np.exp(np.pi * tangent) * np.tan(np.radians(55.0)) ** 2
    assert exact == pytest.approx(6.39939352, rel=1e-8)
    ratios = [press_beside_a_surcharge(comm, n, [0.03]) / exact for n in (2, 4, 8)]
    excess = [ratio - 1.0 for ratio in ratios]
    assert excess[0] > 1.7 * excess[1] > 1.7**2 * excess[2]
    assert 0.0 < excess[2] <= 0.03


def move_wall(
    comm: Any, soil: MohrCoulomb, *, height: float, way: float, surcharge: float
) -> float:
    """Thrust [N/m] on a smooth wall that goes by ``way`` towards soil between smooth walls."""
    gamma = 9.81 * soil.rho
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(2.0, height), divisions=(4, 8)), comm)
    loads: list[Any] = [fem.BodyForce((0.0, -gamma))]
    if surcharge:
        loads.append(fem.Pressure(tags["top"], surcharge))
    system = fem.assemble(
        mesh,
        soil,
        integration="bbar",
        prescribed=[
            fem.Prescribed(tags["bottom"], components=(1,)),
            fem.Prescribed(tags["left"], components=(0,)),
        ],
        loads=loads,
    )
    wall = vc.HalfSpace(point=(2.0, 0.0), normal=(-1.0, 0.0))
    surface = fem.contact_surface(system, tags["right"], obstacle=wall)
    problem = vc.ContactProblem(
        system, surface.moving(towards=lambda t: way * min(max(t - 1.0, 0.0), 1.0))
    )
    for state in vc.quasi_static(problem, [1.0, *np.linspace(1.0, 2.0, 7)[1:]]):
        assert state.certificate is not None and state.certificate <= 1e-9
    return float(state.r_n.sum())


COHESIVE = MohrCoulomb(50e6, 0.35, 19e3 / 9.81, 5e3, 25.0, 25.0)


@pytest.mark.parametrize(
    ("way", "exact"), [(-4e-3, 68676.366), (2e-2, 634415.2)], ids=["active", "passive"]
)
def test_cohesive_soil_with_a_surcharge_on_a_smooth_wall(
    comm: Any, way: float, exact: float
) -> None:
    """25 degrees, 5 kPa, 19 kN/m³, 4 m high below 20 kPa: K (gamma H²/2 + q H) -+ 2 c √K H. The
    stress is linear over the depth, so that any mesh has the resultant."""
    found = move_wall(comm, COHESIVE, height=4.0, way=way, surcharge=20e3)
    assert found == pytest.approx(exact, rel=1e-6)


def test_cohesive_soil_that_leaves_the_top_of_a_smooth_wall(comm: Any) -> None:
    """Without the surcharge the soil would pull at the top of the wall, which contact does not: the
    thrust is between Ka gamma H²/2 - 2 c √Ka H, which counts that pull, and 2 c²/gamma more, which
    leaves it out down to the depth of no stress."""
    found = move_wall(comm, COHESIVE, height=4.0, way=-4e-3, surcharge=0.0)
    assert 36207.684 * (1.0 - 1e-6) <= found <= 38839.263 * (1.0 + 1e-6)


def rub_on_wall(comm: Any, n: int, way: float, length: float) -> float:
    """Normal thrust over gamma H²/2 on a wall of the friction 15°, which goes towards sand of 30°
    on a rough base; triangles of degree 2."""
    gamma, height = 18e3, 5.0
    h = height / n
    sand = MohrCoulomb(50e6, 0.3, gamma / 9.81, 0.0, 30.0, 30.0)
    mesh, tags = fem.build_mesh(
        BlockMesh(lengths=(length, height), divisions=(round(length / h), n), simplices=True), comm
    )

    def find_base(x: np.ndarray) -> np.ndarray:
        return (x[1] < 1e-9) & (x[0] < length - h + 1e-9)

    def find_toe(x: np.ndarray) -> np.ndarray:
        return (x[1] < 1e-9) & (x[0] > length - h - 1e-9)

    system = fem.assemble(
        mesh,
        sand,
        degree=2,
        clamped=fem.Facets.where("base", mesh, find_base),
        prescribed=[
            fem.Prescribed(fem.Facets.where("toe", mesh, find_toe), components=(1,)),
            fem.Prescribed(tags["left"], components=(0,)),
        ],
        loads=fem.BodyForce((0.0, -gamma)),
    )
    wall = vc.HalfSpace(point=(length, 0.0), normal=(-1.0, 0.0))
    surface = fem.contact_surface(system, tags["right"], obstacle=wall)
    problem = vc.ContactProblem(
        system,
        surface.moving(towards=lambda t: way * min(max(t - 1.0, 0.0), 1.0)),
        friction=vc.Coulomb(np.tan(np.radians(15.0))),
    )
    for state in vc.quasi_static(problem, [0.5, 1.0, *np.linspace(1.0, 2.0, 7)[1:]]):
        assert state.certificate is not None and state.certificate <= 1e-9
    return float(state.r_n.sum()) / (0.5 * gamma * height**2)


def find_lower_bound(passive: bool) -> float:
    """Normal coefficient of a stress field in equilibrium, phi 30° and delta 15°: Lancellotta,
    Géotechnique 52 (2002) 617-619, with its sign for active pressure."""
    sign = 1.0 if passive else -1.0
    phi, delta = np.radians(30.0), np.radians(15.0)
    s = np.sin(delta) / np.sin(phi)
    turn = np.arcsin(s) + sign * delta
    root = np.sqrt(np.sin(phi) ** 2 - np.sin(delta) ** 2)
    first = np.cos(delta) / (1.0 - sign * np.sin(phi)) * (np.cos(delta) + sign * root)
    return float(first * np.exp(sign * turn * np.tan(phi)))


def test_active_pressure_with_friction(comm: Any) -> None:
    """Beside Coulomb's wedge, K cos(delta) = 0.2911, and the stress field, 0.2944: found 0.2929
    at a way of H/2000. It falls on with the way, as the cell at the toe is drawn out: by 3 % at
    H/500."""
    phi, delta = np.radians(30.0), np.radians(15.0)
    plane = wedge(phi, delta, 0.0, 0.0) * np.cos(delta)
    found = rub_on_wall(comm, 10, -2.5e-3, 5.0)
    assert plane < find_lower_bound(passive=False) < 0.2945
    assert found == pytest.approx(plane, rel=0.02)


def test_passive_pressure_with_friction(comm: Any) -> None:
    """Between the stress field, 4.288, and Coulomb's plane wedge, 4.807, which is known to be too
    large: surfaces that are curved slide at less."""
    phi, delta = np.radians(30.0), np.radians(15.0)
    plane = wedge(phi, delta, 0.0, 0.0, passive=True) * np.cos(delta)
    found = rub_on_wall(comm, 5, 6e-2, 15.0)
    assert find_lower_bound(passive=True) == pytest.approx(4.2876, rel=1e-3)
    assert find_lower_bound(passive=True) < found < 0.97 * plane


def stand_on_a_slope(comm: Any, psi: float) -> vc.ContactProblem:
    """A column of 4 m across a slope of 25°, whose sides move alike: sand of 30°."""
    angle, gamma = np.radians(25.0), 19e3
    sand = MohrCoulomb(50e6, 0.3, gamma / 9.81, 0.0, 30.0, psi)
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(0.5, 4.0), divisions=(1, 8)), comm)
    system = fem.assemble(
        mesh,
        sand,
        integration="bbar",
        clamped=tags["bottom"],
        tied=fem.Tied(tags["left"], tags["right"]),
        loads=fem.BodyForce((gamma * np.sin(angle), -gamma * np.cos(angle))),
    )
    return vc.ContactProblem(system, empty_surface(system.space.comm, 2))


def test_the_factor_of_an_infinite_slope(comm: Any) -> None:
    """tan phi/tan beta = 1.23813165 with psi = phi, within the last interval of the search."""
    exact = np.tan(np.radians(30.0)) / np.tan(np.radians(25.0))
    assert exact == pytest.approx(1.23813165, rel=1e-8)
    found = studies.strength_reduction(stand_on_a_slope(comm, 30.0), tolerance=0.005)
    assert found.factor <= exact * (1.0 + 1e-6)
    assert found.failed >= exact * (1.0 - 1e-6)
    assert found.failed <= 1.005 * found.factor * (1.0 + 1e-6)


def test_the_factor_of_an_infinite_slope_without_dilatancy(comm: Any) -> None:
    """Soil in simple shear with psi = 0 mobilises between sin phi (Davis 1968, all of it yields
    with coaxial flow) and tan phi: the factor is between 1.0723 and 1.2381."""
    tangent = np.tan(np.radians(25.0))
    found = studies.strength_reduction(stand_on_a_slope(comm, 0.0), tolerance=0.02)
    assert np.sin(np.radians(30.0)) / tangent < found.failed
    assert found.factor < np.tan(np.radians(30.0)) / tangent


def test_the_yield_acceleration_of_an_infinite_slope(comm: Any) -> None:
    """tan(phi - beta) = 0.08748866 of gravity downhill, within the last interval."""
    angle = np.radians(25.0)
    exact = np.tan(np.radians(5.0))
    problem = stand_on_a_slope(comm, 30.0)
    way = (9.81 * np.cos(angle), 9.81 * np.sin(angle))
    found = vc.limit_load(problem, force=way, first=0.05, rtol=0.02)
    assert found.multiplier <= exact * (1.0 + 1e-6)
    assert found.lost_at >= exact * (1.0 - 1e-6)
