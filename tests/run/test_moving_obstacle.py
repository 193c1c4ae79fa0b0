"""Obstacles that move towards the body and along it: positions, velocities, and the work they do
(V9.7)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from bar import bar, before_impact, run
from fem_problems import block
from mpi4py import MPI

from vi_contact.core.errors import InputError
from vi_contact.core.ledger import energy_balance
from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import BodyForce
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.laws.friction import Coulomb
from vi_contact.laws.mass import ConsistentMass, Redistributed
from vi_contact.laws.materials import LinearElastic, Rayleigh
from vi_contact.run.march import march
from vi_contact.run.static import static_equilibrium
from vi_contact.schemes.contact_stabilised import ContactStabilisedNewmark
from vi_contact.schemes.hht import HHT
from vi_contact.schemes.houbolt import Houbolt
from vi_contact.schemes.midpoint import Midpoint
from vi_contact.schemes.moreau_jean import MoreauJean
from vi_contact.schemes.newmark import Newmark
from vi_contact.schemes.trapezoidal import Trapezoidal
from vi_contact.solvers.condensed import Condensed

SCHEMES = [
    (Trapezoidal(), Redistributed()),
    (Newmark(), Redistributed()),
    (HHT(-0.1), Redistributed()),
    (Houbolt(), Redistributed()),
    (Midpoint(), ConsistentMass()),
    (ContactStabilisedNewmark(), ConsistentMass()),
    (MoreauJean(), ConsistentMass()),
]
RUBBING = [SCHEMES[0], *SCHEMES[4:]]


def pushed(mass: Any, elements: int = 60, *, speed: float = 10.0, **more: Any) -> ContactProblem:
    """The bar of V1.1 at rest, 5 m above a wall that rises with 10 m/s: V1.1 seen from the wall's
    rest frame."""
    given = bar(elements, gap=5.0, mass=mass, **more)
    return replace(given, surface=given.surface.moving(lambda t: speed * t))


@pytest.mark.serial
@pytest.mark.parametrize("scheme, mass", SCHEMES, ids=[repr(scheme) for scheme, _ in SCHEMES])
def test_a_rising_wall_is_a_falling_bar(scheme: Any, mass: Any) -> None:
    """Galilei: the reactions of the bar thrown at the wall at rest, step by step; u differs by the
    wall's way."""
    dt, steps = 10.0 / 30 / 30, 130
    thrown = bar(30, gap=5.0, v0=lambda x: np.full_like(x, -10.0), mass=mass)
    one, two = (list(run(p, scheme, dt=dt, steps=steps)) for p in (thrown, pushed(mass, 30)))
    # the very step that touches rounds differently, so the force of single steps is compared in the
    # mean
    forces = [
        np.array([float(report.balance.r_n.sum()) for report in reports]) for reports in (one, two)
    ]
    assert np.abs(forces[0] - forces[1]).max() <= 1e-7 * np.abs(forces[0]).max()
    t = one[-1].new.t
    for a, b in zip(one[::20], two[::20], strict=True):
        gaps = [
            p.surface.gap(r.new.t) - p.surface.normal_values(r.new.u)
            for p, r in ((thrown, a), (pushed(mass, 30), b))
        ]
        assert gaps[0] == pytest.approx(gaps[1], abs=1e-7)
    assert t > 1.4


@pytest.mark.serial
@pytest.mark.parametrize("scheme, mass", SCHEMES, ids=[repr(scheme) for scheme, _ in SCHEMES])
def test_its_work_is_in_the_ledger(scheme: Any, mass: Any) -> None:
    """The wall's force times its speed is input: with it the ledger closes, and is the energy of
    the rebound 2 m v²."""
    problem, work, largest = pushed(mass), 0.0, 0.0
    for report in run(problem, scheme, dt=10.0 / 60 / 30, steps=260):
        step = energy_balance(problem, report.old, before_impact(report), report.balance)
        work += step.input
        largest = max(largest, problem.equations.kinetic_energy(report.new.v))
        assert abs(step.defect) <= 1e-10 * 2000.0
    assert work == pytest.approx(2000.0, rel=0.02)  # impulse 200 times speed 10
    assert largest == pytest.approx(2000.0, rel=0.2)


