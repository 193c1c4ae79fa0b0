"""Pressures where side 1 reaches beyond side 2: uniform ones to round-off, whichever side is named
first."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from all_ranks import seen
from mpi4py import MPI

from vi_contact.core.algebra import Array
from vi_contact.core.problem import ContactProblem
from vi_contact.core.surfaces import ContactSurface
from vi_contact.fem.body.assembly import assemble
from vi_contact.fem.body.loads import Prescribed, Traction
from vi_contact.fem.body.space import bodies_of
from vi_contact.fem.contact.mortar import DualMortar
from vi_contact.fem.contact.pairs import contact_pair
from vi_contact.fem.mesh.tagged_mesh import build_mesh
from vi_contact.laws.friction import Coulomb
from vi_contact.laws.materials import LinearElastic
from vi_contact.laws.weight import with_weight
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import Blocks, TwoBlocks
from vi_contact.run.static import static_equilibrium

COMM = MPI.COMM_WORLD
Q = 1e6
SOFT, STIFF = 1e8, 1e16
STIFF_IN_SPACE = 1e14  # a larger contrast is lost in the factors of a PETSc without CHOLMOD
ROUNDED = 1e-6  # the ground gives way by SOFT / STIFF, which is felt where its facets are small


def pressed(
    mesh: Any, *, clamped: str, names: tuple[str, str], stiff: float = STIFF
) -> tuple[ContactSurface, Array]:
    """A soft block without Poisson's ratio on stiff ground under the pressure Q: (surface,
    pressures over Q)."""
    built, tags = build_mesh(mesh, COMM)
    materials = [
        (tags["lower"], LinearElastic(E=stiff, nu=0.0, rho=1.0)),
        (tags["upper"], LinearElastic(E=SOFT, nu=0.0, rho=1.0)),
    ]
    d = built.geometry.dim
    push = (0.0, -Q, 0.0)[:d]
    sideways = Prescribed(tags["upper_top"], components=(0, 2)[: d - 1])
    load = Traction(tags["upper_top"], push)
    system = assemble(built, materials, clamped=tags[clamped], prescribed=sideways, loads=load)
    surface = contact_pair(system, tags[names[0]], tags[names[1]], matching=DualMortar())
    state = static_equilibrium(ContactProblem(system, surface))
    return surface, surface.everywhere(state.r_n / surface.weights) / Q


@pytest.mark.parametrize("beyond", [0.1, 0.05, 0.01, 0.6, 0.9])
@pytest.mark.parametrize("simplices", [False, True])
def test_uniform_pressure_in_the_plane(beyond, simplices):
    """The block's ends are inside facets of the ground, which is side 1: by these shares of one
    beyond a node."""
    lower = BlockMesh(lengths=(2.0, 0.5), divisions=(20, 5), simplices=simplices)
    upper = BlockMesh(lengths=(1.0, 1.0), divisions=(23, 6), simplices=simplices)
    mesh = TwoBlocks(lower=lower, upper=upper, offset=(0.6 - 0.1 * beyond,))
    surface, pressures = pressed(mesh, clamped="lower_bottom", names=("lower_top", "upper_bottom"))
    assert pressures == pytest.approx(np.ones(surface.total), abs=ROUNDED)
    assert seen(surface).weights.sum() == pytest.approx(1.0, rel=1e-12)


@pytest.mark.long
@pytest.mark.parametrize(
    ("beyond", "angle", "simplices"),
    [
        (0.1, 0.0, False),
        (0.01, 0.0, True),
        (0.6, 0.0, False),
        (0.6, 0.0, True),
        (0.3, 0.4, False),
        (0.3, 0.4, True),
    ],
)
def test_uniform_pressure_in_space(beyond, angle, simplices):
    """The block's edges run through facets of the ground, along their sides or askew."""

    def turned(x: Array) -> Array:
        cos, sin = np.cos(angle), np.sin(angle)
        return np.column_stack(
            [cos * x[:, 0] - sin * x[:, 2], x[:, 1], sin * x[:, 0] + cos * x[:, 2]]
        )

    at = -0.5 - 0.25 * beyond
    lower = BlockMesh(
        lengths=(2.0, 0.5, 2.0), divisions=(8, 2, 8), corner=(-1.0, -0.5, -1.0), simplices=simplices
    )
    upper = BlockMesh(
        lengths=(1.0, 1.0, 1.0),
        divisions=(9, 2, 9),
        corner=(at, 0.0, at),
        simplices=simplices,
        deform=turned,
    )
    mesh = Blocks({"lower": lower, "upper": upper})
    names = ("lower_top", "upper_bottom")
    surface, pressures = pressed(mesh, clamped="lower_bottom", names=names, stiff=STIFF_IN_SPACE)
    assert pressures == pytest.approx(np.ones(surface.total), abs=1e-5)
    assert seen(surface).weights.sum() == pytest.approx(1.0, rel=1e-6)  # less of a facet is nothing


def on_soil(cells: int, names: tuple[str, str]) -> tuple[ContactSurface, Array, Array]:
    """A wall under its weight and a lateral load on soil of so many cells along 10 m: (surface,
    reactions, pressures [Pa]) of the conditions of all ranks."""
    lower = BlockMesh(lengths=(10.0, 4.0), divisions=(cells, 8))
    upper = BlockMesh(lengths=(2.0, 4.0), divisions=(8, 16))
    mesh, tags = build_mesh(TwoBlocks(lower=lower, upper=upper, offset=(4.03,)), COMM)
    soil, wall = (
        LinearElastic(E=1.5e8, nu=0.3, rho=1900.0),
        LinearElastic(E=2.5e10, nu=0.2, rho=2400.0),
    )
    load = Traction(tags["upper_left"], (8e3, 0.0))
    system = assemble(
        mesh,
        [(tags["lower"], soil), (tags["upper"], wall)],
        clamped=tags["lower_bottom"],
        loads=load,
    )
    system = with_weight(system, bodies=bodies_of(system, tags["upper"]))
    surface = contact_pair(system, tags[names[0]], tags[names[1]], matching=DualMortar())
    state = static_equilibrium(ContactProblem(system, surface, friction=Coulomb(0.6)))
    whole, r_n = surface.whole(), surface.everywhere(state.r_n)
    return whole, r_n, r_n / whole.weights


@pytest.mark.serial
@pytest.mark.parametrize("cells", [40, 43, 80, 87])
def test_toe_of_a_wall_whichever_side_is_named_first(cells):
    """The force on the last eighth of the base, as a mean pressure: the edge is singular, so that a
    mean over a smaller patch is larger."""
    found = {}
    for names in (("upper_bottom", "lower_top"), ("lower_top", "upper_bottom")):
        surface, r_n, pressures = on_soil(cells, names)
        ends = np.concatenate([[4.03], 4.03 + np.cumsum(surface.weights)])
        force = np.interp(6.03, ends, np.cumsum([0.0, *r_n])) - np.interp(
            5.905, ends, np.cumsum([0.0, *r_n])
        )
        found[names[0]] = force / 0.125
        assert r_n.sum() == pytest.approx(188288.0, rel=1e-5)
        assert pressures.max() == pytest.approx(430e3, rel=0.3)
    assert found["lower_top"] == pytest.approx(found["upper_bottom"], rel=0.15)
