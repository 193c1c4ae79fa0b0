"""Bodies that yield beside exact answers: a plastic wave in a slab that strikes a wall, a tube
under pressure, a punch on clay, a plate of soil under a press, earth pressure on a smooth wall."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.surfaces import empty_surface
from vi_contact.laws import J2, DruckerPrager, MohrCoulomb
from vi_contact.meshes.block import BlockMesh

pytestmark = pytest.mark.serial

# Slab between smooth sides: E -> K + 4G/3, E_t -> K + 4G/3 H/(3G + H), Y -> sy (K + 4G/3)/2G
METAL = J2(70e9, 0.33, 2700.0, 100e6, isotropic=2e9)
LENGTH, SPEED = 0.1, 15.0


def find_slab_answers() -> tuple[float, float, float, float]:
    """Stress behind the plastic front [Pa], contact time [s], rebound [m/s] and the speed of the
    front [m/s]: v_Y = Y/(rho c), |sigma| = Y + rho c_p (v0 - v_Y), 2 L/c, 2 v_Y + 2 k (v0 - v_Y)
    - v0 with k = c_p/c, for v_Y < v0 <= 2 v_Y."""
    K, G = METAL.bulk_modulus, METAL.shear_modulus
    whole = K + 4.0 * G / 3.0
    tangent = K + 4.0 * G / 3.0 * METAL.isotropic / (3.0 * G + METAL.isotropic)
    Y = METAL.yield_stress * whole / (2.0 * G)
    c, c_p = np.sqrt(whole / METAL.rho), np.sqrt(tangent / METAL.rho)
    v_Y = Y / (METAL.rho * c)
    assert v_Y < SPEED <= 2.0 * v_Y
    stress = Y + METAL.rho * c_p * (SPEED - v_Y)
    return stress, 2.0 * LENGTH / c, 2.0 * v_Y + 2.0 * c_p / c * (SPEED - v_Y) - SPEED, c_p


def strike(comm: Any, n: int) -> tuple[np.ndarray, float, float, float]:
    """Stresses [Pa] behind the front at 1e-5 s, contact time [s], rebound [m/s] and step [s]."""
    h = LENGTH / n
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(LENGTH, h), divisions=(n, 1)), comm)
    sides = [fem.Prescribed(tags[side], components=(1,)) for side in ("bottom", "top")]
    system = fem.assemble(
        mesh, METAL, integration="bbar", prescribed=sides, initial_velocity=(-SPEED, 0.0)
    )
    wall = vc.HalfSpace(point=(0.0, 0.0), normal=(1.0, 0.0))
    surface = fem.contact_surface(system, tags["left"], obstacle=wall)
    problem = vc.ContactProblem(system, surface, impact=vc.Inelastic())
    internal: Any = system.internal
    x = internal.places["material_0_"].mean(axis=1)[:, 0]
    dt = 0.5 * h / METAL.elastic.c_p
    stepper = vc.Stepper(problem, solver=vc.Condensed())
    stresses = np.zeros(0)
    closed = 0.0
    while stepper.state.t < 5e-5:
        trial = stepper.attempt(dt)
        assert trial.report.certificate.worst <= 1e-9
        stepper.accept(trial)
        if stepper.state.active.any():
            closed = stepper.state.t
        if not len(stresses) and stepper.state.t >= 1e-5:
            behind = x < 0.7 * find_slab_answers()[3] * stepper.state.t
            stresses = -stepper.state.memory["material_0_sigma"].mean(axis=1)[behind, 0]
    r = system.influence[:, 0]
    momentum = system.algebra.dot(system.M @ r, problem.cartesian(stepper.state.v))
    return stresses, closed, momentum / system.algebra.dot(system.M @ r, r), dt


@pytest.mark.long
def test_a_plastic_wave_in_a_slab(comm: Any) -> None:
    """Stress behind the front, contact time to a step, and a rebound that converges: the fronts are
    some cells wide, which takes a part of the impulse."""
    stress, time, rebound, _ = find_slab_answers()
    assert stress == pytest.approx(2.4122296e8, rel=1e-7)
    assert time == pytest.approx(3.2269388e-5, rel=1e-7)
    assert rebound == pytest.approx(13.830065, rel=1e-7)
    errors = []
    for n in (25, 50, 100):
        stresses, closed, speed, dt = strike(comm, n)
        assert stresses.mean() == pytest.approx(stress, rel=5e-3)
        assert np.abs(stresses / stress - 1.0).max() <= 0.035
        assert abs(closed - time) <= 1.5 * dt
        errors.append(abs(speed / rebound - 1.0))
    assert errors[0] > errors[1] > errors[2] and errors[0] > 1.4 * errors[2]
    assert errors[2] <= 0.14


@pytest.mark.parametrize("degree", [1, 2])
def test_a_tube_under_pressure(comm: Any, degree: int) -> None:
    """Tresca's tube that is plastic up to c = 1.5 of a = 1 to b = 2: p = 2 k [ln(c/a) + (1 -
    c²/b²)/2] opens it by u_b = 2 (1 - nu²) k c²/(E b); errors fall with the square of the cells."""
    k, c = 1e8, 1.5
    pressure = 2.0 * k * (np.log(c) + 0.5 * (1.0 - c**2 / 4.0))
    assert pressure == pytest.approx(1.2484302e8, rel=1e-7)
    opening = 2.0 * (1.0 - 0.3**2) * k * c**2 / (200e9 * 2.0)
    tresca = MohrCoulomb(200e9, 0.3, 7800.0, k, 0.0, 0.0)

    def bend(x: np.ndarray) -> np.ndarray:
        r, angle = 2.0 ** x[:, 0], 0.5 * np.pi * x[:, 1]
        return np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1)

    errors = []
    for n in (8, 16):
        mesh, tags = fem.build_mesh(BlockMesh(divisions=(n, n), deform=bend), comm)
        system = fem.assemble(
            mesh,
            tresca,
            degree=degree,
            integration="full" if degree == 2 else "bbar",
            prescribed=[
                fem.Prescribed(tags["bottom"], components=(1,)),
                fem.Prescribed(tags["top"], components=(0,)),
            ],
            loads=fem.Pressure(tags["left"], pressure),
        )
        problem = vc.ContactProblem(system, empty_surface(system.space.comm, 2))
        state = vc.static_equilibrium(problem)
        space: Any = system.space
        nodal = space.expand(state.u, 0.0)
        size = np.linalg.norm(space.points, axis=1)
        outer = np.abs(size - 2.0) < 1e-9
        moved = np.sum(nodal[outer] * space.points[outer], axis=1) / 2.0
        errors.append(np.abs(moved / opening - 1.0).max())
    assert errors[1] <= (0.0036 if degree == 2 else 0.0094)
    assert errors[0] >= 2.5 * errors[1]


def punch(comm: Any, law: Any, n: int, depths: Any, degree: int = 1) -> list[float]:
    """Loads [N/m] of half a smooth strip 2 m wide that is pressed into ground by exact contact."""
    mesh, tags = fem.build_mesh(
        BlockMesh(lengths=(5.0, 2.5), divisions=(5 * n, 5 * n // 2), simplices=degree == 2),
        comm,
    )
    below = fem.Facets.where("strip", mesh, lambda x: (x[1] > 2.5 - 1e-9) & (x[0] < 1.0 + 1e-9))
    system = fem.assemble(
        mesh,
        law,
        degree=degree,
        integration="full" if degree == 2 else "bbar",
        clamped=[tags["bottom"], tags["right"]],
        prescribed=fem.Prescribed(tags["left"], components=(0,)),
    )
    stamp = vc.HalfSpace(point=(0.0, 2.5), normal=(0.0, -1.0))
    surface = fem.contact_surface(system, below, obstacle=stamp)
    problem = vc.ContactProblem(system, surface.moving(towards=lambda t: t))
    return [float(state.r_n.sum()) for state in vc.quasi_static(problem, depths)]


@pytest.mark.long
def test_prandtls_punch(comm: Any) -> None:
    """Clay of the strength c carries (2 + pi) c: from above, and falling with the mesh; the half
    element beside the strip counts. The load no longer grows."""
    c = 1e3
    clay = J2(1e6, 0.3, 2000.0, np.sqrt(3.0) * c)
    depths = np.linspace(0.0, 0.08, 13)[1:]
    exact = (2.0 + np.pi) * c
    found = {n: punch(comm, clay, n, depths) for n in (4, 8)}
    for n, most in ((4, 1.09), (8, 1.05)):
        assert 1.0 < found[n][-1] / exact < most
        assert found[n][-1] / found[n][-3] - 1.0 <= 1e-3
    assert found[8][-1] < found[4][-1]
    flat = punch(comm, clay, 4, depths, degree=2)
    assert 1.0 < flat[-1] / exact < 1.07


@pytest.mark.slow
def test_a_punch_on_soil_with_friction(comm: Any) -> None:
    """phi = psi = 20 degrees without weight: N_c = 14.8347, from above on a coarse mesh."""
    soil = MohrCoulomb(1e6, 0.3, 2000.0, 1e3, 20.0, 20.0)
    found = punch(comm, soil, 4, np.linspace(0.0, 0.12, 13)[1:])
    assert 1.0 < found[-1] / 14.83471178e3 < 1.3


@pytest.mark.parametrize("law", [MohrCoulomb, DruckerPrager])
def test_a_plate_of_soil_under_a_press(comm: Any, law: Any) -> None:
    """K_p sigma_3 + 2 c √K_p = 184641.016 Pa in plane strain, by the reactions of exact contact."""
    cell = 50e3
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 2.0), divisions=(2, 4)), comm)
    system = fem.assemble(
        mesh,
        law(1e8, 0.3, 2000.0, 10e3, 30.0, 10.0),
        integration="bbar",
        initial_stress=lambda x: np.tile([-cell, -cell, -cell, 0.0], (len(x), 1)),
        prescribed=[
            fem.Prescribed(tags["bottom"], components=(1,)),
            fem.Prescribed(tags["left"], components=(0,)),
        ],
        loads=fem.Pressure(tags["right"], cell),
    )
    press = vc.HalfSpace(point=(0.0, 2.0), normal=(0.0, -1.0))
    surface = fem.contact_surface(system, tags["top"], obstacle=press)
    problem = vc.ContactProblem(system, surface.moving(towards=lambda t: t))
    deep = 0.008 if law is MohrCoulomb else 0.03
    for state in vc.quasi_static(problem, np.linspace(0.0, deep, 7)[1:]):
        assert state.certificate is not None and state.certificate <= 1e-9
    exact = 184641.016151
    assert state.r_n.sum() == pytest.approx(exact, rel=1e-8 if law is MohrCoulomb else 2e-4)


@pytest.mark.parametrize(("side", "exact"), [("active", 75e3), ("passive", 675e3)])
def test_earth_pressure_on_a_smooth_wall(comm: Any, side: str, exact: float) -> None:
    """Sand of 30 degrees, 5 m high, stands between smooth walls and yields; one wall goes away, or
    towards it, by exact contact: gamma H²/2 times K0 = nu/(1 - nu), Ka = 1/3 or Kp = 3. The stress
    is linear over the depth, so that any mesh has the resultant."""
    gamma, H = 18e3, 5.0
    sand = MohrCoulomb(50e6, 0.3, gamma / 9.81, 0.0, 30.0, 30.0)
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(2.5, H), divisions=(5, 10)), comm)
    system = fem.assemble(
        mesh,
        sand,
        integration="bbar",
        prescribed=[
            fem.Prescribed(tags["bottom"], components=(1,)),
            fem.Prescribed(tags["left"], components=(0,)),
        ],
        loads=fem.BodyForce((0.0, -gamma)),
    )
    wall = vc.HalfSpace(point=(2.5, 0.0), normal=(-1.0, 0.0))
    surface = fem.contact_surface(system, tags["right"], obstacle=wall)
    way = -2e-3 if side == "active" else 2e-2
    problem = vc.ContactProblem(
        system, surface.moving(towards=lambda t: way * min(max(t - 1.0, 0.0), 1.0))
    )
    times = [0.5, 1.0, *np.linspace(1.0, 2.0, 9)[1:]]
    for state in vc.quasi_static(problem, times):
        assert state.certificate is not None and state.certificate <= 1e-9
        if state.t == 1.0:
            at_rest = 0.3 / 0.7 * 0.5 * gamma * H**2
            assert state.r_n.sum() == pytest.approx(at_rest, rel=1e-6)
    assert state.r_n.sum() == pytest.approx(exact, rel=1e-6)
