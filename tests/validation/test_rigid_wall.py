"""A soil layer accelerated against a rigid smooth wall, S3.3: thrust and its height, contact while
pressed."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("dolfinx")
from mpi4py import MPI
from rigid_wall import RigidWall

from vi_contact import (
    Condensed,
    ContactProblem,
    HalfSpace,
    LinearElastic,
    State,
    fem,
    static_equilibrium,
)
from vi_contact.meshes.block import BlockMesh

pytestmark = pytest.mark.serial
HEIGHT, LENGTH, G = 10.0, 100.0, 9.81


def pressed(
    nu: float,
    acceleration: float,
    *,
    cells: int = 40,
    gravity: float = 0.0,
    surcharge: float = 0.0,
    bilateral: bool = True,
) -> tuple[ContactProblem, State]:
    """A layer of LENGTH on rock; body force towards the wall at x = 0; the far side does not
    settle."""
    soil = LinearElastic(E=1e8, nu=nu, rho=1900.0)
    divisions = (round(LENGTH / HEIGHT) * cells, cells)
    mesh, tags = fem.build_mesh(
        BlockMesh(lengths=(LENGTH, HEIGHT), divisions=divisions), MPI.COMM_SELF
    )
    loads = [
        fem.BodyForce((-soil.rho * acceleration, -soil.rho * gravity)),
        fem.Traction(tags["top"], (0.0, -surcharge)),
    ]
    # the far side: free to move horizontally; vertically it is held, unless the layer settles
    sides = fem.Prescribed(tags["right"], components=(0,) if gravity or surcharge else (1,))
    system = fem.assemble(mesh, soil, clamped=tags["bottom"], prescribed=sides, loads=loads)
    wall = HalfSpace(point=(0.0, 0.0), normal=(1.0, 0.0))
    surface = fem.contact_surface(system, tags["left"], obstacle=wall)
    problem = ContactProblem(system, surface.bilateral_everywhere() if bilateral else surface)
    return problem, static_equilibrium(problem, solver=Condensed())


@pytest.mark.parametrize(
    ("nu", "thrust", "height"), [(0.3, 0.960, 0.576), (1 / 3, 0.987, 0.572), (0.4, 1.049, 0.564)]
)
def test_smooth_bilateral_wall(nu: float, thrust: float, height: float):
    """Q and h within 1 % of the published plane-strain values (measured 0.2 and 0.2 %), 7 % of the
    1D theory."""
    problem, state = pressed(nu, 2.0)
    y = problem.surface.points[:, 1]
    thrusts = state.r_n.sum()
    assert thrusts / (1900.0 * 2.0 * HEIGHT**2) == pytest.approx(thrust, rel=0.01)
    assert (state.r_n @ y) / thrusts / HEIGHT == pytest.approx(height, rel=0.01)
    assert thrusts == pytest.approx(RigidWall(HEIGHT, 1900.0, nu).thrust(2.0), rel=0.07)


def test_unilateral_while_the_ground_presses():
    """Gravity and a surcharge first: the same as bilateral while all pressures are positive;
    beyond, a gap opens."""

    def added(acceleration: float, bilateral: bool) -> tuple[ContactProblem, State]:
        return pressed(0.3, acceleration, cells=12, gravity=G, surcharge=1e5, bilateral=bilateral)

    problem, rest = added(0.0, bilateral=False)
    assert rest.active.all() and rest.r_n.min() > 0.0
    for acceleration in (1.0, -1.0):
        _, held = added(acceleration, bilateral=True)
        _, state = added(acceleration, bilateral=False)
        assert held.r_n.min() > 0.0 and state.active.all()
        assert np.abs(state.r_n - held.r_n).max() <= 1e-9 * held.r_n.max()
    _, held = added(-6.0, bilateral=True)
    _, state = added(-6.0, bilateral=False)
    open_ = ~state.active
    assert held.r_n.min() < 0.0 and open_.any() and not open_.all()
    assert problem.surface.gap(0.0)[open_].max() == 0.0
    assert (problem.surface.gap(0.0) - problem.surface.normal_values(state.u))[open_].min() > 0.0
    assert problem.surface.points[open_, 1].min() > problem.surface.points[state.active, 1].min()
