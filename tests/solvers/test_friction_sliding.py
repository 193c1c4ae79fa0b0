"""Blocks on slopes and shaken tables: stick below tan(angle), slide with g (sin - mu cos) above, in
every length unit; friction work is the area of the loop; the force does not depend on the number of
contact points."""

from __future__ import annotations

from functools import cache, partial
from math import cos, pi, sin, sqrt
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from fem_problems import block, thrown_box, turned

import vi_contact as vc
from vi_contact import core, solvers
from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import FrictionLaw
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import BodyForce
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.laws.friction import Coulomb, ExponentialDecay, SlipRateCoulomb
from vi_contact.laws.mass import ConsistentMass
from vi_contact.laws.materials import LinearElastic, Rayleigh
from vi_contact.run.march import march
from vi_contact.run.static import static_equilibrium
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.volume import ReducedNewton

G, SLOPE = 9.81, pi / 6.0
MIDPOINT = vc.ZienkiewiczWoodTaylor()
METHODS = [
    solvers.NSGS(),
    solvers.FixedPoint(),
    solvers.FixedPoint(extrapolation=solvers.Anderson()),
    solvers.GivenForces(),
    solvers.GivenForces(extrapolation=solvers.Anderson()),
]


def resting(
    comm: Any,
    friction: FrictionLaw,
    *,
    scale: float = 1.0,
    angle: float = SLOPE,
    cells: int = 4,
    **more: Any,
) -> ContactProblem:
    """A soft block of 2 x 1 m (times scale) on a slope, vibrations damped within a few periods.

    E/(rho g L) and the damping ratio stay when the length does not: E grows with L, times with √L.
    """
    material = LinearElastic(E=2.0e6 * scale, nu=0.3, rho=1000.0)
    mesh, tags = block(comm, lengths=(2.0 * scale, scale), divisions=(cells, 2), angle=angle)
    weight = BodyForce((0.0, -1000.0 * G))
    system = assemble(mesh, material, loads=weight, damping=Rayleigh(0.0, 0.02 * sqrt(scale)))
    ground = HalfSpace(point=(0.0, 0.0), normal=tuple(turned((0.0, 1.0), angle)))
    surface = contact_surface(system, tags["bottom"], obstacle=ground)
    return ContactProblem(system, surface, friction=friction, mass=ConsistentMass(), **more)


def along(problem: ContactProblem, x: Array, angle: float = SLOPE) -> float:
    """Mean over the mass of a vector's component down the slope."""
    system = problem.equations
    total = system.algebra.comm.sum(system.influence.T @ (system.M @ x))
    mass = system.algebra.comm.sum(
        np.array([np.sum(system.influence[:, 0] * (system.M @ system.influence[:, 0]))])
    )
    return float(-total @ turned((1.0, 0.0), angle) / mass[0])


@pytest.mark.two_ranks
@pytest.mark.parametrize("scale", [1.0, pytest.param(0.1, marks=pytest.mark.slow), 0.01])
def test_incline_sticks(comm: Any, scale: float) -> None:
    """tan 30° = 0.577 < mu = 0.6: the static stage stands, and the block stays where it is, in
    every length unit."""
    problem = resting(comm, Coulomb(0.6), scale=scale)
    start = static_equilibrium(problem, solver=Condensed())
    r_t, r_n = (problem.surface.everywhere(one) for one in (start.r_t, start.r_n))
    assert np.linalg.norm(r_t.sum(axis=0)) == pytest.approx(np.tan(SLOPE) * r_n.sum(), rel=1e-8)
    run = list(march(problem, scheme=MIDPOINT, dt=0.01 * sqrt(scale), steps=50, state=start))
    assert max(report.certificate.worst for _, report in run) <= 1e-9
    state = run[-1][0]
    moved = np.abs(
        problem.surface.everywhere(problem.surface.tangential_values(state.u - start.u))
    ).max()
    assert moved <= 1e-8 * scale
    with pytest.raises(InputError, match="no static equilibrium"):
        static_equilibrium(resting(comm, Coulomb(0.5), scale=scale), solver=Condensed())


