"""Tied sides: nodes at the same height move together, on any number of ranks, and are one column of
soil then."""

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
from vi_contact.meshes.two_blocks import TwoBlocks
from vi_contact.practice.soil.soil_column import SoilColumn


@pytest.mark.parametrize("simplices", [False, True])
def test_tied_layers_are_a_column(comm, simplices):
    """Two layers, Rayleigh damping, both directions at once: the column of soil_column, to
    round-off."""
    mesh, tags = strip(comm, 3.0, 8.0, (2, 8), simplices=simplices)
    soft = fem.Cells("soft", np.flatnonzero(middles(mesh)[:, 1] > 4.0).astype(np.int32), mesh)
    stiff = fem.Cells("stiff", np.flatnonzero(middles(mesh)[:, 1] < 4.0).astype(np.int32), mesh)
    damping = vc.Rayleigh(0.8, 1e-3)
    system = fem.assemble(
        mesh,
        [(stiff, STIFF), (soft, SOIL)],
        clamped=tags["bottom"],
        tied=fem.Tied(tags["left"], tags["right"]),
        damping=damping,
    )
    assert system.space.unknowns == 2 * 2 * 8 and not system.floating
    heights = np.arange(9.0)
    points = [(x, y) for y in heights for x in (0.0, 1.5, 3.0)]
    found = history(linear(system, excitation=SHAKE), points, dt=2e-3, steps=150)
    layers = [STIFF] * 4 + [SOIL] * 4
    column = SoilColumn(
        heights, *np.array([(m.lame_lambda, m.shear_modulus, m.rho, 0.8, 1e-3) for m in layers]).T
    )
    problem = column.on_rigid_base(lambda t: np.sum([one(t) for one in SHAKE], axis=0))
    exact = np.array([state.u for state, _ in vc.march(problem, dt=2e-3, steps=150)]).reshape(
        150, 8, 2
    )
    for x in range(3):
        assert np.abs(found[:, x::3][:, 1:] - exact).max() < 1e-11 * np.abs(exact).max()
    assert not found[:, :3].any()


SHAKE_IN_SPACE = tuple(
    vc.Ricker(2.0, f, direction=tuple(e)) for f, e in zip((4.0, 6.0, 5.0), np.eye(3), strict=True)
)
ROUND = [("left", "right"), ("back", "front")]  # pairs of vertical sides of a box


@pytest.mark.two_ranks
@pytest.mark.parametrize(
    "simplices, solver", [(False, vc.Condensed()), (True, vc.Iterative(tolerance=1e-12))]
)
def test_tied_box_is_a_column(comm, simplices, solver):
    """All three components at once, two layers, damping: four vertical edges are one, and all is
    the column."""
    mesh, tags = block(comm, lengths=(2.0, 6.0, 3.0), divisions=(2, 6, 3), simplices=simplices)
    soft, stiff = (
        fem.Cells("cells", np.flatnonzero(m).astype(np.int32), mesh)
        for m in (middles(mesh)[:, 1] > 3.0, middles(mesh)[:, 1] < 3.0)
    )
    system = fem.assemble(
        mesh,
        [(stiff, STIFF), (soft, SOIL)],
        clamped=tags["bottom"],
        damping=vc.Rayleigh(0.8, 1e-3),
        tied=[fem.Tied(tags[one], tags[two]) for one, two in ROUND],
    )
    assert system.space.unknowns == 3 * 2 * 3 * 6
    heights = np.arange(7.0)
    points = [(x, y, z) for y in heights[1:] for x in (0.0, 1.0, 2.0) for z in (0.0, 1.0, 3.0)]
    run = {"dt": 5e-3, "steps": 60}
    found = history(
        linear(system, excitation=SHAKE_IN_SPACE), points, solver=solver, **run
    ).reshape(60, 6, 9, 3)
    layers = [STIFF] * 3 + [SOIL] * 3
    column = SoilColumn(
        heights, *np.array([(m.lame_lambda, m.shear_modulus, m.rho, 0.8, 1e-3) for m in layers]).T
    )
    for plane in ([0, 1], [2, 1]):
        problem = column.on_rigid_base(
            lambda t, c=plane: np.sum([one(t) for one in SHAKE_IN_SPACE], axis=0)[c]
        )
        exact = np.array([state.u for state, _ in vc.march(problem, **run)]).reshape(60, 6, 1, 2)
        error = np.abs(found[..., plane] - exact).max(axis=(0, 1, 2)) / np.abs(exact).max(
            axis=(0, 1, 2)
        )
        assert error.max() < (1e-9 if isinstance(solver, vc.Iterative) else 1e-11)


