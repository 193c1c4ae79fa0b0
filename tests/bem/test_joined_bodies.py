"""Jumps of displacements and tractions that are given between two boundary element bodies, against
plane waves.

Rods between rollers, impedances Z = rho c: a jump G of the displacements sends u_1 = G Z_2/(Z_1 +
Z_2) up and u_2 = -G Z_1/(Z_1 + Z_2) down; a jump f of the tractions moves both faces with f/(Z_1 +
Z_2).
"""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import vi_contact as vc
from demos.parts.problems.boundary_elements import pressed, steklov, unloaded
from vi_contact.bem import (
    BoundaryContact,
    BoundaryProblem,
    PoincareSteklov,
    TwoBodies,
    march_contact,
    polygon,
    traction_forces,
)
from vi_contact.core.errors import InputError

pytestmark = pytest.mark.serial
UPPER = vc.LinearElastic.from_wave_speeds(1.0, 0.5, 1.0)  # Z = 1 for pressure, 1/2 for shear waves
LOWER = vc.LinearElastic.from_wave_speeds(2.0, 1.0, 1.0)  # Z = 2 and 1
K, DT, STEPS = 5, 0.1, 9  # the first echo, of the stiff rod, is back at t = 1
JUMP, PUSH = 0.01, 0.3  # [m], [Pa]


@cache
def rods(component: int = 1) -> tuple[BoundaryProblem, BoundaryProblem]:
    """A soft rod of length 1 on a stiff one, ends free, sides held across ``component``."""
    upper, lower = (
        polygon([(0, 0), (1, 0), (1, 1), (0, 1)], 1 / K),
        polygon([(0, -1), (1, -1), (1, 0), (0, 0)], 1 / K),
    )
    bodies = []
    for mesh, material, face in ((upper, UPPER, 0), (lower, LOWER, 2)):
        fixed = np.zeros((2, len(mesh)), bool)
        fixed[1 - component] = mesh.nodes_of(mesh.labels % 2 == 1)
        bodies.append(
            unloaded(
                steklov(mesh, material, dt=DT, steps=STEPS),
                contact=mesh.labels == face,
                fixed=fixed,
            )
        )
    return bodies[0], bodies[1]


def joined(*, welded: bool = True, component: int = 1, **more) -> TwoBodies:
    one, two = rods(component)
    return TwoBodies(one, two, welded=one.contact if welded else None, **more)


def faces(bodies: TwoBodies, forces=None, component: int = 1):
    """Displacements (steps, nodes) of both faces, body 2 in the order of body 1, and the forces on
    them (steps,)."""
    motions = bodies.solve(forces)
    u = [
        motion.displacement[:, component][:, body.contact_nodes]
        for motion, body in zip(motions, (bodies.one, bodies.two), strict=True)
    ]
    force = [
        motion.forces[:, component][:, body.contact_nodes].sum(axis=1)
        for motion, body in zip(motions, (bodies.one, bodies.two), strict=True)
    ]
    return u[0], u[1][:, ::-1], force[0], force[1]


def along(component: int, size: float):
    """A given jump of this size along an axis, from t = 0 on."""
    return lambda points, t: np.eye(2)[[component]] * np.full((len(points), 1), size * (t > 0.0))


@pytest.mark.parametrize(
    ("component", "z", "ringing"), [(1, (1.0, 2.0), 0.05), (0, (0.5, 1.0), 0.15)]
)
def test_a_jump_of_displacements_across_a_weld(component, z, ringing):
    """B14: faces part in the first step and stay, by impedances, the force is a pulse of impulse G
    Z_1 Z_2/(Z_1 + Z_2); the jump itself is exact. Tension and shear waves; single nodes ring, c_S
    dt being h/4."""
    above, below, on_one, on_two = faces(
        joined(component=component, jump=along(component, JUMP)), component=component
    )
    assert (
        np.abs(above - below - JUMP).max() < 1e-12 * JUMP
        and np.abs(on_one + on_two).max() < 1e-12 * on_one[0]
    )
    exact = JUMP * z[1] / sum(z)
    assert above.mean(axis=1) == pytest.approx(np.full(STEPS, exact), rel=ringing)
    assert above == pytest.approx(np.full(above.shape, exact), rel=3.0 * ringing)
    assert np.cumsum(on_one) * DT == pytest.approx(np.full(STEPS, z[0] * exact), rel=2.0 * ringing)


