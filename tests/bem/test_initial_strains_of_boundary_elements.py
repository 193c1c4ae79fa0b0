"""A uniform initial strain on the boundary: the body takes the tractions C eps_0 n, beside finite
elements (V8.10)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
from bem_rod import smooth_load
from mpi4py import MPI
from plane_waves import MATERIAL, SQUARE

from vi_contact import fem, meshes
from vi_contact.bem import (
    BoundaryProblem,
    EnergeticBlocks,
    PoincareSteklov,
    energetic_blocks,
    polygon,
    traction_forces,
)
from vi_contact.core.algebra import Array
from vi_contact.core.problem import ContactProblem
from vi_contact.core.surfaces import empty_surface
from vi_contact.run.march import march
from vi_contact.schemes.midpoint import Midpoint
from vi_contact.solvers.condensed import Condensed

pytestmark = pytest.mark.serial
WARM = 1e-3
# C eps_0 of all directions: a pressure
STRESS = (3.0 * MATERIAL.lame_lambda + 2.0 * MATERIAL.shear_modulus) * WARM


def warmed(blocks: EnergeticBlocks, history: Callable[[float], float], *, rollers: bool) -> Array:
    """Displacement (steps, 2, n) of a square warmed by WARM * history(t), on rollers below and
    left, or held below."""
    mesh = blocks.mesh
    forces = traction_forces(
        mesh, lambda x, n, t: STRESS * history(t) * n, dt=blocks.dt, steps=blocks.steps
    )
    low, left = (np.isclose(mesh.points[:, axis], -0.5) for axis in (1, 0))
    fixed = np.array([left if rollers else low, low])
    return (
        BoundaryProblem(PoincareSteklov(blocks, MATERIAL.rho), forces, fixed=fixed)
        .solve()
        .displacement
    )


@pytest.mark.long
def test_slow_warming_expands_a_square():
    """u = (1 + nu) eps_0 x from the corner of the rollers in plane strain, so that nothing is left
    of the stress."""
    blocks = energetic_blocks(polygon(SQUARE, 0.25), MATERIAL, dt=1.0, steps=60)
    u = warmed(blocks, lambda t: float(np.tanh((t / 20.0) ** 2)), rollers=True)[-1]
    exact = (1.0 + MATERIAL.nu) * WARM * (blocks.mesh.points.T + 0.5)
    assert np.abs(u - exact).max() < 2e-5 * exact.max()  # 5.7e-6


@pytest.mark.long
def test_warming_in_time_is_that_of_finite_elements():
    """A square on a rigid base under a smooth warming: its corner in three crossings, beside 20 x
    20 finite elements with an ``InitialStrain``. Both together are 1.8 % apart; 20 elements a side
    and 40 x 40 cells 0.6 %."""
    blocks = energetic_blocks(polygon(SQUARE, 0.1), MATERIAL, dt=0.1, steps=30)
    u = warmed(blocks, smooth_load, rollers=False)
    mesh, tags = fem.build_mesh(
        meshes.BlockMesh(lengths=(1.0, 1.0), divisions=(20, 20), corner=(-0.5, -0.5)), MPI.COMM_SELF
    )
    system = fem.assemble(
        mesh, MATERIAL, clamped=tags["bottom"], loads=fem.InitialStrain(WARM, history=smooth_load)
    )
    problem = ContactProblem(system, empty_surface(system.space.comm, 2))
    corner = np.flatnonzero(np.all(np.isclose(blocks.mesh.points, 0.5), axis=1))
    nodes = system.space.find_nodes(np.array([[0.5, 0.5]]))
    found = np.array(
        [
            system.space.sample(state.u, nodes, state.t)[0]
            for state, _ in march(
                problem, scheme=Midpoint(), solver=Condensed(), dt=0.025, steps=120
            )
        ]
    )[3::4]
    away = np.abs(u[:, :, corner[0]] - found).max() / np.abs(found).max()
    assert away < 0.054
