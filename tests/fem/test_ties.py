"""Tied sides: nodes at the same height move together, on any number of ranks, and are one column of soil then."""

from __future__ import annotations

import numpy as np
import pytest
from fem_problems import block, field, linear
from layered import SHAKE, STIFF, middles
from soil import SOIL, history, strip

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.meshes.block import BlockMesh
from vi_contact.soil.soil_column import SoilColumn


@pytest.mark.parametrize("simplices", [False, True])
def test_tied_layers_are_a_column(comm, simplices):
    """Two layers, Rayleigh damping, both directions at once: the column of soil_column, to round-off."""
    mesh, tags = strip(comm, 3.0, 8.0, (2, 8), simplices=simplices)
    soft = fem.Cells("soft", np.flatnonzero(middles(mesh)[:, 1] > 4.0).astype(np.int32), mesh)
    stiff = fem.Cells("stiff", np.flatnonzero(middles(mesh)[:, 1] < 4.0).astype(np.int32), mesh)
    damping = vc.Rayleigh(0.8, 1e-3)
    system = fem.assemble(mesh, [(stiff, STIFF), (soft, SOIL)], clamped=tags["bottom"],
                          tied=fem.Tied(tags["left"], tags["right"]), damping=damping)
    assert system.space.unknowns == 2 * 2 * 8 and not system.floating
    heights = np.arange(9.0)
    points = [(x, y) for y in heights for x in (0.0, 1.5, 3.0)]
    found = history(linear(system, excitation=SHAKE), points, dt=2e-3, steps=150)
    layers = [STIFF] * 4 + [SOIL] * 4
    column = SoilColumn(heights, *np.array([(m.lame_lambda, m.shear_modulus, m.rho, 0.8, 1e-3) for m in layers]).T)
    problem = column.on_rigid_base(lambda t: np.sum([one(t) for one in SHAKE], axis=0))
    exact = np.array([state.u for state, _ in vc.march(problem, dt=2e-3, steps=150)]).reshape(150, 8, 2)
    for x in range(3):
        assert np.abs(found[:, x::3][:, 1:] - exact).max() < 1e-11 * np.abs(exact).max()
    assert not found[:, :3].any()


def test_forces_on_one_side_act_on_the_pair(comm):
    """A traction on the second side, which has no unknowns of its own, moves both; one component tied, one not."""
    mesh, tags = block(comm, lengths=(2.0, 1.0), divisions=(4, 3))
    system = fem.assemble(mesh, SOIL, clamped=tags["bottom"], loads=fem.Traction(tags["right"], (1e4, 2e4)),
                          tied=fem.Tied(tags["left"], tags["right"], components=(1,)))
    points, u = field(system, system.algebra.factor(system.K).solve(system.load(0.0)))
    left, right = (u[points[:, 0] == x] for x in (0.0, 2.0))
    assert np.array_equal(left[:, 1], right[:, 1]) and left[-1, 1] > 0.0
    assert np.abs(left[1:, 0] - right[1:, 0]).min() > 0.1 * np.abs(right[:, 0]).max()
    reference = fem.assemble(mesh, SOIL, clamped=tags["bottom"], loads=fem.Traction(tags["left"], (0.0, 2e4)),
                             tied=fem.Tied(tags["right"], tags["left"]))
    other = fem.assemble(mesh, SOIL, clamped=tags["bottom"], loads=fem.Traction(tags["right"], (0.0, 2e4)),
                         tied=fem.Tied(tags["left"], tags["right"]))
    solved = [field(one, one.algebra.factor(one.K).solve(one.load(0.0)))[1] for one in (reference, other)]
    assert np.abs(solved[0] - solved[1]).max() < 1e-12 * np.abs(solved[0]).max()


def test_contact_between_tied_sides(comm):
    """Contact nodes elsewhere: a periodic layer pressed on a plane carries its weight."""
    mesh, tags = block(comm, lengths=(2.0, 1.0), divisions=(4, 4))
    ties = fem.Tied(tags["left"], tags["right"])
    held = fem.Prescribed(tags["top"], components=(0,))
    system = fem.assemble(mesh, SOIL, tied=ties, prescribed=held, loads=fem.BodyForce((0.0, -2e4)))
    surface = fem.contact_surface(system, tags["bottom"], points=[(0.5, 0.0), (1.0, 0.0), (1.5, 0.0)])
    state = vc.static_equilibrium(vc.ContactProblem(system, surface), solver=vc.Condensed())
    assert np.isclose(surface.everywhere(state.r_n).sum(), 4e4, rtol=1e-9)
    with pytest.raises(InputError, match="is tied to another"):
        fem.contact_surface(system, tags["bottom"])


def test_mass_beside_a_tie_is_handed_over_alike(comm):
    """A periodic block falls on a plane: left and right contact points press alike, mass and energy are kept."""
    mesh, tags = block(comm, lengths=(2.0, 1.0), divisions=(4, 4))
    system = fem.assemble(mesh, SOIL, tied=fem.Tied(tags["left"], tags["right"]), initial_velocity=(0.0, -0.5))
    plane = vc.HalfSpace((0.0, -1e-4), (0.0, 1.0))
    surface = fem.contact_surface(system, tags["bottom"], points=[(x, 0.0) for x in (0.5, 1.0, 1.5)], obstacle=plane)
    problem = vc.ContactProblem(system, surface, mass=vc.Redistributed())
    for r in problem.equations.influence.T:
        mass = problem.equations.algebra.dot(r, problem.equations.M @ r)
        assert np.isclose(mass, 2.0 * SOIL.rho, rtol=1e-12)
    reactions = np.array([surface.everywhere(state.r_n) for state, _ in vc.march(problem, dt=2e-5, steps=200)])
    assert reactions.max() > 0.0
    assert np.abs(reactions[:, 0] - reactions[:, 2]).max() < 1e-10 * reactions.max()


def test_what_does_not_fit_is_refused(comm):
    """Sides meshed differently, held on one side only, tied twice, components that do not exist."""
    def bent(x):
        return x + np.outer(0.02 * x[:, 0] * np.sin(np.pi * x[:, 1]), [0.0, 1.0])

    mesh, tags = fem.build_mesh(BlockMesh(lengths=(2.0, 1.0), divisions=(4, 4), deform=bent), comm)
    tie = fem.Tied(tags["left"], tags["right"])
    with pytest.raises(InputError, match="no partner at the same height"):
        fem.assemble(mesh, SOIL, tied=tie)
    with pytest.raises(InputError, match="5 and 25 nodes|5 and 9 nodes|have 5 and"):
        fem.assemble(mesh, SOIL, tied=fem.Tied(tags["left"], whole_boundary(tags, mesh)))
    mesh, tags = block(comm, lengths=(2.0, 1.0), divisions=(4, 4))
    tie = fem.Tied(tags["left"], tags["right"])
    with pytest.raises(InputError, match="prescribed on one side only"):
        fem.assemble(mesh, SOIL, tied=tie, clamped=tags["left"])
    with pytest.raises(InputError, match="on several tied boundaries"):
        fem.assemble(mesh, SOIL, tied=[tie, fem.Tied(tags["bottom"], tags["top"])])
    with pytest.raises(InputError, match="component 2 does not exist"):
        fem.assemble(mesh, SOIL, tied=fem.Tied(tags["left"], tags["right"], components=(2,)))


def whole_boundary(tags, mesh):
    sides = [tags[name].indices for name in ("left", "right", "bottom", "top")]
    return fem.Facets("all", np.unique(np.concatenate(sides)).astype(np.int32), mesh)