@cache
def slid(scale: float, cells: int) -> tuple[float, float, Array]:
    """mu = 0.5: (acceleration of the centre of mass, friction force over weight) once vibrations
    have died out, means of 50 steps over which the ringing of contact nodes cancels, and the way in
    block heights after every 50 steps."""
    from mpi4py import MPI

    comm, dt, rows = MPI.COMM_WORLD, 0.01 * sqrt(scale), []
    problem = resting(comm, Coulomb(0.5), scale=scale, cells=cells)
    for state, report in march(problem, scheme=MIDPOINT, dt=dt, steps=300):
        assert report.certificate.worst <= 1e-9
        rows.append(
            (
                along(problem, state.v),
                along(problem, state.u) / scale,
                abs(comm.allreduce(state.r_t.sum())),
            )
        )
    v, u, force = np.array(rows).T
    friction = force[-50:].mean() / (2.0e3 * scale**2 * G)
    return float((v[-1] - v[-51]) / (50 * dt)), float(friction), u[49::50]


@pytest.mark.serial
@pytest.mark.slow
def test_incline_slides_alike_in_every_unit() -> None:
    """g (sin - mu cos) to 1e-9 at 1, 0.1 and 0.01 times the length; the same dimensionless motion
    to 1e-9."""
    expected = G * (sin(SLOPE) - 0.5 * cos(SLOPE))
    first: Array | None = None
    for scale in (1.0, 0.1, 0.01):
        acceleration, _, u = slid(scale, 4)
        assert acceleration == pytest.approx(expected, rel=1e-9)
        first = u if first is None else first
        assert np.abs(u - first).max() <= 1e-9 * first.max()


@pytest.mark.slow
@pytest.mark.serial
def test_friction_force_does_not_depend_on_the_number_of_points() -> None:
    """4 and 10 elements along the base in full sliding: mu times the normal weight, 1e-6 asked,
    1e-9 found."""
    for cells in (4, 10):
        assert slid(1.0, cells)[1] == pytest.approx(0.5 * cos(SLOPE), rel=1e-9)


LAWS = [Coulomb(0.2), SlipRateCoulomb(ExponentialDecay(0.3, 0.15, 0.05))]


@pytest.mark.long
@pytest.mark.serial
@pytest.mark.parametrize(
    ("friction", "cycles", "period"),
    zip(LAWS, (9, 6), (50, 100), strict=True),
    ids=["constant", "slip rate"],
)
def test_loop_area_is_friction_work(
    comm: Any, friction: FrictionLaw, cycles: int, period: int
) -> None:
    """A block on a table that shakes with 0.4 g and 2 Hz, so many steps a period.

    The last cycle: the area inside the closed loops of tangential reaction over slip, point by
    point, is the friction work of the ledger, to 1e-8. The whole run: the work of the shaking
    force on the mean displacement is friction, damping and what the energy gained, to 1e-8.
    """
    shake = vc.Harmonic(0.4 * G, 2.0, direction=(1.0, 0.0))
    problem, dt = resting(comm, friction, angle=0.0, excitation=shake), 0.5 / period
    start = static_equilibrium(problem, solver=Condensed())
    ledger = vc.Energy()
    rows, drive = [dict(ledger.start(problem, start))], 0.0
    slips, forces = [problem.surface.tangential_values(start.u)], []
    for state, report in march(problem, scheme=MIDPOINT, dt=dt, steps=period * cycles, state=start):
        assert report.certificate.worst <= 1e-9
        rows.append(dict(ledger.row(report)))
        slips.append(problem.surface.tangential_values(state.u))
        forces.append(report.balance.r_t)
        moved = along(problem, state.u - report.old.u, 0.0)
        drive += 2.0e3 * shake.acceleration(report.old.t + 0.5 * dt) * moved
    work = rows[-1]["loss_friction"] - rows[-1 - period]["loss_friction"]
    area = loops(np.array(slips[-1 - period :]), np.array(forces[-period:]))
    assert area == pytest.approx(work, rel=1e-8) and work > 100.0
    energy = [row["energy_kinetic"] + row["energy_strain"] for row in rows]
    lift = 2.0e3 * G * along(problem, state.u - start.u, pi / 2.0)
    spent = rows[-1]["loss_friction"] + rows[-1]["loss_damping"] + energy[-1] - energy[0]
    assert drive == pytest.approx(spent - lift, rel=1e-8)


