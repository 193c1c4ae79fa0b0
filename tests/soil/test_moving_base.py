"""A moved base and the frame of the ground are the same discrete problem: both base inputs of
seismic practice."""

from __future__ import annotations

import logging
import math
from typing import Any

import numpy as np
import pytest
from gathered import gathered
from soil import SOIL

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import TwoBlocks
from vi_contact.practice.soil.moving_base import base_motion
from vi_contact.run.march import march

WAVES = (vc.Ricker(6.0, 8.0), vc.Ricker(4.0, 11.0, direction=(0.0, 1.0)))
DT = 2e-3
SCHEMES: dict[str, Any] = {
    "trapezoidal": vc.Trapezoidal(),
    "zwt": vc.ZienkiewiczWoodTaylor(),
    "zwt damped": vc.ZienkiewiczWoodTaylor(phi=0.7),
    "newmark": vc.Newmark(),
    "newmark damped": vc.Newmark(beta=0.3025, gamma=0.6),
    "ss22": vc.SS22(0.5, 0.5),
    "midpoint": vc.Midpoint(),
    "hht": vc.HHT(-0.1),
    "generalised-alpha": vc.GeneralisedAlpha.spectral_radius(0.8),
    "houbolt": vc.Houbolt(),
    "multistep": vc.LinearMultistep.newmark(0.25, 0.5),
}


@pytest.mark.serial
def test_the_base_is_integrated_as_the_schemes_do():
    """Trapezoidal rule, twice; Zienkiewicz-Wood-Taylor with the acceleration in the middle of the
    step."""
    shake = vc.Harmonic(2.0, 1.5, phase=0.4, direction=(1.0, -0.5))
    t = DT * np.arange(40)
    a = np.array([shake.acceleration(s) for s in t])
    middle = np.array([shake.acceleration(s + 0.5 * DT) for s in t])
    for scheme, mean in (
        (vc.Trapezoidal(), 0.5 * (a[:-1] + a[1:])),
        (vc.ZienkiewiczWoodTaylor(), middle[:-1]),
    ):
        v = np.append(0.0, np.cumsum(DT * mean))
        u = np.append(0.0, np.cumsum(0.5 * DT * (v[:-1] + v[1:])))
        ground = base_motion(shake)
        ground.path.bind(scheme, DT)
        for k in (39, 0, 7):  # not in order
            found = ground.at(t[k])
            np.testing.assert_allclose(
                found[0], u[k] * np.array([1.0, -0.5]), rtol=1e-12, atol=1e-16
            )
            np.testing.assert_allclose(
                found[1], v[k] * np.array([1.0, -0.5]), rtol=1e-12, atol=1e-15
            )
            np.testing.assert_array_equal(found[2], a[k] * np.array([1.0, -0.5]))
        half = ground.at(0.5 * (t[7] + t[8]))[0][0]
        assert math.isclose(half, 0.5 * (u[7] + u[8]), rel_tol=1e-9)
        np.testing.assert_array_equal(ground.at(-1.0)[0], [0.0, 0.0])


@pytest.mark.serial
def test_the_mass_beside_the_run_is_not_warned_of(caplog: pytest.LogCaptureFixture):
    """The user has not built it, and it is free so that it follows the ground."""
    ground = base_motion(WAVES)
    with caplog.at_level(logging.WARNING):
        ground.path.bind(vc.Trapezoidal(), DT)
        ground.at(3.0 * DT)
    assert not caplog.records


@pytest.mark.serial
def test_a_schedule_may_end_with_the_run():
    """Its last piece is that of the run: no more than its times are asked for."""
    plans = [vc.Schedule(((DT, 0.01), (2.0 * DT, end))) for end in (0.05, math.inf)]
    ground, found = base_motion(WAVES), []
    for plan in plans:
        ground.path.bind(vc.Trapezoidal(), plan)
        found.append(ground.at(0.05))
    one, other = found
    for mine, theirs in zip(one, other, strict=True):
        np.testing.assert_array_equal(mine, theirs)


@pytest.mark.serial
def test_time_steps_that_nobody_knows_and_motions_that_nobody_binds_are_refused():
    ground = base_motion(WAVES)
    np.testing.assert_array_equal(ground.at(0.0)[0], [0.0, 0.0])
    with pytest.raises(
        InputError,
        match="base_motion is asked for its motion at t = 0.5 s, but no run has bound it",
    ):
        ground.at(0.5)
    with pytest.raises(
        InputError, match=r"needs its time steps beforehand, but the run has HalvedAtImpact"
    ):
        ground.path.bind(vc.Trapezoidal(), vc.HalvedAtImpact(DT))
    with pytest.raises(InputError, match="same number of components"):
        base_motion(())


def two_frames(
    comm: Any, *, damping: Any = None, friction: Any = None, waves: Any = WAVES
) -> tuple[Any, Any]:
    """A panel beside a rigid wall, shaken both ways: (problem in the ground's frame, with a moved
    base)."""
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(1.0, 2.0), divisions=(3, 6)), comm)
    data = {
        "section": vc.PlaneStress(0.2),
        "damping": damping,
        "loads": fem.BodyForce((0.0, -2.4e4)),
    }
    soft = vc.LinearElastic(E=2e7, nu=0.2, rho=2400.0)
    wall = vc.HalfSpace(point=(1.001, 0.0), normal=(-1.0, 0.0))
    ground = base_motion(waves)
    held = fem.assemble(mesh, soft, clamped=tags["bottom"], **data)
    base = fem.Prescribed(tags["bottom"], ground.displacement, ground.velocity, ground.acceleration)
    moved = fem.assemble(mesh, soft, prescribed=base, **data)
    surfaces = [
        fem.contact_surface(system, tags["right"], obstacle=wall) for system in (held, moved)
    ]
    settings = {} if friction is None else {"friction": friction}
    relative = vc.ContactProblem(held, surfaces[0], excitation=waves, **settings)
    return relative, vc.ContactProblem(moved, ground.carrying(surfaces[1], moved), **settings)


