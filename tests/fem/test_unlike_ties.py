"""Ties of boundaries that are not meshed alike: a constant stress passes through them to round-off,
forces and moments balance, and any number of ranks gives the same."""

from __future__ import annotations

import numpy as np
import pytest
from fem_problems import field, linear

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.meshes.block import BlockMesh
from vi_contact.meshes.two_blocks import Blocks, TwoBlocks

E, NU = 1e9, 0.3
STONE = vc.LinearElastic(E=E, nu=NU, rho=2000.0)
STRESS = np.array([[2e5, 3e5, -1e5], [3e5, -4e5, 2e5], [-1e5, 2e5, 1e5]])  # Pa, full
NORMALS = {
    "left": (-1.0, 0.0, 0.0),
    "right": (1.0, 0.0, 0.0),
    "bottom": (0.0, -1.0, 0.0),
    "top": (0.0, 1.0, 0.0),
    "back": (0.0, 0.0, -1.0),
    "front": (0.0, 0.0, 1.0),
}
MORTAR = fem.DualMortar()


def strain(d):
    """The strain (d, d) of the constant stress, in plane strain where d = 2."""
    stress = STRESS[:d, :d]
    beside = NU * np.trace(stress) * (1.0 + NU if d == 2 else 1.0)
    return ((1.0 + NU) * stress - beside * np.eye(d)) / E


def pulled(tags, d, inner):
    """The tractions of the constant stress on all outer sides, those of ``inner`` left out."""
    loads = []
    for name, group in tags.items():
        side = name.rsplit("_", 1)[-1]
        if side in NORMALS and name not in inner:
            loads.append(fem.Traction(group, tuple(STRESS[:d, :d] @ NORMALS[side][:d])))
    return loads


def errors(system, d):
    """Residual of the constant stress over its largest force, and of its displacements, which
    followers must have, over the strain."""
    space, comm = system.space, system.space.comm
    exact = space.points @ strain(d).T
    u = space.restrict(exact)
    force = system.load(0.0)
    residual = comm.max(np.abs(system.K @ u - force).max(initial=0.0))
    wrong = comm.max(np.abs(space.expand(u, 0.0) - exact).max(initial=0.0))
    return residual / comm.max(np.abs(force).max(initial=0.0)), wrong / np.abs(strain(d)).max()


def rigid_error(system):
    """How far followers are from rigid motions of the whole, and the forces that these meet."""
    space, comm = system.space, system.space.comm
    x, d = space.points, space.dimension
    motions = [np.tile(e, (len(x), 1)) for e in np.eye(d)]
    for i, j in [(0, 1), (1, 2), (2, 0)][: 3 if d == 3 else 1]:
        turn = np.zeros_like(x)
        turn[:, i], turn[:, j] = -x[:, j], x[:, i]
        motions.append(turn)
    wrong = []
    for motion in motions:
        u = space.restrict(motion)
        wrong.append(comm.max(np.abs(space.expand(u, 0.0) - motion).max(initial=0.0)))
        stiffness = comm.max(np.abs(system.K.diagonal()).max(initial=0.0))
        wrong.append(comm.max(np.abs(system.K @ u).max(initial=0.0)) / stiffness)
    return max(wrong)


def stack(comm, d, degree, *, simplices=False, deform=None, **tie):
    """Two blocks, 4 x 2 (x 2) and 6 x 3 (x 3) cells, one on the other."""
    lower, upper = (
        BlockMesh(
            lengths=(2.0, 1.0, 1.5)[:d], divisions=n[:d], simplices=simplices, deform=deform
        )
        for n in ((4, 2, 2), (6, 3, 3))
    )
    mesh, tags = fem.build_mesh(TwoBlocks(lower=lower, upper=upper), comm)
    sides = (tags["lower_top"], tags["upper_bottom"])
    return mesh, tags, fem.Tied(*sides, matching=MORTAR, **tie)


@pytest.mark.two_ranks
@pytest.mark.parametrize("simplices", [False, True])
@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("d", [2, 3])
def test_a_constant_stress_passes(comm, d, degree, simplices):
    """Six components of stress, statics and displacements exact to round-off on both orders."""
    mesh, tags, tie = stack(comm, d, degree, simplices=simplices)
    loads = pulled(tags, d, ("lower_top", "upper_bottom"))
    system = fem.assemble(mesh, STONE, tied=tie, loads=loads, degree=degree)
    residual, wrong = errors(system, d)
    assert residual < 1e-12 and wrong < 1e-13
    assert rigid_error(system) < 1e-13


