"""Boundary elements on the boundary of a finite element mesh, on any number of ranks."""

from __future__ import annotations

import numpy as np
import pytest
from fem_problems import block
from mpi4py import MPI

from demos.parts.problems.boundary_curve import boundary_curve
from vi_contact.core.errors import InputError
from vi_contact.fem.mesh import node_numbers

COMM = MPI.COMM_WORLD


def test_sides_of_a_block():
    """Sides keep their labels, normals point out, nodes know their number, all ranks have the same
    mesh."""
    mesh, tags = block(COMM, lengths=(2.0, 1.5), divisions=(5, 4), simplices=True)
    names = ("bottom", "right", "top", "left")
    curve, numbers = boundary_curve(*(tags[name] for name in names))
    assert len(curve) == 18 and curve.area == pytest.approx(3.0) and len(set(numbers)) == 18
    for label, normal in enumerate([(0, -1), (1, 0), (0, 1), (-1, 0)]):
        chosen = curve.labels == label
        assert chosen.sum() == (5, 4)[label % 2] and np.allclose(curve.normals[chosen], normal)
    first = COMM.bcast((curve.points, curve.labels, numbers))
    assert all(
        np.array_equal(a, b)
        for a, b in zip(first, (curve.points, curve.labels, numbers), strict=True)
    )
    here = dict(zip(node_numbers(mesh).tolist(), mesh.geometry.x[:, :2], strict=True))
    assert all(
        np.array_equal(here[n], point)
        for n, point in zip(numbers, curve.points, strict=True)
        if n in here
    )


def test_what_is_refused():
    mesh, tags = block(COMM, lengths=(2.0, 1.5), divisions=(5, 4))
    with pytest.raises(InputError, match="open or branches"):
        boundary_curve(tags["bottom"], tags["right"], tags["top"])
    with pytest.raises(InputError, match="two-dimensional"):
        boundary_curve(block(COMM, lengths=(1.0, 1.0, 1.0), divisions=(2, 2, 2))[1]["bottom"])
