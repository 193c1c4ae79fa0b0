"""Nodes of several bodies at one place: which of them a node of side 1 faces, and where no single
one is right."""

import numpy as np
import pytest
from mpi4py import MPI

import vi_contact as vc
from vi_contact import fem
from vi_contact.core.errors import InputError
from vi_contact.meshes import BlockMesh, Blocks

COMM = MPI.COMM_WORLD
STONE = vc.LinearElastic(E=1e9, nu=0.0, rho=2000.0)


def facets(mesh, tags, *names):
    return fem.Facets("+".join(names), np.concatenate([tags[name].indices for name in names]), mesh)


def stone(x, y, length=1.0, height=1.0, d=2, gap=0.0):
    """Return a stone of cells of a quarter of a metre, with its corner at (x, y)."""
    lengths, divisions = [length, height], [round(4 * length), round(4 * height)]
    if d == 3:
        lengths, divisions = [*lengths, 0.5], [*divisions, 2]
    return BlockMesh(
        lengths=tuple(lengths), divisions=tuple(divisions), corner=(x, y + gap, 0.0)[:d]
    )


def bond(d, joint=0.0, order=("a", "b")):
    """Return (mesh, tags, system) of one stone above the joint between two stones, under 1 MPa."""
    lower = {"a": stone(0.0, 0.0, d=d), "b": stone(1.0 + joint, 0.0, d=d)}
    blocks = {"up": stone(0.0, 1.0, 2.0, 0.5, d)} | {name: lower[name] for name in order}
    mesh, tags = fem.build_mesh(Blocks(blocks), COMM)
    push = (0.0, -1e6, 0.0)[:d]
    sideways = [fem.Prescribed(tags["up_left"], components=(0,))]
    if d == 3:
        sideways.append(fem.Prescribed(tags["up_back"], components=(2,)))
    system = fem.assemble(
        mesh,
        STONE,
        clamped=[tags["a_bottom"], tags["b_bottom"]],
        prescribed=sideways,
        loads=fem.Traction(tags["up_top"], push),
    )
    return mesh, tags, system


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("order", ["ab", "ba"])
@pytest.mark.parametrize("matching", [None, fem.DualMortar()], ids=["nodes", "mortar"])
@pytest.mark.parametrize("upside_down", [False, True])
def test_a_stone_on_two_stones_faces_both(d, order, matching, upside_down):
    """The node above the joint has a condition for each stone, with the weight of its facets: the
    pressure is uniform, in either order of the bodies and of the sides."""
    mesh, tags, system = bond(d, order=tuple(order))
    sides = (tags["up_bottom"], facets(mesh, tags, "a_top", "b_top"))
    sides = sides[::-1] if upside_down else sides
    surface = fem.contact_pair(system, *sides, matching=matching)
    state = vc.static_equilibrium(vc.ContactProblem(system, surface))
    pressure = surface.everywhere(state.r_n) / surface.everywhere(surface.weights)
    assert pressure == pytest.approx(np.full(surface.total, 1e6), rel=1e-9)
    whole = 2.0 * (0.5 if d == 3 else 1.0)
    assert surface.everywhere(surface.weights).sum() == pytest.approx(whole, rel=1e-12)


def test_over_a_joint_of_finite_width_both_are_faced_too():
    """The joint is 1 mm wide, a 250th of a facet: pressures differ by as little."""
    mesh, tags, system = bond(2, joint=1e-3)
    surface = fem.contact_pair(system, tags["up_bottom"], facets(mesh, tags, "a_top", "b_top"))
    state = vc.static_equilibrium(vc.ContactProblem(system, surface))
    pressure = surface.everywhere(state.r_n) / surface.everywhere(surface.weights)
    assert len(pressure) == 10
    assert pressure == pytest.approx(np.full(10, 1e6), rel=0.02)