@pytest.mark.serial
def test_a_held_point_follows_its_obstacle() -> None:
    """Bilateral on a moving wall: a prescribed motion."""
    given = bar(40, gap=0.0, mass=Redistributed())
    moving = replace(
        given, surface=given.surface.bilateral_everywhere().moving(lambda t: 0.1 * np.sin(3.0 * t))
    )
    for report in run(moving, Trapezoidal(), dt=0.01, steps=100):
        u_n = moving.surface.normal_values(report.new.u)[0]
        assert u_n == pytest.approx(-0.1 * np.sin(3.0 * report.new.t), abs=1e-14)


@pytest.mark.slow
@pytest.mark.parametrize(
    "scheme, mass",
    [RUBBING[0], *(pytest.param(*one, marks=pytest.mark.serial) for one in RUBBING[1:])],
    ids=[repr(scheme) for scheme, _ in RUBBING],
)
def test_a_belt_drags_with_the_force_of_friction(scheme: Any, mass: Any) -> None:
    """A block at rest on a running belt is dragged with mu times its weight until it has the belt's
    speed, and the ledger closes with the work of the belt: half of it becomes motion, half is
    rubbed away."""
    g, mu, speed, dt = 10.0, 0.2, 0.5, 0.002
    mesh, tags = block(MPI.COMM_WORLD, lengths=(1.0, 0.5), divisions=(8, 4))
    rubber = LinearElastic(E=1.0e7, nu=0.2, rho=1000.0)
    system = assemble(
        mesh, rubber, loads=BodyForce((0.0, -1000.0 * g)), damping=Rayleigh(0.0, 2e-3)
    )
    surface = contact_surface(
        system, tags["bottom"], obstacle=HalfSpace(point=(0.0, 0.0), normal=(0.0, 1.0))
    )
    rest = static_equilibrium(ContactProblem(system, surface), solver=Condensed())
    start = replace(rest, r_t=np.zeros((surface.count, 1)))
    dragged = surface.everywhere(surface.tangential_values(system.influence[:, 0]))
    along = float(dragged[0, 0])  # 1 or -1: which way the tangents point
    belt = ContactProblem(
        system, surface.moving(along=lambda t: along * speed * t), friction=Coulomb(mu), mass=mass
    )
    t, v, input_work, rubbed = [], [], 0.0, 0.0
    for state, report in march(belt, scheme=scheme, dt=dt, steps=200, state=start):
        equations, dot = report.problem.equations, system.algebra.dot
        r = equations.influence[:, 0]
        t.append(state.t)
        v.append(dot(r, equations.M @ state.v) / 500.0)
        step = energy_balance(report.problem, report.old, report.new, report.balance)
        input_work, rubbed = input_work + step.input, rubbed + step.friction
        assert abs(step.defect) <= 1e-10 * 500.0 * speed**2
    times, speeds = np.array(t), np.array(v)
    early = (times > 0.05) & (times < 0.9 * speed / (mu * g))
    assert speeds[early] == pytest.approx(mu * g * times[early], rel=0.03)
    assert speeds[-50:].mean() == pytest.approx(speed, rel=0.02)
    assert input_work == pytest.approx(500.0 * speed**2, rel=0.03)
    assert rubbed == pytest.approx(0.5 * 500.0 * speed**2, rel=0.05)


@pytest.mark.serial
def test_shapes_are_told() -> None:
    """A motion of the wrong length is refused when it is asked for."""
    surface = bar(5).surface.moving(lambda t: np.zeros(3))
    with pytest.raises((ValueError, InputError)):
        surface.gap(1.0)
