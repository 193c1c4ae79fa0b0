"""Momentum, angular momentum, spin and mean motion of bodies, against those of rigid ones."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from fem_problems import CONCRETE, block, linear
from two_bodies import LENGTHS, blocks, two_blocks

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.algebra import SerialAlgebra
from vi_contact.core.errors import InputError

NONE = np.zeros(0)


def state_of(problem: Any, u: Any, v: Any, t: float = 0.0) -> vc.State:
    """A state without contact."""
    return vc.State(t, 0, u, v, NONE, np.zeros(0, dtype=bool))


def rigid(points: Any, centre: Any, shift: Any, turn: Any) -> Any:
    """Velocities of points that move as a rigid body; ``turn`` has three components."""
    d = points.shape[1]
    arms = np.zeros((len(points), 3))
    arms[:, :d] = points - centre
    return np.asarray(shift) + np.cross(turn, arms)[:, :d]


@pytest.mark.parametrize("simplices", [True, False])
@pytest.mark.parametrize("d", [2, 3])
def test_a_rigid_body_is_told_exactly(comm: Any, d: int, simplices: bool) -> None:
    """m, J and centre of a block are those of a rectangle; the other body is not counted."""
    system, tags = two_blocks(comm, blocks(d, simplices=simplices))
    problem = linear(system)
    space = system.space
    size = np.array(LENGTHS[:d])
    mass = 1000.0 * np.prod(size)
    centre = 0.5 * size + np.eye(d)[1] * size[1]  # of the upper block, on top of the lower one
    inertia = mass / 12.0 * (np.sum(size**2) - size**2)
    inertia = inertia if d == 3 else mass / 12.0 * np.array([0.0, 0.0, np.sum(size**2)])

    shift = np.array([0.7, -0.4, 0.2])[:d]
    turn = np.array([0.3, -0.5, 0.9]) if d == 3 else np.array([0.0, 0.0, 0.9])
    upper = space.points[:, 1] > size[1] - 1e-9
    upper &= space.body_of_node == fem.bodies_of(system, tags["upper"])[0]
    v = rigid(space.points, centre, shift, turn)
    v[~upper] = 5.0  # what the other body does does not count
    state = state_of(problem, space.restrict(0.01 * v), space.restrict(v))

    about = np.array([0.2, -0.1, 0.4])[:d]
    recorders = [
        vc.BodyMotion("b", tags["upper"], about=about),
        vc.BodyMotion("b", bodies=fem.bodies_of(system, tags["upper"]), about=about),
    ]
    momentum = mass * shift
    arm = np.zeros((2, 3))
    arm[0, :d] = centre - about
    arm[1, :d] = momentum
    angular = np.cross(*arm) + inertia * turn
    for recorder in recorders:
        row = recorder.start(problem, state)
        assert list(row) == list(recorder.columns())
        axes = "xyz"[:d]
        assert np.allclose([row[f"mean_v_{a}_b"] for a in axes], shift, rtol=1e-12)
        assert np.allclose([row[f"mean_u_{a}_b"] for a in axes], 0.01 * shift, rtol=1e-12)
        assert np.allclose([row[f"momentum_{a}_b"] for a in axes], momentum, rtol=1e-12)
        if d == 2:
            assert row["spin_b"] == pytest.approx(turn[2], rel=1e-12)
            assert row["angular_momentum_b"] == pytest.approx(angular[2], rel=1e-12)
        else:
            assert np.allclose([row[f"spin_{a}_b"] for a in axes], turn, rtol=1e-11)
            found = [row[f"angular_momentum_{a}_b"] for a in axes]
            assert np.allclose(found, angular, rtol=1e-11)


def test_impulses_of_contact_and_weight_change_the_momentum(comm: Any) -> None:
    """A tilted block falls on a rough plane: with the mean forces F of a step at x,
    P(t + dt) - P(t) = dt (F + m g), and L about the origin grows by dt (X × F + X_c × m g)."""
    mesh, tags = block(comm, lengths=(1.0, 0.6), divisions=(4, 3), angle=0.2)
    system = vc.with_weight(fem.assemble(mesh, CONCRETE, initial_velocity=(1.0, -2.0)))
    plane = vc.HalfSpace(point=(0.0, -1e-4), normal=(0.0, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=plane)
    problem = vc.ContactProblem(system, surface, friction=vc.Coulomb(0.3), mass=vc.ConsistentMass())
    dt = 2e-5
    body = vc.BodyMotion("b", about=(0.0, 0.0))
    part = vc.Resultants("foot", (0.0, 0.0))
    found = vc.simulate(
        problem, scheme=vc.MoreauJean(), dt=dt, steps=60, record=[body, part], progress=False
    ).history
    mass, gravity = 0.6 * CONCRETE.rho, 9.80665
    assert found["N_foot"].max() > 100.0 * mass * gravity
    centre = body._momenta.centre
    turned = np.array([[np.cos(0.2), -np.sin(0.2)], [np.sin(0.2), np.cos(0.2)]])
    assert np.allclose(centre, turned @ [0.5, 0.3], rtol=1e-12)
    for name, force in (
        ("momentum_x_b", found["force_x_foot"]),
        ("momentum_y_b", found["force_y_foot"] - mass * gravity),
        ("angular_momentum_b", found["M_foot"] - centre[0] * mass * gravity),
    ):
        rate = np.diff(found[name]) / dt
        assert np.abs(rate - force[1:]).max() < 1e-10 * np.abs(force).max()


def test_what_is_held_counts_as_it_moves(comm: Any) -> None:
    """A block all of whose left side is moved has the momentum of this side's share too."""
    mesh, tags = block(comm, lengths=(2.0, 1.0), divisions=(4, 2))
    moved = fem.Prescribed(
        tags["left"],
        displacement=lambda x, t: np.tile([0.5 * t, 0.0], (len(x), 1)),
        velocity=lambda x, t: np.tile([0.5, 0.0], (len(x), 1)),
    )
    system = fem.assemble(mesh, CONCRETE, prescribed=moved)
    v = np.zeros(system.rows)
    points = system.space.coordinates
    v[:] = 0.5 * system.influence[:, 0] * (1.0 + 0.0 * points[:, 0])
    row = vc.BodyMotion("b").start(linear(system), state_of(None, 2.0 * v, v, t=2.0))
    assert row["momentum_x_b"] == pytest.approx(0.5 * 2.0 * CONCRETE.rho, rel=1e-12)
    assert row["mean_u_x_b"] == pytest.approx(1.0, rel=1e-12)
    assert abs(row["spin_b"]) < 1e-12