def test_edges_of_a_box_move_as_one(comm):
    """An uneven push: opposite sides move alike, their four edges as one; which side is given first
    does not matter."""
    mesh, tags = block(comm, lengths=(2.0, 1.0, 3.0), divisions=(2, 2, 3), simplices=True)
    push = fem.Traction(
        tags["top"], lambda x, t: 1e4 * np.column_stack([x[:, 0], x[:, 2] - 1.0, x[:, 0] * x[:, 2]])
    )
    solved = []
    for ties in (ROUND, [pair[::-1] for pair in ROUND[::-1]], [*ROUND, ROUND[0]]):
        tied = [fem.Tied(tags[one], tags[two]) for one, two in ties]
        system = fem.assemble(mesh, SOIL, clamped=tags["bottom"], tied=tied, loads=push)
        points, u = field(system, system.algebra.factor(system.K).solve(system.load(0.0)))
        solved.append(u)
    assert max(np.abs(u - solved[0]).max() for u in solved) < 1e-12 * np.abs(solved[0]).max()
    for c, length in ((0, 2.0), (2, 3.0)):
        low, high = (solved[0][points[:, c] == x] for x in (0.0, length))
        assert np.array_equal(low, high)
    top = solved[0][points[:, 1] == 1.0]
    assert np.ptp(top, axis=0).min() > 0.01 * np.abs(top).max()
    edge = solved[0][
        (points[:, 1] == 1.0) & (points[:, 0] % 2.0 == 0.0) & (points[:, 2] % 3.0 == 0.0)
    ]
    assert len(edge) == 4 and np.array_equal(edge, np.tile(edge[0], (4, 1)))


@pytest.mark.two_ranks
def test_forces_on_one_side_act_on_the_pair(comm):
    """A traction on the second side, which has no unknowns of its own, moves both; one component
    tied, one not."""
    mesh, tags = block(comm, lengths=(2.0, 1.0), divisions=(4, 3))
    system = fem.assemble(
        mesh,
        SOIL,
        clamped=tags["bottom"],
        loads=fem.Traction(tags["right"], (1e4, 2e4)),
        tied=fem.Tied(tags["left"], tags["right"], components=(1,)),
    )
    points, u = field(system, system.algebra.factor(system.K).solve(system.load(0.0)))
    left, right = (u[points[:, 0] == x] for x in (0.0, 2.0))
    assert np.array_equal(left[:, 1], right[:, 1]) and left[-1, 1] > 0.0
    assert np.abs(left[1:, 0] - right[1:, 0]).min() > 0.1 * np.abs(right[:, 0]).max()
    reference = fem.assemble(
        mesh,
        SOIL,
        clamped=tags["bottom"],
        loads=fem.Traction(tags["left"], (0.0, 2e4)),
        tied=fem.Tied(tags["right"], tags["left"]),
    )
    other = fem.assemble(
        mesh,
        SOIL,
        clamped=tags["bottom"],
        loads=fem.Traction(tags["right"], (0.0, 2e4)),
        tied=fem.Tied(tags["left"], tags["right"]),
    )
    solved = [
        field(one, one.algebra.factor(one.K).solve(one.load(0.0)))[1] for one in (reference, other)
    ]
    assert np.abs(solved[0] - solved[1]).max() < 1e-12 * np.abs(solved[0]).max()


