"""Two deformable bodies: bars that collide (V1.4), the patch test through an interface (V2.1),
action and reaction (V9.8), friction, and the same answer from all solvers and on any number of
ranks."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from fem_problems import block, field, held_by, nodal, run, turned
from fem_problems import linear as without_contact
from mpi4py import MPI
from two_bars import TwoBars
from two_bodies import SOFT, blocks, momenta, per_body, relative, thrown, two_blocks

from vi_contact.core.algebra import Array
from vi_contact.core.problem import ContactProblem
from vi_contact.core.protocols import Frictionless
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import Prescribed
from vi_contact.fem.contact.pairs import contact_pair
from vi_contact.fem.mesh.tagged_mesh import build_mesh
from vi_contact.laws.friction import Coulomb
from vi_contact.laws.mass import ConsistentMass, Redistributed
from vi_contact.laws.materials import LinearElastic
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.cut import Welded
from vi_contact.meshes.two_blocks import TwoBlocks
from vi_contact.run.cross_check import cross_check
from vi_contact.run.march import march
from vi_contact.run.static import static_equilibrium
from vi_contact.schemes.contact_stabilised import ContactStabilisedNewmark
from vi_contact.schemes.midpoint import Midpoint
from vi_contact.schemes.trapezoidal import Trapezoidal
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.volume.route import ReducedNewton, Volume

pytestmark = pytest.mark.slow

COMM = MPI.COMM_WORLD
ELEMENTS, ACROSS = 50, 3  # of the shorter bar, across a strip

# V1.4
# --------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Collision:
    """Per step: time, pressure, mean pressure of the step, energy; mean velocities of both bars at
    the end."""

    t: Array
    pressure: Array
    mean: Array
    energy: Array
    velocities: Array
    dt: float


def collide(
    case: TwoBars, d: int, courant: float, *, triangles: bool = False, **how: Any
) -> Collision:
    """Two bars, or strips with nu = 0, that touch at the start; rho = 1, so that c = z."""
    h = case.length1 / ELEMENTS
    section = {1: 1.0, 2: ACROSS * h}[d]

    def bar(length: float) -> BlockMesh:
        cells = round(length / h)
        lengths, divisions = (
            ((length,), (cells,)) if d == 1 else ((section, length), (ACROSS, cells))
        )
        return BlockMesh(lengths=lengths, divisions=divisions, simplices=triangles)

    mesh, tags = build_mesh(
        mesh_of := TwoBlocks(lower=bar(case.length1), upper=bar(case.length2)), COMM
    )
    cells = (
        (tags["lower"], LinearElastic(case.c1**2, 0.0, 1.0)),
        (tags["upper"], LinearElastic(case.c2**2, 0.0, 1.0)),
    )
    system = assemble(mesh, cells)
    system = thrown(
        system, lambda x: case.speed * np.tile(np.eye(d)[-1], (len(x), 1)), np.zeros_like
    )
    problem = ContactProblem(
        system, contact_pair(system, *(tags[side] for side in mesh_of.interface))
    )
    dt, rows = courant * h / max(case.c1, case.c2), []
    for state, report in march(problem, dt=dt, steps=round(1.5 * case.duration / dt), **how):
        assert report.certificate.worst <= 1e-9
        equations = report.problem.equations
        energy = equations.kinetic_energy(state.v) + equations.strain_energy(state.u)
        rows.append(
            (
                state.t,
                *COMM.allreduce(np.array([state.r_n.sum(), report.balance.r_n.sum()])),
                energy,
            )
        )
    t, *values = np.array(rows).T
    masses = section * np.array([case.length1, case.length2])
    return Collision(
        t, *(x / section for x in values), momenta(report.problem, state.v)[:, -1] / masses, dt
    )


BODIES: dict[str, dict[str, Any]] = {
    "bars": {"d": 1},
    "strips": {"d": 2},
    "triangles": {"d": 2, "triangles": True},
}


@pytest.mark.serial
@pytest.mark.parametrize(
    ("body", "courant"),
    [
        ("bars", 1.0),
        ("bars", 0.5),
        pytest.param("bars", 0.1, marks=pytest.mark.serial),
        ("strips", 0.5),
        ("triangles", 1.0),
    ],
)
def test_v1_4_default_scheme(body, courant):
    """Pressure rho c v0/2 in the mean within 0.2 %, at every step within 3 %; duration 2 L1/c
    within 5 %, velocities and restitution L1/L2 within 1.5 %, energy kept to 1 %."""
    case = TwoBars(length1=1.0, length2=2.0)
    found = collide(case, courant=courant, **BODIES[body])
    window = (found.t > 0.1 * case.duration) & (found.t < 0.9 * case.duration)
    assert found.mean[window].mean() == pytest.approx(case.pressure, rel=2e-3)
    assert np.abs(found.pressure[window] / case.pressure - 1.0).max() < 0.03
    assert found.t[found.pressure > 0.5 * case.pressure][-1] == pytest.approx(
        case.duration, rel=0.05
    )
    assert found.mean.sum() * found.dt == pytest.approx(case.impulse, rel=0.01)
    assert found.velocities == pytest.approx(
        [case.velocity1, case.velocity2], abs=0.01 * case.speed
    )
    restitution = (found.velocities[1] - found.velocities[0]) / case.speed
    assert restitution == pytest.approx(case.restitution, abs=0.015)
    assert np.abs(found.energy / found.energy[0] - 1.0).max() < 0.01


@pytest.mark.serial
def test_v1_4_other_impedances():
    """A soft bar on a stiff one, z2 = 3: p = v0 z1 z2/(z1 + z2)."""
    case = TwoBars(length1=1.0, length2=4.0, z1=1.0, c1=1.0, z2=3.0, c2=3.0)
    found = collide(case, 1, 0.5)
    window = (found.t > 0.1 * case.duration) & (found.t < 0.9 * case.duration)
    assert found.mean[window].mean() == pytest.approx(0.75, rel=5e-3)
    assert found.mean.sum() * found.dt == pytest.approx(case.impulse, rel=0.01)
    assert found.velocities == pytest.approx([case.velocity1, case.velocity2], abs=0.01)


@pytest.mark.serial
@pytest.mark.parametrize("body", BODIES)
def test_v1_4_contact_stabilised(body):
    """Consistent mass, Courant number 1: pressure at every step within 1.5 %, duration, velocities
    within 1 %; no step gains energy."""
    case = TwoBars(length1=1.0, length2=2.0)
    found = collide(case, courant=1.0, scheme=ContactStabilisedNewmark(), **BODIES[body])
    window = (found.t > 0.1 * case.duration) & (found.t < 0.9 * case.duration)
    assert np.abs(found.pressure[window] / case.pressure - 1.0).max() < 0.015
    assert found.velocities == pytest.approx([case.velocity1, case.velocity2], abs=0.005)
    assert np.diff(found.energy).max() < 1e-11 * found.energy[0]


# V2.1
# --------------------------------------------------------------------------------------------------

P = 1.0e8
STEEL, BRASS = (
    LinearElastic(E=2.1e11, nu=0.3, rho=7850.0),
    LinearElastic(E=1.0e11, nu=0.2, rho=8400.0),
)


def strains(material: LinearElastic, d: int) -> Array:
    """Of the uniaxial pressure P along y, free sideways, plane strain or space."""
    E, nu = material.E, material.nu
    down, aside = (
        (P * (1.0 - nu**2) / E, nu * (1.0 + nu) * P / E) if d == 2 else (P / E, nu * P / E)
    )
    return np.array([aside, -down, aside])[:d]


@pytest.mark.parametrize(
    "solver", [Condensed(), Volume(method=ReducedNewton())], ids=["condensed", "volume"]
)
@pytest.mark.parametrize("simplices", [False, True], ids=["tensor", "simplices"])
@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("swapped", [False, True], ids=["upper-lower", "lower-upper"])
def test_v2_1_pressure_through_an_interface(d, simplices, solver, swapped):
    """Steel on brass, matching meshes, frictionless: both in their own uniform state, pressure p at
    every node of the interface, to 1e-12, whichever side is the first."""
    mesh = blocks(d, simplices=simplices)
    low, high = strains(BRASS, d), strains(STEEL, d)

    def lower(x: Array) -> Array:
        return x * low

    def upper(x: Array) -> Array:
        return x * high + np.eye(d)[1] * (low[1] - high[1]) * mesh.lower.lengths[1]

    built, tags = build_mesh(mesh, COMM)
    hold = [
        Prescribed(tags[f"{name}_{side}"], components=(i,))
        for name in ("lower", "upper")
        for side, i in (("left", 0), ("back", 2))[: d - 1]
    ]
    hold += [
        Prescribed(tags["lower_bottom"], components=(1,)),
        held_by(tags, "upper_top", upper, 1),
    ]
    system = assemble(built, [(tags["lower"], BRASS), (tags["upper"], STEEL)], prescribed=hold)
    sides = [tags[side] for side in mesh.interface]
    surface = contact_pair(system, *(sides[::-1] if swapped else sides))
    problem = ContactProblem(system, surface)
    state = static_equilibrium(problem, solver=solver)
    exact = per_body(system, lower, upper)
    found = problem.cartesian(state.u)
    error, size = (
        float(COMM.allreduce(float(np.abs(x).max(initial=0.0)), op=MPI.MAX))
        for x in (found - exact, exact)
    )
    assert error < 1e-12 * size
    assert (
        np.abs(surface.everywhere(state.r_n / surface.weights) / P - 1.0).max() < 1e-12
        and state.active.all()
    )


# Dynamics
# --------------------------------------------------------------------------------------------------


def meeting(
    comm: Any,
    d: int = 2,
    *,
    friction: Any = None,
    mass: Any = None,
    angle: float = 0.3,
    fine: int = 1,
) -> ContactProblem:
    """The upper block thrown obliquely, and turning, on the free lower one; nothing else acts on
    them."""
    divisions = tuple(fine * n for n in (6, 5, 4))
    mesh = blocks(d, angle=angle, gap=1e-3, upper=divisions, lower=divisions, simplices=d == 2)
    system, tags = two_blocks(comm, mesh)

    def throw(x: Array) -> Array:
        v = np.outer(2.0 + 0.3 * x[:, 0], np.eye(d)[1])
        v[:, :2] = turned(-v[:, :2] + [1.5, 0.0], angle)
        return v

    system = thrown(system, np.zeros_like, throw)
    surface = contact_pair(system, *(tags[side] for side in mesh.interface))
    return ContactProblem(system, surface, friction=friction or Frictionless(), mass=mass)


ROUTES = [(Midpoint(), ConsistentMass()), (Trapezoidal(), Redistributed())]
routes = pytest.mark.parametrize(("scheme", "mass"), ROUTES, ids=["midpoint", "trapezoidal"])
frictions = pytest.mark.parametrize("friction", [None, Coulomb(0.3)], ids=["smooth", "rough"])


@pytest.mark.serial
@routes
@frictions
@pytest.mark.parametrize("d", [2, 3])
def test_v9_8_what_one_body_gains_the_other_loses(d, friction, scheme, mass):
    """Momenta of the bodies change by the impulse of the contact forces and by its opposite, to
    1e-12 of the largest; every step is certified to 1e-9, with sliding and sticking points; without
    friction no energy is lost beyond the work of the contact conditions."""
    problem = meeting(COMM, d, friction=friction, mass=mass)
    old = momenta(problem, problem.equations.v0)
    start, size, slid = old.sum(axis=0), np.abs(old).max(), []
    for state, report in march(problem, scheme=scheme, dt=1e-3, steps=40):
        assert report.certificate.worst <= 1e-9
        new = momenta(problem, state.v)
        assert new.sum(axis=0) == pytest.approx(start, abs=1e-12 * size)
        impulse = 1e-3 * COMM.allreduce(report.balance.r_n @ problem.surface.normals)
        if friction is None:
            assert new[0] - old[0] == pytest.approx(impulse, abs=1e-12 * size)
            assert new[1] - old[1] == pytest.approx(-impulse, abs=1e-12 * size)
        else:
            limit = friction.limit(state.r_n, problem.surface.weights, 1.0)
            slip = np.linalg.norm(
                problem.surface.tangential_values(report.result.x) - report.step.slip0, axis=1
            )
            slid.append((np.sum(slip[limit > 0.0] > 0.0), np.sum(slip[limit > 0.0] == 0.0)))
        old = new
    assert np.abs(old[0]).max() > 0.1 * size
    if friction is not None:
        assert min(COMM.allreduce(np.sum(slid, axis=0))) > 5


@frictions
@routes
def test_any_number_of_ranks(friction, scheme, mass):
    """The same motion and reactions on all ranks together and on each alone, to 1e-10."""
    together, alone = (
        run(meeting(comm, friction=friction, mass=mass), scheme=scheme, dt=1e-3, steps=40)
        for comm in (COMM, MPI.COMM_SELF)
    )
    assert np.array_equal(together.active, alone.active)
    assert np.abs(together.u - alone.u).max() < 1e-10 * np.abs(alone.u).max()
    assert np.abs(together.r_n - alone.r_n).max() < 1e-9 * alone.r_n.max()


@pytest.mark.slow
@pytest.mark.parametrize("d", [2, 3])
@routes
def test_condensed_and_volume_agree(d, scheme, mass):
    """Every step from the same state, to 1e-9."""
    solvers = (Condensed(), Volume(method=ReducedNewton()))
    compared = cross_check(
        meeting(COMM, d, mass=mass), scheme=scheme, solvers=solvers, dt=1e-3, steps=15
    )
    assert compared.worst <= 1e-9


@pytest.mark.serial
@pytest.mark.parametrize("frictional", [False, True])
@pytest.mark.parametrize("d", [1, 2, 3])
def test_redistributed_mass_keeps_the_inertia_of_each_body(d, frictional):
    """Mass, first and second moments: rigid motions of one body have the same kinetic energy, and
    none with the other body, to 1e-12."""
    mesh = blocks(d, angle=0.3 if d > 1 else 0.0, upper=(6, 5, 4), lower=(5, 5, 4))
    lower = replace(mesh.lower, divisions=mesh.upper.divisions)
    system, tags = two_blocks(COMM, replace(mesh, lower=lower))
    surface = contact_pair(system, *(tags[side] for side in mesh.interface))
    friction = Coulomb(0.3) if frictional else Frictionless()
    laws = ConsistentMass(), Redistributed()
    problems = [ContactProblem(system, surface, friction=friction, mass=law) for law in laws]
    rigid = [nodal(system, lambda x, e=e: np.tile(e, (len(x), 1))) for e in np.eye(d)]
    for i in range(d):
        for j in range(i + 1, d):
            plane = np.eye(d)[i], np.eye(d)[j]
            rigid.append(
                nodal(
                    system, lambda x, p=plane: np.outer(x @ p[0], p[1]) - np.outer(x @ p[1], p[0])
                )
            )
    motions = [motion * (system.space.bodies == body) for body in (0, 1) for motion in rigid]
    grams = []
    for problem in problems:
        columns = np.column_stack([relative(problem, motion) for motion in motions])
        inertia = np.column_stack([problem.equations.M @ column for column in columns.T])
        grams.append(system.algebra.comm.sum(columns.T @ inertia))
    assert np.abs(grams[1] - grams[0]).max() < 1e-12 * np.abs(grams[0]).max()
    half = len(motions) // 2
    assert np.abs(grams[1][:half, half:]).max() < 1e-12 * np.abs(grams[0]).max()


@pytest.mark.serial
@pytest.mark.parametrize("simplices", [False, True], ids=["tensor", "simplices"])
@pytest.mark.parametrize("d", [2, 3])
def test_welded_blocks_move_like_one(d, simplices):
    """A welded interface is none: the motion of the single block, to 1e-10."""
    mesh = blocks(d, simplices=simplices, lower=(4, 3, 3))

    def throw(x: Array) -> Array:
        return np.cos(2.0 * x + 0.3)

    one, two = mesh.interface
    built, _ = build_mesh(Welded(mesh, two, one), COMM)
    lengths, divisions = list(mesh.lower.lengths), list(mesh.lower.divisions)
    lengths[1], divisions[1] = 2.0 * lengths[1], 2 * divisions[1]
    whole, _ = block(COMM, lengths=tuple(lengths), divisions=tuple(divisions), simplices=simplices)
    results = []
    for body in (built, whole):
        system = assemble(body, SOFT, initial_velocity=throw)
        found = run(without_contact(system), scheme=Midpoint(), dt=1e-3, steps=20)
        points = np.round(field(system, system.u0)[0], 9)
        results.append(found.u[:, np.lexsort(points.T)])
    assert results[0].shape == results[1].shape
    assert np.abs(results[0] - results[1]).max() < 1e-10 * np.abs(results[1]).max()
