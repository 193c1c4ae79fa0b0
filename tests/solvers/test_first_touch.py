"""The step in which a body in free flight first touches: its load is but rounding."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.meshes import BlockMesh
from vi_contact.solvers import ReducedNewton, SemismoothNewton, TaoTron

SOFT = vc.LinearElastic(E=1.0e7, nu=0.3, rho=1000.0)


def throw_block(mu: float) -> vc.ContactProblem:
    """Return a block that flies obliquely onto an inclined plane, where one corner lands first."""
    block = BlockMesh(lengths=(2.0, 1.0), divisions=(6, 3))
    mesh, tags = fem.build_mesh(block, MPI.COMM_WORLD)
    system = fem.assemble(mesh, SOFT, initial_velocity=(1.0, -1.0))
    plane = vc.HalfSpace((0.0, -1e-3), (0.1, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], obstacle=plane)
    friction = vc.Coulomb(mu) if mu else vc.Frictionless()
    return vc.ContactProblem(system, surface, friction=friction, mass=vc.ConsistentMass())


@pytest.mark.parametrize(
    ("method", "mu"),
    [
        (ReducedNewton(), 0.3),
        (ReducedNewton(), 0.0),
        (SemismoothNewton(), 0.0),
        (TaoTron(), 0.0),
    ],
    ids=["reduced-rough", "reduced-smooth", "semismooth-smooth", "tron-smooth"],
)
def test_the_first_touch_needs_no_load_as_unit(method: object, mu: float) -> None:
    """Newmark's increments leave no load in free flight but rounding. The reactions of the first
    touch are 1e15 times that; PETSc is handed forces in the unit of what the bounds press back."""
    problem = throw_block(mu)
    steps = {}
    for name, solver in (("condensed", vc.Condensed()), ("volume", vc.Volume(method))):
        stepper = vc.Stepper(problem, scheme=vc.Newmark(0.25, 0.5), solver=solver)
        for _ in range(40):
            trial = stepper.attempt(6e-5)
            stepper.accept(trial)
            if problem.surface.some(trial.report.result.active):
                break
        steps[name] = trial.report
        assert trial.report.certificate.worst < 1e-10
    landed, volume = steps["condensed"], steps["volume"]
    assert landed.new.k == volume.new.k > 5
    largest = problem.surface.comm.max(np.array([np.abs(landed.result.r_n).max(initial=0.0)]))[0]
    assert largest > 1e3
    assert np.allclose(volume.result.r_n, landed.result.r_n, rtol=0.0, atol=1e-8 * largest)