def test_a_jump_of_tractions_across_a_weld():
    """B14: both faces move with f/(Z_1 + Z_2), f Z_1/(Z_1 + Z_2) of f is the traction of body 1,
    the rest of body 2; a history of nodal forces is the same."""
    bodies, t = joined(traction=along(1, PUSH)), DT * np.arange(1, STEPS + 1)
    above, below, on_one, on_two = faces(bodies)
    assert np.abs(above - below).max() < 1e-12 * above.max()
    assert above == pytest.approx(np.outer(PUSH * t / 3.0, np.ones(K + 1)), rel=0.06)
    assert on_one == pytest.approx(np.full(STEPS, PUSH / 3.0), rel=0.04)
    assert on_one + on_two == pytest.approx(np.full(STEPS, PUSH), rel=1e-12)
    nodal = np.zeros((STEPS, 2, K + 1))
    nodal[:, 1] = PUSH / K * np.array([0.5, 1.0, 1.0, 1.0, 1.0, 0.5])
    assert faces(joined(traction=nodal))[0] == pytest.approx(above, rel=1e-12)


def test_welds_of_the_unsymmetric_form():
    """B14: bodies whose W[0] is 2 % off symmetry are held as well as others: by a given jump, and
    beside rubbing."""
    one, two = (
        replace(
            body, operator=PoincareSteklov(body.operator.blocks, body.operator.rho, symmetric=False)
        )
        for body in rods()
    )
    motions = TwoBodies(one, two, welded=one.contact, jump=along(1, JUMP)).solve()
    u = [
        motion.displacement[:, :, body.contact_nodes]
        for motion, body in zip(motions, (one, two), strict=True)
    ]
    assert np.abs(u[0] - u[1][:, :, ::-1] - JUMP * np.array([[0.0], [1.0]])).max() < 1e-12 * JUMP
    welded = np.zeros(len(one.contact), bool)
    welded[np.flatnonzero(one.contact)[:2]] = True
    bodies = TwoBodies(one, two, welded=welded, traction=along(1, PUSH))
    contact = bodies.contact(vc.Tresca(0.05))
    run = march_contact(contact)
    v = [motion.displacement for motion in bodies.solve(run.forces)]
    apart = v[0][:, :, one.contact_nodes] - v[1][:, :, two.contact_nodes][:, :, ::-1]
    assert not contact.symmetric and np.abs(apart[:, :, :3]).max() < 1e-12 * np.abs(v[0]).max()
    assert run.worst < 1e-12 and run.r_n.max() > 0.01


def test_jumps_where_bodies_only_touch():
    """B14: a jump that drives the faces apart acts like a weld's, one that parts them opens a gap
    and moves nothing; a traction that presses acts like a weld's, one that pulls moves body 2
    alone: p_1 = 0 and p_2 = f."""
    t = DT * np.arange(1, STEPS + 1)
    for more, bound in (({"jump": along(1, JUMP)}, 0.1), ({"traction": along(1, PUSH)}, 4e-4)):
        bodies = joined(welded=False, **more)
        run = march_contact(bodies.contact())
        found, weld = faces(bodies, run.forces), faces(joined(**more))
        away = np.abs(found[0] - weld[0]).mean(axis=1)
        # where a pulse rings, it opens for a while
        assert run.r_n.min() >= 0.0 and away.max() < bound * weld[0].max()
    bodies = joined(welded=False, jump=along(1, -JUMP))
    run = march_contact(bodies.contact())
    assert (
        run.gap == pytest.approx(np.full(run.gap.shape, JUMP), rel=1e-12) and not run.forces.any()
    )
    bodies = joined(welded=False, traction=along(1, -PUSH))
    run = march_contact(bodies.contact())
    above, below, on_one, on_two = faces(bodies, run.forces)
    assert (
        not above.any()
        and not on_one.any()
        and on_two == pytest.approx(np.full(STEPS, -PUSH), rel=1e-12)
    )
    assert below.mean(axis=1) == pytest.approx(-PUSH * t / 2.0, rel=0.03)
    assert run.gap == pytest.approx(-below, rel=1e-9)