@pytest.mark.parametrize("d", [2, 3])
def test_a_constant_stress_passes_a_kink(comm, d):
    """Both blocks have the kink of their face at a node, x = 1, and all other nodes elsewhere."""

    def roof(x):
        lift = 0.3 * (1.0 - np.abs(x[:, 0] - 1.0)) * (1.0 - np.abs(x[:, 1] - 1.0))
        return x + np.outer(lift, np.eye(d)[1])

    blocks = {
        name: BlockMesh(
            lengths=(2.0, 1.0, 1.5)[:d],
            divisions=n[:d],
            corner=(0.0, float(name == "upper"), 0.0)[:d],
            deform=roof,
        )
        for name, n in (("lower", (4, 2, 2)), ("upper", (6, 3, 3)))
    }
    mesh, tags = fem.build_mesh(Blocks(blocks), comm)
    joint = ("lower_top", "upper_bottom")
    tie = fem.Tied(*(tags[name] for name in joint), matching=MORTAR)
    system = fem.assemble(mesh, STONE, tied=tie, loads=pulled(tags, d, joint))
    residual, wrong = errors(system, d)
    assert residual < 1e-12 and wrong < 1e-13


@pytest.mark.parametrize("degree", [1, 2])
@pytest.mark.parametrize("d", [2, 3])
def test_forces_and_moments_balance_on_a_curve(comm, d, degree):
    """Chords of an arc do not lie in each other: rigid motions meet no forces all the same, so that
    every force and moment that one block gets is what the other one loses. With a gap too."""

    beside = 0.05 if d == 3 else 0.0

    def bent(x):
        return x + np.outer(0.1 * (x[:, 0] - 1.0) ** 2 + beside * x[:, -1] ** 2, np.eye(d)[1])

    for gap in (0.0, 0.05):
        lower, upper = (
            BlockMesh(
                lengths=(2.0, 1.0, 1.5)[:d],
                divisions=n[:d],
                simplices=d == 3,
                deform=bent,
            )
            for n in ((4, 1, 2), (6, 1, 3))
        )
        mesh, tags = fem.build_mesh(TwoBlocks(lower=lower, upper=upper, gap=gap), comm)
        tie = fem.Tied(tags["lower_top"], tags["upper_bottom"], matching=MORTAR)
        system = fem.assemble(mesh, STONE, tied=tie, degree=degree)
        assert rigid_error(system) < 1e-12


@pytest.mark.two_ranks
@pytest.mark.parametrize("d", [2, 3])
def test_small_on_large_and_partly_covered(comm, d):
    """The side that is covered wholly follows, whatever its place; blocks that cover each other in
    part are exact for a constant strain at all nodes that follow."""
    small = BlockMesh(lengths=(1.0, 1.0, 1.5)[:d], divisions=(3, 3, 3)[:d])
    large = BlockMesh(lengths=(4.0, 1.0, 1.5)[:d], divisions=(8, 2, 2)[:d])
    offset = (1.5, 0.0)[: d - 1]
    mesh, tags = fem.build_mesh(TwoBlocks(lower=large, upper=small, offset=offset), comm)
    systems = [
        fem.assemble(mesh, STONE, tied=fem.Tied(one, two, matching=MORTAR))
        for one, two in (
            (tags["lower_top"], tags["upper_bottom"]),
            (tags["upper_bottom"], tags["lower_top"]),
        )
    ]
    assert systems[0].space.unknowns == systems[1].space.unknowns
    for system in systems:
        assert rigid_error(system) < 1e-12 and errors_of_followers(system, d) < 1e-12
    # a push on top of the small block reaches the foot of the large one: 1e5 Pa on its area
    push = fem.Traction(tags["upper_top"], tuple(-1e5 * np.eye(d)[1]))
    held = fem.assemble(
        mesh,
        STONE,
        tied=fem.Tied(tags["upper_bottom"], tags["lower_top"], matching=MORTAR),
        clamped=tags["lower_bottom"],
        loads=push,
    )
    area = 1.0 if d == 2 else 1.5
    lift = foot_force(held, tags["lower_bottom"], push, d)
    assert lift == pytest.approx(1e5 * area, rel=1e-11)
    # shifted: 1.3 and 1.7 of 4 columns of facets in front of nothing
    other = BlockMesh(lengths=(4.0, 1.0, 1.5)[:d], divisions=(7, 2, 3)[:d])
    mesh, tags = fem.build_mesh(
        TwoBlocks(lower=large, upper=other, offset=(1.3, 0.4)[: d - 1]), comm
    )
    tie = fem.Tied(tags["lower_top"], tags["upper_bottom"], matching=MORTAR)
    system = fem.assemble(mesh, STONE, tied=tie)
    assert rigid_error(system) < 1e-12 and errors_of_followers(system, d) < 1e-12


