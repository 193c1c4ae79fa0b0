"""Static stages of soil that flows without dilatancy: they creep to equilibria that load steps
lose, beside published bounds, and say where a body gives way."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.errors import StepFailure
from vi_contact.core.surfaces import empty_surface
from vi_contact.laws import MohrCoulomb
from vi_contact.meshes.block import BlockMesh

SURCHARGE = 10e3
PHI = np.radians(20.0)


def find_surcharge_factor(tangent: float) -> float:
    """Reissner's N_q of a smooth or rough strip by the tangent of the angle of friction."""
    angle = np.arctan(tangent)
    return float(np.exp(np.pi * tangent) * np.tan(0.25 * np.pi + 0.5 * angle) ** 2)


def build_ground(comm: Any, degree: int, **more: Any) -> tuple[Any, Any]:
    """Half of the ground below a strip 2 m wide: sand of 20 degrees with psi = 0."""
    mesh, tags = fem.build_mesh(
        BlockMesh(lengths=(5.0, 2.5), divisions=(10, 5), simplices=degree == 2), comm
    )
    sand = MohrCoulomb(1e3 * SURCHARGE, 0.3, 2000.0, 0.0, 20.0, 0.0)
    below = fem.Facets.where("strip", mesh, lambda x: (x[1] > 2.5 - 1e-9) & (x[0] < 1.0 + 1e-9))
    beside = fem.Facets.where("beside", mesh, lambda x: (x[1] > 2.5 - 1e-9) & (x[0] > 1.0 - 1e-9))
    pushed = more.pop("pushed", 0.0)
    loads = [fem.Pressure(beside, SURCHARGE)]
    if pushed:
        loads.append(fem.Pressure(below, pushed * SURCHARGE))
    system = fem.assemble(
        mesh,
        sand,
        degree=degree,
        integration="full" if degree == 2 else "bbar",
        clamped=[tags["bottom"], tags["right"]],
        prescribed=fem.Prescribed(tags["left"], components=(0,)),
        initial_stress=lambda x: np.tile([-SURCHARGE] * 3 + [0.0], (len(x), 1)),
        loads=loads,
    )
    return below, system


@pytest.mark.serial
def test_triangles_without_dilatancy_reach_the_limit_load(comm: Any) -> None:
    """N_q of phi = 20° and psi = 0 by triangles of degree 2, which stopped at half of the way:
    more than Davis' (1968) reduced angle tan phi* = sin phi says, 5.731, and less than 6.918 of
    psi = phi on this mesh, which is 1.081 of Prandtl's 6.399. The load of the limit is level. A
    history that is gone on with equals the straight one to the last bit."""
    below, system = build_ground(comm, 2)
    stamp = vc.HalfSpace(point=(0.0, 2.5), normal=(0.0, -1.0))
    surface = fem.contact_surface(system, below, obstacle=stamp)
    problem = vc.ContactProblem(system, surface.moving(towards=lambda t: t))
    states = list(vc.quasi_static(problem, [0.02, 0.04, 0.06, 0.08]))
    assert len(states) == 4
    loads = []
    for state in states:
        assert state.certificate is not None and state.certificate <= 1e-9
        loads.append(float(surface.comm.sum(np.array([state.r_n.sum()]))[0]) / SURCHARGE)
    davis = find_surcharge_factor(np.sin(PHI))
    exact = find_surcharge_factor(np.tan(PHI))
    assert davis == pytest.approx(5.731, abs=1e-3)
    assert davis < min(loads) and max(loads) < 1.081 * exact
    assert max(loads) <= 1.04 * min(loads)
    (last,) = vc.quasi_static(problem, [0.08], state=states[2])
    assert np.array_equal(last.u, states[3].u)


def test_a_footing_that_gives_way_is_told_with_its_place(comm: Any) -> None:
    """A pressure of nine times the surcharge is more than soil of N_q = 6.4 bears: the viscous
    force does not fall, and the sentence says where the soil flows and what to do."""
    _, system = build_ground(comm, 1, pushed=9.0)
    problem = vc.ContactProblem(system, empty_surface(system.space.comm, 2))
    message = r"no equilibrium to which the body creeps; it yields most near \(.*\): .*psi nearer"
    with pytest.raises(StepFailure, match=message):
        vc.static_equilibrium(problem)


@pytest.mark.serial
@pytest.mark.parametrize("psi", [0.0, 30.0])
def test_the_limit_pressure_of_a_tube_of_soil(comm: Any, psi: float) -> None:
    """A tube from a = 1 m to b = 2 m of soil with 20 kPa and 30° bears Y/(N - 1) [(b/a)^((N - 1)/N)
    - 1] = 20348.169 Pa inside, N = (1 + sin phi)/(1 - sin phi), Y = 2 c cos phi/(1 - sin phi): all
    of it yields, and equilibrium alone says the stresses, for any dilatancy."""
    sine = np.sin(np.radians(30.0))
    N = (1.0 + sine) / (1.0 - sine)
    Y = 2.0 * 20e3 * np.cos(np.radians(30.0)) / (1.0 - sine)
    exact = Y / (N - 1.0) * (2.0 ** ((N - 1.0) / N) - 1.0)
    assert exact == pytest.approx(20348.169, rel=1e-7)

    def bend(x: np.ndarray) -> np.ndarray:
        r, angle = 2.0 ** x[:, 0], 0.5 * np.pi * x[:, 1]
        return np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1)

    mesh, tags = fem.build_mesh(BlockMesh(divisions=(3, 4), deform=bend), comm)

    def stand(pressure: float) -> vc.ContactProblem:
        system = fem.assemble(
            mesh,
            MohrCoulomb(50e6, 0.3, 2000.0, 20e3, 30.0, psi),
            degree=2,
            prescribed=[
                fem.Prescribed(tags["bottom"], components=(1,)),
                fem.Prescribed(tags["top"], components=(0,)),
            ],
            loads=fem.Pressure(tags["left"], pressure),
        )
        return vc.ContactProblem(system, empty_surface(system.space.comm, 2))

    push = stand(exact).system.load.at_rest(0.0) - stand(0.5 * exact).system.load.at_rest(0.0)
    found = vc.limit_load(stand(0.5 * exact), force=2.0 * push, first=0.3, rtol=0.02)
    assert found.multiplier + 0.5 == pytest.approx(1.0, abs=0.02)
    assert found.lost_at - found.multiplier <= 0.011