def test_sliding_against_a_given_jump():
    """B14: held and stuck points follow a jump along both axes as welded ones do; rubbing ones take
    Tresca's limit, and the slip is what is left of the given one."""
    one, two = (replace(body, fixed=None) for body in rods())

    def jump(points, t):
        return (
            JUMP * t * np.stack([1.0 + points[:, 0], points[:, 0] * (1.0 - points[:, 0])], axis=1)
        )

    welded = TwoBodies(one, two, welded=one.contact, jump=jump)
    bodies = TwoBodies(one, two, jump=jump)
    stuck = march_contact(bodies.contact(vc.Tresca(1e6), bilateral=True))
    u = [motion.displacement for motion in welded.solve()]
    v = [motion.displacement for motion in bodies.solve(stuck.forces)]
    assert all(np.abs(a - b).max() < 1e-12 * np.abs(a).max() for a, b in zip(u, v, strict=True))
    history = np.array(
        [jump(one.operator.mesh.points[one.contact_nodes], DT * (k + 1)).T for k in range(STEPS)]
    )
    limit = 1e-3
    for given in (jump, history):
        run = march_contact(
            TwoBodies(one, two, jump=given).contact(vc.Tresca(limit), bilateral=True)
        )
        slid = np.diff(run.displacement[:, : K + 1] - history[:, 0], axis=0, prepend=0.0)
        assert np.abs(run.slip - slid).max() < 1e-12 * JUMP
        rubbing = np.abs(run.slip) > 1e-9 * JUMP
        assert rubbing.mean() > 0.5 and np.abs(run.shear[rubbing]) == pytest.approx(limit, rel=1e-9)


def test_traction_given_on_a_rigid_support():
    """B14: p_perp >= f_perp, and = where it is open. A rod is lifted by f from its base, u = f t/Z,
    and pressed by p from t = 1 on: it is back when f t = 2 p (t - 1), and then its base has p_perp
    = 2 p until f is back at t = 2."""
    mesh = polygon([(0, 0), (1, 0), (1, 1), (0, 1)], 1 / K)
    fixed = np.zeros((2, len(mesh)), bool)
    fixed[0] = mesh.nodes_of(mesh.labels % 2 == 1)
    operator = steklov(mesh, UPPER, dt=DT, steps=19)
    rod = pressed(operator, pressure=lambda t: 1.0, top=2, contact=mesh.labels == 0, fixed=fixed)
    lift = traction_forces(
        mesh, lambda x, n, t: -0.5 * n, dt=DT, steps=19, elements=mesh.labels == 0
    )
    rod = replace(rod, forces=rod.forces + lift)
    run = march_contact(BoundaryContact(rod.condensed()))
    total = rod.solve(run.forces).forces[:, 1][:, rod.contact_nodes].sum(axis=1)
    t, back = run.times, 4.0 / 3.0
    assert total.min() == pytest.approx(0.5, rel=1e-12)
    assert total[t < back] == pytest.approx(0.5, rel=1e-12) and total[
        t > back + DT
    ] == pytest.approx(2.0, rel=0.05)
    exact = np.maximum(0.5 * t - 2.0 * np.maximum(t - 1.0, 0.0), 0.0)
    assert run.gap.mean(axis=1) == pytest.approx(exact, abs=0.02)


def test_bad_jumps():
    one, two = rods()
    with pytest.raises(InputError, match="jump has shape"):
        TwoBodies(one, two, jump=np.zeros((STEPS, 2, K)))
    with pytest.raises(InputError, match="jump at t = 0.1 s has shape"):
        TwoBodies(one, two, welded=one.contact, jump=lambda points, t: np.zeros(2)).condensed()