def test_contact_between_tied_sides(comm):
    """A periodic layer pressed on a plane carries its weight, on some points and, uniformly, on
    all; nodes that are tied in part, or to one elsewhere, are refused."""
    mesh, tags = block(comm, lengths=(2.0, 1.0), divisions=(4, 4))
    ties = fem.Tied(tags["left"], tags["right"])
    held = fem.Prescribed(tags["top"], components=(0,))
    system = fem.assemble(mesh, SOIL, tied=ties, prescribed=held, loads=fem.BodyForce((0.0, -2e4)))
    surface = fem.contact_surface(
        system, tags["bottom"], points=[(0.5, 0.0), (1.0, 0.0), (1.5, 0.0)]
    )
    state = vc.static_equilibrium(vc.ContactProblem(system, surface), solver=vc.Condensed())
    assert np.isclose(surface.everywhere(state.r_n).sum(), 4e4, rtol=1e-9)
    surface = fem.contact_surface(system, tags["bottom"])
    state = vc.static_equilibrium(vc.ContactProblem(system, surface), solver=vc.Condensed())
    assert surface.total == 4 and surface.everywhere(state.r_n) == pytest.approx(
        np.full(4, 1e4), rel=1e-9
    )
    with pytest.raises(
        InputError, match=r"\(2, 0\) of 'bottom' is tied to a node outside this contact: leave it"
    ):
        fem.contact_surface(system, tags["bottom"], points=[(2.0, 0.0), (1.0, 0.0)])
    system = fem.assemble(mesh, SOIL, tied=fem.Tied(tags["left"], tags["right"], components=(0,)))
    with pytest.raises(
        InputError, match=r"\(0, 0\) of 'bottom' is tied in some components only: leave it out"
    ):
        fem.contact_surface(system, tags["bottom"])


@pytest.mark.parametrize("graded", [False, True], ids=["alike", "unlike"])
@pytest.mark.parametrize("whole", [False, True], ids=["half", "whole"])
def test_a_tie_beside_a_contact_is_a_weld(comm, graded, whole):
    """The left half of an interface is tied, the right half, or all of it, is a contact.

    Nodes that are tied to the other side have no condition. Pressed by 1 MPa the pressure is 1 MPa;
    pulled the right half opens like a crack."""

    def right_graded(x):
        return np.column_stack(
            [np.where(x[:, 0] > 1.0, 1.0 + (x[:, 0] - 1.0) ** 1.5, x[:, 0]), x[:, 1]]
        )

    lower = BlockMesh(lengths=(2.0, 1.0), divisions=(8, 4))
    upper = BlockMesh(lengths=(2.0, 1.0), divisions=(8, 4), deform=right_graded if graded else None)
    mesh, tags = fem.build_mesh(TwoBlocks(lower=lower, upper=upper), comm)
    tops, bottoms = tags["lower_top"], tags["upper_bottom"]
    halves = {}
    for name, group in (("top", tops), ("bottom", bottoms)):
        x = facet_middles(mesh, group)
        halves[name] = [
            fem.Facets(f"{name}_{side}", group.indices[mask], mesh)
            for side, mask in (("left", x < 1.0), ("right", x > 1.0))
        ]
    one, two = (bottoms, tops) if whole else (halves["bottom"][1], halves["top"][1])
    material = vc.LinearElastic(E=1e9, nu=0.0, rho=2000.0)
    found = {}
    for load in (-1e6, 1e6):
        pressed = fem.Traction(tags["upper_top"], (0.0, load))
        system = fem.assemble(
            mesh,
            material,
            clamped=tags["lower_bottom"],
            loads=pressed,
            tied=fem.Tied(halves["top"][0], halves["bottom"][0]),
        )
        surface = fem.contact_pair(system, one, two, matching=fem.DualMortar() if graded else None)
        assert surface.total == 4 and len(surface.censuses[0].places["tied to the other side"]) == (
            5 if whole else 1
        )
        problem = vc.ContactProblem(system, surface)
        state = vc.static_equilibrium(problem)
        found[load] = surface.everywhere(state.r_n / surface.weights)
        corner = np.sort(displacements_at(system, problem.cartesian(state.u), (2.0, 1.0)))
        # of the mesh that is cut open
        expected = (-1e-3, -1e-3) if load < 0.0 else (-0.09695e-3, 17.24968e-3)
        if load < 0.0 or not graded:
            assert corner == pytest.approx(expected, abs=1e-8)
    assert found[1e6] == pytest.approx(np.zeros(4), abs=1e-3)
    assert found[-1e6] == pytest.approx(np.full(4, 1e6), rel=1e-9)


