"""Schemes on finite elements: volume and condensed routes take the same steps, on any number of ranks."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from fem_problems import WALL_DT, run, shaken_wall
from mpi4py import MPI

from vi_contact.cross_check import cross_check
from vi_contact.friction import Coulomb
from vi_contact.march import march
from vi_contact.mass import ConsistentMass, Redistributed
from vi_contact.schemes.contact_stabilised import ContactStabilisedNewmark
from vi_contact.schemes.moreau_jean import MoreauJean
from vi_contact.solvers.condensed import Condensed
from vi_contact.solvers.volume import OneFactorisation, ReducedNewton, Volume
from vi_contact.step import ContactProblem
from vi_contact.time_steps import HalvedAtImpact

STEPS = 80
SCHEMES = {
    "stabilised": ContactStabilisedNewmark(),
    "inelastic": MoreauJean(),
    "restitution": MoreauJean(0.5, 0.5),
}


def wall(comm: Any, **law: Any) -> ContactProblem:
    """The oblique wall, a fiftieth of a millimetre from the ground that will hit it."""
    return replace(shaken_wall(comm, angle=0.3, gap=2e-5, divisions=(5, 8)), impact=None, mass=ConsistentMass(), **law)


@pytest.fixture(params=SCHEMES.values(), ids=SCHEMES.keys())
def scheme(request: pytest.FixtureRequest) -> Any:
    return request.param


def test_volume_and_condensed_routes_take_the_same_steps(scheme: Any) -> None:
    """V4.0, step by step: bounds on displacements and, where contact is predicted, on velocities (+inf elsewhere)."""
    solvers = (Condensed(), Volume(method=ReducedNewton()), Volume(method=OneFactorisation()))
    checked = cross_check(wall(MPI.COMM_WORLD), scheme=scheme, solvers=solvers, dt=WALL_DT, steps=STEPS)
    assert len(checked.report()) == 2
    assert checked.worst <= 1e-9


@pytest.mark.parametrize("dt", [WALL_DT, HalvedAtImpact(WALL_DT, halvings=2)], ids=["whole", "halved"])
def test_default_scheme_takes_the_same_steps(dt: Any) -> None:
    """V4.0: no scheme and no mass named, so redistributed mass and the trapezoidal rule; steps may be halved."""
    problem = replace(wall(MPI.COMM_WORLD), mass=None)
    solvers = (Condensed(), Volume(method=OneFactorisation()), Volume(method=ReducedNewton()))
    checked = cross_check(problem, solvers=solvers, dt=dt, steps=STEPS)
    accepted = [report for _, report in march(problem, dt=dt, steps=STEPS)]
    assert accepted[0].problem.mass == Redistributed() and accepted[0].problem.equations.massless is not None
    assert len({int(report.new.active.sum()) for report in accepted}) > 3  # contact opens and closes
    assert [one.steps for one in checked.found] == [len(accepted)] * 2 and len(accepted) >= STEPS
    assert 0.0 < checked.worst <= 1e-9


@pytest.mark.parametrize("law", [{}, {"friction": Coulomb(0.4)}], ids=["frictionless", "Coulomb"])
def test_ranks_agree_and_contact_opens_and_closes(scheme: Any, law: dict[str, Any]) -> None:
    """Rank independence, certified steps, several points in contact at a time."""
    together, alone = (
        run(wall(comm, **law), dt=WALL_DT, steps=STEPS, scheme=scheme) for comm in (MPI.COMM_WORLD, MPI.COMM_SELF)
    )
    assert np.abs(together.u - alone.u).max() <= 1e-9 * np.abs(alone.u).max()
    assert np.abs(together.r_n - alone.r_n).max() <= 1e-8 * alone.r_n.max()
    assert together.certificate.max() <= 1e-9
    count = alone.active.sum(axis=1)
    assert count.min() == 0 and count.max() >= 3 and np.sum(np.diff(count) < 0) >= 3