@pytest.mark.parametrize("d", [2, 3])
def test_partners_that_share_facets_are_refused(d):
    """Two stones drawn over one another under a third one: which of them bears it is not said."""
    blocks = {name: stone(0.0, 0.0, d=d) for name in "ab"} | {"up": stone(0.0, 1.0, d=d)}
    mesh, tags = fem.build_mesh(Blocks(blocks), COMM)
    system = fem.assemble(mesh, STONE, clamped=[tags["a_bottom"], tags["b_bottom"]])
    with pytest.raises(
        InputError,
        match=r"the node of 'up_bottom' at .* faces several nodes of 'a_top\+b_top' at one place, "
        r"which have no facets of their own in front of it: use matching=DualMortar\(\)",
    ):
        fem.contact_pair(system, tags["up_bottom"], facets(mesh, tags, "a_top", "b_top"))


@pytest.mark.parametrize("d", [2, 3])
@pytest.mark.parametrize("gap", [0.0, 0.01])
def test_columns_of_stones_face_their_own(d, gap):
    """Two columns side by side, pressed by 1 and 2 MPa.

    At the corner that four stones share each node faces the stone of
    its own column, and neither feels the other."""
    blocks = {"a": stone(0.0, 0.0, d=d), "b": stone(1.0, 0.0, d=d)}
    blocks |= {"v": stone(1.0, 1.0, d=d, gap=gap), "u": stone(0.0, 1.0, d=d, gap=gap)}
    mesh, tags = fem.build_mesh(Blocks(blocks), COMM)
    loads = [
        fem.Traction(tags[f"{name}_top"], (0.0, -q, 0.0)[:d])
        for name, q in (("u", 1e6), ("v", 2e6))
    ]
    sideways = [
        fem.Prescribed(tags[f"{name}_{side}"], components=(c,))
        for name in "uv"
        for side, c in (("left", 0), ("back", 2))[: d - 1]
    ]
    system = fem.assemble(
        mesh, STONE, clamped=[tags["a_bottom"], tags["b_bottom"]], prescribed=sideways, loads=loads
    )
    one, two = facets(mesh, tags, "u_bottom", "v_bottom"), facets(mesh, tags, "a_top", "b_top")
    surface = fem.contact_pair(system, one, two)
    state = vc.static_equilibrium(vc.ContactProblem(system, surface))
    pressure = np.sort(surface.everywhere(state.r_n) / surface.everywhere(surface.weights))
    half = surface.total // 2
    assert pressure == pytest.approx(np.repeat([1e6, 2e6], half), rel=1e-8)


def test_a_stone_beside_another_column_faces_its_own():
    """Side 2 has the tops of both columns, side 1 the bottom of one stone: its corner faces its own
    column."""
    mesh, tags = fem.build_mesh(
        Blocks({"b": stone(1.0, 0.0), "a": stone(0.0, 0.0), "u": stone(0.0, 1.0)}), COMM
    )
    system = fem.assemble(
        mesh,
        STONE,
        clamped=[tags["a_bottom"], tags["b_bottom"]],
        prescribed=fem.Prescribed(tags["u_left"], components=(0,)),
        loads=fem.Traction(tags["u_top"], (0.0, -1e6)),
    )
    surface = fem.contact_pair(system, tags["u_bottom"], facets(mesh, tags, "a_top", "b_top"))
    state = vc.static_equilibrium(vc.ContactProblem(system, surface))
    pressure = surface.everywhere(state.r_n) / surface.everywhere(surface.weights)
    assert pressure == pytest.approx(np.full(5, 1e6), rel=1e-8)


def test_bars_have_one_partner_only():
    """Three bars of which two begin where the first one ends: the mortar method is no remedy
    there."""
    bar = BlockMesh(lengths=(1.0,), divisions=(2,))
    blocks = {
        "one": bar,
        "two": BlockMesh(lengths=(1.0,), divisions=(2,), corner=(1.0,)),
        "three": BlockMesh(lengths=(2.0,), divisions=(2,), corner=(1.0,)),
    }
    mesh, tags = fem.build_mesh(Blocks(blocks), COMM)
    system = fem.assemble(mesh, STONE, clamped=[tags["two_right"], tags["three_right"]])
    with pytest.raises(
        InputError,
        match="faces several nodes of 'two_left.three_left' at one place, and can touch one",
    ):
        fem.contact_pair(system, tags["one_right"], facets(mesh, tags, "two_left", "three_left"))