def facet_middles(mesh, group):
    import dolfinx

    mesh.topology.create_connectivity(1, 2)
    return dolfinx.mesh.compute_midpoints(mesh, 1, group.indices)[:, 0]


def displacements_at(system, u, point):
    """Vertical displacements of all nodes at a point, on every rank."""
    points, values = field(system, u)
    return values[np.linalg.norm(points - np.array(point), axis=1) < 1e-9, 1]


@pytest.mark.two_ranks
@pytest.mark.parametrize("solver", [vc.Condensed(), vc.Iterative(tolerance=1e-12)])
def test_contact_with_a_boundary_that_is_tied_at_its_edges(comm, solver):
    """A box pressed on all of a tied layer, meshes that do not match: confined compression, exact
    at the nodes of the layer also where they are tied; with the box tied too, a uniform pressure on
    conditions that are there once."""
    lower, upper = (BlockMesh(lengths=(2.0, 1.0, 2.0), divisions=(n, 2, n)) for n in (2, 3))
    mesh, tags = fem.build_mesh(TwoBlocks(lower=lower, upper=upper), comm)
    ties = {
        name: [fem.Tied(tags[f"{name}_{a}"], tags[f"{name}_{b}"]) for a, b in ROUND]
        for name in ("lower", "upper")
    }
    data = {
        "clamped": tags["lower_bottom"],
        "loads": fem.Traction(tags["upper_top"], (0.0, -2e4, 0.0)),
    }
    sides, matching = (tags["upper_bottom"], tags["lower_top"]), fem.DualMortar()
    system = fem.assemble(mesh, SOIL, tied=ties["lower"], **data)
    problem = vc.ContactProblem(system, fem.contact_pair(system, *sides, matching=matching))
    state = vc.static_equilibrium(problem, solver=solver)
    points, u = field(system, problem.cartesian(state.u))
    confined = SOIL.rho * SOIL.c_p**2
    layer = np.isin(np.arange(len(points)), np.arange(3 * 3 * 3)) & (points[:, 1] == 1.0)
    settled = -2e4 * 1.0 / confined
    assert layer.sum() == 9 and np.abs(u[layer] - [0.0, settled, 0.0]).max() < 1e-9 * abs(settled)
    both = fem.assemble(mesh, SOIL, tied=ties["lower"] + ties["upper"], **data)
    problem = vc.ContactProblem(both, fem.contact_pair(both, *sides, matching=matching))
    state = vc.static_equilibrium(problem, solver=solver)
    assert problem.surface.total == 9
    assert problem.surface.everywhere(state.r_n / problem.surface.weights) == pytest.approx(
        np.full(9, 2e4), rel=1e-9
    )


