"""Directions of obstacles against the normals of the facets that they can reach."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.algebra import Array
from vi_contact.core.errors import InputError
from vi_contact.meshes import BlockMesh

COMM = MPI.COMM_WORLD
GROUND = vc.HalfSpace(point=(0.0, -2.0), normal=(0.0, 1.0))


def surface_of(
    name: str, obstacle: Any, lengths: tuple[float, float] = (2.0, 1.0)
) -> vc.ContactSurface:
    """A side of a block before an obstacle."""
    mesh, tags = fem.build_mesh(BlockMesh(lengths=lengths, divisions=(4, 3)), COMM)
    system = fem.assemble(mesh, vc.LinearElastic(E=1e9, nu=0.3, rho=2000.0))
    return fem.contact_surface(system, tags[name], obstacle=obstacle)


@pytest.mark.parametrize(
    ("name", "angle", "words"),
    [
        ("left", 90, "is along the boundary"),
        ("top", 180, "points into the body"),
        ("right", 90, "is along"),
    ],
)
def test_a_face_that_the_obstacle_never_reaches_is_refused_once(name, angle, words):
    with pytest.raises(
        InputError, match=rf"of '{name}' {words}.* at {angle} degrees to its mean outward normal"
    ):
        surface_of(name, GROUND)


def test_a_direction_of_ones_own_along_the_face_is_refused():
    class Sideways:
        def directions(self, points: Array, normals: Array) -> Array:
            return np.tile((1.0, 0.0), (len(points), 1))

        def gap(self, points: Array, normals: Array) -> Array:
            return np.zeros(len(points))

    with pytest.raises(
        InputError, match=r"Sideways: .* 'bottom' is along the boundary.* 90 degrees"
    ):
        surface_of("bottom", Sideways())


def test_the_far_side_of_a_round_body_is_let_be():
    """A disc on the ground: the normals of its upper half look away from the direction, and can
    never touch."""

    def bend(x: Array) -> Array:
        return np.column_stack([x[:, 0] * np.cos(x[:, 1]), x[:, 0] * np.sin(x[:, 1])])

    ring = BlockMesh(
        lengths=(0.5, 1.5 * np.pi), divisions=(3, 24), corner=(1.0, -0.75 * np.pi), deform=bend
    )
    mesh, tags = fem.build_mesh(ring, COMM)
    system = fem.assemble(mesh, vc.LinearElastic(E=1e9, nu=0.3, rho=2000.0))
    surface = fem.contact_surface(system, tags["right"], obstacle=GROUND)
    gaps = surface.everywhere(surface.gap0)
    points = surface.whole().points
    assert surface.total == 25
    assert gaps == pytest.approx(points[:, 1] + 2.0, abs=1e-12)
    inner = vc.HalfSpace(point=(0.0, 3.0), normal=(0.0, 1.0))
    with pytest.raises(InputError, match="penetrates its obstacle"):
        fem.contact_surface(system, tags["right"], obstacle=inner)


def test_a_wrong_sign_on_a_part_of_a_face_is_refused():
    class HalfWrong:
        def directions(self, points: Array, normals: Array) -> Array:
            return normals * np.where(points[:, :1] > 1.0, -1.0, 1.0)

        def gap(self, points: Array, normals: Array) -> Array:
            return np.where(points[:, 0] > 1.0, 0.2, 0.1)

    with pytest.raises(InputError, match=r"HalfWrong: .*points into the body at 180 degrees"):
        surface_of("bottom", HalfWrong())