def errors_of_followers(system, d):
    """How far followers are from a constant strain, over it."""
    space = system.space
    exact = space.points @ strain(d).T
    wrong = np.abs(space.expand(space.restrict(exact), 0.0) - exact).max(initial=0.0)
    return space.comm.max(wrong) / np.abs(strain(d)).max()


def foot_force(system, group, load, d):
    """The vertical force of the support [N] in statics under a load."""
    problem = linear(system)
    state = vc.static_equilibrium(problem)
    recorder = vc.Reactions("foot", group, (0.0,) * d, loads=load)
    return recorder.start(problem, state)["reaction_y_foot"]


@pytest.mark.two_ranks
@pytest.mark.parametrize("d", [2, 3])
def test_ties_that_cross(comm, d):
    """Four blocks round an edge, four ties, all meshes unlike: in the plane, and in space where
    nodes of the edge coincide, a constant stress passes."""
    corners = {"a": (0.0, 0.0), "b": (1.0, 0.0), "c": (1.0, 1.0), "d": (0.0, 1.0)}
    divisions = {"a": (2, 2), "b": (3, 4), "c": (2, 3), "d": (4, 3)}
    blocks = {
        name: BlockMesh(
            lengths=(1.0, 1.0, 1.0)[:d],
            divisions=(*divisions[name], 2)[:d],
            corner=(*corner, 0.0)[:d],
            simplices=True,
        )
        for name, corner in corners.items()
    }
    mesh, tags = fem.build_mesh(Blocks(blocks), comm)
    joints = [("a_right", "b_left"), ("b_top", "c_bottom"), ("c_left", "d_right"), ("d_bottom", "a_top")]
    ties = [fem.Tied(tags[one], tags[two], matching=MORTAR) for one, two in joints]
    loads = pulled(tags, d, [name for joint in joints for name in joint])
    system = fem.assemble(mesh, STONE, tied=ties, loads=loads)
    residual, wrong = errors(system, d)
    assert residual < 1e-12 and wrong < 1e-12
    assert rigid_error(system) < 1e-12


@pytest.mark.two_ranks
@pytest.mark.parametrize("d", [2, 3])
def test_held_sides_beside_a_tie(comm, d):
    """Confined compression between rollers that hold one block's side from x = 0 on, at the tie
    too: uniaxial strain is exact. A roller that pushes the sides of both blocks moves what follows
    it, and supports take all forces."""
    mesh, tags, tie = stack(comm, d, 1)
    sides = [(body, side) for body in ("lower", "upper") for side in NORMALS]
    rollers = []
    for body, side in sides:
        axis = int(np.argmax(np.abs(NORMALS[side])))
        name = f"{body}_{side}"
        if name in tags and axis != 1:
            rollers.append(fem.Prescribed(tags[name], components=(axis,)))
    push = fem.Traction(tags["upper_top"], tuple(-1e5 * np.eye(d)[1]))
    foot = fem.Prescribed(tags["lower_bottom"], components=(1,))
    system = fem.assemble(mesh, STONE, tied=tie, loads=push, prescribed=[foot, *rollers])
    points, u = field(system, system.algebra.factor(system.K).solve(system.load(0.0)))
    confined = STONE.rho * STONE.c_p**2
    exact = -1e5 / confined * np.outer(points[:, 1], np.eye(d)[1])
    assert np.abs(u - exact).max() < 1e-12 * 1e5 / confined
    # settle the foot and lean the left sides: rigid motions and shear of what moves with them
    lean = [
        fem.Prescribed(tags[f"{body}_left"], (0.01, 0.02, 0.03)[:d]) for body in ("lower", "upper")
    ]
    system = fem.assemble(mesh, STONE, tied=tie, prescribed=lean)
    problem = linear(system)
    state = vc.static_equilibrium(problem)
    points, u = field(system, problem.cartesian(state.u))
    assert np.abs(u - np.array([0.01, 0.02, 0.03][:d])).max() < 1e-12
    system = fem.assemble(mesh, STONE, tied=tie, prescribed=lean, loads=push)
    problem = linear(system)
    state = vc.static_equilibrium(problem)
    carried = sum(
        vc.Reactions("side", tags[f"{body}_left"], (0.0,) * d, loads=push).start(problem, state)[
            "reaction_y_side"
        ]
        for body in ("lower", "upper")
    )
    assert carried == pytest.approx(1e5 * (2.0 if d == 2 else 3.0), rel=1e-10)