@pytest.mark.two_ranks
def test_mass_beside_a_tie_is_handed_over_alike(comm):
    """A periodic block falls on a plane: left and right contact points press alike, tied ones too;
    mass is kept."""
    mesh, tags = block(comm, lengths=(2.0, 1.0), divisions=(4, 4))
    system = fem.assemble(
        mesh, SOIL, tied=fem.Tied(tags["left"], tags["right"]), initial_velocity=(0.0, -0.5)
    )
    plane = vc.HalfSpace((0.0, -1e-4), (0.0, 1.0))
    for points in (None, [(x, 0.0) for x in (0.5, 1.0, 1.5)]):
        surface = fem.contact_surface(system, tags["bottom"], points=points, obstacle=plane)
        problem = vc.ContactProblem(system, surface, mass=vc.Redistributed())
        for r in problem.equations.influence.T:
            mass = problem.equations.algebra.dot(r, problem.equations.M @ r)
            assert np.isclose(mass, 2.0 * SOIL.rho, rtol=1e-12)
        steps = vc.march(problem, dt=2e-5, steps=200)
        reactions = np.array([surface.everywhere(state.r_n) for state, _ in steps])[
            :, surface.total - 3 :
        ]
        assert reactions.max() > 0.0
        assert np.abs(reactions[:, 0] - reactions[:, 2]).max() < 1e-10 * reactions.max()


@pytest.mark.two_ranks
def test_what_does_not_fit_is_refused(comm):
    """Sides meshed differently, held on one side only, not opposite, components that do not
    exist."""

    def bent(x):
        return x + np.outer(0.02 * x[:, 0] * np.sin(np.pi * x[:, 1]), [0.0, 1.0])

    mesh, tags = fem.build_mesh(BlockMesh(lengths=(2.0, 1.0), divisions=(4, 4), deform=bent), comm)
    tie = fem.Tied(tags["left"], tags["right"])
    with pytest.raises(InputError, match="no partner opposite it"):
        fem.assemble(mesh, SOIL, tied=tie)
    with pytest.raises(InputError, match="5 and 25 nodes|5 and 9 nodes|have 5 and"):
        fem.assemble(mesh, SOIL, tied=fem.Tied(tags["left"], whole_boundary(tags, mesh)))
    mesh, tags = block(comm, lengths=(2.0, 1.0), divisions=(4, 4))
    tie = fem.Tied(tags["left"], tags["right"])
    with pytest.raises(InputError, match="prescribed on one side only"):
        fem.assemble(mesh, SOIL, tied=tie, clamped=tags["left"])
    with pytest.raises(
        InputError, match=r"'left' and 'bottom' share the node \(0, 0\): tie boundaries without"
    ):
        fem.assemble(mesh, SOIL, tied=fem.Tied(tags["left"], tags["bottom"]))
    with pytest.raises(InputError, match="component 2 does not exist"):
        fem.assemble(mesh, SOIL, tied=fem.Tied(tags["left"], tags["right"], components=(2,)))


def test_sides_of_a_box_that_do_not_fit_are_refused(comm):
    """Sides with as many nodes elsewhere; an edge held although its partners are free; one side
    with itself."""

    def bent(x):
        return x + np.outer(0.02 * x[:, 0] * np.sin(np.pi * x[:, 1]), [0.0, 0.0, 1.0])

    mesh, tags = block(comm, lengths=(2.0, 1.0, 2.0), divisions=(2, 2, 2), deform=bent)
    tie = fem.Tied(tags["left"], tags["right"])
    with pytest.raises(
        InputError, match="no partner opposite it on the other: mesh both sides alike"
    ):
        fem.assemble(mesh, SOIL, tied=tie)
    mesh, tags = block(comm, lengths=(2.0, 1.0, 2.0), divisions=(2, 2, 2))
    tied = [fem.Tied(tags[one], tags[two]) for one, two in ROUND]
    with pytest.raises(
        InputError, match="component 0 of a tied node is prescribed on one side only"
    ):
        fem.assemble(
            mesh, SOIL, tied=tied[1], prescribed=fem.Prescribed(tags["front"], components=(0,))
        )
    with pytest.raises(InputError, match="'left' and 'left' share the node"):
        fem.assemble(mesh, SOIL, tied=fem.Tied(tags["left"], tags["left"]))


def whole_boundary(tags, mesh):
    sides = [tags[name].indices for name in ("left", "right", "bottom", "top")]
    return fem.Facets("all", np.unique(np.concatenate(sides)).astype(np.int32), mesh)
