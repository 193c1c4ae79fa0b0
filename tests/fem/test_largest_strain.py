"""The largest shear strain of every cell over a run (V8.8)."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest
from fem_problems import linear
from soil import SOIL

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.meshes.block import BlockMesh

SHEAR, AXIAL = np.zeros((3, 3)), np.zeros((3, 3))
SHEAR[0, 1], AXIAL[1, 1] = 1.0, 1.0


def followed(comm, d, strains, *, begin=None, **spec):
    """Values after states of uniform gradients: strains are 1e-3 times those."""
    mesh, _ = fem.build_mesh(
        BlockMesh(lengths=(2.0, 1.0, 1.0)[:d], divisions=(3, 2, 2)[:d], **spec), comm
    )
    problem = linear(fem.assemble(mesh, SOIL))
    points = problem.system.space.points

    def state(gradient):
        u = problem.system.space.restrict(1e-3 * points @ gradient[:d, :d].T)
        return vc.State(0.0, 0, u, 0.0 * u, np.zeros(0), np.zeros(0, dtype=bool))

    found = vc.LargestStrain()
    found.start(problem, state(np.zeros((3, 3)) if begin is None else begin))
    for gradient in strains:
        row = found.row(SimpleNamespace(new=state(gradient)))
    assert len(found.values) == mesh.topology.index_map(d).size_local
    return 1e3 * found.values, 1e3 * row["largest_shear_strain"]


@pytest.mark.parametrize("simplices", [True, False])
@pytest.mark.parametrize(("d", "axial"), [(2, 1.0), (3, 2.0 / np.sqrt(3.0))])
def test_uniform_strains(comm, d, axial, simplices):
    """Simple shear is gamma_xy; along one axis it is the difference of principal strains in the
    plane, and in space sqrt(2 dev:dev); turned bodies are not strained; the largest one stays."""
    for gradients, value in (
        ([SHEAR], 1.0),
        ([-SHEAR], 1.0),
        ([AXIAL], axial),
        ([SHEAR - SHEAR.T], 0.0),
        ([0.5 * SHEAR, 2.0 * AXIAL, SHEAR], 2.0 * axial),
    ):
        each, largest = followed(comm, d, gradients, simplices=simplices)
        assert np.allclose(each, value, atol=1e-12) and abs(largest - value) < 1e-12


def test_strains_of_the_start_do_not_count(comm):
    each, largest = followed(comm, 2, [AXIAL + 0.25 * SHEAR], begin=AXIAL)
    assert np.allclose(each, 0.25, rtol=1e-9) and largest == pytest.approx(0.25)


def test_what_it_refuses(comm):
    mesh, _ = fem.build_mesh(BlockMesh(lengths=(2.0,), divisions=(3,)), comm)
    problem = linear(fem.assemble(mesh, SOIL))
    zero = vc.State(
        0.0, 0, problem.system.u0, problem.system.v0, np.zeros(0), np.zeros(0, dtype=bool)
    )
    with pytest.raises(InputError, match="on a line has no shear strain"):
        vc.LargestStrain().start(problem, zero)
    with pytest.raises(InputError, match="run from the start"):
        vc.LargestStrain().start(problem, zero, {"largest_shear_strain": 1e-3})