def test_a_line_has_no_spin(comm: Any) -> None:
    mesh, _ = block(comm, lengths=(2.0,), divisions=(5,))
    system = fem.assemble(mesh, CONCRETE)
    v = 0.3 * system.influence[:, 0]
    row = vc.BodyMotion("bar").start(linear(system), state_of(None, v, v))
    assert set(row) == {"mean_u_x_bar", "mean_v_x_bar", "momentum_x_bar"}
    assert row["momentum_x_bar"] == pytest.approx(0.6 * CONCRETE.rho, rel=1e-12)


@pytest.mark.serial
def test_bodies_of_matrices() -> None:
    """Two masses on a massless bar, and a third apart from them: P, L and spin by hand."""
    stiffness = np.zeros((6, 6))
    stiffness[np.ix_([0, 2], [0, 2])] = [[1.0, -1.0], [-1.0, 1.0]]
    places = np.array([(0.0, 0.0), (3.0, 0.0), (9.0, 9.0)])
    masses = np.array([2.0, 2.0, 1.0, 1.0, 5.0, 5.0])
    system = vc.system_from_arrays(np.diag(masses), None, stiffness, coordinates=places)
    v = np.array([1.0, 0.0, 1.0, 3.0, -7.0, 4.0])
    row = vc.BodyMotion("b", bodies=(0,), about=(0.0, 1.0)).start(
        linear(system), state_of(None, v, v)
    )
    assert isinstance(system.algebra, SerialAlgebra)
    assert (row["momentum_x_b"], row["momentum_y_b"]) == pytest.approx((3.0, 3.0))
    assert (row["mean_v_x_b"], row["mean_v_y_b"]) == pytest.approx((1.0, 1.0))
    # L about (0, 1): 2 kg at (0, -1) and 1 kg at (3, -1); J = 2·1² + 1·2² about (1, 0)
    assert row["angular_momentum_b"] == pytest.approx(2.0 + 1.0 + 9.0)
    assert row["spin_b"] == pytest.approx((1.0 * 2.0 * 3.0 - 0.0) / 6.0)


def test_what_it_refuses(comm: Any) -> None:
    mesh, _ = block(comm, lengths=(2.0, 1.0), divisions=(4, 2))
    cells = fem.Cells.where("all", mesh, lambda x: x[0] > -1.0)
    system = fem.assemble(mesh, CONCRETE)
    problem = linear(system)
    still = state_of(problem, 0.0 * system.u0, 0.0 * system.v0)
    with pytest.raises(InputError, match="give either cells or bodies, not both"):
        vc.BodyMotion("b", cells, (0,))
    with pytest.raises(InputError, match="BodyMotion 'b': the number of a body"):
        vc.BodyMotion("b", bodies=(1,)).start(problem, still)
    with pytest.raises(InputError, match="has no mass"):
        vc.BodyMotion("b", bodies=()).start(problem, still)
    with pytest.raises(InputError, match="about"):
        vc.BodyMotion("b", about=(0.0, 0.0, 0.0)).start(problem, still)
