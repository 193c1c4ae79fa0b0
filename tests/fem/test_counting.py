"""The census of a contact boundary: how many nodes, how many conditions, and where the others
are."""

import numpy as np
import pytest
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.meshes import BlockMesh, TwoBlocks

MATERIAL = vc.LinearElastic(E=1e9, nu=0.3, rho=2000.0)


def test_clamped_and_listed_nodes_are_told():
    mesh, tags = fem.build_mesh(BlockMesh(lengths=(2.0, 1.0), divisions=(8, 4)), MPI.COMM_WORLD)
    system = fem.assemble(mesh, MATERIAL, clamped=tags["left"])
    bottom = fem.contact_surface(system, tags["bottom"])
    right = fem.contact_surface(system, tags["right"], points=[(2.0, 0.5)])
    joined = fem.joined_surfaces(bottom, right).moving(towards=lambda t: 0.0).whole()
    first, second = joined.censuses
    assert (first.name, first.nodes, first.points) == ("bottom", 9, 8)
    assert {kind: points.tolist() for kind, points in first.places.items()} == {
        "fixed": [[0.0, 0.0]]
    }
    assert (second.name, second.nodes, second.points) == ("right", 5, 1)
    assert list(second.places) == ["not listed"]
    assert sorted(second.places["not listed"][:, 1]) == [0.0, 0.25, 0.75, 1.0]


@pytest.mark.parametrize("width", [1.0, 3.0])
def test_nodes_that_face_nothing_are_told(width):
    lower, upper = (
        BlockMesh(lengths=(width, 0.2), divisions=(20, 2)),
        BlockMesh(lengths=(1.0, 1.0), divisions=(7, 4)),
    )
    mesh, tags = fem.build_mesh(TwoBlocks(lower=lower, upper=upper), MPI.COMM_WORLD)
    system = fem.assemble(mesh, MATERIAL, clamped=tags["lower_bottom"])
    surface = fem.contact_pair(
        system, tags["lower_top"], tags["upper_bottom"], matching=fem.DualMortar()
    )
    (census,) = surface.censuses
    assert (census.name, census.nodes, census.points) == ("lower_top", 21, surface.total)
    alone = census.places.get("in front of nothing", np.zeros((0, 2)))
    carried = census.places.get("partly covered", np.zeros((0, 2)))
    assert len(alone) + len(carried) == 21 - surface.total
    assert np.all(carried[:, 0] < 1.1)
    assert np.all(alone[:, 0] > 1.0)
