"""Schemes on finite elements: volume and condensed routes take the same steps, on any number of
ranks."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from energy_checks import course
from fem_problems import WALL_DT, run, shaken_wall
from mpi4py import MPI

from vi_contact.core.obstacles import HalfSpace
from vi_contact.core.problem import ContactProblem
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.contact.surface import contact_surface
from vi_contact.fem.mesh.tagged_mesh import build_mesh
from vi_contact.laws.friction import Coulomb, Tresca
from vi_contact.laws.mass import ConsistentMass, Redistributed
from vi_contact.laws.materials import LinearElastic
from vi_contact.meshes.block import BlockMesh
from vi_contact.run.cross_check import cross_check
from vi_contact.run.march import march
from vi_contact.run.time_steps import HalvedAtImpact
from vi_contact.schemes.contact_stabilised import ContactStabilisedNewmark
from vi_contact.schemes.moreau_jean import MoreauJean
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.volume.route import ReducedNewton, Volume

STEPS = 80
SCHEMES = {
    "stabilised": ContactStabilisedNewmark(),
    "inelastic": MoreauJean(),
    "restitution": MoreauJean(0.5, 0.5),
}


def wall(comm: Any, **law: Any) -> ContactProblem:
    """The oblique wall, a fiftieth of a millimetre from the ground that will hit it."""
    return replace(
        shaken_wall(comm, angle=0.3, gap=2e-5, divisions=(5, 8)),
        impact=None,
        mass=ConsistentMass(),
        **law,
    )


@pytest.fixture(params=SCHEMES.values(), ids=SCHEMES.keys())
def scheme(request: pytest.FixtureRequest) -> Any:
    return request.param


@pytest.mark.two_ranks
def test_volume_and_condensed_routes_take_the_same_steps(scheme: Any) -> None:
    """V4.0, step by step: bounds on displacements and, where contact is predicted, on velocities
    (+inf elsewhere)."""
    solvers = (Condensed(), Volume(method=ReducedNewton()))
    checked = cross_check(
        wall(MPI.COMM_WORLD), scheme=scheme, solvers=solvers, dt=WALL_DT, steps=STEPS
    )
    assert len(checked.report()) == 1
    assert checked.worst <= 1e-9


@pytest.mark.long
@pytest.mark.parametrize(
    "dt", [WALL_DT, HalvedAtImpact(WALL_DT, halvings=2)], ids=["whole", "halved"]
)
def test_default_scheme_takes_the_same_steps(dt: Any) -> None:
    """V4.0: no scheme and no mass named, so redistributed mass and the trapezoidal rule; steps may
    be halved."""
    problem = replace(wall(MPI.COMM_WORLD), mass=None)
    solvers = (Condensed(), Volume(method=ReducedNewton()))
    checked = cross_check(problem, solvers=solvers, dt=dt, steps=STEPS)
    accepted = [report for _, report in march(problem, dt=dt, steps=STEPS)]
    assert (
        accepted[0].problem.mass == Redistributed()
        and accepted[0].problem.equations.massless is not None
    )
    closed = {MPI.COMM_WORLD.allreduce(int(report.new.active.sum())) for report in accepted}
    assert len(closed) > 3  # contact opens and closes
    assert [one.steps for one in checked.found] == [len(accepted)] and len(accepted) >= STEPS
    assert 0.0 < checked.worst <= 1e-9


@pytest.mark.parametrize(
    "law",
    [{}, pytest.param({"friction": Coulomb(0.4)}, marks=pytest.mark.slow)],
    ids=["frictionless", "Coulomb"],
)
def test_ranks_agree_and_contact_opens_and_closes(scheme: Any, law: dict[str, Any]) -> None:
    """Rank independence, certified steps, several points in contact at a time."""
    together, alone = (
        run(wall(comm, **law), dt=WALL_DT, steps=STEPS, scheme=scheme)
        for comm in (MPI.COMM_WORLD, MPI.COMM_SELF)
    )
    assert np.abs(together.u - alone.u).max() <= 1e-9 * np.abs(alone.u).max()
    assert np.abs(together.r_n - alone.r_n).max() <= 1e-8 * alone.r_n.max()
    assert together.certificate.max() <= 1e-9
    count = alone.active.sum(axis=1)
    assert count.min() == 0 and count.max() >= 3 and np.sum(np.diff(count) < 0) >= 3


@pytest.mark.serial
@pytest.mark.parametrize(
    ("scheme", "law", "gain"),
    [
        (MoreauJean(e=1.0), Coulomb(0.6), 0.030),
        (MoreauJean(), Tresca(3.0), 0.0026),
        (MoreauJean(), Coulomb(0.6), 0.0),
        (MoreauJean(1.0), Tresca(3.0), 0.0),
        (MoreauJean(1.0), Coulomb(0.6), 0.0),
    ],
)
def test_friction_of_impulses_may_add_energy(scheme: MoreauJean, law: Any, gain: float) -> None:
    """V9.3 is about the normal direction: where sliding turns within a step, the mean velocity and
    the friction at its end may have the same direction. The gains that docs/guide/schemes.md
    prints; none at theta = 1."""
    mesh, tags = build_mesh(BlockMesh(lengths=(1.0, 1.0), divisions=(8, 8)), MPI.COMM_SELF)
    system = assemble(mesh, LinearElastic(E=1000.0, nu=0.3, rho=1.0), initial_velocity=(0.5, -1.0))
    ground = HalfSpace(point=(0.0, -0.05), normal=(0.0, 1.0))
    surface = contact_surface(system, tags["bottom"], obstacle=ground)
    problem = ContactProblem(system, surface, friction=law, mass=ConsistentMass())
    found = course(problem, scheme, dt=0.02, steps=25)
    largest = np.array([found.rise, -found.friction]) / found.first
    assert np.maximum(largest, 0.0) == pytest.approx([gain, gain], rel=0.02, abs=1e-11)
    assert abs(found.defect) <= 1e-10 * found.largest