def loops(slips: Array, forces: Array) -> float:
    """Area of the polygons with corners (slip before, force), (slip after, force) of every step,
    all points."""
    s = np.stack([slips[:-1], slips[1:]], axis=1).reshape(-1, slips[0].size)
    f = np.repeat(forces.reshape(len(forces), -1), 2, axis=0)
    return float(0.5 * np.sum((f + np.roll(f, -1, axis=0)) * (np.roll(s, -1, axis=0) - s)))


@pytest.mark.two_ranks
@pytest.mark.parametrize("d", [2, 3])
def test_all_methods_agree_on_a_finite_element_step(comm: Any, d: int) -> None:
    """The step with the most closed points of a thrown box, sticking and slipping: FrictionNewton
    and all others to 1e-9 of the largest displacement increment and reaction, each certified."""
    if d == 2:
        problem = resting(comm, Coulomb(0.3))
        steps = 40
    else:
        problem, steps = thrown_box(comm, angle=0.3, simplices=True, divisions=(4, 5, 3)), 40
        problem = ContactProblem(
            problem.system, problem.surface, friction=Coulomb(0.3), mass=ConsistentMass()
        )
    reports = [report for _, report in march(problem, scheme=MIDPOINT, dt=1e-3, steps=steps)]
    report = max(reports, key=lambda report: comm.allreduce(int(report.new.active.sum())))
    step, one = report.step, report.result
    moved = max(float(np.abs(one.x - report.old.u).max(initial=0.0)), 1e-300)
    moved = float(comm.allreduce(moved, op=max))
    everywhere = problem.surface.everywhere
    r_n, r_t = everywhere(one.r_n), everywhere(one.r_t)
    for method in METHODS:
        other = (
            Condensed(friction_method=method).prepare(step.A, step.surface, step.scale).solve(step)
        )
        assert core.kkt_residual(step, other).worst <= 1e-9
        assert np.abs(other.x - one.x).max(initial=0.0) <= 1e-9 * moved
        assert np.abs(everywhere(other.r_n) - r_n).max() <= 1e-9 * r_n.max()
        assert np.abs(everywhere(other.r_t) - r_t).max() <= 1e-9 * r_n.max()


@pytest.mark.long
def test_ranks_agree_on_friction_of_the_slip_rate(comm: Any) -> None:
    """All ranks together and each alone: the same motion, 1e-10."""
    from mpi4py import MPI

    ends = []
    for who in (comm, MPI.COMM_SELF):
        problem = resting(who, LAWS[1])
        *_, (state, report) = march(problem, scheme=MIDPOINT, dt=0.01, steps=40)
        assert report.certificate.worst <= 1e-9 and report.result.history[-1] <= 1e-12
        ends.append(problem.surface.everywhere(problem.surface.tangential_values(state.u)))
    assert np.abs(ends[0] - ends[1]).max() <= 1e-10 * np.abs(ends[1]).max()


@pytest.mark.parametrize(
    "solver", [Condensed(), solvers.Iterative(), solvers.Volume(ReducedNewton())], ids=repr
)
def test_a_law_that_fails_on_one_rank_stops_all(comm: Any, solver: Any) -> None:
    """At rest, before anything is computed, and once points slide; with the line of the user's
    function."""

    def broken(speed: Array, *, from_speed: float) -> Array:
        if comm.rank == comm.size - 1 and np.any(speed >= from_speed):
            raise ZeroDivisionError("no such rate")
        return 0.2 + 0.0 * speed

    for least in (0.0, 1e-3):
        law = SlipRateCoulomb(partial(broken, from_speed=least))
        with pytest.raises(
            InputError,
            match=r"ended in ZeroDivisionError: no such rate .test_friction_sliding.py, li",
        ):
            for _ in march(resting(comm, law), scheme=MIDPOINT, solver=solver, dt=0.01, steps=10):
                pass