@pytest.fixture(scope="module")
def damped_frames() -> tuple[Any, Any]:
    """With stiffness damping: problems that every scheme marches."""
    from mpi4py import MPI

    return two_frames(MPI.COMM_WORLD, damping=vc.Rayleigh(0.0, 1e-4))


def difference(
    pair: tuple[Any, Any], scheme: Any, steps: int = 220, *, rest: bool = False, changes: int = 4
) -> float:
    """Largest difference of the reactions of two problems over the largest reaction; contact opens
    and closes.

    ``rest``: both start from their static stage.
    """
    histories = []
    for problem in pair:
        rows = []
        start = vc.static_equilibrium(problem, solver=vc.Condensed()) if rest else None
        for state, _ in march(problem, scheme=scheme, dt=DT, steps=steps, state=start):
            found = gathered(problem.surface, state)
            rows.append(np.append(found.r_n, () if found.r_t is None else found.r_t.ravel()))
        histories.append(np.array(rows))
    one, other = histories
    closed = (one > 0.0).any(axis=1)
    assert np.sum(closed[1:] != closed[:-1]) >= changes
    return float(np.max(np.abs(one - other)) / np.max(np.abs(one)))


@pytest.mark.slow
@pytest.mark.parametrize(
    "name",
    ["trapezoidal", *(pytest.param(name, marks=pytest.mark.serial) for name in ("zwt", "newmark"))],
)
@pytest.mark.promise("guide/soil.md", "in both frames differ by 1e-12", bound="1e-10")
def test_both_frames_give_the_same_contact_forces(damped_frames, name):
    """Horizontal and vertical motion together, with stiffness damping; measured 1e-12."""
    assert difference(damped_frames, SCHEMES[name]) <= 1e-10


@pytest.mark.slow
@pytest.mark.serial
@pytest.mark.parametrize(
    "name", [name for name in SCHEMES if name not in ("trapezoidal", "zwt", "newmark")]
)
def test_other_schemes_too(damped_frames, name):
    """The scheme integrates the base, so every scheme without velocity jumps agrees with itself."""
    assert difference(damped_frames, SCHEMES[name]) <= 1e-10


@pytest.mark.long
@pytest.mark.serial
def test_with_friction_on_an_obstacle_that_goes_along(comm):
    """Slip is measured against the moving wall."""
    pair = two_frames(comm, friction=vc.Coulomb(0.3))
    assert difference(pair, vc.Trapezoidal()) <= 1e-10


@pytest.mark.serial
@pytest.mark.slow
def test_a_block_on_a_box_of_soil_whose_base_moves(comm):
    """In space, three components, sides tied both ways: a block rubs on the soil, is thrown off and
    comes down."""
    waves = [
        vc.Ricker(a, f, direction=tuple(e))
        for a, f, e in zip((9.0, 40.0, 7.0), (16.0, 19.0, 15.0), np.eye(3), strict=True)
    ]
    boxes = {
        "lower": BlockMesh(lengths=(3.0, 2.0, 3.0), divisions=(3, 3, 3)),
        "upper": BlockMesh(lengths=(1.5, 1.5, 1.5), divisions=(2, 3, 2)),
    }
    mesh, tags = fem.build_mesh(TwoBlocks(**boxes, offset=(0.6, 0.7)), comm)
    tied = [
        fem.Tied(tags[f"lower_{a}"], tags[f"lower_{b}"])
        for a, b in (("left", "right"), ("back", "front"))
    ]
    ground, pair = base_motion(waves), []
    base = fem.Prescribed(
        tags["lower_bottom"], ground.displacement, ground.velocity, ground.acceleration
    )
    for held, shaken in (
        ({"clamped": tags["lower_bottom"]}, {"excitation": waves}),
        ({"prescribed": base}, {}),
    ):
        system = vc.with_weight(
            fem.assemble(mesh, SOIL, tied=tied, **held), direction=(0.0, -1.0, 0.0)
        )
        surface = fem.contact_pair(
            system, tags["upper_bottom"], tags["lower_top"], matching=fem.DualMortar()
        )
        pair.append(vc.ContactProblem(system, surface, friction=vc.Coulomb(0.3), **shaken))
    assert difference((pair[0], pair[1]), vc.Trapezoidal(), 60, rest=True, changes=2) <= 1e-10


@pytest.mark.long
@pytest.mark.serial
def test_a_base_that_starts_with_an_acceleration_has_the_same_static_stage(comm):
    """At rest nothing feels the inertia of the first sample: measured 4e-13."""
    pair = two_frames(comm, waves=vc.Harmonic(6.0, 5.0, phase=0.5 * math.pi))
    assert difference(pair, vc.Trapezoidal(), rest=True) <= 1e-10


@pytest.mark.long
@pytest.mark.serial
def test_mass_damping_tells_the_frames_apart(comm):
    """alpha M acts on absolute or on relative velocity: not the same problem."""
    pair = two_frames(comm, damping=vc.Rayleigh(1.0, 0.0))
    assert difference(pair, vc.Trapezoidal()) > 1e-3
